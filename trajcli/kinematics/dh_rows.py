"""Denavit-Hartenberg rows of a serial chain that is given by the poses and the axes of its joints.

Rows are standard ones. The z axis of a row's frame is turned along the joint's axis, so that no sign is
needed. The line of a slide is free: it is drawn through the origin that the row before leaves. Where two axes
are almost parallel their common normal is far off, and the row takes Hayati's turn about y, with d = 0.

Source: Denavit and Hartenberg (1955); Hayati (1983).
"""

from __future__ import annotations

from collections.abc import Sequence
from math import atan2, copysign, hypot, pi

import numpy as np

from trajcli.curves.piecewise import Array, read_only
from trajcli.frozen import frozen
from trajcli.geometry.pose import invert
from trajcli.geometry.rotation import cos_sin

PARALLEL = 1e-14
"""Sine of the angle between axes that are parallel but for rounding."""
ALMOST_PARALLEL = 1e-3
"""Sine of the angle below which a common normal loses digits: d would be over a thousand times the arm."""
_ROUNDING = 1e-15  # of lengths, m, and of angles about right ones, rad


@frozen
class AxisInChain:
    """A joint that moves, with the fixed joints before it folded in.

    Attributes:
        prismatic: Whether it slides.
        origin: Pose of its frame in that of the joint before at zero, or in the root, shape (4, 4).
        axis: Unit vector in its frame, shape (3,).
    """

    prismatic: bool
    origin: Array
    axis: Array


@frozen
class DhTable:
    """A chain as standard rows.

    Attributes:
        base: Pose of the first row's frame in the root, shape (4, 4).
        rows: theta, d, a, alpha and beta of each joint.
        tool: Pose of the tip in the last row's frame, shape (4, 4).
        links: Pose of the link behind each joint, whose frame is the joint's, in the frame of its row,
            each of shape (4, 4).
    """

    base: Array
    rows: tuple[tuple[float, float, float, float, float], ...]
    tool: Array
    links: tuple[Array, ...]

    def __post_init__(self) -> None:
        for name in ("base", "tool"):
            object.__setattr__(self, name, read_only(getattr(self, name)))


def dh_table(joints: Sequence[AxisInChain], tip: Array) -> DhTable:
    """Return the rows of a chain.

    Args:
        joints: From the root on.
        tip: Pose of the tip in the frame of the last joint, shape (4, 4).
    """
    first = joints[0]
    base = _base(first.origin[:3, 3], first.origin[:3, :3] @ first.axis, slides=first.prismatic)
    frame = (
        invert(base) @ first.origin
    )  # of the joint, in that of the row before, whose z axis is the joint's
    rows, links = [], []
    for joint in joints[1:]:
        ahead = frame @ joint.origin
        row = _row(ahead[:3, 3], ahead[:3, :3] @ joint.axis, slides=joint.prismatic)
        back = invert(row_pose(row))
        rows.append(row)
        links.append(back @ frame)
        frame = back @ ahead
    end = frame @ tip
    row = _last_row(end)
    back = invert(row_pose(row))
    return DhTable(base, (*rows, row), _cleaned(back @ end), (*links, back @ frame))


def row_pose(row: tuple[float, float, float, float, float]) -> Array:
    """Return Rz(theta) Tz(d) Tx(a) Rx(alpha) Ry(beta), shape (4, 4)."""
    theta, d, a, alpha, beta = row
    (ct, ca, cb), (st, sa, sb) = (values.tolist() for values in cos_sin([theta, alpha, beta]))
    turn_z = np.array([[ct, -st, 0.0], [st, ct, 0.0], [0.0, 0.0, 1.0]])
    turn_x = np.array([[1.0, 0.0, 0.0], [0.0, ca, -sa], [0.0, sa, ca]])
    turn_y = np.array([[cb, 0.0, sb], [0.0, 1.0, 0.0], [-sb, 0.0, cb]])
    pose = np.eye(4)
    pose[:3, :3] = turn_z @ turn_x @ turn_y
    pose[:3, 3] = a * ct, a * st, d
    return pose


def _base(point: Array, axis: Array, *, slides: bool) -> Array:
    """Return a frame whose z axis is that of the first joint: the root's own where it can be."""
    z = axis / np.linalg.norm(axis)
    z[np.abs(z) <= _ROUNDING] = 0.0
    across = np.eye(3)[0] - z[0] * z if abs(z[0]) < 0.9 else np.eye(3)[1] - z[1] * z
    x = across / np.linalg.norm(across)
    base = np.eye(4)
    base[:3, :3] = np.column_stack([x, np.cross(z, x), z])
    if not slides:
        base[:3, 3] = point - (point @ z) * z
    return _cleaned(base)


def _row(point: Array, axis: Array, *, slides: bool) -> tuple[float, float, float, float, float]:
    """Return the row to the next axis: a line, or only a direction where that joint slides."""
    (px, py, pz), (ux, uy, uz) = map(float, point), map(float, axis)
    sine = hypot(ux, uy)
    if sine <= PARALLEL:
        alpha = 0.0 if uz > 0.0 else pi
        across = 0.0 if slides or hypot(px, py) <= _ROUNDING else hypot(px, py)
        return _right(atan2(py, px)) if across else 0.0, 0.0, across, alpha, 0.0
    if sine < ALMOST_PARALLEL and not slides:
        return _hayati_row(point - (pz / uz) * axis, axis)
    theta, alpha = atan2(ux, -uy), atan2(sine, uz)
    length = 0.0 if slides else (-uy * px + ux * py) / sine  # along the common normal z x u
    along = (ux * px + uy * py) / (sine * sine)  # the point's distance on its axis from the common normal
    d = 0.0 if slides else pz - along * uz
    # the normal points away from the first axis; where they meet theta is in (-pi/2, pi/2]
    turned = length < -_ROUNDING if abs(length) > _ROUNDING else not -pi / 2 + _ROUNDING < theta <= pi / 2
    if turned:
        theta, alpha, length = theta - copysign(pi, theta), -alpha, -length
    return _right(theta), _small(d), _small(length), _right(alpha), 0.0


def _hayati_row(point: Array, axis: Array) -> tuple[float, float, float, float, float]:
    """Return the row with d = 0 to an axis almost parallel to z, through a point of the plane z = 0."""
    across = hypot(float(point[0]), float(point[1]))
    theta = _right(atan2(float(point[1]), float(point[0]))) if across > _ROUNDING else 0.0
    cosine, sine = map(float, cos_sin(theta))
    ux, uy = cosine * float(axis[0]) + sine * float(axis[1]), cosine * float(axis[1]) - sine * float(axis[0])
    uz = float(axis[2])
    return theta, 0.0, _small(across), atan2(-uy, uz), atan2(ux, hypot(uy, uz))


def _last_row(end: Array) -> tuple[float, float, float, float, float]:
    """Return the row that leaves the least for the tool: all of it where the tip's z axis is the joint's."""
    if hypot(float(end[0, 2]), float(end[1, 2])) > PARALLEL or end[2, 2] < 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0
    return _right(atan2(float(end[1, 0]), float(end[0, 0]))), _small(float(end[2, 3])), 0.0, 0.0, 0.0


def _right(angle: float) -> float:
    """Return an angle, as a whole number of right angles where it is one but for rounding."""
    whole = round(angle / (pi / 2)) * (pi / 2)
    return whole if abs(angle - whole) <= _ROUNDING else angle


def _small(length: float) -> float:
    """Return a length, as zero where it is rounding."""
    return 0.0 if abs(length) <= _ROUNDING else length


def _cleaned(pose: Array) -> Array:
    """Return a pose with zeros for what is rounding, and whole numbers in its rotation."""
    whole = np.round(pose)
    turn = (np.abs(pose - whole) <= _ROUNDING) & (np.arange(4) < 3)
    return np.where(turn | (np.abs(pose) <= _ROUNDING), whole, pose) + 0.0
