"""Self-motions: which configurations have them, which answers are points of one, and the nearest point of one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from inverse_arms import arm, random_joints
from scipy.optimize import brentq, lsq_linear

from trajcli.job.robot import load_robot
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.self_motion import (
    freedom_of,
    nearest_on_self_motions,
    one_per_self_motion,
    self_motions,
)
from trajcli.kinematics.inverse.target import partial_target, pose_target
from trajcli.kinematics.jacobian import jacobian
from trajcli.kinematics.robot import Robot

FULL = 2 * np.pi


def test_singular_is_an_arm_with_a_self_motion_and_not_one_that_is_stretched_or_almost_aligned() -> None:
    """A UR with its wrist aligned, and what is beside that: in one batch, where no row may take that of another."""
    rng = np.random.default_rng(1)
    robot = arm("UR", rng)
    q = random_joints(robot, rng, 6)
    q[[1, 4], 4] = 0.0, np.pi
    q[2, 2] = 0.0  # the elbow is stretched: it could go on inwards only, and the tcp with it
    q[3, 4] = 1e-7
    found = self_motions(robot, pose_target(forward(robot, q)), q)
    assert found.singular.tolist() == [False, True, False, False, True, False]
    aligned = [False, True, True, True, False, True]
    assert found.free.tolist() == [[False] * 6, aligned, [False] * 6, [False] * 6, aligned, [False] * 6]


@pytest.mark.parametrize(
    ("name", "kind", "freedom"),
    [
        ("UR", "pose", 0),
        ("UR", "position", 3),
        ("planar 3R", "position", 1),
        ("elbow", "position", 0),
        ("elbow, pitch and roll", "position", 2),
        ("panda", "pose", 1),
    ],
)
def test_an_arm_keeps_the_motions_that_a_target_does_not_fix(name: str, kind: str, freedom: int) -> None:
    """As many as there are joints more than coordinates; those across the plane of an arm are none of its."""
    robot = load_robot(name) if name == "panda" else arm(name, np.random.default_rng(2))
    poses = forward(robot, np.full((1, len(robot.joints)), 0.4))
    target = pose_target(poses) if kind == "pose" else partial_target(poses[:, :3, 3])
    assert freedom_of(robot, target) == freedom


def test_what_a_target_leaves_free_is_not_singular_and_names_its_joints() -> None:
    """Of a SCARA whose height is fixed the slide takes no part; of a tcp on axis 4 that axis alone does."""
    robot = arm("SCARA")
    q = random_joints(robot, np.random.default_rng(3), 4)
    found = self_motions(robot, partial_target(forward(robot, q)[:, :3, 3]), q, 1)
    assert not found.singular.any()
    assert found.free.tolist() == [[False, False, False, True]] * 4
    robot = arm("planar 3R")
    q = random_joints(robot, np.random.default_rng(3), 4)
    found = self_motions(robot, partial_target(forward(robot, q)[:, :3, 3]), q, 1)
    assert not found.singular.any()
    assert found.free.all()


def test_each_singular_configuration_has_free_joints_of_its_own() -> None:
    """The centre of the wrist is on the first axis in one, and the axes 4 and 6 are in line in the other."""
    robot = load_robot("irb120")
    q = np.full((3, 6), 0.4)
    q[2, 4] = 0.0

    def radius(elbow: float) -> float:
        """The centre is 72 mm behind the flange, by the data sheet of the maker."""
        pose = forward(robot, np.array([0.4, 0.4, elbow, 0.4, 0.4, 0.4]))
        x, y, _ = pose[:3, 3] - 0.072 * pose[:3, 2]
        return float(x * np.cos(0.4) + y * np.sin(0.4))

    q[1, 2] = brentq(radius, 0.5, -3.0, xtol=1e-15)
    found = self_motions(robot, pose_target(forward(robot, q)), q)
    assert found.singular.tolist() == [False, True, True]
    over_shoulder, in_line = [True, False, False, True, True, True], [False, False, False, True, False, True]
    assert found.free.tolist() == [[False] * 6, over_shoulder, in_line]


@pytest.mark.parametrize("folded", [(0.0, 0.0), (0.0, np.pi), (np.pi, 0.0), (np.pi, np.pi)])
def test_where_the_self_motion_of_a_folded_arm_crosses_itself_it_is_not_singular(folded) -> None:
    """The Jacobian has rank 1 there, but beside it on each of the two branches rank 2, as everywhere."""
    robot = arm("planar 3R")
    q = np.array([[0.3, folded[0] - 0.3 * np.pi / 2, folded[1]]])
    assert np.linalg.matrix_rank(jacobian(robot, q)[0, :2], tol=1e-9) == 1
    found = self_motions(robot, partial_target(forward(robot, q)[:, :3, 3]), q, 1)
    assert not found.singular.any()


def one(free: list[int], *branches: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Return joints (3, 6) and the same free joints in each."""
    joints = np.array([*branches, *[(9.0,) * 6] * (3 - len(branches))])
    return joints, np.tile(np.isin(np.arange(6), free), (3, 1))


A = (0.1, 0.2, 0.3, 0.4, 0.0, 0.5)
MOVED = (0.1, 0.2, 0.3, 0.4, 0.0, 1.5)
IN_LINE = (0.1, 0.2, 0.3, 0.9, 0.0, 0.0)
TURNED = (0.1, 0.2 + FULL, 0.3, 0.4, 0.0, 1.5)
OTHER = (0.1, 0.8, 0.3, 0.4, 0.0, 1.5)


@pytest.mark.parametrize(
    ("case", "valid", "near", "kept"),
    [
        (one([5], A, MOVED), 2, 0.4, [0]),
        (one([5], A, MOVED), 2, 1.4, [1]),
        (one([5], A, MOVED), 2, None, [0]),
        (one([5], A, MOVED), 2, 1.0, [0]),  # as near as the other: the first
        (one([5], A, TURNED), 2, 1.4, [1]),
        (one([5], A, OTHER), 2, 1.4, [0, 1]),
        (one([3, 5], A, IN_LINE), 2, 0.4, [0]),
        (one([3, 5], A, IN_LINE), 2, -1.0, [1]),
        (one([3, 4, 5], A, MOVED), 2, 0.4, [0, 1]),  # parts that are not connected, perhaps
        (one([], A, A), 2, 0.4, [0, 1]),
        (one([5], A, MOVED, (*MOVED[:5], 2.5)), 3, 0.4, [0]),
        (one([5], A, MOVED, (*MOVED[:5], 2.5)), 3, 1.4, [1]),
        (one([5], A, MOVED, (*MOVED[:5], 2.5)), 3, 2.4, [2]),
        (one([5], OTHER, A, MOVED), 3, 1.4, [0, 2]),
        (one([5], A, (*MOVED[:4], 1e-3, 1.5)), 2, 1.4, [0, 1]),
        (one([5], A, MOVED), 2, 1.0 + 1e-13, [0]),  # as near but for rounding
    ],
)
def test_of_the_points_of_one_self_motion_the_nearest_is_kept(case, valid, near, kept) -> None:
    """Beside a target whose branches have no self-motion at all, in both orders."""
    joints, free = case
    robot = arm("UR")
    flags = np.arange(3) < valid
    plain = np.stack([np.array(A) + k for k in range(3)])
    aim = None if near is None else np.array([(*A[:5], near), A])
    if near == -1.0:
        aim = np.array([IN_LINE, A])
    both = (
        np.stack([joints, plain]),
        np.stack([flags, [True] * 3]),
        np.stack([free, np.zeros((3, 6), dtype=bool)]),
    )
    for order in ([0, 1], [1, 0]):
        given = [array[order] for array in both]
        before = given[1].copy()
        found = one_per_self_motion(robot, *given, None if aim is None else aim[order])
        assert np.flatnonzero(found[order.index(0)]).tolist() == kept
        assert found[order.index(1)].all()
        assert (given[1] == before).all()


def test_answers_with_other_free_joints_are_of_other_self_motions() -> None:
    joints, free = one([5], A, MOVED)
    free[1] = np.isin(np.arange(6), [3, 5])
    assert (
        one_per_self_motion(arm("UR"), joints[None], np.array([[True, True, False]]), free[None], None).sum()
        == 2
    )


def test_an_answer_of_some_targets_only_is_compared_with_others_there() -> None:
    joints, free = one([5], A, MOVED)
    valid = np.array([[True, True, False], [False, True, False]])
    kept = one_per_self_motion(arm("UR"), np.stack([joints] * 2), valid, np.stack([free] * 2), None)
    assert kept.tolist() == [[True, False, False], [False, True, False]]


@pytest.mark.parametrize(("slide", "kept"), [(0.2, [0]), (0.2 + FULL, [0, 1])])
def test_a_slide_knows_no_full_turns(slide, kept) -> None:
    """6.28 m further is another place, and further away from where the arm is."""
    joints = np.array([[(0.1, 0.2, 0.2, 0.3), (0.1, 0.2, slide, 0.9)]])
    free, valid = np.tile(np.arange(4) == 3, (1, 2, 1)), np.ones((1, 2), dtype=bool)
    found = one_per_self_motion(arm("SCARA"), joints, valid, free, np.array([[0.1, 0.2, 0.2, 0.4]]))
    assert np.flatnonzero(found[0]).tolist() == kept
    free[:] = np.arange(4) == 2
    joints[:, :, 3] = 0.3
    found = one_per_self_motion(arm("SCARA"), joints, valid, free, np.array([[0.1, 0.2, slide + 0.1, 0.3]]))
    assert np.flatnonzero(found[0]).tolist() == ([0] if slide == 0.2 else [1])


def missed(robot: Robot, ends: np.ndarray, near: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return how far ends are from being nearest, by Karush, Kuhn and Tucker, and which are pressed against limits.

    What is left of the way is a sum of rows of the Jacobian and of what presses joints against their limits.
    """
    low, high = robot.limits.position.T
    pressed = 1.0 * (ends >= high - 1e-9) - 1.0 * (ends <= low + 1e-9)
    least = np.concatenate([np.full(3, -np.inf), np.zeros(len(low))])
    every = zip(near - ends, jacobian(robot, ends)[:, :3], pressed, strict=True)
    costs = [
        lsq_linear(np.hstack([slopes.T, np.diag(p)]), gap, (least, np.inf)).cost for gap, slopes, p in every
    ]
    return np.array(costs), pressed.any(axis=1)


@pytest.mark.parametrize("narrow", [False, True])
@pytest.mark.parametrize("name", ["planar 3R", "elbow, pitch and roll"])
def test_what_is_left_of_the_way_to_the_nearest_point_is_across_the_self_motion_or_over_a_limit(
    name, narrow
) -> None:
    """Karush, Kuhn and Tucker: it is a sum of rows of the Jacobian and of what presses joints against their limits."""
    rng = np.random.default_rng(4)
    robot = arm(name)
    q = rng.uniform(0.4, 1.0, (12, len(robot.joints)))
    near = q + rng.uniform(-0.7, 0.7, q.shape)
    low, high = (0.35, 1.05) if narrow else (-3.0, 3.0)
    bounds = np.tile([low, high], (len(robot.joints), 1))
    robot = replace(robot, limits=replace(robot.limits, position=bounds))
    positions = forward(robot, q)[:, :3, 3]
    ends = nearest_on_self_motions(robot, partial_target(positions), q, near)
    np.testing.assert_allclose(forward(robot, ends)[:, :3, 3], positions, rtol=0, atol=1e-9)
    turned = nearest_on_self_motions(robot, partial_target(positions), q + FULL, near)
    np.testing.assert_allclose(turned, ends, rtol=0, atol=1e-6)
    if not narrow:
        robot = replace(robot, limits=replace(robot.limits, position=20.0 * np.sign(bounds)))
        turned = nearest_on_self_motions(robot, partial_target(positions), q, near + FULL)
        np.testing.assert_allclose(turned, ends + FULL, rtol=0, atol=1e-6)
    assert (ends >= low).all()
    assert (ends <= high).all()
    costs, pressed = missed(robot, ends, near)
    assert (costs <= 1e-12).all()
    held = np.count_nonzero(pressed)
    assert held >= 4 if narrow else held == 0


def test_between_limits_no_step_ends_beyond_one_of_either_side() -> None:
    """Far from where they aim, joints run against a limit in nearly every step."""
    robot, rng = arm("elbow, pitch and roll"), np.random.default_rng(1)
    q = 0.7 + rng.uniform(-0.1, 0.1, (40, len(robot.joints)))
    near = q + rng.uniform(-2.0, 2.0, q.shape)
    bounds = np.tile([0.6, 0.8], (len(robot.joints), 1))
    robot = replace(robot, limits=replace(robot.limits, position=bounds))
    ends = nearest_on_self_motions(robot, partial_target(forward(robot, q)[:, :3, 3]), q, near)
    costs, _ = missed(robot, ends, near)
    assert (costs <= 1e-12).all()


@pytest.mark.parametrize(
    ("start", "near", "end"), [(3.0, 5.0, 3.0), (3.0, 0.5, 0.5), (-2.0, -3.0, -2.0), (-2.0, 0.5, 0.5)]
)
def test_a_joint_that_is_outside_its_limits_goes_no_further_and_may_come_back(start, near, end) -> None:
    robot = arm("SCARA", limits=[[-4, 4], [-4, 4], [0, 1], [-1.0, 2.0]])
    q = np.array([[0.3, 0.7, 0.1, start]])
    target = partial_target(forward(robot, q)[:, :3, 3])
    found = nearest_on_self_motions(robot, target, q, np.array([[0.3, 0.7, 0.1, near]]))
    np.testing.assert_allclose(found, [[0.3, 0.7, 0.1, end]], rtol=0, atol=1e-12)


def test_each_row_stays_where_it_is_allowed_and_others_go_on() -> None:
    robot = arm("planar 3R")
    rng = np.random.default_rng(5)
    q = rng.uniform(0.4, 1.0, (6, 3))
    near = q + 0.3
    target = partial_target(forward(robot, q)[:, :3, 3])
    free = nearest_on_self_motions(robot, target, q, near)
    half = 0.5 * (q + free)[:, 0]
    side = np.sign(free - q)[:, 0]
    cap = np.where(np.arange(6) % 2, half * side, np.inf)

    def allowed(rows, joints):
        return joints[:, 0] * side[rows] <= cap[rows]

    found = nearest_on_self_motions(robot, target, q, near, allowed)
    np.testing.assert_allclose(found[::2], free[::2], rtol=0, atol=1e-9)
    assert (found[1::2, 0] * side[1::2] <= cap[1::2] + 1e-12).all()
    came = (np.square(found - near).sum(axis=1) - np.square(q - near).sum(axis=1))[1::2]
    assert (came <= 1e-12).all()
    assert (came < -1e-4).any()
    np.testing.assert_allclose(forward(robot, found)[:, :3, 3], target.poses[:, :3, 3], rtol=0, atol=1e-10)


@pytest.mark.parametrize("off", [[9.0, 0.0, 0.0], [0.0, 0.0, 1e-7]])
def test_what_does_not_meet_its_target_stays_where_it_is(off) -> None:
    """The second target is 0.1 micrometre beside the plane of the arm."""
    robot = arm("planar 3R")
    q = np.array([[0.4, 0.5, 0.6], [0.4, 0.5, 0.6]])
    target = partial_target(forward(robot, q)[:, :3, 3] + [off, [0.0, 0.0, 0.0]])
    found = nearest_on_self_motions(robot, target, q, q + 0.2)
    assert found[0].tolist() == q[0].tolist()
    assert np.abs(found[1] - q[1]).max() > 1e-2
