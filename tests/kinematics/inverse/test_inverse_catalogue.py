"""Inverse kinematics of every arm of six joints in the catalogue, three poses each.

Oracle: the inverse law. Each answer gives the pose back, and the joints that made the pose are among the answers.
"""

from __future__ import annotations

import numpy as np
import pytest

from trajcli.catalogue.entries import catalogue_names
from trajcli.job.robot import load_robot
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.families.choose import method_for
from trajcli.kinematics.inverse.solve import solve
from trajcli.kinematics.robot import Robot

SIX = {name: robot for name in catalogue_names() if len((robot := load_robot(name)).joints) == 6}
SEARCHED = {"xarm6"}  # its wrist is not spherical, and no three neighbouring axes are parallel


def joints_of(robot: Robot) -> np.ndarray:
    """Return three configurations (3, 6) in the ranges, a tenth of each range from its ends."""
    slides = np.array([kind == "prismatic" for kind in robot.joint_types])
    widest = np.where(slides, 0.5, np.pi)
    low, high = np.clip(robot.limits.position.T, -widest, 2 * widest)
    share = np.random.default_rng(7).uniform(0.1, 0.9, (3, 6))
    return np.asarray(low + share * (np.minimum(high, low + 2 * widest) - low))


@pytest.mark.parametrize("name", SIX)
def test_closed_forms_are_recognised(name: str) -> None:
    method = method_for(SIX[name])
    assert (method.family == "numeric") == (name in SEARCHED), method.reason


@pytest.mark.parametrize("name", SIX)
def test_answers_give_the_pose_back(name: str) -> None:
    robot, q = SIX[name], joints_of(SIX[name])
    poses = forward(robot, q)
    found = solve(robot, poses, q)
    turns = np.array([kind == "revolute" for kind in robot.joint_types])
    for pose, made, answers, valid in zip(poses, q, found.joints, found.valid, strict=True):
        assert valid.any()
        assert np.abs(forward(robot, answers[valid]) - pose).max() <= 1e-9
        gaps = answers[valid] - made
        gaps = np.where(turns, np.abs((gaps + np.pi) % (2 * np.pi) - np.pi), np.abs(gaps))
        assert gaps.max(axis=1).min() <= 1e-7
