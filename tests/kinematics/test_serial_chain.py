from __future__ import annotations

import numpy as np
import oracle_robots as oracle
import pytest
from conventions import in_convention

from trajcli.kinematics.forward import forward, link_poses

ARMS = pytest.mark.parametrize("arm", oracle.robots(), ids=lambda arm: arm["id"])
OTHER = {"standard": "modified", "modified": "standard"}


def test_a_standard_row_by_the_book():
    row = {"type": "R", "theta": 0.3, "d": 0.2, "a": 0.5, "alpha": 0.7}
    _, transform, _ = link_poses(oracle.robot_of({"dh": [row], "convention": "std"}), [0.4])
    ct, st, ca, sa = np.cos(0.7), np.sin(0.7), np.cos(0.7), np.sin(0.7)
    book = [
        [ct, -st * ca, st * sa, 0.5 * ct],
        [st, ct * ca, -ct * sa, 0.5 * st],
        [0, sa, ca, 0.2],
        [0, 0, 0, 1],
    ]
    np.testing.assert_allclose(transform, book, rtol=0, atol=1e-15)


def test_a_modified_row_by_the_book():
    row = {"type": "P", "theta": 0.3, "d": 0.2, "a": 0.5, "alpha": 0.7, "sign": -1}
    _, transform, _ = link_poses(oracle.robot_of({"dh": [row], "convention": "mdh"}), [0.4])
    ct, st, ca, sa, d = np.cos(0.3), np.sin(0.3), np.cos(0.7), np.sin(0.7), 0.2 - 0.4
    book = [[ct, -st, 0, 0.5], [st * ca, ct * ca, -sa, -sa * d], [st * sa, ct * sa, ca, ca * d], [0, 0, 0, 1]]
    np.testing.assert_allclose(transform, book, rtol=0, atol=1e-15)


@ARMS
def test_the_other_convention_is_the_published_one_and_comes_back(arm):
    robot = oracle.robot_of(arm)
    other = in_convention(robot, OTHER[robot.convention])
    published = oracle.robot_of(arm["other_convention"])
    assert other.convention == published.convention
    q = np.random.default_rng(3).uniform(-3, 3, (10, len(robot.joints)))
    np.testing.assert_allclose(forward(other, q), forward(robot, q), rtol=0, atol=1e-14)
    np.testing.assert_allclose(forward(published, q), forward(other, q), rtol=0, atol=1e-14)
    again = in_convention(other, robot.convention)
    np.testing.assert_allclose(forward(again, q), forward(robot, q), rtol=0, atol=1e-14)


@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_arbitrary_arms_change_over(convention):
    rng = np.random.default_rng(4)
    for joints in (1, 2, 6, 12):
        robot = oracle.random_arm(rng, joints, convention)
        q = rng.uniform(-3, 3, (10, joints))
        other = in_convention(robot, OTHER[convention])
        np.testing.assert_allclose(forward(other, q), forward(robot, q), rtol=0, atol=1e-13)
        assert in_convention(robot, convention) is robot
