"""Braking intervals: where a move that starts outside its limits may still be outside of them.

How long that takes at least, and how far the start leads, follows from the start and the limits alone. A
limit that the start breaks, or cannot but break, is left out of the judgement for that long and no longer,
and only as far as the start leads; the jerk never is.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import takewhile

import numpy as np

from trajcli.curves.braking import Braking, braking
from trajcli.curves.extrema import IntervalPeaks, Peaks, peaks_between
from trajcli.curves.piecewise import Array
from trajcli.frozen import comparable
from trajcli.kinematics.robot import Limits
from trajcli.limits.tolerances import BRAKING_RELATIVE, exceeds
from trajcli.trajectory import Promise, Span, Trajectory


@comparable
class BrakingInterval:
    """The beginning of a move, in which a limit that its start breaks does not count.

    Attributes:
        joint: Index of the joint.
        order: 1 for its velocity, 2 for its acceleration.
        duration: Seconds from the start of the move.
        lowest: The lower of the start's value and of that to which it leads whatever is done, SI.
        highest: The higher of these.
    """

    joint: int
    order: int
    duration: float
    lowest: float
    highest: float


def braking_intervals(
    velocity: Array, acceleration: Array, limits: Limits, on_line: bool
) -> list[BrakingInterval]:
    """Return the intervals of a move that brings its start inside the limits as fast as possible.

    Args:
        velocity: Of the joints at the start, shape (n,), SI.
        acceleration: The same, shape (n,).
        limits: Of the joints, in force for the move.
        on_line: Whether all joints brake together, on one straight line, instead of each by itself.
    """
    bounds = np.stack([limits.of_order(order) for order in (1, 2, 3)], axis=1)
    rates = list(zip(velocity.tolist(), acceleration.tolist(), strict=True))
    law, direction = None, np.ones(velocity.size)
    if on_line:
        direction = velocity if velocity.any() else acceleration
        law = _common_braking(velocity, acceleration, direction, bounds)
    intervals = []
    for joint, (rate, bound) in enumerate(zip(rates, bounds, strict=True)):
        if not any(rate):  # it rests, and a line along which others brake leaves it no jerk
            continue
        own = braking(*rate, bound)
        slowest = own if law is None else law
        for order, outside, duration, reached in (
            (1, own.velocity, slowest.velocity, slowest.fastest * float(direction[joint])),
            (2, own.acceleration, slowest.acceleration, rate[1]),
        ):
            if outside > 0:
                ends = (rate[order - 1], reached)
                intervals.append(BrakingInterval(joint, order, duration, min(ends), max(ends)))
    return intervals


def _common_braking(velocity: Array, acceleration: Array, direction: Array, bounds: Array) -> Braking:
    """Return the braking of the one law that moves all joints along a direction.

    The bounds (n, 3, 2) of the joints on the jerk are narrowed to those that the law leaves them.
    """
    moving = direction != 0
    scaled = np.sort(bounds[moving] / direction[moving, None, None], axis=2)
    tightest = np.stack([scaled[:, :, 0].max(axis=0), scaled[:, :, 1].min(axis=0)], axis=1)
    bounds[moving, 2] = np.outer(np.abs(direction[moving]), tightest[2])
    size = float(direction @ direction)
    return braking(float(velocity @ direction) / size, float(acceleration @ direction) / size, tightest)


def judged_peaks(
    trajectory: Trajectory,
    limits_by_move: Sequence[Limits],
    promises: Sequence[Promise] | None,
    peaks: IntervalPeaks,
) -> IntervalPeaks:
    """Return for each span the extremes that count against its limits: all but those of braking intervals.

    Args:
        trajectory: What to judge.
        limits_by_move: One for each span.
        promises: What each span says of itself; None where nobody brakes.
        peaks: Extremes of each span, all of it.
    """
    brake = {k: each.braking for k, each in enumerate(promises or ()) if each.braking is not None}
    if not brake:
        return peaks
    names = ("low", "low_time", "high", "high_time")
    judged = [Peaks(*(np.array(getattr(extremes, name)) for name in names)) for extremes in peaks.of_orders]
    for k, how in brake.items():
        own = _beside_braking(trajectory, trajectory.spans[k], limits_by_move[k], peaks[k], how == "line")
        before = [*takewhile(lambda j: not trajectory.spans[j].duration, range(k - 1, -1, -1))]
        for extremes, whole, of_span in zip(judged, peaks[k], own, strict=True):
            for name in names:
                getattr(extremes, name)[k] = getattr(of_span, name)
            left_out = (of_span.low != whole.low) | (of_span.high != whole.high)
            for j in before:  # what takes no time is where the move starts
                extremes.low[j, left_out] = extremes.high[j, left_out] = 0.0
    return IntervalPeaks(tuple(judged))


def _beside_braking(
    trajectory: Trajectory, span: Span, limits: Limits, peaks: tuple[Peaks, ...], on_line: bool
) -> tuple[Peaks, ...]:
    curve, judged = trajectory.curve, list(peaks)
    first = min(curve.start + span.start, curve.end)
    velocity, acceleration = (curve.evaluate(first, order) for order in (1, 2))
    for interval in braking_intervals(velocity, acceleration, limits, on_line):
        joint, order = interval.joint, interval.order
        last = min(curve.start + span.end, curve.end)
        inside = min(first + interval.duration * (1 + BRAKING_RELATIVE), last)
        during, after = (found[order] for found in peaks_between(curve, [(first, inside), (inside, last)]))
        low, high = limits.of_order(order)[joint].tolist()
        over = exceeds(during.high[joint], max(high, interval.highest))
        under = exceeds(-during.low[joint], -min(low, interval.lowest))
        if not (over or under):
            judged[order] = _with_joint(judged[order], after, joint)
    return tuple(judged)


def _with_joint(peaks: Peaks, other: Peaks, joint: int) -> Peaks:
    chosen = np.arange(peaks.low.size) == joint
    names = ("low", "low_time", "high", "high_time")
    return Peaks(*(np.where(chosen, getattr(other, name), getattr(peaks, name)) for name in names))
