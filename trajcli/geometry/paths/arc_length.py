"""Arc length of polynomial curves, and the parallel transport of a frame along a curve.

Arc length is a table by Gauss quadrature, and its inverse Newton's method. Transport is the rotation that a
rate w(u) causes, dQ/du = [w] Q, where the axis may wander: order six with three Gauss nodes a step;
commutators of cross matrices are cross products.

Source: Blanes, Casas, Oteo and Ros, The Magnus expansion and some of its applications, Physics Reports 470
(2009), section 5.4.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, cached_property, partial

import numpy as np

from trajcli.frozen import frozen
from trajcli.geometry.rotation import Array, exp

_NODES = 8  # of Gauss on each panel
_PANELS = 8  # to begin with
_EXACT = 1e-15  # of the length, to which a panel must agree with its halves
_NEAR = 1e-8  # a Newton step as short as this leaves its square, which is rounding
_NEWTON_STEPS = 40  # halvings or Newton steps, far more than any curve with r' != 0 takes
_OFFSET = np.sqrt(15.0) / 10.0  # of the outer Gauss nodes from the middle


@frozen
class ArcLength:
    """Arc length of a polynomial curve r(u), u from 0 to 1, with r' nowhere zero.

    Attributes:
        coefficients: Of r, shape (degree + 1, 3), m, highest power first.
    """

    coefficients: Array

    @cached_property
    def _slope(self) -> Array:
        return derivative(self.coefficients)

    @cached_property
    def knots(self) -> Array:
        """Ends of panels (k + 1,) in u, each so short that the quadrature is exact to rounding."""
        knots = np.linspace(0.0, 1.0, _PANELS + 1)
        for _ in range(_NEWTON_STEPS):
            low, high = knots[:-1], knots[1:]
            middle = (low + high) / 2.0
            whole = self._between(low, high)
            rough = np.abs(whole - self._between(low, middle) - self._between(middle, high))
            if not (rough > _EXACT * whole.sum()).any():
                break
            knots = np.sort(np.concatenate([knots, middle[rough > _EXACT * whole.sum()]]))
        return knots

    @cached_property
    def lengths(self) -> Array:
        """Arc length (k + 1,), m, from the start to each knot."""
        return np.concatenate([[0.0], np.cumsum(self._between(self.knots[:-1], self.knots[1:]))])

    def parameter(self, s: Array) -> Array:
        """Return u (N,) at the arc lengths s (N,), m."""
        panel = np.clip(np.searchsorted(self.lengths, s, "right") - 1, 0, self.knots.size - 2)
        return _inverse(
            self._speed,
            (self.knots[panel], self.knots[panel + 1]),
            self.lengths[panel + 1] - self.lengths[panel],
            s - self.lengths[panel],
        )

    def _speed(self, u: Array) -> Array:
        square = sum(_value(column, u) ** 2 for column in self._slope.T)
        return np.asarray(np.sqrt(square))

    def _between(self, low: Array, high: Array) -> Array:
        nodes, weights = _gauss()
        width = (high - low)[..., None]
        return np.asarray((self._speed(low[..., None] + width * nodes) * width) @ weights)


def inverted_length(square: Array, panels: tuple[Array, Array], whole: Array, distance: Array) -> Array:
    """Return u (N,) on panels of N curves, at so much arc length behind the start of each panel.

    Args:
        square: Coefficients of |r'(u)|^2, shape (degree + 1, N), highest power first.
        panels: Where each panel begins and ends, in u, shape (N,) each.
        whole: Arc length of each panel, shape (N,), m.
        distance: Shape (N,), m.
    """
    return _inverse(partial(_speed_of, square), panels, whole, distance)


def _inverse(
    speed: Callable[[Array], Array], panels: tuple[Array, Array], whole: Array, distance: Array
) -> Array:
    """Return u (N,) by Newton's method, from |r'| at u (N, m)."""
    low, high = panels
    # begin with the cubic that has the slopes du/ds of both ends of the panel
    part = distance / whole
    first, last = (whole / speed(u[:, None])[:, 0] for u in panels)
    u = low + part * first
    u += part**2 * (3.0 * (high - low) - 2.0 * first - last + part * (first + last - 2.0 * (high - low)))
    nodes, weights = _gauss()
    for _ in range(_NEWTON_STEPS):
        width = (u - low)[:, None]
        gone = (speed(low[:, None] + width * nodes) * width) @ weights
        step = (gone - distance) / speed(u[:, None])[:, 0]
        u = np.clip(u - step, low, high)
        if not (np.abs(step) > _NEAR).any():
            break
    return u


def _speed_of(square: Array, u: Array) -> Array:
    """Return |r'| at u (N, m), from the coefficients (degree + 1, N) of its square."""
    result: Array = square[0][:, None] * u
    result += square[1][:, None]
    for row in square[2:]:
        result *= u
        result += row[:, None]
    return np.asarray(np.sqrt(result, out=result))


@frozen
class FrameTransport:
    """The rotation Q(u) from Q = I at the first knot.

    Attributes:
        rate: Returns w (*u.shape, 3), rad for each unit of u, in fixed axes.
        knots: Shape (k + 1,), increasing: the steps.
    """

    rate: Callable[[Array], Array]
    knots: Array

    @cached_property
    def _at_knots(self) -> Array:
        steps = exp(self._logarithm(self.knots[:-1], self.knots[1:]))
        result = np.empty((self.knots.size, 3, 3))
        result[0] = np.eye(3)
        for k, step in enumerate(steps):
            result[k + 1] = step @ result[k]
        return result

    def at(self, u: Array) -> Array:
        """Return Q (N, 3, 3) at u (N,)."""
        panel = np.clip(np.searchsorted(self.knots, u, "right") - 1, 0, self.knots.size - 2)
        return np.asarray(exp(self._logarithm(self.knots[panel], u)) @ self._at_knots[panel])

    def _logarithm(self, low: Array, high: Array) -> Array:
        """Return the rotation vectors (*batch, 3) of the steps from `low` to `high` (*batch,)."""
        width = high - low
        middle = (low + high) / 2.0
        before, here, after = (self.rate(middle + k * _OFFSET * width) for k in (-1, 0, 1))
        h = width[..., None]
        a1 = h * here
        a2 = h * np.sqrt(15.0) / 3.0 * (after - before)
        a3 = h * 10.0 / 3.0 * (after - 2.0 * here + before)
        c1 = np.cross(a1, a2)
        c2 = -np.cross(a1, 2.0 * a3 + c1) / 60.0
        return np.asarray(a1 + a3 / 12.0 + np.cross(-20.0 * a1 - a3 + c1, a2 + c2) / 240.0)


def derivative(coefficients: Array) -> Array:
    """Return the coefficients of the derivatives of polynomials (degree + 1, ...), highest power first."""
    powers = np.arange(len(coefficients) - 1.0, 0.0, -1.0)
    return coefficients[:-1] * powers.reshape(-1, *([1] * (coefficients.ndim - 1)))


def values(coefficients: Array, u: Array) -> Array:
    """Return the polynomial (*u.shape, 3) with the coefficients (degree + 1, 3), highest power first."""
    result = np.empty((*u.shape, coefficients.shape[1]))
    for i, column in enumerate(coefficients.T):
        result[..., i] = _value(column, u)
    return result


def _value(coefficients: Array, u: Array) -> Array:
    """Return the polynomial (*u.shape,) with the coefficients (degree + 1,), highest power first."""
    result = np.full(u.shape, coefficients[0])
    for value in coefficients[1:]:
        result *= u
        result += value
    return result


@cache
def _gauss() -> tuple[Array, Array]:
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    return (nodes + 1.0) / 2.0, weights / 2.0
