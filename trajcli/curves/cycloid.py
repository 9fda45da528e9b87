"""Cycloidal law s(u) = u - sin(2 pi u) / (2 pi), whose acceleration is a sine: zero at both ends.

It is no polynomial: pieces of the ninth degree follow it, each the law's own Taylor series at its start.
Over a piece of width h the series is off by s^(10) h^10 / 10!, which at 64 pieces is 4e-18 of the
displacement; where pieces meet, the acceleration jumps by 2e-13 of its peak. Taking the coefficients from
the series, and not from conditions at both ends, divides no difference of nearly equal numbers by a power
of h: their last bits stay last bits, and files stay the same from machine to machine. Breaks stand where
velocity, acceleration and jerk have their peaks (quarters), so the peaks 2, 2 pi and 4 pi^2 are met.

Source: Biagiotti and Melchiorri, Trajectory Planning for Automatic Machines and Robots (2008), section 2.2.2.
"""

from __future__ import annotations

import math

import numpy as np

from trajcli.curves.piecewise import Array, PiecewisePolynomial

PEAKS = (1.0, 2.0, 2 * math.pi, 4 * math.pi**2)
"""Peaks of s and its derivatives over unit time, by order."""

_PIECES = 64
_DEGREE = 9


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
    turn, rest = divmod(step % _PIECES, quarter)
    if turn % 2:
        rest = quarter - rest
    angle = 2 * math.pi / _PIECES
    size = math.sin(rest * angle) if 2 * rest <= quarter else math.cos((quarter - rest) * angle)
    return -size if turn >= 2 else size
