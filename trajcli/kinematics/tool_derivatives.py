"""Derivatives of the tool's position and of its angular velocity, in one pass along the chain.

A direction z of a link that turns by w has z' = w x z. The vector r from the axis of a joint to that of the
next one turns with the link between them, and slides by u = z qd where the joint is prismatic:
r' = w x r + u. Further derivatives follow by the rule of Leibniz.

Majorants bound them: let u_i(r) bound what joint i does within r of any time of a piece, so that its
coefficients bound |q_i^(m)| / m!. A rotation about the axes of joints 1 to k is then bounded, coefficient by
coefficient, by exp(u_1 + ... + u_k), because every factor of it is an exponential; and so is a link that is
turned by them.

Source: the method of majorants, as in Krantz and Parks (2002), section 1.3.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import comb

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.geometry.power_series import series_exponential, series_product
from trajcli.kinematics.columns import ZERO, Entry, VectorEntries, advance, cross, minus, plus
from trajcli.kinematics.forward import blocks, configurations, link_poses, links_of, travel
from trajcli.kinematics.robot import Robot

Derivatives = list[VectorEntries]


def tool_derivatives(robot: Robot, rates: Sequence[Array]) -> Array:
    """Return v and w of the tcp in world and their derivatives, shape (*batch, m, 2, 3).

    Row k holds the derivatives of order k + 1 of the position (m/s^(k + 1)) and of order k of the angular
    velocity (rad/s^(k + 1)).

    Args:
        robot: The arm.
        rates: q and its derivatives up to order m, each (*batch, n), rad or m by powers of s.

    Raises:
        InputError: When the robot has no geometry, or a value is not finite.

    Source: Siciliano et al. (2009), section 3.1.2, differentiated again.
    """
    links, values = links_of(robot), [configurations(robot, each) for each in rates]
    order = len(values) - 1
    result = np.zeros((values[0].size // len(links), order, 2, 3))
    for rows, block in blocks(*values):
        axes, tcp = travel(links, robot.base, robot.tool, block[0])
        ends = [*(axis.point for axis in axes[1:]), tcp.p]
        linear, angular = [ZERO] * order, [ZERO] * order
        for i, (axis, end) in enumerate(zip(axes, ends, strict=True)):
            turning = _turned(axis.direction, [ZERO] * order, angular, order)
            own = _scaled(turning, [rate[i] for rate in block[1:]])
            if not axis.prismatic:
                angular = [plus(*pair) for pair in zip(angular, own, strict=True)]
            sliding = own if axis.prismatic else [ZERO] * order
            lever = _turned(minus(end, axis.point), sliding, angular, order + 1)[1:]
            linear = [plus(*pair) for pair in zip(linear, lever, strict=True)]
        for k in range(order):
            for part, vector in enumerate((linear[k], angular[k])):
                for entry, value in enumerate(vector):
                    result[rows, k, part, entry] = value
    return result.reshape(*values[0].shape[:-1], order, 2, 3)


def _turned(vector: VectorEntries, sliding: Derivatives, angular: Derivatives, count: int) -> Derivatives:
    """Return a vector of a link and its first derivatives, `count` together."""
    found = [vector]
    for k in range(count - 1):
        change = sliding[k]
        for j in range(k + 1):
            change = advance(change, float(comb(k, j)), cross(angular[j], found[k - j]))
        found.append(change)
    return found


def _scaled(direction: Derivatives, rate: Sequence[Entry]) -> Derivatives:
    """Return the derivatives of a direction times a rate, as many as both have."""
    found: Derivatives = []
    for k in range(len(rate)):
        vector: VectorEntries = ZERO
        for j in range(k + 1):
            weight = rate[k - j] if comb(k, j) == 1 else comb(k, j) * rate[k - j]
            vector = advance(vector, weight, direction[j])
        found.append(vector)
    return found


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
