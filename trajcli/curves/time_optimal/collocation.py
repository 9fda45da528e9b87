"""Collocation of constraints: rows P x + R y <= C for the intervals of a grid, from both of their ends.

There x is sd^2 at the near end of an interval, and y at its far end. Between them sdd grows from u - d to
u + d, where d is the sdd ramp of the interval and u = (y - x) / 2E its mean. E is the distance that the mean
of both speeds covers in the time of the interval: without a ramp its length, and else nearly so. The near row
a (u - d) + b x <= c has P = 2Eb - a, R = a and C = 2E(c + ad), the far row a (u + d) + b y <= c has P = -a,
R = 2Eb + a and C = 2E(c - ad).

Source: Pham and Pham (2018), section IV, for the rows without ramps; the ramps are our own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.curves.time_optimal.constraints import ConstraintRows, PathConstraint
from trajcli.curves.time_optimal.time_law import blocks
from trajcli.frozen import frozen

_FLAT = 1e-9  # a coefficient this much smaller than its neighbour is zero: it shifts the bound by as little


@frozen
class CollocationRows:
    """Rows of the N intervals of a grid; the first half of the m holds at the near end, the other at the far.

    Attributes:
        grid: Grid points, shape (N + 1,), strictly increasing.
        P: Shape (m, N).
        R: Shape (m, N).
        C: Shape (m, N).
        cap: Largest x at each grid point, shape (N + 1,).
        ramps: d, shape (N,).
        distances: E, shape (N,).
        owners: Which constraint each row is of, shape (m,).
    """

    grid: Array
    P: Array
    R: Array
    C: Array
    cap: Array
    ramps: Array
    distances: Array
    owners: NDArray[np.intp]

    @property
    def straight(self) -> NDArray[np.bool_]:
        """Which intervals have b = 0 in all rows up to rounding, as on a straight line, shape (N,)."""
        return np.asarray((np.abs(self.P + self.R) <= _FLAT * np.abs(self.R)).all(axis=0))

    def tightened(self, velocity: Array, acceleration: Array) -> CollocationRows:
        """Return the intervals with caps and every c divided by factors of their own.

        Args:
            velocity: What speeds are divided by, shape (N,).
            acceleration: What the c of each of the k constraints are divided by, shape (k, N); or (N,), all.
        """
        cap = self.cap.copy()
        cap[:-1] /= velocity**2
        cap[1:] = np.minimum(cap[1:], self.cap[1:] / velocity**2)
        C, less = self.C.copy(), np.atleast_2d(1.0 - 1.0 / acceleration)
        for block in blocks(self.distances.size):
            at_rest = self._at_rest(block)
            at_rest[np.isinf(at_rest)] = 0.0  # no bound stays none
            of_rows = less[:, block] if len(less) == 1 else less[self.owners, block]
            C[:, block] = np.maximum(C[:, block] - at_rest * of_rows, 0.0)
        return replace(self, C=C, cap=cap)

    def sdd_ranges(self, x: Array, relaxed: float = 0.0) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
        """Return the least and the largest sdd that the rows allow at the near and at the far end, each (N,).

        Args:
            x: sd^2 at the grid points, shape (N + 1,).
            relaxed: By what share every c is larger.
        """
        half = len(self.P) // 2
        ranges = np.empty((4, self.distances.size))
        for block in blocks(self.distances.size):
            double, P, R = 2.0 * self.distances[block], self.P[:, block], self.R[:, block]
            C, b = self._at_rest(block) * (1.0 + relaxed), P + R
            ranges[:2, block] = _range(double * R[:half], C[:half] - b[:half] * x[:-1][block])
            ranges[2:, block] = _range(double * -P[half:], C[half:] - b[half:] * x[1:][block])
        return (ranges[0], ranges[1]), (ranges[2], ranges[3])

    def largest_ramps(self) -> Array:
        """Return the largest sdd ramps from rest, shape (N,); infinite where nothing limits them."""
        largest = np.empty(self.distances.size)
        for block in blocks(self.distances.size):
            largest[block] = _range(np.abs(self._a(block)), self._at_rest(block))[1]
        return largest / (2.0 * self.distances)

    def _a(self, block: slice) -> Array:
        """Return a of the near rows and -a of the far ones, (m, w), of some intervals."""
        half = len(self.P) // 2
        return np.concatenate([self.R[:half, block], self.P[half:, block]])

    def _at_rest(self, block: slice) -> Array:
        """Return 2Ec of all rows, (m, w), of some intervals."""
        shift = 2.0 * self.distances[block] * self.ramps[block] * self._a(block)
        return np.asarray(self.C[:, block] - shift)


@frozen
class CollocatedConstraints:
    """All constraints at both ends of the intervals of a grid.

    Attributes:
        grid: Grid points, shape (N + 1,), strictly increasing.
        near: a, b and c at the near ends, each of shape (k, N).
        far: The same at the far ends.
        cap: Largest x at each grid point, shape (N + 1,).
        owners: Which constraint each row is of, shape (k,).
    """

    grid: Array
    near: tuple[Array, Array, Array]
    far: tuple[Array, Array, Array]
    cap: Array
    owners: NDArray[np.intp]

    def intervals(self, ramps: Array, distances: Array) -> CollocationRows:
        """Return the rows of the intervals for given sdd ramps d and distances E, each of shape (N,)."""
        half, count = self.near[0].shape
        P, R, C = (np.empty((2 * half, count)) for _ in range(3))
        for block in blocks(count):
            double, d = 2.0 * distances[block], ramps[block]
            a, b, c = (values[:, block] for values in self.near)
            P[:half, block], R[:half, block], C[:half, block] = double * b - a, a, double * (c + a * d)
            a, b, c = (values[:, block] for values in self.far)
            P[half:, block], R[half:, block], C[half:, block] = -a, double * b + a, double * (c - a * d)
            size_P, size_R = np.abs(P[:, block]), np.abs(R[:, block])
            P[:, block][size_P <= _FLAT * size_R] = 0.0
            R[:, block][size_R <= _FLAT * size_P] = 0.0
        return CollocationRows(self.grid, P, R, C, self.cap, ramps, distances, np.tile(self.owners, 2))


def collocated(grid: Array, constraints: Sequence[PathConstraint], stops: Array) -> CollocatedConstraints:
    """Return all constraints at both ends of every interval.

    Args:
        grid: Grid points, shape (N + 1,), strictly increasing.
        constraints: At least one.
        stops: Grid points where x must be zero.
    """
    near_rows = [constraint.rows(grid[:-1], "right") for constraint in constraints]
    near, near_cap = _joined(near_rows)
    far, far_cap = _joined([constraint.rows(grid[1:], "left") for constraint in constraints])
    owners = np.repeat(np.arange(len(near_rows)), [rows.a.shape[1] for rows in near_rows])
    cap = np.append(near_cap, np.inf)
    cap[1:] = np.minimum(cap[1:], far_cap)
    cap[np.isin(grid, stops)] = 0.0
    return CollocatedConstraints(grid, near, far, cap, owners)


def collocation_rows(grid: Array, constraints: Sequence[PathConstraint], stops: Array) -> CollocationRows:
    """Return the rows of all constraints with constant sdd in every interval, arguments as `collocated`."""
    return collocated(grid, constraints, stops).intervals(np.zeros(grid.size - 1), np.diff(grid))


def _joined(all_rows: Sequence[ConstraintRows]) -> tuple[tuple[Array, Array, Array], Array]:
    """Return a, b and c of all rows, each of shape (k, N), and the lowest caps, shape (N,)."""
    if len(all_rows) == 1:  # its c may be one row for all points
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
