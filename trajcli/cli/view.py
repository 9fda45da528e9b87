"""`trajcli view`: a page that shows the motion of a job or of a file, for any browser."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from trajcli.cli.outcome import print_remark
from trajcli.cli.progress import progress
from trajcli.errors import InputError, VerificationError
from trajcli.player.page import page_of
from trajcli.streams.byte_source import ByteSource
from trajcli.streams.reading import holds_motion
from trajcli.streams.whole_file import identity, is_special, standard_output, whole_file

if TYPE_CHECKING:
    from trajcli.cli.file_commands import ViewCommand
    from trajcli.judge.file import CheckedFile

_ENDINGS = (".html", ".htm")


def run_view(options: ViewCommand) -> int:
    """Write the page of a job or of a file of rows; return the exit code.

    A job that plans and does not verify has its page, too, and the error after it; so has a file that its job
    or robot does not allow.

    Raises:
        TrajcliError: When anything is wrong.
    """
    _check_output(options.output)
    if options.robot is not None or holds_motion(options.source):
        return _view_file(options)
    return _view_job(options)


def _view_job(options: ViewCommand) -> int:
    from trajcli.job.read import files_of, load_job
    from trajcli.output.delivery.delivered import plan_of
    from trajcli.player.scene import scene_of_plan

    loaded = load_job(options.source, options.override)
    _check_inputs_stay(options.output, [path for _, path in files_of(loaded.document)])
    with progress(), np.errstate(all="ignore"):  # what is not finite is for the checks to find
        plan = plan_of(loaded)
    page = page_of(scene_of_plan(plan), compress=options.compress)
    _write(page, options.output)
    if plan.verdict.passed:
        print_remark(
            f"{loaded.name}: verified, {plan.trajectory.duration:.6g} s{_where(page, options.output)}",
            verdict=True,
        )
        return 0
    from trajcli.output.report import verification_error

    print_remark(
        f"{loaded.name}: not verified{_where(page, options.output)}; the page shows the findings",
        verdict=True,
    )
    raise verification_error(plan, every=False)


def _view_file(options: ViewCommand) -> int:
    from trajcli.player.recorded import scene_of_file

    if options.override:
        raise InputError("--set is for jobs, and this is a file of samples", hint="leave it out")
    _check_inputs_stay(options.output, [options.source])
    opened = ByteSource(options.source)
    checked = None if options.robot is None else _judged(opened, options.robot)
    scene = scene_of_file(opened, options.robot, checked)
    page = page_of(scene, compress=options.compress)
    _write(page, options.output)
    state = scene["verdict"]["text"]
    print_remark(
        f"{scene['title']}: {state}, {scene['subtitle']}{_where(page, options.output)}", verdict=True
    )
    if checked is None or isinstance(checked, str) or checked.judgement.passed:
        return 0
    from trajcli.cli.judged_file import problems_of

    raise VerificationError(*problems_of(checked, every=False))


def _judged(source: ByteSource, robot: str) -> CheckedFile | str:
    """Return the judgement of a file by a job, or by the limits of a robot; else why there is none."""
    from trajcli.cli.judged_file import judged_file
    from trajcli.judge.file import CheckOptions
    from trajcli.queries.arm import names_job

    by_job = names_job(robot)
    return judged_file(source, CheckOptions(job=robot) if by_job else CheckOptions(robot=robot))


def _check_output(path: str | None) -> None:
    """Refuse to print a page on a terminal, and names that promise something else."""
    if path is None or path == "-":
        if sys.stdout is not None and sys.stdout.isatty():
            raise InputError("a page is not printed on a terminal", hint="say where it goes: -o view.html")
    elif not (path.lower().endswith(_ENDINGS) or is_special(path)):
        name = Path(path).name
        raise InputError(
            f"a page is HTML, and '{name}' is the name of something else", hint="name it like view.html"
        )


def _check_inputs_stay(output: str | None, inputs: Sequence[str]) -> None:
    same = None if output is None or output == "-" else identity(output)
    for path in inputs:
        if same is not None and same == identity(path, 0):
            raise InputError(f"the page to {output} would overwrite {path}", hint="name another file")


def _write(page: bytes, path: str | None) -> None:
    with standard_output() if path is None or path == "-" else whole_file(path) as out:
        out.write(page)


def _where(page: bytes, path: str | None) -> str:
    size = f"{len(page) / 1e6:.2f} MB"
    return f", {size}" if path is None or path == "-" else f", {path} ({size})"
