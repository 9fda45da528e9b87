"""Arms of jobs, and units of the command line; textbook formulas of a planar arm are the oracle."""

from __future__ import annotations

import json

import numpy as np
import pytest
from arm_calls import Arms

JOB = """\
version: 1
units: {angle: deg, length: mm}
robot:
  convention: standard
  joints: [{a: 400, position: [-170, 170]}, {a: 300, position: [-170, 170]}]
  base: {xyz: [0, 0, 500]}
  tool: {xyz: [1, 0, 0]}
tool: {xyz: [50, 0, 0]}
start: {joints: [0, 0]}
moves: [{planner: quintic, to: {joints: [30, 60]}, duration: 1}]
output: {rate: 10}
"""
A, B = np.radians([30.0, 90.0])


@pytest.fixture
def arms(capfd, monkeypatch):
    return Arms(capfd, monkeypatch)


@pytest.fixture
def job(tmp_path):
    path = tmp_path / "job.yaml"
    path.write_text(JOB)
    return path


def test_fk_takes_robot_base_tool_and_units_of_a_job(arms, job):
    expected = [400 * np.cos(A) + 350 * np.cos(B), 400 * np.sin(A) + 350 * np.sin(B), 500.0]
    np.testing.assert_allclose(arms.json("fk", "--robot", job, 30, 60)["xyz"], expected, atol=1e-9)
    tool = arms.json("fk", "--robot", job, "--tool", "{xyz: [0, 0, 0]}", 30, 60)["xyz"]
    np.testing.assert_allclose(
        tool, [400 * np.cos(A) + 300 * np.cos(B), 400 * np.sin(A) + 300 * np.sin(B), 500]
    )


def test_fk_of_the_rows_of_a_job(arms, job):
    outcome = arms.call("fk", "--robot", job, "-", stdin="t,q1_deg,q2_deg\n0,30,60\n")
    names, row = outcome.out.split()
    assert names == "t,x_mm,y_mm,z_mm,qw,qx,qy,qz"
    np.testing.assert_allclose(float(row.split(",")[1]), 400 * np.cos(A) + 350 * np.cos(B), atol=1e-8)


def test_ik_jacobian_and_robots_take_a_job(arms, job):
    x, y = 400 * np.cos(A) + 350 * np.cos(B), 400 * np.sin(A) + 350 * np.sin(B)
    answers = arms.json("ik", "--robot", job, "--pose", json.dumps({"xyz": [x, y, 500]}))
    assert any(np.allclose(answer["joints"], [30, 60]) for answer in answers)
    matrix = arms.json("jacobian", "--robot", job, 30, 60)["jacobian"]
    np.testing.assert_allclose(matrix[0], [-y, -350 * np.sin(B)], atol=1e-9)  # mm per rad
    np.testing.assert_allclose(matrix[5], [1.0, 1.0])
    card = json.loads(arms.call("robots", job, "--json").out)
    assert card["base"]["xyz"] == [0, 0, 500]
    assert card["tool"]["xyz"] == [50, 0, 0]
    refused = arms.call("robots", job, "--yaml")
    assert refused.code == 2
    assert "is a job" in refused.err


def test_flaws_of_a_job_have_their_places(arms, job):
    job.write_text(JOB.replace("a: 300", "a: x"))
    outcome = arms.call("fk", "--robot", job, 30, 60)
    assert outcome.code == 2
    assert "job.yaml:5:" in outcome.err


def test_units_of_numbers(arms, job):
    expected = arms.json("fk", "--robot", "ur5e", "--si", 0.5, -1, 1, 0.2, 0.3, 0.4)
    degrees = np.degrees([0.5, -1, 1, 0.2, 0.3, 0.4])
    shown = arms.json("fk", "--robot", "ur5e", "--units", "deg,mm", *degrees)
    np.testing.assert_allclose(shown["xyz"], np.multiply(expected["xyz"], 1000), atol=1e-9)
    np.testing.assert_allclose(shown["rpy"], np.degrees(expected["rpy"]), atol=1e-9)
    metres = arms.json("fk", "--robot", job, "--units", "m", 30, 60)  # degrees as in the job
    np.testing.assert_allclose(metres["xyz"][2], 0.5)
    near = arms.json(
        "ik",
        "--robot",
        "ur5e",
        "--units",
        "deg,mm",
        "--near",
        *degrees,
        "--pose",
        json.dumps({"xyz": shown["xyz"], "rpy": shown["rpy"]}),
    )
    np.testing.assert_allclose(near[0]["joints"], degrees, atol=1e-6)
    assert arms.call("fk", "--robot", job, "--units", "deg,rad", 30, 60).code == 2
    assert arms.call("fk", "--robot", job, "--units", "deg", "--si", 30, 60).code == 2


@pytest.mark.parametrize("command", ["fk", "jacobian"])
def test_degrees_read_as_radians_are_noticed(arms, command):
    outcome = arms.call(command, "--robot", "ur5e", "--si", 0, -90, 90, 0, 0, 0)
    assert outcome.code == 0
    assert "shoulder_lift_joint is at -90 rad" in outcome.err
    assert "--units deg" in outcome.err
    assert "two turns" not in arms.call(command, "--robot", "ur5e", "--units", "deg", 0, -90, 90, 0, 0, 0).err


def test_near_outside_the_limits_is_noticed(arms, job):
    pose = "{xyz: [300, 400, 500]}"
    outcome = arms.call("ik", "--robot", job, "--pose", pose, "--near", 10, 175)
    assert outcome.code == 0
    assert "--near is outside the limits" in outcome.err
    assert "j2 is at 175 deg, its limit is 170 deg" in outcome.err
    assert "--near" not in arms.call("ik", "--robot", job, "--pose", pose, "--near", 10, 165).err


def test_every_branch_of_each_row_of_poses(arms, job):
    x, y = 400 * np.cos(A) + 350 * np.cos(B), 400 * np.sin(A) + 350 * np.sin(B)
    rows = f"x_mm,y_mm,z_mm\n{x:.9f},{y:.9f},500\n900,0,500\n"
    outcome = arms.call("ik", "--robot", job, "--all", "-", stdin=rows)
    names, *lines = outcome.out.split()
    assert names == "row,elbow,q1_deg,q2_deg,within_limits"
    answers = [line.split(",") for line in lines]
    assert {(answer[0], answer[1]) for answer in answers} == {("0", "up"), ("0", "down")}
    for answer in answers:
        one, both = np.radians([float(answer[2]), float(answer[2]) + float(answer[3])])
        np.testing.assert_allclose(400 * np.cos(one) + 350 * np.cos(both), x, atol=1e-6)
        np.testing.assert_allclose(400 * np.sin(one) + 350 * np.sin(both), y, atol=1e-6)
        assert answer[4] == "1"
    assert outcome.code == 3
    assert "row 1" in outcome.err
