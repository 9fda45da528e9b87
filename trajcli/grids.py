"""Times of rows: a uniform grid, a list of times, or knots.

A grid knows the duration of what is sampled, and yields its times block by block, so that memory does not
grow with their number.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import ceil, isfinite

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array, PiecewisePolynomial, read_only
from trajcli.errors import InputError
from trajcli.frozen import comparable, frozen

ROWS = 4096  # rows of a block: long enough to hide the cost of a call, short enough for the cache
AT_BREAK = 1e-12  # s: a row this close before a break is at it; rounding decides no row's side
NANOSECOND = 1e-9  # s: the last decimal of a time in a file: rows closer than this would show the same time

_END = 1e-6  # of a period: an end this close to a grid time replaces that row


def outside_trajectory(time: float, start: float, end: float) -> InputError:
    """Return the error of a time that is not between the start and the end of a trajectory, s."""
    hint = f"it lasts from {start:.12g} s to {end:.12g} s"
    return InputError(f"the time {time:.12g} s lies outside the trajectory", hint=hint)


@comparable
class UniformGrid:
    """Rows at `start_time` + k / rate, and one exactly at the end.

    Attributes:
        duration: Seconds, at least 0.
        rate: Hz.
        start_time: Time of the first row, s.
    """

    duration: float
    rate: float
    start_time: float = 0.0

    def __post_init__(self) -> None:
        if not (isfinite(self.rate) and self.rate > 0):
            raise InputError(f"the rate is {self.rate:g} Hz, expected a finite number above 0")
        if not isfinite(self.start_time):
            raise InputError(f"the start time is {self.start_time:g} s, expected a finite number")
        finest = max(2 * NANOSECOND, 8 * self._spacing)
        if 1 / self.rate < finest:
            raise InputError(
                f"the rate of {self.rate:g} Hz is too high: the times of neighbouring rows would be equal",
                hint=f"from {self.start_time:g} s on, the rate can be at most {1 / finest:.17g} Hz",
            )

    @property
    def count(self) -> int:
        """Number of rows, at least 1."""
        least = max(NANOSECOND, 2 * self._spacing)
        near = max(_END / self.rate, least)
        return max(ceil((self.duration - near) * self.rate), int(self.duration > least)) + 1

    @property
    def _spacing(self) -> float:
        """Distance of neighbouring float64 numbers at the largest time, s."""
        return float(np.spacing(abs(self.start_time) + self.duration))

    def blocks(self, size: int = ROWS) -> Iterator[tuple[Array, Array]]:
        """Yield, for `size` rows at a time, their times as written and from the start, each (N,), s."""
        for low in range(0, self.count, size):
            local = self.local(low, low + size)
            yield self.start_time + local, local

    def local(self, low: int, high: int) -> Array:
        """Return the times of the rows from one index up to another or the end, from the start, (N,), s."""
        count = self.count
        times = np.arange(low, min(high, count)) / self.rate
        if high >= count and times.size:
            times[-1] = self.duration
        return times


@frozen
class ListedGrid:
    """Rows at given times.

    Attributes:
        duration: Seconds, at least 0.
        times: Shape (N,), s, counted like `start_time`: strictly increasing, inside the trajectory.
        start_time: Time at which the trajectory starts, s.
    """

    duration: float
    times: Array
    start_time: float = 0.0

    def __post_init__(self) -> None:
        times = read_only(self.times)
        low, high = self.start_time, self.start_time + self.duration
        if times.ndim != 1 or times.size == 0:
            raise InputError("the list of times is empty", hint="give at least one time, or a rate")
        inside = (times >= low - NANOSECOND) & (times <= high + NANOSECOND)
        if not inside.all():
            raise outside_trajectory(times[~inside][0], low, high)
        times = read_only(np.clip(times, low, high))
        close = np.flatnonzero(np.diff(times) <= NANOSECOND)
        if close.size:
            first, second = times[close[0]], times[close[0] + 1]
            raise InputError(
                f"the time {first:.12g} s is followed by {second:.12g} s",
                hint="times must increase, by more than 1e-9 s each",
            )
        object.__setattr__(self, "times", times)

    @property
    def count(self) -> int:
        """Number of rows, at least 1."""
        return int(self.times.size)

    def blocks(self, size: int = ROWS) -> Iterator[tuple[Array, Array]]:
        """Yield, for `size` rows at a time, their times as written and from the start, each (N,), s."""
        for low in range(0, self.count, size):
            times = self.times[low : low + size]
            yield times, np.clip(times - self.start_time, 0.0, self.duration)


@frozen
class KnotGrid:
    """Rows at knots, and where asked for at other times between them.

    Attributes:
        duration: Seconds, at least 0.
        local: Times of all rows from the start, s, shape (N,), strictly increasing.
        at: Which of the rows are knots, rising indices, shape (m,).
        states: Position, velocity and acceleration of these in SI, shape (3, m, n).
        start_time: Time of the first row, s.
    """

    duration: float
    local: Array
    at: NDArray[np.intp]
    states: Array
    start_time: float = 0.0

    @property
    def count(self) -> int:
        """Number of rows, at least 1."""
        return int(self.local.size)

    def blocks(self, size: int = ROWS) -> Iterator[tuple[Array, Array]]:
        """Yield, for `size` rows at a time, their times as written and from the start, each (N,), s."""
        for low in range(0, self.count, size):
            local = self.local[low : low + size]
            yield self.start_time + local, np.minimum(local, self.duration)

    def put_states(self, first: int, orders: Sequence[int], motion: Array) -> None:
        """Write the states of the knots into some rows.

        Args:
            first: Index of the first of these rows.
            orders: Of the derivatives that they hold.
            motion: Shape (N, orders, n), SI.
        """
        low, high = np.searchsorted(self.at, (first, first + len(motion)))
        for position, order in enumerate(orders):
            if order < len(self.states):
                motion[self.at[low:high] - first, position] = self.states[order, low:high]


Grid = UniformGrid | ListedGrid | KnotGrid


def onto_breaks(local: Array, breaks: Array) -> Array:
    """Return times (N,), s, those that rounding put just before a break moved onto it; the start stays."""
    following = breaks[np.minimum(np.searchsorted(breaks, local, "right"), breaks.size - 1)]
    near = max(AT_BREAK, 4 * float(np.spacing(breaks[-1])))
    return np.where((following - local <= near) & (local > breaks[0]), np.maximum(following, local), local)


def leave_short_pieces(
    curve: PiecewisePolynomial, times: Array, orders: Sequence[int], rows: Array, within: float = NANOSECOND
) -> None:
    """Take the acceleration, and its derivative, of rows beside too short pieces from outside of these.

    While such a piece lasts it may be immense, and whoever joins the rows would keep it for a whole period.

    Args:
        curve: What the rows are of.
        times: Of the rows, on the curve, shape (N,).
        orders: Of the derivatives that they hold.
        rows: Shape (N, orders, n), the curve's units; written to.
        within: A piece that is no longer than this is too short, s.
    """
    short = curve.lengths <= within
    if not short.any():
        return
    first_of_end = curve.breaks[np.searchsorted(curve.breaks, curve.end - within)]
    own, behind = (np.searchsorted(curve.breaks, each, "right") - 1 for each in (times, times + within))
    last, before = curve.breaks[behind], np.append(0, np.cumsum(short))  # how many end before a break
    at_end = last == curve.end
    beside = np.flatnonzero((before[behind] > before[own]) & ~at_end)
    for position, order in enumerate(orders):
        if order >= 2:
            rows[beside, position] = curve.evaluate(last[beside], order)
            if curve.start < first_of_end < curve.end:
                rows[at_end, position] = curve.evaluate(first_of_end, order, side="left")
