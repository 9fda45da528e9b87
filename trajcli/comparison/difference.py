"""Comparison of two tables, column by column and within tolerances: what `trajcli diff` does."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import isfinite
from typing import Any

import numpy as np

from trajcli.columns import Column
from trajcli.comparison.tables import Pair, align_rows, interpolate_rows, pair_columns, time_pair
from trajcli.curves.piecewise import Array
from trajcli.errors import InputError, Problem, utf8
from trajcli.frozen import comparable
from trajcli.streams.table import Table

ALL = "*"  # the key of a tolerance for every column

_SHOWN = 20  # columns that are listed by name
_TINY = 1e-290  # divides where the tolerance is zero: there, the largest difference counts


@comparable
class ValueDifference:
    """The difference of one pair of values.

    Attributes:
        column: Name in the first file; its unit is that of all numbers here.
        row: Index of the row in the first file, from 0.
        time: The row's time, s; None where the files have no times.
        a: Value in the first file.
        b: Value in the second file, in the unit of the first.
        difference: Magnitude of b - a.
        tolerance: What would have been accepted.
    """

    column: str
    row: int
    time: float | None
    a: float
    b: float
    difference: float
    tolerance: float

    @property
    def severity(self) -> tuple[float, float]:
        """What the worst difference has most of: the share of its tolerance; without one, the difference."""
        if self.tolerance > 0:
            return self.difference / self.tolerance, self.difference
        return (float("inf") if self.difference > 0 else 0.0), self.difference


@comparable
class ColumnDifference:
    """How one column compares.

    Attributes:
        worst: The largest difference, measured by its tolerance.
        first: The first one that is not accepted; None where there is none.
        count: Rows that are not accepted.
    """

    worst: ValueDifference
    first: ValueDifference | None
    count: int


@comparable
class Difference:
    """How two files compare.

    Attributes:
        files: Their names.
        rows: Pairs of rows that were compared.
        columns: One for each column that both have, in the order of the first file.
        missing: Columns that only one file has: name, and index of the file that lacks it.
        ended: Index of the file that ends early, and its last time, s; None when neither does.
        notes: What was done to make the files comparable, in sentences.
    """

    files: tuple[str, str]
    rows: int
    columns: tuple[ColumnDifference, ...]
    missing: tuple[tuple[str, int], ...] = ()
    ended: tuple[int, float] | None = None
    notes: tuple[str, ...] = ()

    @property
    def equal(self) -> bool:
        """Whether the files have the same columns and rows, and all differences are accepted."""
        return not self.missing and self.ended is None and not any(column.count for column in self.columns)

    @property
    def worst(self) -> ValueDifference:
        """The largest difference of all columns, measured by its tolerance."""
        return max((column.worst for column in self.columns), key=lambda deviation: deviation.severity)

    @property
    def first(self) -> ValueDifference | None:
        """The difference in the earliest row that is not accepted; None when all are."""
        firsts = [column.first for column in self.columns if column.first is not None]
        return min(firsts, key=lambda deviation: deviation.row, default=None)


def compare(
    a: Table, b: Table, atol: Mapping[str, float], rtol: Mapping[str, float], *, resample: bool = False
) -> Difference:
    """Compare two tables by the names of their columns.

    Two values are accepted when they differ by at most atol + rtol * (the larger magnitude). The second
    table's are converted to the units of the first.

    Args:
        a: The first table.
        b: The second table.
        atol: Tolerances in the first table's units: by column (`q1_deg`), else by kind (`q`), else for `ALL`.
        rtol: The same, relative.
        resample: Interpolate the second table at the times of the first.

    Raises:
        InputError: When the tables have no column in common, or rows at different times (without
            `resample`), or when a tolerance is for a column that they have not in common.
    """
    pairs, missing = pair_columns(a, b)
    for tolerances in (atol, rtol):
        require_known(tolerances, [pair.a for pair in pairs])
    clock = time_pair(pairs)
    slack = tolerance_of(atol, clock.a) if clock else 0.0
    aligned = interpolate_rows(a, b, pairs) if resample else align_rows(a, b, pairs, slack)
    times = a.columns[aligned.rows, clock.index_a] if clock else None
    columns = []
    for index, pair in enumerate(aligned.pairs):
        values = a.columns[aligned.rows, pair.index_a], aligned.values_b[:, index]
        larger = np.maximum(np.abs(values[0]), np.abs(values[1]))
        allowed = tolerance_of(atol, pair.a) + tolerance_of(rtol, pair.a) * larger
        columns.append(_compare_column(pair, values, allowed, times, aligned.rows.start))
    rows = aligned.rows.stop - aligned.rows.start
    return Difference((a.file, b.file), rows, tuple(columns), missing, aligned.ended, aligned.notes)


def _compare_column(
    pair: Pair, values: tuple[Array, Array], allowed: Array, times: Array | None, start: int
) -> ColumnDifference:
    difference = np.abs(values[1] - values[0])
    wrong = np.flatnonzero(difference > allowed)
    worst = int(np.argmax(difference / np.maximum(allowed, _TINY)))

    def deviation(row: int) -> ValueDifference:
        time = None if times is None else float(times[row])
        a, b = float(values[0][row]), float(values[1][row])
        return ValueDifference(
            pair.a.name, start + row, time, a, b, float(difference[row]), float(allowed[row])
        )

    return ColumnDifference(
        deviation(worst), deviation(int(wrong[0])) if wrong.size else None, int(wrong.size)
    )


def parse_tolerances(text: str) -> dict[str, float]:
    """Return the tolerances in `q=1e-9,qd=1e-6`, or under `ALL` the bare number for every column.

    A name is that of a kind of columns (`q`) or of one column (`q1_deg`).

    Raises:
        InputError: When an entry is neither a number nor a name with one, a number is negative or not finite,
            or a name stands twice.
    """
    tolerances: dict[str, float] = {}
    problems = []
    for entry in text.split(","):
        name, equals, number = (part.strip() for part in entry.rpartition("="))
        flaw = _flaw(entry.strip(), name, equals, number, tolerances)
        if flaw:
            problems.append(Problem(flaw, "such as q=1e-9,qd=1e-6, or one number for all columns"))
        else:
            tolerances[name or ALL] = float(number)
    if problems:
        raise InputError(*problems)
    return tolerances


def tolerance_of(tolerances: Mapping[str, float], column: Column) -> float:
    """Return what holds for `column`: its own entry, else its kind's, else that for all, else zero."""
    for name in (column.name, column.kind, ALL):
        if name in tolerances:
            return tolerances[name]
    return 0.0


def require_known(tolerances: Mapping[str, float], columns: Iterable[Column]) -> None:
    """Refuse a tolerance that is for none of `columns`.

    Raises:
        InputError: Naming the columns and kinds there are.
    """
    names = list(dict.fromkeys(name for column in columns for name in (column.kind, column.name)))
    unknown = [name for name in tolerances if name != ALL and name not in names]
    if unknown:
        from difflib import get_close_matches

        near = get_close_matches(unknown[0], names, 1)
        hint = f"did you mean '{near[0]}'?" if near else f"there are {', '.join(names)}"
        raise InputError(f"the tolerance for '{unknown[0]}' fits no column that both files have", hint=hint)


def _flaw(entry: str, name: str, equals: str, number: str, taken: Mapping[str, float]) -> str | None:
    try:
        value = float(number)
    except ValueError:
        return f"the tolerance '{entry}' does not end in a number"
    if not (isfinite(value) and value >= 0):
        return f"the tolerance '{entry}' is {value:g}, expected a finite number of at least 0"
    if equals and not name:
        return f"the tolerance '{entry}' names no column"
    if (name or ALL) in taken:
        return f"the tolerance '{entry}' comes after another one for the same columns"
    return None


def describe(difference: Difference) -> str:
    """Return lines for people, without a line feed at the end."""
    a, b = files = tuple(map(utf8, difference.files))
    what = f"{_count(difference.rows, 'row')}, {_count(len(difference.columns), 'column')}"
    lines = [
        f"{'equal' if difference.equal else 'different'}: {a} and {b} ({what} compared)",
        *difference.notes,
    ]
    lines += [f"{files[index]} has no column {utf8(name)}" for name, index in difference.missing]
    if difference.ended is not None:
        index, time = difference.ended
        lines.append(f"{files[index]} ends at t = {time:.12g} s, before {files[1 - index]}")
    if difference.first is not None:
        lines.append("first: " + _text(difference.first))
    if difference.worst.difference > 0:
        lines.append("worst: " + _text(difference.worst))
    return "\n".join(lines + _columns(difference))


def as_json(difference: Difference) -> dict[str, Any]:
    """Return a comparison as a mapping that JSON can hold, in the units of the first file."""

    def as_mapping(value: ValueDifference | None) -> dict[str, Any] | None:
        return None if value is None else dict(vars(value))

    return {
        "equal": difference.equal,
        "files": list(difference.files),
        "rows": difference.rows,
        "columns": [
            {"count": column.count, "worst": as_mapping(column.worst), "first": as_mapping(column.first)}
            for column in difference.columns
        ],
        "missing": [{"column": name, "file": difference.files[i]} for name, i in difference.missing],
        "ended": difference.ended
        and {"file": difference.files[difference.ended[0]], "time": difference.ended[1]},
        "notes": list(difference.notes),
    }


def _columns(difference: Difference) -> list[str]:
    """Return a line for each column that differs, when there are several."""
    differing = [column for column in difference.columns if column.count]
    if len(differing) < 2:
        return []
    lines = [f"  {_count(column.count, 'row')} of {_text(column.worst)}" for column in differing[:_SHOWN]]
    more = len(differing) - len(lines)
    return [f"{len(differing)} columns differ, each with its worst:", *lines] + [f"  and {more} more"] * (
        more > 0
    )


def _text(deviation: ValueDifference) -> str:
    where = f"in row {deviation.row}" if deviation.time is None else f"at t = {deviation.time:.12g} s"
    apart = f"{deviation.difference:.3g} apart (tolerance {deviation.tolerance:.3g})"
    return f"{deviation.column} {where}: {deviation.a!r} against {deviation.b!r}, {apart}"


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" + ("" if number == 1 else "s")
