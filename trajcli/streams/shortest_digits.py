"""Shortest decimal digits from which each float64 can be restored, those of `repr`, found by whole blocks.

A value x is scaled by a power of ten to y, of seventeen digits before the point, in double-double
arithmetic. y rounded to fifteen digits, else to sixteen, else to seventeen is the answer: the first that
lies within half the distance of neighbouring float64 numbers. What lies too near a decision, 10^4 and more,
and below 1e-99 is left to `repr`.

Cells are laid down as four words of eight bytes each, from the first to the last: each covers what the
words before it have too much.

Source: G. L. Steele, J. L. White, "How to print floating-point numbers accurately", PLDI 1990, for what
shortest means; T. J. Dekker, "A floating-point technique for extending the available precision", Numerische
Mathematik 18 (1971).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.streams.number_cells import exact_product

_LongWords = NDArray[np.uint64]
_Integers = NDArray[np.int64]
_Bools = NDArray[np.bool_]

_VALUES = 16384  # values encoded at a time: their words stay in the processor's cache
_LARGEST = 10**4  # whole parts below have a word in a table
_LEAST = 1e-98
_LEAST_FIXED = -4  # decimal exponents below are written
_EXPONENTS = range(-99, 5)
_NEAR = 1e-6  # of the last digit: a decision this near is not sure
_TEN_16, _TEN_17 = 10**16, 10**17


def encode_full(rows: Array, whole_numbers: Sequence[int] = ()) -> bytes:
    """Return `rows` (N, m), finite, as lines of values separated by commas, with the digits of `repr`.

    Args:
        rows: Values.
        whole_numbers: Columns that are written without decimals.
    """
    step = max(1, _VALUES // rows.shape[1])
    return b"".join(_encode_block(rows[low : low + step], whole_numbers) for low in range(0, len(rows), step))


def _encode_block(rows: Array, whole_numbers: Sequence[int]) -> bytes:
    values, width = rows.reshape(-1), rows.shape[1]
    is_whole, is_last = np.zeros((2, *rows.shape), dtype=bool)
    is_whole[:, list(whole_numbers)], is_last[:, -1] = True, True
    whole, last = is_whole.reshape(-1), is_last.reshape(-1)
    if whole_numbers:
        values = np.where(whole, np.rint(values), values)
        whole &= np.abs(values) < _LARGEST
    words, lengths, offsets, sure = _words_of(values, whole, last.reshape(-1))
    for index in np.flatnonzero(~sure):
        cell = repr(float(values[index])) if index % width not in whole_numbers else str(int(values[index]))
        line = (cell + ("\n" if last[index] else ",")).encode()
        if len(line) > 32:  # a whole number of any size
            return _encode_one_by_one(rows, whole_numbers)
        words[index] = np.frombuffer(line.ljust(32, b"\0"), dtype=np.uint64)
        lengths[index], offsets[index] = len(line), (0, 8, 16, 24)
    ends = np.cumsum(lengths)
    offsets += (ends - lengths)[:, None]
    text = np.empty(int(ends[-1]) + 32, dtype=np.uint8)
    # Every byte as the start of a word: later words cover what is too much of those before.
    np.ndarray(text.size - 7, "<u8", text, strides=(1,))[offsets.reshape(-1)] = words.reshape(-1)
    return text[: int(ends[-1])].tobytes()


def _encode_one_by_one(rows: Array, whole_numbers: Sequence[int]) -> bytes:
    """Return the text of rows with whole numbers of more digits than a float64 has."""
    lines = []
    for row in rows.tolist():
        cells = [str(round(v)) if k in whole_numbers else repr(v) for k, v in enumerate(row)]
        lines.append(",".join(cells) + "\n")
    return "".join(lines).encode()


def _words_of(values: Array, whole: _Bools, last: _Bools) -> tuple[_LongWords, _Integers, _Integers, _Bools]:
    """Return each cell's words (N, 4), its length (N,), where its words begin (N, 4), and which are sure."""
    magnitude, negative = np.abs(values), np.signbit(values)
    digits, exponents, zeros, sure = _shortest(magnitude)
    powers, shifts, counts = _splits()
    index = exponents - _EXPONENTS[0]
    fixed = exponents >= _LEAST_FIXED
    nothing = (magnitude == 0) | whole  # behind the point
    sure |= nothing
    magnitude = np.where(sure, magnitude, 1.0)
    leading = np.floor(magnitude).astype(np.uint64)
    if not fixed.all():
        leading = np.where(fixed, leading, digits // np.uint64(_TEN_16))
    fraction = (digits - leading * powers[index]) * shifts[index]
    count = counts[index] - zeros
    if nothing.any():
        fraction[nothing], count[nothing] = 0, 0
        leading[nothing] = magnitude[nothing].astype(np.uint64)
    np.maximum(count, fixed & ~whole, out=count)
    sure &= count <= 17
    fronts, front_lengths = _fronts()
    small = fixed & (exponents < -1) & ~nothing
    which = leading.astype(np.intp) + np.where(small, _LARGEST - 1 - exponents, 0)
    which += (_LARGEST + 4) * (2 * (count == 0) + (negative & ~(whole & (magnitude == 0))))
    which[~sure] = 0
    tails, tail_lengths = _tails()
    tail = np.where(fixed | ~sure, 0, -exponents) + 100 * last
    first, second, final = _split(fraction)
    words = np.stack([fronts[which], first, second, tails[tail]], axis=1)
    longest = count == 17
    words[:, 3] = np.where(longest, (words[:, 3] << np.uint64(8)) | final, words[:, 3])
    start = front_lengths[which]
    lengths = start + count + tail_lengths[tail]
    offsets = np.stack([np.zeros_like(start), start, start + 8, start + np.minimum(count, 16)], axis=1)
    return words, lengths, offsets, sure


def _shortest(magnitude: Array) -> tuple[_LongWords, _Integers, _Integers, _Bools]:
    """Return seventeen digits, decimal exponents, how many zeros end the digits, and which are sure."""
    sure = (magnitude >= _LEAST) & (magnitude < _LARGEST)
    x = np.where(sure, magnitude, 1.0)
    estimates, bounds, high, low = _scales()
    bits = x.view(np.int64)
    exponents = estimates[bits >> 52]
    exponents += x >= bounds[exponents - _EXPONENTS[0] + 1]
    index = exponents - _EXPONENTS[0]
    scale = high[index]
    product, rest = exact_product(x, scale)
    rest += x * low[index]
    half = scale * ((bits & (2047 << 52)) - (53 << 52)).view(np.float64)
    digits = np.rint(product / 100).astype(np.int64)
    rest += (product.astype(np.int64) - 100 * digits).astype(np.float64)
    tens, ones = np.rint(rest / 10), np.rint(rest)
    errors = np.abs(rest), np.abs(rest - 10 * tens)
    fifteen, sixteen = (error < half for error in errors)
    near = (np.abs(errors[0] - half) < _NEAR) | ((np.abs(errors[1] - half) < _NEAR) & ~fifteen)
    near |= (np.abs(errors[1] - 5) < _NEAR) & ~fifteen & sixteen
    near |= (np.abs(np.abs(rest - ones) - 0.5) < _NEAR) & ~sixteen
    near |= ((bits & ((1 << 52) - 1)) == 0) & (errors[0] > half / 4)  # the neighbour below is half as far
    zeros = np.where(fifteen, 2, sixteen.astype(np.int64))
    short = np.flatnonzero(fifteen)
    zeros[short] += _zeros_of(digits[short])
    digits *= 100
    digits += np.where(fifteen, 0, np.where(sixteen, 10 * tens, ones)).astype(np.int64)
    over = digits >= _TEN_17
    digits[over], exponents[over] = _TEN_16, exponents[over] + 1
    zeros[over] = 16
    sure &= ~near
    digits[~sure], exponents[~sure], zeros[~sure] = _TEN_16, 0, 16
    return digits.view(np.uint64), exponents, zeros, sure


def _zeros_of(digits: _Integers) -> _Integers:
    """Return how many zeros end each whole number below 10^16."""
    zeros = np.zeros_like(digits)
    for count in (8, 4, 2, 1):
        shorter = digits // 10**count
        ending = shorter * 10**count == digits
        digits = np.where(ending, shorter, digits)
        zeros += count * ending
    return zeros


def _split(fraction: _LongWords) -> tuple[_LongWords, _LongWords, _LongWords]:
    """Return the words of the first and the next eight of seventeen digits, and the last as a character."""
    first = fraction // np.uint64(10**9)
    fraction = fraction - first * np.uint64(10**9)
    second = fraction // np.uint64(10)
    final = fraction - second * np.uint64(10) + np.uint64(ord("0"))
    return _eight(first), _eight(second), final


def _eight(numbers: _LongWords) -> _LongWords:
    """Return the words of whole numbers below 10^8."""
    fours = _fours()
    high = numbers // np.uint64(10**4)
    low = numbers - high * np.uint64(10**4)
    return fours[high.astype(np.intp)] | (fours[low.astype(np.intp)] << np.uint64(32))


@cache
def _fours() -> _LongWords:
    """Return the four digits of each number below 10^4 as the low half of a word."""
    return _as_words([f"{number:04d}" for number in range(10**4)])


@cache
def _fronts() -> tuple[_LongWords, _Integers]:
    """Return what stands before the fraction's digits, with and without point and sign, and its lengths."""
    numbers = [f"{number}." for number in range(_LARGEST)] + ["0." + "0" * zeros for zeros in range(4)]
    texts = [sign + number.rstrip(point) for point in ("", ".") for sign in ("", "-") for number in numbers]
    return _as_words(texts), np.array(list(map(len, texts)))


@cache
def _tails() -> tuple[_LongWords, _Integers]:
    """Return what stands behind the digits by the exponent's size, separator included, and its lengths."""
    texts = [(f"e-{size:02d}" if size else "") + end for end in ",\n" for size in range(100)]
    return _as_words(texts), np.array(list(map(len, texts)))


def _as_words(texts: Sequence[str]) -> _LongWords:
    return np.frombuffer("".join(text.ljust(8, "\0") for text in texts).encode(), dtype=np.uint64)


@cache
def _splits() -> tuple[_LongWords, _LongWords, _Integers]:
    """Return by exponent: value of one before the point, factor that fills the fraction, its digits."""
    rows = []
    for exponent in _EXPONENTS:
        if exponent < _LEAST_FIXED:
            rows.append((_TEN_16, 10, 16))
        else:
            rows.append(
                (10 ** (16 - exponent), 10 ** (exponent + 1), 16 - exponent) if exponent >= 0 else (0, 1, 17)
            )
    powers, shifts, counts = zip(*rows, strict=True)
    return np.array(powers, dtype=np.uint64), np.array(shifts, dtype=np.uint64), np.array(counts)


@cache
def _scales() -> tuple[_Integers, Array, Array, Array]:
    """Return the least decimal exponent by the binary one; and 10^e, 10^(16 - e) and its rest by e."""
    binary = np.arange(2048) - 1023
    estimates = np.clip(np.floor(binary * np.log10(2.0)), _EXPONENTS[0], _EXPONENTS[-1] - 1).astype(np.int64)
    scales = [10 ** (16 - exponent) for exponent in _EXPONENTS]
    bounds = np.array([float(f"1e{exponent}") for exponent in _EXPONENTS])
    rests = np.array([float(scale - int(float(scale))) for scale in scales])
    return estimates, bounds, np.array(list(map(float, scales))), rests
