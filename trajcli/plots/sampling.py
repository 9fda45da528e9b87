"""Points of curves for drawing: both sides of each break, the extremes, and few enough between them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.extrema import critical_points
from trajcli.curves.piecewise import Array, PiecewisePolynomial, derivative_coefficients, horner

STEPS = 400
"""Points of a curve over its whole duration; more than a panel has pixels to tell apart."""

_BUCKETS = 1000  # of a long line, each drawn by its first, lowest, highest and last point


def local_times(curve: PiecewisePolynomial, steps: int = STEPS) -> tuple[NDArray[np.intp], Array]:
    """Return pieces (N,) and times (N,) since their breaks: evenly on each piece, both its ends included."""
    longest = curve.duration / steps if curve.duration > 0 else 1.0
    counts = np.maximum(np.ceil(curve.lengths / longest).astype(np.intp), 1) + 1
    piece = np.repeat(np.arange(curve.pieces), counts)
    first = np.repeat(np.cumsum(counts) - counts, counts)
    part = (np.arange(piece.size) - first) / (counts[piece] - 1)
    return piece, part * curve.lengths[piece]


def component_points(curve: PiecewisePolynomial, order: int, component: int) -> tuple[Array, Array]:
    """Return times (N,) and values (N,) that draw one component of a derivative, its extremes included.

    A jump stands there as two points of one time. Straight pieces have no points but their ends.
    """
    coefficients = curve.coefficients[:, :, component : component + 1]
    derivative = derivative_coefficients(coefficients, order)[:, :, 0]
    straight = derivative.shape[0] <= 2 or not derivative[:-2].any()
    if straight:
        piece = np.repeat(np.arange(curve.pieces), 2)
        local = np.stack([np.zeros(curve.pieces), curve.lengths], axis=1).reshape(-1)
    else:
        piece, local = local_times(curve)
        inside = critical_points(coefficients, curve.lengths, [order])[0][:, :, 0]
        piece = np.concatenate([piece, np.tile(np.arange(curve.pieces), len(inside))])
        local = np.concatenate([local, inside.reshape(-1)])
        ordered = np.lexsort((local, piece))
        piece, local = piece[ordered], local[ordered]
    times = np.minimum(curve.breaks[piece] + local, curve.breaks[piece + 1])
    return without_repeats(times, horner(derivative[:, piece], local))


def without_repeats(x: Array, y: Array) -> tuple[Array, Array]:
    """Return the points (N,) without those that repeat the one before."""
    new = np.append(True, (np.diff(x) != 0) | (np.diff(y) != 0))[: x.size]
    return x[new], y[new]


def thinned(x: Array, y: Array, buckets: int = _BUCKETS) -> tuple[Array, Array]:
    """Return a line that looks like the points (N,) of increasing x: of many, all extremes are kept.

    Source: Jugel, Jerzak, Hackenbroich and Markl, M4: a visualization-oriented time series data aggregation,
    PVLDB 7 (2014).
    """
    if x.size <= 4 * buckets:
        return x, y
    edges = np.linspace(0, x.size, buckets + 1).astype(np.intp)
    kept = [edges[:-1], edges[1:] - 1]
    width = int(np.diff(edges).max())
    # buckets differ in length by one: the last column of a short one repeats its last point
    columns = np.minimum(edges[:-1, None] + np.arange(width), edges[1:, None] - 1)
    kept += [columns[np.arange(buckets), choose(y[columns], axis=1)] for choose in (np.argmin, np.argmax)]
    rows = np.unique(np.concatenate(kept))
    return x[rows], y[rows]
