"""JSON lines: an object for each row, with an array for each group of columns, in SI.

A line reads `{"t": 0.008, "q": [...], "qd": [...], "qdd": [...], "move": 0}`, by the columns in use. The
numbers of a pose are under `pose` (x, y, z, qw, qx, qy, qz), those of `twist`, `twistd` and `path` likewise.
Each number has as many digits as restore all its bits. Lines that are read may have the names of anybody.
"""

from __future__ import annotations

from codecs import BOM_UTF8
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from trajcli.columns import JOINT_ORDERS, Column, RowField, kinds_of, require_finite, row_fields
from trajcli.curves.piecewise import Array
from trajcli.errors import InputError, Place, Problem, TrajcliError
from trajcli.streams.byte_source import ByteSource
from trajcli.streams.number_cells import scan_decimals
from trajcli.streams.recorded.column_names import read_name
from trajcli.streams.recorded.column_roles import NamedFile
from trajcli.streams.row_sources import EXACT, FULL_DECIMALS, RowSource

_BLOCK = 4096  # rows gathered at a time
_LONGEST = 1 << 24  # bytes of a line
_LARGEST_NUMBER = 1e300
_SHOWN = 200  # characters of a line in a message
_OF_STATES = {"position": "q", "velocity": "qd", "effort": "tau"}


def _value(field: RowField, row: list[float]) -> Any:  # noqa: ANN401
    if not field.alone:
        return row[field.first : field.stop]
    return int(row[field.first]) if field.whole_numbers else row[field.first]


def write_jsonl_blocks(rows: Iterable[Array], columns: Sequence[Column], out: BinaryIO) -> Iterator[Array]:
    """Write blocks of rows (N, m) in SI, and yield each as soon as its text has left for `out`.

    Args:
        rows: Blocks; they are taken one by one, so that memory does not grow with their number.
        columns: What the rows hold; whole groups in SI.
        out: Where to.

    Raises:
        TrajcliError: When a value is not finite; its row and what follows are not written.
    """
    from pydantic_core import to_json

    keys = row_fields(columns)
    written = 0
    for block in rows:
        require_finite(block, columns, written)
        lines = (to_json({key.name: _value(key, row) for key in keys}) for row in block.tolist())
        out.write(b"".join(line + b"\n" for line in lines))
        written += len(block)
        yield block


def verify_jsonl(written: BinaryIO, rows: Iterable[Array], columns: Sequence[Column]) -> None:
    """Read a stream from its beginning and compare every number, bit by bit, with the rows behind it.

    Args:
        written: What `write_jsonl_blocks` wrote; it need hold no block that is not yet taken from `rows`.
        rows: The same blocks once more.
        columns: As in `write_jsonl_blocks`.

    Raises:
        TrajcliError: When a key, a number or the count of rows differs.
    """
    written.seek(0)
    keys, count = row_fields(columns), 0
    for block in rows:
        for row in block:
            line = written.readline()
            if not line.endswith(b"\n"):
                raise TrajcliError(f"the file read back ends after {count} rows, but more were written")
            if not np.array_equal(_numbers(line, keys, count), row):
                raise TrajcliError(f"row {count} of the file read back differs from what was written")
            count += 1
    if written.read(1):
        raise TrajcliError(f"the file read back goes on after the {count} rows that were written")


def _numbers(line: bytes, keys: Sequence[RowField], row: int) -> list[float]:
    """Return the numbers of a line, in the order of the columns."""
    from pydantic_core import from_json

    try:
        value = from_json(line)
        if list(value) != [key.name for key in keys]:
            raise TrajcliError(f"row {row} of the file read back has other keys than were written")
        return [number for key in keys for number in ([value[key.name]] if key.alone else value[key.name])]
    except (ValueError, TypeError) as error:
        raise TrajcliError(f"row {row} of the file read back is no object of numbers: {error}") from error


class JsonRows(RowSource):
    """Rows of JSON lines, which are read anew whenever they are asked for."""

    format = "jsonl"

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
            found = _names_of(key, content, Place(file, first, 1))
            names += found
            if found:
                self._columns[key] = _length(content)
        self._width = len(names)
        self._joints = _joints_of(value, self._columns.values())
        self.joint_names = None if self._joints is None else tuple(self._joints)
        unread = [key for key in value if key not in self._columns and value[key] != (self._joints or value)]
        self.notes = (f"keys that are not read: {', '.join(unread)}",) if unread else ()
        place = Place(file, first, 1, line[:_SHOWN].decode("utf-8", "replace").rstrip())
        self.named = NamedFile(file, tuple(names), lambda name: place)
        self.relative = np.array([2.0**-53 * (name == "t" and self._joints is not None) for name in names])
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
            text = "\n".join([*(",".join(map(repr, row)) for row in rows), ""])
            self._decimals = np.maximum(self._decimals, scan_decimals(text.encode(), self._width)[1])
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
        same = self._joints is None or _joints_of(value, self._columns.values()) == self._joints
        if value.keys() != self._keys or not lengths or not same:
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
    return _with_seconds(value)


def _with_seconds(value: dict[str, Any]) -> dict[str, Any]:
    """Return a message of ROS by our names, with its stamp as a time; any other object as it is."""
    header = value.get("header")
    stamp = header.get("stamp") if isinstance(header, dict) else None
    if not isinstance(stamp, dict):
        return value
    seconds, nanoseconds = stamp.get("sec", stamp.get("secs")), stamp.get("nanosec", stamp.get("nsecs"))
    if type(seconds) is not int or type(nanoseconds) is not int:
        return value
    held = {key: content for key, content in value.items() if key != "header" and content != []}
    return {"t": seconds + nanoseconds / 1e9, **{_OF_STATES.get(key, key): held[key] for key in held}}


def _joints_of(value: dict[str, Any], lengths: Iterable[int | None]) -> list[str] | None:
    """Return the names of joints that an object holds beside as many numbers; None where it holds none."""
    names = value.get("name", value.get("joint_names"))
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        return None
    return names if len(names) in lengths else None


def _length(content: Any) -> int | None:  # noqa: ANN401
    return len(content) if isinstance(content, list) else None


def _names_of(key: str, content: Any, place: Place) -> list[str]:  # noqa: ANN401
    """Return the names of the columns of a key; none where it holds no numbers and no known name."""
    if not isinstance(content, list):
        named = read_name(key).quantity is not None
        return [key] if type(content) in (int, float) or named else []
    count, kinds = len(content), kinds_of(key)
    if key in JOINT_ORDERS or read_name(f"{key}1").joint == 1:
        return [f"{key}{joint + 1}" for joint in range(count)]
    if len(kinds) == count:
        return list(kinds)
    if not kinds and not any(type(item) in (int, float) for item in content):
        return []
    lists = ", ".join([*JOINT_ORDERS, "pose, twist, twistd, path"])
    hint = f"{key} has {', '.join(kinds)}" if kinds else f"lists are {lists}"
    raise InputError(Problem(f"unexpected list '{key}' of {count} numbers", hint, place))


def is_json_object(line: bytes) -> bool:
    """Return whether a line is an object in JSON, as the first of JSON lines is."""
    from pydantic_core import from_json

    try:
        return isinstance(from_json(line), dict)
    except ValueError:
        return False
