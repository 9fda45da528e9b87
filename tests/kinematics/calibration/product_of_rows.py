"""The tool's pose as a product of elementary 4x4 matrices, with each parameter changed: written independently."""

from __future__ import annotations

import math

import numpy as np
from scipy.spatial.transform import Rotation

from trajcli.kinematics.calibration.parameters import ArmParameter
from trajcli.kinematics.robot import Robot

AXES = {"x": 0, "y": 1, "z": 2}


def turn(axis, angle):
    matrix, c, s = np.eye(4), math.cos(angle), math.sin(angle)
    i, j = ((1, 2), (2, 0), (0, 1))[AXES[axis]]
    matrix[i, i], matrix[j, j], matrix[j, i], matrix[i, j] = c, c, s, -s
    return matrix


def slide(axis, length):
    matrix = np.eye(4)
    matrix[AXES[axis], 3] = length
    return matrix


def product(factors):
    result = np.eye(4)
    for factor in factors:
        result = result @ factor
    return result


def pose_of(robot: Robot, q: np.ndarray, changes: dict[ArmParameter, float]) -> np.ndarray:
    """Return T_world_tcp (4, 4) at q (n,), every parameter changed by what `changes` says."""
    change = {
        (parameter.joint, parameter.owner, parameter.name): value for parameter, value in changes.items()
    }
    factors = [_frame(robot.base, "base", change)]
    for index, (joint, value) in enumerate(zip(robot.joints, q, strict=True)):
        number = {
            name: getattr(joint, name) + change.get((index, joint.name, name), 0.0)
            for name in ("theta", "d", "a", "alpha", "beta")
        }
        number["d" if joint.type == "prismatic" else "theta"] += joint.sign * value
        about_z = [turn("z", number["theta"]), slide("z", number["d"])]
        about_x = [slide("x", number["a"]), turn("x", number["alpha"]), turn("y", number["beta"])]
        factors += about_z + about_x if robot.convention == "standard" else about_x + about_z
    return product([*factors, _frame(robot.tool, "tool", change)])


def _frame(pose, owner, change):
    slides = [change.get((None, owner, name), 0.0) for name in ("x", "y", "z")]
    turns = [change.get((None, owner, name), 0.0) for name in ("rx", "ry", "rz")]
    result = np.array(pose)
    if not any(slides + turns):
        return result
    result[:3, 3] += slides
    result[:3, :3] = Rotation.from_rotvec(turns).as_matrix() @ result[:3, :3]
    return result


def difference_jacobian(robot, joints, parameters, step=1e-6):
    """Return the Jacobian (N, 6, p) of the poses at joints (N, n), by central differences of the product."""
    result = np.empty((len(joints), 6, len(parameters)))
    for row, q in enumerate(joints):
        centre = pose_of(robot, q, {})
        for column, parameter in enumerate(parameters):
            high, low = (pose_of(robot, q, {parameter: sign * step}) for sign in (1, -1))
            result[row, :3, column] = (high[:3, 3] - low[:3, 3]) / (2 * step)
            spin = (high[:3, :3] - low[:3, :3]) / (2 * step) @ centre[:3, :3].T
            result[row, 3:, column] = spin[2, 1], spin[0, 2], spin[1, 0]
    return result
