"""Whole poses that meet a target which leaves something free, and which posture a configuration has."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from inverse_arms import arm, random_joints
from scipy.spatial.transform import Rotation

from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse import partial_targets
from trajcli.kinematics.inverse.answers import Answers, closures
from trajcli.kinematics.inverse.families.choose import method_for
from trajcli.kinematics.inverse.families.screw_axes import axis_geometry
from trajcli.kinematics.inverse.numeric import SearchResult
from trajcli.kinematics.inverse.partial_targets import (
    SAMPLES,
    Postures,
    _PostureReduction,
    _without_repetition,
    whole_poses,
)
from trajcli.kinematics.inverse.solve import solve
from trajcli.kinematics.inverse.target import partial_target, residuals
from trajcli.kinematics.inverse.tool_axis import always_vertical, fixed_axis
from trajcli.kinematics.robot import Joint, Robot, unlimited

H = np.pi / 2


def scorbot(rng: np.random.Generator) -> Robot:
    """Return an arm of five joints whose tcp is on axis 5."""
    rows = [(0, 0.36, 0.02, H), (0, 0, 0.22, 0), (0, 0, 0.22, 0), (0, 0, 0, H), (0, 0.15, 0, 0)]
    joints = tuple(Joint(f"j{i}", "revolute", *row) for i, row in enumerate(rows))
    base, tool = np.eye(4), np.eye(4)
    base[:3, :3], base[:3, 3] = Rotation.random(rng=rng).as_matrix(), rng.normal(size=3) * 0.1
    tool[2, 3] = 0.07
    return Robot("scorbot", joints, unlimited(5), "standard", base, tool)


def case(name: str, kind: str | None, axis: str, anyhow: bool, count: int = 4):
    """Return an arm, joint values, and the targets that these meet."""
    rng = np.random.default_rng(7)
    robot = scorbot(rng) if name == "scorbot" else arm(name, rng if anyhow else None)
    q = random_joints(robot, rng, count)
    poses = forward(robot, q)
    tool = poses[:, :3, "xyz".index(axis)]
    part = {
        None: {},
        "direction": {"direction": tool},
        "yaw": {"yaw": np.arctan2(tool[:, 1], tool[:, 0])},
        "pitch": {"pitch": np.arctan2(tool[:, 2], np.hypot(tool[:, 0], tool[:, 1]))},
    }[kind]
    return robot, q, partial_target(poses[:, :3, 3], tool_axis=axis, **part)


CASES = [
    # arm, what is fixed beside the position, of which axis, base and tool anyhow; then flips, samples, joints free alone
    ("planar 3R", None, "x", True, 1, SAMPLES, []),
    ("planar 3R", "yaw", "x", False, 1, 1, []),
    ("planar 3R", "direction", "y", True, 1, 1, []),
    ("planar 3R", "pitch", "x", True, 2, 1, []),
    ("planar 3R", "pitch", "x", False, 1, SAMPLES, []),  # level wherever the arm is
    ("planar 3R", "direction", "z", False, 1, SAMPLES, []),  # which no joint turns
    ("SCARA", None, "x", True, 1, SAMPLES, []),
    ("SCARA", "direction", "x", True, 1, 1, []),
    ("elbow and pitch", None, "x", True, 1, SAMPLES, []),
    ("elbow and pitch", "pitch", "x", True, 2, 1, []),
    ("elbow and pitch", "direction", "y", True, 1, 1, []),
    ("elbow, pitch and roll", None, "x", True, 1, SAMPLES, []),
    ("elbow, pitch and roll", "pitch", "x", True, 2, SAMPLES, []),
    ("scorbot", "direction", "x", True, 2, 1, []),
    ("scorbot", "direction", "z", True, 1, 1, [4]),
    ("scorbot", "pitch", "z", True, 2, 1, [4]),
    ("scorbot", None, "z", True, 1, SAMPLES, [4]),
    ("UR", "direction", "z", True, 1, SAMPLES, []),
]


@pytest.mark.parametrize(("name", "kind", "axis", "anyhow", "flips", "samples", "alone"), CASES)
def test_where_the_arm_stands_is_among_the_poses_that_meet_its_own_target(
    name, kind, axis, anyhow, flips, samples, alone
) -> None:
    """The first sample is that of the given configuration; all have the position, and one turn for each shoulder."""
    robot, q, target = case(name, kind, axis, anyhow)
    geometry = axis_geometry(robot)
    found = whole_poses(robot, geometry, target, q)
    assert found is not None
    assert (found.flips, found.poses.shape[2]) == (flips, samples)
    assert np.flatnonzero(found.free).tolist() == alone
    first = found.poses[:, :, 0]
    gaps = np.abs(first - forward(robot, q)).max(axis=(-2, -1)).reshape(-1, len(q))
    assert gaps.min(axis=0).max() < 1e-9
    np.testing.assert_allclose(
        found.poses[..., :3, 3],
        np.broadcast_to(target.poses[:, :3, 3], (*found.poses.shape[:-2], 3)),
        atol=1e-12,
    )
    turns = found.poses[..., :3, :3]
    np.testing.assert_allclose(
        np.swapaxes(turns, -1, -2) @ turns, np.broadcast_to(np.eye(3), turns.shape), atol=1e-12
    )
    slopes = np.stack(
        [
            (residuals(target, forward(robot, q + h)) - residuals(target, forward(robot, q - h))) / 2e-6
            for h in 1e-6 * np.eye(q.shape[1])
        ],
        axis=2,
    )
    ranks = (np.linalg.svd(slopes, compute_uv=False) > 1e-6).sum(axis=1)
    assert found.freedom == q.shape[1] - ranks.max()
    assert not found.degenerate.any()
    if found.shoulder is not None:
        np.testing.assert_allclose(np.hypot(*found.shoulder), 1.0, rtol=0, atol=1e-12)
        own = np.cos(q[:, 0]) * found.shoulder[0, :, 0] + np.sin(q[:, 0]) * found.shoulder[1, :, 0]
        assert (own.max(axis=0) > 1.0 - 1e-9).all()


@pytest.mark.parametrize("name", ["planar 3R", "elbow and pitch", "SCARA"])
def test_samples_of_a_sum_of_turns_are_spread_evenly(name: str) -> None:
    robot, q, target = case(name, None, "x", True)
    found = whole_poses(robot, axis_geometry(robot), target, q)
    assert found is not None
    turns = found.poses[0, 0, :, :, :3, :3]
    steps = np.swapaxes(turns[:-1], -1, -2) @ turns[1:]
    angles = Rotation.from_matrix(steps.reshape(-1, 3, 3)).magnitude()
    np.testing.assert_allclose(angles, 2 * np.pi / SAMPLES, rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    ("name", "kind", "axis"),
    [
        ("elbow, pitch and roll", "direction", "x"),  # whose roll moves the tcp
        ("elbow and pitch", "yaw", "x"),  # about axes that are not upright
        ("scorbot", "yaw", "z"),
    ],
)
def test_where_orientation_and_position_are_coupled_there_is_no_model(
    name: str, kind: str, axis: str
) -> None:
    robot, q, target = case(name, kind, axis, True)
    assert whole_poses(robot, axis_geometry(robot), target, q) is None


def test_a_coordinate_that_is_free_leaves_no_model_but_to_six_joints() -> None:
    for name, modelled in (("elbow and pitch", False), ("UR", True)):
        robot, q, target = case(name, "direction", "x", True)
        some = partial_target(
            target.poses[:, :3, 3], fixed=(True, False, True), direction=target.aims, tool_axis="x"
        )
        assert (whole_poses(robot, axis_geometry(robot), some, q) is not None) == modelled
    robot, q, _ = case("elbow and pitch", None, "x", True)
    poses = forward(robot, q)
    turned = partial_target(poses[:, :3, 3], rotation=poses[:, :3, :3], fixed=(True, True, True))
    assert whole_poses(robot, axis_geometry(robot), turned, q) is None


@pytest.mark.parametrize(
    ("name", "kind", "axis", "flips"),
    [
        ("planar 3R", "pitch", "x", 2),
        ("elbow and pitch", "pitch", "x", 2),
        ("elbow, pitch and roll", "pitch", "x", 2),
        ("UR", "direction", "z", 1),
    ],
)
def test_a_posture_is_the_branch_by_which_an_answer_is_called(name, kind, axis, flips) -> None:
    """Also where joints are full turns further."""
    robot, q, target = case(name, kind, axis, True, 3)
    found = solve(robot, target, q)
    postures = Postures(robot, axis_geometry(robot), method_for(robot), flips, axis)
    rows, branches = np.nonzero(found.valid)
    joints = found.joints[rows, branches]
    assert len(set(branches.tolist())) > 2
    np.testing.assert_array_equal(postures.of(joints), branches)
    np.testing.assert_array_equal(
        postures.of(joints + 2 * np.pi * (np.arange(joints.shape[1]) == 1)), branches
    )


@pytest.mark.parametrize(
    ("name", "kind", "axis"),
    [
        ("planar 3R", "pitch", "x"),
        ("elbow and pitch", "pitch", "x"),
        ("elbow and pitch", "direction", "x"),
        ("scorbot", "direction", "x"),
        ("scorbot", "pitch", "z"),
    ],
)
@pytest.mark.parametrize("turned", [[0, 2], [1, 3], [0, 1, 2, 3, 4], [4]])
def test_which_way_joints_count_does_not_change_what_an_answer_is_called(name, kind, axis, turned) -> None:
    robot, q, target = case(name, kind, axis, True, 3)
    signs = np.where(np.isin(np.arange(q.shape[1]), turned), -1, 1)
    joints = tuple(
        replace(joint, sign=int(sign) * joint.sign) for joint, sign in zip(robot.joints, signs, strict=True)
    )
    other = replace(robot, joints=joints)
    one, two = solve(robot, target, q), solve(other, target, signs * q)
    assert one.names == two.names
    np.testing.assert_array_equal(one.valid, two.valid)
    np.testing.assert_allclose(one.joints[one.valid], signs * two.joints[two.valid], rtol=0, atol=1e-6)


def test_parallel_axes_that_joint_1_turns_are_upright_only_where_it_stands_so() -> None:
    """A heading then depends on joint 1, although the axes are vertical at zero."""
    robot, q, _ = case("elbow and pitch", None, "x", False)
    axis = axis_geometry(robot).axes[1].direction
    base = np.eye(4)
    base[:3, :3] = Rotation.align_vectors([[0.0, 0.0, 1.0]], [axis])[0].as_matrix()
    robot = replace(robot, base=base)
    assert np.abs(base[:3, :3] @ axis - [0.0, 0.0, 1.0]).max() < 1e-12
    target = partial_target(forward(robot, q)[:, :3, 3], yaw=np.zeros(4), tool_axis="x")
    assert whole_poses(robot, axis_geometry(robot), target, q) is None


def test_a_roll_about_the_tool_axis_beside_the_tcp_is_no_joint_that_is_free_alone() -> None:
    robot = scorbot(np.random.default_rng(7))
    tool = robot.tool.copy()
    tool[0, 3] = 0.05
    robot = replace(robot, tool=tool)
    q = random_joints(robot, np.random.default_rng(8), 3)
    found = whole_poses(robot, axis_geometry(robot), partial_target(forward(robot, q)[:, :3, 3]), q)
    assert found is not None
    assert (found.freedom, found.free.any()) == (2, False)
    gaps = np.abs(found.poses[:, :, 0] - forward(robot, q)).max(axis=(-2, -1)).reshape(-1, 3)
    assert gaps.min(axis=0).max() < 1e-9


@pytest.mark.parametrize("tilt", [0.0, 1e-4])
def test_an_axis_is_vertical_within_rounding(tilt: float) -> None:
    """The tool axis that no joint of a SCARA turns has a heading as soon as its base leans."""
    robot = arm("SCARA")
    base = np.eye(4)
    base[:3, :3] = Rotation.from_euler("y", tilt).as_matrix()
    geometry = axis_geometry(replace(robot, base=base))
    assert always_vertical(geometry, "z") == (tilt == 0.0)
    assert fixed_axis(geometry, "z")
    assert not fixed_axis(geometry, "x")


def reduction(name: str, kind: str | None, axis: str, flips: int, shift: float, limits=None):
    """Return a reduction to postures for targets of joint values, near to others, and answers that are none yet."""
    robot, q, target = case(name, kind, axis, True, 3)
    if limits is not None:
        robot = replace(robot, limits=replace(robot.limits, position=np.tile(limits, (q.shape[1], 1))))
    method = method_for(robot)
    postures = Postures(robot, axis_geometry(robot), method, flips, axis)
    near = q + shift
    found = solve(robot, target, near)
    joints = np.full((q.shape[1], len(found.names), 3), 0.5)
    answers = Answers(
        method, joints, closures(robot, target, joints), np.zeros(joints.shape[1:], dtype=bool),
        np.ones(3, dtype=bool), np.zeros(q.shape[1], dtype=bool), 1, True,
    )  # fmt: skip
    return _PostureReduction(postures, target, near, 1e-9), answers, q, found


def test_an_offer_is_taken_by_its_posture_where_it_meets_its_target_and_is_nearer() -> None:
    """In the turns that are nearest; those outside the limits come behind those inside."""
    own, answers, q, found = reduction("UR", "direction", "z", 1, 0.05, [-3.5, 3.5])
    posture = own.postures.of(q)
    wrong = q.copy()
    wrong[1] += 1e-2
    own._offer(answers, np.arange(3), wrong + 2 * np.pi)
    assert np.argwhere(answers.valid.T).tolist() == [[0, posture[0]], [2, posture[2]]]
    for row in (0, 2):
        np.testing.assert_allclose(answers.joints[:, posture[row], row], q[row], rtol=0, atol=1e-12)
    better = found.joints[2, posture[2]][None]
    for offered in (better, q[[2]]):  # and back, which is further off
        own._offer(answers, np.array([2]), offered)
        np.testing.assert_allclose(answers.joints[:, posture[2], 2], better[0], rtol=0, atol=1e-12)
    assert np.abs(better - q[2]).max() > 1e-3
    own._offer(answers, np.arange(0), q[:0])


def test_what_is_outside_the_limits_counts_as_far_and_turns_are_chosen_before() -> None:
    own, _, q, _ = reduction("UR", "direction", "z", 1, 0.1, [-3.1, 3.1])
    joints = np.stack([q + 2 * np.pi, q], axis=1).transpose(2, 1, 0).copy()
    joints[0, 1, :2] = np.pi  # outside on either side
    cost = own._cost(joints, np.arange(3))
    np.testing.assert_allclose(joints[:, 0].T, q, rtol=0, atol=1e-12)
    np.testing.assert_allclose(cost[0], 6 * 0.1**2, rtol=1e-9)
    assert (cost[1] > 1e3).tolist() == [True, True, False]


def test_a_posture_that_no_sample_meets_is_sought_and_a_target_that_none_does_is_searched_for() -> None:
    """All answers there are come back from starts that are a little off, and from nothing."""
    own, answers, q, found = reduction("UR", "direction", "z", 1, 0.02)
    posture = own.postures.of(q)
    start = (q + 0.01).T
    answers.joints[:] = start[:, None]
    own.fill_missing(answers)
    assert answers.valid.any(axis=0).all()
    for row in range(3):
        assert answers.valid[posture[row], row]
        pose = forward(own.postures.robot, answers.joints[:, posture[row], row])
        assert answers.valid[:, row].tolist() == solve(own.postures.robot, pose).valid.tolist()
        own_joints = answers.joints[:, answers.valid[:, row], row].T
        indices = np.flatnonzero(answers.valid[:, row])
        assert own.postures.of(own_joints).tolist() == indices.tolist()
        tool = forward(own.postures.robot, own_joints)
        np.testing.assert_allclose(
            tool[:, :3, 2], np.tile(own.target.aims[row], (len(tool), 1)), rtol=0, atol=1e-9
        )
    before = answers.joints.copy()
    own.move_nearest(answers)
    far, came = (
        np.square(each - own.near.T[:, None]).sum(axis=0)[answers.valid] for each in (before, answers.joints)
    )
    assert (came <= far + 1e-9).all()
    assert (came < far - 1e-6).any()
    best = np.where(answers.valid, np.square(answers.joints - own.near.T[:, None]).sum(axis=0), np.inf).min(
        axis=0
    )
    theirs = np.where(found.valid, np.square(found.joints - own.near[:, None]).sum(axis=2), np.inf).min(
        axis=1
    )
    np.testing.assert_allclose(best, theirs, rtol=0, atol=1e-7)


def test_what_no_refinement_meets_is_searched_for_from_where_the_arm_is(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """But for a target that is met already; one seed meets the last target, the other one that before."""
    own, answers, q, _ = reduction("UR", "direction", "z", 1, 0.02)
    own._offer(answers, np.array([0]), q[[0]])
    met = np.array([[False, True], [True, False]])
    found = SearchResult(np.where(met[..., None], q[1:, None], 0.5), met)
    looked: list[np.ndarray] = []
    monkeypatch.setattr(partial_targets, "refine", lambda robot, target, start, rounds: start)
    monkeypatch.setattr(partial_targets, "search", lambda *given: looked.append(given[2]) or found)
    own.fill_missing(answers)
    assert [near.tolist() for near in looked] == [own.near[1:].tolist()]
    posture = own.postures.of(q)
    assert np.argwhere(answers.valid.T).tolist() == [[row, posture[row]] for row in range(3)]
    np.testing.assert_allclose(answers.joints[:, posture, range(3)].T, q, rtol=0, atol=1e-12)


def test_indices_that_come_twice_are_taken_one_after_the_other() -> None:
    rows = np.array([2, 0, 2, 1, 2])
    parts = [part.tolist() for part in _without_repetition(rows)]
    assert sorted(index for part in parts for index in part) == list(range(5))
    assert all(len(set(rows[part])) == len(part) for part in parts)
    assert len(parts) == 3
