"""Candidate solutions by name, in batches, and without their rounding."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from inverse_arms import arm, random_joints
from scipy.spatial.transform import Rotation

from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.answers import Answers, by_name, closures, joined, polish, rough
from trajcli.kinematics.inverse.families.choose import method_for
from trajcli.kinematics.inverse.families.method import Branch
from trajcli.kinematics.inverse.target import partial_target, pose_target


def answers_of(joints: np.ndarray, valid: np.ndarray) -> Answers:
    """Return answers whose closure tells which of joints (n, branches, N) they belong to."""
    closure = np.stack([joints[0], -joints[0]])
    count = joints.shape[-1]
    flags = np.arange(count) % 2 == 0
    return Answers(method_for(arm("UR")), joints, closure, valid, flags, np.zeros(2, dtype=bool), 0, True)


def test_answers_stand_by_name_in_columns_of_their_own() -> None:
    """Of two answers of one name each has its column; a name that no target has keeps one, which is not valid."""
    joints = np.arange(24.0).reshape(2, 4, 3)
    name_of = np.array([[2, 0, -1], [0, -1, -1], [2, 0, -1], [-1, 2, 0]])
    names = (Branch("left"), Branch("right"), Branch("left", "up"))
    found = by_name(answers_of(joints, name_of >= 0), name_of, names)
    labels = found.method.branches
    assert labels == (names[0], names[0], names[1], names[2], names[2])
    for row in range(3):
        for index, name in enumerate(names):
            wanted = joints[:, name_of[:, row] == index, row].T.tolist()
            columns = [k for k, label in enumerate(labels) if label == name and found.valid[k, row]]
            assert found.joints[:, columns, row].T.tolist() == wanted
    np.testing.assert_array_equal(found.closure, np.stack([found.joints[0], -found.joints[0]]))


def test_blocks_are_joined_in_their_order() -> None:
    joints, valid = np.arange(30.0).reshape(2, 3, 5), np.arange(15).reshape(3, 5) % 2 == 0
    parts = [answers_of(joints[..., some], valid[:, some]) for some in (slice(0, 2), slice(2, 5))]
    whole = joined(parts)
    np.testing.assert_array_equal(whole.joints, joints)
    np.testing.assert_array_equal(whole.valid, valid)
    np.testing.assert_array_equal(whole.closure, np.stack([joints[0], -joints[0]]))
    assert whole.suspect.tolist() == [True, False, True, False, True]


@pytest.mark.parametrize("name", ["UR", "planar 3R"])
@pytest.mark.parametrize("count", [2, 30])
def test_each_branch_of_each_target_is_as_far_as_another_library_says(name: str, count: int) -> None:
    rng = np.random.default_rng(2)
    robot = arm(name, rng)
    joints = random_joints(robot, rng, 3 * count).T.reshape(-1, 3, count)
    poses = forward(robot, random_joints(robot, rng, count))
    if name == "UR":
        target = pose_target(poses)
    else:
        target = partial_target(poses[:, :3, 3], fixed=(True, False, True))
    there = forward(robot, np.moveaxis(joints, 0, -1))
    away = (there[..., :3, 3] - poses[:, :3, 3])[..., list(target.position)]
    found = closures(robot, target, joints)
    assert found.shape == (2, 3, count)
    np.testing.assert_allclose(found[0], np.linalg.norm(away, axis=-1), rtol=0, atol=1e-12)
    rest = np.swapaxes(there[..., :3, :3], -1, -2) @ poses[:, :3, :3]
    angles = Rotation.from_matrix(rest.reshape(-1, 3, 3)).magnitude().reshape(3, count)
    np.testing.assert_allclose(found[1], angles if name == "UR" else 0.0, rtol=0, atol=1e-12)


def test_what_rounding_keeps_away_is_above_a_hundred_roundings_and_below_what_is_no_answer() -> None:
    assert rough(np.array([2e-12, 5e-11, 1e-7, 5e-6, 2e-5])).tolist() == [False, True, True, True, False]


@pytest.mark.parametrize("part", ["position", "orientation"])
def test_rounding_is_taken_away_where_it_is_and_the_poses_are_looked_at_again(part: str) -> None:
    """Three poses: both branches off by rounding, one far off and one there, and one that is not to be touched."""
    rng = np.random.default_rng(3)
    name, step = {  # slides turn nothing; the last joint of a UR without a tool moves the tcp nowhere
        "position": ("wrist over Cartesian", np.array([1.0, 0.3, -0.5, 0.0, 0.0, 0.0])),
        "orientation": ("UR", np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1.0])),
    }[part]
    robot = replace(arm(name, rng), tool=np.eye(4))
    q = random_joints(robot, rng, 3)
    poses = forward(robot, q)
    turn = 2 * np.pi * np.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0])
    joints = np.stack([q, q + turn], axis=1)
    joints[0] += 1e-8 * step
    joints[1, 0] += 1e-2 * step
    joints[2] += 1e-8 * step
    joints = np.moveaxis(joints, 2, 0).swapaxes(1, 2).copy()  # (n, branches, N)
    target, degenerate = pose_target(poses), np.zeros(3, dtype=bool)
    closure, before = closures(robot, target, joints), joints.copy()
    polish(robot, target, joints, closure, degenerate, np.array([0, 1]))
    np.testing.assert_allclose(joints[:, :, 0], np.stack([q[0], q[0] + turn], axis=1), rtol=0, atol=1e-11)
    np.testing.assert_array_equal(joints[:, :, 1:], before[:, :, 1:])
    assert degenerate.tolist() == [True, False, False]
    np.testing.assert_allclose(closure, closures(robot, target, joints), rtol=0, atol=1e-13)
    assert closure[:, :, 0].max() < 1e-13


def test_where_branches_coincide_less_than_rounding_is_taken_away_too() -> None:
    """Of an orientation even more: beside a singular wrist small errors of a position are large ones of angles."""
    rng = np.random.default_rng(4)
    robot = replace(arm("UR", rng), tool=np.eye(4))
    q = random_joints(robot, rng, 3)
    joints = (q + np.array([[3e-13] * 6, [0.0] * 5 + [1e-4], [3e-13] * 6])).T[:, None].copy()
    target, degenerate = pose_target(forward(robot, q)), np.array([True, True, False])
    closure = closures(robot, target, joints)
    assert closure[0, 0, 1] < 1e-13
    before = joints.copy()
    polish(robot, target, joints, closure, degenerate, np.arange(3))
    assert closure[:, 0, :2].max() < 3e-15
    np.testing.assert_array_equal(joints[..., 2], before[..., 2])
    np.testing.assert_allclose(joints[:, 0, 1], q[1], rtol=0, atol=1e-12)
