"""A straight line of the tool, or a rotation in its place.

A screw motion of the tool: constant twist.

From the fields of a move to the way of its tool: a line, a screw.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError
from trajcli.geometry.paths.orientation import FixedOrientation, SegmentProgress
from trajcli.geometry.paths.pose import PoseCurve
from trajcli.geometry.paths.position import SAME_POINT, Line, Pivot, PositionCurve
from trajcli.kinematics.following.tool_path import ToolPath
from trajcli.kinematics.robot import Robot
from trajcli.language.numbers import refuse
from trajcli.language.targets import NamedTarget, Target
from trajcli.planners.tool_path.move import PlannedPath, ToolPathMove
from trajcli.planners.tool_path.target import (
    Orientation,
    ToolTarget,
    flaws_of_target,
    orientation_along,
    tool_target,
)

if TYPE_CHECKING:
    from trajcli.geometry.paths.pose import Screw


class LineMove(ToolPathMove):
    """Straight to the target; where only the orientation differs, the tool turns in its place.

    Source: Siciliano et al., Robotics: Modelling, Planning and Control (2009), section 4.3.
    """

    planner: Literal["line"] = "line"
    to: Annotated[NamedTarget, Field(description="Where the move ends, or the name of a point.")]

    @model_validator(mode="after")
    def _ends_at_rest(self) -> LineMove:
        flaws = list(flaws_of_target(self.to, ("to",), self.tag))
        if flaws:
            raise refuse(flaws)
        return self

    def way(self, before: Array, robot: Robot) -> PlannedPath:
        """Return the line from the pose `before` (4, 4)."""
        return line_path(before, self.to, self.orientation, robot)


class ScrewMove(ToolPathMove):
    """To the target along the one screw that leads there: translation along an axis, rotation about it.

    Source: Lynch and Park, Modern Robotics (2017), section 9.2.1.
    """

    planner: Literal["screw"] = "screw"
    to: Annotated[NamedTarget, Field(description="Where the move ends, or the name of a point.")]
    orientation: ClassVar[Literal["axis_angle"]] = "axis_angle"  # type: ignore[misc]

    @model_validator(mode="after")
    def _ends_at_rest(self) -> ScrewMove:
        flaws = list(flaws_of_target(self.to, ("to",), self.tag))
        if flaws:
            raise refuse(flaws)
        return self

    def way(self, before: Array, robot: Robot) -> PlannedPath:
        """Return the screw from the pose `before` (4, 4)."""
        return screw_path(before, self.to, robot)


_SAME_ANGLE = 1e-12  # rad: a rotation by less is none


def line_path(before: Array, to: Target, orientation: Orientation, robot: Robot) -> PlannedPath:
    """Return the straight way from a pose (4, 4) to a target, or the rotation in place."""
    target = tool_target(to, before, robot)
    start, end = before[:3, 3], target.pose[:3, 3]
    if np.linalg.norm(end - start) > SAME_POINT:
        return planned_path(Line(start, end), before, target, orientation, to)
    turning = orientation_along(orientation, before[:3, :3], [target], None, None)
    if turning.length <= _SAME_ANGLE:
        return _no_way(before, target, to)
    poses = PoseCurve(Pivot(start, end, turning.length), turning)
    return PlannedPath(_tool_path(poses, target), target.joints, to.configuration)


def screw_path(before: Array, to: Target, robot: Robot) -> PlannedPath:
    """Return the screw from a pose (4, 4) to a target."""
    from trajcli.geometry.paths.pose import Screw

    target = tool_target(to, before, robot)
    if target.orientation != "all":
        message = "a screw needs the whole orientation of its target"
        raise InputError(message, hint="give `rpy`, `quat_wxyz`, `matrix`, `axis_angle` or `euler`")
    screw = Screw(before, target.pose)
    if screw.pure_rotation and screw.length <= _SAME_ANGLE:
        return _no_way(before, target, to)
    return PlannedPath(_tool_path(screw, target), target.joints, to.configuration)


def _no_way(before: Array, target: ToolTarget, to: Target) -> PlannedPath:
    """Return the way of length 0 to a target that is where the tool is."""
    poses = PoseCurve(Pivot(before[:3, 3], target.pose[:3, 3], 0.0), FixedOrientation(before[:3, :3], 0.0))
    return PlannedPath(_tool_path(poses, target), target.joints, to.configuration)


def planned_path(
    place: PositionCurve, before: Array, target: ToolTarget, orientation: Orientation, to: Target | None
) -> PlannedPath:
    """Return the way along a curve from a pose (4, 4), its orientation as it is told."""
    turning = orientation_along(
        orientation, before[:3, :3], [target], place, SegmentProgress.even(place.length)
    )
    configuration = None if to is None else to.configuration
    path = _tool_path(PoseCurve(place, turning), target, orientation)
    return PlannedPath(path, target.joints, configuration)


def _tool_path(
    poses: PoseCurve | Screw, target: ToolTarget, orientation: Orientation = "axis_angle"
) -> ToolPath:
    """Return the path with what its target fixes; one that follows from the path is fixed whole."""
    fixed = "all" if orientation == "tangent" else target.orientation
    return ToolPath(poses, target.position, fixed, target.tool_axis, (target.turn,))
