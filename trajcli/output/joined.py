"""Rows of a plan as they are written, judged as whoever gets them joins them; and cures, all tried."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

from trajcli.columns import Group
from trajcli.errors import InputError
from trajcli.grids import Grid, KnotGrid, UniformGrid
from trajcli.judge.judgement import Judgement
from trajcli.knots import has_knots, knot_grid, knots_of
from trajcli.output.joined_rows import JoinedRows
from trajcli.planners.planner import Event
from trajcli.planning.plan import Plan
from trajcli.streams.decimals import Digits
from trajcli.streams.formats import StreamFormat

if TYPE_CHECKING:
    from trajcli.job.report import RowsReport

_FASTER = (2, 4, 8, 16)  # times the rate
_FASTEST = 8000.0  # Hz: no controller takes rows at more
_MOST = 200_000  # rows that are tried
_STATES: tuple[Group, ...] = ("t", "q", "qd", "qdd")


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
    if form.content == "knots" and output.rows in (None, "knots"):
        grid = knot_grid(plan.trajectory, knots_of(plan.trajectory), None, output.start_time)
    return JoinedRows(plan, grid, ("t", "q", "qd", "qdd"), exact)


def with_event(plan: Plan, rows: JoinedRows) -> tuple[Plan, Judgement | None]:
    """Return a plan with the event of rows that pass a limit between them, and what was judged."""
    judged = rows.judgement()
    if judged is None or not judged.events:
        return plan, judged
    kind, _, text = cured(judged, rows).events[0].partition(": ")
    return replace(plan, events=(*plan.events, Event(kind, text))), judged


def rows_report(rows: JoinedRows, judged: Judgement) -> RowsReport:
    """Return the part of the report about rows, from `with_event`."""
    from trajcli.job.report import RowsReport, WorstOfRows

    over = [found for found in judged.findings if found.limit]
    if not over:
        return RowsReport(interpolation=judged.interpolation, verdict="satisfied")
    worst = max(over, key=lambda found: found.excess)
    return RowsReport(
        interpolation=judged.interpolation,
        verdict="exceeded",
        worst=WorstOfRows.model_validate(worst),
        rate_that_keeps=rate_that_keeps(rows),
    )


def keeps(rows: JoinedRows) -> bool:
    """Return whether the curve that joins rows keeps every limit."""
    judged = rows.judgement(first_only=True)
    return judged is not None and not judged.events


def cure_of(rows: JoinedRows) -> str | None:
    """Return the options of `trajcli plan` with which rows keep the limits, joined; None where none do."""
    return next((words for words, other in _cures(rows) if keeps(other)), None)


def rate_that_keeps(rows: JoinedRows) -> float | None:
    """Return a higher rate at which rows keep the limits between them; None where none is found."""
    grid = rows.grid
    for rate in (grid.rate * times for times in _FASTER) if isinstance(grid, UniformGrid) else ():
        if rate > _FASTEST or grid.duration * rate > _MOST:
            break
        try:
            faster = UniformGrid(grid.duration, rate, grid.start_time)
        except InputError:
            break
        if keeps(replace(rows, grid=faster)):
            return rate
    return None


def _cures(rows: JoinedRows) -> Iterator[tuple[str, JoinedRows]]:
    """Yield other rows of the same motion with the options that make them, the simplest first."""
    columns = None if {*_STATES} <= {*rows.groups} else _STATES
    columned = f'--set "output.columns=[{", ".join(_STATES)}]"'
    if "q" not in rows.groups and columns is None:
        return  # rows of the tool alone
    if isinstance(rows.grid, UniformGrid) and has_knots(rows.plan.trajectory):
        trajectory, start = rows.plan.trajectory, rows.grid.start_time
        at_knots = replace(rows, grid=knot_grid(trajectory, knots_of(trajectory), None, start))
        if "q" in rows.groups:
            yield "--rows knots", at_knots
        yield f"--rows knots {columned}", replace(at_knots, groups=_STATES)
        third = f'--rows knots --set "output.columns=[{", ".join(_STATES[:3])}]"'
        yield third, replace(at_knots, groups=_STATES[:3])
    if columns is not None:
        yield columned, replace(rows, groups=columns)
    if isinstance(rows.grid, KnotGrid):
        yield f'--set "output.columns=[{", ".join(_STATES[:3])}]"', replace(rows, groups=_STATES[:3])
    rate = rate_that_keeps(rows)
    if rate is not None:
        yield f"--rate {rate:g}", replace(rows, grid=UniformGrid(rows.grid.duration, rate))


def cured(judgement: Judgement, rows: JoinedRows) -> Judgement:
    """Return a judgement whose event says what would make the rows keep the limits between them."""
    if not judgement.events or not any(text.startswith("joined_over_limit") for text in judgement.events):
        return judgement
    cure = cure_of(rows)
    said = "neither its knots nor higher rates cure that" if cure is None else f"`{cure}` keeps every limit"
    events = (
        f"{text}; {said}" if text.startswith("joined_over_limit") else text for text in judgement.events
    )
    return replace(judgement, events=tuple(events))
