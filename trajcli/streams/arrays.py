"""Arrays of rows for numpy: a structured array (.npy), or an array for each group of columns (.npz), in SI.

The fields, or the arrays, are those of JSON lines: t, q, qd and so on, a pose of seven numbers, float64. An
array is written row by row; an archive holds whole columns, and its rows stay in memory until it is written.
"""

from __future__ import annotations

import zipfile
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, BinaryIO

import numpy as np

from trajcli.columns import Column, require_finite, row_fields
from trajcli.curves.piecewise import Array
from trajcli.errors import TrajcliError

_MAGIC = b"\x93NUMPY\x01\x00"
_HEADER = 64  # bytes, a multiple of which the header is
_DIGITS = 20  # of the number of rows, which is known in the end
_BEGAN = (1980, 1, 1, 0, 0, 0)  # of members: a file does not depend on when it is written


def write_npy_blocks(rows: Iterable[Array], columns: Sequence[Column], out: BinaryIO) -> Iterator[Array]:
    """Write blocks of rows (N, m) in SI as a structured array, and yield each when it is written.

    Args:
        rows: Blocks, taken one by one; where the stream cannot go back to its header they are held.
        columns: What the rows hold; whole groups in SI.
        out: Where to.

    Raises:
        TrajcliError: When a value is not finite, or the columns of a group stand apart.
    """
    dtype, written = _dtype(columns), 0
    held: list[bytes] | None = None if out.seekable() else []
    begin = 0 if held is not None else out.tell()
    if held is None:
        out.write(_header(dtype, 0))
    for block in rows:
        require_finite(block, columns, written)
        data = np.ascontiguousarray(block, "<f8").tobytes()
        if held is None:
            out.write(data)
        else:
            held.append(data)
        written += len(block)
        yield block
    if held is None:
        end = out.tell()
        out.seek(begin)
        out.write(_header(dtype, written))
        out.seek(end)
    else:
        out.write(b"".join([_header(dtype, written), *held]))


def verify_npy(written: BinaryIO, rows: Iterable[Array], columns: Sequence[Column]) -> None:
    """Read an array from its beginning and compare every number, bit by bit, with the rows behind it.

    Args:
        written: What `write_npy_blocks` wrote; it need hold no block that is not yet taken from `rows`.
        rows: The same blocks once more.
        columns: As in `write_npy_blocks`.

    Raises:
        TrajcliError: When a number or the count of rows differs.
    """
    dtype, count = _dtype(columns), 0
    written.seek(len(_header(dtype, 0)))
    for block in rows:
        data = np.ascontiguousarray(block, "<f8").tobytes()
        if written.read(len(data)) != data:
            raise TrajcliError(f"rows from {count} on of the file read back differ from what was written")
        count += len(block)
    if written.read(1):
        raise TrajcliError(f"the file read back goes on after the {count} rows that were written")
    written.seek(0)
    if written.read(len(_header(dtype, count))) != _header(dtype, count):
        raise TrajcliError(f"the file read back says another number of rows than {count}")


def write_npz_blocks(rows: Iterable[Array], columns: Sequence[Column], out: BinaryIO) -> Iterator[Array]:
    """Write blocks of rows (N, m) in SI as arrays of an archive, and yield each when it is taken.

    Raises:
        TrajcliError: When a value is not finite, or the columns of a group stand apart.
    """
    held: list[Array] = []
    for block in rows:
        require_finite(block, columns, sum(map(len, held)))
        held.append(block)
        yield block
    with zipfile.ZipFile(out, "w", zipfile.ZIP_STORED) as archive:
        for name, array in _arrays(held, columns).items():
            with archive.open(zipfile.ZipInfo(f"{name}.npy", _BEGAN), "w", force_zip64=True) as member:
                np.lib.format.write_array(member, array, version=(1, 0), allow_pickle=False)


def verify_npz(written: BinaryIO, rows: Iterable[Array], columns: Sequence[Column]) -> None:
    """Read an archive and compare every number, bit by bit, with its rows.

    Raises:
        TrajcliError: When an array differs.
    """
    expected = _arrays(list(rows), columns)
    written.seek(0)
    with np.load(written, allow_pickle=False) as found:
        for name, array in expected.items():
            if name not in found or found[name].tobytes() != array.tobytes():
                raise TrajcliError(f"the array {name} read back differs from what was written")


def _arrays(blocks: Sequence[Array], columns: Sequence[Column]) -> dict[str, Array]:
    """Return the array of each group, (N,) or (N, k)."""
    dtype = _dtype(columns)
    rows = np.concatenate(blocks) if blocks else np.empty((0, len(columns)))
    table = np.ascontiguousarray(rows, "<f8").view(dtype)[:, 0]
    return {name: np.ascontiguousarray(table[name]) for name in dtype.names or ()}


def _dtype(columns: Sequence[Column]) -> np.dtype[Any]:
    """Return the type of a row: a field for each group of columns, and for each signal, which has a name."""
    fields = row_fields(columns)
    return np.dtype([(f.name, "<f8", () if f.alone else (f.stop - f.first,)) for f in fields])


def _header(dtype: np.dtype[Any], rows: int) -> bytes:
    """Return the header of an array, whose length is the same for any number of rows."""
    text = (
        f"{{'descr': {np.lib.format.dtype_to_descr(dtype)!r}, 'fortran_order': False, 'shape': ({rows},), }}"
    )
    longest = len(text) - len(str(rows)) + _DIGITS + len(_MAGIC) + 3
    length = -(-longest // _HEADER) * _HEADER - len(_MAGIC) - 2
    return _MAGIC + length.to_bytes(2, "little") + text.encode().ljust(length - 1) + b"\n"
