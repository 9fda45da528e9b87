"""What moves along a path of the tool share: orientation, law, tolerance, and the arm that follows."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from pydantic import Field

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError
from trajcli.frozen import frozen
from trajcli.kinematics.robot import Robot
from trajcli.language.numbers import Model, Number
from trajcli.language.targets import Configuration
from trajcli.planners.path_law import LawSpec
from trajcli.planners.planner import Event, Planned, Planner
from trajcli.planners.point_to_point import require_rest, standstill
from trajcli.trajectory import State
from trajcli.units import Quantity

if TYPE_CHECKING:
    from trajcli.kinematics.following.motion import ToolMotion
    from trajcli.kinematics.following.tool_path import ToolPath

Orientation = Literal["axis_angle", "euler", "fixed", "tangent"]


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
class Way:
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


class OperationalMove(Planner):
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

    def way(self, before: Array, robot: Robot) -> Way:
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
        from trajcli.planners.tool_moves import check_arrival, moved_along

        require_rest(self.tag, start, robot)
        way = self.way(forward(robot, start.position), robot)
        if way.path.length == 0:
            check_arrival(way, start.position, robot)
            return standstill(start, self.law.duration or self.law.minimum_duration or 0.0)
        return moved_along(way, self.law, self.tolerance, self.tag, start.position, robot)
