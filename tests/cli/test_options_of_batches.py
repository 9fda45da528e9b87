"""`trajcli batch`: its options do what they do to `trajcli plan`, and its lines say what came of each job."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import pytest
from running import FAST, IMPOSSIBLE, JOB, SLOWED, call

from trajcli.cli.batch import timeout_of
from trajcli.cli.motion_commands import BatchCommand

Capture = pytest.CaptureFixture[str]
TIMED = JOB.replace("duration: 1}", "duration: 1.03}").replace(
    "velocity: 90", "velocity: 90, acceleration: 400"
)

MOVE = "  - {planner: quintic, to: {joints: 0}, duration: 0.25}\n"


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def write(**texts: str) -> None:
    for name, text in texts.items():
        Path(f"{name}.yaml").write_text(text, encoding="utf-8")


def outcomes(out: str) -> dict[str, dict[str, Any]]:
    return {Path(one["job"]).stem: one for one in map(json.loads, out.splitlines())}


@pytest.mark.parametrize("words", [("--rows", "knots"), ("--for", "ros-jtc")])
def test_rows_are_those_of_plan(words: tuple[str, ...], capfd: Capture) -> None:
    write(a=TIMED)
    assert call(capfd, "plan", "a.yaml", "-o", "plan.csv", *words).code == 0
    assert call(capfd, "plan", "a.yaml", "-o", "plain.csv").code == 0
    assert call(capfd, "batch", "a.yaml", *words).code == 0
    assert Path("a.csv").read_bytes() == Path("plan.csv").read_bytes() != Path("plain.csv").read_bytes()


def test_what_is_unchanged_is_planned_where_that_is_asked_for(capfd: Capture) -> None:
    write(a=JOB)
    found = [outcomes(call(capfd, "batch", "a.yaml", *words).out)["a"] for words in ((), (), ("--force",))]
    assert [one["outcome"] for one in found] == ["written", "unchanged", "written"]
    assert [(one["duration"], one["output"]) for one in found] == [(1.0, "a.csv")] * 3
    assert len({one["hash"] for one in found}) == 1
    assert len(found[0]["hash"]) == 64


def test_as_many_processes_as_are_allowed(capfd: Capture) -> None:
    write(a=JOB)
    assert call(capfd, "batch", "a.yaml", "-j", "1024").code == 0
    assert call(capfd, "batch", "a.yaml", "-j", "1025").code == 2


def test_no_time_is_all_the_time(capfd: Capture) -> None:
    write(a=JOB)
    assert call(capfd, "batch", "a.yaml", "--timeout", "0", "-j", "1").code == 0
    times = [timeout_of(BatchCommand(timeout=text)) for text in (None, "0", "2.5")]
    assert times == [600.0, None, 2.5]


def test_a_job_that_fails_has_a_line_of_its_own_and_the_worst_code_counts(capfd: Capture) -> None:
    """Two moves over their limit, one that is impossible, and one that is done, in whatever order they come."""
    write(good=JOB, fast=FAST.replace("output:", MOVE + "output:"), never=IMPOSSIBLE)
    code, out, err = call(capfd, "batch", "good.yaml", "fast.yaml", "never.yaml", "-o", "out", "-j", "1")
    found = outcomes(out)
    assert (code, {name: one["exit"] for name, one in found.items()}) == (
        3,
        {"good": 0, "fast": 1, "never": 3},
    )
    assert {name: one["output"] for name, one in found.items()} == {
        "good": "out/good.csv",
        "fast": None,
        "never": None,
    }
    assert [problem["move"] for problem in found["fast"]["problems"]] == [0, 1]
    assert found["fast"]["error"].endswith("(and 1 more)")
    assert "more)" not in found["never"]["error"]
    said = err.splitlines()
    assert [line for line in said if line.startswith("fast.yaml: failed: ")]
    assert [line for line in said if line.startswith("never.yaml: failed: ")]
    assert said[-1].startswith("3 jobs: 2 failed, 1 written, ")
    assert "stale" not in err


def test_errors_of_a_batch_for_machines_are_of_their_classes(capfd: Capture) -> None:
    twice = FAST.replace("output:", MOVE + "output:")
    write(fast=twice, never=IMPOSSIBLE, wrong=JOB.replace("rate", "rte"))
    words = ("batch", "fast.yaml", "never.yaml", "wrong.yaml", "-o", "out", "-j", "1", "--errors", "json")
    code, _, err = call(capfd, *words)
    kinds = {
        each["exit"]: each["error"]
        for each in map(json.loads, filter(lambda t: t[0] == "{", err.splitlines()))
    }
    (both,) = [
        each for each in map(json.loads, filter(lambda t: t[0] == "{", err.splitlines())) if each["exit"] == 1
    ]
    assert [problem["move"] for problem in both["problems"]] == [0, 1]
    assert (code, kinds) == (3, {1: "VerificationError", 2: "InputError", 3: "PlanningError"})


def test_a_job_with_an_event_fails_where_that_is_asked_for(capfd: Capture) -> None:
    write(slowed=SLOWED)
    assert call(capfd, "batch", "slowed.yaml", "-o", "a").code == 0
    assert call(capfd, "batch", "slowed.yaml", "-o", "b", "--strict").code == 1


def test_quiet_says_nothing_of_what_was_written(capfd: Capture) -> None:
    write(a=JOB)
    assert call(capfd, "batch", "a.yaml", "-q").err == ""
    assert call(capfd, "batch", "a.yaml").err.startswith("1 job: 1 unchanged, ")


def test_folders_without_jobs_are_named(capfd: Capture) -> None:
    Path("jobs").mkdir()
    write(**{f"jobs/n{k}": "a: 1\n" for k in range(7)}, **{"jobs/a": JOB})
    err = call(capfd, "batch", "jobs", "-o", "out").err
    assert (
        "no jobs, left out: jobs/n0.yaml, jobs/n1.yaml, jobs/n2.yaml, jobs/n3.yaml, jobs/n4.yaml and 2 more\n"
        in err
    )


def test_people_read_words_and_the_reasons_behind_all_of_them(
    capfd: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    write(good=JOB, fast=FAST)
    monkeypatch.setattr("trajcli.cli.batch.is_terminal", lambda stream: stream is sys.stdout)
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.delenv("NO_COLOR", raising=False)
    code, out, err = call(capfd, "batch", "good.yaml", "fast.yaml", "-o", "out", "-j", "1")
    assert (code, len(out.splitlines())) == (1, 2)
    words = {" ".join(line.split()) for line in out.splitlines()}
    assert words == {"\x1b[1;32mwritten \x1b[0m good.yaml 1 s", "\x1b[1;31mfailed \x1b[0m fast.yaml"}
    assert err.startswith("fast.yaml: failed: move 0 (quintic): the velocity of j1 reaches 225 deg/s")


@pytest.mark.parametrize(
    ("jobs", "words", "count", "timeout"),
    [
        (2, (), 2, 600),
        (5, (), 3, 600),
        (5, ("-j", "4"), 4, 600),
        (5, ("-j", "1", "--timeout", "7.5"), 1, 7.5),
        (1, ("-j", "9", "--timeout", "0"), 1, None),
    ],
)
def test_as_many_processes_work_as_there_are_jobs_cores_or_as_are_named(
    jobs: int,
    words: tuple[str, ...],
    count: int,
    timeout: float | None,
    capfd: Capture,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """On a machine of three cores."""
    begun: list[tuple[int, int, float | None]] = []

    def run_in_processes(tasks: Any, setup: Any, count: int, timeout: float | None, on_tick: Any) -> Any:
        begun.append((len(tasks), count, timeout))
        on_tick()
        yield from ()

    monkeypatch.setattr("trajcli.batches.processes.usable_cores", lambda: 3)
    monkeypatch.setattr("trajcli.batches.processes.run_in_processes", run_in_processes)
    write(**{f"job{k}": JOB for k in range(jobs)})
    assert call(capfd, "batch", ".", *words).code == 0
    assert begun == [(jobs, count, timeout)]


def test_the_scheduler_is_the_one_that_is_named(capfd: Capture, monkeypatch: pytest.MonkeyPatch) -> None:
    reached: list[Any] = []

    def run_on_cluster(tasks: Any, setup: Any, address: Any, on_tick: Any) -> Any:
        reached.append((len(tasks), address))
        yield from ()

    monkeypatch.setattr("trajcli.batches.cluster.run_on_cluster", run_on_cluster)
    write(a=JOB)
    for words in ((), ("--scheduler", "tcp://there:1")):
        assert call(capfd, "batch", "a.yaml", "--engine", "dask", *words).code == 0
    assert reached == [(1, None), (1, "tcp://there:1")]
