from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from inverse_arms import arm, random_joints
from oracle_robots import load, robot_of, robots
from scipy.spatial.transform import Rotation

from trajcli.errors import InputError, PlanningError
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.joint_turns import all_turns
from trajcli.kinematics.inverse.solutions import check_reachable, least_violation
from trajcli.kinematics.inverse.solve import solve
from trajcli.kinematics.inverse.target import partial_target

TAU = 2 * np.pi


def limited(robot, bounds):
    return replace(robot, limits=replace(robot.limits, position=np.array(bounds, dtype=float)))


def test_the_turn_inside_the_limits_is_chosen():
    robot = arm("planar 2R", limits=[[2.0, 8.5], [-np.inf, np.inf]])
    found = solve(robot, partial_target(forward(robot, [0.5, 1.0])[:3, 3]))
    assert found.within_limits.all()
    assert found.joints[np.abs(found.joints[:, 1] - 1.0).argmin(), 0] == pytest.approx(0.5 + TAU)


def test_the_turn_nearest_to_the_given_configuration_is_chosen():
    robot = arm("planar 2R", limits=[[-10.0, 10.0], [-10.0, 10.0]])
    near = np.array([0.5 - TAU, 1.0 + TAU])
    found = solve(robot, forward(robot, near), near=near)
    assert np.abs(found.joints - near).max(axis=1).min() < 1e-9
    assert int(found.nearest(near)) == int(np.abs(found.joints - near).max(axis=1).argmin())
    beyond = solve(limited(robot, [[-5.0, 5.0], [-5.0, 5.0]]), forward(robot, near), near=near)
    best = beyond.joints[int(beyond.nearest(near))]
    assert best == pytest.approx([0.5 - TAU + TAU, 1.0]) or best == pytest.approx([0.5, 1.0])


def test_all_turns_inside_the_limits_are_listed():
    robot = arm("planar 2R", limits=[[-7.0, 7.0], [-np.inf, np.inf]])
    assert all_turns(robot, np.array([0.5, 9.0]))[:, 0] == pytest.approx([0.5 - TAU, 0.5, 0.5 + TAU])
    wide = limited(robot, [[-7.0, 7.0], [-6.3, 6.3]])
    assert len(all_turns(wide, np.array([0.5, 0.0]))) == 9


def test_outside_the_limits_the_joint_and_the_excess_are_told():
    robot = arm("elbow", limits=[[-3.0, 3.0], [-0.1, 0.2], [-2.0, -0.1]])
    found = solve(robot, partial_target(forward(robot, [0.4, 0.7, -1.2])[:3, 3]))
    assert int(found.count) == 4
    assert not found.within_limits.any()
    worst = least_violation(found)
    excess = np.abs(found.excess).max(axis=1)
    assert abs(worst.excess) == pytest.approx(excess.min())
    assert (worst.joint, worst.excess) == (1, pytest.approx(0.5))
    with pytest.raises(PlanningError, match=r"j2 at 0\.7, its limit is 0\.2, 0\.5 too far"):
        check_reachable(robot, found)


def test_out_of_reach_the_distance_is_told():
    robot = arm("elbow")
    found = solve(robot, np.array([[1.0, 0, 0, 2.0], [0, 1, 0, 0], [0, 0, 1, 0.5], [0, 0, 0, 1]]))
    assert found.shortfall[0] == pytest.approx(2.0 - 0.55)
    with pytest.raises(PlanningError, match=r"within 1\.45 m"):
        check_reachable(robot, found)
    folded = solve(robot, partial_target(forward(robot, [0.1, 0.5, np.pi])[:3, 3]))
    assert int(folded.count) == 2  # forward and over the shoulder; elbow up and down fall together
    check_reachable(robot, folded)


def test_an_orientation_the_arm_cannot_have_is_told_in_radians():
    robot = arm("elbow, pitch and roll")
    pose = forward(robot, [0.4, 0.7, -1.2, 0.5, 0.3])
    side = pose.copy()
    c, s = np.cos(0.1), np.sin(0.1)
    side[:3, :3] = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ pose[:3, :3]
    found = solve(robot, side)
    assert int(found.count) == 0
    assert 0.01 < found.shortfall[1] <= 0.1 + 1e-9


def test_the_tolerance_decides_what_is_met():
    robot = arm("elbow, pitch and roll")
    pose = forward(robot, [0.4, 0.7, -1.2, 0.5, 0.3])
    rounded = np.round(pose, 6)
    assert int(solve(robot, rounded, tolerance=1e-9).count) == 0
    found = solve(robot, rounded, tolerance=1e-5)
    assert int(found.count) > 0
    assert found.closure[found.valid].max() <= 1e-5
    with pytest.raises(InputError, match="positive"):
        solve(robot, pose, tolerance=0.0)


def test_stretched_and_folded_arms_have_each_answer_once():
    robot = arm("planar 2R")
    found = solve(robot, forward(robot, [0.3, -0.3 * np.pi / 2]))  # theta offset: the links are in line
    assert int(found.count) == 1
    assert not found.singular.any()
    assert np.allclose(found.joints[found.valid], [0.3, -0.3 * np.pi / 2], atol=1e-7)


@pytest.mark.parametrize("batch", [(), (5,), (2, 3)])
def test_batches_keep_their_shape(batch):
    robot = arm("wrist over elbow", np.random.default_rng(3))
    joints = random_joints(robot, np.random.default_rng(4), int(np.prod(batch))).reshape(*batch, 6)
    found = solve(robot, forward(robot, joints), near=joints)
    assert found.joints.shape == (*batch, 8, 6)
    assert found.valid.shape == found.singular.shape == found.within_limits.shape == (*batch, 8)
    assert found.closure.shape == (*batch, 8, 2)
    assert found.free.shape == found.excess.shape == (*batch, 8, 6)
    best = np.take_along_axis(found.joints, found.nearest(joints)[..., None, None], axis=-2)[..., 0, :]
    assert best == pytest.approx(joints, abs=1e-6)


def test_an_aligned_ur_wrist_frees_four_joints():
    robot = robot_of(next(robot for robot in robots() if robot["id"] == "C-ur5e"))
    joints = np.array([0.5, -1.2, 1.1, -0.4, 0.0, 2.0])
    found = solve(robot, forward(robot, joints), near=joints)
    best = int(found.nearest(joints))
    assert found.singular[best]
    assert found.joints[best] == pytest.approx(joints, abs=1e-6)
    assert found.free[best].tolist() == [False, True, True, True, False, True]
    other = solve(robot, forward(robot, joints), near=[0.5, -1.2, 1.1, -0.4, 0.0, 2.4])
    moved = other.joints[other.valid & other.singular]
    assert np.abs(forward(robot, moved) - forward(robot, joints)).max() < 1e-9
    assert np.abs(moved[:, 5] - 2.4).min() < 0.4


@pytest.mark.parametrize("entry", load("inverse.yaml", "counts"), ids=lambda entry: entry["robot"])
def test_counts_equal_an_independent_closed_form(entry):
    robot = robot_of(next(robot for robot in robots() if robot["id"] == entry["robot"]))
    found = solve(robot, forward(robot, np.array(entry["joints"])))
    assert found.count.tolist() == entry["counts"]


@pytest.mark.parametrize("name", ["UR", "wrist over elbow", "elbow, pitch and roll"])
def test_all_poses_out_of_reach_say_exactly_how_far_each_branch_stays_away(name):
    """Angles in rad, where those of poses within reach are only bounded; poses within reach between them."""
    rng = np.random.default_rng(6)
    robot = arm(name, rng)
    poses = forward(robot, random_joints(robot, rng, 5))
    poses[[0, 2, 4], :3, 3] += 2.0 * poses[[0, 2, 4], :3, 3]
    poses[[0, 2, 4], :3, :3] = Rotation.random(3, rng=rng).as_matrix()
    found = solve(robot, poses)
    assert found.valid.any(axis=1).tolist() == [False, True, False, True, False]
    there = forward(robot, found.joints[[0, 2, 4]])
    away = np.linalg.norm(there[..., :3, 3] - poses[[0, 2, 4], None, :3, 3], axis=-1)
    rest = np.swapaxes(there[..., :3, :3], -1, -2) @ poses[[0, 2, 4], None, :3, :3]
    angles = Rotation.from_matrix(rest.reshape(-1, 3, 3)).magnitude().reshape(away.shape)
    np.testing.assert_allclose(found.closure[[0, 2, 4]], np.stack([away, angles], axis=-1), rtol=0, atol=1e-7)
