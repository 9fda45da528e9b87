"""Period of time stamps: the grid t0 + k h on which stamps lie that were rounded.

Stamps lie on a grid of period h, each within its rounding r, where max(t_k - k h) - min(t_k - k h) <= 2 r.
Only corners of the convex hull of the points (k, t_k) can be such a maximum or minimum, so these are all that
is kept of a file of any length. The left side is convex in h; of all periods that fit the simplest fraction
of seconds is taken, such as 1/24. Stamps that lie on a grid as they are written are on that one.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from math import floor

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.frozen import comparable

_LEAST_RATIO = 10.0  # units of the last decimal in a period: below, rounded stamps say little about it
_FEWEST = 3
_STEPS = 200  # halvings of an interval of periods: more than a float64 has bits
_ULPS = 8.0  # of the largest stamp: what sums and products of floats leave
_MANY = 4096  # corners, above which the hull of those is taken; then, where they are twice as many as it left


@comparable
class StampGrid:
    """The grid of some time stamps.

    Attributes:
        start: Of the grid, s; within rounding of the first stamp.
        period: h, s.
        snapped: Whether a stamp differs from its point of the grid by more than float arithmetic explains.
        deviation: The largest distance of a stamp from its point of the grid, s.
    """

    start: float
    period: float
    snapped: bool
    deviation: float

    def times(self, first: int, count: int) -> Array:
        """Return points of the grid, s, shape (count,), from the index `first` on, which counts from 0."""
        return np.asarray(self.start + np.arange(first, first + count) * self.period, dtype=np.float64)


class PeriodFit:
    """A fit of a period to stamps that come block by block."""

    def __init__(self) -> None:
        self._count, self._first, self._last, self._rising = 0, 0.0, -np.inf, True
        self._upper, self._lower = np.empty((0, 2)), np.empty((0, 2))
        self._many = _MANY

    def add(self, times: Array) -> None:
        """Take the next stamps, s, shape (N,)."""
        if times.size == 0 or not self._rising:
            return
        self._rising = bool(times[0] > self._last and (np.diff(times) > 0).all())
        self._first = self._first if self._count else float(times[0])
        self._last = float(times[-1])
        points = np.column_stack([np.arange(self._count, self._count + times.size), times])
        self._count += times.size
        self._upper = np.concatenate([self._upper, points[_corners(points, 1.0)]])
        self._lower = np.concatenate([self._lower, points[_corners(points, -1.0)]])
        if max(len(self._upper), len(self._lower)) > self._many:
            self._upper = self._upper[_corners(self._upper, 1.0)]
            self._lower = self._lower[_corners(self._lower, -1.0)]
            self._many = max(_MANY, 2 * len(self._upper), 2 * len(self._lower))

    def result(self, rounding: float, relative: float = 0.0) -> StampGrid | None:
        """Return the grid of all stamps so far; None where there is none."""
        if not self._rising or self._count < _FEWEST:
            return None
        largest = max(abs(self._first), abs(self._last))
        noise = _ULPS * float(np.spacing(largest))
        allowed = rounding + relative * largest + noise
        mean = (self._last - self._first) / (self._count - 1)
        best = _least(self._slope, mean - 2 * allowed, mean + 2 * allowed)
        if self._spread(best) > 2 * allowed:
            return None
        if self._spread(best) <= 2 * noise:  # on a grid as they are written: no other one is meant
            allowed = noise
        period = self._simplest(best, allowed)
        low, high = self._ends(period)
        start = _start(low, high, self._first, allowed)
        deviation = max(high - start, start - low)
        if deviation > noise and period < 2 * _LEAST_RATIO * (allowed - noise):
            return None
        return StampGrid(start, period, deviation > noise, deviation)

    def _ends(self, period: float) -> tuple[float, float]:
        """Return the least and the largest t - k h."""
        lower, upper = (points[:, 1] - points[:, 0] * period for points in (self._lower, self._upper))
        return float(lower.min()), float(upper.max())

    def _spread(self, period: float) -> float:
        low, high = self._ends(period)
        return high - low

    def _slope(self, period: float) -> float:
        """Return the derivative of the spread."""
        lower, upper = (points[:, 1] - points[:, 0] * period for points in (self._lower, self._upper))
        return float(self._lower[lower.argmin(), 0] - self._upper[upper.argmax(), 0])

    def _simplest(self, best: float, allowed: float) -> float:
        """Return the simplest period that fits."""
        width = 4 * allowed

        def fits(side: float) -> Callable[[float], float]:
            return lambda share: 1.0 if self._spread(best + side * share * width) > 2 * allowed else -1.0

        low, high = (best + side * width * _least(fits(side), 0.0, 1.0, 60) for side in (-1.0, 1.0))
        if not 0 < low < high:
            return best
        period = float(simplest_between(Fraction(low), Fraction(high)))
        return period if self._spread(period) <= 2 * allowed else best


def _least(slope: Callable[[float], float], low: float, high: float, steps: int = _STEPS) -> float:
    """Return where a rising function changes its sign, from below."""
    for _ in range(steps):
        middle = (low + high) / 2
        if not low < middle < high:
            break
        if slope(middle) > 0:
            high = middle
        else:
            low = middle
    return low


def _start(low: float, high: float, first: float, allowed: float) -> float:
    """Return the start of a grid: zero or the first stamp where these fit."""
    for start in (0.0, first):
        if high - allowed <= start <= low + allowed:
            return start
    return (low + high) / 2


def simplest_between(low: Fraction, high: Fraction) -> Fraction:
    """Return the fraction of the smallest denominator in an interval of positive numbers.

    Source: Graham, Knuth and Patashnik, Concrete Mathematics (1994), section 6.7.
    """
    whole = floor(low)
    if whole == low:
        return Fraction(whole)
    if whole + 1 <= high:
        return Fraction(whole + 1)
    return whole + 1 / simplest_between(1 / (high - whole), 1 / (low - whole))


def _corners(points: Array, side: float) -> NDArray[np.intp]:
    """Return the corners of the upper (1) or lower (-1) hull of points (N, 2) whose first numbers rise."""
    corners, open_parts = {0, len(points) - 1}, [(0, len(points) - 1)]
    while open_parts:
        left, right = open_parts.pop()
        if right - left < 2:
            continue
        rise = (points[right, 1] - points[left, 1]) / (points[right, 0] - points[left, 0])
        inner = points[left + 1 : right]
        above = side * (inner[:, 1] - points[left, 1] - rise * (inner[:, 0] - points[left, 0]))
        farthest = int(above.argmax())
        if above[farthest] > 0:
            corner = left + 1 + farthest
            corners.add(corner)
            open_parts += [(left, corner), (corner, right)]
    return np.array(sorted(corners), dtype=np.intp)
