"""Units of the files that `trajcli check` reads: stated by the user somewhere, or asked for."""

from __future__ import annotations

import json

import numpy as np
import pytest
from running import call

ARM = "convention: standard\njoints: [{a: 1, position: [-2, 2]}, {a: 1, position: [-2, 2]}]\n"
JOB = (
    "version: 1\n{units}robot: planar2r\nstart: {{joints: [0, 0]}}\nmoves: [{{planner: hold, duration: 1}}]\n"
)


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "in.csv"
    path.write_text("time,q1,q2\n0.0,1.0,113.0\n1.0,1.5,1.5\n")
    return path


@pytest.mark.parametrize("robot", ["catalogue", "silent file", "silent job"])
def test_a_file_without_units_needs_them(robot, file, tmp_path, capfd):
    (tmp_path / "arm.yaml").write_text(ARM)
    (tmp_path / "job.yaml").write_text(JOB.format(units=""))
    arm = {
        "catalogue": ["--robot", "planar2r"],
        "silent file": ["--robot", tmp_path / "arm.yaml"],
        "silent job": ["--job", tmp_path / "job.yaml"],
    }[robot]
    said = call(capfd, "check", file, *arm)
    assert said.code == 2
    assert "nothing says the unit of q1, q2" in said.err
    assert "values up to 113: degrees?" in said.err
    assert said.out == ""


@pytest.mark.parametrize(
    ("units", "options", "scale"),
    [
        ("units: {angle: deg}\n", [], 180 / np.pi),
        ("units: {angle: rad}\n", [], 1.0),
        ("units: {angle: deg}\n", ["--units", "rad"], 1.0),
        ("", ["--units", "deg"], 180 / np.pi),
    ],
)
def test_units_of_a_robot_file_and_of_the_user(units, options, scale, file, tmp_path, capfd):
    limit = 114 if "deg" in units else 2
    (tmp_path / "arm.yaml").write_text(units + ARM.replace("2]", f"{limit}]").replace("-2", f"-{limit}"))
    bound = limit * (np.pi / 180 if "deg" in units else 1.0)
    said = call(capfd, "check", file, "--robot", tmp_path / "arm.yaml", "--format", "json", *options)
    largest = 113.0 / scale
    assert said.code == (1 if largest > bound else 0)
    found = [f for f in json.loads(said.out)["findings"] if f["kind"] == "position"]
    if largest > bound:
        assert found[0]["value"] == pytest.approx(largest)


def test_the_unit_of_time_may_be_said_beside_that_of_angles(tmp_path, capfd):
    (tmp_path / "in.csv").write_text("time,q1,q2\n0,0,0\n500,1,0\n")
    said = call(
        capfd,
        "check",
        tmp_path / "in.csv",
        "-r",
        "planar2r",
        "--units",
        "rad,ms",
        "--limits",
        "{velocity: 1}",
    )
    assert "2 rad/s" in said.out, said.err
    assert said.code == 1
