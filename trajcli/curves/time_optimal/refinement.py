"""Refinement of the grid: the time that each interval loses, and where to cut it.

A solution that loses no time has in each interval sd^2 on the maximum velocity curve, or sdd as large or as
small as the limits allow at both ends: what remains unused tells where more grid points pay.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.extrema import critical_points
from trajcli.curves.piecewise import (
    Array,
    PiecewisePolynomial,
    derivative_coefficients,
    distinct,
    horner,
)
from trajcli.curves.time_optimal.collocation import IntervalRows
from trajcli.curves.time_optimal.time_law import blocks

_FEWEST, _FIRST = 4, 96  # intervals: of a piece, and of the whole path, to begin with
_MOST, _MORE = 16, 4000  # intervals: of a piece on average, and of the whole path on top, in the end
_PARTS = 4  # that an interval is cut into at a time: an estimate of its loss is worth no more
_BESIDE = 1e-4  # of the first intervals: a joint that turns so near to a grid point turns there
_STILL = 1e-6  # of the largest derivative: a joint whose own changes by less in a piece stands still
_BENT = 1e-6  # of the slopes of sd^2: a smaller difference does not say where they meet
_EDGE = 1e-7  # of an interval: a point nearer to its ends is not worth a new one
_AT = 1e-6  # of the largest sd^2: as near to it is at it
_ROUND = 0.25  # of the triangle above an interval: what a smooth peak holds
_SHORT = 4096  # times shorter than the first intervals of a piece: there rounding is not far
_SPARING = 1.1  # by which the loss to be reached grows until there is room
_SOFT = 1e-9  # by which rows are relaxed, so that those with next to no say in sdd have none by rounding


def first_grid(path: PiecewisePolynomial) -> Array:
    """Return where the path breaks and joints turn, and equal parts between breaks, shape (N + 1,)."""
    parts = _first_parts(path)
    inner = path.breaks[:-1, None] + path.lengths[:, None] * (np.arange(parts) / parts)
    (turns,) = critical_points(path.coefficients, path.lengths, (0,))
    cells = turns / path.lengths[:, None] * parts
    bends = horner(derivative_coefficients(path.coefficients, 2), turns) * path.lengths[:, None]
    turning = np.abs(bends) > _STILL * np.abs(path.piece_ends(1)).max()  # of others the turns are rounding
    apart = (np.abs(cells - np.rint(cells)) > _BESIDE) & turning
    turns = (path.breaks[:-1, None] + turns)[apart]
    grid = distinct(np.concatenate([inner.reshape(-1), turns, [path.end]]))
    close = np.diff(grid) <= _BESIDE / parts * path.lengths.min()
    return np.asarray(grid[~np.append(False, close)])


def _first_parts(path: PiecewisePolynomial) -> int:
    """Return into how many equal parts each piece of a path is cut to begin with."""
    return max(_FEWEST, -(-_FIRST // path.pieces))


def shortest_intervals(path: PiecewisePolynomial, grid: Array) -> Array:
    """Return how long intervals are at least that are worth being cut for little time, shape (N,)."""
    piece = np.clip(np.searchsorted(path.breaks, grid[:-1], "right") - 1, 0, path.pieces - 1)
    return np.asarray(path.lengths[piece] / (_SHORT * _first_parts(path)))


def most_intervals(path: PiecewisePolynomial) -> int:
    """Return how many intervals a grid may have: proportional to the number of pieces."""
    return _MOST * path.pieces + _MORE


def halved(grid: Array) -> Array:
    """Return the grid with the middle of each interval added."""
    return distinct(np.append(grid, 0.5 * (grid[:-1] + grid[1:])))


def time_lost(intervals: IntervalRows, x: Array, mvc: Array, durations: Array) -> Array:
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
    above = np.where((below[1:] < _AT) & (below[:-1] < _AT), _peaks(intervals.grid, x), 0.0)
    return np.asarray(0.5 * (np.clip(unused, 0.0, 1.0) + _ROUND * np.minimum(above, 1.0)) * durations)


def _peaks(grid: Array, x: Array) -> Array:
    """Return how far its neighbours' lines meet above each interval's own, as a share of sd^2, (N,)."""
    meeting, slopes = _meetings(grid, x), np.diff(x) / np.diff(grid)
    before = np.concatenate([slopes[:1], slopes[:-1]])
    rise = (before - slopes) * np.diff(grid) * meeting
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.nan_to_num(rise / np.minimum(x[1:], x[:-1]), posinf=0.0))


def _unused(intervals: IntervalRows, x: Array) -> tuple[Array, Array]:
    """Return how much larger and smaller sd^2 could be at the far ends, as shares of its range."""
    more, less = np.empty(x.size - 1), np.empty(x.size - 1)
    for block in blocks(x.size - 1):
        P, R, C, y = intervals.P[:, block], intervals.R[:, block], intervals.C[:, block], x[1:][block]
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            bounds = (C * (1.0 + _SOFT) - P * x[:-1][block]) / R
        high = np.where(R > 0, bounds, np.inf).min(axis=0, initial=np.inf)
        low = np.where(R < 0, bounds, -np.inf).max(axis=0, initial=-np.inf)
        span = high - low
        bounded = np.isfinite(span) & (span > 0)
        more[block] = np.where(bounded, (high - y) / np.where(bounded, span, 1.0), 1.0)
        less[block] = np.where(bounded, (y - low) / np.where(bounded, span, 1.0), 1.0)
    return more, less


def parts_for(lost: Array, target: float, points: int) -> NDArray[np.intp]:
    """Return how many parts to cut each interval into, shape (N,), so that with few points little is lost.

    In k parts an interval loses 1 / k^2 of what it does, so that of a given number of points each is worth
    most where k grows with the cubic root of the loss.

    Args:
        lost: Time that each interval loses, shape (N,).
        target: What all of them may lose in the end.
        points: How many points there may be more.
    """
    root = np.cbrt(lost)
    if not root.any():
        return np.ones(lost.size, dtype=np.intp)
    unit = (target / root.sum()) ** 0.5
    while True:
        parts: NDArray[np.intp] = np.clip(np.rint(root / unit), 1, _PARTS).astype(np.intp)
        if (parts - 1).sum() <= points:
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
