"""The parts of the numeric search, each by a law of its own: residuals, steps, seeds, repetitions, lost solutions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from inverse_arms import arm, random_joints

from trajcli.kinematics.dexterity import characteristic_length
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse import numeric
from trajcli.kinematics.inverse.numeric import (
    damped_step,
    descend,
    distinct,
    linearised,
    recover_lost_solutions,
    refined,
    search,
    starting_points,
)
from trajcli.kinematics.inverse.target import partial_target, pose_target, residuals

FULL = 2 * np.pi


def case(name: str, count: int, seed: int = 5):
    rng = np.random.default_rng(seed)
    robot = arm(name, rng)
    return robot, random_joints(robot, rng, count), rng


def ridge(slopes: np.ndarray, errors: np.ndarray, damping: float) -> np.ndarray:
    """Return the x that makes |J x - e|^2 + damping |x|^2 least, as a least-squares problem with more rows."""
    rows = np.vstack([slopes, np.sqrt(damping) * np.eye(slopes.shape[1])])
    return np.linalg.lstsq(rows, np.concatenate([errors, np.zeros(slopes.shape[1])]), rcond=None)[0]


@pytest.mark.parametrize("count", [2, 40])
@pytest.mark.parametrize("part", ["pose", "heading"])
def test_errors_are_residuals_by_the_length_of_the_arm_and_slopes_their_rates(part: str, count: int) -> None:
    """Few rows are computed another way than many; of two coordinates and a heading only two rows are lengths."""
    robot, q, rng = case("wrist over Stanford", count)
    poses = forward(robot, q + 0.1 * rng.normal(size=q.shape))
    heading = np.arctan2(poses[:, 1, 0], poses[:, 0, 0])
    target = (
        pose_target(poses)
        if part == "pose"
        else partial_target(poses[:, :3, 3], fixed=(True, False, True), yaw=heading, tool_axis="x")
    )
    lengths = sum(target.position)
    errors, slopes = linearised(robot, target, q)
    scale = np.where(np.arange(errors.shape[1]) < lengths, 1.0 / characteristic_length(robot), 1.0)
    assert abs(characteristic_length(robot) - 1.0) > 0.04
    np.testing.assert_allclose(errors, residuals(target, forward(robot, q)) * scale, rtol=0, atol=1e-13)
    met = target if part == "heading" else pose_target(forward(robot, q))  # where a log has the slope 1
    for joint, step in enumerate(1e-6 * np.eye(6)):
        ahead, behind = (linearised(robot, met, q + sign * step)[0] for sign in (1, -1))
        np.testing.assert_allclose(slopes[:, :, joint], (behind - ahead) / 2e-6, rtol=0, atol=1e-8)


@pytest.mark.parametrize("damping", [1e-13, 0.3])
@pytest.mark.parametrize(("rows", "joints"), [(3, 7), (6, 6), (6, 4)])
def test_a_damped_step_is_the_least_squares_one(rows: int, joints: int, damping: float) -> None:
    rng = np.random.default_rng(rows + joints)
    slopes, errors = rng.normal(size=(4, rows, joints)), rng.normal(size=(4, rows))
    steps = damped_step(errors, slopes, np.full(4, damping))
    for step, jacobian, error in zip(steps, slopes, errors, strict=True):
        wanted = ridge(jacobian, error, damping)
        np.testing.assert_allclose(step, wanted, rtol=1e-6 if rows == joints else 1e-9, atol=1e-9)


def test_refined_rows_never_lose_and_come_with_their_own_errors() -> None:
    """One row is there already, others are near, some are far: none takes the target of another."""
    robot, q, rng = case("UR", 24)
    target = pose_target(forward(robot, q))
    start = q + np.array([0.0, 1e-3, 1e-6, *[0.03] * 3, *[2.5] * 18])[:, None] * rng.normal(size=q.shape)
    before = start.copy()
    better, errors, slopes = refined(robot, target, start, 6)
    assert (start == before).all()
    here = linearised(robot, target, better)
    np.testing.assert_allclose(errors, here[0], rtol=0, atol=1e-13)
    np.testing.assert_allclose(slopes, here[1], rtol=0, atol=1e-12)
    size, was = (np.linalg.norm(linearised(robot, target, rows)[0], axis=1) for rows in (better, start))
    assert (size <= was).all()
    assert size[:6].max() < 1e-11
    first = np.abs(refined(robot, target, start, 1)[0] - start).max(axis=1)
    assert first.max() == pytest.approx(1.0)  # rad: no joint goes further at once


@pytest.mark.parametrize("held", [False, True])
def test_a_step_of_a_descent_is_damped_by_half_the_square_of_the_error_and_so_is_no_longer_than_root_half(
    held: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """s / (s^2 + m) is at most 1 / (2 sqrt(m)) for any singular value s: with m = |e|^2 / 2 that times |e| is 0.71."""
    monkeypatch.setattr(numeric, "ITERATIONS", 1)
    robot, q, rng = case("UR", 8)
    target = pose_target(forward(robot, q))
    seeds = q + np.linspace(0.01, 2.0, 8)[:, None] * rng.normal(size=q.shape)
    seeds[0] = q[0]
    bounds = np.stack([seeds.min(axis=0), seeds.max(axis=0)], axis=1) if held else None
    before = seeds.copy()
    ends, met = descend(robot, target, seeds, bounds)
    assert (seeds == before).all()
    assert met.tolist() == [True] + 7 * [False]
    errors, slopes = linearised(robot, target, seeds)
    for end, seed, error, slope in zip(ends[1:], seeds[1:], errors[1:], slopes[1:], strict=True):
        step = ridge(slope, error, 0.5 * error @ error)
        assert np.linalg.norm(step) <= np.sqrt(0.5)
        wanted = seed + step if bounds is None else np.clip(seed + step, *bounds.T)
        np.testing.assert_allclose(end, wanted, rtol=0, atol=1e-8)


def test_seeds_are_spread_evenly_over_the_limits_of_each_joint() -> None:
    robot = arm("SCARA, slide first", limits=[[0.0, 9.0], [-7.0, 5.0], [-np.inf, np.inf], [0.5, 1.5]])
    free_slide = replace(robot, limits=replace(robot.limits, position=np.tile([-np.inf, np.inf], (4, 1))))
    length = characteristic_length(robot)
    shares = (np.arange(10) + 0.5) / 10
    turn = (-np.pi, np.pi)
    for each, wanted in (
        (robot, [(0.0, 9.0), turn, turn, (0.5, 1.5)]),
        (free_slide, [(-length, length), turn, turn, turn]),
    ):
        seeds = starting_points(each, 10, 1)
        for values, (low, high) in zip(seeds.T, wanted, strict=True):
            np.testing.assert_allclose(np.sort(values), low + (high - low) * shares, rtol=0, atol=1e-12)
    assert not np.array_equal(starting_points(robot, 10, 0), starting_points(robot, 10, 1))


def test_a_search_in_blocks_finds_for_each_target_what_it_finds_alone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """With the given configuration as the first seed, and new seeds for what none of the first reaches."""
    monkeypatch.setattr(numeric, "SEEDS_OF_ALL", 4)
    robot, q, rng = case("UR", 3)
    target, near = pose_target(forward(robot, q)), q + 0.05 * rng.normal(size=q.shape)
    alone = [search(robot, target.rows([row]), near[[row]]) for row in range(3)]
    monkeypatch.setattr(numeric, "_BLOCK", 2)
    found = search(robot, target, near)
    for row, one in enumerate(alone):
        np.testing.assert_array_equal(found.met[row], one.met[0])
        np.testing.assert_allclose(found.joints[row], one.joints[0], rtol=0, atol=1e-9)
    assert found.met[:, 0].all()
    np.testing.assert_allclose(found.joints[:, 0], q, rtol=0, atol=1e-9)


@pytest.mark.parametrize(("name", "seeds", "held"), [("UR", 192, False), ("planar 3R", 64, True)])
def test_what_no_seed_meets_is_tried_twice_more_and_last_without_limits(
    name, seeds, held, monkeypatch
) -> None:
    """Limits hold the joints only where there are more than the target needs; a target that is met is let be."""
    robot = arm(name, limits=[[-1.0, 1.0]] * len(arm(name).joints))
    tried = []

    def none_met(robot, target, q, bounds, tolerance):
        tried.append((len(target.poses), q.copy(), bounds))
        return q, np.arange(len(q)) < (seeds if len(tried) == 1 else 0)

    monkeypatch.setattr(numeric, "descend", none_met)
    aims = np.full((3, 3), 9.0)
    target = (
        partial_target(aims, fixed=(True, True, False))
        if held
        else pose_target(np.tile(np.eye(4), (3, 1, 1)))
    )
    found = search(robot, target, np.arange(3.0)[:, None] + np.zeros(len(robot.joints)))
    assert found.met.any(axis=1).tolist() == [True, False, False]
    assert [count for count, _, _ in tried] == [3 * seeds, 2 * seeds, 2 * seeds]
    assert [bounds is not None for _, _, bounds in tried] == [held, held, False]
    for (_, q, _), targets in zip(tried, ([0, 1, 2], [1, 2], [1, 2]), strict=True):
        assert q[::seeds, 0].tolist() == targets
    assert not np.array_equal(tried[0][1][1], tried[1][1][1])


def test_of_rows_that_repeat_each_other_the_first_usable_is_kept() -> None:
    """Full turns apart are the same for a joint that turns; a row that was dropped keeps no other from counting."""
    robot, within = arm("wrist over Stanford"), 1e-3
    turns = np.array([joint.type == "revolute" for joint in robot.joints])
    rng = np.random.default_rng(0)
    joints = rng.uniform(-1.0, 1.0, (40, 1, 6)) + rng.choice([-0.6, 0.0, 0.7], (40, 7, 1)) * within
    joints += rng.choice([0.0, 0.0, 0.0, 1.0], (40, 7, 6)) * np.where(turns, FULL, 0.0)
    joints += (
        (rng.random((40, 7, 1)) < 0.3) * np.where(turns, 0.0, FULL) * (rng.random(40) < 0.5)[:, None, None]
    )
    joints[3:9, 3:] += 0.1
    usable = rng.random((40, 7)) < 0.8
    before = usable.copy()
    kept = distinct(robot, joints, usable, within)
    assert (usable == before).all()
    for row in range(40):
        chosen: list[int] = []
        for branch in np.flatnonzero(usable[row]):
            gaps = np.abs(joints[row, chosen] - joints[row, branch])
            gaps = np.where(turns, np.minimum(gaps % FULL, FULL - gaps % FULL), gaps)
            if not (gaps.max(axis=1) <= within).any():
                chosen.append(int(branch))
        assert np.flatnonzero(kept[row]).tolist() == chosen
        assert np.flatnonzero(distinct(robot, joints[[row]], usable[[row]], within)).tolist() == chosen
    assert 0 < kept.sum() < usable.sum()


@pytest.mark.parametrize("valid", [0b110, 0b011, 0b111, 0b000])
def test_what_is_found_takes_the_place_of_what_is_not_valid_or_else_of_what_is_singular(valid: int) -> None:
    """Three branches; the last alone is singular. What is known, full turns apart, is not put in again."""
    robot, q, _ = case("UR", 1)
    target = pose_target(forward(robot, q))
    flags = np.array([[bool(valid & 4), bool(valid & 2), bool(valid & 1)]])
    others = q + np.array([2.0, 0.5, 1.0])[:, None]
    joints, kept = others[None].copy(), flags.copy()
    singular = np.array([[False, False, True]]) & flags
    assert recover_lost_solutions(robot, target, joints, kept, singular, q)
    place = {0b110: 2, 0b011: 0, 0b111: 2, 0b000: 1}[valid]
    np.testing.assert_allclose(joints[0, place], q[0], rtol=0, atol=1e-9)
    assert kept[0].tolist() == [bool(flags[0, k]) or k == place for k in range(3)]
    assert (joints[0, np.arange(3) != place] == others[np.arange(3) != place]).all()
    again = joints.copy()
    again[0, place, 2] += FULL + 3e-7
    kept[:] = True
    there = again.copy()
    assert not recover_lost_solutions(robot, target, again, kept, singular, q)
    assert (again == there).all()
    further = joints.copy()
    further[0, place, 2] += 3e-5
    singular[:] = np.arange(3) == place
    assert recover_lost_solutions(robot, target, further, kept, singular, q)
    np.testing.assert_allclose(further[0, place], q[0], rtol=0, atol=1e-9)
    regular = others[None].copy()
    full = np.ones((1, 3), dtype=bool)
    assert not recover_lost_solutions(robot, target, regular, full, ~full, q)
    assert (regular == others).all()


def test_all_seeds_look_for_what_no_branch_is(monkeypatch: pytest.MonkeyPatch) -> None:
    """A pose all of whose branches are lost is met in several of them, and others are let be."""
    monkeypatch.setattr(numeric, "SEEDS_OF_ALL", 24)
    robot, q, _ = case("UR", 2)
    target = pose_target(forward(robot, q))
    joints = np.tile(q[:, None] + 0.4, (1, 8, 1))
    valid = np.zeros((2, 8), dtype=bool)
    joints[0, 0], valid[0, 0] = q[0], True
    assert recover_lost_solutions(robot, target, joints, valid, np.zeros((2, 8), dtype=bool), None)
    assert valid[0].tolist() == [True] + 7 * [False]
    assert valid[1].sum() > 2
    found = forward(robot, joints[1, valid[1]])
    np.testing.assert_allclose(found, np.broadcast_to(target.poses[1], found.shape), rtol=0, atol=1e-11)


def test_what_only_lacks_its_flag_is_marked_and_targets_out_of_reach_change_nothing(monkeypatch) -> None:
    monkeypatch.setattr(numeric, "SEEDS_OF_ALL", 2)
    robot, q, _ = case("UR", 2)
    poses = forward(robot, q)
    poses[0, :3, 3] += 9.0
    joints, valid = np.stack([q + 0.3, q], axis=1), np.zeros((2, 2), dtype=bool)
    before = joints.copy()
    assert recover_lost_solutions(robot, pose_target(poses), joints, valid, valid.copy(), q)
    assert valid.tolist() == [[False, False], [False, True]]
    np.testing.assert_allclose(joints, before, rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    ("name", "turned"), [("elbow and pitch", False), ("elbow and pitch", True), ("UR", False)]
)
def test_an_arm_of_fewer_joints_than_coordinates_may_miss_by_the_tolerance(name, turned) -> None:
    """In position as in orientation; with as many joints only what is met to the last digit counts."""
    robot, q, _ = case(name, 2)
    fewer = name != "UR"
    if not fewer:
        q[:, 2] = 0.0  # stretched: what is beyond is out of reach
    poses = forward(robot, q)
    if turned:
        axis = robot.base[:3, :3] @ [0.0, 0.0, 1.0]
        poses[:, :3, :3] = poses[:, :3, :3] + 1e-4 * np.cross(np.eye(3), -axis) @ poses[:, :3, :3]
    else:
        poses[:, :3, 3] += 1e-4 * np.sign(poses[:, :3, 3] - robot.base[:3, 3])
    for tolerance, met in ((1e-2, True), (1e-6, False)):
        assert (descend(robot, pose_target(poses), q, None, tolerance)[1] == (fewer and met)).all()


def test_a_singular_arm_that_is_almost_there_stays_where_it_is() -> None:
    """With the wrist of a UR aligned the squares of the slopes have no inverse but for the least damping."""
    robot, q, _ = case("UR", 4)
    q[:, 4] = 0.0
    target = pose_target(forward(robot, q))
    start = q + 1e-12 * np.array([1.0, -2.0, 1.0, 0.0, 0.0, 3.0])
    assert np.linalg.norm(linearised(robot, target, start)[0], axis=1).min() > 1e-13
    ends, met = descend(robot, target, start, None)
    assert met.all()
    np.testing.assert_allclose(ends, q, rtol=0, atol=1e-9)
