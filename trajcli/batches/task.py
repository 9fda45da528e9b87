"""One job of a batch: planned, judged and written unless it is unchanged; its outcome as a value.

A sweep is done in the same way: each of its points is the one job with some values set, and has no file.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Literal, Protocol

import numpy as np

from trajcli.batches.jobs import BatchJob
from trajcli.batches.ledger import LedgerEntry, hash_of_file, hash_of_inputs
from trajcli.errors import FileError, InputError, Problem, TrajcliError, utf8
from trajcli.frozen import comparable, frozen
from trajcli.job.read import files_of, job_of_document
from trajcli.job.yaml.document import read_bytes
from trajcli.job.yaml.load import Document, parse_document
from trajcli.output.delivery.delivered import delivered
from trajcli.output.write import grid_of, write_rows
from trajcli.streams.formats import FormatName, format_of
from trajcli.version import library_error

if TYPE_CHECKING:
    from trajcli.job.override import Setting

BUG = 70
OutcomeName = Literal["written", "unchanged", "failed", "crashed", "timed out"]
PointVerdict = Literal["verified", "exceeded", "unreachable", "input"]


class Setup(Protocol):
    """What all jobs share, and what is done with one of them."""

    def done(self, task: Task, hashed: InputsHash) -> JobOutcome:
        """Return what comes of a job."""
        ...


@frozen
class BatchSetup:
    """What all jobs of a batch share.

    Attributes:
        form: The format of the rows.
        outputs: The job behind each file that will be written, by the file's real path.
        rows: Replaces `output.rows` of each job; None leaves it.
        consumer: Profile for which each job is planned; None for the one that it names.
        strict: Whether events are errors.
    """

    form: FormatName
    outputs: Mapping[str, str]
    rows: str | None = None
    consumer: str | None = None
    strict: bool = False

    @property
    def said(self) -> str:
        """What the batch says of the rows, for the hash of what they are made of."""
        consumer = None if self.consumer is None else f"for {self.consumer}"
        return " ".join(word for word in (self.form, self.rows, consumer, "strict" * self.strict) if word)

    def document(self, document: Document) -> Document:
        """Return a job with what the batch says of the rows."""
        if self.rows is None:
            return document
        from trajcli.job.override import Setting, overridden

        return overridden(document, [Setting(f"--rows {self.rows}", ("output", "rows"), self.rows)])

    def done(self, task: Task, hashed: InputsHash) -> JobOutcome:
        """Write the rows of a job, unless they are as they would be written.

        Raises:
            TrajcliError: Why there are none.
        """
        entry = _unchanged(task, self)
        outcome: OutcomeName = "unchanged" if entry is not None else "written"
        if entry is None:
            entry = _written(task, self, hashed)
        inputs = entry.inputs or hashed.value
        return JobOutcome(task.job, outcome, 0, (), entry.duration, task.job.output, entry, inputs)


@frozen
class Task:
    """A job to do.

    Attributes:
        job: What is read and written.
        entry: What its output was made of when it was written; None to plan it in any case.
        settings: What takes the place of the job's own values.
    """

    job: BatchJob
    entry: LedgerEntry | None
    settings: tuple[Setting, ...] = ()


@comparable
class SweepPoint:
    """What comes of a job at one point of a sweep.

    Attributes:
        verdict: "verified"; "exceeded", a limit is; "unreachable", there is no motion; "input", it is no job.
        duration: Of the trajectory, s; None where there is none.
        tightest: The limit of which most is used, where and how much; None where there is none.
        bound: No motion under these limits is shorter, s; None where nothing is known.
        reason: Why it is not verified.
    """

    verdict: PointVerdict
    duration: float | None = None
    tightest: str | None = None
    bound: float | None = None
    reason: str | None = None


@comparable
class JobOutcome:
    """What came of a job.

    Attributes:
        job: Its path.
        outcome: "written", "unchanged", "failed" (its errors say why), "crashed" (its process ended),
            "timed out".
        exit_code: That of `trajcli plan` for this job.
        problems: Why it failed.
        duration: Of the trajectory, s; None where there is none.
        output: The file of rows; None where none was written and none is up to date.
        entry: For the ledger.
        inputs: Hash of job, files, version and format; None where they could not be read.
        seconds: That it took.
        remains: Whether the process may do more jobs: not after it ran out of memory.
        point: Of a sweep.
    """

    job: BatchJob
    outcome: OutcomeName
    exit_code: int = 0
    problems: tuple[Problem, ...] = ()
    duration: float | None = None
    output: str | None = None
    entry: LedgerEntry | None = None
    inputs: str | None = None
    seconds: float = 0.0
    remains: bool = True
    point: SweepPoint | None = None


def run_task(task: Task, setup: Setup) -> JobOutcome:
    """Return what comes of a job; nothing is raised but what ends the process."""
    begun = monotonic()
    job, hashed = task.job, InputsHash()
    try:
        return replace(setup.done(task, hashed), seconds=monotonic() - begun)
    except TrajcliError as error:
        code, problems, remains = error.exit_code, error.problems, True
    except MemoryError:
        hint = "a lower rate or a shorter motion needs less"
        code, problems, remains = BUG, (Problem("there is not enough memory", hint),), False
    except Exception as error:  # noqa: BLE001
        of_library = library_error(error)
        message = f"a bug in trajcli: {type(error).__name__}: {error}"
        problem = Problem(message, f"`trajcli plan {utf8(job.job)}` says more")
        code, problems, remains = BUG, (problem,), True
        if of_library is not None:
            code, problems = of_library.exit_code, of_library.problems
    seconds = monotonic() - begun
    return JobOutcome(
        job, "failed", code, tuple(problems), inputs=hashed.value, seconds=seconds, remains=remains
    )


class InputsHash:
    """The hash of what a job is made of, once it is known."""

    value: str | None = None


def _unchanged(task: Task, setup: BatchSetup) -> LedgerEntry | None:
    """Return the entry of an output that is as it would be written; None where it has to be planned."""
    entry, job = task.entry, task.job
    if entry is None or hash_of_file(job.output) != entry.output:
        return None
    folder = Path(job.job).parent
    files = [str(folder / file) for file in entry.files]
    now = hash_of_inputs(Path(job.job).name, read_bytes(job.job), files, setup.said)
    return entry if now == entry.inputs else None


def _written(task: Task, setup: BatchSetup, hashed: InputsHash) -> LedgerEntry:
    """Return the entry of an output that was planned, judged and written."""
    job = task.job
    content = read_bytes(job.job)
    document = parse_document(content, job.job)
    _check_files_stay(document, setup)
    files = tuple(path for what, path in files_of(document) if what != "the job")
    hashed.value = hash_of_inputs(Path(job.job).name, content, files, setup.said)
    with np.errstate(all="ignore"):  # what is not finite is for the checks to find
        form = format_of(job.output, setup.form)
        loaded = job_of_document(setup.document(document))
        plan, digits = delivered(
            loaded, setup.consumer, form, rows=setup.rows is not None, strict=setup.strict
        )
        grid = grid_of(plan)
        if not plan.verdict.passed:
            from trajcli.output.report import verification_error

            raise verification_error(plan)
        from trajcli.output.delivery.joined import as_logged

        make_folder(Path(job.output).parent)
        write_rows(as_logged(plan, form), grid, job.output, digits, form=form)
    after = hash_of_inputs(Path(job.job).name, content, files, setup.said)
    # where a file has changed meanwhile, nobody knows of which content the rows were made
    kept = hashed.value if after == hashed.value else None
    named = tuple(_relative(file, Path(job.job).parent) for file in files)
    return LedgerEntry(kept or "", named, hash_of_file(job.output) or "", plan.trajectory.duration)


def _relative(file: str, folder: Path) -> str:
    """Return the path of a file from a folder; an absolute one that is not below it stays."""
    return str(Path(file).relative_to(folder)) if Path(file).is_relative_to(folder) else file


def _check_files_stay(document: Document, setup: BatchSetup) -> None:
    """Refuse a job that reads what this batch writes."""
    for what, path in files_of(document):
        writer = setup.outputs.get(os.path.realpath(path))
        if writer is not None:
            hint = "write to another folder with -o DIR, or plan one after the other"
            message = f"{what} {utf8(path)} is the output of {utf8(writer)} in this batch"
            raise InputError(message, hint=hint)


def make_folder(folder: Path) -> None:
    """Make the folder of an output, where it is not there.

    Raises:
        FileError: When that cannot be done.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        reason = error.strerror or str(error)
        raise FileError(f"cannot make the folder '{utf8(str(folder))}': {reason}") from None
