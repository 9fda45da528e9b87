"""Majorants of the tool: bounds of its position's and orientation's derivatives from those of the joints.

Let u_i(r) bound what joint i does within r of any time of a piece: its coefficients bound |q_i^(m)| / m!. A
rotation about the axes of joints 1 to k is then bounded, coefficient by coefficient, by exp(u_1 + ... + u_k),
because every factor of it is an exponential; and so is a link that is turned by them.

Source: the method of majorants, as in Krantz and Parks (2002), section 1.3.
"""

from __future__ import annotations

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.geometry.power_series import series_exponential, series_product
from trajcli.kinematics.forward import link_poses
from trajcli.kinematics.robot import Robot


def majorants(robot: Robot, start: Array, rising: Array) -> tuple[Array, Array]:
    """Return bounds of |p^(k)| / k! and |w^(k)| / k! of the tcp on whole pieces, each (order + 1, P).

    p is the position, against that of the base; w the angular velocity, whose last entry is left 0.

    Args:
        robot: The arm.
        start: Joint values (P, n) at the beginning of the pieces.
        rising: From `growth` of power series, (order + 1, P, n).
    """
    links = np.linalg.norm(np.diff(link_poses(robot, start)[..., :3, 3], axis=1), axis=2)
    position, spin = np.zeros(rising.shape[:2]), np.zeros(rising.shape[:2])
    angle = np.zeros(rising.shape[:2])
    rotation = series_exponential(angle)
    orders = np.arange(1.0, len(rising))[:, None]
    for i, joint in enumerate(robot.joints):
        joint_growth = rising[:, :, i]
        lever = np.zeros(joint_growth.shape)
        lever[0] = links[:, i]
        if joint.type == "prismatic":
            lever += joint_growth
        else:
            spin[:-1] += series_product(joint_growth[1:] * orders, rotation[:-1])
            angle[1:] += joint_growth[1:]
            rotation = series_exponential(angle)
        position += series_product(lever, rotation)
    return position + links[:, -1] * rotation, spin
