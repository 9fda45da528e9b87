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


SLIDE = """\
version: 1
units: {angle: deg, length: mm}
robot: {joints: [{type: prismatic}, {}]}
start: {joints: [-400, 10]}
moves: [{planner: quintic, to: {joints: [100, 70]}, duration: 1}]
output: {rate: 50, columns: [t, q, qd]}
"""
REACH = """\
version: 1
units: {angle: deg, length: mm}
robot: planar2r
start: {joints: [20, 60]}
moves: [{planner: quintic, to: {joints: [40, 50]}, duration: 1}]
output: {rate: 50, columns: [t, %s]}
"""


def planned_rows(tmp_path, capfd, job, name, *options):
    """Plan a job, take the units from the names of a CSV, and return what `check` says of the rows."""
    (tmp_path / "job.yaml").write_text(job)
    assert call(capfd, "plan", tmp_path / "job.yaml", "-q", "-o", tmp_path / name).code == 0
    if name.endswith(".csv"):
        text = (tmp_path / name).read_text()
        (tmp_path / name).write_text(text.replace("_mm", "").replace("_deg", ""))
    said = call(capfd, "check", tmp_path / name, "--job", tmp_path / "job.yaml", "--json", *options)
    return said, json.loads(said.out) if said.out else None


@pytest.mark.parametrize(
    ("name", "units", "planned"),
    [
        ("rows.csv", "deg,mm", True),
        ("rows.csv", "rad,m", False),
        ("rows.csv", "deg,mm,ms", False),
        ("rows.jsonl", "rad,m", True),
        ("rows.jsonl", "deg,mm", False),
        ("rows.npy", "mm", False),
        ("rows.mcap", "deg", False),
    ],
)
def test_rows_are_those_of_a_plan_in_the_units_that_somebody_says(name, units, planned, tmp_path, capfd):
    said, report = planned_rows(tmp_path, capfd, SLIDE, name, "--units", units)
    assert (said.code, report["planned_rows"]) == (0 if planned else 1, planned)


@pytest.mark.parametrize(("columns", "planned"), [("q1=q2,q2=q1,qd=none", False), ("q=q,qd=none", True)])
def test_rows_are_those_of_a_plan_as_somebody_says_what_columns_are(columns, planned, tmp_path, capfd):
    job = SLIDE.replace("type: prismatic", "").replace("mm}", "m}")
    said, report = planned_rows(tmp_path, capfd, job, "rows.csv", "--units", "deg", "--columns", columns)
    assert (said.code, report["planned_rows"]) == (0 if planned else 1, planned)
    assert ("its column q1 is read as q2" in said.out) is not planned


def test_rows_of_the_tool_are_read_in_the_units_that_somebody_says(tmp_path, capfd):
    said, report = planned_rows(tmp_path, capfd, REACH % "pose", "rows.csv", "--units", "mm")
    assert (said.code, report["planned_rows"]) == (0, True)
    said, _ = planned_rows(tmp_path, capfd, REACH % "pose", "rows.csv")
    assert (said.code, said.out) == (3, "")
    assert "cannot reach the pose" in said.err
    said, _ = planned_rows(tmp_path, capfd, REACH % "pose", "rows.csv", "--units", "mm,ms")
    assert said.code == 2
    assert "rows of the tool alone have their times in s, not ms" in said.err


def test_columns_of_the_tool_beside_joints_have_the_units_that_somebody_says(tmp_path, capfd):
    options = ("--units", "deg,mm", "--set", "moves.0.duration=2")
    said, report = planned_rows(tmp_path, capfd, REACH % "q, pose", "rows.csv", *options)
    assert (said.code, report["planned_rows"], report["findings"]) == (0, False, [])
    assert "not read" not in said.out
    text = (tmp_path / "rows.csv").read_text().splitlines()
    cells = text[20].split(",")
    text[20] = ",".join([*cells[:3], str(float(cells[3]) + 1), *cells[4:]])
    (tmp_path / "rows.csv").write_text("\n".join(text) + "\n")
    said = call(capfd, "check", tmp_path / "rows.csv", "--job", tmp_path / "job.yaml", "--json", *options)
    (found,) = json.loads(said.out)["findings"]
    assert (found["kind"], found["row"], found["value"]) == ("tool", 20, pytest.approx(1e-3, rel=1e-6))


@pytest.mark.parametrize("command", ["check", "plot"])
def test_advice_about_degrees_helps_whoever_reads_the_file(command, tmp_path, capfd):
    """`plot` has no --units, so the columns are named by their unit."""
    stands = JOB.format(units="").replace("[0, 0]", "[0, 90 deg]")
    (tmp_path / "job.yaml").write_text(stands.replace("planar2r", "{joints: [{}, {position: [-2, 2]}]}"))
    job = ["--job", tmp_path / "job.yaml"] if command == "check" else [tmp_path / "job.yaml"]
    out = [] if command == "check" else ["-o", tmp_path / "out.svg"]
    for name, code in (("q", 1), ("q{}_deg", 0)):
        names = [name.format(k) if "{" in name else f"{name}{k}" for k in (1, 2)]
        (tmp_path / "in.csv").write_text(f"t,{','.join(names)}\n0.0,0,90\n1.0,0,90\n")
        said = call(capfd, command, tmp_path / "in.csv", *job, *out)
        assert said.code == code
        assert ("say --units deg, or q1_deg in a CSV" in said.out + said.err) == bool(code)
