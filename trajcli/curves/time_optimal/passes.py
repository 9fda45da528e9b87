"""Backward and forward pass over a grid: the controllable sets of sd^2, and the fastest motion within them.

The states (x, y) at both ends of an interval that its rows P x + R y <= C allow form a convex polygon that
holds (0, 0), so from x one can get to rest exactly when x <= beta, for some beta. Rows with P > 0 > R bound x
by something that grows with y; the others matter only through the polygon's largest x, which makes the
maximum velocity curve (mvc). Hence

    beta_i = min(mvc_i, min over rows with P > 0 > R of (C - R beta_{i+1}) / P)

and forward y = min(beta_{i+1}, min over rows with R > 0 of (C - P x) / R): all but these two recurrences
is done for all intervals at once. Where few intervals got lower limits, they are solved again around these
only.

Few intervals are followed one by one, with the lines that may be lowest. Many are cut into chunks that
advance abreast, each from a guess of its first x; where a guess was wrong they advance once more, until they
meet the values of the time before. What a few times leave open is followed one by one: there each chunk waits
for the one before it. Both do the same arithmetic, and agree to the last bit.

Source: Pham and Pham (2018), algorithm 1; the affine form of the recurrences is our own.
"""

from __future__ import annotations

from itertools import islice

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.curves.time_optimal.collocation import IntervalRows
from trajcli.curves.time_optimal.time_law import blocks
from trajcli.errors import PlanningError
from trajcli.frozen import frozen

HUGE = 1e100  # stands for an unlimited z: beyond it only the slopes of lines matter
_BLOCK = 8192  # intervals whose lines are held at a time
_MANY = 1000  # intervals from which on chunks abreast are faster
_SWEEPS = 5  # of chunks abreast: most guesses are right by then, or few are
_STEPS = 100  # of Newton
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
    """Return for each row of lines which is lowest at first, and which others may be lowest somewhere."""
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
