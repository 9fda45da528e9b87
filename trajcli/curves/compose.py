"""Curves out of curves: merged breaks, scaled and reversed time, a law laid on a line, a rest at the end."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from trajcli.curves.piecewise import Array, PiecewisePolynomial, concatenate, increasing, taylor_shift

_ROUNDING = 4 * np.finfo(np.float64).eps  # of the largest time: what sums of phase durations may be apart
_REST = 1e-9  # of the peak velocity: less counts as standing still


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
    if end == start:
        return PiecewisePolynomial(curves[0].breaks, _stacked([curve.coefficients for curve in curves]))
    inner = [curve.breaks[1:-1] for curve in curves]
    owners = np.repeat(np.arange(len(curves)), [times.size for times in inner])
    times = np.concatenate(inner)
    order = np.lexsort((owners, times))
    united, place = _united(times[order], owners[order], apart)
    breaks = np.concatenate([[start], united, [end]])
    split = []
    for index, curve in enumerate(curves):
        starts = np.concatenate([[0], 1 + place[owners[order] == index]])
        piece = np.searchsorted(starts, np.arange(breaks.size - 1), "right") - 1
        offset = breaks[:-1] - curve.breaks[piece]
        offset[0] = 0.0
        split.append(taylor_shift(curve.coefficients[:, piece, :], offset[:, None]))
    return PiecewisePolynomial(breaks, _stacked(split))


def _united(times: Array, owners: np.ndarray, apart: float) -> tuple[Array, np.ndarray]:
    """Return the distinct times, and for each of `times` (sorted) the index of the one that stands for it."""
    distinct: list[float] = []
    place = np.empty(times.size, dtype=np.intp)
    members: set[int] = set()
    for k, (time, owner) in enumerate(zip(times.tolist(), owners.tolist(), strict=True)):
        if not distinct or time - distinct[-1] > apart or owner in members:
            distinct.append(time)
            members = set()
        members.add(owner)
        place[k] = len(distinct) - 1
    return np.array(distinct), place


def _stacked(coefficients: Sequence[Array]) -> Array:
    """Return coefficients (degree + 1, pieces, n_i) side by side, filled up to the highest degree."""
    rows = max(block.shape[0] for block in coefficients)
    filled = [np.pad(block, ((rows - block.shape[0], 0), (0, 0), (0, 0))) for block in coefficients]
    return np.concatenate(filled, axis=2)


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
    """Return the curve extended by a stretch in which its last velocity stays.

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
    breaks = np.array([curve.end, end])
    longer = concatenate([curve, PiecewisePolynomial(breaks, last[:, None, :])])
    return PiecewisePolynomial(np.append(longer.breaks[:-1], end), longer.coefficients)
