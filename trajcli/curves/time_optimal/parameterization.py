"""Time-optimal motion along a path: the fastest law s(t) within limits, solved on a grid that is refined.

The problem is solved on a grid by the two passes. Where the estimate says that time is lost, the grid is cut
finer. Where a constraint says that the law exceeds it between grid points, its limits are lowered there, and
the problem is solved again. What is left after that is taken away by slowing down the motion as a whole.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trajcli.curves.operations import scale_time
from trajcli.curves.piecewise import Array, PiecewisePolynomial, distinct
from trajcli.curves.time_optimal.accelerations import binding_rows, end_accelerations
from trajcli.curves.time_optimal.collocation import IntervalRows, interval_rows
from trajcli.curves.time_optimal.constraints import JointConstraint, PathConstraint, corners, is_at_rest
from trajcli.curves.time_optimal.passes import (
    Speeds,
    StandstillError,
    UnlimitedSpeedError,
    UnreachableSpeedError,
    maximum_velocity_curve,
    solve,
    solve_locally,
)
from trajcli.curves.time_optimal.refinement import (
    first_grid,
    halved,
    most_intervals,
    parts_for,
    refined,
    shortest_intervals,
    time_lost,
)
from trajcli.curves.time_optimal.time_law import (
    LawPieces,
    law_and_trajectory,
    law_pieces,
)
from trajcli.frozen import frozen

_FEW_CHANGED = 0.01  # of the intervals: if no more of them change, most of the solution stays
_WILD = 1.01  # of a limit: where more is used, sdd shall not change
_AROUND = 5e-3  # of the duration: what is slowed down at least around an interval with wild excess
_LOST = 4e-4  # of the duration, by estimate: a finer grid would not gain more
_AIM = 2e-4  # of the duration: the estimate that a finer grid is made for
_SWITCHING = 1e-8  # of an interval of a straight line: more is lost only where a switching point is missing
_SETTLED = 0.01  # of what is lost elsewhere: then switching points still move by more than they are off
_FEW_NEW = 0.1  # of the intervals: for fewer new ones the whole solution is not worth finding again
_ROUNDS = 8  # of refinement
_TRIES = 4  # of halving the grid before a speed at an end is called too high
_TIGHTENINGS, _MOST_TIGHTENINGS = 8, 40  # where little is stretched away, and where much is, or must not be
_LOWERED = (1.1, 1.2, 1.5, *5 * (2.0,), 4.0, 8.0, 16.0)  # times the excess that limits are lowered, by round
_EXTRA = 1e-9  # of a limit: taken off beyond that
_MOST_LOWERED = 0.2  # of a limit: no more of its excess is taken off it at a time
_STUBBORN = 1e-5  # of a limit: where it is passed by more in the end, sdd shall not change
_PATIENCE = 3  # rounds after which that is decided
_LITTLE, _MUCH = 2e-5, 5e-4  # of the duration: so much is left to a stretch; so much is worth more rounds
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
        lower_bound: Duration that no motion along the path falls below, s, by velocity and acceleration.
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
    lower_bound: float


def time_optimal(
    path: PiecewisePolynomial,
    velocity: ArrayLike,
    acceleration: ArrayLike,
    *,
    start_velocity: float = 0.0,
    end_velocity: float = 0.0,
    further: Sequence[PathConstraint] = (),
    stops: ArrayLike = (),
    along: tuple[float, float] = (np.inf, np.inf),
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
        along: Limits of sd and of the size of sdd that further constraints imply, for the lower bound.

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
    grid, pieces, stretch = solution.grid, solution.pieces, solution.needed
    if stretch > 1.0 and not problem.rests:
        worst = int(solution.excess.max(axis=(0, 1)).argmax())
        raise UnsettledSpeedError(float(grid[worst : worst + 2].mean()), float(solution.excess.max()))
    del solution  # the rows of a long path are large
    law, trajectory = law_and_trajectory(path, pieces)
    if stretch > 1.0:
        law, trajectory = scale_time(law, stretch), scale_time(trajectory, stretch)
    from trajcli.curves.time_optimal.lower_bound import lower_bound

    stops = problem.stops
    stop_times = law.breaks[np.searchsorted(grid, stops)]
    least = lower_bound(joints, problem.further, along, (grid, stops), problem.ends)
    return TimeOptimalMotion(
        trajectory, law, stretch, tightened, rounds, grid, lost, stops, stop_times, least
    )


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
        intervals: The rows that it obeys.
        speeds: sd^2 at its grid points.
        pieces: Of its law s(t).
        excess: Of each of the k constraints in each interval, shape (k, 2, N).
        even: In which intervals sdd is constant, as a change of it led to wild excess, shape (N,).
    """

    problem: PathProblem
    intervals: IntervalRows
    speeds: Speeds
    pieces: LawPieces
    excess: Array
    even: NDArray[np.bool_]

    @property
    def grid(self) -> Array:
        """Its grid points, shape (N + 1,)."""
        return self.intervals.grid

    @property
    def x(self) -> Array:
        """sd^2 at its grid points, shape (N + 1,)."""
        return self.speeds.x

    @property
    def duration(self) -> float:
        """Of its law, s."""
        return float(self.pieces.durations.sum())

    @property
    def lost(self) -> Array:
        """Estimate of the time lost in each interval, the time to keep exceeded limits included, (N,)."""
        durations, over = self.pieces.durations, np.clip(self.excess.max(axis=0) - 1.0, 0.0, 1.0)
        lost = time_lost(self.intervals, self.x, self.speeds.mvc, durations)
        slowed = np.maximum(over[0], 0.5 * over[1])  # lower limits slow the motion down around, too
        long = np.diff(self.grid) > shortest_intervals(self.problem.joints.path, self.grid)
        least = np.where((slowed > _WILD - 1.0) & long, _AROUND * durations.sum(), 0.0)
        return np.asarray(lost + np.maximum(durations, least) * slowed)

    @property
    def needed(self) -> float:
        """By what factor its law must be stretched to keep its limits."""
        velocity, acceleration = self.excess.max(axis=(0, 2)).tolist()
        factor = float(max(velocity, acceleration**0.5))
        return factor if factor > 1.0 + _EXACT else 1.0

    def tightened(self, factors: Array, even: NDArray[np.bool_]) -> GridSolution:
        """Return the solution with limits divided by factors.

        Args:
            factors: Of velocity and acceleration of each constraint in each interval, shape (k, 2, N).
            even: In which intervals sdd shall be constant from now on, shape (N,).

        Raises:
            UnreachableSpeedError: When the speeds at the ends are too high for these limits.
        """
        old, problem = self.intervals, self.problem
        rows = old.tightened(factors[:, 0].max(axis=0), factors[:, 1])
        lower = rows.cap != old.cap
        changed = (rows.C != old.C).any(axis=0) | lower[1:] | lower[:-1]
        mvc = maximum_velocity_curve(rows, self.speeds.mvc, changed)
        speeds = solve_locally(rows, self.speeds, changed, mvc) if changed.mean() < _FEW_CHANGED else None
        return _with_excess(problem, rows, speeds or solve(rows, *problem.ends, mvc), self.even | even, self)


def _with_excess(
    problem: PathProblem,
    rows: IntervalRows,
    speeds: Speeds,
    even: NDArray[np.bool_],
    before: GridSolution | None,
) -> GridSolution:
    """Return the solution with its law and the excess of that; where it is wild, sdd is constant."""
    bound = binding_rows(rows, speeds.x)
    while True:
        ends = end_accelerations(rows, speeds.x, speeds.mvc, bound, even)
        pieces = law_pieces(rows.grid, speeds.x, *ends)
        before = GridSolution(problem, rows, speeds, pieces, _excess(problem, pieces, before), even)
        wild = (before.excess.max(axis=(0, 1)) > _WILD) & ~even
        if not wild.any():
            return before
        even = even | wild


def _excess(problem: PathProblem, pieces: LawPieces, before: GridSolution | None) -> Array:
    """Return the excess of pieces, shape (k, 2, N), known of those that were pieces of a solution before."""
    if before is None:
        return problem.excess(pieces)
    index, same = pieces.among(before.pieces)
    excess, new = before.excess[:, :, index], np.flatnonzero(~same)
    if new.size:
        excess[:, :, new] = problem.excess(pieces.chosen(new))
    return np.asarray(excess)


def _solution_on_grid(problem: PathProblem, grid: Array, before: GridSolution | None) -> GridSolution:
    """Return the solution on a grid (N + 1,); one on another grid spares some work."""
    rows = interval_rows(grid, problem.constraints, problem.stops)
    speeds = solve(rows, *problem.ends)
    still = np.flatnonzero(np.maximum(speeds.x[1:], speeds.x[:-1]) <= 0.0)
    if still.size:
        raise StandstillError(float(grid[still[0]]))
    return _with_excess(problem, rows, speeds, np.zeros(grid.size - 1, dtype=bool), before)


def _refined_solution(problem: PathProblem) -> tuple[GridSolution, int, float]:
    """Return the solution on a fine enough grid, how often it was refined, and what is lost."""
    path = problem.joints.path
    grid, allowed, before = first_grid(path), most_intervals(path), None
    for rounds in range(_ROUNDS + 1):
        try:
            before = solution = _solution_on_grid(problem, grid, before)
        except (StandstillError, UnreachableSpeedError):  # a finer grid has room for a little more
            if rounds >= _TRIES or 2 * grid.size > allowed:
                raise
            grid = halved(grid)
            continue
        parts, share = _parts(solution, allowed - grid.size + 1)
        if rounds == _ROUNDS or (parts == 1).all():
            break
        grid = refined(grid, solution.x, parts)
    return solution, rounds, share


def _parts(solution: GridSolution, slack: int) -> tuple[NDArray[np.intp], float]:
    """Return into how many parts to cut each interval, and the share of the duration that is lost."""
    lost, durations, straight = solution.lost, solution.pieces.durations, solution.intervals.straight
    duration, bent = float(durations.sum()), np.where(straight, 0.0, lost)
    share, estimate = float(lost.sum()) / duration, solution.problem.estimate
    parts = np.ones(lost.size, dtype=np.intp)
    if share > estimate * _LOST and slack > _FEW_NEW * lost.size:
        parts = parts_for(bent, estimate * _AIM * duration, slack)
    switching = straight & (lost > _SWITCHING * durations)
    settled = lost[switching].sum() <= _SETTLED * bent.sum()
    if not settled and (parts - 1).sum() + switching.sum() <= slack:
        parts[switching] = 2
    return parts, share


def _tightened_solution(solution: GridSolution) -> tuple[GridSolution, int]:
    """Return the solution with limits lowered in intervals that exceed them, and in how many.

    A little more than the excess is taken off the limits in such an interval. The solution around it then
    moves, so that it takes a few rounds. Where the motion may be stretched, that is left over to the best.
    """
    rests = solution.problem.rests
    tightened, best = np.zeros(solution.x.size - 1, dtype=bool), solution
    for turn in range(_MOST_TIGHTENINGS):
        exceeded = solution.excess > 1.0 + _EXACT
        if not exceeded.any() or (rests and solution.needed <= 1.0 + _LITTLE):
            break
        tightened |= exceeded.any(axis=(0, 1))
        over = np.clip(solution.excess - 1.0, 0.0, _MOST_LOWERED)
        factors = 1.0 + _LOWERED[min(turn, len(_LOWERED) - 1)] * np.where(exceeded, over + _EXTRA, 0.0)
        kept = _STUBBORN if rests else _EXACT
        stubborn = (solution.excess > (1.0 + kept if turn >= _PATIENCE else np.inf)).any(axis=(0, 1))
        solution = solution.tightened(factors, np.asarray(stubborn))
        before, now = best.duration * best.needed, solution.duration * solution.needed
        if not rests or now < before:
            best = solution
        idle = turn > _PATIENCE + 1 and now > before * (1.0 - _LITTLE)
        if rests and best.needed <= 1.0 + _MUCH and (idle or turn + 1 == _TIGHTENINGS):
            break
    return best, int(tightened.sum())
