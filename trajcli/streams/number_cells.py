"""Decimal numbers of any form, read by whole blocks: every value is the float64 nearest to its text.

A cell is a whole mantissa m times a power of ten. Where m < 2^53 and the exponent lies within 22, both are
exact, and one division or product rounds correctly (Clinger's fast path). Longer mantissas, of up to 19
digits, and exponents within 60 are computed in double-double arithmetic, whose error is known; the few
results too near the middle of two float64 numbers, and all other cells, are left to `float`.

Source: W. D. Clinger, "How to read floating point numbers accurately", PLDI 1990; T. J. Dekker, "A
floating-point technique for extending the available precision", Numerische Mathematik 18 (1971).
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.frozen import frozen
from trajcli.streams.decimals import NotFixedError, eight_digits

_FRONT = b"0" * 24  # room for words that begin before the first cell
_MOST_DIGITS = 19  # below 10^19 < 2^64; zeros in front do not count
_MOST_CHARACTERS = 24  # three words
_MOST_DECIMALS = 2000  # that are counted: no float64 has more
_EXPONENT_DIGITS = 6  # of an exponent that are looked at
_EXACT_POWER = 22  # 10^22 is a float64
_LARGEST_POWER = 60
_POWERS = np.array([float(10**k) for k in range(_LARGEST_POWER + 1)])
_POWER_RESTS = np.array([float(10**k - int(float(10**k))) for k in range(_LARGEST_POWER + 1)])
_WHOLE_POWERS = 10 ** np.arange(_MOST_DIGITS + 1, dtype=np.uint64)
_FEW = 16  # cells of a block without what the others have
_SPLITTER = 2.0**27 + 1
_RARE = 0.05  # the share of cells that are read one by one; above, there is nothing to gain

_Bytes = NDArray[np.uint8]
_Indices = NDArray[np.intp]
_Bools = NDArray[np.bool_]
_LongWords = NDArray[np.uint64]


def scan_decimals(text: bytes, width: int) -> tuple[Array, NDArray[np.int64]]:
    """Return the rows (N, width) of `text`, and the most decimals that each column shows, (width,).

    Args:
        text: Lines that end in a line feed, cells separated by commas: -12, .5, 1.25e-05.
        width: Cells of a line.

    Raises:
        NotFixedError: When it has other lines, or a cell is no finite number, or many are of a rare form.
    """
    cells = _Cells.of(text, width)
    units, odd = cells.mantissas()
    exponents, wrong = cells.exponents()
    decimals = cells.fraction - exponents
    odd |= wrong | (np.abs(decimals) > _LARGEST_POWER)
    decimals[odd], units[odd] = 0, 0
    values, unsure = _scaled(units, decimals)
    np.negative(values, out=values, where=cells.negative)
    odd_cells = np.flatnonzero(odd)
    if odd_cells.size > max(_RARE * odd.size, 8):
        raise NotFixedError
    for index in (*odd_cells, *unsure):
        values[index], decimals[index] = cells.read(text, index)
    if not np.isfinite(values).all():
        raise NotFixedError
    most: NDArray[np.int64] = np.maximum(decimals, 0).reshape(-1, width).max(axis=0)
    return values.reshape(-1, width), most


def decimals_of(cell: bytes) -> int:
    """Return how many decimals a number shows, from 0 to some that no float64 has."""
    mantissa, _, exponent = cell.strip().lower().partition(b"e")
    digits = exponent.lstrip(b"+-").lstrip(b"0")[:_EXPONENT_DIGITS] or b"0"
    power = -int(digits) if exponent.startswith(b"-") else int(digits)
    return min(max(len(mantissa.partition(b".")[2]) - power, 0), _MOST_DECIMALS)


@frozen
class _Cells:
    """Where the parts of each cell stand; all arrays of shape (N,).

    Attributes:
        buffer: The text behind `_FRONT`.
        words: Every byte of the buffer as the start of a word of eight.
        first: Of the cell, sign included.
        starts: Of the digits.
        points: Of the decimal point, or of what follows the digits.
        mantissa_ends: Of the exponent's letter, or the end.
        ends: Of comma or line feed.
        negative: Whether there is a minus sign.
    """

    buffer: _Bytes
    words: _LongWords
    first: _Indices
    starts: _Indices
    points: _Indices
    mantissa_ends: _Indices
    ends: _Indices
    negative: _Bools

    @classmethod
    def of(cls, text: bytes, width: int) -> _Cells:
        """Return the cells of a text; NotFixedError where its lines are not of `width` cells."""
        if b"_" in text:  # float() would take 1_000
            raise NotFixedError
        buffer = np.frombuffer(_FRONT + text, dtype=np.uint8)
        line_feed = buffer == ord("\n")
        ends = np.flatnonzero((buffer == ord(",")) | line_feed)
        last = line_feed[ends]
        if ends.size == 0 or ends.size % width or ends[-1] != buffer.size - 1:
            raise NotFixedError
        if last.sum() * width != ends.size or not last[width - 1 :: width].all():
            raise NotFixedError
        first = np.concatenate([[len(_FRONT)], ends[:-1] + 1])
        starts = first + (buffer[first] == ord(" "))
        negative = buffer[starts] == ord("-")
        starts += negative | (buffer[starts] == ord("+"))
        mantissa_ends = _positions((buffer | 32) == ord("e"), ends, ends)
        points = _positions(buffer == ord("."), ends, mantissa_ends)
        words = np.ndarray(buffer.size - 7, dtype="<u8", buffer=buffer, strides=(1,))
        return cls(buffer, words, first, starts, points, mantissa_ends, ends, negative)

    @property
    def fraction(self) -> NDArray[np.int64]:
        """Number of digits behind the point."""
        length: NDArray[np.int64] = np.maximum(self.mantissa_ends - self.points - 1, 0).astype(np.int64)
        return length

    def mantissas(self) -> tuple[_LongWords, _Bools]:
        """Return all digits without the point as whole numbers, and for which cells they are not."""
        fraction, whole = self.fraction, self.points - self.starts
        digits = whole + fraction
        odd = (self.points > self.mantissa_ends) | (whole < 0) | (digits < 1)
        odd |= np.maximum(whole, fraction) > _MOST_CHARACTERS
        units, wrong = self._digits(self.points, np.where(odd, 0, whole))
        odd |= wrong
        parts, wrong = self._digits(self.mantissa_ends, np.where(odd, 0, fraction))
        odd |= (units > 0) & (digits > _MOST_DIGITS)
        units *= _WHOLE_POWERS[np.where(units > 0, np.minimum(fraction, _MOST_DIGITS), 0)]
        units += parts
        return units, odd | wrong

    def exponents(self) -> tuple[NDArray[np.int64], _Bools]:
        """Return the powers of ten that are written behind the digits, and where they cannot be told."""
        exponents, wrong = np.zeros(self.ends.size, np.int64), np.zeros(self.ends.size, np.bool_)
        written = self.mantissa_ends < self.ends
        if written.any():
            having = slice(None) if written.all() else np.flatnonzero(written)
            starts, ends = self.mantissa_ends[having] + 1, self.ends[having]
            negative = self.buffer[starts] == ord("-")
            lengths = ends - starts - (negative | (self.buffer[starts] == ord("+")))
            unusual = (lengths < 1) | (lengths > 3)
            sizes, bad = self._digits(ends, np.where(unusual, 0, lengths))
            exponents[having] = np.where(negative, -1, 1) * sizes.astype(np.int64)
            wrong[having] = unusual | bad
        return exponents, wrong

    def _digits(self, ends: _Indices, lengths: _Indices) -> tuple[_LongWords, _Bools]:
        """Return the whole numbers in front of `ends`, and where they are none or 10^19 and more."""
        if lengths.max(initial=0) <= 1:
            digits = np.where(lengths == 1, self.buffer[ends - 1] ^ np.uint8(ord("0")), np.uint8(0))
            return digits.astype(np.uint64), digits > 9
        total, wrong = eight_digits(self.words, ends, np.minimum(lengths, 8))
        for before in range(8, int(lengths.max(initial=0)), 8):
            some, bad = eight_digits(self.words, ends - before, np.clip(lengths - before, 0, 8))
            total += some * _WHOLE_POWERS[before]
            wrong |= bad if before < 16 else bad | (some >= 1000)
        return total, wrong

    def read(self, text: bytes, index: int) -> tuple[float, int]:
        """Return value and decimals of one cell, read by `float`."""
        cell = text[self.first[index] - len(_FRONT) : self.ends[index] - len(_FRONT)]
        try:
            value = float(cell)
            return value, decimals_of(cell) if np.isfinite(value) else 0
        except ValueError:
            raise NotFixedError from None


def _positions(marks: _Bools, ends: _Indices, otherwise: _Indices) -> _Indices:
    """Return where the marked byte of each cell stands; `otherwise` where there is none."""
    marked = np.flatnonzero(marks)
    if marked.size == 0:
        return otherwise
    if marked.size == ends.size and (marked < ends).all() and (marked[1:] > ends[:-1]).all():
        return marked
    positions = otherwise.copy()
    positions[_owners(marked, ends)] = marked
    return positions


def _owners(marked: _Indices, ends: _Indices) -> _Indices:
    """Return the cell of each marked byte."""
    without = ends.size - marked.size
    if not 0 < without <= _FEW:
        return np.searchsorted(ends, marked)
    # Where a cell has at most one, each cell without one shifts all that follow by one more.
    owners = np.arange(marked.size)
    for shift in range(without):
        passed = partial(lambda index, shift: marked[index] > ends[index + shift], shift=shift)
        owners[bisect_left(range(marked.size), True, key=passed) :] += 1
    own = ends[owners]
    if (
        (marked < own).all()
        and (marked[1:] > own[:-1]).all()
        and marked[0] > (ends[owners[0] - 1] if owners[0] else 0)
    ):
        return owners
    return np.searchsorted(ends, marked)


def _scaled(units: _LongWords, decimals: NDArray[np.int64]) -> tuple[Array, Sequence[int]]:
    """Return units / 10^decimals (N,) correctly rounded, and the indices where that is not sure."""
    values = units.astype(np.float64)
    long = np.flatnonzero((units >= 2**53) | (np.abs(decimals) > _EXACT_POWER))
    values /= _POWERS[np.maximum(decimals, 0)]
    if decimals.min(initial=0) < 0:
        values *= _POWERS[np.maximum(-decimals, 0)]
    if long.size == 0:
        return values, []
    values[long], unsure = _long_scaled(units[long], decimals[long])
    return values, list(long[unsure])


def _long_scaled(units: _LongWords, decimals: NDArray[np.int64]) -> tuple[Array, _Bools]:
    """Return the same in double-double arithmetic, and which are too near a middle to be sure."""
    high = units.astype(np.float64)
    low = (units - high.astype(np.uint64)).view(np.int64).astype(np.float64)
    power, power_rest = _POWERS[np.abs(decimals)], _POWER_RESTS[np.abs(decimals)]
    divided = decimals >= 0
    quotient = np.where(divided, high / power, high)
    product, error = exact_product(quotient, power)
    corrected = (high - product) - error + (low - quotient * power_rest)
    rest = np.where(divided, corrected / power, error + (low * power + high * power_rest))
    leading = np.where(divided, quotient, product)
    values = leading + rest
    left = np.abs(rest - (values - leading))
    gap = np.spacing(values)
    # Below a power of two the neighbour is half as far.
    unsure = (np.abs(left - gap / 2) <= 1e-9 * gap) | ((np.frexp(values)[0] == 0.5) & (left >= 0.24 * gap))
    return values, unsure


def exact_product(first: Array, second: Array) -> tuple[Array, Array]:
    """Return the rounded products (N,) and their errors, which together are exact."""
    product = first * second
    a, b = _halves(first), _halves(second)
    return product, ((a[0] * b[0] - product) + a[0] * b[1] + a[1] * b[0]) + a[1] * b[1]


def _halves(values: Array) -> tuple[Array, Array]:
    """Return two summands of at most 26 bits each."""
    scaled = _SPLITTER * values
    high = scaled - (scaled - values)
    return high, values - high
