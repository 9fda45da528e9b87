"""Poses whose answers may be singular: they are looked at apart, and come back like all others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from inverse_arms import FAMILIES, arm, gap, random_joints
from scipy.spatial.transform import Rotation

from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.families.elbow import parallel_pair
from trajcli.kinematics.inverse.families.screw_axes import ScrewAxis
from trajcli.kinematics.inverse.families.subproblems import DegeneracyFlags
from trajcli.kinematics.inverse.solve import solve
from trajcli.kinematics.inverse.target import partial_target


def suspect_joints(robot, rng, count):
    """Return joints of which the first third is aligned at joint 5, the second stretched at joint 3."""
    joints = random_joints(robot, rng, count)
    joints[: count // 3, 4] = np.where(rng.random(count // 3) < 0.5, 0.0, np.pi)
    joints[count // 3 : 2 * count // 3, 2] = 0.0
    return joints


@pytest.mark.parametrize("with_near", [False, True])
@pytest.mark.parametrize("name", ["UR", "wrist over elbow"])
def test_singular_poses_come_back_met_and_turned(name, with_near):
    rng = np.random.default_rng(5)
    low = rng.uniform(-5.0, -1.0, 6)
    robot = arm(name, rng, np.stack([low, low + 2.0 * np.pi], axis=1))
    joints = suspect_joints(robot, rng, 60)
    near = joints + rng.normal(size=joints.shape) if with_near else None
    poses = forward(robot, joints)
    found = solve(robot, poses, near)
    assert found.valid.any(axis=1).all()
    assert (found.within_limits == found.valid).all()  # every angle has one turn inside a full turn
    off = np.abs(forward(robot, found.joints) - poses[:, None])[..., :3, 3].max(axis=-1)
    assert off[found.valid].max() < 1e-9
    assert found.closure[found.valid].max() < 1e-9


@pytest.mark.parametrize("name", ["UR", "wrist over elbow"])
def test_poses_of_all_kinds_do_not_learn_of_each_other(name):
    robot, rng = arm(name), np.random.default_rng(6)
    poses = forward(robot, suspect_joints(robot, rng, 12))
    together = solve(robot, poses)
    for i, pose in enumerate(poses):
        alone = solve(robot, pose)
        assert (together.valid[i] == alone.valid).all()
        assert (together.singular[i] == alone.singular).all()
        assert together.joints[i] == pytest.approx(alone.joints, abs=1e-12)
        assert together.closure[i] == pytest.approx(alone.closure, abs=1e-15)


def test_turns_are_chosen_where_a_pitch_has_one_answer_for_each_posture():
    rng = np.random.default_rng(8)
    low = np.array([1.0, -4.0, 0.5, -6.0])
    robot = arm("elbow and pitch", rng, np.stack([low, low + 2.0 * np.pi], axis=1))
    joints = low + 2.0 * np.pi * rng.random((20, 4))
    poses = forward(robot, joints)
    target = partial_target(poses[:, :3, 3], pitch=np.arcsin(poses[:, 2, 2]))
    found = solve(robot, target)
    assert (found.within_limits == found.valid).all()
    assert np.where(found.valid, gap(robot, found.joints, joints[:, None]), 1.0).min(axis=1).max() < 1e-6


def turning(line, angle):
    """Return the motion (4, 4) of a turn about a line."""
    motion = np.eye(4)
    motion[:3, :3] = Rotation.from_rotvec(angle * np.array(line.direction)).as_matrix()
    motion[:3, 3] = line.point - motion[:3, :3] @ line.point
    return motion


@pytest.mark.parametrize("same", [1.0, -1.0])
@pytest.mark.parametrize("beyond_elbow", [0.3, 3e-9])
def test_two_parallel_turns_meet_their_aim_also_where_the_second_is_free(same, beyond_elbow):
    rng = np.random.default_rng(9)
    two = ScrewAxis(prismatic=False, direction=(0.0, 0.6, 0.8), point=(0.1, 0.0, 0.2))
    three = ScrewAxis(prismatic=False, direction=(0.0, 0.6 * same, 0.8 * same), point=(0.5, 0.08, 0.14))
    tip = np.append(three.point + beyond_elbow * np.array([0.28, 0.768, -0.576]), 1.0)
    motions = [turning(two, rng.uniform(-3, 3)) @ turning(three, rng.uniform(-3, 3)) for _ in range(20)]
    aims = np.array([motion @ tip for motion in motions])
    flags = DegeneracyFlags(20, 1.0)
    turns = parallel_pair(two, three, tuple(tip[:3]), tuple(aims[:, :3].T), flags)
    assert all(np.hypot(*turn) == pytest.approx(1.0, abs=3e-15) for turn in turns)
    second, third = (np.arctan2(sine, cosine) for cosine, sine in turns)
    for answer in range(2):
        for i, aim in enumerate(aims):
            reached = turning(two, second[answer, i]) @ turning(three, third[answer, i]) @ tip
            assert reached == pytest.approx(aim, abs=3e-15 if beyond_elbow > 1e-8 else 3.0 * beyond_elbow)
    assert flags.rows.all() == (beyond_elbow < 1e-8)


@pytest.mark.parametrize("zero", ["0", ".3", "1", "2"])
@pytest.mark.parametrize(("first", "slant"), [(".4", ".8"), ("0", "1"), ("1", "1")])
def test_first_and_last_axis_of_a_wrist_in_line_share_one_turn_wherever_joint_5_is_zero(
    monkeypatch: pytest.MonkeyPatch, first: str, slant: str, zero: str
) -> None:
    """Forward kinematics says what the sum of their turns is: a part that each of them may have."""
    wrist = [f"R {first} .4 0 -{slant}", f"R {zero} 0 0 {slant}", "R .7 .1 .02 0"]
    monkeypatch.setitem(
        FAMILIES, "line", ([*FAMILIES["wrist over elbow"][0][:3], *wrist], 8, "spherical wrist")
    )
    robot = arm("line")
    joints = random_joints(robot, np.random.default_rng(11), 4)
    joints[:, 4] = -0.5 * np.pi * float(zero)
    poses = forward(robot, joints)
    found = solve(robot, poses, np.zeros((4, 6)))
    assert found.valid.any(axis=1).all()
    np.testing.assert_allclose(
        forward(robot, found.joints)[found.valid], np.repeat(poses, found.count, axis=0), rtol=0, atol=1e-8
    )
    apart = np.abs(np.exp(1j * found.joints[..., :3]) - np.exp(1j * joints[:, None, :3])).max(axis=-1)
    assert np.where(found.singular, apart, 1.0).min(axis=1).max() < 1e-6


@pytest.mark.parametrize("size", [1e-9, 1e6])
@pytest.mark.parametrize(
    "name", ["elbow with offsets", "two axes that meet", "planar 3R", "wrist over elbow", "UR"]
)
def test_a_similar_arm_of_another_size_has_the_same_answers(name: str, size: float) -> None:
    robot, rng = arm(name), np.random.default_rng(12)
    scaled = [replace(joint, a=size * joint.a, d=size * joint.d) for joint in robot.joints]
    similar = replace(robot, joints=tuple(scaled))
    poses = forward(robot, random_joints(robot, rng, 12))
    larger = poses.copy()
    larger[:, :3, 3] *= size
    one, other = solve(robot, poses), solve(similar, larger)
    assert other.valid[one.valid].all()
    assert gap(robot, one.joints, other.joints)[one.valid].max() < 1e-6
