"""Identification Jacobian against differences of an independent product of elementary matrices."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from oracle_robots import random_arm
from product_of_rows import difference_jacobian, pose_of
from tiers import few

from trajcli.geometry.rotation import log
from trajcli.kinematics.calibration.identifiability import identification_jacobian
from trajcli.kinematics.calibration.parameters import (
    ROW,
    ArmParameter,
    all_parameters,
    shifted,
    values_of,
)
from trajcli.kinematics.forward import forward


def every_parameter(robot):
    """Return all numbers of all rows, beta and d of each, with base and tool."""
    rows = [ArmParameter(joint.name, name, i) for i, joint in enumerate(robot.joints) for name in ROW]
    frames = [parameter for parameter in all_parameters(robot) if parameter.joint is None]
    return (*rows, *frames)


def tilted(robot, rng):
    """Return the robot with a beta in some rows."""
    joints = tuple(
        replace(joint, beta=float(rng.choice([0.0, rng.uniform(-1, 1)]))) for joint in robot.joints
    )
    return replace(robot, joints=joints)


@pytest.mark.parametrize("convention", ["standard", "modified"])
@pytest.mark.parametrize("seed", few(range(12)))
def test_columns_are_the_derivatives_of_the_product(convention, seed):
    rng = np.random.default_rng(seed)
    robot = tilted(random_arm(rng, int(rng.integers(1, 8)), convention), rng)
    parameters = every_parameter(robot)
    q = rng.uniform(-2, 2, (4, len(robot.joints)))
    poses, jacobian = identification_jacobian(robot, q, parameters)
    np.testing.assert_allclose(poses, pose_of(robot, q, {}), atol=1e-12)
    np.testing.assert_allclose(jacobian, difference_jacobian(robot, q, parameters), atol=2e-8)


@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_shifted_parameters_give_the_pose_of_the_product(convention):
    rng = np.random.default_rng(5)
    robot = tilted(random_arm(rng, 5, convention), rng)
    parameters = every_parameter(robot)
    change = rng.uniform(-0.3, 0.3, len(parameters))
    q = rng.uniform(-2, 2, (6, 5))
    moved = shifted(robot, parameters, change)
    expected = pose_of(robot, q, dict(zip(parameters, change, strict=True)))
    np.testing.assert_allclose(forward(moved, q), expected, atol=1e-12)
    nominal = np.array(
        [getattr(robot.joints[p.joint], p.name) if p.joint is not None else 0.0 for p in parameters]
    )
    xyz = [getattr(robot, owner)[i, 3] for owner in ("base", "tool") for i in range(3)]
    nominal[[i for i, p in enumerate(parameters) if p.joint is None and not p.angular]] = xyz
    np.testing.assert_allclose(values_of(moved, robot, parameters), nominal + change, atol=1e-12)


def test_turns_of_a_base_multiply_from_the_left():
    rng = np.random.default_rng(8)
    robot = random_arm(rng, 2, "standard")
    turn = ArmParameter("base", "rz")
    twice = shifted(shifted(robot, [turn], np.array([0.2])), [turn], np.array([0.3]))
    relative = twice.base[:3, :3] @ robot.base[:3, :3].T
    np.testing.assert_allclose(log(relative), [0, 0, 0.5], atol=1e-14)
    assert np.array_equal(twice.base[:3, 3], robot.base[:3, 3])
