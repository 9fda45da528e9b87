"""Arms of seven joints whose first six have a closed form: recognised by axes, solved by the last joint."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from trajcli.geometry.rotation import exp
from trajcli.job.robot import load_robot
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.families.choose import method_for, poses_for_the_others, without_last_joint
from trajcli.kinematics.inverse.families.method import candidates
from trajcli.kinematics.inverse.families.screw_axes import axis_geometry
from trajcli.kinematics.inverse.held_joint import points_by_held_joint
from trajcli.kinematics.inverse.numeric import search
from trajcli.kinematics.inverse.self_motion import nearest_on_self_motions
from trajcli.kinematics.inverse.solve import solve
from trajcli.kinematics.inverse.target import pose_target
from trajcli.kinematics.jacobian import poses_and_jacobians
from trajcli.kinematics.robot import Joint, Robot

PANDA = load_robot("panda")
READY = np.array([0.0, -0.5, 0.0, -2.0, 0.0, 1.6, 0.8])
# the Panda's axes in standard rows, of other names, counted the other way in joints 2 and 7
STANDARD = tuple(
    Joint(f"axis {k}", d=d, a=a, alpha=alpha * np.pi / 2, sign=-1 if k in (2, 7) else 1)
    for k, (d, a, alpha) in enumerate(
        [
            (0.333, 0.0, -1),
            (0.0, 0.0, 1),
            (0.316, 0.0825, 1),
            (0.0, -0.0825, -1),
            (0.384, 0.0, 1),
            (0.0, 0.088, 1),
            (0.107, 0.0, 0),
        ],
        1,
    )
)


def moved(position: tuple[float, float, float], turn: tuple[float, float, float]) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = exp(np.array(turn)), position
    return pose


def random_joints(robot: Robot, count: int, seed: int = 1) -> np.ndarray:
    low, high = robot.limits.position.T
    return np.random.default_rng(seed).uniform(low, high, (count, 7))


OTHER = replace(
    PANDA,
    name="nobody's",
    convention="standard",
    joints=STANDARD,
    base=moved((0.1, 0.2, 0.3), (0.4, -0.2, 1.0)),
    tool=moved((0.02, 0.0, 0.1), (0.1, 0.7, -0.3)),
    limits=replace(PANDA.limits, position=np.tile([-2.9, 2.9], (7, 1))),
)
ARMS = {"panda": PANDA, "the same axes in other rows": OTHER}


@pytest.mark.parametrize("robot", ARMS.values(), ids=ARMS)
def test_the_geometry_is_recognised_by_its_axes(robot: Robot) -> None:
    assert method_for(robot).family == "joint 7 held"


def test_an_arm_whose_shoulder_does_not_meet_is_not_taken_for_one() -> None:
    joints = list(PANDA.joints)
    joints[1] = replace(joints[1], a=0.01)
    assert method_for(replace(PANDA, joints=tuple(joints))).family == "numeric"


@pytest.mark.parametrize("robot", ARMS.values(), ids=ARMS)
def test_the_six_others_reach_what_is_left_of_the_pose(robot: Robot) -> None:
    held, q = without_last_joint(robot), random_joints(robot, 20)
    assert held is not None
    left = poses_for_the_others(robot, forward(robot, q), q[:, -1])
    np.testing.assert_allclose(forward(held, q[:, :-1]), left, rtol=0, atol=1e-14)


@pytest.mark.parametrize("robot", ARMS.values(), ids=ARMS)
def test_poses_are_met_within_the_limits_and_their_joints_recovered(robot: Robot) -> None:
    q = random_joints(robot, 100)
    poses = forward(robot, q)
    found = solve(robot, poses, q)
    best = found.nearest(q)
    assert (best >= 0).all()
    np.testing.assert_allclose(found.joints[np.arange(100), best], q, rtol=0, atol=1e-9)
    off = np.abs(forward(robot, found.joints) - poses[:, None]).max(axis=(-2, -1))
    assert off[found.valid].max() < 1e-10
    assert found.closure[found.valid].max() < 1e-10


@pytest.mark.parametrize("limits", [(-7.0, 7.0), (-np.inf, np.inf), (-np.inf, 2.0)])
def test_where_the_arm_stands_is_the_nearest_answer_also_beyond_a_turn_of_the_last_joint(limits) -> None:
    bounds = PANDA.limits.position.copy()
    bounds[-1] = limits
    robot = replace(PANDA, limits=replace(PANDA.limits, position=bounds))
    q = random_joints(PANDA, 12)
    q[:, -1] = np.random.default_rng(2).uniform(*np.clip(limits, -9.0, 9.0), 12)
    found = solve(robot, forward(robot, q), q)
    best = found.nearest(q)
    assert (best >= 0).all()
    np.testing.assert_allclose(found.joints[np.arange(12), best], q, rtol=0, atol=1e-9)


@pytest.mark.parametrize("robot", ARMS.values(), ids=ARMS)
def test_no_seed_of_a_search_leads_nearer(robot: Robot) -> None:
    poses = forward(robot, random_joints(robot, 6, seed=2))
    target, near = pose_target(poses), np.broadcast_to(READY, (6, 7))
    found = solve(robot, poses, READY)
    gaps = np.square(found.joints - READY).sum(axis=-1)
    ours = np.where(found.within_limits, gaps, np.inf).min(axis=1)
    searched = search(robot, target, near)
    rows, seeds = np.nonzero(searched.met)
    ends = nearest_on_self_motions(robot, target.rows(rows), searched.joints[rows, seeds], near[rows])
    theirs = np.square(ends - READY).sum(axis=1)
    for row in range(6):
        assert ours[row] <= theirs[rows == row].min() + 1e-9


def scanned(robot: Robot, poses: np.ndarray, near: np.ndarray, count: int) -> np.ndarray:
    """Return the least squared distance to `near` of answers within limits below a turn, of many held values."""
    held, (low, high) = without_last_joint(robot), robot.limits.position.T
    assert held is not None
    last = np.tile(np.linspace(low[-1], high[-1], count), len(poses))
    repeated = np.repeat(poses, count, axis=0)
    left = poses_for_the_others(robot, repeated, last)
    raw = candidates(held, axis_geometry(held), method_for(held), left)
    q = np.concatenate([raw.joints, np.broadcast_to(last, (1, *raw.joints.shape[1:]))])
    q = np.moveaxis((q + np.pi) % (2 * np.pi) - np.pi, 0, -1)
    inside = (raw.residuals.max(axis=0) < 1e-9) & ((q >= low) & (q <= high)).all(axis=-1)
    gaps = np.where(inside, np.square(q - np.repeat(near, count, axis=0)).sum(axis=-1), np.inf)
    return np.asarray(gaps.min(axis=0).reshape(len(poses), count).min(axis=1))


def lost(robot: Robot, seed: int, rows: slice, held_values: int) -> np.ndarray:
    """Return by how much squares of distances are above those of a scan, of poses and places to be near to."""
    poses = forward(robot, random_joints(robot, 60, seed)[rows])
    near = random_joints(robot, 60, 100 + seed)[rows]
    found = solve(robot, poses, near)
    gaps = np.square(found.joints - near[:, None]).sum(axis=-1)
    ours = np.where(found.within_limits, gaps, np.inf).min(axis=1)
    return np.asarray(ours - scanned(robot, poses, near, held_values))


@pytest.mark.parametrize(
    ("arm", "seed", "first"),
    [
        ("panda", 1, 0),
        ("panda", 0, 40),
        pytest.param(list(ARMS)[1], 2, 0, marks=pytest.mark.full),
        pytest.param("panda", 5, 0, marks=pytest.mark.full),
    ],
)
def test_no_value_of_the_held_joint_leads_nearer(arm: str, seed: int, first: int) -> None:
    """Also where a joint's limit ends the way to the nearest point, which takes more steps than others."""
    assert lost(ARMS[arm], seed, slice(first, first + 20), 300).max() <= 1e-9


@pytest.mark.full
def test_of_poses_far_from_where_the_arm_stands_two_in_a_hundred_miss_the_nearest() -> None:
    """What is within limits on less than the five degrees between samples alone may be missed."""
    gaps = np.concatenate([lost(PANDA, seed, slice(60), 1000) for seed in range(8)])
    assert np.count_nonzero(gaps > 1e-6) <= 0.02 * len(gaps)


def test_a_pose_at_the_edge_of_the_limits_is_met() -> None:
    low, high = PANDA.limits.position.T
    ends = np.array([low, high, np.where(np.arange(7) % 2, low, high)])
    poses = forward(PANDA, ends)
    found = solve(PANDA, poses, ends)
    assert found.within_limits.any(axis=1).all()


def test_answers_outside_the_limits_are_given_only_where_there_is_no_other() -> None:
    low, high = PANDA.limits.position.T
    middle, half = (low + high) / 2, (high - low) / 4
    robot = replace(PANDA, limits=replace(PANDA.limits, position=np.stack([middle - half, middle + half], 1)))
    found = solve(robot, forward(robot, random_joints(robot, 8)), middle)
    assert found.within_limits.any(axis=1).all()
    assert (found.valid == found.within_limits).all()
    beyond = solve(robot, forward(PANDA, middle + 1.7 * half), middle)
    assert beyond.valid.any()
    assert not beyond.within_limits.any()


def test_a_pose_out_of_reach_has_no_answer_and_says_how_far_it_is() -> None:
    pose = forward(PANDA, READY)
    pose[:3, 3] = [1.5, 0.0, 0.333]
    found = solve(PANDA, pose, READY)
    assert not found.valid.any()
    assert found.shortfall[0] > 0.3


@pytest.mark.parametrize("tilted", [False, True])
@pytest.mark.parametrize("name", ["panda", "stanford", "cobra600", "irb120"])
def test_products_of_matrices_agree_with_differences_of_poses(name: str, tilted: bool) -> None:
    robot = load_robot(name)
    if tilted:  # axes that are almost parallel have a beta beside alpha; joints may count the other way
        robot = replace(
            robot, joints=tuple(replace(joint, beta=0.3, sign=-joint.sign) for joint in robot.joints)
        )
    q = np.random.default_rng(3).uniform(-1.0, 1.0, (3, len(robot.joints)))
    poses, slopes = poses_and_jacobians(robot, q)
    np.testing.assert_allclose(poses, forward(robot, q), rtol=0, atol=1e-15 * 10)
    for joint, step in enumerate(1e-6 * np.eye(len(robot.joints))):
        change = (forward(robot, q + step) - forward(robot, q - step)) / 2e-6
        np.testing.assert_allclose(slopes[:, :3, joint], change[:, :3, 3], rtol=0, atol=1e-8)
        spin = change[:, :3, :3] @ np.swapaxes(poses[:, :3, :3], 1, 2)
        turning = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1)
        np.testing.assert_allclose(slopes[:, 3:, joint], turning, rtol=0, atol=1e-8)


def test_a_last_row_with_a_beta_is_searched_for() -> None:
    """What follows the held joint is then no screw about x: no closed form, and no failure."""
    robot = replace(OTHER, joints=(*STANDARD[:-1], replace(STANDARD[-1], beta=1e-4)))
    q = READY + 0.1
    solutions = solve(robot, pose_target(forward(robot, q)), q)
    assert (solutions.method.family, method_for(OTHER).family) == ("numeric", "joint 7 held")
    np.testing.assert_allclose(solutions.joints[solutions.nearest(q)], q, rtol=0, atol=1e-9)


@pytest.mark.parametrize("joints", [[3], [1, 3], [0, 2, 3]])
@pytest.mark.parametrize("end", [0, 1])
def test_where_the_arm_stands_is_the_nearest_answer_whichever_joints_are_at_their_ends(
    joints: list[int], end: int
) -> None:
    q = np.array([0.3, 0.4, 0.2, -1.2, 0.0, 0.0, 0.0])
    q[joints] = PANDA.limits.position[joints, end]
    solutions = solve(PANDA, pose_target(forward(PANDA, q)), q)
    np.testing.assert_allclose(solutions.joints[solutions.nearest(q)], q, rtol=0, atol=1e-9)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_all_of_the_last_row_is_left_to_the_others(convention, sign: int) -> None:
    """Its angles and lengths, standard rows with a screw behind the joint, and a small offset of the tool."""
    last = replace(STANDARD[-1], theta=0.3, d=0.1, a=0.05, alpha=0.4, sign=sign)
    robot = replace(OTHER, joints=(*STANDARD[:-1], last), convention=convention)
    for each in (robot, replace(PANDA, tool=moved((0.0, 4e-4, 0.0), (0.0, 0.0, 0.0)))):
        held, q = without_last_joint(each), random_joints(each, 5)
        assert held is not None
        left = poses_for_the_others(each, forward(each, q), q[:, -1])
        np.testing.assert_allclose(forward(held, q[:, :-1]), left, rtol=0, atol=1e-14)


def test_only_the_last_of_seven_is_held_and_only_where_it_turns() -> None:
    limits = replace(PANDA.limits, position=np.arange(14.0).reshape(7, 2))
    held = without_last_joint(replace(PANDA, limits=limits))
    assert held is not None
    assert held.joint_names == PANDA.joint_names[:6]
    assert held.limits.position.tolist() == limits.position[:6].tolist()
    slide = replace(PANDA, joints=(*PANDA.joints[:-1], replace(PANDA.joints[-1], type="prismatic")))
    assert without_last_joint(slide) is None
    assert without_last_joint(held) is None


def test_methods_say_which_joint_is_held_and_why_there_is_no_closed_form() -> None:
    """A beta of either sign and of any row makes axes almost parallel: no closed form."""
    assert f"with {PANDA.joint_names[-1]} held" in method_for(PANDA).reason
    held = without_last_joint(PANDA)
    assert held is not None
    for beta in (1e-4, -1e-4):
        for robot, said in ((held, "no closed form for this chain (RRRRRR)"), (PANDA, "7 joints are more")):
            joints = tuple(replace(joint, beta=beta * (k == 1)) for k, joint in enumerate(robot.joints))
            method = method_for(replace(robot, joints=joints))
            assert method.family == "numeric"
            assert said in method.reason


def test_a_method_that_holds_no_joint_is_refused_and_poses_that_it_answers_are_not_searched_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A hundred poses are more than one block of samples."""
    q = random_joints(PANDA, 100)
    target = pose_target(forward(PANDA, q))
    held = without_last_joint(PANDA)
    assert held is not None
    with pytest.raises(ValueError, match="holds no joint"):
        points_by_held_joint(PANDA, method_for(held), target, q)
    monkeypatch.setattr("trajcli.kinematics.inverse.searched.by_search", None)
    assert solve(PANDA, target, q).within_limits.any(axis=1).all()
