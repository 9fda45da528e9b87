"""Bounds of the tool for all t, from nine nodes of each piece: derivatives, distance from its path.

Where limits of speed step along a path, each interval of it is bounded by itself.

The path: on a piece on which neither the joints' polynomials nor the law or the path change, e(t) = p(q(t)) -
P(s(t)) is smooth. It is known at nine nodes, and its ninth derivative is at most that of p, by the majorants
of the tool, and that of P, by the majorants of the path.

Orientations an angle a apart are compared by the difference of their matrices, whose Frobenius norm is
2 sqrt(2) sin(a / 2), or of an axis of the tool, whose norm is 2 sin(a / 2). Majorants of rotations bound the
operator norm, which no column is longer than: three columns are together at most sqrt(3) times as long.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from math import perm

import numpy as np

from trajcli.curves.node_bound import NODES_DEGREE, BoundedPeak, at_nodes, node_survey
from trajcli.curves.operations import times_at
from trajcli.curves.piecewise import Array, PiecewisePolynomial, distinct, taylor_shift
from trajcli.frozen import frozen
from trajcli.geometry.power_series import growth, series_exponential
from trajcli.geometry.rotation import AXES
from trajcli.kinematics.following.tool_path import SpeedLimits, ToolPath
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.joint_turns import revolute
from trajcli.kinematics.robot import Robot
from trajcli.kinematics.tool_derivatives import majorants, tool_derivatives
from trajcli.limits.kinds import LimitedMove

ToolPeak = BoundedPeak
"""The largest magnitude of a vector over time."""

_CLOSE = 2.5e-7  # relative: of the remainder, and of the hull
_SMALL = 1e-3  # m/s, rad/s or by powers of s: what is smaller need not be known so well
_HALVINGS = 8
_NEAR = 1e-3  # of the tolerance: of the remainder, and of the hull
_SAME_TIME = 1e-12  # of the time since the start of the whole: breaks of the joints' curve and of the law
_ORDER = NODES_DEGREE + 1

Pieces = tuple[Array, Array, Array]


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


def path_bounds(move: LimitedMove) -> tuple[BoundedPeak | None, BoundedPeak | None]:
    """Return the largest distance of the tool from its path, m, and the largest angle between them, rad.

    Args:
        move: Along a path; times of the peaks count from its start.

    Returns:
        None where nothing is proven: where segments overlap in time, the path has no majorant, a yaw or a
        pitch is fixed, or 8 halvings of the pieces do not bring the bound to within 0.002 of the tolerance.
    """
    robot, motion = move.robot, move.motion
    pieces = None if motion is None or motion.overlaps else _common_pieces(move)
    if pieces is None or robot is None or motion is None or motion.path is None:
        return None, None
    path, tolerance = motion.path, motion.tolerance
    finite = [bool(np.isfinite(bounds).all()) for bounds in _of_path(path, *pieces[1:])]
    kind = path.orientation
    bounded = finite[0], kind == "none" or (finite[1] and kind not in ("yaw", "pitch"))
    if not any(bounded):
        return None, None
    close = _NEAR * np.array([tolerance.position, tolerance.angle])
    survey = node_survey(partial(_values_at_nodes, robot, path), pieces, lambda _: close, _HALVINGS)

    def peak(function: int) -> BoundedPeak | None:
        near = float(close[function])
        found = survey.largest(function, _norm, lambda _: near, least=0.0)
        return found if bounded[function] and found.upper_bound <= found.value + 2 * near else None

    distance, chord = peak(0), peak(1)
    return distance, chord and replace(
        chord, value=_angle(chord.value), upper_bound=_angle(chord.upper_bound)
    )


def _angle(chord: float) -> float:
    return float(2.0 * np.arcsin(min(chord / 2.0, 1.0)))


def _common_pieces(move: LimitedMove) -> Pieces | None:
    """Return pieces of the joints' curve with s(t) beside them; None where curve and law differ in time."""
    motion, span = move.motion, move.span
    if motion is None or not span.duration > 0:
        return None
    breaks, coefficients = move.pieces
    breaks, law = breaks - move.trajectory.curve.start - span.start, motion.law
    apart, end = _SAME_TIME * max(abs(span.start), abs(span.end)), span.duration
    if max(abs(breaks[0]), abs(breaks[-1] - end), abs(law.end - end)) > apart:
        return None
    edges = distinct(np.concatenate([breaks, motion.breaks, law.breaks]))
    edges = edges[np.append(True, np.diff(edges) > apart)]
    middles = (edges[:-1] + edges[1:]) / 2
    columns = []
    for own, rows in ((breaks, coefficients), (law.breaks, law.coefficients)):
        piece = np.clip(np.searchsorted(own, middles, "right") - 1, 0, own.size - 2)
        columns.append(taylor_shift(rows[:, piece], (edges[:-1] - own[piece])[:, None]))
    degree = max(map(len, columns))
    filled = [np.pad(each, ((degree - len(each), 0), (0, 0), (0, 0))) for each in columns]
    return edges[:-1], np.diff(edges), np.concatenate(filled, axis=2)


def _of_path(path: ToolPath, lengths: Array, coefficients: Array) -> Array:
    """Return the majorants of the path's position and orientation on pieces, (2, order + 1, P)."""
    (along,) = at_nodes(coefficients[:, :, -1:], lengths, 0)
    middle = np.clip(along[:, NODES_DEGREE // 2, 0], 0.0, path.length)
    return np.stack(path.poses.majorants(middle, growth(coefficients[:, :, -1:], lengths, _ORDER)[:, :, 0]))


def _values_at_nodes(
    robot: Robot, path: ToolPath, coefficients: Array, lengths: Array
) -> tuple[Array, Array]:
    """Return differences at the nodes (P, 9, 2, 9), and majorants of their ninth order (P, 2).

    Where the path has no majorant that of the tool stands alone, and proves nothing.
    """
    (states,) = at_nodes(coefficients, lengths, 0)
    joints, along = states[..., :-1], np.clip(states[..., -1], 0.0, path.length)
    poses = forward(robot, joints)
    off = poses - path.poses.evaluate(along.ravel())[0].reshape(poses.shape)
    values = np.zeros((*along.shape, 2, 9))
    values[:, :, 0, :3] = off[..., :3, 3] * np.array(path.position)
    rising = growth(coefficients[:, :, :-1], lengths, _ORDER)
    turned = series_exponential(rising[:, :, revolute(robot)].sum(axis=2))
    of_path = _of_path(path, lengths, coefficients)[:, _ORDER]
    highest = np.stack([majorants(robot, joints[:, 0], rising)[0][_ORDER], turned[_ORDER]])
    highest += np.where(np.isfinite(of_path), of_path, 0.0)
    if path.orientation == "all":
        values[:, :, 1] = off[..., :3, :3].reshape(*along.shape, 9) / np.sqrt(2.0)
        highest[1] *= np.sqrt(1.5)
    elif path.orientation == "direction":
        values[:, :, 1, :3] = off[..., :3, AXES.index(path.tool_axis)]
    else:
        highest[1] = 0.0
    return values, highest.T
