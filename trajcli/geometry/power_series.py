"""Power series as bounds: growth of polynomials about any point of their interval, products, exponentials.

A series here bounds the size of another one, coefficient by coefficient (it is a majorant of it); so do sums,
products and exponentials of such series, cut off where they are.

Source: the method of majorants, as in Krantz and Parks (2002), section 1.3.
"""

from __future__ import annotations

from math import comb

import numpy as np

from trajcli.geometry.rotation import Array


def growth(coefficients: Array, lengths: Array, order: int) -> Array:
    """Return bounds of |q^(m)| / m! on whole pieces, m = 0 to `order`, shape (order + 1, P, n).

    Entry 0 bounds how far q goes from where the piece begins.

    Args:
        coefficients: Of polynomials from 0 on, shape (degree + 1, P, n), highest power first.
        lengths: Of the pieces, shape (P,), above zero.
        order: Of the highest derivative.
    """
    rising = np.abs(coefficients[::-1]) * lengths[:, None] ** np.arange(len(coefficients))[:, None, None]
    rising[0] = 0.0
    chosen = np.array([[comb(j, m) for j in range(len(rising))] for m in range(order + 1)], dtype=np.float64)
    bounds = np.tensordot(chosen, rising, axes=1)
    return np.asarray(bounds / lengths[:, None] ** np.arange(order + 1)[:, None, None])


def series_product(one: Array, other: Array) -> Array:
    """Return the product of two series, shape (K, P), cut off as they are."""
    result = np.zeros(one.shape)
    for k in np.flatnonzero(one.any(axis=1)).tolist():
        result[k:] += one[k] * other[: len(other) - k]
    return result


def series_exponential(series: Array) -> Array:
    """Return exp of a series (K, P) that begins with 0: k e_k is the sum of m s_m e_(k - m)."""
    result = np.zeros(series.shape)
    result[0] = 1.0
    slope = series * np.arange(len(series))[:, None]
    for k in range(1, len(series)):
        result[k] = (slope[1 : k + 1] * result[k - 1 :: -1][:k]).sum(axis=0) / k
    return result
