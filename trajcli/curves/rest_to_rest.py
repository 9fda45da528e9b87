"""Laws from rest to rest in closed form: the cycloid, and the phases of the double S.

The cycloid is s(u) = u - sin(2 pi u) / (2 pi), whose acceleration is a sine: zero at both ends. It is no
polynomial: pieces of the ninth degree follow it, each the law's own Taylor series at its start. Over a piece
of width h the series is off by s^(10) h^10 / 10!, which at 64 pieces is 4e-18 of the displacement; where
pieces meet, the acceleration jumps by 2e-13 of its peak. Taking the coefficients from the series, and not
from conditions at both ends, divides no difference of nearly equal numbers by a power of h: their last bits
stay last bits, and files stay the same from machine to machine. Breaks stand where velocity, acceleration and
jerk have their peaks (quarters), so the peaks 2, 2 pi and 4 pi^2 are met.

The double S has seven phases. Velocity rises by jerk, constant acceleration and jerk, stays, and falls the
same way. `t_j` is the duration of each of the four phases with jerk, `t_a` that of each of the two with
constant acceleration, `t_v` the cruise's.

Source: Biagiotti and Melchiorri (2008), sections 2.2.2 and 3.4.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from trajcli.curves.piecewise import Array, PiecewisePolynomial

PEAKS = (1.0, 2.0, 2 * math.pi, 4 * math.pi**2)
"""Peaks of s and its derivatives over unit time, by order."""

_PIECES = 64
_DEGREE = 9

_ROUNDING = 1e-12  # relative: what the acceleration may be above its limit
_JERKS = (1.0, 0.0, -1.0, 0.0, -1.0, 0.0, 1.0)


def cycloid_law(duration: float) -> PiecewisePolynomial:
    """Return s(t / duration), n = 1, from 0 to 1 over `duration` seconds."""
    u = np.arange(_PIECES + 1) / _PIECES
    coefficients = np.stack(
        [_taylor_coefficient(power) / duration**power for power in range(_DEGREE, -1, -1)]
    )
    return PiecewisePolynomial(u * duration, coefficients[:, :, None])


def _taylor_coefficient(power: int) -> Array:
    """Return s^(power) / power! at the start of each piece, shape (pieces,)."""
    u = np.arange(_PIECES) / _PIECES
    polynomial = u if power == 0 else np.full(_PIECES, float(power == 1))
    # the derivative of a sine is the sine a quarter turn on
    wave = np.array([_sine(piece + power * _PIECES // 4) for piece in range(_PIECES)])
    scale = (2 * math.pi) ** (power - 1) / math.factorial(power)
    return polynomial - scale * wave


def _sine(step: int) -> float:
    """Return sin(2 pi step / pieces) from the first eighth turn, so that equal values have equal bits."""
    quarter = _PIECES // 4
    turn, part = divmod(step % _PIECES, quarter)
    if turn % 2:
        part = quarter - part
    angle = 2 * math.pi / _PIECES
    size = math.sin(part * angle) if 2 * part <= quarter else math.cos((quarter - part) * angle)
    return -size if turn >= 2 else size


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
    left = duration - full
    square = left * left - 4 * distance / acceleration
    if left > 0 and square >= 0:
        velocity = 2 * distance / (left + math.sqrt(square))
        if velocity >= acceleration * full:
            t_a = velocity / acceleration - full
            return _lasting(duration, full, t_a)
    # the velocity is the square of root = mean / z, with z the largest root of z^3 - z + e, 0 < e < 0.385
    mean = math.sqrt(distance / duration)
    cosine = -math.sqrt(27 / jerk) * mean / duration
    if cosine < -1:
        return None
    root = mean * math.sqrt(0.75) / math.cos(math.acos(cosine) / 3)
    t_j = root / math.sqrt(jerk)
    return _lasting(duration, t_j, 0.0) if t_j <= full * (1 + _ROUNDING) else None


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
