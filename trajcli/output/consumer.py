"""Rows of a plan as its consumer takes them, and their judgement by its rules, as they are written."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from trajcli.consumers.judgement import ProfileJudgement, judge_by_profile, load_profile
from trajcli.consumers.profile import Profile
from trajcli.consumers.rule_check import surroundings_of
from trajcli.errors import InputError, Problem, VerificationError
from trajcli.findings import Finding
from trajcli.grids import Grid
from trajcli.job.read import LoadedJob
from trajcli.job.report_parts import ConsumerFinding, ConsumerReport, UnjudgedRule
from trajcli.output.write import write_rows
from trajcli.planning.plan import Plan
from trajcli.progress import report_progress
from trajcli.streams.decimals import Digits
from trajcli.streams.formats import ENDINGS, FORMATS, StreamFormat

if TYPE_CHECKING:
    from trajcli.output.recording import LogOptions


def job_for(loaded: LoadedJob, name: str | None, kept: Mapping[str, bool]) -> tuple[LoadedJob, Profile, str]:
    """Return a job whose output is as a consumer takes it, the consumer, and what it brought.

    Args:
        loaded: The job.
        name: Of its profile, from the command line, where it goes before what the job says of its rows; None
            for that of the job, which goes behind.
        kept: Of `rate` and `rows`: whether the command line gives it.

    Raises:
        InputError: When there is no such profile, or it takes rows at another rate.
    """
    output = loaded.job.output
    try:
        profile = load_profile(name or output.consumer or "")
    except InputError as error:
        raise error if name else error.located(place=loaded.document.place(("output", "for"))) from None
    wanted, given = profile.rows, output.model_fields_set
    stays = {key: kept.get(key, False) if name else key in given for key in ("rate", "rows")}
    stays["times"] = not name and output.times is not None
    changed: dict[str, Any] = {"consumer": profile.name}
    if wanted.rate is not None:
        _refuse_other_rows(loaded, profile, stays)
        changed |= {"rate": wanted.rate, "times": None, "rows": "rate"}
    elif name and not stays["rows"]:
        changed["rows"] = None
    if wanted.align and (name or ("align" not in given and not stays["times"])):
        changed |= {"align": True, "times": None}
    if name or "columns" not in given:
        changed["columns"] = wanted.columns
    brought = f"{profile.name} takes {profile.rows.words}"
    differs = {key for key in changed if key in given and getattr(output, key) != changed[key]}
    said = f"{brought}: that goes before `output` of the job" if differs - {"consumer"} else ""
    return loaded.with_output(changed), profile, said


def _refuse_other_rows(loaded: LoadedJob, profile: Profile, stays: Mapping[str, bool]) -> None:
    """Refuse rows at other times than those of a consumer with a rate of its own."""
    output, rate = loaded.job.output, profile.rows.rate
    wrong = ("rate", f"{output.rate:g} Hz") if stays["rate"] and output.rate != rate else None
    if stays["rows"] and output.rows in ("knots", "both"):
        wrong = "rows", f"`rows: {output.rows}`"
    if stays["times"]:
        wrong = "times", "`times`"
    if wrong is not None:
        key, what = wrong
        text = f"{profile.name} takes rows at {rate:g} Hz, and {what} is asked for"
        raise InputError(text, hint=f"leave the {key} out").located(
            place=loaded.document.place(("output", key))
        )


def judge_as_written(
    plan: Plan,
    grid: Grid,
    profile: Profile,
    form: StreamFormat,
    *,
    digits: Digits = "fixed",
    log: LogOptions | None = None,
) -> ProfileJudgement:
    """Return what the rows of a plan do against the rules of a consumer.

    They are written to a file that nobody keeps, and read back as those of a stranger: format, decimals, rate
    and columns count as they are.

    Args:
        plan: A plan that verifies.
        grid: Where its rows stand.
        profile: The rules.
        form: The format.
        digits: Of numbers that are written as text.
        log: What the command line says about a log.

    Raises:
        InputError: When the rows have no times or positions.
        FileError: When there is no room for the file.
    """
    from trajcli.streams.recorded_motion import open_motion

    robot = plan.loaded.robot
    around = surroundings_of(robot, plan.moves[0].start.position)
    with TemporaryDirectory(prefix="trajcli-") as folder:
        path = str(Path(folder) / f"rows{_ending(form)}")
        write_rows(plan, grid, path, digits, form=form, log=log)
        report_progress(f"judging the rows by {profile.name}")
        try:
            motion = open_motion(path, joints=robot.joint_names, joint_types=robot.joint_types)
        except InputError as error:
            text = f"the rows cannot be judged by {profile.name}: {error.problems[0].message}"
            raise InputError(text, hint="`output.columns` needs t and q") from None
        judged = judge_by_profile(motion.blocks(), profile, around)
    before = plan.trajectory.start_time * (form.content == "knots")  # times of a goal begin with 0
    findings = tuple(replace(found, time=(found.time or 0.0) + before) for found in judged.findings)
    return replace(judged, findings=findings)


def _ending(form: StreamFormat) -> str:
    return next(ending for ending, names in ENDINGS.items() if any(FORMATS[name] is form for name in names))


def refusal_of(plan: Plan, judged: ProfileJudgement, *, strict: bool) -> VerificationError | None:
    """Return why no rows are written for a consumer: its necessary rules, with `strict` all, are broken."""
    wanted = ("error", "warning") if strict else ("error",)
    broken = [found for found in judged.findings if found.severity in wanted]
    return VerificationError(*(_problem(plan, found) for found in broken)) if broken else None


def _problem(plan: Plan, finding: Finding) -> Problem:
    placed = in_trajectory(plan, finding)
    text = f"{finding.rule}: {finding.message}{counted(finding)}"
    return replace(placed.problem(text, plan.loaded.place_of_move(placed.move or 0)), kind=finding.rule)


def counted(finding: Finding) -> str:
    """Return in brackets how many rows break a rule beside the one that is named; nothing where none does."""
    return f" (and {finding.count - 1} more row{'s' * (finding.count > 2)})" if finding.count > 1 else ""


def in_trajectory(plan: Plan, finding: Finding) -> Finding:
    """Return a finding about rows with its time and move in the trajectory, at a border the later move."""
    time = (finding.time or 0.0) - plan.trajectory.start_time
    move = plan.trajectory.span_at(time).index if finding.move is None else finding.move
    return replace(finding, time=time, move=move)


def consumer_report(plan: Plan, judged: ProfileJudgement) -> ConsumerReport:
    """Return the part of the report about a consumer."""
    return ConsumerReport(
        profile=judged.profile.name,
        accepted=judged.accepted,
        findings=[ConsumerFinding.model_validate(in_trajectory(plan, found)) for found in judged.findings],
        unjudged=[UnjudgedRule(rule=rule, reason=reason) for rule, reason in judged.unjudged],
    )
