"""`trajcli ik` where an arm or a pose is degenerate: wrists by themselves, axes in line, stretched arms."""

from __future__ import annotations

import json
from functools import reduce

import numpy as np
import pytest
from arm_calls import Arms
from running import call

QUARTER = np.pi / 2
WRIST = [(0.05, -QUARTER, 0.0), (0.0, QUARTER, 0.0), (0.0, 0.0, 0.1)]  # a, alpha, d of example 2.15
DEGENERATE = {  # what has no closed form of lengths, although its axes are those of a family that has
    "wrist with a4": WRIST,
    "wrist": [(0.0, *row[1:]) for row in WRIST],
    "wrist without lengths": [(0.0, row[1], 0.0) for row in WRIST],
    "elbow without lengths": [(0.3, QUARTER, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)],
    "axes in line": [(0.0, 0.0, 0.2), (0.3, 0.0, 0.0)],
    "a tcp that no joint moves": [(0.0, np.pi, 0.48210109), (0.0, 0.0, 0.128659718)],
}


@pytest.fixture
def arms(capfd, monkeypatch):
    return Arms(capfd, monkeypatch)


def robot_of(folder, rows):
    joints = [{"a": a, "alpha": alpha, "d": d} for a, alpha, d in rows]
    path = folder / "arm.yaml"
    path.write_text(json.dumps({"convention": "standard", "joints": joints}))
    return path


def pose_of(rows, joints):
    """The product of the textbook's matrices (2.38)."""
    matrices = []
    for (a, alpha, d), theta in zip(rows, joints, strict=True):
        c, s, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
        row = [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]]
        matrices.append(np.array(row))
    return reduce(np.matmul, matrices)


@pytest.mark.parametrize("name", DEGENERATE)
def test_an_arm_whose_lengths_tell_nothing(arms, tmp_path, name):
    rows, joints = DEGENERATE[name], [0.3, 0.8, 1.4][: len(DEGENERATE[name])]
    pose = pose_of(rows, joints)
    told = arms.json("ik", "-r", robot_of(tmp_path, rows), "--pose", json.dumps({"matrix": pose.tolist()}))
    assert told
    for answer in told:
        assert pose_of(rows, answer["joints"]) == pytest.approx(pose, abs=1e-9)
    if "wrist" in name:  # Euler angles ZYZ, both triples; a4 leaves one
        both = [joints, [0.3 - np.pi, -0.8, 1.4 - np.pi]][: 1 if "a4" in name else 2]
        found = sorted(answer["joints"] for answer in told)
        assert np.array(found) == pytest.approx(np.array(sorted(both)), abs=1e-9)


def test_a_wrist_turns_to_an_orientation(arms, tmp_path):
    turn = pose_of(WRIST, [0.3, 0.8, 1.4])[:3, :3].tolist()
    told = arms.json("ik", "-r", robot_of(tmp_path, WRIST), "--pose", json.dumps({"matrix": turn}))
    assert len(told) == 2
    for answer in told:
        assert pose_of(WRIST, answer["joints"])[:3, :3] == pytest.approx(np.array(turn), abs=1e-9)


JOB = """
version: 1
units: {{angle: deg}}
robot: planar2r
start: {{joints: [20, 40]}}
moves: [{{planner: cubic, duration: 5, to: {{xyz: [{x}, {y}, 0]}}}}]
"""


@pytest.mark.parametrize("stretch", [0.0, 180.0, 2.0, -100.0])
def test_ik_and_explain_mean_the_same_by_singular(arms, tmp_path, stretch, capfd):
    """The determinant of the arm is a1 a2 sin(q2): it is singular stretched and folded, and there only."""
    q1, q2 = np.radians([35.0, stretch])
    x, y = (0.3 * f(q1) + 0.2 * f(q1 + q2) for f in (np.cos, np.sin))
    told = arms.json("ik", "-r", "planar2r", "--pose", json.dumps({"xyz": [x, y, 0]}))
    lost = stretch in (0.0, 180.0)
    assert len(told) == (1 if lost else 2)
    assert all(answer["singular"] is lost and "free_direction" not in answer for answer in told)
    path = tmp_path / "job.yaml"
    path.write_text(JOB.format(x=x, y=y))
    explained = call(capfd, "explain", "--json", path)
    assert explained.code == 0, explained.err
    assert json.loads(explained.out)["moves"][0]["to_pose"]["singular"] is lost


def test_a_row_out_of_reach_is_named_once(arms):
    outcome = arms.call("ik", "-r", "planar2r", "-", stdin="t,x,y,z\n0,0.4,0,0\n1,0.9,0,0\n")
    assert outcome.code == 3
    reached = "Planar 2R cannot reach the pose: it comes within 0.4 m"
    assert f"row 1 (from 0, t = 1 s): {reached}" in outcome.err


def test_an_option_without_its_value_is_told(arms):
    for words in (("fk", "0", "0", "--robot"), ("ik", "-r", "ur5e", "--pose", "{yaw: 0}", "--near")):
        outcome = arms.call(*words)
        assert (outcome.code, outcome.out) == (2, "")
        assert f"Option '{words[-1]}' requires an argument" in outcome.err


@pytest.mark.parametrize(
    ("given", "missed", "advice"),
    [
        ({"direction": [1, 0, 0]}, 90, "no joint turns the z axis of the tool"),
        ({"pitch": 20}, 110, "no joint turns the z axis of the tool"),  # it points down
        ({"rpy": [77, 0, 0]}, 103, "leave coordinates of its orientation free"),
    ],
)
def test_an_orientation_alone_that_a_scara_cannot_have_is_missed_by_the_degrees_between(
    arms, given, missed, advice
):
    """Its tool points down: what is lacking is the angle to there, in the user's unit."""
    outcome = arms.call("ik", "-r", "scara", "--pose", json.dumps(given))
    assert outcome.code == 3, outcome.err
    assert f"it comes within 0 m and {missed} deg\n" in outcome.err
    assert advice in outcome.err
