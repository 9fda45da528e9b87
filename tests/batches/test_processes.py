"""Processes of a batch: whatever becomes of one, the others go on, and none is left behind."""

from __future__ import annotations

import multiprocessing
import os
import signal
import time
from contextlib import closing
from itertools import count
from pathlib import Path
from typing import NoReturn

import pytest

from trajcli.batches import processes
from trajcli.batches.jobs import BatchJob
from trajcli.batches.processes import run_in_processes
from trajcli.batches.task import BatchSetup, JobOutcome, Task
from trajcli.streams.whole_file import whole_file

SETUP = BatchSetup("csv", {})


def killed() -> NoReturn:
    os.kill(os.getpid(), signal.SIGKILL)
    raise AssertionError


def endless() -> NoReturn:
    while True:
        time.sleep(0.01)


def stubborn() -> NoReturn:
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    endless()


def half_written() -> NoReturn:
    with whole_file("half.csv") as out:
        out.write(b"t\n")
        out.flush()
        stubborn()
    raise AssertionError


def met() -> None:
    """Wait for another process that does the same at the same time."""
    Path(f"{os.getpid()}.here").touch()
    while len(list(Path().glob("*.here"))) < 2:
        time.sleep(0.005)


DEEDS = {
    "met": met,
    "met again": met,
    "killed": killed,
    "exit": lambda: os._exit(5),
    "gone": lambda: os._exit(0),
    "asked to end": lambda: os.kill(os.getpid(), signal.SIGTERM),
    "endless": endless,
    "stubborn": stubborn,
    "half_written": half_written,
}


def do(task: Task, setup: BatchSetup) -> JobOutcome:
    """Stand for `run_task`: do what the name of the job says."""
    name = task.job.job
    if name == "memory":
        return JobOutcome(task.job, "failed", 70, remains=False, inputs=str(os.getpid()))
    if name in DEEDS:
        DEEDS[name]()
    return JobOutcome(task.job, "written", inputs=str(os.getpid()))


@pytest.fixture(autouse=True)
def _in_processes(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(processes, "run_task", do)  # forked processes have it, too
    monkeypatch.setattr(processes, "_GRACE", 0.3)


def outcomes(*names: str, count: int = 1, timeout: float | None = None) -> dict[str, JobOutcome]:
    tasks = [Task(BatchJob(name, f"{name}.csv"), None) for name in names]
    with closing(run_in_processes(tasks, SETUP, count, timeout)) as done:
        found = {outcome.job.job: outcome for outcome in done}
    assert multiprocessing.active_children() == []
    assert len(found) == len(names)
    return found


def test_one_process_does_all_jobs() -> None:
    found = outcomes("a", "b", "c")
    assert [outcome.outcome for outcome in found.values()] == ["written"] * 3
    assert len({outcome.inputs for outcome in found.values()}) == 1
    assert str(os.getpid()) not in {outcome.inputs for outcome in found.values()}


def test_no_more_processes_than_asked_for_and_than_jobs() -> None:
    found = outcomes(*map(str, range(40)), count=3)
    assert 1 <= len({outcome.inputs for outcome in found.values()}) <= 3


@pytest.mark.parametrize("count", [1, 2])
def test_a_crash_costs_one_job(count: int) -> None:
    found = outcomes("a", "killed", "b", "exit", "c", count=count)
    assert [name for name, outcome in found.items() if outcome.outcome == "crashed"] == [
        "killed",
        "exit",
    ] or count > 1
    assert {name for name, outcome in found.items() if outcome.outcome == "written"} == {"a", "b", "c"}
    assert found["killed"].problems[0].message == "the process that planned it was ended by SIGKILL"
    assert found["exit"].problems[0].message == "the process that planned it ended with exit code 5"
    assert {found["killed"].exit_code, found["exit"].exit_code} == {70}


def test_a_process_that_ends_without_a_word_has_crashed() -> None:
    gone = outcomes("gone")["gone"]
    assert (gone.outcome, gone.exit_code) == ("crashed", 70)
    assert gone.problems[0].message == "the process that planned it ended with exit code 0"


def test_a_process_that_somebody_asks_to_end_says_so_by_its_code() -> None:
    """A shell says 128 + 15 of a program that SIGTERM has ended."""
    (problem,) = outcomes("asked to end")["asked to end"].problems
    assert problem.message == "the process that planned it ended with exit code 143"


def lives(process: int) -> bool:
    """Return whether a process goes on; one that has ended waits for whoever asks for its exit code."""
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def test_processes_end_with_the_one_that_began_them() -> None:
    first = os.fork()
    if first == 0:
        for _ in run_in_processes([Task(BatchJob("endless", "x.csv"), None)], SETUP, 1, None):
            pass
        os._exit(0)
    children, until = Path(f"/proc/{first}/task/{first}/children"), time.monotonic() + 10
    while not children.read_text():
        assert time.monotonic() < until
        time.sleep(0.005)
    (worker,) = map(int, children.read_text().split())
    os.kill(first, signal.SIGKILL)
    os.waitpid(first, 0)
    until = time.monotonic() + 5
    while (left := lives(worker)) and time.monotonic() < until:
        time.sleep(0.005)
    if left:
        os.kill(worker, signal.SIGKILL)
    assert not left


def test_a_process_without_memory_is_replaced() -> None:
    found = outcomes("a", "memory", "b")
    assert found["a"].inputs == found["memory"].inputs != found["b"].inputs


@pytest.mark.full
@pytest.mark.parametrize("name", ["endless", "stubborn"])
def test_what_does_not_end_is_ended(name: str) -> None:
    begun = time.monotonic()
    found = outcomes("a", name, "b", timeout=0.5)
    assert time.monotonic() - begun < 10
    assert (found[name].outcome, found[name].exit_code) == ("timed out", 3)
    assert found[name].problems[0].message == "it was not done within 0.5 s"
    assert found["b"].outcome == "written"


def test_as_many_processes_as_asked_for_work_at_a_time() -> None:
    found = outcomes("met", "met again", count=2, timeout=30.0)
    assert [outcome.outcome for outcome in found.values()] == ["written"] * 2


def test_a_task_is_ended_at_the_first_look_after_its_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """By a clock that goes on by a second whenever somebody looks at it."""
    clock = count()
    monkeypatch.setattr(processes, "monotonic", lambda: float(next(clock)))
    ticks = list[int]()
    tasks = [Task(BatchJob("endless", "x.csv"), None)]
    with closing(run_in_processes(tasks, SETUP, 1, 2.5, lambda: ticks.append(1))) as done:
        (outcome,) = done
    assert (outcome.outcome, outcome.exit_code, outcome.seconds) == ("timed out", 3, 3.0)
    assert len(ticks) == 3


def test_a_process_that_was_killed_while_it_did_nothing_is_replaced() -> None:
    tasks = [Task(BatchJob(name, f"{name}.csv"), None) for name in "ab"]
    with closing(run_in_processes(tasks, SETUP, 1, None)) as done:
        first = next(done)
        (worker,) = multiprocessing.active_children()
        worker.kill()
        worker.join()
        second = next(done)
    assert (second.job.job, second.outcome) == ("b", "written")
    assert first.inputs != second.inputs


def test_an_interrupt_of_a_terminal_is_left_to_the_process_that_gives_tasks() -> None:
    tasks = [Task(BatchJob(name, f"{name}.csv"), None) for name in "ab"]
    with closing(run_in_processes(tasks, SETUP, 1, None)) as done:
        first = next(done)
        os.kill(int(first.inputs or 0), signal.SIGINT)
        second = next(done)
    assert (second.outcome, second.inputs) == ("written", first.inputs)


def test_what_a_killed_process_has_half_written_is_removed() -> None:
    Path(".trajcli-1-other.part").write_text("of another process")
    assert outcomes("half_written", "b", timeout=0.5)["half_written"].outcome == "timed out"
    assert [path.name for path in Path().iterdir()] == [".trajcli-1-other.part"]


def test_closing_early_ends_all() -> None:
    tasks = [Task(BatchJob(name, "x.csv"), None) for name in ("a", "endless", "stubborn", "b")]
    outcomes = run_in_processes(tasks, SETUP, 3, None)
    assert next(outcomes).job.job == "a"
    assert multiprocessing.active_children()
    outcomes.close()
    assert multiprocessing.active_children() == []
