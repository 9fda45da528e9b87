from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from oracle_robots import load, robot_of, robots, tables

from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.solve import solve
from trajcli.kinematics.inverse.target import partial_target, pose_target

CASES = load("inverse.yaml", "cases")
BRANCHES = load("inverse.yaml", "branches")


def of_kind(*kinds):
    return [pytest.param(case, id=case["id"]) for case in CASES if case["kind"] in kinds]


def case_of(name):
    return next(case for case in CASES if case["id"] == name)


def limited(robot, bounds):
    inf = [[-np.inf if low is None else low, np.inf if high is None else high] for low, high in bounds]
    return replace(robot, limits=replace(robot.limits, position=np.array(inf)))


def arm_of_case(case):
    robot = robot_of(case["inputs"], case["id"])
    bounds = case["inputs"].get("limits")
    return limited(robot, bounds) if bounds else robot


def target_of(inputs):
    values = np.array(inputs["T"] if "T" in inputs else inputs["p"], dtype=float)
    if values.shape == (2,):
        return partial_target([*values, 0.0], fixed=(True, True, False))
    return partial_target(values) if values.shape == (3,) else pose_target(values)


def distance(robot, a, b):
    """Return the largest difference of any joint, full turns apart counted as none, for all pairs of rows."""
    gap = np.asarray(a)[:, None] - np.asarray(b)[None]
    turning = np.array([kind == "revolute" for kind in robot.joint_types])
    return np.abs(np.where(turning, gap - 2 * np.pi * np.round(gap / (2 * np.pi)), gap)).max(axis=-1)


def same_set(robot, found, expected, tolerance):
    gaps = distance(robot, found, expected)
    return gaps.min(axis=0).max() <= tolerance and gaps.min(axis=1).max() <= tolerance


@pytest.mark.parametrize("case", of_kind("ik_set"))
def test_all_solutions_of_a_worked_example_are_found(case):
    robot, expected = arm_of_case(case), case["expected"]
    found = solve(robot, target_of(case["inputs"]))
    assert int(found.count) == expected["count"]
    assert same_set(robot, found.joints[found.valid], expected["solutions"], max(case["tolerance"], 1e-8))
    if "within_limits" in expected:
        assert int(found.within_limits.sum()) == expected["within_limits"]


@pytest.mark.parametrize("case", of_kind("ik_claim"))
def test_printed_answers_are_among_the_solutions_only_when_they_are_right(case):
    robot, claimed = arm_of_case(case), np.array(case["inputs"]["q_claimed"], dtype=float)
    found = solve(robot, target_of(case["inputs"]), near=claimed)
    gaps = distance(robot, found.joints[found.valid], claimed[None])
    assert bool(gaps.min() <= max(case["tolerance"], 1e-8)) is case["expected"]["satisfies"]


@pytest.mark.parametrize("case", of_kind("ik_singular_family"))
def test_an_aligned_wrist_gives_a_family_and_the_regular_pair(case):
    robot, expected = arm_of_case(case), case["expected"]
    near = np.zeros(6)
    found = solve(robot, target_of(case["inputs"]), near=near)
    out = found.valid & (found.joints[:, 2] > 0.0)
    regular = found.joints[out & ~found.singular]
    assert same_set(robot, regular, expected["regular"], 1e-8)
    assert np.count_nonzero(out & found.singular) == 1
    point = found.joints[out & found.singular][0]
    family, (i, j) = expected["family"], expected["family"]["sum_of"]
    for index, value in family["fixed"].items():
        assert point[int(index)] == pytest.approx(value, abs=1e-8)
    assert np.cos(point[i] + point[j] - family["equals"]) == pytest.approx(1.0, abs=1e-14)
    assert point[i] == pytest.approx(point[j], abs=1e-7)
    assert np.flatnonzero(found.free[out & found.singular][0]).tolist() == [i, j]


def test_the_member_of_a_family_follows_the_given_configuration():
    case = case_of("A-vd2.21-family")
    robot = arm_of_case(case)
    for fourth in (-1.0, 0.3, 2.0):
        near = np.array([np.pi / 2, np.pi / 2, 0.5, fourth, 0.0, np.pi - fourth])
        found = solve(robot, target_of(case["inputs"]), near=near)
        gaps = np.abs(found.joints[found.valid] - near).max(axis=1)
        assert gaps.min() < 1e-8


def test_a_point_on_the_first_axis_leaves_its_joint_free():
    case = case_of("A-vd2.24-shoulder-singular")
    robot = arm_of_case(case)
    for first in (0.0, 0.7, -2.0):
        found = solve(robot, target_of(case["inputs"]), near=[first, 1.0, 0.5])
        assert found.singular[found.valid].all()
        assert found.free[found.valid].tolist() == [[True, False, False]] * int(found.count)
        assert np.abs(found.joints[found.valid][:, 0] - first).min() < 1e-8
        cosine = (0.16 - 0.09 - 0.0625) / (2 * 0.3 * 0.25)
        assert np.cos(found.joints[found.valid][:, 2]) == pytest.approx(cosine, abs=1e-12)


def test_a_pose_beside_the_wrist_singularity_is_met():
    case = case_of("A-vd2.26-nearsing")
    robot, expected = arm_of_case(case), case["expected"]
    found = solve(robot, target_of(case["inputs"]), near=expected["q_one"])
    best = int(found.nearest(np.array(expected["q_one"]), within_limits=False))
    joints = found.joints[best]
    assert found.valid[best]
    assert np.abs(forward(robot, joints) - case["inputs"]["T"]).max() < expected["pose_tolerance"]
    total = joints[3] + joints[5] - expected["sum_theta4_theta6"]
    assert np.cos(total) == pytest.approx(1.0, abs=1e-12)


def test_the_last_wrist_angle_has_the_sign_the_listing_lost():
    case = case_of("A-vd2.26-t6")
    wrist = robot_of(case_of("A-bt4-ik")["inputs"])
    pose = np.eye(4)
    pose[:3, :3] = np.array(case["inputs"]["R36"])
    base = forward(wrist, np.zeros(6))[:3, :3] @ np.eye(3)
    pose[:3, :3] = base @ pose[:3, :3]
    found = solve(wrist, pose)
    angles = found.joints[found.valid][:, 3:]
    expected = [case["expected"][name] for name in ("theta4", "theta5", "theta6")]
    assert np.abs(angles - expected).max(axis=1).min() < case["tolerance"] * 10
    assert np.abs(angles[:, 2] - case["misprint_trap"]["theta6"]).min() > 0.1


@pytest.mark.parametrize("case", of_kind("ik_unreachable"))
def test_an_unreachable_pose_says_how_far_it_is(case):
    robot = arm_of_case(case)
    found = solve(robot, target_of(case["inputs"]))
    assert int(found.count) == 0
    shoulder, wrist = np.array([0.0, 0.0, 0.67183]), np.array([2.0, 0.0, 0.5])
    reach = 0.4318 + np.hypot(0.0203, 0.4318)
    offset = 0.15005
    aim = np.array([np.hypot(2.0, 0.0) ** 2 - offset**2, 0.0])[0] ** 0.5
    expected = np.hypot(aim, wrist[2] - shoulder[2]) - reach
    assert found.shortfall == pytest.approx([expected, 0.0], abs=1e-9)


@pytest.mark.parametrize("entry", [pytest.param(entry, id=entry["id"]) for entry in BRANCHES])
def test_all_branches_of_a_real_arm_are_found_from_every_table(entry):
    robot = next(robot for robot in robots() if robot["id"] == entry["robot"])
    for table in tables(robot):
        arm = limited(robot_of(table, entry["robot"]), entry["limits"])
        if np.abs(forward(arm, entry["q_generating"]) - entry["T"]).max() > 1e-6:
            continue
        found = solve(arm, forward(arm, entry["q_generating"]))
        assert int(found.count) == entry["count"]
        assert same_set(arm, found.joints[found.valid], entry["solutions"], 1e-7)
        gaps = distance(arm, found.joints[found.valid], entry["solutions"])
        inside = np.array(entry["within_limits_mod_2pi"])[gaps.argmin(axis=1)]
        assert found.within_limits[found.valid].tolist() == inside.tolist()
