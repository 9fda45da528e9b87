"""How good a solution on a grid is: the time that is lost, and the limits that are passed between places.

A solution that loses no time has in each interval sd^2 at its ceiling, or sdd as large or as small as the
limits allow at both ends. The limits hold at the places of the grid; the extremes between them are exact.
"""

from __future__ import annotations

import numpy as np

from trajcli.curves.critical import critical_points
from trajcli.curves.extrema import piece_extremes
from trajcli.curves.piecewise import Array, PiecewisePolynomial, derivative_coefficients, horner, taylor_shift
from trajcli.curves.time_optimal.constraints import Intervals
from trajcli.curves.time_optimal.law import durations

_SOFT = 1e-9  # by which rows are eased, so that those with next to no say in sdd have none by rounding


def time_lost(intervals: Intervals, x: Array, ceiling: Array) -> Array:
    """Return an estimate of the time lost in each interval, shape (N,).

    The acceleration that is not used, as a share of its range, costs half that share of the time; so does the
    speed below the ceiling, as half a share of sd^2.

    Args:
        intervals: N of them.
        x: sd^2 at the places, shape (N + 1,).
        ceiling: Largest sd^2 at the places, shape (N + 1,).
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        below = np.where(ceiling > 0, 1.0 - x / ceiling, 0.0)
    more, less = _unused(intervals, x)
    unused = np.minimum.reduce([0.5 * (below[:-1] + below[1:]), more, less])
    return np.asarray(0.5 * np.clip(unused, 0.0, 1.0) * durations(intervals.grid, x))


def _unused(intervals: Intervals, x: Array) -> tuple[Array, Array]:
    """Return how much larger and smaller sdd could be, the mean of both ends, as shares of its range."""
    double, half = 2.0 * np.diff(intervals.grid), intervals.rows // 2
    u = np.diff(x) / double
    near, far = slice(None, half), slice(half, None)
    ends = (
        (intervals.R[:, near], (intervals.P + intervals.R)[:, near] / double[:, None], x[:-1], near),
        (-intervals.P[:, far], (intervals.P + intervals.R)[:, far] / double[:, None], x[1:], far),
    )
    more, less = np.zeros_like(u), np.zeros_like(u)
    for a, b, place, rows in ends:
        c = intervals.C[:, rows] / double[:, None] * (1.0 + _SOFT)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            bounds = (c - b * place[:, None]) / a
        high = np.where(a > 0, bounds, np.inf).min(axis=1)
        low = np.where(a < 0, bounds, -np.inf).max(axis=1)
        span = high - low
        known = np.isfinite(span) & (span > 0)
        more += 0.5 * np.where(known, (high - u) / np.where(known, span, 1.0), 1.0)
        less += 0.5 * np.where(known, (u - low) / np.where(known, span, 1.0), 1.0)
    return more, less


def excess(path: PiecewisePolynomial, grid: Array, x: Array, velocity: Array, acceleration: Array) -> Array:
    """Return the largest velocity and acceleration as multiples of their bounds, shape (2, N).

    Between two places sdd = u is constant and sd^2 linear, so with q = sum c_m sigma^m the acceleration is
    the derivative of V = sum (u (2m - 1) c_m + x (m + 1) c_{m+1}) sigma^m. Velocity is extreme where V' = 0.

    Args:
        path: q(s) with n joints; the grid holds its breaks.
        grid: Places, shape (N + 1,).
        x: sd^2 there.
        velocity: Bounds, shape (n, 2).
        acceleration: Bounds, shape (n, 2).
    """
    lengths = np.diff(grid)
    u = np.diff(x) / (2.0 * lengths)
    piece = np.clip(np.searchsorted(path.breaks, grid[:-1], "right") - 1, 0, path.pieces - 1)
    local = taylor_shift(path.coefficients[:, piece], (grid[:-1] - path.breaks[piece])[:, None])
    V = _velocity_like(local, u[:, None], x[:-1, None])
    low, high = piece_extremes(V, lengths, (1,))[0]
    over_acceleration = np.maximum(high / acceleration[:, 1], low / acceleration[:, 0]).max(axis=1)
    inside = critical_points(V, lengths, (0,))[0]
    ends = np.zeros((1, *inside.shape[1:]))
    sigma = np.concatenate([ends, inside, ends + lengths[:, None]])
    speed = np.sqrt(np.maximum(x[:-1, None] + 2.0 * u[:, None] * sigma, 0.0))
    qd = horner(derivative_coefficients(local, 1), sigma) * speed
    over_velocity = np.maximum(qd / velocity[:, 1], qd / velocity[:, 0]).max(axis=(0, 2))
    return np.stack([over_velocity, over_acceleration])


def _velocity_like(local: Array, u: Array, x: Array) -> Array:
    """Return V, whose derivative is q'(sigma) u + q''(sigma) (x + 2 u sigma); highest power first."""
    degree = local.shape[0] - 1
    powers = np.arange(degree, 0, -1.0)[:, None, None]
    V = np.zeros_like(local)
    V[:-1] = u * (2.0 * powers - 1.0) * local[:-1]
    V[1:-1] += x * powers[:-1] * local[:-2]
    return V
