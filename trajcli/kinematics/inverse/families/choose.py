"""Choice of the inverse kinematics of an arm: the list of families, and the one that its screw axes fit.

Where the last of seven joints is given, six are left for the six coordinates of a pose, and any family of
closed forms may fit them. Arms with an offset wrist are such: the axes of joints 1, 2 and 3 of a Panda meet
in the shoulder, those of joints 5 and 6 in the wrist, so that the six are a spherical shoulder under two axes
that meet. The distance from wrist to shoulder gives joint 4, the line between them joints 5 and 6, what is
left of the rotation the shoulder. Arms with a spherical wrist over a spherical shoulder are a special case.
The pose that the six have to reach, T', follows from T = T' M^-1 Rz(q) M with the turn of the held joint and
the fixed displacement M from its axis to the tcp.

Source: He and Liu, Analytical inverse kinematics for Franka Emika Panda: a geometrical solver for 7-DOF
manipulators with unconventional design (ICCMA 2021), here from screw axes instead of lengths.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from importlib import import_module

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.kinematics.dexterity import RANK_TOLERANCE, characteristic_length
from trajcli.kinematics.dh_rows import row_pose
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.families.method import IkMethod
from trajcli.kinematics.inverse.families.screw_axes import AxisGeometry, axis_geometry
from trajcli.kinematics.jacobian import jacobian
from trajcli.kinematics.robot import QUANTITIES, Limits, Robot

FAMILIES = {"planar": 4, "spherical_wrist": 7, "three_parallel": 7, "positioning": 7}
"""Modules of this folder, and the most joints of their arms: each is loaded when it is tried."""
_CONFIGURATIONS = 3  # configurations: an arm that is singular in all of them is so everywhere
_JOINTS = 7
_DUST = 1e-15  # what products of exact zeros and ones leave


@lru_cache(maxsize=16)
def method_for(robot: Robot) -> IkMethod:
    """Return the inverse kinematics of a robot: the closed form of the first family that fits, else numeric.

    A family fits only where every joint counts: the lengths do not determine the joints of a wrist by itself,
    nor of an arm two of whose axes are one.

    Axes count as parallel when the sine of their angle is at most 1e-9, and as meeting when their distance is
    at most 1e-9 of the arm's length. An arm with a beta in its table has no closed form: its axes are almost
    parallel, and not quite.

    Raises:
        InputError: When the robot has no geometry.
    """
    arm = axis_geometry(robot)
    if any(joint.beta for joint in robot.joints):
        return numeric_method(arm)
    for name, largest in FAMILIES.items():
        if len(robot.joints) > largest:
            continue
        method: IkMethod | None = import_module(f"{__package__}.{name}").match(arm)
        if method is not None and _every_joint_counts(robot, method):
            return method
    return _held_method(robot) or numeric_method(arm)


def _held_method(robot: Robot) -> IkMethod | None:
    """Return the method of seven joints whose first six have a closed form; None for other arms."""
    held = without_last_joint(robot)
    method = None if held is None else method_for(held)
    if method is None or method.solve is None:
        return None
    last = robot.joint_names[-1]
    reason = (
        f"with {last} held {method.reason}; seven joints are more than the six coordinates of a pose: "
        f"the answers are a family, whose points nearest to the given configuration are found by {last}"
    )
    return IkMethod(f"joint 7 held: {method.name}", "joint 7 held", (), reason, held=held)


def _every_joint_counts(robot: Robot, method: IkMethod) -> bool:
    """Return whether the Jacobian of what the method needs, position or pose, has full column rank."""
    count = len(robot.joints)
    configurations = np.cos(np.square(np.arange(1.0, _CONFIGURATIONS * count + 1.0))).reshape(
        _CONFIGURATIONS, count
    )
    moved = jacobian(robot, configurations)[:, : 3 if method.needs == "position" else 6]
    moved[:, :3] /= characteristic_length(robot)
    values = np.linalg.svd(moved, compute_uv=False)
    least = RANK_TOLERANCE * np.maximum(values[:, :1], 1.0)  # all of them may be rounding
    return bool((np.count_nonzero(values > least, axis=-1) == count).any())


def numeric_method(arm: AxisGeometry) -> IkMethod:
    """Return the method for arms that no closed form fits."""
    count = len(arm.axes)
    if count > 6:
        reason = f"{count} joints are more than the six coordinates of a pose: the answers are a family"
    else:
        reason = f"no closed form for this chain ({arm.kinds}) is among the families"
    return IkMethod("numeric: damped Newton from many seeds", "numeric", (), reason)


def without_last_joint(robot: Robot) -> Robot | None:
    """Return the arm of the first six of seven joints, the last one held at zero; None for other arms."""
    if len(robot.joints) != _JOINTS or robot.joint_types[-1] != "revolute":
        return None
    limits = Limits(**{name: getattr(robot.limits, name)[:-1] for name in QUANTITIES})
    flange = replace(robot, joints=robot.joints[:-1], limits=limits, tool=np.eye(4))
    zero = np.zeros(_JOINTS)
    tool = np.linalg.inv(forward(flange, zero[:-1])) @ forward(robot, zero)
    nearest = np.round(tool)
    return replace(flange, tool=np.where(np.abs(tool - nearest) < _DUST, nearest, tool))


def poses_for_the_others(robot: Robot, poses: Array, last: Array) -> Array:
    """Return the poses (..., N, 4, 4) that the arm without its last joint reaches with that joint at `last`.

    Args:
        robot: An arm whose last joint turns.
        poses: T_world_tcp, shape (N, 4, 4).
        last: Shape (..., N), rad.
    """
    fixed, along, across = _parts_of_change(robot)
    change = np.cos(last)[..., None, None] * along + np.sin(last)[..., None, None] * across + fixed
    return np.asarray(poses @ change)


@lru_cache(maxsize=16)
def _parts_of_change(robot: Robot) -> tuple[Array, Array, Array]:
    """Return what is fixed, times the cosine and times the sine of the last joint, each (4, 4)."""
    last, tip = robot.joints[-1], robot.tool
    if robot.convention == "standard":
        tip = row_pose((0.0, 0.0, last.a, last.alpha, 0.0)) @ tip
    back = np.linalg.inv(tip)
    turning, quarter = np.diag([1.0, 1.0, 0.0, 0.0]), np.zeros((4, 4))
    quarter[0, 1], quarter[1, 0] = 1.0, -1.0
    return back @ (np.eye(4) - turning) @ tip, back @ turning @ tip, back @ (last.sign * quarter) @ tip
