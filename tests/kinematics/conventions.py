"""Change from one Denavit-Hartenberg convention to the other, for tests of arms in both."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from trajcli.geometry.rotation import cos_sin
from trajcli.kinematics.robot import Convention, Robot


def in_convention(robot: Robot, convention: Convention) -> Robot:
    """Return the same arm in the given convention: every q has the same pose of the tcp.

    The screw a, alpha of a row moves over to the neighbouring joint. What is left over at the end of the chain goes into
    the tool (standard to modified) or into the base (modified to standard).
    """
    if convention == robot.convention:
        return robot
    joints, base, tool = robot.joints, robot.base, robot.tool
    if convention == "modified":
        screws = [(0.0, 0.0), *((joint.a, joint.alpha) for joint in joints[:-1])]
        tool = screw(joints[-1].a, joints[-1].alpha) @ tool
    else:
        screws = [*((joint.a, joint.alpha) for joint in joints[1:]), (0.0, 0.0)]
        base = base @ screw(joints[0].a, joints[0].alpha)
    moved = tuple(replace(joint, a=a, alpha=alpha) for joint, (a, alpha) in zip(joints, screws, strict=True))
    return replace(robot, joints=moved, convention=convention, base=base, tool=tool)


def screw(a: float, alpha: float) -> np.ndarray:
    """Return the slide by `a` along x and the turn by `alpha` about it."""
    c, s = cos_sin(alpha)
    return np.array([[1, 0, 0, a], [0, c, -s, 0], [0, s, c, 0], [0, 0, 0, 1.0]])


def link_transforms(robot: Robot, q: np.ndarray) -> np.ndarray:
    """Return the pose of each link's frame in the one before, shape (*batch, n, 4, 4): the DH rows by the book."""
    q = np.asarray(q, dtype=float)
    result = np.empty((*q.shape, 4, 4))
    for i, joint in enumerate(robot.joints):
        for index, value in np.ndenumerate(q[..., i]):
            slides, change = joint.type == "prismatic", joint.sign * value
            theta, d = joint.theta + (not slides) * change, joint.d + slides * change
            c, s = np.cos(theta), np.sin(theta)
            about_z = np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, d], [0, 0, 0, 1.0]])
            about_x = screw(joint.a, joint.alpha)
            result[(*index, i)] = about_z @ about_x if robot.convention == "standard" else about_x @ about_z
    return result
