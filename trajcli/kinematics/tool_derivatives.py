"""Derivatives of the tool's position and of its angular velocity, in one pass along the chain.

A direction z of a link that turns by w has z' = w x z. The vector r from the axis of a joint to that of the
next one turns with the link between them, and slides by u = z qd where the joint is prismatic:
r' = w x r + u. Further derivatives follow by the rule of Leibniz.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import comb

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.kinematics.columns import ZERO, Entry, VectorEntries, advance, cross, minus, plus
from trajcli.kinematics.robot import Robot
from trajcli.kinematics.serial_chain import blocks, configurations, links_of, travel

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
