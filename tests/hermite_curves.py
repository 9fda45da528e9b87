"""Curves by their derivatives, which many tests make."""

from __future__ import annotations

import numpy as np

from trajcli.curves.hermite import hermite_coefficients
from trajcli.curves.piecewise import PiecewisePolynomial


def hermite_pieces(breaks, derivatives) -> PiecewisePolynomial:
    """Return the curve whose value, first, ... (k-1)-th derivative are given, (k, m, n), at m breaks."""
    times, given = np.asarray(breaks, dtype=float), np.asarray(derivatives, dtype=float)
    return PiecewisePolynomial(
        times, hermite_coefficients(given[:, :-1], given[:, 1:], np.diff(times)[:, None])
    )
