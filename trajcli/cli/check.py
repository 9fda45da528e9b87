"""Judgement of anybody's trajectory on the command line: `trajcli check`."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from trajcli.cli.numbers import number, table_lines
from trajcli.cli.outcome import print_json, print_lines, print_remark
from trajcli.errors import Amount, Place, Problem, at_least
from trajcli.findings import Finding
from trajcli.judge.file import CheckedFile, CheckOptions, check_file
from trajcli.judge.judgement import Judgement
from trajcli.units import Units, amount_text

if TYPE_CHECKING:
    from trajcli.cli.job_commands import CheckCommand
    from trajcli.job.read import LoadedJob
    from trajcli.peers.motion_reference import MotionReference
    from trajcli.planning.plan import Plan

_MOST, _FEW = 30, 4  # findings that a table lists: of those that are certain, and of each other group
_JOINED = {
    "hold": "held from row to row",
    "linear": "joined by straight lines",
    "cubic": "joined by cubics",
    "quintic": "joined by quintics",
    "jtc": "joined as the joint_trajectory_controller does",
    "jtc-upsampling": "joined by the spline of the joint_trajectory_controller",
}


def _delivered(loaded: LoadedJob, profile: str | None) -> Plan:
    """Return the plan of a job for a consumer."""
    from trajcli.output.delivered import plan_of

    return plan_of(loaded, profile)


def run_check(options: CheckCommand) -> int:
    """Judge a file and print what was found; return 0 when nothing is certainly wrong, else 1.

    Raises:
        InputError: When the file is no trajectory, or options do not fit.
        FileError: When a file cannot be read.
    """
    checked = check_file(options.file, options.part(CheckOptions), delivered=_delivered)
    beside = None
    if options.reference:
        from trajcli.peers.motion_reference import compared

        judgement, beside = compared(checked)
        checked = replace(checked, judgement=judgement)
    judgement = checked.judgement
    if options.form == "json":
        print_json(judgement.as_json() | ({} if beside is None else {"reference": _view(beside)}))
    elif options.form == "table":
        print_lines([*_lines(checked), *([] if beside is None else _beside(beside, checked.units))])
    else:
        from trajcli.output.annotations import render_annotations

        text = render_annotations([*_annotations(checked, options.file)], options.form, [options.file])
        if text:
            print_lines([text.removesuffix("\n")])
    for event in judgement.events:
        print_remark(f"  event: {event}")
    return int(
        not judgement.passed
        or (options.strict and (judgement.verdict != "satisfied" or bool(judgement.events)))
    )


def _lines(checked: CheckedFile) -> Iterator[str]:
    judgement = checked.judgement
    rows = f"{judgement.rows} row{'s' * (judgement.rows != 1)}"
    period = "" if judgement.period is None else f", every {judgement.period:.9g} s"
    source = judgement.source or "-"
    planned = ", rows of the motion that the job plans" if judgement.planned_rows else ""
    joined = _JOINED[judgement.interpolation]
    yield f"{source}: {judgement.verdict} ({rows}{period}, {joined}{planned})"
    listed = [*_listed(judgement.findings)]
    if listed:
        yield from table_lines([*_table(checked, listed)])
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
    """Yield how a motion compares with peers."""
    from trajcli.cli.plan import violation_lines
    from trajcli.job.reports.part import in_units

    reference, path = in_units(beside.reference, units), beside.path_reference
    if reference.duration is None:
        yield f"  no bound for the duration: {reference.joint}, {reference.reason}"
    elif reference.ratio is not None:
        fastest = f"the fastest between its ends ({reference.duration:.6g} s, {reference.joint}, ruckig)"
        yield f"  {beside.duration:.6g} s, {reference.ratio:.4g} x {fastest}"
    yield from violation_lines("ruckig", reference.violations, "  ")
    if path is not None:
        path = in_units(path, units)
        if path.duration is None or path.ratio is None:
            yield f"  {path.reason or 'nothing to move'}"
            return
        yield f"  {path.ratio:.4g} x toppra along the same path ({path.duration:.6g} s)"
        yield from violation_lines("toppra", path.violations, "  ")


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
            "-" if finding.time is None else f"{finding.time:.9g}",
            "-" if finding.row is None else str(finding.row),
            str(finding.count),
            "" if finding.factor is None else at_least(finding.factor),
        ]


def _amount(checked: CheckedFile, finding: Finding, name: str, value: float | None) -> str:
    """Return a number of a finding in the units of the reader."""
    amount = finding.amounts.get(name)
    if isinstance(amount, Amount):
        return _say(checked)(amount)
    return "-" if value is None else number(value)


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
