"""`trajcli batch`: many jobs, one line of JSON each, and their progress on a terminal."""

from __future__ import annotations

import json
import re
import sys
from collections import Counter
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import closing
from functools import partial
from time import monotonic
from typing import TYPE_CHECKING, Any, BinaryIO, get_args

from trajcli.batches.jobs import BatchJobs, Ledgers, find_jobs
from trajcli.batches.task import BatchSetup, JobOutcome, OutcomeName, Setup, Task
from trajcli.cli.frames import problem_as_json, shown
from trajcli.cli.outcome import ErrorForm, print_remark, report_error
from trajcli.cli.progress import ERASE, columns, is_terminal
from trajcli.errors import FileError, InputError, PlanningError, TrajcliError, VerificationError, utf8
from trajcli.streams.whole_file import standard_output

if TYPE_CHECKING:
    from trajcli.cli.motion_commands import BatchCommand, SweepCommand

_TIMEOUT = 600.0  # s
_SHOWN = 5  # names of files in a remark


def run_batch(options: BatchCommand) -> int:
    """Plan jobs, and print a line for each; return the worst exit code.

    Raises:
        InputError: When nothing can be begun: no job, one output for two jobs, options that do not fit.
        FileError: When a folder cannot be read, or a scheduler cannot be reached.
        BrokenPipeError: When the reader has closed the pipe.
    """
    limits = processes_of(options), timeout_of(options)
    if options.consumer is not None:
        from trajcli.consumers.judgement import load_profile

        load_profile(options.consumer)  # what there is not no job can be planned for
    found = find_jobs(options.jobs, options.output, options.form)
    record = Ledgers(found.jobs)
    entries = {} if options.force else record.entries()
    tasks = [Task(job, entries.get(job.output)) for job in found.jobs]
    setup = BatchSetup(options.form, found.owners(), options.rows, options.consumer, options.strict)
    progress = Progress(len(tasks))
    try:
        with closing(outcomes_of_tasks(tasks, setup, options, limits, progress.show)) as outcomes:
            failed = _print_outcomes(outcomes, progress, record, options)
    finally:
        progress.erase()
        record.write()
    if options.errors != "text" and options.errors != "json":
        from trajcli.output.annotations import annotations_of, render_annotations

        problems = [each for outcome in failed for each in annotations_of(_error(outcome), outcome.job.job)]
        text = render_annotations(problems, options.errors, [job.job for job in found.jobs])
        print(text, end="", file=sys.stderr)  # noqa: T201
    elif not options.quiet:
        _say_what_came(found, progress)
    return progress.worst


def outcomes_of_tasks(
    tasks: Sequence[Task],
    setup: Setup,
    options: BatchCommand | SweepCommand,
    limits: tuple[int, float | None],
    on_tick: Callable[[], None],
) -> Generator[JobOutcome, None, None]:
    """Return the outcomes of tasks as they are done, from this machine or from a cluster."""
    if options.engine == "dask":
        from trajcli.batches.cluster import run_on_cluster

        return run_on_cluster(tasks, setup, options.scheduler, on_tick)
    from trajcli.batches.processes import run_in_processes

    count, timeout = limits
    return run_in_processes(tasks, setup, min(count, len(tasks)), timeout, on_tick)


def processes_of(options: BatchCommand | SweepCommand) -> int:
    """Return how many processes there are at most."""
    from trajcli.batches.processes import MOST_PROCESSES, usable_cores

    given = {"-j": options.count, "--timeout": options.timeout}
    for name in (name for name, value in given.items() if value is not None and options.engine == "dask"):
        raise InputError(f"{name} is about processes of this machine, not of a cluster", hint="leave it out")
    if options.scheduler is not None and options.engine != "dask":
        raise InputError("--scheduler is about a cluster", hint="add --engine dask")
    if options.count is None:
        return usable_cores()
    if not re.fullmatch("[0-9]{1,4}", options.count) or not 1 <= int(options.count) <= MOST_PROCESSES:
        raise InputError(f"-j expects 1 to {MOST_PROCESSES} processes, got '{options.count}'")
    return int(options.count)


def timeout_of(options: BatchCommand | SweepCommand) -> float | None:
    """Return how long a job may take, s; None for ever."""
    if options.timeout is None:
        return _TIMEOUT
    try:
        seconds = float(options.timeout)
    except ValueError:
        seconds = -1.0
    if not 0 <= seconds < float("inf"):
        raise InputError(
            f"--timeout expects seconds, got '{options.timeout}'", hint="0 lets each job take its time"
        )
    return seconds or None


def _print_outcomes(
    outcomes: Iterator[JobOutcome], progress: Progress, record: Ledgers, options: BatchCommand
) -> list[JobOutcome]:
    """Print a line for each outcome as soon as it is there, and why jobs failed; return the failed ones.

    Where people read the lines they are words, and the reasons stand behind all of them.
    """
    for_people = is_terminal(sys.stdout) and options.errors == "text"
    failed, reasons = list[JobOutcome](), list[Callable[[], None]]()
    with standard_output() as out:
        for outcome in outcomes:
            if outcome.entry is not None and outcome.outcome == "written":
                record.add(outcome.job, outcome.entry)
            progress.erase()
            if for_people:
                _write_line(out, _in_words(outcome, progress))
            else:
                _write_line(out, json.dumps(_as_json(outcome), ensure_ascii=False, allow_nan=False))
            if outcome.exit_code:
                failed.append(outcome)
                reasons.append(partial(_say_why, outcome, record.set_aside(outcome.job), options.errors))
                if not for_people:
                    reasons.pop()()
            progress.add(outcome.outcome, outcome.exit_code)
        progress.erase()
    for reason in reasons:
        reason()
    return failed


def _in_words(outcome: JobOutcome, progress: Progress) -> str:
    """Return an outcome as a line of a terminal: its word with a colour, the job, how long its motion is."""
    from trajcli.cli.terminal import GREEN, RED, painted, shortened

    lasts = "" if outcome.duration is None else f"{outcome.duration:.6g} s"
    word = f"{outcome.outcome:{progress.widest}}"
    space = columns() - len(word) - len(lasts) - 4
    name = shortened(shown(utf8(outcome.job.job)), space)
    return f"{painted(word, RED if outcome.exit_code else GREEN, sys.stdout)}  {name}  {lasts}".rstrip()


def _say_why(outcome: JobOutcome, aside: str | None, errors: ErrorForm) -> None:
    """Say why a job failed, and where rows are that an earlier batch wrote for it."""
    if errors == "json":
        report_error(_error(outcome), errors)
    if errors == "text":
        print_remark(f"{utf8(outcome.job.job)}: {outcome.outcome}: {_first(outcome)}")
        if aside is not None:
            print_remark(f"  {utf8(outcome.job.output)} was of an earlier batch: it is {utf8(aside)} now")


def _error(outcome: JobOutcome) -> TrajcliError:
    kinds = (InputError, VerificationError, PlanningError, FileError)
    kind = next((each for each in kinds if each.exit_code == outcome.exit_code), TrajcliError)
    return kind(*outcome.problems)


def _first(outcome: JobOutcome) -> str | None:
    """Return the first thing that is wrong with a job, and how many more there are."""
    problems = outcome.problems
    more = f" (and {len(problems) - 1} more)" if len(problems) > 1 else ""
    return problems[0].text() + more if problems else None


def _write_line(out: BinaryIO, text: str) -> None:
    out.write(text.encode(errors="backslashreplace") + b"\n")
    out.flush()


def _as_json(outcome: JobOutcome) -> dict[str, Any]:
    """Return an outcome as a mapping that JSON can hold, with the same keys for every job."""
    return {
        "job": outcome.job.job,
        "outcome": outcome.outcome,
        "exit": outcome.exit_code,
        "error": _first(outcome),
        "problems": [problem_as_json(problem) for problem in outcome.problems],
        "duration": outcome.duration,
        "output": outcome.output,
        "hash": outcome.inputs,
        "seconds": round(outcome.seconds, 6),
    }


def _say_what_came(found: BatchJobs, progress: Progress) -> None:
    if found.no_jobs:
        shown = ", ".join(utf8(name) for name in found.no_jobs[:_SHOWN])
        more = f" and {len(found.no_jobs) - _SHOWN} more" if len(found.no_jobs) > _SHOWN else ""
        print_remark(f"no jobs, left out: {shown}{more}")
    print_remark(f"{progress.total} job{'s' * (progress.total != 1)}: {progress.text}")


class Progress:
    """How many jobs are done, with what outcome; shown on a terminal, below the lines that stand there."""

    widest = max(map(len, get_args(OutcomeName)))

    def __init__(self, total: int, one: str = "job") -> None:
        self.total, self.worst, self._one = total, 0, one
        self._done: Counter[str] = Counter()
        self._shows = is_terminal(sys.stderr)
        self._begun, self._visible = monotonic(), False

    @property
    def text(self) -> str:
        """How many jobs had each outcome, and the time since the first one began."""
        counts = [f"{number} {name}" for name, number in sorted(self._done.items(), key=lambda one: -one[1])]
        return f"{', '.join(counts)}, {monotonic() - self._begun:.3g} s"

    def add(self, outcome: str, exit_code: int) -> None:
        """Count a job that is done."""
        self._done[outcome] += 1
        self.worst = max(self.worst, exit_code)
        self.show()

    def show(self) -> None:
        """Write the line anew."""
        if self._shows:
            line = f"{self._done.total()} of {self.total} {self._one}s: {self.text}".replace(": ,", ",")
            sys.stderr.write(f"{ERASE}{line[: columns() - 1]}")
            sys.stderr.flush()
            self._visible = True

    def erase(self) -> None:
        """Remove the line."""
        if self._visible:
            sys.stderr.write(ERASE)
            sys.stderr.flush()
            self._visible = False
