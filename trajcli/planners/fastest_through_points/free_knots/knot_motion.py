"""Motions of piecewise constant jerk whose knots are free, and how they depend on their unknowns.

Each segment has the same number of intervals M, whose durations h all joints share. What a joint has for
itself are its accelerations a at the knots, between which they are straight, and its velocities v at points:

    v_i = v_(i-1) + h_i (a_(i-1) + a_i) / 2
    p_i = p_(i-1) + h_i v_(i-1) + h_i^2 (2 a_(i-1) + a_i) / 6.

Limits of acceleration and jerk are linear in these unknowns. Between knots the velocity is a parabola, whose
middle Bezier point v_(i-1) + h_i a_(i-1) / 2 keeps its bounds.

Source: Farin (2002), chapter 5.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.frozen import frozen

ENDS = 4  # unknowns of a segment and joint that it shares with its neighbours: v and a before, v and a after
LANDINGS = 2  # what a segment must end in: the velocity and the position of the point after it


@frozen
class KnotProblem:
    """Points and limits in units of the joints' velocities and of a typical duration, and the grid of knots.

    Attributes:
        time: The unit, s.
        limits: Lower and upper bounds of velocity and acceleration, shape (2, 2, n).
        jerk: Largest magnitude, shape (n,).
        steps: Displacements, shape (K, n).
        least: Shortest duration of each segment, shape (K,).
        shortest: Shortest duration of each interval, shape (K, M).
        free: Which velocities and accelerations at the points are unknown, shape (K + 1, n, 2).
        spare: Distance from each point down and up to the position limits, shape (K + 1, n, 2); None where no
            joint has any.
    """

    time: float
    limits: Array
    jerk: Array
    steps: Array
    least: Array
    shortest: Array
    free: NDArray[np.bool_]
    spare: Array | None

    @property
    def bend(self) -> Array:
        """What a change of acceleration is measured by, shape (n,)."""
        half: Array = 0.5 * (self.limits[1, 1] - self.limits[1, 0])
        return half


@frozen
class KnotMotion:
    """A motion of piecewise constant jerk, in the units of its problem.

    Attributes:
        lengths: Durations of intervals, shape (K, M).
        ends: Velocity and acceleration at the points, shape (K + 1, n, 2).
        bends: Accelerations at the knots between, shape (K, n, M - 1).
    """

    lengths: Array
    ends: Array
    bends: Array

    @property
    def duration(self) -> float:
        """Of the whole motion."""
        return float(self.lengths.sum())

    def slowed(self, factor: float) -> KnotMotion:
        """Return the motion that takes `factor` times as long."""
        powers = np.array([1 / factor, 1 / factor**2])
        return KnotMotion(self.lengths * factor, self.ends * powers, self.bends / factor**2)


@frozen
class Change:
    """By how much unknowns change.

    Attributes:
        lengths: Shape (K, M).
        ends: Shape (K + 1, n, 2), accelerations in parts of their span.
        bends: Shape (K, n, M - 1), in parts of their span.
    """

    lengths: Array
    ends: Array
    bends: Array

    def local(self) -> Array:
        """Return the columns that each segment and joint sees: bends, ends before and after, lengths."""
        segments, joints = self.bends.shape[:2]
        shared = np.broadcast_to(self.lengths[:, None], (segments, joints, self.lengths.shape[1]))
        return np.concatenate([self.bends, self.ends[:-1], self.ends[1:], shared], axis=2)


class Walk:
    """A motion's velocities, accelerations and positions at its knots, and how far they are from limits.

    Attributes:
        accelerations: At all knots, shape (K, n, M + 1).
        means: Mean acceleration of each interval, shape (K, n, M).
        speeds: Velocity at all knots, shape (K, n, M + 1).
        positions: Position after each interval from the point before, shape (K, n, M).
        landing: By how much velocity and position at the end of each segment miss, shape (K, n, 2).
        spare: Distances from limits, shape (F, K, n, M): velocity, its middle Bezier points, acceleration,
            jerk, each below and above; then positions, where they have limits.
        spare_time: Distances of intervals, then of segments, from their shortest, shape (K, M + 1).
    """

    def __init__(self, problem: KnotProblem, motion: KnotMotion) -> None:
        h, v = motion.lengths[:, None], motion.ends[:-1, :, :1]
        a = np.concatenate([motion.ends[:-1, :, 1:], motion.bends, motion.ends[1:, :, 1:]], axis=2)
        self.accelerations, self.means = a, 0.5 * (a[..., :-1] + a[..., 1:])
        self.speeds = v = np.concatenate([v, v + np.cumsum(h * self.means, axis=2)], axis=2)
        self.positions = np.cumsum(h * (v[..., :-1] + h * (2 * a[..., :-1] + a[..., 1:]) / 6), axis=2)
        landing = [v[..., -1] - motion.ends[1:, :, 0], self.positions[..., -1] - problem.steps]
        self.landing = np.stack(landing, axis=2)
        middle = v[..., :-1] + 0.5 * h * a[..., :-1]
        low, high = problem.limits[..., None].swapaxes(0, 1)
        bend, bent = problem.bend[:, None], np.diff(a, axis=2) / problem.jerk[:, None]
        rows = [v[..., 1:] - low[0], high[0] - v[..., 1:], middle - low[0], high[0] - middle]
        rows += [(a[..., 1:] - low[1]) / bend, (high[1] - a[..., 1:]) / bend, h + bent, h - bent]
        if problem.spare is not None:
            down, up = np.moveaxis(problem.spare[:-1, ..., None], 2, 0)
            rows += [self.positions + down, up - self.positions]
        self.spare = np.stack(rows)
        each = [motion.lengths - problem.shortest, (motion.lengths.sum(axis=1) - problem.least)[:, None]]
        self.spare_time = np.concatenate(each, axis=1)
