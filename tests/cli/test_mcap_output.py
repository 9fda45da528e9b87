"""MCAP on the command line: files, pipes, terminals, comparison."""

from __future__ import annotations

import os
import pty
import subprocess
from pathlib import Path

import numpy as np
import pytest
from running import EXAMPLES, JOB, call, warm
from streams.mcap.conftest import read_mcap

Capture = pytest.CaptureFixture[str]


@pytest.fixture
def job(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "job.yaml"
    path.write_text(JOB)
    return path


def test_a_pipe_gets_what_a_file_holds(job: Path, capfd: Capture) -> None:
    outcome = call(capfd, "plan", job, "-o", "a.mcap", "--compression", "none")
    assert (outcome.code, outcome.out) == (0, "")
    assert "no geometry: the log has no frames, no robot description and no tool path" in outcome.err
    command = [*warm(), "plan", str(job), "--format", "mcap", "--compression", "none"]
    for words in ([], ["-o", "-"], ["-o", "/dev/stdout"]):
        piped = subprocess.run([*command, *words], capture_output=True, check=True)
        assert piped.stdout == Path("a.mcap").read_bytes()
    assert {path.name for path in Path().iterdir()} == {"job.yaml", "a.mcap"}


def test_a_terminal_gets_nothing(job: Path) -> None:
    terminal, side = pty.openpty()
    try:
        command = [*warm(), "plan", str(job), "--format", "mcap"]
        run = subprocess.run(command, stdout=side, stderr=subprocess.PIPE, text=True, check=False)
        os.set_blocking(terminal, False)
        with pytest.raises(BlockingIOError):
            os.read(terminal, 1)
    finally:
        os.close(terminal)
        os.close(side)
    assert run.returncode == 2
    assert run.stderr == "error: MCAP is not written to a terminal\n  name a file with -o\n"


def test_a_plan_that_fails_leaves_no_log(job: Path, capfd: Capture) -> None:
    code = call(capfd, "plan", job, "--set", "moves.0.duration=0.1", "-o", "a.mcap").code
    assert code == 1
    assert {path.name for path in Path().iterdir()} == {"job.yaml"}


def test_diff_compares_logs_with_rows(job: Path, capfd: Capture) -> None:
    columns = ("--set", "output.columns=[t, q, qd, qdd]")
    call(capfd, "plan", job, "-o", "a.mcap", *columns)
    call(capfd, "plan", job, "-o", "late.mcap", "--epoch", "1767225600", *columns)
    call(capfd, "plan", job, "-o", "a.csv", "--digits", "full", *columns)
    assert call(capfd, "diff", "a.mcap", "late.mcap").out.startswith(
        "equal: a.mcap and late.mcap (11 rows, 4"
    )
    assert call(capfd, "diff", "a.csv", "late.mcap", "--atol", "1e-12").code == 0
    other = call(capfd, "plan", job, "-o", "b.mcap", "--set", "moves.0.to.joints=31", *columns)
    assert other.code == 0
    assert call(capfd, "diff", "a.mcap", "b.mcap").code == 1
    Path("a.mcap").rename("log")
    assert call(capfd, "diff", "log", "late.mcap").code == 0
    knots = ("--topic", "/joint_trajectory")
    assert call(capfd, "diff", "log", "late.mcap", *knots).out.startswith(
        "equal: log and late.mcap (2 rows, 4"
    )
    assert call(capfd, "diff", "a.csv", "a.csv", *knots).code == 2
    wrong = call(capfd, "diff", "log", "late.mcap", "--topic", "/joint_trajectories")
    assert wrong.code == 2
    assert "did you mean '/joint_trajectory'?" in wrong.err


def test_columns_of_the_job_do_not_matter_to_a_log(tmp_path: Path, capfd: Capture) -> None:
    example = EXAMPLES / "ur5e_pose_columns.yaml"  # its columns are poses, in mm and deg
    path = tmp_path / "a.mcap"
    assert call(capfd, "plan", example, "-o", path).code == 0
    motion = read_mcap(path)
    assert motion.position.shape == motion.velocity.shape == motion.acceleration.shape
    assert np.abs(motion.position).max() < 2 * np.pi
