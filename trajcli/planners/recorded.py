"""Points that a file holds, as numbers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from trajcli.curves.piecewise import Array, read_only


@dataclass(frozen=True, eq=False)
class Recorded:
    """Joint values that were recorded.

    Attributes:
        positions: Shape (m, n), rad or m, m >= 1.
        times: Shape (m,), s, increasing; None where the file has none.
        file: Its name, for messages.
        merge: Points that are no further than this from the one before, rad and m, are left out.
    """

    positions: Array
    times: Array | None = None
    file: str = "recorded points"
    merge: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "positions", read_only(self.positions))
        if self.times is not None:
            object.__setattr__(self, "times", read_only(self.times))

    def after(self, start: Array) -> Recorded:
        """Return the points that come after `start` (n,), where the arm stands when the recording begins.

        A first point that is where the arm stands is the start itself, and times count from it. A point is
        left out where no joint is further than `merge` from the last point that was kept; with times, only
        if `merge` is above zero, because standing still may be meant.
        """
        at_start = bool((np.abs(self.positions[0] - start) <= self.merge).all())
        rows = np.arange(1 if at_start else 0, len(self.positions))
        times = self.times
        if times is not None and at_start:
            times = times - times[0]
        if times is None or self.merge > 0:
            rows = _moved(self.positions, start, rows, self.merge)
        return Recorded(self.positions[rows], None if times is None else times[rows], self.file, self.merge)


def _moved(positions: Array, start: Array, rows: np.ndarray, merge: float) -> np.ndarray:
    """Return those rows that are further than `merge` from the last one that was kept."""
    step = np.diff(np.vstack([start, positions[rows]]), axis=0)
    if (np.abs(step).max(axis=1) > merge).all():
        return rows
    kept, last = [], start
    for row in rows.tolist():
        if np.abs(positions[row] - last).max() > merge:
            kept.append(row)
            last = positions[row]
    return np.array(kept, dtype=np.intp)
