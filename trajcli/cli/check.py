"""Judgement of anybody's trajectory on the command line: `trajcli check`."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal

from trajcli.cli.numbers import number
from trajcli.cli.outcome import (
    error_as_json,
    print_json,
    print_lines,
    print_remark,
    print_text,
    refuse_two_inputs,
    report_error,
)
from trajcli.cli.terminal import shown_table
from trajcli.errors import Amount, InputError, Place, Problem, TrajcliError, at_least
from trajcli.findings import Finding, time_text
from trajcli.judge.file import CheckedFile, CheckOptions, check_file
from trajcli.judge.judgement import Judgement
from trajcli.output.annotations import annotations_of, render_annotations
from trajcli.output.delivery.delivered import delivered_as
from trajcli.streams.reading import motion_files
from trajcli.units import Units, amount_text

if TYPE_CHECKING:
    from trajcli.cli.job_commands import CheckCommand
    from trajcli.peers.motion_reference import MotionReference


_MOST, _FEW = 30, 4  # findings that a table lists: of those that are certain, and of each other group
_JOINED = {
    "hold": "held from row to row",
    "linear": "joined by straight lines",
    "cubic": "joined by cubics",
    "quintic": "joined by quintics",
    "jtc": "joined as the joint_trajectory_controller does",
    "jtc-upsampling": "joined by the spline of the joint_trajectory_controller",
}


def run_check(options: CheckCommand) -> int:
    """Judge files and print what was found; return 0 when nothing is certainly wrong, else 1 or worse.

    A document for a service of CI has the errors of files that cannot be judged, too.

    Raises:
        InputError: When options do not fit, or the only file is no trajectory, for people or as JSON.
        FileError: When the only file cannot be read, likewise.
    """
    files = [file for name in options.files for file in motion_files(name)]
    form, alone, code = _form(options, files), files == options.files[:1], 0
    found, problems = list[dict[str, Any]](), list[Problem]()
    for file in files:
        try:
            checked, beside = _checked_file(file, options)
        except TrajcliError as error:
            if alone and form in ("table", "json"):
                raise
            code = max(code, error.exit_code)
            found.append({"file": file, **error_as_json(error)})
            problems += annotations_of(error, file)
            if form in ("table", "json"):
                report_error(error, options.errors)
            continue
        code = max(code, _failed(checked.judgement, strict=options.strict))
        problems += _annotations(checked, file)
        mapping = checked.judgement.as_json() | ({} if beside is None else {"reference": _view(beside)})
        found.append(mapping if alone else {"file": file, **mapping})
        if form == "table":
            print_lines(
                [*_lines(checked), *([] if beside is None else _beside(beside, checked.units))], verdict=True
            )
        for event in checked.judgement.events:
            print_remark(f"  event: {event}" if alone else f"{file}: event: {event}")
    if form == "json":
        print_json(found[0] if alone else found)
    elif form != "table" and (text := render_annotations(problems, form, files)):
        print_text(text)
    return code


def _form(
    options: CheckCommand, files: Sequence[str]
) -> Literal["table", "json", "junit", "sarif", "github"]:
    refuse_two_inputs(files)
    if options.as_json and options.form not in ("table", "json"):
        raise InputError(f"--json and --format {options.form} exclude each other", hint="leave one out")
    return "json" if options.as_json else options.form


def _checked_file(file: str, options: CheckCommand) -> tuple[CheckedFile, MotionReference | None]:
    checked = check_file(file, options.part(CheckOptions), delivered=delivered_as)
    if not options.reference:
        return checked, None
    from trajcli.peers.motion_reference import compared

    judgement, beside = compared(checked)
    return replace(checked, judgement=judgement), beside


def _failed(judgement: Judgement, *, strict: bool) -> int:
    conceded = judgement.verdict != "satisfied" or bool(judgement.events)
    return int(not judgement.passed or (strict and conceded))


def _lines(checked: CheckedFile) -> Iterator[str]:
    judgement = checked.judgement
    rows = f"{judgement.rows} row{'s' * (judgement.rows != 1)}"
    period = "" if judgement.period is None else f", every {judgement.period:.9g} s"
    source = judgement.source or "-"
    planned = ", rows of the motion that the job plans" if judgement.planned_rows else ""
    planned += "" if judgement.planned_with is None else f" with `{judgement.planned_with}`"
    joined = _JOINED[judgement.interpolation]
    yield f"{source}: {judgement.verdict} ({rows}{period}, {joined}{planned})"
    listed = [*_listed(judgement.findings)]
    if listed:
        yield from shown_table([*_table(checked, listed)], (2, 1), ("times", "row", "t (s)", "stretch"))
        more = len(judgement.findings) - len(listed)
        if more > 0:
            yield f"  and {more} more: --format json has all of them"
    said = [finding.text(_say(checked)) for finding in judgement.findings if finding.value is None]
    ruled = [found for found in judgement.findings if found.rule not in _RULES and found.value is not None]
    said += [f"{found.rule}: {found.text(_say(checked))}" for found in ruled[:_MOST]]
    hints = (finding.hint for finding in judgement.findings if finding.hint is not None)
    for text in dict.fromkeys([*said, *hints, *_stretch(judgement), *judgement.notes]):
        yield f"  {text}"


def _view(beside: MotionReference) -> dict[str, Any]:
    """Return the comparison with peers as JSON has it, in SI."""
    path = beside.path_reference
    return {
        "duration": beside.duration,
        "ruckig": beside.reference.model_dump(),
        "toppra": None if path is None else path.model_dump(exclude={"own_use"}),
    }


def _beside(beside: MotionReference, units: Units) -> Iterator[str]:
    from trajcli.cli.plan import violation_lines
    from trajcli.job.report_parts import in_units

    reference, path = in_units(beside.reference, units), beside.path_reference
    if reference.duration is None:
        yield f"  no bound for the duration: {reference.joint}, {reference.reason}"
    elif reference.ratio is not None:
        fastest = f"the fastest between its ends ({reference.duration:.6g} s, {reference.joint}, ruckig)"
        yield f"  {beside.duration:.6g} s, {reference.ratio:.4g} x {fastest}"
    yield from violation_lines("ruckig", reference.violations)
    if path is not None:
        path = in_units(path, units)
        if path.duration is None or path.ratio is None:
            yield f"  {path.reason or 'nothing to move'}"
            return
        yield f"  {path.ratio:.4g} x toppra along the same path ({path.duration:.6g} s)"
        yield from violation_lines("toppra", path.violations)


def _listed(findings: Sequence[Finding]) -> Iterator[Finding]:
    """Yield the findings that a table has: the worst of each group."""
    counts = Counter[str]()
    for finding in findings:
        group = _group(finding)
        counts[group] += 1
        if counts[group] <= (_MOST if group == "exceeded" else _FEW):
            yield finding


def _group(finding: Finding) -> str:
    """Return the word of a table for how sure and how bad a finding is."""
    return "warning" if finding.severity == "warning" else finding.certainty


def _table(checked: CheckedFile, findings: Sequence[Finding]) -> Iterator[list[str]]:
    moves = any(finding.move is not None for finding in findings)
    head = ["", "kind", "joint", *(["move"] * moves), "value", "limit", "t (s)", "row", "times", "stretch"]
    yield head
    for finding in findings:
        of_move = ["-" if finding.move is None else str(finding.move)] * moves
        what = finding.kind if finding.quantity is None else f"{finding.kind} of {finding.quantity}"
        yield [
            _group(finding),
            what,
            finding.joint or "-",
            *of_move,
            _amount(checked, finding, "value", finding.value),
            _amount(checked, finding, "limit", finding.limit),
            "-" if finding.time is None else time_text(finding.time),
            "-" if finding.row is None else str(finding.row),
            str(finding.count),
            "" if finding.factor is None else at_least(finding.factor),
        ]


def _amount(checked: CheckedFile, finding: Finding, name: str, value: float | None) -> str:
    amount = finding.amounts.get(name)
    if isinstance(amount, Amount):
        return _say(checked)(amount)
    text = time_text if finding.kind == "time" else number
    return "-" if value is None else text(value)


def _say(checked: CheckedFile) -> Callable[[Amount], str]:
    return lambda amount: amount_text(amount, checked.robot.joint_types, checked.units)


def _stretch(judgement: Judgement) -> Iterator[str]:
    """Yield by what stretch of all of the motion its limits are kept, where that is what they need."""
    factors = [found.factor for found in judgement.errors if found.factor is not None]
    if factors and len(factors) == len(judgement.errors):
        yield f"the motion keeps these limits when it takes {at_least(max(factors))} times as long"


def _annotations(checked: CheckedFile, file: str) -> Iterator[Problem]:
    for finding in checked.judgement.findings:
        kind = finding.kind if finding.rule in _RULES else finding.rule
        yield replace(finding.problem(finding.text(_say(checked)), Place(file, 0, 0)), kind=kind)


_RULES = ("limit", "continuity", "time", "derivative", "state", "path")


def problems_of(checked: CheckedFile, *, every: bool) -> Iterator[Problem]:
    """Yield what is certainly wrong with a file, the worst first.

    Args:
        checked: The file.
        every: Whether each finding is said; otherwise the worst of each move and kind, with how many more.
    """
    alike: dict[object, list[Finding]] = {}
    for index, finding in enumerate(checked.judgement.errors):
        alike.setdefault(index if every else (finding.move, finding.kind), []).append(finding)
    for group in alike.values():
        problem = group[0].problem(f"{checked.motion.source}: {group[0].text(_say(checked))}")
        more = f" (and {len(group) - 1} more like it: --all)" if len(group) > 1 else ""
        yield replace(problem, message=problem.message + more)
