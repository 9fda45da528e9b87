"""Virtual points: cubic splines whose end velocities and end accelerations are both imposed.

Waypoints alone leave no freedom for that; one virtual point in each end interval gives it. A virtual point
has a time but no position: that follows from the solution.

Inside an end interval the acceleration runs from the given a over the virtual point's M to the M' of the next
waypoint. What the given state leaves of the displacement fixes M; so the interval is eliminated in closed
form, and the inner waypoints keep a system dominated by its diagonal, wherever the virtual points lie.

Source: Siciliano et al. (2009), section 4.2.1; the same curve, with other unknowns.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from trajcli.curves.piecewise import Array, PiecewisePolynomial, read_only
from trajcli.curves.splines.cubic import (
    KnotEquations,
    cubics,
    fill_pieces,
    knot_accelerations,
    knot_equations,
    make_pieces,
    solved_together,
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

    def of(self, columns: slice) -> _EndState:
        return _EndState(self.position[columns], self.velocity[columns], self.acceleration[columns])

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
    """Return the curve through three points or more: two pieces at either end, those of a spline between."""
    times, positions = points.times, points.positions
    coefficients = np.empty((4, points.count + 1, positions.shape[1]))
    inner = coefficients[:, 2:-2]
    beside, leaving = _solve(inner[1], points, virtual, first, last)
    if points.count > 3:
        make_pieces(inner, Waypoints(times[1:-1], positions[1:-1]), beside[1], None)
    head, tail = _end_intervals(points, virtual, first, last)
    early, late = head.virtual_state(beside[0]), tail.virtual_state(beside[1]).backwards()
    from_last = _EndState(positions[-2], leaving, beside[1])
    knots = np.concatenate([times[:1], virtual[:1], times[1:-1], virtual[1:], times[-1:]])
    ends = (coefficients[:, :2], knots[:3]), (coefficients[:, -2:], knots[-3:])
    states = _stacked((first, early), beside[0]), _stacked((from_last, late), last.acceleration)
    for (pieces, times_there), at in zip(ends, states, strict=True):
        fill_pieces(pieces, np.diff(times_there), *at)
    coefficients.flags.writeable = False  # the curve takes it without a copy
    return PiecewisePolynomial(knots, coefficients)


def _solve(
    acceleration: Array, points: Waypoints, virtual: Array, first: _EndState, last: _EndState
) -> tuple[Array, Array]:
    """Write the accelerations at the inner waypoints but the last one, (m - 3, n)."""
    beside, leaving = np.empty((2, points.positions.shape[1])), np.empty(points.positions.shape[1])
    for columns in solved_together(*points.positions.shape):
        part = Waypoints(points.times, points.positions[:, columns])
        head, tail = _end_intervals(part, virtual, first.of(columns), last.of(columns))
        before, after = knot_equations(part)
        head.eliminate(before, after)
        tail.eliminate(after.backwards(), before.backwards())
        solved = knot_accelerations(before, after)
        acceleration[:, columns], beside[:, columns] = solved[1:-2], solved[[1, -2]]
        leaving[columns] = -(after.velocity[-2] + after.stiffness[-2] * solved[-2])
    return beside, leaving


def _end_intervals(
    points: Waypoints, virtual: Array, first: _EndState, last: _EndState
) -> tuple[_EndInterval, _EndInterval]:
    """Return the first interval, and the last one backwards in time."""
    times, positions = points.times, points.positions
    head = _EndInterval(first, virtual[0] - times[0], times[1] - virtual[0], positions[1])
    back = _EndInterval(last.backwards(), times[-1] - virtual[1], virtual[1] - times[-2], positions[-2])
    return head, back


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
    states = first, first.after(one, at_first), last.backwards().after(three, at_second).backwards()
    knots = np.concatenate([points.times[:1], virtual, points.times[1:]])
    return cubics(knots, *_stacked(states, last.acceleration))


def _stacked(states: Sequence[_EndState], last: Array) -> tuple[Array, Array, Array]:
    """Return positions and velocities at the starts of pieces, accelerations there and, last, behind them."""
    accelerations = [*(state.acceleration for state in states), last]
    position, velocity = [state.position for state in states], [state.velocity for state in states]
    return np.stack(position), np.stack(velocity), np.stack(accelerations)
