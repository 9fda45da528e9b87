"""`trajcli sweep`: order and values of its rows, its exit code, and what it says of them."""

from __future__ import annotations

import csv
import io
import json
import random
from pathlib import Path

import pytest
from running import JOB, call

from trajcli.batches.jobs import BatchJob
from trajcli.batches.task import JobOutcome, SweepPoint
from trajcli.errors import Problem

Capture = pytest.CaptureFixture[str]


@pytest.fixture(autouse=True)
def job(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    path = Path("job.yaml")
    path.write_text(JOB, encoding="utf-8")
    return path


def rows_of(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text)))


DURATION = "moves.0.duration=1,0.5,0,0.25"
TO = "moves.0.to.joints=[10],[30]"
"""A quintic over d in T has its peak at 15/8 d / T, and the limit is 90 deg/s: 30 in 0.5 s reach 112.5."""


@pytest.mark.parametrize("count", ["1", "2"])
def test_rows_are_all_combinations_in_order_and_the_code_is_that_of_strict(
    count: str, capfd: Capture
) -> None:
    words = ("sweep", "job.yaml", "--vary", DURATION, "--vary", TO, "-j", count)
    code, out, err = call(capfd, *words)
    rows = rows_of(out)
    values = [(row["moves.0.duration"], row["moves.0.to.joints"]) for row in rows]
    assert values == [(time, to) for time in ("1", "0.5", "0", "0.25") for to in ("[10]", "[30]")]
    for row, (time, to) in zip(rows, values, strict=True):
        peak = 15 / 8 * float(to[1:-1]) / float(time) if time != "0" else None
        assert row["verdict"] == ("input" if peak is None else "verified" if peak <= 90 else "exceeded")
        assert row["duration"] == ("" if peak is None else time)
    assert code == 0
    assert err.startswith("8 rows: ")
    lines = err.splitlines()[1:]
    assert [line.split(":")[0] for line in lines] == [
        "  exceeded at moves.0.duration=0.5, moves.0.to.joints=[30]",
        "  input at moves.0.duration=0, moves.0.to.joints=[10]",
    ]
    assert "the velocity of j1 reaches 112.5 deg/s" in lines[0]
    assert "112.5" not in lines[1]
    assert call(capfd, *words, "--strict", "-q") == (1, out, "")


def test_strict_accepts_rows_that_are_all_verified(capfd: Capture) -> None:
    outcome = call(capfd, "sweep", "job.yaml", "--vary", "moves.0.duration=1,2", "--strict", "-j", "1")
    assert outcome.code == 0
    assert outcome.err.count("\n") == 1
    one = call(capfd, "sweep", "job.yaml", "--vary", "moves.0.duration=1,0", "--strict", "-q", "-j", "1")
    assert (one.code, rows_of(one.out)[1]["verdict"]) == (1, "input")


@pytest.mark.parametrize(
    ("best", "said"),
    [
        ("duration", "best duration: 0.5 at moves.0.duration=0.5, moves.0.to.joints=[10]"),
        ("-duration", "best duration: 2 at moves.0.duration=2, moves.0.to.joints=[10]"),
    ],
)
def test_the_best_row_is_said_where_the_rows_are_not(best: str, said: str, capfd: Capture) -> None:
    words = (
        "sweep",
        "job.yaml",
        "--vary",
        "moves.0.duration=1,0.5,2",
        "--vary",
        TO,
        "-j",
        "1",
        "--best",
        best,
    )
    outcome = call(capfd, *words, "-q")
    assert (outcome.code, outcome.err) == (0, f"{said}\n")
    assert len(rows_of(outcome.out)) == 6
    saved = call(capfd, *words, "-q", "-o", "table.csv")
    assert (saved.out, saved.err) == (f"{said}\n", "")
    assert Path("table.csv").read_text(encoding="utf-8") == outcome.out


def test_points_are_drawn_by_the_seed(capfd: Capture) -> None:
    words = ("sweep", "job.yaml", "--vary", "moves.0.duration=1..2:1000", "--samples", "3", "-q", "-j", "1")
    tables = [
        call(capfd, *words, *seed).out for seed in ((), ("--seed", "0"), ("--seed", "7"), ("--seed", "7"))
    ]
    assert [len(rows_of(table)) for table in tables] == [3] * 4
    assert tables[0] == tables[1] != tables[2] == tables[3]
    for seed, table in ((0, tables[0]), (7, tables[2])):  # one of each third, by Python's generator
        chance = random.Random(seed)
        drawn = [chance.randrange(part * 1000 // 3, (part + 1) * 1000 // 3) for part in range(3)]
        found = [float(row["moves.0.duration"]) for row in rows_of(table)]
        assert found == pytest.approx([1 + number / 999 for number in drawn], rel=1e-12)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("-o", "job.yaml"), "table"),
        (("--plot", "robot.svg"), "the picture"),
        (("-o", "limits.csv"), "the table"),
        (("--samples", "²"), "expects a whole number"),
        (("--seed", "-1", "--samples", "2"), "expects a whole number"),
    ],
)
def test_what_was_read_is_not_overwritten(
    words: tuple[str, ...], said: str, job: Path, capfd: Capture
) -> None:
    Path("robot.svg").write_text("joints: [{velocity: 2}]\n", encoding="utf-8")
    Path("limits.csv").write_text("joint_limits: {j1: {max_velocity: 1.0}}\n", encoding="utf-8")
    text = JOB.replace("{joints: [{velocity: 90}]}", "{file: robot.svg}\nlimits: {file: limits.csv}")
    job.write_text(text, encoding="utf-8")
    outcome = call(capfd, "sweep", "job.yaml", "--vary", "moves.0.duration=1,2", "-j", "1", *words)
    assert (outcome.code, outcome.out) == (2, "")
    assert said in outcome.err
    assert job.read_text(encoding="utf-8") == text
    assert Path("limits.csv").read_text(encoding="utf-8").startswith("joint_limits")


def test_points_that_take_too_long_are_no_rows_and_have_their_code(
    capfd: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By a clock that goes on by a thousand seconds whenever somebody looks at it."""
    ticks = iter(range(0, 10**9, 1000))
    monkeypatch.setattr("trajcli.batches.processes.monotonic", lambda: float(next(ticks)))
    monkeypatch.setattr("trajcli.batches.processes.wait", lambda *_: [])
    words = ("sweep", "job.yaml", "--vary", "moves.0.duration=1,2", "-j", "1", "--timeout", "5", "-q")
    outcome = call(capfd, *words)
    assert outcome.code == 3
    assert rows_of(outcome.out) == []
    assert outcome.err.count("it was not done within 5 s") == 2


def test_all_that_is_wrong_with_a_point_without_a_row_is_said_in_the_form_that_is_asked_for(
    capfd: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    problems = (Problem("the rail is bent"), Problem("the oil is cold"))
    failed = JobOutcome(BatchJob("job.yaml", "0"), "crashed", 70, problems)
    done = JobOutcome(BatchJob("job.yaml", "1"), "written", point=SweepPoint("verified", 2.0))
    monkeypatch.setattr(
        "trajcli.cli.sweep.outcomes_of", lambda *_: (each for each in [(0, failed), (1, done)])
    )
    words = ("sweep", "job.yaml", "--vary", "moves.0.duration=1,2", "-q")
    said = call(capfd, *words)
    assert (said.code, [row["moves.0.duration"] for row in rows_of(said.out)]) == (70, ["2"])
    assert said.err == "error: the rail is bent\nerror: the oil is cold\n"
    (line,) = call(capfd, *words, "--errors", "json").err.splitlines()
    assert [each["message"] for each in json.loads(line)["problems"]] == [
        "the rail is bent",
        "the oil is cold",
    ]


def test_one_row_is_a_row(capfd: Capture) -> None:
    outcome = call(capfd, "sweep", "job.yaml", "--vary", "moves.0.duration=1", "-j", "1")
    assert (outcome.code, len(rows_of(outcome.out))) == (0, 1)
    assert outcome.err.startswith("1 row: 1 verified, ")


def test_a_job_from_standard_input_is_called_so(capfd: Capture) -> None:
    outcome = call(capfd, "sweep", "-", "--vary", "moves.0.duration=1,2", stdin=JOB + "name: [\n")
    assert (outcome.code, outcome.out) == (2, "")
    assert outcome.err.startswith("<stdin>:")
