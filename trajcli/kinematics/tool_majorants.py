"""Majorants of the tool: bounds of its position's and orientation's derivatives from those of the joints.

Let u_i(r) bound what joint i does within r of any time of a piece: its coefficients bound |q_i^(m)| / m!. A
rotation about the axes of joints 1 to k is then bounded, coefficient by coefficient, by exp(u_1 + ... + u_k),
because every factor of it is an exponential; and so is a link that is turned by them.

Source: the method of majorants, as in Krantz and Parks, A Primer of Real Analytic Functions (2002), section
1.3.
"""

from __future__ import annotations

from math import comb

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.kinematics.forward import link_poses
from trajcli.kinematics.robot import Robot


def growth(coefficients: Array, lengths: Array, order: int) -> Array:
    """Return bounds of |q^(m)| / m! on whole pieces, m = 0 to `order`, shape (order + 1, P, n).

    Entry 0 bounds how far q goes from where the piece begins.

    Args:
        coefficients: Of polynomials from 0 on, shape (degree + 1, P, n), highest power first.
        lengths: Of the pieces, shape (P,), above zero.
        order: Of the highest derivative.
    """
    rising = np.abs(coefficients[::-1]) * lengths[:, None] ** np.arange(len(coefficients))[:, None, None]
    rising[0] = 0.0
    chosen = np.array([[comb(j, m) for j in range(len(rising))] for m in range(order + 1)], dtype=np.float64)
    bounds = np.tensordot(chosen, rising, axes=1)
    return np.asarray(bounds / lengths[:, None] ** np.arange(order + 1)[:, None, None])


def majorants(robot: Robot, start: Array, rising: Array) -> tuple[Array, Array]:
    """Return bounds of |p^(k)| / k! and |w^(k)| / k! of the tcp on whole pieces, each (order + 1, P).

    p is the position, against that of the base; w the angular velocity, whose last entry is left 0.

    Args:
        robot: The arm.
        start: Joint values (P, n) at the beginning of the pieces.
        rising: From `growth`, (order + 1, P, n).
    """
    links = np.linalg.norm(np.diff(link_poses(robot, start)[..., :3, 3], axis=1), axis=2)
    position, spin = np.zeros(rising.shape[:2]), np.zeros(rising.shape[:2])
    angle = np.zeros(rising.shape[:2])
    rotation = _exponential(angle)
    orders = np.arange(1.0, len(rising))[:, None]
    for i, joint in enumerate(robot.joints):
        joint_growth = rising[:, :, i]
        lever = np.zeros(joint_growth.shape)
        lever[0] = links[:, i]
        if joint.type == "prismatic":
            lever += joint_growth
        else:
            spin[:-1] += _product(joint_growth[1:] * orders, rotation[:-1])
            angle[1:] += joint_growth[1:]
            rotation = _exponential(angle)
        position += _product(lever, rotation)
    return position + links[:, -1] * rotation, spin


def _product(one: Array, other: Array) -> Array:
    """Return the product of two series, shape (K, P), cut off as they are."""
    result = np.zeros(one.shape)
    for k, row in enumerate(one):
        if row.any():
            result[k:] += row * other[: len(other) - k]
    return result


def _exponential(series: Array) -> Array:
    """Return exp of a series (K, P) that begins with 0: k e_k is the sum of m s_m e_(k - m)."""
    result = np.zeros(series.shape)
    result[0] = 1.0
    slope = series * np.arange(len(series))[:, None]
    for k in range(1, len(series)):
        result[k] = (slope[1 : k + 1] * result[k - 1 :: -1][:k]).sum(axis=0) / k
    return result
