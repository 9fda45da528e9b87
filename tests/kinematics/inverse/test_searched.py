"""Answers of a search: which are kept, in which order, and where a search goes on after a closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from inverse_arms import arm, random_joints

from trajcli.job.robot import load_robot
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse import held_joint, searched
from trajcli.kinematics.inverse.answers import Answers, closures
from trajcli.kinematics.inverse.families.choose import method_for
from trajcli.kinematics.inverse.numeric import SearchResult
from trajcli.kinematics.inverse.searched import by_held_joint, by_search, resolve_suspects
from trajcli.kinematics.inverse.solve import solve
from trajcli.kinematics.inverse.target import IkTarget, partial_target, pose_target

FULL = 2 * np.pi


def found_by(monkeypatch: pytest.MonkeyPatch, joints: np.ndarray, met: np.ndarray) -> None:
    """Let a search lead to joints (N, seeds, n), some of which met their targets."""
    monkeypatch.setattr(searched, "search", lambda *_: SearchResult(joints.copy(), met.copy()))


@pytest.mark.parametrize("given", [True, False])
def test_each_answer_is_kept_once_those_inside_the_limits_first_and_the_nearest_of_them(
    given, monkeypatch
) -> None:
    """By the largest difference of any joint. Seeds lead to the same answer in other turns, and not quite to it."""
    rng = np.random.default_rng(3)
    robot = arm("UR", rng, [[-2.7, 2.7]] * 3 + [[-9.0, 9.0]] * 3)
    q = random_joints(robot, rng, 20)
    q = q[solve(robot, forward(robot, q)).valid.all(axis=1)][:3]
    q[2, 2] = 3e-3  # two answers beside each other, almost stretched
    target = pose_target(forward(robot, q))
    every = solve(robot, target)
    joints = np.concatenate(
        [every.joints - FULL, every.joints + FULL, every.joints + 4e-6 + FULL, every.joints + 0.1], axis=1
    )
    met = np.tile(np.arange(32) < 24, (3, 1))
    met[:, 30] = True  # a seed that is said to have met, and has not
    met[1, [2, 10, 18]] = False
    order = rng.permutation(32)
    found_by(monkeypatch, joints[:, order], met[:, order])
    turns = FULL * np.array([0.0, 0.0, 0.0, 1.0, -1.0, 1.0])
    near = q + turns + 0.3 * rng.normal(size=q.shape) if given else None
    answers = by_search(robot, method_for(robot), target, near, 1e-4)
    aim = np.zeros(q.shape) if near is None else near
    turned = solve(robot, target, near)
    mixed = 0
    for row in range(3):
        values = answers.joints[:, answers.valid[:, row], row].T
        missing = ~every.valid[row] | ((row == 1) & (np.arange(8) == 2))
        wanted = np.delete(turned.joints[row], missing, axis=0)
        inside = np.delete(turned.within_limits[row], missing)
        gaps = np.abs(values[:, None] - wanted).max(axis=2)
        assert gaps.min(axis=1).max() < 5e-6
        which = gaps.argmin(axis=1)
        assert sorted(which.tolist()) == list(range(len(wanted)))
        assert (np.diff(inside[which].astype(int)) <= 0).all()
        size = np.abs(values - aim[row]).max(axis=1)
        for group in (size[inside[which]], size[~inside[which]]):
            assert (np.diff(group) >= -1e-12).all()
        mixed += 0 < inside.sum() < len(inside)
    assert mixed >= 2
    assert answers.valid.sum(axis=0).tolist() == [8, 7, every.count[2]]
    np.testing.assert_allclose(answers.closure, closures(robot, target, answers.joints), rtol=0, atol=1e-9)
    assert answers.suspect.all()
    assert (answers.freedom, answers.closed_form) == (0, False)
    exact = by_search(robot, method_for(robot), target, near, 1e-9)
    assert (exact.closure.max(axis=0)[exact.valid] <= 1e-9).all()


def test_points_of_a_self_motion_become_its_nearest_and_are_ordered_by_the_sum_of_squares(
    monkeypatch,
) -> None:
    """A planar arm with its elbow on either side: points that lead to one are one."""
    robot = arm("planar 3R")
    near = np.array([[0.4, 0.3, 0.5], [0.2, -0.6, 0.9]])
    target = partial_target(forward(robot, near + 0.1)[:, :3, 3])
    some = [solve(robot, target, near + shift) for shift in (0.15, -0.1)]
    points, valid = (
        np.concatenate([getattr(each, name) for each in some], axis=1) for name in ("joints", "valid")
    )
    found_by(monkeypatch, points, valid)
    answers = by_search(robot, method_for(robot), target, near, 1e-9)
    assert answers.freedom == 1
    size = np.where(answers.valid, np.square(answers.joints - near.T[:, None]).sum(axis=0), np.inf)
    assert (np.diff(size, axis=0)[answers.valid[1:]] >= 0.0).all()
    wanted = solve(robot, target, near)
    best = wanted.joints[np.arange(2), np.square(wanted.joints - near[:, None]).sum(axis=2).argmin(axis=1)]
    assert answers.valid[0].all()
    np.testing.assert_allclose(answers.joints[:, 0].T, best, rtol=0, atol=1e-6)
    for row in range(2):
        own = answers.joints[:, answers.valid[:, row], row].T
        assert all(np.abs(a - b).max() > 1e-3 for k, a in enumerate(own) for b in own[:k])


def test_where_no_seed_has_met_the_nearest_of_them_is_told(monkeypatch) -> None:
    robot = arm("UR")
    q = random_joints(robot, np.random.default_rng(6), 2)
    target = pose_target(forward(robot, q))
    seeds = q[:, None] + np.array([0.3, 0.02, 0.1])[:, None]
    found_by(monkeypatch, seeds, np.zeros((2, 3), dtype=bool))
    answers = by_search(robot, method_for(robot), target, q, 1e-9)
    assert not answers.valid.any()
    np.testing.assert_allclose(answers.joints[:, 0].T, q + 0.02, rtol=0, atol=1e-12)


def plain(robot, joints: np.ndarray, valid: np.ndarray, target: IkTarget) -> Answers:
    """Return answers with joints (n, branches, N)."""
    count = joints.shape[-1]
    free = np.zeros(len(joints), dtype=bool)
    return Answers(
        method_for(robot),
        joints,
        closures(robot, target, joints),
        valid,
        np.ones(count, dtype=bool),
        free,
        1,
        False,
    )


@pytest.mark.parametrize("given", [True, False])
def test_a_search_goes_on_where_a_closed_form_has_no_answer_inside_the_limits(
    given: bool, monkeypatch
) -> None:
    """For those targets alone, from where the arm is; the answers of the others stay."""
    robot = load_robot("panda")
    low, high = robot.limits.position.T
    q = np.random.default_rng(5).uniform(low, high, (4, 7))
    target, near = pose_target(forward(robot, q)), q if given else None
    joints = (
        np.stack([q, q + 0.1], axis=1).transpose(2, 1, 0).copy()
    )  # (n, branches, N): the second meets nothing
    valid = np.array([[True, False, True, True], [False] * 4])
    joints[6, 0, 3] += FULL  # outside
    monkeypatch.setattr(held_joint, "points_by_held_joint", lambda *_: (joints.copy(), valid.copy()))
    asked = []

    def search_of(robot, method, target, near, tolerance):
        asked.append((target.poses, near, tolerance))
        three = np.repeat(q[[1, 3]].T[:, None], 3, axis=1)
        return plain(robot, three, np.array([[True, True], [True, False], [False, True]]), target)

    monkeypatch.setattr(searched, "by_search", search_of)
    answers = by_held_joint(robot, method_for(robot), target, near, 1e-7)
    ((poses, nearby, tolerance),) = asked
    np.testing.assert_array_equal(poses, target.poses[[1, 3]])
    assert tolerance == 1e-7
    if given:
        np.testing.assert_array_equal(nearby, q[[1, 3]])
    else:
        assert nearby is None
    assert answers.joints.shape == (7, 3, 4)
    assert answers.valid.T.tolist() == [
        [True, False, False],
        [True] * 2 + [False],
        [True, False, False],
        [True, False, True],
    ]
    np.testing.assert_array_equal(answers.joints[:, 0], q.T)
    np.testing.assert_allclose(answers.closure, closures(robot, target, answers.joints), rtol=0, atol=1e-12)


def test_a_target_that_leaves_something_free_is_searched_for_and_says_why(monkeypatch) -> None:
    robot = load_robot("panda")
    asked = []
    monkeypatch.setattr(searched, "by_search", lambda _, method, *rest: asked.append((method, *rest)))
    target = partial_target(np.array([[0.4, 0.0, 0.5]]), direction=[0.0, 0.0, -1.0])
    by_held_joint(robot, method_for(robot), target, None, 1e-9)
    ((method, same, near, tolerance),) = asked
    assert (method.family, near, tolerance) == ("numeric", None, 1e-9)
    assert "fixes 5 coordinates" in method.reason
    assert same is target


def test_a_suspect_pose_all_of_whose_branches_are_lost_is_met_from_where_the_arm_is() -> None:
    robot = arm("UR", np.random.default_rng(7))
    q = random_joints(robot, np.random.default_rng(8), 3)
    q[2, 4] = 0.0  # and what is found may be singular itself
    target = pose_target(forward(robot, q))
    joints = np.tile((q + 0.4).T[:, None], (1, 8, 1))
    answers = plain(robot, joints, np.zeros((8, 3), dtype=bool), target)
    answers = replace(answers, closed_form=True, freedom=0, suspect=np.array([False, True, True]))
    singular, free = resolve_suspects(robot, target, answers, q, 1e-9)
    assert answers.valid.any(axis=0).tolist() == [False, True, True]
    for row in (1, 2):
        own = answers.joints[:, answers.valid[:, row], row].T
        assert np.abs(own - q[row]).max(axis=1).min() < 1e-8
    np.testing.assert_allclose(answers.closure, closures(robot, target, answers.joints), rtol=0, atol=1e-12)
    assert singular.any(axis=0).tolist() == [False, False, True]
    assert free.any(axis=(0, 1)).tolist() == [False, False, True]


@pytest.mark.parametrize("name", ["UR", "wrist over elbow"])
def test_what_is_singular_is_an_answer(name: str) -> None:
    robot = arm(name, np.random.default_rng(7))
    q = random_joints(robot, np.random.default_rng(8), 6)
    q[:, 4] = 0.0
    found = solve(robot, forward(robot, q), q)
    assert found.singular.any(axis=1).all()
    assert not (found.singular & ~found.valid).any()
    assert not (found.free & ~found.valid[..., None]).any()
