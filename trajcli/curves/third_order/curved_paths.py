"""Continuous curvature of paths: polylines with rounded corners, and curvature at the ends.

Around a corner the slope goes from m0 to m1 over the length L, and q'' is a triangle: zero where the straight
parts begin, 2 (m1 - m0) / L in the middle. The curve passes beside the corner by (m1 - m0) L / 12.

For the curvature at an end the piece there is replaced by three cubics: over thirds of it q''' is constant,
and the three values follow from q, q' and q'' at both its ends.
"""

from __future__ import annotations

import numpy as np

from trajcli.curves.operations import reverse
from trajcli.curves.piecewise import Array, PiecewisePolynomial

BESIDE = 1.0 / 12.0
"""Of the change of slope over the length of a blend: the distance from the corner."""


def rounded_polyline(s: Array, points: Array, lengths: Array) -> tuple[PiecewisePolynomial, Array]:
    """Return the curve, and how far it passes from each point, shape (m, n).

    Args:
        s: Parameter at each of m points, shape (m,), strictly increasing.
        points: Shape (m, n).
        lengths: Of the blend around each point, zero at both ends, shape (m,); two neighbours leave room
            between them.
    """
    slopes = np.diff(points, axis=0) / np.diff(s)[:, None]
    turns = np.zeros_like(points)
    turns[1:-1] = np.diff(slopes, axis=0)
    round_at = np.flatnonzero((lengths > 0) & turns.any(axis=1))
    half = np.zeros_like(s)
    half[round_at] = 0.5 * lengths[round_at]
    starts = s[:-1] + half[:-1]
    straight = np.stack(
        [np.zeros_like(slopes), np.zeros_like(slopes), slopes, points[:-1] + slopes * half[:-1, None]]
    )
    pieces = [(starts, straight)]
    if round_at.size:
        at, turned = points[round_at], turns[round_at]
        pieces += _blends(s[round_at], at, turned, half[round_at], slopes[round_at - 1])
    begins = np.concatenate([begin for begin, _ in pieces])
    order = np.argsort(begins, kind="stable")
    coefficients = np.concatenate([each for _, each in pieces], axis=1)[:, order]
    curve = PiecewisePolynomial(np.append(begins[order], s[-1]), coefficients)
    return curve, np.abs(turns) * (2.0 * half * BESIDE)[:, None]


def _blends(s: Array, points: Array, turns: Array, half: Array, slopes: Array) -> list[tuple[Array, Array]]:
    """Return where both halves of the blends begin, and their coefficients (4, k, n)."""
    h, length = half[:, None], 2.0 * half[:, None]
    nothing = np.zeros_like(turns)
    third = 2.0 * turns / (3.0 * length**2)
    rising = np.stack([third, nothing, slopes, points - slopes * h])
    middle = points + turns * length * BESIDE
    falling = np.stack([-third, turns / length, slopes + 0.5 * turns, middle])
    return [(s - half, rising), (s, falling)]


_EFFECT = np.array([[19.0 / 6.0, 7.0 / 6.0, 1.0 / 6.0], [2.5, 1.5, 0.5], [1.0, 1.0, 1.0]])
"""Of q''' in each third on q, q' and q'' at the end, in powers of the length of a third."""


def with_end_curvature(
    path: PiecewisePolynomial, start: Array | None, end: Array | None
) -> PiecewisePolynomial:
    """Return the path with the given q'' (n,) at its start and at its end; None leaves it as it is.

    Args:
        path: q(s) of degree at most 3.
        start: Second derivative at the start.
        end: Second derivative at the end.
    """
    if start is not None:
        path = _with_start_curvature(path, start)
    if end is not None:
        path = reverse(_with_start_curvature(reverse(path), end))
    return path


def _with_start_curvature(path: PiecewisePolynomial, curvature: Array) -> PiecewisePolynomial:
    length = float(path.lengths[0])
    third = length / 3.0
    q, slope = path.evaluate(path.start), path.evaluate(path.start, 1)
    wanted = [path.evaluate(path.breaks[1], order, side="left") for order in range(3)]
    free = [
        wanted[0] - q - slope * length - 0.5 * curvature * length**2,
        wanted[1] - slope - curvature * length,
        wanted[2] - curvature,
    ]
    scaled = np.stack([each / third**power for each, power in zip(free, (3, 2, 1), strict=True)])
    pieces = []
    for jerk in np.linalg.solve(_EFFECT, scaled):
        pieces.append(np.stack([jerk / 6.0, 0.5 * curvature, slope, q]))
        q = q + slope * third + 0.5 * curvature * third**2 + jerk * third**3 / 6.0
        slope = slope + curvature * third + 0.5 * jerk * third**2
        curvature = curvature + jerk * third
    breaks = path.start + third * np.arange(3)
    others = path.coefficients[:, 1:]
    others = np.concatenate([np.zeros((4 - len(others), *others.shape[1:])), others])
    return PiecewisePolynomial(
        np.concatenate([breaks, path.breaks[1:]]), np.concatenate([np.stack(pieces, axis=1), others], axis=1)
    )
