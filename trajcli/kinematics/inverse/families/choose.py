"""Choice of the inverse kinematics of an arm: the list of families, and the one that its screw axes fit."""

from __future__ import annotations

from functools import lru_cache
from importlib import import_module

import numpy as np

from trajcli.kinematics.dexterity import RANK_TOLERANCE, characteristic_length
from trajcli.kinematics.inverse.families.method import IkMethod
from trajcli.kinematics.inverse.families.screw_axes import AxisGeometry, axis_geometry
from trajcli.kinematics.jacobian import jacobian
from trajcli.kinematics.robot import Robot

FAMILIES = {"planar": 4, "spherical_wrist": 7, "three_parallel": 7, "positioning": 7}
"""Modules of this folder, and the most joints of their arms: each is loaded when it is tried."""
_CONFIGURATIONS = 3  # configurations: an arm that is singular in all of them is so everywhere


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
    for name, most in FAMILIES.items():
        if len(robot.joints) > most:
            continue
        method: IkMethod | None = import_module(f"{__package__}.{name}").match(arm)
        if method is not None and _every_joint_counts(robot, method):
            return method
    return _held_method(robot) or numeric_method(arm)


def _held_method(robot: Robot) -> IkMethod | None:
    """Return the method of seven joints whose first six have a closed form; None for other arms."""
    from trajcli.kinematics.inverse.families.held_joint import without_last_joint

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
