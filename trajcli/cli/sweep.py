"""`trajcli sweep`: one job over a grid of values, a row of a table for each."""

from __future__ import annotations

import sys
from contextlib import closing
from functools import partial
from typing import TYPE_CHECKING

from trajcli.batches.sweep import PointLedger, Sweep, outcomes_of, parse_axis, sweep_of
from trajcli.batches.sweep_table import (
    Form,
    SweepRow,
    SweepTable,
    check_column,
    check_picture,
    form_of_table,
)
from trajcli.batches.task import SweepPoint
from trajcli.cli.batch import Progress, outcomes_of_tasks, processes_of, timeout_of
from trajcli.cli.outcome import print_lines, print_remark, print_text, report_error
from trajcli.cli.progress import is_terminal
from trajcli.errors import InputError, TrajcliError, utf8
from trajcli.job.read import files_of
from trajcli.job.yaml.document import read_bytes
from trajcli.job.yaml.load import parse_document
from trajcli.streams.whole_file import refuse_overwriting, write_content

if TYPE_CHECKING:
    from trajcli.cli.motion_commands import SweepCommand


def run_sweep(options: SweepCommand) -> int:
    """Plan a job at every point, and write the table; return the exit code.

    Raises:
        InputError: When nothing can be begun: a path that leads nowhere, options that do not fit.
        FileError: When the job cannot be read or the table not written, or a scheduler cannot be reached.
    """
    limits = processes_of(options), timeout_of(options)
    sweep = _sweep(options)
    paths = tuple(axis.path for axis in sweep.axes)
    form = "csv" if options.output is None else form_of_table(options.output)
    if options.best is not None:
        check_column(paths, options.best)
    if options.plot is not None:
        check_picture(paths, options.plot)
    ledger = PointLedger(options.output, force=options.force)
    progress = Progress(len(sweep.rows), "point")
    run = partial(outcomes_of_tasks, options=options, limits=limits, on_tick=progress.show)
    points, wrong = dict[int, SweepPoint](), list[TrajcliError]()
    try:
        with closing(outcomes_of(sweep, ledger, run)) as outcomes:
            for row, outcome in outcomes:
                if outcome.point is None:
                    wrong.append(TrajcliError(*outcome.problems))
                else:
                    points[row] = outcome.point
                progress.add(outcome.point.verdict if outcome.point else outcome.outcome, outcome.exit_code)
    finally:
        progress.erase()
        for error in wrong:
            report_error(error, options.errors)
    rows = (SweepRow(sweep.values(sweep.rows[row]), points[row]) for row in sorted(points))
    table = SweepTable(paths, tuple(rows))
    if options.output is None:
        _print_table(table, form)
    else:
        table.save(options.output)
    if options.plot is not None:
        table.plot(options.plot)
    _say_what_came(table, progress, options)
    failed = options.strict and any(row.point.verdict != "verified" for row in table.rows)
    return progress.worst or int(failed)


def _print_table(table: SweepTable, form: Form) -> None:
    """Write a table to standard output; on a terminal one that fits its width, with colours of verdicts."""
    if not is_terminal(sys.stdout):
        write_content(table.text(form).encode())
        return
    from trajcli.cli.terminal import BOLD, GREEN, RED, fitted_table, on_terminal, painted

    cells = [[*map(utf8, table.cells(row))] for row in table.rows]
    paths = range(len(table.paths))
    head, *lines = fitted_table([[*table.columns], *cells], (len(table.paths) + 2, *paths))
    verdicts = [row.point.verdict for row in table.rows]
    coloured = [
        line.replace(verdict, painted(verdict, GREEN if verdict == "verified" else RED, sys.stdout), 1)
        for line, verdict in zip(lines, verdicts, strict=True)
    ]
    print_text(on_terminal([painted(head, BOLD, sys.stdout), *coloured]))


def _sweep(options: SweepCommand) -> Sweep:
    samples, seed = (_count(*each) for each in (("--samples", options.samples), ("--seed", options.seed)))
    if seed is not None and samples is None:
        raise InputError("--seed is about points drawn by chance", hint="say how many with --samples N")
    content = read_bytes(options.job)
    file = "<stdin>" if options.job == "-" else options.job
    outputs = (("the table", options.output), ("the picture", options.plot))
    written = [(name, path) for name, path in outputs if path is not None]
    refuse_overwriting(written, files_of(parse_document(content, file)))
    return sweep_of(file, content, [parse_axis(text) for text in options.vary], samples, seed or 0)


def _count(option: str, text: str | None) -> int | None:
    if text is not None and not (text.isascii() and text.isdigit()):
        raise InputError(f"{option} expects a whole number, got '{text}'")
    return None if text is None else int(text)


def _say_what_came(table: SweepTable, progress: Progress, options: SweepCommand) -> None:
    """Say how many rows had each verdict, why the first of each is not verified, and which is best."""
    if not options.quiet:
        print_remark(f"{len(table.rows)} row{'s' * (len(table.rows) != 1)}: {progress.text}")
        first = dict[str, SweepRow]()
        for row in table.rows:
            first.setdefault(row.point.verdict, row)
        for verdict, row in first.items():
            if verdict != "verified":
                print_remark(f"  {verdict} at {_where(table, row)}: {row.point.reason}")
    if options.best is None:
        return
    best = table.best(options.best)
    name = options.best.removeprefix("-")
    if best is None:
        text = f"best {name}: no verified row has one"
    else:
        value = table.cells(best)[table.columns.index(name)]
        text = f"best {name}: {value} at {_where(table, best)}"
    if options.output is None:
        print_remark(text)
    else:
        print_lines([text])


def _where(table: SweepTable, row: SweepRow) -> str:
    return utf8(", ".join(f"{path}={value}" for path, value in zip(table.paths, row.values, strict=True)))
