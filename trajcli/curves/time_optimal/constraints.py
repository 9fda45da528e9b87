"""Constraints on the motion along a path: rows a u + b x <= c and caps on x, where x = sd^2 and u = sdd.

With q(s) and s(t) the chain rule gives qd = q' sd and qdd = q' u + q'' x: bounds on acceleration are rows,
bounds on velocity are caps. Every c is positive: standing still is always allowed.

Rows hold at grid points. What a law uses of a limit between them is the excess of the constraint there, a
multiple of the limit. For joints it comes from the control points of q(s(t)): they bound a polynomial, and
lie above its largest value by no more than a sixth of what lies above the chord.

Source: Pham and Pham (2018), sections II and III, for the rows.
"""

from __future__ import annotations

from typing import ClassVar, Protocol

import numpy as np

from trajcli.curves.approach import ApproachLimits, uses_of_pieces
from trajcli.curves.piecewise import (
    Array,
    PiecewisePolynomial,
    Side,
    control_points,
    derivative_coefficients,
    horner,
)
from trajcli.curves.time_optimal.time_law import LawPieces, blocks
from trajcli.frozen import frozen

_KINK = 1e-9  # of the largest derivative of a joint: a jump above it is a corner
_ROUNDING = 1e-13  # of the largest derivative of all joints: the same, where one hardly moves
_NEARLY = 0.999  # of an approach limit: what uses less is not looked at closely
_MOST = 1e3  # excess that is told: limits lowered by more would be rounding


@frozen
class ConstraintRows:
    """Rows a u + b x <= c and caps x <= cap at p points of a path.

    Attributes:
        a: Shape (p, k).
        b: Shape (p, k).
        c: Shape (p, k), positive; infinite for no bound.
        cap: Largest x, shape (p,); infinite for no bound, zero where the motion must stop.
        work: Where b = a' and c is constant in each row: c times the antiderivative of a, shape (p, k).
    """

    a: Array
    b: Array
    c: Array
    cap: Array
    work: Array | None = None


class PathConstraint(Protocol):
    """What limits the motion along a path: how fast it may be, and by how much a law is too fast.

    A solution obeys the rows at the points of its grid. Between them it is judged by the excess: in an
    interval where that is above one, its caps and its c are lowered and the problem is solved again.

    Attributes:
        estimate: What share of the time that a grid may lose by estimate it may lose here, at most 1: less
            where rows change faster along the path than those of accelerations of joints.
    """

    estimate: ClassVar[float]

    @property
    def bounds_sdd(self) -> bool:
        """Whether it has rows with a bound."""
        ...

    def rows(self, s: Array, side: Side) -> ConstraintRows:
        """Return the rows at the points (p,) of the path, seen from one side; k is always the same."""
        ...

    def largest(self, s: Array, side: Side) -> Array:
        """Return what sd^2 cannot pass at points (p,) of the path, whatever the motion; or infinity."""
        return self.rows(s, side).cap

    def shortest(self, s: Array) -> Array:
        """Return times, s, below which no motion goes from one of points (p,) to the next one, (p - 1,)."""
        return np.zeros(s.size - 1)  # what joints need is known elsewhere

    def excess(self, law: LawPieces) -> Array:
        """Return the largest multiples of its limits that each piece of a law reaches, shape (2, N).

        The first row is of what grows with sd, and met by dividing the caps by its square; the second of
        what grows with sd^2 and sdd, and met by dividing every c by it: the share of what c leaves room for,
        without what does not change with the speed. Zero where there is no such limit; above one never less
        than what is reached, up to the resolution that the constraint names.

        Args:
            law: N pieces, one for each interval, each within one piece of the path.
        """
        ...


@frozen
class JointConstraint(PathConstraint):
    """Limits of the velocity and the acceleration of joints; an excess above one is a bound for all t.

    Attributes:
        path: q(s) with n joints.
        velocity: Lower and upper bounds, shape (n, 2), lower < 0 < upper, infinite for none.
        acceleration: The same of acceleration.

    Raises:
        ValueError: When bounds have another shape or sign.
    """

    estimate: ClassVar[float] = 1.0

    path: PiecewisePolynomial
    velocity: Array
    acceleration: Array

    @property
    def bounds_sdd(self) -> bool:
        """Whether some acceleration is bounded."""
        return bool(np.isfinite(self.acceleration).any())

    def __post_init__(self) -> None:
        n = self.path.dimension
        for name, bounds in (("velocity", self.velocity), ("acceleration", self.acceleration)):
            if bounds.shape != (n, 2) or not ((bounds[:, 0] < 0) & (bounds[:, 1] > 0)).all():
                raise ValueError(f"{name} bounds must be {n} pairs with lower < 0 < upper")

    def rows(self, s: Array, side: Side) -> ConstraintRows:
        """Return the rows at points (p,), one for each finite bound of acceleration."""
        upper, lower = np.isfinite(self.acceleration[:, 1]), np.isfinite(self.acceleration[:, 0])
        limits = np.concatenate([self.acceleration[upper, 1], -self.acceleration[lower, 0]])
        values = self.path.evaluate_orders(s, (0, 1, 2), side=side)
        q, first, second = np.ascontiguousarray(values.transpose(1, 2, 0))  # (n, p): over p it goes fast
        sizes = np.abs(first).max(axis=1, keepdims=True)
        first = np.where(sizes > _ROUNDING * sizes.max(), first, 0.0)  # rounding moves no joint that rests
        work, a, b = (np.concatenate([each[upper], -each[lower]]).T for each in (q, first, second))
        low, high = self.velocity.T[..., None]
        rate = np.maximum(first / high, first / low).max(axis=0)
        with np.errstate(divide="ignore", over="ignore"):
            return ConstraintRows(a, b, np.broadcast_to(limits, a.shape), rate**-2.0, work * limits)

    def excess(self, law: LawPieces) -> Array:
        """Return bounds of what is used of velocity and acceleration in each piece, shape (2, N)."""
        excess = np.empty((2, law.durations.size))
        for block in blocks(law.durations.size):
            pieces = law.chosen(block)
            excess[:, block] = self._excess(pieces.along(self.path), pieces.durations)
        return excess

    def _excess(self, q: Array, durations: Array) -> Array:
        """Return the excess (2, w) of polynomials q(t) (d + 1, n, w) that last (w,)."""
        points = control_points(derivative_coefficients(q, 2), durations)
        qd = derivative_coefficients(q, 1)
        velocity = _used(np.stack([qd[-1], horner(qd, durations)]), self.velocity)
        slowest = np.abs(self.velocity).min(axis=1, keepdims=True)
        steepest = (np.abs(points).max(axis=0) / slowest).max(axis=0)
        upper_bound = velocity + 0.5 * steepest * durations
        fast = np.flatnonzero(
            ~(upper_bound <= 1.0)
        )  # elsewhere the ends and the acceleration bound the velocity
        velocity[fast] = _used(control_points(qd[:, :, fast], durations[fast]), self.velocity)
        return np.stack([velocity, _used(points, self.acceleration)])


@frozen
class ApproachConstraint(PathConstraint):
    """Limits of the velocities with which joints approach the ends of their ranges; the excess is exact.

    Attributes:
        path: q(s) with n joints.
        limits: Of the joints.
    """

    estimate: ClassVar[float] = 1.0
    bounds_sdd: ClassVar[bool] = False

    path: PiecewisePolynomial
    limits: ApproachLimits

    def rows(self, s: Array, side: Side) -> ConstraintRows:
        """Return no rows, and for each direction in which a joint moves its limit as cap, at points (p,)."""
        position, first = self.path.evaluate_orders(s, (0, 1), side=side).transpose(1, 0, 2)
        low, high = self.limits.bounds(position)
        nothing = np.empty((s.size, 0))
        with np.errstate(divide="ignore", over="ignore"):
            rate = np.maximum(first / high, first / low).max(axis=1)
            return ConstraintRows(nothing, nothing, nothing, rate**-2.0)

    def excess(self, law: LawPieces) -> Array:
        """Return what is used of the limits in each piece, and zeros for acceleration, (2, N)."""
        excess = np.zeros((2, law.durations.size))
        for block in blocks(law.durations.size):
            pieces = law.chosen(block)
            q = pieces.along(self.path).transpose(0, 2, 1)
            uses, _ = uses_of_pieces(q, pieces.durations, self.limits, _NEARLY)
            excess[0, block] = np.minimum(uses.max(axis=1, initial=0.0), _MOST)
        return excess


def is_at_rest(path: PiecewisePolynomial) -> tuple[bool, bool]:
    """Return whether q' vanishes at the start and at the end, so that any sd is rest there."""
    begins, ends = path.piece_ends(1)
    negligible = _negligible(begins, ends)
    return bool((np.abs(begins[0]) <= negligible).all()), bool((np.abs(ends[-1]) <= negligible).all())


def corners(path: PiecewisePolynomial) -> Array:
    """Return the breaks at which q' jumps, so that the motion must stop there."""
    begins, ends = path.piece_ends(1)
    jumps = np.abs(begins[1:] - ends[:-1]) > _negligible(begins, ends)
    return np.asarray(path.breaks[1:-1][jumps.any(axis=1)])


def _negligible(begins: Array, ends: Array) -> Array:
    """Return what counts as no derivative of each joint, shape (n,), from those at the ends of pieces."""
    largest = np.maximum(np.abs(begins), np.abs(ends)).max(axis=0)
    return np.asarray(np.maximum(_KINK * largest, _ROUNDING * largest.max()))


def _used(values: Array, bounds: Array) -> Array:
    """Return how much of the bounds (n, 2) values (k, n, w) use at most, shape (w,)."""
    high, low = values.max(axis=0) / bounds[:, 1, None], values.min(axis=0) / bounds[:, 0, None]
    return np.asarray(np.maximum(high, low).max(axis=0))
