"""What a batch asks of Dask, and makes of its answers: a scheduler that is made up, whose worker is this process."""

from __future__ import annotations

import logging
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from trajcli.batches import cluster
from trajcli.batches.jobs import BatchJob
from trajcli.batches.task import JobOutcome, Task
from trajcli.errors import FileError, InputError


class Scheduler:
    """Does what it is asked for at once, and remembers how it was asked."""

    def __init__(self, *answers: Any) -> None:
        self.address, self.loop, self.answers = "tcp://here:1", "loop", list(answers)
        self.tasks: list[Task] = []
        self.keys: list[bool] = []
        self.cancelled: list[Any] = []
        self.closed, self.workers = False, True

    @property
    def scheduler(self) -> Scheduler:
        return self

    def scatter(self, value: Any, broadcast: bool) -> Any:
        if not self.workers:
            raise TimeoutError("No valid workers found")
        assert broadcast
        return value

    def submit(self, function: Callable[..., Any], task: Task, setup: Any, pure: bool) -> Any:
        self.tasks.append(task)
        self.keys.append(pure)
        answer = self.answers[len(self.tasks) - 1]
        if isinstance(answer, str):
            return Future(status=answer)
        if isinstance(answer, Exception):
            return Future(error=answer)
        return Future(value=function(task, setup))

    def cancel(self, futures: Sequence[Any]) -> None:
        self.cancelled += futures

    def close(self) -> None:
        self.closed = True


class Future:
    def __init__(self, status: str = "finished", value: Any = None, error: Exception | None = None) -> None:
        self.status, self._value, self._error = status, value, error

    def result(self) -> Any:
        if self.status == "cancelled":
            raise KeyboardInterrupt  # what Dask raises of it is no error of the job
        if self._error is not None:
            raise self._error
        return self._value


class Setup:
    """Every job is written but those that are called bad; nothing else of the batch runs meanwhile."""

    alone: list[bool]

    def __init__(self) -> None:
        self.alone = []

    def done(self, task: Task, hashed: Any) -> JobOutcome:
        del hashed
        self.alone.append(cluster._ONE_AT_A_TIME.locked())
        if "bad" in task.job.job:
            raise InputError("it is no job")
        return JobOutcome(task.job, "written", output=task.job.output)


def backwards(futures: Sequence[Any], loop: Any) -> Iterator[Any]:
    """Yield futures as they are done: the last one first."""
    assert loop == "loop"
    yield from reversed(futures)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def installed(
    monkeypatch: pytest.MonkeyPatch, connect: Callable[..., Any], configured: str | None = None
) -> None:
    """Put a Dask in place of the one that is installed, or is not."""
    config = SimpleNamespace(get=lambda key, default: {"scheduler-address": configured}.get(key) or default)
    monkeypatch.setitem(sys.modules, "dask", SimpleNamespace(config=config))
    module = SimpleNamespace(Client=connect, as_completed=backwards)
    monkeypatch.setitem(sys.modules, "distributed", module)


def tasks(*names: str) -> list[Task]:
    return [Task(BatchJob(f"{name}.yaml", f"out/{name}.csv"), None) for name in names]


def test_outcomes_come_as_they_are_done_under_the_names_of_the_user(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scheduler, ticks, setup = Scheduler(None, None, None), [], Setup()
    calls: list[tuple[Any, ...]] = []
    installed(monkeypatch, lambda *words, **more: calls.append((words, more)) or scheduler)
    given = tasks("a", "bad", "c")
    done = list(cluster.run_on_cluster(given, setup, "tcp://x:1", lambda: ticks.append(1)))
    assert [one.job for one in done] == [task.job for task in reversed(given)]
    assert [one.output for one in done] == ["out/c.csv", None, "out/a.csv"]
    assert [one.exit_code for one in done] == [0, 2, 0]
    assert len(ticks) == 3
    paths = [(task.job.job, task.job.output) for task in scheduler.tasks]
    assert paths == [(f"{folder}/{name}.yaml", f"{folder}/out/{name}.csv") for name in ("a", "bad", "c")]
    assert (
        scheduler.keys == [False] * 3
    )  # the same job may be planned again: nothing of an earlier batch counts
    assert setup.alone == [True] * 3
    assert not cluster._ONE_AT_A_TIME.locked()
    ((words, more),) = calls
    assert (words, more["set_as_default"]) == (("tcp://x:1",), False)
    assert 1 <= more["timeout"] <= 60


def test_whatever_the_cluster_says_costs_one_job(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert folder
    scheduler = Scheduler("cancelled", OSError("lost"), None)
    installed(monkeypatch, lambda *_, **__: scheduler)
    third, second, first = cluster.run_on_cluster(tasks("a", "b", "c"), Setup(), "tcp://x:1")
    assert (third.outcome, third.exit_code) == ("written", 0)
    for outcome, said in ((second, "OSError: lost"), (first, "its task was cancelled")):
        assert (outcome.outcome, outcome.exit_code, outcome.output) == ("crashed", 70, None)
        assert outcome.problems[0].text() == f"the cluster could not plan it: {said}"
    assert (second.job.job, first.job.job) == ("b.yaml", "a.yaml")


def test_what_has_not_begun_is_cancelled_where_nobody_wants_more(monkeypatch: pytest.MonkeyPatch) -> None:
    scheduler = Scheduler(None, None)
    installed(monkeypatch, lambda *_, **__: scheduler)
    outcomes = cluster.run_on_cluster(tasks("a", "b"), Setup(), "tcp://x:1")
    next(outcomes)
    assert (scheduler.cancelled, scheduler.closed) == ([], False)
    outcomes.close()
    assert (len(scheduler.cancelled), scheduler.closed) == (2, True)


@pytest.mark.parametrize(
    ("named", "configured", "meant"),
    [
        ("tcp://a:1", None, "tcp://a:1"),
        (None, "tcp://b:1", "tcp://b:1"),
        ("tcp://a:1", "tcp://b:1", "tcp://a:1"),
    ],
)
def test_the_scheduler_is_the_one_that_is_named_then_the_one_of_the_configuration(
    named: str | None, configured: str | None, meant: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    reached = []
    installed(monkeypatch, lambda address, **_: reached.append(address) or Scheduler(), configured)
    assert list(cluster.run_on_cluster([], Setup(), named)) == []
    assert reached == [meant]


def test_without_an_address_nothing_is_reached(monkeypatch: pytest.MonkeyPatch) -> None:
    installed(monkeypatch, lambda *_, **__: pytest.fail("a scheduler nobody named"))
    with pytest.raises(InputError, match="needs the address of a scheduler") as refused:
        next(cluster.run_on_cluster([], Setup(), None))
    assert "--scheduler" in (refused.value.problems[0].hint or "")


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (OSError("no route"), "no route"),
        (ValueError("unknown scheme"), "unknown scheme"),
        (TypeError("no port"), "no port"),
        (TimeoutError(), "TimeoutError"),
    ],
)
def test_a_scheduler_that_cannot_be_reached_is_named_with_the_reason(
    error: Exception, said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def connect(*_: Any, **__: Any) -> Any:
        raise error

    installed(monkeypatch, connect)
    with pytest.raises(FileError, match=f"the scheduler x:1 cannot be reached: {said}$"):
        next(cluster.run_on_cluster([], Setup(), "x:1"))
    assert not logging.getLogger("distributed.client").isEnabledFor(logging.ERROR)


def test_a_scheduler_without_workers_is_closed_and_said(monkeypatch: pytest.MonkeyPatch) -> None:
    scheduler = Scheduler()
    scheduler.workers = False
    installed(monkeypatch, lambda *_, **__: scheduler)
    with pytest.raises(FileError, match="tcp://here:1 has no workers: No valid workers") as refused:
        next(cluster.run_on_cluster(tasks("a"), Setup(), "x:1"))
    assert refused.value.problems[0].hint == "`dask worker tcp://here:1` starts one"
    assert scheduler.closed


def test_without_dask_it_says_how_to_install_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match="needs the packages dask and distributed") as refused:
        next(cluster.run_on_cluster([], Setup(), "x:1"))
    assert refused.value.problems[0].hint == "pip install 'trajcli[dask]'"
