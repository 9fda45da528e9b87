"""Hermite splines: curves through waypoints with known derivatives there, and rules that choose these.

Source: Siciliano et al. (2009), section 4.2.1; for the bound of three slopes de Boor and Swartz, Piecewise
monotone interpolation, J. Approx. Theory 21 (1977). For `shape_preserving` Fritsch and Carlson, Monotone
piecewise cubic interpolation, SIAM J. Numer. Anal. 17 (1980), for the velocities that keep a cubic monotone;
Fritsch and Butland, A method for constructing local monotone piecewise cubic interpolants, SIAM J. Sci. Stat.
Comput. 5 (1984), for the inner velocities.
"""

from __future__ import annotations

import math
from math import factorial
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trajcli.curves.hermite import hermite_coefficients
from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.curves.splines.slopes import Waypoints

_FLAT = 4 * np.finfo(np.float64).eps  # of two neighbours: a difference that rounding explains has no sign
_MOST = 3.0  # times the smaller slope beside a point: what keeps a cubic monotone whatever its other end does
_ALWAYS = 3.0  # times the slope: keeps a cubic monotone whatever the other end does within the same bound


def cubic_through(times: ArrayLike, positions: ArrayLike, velocities: ArrayLike) -> PiecewisePolynomial:
    """Return the cubics with given velocities: position and velocity are continuous.

    Args:
        times: Shape (m,), strictly increasing, m >= 2.
        positions: Shape (m, n).
        velocities: Shape (m, n).

    Raises:
        ValueError: When times do not increase, or shapes do not fit.
    """
    points = Waypoints(np.asarray(times), np.asarray(positions))
    return _through(points, np.stack([points.positions, points.rows(velocities, "velocities")]))


def quintic_through(
    times: ArrayLike, positions: ArrayLike, velocities: ArrayLike, accelerations: ArrayLike
) -> PiecewisePolynomial:
    """Return the quintics with given velocities and accelerations: both are continuous.

    Args:
        times: Shape (m,), strictly increasing, m >= 2.
        positions: Shape (m, n).
        velocities: Shape (m, n); `parabola_velocities` finds some.
        accelerations: Shape (m, n); `computed_accelerations` finds some.

    Raises:
        ValueError: When times do not increase, or shapes do not fit.
    """
    points = Waypoints(np.asarray(times), np.asarray(positions))
    given = points.rows(velocities, "velocities"), points.rows(accelerations, "accelerations")
    return _through(points, np.stack([points.positions, *given]))


def computed_velocities(times: ArrayLike, positions: ArrayLike, first: ArrayLike, last: ArrayLike) -> Array:
    """Return velocities (m, n): the mean of the slopes beside a point, zero where they differ in sign.

    A flat neighbour has the sign zero and gives zero; a change that is rounding of the positions is flat.

    Args:
        times: Shape (m,), strictly increasing, m >= 2.
        positions: Shape (m, n).
        first: Velocity at the first point, shape (n,).
        last: Velocity at the last point, shape (n,).

    Raises:
        ValueError: When times do not increase, or shapes do not fit.
    """
    points = Waypoints(np.asarray(times), np.asarray(positions))
    slopes = points.slopes
    mean = (slopes[:-1] + slopes[1:]) / 2
    return _between(points, np.where(_same_direction(points), mean, 0.0), first, last)


def parabola_velocities(times: ArrayLike, positions: ArrayLike, first: ArrayLike, last: ArrayLike) -> Array:
    """Return velocities (m, n) for quintics: of the parabola through three neighbours, held within bounds.

    Zero where the slopes beside a point differ in sign or one is flat, and at most three times the smaller of
    the two. Where the points are evenly spaced this is the mean of `computed_velocities`, unless the bound is
    reached. Where they are not, the parabola is exact to one order more, and the bound keeps a short steep
    interval from deflecting the long one beside it.

    Args:
        times: Shape (m,), strictly increasing, m >= 2.
        positions: Shape (m, n).
        first: Velocity at the first point, shape (n,).
        last: Velocity at the last point, shape (n,).

    Raises:
        ValueError: When times do not increase, or shapes do not fit.
    """
    points = Waypoints(np.asarray(times), np.asarray(positions))
    before, after = points.slopes[:-1], points.slopes[1:]
    share = (points.lengths[1:] / (points.lengths[:-1] + points.lengths[1:]))[:, None]
    size = share * np.abs(before) + (1 - share) * np.abs(after)
    held = np.minimum(size, _MOST * np.minimum(np.abs(before), np.abs(after)))
    inner = np.where(_same_direction(points), np.copysign(held, before), 0.0)
    return _between(points, inner, first, last)


def computed_accelerations(
    times: ArrayLike, velocities: ArrayLike, first: ArrayLike, last: ArrayLike
) -> Array:
    """Return accelerations (m, n) for quintics: the rule of `parabola_velocities`, for the velocities.

    So an interval at rest stays at rest, one of constant velocity stays straight, and where the velocity is
    largest there is no acceleration. With the velocities of `parabola_velocities` too, a quintic between
    two inner points that are dq apart leaves the box of the two by at most 0.0128 dq.

    Args:
        times: Shape (m,), strictly increasing, m >= 2.
        velocities: At the waypoints, shape (m, n).
        first: Acceleration at the first point, shape (n,).
        last: Acceleration at the last point, shape (n,).

    Raises:
        ValueError: When times do not increase, or shapes do not fit.
    """
    return parabola_velocities(times, velocities, first, last)


class ShapeError(ValueError):
    """An end velocity would make the curve leave the box of its waypoints.

    Attributes:
        component: Index of the component.
        end: "first" or "last".
        velocity: The one given.
        low: The smallest that is possible.
        high: The largest that is possible.
    """

    def __init__(
        self, component: int, end: Literal["first", "last"], velocity: float, low: float, high: float
    ) -> None:
        super().__init__(
            f"{end} velocity {velocity!r} of component {component} would leave the box of the waypoints: "
            f"it must be in [{low!r}, {high!r}]"
        )
        self.component, self.end, self.velocity, self.low, self.high = component, end, velocity, low, high


def shape_preserving(
    times: ArrayLike, positions: ArrayLike, first: ArrayLike | None = None, last: ArrayLike | None = None
) -> PiecewisePolynomial:
    """Return the cubics that are monotone between any two waypoints; the velocity is continuous.

    An inner point that is higher than both neighbours, lower than both, or as high as one of them, is passed
    with velocity zero; any other with a weighted harmonic mean of the slopes beside it.

    Args:
        times: Shape (m,), strictly increasing, m >= 2.
        positions: Shape (m, n).
        first: Velocity at the start, shape (n,); zero unless given.
        last: Velocity at the end, shape (n,); zero unless given.

    Raises:
        ShapeError: When an end velocity is against the direction of its interval, or too large for it.
        ValueError: When times do not increase, or shapes do not fit.
    """
    points = Waypoints(np.asarray(times), np.asarray(positions))
    velocities = np.zeros(points.positions.shape)
    velocities[1:-1] = _harmonic_means(points)
    for k, given, name in ((0, first, "first"), (-1, last, "last")):
        if given is not None:
            velocities[k] = points.row(given, f"{name} velocity")
    # of two ends on one interval at most one may be above the bound that always holds
    _check(points.slopes[0], velocities[0], velocities[1], "first")
    _check(points.slopes[-1], velocities[-1], velocities[-2], "last")
    return cubic_through(points.times, points.positions, velocities)


def _harmonic_means(points: Waypoints) -> Array:
    """Return the velocities of inner points, shape (m - 2, n); at most three times the smaller slope."""
    before, after = points.slopes[:-1], points.slopes[1:]
    earlier, later = points.lengths[:-1, None], points.lengths[1:, None]
    share = (earlier + 2 * later) / (3 * (earlier + later))
    small, large = np.minimum(np.abs(before), np.abs(after)), np.maximum(np.abs(before), np.abs(after))
    of_small = np.where(np.abs(before) < np.abs(after), share, 1 - share)
    same = np.sign(before) * np.sign(after) > 0
    size = small / (of_small + (1 - of_small) * np.divide(small, large, out=np.ones_like(small), where=same))
    return np.where(same, np.copysign(size, before), 0.0)


def _check(slope: Array, velocity: Array, other: Array, end: Literal["first", "last"]) -> None:
    """Raise ShapeError when a piece with the given mean slope and velocities, each (n,), is not monotone."""
    for component, (mean, own, opposite) in enumerate(
        zip(slope.tolist(), velocity.tolist(), other.tolist(), strict=True)
    ):
        bound = mean * _largest_ratio(opposite / mean) if mean else 0.0
        low, high = min(bound, 0.0), max(bound, 0.0)
        if not low <= own <= high:
            raise ShapeError(component, end, own, low, high)


def _largest_ratio(other: float) -> float:
    """Return the largest velocity over slope at one end of a monotone cubic; `other` is at the other end.

    It is the far side of the ellipse x^2 + x y + y^2 - 6 x - 6 y + 9 = 0, between 3 and 4. Where the other
    end is above 3 it has a check of its own, which refuses every pair outside of the ellipse.
    """
    y = min(max(other, 0.0), _ALWAYS)
    return (6 - y + math.sqrt(3 * y * (4 - y))) / 2


def _through(points: Waypoints, derivatives: Array) -> PiecewisePolynomial:
    """Return Hermite pieces, given derivatives (k, m, n).

    Each is the Taylor polynomial of its start and a Hermite polynomial for what that misses at the other end.
    The latter is small where points are close in time, and so is its rounding: a velocity divided by
    the square of a short time would spoil the continuity of the acceleration.
    """
    start, end, duration = derivatives[:, :-1], derivatives[:, 1:], points.lengths[:, None]
    order = derivatives.shape[0]
    missed = end - start
    for i in range(order):
        for j in range(1, order - i):
            missed[i] -= start[i + j] * (duration**j / factorial(j))
    coefficients = hermite_coefficients(np.zeros_like(start), missed, duration)
    for i in range(order):
        coefficients[-1 - i] = start[i] / factorial(i)
    return PiecewisePolynomial(points.times, coefficients)


def _same_direction(points: Waypoints) -> NDArray[np.bool_]:
    """Return where the slopes beside an inner point have the same sign, neither being flat; (m - 2, n)."""
    change = np.diff(points.positions, axis=0)
    size = np.abs(points.positions)
    signs = np.where(np.abs(change) <= _FLAT * np.maximum(size[:-1], size[1:]), 0.0, np.sign(change))
    same: NDArray[np.bool_] = signs[:-1] * signs[1:] > 0
    return same


def _between(points: Waypoints, inner: Array, first: ArrayLike, last: ArrayLike) -> Array:
    """Return values (m, n) from those of inner points and of both ends."""
    ends = points.row(first, "the value at the first point"), points.row(last, "the value at the last point")
    return np.concatenate([ends[0][None], inner, ends[1][None]])
