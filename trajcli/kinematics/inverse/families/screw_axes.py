"""Screw axes of an arm: the axes of its joints where every joint is at zero, and how they lie in space.

exp(S1 q1) ... exp(Sn qn) H is the pose of the tcp, H the pose at zero and S_i the screw of joint i there.
Conventions, offsets and signs of the DH table are all in the axes, so that what is parallel or meets is the
same in every table of the same arm.

Source: Murray, Li and Sastry (1994), section 3.2.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from math import hypot
from typing import cast

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.frozen import comparable, frozen
from trajcli.kinematics.columns import (
    Entry,
    VectorEntries,
    combine,
    cross,
    dot,
    minus,
    plus,
    scaled,
)
from trajcli.kinematics.dexterity import characteristic_length
from trajcli.kinematics.forward import Link, MovingFrame, links_of, travel
from trajcli.kinematics.robot import Robot

PARALLEL = 1e-9  # sine of the angle: an alpha typed with ten digits is meant to be a right angle
MEETING = 1e-9  # of the arm's length: a picometre, where drawings say a tenth of a millimetre
_DUST = 1e-15  # what products of exact zeros and ones leave

Floats = tuple[float, float, float]
_AXES: tuple[Floats, Floats, Floats] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@comparable
class ScrewAxis:
    """The axis of one joint at zero: unit direction, pointing as the joint counts, and a point on it, m.

    `sign` times the direction is the axis as the table draws it, whichever way the joint counts: the names of
    branches refer to that.
    """

    prismatic: bool
    direction: Floats
    point: Floats
    sign: float = 1.0

    @property
    def opposite(self) -> ScrewAxis:
        """The axis of the joint read backwards: its motion is undone by the same value."""
        x, y, z = self.direction
        return ScrewAxis(self.prismatic, (-x + 0.0, -y + 0.0, -z + 0.0), self.point, self.sign)

    @property
    def drawn(self) -> Floats:
        """The direction that the axis has in the table."""
        return self.direction if self.sign > 0.0 else self.opposite.direction


@frozen
class AxisGeometry:
    """The screw axes of all joints, the tcp's pose at zero in the base, and the length of the arm.

    Attributes:
        axes: One for each joint, in the frame of the base.
        home: T_base_tcp at zero, shape (4, 4).
        base: T_world_base, shape (4, 4).
        forward: Direction from axis 1 to axis 2 at zero, of the first link's x axis where they meet: where
            the arm reaches with the shoulder left.
        upward: Direction of axis 1, upward in world; where it is horizontal, in the base.
        length: The arm's characteristic length, m.
    """

    axes: tuple[ScrewAxis, ...]
    home: Array
    base: Array
    forward: Floats
    upward: Floats
    length: float

    @property
    def tip(self) -> Floats:
        """Where the tcp is at zero, in the base, m."""
        return cast("Floats", tuple(self.home[:3, 3].tolist()))

    @property
    def kinds(self) -> str:
        """Joint types from the base on: R or P for each."""
        return "".join("P" if axis.prismatic else "R" for axis in self.axes)


@lru_cache(maxsize=16)
def axis_geometry(robot: Robot) -> AxisGeometry:
    """Return the screw axes of a robot.

    Raises:
        InputError: When the robot has no geometry.
    """
    links = links_of(robot)
    at_zero, tcp = travel(links, np.eye(4), robot.tool, cast("Sequence[Array]", [0.0] * len(links)))
    axes = tuple(
        ScrewAxis(axis.prismatic, _clean(axis.direction), _clean(axis.point), link.sign)
        for axis, link in zip(at_zero, links, strict=True)
    )
    home = np.eye(4)
    home[:3] = np.array([_clean(column) for column in (tcp.x, tcp.y, tcp.z, tcp.p)]).T
    length = characteristic_length(robot)
    forward = _forward(links, axes, length)
    return AxisGeometry(axes, home, robot.base, forward, _upward(axes[0], robot.base), length)


def _forward(links: Sequence[Link], axes: Sequence[ScrewAxis], length: float) -> Floats:
    """Return the unit vector from axis 1 to axis 2, across both; x of the first link where they meet."""
    frame = MovingFrame(np.eye(4))
    frame.screw(*links[0].before)
    frame.move(links[0], cast("Array", 0.0))
    x = _clean(frame.x)
    normal = np.cross(axes[0].direction, axes[1].direction) if len(axes) > 1 else np.zeros(3)
    size = float(np.linalg.norm(normal))
    if size <= PARALLEL:
        return x
    apart = float(np.subtract(axes[1].point, axes[0].point) @ normal) / size
    if abs(apart) <= MEETING * length or axes[0].prismatic or axes[1].prismatic:
        return x
    a, b, c = (np.copysign(1.0, apart) * normal / size).tolist()
    return _clean((a, b, c))


def _upward(one: ScrewAxis, base: Array) -> Floats:
    """Return the direction of axis 1 that rises in world, else in the base, else the one in the table."""
    for rise in (float(base[2, :3] @ one.drawn), one.drawn[2]):
        if abs(rise) > PARALLEL:
            x, y, z = one.drawn
            return one.drawn if rise > 0.0 else (-x + 0.0, -y + 0.0, -z + 0.0)
    return one.drawn


class Displacement:
    """One block of B target poses T as displacements from zero: G with G H = T, whatever base and tool.

    Attributes:
        x, y, z, p: Columns of the targets in the base, each entry an array (B,).
    """

    def __init__(self, arm: AxisGeometry, rows: Array) -> None:
        """Take the twelve upper entries of the poses, row by row, shape (12, B)."""
        into_base = [cast("Floats", tuple(row)) for row in arm.base[:3, :3].T.tolist()]
        x, y, z, p = ((rows[i], rows[4 + i], rows[8 + i]) for i in range(4))
        p = minus(p, cast("Floats", tuple(arm.base[:3, 3].tolist())))
        self.x, self.y, self.z, self.p = (
            (dot(into_base[0], v), dot(into_base[1], v), dot(into_base[2], v)) for v in (x, y, z, p)
        )
        self._home = arm.home

    def direction(self, vector: VectorEntries) -> VectorEntries:
        """Return where the displacement turns a direction that was `vector` at zero."""
        return self._turned(np.asarray(vector) @ self._home[:3, :3])

    def point(self, point: VectorEntries) -> VectorEntries:
        """Return where the displacement takes a point of the tool that was at `point` at zero."""
        local = (np.asarray(point) - self._home[:3, 3]) @ self._home[:3, :3]
        return plus(self._turned(local), self.p)

    def view(self, vector: VectorEntries) -> VectorEntries:
        """Return what the displacement turns to `vector`: the inverse of `direction`."""
        first, second, third = (dot(self.direction(axis), vector) for axis in _AXES)
        return first, second, third

    def _turned(self, local: Array) -> VectorEntries:
        a, b, c = (0.0 if abs(entry) < _DUST else float(entry) for entry in local)
        return plus(combine(a, self.x, b, self.y), scaled(c, self.z))


class InverseDisplacement(Displacement):
    """The inverse displacements of a goal, for arms that are read from the tool to the base."""

    def __init__(self, goal: Displacement) -> None:
        """Take the goal to invert."""
        self._columns = [goal.direction(axis) for axis in _AXES]
        self._origin = goal.point((0.0, 0.0, 0.0))

    def direction(self, vector: VectorEntries) -> VectorEntries:
        """Return where the inverse displacement turns a direction."""
        first, second, third = (dot(column, vector) for column in self._columns)
        return first, second, third

    def point(self, point: VectorEntries) -> VectorEntries:
        """Return where the inverse displacement takes a point."""
        return self.direction(minus(point, self._origin))


def parallel(*axes: ScrewAxis) -> bool:
    """Return whether all axes have one direction, or the opposite one."""
    crossed = (cross(axes[0].direction, axis.direction) for axis in axes[1:])
    return all(hypot(*map(float, normal)) <= PARALLEL for normal in crossed)


def perpendicular(a: ScrewAxis, b: ScrewAxis) -> bool:
    """Return whether two directions are at right angles."""
    return abs(float(np.dot(a.direction, b.direction))) <= PARALLEL


def meeting_point(a: ScrewAxis, b: ScrewAxis, length: float) -> Floats | None:
    """Return the point where two axes that are not parallel meet within 1e-9 of `length`; None elsewhere."""
    if parallel(a, b):
        return None
    (ua, pa), (ub, pb) = ((np.array(axis.direction), np.array(axis.point)) for axis in (a, b))
    normal = np.cross(ua, ub)
    between = pb - pa
    if abs(float(between @ normal)) > MEETING * length * float(np.linalg.norm(normal)):
        return None
    along = float(np.cross(between, ub) @ normal / (normal @ normal))
    return _clean(tuple(pa + along * ua))


def contains(axis: ScrewAxis, point: Floats, length: float) -> bool:
    """Return whether a point lies on an axis within 1e-9 of `length`."""
    offset = np.cross(np.subtract(point, axis.point), axis.direction)
    return float(np.linalg.norm(offset)) <= MEETING * length


def common_point(axes: Sequence[ScrewAxis], length: float) -> Floats | None:
    """Return the point in which three axes meet, neighbours not parallel; None where they do not."""
    point = meeting_point(axes[0], axes[1], length)
    if point is None or parallel(axes[1], axes[2]) or not contains(axes[2], point, length):
        return None
    return point


def across_floats(a: Floats, b: Floats) -> Floats:
    """Return the vector product of two constant vectors."""
    return _clean(cross(a, b))


def aside(axis: Floats) -> Floats:
    """Return a vector at right angles to a unit axis, not shorter than 0.8."""
    values = np.array(axis)
    nearest = np.eye(3)[int(np.argmin(np.abs(values)))]
    return _clean((nearest - (nearest @ values) * values).tolist())


def _clean(vector: Sequence[Entry]) -> Floats:
    x, y, z = (0.0 if abs(value) < _DUST else value for value in map(float, vector))
    return x, y, z
