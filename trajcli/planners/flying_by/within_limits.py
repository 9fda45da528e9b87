"""Chains that are as fast as is found, and keep all limits.

Where a part of the motion is over a limit, its pace alone is lowered until it is not. Where the tool is over
a limit in a zone, that derivative of the joints alone is lowered, or the pace, whichever looks faster. Where
it leaves its zone, smaller borders are tried, then a slower pace.

Lines in joint space that go on in the same direction under the same limits are one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from importlib.util import find_spec

import numpy as np

from trajcli.curves.operations import cut, times_at
from trajcli.curves.piecewise import Array
from trajcli.errors import PlanningError
from trajcli.frozen import frozen
from trajcli.kinematics.robot import QUANTITIES, Robot
from trajcli.kinematics.zone import Zone, ZoneAround
from trajcli.planners.boundary_states import missing_limit
from trajcli.planners.course import Course, joint_line
from trajcli.planners.flying_by.between_stops import FlyByChain, chain_of
from trajcli.planners.flying_by.flown_parts import CourseLaws, FlownPart, findings_of
from trajcli.planners.flying_by.motion_search import POWERS, MotionSearch, duration_of, with_shares
from trajcli.planners.planner import PlannedMove
from trajcli.trajectory import State

_ROUNDS = 40  # of lowering the pace of parts
_SIZES = (1.0, 0.9, 0.7, 0.5, 0.3, 0.15)  # of a zone, for its borders
_MORE, _MUCH_MORE = 1e-6, 1e-2  # beyond what is needed, at first and at last
_LESS = 0.8  # where nobody knows how much is needed
_SLOWEST = 0.05  # slower parts are stopped at instead
_PARALLEL = 1e-12  # relative: a direction that differs by less is the same


@frozen
class StraightenedChain:
    """A chain with one line in the place of several that follow each other straight on.

    Attributes:
        chain: As it is given.
        joined: With one line for each group.
        groups: First and last course of each.
    """

    chain: FlyByChain
    joined: FlyByChain
    groups: tuple[tuple[int, int], ...]

    @property
    def corners(self) -> list[int]:
        """Indices of the corners that are left among those of the given chain."""
        return [end for _, end in self.groups[:-1]]

    def parts(self, joined: Sequence[FlownPart]) -> list[FlownPart]:
        """Return the parts of the given chain: a line is cut where it is on borders of zones."""
        parts: list[FlownPart] = []
        for number, part in enumerate(joined):
            first, last = self.groups[number // 2]
            if number % 2 or first == last:
                parts.append(part)
            else:
                parts += self._cut(part, first, last)
        return parts

    def _cut(self, part: FlownPart, first: int, last: int) -> list[FlownPart]:
        law, behind, parts = part.law, part.curve, []
        if law is None:
            return [part]
        for k in range(first, last):
            sides = (k, self.chain.corners[k].left), (k + 1, self.chain.corners[k].joined)
            borders = [_on_line(self.chain, (first, last), *side) for side in sides]
            for time in times_at(law, np.array(borders)).tolist():
                try:
                    before, behind = cut(behind, time)
                except ValueError:
                    raise PlanningError("a zone is passed in less time than numbers can tell") from None
                parts.append(FlownPart(before.shifted(-before.start)))
        return [*parts, FlownPart(behind.shifted(-behind.start))]


def straightened(chain: FlyByChain) -> StraightenedChain:
    """Return a chain without the corners in which neither direction nor limits change."""
    groups: list[tuple[int, int]] = [(0, 0)]
    for k in range(1, len(chain.courses)):
        first = groups[-1][0]
        if _goes_on(chain.courses[k - 1], chain.courses[k]):
            groups[-1] = (first, k)
        else:
            groups.append((k, k))
    if len(groups) == len(chain.courses):
        return StraightenedChain(chain, chain, tuple(groups))
    courses = [_line(chain.courses[first : last + 1]) for first, last in groups]
    corners = [
        replace(
            chain.corners[end],
            left=_on_line(chain, groups[k], end, chain.corners[end].left),
            joined=_on_line(chain, groups[k + 1], end + 1, chain.corners[end].joined),
        )
        for k, (_, end) in enumerate(groups[:-1])
    ]
    tempos = [
        min([*chain.tempos[first : last + 1], *(corner.pace for corner in chain.corners[first:last])])
        for first, last in groups
    ]
    ends = chain.ends[0] * _on_line(chain, groups[0], 0, 1.0), chain.ends[1]  # by how much ds grows
    joined = FlyByChain(tuple(courses), tuple(corners), ends, tuple(tempos))
    return StraightenedChain(chain, joined, tuple(groups))


def _goes_on(before: Course, behind: Course) -> bool:
    """Return whether a line goes on as another one does."""
    if not (before.uniform and behind.uniform):
        return False
    one, other = (course.curve.coefficients[0, 0] for course in (before, behind))
    sizes = float(np.linalg.norm(one) * np.linalg.norm(other))
    limits = before.robot.limits, behind.robot.limits
    same = all(np.array_equal(*(getattr(each, name) for each in limits)) for name in QUANTITIES[1:])
    apart = np.abs(one / np.linalg.norm(one) - other / np.linalg.norm(other)).max()
    return same and sizes > 0 and bool(apart <= _PARALLEL)


def _shares_of_line(courses: Sequence[Course]) -> Array:
    """Return where on the line that several make each begins, and 1, (k + 1,)."""
    lengths = [float(np.linalg.norm(course.curve.coefficients[0, 0])) * course.length for course in courses]
    shares = np.concatenate([[0.0], np.cumsum(lengths)])
    return np.asarray(shares / shares[-1])


def _line(courses: Sequence[Course]) -> Course:
    if len(courses) == 1:
        return courses[0]
    last = courses[-1].curve
    return joint_line(courses[0].curve.evaluate(0.0), last.evaluate(last.end), courses[0].robot)


def _on_line(chain: FlyByChain, group: tuple[int, int], course: int, s: float) -> float:
    """Return where an s of a course is on the line of its group."""
    first, last = group
    if first == last:
        return s
    shares = _shares_of_line(chain.courses[first : last + 1])
    low, high = shares[course - first], shares[course - first + 1]
    return float(low + s / chain.courses[course].length * (high - low))


@frozen
class FlownChain:
    """A chain that flies by its corners.

    Attributes:
        moves: Indices of its moves among those planned.
        chain: Its courses and zones.
        parts: Of the motion: courses and zones in turns.
        model: Duration of the fastest chain that was found, before the pace of any part was lowered, s.
        robots: Of each course, with the limits that its move has to keep: it may be planned within others.
        stretch: How many times longer it lasts than what was found.
    """

    moves: tuple[int, ...]
    chain: FlyByChain
    parts: tuple[FlownPart, ...]
    model: float
    robots: tuple[Robot, ...]
    stretch: float = 1.0

    @property
    def duration(self) -> float:
        """Seconds."""
        return duration_of(self.parts)

    @property
    def allowed(self) -> FlyByChain:
        """The chain under the limits that its moves have to keep, with all of its zones."""
        courses = [
            replace(course, robot=robot)  # type: ignore[type-var]
            for course, robot in zip(self.chain.courses, self.robots, strict=True)
        ]
        zones = [corner.around for corner in self.chain.corners]
        return chain_of(courses, zones, self.chain.ends, [1.0] * len(zones))


def duration_within(chain: FlownChain, move: int, robot: Robot) -> float:
    """Return how long a chain lasts with other limits of one of its moves, s, found as the chain was.

    Args:
        chain: As it is flown.
        move: Index of the move among those planned.
        robot: With its limits.

    Raises:
        PlanningError: When no motion through the zones keeps all limits.
    """
    number = chain.moves.index(move)
    courses = list(chain.chain.courses)
    courses[number] = replace(courses[number], robot=robot)  # type: ignore[type-var]
    zones = [corner.around for corner in chain.chain.corners]
    return duration_of(_within_limits(courses, zones, chain.chain.ends)[1])


def second_order_bound(chain: FlownChain) -> float:
    """Return a duration, s, that no motion of a chain falls below, found without most limits of jerk."""
    from trajcli.planners.flying_by.second_order import second_order_duration

    return second_order_duration(chain.allowed, chain.duration)


def close_bound(chain: FlownChain) -> float | None:
    """Return one close to the fastest motion; None where there is no proof of a chain, or no scipy."""
    if find_spec("scipy") is None:
        return None
    from trajcli.planners.flying_by.proven_bound import is_provable, least_duration

    allowed = chain.allowed
    return least_duration(allowed, chain.duration) if is_provable(allowed) else None


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
    kept = [k for k, move in enumerate(moves) if move.planned.curve.duration > 0]
    if len(kept) < 2:
        raise PlanningError("its moves have no length")
    courses = [moves[k].planner.course(moves[k].start.position, robots[k], moves[k].planned) for k in kept]
    zones = [ZoneAround(robots[k], np.array(moves[k].planned.end.position), corners[k]) for k in kept[:-1]]
    ends = _rates_along(courses[0], moves[0].start), np.zeros(2)
    chain, parts, model = _within_limits(courses, zones, ends)
    indices = tuple(moves[k].index for k in kept)
    return FlownChain(indices, chain, tuple(parts), model, tuple(moves[k].robot for k in kept))


def _require_limits(moves: Sequence[PlannedMove], robots: Sequence[Robot]) -> None:
    """Refuse joints without the limits that a motion through a zone follows from."""
    for move, robot in zip(moves, robots, strict=True):
        for quantity in ("velocity", "acceleration"):
            lacking = np.flatnonzero(~np.isfinite(getattr(robot.limits, quantity)).all(axis=1))
            if lacking.size:
                why = "to fly by a corner", "say `zone: stop`"
                raise missing_limit(move.planner.tag, quantity, lacking.tolist(), robot, *why)


def _rates_along(course: Course, start: State) -> Array:
    """Return sd and sdd of a course under which the joints start as they do."""
    if start.at_rest:
        return np.zeros(2)
    from trajcli.planners.point_to_point.jerk_limited import rate_along

    first, bend = course.curve.evaluate_orders(np.zeros(1), (1, 2))[0]
    if bend.any() and np.isfinite(course.robot.limits.jerk).any():
        raise PlanningError("its path bends where the joints start in motion")
    rates = (start.velocity, 1), (start.acceleration, 2)
    return np.array([rate_along(first, values, order, course.robot) for values, order in rates])


def _within_limits(
    courses: Sequence[Course], zones: Sequence[ZoneAround], ends: tuple[Array, Array]
) -> tuple[FlyByChain, list[FlownPart], float]:
    """Return the fastest chain found whose parts keep limits and zones, its parts, and its `model`."""
    search: MotionSearch | None = MotionSearch(CourseLaws())
    found, errors = [], list[PlanningError]()
    while search is not None:
        try:
            found.append((*_kept(courses, zones, ends, search), search.model))
        except PlanningError as error:
            errors.append(error)
        if not search.lowered:
            break
        whole = chain_of(courses, zones, ends, [1.0] * len(zones))
        least = duration_of(found[0][1]) if found else np.inf
        search = search.by_pace(straightened(whole).joined, least)
    if not found:
        raise errors[0]
    return min(found, key=lambda each: duration_of(each[1]))


def _kept(
    courses: Sequence[Course], zones: Sequence[ZoneAround], ends: tuple[Array, Array], search: MotionSearch
) -> tuple[FlyByChain, list[FlownPart]]:
    """Return the fastest chain that a search finds whose parts keep all limits and zones, and its parts."""
    sizes, shares, tempos = [0] * len(zones), np.ones((len(zones), 3)), np.ones(len(courses))
    for number in range(_ROUNDS):
        chain = chain_of(courses, zones, ends, [_SIZES[size] for size in sizes])
        chain = replace(with_shares(chain, shares), tempos=tuple(tempos.tolist()))
        straight = straightened(chain)
        joined = search.fastest(straight.joined)
        shares[straight.corners] = search.shares
        chain = with_shares(chain, shares)
        parts = straight.parts(joined)
        more = min(_MORE * 4**number, _MUCH_MORE)
        if not _lowered(chain, parts, (sizes, shares, tempos), more):
            parts = straight.parts(search.bolder(joined))
            shares[straight.corners] = search.shares
            return with_shares(chain, shares), parts
        if min((shares ** (1 / POWERS)).min(), tempos.min()) < _SLOWEST:
            break
    raise PlanningError("no motion through its zones keeps all limits")


def _lowered(
    chain: FlyByChain, parts: Sequence[FlownPart], kept: tuple[list[int], Array, Array], more: float
) -> bool:
    """Lower the pace of parts that are over a limit, by a bit more, and the size of zones that are left."""
    changed, (sizes, shares, tempos) = False, kept
    for number, part in enumerate(parts):
        findings = findings_of(chain, number, part)
        if not findings:
            continue
        changed = True
        k, in_zone = divmod(number, 2)
        factors = [finding.factor for finding in findings if finding.factor is not None]
        if len(factors) == len(findings):
            slower = 1 / (max(factors) * (1 + more))
        elif in_zone and sizes[k] + 1 < len(_SIZES):
            sizes[k] += 1
            continue
        else:
            slower = _LESS
        if in_zone:
            shares[k] *= slower**POWERS
        else:
            tempos[k] *= slower
    return changed
