"""Knots of a trajectory: states from which quintic interpolation reproduces it.

A controller that interpolates position, velocity and acceleration runs the quintic Hermite polynomial
between neighbouring knots. A knot stands at each break of the curve, rounded to whole nanoseconds, with the
state that the curve has at the rounded time. Where the curve is no quintic, knots are inserted; where its
acceleration steps, one stands closely before the step.

Source: Biagiotti and Melchiorri, Trajectory Planning for Automatic Machines and Robots (2008), section 2.1.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.extrema import piece_extremes
from trajcli.curves.hermite import hermite_coefficients
from trajcli.curves.piecewise import Array, PiecewisePolynomial, distinct, read_only, taylor_shift
from trajcli.errors import InputError
from trajcli.frozen import comparable, frozen
from trajcli.grids import KnotGrid, UniformGrid, leave_short_pieces
from trajcli.trajectory import Trajectory

Nanoseconds = NDArray[np.int64]

LARGEST_DEVIATION = 1e-6  # rad or m: what quintics between knots may miss, where knots can be inserted
_NEAREST = 1000  # ns: knots closer than this are one, and no closer ones are inserted
_PER_SECOND = 1e9
_LONGEST = 2.0**53 / _PER_SECOND  # s: in longer motions float64 tells no nanoseconds apart
_ROUNDING = 1e-12  # s: a time this close to a break is the break
_CONTINUOUS = 1e-9  # of the largest acceleration of its joint: a step below that is rounding
_STEP_DEVIATION = 1e-9  # rad or m: what the knots around a step of the acceleration may miss
_STEP_BASIS = 0.01728  # the maximum of u^3 (1 - u)^2 / 2: what an acceleration that is wrong at one end costs
_SHORTEST_STEP = 20_000  # ns: over a shorter interval, rounding would show in the acceleration
_MOST_PARTS = 64  # of an interval that is divided at once
_ORDER = 6  # of the quintic's error: half the interval misses 2^-6 as much


@comparable
class Deviation:
    """The largest deviation of the quintics between knots from the curve, over all joints and for all t.

    Attributes:
        position: rad or m.
        velocity: Per second.
        acceleration: Per second squared; where the curve's acceleration steps, about the size of the step.
        joints: Indices of the joints whose position, velocity and acceleration deviate by that.
    """

    position: float
    velocity: float
    acceleration: float
    joints: tuple[int, int, int]


@frozen
class Knots:
    """States at whole nanoseconds.

    Attributes:
        nanoseconds: Shape (m,), from 0 on, strictly increasing; the last one is the end, rounded up.
        position: Shape (m, n), rad or m.
        velocity: Shape (m, n), per second; in the end exactly zero where the trajectory ends at rest.
        acceleration: Shape (m, n), per second squared; where it steps, that after the step.
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


def knots_of(trajectory: Trajectory) -> Knots:
    """Return the knots of a trajectory, so many that quintics between them are within `LARGEST_DEVIATION`.

    The deviation is that of polynomials, at the roots of the derivative of their difference. Knots are at
    least a microsecond apart: breaks that are closer are one knot, and the deviation says what that costs.

    Args:
        trajectory: One without jumps of position and velocity.

    Raises:
        InputError: When it is so long that float64 tells no nanoseconds apart.
    """
    curve = trajectory.curve
    if not has_knots(trajectory):
        raise InputError(
            f"the trajectory lasts {trajectory.duration:.6g} s, and knots stand at whole nanoseconds",
            hint=f"up to {_LONGEST:.6g} s they can be told apart; rows at a rate have no such bound",
        )
    whole = _first_knots(curve)
    while True:
        states = _states(trajectory, whole)
        missed = _missed(curve, whole, states)
        inserted = _insertions(whole, missed[0].max(axis=1))
        if not inserted.size:
            return Knots(whole, states[0], states[1], states[2], _deviation(missed))
        whole = np.sort(np.concatenate([whole, inserted]))


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
    return Knots(whole, states[0], states[1], states[2], _deviation(_missed(trajectory.curve, whole, states)))


def knot_grid(
    trajectory: Trajectory, knots: Knots, rate: float | None = None, start_time: float = 0.0
) -> KnotGrid:
    """Return the grid of rows at the knots of a trajectory, with a rate also at its times between them.

    A time of the rate that is nearer to a knot than a microsecond has no row of its own.

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
    local = np.concatenate([times, uniform[nearest > _NEAREST / _PER_SECOND]])
    order = np.argsort(local, kind="stable")
    at = np.flatnonzero(order < times.size)
    return KnotGrid(duration, local[order], at, states, start_time)


def _deviation(missed: Array) -> Deviation:
    """Return the largest of what is missed in each interval, orders 0 to 2, shape (3, k, n)."""
    by_joint = missed.max(axis=1, initial=0.0)
    joints = by_joint.argmax(axis=1).tolist()
    position, velocity, acceleration = by_joint.max(axis=1).tolist()
    return Deviation(position, velocity, acceleration, (joints[0], joints[1], joints[2]))


def _first_knots(curve: PiecewisePolynomial) -> Nanoseconds:
    """Return the breaks in whole nanoseconds, and a time closely before each step of the acceleration."""
    breaks = curve.breaks - curve.start
    whole = np.rint(breaks * _PER_SECOND).astype(np.int64)
    steps = _steps(curve)
    up = np.append(np.append(False, steps > 0), True)  # behind a step, and nowhere before the end
    spacing = np.maximum(_ROUNDING, 4 * np.spacing(breaks))
    whole += up & (whole / _PER_SECOND < breaks - spacing)
    kept = _apart(whole)
    whole, sizes = whole[kept], np.concatenate([[0.0], steps, [0.0]])[kept]
    lengths = np.diff(whole, prepend=whole[0])
    with np.errstate(divide="ignore"):
        before = np.sqrt(_STEP_DEVIATION / (_STEP_BASIS * sizes)) * _PER_SECOND
    before = np.maximum(np.minimum(before, lengths / 4), _SHORTEST_STEP)
    stands = (sizes > 0) & (lengths >= 2 * before)
    return np.sort(np.concatenate([whole, whole[stands] - before[stands].astype(np.int64)]))


def _steps(curve: PiecewisePolynomial) -> Array:
    """Return the largest step of the acceleration at each inner break, shape (pieces - 1,); 0 for none."""
    first, last = curve.piece_ends(2)
    steps = np.abs(first[1:] - last[:-1])
    scale = np.maximum(np.abs(first), np.abs(last)).max(axis=0, initial=0.0)
    largest: Array = np.where(steps > _CONTINUOUS * scale, steps, 0.0).max(axis=1, initial=0.0)
    return largest


def _apart(whole: Nanoseconds) -> NDArray[np.intp]:
    """Return the indices of times that stay when those too close to an earlier one, or to the end, go."""
    if whole[-1] == whole[0]:
        return np.array([0])
    if (np.diff(whole) >= _NEAREST).all():
        return np.arange(whole.size)
    kept, last = [0], int(whole[0])
    for index, time in enumerate(whole[:-1].tolist()):
        if time - last >= _NEAREST and whole[-1] - time >= _NEAREST:
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


def _missed(curve: PiecewisePolynomial, whole: Nanoseconds, states: Array) -> Array:
    """Return what quintics miss in each of the k intervals between knots, orders 0 to 2, (3, k, n)."""
    missed = np.zeros((3, whole.size - 1, curve.dimension))
    if whole.size < 2:
        return missed
    times = np.append(whole[:-1] / _PER_SECOND + curve.start, curve.end)
    united = distinct(np.concatenate([times, curve.breaks]))
    starts, lengths = united[:-1], np.diff(united)
    within = starts + lengths / 2
    interval = np.clip(np.searchsorted(times, within, "right") - 1, 0, times.size - 2)
    piece = np.clip(np.searchsorted(curve.breaks, within, "right") - 1, 0, curve.pieces - 1)
    quintics = hermite_coefficients(states[:, :-1], states[:, 1:], (np.diff(whole) / _PER_SECOND)[:, None])
    difference = taylor_shift(curve.coefficients[:, piece], (starts - curve.breaks[piece])[:, None])
    short = max(0, quintics.shape[0] - difference.shape[0])
    difference = np.concatenate([np.zeros((short, *difference.shape[1:])), difference])
    difference[-quintics.shape[0] :] -= taylor_shift(
        quintics[:, interval], (starts - times[interval])[:, None]
    )
    for order, (low, high) in enumerate(piece_extremes(difference, lengths, (0, 1, 2))):
        np.maximum.at(missed[order], interval, np.maximum(-low, high))
    return missed


def _insertions(whole: Nanoseconds, missed: Array) -> Nanoseconds:
    """Return times inside the intervals that miss too much, as long as these can be divided."""
    lengths = np.diff(whole)
    wanted = np.ceil((missed / LARGEST_DEVIATION) ** (1 / _ORDER) * (1 + _ROUNDING))
    parts = np.minimum(np.clip(wanted, 1, _MOST_PARTS).astype(np.int64), lengths // _NEAREST)
    times = [
        whole[k] + lengths[k] * np.arange(1, parts[k]) // parts[k] for k in np.flatnonzero(parts > 1).tolist()
    ]
    return np.concatenate(times) if times else np.array([], dtype=np.int64)
