"""Paths, bounds and judgements that the tests of time-optimal motions share."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline

from trajcli.curves.extrema import peaks
from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.curves.time_optimal.constraints import ConstraintRows
from trajcli.curves.time_optimal.parameterization import TimeOptimalMotion
from trajcli.curves.time_optimal.time_law import LawPieces

TOLERANCE = 1e-9


def symmetric(*limits: float) -> np.ndarray:
    return np.array([[-limit, limit] for limit in limits], dtype=float)


def polyline(points, s=None) -> PiecewisePolynomial:
    """Return straight segments through points (m, n), at s = 0, 1, 2 ... unless given."""
    points = np.asarray(points, dtype=float)
    s = np.arange(len(points), dtype=float) if s is None else np.asarray(s, dtype=float)
    slopes = np.diff(points, axis=0) / np.diff(s)[:, None]
    return PiecewisePolynomial(s, np.stack([slopes, points[:-1]]))


def spline(waypoints, s=None, **options) -> PiecewisePolynomial:
    """Return scipy's cubic spline through waypoints (m, n), from s = 0 to 1 unless given."""
    s = np.linspace(0.0, 1.0, len(waypoints)) if s is None else s
    found = CubicSpline(s, waypoints, **options)
    return PiecewisePolynomial(found.x, found.c)


def random_bounds(rng, joints: int) -> tuple[np.ndarray, np.ndarray]:
    """Return velocity and acceleration bounds, each direction with its own."""
    return tuple(np.array([-1.0, 1.0]) * rng.uniform(low, 3 * low, (joints, 2)) for low in (1.0, 2.0))


def over(
    trajectory: PiecewisePolynomial, velocity: np.ndarray, acceleration: np.ndarray
) -> tuple[float, float]:
    """Return the exact peaks of velocity and acceleration as multiples of their bounds."""
    found = peaks(trajectory, (1, 2))
    return tuple(
        float(np.maximum(peak.high / bounds[:, 1], peak.low / bounds[:, 0]).max())
        for peak, bounds in zip(found, (velocity, acceleration), strict=True)
    )


def dense(law: LawPieces) -> np.ndarray:
    """Return s, sd and sdd at 401 times of each piece, shape (3, 401, N), from numpy's own polynomials."""
    t = np.linspace(0.0, 1.0, 401)[:, None] * law.durations
    rows = []
    for k, column in enumerate(law.coefficients.T):
        polynomial = np.poly1d(column)
        rows.append([polynomial.deriv(order)(t[:, k]) for order in range(3)])
    return np.array(rows).transpose(1, 2, 0)


class SpeedCap:
    """A limit of sd by s; it is looked at densely between grid points."""

    estimate, bounds_sdd = 1.0, False

    def __init__(self, limit):
        self.limit = limit

    def rows(self, s, side):
        nothing = np.empty((s.size, 0))
        return ConstraintRows(nothing, nothing, nothing, self.limit(s) ** 2)

    def largest(self, s, side):
        return self.limit(s) ** 2

    def shortest(self, s):
        return np.zeros(s.size - 1)

    def excess(self, law):
        s, sd, _ = dense(law)
        used = (sd / self.limit(s.reshape(-1)).reshape(s.shape)).max(axis=0)
        return np.stack([used, np.zeros_like(used)])


def assert_motion(found: TimeOptimalMotion, path: PiecewisePolynomial, velocity, acceleration) -> None:
    """It follows the path from end to end, is smooth and keeps its limits for all t."""
    assert max(over(found.trajectory, velocity, acceleration)) <= 1.0 + TOLERANCE
    trajectory, law = found.trajectory, found.law
    t = np.linspace(0.0, trajectory.end, 997)
    s = np.clip(law.evaluate(t)[:, 0], path.start, path.end)
    size = np.abs(path.coefficients[-1]).max() + 1.0
    assert np.abs(trajectory.evaluate(t) - path.evaluate(s)).max() <= 1e-12 * size
    begins, ends = trajectory.piece_ends(1)
    assert np.abs(begins[1:] - ends[:-1]).max() <= 1e-9 * np.abs(begins).max()
    assert (np.diff(law.evaluate(t)[:, 0]) >= -1e-12 * path.duration).all()
    np.testing.assert_allclose(trajectory.evaluate(0.0), path.evaluate(path.start), atol=1e-12 * size)
    np.testing.assert_allclose(
        trajectory.evaluate(trajectory.end), path.evaluate(path.end), atol=1e-12 * size
    )
