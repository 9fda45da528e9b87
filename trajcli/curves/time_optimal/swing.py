"""How much sdd should swing in each interval, so that what binds at its near end binds at its far end too."""

from __future__ import annotations

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.curves.time_optimal.intervals import Intervals
from trajcli.curves.time_optimal.law import swings

_BINDS = 1e-6  # of sdd: as near to its bound is at it
_SHARE = 0.5  # of what rows have room for at rest, and of what the speed stays positive with


def wanted_swings(intervals: Intervals, x: Array) -> Array:
    """Return the swings (N,) with which the bound that decides in each interval is met at both of its ends.

    Where neither the upper nor the lower bound of sdd decides, there is none.

    Args:
        intervals: N of them.
        x: sd^2 at the places, the solution for them, shape (N + 1,).
    """
    mean, swing = np.diff(x) / (2.0 * intervals.way), intervals.swing
    (low, high), (far_low, far_high) = intervals.ranges(x)
    near, far = mean - swing, mean + swing
    nothing = _BINDS * np.maximum(np.abs(near), np.abs(far))
    with np.errstate(invalid="ignore"):
        rising = np.minimum(high - near, far_high - far) <= nothing
        falling = np.minimum(near - low, far - far_low) <= nothing
        wanted = np.where(rising, far_high - high, np.where(falling, far_low - low, 0.0)) / 2
    most = _SHARE * intervals.largest_swing()
    wanted = np.clip(np.where(np.isfinite(wanted), wanted, 0.0), -most, most)
    return swings(intervals.grid, x, wanted, _SHARE)


def carried_over(grid: Array, finer: Array, swing: Array, way: Array) -> tuple[Array, Array]:
    """Return swings and ways, both (M,), of the intervals of a finer grid, from those (N,) of a grid."""
    owner = np.searchsorted(grid, finer[:-1], "right") - 1
    lengths, parts = np.diff(grid), np.diff(finer)
    share = parts / lengths[owner]
    return swing[owner] * share, parts * (1.0 + (way / lengths - 1.0)[owner] * share**2)
