"""`trajcli view`: a page that shows the motion of a job or of a file, for any browser."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Sequence
from shlex import join
from typing import TYPE_CHECKING, Any

import numpy as np

from trajcli.cli.outcome import print_remark
from trajcli.cli.progress import progress
from trajcli.errors import InputError, Problem, VerificationError
from trajcli.frozen import frozen
from trajcli.player.page import check_page_name, page_of
from trajcli.player.scene import BUDGET, scene_of_plan, scene_of_two
from trajcli.streams.byte_source import ByteSource
from trajcli.streams.reading import holds_motion, is_job
from trajcli.streams.whole_file import refuse_overwriting, write_content

if TYPE_CHECKING:
    from trajcli.cli.file_commands import ViewCommand
    from trajcli.planning.plan import Plan


def run_view(options: ViewCommand) -> int:
    """Write the page of a job or of a file of rows, or of two; return the exit code.

    A job that plans and does not verify has its page, too, and the error after it; so has a file that its job
    or robot does not allow.

    Raises:
        TrajcliError: When anything is wrong.
    """
    _check_output(options.output)
    if len(options.sources) > 2:
        hint = f"trajcli view {join(options.sources[:2])}"
        raise InputError(f"a page shows one motion or two, and {len(options.sources)} are named", hint=hint)
    jobs = [options.robot is None and is_job(name) for name in options.sources]
    if options.override and not any(jobs):
        raise InputError("--set is for jobs, and this is a file of samples", hint="leave it out")
    every = options.every or options.errors == "json"
    if options.sources.count("-") > 1:
        raise InputError("standard input can be read once", hint="name the file of the job, or of the rows")
    plans = {name: _planned(name, options) for name, job in zip(options.sources, jobs, strict=True) if job}
    by = options.robot or next(iter(plans.values()), None)
    shown = [
        _shown_plan(plans[name], options, every)
        if name in plans
        else _shown_file(name, by, options.output, options.meshes, every=every)
        for name in options.sources
    ]
    return _written(shown, options)


def write_comparison(first: str, second: str, output: str, robot: str | None) -> None:
    """Write the page of two files of rows, judged by the limits of an arm where one is named.

    Raises:
        InputError: When they do not fit each other, or the arm.
        FileError: When one cannot be read, or the page not be written.
    """
    shown = [_shown_file(name, robot, output, BUDGET) for name in (first, second)]
    page = page_of(scene_of_two(*(one.scene for one in shown)))
    write_content(page, output)
    print_remark(f"{output} ({len(page) / 1e6:.2f} MB) plays both")


@frozen
class _Shown:
    """A motion to be shown: its scene, a line with its verdict, and what makes the error of what is wrong."""

    scene: dict[str, Any]
    said: str
    problems: Callable[[], Iterable[Problem]] | None


def _written(shown: Sequence[_Shown], options: ViewCommand) -> int:
    """Write the page, say what it shows, and raise what is wrong with it."""
    scene = shown[0].scene
    if len(shown) > 1:
        scene = scene_of_two(scene, shown[1].scene)
    page = page_of(scene, compress=options.compress)
    write_content(page, options.output)
    wrong = [one.problems for one in shown if one.problems is not None]
    after = "; the page shows the findings" if wrong and not holds_motion(options.sources[0]) else ""
    print_remark(f"{'; '.join(one.said for one in shown)}{_where(page, options.output)}{after}", verdict=True)
    for text in dict.fromkeys(text for one in shown for text in one.scene["remarks"]):
        print_remark(f"  {text}")
    if wrong:
        raise VerificationError(*(problem for problems in wrong for problem in problems()))
    return 0


def _planned(name: str, options: ViewCommand) -> Plan:
    from trajcli.job.read import files_of, load_job
    from trajcli.output.delivery.delivered import plan_of

    loaded = load_job(name, options.override)
    _check_inputs_stay(options.output, files_of(loaded.document))
    with progress(), np.errstate(all="ignore"):  # what is not finite is for the checks to find
        return plan_of(loaded)


def _shown_plan(plan: Plan, options: ViewCommand, every: bool) -> _Shown:
    scene, name = scene_of_plan(plan, options.meshes), plan.loaded.name
    if plan.verdict.passed:
        return _Shown(scene, f"{name}: verified, {plan.trajectory.duration:.6g} s", None)
    from trajcli.output.report import verification_error

    return _Shown(scene, f"{name}: not verified", lambda: verification_error(plan, every=every).problems)


def _shown_file(
    name: str, by: str | Plan | None, output: str | None, meshes: float, *, every: bool = False
) -> _Shown:
    """Return a file of rows, judged by a job that was planned, or by an arm or a job of that name."""
    from trajcli.judge.file import CheckOptions
    from trajcli.output.delivery.delivered import judged_by, judged_file
    from trajcli.player.recorded import scene_of_file

    arm = [("the arm of", by)] if isinstance(by, str) else []
    _check_inputs_stay(output, [("the rows of", name), *arm])
    opened = ByteSource(name)
    if by is None or isinstance(by, str):
        checked = None if by is None else judged_by(opened, by)
        scene = scene_of_file(opened, by, checked, meshes)
    else:
        checked = judged_file(opened, CheckOptions(), by)
        scene = scene_of_file(opened, by.loaded.robot, checked, meshes)
    said = f"{scene['title']}: {scene['verdict']['text']}, {scene['subtitle']}"
    if checked is None or isinstance(checked, str) or checked.judgement.passed:
        return _Shown(scene, said, None)
    from trajcli.cli.check import problems_of

    return _Shown(scene, said, lambda: problems_of(checked, every=every))


def _check_output(path: str | None) -> None:
    """Refuse to print a page on a terminal, and names that promise something else."""
    if path is None or path == "-":
        if sys.stdout is not None and sys.stdout.isatty():
            raise InputError("a page is not printed on a terminal", hint="say where it goes: -o view.html")
    else:
        check_page_name(path)


def _check_inputs_stay(output: str | None, inputs: Iterable[tuple[str, str]]) -> None:
    if output not in (None, "-"):
        refuse_overwriting([("the page", str(output))], inputs)


def _where(page: bytes, path: str | None) -> str:
    size = f"{len(page) / 1e6:.2f} MB"
    return f", {size}" if path is None or path == "-" else f", {path} ({size})"
