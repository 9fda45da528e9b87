"""Extremes of curves and their derivatives for all t, and critical points of polynomials.

The largest and smallest values of p^(m) on a piece lie at its ends or at roots of p^(m+1). A candidate is
always a point on the curve: one too many does no harm.

The roots of p^(j+1) cut a piece into intervals on which p^(j) is monotone, so an interval holds a root of
p^(j) exactly when the signs at its ends differ. One pass from the highest derivative down gives the critical
points of every order, without companion matrices. Roots closer to each other than rounding may be missed:
between them p^(j-1) changes by less than rounding.

Source: Collins and Loos, Polynomial real root isolation by differentiation (SYMSAC 1976).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trajcli.curves.piecewise import (
    Array,
    PiecewisePolynomial,
    control_points,
    derivative_coefficients,
    horner,
)
from trajcli.frozen import frozen

_STEP = 2.0**-53  # of a piece: a shorter step of the root finder changes nothing
_STEPS = 120  # twice what bisection alone needs, because at most every second step is not a bisection
_BLOCK = 2048  # parts of pieces looked at together: what is computed of them stays in the processor's cache
_PARTS = 32_768  # parts of pieces at a time: what is stored of them takes some 20 MB
_MANY = 64  # parts of pieces from which on it pays to look for roots only where control points leave room
_SAME = 1e-12  # of the largest value: peaks closer than this are one peak, and the earliest is named


@frozen
class Peaks:
    """Smallest and largest value of one derivative of a curve, each of shape (n,), or of several intervals.

    Attributes:
        low: Smallest value by component, both sides of every break counted.
        low_time: The earliest time of it, on the curve's own time.
        high: Largest value by component.
        high_time: The earliest time of it.
    """

    low: Array
    low_time: Array
    high: Array
    high_time: Array

    @property
    def magnitude(self) -> Array:
        """Largest absolute value by component, shape (n,)."""
        return np.maximum(np.abs(self.low), np.abs(self.high))


@frozen
class IntervalPeaks(Sequence[tuple[Peaks, ...]]):
    """Extremes on m intervals: for each one `Peaks` for each order, made when asked for.

    Attributes:
        of_orders: For each order those of all intervals, arrays of shape (m, n).
    """

    of_orders: tuple[Peaks, ...]

    def __len__(self) -> int:
        return len(self.of_orders[0].low)

    @overload
    def __getitem__(self, index: int) -> tuple[Peaks, ...]: ...

    @overload
    def __getitem__(self, index: slice) -> list[tuple[Peaks, ...]]: ...

    def __getitem__(self, index: int | slice) -> tuple[Peaks, ...] | list[tuple[Peaks, ...]]:
        if isinstance(index, slice):
            return [self[k] for k in range(*index.indices(len(self)))]
        return tuple(
            Peaks(p.low[index], p.low_time[index], p.high[index], p.high_time[index]) for p in self.of_orders
        )


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
) -> IntervalPeaks:
    """Return the extremes on each of several intervals, at little more than the price of one.

    Args:
        curve: May have no length.
        intervals: Shape (m, 2): start and end of each. At a break that is one of them only the piece inside
            counts; an interval of no length belongs to the piece that begins there.
        orders: Derivative orders, 0 for the value.

    Raises:
        ValueError: When an interval is not within the curve.
    """
    whole = np.asarray(intervals, dtype=np.float64).reshape(-1, 2)
    first, last = _pieces_of(curve, whole)
    counts = last - first + 1
    if counts.sum() <= _PARTS:
        return IntervalPeaks(_peaks_of(curve, whole, orders))
    cut, owner = _cut(curve, whole, first, counts)
    parts = np.cumsum(np.minimum(counts, _PARTS)[owner])
    blocks = np.split(cut, np.flatnonzero(np.diff(parts // _PARTS)) + 1)
    found = zip(*(_peaks_of(curve, block, orders) for block in blocks), strict=True)
    return IntervalPeaks(tuple(_of_owners(_concatenated(of_order), owner) for of_order in found))


def _cut(
    curve: PiecewisePolynomial, intervals: Array, first: NDArray[np.intp], counts: NDArray[np.intp]
) -> tuple[Array, NDArray[np.intp]]:
    """Return intervals cut at breaks, none with more parts than are looked at together, and whose each is."""
    cuts = -(-counts // _PARTS)
    owner = np.repeat(np.arange(counts.size), cuts)
    number = np.arange(owner.size) - (np.cumsum(cuts) - cuts)[owner]
    cut, piece = intervals[owner], first[owner] + number * _PARTS
    inner = number > 0
    cut[inner, 0] = curve.breaks[piece[inner]]
    cut[:-1][inner[1:], 1] = cut[1:][inner[1:], 0]
    return cut, owner


def _peaks_of(curve: PiecewisePolynomial, intervals: Array, orders: Sequence[int]) -> tuple[Peaks, ...]:
    """Return the extremes on intervals (m, 2) whose parts are looked at together, arrays of shape (m, n)."""
    windows = _windows(curve, intervals)
    ends, worth = _surveyed(curve, windows, orders)
    pairs = np.nonzero(worth)
    chosen, lengths = curve.coefficients[:, windows.piece[pairs[0]], pairs[1]], windows.length[pairs[0]]
    critical = critical_points(chosen[:, :, None], lengths, orders)
    return tuple(
        _extremes(at_ends, _within(derivative_coefficients(chosen, order), pairs, inside, windows), windows)
        for order, at_ends, inside in zip(orders, ends, critical, strict=True)
    )


def _of_owners(cuts: Peaks, owner: NDArray[np.intp]) -> Peaks:
    """Return the extremes of intervals from those of what they were cut into, arrays of shape (m, n)."""
    first = np.flatnonzero(np.diff(owner, prepend=-1))
    low, high = np.minimum.reduceat(cuts.low, first), np.maximum.reduceat(cuts.high, first)
    same = _SAME * np.maximum(np.abs(low), np.abs(high))
    at_low, at_high = cuts.low <= (low + same)[owner], cuts.high >= (high - same)[owner]
    low_time = np.minimum.reduceat(np.where(at_low, cuts.low_time, np.inf), first)
    high_time = np.minimum.reduceat(np.where(at_high, cuts.high_time, np.inf), first)
    return Peaks(low, low_time, high, high_time)


def _concatenated(parts: Sequence[Peaks]) -> Peaks:
    names = ("low", "low_time", "high", "high_time")
    low, low_time, high, high_time = (np.concatenate([getattr(p, name) for p in parts]) for name in names)
    return Peaks(low, low_time, high, high_time)


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
    extremes = []
    for order, inside in zip(orders, critical_points(coefficients, lengths, orders), strict=True):
        values = horner(derivative_coefficients(coefficients, order), _candidates(inside, start, end))
        extremes.append((values.min(axis=0), values.max(axis=0)))
    return extremes


def critical_points(coefficients: Array, lengths: Array, orders: Sequence[int]) -> list[Array]:
    """Return for each order all roots of the derivative after it, (k, w, n), ascending, in local time.

    Where there are fewer roots than the degree allows, other points of the piece stand in.

    Args:
        coefficients: Shape (degree + 1, w, n), highest power first.
        lengths: Shape (w,), none negative.
        orders: Derivative orders, 0 for the value.
    """
    roots = _chain(_normalised(coefficients, lengths), min(orders, default=0) + 1)
    nowhere = np.empty((0, *coefficients.shape[1:]))
    return [roots.get(order + 1, nowhere) * lengths[:, None] for order in orders]


def all_roots(coefficients: Array, lengths: Array) -> Array:
    """Return all roots of polynomials, (k, w, n), ascending, each from 0 to its own length.

    They are the critical points of the antiderivative; other points of the piece stand in for missing ones.

    Args:
        coefficients: Shape (degree + 1, w, n), highest power first.
        lengths: Shape (w,), none negative.
    """
    powers = np.arange(len(coefficients), 0, -1)[:, None, None]
    integral = np.concatenate([coefficients / powers, np.zeros((1, *coefficients.shape[1:]))])
    return critical_points(integral, lengths, (0,))[0]


def durations_above(coefficients: Array, lengths: Array, levels: Array) -> Array:
    """Return for how long polynomials are at or above a level, each from 0 to its own length, shape (w, n).

    Between neighbouring roots of the polynomial less the level, its middle says on which side it is.

    Args:
        coefficients: Shape (degree + 1, w, n), highest power first.
        lengths: Shape (w,), none negative.
        levels: Shape (n,).
    """
    above = np.array(coefficients)
    above[-1] -= levels
    roots = all_roots(above, lengths)
    shape = (1, *above.shape[1:])
    ends = np.broadcast_to(lengths[:, None], shape)
    knots = np.sort(np.concatenate([np.zeros(shape), np.clip(roots, 0.0, ends), ends]), axis=0)
    middles = (knots[1:] + knots[:-1]) / 2
    inside = np.where(horner(above, middles) >= 0, np.diff(knots, axis=0), 0.0)
    return np.asarray(inside.sum(axis=0))


def _normalised(coefficients: Array, lengths: Array) -> Array:
    """Return the polynomials in u = t / length, scaled: the largest coefficient from u^1 up becomes 1."""
    powers = lengths ** np.arange(coefficients.shape[0] - 1, -1, -1)[:, None]
    scaled = coefficients * powers[:, :, None]
    scaled[-1] = 0.0  # has no say in where derivatives vanish, and may be too large for the others' scale
    size = np.abs(scaled).max(axis=0)
    return scaled / np.where(size > 0, size, 1.0)


def _chain(coefficients: Array, lowest: int) -> dict[int, Array]:
    """Return for each j points (degree - j, w, n) in [0, 1], ascending: roots of derivative j and more."""
    degree = coefficients.shape[0] - 1
    roots: dict[int, Array] = {}
    for order in range(degree - 1, lowest - 1, -1):
        polynomial = derivative_coefficients(coefficients, order)
        closed = _linear if order == degree - 1 else _quadratic
        roots[order] = closed(polynomial) if order >= degree - 2 else _between(polynomial, roots[order + 1])
    return roots


def _linear(coefficients: Array) -> Array:
    """Return the roots (1, w, n) of polynomials of degree one, or the nearest points of their pieces."""
    slope, offset = coefficients
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        return _within_piece((-offset / slope)[None])


def _quadratic(coefficients: Array) -> Array:
    """Return both roots without cancellation; without real roots two points that are as good as any.

    Source: Press et al., Numerical Recipes (3rd ed.), section 5.6.
    """
    a, b, c = coefficients
    root = np.sqrt(np.maximum(b * b - 4.0 * a * c, 0.0))
    q = -0.5 * (b + np.copysign(root, b))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        return np.sort(_within_piece(np.stack([q / a, c / q])), axis=0)


def _within_piece(points: Array) -> Array:
    """Return the points within [0, 1]; what is no number becomes 0."""
    return np.clip(np.where(np.isnan(points), 0.0, points), 0.0, 1.0)


def _between(coefficients: Array, turns: Array) -> Array:
    """Return one point for each interval between the ends and `turns`: its root, or else its first end."""
    ends = np.zeros((1, *turns.shape[1:]))
    knots = np.concatenate([ends, turns, ends + 1.0])
    values = horner(coefficients, knots)
    signs = np.sign(values)
    slot, piece, joint = np.nonzero(signs[:-1] * signs[1:] < 0)
    roots = knots[:-1].copy()
    if slot.size:
        rising = signs[slot + 1, piece, joint]
        roots[slot, piece, joint] = _bracketed(
            coefficients[:, piece, joint] * rising,
            (knots[slot, piece, joint], knots[slot + 1, piece, joint]),
            (values[slot, piece, joint] * rising, values[slot + 1, piece, joint] * rising),
        )
    return roots


def _bracketed(coefficients: Array, ends: tuple[Array, Array], values: tuple[Array, Array]) -> Array:
    """Return the root of each polynomial (degree + 1, m) that rises through zero between its `ends`.

    Newton's step is taken where it stays inside the bracket and is at most half the step before it, else
    the bracket is halved. A polynomial is done when it is zero up to rounding, or the step is.
    """
    low, high = ends
    x = low + (high - low) * (values[0] / (values[0] - values[1]))
    step, roots, live = high - low, np.empty_like(x), np.arange(x.size)
    for _ in range(_STEPS):
        value, slope = _with_slope(coefficients, x)
        below = value < 0
        low, high = np.where(below, x, low), np.where(below, high, x)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            newton = x - value / slope
        fast = (newton >= low) & (newton <= high) & (np.abs(newton - x) <= 0.5 * np.abs(step))
        x, before = np.where(fast, newton, 0.5 * (low + high)), x
        step = x - before
        zero = np.abs(value) <= _STEP * np.abs(coefficients).sum(axis=0)
        roots[live] = np.where(zero, before, x)
        going = ~zero & (np.abs(step) > _STEP)
        if not going.any():
            break
        if not going.all():
            coefficients, live = coefficients[:, going], live[going]
            low, high, x, step = low[going], high[going], x[going], step[going]
    return roots


def _with_slope(coefficients: Array, x: Array) -> tuple[Array, Array]:
    value, slope = coefficients[0], np.zeros_like(x)
    for row in coefficients[1:]:
        slope = slope * x + value
        value = value * x + row
    return value, slope


@frozen
class _Windows:
    """The parts of pieces that make up the intervals; w of them in all, m intervals.

    Attributes:
        piece: Index of the piece, shape (w,).
        origin: Its first break, shape (w,).
        length: Of the whole piece, shape (w,).
        start: Where the part begins, absolute, shape (w,).
        end: Where it ends, shape (w,).
        first: Index of the first part of each interval, shape (m,).
        interval: Index of the interval of each part, shape (w,).
    """

    piece: NDArray[np.intp]
    origin: Array
    length: Array
    start: Array
    end: Array
    first: NDArray[np.intp]
    interval: NDArray[np.intp]


def _pieces_of(curve: PiecewisePolynomial, intervals: Array) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the first and the last piece of which each of the intervals (m, 2) has a part, (m,)."""
    start, end = intervals.T
    if not ((start >= curve.start) & (start <= end) & (end <= curve.end)).all():
        raise ValueError(f"interval outside the curve's domain [{curve.start!r}, {curve.end!r}]")
    low = np.clip(np.searchsorted(curve.breaks, start, "right") - 1, 0, curve.pieces - 1)
    return low, np.clip(np.searchsorted(curve.breaks, end, "left") - 1, low, curve.pieces - 1)


def _windows(curve: PiecewisePolynomial, intervals: Array) -> _Windows:
    start, end = intervals.T
    low, high = _pieces_of(curve, intervals)
    counts = high - low + 1
    first = np.cumsum(counts) - counts
    interval = np.repeat(np.arange(counts.size), counts)
    piece = np.arange(interval.size) + (low - first)[interval]
    origin = curve.breaks[piece]
    begins = np.maximum(origin, start[interval])
    ends = np.minimum(curve.breaks[piece + 1], end[interval])
    length = curve.breaks[piece + 1] - origin
    return _Windows(piece, origin, length, begins, ends, first, interval)


def _surveyed(
    curve: PiecewisePolynomial, windows: _Windows, orders: Sequence[int]
) -> tuple[Array, NDArray[np.bool_]]:
    """Return what stands at both ends of all parts, and where a peak may lie between them."""
    shape = (2, windows.piece.size, curve.dimension)
    ends, worth = np.empty((len(orders), *shape)), np.full(shape[1:], windows.piece.size < _MANY)
    few = bool(worth.all())
    begin, end = windows.start - windows.origin, windows.end - windows.origin
    for at_ends, order in zip(ends, orders, strict=True):
        hull = np.empty((0, *shape[1:]) if few else shape)
        for first in range(0, windows.piece.size, _BLOCK):
            block = slice(first, first + _BLOCK)
            rows = curve.coefficients[:, windows.piece[block]].transpose(0, 2, 1)  # long rows are fast
            derivative = derivative_coefficients(np.ascontiguousarray(rows), order)
            at_ends[0, block] = horner(derivative, begin[block]).T
            at_ends[1, block] = horner(derivative, end[block]).T
            if not few:
                points = control_points(derivative, windows.length[block])
                hull[0, block], hull[1, block] = points.min(axis=0).T, points.max(axis=0).T
        if not few:
            worth |= _leaves_room(hull, at_ends, windows)
    return ends, worth


def _leaves_room(hull: Array, at_ends: Array, windows: _Windows) -> NDArray[np.bool_]:
    """Return where the extremes of control points (2, w, n) are beyond all values at ends (2, w, n)."""
    low = np.minimum.reduceat(at_ends.min(axis=0), windows.first)[windows.interval]
    high = np.maximum.reduceat(at_ends.max(axis=0), windows.first)[windows.interval]
    rounding = _SAME * np.abs(hull).max(axis=0)
    return np.asarray((hull[0] < low + rounding) | (hull[1] > high - rounding))


@frozen
class _Within:
    """Candidates inside parts of pieces; c pairs of a part and a component have some.

    Attributes:
        pairs: Indices of part and component, each of shape (c,); no pair stands there twice.
        times: Absolute, shape (k, c).
        values: Shape (k, c).
    """

    pairs: tuple[NDArray[np.intp], ...]
    times: Array
    values: Array


def _within(
    coefficients: Array, pairs: tuple[NDArray[np.intp], ...], inside: Array, windows: _Windows
) -> _Within:
    """Return the candidates of pairs from polynomials (degree + 1, c) and critical points (k, c, 1)."""
    start, end, origin = (values[pairs[0]] for values in (windows.start, windows.end, windows.origin))
    local = np.clip(inside[:, :, 0], start - origin, end - origin)
    return _Within(pairs, np.minimum(local + origin, end), horner(coefficients, local))


def _extremes(ends: Array, within: _Within, windows: _Windows) -> Peaks:
    """Return extremes, arrays of shape (m, n), from values at ends (2, w, n) and within."""
    pairs, lowest, highest = within.pairs, ends.min(axis=0), ends.max(axis=0)
    lowest[pairs] = np.minimum(lowest[pairs], within.values.min(axis=0, initial=np.inf))
    highest[pairs] = np.maximum(highest[pairs], within.values.max(axis=0, initial=-np.inf))
    low, high = np.minimum.reduceat(lowest, windows.first), np.maximum.reduceat(highest, windows.first)
    same = _SAME * np.maximum(np.abs(low), np.abs(high))
    below, above = (low + same)[windows.interval], (high - same)[windows.interval]
    low_time = _earliest(ends <= below, within.values <= below[pairs], within, windows)
    high_time = _earliest(ends >= above, within.values >= above[pairs], within, windows)
    return Peaks(low, low_time, high, high_time)


def _earliest(
    at_ends: NDArray[np.bool_], inside: NDArray[np.bool_], within: _Within, windows: _Windows
) -> Array:
    """Return the earliest time of the candidates that are chosen, shape (m, n)."""
    times = np.where(at_ends[1], windows.end[:, None], np.inf)
    times[at_ends[0]] = np.broadcast_to(windows.start[:, None], times.shape)[at_ends[0]]
    first = np.where(inside, within.times, np.inf).min(axis=0, initial=np.inf)
    times[within.pairs] = np.minimum(times[within.pairs], first)
    return np.minimum.reduceat(times, windows.first)


def _candidates(inside: Array, start: Array, end: Array) -> Array:
    """Return the ends (w, 1) and the critical points (k, w, n) between them; one outside moves to an end."""
    shape = (1, *inside.shape[1:])
    ends = (np.broadcast_to(start, shape), np.broadcast_to(end, shape))
    return np.concatenate([ends[0], np.clip(inside, start, end), ends[1]])
