"""Plans as they are delivered: for the consumer that a job names, where it names one.

Files of rows are judged by what their job delivers.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from trajcli.errors import TrajcliError
from trajcli.job.read import LoadedJob
from trajcli.planning.plan import Carried, Plan, plan_job

if TYPE_CHECKING:
    from trajcli.consumers.judgement import ProfileJudgement
    from trajcli.job.report import Report
    from trajcli.judge.file import CheckedFile, CheckOptions
    from trajcli.judge.judgement import Judgement
    from trajcli.output.delivery.joined_rows import JoinedRows
    from trajcli.streams.byte_source import ByteSource
    from trajcli.streams.decimals import Digits
    from trajcli.streams.formats import StreamFormat


def delivered(
    loaded: LoadedJob,
    profile: str | None = None,
    form: StreamFormat | None = None,
    *,
    rows: bool = False,
    strict: bool = False,
    carried: Carried | None = None,
) -> tuple[Plan, Digits]:
    """Return the plan of a job for its consumer, where there is one, and with which digits it is written.

    With findings it is no error here.

    Args:
        loaded: The job.
        profile: Of the consumer, instead of the one that the job names.
        form: In which the rows are written; None for a table.
        rows: Whether somebody else than the job says where they stand.
        strict: Whether events are an error, and warnings of the consumer's rules.
        carried: What the tool carries in a move instead, as in `plan_job`.

    Raises:
        VerificationError: When its rows, as the consumer joins them, keep neither rules nor limits.
        InputError: When a move loosens a limit, or lacks one it needs; or there is no such consumer.
        PlanningError: When a move has no curve.
    """
    if profile is None and loaded.job.output.consumer is None:
        plan = plan_job(loaded, carried, advise=carried is None)
        if strict and plan.verdict.passed:
            from trajcli.output.delivery.joined import joined_rows, with_event
            from trajcli.output.write import grid_of
            from trajcli.streams.formats import DEFAULT

            form = form or DEFAULT
            _refuse_events(with_event(plan, joined_rows(plan, grid_of(plan), form, "fixed"), form)[0])
        return plan, "fixed"
    from trajcli.output.consumer import job_for, refusal_of
    from trajcli.output.delivery.for_consumer import Writing, plan_for, refusal
    from trajcli.streams.formats import DEFAULT

    made = plan_for(*job_for(loaded, profile, {"rows": rows}), Writing(form or DEFAULT), carried)
    if made.plan.verdict.passed:
        if strict:
            _refuse_events(made.plan)
        broken = None if made.rules is None else refusal_of(made.plan, made.rules, strict=strict)
        if broken or made.over:
            raise broken or refusal(made, ())
    return made.plan, made.digits


def _refuse_events(plan: Plan) -> None:
    if plan.events:
        from trajcli.output.report import concession_error

        raise concession_error(plan)


def report_with_rows(
    plan: Plan,
    rows: tuple[JoinedRows, Judgement] | None,
    rules: ProfileJudgement | None,
    *,
    peers: bool = False,
) -> Report:
    """Return the report of a plan, with those of its rows, joined, and of what they do against rules."""
    from trajcli.output.consumer import consumer_report
    from trajcli.output.delivery.joined import rows_report
    from trajcli.output.report import report_of

    said: dict[str, Any] = {} if rows is None else {"rows": rows_report(*rows)}
    said |= {} if rules is None else {"consumer": consumer_report(plan, rules)}
    return report_of(plan, peers=peers).model_copy(update=said)


def report_as_delivered(plan: Plan) -> Report:
    """Return the report of a plan, with that of its rows as CSV, as `trajcli plan --report` writes it."""
    from trajcli.output.delivery.joined import joined_rows, with_event
    from trajcli.output.write import grid_of
    from trajcli.streams.formats import DEFAULT

    if not plan.verdict.passed:
        return report_with_rows(plan, None, None)
    consumer = plan.loaded.job.output.consumer
    if consumer is None:
        rows = joined_rows(plan, grid_of(plan), DEFAULT)
        plan, judged = with_event(plan, rows, DEFAULT)
        return report_with_rows(plan, None if judged is None else (rows, judged), None)
    from trajcli.consumers.judgement import load_profile
    from trajcli.output.delivery.for_consumer import Writing, rows_for

    made = rows_for(plan, load_profile(consumer), Writing(DEFAULT))
    return report_with_rows(plan, None if made.joined is None else (made.rows, made.joined), made.rules)


def plan_of(loaded: LoadedJob, profile: str | None = None, carried: Carried | None = None) -> Plan:
    """Return the plan of a job for its consumer, where there is one; see `delivered`.

    Raises:
        VerificationError: When its rows, as the consumer joins them, keep neither rules nor limits.
        InputError: When a move loosens a limit, or lacks one it needs; or there is no such consumer.
        PlanningError: When a move has no curve.
    """
    return delivered(loaded, profile, carried=carried)[0]


def delivered_as(loaded: LoadedJob, profile: str | None, form: str) -> Plan:
    """Return the plan of a job for a consumer, as it is written in a format of that name; see `delivered`."""
    from trajcli.streams.formats import DEFAULT, FORMATS

    named = {"fields": "npz"}.get(form, form)
    return delivered(loaded, profile, next((FORMATS[name] for name in FORMATS if name == named), DEFAULT))[0]


def judged_file(source: ByteSource, options: CheckOptions, plan: Plan | None = None) -> CheckedFile | str:
    """Return the judgement of a file; why there is none where nothing of it can be judged.

    Args:
        source: The file.
        options: What it is judged by.
        plan: Of a job that was planned before.
    """
    from trajcli.judge.file import check_file

    try:
        with np.errstate(all="ignore"):  # what is not finite is for the judge to find
            return check_file(source, options, plan, delivered_as)
    except TrajcliError as error:
        return error.problems[0].text()


def judged_by(source: ByteSource, arm: str) -> CheckedFile | str:
    """Return the judgement of a file by a job, or by the limits of a robot; else why there is none."""
    from trajcli.judge.file import CheckOptions
    from trajcli.queries.arm import names_job

    return judged_file(source, CheckOptions(job=arm) if names_job(arm) else CheckOptions(robot=arm))
