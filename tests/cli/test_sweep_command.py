"""`trajcli sweep`: its table, what it says, and that it can be ended and goes on."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import time
from pathlib import Path

import pytest
from running import COMMAND, JOB, call

Capture = pytest.CaptureFixture[str]
VARY = ("--vary", "moves.0.duration=0.25..1:4")
TABLE = """\
moves.0.duration,verdict,duration,tightest,bound
0.25,exceeded,0.25,"velocity of j1 in move 0, 250 % used",
0.5,exceeded,0.5,"velocity of j1 in move 0, 125 % used",
0.75,verified,0.75,"velocity of j1 in move 0, 83.33 % used",
1,verified,1,"velocity of j1 in move 0, 62.5 % used",
"""
"""A quintic over 30 deg in T is fastest at 15/8 of 30 / T; the limit is 90 deg/s, without one of acceleration."""


@pytest.fixture
def job(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("job.yaml").write_text(JOB)
    return Path("job.yaml")


@pytest.mark.full
def test_the_table_goes_to_standard_output(job: Path, capfd: Capture) -> None:
    code, out, err = call(capfd, "sweep", job, *VARY, "-j", "1")
    assert (code, out) == (0, TABLE)
    first, reason = err.splitlines()
    assert first.startswith("4 rows: 2 exceeded, 2 verified, ")
    assert reason.startswith("  exceeded at moves.0.duration=0.25: the velocity of j1 reaches 225 deg/s")
    code, out, err = call(capfd, "sweep", job, *VARY, "-j", "2", "--strict", "-q")
    assert (code, out, err) == (1, TABLE, "")
    assert call(capfd, "sweep", "-", *VARY, "-q", stdin=JOB).out == TABLE


def test_files_and_the_best_row(job: Path, capfd: Capture, monkeypatch: pytest.MonkeyPatch) -> None:
    words = ("sweep", job, *VARY, "-o", "table.csv", "--best", "duration", "--plot", "curve.svg")
    code, out, _ = call(capfd, *words)
    assert (code, out) == (0, "best duration: 0.75 at moves.0.duration=0.75\n")
    assert Path("table.csv").read_text() == TABLE
    assert Path("curve.svg").read_bytes().startswith(b"<?xml")

    def never(*_: object) -> None:
        raise AssertionError("a point is planned")

    monkeypatch.setattr("trajcli.batches.task.run_task", never)
    monkeypatch.setattr("trajcli.batches.processes.run_task", never)
    assert call(capfd, *words, "-q") == (0, out, "")
    assert Path("table.csv").read_text() == TABLE
    code, out, err = call(capfd, "sweep", job, *VARY, "-o", "table.csv", "--force", "-q")
    assert (code, out) == (70, "")
    assert err.count("error: the process that planned it ended") == 4


def test_json_lines_and_a_map(job: Path, capfd: Capture) -> None:
    words = (
        "--vary",
        "moves.0.to.joints=[10],[20]",
        "-o",
        "new/table.jsonl",
        "--plot",
        "map.png",
        "--best",
        "-bound",
    )
    code, out, _ = call(capfd, "sweep", job, "--vary", "moves.0.duration=1,2", *words)
    assert (code, out) == (0, "best bound: no verified row has one\n")
    rows = [json.loads(line) for line in Path("new/table.jsonl").read_text().splitlines()]
    assert [(row["moves.0.duration"], row["moves.0.to.joints"]) for row in rows] == [
        (1, [10]), (1, [20]), (2, [10]), (2, [20])
    ]  # fmt: skip
    assert Path("map.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--vary", "limits.velocty=1,2"], "unknown key 'velocty'"),
        (["--vary", "moves.0.duration=1..2"], "a range needs how many values"),
        ([*VARY, "--seed", "3"], "--seed is about points drawn by chance"),
        ([*VARY, "--samples", "x"], "--samples expects a whole number, got 'x'"),
        ([*VARY, "--samples", "9"], "--samples 9: expected 1 to 4 of 4 combinations"),
        ([*VARY, "-o", "table.xlsx"], "a table is written as .csv or .jsonl"),
        ([*VARY, "--best", "speed"], "there is no column of numbers 'speed'"),
        ([*VARY, "--plot", "a.gif"], "pictures are not written as .gif"),
        ([*VARY, "--engine", "dask", "-j", "2"], "-j is about processes of this machine"),
        ([*VARY, "-j", "0"], "-j expects 1 to 1024 processes"),
    ],
)
def test_what_cannot_be_begun_is_one_error(words: list[str], message: str, job: Path, capfd: Capture) -> None:
    code, out, err = call(capfd, "sweep", job, *words)
    assert (code, out, err.count("error:")) == (2, "", 1)
    assert message in err
    assert [path.name for path in Path().iterdir()] == ["job.yaml"]


def test_a_missing_job_is_4(job: Path, capfd: Capture) -> None:
    assert call(capfd, "sweep", f"{job}.none", *VARY).code == 4
    job.write_text(JOB.replace("{joints: [{velocity: 90}]}", "{file: none.yaml}"))
    code, _, err = call(capfd, "sweep", job, *VARY)
    assert (code, err.count("error:")) == (4, 1)


@pytest.mark.full
def test_a_killed_sweep_goes_on_where_it_was(job: Path, capfd: Capture) -> None:
    varied = ("--vary", "moves.0.duration=1..2:150", "-q")
    words = [*COMMAND, "sweep", str(job), *varied, "-j", "1", "-o", "table.csv"]
    process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    kept, until = Path(".table.csv.sweep.jsonl"), time.monotonic() + 30
    while not kept.exists() or kept.stat().st_size < 1000:
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < until
        time.sleep(0.001)
    os.kill(process.pid, signal.SIGKILL)
    process.communicate(timeout=30)
    assert not Path("table.csv").exists()
    done = kept.read_text().count("\n")
    assert 0 < done < 150
    begun = kept.read_text()
    assert call(capfd, "sweep", job, *varied, "-o", "table.csv").code == 0
    assert kept.read_text().startswith(begun[: begun.rindex("\n") + 1])
    table = Path("table.csv").read_text()
    assert table.count("\n") == 151
    assert call(capfd, "sweep", job, *varied).out == table
