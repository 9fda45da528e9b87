"""Text of a robot in URDF: joints with limits, and simple shapes of the links.

URDF has no negative DH direction, but axes: a joint of sign -1 has the axis 0 0 -1. Lengths are in m, angles
in rad. What URDF cannot say is in a comment: limits of acceleration and jerk, bounds of one side, rotors.
Limits of velocity by position stand in Franka's element for them.

Source: the URDF XML specification of urdfdom, version 1.0 (https://wiki.ros.org/urdf/XML).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError
from trajcli.geometry.euler import rpy_from_matrix
from trajcli.kinematics.robot import LinkInertia, Robot
from trajcli.urdf.chain import FIRST_LINK, TOOL, WORLD, UrdfJoint, chain_of

UNLIMITED = 1e6
"""What stands for no limit where URDF asks for a number: rad, m, or per second."""

_THICKNESS = 0.03  # radius of a link over the length of all links
_SMALLEST_RADIUS = 0.002  # m
_JOINT_RADIUS = 1.6  # radius of a joint's sphere over that of its link
_COLOURS = {"grey": "0.55 0.58 0.62 1", "orange": "0.90 0.45 0.10 1"}
_NOT_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_ENTITIES = {
    "&": "&amp;",
    "<": "&lt;",
    ">": "&gt;",
    '"': "&quot;",
    "\t": "&#9;",
    "\n": "&#10;",
    "\r": "&#13;",
}
_HEAD = """\
<?xml version="1.0"?>
<!-- Written by trajcli from a Denavit-Hartenberg table. The shapes are only lines between joints.
     effort="0": unknown. Limits of acceleration and jerk have no element in this version of the format.
     {unlimited:.0f} stands for no limit. -->
"""


def urdf_of(robot: Robot) -> str:
    """Return the URDF of a robot, from `world` to `tool0`.

    The joints have their names, ranges and velocities; their values are those of the robot.

    Raises:
        InputError: When the robot has no geometry, or a name that XML cannot hold.
    """
    chain = chain_of(robot)
    names = {joint.name for joint in chain.joints}
    lengths = [chain.skeleton, *(joint.skeleton for joint in chain.joints)]
    total = sum(float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum()) for points in lengths)
    radius = max(_THICKNESS * total, _SMALLEST_RADIUS)
    lines = [f'<robot name="{_escaped(robot.name)}">']
    lines += [
        f'  <material name="{name}"><color rgba="{rgba}"/></material>' for name, rgba in _COLOURS.items()
    ]
    lines += [f'  <link name="{WORLD}"/>', *_link(FIRST_LINK, _tube(chain.skeleton, radius), radius, "grey")]
    lines += _fixed(_free("base_fixed_joint", names), WORLD, FIRST_LINK, chain.base)
    for number, (parent, joint) in enumerate(zip(chain.links, chain.joints, strict=False)):
        lines += _moving(joint, parent, robot, number)
        shapes = _tube(joint.skeleton, radius) + _rod(joint, robot.limits.position[number], radius)
        solid = robot.joints[number].link
        inertial = [] if solid is None else [_inertial(solid, joint.row)]
        lines += _link(joint.link, shapes, radius, ("orange", "grey")[number % 2], inertial)
    lines += [f'  <link name="{TOOL}"/>']
    lines += _fixed(_free("tool_fixed_joint", names), chain.links[-1], TOOL, chain.tool)
    return _HEAD.format(unlimited=UNLIMITED) + "\n".join([*lines, "</robot>"]) + "\n"


def _free(name: str, taken: set[str]) -> str:
    return name if name not in taken else _free(name + "_", taken)


def _fixed(name: str, parent: str, child: str, origin: Array) -> Iterator[str]:
    yield f'  <joint name="{name}" type="fixed">'
    yield f'    <parent link="{parent}"/><child link="{child}"/>'
    yield f"    {_origin(origin)}"
    yield "  </joint>"


def _moving(joint: UrdfJoint, parent: str, robot: Robot, number: int) -> Iterator[str]:
    """Yield the element of a joint that moves."""
    low, high = robot.limits.position[number].tolist()
    endless = not joint.prismatic and low == -np.inf and high == np.inf
    kind = "prismatic" if joint.prismatic else "continuous" if endless else "revolute"
    # one number stands for both directions: the smaller one is safe
    velocity = _bounded(float(np.abs(robot.limits.velocity[number]).min()))
    least = min(map(abs, robot.joints[number].effort))
    effort = "0" if least == np.inf else repr(least)
    span = "" if endless else f'lower="{_bounded(low)!r}" upper="{_bounded(high)!r}" '
    yield f'  <joint name="{_escaped(joint.name)}" type="{kind}">'
    yield f'    <parent link="{parent}"/><child link="{joint.link}"/>'
    yield f"    {_origin(joint.origin)}"
    yield f'    <axis xyz="0 0 {joint.sign}"/>'
    yield f'    <limit {span}effort="{effort}" velocity="{velocity!r}"/>'
    deceleration, offset = robot.limits.velocity_by_position[number].tolist()
    if np.isfinite(deceleration):
        near = f'deceleration_limit="{deceleration!r}" velocity_offset="{offset!r}"'
        yield f"    <position_based_velocity_limits {near}/>"
    friction, rotor = robot.joints[number].friction, robot.joints[number].rotor
    if friction.coulomb or friction.viscous:
        yield f'    <dynamics damping="{friction.viscous!r}" friction="{friction.coulomb!r}"/>'
    if rotor:
        unit = "kg" if joint.prismatic else "kg m^2"
        yield f"    <!-- rotor: {rotor!r} {unit}, which the format has no element for -->"
    yield "  </joint>"


def _bounded(value: float) -> float:
    return float(np.clip(value, -UNLIMITED, UNLIMITED))


def _link(
    name: str, shapes: Sequence[str], radius: float, colour: str, inertial: Sequence[str] = ()
) -> Iterator[str]:
    yield f'  <link name="{name}">'
    yield from (f"    {line}" for line in inertial)
    for shape in [f'<geometry><sphere radius="{_JOINT_RADIUS * radius:.6g}"/></geometry>', *shapes]:
        yield f'    <visual>{shape}<material name="{colour}"/></visual>'
    yield "  </link>"


def _inertial(solid: LinkInertia, row: Array) -> str:
    """Return the element of a link's mass: its axes are those of the row's frame, given in the link's."""
    pose = row.copy()
    pose[:3, 3] += row[:3, :3] @ np.array(solid.com)
    names = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    tensor = " ".join(f'{name}="{value!r}"' for name, value in zip(names, solid.inertia, strict=True))
    return f'<inertial>{_origin(pose)}<mass value="{solid.mass!r}"/><inertia {tensor}/></inertial>'


def _tube(points: Array, radius: float) -> list[str]:
    """Return a cylinder along each part of a line through points (k, 3)."""
    shapes = []
    for start, end in pairwise(points):
        length = float(np.linalg.norm(end - start))
        if length > 0.0:
            x, y, z = ((end - start) / length).tolist()
            turn = (0.0, float(np.arctan2(np.hypot(x, y), z)), float(np.arctan2(y, x)))
            origin = f'<origin xyz="{_numbers((start + end) / 2)}" rpy="{_numbers(turn)}"/>'
            cylinder = f'<cylinder radius="{radius:.6g}" length="{length!r}"/>'
            shapes.append(f"{origin}<geometry>{cylinder}</geometry>")
    return shapes


def _rod(joint: UrdfJoint, bounds: Array, radius: float) -> list[str]:
    """Return the rod of a slide: from its frame through where that stands at q = 0."""
    furthest = float(bounds[np.abs(bounds).argmax()])
    if not joint.prismatic or not np.isfinite(furthest):
        return []
    return _tube(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, -joint.sign * furthest]]), radius / 2)


def _origin(pose: Array) -> str:
    return f'<origin xyz="{_numbers(pose[:3, 3])}" rpy="{_numbers(rpy_from_matrix(pose[:3, :3]).angles)}"/>'


def _numbers(values: Array | Sequence[float]) -> str:
    return " ".join(repr(float(value) + 0.0) for value in values)


def _escaped(name: str) -> str:
    """Return a name as the value of an attribute."""
    if _NOT_XML.search(name):
        raise InputError(f"the name {name!r} holds a character that XML cannot hold", hint="rename it")
    return "".join(_ENTITIES.get(letter, letter) for letter in name)
