"""When an increasing function of time reaches given values."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array, PiecewisePolynomial, horner

_STEPS = 60  # of bisection: a piece is divided to its last bit


def times_at(law: PiecewisePolynomial, values: Array) -> Array:
    """Return the earliest times (k,) at which s(t), which never decreases, reaches the values (k,).

    Values outside the law's range are taken to its ends.

    Args:
        law: Of dimension 1.
        values: Shape (k,).
    """
    reached = np.maximum.accumulate(np.append(law.coefficients[-1, :, 0], law.piece_ends()[1][-1]))
    wanted = np.clip(values, reached[0], reached[-1])
    piece = np.clip(np.searchsorted(reached, wanted, "left") - 1, 0, law.pieces - 1)
    times = np.where(wanted == reached[0], law.start, law.breaks[piece + 1])
    inside = np.flatnonzero((wanted != reached[0]) & (wanted != reached[piece + 1]))
    if inside.size:
        times[inside] = _times_within(law, wanted[inside], piece[inside])
    return times


def _times_within(law: PiecewisePolynomial, values: Array, piece: NDArray[np.intp]) -> Array:
    """Return the times (k,) at which the values (k,) are reached in the given pieces (k,)."""
    coefficients = law.coefficients[:, piece, 0].copy()
    coefficients[-1] -= values
    low, high = np.zeros(values.size), law.lengths[piece]
    for _ in range(_STEPS):
        middle = 0.5 * (low + high)
        below = horner(coefficients, middle) < 0
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return np.asarray(law.breaks[piece] + high)
