"""Output of a plan: its rows in a file or a stream."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from trajcli.columns import EFFORT, Column, Group, columns_of
from trajcli.curves.piecewise import Array
from trajcli.errors import InputError
from trajcli.grids import Grid, ListedGrid, UniformGrid
from trajcli.planning.plan import Plan
from trajcli.progress import report_progress
from trajcli.samples import sample
from trajcli.streams.decimals import Digits
from trajcli.streams.formats import Goal, StreamFormat, WriteOptions, format_of, write_verified
from trajcli.streams.whole_file import standard_output, write_content
from trajcli.units import Units

if TYPE_CHECKING:
    from trajcli.knots import Knots
    from trajcli.output.recording import LogOptions


def grid_of(plan: Plan) -> Grid:
    """Return where the rows of a plan stand.

    Raises:
        InputError: When a listed time lies outside the trajectory, or the rate is too high for its times.
    """
    output, duration = plan.loaded.job.output, plan.trajectory.duration
    try:
        if output.times is not None:
            return ListedGrid(duration, np.array(output.times), output.start_time)
        if output.rows in (None, "rate"):
            return UniformGrid(duration, output.rate, output.start_time)
        from trajcli.knots import knot_grid, knots_of, stated_by

        rate = None if output.rows == "knots" else output.rate
        knots = knots_of(plan.trajectory, stated_by(output.columns))
        return knot_grid(plan.trajectory, knots, rate, output.start_time)
    except InputError as error:
        key = "rate" if output.times is None else "times"
        raise error.located(place=plan.loaded.document.place(("output", key))) from None


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
    form, loaded = form or format_of(path), plan.loaded
    options = _write_options(plan, grid, form, digits, log)
    rows: Iterator[Array] = iter(())
    columns: tuple[Column, ...] = ()
    if form.content != "knots":
        asked = tuple(loaded.job.output.columns)
        groups = asked if form.content == "rows" else _groups_of_log(log, asked)
        units = Units() if form.si else loaded.output_units
        signals = [signal.name for signal in plan.trajectory.signals]
        columns = columns_of(groups, loaded.robot.joint_types, units, signals)
        robot = loaded.robot if form.content == "log" else loaded.robot_of_rows  # a log is in world
        rows = _counted(sample(plan.trajectory, grid, groups, units, robot=robot), grid.count)
    if path is not None and path != "-":
        write_verified(path, rows, columns, options, form)
        return
    with standard_output() as out:
        form.write(rows, columns, out, options)


def _write_options(
    plan: Plan, grid: Grid, form: StreamFormat, digits: Digits, log: LogOptions | None
) -> WriteOptions:
    """Return what the rows of a plan do not say in a format."""
    if form.content == "knots":
        names, columns = plan.trajectory.joint_names, plan.loaded.job.output.columns
        from trajcli.knots import stated_by

        return WriteOptions(goal=cache(lambda: Goal(names, points_of(plan, grid), stated_by(columns))))
    if form.content == "log":
        from trajcli.output.recording import LogOptions, check_log_options, recording_of

        options = log or LogOptions()
        check_log_options(options, plan.loaded.robot, plan.loaded.job.output.start_time)
        return WriteOptions(recording=cache(lambda: recording_of(plan, options)))
    return WriteOptions(digits)


def points_of(plan: Plan, grid: Grid) -> Knots:
    """Return the points of a message of ROS: the knots, or the rows where the job asks for these."""
    from trajcli.knots import knots_at, knots_of, stated_by

    output = plan.loaded.job.output
    if output.rows in (None, "knots"):
        return knots_of(plan.trajectory, stated_by(output.columns))
    return knots_at(plan.trajectory, np.concatenate([local for _, local in grid.blocks()]))


def _groups_of_log(log: LogOptions | None, asked: Sequence[Group]) -> tuple[Group, ...]:
    """Return the columns that the messages of a log are made of: efforts where the job asks for them."""
    twist: tuple[Group, ...] = ("twist",) if log is not None and "/tool_twist" in log.names else ()
    efforts: tuple[Group, ...] = (EFFORT,) if EFFORT in asked else ()
    return ("t", "q", "qd", "qdd", *twist, *efforts)


def _counted(blocks: Iterator[Array], count: int) -> Iterator[Array]:
    """Yield the blocks of `count` rows, and say how far it is."""
    done = 0
    for block in blocks:
        done += len(block)
        report_progress(f"writing row {done} of {count}")
        yield block


def write_text(text: str, path: str) -> None:
    """Write a text to a file, which appears whole or not at all; `-` is standard output.

    Raises:
        FileError: When it cannot be written.
        BrokenPipeError: When the reader has closed the pipe.
    """
    write_content(text.encode(), path)
