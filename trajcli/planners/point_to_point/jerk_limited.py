"""Jerk-limited motions of all joints: each by itself, all together in time, or all on one line."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from trajcli.curves.braking import braking
from trajcli.curves.operations import along_line, coast_until, hold_until, merge_breaks
from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.errors import Amount, Amounts, MissingLimitError, PlanningError, Problem, inward, of_joint
from trajcli.frozen import frozen
from trajcli.kinematics.robot import QUANTITIES, Robot
from trajcli.language.targets import MinimumDuration
from trajcli.planners.boundary_states import instant, missing_limit
from trajcli.planners.law_events import jerk_events
from trajcli.planners.planner import Event, Phase, Planned
from trajcli.planners.point_to_point.point_to_point import PointToPoint
from trajcli.planners.ruckig import (
    BoundaryProblem,
    Control,
    PhaseProfile,
    fastest,
    fastest_of,
    joined,
    together,
)
from trajcli.trajectory import State

if TYPE_CHECKING:
    from trajcli.planners.course import Course

_ROUNDING = 1e-12
_PARALLEL = 1e-12  # relative; what leaves the line by more is no rounding error


class JerkLimited(PointToPoint):
    """Fastest motion within the limits, from any state to any state, or to a velocity.

    Source: Berscheid and Kroeger, Jerk-limited Real-time Trajectory Generation with Arbitrary Target States
    (RSS 2021); Biagiotti and Melchiorri, Trajectory Planning for Automatic Machines and Robots (2008),
    section 3.4.
    """

    continuity: ClassVar[Literal[1, 2]] = 2
    stops_anywhere: ClassVar[bool] = True
    follows_jerk: ClassVar[bool] = True

    planner: Literal["jerk_limited"] = "jerk_limited"
    minimum_duration: MinimumDuration | None = None
    synchronize: Annotated[
        Literal["time", "phase", "none"],
        Field(
            description="time: all joints arrive together; phase: one law for all joints, straight in joint "
            "space; none: each joint arrives by itself."
        ),
    ] = "time"
    brake: Annotated[
        bool,
        Field(
            strict=True,
            description="Whether a start outside the velocity or acceleration limits is accepted, and "
            "brought inside first, as fast as possible.",
        ),
    ] = False

    def plan(self, start: State, robot: Robot) -> Planned:
        """Return the move to the target, or to its velocity where it has no joints.

        Raises:
            MissingLimitError: When a moving joint lacks a limit on velocity or acceleration.
            PlanningError: When no such motion exists.
        """
        request = Request(
            start=start,
            end=self._end(start),
            control="velocity" if self.to.joints is None else "position",
            synchronize=self.synchronize,
            minimum_duration=self.minimum_duration or 0.0,
            brake=self.brake,
        )
        return plan_motion(request, robot)

    @property
    def why_not_flown_by(self) -> str | None:
        """Why no motion can fly by a corner of this move; None where it can."""
        reasons = {
            "it leaves open where it ends": not self.to.gives_joints_or_pose,
            "its `minimum_duration` is given": self.minimum_duration is not None,
            "its joints arrive one by one (`synchronize: none`)": self.synchronize == "none",
            "it brings its start inside the limits first (`brake`)": self.brake,
            "it ends in motion": any(self.to.velocity or ()) or any(self.to.acceleration or ()),
        }
        return next((reason for reason, holds in reasons.items() if holds), None)

    def course(self, start: Array, robot: Robot, planned: Planned) -> Course:
        """Return the straight line in joint space to the target."""
        from trajcli.planners.course import joint_line

        return joint_line(start, np.array(self.to.joints), robot)

    def within_tool_limits(self, start: State, robot: Robot) -> Planned | None:
        """Return the fastest motion from rest to rest on a straight line in joint space.

        Raises:
            PlanningError: When there is none.
        """
        end = self._end(start)
        if self.to.joints is None or self.synchronize == "none" or not (start.at_rest and end.at_rest):
            return None
        from trajcli.language.waypoints import Waypoint
        from trajcli.planners.waypoints.time_optimal import TimeOptimal

        found = TimeOptimal(to=Waypoint(joints=self.to.joints), path="polyline").within_tool_limits(
            start, robot
        )
        if found.phase_plane is None:
            return found  # it stands
        law = found.phase_plane.law
        share = replace(law, coefficients=law.coefficients / law.piece_ends()[1][-1])
        return replace(found, law=share, via_points=None)

    def on_rows(self, start: State, robot: Robot, period: float, least: float) -> Planned | None:
        """Return the move between states of rest whose phases last whole periods."""
        end = self._end(start)
        if self.to.joints is None or self.synchronize == "none" or not (start.at_rest and end.at_rest):
            return None
        from trajcli.planners.point_to_point.whole_periods import jerk_limited_in_periods

        on_line = self.synchronize == "phase"
        return jerk_limited_in_periods(start, end, robot, period, least, on_line=on_line)

    def _end(self, start: State) -> State:
        """Return the target; under velocity control its position means nothing."""
        if self.to.joints is not None:
            return self.to.as_state()
        zero = (0.0,) * start.position.size
        return State(
            start.position, np.array(self.to.velocity or zero), np.array(self.to.acceleration or zero)
        )


@frozen
class Request:
    """Boundary states and synchronisation of a motion.

    Attributes:
        start: State at the start.
        end: State at the end; under velocity control its position means nothing.
        control: Whether the position at the end is imposed.
        synchronize: "time": all arrive together; "phase": one law on a straight line; "none": each by itself.
        minimum_duration: Seconds; 0 for none.
        brake: Whether a start outside the limits is brought inside.
    """

    start: State
    end: State
    control: Control
    synchronize: Literal["time", "phase", "none"]
    minimum_duration: float
    brake: bool = False


def plan_motion(request: Request, robot: Robot) -> Planned:
    """Return the fastest motion that fulfils the request within the robot's limits.

    Raises:
        MissingLimitError: When a moving joint lacks a limit on velocity or acceleration.
        PlanningError: When no such motion exists.
    """
    boundaries = _boundaries(request, robot)
    _require_limits(boundaries, robot)
    _require_possible_end(boundaries, robot)
    if request.synchronize == "phase" and not all(boundary.steady for boundary in boundaries):
        planned = _on_one_line(request, boundaries, robot)
    else:
        planned = _each(request, boundaries)
    if planned.curve.duration == 0:
        planned = replace(planned, curve=instant(request.start))
    planned = _with_braking(planned, request, boundaries)
    if request.control == "position":
        return planned
    end = State(planned.curve.piece_ends()[1][-1], request.end.velocity, request.end.acceleration)
    # to where a velocity is reached fastest, another path may lead a little faster
    reason = "the move leaves its end position open"
    return replace(planned, end=end, law=None, no_lower_bound=reason)


def _with_braking(planned: Planned, request: Request, boundaries: Sequence[BoundaryProblem]) -> Planned:
    """Return the motion with what it says of a start outside the limits."""
    outside = [
        (joint, order, boundary)
        for joint, boundary in enumerate(boundaries)
        for order in _orders_outside(boundary)
    ]
    if not outside:
        return planned
    if not request.brake:
        hint = "say `brake: true` to bring the start inside first"
        kinds = {QUANTITIES[order]: hint for _, order, _ in outside}
        return replace(planned, remedies={**planned.remedies, **kinds})
    events = [_braking_event(planned, boundary, joint, order) for joint, order, boundary in outside]
    on_line = request.synchronize == "phase"
    return replace(planned, events=(*planned.events, *events), braking="line" if on_line else "each")


def _orders_outside(boundary: BoundaryProblem) -> list[int]:
    """Return the derivatives, 1 and 2, whose bounds the start breaks, or cannot help to break."""
    brakes = braking(*boundary.initial[1:], boundary.bounds)
    return [order for order, time in ((1, brakes.velocity), (2, brakes.acceleration)) if time > 0]


def _braking_event(planned: Planned, boundary: BoundaryProblem, joint: int, order: int) -> Event:
    value, (low, high) = boundary.initial[order], boundary.bounds[order - 1].tolist()
    if low <= value <= high:
        value, what = braking(*boundary.initial[1:], boundary.bounds).fastest, "cannot but reach"
    else:
        what = "starts with"
    brakes = [phase.end for phase in planned.phases if phase.name == "brake" and phase.joint in (joint, None)]
    message = (
        f"{{joint}} {what} {QUANTITIES[order]} {{value}}, beyond its limit {{limit}}: "
        "it brakes until {time} from the start of the move"
    )
    amounts: Amounts = {
        "joint": boundary.name,
        "value": Amount(value, order, joint),
        "limit": Amount(low if value < 0 else high, order, joint),
        "time": Amount(max(brakes, default=0.0)),
    }
    return Event("braked", message, amounts=amounts)


def _each(request: Request, boundaries: Sequence[BoundaryProblem]) -> Planned:
    least = request.minimum_duration
    alone = [fastest(boundary) for boundary in boundaries]
    profiles = together(boundaries, alone, least) if request.synchronize == "time" else alone
    duration = max([least, *(profile.duration for profile in profiles)])
    phases = [phase for joint, profile in enumerate(profiles) for phase in profile.phases(joint)]
    waiting = [joint for joint, profile in enumerate(profiles) if profile.duration != duration]
    names = ["cruise" if boundary.final[1] else "rest" for boundary in boundaries]
    phases += [Phase(names[joint], profiles[joint].duration, duration, joint) for joint in waiting]
    if waiting:
        rows = enumerate(zip(boundaries, profiles, strict=True))
        curve = merge_breaks([_lasting(*row, duration, joint) for joint, row in rows])
    else:
        curve = joined(profiles)
    phases.sort(key=lambda phase: (phase.start, phase.joint or 0))
    arrivals = tuple(profile.duration for profile in alone)
    events = (*_duration_events(least, duration, max(arrivals)), *_jerk_events(boundaries))
    return Planned(curve, request.end, phases=tuple(phases), events=events, arrivals=arrivals)


def _on_one_line(request: Request, boundaries: Sequence[BoundaryProblem], robot: Robot) -> Planned:
    start, end, least = request.start, request.end, request.minimum_duration
    displacement = np.array([boundary.displacement for boundary in boundaries])
    rates = [start.velocity, end.velocity, start.acceleration, end.acceleration]
    direction = next(values for values in (displacement, *rates) if values.any())
    on_line = [rate_along(direction, values, 1 + k // 2, robot) for k, values in enumerate(rates)]
    length = 1.0 if displacement.any() else 0.0
    initial, final = (0.0, on_line[0], on_line[2]), (length, on_line[1], on_line[3])
    from trajcli.curves.turning_bound import bounds_along

    bounds = np.stack([bounds_along(direction, robot.limits.of_order(order)) for order in (1, 2, 3)])
    boundary = BoundaryProblem("the common law", initial, final, bounds, request.control, request.brake)
    _require_common_law(boundary, boundaries, direction, robot)
    alone = fastest(boundary)
    profile = fastest_of(boundary, least) if alone.duration < least else alone
    law = profile.curve()
    events = (*_duration_events(least, profile.duration, alone.duration), *_jerk_events(boundaries))
    curve = along_line(start.position, direction, law)
    return Planned(curve, end, law if length else None, tuple(profile.phases(None)), events)


def _boundaries(request: Request, robot: Robot) -> list[BoundaryProblem]:
    bounds = np.stack([robot.limits.of_order(order) for order in (1, 2, 3)], axis=1)
    states = [
        np.stack([s.position, s.velocity, s.acceleration], axis=1).tolist()
        for s in (request.start, request.end)
    ]
    rows = zip(robot.joint_names, *states, bounds, strict=True)
    return [
        BoundaryProblem(name, tuple(first), tuple(last), bound, request.control, request.brake)
        for name, first, last, bound in rows
    ]


def _lasting(
    boundary: BoundaryProblem, profile: PhaseProfile, duration: float, joint: int
) -> PiecewisePolynomial:
    """Return the curve of a joint; it keeps its end state until the others have arrived."""
    if profile.duration == duration:
        return profile.curve()
    if boundary.steady:
        return fastest_of(boundary, duration).curve()
    if not boundary.final[1] and not boundary.final[2]:
        return hold_until(profile.curve(), duration)
    if boundary.control == "velocity" and not boundary.final[2]:
        return coast_until(profile.curve(), duration)
    raise _cannot_wait(boundary, profile.duration, duration, joint)


def rate_along(direction: Array, values: Array, order: int, robot: Robot) -> float:
    """Return the rate of the law under which the joints have the given rates.

    Raises:
        PlanningError: When these are not parallel to the direction.
    """
    rate = float(values @ direction) / float(direction @ direction)
    off = np.abs(values - rate * direction)
    joint = int(off.argmax())
    if off[joint] > _PARALLEL * np.abs(values).max():
        raise _leaves_line(float(values[joint]), order, joint, robot)
    return rate


def _duration_events(least: float, duration: float, alone: float) -> list[Event]:
    """Return the event of a minimum duration that would be long enough and is exceeded."""
    if duration <= least or alone > least or not least:
        return []
    message = (
        "no motion within the limits lasts just {wanted}, the minimum duration: this one lasts {duration}"
    )
    return [
        Event("longer_than_minimum", message, amounts={"wanted": Amount(least), "duration": Amount(duration)})
    ]


def _jerk_events(boundaries: Sequence[BoundaryProblem]) -> list[Event]:
    moving = [boundary for boundary in boundaries if not boundary.steady]
    return jerk_events([boundary.name for boundary in moving], [boundary.bounds[2] for boundary in moving])


def _require_limits(boundaries: Sequence[BoundaryProblem], robot: Robot) -> None:
    """Refuse moving joints without the limits that their motion follows from.

    Without a limit on the jerk the acceleration steps, and limits itself what a motion follows from.
    """
    problems: list[Problem] = []
    if np.isfinite(robot.limits.velocity).all() and np.isfinite(robot.limits.acceleration).all():
        return
    for order in (1, 2):
        lacking = [
            joint
            for joint, boundary in enumerate(boundaries)
            if not boundary.steady
            and not np.isfinite(boundary.bounds[order - 1]).all()
            and (order == 2 or boundary.control == "position")
        ]
        if lacking:
            why, also = "to find its fastest motion", f"give the joint its own `{QUANTITIES[order]}`"
            problems += missing_limit("jerk_limited", QUANTITIES[order], lacking, robot, why, also).problems
    if problems:
        raise MissingLimitError(*problems)


def _require_possible_end(boundaries: Sequence[BoundaryProblem], robot: Robot) -> None:
    """Refuse end states that lie outside the limits, or that can only be reached from outside."""
    problems = [
        problem for joint, boundary in enumerate(boundaries) for problem in _end_problems(boundary, joint)
    ]
    if problems:
        raise PlanningError(*problems)


def _end_problems(boundary: BoundaryProblem, joint: int) -> list[Problem]:
    for order, (low, high) in enumerate(boundary.bounds[:2].tolist(), 1):
        value = boundary.final[order]
        if not low * (1 + _ROUNDING) <= value <= high * (1 + _ROUNDING):
            limit = low if value < 0 else high
            message = f"{{joint}} would end with {QUANTITIES[order]} {{value}}, beyond its limit {{limit}}"
            amounts = {
                "value": Amount(value, order, joint),
                "limit": Amount(limit, order, joint, rounded=inward(limit)),
            }
            hint = f"lower the end {QUANTITIES[order]}, or raise the limit"
            return [of_joint(boundary.name, message, hint, amounts, value=value, limit=limit)]
    begun = boundary.control == "velocity" and boundary.initial[2] * boundary.final[2] > 0
    if begun or not boundary.final[2] or boundary.done:
        return []
    return _approach_problems(boundary, joint)


def _approach_problems(boundary: BoundaryProblem, joint: int) -> list[Problem]:
    """The end acceleration a was built up from zero: before, the velocity was a |a| / (2 jerk) less."""
    velocity, acceleration = boundary.final[1:]
    before = _beyond(boundary.final, -1, boundary.bounds)
    if not before:
        return []
    limit = float(boundary.bounds[0, int(before > 0)])
    message = (
        "{joint} would end with velocity {velocity} and acceleration {acceleration}: within its "
        "jerk limit it must have moved at {before} just before, beyond its velocity limit {limit}"
    )
    amounts = {
        "velocity": Amount(velocity, 1, joint),
        "acceleration": Amount(acceleration, 2, joint),
        "before": Amount(before, 1, joint),
        "limit": Amount(limit, 1, joint, rounded=inward(limit)),
    }
    hint = "lower the end acceleration or velocity, or raise the velocity or jerk limit"
    return [of_joint(boundary.name, message, hint, amounts, value=before, limit=limit)]


def _require_common_law(
    law: BoundaryProblem, boundaries: Sequence[BoundaryProblem], direction: Array, robot: Robot
) -> None:
    """Refuse ends that each joint by itself can keep within its limits, but not with the jerk of one law."""
    ends = ((law.initial, 1, "from its start"), (law.final, -1, "before its end"))
    for k, ((_, velocity, acceleration), sign, when) in enumerate(ends):
        alone = [_beyond(b.final if k else b.initial, sign, b.bounds) for b in boundaries]
        beyond = _beyond((0.0, velocity, acceleration), sign, law.bounds)
        if not beyond or any(alone):
            continue
        share = (beyond * direction[:, None] / robot.limits.velocity).max(axis=1)
        joint = int(share.argmax())
        limit = float(robot.limits.velocity[joint, int(beyond * direction[joint] > 0)])
        message = (
            "`synchronize: phase` gives all joints one law, and within its jerk "
            f"{{joint}} would have to move at {{value}} {when}, beyond its limit {{limit}}"
        )
        value, name = float(beyond * direction[joint]), robot.joint_names[joint]
        amounts = {
            "value": Amount(value, 1, joint),
            "limit": Amount(limit, 1, joint, rounded=inward(limit)),
        }
        hint = "say `synchronize: time`"
        raise PlanningError(of_joint(name, message, hint, amounts, value=value, limit=limit))


def _beyond(state: tuple[float, float, float], sign: int, bounds: Array) -> float:
    """Return the velocity beyond its bounds to which the acceleration leads (or leads from), or 0."""
    _, velocity, acceleration = state
    reached = velocity + sign * acceleration * abs(acceleration) / (2 * float(np.abs(bounds[2]).min()))
    low, high = bounds[0].tolist()
    return 0.0 if low * (1 + _ROUNDING) <= reached <= high * (1 + _ROUNDING) else reached


def _leaves_line(value: float, order: int, joint: int, robot: Robot) -> PlanningError:
    message = "`synchronize: phase` keeps all joints on one straight line, "
    message += f"but {QUANTITIES[order]} {{value}} of {{joint}} leaves it"
    name, amounts = robot.joint_names[joint], {"value": Amount(value, order, joint)}
    return PlanningError(of_joint(name, message, "say `synchronize: time`", amounts, value=value))


def _cannot_wait(boundary: BoundaryProblem, arrival: float, duration: float, joint: int) -> PlanningError:
    """Return the error of a joint that arrives first and moves in its end state."""
    message = "{joint} arrives after {arrival}, moves on, and cannot wait for the others until {duration}"
    amounts = {"arrival": Amount(arrival), "duration": Amount(duration)}
    hint = "say `synchronize: time`, or let it end at rest"
    return PlanningError(of_joint(boundary.name, message, hint, amounts))
