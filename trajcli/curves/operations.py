"""Operations on curves: merged breaks, scaled and reversed time, composition, extension, inverse of a law."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.extrema import all_roots, piece_extremes
from trajcli.curves.piecewise import (
    Array,
    PiecewisePolynomial,
    concatenate,
    distinct,
    horner,
    increasing,
    taylor_shift,
)

_ROUNDING = 4 * np.finfo(np.float64).eps  # of the largest time: what sums of phase durations may be apart
_DEGREE = 10  # of a composition: beyond it rounding grows
_NEAR = 1e6  # times rounding: a value of the law this near to a break may be one that it passes
_REST = 1e-9  # of the peak velocity: less counts as standing still
_STEPS = 60  # of bisection: a piece is divided to its last bit


def merge_breaks(curves: Sequence[PiecewisePolynomial]) -> PiecewisePolynomial:
    """Return the curve whose components are those of all `curves`, with the union of their breaks.

    Breaks of different curves that lie apart by rounding only (4 epsilon of the largest time) become one, so
    that no sliver pieces appear; short pieces that one curve has of its own stay.

    Raises:
        ValueError: When the curves do not cover the same interval.
    """
    start, end = min(curve.start for curve in curves), max(curve.end for curve in curves)
    apart = _ROUNDING * max(abs(start), abs(end))
    if any(curve.start - start > apart or end - curve.end > apart for curve in curves):
        raise ValueError(f"curves to merge must all cover [{start!r}, {end!r}]")
    columns = [(curve, k) for curve in curves for k in range(curve.dimension)]
    values = stacked([curve.coefficients[:, :, k, None] for curve, k in columns])
    return merge_pieces([curve.breaks for curve, _ in columns], values[:, :, 0])


def merge_pieces(breaks: Sequence[Array], coefficients: Array) -> PiecewisePolynomial:
    """Return what `merge_breaks` makes of curves of one variable over one interval.

    Args:
        breaks: Of n curves, each of shape (pieces + 1,).
        coefficients: Of the pieces of the first one, of the second one and so on, shape (degree + 1, total).
    """
    start, end = min(float(each[0]) for each in breaks), max(float(each[-1]) for each in breaks)
    counts = np.array([each.size - 1 for each in breaks])
    times = np.concatenate([each[1:-1] for each in breaks])
    owners = np.repeat(np.arange(len(breaks)), counts - 1)
    order = np.argsort(times, kind="stable")  # of equal times that of the first curve comes first
    times, owners = times[order], owners[order]
    united, index_of = _united(times, owners, _ROUNDING * max(abs(start), abs(end)))
    merged = np.concatenate([[start], united, [end]])
    piece = np.zeros((merged.size - 1, len(breaks)), dtype=np.intp)  # of each curve, on each piece of all
    piece[0] = np.cumsum(counts) - counts
    piece[index_of + 1, owners] = 1
    piece = piece.cumsum(axis=0)
    offsets = merged[:-1, None] - np.concatenate([each[:-1] for each in breaks])[piece]
    offsets[0] = 0.0
    return PiecewisePolynomial(merged, taylor_shift(coefficients[:, piece], offsets))


def _united(times: Array, owners: np.ndarray, apart: float) -> tuple[Array, np.ndarray]:
    """Return the times that are kept, and for each of `times` (sorted) the index of its representative."""
    if not (times[1:] - times[:-1] <= apart).any():
        return times, np.arange(times.size)
    kept: list[float] = []
    index_of = np.empty(times.size, dtype=np.intp)
    members: set[int] = set()
    for k, (time, owner) in enumerate(zip(times.tolist(), owners.tolist(), strict=True)):
        if not kept or time - kept[-1] > apart or owner in members:
            kept.append(time)
            members = set()
        members.add(owner)
        index_of[k] = len(kept) - 1
    return np.array(kept), index_of


def stacked(coefficients: Sequence[Array]) -> Array:
    """Return coefficients (degree + 1, pieces, n), one after the other, filled up to the highest degree."""
    rows = max(block.shape[0] for block in coefficients)
    filled = [
        np.concatenate([np.zeros((rows - block.shape[0], *block.shape[1:])), block])
        if block.shape[0] < rows
        else block
        for block in coefficients
    ]
    return np.concatenate(filled, axis=1)


def scale_time(curve: PiecewisePolynomial, factor: float) -> PiecewisePolynomial:
    """Return the curve that starts when `curve` does and takes `factor` times as long."""
    powers = np.arange(curve.degree, -1, -1)[:, None, None]
    breaks = curve.start + (curve.breaks - curve.start) * factor
    if curve.duration > 0:
        breaks = increasing(breaks)
    return PiecewisePolynomial(breaks, curve.coefficients / float(factor) ** powers)


def reverse(curve: PiecewisePolynomial) -> PiecewisePolynomial:
    """Return the curve run backwards over the same interval."""
    signs = (-1.0) ** np.arange(curve.degree, -1, -1)[:, None, None]
    at_ends = taylor_shift(curve.coefficients, curve.lengths[:, None])
    breaks = curve.start + (curve.end - curve.breaks[::-1])
    if curve.duration > 0:
        breaks = increasing(breaks)
    return PiecewisePolynomial(breaks, (signs * at_ends)[:, ::-1, :])


def along_line(start: Array, displacement: Array, law: PiecewisePolynomial) -> PiecewisePolynomial:
    """Return q(t) = start + displacement s(t).

    Args:
        start: Shape (n,).
        displacement: Shape (n,).
        law: s(t), of dimension 1.
    """
    coefficients = law.coefficients * displacement
    coefficients[-1] += start
    return PiecewisePolynomial(law.breaks, coefficients)


def compose(path: PiecewisePolynomial, law: PiecewisePolynomial) -> PiecewisePolynomial:
    """Return q(s(t)), whose breaks are those of the law and the times at which s passes breaks of the path.

    Args:
        path: q(s) of degree d1.
        law: s(t) of dimension 1 and degree d2, with d1 d2 at most 10.

    Raises:
        ValueError: When the degree would be above 10, or the law leaves the path.
    """
    if path.degree * law.degree > _DEGREE or law.dimension != 1:
        raise ValueError(
            f"a path of degree {path.degree} and a law of degree {law.degree} and dimension {law.dimension}: "
            f"dimension 1 and a product of at most {_DEGREE} are what can be composed exactly"
        )
    law = _split(law, _crossings(path, law))
    middle = horner(law.coefficients, 0.5 * law.lengths[:, None])[:, 0]
    piece = np.clip(np.searchsorted(path.breaks, middle, "right") - 1, 0, path.pieces - 1)
    outer = taylor_shift(
        path.coefficients[:, piece], (law.coefficients[-1, :, 0] - path.breaks[piece])[:, None]
    )
    return PiecewisePolynomial(law.breaks, substituted(outer, law.coefficients[:-1]))


def substituted(outer: Array, inner: Array) -> Array:
    """Return the polynomials p(t r(t)), shape (d1 d2 + 1, ...), highest power first.

    Args:
        outer: Of p, shape (d1 + 1, ...).
        inner: Of r, shape (d2, ...), which broadcasts against the trailing shape.
    """
    result = outer[:1]
    for row in outer[1:]:
        result = np.concatenate([_product(result, inner), row[None]])
    return result


def _crossings(path: PiecewisePolynomial, law: PiecewisePolynomial) -> Array:
    """Return the times inside pieces of the law at which it passes a break of the path."""
    low, high = (values[:, 0] for values in piece_extremes(law.coefficients, law.lengths, (0,))[0])
    apart = _ROUNDING * max(abs(path.start), abs(path.end))
    if low.min() < path.start - _NEAR * apart or high.max() > path.end + _NEAR * apart:
        raise ValueError(
            f"the law runs from {float(low.min())!r} to {float(high.max())!r}, "
            f"the path from {path.start!r} to {path.end!r}"
        )
    first = np.searchsorted(path.breaks, low + apart, "right")
    count = np.maximum(np.searchsorted(path.breaks, high - apart, "left") - first, 0)
    piece = np.repeat(np.arange(law.pieces), count)
    passed = path.breaks[np.arange(piece.size) + np.repeat(first - (np.cumsum(count) - count), count)]
    offset = law.coefficients[:, piece].copy()
    offset[-1, :, 0] -= passed
    local = all_roots(offset, law.lengths[piece])[:, :, 0]
    inside = (local > 0) & (local < law.lengths[piece])
    inside &= np.abs(horner(offset[:, :, 0], local)) <= _NEAR * apart  # the rest stands in for missing roots
    return np.asarray((law.breaks[piece] + local)[inside])


def cut(curve: PiecewisePolynomial, time: float) -> tuple[PiecewisePolynomial, PiecewisePolynomial]:
    """Return a curve up to a time within it, and from there on, both with the times of the curve.

    A time beside a break by rounding alone is that break.

    Raises:
        ValueError: When nothing is left of one of the two.
    """
    finer = _split(curve, np.array([time]))
    index = int(np.abs(finer.breaks - time).argmin())
    if not 0 < index < finer.pieces:
        raise ValueError(f"{time!r} is no time within [{curve.start!r}, {curve.end!r}]")
    return (
        PiecewisePolynomial(finer.breaks[: index + 1], finer.coefficients[:, :index]),
        PiecewisePolynomial(finer.breaks[index:], finer.coefficients[:, index:]),
    )


def _split(curve: PiecewisePolynomial, times: Array) -> PiecewisePolynomial:
    """Return the same curve with further breaks, save those that only rounding sets apart from others."""
    if not times.size:
        return curve
    apart = _ROUNDING * max(abs(curve.start), abs(curve.end))
    after = np.clip(np.searchsorted(curve.breaks, times), 1, curve.pieces)
    new = (times - curve.breaks[after - 1] > apart) & (curve.breaks[after] - times > apart)
    breaks = distinct(np.append(curve.breaks, times[new]))
    piece = np.searchsorted(curve.breaks, breaks[:-1], "right") - 1
    offset = breaks[:-1] - curve.breaks[piece]
    return PiecewisePolynomial(breaks, taylor_shift(curve.coefficients[:, piece], offset[:, None]))


def _product(a: Array, b: Array) -> Array:
    """Return the products of polynomials (d + 1, ...), highest power first."""
    result = np.zeros((a.shape[0] + b.shape[0] - 1, *np.broadcast_shapes(a.shape[1:], b.shape[1:])))
    for k, row in enumerate(b):
        result[k : k + a.shape[0]] += a * row
    return result


def hold_until(curve: PiecewisePolynomial, end: float) -> PiecewisePolynomial:
    """Return the curve extended by a rest in its last value.

    Args:
        curve: Ends with velocity zero.
        end: Not before the curve's end, rounding apart.

    Raises:
        ValueError: When the curve still moves at its end, or ends later than `end`.
    """
    velocity = np.abs(curve.piece_ends(1))
    if (velocity[1, -1] > _REST * velocity.max(axis=(0, 1))).any():
        raise ValueError(f"the curve still moves at its end, {curve.end!r}")
    return _extended(curve, end, curve.piece_ends()[1][-1:])


def coast_until(curve: PiecewisePolynomial, end: float) -> PiecewisePolynomial:
    """Return the curve extended by an interval in which its last velocity stays.

    Args:
        curve: Any.
        end: Not before the curve's end, rounding apart.

    Raises:
        ValueError: When the curve ends later than `end`.
    """
    return _extended(curve, end, np.stack([curve.piece_ends(order)[1][-1] for order in (1, 0)]))


def _extended(curve: PiecewisePolynomial, end: float, last: Array) -> PiecewisePolynomial:
    """Return the curve followed by one piece with coefficients `last` (degree + 1, n)."""
    gap, apart = end - curve.end, _ROUNDING * max(abs(curve.start), abs(end))
    if gap < -apart:
        raise ValueError(f"the curve ends at {curve.end!r}, after {end!r}")
    if gap <= apart:
        return curve
    return concatenate([curve, PiecewisePolynomial(np.array([curve.end, end]), last[:, None, :])])


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
