"""Lower bounds of the duration of motions through points.

Where the list of a joint's positions turns, the joint stands still at or beyond that point, at whatever
acceleration. Between two such places it needs at least the time of the fastest motion with velocity zero at
both ends, free acceleration at turning points and the given state at the ends of the list. The sum over a
joint's monotone stretches bounds the whole motion, and so does the sum over segments of what the slowest
joint needs at its velocity limit, and the fastest motion of a joint from start to target that leaves out all
points between.

A ramp from velocity u to w > u with free acceleration at its start begins with as much acceleration as it may
and ends with none: it takes sqrt(2 (w - u) / j), or where that needs more than the acceleration limit a,
(w - u) / a + a / (2 j).
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.planners.fastest_through_points.problem import WaypointProblem
from trajcli.planners.fastest_through_points.state_times import alone_times

_HALVINGS = 200
_SOLVED = 1e-9  # relative: the accuracy of ruckig's durations
_ROUNDING = 1e-12  # relative; what halving leaves is taken off, so that the bound stays one


class _Rates(NamedTuple):
    """Bounds along a stretch: speed, speeding up, slowing down, jerk."""

    speed: float
    faster: float
    slower: float
    jerk: float


def shortest_duration(problem: WaypointProblem) -> tuple[float, int | None]:
    """Return a proven lower bound of the duration, s, and the joint that needs it; None: several together."""
    ends = np.concatenate([problem.states[0], problem.states[-1]], axis=1)
    direct = alone_times(problem, problem.points[-1] - problem.points[0], ends)
    direct = np.where(np.isfinite(direct), direct * (1 - _SOLVED), 0.0).tolist()
    by_joint = [max(_of_joint(problem, joint), direct[joint]) for joint in range(problem.joints)]
    bound = problem.velocity
    steps = problem.steps
    at_speed = np.where(steps > 0, steps / bound[:, 1], steps / bound[:, 0]).max(axis=1)
    together = float(np.maximum(at_speed, problem.least).sum())
    worst = int(np.argmax(by_joint))
    if by_joint[worst] >= together:
        return by_joint[worst], worst
    return together, None


def _of_joint(problem: WaypointProblem, joint: int) -> float:
    """Return what a joint needs at least for its stretches."""
    stops = _turns(problem.points[:, joint])
    total = 0.0
    for first, last in pairwise(stops):
        distance = float(problem.points[last, joint] - problem.points[first, joint])
        if not distance:
            continue
        sign = 1 if distance > 0 else -1
        high = float((problem.velocity[joint] * sign).max())
        least, most = (problem.acceleration[joint] * sign).tolist()[::sign]
        rates = _Rates(high, most, -least, float(problem.jerk[joint]))
        ends = []
        for point in (first, last):
            outer = point in (0, problem.segments)
            speed, bent = (problem.states[point, joint] * sign).tolist() if outer else (0.0, 1.0)
            ends.append((min(max(speed, 0.0), high), not outer or bool(speed or bent)))
        total += _stretch(abs(distance), rates, ends)
    return total * (1 - _ROUNDING)


def _turns(positions: Array) -> list[int]:
    """Return the indices of the first and last position and of those where the direction changes."""
    kept, direction = [0], 0.0
    for k, step in enumerate(np.diff(positions).tolist()):
        if step and direction and step * direction < 0:
            kept.append(k)
        direction = step or direction
    return [*kept, len(positions) - 1]


def _stretch(distance: float, rates: _Rates, ends: list[tuple[float, bool]]) -> float:
    """Return the least time over a distance, from (speed, whether its acceleration is free) to another."""
    low, high = max(speed for speed, _ in ends), rates.speed

    def covered(peak: float) -> tuple[float, float]:
        """Return distance and time of both ramps."""
        ramps = [
            _ramp(speed, peak, rate, rates.jerk, free)
            for (speed, free), rate in zip(ends, (rates.faster, rates.slower), strict=True)
        ]
        return ramps[0][0] + ramps[1][0], ramps[0][1] + ramps[1][1]

    length, time = covered(high)
    if length <= distance:
        return time + (distance - length) / high
    if covered(low)[0] > distance:
        return distance / high  # it cannot stop so soon: where it goes, nothing is said of
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        low, high = (middle, high) if covered(middle)[0] <= distance else (low, middle)
    length, time = covered(low)
    return time + (distance - length) / high if high > 0 else time


def _ramp(speed: float, peak: float, rate: float, jerk: float, free: bool) -> tuple[float, float]:
    """Return distance and time of the fastest ramp from a speed to a peak where acceleration ends."""
    change = max(peak - speed, 0.0)
    full = rate / jerk
    if free:
        if change <= rate * full / 2:
            time = math.sqrt(2 * change / jerk)
            return speed * time + change * time * 2 / 3, time
        even = (change - rate * full / 2) / rate
        gained = rate * even
        return (
            (speed + gained / 2) * even + (speed + gained) * full + rate * full * full / 3,
            even + full,
        )
    if change <= rate * full:
        time = 2 * math.sqrt(change / jerk)
        return (speed + change / 2) * time, time
    time = change / rate + full
    return (speed + change / 2) * time, time
