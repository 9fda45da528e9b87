"""Denavit-Hartenberg rows: the transform of each link, and the change from one convention to the other.

A standard row is Rz(theta) Tz(d) Tx(a) Rx(alpha), a modified one Rx(alpha) Tx(a) Rz(theta) Tz(d).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from trajcli.curves.piecewise import Array
from trajcli.geometry.pose import build
from trajcli.geometry.rotation import rotation_about
from trajcli.kinematics.chain import configurations, links_of
from trajcli.kinematics.robot import Convention, Robot


def link_transforms(robot: Robot, q: ArrayLike) -> Array:
    """Return the pose of each link's frame in the one before, shape (*batch, n, 4, 4).

    Args:
        robot: Its base and tool do not enter.
        q: Joint values (*batch, n), rad or m.

    Raises:
        InputError: When the robot has no geometry, or q has not n finite values.
    """
    links, values = links_of(robot), configurations(robot, q)
    result = np.empty((*values.shape, 4, 4))
    for i, link in enumerate(links):
        change = link.sign * values[..., i]
        theta = np.full_like(change, link.theta) if link.prismatic else change + link.theta
        joint = build(rotation_about("z", theta))
        joint[..., 2, 3] = change + link.d if link.prismatic else link.d
        result[..., i, :, :] = _screw(*link.before) @ joint @ _screw(*link.after)
    return result


def in_convention(robot: Robot, convention: Convention) -> Robot:
    """Return the same arm in the given convention: every q has the same pose of the tcp.

    The screw a, alpha of a row moves over to the neighbouring joint. What is left over at the end of the
    chain goes into the tool (standard to modified) or into the base (modified to standard), so that
    T_world_base and T_flange_tcp may change.

    Raises:
        InputError: When the robot has no geometry.
    """
    links, joints = links_of(robot), robot.joints
    if convention == robot.convention:
        return robot
    base, tool = robot.base, robot.tool
    if convention == "modified":
        screws = [(0.0, 0.0), *((joint.a, joint.alpha) for joint in joints[:-1])]
        tool = _screw(*links[-1].after) @ tool
    else:
        screws = [*((joint.a, joint.alpha) for joint in joints[1:]), (0.0, 0.0)]
        base = base @ _screw(*links[0].before)
    moved = tuple(replace(joint, a=a, alpha=alpha) for joint, (a, alpha) in zip(joints, screws, strict=True))
    return replace(robot, joints=moved, convention=convention, base=base, tool=tool)


def _screw(a: float, cosine: float, sine: float) -> Array:
    """Return the slide by `a` along x and the turn about it."""
    return np.array(
        [[1.0, 0.0, 0.0, a], [0.0, cosine, -sine, 0.0], [0.0, sine, cosine, 0.0], [0.0, 0.0, 0.0, 1.0]]
    )
