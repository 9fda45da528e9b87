"""Smallest feasible factor: the least number that keeps a bound which is not monotone."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from trajcli.curves.piecewise import Array

Excess = Callable[[Array], Array]

_RATIO = 1.05  # of neighbouring candidates
_ROUNDS = 60
_EXACT = 1e-13  # relative width at which a bracket is closed


def smallest_feasible(excess: Excess, low: float, high: float, *, block: int = 64) -> float | None:
    """Return the smallest x in [low, high] with excess(x) <= 0, or None.

    Candidates on a geometric row bracket it. Between the infeasible ones a dip of `excess` may hide a narrow
    feasible interval: each is followed towards its bottom, from the lowest on.

    Args:
        excess: Continuous; takes and returns shape (k,); may be infinite.
        low: Positive.
        high: At least `low`.
        block: How many candidates to try at once: as many as cost little more than one.
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


def _in_a_dip(excess: Excess, row: Array, values: Array, block: int) -> tuple[float, float] | None:
    """Return an infeasible and a feasible number around the first crossing within the dips of `values`."""
    after = np.append(values[1:], np.inf if values.size == row.size else -np.inf)
    before = np.concatenate([[np.inf], values[:-1]])
    dips = np.flatnonzero((values <= before) & (values < after) & np.isfinite(values))
    for dip in dips.tolist():
        bracket = _down_the_dip(excess, row[max(dip - 1, 0)], row[min(dip + 1, row.size - 1)], block)
        if bracket is not None:
            return bracket
    return None


def _down_the_dip(excess: Excess, low: float, high: float, block: int) -> tuple[float, float] | None:
    """Return the bracket of the first crossing between two infeasible numbers, or None.

    Between two neighbours of its lowest sample a convex function is at most as much below that sample as the
    higher neighbour is above it: where that is still positive, there is no crossing.
    """
    for tried in range(_ROUNDS):
        inner = np.geomspace(low, high, block + 6)
        values = excess(inner)
        feasible = np.flatnonzero(values <= 0)
        if feasible.size:
            return float(inner[max(feasible[0] - 1, 0)]), float(inner[feasible[0]])
        best = int(values.argmin())
        around = slice(max(best - 1, 0), best + 2)
        if tried > 0 and 2 * values[best] > values[around].max():
            return None
        low, high = inner[around][0], inner[around][-1]
    return None


def _closed(excess: Excess, low: float, high: float, block: int) -> float:
    """Return the feasible end of the bracket when nothing fits between its ends."""
    while high - low > _EXACT * high:
        inner = np.geomspace(low, high, block + 2)
        feasible = np.append(excess(inner[1:-1]) <= 0, True)
        first = int(feasible.argmax()) + 1
        if first <= block:
            high = float(inner[first])
        low = float(inner[first - 1]) if first > 1 else low
    return high
