"""Inverse dynamics of a serial robot by the recursive Newton-Euler algorithm, for many states at once.

The frame of a joint stands at the end of its turn about and slide along z, so that z is its axis in both
conventions of DH rows; masses and inertias are carried into these frames once. The recursion goes outwards
with velocities and accelerations, in which gravity is an acceleration of the base against it, and inwards
with forces and moments.

Source: Luh, Walker and Paul, On-line computational scheme for mechanical manipulators, J. Dynamic Systems,
Measurement, and Control 102 (1980); Siciliano et al. (2009), section 7.5.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from trajcli.curves.piecewise import Array, read_only
from trajcli.errors import InputError
from trajcli.frozen import comparable, frozen
from trajcli.geometry.rotation import cos_sin
from trajcli.kinematics.columns import (
    ZERO,
    Entry,
    VectorEntries,
    advance,
    cross,
    difference,
    dot,
    minus_product,
    plus,
    plus_product,
    product,
    scaled,
    total,
)
from trajcli.kinematics.forward import blocks, configurations, links_of
from trajcli.kinematics.robot import Payload, Robot

REST = 1e-12  # rad/s or m/s
_NO_SCREW: tuple[float, ...] = (0.0, 1.0, 0.0)


@comparable
class RigidSolid:
    """Mass, first moment and inertia about the origin of a joint's frame, in its axes; plain numbers.

    Attributes:
        mass: kg.
        first: Mass times the centre of mass, kg m.
        second: xx, yy, zz, xy, xz, yz of the inertia tensor about the origin, kg m^2.
    """

    mass: float
    first: tuple[float, float, float]
    second: tuple[float, float, float, float, float, float]

    @property
    def sizes(self) -> tuple[float, float, float, float]:
        """Mass, length of the first moment, largest principal moment, half its distance to the least."""
        xx, yy, zz, xy, xz, yz = self.second
        moments = np.linalg.eigvalsh(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])).tolist()
        largest, least = moments[2], moments[0]
        return self.mass, float(np.linalg.norm(self.first)), largest, (largest - least) / 2


@comparable
class DynamicLink:
    """A joint, what leads to it from the frame of the joint before, and the solid that it carries.

    Attributes:
        prismatic: Whether it slides.
        sign: 1 or -1: the direction in which it counts.
        theta: Angle about z, without the joint's own, rad.
        d: Offset along z, without the joint's own, m.
        screw: a, cosine and sine of alpha, and those of beta where there is one, before the joint.
        solid: In the frame of the joint.
    """

    prismatic: bool
    sign: float
    theta: float
    d: float
    screw: tuple[float, ...]
    solid: RigidSolid


@frozen
class InverseDynamics:
    """Efforts of the joints of a robot: torques in N m, forces of prismatic joints in N.

    effort = M(q) qdd + C(q, qd) qd + g(q) + coulomb sign(qd) + viscous qd, where M holds the rotors.

    Attributes:
        robot: The arm; every link has its inertia.
        gravity: Acceleration of a body that falls, in world, m/s^2, shape (3,); the robot's unless given.
        payload: What the tcp carries; the robot's unless given.

    Raises:
        InputError: When the robot has no geometry, or a link no inertia.
    """

    robot: Robot
    gravity: Array | None = None
    payload: Payload | None = None

    def __post_init__(self) -> None:
        gravity = read_only(self.robot.gravity if self.gravity is None else self.gravity)
        if gravity.shape != (3,) or not np.isfinite(gravity).all():
            raise InputError("gravity: expected three finite numbers (m/s^2, in world)")
        payload = self.robot.payload if self.payload is None else self.payload
        robot = replace(self.robot, gravity=gravity, payload=payload)
        for name, value in (("robot", robot), ("gravity", gravity), ("payload", payload)):
            object.__setattr__(self, name, value)
        object.__setattr__(self, "_links", dynamic_links(robot))

    @property
    def links(self) -> tuple[DynamicLink, ...]:
        """The joints with the solids that they carry, from the base on."""
        links: tuple[DynamicLink, ...] = self.__dict__["_links"]
        return links

    @property
    def lift(self) -> tuple[float, float, float]:
        """The acceleration against gravity, in the axes of the base, m/s^2."""
        x, y, z = (-(self.robot.gravity @ self.robot.base[:3, :3])).tolist()
        return x, y, z

    def effort(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> Array:
        """Return the efforts of the joints with friction and rotors, shape (*batch, n), N m or N.

        Args:
            q: Joint values (*batch, n), rad or m.
            qd: Joint velocities of the same shape.
            qdd: Joint accelerations of the same shape.

        Raises:
            InputError: When they have not n finite values of one batch.
        """
        rates, accelerations = np.asarray(qd, dtype=np.float64), np.asarray(qdd, dtype=np.float64)
        rigid = self.rigid_effort(q, rates, accelerations)
        return np.asarray(rigid + self.friction(rates))

    def rigid_effort(
        self, q: ArrayLike, qd: ArrayLike | None, qdd: ArrayLike | None, *, weight: bool | Array = True
    ) -> Array:
        """Return M qdd + C qd + g, without friction, shape (*batch, n), N m or N.

        Args:
            q: Joint values (*batch, n), rad or m.
            qd: Joint velocities of the same shape; zero where None.
            qdd: Joint accelerations of the same shape; zero where None.
            weight: Whether gravity acts, in all states or in each (*batch,).

        Raises:
            InputError: When they have not n finite values of one batch.
        """
        values = configurations(self.robot, q)
        rates = None if qd is None else self._matching(values, qd, "qd")
        seconds = None if qdd is None else self._matching(values, qdd, "qdd")
        result = np.empty((values.size // values.shape[-1], values.shape[-1]))
        given = [array for array in (values, rates, seconds) if array is not None]
        for rows, columns in blocks(*given):
            left = iter(columns[1:])
            speeds = None if rates is None else next(left)
            changes = None if seconds is None else next(left)
            acts = weight if isinstance(weight, bool) else weight.reshape(-1)[rows]
            lift = scaled(float(acts) if isinstance(acts, bool) else acts.astype(np.float64), self.lift)
            for i, entry in enumerate(_recursion(self.links, lift, columns[0], speeds, changes)):
                result[rows, i] = entry
        if seconds is not None:
            result += np.array([j.rotor for j in self.robot.joints]) * seconds.reshape(result.shape)
        return result.reshape(values.shape)

    def apart_from_gravity(self, q: Array, qd: Array, qdd: Array) -> tuple[Array, Array]:
        """Return M qdd + C qd and g, each of shape (*batch, n), N m or N, in one recursion.

        Args:
            q: Joint values (*batch, n), rad or m.
            qd: Joint velocities of the same shape.
            qdd: Joint accelerations of the same shape.

        Raises:
            InputError: When they have not n finite values of one batch.
        """
        nothing = np.zeros_like(q)
        weight = np.stack([np.zeros(q.shape[:-1]), np.ones(q.shape[:-1])])
        both = self.rigid_effort(
            np.stack([q, q]), np.stack([qd, nothing]), np.stack([qdd, nothing]), weight=weight
        )
        return both[0], both[1]

    def along_path(self, q: Array, first: Array, second: Array) -> tuple[Array, Array, Array]:
        """Return M q', M q'' + C q' and g of a path q(s), each of shape (p, n), in one recursion.

        Args:
            q: At points of the path (p, n), rad or m.
            first: q' of the same shape.
            second: q'' of the same shape.

        Raises:
            InputError: When they have not n finite values of one batch.
        """
        nothing, one = np.zeros_like(q), np.ones(len(q))
        rates, changes = np.stack([nothing, first, nothing]), np.stack([first, second, nothing])
        weight = np.stack([0.0 * one, 0.0 * one, one])
        a, b, held = self.rigid_effort(np.stack([q, q, q]), rates, changes, weight=weight)
        return a, b, held

    def gravity_effort(self, q: ArrayLike) -> Array:
        """Return g(q), the efforts at rest without friction, shape (*batch, n), N m or N.

        Raises:
            InputError: When q has not n finite values.
        """
        return self.rigid_effort(q, None, None)

    def coriolis(self, q: ArrayLike, qd: ArrayLike) -> Array:
        """Return C(q, qd) qd, Coriolis and centrifugal efforts, shape (*batch, n), N m or N.

        Raises:
            InputError: When q and qd have not n finite values of one batch.
        """
        return self.rigid_effort(q, qd, None, weight=False)

    def mass_matrix(self, q: ArrayLike) -> Array:
        """Return M(q) with the rotors, shape (*batch, n, n), kg m^2, kg m or kg by the kinds of joints.

        Raises:
            InputError: When q has not n finite values.
        """
        values = configurations(self.robot, q)
        n = values.shape[-1]
        result = np.empty((values.size // n, n, n))
        for rows, (block,) in blocks(values):
            for j in range(n):
                unit = [float(i == j) for i in range(n)]
                for i, entry in enumerate(_recursion(self.links, ZERO, block, None, unit)):
                    result[rows, i, j] = entry
        result = 0.5 * (result + result.transpose(0, 2, 1))
        result += np.diag([joint.rotor for joint in self.robot.joints])
        return result.reshape(*values.shape, n)

    def friction(self, qd: ArrayLike) -> Array:
        """Return coulomb sign(qd) + viscous qd, shape (*batch, n), N m or N; zero at rest, up to rounding.

        Raises:
            InputError: When qd has not n finite values.
        """
        rates = configurations(self.robot, qd, "qd")
        coulomb, viscous = np.array([(j.friction.coulomb, j.friction.viscous) for j in self.robot.joints]).T
        return np.asarray(coulomb * direction(rates) + viscous * rates)

    def _matching(self, values: Array, given: ArrayLike, name: str) -> Array:
        """Return rates as an array of the same shape as the joint values."""
        array = configurations(self.robot, given, name)
        if array.shape != values.shape:
            raise InputError(f"{name} has shape {array.shape}, q has shape {values.shape}")
        return array


def direction(rates: Array) -> Array:
    """Return the signs of joint velocities; what rounding leaves of none has no direction."""
    return np.where(np.abs(rates) > REST, np.sign(rates), 0.0)


def dynamic_links(robot: Robot) -> tuple[DynamicLink, ...]:
    """Return the chain with the masses that it carries, tool and payload as parts of the last link.

    Raises:
        InputError: When the robot has no geometry, or a link no inertia.
    """
    links = links_of(robot)
    lacking = robot.without_inertia
    if lacking:
        whose = f"joint{'s' * (len(lacking) > 1)} {', '.join(lacking)}"
        raise InputError(
            f"robot {robot.name}: no mass and inertia of the link behind {whose}",
            hint="give each joint `link: {mass, com, inertia}`, or read the robot from a URDF with inertials",
        )
    result, before = [], _NO_SCREW
    solids_behind = [joint.link for joint in robot.joints if joint.link is not None]
    for index, (link, solid) in enumerate(zip(links, solids_behind, strict=True)):
        behind = _screw_matrix(link.after)
        xx, yy, zz, xy, xz, yz = solid.inertia
        tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        solids = [(solid.mass, np.array(solid.com), tensor, behind)]
        if index == len(links) - 1:
            loads = (load for load in (robot.tool_load, robot.payload) if load is not None)
            solids += [(load.mass, load.com, load.inertia, behind @ robot.tool) for load in loads]
        screw = before if robot.convention == "standard" else link.before
        result.append(
            DynamicLink(link.prismatic, link.sign, link.theta, link.d, screw, _composite_solid(solids))
        )
        before = link.after
    return tuple(result)


def _screw_matrix(screw: Sequence[float]) -> Array:
    """Return the pose (4, 4) behind a slide along x and a turn about it, and a tilt about y."""
    a, cosine, sine, *tilt = screw
    pose = np.array([[1.0, 0, 0, a], [0, cosine, -sine, 0], [0, sine, cosine, 0], [0, 0, 0, 1]])
    if tilt:
        c, s = tilt
        pose = pose @ np.array([[c, 0, s, 0], [0, 1.0, 0, 0], [-s, 0, c, 0], [0, 0, 0, 1]])
    return pose


def _composite_solid(solids: Sequence[tuple[float, Array, Array, Array]]) -> RigidSolid:
    """Return one solid of several, each by mass, centre, tensor and the pose of the frame they are in."""
    mass, first, second = 0.0, np.zeros(3), np.zeros((3, 3))
    for each, com, tensor, pose in solids:
        center, turn = pose[:3, :3] @ com + pose[:3, 3], pose[:3, :3]
        mass += each
        first = first + each * center
        parallel = each * (center @ center * np.eye(3) - np.outer(center, center))
        second = second + turn @ tensor @ turn.T + parallel
    x, y, z = first.tolist()
    xx, yy, zz, xy, xz, yz = second[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]].tolist()
    return RigidSolid(float(mass), (x, y, z), (xx, yy, zz, xy, xz, yz))


@frozen
class _Motion:
    """How a joint's frame moves, in its own axes.

    Attributes:
        spin: Angular velocity.
        change: Its derivative.
        rise: Acceleration of the origin, gravity included.
    """

    spin: VectorEntries
    change: VectorEntries
    rise: VectorEntries

    def columns(self) -> tuple[VectorEntries, VectorEntries, VectorEntries]:
        """Return the columns of what makes the acceleration of a point of its position in the frame."""
        if self.spin is ZERO and self.change is ZERO:
            return ZERO, ZERO, ZERO
        (x, y, z), (ax, ay, az) = self.spin, self.change
        xx, yy, zz = product(x, x), product(y, y), product(z, z)
        xy, xz, yz = product(x, y), product(x, z), product(y, z)
        return (
            (_minus(total(yy, zz)), total(xy, az), difference(xz, ay)),
            (difference(xy, az), _minus(total(xx, zz)), total(yz, ax)),
            (total(xz, ay), difference(yz, ax), _minus(total(xx, yy))),
        )


def _minus(entry: Entry) -> Entry:
    return -entry


def _recursion(
    links: Sequence[DynamicLink],
    lift: VectorEntries,
    q: Sequence[Array],
    qd: Sequence[Entry] | None,
    qdd: Sequence[Entry] | None,
) -> Iterator[Entry]:
    """Yield the efforts without friction and rotors, from the first joint on, of one block of states."""
    turns = [_turn(link, value) for link, value in zip(links, q, strict=True)]
    motion, at_rest = _Motion(ZERO, ZERO, lift), (ZERO, ZERO, ZERO)
    columns, wrenches = at_rest, []
    for i, (link, turn) in enumerate(zip(links, turns, strict=True)):
        speed = 0.0 if qd is None else product(link.sign, qd[i])
        change = 0.0 if qdd is None else product(link.sign, qdd[i])
        motion, columns = _outwards(link, turn, motion, columns, speed, change)
        wrenches.append(_wrench(link.solid, motion, columns))
    efforts: list[Entry] = []
    force, moment = ZERO, ZERO
    for link, turn, (own_force, own_moment) in zip(links[::-1], turns[::-1], wrenches[::-1], strict=True):
        force, moment = plus(force, own_force), plus(moment, own_moment)
        efforts.append(product(link.sign, (force if link.prismatic else moment)[2]))
        force, moment = _inwards(link, turn, force, moment)
    yield from reversed(efforts)


def _turn(link: DynamicLink, value: Array) -> tuple[Entry, Entry, Entry]:
    if link.prismatic:
        cosine, sine = cos_sin(link.theta)
        return float(cosine), float(sine), total(product(link.sign, value), link.d)
    angle = total(product(link.sign, value), link.theta)
    return np.cos(angle), np.sin(angle), link.d


def _outwards(
    link: DynamicLink,
    turn: tuple[Entry, Entry, Entry],
    motion: _Motion,
    columns: tuple[VectorEntries, VectorEntries, VectorEntries],
    speed: Entry,
    change: Entry,
) -> tuple[_Motion, tuple[VectorEntries, VectorEntries, VectorEntries]]:
    """Return how the frame of a joint moves, from that of the joint before it, with its `columns`."""
    cosine, sine, slide = turn
    rise = _to_joint(link.screw, cosine, sine, advance(motion.rise, link.screw[0], columns[0]))
    spin = _to_joint(link.screw, cosine, sine, motion.spin)
    turning = _to_joint(link.screw, cosine, sine, motion.change)
    if link.prismatic:
        bent = (2.0 * speed, speed)
        rise = (plus_product(rise[0], bent[0], spin[1]), minus_product(rise[1], bent[0], spin[0]), rise[2])
        rise = (rise[0], rise[1], total(rise[2], change))
    else:
        turning = (
            plus_product(turning[0], spin[1], speed),
            minus_product(turning[1], spin[0], speed),
            total(turning[2], change),
        )
        spin = (spin[0], spin[1], total(spin[2], speed))
    still = all(isinstance(entry, float) and entry == 0.0 for entry in (*spin, *turning))
    moving = _Motion(ZERO, ZERO, rise) if still else _Motion(spin, turning, rise)
    own = moving.columns()
    return _Motion(moving.spin, moving.change, advance(rise, slide, own[2])), own


def _to_joint(screw: Sequence[float], cosine: Entry, sine: Entry, vector: VectorEntries) -> VectorEntries:
    """Return a vector in the axes of a joint's frame, from those of the joint before it."""
    if vector is ZERO:
        return ZERO
    x, y, z = vector
    _, c, s, *tilt = screw
    y, z = plus_product(product(c, y), s, z), minus_product(product(c, z), s, y)
    if tilt:
        x, z = minus_product(product(tilt[0], x), tilt[1], z), plus_product(product(tilt[0], z), tilt[1], x)
    return plus_product(product(cosine, x), sine, y), minus_product(product(cosine, y), sine, x), z


def _from_joint(screw: Sequence[float], cosine: Entry, sine: Entry, vector: VectorEntries) -> VectorEntries:
    """Return a vector in the axes of the joint before, from those of a joint's frame."""
    x, y, z = vector
    _, c, s, *tilt = screw
    x, y = minus_product(product(cosine, x), sine, y), plus_product(product(cosine, y), sine, x)
    if tilt:
        x, z = plus_product(product(tilt[0], x), tilt[1], z), minus_product(product(tilt[0], z), tilt[1], x)
    return x, minus_product(product(c, y), s, z), plus_product(product(c, z), s, y)


def _wrench(
    solid: RigidSolid, motion: _Motion, columns: tuple[VectorEntries, VectorEntries, VectorEntries]
) -> tuple[VectorEntries, VectorEntries]:
    """Return the force on a solid and its moment about the origin of the joint's frame."""
    force = scaled(solid.mass, motion.rise)
    moment = cross(solid.first, motion.rise)
    if columns[0] is ZERO:
        return force, moment
    for distance, column in zip(solid.first, columns, strict=True):
        force = advance(force, distance, column)
    gyroscopic = cross(motion.spin, _times(solid.second, motion.spin))
    return force, plus(plus(moment, _times(solid.second, motion.change)), gyroscopic)


def _times(second: Sequence[float], vector: VectorEntries) -> VectorEntries:
    xx, yy, zz, xy, xz, yz = second
    return dot((xx, xy, xz), vector), dot((xy, yy, yz), vector), dot((xz, yz, zz), vector)


def _inwards(
    link: DynamicLink, turn: tuple[Entry, Entry, Entry], force: VectorEntries, moment: VectorEntries
) -> tuple[VectorEntries, VectorEntries]:
    """Return force and moment about the origin of the frame of the joint before."""
    cosine, sine, slide = turn
    x, y, _ = force
    moment = (minus_product(moment[0], slide, y), plus_product(moment[1], slide, x), moment[2])
    force = _from_joint(link.screw, cosine, sine, force)
    moment = _from_joint(link.screw, cosine, sine, moment)
    a = link.screw[0]
    return force, (moment[0], minus_product(moment[1], a, force[2]), plus_product(moment[2], a, force[1]))
