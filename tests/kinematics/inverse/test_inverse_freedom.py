"""Targets that leave joints free: one answer for each posture, the nearest of its self-motion, inside the limits."""

from __future__ import annotations

import zlib
from dataclasses import replace

import numpy as np
import pytest
from inverse_arms import arm, gap, random_joints
from oracle_robots import robot_of, robots
from scipy.optimize import fsolve

from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.self_motion import nearest_on_self_motions
from trajcli.kinematics.inverse.solve import solve
from trajcli.kinematics.inverse.target import partial_target, residuals

# arm, what is given beside the position, of which tool axis; then how many motions are free, and which names
CASES = [
    ("planar 3R", None, "x", 1, 2),
    ("planar RPR", None, "x", 1, 2),
    ("SCARA", None, "x", 1, 2),
    ("elbow and pitch", None, "x", 1, 4),
    ("elbow, pitch and roll", None, "x", 2, 4),
    ("elbow, pitch and roll", "pitch", "x", 1, 8),
    ("UR", "direction", "z", 1, 8),
    ("wrist over elbow", "direction", "x", 1, 8),
    ("wrist over elbow", "yaw", "y", 2, 8),
    ("wrist over SCARA", "pitch", "z", 2, 4),
    ("wrist over Stanford", None, "z", 3, 8),
]
IDS = [f"{name}-{kind}-{axis}" for name, kind, axis, *_ in CASES]


def target_of(poses, kind, axis):
    tool = poses[..., :3, "xyz".index(axis)]
    parts = {
        None: {},
        "direction": {"direction": tool},
        "yaw": {"yaw": np.arctan2(tool[..., 1], tool[..., 0])},
        "pitch": {"pitch": np.arctan2(tool[..., 2], np.hypot(tool[..., 0], tool[..., 1]))},
    }
    return partial_target(poses[..., :3, 3], tool_axis=axis, **parts[kind])


def case(name, kind, axis, count):
    rng = np.random.default_rng(zlib.crc32(f"{name}{kind}{axis}".encode()))
    robot = arm(name, rng if len(arm(name).joints) == 6 else None)
    joints = random_joints(robot, rng, count)
    return robot, joints, target_of(forward(robot, joints), kind, axis), rng


def idle_motions(robot, target, joints, free):
    """Return unit rows (free, n) of joint motions that leave the target met, by finite differences."""
    step, n = 1e-6, len(joints)
    ahead, behind = (residuals(target, forward(robot, joints + sign * step * np.eye(n))) for sign in (1, -1))
    slopes = (ahead - behind).T / (2 * step)
    values, right = np.linalg.svd(slopes)[1:]
    assert np.count_nonzero(values > 1e-5 * values[0]) == n - free
    return right[n - free :]


@pytest.mark.parametrize(("name", "kind", "axis", "free", "names"), CASES, ids=IDS)
def test_each_posture_is_answered_once_and_as_near_as_can_be(name, kind, axis, free, names):
    robot, joints, target, rng = case(name, kind, axis, 12)
    near = joints + rng.uniform(-0.05, 0.05, joints.shape)
    found = solve(robot, target, near)
    assert len(found.names) == len(set(map(str, found.names))) == names
    assert not found.singular.any()
    assert found.free[found.valid].any(axis=1).all()
    rows, branches = np.nonzero(found.valid)
    answers = found.joints[rows, branches]
    assert np.abs(residuals(target.rows(rows), forward(robot, answers))).max() < 1e-9
    best = np.take_along_axis(found.joints, found.nearest(near)[:, None, None], axis=1)[:, 0]
    known = np.linalg.norm(joints - near, axis=1)  # the generating joints are a point of it too
    assert (np.linalg.norm(best - near, axis=1) <= known + 1e-9).all()
    for row in range(12):
        repeated = target.rows(np.full(len(joints[0]), row))
        idle = idle_motions(robot, repeated, best[row], free)
        assert np.abs(idle @ (near[row] - best[row])).max() < 1e-6
        taking_part = np.abs(idle).max(axis=0) > 1e-4
        assert found.free[row, found.nearest(near)[row]].tolist() == taking_part.tolist()


@pytest.mark.parametrize(
    ("name", "kind", "axis"), [row[:3] for row in CASES if row[0] in ("UR", "wrist over elbow")]
)
def test_answers_have_the_names_of_their_whole_poses(name, kind, axis):
    robot, joints, target, _ = case(name, kind, axis, 3)
    found = solve(robot, target, joints)
    rows, branches = np.nonzero(found.valid)
    answers = found.joints[rows, branches]
    whole = solve(robot, forward(robot, answers))
    gaps = np.where(whole.valid, gap(robot, whole.joints, answers[:, None]), np.inf)
    assert gaps.min(axis=1).max() < 1e-5
    assert [whole.names[i] for i in gaps.argmin(axis=1)] == [found.names[i] for i in branches]


@pytest.mark.parametrize(
    ("name", "axis"), [("UR", "x"), ("wrist over elbow", "y"), ("wrist over SCARA", "x")]
)
def test_no_other_roll_of_the_tool_is_nearer(name, axis):
    robot, joints, target, rng = case(name, "direction", axis, 4)
    near = random_joints(robot, rng, 4)
    found = solve(robot, target, near)
    poses = forward(robot, joints)
    turns, further = np.linspace(0, 2 * np.pi, 721)[:-1, None, None], 0
    for row in range(4):
        line = target.aims[row]
        k = np.cross(np.eye(3), line).T
        rolled = np.tile(poses[row], (720, 1, 1))
        rolled[:, :3, :3] = (np.eye(3) + np.sin(turns) * k + (1 - np.cos(turns)) * k @ k) @ poses[row, :3, :3]
        every = solve(robot, rolled, near[row])
        there = np.where(every.valid, np.linalg.norm(every.joints - near[row], axis=-1), np.inf).min(axis=0)
        ours = np.where(found.valid[row], np.linalg.norm(found.joints[row] - near[row], axis=-1), np.inf)
        assert (np.isfinite(there) <= np.isfinite(ours)).all()
        assert ours.min() <= there.min() + 1e-9
        further += np.count_nonzero(ours > there + 0.05)
    assert further <= 3  # of 32: a posture may have two parts, and a narrow one be missed


def test_singular_is_told_from_free():
    robot = robot_of(next(robot for robot in robots() if robot["id"] == "C-puma560"))
    for bend, lost in ((0.0, True), (0.4, False)):
        joints = np.array([0.3, 0.2, -1.4, 0.5, bend, 0.6])
        pose = forward(robot, joints)
        found = solve(robot, partial_target(pose[:3, 3], direction=pose[:3, 2]), joints)
        best = int(found.nearest(joints))
        assert found.joints[best] == pytest.approx(joints, abs=1e-6)
        assert bool(found.singular[best]) is lost
        assert found.free[best].tolist() == [False, False, False, lost, False, True]


@pytest.mark.parametrize(
    ("name", "about"),
    [
        ("two axes that meet", [-2.8, -5.0]),
        ("RRP with a slanted slide", [-2.8, -0.5]),
        ("elbow", [-1.5, -3.1]),
        ("elbow on a slanted axis", [-1.3, -2.8]),
    ],
)
def test_a_tcp_on_the_first_axis_leaves_its_joint_free_and_it_stays_where_it_was(name, about):
    robot = arm(name)
    rest = fsolve(lambda rest: forward(robot, [0.0, *rest])[:2, 3], about, xtol=1e-13)
    position = forward(robot, [0.4, *rest])[:3, 3]
    assert np.abs(forward(robot, [2.0, *rest])[:3, 3] - position).max() < 1e-12  # wherever joint 1 is
    found = solve(robot, partial_target(position), near=[1.4, *rest])
    assert found.singular[found.valid].all()
    assert found.free[found.valid].tolist() == [[True, False, False]] * int(found.count)
    assert gap(robot, found.joints[found.valid], np.array([1.4, *rest])).min() < 1e-7
    assert found.joints[found.valid][:, 0] == pytest.approx(1.4, abs=1e-7)


def test_the_limits_hold_while_the_nearest_is_sought():
    robot = arm("UR", limits=[[-7, 7]] * 5 + [[1.0, 2.0]])
    joints = np.array([0.3, -0.9, 1.2, 0.4, 0.8, 1.4])
    pose = forward(robot, joints)
    for wanted, reached in ((0.2, 1.0), (1.7, 1.7), (3.0, 2.0)):
        near = np.array([*joints[:5], wanted])
        found = solve(robot, partial_target(pose[:3, 3], direction=pose[:3, 2]), near)
        best = int(found.nearest(near))
        assert found.joints[best] == pytest.approx([*joints[:5], reached], abs=1e-9)


def test_a_member_stops_at_the_limit_and_not_before():
    robot = arm("SCARA", limits=[[-4, 4], [-4, 4], [0, 1], [-1.0, 2.0]])
    start = np.array([[0.3, 0.7, 0.1, 1.4]])
    target = partial_target(forward(robot, start)[:, :3, 3])
    for wanted, reached in ((3.0, 2.0), (-1.5, -1.0), (0.6, 0.6)):
        near = np.array([[0.3, 0.7, 0.1, wanted]])
        assert nearest_on_self_motions(robot, target, start, near)[0, 3] == pytest.approx(reached, abs=1e-12)


def test_a_joint_at_its_limit_is_held_while_others_go_on():
    robot = arm("elbow, pitch and roll", limits=[[-7, 7], [-7, 7], [-7, 7], [-7, 7], [0.5, 2.0]])
    joints = np.array([0.4, 0.7, -1.2, 0.5, 0.9])
    position = forward(robot, joints)[:3, 3]
    near = np.array([0.4, 0.6, -1.3, 0.7, -0.3])
    found = solve(robot, partial_target(position), near)
    best = int(found.nearest(near))
    own = found.joints[best]
    assert own[4] == pytest.approx(0.5, abs=1e-9)
    idle = idle_motions(robot, partial_target(np.tile(position, (5, 1))), own, 2)
    along = idle.T @ np.linalg.svd(idle[:, 4:].T)[2][1]  # the motion that leaves joint 5 where it is
    assert abs(along[4]) < 1e-9
    assert abs(along @ (near - own)) < 1e-6


def test_a_redundant_arm_lists_what_is_nearest_around_it():
    limits = np.array(
        [[-2.9, 2.9], [-1.76, 1.76], [-2.9, 2.9], [-3.07, -0.07], [-2.9, 2.9], [-0.01, 3.75], [-2.9, 2.9]]
    )
    robot = robot_of(next(robot for robot in robots() if robot["id"] == "C-panda"))
    robot = replace(robot, limits=replace(robot.limits, position=limits))
    pose = forward(robot, [0.3, 0.4, -0.2, -1.7, 0.3, 2.1, 0.5])
    near = np.array([0.2, 0.3, -0.2, -1.8, 0.2, 2.0, 0.6])
    found = solve(robot, pose, near)
    assert 1 <= found.count <= 16
    assert not found.singular.any()
    own = found.joints[found.valid]
    assert np.linalg.norm(own[0] - near) <= np.linalg.norm(own - near, axis=1).min() + 1e-9
    assert (np.abs(own[:, None] - own[None]).max(axis=-1) > 1e-3).sum() == len(own) * (len(own) - 1)
    for joints in own:
        slopes = np.stack(
            [(forward(robot, joints + h) - forward(robot, joints - h))[:3].ravel() for h in 1e-6 * np.eye(7)]
        )
        idle = np.linalg.svd(slopes.T)[2][6]
        step = idle * np.sign(idle @ (near - joints)) * 1e-6
        stopped = ((joints + step > limits[:, 1]) | (joints + step < limits[:, 0])).any()
        assert stopped or abs(idle @ (near - joints)) < 1e-5


def test_a_direction_alone_is_enough():
    robot = arm("UR")
    near = np.array([0.3, -0.9, 1.2, 0.4, 0.8, 1.4])
    found = solve(robot, partial_target(direction=[0.0, 0.0, -1.0]), near)
    best = found.joints[int(found.nearest(near))]
    assert forward(robot, best)[:3, 2] == pytest.approx([0, 0, -1], abs=1e-9)
    alone = partial_target(direction=np.tile([0.0, 0.0, -1.0], (6, 1)))
    assert np.abs(idle_motions(robot, alone, best, 4) @ (near - best)).max() < 1e-6


def test_what_only_a_narrow_range_of_the_tool_reaches_is_found():
    robot = arm("planar 3R")  # links .4, .3, .2, and .1 down: hardly bent
    found = solve(robot, partial_target([0.8999, 0.0, -0.1]))
    assert int(found.count) == 2
    assert found.closure[found.valid].max() < 1e-9
    beyond = solve(robot, partial_target([0.95, 0.0, -0.1]))
    assert int(beyond.count) == 0
    assert beyond.shortfall[0] == pytest.approx(0.05, rel=0.02)


def test_a_fold_inside_a_family_is_not_singular():
    robot = arm("planar 3R")
    theta = [joint.theta for joint in robot.joints]
    near = np.array([0.4, np.pi, 0.0]) - theta  # all links in line, folded: the tcp could not move outwards
    position = forward(robot, near)[:3, 3]
    assert np.hypot(*position[:2]) == pytest.approx(0.1, abs=1e-12)
    found = solve(robot, partial_target(position), near)
    best = int(found.nearest(near))
    assert found.joints[best] == pytest.approx(near, abs=1e-6)
    assert found.free[best].all()
    assert not found.singular[best]


@pytest.mark.parametrize(
    ("name", "kind", "axis", "free"), [row[:4] for row in CASES if row[0] != "wrist over SCARA"]
)
def test_members_come_nearer_by_whole_turns_and_along_the_family_and_stay_inside(name, kind, axis, free):
    robot, joints, target, rng = case(name, kind, axis, 40)
    turning = np.array([joint.type == "revolute" for joint in robot.joints])
    span = np.where(turning, 3.0, 0.2)
    low, high = joints.min(axis=0) - 0.01 * span, joints.max(axis=0) + 0.01 * span
    robot = replace(robot, limits=replace(robot.limits, position=np.stack([low, high], axis=1)))
    near = joints + rng.uniform(-1, 1, joints.shape) * span
    nearest = nearest_on_self_motions(robot, target, joints, near)
    assert np.abs(residuals(target, forward(robot, nearest))).max() < 1e-9
    assert (nearest >= low).all()
    assert (nearest <= high).all()
    far, came = np.linalg.norm(joints - near, axis=1), np.linalg.norm(nearest - near, axis=1)
    assert (came <= far + 1e-9).all()
    assert (came < far - 1e-3).mean() > 0.8
    if free == 1:
        for row, point in enumerate(nearest):
            (idle,) = idle_motions(robot, target.rows(np.full(len(low), row)), point, 1)
            left = idle @ (near[row] - point)
            blocked = np.where(idle * left > 0, high - point < 1e-8, point - low < 1e-8) & (
                np.abs(idle) > 1e-6
            )
            assert abs(left) < 1e-5 or blocked.any()
    robot = replace(robot, limits=replace(robot.limits, position=np.tile([-np.inf, np.inf], (len(low), 1))))
    turns = 2 * np.pi * rng.integers(-2, 3, joints.shape) * turning
    assert nearest_on_self_motions(robot, target, joints + turns, joints) == pytest.approx(joints, abs=1e-9)
