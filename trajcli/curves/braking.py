"""Braking: the return of one variable into its bounds on velocity and acceleration, as fast as possible.

An acceleration beyond its bounds is brought down with full jerk. A velocity that is beyond its bounds, or
that the acceleration carries beyond them whatever is done, is brought back with full jerk, then with full
acceleration, but never so that it would have to leave the bounds on the other side.
"""

from __future__ import annotations

import math

from trajcli.curves.piecewise import Array
from trajcli.frozen import comparable

_ROUNDING = 1e-12  # relative; a bound that is exceeded by less is kept


@comparable
class Braking:
    """The fastest return of a state into its bounds.

    Attributes:
        phases: (duration in s, constant) until the velocity keeps its bounds, or the acceleration where that
            alone is beyond: the constant is the jerk, or the acceleration where the jerk is unbounded. Empty
            where the state keeps its bounds and can go on doing so.
        velocity: Seconds until the velocity keeps its bounds; 0 where it never leaves them.
        acceleration: The same for the acceleration.
        fastest: The velocity farthest beyond its bounds that cannot be avoided; the given one where none is.
    """

    phases: tuple[tuple[float, float], ...]
    velocity: float
    acceleration: float
    fastest: float


def braking(velocity: float, acceleration: float, bounds: Array) -> Braking:
    """Return the fastest return of a state into its bounds.

    Args:
        velocity: At the start.
        acceleration: At the start; it does not count where the jerk is unbounded, as it may step.
        bounds: Shape (3, 2), lower and upper, of velocity, acceleration and jerk. Of the two bounds of the
            jerk the smaller magnitude holds both ways.
    """
    (low, high), (lowest, highest), jerks = bounds.tolist()
    jerk = min(map(abs, jerks))
    start = (velocity, acceleration if math.isfinite(jerk) else 0.0)
    reached = start[0] + start[1] * abs(start[1]) / (2 * jerk)
    over, under = _above(reached, high), _above(-reached, -low)
    if not over and (under or _above(-velocity, -low)):
        turned = _descent(-start[0], -start[1], (-high, -low), (-highest, -lowest), jerk)
        return Braking(
            tuple((time, -constant) for time, constant in turned.phases),
            turned.velocity,
            turned.acceleration,
            -turned.fastest,
        )
    if over or _above(velocity, high):
        return _descent(*start, (low, high), (lowest, highest), jerk)
    outside = max(start[1] - highest, lowest - start[1])
    if outside <= _ROUNDING * abs(start[1]):
        return Braking((), 0.0, 0.0, velocity)
    return Braking(((outside / jerk, -math.copysign(jerk, start[1])),), 0.0, outside / jerk, velocity)


def _above(value: float, bound: float) -> bool:
    """Return whether a value is above its upper bound by more than rounding."""
    return value > bound + _ROUNDING * abs(bound)


def _descent(
    velocity: float, acceleration: float, speeds: tuple[float, float], rates: tuple[float, float], jerk: float
) -> Braking:
    """Return the braking of a velocity above its bounds, or carried there; bounds (low, high)."""
    (low, high), (lowest, highest) = speeds, rates
    if math.isinf(jerk):
        time = (velocity - high) / -lowest
        return Braking(((time, lowest),) if time > 0 else (), time, 0.0, velocity)
    fastest = velocity + max(acceleration, 0.0) ** 2 / (2 * jerk)
    beyond = max(acceleration - highest, lowest - acceleration, 0.0)
    # down to the acceleration from which full jerk the other way just ends at the lower bound
    turn = max(lowest, -math.sqrt(max(jerk * (velocity - low) + acceleration**2 / 2, 0.0)))
    first = -math.copysign(jerk, acceleration - turn)
    plan = [(abs(acceleration - turn) / jerk, first)]
    speed = velocity + (turn**2 - acceleration**2) / (2 * first)
    plan.append((max(speed - turn**2 / (2 * jerk) - low, 0.0) / -turn, 0.0))
    plan.append((-turn / jerk, jerk))
    phases, total, state = [], 0.0, (velocity, acceleration)
    for time, constant in plan:
        crossing = _crossing(*state, constant, high, time)
        phases.append((time if crossing is None else crossing, constant))
        total += phases[-1][0]
        if crossing is not None:
            break
        speed, rate = state
        state = (speed + rate * time + constant * time**2 / 2, rate + constant * time)
    kept = tuple(phase for phase in phases if phase[0] > 0)
    return Braking(kept, total, beyond / jerk, fastest)


def _crossing(
    velocity: float, acceleration: float, jerk: float, bound: float, duration: float
) -> float | None:
    """Return when the velocity falls to its bound within a phase of constant jerk, None where it does not."""
    square = acceleration**2 + 2 * jerk * (bound - velocity)  # of the acceleration at the crossing
    if square < 0:
        return None
    there = math.sqrt(square)
    if acceleration < 0:
        time = max(2 * (velocity - bound) / (there - acceleration), 0.0)
    elif jerk < 0:
        time = (acceleration + there) / -jerk
    else:
        return None
    return time if time <= duration * (1 + _ROUNDING) else None
