"""Plans of jobs: one that is written, or several that are judged, with annotations for CI."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from trajcli.cli.outcome import BUG, report_bug, report_error
from trajcli.cli.plan import plan_and_write
from trajcli.errors import InputError, Place, Problem, TrajcliError
from trajcli.planning.plan import Plan

if TYPE_CHECKING:
    from trajcli.cli.job_commands import PlanCommand
    from trajcli.output.annotations import AnnotationForm

_EXCLUDED = ("output", "report", "resolved")


def run_plan(options: PlanCommand) -> int:
    """Plan and judge each job, whatever is wrong with the others; return the worst exit code.

    Raises:
        InputError: When several jobs would be written.
    """
    jobs, form = [options.job, *options.others], options.errors
    if jobs.count("-") > 1:
        raise InputError("standard input can be read once")
    if len(jobs) > 1:
        _check_nothing_is_written(options)
    if form == "text" or form == "json":
        return max(_exit_code_of_job(job, options) for job in jobs)
    return _annotated(jobs, options, form)


def _check_nothing_is_written(options: PlanCommand) -> None:
    if not options.no_output:
        hint = "only judge them with --no-output, or write them with `trajcli batch`"
        raise InputError("several jobs cannot be written to one stream", hint=hint)
    for name in (name for name in _EXCLUDED if getattr(options, name) is not None):
        raise InputError(f"--{name} is about one job, and there are several", hint="name one job")


def _exit_code_of_job(job: str, options: PlanCommand) -> int:
    """Judge one of several jobs; report what is wrong with it, and return its exit code."""
    try:
        plan_and_write(job, options)
    except TrajcliError as error:
        report_error(error, options.errors)
        return error.exit_code
    except OSError:
        raise
    except Exception as error:  # noqa: BLE001
        return report_bug(error, options.errors)
    return 0


def _annotated(jobs: Sequence[str], options: PlanCommand, form: AnnotationForm) -> int:
    """Judge jobs; write one document, or a line for each annotation; return the worst exit code."""
    from trajcli.output.annotations import annotations_of, render_annotations

    code = 0
    found: list[Problem] = []
    quiet = options if form == "github" else options.replaced(quiet=True)  # a document stands alone
    for job in jobs:
        try:
            found += _concessions(plan_and_write(job, quiet), job)
        except TrajcliError as error:
            found += annotations_of(error, job)
            code = max(code, error.exit_code)
        except OSError:
            raise
        except Exception as error:  # noqa: BLE001
            from trajcli.version import library_error

            of_library = library_error(error)
            found += annotations_of(of_library or TrajcliError(Problem(f"a bug in trajcli: {error}")), job)
            code = max(code, of_library.exit_code if of_library else BUG)
    print(render_annotations(found, form, jobs), end="", file=sys.stderr)  # noqa: T201
    return code


def _concessions(plan: Plan, job: str) -> Iterator[Problem]:
    """Yield what was conceded in a plan that verifies."""
    for event in plan.events:
        place = Place(job, 0, 0) if event.move is None else plan.loaded.place_of_move(event.move)
        text = event.text(plan.loaded.say)
        yield Problem(text, place=place, kind=event.kind, severity="warning")
