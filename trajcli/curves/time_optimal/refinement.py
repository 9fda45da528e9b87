"""Refinement of the grid: the time that each interval loses, where to cut it, and its sdd ramp.

A solution that loses no time has in each interval sd^2 on the maximum velocity curve, or sdd as large or as
small as the limits allow at both ends. So the sdd ramp of an interval is chosen such that what binds at its
near end binds at its far end, too; what remains unused tells where more grid points pay.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array, PiecewisePolynomial, distinct
from trajcli.curves.time_optimal.collocation import CollocationRows
from trajcli.curves.time_optimal.time_law import feasible_ramps

_FEWEST, _FIRST = 8, 96  # intervals: of a piece, and of the whole path, to begin with
_MOST, _MORE = 16, 4000  # intervals: of a piece on average, and of the whole path on top, in the end
_PARTS = 4  # that an interval is cut into at a time: an estimate of its loss is worth no more
_BENT = 1e-6  # of the slopes of sd^2: a smaller difference does not say where they meet
_EDGE = 1e-7  # of an interval: a point nearer to its ends is not worth a new one
_SPARING = 1.1  # by which the loss to be reached grows until there is room
_SOFT = 1e-9  # by which rows are relaxed, so that those with next to no say in sdd have none by rounding
_BINDS = 1e-6  # of sdd: as near to its bound is at it
_SHARE = 0.5  # of what rows have room for at rest, and of what the speed stays positive with


def first_grid(path: PiecewisePolynomial) -> Array:
    """Return the breaks of the path and equally many equal parts between each two, shape (N + 1,)."""
    parts = max(_FEWEST, -(-_FIRST // path.pieces))
    inner = path.breaks[:-1, None] + path.lengths[:, None] * (np.arange(parts) / parts)
    return distinct(np.append(inner, path.end))


def most_intervals(path: PiecewisePolynomial) -> int:
    """Return how many intervals a grid may have: proportional to the number of pieces."""
    return _MOST * path.pieces + _MORE


def halved(grid: Array) -> Array:
    """Return the grid with the middle of each interval added."""
    return distinct(np.append(grid, 0.5 * (grid[:-1] + grid[1:])))


def time_lost(intervals: CollocationRows, x: Array, mvc: Array, durations: Array) -> Array:
    """Return an estimate of the time lost in each interval, shape (N,).

    The acceleration that is not used, as a share of its range, costs half that share of the time; so does the
    speed below the maximum velocity curve, as half a share of sd^2.

    Args:
        intervals: N of them.
        x: sd^2 at the grid points, shape (N + 1,).
        mvc: Largest sd^2 at the grid points, shape (N + 1,).
        durations: Shape (N,).
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        below = np.where(mvc > 0, 1.0 - x / mvc, 0.0)
    more, less = _unused(intervals, x)
    unused = np.minimum.reduce([0.5 * (below[:-1] + below[1:]), more, less])
    return np.asarray(0.5 * np.clip(unused, 0.0, 1.0) * durations)


def _unused(intervals: CollocationRows, x: Array) -> tuple[Array, Array]:
    """Return how much larger and smaller sdd could be, the mean of both ends, as shares of its range."""
    mean = np.diff(x) / (2.0 * intervals.distances)
    more, less = np.zeros_like(mean), np.zeros_like(mean)
    ends = mean - intervals.ramps, mean + intervals.ramps
    for (low, high), u in zip(intervals.sdd_ranges(x, _SOFT), ends, strict=True):
        span = high - low
        known = np.isfinite(span) & (span > 0)
        more += 0.5 * np.where(known, (high - u) / np.where(known, span, 1.0), 1.0)
        less += 0.5 * np.where(known, (u - low) / np.where(known, span, 1.0), 1.0)
    return more, less


def parts_for(lost: Array, target: float, room: int) -> NDArray[np.intp]:
    """Return how many parts to cut each interval into, shape (N,), so that with few points little is lost.

    In k parts an interval loses 1 / k^2 of what it does, so that of a given number of points each is worth
    most where k grows with the cubic root of the loss.

    Args:
        lost: Time that each interval loses, shape (N,).
        target: What all of them may lose in the end.
        room: How many points there may be more.
    """
    root = np.cbrt(lost)
    if not root.any():
        return np.ones(lost.size, dtype=np.intp)
    unit = (target / root.sum()) ** 0.5
    while True:
        parts: NDArray[np.intp] = np.clip(np.rint(root / unit), 1, _PARTS).astype(np.intp)
        if (parts - 1).sum() <= room:
            return parts
        unit *= _SPARING


def refined(grid: Array, x: Array, parts: NDArray[np.intp]) -> Array:
    """Return the grid with each interval cut into so many equal parts.

    Where the straight lines of sd^2 in the intervals before and after meet within the interval, the motion
    changes from speeding up to braking: that point is taken instead of the nearest one.

    Args:
        grid: Shape (N + 1,).
        x: sd^2 there, shape (N + 1,).
        parts: Shape (N,).
    """
    lengths, meeting = np.diff(grid), _meetings(grid, x)
    owner = np.repeat(np.arange(parts.size), parts)
    step = np.arange(owner.size) - (np.cumsum(parts) - parts)[owner]
    inner = np.clip(np.rint(meeting * parts), 1, np.maximum(parts - 1, 1))
    nearest = np.where(parts > 1, inner, np.nan)
    share = np.where(step == nearest[owner], meeting[owner], step / parts[owner])
    return distinct(np.append(grid[owner] + lengths[owner] * share, grid[-1]))


def _meetings(grid: Array, x: Array) -> Array:
    """Return where within each interval its neighbours' lines meet, as a share; NaN where they do not."""
    slopes = np.diff(x) / np.diff(grid)
    before = np.concatenate([slopes[:1], slopes[:-1]])
    after = np.concatenate([slopes[1:], slopes[-1:]])
    with np.errstate(divide="ignore", invalid="ignore"):
        share = (slopes - after) / (before - after)
    bent = before - after > _BENT * np.maximum(np.abs(before), np.abs(after))
    return np.where(bent & (share > _EDGE) & (share < 1.0 - _EDGE), share, np.nan)


def wanted_ramps(intervals: CollocationRows, x: Array) -> Array:
    """Return the sdd ramps (N,) with which the bound that decides in each interval is met at both its ends.

    Where neither the upper nor the lower bound of sdd decides, there is none.

    Args:
        intervals: N of them.
        x: sd^2 at the grid points, the solution for them, shape (N + 1,).
    """
    mean, ramps = np.diff(x) / (2.0 * intervals.distances), intervals.ramps
    (low, high), (far_low, far_high) = intervals.sdd_ranges(x)
    near, far = mean - ramps, mean + ramps
    margin = _BINDS * np.maximum(np.abs(near), np.abs(far))
    with np.errstate(invalid="ignore"):
        rising = np.minimum(high - near, far_high - far) <= margin
        falling = np.minimum(near - low, far - far_low) <= margin
        wanted = np.where(rising, far_high - high, np.where(falling, far_low - low, 0.0)) / 2
    most = _SHARE * intervals.largest_ramps()
    wanted = np.clip(np.where(np.isfinite(wanted), wanted, 0.0), -most, most)
    return feasible_ramps(intervals.grid, x, wanted, _SHARE)


def interpolated_ramps(intervals: CollocationRows, finer: Array) -> tuple[Array, Array]:
    """Return sdd ramps and distances, both (M,), of the intervals of a finer grid (M + 1,)."""
    grid = intervals.grid
    owner = np.searchsorted(grid, finer[:-1], "right") - 1
    lengths, parts = np.diff(grid), np.diff(finer)
    share = parts / lengths[owner]
    surplus = (intervals.distances / lengths - 1.0)[owner] * share**2
    return intervals.ramps[owner] * share, parts * (1.0 + surplus)
