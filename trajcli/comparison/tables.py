"""Alignment of two tables: pairs of columns, and rows at the same times or interpolated there."""

from __future__ import annotations

import numpy as np

from trajcli.columns import SIGNALS, Column, group_of, parse_column
from trajcli.curves.piecewise import Array
from trajcli.errors import InputError
from trajcli.frozen import comparable, frozen
from trajcli.streams.table import Table

_SAME_ROW = 1e-6  # of a period: times this close are those of one row
_DERIVATIVES = {"q": "qd", "qd": "qdd", "qdd": "qddd", "s": "sd", "sd": "sdd"}
_DERIVATIVES |= {
    kind + axis: rate + axis for kind, rate in (("", "v"), ("v", "a"), ("w", "e")) for axis in "xyz"
}


@comparable
class Pair:
    """A column that both tables have.

    Attributes:
        a: What it is in the first table.
        b: What it is in the second table, perhaps in another unit.
        index_a: Its index in the first table.
        index_b: Its index in the second table.
    """

    a: Column
    b: Column
    index_a: int
    index_b: int

    def in_units_of_a(self, values: Array) -> Array:
        """Return values of the second table in the unit of the first."""
        return values if self.a.unit == self.b.unit else values * (self.b.factor / self.a.factor)


@frozen
class Alignment:
    """Rows of the first table with what belongs to them of the second.

    Attributes:
        pairs: The m columns that are compared.
        rows: Rows of the first table, N of them.
        values_b: Shape (N, m): the second table's values, in the units of the first.
        ended: Index of the table that ends early, and its last time, s; None when neither does.
        notes: Sentences about the interpolation.
    """

    pairs: tuple[Pair, ...]
    rows: slice
    values_b: Array
    ended: tuple[int, float] | None = None
    notes: tuple[str, ...] = ()


def pair_columns(a: Table, b: Table) -> tuple[tuple[Pair, ...], tuple[tuple[str, int], ...]]:
    """Return the columns that both tables have, and those that one lacks as (name, index of that table).

    Columns of one name belong together, and of those left the ones that differ in nothing but their unit.

    Raises:
        InputError: When there is no column in common, or one is an angle here and a length there.
    """
    left = {name: index for index, name in enumerate(b.names)}
    partners = {name: name for name in a.names if name in left}
    unpaired = {_without_unit(name): name for name in left if name not in partners}
    for name in a.names:
        if name not in partners and _without_unit(name) in unpaired:
            partners[name] = unpaired.pop(_without_unit(name))
    pairs = tuple(
        Pair(parse_column(name), parse_column(partners[name]), index, left[partners[name]])
        for index, name in enumerate(a.names)
        if name in partners
    )
    if not pairs:
        raise InputError(
            f"{a.file} and {b.file} have no column in common",
            hint=f"the first has {', '.join(a.names)}; the second has {', '.join(b.names)}",
        )
    for pair in pairs:
        if {pair.a.unit, pair.b.unit} == {"deg", "mm"}:
            kinds = "an angle and a length" if pair.a.unit == "deg" else "a length and an angle"
            raise InputError(f"{pair.a.name} in {a.file} and {pair.b.name} in {b.file} are {kinds}")
    in_b = set(partners.values())
    missing = [(name, 1) for name in a.names if name not in partners]
    missing += [(name, 0) for name in b.names if name not in in_b]
    return pairs, tuple(missing)


def _without_unit(name: str) -> Column:
    """Return what a column holds, the same for columns that differ in nothing but their unit."""
    column = parse_column(name)
    return Column(column.kind, column.joint)


def time_pair(pairs: tuple[Pair, ...]) -> Pair | None:
    """Return the columns of time, if both tables have one."""
    return next((pair for pair in pairs if pair.a.kind == "t"), None)


def align_rows(a: Table, b: Table, pairs: tuple[Pair, ...], slack: float = 0.0) -> Alignment:
    """Return the rows of two tables one by one, up to the end of the shorter one.

    Args:
        a: The first table.
        b: The second table.
        pairs: Their common columns.
        slack: Difference of times that is accepted, s.

    Raises:
        InputError: When the times are not those of one grid, or when there are none and the numbers of
            rows differ.
    """
    count = len(a.columns)
    longer = len(a.columns) != len(b.columns)
    clock = time_pair(pairs)
    ended = None
    if clock is None:
        if longer:
            raise InputError(
                f"{a.file} has {len(a.columns)} rows, {b.file} has {len(b.columns)}, and not both have times",
                hint="rows can only be told apart by a column t",
            )
    else:
        times = a.columns[:, clock.index_a], b.columns[:, clock.index_b]
        count = _common_row_count(a, b, times, slack)
        if longer:
            short = int(len(b.columns) < len(a.columns))
            ended = short, float(times[short][-1])
    values = np.empty((count, len(pairs)))
    for index, pair in enumerate(pairs):
        values[:, index] = pair.in_units_of_a(b.columns[:count, pair.index_b])
    return Alignment(pairs, slice(0, count), values, ended)


def _common_row_count(a: Table, b: Table, times: tuple[Array, Array], slack: float) -> int:
    """Return how many rows stand at the same times before one table ends.

    A last row may stand off the grid. Where both tables are as long, their last rows belong together all the
    same; else, nothing in the longer one belongs to the last row of the shorter.
    """
    count = min(times[0].size, times[1].size)
    gaps = np.abs(np.diff(times[0] if times[0].size >= times[1].size else times[1]))
    near = max(slack, _SAME_ROW * float(np.median(gaps)) if gaps.size else 0.0)
    apart = np.flatnonzero(np.abs(times[0][:count] - times[1][:count]) > near)
    if apart.size == 0:
        return count
    short = int(times[1].size < times[0].size)
    if apart[0] == count - 1 > 0:
        if times[0].size == times[1].size:
            return count
        if times[short][-1] < times[1 - short][count - 1]:
            return count - 1
    hint = "--resample interpolates the second file at the times of the first"
    try:
        _require_increasing(a, times[0])
        _require_increasing(b, times[1])
        _rows_inside(a, b, *times)
    except InputError as error:  # then it would be refused, too
        hint = error.problems[0].message
    raise InputError(
        f"the rows stand at different times: {_grid(a.file, times[0])}, {_grid(b.file, times[1])}; "
        f"row {apart[0]} is at {times[0][apart[0]]:.12g} s and {times[1][apart[0]]:.12g} s",
        hint=hint,
    )


def _grid(file: str, times: Array) -> str:
    if times.size < 2:
        return f"{file} has one row, at {times[0]:.12g} s"
    gaps = np.diff(times)
    period = float(np.median(gaps))
    if gaps.max() - gaps[:-1].min(initial=gaps.max()) > 0.01 * period:  # the last row may stand off the grid
        return f"{file} has {times.size} rows from {times[0]:.12g} s to {times[-1]:.12g} s"
    return f"{file} has one every {period:.6g} s from {times[0]:.12g} s on"


def interpolate_rows(a: Table, b: Table, pairs: tuple[Pair, ...]) -> Alignment:
    """Return the first table's rows inside the common interval with the second's values interpolated there.

    Between two rows a column is the cubic through its values and its derivative's where the second table has
    that, in the same unit; else the straight line; and of `move`, `zone` and signals the earlier value.

    Raises:
        InputError: When not both tables have increasing times, when these share no interval, or when there is
            no other column.
    """
    others = tuple(pair for pair in pairs if pair.a.kind != "t")
    if not others:
        raise InputError(f"{a.file} and {b.file} have no column in common but t", hint="leave --resample out")
    times_a, times_b = _times(a, b, pairs)
    rows = _rows_inside(a, b, times_a, times_b)
    gaps = _Gaps(times_b, times_a[rows])
    values = np.empty((rows.stop - rows.start, len(others)))
    methods: dict[str, list[str]] = {}
    for index, pair in enumerate(others):
        method, at_times = _interpolate(b, pair, gaps)
        values[:, index] = pair.in_units_of_a(at_times)
        methods.setdefault(method, []).append(pair.b.kind)
    how = "; ".join(f"{method} for {', '.join(dict.fromkeys(kinds))}" for method, kinds in methods.items())
    note = f"{b.file} is interpolated from {times_a[rows][0]:.12g} s to {times_a[rows][-1]:.12g} s ({how}); "
    note += f"{_interval(a, times_a)}, {_interval(b, times_b)}"
    return Alignment(others, rows, values, None, (note,))


def _times(a: Table, b: Table, pairs: tuple[Pair, ...]) -> tuple[Array, Array]:
    """Return the increasing times of both tables."""
    clock = time_pair(pairs)
    if clock is None:
        raise InputError(f"{a.file} and {b.file} do not both have a column t, so nothing can be interpolated")
    times_a, times_b = a.columns[:, clock.index_a], b.columns[:, clock.index_b]
    _require_increasing(a, times_a)
    _require_increasing(b, times_b)
    return times_a, times_b


def _rows_inside(a: Table, b: Table, times_a: Array, times_b: Array) -> slice:
    """Return the rows of the first table inside the times of the second."""
    start, stop = np.searchsorted(times_a, times_b[0]), np.searchsorted(times_a, times_b[-1], "right")
    rows = slice(int(start), int(stop))
    if rows.start >= rows.stop:
        raise InputError(
            f"no row of {a.file} lies inside the times of {b.file}",
            hint=f"{_interval(a, times_a)}, {_interval(b, times_b)}",
        )
    return rows


class _Gaps:
    """Where each of the times (N,) stands between two rows of a table.

    Attributes:
        before: Index of the row before or at each time, shape (N,).
        after: Index of the row after it, shape (N,); the last row has none but itself.
        length: Seconds between the two, shape (N,).
        share: What part of that has passed, 0 to 1, shape (N,).
    """

    def __init__(self, rows: Array, times: Array) -> None:
        self.before = np.searchsorted(rows, times, "right") - 1
        self.after = np.minimum(self.before + 1, rows.size - 1)
        self.length = rows[self.after] - rows[self.before]
        passed = times - rows[self.before]
        self.share = np.divide(passed, self.length, out=np.zeros_like(passed), where=self.length > 0)


def _interpolate(b: Table, pair: Pair, gaps: _Gaps) -> tuple[str, Array]:
    """Return the method's name and the values (N,) of the second table's column, in its own unit."""
    values = b.columns[:, pair.index_b]
    start = values[gaps.before]
    if pair.b.whole_numbers or group_of(pair.b) == SIGNALS:
        return "the earlier row", start
    step = values[gaps.after] - start
    u = gaps.share
    slopes = _derivative(b, pair)
    if slopes is None:
        return "linear", start + u * step
    bend = slopes[gaps.before] * (1 - u) - slopes[gaps.after] * u
    return "cubic", start + step * u**2 * (3 - 2 * u) + gaps.length * u * (1 - u) * bend


def _derivative(b: Table, pair: Pair) -> Array | None:
    kind = _DERIVATIVES.get(pair.b.kind)
    for index, name in enumerate(b.names):
        column = parse_column(name)
        if column.kind == kind and column.joint == pair.b.joint and column.unit == pair.b.unit:
            return b.columns[:, index]
    return None


def _require_increasing(table: Table, times: Array) -> None:
    falls = np.flatnonzero(np.diff(times) <= 0)
    if falls.size:
        row = int(falls[0]) + 1
        raise InputError(
            f"the times of {table.file} do not increase: {times[row - 1]:.12g} s is followed by "
            f"{times[row]:.12g} s in row {row}",
            hint="only rows at increasing times can be interpolated",
        )


def _interval(table: Table, times: Array) -> str:
    return f"{table.file} lasts from {times[0]:.12g} s to {times[-1]:.12g} s"
