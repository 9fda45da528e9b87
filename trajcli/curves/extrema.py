"""Extremes of a curve and its derivatives, for all t and not at samples.

The largest and smallest values of p^(m) on a piece lie at its ends or at roots of p^(m+1). A candidate is
always a point on the curve: one too many does no harm.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trajcli.curves.critical import critical_points
from trajcli.curves.piecewise import Array, PiecewisePolynomial, derivative_coefficients, horner
from trajcli.frozen import frozen

_SAME = 1e-12  # of the largest value: peaks closer than this are one peak, and the earliest is named


@frozen
class Peaks:
    """Smallest and largest value of one derivative of a curve, each of shape (n,).

    Attributes:
        low: Smallest value by component, both sides of every break counted.
        low_time: The earliest place of it, on the curve's own time.
        high: Largest value by component.
        high_time: The earliest place of it.
    """

    low: Array
    low_time: Array
    high: Array
    high_time: Array

    @property
    def magnitude(self) -> Array:
        """Largest absolute value by component, shape (n,)."""
        return np.maximum(np.abs(self.low), np.abs(self.high))


def peaks(
    curve: PiecewisePolynomial,
    orders: Sequence[int] = (0, 1, 2, 3),
    start: float | None = None,
    end: float | None = None,
) -> tuple[Peaks, ...]:
    """Return the extremes of several derivatives of a curve, one `Peaks` for each order.

    Args:
        curve: May have no length.
        orders: Derivative orders, 0 for the value. All of them cost little more than the lowest.
        start: Where to begin to look; the curve's start unless given.
        end: Where to stop; the curve's end unless given.

    Raises:
        ValueError: When the interval is not within the curve.
    """
    interval = (curve.start if start is None else start, curve.end if end is None else end)
    return peaks_between(curve, [interval], orders)[0]


def peaks_between(
    curve: PiecewisePolynomial, intervals: ArrayLike, orders: Sequence[int] = (0, 1, 2, 3)
) -> list[tuple[Peaks, ...]]:
    """Return the extremes on each of several intervals, at little more than the price of one.

    Args:
        curve: May have no length.
        intervals: Shape (m, 2): start and end of each. At a break that is one of them only the piece inside
            counts; an interval of no length belongs to the piece that begins there.
        orders: Derivative orders, 0 for the value.

    Returns:
        For each interval one `Peaks` for each order.

    Raises:
        ValueError: When an interval is not within the curve.
    """
    windows = _windows(curve, np.asarray(intervals, dtype=np.float64).reshape(-1, 2))
    coefficients = curve.coefficients[:, windows.piece]
    critical = critical_points(coefficients, curve.lengths[windows.piece], orders)
    found = [
        _extremes(derivative_coefficients(coefficients, order), inside, windows)
        for order, inside in zip(orders, critical, strict=True)
    ]
    return [
        tuple(Peaks(*(values[k] for values in of_order)) for of_order in found)
        for k in range(windows.first.size)
    ]


def piece_extremes(
    coefficients: Array, lengths: Array, orders: Sequence[int] = (0, 1, 2, 3)
) -> list[tuple[Array, Array]]:
    """Return the extremes of polynomials that need not be one curve, each from 0 to its own length.

    Args:
        coefficients: Shape (degree + 1, w, n), highest power first.
        lengths: Shape (w,), none negative.
        orders: Derivative orders, 0 for the value.

    Returns:
        For each order the smallest and the largest value, each of shape (w, n).
    """
    start, end = np.zeros((lengths.size, 1)), lengths[:, None]
    found = []
    for order, inside in zip(orders, critical_points(coefficients, lengths, orders), strict=True):
        values = horner(derivative_coefficients(coefficients, order), _candidates(inside, start, end))
        found.append((values.min(axis=0), values.max(axis=0)))
    return found


@frozen
class _Windows:
    """The stretches of pieces that make up the intervals; w of them in all, m intervals.

    Attributes:
        piece: Index of the piece, shape (w,).
        origin: Its first break, shape (w,).
        start: Where the stretch begins, absolute, shape (w,).
        end: Where it ends, shape (w,).
        first: Index of the first stretch of each interval, shape (m,).
        interval: Index of the interval of each stretch, shape (w,).
    """

    piece: NDArray[np.intp]
    origin: Array
    start: Array
    end: Array
    first: NDArray[np.intp]
    interval: NDArray[np.intp]


def _windows(curve: PiecewisePolynomial, intervals: Array) -> _Windows:
    start, end = intervals.T
    if not ((start >= curve.start) & (start <= end) & (end <= curve.end)).all():
        raise ValueError(f"interval outside the curve's domain [{curve.start!r}, {curve.end!r}]")
    low = np.clip(np.searchsorted(curve.breaks, start, "right") - 1, 0, curve.pieces - 1)
    high = np.clip(np.searchsorted(curve.breaks, end, "left") - 1, low, curve.pieces - 1)
    counts = high - low + 1
    first = np.cumsum(counts) - counts
    interval = np.repeat(np.arange(counts.size), counts)
    piece = np.arange(interval.size) + (low - first)[interval]
    origin = curve.breaks[piece]
    begins = np.maximum(origin, start[interval])
    return _Windows(
        piece, origin, begins, np.minimum(curve.breaks[piece + 1], end[interval]), first, interval
    )


def _extremes(coefficients: Array, inside: Array, windows: _Windows) -> tuple[Array, Array, Array, Array]:
    """Return low, its time, high, its time, each (m, n), of the polynomials (degree + 1, w, n)."""
    start, end, origin = (values[:, None] for values in (windows.start, windows.end, windows.origin))
    local = _candidates(inside, start - origin, end - origin)
    values = horner(coefficients, local)
    low = np.minimum.reduceat(values.min(axis=0), windows.first)
    high = np.maximum.reduceat(values.max(axis=0), windows.first)
    same = _SAME * np.maximum(np.abs(low), np.abs(high))
    times = np.minimum(local + origin, end)
    times[-1] = end
    low_time = _earliest(values <= (low + same)[windows.interval], times, windows)
    high_time = _earliest(values >= (high - same)[windows.interval], times, windows)
    return low, low_time, high, high_time


def _earliest(chosen: NDArray[np.bool_], times: Array, windows: _Windows) -> Array:
    return np.minimum.reduceat(np.where(chosen, times, np.inf).min(axis=0), windows.first)


def _candidates(inside: Array, start: Array, end: Array) -> Array:
    """Return the ends (w, 1) and the critical points (k, w, n) between them; one outside moves to an end."""
    shape = (1, *inside.shape[1:])
    ends = (np.broadcast_to(start, shape), np.broadcast_to(end, shape))
    return np.concatenate([ends[0], np.clip(inside, start, end), ends[1]])
