"""The time-optimal motion along a path: grid, solution, law, trajectory, and what was done to get there."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trajcli.curves.compose import compose, scale_time
from trajcli.curves.extrema import peaks
from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.curves.time_optimal.constraints import (
    Demand,
    Intervals,
    constrained,
    corners,
    is_at_rest,
    joint_demand,
)
from trajcli.curves.time_optimal.grid import first_grid, halved, most_intervals, refined
from trajcli.curves.time_optimal.law import durations, law_of
from trajcli.curves.time_optimal.resolution import excess, time_lost
from trajcli.curves.time_optimal.solve import UnlimitedSpeedError, UnreachableSpeedError, solve
from trajcli.frozen import frozen

_LOST = 2e-3  # of the duration, by estimate: a finer grid would not gain more
_WORTH = 1e-3  # of the mean duration of an interval: a smaller loss in one is not worth a new place
_SWITCHING = (
    1e-8  # of an interval of a straight line: more is lost only where a switching place is to be found
)
_OVER = 1e-4  # by which a limit may be passed between places before tightening sets it right
_ROUNDS = 8  # of refinement
_TRIES = 4  # of halving the grid before a speed at an end is called too high
_TIGHTENINGS, _MOST_TIGHTENINGS = 6, 40  # where the rest is stretched away, and where it must not be
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
class TimeOptimal:
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


@frozen
class _Problem:
    path: PiecewisePolynomial
    velocity: Array
    acceleration: Array
    demands: Sequence[Demand]
    stops: Array
    ends: tuple[float, float]

    @property
    def rests(self) -> bool:
        """Whether it starts and ends at rest, so that it may be stretched."""
        return all(end in (0.0, np.inf) for end in self.ends)

    def over(self, grid: Array, x: Array) -> Array:
        return excess(self.path, grid, x, self.velocity, self.acceleration)


def time_optimal(
    path: PiecewisePolynomial,
    velocity: ArrayLike,
    acceleration: ArrayLike,
    *,
    start_velocity: float = 0.0,
    end_velocity: float = 0.0,
    further: Sequence[Demand] = (),
) -> TimeOptimal:
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
    demands = [joint_demand(path, *bounds), *further]
    ends = tuple(
        np.inf if resting and speed == 0 else speed
        for speed, resting in zip((start_velocity, end_velocity), is_at_rest(path), strict=True)
    )
    if not np.isfinite(bounds[1]).any() or path.duration == 0:
        raise UnlimitedSpeedError(path.start)
    problem = _Problem(path, *bounds, demands, corners(path), (ends[0], ends[1]))
    intervals, x, rounds, lost = _refined_solution(problem)
    x, tightened = _tightened_solution(problem, intervals, x)
    law, trajectory, stretch = _stretched(problem, law_of(intervals.grid, x))
    stop_times = law.breaks[np.searchsorted(intervals.grid, problem.stops)]
    return TimeOptimal(
        trajectory, law, stretch, tightened, rounds, intervals.grid, lost, problem.stops, stop_times
    )


def _refined_solution(problem: _Problem) -> tuple[Intervals, Array, int, float]:
    """Return the rows on a fine enough grid, sd^2 there, how often it was refined, and what is lost."""
    grid, most = first_grid(problem.path), most_intervals(problem.path)
    for rounds in range(_ROUNDS + 1):
        intervals = constrained(grid, problem.demands, problem.stops)
        try:
            x, ceiling = solve(intervals, *problem.ends)
        except UnreachableSpeedError:  # a finer grid has room for a little more
            if rounds >= _TRIES or 2 * grid.size > most:
                raise
            grid = halved(grid)
            continue
        lost, whole = time_lost(intervals, x, ceiling), float(durations(grid, x).sum())
        share = float(lost.sum()) / whole
        worth = _WORTH * whole / lost.size if share > _LOST else np.inf
        chosen = lost > np.where(intervals.straight, _SWITCHING * durations(grid, x), worth)
        chosen |= problem.over(grid, x).max(axis=0) > 1.0 + _OVER
        room = most - lost.size
        if rounds == _ROUNDS or room <= 0 or not chosen.any():
            break
        grid = refined(grid, x, _worst(chosen, lost, room))
    return intervals, x, rounds, share


def _worst(chosen: NDArray[np.bool_], lost: Array, room: int) -> NDArray[np.bool_]:
    """Return the chosen intervals, of too many those that lose most."""
    if chosen.sum() <= room:
        return chosen
    kept = np.zeros_like(chosen)
    kept[np.argsort(np.where(chosen, -lost, np.inf), kind="stable")[:room]] = True
    return kept


def _tightened_solution(problem: _Problem, intervals: Intervals, x: Array) -> tuple[Array, int]:
    """Return sd^2 with limits lowered in intervals that pass them, and in how many.

    Twice the excess is taken off the rows of such an interval. The solution around it then moves a little, so
    that it takes a few turns; where the motion may be stretched, what is left after these is left to that.
    """
    grid = intervals.grid
    tightened = np.zeros(grid.size - 1, dtype=bool)
    for _ in range(_TIGHTENINGS if problem.rests else _MOST_TIGHTENINGS):
        over = problem.over(grid, x)
        passed = over > 1.0 + _EXACT
        if not passed.any():
            break
        tightened |= passed.any(axis=0)
        intervals = intervals.tightened(*np.where(passed, 2.0 * over - 1.0, 1.0))
        x, _ = solve(intervals, *problem.ends)
    return x, int(tightened.sum())


def _stretched(
    problem: _Problem, law: PiecewisePolynomial
) -> tuple[PiecewisePolynomial, PiecewisePolynomial, float]:
    """Return the law and the trajectory, as much slower as the exact peaks ask for, and by what factor."""
    trajectory = compose(problem.path, law)
    factors = []
    for peak, bounds, root in zip(
        peaks(trajectory, (1, 2)), (problem.velocity, problem.acceleration), (1.0, 0.5), strict=True
    ):
        over = np.maximum(peak.high / bounds[:, 1], peak.low / bounds[:, 0])
        times = np.where(peak.high / bounds[:, 1] > peak.low / bounds[:, 0], peak.high_time, peak.low_time)
        factors.append((float(over.max()) ** root, float(over.max()), float(times[over.argmax()])))
    stretch, worst, time = max(factors)
    if stretch <= 1.0 + _EXACT:
        return law, trajectory, 1.0
    if not problem.rests:
        raise UnsettledSpeedError(float(law.evaluate(time)[0]), worst)
    return scale_time(law, stretch), scale_time(trajectory, stretch), stretch
