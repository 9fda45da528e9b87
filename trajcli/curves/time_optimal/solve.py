"""The largest sd^2 at every place of a grid: one scan backward for what is controllable, one forward.

The states (x, y) at both ends of an interval that its rows P x + R y <= C allow form a convex polygon that
holds (0, 0), so from x one can get to rest exactly when x <= beta, for some beta. Rows with P > 0 > R bound x
by something that grows with y; the others matter only through the polygon's largest x, the ceiling. Hence

    beta_i = min(ceiling_i, min over rows with P > 0 > R of (C - R beta_{i+1}) / P)

and forward y = min(beta_{i+1}, min over rows with R > 0 of (C - P x) / R): all but the two scans is done for
all intervals at once.

Source: Pham and Pham (2018), algorithm 1; the affine form of the scans is our own.
"""

from __future__ import annotations

from itertools import islice

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.curves.time_optimal.constraints import Intervals
from trajcli.frozen import frozen

_HUGE = 1e100  # stands for an unlimited x: beyond it only the slopes of rows matter
_STEPS = 100
_SAME = 1e-12


class UnreachableSpeedError(ValueError):
    """A path velocity at an end is more than the limits allow.

    Attributes:
        s: Place on the path.
        speed: The path velocity asked for.
        allowed: The largest one that there is a motion for.
    """

    def __init__(self, end: str, s: float, speed: float, allowed: float) -> None:
        self.s, self.speed, self.allowed = s, speed, allowed
        super().__init__(
            f"path velocity {speed:.9g} at the {end}, s = {s:.9g}, is too high: at most {allowed:.9g} is "
            "possible"
        )


class UnlimitedSpeedError(ValueError):
    """Nothing limits the motion somewhere, so that no motion is the fastest.

    Attributes:
        s: Place on the path.
    """

    def __init__(self, s: float) -> None:
        self.s = s
        super().__init__(
            f"no limit holds the motion back around s = {s:.9g}: no joint with a limit moves there"
        )


@frozen
class Controllable:
    """The sets [lower, upper] of x from which the end can be reached, each of shape (N + 1,).

    Attributes:
        lower: Zero unless the end is passed at a speed.
        upper: At most the ceiling.
        ceiling: Largest x at each place that its two intervals have room for, the maximum velocity curve.
    """

    lower: Array
    upper: Array
    ceiling: Array


def controllable(intervals: Intervals, end_velocity: float = 0.0) -> Controllable:
    """Return the controllable sets.

    Args:
        intervals: N of them.
        end_velocity: sd at the end, not negative; infinite for any.
    """
    P, R, C, cap = intervals.P, intervals.R, intervals.C, intervals.cap
    last = _ceiling(R[-1:], P[-1:], C[-1:], cap[-1:])
    ceiling = np.append(_ceiling(P, R, C, cap[:-1]), last)
    limits = ceiling.copy()
    limits[-1] = min(limits[-1], end_velocity**2)
    slopes, offsets = _affine(-R, P, C, (P > 0) & (R < 0))
    upper = _scan(slopes[::-1], offsets[::-1], limits[::-1])[::-1]
    lower = np.zeros_like(upper)
    if np.isfinite(end_velocity):
        lower[-1] = end_velocity**2
    return Controllable(_lower(intervals, lower, upper) if lower[-1] > 0 else lower, upper, ceiling)


def solve(intervals: Intervals, start_velocity: float, end_velocity: float) -> tuple[Array, Array]:
    """Return x = sd^2 at each place, as large as possible, and the ceiling of x, both of shape (N + 1,).

    Args:
        intervals: N of them.
        start_velocity: sd at the start, not negative; infinite for the largest possible.
        end_velocity: sd at the end likewise.

    Raises:
        UnreachableSpeedError: When there is no motion with these velocities.
        UnlimitedSpeedError: When some x is not bounded.
    """
    sets = controllable(intervals, end_velocity)
    first = min(start_velocity**2, float(sets.upper[0]))
    grid = intervals.grid
    if np.isfinite(start_velocity) and first < start_velocity**2 * (1.0 - _SAME):
        raise UnreachableSpeedError("start", float(grid[0]), start_velocity, float(np.sqrt(first)))
    x = _forward(intervals, first, sets.upper)
    if not np.isfinite(x).all():
        raise UnlimitedSpeedError(float(grid[int(np.argmin(np.isfinite(x)))]))
    if first < sets.lower[0] * (1.0 - _SAME):
        free = controllable(intervals, np.inf)
        allowed = float(np.sqrt(_forward(intervals, first, free.upper)[-1]))
        raise UnreachableSpeedError("end", float(grid[-1]), end_velocity, allowed)
    return x, sets.ceiling


def _forward(intervals: Intervals, first: float, upper: Array) -> Array:
    P, R, C = intervals.P, intervals.R, intervals.C
    slopes, offsets = _affine(-P, R, C, R > 0)
    limits = upper.copy()
    limits[0] = first
    return _scan(slopes, offsets, limits)


def _affine(numerator: Array, divisor: Array, C: Array, chosen: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Return slopes and offsets of the chosen rows; of the others a bound that never binds."""
    safe = np.where(chosen, divisor, 1.0)
    return np.where(chosen, numerator / safe, 0.0), np.where(chosen, C / safe, np.inf)


def _scan(slopes: Array, offsets: Array, limits: Array) -> Array:
    """Return z: limits_0, then z_{i+1} = min(limits_{i+1}, the least of slopes_i z_i + offsets_i)."""
    chosen = _lowest_lines(offsets, slopes * np.minimum(limits[:-1, None], _HUGE) + offsets)
    lines = zip(slopes[chosen].tolist(), offsets[chosen].tolist(), strict=True)
    z = float(limits[0])
    found = [z]
    for lowest, count in zip(limits[1:].tolist(), chosen.sum(axis=1).tolist(), strict=True):
        z, before = lowest, z
        for slope, offset in islice(lines, count):
            value = slope * before + offset
            if value < z:
                z = value
        z = max(0.0, z)  # zero is always allowed: what is below is rounding
        found.append(z)
    return np.array(found)


def _lowest_lines(first: Array, last: Array) -> NDArray[np.bool_]:
    """Return which lines of each row may be lowest somewhere, from their values (N, m) at both ends.

    The lines that are lowest at an end stay, and those that are below either of these at its other end.
    """
    rows = np.arange(len(first))
    at_first, at_last = first.argmin(axis=1), last.argmin(axis=1)
    chosen: NDArray[np.bool_] = (first < first[rows, at_last][:, None]) & (
        last < last[rows, at_first][:, None]
    )
    chosen[rows, at_first] = chosen[rows, at_last] = True
    return chosen


def _lower(intervals: Intervals, lower: Array, upper: Array) -> Array:
    """Return the lower ends of the controllable sets; infinite before the place where there is none left."""
    P, R, C = intervals.P, intervals.R, intervals.C
    fastest = np.minimum(_ceiling(R, P, C, intervals.cap[1:]), upper[1:])
    slopes, offsets = _affine(R, -P, -C, (P < 0) & (R > 0))
    offsets[np.isinf(offsets)] = -np.inf
    y = float(lower[-1])
    for i in range(lower.size - 2, -1, -1):
        if y > fastest[i] * (1.0 + _SAME):
            lower[: i + 1] = np.inf
            break
        y = max(0.0, float((slopes[i] * y + offsets[i]).max()))
        lower[i] = y
        if y == 0.0:
            break
    return lower


def _ceiling(P: Array, R: Array, C: Array, cap: Array) -> Array:
    """Return the largest x <= cap of each interval for which some y >= 0 obeys all rows.

    The room for y, the smallest upper bound less the largest lower one, is concave in x and positive at zero,
    so Newton's steps from the right end at the crossing of the two rows that decide, after a few of them.
    """
    nothing = np.zeros((len(P), 1))
    P = np.concatenate([P, nothing], axis=1)
    R = np.concatenate([R, nothing - 1.0], axis=1)
    C = np.concatenate([C, nothing], axis=1)
    alone = (R == 0) & (P > 0)
    x = np.minimum(np.minimum(cap, _HUGE), np.where(alone, C / np.where(alone, P, 1.0), np.inf).min(axis=1))
    live = np.arange(x.size)
    for _ in range(_STEPS):
        lower = _newton(P, R, C, x[live])
        going = lower < x[live]
        live = live[going]
        if not live.size:
            break
        x[live] = lower[going]
        P, R, C = P[going], R[going], C[going]
    return np.where(x < _HUGE, x, np.inf)


def _newton(P: Array, R: Array, C: Array, x: Array) -> Array:
    """Return where the two rows that decide at `x` cross, or `x` where it obeys all rows."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        bounds = (C - P * x[:, None]) / R
    high = np.where(R > 0, bounds, np.inf)
    low = np.where(R < 0, bounds, -np.inf)
    rows, k, j = np.arange(x.size), high.argmin(axis=1), low.argmax(axis=1)
    top, bottom = high[rows, k], low[rows, j]
    over = bottom > top + _SAME * (np.abs(top) + np.abs(bottom))
    rise, fall = R[rows, k], -R[rows, j]
    slope = P[rows, k] * fall + P[rows, j] * rise
    usable = over & (slope > 0)
    crossing = (C[rows, k] * fall + C[rows, j] * rise) / np.where(usable, slope, 1.0)
    return np.where(usable, crossing, x)
