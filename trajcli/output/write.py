"""Output of a plan: its rows in a file or a stream."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from trajcli.columns import columns_of
from trajcli.curves.piecewise import Array
from trajcli.errors import InputError
from trajcli.grids import Grid, ListedGrid, UniformGrid
from trajcli.planning.plan import Plan
from trajcli.progress import report_progress
from trajcli.samples import sample
from trajcli.streams.decimals import Digits
from trajcli.streams.formats import DEFAULT, format_of, write_verified
from trajcli.streams.whole_file import standard_output, whole_file


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


def check_output_name(path: str) -> None:
    """Refuse the name of a file of a format that is not written.

    Raises:
        InputError: When the ending is that of a format which is not written.
    """
    format_of(path)


def write_rows(plan: Plan, grid: Grid, path: str | None, digits: Digits) -> None:
    """Write the rows to a file, which appears whole or not at all, or to standard output.

    Args:
        plan: A verified plan.
        grid: Where the rows stand.
        path: The file; None or "-" is standard output.
        digits: "fixed" for nine decimals, "full" for all bits.

    Raises:
        FileError: When it cannot be written.
        BrokenPipeError: When the reader has closed the pipe.
    """
    loaded = plan.loaded
    groups = loaded.job.output.columns
    columns = columns_of(groups, loaded.robot.joint_types, loaded.output_units)
    rows = _counted(
        sample(plan.trajectory, grid, groups, loaded.output_units, robot=loaded.robot), grid.count
    )
    if path is not None and path != "-":
        write_verified(path, rows, columns, digits)
        return
    with standard_output() as out:
        DEFAULT.write(rows, columns, out, digits)


def _counted(blocks: Iterator[Array], count: int) -> Iterator[Array]:
    """Yield the blocks of `count` rows, and say how far it is."""
    done = 0
    for block in blocks:
        done += len(block)
        report_progress(f"writing row {done} of {count}")
        yield block


def write_plan(plan: Plan, path: str | None = None, digits: Digits = "fixed") -> None:
    """Write the rows of a plan that verifies, as `trajcli plan` does.

    Args:
        plan: The plan.
        path: A CSV file, which appears whole or not at all; None or "-" is standard output.
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
    if path is not None:
        check_output_name(path)
    write_rows(plan, grid_of(plan), path, digits)


def write_text(text: str, path: str) -> None:
    """Write a text to a file, which appears whole or not at all; `-` is standard output.

    Raises:
        FileError: When it cannot be written.
        BrokenPipeError: When the reader has closed the pipe.
    """
    with standard_output() if path == "-" else whole_file(path) as out:
        out.write(text.encode())
