"""Virtual points: cubic splines whose end velocities and end accelerations are both imposed.

Waypoints alone leave no freedom for that; one virtual point in each end interval gives it. A virtual point
has a time but no position: that follows from the solution.

Inside an end interval the acceleration runs from the given a over the virtual point's M to the M' of the next
waypoint. What the given state leaves of the displacement fixes M; so the interval is eliminated in closed
form, and the inner waypoints keep a system dominated by its diagonal, wherever the virtual points lie.

Source: Siciliano et al. (2009), section 4.2.1; the same curve, with other unknowns.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from trajcli.curves.piecewise import Array, PiecewisePolynomial, read_only
from trajcli.curves.splines.cubic import (
    KnotEquations,
    cubics,
    knot_accelerations,
    knot_equations,
    starting_velocities,
    without_acceleration,
)
from trajcli.curves.splines.slopes import Waypoints
from trajcli.frozen import frozen


def continuous_acceleration(
    times: ArrayLike,
    positions: ArrayLike,
    velocities: ArrayLike,
    accelerations: ArrayLike,
    virtual_times: ArrayLike | None = None,
) -> PiecewisePolynomial:
    """Return m + 1 cubics through m waypoints, with velocity and acceleration given at both ends.

    Args:
        times: Shape (m,), strictly increasing, m >= 2.
        positions: Shape (m, n).
        velocities: At the first and the last point, shape (2, n).
        accelerations: The same.
        virtual_times: Shape (2,), inside the first and the last interval; their middles unless given. Two
            points have one interval for both; it is then cut in thirds.

    Raises:
        ValueError: When times do not increase, shapes do not fit, or a virtual time is outside its interval.
    """
    points = Waypoints(np.asarray(times), np.asarray(positions))
    first, last = (
        _EndState(
            points.positions[k], points.row(velocity, "velocity"), points.row(acceleration, "acceleration")
        )
        for k, velocity, acceleration in zip((0, -1), _two(velocities), _two(accelerations), strict=True)
    )
    virtual = _virtual_times(points.times, virtual_times)
    return (_three_pieces if points.count == 2 else _many_pieces)(points, virtual, first, last)


def virtual_points(curve: PiecewisePolynomial) -> tuple[Array, Array]:
    """Return times (2,) and positions (2, n) of the two virtual points of `continuous_acceleration`."""
    ends = [1, -1]
    times: Array = curve.breaks[:-1][ends]
    positions: Array = curve.coefficients[-1][ends]
    return times, positions


def _two(values: ArrayLike) -> Array:
    """Return one row for each of the two ends."""
    array = np.asarray(values, dtype=np.float64)
    if array.ndim != 2 or array.shape[0] != 2:
        raise ValueError(f"expected one row for each of the two ends, got shape {array.shape}")
    return array


def _virtual_times(times: Array, given: ArrayLike | None) -> Array:
    """Return the times (2,) of the virtual points: those given, or the middles of the end intervals."""
    if given is None and times.size == 2:
        virtual: Array = times[0] + (times[1] - times[0]) * np.array([1.0, 2.0]) / 3
    elif given is None:
        virtual = (times[[0, -2]] + times[[1, -1]]) / 2
    else:
        virtual = read_only(given)
    if virtual.shape != (2,) or not (
        times[0] < virtual[0] < times[1] and times[-2] < virtual[1] < times[-1] and virtual[0] < virtual[1]
    ):
        raise ValueError(
            f"virtual times {virtual.tolist()} must increase and lie inside the first interval, "
            f"({float(times[0])!r}, {float(times[1])!r}), and the last one, "
            f"({float(times[-2])!r}, {float(times[-1])!r})"
        )
    return virtual


@frozen
class _EndState:
    """Position, velocity and acceleration of one end, each of shape (n,)."""

    position: Array
    velocity: Array
    acceleration: Array

    def backwards(self) -> _EndState:
        return _EndState(self.position, -self.velocity, self.acceleration)

    def after(self, time: float, acceleration: Array) -> _EndState:
        """Return the state to which a linear change to `acceleration` leads."""
        mean = (self.acceleration + acceleration) / 2
        displacement = time * (self.velocity + time * (2 * self.acceleration + acceleration) / 6)
        return _EndState(self.position + displacement, self.velocity + time * mean, acceleration)


@frozen
class _EndInterval:
    """From the first waypoint over a virtual one, `to_virtual` later, to the next, `to_real` after that.

    Attributes:
        start: State at the first waypoint.
        to_virtual: Positive.
        to_real: Positive.
        next_position: Of the next waypoint, shape (n,).
    """

    start: _EndState
    to_virtual: float
    to_real: float
    next_position: Array

    def left_over(self) -> Array:
        """Return six times the displacement that M and M' must cause, shape (n,)."""
        early, late, start = self.to_virtual, self.to_real, self.start
        straight = self.next_position - start.position - start.velocity * (early + late)
        left: Array = 6 * straight - start.acceleration * early * (2 * early + 3 * late)
        return left

    def eliminate(self, outer: KnotEquations, inner: KnotEquations) -> None:
        """Write the velocity at the next waypoint, without M, into the rows of the first two knots."""
        early, late, start = self.to_virtual, self.to_real, self.start
        without_acceleration(outer, inner)
        outer.stiffness[1] = late * (early + late) / (2 * (early + 2 * late))
        outer.velocity[1] = (
            start.velocity + start.acceleration * early / 2 + self.left_over() / (2 * (early + 2 * late))
        )

    def virtual_state(self, next_acceleration: Array) -> _EndState:
        """Return the state at the virtual point, given M' of the next waypoint, shape (n,)."""
        early, late = self.to_virtual, self.to_real
        wanted = (self.left_over() - next_acceleration * late**2) / ((early + late) * (early + 2 * late))
        return self.start.after(early, wanted)


def _many_pieces(points: Waypoints, virtual: Array, first: _EndState, last: _EndState) -> PiecewisePolynomial:
    """Return the curve through three points or more."""
    times, positions = points.times, points.positions
    head = _EndInterval(first, virtual[0] - times[0], times[1] - virtual[0], positions[1])
    tail = _EndInterval(last.backwards(), times[-1] - virtual[1], virtual[1] - times[-2], positions[-2])
    before, after = knot_equations(points)
    head.eliminate(before, after)
    tail.eliminate(after.backwards(), before.backwards())
    solved = knot_accelerations(before, after)
    states = head.virtual_state(solved[1]), tail.virtual_state(solved[-2]).backwards()
    inner = slice(1, -1)
    starting = starting_velocities(points, solved)[inner]
    leaving_last = -(after.velocity[-2] + after.stiffness[-2] * solved[-2])
    return _assembled(
        times,
        virtual,
        (positions[inner], np.concatenate([starting, leaving_last[None]]), solved[inner]),
        (first, *states, last),
    )


def _three_pieces(
    points: Waypoints, virtual: Array, first: _EndState, last: _EndState
) -> PiecewisePolynomial:
    """Return the curve between two points.

    The unknown accelerations weigh two hats, one over each virtual point. The area under both is what the
    velocity still has to change, and their first moment follows from the displacement; the centres of the two
    hats lie a third of the duration apart, so the two equations are always independent.
    """
    start, end = points.times
    total, (one, two, three) = end - start, np.diff([start, *virtual, end])
    given, wanted = first.acceleration, last.acceleration
    area = last.velocity - first.velocity - (given * one + wanted * three) / 2
    displacement = (
        (last.position - first.position)
        - first.velocity * total
        - (given * one * (3 * total - one) + wanted * three**2) / 6
    )
    moment = area * total - displacement
    centres = (2 * one + two) / 3, (2 * one + two + total) / 3
    at_first = 6 / (total * (one + two)) * (centres[1] * area - moment)
    at_second = 6 / (total * (two + three)) * (moment - centres[0] * area)
    states = first.after(one, at_first), last.backwards().after(three, at_second).backwards()
    nothing = np.empty((0, first.position.size))
    return _assembled(points.times, virtual, (nothing, nothing, nothing), (first, *states, last))


def _assembled(
    times: Array,
    virtual: Array,
    inner: tuple[Array, Array, Array],
    outer: tuple[_EndState, _EndState, _EndState, _EndState],
) -> PiecewisePolynomial:
    """Return the curve over first point, virtual point, real inner points, virtual point, last point.

    Args:
        times: Of the m waypoints.
        virtual: Times of the virtual points, shape (2,).
        inner: Position, velocity and acceleration at the inner waypoints, each (m - 2, n).
        outer: States at the first waypoint, the two virtual points, and the last waypoint.
    """
    first, early, late, last = outer
    knots = np.concatenate([times[:1], virtual[:1], times[1:-1], virtual[1:], times[-1:]])
    positions = np.concatenate([[first.position, early.position], inner[0], [late.position]])
    velocities = np.concatenate([[first.velocity, early.velocity], inner[1], [late.velocity]])
    accelerations = np.concatenate(
        [[first.acceleration, early.acceleration], inner[2], [late.acceleration, last.acceleration]]
    )
    return cubics(knots, positions, velocities, accelerations)
