"""The fastest motion with free knots, by a primal-dual interior-point method.

Distances from limits are slacks with multipliers; each step solves the conditions of optimality, linearised
with the second derivatives of the Lagrangian, whose curvature by durations is made positive. What a step
misses of the points, because durations and accelerations are multiplied, is put right before its gain is
judged.

Source: Nocedal and Wright (2006), chapter 19.
"""

from __future__ import annotations

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.frozen import frozen
from trajcli.planners.fastest_through_points.free_knots.knot_motion import (
    LANDINGS,
    Change,
    KnotMotion,
    KnotProblem,
    Walk,
)
from trajcli.planners.fastest_through_points.free_knots.knot_slopes import KnotSystem, Slopes

_LOOSE = 1.2  # how many times longer than it must a motion lasts at the beginning
_BEGIN, _GOAL = (
    0.03,
    1e-6,
)  # of the duration: the sum of slacks times multipliers at the beginning, and wanted
_NEXT = 0.2  # what the products of slacks and multipliers are lowered by
_SMALL, _WRONG = (
    0.1,
    20.0,
)  # of the products: what may still be gained, and the slope left, when they are lowered
_DUAL, _MISSED, _MET = (
    1e-3,
    1e-3,
    1e-4,
)  # slope of the Lagrangian, and limits and points missed, that are little
_SLACK = 1e-3  # the least slack to begin with
_PART = 0.99  # of the way to where a slack or a multiplier becomes zero
_FIRM = 1e9  # a curvature that keeps durations where they are
_CURVED, _FLAT, _TRIES = 1.0, 1e-5, 12  # curvature by durations: the first, the least, how often it is raised
_RAISED, _TURNED, _LOWERED = 10.0, 4.0, 6.0  # by what, where a step goes up, goes not far, goes well
_ENOUGH, _ROUNDING, _HALVINGS = 1e-4, 1e-10, 12  # of the gain foreseen; of the merit; of a step
_PENALTY, _STIFF = 1.5, 1.2  # of the largest multiplier: what a missed point, a missed limit counts
_CORRECTIONS = 2  # how often what misses the points is put right
_NEAR = 0.05  # of the slack: a distance from a limit above it is the slack


def fastest_knots(problem: KnotProblem, times: Array, ends: Array, rounds: int = 60) -> Array:
    """Return velocities and accelerations (K + 1, n, 2) at the points of a fast motion.

    Args:
        problem: Points, limits and knots.
        times: Of the segments to begin with, shape (K,).
        ends: Velocities and accelerations that are given, shape (K + 1, n, 2), zero where they are free.
        rounds: How many steps.
    """
    motion = _least_jerk(problem, times, ends)
    if not ends.any():
        motion = motion.slowed(_LOOSE * _excess(problem, motion))
    iterate = _Iterate(problem, motion)
    for _ in range(rounds):
        if iterate.done or not iterate.advanced():
            break
    return iterate.motion.ends


def _least_jerk(problem: KnotProblem, times: Array, ends: Array) -> KnotMotion:
    """Return the motion whose jerk is least in the square, for given durations of the segments (K,)."""
    segments, count = problem.shortest.shape
    lengths = np.repeat(times[:, None] / count, count, axis=1)
    still = KnotMotion(lengths, ends, np.zeros((*problem.steps.shape, count - 1)))
    walk = Walk(problem, still)
    slopes = Slopes(problem, still, walk)
    weights, pull = np.zeros((2, *walk.spare.shape))
    weights[6:8] = 1 / lengths[:, None]
    pull[6] = -np.diff(walk.accelerations, axis=2) / problem.jerk[:, None] / lengths[:, None]
    pull[7] = -pull[6]
    firm = np.full((segments, count + 1), _FIRM)
    landing = slopes.rows[:, :, -LANDINGS:]
    system = KnotSystem(problem, slopes.stiffness(weights), landing, firm)
    system.factor(_FLAT)
    columns = slopes.adjoint(pull, np.zeros_like(walk.landing))
    change, _ = system.solve(-walk.landing, columns, np.zeros_like(lengths))
    return _moved(problem, still, change, 1.0)


def _moved(problem: KnotProblem, motion: KnotMotion, change: Change, part: float) -> KnotMotion:
    bend = problem.bend[:, None]
    ends = motion.ends + part * change.ends * np.concatenate([np.ones_like(bend), bend], axis=1)
    return KnotMotion(motion.lengths + part * change.lengths, ends, motion.bends + part * bend * change.bends)


def _excess(problem: KnotProblem, motion: KnotMotion) -> float:
    """Return how many times longer the motion must last to keep its limits; positions are not looked at."""
    walk, lengths = Walk(problem, motion), motion.lengths[:, None]
    middle = walk.speeds[..., :-1] + 0.5 * lengths * walk.accelerations[..., :-1]
    jerk = np.abs(np.diff(walk.accelerations, axis=2)) / problem.jerk[:, None] / lengths
    factors = [float(jerk.max()) ** (1 / 3), float((problem.least / motion.lengths.sum(axis=1)).max())]
    for order, values in enumerate((np.concatenate([walk.speeds, middle], axis=2), walk.accelerations)):
        low, high = problem.limits[order][..., None]
        factors.append(float(np.maximum(values / high, values / low).max()) ** (1 / (order + 1)))
    return float(max(factors))


@frozen
class _Slacks:
    """Slacks, or multipliers, or what they change by.

    Attributes:
        spare: Of `Walk.spare`.
        time: Of `Walk.spare_time`.
    """

    spare: Array
    time: Array

    def along(self, change: _Slacks, part: float) -> _Slacks:
        return _Slacks(self.spare + part * change.spare, self.time + part * change.time)

    def share(self, changes: _Slacks) -> float:
        """Return how far, at most 1, these positive numbers may go along their changes."""
        worst = max(float((-changes.spare / self.spare).max()), float((-changes.time / self.time).max()))
        return 1.0 if worst <= _PART else _PART / worst


class _Iterate:
    """Motion, slacks and multipliers of the method.

    Attributes:
        motion: What was reached.
        done: Whether nothing more is to be gained.
    """

    def __init__(self, problem: KnotProblem, motion: KnotMotion) -> None:
        self._problem, self.motion, self.done = problem, motion, False
        walk = self._walk = Walk(problem, motion)
        self._slack = _Slacks(np.maximum(walk.spare, _SLACK), np.maximum(walk.spare_time, _SLACK))
        self._count = walk.spare.size + walk.spare_time.size
        self._product = _BEGIN * motion.duration / self._count
        self._force = _Slacks(self._product / self._slack.spare, self._product / self._slack.time)
        self._pull = np.zeros_like(walk.landing)
        self._curved, self._penalty, self._foreseen = _CURVED, 1.0, np.inf

    def advanced(self) -> bool:
        """Take a step; return whether there was one."""
        walk, slack, force = self._walk, self._slack, self._force
        slopes = Slopes(self._problem, self.motion, walk)
        dual = slopes.adjoint(-force.spare, self._pull)
        dual_lengths = 1.0 - force.time[:, :-1] - force.time[:, -1:]
        miss = _Slacks(walk.spare - slack.spare, walk.spare_time - slack.time)
        self._lower_product(dual, dual_lengths, miss)
        system = self._system(slopes)
        if system is None:
            return False
        push, push_time = (
            (self._product - f * m) / s - f
            for f, m, s in ((force.spare, miss.spare, slack.spare), (force.time, miss.time, slack.time))
        )
        columns = slopes.adjoint(push, np.zeros_like(walk.landing)) - dual
        lengths = push_time[:, :-1] + push_time[:, -1:] - dual_lengths
        change, d_pull = system.solve(-walk.landing, columns, lengths)
        together = change.lengths.sum(axis=1)[:, None]
        d_time = np.concatenate([change.lengths, together], axis=1) + miss.time
        d_slack = _Slacks(slopes.apply(change) + miss.spare, d_time)
        if not np.isfinite(d_slack.spare).all():
            return False
        self._penalty = max(self._penalty, _PENALTY * float(np.abs(self._pull + d_pull).max()))
        part = self._search(change, d_slack, system.inverse[..., LANDINGS:, :LANDINGS])
        self._pull = self._pull + part * d_pull
        d_force = _Slacks(
            (self._product - force.spare * d_slack.spare) / slack.spare - force.spare,
            (self._product - force.time * d_slack.time) / slack.time - force.time,
        )
        self._force = force.along(d_force, force.share(d_force))
        return True

    def _system(self, slopes: Slopes) -> KnotSystem | None:
        """Return the system of a step that goes down; None where curvature is of no help."""
        slack, force = self._slack, self._force
        matrix = slopes.stiffness(force.spare / slack.spare) + slopes.bending(-force.spare, self._pull)
        landing = slopes.rows[:, :, -LANDINGS:]
        try:
            system = KnotSystem(self._problem, matrix, landing, force.time / slack.time)
        except np.linalg.LinAlgError:  # by rounding, as where a segment is far shorter than the others
            return None
        for _ in range(_TRIES):
            if system.factor(self._curved):
                return system
            self._curved *= _RAISED
        return None

    def _search(self, change: Change, d_slack: _Slacks, inverse: Array) -> float:
        """Go along a change as far as the merit falls; return which part of it that is."""
        slack, walk, product = self._slack, self._walk, self._product
        stiff = max(1.0, _STIFF * float(np.abs(self._force.spare).max()))
        before, missed = self._merit(self.motion, walk, slack, stiff)
        each = (d_slack.spare / slack.spare).sum() + (d_slack.time / slack.time).sum()
        slope = float(change.lengths.sum()) - product * float(each) - missed
        self._foreseen = -slope
        part, halvings = slack.share(d_slack), 0
        while True:
            motion = _moved(self._problem, self.motion, change, part)
            after = Walk(self._problem, motion)
            for _ in range(_CORRECTIONS):
                back = self._problem.bend[:, None] * (inverse @ after.landing[..., None])[..., 0]
                motion = KnotMotion(motion.lengths, motion.ends, motion.bends - back)
                after = Walk(self._problem, motion)
            new = slack.along(d_slack, part)
            kept = np.where(after.spare > _NEAR * slack.spare, after.spare, new.spare)
            merit, _ = self._merit(motion, after, _Slacks(kept, new.time), stiff)
            wanted = before + _ENOUGH * part * min(slope, 0.0) + _ROUNDING * abs(before)
            if merit <= wanted or halvings == _HALVINGS:
                break
            part, halvings = 0.5 * part, halvings + 1
        self._curved = self._curved * _TURNED if halvings > 1 else max(self._curved / _LOWERED, _FLAT)
        self.motion, self._walk, self._slack = motion, after, _Slacks(np.maximum(after.spare, kept), new.time)
        return part

    def _merit(self, motion: KnotMotion, walk: Walk, slack: _Slacks, stiff: float) -> tuple[float, float]:
        """Return what a step shall lower, and the part of it that limits and points missed have."""
        missed = np.abs(walk.spare - slack.spare).sum() + np.abs(walk.spare_time - slack.time).sum()
        counted = stiff * float(missed) + self._penalty * float(np.abs(walk.landing).sum())
        barrier = float(np.log(slack.spare).sum() + np.log(slack.time).sum())
        return motion.duration - self._product * barrier + counted, counted

    def _lower_product(self, dual: Array, dual_lengths: Array, miss: _Slacks) -> None:
        """Lower the products of slacks and multipliers where little can be gained with them as they are."""
        slack, force, duration = self._slack, self._force, self.motion.duration
        gap = float((slack.spare * force.spare).sum() + (slack.time * force.time).sum())
        missed = max(float(np.abs(miss.spare).max()), float(np.abs(self._walk.landing).max()))
        total = self._product * self._count
        self.done = gap < 3 * _GOAL * duration and missed < _MET
        near = self._foreseen < _SMALL * total
        near = near or self._slope(dual, dual_lengths) < max(_WRONG * total / duration, _DUAL)
        if near and missed < _MISSED:
            self._product = max(_GOAL * duration / self._count, _NEXT * self._product)

    def _slope(self, dual: Array, dual_lengths: Array) -> float:
        count = dual_lengths.shape[1]
        own, ends = dual[..., : count - 1], np.zeros(self._problem.free.shape)
        ends[:-1] += dual[..., count - 1 : count + 1]
        ends[1:] += dual[..., count + 1 : count + 3]
        lengths = dual_lengths + dual[..., count + 3 :].sum(axis=1)
        kinds = (own, ends * self._problem.free, lengths)
        return max(float(np.abs(kind).max()) for kind in kinds)
