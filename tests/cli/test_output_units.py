"""`output.units` and `plan --si`: the units of rows beside those of the job."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from running import EXAMPLES, call

from trajcli.job.read import job_from_text

Capture = pytest.CaptureFixture[str]
JOB = """\
version: 1
units: {angle: deg, length: mm}
robot:
  convention: standard
  joints:
    - {d: 100, velocity: 90}
    - {type: prismatic, alpha: 90, velocity: 400, position: [0, 500]}
start: {joints: [0, 0]}
moves:
  - {planner: quintic, to: {joints: [30, 250]}, duration: 2}
output: {rate: 100, columns: [t, q, qd, pose, twist]}
"""
NAMES = "t,q1,q2,qd1,qd2,x,y,z,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz"
FACTORS = {"deg": np.pi / 180, "mm": 1e-3}


@pytest.fixture
def job(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "job.yaml"
    path.write_text(JOB)
    return path


def rows(text: str) -> tuple[list[str], np.ndarray]:
    head, *lines = text.splitlines()
    return head.split(","), np.array([[float(cell) for cell in line.split(",")] for line in lines])


def in_si(text: str) -> np.ndarray:
    """Return the rows, each column times what its name says of its unit."""
    names, values = rows(text)
    return values * [FACTORS.get(name.rpartition("_")[2], 1.0) for name in names]


@pytest.mark.parametrize(
    ("units", "names"),
    [
        ("{angle: rad, length: m}", "t,q1,q2,qd1,qd2"),
        ("{angle: rad}", "t,q1,q2_mm,qd1,qd2_mm"),
        ("{length: m}", "t,q1_deg,q2,qd1_deg,qd2"),
        ("{angle: deg, length: mm}", "t,q1_deg,q2_mm,qd1_deg,qd2_mm"),
    ],
)
def test_what_output_units_leaves_out_is_the_jobs(job: Path, capfd: Capture, units: str, names: str) -> None:
    plain = call(capfd, "plan", job, "--digits", "full").out
    job.write_text(JOB.replace("{rate", f"{{units: {units}, rate"))
    code, out, _ = call(capfd, "plan", job, "--digits", "full")
    assert (code, ",".join(rows(out)[0][:5])) == (0, names)
    assert in_si(out) == pytest.approx(in_si(plain), rel=1e-12, abs=1e-13)


def test_rows_of_a_job_in_si_may_be_in_degrees_and_millimetres(job: Path, capfd: Capture) -> None:
    plain = call(capfd, "plan", job).out
    text = JOB.replace("units: {angle: deg, length: mm}\n", "")
    for user, si in (("d: 100", "d: 100 mm"), ("velocity: 90", "velocity: 90 deg/s"),
                     ("alpha: 90", "alpha: 90 deg"), ("velocity: 400", "velocity: 400 mm/s"),
                     ("[0, 500]", "[0, 0.5]"), ("[30, 250]", "[30 deg, 0.25]")):  # fmt: skip
        text = text.replace(user, si)
    job.write_text(text.replace("{rate", "{units: {angle: deg, length: mm}, rate"))
    assert call(capfd, "plan", job).out == plain


def test_si_has_plain_column_names_whatever_the_job_says(job: Path, capfd: Capture) -> None:
    plain = call(capfd, "plan", job, "--digits", "full").out
    for text in (JOB, JOB.replace("{rate", "{units: {length: mm}, rate")):
        job.write_text(text)
        code, out, _ = call(capfd, "plan", job, "--si", "--digits", "full")
        assert (code, ",".join(rows(out)[0])) == (0, NAMES)
        assert in_si(out) == pytest.approx(in_si(plain), rel=1e-12, abs=1e-13)
        assert out != plain


def test_si_in_a_file_is_compared_in_the_columns_own_units(job: Path, capfd: Capture) -> None:
    assert call(capfd, "plan", job, "--si", "-o", "si.csv").code == 0
    assert call(capfd, "plan", job, "-o", "user.csv").code == 0
    # nine decimals of a radian are 2.9e-8 deg, those of a metre 5e-7 mm
    code, out, err = call(capfd, "diff", "user.csv", "si.csv", "--atol", "1e-6")
    assert code == 0, out + err
    assert call(capfd, "diff", "user.csv", "si.csv", "--atol", "1e-9").code == 1


def test_the_report_is_in_si_and_the_summary_in_words_of_no_unit(job: Path, capfd: Capture) -> None:
    summaries = [call(capfd, "plan", job, "--report", f"{n}.json", *more).err for n, more in enumerate(
        [(), ("--si",)])]  # fmt: skip
    assert summaries[0] == summaries[1]
    assert json.loads(Path("0.json").read_text()) == json.loads(Path("1.json").read_text())


def test_messages_stay_in_the_units_of_the_job(job: Path, capfd: Capture) -> None:
    job.write_text(JOB.replace("duration: 2", "duration: 0.1"))
    code, _, err = call(capfd, "plan", job, "--si")
    assert code == 1
    assert " mm/s" in err
    assert " m/s" not in err


def test_a_resolved_job_keeps_the_units_of_its_rows(job: Path, capfd: Capture) -> None:
    out = call(capfd, "plan", job, "--si", "--resolved", "resolved.yaml").out
    assert job_from_text(Path("resolved.yaml").read_text()).output_units.angle == "rad"
    assert call(capfd, "plan", "resolved.yaml").out == out


def test_wrong_units_of_rows_are_refused_where_they_stand(job: Path, capfd: Capture) -> None:
    job.write_text(JOB.replace("{rate", "{units: {angle: grad}, rate"))
    code, _, err = call(capfd, "plan", job)
    assert (code, "job.yaml:11:25" in err) == (2, True), err
    job.write_text(JOB.replace("{rate", "{units: {angel: deg}, rate"))
    assert "did you mean 'angle'?" in call(capfd, "plan", job).err


def test_the_stream_of_si_rows_is_read_by_fk(job: Path, capfd: Capture) -> None:
    assert call(capfd, "plan", job, "--si", "-o", "si.csv").code == 0
    names, values = rows(Path("si.csv").read_text())
    arguments = ("fk", "--robot", job, "--si", "--json", "--", *map(repr, values[-1, 1:3].tolist()))
    answer = json.loads(call(capfd, *arguments).out)
    assert answer["xyz"] == pytest.approx(values[-1, names.index("x") : names.index("x") + 3], abs=1e-8)


def test_si_of_a_job_in_si_changes_nothing(capfd: Capture) -> None:
    path = EXAMPLES / "blends.yaml"
    assert call(capfd, "plan", path, "--si").out == call(capfd, "plan", path).out
