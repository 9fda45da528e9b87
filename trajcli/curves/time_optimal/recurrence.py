"""Recurrence z_{i+1} = min(limit_{i+1}, least of some lines at z_i), from one end of a grid to the other.

Few intervals are followed one by one, with the lines that may be lowest. Many are cut into chunks that
advance abreast, each from a guess of its first z; where a guess was wrong they advance once more, until they
meet the values of the time before. What a few times leave open is followed one by one: there each chunk waits
for the one before it. Both do the same arithmetic, and agree to the last bit.
"""

from __future__ import annotations

from itertools import islice

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array

HUGE = 1e100  # stands for an unlimited z: beyond it only the slopes of lines matter
_BLOCK = 8192  # intervals whose lines are held at a time
_MANY = 1000  # intervals from which on chunks abreast are faster
_SWEEPS = 5  # of chunks abreast: most guesses are right by then, or few are


def solve_recurrence(P: Array, R: Array, C: Array, chosen: NDArray[np.bool_], limits: Array) -> Array:
    """Return z, shape (N + 1,): limits_0, then the least of limits_{i+1} and (C_i - P_i z_i) / R_i.

    Args:
        P: Shape (m, N).
        R: Shape (m, N).
        C: Shape (m, N).
        chosen: The rows that count, shape (m, N).
        limits: Not negative, shape (N + 1,).
    """
    z = limits.copy()
    for first in range(0, z.size - 1, _BLOCK):
        last = min(first + _BLOCK, z.size - 1)
        counts, divisor = chosen[:, first:last], R[:, first:last]
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            slopes = np.where(counts, P[:, first:last] / divisor, 0.0)
            offsets = np.where(counts, C[:, first:last] / divisor, np.inf)
        advance = _abreast if last - first > _MANY else _one_by_one
        z[first + 1 : last + 1] = advance(slopes, offsets, limits[first : last + 1], float(z[first]))
    return z


def _one_by_one(slopes: Array, offsets: Array, limits: Array, z: float) -> list[float]:
    """Return what z becomes in each interval: the least of its limit and of offset - slope z."""
    slopes, offsets, values = slopes.T, offsets.T, []
    main, further = _lowest_lines(offsets, offsets - slopes * np.minimum(limits[:-1, None], HUGE))
    rows = np.arange(main.size)
    lines = zip(slopes[further].tolist(), offsets[further].tolist(), strict=True)
    for limit, slope, offset, count in zip(
        limits[1:].tolist(),
        slopes[rows, main].tolist(),
        offsets[rows, main].tolist(),
        np.count_nonzero(further, axis=1).tolist(),
        strict=True,
    ):
        lowest = offset - slope * z
        if not lowest < limit:
            lowest = limit
        if count:
            for more_slope, more_offset in islice(lines, count):
                value = more_offset - more_slope * z
                if value < lowest:
                    lowest = value
        z = lowest if lowest > 0.0 else 0.0  # zero is always allowed: what is below is rounding
        values.append(z)
    return values


def _lowest_lines(first: Array, last: Array) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """Return for each row of lines which is lowest at first, and which others may be lowest somewhere.

    Args:
        first: Their values where z is zero, shape (N, m).
        last: Their values where z is as large as it may be, shape (N, m).
    """
    rows = np.arange(len(first))
    main, other = first.argmin(axis=1), last.argmin(axis=1)
    further: NDArray[np.bool_] = (first < first[rows, other][:, None]) & (last < last[rows, main][:, None])
    further[rows, other] = True
    further[rows, main] = False
    return main, further


def _abreast(slopes: Array, offsets: Array, limits: Array, z: float) -> Array:
    """Return the same, shape (N,), of chunks that advance side by side."""
    count = limits.size - 1
    length = int(np.ceil(np.sqrt(count)))
    lines = _side_by_side(slopes, length, 0.0), _side_by_side(offsets, length, np.inf)
    tops = _side_by_side(limits[None, 1:], length, np.inf)[:, 0]
    begins = np.append(z, tops[-1, :-1])
    values = np.full_like(tops, np.nan)
    for _ in range(_SWEEPS):
        _advance(*lines, tops, values, begins)
        wrong = begins[1:] != values[-1, :-1]
        begins[1:] = values[-1, :-1]
        if not wrong.any():
            break
    found = values.T.reshape(-1)[:count]
    if wrong.any():
        right = length * (int(wrong.argmax()) + 1)
        remainder = slopes[:, right:], offsets[:, right:], limits[right:]
        found[right:] = _one_by_one(*remainder, float(found[right - 1]))
    return found


def _side_by_side(values: Array, length: int, filling: float) -> Array:
    """Return values (m, N) as (length, m, chunks), the last chunk filled up."""
    m, count = values.shape
    chunks = -(-count // length)
    filled = np.full((m, chunks * length), filling)
    filled[:, :count] = values
    return np.ascontiguousarray(filled.reshape(m, chunks, length).transpose(2, 0, 1))


def _advance(slopes: Array, offsets: Array, tops: Array, values: Array, begins: Array) -> None:
    """Write into `values` (length, chunks) what z becomes, until all chunks meet what stands there."""
    z = begins
    with np.errstate(invalid="ignore"):  # of an unlimited z a line without slope says nothing
        for step in range(len(values)):
            lowest = np.fmin.reduce(offsets[step] - slopes[step] * z, axis=0)
            z = np.maximum(np.fmin(lowest, tops[step]), 0.0)
            if (z == values[step]).all():
                return
            values[step] = z
