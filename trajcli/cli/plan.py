"""`trajcli plan`."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from trajcli.errors import InputError, Problem, VerificationError
from trajcli.job.read import read_job
from trajcli.pipeline.plan import Plan, plan_job
from trajcli.pipeline.write import check_output_name, grid_of, write_rows


@dataclass(frozen=True)
class PlanOptions:
    """What the command line says beside the job; see `trajcli plan --help`."""

    output: str | None = None
    report: str | None = None
    digits: Literal["fixed", "full"] = "fixed"
    strict: bool = False
    reference: bool = False
    no_output: bool = False
    quiet: bool = False


def run_plan(job: str, overrides: Sequence[str], options: PlanOptions) -> int:
    """Plan, judge and write a job; return the exit code.

    Raises:
        TrajcliError: When anything is wrong; then no rows were written.
    """
    _check_options(options)
    plan = plan_job(read_job(job, overrides))
    grid = grid_of(plan)
    if options.report is not None or options.reference:
        _report(plan, options)
    if not plan.verdict.passed:
        from trajcli.pipeline.report import verification_error

        raise verification_error(plan)
    if options.strict and plan.events:
        raise VerificationError(
            *(Problem(f"{event.kind}: {event.message}", move=event.move) for event in plan.events)
        )
    if not options.quiet:
        _summarise(plan, grid.count, options)
    if not options.no_output:
        write_rows(plan, grid, options.output, options.digits)
    return 0


def _check_options(options: PlanOptions) -> None:
    if options.output is not None:
        if options.no_output:
            raise InputError("--no-output and --output exclude each other", hint="leave one of them out")
        check_output_name(options.output)
    if options.report is not None and options.report == (options.output or "-") and not options.no_output:
        raise InputError(f"rows and report cannot both go to {options.report}", hint="name another file")


def _report(plan: Plan, options: PlanOptions) -> None:
    from trajcli.pipeline.report import report_of
    from trajcli.pipeline.write import write_report

    report = report_of(plan, reference=options.reference)
    if options.report is not None:
        write_report(report, options.report)
    for move in report.moves if options.reference and not options.quiet else []:
        bound = move.reference
        if bound is None:
            continue
        if bound.duration is None:
            text = f"no bound for {bound.joint}: {bound.reason}"
        elif bound.ratio is None:
            text = "nothing to move"
        else:
            text = f"{move.duration:.6g} s, {bound.ratio:.4g} x the fastest under the same limits ({bound.duration:.6g} s)"
        print(f"move {move.index} ({move.planner}): {text}", file=sys.stderr)  # noqa: T201


def _summarise(plan: Plan, rows: int, options: PlanOptions) -> None:
    from trajcli.cli.summary import summary

    print(summary(plan, rows=0 if options.no_output else rows), file=sys.stderr)  # noqa: T201
