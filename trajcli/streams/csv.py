"""The sample stream as CSV: a line of names, then a line for each row."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import BinaryIO, Literal

import numpy as np

from trajcli.columns import whole_number_columns
from trajcli.curves.piecewise import Array
from trajcli.errors import TrajcliError
from trajcli.streams.decimals import NotFixedError, encode_fixed, encode_full, scan_fixed
from trajcli.streams.whole_file import whole_file

Digits = Literal["fixed", "full"]

_CHUNK = 1 << 18  # bytes read back at a time
_HALF_UNIT = 0.5e-9 + 1e-12  # the last decimal's half, and the first of the two roundings


def write_csv(rows: Iterable[Array], names: Sequence[str], out: BinaryIO, digits: Digits = "fixed") -> None:
    """Write blocks of rows, each of shape (N, m), under their m names.

    Args:
        rows: Blocks; they are taken one by one, so that memory does not grow with their number.
        names: The columns' names.
        out: Where to.
        digits: Nine decimals, or as many as restore each float64 bit by bit.

    Raises:
        TrajcliError: When a value is not finite; its row and what follows are not written.
    """
    encode = encode_fixed if digits == "fixed" else encode_full
    whole_numbers = whole_number_columns(names)
    out.write((",".join(names) + "\n").encode())
    written = 0
    for block in rows:
        _require_finite(block, names, written)
        out.write(encode(block, whole_numbers))
        written += len(block)


def write_verified(
    path: str | Path, rows: Callable[[], Iterable[Array]], names: Sequence[str], digits: Digits = "fixed"
) -> None:
    """Write a file that appears whole or not at all, and is read back before it does.

    Args:
        path: The file. A device or pipe is written to directly, and not read back.
        rows: Called once to write and once to compare; returns the blocks of `write_csv`.
        names: The columns' names.
        digits: As in `write_csv`.

    Raises:
        FileError: When the file cannot be written.
        BrokenPipeError: When the path is a pipe whose reader has closed it.
        TrajcliError: When a value is not finite, or the file does not hold what was written.
    """
    with whole_file(path) as out:
        write_csv(rows(), names, out, digits)
        if out.readable():
            verify_written(out, rows(), names, digits)


def verify_written(
    written: BinaryIO, rows: Iterable[Array], names: Sequence[str], digits: Digits = "fixed"
) -> None:
    """Read a stream from its beginning and compare every number with the rows it was written from.

    Raises:
        TrajcliError: When a name, a number or the count of rows differs; a number by more than half a unit of
            its last decimal, or by anything at all where the digits are full.
    """
    written.seek(0)
    header = written.readline().decode(errors="replace")
    if header != ",".join(names) + "\n":
        raise TrajcliError(f"the file read back begins with {header!r} instead of the columns' names")
    whole_numbers = whole_number_columns(names)
    texts = _Texts(written, len(names), whole_numbers)
    place = 0
    for block in rows:
        _compare(texts.take(len(block), place), block, names, place, digits)
        place += len(block)
    texts.expect_end(place)


class _Texts:
    """The numbers of a stream, handed out as many rows at a time as are asked for."""

    def __init__(self, stream: BinaryIO, width: int, whole_numbers: Sequence[int]) -> None:
        self._width = width
        self._blocks = self._scan(stream, whole_numbers)
        self._left = np.empty((0, width))

    def _scan(self, stream: BinaryIO, whole_numbers: Sequence[int]) -> Iterator[Array]:
        while text := stream.read(_CHUNK):
            text += stream.readline()
            try:
                yield scan_fixed(text, self._width, whole_numbers)
            except NotFixedError:
                yield self._scan_any(text)

    def _scan_any(self, text: bytes) -> Array:
        lines = [line.split(b",") for line in text.splitlines()]
        if any(len(line) != self._width for line in lines) or not text.endswith(b"\n"):
            raise TrajcliError("the file read back has lines of another length than were written")
        try:
            return np.array([list(map(float, line)) for line in lines])
        except ValueError as error:
            raise TrajcliError(f"the file read back holds what is not a number: {error}") from error

    def take(self, count: int, place: int) -> Array:
        """Return the next `count` rows; `place` is how many were taken before."""
        parts, found = [self._left], len(self._left)
        while found < count:
            block = next(self._blocks, None)
            if block is None:
                raise TrajcliError(
                    f"the file read back ends after {place + found} rows, but more were written"
                )
            parts.append(block)
            found += len(block)
        held = np.concatenate(parts)
        self._left = held[count:]
        return held[:count]

    def expect_end(self, place: int) -> None:
        """Refuse rows after the first `place`."""
        if len(self._left) or next(self._blocks, None) is not None:
            raise TrajcliError(f"the file read back goes on after the {place} rows that were written")


def _compare(read: Array, rows: Array, names: Sequence[str], place: int, digits: Digits) -> None:
    if digits == "full":
        wrong = read.view(np.int64) != np.ascontiguousarray(rows).view(np.int64)
    else:
        wrong = ~(np.abs(read - rows) <= _HALF_UNIT + np.spacing(np.abs(rows)))
    if wrong.any():
        row, column = np.argwhere(wrong)[0]
        raise TrajcliError(
            f"the file read back says {read[row, column]!r} in row {place + row} of {names[column]}, "
            f"where the curve is {rows[row, column]!r}"
        )


def _require_finite(block: Array, names: Sequence[str], place: int) -> None:
    finite = np.isfinite(block)
    if not finite.all():
        row, column = np.argwhere(~finite)[0]
        raise TrajcliError(
            f"{names[column]} is {block[row, column]} in row {place + row}; nothing of it is written"
        )
