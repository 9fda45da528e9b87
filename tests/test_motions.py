"""Files of motions from Python: the same numbers as the commands, files whole or not at all."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import trajcli
from tests.cli.running import JOB as LIMITED
from tests.cli.running import call

EXAMPLES = Path(__file__).parent.parent / "examples"
JOB = EXAMPLES / "quintic.yaml"


@pytest.fixture
def rows(tmp_path: Path) -> Path:
    path = tmp_path / "rows.csv"
    trajcli.plan(JOB).save(path)
    return path


def test_retime_writes_what_the_command_writes(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    job, rows = tmp_path / "job.yaml", tmp_path / "rows.csv"
    job.write_text(LIMITED)
    trajcli.plan(job).save(rows)
    before, after = tmp_path / "a.csv", tmp_path / "b.csv"
    motion = trajcli.retime(rows, job=job, fastest=True, output=before)
    assert call(capfd, "retime", rows, "--job", job, "--fastest", "-o", after).code == 0
    assert before.read_bytes() == after.read_bytes()
    (stretch,) = motion.stretches
    assert motion.t.shape == motion.q.shape[:1]
    # straight lines between rows 0.1 s apart: the fastest is by nearly the curve's 56.25 of 90 deg/s
    fastest = np.abs(np.diff(motion.q[:, 0]) / np.diff(motion.t)).max()
    assert fastest == pytest.approx(np.radians(90), rel=1e-3)
    assert motion.duration == pytest.approx(stretch.factor, rel=1e-6)


def test_resample_keeps_the_curve(rows: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    motion = trajcli.resample(rows, 50)
    wanted = trajcli.plan(JOB).trajectory
    np.testing.assert_allclose(motion.q, wanted(motion.t), atol=2e-9)
    np.testing.assert_allclose(np.diff(motion.t[:-1]), 0.02, atol=1e-9)
    motion.save(tmp_path / "again.csv")
    assert call(capfd, "resample", str(rows), "--rate", "50", "-o", str(tmp_path / "b.csv")).code == 0
    assert (tmp_path / "again.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()
    for rate in (0.0, -1.0, float("nan")):
        with pytest.raises(trajcli.InputError, match="rate"):
            trajcli.resample(rows, rate)


def test_pictures_and_pages_are_those_of_the_commands(
    rows: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    trajcli.plot(JOB, tmp_path / "a.svg")
    assert call(capfd, "plot", str(JOB), "-o", str(tmp_path / "b.svg")).code == 0
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()
    trajcli.view(trajcli.plan(JOB), tmp_path / "a.html")
    assert call(capfd, "view", str(JOB), "-o", str(tmp_path / "b.html")).code == 0
    assert (tmp_path / "a.html").read_bytes() == (tmp_path / "b.html").read_bytes()
    trajcli.plot(rows, tmp_path / "rows.png", joints=(), quantities=("q",))
    trajcli.view(rows, tmp_path / "rows.html", robot=JOB)
    trajcli.view(JOB, tmp_path / "two.html", beside=rows, robot=JOB, compress=False)
    assert '"other":{' in (tmp_path / "two.html").read_text(encoding="utf-8")
    assert (tmp_path / "rows.png").read_bytes()[1:4] == b"PNG"
    assert b"rows.csv" in (tmp_path / "rows.html").read_bytes()


def test_batch_plans_each_job_once(tmp_path: Path) -> None:
    for name in ("one", "two"):
        (tmp_path / f"{name}.yaml").write_text(JOB.read_text())
    (tmp_path / "wrong.yaml").write_text("version: 1\nstart: {}\n")
    found = trajcli.batch([tmp_path], tmp_path / "out", processes=1)
    assert [(Path(one.job.job).stem, one.outcome) for one in found] == [
        ("one", "written"),
        ("two", "written"),
        ("wrong", "failed"),
    ]
    assert found[2].exit_code == 2
    direct = tmp_path / "direct.csv"
    trajcli.plan(JOB).save(direct)
    assert (tmp_path / "out/one.csv").read_bytes() == direct.read_bytes()
    again = trajcli.batch([tmp_path], tmp_path / "out", processes=1)
    assert [one.outcome for one in again] == ["unchanged", "unchanged", "failed"]
    for count in (0, 10**6):
        with pytest.raises(trajcli.InputError, match="processes: expected 1 to"):
            trajcli.batch([tmp_path], processes=count)


def test_wrong_input_is_one_error(tmp_path: Path) -> None:
    with pytest.raises(trajcli.InputError, match="by which limits"):
        trajcli.retime(tmp_path / "none.csv")
    with pytest.raises(trajcli.FileError):
        trajcli.resample(tmp_path / "none.csv", 10)
    with pytest.raises(trajcli.InputError, match="pictures"):
        trajcli.plot(JOB, tmp_path / "a.xyz")
    assert not list(tmp_path.iterdir())


def test_what_a_format_cannot_hold_is_told_where_it_is_written(tmp_path: Path) -> None:
    (tmp_path / "rows.csv").write_text("t,q1,move\n0,0,0\n1,1,0\n2,0,1\n")
    motion = trajcli.resample(tmp_path / "rows.csv", 2)
    assert motion.save(tmp_path / "rows.jsonl") == ()
    (note,) = motion.save(tmp_path / "rows.mcap")
    assert "move" in note
    assert (tmp_path / "rows.mcap").read_bytes()[1:5] == b"MCAP"


@pytest.mark.parametrize("meshes", [float("inf"), float("nan"), -0.5, "1", None])
def test_a_length_of_meshes_is_a_number(meshes: object, tmp_path: Path) -> None:
    with pytest.raises(trajcli.InputError, match="meshes: expected megabytes, 0 at least, got"):
        trajcli.view(JOB, tmp_path / "a.html", meshes=meshes)  # type: ignore[arg-type]
    assert not list(tmp_path.iterdir())


def test_a_message_about_other_joints_is_not_drawn_over_a_job(tmp_path: Path) -> None:
    points = "points:\n- {positions: [0.5], time_from_start: {sec: 1}}\n"
    goal, picture = tmp_path / "goal.yaml", tmp_path / "a.svg"
    goal.write_text(f"joint_names: [j1]\n{points}")
    trajcli.plot(EXAMPLES / "cubic.yaml", picture, over=goal)
    picture.unlink()
    goal.write_text(f"joint_names: [elbow]\n{points}")
    with pytest.raises(trajcli.InputError, match="there is no joint 'j1'"):
        trajcli.plot(EXAMPLES / "cubic.yaml", picture, over=goal)
    assert not picture.exists()


def test_a_batch_writes_the_format_that_is_asked_for(tmp_path: Path) -> None:
    job = EXAMPLES / "cubic.yaml"
    (one,) = trajcli.batch(job, tmp_path, form="jsonl", processes=1)
    trajcli.plan(job).save(tmp_path / "direct.jsonl")
    assert Path(one.job.output) == tmp_path / "cubic.jsonl"
    assert (tmp_path / "cubic.jsonl").read_bytes() == (tmp_path / "direct.jsonl").read_bytes()
