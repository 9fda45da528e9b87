"""The places of a path that its limits are looked at: its breaks, and more where the solution asks for it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array, PiecewisePolynomial, distinct

_FEWEST, _FIRST = 6, 96  # intervals: of a piece, and of the whole path, to begin with
_MOST, _MORE = 20, 4000  # intervals: of a piece on average, and of the whole path on top, in the end
_BENT = 1e-6  # of the slopes of sd^2: a smaller difference does not say where they meet
_EDGE = 1e-7  # of an interval: a place nearer to its ends is not worth a new one


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


def refined(grid: Array, x: Array, chosen: NDArray[np.bool_]) -> Array:
    """Return the grid with one more place in each of the chosen intervals.

    It is where the straight lines of sd^2 in the intervals before and after meet, if they do within it: there
    the motion changes from speeding up to braking. Else it is the middle.

    Args:
        grid: Shape (N + 1,).
        x: sd^2 there, shape (N + 1,).
        chosen: Shape (N,).
    """
    lengths, slopes = np.diff(grid), np.diff(x) / np.diff(grid)
    before = np.concatenate([slopes[:1], slopes[:-1]])
    after = np.concatenate([slopes[1:], slopes[-1:]])
    with np.errstate(divide="ignore", invalid="ignore"):
        share = (slopes - after) / (before - after)
    bent = before - after > _BENT * np.maximum(np.abs(before), np.abs(after))
    meeting = bent & (share > _EDGE) & (share < 1.0 - _EDGE)
    places = grid[:-1] + lengths * np.where(meeting, share, 0.5)
    return distinct(np.append(grid, places[chosen]))
