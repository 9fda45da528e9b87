"""Geometric path of a motion: its points by arc length in joint space, without its times.

A motion passes the same points however fast it is. Points at even distances along it are joined by a cubic
spline of continuous curvature; where the motion turns back or turns sharply, the path has a corner at which
every motion stops.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array, PiecewisePolynomial, concatenate
from trajcli.curves.splines.cubic import not_a_knot
from trajcli.frozen import frozen

_DENSE = 8192  # times at which a curve is looked at
_FEWEST, _MOST = 64, 1024  # knots of a path
_NEAR = 1e-6  # rad or m: a path that misses the motion by less needs no more knots
_CLOSE = 2e-5  # of the length: points that are as near to each other are one
_SHARP = 0.5  # cosine of the angle by which a path turns at a corner
_SHORTEST = 1e-9  # rad or m: what is shorter is no motion


@frozen
class GeometricPath:
    """A path in joint space.

    Attributes:
        path: q(s) by the length of its chords, from 0, n joints; not smooth at its stops.
        stops: The s of its corners, ends not counted, shape (k,).
        deviation: Largest distance from the motion, rad or m in the joint space.
    """

    path: PiecewisePolynomial
    stops: Array
    deviation: float


def path_of_curve(curve: PiecewisePolynomial) -> GeometricPath | None:
    """Return the path of a curve q(t); None where it does not move."""
    between = np.linspace(0.0, 1.0, max(2, _DENSE // curve.pieces + 1))[:-1]
    times = (curve.breaks[:-1, None] + curve.lengths[:, None] * between).reshape(-1)
    return path_of_points(curve.evaluate(np.append(times, curve.end)))


def path_of_points(points: Array) -> GeometricPath | None:
    """Return the path through dense points (N, n), the first and last included; None where all are one."""
    if len(points) < 2 or float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum()) <= _SHORTEST:
        return None
    points = _thinned(points)
    if len(points) < 2:
        return None
    corners = _corners(points)
    ends = [0, *corners.tolist(), len(points) - 1]
    parts, deviation = [], 0.0
    for low, high in pairwise(ends):
        part, missed = _smooth(points[low : high + 1])
        parts.append(part)
        deviation = max(deviation, missed)
    lengths = np.cumsum([part.end for part in parts])
    return GeometricPath(concatenate(parts), lengths[:-1], deviation)


def _thinned(points: Array) -> Array:
    """Return the points without those that are too near to the one that was kept before."""
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    nearest = max(_CLOSE * float(lengths.sum()), _SHORTEST)
    kept, since = [0], 0.0
    for index, length in enumerate(lengths.tolist(), 1):
        since += length
        if since >= nearest:
            kept.append(index)
            since = 0.0
    if kept[-1] != len(points) - 1:
        kept[-1 if len(kept) > 1 else len(kept) :] = [len(points) - 1]
    return points[kept]


def _corners(points: Array) -> NDArray[np.intp]:
    """Return the indices of the points at which the path turns sharply."""
    chords = np.diff(points, axis=0)
    chords = chords / np.linalg.norm(chords, axis=1)[:, None]
    cosines = np.einsum("ij,ij->i", chords[1:], chords[:-1])
    return np.flatnonzero(cosines < _SHARP) + 1


def _smooth(points: Array) -> tuple[PiecewisePolynomial, float]:
    """Return a spline through enough of the points, and by how much it misses the others."""
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    count = _FEWEST
    while True:
        wanted = np.linspace(0.0, s[-1], min(count, len(points)))
        chosen = np.unique(np.clip(np.searchsorted(s, wanted), 0, len(points) - 1))
        chosen[0], chosen[-1] = 0, len(points) - 1
        knots = points[np.unique(chosen)]
        chords = np.linalg.norm(np.diff(knots, axis=0), axis=1)
        spline = not_a_knot(np.concatenate([[0.0], np.cumsum(chords)]), knots)
        missed = _distance(spline, s[np.unique(chosen)], s, points)
        if missed <= _NEAR or count >= _MOST or len(knots) >= len(points):
            return spline, missed
        count *= 2


def _distance(spline: PiecewisePolynomial, at_knots: Array, s: Array, points: Array) -> float:
    """Return the largest distance of points from a spline, across its direction."""
    parameters = np.clip(np.interp(s, at_knots, spline.breaks), 0.0, spline.end)
    on_path, along = spline.evaluate_orders(parameters, (0, 1)).transpose(1, 0, 2)
    away = points - on_path
    size = np.maximum(np.einsum("ij,ij->i", along, along), 1e-300)
    away = away - (np.einsum("ij,ij->i", away, along) / size)[:, None] * along
    return float(np.linalg.norm(away, axis=1).max())
