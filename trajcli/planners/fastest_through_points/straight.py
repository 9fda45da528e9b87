"""Motions along the polyline through points: all joints of a straight stretch follow one law.

A stretch is straight as far as its points lie on one line, each beyond the one before. Its law is that of one
variable, from 0 to 1, under the limits of whichever joint is tightest; where the line turns it stops.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.operations import along_line, times_at
from trajcli.curves.piecewise import Array
from trajcli.curves.turning_bound import bounds_along
from trajcli.errors import Amount, PlanningError, of_joint
from trajcli.planners.fastest_through_points.problem import WaypointProblem
from trajcli.planners.fastest_through_points.segment_motion import PointMotion, exact_motion, joined
from trajcli.planners.fastest_through_points.state_times import shortest_duration
from trajcli.planners.planner import Phase

_ON_LINE = 1e-10  # of a stretch's length: a point this near to the line lies on it
_PARALLEL = 1e-9  # relative: a velocity this little off the line lies on it

Solve = Callable[[WaypointProblem], Array]


def straight_stretches(points: Array) -> list[tuple[int, int]]:
    """Return the indices of the first and last point of each longest straight stretch."""
    stretches, first, last = [], 0, len(points) - 1
    while first < last:
        end = first + 1
        while end < last and _is_straight(points[first : end + 2]):
            end += 1
        stretches.append((first, end))
        first = end
    return stretches


def _is_straight(points: Array) -> bool:
    along, off = _on_line(points)
    length = np.abs(points[-1] - points[0]).max()
    return bool((np.diff(along) > 0).all() and np.abs(off).max() <= _ON_LINE * length)


def _on_line(points: Array) -> tuple[Array, Array]:
    """Return how far along the line from first to last each point lies, from 0 to 1, and how far off."""
    line = points[-1] - points[0]
    square = float(line @ line)
    if not square:
        return np.zeros(len(points)), points - points[0]
    along = (points - points[0]) @ line / square
    return along, points - points[0] - along[:, None] * line


def straight_motion(problem: WaypointProblem, names: list[str], solve: Solve) -> tuple[PointMotion, float]:
    """Return the fastest motion along the polyline, with a stop where it turns, and a bound of its duration.

    Args:
        problem: Points, limits, and what is given at the points.
        names: Of the joints, for messages.
        solve: Finds the states (K + 1, 1, 2) of the law at points that lie within a stretch, where something
            is given there.

    Raises:
        PlanningError: When a velocity or acceleration that is given leaves the line.
    """
    laws = [_law(problem, *ends, names) for ends in straight_stretches(problem.points)]
    lower = math.fsum(shortest_duration(law)[0] for law, _ in laws)
    parts, first = [], 0
    for law, line in laws:
        parts.append(_along(problem.points[first], law, line, solve, lower))
        first += law.segments
    return joined(parts), lower


def _along(start: Array, law: WaypointProblem, line: Array, solve: Solve, total: float) -> PointMotion:
    given = law.least.any() or law.fixed[1:-1].any()
    if not given:  # the points between say nothing: the law goes past them
        direct = law.only([0, law.segments])
        motion = exact_motion(direct, direct.states, ["the common law"], total)
        times = times_at(motion.curve, law.points[1:-1, 0])
    else:
        motion = exact_motion(law, solve(law), ["the common law"], total)
        times = motion.times[1:-1]
    curve = along_line(start, line, motion.curve)
    phases = tuple(Phase(p.name, p.start, p.end) for p in motion.phases)
    return PointMotion(curve, np.concatenate([[0.0], times, [curve.duration]]), phases)


def _law(problem: WaypointProblem, first: int, last: int, names: list[str]) -> tuple[WaypointProblem, Array]:
    """Return the problem of the law of a stretch, and the displacement along it."""
    points = problem.points[first : last + 1]
    line = points[-1] - points[0]
    along, moving = _on_line(points)[0], line != 0
    states, fixed = np.zeros((len(points), 1, 2)), np.zeros((len(points), 1, 2), dtype=bool)
    fixed[[0, -1]] = True
    for k, order in np.argwhere(problem.fixed[first : last + 1].any(axis=1)).tolist():
        fixed[k, 0, order] |= problem.fixed[first + k, moving, order].any()
        rate = _rate(problem, first + k, order, line, names)
        if rate and first + k == last < problem.segments:
            raise _moves_at_turn(problem.states[first + k, :, order], first + k, order + 1, names)
        states[k, 0, order] = rate
    bounds = [bounds_along(line, limit)[None] for limit in (problem.velocity, problem.acceleration)]
    jerk, loosest = (
        (each[moving] / np.abs(line[moving])).min(keepdims=True)
        for each in (problem.jerk, problem.jerk * problem.looser)
    )
    least = problem.least[first:last]
    free = np.array([[-np.inf, np.inf]])
    law = WaypointProblem(
        along[:, None], bounds[0], bounds[1], jerk, states, fixed, least, free, loosest / jerk
    )
    return law, line


def _rate(problem: WaypointProblem, point: int, order: int, line: Array, names: list[str]) -> float:
    """Return the velocity (order 0) or acceleration (1) of the law at a point where joints give theirs."""
    values, given = problem.states[point, :, order], problem.fixed[point, :, order]
    speaking = given & (line != 0)
    rate = float((values[speaking] / line[speaking]).mean()) if speaking.any() else 0.0
    _require_along(values, rate * line, given, order + 1, point, names)
    return rate


def _require_along(
    values: Array, wanted: Array, given: NDArray[np.bool_], order: int, point: int, names: list[str]
) -> None:
    """Refuse a velocity or acceleration that leaves the line."""
    off = np.where(given, np.abs(values - wanted), 0.0)
    joint = int(off.argmax())
    if off[joint] <= _PARALLEL * np.abs(values).max():
        return
    quantity = ("velocity", "acceleration")[order - 1]
    message = (
        f"`straight` keeps to the polyline, but {quantity} {{value}} of {{joint}} at point {point} leaves it"
    )
    raise _refused(message, values, joint, order, names)


def _moves_at_turn(values: Array, point: int, order: int, names: list[str]) -> PlanningError:
    """Return the error of a velocity or acceleration that is given where the polyline turns."""
    joint = int(np.abs(values).argmax())
    quantity = ("velocity", "acceleration")[order - 1]
    message = f"`straight` stops at point {point}, where the line turns: {{joint}} has {quantity} {{value}}"
    return _refused(message, values, joint, order, names)


def _refused(message: str, values: Array, joint: int, order: int, names: list[str]) -> PlanningError:
    amounts = {"value": Amount(float(values[joint]), order, joint)}
    return PlanningError(of_joint(names[joint], message, "leave `straight` out", amounts))
