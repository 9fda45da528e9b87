"""Search for the fastest motion through points, from several starting points of a fixed order.

1. Free knots, eight in each segment, from six tenths of the times of stopping at each point.
2. The straight motion of each collinear stretch; where there is none, the states of stopping at each point.
3. Free knots, twelve in each segment, from eight tenths of the times of stopping.
4. Central differences of the points over the times of stopping, at the best of six speeds.
5. Free knots, six in each segment, from times at the velocity limits.
6. Free knots, eight in each segment, from the times of the best motion so far.
7. Free knots, ten in each segment, from equal times.
8. Free knots, sixteen in each segment, from the times of the best motion so far.

Each gives velocities and accelerations at the points, which are then improved until no more is gained, or
left where they come nearer to the best so far too slowly. A motion that stops at each point is always among
those that are compared. Once a motion is as fast as the proven bound, no further starting points are tried.
The states that are found are rounded, so that the last bits of linear algebra, which differ between
processors, do not show.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.frozen import frozen
from trajcli.planners.fastest_through_points.free_knots.interior_point import fastest_knots
from trajcli.planners.fastest_through_points.free_knots.knot_motion import KnotProblem
from trajcli.planners.fastest_through_points.position_limits import with_limits_near
from trajcli.planners.fastest_through_points.problem import WaypointProblem
from trajcli.planners.fastest_through_points.states import (
    StateMotion,
    evaluated,
    improved,
    within_position_limits,
)
from trajcli.progress import report_progress

_SPEEDS = (0.25, 0.5, 0.75, 1.0, 1.5, 2.0)  # of central differences
_PROVEN = 1e-7  # relative: a motion this near to the bound is the fastest
_GRID, _COST = 2.0**-21, 1e-6  # relative: to what states are rounded, and how much longer that may last
_ALIKE = 1e-3  # relative: durations this near to the shortest agree with it
_TINY = 1e-6  # of the longest time: less is rounding
_SHORT = 0.05  # of the longest time at the velocity limits: no segment begins with less

_FAR = 100.0  # for a position limit that does not bind, in units of the joints
_LEAST = 1e-3  # of the intervals to begin with: none becomes shorter

Start = Callable[[WaypointProblem, StateMotion, StateMotion], Array]


@frozen
class Found:
    """What a search found.

    Attributes:
        best: The fastest motion.
        durations: To which each starting point led, s, in the order of the starting points.
        stopping: Duration of the motion that stops at each point, s; infinite where there is none.
    """

    best: StateMotion
    durations: tuple[float, ...]
    stopping: float

    def agreeing(self, duration: float) -> int:
        """Return how many starting points led to a duration, or nearly so."""
        return sum(found <= duration * (1 + _ALIKE) for found in self.durations)


def search(
    problem: WaypointProblem,
    starts: int,
    straight: Array | None = None,
    lower: float = 0.0,
    given: Array | None = None,
) -> Found:
    """Return the fastest motion that the first starting points lead to.

    Args:
        problem: Points, limits, and what is given.
        starts: How many starting points are tried, 1 to 8.
        lower: A proven lower bound of the duration, s: once it is met no further starting points are tried.
        straight: States (K + 1, n, 2) of the motion along the polyline, where some points are collinear.
        given: States of a motion through the points: it is one of those that are compared, and the only
            starting point has eight free knots in each segment, and its times.
    """
    time, lengths = problem.units
    polyline = None if straight is None else _scaled(problem, straight)
    along = _stopping if polyline is None else (lambda problem, stopping, best: polyline)
    begins = (_STARTS[0], along, *_STARTS[2:])[:starts]
    near = None if given is None else _scaled(problem, given)
    found = _found(
        problem.reachable().scaled(), begins if near is None else (_from_best(8),), lower / time, near
    )
    states = found.best.states * np.stack([lengths / time, lengths / time**2], axis=1)
    best = StateMotion(problem.inside(states), found.best.times * time)
    return Found(best, tuple(time * duration for duration in found.durations), found.stopping * time)


def _scaled(problem: WaypointProblem, states: Array) -> Array:
    """Return states (K + 1, n, 2) in the units of the problem."""
    time, lengths = problem.units
    return np.asarray(states / np.stack([lengths / time, lengths / time**2], axis=1))


def _found(problem: WaypointProblem, starts: Sequence[Start], lower: float, given: Array | None) -> Found:
    """Return the fastest motion that is found, all in the units of the problem."""
    stopping = evaluated(problem, problem.stopping())
    if problem.walled and np.isfinite(stopping.duration):
        problem = with_limits_near(problem, stopping.times)
    if problem.segments == 1 or problem.fixed.all():
        return Found(stopping, (stopping.duration,) * len(starts), stopping.duration)
    best = stopping
    if given is not None:
        best = min(best, within_position_limits(problem, given), key=lambda motion: motion.duration)
    durations: list[float] = []
    for number, start in enumerate(starts, 1):
        if durations and best.duration <= lower * (1 + _PROVEN):
            break
        report_progress(f"starting point {number} of {len(starts)}")
        motion = improved(
            problem, within_position_limits(problem, start(problem, stopping, best)), best.duration
        )
        durations.append(motion.duration)
        if motion.duration < best.duration:
            best = motion
    return Found(_rounded(problem, best), tuple(durations), stopping.duration)


def _rounded(problem: WaypointProblem, motion: StateMotion) -> StateMotion:
    """Return the motion with rounded states, unless that costs more than rounding may."""
    grid = _GRID * problem.scales
    rounded = evaluated(problem, np.round(motion.states / grid) * grid)
    return rounded if rounded.duration <= motion.duration * (1 + _COST) else motion


def _usual_times(problem: WaypointProblem, motion: StateMotion) -> Array:
    """Return the times of a motion, none of them zero, or twice those at the velocity limits."""
    times = np.where(np.isfinite(motion.times), motion.times, 2 * _speed_times(problem))
    return np.asarray(np.maximum(times, _TINY * times.max()))


def _speed_times(problem: WaypointProblem) -> Array:
    """Return what each segment needs at the velocity limits, s, shape (K,)."""
    times = problem.times_at_speed
    return np.asarray(np.maximum(times, _SHORT * float(times.max())))


def states_by_free_knots(problem: WaypointProblem, times: Array, intervals: int) -> Array:
    """Return states (K + 1, n, 2) at the points of a fast motion with free knots.

    Args:
        problem: Points and limits.
        times: Of the segments to begin with, shape (K,).
        intervals: In each segment, at least four.
    """
    knots = knot_problem(problem, times, intervals)
    speeds = problem.scales[:, 0]
    scales = np.stack([speeds, speeds / knots.time], axis=1)
    ends = fastest_knots(knots, times / knots.time, problem.states / scales)
    return np.where(problem.fixed, problem.states, ends * scales)


def knot_problem(problem: WaypointProblem, times: Array, intervals: int) -> KnotProblem:
    """Return the problem with so many intervals, for segments that last about so long (K,)."""
    time, speeds = float(times.mean()), problem.scales[:, 0]
    slack = np.abs(problem.position - problem.points[..., None]) / (speeds * time)[:, None]
    return KnotProblem(
        time,
        np.stack([problem.velocity.T / speeds, problem.acceleration.T / (speeds / time)]),
        problem.jerk * time**2 / speeds,
        problem.steps / (speeds * time),
        problem.least / time,
        np.repeat(_LEAST * times[:, None] / time / intervals, intervals, axis=1),
        ~problem.fixed,
        np.minimum(slack, _FAR) if problem.walled else None,
    )


def _from_stopping(intervals: int, part: float) -> Start:
    def start(problem: WaypointProblem, stopping: StateMotion, best: StateMotion) -> Array:
        return states_by_free_knots(problem, part * _usual_times(problem, stopping), intervals)

    return start


def _from_best(intervals: int) -> Start:
    def start(problem: WaypointProblem, stopping: StateMotion, best: StateMotion) -> Array:
        return states_by_free_knots(problem, _usual_times(problem, best), intervals)

    return start


def _at_speed_limits(problem: WaypointProblem, stopping: StateMotion, best: StateMotion) -> Array:
    return states_by_free_knots(problem, 1.2 * _speed_times(problem), 6)


def _equal_times(problem: WaypointProblem, stopping: StateMotion, best: StateMotion) -> Array:
    times = _usual_times(problem, best)
    return states_by_free_knots(problem, np.full_like(times, times.mean()), 10)


def _stopping(problem: WaypointProblem, stopping: StateMotion, best: StateMotion) -> Array:
    return problem.stopping()


def _central_differences(problem: WaypointProblem, stopping: StateMotion, best: StateMotion) -> Array:
    times = _usual_times(problem, stopping)
    slopes = problem.steps / times[:, None]
    weight = (times[1:] / (times[1:] + times[:-1]))[:, None]
    between = weight * slopes[:-1] + (1 - weight) * slopes[1:]
    motions = []
    for speed in _SPEEDS:
        states = np.zeros_like(problem.states)
        states[1:-1, :, 0] = speed * between
        motions.append(evaluated(problem, states))
    return min(motions, key=lambda motion: motion.duration).states


_STARTS: tuple[Start, ...] = (
    _from_stopping(8, 0.6),
    _stopping,
    _from_stopping(12, 0.8),
    _central_differences,
    _at_speed_limits,
    _from_best(8),
    _equal_times,
    _from_best(16),
)
