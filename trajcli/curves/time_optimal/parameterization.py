"""The time-optimal motion along a path: grid, solution, law, trajectory, and what was done to get there.

A path with its limits, and a solution sd^2 on a grid: its law, what it uses of limits, what it loses.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trajcli.curves.extrema import peaks
from trajcli.curves.operations import scale_time
from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.curves.time_optimal.collocation import (
    CollocatedConstraints,
    CollocationRows,
    collocated,
    first_grid,
    halved,
    most_intervals,
    parts_for,
    refined,
)
from trajcli.curves.time_optimal.constraints import PathConstraint, corners, is_at_rest, joint_constraint
from trajcli.curves.time_optimal.maximum_velocity import maximum_velocity_curve
from trajcli.curves.time_optimal.passes import (
    Speeds,
    UnlimitedSpeedError,
    UnreachableSpeedError,
    solve,
    solve_locally,
)
from trajcli.curves.time_optimal.refinement import (
    excess,
    interpolated_ramps,
    law_and_trajectory,
    time_lost,
    wanted_ramps,
)
from trajcli.curves.time_optimal.time_law import distances_at_mean_speed, feasible_ramps, pieces_of
from trajcli.frozen import frozen

_FEW_CHANGED = 0.01  # of the intervals: if no more of them change, most of the solution stays
_WILD = 1.02  # of a limit: where more is used, there shall be no swing
_LARGEST_DEGREE = 3  # of a path: with swings the degree of the trajectory is three times as high


@frozen
class PathProblem:
    """A path and its limits.

    Attributes:
        path: q(s) with n joints.
        bounds: Of velocity and acceleration, each of shape (n, 2).
        demands: Of all that limits the motion.
        stops: Places where the motion must stop, shape (k,).
        ends: sd at the start and at the end; infinite for any.
    """

    path: PiecewisePolynomial
    bounds: tuple[Array, Array]
    demands: Sequence[PathConstraint]
    stops: Array
    ends: tuple[float, float]

    @property
    def rests(self) -> bool:
        """Whether it starts and ends at rest, so that it may be stretched."""
        return all(end in (0.0, np.inf) for end in self.ends)

    @property
    def swings(self) -> bool:
        """Whether sdd may swing within an interval."""
        return self.path.degree <= _LARGEST_DEGREE


@frozen
class GridSolution:
    """A solution on a grid of N intervals.

    Attributes:
        problem: What it solves.
        limited: The demands at its places.
        intervals: The rows that it obeys.
        speeds: sd^2 at its places.
        law: Durations (N,) and coefficients (d + 1, N) of the pieces of s(t).
        over: Bounds of what is used of the limits of velocity and acceleration in each interval, (2, N).
    """

    problem: PathProblem
    limited: CollocatedConstraints
    intervals: CollocationRows
    speeds: Speeds
    law: tuple[Array, Array]
    over: Array

    @property
    def grid(self) -> Array:
        """Its places, shape (N + 1,)."""
        return self.intervals.grid

    @property
    def x(self) -> Array:
        """sd^2 at its places, shape (N + 1,)."""
        return self.speeds.x

    @property
    def lost(self) -> Array:
        """Estimate of the time lost in each interval, where limits are passed also by keeping them, (N,)."""
        lasting, over = self.law[0], np.clip(self.over - 1.0, 0.0, 1.0)
        lost = time_lost(self.intervals, self.x, self.speeds.ceiling, lasting)
        return np.asarray(lost + lasting * np.maximum(over[0], 0.5 * over[1]))

    def tightened(self, factors: Array, *, swing: bool) -> GridSolution:
        """Return the solution with limits divided by factors.

        Args:
            factors: Of velocity and acceleration in each interval, shape (2, N).
            swing: Whether to find the swings anew.

        Raises:
            UnreachableSpeedError: When the speeds at the ends are too high for these limits.
        """
        problem, demands, grid = self.problem, self.limited, self.grid
        if swing and problem.swings:
            calm = self.over.max(axis=0) <= _WILD  # elsewhere sdd swings by more than the limits follow
            wanted = np.where(calm, wanted_ramps(self.intervals, self.x), 0.0)
            rows = demands.intervals(wanted, distances_at_mean_speed(grid, self.x, wanted))
            rows = rows.tightened(*np.where(calm, factors, 1.0))
            with suppress(UnreachableSpeedError):  # then there may be one with the swings as they are
                return _judged(problem, demands, rows, solve(rows, *problem.ends))
        rows, changed = self.intervals.tightened(*factors), (factors != 1.0).any(axis=0)
        ceiling = maximum_velocity_curve(rows, self.speeds.ceiling, changed)
        few = changed.mean() < _FEW_CHANGED
        speeds = solve_locally(rows, self.speeds, changed, ceiling) if few else None
        return _judged(problem, demands, rows, speeds or solve(rows, *problem.ends, ceiling), self)


def _judged(
    problem: PathProblem,
    demands: CollocatedConstraints,
    rows: CollocationRows,
    speeds: Speeds,
    before: GridSolution | None = None,
) -> GridSolution:
    """Return the solution with its law and what that uses of the limits.

    Args:
        problem: What it solves.
        demands: At its places.
        rows: That it obeys.
        speeds: sd^2 at its places.
        before: A solution with the same swings.
    """
    law = pieces_of(rows.grid, speeds.x, feasible_ramps(rows.grid, speeds.x, rows.swing))
    over, differs = np.empty((2, rows.way.size)), np.ones(speeds.x.size, dtype=bool)
    if before is not None:
        over, differs = before.over.copy(), before.x != speeds.x
    chosen = np.flatnonzero(differs[:-1] | differs[1:])
    over[:, chosen] = excess(problem.path, law, problem.bounds, chosen)
    return GridSolution(problem, demands, rows, speeds, law, over)


def solution_on_grid(problem: PathProblem, grid: Array, swing: Array, way: Array) -> GridSolution:
    """Return the solution on a grid.

    Args:
        problem: What to solve.
        grid: Places, shape (N + 1,).
        swing: Swings to begin with, shape (N,).
        way: How far the mean of both speeds leads in each interval, shape (N,).

    Raises:
        UnreachableSpeedError: When there is no motion with the speeds at the ends.
        UnlimitedSpeedError: When nothing limits the motion somewhere.
    """
    demands = collocated(grid, problem.demands, problem.stops)
    rows = demands.intervals(swing, way)
    speeds = solve(rows, *problem.ends)
    if problem.swings:
        wanted = wanted_ramps(rows, speeds.x)
        rows = demands.intervals(wanted, distances_at_mean_speed(grid, speeds.x, wanted))
        try:
            speeds = solve(rows, *problem.ends)
        except UnreachableSpeedError:  # with so much swing there is none
            rows = demands.intervals(swing, way)
    return _judged(problem, demands, rows, speeds)


_LOST = 2.5e-3  # of the duration, by estimate: a finer grid would not gain more
_AIM = 1.2e-3  # of the duration: the estimate that a finer grid is made for
_SWITCHING = (
    1e-8  # of an interval of a straight line: more is lost only where a switching place is to be found
)
_SETTLED = 0.01  # of what is lost elsewhere: then switching places still move by more than they are off
_FEW_NEW = 0.1  # of the intervals: for fewer new ones the whole solution is not worth finding again
_ROUNDS = 8  # of refinement
_TRIES = 4  # of halving the grid before a speed at an end is called too high
_TIGHTENINGS, _MOST_TIGHTENINGS = 8, 40  # where the rest is stretched away, and where it must not be
_LOWERED = (1.1, 1.3, 2.0, 4.0, 16.0, 64.0)  # times the excess that limits are lowered by, turn by turn
_EXACT = 1e-10  # a limit passed by less is kept


class UnsettledSpeedError(ValueError):
    """The limits could not be kept between the places of the grid with the path velocities asked for.

    Attributes:
        s: Place on the path.
        over: By what factor a limit is passed there.
    """

    def __init__(self, s: float, over: float) -> None:
        self.s, self.over = s, over
        super().__init__(
            f"around s = {s:.9g} a limit is passed by a factor of {over:.12g}: lower the speeds at the ends"
        )


@frozen
class TimeOptimalMotion:
    """A time-optimal motion.

    Attributes:
        trajectory: q(t) from t = 0 on.
        law: s(t), quadratic pieces.
        stretch: By what factor the solution was slowed down as a whole to keep the limits everywhere.
        tightened: Number of intervals in which the limits were lowered to be kept between their ends.
        refinements: How often the grid was refined.
        grid: Its places, shape (N + 1,).
        lost: Estimate of the share of the duration that a finer grid would save.
        stops: Places of the corners of the path, where the motion stops, shape (k,).
        stop_times: When it does, s, shape (k,).
    """

    trajectory: PiecewisePolynomial
    law: PiecewisePolynomial
    stretch: float
    tightened: int
    refinements: int
    grid: Array
    lost: float
    stops: Array
    stop_times: Array


def time_optimal(
    path: PiecewisePolynomial,
    velocity: ArrayLike,
    acceleration: ArrayLike,
    *,
    start_velocity: float = 0.0,
    end_velocity: float = 0.0,
    further: Sequence[PathConstraint] = (),
) -> TimeOptimalMotion:
    """Return the fastest motion along a path within bounds of velocity and acceleration that hold for all t.

    How the path is parametrised does not matter. At a corner the motion stops. Where the derivative of the
    path vanishes at an end, any sd there is rest.

    Args:
        path: q(s) with n joints, of degree at most 5, without jumps.
        velocity: Lower and upper bounds, shape (n, 2), lower < 0 < upper, infinite for none; per second.
        acceleration: The same, per second squared; not all infinite.
        start_velocity: sd at the start, not negative.
        end_velocity: sd at the end, not negative.
        further: Other demands on u and x; kept at the places of the grid.

    Raises:
        UnlimitedSpeedError: When nothing limits the motion somewhere.
        UnreachableSpeedError: When the velocities at the ends are too high.
        UnsettledSpeedError: When they leave no room to keep the limits between the places of the grid.
        ValueError: When bounds have another shape or sign, or a velocity is negative.
    """
    if not (0.0 <= start_velocity < np.inf and 0.0 <= end_velocity < np.inf):
        raise ValueError(
            f"path velocities {start_velocity!r} and {end_velocity!r} must be finite, not negative"
        )
    bounds = np.asarray(velocity, dtype=np.float64), np.asarray(acceleration, dtype=np.float64)
    demands = [joint_constraint(path, *bounds), *further]
    ends = tuple(
        np.inf if resting and speed == 0 else speed
        for speed, resting in zip((start_velocity, end_velocity), is_at_rest(path), strict=True)
    )
    if not np.isfinite(bounds[1]).any() or path.duration == 0:
        raise UnlimitedSpeedError(path.start)
    problem = PathProblem(path, bounds, demands, corners(path), (ends[0], ends[1]))
    found, rounds, lost = _refined_solution(problem)
    found, tightened = _tightened_solution(found)
    grid, pieces, over = found.grid, found.law, float(found.over.max())
    del found  # the rows of a long path are large
    law, trajectory, stretch = _stretched(problem, law_and_trajectory(path, *pieces), over)
    stops = problem.stops
    stop_times = law.breaks[np.searchsorted(grid, stops)]
    return TimeOptimalMotion(trajectory, law, stretch, tightened, rounds, grid, lost, stops, stop_times)


def _refined_solution(problem: PathProblem) -> tuple[GridSolution, int, float]:
    """Return the solution on a fine enough grid, how often it was refined, and what is lost."""
    grid, most = first_grid(problem.path), most_intervals(problem.path)
    swing, way = np.zeros(grid.size - 1), np.diff(grid)
    for rounds in range(_ROUNDS + 1):
        try:
            found = solution_on_grid(problem, grid, swing, way)
        except UnreachableSpeedError:  # a finer grid has room for a little more
            if rounds >= _TRIES or 2 * grid.size > most:
                raise
            grid = halved(grid)
            swing, way = np.zeros(grid.size - 1), np.diff(grid)
            continue
        parts, share = _parts(found, most - grid.size + 1)
        if rounds == _ROUNDS or (parts == 1).all():
            break
        finer = refined(grid, found.x, parts)
        swing, way = interpolated_ramps(grid, finer, found.intervals.swing, found.intervals.way)
        grid = finer
    return found, rounds, share


def _parts(found: GridSolution, room: int) -> tuple[NDArray[np.intp], float]:
    """Return into how many parts to cut each interval, and the share of the duration that is lost."""
    lost, lasting, straight = found.lost, found.law[0], found.intervals.straight
    duration, bent = float(lasting.sum()), np.where(straight, 0.0, lost)
    share = float(lost.sum()) / duration
    parts = np.ones(lost.size, dtype=np.intp)
    if share > _LOST and room > _FEW_NEW * lost.size:
        parts = parts_for(bent, _AIM * duration, room)
    switching = straight & (lost > _SWITCHING * lasting)
    settled = lost[switching].sum() <= _SETTLED * bent.sum()
    if not settled and (parts - 1).sum() + switching.sum() <= room:
        parts[switching] = 2
    return parts, share


def _tightened_solution(found: GridSolution) -> tuple[GridSolution, int]:
    """Return the solution with limits lowered in intervals that pass them, and in how many.

    A little more than the excess is taken off the limits in such an interval. The solution around it then
    moves, so that it takes a few turns, in which more and more is taken off the last ones; where the motion
    may be stretched, what is left after these is left to that.
    """
    tightened = np.zeros(found.x.size - 1, dtype=bool)
    for turn in range(_TIGHTENINGS if found.problem.rests else _MOST_TIGHTENINGS):
        passed = found.over > 1.0 + _EXACT
        if not passed.any():
            break
        tightened |= passed.any(axis=0)
        lowered = _LOWERED[min(turn, len(_LOWERED) - 1)]
        factors = 1.0 + lowered * np.where(passed, found.over - 1.0, 0.0)
        found = found.tightened(factors, swing=turn == 0)
    return found, int(tightened.sum())


def _stretched(
    problem: PathProblem, curves: tuple[PiecewisePolynomial, PiecewisePolynomial], over: float
) -> tuple[PiecewisePolynomial, PiecewisePolynomial, float]:
    """Return law and trajectory, as much slower as the exact peaks ask for, and by what factor.

    Args:
        problem: What was solved.
        curves: Law and trajectory.
        over: A bound of what they use of the limits.
    """
    law, trajectory = curves
    if over <= 1.0 + _EXACT:
        return law, trajectory, 1.0
    factors = []
    for peak, bounds, root in zip(peaks(trajectory, (1, 2)), problem.bounds, (1.0, 0.5), strict=True):
        used = np.maximum(peak.high / bounds[:, 1], peak.low / bounds[:, 0])
        times = np.where(peak.high / bounds[:, 1] > peak.low / bounds[:, 0], peak.high_time, peak.low_time)
        factors.append((float(used.max()) ** root, float(used.max()), float(times[used.argmax()])))
    stretch, worst, time = max(factors)
    if stretch <= 1.0 + _EXACT:
        return law, trajectory, 1.0
    if not problem.rests:
        raise UnsettledSpeedError(float(law.evaluate(time)[0]), worst)
    return scale_time(law, stretch), scale_time(trajectory, stretch), stretch
