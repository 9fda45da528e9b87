"""Arms of the calibration tests: a UR with parallel axes, a Puma, a SCARA with a slide; and noisy measurements."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from conventions import in_convention
from product_of_rows import pose_of
from scipy.spatial.transform import Rotation

from trajcli.kinematics.calibration.measurements import MeasuredKind, Measurements
from trajcli.kinematics.calibration.parameters import ArmParameter, all_parameters
from trajcli.kinematics.inverse.target import partial_target, pose_target
from trajcli.kinematics.robot import Joint, Robot, unlimited

QUARTER = np.pi / 2
HUNDREDTH = np.pi / 18000  # rad: a hundredth of a degree
TABLES = {
    "ur": (
        ("revolute", 0, 0.1625, 0, QUARTER),
        ("revolute", 0, 0, -0.425, 0),
        ("revolute", 0, 0, -0.3922, 0),
        ("revolute", 0, 0.1333, 0, QUARTER),
        ("revolute", 0, 0.0997, 0, -QUARTER),
        ("revolute", 0, 0.0996, 0, 0),
    ),
    "puma": (
        ("revolute", 0, 0.6718, 0, QUARTER),
        ("revolute", 0, 0, 0.4318, 0),
        ("revolute", 0, 0.15005, 0.0203, -QUARTER),
        ("revolute", 0, 0.4318, 0, QUARTER),
        ("revolute", 0, 0, 0, -QUARTER),
        ("revolute", 0, 0.1, 0, 0),
    ),
    "scara": (
        ("revolute", 0, 0.3, 0.325, 0),
        ("revolute", 0, 0, 0.275, np.pi),
        ("prismatic", 0, 0.1, 0, 0),
        ("revolute", 0, 0.05, 0, 0),
    ),
}


def arm(name, convention="standard"):
    joints = tuple(
        Joint(f"j{i}", kind, theta, d, a, alpha)
        for i, (kind, theta, d, a, alpha) in enumerate(TABLES[name], 1)
    )
    tool = np.eye(4)
    tool[:3, 3] = 0.02, -0.03, 0.08
    robot = Robot(name, joints, unlimited(len(joints)), "standard", np.eye(4), tool)
    return in_convention(robot, convention)


def configurations(robot, count, rng):
    extent = [np.pi if kind == "revolute" else 0.2 for kind in robot.joint_types]
    return rng.uniform(-1, 1, (count, len(extent))) * extent


def true_changes(robot, rng, parameters=None) -> dict[ArmParameter, float]:
    """Return small errors of the parameters: of some tenths of a millimetre and hundredths of a degree."""
    return {
        parameter: rng.normal() * (1e-3 if parameter.angular else 5e-4)
        for parameter in parameters or all_parameters(robot)
    }


def measured(robot, q, changes, rng=None, *, position=1e-4, angle=HUNDREDTH, part="pose"):
    """Return measurements of the robot with changed parameters; with noise where a generator is given."""
    poses = pose_of(robot, np.asarray(q), changes)
    if rng is not None:
        poses[:, :3, 3] += rng.normal(size=(len(q), 3)) * position
        turns = Rotation.from_rotvec(rng.normal(size=(len(q), 3)) * angle)
        poses[:, :3, :3] = turns.as_matrix() @ poses[:, :3, :3]
    target = pose_target(poses) if part == "pose" else partial_target(poses[:, :3, 3])
    return Measurements(np.array(q), (MeasuredKind(np.arange(len(q)), target),))


def without_rows(measurements, rows):
    """Return the measurements of one kind that stand in the rows."""
    kind = measurements.kinds[0]
    return replace(
        measurements,
        joints=measurements.joints[rows],
        kinds=(MeasuredKind(np.arange(len(rows)), kind.target.rows(rows)),),
    )
