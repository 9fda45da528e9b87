"""Double-S velocity profile from rest to rest: the durations of its seven phases in closed form.

Velocity rises by jerk, constant acceleration and jerk, stays, and falls the same way. `t_j` is the duration
of each of the four phases with jerk, `t_a` that of each of the two with constant acceleration, `t_v` the
cruise's.

Source: Biagiotti and Melchiorri, Trajectory Planning for Automatic Machines and Robots (2008), section 3.4.
"""

from __future__ import annotations

import math
from typing import NamedTuple

_NEWTON = 4  # steps: from nine digits that the trigonometric root has to all of them
_JERKS = (1.0, 0.0, -1.0, 0.0, -1.0, 0.0, 1.0)


class DoubleS(NamedTuple):
    """Durations of the phases, s: with jerk, with constant acceleration, with constant velocity."""

    jerking: float
    accelerating: float
    cruising: float

    def phases(self, jerk: float) -> tuple[list[float], list[float]]:
        """Return durations and jerks of the phases that last; the sign of `jerk` is the direction."""
        t_j, t_a, t_v = self
        if not t_a and not t_v:
            return [t_j, 2 * t_j, t_j], [jerk, -jerk, jerk]
        rows = zip((t_j, t_a, t_j, t_v, t_j, t_a, t_j), _JERKS, strict=True)
        kept = [(time, sign * jerk + 0.0) for time, sign in rows if time > 0]
        return [time for time, _ in kept], [value for _, value in kept]


def fastest_double_s(distance: float, velocity: float, acceleration: float, jerk: float) -> DoubleS:
    """Return the fastest profile over a distance; all are positive."""
    t_j, t_a = _ramp(velocity, acceleration, jerk)
    cruise = distance / velocity - (2 * t_j + t_a)
    if cruise >= 0:
        return DoubleS(t_j, t_a, cruise)
    full = acceleration / jerk
    if distance >= 2 * acceleration * full * full:
        root = math.sqrt(full * full + 4 * distance / acceleration)
        return DoubleS(full, max(0.0, 0.5 * (root - 3 * full)), 0.0)
    return DoubleS(math.cbrt(distance / (2 * jerk)), 0.0, 0.0)


def double_s_of(distance: float, duration: float, acceleration: float, jerk: float) -> DoubleS | None:
    """Return the profile that lasts `duration` and has the least velocity; None where none lasts so short."""
    full = acceleration / jerk
    rest = duration - full
    square = rest * rest - 4 * distance / acceleration
    if rest > 0 and square >= 0:
        velocity = 2 * distance / (rest + math.sqrt(square))
        if velocity >= acceleration * full:
            t_a = velocity / acceleration - full
            return _lasting(duration, full, t_a)
    root_of_jerk = math.sqrt(jerk)
    shift = duration * root_of_jerk / 6
    cosine = 1 - distance * root_of_jerk / (4 * shift * shift * shift)
    if cosine < -1:
        return None
    root = shift * (1 + 2 * math.cos((math.acos(cosine) - 2 * math.pi) / 3))
    root = max(root, math.sqrt(distance / duration))
    for _ in range(_NEWTON):
        value = distance + root * root * (2 * root / root_of_jerk - duration)
        root -= value / (2 * root * (3 * root / root_of_jerk - duration))
    return _lasting(duration, root / root_of_jerk, 0.0)


def _lasting(duration: float, t_j: float, t_a: float) -> DoubleS | None:
    """Return the profile with a cruise for the rest of the duration."""
    cruise = duration - 2 * (2 * t_j + t_a)
    return DoubleS(t_j, t_a, cruise) if cruise >= 0 else None


def _ramp(velocity: float, acceleration: float, jerk: float) -> tuple[float, float]:
    """Return the durations with jerk and with constant acceleration of the rise to a velocity."""
    full = acceleration / jerk
    if velocity >= acceleration * full:
        return full, velocity / acceleration - full
    return math.sqrt(velocity / jerk), 0.0
