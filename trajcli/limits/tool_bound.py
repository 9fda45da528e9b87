"""Bounds of the derivatives of the tool's motion for all t, from nine nodes of each piece of it."""

from __future__ import annotations

from math import perm

import numpy as np

from trajcli.curves.node_bound import NODES_DEGREE, BoundedPeak, at_nodes, node_survey
from trajcli.curves.piecewise import Array
from trajcli.geometry.power_series import growth
from trajcli.kinematics.robot import Robot
from trajcli.kinematics.tool_derivatives import tool_derivatives
from trajcli.kinematics.tool_majorants import majorants

ToolPeak = BoundedPeak
"""The largest magnitude of a vector over time."""

_CLOSE = 2.5e-7  # relative: of the remainder, and of the hull
_SMALL = 1e-3  # m/s, rad/s or by powers of s: what is smaller need not be known so well
_HALVINGS = 8


def tool_bounds(robot: Robot, breaks: Array, coefficients: Array, order: int = 2) -> tuple[ToolPeak, ...]:
    """Return the largest speed, angular speed, acceleration, angular acceleration of the tool, and so on.

    Args:
        robot: The arm.
        breaks: Of the joints' curve, (P + 1,), s.
        coefficients: Of its pieces, (degree + 1, P, n), highest power first, from the break on.
        order: Of the last derivative of the position: 3 for jerk and angular jerk, too.

    Returns:
        Two for each order.
    """
    starts, lengths = breaks[:-1], np.diff(breaks)
    long = lengths > 0
    if not long.any():
        return (ToolPeak(0.0, float(breaks[0]), 0.0, np.zeros(3)),) * (2 * order)

    def known(coefficients: Array, lengths: Array) -> tuple[Array, Array]:
        return _known(robot, coefficients, lengths, order)

    def slack(values: Array) -> Array:
        return np.asarray(_CLOSE * np.maximum(_norm(values).max(axis=(0, 1)), _SMALL))

    def hull_slack(value: float) -> float:
        return _CLOSE * max(value, _SMALL)

    pieces = starts[long], lengths[long], coefficients[:, long]
    survey = node_survey(known, pieces, slack, _HALVINGS)
    return tuple(survey.largest(function, _norm, hull_slack, least=0.0) for function in range(2 * order))


def _norm(vectors: Array) -> Array:
    return np.asarray(np.linalg.norm(vectors, axis=-1))


def _known(robot: Robot, coefficients: Array, lengths: Array, order: int) -> tuple[Array, Array]:
    """Return the vectors at the nodes (P, 9, 2 order, 3), and majorants of the ninth order (P, 2 order)."""
    rates = at_nodes(coefficients, lengths, order)
    values = tool_derivatives(robot, rates).reshape(*rates[0].shape[:2], 2 * order, 3)
    n = NODES_DEGREE + 1
    position, w = majorants(robot, rates[0][:, 0], growth(coefficients, lengths, n + order))
    highest = [
        bound
        for k in range(order)
        for bound in (perm(n + k + 1, k + 1) * position[n + k + 1], perm(n + k, k) * w[n + k])
    ]
    return values, np.stack(highest, axis=1)
