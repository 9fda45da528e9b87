"""The places of a path that its limits are looked at: its breaks, and more where the solution asks for it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array, PiecewisePolynomial, distinct

_FEWEST, _FIRST = 8, 96  # intervals: of a piece, and of the whole path, to begin with
_MOST, _MORE = 16, 4000  # intervals: of a piece on average, and of the whole path on top, in the end
_PARTS = 4  # that an interval is cut into at a time: an estimate of its loss is worth no more
_BENT = 1e-6  # of the slopes of sd^2: a smaller difference does not say where they meet
_EDGE = 1e-7  # of an interval: a place nearer to its ends is not worth a new one
_SPARING = 1.1  # by which the loss to be reached grows until there is room


def first_grid(path: PiecewisePolynomial) -> Array:
    """Return the breaks of the path and equally many equal parts between each two, shape (N + 1,)."""
    parts = max(_FEWEST, -(-_FIRST // path.pieces))
    inner = path.breaks[:-1, None] + path.lengths[:, None] * (np.arange(parts) / parts)
    return distinct(np.append(inner, path.end))


def most_intervals(path: PiecewisePolynomial) -> int:
    """Return how many intervals a grid may have: proportional to the number of pieces."""
    return _MOST * path.pieces + _MORE


def halved(grid: Array) -> Array:
    """Return the grid with the middle of each interval added."""
    return distinct(np.append(grid, 0.5 * (grid[:-1] + grid[1:])))


def parts_for(lost: Array, target: float, room: int) -> NDArray[np.intp]:
    """Return how many parts to cut each interval into, shape (N,), so that with few places little is lost.

    In k parts an interval loses 1 / k^2 of what it does, so that of a given number of places each is worth
    most where k grows with the cubic root of the loss.

    Args:
        lost: Time that each interval loses, shape (N,).
        target: What all of them may lose in the end.
        room: How many places there may be more.
    """
    root = np.cbrt(lost)
    if not root.any():
        return np.ones(lost.size, dtype=np.intp)
    unit = (target / root.sum()) ** 0.5
    while True:
        parts: NDArray[np.intp] = np.clip(np.rint(root / unit), 1, _PARTS).astype(np.intp)
        if (parts - 1).sum() <= room:
            return parts
        unit *= _SPARING


def refined(grid: Array, x: Array, parts: NDArray[np.intp]) -> Array:
    """Return the grid with each interval cut into so many equal parts.

    Where the straight lines of sd^2 in the intervals before and after meet within the interval, the motion
    changes from speeding up to braking: that place is taken instead of the nearest one.

    Args:
        grid: Shape (N + 1,).
        x: sd^2 there, shape (N + 1,).
        parts: Shape (N,).
    """
    lengths, meeting = np.diff(grid), _meetings(grid, x)
    owner = np.repeat(np.arange(parts.size), parts)
    step = np.arange(owner.size) - (np.cumsum(parts) - parts)[owner]
    inner = np.clip(np.rint(meeting * parts), 1, np.maximum(parts - 1, 1))
    nearest = np.where(parts > 1, inner, np.nan)
    share = np.where(step == nearest[owner], meeting[owner], step / parts[owner])
    return distinct(np.append(grid[owner] + lengths[owner] * share, grid[-1]))


def _meetings(grid: Array, x: Array) -> Array:
    """Return where within each interval its neighbours' lines meet, as a share; NaN where they do not."""
    slopes = np.diff(x) / np.diff(grid)
    before = np.concatenate([slopes[:1], slopes[:-1]])
    after = np.concatenate([slopes[1:], slopes[-1:]])
    with np.errstate(divide="ignore", invalid="ignore"):
        share = (slopes - after) / (before - after)
    bent = before - after > _BENT * np.maximum(np.abs(before), np.abs(after))
    return np.where(bent & (share > _EDGE) & (share < 1.0 - _EDGE), share, np.nan)
