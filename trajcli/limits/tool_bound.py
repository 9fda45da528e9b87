"""Bounds of the tool's speeds and accelerations for all t: samples, and a proof of what is between them.

On each piece of the curve nine rows give a polynomial of degree 8. What the tool does between the rows is
off it by at most f^(9) / 9! times 8! / 4 (h / 8)^9, and that derivative is bounded by those of the joints.
The polynomial itself lies within the hull of its Bernstein coefficients, which closes in on it when it is
divided.

Source: Isaacson and Keller, Analysis of Numerical Methods (1966), section 6.3 (equidistant nodes); Farouki,
The Bernstein polynomial basis, Computer Aided Geometric Design 29 (2012).
"""

from __future__ import annotations

import numpy as np

from trajcli.curves.bernstein import BETWEEN_NODES, NODES_DEGREE, hull_matrices
from trajcli.curves.piecewise import Array, derivative_coefficients, horner, taylor_shift
from trajcli.frozen import frozen
from trajcli.kinematics.jacobian import jacobian_dot_qd, linearisation
from trajcli.kinematics.power_series import growth
from trajcli.kinematics.robot import Robot
from trajcli.kinematics.tool_majorants import majorants

_CLOSE = 2.5e-7  # relative: of the remainder, and of the hull
_SMALL = 1e-3  # m/s, rad/s or by s^2: what is smaller need not be known so well
_HALVINGS, _DIVISIONS, _MOST = 8, 24, 1 << 16


@frozen
class ToolPeak:
    """The largest magnitude of a vector over time.

    Attributes:
        value: The largest one sampled.
        time: Where that is.
        most: What it does not exceed at any time.
    """

    value: float
    time: float
    most: float


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
    starts, lengths, coefficients = starts[long], lengths[long], coefficients[:, long]
    if not lengths.size:
        still = ToolPeak(0.0, float(breaks[0]), 0.0)
        return still, still, still, still
    rows, rest = _known(robot, coefficients, lengths)
    for _ in range(_HALVINGS):
        scale = np.maximum(np.linalg.norm(rows, axis=3).max(axis=(1, 2)), _SMALL)
        coarse = (rest > _CLOSE * scale[:, None]).any(axis=0)
        if not coarse.any():
            break
        half, early = lengths[coarse] / 2, coefficients[:, coarse]
        late = taylor_shift(early, np.broadcast_to(half[:, None], early.shape[1:]))
        both = np.concatenate([early, late], axis=1)
        more, left = _known(robot, both, np.tile(half, 2))
        coefficients = np.concatenate([coefficients[:, ~coarse], both], axis=1)
        starts = np.concatenate([starts[~coarse], starts[coarse], starts[coarse] + half])
        lengths = np.concatenate([lengths[~coarse], half, half])
        rows = np.concatenate([rows[:, ~coarse], more], axis=1)
        rest = np.concatenate([rest[:, ~coarse], left], axis=1)
    bounds = [_largest(vectors, off, starts, lengths) for vectors, off in zip(rows, rest, strict=True)]
    return bounds[0], bounds[1], bounds[2], bounds[3]


def _known(robot: Robot, coefficients: Array, lengths: Array) -> tuple[Array, Array]:
    """Return v, w, a, e at nine rows of each piece (4, P, 9, 3), and how far off they may be between them.

    The latter has the shape (4, P).
    """
    inside = lengths[:, None] * np.linspace(0.0, 1.0, NODES_DEGREE + 1)
    q, qd, qdd = (
        horner(derivative_coefficients(coefficients, order)[:, :, None], inside[..., None])
        for order in range(3)
    )
    slopes = linearisation(robot, q)[1]
    first = (slopes @ qd[..., None])[..., 0]
    second = (slopes @ qdd[..., None])[..., 0] + jacobian_dot_qd(robot, q, qd)
    rows = np.stack([first[..., :3], first[..., 3:], second[..., :3], second[..., 3:]])
    n = NODES_DEGREE + 1
    position, angle = majorants(robot, q[:, 0], growth(coefficients, lengths, n + 2))
    highest = np.stack(
        [(n + 1) * position[n + 1], angle[n], (n + 1) * (n + 2) * position[n + 2], (n + 1) * angle[n + 1]]
    )
    return rows, highest * BETWEEN_NODES * lengths**n


def _largest(rows: Array, rest: Array, starts: Array, lengths: Array) -> ToolPeak:
    """Return the bound of vectors at nine rows of pieces (P, 9, 3), off by `rest` (P,) between them."""
    if not (np.isfinite(rows).all() and np.isfinite(rest).all()):
        return ToolPeak(np.inf, float(starts.min()), np.inf)  # nothing is proven of what no float64 holds
    hull, halves = hull_matrices()
    points = hull @ rows
    value, time, most = 0.0, float(starts.min()), 0.0
    for _ in range(_DIVISIONS):
        sizes = np.linalg.norm(points, axis=2)
        ends = sizes[:, [0, -1]]
        piece, end = np.unravel_index(int(ends.argmax()), ends.shape)
        if ends[piece, end] > value:
            value, time = float(ends[piece, end]), float(starts[piece] + end * lengths[piece])
        over = sizes.max(axis=1) + rest
        wide = sizes.max(axis=1) > value + _CLOSE * max(value, _SMALL)
        if not wide.any() or len(points) > _MOST:
            return ToolPeak(value, time, max(most, float(over.max())))
        most = max(most, float(over[~wide].max(initial=0.0)))
        points = (halves[:, None] @ points[wide]).reshape(-1, *points.shape[1:])
        rest, lengths = np.tile(rest[wide], 2), np.tile(lengths[wide] / 2, 2)
        starts = np.tile(starts[wide], 2)
        starts[len(starts) // 2 :] += lengths[len(starts) // 2 :]
    return ToolPeak(value, time, max(most, float((np.linalg.norm(points, axis=2).max(axis=1) + rest).max())))
