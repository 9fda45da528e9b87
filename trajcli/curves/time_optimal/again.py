"""A solution found again where few intervals got lower limits: the scans are repeated around these only."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.curves.time_optimal.intervals import Intervals
from trajcli.curves.time_optimal.scan import scanned
from trajcli.curves.time_optimal.solve import Speeds

_REACHES = (32, 128)  # intervals to either side of changed ones that are solved again with them
_MOST = 0.5  # of all intervals: more are not worth being told apart


def solve_again(
    intervals: Intervals, before: Speeds, changed: NDArray[np.bool_], ceiling: Array
) -> Speeds | None:
    """Return the fastest motion where few rows are others than before, or None where that is felt far away.

    Args:
        intervals: N of them.
        before: The motion without the changes.
        changed: Which intervals have lower limits than before, shape (N,).
        ceiling: As from `ceilings`.
    """
    found = Speeds(before.x.copy(), before.upper.copy(), ceiling)
    for reach in _REACHES:
        around = _Around(intervals, changed, reach)
        if around.places.size > _MOST * changed.size:
            break
        around.solve(before, found)
        if around.meets(before, found):
            return found
    return None


class _Around:
    """The surroundings of changed intervals, one after the other, with a gap between them."""

    def __init__(self, intervals: Intervals, changed: NDArray[np.bool_], reach: int) -> None:
        rows = np.flatnonzero(changed)
        steps = np.zeros(changed.size + 1, dtype=np.intp)
        np.add.at(steps, np.maximum(rows - reach, 0), 1)
        np.add.at(steps, np.minimum(rows + reach + 1, changed.size), -1)
        inside = np.cumsum(steps) > 0  # the last one, after the last interval, is not
        self.places = np.flatnonzero(inside | np.append(False, inside[:-1]))
        self.within = inside[self.places[:-1]]
        self.begins = np.append(True, ~self.within)
        self.ends = np.append(~self.within, True)
        chosen = self.places[:-1]
        self.P, self.R, self.C = (rows[:, chosen] for rows in (intervals.P, intervals.R, intervals.C))

    def solve(self, before: Speeds, found: Speeds) -> None:
        """Write into `found` what `before` becomes here, if it stays the same at the border."""
        P, R, C, places, within = self.P, self.R, self.C, self.places, self.within
        limits = np.where(
            self.ends, np.minimum(before.upper[places], found.ceiling[places]), found.ceiling[places]
        )
        chosen = (P > 0) & (R < 0) & within
        upper = scanned(R[:, ::-1], P[:, ::-1], C[:, ::-1], chosen[:, ::-1], limits[::-1])[::-1]
        found.upper[places] = upper
        limits = np.where(self.begins, np.minimum(before.x[places], upper), upper)
        found.x[places] = scanned(P, R, C, (R > 0) & within, limits)

    def meets(self, before: Speeds, found: Speeds) -> bool:
        """Return whether nothing changes at the border."""
        begins, ends = self.places[self.begins], self.places[self.ends]
        same = np.array_equal(found.x[ends], before.x[ends]) and np.array_equal(
            found.x[begins], before.x[begins]
        )
        begins = begins[begins > 0]
        return same and np.array_equal(found.upper[begins], before.upper[begins])
