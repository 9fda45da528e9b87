"""Plans as they are delivered: for the consumer that a job names, where it names one."""

from __future__ import annotations

from trajcli.job.read import LoadedJob
from trajcli.planning.plan import Plan, plan_job
from trajcli.streams.decimals import Digits
from trajcli.streams.formats import DEFAULT, StreamFormat


def delivered(
    loaded: LoadedJob, profile: str | None = None, form: StreamFormat = DEFAULT, *, rows: bool = False
) -> tuple[Plan, Digits]:
    """Return the plan of a job for its consumer, where there is one, and with which digits it is written.

    With findings it is no error here.

    Args:
        loaded: The job.
        profile: Of the consumer, instead of the one that the job names.
        form: In which the rows are written.
        rows: Whether somebody else than the job says where they stand.

    Raises:
        VerificationError: When its rows, as the consumer joins them, keep neither rules nor limits.
        InputError: When a move loosens a limit, or lacks one it needs; or there is no such consumer.
        PlanningError: When a move has no curve.
    """
    if profile is None and loaded.job.output.consumer is None:
        return plan_job(loaded), "fixed"
    from trajcli.output.for_consumer import Writing, job_for, plan_for, refusal

    made = plan_for(*job_for(loaded, profile, {"rows": rows}), Writing(form))
    if made.plan.verdict.passed and not made.keeps:
        raise refusal(made, ())
    return made.plan, made.digits


def plan_of(loaded: LoadedJob, profile: str | None = None) -> Plan:
    """Return the plan of a job for its consumer, where there is one; see `delivered`.

    Raises:
        VerificationError: When its rows, as the consumer joins them, keep neither rules nor limits.
        InputError: When a move loosens a limit, or lacks one it needs; or there is no such consumer.
        PlanningError: When a move has no curve.
    """
    return delivered(loaded, profile)[0]
