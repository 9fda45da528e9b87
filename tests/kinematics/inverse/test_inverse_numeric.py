from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from inverse_arms import gap
from oracle_robots import random_arm, robot_of, robots

from trajcli.errors import InputError
from trajcli.kinematics.dexterity import dexterity
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.families.choose import method_for
from trajcli.kinematics.inverse.solve import solve
from trajcli.kinematics.robot import Joint, Robot, unlimited

SEVEN = ["C-panda", "C-iiwa7", "C-iiwa14", "C-sawyer"]
# limits of the makers, rad, where a case needs them (source as in tests/oracles/robots.yaml)
PANDA = [
    [-2.8973, 2.8973],
    [-1.7628, 1.7628],
    [-2.8973, 2.8973],
    [-3.0718, -0.0698],
    [-2.8973, 2.8973],
    [-0.0175, 3.7525],
    [-2.8973, 2.8973],
]


def arm_named(name):
    robot = robot_of(next(robot for robot in robots() if robot["id"] == name), name)
    if name == "C-panda":
        return replace(robot, limits=replace(robot.limits, position=np.array(PANDA)))
    if name in SEVEN:
        return replace(robot, limits=replace(robot.limits, position=np.tile([-2.9, 2.9], (7, 1))))
    return robot


def reachable(robot, rng, count):
    low, high = np.clip(robot.limits.position, -np.pi, np.pi).T
    joints = rng.uniform(low, high, (count, len(robot.joints)))
    return joints, forward(robot, joints)


@pytest.mark.parametrize("name", [*SEVEN, "C-xarm6"])
def test_general_arms_are_solved_within_their_limits(name):
    robot = arm_named(name)
    _, poses = reachable(robot, np.random.default_rng(8), 10)
    found = solve(robot, poses)
    assert method_for(robot).family == ("numeric" if name in ("C-sawyer", "C-xarm6") else "joint 7 held")
    assert found.within_limits.any(axis=1).all()
    off = np.abs(forward(robot, found.joints) - poses[:, None]).max(axis=(-2, -1))
    assert off[found.valid].max() < 1e-9


@pytest.mark.soak
@pytest.mark.parametrize("name", [*SEVEN, "C-xarm6"])
def test_a_thousand_reachable_poses_of_a_general_arm(name):
    robot = arm_named(name)
    joints, poses = reachable(robot, np.random.default_rng(9), 1000)
    found = solve(robot, poses)
    assert np.count_nonzero(found.within_limits.any(axis=1)) >= 999
    assert found.closure[found.valid].max() < 1e-9
    if name == "C-xarm6":
        there = np.where(found.valid, gap(robot, found.joints, joints[:, None]), np.inf).min(axis=1)
        assert np.count_nonzero(there < 1e-6) >= 999
        assert np.count_nonzero(found.count % 2) <= 1


@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_any_chain_of_six_joints_is_solved(convention):
    rng = np.random.default_rng(10)
    solved = 0
    while solved < 2:
        robot = random_arm(rng, 6, convention)
        joints = rng.uniform(-1, 1, (4, 6))
        if dexterity(robot, joints).condition.max() > 1e3:  # too many slides: every pose has a self-motion
            continue
        found = solve(robot, forward(robot, joints))
        there = np.where(found.valid, gap(robot, found.joints, joints[:, None]), np.inf).min(axis=1)
        assert there.max() < 1e-6
        solved += 1


@pytest.mark.parametrize(("decimals", "tolerance"), [(9, 1e-9), (5, 1e-4)])
def test_an_arm_of_five_joints_reaches_its_own_poses_as_they_are_written(decimals, tolerance):
    """Rounded to some decimals they are out of its reach, by no more than the tolerance."""
    rng = np.random.default_rng(3)
    robot = random_arm(rng, 5, "standard")
    joints = rng.uniform(-1.5, 1.5, (2, 5))
    poses = np.round(forward(robot, joints), decimals)
    found = solve(robot, poses, joints, tolerance)
    assert found.valid.any(axis=1).all()
    off = np.abs(forward(robot, found.joints) - poses[:, None])
    assert off[found.valid].max() <= tolerance
    nearest = np.abs(found.joints - joints[:, None]).max(axis=2).min(axis=1)
    assert nearest.max() < 100 * tolerance
    beyond = poses.copy()
    beyond[:, :3, 3] += 30 * tolerance
    assert not solve(robot, beyond, joints, tolerance).valid.any()


def test_one_joint_alone_is_solved():
    robot = Robot("crank", (Joint("j1", a=0.3),), unlimited(1), "standard", np.eye(4), np.eye(4))
    found = solve(robot, forward(robot, [1.1]))
    assert found.joints[found.valid] == pytest.approx(np.array([[1.1]]))


def test_a_redundant_arm_answers_with_the_member_nearest_to_where_it_is():
    robot = arm_named("C-panda")
    near = np.array([0.1, -0.5, 0.2, -2.0, 0.1, 1.7, 0.5])
    pose = forward(robot, near)
    pose[:3, 3] += [0.01, -0.02, 0.01]
    found = solve(robot, pose, near)
    best = int(found.nearest(near))
    joints = found.joints[best]
    assert not found.singular[best]
    assert found.free[best].sum() >= 6
    slopes = np.array(
        [
            (forward(robot, joints + h) - forward(robot, joints - h))[:3].ravel() / 2e-6
            for h in 1e-6 * np.eye(7)
        ]
    )
    idle = np.linalg.svd(slopes.T)[2][6]
    assert abs(idle @ (near - joints)) < 1e-6
    assert np.abs(joints - near).max() < 0.2


def test_the_same_search_gives_the_same_bits():
    robot = arm_named("C-panda")
    _, poses = reachable(robot, np.random.default_rng(12), 2)
    assert np.array_equal(solve(robot, poses).joints, solve(robot, poses).joints)


def test_bare_joints_have_no_inverse():
    bare = Robot("bare", (Joint("j1"),), unlimited(1), None, np.eye(4), np.eye(4))
    with pytest.raises(InputError, match="no geometry"):
        solve(bare, np.eye(4))
