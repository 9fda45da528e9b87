"""Sweeps: one job at many points, at each with some of its values replaced, planned as a batch is.

A point is what `trajcli plan` makes of the job with `--set PATH=VALUE` for each value. What came of them is
kept beside the table, line by line as it comes, so that a sweep that was ended goes on where it was.
"""

from __future__ import annotations

import json
import math
import random
import re
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import closing, suppress
from decimal import Decimal
from fractions import Fraction
from functools import lru_cache
from itertools import pairwise
from math import prod
from pathlib import Path
from typing import Any

import numpy as np

from trajcli.batches.jobs import BatchJob
from trajcli.batches.ledger import hash_of_inputs
from trajcli.batches.task import InputsHash, JobOutcome, PointVerdict, SweepPoint, Task, make_folder
from trajcli.errors import InputError, TrajcliError
from trajcli.frozen import frozen
from trajcli.job.dump import flow_text
from trajcli.job.override import Setting, overridden, parse_setting
from trajcli.job.read import files_of, job_of_document
from trajcli.job.yaml.load import Document, parse_document
from trajcli.output.delivery.delivered import delivered
from trajcli.peers.move_reference import reference_of
from trajcli.planners.planner import PlannedMove
from trajcli.planning.binding_limits import tightest_limit
from trajcli.planning.plan import Plan
from trajcli.streams.whole_file import whole_file

MOST_ROWS = 1_000_000
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_LARGEST_EXPONENT = 308  # of a normal float64, by tens
_RANGE = re.compile(rf"\s*({_NUMBER}?)\.\.({_NUMBER})(?::(.*))?")
_QUANTITIES = re.compile(rf"\s*{_NUMBER}[^,'\"\[{{]*\.\.\s*{_NUMBER}[^,]*")
_VERDICTS: dict[int, PointVerdict] = {1: "exceeded", 3: "unreachable"}
_NAMED = ("points", "frames", "tools", "sequences")
"""Sections whose keys are names: a new one changes nothing, as nothing names it."""
_WHOLE = 1e15  # below it a float without decimals is written as a whole number
Run = Callable[[Sequence[Task], "SweepSetup"], Generator[JobOutcome, None, None]]


@frozen
class Axis:
    """One value of the job that a sweep varies.

    Attributes:
        path: Where it stands, as the user wrote it.
        values: As YAML: what it is set to, and what the table shows.
    """

    path: str
    values: tuple[str, ...]

    def setting(self, index: int) -> Setting:
        """Return what puts one of the values into the job."""
        return parse_setting(f"{self.path}={self.values[index]}", "--vary")


def parse_axis(text: str) -> Axis:
    """Return the axis that `PATH=A..B:N` or `PATH=v1,v2,...` says.

    Raises:
        InputError: When it is not of that form.
    """
    path, _, values = text.partition("=")
    parse_setting(text, "--vary")  # says what is wrong with the path
    found = _RANGE.fullmatch(values)
    if found is not None:
        return Axis(path.strip(), tuple(map(number_text, _spread(text, *found.groups()))))
    if _QUANTITIES.fullmatch(values):
        message = f"--vary {text}: the ends of a range are numbers in the units of the job"
        raise InputError(message, hint="such as 100..300:9; only a list has units: 0.1 m/s,0.2 m/s")
    listed = parse_document(f"[{values}]", f"--vary {text}", any_root=True).plain()
    if not listed or not isinstance(listed, list):
        hint = "such as --vary limits.tcp.speed=100..500:9 or --vary moves.0.planner=cubic,quintic"
        raise InputError(f"--vary {text}: expected PATH=A..B:N or PATH=v1,v2,...", hint=hint)
    return axis_of(path.strip(), listed)


def axis_of(path: str, values: Iterable[Any]) -> Axis:
    """Return the axis of a path and its values.

    Raises:
        InputError: When there are none.
    """
    listed: tuple[Any, ...] = ()
    with suppress(TypeError):  # of one value alone
        listed = tuple(values)
    if not listed:
        raise InputError(f"{path} has no values", hint='give a list such as [1, 2], or a text: "1..3:9"')
    return Axis(path, tuple(map(value_text, listed)))


def _spread(text: str, first: str, last: str, count: str | None) -> Iterator[float]:
    """Yield numbers at equal distances, both ends included; of decimals the exact ones, rounded once."""
    if not count or not count.isdecimal() or len(count) > 9 or not 2 <= int(count) <= MOST_ROWS:
        hint = f"such as {first}..{last}:9, both ends included"
        raise InputError(f"--vary {text}: a range needs how many values, 2 to {MOST_ROWS}", hint=hint)
    for end in (first, last):
        if math.isinf(float(end)) or abs(Decimal(end).adjusted()) > _LARGEST_EXPONENT:
            raise InputError(f"--vary {text}: {end} is no number from 1e-{_LARGEST_EXPONENT} to 1.79e308")
    low, high, steps = Fraction(first), Fraction(last), int(count) - 1
    return (float(low + (high - low) * step / steps) for step in range(steps + 1))


def number_text(value: float) -> str:
    """Return a number with the fewest digits that restore it."""
    return str(int(value)) if abs(value) < _WHOLE and value == int(value) else repr(value)


def value_text(value: Any) -> str:  # noqa: ANN401
    """Return a value of the job as YAML on one line; a text without quotes where it needs none."""
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    if isinstance(value, bool):
        return flow_text(value)
    if isinstance(value, int | float):
        return number_text(value)
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(value_text, value))}]"
    if isinstance(value, str):
        with suppress(InputError):
            if parse_document(value, "", any_root=True).plain() == value and not re.search(
                r"[\[\]{},]", value
            ):
                return value
    return flow_text(value)


@frozen
class SweepSetup:
    """What all points of a sweep share.

    Attributes:
        content: Of the job.
    """

    content: bytes

    def done(self, task: Task, hashed: InputsHash) -> JobOutcome:
        """Plan the job at a point; that there is no motion is what came of it."""
        del hashed
        try:
            point = _planned(overridden(_document(self.content, task.job.job), task.settings))
        except TrajcliError as error:
            point = SweepPoint(_VERDICTS.get(error.exit_code, "input"), reason=error.problems[0].text())
        return JobOutcome(task.job, "written", duration=point.duration, point=point)


@lru_cache(maxsize=1)
def _document(content: bytes, file: str) -> Document:
    return parse_document(content, file)


def _planned(document: Document) -> SweepPoint:
    with np.errstate(all="ignore"):  # what is not finite is for the checks to find
        plan, _ = delivered(job_of_document(document))
        findings = plan.verdict.findings
        reason = findings[0].text(plan.loaded.say) if findings else None
        verdict: PointVerdict = "verified" if plan.verdict.passed else "exceeded"
        return SweepPoint(
            verdict, plan.trajectory.duration, tightest_limit(plan) or None, _bound(plan), reason
        )


def _bound(plan: Plan) -> float | None:
    """Return a duration that no motion of the job is below; None where none is known.

    Through zones it is the one without most limits of jerk: a closer one takes seconds for each point.
    """
    chains = () if plan.flyby is None else plan.flyby.chains
    if chains is None:
        return None
    flown = {index for chain in chains for index in chain.moves}
    bounds = [_bound_of_move(move) for move in plan.moves if move.duration > 0 and move.index not in flown]
    if chains:
        from trajcli.planners.flying_by import second_order_bound

        bounds += map(second_order_bound, chains)
    return None if None in bounds else math.fsum(bound for bound in bounds if bound is not None)


def _bound_of_move(move: PlannedMove) -> float | None:
    """Return the longest duration that is known to be needed; an arm that stands takes what it is told to."""
    if not move.planned.curve.coefficients[:-1].any():
        return move.duration
    certificate = move.planned.certificate
    lower = [reference_of(move).duration, None if certificate is None else certificate.lower]
    return max((bound for bound in lower if bound is not None), default=None)


@frozen
class Sweep:
    """A job, what is varied, and which of all combinations are planned.

    Attributes:
        file: The job's path, as the user names it.
        content: Of the job.
        axes: What is varied; of the last one the values change from row to row.
        rows: The numbers of the combinations, rising.
    """

    file: str
    content: bytes
    axes: tuple[Axis, ...]
    rows: Sequence[int]

    def indices(self, number: int) -> tuple[int, ...]:
        """Return which value each axis has in a combination."""
        found = list[int]()
        for axis in reversed(self.axes):
            number, index = divmod(number, len(axis.values))
            found.append(index)
        return tuple(reversed(found))

    def values(self, number: int) -> tuple[str, ...]:
        """Return the values of a combination."""
        return tuple(axis.values[index] for axis, index in zip(self.axes, self.indices(number), strict=True))

    def settings(self, number: int) -> tuple[Setting, ...]:
        """Return what puts the values of a combination into the job."""
        return tuple(axis.setting(index) for axis, index in zip(self.axes, self.indices(number), strict=True))

    def inputs(self, number: int) -> str | None:
        """Return the hash of all that a point depends on; None where it cannot be read."""
        settings = self.settings(number)
        try:
            document = overridden(_document(self.content, self.file), settings)
            files = tuple(path for what, path in files_of(document) if what != "the job")
        except TrajcliError:
            return None
        said = json.dumps(["sweep", *((setting.path, setting.value) for setting in settings)])
        return hash_of_inputs(Path(self.file).name, self.content, files, said)


def sweep_of(
    file: str, content: bytes, axes: Sequence[Axis], samples: int | None = None, seed: int = 0
) -> Sweep:
    """Return the sweep over all combinations of values, or over so many, drawn evenly.

    Raises:
        InputError: When nothing is varied, a path leads nowhere, or there are too many points.
    """
    if not axes:
        raise InputError("nothing is varied", hint="such as --vary limits.tcp.speed=100..500:9")
    named = [axis.path for axis in axes]
    twice = next((path for path in named if named.count(path) > 1), None)
    if twice is not None:
        raise InputError(f"--vary {twice} stands twice", hint="name all its values in one")
    count = prod(len(axis.values) for axis in axes)
    if samples is not None and not 1 <= samples <= min(count, MOST_ROWS):
        raise InputError(
            f"--samples {samples}: expected 1 to {min(count, MOST_ROWS)} of {count} combinations"
        )
    if samples is None and count > MOST_ROWS:
        hint = f"fewer values, or --samples with at most {MOST_ROWS}"
        raise InputError(f"the sweep has {count} combinations, at most {MOST_ROWS} are planned", hint=hint)
    _check_paths(parse_document(content, file), axes)
    rows = range(count) if samples is None else _drawn(count, samples, seed)
    return Sweep(file, content, tuple(axes), rows)


def _drawn(count: int, samples: int, seed: int) -> tuple[int, ...]:
    """Return numbers below `count`, one of each of equal parts, by chance that the seed repeats."""
    chance = random.Random(seed)  # noqa: S311
    ends = [part * count // samples for part in range(samples + 1)]
    return tuple(chance.randrange(low, high) for low, high in pairwise(ends))


def _check_paths(document: Document, axes: Sequence[Axis]) -> None:
    """Refuse an axis of which no value can stand in the job, where the job can be read without it."""
    if _refusal(document, ()) is not None:
        return
    for axis in axes:
        _check_name(document, axis)
        first: InputError | None = None
        for index in range(len(axis.values)):
            refused = _refusal(document, (axis.setting(index),))
            first = first or refused
            if refused is None:
                break
        else:
            if first is not None:
                raise first


def _check_name(document: Document, axis: Axis) -> None:
    """Refuse an axis that would add a point, frame, tool or sequence, which nothing in the job names."""
    section, *keys = axis.setting(0).path
    if section not in _NAMED or not keys or document.node((section, keys[0])) is not None:
        return
    from trajcli.suggest import did_you_mean, valid_names

    node = document.node((section,))
    names = list(node.value) if node is not None and isinstance(node.value, dict) else []
    hint = did_you_mean(str(keys[0]), names) or valid_names(names, str(section))
    raise InputError(f"--vary {axis.path}: the job has no {section}.{keys[0]}", hint=hint or None)


def _refusal(document: Document, settings: tuple[Setting, ...]) -> InputError | None:
    try:
        job_of_document(overridden(document, settings))
    except InputError as error:
        return error
    return None


class PointLedger:
    """What came of points, in a file beside the table: a line for each, written when it comes.

    Args:
        table: The file of the table; None where nothing is kept.
        force: Whether what is there does not count.

    Raises:
        FileError: When the folder of the table cannot be made.
    """

    def __init__(self, table: str | None, *, force: bool = False) -> None:
        self._path = None if table is None else Path(table).with_name(f".{Path(table).name}.sweep.jsonl")
        if self._path is not None:
            make_folder(self._path.parent)
        self.points = dict[str, SweepPoint]() if force or self._path is None else _points(self._path)

    @property
    def kept(self) -> bool:
        """Whether anything is kept."""
        return self._path is not None

    def add(self, inputs: str, point: SweepPoint) -> None:
        """Take what came of a point; where it cannot be written, it is planned again next time."""
        self.points[inputs] = point
        if self._path is not None:
            with suppress(OSError), self._path.open("a", encoding="utf-8") as file:
                file.write(_line(inputs, point))

    def close(self, inputs: Sequence[str | None]) -> None:
        """Keep the points of this sweep only, each once."""
        if self._path is not None:
            lines = [_line(each, self.points[each]) for each in inputs if each in self.points]
            with suppress(TrajcliError), whole_file(self._path) as out:
                out.write("".join(lines).encode())


def _line(inputs: str, point: SweepPoint) -> str:
    return json.dumps({"inputs": inputs, **vars(point)}) + "\n"


def _points(path: Path) -> dict[str, SweepPoint]:
    """Return the points of a ledger; what is half written is none."""
    points = dict[str, SweepPoint]()
    with suppress(OSError, UnicodeDecodeError):
        for line in path.read_text(encoding="utf-8").splitlines():
            with suppress(ValueError, TypeError, KeyError, AttributeError):
                value = json.loads(line)
                inputs = str(value.pop("inputs"))
                points[inputs] = SweepPoint(**value)
    return points


def outcomes_of(sweep: Sweep, ledger: PointLedger, run: Run) -> Generator[tuple[int, JobOutcome], None, None]:
    """Yield the number and the outcome of each point as it is done, those that are known first.

    Args:
        sweep: The job, and its points.
        ledger: What is known of them, and takes what comes.
        run: Plans points, by processes of this machine or by a cluster.
    """
    hashes = [sweep.inputs(number) if ledger.kept else None for number in sweep.rows]
    tasks = list[Task]()
    for row, (number, inputs) in enumerate(zip(sweep.rows, hashes, strict=True)):
        point = ledger.points.get(inputs or "")
        job = BatchJob(sweep.file, str(row))
        if point is not None:
            yield row, JobOutcome(job, "unchanged", duration=point.duration, point=point)
        else:
            tasks.append(Task(job, None, sweep.settings(number)))
    with closing(run(tasks, SweepSetup(sweep.content))) as done:
        for outcome in done:
            row = int(outcome.job.output)
            inputs = hashes[row]
            # where a file has changed meanwhile, nobody knows of which content the point was made
            if outcome.point is not None and inputs is not None and inputs == sweep.inputs(sweep.rows[row]):
                ledger.add(inputs, outcome.point)
            yield row, outcome
    ledger.close(hashes)
