"""Bounds of the derivatives of the tool's motion for all t, from nine nodes of each piece of it.

Where limits of speed step along a path, each interval of it is bounded by itself.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import perm

import numpy as np

from trajcli.curves.node_bound import NODES_DEGREE, BoundedPeak, at_nodes, node_survey
from trajcli.curves.operations import times_at
from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.frozen import frozen
from trajcli.geometry.power_series import growth
from trajcli.kinematics.following.tool_path import SpeedLimits
from trajcli.kinematics.robot import Robot
from trajcli.kinematics.tool_derivatives import majorants, tool_derivatives

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

    def values_at_nodes(coefficients: Array, lengths: Array) -> tuple[Array, Array]:
        return _values_of(robot, coefficients, lengths, order)

    def slack(values: Array) -> Array:
        return np.asarray(_CLOSE * np.maximum(_norm(values).max(axis=(0, 1)), _SMALL))

    def hull_slack(value: float) -> float:
        return _CLOSE * max(value, _SMALL)

    pieces = starts[long], lengths[long], coefficients[:, long]
    survey = node_survey(values_at_nodes, pieces, slack, _HALVINGS)
    return tuple(survey.largest(function, _norm, hull_slack, least=0.0) for function in range(2 * order))


@frozen
class SpeedRun:
    """The tool's largest speeds over an interval of its path in which their limits are the same.

    Attributes:
        segments: The first and the last segment of the path.
        s: Where it begins and ends, m.
        times: Likewise, s.
        limits: Of speed and angular speed, m/s and rad/s; infinite for none.
        peaks: Of both, for all t.
    """

    segments: tuple[int, int]
    s: tuple[float, float]
    times: tuple[float, float]
    limits: tuple[float, float]
    peaks: tuple[ToolPeak, ToolPeak]


def speed_runs(
    robot: Robot, speeds: SpeedLimits, law: PiecewisePolynomial, curve: PiecewisePolynomial
) -> Iterator[SpeedRun]:
    """Yield the intervals of a path that a motion passes, with its largest speeds in each.

    Args:
        robot: The arm.
        speeds: Limits that step along the path.
        law: s(t), which need not go over the whole path.
        curve: The joints q(t), over the same times, with breaks where the limits step.
    """
    times = times_at(law, speeds.borders) + (curve.start - law.start)
    middles = curve.breaks[:-1] + 0.5 * curve.lengths
    edges = np.searchsorted(middles, times)
    for k in np.flatnonzero(np.diff(edges) > 0).tolist():
        low, high = edges[k : k + 2].tolist()
        peaks = tool_bounds(robot, curve.breaks[low : high + 1], curve.coefficients[:, low:high], 1)
        yield SpeedRun(
            (speeds.segments[k], speeds.segments[k + 1] - 1),
            (float(speeds.borders[k]), float(speeds.borders[k + 1])),
            (float(curve.breaks[low]), float(curve.breaks[high])),
            (float(speeds.speed[k]), float(speeds.angular_speed[k])),
            (peaks[0], peaks[1]),
        )


def _norm(vectors: Array) -> Array:
    return np.asarray(np.linalg.norm(vectors, axis=-1))


def _values_of(robot: Robot, coefficients: Array, lengths: Array, order: int) -> tuple[Array, Array]:
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
