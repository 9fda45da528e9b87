"""Time-optimal motion along a path: the fastest law s(t) within limits, solved on a grid that is refined.

The problem is solved on a grid by the two passes. Where the estimate says that time is lost, the grid is cut
finer. Where a constraint says that the law exceeds it between grid points, its limits are lowered there, and
the problem is solved again. What is left after that is taken away by slowing down the motion as a whole.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trajcli.curves.extrema import peaks
from trajcli.curves.operations import scale_time
from trajcli.curves.piecewise import Array, PiecewisePolynomial, distinct
from trajcli.curves.time_optimal.collocation import CollocatedConstraints, CollocationRows, collocated
from trajcli.curves.time_optimal.constraints import JointConstraint, PathConstraint, corners, is_at_rest
from trajcli.curves.time_optimal.maximum_velocity import maximum_velocity_curve
from trajcli.curves.time_optimal.passes import (
    Speeds,
    UnlimitedSpeedError,
    UnreachableSpeedError,
    solve,
    solve_locally,
)
from trajcli.curves.time_optimal.refinement import (
    first_grid,
    halved,
    interpolated_ramps,
    most_intervals,
    parts_for,
    refined,
    time_lost,
    wanted_ramps,
)
from trajcli.curves.time_optimal.time_law import (
    LawPieces,
    distances_at_mean_speed,
    feasible_ramps,
    law_and_trajectory,
    law_pieces,
)
from trajcli.frozen import frozen

_FEW_CHANGED = 0.01  # of the intervals: if no more of them change, most of the solution stays
_WILD = 1.02  # of a limit: where more is used, there shall be no sdd ramp
_LARGEST_DEGREE = 3  # of a path: with sdd ramps the degree of the trajectory is three times as high
_LOST = 2.5e-3  # of the duration, by estimate: a finer grid would not gain more
_AIM = 1.2e-3  # of the duration: the estimate that a finer grid is made for
_SWITCHING = 1e-8  # of an interval of a straight line: more is lost only where a switching point is missing
_SETTLED = 0.01  # of what is lost elsewhere: then switching points still move by more than they are off
_FEW_NEW = 0.1  # of the intervals: for fewer new ones the whole solution is not worth finding again
_ROUNDS = 8  # of refinement
_TRIES = 4  # of halving the grid before a speed at an end is called too high
_TIGHTENINGS, _MOST_TIGHTENINGS = 8, 40  # where the rest is stretched away, and where it must not be
_LOWERED = (1.1, 1.3, 2.0, 4.0, 16.0, 64.0)  # times the excess that limits are lowered by, round by round
_EXACT = 1e-10  # a limit exceeded by less is kept


class UnsettledSpeedError(ValueError):
    """The limits could not be kept between grid points with the path velocities asked for.

    Attributes:
        s: Path parameter.
        over: By what factor a limit is exceeded there.
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
        law: s(t), of degree 3; where sdd is constant, pieces have no cubic term.
        stretch: By what factor the solution was slowed down as a whole to keep the limits everywhere.
        tightened: Number of intervals in which the limits were lowered to be kept between their ends.
        refinements: How often the grid was refined.
        grid: Grid points, shape (N + 1,).
        lost: Estimate of the share of the duration that a finer grid would save.
        stops: s at the corners of the path, where the motion stops, shape (k,).
        stop_times: When it does, in seconds, shape (k,).
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
    stops: ArrayLike = (),
) -> TimeOptimalMotion:
    """Return the fastest motion along a path within bounds of velocity and acceleration that hold for all t.

    How the path is parametrised does not matter. At a corner the motion stops. Where the derivative of the
    path vanishes at an end, any sd there is rest.

    Args:
        path: q(s) with n joints, of degree at most 5, without jumps.
        velocity: Lower and upper bounds, shape (n, 2), lower < 0 < upper, infinite for none; per second.
        acceleration: The same, per second squared; not all infinite, unless another constraint bounds sdd.
        start_velocity: sd at the start, not negative.
        end_velocity: sd at the end, not negative.
        further: Other constraints; kept as far as their excess tells.
        stops: Breaks of the path at which it stops, too, shape (k,).

    Raises:
        UnlimitedSpeedError: When nothing limits the motion somewhere.
        UnreachableSpeedError: When the velocities at the ends are too high.
        UnsettledSpeedError: When they leave no room to keep the limits between grid points.
        ValueError: When bounds have another shape or sign, or a velocity is negative.
    """
    if not (0.0 <= start_velocity < np.inf and 0.0 <= end_velocity < np.inf):
        raise ValueError(
            f"path velocities {start_velocity!r} and {end_velocity!r} must be finite, not negative"
        )
    bounds = np.asarray(velocity, dtype=np.float64), np.asarray(acceleration, dtype=np.float64)
    joints = JointConstraint(path, *bounds)
    ends = tuple(
        np.inf if resting and speed == 0 else speed
        for speed, resting in zip((start_velocity, end_velocity), is_at_rest(path), strict=True)
    )
    halts = distinct(np.append(corners(path), np.asarray(stops, dtype=np.float64)))
    problem = PathProblem(joints, tuple(further), halts, (ends[0], ends[1]))
    if path.duration == 0 or not any(constraint.bounds_sdd for constraint in problem.constraints):
        raise UnlimitedSpeedError(path.start)
    solution, rounds, lost = _refined_solution(problem)
    solution, tightened = _tightened_solution(solution)
    grid, pieces, excess = solution.grid, solution.pieces, float(solution.excess.max())
    del solution  # the rows of a long path are large
    law, trajectory, stretch = _stretched(problem, pieces, excess)
    stops = problem.stops
    stop_times = law.breaks[np.searchsorted(grid, stops)]
    return TimeOptimalMotion(trajectory, law, stretch, tightened, rounds, grid, lost, stops, stop_times)


@frozen
class PathProblem:
    """A path and its limits.

    Attributes:
        joints: The path, and the limits of the joints.
        further: Other constraints.
        stops: Where the motion must stop, s, shape (k,).
        ends: sd at the start and at the end; infinite for any.
    """

    joints: JointConstraint
    further: tuple[PathConstraint, ...]
    stops: Array
    ends: tuple[float, float]

    @property
    def constraints(self) -> tuple[PathConstraint, ...]:
        """All that limits the motion."""
        return (self.joints, *self.further)

    @property
    def rests(self) -> bool:
        """Whether it starts and ends at rest, so that it may be stretched."""
        return all(end in (0.0, np.inf) for end in self.ends)

    @property
    def with_ramps(self) -> bool:
        """Whether sdd may change within an interval."""
        return self.joints.path.degree <= _LARGEST_DEGREE

    @property
    def estimate(self) -> float:
        """What share of the time that a grid may lose by estimate it may lose here."""
        return min(constraint.estimate for constraint in self.constraints)

    def excess(self, pieces: LawPieces) -> Array:
        """Return the excess of each of the k constraints in each piece of a law, shape (k, 2, N)."""
        return np.stack([each.excess(pieces) for each in self.constraints])


@frozen
class GridSolution:
    """A solution on a grid of N intervals.

    Attributes:
        problem: What it solves.
        collocated: The constraints at its grid points.
        intervals: The rows that it obeys.
        speeds: sd^2 at its grid points.
        pieces: Of its law s(t).
        excess: Of each of the k constraints in each interval, shape (k, 2, N).
    """

    problem: PathProblem
    collocated: CollocatedConstraints
    intervals: CollocationRows
    speeds: Speeds
    pieces: LawPieces
    excess: Array

    @property
    def grid(self) -> Array:
        """Its grid points, shape (N + 1,)."""
        return self.intervals.grid

    @property
    def x(self) -> Array:
        """sd^2 at its grid points, shape (N + 1,)."""
        return self.speeds.x

    @property
    def lost(self) -> Array:
        """Estimate of the time lost in each interval, the time to keep exceeded limits included, (N,)."""
        durations, over = self.pieces.durations, np.clip(self.excess.max(axis=0) - 1.0, 0.0, 1.0)
        lost = time_lost(self.intervals, self.x, self.speeds.mvc, durations)
        return np.asarray(lost + durations * np.maximum(over[0], 0.5 * over[1]))

    def tightened(self, factors: Array, *, new_ramps: bool) -> GridSolution:
        """Return the solution with limits divided by factors.

        Args:
            factors: Of velocity and acceleration of each constraint in each interval, shape (k, 2, N).
            new_ramps: Whether to find the sdd ramps anew.

        Raises:
            UnreachableSpeedError: When the speeds at the ends are too high for these limits.
        """
        problem, constraints, grid = self.problem, self.collocated, self.grid
        velocity, acceleration = factors[:, 0].max(axis=0), factors[:, 1]
        if new_ramps and problem.with_ramps:
            calm = (
                self.excess.max(axis=(0, 1)) <= _WILD
            )  # elsewhere sdd changes by more than the limits follow
            wanted = np.where(calm, wanted_ramps(self.intervals, self.x), 0.0)
            rows = constraints.intervals(wanted, distances_at_mean_speed(grid, self.x, wanted))
            rows = rows.tightened(np.where(calm, velocity, 1.0), np.where(calm, acceleration, 1.0))
            with suppress(UnreachableSpeedError):  # then there may be one with the ramps as they are
                return _judged(problem, constraints, rows, solve(rows, *problem.ends))
        rows, changed = self.intervals.tightened(velocity, acceleration), (factors != 1.0).any(axis=(0, 1))
        mvc = maximum_velocity_curve(rows, self.speeds.mvc, changed)
        few = changed.mean() < _FEW_CHANGED
        speeds = solve_locally(rows, self.speeds, changed, mvc) if few else None
        return _judged(problem, constraints, rows, speeds or solve(rows, *problem.ends, mvc), self)


def _judged(
    problem: PathProblem,
    constraints: CollocatedConstraints,
    rows: CollocationRows,
    speeds: Speeds,
    before: GridSolution | None = None,
) -> GridSolution:
    """Return the solution with its law and the excess of that.

    Args:
        problem: What it solves.
        constraints: At its grid points.
        rows: That it obeys.
        speeds: sd^2 at its grid points.
        before: A solution with the same sdd ramps.
    """
    pieces = law_pieces(rows.grid, speeds.x, feasible_ramps(rows.grid, speeds.x, rows.ramps))
    if before is None:
        excess = problem.excess(pieces)
    else:
        excess, differs = before.excess.copy(), before.x != speeds.x
        chosen = np.flatnonzero(differs[:-1] | differs[1:])
        excess[:, :, chosen] = problem.excess(pieces.chosen(chosen))
    return GridSolution(problem, constraints, rows, speeds, pieces, excess)


def _solution_on_grid(problem: PathProblem, grid: Array, ramps: Array, distances: Array) -> GridSolution:
    """Return the solution on a grid.

    Args:
        problem: What to solve.
        grid: Grid points, shape (N + 1,).
        ramps: sdd ramps to begin with, shape (N,).
        distances: How far the mean of both speeds leads in each interval, shape (N,).

    Raises:
        UnreachableSpeedError: When there is no motion with the speeds at the ends.
        UnlimitedSpeedError: When nothing limits the motion somewhere.
    """
    constraints = collocated(grid, problem.constraints, problem.stops)
    rows = constraints.intervals(ramps, distances)
    speeds = solve(rows, *problem.ends)
    if problem.with_ramps:
        wanted = wanted_ramps(rows, speeds.x)
        rows = constraints.intervals(wanted, distances_at_mean_speed(grid, speeds.x, wanted))
        try:
            speeds = solve(rows, *problem.ends)
        except UnreachableSpeedError:  # with such ramps there is none
            rows = constraints.intervals(ramps, distances)
    return _judged(problem, constraints, rows, speeds)


def _refined_solution(problem: PathProblem) -> tuple[GridSolution, int, float]:
    """Return the solution on a fine enough grid, how often it was refined, and what is lost."""
    path = problem.joints.path
    grid, most = first_grid(path), most_intervals(path)
    ramps, distances = np.zeros(grid.size - 1), np.diff(grid)
    for rounds in range(_ROUNDS + 1):
        try:
            solution = _solution_on_grid(problem, grid, ramps, distances)
        except UnreachableSpeedError:  # a finer grid has room for a little more
            if rounds >= _TRIES or 2 * grid.size > most:
                raise
            grid = halved(grid)
            ramps, distances = np.zeros(grid.size - 1), np.diff(grid)
            continue
        parts, share = _parts(solution, most - grid.size + 1)
        if rounds == _ROUNDS or (parts == 1).all():
            break
        grid = refined(grid, solution.x, parts)
        ramps, distances = interpolated_ramps(solution.intervals, grid)
    return solution, rounds, share


def _parts(solution: GridSolution, room: int) -> tuple[NDArray[np.intp], float]:
    """Return into how many parts to cut each interval, and the share of the duration that is lost."""
    lost, durations, straight = solution.lost, solution.pieces.durations, solution.intervals.straight
    duration, bent = float(durations.sum()), np.where(straight, 0.0, lost)
    share, estimate = float(lost.sum()) / duration, solution.problem.estimate
    parts = np.ones(lost.size, dtype=np.intp)
    if share > estimate * _LOST and room > _FEW_NEW * lost.size:
        parts = parts_for(bent, estimate * _AIM * duration, room)
    switching = straight & (lost > _SWITCHING * durations)
    settled = lost[switching].sum() <= _SETTLED * bent.sum()
    if not settled and (parts - 1).sum() + switching.sum() <= room:
        parts[switching] = 2
    return parts, share


def _tightened_solution(solution: GridSolution) -> tuple[GridSolution, int]:
    """Return the solution with limits lowered in intervals that exceed them, and in how many.

    A little more than the excess is taken off the limits in such an interval. The solution around it then
    moves, so that it takes a few rounds, in which more and more is taken off the last ones; where the motion
    may be stretched, what is left after these is left to that.
    """
    tightened = np.zeros(solution.x.size - 1, dtype=bool)
    for turn in range(_TIGHTENINGS if solution.problem.rests else _MOST_TIGHTENINGS):
        exceeded = solution.excess > 1.0 + _EXACT
        if not exceeded.any():
            break
        tightened |= exceeded.any(axis=(0, 1))
        lowered = _LOWERED[min(turn, len(_LOWERED) - 1)]
        factors = 1.0 + lowered * np.where(exceeded, solution.excess - 1.0, 0.0)
        solution = solution.tightened(factors, new_ramps=turn == 0)
    return solution, int(tightened.sum())


def _stretched(
    problem: PathProblem, pieces: LawPieces, excess: float
) -> tuple[PiecewisePolynomial, PiecewisePolynomial, float]:
    """Return law and trajectory, as much slower as the peaks ask for, and by what factor.

    Args:
        problem: What was solved.
        pieces: Of the law.
        excess: A bound of what they use of the limits.
    """
    law, trajectory = law_and_trajectory(problem.joints.path, pieces)
    if excess <= 1.0 + _EXACT:
        return law, trajectory, 1.0
    worst = [*_exact_peaks(problem.joints, trajectory), *_sampled_peaks(problem.further, pieces, law)]
    stretch, used, time = max(worst)
    if stretch <= 1.0 + _EXACT:
        return law, trajectory, 1.0
    if not problem.rests:
        raise UnsettledSpeedError(float(law.evaluate(time)[0]), used)
    return scale_time(law, stretch), scale_time(trajectory, stretch), stretch


def _exact_peaks(
    joints: JointConstraint, trajectory: PiecewisePolynomial
) -> Iterator[tuple[float, float, float]]:
    """Yield for velocity and acceleration (factor of time to keep them, share of the limit, when)."""
    bounds = joints.velocity, joints.acceleration
    for peak, limits, root in zip(peaks(trajectory, (1, 2)), bounds, (1.0, 0.5), strict=True):
        high, low = peak.high / limits[:, 1], peak.low / limits[:, 0]
        used, times = np.maximum(high, low), np.where(high > low, peak.high_time, peak.low_time)
        yield float(used.max()) ** root, float(used.max()), float(times[used.argmax()])


def _sampled_peaks(
    constraints: Sequence[PathConstraint], pieces: LawPieces, law: PiecewisePolynomial
) -> Iterator[tuple[float, float, float]]:
    """Yield the same from the excess of constraints, each at the middle of an interval."""
    for constraint in constraints:
        for used, root in zip(constraint.excess(pieces), (1.0, 0.5), strict=True):
            k = int(used.argmax())
            yield float(used[k]) ** root, float(used[k]), float(law.breaks[k : k + 2].mean())
