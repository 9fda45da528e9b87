"""What limits the motion along a path: rows a u + b x <= c and caps on x, where x = sd^2 and u = sdd.

With q(s) and s(t) the chain rule gives qd = q' sd and qdd = q' u + q'' x: bounds on acceleration are rows,
bounds on velocity are caps. Every c is positive: standing still is always allowed.

Source: Pham and Pham (2018), sections II and III.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from trajcli.curves.piecewise import Array, PiecewisePolynomial, Side
from trajcli.frozen import frozen

_KINK = 1e-9  # of the largest derivative of a joint: a jump above it is a corner
_ROUNDING = 1e-13  # of the largest derivative of all joints: the same, where one hardly moves


@frozen
class ConstraintRows:
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


PathConstraint = Callable[[Array, Side], ConstraintRows]
"""Rows at the places (p,) of the path, seen from their left or their right side; k is always the same."""


def joint_constraint(path: PiecewisePolynomial, velocity: Array, acceleration: Array) -> PathConstraint:
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

    def rows(s: Array, side: Side) -> ConstraintRows:
        first, second = path.evaluate_orders(s, (1, 2), side=side).transpose(1, 0, 2)
        a = np.concatenate([first[:, upper], -first[:, lower]], axis=1)
        b = np.concatenate([second[:, upper], -second[:, lower]], axis=1)
        rate = np.maximum(first / velocity[:, 1], first / velocity[:, 0]).max(axis=1)
        with np.errstate(divide="ignore", over="ignore"):
            return ConstraintRows(a, b, np.broadcast_to(limits, a.shape), rate**-2.0)

    return rows


def speed_constraint(limit: Callable[[Array], Array]) -> PathConstraint:
    """Return the demand of a bound on sd.

    Args:
        limit: From places (p,) to the largest sd there, (p,), positive or infinite.
    """

    def rows(s: Array, side: Side) -> ConstraintRows:
        nothing = np.empty((s.size, 0))
        return ConstraintRows(nothing, nothing, nothing, limit(s) ** 2)

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
