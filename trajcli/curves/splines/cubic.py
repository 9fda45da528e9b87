"""Cubic splines: curves through waypoints with continuous velocity and acceleration.

They differ in what happens at the ends: no acceleration (natural), a given velocity (clamped), or no break in
the third derivative next to the end (not-a-knot).

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

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from trajcli.curves.linear_systems import solve_tridiagonal
from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.curves.splines.slopes import Waypoints
from trajcli.frozen import frozen

_VALUES = 1 << 19  # of points and components that are solved together: what that takes is some 80 MB
_ROWS = 1 << 15  # pieces that are made together


def natural(
    times: ArrayLike, positions: ArrayLike, first: ArrayLike | None = None, last: ArrayLike | None = None
) -> PiecewisePolynomial:
    """Return the cubic spline without acceleration at its ends.

    Of all curves through the points it has the least integral of acceleration squared.

    Args:
        times: Shape (m,), strictly increasing, m >= 2.
        positions: Shape (m, n).
        first: Shape (n,): the velocity at the start, which then has the acceleration it needs.
        last: The same at the end.

    Raises:
        ValueError: When times do not increase, or shapes do not fit.
    """
    points = Waypoints(np.asarray(times), np.asarray(positions))
    outer = _velocity(points, first, "first"), _velocity(points, last, "last")
    return _curve(points, outer, _natural_end)


def clamped(times: ArrayLike, positions: ArrayLike, first: ArrayLike, last: ArrayLike) -> PiecewisePolynomial:
    """Return the cubic spline with given velocities at its ends.

    Args:
        times: Shape (m,), strictly increasing, m >= 2.
        positions: Shape (m, n).
        first: Velocity at the start, shape (n,).
        last: Velocity at the end, shape (n,).

    Raises:
        ValueError: When times do not increase, or shapes do not fit.
    """
    return natural(times, positions, first, last)


def not_a_knot(
    times: ArrayLike, positions: ArrayLike, first: ArrayLike | None = None, last: ArrayLike | None = None
) -> PiecewisePolynomial:
    """Return the cubic spline whose first two pieces are one cubic, and whose last two are one.

    Three points give a parabola, two a line. With one velocity given, two points give the cubic that has the
    mean velocity at its other end.

    Args:
        times: Shape (m,), strictly increasing, m >= 2.
        positions: Shape (m, n).
        first: Shape (n,): the velocity at the start, instead of the condition there.
        last: The same at the end.

    Raises:
        ValueError: When times do not increase, or shapes do not fit.
    """
    points = Waypoints(np.asarray(times), np.asarray(positions))
    outer = _velocity(points, first, "first"), _velocity(points, last, "last")
    if points.count == 2:
        mean = points.slopes[0]
        outer = mean if outer[0] is None else outer[0], mean if outer[1] is None else outer[1]
    if points.count == 3 and first is None and last is None:
        return _parabola(points)
    return _curve(points, outer, _not_a_knot_end)


def cubics(times: Array, positions: Array, velocities: Array, acceleration: Array) -> PiecewisePolynomial:
    """Return the cubic pieces that start in given states, with linear acceleration between the knots.

    Args:
        times: Knots, shape (m,).
        positions: At the start of each piece, shape (m - 1, n).
        velocities: The same.
        acceleration: At each knot, shape (m, n).
    """
    coefficients = np.empty((4, *positions.shape))
    fill_pieces(coefficients, np.diff(times), positions, velocities, acceleration)
    coefficients.flags.writeable = False  # the curve takes it without a copy
    return PiecewisePolynomial(times, coefficients)


def fill_pieces(
    coefficients: Array, lengths: Array, positions: Array, velocities: Array, acceleration: Array
) -> None:
    """Write the pieces of `cubics` with lengths (m - 1,) into `coefficients` (4, m - 1, n)."""
    np.subtract(acceleration[1:], acceleration[:-1], out=coefficients[0])
    coefficients[0] /= lengths[:, None]
    coefficients[0] /= 6
    np.divide(acceleration[:-1], 2, out=coefficients[1])
    coefficients[2], coefficients[3] = velocities, positions


@frozen
class KnotEquations:
    """How every knot is reached from one side: at velocity + stiffness M + coupling M' (writable arrays).

    Attributes:
        velocity: Shape (m, n), time counted towards the knot.
        stiffness: Factor of the knot's own acceleration, shape (m,).
        coupling: Factor of the acceleration of the neighbour on this side, shape (m,).
    """

    velocity: Array
    stiffness: Array
    coupling: Array

    def backwards(self) -> KnotEquations:
        """Return views in the reverse order: what is written there is written here."""
        return KnotEquations(self.velocity[::-1], self.stiffness[::-1], self.coupling[::-1])


def knot_equations(points: Waypoints) -> tuple[KnotEquations, KnotEquations]:
    """Return how knots are reached from before and from after; at either end from a rest outside."""
    return _equations_from_before(points.lengths, points.slopes), _equations_from_before(
        points.lengths[::-1], -points.slopes[::-1]
    ).backwards()


def knot_accelerations(before: KnotEquations, after: KnotEquations) -> Array:
    """Return the acceleration M at each knot, shape (m, n), with which both sides agree."""
    return solve_tridiagonal(
        before.coupling,
        before.stiffness + after.stiffness,
        after.coupling,
        -(before.velocity + after.velocity),
    )


def without_acceleration(outer: KnotEquations, inner: KnotEquations) -> None:
    """Make the first knot's row say that its acceleration is zero.

    Args:
        outer: The side away from the curve.
        inner: The other side.
    """
    outer.velocity[0] = inner.velocity[0] = 0.0
    outer.stiffness[0], inner.stiffness[0], inner.coupling[0] = 1.0, 0.0, 0.0
    outer.coupling[1] = 0.0  # it would multiply that zero


def starting_velocities(points: Waypoints, acceleration: Array) -> Array:
    """Return the velocity at the start of each piece, shape (m - 1, n).

    Args:
        points: The knots.
        acceleration: At each knot, shape (m, n).
    """
    return points.slopes - points.lengths[:, None] * (2 * acceleration[:-1] + acceleration[1:]) / 6


_End = Callable[[KnotEquations, KnotEquations, Array], None]


def _equations_from_before(lengths: Array, slopes: Array) -> KnotEquations:
    """Return how knots are reached from before; the first one with velocity zero."""
    from_before = np.concatenate([[0.0], lengths])
    return KnotEquations(
        np.concatenate([np.zeros((1, slopes.shape[1])), slopes]), from_before / 3, from_before / 6
    )


def _velocity(points: Waypoints, velocity: ArrayLike | None, name: str) -> Array | None:
    return None if velocity is None else points.row(velocity, f"{name} velocity")


def _curve(points: Waypoints, outer: tuple[Array | None, Array | None], end: _End) -> PiecewisePolynomial:
    """Return the spline with the given velocities at its ends, and `end` where there is none."""
    coefficients = np.empty((4, points.count - 1, points.positions.shape[1]))
    last = _solve(coefficients[1], points, outer, end)
    make_pieces(coefficients, points, last, outer[0])
    coefficients.flags.writeable = False  # the curve takes it without a copy
    return PiecewisePolynomial(points.times, coefficients)


def _solve(
    acceleration: Array, points: Waypoints, outer: tuple[Array | None, Array | None], end: _End
) -> Array:
    """Write the acceleration at all knots but the last, (m - 1, n), and return that of the last, (n,)."""
    last: Array = np.empty(points.positions.shape[1])
    for columns in solved_together(*points.positions.shape):
        part = Waypoints(points.times, points.positions[:, columns])
        velocities = [None if velocity is None else velocity[columns] for velocity in outer]
        solved = _accelerations(part, velocities, end)
        acceleration[:, columns], last[columns] = solved[:-1], solved[-1]
    return last


def make_pieces(coefficients: Array, points: Waypoints, last: Array, first: Array | None) -> None:
    """Write the pieces between the knots into `coefficients` (4, m - 1, n), some after the others.

    Args:
        coefficients: In its second row stand the accelerations at the knots.
        points: The knots.
        last: Acceleration at the last one, shape (n,).
        first: Velocity at the first one, shape (n,), where it is given.
    """
    for row in range(0, points.count - 1, _ROWS):
        knots, pieces = slice(row, row + _ROWS + 1), slice(row, row + _ROWS)
        acceleration = coefficients[1, knots].copy()
        if row + _ROWS >= points.count - 1:
            acceleration = np.concatenate([acceleration, last[None]])
        part = Waypoints(points.times[knots], points.positions[knots])
        starting = starting_velocities(part, acceleration)
        if row == 0 and first is not None:
            starting[0] = first
        fill_pieces(coefficients[:, pieces], part.lengths, part.positions[:-1], starting, acceleration)


def solved_together(count: int, components: int) -> list[slice]:
    """Return components of so many points that are solved together: memory hardly grows with their number."""
    width = max(1, _VALUES // count)
    return [slice(k, k + width) for k in range(0, components, width)]


def _accelerations(points: Waypoints, outer: Sequence[Array | None], end: _End) -> Array:
    """Return the acceleration at each knot, shape (m, n), with the given velocities at the ends, or `end`."""
    before, after = knot_equations(points)
    lengths = points.lengths
    views = (before, after, lengths), (after.backwards(), before.backwards(), lengths[::-1])
    for (outside, inside, from_end), velocity, sign in zip(views, outer, (1, -1), strict=True):
        if velocity is None:
            end(outside, inside, from_end)
        else:
            outside.velocity[0] = sign * velocity
    acceleration = knot_accelerations(before, after)
    if end is _not_a_knot_end:
        for view, velocity, order in zip(views, outer, (1, -1), strict=True):
            if velocity is None:
                acceleration[::order][0] = _beyond(*view, acceleration[::order])
    return acceleration


def _natural_end(outer: KnotEquations, inner: KnotEquations, _lengths: Array) -> None:
    without_acceleration(outer, inner)


def _not_a_knot_end(outer: KnotEquations, inner: KnotEquations, lengths: Array) -> None:
    """Take the first acceleration, (1 + r) M[1] - r M[2] with r = h[0] / h[1], out of the second knot's row.

    What remains is dominated by its diagonal for every r; M[0] itself follows afterwards.
    """
    without_acceleration(outer, inner)
    ratio = lengths[0] / lengths[1]
    outer.stiffness[1] = lengths[0] * (3 + ratio) / 6
    inner.coupling[1] -= lengths[0] * ratio / 6


def _beyond(outer: KnotEquations, inner: KnotEquations, lengths: Array, acceleration: Array) -> Array:
    """Return M[0] of a not-a-knot end, shape (n,).

    The line through M[1] and M[2] is exact where the first piece is short; where it is long, that would
    multiply the rounding of their difference, and the velocity at the second knot says it better.
    """
    next_one, over_next = acceleration[1], acceleration[2]
    if lengths[0] <= lengths[1]:
        extrapolated: Array = next_one + (lengths[0] / lengths[1]) * (next_one - over_next)
        return extrapolated
    apart = outer.velocity[1] + inner.velocity[1]
    from_inside = inner.stiffness[1] * next_one + lengths[1] / 6 * over_next
    balanced: Array = -6 / lengths[0] * (apart + from_inside) - 2 * next_one
    return balanced


def _parabola(points: Waypoints) -> PiecewisePolynomial:
    """Return the parabola through three points, in two pieces."""
    slopes, lengths = points.slopes, points.lengths
    acceleration = np.tile(2 * (slopes[1] - slopes[0]) / (lengths[0] + lengths[1]), (3, 1))
    starting = starting_velocities(points, acceleration)
    return cubics(points.times, points.positions[:-1], starting, acceleration)
