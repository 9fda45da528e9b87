"""Frames of a robot in URDF: each joint turns or slides about the z axis of its own frame.

A Denavit-Hartenberg row is cut at its joint: what stands before the variable belongs to the joint's origin,
what stands behind it to the origin of the next joint. The frame of a link is that of its joint.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from trajcli.curves.piecewise import Array, read_only
from trajcli.errors import InputError
from trajcli.frozen import frozen
from trajcli.geometry.rotation import cos_sin, quaternion_from_matrix
from trajcli.kinematics.robot import GEOMETRY_HINT, Joint, Robot

WORLD, FIRST_LINK, TOOL = "world", "base_link", "tool0"

_Step = tuple[Literal["turn z", "slide z", "turn x", "slide x", "turn y"], float]


@frozen
class UrdfJoint:
    """A joint, the link behind it and the shape of that link.

    Attributes:
        name: As in the robot.
        link: Name of the link behind it.
        prismatic: Whether it slides.
        sign: 1 or -1: its axis is 0 0 sign.
        origin: Pose of its frame at q = 0 in the frame of the link before, shape (4, 4).
        skeleton: Points from its frame's origin to that of the next joint, in its frame, shape (k, 3), m.
        row: Pose of the frame of its Denavit-Hartenberg row in its frame, shape (4, 4).
    """

    name: str
    link: str
    prismatic: bool
    sign: int
    origin: Array
    skeleton: Array
    row: Array

    def __post_init__(self) -> None:
        for name in ("origin", "skeleton", "row"):
            object.__setattr__(self, name, read_only(getattr(self, name)))


@frozen
class UrdfChain:
    """The frames from `world` over `base_link` and the links to `tool0`.

    Attributes:
        base: Pose of `base_link` in `world`, shape (4, 4).
        joints: From the base on.
        tool: Pose of `tool0` in the frame of the last link, shape (4, 4).
        skeleton: Points from the origin of `base_link` to that of the first joint, shape (k, 3), m.
    """

    base: Array
    joints: tuple[UrdfJoint, ...]
    tool: Array
    skeleton: Array

    def __post_init__(self) -> None:
        for name in ("base", "tool", "skeleton"):
            object.__setattr__(self, name, read_only(getattr(self, name)))

    @property
    def links(self) -> tuple[str, ...]:
        """Names of all links from `base_link` to the last one; `world` and `tool0` are not among them."""
        return (FIRST_LINK, *(joint.link for joint in self.joints))

    def transforms(self, q: Array) -> tuple[Array, Array]:
        """Return the pose of each link in the one before it, as TF says it.

        Args:
            q: Shape (N, n), rad or m.

        Returns:
            Translations (N, n, 3), m, and unit quaternions (N, n, 4) as w, x, y, z.
        """
        translations, quaternions = np.empty((*q.shape, 3)), np.empty((*q.shape, 4))
        for k, joint in enumerate(self.joints):
            w, x, y, z = quaternion_from_matrix(joint.origin[:3, :3]).tolist()
            moved = joint.sign * q[:, k]
            if joint.prismatic:
                translations[:, k] = joint.origin[:3, 3] + moved[:, None] * joint.origin[:3, 2]
                quaternions[:, k] = w, x, y, z
                continue
            translations[:, k] = joint.origin[:3, 3]
            c, s = np.cos(moved / 2), np.sin(moved / 2)
            turned = (w * c - z * s, x * c + y * s, y * c - x * s, z * c + w * s)
            quaternions[:, k] = np.stack(turned, axis=1)
        return translations, quaternions


def chain_of(robot: Robot) -> UrdfChain:
    """Return the frames of a robot.

    Raises:
        InputError: When the robot has no geometry.
    """
    if robot.convention is None:
        raise InputError(
            f"robot {robot.name} has bare joints and no geometry, so there is no URDF of it",
            hint=GEOMETRY_HINT,
        )
    cuts = [_cut(joint, modified=robot.convention == "modified") for joint in robot.joints]
    before, after = zip(*cuts, strict=True)
    parts = [(*behind, *ahead) for behind, ahead in zip(((), *after), (*before, ()), strict=True)]
    origins, skeletons = zip(*map(_product, parts), strict=True)
    joints = [
        UrdfJoint(
            joint.name,
            f"link_{k + 1}",
            joint.type == "prismatic",
            joint.sign,
            origins[k],
            skeletons[k + 1],
            _product(after[k])[0],
        )
        for k, joint in enumerate(robot.joints)
    ]
    tool = origins[-1] @ robot.tool
    last = np.concatenate([joints[-1].skeleton, tool[None, :3, 3]])
    joints[-1] = replace(joints[-1], skeleton=last)
    return UrdfChain(robot.base, tuple(joints), tool, skeletons[0])


def _cut(joint: Joint, *, modified: bool) -> tuple[tuple[_Step, ...], tuple[_Step, ...]]:
    """Return the fixed steps of a row before the joint's variable and behind it."""
    screw: tuple[_Step, ...] = (("slide x", joint.a), ("turn x", joint.alpha), ("turn y", joint.beta))
    turn: _Step = ("turn z", joint.theta)
    slide: _Step = ("slide z", joint.d)
    before: tuple[_Step, ...] = (turn,) if joint.type == "revolute" else (turn, slide)
    after: tuple[_Step, ...] = (slide,) if joint.type == "revolute" else ()
    return ((*screw, *before), after) if modified else (before, (*after, *screw))


def _product(steps: Sequence[_Step]) -> tuple[Array, Array]:
    """Return the pose after elementary steps, (4, 4), and the origins on the way to it, (k, 3)."""
    pose, points = np.eye(4), [np.zeros(3)]
    for kind, value in steps:
        step = np.eye(4)
        axis = "xyz".index(kind[-1])
        if kind.startswith("slide"):
            step[axis, 3] = value
        else:
            i, j = (axis + 1) % 3, (axis + 2) % 3
            step[i, i], step[j, i] = cos_sin(value)
            step[i, j], step[j, j] = -step[j, i], step[i, i]
        pose = pose @ step
        if kind.startswith("slide") and value != 0.0:
            points.append(pose[:3, 3])
    return pose, np.array(points)
