"""One table's values at the times of another."""

from __future__ import annotations

import numpy as np

from trajcli.columns import parse_column
from trajcli.curves.piecewise import Array
from trajcli.errors import InputError
from trajcli.pipeline.alignment import Alignment, Pair, time_pair
from trajcli.streams.table import Table

_DERIVATIVES = {"q": "qd", "qd": "qdd", "qdd": "qddd", "s": "sd", "sd": "sdd"}
_DERIVATIVES |= {
    kind + axis: rate + axis for kind, rate in (("", "v"), ("v", "a"), ("w", "e")) for axis in "xyz"
}


def interpolate_rows(a: Table, b: Table, pairs: tuple[Pair, ...]) -> Alignment:
    """Return the first table's rows inside the common interval with the second's values interpolated there.

    Between two rows a column is the cubic through its values and its derivative's where the second table has
    that, in the same unit; else the straight line; and where it counts, as `move` does, the earlier value.

    Raises:
        InputError: When not both tables have increasing times, when these share no interval, or when there is
            no other column.
    """
    rest = tuple(pair for pair in pairs if pair.a.kind != "t")
    if not rest:
        raise InputError(f"{a.file} and {b.file} have no column in common but t", hint="leave --resample out")
    times_a, times_b = _times(a, b, pairs)
    rows = _common_rows(a, b, times_a, times_b)
    gaps = _Gaps(times_b, times_a[rows])
    values = np.empty((rows.stop - rows.start, len(rest)))
    methods: dict[str, list[str]] = {}
    for place, pair in enumerate(rest):
        method, at_times = _interpolate(b, pair, gaps)
        values[:, place] = pair.in_units_of_a(at_times)
        methods.setdefault(method, []).append(pair.b.kind)
    how = "; ".join(f"{method} for {', '.join(dict.fromkeys(kinds))}" for method, kinds in methods.items())
    note = f"{b.file} is interpolated from {times_a[rows][0]:.12g} s to {times_a[rows][-1]:.12g} s ({how}); "
    return Alignment(rest, rows, values, None, (note + f"{_interval(a, times_a)}, {_interval(b, times_b)}",))


def _times(a: Table, b: Table, pairs: tuple[Pair, ...]) -> tuple[Array, Array]:
    """Return the increasing times of both tables."""
    clock = time_pair(pairs)
    if clock is None:
        raise InputError(f"{a.file} and {b.file} do not both have a column t, so nothing can be interpolated")
    times_a, times_b = a.columns[:, clock.place_a], b.columns[:, clock.place_b]
    _require_increasing(a, times_a)
    _require_increasing(b, times_b)
    return times_a, times_b


def _common_rows(a: Table, b: Table, times_a: Array, times_b: Array) -> slice:
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
    values = b.columns[:, pair.place_b]
    start = values[gaps.before]
    if pair.b.whole_numbers:
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
    for place, name in enumerate(b.names):
        column = parse_column(name)
        if column.kind == kind and column.joint == pair.b.joint and column.unit == pair.b.unit:
            return b.columns[:, place]
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
