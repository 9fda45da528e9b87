"""Judgement of several jobs, and annotations of jobs for continuous integration."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace

from trajcli.cli.outcome import BUG, ErrorForm, report_bug, report_error
from trajcli.cli.plan import PlanOptions, plan_and_write
from trajcli.errors import InputError, Place, Problem, TrajcliError
from trajcli.output.annotations import AnnotationForm, annotations_of, render_annotations
from trajcli.planning.plan import Plan

_EXCLUDED = ("output", "report", "resolved")


def run_gate(jobs: Sequence[str], overrides: Sequence[str], options: PlanOptions, form: ErrorForm) -> int:
    """Plan and judge each job, whatever is wrong with the others; return the worst exit code.

    Args:
        jobs: Several are judged only.
        overrides: Of each of them.
        options: What the command line says beside the jobs.
        form: How errors are written.

    Raises:
        InputError: When several jobs would be written.
    """
    if len(jobs) > 1:
        _check_nothing_is_written(options)
    if form == "text" or form == "json":
        return max(_judged(job, overrides, options, form) for job in jobs)
    return _annotated(jobs, overrides, options, form)


def _check_nothing_is_written(options: PlanOptions) -> None:
    if not options.no_output:
        hint = "only judge them with --no-output, or write them with `trajcli batch`"
        raise InputError("several jobs cannot be written to one stream", hint=hint)
    for name in (name for name in _EXCLUDED if getattr(options, name) is not None):
        raise InputError(f"--{name} is about one job, and there are several", hint="name one job")


def _judged(job: str, overrides: Sequence[str], options: PlanOptions, form: ErrorForm) -> int:
    """Judge one of several jobs; report what is wrong with it, and return its exit code."""
    try:
        plan_and_write(job, overrides, options)
    except TrajcliError as error:
        report_error(error, form)
        return error.exit_code
    except OSError:
        raise
    except Exception as error:  # noqa: BLE001
        return report_bug(error, form)
    return 0


def _annotated(
    jobs: Sequence[str], overrides: Sequence[str], options: PlanOptions, form: AnnotationForm
) -> int:
    """Judge jobs; write one document, or a line for each annotation; return the worst exit code."""
    code = 0
    found: list[Problem] = []
    quiet = options if form == "github" else replace(options, quiet=True)  # a document stands alone
    for job in jobs:
        try:
            found += _concessions(plan_and_write(job, overrides, quiet), job)
        except TrajcliError as error:
            found += annotations_of(error, job)
            code = max(code, error.exit_code)
        except OSError:
            raise
        except Exception as error:  # noqa: BLE001
            found += annotations_of(TrajcliError(Problem(f"a bug in trajcli: {error}")), job)
            code = max(code, BUG)
    print(render_annotations(found, form, jobs), end="", file=sys.stderr)  # noqa: T201
    return code


def _concessions(plan: Plan, job: str) -> Iterator[Problem]:
    """Yield what was conceded in a plan that verifies."""
    for event in plan.events:
        if event.concedes:
            place = Place(job, 0, 0) if event.move is None else plan.loaded.place_of_move(event.move)
            text = event.text(plan.loaded.say)
            yield Problem(text, place=place, kind=event.kind, severity="warning")
