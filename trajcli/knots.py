"""Knots of a trajectory: states from which quintic interpolation reproduces it.

A controller that interpolates position, velocity and acceleration runs the quintic Hermite polynomial
between neighbouring knots, one without accelerations the cubic. A knot stands at each break of the curve,
rounded to whole nanoseconds, with the state that the curve has at the rounded time. Where the curve is no
such polynomial, knots are inserted, and where a long interval carries far what the rounding changes. Where
the acceleration steps by a, quintics have one knot a little before and one as much behind, at the distance
d: between them the acceleration rises evenly, which takes the position further by a d^2 / 6, and the knot
behind holds that. A quintic between states of the curve itself would pass the accelerations on both sides
by a twentieth of the step.

Source: Biagiotti and Melchiorri, Trajectory Planning for Automatic Machines and Robots (2008), section 2.1.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from math import comb

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.hermite import hermite_coefficients, matrix_times_rows
from trajcli.curves.piecewise import (
    Array,
    PiecewisePolynomial,
    control_points,
    derivative_coefficients,
    distinct,
    read_only,
    taylor_shift,
)
from trajcli.errors import InputError
from trajcli.frozen import comparable, frozen
from trajcli.grids import KnotGrid, UniformGrid, leave_short_pieces
from trajcli.trajectory import Trajectory

Nanoseconds = NDArray[np.int64]

LARGEST_DEVIATION = 1e-6  # rad or m: what quintics between knots may miss, where knots can be inserted
_OFF_BREAKS = 5e-10  # rad or m: likewise, where only knots beside their breaks make a difference
_NEAREST = 1000  # ns: no closer knots are inserted, nor rows beside them
_ONE = 10_000  # ns: breaks closer than this have one knot, as rounding is a jerk of 60 e / h^3 between two
_PER_SECOND = 1e9
_LONGEST = 2.0**53 / _PER_SECOND  # s: in longer motions float64 tells no nanoseconds apart
_ROUNDING = 1e-12  # s: a time this close to a break is the break
_CONTINUOUS = 1e-9  # of the largest acceleration of its joint: a step below that is rounding
_RAMP = 1e-5  # of the largest velocity: what changes by more between two knots is a ramp too short for them
_STEP_DEVIATION = 2e-8  # rad or m: what knots around a step of the acceleration may miss
_SHORTEST_STEP = 10_000  # ns: over a shorter interval, rounding would show in the acceleration
_LONGEST_STEP = 200_000  # ns: what a small step needs
_FEWER = 0.1  # of the deviation, between cubics: tools on paths promise a millionth themselves
_MOST_PARTS = 64  # of an interval that is divided at once
_SAME = 1e-12  # of what is missed: by so much it may be larger than stated
_BLOCK = 4096  # intervals looked at together: what is computed of them takes some MB
_QUINTIC = 3  # derivatives that quintics share with a curve at their ends, of twice the order in their error


@comparable
class Deviation:
    """The largest deviation of the quintics between knots from the curve, over all joints and for all t.

    Attributes:
        position: rad or m.
        velocity: Per second.
        joints: Indices of the joints whose position and velocity deviate by that.
    """

    position: float
    velocity: float
    joints: tuple[int, int]


@frozen
class Knots:
    """States at whole nanoseconds.

    Attributes:
        nanoseconds: Shape (m,), from 0 on, strictly increasing; the last one is the end, rounded up.
        position: Shape (m, n), rad or m.
        velocity: Shape (m, n), per second; in the end exactly zero where the trajectory ends at rest.
        acceleration: Shape (m, n), per second squared; where it steps, that after the step.
            Of rows that state none shape (m, 0); velocities likewise.
        deviation: Of quintics between the knots.
    """

    nanoseconds: Nanoseconds
    position: Array
    velocity: Array
    acceleration: Array
    deviation: Deviation

    def __post_init__(self) -> None:
        for name in ("position", "velocity", "acceleration"):
            object.__setattr__(self, name, read_only(getattr(self, name)))
        self.nanoseconds.flags.writeable = False

    @property
    def times(self) -> Array:
        """Seconds from the start of the trajectory, shape (m,)."""
        return self.nanoseconds / _PER_SECOND


def has_knots(trajectory: Trajectory) -> bool:
    """Return whether a trajectory is so short that float64 tells all its nanoseconds apart."""
    return trajectory.duration <= _LONGEST


def knots_of(trajectory: Trajectory, stated: int = _QUINTIC) -> Knots:
    """Return the knots of a trajectory, so many that polynomials between them are within `LARGEST_DEVIATION`.

    The deviation is that of polynomials, at the roots of the derivative of their difference. Knots are at
    least a microsecond apart: breaks nearer than ten are one knot, and the deviation says what that costs.

    Args:
        trajectory: One without jumps of position and velocity.
        stated: How many of position, velocity and acceleration stand in the rows, 2 or 3: between them are
            cubics or quintics.

    Raises:
        InputError: When it is so long that float64 tells no nanoseconds apart.
    """
    curve = trajectory.curve
    if not has_knots(trajectory):
        raise InputError(
            f"the trajectory lasts {trajectory.duration:.6g} s, and knots stand at whole nanoseconds",
            hint=f"up to {_LONGEST:.6g} s they can be told apart; rows at a rate have no such bound",
        )
    whole, further, allowed = _first_knots(curve, stated)
    while True:
        states = _states(trajectory, whole)
        for time, shift in further.items():
            states[0, np.searchsorted(whole, time)] += shift
        largest, of_intervals = _missed(curve, whole, states[:stated], allowed)
        inserted = _insertions(whole, of_intervals, stated, allowed)
        if not inserted.size:
            return Knots(whole, states[0], states[1], states[2], _deviation(largest))
        whole = np.sort(np.concatenate([whole, inserted]))


def stated_by(columns: Sequence[str]) -> int:
    """Return how many of position, velocity and acceleration rows of such columns state, 2 or 3.

    Rows of neither velocity nor acceleration have the knots of those with both.
    """
    return _QUINTIC - 1 if "qd" in columns and "qdd" not in columns else _QUINTIC


def knots_at(trajectory: Trajectory, times: Array) -> Knots:
    """Return the states of a trajectory at some times as knots, each in its nearest nanosecond.

    Args:
        trajectory: One without jumps of position and velocity.
        times: From its start, s, shape (m,), rising by more than a nanosecond; the last is its end.
    """
    whole = np.rint(times * _PER_SECOND).astype(np.int64)
    last = whole[-1] / _PER_SECOND
    whole[-1] += last < trajectory.duration - max(_ROUNDING, 4 * float(np.spacing(trajectory.duration)))
    states = _states(trajectory, whole)
    return Knots(
        whole, states[0], states[1], states[2], _deviation(_missed(trajectory.curve, whole, states)[0])
    )


def knot_grid(
    trajectory: Trajectory, knots: Knots, rate: float | None = None, start_time: float = 0.0
) -> KnotGrid:
    """Return the grid of rows at the knots of a trajectory, with a rate also at its times between them.

    A time of the rate that is nearer to a knot than a microsecond has no row of its own. Beside a step of the
    acceleration rows are on the quintics between the knots: the curve has no such knot behind it.

    Args:
        trajectory: Whose knots they are.
        knots: From `knots_of`.
        rate: Hz; None for the knots alone.
        start_time: Time of the first row, s.

    Raises:
        InputError: When the rate is too high for the times of the rows.
    """
    states = np.stack([knots.position, knots.velocity, knots.acceleration])
    times, duration = knots.times, trajectory.duration
    if rate is None:
        return KnotGrid(duration, times, np.arange(times.size), states, start_time)
    uniform = np.concatenate([local for _, local in UniformGrid(duration, rate, start_time).blocks()])
    after = np.clip(np.searchsorted(times, uniform), 1, max(times.size - 1, 1))
    nearest = np.minimum(
        np.abs(uniform - times[after - 1]), np.abs(times[np.minimum(after, times.size - 1)] - uniform)
    )
    far = nearest > _NEAREST / _PER_SECOND
    uniform, after = uniform[far], after[far]
    moved = (_states(trajectory, knots.nanoseconds)[0] != knots.position).any(axis=1)
    beside = moved[after] | moved[after - 1]
    joined = _between(knots, uniform[beside], after[beside])
    states = np.concatenate([states, joined], axis=1)
    local = np.concatenate([times, uniform[beside], uniform[~beside]])
    order = np.argsort(local, kind="stable")
    at = np.flatnonzero(order < states.shape[1])
    return KnotGrid(duration, local[order], at, states[:, order[at]], start_time)


def _between(knots: Knots, local: Array, after: NDArray[np.intp]) -> Array:
    """Return the states of quintics between knots, (3, k, n), at times before the knots `after`, (k,)."""
    states = np.stack([knots.position, knots.velocity, knots.acceleration]).transpose(0, 2, 1)
    first, last = knots.times[after - 1], knots.times[after]
    joined = hermite_coefficients(states[..., after - 1], states[..., after], last - first)
    shifted = taylor_shift(joined, local - first)
    return np.stack([shifted[-1], shifted[-2], 2 * shifted[-3]]).transpose(0, 2, 1)


def _deviation(missed: Array) -> Deviation:
    """Return the largest of what is missed of each joint's position and velocity, shape (2, n)."""
    (position, velocity), joints = missed.max(axis=1).tolist(), missed.argmax(axis=1).tolist()
    return Deviation(position, velocity, (joints[0], joints[1]))


def _first_knots(curve: PiecewisePolynomial, stated: int) -> tuple[Nanoseconds, dict[int, Array], float]:
    """Return the breaks in whole nanoseconds, of quintics two about each step of the acceleration.

    Behind a step the position is another: the second value says by how much, (n,) at each such time. The last
    one is what may be missed of the position.
    """
    breaks = curve.breaks - curve.start
    whole = np.rint(breaks * _PER_SECOND).astype(np.int64)
    rates = [curve.piece_ends(order) for order in (1, 2)]
    steps = _steps(curve, np.arange(breaks.size), rates)
    up = np.arange(breaks.size) == curve.pieces
    up |= np.asarray(steps.any(axis=1))  # behind a step, and nowhere before the end
    spacing = np.maximum(_ROUNDING, 4 * np.spacing(breaks))
    whole += up & (whole / _PER_SECOND < breaks - spacing)
    kept = _apart(whole)
    allowed = _allowed(curve, stated, stepping=stated == _QUINTIC and bool(steps.any()))
    times, steps = whole[kept], _steps(curve, kept, rates)
    sizes = np.abs(steps).max(axis=1, initial=0.0)
    if stated < _QUINTIC or not sizes.any():
        return times, {}, allowed
    lengths = np.diff(times)
    nearest = np.minimum(np.append(lengths[:1], lengths), np.append(lengths, lengths[-1:]))
    with np.errstate(divide="ignore"):
        half = np.minimum(np.sqrt(6 * _STEP_DEVIATION / sizes) * _PER_SECOND, _LONGEST_STEP)
    half = np.maximum(np.minimum(half, nearest / 4), _SHORTEST_STEP)
    split = np.flatnonzero((sizes > 0) & (nearest >= 4 * half))
    away = half[split].astype(np.int64)
    behind = times[split] + away
    shifts = steps[split] * ((away / _PER_SECOND) ** 2 / 6)[:, None]
    both = np.concatenate([np.delete(times, split), times[split] - away, behind])
    return np.sort(both), dict(zip(behind.tolist(), shifts, strict=True)), allowed


def _allowed(curve: PiecewisePolynomial, stated: int, *, stepping: bool) -> float:
    """Return what may be missed of the position, rad or m: least where all pieces are as those between knots.

    Knots cannot cure rounding, nor velocities that change in less than what one knot takes.
    """
    largest = LARGEST_DEVIATION * (1.0 if stated == _QUINTIC else _FEWER)
    if stepping or np.any(curve.coefficients[: -2 * stated]):
        return largest
    position, velocity = (np.stack(curve.piece_ends(order)) for order in (0, 1))
    rounding = float(np.spacing(np.abs(position).max()))
    short = curve.lengths < _ONE / _PER_SECOND
    ramp = np.abs(velocity[1] - velocity[0])[short].max(initial=0.0) * _NEAREST / _PER_SECOND
    return min(largest, max(_OFF_BREAKS, 4.0 * rounding, float(ramp)))


def _steps(curve: PiecewisePolynomial, kept: NDArray[np.intp], rates: Sequence[tuple[Array, Array]]) -> Array:
    """Return the step of the acceleration at the breaks `kept`, shape (k, n); 0 for none, and at the ends.

    The `rates` are velocity and acceleration at both ends of the pieces.
    """
    steps: Array = np.zeros((kept.size, curve.dimension))
    if kept.size <= 2:
        return steps
    before, after = kept[1:-1] - 1, kept[2:] - 1
    lasting = curve.lengths >= _ONE / _PER_SECOND
    real = []
    for (first, last), little in zip(rates, (_RAMP, _CONTINUOUS), strict=True):
        scale = np.maximum(np.abs(first), np.abs(last))[lasting].max(axis=0, initial=0.0)
        steps[1:-1] = first[after] - last[before]
        real.append(np.abs(steps) > little * scale)
    steps[np.logical_or(~real[1], real[0].any(axis=1)[:, None])] = 0.0
    return steps


def _apart(whole: Nanoseconds) -> NDArray[np.intp]:
    """Return the indices of times that stay when those too close to an earlier one, or to the end, go."""
    if whole[-1] == whole[0]:
        return np.array([0])
    if (np.diff(whole) >= _ONE).all():
        return np.arange(whole.size)
    kept, last = [0], int(whole[0])
    for index, time in enumerate(whole[:-1].tolist()):
        if time - last >= _ONE and whole[-1] - time >= _ONE:
            kept.append(index)
            last = time
    return np.array([*kept, whole.size - 1])


def _states(trajectory: Trajectory, whole: Nanoseconds) -> Array:
    """Return position, velocity and acceleration at the knots, shape (3, m, n)."""
    curve, times = trajectory.curve, whole / _PER_SECOND + trajectory.curve.start
    near = curve.breaks[np.clip(np.searchsorted(curve.breaks, times), 0, curve.pieces)]
    on_break = np.abs(near - times) <= np.maximum(_ROUNDING, 4 * np.spacing(near))
    times = np.minimum(np.where(on_break, near, times), curve.end)
    rows = curve.evaluate_orders(times, (0, 1, 2))
    leave_short_pieces(curve, times, (0, 1, 2), rows, (_NEAREST - 1) / _PER_SECOND)
    states = rows.transpose(1, 0, 2).copy()
    states[1, -1, trajectory.end.velocity == 0.0] = 0.0
    return states


def _missed(
    curve: PiecewisePolynomial, whole: Nanoseconds, states: Array, allowed: float = np.inf
) -> tuple[Array, Array]:
    """Return what polynomials miss of positions and velocities, (2, n), and of positions in intervals, (k,).

    Where an interval misses no more than is `allowed` the latter is zero.
    """
    largest, of_intervals = np.zeros((2, curve.dimension)), np.zeros(whole.size - 1)
    times = np.append(whole[:-1] / _PER_SECOND + curve.start, curve.end)
    for first in range(0, whole.size - 1, _BLOCK):
        knots = slice(first, first + _BLOCK + 1)
        points, interval = _difference(curve, whole[knots], times[knots], states[:, knots])
        bounds = np.maximum(points.max(axis=0), -points.min(axis=0))
        joint, part = np.nonzero(bounds[0] > allowed)
        found = _largest(points[:, 0, joint, part], np.arange(part.size), np.zeros(part.size))
        np.maximum.at(of_intervals[first:], interval[part], found)
        for likely in (0.5, 0.0):  # what may miss most first: the others seldom can miss more
            at_least = np.maximum(largest[..., None], likely * bounds.max(axis=2, keepdims=True))
            order, joint, part = np.nonzero(bounds > at_least)
            _largest(
                points[:, order, joint, part],
                np.ravel_multi_index((order, joint), largest.shape),
                largest.reshape(-1),
            )
            bounds[order, joint, part] = 0.0
    return largest, of_intervals


def _difference(
    curve: PiecewisePolynomial, whole: Nanoseconds, times: Array, states: Array
) -> tuple[Array, NDArray[np.intp]]:
    """Return control points of what polynomials miss in w parts of intervals that follow each other."""
    between = slice(*np.searchsorted(curve.breaks, times[[0, -1]]).tolist())
    united = distinct(np.concatenate([times, curve.breaks[between]]))
    starts, lengths = united[:-1], np.diff(united)
    within = starts + lengths / 2
    interval = np.clip(np.searchsorted(times, within, "right") - 1, 0, times.size - 2)
    piece = np.clip(np.searchsorted(curve.breaks, within, "right") - 1, 0, curve.pieces - 1)
    states = np.ascontiguousarray(states.transpose(0, 2, 1))  # long rows are fast
    joined = hermite_coefficients(states[..., :-1], states[..., 1:], np.diff(whole) / _PER_SECOND)
    own = np.ascontiguousarray(curve.coefficients[:, piece].transpose(0, 2, 1))
    own, joined = taylor_shift(own, starts - curve.breaks[piece]), joined[:, :, interval]
    difference = np.zeros((max(len(own), len(joined)), 2, *own.shape[1:]))
    difference[-len(own) :, 0] = own
    difference[-len(joined) :, 0] -= taylor_shift(joined, starts - times[interval])
    difference[1:, 1] = derivative_coefficients(difference[:, 0], 1)
    return control_points(difference, lengths), interval


def _largest(points: Array, owner: NDArray[np.intp], largest: Array) -> Array:
    """Raise `largest` (k,) at `owner` (m,) to magnitudes of polynomials, by control points (degree + 1, m).

    What may be larger than any value that is reached is quartered, until it may be by rounding alone.
    """
    size = len(points)
    while owner.size:
        np.maximum.at(largest, owner, np.abs(points[[0, -1]]).max(axis=0))
        may_count = np.abs(points).max(axis=0) > largest[owner] * (1 + _SAME)
        parts = matrix_times_rows(_quarters(size), points[:, may_count]).reshape(4, size, -1)
        points, owner = parts.transpose(1, 0, 2).reshape(size, -1), np.tile(owner[may_count], 4)
    return largest


@cache
def _quarters(size: int) -> Array:
    """Return what makes the control points of the quarters of a polynomial, (4 size, size), of those of all.

    Source: Farouki (2012), section 4, on de Casteljau's algorithm.
    """
    left = np.array([[comb(k, i) / 2.0**k for i in range(size)] for k in range(size)])
    halves = np.concatenate([left, left[::-1, ::-1]])
    return np.concatenate([halves @ left, halves @ left[::-1, ::-1]])


def _insertions(whole: Nanoseconds, missed: Array, stated: int, allowed: float) -> Nanoseconds:
    """Return times inside the intervals that miss too much, as long as these can be divided."""
    lengths = np.diff(whole)
    wanted = np.ceil((missed / allowed) ** (0.5 / stated) * (1 + _ROUNDING))
    parts = np.minimum(np.clip(wanted, 1, _MOST_PARTS).astype(np.int64), lengths // _NEAREST)
    times = [
        whole[k] + lengths[k] * np.arange(1, parts[k]) // parts[k] for k in np.flatnonzero(parts > 1).tolist()
    ]
    return np.concatenate(times) if times else np.array([], dtype=np.int64)
