"""`trajcli ik`: all branches, limits, families, partial targets, rows that stay together."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from arm_calls import ORACLES, Arms, robot_file
from yaml_files import read_yaml

INVERSE = read_yaml(ORACLES / "inverse.yaml")
ARMS = {row["id"]: row for row in read_yaml(ORACLES / "robots.yaml")["robots"]}
EXAMPLES = {case["id"]: case for case in INVERSE["cases"] if case["kind"] == "ik_set"}
BRANCHES = {case["id"]: case for case in INVERSE["branches"]}
HOME = ("0", "-90", "90", "0", "90", "0")


@pytest.fixture
def arms(capfd, monkeypatch):
    return Arms(capfd, monkeypatch)


def wrapped(joints, dh):
    turning = np.array([row["type"] == "R" for row in dh])
    values = np.array(joints, dtype=float)
    return np.where(turning, values - 2 * np.pi * np.round(values / (2 * np.pi)), values)


def check_set(arms, path, dh, target, expected, tolerance):
    values = np.array(target, dtype=float)
    pose = {"matrix": target} if values.ndim == 2 else {"xyz": [*target, *[0.0] * (3 - len(target))]}
    told = arms.json("ik", "--all", "--robot", path, "--pose", json.dumps(pose))
    found = np.array([answer["joints"] for answer in told])
    assert len(found) == expected["count"]
    gaps = np.abs(wrapped(found[:, None] - np.array(expected["solutions"])[None], dh)).max(axis=-1)
    assert gaps.min(axis=0).max() < tolerance
    assert {"joints", "branch", "within_limits", "closure", "singular"} <= set(told[0])
    assert max(answer["closure"] for answer in told) < 1e-9
    names = [json.dumps(answer["branch"]) for answer in told]
    assert len(set(names)) == len(names)


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_worked_examples(arms, name, tmp_path):
    case = EXAMPLES[name]
    inputs = case["inputs"]
    target = inputs["T"] if "T" in inputs else inputs["p"]
    path = robot_file(tmp_path, inputs)
    check_set(arms, path, inputs["dh"], target, case["expected"], max(case["tolerance"], 1e-8))


@pytest.mark.parametrize("name", BRANCHES)
def test_the_branches_of_real_arms(arms, name, tmp_path):
    case = BRANCHES[name]
    arm = next(arm for key, arm in ARMS.items() if name.startswith(f"{key}-ik"))
    check_set(arms, robot_file(tmp_path, arm), arm["dh"], case["T"], case, 1e-6)


def pose_of(arms, robot, *q):
    return json.dumps({"matrix": arms.json("fk", "--robot", robot, "--", *q)["matrix"]})


def test_near_sorts_and_configuration_chooses(arms):
    pose = pose_of(arms, "ur5e", *HOME)
    told = arms.json("ik", "--robot", "ur5e", "--pose", pose, "--near", *HOME)
    assert len(told) == 8
    assert told[0]["joints"] == pytest.approx([0, -90, 90, 0, 90, 0], abs=1e-9)
    asked = json.dumps({**json.loads(pose), "configuration": {"shoulder": "left", "wrist": "flip"}})
    some = arms.json("ik", "--robot", "ur5e", "--pose", asked)
    assert len(some) == 2
    assert all(one["branch"]["shoulder"] == "left" and one["branch"]["wrist"] == "flip" for one in some)


def test_turns_are_listed_within_the_limits(arms):
    pose = pose_of(arms, "irb120", *([0.3] * 6))
    plain = arms.json("ik", "--robot", "irb120", "--pose", pose)
    turned = arms.json("ik", "--robot", "irb120", "--pose", pose, "--turns")
    assert len(turned) > len(plain)
    assert all(abs(answer["joints"][5]) <= 6.98132 and answer["within_limits"] for answer in turned)
    assert np.ptp([answer["joints"][5] for answer in turned]) > 2 * np.pi


def test_outside_the_limits(arms):
    pose = "{xyz: [-0.4, 0.1, 0.3], rpy: [180, 0, 0]}"
    assert arms.json("ik", "--robot", "cobra600", "--pose", pose, code=3) == []
    assert len(arms.json("ik", "--robot", "cobra600", "--pose", pose, "--all", code=3)) == 2
    outcome = arms.call("ik", "--robot", "cobra600", "--pose", pose)
    assert (outcome.code, outcome.out) == (3, "")
    assert "j1 at 124.231492 deg, its limit is 50 deg" in outcome.err


def test_out_of_reach(arms):
    outcome = arms.call("ik", "--robot", "ur5e", "--pose", "{xyz: [3, 0, 0], rpy: [0, 0, 0]}")
    assert (outcome.code, outcome.out) == (3, "")
    assert "UR5e cannot reach the pose" in outcome.err


def test_a_singular_family_says_what_is_free(arms):
    pose = pose_of(arms, "puma560", 10, 20, -100, 30, 0, 40)
    told = arms.json("ik", "--robot", "puma560", "--pose", pose, "--near", 10, 20, -100, 30, 0, 40)
    assert told[0]["singular"]
    assert told[0]["joints"] == pytest.approx([10, 20, -100, 30, 0, 40], abs=1e-6)
    free = np.array(told[0]["free_direction"])
    assert np.abs(free) == pytest.approx(np.array([0, 0, 0, 1, 0, 1]) / np.sqrt(2), abs=1e-6)
    moved = np.array(told[0]["joints"]) + 5 * free
    assert np.array(json.loads(pose_of(arms, "puma560", *moved))["matrix"]) == pytest.approx(
        np.array(json.loads(pose)["matrix"]), abs=1e-6
    )


def test_a_target_may_leave_parts_free(arms):
    told = arms.json("ik", "--robot", "elbow", "--pose", "{xyz: [0.3, 0.2, 0.6]}")
    assert len(told) == 4
    for answer in told:
        xyz = arms.json("fk", "--robot", "elbow", "--", *answer["joints"])["xyz"]
        assert xyz == pytest.approx([0.3, 0.2, 0.6], abs=1e-9)
    down = "{xyz: [0.3, 0.3, 0.3], direction: [0, 0, -1]}"
    (first, *_) = arms.json("ik", "--robot", "ur5e", "--pose", down)
    reached = np.array(arms.json("fk", "--robot", "ur5e", "--", *first["joints"])["matrix"])
    assert reached[:3, 2] == pytest.approx([0, 0, -1], abs=1e-6)
    assert np.abs(first["free_direction"]) == pytest.approx([0, 0, 0, 0, 0, 1], abs=1e-6)


def rows_of(out):
    head, *lines = out.splitlines()
    return head, np.array([[float(cell) for cell in line.split(",")] for line in lines])


@pytest.mark.parametrize("robot", ["ur5e", "puma560"])
def test_rows_come_back_as_they_were(arms, robot):
    t = np.linspace(0, 4, 60)[:, None]
    middle, swing = np.array([0, -60, 70, 20, 45, 10]), np.array([150, 20, 20, 90, 15, 200])
    q = middle + swing * np.sin(t * [1, 0.7, 0.9, 0.5, 0.8, 1])
    head = "t," + ",".join(f"q{i}_deg" for i in range(1, 7))
    rows = "".join(",".join(map(repr, row)) + "\n" for row in np.hstack([t, q]).tolist())
    poses = arms.call("fk", "--robot", robot, "--digits", "full", "-", stdin=f"{head}\n{rows}").out
    code, out, err = arms.call("ik", "--robot", robot, "--near", *q[0], "-", stdin=poses)
    assert (code, err) == (0, "")
    found_head, found = rows_of(out)
    assert found_head == head
    assert found == pytest.approx(np.hstack([t, q]), abs=1e-6)


def test_rows_through_a_numeric_solver_do_not_jump(arms):
    start = [0.1, 0.2, 0.3, -1.8, 0.2, 1.9, 0.3]
    head = ",".join(f"q{i}" for i in range(1, 8))
    rows = "".join(",".join(str(v + 0.01 * k) for v in start) + "\n" for k in range(3))
    poses = arms.call("fk", "--robot", "panda", "--digits", "full", "-", stdin=f"{head}\n{rows}").out
    code, out, err = arms.call("ik", "--robot", "panda", "--near", *start, "-", stdin=poses)
    assert (code, err) == (0, "")
    joints = rows_of(out)[1]
    assert np.abs(np.diff(joints, axis=0)).max() < 0.2
    assert joints[0] == pytest.approx(start, abs=0.2)


BAD_ROWS = [
    ("x,y\n1,2\n", 2, "there is no column z"),
    ("x,y,z,qw\n1,2,3,1\n", 2, "there is no column qx, qy, qz"),
    ("x,y,z,qw,qx,qy,qz\n0.4,0,0.4,1,1,0,0\n", 2, "row 0 (from 0): the quaternion has length 1.41421"),
    (
        "t,x,y,z,qw,qx,qy,qz\n0,0.4,0.1,0.4,1,0,0,0\n0.5,4,0,0.4,1,0,0,0\n",
        3,
        "row 1 (from 0, t = 0.5 s): UR5e cannot",
    ),
    ("x,x_mm,y,z\n1,1,2,3\n", 2, "x and x_mm are columns of the same number"),
]


@pytest.mark.parametrize(("rows", "code", "message"), BAD_ROWS, ids=[row[2] for row in BAD_ROWS])
def test_wrong_rows(arms, rows, code, message):
    outcome = arms.call("ik", "--robot", "ur5e", "-", stdin=rows)
    assert outcome.code == code
    assert message in outcome.err


BAD = [
    ([], "say either --pose POSE, or -"),
    (["-", "--pose", "{xyz: [0, 0, 0]}"], "say either --pose POSE, or -"),
    (["--pose", "{}"], "the target fixes nothing"),
    (["--pose", "{xyz: [0, 0]}"], "--pose:1:7: error: expected 3 numbers"),
    (["--pose", "{xyz: [0, 0, 1], configuration: {elbow: left}}"], "expected up or down"),
    (["--pose", "{xyz: [0, 0, 1]}", "--tolerance", "0"], "--tolerance must be from 1e-12 to 1"),
    (["--pose", "{xyz: [0, 0, 1]}", "--near", "1"], "--near has 1 value, UR5e has 6 joints"),
    (["1"], "there is no place for 1"),
]


@pytest.mark.parametrize(("words", "message"), BAD, ids=[f"{i}" for i in range(len(BAD))])
def test_wrong_calls(arms, words, message):
    outcome = arms.call("ik", "--robot", "ur5e", *words)
    assert (outcome.code, outcome.out) == (2, "")
    assert message in outcome.err


def test_rows_of_a_job_in_a_frame_of_its_own_need_a_base(arms, tmp_path: Path) -> None:
    job = tmp_path / "job.yaml"
    job.write_text(
        "version: 1\nrobot: planar2r\nframes: {table: {xyz: [0.1, 0, 0], rpy: [0, 0, 1.5707963267948966]}}\n"
        "start: {joints: [0, 0]}\nmoves: [{planner: hold, duration: 1}]\noutput: {in: table}\n"
    )
    # joints 0 and pi/2: 0.3 m along x of world, 0.2 m along y
    rows = {"table": "x,y,z\n0.2,-0.2,0\n", "world": "x,y,z\n0.3,0.2,0\n"}
    near = ("--near", "0,1.5")
    refused = arms.call("ik", "-r", job, *near, "-", stdin=rows["table"])
    assert refused.code == 2
    assert "writes poses in 'table', and ik reads them in world" in refused.err
    for name, text in rows.items():
        (base,) = re.findall(rf"--base '([^']*)' in {name}", refused.err)
        out = arms.call("ik", "-r", job, *near, "--base", base, "-", stdin=text).out
        assert [float(cell) for cell in out.splitlines()[1].split(",")] == pytest.approx([0, np.pi / 2])


def test_text(arms, tmp_path: Path):
    (tmp_path / "pose.yaml").write_text("xyz: [0.3, 0.1, 0]\n")
    code, out, err = arms.call("ik", "--robot", "planar2r", "--pose", f"@{tmp_path / 'pose.yaml'}")
    assert (code, err) == (0, "")
    assert out.startswith("2 answers for Planar 2R (deg), by planar 2R:\n")
    assert "(up)" in out
    assert "(down)" in out


@pytest.mark.parametrize("name", ["ur5e", "panda", "puma560"])
def test_the_bounds_of_tolerance(arms, name):
    count = 7 if name == "panda" else 6
    pose = arms.json("fk", "--robot", name, "--si", "--", *[0.3, -0.6, 0.4, -0.9, 0.5, 0.2, 0.1][:count])
    said = f"{{matrix: {pose['matrix']}}}"
    for tolerance in ("1e-12", "1"):
        assert arms.call("ik", "--robot", name, "--si", "--pose", said, "--tolerance", tolerance).code == 0
    for tolerance in ("0.99e-12", "1.01", "1e-300", "1e300", "nan", "-1"):
        code, out, err = arms.call("ik", "--robot", name, "--si", "--pose", said, f"--tolerance={tolerance}")
        assert (code, out) == (2, "")
        assert "--tolerance must be from 1e-12 to 1" in err


def test_flags_of_a_maker_say_what_is_not_met(arms):
    pose = "{xyz: [0.3, 0.1, 0.5], rpy: [0, 90, 0], configuration: {abb: [0, -1, %d, %d]}}"
    asked = {
        (0, 0): (0, True),
        (-4, 0): (0, True),  # -289 deg is within the range of joint 6
        (1, 0): (0, False),
        (0, 3): (3, True),
    }
    for (sixth, branch), (code, met) in asked.items():
        told = arms.call("ik", "--robot", "irb120", "--pose", pose % (sixth, branch))
        assert told.code == code
        assert ("turns of joint_6 not as asked" in told.out) != met
    assert told.out == ""
    assert "abb [0, -1, 0, 3] only outside the limits" in told.err
