"""Markers of what a judge finds in a file over a job: when and where it is, by the formula of its peak."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from trajcli.job.read import job_from_text
from trajcli.judge.file import CheckOptions, check_file
from trajcli.judge.judgement import Judgement
from trajcli.planning.plan import Plan, plan_job
from trajcli.plots.panel import NO_POINTS, Panel, Picture
from trajcli.plots.picture import picture_of
from trajcli.streams.reading import read_table

JOB = """\
version: 1
units: {angle: deg}
robot: {convention: standard, joints: [{a: 0.5, velocity: 60}, {a: 0.3, velocity: 60}]}
limits: {tcp: {speed: 2}}
start: {joints: [0, 0]}
moves: [{planner: quintic, to: {joints: [20, 20]}, duration: 2}]
output: {start_time: 10}
"""
ENDS = {"clean": (10.4, 11.4), "peak": (10.4, 10.9)}
"""When the second joint starts and stops: from rest to rest by 20 deg it reaches 15/8 of its mean speed."""


def quintic(t: np.ndarray, start: float, end: float) -> list[np.ndarray]:
    """Return 0 to 20 deg from rest to rest, and two derivatives (Biagiotti and Melchiorri, section 2.1)."""
    duration = end - start
    s = np.clip((t - start) / duration, 0.0, 1.0)
    q = 20 * (10 * s**3 - 15 * s**4 + 6 * s**5)
    qd = 20 / duration * (30 * s**2 - 60 * s**3 + 30 * s**4)
    return [q, qd, 20 / duration**2 * (60 * s - 180 * s**2 + 120 * s**3)]


def written(folder: Path, name: str) -> Path:
    t = 10 + np.arange(101) / 50
    both = zip(quintic(t, 10, 12), quintic(t, *ENDS[name]), strict=True)
    columns = [t, *(each for pair in both for each in pair)]
    file = folder / f"{name}.csv"
    header = "t,q1_deg,q2_deg,qd1_deg,qd2_deg,qdd1_deg,qdd2_deg"
    np.savetxt(file, np.stack(columns, axis=1), "%.9f", delimiter=",", header=header, comments="")
    return file


def judged(plan: Plan, file: Path) -> Judgement:
    return check_file(str(file), CheckOptions(), plan).judgement


def drawn(folder: Path, *names: str, job: str = JOB) -> Picture:
    plan, files = plan_job(job_from_text(job)), [written(folder, name) for name in names]
    judgements = [judged(plan, file) for file in files]
    return picture_of(plan, [read_table(file) for file in files], judgements=judgements)


def panels(picture: Picture) -> dict[str, Panel]:
    return {panel.title: panel for block in picture.blocks for panel in block.panels}


def test_a_peak_between_two_rows_is_marked_at_its_time_and_value(tmp_path: Path) -> None:
    picture = drawn(tmp_path, "peak")
    shown = panels(picture)
    # 10.65 s is between the rows at 10.64 s and 10.66 s
    np.testing.assert_allclose(shown["j2: velocity"].findings, [[10.65, 15 / 8 * 20 / 0.5]], atol=1e-4)
    for title in set(shown) - {"j2: velocity"}:
        ((time, value),) = shown[title].findings
        assert time == pytest.approx(10.65, abs=1e-4)
        assert np.isnan(value)
    assert picture.title == "<text>: verified, 2 s; peak.csv: EXCEEDED, 1 finding"


def test_its_clean_twin_has_no_marker(tmp_path: Path) -> None:
    picture = drawn(tmp_path, "clean")
    assert not any(panel.findings.size for panel in panels(picture).values())
    assert picture.title == "<text>: verified, 2 s"


def test_of_two_files_only_the_one_that_exceeds_is_marked(tmp_path: Path) -> None:
    picture = drawn(tmp_path, "clean", "peak")
    assert len(panels(picture)["j2: velocity"].findings) == 1
    assert picture.title.endswith("2 s; peak.csv: EXCEEDED, 1 finding")


def test_a_file_that_is_not_judged_is_drawn_without_markers(tmp_path: Path) -> None:
    plan, file = plan_job(job_from_text(JOB)), written(tmp_path, "peak")
    for judgements in ((), (None,)):
        picture = picture_of(plan, [read_table(file)], judgements=judgements)
        assert all(panel.findings.tolist() == NO_POINTS.tolist() for panel in panels(picture).values())


def test_a_speed_of_the_tool_is_marked_in_its_panel(tmp_path: Path) -> None:
    # joint 2 alone moves the tool at 0.3 m times its rate: with joint 1 at most 0.4 m/s
    job = JOB.replace("{joints: [20, 20]}, duration: 2", "{joints: [20, 20]}, duration: 4")
    file = tmp_path / "turn.csv"
    t = 10 + np.arange(101) / 50
    q, qd, qdd = quintic(t, 10, 12)
    rows = np.stack([t, q, 0 * q, qd, 0 * q, qdd, 0 * q], axis=1)
    header = "t,q1_deg,q2_deg,qd1_deg,qd2_deg,qdd1_deg,qdd2_deg"
    np.savetxt(file, rows, "%.9f", delimiter=",", header=header, comments="")
    plan = plan_job(job_from_text(job.replace("speed: 2", "speed: 0.2")))
    shown = panels(picture_of(plan, [read_table(file)], judgements=[judged(plan, file)]))
    marks = shown["speed of the tool"].findings
    # stretched the arm is 0.8 m long: it turns at 15/8 of 10 deg/s after a second
    seen = marks[np.isfinite(marks[:, 1])]
    np.testing.assert_allclose(seen, [[11.0, 0.8 * np.radians(15 / 8 * 10)]], atol=2e-3)
    assert not np.isfinite(shown["angular speed of the tool"].findings[:, 1]).any()


def test_a_tool_that_a_file_says_in_the_frame_of_the_job_is_drawn_in_world(tmp_path: Path) -> None:
    job = JOB.replace(
        "output: {", "frames: {table: {xyz: [0.1, 0, 0], rpy: [0, 0, 90]}}\noutput: {in: table, "
    )
    t = 10 + np.arange(101) / 50
    q = np.radians(quintic(t, 10, 12)[0])
    x, y = 0.5 * np.cos(q) + 0.3 * np.cos(2 * q), 0.5 * np.sin(q) + 0.3 * np.sin(2 * q)
    rows = np.stack([t, y, 0.1 - x, 0 * t], axis=1)
    np.savetxt(tmp_path / "tool.csv", rows, "%.9f", delimiter=",", header="t,x,y,z", comments="")
    plan = plan_job(job_from_text(job))
    both = plan, [read_table(tmp_path / "tool.csv")], ["path"]
    for picture, source in ((picture_of(*both), 1), (picture_of(*both, second=plan), 2)):
        assert picture.views is not None
        of_source = dict(picture.views.traces)
        np.testing.assert_allclose(of_source[source], np.stack([x, y, 0 * t], axis=1), atol=1e-8)
        np.testing.assert_allclose(of_source[source - 1][-1], [x[-1], y[-1], 0], atol=1e-8)


def test_a_jump_is_marked_on_the_line_of_the_file(tmp_path: Path) -> None:
    plan, file = plan_job(job_from_text(JOB)), written(tmp_path, "clean")
    lines = file.read_text().splitlines()
    cells = [line.split(",") for line in lines]
    for row in cells[60:]:
        row[2] = f"{float(row[2]) + 3:.9f}"  # degrees, from one row to the next
    file.write_text("\n".join(",".join(row) for row in cells) + "\n")
    judgement = judged(plan, file)
    assert "jump" in {finding.kind for finding in judgement.errors}
    shown = panels(picture_of(plan, [read_table(file)], judgements=[judgement]))
    time, before = float(cells[59][0]), float(cells[59][2])
    assert [time, before] in [
        pytest.approx(mark, abs=1e-6) for mark in shown["j2: position"].findings.tolist()
    ]
