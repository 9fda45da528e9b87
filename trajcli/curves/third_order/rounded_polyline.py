"""Polylines whose corners are rounded with continuous curvature.

Around a corner the slope goes from m0 to m1 over the length L, and q'' is a triangle: zero where the straight
parts begin, 2 (m1 - m0) / L in the middle. The curve passes beside the corner by (m1 - m0) L / 12.
"""

from __future__ import annotations

import numpy as np

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
        at, turned, room = points[round_at], turns[round_at], half[round_at]
        pieces += _blends(s[round_at], at, turned, room, slopes[round_at - 1])
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
