"""The planned motion through points: search, exact segments, and what is known of how fast it is."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from itertools import pairwise

import numpy as np

from trajcli.curves.extrema import peaks
from trajcli.curves.operations import times_at
from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.errors import Amount, PlanningError, of_joint
from trajcli.frozen import frozen
from trajcli.planners.fastest_through_points.problem import WaypointProblem
from trajcli.planners.fastest_through_points.search import search
from trajcli.planners.fastest_through_points.segment_motion import PointMotion, exact_motion
from trajcli.planners.fastest_through_points.state_times import shortest_duration
from trajcli.planners.fastest_through_points.states import StateMotion, evaluated
from trajcli.planners.fastest_through_points.straight import straight_motion, straight_stretches

_NEARBY = (0.0, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1.0)  # by what part velocities are lowered in turn
_LONGER = 1e-6  # relative: a motion that lasts so little longer than was found is the one that was found
_TOUCH = 1e-9  # of the positions: a limit passed by less is touched
_SLOWER = 1e-9  # relative: durations that differ by less are equal


@frozen
class FastestMotion:
    """A motion through points, and what is known of it.

    Attributes:
        motion: Of all joints of the problem.
        lower: No motion through the points is faster than this, s.
        joint: The joint of the problem that needs so long; None where it is several together.
        found: Durations to which the starting points led, s.
        agreeing: How many of them agree with the motion.
        stopping: Duration of the motion that stops at each point, s; infinite where there is none.
    """

    motion: PointMotion
    lower: float
    joint: int | None
    found: tuple[float, ...]
    agreeing: int
    stopping: float


def fastest_motion(
    problem: WaypointProblem, names: list[str], starts: int, near: Array | None = None
) -> FastestMotion:
    """Return the fastest motion that is found.

    Args:
        problem: Points, limits, and what is given.
        names: Of its joints, for messages.
        starts: How many starting points are tried.
        near: States (K + 1, n, 2) of a motion through the points, from which alone it is searched then.

    Raises:
        PlanningError: When none is found.
    """
    lower, joint = shortest_duration(problem.scaled())
    lower *= problem.units[0]
    kept = _essential(problem)
    short = problem.only(kept)
    straight = _straight_candidate(short, names)
    states = None if straight is None else _states_of(short, straight)
    found = search(short, starts, states, lower, None if near is None else near[kept])
    motion = straight
    if straight is None or found.best.duration < straight.duration * (1 - _SLOWER):
        exact = _exact(short, found.best, names)
        if exact is not None and (motion is None or exact.duration < motion.duration):
            motion = exact
    if motion is None:
        raise _none_found(short, names)
    if len(kept) <= problem.segments:
        motion = _with_all_points(problem, kept, motion)
    stopping = found.stopping if short is problem else search(problem, 0).stopping
    agreeing = found.agreeing(motion.duration)
    return FastestMotion(motion, lower, joint, found.durations, agreeing, stopping)


def _exact(problem: WaypointProblem, best: StateMotion, names: list[str]) -> PointMotion | None:
    """Return the motion between the states that were found, exactly; None where there is none.

    States may lie where only a longer duration suits all joints: then others near to them are tried, and at
    last those of stopping.
    """
    if not np.isfinite(best.duration):
        return None
    motions = []
    for part in _NEARBY:
        states = problem.inside(best.states * np.array([1 - part, (1 - part) ** 2]))
        with suppress(PlanningError):
            motion = exact_motion(problem, states, names, best.duration)
            if not _keeps_positions(problem, motion):
                continue
            motions.append(motion)
            if motion.duration <= best.duration * (1 + _LONGER):
                break
    return min(motions, key=lambda motion: motion.duration, default=None)


def _keeps_positions(problem: WaypointProblem, motion: PointMotion) -> bool:
    if not problem.walled:
        return True
    (found,) = peaks(motion.curve, (0,))
    low, high = problem.position.T
    slack = _TOUCH * np.maximum(1.0, np.abs(problem.points).max(axis=0))
    return bool((found.low >= low - slack).all() and (found.high <= high + slack).all())


def _none_found(problem: WaypointProblem, names: list[str]) -> PlanningError:
    free = replace(problem, position=np.tile([-np.inf, np.inf], (problem.joints, 1)))
    best = search(free, 1).best
    if problem.walled and np.isfinite(best.duration):
        motion = exact_motion(free, best.states, names)
        (found,) = peaks(motion.curve, (0,))
        low, high = problem.position.T
        over = np.maximum(found.high - high, low - found.low)
        joint = int(over.argmax())
        above = found.high[joint] - high[joint] >= low[joint] - found.low[joint]
        value, limit = (found.high, high) if above else (found.low, low)
        message = (
            "no motion through the points keeps the position limits: {joint} goes to {value}, beyond {limit}"
        )
        amounts = {
            "value": Amount(float(value[joint]), 0, joint),
            "limit": Amount(float(limit[joint]), 0, joint),
        }
        hint = "give other velocities or points, or widen the limit"
        return PlanningError(of_joint(names[joint], message, hint, amounts))
    return PlanningError(
        "no motion through the points was found with the velocities and accelerations that are given",
        hint="leave some of them out, or lower them",
    )


def straight_only(problem: WaypointProblem, names: list[str], starts: int) -> FastestMotion:
    """Return the fastest motion along the polyline, with a stop where it turns.

    Raises:
        PlanningError: When what is given at a point leaves the line.
    """

    def solve(law: WaypointProblem) -> Array:
        best, polyline = search(law, starts).best, replace(law, position=np.array([[0.0, 1.0]]))
        if not np.isfinite(evaluated(polyline, best.states).duration):  # a run-up from beyond its corners
            within = search(polyline, starts).best
            best = within if np.isfinite(within.duration) else best
        return best.states

    motion, lower = straight_motion(problem, names, solve)
    return FastestMotion(motion, lower, None, (motion.duration,), 1, search(problem, 0).stopping)


def _essential(problem: WaypointProblem) -> list[int]:
    """Return the points that count: of one joint alone, those between which it only goes on do not."""
    if problem.joints > 1:
        return list(range(problem.segments + 1))
    steps, kept = np.sign(problem.steps[:, 0]), [0]
    for k in range(1, problem.segments):
        goes_on = steps[k - 1] == steps[k] and not problem.fixed[k].any()
        if not goes_on or problem.least[k - 1 : k + 1].any():
            kept.append(k)
    return [*kept, problem.segments]


def _with_all_points(problem: WaypointProblem, kept: list[int], motion: PointMotion) -> PointMotion:
    """Return the motion of one joint with the times at which it first reaches the points between."""
    times = np.zeros(problem.segments + 1)
    for (first, last), (start, end) in zip(pairwise(kept), pairwise(motion.times.tolist()), strict=True):
        times[first], times[last] = start, end
        values = problem.points[first + 1 : last, 0]
        if values.size:
            part = _between(motion.curve, start, end)
            sign = np.sign(problem.points[last, 0] - problem.points[first, 0])
            law = PiecewisePolynomial(part.breaks, sign * part.coefficients)
            times[first + 1 : last] = times_at(law, sign * values)
    return replace(motion, times=times)


def _between(curve: PiecewisePolynomial, start: float, end: float) -> PiecewisePolynomial:
    middle = 0.5 * (curve.breaks[1:] + curve.breaks[:-1])
    inside = np.flatnonzero((middle > start) & (middle < end))
    first, last = int(inside[0]), int(inside[-1]) + 1
    return PiecewisePolynomial(curve.breaks[first : last + 1], curve.coefficients[:, first:last])


def _straight_candidate(problem: WaypointProblem, names: list[str]) -> PointMotion | None:
    """Return the motion along the polyline; None where no points are collinear or more is asked for."""
    stretches = straight_stretches(problem.points)
    more = problem.states.any() or problem.fixed[1:-1].any() or problem.least.any()
    if more or len(stretches) == problem.segments:
        return None
    return straight_motion(problem, names, lambda law: law.states)[0]


def _states_of(problem: WaypointProblem, motion: PointMotion) -> Array:
    orders = [motion.curve.evaluate(motion.times, order) for order in (1, 2)]
    return problem.inside(np.stack(orders, axis=2))
