"""Robot model as frozen values: joints by Denavit-Hartenberg row, limits, base and tool. No current state."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field, replace
from math import inf
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike

from trajcli.curves.piecewise import Array, read_only
from trajcli.errors import InputError
from trajcli.frozen import comparable, frozen

if TYPE_CHECKING:
    from trajcli.curves.approach import ApproachLimits

JointType = Literal["revolute", "prismatic"]
Convention = Literal["standard", "modified"]
QUANTITIES = ("position", "velocity", "acceleration", "jerk")
GEOMETRY_HINT = "give each joint its DH row (theta, d, a, alpha) and the robot its convention"
"""What gives bare joints a geometry."""

GRAVITY = (0.0, 0.0, -9.81)
"""Acceleration of a body that falls, in world, m/s^2, where nothing else is said."""

_INERTIA_ROUNDING = 1e-6  # of the largest moment: files have some six digits
_SMALL_POSITION = 1e-3  # rad or m: what goes beyond a position bound smaller than this is relative to this


@comparable
class Friction:
    """Friction of a joint: coulomb sign(qd) + viscous qd opposes it.

    Attributes:
        coulomb: N m or N, at least 0.
        viscous: N m s/rad or N s/m, at least 0.
    """

    coulomb: float = 0.0
    viscous: float = 0.0


@comparable
class LinkInertia:
    """Mass of a link and how it is spread; in SI whatever the units of a file.

    Attributes:
        mass: kg, above 0.
        com: Centre of mass in the frame of the link's row, m.
        inertia: ixx, iyy, izz, ixy, ixz, iyz about the centre of mass in the axes of that frame, kg m^2: the
            tensor's own entries, products with their sign.

    Raises:
        InputError: When no rigid solid has them.
    """

    mass: float
    com: tuple[float, float, float]
    inertia: tuple[float, float, float, float, float, float]

    def __post_init__(self) -> None:
        xx, yy, zz, xy, xz, yz = self.inertia
        tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        require_possible_solid(self.mass, np.array(self.com), tensor)


def require_possible_solid(
    mass: float, com: Array, inertia: Array, *, least_mass: float | None = None
) -> None:
    """Raise when no rigid solid has such a mass and inertia; a point mass and a thin rod are possible.

    Args:
        mass: kg.
        com: Centre of mass, m, shape (3,).
        inertia: Tensor about the centre of mass, kg m^2, shape (3, 3).
        least_mass: What the mass may be at least, kg; it must be above 0 unless given.

    Raises:
        InputError: When the mass is too small, a number not finite, the tensor not symmetric, a principal
            moment negative or above the sum of the two others.
    """
    if not (0.0 < mass < inf if least_mass is None else least_mass <= mass < inf):
        least = "above 0 kg" if least_mass is None else f"of at least {least_mass:g} kg"
        raise InputError(f"expected a mass {least}, got {mass:g}")
    if not (np.isfinite(com).all() and np.isfinite(inertia).all()):
        raise InputError("expected finite numbers for the centre of mass and the inertia")
    slack = _INERTIA_ROUNDING * float(np.abs(inertia).max())
    if np.abs(inertia - inertia.T).max() > slack:
        raise InputError("a tensor of inertia is symmetric: its products come in equal pairs")
    moments = np.linalg.eigvalsh(inertia).tolist()
    slack = _INERTIA_ROUNDING * max(map(abs, moments))
    shown = ", ".join(f"{moment:.6g}" for moment in moments)
    if moments[0] < -slack:
        raise InputError(f"no solid has a negative moment of inertia: the principal ones are {shown}")
    if moments[2] > moments[0] + moments[1] + slack:
        raise InputError(
            "no solid has a moment of inertia above the sum of the two others: "
            f"the principal ones are {shown}",
            hint="check signs and units (kg m^2), and that it is about the centre of mass",
        )


@frozen
class Payload:
    """A rigid solid that is fixed to the tcp.

    Attributes:
        mass: kg, at least 0.
        com: Centre of mass in the frame of the tcp, m, shape (3,).
        inertia: Tensor about the centre of mass in the axes of the tcp, kg m^2, shape (3, 3).

    Raises:
        InputError: When no rigid solid has them.
    """

    mass: float
    com: Array
    inertia: Array

    def __post_init__(self) -> None:
        for name, shape in (("com", (3,)), ("inertia", (3, 3))):
            values = read_only(getattr(self, name))
            if values.shape != shape:
                raise InputError(f"payload: expected {name} of shape {shape}, got {values.shape}")
            object.__setattr__(self, name, values)
        require_possible_solid(self.mass, self.com, self.inertia, least_mass=0.0)

    @property
    def bits(self) -> tuple[float, bytes, bytes]:
        """All of it, as a key."""
        return self.mass, self.com.tobytes(), self.inertia.tobytes()

    def seen_from(self, frame: Array) -> Payload:
        """Return the same solid as a frame (4, 4) has it that is given in the frame of the tcp."""
        axes = frame[:3, :3].T
        return Payload(self.mass, axes @ (self.com - frame[:3, 3]), axes @ self.inertia @ axes.T)

    def __repr__(self) -> str:
        com = ", ".join(f"{x:g}" for x in self.com.tolist())
        return f"{type(self).__name__}({self.mass:g} kg at [{com}] m)"


def point_mass(mass: float, com: ArrayLike = (0.0, 0.0, 0.0)) -> Payload:
    """Return a payload without extent.

    Args:
        mass: kg, at least 0.
        com: Its place in the frame of the tcp, m, shape (3,).

    Raises:
        InputError: When the mass is negative.
    """
    return Payload(mass, np.asarray(com, dtype=np.float64), np.zeros((3, 3)))


@frozen
class MountedTool:
    """A tool on the flange.

    Attributes:
        pose: T_flange_tcp, shape (4, 4), m.
        load: Its own mass, in the frame of its tcp; None where nobody says.
        name: By which the job calls it; empty without one.
    """

    pose: Array
    load: Payload | None = None
    name: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "pose", read_only(self.pose))

    @property
    def bits(self) -> tuple[object, ...]:
        """All of it, as a key."""
        return self.name, self.pose.tobytes(), None if self.load is None else self.load.bits

    def __eq__(self, other: object) -> bool:
        """Return whether another tool is the same, bit by bit."""
        return isinstance(other, MountedTool) and self.bits == other.bits

    def __hash__(self) -> int:
        """Return the hash of all of it."""
        return hash(self.bits)


@comparable
class Joint:
    """One joint and its DH row: theta_i = theta + sign q (revolute), d_i = d + sign q (prismatic).

    Attributes:
        name: Unique within the robot.
        type: Revolute (rad) or prismatic (m).
        theta: Angle about z, rad.
        d: Offset along z, m.
        a: Length along x, m.
        alpha: Angle about x, rad.
        sign: 1 or -1: the direction in which the joint counts.
        beta: Angle about y behind alpha, rad: where two axes are almost parallel, d would be far off and
            depend on the last digit of alpha without it.
        effort: Lowest and highest torque or force that the maker states, N m or N; infinite where it is not
            known. What is in force stands in `Limits.effort`.
        friction: Of the joint.
        rotor: Inertia of the motor as the joint feels it, kg m^2 (kg for a slide).
        link: Mass and inertia of the link behind the joint, with all that is fixed to it; None where unknown.

    Effort, friction, rotor and link are those of inverse dynamics, `trajcli/dynamics/`.

    Source: Hayati (1983), for beta.
    """

    name: str
    type: JointType = "revolute"
    theta: float = 0.0
    d: float = 0.0
    a: float = 0.0
    alpha: float = 0.0
    sign: int = 1
    beta: float = 0.0
    effort: tuple[float, float] = (-inf, inf)
    friction: Friction = Friction()
    rotor: float = 0.0
    link: LinkInertia | None = None


@comparable
class ToolLimits:
    """Bounds of the tool's motion, magnitudes; infinite means unlimited, and is not checked.

    Attributes:
        speed: m/s.
        acceleration: m/s^2.
        jerk: m/s^3.
        angular_speed: rad/s.
        angular_acceleration: rad/s^2.
        angular_jerk: rad/s^3.
    """

    speed: float = inf
    acceleration: float = inf
    jerk: float = inf
    angular_speed: float = inf
    angular_acceleration: float = inf
    angular_jerk: float = inf


def _no_rows() -> Array:
    """Return what stands for limits of a kind that no joint has."""
    return np.empty((0, 2))


@frozen
class Limits:
    """Lower and upper bounds by joint; an infinite one means unlimited, and is not checked.

    Attributes:
        position: Shape (n, 2), rad or m.
        velocity: Shape (n, 2), per second; lower < 0 < upper.
        acceleration: Shape (n, 2), per second squared; lower < 0 < upper.
        jerk: Shape (n, 2), per second cubed; lower < 0 < upper.
        tcp: Of the tool.
        velocity_by_position: Shape (n, 2): d, per second squared, infinite for no such limit, and o, per
            second, of |v| <= max(0, sqrt(2 d x) - o) at the distance x from the position limit ahead.
        effort: Shape (n, 2), of the torque or force, N m or N; lower < 0 < upper.
    """

    position: Array
    velocity: Array
    acceleration: Array
    jerk: Array
    tcp: ToolLimits = ToolLimits()
    velocity_by_position: Array = field(default_factory=_no_rows)
    effort: Array = field(default_factory=_no_rows)

    def __post_init__(self) -> None:
        if not len(self.effort):
            object.__setattr__(self, "effort", np.tile([-np.inf, np.inf], (len(self.position), 1)))
        for index, name in enumerate((*QUANTITIES, "effort")):
            bounds = read_only(getattr(self, name))
            if bounds.ndim != 2 or bounds.shape[1] != 2 or np.isnan(bounds).any():
                raise ValueError(f"{name} limits: expected shape (n, 2) without NaN, got {bounds.shape}")
            low, high = bounds[:, 0], bounds[:, 1]
            if (low > high).any() or (index and not ((low < 0) & (high > 0)).all()):
                raise ValueError(
                    f"{name} limits: lower must be below {'0 and 0 below upper' if index else 'upper'}"
                )
            object.__setattr__(self, name, bounds)
        object.__setattr__(self, "velocity_by_position", self._checked_by_position())

    def _checked_by_position(self) -> Array:
        """Return the limits of velocity by position, one row for each joint."""
        given, n = self.velocity_by_position, len(self.position)
        rows = read_only(given if len(given) else np.tile([np.inf, 0.0], (n, 1)))
        if rows.shape != (n, 2) or not ((rows[:, 0] > 0) & (rows[:, 1] >= 0) & (rows[:, 1] < np.inf)).all():
            raise ValueError("velocity_by_position: expected n rows of a deceleration above 0 and an offset")
        if not np.isfinite(self.position[np.isfinite(rows[:, 0])]).all():
            raise ValueError("velocity_by_position needs position limits")
        return rows

    def __repr__(self) -> str:
        limited = [name for name in (*QUANTITIES, "effort") if np.isfinite(getattr(self, name)).any()]
        return f"Limits({len(self.position)} joints: {', '.join(limited) or 'none'})"

    @property
    def has_effort(self) -> bool:
        """Whether the torque or force of some joint is limited."""
        return bool(np.isfinite(self.effort).any())

    @property
    def has_velocity_by_position(self) -> bool:
        """Whether the velocity of some joint is limited by its position."""
        return bool(np.isfinite(self.velocity_by_position[:, 0]).any())

    @property
    def approach(self) -> ApproachLimits:
        """The limits of velocity by position, as those of an approach to the ends of the ranges."""
        from trajcli.curves.approach import ApproachLimits

        deceleration, offset = self.velocity_by_position.T
        return ApproachLimits(self.position, deceleration, offset)

    def of_order(self, order: int) -> Array:
        """Return the bounds (n, 2) of the derivative of the given order, 0 (position) to 3 (jerk)."""
        return getattr(self, QUANTITIES[order])  # type: ignore[no-any-return]


def unlimited(joints: int) -> Limits:
    """Return limits that bound nothing."""
    none = np.tile([-np.inf, np.inf], (joints, 1))
    return Limits(none, none, none, none)


def share_of_limits(extremes: Sequence[tuple[Array, Array]], limits: Limits) -> Array:
    """Return how much of its limits a motion uses: above 1 where it breaks one, shape (...).

    Args:
        extremes: Lowest and highest value, each (..., n), of position, velocity, acceleration and jerk.
        limits: Those of the n joints. Position counts as 1 plus what it goes beyond, relative to the bound.
    """
    shares = []
    for order, (low, high) in enumerate(extremes):
        lower, upper = limits.of_order(order).T
        if order:
            shares.append(np.maximum(low / lower, high / upper).max(axis=-1))
            continue
        beyond = np.maximum((lower - low) / _scale(lower), (high - upper) / _scale(upper))
        shares.append(1 + np.maximum(beyond.max(axis=-1), -1.0))
    share: Array = np.max(shares, axis=0)
    return share


def _scale(bound: Array) -> Array:
    return np.where(np.isfinite(bound), np.maximum(np.abs(bound), _SMALL_POSITION), 1.0)


@frozen
class Robot:
    """A serial robot.

    Attributes:
        name: For messages and reports.
        joints: 1 to 12 joints.
        limits: The limits in force.
        convention: Whose DH rows the joints are; None for bare joints, which have no geometry.
        base: T_world_base, shape (4, 4).
        tool: T_flange_tcp, shape (4, 4).
        gravity: Acceleration of a body that falls, in world, shape (3,), m/s^2.
        payload: What the tool carries; None for nothing.
        tool_load: The tool's own mass, in the frame of the tcp like the payload; None where nobody says.
        tool_name: By which a job calls the tool; empty without one.
        foot: Where the first row stands in the frame of the base, (4, 4), which `base` then contains: that of
            a rail, whose axis need not be vertical; None for the frame of the base itself.
    """

    name: str
    joints: tuple[Joint, ...]
    limits: Limits
    convention: Convention | None
    base: Array
    tool: Array
    gravity: Array = field(default_factory=lambda: np.array(GRAVITY))
    payload: Payload | None = None
    tool_load: Payload | None = None
    tool_name: str = ""
    foot: Array | None = None

    def __post_init__(self) -> None:
        for name in ("base", "tool", "gravity"):
            object.__setattr__(self, name, read_only(getattr(self, name)))

    def __repr__(self) -> str:
        joints = f"{len(self.joints)} joint{'s' * (len(self.joints) != 1)}"
        table = "bare joints" if self.convention is None else f"{self.convention} DH rows"
        return f"{type(self).__name__}({self.name!r}, {joints}, {table})"

    @property
    def stand(self) -> Array:
        """The frame of the base in world, (4, 4): what a job calls `base`."""
        return self.base if self.foot is None else np.asarray(self.base @ np.linalg.inv(self.foot))

    def standing_at(self, base: Array) -> Robot:
        """Return the robot with its base elsewhere, T_world_base (4, 4)."""
        return replace(self, base=base if self.foot is None else base @ self.foot)

    def with_tool(self, tool: MountedTool) -> Robot:
        """Return the robot with another tool; a payload keeps its place on the flange."""
        payload = self.payload
        if payload is not None and not np.array_equal(tool.pose, self.tool):
            payload = payload.seen_from(np.asarray(np.linalg.inv(self.tool) @ tool.pose))
        return replace(self, tool=tool.pose, tool_load=tool.load, tool_name=tool.name, payload=payload)

    @property
    def equipment(self) -> tuple[object, ...]:
        """All that is on the flange, as a key."""
        loads = (None if load is None else load.bits for load in (self.payload, self.tool_load))
        return (self.tool.tobytes(), *loads)

    def seen_from(self, frame: Array) -> Robot:
        """Return the robot as it stands in a frame T_world_frame (4, 4), in which its tool is then said."""
        base, axes = np.eye(4), frame[:3, :3].T
        base[:3, :3], base[:3, 3] = axes @ self.base[:3, :3], axes @ (self.base[:3, 3] - frame[:3, 3])
        return replace(self, base=base, gravity=axes @ self.gravity)

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints, from the base on."""
        return tuple(joint.name for joint in self.joints)

    @property
    def joint_types(self) -> tuple[JointType, ...]:
        """Types of the joints, from the base on."""
        return tuple(joint.type for joint in self.joints)

    @property
    def without_inertia(self) -> tuple[str, ...]:
        """Names of the joints whose links have no known mass and inertia."""
        return tuple(joint.name for joint in self.joints if joint.link is None)
