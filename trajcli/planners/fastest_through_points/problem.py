"""Waypoint problems: points to pass, limits, and what is fixed at the points, in units that suit them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.frozen import frozen

_INSIDE = 0.999999  # of the limits: states on the edge have no motion at all for ruckig


@frozen
class WaypointProblem:
    """Points through which joints go as fast as they can.

    Attributes:
        points: Shape (K + 1, n), start and target among them; no two that follow each other are equal.
        velocity: Lower and upper bounds, shape (n, 2), finite.
        acceleration: The same.
        jerk: Largest magnitude, shape (n,), finite.
        states: Velocity and acceleration at the points, shape (K + 1, n, 2); zero where free.
        fixed: Which of them are given, shape (K + 1, n, 2); all at the start and at the target.
        least: Shortest duration of each segment, shape (K,).
        position: Lower and upper bounds, shape (n, 2), perhaps infinite.
        looser: How many times larger the jerk may be in one direction, shape (n,): what bounds count with.
    """

    points: Array
    velocity: Array
    acceleration: Array
    jerk: Array
    states: Array
    fixed: NDArray[np.bool_]
    least: Array
    position: Array
    looser: Array | float = 1.0

    @property
    def segments(self) -> int:
        """How many there are."""
        return len(self.points) - 1

    @property
    def joints(self) -> int:
        """How many there are."""
        return int(self.points.shape[1])

    @property
    def steps(self) -> Array:
        """Displacement along each segment, shape (K, n)."""
        return np.diff(self.points, axis=0)

    @property
    def times_at_speed(self) -> Array:
        """What each segment needs at the velocity limits, and at least is to last, s, shape (K,)."""
        steps = self.steps
        times = np.where(steps > 0, steps / self.velocity[:, 1], steps / self.velocity[:, 0]).max(axis=1)
        return np.asarray(np.maximum(times, self.least))

    @property
    def scales(self) -> Array:
        """Half the ranges of velocity and acceleration, shape (n, 2)."""
        return 0.5 * np.stack([np.ptp(self.velocity, axis=1), np.ptp(self.acceleration, axis=1)], axis=1)

    @property
    def walled(self) -> bool:
        """Whether any position has a limit."""
        return bool(np.isfinite(self.position).any())

    def inside(self, states: Array) -> Array:
        """Return states (K + 1, n, 2) moved inside the limits, and to the values that are given.

        An acceleration a that is built up from zero, or taken back to zero, changes the velocity by
        a |a| / (2 jerk); before or after it the velocity must keep its bounds, too.
        """
        low, high = (_INSIDE * bound for bound in self.velocity.T)
        slowing, speeding = (_INSIDE * bound for bound in self.acceleration.T)
        given = np.where(self.fixed, self.states, states)
        bent = np.clip(given[..., 1], slowing, speeding)
        to_and_fro = np.sqrt(self.jerk * (high - low))
        velocity = np.where(self.fixed[..., 0], self.states[..., 0], given[..., 0])
        ahead = np.maximum(np.minimum(high - velocity, velocity - low), 0.0)
        kept = np.sqrt(2 * self.jerk * ahead)
        bent = np.where(
            self.fixed[..., 0], np.clip(bent, -kept, kept), np.clip(bent, -to_and_fro, to_and_fro)
        )
        bent = np.where(self.fixed[..., 1], self.states[..., 1], bent)
        used = bent**2 / (2 * self.jerk)
        velocity = np.where(self.fixed[..., 0], velocity, np.clip(velocity, low + used, high - used))
        return np.stack([velocity, bent], axis=2)

    def stopping(self) -> Array:
        """Return the states of a motion that stops at every inner point, as far as it is free to."""
        return self.inside(np.zeros_like(self.states))

    @property
    def units(self) -> tuple[float, Array]:
        """Units of time, s, and of each joint's position, (n,), in which numbers are near one: powers of two.

        Ruckig's tolerances are absolute. Such units change nothing else.
        """
        steps = np.abs(self.steps)
        speeds, changes = self.reachable().scales.T
        typical = float((steps / speeds).max(axis=1).mean()) + float((changes / self.jerk).min())
        time = 2.0 ** round(math.log2(typical))
        return time, np.exp2(np.round(np.log2(speeds * time))).astype(np.float64)

    def reachable(self) -> WaypointProblem:
        """Return the problem without what of its limits no motion reaches in the time that stops would take.

        Limits that stand for none would make units and scales of another size than the motion.
        """
        speeds, changes = np.abs(np.where(self.fixed, self.states, 0.0)).max(axis=0).T
        (velocity, acceleration), steps = self.scales.T, np.abs(self.steps)
        times = steps / velocity + 2 * np.sqrt(steps / acceleration) + np.cbrt(32 * steps / self.jerk)
        braking = changes / self.jerk + speeds / acceleration + 2 * np.sqrt(speeds / self.jerk)
        longest = 2 * float(np.maximum(times.max(axis=1), self.least).sum() + braking.max())
        changes = changes + self.jerk * longest
        speeds = (speeds + np.minimum(changes, acceleration) * longest)[:, None]
        changes = changes[:, None]
        return replace(
            self,
            velocity=np.clip(self.velocity, -speeds, speeds),
            acceleration=np.clip(self.acceleration, -changes, changes),
        )

    def scaled(self) -> WaypointProblem:
        """Return the problem in its units, each joint from zero."""
        time, lengths = self.units
        rates = [(lengths / time**order)[:, None] for order in range(3)]
        first = self.points[0]
        return replace(
            self,
            points=(self.points - first) / lengths,
            velocity=self.velocity / rates[1],
            acceleration=self.acceleration / rates[2],
            jerk=self.jerk * time**3 / lengths,
            states=self.states / np.concatenate(rates[1:], axis=1),
            least=self.least / time,
            position=(self.position - first[:, None]) / rates[0],
        )

    def only(self, kept: Sequence[int]) -> WaypointProblem:
        """Return the problem of some of the points alone; least durations of segments are added up."""
        rows = list(kept)
        if len(rows) == len(self.points):
            return self
        least = np.add.reduceat(self.least, rows[:-1])
        return replace(
            self, points=self.points[rows], states=self.states[rows], fixed=self.fixed[rows], least=least
        )
