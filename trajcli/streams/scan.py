"""Text with nine fixed decimals back to numbers, many at once.

Eight digits are read as one 64-bit word and summed pair by pair: digits to numbers below 100, those to
numbers below 10^4, those to one below 10^8. A cell is then a whole number of 1e-9 below 2^53, and its
quotient by 10^9 is the float64 nearest to the text, as `float` would give it.

Source: D. Lemire, "Number parsing at a gigabyte per second", Software: Practice and Experience 51 (2021), for
the sum of eight digits in a word.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.streams.decimals import DECIMALS

_Words = NDArray[np.uint64]
_Places = NDArray[np.intp]

_FRONT = b"0" * 24  # room for words that begin before the first cell
_ZEROS = np.uint64(0x3030303030303030)
_SIXES = np.uint64(0x0606060606060606)
_HIGH_HALVES = np.uint64(0xF0F0F0F0F0F0F0F0)
# The word's last 0 to 8 bytes, which are the high ones of a little-endian word.
_LAST = np.array([0] + [(1 << 64) - (1 << 8 * (8 - count)) for count in range(1, 9)], dtype=np.uint64)


class NotFixedError(ValueError):
    """The text is not of the one form that this reader knows."""


def scan_fixed(text: bytes, width: int, whole_numbers: Sequence[int] = ()) -> Array:
    """Return the rows (N, width) of `text`.

    Args:
        text: Lines that end in a line feed, cells of the form -12.345678901 separated by commas.
        width: Cells of a line.
        whole_numbers: Columns whose cells have no decimals.

    Raises:
        NotFixedError: When anything at all differs from that form, or a value is above 9e6.
    """
    buffer = np.frombuffer(_FRONT + text, dtype=np.uint8)
    ends = _cell_ends(buffer, width)
    starts = np.empty_like(ends)
    starts[0], starts[1:] = len(_FRONT), ends[:-1] + 1
    negative = buffer[starts] == ord("-")
    starts += negative
    rows = np.empty((ends.size // width, width))
    fixed = np.ones(width, dtype=bool)
    fixed[list(whole_numbers)] = False
    if not fixed.all():
        counting = np.tile(~fixed, len(rows))
        rows[:, ~fixed] = _whole_numbers(buffer, starts[counting], ends[counting]).reshape(len(rows), -1)
        decimal = ~counting
        rows[:, fixed] = _decimals(buffer, starts[decimal], ends[decimal]).reshape(len(rows), -1)
    else:
        rows[:] = _decimals(buffer, starts, ends).reshape(rows.shape)
    return np.negative(rows, out=rows, where=negative.reshape(rows.shape))


def _cell_ends(buffer: NDArray[np.uint8], width: int) -> _Places:
    """Return where each cell's comma or line feed stands, shape (N * width,)."""
    ends = np.flatnonzero(buffer < ord("-"))
    if ends.size == 0 or ends.size % width or ends[-1] != buffer.size - 1:
        raise NotFixedError
    separators = buffer[ends].reshape(-1, width)
    if (separators[:, :-1] != ord(",")).any() or (separators[:, -1] != ord("\n")).any():
        raise NotFixedError
    return ends


def _decimals(buffer: NDArray[np.uint8], starts: _Places, ends: _Places) -> Array:
    """Return the magnitudes (N,) of cells with nine decimals; `starts` is behind the sign."""
    point = ends - (DECIMALS + 1)
    first = buffer[point + 1] - np.uint8(ord("0"))
    if (buffer[point] != ord(".")).any() or (first > 9).any():
        raise NotFixedError
    units = _digits(buffer, starts, point).astype(np.int64)
    units *= 10
    units += first
    units *= 10**8
    units += _digits(buffer, ends - 8, ends).astype(np.int64)
    if units.max(initial=0) >= 2**53:
        raise NotFixedError
    return units / 10.0**DECIMALS


def _whole_numbers(buffer: NDArray[np.uint8], starts: _Places, ends: _Places) -> Array:
    return _digits(buffer, starts, ends).astype(np.float64)


def _digits(buffer: NDArray[np.uint8], starts: _Places, ends: _Places) -> _Words:
    """Return the whole numbers of 1 to 8 digits in buffer[start:end]."""
    length = ends - starts
    if length.min(initial=1) < 1 or length.max(initial=1) > 8:
        raise NotFixedError
    # Every place of the buffer seen as the start of a word.
    words = np.ndarray(buffer.size - 7, dtype="<u8", buffer=buffer, strides=(1,))
    word: _Words = words[ends - 8]
    word = word.astype(np.uint64, copy=False)
    word ^= _ZEROS
    word &= _LAST[length]
    if ((word | (word + _SIXES)) & _HIGH_HALVES).any():
        raise NotFixedError
    word = word * np.uint64(10) + (word >> np.uint64(8))
    odd = (word & np.uint64(0x000000FF000000FF)) * np.uint64(0x000F424000000064)
    even = ((word >> np.uint64(16)) & np.uint64(0x000000FF000000FF)) * np.uint64(0x0000271000000001)
    return (odd + even) >> np.uint64(32)
