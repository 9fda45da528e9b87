"""Parameters of kinematic calibration: numbers of DH rows, of the base and of the tool, by name.

A parameter is named `JOINT.theta`, `.d`, `.a`, `.alpha` or `.beta`, or `base.x` and `tool.x` to `.rz`. The
turns rx, ry, rz of a base or a tool are a rotation vector from its nominal orientation to the true one, about
the axes of the frame that it is given in (world for the base, flange for the tool): no angle of them is ever
at a gimbal lock, and their nominal values are zero.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError
from trajcli.frozen import comparable
from trajcli.geometry.pose import build
from trajcli.geometry.rotation import exp, log
from trajcli.kinematics.robot import Robot
from trajcli.suggest import did_you_mean

PARALLEL = np.pi / 36
"""Rad: axes that are closer to parallel have beta among `all`, instead of d."""

ROW = ("theta", "d", "a", "alpha", "beta")
"""The numbers of a DH row."""
POSE = ("x", "y", "z", "rx", "ry", "rz")
"""The numbers of a base or a tool."""
_LENGTHS = ("d", "a", "x", "y", "z")
_FRAMES = ("base", "tool")


@comparable
class ArmParameter:
    """One number of a robot.

    Attributes:
        owner: The name of its joint, or "base" or "tool".
        name: One of `ROW`, or of `POSE`.
        joint: Index of the joint; None for base and tool.
    """

    owner: str
    name: str
    joint: int | None = None

    @property
    def angular(self) -> bool:
        """Whether it is an angle, rad, and no length, m."""
        return self.name not in _LENGTHS

    def __str__(self) -> str:
        return f"{self.owner}.{self.name}"


def all_parameters(robot: Robot) -> tuple[ArmParameter, ...]:
    """Return every parameter, from the base to the tool; beta for d in rows between almost parallel axes.

    Between parallel axes the common normal can lie anywhere, and the d of a row jumps with the last digit of
    alpha; the tilt about y that beta describes is what is missing.

    Source: Hayati (1983).
    """
    rows = (parameter for joint in range(len(robot.joints)) for parameter in row_parameters(robot, joint))
    return (*_pose_parameters("base"), *rows, *_pose_parameters("tool"))


def row_parameters(robot: Robot, joint: int) -> tuple[ArmParameter, ...]:
    """Return the four parameters of a joint's row: theta, d, a, alpha, or beta in the place of d."""
    names = ("theta", "beta", "a", "alpha") if joint in parallel_rows(robot) else ROW[:4]
    return tuple(ArmParameter(robot.joints[joint].name, name, joint) for name in names)


def parallel_rows(robot: Robot) -> tuple[int, ...]:
    """Return the joints whose row lies between two axes that are parallel within `PARALLEL`.

    The angle of a standard row is that to the next axis, of a modified row that to the axis before.
    """
    count = len(robot.joints)
    rows = range(count - 1) if robot.convention == "standard" else range(1, count)
    cosines = (np.cos(robot.joints[row].alpha) * np.cos(robot.joints[row].beta) for row in rows)
    return tuple(row for row, cosine in zip(rows, cosines, strict=True) if abs(cosine) >= np.cos(PARALLEL))


def units_of(parameters: Sequence[ArmParameter], length: float) -> Array:
    """Return what a change of each parameter by one is measured by, (p,): 1 of angles, else `length`."""
    return np.array([1.0 if parameter.angular else length for parameter in parameters])


def _pose_parameters(owner: str) -> tuple[ArmParameter, ...]:
    return tuple(ArmParameter(owner, name) for name in POSE)


def parse_parameters(robot: Robot, text: str) -> tuple[ArmParameter, ...]:
    """Return the parameters that a text such as `all` or `j1.theta,j2.a,tool` names, in the robot's order.

    A joint's name alone means the four numbers of its row, `base` and `tool` alone their six, `dh` all rows.

    Raises:
        InputError: When there is no such parameter, or one stands twice.
    """
    chosen: list[ArmParameter] = []
    for word in (part.strip() for part in text.split(",")):
        for parameter in _parameters_of(robot, word):
            if parameter in chosen:
                raise InputError(f"--free: {parameter} stands twice", hint="name it once")
            chosen.append(parameter)
    return tuple(sorted(chosen, key=lambda parameter: _order(robot, parameter)))


def _parameters_of(robot: Robot, word: str) -> tuple[ArmParameter, ...]:
    names = robot.joint_names
    if word in ("all", "dh"):
        listed = all_parameters(robot)
        return listed if word == "all" else tuple(each for each in listed if each.joint is not None)
    if word in names and word in _FRAMES:
        hint = f"name its numbers, such as {word}.theta or {word}.x"
        raise InputError(f"--free: '{word}' is a joint of {robot.name} and its {word}", hint=hint)
    if word in names:
        return row_parameters(robot, names.index(word))
    if word in _FRAMES:
        return _pose_parameters(word)
    owner, _, name = word.rpartition(".")
    if owner in names and name in ROW:
        return (ArmParameter(owner, name, names.index(owner)),)
    if owner in _FRAMES and name in POSE:
        return (ArmParameter(owner, name),)
    words = ["all", "dh", *_FRAMES, *names]
    words += [f"{each}.{key}" for each in names for key in ROW]
    words += [f"{each}.{key}" for each in _FRAMES for key in POSE]
    forms = "all, dh, base, tool, a joint, or such as " + f"{names[0]}.theta and base.x"
    raise InputError(
        f"--free: {robot.name} has no parameter '{word}'",
        hint=did_you_mean(word, words) or f"expected {forms}",
    )


def _order(robot: Robot, parameter: ArmParameter) -> tuple[int, int]:
    if parameter.joint is not None:
        return parameter.joint, ROW.index(parameter.name)
    return -1 if parameter.owner == "base" else len(robot.joints), POSE.index(parameter.name)


def shifted(robot: Robot, parameters: Sequence[ArmParameter], change: Array) -> Robot:
    """Return the robot with each parameter changed by an amount (p,), rad or m; turns multiply."""
    joints = list(robot.joints)
    frames = {owner: np.zeros(6) for owner in _FRAMES}
    for parameter, amount in zip(parameters, change.tolist(), strict=True):
        if parameter.joint is None:
            frames[parameter.owner][POSE.index(parameter.name)] += amount
        else:
            joint = joints[parameter.joint]
            value = getattr(joint, parameter.name) + amount
            joints[parameter.joint] = replace(joint, **{parameter.name: value})
    poses = {owner: _moved(getattr(robot, owner), step) for owner, step in frames.items()}
    return replace(robot, joints=tuple(joints), base=poses["base"], tool=poses["tool"])


def _moved(pose: Array, step: Array) -> Array:
    if not step.any():
        return pose
    return build(exp(step[3:]) @ pose[:3, :3], pose[:3, 3] + step[:3])


def values_of(robot: Robot, nominal: Robot, parameters: Sequence[ArmParameter]) -> Array:
    """Return the values (p,) of the parameters, rad and m; turns are counted from the nominal robot's."""
    frames = {owner: _six(getattr(robot, owner), getattr(nominal, owner)) for owner in _FRAMES}
    return np.array(
        [
            frames[parameter.owner][POSE.index(parameter.name)]
            if parameter.joint is None
            else getattr(robot.joints[parameter.joint], parameter.name)
            for parameter in parameters
        ]
    )


def _six(pose: Array, nominal: Array) -> Array:
    if np.array_equal(pose[:3, :3], nominal[:3, :3]):  # rounding of the product would be shown as a turn
        return np.concatenate([pose[:3, 3], np.zeros(3)])
    return np.concatenate([pose[:3, 3], log(pose[:3, :3] @ nominal[:3, :3].T)])
