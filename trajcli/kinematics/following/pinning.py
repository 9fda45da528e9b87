"""Joints that are pinned on a path of the tool: they go evenly with s, and the others follow."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.errors import PlanningError, Problem
from trajcli.kinematics.following.follower import Follower, regular_rank
from trajcli.kinematics.following.tool_path import PinnedJoint, ToolPath
from trajcli.kinematics.robot import Robot


def with_pinned(path: ToolPath, pins: Mapping[int, float], start: Array, robot: Robot) -> ToolPath:
    """Return the path on which some joints go evenly with s to given values.

    Args:
        path: Of the tool.
        pins: Value at the end of the path by the index of the joint, rad or m.
        start: Joint values at its beginning, shape (n,).
        robot: The arm.

    Raises:
        PlanningError: When the tool goes nowhere, or what is fixed of it leaves fewer joints to be chosen.
    """
    names = ", ".join(robot.joint_names[joint] for joint in pins)
    if path.length == 0 and all(start[joint] == value for joint, value in pins.items()):
        return path
    if path.length == 0:
        hint = "go there in joint space, such as by jerk_limited"
        raise PlanningError(f"{names} cannot go evenly along a path of no length", hint=hint)
    joints = (PinnedJoint(joint, float(start[joint]), value) for joint, value in pins.items())
    pinned = replace(path, pinned=tuple(joints))
    free = start.size - _rank(path, start, robot)
    if _rank(pinned, start, robot) - _rank(path, start, robot) < len(pins):
        what = f"{len(pins)} joint{'s' * (len(pins) > 1)} cannot be pinned ({names})"
        left = f"the pose leaves {free} of {start.size} joints of {robot.name} to be chosen"
        hint = "pin fewer, or other joints, or leave a part of the pose out, such as by `direction`"
        raise PlanningError(Problem(f"{what}: {left}", hint))
    return pinned


def _rank(path: ToolPath, start: Array, robot: Robot) -> int:
    """Return how many directions of the joint values a path fixes, where the arm is regular."""
    return regular_rank(Follower(robot, path.at_s, start, np.empty((0, start.size))), 0.0)
