"""Where the derivatives of polynomials vanish, by the chain of derivatives.

The roots of p^(j+1) cut a piece into intervals on which p^(j) is monotone, so an interval holds a root of
p^(j) exactly when the signs at its ends differ. One pass from the highest derivative down gives the critical
points of every order, without companion matrices. Roots closer to each other than rounding may be missed:
between them p^(j-1) changes by less than rounding.

Source: Collins and Loos, Polynomial real root isolation by differentiation (SYMSAC 1976).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from trajcli.curves.piecewise import Array, derivative_coefficients, horner

_STEP = 2.0**-53  # of a piece: a shorter step of the root finder changes nothing
_STEPS = 120  # twice what bisection alone needs, because at most every second step is not a bisection


def critical_points(coefficients: Array, lengths: Array, orders: Sequence[int]) -> list[Array]:
    """Return for each order all roots of the derivative after it, (k, w, n), ascending, in local time.

    Where there are fewer roots than the degree allows, other points of the piece stand in.

    Args:
        coefficients: Shape (degree + 1, w, n), highest power first.
        lengths: Shape (w,), none negative.
        orders: Derivative orders, 0 for the value.
    """
    roots = _chain(_normalised(coefficients, lengths), min(orders, default=0) + 1)
    nowhere = np.empty((0, *coefficients.shape[1:]))
    return [roots.get(order + 1, nowhere) * lengths[:, None] for order in orders]


def _normalised(coefficients: Array, lengths: Array) -> Array:
    """Return the polynomials in u = t / length, scaled: the largest coefficient from u^1 up becomes 1."""
    powers = lengths ** np.arange(coefficients.shape[0] - 1, -1, -1)[:, None]
    scaled = coefficients * powers[:, :, None]
    scaled[-1] = 0.0  # has no say in where derivatives vanish, and may be too large for the others' scale
    size = np.abs(scaled).max(axis=0)
    return scaled / np.where(size > 0, size, 1.0)


def _chain(coefficients: Array, lowest: int) -> dict[int, Array]:
    """Return for each j points (degree - j, w, n) in [0, 1], ascending: all roots of derivative j and more.

    Args:
        coefficients: Shape (degree + 1, w, n).
        lowest: The smallest j that is asked for.
    """
    degree = coefficients.shape[0] - 1
    roots: dict[int, Array] = {}
    for order in range(degree - 1, lowest - 1, -1):
        polynomial = derivative_coefficients(coefficients, order)
        closed = _linear if order == degree - 1 else _quadratic
        roots[order] = closed(polynomial) if order >= degree - 2 else _between(polynomial, roots[order + 1])
    return roots


def _linear(coefficients: Array) -> Array:
    slope, offset = coefficients
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        return _within_piece((-offset / slope)[None])


def _quadratic(coefficients: Array) -> Array:
    """Return both roots without cancellation; without real roots two points that are as good as any.

    Source: Press et al., Numerical Recipes (3rd ed.), section 5.6.
    """
    a, b, c = coefficients
    root = np.sqrt(np.maximum(b * b - 4.0 * a * c, 0.0))
    q = -0.5 * (b + np.copysign(root, b))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        return np.sort(_within_piece(np.stack([q / a, c / q])), axis=0)


def _within_piece(points: Array) -> Array:
    return np.clip(np.where(np.isnan(points), 0.0, points), 0.0, 1.0)


def _between(coefficients: Array, turns: Array) -> Array:
    """Return one point for each interval between the ends and `turns`: its root, or else its first end."""
    ends = np.zeros((1, *turns.shape[1:]))
    knots = np.concatenate([ends, turns, ends + 1.0])
    values = horner(coefficients, knots)
    signs = np.sign(values)
    slot, piece, joint = np.nonzero(signs[:-1] * signs[1:] < 0)
    roots = knots[:-1].copy()
    if slot.size:
        rising = signs[slot + 1, piece, joint]
        roots[slot, piece, joint] = _bracketed(
            coefficients[:, piece, joint] * rising,
            (knots[slot, piece, joint], knots[slot + 1, piece, joint]),
            (values[slot, piece, joint] * rising, values[slot + 1, piece, joint] * rising),
        )
    return roots


def _bracketed(coefficients: Array, ends: tuple[Array, Array], values: tuple[Array, Array]) -> Array:
    """Return the root of each polynomial (degree + 1, m) that rises through zero between its `ends`.

    Newton's step is taken where it stays inside the bracket and is at most half the step before it, else
    the bracket is halved. A polynomial is done when it is zero up to rounding, or the step is.
    """
    low, high = ends
    x = low + (high - low) * (values[0] / (values[0] - values[1]))
    step, found, live = high - low, np.empty_like(x), np.arange(x.size)
    for _ in range(_STEPS):
        value, slope = _with_slope(coefficients, x)
        below = value < 0
        low, high = np.where(below, x, low), np.where(below, high, x)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            newton = x - value / slope
        fast = (newton >= low) & (newton <= high) & (np.abs(newton - x) <= 0.5 * np.abs(step))
        x, before = np.where(fast, newton, 0.5 * (low + high)), x
        step = x - before
        zero = np.abs(value) <= _STEP * np.abs(coefficients).sum(axis=0)
        found[live] = np.where(zero, before, x)
        going = ~zero & (np.abs(step) > _STEP)
        if not going.any():
            break
        if not going.all():
            coefficients, live = coefficients[:, going], live[going]
            low, high, x, step = low[going], high[going], x[going], step[going]
    return found


def _with_slope(coefficients: Array, x: Array) -> tuple[Array, Array]:
    """Return value and derivative of the polynomials (degree + 1, m) at `x` (m,)."""
    value, slope = coefficients[0], np.zeros_like(x)
    for row in coefficients[1:]:
        slope = slope * x + value
        value = value * x + row
    return value, slope
