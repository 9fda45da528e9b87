"""Agreement of text with nine decimals and the numbers that it was made from.

The numbers say how long each cell must be, so that nothing has to be looked for: the sixteen characters that
end with each separator are taken at once. Sign, point and separator are compared, the other characters must
be digits, and the whole number that they make must be the value to half a unit of the last decimal. That
proves the text right at half the cost of reading it. It proves nothing wrong: numbers of 10^4 and more, and
those that rounding leaves next to another length, are left to a reader.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.streams.decimals import DECIMALS, eight_digits

_Bytes = NDArray[np.uint8]
_LongWords = NDArray[np.uint64]
_Indices = NDArray[np.intp]

_WINDOW = 16  # characters looked at: separator, nine decimals, point, four digits, sign
_ROUNDED_UP = 0.5e-9  # below a power of ten a number is written with one digit more
_WITH_SIGN = -0.5005e-9  # nearer to zero there may be none: the first of the two roundings
_LARGEST = 1e4 - 1e-9
_HALF_UNIT = 0.5009  # of the last decimal: that of both roundings, and of the product here
_DIGIT, _SAME = 0xF0, 0xFF  # bits that must be zero in a digit's value, and in a character that is compared
_PAIRS = np.uint64(0x000000FF000000FF)
_LAST_EIGHT = (0x000F424000000064, 0x0000271000000001)  # weights of the pairs of eight digits
_FIRST_EIGHT = (10 + (100000 << 32), 1 + (1000 << 32))  # the same where the sixth is the decimal point


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
