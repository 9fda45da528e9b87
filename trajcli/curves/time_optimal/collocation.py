"""What limits the motion in the intervals of a grid: rows P x + R y <= C.

There x is sd^2 at the near end of an interval, and y at its far end. Between them sdd grows from u - d to
u + d, where d is the swing of the interval and u = (y - x) / 2E its mean. E is the way that the mean of both
speeds leads in the time of the interval: without swing its length, and else nearly so. The near row
a (u - d) + b x <= c has P = 2Eb - a, R = a and C = 2E(c + ad), the far row a (u + d) + b y <= c has P = -a,
R = 2Eb + a and C = 2E(c - ad).

Source: Pham and Pham (2018), section IV, for the rows without swing; the swing is our own.

The places of a path that its limits are looked at: its breaks, and more where the solution asks for it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array, PiecewisePolynomial, distinct
from trajcli.curves.time_optimal.constraints import ConstraintRows, PathConstraint
from trajcli.frozen import frozen

_BLOCK = 1024
_FLAT = 1e-9  # a coefficient this much smaller than its neighbour is zero: it shifts the bound by as little


@frozen
class CollocationRows:
    """Rows of the N intervals of a grid; the first half of the m holds at the near end, the other at the far.

    Attributes:
        grid: Places, shape (N + 1,), strictly increasing.
        P: Shape (m, N).
        R: Shape (m, N).
        C: Shape (m, N).
        cap: Largest x at each place, shape (N + 1,).
        swing: d, shape (N,).
        way: E, shape (N,).
    """

    grid: Array
    P: Array
    R: Array
    C: Array
    cap: Array
    swing: Array
    way: Array

    @property
    def straight(self) -> NDArray[np.bool_]:
        """Which intervals have b = 0 in all rows up to rounding, as on a straight line, shape (N,)."""
        return np.asarray((np.abs(self.P + self.R) <= _FLAT * np.abs(self.R)).all(axis=0))

    def tightened(self, velocity: Array, acceleration: Array) -> CollocationRows:
        """Return the intervals with all speeds and every c divided by factors (N,) of their own."""
        cap = self.cap.copy()
        cap[:-1] /= velocity**2
        cap[1:] = np.minimum(cap[1:], self.cap[1:] / velocity**2)
        C, less = self.C.copy(), 1.0 - 1.0 / acceleration
        for block in blocks(self.way.size):
            C[:, block] = np.maximum(C[:, block] - self._at_rest(block) * less[block], 0.0)
        return replace(self, C=C, cap=cap)

    def ranges(self, x: Array, eased: float = 0.0) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
        """Return the least and the largest sdd that the rows allow at the near and at the far end, each (N,).

        Args:
            x: sd^2 at the places, shape (N + 1,).
            eased: By what share every c is larger.
        """
        half = len(self.P) // 2
        found = np.empty((4, self.way.size))
        for block in blocks(self.way.size):
            double, P, R = 2.0 * self.way[block], self.P[:, block], self.R[:, block]
            C, b = self._at_rest(block) * (1.0 + eased), P + R
            found[:2, block] = _range(double * R[:half], C[:half] - b[:half] * x[:-1][block])
            found[2:, block] = _range(double * -P[half:], C[half:] - b[half:] * x[1:][block])
        return (found[0], found[1]), (found[2], found[3])

    def largest_swing(self) -> Array:
        """Return how much sdd could swing at rest, shape (N,); infinite where nothing limits it."""
        found = np.empty(self.way.size)
        for block in blocks(self.way.size):
            found[block] = _range(np.abs(self._a(block)), self._at_rest(block))[1]
        return found / (2.0 * self.way)

    def _a(self, block: slice) -> Array:
        """Return a of the near rows and -a of the far ones, (m, w), of some intervals."""
        half = len(self.P) // 2
        return np.concatenate([self.R[:half, block], self.P[half:, block]])

    def _at_rest(self, block: slice) -> Array:
        """Return 2Ec of all rows, (m, w), of some intervals."""
        shift = 2.0 * self.way[block] * self.swing[block] * self._a(block)
        return np.asarray(self.C[:, block] - shift)


@frozen
class CollocatedConstraints:
    """All demands at both ends of the intervals of a grid.

    Attributes:
        grid: Places, shape (N + 1,), strictly increasing.
        near: a, b and c at the near ends, each of shape (k, N).
        far: The same at the far ends.
        cap: Largest x at each place, shape (N + 1,).
    """

    grid: Array
    near: tuple[Array, Array, Array]
    far: tuple[Array, Array, Array]
    cap: Array

    def intervals(self, swing: Array, way: Array) -> CollocationRows:
        """Return the rows of the intervals for given swings d and ways E, each of shape (N,)."""
        half, count = self.near[0].shape
        P, R, C = (np.empty((2 * half, count)) for _ in range(3))
        for block in blocks(count):
            double, d = 2.0 * way[block], swing[block]
            a, b, c = (values[:, block] for values in self.near)
            P[:half, block], R[:half, block], C[:half, block] = double * b - a, a, double * (c + a * d)
            a, b, c = (values[:, block] for values in self.far)
            P[half:, block], R[half:, block], C[half:, block] = -a, double * b + a, double * (c - a * d)
            size_P, size_R = np.abs(P[:, block]), np.abs(R[:, block])
            P[:, block][size_P <= _FLAT * size_R] = 0.0
            R[:, block][size_R <= _FLAT * size_P] = 0.0
        return CollocationRows(self.grid, P, R, C, self.cap, swing, way)


def collocated(grid: Array, demands: Sequence[PathConstraint], stops: Array) -> CollocatedConstraints:
    """Return all demands at both ends of every interval.

    Args:
        grid: Shape (N + 1,), strictly increasing.
        demands: At least one.
        stops: Places of the grid where x must be zero.
    """
    near, near_cap = _joined([demand(grid[:-1], "right") for demand in demands])
    far, far_cap = _joined([demand(grid[1:], "left") for demand in demands])
    cap = np.append(near_cap, np.inf)
    cap[1:] = np.minimum(cap[1:], far_cap)
    cap[np.isin(grid, stops)] = 0.0
    return CollocatedConstraints(grid, near, far, cap)


def collocation_rows(grid: Array, demands: Sequence[PathConstraint], stops: Array) -> CollocationRows:
    """Return the rows of all demands with constant sdd in every interval; arguments as for `limited`."""
    return collocated(grid, demands, stops).intervals(np.zeros(grid.size - 1), np.diff(grid))


def blocks(count: int) -> list[slice]:
    """Return slices that cover so many intervals; the rows of each stay in the processor's cache."""
    return [slice(first, first + _BLOCK) for first in range(0, count, _BLOCK)]


def _joined(all_rows: Sequence[ConstraintRows]) -> tuple[tuple[Array, Array, Array], Array]:
    """Return a, b and c of all rows, each of shape (k, N), and the lowest caps, shape (N,)."""
    if len(all_rows) == 1:  # its c may be one row for all places
        rows = all_rows[0]
        return (np.ascontiguousarray(rows.a.T), np.ascontiguousarray(rows.b.T), rows.c.T), rows.cap
    a, b, c = (np.concatenate([getattr(rows, name).T for rows in all_rows]) for name in "abc")
    return (a, b, c), np.minimum.reduce([rows.cap for rows in all_rows])


def _range(factors: Array, rest: Array) -> tuple[Array, Array]:
    """Return the least and the largest u, each (w,), with factors u <= rest in every row (k, w)."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        bounds = rest / factors
    high = np.where(factors > 0, bounds, np.inf).min(axis=0, initial=np.inf)
    low = np.where(factors < 0, bounds, -np.inf).max(axis=0, initial=-np.inf)
    return low, high


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
