"""Arrays of numpy files: structured ones by their names, plain ones by the order t, q, qd, qdd."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError
from trajcli.streams.byte_source import ByteSource
from trajcli.streams.recorded.column_roles import NamedFile
from trajcli.streams.row_sources import EXACT, unplaced

_ROWS = 1 << 14  # rows at a time
_LARGEST_ROW = 1 << 14  # bytes
_LAYOUT = (
    "a structured array has fields such as t, q1, q2 or t, q; a plain one has the shape (N, 1 + n), of time "
    "and positions, or (N, 1 + 2 n) and (N, 1 + 3 n) with velocities and accelerations behind them"
)
_ORDERS = ("q", "qd", "qdd")


class ArrayFile:
    """Rows of an array in a file, which are read when they are asked for."""

    format = "npy"
    joint_names: tuple[str, ...] | None = None
    si = False

    def __init__(self, source: ByteSource, joints: int | None = None) -> None:
        """Read the shape of the array.

        Args:
            source: The file.
            joints: Number of joints that are expected; None where nobody knows.

        Raises:
            FileError: When the file cannot be read.
            InputError: When it holds no table of real numbers, or one whose columns have no names.
        """
        self._source = source
        with source.open() as stream:
            self._dtype, self._shape, fortran = _head(stream, source.file)
        self._plain = self._dtype.names is None
        widest = self._dtype.itemsize * (self._shape[1] if self._plain and len(self._shape) == 2 else 1)
        if widest > _LARGEST_ROW:
            raise InputError(f"{source.file}: a row of {widest} bytes is none of a motion", hint=_LAYOUT)
        if fortran and len(self._shape) > 1:
            hint = "save it with numpy.ascontiguousarray"
            raise InputError(f"{source.file}: the array is stored column by column", hint=hint)
        names, self.relative, notes = self._plain_names(joints) if self._plain else self._field_names()
        self.notes: tuple[str, ...] = tuple(notes)
        self.named = NamedFile(source.file, tuple(names), unplaced)

    def blocks(self, taken: Sequence[int], fixed: Sequence[int]) -> Iterator[Array]:
        """Yield the rows of some columns."""
        del fixed  # numbers only
        done, size = 0, self._dtype.itemsize * (self._shape[1] if self._plain else 1)
        with self._source.open() as stream:
            _head(stream, self._source.file)
            while done < self._shape[0]:
                count = min(_ROWS, self._shape[0] - done)
                data = stream.read(count * size)
                if len(data) < count * size:
                    found = done + len(data) // size
                    message = f"{self._source.file} is cut: it has {found} of {self._shape[0]} rows"
                    raise InputError(message)
                rows = self._numbers(np.frombuffer(data, self._dtype))[:, list(taken)]
                self._refuse_not_finite(rows, taken, done)
                yield rows
                done += count

    def decimals(self, taken: Sequence[int]) -> NDArray[np.int64]:
        """Return that no number was rounded to decimals."""
        return np.full(len(taken), EXACT, np.int64)

    def _numbers(self, data: NDArray[Any]) -> Array:
        if self._plain:
            return data.reshape(-1, self._shape[1]).astype(np.float64)
        parts = [data[name].reshape(len(data), -1).astype(np.float64) for name in self._dtype.names or ()]
        return np.concatenate(parts, axis=1)

    def _refuse_not_finite(self, rows: Array, taken: Sequence[int], before: int) -> None:
        finite = np.isfinite(rows)
        if not finite.all():
            row, column = np.argwhere(~finite)[0].tolist()
            name = self.named.names[taken[column]]
            message = f"{self._source.file}: {name} is {rows[row, column]} in row {before + row + 1}"
            raise InputError(message, hint="expected finite numbers")

    def _plain_names(self, joints: int | None) -> tuple[list[str], Array, list[str]]:
        """Return the names of the columns of a plain array, by their number."""
        file, shape = self._source.file, self._shape
        if len(shape) != 2 or shape[1] < 2 or shape[0] < 1:
            hint = (
                f"of several chunks take one: numpy.save(file, array[0]); {_LAYOUT}"
                if len(shape) > 2
                else _LAYOUT
            )
            raise InputError(f"{file}: an array of shape {shape} is no table of rows", hint=hint)
        rest = shape[1] - 1
        count = rest if joints is None else joints
        if rest % count or rest // count > len(_ORDERS):
            time = "; it seems to lack the time" if shape[1] == count else ""
            raise InputError(f"{file}: {shape[1]} columns for {count} joints{time}", hint=_LAYOUT)
        names = [f"{kind}{joint + 1}" for kind in _ORDERS[: rest // count] for joint in range(count)]
        notes = [f"columns are read as t, {names[0]} .. {names[-1]}"]
        return ["t", *names], np.full(shape[1], _share(self._dtype)), notes

    def _field_names(self) -> tuple[list[str], Array, list[str]]:
        """Return the names of the columns of a structured array; a field of several numbers has one each."""
        names, shares = list[str](), list[float]()
        for field in self._dtype.names or ():
            of_field = self._dtype[field]
            width = int(np.prod(of_field.shape, dtype=np.int64))
            names += [field] if not of_field.shape else [f"{field}{joint + 1}" for joint in range(width)]
            shares += [_share(of_field.base)] * width
        if len(self._shape) != 1 or self._shape[0] < 1:
            raise InputError(f"{self._source.file}: a structured array of shape {self._shape}", hint=_LAYOUT)
        return names, np.array(shares), []


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


def _share(dtype: np.dtype[Any]) -> float:
    """Return by which share of itself a number of a type may be rounded; 0 of float64 and whole numbers."""
    if dtype.kind != "f" or dtype.itemsize >= 8:
        return 0.0
    return float(np.finfo(dtype).eps) / 2
