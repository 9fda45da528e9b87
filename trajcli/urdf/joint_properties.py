"""Limits, friction and inertia in a URDF, and its numbers that mean nothing.

Many files hold numbers that mean nothing: a velocity of 0 or 100 rad/s, an effort of 1000 N m, equal ends of
a range. They are taken as unknown, each with a note.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from math import inf

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError
from trajcli.frozen import frozen
from trajcli.geometry.euler import matrix_from_rpy
from trajcli.kinematics.robot import Friction, LinkInertia
from trajcli.urdf.read import Element, JointElement, UrdfDocument

LEAST_PLACEHOLDER_VELOCITY = 100.0
"""Velocity from which on it is a placeholder, rad/s or m/s."""
LEAST_PLACEHOLDER_EFFORT = 1000.0
"""Effort from which on it is a placeholder, N m or N."""

LEAST_PLACEHOLDER_POSITION = 1e6
"""Both ends of a range from which on there is none, rad or m: what stands for infinite in our own URDFs."""

_XYZ, _PRODUCTS = (0.0, 0.0, 0.0), ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
_UNLIMITED = (-inf, inf)


@frozen
class JointProperties:
    """What a URDF says about a joint beside its geometry; bounds are (lower, upper), SI.

    Attributes:
        position: Infinite ends where it has no range.
        velocity: Infinite where it is not known, as below.
        acceleration: By direction: deceleration bounds it below.
        jerk: Of URDF 1.2, as the acceleration.
        effort: N m or N.
        friction: Of the joint.
        velocity_by_position: Deceleration and offset of Franka's `<position_based_velocity_limits>`: |v| at
            most max(0, sqrt(2 d (distance to the end)) - o). An infinite d where there are none.
        notes: What was taken as unknown, and why.
    """

    position: tuple[float, float]
    velocity: tuple[float, float]
    acceleration: tuple[float, float]
    jerk: tuple[float, float]
    effort: tuple[float, float]
    friction: Friction
    velocity_by_position: tuple[float, float]
    notes: tuple[str, ...]


def joint_properties(document: UrdfDocument, joint: JointElement, *, soft: bool) -> JointProperties:
    """Return the limits and the friction of a joint.

    Args:
        document: The file.
        joint: Of it.
        soft: Whether the soft limits of `<safety_controller>` tighten its range.

    Raises:
        InputError: When one of its numbers is none, or a friction is negative.
    """
    notes: list[str] = []
    limit = joint.element.first("limit")
    position = _position(document, joint, limit, notes)
    if soft:
        position = _softened(document, joint, position, notes)
    return JointProperties(
        position,
        _symmetric(_velocity(document, joint, limit, notes)),
        _acceleration(document, joint, limit, notes),
        _symmetric(_positive(document, joint, limit, "jerk", notes)),
        _symmetric(_effort(document, joint, limit, notes)),
        _friction(document, joint),
        _velocity_by_position(document, joint),
        tuple(notes),
    )


def _symmetric(bound: float | None) -> tuple[float, float]:
    return _UNLIMITED if bound is None else (-bound, bound)


def _position(
    document: UrdfDocument, joint: JointElement, limit: Element | None, notes: list[str]
) -> tuple[float, float]:
    """Return the range of a joint; an end that is absent is zero, as urdfdom has it."""
    if joint.type == "continuous":
        return _UNLIMITED
    low, high = (document.number(limit, end) for end in ("lower", "upper"))
    if low is None and high is None:
        notes.append(f"{joint.name}: no range in the file, position null")
        return _UNLIMITED
    low, high = low or 0.0, high or 0.0
    if low <= -LEAST_PLACEHOLDER_POSITION and high >= LEAST_PLACEHOLDER_POSITION:
        notes.append(f"{joint.name}: the range {low:g} to {high:g} is a placeholder, position null")
        return _UNLIMITED
    if low >= high:
        notes.append(f"{joint.name}: lower {low:g} is not below upper {high:g}, a placeholder: position null")
        return _UNLIMITED
    return max(low, -LEAST_PLACEHOLDER_POSITION), min(high, LEAST_PLACEHOLDER_POSITION)


def _softened(
    document: UrdfDocument, joint: JointElement, position: tuple[float, float], notes: list[str]
) -> tuple[float, float]:
    safety = joint.element.first("safety_controller")
    low, high = (document.number(safety, f"soft_{end}_limit") for end in ("lower", "upper"))
    if low is None and high is None:
        notes.append(f"{joint.name}: no soft limits in the file")
        return position
    inner = max(position[0], low or 0.0), min(position[1], high or 0.0)
    if inner[0] >= inner[1]:
        notes.append(f"{joint.name}: soft limits {low or 0.0:g} to {high or 0.0:g} leave no range, not used")
        return position
    return inner


def _velocity(
    document: UrdfDocument, joint: JointElement, limit: Element | None, notes: list[str]
) -> float | None:
    value = document.number(limit, "velocity")
    if value is None:
        notes.append(f"{joint.name}: no velocity in the file, velocity null")
    elif not 0.0 < value < LEAST_PLACEHOLDER_VELOCITY:
        notes.append(f"{joint.name}: velocity {value:g} is a placeholder, velocity null")
        value = None
    return value


def _effort(
    document: UrdfDocument, joint: JointElement, limit: Element | None, notes: list[str]
) -> float | None:
    value = document.number(limit, "effort")
    if value is not None and not 0.0 < value < LEAST_PLACEHOLDER_EFFORT:
        notes.append(f"{joint.name}: effort {value:g} is a placeholder, effort null")
        value = None
    return value


def _positive(
    document: UrdfDocument, joint: JointElement, limit: Element | None, name: str, notes: list[str]
) -> float | None:
    """Return a limit of URDF 1.2; None where it is absent, infinite, or not above zero."""
    value = document.number(limit, name)
    if value is not None and not value > 0.0:
        notes.append(f"{joint.name}: {name} {value:g} is a placeholder, {name} null")
        return None
    return None if value == inf else value


def _acceleration(
    document: UrdfDocument, joint: JointElement, limit: Element | None, notes: list[str]
) -> tuple[float, float]:
    """Return [-deceleration, acceleration]; one that is absent is as the other."""
    up, down = (_positive(document, joint, limit, name, notes) for name in ("acceleration", "deceleration"))
    if up is None and down is not None:
        notes.append(f"{joint.name}: a deceleration without an acceleration, taken for both directions")
    up, down = (up if up is not None else down), (down if down is not None else up)
    return _UNLIMITED if up is None or down is None else (-down, up)


def _friction(document: UrdfDocument, joint: JointElement) -> Friction:
    element = joint.element.first("dynamics")
    values = []
    for name in ("friction", "damping"):
        value = document.number(element, name) or 0.0
        if not 0.0 <= value < inf:
            message = f"{name} of joint '{joint.name}': expected a number of at least 0, got {value:g}"
            raise document.refused(message, element or joint.element, name)
        values.append(value)
    return Friction(*values)


def _velocity_by_position(document: UrdfDocument, joint: JointElement) -> tuple[float, float]:
    element = joint.element.first("position_based_velocity_limits")
    if element is None:
        return inf, 0.0
    deceleration = document.number(element, "deceleration_limit")
    offset = document.number(element, "velocity_offset") or 0.0
    if deceleration is None or not 0.0 < deceleration < inf or not 0.0 <= offset < inf:
        message = (
            f"joint '{joint.name}': expected a deceleration_limit above 0 and a velocity_offset of at least 0"
        )
        raise document.refused(message, element)
    return deceleration, offset


def link_inertia(
    document: UrdfDocument, parts: Sequence[tuple[str, Array]], notes: list[str]
) -> LinkInertia | None:
    """Return the inertia of links that move as one; None where none of them has a mass.

    Args:
        document: The file.
        parts: Each link with the pose of its frame in the frame that counts, shape (4, 4).
        notes: Gets a line for each link whose inertia no rigid body has: it is left out.

    Raises:
        InputError: When a number is none.
    """
    masses, centers, tensors = [], [], []
    for link, pose in parts:
        for mass, center, tensor in _inertials(document, link, notes):
            masses.append(mass)
            centers.append(pose[:3, :3] @ center + pose[:3, 3])
            tensors.append(pose[:3, :3] @ tensor @ pose[:3, :3].T)
    total = math.fsum(masses)
    if not total > 0.0:
        return None
    com = sum((m * c for m, c in zip(masses, centers, strict=True)), np.zeros(3)) / total
    whole = np.zeros((3, 3))
    for mass, center, tensor in zip(masses, centers, tensors, strict=True):
        arm = center - com
        whole += tensor + mass * ((arm @ arm) * np.eye(3) - np.outer(arm, arm))
    products = (whole[0, 0], whole[1, 1], whole[2, 2], whole[0, 1], whole[0, 2], whole[1, 2])
    x, y, z = com.tolist()
    ixx, iyy, izz, ixy, ixz, iyz = map(float, products)
    return LinkInertia(float(total), (x, y, z), (ixx, iyy, izz, ixy, ixz, iyz))


def _inertials(document: UrdfDocument, link: str, notes: list[str]) -> Iterator[tuple[float, Array, Array]]:
    """Yield mass, centre of mass and tensor about it in the axes of the link's frame, where it has them."""
    inertial = document.links[link].first("inertial")
    if inertial is None:
        return
    mass = document.number(inertial.first("mass"), "value")
    ixx, iyy, izz, ixy, ixz, iyz = (
        document.number(inertial.first("inertia"), name) or 0.0 for name in _PRODUCTS
    )
    if not mass and not any((ixx, iyy, izz, ixy, ixz, iyz)):
        return
    try:
        LinkInertia(mass or 0.0, _XYZ, (ixx, iyy, izz, ixy, ixz, iyz))
    except InputError as error:
        notes.append(f"link {link}: {error}; its inertia is left out")
        return
    origin = origin_of(document, inertial)
    tensor = np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])
    turn = origin[:3, :3]
    yield float(mass or 0.0), origin[:3, 3], turn @ tensor @ turn.T


def origin_of(document: UrdfDocument, element: Element, snapped: Array | None = None) -> Array:
    """Return the pose of an element's `<origin>`, shape (4, 4).

    Args:
        document: The file.
        element: Whose origin is meant; identity where it has none.
        snapped: Angles (3,) instead of those of the file, rad.
    """
    origin = element.first("origin")
    pose = np.eye(4)
    pose[:3, :3] = matrix_from_rpy(document.numbers(origin, "rpy", 3, _XYZ) if snapped is None else snapped)
    pose[:3, 3] = document.numbers(origin, "xyz", 3, _XYZ)
    return pose
