"""The comparison of two tables, column by column: what `trajcli diff` does."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.pipeline.alignment import Pair, align_rows, pair_columns, time_pair
from trajcli.pipeline.column_tolerances import require_known, tolerance_of
from trajcli.pipeline.difference import ColumnDifference, Deviation, Difference
from trajcli.pipeline.interpolation import interpolate_rows
from trajcli.streams.table import Table

_TINY = 1e-290  # divides where the tolerance is zero: there, the largest difference counts


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
    times = a.columns[aligned.rows, clock.place_a] if clock else None
    columns = []
    for place, pair in enumerate(aligned.pairs):
        values = a.columns[aligned.rows, pair.place_a], aligned.values_b[:, place]
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

    def deviation(row: int) -> Deviation:
        time = None if times is None else float(times[row])
        a, b = float(values[0][row]), float(values[1][row])
        return Deviation(pair.a.name, start + row, time, a, b, float(difference[row]), float(allowed[row]))

    return ColumnDifference(
        deviation(worst), deviation(int(wrong[0])) if wrong.size else None, int(wrong.size)
    )
