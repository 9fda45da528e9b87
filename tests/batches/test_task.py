"""One job of a batch: whatever is raised becomes its outcome."""

from __future__ import annotations

from pathlib import Path

import pytest

from trajcli.batches import task
from trajcli.batches.jobs import BatchJob
from trajcli.batches.task import BatchSetup, JobOutcome, Task, run_task

JOB = """\
version: 1
units: {angle: deg}
robot: {joints: [{velocity: 90}]}
start: {joints: 0}
moves:
  - {planner: quintic, to: {joints: 30}, duration: 1}
output: {rate: 10, columns: [t, q]}
"""
SETUP = BatchSetup("csv", {})


def outcome_of(error: BaseException, folder: Path, monkeypatch: pytest.MonkeyPatch) -> JobOutcome:
    def broken(*_: object, **__: object) -> None:
        raise error

    (folder / "a.yaml").write_text(JOB)
    monkeypatch.setattr(task, "delivered", broken)
    return run_task(Task(BatchJob(str(folder / "a.yaml"), str(folder / "a.csv")), None), SETUP)


def test_a_bug_is_70_and_the_process_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    outcome = outcome_of(RuntimeError("it broke"), tmp_path, monkeypatch)
    assert (outcome.outcome, outcome.exit_code, outcome.remains) == ("failed", 70, True)
    assert outcome.problems[0].message == "a bug in trajcli: RuntimeError: it broke"
    assert [path.name for path in tmp_path.iterdir()] == ["a.yaml"]


def test_a_process_without_memory_does_not_go_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    outcome = outcome_of(MemoryError(), tmp_path, monkeypatch)
    assert (outcome.outcome, outcome.exit_code, outcome.remains) == ("failed", 70, False)
    assert outcome.problems[0].message == "there is not enough memory"


def test_what_ends_the_process_ends_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(SystemExit):
        outcome_of(SystemExit(143), tmp_path, monkeypatch)


def test_a_file_that_changes_while_it_is_planned_is_planned_next_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot = tmp_path / "arm.yaml"
    robot.write_text("joints: [{velocity: 2}]\n")
    plan = task.delivered

    def slow(loaded: object, *given: object, **named: object) -> object:
        planned = plan(loaded, *given, **named)  # type: ignore[arg-type]
        robot.write_text("joints: [{velocity: 3}]\n")
        return planned

    monkeypatch.setattr(task, "delivered", slow)
    job = BatchJob(str(tmp_path / "a.yaml"), str(tmp_path / "a.csv"))
    Path(job.job).write_text(JOB.replace("{joints: [{velocity: 90}]}", "{file: arm.yaml}"))
    first = run_task(Task(job, None), SETUP)
    assert first.outcome == "written"
    assert run_task(Task(job, first.entry), SETUP).outcome == "written"
    second = run_task(Task(job, None), SETUP)
    assert run_task(Task(job, second.entry), SETUP).outcome == "unchanged"
