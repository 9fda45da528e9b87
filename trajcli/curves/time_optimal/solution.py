"""A path with its limits, and a solution sd^2 on a grid: its law, what it uses of limits, what it loses."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress

import numpy as np

from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.curves.time_optimal.again import solve_again
from trajcli.curves.time_optimal.ceiling import ceilings
from trajcli.curves.time_optimal.constraints import Demand
from trajcli.curves.time_optimal.intervals import Intervals, Limited, limited
from trajcli.curves.time_optimal.law import pieces_of, swings, ways
from trajcli.curves.time_optimal.resolution import excess, time_lost
from trajcli.curves.time_optimal.solve import Speeds, UnreachableSpeedError, solve
from trajcli.curves.time_optimal.swing import wanted_swings
from trajcli.frozen import frozen

_FEW = 0.01  # of the intervals: if no more of them change, most of the solution stays
_WILD = 1.02  # of a limit: where more is used, there shall be no swing
_LARGEST_DEGREE = 3  # of a path: with swings the degree of the trajectory is three times as high


@frozen
class Problem:
    """A path and its limits.

    Attributes:
        path: q(s) with n joints.
        bounds: Of velocity and acceleration, each of shape (n, 2).
        demands: Of all that limits the motion.
        stops: Places where the motion must stop, shape (k,).
        ends: sd at the start and at the end; infinite for any.
    """

    path: PiecewisePolynomial
    bounds: tuple[Array, Array]
    demands: Sequence[Demand]
    stops: Array
    ends: tuple[float, float]

    @property
    def rests(self) -> bool:
        """Whether it starts and ends at rest, so that it may be stretched."""
        return all(end in (0.0, np.inf) for end in self.ends)

    @property
    def swings(self) -> bool:
        """Whether sdd may swing within an interval."""
        return self.path.degree <= _LARGEST_DEGREE


@frozen
class Solution:
    """A solution on a grid of N intervals.

    Attributes:
        problem: What it solves.
        limited: The demands at its places.
        intervals: The rows that it obeys.
        speeds: sd^2 at its places.
        law: Durations (N,) and coefficients (d + 1, N) of the pieces of s(t).
        over: Bounds of what is used of the limits of velocity and acceleration in each interval, (2, N).
    """

    problem: Problem
    limited: Limited
    intervals: Intervals
    speeds: Speeds
    law: tuple[Array, Array]
    over: Array

    @property
    def grid(self) -> Array:
        """Its places, shape (N + 1,)."""
        return self.intervals.grid

    @property
    def x(self) -> Array:
        """sd^2 at its places, shape (N + 1,)."""
        return self.speeds.x

    @property
    def lost(self) -> Array:
        """Estimate of the time lost in each interval, where limits are passed also by keeping them, (N,)."""
        lasting, over = self.law[0], np.clip(self.over - 1.0, 0.0, 1.0)
        lost = time_lost(self.intervals, self.x, self.speeds.ceiling, lasting)
        return np.asarray(lost + lasting * np.maximum(over[0], 0.5 * over[1]))

    def tightened(self, factors: Array, *, swing: bool) -> Solution:
        """Return the solution with limits divided by factors.

        Args:
            factors: Of velocity and acceleration in each interval, shape (2, N).
            swing: Whether to find the swings anew.

        Raises:
            UnreachableSpeedError: When the speeds at the ends are too high for these limits.
        """
        problem, demands, grid = self.problem, self.limited, self.grid
        if swing and problem.swings:
            calm = self.over.max(axis=0) <= _WILD  # elsewhere sdd swings by more than the limits follow
            wanted = np.where(calm, wanted_swings(self.intervals, self.x), 0.0)
            rows = demands.intervals(wanted, ways(grid, self.x, wanted))
            rows = rows.tightened(*np.where(calm, factors, 1.0))
            with suppress(UnreachableSpeedError):  # then there may be one with the swings as they are
                return _judged(problem, demands, rows, solve(rows, *problem.ends))
        rows, changed = self.intervals.tightened(*factors), (factors != 1.0).any(axis=0)
        ceiling = ceilings(rows, self.speeds.ceiling, changed)
        few = changed.mean() < _FEW
        speeds = solve_again(rows, self.speeds, changed, ceiling) if few else None
        return _judged(problem, demands, rows, speeds or solve(rows, *problem.ends, ceiling), self)


def _judged(
    problem: Problem, demands: Limited, rows: Intervals, speeds: Speeds, before: Solution | None = None
) -> Solution:
    """Return the solution with its law and what that uses of the limits.

    Args:
        problem: What it solves.
        demands: At its places.
        rows: That it obeys.
        speeds: sd^2 at its places.
        before: A solution with the same swings.
    """
    law = pieces_of(rows.grid, speeds.x, swings(rows.grid, speeds.x, rows.swing))
    over, differs = np.empty((2, rows.way.size)), np.ones(speeds.x.size, dtype=bool)
    if before is not None:
        over, differs = before.over.copy(), before.x != speeds.x
    chosen = np.flatnonzero(differs[:-1] | differs[1:])
    over[:, chosen] = excess(problem.path, law, problem.bounds, chosen)
    return Solution(problem, demands, rows, speeds, law, over)


def solved(problem: Problem, grid: Array, swing: Array, way: Array) -> Solution:
    """Return the solution on a grid.

    Args:
        problem: What to solve.
        grid: Places, shape (N + 1,).
        swing: Swings to begin with, shape (N,).
        way: How far the mean of both speeds leads in each interval, shape (N,).

    Raises:
        UnreachableSpeedError: When there is no motion with the speeds at the ends.
        UnlimitedSpeedError: When nothing limits the motion somewhere.
    """
    demands = limited(grid, problem.demands, problem.stops)
    rows = demands.intervals(swing, way)
    speeds = solve(rows, *problem.ends)
    if problem.swings:
        wanted = wanted_swings(rows, speeds.x)
        rows = demands.intervals(wanted, ways(grid, speeds.x, wanted))
        try:
            speeds = solve(rows, *problem.ends)
        except UnreachableSpeedError:  # with so much swing there is none
            rows = demands.intervals(swing, way)
    return _judged(problem, demands, rows, speeds)
