"""Bounds of how far the tool is from its path, for all t: its distance, and the angle that it is turned by.

On a piece on which neither the joints' polynomials nor the law or the path change, e(t) = p(q(t)) - P(s(t))
is smooth. It is known at nine nodes, and its ninth derivative is at most that of p, by the majorants of the
tool, and that of P, by the majorants of the path.

Orientations an angle a apart are compared by the difference of their matrices, whose Frobenius norm is
2 sqrt(2) sin(a / 2), or of an axis of the tool, whose norm is 2 sin(a / 2). Majorants of rotations bound the
operator norm, which no column is longer than: three columns are together at most sqrt(3) times as long.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from trajcli.curves.node_bound import NODES_DEGREE, BoundedPeak, at_nodes, node_survey
from trajcli.curves.piecewise import Array, distinct, taylor_shift
from trajcli.geometry.power_series import growth, series_exponential
from trajcli.geometry.rotation import AXES
from trajcli.kinematics.following.tool_path import ToolPath
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.joint_turns import revolute
from trajcli.kinematics.robot import Robot
from trajcli.kinematics.tool_derivatives import majorants
from trajcli.limits.kinds import LimitedMove

_CLOSE = 1e-3  # of the tolerance: of the remainder, and of the hull
_HALVINGS = 8
_SAME_TIME = 1e-12  # of the time since the start of the whole: breaks of the joints' curve and of the law
_ORDER = NODES_DEGREE + 1

Pieces = tuple[Array, Array, Array]


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
    close = _CLOSE * np.array([tolerance.position, tolerance.angle])
    survey = node_survey(partial(_values_at_nodes, robot, path), pieces, lambda _: close, _HALVINGS)

    def peak(function: int) -> BoundedPeak | None:
        near = float(close[function])
        found = survey.largest(function, _norm, lambda _: near, least=0.0)
        return found if bounded[function] and found.upper_bound <= found.value + 2 * near else None

    distance, chord = peak(0), peak(1)
    return distance, chord and replace(
        chord, value=_angle(chord.value), upper_bound=_angle(chord.upper_bound)
    )


def _norm(vectors: Array) -> Array:
    return np.asarray(np.linalg.norm(vectors, axis=-1))


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
