"""Comma-separated values: a line of names, then a line for each row."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from typing import BinaryIO

import numpy as np

from trajcli.columns import Column, require_finite, whole_number_columns
from trajcli.curves.piecewise import Array
from trajcli.errors import TrajcliError
from trajcli.streams.decimals import DECIMALS, Digits, FixedLayout, NotFixedError, encode_fixed, scan_fixed

_CHUNK = 1 << 18  # bytes read back at a time
_HALF_UNIT = 0.5e-9 + 1e-12  # the last decimal's half, and the first of the two roundings


def write_csv(
    rows: Iterable[Array], columns: Sequence[Column], out: BinaryIO, digits: Digits = "fixed"
) -> None:
    """Write blocks of rows, each of shape (N, m), under the names of their m columns.

    Args:
        rows: Blocks; they are taken one by one, so that memory does not grow with their number.
        columns: What the rows hold, in the units that the columns say.
        out: Where to.
        digits: Nine decimals, or as many as restore each float64 bit by bit.

    Raises:
        TrajcliError: When a value is not finite; its row and what follows are not written.
    """
    for _ in write_csv_blocks(rows, columns, out, digits):
        pass


def write_csv_blocks(
    rows: Iterable[Array], columns: Sequence[Column], out: BinaryIO, digits: Digits = "fixed"
) -> Iterator[Array]:
    """Write as `write_csv`, and yield each block as soon as its text has left for `out`."""
    encode = encoder_of(digits)
    whole_numbers = whole_number_columns(columns)
    out.write(_header(columns).encode())
    written = 0
    for block in rows:
        require_finite(block, columns, written)
        out.write(encode(block, whole_numbers))
        written += len(block)
        yield block


def verify_csv(
    written: BinaryIO, rows: Iterable[Array], columns: Sequence[Column], digits: Digits = "fixed"
) -> None:
    """Read a stream from its beginning and compare every number with the rows it was written from.

    Args:
        written: What `write_csv` wrote; it need hold a block only when that block has been taken from `rows`.
        rows: The same blocks once more.
        columns: As in `write_csv`.
        digits: As in `write_csv`.

    Raises:
        TrajcliError: When a name, a number or the count of rows differs; a number by more than half a unit of
            its last decimal, or by anything at all where the digits are full.
    """
    written.seek(0)
    blocks = _RowsReadBack(written, columns)
    count = 0
    for block in rows:
        if not (digits == "fixed" and blocks.skip(block)):
            _compare(blocks.take(len(block), count), block, columns, count, digits)
        count += len(block)
    blocks.expect_end(count)


def encoder_of(digits: Digits) -> Callable[[Array, Sequence[int]], bytes]:
    """Return the function that makes lines of rows (N, m), given which columns are whole numbers."""
    if digits == "fixed":
        return encode_fixed
    from trajcli.streams.number_cells import encode_full

    return encode_full


def _header(columns: Sequence[Column]) -> str:
    return ",".join(column.name for column in columns) + "\n"


class _RowsReadBack:
    """The rows of a stream, as many at a time as are asked for."""

    def __init__(self, stream: BinaryIO, columns: Sequence[Column]) -> None:
        self._stream = stream
        self._columns = columns
        self._width = len(columns)
        self._whole_numbers = whole_number_columns(columns)
        self._decimals = [DECIMALS * (k not in self._whole_numbers) for k in range(self._width)]
        self._left = np.empty((0, self._width))
        self._text = b""  # read, but not yet as rows

    def _expect_names(self) -> None:
        """Refuse another first line than the columns' names."""
        header = self._stream.readline().decode(errors="replace")
        if header != _header(self._columns):
            raise TrajcliError(f"the file read back begins with {header!r} instead of the columns' names")

    def skip(self, block: Array) -> bool:
        """Return whether the next rows are surely those of `block`; then they are taken."""
        if self._stream.tell() == 0:
            self._expect_names()
        if len(self._left) or self._text or len(block) == 0:
            return False
        layout = FixedLayout(block, self._whole_numbers)
        self._text = self._stream.read(layout.size)
        if not layout.agrees(self._text):
            return False
        self._text = b""
        return True

    def _next(self) -> Array | None:
        """Return some rows more; None where the stream ends, for now."""
        if self._stream.tell() == 0:
            self._expect_names()
        text = self._text or self._stream.read(_CHUNK)
        self._text = b""
        if not text:
            return None
        text += b"" if text.endswith(b"\n") else self._stream.readline()
        with suppress(NotFixedError):
            return scan_fixed(text, self._decimals)
        from trajcli.streams.number_cells import scan_decimals

        try:
            return scan_decimals(text, self._width)[0]
        except NotFixedError as error:
            message = "the file read back has lines that are no rows of as many numbers as were written"
            raise TrajcliError(message) from error

    def take(self, count: int, before: int) -> Array:
        """Return the next `count` rows; `before` is how many were taken before."""
        parts, available = [self._left], len(self._left)
        while available < count:
            block = self._next()
            if block is None:
                raise TrajcliError(
                    f"the file read back ends after {before + available} rows, but more were written"
                )
            parts.append(block)
            available += len(block)
        rows = np.concatenate(parts)
        self._left = rows[count:]
        return rows[:count]

    def expect_end(self, count: int) -> None:
        """Refuse rows after the first `count`."""
        if len(self._left) or self._next() is not None:
            raise TrajcliError(f"the file read back goes on after the {count} rows that were written")


def _compare(read: Array, rows: Array, columns: Sequence[Column], before: int, digits: Digits) -> None:
    if digits == "full":
        wrong = read.view(np.int64) != np.ascontiguousarray(rows).view(np.int64)
    else:
        wrong = ~(np.abs(read - rows) <= _HALF_UNIT + np.spacing(np.abs(rows)))
    if wrong.any():
        row, index = np.argwhere(wrong)[0]
        raise TrajcliError(
            f"the file read back says {read[row, index]!r} in row {before + row} of {columns[index].name}, "
            f"where the curve is {rows[row, index]!r}"
        )
