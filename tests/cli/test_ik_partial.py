"""`trajcli ik` for targets that fix a part of the pose: names, what is free, what is singular, hints."""

from __future__ import annotations

import json

import numpy as np
import pytest
from arm_calls import Arms
from running import call


@pytest.fixture
def arms(capfd, monkeypatch):
    return Arms(capfd, monkeypatch)


def matrix_of(arms, robot, joints):
    return np.array(arms.json("fk", "--robot", robot, "--", *joints)["matrix"])


def test_a_pitch_names_every_branch_and_says_that_the_roll_is_free(arms):
    told = arms.json("ik", "--robot", "scorbot", "--pose", "{xyz: [0.3, 0.2, 0.3], pitch: -60}", "--all")
    names = [tuple(answer["branch"].values()) for answer in told]
    assert len(names) == len(set(names)) == 6
    assert ("left", "up", "no_flip") in names
    for answer in told:
        matrix = matrix_of(arms, "scorbot", answer["joints"])
        assert matrix[:3, 3] == pytest.approx([0.3, 0.2, 0.3], abs=1e-9)
        assert matrix[2, 2] == pytest.approx(np.sin(np.radians(-60)), abs=1e-9)
        assert answer["singular"] is False
        assert answer["free_direction"] == pytest.approx([0, 0, 0, 0, 1], abs=1e-9)
        assert answer["joints"][4] == pytest.approx(0.0, abs=1e-9)
    (near, *_) = arms.json(
        "ik", "--robot", "scorbot", "--pose", "{xyz: [0.3, 0.2, 0.3], pitch: -60}", "--near", 30, 0, 0, 0, 77
    )
    assert near["joints"][4] == pytest.approx(77.0, abs=1e-9)


def test_a_configuration_chooses_one_answer(arms):
    pose = {"xyz": [0.3, 0.2, 0.5], "pitch": 30, "tool_axis": "x"}
    words = ("--robot", "elbow4r", "--pose")
    assert len(arms.json("ik", *words, json.dumps(pose))) == 8
    pose["configuration"] = {"shoulder": "left", "elbow": "down", "wrist": "flip"}
    (only,) = arms.json("ik", *words, json.dumps(pose))
    assert only["branch"] == pose["configuration"]
    assert "free_direction" not in only
    assert only["singular"] is False


def test_each_posture_of_a_free_tool_is_listed_once(arms):
    down = "{xyz: [0.3, 0.2, 0.3], direction: [0, 0, -1]}"
    told = arms.json("ik", "--robot", "ur5e", "--pose", down)
    assert len({tuple(answer["branch"].values()) for answer in told}) == len(told) == 8
    assert not any(answer["singular"] for answer in told)
    text = arms.call("ik", "--robot", "ur5e", "--pose", down).out
    assert "(right up no_flip, free along 0  0  0  0  0  1)" in text
    assert "singular" not in text
    planar = arms.json("ik", "--robot", "planar3r", "--pose", "{xyz: [0.3, 0.2, 0]}")
    assert [answer["branch"] for answer in planar] == [{"elbow": "up"}, {"elbow": "down"}]
    assert all("free_direction" in answer and not answer["singular"] for answer in planar)


def test_a_redundant_arm_is_free_and_not_singular(arms):
    joints = [0.2, 0.3, -0.2, -1.8, 0.2, 2.0, 0.6]
    pose = json.dumps({"matrix": matrix_of(arms, "panda", joints).tolist()})
    told = arms.json("ik", "--robot", "panda", "--pose", pose, "--near", *joints)
    assert told[0]["joints"] == pytest.approx(joints, abs=1e-6)
    assert len(told) < 16
    assert all("free_direction" in answer and not answer["singular"] for answer in told)
    asked = json.dumps({**json.loads(pose), "configuration": {"elbow": "up"}})
    outcome = arms.call("ik", "--robot", "panda", "--pose", asked)
    assert (outcome.code, outcome.out) == (2, "")
    assert "has no choice of elbow" in outcome.err


def test_a_tool_axis_that_cannot_turn_is_told(arms):
    outcome = arms.call("ik", "--robot", "planar3r", "--pose", "{xyz: [0.3, 0.2, 0], yaw: 30}")
    assert (outcome.code, outcome.out) == (2, "")
    assert "the z axis of the tool of Planar 3R is always vertical and has no yaw" in outcome.err
    assert "tool_axis: x" in outcome.err
    outcome = arms.call("ik", "--robot", "cobra600", "--pose", "{xyz: [0.4, 0, 0.2], direction: [1, 0, 0]}")
    assert outcome.code == 3
    assert "no joint turns the z axis of the tool" in outcome.err
    told = arms.json("ik", "--robot", "planar3r", "--pose", "{xyz: [0.3, 0.2, 0], yaw: 30, tool_axis: x}")
    assert [round(sum(answer["joints"]) % 360, 6) for answer in told] == [30.0, 30.0]


JOB = """
version: 1
units: {angle: deg, length: m}
robot: elbow4r
start: {joints: [0, 60, -90, 0]}
moves:
  - planner: cubic
    duration: 2
    to: {xyz: [0.3, 0.2, 0.5], pitch: 30, tool_axis: x, configuration: {shoulder: left, elbow: up, wrist: flip}}
"""


def test_a_job_names_the_branch_of_a_pitch(capfd):
    outcome = call(capfd, "plan", "-", "--set", "output.columns=[t, q]", stdin=JOB)
    assert outcome.code == 0
    first, pitch, *others = [float(cell) for cell in outcome.out.splitlines()[-1].split(",")[1:5]]
    assert first == pytest.approx(np.degrees(np.arctan2(0.2, 0.3)), abs=1e-8)
    total = np.radians(pitch + sum(others))  # the tool's angle in the plane of the arm
    assert np.sin(total) == pytest.approx(0.5, abs=1e-8)
    assert np.cos(total) < 0.0  # flip: it heads back
    assert others[0] < 0.0  # the elbow is up
