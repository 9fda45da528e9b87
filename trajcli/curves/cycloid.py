"""The cycloidal law s(u) = u - sin(2 pi u) / (2 pi), whose acceleration is a sine: zero at both ends.

It is no polynomial: nonic Hermite pieces through its exact derivatives follow it. The error of a piece of
width h is s^(10) (h/2)^10 / 10!, at 16 pieces 4e-15 of the displacement; of the peaks of velocity,
acceleration and jerk it is 1e-13, 6e-12 and 1e-10. Breaks stand where these have their peaks (quarters), so
that the peaks 2, 2 pi and 4 pi^2 are exact.

Source: Biagiotti and Melchiorri, Trajectory Planning for Automatic Machines and Robots (2008), section 2.2.2.
"""

from __future__ import annotations

from functools import cache
from math import factorial, perm

import numpy as np

from trajcli.curves.hermite import hermite_coefficients
from trajcli.curves.piecewise import Array, PiecewisePolynomial

PEAKS = (1.0, 2.0, 2 * np.pi, 4 * np.pi**2)
"""Peaks of s and its derivatives over unit time, by order."""

_PIECES = 16
_CONDITIONS = 5  # at either end of a piece
_TERMS = 22  # of the Taylor series of a piece: the first that is left out is 1e-30


def cycloid_law(duration: float) -> PiecewisePolynomial:
    """Return s(t / duration), n = 1, from 0 to 1 over `duration` seconds."""
    breaks = duration * (np.arange(_PIECES + 1) / _PIECES)
    powers = (duration / _PIECES) ** np.arange(2 * _CONDITIONS - 1, -1, -1)
    return PiecewisePolynomial(breaks, (_pieces() / powers[:, None])[:, :, None])


@cache
def _pieces() -> Array:
    """Return the coefficients (10, 16) of each piece over unit time, highest power first.

    Solving for them would lose the digits that cancel: 2e-12 of the acceleration's peak. Instead each power
    from the tenth on of a piece's Taylor series is replaced by its own Hermite polynomial, which is small.
    """
    sine = np.sin(2 * np.pi / _PIECES * np.arange(_PIECES))
    sine[::4] = (0.0, 1.0, 0.0, -1.0)
    orders, piece = np.arange(_TERMS)[:, None], np.arange(_PIECES)
    factorials = np.array([factorial(order) for order in range(_TERMS)], dtype=np.float64)[:, None]
    angle = 2 * np.pi / _PIECES
    taylor = -(angle**orders) / (2 * np.pi * factorials) * sine[(piece + 4 * orders) % _PIECES]
    taylor[0] += piece / _PIECES
    taylor[1] += 1 / _PIECES
    degree = 2 * _CONDITIONS - 1
    tail = range(degree + 1, _TERMS)
    ends = np.array(
        [[perm(power, order) for power in tail] for order in range(_CONDITIONS)], dtype=np.float64
    )
    replaced = hermite_coefficients(np.zeros_like(ends), ends, np.array(1.0))
    coefficients: Array = taylor[degree::-1] + replaced @ taylor[degree + 1 :]
    return coefficients
