"""Fastest linear segments with parabolic blends within limits of velocity and acceleration.

With x = 1 / h for the duration h of a segment, its velocity dq x is linear in x, and so is what a blend of
duration d asks for, (v_after - v_before) / d within the limits. What remains is that blends do not overlap:

    minimise    sum_k 1 / x_k + (d_first + d_last) / 2
    subject to  x_k <= X_k,    velocity steps / limits <= d_k,    (d_k + d_(k+1)) / 2 <= 1 / x_k.

Newton's method with a logarithmic barrier follows its minimum. Each constraint couples neighbours only, so a
step solves a system of 2 x 2 blocks on three diagonals. The curvature of the last constraint,
which is not convex, is left out: so every step goes downhill, and the end is a local minimum.

Source: Boyd and Vandenberghe (2004), chapter 11, for the barrier method.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trajcli.curves.linear_systems import solve_block_tridiagonal
from trajcli.curves.parabolic_blends.corners import Ends
from trajcli.curves.piecewise import Array
from trajcli.frozen import frozen

_GAP = 1e-7  # of the total time: what the barrier may still cost at the end
_SHARPER = 0.15  # factor of the barrier's weight from round to round
_STEPS = 25  # of Newton in one round, at most
_CENTRED = 0.5  # decrease of the barrier function that a step must still promise
_ENOUGH = 1e-4  # of the promised decrease, that must come true
_SHORTEST_STEP = 1e-9  # of Newton's: none helps
_SHORTEST = 1e-6  # of the mean segment: duration of one between equal points that nothing else asks for
_ROOM = 1e-9  # relative: what summing the segments up to times may cost of an acceleration
_SOFT = 1e-3  # of the shorter segment beside it: a blend this long is taken where there is room


def fastest_blends(
    positions: ArrayLike, velocity: ArrayLike, acceleration: ArrayLike, *, ends: Ends = "centred"
) -> tuple[Array, Array]:
    """Return the durations (m - 1,) of the segments and (m,) of the blends, s, of the shortest motion.

    The motion begins and ends at rest, all joints share the blends, and no two blends overlap. Its total time
    is a local minimum to 1e-7: the sum of the segments, and with centred ends half the first and last blend
    besides; it is the same motion for both kinds of ends. A blend is as short as the limits let it, or a
    thousandth of the shorter segment beside it where there is room for that. A segment between equal points
    lasts as long as the blends around it need.

    Args:
        positions: Shape (m, n), m >= 2. When all points are equal, all durations are zero.
        velocity: Lower and upper limits, shape (n, 2), negative and positive, may be infinite.
        acceleration: Likewise; finite for every joint that moves.
        ends: Where `blended` will lay the first and last blend.

    Raises:
        ValueError: When limits are not on both sides of zero, or a joint moves without one of acceleration.
    """
    q = np.asarray(positions, dtype=np.float64)
    displacements = np.diff(q, axis=0)
    moving = (displacements != 0).any(axis=0)
    v, a = np.asarray(velocity, dtype=np.float64), np.asarray(acceleration, dtype=np.float64)
    _refuse_bounds(v, a, moving)
    if not moving.any():
        return np.zeros(displacements.shape[0]), np.zeros(q.shape[0])
    problem = _problem(displacements[:, moving], v[moving], a[moving])
    d, x = _minimum(problem, *problem.start())
    segments = 1 / x
    blends = np.maximum(problem.asked(x).max(axis=1), 0.0) * (1 + _ROOM)
    blends[1:-1] = np.maximum(blends, _SOFT * _shorter(segments))[1:-1]
    blends = np.minimum(blends, d)
    if ends == "inside":
        segments[0] += blends[0] / 2
        segments[-1] += blends[-1] / 2
    return segments, blends


def _refuse_bounds(velocity: Array, acceleration: Array, moving: NDArray[np.bool_]) -> None:
    for name, bounds in (("velocity", velocity), ("acceleration", acceleration)):
        wrong = ~((bounds[:, 0] < 0) & (bounds[:, 1] > 0))
        if wrong.any():
            j = int(wrong.argmax())
            raise ValueError(
                f"limits of {name} must be on both sides of zero, joint {j} has {bounds[j].tolist()}"
            )
    unlimited = moving & ~np.isfinite(acceleration).all(axis=1)
    if unlimited.any():
        raise ValueError(f"joint {int(unlimited.argmax())} moves and has no limit of acceleration")


def _shorter(segments: Array) -> Array:
    """Return the shorter of the segments beside each point, shape (m,)."""
    padded = np.pad(segments, 1, mode="edge")
    return np.minimum(padded[:-1], padded[1:])


@frozen
class _Problem:
    """The constraints, for m points and n joints.

    Attributes:
        fastest: X, shape (m - 1,).
        after: Displacement of the segment after each point over both limits of acceleration, shape (m, 2n);
            zero at the last point.
        before: The same of the segment before; zero at the first point.
    """

    fastest: Array
    after: Array
    before: Array

    def asked(self, x: Array) -> Array:
        """Return what each blend must last, by point and limit, shape (m, 2n)."""
        first, last = self.before * np.append(0.0, x)[:, None], self.after * np.append(x, 0.0)[:, None]
        asked: Array = last - first
        return asked

    def slacks(self, d: Array, x: Array) -> tuple[Array, Array, Array]:
        """Return what is left of each constraint: (m, 2n), (m - 1,), (m - 1,); all positive inside."""
        return d[:, None] - self.asked(x), 1 / x - (d[1:] + d[:-1]) / 2, self.fastest - x

    def blends_at_most(self, x: Array) -> Array:
        """Return how long each blend is when the speeds of its segments add up, shape (m,)."""
        apart = _Problem(self.fastest, np.abs(self.after), -np.abs(self.before))
        blends: Array = apart.asked(x).max(axis=1)
        return blends

    def start(self) -> tuple[Array, Array]:
        """Return blends and x inside all constraints, from the velocity limits alone.

        Longer segments are slower, so they ask for shorter blends: what is lengthened once for them has room.
        """
        segments = 1.1 / self.fastest
        blends = self.blends_at_most(1 / segments)
        segments = np.maximum(segments, 0.55 * (blends[1:] + blends[:-1]))
        return 1.05 * blends + 0.02 * _shorter(segments), 1 / segments


def _problem(displacements: Array, velocity: Array, acceleration: Array) -> _Problem:
    """Return the constraints for displacements (m - 1, n) of joints that all move.

    A joint without a limit of velocity gets the one that it cannot exceed between rest and rest.
    """
    size, hardest = np.abs(displacements), np.abs(acceleration).max(axis=1)
    limit = np.where(displacements > 0, velocity[:, 1], -velocity[:, 0])
    limit = np.minimum(limit, np.sqrt(2 * hardest * size.sum(axis=0)))
    shortest = (size / limit).max(axis=1)
    least = _SHORTEST * np.sqrt(size / hardest).max(axis=1).mean()
    shortest = np.where(shortest > 0, shortest, least)
    asked = np.concatenate([displacements / acceleration[:, 1], displacements / acceleration[:, 0]], axis=1)
    none = np.zeros((1, asked.shape[1]))
    return _Problem(1 / shortest, np.concatenate([asked, none]), np.concatenate([none, asked]))


def _minimum(problem: _Problem, d: Array, x: Array) -> tuple[Array, Array]:
    count = problem.after.size + 2 * x.size
    weight, gap = _total(d, x) / count, 1.0
    while True:
        for _ in range(_STEPS):
            d, x, promised = _newton(problem, weight, d, x)
            if promised < _CENTRED:
                break
        if gap <= _GAP:
            return d, x
        gap *= _SHARPER
        weight = gap * _total(d, x) / count


def _total(d: Array, x: Array) -> float:
    return float((1 / x).sum() + (d[0] + d[-1]) / 2)


def _value(problem: _Problem, weight: float, d: Array, x: Array) -> float:
    """Return what the barrier method minimises, infinite outside the constraints."""
    if x.min() <= 0:
        return np.inf
    slacks = problem.slacks(d, x)
    if min(slack.min() for slack in slacks) <= 0:
        return np.inf
    return _total(d, x) / weight - float(math.fsum(np.log(slack).sum() for slack in slacks))


def _newton(problem: _Problem, weight: float, d: Array, x: Array) -> tuple[Array, Array, float]:
    """Return blends and x after one step, and by how much the full step promised to decrease the value."""
    gradient, diagonal, upper = _system(problem, weight, d, x)
    step = -solve_block_tridiagonal(diagonal, upper, gradient.reshape(-1)).reshape(-1, 2)
    promised = -float((gradient * step).sum())
    to_d, to_x = step[:, 0], step[:-1, 1]
    value, part = _value(problem, weight, d, x), 1.0
    while part > _SHORTEST_STEP:
        moved = d + part * to_d, x + part * to_x
        if _value(problem, weight, *moved) < value - _ENOUGH * part * promised:
            return *moved, promised / 2
        part /= 2
    return d, x, 0.0


def _system(problem: _Problem, weight: float, d: Array, x: Array) -> tuple[Array, Array, Array]:
    """Return the gradient (m, 2) by (d, x) and the blocks of the Hessian; the last point has no x."""
    by_limit, by_room, by_speed = (1 / slack for slack in problem.slacks(d, x))
    after, before = problem.after * by_limit, problem.before * by_limit
    gradient, diagonal = np.zeros((d.size, 2)), np.zeros((d.size, 2, 2))
    upper = np.zeros((x.size, 2, 2))
    inverse = 1 / x**2

    gradient[:, 0] = -by_limit.sum(axis=1)
    gradient[[0, -1], 0] += 0.5 / weight
    gradient[:-1, 0] += by_room / 2
    gradient[1:, 0] += by_room / 2
    gradient[:-1, 1] = after.sum(axis=1)[:-1] - before.sum(axis=1)[1:]
    gradient[:-1, 1] += inverse * (by_room - 1 / weight) + by_speed

    diagonal[:, 0, 0] = (by_limit**2).sum(axis=1)
    diagonal[:-1, 0, 0] += by_room**2 / 4
    diagonal[1:, 0, 0] += by_room**2 / 4
    diagonal[:, 0, 1] = -(after * by_limit).sum(axis=1)
    diagonal[:-1, 0, 1] += by_room**2 * inverse / 2
    diagonal[:, 1, 0] = diagonal[:, 0, 1]
    diagonal[:-1, 1, 1] = (after**2).sum(axis=1)[:-1] + (before**2).sum(axis=1)[1:]
    diagonal[:-1, 1, 1] += (by_room * inverse) ** 2 + by_speed**2
    diagonal[:-1, 1, 1] += 2 * inverse / x / weight
    diagonal[-1, 1, 1] = 1.0

    upper[:, 0, 0] = by_room**2 / 4
    upper[:, 1, 0] = (before * by_limit).sum(axis=1)[1:] + by_room**2 * inverse / 2
    upper[:, 1, 1] = -(before * after).sum(axis=1)[1:]
    return gradient, diagonal, upper
