"""Numbers that no robot has, names that are no text: refused with a message, never a traceback or a warning.

Oracle: the exit codes of the contract; any robot of the catalogue stays plannable at the edge of the bounds.
"""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path

import pytest
from running import JOB, call, warm

UR5E = """\
version: 1
robot: ur5e
start: {joints: [0, -1.5, 1.5, 0, 1, 0]}
moves:
  - {planner: MOVE}
output: {rate: 10}
"""
BARE = """\
version: 1
robot: {joints: [{velocity: V, acceleration: 10, jerk: 100}]}
start: {joints: [0]}
moves:
  - {planner: MOVE}
output: {rate: 10}
"""
ONES = ("cubic", "quintic", "septic", "cycloidal", "trapezoid", "jerk_limited")
FAR = [
    *(BARE.replace("MOVE", f"{name}, to: {{joints: [1]}}, duration: {d}") for name in ONES for d in ("1e-62", "1e155")),
    *(BARE.replace("MOVE", f"{name}, to: {{joints: [1]}}").replace("V", v) for name in ONES for v in ("1e-120", "1e300")),
    *(BARE.replace("MOVE", f"{name}, to: {{joints: [1e300]}}") for name in ONES),
    BARE.replace("MOVE", "cubic, to: {joints: ['1e300 deg']}, duration: 1"),
    UR5E.replace("MOVE", "arc, center: [1e308, 0, 0], angle: 1, law: {duration: 2}"),
    UR5E.replace("MOVE", "line, to: {xyz: [0, -1e308, 0]}, law: {duration: 2}"),
    UR5E.replace("MOVE", "line, to: {xyz: [0.4, 0.1, 0.3], rpy: [1e308, 0, 0]}"),
    UR5E.replace("MOVE", "path, corner: stop, segments: [{line: {xyz: [1.0e+308, 0, 0]}}, {line: {xyz: [0.4, 0, 0]}}]"),
    UR5E.replace("MOVE", "hold, duration: 1e300"),
]  # fmt: skip


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("job", FAR)
def test_a_number_that_no_robot_has_is_refused_at_its_place(
    capfd: pytest.CaptureFixture[str], tmp_path: Path, job: str
) -> None:
    job = job.replace("velocity: V", "velocity: 1")
    if "jerk_limited" in job:
        job = job.replace(", duration", ", minimum_duration")
    (tmp_path / "job.yaml").write_text(job)
    code, out, err = call(capfd, "plan", tmp_path / "job.yaml")
    assert (code, out) == (2, "")
    assert err.startswith(f"{tmp_path}/job.yaml:")
    assert "expected a magnitude of at most " in err or "expected at least " in err
    assert "no robot has such a number" in err


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    "words",
    [
        ("pose", "{rpy: [1e308, 0, 0]}"),
        ("pose", "{xyz: [1e308, 0, 0]}", "--units", "mm"),
        ("pose", "{axis_angle: {axis: z, angle: 1e308}}"),
        ("pose", "{axis_angle: {axis: [1e200, 1e200, 0], angle: 1}}"),
        ("fk", "-r", "ur5e", "1e308", "0", "0", "0", "0", "0"),
        ("jacobian", "-r", "ur5e", "0", "0", "0", "0", "0", "0", "--qd", "1e300", "0", "0", "0", "0", "0"),
        ("ik", "-r", "ur5e", "--pose", "{xyz: [1e300, 0, 0]}"),
    ],
)
def test_words_of_that_size_are_refused(capfd: pytest.CaptureFixture[str], words: tuple[str, ...]) -> None:
    code, out, err = call(capfd, *words)
    assert (code, out) == (2, "")
    assert "expected a magnitude of at most " in err


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    ("command", "row"),
    [
        ("fk", "q1,q2,q3,q4,q5,q6\n0,0,-1e300,0,0,0\n"),
        ("jacobian", "q1,q2,q3,q4,q5,q6\n0,0,1e13,0,0,0\n"),
        ("ik", "x,y,z,qw,qx,qy,qz\n1e300,0,0,1,0,0,0\n"),
        ("ik", "x,y,z,qw,qx,qy,qz\n0,0,0,1e300,0,0,0\n"),
    ],
)
def test_rows_of_that_size_are_refused(
    capfd: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: str, row: str
) -> None:
    (tmp_path / "rows.csv").write_text(row)
    with (tmp_path / "rows.csv").open() as stream:
        monkeypatch.setattr("sys.stdin", stream)
        code, _, err = call(capfd, command, "-r", "ur5e", "-")
    assert code == 2
    assert "expected a magnitude of at most 1e+12 (rad, m), got " in err


@pytest.mark.parametrize("field", ["joints: 1e6", "joints: -1e6", "joints: 1, velocity: 1e9"])
def test_what_a_machine_may_have_is_read(
    capfd: pytest.CaptureFixture[str], tmp_path: Path, field: str
) -> None:
    """A spindle counts its turns; an acceleration of 1e15 deg/s^2 stands in an example."""
    job = BARE.replace("velocity: V, acceleration: 10", "velocity: 1e18, acceleration: 1e18").replace(
        "jerk: 100", "jerk: 1e18"
    )
    (tmp_path / "job.yaml").write_text(job.replace("MOVE", f"quintic, to: {{{field}}}, duration: 100"))
    assert call(capfd, "plan", tmp_path / "job.yaml").code == 0


def test_a_setting_as_deep_as_a_well_is_refused(capfd: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    (tmp_path / "job.yaml").write_text(JOB)
    code, _, err = call(capfd, "plan", tmp_path / "job.yaml", "--set", "a." * 5000 + "b=1")
    assert code == 2
    assert "a path of 5001 parts, a job is at most 32 levels deep" in err
    assert len(err) < 300


def test_names_of_files_need_not_be_text(tmp_path: Path) -> None:
    folder = os.fsencode(tmp_path)
    job, rows, report = (folder + name for name in (b"/j\xff.yaml", b"/r\xff.csv", b"/v\xff.json"))
    Path(os.fsdecode(job)).write_text(JOB)
    words = [job, b"-o", rows, b"--report", report, b"--resolved", folder + b"/s\xff.yaml"]
    for line in ([b"plan", *words], [b"diff", rows, rows], [b"explain", job, b"--json"], [b"explain", job]):
        done = subprocess.run([*warm(), *line], capture_output=True, timeout=60, check=False)
        assert done.returncode == 0, done.stderr
        done.stdout.decode()
    assert json.loads(Path(os.fsdecode(report)).read_text())["job"] == "j\\udcff"
    missing = subprocess.run(
        [*warm(), b"plan", b"\xfe.yaml", b"--errors", b"json"], capture_output=True, timeout=60, check=False
    )
    assert missing.returncode == 4
    assert json.loads(missing.stderr)["problems"][0]["message"] == "there is no file '\udcfe.yaml'"
