"""Motions of piecewise constant jerk whose knots are free, which find the shape of a fast motion.

Each segment has the same number of intervals, whose durations all joints share and whose jerks they do not.
Between knots the velocity is a parabola; its Bezier points keep its bounds. With durations fixed all of this
is linear; the durations and the jerks are improved together by a sequence of linear programmes.

Source: Nocedal and Wright, Numerical Optimization, 2nd edition (2006), chapter 18; Farin, Curves and Surfaces
for CAGD (2002), chapter 5.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.frozen import frozen
from trajcli.planners.fastest_through_points.linear_programme import (
    SegmentProgramme,
    solved,
    weighted_least_squares,
)
from trajcli.planners.fastest_through_points.problem import WaypointProblem

_ORDERS = 3
_FIRST, _LARGEST = 0.3, 0.6  # trust region, of the durations of intervals
_SMALLEST = 1e-3
_ENOUGH, _PATIENCE = 3e-5, 6  # relative: what must be gained in so many rounds for more of them
_PENALTY = 10.0  # a position beyond its limits counts as so many times more duration
_FAR = 100.0  # for a position limit that does not bind, in units of the joints
_LOST = 10.0  # times the best: a motion so far from its limits is not followed
_GROWN, _SHRUNK = 1.4, 0.6
_FIXED = 1e9  # weight that keeps a shared unknown at zero


@frozen
class _Units:
    """The problem in units of the joints' velocities and of a typical duration.

    Attributes:
        time: s.
        limits: Lower and upper bounds of velocity, acceleration and jerk, shape (3, 2, n).
        steps: Displacements, shape (K, n).
        ends: Velocity and acceleration at the points, shape (K + 1, n, 2), zero where free.
        room: Distance from each point down and up to the position limits, shape (K + 1, n, 2).
    """

    time: float
    limits: Array
    steps: Array
    ends: Array
    room: Array

    @property
    def spans(self) -> Array:
        """What a change of velocity, acceleration and jerk is measured by, shape (3, n)."""
        return 0.5 * (self.limits[:, 1] - self.limits[:, 0])


@frozen
class FreeKnots:
    """A motion of piecewise constant jerk, in the units of its problem.

    Attributes:
        lengths: Durations of intervals, shape (K, M).
        ends: Velocity and acceleration at the points, shape (K + 1, n, 2).
        jerks: Shape (K, n, M).
    """

    lengths: Array
    ends: Array
    jerks: Array

    @property
    def duration(self) -> float:
        """Of the whole motion."""
        return float(self.lengths.sum())

    def walked(self) -> Array:
        """Return position from the point before, velocity and acceleration at knots: (M + 1, 3, K, n)."""
        velocity, acceleration = self.ends[:-1, :, 0], self.ends[:-1, :, 1]
        position = np.zeros_like(velocity)
        rows = [np.stack([position, velocity, acceleration])]
        for k in range(self.lengths.shape[1]):
            h, u = self.lengths[:, k, None], self.jerks[..., k]
            position = position + h * (velocity + h * (acceleration / 2 + h * u / 6))
            velocity = velocity + h * (acceleration + h * u / 2)
            acceleration = acceleration + h * u
            rows.append(np.stack([position, velocity, acceleration]))
        return np.array(rows)

    def slowed(self, factor: float) -> FreeKnots:
        """Return the motion that takes `factor` times as long."""
        powers = np.array([1 / factor, 1 / factor**2])
        return FreeKnots(self.lengths * factor, self.ends * powers, self.jerks / factor**3)


def states_by_free_knots(
    problem: WaypointProblem, times: Array, intervals: int = 8, rounds: int = 30
) -> Array:
    """Return states (K + 1, n, 2) at the points of a fast motion.

    Args:
        problem: Points and limits.
        times: Of the segments to begin with, shape (K,).
        intervals: In each segment, at least four.
        rounds: How many linear programmes.
    """
    units = _units(problem, float(times.mean()))
    motion = _least_jerk(problem, units, times / units.time, intervals)
    best = motion = motion.slowed(_excess(problem, units, motion)) if _may_slow(problem) else motion
    least = best.duration * _excess(problem, units, best)
    region, astray, history = _FIRST, False, [least]
    for _ in range(rounds):
        if len(history) > _PATIENCE and least > (1 - _ENOUGH) * history[-_PATIENCE]:
            break
        motion = _step(problem, units, motion, region)
        value = motion.duration * _excess(problem, units, motion)
        history.append(least)
        if 0 < value < least:
            best, least, astray = motion, value, False
            region = min(_GROWN * region, _LARGEST)
            continue
        region *= _SHRUNK
        astray = not astray and value < _LOST * least
        if not astray:
            motion = best
        if region < _SMALLEST:
            break
    if _may_slow(problem):
        best = best.slowed(_excess(problem, units, best))
    speeds = problem.scales[:, 0]
    scales = np.stack([speeds, speeds / units.time], axis=1)
    return np.where(problem.fixed, problem.states, best.ends * scales)


def _units(problem: WaypointProblem, time: float) -> _Units:
    speeds = problem.scales[:, 0]
    rates = [speeds / time**k for k in range(_ORDERS)]
    jerk = np.stack([-problem.jerk, problem.jerk], axis=1)
    bounds = (problem.velocity, problem.acceleration, jerk)
    limits = np.stack([bound.T / rate for bound, rate in zip(bounds, rates, strict=True)])
    ends = problem.states / np.stack(rates[:2], axis=1)
    room = np.abs(problem.position - problem.points[..., None]) / (speeds * time)[:, None]
    return _Units(time, limits, problem.steps / (speeds * time), ends, np.minimum(room, _FAR))


def _may_slow(problem: WaypointProblem) -> bool:
    """Return whether a motion may be slowed down: where no velocity or acceleration is given but zero."""
    return not problem.states.any()


def _excess(problem: WaypointProblem, units: _Units, motion: FreeKnots) -> float:
    """Return how many times longer the motion must last, at least 1, to keep its limits."""
    walk = motion.walked()
    before, after = walk[:-1], walk[1:]
    lengths = motion.lengths.T[..., None]
    middle = before[:, 1] + 0.5 * lengths * before[:, 2]
    kinds = (np.concatenate([after[:, 1], middle]), after[:, 2], np.moveaxis(motion.jerks, 2, 0))
    factor = 1.0
    for order, values in enumerate(kinds):
        low, high = units.limits[order]
        share = float(np.maximum(values / high, values / low).max())
        factor = max(factor, share ** (1 / (order + 1)))
    if problem.walled:
        positions, (down, up) = after[:, 0], np.moveaxis(units.room[:-1], 2, 0)
        factor += _PENALTY * max(0.0, float((positions - up).max()), float((-down - positions).max()))
    return max(factor, float((problem.least / (motion.lengths.sum(axis=1) * units.time)).max()))


def _least_jerk(problem: WaypointProblem, units: _Units, times: Array, intervals: int) -> FreeKnots:
    """Return the motion whose jerk is least in the square, for given durations of the segments."""
    lengths = np.repeat(times[:, None] / intervals, intervals, axis=1)
    segments, joints = units.steps.shape
    still = FreeKnots(lengths, units.ends.copy(), np.zeros((segments, joints, intervals)))
    motion = _landed(units, still)
    chain = _Sensitivity(problem, units, motion)
    jerk_rows = chain.rows[:, :, 3 * intervals : 4 * intervals]
    weights = np.sqrt(lengths)[:, None, :, None]
    target = -(motion.jerks / units.spans[2][:, None])
    unused = np.zeros((segments, intervals))
    programme = SegmentProgramme(jerk_rows * weights, target, target, unused, unused, unused, 1e-12)
    y = weighted_least_squares(programme, target * weights[..., 0], _FIXED)
    return chain.moved(y, programme)


def _landed(units: _Units, motion: FreeKnots) -> FreeKnots:
    """Return the motion whose jerks are changed to end each segment in its point, in the state given there.

    Jerks near their limits are changed least.
    """
    end = motion.walked()[-1]
    wanted = np.stack([units.steps, motion.ends[1:, :, 0], motion.ends[1:, :, 1]])
    miss = np.moveaxis(wanted - end, 0, 2)[..., None]
    left = np.cumsum(motion.lengths[:, ::-1], axis=1)[:, ::-1]
    after = left - motion.lengths
    effect = np.stack([(left**k - after**k) / f for k, f in ((3, 6), (2, 2), (1, 1))], axis=1)[:, None]
    share = np.abs(motion.jerks) / units.spans[2][:, None]
    weight = np.clip(1.02 - share, 0.02, 1.0)[..., None, :] ** 2
    gain = (effect * weight) @ np.swapaxes(effect, 2, 3)
    change = (effect * weight).swapaxes(2, 3) @ np.linalg.solve(gain, miss)
    return replace(motion, jerks=motion.jerks + change[..., 0])


def _step(problem: WaypointProblem, units: _Units, motion: FreeKnots, region: float) -> FreeKnots:
    """Return the motion after one linear programme."""
    chain = _Sensitivity(problem, units, motion)
    low, high = chain.room()
    lengths = motion.lengths
    least = np.full(lengths.shape, -region)
    short = np.maximum(problem.least / units.time, 0.0)
    spare = np.clip(1 - short / lengths.sum(axis=1), 0.0, region)
    least = np.where(problem.least[:, None] > 0, -spare[:, None], least)
    programme = SegmentProgramme(chain.rows, low, high, lengths, least, np.full(lengths.shape, region))
    y = solved(programme, region, exactness=1e-3)
    return _landed(units, chain.moved(y, programme))


class _Sensitivity:
    """How velocities, accelerations and jerks at knots follow from changes of the unknowns.

    The jerks of a segment that end it where it must end are a particular choice and combinations w of those
    that change nothing at its ends. Durations change by a part s of themselves.
    """

    def __init__(self, problem: WaypointProblem, units: _Units, motion: FreeKnots) -> None:
        self._units, self._motion = units, motion
        self._free, self._walled = ~problem.fixed, problem.walled
        self._values, raw, end = self._raw_rows()
        count = motion.lengths.shape[1]
        jerks = slice(2, 2 + count)
        q, r = np.linalg.qr(np.swapaxes(end[..., jerks], 2, 3), mode="complete")
        inner, null = q[..., :_ORDERS], q[..., _ORDERS:]
        back = inner @ np.linalg.inv(np.swapaxes(r[..., :_ORDERS, :], 2, 3))
        arrive = np.zeros((*end.shape[:2], _ORDERS, 2))
        arrive[..., 1, 0], arrive[..., 2, 1] = units.spans[0], units.spans[1]
        arrive *= self._free[1:, :, None, :]
        columns = [null, -back @ end[..., :2], back @ arrive, -back @ end[..., 2 + count :]]
        self._jerks = np.concatenate(columns, axis=3)
        own = count - _ORDERS
        self.rows = raw[..., jerks] @ self._jerks
        self.rows[..., own : own + 2] += raw[..., :2]
        self.rows[..., own + 4 :] += raw[..., 2 + count :]

    def _raw_rows(self) -> tuple[Array, Array, Array]:
        """Return values (K, n, R), their derivatives by (x before, jerks, s), and those of the end."""
        units, motion = self._units, self._motion
        walk, count = motion.walked(), motion.lengths.shape[1]
        segments, joints = units.steps.shape
        state = np.zeros((_ORDERS, segments, joints, 2 + 2 * count))
        state[1, ..., 0] = units.spans[0] * self._free[:-1, :, 0]
        state[2, ..., 1] = units.spans[1] * self._free[:-1, :, 1]
        values, rows, positions = [], [], []
        for k in range(count):
            h, u = motion.lengths[:, k, None], motion.jerks[..., k]
            wide = h[..., None]
            before, after = walk[k], walk[k + 1]
            middle = state[1] + 0.5 * wide * state[2]
            middle[..., 2 + count + k] += 0.5 * h * before[2]
            values.append(before[1] + 0.5 * h * before[2])
            rows.append(middle / units.spans[0][:, None])
            state[0] += wide * (state[1] + wide * state[2] / 2)
            state[1] += wide * state[2]
            for order, part in enumerate((h**3 / 6, h**2 / 2, h)):
                state[order, ..., 2 + k] += part * units.spans[2]
            for order, rate in enumerate((after[1], after[2], u)):
                state[order, ..., 2 + count + k] += h * rate
            positions.append(state[0].copy())
            for order in (1, 2):
                values.append(after[order])
                rows.append(state[order] / units.spans[order - 1][:, None])
        jerk = np.zeros((segments, joints, count, 2 + 2 * count))
        jerk[:, :, range(count), range(2, 2 + count)] = 1.0
        all_rows = np.concatenate([np.stack(rows, axis=2), jerk], axis=2)
        all_values = np.concatenate([np.stack(values, axis=2), motion.jerks], axis=2)
        if self._walled:
            all_rows = np.concatenate([all_rows, np.stack(positions, axis=2)], axis=2)
            all_values = np.concatenate([all_values, np.moveaxis(walk[1:, 0], 0, 2)], axis=2)
        return all_values, all_rows, np.moveaxis(state, 0, 2)

    def room(self) -> tuple[Array, Array]:
        """Return by how much each row may change, in units of its span."""
        count = self._motion.lengths.shape[1]
        order = np.array([0, 0, 1] * count + [2] * count)
        bounds = self._units.limits[order]  # (R, 2, n)
        spans = self._units.spans[order]
        rates = self._values[:, :, : order.size]
        low, high = ((bounds[:, k] / spans).T - rates / spans.T for k in range(2))
        if self._walled:
            room, positions = self._units.room[:-1], self._values[:, :, order.size :]
            low = np.concatenate([low, -room[..., :1] - positions], axis=2)
            high = np.concatenate([high, room[..., 1:] - positions], axis=2)
        return low, high

    def moved(self, y: Array, programme: SegmentProgramme) -> FreeKnots:
        """Return the motion after a change of the unknowns."""
        w, x, s = programme.split(y)
        segments, joints = x.shape[0] - 1, x.shape[1]
        shared = np.broadcast_to(s[:, None], (segments, joints, s.shape[1]))
        local = np.concatenate([w, x[:-1], x[1:], shared], axis=2)
        jerks = (self._jerks @ local[..., None])[..., 0] * self._units.spans[2][:, None]
        motion = self._motion
        ends = motion.ends + x * self._units.spans[:2].T * self._free
        s = np.clip(s, programme.least, programme.upper_bound)
        return FreeKnots(motion.lengths * (1 + s), ends, motion.jerks + jerks)
