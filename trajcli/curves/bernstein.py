"""Bounds of polynomials from their control points, without roots.

On its interval a polynomial lies within the range of its Bernstein coefficients. The first and the last of
them are its values at the ends; the others are nearer to it the less it bends.

Source: Farouki, The Bernstein polynomial basis: a centennial retrospective, Computer Aided Geometric Design
29 (2012), section 3; Isaacson and Keller, Analysis of Numerical Methods (1966), section 6.3 (equidistant
nodes).
"""

from __future__ import annotations

from functools import cache
from math import comb, factorial

import numpy as np

from trajcli.curves.piecewise import Array

NODES_DEGREE = 8
"""Of the polynomial through values at nine equidistant nodes."""

BETWEEN_NODES = factorial(NODES_DEGREE) / 4 / NODES_DEGREE ** (NODES_DEGREE + 1)
"""Bounds the product of the distances from nine equidistant nodes of a piece of length 1."""


def control_points(coefficients: Array, lengths: Array) -> Array:
    """Return the Bernstein coefficients (degree + 1, ...) of polynomials, each from 0 to its own length.

    Args:
        coefficients: Shape (degree + 1, ...), highest power first.
        lengths: Broadcasts against the trailing shape.
    """
    degree = coefficients.shape[0] - 1
    points = coefficients[::-1].copy()
    power = np.ones_like(lengths)
    for k in range(1, degree + 1):
        power = power * lengths
        points[k] *= power / comb(degree, k)
    for k in range(1, degree + 1):
        points[k:] = points[k:] + points[k - 1 : -1]
    return points


@cache
def hull_matrices() -> tuple[Array, Array]:
    """Return what makes control points of values at nodes (9, 9), and those of both halves (2, 9, 9)."""
    n, x = NODES_DEGREE, np.linspace(0.0, 1.0, NODES_DEGREE + 1)[:, None]
    k = np.arange(n + 1)
    chosen = np.array([comb(n, j) for j in range(n + 1)], dtype=np.float64)
    hull = np.asarray(np.linalg.inv(chosen * x**k * (1.0 - x) ** (n - k)), dtype=np.float64)
    first = np.array([[comb(i, j) / 2**i for j in range(n + 1)] for i in range(n + 1)])
    return hull, np.stack([first, first[::-1, ::-1]])
