"""Decimal numbers of any form, read and written by whole blocks: each is the float64 nearest to its text.

Lines of cells become an array in JSON, and the other way round: pydantic_core reads each number correctly
rounded, and writes the fewest digits from which it can be restored. Forms of numbers that JSON does not have
(`.5`, `5.`, `+1`, `007`, `-0`) are read by numpy.
"""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.streams.decimals import NotFixedError

_CHARACTERS = b"0123456789+-.eE ,\n"
_NOT_OF_JSON = (b"-0,", b"-0\n")  # the whole number -0 has no sign there
_MOST_DECIMALS = 2000  # that are counted: no float64 has more
_EXPONENT_DIGITS = 18  # of an exponent that are looked at
_VALUES = 4096  # values that are Python's floats at a time: they stay in the processor's cache

_Indices = NDArray[np.intp]


def encode_full(rows: Array, whole_numbers: Sequence[int] = ()) -> bytes:
    """Return `rows` (N, m), finite, as lines of values with the fewest digits that restore each.

    Args:
        rows: Values.
        whole_numbers: Columns that are written without decimals.
    """
    from pydantic_core import SchemaSerializer
    from pydantic_core.core_schema import any_schema, float_schema, list_schema

    cell = any_schema() if whole_numbers else float_schema()
    to_json = SchemaSerializer(list_schema(cell)).to_json
    step = max(1, _VALUES // rows.shape[1])
    lines = []
    for low in range(0, len(rows), step):
        block = rows[low : low + step].tolist()
        for column in whole_numbers:
            for row in block:
                row[column] = round(row[column])
        lines += [to_json(row)[1:-1] for row in block]
    return b"\n".join([*lines, b""])


def scan_decimals(text: bytes, width: int) -> tuple[Array, NDArray[np.int64]]:
    """Return the rows (N, width) of `text`, and the most decimals that each column shows, (width,).

    Args:
        text: Lines that end in a line feed, cells separated by commas: -12, .5, 1.25e-05.
        width: Cells of a line.

    Raises:
        NotFixedError: When it has other lines, or a cell is no finite number.
    """
    if text.translate(None, _CHARACTERS) or b" ," in text or b" \n" in text:
        raise NotFixedError
    buffer = np.frombuffer(text, dtype=np.uint8)
    ends = np.flatnonzero((buffer == ord(",")) | (buffer == ord("\n")))
    if ends.size == 0 or ends.size % width or ends[-1] != buffer.size - 1:
        raise NotFixedError
    lines = (buffer[ends] == ord("\n")).reshape(-1, width)
    if lines[:, :-1].any() or not lines[:, -1].all():
        raise NotFixedError
    try:
        values = _numbers_of_json(text)
    except (ValueError, OverflowError):  # the latter of a whole number that no float64 holds
        values = _numbers_of_any_form(text)
    if values.size != ends.size or not np.isfinite(values).all():
        raise NotFixedError
    return values.reshape(lines.shape), _decimals(buffer, ends).reshape(lines.shape).max(axis=0)


def _numbers_of_json(text: bytes) -> Array:
    """Return the numbers of lines; ValueError where a cell is no number of JSON."""
    from pydantic_core import from_json

    values = np.array(from_json(b"[" + text[:-1].replace(b"\n", b",") + b"]"), dtype=np.float64)
    if not values.all() and any(form in text for form in _NOT_OF_JSON):
        raise ValueError
    return values


def _numbers_of_any_form(text: bytes) -> Array:
    """Return the numbers of lines; NotFixedError where a cell is none."""
    try:
        rows: Array = np.loadtxt(BytesIO(text), delimiter=",", comments=None, ndmin=2)
    except ValueError:
        raise NotFixedError from None
    return rows.reshape(-1)


def _decimals(buffer: NDArray[np.uint8], ends: _Indices) -> NDArray[np.int64]:
    """Return how many decimals each cell shows, (cells,), where `ends` says where they end."""
    letters = np.flatnonzero((buffer | 32) == ord("e"))
    mantissa_ends, decimals = ends.copy(), np.zeros(ends.size, dtype=np.int64)
    if letters.size:
        written = _cells_with(letters, ends)
        mantissa_ends[written] = letters
        decimals[written] = -_exponents(buffer, letters, ends[written])
    points = np.flatnonzero(buffer == ord("."))
    with_point = _cells_with(points, ends)
    decimals[with_point] += mantissa_ends[with_point] - points - 1
    return np.clip(decimals, 0, _MOST_DECIMALS)


def _cells_with(marks: _Indices, ends: _Indices) -> _Indices:
    """Return the cell of each mark, of which a cell has at most one."""
    if marks.size == ends.size:
        return np.arange(ends.size)
    return np.searchsorted(ends, marks)


def _exponents(buffer: NDArray[np.uint8], letters: _Indices, ends: _Indices) -> NDArray[np.int64]:
    """Return the whole numbers between letters and ends, by their last digits."""
    negative = buffer[letters + 1] == ord("-")
    digits = ends - letters - 1 - (negative | (buffer[letters + 1] == ord("+")))
    sizes = np.zeros(ends.size, dtype=np.int64)
    for power in range(min(int(digits.max()), _EXPONENT_DIGITS)):
        sizes += np.where(power < digits, buffer[ends - 1 - power] - np.int64(ord("0")), 0) * 10**power
    return np.where(negative, -sizes, sizes)


def decimals_of(cell: bytes) -> int:
    """Return how many decimals a number shows, from 0 to some that no float64 has."""
    mantissa, _, exponent = cell.strip().lower().partition(b"e")
    digits = exponent.lstrip(b"+-").lstrip(b"0")[:_EXPONENT_DIGITS] or b"0"
    power = -int(digits) if exponent.startswith(b"-") else int(digits)
    return min(max(len(mantissa.partition(b".")[2]) - power, 0), _MOST_DECIMALS)
