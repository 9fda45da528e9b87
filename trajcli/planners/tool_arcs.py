"""From the fields of a move to the way of its tool: an arc."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.errors import Amount
from trajcli.geometry.paths.arc import Arc
from trajcli.geometry.paths.position import SAME_PLACE, PositionCurve
from trajcli.kinematics.forward import forward
from trajcli.kinematics.robot import Robot
from trajcli.planners.arc_fields import ArcFields
from trajcli.planners.operational import Orientation, Way
from trajcli.planners.planner import Event
from trajcli.planners.tool_target import ToolTarget, tool_target
from trajcli.planners.tool_ways import way_of

_ALL_SIX = 6


def arc_way(before: Array, fields: ArcFields, orientation: Orientation, robot: Robot) -> Way:
    """Return the way along an arc from a pose (4, 4)."""
    target = arc_target(fields, before, robot)
    place = arc_of(fields, before, target, robot)
    way = way_of(place, before, target, orientation, fields.to)
    return replace(way, events=notes_of([place]))


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


def notes_of(places: Iterable[PositionCurve]) -> tuple[Event, ...]:
    """Return an event for each arc whose center was moved."""
    text = "the center of the arc was moved by {by} to fit its ends"
    return tuple(
        Event("moved_center", text, amounts={"by": Amount(place.moved, 0, None, "length")})
        for place in places
        if isinstance(place, Arc) and place.moved > SAME_PLACE
    )
