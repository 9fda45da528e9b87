"""The time law s(t) of given sd^2 at the places of a grid, sdd constant between them."""

from __future__ import annotations

import numpy as np

from trajcli.curves.piecewise import Array, PiecewisePolynomial, increasing


def durations(grid: Array, x: Array) -> Array:
    """Return the time each interval takes, shape (N,).

    Args:
        grid: Places, shape (N + 1,).
        x: sd^2 there; two neighbours must not both be zero.
    """
    sd = np.sqrt(x)
    return np.asarray(2.0 * np.diff(grid) / (sd[:-1] + sd[1:]))


def law_of(grid: Array, x: Array) -> PiecewisePolynomial:
    """Return s(t), quadratic between the grid's places, from t = 0 on.

    Args:
        grid: Places, shape (N + 1,).
        x: sd^2 there; two neighbours must not both be zero.
    """
    times = np.concatenate([[0.0], np.cumsum(durations(grid, x))])
    u = np.diff(x) / (2.0 * np.diff(grid))
    return PiecewisePolynomial(increasing(times), np.stack([0.5 * u, np.sqrt(x[:-1]), grid[:-1]])[:, :, None])
