"""Arms some of whose joints are pinned, against the forward kinematics of the whole arm."""

from __future__ import annotations

import numpy as np
import pytest
from conventions import in_convention
from inverse_arms import arm, random_joints

from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.pinned_joints import solve_pinned, without_pinned
from trajcli.kinematics.inverse.target import partial_target, pose_target

PINS = [(0,), (5,), (2,), (0, 2), (1, 4), (0, 3, 5), (1, 2, 3, 4)]


@pytest.mark.parametrize("pinned", PINS, ids=str)
@pytest.mark.parametrize("convention", ["standard", "modified"])
@pytest.mark.parametrize("name", ["wrist over Stanford", "UR askew"])
def test_the_others_reach_what_the_whole_arm_reaches(name, convention, pinned):
    """With turns and slides that count either way, a base and a tool that are turned, and limits of their own."""
    rng = np.random.default_rng(3)
    robot = in_convention(arm(name, rng, np.arange(12.0).reshape(6, 2)), convention)
    assert {joint.sign for joint in robot.joints} == {-1, 1}
    q = random_joints(robot, rng, 5)
    others = [joint for joint in range(6) if joint not in pinned]
    for row in q:
        rest = without_pinned(robot, {joint: float(row[joint]) for joint in pinned})
        moved = q[:, others]
        whole = np.tile(row, (5, 1))
        whole[:, others] = moved
        np.testing.assert_allclose(forward(rest, moved), forward(robot, whole), rtol=0, atol=1e-12)
        assert rest.limits.position.tolist() == robot.limits.position[others].tolist()
        assert rest.joint_types == tuple(robot.joint_types[joint] for joint in others)


@pytest.mark.parametrize("pinned", [0, 2, 5])
def test_the_answer_nearest_to_where_the_others_are_is_found_among_theirs(pinned):
    """Turns of the others are those of their own values, whichever joint stands between them."""
    robot, rng = arm("UR", limits=[[-7.0, 7.0]] * 6), np.random.default_rng(2)
    q = random_joints(robot, rng, 1)[0] + 2 * np.pi * np.array([1, 0, -1, 0, 0, 1])
    q = np.clip(q, -6.9, 6.9)
    pose = forward(robot, q)
    target = pose_target(pose) if pinned == 0 else partial_target(pose[:3, 3], direction=pose[:3, 2])
    found = solve_pinned(robot, target, {pinned: float(q[pinned])}, q)
    best = int(found.nearest(q))
    assert found.joints[best] == pytest.approx(q, abs=1e-6)
    assert (found.joints[found.valid][:, pinned] == q[pinned]).all()
    assert not found.free[..., pinned].any()
    assert found.bounds.tolist() == robot.limits.position.tolist()
