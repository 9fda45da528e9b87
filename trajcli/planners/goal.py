"""The coordinates of the tcp's pose that a target fixes."""

from __future__ import annotations

import math

from trajcli.kinematics.inverse.target import IkTarget, partial_target
from trajcli.planners.pose_fields import PoseFields

_UPRIGHT = 1e-9  # rad: a pitch this close to a quarter turn is one


def goal_of(fields: PoseFields) -> IkTarget:
    """Return the coordinates of the tcp's pose that a target fixes."""
    pose = fields.full_pose()
    position = pose[:3, 3] if fields.gives_position else None
    if fields.rotation_form is not None:
        return partial_target(position, rotation=pose[:3, :3])
    if fields.pitch is not None and math.pi / 2 - abs(fields.pitch) <= _UPRIGHT:
        upright = (0.0, 0.0, math.copysign(1.0, fields.pitch))  # there the elevation has no slope to follow
        return partial_target(position, direction=upright, tool_axis=fields.tool_axis or "z")
    return partial_target(
        position,
        direction=fields.direction,
        yaw=fields.yaw,
        pitch=fields.pitch,
        tool_axis=fields.tool_axis or "z",
    )
