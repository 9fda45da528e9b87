"""Output of a plan: its rows in a file or a stream."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from trajcli.columns import Group, columns_of
from trajcli.errors import InputError
from trajcli.planning.plan import Plan
from trajcli.samples import Grid, ListedGrid, UniformGrid, sample
from trajcli.streams.decimals import Digits
from trajcli.streams.formats import (
    DEFAULT,
    FORMATS,
    StreamFormat,
    WriteOptions,
    format_of,
    write_verified,
)
from trajcli.streams.whole_file import is_special, standard_output, whole_file
from trajcli.units import Units

if TYPE_CHECKING:
    from trajcli.output.recording import LogOptions
    from trajcli.streams.mcap.recording import Recording


def grid_of(plan: Plan) -> Grid:
    """Return where the rows of a plan stand.

    Raises:
        InputError: When a listed time lies outside the trajectory, or the rate is too high for its times.
    """
    output, duration = plan.loaded.job.output, plan.trajectory.duration
    try:
        if output.times is not None:
            return ListedGrid(duration, np.array(output.times), output.start_time)
        return UniformGrid(duration, output.rate, output.start_time)
    except InputError as error:
        key = "rate" if output.times is None else "times"
        raise error.located(place=plan.loaded.document.place(("output", key))) from None


def format_for(path: str | None, name: str | None = None) -> StreamFormat:
    """Return the format of an output.

    Args:
        path: The file, whose ending says it; None or "-" is standard output.
        name: What the command line says; it decides for streams and devices.

    Raises:
        InputError: When the two contradict each other, or the ending is that of no format.
    """
    asked = None if name is None else FORMATS[f".{name}"]
    if path is None or path == "-" or is_special(path):
        return asked or DEFAULT
    known = format_of(path)
    if asked is not None and asked is not known:
        raise InputError(
            f"--format {name} contradicts the name of the file, {path}", hint="leave --format out"
        )
    return known


def write_rows(
    plan: Plan,
    grid: Grid,
    path: str | None,
    digits: Digits,
    *,
    form: StreamFormat | None = None,
    log: LogOptions | None = None,
) -> None:
    """Write the rows to a file, which appears whole or not at all, or to standard output.

    Args:
        plan: A verified plan.
        grid: Where the rows stand.
        path: The file; None or "-" is standard output.
        digits: "fixed" for nine decimals, "full" for all bits.
        form: The format; that of the file's name unless given.
        log: What the command line says about a log.

    Raises:
        InputError: When the log cannot be what the options say.
        FileError: When it cannot be written.
        BrokenPipeError: When the reader has closed the pipe.
    """
    form, loaded = form or format_for(path), plan.loaded
    groups: tuple[Group, ...] = tuple(loaded.job.output.columns)
    units, recording = loaded.units, None
    if form.groups is not None:
        groups, recording = _of_log(plan, form.groups, log)
        units = Units()
    columns = columns_of(groups, loaded.robot.joint_types, units)
    rows = sample(plan.trajectory, grid, groups, units, robot=loaded.robot)
    if path is not None and path != "-":
        write_verified(path, rows, columns, digits, form=form, recording=recording)
        return
    with standard_output() as out:
        form.write(rows, columns, out, WriteOptions(digits, recording))


def _of_log(
    plan: Plan, groups: tuple[Group, ...], log: LogOptions | None
) -> tuple[tuple[Group, ...], Callable[[], Recording]]:
    """Return the columns of a log, and what makes the rest of it."""
    from trajcli.output.recording import LogOptions, check_log_options, recording_of

    options = log or LogOptions()
    check_log_options(options, plan.loaded.robot, plan.loaded.job.output.start_time)
    twist: tuple[Group, ...] = ("twist",) if "/tool_twist" in options.names else ()
    return (*groups, *twist), cache(lambda: recording_of(plan, options))


def write_plan(plan: Plan, path: str | None = None, digits: Digits = "fixed") -> None:
    """Write the rows of a plan that verifies, as `trajcli plan` does.

    Args:
        plan: The plan.
        path: A file, whose ending names the format, and which appears whole or not at all; None or "-" is
            standard output.
        digits: "fixed" for nine decimals, "full" for all bits.

    Raises:
        VerificationError: When the plan breaks a limit; nothing is written.
        InputError: When the rows that the job asks for cannot be given.
        FileError: When the file cannot be written.
        BrokenPipeError: When the reader has closed the pipe.
    """
    if not plan.verdict.passed:
        from trajcli.output.report import verification_error

        raise verification_error(plan)
    write_rows(plan, grid_of(plan), path, digits, form=format_for(path))


def write_text(text: str, path: str) -> None:
    """Write a text to a file, which appears whole or not at all; `-` is standard output.

    Raises:
        FileError: When it cannot be written.
        BrokenPipeError: When the reader has closed the pipe.
    """
    with standard_output() if path == "-" else whole_file(path) as out:
        out.write(text.encode())
