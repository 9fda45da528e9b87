"""Rows from JSON lines: an object for each row, of numbers and lists of numbers, in the names of anybody."""

from __future__ import annotations

from codecs import BOM_UTF8
from collections.abc import Iterator, Sequence
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from trajcli.columns import JOINT_ORDERS, kinds_of
from trajcli.curves.piecewise import Array
from trajcli.errors import InputError, Place, Problem
from trajcli.streams.byte_source import ByteSource
from trajcli.streams.number_cells import decimals_of
from trajcli.streams.recorded.column_names import read_name
from trajcli.streams.recorded.column_roles import NamedFile
from trajcli.streams.row_sources import EXACT, FULL_DECIMALS

_BLOCK = 4096  # rows gathered at a time
_LONGEST = 1 << 24  # bytes of a line
_LARGEST_NUMBER = 1e300
_SHOWN = 200  # characters of a line in a message


class JsonRows:
    """Rows of JSON lines, which are read anew whenever they are asked for."""

    format = "jsonl"
    joint_names: tuple[str, ...] | None = None
    si = False

    def __init__(self, source: ByteSource) -> None:
        """Read the keys of the first object.

        Raises:
            FileError: When the file cannot be read.
            InputError: When its first line is no object of numbers and lists of numbers.
        """
        self._source, file = source, source.file
        with source.open() as stream:
            first, line = next(_lines(stream), (0, b""))
        if not line:
            raise InputError(f"{file} has no rows")
        value = _object(line, file, first)
        self._keys, self._columns, names = value.keys(), dict[str, int | None](), list[str]()
        for key, content in value.items():
            found = _names_of(key, content, file)
            names += found
            if found:
                self._columns[key] = _length(content)
        self._width = len(names)
        rest = [key for key in value if key not in self._columns]
        self.notes: tuple[str, ...] = (f"keys that are not read: {', '.join(rest)}",) if rest else ()
        place = Place(file, first, 1, line[:_SHOWN].decode("utf-8", "replace").rstrip())
        self.named = NamedFile(file, tuple(names), lambda name: place)
        self.relative = np.zeros(self._width)
        self._decimals = np.zeros(self._width, np.int64)

    def blocks(self, taken: Sequence[int], fixed: Sequence[int]) -> Iterator[Array]:
        """Yield the rows of some columns."""
        del fixed  # numbers only
        rows: list[list[float]] = []
        with self._source.open() as stream:
            for number, line in _lines(stream):
                rows.append(self._row(line, number))
                if len(rows) == _BLOCK:
                    yield self._block(rows, taken)
                    rows = []
        if rows:
            yield self._block(rows, taken)

    def _block(self, rows: list[list[float]], taken: Sequence[int]) -> Array:
        if self._decimals.max(initial=0) < FULL_DECIMALS:
            columns = zip(*rows, strict=True)
            most = [max(decimals_of(repr(value).encode()) for value in column) for column in columns]
            self._decimals = np.maximum(self._decimals, most)
        return np.array(rows, dtype=np.float64)[:, list(taken)]

    def decimals(self, taken: Sequence[int]) -> NDArray[np.int64]:
        """Return the decimals that columns show; exact where one of the file shows all its digits."""
        found = self._decimals[list(taken)]
        return found if self._decimals.max(initial=0) < FULL_DECIMALS else np.full_like(found, EXACT)

    def _row(self, line: bytes, number: int) -> list[float]:
        """Return the numbers of an object, in the order of the columns."""
        file = self._source.file
        value = _object(line, file, number)
        row: list[Any] = []
        for key in self._columns:
            content = value.get(key)
            row += content if isinstance(content, list) else [content]
        place = Place(file, number, 1)
        lengths = all(_length(value.get(key)) == count for key, count in self._columns.items())
        if value.keys() != self._keys or not lengths:
            raise InputError(Problem("other keys or lists than in the first row", None, place))
        if not all(type(item) in (int, float) and abs(item) <= _LARGEST_NUMBER for item in row):
            raise InputError(Problem("a value is no number", None, place))
        return row


def _lines(stream: BinaryIO) -> Iterator[tuple[int, bytes]]:
    """Yield the lines that are not blank, with their numbers from 1; a mark of UTF-8 in front is left out."""
    for number, line in enumerate(iter(lambda: stream.readline(_LONGEST), b""), 1):
        text = line.removeprefix(BOM_UTF8) if number == 1 else line
        if text.strip():
            yield number, text


def _object(line: bytes, file: str, number: int) -> dict[str, Any]:
    from pydantic_core import from_json

    try:
        value = from_json(line, allow_inf_nan=False)
    except ValueError as error:
        hint = None if line.endswith(b"\n") or number == 1 else "the file may have been cut"
        raise InputError(Problem(f"no JSON: {error}", hint, Place(file, number, 1))) from error
    if not isinstance(value, dict) or not value:
        message = "expected an object of numbers and lists of numbers"
        raise InputError(Problem(message, None, Place(file, number, 1)))
    return value


def _length(content: Any) -> int | None:  # noqa: ANN401
    return len(content) if isinstance(content, list) else None


def _names_of(key: str, content: Any, file: str) -> list[str]:  # noqa: ANN401
    """Return the names of the columns of a key; none where it holds no numbers and no known name."""
    if not isinstance(content, list):
        known = read_name(key).quantity is not None
        return [key] if type(content) in (int, float) or known else []
    count, kinds = len(content), kinds_of(key)
    if key in JOINT_ORDERS or read_name(f"{key}1").joint == 1:
        return [f"{key}{joint + 1}" for joint in range(count)]
    if len(kinds) == count:
        return list(kinds)
    if not kinds and not any(type(item) in (int, float) for item in content):
        return []
    lists = ", ".join([*JOINT_ORDERS, "pose, twist, twistd, path"])
    hint = f"{key} has {', '.join(kinds)}" if kinds else f"lists are {lists}"
    raise InputError(Problem(f"unexpected list '{key}' of {count} numbers", hint, Place(file, 1, 1)))


def is_json_object(line: bytes) -> bool:
    """Return whether a line is an object in JSON, as the first of JSON lines is."""
    from pydantic_core import from_json

    try:
        return isinstance(from_json(line), dict)
    except ValueError:
        return False
