"""Time law s(t) of given sd^2 and sdd on a grid: quartic pieces, in which sddd is linear in time.

A piece over the length D, from the speed v and the acceleration a to w and b, lasts T with
D = T (v + w) / 2 - T^2 (b - a) / 12. Where sdd is constant, sd^2 is linear in s, and the piece quadratic.

Source: Davis and Rabinowitz (1984), on corrections at the ends.
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

    def among(self, others: LawPieces) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
        """Return which of other pieces each may be, by where it begins, and whether it is, each (N,)."""
        index = np.searchsorted(others.coefficients[-1, 1:], self.coefficients[-1], "right")
        if self.coefficients.shape[0] != others.coefficients.shape[0]:
            return index, np.zeros(index.size, dtype=bool)
        same = (self.coefficients == others.coefficients[:, index]).all(axis=0)
        return index, same & (self.durations == others.durations[index])

    def along(self, path: PiecewisePolynomial) -> Array:
        """Return the coefficients (degree + 1, n, N) of q(s(t)).

        Args:
            path: q(s) with n joints; each piece of the law lies within one of its pieces.
        """
        begins = self.coefficients[-1]
        piece = np.clip(np.searchsorted(path.breaks, begins, "right") - 1, 0, path.pieces - 1)
        local = np.ascontiguousarray(path.coefficients[:, piece].transpose(0, 2, 1))
        return substituted(taylor_shift(local, begins - path.breaks[piece]), self.coefficients[:-1])


def law_pieces(grid: Array, x: Array, near: Array | None = None, far: Array | None = None) -> LawPieces:
    """Return the pieces of the law, one for each interval, of degree 4, or 2 where sdd is constant in each.

    Args:
        grid: Grid points, shape (N + 1,).
        x: sd^2 there; two neighbours must not both be zero.
        near: sdd at the near ends of the intervals, shape (N,); constant in each unless given.
        far: sdd at the far ends; where no law leads forward with both, sdd is constant instead.
    """
    v, D = np.sqrt(x), np.diff(grid)
    mean, u = 0.5 * (v[1:] + v[:-1]), np.diff(x) / (2.0 * D)
    near, far = u if near is None else near, u if far is None else far
    even = (near == u) & (far == u) | ~_leads_forward(mean, v, D, near, far)
    near, far = np.where(even, u, near), np.where(even, u, far)
    h = 2.0 * D / (mean + np.sqrt(np.where(even, mean**2, mean**2 - (far - near) * D / 3.0)))
    if even.all():
        return LawPieces(h, np.stack([0.5 * u, v[:-1], grid[:-1]]))
    rows = quartic_coefficients(h, grid, v, near, far)
    rows[:2, even] = 0.0
    return LawPieces(h, rows)


def quartic_coefficients(h: Array, s: Array, v: Array, near: Array, far: Array) -> Array:
    """Return the coefficients of pieces that last h (N,), highest power first, shape (5, N).

    Args:
        h: As states and accelerations ask for.
        s: At the nodes, shape (N + 1,).
        v: Speeds there.
        near: Accelerations at the near ends, shape (N,).
        far: At the far ends.
    """
    rise = 6.0 * np.diff(v) / h**2
    first, last = rise - (4.0 * near + 2.0 * far) / h, (2.0 * near + 4.0 * far) / h - rise
    return np.stack([(last - first) / (24.0 * h), first / 6.0, 0.5 * near, v[:-1], s[:-1]])


def _leads_forward(mean: Array, v: Array, D: Array, near: Array, far: Array) -> NDArray[np.bool_]:
    """Return where a quartic exists, and its speed has no control point below zero, shape (N,)."""
    under = mean**2 - (far - near) * D / 3.0
    h = 2.0 * D / (mean + np.sqrt(np.maximum(under, 0.0)))
    return np.asarray((under > 0.0) & (v[:-1] + near * h / 3.0 >= 0.0) & (v[1:] - far * h / 3.0 >= 0.0))


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


def blocks(count: int) -> list[slice]:
    """Return slices that cover so many intervals; the numbers of each stay in the processor's cache."""
    return [slice(first, first + _BLOCK) for first in range(0, count, _BLOCK)]


def _law(pieces: LawPieces) -> PiecewisePolynomial:
    """Return the pieces one after the other, from t = 0 on."""
    times = increasing(np.concatenate([[0.0], np.cumsum(pieces.durations)]))
    return PiecewisePolynomial(times, pieces.coefficients[:, :, None])
