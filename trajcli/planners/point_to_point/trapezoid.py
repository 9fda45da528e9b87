"""Trapezoidal velocity: one law for all joints, or one for each."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from trajcli.curves.operations import along_line, hold_until, merge_breaks
from trajcli.curves.piecewise import Array
from trajcli.curves.trapezoid import (
    InfeasibleProfileError,
    MotionBounds,
    VelocityProfile,
    fastest_profile,
    profile_of_duration,
    profile_of_speed,
)
from trajcli.errors import Amount, PlanningError, Problem, of_joint
from trajcli.kinematics.robot import Robot
from trajcli.language.numbers import refuse
from trajcli.language.targets import Duration, JointAccelerationMagnitudes, JointSpeeds, MinimumDuration
from trajcli.planners.boundary_states import missing_limit, same_state, standstill
from trajcli.planners.planner import Phase, Planned
from trajcli.planners.point_to_point.point_to_point import PointToPoint
from trajcli.trajectory import State

_OFF = 1e-9  # relative: a velocity this little off the line is on it
_SAME_TIME = 1e-12  # relative: joints that arrive this close to each other arrive together
_STILL = 1e-15  # per s: a thousandth of what counts as a jump
_HINTS = {
    "speed": "choose a velocity inside the interval, or change the duration",
    "no_speed": "change the duration, or the deceleration that is given",
    "acceleration": "raise the acceleration, or the duration",
    "duration": "choose a duration inside the interval",
    "too_fast": "say `overshoot: true`, raise the deceleration, or start slower",
    "too_slow": "raise the acceleration, end slower, or say `overshoot: true`",
    "turns": "say `overshoot: true` and at most one of duration and velocity, or let the arm start and end "
    "in the direction of the motion",
}


class Trapezoid(PointToPoint):
    """Speed up, cruise, slow down. The acceleration steps at the ends of the ramps.

    Source: Siciliano et al., Robotics: Modelling, Planning and Control (2009), section 4.2.1.
    """

    continuity: ClassVar[Literal[1, 2]] = 1
    imposes: ClassVar[int] = 1

    planner: Literal["trapezoid"] = "trapezoid"
    duration: Duration | None = None
    velocity: JointSpeeds | None = None
    acceleration: JointAccelerationMagnitudes | None = None
    deceleration: JointAccelerationMagnitudes | None = None
    minimum_duration: MinimumDuration | None = None
    synchronize: Annotated[
        Literal["time", "none"],
        Field(
            description="time: one law for all joints, straight in joint space; "
            "none: each joint arrives by itself."
        ),
    ] = "time"
    overshoot: Annotated[
        bool,
        Field(
            strict=True, description="A start too fast to stop in time may run past the target and return."
        ),
    ] = False

    @model_validator(mode="after")
    def _not_overdetermined(self) -> Trapezoid:
        if self.duration and self.velocity and self.acceleration:
            text = "duration, velocity and acceleration together ask too much of a trapezoid"
            raise refuse([(("acceleration",), text, "leave one of the three out")])
        if self.duration and self.minimum_duration:
            raise refuse([(("minimum_duration",), "duration and minimum_duration exclude each other", None)])
        if self.duration and self.velocity and self.overshoot:
            text = "a trapezoid of given duration and velocity does not overshoot"
            raise refuse([(("overshoot",), text, "leave one of the three out")])
        return self

    def lasting(self, duration: float) -> Iterator[tuple[str, Self]]:
        """Yield what may be given so that it lasts `duration` seconds: not everything goes together."""
        full = self.velocity is not None and self.acceleration is not None
        return (pair for pair in super().lasting(duration) if not (full and pair[1].duration is not None))

    def plan(self, start: State, robot: Robot) -> Planned:
        """Return the move to the target.

        Raises:
            MissingLimitError: When the acceleration follows neither from the fields nor from the limits.
            PlanningError: When no such trapezoid exists; names the interval of what does.
        """
        end = self.to.as_state()
        wanted = self.duration or self.minimum_duration or 0.0
        if same_state(start, end) and (start.at_rest or not wanted):
            return standstill(end, wanted)
        return (
            self._together(start, end, robot) if self.synchronize == "time" else self._each(start, end, robot)
        )

    def on_rows(self, start: State, robot: Robot, period: float, least: float) -> Planned | None:
        """Return the move between states of rest whose ramps last whole periods."""
        end = self.to.as_state()
        displacement = end.position - start.position
        moving = np.flatnonzero(displacement)
        if self.synchronize == "none" or not moving.size or not (start.at_rest and end.at_rest):
            return None
        from trajcli.planners.point_to_point.whole_periods import PhasesInPeriods

        if self.duration is not None and self.velocity is not None:
            return None  # the acceleration follows from both
        speed, faster, slower = self._rates(displacement, robot)[0]
        size = np.abs(displacement[moving])
        bounds = [float((each[moving] / size).min()) for each in (speed, np.minimum(faster, slower))]
        laws = PhasesInPeriods(period, smooth=False)
        found = laws.common([1.0], [bounds], max(least, self.duration or 0.0))
        if found is None:
            return None
        count, ((_, ramp, cruise),) = found
        top = 1.0 / (period * (count - ramp))
        knots = ((ramp * period, top), (cruise * period, top), (ramp * period, 0.0))
        profile = VelocityProfile(0.0, tuple(knot for knot in knots if knot[0] > 0))
        law = profile.curve(0.0, 1.0, count * period)
        phases = tuple(Phase(*phase) for phase in profile.phases())
        return Planned(along_line(start.position, displacement, law), end, law=law, phases=phases)

    def _together(self, start: State, end: State, robot: Robot) -> Planned:
        displacement = end.position - start.position
        initial, final = (_along(displacement, state.velocity, robot) for state in (start, end))
        forward, backward = self._rates(displacement, robot)
        size = np.where(displacement == 0, np.nan, np.abs(displacement))
        law_rates = [
            MotionBounds(*(float(np.nanmin(row / size)) for row in rows)) for rows in (forward, backward)
        ]
        try:
            profile = self._profile(1.0, initial, final, law_rates[0], law_rates[1])
        except InfeasibleProfileError as error:
            joint = int(np.nanargmin(forward[0 if error.reason == "speed" else 1] / size))
            raise _infeasible(error, joint, float(size[joint]), self, robot) from None
        law = profile.curve(0.0, 1.0, self.duration)
        phases = tuple(Phase(*phase) for phase in profile.phases())
        return Planned(along_line(start.position, displacement, law), end, law=law, phases=phases)

    def _each(self, start: State, end: State, robot: Robot) -> Planned:
        displacement = end.position - start.position
        moving = (displacement != 0) | (start.velocity != 0) | (end.velocity != 0)
        forward, backward = self._rates(moving.astype(np.float64), robot)
        profiles, problems = list[VelocityProfile](), list[Problem]()
        for joint, distance in enumerate(displacement.tolist()):
            rates = [MotionBounds(*(float(row[joint]) for row in rows)) for rows in (forward, backward)]
            speeds = float(start.velocity[joint]), float(end.velocity[joint])
            try:
                profiles.append(self._profile(distance, *speeds, rates[0], rates[1]))
            except InfeasibleProfileError as error:
                problems += _infeasible(error, joint, 1.0, self, robot).problems
        if problems:
            raise PlanningError(*problems)
        duration = self.duration or max(profile.duration for profile in profiles)
        curves, arrivals = [], []
        for joint, profile in enumerate(profiles):
            last = profile.duration >= duration * (1 - _SAME_TIME)
            arrivals.append(duration if last else profile.duration)
            if end.velocity[joint] and not last:
                raise _cannot_wait(joint, profile.duration, duration, end, robot)
            ends = float(start.position[joint]), float(end.position[joint])
            curve = profile.curve(*ends, arrivals[joint])
            curves.append(curve if last else hold_until(curve, duration))
        phases = tuple(Phase(*phase, joint=j) for j, p in enumerate(profiles) for phase in p.phases())
        return Planned(merge_breaks(curves), end, phases=phases, arrivals=tuple(arrivals))

    def _profile(
        self, distance: float, initial: float, final: float, forward: MotionBounds, backward: MotionBounds
    ) -> VelocityProfile:
        """Return the profile of one variable from what the fields fix."""
        if self.duration is not None:
            if self.velocity is not None and (distance or initial or final):
                return self._of_speed(distance, initial, final, forward if distance > 0 else backward)
            return profile_of_duration(
                distance, initial, final, self.duration, forward, backward, overshoot=self.overshoot
            )
        profile = fastest_profile(distance, initial, final, forward, backward, overshoot=self.overshoot)
        least = self.minimum_duration or 0.0
        if profile.duration >= least or not (profile.duration or initial):
            return profile
        if initial == 0 and final == 0:
            return profile.stretched(least / profile.duration)
        return profile_of_duration(
            distance, initial, final, least, forward, backward, overshoot=self.overshoot
        )

    def _of_speed(
        self, distance: float, initial: float, final: float, rates: MotionBounds
    ) -> VelocityProfile:
        sign = math.copysign(1.0, distance)
        if distance == 0 or sign * initial < 0 or sign * final < 0:
            raise InfeasibleProfileError("turns")
        deceleration = rates.deceleration if self.deceleration is not None else None
        arguments = abs(distance), abs(initial), abs(final), self.duration or 0.0, rates.speed
        profile = profile_of_speed(*arguments, deceleration)
        return profile if sign > 0 else profile.mirrored()

    def _rates(self, displacement: Array, robot: Robot) -> tuple[list[Array], list[Array]]:
        """Return (speed, acceleration, deceleration), each (n,), along the displacement and against it."""
        velocity, acceleration = robot.limits.velocity, robot.limits.acceleration
        given = [
            None if v is None else np.array(v) for v in (self.velocity, self.acceleration, self.deceleration)
        ]
        slowing = given[2] if given[2] is not None else given[1]
        both = []
        for sign in (1, -1):
            back = (sign * displacement < 0)[:, None]
            speed, faster = (np.where(back, -b[:, ::-1], b)[:, 1] for b in (velocity, acceleration))
            slower = np.where(back, acceleration[:, ::-1], -acceleration)[:, 0]
            rows = zip((given[0], given[1], slowing), (speed, faster, slower), strict=True)
            both.append([limit if value is None else value for value, limit in rows])
        if self.duration is None or self.velocity is None:
            self._require_acceleration(both, displacement, robot)
        return both[0], both[1]

    def _require_acceleration(self, both: list[list[Array]], displacement: Array, robot: Robot) -> None:
        unbounded = ~np.isfinite(both[0][1:] + both[1][1:]).all(axis=0) & (displacement != 0)
        if unbounded.any():
            lacking = np.flatnonzero(unbounded).tolist()
            also = "give the move an `acceleration`, or `duration` and `velocity`"
            raise missing_limit(self.tag, "acceleration", lacking, robot, "for its ramps", also)


def _along(displacement: Array, velocity: Array, robot: Robot) -> float:
    """Return the speed of the law that has the given joint velocities."""
    square = float(displacement @ displacement)
    speed = float(velocity @ displacement) / square if square else 0.0
    off = np.abs(velocity - speed * displacement)
    if off.max() > _OFF * np.abs(velocity).max() + _STILL:
        joint = int(off.argmax())
        message = "trapezoid moves all joints along one straight line, but {velocity} of {joint} leaves it"
        hint = "say `synchronize: none`, or use jerk_limited or cubic"
        amounts = {"velocity": Amount(float(velocity[joint]), 1, joint)}
        raise PlanningError(of_joint(robot.joint_names[joint], message, hint, amounts))
    return speed


def _cannot_wait(joint: int, arrival: float, duration: float, end: State, robot: Robot) -> PlanningError:
    message = "{joint} arrives after {arrival} at {velocity} and cannot wait there until {duration}"
    amounts = {
        "arrival": Amount(arrival),
        "velocity": Amount(float(end.velocity[joint]), 1, joint),
        "duration": Amount(duration),
    }
    hint = "give the move a `duration`, end it at rest, or use jerk_limited"
    return PlanningError(of_joint(robot.joint_names[joint], message, hint, amounts))


def _infeasible(
    error: InfeasibleProfileError, joint: int, size: float, move: Trapezoid, robot: Robot
) -> PlanningError:
    """Return the error in terms of one joint."""
    amounts = dict[str, Amount]()
    reason = "no_speed" if error.reason == "speed" and not error.low < error.high else error.reason
    if error.reason in ("speed", "acceleration"):
        order = 1 if error.reason == "speed" else 2
        given = (move.velocity or (0.0,) * 12)[joint] if order == 1 else _acceleration(move, robot, joint)
        amounts |= {
            "low": Amount(error.low * size, order, joint, rounded="up"),
            "high": Amount(error.high * size, order, joint, rounded="down"),
            "given": Amount(given, order, joint),
            "duration": Amount(move.duration or 0.0),
        }
    elif error.reason == "duration":
        amounts |= {"low": Amount(error.low, rounded="up"), "high": Amount(error.high, rounded="down")}
    elif error.reason in ("too_fast", "too_slow"):
        amounts["needed"] = Amount(error.low * size, 0, joint, rounded="up")
    return PlanningError(of_joint(robot.joint_names[joint], _message(error, reason), _HINTS[reason], amounts))


def _message(error: InfeasibleProfileError, reason: str) -> str:
    unbounded = error.high == float("inf")
    return {
        "speed": "no trapezoid of {duration}: the velocity of {joint} must be above {low} "
        "and at most {high}, got {given}",
        "no_speed": "no trapezoid of {duration}: at no velocity does {joint} cover its distance, got {given}",
        "acceleration": "no trapezoid of {duration}: the acceleration of {joint} must be at least {low}, "
        "got {given}",
        "duration": "no trapezoid for {joint}: its duration must be at least {low}"
        + ("" if unbounded else " and at most {high}"),
        "too_fast": "{joint} is too fast to end in the target: it needs {needed} to slow down",
        "too_slow": "{joint} cannot reach its end velocity in time: it needs {needed} to speed up",
        "turns": "{joint} would have to turn round to start and end with the given velocities",
    }[reason]


def _acceleration(move: Trapezoid, robot: Robot, joint: int) -> float:
    if move.acceleration is not None:
        return move.acceleration[joint]
    return float(abs(robot.limits.acceleration[joint]).min())
