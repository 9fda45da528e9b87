"""Forward kinematics: links from DH rows, a frame moved along them, poses of the links and of the tool.

A standard row is Rz(theta) Tz(d) Tx(a) Rx(alpha), a modified one Rx(alpha) Tx(a) Rz(theta) Tz(d); where axes
are almost parallel, Ry(beta) follows Rx(alpha) and Tx(a). Angles that are whole quarter turns in the DH table
enter with exact zeros and ones. A turn about z stays pending until an axis is needed, so that neighbouring
parallel axes add their angles instead of multiplying matrices.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from trajcli.curves.piecewise import Array, numeric
from trajcli.errors import InputError
from trajcli.frozen import comparable, frozen
from trajcli.geometry.rotation import cos_sin
from trajcli.kinematics.columns import (
    Entry,
    VectorEntries,
    advance,
    combine,
    minus,
    product,
    scaled,
    total,
)
from trajcli.kinematics.robot import GEOMETRY_HINT, Robot

_BLOCK = 4096  # configurations at a time: the arrays in use stay in the processor's cache


@comparable
class Link:
    """A joint and the fixed screws about x before and after it, each (a, cos alpha, sin alpha).

    A standard DH row has its screw after the joint, a modified one before. Where the row has a beta, its
    cosine and sine follow.
    """

    prismatic: bool
    sign: float
    theta: float
    d: float
    before: tuple[float, ...]
    after: tuple[float, ...]


@frozen
class JointAxis:
    """The axis of one joint: its direction, pointing as the joint counts, and a point on it."""

    prismatic: bool
    direction: VectorEntries
    point: VectorEntries


@lru_cache(maxsize=16)
def links_of(robot: Robot) -> tuple[Link, ...]:
    """Return the robot's links, with exact cosines and sines where alpha is a whole number of right angles.

    Raises:
        InputError: When the robot has no geometry.
    """
    if robot.convention is None:
        raise InputError(
            f"robot {robot.name} has bare joints and no geometry",
            hint=GEOMETRY_HINT,
        )
    none = (0.0, 1.0, 0.0)
    cosines, sines = cos_sin([joint.alpha for joint in robot.joints])
    links = []
    for joint, cosine, sine in zip(robot.joints, cosines.tolist(), sines.tolist(), strict=True):
        tilt = () if joint.beta == 0.0 else map(float, cos_sin(joint.beta))
        screw = (float(joint.a), cosine, sine, *tilt)
        before, after = (none, screw) if robot.convention == "standard" else (screw, none)
        prismatic = joint.type == "prismatic"
        links.append(Link(prismatic, float(joint.sign), float(joint.theta), float(joint.d), before, after))
    return tuple(links)


def configurations(robot: Robot, values: ArrayLike, name: str = "q") -> Array:
    """Return joint values as an array (*batch, n).

    Raises:
        InputError: When the last dimension is not the number of joints, or a value is no finite number.
    """
    array = np.asarray(numeric(values, name), dtype=np.float64)
    joints = len(robot.joints)
    if array.ndim == 0 or array.shape[-1] != joints:
        given = array.shape[-1] if array.ndim else 1
        raise InputError(f"{name} has {given} values, robot {robot.name} has {joints} joints")
    if not np.isfinite(array).all():
        raise InputError(f"{name} holds a value that is not finite")
    return array


def blocks(*arrays: Array) -> Iterator[tuple[slice, list[Sequence[Array]]]]:
    """Yield slices of the flattened batch, and of each array (*batch, n) the block as n contiguous arrays."""
    flat = [array.reshape(-1, array.shape[-1]) for array in arrays]
    for low in range(0, flat[0].shape[0], _BLOCK):
        rows = slice(low, low + _BLOCK)
        yield rows, [list(np.ascontiguousarray(array[rows].T)) for array in flat]


class MovingFrame:
    """A frame with columns x, y, z and origin p, moved in its own axes."""

    def __init__(self, pose: Array) -> None:
        columns = np.asarray(pose, dtype=np.float64)[:3].T.tolist()
        self._x, self._y, self.z, self.p = (tuple(column) for column in columns)
        self._angle: Entry = 0.0
        self._turned: tuple[Entry, Entry] | None = None
        self._x_now: VectorEntries | None = None

    def move(self, link: Link, q: Array) -> None:
        """Move by a joint: turn about z by theta and slide along z by d, one of them with q."""
        change = product(link.sign, q)
        self.turn(link.theta if link.prismatic else total(change, link.theta))
        self.p = advance(self.p, total(change, link.d) if link.prismatic else link.d, self.z)

    def turn(self, angle: Entry) -> None:
        """Turn about z."""
        if isinstance(angle, float) and angle == 0.0:
            return
        self._angle = total(self._angle, angle)
        self._turned = self._x_now = None

    def screw(self, a: float, cosine: float, sine: float, *tilt: float) -> None:
        """Slide along x by a, and turn about it by the angle of the given cosine and sine; then tilt about y.

        Args:
            a: m.
            cosine: Of the angle about x.
            sine: Of the angle about x.
            tilt: Cosine and sine of the angle about y, where there is one.
        """
        if a != 0.0:
            self.p = advance(self.p, a, self.x)
        if cosine != 1.0 or sine != 0.0:
            y = self.y
            self._x, self._y = self.x, combine(cosine, y, sine, self.z)
            self.z = combine(cosine, self.z, -sine, y)
            self._angle, self._turned, self._x_now = 0.0, None, None
        if tilt:
            x, y = self.x, self.y
            self._x, self._y = combine(tilt[0], x, -tilt[1], self.z), y
            self.z = combine(tilt[0], self.z, tilt[1], x)
            self._angle, self._turned, self._x_now = 0.0, None, None

    def attach(self, tool: Array) -> None:
        """Move to the frame whose pose in this one is `tool`."""
        x, y, z = self.x, self.y, self.z
        for distance, axis in zip(tool[:3, 3].tolist(), (x, y, z), strict=True):
            self.p = advance(self.p, distance, axis)
        self._x, self._y, self.z = (
            advance(advance(scaled(a, x), b, y), c, z) for a, b, c in tool[:3, :3].T.tolist()
        )
        self._angle, self._turned, self._x_now = 0.0, None, None

    @property
    def x(self) -> VectorEntries:
        """First axis."""
        if self._x_now is None:
            cosine, sine = self._cos_sin()
            self._x_now = combine(cosine, self._x, sine, self._y)
        return self._x_now

    @property
    def y(self) -> VectorEntries:
        """Second axis."""
        cosine, sine = self._cos_sin()
        return minus(scaled(cosine, self._y), scaled(sine, self._x))

    def write(self, out: Array) -> None:
        """Write the pose into `out` (B, 4, 4)."""
        for j, column in enumerate((self.x, self.y, self.z, self.p)):
            for i, entry in enumerate(column):
                out[:, i, j] = entry
        out[:, 3] = 0.0, 0.0, 0.0, 1.0

    def _cos_sin(self) -> tuple[Entry, Entry]:
        if self._turned is None:
            if isinstance(self._angle, float) and self._angle == 0.0:
                self._turned = 1.0, 0.0
            elif isinstance(self._angle, float):
                cosine, sine = cos_sin(self._angle)
                self._turned = float(cosine), float(sine)
            else:
                self._turned = np.cos(self._angle), np.sin(self._angle)
        return self._turned


def travel(
    links: Sequence[Link], base: Array, tool: Array, q: Sequence[Array]
) -> tuple[list[JointAxis], MovingFrame]:
    """Return the axes of all joints, and the frame of the tcp, for one block of configurations."""
    frame, axes = MovingFrame(base), []
    for link, value in zip(links, q, strict=True):
        frame.screw(*link.before)
        axes.append(JointAxis(link.prismatic, scaled(link.sign, frame.z), frame.p))
        frame.move(link, value)
        frame.screw(*link.after)
    frame.attach(tool)
    return axes, frame


def forward(robot: Robot, q: ArrayLike) -> Array:
    """Return T_world_tcp, shape (*batch, 4, 4), of joint values q (*batch, n), rad or m.

    Raises:
        InputError: When the robot has no geometry, or q has not n finite values.

    Source: Denavit and Hartenberg, A kinematic notation for lower-pair mechanisms, J. Applied Mechanics 22
    (1955); modified rows after Craig (2005), section 3.4.
    """
    links, values = links_of(robot), configurations(robot, q)
    poses = np.empty((values.size // values.shape[-1], 4, 4))
    for rows, (block,) in blocks(values):
        travel(links, robot.base, robot.tool, block)[1].write(poses[rows])
    return poses.reshape(*values.shape[:-1], 4, 4)


def link_poses(robot: Robot, q: ArrayLike) -> Array:
    """Return the poses in world of all frames of the chain, shape (*batch, n + 2, 4, 4).

    The first is the base, then follows the DH frame of each link, the last of which is the flange, and in the
    end the tcp. The frame of link i stands at the end of a standard row (on the axis of joint i + 1), and on
    the axis of joint i in the modified convention.

    Raises:
        InputError: When the robot has no geometry, or q has not n finite values.
    """
    links, values = links_of(robot), configurations(robot, q)
    poses = np.empty((values.size // values.shape[-1], len(links) + 2, 4, 4))
    poses[:, 0] = robot.base
    for rows, (block,) in blocks(values):
        frame = MovingFrame(robot.base)
        for i, (link, value) in enumerate(zip(links, block, strict=True)):
            frame.screw(*link.before)
            frame.move(link, value)
            frame.screw(*link.after)
            frame.write(poses[rows, i + 1])
        frame.attach(robot.tool)
        frame.write(poses[rows, -1])
    return poses.reshape(*values.shape[:-1], len(links) + 2, 4, 4)
