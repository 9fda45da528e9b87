"""Limits of efforts as a constraint on the motion along a path of the joints.

With q(s) and s(t) the effort is a u + b x + g + f, where x = sd^2, u = sdd, a = M q',
b = M q'' + C(q, q') q', g is gravity and f friction: Coulomb friction keeps its sign along the path, and
belongs to g. Viscous friction v q' sd is not linear in x. Where it takes from what a joint may do it is
bounded by the tangent at a speed r, sd <= r / 2 + x / (2 r), where it gives by the chord to the largest
speed, sd >= x / cap: both are on the safe side, whatever r is, and the first is exact where sd = r.

Source: Bobrow, Dubowsky and Gibson (1985); the bounds of viscous friction are our own.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar

import numpy as np

from trajcli.curves.piecewise import Array, PiecewisePolynomial, Side, derivative_coefficients, horner
from trajcli.curves.time_optimal.constraints import ConstraintRows, PathConstraint
from trajcli.curves.time_optimal.time_law import LawPieces
from trajcli.dynamics.newton_euler import InverseDynamics, direction
from trajcli.frozen import frozen

_MOST = 1e3  # excess that is told: limits lowered by more would be rounding
_SAMPLES = (0.0, 0.5, 1.0)  # of an interval: sdd is largest at an end, or nearly so
_SHARE = 0.5  # of what gravity leaves: what the tangent may take of it at rest
_SAME = 1e-12  # of the largest: states on both sides of a break that differ by less are one
_SLOWEST = 1e-3  # of the largest speed at which a tangent is taken


class HeldOverLimitError(ValueError):
    """Gravity and friction alone take as much of a joint as it has, or more.

    Attributes:
        joint: Index.
        s: Path parameter.
        effort: What they take, N m or N.
        limit: What the joint has in that direction.
    """

    def __init__(self, joint: int, s: float, effort: float, limit: float) -> None:
        self.joint, self.s, self.effort, self.limit = joint, s, effort, limit
        super().__init__(f"at s = {s:.9g} joint {joint} is held with {effort:.9g}, its limit is {limit:.9g}")


class _PathDynamics:
    """What inverse dynamics says at points of a path, kept: finer grids, and both sides, ask again."""

    def __init__(self, dynamics: InverseDynamics) -> None:
        n = len(dynamics.links)
        self._dynamics = dynamics
        self._s, self._states, self._values = np.empty(0), np.empty((0, 3 * n)), np.empty((0, 3 * n))

    def at(self, s: Array, q: Array, first: Array, second: Array) -> list[Array]:
        """Return M q', M q'' + C q' and g at points (p,), each (p, n)."""
        states = np.concatenate([q, first, second], axis=1)
        near, apart = np.searchsorted(self._s, s), _SAME * np.abs(states).max(axis=0, initial=0.0)
        values, new = np.empty_like(states), np.arange(s.size)
        for beside in (0, 1, -1) if self._s.size else ():  # of a break there are two states
            if not new.size:
                break
            index = np.clip(near[new] + beside, 0, self._s.size - 1)
            same = (np.abs(self._states[index] - states[new]) <= apart).all(axis=1)
            values[new[same]], new = self._values[index[same]], new[~same]
        if new.size:
            found = self._dynamics.along_path(q[new], first[new], second[new])
            values[new] = np.concatenate(found, axis=1)
            every = np.concatenate([s[new], self._s])
            order = np.argsort(every, kind="stable")
            self._s = every[order]
            self._states = np.concatenate([states[new], self._states])[order]
            self._values = np.concatenate([values[new], self._values])[order]
        return np.split(values, 3, axis=1)


@frozen
class EffortConstraint(PathConstraint):
    """Limits of torques and forces of joints; between grid points they are sampled.

    Attributes:
        dynamics: Of the arm with what it carries.
        path: q(s) with n joints.
        limits: Lower and upper bounds, shape (n, 2), lower < 0 < upper, infinite for none.
        velocity: Bounds of the joints' velocities, shape (n, 2): how fast viscous friction can be.
        speed: From points (p,) of the path to a speed sd near that of the motion, (p,); None where it is not
            known. It says where viscous friction is not overestimated.
    """

    estimate: ClassVar[float] = 0.3

    dynamics: InverseDynamics
    path: PiecewisePolynomial
    limits: Array
    velocity: Array
    speed: Callable[[Array], Array] | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "_memory", _PathDynamics(self.dynamics))

    @property
    def _path_dynamics(self) -> _PathDynamics:
        memory: _PathDynamics = self.__dict__["_memory"]
        return memory

    @property
    def bounds_sdd(self) -> bool:
        """Whether some effort is bounded."""
        return bool(np.isfinite(self.limits).any())

    @property
    def has_viscous(self) -> bool:
        """Whether a joint has viscous friction."""
        return bool(self._viscous.any())

    def rows(self, s: Array, side: Side) -> ConstraintRows:
        """Return the rows at points (p,), one for each finite bound.

        Raises:
            HeldOverLimitError: When gravity and friction alone take a joint to its limit at one of them.
        """
        q, first, second = self.path.evaluate_orders(s, (0, 1, 2), side=side).transpose(1, 0, 2)
        a, b, held = self._path_dynamics.at(s, q, first, second)
        held = held + self._coulomb * np.sign(first)
        upper, lower = self._bounded
        slacks = np.concatenate(
            [self.limits[upper, 1] - held[:, upper], held[:, lower] - self.limits[lower, 0]], 1
        )
        self._require_slack(s, held, slacks)
        a, b, friction = (self._both_bounds(values) for values in (a, b, self._viscous * first))
        slopes, offsets = self._viscous_rows(s, first, friction, slacks)
        return ConstraintRows(a, b + slopes, slacks - offsets, np.full(s.size, np.inf))

    def largest(self, s: Array, side: Side) -> Array:
        """Return no bound at points (p,): sdd may be anything."""
        del side
        return np.full(s.size, np.inf)

    def excess(self, law: LawPieces) -> Array:
        """Return zeros for velocity, and the shares used of what gravity leaves, at samples, (2, N)."""
        times = np.array(_SAMPLES)[:, None] * law.durations
        s, speed, change = (horner(derivative_coefficients(law.coefficients, k), times) for k in range(3))
        piece = np.clip(np.searchsorted(self.path.breaks, s[0], "right") - 1, 0, self.path.pieces - 1)
        local, spoken = (s - self.path.breaks[piece])[..., None], self.path.coefficients[:, piece]
        states = np.stack([horner(derivative_coefficients(spoken, k), local) for k in range(3)])
        rate = states[1] * speed[..., None]
        moving, gravity = self._moving(s, states, speed[..., None], change[..., None])
        moving += self._viscous * rate
        slacks = self._slacks(
            gravity + self._coulomb * direction(rate[1])
        )  # at rest at an end it is that of the motion
        used = self._both_bounds(moving)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            shares = np.where(slacks > 0, used / slacks, np.where(used > slacks, _MOST, 0.0))
        worst = np.clip(shares.max(axis=(0, 2), initial=0.0), 0.0, _MOST)
        return np.stack([np.zeros_like(worst), worst])

    def _moving(self, s: Array, states: Array, speed: Array, change: Array) -> tuple[Array, Array]:
        """Return efforts without friction, less gravity at the near ends, (samples, N, n), and that, (N, n).

        Where the limit is met its share is 1 whatever gravity is taken to be: that of the near end is known,
        and so is what makes the efforts at both ends, where grid points are.
        """
        (q, first, second), ends = states, [0, -1]
        near = states[:, ends].reshape(3, -1, q.shape[2])
        a, b, held = np.reshape(self._path_dynamics.at(s[ends].reshape(-1), *near), (3, 2, *q.shape[1:]))
        moving = self.dynamics.rigid_effort(
            q[1:-1], first[1:-1] * speed[1:-1], first[1:-1] * change[1:-1] + second[1:-1] * speed[1:-1] ** 2
        )
        begin, end = a * change[ends] + b * speed[ends] ** 2 + held
        return np.concatenate([begin[None], moving, end[None]]) - held[0], held[0]

    @property
    def _bounded(self) -> tuple[Array, Array]:
        """Which joints have an upper and which a lower bound, each (n,)."""
        return np.isfinite(self.limits[:, 1]), np.isfinite(self.limits[:, 0])

    @property
    def _coulomb(self) -> Array:
        return np.array([joint.friction.coulomb for joint in self.dynamics.robot.joints])

    @property
    def _viscous(self) -> Array:
        return np.array([joint.friction.viscous for joint in self.dynamics.robot.joints])

    def _both_bounds(self, values: Array) -> Array:
        """Return values (..., n) of joints as rows: those with an upper bound, then with a lower one."""
        upper, lower = self._bounded
        return np.concatenate([values[..., upper], -values[..., lower]], axis=-1)

    def _slacks(self, held: Array) -> Array:
        """Return what the limits leave in each row where joints are held with efforts (..., n)."""
        upper, lower = self._bounded
        limits = np.concatenate([self.limits[upper, 1], -self.limits[lower, 0]])
        return np.asarray(limits - self._both_bounds(held))

    def _require_slack(self, s: Array, held: Array, slacks: Array) -> None:
        if (slacks > 0).all():
            return
        point, row = np.unravel_index(int(slacks.argmin()), slacks.shape)
        upper, lower = map(np.flatnonzero, self._bounded)
        side = int(row < upper.size)
        joint = int(upper[row] if side else lower[row - upper.size])
        effort, limit = float(held[point, joint]), float(self.limits[joint, side])
        raise HeldOverLimitError(joint, float(s[point]), effort, limit)

    def _viscous_rows(self, s: Array, first: Array, friction: Array, slacks: Array) -> tuple[Array, Array]:
        """Return what viscous friction adds to b, and takes of c, in rows (p, k) of `friction` = v q'."""
        if not self.has_viscous:
            return np.zeros_like(friction), np.zeros_like(friction)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            rate = np.maximum(first / self.velocity[:, 1], first / self.velocity[:, 0]).max(axis=1)
            cap = np.where(rate > 0, 1.0 / rate, np.inf)
            near = cap if self.speed is None else self.speed(s)
            largest = _SHARE * 2.0 * slacks / friction  # beyond it the tangent would leave nothing at rest
        near = np.where(np.isfinite(near), near, 1.0)
        near = np.maximum(near, _SLOWEST * near.max(initial=0.0) + 1e-12)
        touch = np.where(friction > 0, np.minimum(near[:, None], largest), 1.0)
        slopes = np.where(friction > 0, friction / (2.0 * touch), friction / cap[:, None])
        return slopes, np.where(friction > 0, friction * touch / 2.0, 0.0)
