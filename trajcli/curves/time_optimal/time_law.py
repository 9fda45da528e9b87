"""Time law s(t) of given sd^2 on a grid: cubic pieces, in which sdd is linear in time.

A piece over the length D, from the speed v to the speed w, in which sdd grows by 2 d, lasts T with
D = T (v + w) / 2 - T^2 d / 6; d is the sdd ramp of the interval. Without it sdd is constant, and sd^2 linear
in s.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.operations import substituted
from trajcli.curves.piecewise import Array, PiecewisePolynomial, increasing, taylor_shift
from trajcli.frozen import frozen

_BLOCK = 1024  # intervals at a time, whose numbers stay in the processor's cache


@frozen
class LawPieces:
    """Pieces of a law s(t), each on its own time from 0 on.

    Attributes:
        durations: Shape (N,), s.
        coefficients: Shape (degree + 1, N), highest power first.
    """

    durations: Array
    coefficients: Array

    def chosen(self, which: NDArray[np.intp] | slice) -> LawPieces:
        """Return some of the pieces."""
        return LawPieces(self.durations[which], self.coefficients[:, which])

    def along(self, path: PiecewisePolynomial) -> Array:
        """Return the coefficients (degree + 1, n, N) of q(s(t)).

        Args:
            path: q(s) with n joints; each piece of the law lies within one of its pieces.
        """
        begins = self.coefficients[-1]
        piece = np.clip(np.searchsorted(path.breaks, begins, "right") - 1, 0, path.pieces - 1)
        local = np.ascontiguousarray(path.coefficients[:, piece].transpose(0, 2, 1))
        return substituted(taylor_shift(local, begins - path.breaks[piece]), self.coefficients[:-1])


def law_pieces(grid: Array, x: Array, ramps: Array) -> LawPieces:
    """Return the pieces of the law, one for each interval, of degree 3, or 2 where no interval has a ramp.

    Args:
        grid: Grid points, shape (N + 1,).
        x: sd^2 there; two neighbours must not both be zero.
        ramps: As from `feasible_ramps`, shape (N,).
    """
    durations, sd = interval_durations(grid, x, ramps), np.sqrt(x)
    rows = [0.5 * (np.diff(sd) / durations - ramps), sd[:-1], grid[:-1]]
    return LawPieces(durations, np.stack([ramps / (3.0 * durations), *rows] if ramps.any() else rows))


def law_of(grid: Array, x: Array, ramps: Array | None = None) -> PiecewisePolynomial:
    """Return s(t), one piece for each interval, from t = 0 on.

    Args:
        grid: Grid points, shape (N + 1,).
        x: sd^2 there; two neighbours must not both be zero.
        ramps: As from `feasible_ramps`, shape (N,); zero unless given.
    """
    return _law(law_pieces(grid, x, np.zeros(grid.size - 1) if ramps is None else ramps))


def law_and_trajectory(
    path: PiecewisePolynomial, pieces: LawPieces
) -> tuple[PiecewisePolynomial, PiecewisePolynomial]:
    """Return the law s(t) and the trajectory q(s(t)), from t = 0 on.

    Args:
        path: q(s) with n joints.
        pieces: Each within one piece of the path.
    """
    degree, count = path.degree * (pieces.coefficients.shape[0] - 1), pieces.durations.size
    coefficients = np.empty((degree + 1, count, path.dimension))
    for block in blocks(count):
        coefficients[:, block] = pieces.chosen(block).along(path).transpose(0, 2, 1)
    law = _law(pieces)
    return law, PiecewisePolynomial(law.breaks, coefficients)


def interval_durations(grid: Array, x: Array, ramps: Array) -> Array:
    """Return the time each interval takes, shape (N,).

    Args:
        grid: Grid points, shape (N + 1,).
        x: sd^2 there; two neighbours must not both be zero.
        ramps: As from `feasible_ramps`, shape (N,).
    """
    lengths, mean = np.diff(grid), _mean_speeds(x)
    return np.asarray(2.0 * lengths / (mean + np.sqrt(mean**2 - 2.0 / 3.0 * ramps * lengths)))


def distances_at_mean_speed(grid: Array, x: Array, ramps: Array) -> Array:
    """Return how far the mean of both speeds would lead in the time of each interval, shape (N,).

    Args:
        grid: Grid points, shape (N + 1,).
        x: sd^2 there; two neighbours must not both be zero.
        ramps: As from `feasible_ramps`, shape (N,).
    """
    return interval_durations(grid, x, ramps) * _mean_speeds(x)


def feasible_ramps(grid: Array, x: Array, wanted: Array, share: float = 1.0) -> Array:
    """Return the sdd ramps (N,) that are wanted, or as much of them as leaves every speed positive.

    The speed between v and w is least where it bends down most, by at most d T / 4: with d D no more than the
    square of the mean of v and w it stays positive.

    Args:
        grid: Grid points, shape (N + 1,).
        x: sd^2 there, shape (N + 1,).
        wanted: Shape (N,).
        share: How much of the largest ramp may be used.
    """
    return np.asarray(np.minimum(wanted, share * _mean_speeds(x) ** 2 / np.diff(grid)))


def blocks(count: int) -> list[slice]:
    """Return slices that cover so many intervals; the numbers of each stay in the processor's cache."""
    return [slice(first, first + _BLOCK) for first in range(0, count, _BLOCK)]


def _law(pieces: LawPieces) -> PiecewisePolynomial:
    """Return the pieces one after the other, from t = 0 on."""
    times = increasing(np.concatenate([[0.0], np.cumsum(pieces.durations)]))
    return PiecewisePolynomial(times, pieces.coefficients[:, :, None])


def _mean_speeds(x: Array) -> Array:
    """Return the mean of the speeds at both ends of each interval, shape (N,)."""
    sd = np.sqrt(x)
    return np.asarray(0.5 * (sd[:-1] + sd[1:]))
