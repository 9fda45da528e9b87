"""`trajcli ik` with joints pinned beside the pose: the other joints are solved, by independent forward kinematics."""

from __future__ import annotations

import json

import numpy as np
import pytest
from arm_calls import Arms
from independent_motion import fixed, poses, product

from trajcli.job.robot import load_robot
from trajcli.queries.arm import open_arm

RAIL = "robot: {rail: {axis: x, position: [0, 6], mass: 350}, arm: ur10e}\n"
POSE = {"xyz": [2.5, 0.4, 0.7], "rpy": [3.0, 0.1, 0.2]}


@pytest.fixture
def arms(capfd, monkeypatch):
    return Arms(capfd, monkeypatch)


@pytest.fixture
def on_rail(tmp_path):
    """An arm on a rail, as the robot of a job."""
    job = f"version: 1\n{RAIL}start: {{joints: 0}}\nmoves: [{{planner: hold, duration: 1}}]\n"
    (tmp_path / "job.yaml").write_text(job, encoding="utf-8")
    return str(tmp_path / "job.yaml")


def answers(arms, robot, pose, *options):
    return arms.json("ik", "--si", "--robot", robot, "--pose", json.dumps(pose), *options)


def tool_at(robot, joints):
    q = np.array(joints)[None, None]
    return product(poses(robot, q)[1][-1], fixed(robot.tool, q))[0, 0]


def test_a_pinned_rail_leaves_the_branches_of_the_arm_that_stands_there(arms, on_rail):
    found = answers(arms, on_rail, {**POSE, "joints": {"rail": 2.0}}, "--all")
    shifted = {**POSE, "xyz": [0.5, 0.4, 0.7]}
    alone = answers(arms, "ur10e", shifted, "--all")
    assert {answer["joints"][0] for answer in found} == {2.0}
    by_branch = [{json.dumps(a["branch"]): a["joints"][-6:] for a in some} for some in (found, alone)]
    assert by_branch[0].keys() == by_branch[1].keys()
    assert len(found) == 8
    for branch, joints in by_branch[0].items():
        np.testing.assert_allclose(joints, by_branch[1][branch], atol=1e-9)
    robot = open_arm(on_rail).robot
    for answer in found:
        np.testing.assert_allclose(tool_at(robot, answer["joints"])[:3, 3], POSE["xyz"], atol=1e-9)


def test_a_pinned_elbow_of_seven_joints_stays_and_the_pose_is_met(arms):
    robot = load_robot("iiwa14")
    goal = tool_at(robot, [0.2, 0.5, 0.3, -1.2, 0.1, 0.8, -0.4])
    pose = {"xyz": goal[:3, 3].tolist(), "matrix": goal[:3, :3].tolist()}
    found = answers(arms, "iiwa14", {**pose, "joints": {"A3": 0.3}})
    assert found
    for answer in found:
        assert answer["joints"][2] == 0.3
        np.testing.assert_allclose(tool_at(robot, answer["joints"]), goal, atol=1e-8)
    assert any(
        np.abs(np.array(a["joints"]) - [0.2, 0.5, 0.3, -1.2, 0.1, 0.8, -0.4]).max() < 1e-6 for a in found
    )


def test_pinned_joints_make_no_turns(arms):
    upright = {"xyz": [0.5, 0.2, 0.5], "direction": [0, 0, -1], "joints": {"wrist_3_joint": 0.5}}
    found = answers(arms, "ur5e", upright, "--turns")
    assert {answer["joints"][5] for answer in found} == {0.5}
    assert len({round(answer["joints"][0], 6) for answer in found}) > 2  # others do


def test_what_is_free_does_not_move_a_pinned_joint(arms, on_rail):
    """Of the wrist of six joints that stands in line, the rest of the arm could make up for the rail."""
    free = {"xyz": [2.5, 0.4, 0.7], "direction": [0, 0, -1], "joints": {"rail": 2.2}}
    found = answers(arms, on_rail, free)
    assert found
    for answer in found:
        assert answer["joints"][0] == 2.2
        assert answer["free_direction"][0] == 0.0


@pytest.mark.parametrize(
    ("joints", "code", "said"),
    [
        ({"rials": 2.0}, 2, "no joint 'rials'"),
        (2.0, 2, "pins some joints by name"),
        ({"rail": 5.9}, 3, "cannot reach the pose"),
        ({"rail": "two"}, 2, "expected"),
    ],
)
def test_what_is_wrong_with_pins_is_one_clear_error(arms, on_rail, joints, code, said):
    pose = {**POSE, "joints": joints}
    outcome = arms.call("ik", "--robot", on_rail, "--pose", json.dumps(pose))
    assert outcome.code == code
    assert said in outcome.err
    assert "Traceback" not in outcome.err


def test_pins_alone_are_no_pose(arms, on_rail):
    outcome = arms.call("ik", "--robot", on_rail, "--pose", "{joints: {rail: 2}}")
    assert outcome.code == 2
    assert "the target fixes nothing" in outcome.err


@pytest.mark.parametrize(("pinned", "helps"), [("j1", False), ("j4", True)])
def test_another_orientation_is_advised_where_the_joints_that_are_left_reach_the_position(
    arms, pinned, helps
):
    """With joint 1 of a SCARA at zero its tool is on a circle about (0.325, 0), and not at x = 0."""
    pose = {"xyz": [0, 0.5, -0.1], "yaw": 30, "tool_axis": "x", "joints": {pinned: 0}}
    outcome = arms.call("ik", "--robot", "scara", "--pose", json.dumps(pose))
    assert outcome.code == 3
    assert "cannot reach" in outcome.err
    assert ("or leave coordinates of its orientation free" in outcome.err) is helps
    del pose["yaw"], pose["tool_axis"]
    assert arms.call("ik", "--robot", "scara", "--pose", json.dumps(pose)).code == (0 if helps else 3)
