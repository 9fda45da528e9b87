"""What a batch does with one job: when its rows are planned anew, and what they are made of."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from trajcli.batches import task
from trajcli.batches.jobs import BatchJob
from trajcli.batches.task import BatchSetup, JobOutcome, Task, run_task
from trajcli.errors import FileError, InputError, PlanningError, VerificationError
from trajcli.streams.table import read_csv

HEAD = "version: 1\nunits: {angle: deg}\n"
MOVES = "start: {joints: 0}\nmoves: [{planner: quintic, to: {joints: 30}, duration: 1}]\n"
ROWS = "output: {rate: 10, start_time: 2, columns: [t, q]}\n"
ARM = "joints: [{velocity: 2, acceleration: 40, jerk: 400}]\n"
LIMITS = "joint_limits: {j1: {has_velocity_limits: true, max_velocity: 1.9}}\n"
CSV = BatchSetup("csv", {})


@pytest.fixture
def job(tmp_path: Path) -> BatchJob:
    """A job that names two files, one of them not below its folder; its rows go to a folder that is not there."""
    for name, text in (
        ("arms/arm.yaml", ARM),
        ("cell/limits.yaml", LIMITS),
        (
            "cell/a.yaml",
            f"{HEAD}robot: {{file: ../arms/arm.yaml}}\nlimits: {{file: limits.yaml}}\n{MOVES}{ROWS}",
        ),
    ):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    return BatchJob(str(tmp_path / "cell/a.yaml"), str(tmp_path / "out/deep/a.csv"))


def test_rows_are_the_quintic_and_the_entry_says_of_what(job: BatchJob) -> None:
    outcome = run_task(Task(job, None), CSV)
    assert (outcome.outcome, outcome.exit_code, outcome.output, outcome.duration) == (
        "written",
        0,
        job.output,
        1.0,
    )
    assert outcome.entry is not None
    assert outcome.entry.files == ("../arms/arm.yaml", "limits.yaml")
    assert outcome.entry.inputs == outcome.inputs
    t, q = read_csv(job.output).columns.T
    s = np.linspace(0, 1, 11)
    np.testing.assert_allclose(t, 2 + s, atol=1e-9)
    np.testing.assert_allclose(q, 30 * (10 * s**3 - 15 * s**4 + 6 * s**5), atol=1e-8)
    os.utime(job.output, (1e9, 1e9))
    again = run_task(Task(job, outcome.entry), CSV)
    assert Path(job.output).stat().st_mtime == 1e9
    assert again == replace(outcome, outcome="unchanged", seconds=again.seconds)


def touched(name: str) -> Callable[[Path], None]:
    def touch(folder: Path) -> None:
        with (folder / name).open("a", encoding="utf-8") as file:
            file.write("# changed\n")

    return touch


CHANGES: dict[str, Callable[[Path], None]] = {
    **{
        name: touched(name) for name in ("cell/a.yaml", "arms/arm.yaml", "cell/limits.yaml", "out/deep/a.csv")
    },
    "no rows": lambda folder: (folder / "out/deep/a.csv").unlink(),
}


@pytest.mark.parametrize("change", CHANGES)
def test_whatever_of_it_changes_it_is_planned_again(change: str, job: BatchJob, tmp_path: Path) -> None:
    first = run_task(Task(job, None), CSV)
    CHANGES[change](tmp_path)
    second = run_task(Task(job, first.entry), CSV)
    assert second.outcome == "written"
    assert run_task(Task(job, second.entry), CSV).outcome == "unchanged"


def test_an_entry_counts_from_any_folder(
    job: BatchJob, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = run_task(Task(job, None), CSV)
    for folder in ("cell", "arms"):
        monkeypatch.chdir(tmp_path / folder)
        named = BatchJob(os.path.relpath(job.job), os.path.relpath(job.output))
        assert run_task(Task(named, first.entry), CSV).outcome == "unchanged"
        assert run_task(Task(named, None), CSV).entry == first.entry


SETUPS = [
    BatchSetup(form, {}, rows, consumer, strict)  # type: ignore[arg-type]
    for form in ("csv", "jsonl")
    for rows in (None, "knots", "both")
    for consumer in (None, "ros-jtc")
    for strict in (False, True)
]


def test_all_that_a_batch_says_of_rows_is_part_of_what_they_are_made_of(job: BatchJob) -> None:
    first = run_task(Task(job, None), CSV)
    assert len({setup.said for setup in SETUPS}) == len(SETUPS)
    for setup in SETUPS[1:6]:
        if setup.consumer is None:
            assert run_task(Task(job, first.entry), setup).outcome == "written"


def test_a_batch_says_at_which_times_rows_stand_and_for_whom(job: BatchJob) -> None:
    counts = {}
    for rows in (None, "knots", "both"):
        assert run_task(Task(job, None), BatchSetup("csv", {}, rows)).outcome == "written"
        counts[rows] = len(read_csv(job.output).columns)
    assert counts == {None: 11, "knots": 2, "both": 11}
    both = run_task(Task(job, None), BatchSetup("csv", {}, "both"))
    assert run_task(Task(job, both.entry), BatchSetup("csv", {}, "both")).outcome == "unchanged"
    unknown = run_task(Task(job, None), BatchSetup("csv", {}, consumer="nobody"))
    assert (unknown.outcome, unknown.exit_code) == ("failed", InputError.exit_code)


LOOSER = "limits: {velocity: 200}\n"  # an event: 200 deg/s instead of 2 rad/s
FAILURES = [
    (f"{HEAD}robot: {{file: ../arms/none.yaml}}\n{MOVES}", False, FileError.exit_code, "none.yaml"),
    (f"{HEAD}robot: 1\n", False, InputError.exit_code, "robot"),
    (f"{HEAD}robot: {{joints: [{{velocity: 1}}]}}\n{MOVES}", False, VerificationError.exit_code, "velocity"),
    (
        f"{HEAD}robot: ur5e\nstart: {{joints: 0}}\nmoves: [{{planner: jerk_limited, to: {{xyz: [9, 0, 0]}}}}]\n",
        False,
        PlanningError.exit_code,
        "reach",
    ),
    (
        f"{HEAD}robot: {{file: ../arms/arm.yaml}}\n{LOOSER}{MOVES}",
        True,
        VerificationError.exit_code,
        "looser",
    ),
]


@pytest.mark.parametrize(("text", "strict", "code", "said"), FAILURES)
def test_a_job_that_fails_has_the_code_of_its_plan_and_no_rows(
    text: str, strict: bool, code: int, said: str, job: BatchJob, tmp_path: Path
) -> None:
    Path(job.job).write_text(text, encoding="utf-8")
    outcome = run_task(Task(job, None), BatchSetup("csv", {}, strict=strict))
    assert (outcome.outcome, outcome.exit_code, outcome.remains) == ("failed", code, True)
    assert (outcome.output, outcome.entry, outcome.duration) == (None, None, None)
    assert any(said in problem.text() for problem in outcome.problems)
    assert not (tmp_path / "out").exists() or not Path(job.output).exists()
    if strict:
        assert run_task(Task(job, None), CSV).outcome == "written"


def test_a_job_does_not_read_what_the_batch_writes(job: BatchJob, tmp_path: Path) -> None:
    """The owner is found by the real path of what the job names."""
    (tmp_path / "link").symlink_to(tmp_path / "arms")
    text = Path(job.job).read_text(encoding="utf-8")
    Path(job.job).write_text(text.replace("../arms/", "../link/"), encoding="utf-8")
    owners = {os.path.realpath(tmp_path / "arms/arm.yaml"): "b.yaml"}
    outcome = run_task(Task(job, None), BatchSetup("csv", owners))
    assert outcome.exit_code == InputError.exit_code
    assert "is the output of b.yaml in this batch" in outcome.problems[0].text()


def test_a_library_that_is_missing_is_no_bug(job: BatchJob, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object, **__: object) -> None:
        raise ModuleNotFoundError("No module named 'ruckig'", name="ruckig")

    monkeypatch.setattr(task, "delivered", broken)
    outcome: JobOutcome = run_task(Task(job, None), CSV)
    assert outcome.exit_code != task.BUG
    assert "ruckig" in outcome.problems[0].text()


def test_files_of_a_job_are_named_from_its_folder(job: BatchJob, tmp_path: Path) -> None:
    """One that the job names by its whole path, and that is not below its folder, stays as it is."""
    other = tmp_path / "arms/arm.yaml"
    text = Path(job.job).read_text(encoding="utf-8")
    Path(job.job).write_text(text.replace("../arms/arm.yaml", str(other)), encoding="utf-8")
    outcome = run_task(Task(job, None), CSV)
    assert outcome.entry is not None
    assert outcome.entry.files == (str(other), "limits.yaml")
    assert run_task(Task(job, outcome.entry), CSV).outcome == "unchanged"
