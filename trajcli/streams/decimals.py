"""Decimal text of numbers with nine fixed decimals: the same bytes on every processor, written and read fast.

Writing: a value is split into its whole and its fractional part, which is exact. The fraction is rounded to
1e-12 first and from there to 1e-9, both on scaled integers and half to even: values that differ in their last
bits only, because they were evaluated in another order, give the same digits even where they stand on a tie.

Text is made of words of four bytes from tables: `-12`, `.345`, `6789`, `01,`. Shorter words are filled with
NUL bytes, which are dropped from the whole block at once.

Reading: eight digits are one 64-bit word and are summed pair by pair: digits to numbers below 100, those to
numbers below 10^4, those to one below 10^8. A cell is then a whole number of 1e-9 below 2^53, and its
quotient by 10^9 is the float64 nearest to the text, as `float` would give it. Other forms: `number_cells`.

Comparing with the numbers that the text was made from: these say how long each cell must be, so that nothing
has to be looked for: the sixteen characters that end with each separator are taken at once. Sign, point and
separator are compared, the other characters must be digits, and the whole number that they make must be the
value to half a unit of the last decimal. That proves the text right at half the cost of reading it. It proves
nothing wrong: numbers of 10^4 and more, and those that rounding leaves next to another length, are left to a
reader.

Source: D. Lemire, "Number parsing at a gigabyte per second", Software: Practice and Experience 51 (2021), for
the sum of eight digits in a word.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array

DECIMALS = 9
Digits = Literal["fixed", "full"]
"""Nine decimals, or the fewest digits from which each float64 can be restored bit by bit."""

_Bytes = NDArray[np.uint8]
_Words = NDArray[np.uint32]
_LongWords = NDArray[np.uint64]
_Indices = NDArray[np.intp]
_Bools = NDArray[np.bool_]

_VALUES = 16384  # values encoded at a time: their words stay in the processor's cache
_NARROW = 1e3  # whole parts below this and their sign fit into one word
_WIDE = 1e7  # into two words
_WINDOW = 16  # characters looked at: separator, nine decimals, point, four digits, sign
_ROUNDED_UP = 0.5e-9  # below a power of ten a number is written with one digit more
_WITH_SIGN = -0.5005e-9  # nearer to zero there may be none: the first of the two roundings
_LARGEST = 1e4 - 1e-9
_HALF_UNIT = 0.5009  # of the last decimal: that of both roundings, and of the product here
_DIGIT, _SAME = 0xF0, 0xFF  # bits that must be zero in a digit's value, and in a character that is compared
_PAIRS = np.uint64(0x000000FF000000FF)
_LAST_EIGHT = (0x000F424000000064, 0x0000271000000001)  # weights of the pairs of eight digits
_FIRST_EIGHT = (10 + (100000 << 32), 1 + (1000 << 32))  # the same where the sixth is the decimal point


def encode_fixed(rows: Array, whole_numbers: Sequence[int] = ()) -> bytes:
    """Return `rows` (N, m), finite, as lines of values separated by commas.

    Args:
        rows: Values.
        whole_numbers: Columns that are written without decimals.
    """
    step = max(1, _VALUES // rows.shape[1])
    return b"".join(_encode_block(rows[low : low + step], whole_numbers) for low in range(0, len(rows), step))


def _encode_block(rows: Array, whole_numbers: Sequence[int]) -> bytes:
    negative, whole, fraction = _rounded(rows.reshape(-1))
    largest = whole.max()
    if largest >= _WIDE:
        return _encode_huge(negative, whole, fraction, rows.shape[1], whole_numbers)
    words = np.empty((*rows.shape, 4 if largest < _NARROW else 5), dtype=np.uint32)
    flat = words.reshape(rows.size, -1)
    if largest < _NARROW:
        whole += 1e3 * negative
        flat[:, 0] = _signed_words()[whole.astype(np.intp)]
    else:
        _put_wide(flat, negative, whole)
    _put_fraction(flat[:, -3:], fraction)
    text = words.view(np.uint8)
    text[:, -1, -2] = ord("\n")
    text[:, list(whole_numbers), -12:-2] = 0
    return words.tobytes().translate(None, b"\0")


def _rounded(values: Array) -> tuple[_Bools, Array, Array]:
    """Return sign, whole part and fraction, in units of the last decimal, of the rounded values (N,).

    A value that is rounded to zero has no sign.
    """
    magnitude = np.abs(values)
    whole = np.floor(magnitude)
    fraction = magnitude - whole
    fraction *= 1e12
    np.rint(fraction, out=fraction)
    fraction /= 1e3
    np.rint(fraction, out=fraction)
    carried = fraction >= 1e9
    if carried.any():
        whole += carried
        fraction[carried] = 0.0
    return (values < 0) & (whole + fraction > 0), whole, fraction


def _put_wide(words: _Words, negative: _Bools, whole: Array) -> None:
    """Write whole parts below 1e7 into the first two columns of `words` (N, 2 or more)."""
    high = np.floor(whole / 1e4)
    low = whole - 1e4 * high
    low += 1e4 * (high > 0)
    high += 1e3 * negative
    # A sign alone stands in the first word where there are no digits for it.
    words[:, 0] = _leading_words()[high.astype(np.intp)]
    words[:, 1] = _trailing_words()[low.astype(np.intp)]


def _put_fraction(words: _Words, fraction: Array) -> None:
    """Write point, nine digits and a comma into `words` (N, 3); `fraction` (N,) is used up."""
    first = np.floor(fraction * 1e-6)  # exact, as the next, for all whole numbers below 1e9
    fraction -= 1e6 * first
    middle = np.floor(fraction * 1e-2)
    fraction -= 1e2 * middle
    tenths, digits, ends = _fraction_tables()
    words[:, 0] = tenths[first.astype(np.intp)]
    words[:, 1] = digits[middle.astype(np.intp)]
    words[:, 2] = ends[fraction.astype(np.intp)]


def _encode_huge(
    negative: _Bools, whole: Array, fraction: Array, width: int, whole_numbers: Sequence[int]
) -> bytes:
    """Return the text of a block that holds numbers of any size; whole parts are exact."""
    cells = [
        f"{'-' if minus else ''}{int(digits)}.{int(decimals):09d}"
        for minus, digits, decimals in zip(negative.tolist(), whole.tolist(), fraction.tolist(), strict=True)
    ]
    lines = [cells[low : low + width] for low in range(0, len(cells), width)]
    for line in lines:
        for column in whole_numbers:
            line[column] = line[column].partition(".")[0]
    return "".join(",".join(line) + "\n" for line in lines).encode()


def _words(texts: Iterable[str]) -> _Words:
    """Return each text of at most four characters as a word, filled with NUL bytes in front."""
    return np.frombuffer("".join(text.rjust(4, "\0") for text in texts).encode(), dtype=np.uint32)


@cache
def _signed_words() -> _Words:
    """Return the words of 0 to 999, then those of -0 to -999."""
    return _words([f"{sign}{number}" for sign in ("", "-") for number in range(1000)])


@cache
def _leading_words() -> _Words:
    """Return the same words, without the digit of 0 and -0."""
    return _words([f"{sign}{number or ''}" for sign in ("", "-") for number in range(1000)])


@cache
def _trailing_words() -> _Words:
    """Return the words of 0 to 9999, then the same of four digits each."""
    return _words([form.format(number) for form in ("{}", "{:04d}") for number in range(10000)])


@cache
def _fraction_tables() -> tuple[_Words, _Words, _Words]:
    """Return the words of the first three decimals, of the next four, and of the last two with a comma."""
    first, last = _digits(1000), _digits(100)
    first[:, 0] = ord(".")
    last[:] = np.column_stack([last[:, 2:], np.full(100, ord(",")), np.zeros(100)])
    return _as_words(first), _as_words(_digits(10000)), _as_words(last)


def _digits(count: int) -> NDArray[np.uint8]:
    """Return the numbers below `count` as digits, shape (count, 4), with leading zeros."""
    return (np.arange(count)[:, None] // [1000, 100, 10, 1] % 10 + ord("0")).astype(np.uint8)


def _as_words(characters: NDArray[np.uint8]) -> _Words:
    return np.ascontiguousarray(characters).view(np.uint32)[:, 0]


_AT_ONCE = 8  # digits that are read together
_FRONT = b"0" * 24  # room for words that begin before the first cell
_ZEROS = np.uint64(0x3030303030303030)
_SIXES = np.uint64(0x0606060606060606)
_HIGH_HALVES = np.uint64(0xF0F0F0F0F0F0F0F0)
# The word's last 0 to 8 bytes, which are the high ones of a little-endian word.
_LAST = np.array([0] + [(1 << 64) - (1 << 8 * (8 - count)) for count in range(1, 9)], dtype=np.uint64)


class NotFixedError(ValueError):
    """The text is not of the one form that this reader knows."""


def scan_fixed(text: bytes, decimals: Sequence[int]) -> Array:
    """Return the rows (N, width) of `text`.

    Args:
        text: Lines that end in a line feed, cells of the form -12.345678901 separated by commas.
        decimals: How many the cells of each column have; 0 for whole numbers without a point.

    Raises:
        NotFixedError: When anything at all differs from that form, or a number has more digits than are
            exact.
    """
    buffer = np.frombuffer(_FRONT + text, dtype=np.uint8)
    ends = _cell_ends(buffer, len(decimals))
    starts = np.empty_like(ends)
    starts[0], starts[1:] = len(_FRONT), ends[:-1] + 1
    negative = buffer[starts] == ord("-")
    starts += negative
    rows = np.empty((ends.size // len(decimals), len(decimals)))
    for count in set(decimals):
        alike = np.equal(decimals, count)
        if alike.all():
            rows[:] = _magnitudes(buffer, starts, ends, count).reshape(rows.shape)
        else:
            cells = np.tile(alike, len(rows))
            rows[:, alike] = _magnitudes(buffer, starts[cells], ends[cells], count).reshape(len(rows), -1)
    return np.negative(rows, out=rows, where=negative.reshape(rows.shape))


def _cell_ends(buffer: NDArray[np.uint8], width: int) -> _Indices:
    """Return where each cell's comma or line feed stands, shape (N * width,)."""
    ends = np.flatnonzero(buffer < ord("-"))
    if ends.size == 0 or ends.size % width or ends[-1] != buffer.size - 1:
        raise NotFixedError
    separators = buffer[ends].reshape(-1, width)
    if (separators[:, :-1] != ord(",")).any() or (separators[:, -1] != ord("\n")).any():
        raise NotFixedError
    return ends


def _magnitudes(buffer: NDArray[np.uint8], starts: _Indices, ends: _Indices, decimals: int) -> Array:
    """Return the magnitudes (N,) of cells with so many decimals; `starts` is behind the sign."""
    if not decimals:
        return _digits_between(buffer, starts, ends).astype(np.float64)
    point, last = ends - (decimals + 1), min(decimals, _AT_ONCE)
    if decimals > DECIMALS or (buffer[point] != ord(".")).any():
        raise NotFixedError
    units = _digits_between(buffer, starts, point).astype(np.int64)
    if decimals > last:
        first = buffer[point + 1] - np.uint8(ord("0"))
        if (first > 9).any():
            raise NotFixedError
        units *= 10
        units += first
    units *= 10**last
    units += _digits_between(buffer, ends - last, ends).astype(np.int64)
    if units.max(initial=0) >= 2**53:
        raise NotFixedError
    return units / 10.0**decimals


def _digits_between(buffer: NDArray[np.uint8], starts: _Indices, ends: _Indices) -> _LongWords:
    """Return the whole numbers of 1 to 8 digits in buffer[start:end]."""
    length = ends - starts
    if length.min(initial=1) < 1 or length.max(initial=1) > _AT_ONCE:
        raise NotFixedError
    # Every byte of the buffer seen as the start of a word.
    words = np.ndarray(buffer.size - 7, dtype="<u8", buffer=buffer, strides=(1,))
    numbers, wrong = eight_digits(words, ends, length)
    if wrong.any():
        raise NotFixedError
    return numbers


def eight_digits(words: _LongWords, ends: _Indices, lengths: _Indices) -> tuple[_LongWords, _Bools]:
    """Return the whole numbers of 0 to 8 digits in front of `ends`, and where other characters stand.

    Args:
        words: Every byte of a text as the start of a little-endian word.
        ends: Shape (N,).
        lengths: Numbers of digits, shape (N,).
    """
    word: _LongWords = words[ends - 8]
    word = word.astype(np.uint64, copy=False)
    word ^= _ZEROS
    word &= _LAST[lengths]
    wrong = ((word | (word + _SIXES)) & _HIGH_HALVES) != 0
    word = word * np.uint64(10) + (word >> np.uint64(8))
    odd = (word & np.uint64(0x000000FF000000FF)) * np.uint64(0x000F424000000064)
    even = ((word >> np.uint64(16)) & np.uint64(0x000000FF000000FF)) * np.uint64(0x0000271000000001)
    return (odd + even) >> np.uint64(32), wrong


def _word(characters: Iterable[int]) -> np.uint64:
    """Return eight bytes as one little-endian word."""
    return np.uint64(int.from_bytes(bytes(characters), "little"))


def _front(digits: int, sign: bool) -> tuple[np.uint64, np.uint64]:
    """Return what the window's first half holds but for values of digits, and what of it is the cell's."""
    text = (b"-" if sign else b"") + b"0" * digits + b".00"
    return _word(text.rjust(8, b"\0")), _word(_SAME * (k >= 8 - len(text)) for k in range(8))


_FRONTS = [_front(digits, sign) for digits in range(1, 5) for sign in (False, True)]
_EXPECTED, _KEPT = (np.array(column, dtype=np.uint64) for column in zip(*_FRONTS, strict=True))
_FRONT_BITS = _word([_SAME, *4 * [_DIGIT], _SAME, _DIGIT, _DIGIT])
_FRONT_SIXES = _word([0, *4 * [6], 0, 6, 6])
_BACK_BITS, _BACK_SIXES = _word([*7 * [_DIGIT], _SAME]), _word([*7 * [6], 0])


class FixedLayout:
    """Where the cells of rows must stand in their text.

    Attributes:
        size: Length of the text, bytes.
    """

    def __init__(self, rows: Array, whole_numbers: Sequence[int] = ()) -> None:
        """Lay out `rows` (N, m), N >= 1; columns `whole_numbers` have no decimals."""
        self._fixed = np.ones(rows.shape[1], dtype=bool)
        self._fixed[list(whole_numbers)] = False
        self._rows, self._magnitude = rows, np.abs(rows)
        digits = np.zeros(rows.shape, dtype=np.uint8)
        for power in (10, 100, 1000):
            digits += self._magnitude >= power - _ROUNDED_UP
        self._negative = rows < _WITH_SIGN
        self._digits = digits
        lengths = digits + self._negative
        lengths += np.where(self._fixed, np.uint8(DECIMALS + 3), np.uint8(2))
        self._ends: _Indices = np.cumsum(lengths, dtype=np.intp).reshape(rows.shape)
        self.size = int(self._ends[-1, -1])

    def agrees(self, text: bytes) -> bool:
        """Return whether `text` is surely that of the rows, separators included."""
        if len(text) != self.size or not (self._magnitude < _LARGEST).all():
            return False
        buffer = np.frombuffer(b"0" * _WINDOW + text, dtype=np.uint8)
        if self._fixed.all():
            return self._decimals_agree(buffer)
        return self._decimals_agree(buffer) and self._whole_numbers_agree(buffer)

    def _decimals_agree(self, buffer: _Bytes) -> bool:
        part = slice(None) if self._fixed.all() else self._fixed
        windows = np.ndarray(buffer.size - _WINDOW + 1, np.complex128, buffer, strides=(1,))
        halves = windows[np.ascontiguousarray(self._ends[:, part])].view(np.uint64)  # front, back, front, ...
        code = 2 * self._digits[:, part] + self._negative[:, part]
        front = halves[:, ::2] & _KEPT[code]
        front ^= _EXPECTED[code]
        back = halves[:, 1::2] ^ self._separators(part)
        spare = front + _FRONT_SIXES
        spare |= front
        if np.bitwise_or.reduce(spare, axis=None) & _FRONT_BITS:
            return False
        np.add(back, _BACK_SIXES, out=spare)
        spare |= back
        if np.bitwise_or.reduce(spare, axis=None) & _BACK_BITS:
            return False
        back <<= np.uint64(8)
        units = _number(front, _FIRST_EIGHT, spare)
        units *= np.uint64(10**7)
        units += _number(back, _LAST_EIGHT, spare)
        error = units.view(np.int64).astype(np.float64)
        error -= 1e9 * self._magnitude[:, part]
        return bool(np.abs(error, out=error).max(initial=0.0) <= _HALF_UNIT)

    def _separators(self, part: slice | NDArray[np.bool_]) -> _LongWords:
        """Return the window's second half but for the values of digits, shape (columns,)."""
        words = np.full(self._fixed.size, _word(b"0000000,"))
        words[-1] = _word(b"0000000\n")
        return words[part]

    def _whole_numbers_agree(self, buffer: _Bytes) -> bool:
        columns = np.flatnonzero(~self._fixed)
        ends = self._ends[:, columns] + (_WINDOW - 1)  # of the separators
        expected = np.where(columns == self._fixed.size - 1, ord("\n"), ord(","))
        if (buffer[ends] != expected).any():
            return False
        words = np.ndarray(buffer.size - 7, dtype="<u8", buffer=buffer, strides=(1,))
        lengths = self._digits[:, columns].astype(np.intp) + 1
        numbers, wrong = eight_digits(words, ends, lengths)
        return not wrong.any() and bool((numbers == self._rows[:, columns]).all())


def _number(digits: _LongWords, weights: tuple[int, int], spare: _LongWords) -> _LongWords:
    """Return the whole numbers that eight digits in a word make; `digits` and `spare` are used up."""
    np.right_shift(digits, np.uint64(8), out=spare)
    digits *= np.uint64(10)
    digits += spare
    np.right_shift(digits, np.uint64(16), out=spare)
    digits &= _PAIRS
    spare &= _PAIRS
    digits *= np.uint64(weights[0])
    spare *= np.uint64(weights[1])
    digits += spare
    digits >>= np.uint64(32)
    return digits
