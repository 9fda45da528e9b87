"""Axes that are almost parallel: rows with Hayati's angle about y, by the product of plain matrices."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import oracle_robots as oracle
import pytest
from conventions import screw

from trajcli.geometry.pose import build
from trajcli.job.dump import dump_job
from trajcli.job.files.rail import on_carriage
from trajcli.job.read import job_from_text
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.families.choose import method_for
from trajcli.kinematics.inverse.solve import solve
from trajcli.kinematics.inverse.target import pose_target
from trajcli.kinematics.jacobian import jacobian
from trajcli.kinematics.robot import Joint, Limits

CONVENTIONS = pytest.mark.parametrize("convention", ["standard", "modified"])


def tilted(rng, joints, convention, betas):
    robot = oracle.random_arm(rng, joints, convention)
    rows = tuple(replace(joint, beta=beta) for joint, beta in zip(robot.joints, betas, strict=True))
    return replace(robot, joints=rows)


def about_y(angle):
    c, s = np.cos(angle), np.sin(angle)
    return build([[c, 0, s], [0, 1, 0], [-s, 0, c]])


def by_the_book(robot, q):
    pose = robot.base
    for joint, value in zip(robot.joints, q, strict=True):
        slides = joint.type == "prismatic"
        theta, d = joint.theta + (not slides) * joint.sign * value, joint.d + slides * joint.sign * value
        c, s = np.cos(theta), np.sin(theta)
        about_z = np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, d], [0, 0, 0, 1]])
        about_x = screw(joint.a, joint.alpha) @ about_y(joint.beta)
        pose = pose @ (about_z @ about_x if robot.convention == "standard" else about_x @ about_z)
    return pose @ robot.tool


@CONVENTIONS
def test_forward_kinematics_is_the_product_of_the_matrices(convention):
    rng = np.random.default_rng(1)
    for joints in (1, 3, 6):
        robot = tilted(rng, joints, convention, rng.uniform(-1, 1, joints) * rng.integers(0, 2, joints))
        for q in rng.uniform(-3, 3, (5, joints)):
            np.testing.assert_allclose(forward(robot, q), by_the_book(robot, q), rtol=0, atol=1e-14)


@CONVENTIONS
def test_the_jacobian_is_the_derivative(convention):
    rng = np.random.default_rng(2)
    robot = tilted(rng, 6, convention, rng.uniform(-0.5, 0.5, 6))
    q, step = rng.uniform(-2, 2, 6), 1e-6
    moved = [forward(robot, q + sign * step * axis) for axis in np.eye(6) for sign in (1, -1)]
    rates = [(a - b) / (2 * step) for a, b in zip(moved[::2], moved[1::2], strict=True)]
    rotation = forward(robot, q)[:3, :3]
    columns = []
    for rate in rates:
        spin = rate[:3, :3] @ rotation.T
        columns.append([*rate[:3, 3], spin[2, 1], spin[0, 2], spin[1, 0]])
    np.testing.assert_allclose(jacobian(robot, q), np.transpose(columns), rtol=0, atol=1e-8)


def test_inverse_kinematics_of_a_calibrated_arm_is_numeric_and_exact():
    robot = oracle.robot_of(next(arm for arm in oracle.robots() if arm["id"] == "C-ur5e"))
    rows = list(robot.joints)
    rows[1] = replace(rows[1], beta=3e-4)
    calibrated = replace(robot, joints=tuple(rows))
    assert method_for(robot).family != "numeric"
    assert method_for(calibrated).family == "numeric"
    q = np.array([0.3, -1.2, 1.4, -0.7, 0.9, 0.2])
    pose = by_the_book(calibrated, q)
    solutions = solve(calibrated, pose_target(pose), q)
    assert solutions.valid.sum() == 8
    np.testing.assert_allclose(solutions.joints[solutions.nearest(q)], q, rtol=0, atol=1e-9)
    for joints in solutions.joints[solutions.valid]:
        np.testing.assert_allclose(by_the_book(calibrated, joints), pose, rtol=0, atol=1e-9)


@pytest.mark.parametrize("axis", [(1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.3, -0.7, 0.2)])
@CONVENTIONS
def test_an_arm_on_a_rail_stands_there_as_it_does_without_its_betas_included(convention, axis):
    """A modified row begins with its tilt: that of the first joint is then between the rail and that joint."""
    rng = np.random.default_rng(5)
    robot = tilted(rng, 3, convention, (0.3, 0.6, 0.9))
    mount = screw(0.2, 0.4) @ about_y(-0.7)
    one = np.array([[-1.0, 1.0]])
    whole = on_carriage(robot, np.array(axis), Joint("rail", "prismatic"), Limits(one, one, one, one), mount)
    q, along = rng.uniform(-2, 2, 3), 0.6
    expected = mount @ by_the_book(replace(robot, base=np.eye(4)), q)
    expected[:3, 3] += along * np.array(axis) / np.linalg.norm(axis)
    np.testing.assert_allclose(by_the_book(whole, [along, *q]), expected, rtol=0, atol=1e-12)


JOB = """
version: 1
units: {angle: deg, length: mm}
robot:
  convention: standard
  joints:
    - {a: 400, alpha: 0, beta: 0.0123456789012345, velocity: 90}
    - {a: 300, alpha: 180, d: 12, velocity: 90}
start: {joints: [0, 0]}
moves: [{planner: cubic, to: {joints: [30, 40]}, duration: 1}]
"""


def test_a_job_says_it_and_is_dumped_bit_by_bit():
    loaded = job_from_text(JOB)
    assert loaded.robot.joints[0].beta == np.deg2rad(0.0123456789012345)
    resolved = dump_job(loaded)
    assert resolved.count("beta:") == 1
    assert job_from_text(resolved).robot.joints == loaded.robot.joints
