"""What is said of answers to partial targets: how far they are off, and in which turn their joints are."""

from __future__ import annotations

import numpy as np
import pytest
from inverse_arms import arm, random_joints

from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.solve import solve
from trajcli.kinematics.inverse.target import partial_target

FULL = 2 * np.pi


@pytest.mark.parametrize(
    ("name", "kind", "axis"),
    [
        ("planar 3R", "pitch", "x"),
        ("elbow and pitch", "pitch", "x"),
        ("elbow, pitch and roll", None, "x"),
        ("UR", "direction", "z"),
        ("wrist over SCARA", "direction", "z"),
    ],
)
def test_answers_are_in_the_turns_that_are_nearest_and_say_how_far_they_are_off(
    name: str, kind: str | None, axis: str
) -> None:
    rng = np.random.default_rng(6)
    robot = arm(name, rng)
    q = random_joints(robot, rng, 3)
    poses = forward(robot, q)
    tool = poses[:, :3, "xyz".index(axis)]
    part = {
        None: {},
        "direction": {"direction": tool},
        "pitch": {"pitch": np.arctan2(tool[:, 2], np.hypot(tool[:, 0], tool[:, 1]))},
    }[kind]
    target = partial_target(poses[:, :3, 3], tool_axis=axis, **part)
    turning = np.array([each == "revolute" for each in robot.joint_types])
    near = q + np.where(turning, FULL * rng.integers(-1, 2, q.shape), 0.0)
    found = solve(robot, target, near)
    gaps = np.abs(found.joints - near[:, None])[found.valid]
    assert gaps[:, turning].max() <= np.pi * (1 + 1e-9)
    own = np.where(found.valid, np.abs(found.joints - near[:, None]).max(axis=2), np.inf).min(axis=1)
    np.testing.assert_allclose(own, 0.0, rtol=0, atol=1e-6)
    reached = forward(robot, found.joints)
    off = np.linalg.norm(reached[..., :3, 3] - poses[:, None, :3, 3], axis=-1)
    said = found.closure[..., 0] if found.closure.shape[-1] == 2 else found.closure[0]
    np.testing.assert_allclose(said[found.valid], off[found.valid], rtol=0, atol=1e-13)
    assert (said[found.valid] <= 1e-9).all()


def test_targets_that_are_hard_to_meet_are_answered_in_a_batch_as_each_alone() -> None:
    """Of an arm that is stretched out but for 0.1 mm there is a narrow range; beyond its reach, none."""
    robot = arm("planar 3R")
    radius = np.array([0.5, 0.8999, 0.95, 0.8999, 0.6, 0.89995, 0.3])
    angle = np.array([0.1, 0.0, 0.4, 0.9, -0.5, 2.0, 1.0])
    places = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(7, -0.1)], axis=1)
    near = np.random.default_rng(3).uniform(-1.0, 1.0, (7, 3)) + angle[:, None]
    together = solve(robot, partial_target(places), near)
    assert together.count.tolist() == [2, 2, 0, 2, 2, 2, 2]
    for row in range(7):
        alone = solve(robot, partial_target(places[row]), near[row])
        assert alone.valid.tolist() == together.valid[row].tolist()
        usable = together.valid[row]
        np.testing.assert_allclose(together.joints[row][usable], alone.joints[usable], rtol=0, atol=1e-7)
        reached = forward(robot, together.joints[row][usable])[:, :3, 3]
        np.testing.assert_allclose(reached, np.tile(places[row], (len(reached), 1)), rtol=0, atol=2e-9)


def test_six_joints_answer_hard_targets_in_a_batch_as_each_alone() -> None:
    """A tool that points along x at the end of the reach of an arm, beside targets that are met at once."""
    robot = arm("UR")
    q = np.array(
        [[0.3, -0.9, 1.2, 0.4, 0.8, 1.4], [0.2, -1.0, 0.02, 0.5, 0.9, 0.1], [1.0, -0.7, 0.9, -0.3, 1.1, 0.2]]
    )
    poses = forward(robot, q)
    near = q + 0.3
    directions = poses[:, :3, 2]
    together = solve(robot, partial_target(poses[:, :3, 3], direction=directions), near)
    for row in range(3):
        alone = solve(robot, partial_target(poses[row, :3, 3], direction=directions[row]), near[row])
        assert alone.valid.tolist() == together.valid[row].tolist()
        usable = together.valid[row]
        assert usable.sum() >= 2
        np.testing.assert_allclose(together.joints[row][usable], alone.joints[usable], rtol=0, atol=1e-6)
        reached = forward(robot, together.joints[row][usable])
        np.testing.assert_allclose(reached[:, :3, 3] - poses[row, :3, 3], 0.0, rtol=0, atol=2e-9)
        np.testing.assert_allclose(reached[:, :3, 2] - directions[row], 0.0, rtol=0, atol=2e-9)
