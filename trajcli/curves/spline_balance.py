"""The equation by which cubics meet with continuous acceleration, in a form that all end conditions share.

Between two knots the acceleration is linear. A cubic that lasts h with mean velocity d, and acceleration M at
its own knot and M' at the other one, reaches its own knot with the velocity

    d + h (2 M + M') / 6         (time counted towards the knot).

Reached from both sides, the two velocities add up to zero: one row for each knot, tridiagonal in M. The
unknowns are accelerations, not velocities, because then the acceleration is continuous by construction: its
jump at a break is rounding of the acceleration itself, not of a velocity divided by a short time.

An end condition only changes how its knot, or the one next to it, is reached. Each is written once, for the
first end; the last one is the first one of the curve run backwards.

Source: de Boor, A Practical Guide to Splines, revised edition (2001), chapter IV.
"""

from __future__ import annotations

import numpy as np

from trajcli.curves.banded import solve_tridiagonal
from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.curves.waypoints import Waypoints
from trajcli.frozen import frozen


@frozen
class Side:
    """How every knot is reached from one side: at velocity + stiffness M + coupling M' (writable arrays).

    Attributes:
        velocity: Shape (m, n), time counted towards the knot.
        stiffness: Factor of the knot's own acceleration, shape (m,).
        coupling: Factor of the acceleration of the neighbour on this side, shape (m,).
    """

    velocity: Array
    stiffness: Array
    coupling: Array

    def backwards(self) -> Side:
        """Return views in the reverse order: what is written there is written here."""
        return Side(self.velocity[::-1], self.stiffness[::-1], self.coupling[::-1])


def sides(points: Waypoints) -> tuple[Side, Side]:
    """Return how knots are reached from before and from after; at either end from a rest outside."""
    return _side(points.lengths, points.slopes), _side(points.lengths[::-1], -points.slopes[::-1]).backwards()


def _side(lengths: Array, slopes: Array) -> Side:
    """Return how knots are reached from before; the first one with velocity zero."""
    from_before = np.concatenate([[0.0], lengths])
    return Side(np.concatenate([np.zeros((1, slopes.shape[1])), slopes]), from_before / 3, from_before / 6)


def without_acceleration(outer: Side, inner: Side) -> None:
    """Make the first knot's row say that its acceleration is zero.

    Args:
        outer: The side away from the curve.
        inner: The other side.
    """
    outer.velocity[0] = inner.velocity[0] = 0.0
    outer.stiffness[0], inner.stiffness[0], inner.coupling[0] = 1.0, 0.0, 0.0
    outer.coupling[1] = 0.0  # it would multiply that zero


def balanced_accelerations(before: Side, after: Side) -> Array:
    """Return the acceleration M at each knot, shape (m, n), with which both sides agree."""
    return solve_tridiagonal(
        before.coupling,
        before.stiffness + after.stiffness,
        after.coupling,
        -(before.velocity + after.velocity),
    )


def starting_velocities(points: Waypoints, acceleration: Array) -> Array:
    """Return the velocity at the start of each piece, shape (m - 1, n).

    Args:
        points: The knots.
        acceleration: At each knot, shape (m, n).
    """
    return points.slopes - points.lengths[:, None] * (2 * acceleration[:-1] + acceleration[1:]) / 6


def cubics(times: Array, positions: Array, velocities: Array, acceleration: Array) -> PiecewisePolynomial:
    """Return the cubic pieces that start in given states, with linear acceleration between the knots.

    Args:
        times: Knots, shape (m,).
        positions: At the start of each piece, shape (m - 1, n).
        velocities: The same.
        acceleration: At each knot, shape (m, n).
    """
    jerk = np.diff(acceleration, axis=0) / np.diff(times)[:, None]
    return PiecewisePolynomial(times, np.stack([jerk / 6, acceleration[:-1] / 2, velocities, positions]))
