"""From the fields of a move to the way of its tool: a line, a screw."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError
from trajcli.geometry.paths.orientation import FixedOrientation, SegmentProgress
from trajcli.geometry.paths.pose import PoseCurve
from trajcli.geometry.paths.position import SAME_PLACE, Line, Pivot, PositionCurve
from trajcli.kinematics.following.tool_path import ToolPath
from trajcli.kinematics.robot import Robot
from trajcli.language.targets import Target
from trajcli.planners.operational import Orientation, Way
from trajcli.planners.tool_orientation import orientation_along
from trajcli.planners.tool_target import ToolTarget, tool_target

if TYPE_CHECKING:
    from trajcli.geometry.paths.pose import Screw

_SAME_ANGLE = 1e-12  # rad: a rotation by less is none


def line_way(before: Array, to: Target, orientation: Orientation, robot: Robot) -> Way:
    """Return the straight way from a pose (4, 4) to a target, or the rotation in place."""
    target = tool_target(to, before, robot)
    start, end = before[:3, 3], target.pose[:3, 3]
    if np.linalg.norm(end - start) > SAME_PLACE:
        return way_of(Line(start, end), before, target, orientation, to)
    turning = orientation_along(orientation, before[:3, :3], [target], None, None)
    if turning.length <= _SAME_ANGLE:
        return _no_way(before, target, to)
    poses = PoseCurve(Pivot(start, end, turning.length), turning)
    return Way(_tool_path(poses, target), target.joints, to.configuration)


def screw_way(before: Array, to: Target, robot: Robot) -> Way:
    """Return the screw from a pose (4, 4) to a target."""
    from trajcli.geometry.paths.pose import Screw

    target = tool_target(to, before, robot)
    if target.orientation != "all":
        message = "a screw needs the whole orientation of its target"
        raise InputError(message, hint="give `rpy`, `quat_wxyz`, `matrix`, `axis_angle` or `euler`")
    screw = Screw(before, target.pose)
    if screw.in_place and screw.length <= _SAME_ANGLE:
        return _no_way(before, target, to)
    return Way(_tool_path(screw, target), target.joints, to.configuration)


def _no_way(before: Array, target: ToolTarget, to: Target) -> Way:
    """Return the way of length 0 to a target that is where the tool is."""
    poses = PoseCurve(Pivot(before[:3, 3], target.pose[:3, 3], 0.0), FixedOrientation(before[:3, :3], 0.0))
    return Way(_tool_path(poses, target), target.joints, to.configuration)


def way_of(
    place: PositionCurve, before: Array, target: ToolTarget, orientation: Orientation, to: Target | None
) -> Way:
    """Return the way along a curve from a pose (4, 4), its orientation as it is told."""
    turning = orientation_along(
        orientation, before[:3, :3], [target], place, SegmentProgress.even(place.length)
    )
    configuration = None if to is None else to.configuration
    path = _tool_path(PoseCurve(place, turning), target, orientation)
    return Way(path, target.joints, configuration)


def _tool_path(
    poses: PoseCurve | Screw, target: ToolTarget, orientation: Orientation = "axis_angle"
) -> ToolPath:
    """Return the path with what its target fixes; one that follows from the path is fixed whole."""
    fixed = "all" if orientation == "tangent" else target.orientation
    return ToolPath(poses, target.position, fixed, target.tool_axis, (target.turn,))
