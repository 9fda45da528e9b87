"""The tool's pose as a product of elementary 4x4 matrices, with each parameter changed: written independently."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from trajcli.kinematics.calibration.parameters import ArmParameter
from trajcli.kinematics.robot import Robot

AXES = {"x": 0, "y": 1, "z": 2}


def turn(axis, angle):
    matrix, c, s = slide(axis, 0.0 * angle), np.cos(angle), np.sin(angle)
    i, j = ((1, 2), (2, 0), (0, 1))[AXES[axis]]
    matrix[..., i, i], matrix[..., j, j], matrix[..., j, i], matrix[..., i, j] = c, c, s, -s
    return matrix


def slide(axis, length):
    matrix = np.tile(np.eye(4), (*np.shape(length), 1, 1))
    matrix[..., AXES[axis], 3] = length
    return matrix


def product(factors):
    result = np.eye(4)
    for factor in factors:
        result = result @ factor
    return result


def pose_of(robot: Robot, q: np.ndarray, changes: dict[ArmParameter, float]) -> np.ndarray:
    """Return T_world_tcp (*batch, 4, 4) at q (*batch, n), every parameter changed by what `changes` says."""
    change = {
        (parameter.joint, parameter.owner, parameter.name): value for parameter, value in changes.items()
    }
    factors = [_frame(robot.base, "base", change)]
    for index, (joint, value) in enumerate(zip(robot.joints, np.moveaxis(q, -1, 0), strict=True)):
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
    centre = pose_of(robot, joints, {})[:, :3, :3]
    for column, parameter in enumerate(parameters):
        high, low = (pose_of(robot, joints, {parameter: sign * step})[:, :3] for sign in (1, -1))
        slope = (high - low) / (2 * step)
        spin = slope[..., :3] @ centre.swapaxes(1, 2)
        result[..., column] = np.hstack([slope[..., 3], spin[:, (2, 0, 1), (1, 2, 0)]])
    return result
