"""Redundant arm with its last joint held: seven joints whose first six have a closed form of their own.

Where the last of seven joints is given, six are left for the six coordinates of a pose, and any family of
closed forms may fit them. Arms with an offset wrist are such: the axes of joints 1, 2 and 3 of a Panda meet
in the shoulder, those of joints 5 and 6 in the wrist, so that the six are a spherical shoulder under two axes
that meet. The distance from wrist to shoulder gives joint 4, the line between them joints 5 and 6, what is
left of the rotation the shoulder. Arms with a spherical wrist over a spherical shoulder are a special case.

The pose that the six have to reach, T', follows from T = T' M^-1 Rz(q) M with the turn of the held joint and
the fixed displacement M from its axis to the tcp.

Source: He and Liu, Analytical inverse kinematics for Franka Emika Panda: a geometrical solver for 7-DOF
manipulators with unconventional design (ICCMA 2021), here from screw axes instead of lengths.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.kinematics.dh_rows import row_pose
from trajcli.kinematics.forward import forward
from trajcli.kinematics.robot import QUANTITIES, Limits, Robot

_JOINTS = 7
_DUST = 1e-15  # what products of exact zeros and ones leave


def without_last_joint(robot: Robot) -> Robot | None:
    """Return the arm of the first six of seven joints, the last one held at zero; None for other arms."""
    if len(robot.joints) != _JOINTS or robot.joint_types[-1] != "revolute":
        return None
    limits = Limits(**{name: getattr(robot.limits, name)[:-1] for name in QUANTITIES})
    flange = replace(robot, joints=robot.joints[:-1], limits=limits, tool=np.eye(4))
    zero = np.zeros(_JOINTS)
    tool = np.linalg.inv(forward(flange, zero[:-1])) @ forward(robot, zero)
    nearest = np.round(tool)
    return replace(flange, tool=np.where(np.abs(tool - nearest) < _DUST, nearest, tool))


def poses_for_the_others(robot: Robot, poses: Array, last: Array) -> Array:
    """Return the poses (..., N, 4, 4) that the arm without its last joint reaches with that joint at `last`.

    Args:
        robot: An arm whose last joint turns.
        poses: T_world_tcp, shape (N, 4, 4).
        last: Shape (..., N), rad.
    """
    fixed, along, across = _parts_of_change(robot)
    change = np.cos(last)[..., None, None] * along + np.sin(last)[..., None, None] * across + fixed
    return np.asarray(poses @ change)


@lru_cache(maxsize=16)
def _parts_of_change(robot: Robot) -> tuple[Array, Array, Array]:
    """Return what is fixed, times the cosine and times the sine of the last joint, each (4, 4)."""
    last, tip = robot.joints[-1], robot.tool
    if robot.convention == "standard":
        tip = row_pose((0.0, 0.0, last.a, last.alpha, 0.0)) @ tip
    back = np.linalg.inv(tip)
    turning, quarter = np.diag([1.0, 1.0, 0.0, 0.0]), np.zeros((4, 4))
    quarter[0, 1], quarter[1, 0] = 1.0, -1.0
    return back @ (np.eye(4) - turning) @ tip, back @ turning @ tip, back @ (last.sign * quarter) @ tip
