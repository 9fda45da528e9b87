"""Words for a terminal: its width, colours of verdicts, and the moves that use most of a limit."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, TextIO

from trajcli.cli.frames import folded, shown
from trajcli.cli.numbers import table_lines
from trajcli.cli.progress import columns, is_terminal

if TYPE_CHECKING:
    from trajcli.planning.plan import Plan

BOLD, RED, GREEN, YELLOW = "1", "1;31", "1;32", "33"
_MOST_ROWS = 10
_LEAST = 16  # characters of what is shortened
_FULL = 0.9995  # of a limit: what is shown as all of it
_VERDICT = re.compile(
    r"(?<=: )(?:(?P<bad>not verified|exceeded|failed)|(?P<good>verified|satisfied|within rounding))\b"
)
_COLOURS = re.compile(r"\x1b\[[0-9;]*m")


def is_coloured(stream: TextIO | None) -> bool:
    """Return whether words on a stream have colours: NO_COLOR and FORCE_COLOR count before what it is."""
    if os.environ.get("NO_COLOR"):
        return False
    if os.environ.get("FORCE_COLOR"):
        return True
    return is_terminal(stream)


def painted(text: str, code: str, stream: TextIO | None) -> str:
    """Return a text in a colour, where a stream has any."""
    return f"\x1b[{code}m{text}\x1b[0m" if is_coloured(stream) and text else text


def with_verdict(text: str, stream: TextIO | None) -> str:
    """Return a line whose verdicts, behind their names, have a colour: red for what is wrong, else green."""
    return _VERDICT.sub(lambda m: painted(m[0], RED if m["bad"] else GREEN, stream), text)


def wrapped(text: str, stream: TextIO | None) -> str:
    """Return a line as a terminal takes it: broken between words, with what follows set in by two more.

    In a file or a pipe a line stays one.
    """
    if not is_terminal(stream) or len(_COLOURS.sub("", text)) <= columns():
        return text
    return folded(text, columns(), " " * (len(text) - len(text.lstrip()) + 2))


def shortened(text: str, width: int) -> str:
    """Return a text of at most so many characters; of a longer one the end is left out."""
    return text if len(text) <= width else f"{text[: width - 3]}..."


def fitted_table(rows: Sequence[Sequence[str]], yielding: Sequence[int]) -> Iterator[str]:
    """Yield the lines of a table, the first row its head, within the width of the terminal.

    Args:
        rows: Cells; those that begin with a digit stand to the right.
        yielding: Indices of the columns that are shortened where the table is too wide, the first one first.
    """
    rows = [[shown(cell) for cell in row] for row in rows]
    for column in yielding:
        wide = max(map(len, table_lines(rows, "")), default=0) - columns()
        width = max(max(len(row[column]) for row in rows) - max(wide, 0), _LEAST)
        rows = [
            [shortened(cell, width) if k == column else cell for k, cell in enumerate(row)] for row in rows
        ]
    yield from table_lines(rows, "")


def on_terminal(lines: Iterable[str]) -> str:
    """Return lines with their colours as a text for standard output, broken between words on a terminal."""
    return "".join(f"{wrapped(line, sys.stdout)}\n" for line in lines)


def shown_table(
    rows: Sequence[Sequence[str]], yielding: Sequence[int], dropped: Sequence[str]
) -> Iterator[str]:
    """Yield the lines of a table for standard output; on a terminal it fits the width.

    Args:
        rows: Cells, the first row the head.
        yielding: Indices of the columns that are shortened where it is too wide, the first one first.
        dropped: Names of the columns that are left out before that, the first one first.
    """
    if not is_terminal(sys.stdout):
        yield from table_lines(rows)
        return
    for name in dropped:
        if max(map(len, table_lines(rows, ""))) > columns() and name in rows[0]:
            at = rows[0].index(name)
            rows = [[*row[:at], *row[at + 1 :]] for row in rows]
    yield from fitted_table(rows, yielding)


def tightest_lines(plan: Plan, stream: TextIO | None) -> Iterator[str]:
    """Yield the table of the moves that use most of a limit: which one, and how much; then how many more."""
    from trajcli.planning.binding_limits import tightest_of_moves

    of_moves = {one.span.index: one for one in tightest_of_moves(plan)}
    moves = [span for span in plan.trajectory.spans if not span.handles]
    moves.sort(key=lambda span: (-of_moves[span.index].used if span.index in of_moves else 0.0, span.index))
    rows = [["move", "title", "s", "what binds", "share"]]
    for span in sorted(moves[:_MOST_ROWS], key=lambda span: span.index):
        one = of_moves.get(span.index)
        limit = ("-", "-") if one is None else (one.name, one.share)
        rows.append([str(span.index), span.title, f"{span.duration:.4g}", *limit])
    if max(map(len, table_lines(rows, ""))) > columns():  # then what the planner is called says least
        for row in rows[1:]:
            span = plan.trajectory.spans[int(row[0])]
            row[1] = span.label or span.ends or span.planner
    head, *lines = fitted_table(rows, (1, 3))
    yield painted(head, BOLD, stream)
    for line, row in zip(lines, rows[1:], strict=True):
        one = of_moves.get(int(row[0]))
        yield painted(line, YELLOW, stream) if one is not None and one.used >= _FULL else line
    if len(moves) > _MOST_ROWS:
        more = len(moves) - _MOST_ROWS
        yield f"and {more} more move{'s' * (more > 1)} that use{'s' * (more == 1)} less of their limits"
