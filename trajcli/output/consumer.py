"""Judgement of a plan by the rules of its consumer: of its rows as they are written."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from trajcli.consumers.judgement import ProfileJudgement, judge_by_profile
from trajcli.consumers.profile import Profile
from trajcli.consumers.rule_check import Surroundings
from trajcli.errors import InputError, Problem, VerificationError
from trajcli.findings import Finding
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
    around = Surroundings(robot.joint_names, plan.moves[0].start.position, robot.limits)
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
    broken = [found for found in judged.findings if found.severity in wanted]
    return VerificationError(*(_problem(plan, found) for found in broken)) if broken else None


def _problem(plan: Plan, finding: Finding) -> Problem:
    placed = _placed(plan, finding)
    text = f"{finding.rule}: {finding.message}{counted(finding)}"
    return replace(placed.problem(text, plan.loaded.place_of_move(placed.move or 0)), kind=finding.rule)


def counted(finding: Finding) -> str:
    """Return in brackets how many rows break a rule beside the one that is named; nothing where none does."""
    return f" (and {finding.count - 1} more row{'s' * (finding.count > 2)})" if finding.count > 1 else ""


def _placed(plan: Plan, finding: Finding) -> Finding:
    """Return a finding about rows with its time and move in the trajectory, at a border the later move."""
    time = (finding.time or 0.0) - plan.trajectory.start_time
    move = plan.trajectory.span_at(time).index if finding.move is None else finding.move
    return replace(finding, time=time, move=move)


def consumer_report(plan: Plan, judged: ProfileJudgement) -> ConsumerReport:
    """Return the part of the report about a consumer."""
    return ConsumerReport(
        profile=judged.profile.name,
        accepted=judged.accepted,
        findings=[ConsumerFinding.model_validate(_placed(plan, found)) for found in judged.findings],
        unjudged=[UnjudgedRule(rule=rule, reason=reason) for rule, reason in judged.unjudged],
    )
