"""`trajcli plot`: pictures of a job and of sample streams."""

from __future__ import annotations

import logging
import sys
from collections.abc import Sequence
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING

import numpy as np

from trajcli.cli.outcome import print_remark
from trajcli.cli.progress import progress
from trajcli.errors import InputError, Problem, VerificationError
from trajcli.job.read import files_of, load_job
from trajcli.output.delivery.delivered import judged_file, plan_of
from trajcli.planning.plan import Plan
from trajcli.plots.choice import parse_quantities, split_names
from trajcli.plots.picture import picture_of
from trajcli.plots.write import format_of_picture, rendered
from trajcli.streams.byte_source import ByteSource
from trajcli.streams.reading import is_job, read_table
from trajcli.streams.whole_file import kind_of, refuse_overwriting, write_content

if TYPE_CHECKING:
    from trajcli.cli.file_commands import PlotCommand
    from trajcli.judge.file import CheckedFile


def run_plot(options: PlotCommand) -> int:
    """Draw a job, files, or files over a job; return the exit code.

    Raises:
        VerificationError: When the job fails its verification, or a file over it exceeds what the job asks
            for: behind the picture, which shows where.
        TrajcliError: When anything else is wrong; then nothing was written.
    """
    kind = format_of_picture(options.output, options.kind)
    wanted = None if options.quantities is None else parse_quantities(options.quantities)
    files, joints = _files_and_joints(options.files, split_names(tuple(options.joints)))
    jobs, rows = _sorted_out(files, options.override)
    target = options.output or f"{_stem((jobs or rows)[0])}.{kind}"
    if target == "-" and kind != "svg" and sys.stdout is not None and sys.stdout.isatty():
        raise InputError(
            f"a terminal shows no {kind}", hint=f"name a file: -o {_stem((jobs or rows)[0])}.{kind}"
        )
    plans = [_planned(job, options.override) for job in jobs]
    plan, second = (*plans, None, None)[:2]
    read = [file for plan in plans for file in files_of(plan.loaded.document)]
    refuse_overwriting([("the picture", target)], [*read, *(("the rows of", name) for name in rows)])
    sources = [ByteSource(name) for name in rows]
    names = None if plan is None else plan.loaded.robot.joint_names
    tables = [read_table(source, joints=names) for source in sources]
    judged = [] if plan is None else _checked_files(sources, plan, options)
    logging.getLogger("matplotlib").setLevel(logging.ERROR)  # where its caches are is nobody's concern
    with np.errstate(all="ignore"):  # what is not finite was found by the checks
        judgements = [None if checked is None else checked.judgement for checked in judged]
        picture = picture_of(plan, tables, wanted, joints, judgements, second)
        write_content(rendered(picture, kind), target)
    if target != "-" and not options.quiet:
        print_remark(f"{target} written")
    _refuse_findings(plans, judged, options)
    return 0


def _checked_files(
    sources: Sequence[ByteSource], plan: Plan, options: PlotCommand
) -> list[CheckedFile | None]:
    """Return the judgement of each file by the job; None, with a remark, where it cannot be judged."""
    if not sources:
        return []
    from trajcli.judge.file import CheckOptions

    judged: list[CheckedFile | None] = []
    for source in sources:
        checked = judged_file(source, CheckOptions(), plan)
        if isinstance(checked, str) and not options.quiet:
            print_remark(f"{source.file} is not judged: {checked}")
        judged.append(None if isinstance(checked, str) else checked)
    return judged


def _refuse_findings(
    plans: Sequence[Plan], judged: Sequence[CheckedFile | None], options: PlotCommand
) -> None:
    """Raise what is wrong with the plans, and what is certainly wrong with the files."""
    problems: list[Problem] = []
    every = options.every or options.errors == "json"
    for plan in plans:
        if plan.verdict.passed:
            continue
        from trajcli.output.report import verification_error

        problems += verification_error(plan, every=every).problems
    for checked in judged:
        if checked is not None and not checked.judgement.passed:
            from trajcli.cli.check import problems_of

            problems += problems_of(checked, every=every)
    if problems:
        raise VerificationError(*problems)


def _planned(job: str, overrides: Sequence[str]) -> Plan:
    with progress(), np.errstate(all="ignore"):
        return plan_of(load_job(job, overrides))


def _files_and_joints(words: Sequence[str], joints: Sequence[str]) -> tuple[list[str], tuple[str, ...]]:
    """Return the files among the words, and all joints: `--joints a b` leaves the second one to the words."""
    if not joints:
        return list(words), ()
    files = [word for word in words if word == "-" or kind_of(word) or Path(word).suffix]
    if not files:
        raise InputError("there is no file to plot", hint="name a job or a file of rows before --joints")
    return files, (*joints, *(word for word in words if word not in files))


def _sorted_out(files: Sequence[str], overrides: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return the jobs, at most two, and the files of rows."""
    if files.count("-") > 1:
        raise InputError("only one of the files can be standard input")
    jobs = [name for name in files if is_job(name)]
    if len(jobs) > 2:
        hint = f"write the rows of the others, and plot these: trajcli plan {quote(jobs[2])} -o rows.csv"
        raise InputError(f"two jobs can be plotted, and there are {len(jobs)}", hint=hint)
    if overrides and not jobs:
        raise InputError(
            "--set overrides values of a job, and there is none", hint="leave it out, or name the job"
        )
    return jobs, [name for name in files if name not in jobs]


def _stem(name: str) -> str:
    return "plot" if name == "-" else Path(name).stem
