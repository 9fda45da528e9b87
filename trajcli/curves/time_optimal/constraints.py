"""What limits the motion along a path: rows a u + b x <= c and caps on x, where x = sd^2 and u = sdd.

With q(s) and s(t) the chain rule gives qd = q' sd and qdd = q' u + q'' x: bounds on acceleration are rows,
bounds on velocity are caps. Every c is positive: standing still is always allowed.

Source: Pham and Pham (2018), sections II and III.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array, PiecewisePolynomial, Side
from trajcli.frozen import frozen

_FLAT = 1e-9  # a coefficient this much smaller than its neighbour is zero: it shifts the bound by as little
_KINK = 1e-9  # of the largest derivative of a joint: a jump above it is a corner
_ROUNDING = 1e-13  # of the largest derivative of all joints: the same, where one hardly moves


@frozen
class Rows:
    """Rows a u + b x <= c and caps x <= cap at p places of a path.

    Attributes:
        a: Shape (p, k).
        b: Shape (p, k).
        c: Shape (p, k), positive; infinite for no bound.
        cap: Largest x, shape (p,); infinite for no bound, zero where the motion must stop.
    """

    a: Array
    b: Array
    c: Array
    cap: Array


Demand = Callable[[Array, Side], Rows]
"""Rows at the places (p,) of the path, seen from their left or their right side; k is always the same."""


def joint_demand(path: PiecewisePolynomial, velocity: Array, acceleration: Array) -> Demand:
    """Return the demand of joint limits.

    Args:
        path: q(s) with n joints.
        velocity: Lower and upper bounds, shape (n, 2), lower < 0 < upper, infinite for none.
        acceleration: The same of acceleration.

    Raises:
        ValueError: When bounds have another shape or sign.
    """
    for name, bounds in (("velocity", velocity), ("acceleration", acceleration)):
        if bounds.shape != (path.dimension, 2) or not ((bounds[:, 0] < 0) & (bounds[:, 1] > 0)).all():
            raise ValueError(f"{name} bounds must be {path.dimension} pairs with lower < 0 < upper")
    upper, lower = np.isfinite(acceleration[:, 1]), np.isfinite(acceleration[:, 0])
    limits = np.concatenate([acceleration[upper, 1], -acceleration[lower, 0]])

    def rows(s: Array, side: Side) -> Rows:
        first, second = path.evaluate_orders(s, (1, 2), side=side).transpose(1, 0, 2)
        a = np.concatenate([first[:, upper], -first[:, lower]], axis=1)
        b = np.concatenate([second[:, upper], -second[:, lower]], axis=1)
        rate = np.maximum(first / velocity[:, 1], first / velocity[:, 0]).max(axis=1)
        with np.errstate(divide="ignore", over="ignore"):
            return Rows(a, b, np.broadcast_to(limits, a.shape), rate**-2.0)

    return rows


def speed_demand(limit: Callable[[Array], Array]) -> Demand:
    """Return the demand of a bound on sd.

    Args:
        limit: From places (p,) to the largest sd there, (p,), positive or infinite.
    """

    def rows(s: Array, side: Side) -> Rows:
        nothing = np.empty((s.size, 0))
        return Rows(nothing, nothing, nothing, limit(s) ** 2)

    return rows


def is_at_rest(path: PiecewisePolynomial) -> tuple[bool, bool]:
    """Return whether q' vanishes at the start and at the end, so that any sd is rest there."""
    begins, ends = path.piece_ends(1)
    nothing = _nothing(begins, ends)
    return bool((np.abs(begins[0]) <= nothing).all()), bool((np.abs(ends[-1]) <= nothing).all())


def corners(path: PiecewisePolynomial) -> Array:
    """Return the breaks at which q' jumps, so that the motion must stop there."""
    begins, ends = path.piece_ends(1)
    jumps = np.abs(begins[1:] - ends[:-1]) > _nothing(begins, ends)
    return np.asarray(path.breaks[1:-1][jumps.any(axis=1)])


def _nothing(begins: Array, ends: Array) -> Array:
    """Return what counts as no derivative of each joint, shape (n,), from those at the ends of pieces."""
    largest = np.maximum(np.abs(begins), np.abs(ends)).max(axis=0)
    return np.asarray(np.maximum(_KINK * largest, _ROUNDING * largest.max()))


@frozen
class Intervals:
    """Rows P x + R y <= C of the intervals of a grid, sd^2 = x at the near and y at the far end.

    Between them sdd is constant. With D the length, u = (y - x) / 2D: the near row a u + b x <= c has
    P = 2Db - a and R = a, the far row a u + b y <= c has P = -a and R = 2Db + a, and both have C = 2Dc.

    Attributes:
        grid: Places, shape (N + 1,), strictly increasing.
        P: Shape (N, m).
        R: Shape (N, m).
        C: Shape (N, m).
        cap: Largest x at each place, shape (N + 1,).
    """

    grid: Array
    P: Array
    R: Array
    C: Array
    cap: Array

    @property
    def rows(self) -> int:
        """Number m of rows of each interval; the first half holds at the near end, the other at the far."""
        return int(self.P.shape[1])

    @property
    def straight(self) -> NDArray[np.bool_]:
        """Which intervals have b = 0 in all rows up to rounding, as on a straight line, shape (N,)."""
        return np.asarray((np.abs(self.P + self.R) <= _FLAT * np.abs(self.R)).all(axis=1))

    def tightened(self, velocity: Array, acceleration: Array) -> Intervals:
        """Return the intervals with all speeds and rows divided by factors (N,) of their own."""
        cap = self.cap.copy()
        cap[:-1] /= velocity**2
        cap[1:] = np.minimum(cap[1:], self.cap[1:] / velocity**2)
        return replace(self, C=self.C / acceleration[:, None], cap=cap)


def constrained(grid: Array, demands: Sequence[Demand], stops: Array) -> Intervals:
    """Return the rows of all demands at both ends of every interval.

    Args:
        grid: Shape (N + 1,), strictly increasing.
        demands: At least one.
        stops: Places of the grid where x must be zero.
    """
    near = _joined([demand(grid[:-1], "right") for demand in demands])
    far = _joined([demand(grid[1:], "left") for demand in demands])
    double = 2.0 * np.diff(grid)[:, None]
    P = np.concatenate([double * near.b - near.a, -far.a], axis=1)
    R = np.concatenate([near.a, double * far.b + far.a], axis=1)
    C = np.concatenate([double * near.c, double * far.c], axis=1)
    P, R = _without_rounding(P, R), _without_rounding(R, P)
    cap = np.full(grid.size, np.inf)
    cap[:-1] = near.cap
    cap[1:] = np.minimum(cap[1:], far.cap)
    cap[np.isin(grid, stops)] = 0.0
    return Intervals(grid, P, R, C, cap)


def _joined(all_rows: Sequence[Rows]) -> Rows:
    a, b, c = (np.concatenate([getattr(rows, name) for rows in all_rows], axis=1) for name in "abc")
    return Rows(a, b, c, np.minimum.reduce([rows.cap for rows in all_rows]))


def _without_rounding(values: Array, others: Array) -> Array:
    small: NDArray[np.bool_] = np.abs(values) <= _FLAT * np.abs(others)
    return np.where(small, 0.0, values)
