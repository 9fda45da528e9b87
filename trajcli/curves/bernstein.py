"""Bounds of polynomials from their control points, without roots.

On its interval a polynomial lies within the range of its Bernstein coefficients. The first and the last of
them are its values at the ends; the others are nearer to it the less it bends.

Source: Farouki, The Bernstein polynomial basis: a centennial retrospective, Computer Aided Geometric Design
29 (2012), section 3.
"""

from __future__ import annotations

from math import comb

import numpy as np

from trajcli.curves.piecewise import Array


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
