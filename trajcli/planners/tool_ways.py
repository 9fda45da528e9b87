"""From the fields of a move to the way of its tool: a line, an arc, a screw."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError
from trajcli.geometry.arc import Arc
from trajcli.geometry.line import Line
from trajcli.geometry.orientation_curve import Fixed
from trajcli.geometry.place_curve import SAME_PLACE, Pivot, PlaceCurve
from trajcli.geometry.pose_curve import PoseCurve
from trajcli.geometry.progress import Progress
from trajcli.geometry.screw import Screw
from trajcli.kinematics.following.tool_path import ToolPath
from trajcli.kinematics.forward import forward
from trajcli.kinematics.robot import Robot
from trajcli.planners.fields import Target
from trajcli.planners.operational import Orientation, Way
from trajcli.planners.planner import Event
from trajcli.planners.tool_fields import ArcFields
from trajcli.planners.tool_orientation import orientation_along
from trajcli.planners.tool_target import ToolTarget, tool_target

_SAME_ANGLE = 1e-12  # rad: a rotation by less is none
_ALL_SIX = 6


def line_way(before: Array, to: Target, orientation: Orientation, robot: Robot) -> Way:
    """Return the straight way from a pose (4, 4) to a target, or the rotation in place."""
    target = tool_target(to, before, robot)
    start, end = before[:3, 3], target.pose[:3, 3]
    if np.linalg.norm(end - start) > SAME_PLACE:
        return _way_of(Line(start, end), before, target, orientation, to)
    turning = orientation_along(orientation, before[:3, :3], [target], None, None)
    length = turning.length if turning.length > _SAME_ANGLE else 0.0
    if length == 0:
        return Way(_tool_path(PoseCurve(Pivot(start, end, 0.0), Fixed(before[:3, :3], 0.0)), target))
    poses = PoseCurve(Pivot(start, end, length), turning)
    return Way(_tool_path(poses, target), target.joints, to.configuration)


def arc_way(before: Array, fields: ArcFields, orientation: Orientation, robot: Robot) -> Way:
    """Return the way along an arc from a pose (4, 4)."""
    target = arc_target(fields, before, robot)
    place = arc_of(fields, before, target, robot)
    way = _way_of(place, before, target, orientation, fields.to)
    return way if not place.moved > SAME_PLACE else _with_note(way, place)


def screw_way(before: Array, to: Target, robot: Robot) -> Way:
    """Return the screw from a pose (4, 4) to a target."""
    target = tool_target(to, before, robot)
    if target.orientation != "all":
        message = "a screw needs the whole orientation of its target"
        raise InputError(message, hint="give `rpy`, `quat_wxyz`, `matrix`, `axis_angle` or `euler`")
    return Way(_tool_path(Screw(before, target.pose), target), target.joints, to.configuration)


def arc_target(fields: ArcFields, before: Array, robot: Robot) -> ToolTarget:
    """Return where an arc ends; one that is given by its angle ends with the orientation it begins with."""
    if fields.to is not None:
        return tool_target(fields.to, before, robot)
    place = _by_angle(fields, before)
    pose = before.copy()
    pose[:3, 3] = place.end
    return ToolTarget(pose, (True, True, True), "all" if len(robot.joints) >= _ALL_SIX else "none")


def arc_of(fields: ArcFields, before: Array, target: ToolTarget, robot: Robot) -> Arc:
    """Return the arc from a pose (4, 4) to a target."""
    if fields.to is None:
        return _by_angle(fields, before)
    start, end = before[:3, 3], target.pose[:3, 3]
    if fields.via is not None:
        joints = fields.via.joints
        via = fields.via.full_pose() if joints is None else forward(robot, np.array(joints))
        return Arc.through(start, via[:3, 3], end)
    return Arc.around(start, np.array(fields.center), end, fields.axis)


def _by_angle(fields: ArcFields, before: Array) -> Arc:
    return Arc(
        before[:3, 3], np.array(fields.center), np.array(fields.axis), fields.angle or 0.0, fields.pitch
    )


def _way_of(
    place: PlaceCurve, before: Array, target: ToolTarget, orientation: Orientation, to: Target | None
) -> Way:
    turning = orientation_along(orientation, before[:3, :3], [target], place, Progress.even(place.length))
    configuration = None if to is None else to.configuration
    path = _tool_path(PoseCurve(place, turning), target, orientation)
    return Way(path, target.joints, configuration)


def _tool_path(
    poses: PoseCurve | Screw, target: ToolTarget, orientation: Orientation = "axis_angle"
) -> ToolPath:
    """Return the path with what its target fixes; one that follows from the path is fixed whole."""
    fixed = "all" if orientation == "tangent" else target.orientation
    return ToolPath(poses, target.position, fixed, target.tool_axis, (target.turn,))


def _with_note(way: Way, place: Arc) -> Way:
    text = f"the center of the arc was moved by {place.moved:.3g} m to fit its ends"
    return replace(way, events=(Event("moved_center", text),))
