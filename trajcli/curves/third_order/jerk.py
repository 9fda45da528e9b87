"""Limits of jerk along a path: bounds of q' sddd + 3 q'' sd sdd + q''' sd^3.

Source: Pham and Pham, On the structure of the time-optimal path parameterization problem with third-order
constraints (ICRA 2017), for the form; Debrouwere et al. (2013) for b = sd^2.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from trajcli.curves.bernstein import control_points
from trajcli.curves.piecewise import Array, PiecewisePolynomial, Side, derivative_coefficients
from trajcli.curves.time_optimal.time_law import LawPieces, blocks
from trajcli.frozen import frozen


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

    def rows(self, s: Array, side: Side) -> JerkRows:
        """Return the rows at the points (p,) of the path, seen from one side; k is always the same."""
        ...

    def excess(self, law: LawPieces) -> Array:
        """Return the largest multiple of its limits that each piece of a law reaches, shape (N,)."""
        ...


@frozen
class JointJerkConstraint:
    """Limits of the jerk of joints; an excess is a bound for all t.

    Attributes:
        path: q(s) with n joints.
        jerk: Lower and upper bounds, shape (n, 2), lower < 0 < upper, infinite for none.
    """

    path: PiecewisePolynomial
    jerk: Array

    def __post_init__(self) -> None:
        if self.jerk.shape != (self.path.dimension, 2):
            raise ValueError(f"jerk bounds must be {self.path.dimension} pairs with lower < 0 < upper")
        if not ((self.jerk[:, 0] < 0) & (self.jerk[:, 1] > 0)).all():
            raise ValueError("jerk bounds must be pairs with lower < 0 < upper")

    def rows(self, s: Array, side: Side) -> JerkRows:
        """Return the rows at points (p,), one for each finite bound."""
        upper, lower = np.isfinite(self.jerk[:, 1]), np.isfinite(self.jerk[:, 0])
        limits = np.concatenate([self.jerk[upper, 1], -self.jerk[lower, 0]])
        derivatives = self.path.evaluate_orders(s, (1, 2, 3), side=side).transpose(1, 0, 2)
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
