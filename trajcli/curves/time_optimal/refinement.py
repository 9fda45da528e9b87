"""How good a solution on a grid is: the time that is lost, and the limits that are passed between places.

A solution that loses no time has in each interval sd^2 at its ceiling, or sdd as large or as small as the
limits allow at both ends. The limits hold at the places of the grid; between them control points bound what
is used of them, and exceed it by no more than a sixth of what lies above the chord.

How much sdd should swing in each interval, so that what binds at its near end binds at its far end too.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.bernstein import control_points
from trajcli.curves.operations import substituted
from trajcli.curves.piecewise import (
    Array,
    PiecewisePolynomial,
    derivative_coefficients,
    horner,
    increasing,
    taylor_shift,
)
from trajcli.curves.time_optimal.collocation import CollocationRows
from trajcli.curves.time_optimal.time_law import feasible_ramps

_SOFT = 1e-9  # by which rows are eased, so that those with next to no say in sdd have none by rounding
_BLOCK = 1024  # intervals at a time, whose polynomials stay in the processor's cache


def time_lost(intervals: CollocationRows, x: Array, ceiling: Array, lasting: Array) -> Array:
    """Return an estimate of the time lost in each interval, shape (N,).

    The acceleration that is not used, as a share of its range, costs half that share of the time; so does the
    speed below the ceiling, as half a share of sd^2.

    Args:
        intervals: N of them.
        x: sd^2 at the places, shape (N + 1,).
        ceiling: Largest sd^2 at the places, shape (N + 1,).
        lasting: Durations, shape (N,).
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        below = np.where(ceiling > 0, 1.0 - x / ceiling, 0.0)
    more, less = _unused(intervals, x)
    unused = np.minimum.reduce([0.5 * (below[:-1] + below[1:]), more, less])
    return np.asarray(0.5 * np.clip(unused, 0.0, 1.0) * lasting)


def _unused(intervals: CollocationRows, x: Array) -> tuple[Array, Array]:
    """Return how much larger and smaller sdd could be, the mean of both ends, as shares of its range."""
    mean = np.diff(x) / (2.0 * intervals.way)
    more, less = np.zeros_like(mean), np.zeros_like(mean)
    for (low, high), u in zip(
        intervals.ranges(x, _SOFT), (mean - intervals.swing, mean + intervals.swing), strict=True
    ):
        span = high - low
        known = np.isfinite(span) & (span > 0)
        more += 0.5 * np.where(known, (high - u) / np.where(known, span, 1.0), 1.0)
        less += 0.5 * np.where(known, (u - low) / np.where(known, span, 1.0), 1.0)
    return more, less


def excess(
    path: PiecewisePolynomial, law: tuple[Array, Array], bounds: tuple[Array, Array], chosen: NDArray[np.intp]
) -> Array:
    """Return bounds of the largest velocity and acceleration as multiples of their limits, shape (2, k).

    Args:
        path: q(s) with n joints; the intervals hold its breaks.
        law: Durations (N,) and coefficients (d + 1, N) of the pieces of s(t), one for each interval.
        bounds: Limits of velocity and acceleration, each of shape (n, 2).
        chosen: Indices of the k intervals to look at.
    """
    found = np.empty((2, chosen.size))
    for first in range(0, chosen.size, _BLOCK):
        block = slice(first, first + _BLOCK)
        lasting, pieces = law[0][chosen[block]], law[1][:, chosen[block]]
        found[:, block] = _excess(_composed(path, pieces), lasting, *bounds)
    return found


def _excess(q: Array, lasting: Array, velocity: Array, acceleration: Array) -> Array:
    """Return the excess (2, w) of polynomials q(t) (d + 1, n, w) that last (w,)."""
    over = _share(control_points(derivative_coefficients(q, 2), lasting), acceleration)
    qd = derivative_coefficients(q, 1)
    ends = np.stack([qd[-1], horner(qd, lasting)])
    speed = _share(ends, velocity)
    slowest = np.abs(velocity).min(axis=1)
    with np.errstate(invalid="ignore"):
        steepest = np.where(np.isfinite(slowest), np.abs(acceleration).max(axis=1) / slowest, 0.0).max()
        most = speed + 0.5 * over * steepest * lasting
    fast = np.flatnonzero(~(most <= 1.0))
    speed[fast] = _share(control_points(qd[:, :, fast], lasting[fast]), velocity)
    return np.stack([speed, over])


def _share(values: Array, bounds: Array) -> Array:
    """Return how much of the bounds (n, 2) values (k, n, w) use at most, shape (w,)."""
    high, low = values.max(axis=0) / bounds[:, 1, None], values.min(axis=0) / bounds[:, 0, None]
    return np.asarray(np.maximum(high, low).max(axis=0))


def law_and_trajectory(
    path: PiecewisePolynomial, lasting: Array, pieces: Array
) -> tuple[PiecewisePolynomial, PiecewisePolynomial]:
    """Return the law s(t) and the trajectory q(s(t)), from t = 0 on.

    Args:
        path: q(s) with n joints, of degree d1.
        lasting: Durations of the pieces of the law, shape (N,).
        pieces: Their coefficients, each within one piece of the path, shape (d2 + 1, N).
    """
    degree, count = path.degree * (pieces.shape[0] - 1), lasting.size
    found = np.empty((degree + 1, count, path.dimension))
    for first in range(0, count, _BLOCK):
        block = slice(first, first + _BLOCK)
        found[:, block] = _composed(path, pieces[:, block]).transpose(0, 2, 1)
    times = increasing(np.concatenate([[0.0], np.cumsum(lasting)]))
    return PiecewisePolynomial(times, pieces[:, :, None]), PiecewisePolynomial(times, found)


def _composed(path: PiecewisePolynomial, pieces: Array) -> Array:
    """Return the coefficients (d1 d2 + 1, n, w) of q(s(t)) for pieces (d2 + 1, w) of s(t)."""
    begins = pieces[-1]
    piece = np.clip(np.searchsorted(path.breaks, begins, "right") - 1, 0, path.pieces - 1)
    local = np.ascontiguousarray(path.coefficients[:, piece].transpose(0, 2, 1))
    return substituted(taylor_shift(local, begins - path.breaks[piece]), pieces[:-1])


_BINDS = 1e-6  # of sdd: as near to its bound is at it
_SHARE = 0.5  # of what rows have room for at rest, and of what the speed stays positive with


def wanted_ramps(intervals: CollocationRows, x: Array) -> Array:
    """Return the swings (N,) with which the bound that decides in each interval is met at both of its ends.

    Where neither the upper nor the lower bound of sdd decides, there is none.

    Args:
        intervals: N of them.
        x: sd^2 at the places, the solution for them, shape (N + 1,).
    """
    mean, swing = np.diff(x) / (2.0 * intervals.way), intervals.swing
    (low, high), (far_low, far_high) = intervals.ranges(x)
    near, far = mean - swing, mean + swing
    nothing = _BINDS * np.maximum(np.abs(near), np.abs(far))
    with np.errstate(invalid="ignore"):
        rising = np.minimum(high - near, far_high - far) <= nothing
        falling = np.minimum(near - low, far - far_low) <= nothing
        wanted = np.where(rising, far_high - high, np.where(falling, far_low - low, 0.0)) / 2
    most = _SHARE * intervals.largest_swing()
    wanted = np.clip(np.where(np.isfinite(wanted), wanted, 0.0), -most, most)
    return feasible_ramps(intervals.grid, x, wanted, _SHARE)


def interpolated_ramps(grid: Array, finer: Array, swing: Array, way: Array) -> tuple[Array, Array]:
    """Return swings and ways, both (M,), of the intervals of a finer grid, from those (N,) of a grid."""
    owner = np.searchsorted(grid, finer[:-1], "right") - 1
    lengths, parts = np.diff(grid), np.diff(finer)
    share = parts / lengths[owner]
    return swing[owner] * share, parts * (1.0 + (way / lengths - 1.0)[owner] * share**2)
