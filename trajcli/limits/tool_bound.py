"""Bounds of the tool's speeds and accelerations for all t, from nine nodes of each piece of its motion."""

from __future__ import annotations

import numpy as np

from trajcli.curves.node_bound import NODES_DEGREE, BoundedPeak, at_nodes, node_survey
from trajcli.curves.piecewise import Array
from trajcli.kinematics.jacobian import jacobian_dot_qd, linearisation
from trajcli.kinematics.power_series import growth
from trajcli.kinematics.robot import Robot
from trajcli.kinematics.tool_majorants import majorants

ToolPeak = BoundedPeak
"""The largest magnitude of a vector over time."""

_CLOSE = 2.5e-7  # relative: of the remainder, and of the hull
_SMALL = 1e-3  # m/s, rad/s or by s^2: what is smaller need not be known so well
_HALVINGS = 8


def tool_bounds(
    robot: Robot, breaks: Array, coefficients: Array
) -> tuple[ToolPeak, ToolPeak, ToolPeak, ToolPeak]:
    """Return the largest speed, angular speed, acceleration and angular acceleration of the tool.

    Args:
        robot: The arm.
        breaks: Of the joints' curve, (P + 1,), s.
        coefficients: Of its pieces, (degree + 1, P, n), highest power first, from the break on.
    """
    starts, lengths = breaks[:-1], np.diff(breaks)
    long = lengths > 0
    if not long.any():
        still = ToolPeak(0.0, float(breaks[0]), 0.0, np.zeros(3))
        return still, still, still, still

    def known(coefficients: Array, lengths: Array) -> tuple[Array, Array]:
        return _known(robot, coefficients, lengths)

    def slack(values: Array) -> Array:
        return np.asarray(_CLOSE * np.maximum(_norm(values).max(axis=(0, 1)), _SMALL))

    def hull_slack(value: float) -> float:
        return _CLOSE * max(value, _SMALL)

    pieces = starts[long], lengths[long], coefficients[:, long]
    survey = node_survey(known, pieces, slack, _HALVINGS)
    v, w, a, alpha = (survey.largest(function, _norm, hull_slack, least=0.0) for function in range(4))
    return v, w, a, alpha


def _norm(vectors: Array) -> Array:
    return np.asarray(np.linalg.norm(vectors, axis=-1))


def _known(robot: Robot, coefficients: Array, lengths: Array) -> tuple[Array, Array]:
    """Return v, w, a and alpha at the nodes (P, 9, 4, 3), and majorants of the ninth order (P, 4)."""
    q, qd, qdd = at_nodes(coefficients, lengths)
    slopes = linearisation(robot, q)[1]
    first = (slopes @ qd[..., None])[..., 0]
    second = (slopes @ qdd[..., None])[..., 0] + jacobian_dot_qd(robot, q, qd)
    values = np.concatenate([first, second], axis=-1).reshape(*q.shape[:2], 4, 3)
    n = NODES_DEGREE + 1
    position, w = majorants(robot, q[:, 0], growth(coefficients, lengths, n + 2))
    highest = (n + 1) * position[n + 1], w[n], (n + 1) * (n + 2) * position[n + 2], (n + 1) * w[n + 1]
    return values, np.stack(highest, axis=1)
