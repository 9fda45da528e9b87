"""Deviation of a motion through points from the straight chords between them."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from trajcli.curves.extrema import peaks
from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.planners.fastest_through_points.segment_motion import PointMotion


def off_chords(motion: PointMotion, points: Array, velocity: Array) -> tuple[Array, Array]:
    """Return by how much each joint leaves the lines through neighbouring points, and when, each (n,).

    A position is compared with the point of the line that is nearest when each joint is measured by the time
    that it needs at its velocity limit.

    Args:
        motion: Of all joints.
        points: Shape (m, n).
        velocity: Bounds, shape (n, 2), perhaps infinite.
    """
    curve = motion.curve
    weight = 1 / np.abs(velocity).max(axis=1) ** 2
    middle = 0.5 * (curve.breaks[1:] + curve.breaks[:-1])
    segment = np.clip(np.searchsorted(motion.times, middle) - 1, 0, len(points) - 2)
    lines = np.array([after - before for before, after in pairwise(points)])
    squares = (lines * lines * weight).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        across = np.where(squares[:, None] > 0, lines * weight / squares[:, None], 0.0)
    coefficients = curve.coefficients.copy()
    coefficients[-1] -= points[segment]
    along = (coefficients * across[segment]).sum(axis=2)
    coefficients -= along[..., None] * lines[segment]
    (extremes,) = peaks(PiecewisePolynomial(curve.breaks, coefficients), (0,))
    high = extremes.high >= -extremes.low
    times = np.where(high, extremes.high_time, extremes.low_time)
    return extremes.magnitude, times - curve.start
