"""Maximum velocity curve: the largest sd^2 at each grid point that its intervals have room for."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.curves.time_optimal.collocation import IntervalRows
from trajcli.curves.time_optimal.recurrence import HUGE
from trajcli.curves.time_optimal.time_law import blocks

_STEPS = 100  # of Newton
_SAME = 1e-12


def maximum_velocity_curve(
    intervals: IntervalRows, previous: Array | None = None, changed: NDArray[np.bool_] | None = None
) -> Array:
    """Return the largest x at each grid point that its two intervals have room for, shape (N + 1,).

    Args:
        intervals: N of them.
        previous: What it was of intervals that differ only where `changed`.
        changed: Shape (N,).
    """
    P, R, C, cap = intervals.P, intervals.R, intervals.C, intervals.cap
    last = _largest(R[:, -1:], P[:, -1:], C[:, -1:], cap[-1:])
    if previous is None or changed is None:
        return np.append(largest_in_intervals(P, R, C, cap[:-1]), last)
    curve = np.append(np.minimum(previous[:-1], cap[:-1]), last)
    rows = np.flatnonzero(changed)
    curve[rows] = largest_in_intervals(P[:, rows], R[:, rows], C[:, rows], cap[rows])
    return curve


def largest_in_intervals(P: Array, R: Array, C: Array, cap: Array) -> Array:
    """Return the largest x <= cap of each interval for which some y >= 0 obeys all rows, shape (N,).

    Args:
        P: Shape (m, N).
        R: Shape (m, N).
        C: Shape (m, N).
        cap: Shape (N,).
    """
    largest = np.empty(cap.size)
    for block in blocks(cap.size):
        largest[block] = _largest(P[:, block], R[:, block], C[:, block], cap[block])
    return largest


def _largest(P: Array, R: Array, C: Array, cap: Array) -> Array:
    """Return the same for so few intervals that their rows stay in the processor's cache.

    The room for y, the smallest upper bound less the largest lower one, is concave in x and positive at zero,
    so Newton's steps from the right end at the crossing of the two rows that decide, after a few of them.
    """
    alone = (R == 0) & (P > 0)
    x = np.minimum(cap, HUGE)
    if alone.any():
        x = np.minimum(x, np.where(alone, C / np.where(alone, P, 1.0), np.inf).min(axis=0))
    live = np.arange(x.size)
    for _ in range(_STEPS):
        lower = _newton(P, R, C, x[live])
        going = lower < x[live]
        live = live[going]
        if not live.size:
            break
        x[live] = lower[going]
        P, R, C = P[:, going], R[:, going], C[:, going]
    return np.where(x < HUGE, x, np.inf)


def _newton(P: Array, R: Array, C: Array, x: Array) -> Array:
    """Return where the two rows that decide at `x` cross, or `x` where it obeys all rows."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        bounds = (C - P * x) / R
    high, low = np.where(R > 0, bounds, np.inf), np.where(R < 0, bounds, -np.inf)
    columns, k, j = np.arange(x.size), high.argmin(axis=0), low.argmax(axis=0)
    top, bottom = high[k, columns], low[j, columns]
    decided = bottom <= 0.0  # then y >= 0 decides, the row -y <= 0
    bottom = np.where(decided, 0.0, bottom)
    over = bottom > top + _SAME * (np.abs(top) + np.abs(bottom))
    rise, fall = R[k, columns], np.where(decided, 1.0, -R[j, columns])
    slope = P[k, columns] * fall + np.where(decided, 0.0, P[j, columns]) * rise
    crossing = C[k, columns] * fall + np.where(decided, 0.0, C[j, columns]) * rise
    usable = over & (slope > 0)
    return np.where(usable, crossing / np.where(usable, slope, 1.0), x)
