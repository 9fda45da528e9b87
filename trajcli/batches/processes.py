"""Processes that plan the jobs of a batch: one a core, each replaced where it ends, none left behind."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
from collections import deque
from collections.abc import Callable, Generator, Sequence
from multiprocessing.connection import Connection, Pipe, wait
from pathlib import Path
from threading import Thread
from time import monotonic
from typing import Any, NoReturn

from trajcli.batches.task import BUG, JobOutcome, Setup, Task, run_task
from trajcli.errors import PlanningError, Problem
from trajcli.streams.whole_file import remove_unfinished

MOST_PROCESSES = 1024
_TICK = 0.2  # s between two looks at the clock
_GRACE = 2.0  # s for a process to remove what is half written, before it is killed


def usable_cores() -> int:
    """Return on how many cores this process may run."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


class _Worker:
    """A process that does one task after the other, and the task that it does now."""

    def __init__(self, context: Any, setup: Setup, lifeline: tuple[Connection, Connection]) -> None:  # noqa: ANN401
        self.connection, theirs = Pipe()
        self.process = context.Process(target=_work, args=(theirs, lifeline, setup), daemon=True)
        self.process.start()
        theirs.close()  # ours was the only other end: where the process ends, reading ends, too
        self.task: Task | None = None
        self.begun = 0.0

    def give(self, task: Task) -> None:
        """Let it do a task."""
        self.connection.send(task)
        self.task, self.begun = task, monotonic()

    def outcome(self) -> JobOutcome | None:
        """Return what came of its task; None where the process has ended without saying."""
        try:
            received: JobOutcome = self.connection.recv()
        except (EOFError, OSError):
            return None
        self.task = None
        return received

    def end(self) -> None:
        """End the process, and remove what it has half written."""
        self.process.terminate()
        self.process.join(_GRACE)
        if self.process.is_alive():
            self.process.kill()
            self.process.join()
        self.connection.close()
        if self.task is not None and self.process.pid is not None:
            remove_unfinished(Path(self.task.job.output).parent, self.process.pid)


def run_in_processes(
    tasks: Sequence[Task],
    setup: Setup,
    count: int,
    timeout: float | None,
    on_tick: Callable[[], None] = lambda: None,
) -> Generator[JobOutcome, None, None]:
    """Yield the outcomes of tasks in the order in which they are done.

    A process that crashes, is killed or takes too long costs its own job only: another takes its place.
    Closing the generator ends all processes.

    Args:
        tasks: Each is done once.
        setup: What they share.
        count: The number of processes.
        timeout: s for one task; None for no limit.
        on_tick: Called a few times a second.
    """
    workers = _Workers(setup, timeout)
    waiting = deque(tasks)
    try:
        while waiting or workers.busy:
            workers.give(waiting, count)
            ready = wait([worker.connection for worker in workers.busy], _TICK)
            on_tick()
            for worker in workers.busy:
                outcome = workers.outcome(worker, ready=worker.connection in ready)
                if outcome is not None:
                    yield outcome
    finally:
        workers.end()


class _Workers:
    """The processes that are alive."""

    def __init__(self, setup: Setup, timeout: float | None) -> None:
        self._setup, self._timeout = setup, timeout
        self._context, self._lifeline = _context(), Pipe(duplex=False)
        self._all: list[_Worker] = []

    @property
    def busy(self) -> list[_Worker]:
        """Those that do a task."""
        return [worker for worker in self._all if worker.task is not None]

    def give(self, waiting: deque[Task], count: int) -> None:
        """Let each of `count` processes do a task, as long as there are tasks."""
        while waiting and len(self.busy) < count:
            idle = next((worker for worker in self._all if worker.task is None), None)
            if idle is None:
                idle = _Worker(self._context, self._setup, self._lifeline)
                self._all.append(idle)
            try:
                idle.give(waiting[0])
            except OSError:  # somebody has killed it while it did nothing
                self._remove(idle)
                continue
            waiting.popleft()

    def outcome(self, worker: _Worker, *, ready: bool) -> JobOutcome | None:
        """Return what came of the task of a process; None while it is under way."""
        task, seconds = worker.task, monotonic() - worker.begun
        if task is None:
            return None
        if ready:
            outcome = worker.outcome() or _crashed(worker, task, seconds)
        elif self._timeout is not None and seconds > self._timeout:
            problem = Problem(
                f"it was not done within {self._timeout:g} s", "allow more with --timeout SECONDS"
            )
            code = PlanningError.exit_code
            outcome = JobOutcome(task.job, "timed out", code, (problem,), seconds=seconds, remains=False)
        else:
            return None
        if not outcome.remains:
            self._remove(worker)
        return outcome

    def _remove(self, worker: _Worker) -> None:
        self._all.remove(worker)
        worker.end()

    def end(self) -> None:
        """End all processes."""
        for worker in self._all:
            worker.process.terminate()  # all at once, then one after the other
        for worker in self._all:
            worker.end()
        for end in self._lifeline:
            end.close()


def _context() -> Any:  # noqa: ANN401
    """Return how processes begin: as copies of this one, which has imported all, where that is safe."""
    forks = "fork" in multiprocessing.get_all_start_methods() and sys.platform != "darwin"
    return multiprocessing.get_context("fork" if forks else "spawn")


def _crashed(worker: _Worker, task: Task, seconds: float) -> JobOutcome:
    worker.process.join()
    code = worker.process.exitcode or 0
    if code >= 0:
        problem = Problem(f"the process that planned it ended with exit code {code}")
    else:
        name = signal.Signals(-code).name if -code in list(signal.Signals) else f"signal {-code}"
        hint = "the system ends processes so when memory runs out" if name == "SIGKILL" else None
        problem = Problem(f"the process that planned it was ended by {name}", hint)
    return JobOutcome(task.job, "crashed", BUG, (problem,), seconds=seconds, remains=False)


def _work(connection: Connection, lifeline: tuple[Connection, Connection], setup: Setup) -> None:
    """Do the tasks that come, until none comes any more."""
    signal.signal(
        signal.SIGINT, signal.SIG_IGN
    )  # a terminal sends it to all: the one that gives tasks decides
    signal.signal(signal.SIGTERM, _leave)
    lifeline[1].close()
    Thread(target=_end_with_the_other, args=(lifeline[0],), daemon=True).start()
    while True:
        try:
            task = connection.recv()
        except (EOFError, OSError):
            return
        connection.send(run_task(task, setup))


def _leave(number: int, frame: object) -> NoReturn:
    raise SystemExit(128 + number)


def _end_with_the_other(lifeline: Connection) -> None:
    """End this process when the one that has started it is no more: nobody writes to the lifeline."""
    try:
        lifeline.recv_bytes()
    except (EOFError, OSError):
        os.kill(os.getpid(), signal.SIGTERM)
