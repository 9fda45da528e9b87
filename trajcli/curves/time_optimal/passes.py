"""Backward and forward pass over a grid: the controllable sets of sd^2, and the fastest motion within them.

The states (x, y) at both ends of an interval that its rows P x + R y <= C allow form a convex polygon that
holds (0, 0), so from x one can get to rest exactly when x <= beta, for some beta. Rows with P > 0 > R bound x
by something that grows with y; the others matter only through the polygon's largest x, which makes the
maximum velocity curve (mvc). Hence

    beta_i = min(mvc_i, min over rows with P > 0 > R of (C - R beta_{i+1}) / P)

and forward y = min(beta_{i+1}, min over rows with R > 0 of (C - P x) / R): all but these two recurrences
is done for all intervals at once. Where few intervals got lower limits, they are solved again around these
only.

Source: Pham and Pham (2018), algorithm 1; the affine form of the recurrences is our own.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.curves.time_optimal.collocation import IntervalRows
from trajcli.curves.time_optimal.maximum_velocity import largest_in_intervals, maximum_velocity_curve
from trajcli.curves.time_optimal.recurrence import solve_recurrence
from trajcli.errors import PlanningError
from trajcli.frozen import frozen

_SAME = 1e-12
_RADII = (32, 128)  # intervals to either side of changed ones that are solved again with them
_MOST = 0.5  # of all intervals: more are not worth being solved apart


class UnreachableSpeedError(ValueError):
    """A path velocity at an end is more than the limits allow.

    Attributes:
        s: Path parameter.
        speed: The path velocity asked for.
        allowed: The largest one that there is a motion for.
    """

    def __init__(self, end: str, s: float, speed: float, allowed: float) -> None:
        self.s, self.speed, self.allowed = s, speed, allowed
        super().__init__(
            f"path velocity {speed:.9g} at the {end}, s = {s:.9g}, is too high: at most {allowed:.9g} is "
            "possible"
        )


class StandstillError(PlanningError):
    """Within the limits nothing moves on from a place, as where gravity takes all of an effort."""

    def __init__(self, s: float) -> None:
        super().__init__(f"the limits let nothing move on from s = {s:.9g}", hint="raise limits of effort")


class UnlimitedSpeedError(ValueError):
    """Nothing limits the motion somewhere, so that no motion is the fastest.

    Attributes:
        s: Path parameter.
    """

    def __init__(self, s: float) -> None:
        self.s = s
        super().__init__(
            f"no limit holds the motion back around s = {s:.9g}: no joint with a limit moves there"
        )


@frozen
class Speeds:
    """The fastest motion over a grid of N intervals, each of shape (N + 1,).

    Attributes:
        x: sd^2 at each grid point.
        upper: The largest x from which the end can be reached.
        mvc: The largest x that its two intervals have room for.
    """

    x: Array
    upper: Array
    mvc: Array


def solve(
    intervals: IntervalRows, start_velocity: float, end_velocity: float, mvc: Array | None = None
) -> Speeds:
    """Return the fastest motion.

    Args:
        intervals: N of them.
        start_velocity: sd at the start, not negative; infinite for the largest possible.
        end_velocity: sd at the end likewise.
        mvc: As from `maximum_velocity_curve`, where it is known.

    Raises:
        UnreachableSpeedError: When there is no motion with these velocities.
        UnlimitedSpeedError: When some x is not bounded.
    """
    sets = controllable(intervals, end_velocity, mvc)
    first = min(start_velocity**2, float(sets.upper[0]))
    grid = intervals.grid
    if np.isfinite(start_velocity) and first < start_velocity**2 * (1.0 - _SAME):
        raise UnreachableSpeedError("start", float(grid[0]), start_velocity, float(np.sqrt(first)))
    x = _forward(intervals, first, sets.upper)
    if not np.isfinite(x).all():
        raise UnlimitedSpeedError(float(grid[int(np.argmin(np.isfinite(x)))]))
    if first < sets.lower[0] * (1.0 - _SAME):
        free = controllable(intervals, np.inf, sets.mvc)
        allowed = float(np.sqrt(_forward(intervals, first, free.upper)[-1]))
        raise UnreachableSpeedError("end", float(grid[-1]), end_velocity, allowed)
    return Speeds(x, sets.upper, sets.mvc)


def solve_locally(
    intervals: IntervalRows, before: Speeds, changed: NDArray[np.bool_], mvc: Array
) -> Speeds | None:
    """Return the fastest motion where few rows changed, or None where it changes far away, too.

    Args:
        intervals: N of them.
        before: The motion without the changes.
        changed: Which intervals have lower limits than before, shape (N,).
        mvc: As from `maximum_velocity_curve`.
    """
    speeds = Speeds(before.x.copy(), before.upper.copy(), mvc)
    for radius in _RADII:
        around = _Neighbourhoods(intervals, changed, radius)
        if around.points.size > _MOST * changed.size:
            break
        around.solve(before, speeds)
        if around.unchanged_at_border(before, speeds):
            return speeds
    return None


@frozen
class Controllable:
    """The sets [lower, upper] of x from which the end can be reached, each of shape (N + 1,).

    Attributes:
        lower: Zero unless the end is passed at a speed.
        upper: At most the maximum velocity curve.
        mvc: Maximum velocity curve: the largest x at each grid point that its two intervals have room for.
    """

    lower: Array
    upper: Array
    mvc: Array


def controllable(
    intervals: IntervalRows, end_velocity: float = 0.0, mvc: Array | None = None
) -> Controllable:
    """Return the controllable sets.

    Args:
        intervals: N of them.
        end_velocity: sd at the end, not negative; infinite for any.
        mvc: As from `maximum_velocity_curve`, where it is known.
    """
    P, R, C = intervals.P[:, ::-1], intervals.R[:, ::-1], intervals.C[:, ::-1]
    mvc = maximum_velocity_curve(intervals) if mvc is None else mvc
    limits = mvc[::-1].copy()
    limits[0] = min(limits[0], end_velocity**2)
    upper = solve_recurrence(R, P, C, (P > 0) & (R < 0), limits)[::-1]
    lower = np.zeros_like(upper)
    if np.isfinite(end_velocity):
        lower[-1] = end_velocity**2
    return Controllable(_lower(intervals, lower, upper) if lower[-1] > 0 else lower, upper, mvc)


def _forward(intervals: IntervalRows, first: float, upper: Array) -> Array:
    limits = upper.copy()
    limits[0] = first
    return solve_recurrence(intervals.P, intervals.R, intervals.C, intervals.R > 0, limits)


def _lower(intervals: IntervalRows, lower: Array, upper: Array) -> Array:
    """Return the lower ends of the controllable sets; infinite before the grid point where none is left."""
    P, R, C = intervals.P.T, intervals.R.T, intervals.C.T
    fastest = np.minimum(
        largest_in_intervals(intervals.R, intervals.P, intervals.C, intervals.cap[1:]), upper[1:]
    )
    y = float(lower[-1])
    for i in range(lower.size - 2, -1, -1):
        if y > fastest[i] * (1.0 + _SAME):
            lower[: i + 1] = np.inf
            break
        chosen = (P[i] < 0) & (R[i] > 0)
        y = float(((C[i, chosen] - R[i, chosen] * y) / P[i, chosen]).max(initial=0.0))
        lower[i] = y
        if y == 0.0:
            break
    return lower


class _Neighbourhoods:
    """The surroundings of changed intervals, one after the other, with a gap between them."""

    def __init__(self, intervals: IntervalRows, changed: NDArray[np.bool_], radius: int) -> None:
        rows = np.flatnonzero(changed)
        steps = np.zeros(changed.size + 1, dtype=np.intp)
        np.add.at(steps, np.maximum(rows - radius, 0), 1)
        np.add.at(steps, np.minimum(rows + radius + 1, changed.size), -1)
        inside = np.cumsum(steps) > 0  # the last one, after the last interval, is not
        self.points = np.flatnonzero(inside | np.append(False, inside[:-1]))
        self.within = inside[self.points[:-1]]
        self.begins = np.append(True, ~self.within)
        self.ends = np.append(~self.within, True)
        chosen = self.points[:-1]
        self.P, self.R, self.C = (rows[:, chosen] for rows in (intervals.P, intervals.R, intervals.C))

    def solve(self, before: Speeds, speeds: Speeds) -> None:
        """Write into `speeds` what `before` becomes here, if it stays the same at the border."""
        P, R, C, points, within = self.P, self.R, self.C, self.points, self.within
        limits = np.where(self.ends, np.minimum(before.upper[points], speeds.mvc[points]), speeds.mvc[points])
        chosen = (P > 0) & (R < 0) & within
        upper = solve_recurrence(R[:, ::-1], P[:, ::-1], C[:, ::-1], chosen[:, ::-1], limits[::-1])[::-1]
        speeds.upper[points] = upper
        limits = np.where(self.begins, np.minimum(before.x[points], upper), upper)
        speeds.x[points] = solve_recurrence(P, R, C, (R > 0) & within, limits)

    def unchanged_at_border(self, before: Speeds, speeds: Speeds) -> bool:
        begins, ends = self.points[self.begins], self.points[self.ends]
        same = np.array_equal(speeds.x[ends], before.x[ends])
        same = same and np.array_equal(speeds.x[begins], before.x[begins])
        begins = begins[begins > 0]
        return same and np.array_equal(speeds.upper[begins], before.upper[begins])
