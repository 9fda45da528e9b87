"""The smallest number that satisfies a bound, where those that do need not form one interval."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from trajcli.curves.piecewise import Array

_RATIO = 1.05  # of neighbouring candidates
_ROUNDS = 40
_EXACT = 1e-14  # relative width at which a bracket is closed
_FLAT = 1e-9  # relative: a dip that gets no deeper than this from round to round has its bottom


def smallest_feasible(
    excess: Callable[[Array], Array], low: float, high: float, *, block: int = 64
) -> float | None:
    """Return the smallest x in [low, high] with excess(x) <= 0, or None.

    Candidates on a geometric row bracket it. Between the infeasible ones a dip of `excess` may hide a narrow
    feasible interval: each is followed to its bottom, from the lowest on.

    Args:
        excess: Continuous; takes and returns shape (k,); may be infinite.
        low: Positive.
        high: At least `low`.
        block: How many candidates to try at once, more than 3: as many as cost little more than one.
    """
    count = max(2, int(np.ceil(np.log(high / low) / np.log(_RATIO))) + 1)
    row = np.geomspace(low, high, count)
    values = np.empty(0)
    for first in range(0, count, block):
        values = np.concatenate([values, excess(row[first : first + block])])
        feasible = np.flatnonzero(values <= 0)
        if feasible.size:
            break
    until = int(feasible[0]) if feasible.size else values.size
    if until == 0:
        return low
    bracket = _in_a_dip(excess, row, values[:until], block)
    if bracket is None and until < values.size:
        bracket = float(row[until - 1]), float(row[until])
    return None if bracket is None else _closed(excess, *bracket, block)


def _in_a_dip(
    excess: Callable[[Array], Array], row: Array, values: Array, block: int
) -> tuple[float, float] | None:
    """Return an infeasible and a feasible number around the first crossing within the dips of `values`."""
    after = np.append(values[1:], np.inf if values.size == row.size else -np.inf)
    before = np.concatenate([[np.inf], values[:-1]])
    dips = np.flatnonzero((values <= before) & (values < after) & np.isfinite(values))
    for dip in dips.tolist():
        low, high = row[max(dip - 1, 0)], row[min(dip + 1, row.size - 1)]
        bottom = values[dip]
        for _ in range(_ROUNDS):
            inner = np.geomspace(low, high, block)
            found = excess(inner)
            feasible = np.flatnonzero(found <= 0)
            if feasible.size:
                return float(inner[max(feasible[0] - 1, 0)]), float(inner[feasible[0]])
            best = int(found.argmin())
            low, high = inner[max(best - 1, 0)], inner[min(best + 1, block - 1)]
            if found[best] >= bottom * (1 - _FLAT) and found[best] <= bottom:
                break
            bottom = min(bottom, found[best])
    return None


def _closed(excess: Callable[[Array], Array], low: float, high: float, block: int) -> float:
    """Return the feasible end of the bracket when nothing fits between its ends."""
    for _ in range(_ROUNDS):
        if high - low <= _EXACT * high:
            break
        inner = np.geomspace(low, high, block)
        first = int(np.flatnonzero(np.append(excess(inner[1:-1]) <= 0, True))[0]) + 1
        low, high = float(inner[first - 1]), (float(inner[first]) if first < block - 1 else high)
    return high
