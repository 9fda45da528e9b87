"""Judgement of a plan by the rules of its consumer: of its rows as they are written."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from trajcli.consumers.breach import RuleBreach, Surroundings
from trajcli.consumers.judgement import ProfileJudgement, judge_by_profile
from trajcli.consumers.profile import Profile
from trajcli.errors import InputError, Problem, VerificationError
from trajcli.grids import Grid
from trajcli.job.reports.comparisons import ConsumerFinding, ConsumerReport, UnjudgedRule
from trajcli.output.write import write_rows
from trajcli.planning.plan import Plan
from trajcli.progress import report_progress
from trajcli.streams.decimals import Digits
from trajcli.streams.formats import ENDINGS, FORMATS, StreamFormat

if TYPE_CHECKING:
    from trajcli.output.recording import LogOptions


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
    around = Surroundings(robot.joint_names, plan.trajectory.start.position, robot.limits)
    with TemporaryDirectory(prefix="trajcli-") as folder:
        path = str(Path(folder) / f"rows{_ending(form)}")
        write_rows(plan, grid, path, digits, form=form, log=log)
        report_progress(f"judging the rows by {profile.name}")
        try:
            motion = open_motion(path, joints=robot.joint_names, joint_types=robot.joint_types)
        except InputError as error:
            text = f"the rows cannot be judged by {profile.name}: {error.problems[0].message}"
            raise InputError(text, hint="`output.columns` needs t and q") from None
        return judge_by_profile(motion.blocks(), profile, around)


def _ending(form: StreamFormat) -> str:
    return next(ending for ending, names in ENDINGS.items() if any(FORMATS[name] is form for name in names))


def refusal_of(plan: Plan, judged: ProfileJudgement, *, strict: bool) -> VerificationError | None:
    """Return why no rows are written for a consumer: its necessary rules, with `strict` all, are broken."""
    wanted = ("error", "warning") if strict else ("error",)
    broken = [breach for breach in judged.breaches if breach.severity in wanted]
    return VerificationError(*(_problem(plan, breach) for breach in broken)) if broken else None


def _problem(plan: Plan, breach: RuleBreach) -> Problem:
    index = _move(plan, breach)
    return Problem(
        f"{breach.rule}: {breach.message}{counted(breach)}",
        breach.hint,
        place=plan.loaded.place_of_move(index),
        move=index,
        joint=breach.joint,
        time=breach.time - plan.trajectory.start_time,
        value=breach.value,
        limit=breach.limit,
        kind=breach.rule,
    )


def counted(breach: RuleBreach) -> str:
    """Return in brackets how many rows break a rule beside the one that is named; nothing where none does."""
    return f" (and {breach.count - 1} more row{'s' * (breach.count > 2)})" if breach.count > 1 else ""


def _move(plan: Plan, breach: RuleBreach) -> int:
    """Return the move in which a breach is; at a border the later one."""
    if breach.move is not None:
        return breach.move
    return plan.trajectory.span_at(breach.time - plan.trajectory.start_time).index


def consumer_report(plan: Plan, judged: ProfileJudgement) -> ConsumerReport:
    """Return the part of the report about a consumer."""
    return ConsumerReport(
        profile=judged.profile.name,
        accepted=judged.accepted,
        findings=_findings(plan, judged.breaches),
        unjudged=[UnjudgedRule(rule=rule, reason=reason) for rule, reason in judged.unjudged],
    )


def _findings(plan: Plan, breaches: Sequence[RuleBreach]) -> list[ConsumerFinding]:
    return [
        ConsumerFinding(
            rule=breach.rule,
            severity=breach.severity,
            kind=breach.kind,
            joint=breach.joint,
            move=_move(plan, breach),
            time=breach.time - plan.trajectory.start_time,
            row=breach.row,
            count=breach.count,
            factor=breach.factor,
            method=breach.method,
            message=breach.message,
            hint=breach.hint,
        )
        for breach in breaches
    ]
