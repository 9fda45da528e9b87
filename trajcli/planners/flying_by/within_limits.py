"""Chains that are as fast as is found, and keep all limits.

Along a straight line in joint space one variable has the same bounds everywhere, and the search is exact.
Along other paths typical bounds stand for them; how much faster or slower the exact law is between the states
that were found sets the pace of a second search.

Where a part of the motion is over a limit, its pace alone is lowered until it is not: with time scaled by f,
velocities go with f, accelerations with f^2, jerks with f^3. Where it leaves its zone, smaller borders are
tried, then a slower pace.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from importlib.util import find_spec

import numpy as np

from trajcli.curves.piecewise import Array, PiecewisePolynomial, concatenate
from trajcli.errors import PlanningError
from trajcli.findings import Finding
from trajcli.frozen import frozen
from trajcli.kinematics.robot import Robot
from trajcli.kinematics.zone import Zone, ZoneAround
from trajcli.limits.parts import limited_part, part_findings
from trajcli.planners.boundary_states import missing_limit
from trajcli.planners.course import Course
from trajcli.planners.flying_by.between_stops import FlyByChain, chain_of
from trajcli.planners.flying_by.flown_parts import FlownPart, NoLawError, along_path, flown_parts
from trajcli.planners.flying_by.row import ChainRow, backwards, row_of
from trajcli.planners.flying_by.search import FoundStates, PathPart, begin_search
from trajcli.planners.planner import PlannedMove
from trajcli.trajectory import MoveInterval, Span, State, Trajectory

_ROUNDS = 40  # of lowering the pace of parts
_SIZES = (1.0, 0.9, 0.7, 0.5)  # of a zone, for its borders
_MORE = 1e-6  # by which a pace is lowered beyond what is needed
_LESS = 0.8  # by which it is where nobody knows how much is needed
_SLOWEST = 0.05  # a part that would be slower than this is stopped at instead
_MOST = 16  # searches
_SLOWER = 0.95  # the pace of a course that has no law between the states that were found
_EASED = 0.985  # of the pace of a bent course: states on its limits leave a law no room
_TRIES, _FASTER, _STEEPER = 6, 1.01, 1.06  # bolder states: times their speeds, times their accelerations
_ENOUGH = 1e-4  # relative: a gain that is worth another law
_CAREFUL = 0.97  # of the pace of a law from rest to rest: a state that is too fast costs a law in vain
_BASIN = 0.02  # size of grids at which the better of two searches is known
_ALIKE = 0.03  # relative: a pace that changes by less is known


@frozen
class FlownChain:
    """A chain that flies by its corners.

    Attributes:
        moves: Indices of its moves among those planned.
        chain: Its courses and zones.
        parts: Of the motion: courses and zones in turns.
        model: Duration of the fastest chain that was found, before the pace of any part was lowered, s.
    """

    moves: tuple[int, ...]
    chain: FlyByChain
    parts: tuple[FlownPart, ...]
    model: float

    @property
    def duration(self) -> float:
        """Seconds."""
        return sum(part.curve.duration for part in self.parts)


def proven_bounds(chains: Sequence[FlownChain]) -> list[float] | None:
    """Return durations, s, below which no motions of chains are; None without a proof of each, or scipy."""
    if find_spec("scipy") is None:
        return None
    from trajcli.planners.flying_by.proven_bound import is_provable, least_duration

    if not all(is_provable(each.chain) for each in chains):
        return None
    return [least_duration(each.chain, each.duration) for each in chains]


def flown(moves: Sequence[PlannedMove], corners: Sequence[Zone], robots: Sequence[Robot]) -> FlownChain:
    """Return the moves of a chain as one motion.

    Args:
        moves: As planned with stops.
        corners: The zones about the corners between them, one less.
        robots: With the limits within which each is planned.

    Raises:
        MissingLimitError: When a joint has no limit of velocity or acceleration.
        PlanningError: When no motion through the zones keeps all limits.
    """
    _require_limits(moves, robots)
    kept = [k for k, move in enumerate(moves) if _has_length(move)]
    if len(kept) < 2:
        raise PlanningError("its moves have no length")
    courses = [moves[k].planner.course(moves[k].start.position, robots[k]) for k in kept]
    zones = [ZoneAround(robots[k], np.array(moves[k].planned.end.position), corners[k]) for k in kept[:-1]]
    ends = _rates_along(courses[0], moves[0].start), np.zeros(2)
    chain, parts, model = _within_limits(courses, zones, ends)
    indices = tuple(moves[k].index for k in kept)
    return FlownChain(indices, chain, tuple(parts), model)


def _has_length(move: PlannedMove) -> bool:
    """Return whether a move goes anywhere."""
    return move.planned.curve.duration > 0


def _require_limits(moves: Sequence[PlannedMove], robots: Sequence[Robot]) -> None:
    """Refuse joints without the limits that a motion through a zone follows from.

    Raises:
        MissingLimitError: Names them.
    """
    for move, robot in zip(moves, robots, strict=True):
        for quantity in ("velocity", "acceleration"):
            lacking = np.flatnonzero(~np.isfinite(getattr(robot.limits, quantity)).all(axis=1))
            if lacking.size:
                why = "to fly by a corner"
                raise missing_limit(
                    move.planner.tag, quantity, lacking.tolist(), robot, why, "say `zone: stop`"
                )


def _rates_along(course: Course, start: State) -> Array:
    """Return sd and sdd of a course under which the joints start as they do.

    Raises:
        PlanningError: When they do not start along it.
    """
    if start.at_rest:
        return np.zeros(2)
    from trajcli.planners.point_to_point.jerk_limited import rate_along

    direction = course.curve.evaluate(0.0, 1)
    rates = (start.velocity, 1), (start.acceleration, 2)
    return np.array([rate_along(direction, values, order, course.robot) for values, order in rates])


def _within_limits(
    courses: Sequence[Course], zones: Sequence[ZoneAround], ends: tuple[Array, Array]
) -> tuple[FlyByChain, list[FlownPart], float]:
    """Return the fastest chain found whose parts keep all limits and zones, its parts, and its `model`."""
    from trajcli.planners.flying_by.straight import straightened

    count = len(zones)
    sizes = [0] * count
    paces, tempos = np.ones(count), np.ones(len(courses))
    model = np.inf
    for _ in range(_ROUNDS):
        chain = chain_of(courses, zones, ends, [_SIZES[size] for size in sizes])
        chain = replace(
            chain,
            corners=tuple(replace(c, tempo=p) for c, p in zip(chain.corners, paces.tolist(), strict=True)),
            tempos=tuple(tempos.tolist()),
        )
        straight = straightened(chain)
        joined, found = _fastest_motion(straight.joined)
        parts = straight.parts(joined)
        model = min(model, found)
        if not _lowered(chain, parts, sizes, paces, tempos):
            return chain, parts, model
        if min(paces.min(), tempos.min()) < _SLOWEST:
            break
    raise PlanningError("no motion through its zones keeps all limits")


def _fastest_motion(chain: FlyByChain) -> tuple[list[FlownPart], float]:
    """Return the parts of the fastest motion that is found, and its duration by the search, s.

    Raises:
        PlanningError: When none is found.
    """
    paces = np.array([1.0 if course.uniform else _CAREFUL * _own_pace(course) for course in chain.courses])
    eased = np.array([1.0 if course.uniform else _EASED for course in chain.courses])
    best: list[FlownPart] | None = None
    shortest, model = math.inf, math.inf
    exact = all(course.uniform for course in chain.courses)
    for _ in range(_MOST):
        row = row_of(chain, paces.tolist(), eased.tolist())
        found = (
            _found(row, chain.ends)
            if exact
            else begin_search(row.nodes, row.parts, chain.ends).until().found()
        )
        if not math.isfinite(found.duration):
            break
        try:
            parts = flown_parts(chain, row, found.states)
        except NoLawError as error:
            if best is not None:
                break
            paces[error.course] *= _SLOWER
            eased[error.course] *= _EASED
            continue
        duration, second = sum(part.curve.duration for part in parts), best is not None
        if duration < shortest:
            best, shortest, model, states = parts, duration, found.duration, found.states
        change = _paces(chain, row, found, parts)
        if second or np.abs(change - 1).max() <= _ALIKE:
            break
        paces *= change
    if best is None:
        raise PlanningError("no motion through its zones is found within the limits")
    if exact:
        return best, min(model, shortest)
    best = _bolder(chain, row, states, best)
    return best, sum(part.curve.duration for part in best)


def _bolder(chain: FlyByChain, row: ChainRow, states: Array, parts: list[FlownPart]) -> list[FlownPart]:
    """Return the parts of a faster motion, as long as bolder states at the borders of bent paths have one.

    What bends of a path take of the jerk is known at its borders alone: the search is careful there.
    """
    bent = np.repeat([not course.uniform for course in chain.courses], 2)
    bent[[0, -1]] = False
    shortest = sum(part.curve.duration for part in parts)
    for _ in range(_TRIES):
        states = np.where(bent[:, None], states * [_FASTER, _STEEPER], states)
        try:
            other = flown_parts(chain, row, states)
        except PlanningError:
            break
        duration = sum(part.curve.duration for part in other)
        if duration > shortest * (1 - _ENOUGH):
            break
        parts, shortest = other, duration
    return parts


def _found(row: ChainRow, ends: tuple[Array, Array]) -> FoundStates:
    """Return the better of what is found from the start and from the end: the way back takes as long."""
    mirror = np.array([1.0, -1.0])
    back = backwards(row)
    forward = begin_search(row.nodes, row.parts, ends).until(_BASIN)
    other = begin_search(back.nodes, back.parts, (ends[1] * mirror, ends[0] * mirror)).until(_BASIN)
    if forward.best.duration <= other.best.duration:
        return forward.until().found()
    found = other.until().found()
    return FoundStates(found.states[::-1] * mirror, found.duration)


def _own_pace(course: Course) -> float:
    """Return by what the fastest law from rest to rest along a course is faster than by typical bounds."""
    ends, stretch = np.zeros((2, 2)), (0.0, course.length)
    part = PathPart(course.typical_bounds(*stretch), course.length)
    expected = float(part.durations(ends[:1], ends[1:])[0, 0])
    return expected / along_path(course, stretch, ends, 1.0).curve.duration


def _paces(chain: FlyByChain, row: ChainRow, found: FoundStates, parts: Sequence[FlownPart]) -> Array:
    """Return by what the law of each course is faster than the search took it for."""
    changes = np.ones(len(chain.courses))
    for k, course in enumerate(chain.courses):
        if not course.uniform:
            first, last = found.states[2 * k : 2 * k + 1], found.states[2 * k + 1 : 2 * k + 2]
            expected = float(row.parts[2 * k].durations(first, last)[0, 0])
            changes[k] = expected / parts[2 * k].curve.duration
    return changes


def _lowered(
    chain: FlyByChain, parts: Sequence[FlownPart], sizes: list[int], paces: Array, tempos: Array
) -> bool:
    """Lower the pace of parts that are over a limit, and the size of zones that are left.

    Returns:
        Whether there was any.
    """
    changed = False
    for number, findings in enumerate(_findings(chain, parts)):
        if not findings:
            continue
        changed = True
        k, in_zone = divmod(number, 2)
        row = paces if in_zone else tempos
        factors = [finding.factor for finding in findings]
        if None not in factors:
            row[k] /= max(f for f in factors if f is not None) * (1 + _MORE)
        elif in_zone and sizes[k] + 1 < len(_SIZES):
            sizes[k] += 1
        else:
            row[k] *= _LESS
    return changed


def _findings(chain: FlyByChain, parts: Sequence[FlownPart]) -> list[list[Finding]]:
    """Return what is wrong with each part."""
    robot = chain.courses[0].robot
    curve = concatenate([part.curve for part in parts])
    ends = np.cumsum([part.curve.duration for part in parts])
    starts = np.concatenate([[0.0], ends[:-1]])
    spans = tuple(
        Span(k, "zone" if k % 2 else "course", start, end, 2, robot.payload)
        for k, (start, end) in enumerate(zip(starts.tolist(), ends.tolist(), strict=True))
    )
    first, last = (state_at(curve, time) for time in (curve.start, curve.end))
    trajectory = Trajectory(curve, robot.joint_names, robot.joint_types, spans, first, last)
    return [
        list(part_findings(limited_part(trajectory, span, one), one.around))
        for span, one in zip(
            spans, [move_part(chain, k, part, 0.0) for k, part in enumerate(parts)], strict=True
        )
    ]


def move_part(chain: FlyByChain, number: int, part: FlownPart, start: float) -> MoveInterval:
    """Return a part of a motion as that of a move, `start` s behind the start of the move."""
    k, in_zone = divmod(number, 2)
    end = start + part.curve.duration
    if in_zone:
        return MoveInterval(start, end, chain.corners[k].robot, None, chain.corners[k].around)
    return MoveInterval(start, end, chain.courses[k].robot, part.tool)


def state_at(curve: PiecewisePolynomial, time: float) -> State:
    """Return the state of a curve at a time."""
    side = "left" if time == curve.end else "right"
    rows = curve.evaluate_orders(np.array([time]), (0, 1, 2), side=side)[0]  # type: ignore[arg-type]
    return State(rows[0], rows[1], rows[2])
