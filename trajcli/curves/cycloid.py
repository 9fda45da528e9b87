"""The cycloidal law s(u) = u - sin(2 pi u) / (2 pi), whose acceleration is a sine: zero at both ends.

It is no polynomial: nonic Hermite pieces through its exact derivatives follow it. The error of a piece of width h
is s^(10) (h/2)^10 / 10!, which at 16 pieces is 4e-15 of the displacement. Breaks stand where velocity,
acceleration and jerk have their peaks (quarters), so the peaks 2, 2 pi and 4 pi^2 are exact.

Source: Biagiotti and Melchiorri, Trajectory Planning for Automatic Machines and Robots (2008), section 2.2.2.
"""

from __future__ import annotations

import numpy as np

from trajcli.curves.hermite import hermite_pieces
from trajcli.curves.piecewise import PiecewisePolynomial

PEAKS = (1.0, 2.0, 2 * np.pi, 4 * np.pi**2)
"""Peaks of s and its derivatives over unit time, by order."""

_PIECES = 16
_ORDERS = 5


def cycloid_law(duration: float) -> PiecewisePolynomial:
    """Return s(t / duration), n = 1, from 0 to 1 over `duration` seconds."""
    u = np.linspace(0.0, 1.0, _PIECES + 1)
    angle = 2 * np.pi * u
    # sin and cos of whole quarters are exactly 0 or +-1, so rest at the ends is exact
    sine, cosine = (
        np.where(np.isin(4 * u % 1, (0.0,)), np.rint(f(angle)), f(angle)) for f in (np.sin, np.cos)
    )
    unit = np.stack(
        [
            u - sine / (2 * np.pi),
            1 - cosine,
            2 * np.pi * sine,
            4 * np.pi**2 * cosine,
            -8 * np.pi**3 * sine,
        ]
    )
    scaled = unit / duration ** np.arange(_ORDERS)[:, None]
    return hermite_pieces(u * duration, scaled[:, :, None])
