"""What moves along a path of the tool share: orientation, law, tolerance, and the arm that follows.

From a way of the tool to the planned move: law, joints, phases, and what there is to say about it.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from pydantic import Field

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError
from trajcli.frozen import frozen
from trajcli.kinematics.robot import Robot, ToolLimits
from trajcli.language.numbers import Model, Number
from trajcli.language.targets import Configuration
from trajcli.planners.planner import Event, Planned, Planner
from trajcli.planners.point_to_point.point_to_point import require_rest, standstill
from trajcli.planners.tool_path.law import LawSpec
from trajcli.planners.tool_path.target import Orientation
from trajcli.trajectory import State
from trajcli.units import Quantity

if TYPE_CHECKING:
    from trajcli.kinematics.following.motion import ToolMotion
    from trajcli.kinematics.following.tool_path import ToolPath
import numpy as np

from trajcli.errors import Amount, PlanningError, Problem
from trajcli.kinematics.following.motion import motion_along
from trajcli.kinematics.following.tolerance import Tolerance
from trajcli.planners.tool_path.follow import JointMotion, diagnosis_of_motion, followed, followed_in_time
from trajcli.planners.tool_path.law_bounds import law_over
from trajcli.trajectory import resting


class ToleranceSpec(Model):
    """How near the joints' curve must come to path and law."""

    position: Annotated[
        float,
        Number(Quantity("length"), "Of the tool's place; of its velocity a part of the peak.", above=0.0),
    ] = 1e-6
    angle: Annotated[
        float,
        Number(Quantity("angle"), "Of its orientation and of the joints, likewise.", above=0.0),
    ] = 1e-6


@frozen
class PlannedPath:
    """Where the tool shall go.

    Attributes:
        path: The poses.
        arrival: Joint values (n,) in which the target says that the arm arrives; None where it is a pose.
        configuration: Names of the branch on which it shall arrive; None where they do not matter.
        events: What was conceded.
        overlap: The motion itself where segments overlap in time; None where the law makes it from the path.
    """

    path: ToolPath
    arrival: Array | None = None
    configuration: Configuration | None = None
    events: tuple[Event, ...] = ()
    overlap: ToolMotion | None = None


class ToolPathMove(Planner):
    """A move whose tool follows a path, from rest to rest, on the branch on which it starts."""

    continuity: ClassVar[Literal[1, 2]] = 1

    orientation: Annotated[
        Orientation,
        Field(
            description="axis_angle: the shortest rotation about a fixed axis; euler: evenly in the angles "
            "in which the target is given; fixed: none; tangent: the tool keeps its attitude to the path."
        ),
    ] = "axis_angle"
    law: LawSpec = LawSpec()
    tolerance: ToleranceSpec = ToleranceSpec()

    @property
    def joins(self) -> Literal[1, 2]:
        """Acceleration joins where the law begins and ends without any."""
        return 2 if self.law.shape in ("quintic", "cycloidal", "jerk_limited") else 1

    def way(self, before: Array, robot: Robot) -> PlannedPath:
        """Return where the tool shall go from the pose `before` (4, 4).

        Raises:
            InputError: When the fields do not make a path.
            PlanningError: When there is no such path.
        """
        raise TypeError(f"{type(self).__name__} does not say where to go")

    def plan(self, start: State, robot: Robot) -> Planned:
        """Return the move along the path.

        Raises:
            InputError: When the robot has no geometry, or the fields do not make a path.
            MissingLimitError: When nothing says how fast.
            PlanningError: When there is no such path, or the arm cannot follow it; says where and why.
        """
        if robot.convention is None:
            hint = "give its joints theta, d, a and alpha"
            raise InputError(f"{robot.name} has no geometry, so its tool has no path", hint=hint)
        from trajcli.kinematics.forward import forward

        require_rest(self.tag, start, robot)
        way = self.way(forward(robot, start.position), robot)
        if way.path.length == 0:
            check_arrival(way, start.position, robot)
            return standstill(start, self.law.duration or self.law.minimum_duration or 0.0, REMEDIES)
        return moved_along(way, self.law, self.tolerance, self.tag, start.position, robot)


REMEDIES = {"acceleration_jump": "use `law: {shape: quintic}` or jerk_limited, or say limits: {jerk: null}"}
_ARRIVED = 1e-5  # rad or m: joint values that are given, and reached on the way


def moved_along(
    way: PlannedPath, spec: LawSpec, tolerance: ToleranceSpec, planner: str, start: Array, robot: Robot
) -> Planned:
    """Return the move along a way of the tool.

    Args:
        way: Where the tool goes.
        spec: How fast.
        tolerance: How near.
        planner: Tag for messages.
        start: Joint values (n,).
        robot: The arm, with the limits in force.

    Raises:
        MissingLimitError: When nothing says how fast.
        PlanningError: When the arm cannot follow; says where and why.
    """
    wanted = Tolerance(tolerance.position, tolerance.angle)
    made = _made(way, spec, wanted, planner, start, robot)
    room = max(tolerance.position, tolerance.angle)
    diagnosis_of_motion(robot, made.motion).refuse_limits(made.curve, room)
    end = made.curve.piece_ends()[1][-1]
    check_arrival(way, end, robot)
    return Planned(
        made.curve,
        resting(end),
        phases=made.phases,
        tool=made.motion,
        wanted_speed=_wanted_speed(spec, robot.limits.tcp, in_place=made.motion.in_place),
        remedies=REMEDIES,
        events=(*way.events, *made.events),
    )


def _wanted_speed(spec: LawSpec, limits: ToolLimits, *, in_place: bool) -> float | None:
    """Return the speed along the path that is asked for, m/s, or rad/s in place; None where none is."""
    given, limit = (spec.angular_speed, limits.angular_speed) if in_place else (spec.speed, limits.speed)
    speed = limit if given is None else given
    return None if math.isinf(speed) or spec.duration is not None else speed


def _made(
    way: PlannedPath, spec: LawSpec, tolerance: Tolerance, planner: str, start: Array, robot: Robot
) -> JointMotion:
    if way.overlap is not None:
        return JointMotion(followed_in_time(robot, way.overlap, start), way.overlap)
    if spec.shape == "time_optimal":
        from trajcli.planners.tool_path.time_optimal import fastest_along

        return fastest_along(followed(robot, way.path, start), spec, tolerance, planner)
    law = law_over(way.path, spec, robot.limits.tcp, planner)
    motion = motion_along(way.path, law.law, law.breaks, tolerance, law.ruled_by)
    return JointMotion(followed(robot, way.path, start).by_time(motion), motion, law.phases)


def check_arrival(way: PlannedPath, end: Array, robot: Robot) -> None:
    """Refuse to arrive in other joint values than the target names, or on another branch.

    Raises:
        PlanningError: Names the joint or the branch.
    """
    if way.arrival is not None and np.abs(end - way.arrival).max() > _ARRIVED:
        joint = int(np.abs(end - way.arrival).argmax())
        name = robot.joint_names[joint]
        message = (
            f"the tool arrives where the target says, but with {name} at {{value}} instead of {{wanted}}"
        )
        hint = "on a path the arm keeps its branch: go there in joint space, or give the target as a pose"
        amounts = {
            "value": Amount(float(end[joint]), 0, joint),
            "wanted": Amount(float(way.arrival[joint]), 0, joint),
        }
        raise PlanningError(Problem(message, hint, joint=name, amounts=amounts))
    wanted = {} if way.configuration is None else way.configuration.model_dump(exclude_none=True)
    if not wanted:
        return
    from trajcli.kinematics.inverse.solve import solve

    target = way.path.by_place(np.array([way.path.length]), "left").target()
    found = solve(robot, target, end[None])
    apart = np.where(found.valid[0], np.abs(found.joints[0] - end).max(axis=-1), np.inf)
    names = found.names[int(apart.argmin())]
    if any(getattr(names, choice) != word for choice, word in wanted.items()):
        message = f"the arm arrives in the configuration {names}, not {' '.join(wanted.values())}"
        hint = "on a path the arm keeps its branch: start in that configuration, or leave it out"
        raise PlanningError(message, hint=hint)
