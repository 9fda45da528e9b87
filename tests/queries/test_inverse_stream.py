"""Inverse kinematics of streams: each row takes the nearest of all answers, found here by trying them all."""

from __future__ import annotations

import numpy as np
import pytest
from counted_calls import calls_of
from tiers import few

from trajcli.geometry.rotation import quaternion_from_matrix
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.joint_turns import all_turns
from trajcli.kinematics.inverse.solve import solve
from trajcli.queries import inverse_stream
from trajcli.queries.arm import open_arm
from trajcli.queries.inverse_stream import joints_of
from trajcli.streams.table import TableBlocks

NAMES = ("x", "y", "z", "qw", "qx", "qy", "qz")


def followed(arm, poses):
    rows = np.hstack([poses[:, :3, 3], quaternion_from_matrix(poses[:, :3, :3])])
    blocks = iter([rows[: len(rows) // 2], rows[len(rows) // 2 :]])
    stream = joints_of(arm, TableBlocks(NAMES, blocks, "-"), None, 1e-6)
    return np.vstack(list(stream.blocks))


@pytest.mark.parametrize(
    ("robot", "smooth", "rounds"),
    few(
        [
            ("ur5e", False, 6),
            ("irb120", True, 6),
            ("irb120", False, 1),  # segments end where more rounds would be needed
            ("ur10e", False, 6),
            ("ur5e", True, 1),
            ("ur10e", True, 6),
        ],
        2,
    ),
)
def test_each_row_is_the_nearest_answer(monkeypatch, robot, smooth, rounds):
    monkeypatch.setattr(inverse_stream, "_ROUNDS", rounds)
    arm = open_arm(robot, si=True)
    rng = np.random.default_rng(3)
    low, high = np.array(arm.robot.limits.position).T
    if smooth:
        s = np.linspace(0, 1, 80)[:, None]
        q = low + (high - low) * (0.5 + 0.4 * np.sin(5 * s + np.arange(len(low))))
    else:
        q = rng.uniform(low, high, (50, len(low)))
    poses = forward(arm.robot, q)
    answers = followed(arm, poses)
    np.testing.assert_allclose(forward(arm.robot, answers), poses, atol=1e-6)
    last = np.zeros(len(low))
    for pose, answer in zip(poses, answers, strict=True):
        solutions = solve(arm.robot, pose, last, 1e-6)
        choices = np.vstack(
            [all_turns(arm.robot, each) for each in solutions.joints[solutions.within_limits]]
        )
        least = np.abs(choices - last).max(axis=1).min()
        assert np.abs(answer - last).max() <= least + 1e-6
        last = answer


@pytest.mark.parametrize("smooth", [False, True])
def test_a_row_costs_little(smooth):
    arm = open_arm("ur5e", si=True)
    count = 4000
    q = np.random.default_rng(3).uniform(-3, 3, (count, 6))
    if smooth:
        q = 0.8 * np.sin(3 * np.linspace(0, 1, count)[:, None] + np.arange(6)) - [0, 1.2, 0, 0, 1.2, 0]
    poses = forward(arm.robot, q)
    assert calls_of(lambda: followed(arm, poses)) / count < 9  # see benchmarks for time
