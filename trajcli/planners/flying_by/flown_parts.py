"""The motion of a chain: exact laws along its paths, and all joints together through its zones."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from trajcli.curves.extrema import peaks
from trajcli.curves.hermite import hermite_coefficients
from trajcli.curves.operations import along_line, cut, merge_breaks, scale_time
from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.curves.third_order.parameterization import jerk_limited_time_optimal
from trajcli.curves.third_order.quartic_law import ReversingLawError
from trajcli.curves.time_optimal.parameterization import TimeOptimalMotion, UnsettledSpeedError, time_optimal
from trajcli.curves.time_optimal.passes import UnreachableSpeedError
from trajcli.errors import PlanningError
from trajcli.findings import Finding
from trajcli.frozen import frozen
from trajcli.kinematics.following.motion import ToolMotion
from trajcli.kinematics.robot import Limits
from trajcli.limits.kinds import limited_part, part_findings
from trajcli.planners.course import Course
from trajcli.planners.flying_by.between_stops import FlyByChain
from trajcli.planners.flying_by.chain_parts import (
    ChainPart,
    ChainRow,
    PathPart,
    joint_bounds,
    joint_rates,
    slowed,
)
from trajcli.planners.ruckig import BoundaryProblem, fastest, together
from trajcli.trajectory import MoveInterval, Span, State, Trajectory

_NEXT_TO_NOTHING = 1e-6  # of a limit: a joint that uses no more may be moved by rounding alone
_HOPELESS = 1.3  # times a limit after the first steps of a law between states
_LONGER = (1.0, 2.0, 4.0, 8.0, 16.0, 32.0)  # times what joints need, where they find no common duration
_LONGEST = 1e9  # s, of what no limit of duration is known
_SLOWER = 1e-4  # by which speeds at borders may be lower: zones are flown through from what they are
_MORE = 1e-6  # by which a law is slowed down beyond what is needed
_FAR, _FAR_SPEED = 1.6, 1.03  # times a limit, a possible speed
_SAMPLES = 9  # of a straight line, its ends included, at which bounds of its law are looked at
_CLOSE = 5e-4  # relative: a duration above that within typical bounds at which a law is fast enough
_BACKWARD = 1e-9  # of the length: a law that goes back by less stands still


@frozen
class FlownPart:
    """One part of the motion: a course between its borders, or a zone.

    Attributes:
        curve: q(t) from t = 0.
        tool: The reference of the tool along its path; None in joint space and within a zone.
        law: s(t) of a course; None within a zone.
    """

    curve: PiecewisePolynomial
    tool: ToolMotion | None = None
    law: PiecewisePolynomial | None = None


class NoLawError(PlanningError):
    """No law leads along some courses from the state at the start of each to that at its end.

    Attributes:
        failing: The courses, and the s at which the law of each fails; None where none is known.
        far: Whether limits are passed so far that states nearby have no law either.
    """

    def __init__(self, reason: str, failing: Mapping[int, float | None], far: bool = False) -> None:
        super().__init__(f"no law is found along a path between two zones: {reason}")
        self.reason, self.failing, self.far = reason, dict(failing), far


class CourseLaws:
    """Laws along courses, each of which is looked for once: chains that change keep most of their states."""

    def __init__(self) -> None:
        self._found: dict[tuple[object, ...], tuple[Course, FlownPart | NoLawError]] = {}

    def along(
        self,
        course: Course,
        index: int,
        stretch: tuple[float, float],
        states: Array,
        tempo: float,
        part: ChainPart | None = None,
    ) -> FlownPart:
        """Return the fastest motion that is found along a course from one s to another.

        Args:
            course: Any.
            index: Its number, for errors.
            stretch: From which s to which.
            states: There, (2, 2).
            tempo: As of a chain.
            part: With the bounds of the law of a straight line in joint space; None for those at that pace.

        Raises:
            NoLawError: When there is none.
        """
        if course.uniform:
            if not isinstance(part, PathPart):
                part = PathPart(slowed(course.typical_bounds(*stretch), tempo), stretch[1] - stretch[0])
            return _along_line(course, part, stretch, states, index)
        key = (id(course), index, stretch, states.tobytes(), tempo)
        if key not in self._found:  # a course that is kept shares its identity with no other
            self._found[key] = course, _law_between(course, index, stretch, states, tempo)
        found = self._found[key][1]
        if isinstance(found, NoLawError):
            raise found.with_traceback(None)
        return found


def _law_between(
    course: Course, index: int, stretch: tuple[float, float], states: Array, tempo: float
) -> FlownPart | NoLawError:
    """Return the fastest motion that is found between two states along a path, or why there is none."""
    simple, close = _within_tightest(course, index, stretch, states, tempo)
    if simple is not None and close:
        return simple
    try:
        found = along_path(course, stretch, states, tempo)
    except UnreachableSpeedError as error:
        return simple or NoLawError(str(error), {index: error.s}, error.speed > _FAR_SPEED * error.allowed)
    except UnsettledSpeedError as error:
        return simple or NoLawError(str(error), {index: error.s}, error.over > _FAR)
    except ReversingLawError as error:
        return simple or NoLawError(str(error), {index: None})
    if not _starts_in_motion(stretch, states):
        found = _within_limits(course, found)
    return found if simple is None or found.curve.duration < simple.curve.duration else simple


def _starts_in_motion(stretch: tuple[float, float], states: Array) -> bool:
    """Return whether a law begins with a chain that starts in motion: as it is told."""
    return bool(states[0, 0]) and not stretch[0]


def _within_limits(course: Course, part: FlownPart) -> FlownPart:
    """Return a motion along a course in more time, its ends too, where it is over a limit by little."""
    curve = part.curve
    findings = _findings(curve, MoveInterval(0.0, curve.duration, course.robot, part.tool), 0)
    over = max((each.factor or np.inf for each in findings), default=1.0)
    if part.law is None or over > 1 + _SLOWER or over <= 1:
        return part
    law, curve = (scale_time(each, over * (1 + _MORE)) for each in (part.law, curve))
    return FlownPart(curve, course.reference(law), law)


def _within_tightest(
    course: Course, index: int, stretch: tuple[float, float], states: Array, tempo: float
) -> tuple[FlownPart | None, bool]:
    """Return the fastest motion along a straight line within the tightest bounds of its law."""
    if not course.straight:
        return None, False
    rates = course.rates(np.linspace(*stretch, _SAMPLES))
    rows = np.stack([course.bounds(rates)(np.zeros((1, 2)))[0], course.typical_bounds(*stretch)])
    tight, typical = (PathPart(row, stretch[1] - stretch[0]) for row in slowed(rows, tempo))
    try:
        found = _along_line(course, tight, stretch, states, index)
    except PlanningError:
        return None, False
    curve = found.curve
    if _findings(curve, MoveInterval(0.0, curve.duration, course.robot, found.tool), 0):
        return None, False
    enough = float(typical.durations(states[:1], states[1:])[0, 0])
    return found, curve.duration <= enough * (1 + _CLOSE)


def flown_parts(
    chain: FlyByChain,
    row: ChainRow,
    states: Array,
    laws: CourseLaws,
    given: Mapping[int, FlownPart] | None = None,
    doubtful: Collection[int] = (),
) -> list[FlownPart]:
    """Return the parts of the motion with given states at the nodes: courses and zones in turns.

    Args:
        chain: Moves between two stops.
        row: As its nodes and parts.
        states: sd and sdd at the nodes, the ends included, (N, 2).
        laws: Of courses.
        given: Motions along courses that are known, by number.
        doubtful: Courses that are tried first: where they fail, no others are.

    Raises:
        NoLawError: When some courses have no law between their borders.
        PlanningError: When some zone has no motion.
    """
    courses, numbers = dict(given or {}), range(len(chain.courses))
    for some in ([k for k in numbers if k in doubtful], numbers):
        failed: list[NoLawError] = []
        for k in some:
            if k in courses:
                continue
            ends, course = states[2 * k : 2 * k + 2], chain.courses[k]
            try:
                courses[k] = laws.along(course, k, chain.stretch(k), ends, chain.tempos[k], row.parts[2 * k])
            except NoLawError as error:
                failed.append(error)
        if failed:
            every = {k: s for error in failed for k, s in error.failing.items()}
            raise NoLawError(failed[0].reason, every, any(error.far for error in failed))
    parts = [courses[0]]
    for k, corner in enumerate(chain.corners):
        before, behind = courses[k], courses[k + 1]
        borders = [
            np.stack([part.curve.piece_ends(order)[side][-side] for order in range(3)], axis=1)
            for part, side in ((before, 1), (behind, 0))
        ]
        names = corner.robot.joint_names
        parts += [_through(borders, joint_bounds(corner.limits), names), behind]
    return parts


def _along_line(
    course: Course, part: PathPart, stretch: tuple[float, float], states: Array, index: int
) -> FlownPart:
    """Return the fastest motion between two states along a straight line in joint space."""
    (v0, a0), (v1, a1) = states.tolist()
    begin, end = stretch
    bounds = part.bounds.reshape(3, 2)
    law = fastest(BoundaryProblem("the law", (begin, v0, a0), (end, v1, a1), bounds)).curve()
    slowest, reached = float(law.piece_ends(1)[1].min()), law.piece_ends()[1]
    beyond = max(float(reached.max()) - end, begin - float(reached.min()))
    if beyond > _BACKWARD * (end - begin) or slowest < -_BACKWARD * (end - begin) / law.duration:
        raise NoLawError("it would have to go back between its borders", {index: None})
    line, start = course.curve.coefficients[:, 0]
    return FlownPart(along_line(start, line, law), course.reference(law), law)


def along_path(course: Course, stretch: tuple[float, float], states: Array, tempo: float) -> FlownPart:
    """Return the fastest motion that is found between two states along a bent path.

    At a slower pace it is that between faster states, in more time.

    Raises:
        UnreachableSpeedError: When the speeds at the ends are too high.
        UnsettledSpeedError: When they leave no room to keep the limits.
        ReversingLawError: When there is no law between the states.
    """
    path, limits = _between(course.curve, *stretch), course.robot.limits
    (v0, a0), (v1, a1) = (states / [tempo, tempo**2]).tolist()
    further, bounds = course.constraints(path), (limits.velocity, limits.acceleration)
    moving = np.abs(path.piece_ends(1)).max(axis=(0, 1)) > 0
    if course.jerk_constraints or np.isfinite(limits.jerk[moving]).any():
        ends = {"start": (v0, a0), "end": (v1, a1)}
        solved: TimeOptimalMotion = jerk_limited_time_optimal(
            path,
            *bounds,
            limits.jerk,
            **ends,
            further=further,
            further_jerk=course.jerk_constraints,
            hopeless=_HOPELESS,
            slower=0.0 if _starts_in_motion(stretch, states) else _SLOWER,
        )
    else:
        solved = time_optimal(path, *bounds, start_velocity=v0, end_velocity=v1, further=further)
    law, curve = (scale_time(each, 1 / tempo) for each in (solved.law, solved.trajectory))
    return FlownPart(curve, course.reference(law), law)


def _between(curve: PiecewisePolynomial, low: float, high: float) -> PiecewisePolynomial:
    if low > curve.start:
        curve = cut(curve, low)[1]
    return cut(curve, high)[0] if high < curve.end else curve


def _through(ends: Sequence[Array], bounds: Array, names: Sequence[str]) -> FlownPart:
    """Return the motion of all joints, each (n, 3), through a zone; what hardly moves follows a quintic."""
    problems = [
        BoundaryProblem(name, tuple(first), tuple(last), bound.reshape(3, 2))
        for name, first, last, bound in zip(names, ends[0].tolist(), ends[1].tolist(), bounds, strict=True)
    ]
    moving = [problem for problem in problems if not _hardly_moves(problem)]
    moving = moving or problems  # the zone itself is next to nothing
    try:
        profiles = together(moving, [fastest(problem) for problem in moving])
    except PlanningError:
        slow = _slow_quintics(problems)
        if slow is None:
            raise
        return FlownPart(merge_breaks(slow))
    curves = {problem.name: profile.curve() for problem, profile in zip(moving, profiles, strict=True)}
    duration = profiles[0].duration
    every = [curves.get(problem.name) or _quintic(problem, duration) for problem in problems]
    return FlownPart(merge_breaks(every))


def _slow_quintics(problems: Sequence[BoundaryProblem]) -> list[PiecewisePolynomial] | None:
    """Return quintics of one duration within all bounds, where numbers are too small for constant jerks."""
    longest = max(_least_duration(problem) for problem in problems)
    for longer in _LONGER:
        curves = [_quintic(problem, longer * longest) for problem in problems]
        extremes = [peaks(curve, (1, 2, 3)) for curve in curves]
        if all(
            low <= float(extreme.low[0]) and float(extreme.high[0]) <= high
            for problem, orders in zip(problems, extremes, strict=True)
            for (low, high), extreme in zip(problem.bounds.tolist(), orders, strict=True)
        ):
            return curves
    return None


def _least_duration(problem: BoundaryProblem) -> float:
    """Return the fastest duration of a joint; where none is known, that at the acceleration that it has."""
    try:
        return fastest(problem).duration
    except PlanningError:
        (_, before, change), (_, behind, _) = problem.initial, problem.final
        return min(abs(behind - before) / abs(change), _LONGEST) if change else 0.0


def _hardly_moves(problem: BoundaryProblem) -> bool:
    """Return whether a joint uses next to nothing of its limits."""
    (_, speed), (_, change), _ = problem.bounds.tolist()
    rates = np.abs([problem.initial[1:], problem.final[1:]]).max(axis=0)
    still = rates[0] <= _NEXT_TO_NOTHING * speed and rates[1] <= _NEXT_TO_NOTHING * change
    return bool(still and abs(problem.displacement) <= _NEXT_TO_NOTHING * speed**2 / change)


def _quintic(problem: BoundaryProblem, duration: float) -> PiecewisePolynomial:
    start, end = (np.array(state)[:, None, None] for state in (problem.initial, problem.final))
    coefficients = hermite_coefficients(start, end, np.array([[duration]]))
    return PiecewisePolynomial(np.array([0.0, duration]), coefficients)


def zone_motion(chain: FlyByChain, number: int, states: Array) -> FlownPart:
    """Return the motion through a zone of a chain, without those along its paths.

    Args:
        chain: Moves between two stops.
        number: Of the zone.
        states: sd and sdd on its two borders, (2, 2).

    Raises:
        PlanningError: When there is none.
    """
    corner, borders = chain.corners[number], []
    sides = (chain.courses[number], corner.left), (chain.courses[number + 1], corner.joined)
    for (course, s), state in zip(sides, states, strict=True):
        position, first, second = course.curve.evaluate_orders(np.array([s]), (0, 1, 2))[0]
        rates = joint_rates(state[None], np.stack([first, second]))[0]
        borders.append(np.column_stack([position, rates]))
    return _through(borders, joint_bounds(corner.limits), corner.robot.joint_names)


def findings_of(chain: FlyByChain, number: int, part: FlownPart) -> list[Finding]:
    """Return what is wrong with a part: courses and zones are counted in turns."""
    return _findings(part.curve, move_part(chain, number, part, 0.0), number)


def _findings(curve: PiecewisePolynomial, one: MoveInterval, number: int) -> list[Finding]:
    robot = one.robot
    span = Span(number, "zone" if number % 2 else "course", curve.start, curve.end, 2, robot.payload)
    ends = state_at(curve, curve.start), state_at(curve, curve.end)
    trajectory = Trajectory(curve, robot.joint_names, robot.joint_types, (span,), *ends)
    return list(part_findings(limited_part(trajectory, span, one), one.around))


def move_part(chain: FlyByChain, number: int, part: FlownPart, start: float) -> MoveInterval:
    """Return a part of a motion as that of a move, `start` s behind the start of the move."""
    k, in_zone = divmod(number, 2)
    end = start + part.curve.duration
    if in_zone:
        return MoveInterval(start, end, chain.corners[k].robot, None, chain.corners[k].around)
    return MoveInterval(start, end, chain.courses[k].robot, part.tool)


def joint_uses(curve: PiecewisePolynomial, limits: Limits) -> Array:
    """Return what part of their limits of velocity, acceleration and jerk joints use at most, (3, n)."""
    bounds = (limits.of_order(order).T for order in (1, 2, 3))
    both = zip(peaks(curve, (1, 2, 3)), bounds, strict=True)
    return np.array([np.maximum(peak.low / low, peak.high / high) for peak, (low, high) in both])


def state_at(curve: PiecewisePolynomial, time: float) -> State:
    """Return the state of a curve at a time."""
    side = "left" if time == curve.end else "right"
    rows = curve.evaluate_orders(np.array([time]), (0, 1, 2), side=side)[0]  # type: ignore[arg-type]
    return State(rows[0], rows[1], rows[2])
