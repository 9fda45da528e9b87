"""Rows of a plan as they are written, judged as whoever gets them joins them; and cures, all tried."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from trajcli.columns import Group
from trajcli.errors import InputError
from trajcli.frozen import frozen
from trajcli.grids import Grid, UniformGrid
from trajcli.judge.judgement import Judgement
from trajcli.output.delivery.joined_rows import JoinedRows
from trajcli.output.write import grid_of, write_rows
from trajcli.planners.planner import Event
from trajcli.planning.plan import Plan
from trajcli.streams.decimals import Digits
from trajcli.streams.formats import DEFAULT, StreamFormat, format_of

if TYPE_CHECKING:
    from trajcli.job.report import RowsReport

_FASTER = (2, 4, 8, 16)  # times the rate
_FASTEST = 8000.0  # Hz: no controller takes rows at more
_ROWS_TRIED = 200_000  # rows that are tried
_STATES: tuple[Group, ...] = ("t", "q", "qd", "qdd")
_WITHOUT_JERK = 2  # derivatives that are judged of cubics
_WITHOUT_ACCELERATION = _STATES[:3]


def joined_rows(plan: Plan, grid: Grid, form: StreamFormat, digits: Digits = "fixed") -> JoinedRows:
    """Return the rows of a plan as a format writes them.

    Args:
        plan: A plan that verifies.
        grid: Where its rows stand.
        form: The format.
        digits: Of numbers that are written as text.
    """
    output, exact = plan.loaded.job.output, not form.decimals or digits == "full"
    if form.content == "rows":
        return JoinedRows(plan, grid, tuple(output.columns), exact)
    from trajcli.knots import knot_grid, knots_of, stated_by

    orders = stated_by(output.columns) if form.content == "knots" else 3
    if form.content == "knots" and output.rows in (None, "knots"):
        knots = knots_of(plan.trajectory, orders)
        grid = knot_grid(plan.trajectory, knots, None, output.start_time)
    return JoinedRows(plan, grid, _STATES[: orders + 1], exact)


def with_event(plan: Plan, rows: JoinedRows, form: StreamFormat) -> tuple[Plan, Judgement | None]:
    """Return a plan with the event of rows that pass a limit between them, and what was judged."""
    judged = rows.judgement(worst_only=True)
    if judged is None or not judged.events:
        return plan, judged
    kind, _, text = judged.events[0].partition(": ")
    other = next(rows_that_keep(rows, form), None)
    cure = (
        "neither its knots nor higher rates cure that"
        if other is None
        else f"`{other.options}` keeps every limit"
    )
    return replace(plan, events=(*plan.events, Event(kind, f"{text}; {cure}"))), judged


def as_logged(plan: Plan, form: StreamFormat) -> Plan:
    """Return a plan with the event of its rows where they stand in a log, which has the report with it."""
    if form.content != "log" or not plan.verdict.passed:
        return plan
    return with_event(plan, joined_rows(plan, grid_of(plan), form), form)[0]


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
    form = format_of(path)
    write_rows(as_logged(plan, form), grid_of(plan), path, digits, form=form)


def rows_report(rows: JoinedRows, judged: Judgement) -> RowsReport:
    """Return the part of the report about rows, from `with_event`."""
    from trajcli.job.report import RowsReport, WorstOfRows

    over = [found for found in judged.findings if found.limit is not None]
    if not over:
        return RowsReport(interpolation=judged.interpolation, verdict="satisfied")
    worst = max(over, key=lambda found: found.excess)
    return RowsReport(
        interpolation=judged.interpolation,
        verdict="exceeded",
        worst=WorstOfRows.model_validate(worst.said_by(rows.plan.loaded.say)),
        rate_that_keeps=rate_that_keeps(rows),
    )


def keeps(rows: JoinedRows) -> bool:
    """Return whether the curve that joins rows keeps every limit; where that of the jerk is judged."""
    if rows.judged_orders == _WITHOUT_JERK and "qdd" in rows.plan.loaded.job.output.columns:
        limited = any(np.isfinite(move.robot.limits.jerk).any() for move in rows.plan.moves)
        if limited and not rows.same_curve:
            return False  # between cubics the acceleration steps
    judged = rows.judgement(first_only=True)
    return judged is not None and not judged.events


@frozen
class OtherRows:
    """Other rows of the same motion.

    Attributes:
        rows: The rows.
        output: What the job would say of them: keys of `output`, and their values.
    """

    rows: JoinedRows
    output: Mapping[str, Any]

    @property
    def options(self) -> str:
        """Options of `trajcli plan` that make them."""
        return " ".join(
            set_columns(value) if key == "columns" else f"--{key} {value}".removesuffix(".0")
            for key, value in self.output.items()
        )


def set_columns(columns: Sequence[Group]) -> str:
    """Return the option of `trajcli plan` that says which columns are written."""
    return f'--set "output.columns=[{", ".join(columns)}]"'


def _with_states(rows: JoinedRows, states: Sequence[Group]) -> tuple[Group, ...]:
    """Return the columns of a job with some states in place of its own."""
    return (*states, *(group for group in rows.plan.loaded.job.output.columns if group not in _STATES))


def rows_that_keep(rows: JoinedRows, form: StreamFormat | None = None) -> Iterator[OtherRows]:
    """Yield other rows of the same motion with which it keeps the limits, joined, the simplest first.

    Args:
        rows: As they are.
        form: In which they are written; None for a table.
    """
    return (other for other in _others(rows, form) if keeps(other.rows))


def _other(rows: JoinedRows, form: StreamFormat | None, output: Mapping[str, Any]) -> OtherRows:
    """Return the rows of the same motion where a job says so of its output."""
    plan = replace(rows.plan, loaded=rows.plan.loaded.with_output(output))
    made = joined_rows(plan, grid_of(plan), form or DEFAULT)
    return OtherRows(replace(rows, grid=made.grid, groups=made.groups), output)


def rate_that_keeps(rows: JoinedRows) -> float | None:
    """Return a higher rate at which rows keep the limits between them; None where none is found."""
    grid = rows.grid
    for rate in (grid.rate * times for times in _FASTER) if isinstance(grid, UniformGrid) else ():
        if rate > _FASTEST or grid.duration * rate > _ROWS_TRIED:
            break
        try:
            faster = UniformGrid(grid.duration, rate, grid.start_time)
        except InputError:
            break
        if keeps(replace(rows, grid=faster)):
            return rate
    return None


def _others_at_knots(rows: JoinedRows, form: StreamFormat | None) -> Iterator[OtherRows]:
    """Yield rows at the knots of the same motion, also with columns that join them in another way."""
    from trajcli.knots import has_knots

    there = rows.plan.loaded.job.output.rows == "knots"
    if not (there or isinstance(rows.grid, UniformGrid)) or not has_knots(rows.plan.trajectory):
        return
    output = {} if there else {"rows": "knots"}
    if "q" in rows.groups and not there:
        yield _other(rows, form, output)
    for states in (_STATES, _WITHOUT_ACCELERATION) if (form or DEFAULT).content == "rows" else ():
        columns = _with_states(rows, states)
        if "q" not in rows.groups or replace(rows, groups=columns).interpolation != rows.interpolation:
            yield _other(rows, form, {**output, "columns": columns})


def _others(rows: JoinedRows, form: StreamFormat | None) -> Iterator[OtherRows]:
    """Yield other rows of the same motion, the simplest first."""
    full = None if {*_STATES} <= {*rows.groups} else _with_states(rows, _STATES)
    if "q" not in rows.groups and full is None:
        return  # rows of the tool alone
    content, there = (form or DEFAULT).content, rows.plan.loaded.job.output.rows == "knots"
    yield from _others_at_knots(rows, form)
    if full is not None and content == "rows" and not there:
        yield _other(rows, form, {"columns": full})
    if content != "log" and "qdd" in rows.groups and not (there and content == "rows"):
        yield _other(rows, form, {"columns": _with_states(rows, _WITHOUT_ACCELERATION)})
    rate = rate_that_keeps(rows)
    if rate is not None:
        yield _other(rows, form, {"rate": rate})
