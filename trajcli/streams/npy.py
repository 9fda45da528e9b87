"""Arrays of numpy files: those with names by these, plain ones by the order t, q, qd, qdd."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trajcli.columns import kinds_of
from trajcli.curves.piecewise import Array
from trajcli.errors import InputError
from trajcli.streams.byte_source import ByteSource
from trajcli.streams.recorded.column_names import MOVE, TIME, read_name
from trajcli.streams.recorded.column_roles import NamedFile
from trajcli.streams.row_sources import EXACT, ArrayRows, RowSource, unplaced

_ROWS = 1 << 14  # rows at a time
_LARGEST_ROW = 1 << 14  # bytes
_LAYOUT = (
    "a structured array has fields such as t, q1, q2 or t, q; a plain one has the shape (N, 1 + n), of time "
    "and positions, or (N, 1 + 2 n) and (N, 1 + 3 n) with velocities and accelerations behind them; without "
    "time, --rate says how many rows a second has; chunks stand one behind the other in (K, N, ...)"
)
_LARGEST_ARCHIVE = 1 << 31  # bytes of its arrays, which are held in memory
_ORDERS = ("q", "qd", "qdd")


class ArrayFile(RowSource):
    """Rows of an array in a file, which are read when they are asked for."""

    def __init__(self, source: ByteSource, joints: int | None = None, *, timed: bool = True) -> None:
        """Read the shape of the array.

        Args:
            source: The file.
            joints: Number of joints that are expected; None where nobody knows.
            timed: Whether the first column of a plain array is the time.

        Raises:
            FileError: When the file cannot be read.
            InputError: When it holds no table of real numbers, or one whose columns have no names.
        """
        self._source = source
        with source.open() as stream:
            self._dtype, self._shape, fortran = _head(stream, source.file)
        self._plain = self._dtype.names is None
        self.format = "npy" if self._plain else "fields"
        widest = self._dtype.itemsize * (self._shape[-1] if self._plain and len(self._shape) > 1 else 1)
        if widest > _LARGEST_ROW:
            raise InputError(f"{source.file}: a row of {widest} bytes is none of a motion", hint=_LAYOUT)
        if fortran and len(self._shape) > 1:
            hint = "save it with numpy.ascontiguousarray"
            raise InputError(f"{source.file}: the array is stored column by column", hint=hint)
        if self._plain:
            names, notes = plain_names(source.file, self._shape, joints, timed=timed)
            self.relative = np.full(len(names), share_of(self._dtype))
        else:
            names, self.relative, notes = self._field_names()
        self.notes = tuple(notes)
        self._rows = prod(self._shape[:-1] if self._plain else self._shape)
        self.named = NamedFile(source.file, tuple(names), unplaced)

    def blocks(self, taken: Sequence[int], fixed: Sequence[int]) -> Iterator[Array]:
        """Yield the rows of some columns."""
        del fixed  # numbers only
        done, size = 0, self._dtype.itemsize * (self._shape[-1] if self._plain else 1)
        with self._source.open() as stream:
            _head(stream, self._source.file)
            while done < self._rows:
                count = min(_ROWS, self._rows - done)
                data = stream.read(count * size)
                if len(data) < count * size:
                    found = done + len(data) // size
                    message = f"{self._source.file} is cut: it has {found} of {self._rows} rows"
                    raise InputError(message)
                rows = self._numbers(np.frombuffer(data, self._dtype))[:, list(taken)]
                _refuse_not_finite(rows, [self.named.names[k] for k in taken], self._source.file, done)
                yield rows
                done += count

    def decimals(self, taken: Sequence[int]) -> NDArray[np.int64]:
        """Return that no number was rounded to decimals."""
        return np.full(len(taken), EXACT, np.int64)

    def _numbers(self, data: NDArray[Any]) -> Array:
        if self._plain:
            return data.reshape(-1, self._shape[-1]).astype(np.float64)
        parts = [data[name].reshape(len(data), -1).astype(np.float64) for name in self._dtype.names or ()]
        return np.concatenate(parts, axis=1)

    def _field_names(self) -> tuple[list[str], Array, list[str]]:
        """Return the names of the columns of a structured array; a field of several numbers has one each."""
        names, shares = list[str](), list[float]()
        for field in self._dtype.names or ():
            of_field = self._dtype[field]
            names += _names_of(field, of_field.shape)
            shares += [share_of(of_field.base)] * (len(names) - len(shares))
        if not 1 <= len(self._shape) <= 2 or min(self._shape) < 1:
            raise InputError(f"{self._source.file}: a structured array of shape {self._shape}", hint=_LAYOUT)
        return names, np.array(shares), _note_on_chunks(self._shape)


def _refuse_not_finite(rows: Array, names: Sequence[str], file: str, before: int) -> None:
    finite = np.isfinite(rows)
    if not finite.all():
        row, column = np.argwhere(~finite)[0].tolist()
        message = f"{file}: {names[column]} is {rows[row, column]} in row {before + row + 1}"
        raise InputError(message, hint="expected finite numbers")


def _names_of(field: str, shape: Sequence[int]) -> list[str]:
    """Return the names of the columns of a field, whose rows have a shape."""
    width = int(np.prod(shape, dtype=np.int64))
    if not shape or (width == 1 and read_name(field).quantity in (TIME, MOVE)):
        return [field]
    kinds = kinds_of(field)
    return list(kinds) if len(kinds) == width else [f"{field}{joint + 1}" for joint in range(width)]


def _note_on_chunks(shape: Sequence[int]) -> list[str]:
    """Return that chunks (K, N) are read one after the other, where there are any."""
    chunks = f"{shape[0]} chunks of {shape[1]} rows are read one after the other" if len(shape) > 1 else ""
    return [chunks] if chunks else []


def plain_names(
    file: str, shape: Sequence[int], joints: int | None, *, timed: bool
) -> tuple[list[str], list[str]]:
    """Return the names of the columns of a plain array, by their number, and notes.

    Args:
        file: Its name, for messages.
        shape: Of the array: (N, m), or (K, N, m) of chunks.
        joints: Number of joints that are expected; None where nobody knows.
        timed: Whether the first column is the time.

    Raises:
        InputError: When it is no table, or has another number of columns.
    """
    if not 2 <= len(shape) <= 3 or shape[-1] < 1 + timed or min(shape) < 1:
        raise InputError(f"{file}: an array of shape {tuple(shape)} is no table of rows", hint=_LAYOUT)
    columns = shape[-1] - timed
    count = columns if joints is None else joints
    if columns % count or columns // count > len(_ORDERS):
        lacks = timed and shape[-1] == count
        time = "; it seems to lack the time, which --rate says" if lacks else ""
        raise InputError(f"{file}: {shape[-1]} columns for {count} joints{time}", hint=_LAYOUT)
    names = [f"{kind}{joint + 1}" for kind in _ORDERS[: columns // count] for joint in range(count)]
    said = ["t"] * timed
    note = f"columns are read as {', '.join([*said, f'{names[0]} .. {names[-1]}'])}"
    return [*said, *names], [note, *_note_on_chunks(shape[:-1])]


def open_archive(source: ByteSource, joints: int | None = None, *, timed: bool = True) -> ArrayRows:
    """Return the rows of the arrays in an archive (.npz): of all that have as many rows as the first table.

    Args:
        source: The file.
        joints: Number of joints that are expected; None where nobody knows.
        timed: Whether the first column of a single plain array is the time.

    Raises:
        FileError: When it cannot be read.
        InputError: When it is no archive of arrays, or holds no rows.
    """
    arrays = _arrays_of(source)
    of_joints = [name for name in arrays if read_name(f"{name}1").quantity == "q"]
    if len(arrays) == 1 and not of_joints and next(iter(arrays.values())).ndim > 1:
        array = next(iter(arrays.values()))
        names, notes = plain_names(source.file, array.shape, joints, timed=timed)
        columns = array.reshape(-1, array.shape[-1])
        return _rows_of(source.file, "npy", names, columns, [share_of(array.dtype)] * len(names), notes)
    wide = {name: array for name, array in arrays.items() if 2 <= array.ndim <= 3}
    tables = (
        [wide[name] for name in of_joints if name in wide]
        or list(wide.values())
        or [array for array in arrays.values() if array.ndim == 1]
    )
    if not tables or not tables[0].size:
        raise InputError(f"{source.file} holds no rows", hint=_LAYOUT)
    deep = tables[0].ndim > 2
    rows = tables[0].shape[: 1 + deep]
    taken = {
        name: a for name, a in arrays.items() if a.shape[: len(rows)] == rows and a.ndim <= len(rows) + 1
    }
    names, shares, parts = list[str](), list[float](), list[Array]()
    for name, array in taken.items():
        found = _names_of(name, array.shape[len(rows) :])
        names, shares = [*names, *found], [*shares, *[share_of(array.dtype)] * len(found)]
        parts.append(array.reshape(int(np.prod(rows)), -1).astype(np.float64))
    unread = [name for name in arrays if name not in taken]
    notes = [f"arrays that are not read: {', '.join(unread)}"] if unread else []
    joined = np.concatenate(parts, axis=1)
    return _rows_of(source.file, "fields", names, joined, shares, [*notes, *_note_on_chunks(rows)])


def _rows_of(
    file: str,
    form: str,
    names: Sequence[str],
    columns: NDArray[Any],
    shares: Sequence[float],
    notes: Sequence[str],
) -> ArrayRows:
    numbers = columns.astype(np.float64)
    _refuse_not_finite(numbers, names, file, 0)
    named = NamedFile(file, tuple(names), unplaced)
    exact = np.full(len(names), EXACT, np.int64)
    return ArrayRows(form, named, numbers, exact, np.array(shares), notes=tuple(notes))


def _arrays_of(source: ByteSource) -> dict[str, NDArray[Any]]:
    """Return the arrays of real numbers in an archive, by their names."""
    import struct
    import tokenize
    import zipfile
    import zlib

    from numpy.lib import format as npy

    found: dict[str, NDArray[Any]] = {}
    wrong = (ValueError, zipfile.BadZipFile, EOFError, RuntimeError, tokenize.TokenError, struct.error)
    try:
        with source.open() as stream, zipfile.ZipFile(stream) as archive:
            members = [member for member in archive.infolist() if member.filename.endswith(".npy")]
            size = sum(member.file_size for member in members)
            if size > _LARGEST_ARCHIVE:
                raise InputError(f"{source.file} holds {size} bytes", hint="save one array of it as .npy")
            for member in members:
                if member.header_offset < 0 or member.compress_type not in (0, 8):  # stored, deflated
                    raise zipfile.BadZipFile(f"{member.filename} is not where or as it should be")
                with archive.open(member) as content:
                    array = npy.read_array(content, allow_pickle=False)
                if array.dtype.kind in "fiu" and array.ndim:
                    found[member.filename.removesuffix(".npy")] = array
    except (*wrong, zlib.error, OverflowError, MemoryError) as error:  # the last of what a header claims
        raise InputError(
            f"{source.file} is no archive of numpy: {error}".split("\n", maxsplit=1)[0]
        ) from error
    return found


def _head(stream: Any, file: str) -> tuple[np.dtype[Any], tuple[int, ...], bool]:  # noqa: ANN401
    """Return type, shape and order of the array in a stream, which then stands at its numbers."""
    from numpy.lib import format as npy

    try:
        version = npy.read_magic(stream)
        read = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
        shape, fortran, dtype = read(stream)
    except Exception as error:  # of its tokenizer, too
        raise InputError(f"{file} is no array of numpy: {error}".split("\n", maxsplit=1)[0]) from error
    kinds = [dtype[name].base.kind for name in dtype.names] if dtype.names else [dtype.kind]
    if not {*kinds} <= set("fiu"):
        raise InputError(f"{file}: an array of type {dtype} holds more than real numbers", hint=_LAYOUT)
    return dtype, shape, fortran


def share_of(dtype: np.dtype[Any]) -> float:
    """Return by which share of itself a number of a type may be rounded; 0 of float64 and whole numbers."""
    if dtype.kind != "f" or dtype.itemsize >= 8:
        return 0.0
    return float(np.finfo(dtype).eps) / 2
