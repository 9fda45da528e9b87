"""Jobs of a batch: their discovery in folders, and the files that their rows go to."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from time import monotonic

from trajcli.batches.ledger import LEDGER_NAME, LedgerEntry, hash_of_file, read_ledger, write_ledger
from trajcli.errors import InputError, utf8
from trajcli.frozen import comparable, frozen
from trajcli.streams.formats import ENDINGS, FormatName
from trajcli.streams.whole_file import identity, is_folder, paths_below, remove_aside, set_aside

_YAML = (".yaml", ".yml")
_KEY_OF_JOBS = re.compile(rb"""(?m)(?:^|^\s*\{\s*|,\s*)["']?(?:version|start|moves)["']?\s*:""")
_PERIOD = 5.0  # s after which finished jobs are entered, whatever happens to this process then
_PEEKED = 1 << 20  # bytes of a file that are looked at for what it is


@comparable
class BatchJob:
    """A job of a batch.

    Attributes:
        job: Its path, as the user names it.
        output: The file that its rows go to.
    """

    job: str
    output: str


@frozen
class BatchJobs:
    """The jobs of a batch.

    Attributes:
        jobs: In the order in which they were named, those of a folder by name.
        no_jobs: YAML files of folders that hold something else, such as robots.
    """

    jobs: tuple[BatchJob, ...]
    no_jobs: tuple[str, ...]

    def owners(self) -> dict[str, str]:
        """Return the job of each output, by the output's real path."""
        return {os.path.realpath(job.output): job.job for job in self.jobs}


def find_jobs(names: Sequence[str], folder: str | None, form: FormatName) -> BatchJobs:
    """Return the jobs that files and folders hold, each with its output.

    Args:
        names: Files, which are jobs, and folders, whose YAML files with a key of jobs are.
        folder: Where the rows go; what is found in a folder keeps its path below it. None: beside each job.
        form: Of the rows; it says the ending of their files.

    Raises:
        InputError: When there is no job or no such format, or two things would be in one file.
        FileError: When a folder cannot be read.
    """
    ending = next((ending for ending, forms in ENDINGS.items() if form in forms), None)
    if ending is None:
        formats = dict.fromkeys(name for forms in ENDINGS.values() for name in forms)
        raise InputError(f"rows are written in no format {form!r}", hint=f"formats: {', '.join(formats)}")
    jobs: list[BatchJob] = []
    no_jobs: list[str] = []
    for name in names:
        if name == "-":
            raise InputError("a batch reads no standard input", hint="name files or folders")
        if not name:
            raise InputError("the name of a job is empty", hint="name files or folders; . is the current one")
        if not is_folder(name):
            jobs.append(BatchJob(name, _output(Path(name), Path(Path(name).name), folder, ending)))
            continue
        for path in _yaml_files(Path(name), folder):
            if _is_job(path):
                jobs.append(BatchJob(str(path), _output(path, path.relative_to(name), folder, ending)))
            else:
                no_jobs.append(str(path))
    if not jobs:
        raise InputError(
            f"there is no job in {', '.join(names) or 'an empty list'}",
            hint="a job has the keys version and moves",
        )
    _check_files_differ(jobs)
    return BatchJobs(tuple(jobs), tuple(no_jobs))


def _output(job: Path, below: Path, folder: str | None, ending: str) -> str:
    """Return the file of a job's rows, beside it or at the same path below a folder."""
    base = job if folder is None else Path(folder) / below
    return str(base.with_name((base.stem or base.name) + ending))


def _yaml_files(folder: Path, output: str | None) -> Iterator[Path]:
    """Yield the YAML files below a folder by name, but no hidden ones and none that a batch has written."""
    written = None if output is None else Path(output).resolve()
    for path in (path for path in paths_below(folder) if path.suffix.lower() in _YAML):
        hidden = any(part.startswith(".") for part in path.relative_to(folder).parts)
        below = written is not None and written != folder.resolve() and written in path.resolve().parents
        if not hidden and not below and not is_folder(path):
            yield path


def _is_job(path: Path) -> bool:
    """Return whether a file has a key that only jobs have; where it cannot be read, planning says why."""
    try:
        with path.open("rb") as file:
            return _KEY_OF_JOBS.search(file.read(_PEEKED)) is not None
    except OSError:
        return True


def _check_files_differ(jobs: Sequence[BatchJob]) -> None:
    """Refuse two jobs with one output, and an output that is a job."""
    outputs: dict[tuple[object, ...], str] = {}
    sources = {identity(job.job, 0): job.job for job in jobs}
    for job in jobs:
        same = identity(job.output)
        if same is None:  # a device takes any number of outputs
            continue
        if same in outputs:
            both = f"{utf8(outputs[same])} and {utf8(job.job)}"
            hint = "name each job once, or give them folders of their own"
            raise InputError(f"{both} would both be written to {utf8(job.output)}", hint=hint)
        if same in sources:
            hint = "write to another folder with -o DIR"
            raise InputError(f"the rows of {utf8(job.job)} would overwrite {utf8(sources[same])}", hint=hint)
        outputs[same] = job.job


class Ledgers:
    """Ledgers of the folders that the rows of a batch go to, with the entries that are not written yet."""

    def __init__(self, jobs: Sequence[BatchJob]) -> None:
        self._paths = {job.output: Path(job.output).parent / LEDGER_NAME for job in jobs}
        self._entries = dict[str, LedgerEntry]()
        self._written = monotonic()

    def entries(self) -> dict[str, LedgerEntry]:
        """Return what outputs were made of, as far as the ledgers say."""
        ledgers = {path: read_ledger(path) for path in set(self._paths.values())}
        entries = ((output, ledgers[path].get(_name(output))) for output, path in self._paths.items())
        return {output: entry for output, entry in entries if entry is not None}

    def add(self, job: BatchJob, entry: LedgerEntry) -> None:
        """Take the entry of an output that was written, and write all there are now and then."""
        if self._has_written(job, f"{job.output}.stale"):
            remove_aside(job.output)
        self._entries[job.output] = entry
        if monotonic() - self._written > _PERIOD:
            self.write()

    def set_aside(self, job: BatchJob) -> str | None:
        """Rename rows that an earlier batch wrote and this one could not; return their name then."""
        return set_aside(job.output) if self._has_written(job, job.output) else None

    def _has_written(self, job: BatchJob, file: str) -> bool:
        """Return whether a file holds the rows that an earlier batch wrote for a job."""
        content = hash_of_file(file)
        entry = None if content is None else read_ledger(self._paths[job.output]).get(_name(job.output))
        return entry is not None and content == entry.output

    def write(self) -> None:
        """Write all entries into the ledgers of their folders."""
        for path in {self._paths[output] for output in self._entries}:
            of_folder = {
                _name(output): entry for output, entry in self._entries.items() if self._paths[output] == path
            }
            write_ledger(path, of_folder)
        self._entries.clear()
        self._written = monotonic()


def _name(output: str) -> str:
    return output.replace("\\", "/").rpartition("/")[2]
