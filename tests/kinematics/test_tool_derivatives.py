"""Derivatives of the tool's motion against Taylor series of products of matrices, and the twist and acceleration."""

from __future__ import annotations

import numpy as np
import pytest
from independent_motion import Series, angular_velocity, fixed, poses, product

from trajcli.job.robot import load_robot
from trajcli.kinematics.jacobian import tcp_acceleration, tcp_twist
from trajcli.kinematics.robot import Robot
from trajcli.kinematics.tool_derivatives import tool_derivatives

ARMS = ("ur5e", "cobra600", "panda", "stanford", "puma560_akb", "xarm7", "planar3r", "gen3")


def by_series(robot: Robot, rates: np.ndarray) -> np.ndarray:
    """Return the derivatives (N, 3, 2, 3) of q and its derivatives (4, N, n)."""
    series: Series = rates / np.array([1, 1, 2, 6])[:, None, None]
    pose = product(poses(robot, series)[1][-1], fixed(robot.tool, series))
    w, position = angular_velocity(pose), pose[..., :3, 3]
    rows = [[position[1], w[0]], [2 * position[2], w[1]], [6 * position[3], 2 * w[2]]]
    return np.array(rows).transpose(2, 0, 1, 3)


@pytest.mark.parametrize("name", ARMS)
def test_three_derivatives_are_those_of_power_series(name: str) -> None:
    robot, rng = load_robot(name), np.random.default_rng(len(name))
    rates = rng.normal(size=(4, 7, len(robot.joints)))
    found = tool_derivatives(robot, list(rates))
    np.testing.assert_allclose(found, by_series(robot, rates), atol=1e-12)
    np.testing.assert_allclose(found[:, 0].reshape(-1, 6), tcp_twist(robot, *rates[:2]), atol=1e-13)
    np.testing.assert_allclose(found[:, 1].reshape(-1, 6), tcp_acceleration(robot, *rates[:3]), atol=1e-12)


def test_fewer_derivatives_are_the_first_ones() -> None:
    robot = load_robot("ur5e")
    rates = np.random.default_rng(2).normal(size=(4, 2, 3, 6))
    whole = tool_derivatives(robot, list(rates))
    assert whole.shape == (2, 3, 3, 2, 3)
    for order in (1, 2):
        np.testing.assert_array_equal(
            tool_derivatives(robot, list(rates[: order + 1])), whole[..., :order, :, :]
        )
