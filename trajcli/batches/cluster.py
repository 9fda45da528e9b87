"""Workers of a Dask cluster that plan the jobs of a batch."""

from __future__ import annotations

import logging
from collections.abc import Callable, Generator, Sequence
from dataclasses import replace
from pathlib import Path
from threading import Lock
from typing import Any

from trajcli.batches.jobs import BatchJob
from trajcli.batches.task import BUG, JobOutcome, Setup, Task, run_task
from trajcli.errors import FileError, InputError, Problem

_CONNECTING = 10.0  # s until a scheduler that does not answer is given up
_ONE_AT_A_TIME = Lock()
"""Planning is bound to one core: threads of one worker process would only hinder each other."""


def run_on_cluster(
    tasks: Sequence[Task],
    setup: Setup,
    address: str | None,
    on_tick: Callable[[], None] = lambda: None,
) -> Generator[JobOutcome, None, None]:
    """Yield the outcomes of tasks in the order in which they are done.

    The workers must see the same files under the same paths. Closing the iterator cancels what has not begun.

    Args:
        tasks: Each is done once.
        setup: What they share.
        address: Of the scheduler; None for the one that Dask's configuration names.
        on_tick: Called behind each outcome.

    Raises:
        InputError: When Dask is not installed, or nothing says where the scheduler is.
        FileError: When the scheduler cannot be reached, or has no workers.
    """
    client, as_completed = _client(address)
    futures: dict[Any, Task] = {}
    try:
        shared = _scattered(client, setup)
        for task in tasks:
            futures[client.submit(_run_on_worker, _absolute(task), shared, pure=False)] = task
        for future in as_completed(list(futures), loop=client.loop):
            on_tick()
            yield _outcome(future, futures[future])
    finally:
        client.cancel(list(futures))
        client.close()


def _client(address: str | None) -> tuple[Any, Any]:
    """Return a client of a scheduler, and the function that waits for what it does."""
    try:
        import dask
        import distributed
    except ImportError:
        hint = "pip install 'trajcli[dask]'"
        raise InputError("the engine dask needs the packages dask and distributed", hint=hint) from None
    address = address or dask.config.get("scheduler-address", None)
    if address is None:
        hint = "name it with --scheduler, such as tcp://10.0.0.5:8786, or in DASK_SCHEDULER_ADDRESS"
        raise InputError("the engine dask needs the address of a scheduler", hint=hint)
    for name in ("distributed", "distributed.client"):  # what goes wrong is in the outcomes
        logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        connect: Any = distributed.Client
        return connect(address, timeout=_CONNECTING, set_as_default=False), distributed.as_completed
    except (OSError, ValueError, TypeError) as error:
        message = f"the scheduler {address} cannot be reached: {str(error) or type(error).__name__}"
        raise FileError(message, hint="`dask scheduler` prints its address") from None


def _scattered(client: Any, setup: Setup) -> Any:  # noqa: ANN401
    """Return what all tasks share as the workers have it."""
    try:
        return client.scatter(setup, broadcast=True)
    except OSError as error:
        address = client.scheduler.address
        hint = f"`dask worker {address}` starts one"
        raise FileError(f"the scheduler {address} has no workers: {error}", hint=hint) from None


def _absolute(task: Task) -> Task:
    """Return a task whose paths do not depend on the folder of a process."""
    job = BatchJob(str(Path(task.job.job).absolute()), str(Path(task.job.output).absolute()))
    return replace(task, job=job)


def _run_on_worker(task: Task, setup: Setup) -> JobOutcome:
    with _ONE_AT_A_TIME:
        return run_task(task, setup)


def _outcome(future: Any, task: Task) -> JobOutcome:  # noqa: ANN401
    """Return what came of a task, under the names that the user gave."""
    if future.status == "cancelled":
        return _failed(task, "its task was cancelled")
    try:
        done: JobOutcome = future.result()
    except Exception as error:  # noqa: BLE001  (whatever the cluster says costs this job only)
        return _failed(task, f"{type(error).__name__}: {error}")
    output = None if done.output is None else task.job.output
    return replace(done, job=task.job, output=output)


def _failed(task: Task, message: str) -> JobOutcome:
    return JobOutcome(task.job, "crashed", BUG, (Problem(f"the cluster could not plan it: {message}"),))
