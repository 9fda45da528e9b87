"""Hermite polynomials: those of degree 2k - 1 with k given derivatives at both ends.

k = 2, 3, 4, 5 are the cubic, quintic, septic and nonic of the textbooks. In normalised time u = t / T, with
Taylor coefficients a_i at u = 0 and e_i at u = 1, the polynomial is

    p(u) = sum_{i<k} a_i u^i + u^k r(u),     deg r = k - 1,

and the Taylor coefficients of u^k r at u = 1 are c_i = e_i - sum_j C(j, i) a_j. Multiplying their series by
that of u^-k = sum_m (-1)^m C(k + m - 1, m) (u - 1)^m gives r around u = 1; a shift gives it around 0. All
matrices are integer, so a boundary value enters with its own rounding error and no other.

Source: Biagiotti and Melchiorri (2008), section 2.1.
"""

from __future__ import annotations

from functools import cache
from math import comb, factorial

import numpy as np

from trajcli.curves.piecewise import Array


def hermite_coefficients(start: Array, end: Array, duration: Array) -> Array:
    """Return the coefficients (2k, ...) of the polynomials that join `start` to `end`.

    Args:
        start: Shape (k, ...): derivatives of order 0 to k - 1 at t = 0.
        end: Shape (k, ...): the same at t = duration.
        duration: Positive; broadcasts against the trailing shape.
    """
    k = start.shape[0]
    powers = np.empty((2 * k, *start.shape[1:]))
    for i in range(2 * k):
        powers[i] = duration**i
    factorials = np.array([factorial(i) for i in range(k)]).reshape(-1, *([1] * (start.ndim - 1)))
    low = start / factorials
    a, e = low * powers[:k], end / factorials * powers[:k]
    displacement = e - a
    from_start, from_end = _matrices(k)
    high = matrix_times_rows(from_end, displacement) + matrix_times_rows(from_start, a[1:])
    return np.concatenate([high[::-1] / powers[k:][::-1], low[::-1]])


def matrix_times_rows(matrix: Array, rows: Array) -> Array:
    """Return the matrix times rows (k, ...), summed in one order: BLAS would sum as memory happens to lie."""
    result = np.zeros((matrix.shape[0], *rows.shape[1:]))
    for column, row in zip(matrix.T, rows, strict=True):
        result += column.reshape(-1, *([1] * row.ndim)) * row
    return result


@cache
def _matrices(k: int) -> tuple[Array, Array]:
    """Return (from_start (k, k-1), from_end (k, k)) with r = from_start a[1:] + from_end (e - a).

    Writing e as a + (e - a) keeps the position out of the product: only the displacement is multiplied.
    """
    series = [(-1) ** m * comb(k + m - 1, m) for m in range(k)]
    inverse = np.array([[series[i - m] if i >= m else 0 for m in range(k)] for i in range(k)])
    shift = np.array([[(-1) ** (i - j) * comb(i, j) if i >= j else 0 for i in range(k)] for j in range(k)])
    taylor = np.array([[comb(j, i) for j in range(k)] for i in range(k)])
    to_r = shift @ inverse
    from_a = to_r @ (np.eye(k, dtype=int) - taylor)
    return from_a[:, 1:].astype(np.float64), to_r.astype(np.float64)


_ERRORS = {
    2: (1 / 384, 3**0.5 / 216, 1 / 12, 1 / 2),
    3: (1 / 46080, 5**0.5 / 30000, 1 / 1920, 1 / 120),
}


def hermite_errors(bound: Array, length: float, stated: int) -> Array:
    """Return by how much a Hermite polynomial of a smooth curve is off at most, and its derivatives up to 3.

    Args:
        bound: Of the magnitude of the curve's derivative of order 2 `stated`, any shape.
        length: Of the interval.
        stated: How many of position, velocity and acceleration both share at its ends, 2 or 3.

    Returns:
        Shape (4, *bound.shape).

    Source: Birkhoff and Priver, Hermite interpolation errors for derivatives (1967), table of constants for
        cubics and quintics.
    """
    return np.stack([c * length ** (2 * stated - k) * bound for k, c in enumerate(_ERRORS[stated])])
