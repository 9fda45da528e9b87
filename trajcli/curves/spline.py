"""Cubic splines: curves through waypoints with continuous velocity and acceleration.

They differ in what happens at the ends: no acceleration (natural), a given velocity (clamped), or no break in
the third derivative next to the end (not-a-knot).

Source: de Boor, A Practical Guide to Splines, revised edition (2001), chapter IV.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.curves.spline_balance import (
    Side,
    balanced_accelerations,
    cubics,
    sides,
    starting_velocities,
    without_acceleration,
)
from trajcli.curves.waypoints import Waypoints

_End = Callable[[Side, Side, Array], None]


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


def _velocity(points: Waypoints, velocity: ArrayLike | None, name: str) -> Array | None:
    return None if velocity is None else points.row(velocity, f"{name} velocity")


def _curve(points: Waypoints, outer: tuple[Array | None, Array | None], end: _End) -> PiecewisePolynomial:
    """Return the spline with the given velocities at its ends, and `end` where there is none."""
    before, after = sides(points)
    lengths = points.lengths
    views = (before, after, lengths), (after.backwards(), before.backwards(), lengths[::-1])
    for (outside, inside, from_end), velocity, sign in zip(views, outer, (1, -1), strict=True):
        if velocity is None:
            end(outside, inside, from_end)
        else:
            outside.velocity[0] = sign * velocity
    acceleration = balanced_accelerations(before, after)
    if end is _not_a_knot_end:
        for view, velocity, order in zip(views, outer, (1, -1), strict=True):
            if velocity is None:
                acceleration[::order][0] = _beyond(*view, acceleration[::order])
    starting = starting_velocities(points, acceleration)
    if outer[0] is not None:
        starting[0] = outer[0]
    return cubics(points.times, points.positions[:-1], starting, acceleration)


def _natural_end(outer: Side, inner: Side, _lengths: Array) -> None:
    without_acceleration(outer, inner)


def _not_a_knot_end(outer: Side, inner: Side, lengths: Array) -> None:
    """Take the first acceleration, (1 + r) M[1] - r M[2] with r = h[0] / h[1], out of the second knot's row.

    What remains is dominated by its diagonal for every r; M[0] itself follows afterwards.
    """
    without_acceleration(outer, inner)
    ratio = lengths[0] / lengths[1]
    outer.stiffness[1] = lengths[0] * (3 + ratio) / 6
    inner.coupling[1] -= lengths[0] * ratio / 6


def _beyond(outer: Side, inner: Side, lengths: Array, acceleration: Array) -> Array:
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
    slopes, lengths = points.slopes, points.lengths
    acceleration = np.tile(2 * (slopes[1] - slopes[0]) / (lengths[0] + lengths[1]), (3, 1))
    starting = starting_velocities(points, acceleration)
    return cubics(points.times, points.positions[:-1], starting, acceleration)
