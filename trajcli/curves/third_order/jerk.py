"""Limits of jerk along a path: bounds of q' sddd + 3 q'' sd sdd + q''' sd^3.

Source: Pham and Pham, On the structure of the time-optimal path parameterization problem with third-order
constraints (ICRA 2017), for the form; Debrouwere et al. (2013) for b = sd^2.
"""

from __future__ import annotations

from typing import ClassVar, Protocol

import numpy as np

from trajcli.curves.piecewise import Array, PiecewisePolynomial, Side, control_points, derivative_coefficients
from trajcli.curves.time_optimal.time_law import LawPieces, blocks
from trajcli.frozen import frozen

_KINK = 1e-6  # of the largest q'' of a joint: a jump above it is one
_ROUNDING = 1e-9  # of the largest q'' of all joints, or q' over a piece: the same, where one hardly bends

LawState = tuple[Array, Array, Array, Array]
"""s, sd, sdd and sddd of a law at p points, each (p,)."""


@frozen
class JerkRows:
    """Rows first sddd + 3 second sd sdd + third sd^3 <= limit at p points of a path.

    Attributes:
        first: Shape (p, k).
        second: Shape (p, k).
        third: Shape (p, k).
        limit: Shape (p, k), positive.
    """

    first: Array
    second: Array
    third: Array
    limit: Array


class ThirdOrderConstraint(Protocol):
    """What limits the third derivative of a motion along a path."""

    @property
    def curved(self) -> bool:
        """Whether a jump of q'' of any joint passes it, so that the motion must stop there."""
        ...

    def rows(self, state: LawState, side: Side) -> JerkRows:
        """Return the rows at p points of the path, seen from one side, about a law; k is always the same."""
        ...

    def excess(self, law: LawPieces) -> Array:
        """Return the largest multiple of its limits that each piece of a law reaches, shape (N,)."""
        ...


@frozen
class LawJerkConstraint:
    """A limit of sddd itself; what is linear in each piece has its extremes at the ends.

    Attributes:
        limit: Of its size, positive.
    """

    curved: ClassVar[bool] = False

    limit: float

    def rows(self, state: LawState, side: Side) -> JerkRows:
        """Return the rows of both signs at p points of the path."""
        del side
        points = state[0].size
        signs, nothing = np.tile([1.0, -1.0], (points, 1)), np.zeros((points, 2))
        return JerkRows(signs, nothing, nothing, np.full((points, 2), self.limit))

    def excess(self, law: LawPieces) -> Array:
        """Return what is used of the limit in each piece, shape (N,)."""
        points = control_points(derivative_coefficients(law.coefficients, 3), law.durations)
        return np.asarray(np.abs(points).max(axis=0) / self.limit)


@frozen
class JointJerkConstraint:
    """Limits of the jerk of joints; an excess is a bound for all t.

    Attributes:
        path: q(s) with n joints.
        jerk: Lower and upper bounds, shape (n, 2), lower < 0 < upper, infinite for none.
    """

    curved: ClassVar[bool] = False  # some joints have no limit

    path: PiecewisePolynomial
    jerk: Array

    def __post_init__(self) -> None:
        if self.jerk.shape != (self.path.dimension, 2):
            raise ValueError(f"jerk bounds must be {self.path.dimension} pairs with lower < 0 < upper")
        if not ((self.jerk[:, 0] < 0) & (self.jerk[:, 1] > 0)).all():
            raise ValueError("jerk bounds must be pairs with lower < 0 < upper")

    def rows(self, state: LawState, side: Side) -> JerkRows:
        """Return the rows at p points of the path, one for each finite bound."""
        upper, lower = np.isfinite(self.jerk[:, 1]), np.isfinite(self.jerk[:, 0])
        limits = np.concatenate([self.jerk[upper, 1], -self.jerk[lower, 0]])
        derivatives = self.path.evaluate_orders(state[0], (1, 2, 3), side=side).transpose(1, 0, 2)
        both = (np.concatenate([each[:, upper], -each[:, lower]], axis=1) for each in derivatives)
        first, second, third = both
        return JerkRows(first, second, third, np.broadcast_to(limits, first.shape))

    def excess(self, law: LawPieces) -> Array:
        """Return bounds of what is used of the jerk in each piece, shape (N,)."""
        excess = np.empty(law.durations.size)
        for block in blocks(law.durations.size):
            pieces = law.chosen(block)
            jerk = derivative_coefficients(pieces.along(self.path), 3)
            points = control_points(jerk, pieces.durations)
            used = points / self.jerk[:, 1, None], points / self.jerk[:, 0, None]
            excess[block] = np.maximum(*used).max(axis=(0, 1))
        return excess


def curvature_jumps(path: PiecewisePolynomial, jerk: Array) -> Array:
    """Return the breaks at which q'' of a joint with a limit of jerk jumps: the motion must stop.

    Args:
        path: q(s) with n joints.
        jerk: Bounds, shape (n, 2).
    """
    begins, ends = path.piece_ends(2)
    largest = np.maximum(np.abs(begins), np.abs(ends)).max(axis=0)
    straight = np.abs(path.piece_ends(1)).max() / path.lengths.min()
    nothing = np.maximum(_KINK * largest, _ROUNDING * max(float(largest.max()), float(straight)))
    jumps = np.abs(begins[1:] - ends[:-1]) > nothing
    return np.asarray(path.breaks[1:-1][(jumps & np.isfinite(jerk).any(axis=1)).any(axis=1)])
