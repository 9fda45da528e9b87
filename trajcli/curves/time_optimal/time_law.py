"""The time law s(t) of given sd^2 at the places of a grid: cubic pieces, sdd linear in time between them.

A piece over the length D, from the speed v to the speed w, in which sdd grows by 2 d, lasts T with
D = T (v + w) / 2 - T^2 d / 6; we call d its swing. Without swing sdd is constant, and sd^2 linear in s.
"""

from __future__ import annotations

import numpy as np

from trajcli.curves.piecewise import Array, PiecewisePolynomial, increasing


def feasible_ramps(grid: Array, x: Array, wanted: Array, share: float = 1.0) -> Array:
    """Return the swings (N,) that are wanted, or as much of them as leaves every speed positive.

    The speed between v and w is least where it bends down most, by at most d T / 4: with d D no more than the
    square of the mean of v and w it stays positive.

    Args:
        grid: Places, shape (N + 1,).
        x: sd^2 there, shape (N + 1,).
        wanted: Shape (N,).
        share: How much of the largest swing may be used.
    """
    return np.asarray(np.minimum(wanted, share * _mean(x) ** 2 / np.diff(grid)))


def durations(grid: Array, x: Array, swing: Array) -> Array:
    """Return the time each interval takes, shape (N,).

    Args:
        grid: Places, shape (N + 1,).
        x: sd^2 there; two neighbours must not both be zero.
        swing: As from `swings`, shape (N,).
    """
    lengths, mean = np.diff(grid), _mean(x)
    return np.asarray(2.0 * lengths / (mean + np.sqrt(mean**2 - 2.0 / 3.0 * swing * lengths)))


def distances_at_mean_speed(grid: Array, x: Array, swing: Array) -> Array:
    """Return how far the mean of both speeds would lead in the time of each interval, shape (N,).

    Args:
        grid: Places, shape (N + 1,).
        x: sd^2 there; two neighbours must not both be zero.
        swing: As from `swings`, shape (N,).
    """
    return durations(grid, x, swing) * _mean(x)


def pieces_of(grid: Array, x: Array, swing: Array) -> tuple[Array, Array]:
    """Return durations (N,) and coefficients (d + 1, N) of the pieces of the law, highest power first.

    The degree d is 3, or 2 where no interval has a swing.

    Args:
        grid: Places, shape (N + 1,).
        x: sd^2 there; two neighbours must not both be zero.
        swing: As from `swings`, shape (N,).
    """
    lasting, sd = durations(grid, x, swing), np.sqrt(x)
    rows = [0.5 * (np.diff(sd) / lasting - swing), sd[:-1], grid[:-1]]
    return lasting, np.stack([swing / (3.0 * lasting), *rows] if swing.any() else rows)


def law_of(grid: Array, x: Array, swing: Array | None = None) -> PiecewisePolynomial:
    """Return s(t), one piece for each interval, from t = 0 on.

    Args:
        grid: Places, shape (N + 1,).
        x: sd^2 there; two neighbours must not both be zero.
        swing: As from `swings`, shape (N,); zero unless given.
    """
    lasting, coefficients = pieces_of(grid, x, np.zeros(grid.size - 1) if swing is None else swing)
    times = np.concatenate([[0.0], np.cumsum(lasting)])
    return PiecewisePolynomial(increasing(times), coefficients[:, :, None])


def _mean(x: Array) -> Array:
    sd = np.sqrt(x)
    return np.asarray(0.5 * (sd[:-1] + sd[1:]))
