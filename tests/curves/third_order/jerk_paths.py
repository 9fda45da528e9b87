"""Paths and limits of the jerk-limited tests, and their judge: exact extremes of every piece."""

import numpy as np
from scipy.interpolate import CubicSpline

from trajcli.curves.extrema import piece_extremes
from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.curves.third_order.parameterization import jerk_limited_time_optimal

PANDA = (
    np.array([2.175, 2.175, 2.175, 2.175, 2.61, 2.61, 2.61]),
    np.array([15, 7.5, 10, 12.5, 15, 20, 20.0]),
    np.array([7500, 3750, 5000, 6250, 7500, 10000, 10000.0]),
)
"""Velocity, acceleration and jerk of a Panda."""


def both(limits):
    """Return bounds (n, 2) alike in both directions."""
    return np.stack([-np.asarray(limits), np.asarray(limits)], axis=1)


def spline(s, points):
    """Return scipy's not-a-knot spline."""
    made = CubicSpline(s, points, bc_type="not-a-knot" if len(s) > 3 else "natural")
    return PiecewisePolynomial(made.x, np.ascontiguousarray(made.c))


def polyline(points):
    """Return straight segments, a unit of s for each unit of length."""
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    return PiecewisePolynomial(s, np.stack([np.diff(points, axis=0) / np.diff(s)[:, None], points[:-1]]))


def copp_problem(seed):
    """Return path, velocity, acceleration and jerk by the rule of COPP's published data set."""
    random = np.random.default_rng(seed)
    points = random.uniform(-0.5, 0.5, (50, 7))
    limits = [size * random.uniform(0.9, 1.1, 7) for size in (1, 5, 50)]
    return spline(np.linspace(0, 1, 50), points), *limits


def judged(path, velocity, acceleration, jerk, **ends):
    """Return the motion within bounds (n, 2), once every limit was found kept for all t, and q to be C2."""
    motion = jerk_limited_time_optimal(path, velocity, acceleration, jerk, **ends)
    q = motion.trajectory
    rows = np.ascontiguousarray(q.coefficients)
    for (low, high), limits in zip(
        piece_extremes(rows, q.lengths, (1, 2, 3)), (velocity, acceleration, jerk), strict=True
    ):
        assert (high <= limits[:, 1] * (1 + 1e-9)).all()
        assert (low >= limits[:, 0] * (1 + 1e-9)).all()
    for order in range(3):
        begins, finishes = q.piece_ends(order)
        np.testing.assert_allclose(begins[1:], finishes[:-1], rtol=0, atol=1e-7)
        if order and not ends:
            np.testing.assert_allclose([begins[0], finishes[-1]], 0.0, atol=1e-7)
    s = motion.law.evaluate(np.linspace(0, q.duration, 200))[:, 0]
    times = np.linspace(0, q.duration, 200)
    np.testing.assert_allclose(q.evaluate(times), path.evaluate(s.clip(path.start, path.end)), atol=1e-9)
    assert (np.diff(s) >= -1e-12).all()
    return motion
