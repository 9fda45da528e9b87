"""Straight segments and the parabolas between them, laid out as one curve."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.compose import merge_breaks
from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.frozen import frozen

_ROUNDING = 8 * np.finfo(np.float64).eps  # of the end: a straight piece this short is none


@frozen
class Knots:
    """The corners of a polyline in time, each rounded by a parabola centred on it.

    M corners of n joints; `times` and `blends` have one column where all joints share them, else n.

    Attributes:
        points: Index of the waypoint that each corner belongs to, shape (M,).
        times: Where the two lines of each corner meet, s, shape (M, 1) or (M, n).
        positions: The corner itself, shape (M, n).
        blends: Duration of the parabola, s, shape (M, 1) or (M, n); zero where the velocity does not change.
        velocities: Before the first corner, between corners, after the last, shape (M + 1, n).
    """

    points: NDArray[np.intp]
    times: Array
    positions: Array
    blends: Array
    velocities: Array

    @property
    def start(self) -> float:
        """Where the earliest first parabola begins, s."""
        return float((self.times[0] - self.blends[0] / 2).min())

    @property
    def end(self) -> float:
        """Where the latest last parabola ends, s."""
        return float((self.times[-1] + self.blends[-1] / 2).max())

    def curve(self, end: float) -> PiecewisePolynomial:
        """Return the curve from 0 to `end`, which are `start` and `end`, rounding apart.

        A joint whose own first parabola begins later comes in, and one whose last ends earlier goes out,
        with its velocity there.
        """
        columns = self.times.shape[1]
        if columns == 1:
            return self._laid_out(0, slice(None), end)
        return merge_breaks([self._laid_out(j, slice(j, j + 1), end) for j in range(columns)])

    def _laid_out(self, column: int, joints: slice, end: float) -> PiecewisePolynomial:
        """Return the curve of the joints that share one column of times."""
        time, velocity = self.times[:, column], self.velocities[:, joints]
        edges = self._edges(column, end)
        lengths = np.diff(edges)
        corner = np.clip(np.arange(lengths.size) - 1, 0, None) // 2
        coefficients = np.zeros((3, lengths.size, velocity.shape[1]))
        coefficients[1] = np.repeat(velocity, 2, axis=0)[: lengths.size]
        coefficients[2] = self.positions[corner, joints]
        coefficients[2] += coefficients[1] * (edges[:-1] - time[corner])[:, None]
        bent, parabolas = np.diff(velocity, axis=0), lengths[1::2, None]
        # over the length that rounding has left, so that the velocity is continuous however late it is
        np.divide(bent / 2, parabolas, out=coefficients[0, 1::2], where=parabolas > 0)
        kept = lengths > 0
        return PiecewisePolynomial(np.append(edges[:-1][kept], edges[-1]), coefficients[:, kept])

    def _edges(self, column: int, end: float) -> Array:
        """Return where the pieces line, parabola, line, ... parabola, line begin, and the end: (2M + 2,).

        A parabola is rounded outwards: its acceleration may be a limit, which rounding must not exceed.
        """
        time, half = self.times[:, column], self.blends[:, column] / 2
        low, high = np.nextafter(time - half, -np.inf), np.nextafter(time + half, np.inf)
        low, high = np.where(half > 0, [low, high], time)
        apart = _ROUNDING * end
        low[1:] = np.where(low[1:] - high[:-1] > apart, low[1:], high[:-1])
        low[0] = low[0] if low[0] > apart else 0.0
        high[-1] = high[-1] if end - high[-1] > apart else end
        return np.maximum.accumulate(
            np.concatenate([[0.0], np.stack([low, high], axis=1).reshape(-1), [end]])
        )
