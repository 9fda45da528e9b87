"""Which rows and columns of two tables belong together."""

from __future__ import annotations

import numpy as np

from trajcli.columns import Column, parse_column
from trajcli.curves.piecewise import Array
from trajcli.errors import InputError
from trajcli.frozen import comparable, frozen
from trajcli.streams.table import Table

_SAME_ROW = 1e-6  # of a period: times this close are those of one row


@comparable
class Pair:
    """A column that both tables have.

    Attributes:
        a: What it is in the first table.
        b: What it is in the second table, perhaps in another unit.
        place_a: Its index in the first table.
        place_b: Its index in the second table.
    """

    a: Column
    b: Column
    place_a: int
    place_b: int

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
        notes: What was done, in sentences.
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
    left = {name: place for place, name in enumerate(b.names)}
    partners = {name: name for name in a.names if name in left}
    by_quantity = {parse_column(name).quantity: name for name in left if name not in partners}
    for name in a.names:
        if name not in partners and parse_column(name).quantity in by_quantity:
            partners[name] = by_quantity.pop(parse_column(name).quantity)
    pairs = tuple(
        Pair(parse_column(name), parse_column(partners[name]), place, left[partners[name]])
        for place, name in enumerate(a.names)
        if name in partners
    )
    if not pairs:
        raise InputError(
            f"{a.file} and {b.file} have no column in common",
            hint=f"the first has {', '.join(a.names)}; the second has {', '.join(b.names)}",
        )
    for pair in pairs:
        if {pair.a.unit, pair.b.unit} == {"deg", "mm"}:
            raise InputError(
                f"{pair.a.name} in {a.file} and {pair.b.name} in {b.file} are an angle and a length"
            )
    in_b = set(partners.values())
    missing = [(name, 1) for name in a.names if name not in partners]
    missing += [(name, 0) for name in b.names if name not in in_b]
    return pairs, tuple(missing)


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
    count = min(len(a.columns), len(b.columns))
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
        times = a.columns[:, clock.place_a], b.columns[:, clock.place_b]
        count = _common_rows(a, b, times, slack)
        if longer:
            short = int(len(b.columns) < len(a.columns))
            ended = short, float(times[short][-1])
    values = np.empty((count, len(pairs)))
    for place, pair in enumerate(pairs):
        values[:, place] = pair.in_units_of_a(b.columns[:count, pair.place_b])
    return Alignment(pairs, slice(0, count), values, ended)


def _common_rows(a: Table, b: Table, times: tuple[Array, Array], slack: float) -> int:
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
    raise InputError(
        f"the rows stand at different times: {_grid(a.file, times[0])}, {_grid(b.file, times[1])}; "
        f"row {apart[0]} is at {times[0][apart[0]]:.12g} s and {times[1][apart[0]]:.12g} s",
        hint="--resample interpolates the second file at the times of the first",
    )


def _grid(file: str, times: Array) -> str:
    if times.size < 2:
        return f"{file} has one row, at {times[0]:.12g} s"
    return f"{file} has one every {float(np.median(np.diff(times))):.6g} s from {times[0]:.12g} s on"
