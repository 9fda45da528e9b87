"""Piecewise polynomials with values in R^n: the one curve type of trajcli.

A joint path q(s), a time law s(t) and a trajectory q(t) are this type in three roles.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from math import comb, isfinite, perm
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trajcli.errors import InputError
from trajcli.frozen import frozen

Array = NDArray[np.float64]
Side = Literal["left", "right"]

ALL = slice(None)
_BLOCK = 4096  # rows evaluated at a time: their monomials and results stay in the processor's cache
_ROWS = 16 * _BLOCK  # rows on a curve of more pieces than that: their table is made for so many at a time
_BORDER_UNITS = 4.0  # in the last place: a time so near to the border is on it, at any magnitude
_FEW = 8  # rows a piece below which gathering coefficients beats a product for each piece


def read_only(values: ArrayLike) -> Array:
    """Return a contiguous float64 copy that cannot be written to, or the array where it is one."""
    if (
        type(values) is np.ndarray
        and values.dtype == np.float64
        and values.base is None
        and values.flags.c_contiguous
        and not values.flags.writeable
    ):
        return values
    array = np.array(values, dtype=np.float64, order="C")
    array.flags.writeable = False
    return array


def numeric(values: ArrayLike, name: str) -> NDArray[Any]:
    """Return what a user has given as an array of numbers, of its own type.

    Raises:
        InputError: When something of it is no real number, or its rows are of several lengths.
    """
    try:
        array = np.asarray(values)
    except ValueError:
        raise InputError(f"{name}: expected an array of numbers, got rows of several lengths") from None
    if array.dtype.kind not in "fiu":
        raise InputError(f"{name}: expected an array of numbers, got {array.dtype}")
    return array


def real_number(value: object, name: str) -> float:
    """Return what a user has given as a number.

    Raises:
        InputError: When it is none.
    """
    if isinstance(value, bool) or not isinstance(value, int | float | np.number):
        raise InputError(f"{name}: expected a number, got {value!r:.40}")
    return float(value)


@frozen
class PiecewisePolynomial:
    """A function of one variable with values in R^n, a polynomial between neighbouring breaks.

    Attributes:
        breaks: Shape (pieces + 1,), strictly increasing. A curve of no length has the one piece [a, a].
        coefficients: Shape (degree + 1, pieces, n), highest power first, in powers of (t - breaks[piece]).
    """

    breaks: Array
    coefficients: Array

    def __post_init__(self) -> None:
        breaks, coefficients = read_only(self.breaks), read_only(self.coefficients)
        if breaks.ndim != 1 or coefficients.ndim != 3 or coefficients.shape[1] != breaks.size - 1:
            raise ValueError(
                f"breaks {breaks.shape} and coefficients {coefficients.shape} do not fit: "
                "expected (pieces + 1,) and (degree + 1, pieces, n)"
            )
        rising = breaks.size == 2 or bool((breaks[1:] > breaks[:-1]).all())
        if not (
            isfinite(breaks[0])
            and isfinite(breaks[-1])
            and all(np.isfinite(power).all() for power in coefficients)
        ):
            raise ValueError("breaks and coefficients must be finite")
        if not rising or breaks[-1] < breaks[0]:
            if not np.isfinite(breaks).all():
                raise ValueError("breaks and coefficients must be finite")
            raise ValueError("breaks must strictly increase")
        object.__setattr__(self, "breaks", breaks)
        object.__setattr__(self, "coefficients", coefficients)

    def __repr__(self) -> str:
        pieces = f"{self.pieces} piece{'s' * (self.pieces != 1)} of degree {self.degree}"
        return f"PiecewisePolynomial({pieces} in R^{self.dimension} over [{self.start:g}, {self.end:g}])"

    @property
    def degree(self) -> int:
        """Highest power that the coefficients have room for."""
        return int(self.coefficients.shape[0]) - 1

    @property
    def pieces(self) -> int:
        """Number of pieces."""
        return int(self.coefficients.shape[1])

    @property
    def dimension(self) -> int:
        """Number n of components."""
        return int(self.coefficients.shape[2])

    @property
    def start(self) -> float:
        """First break."""
        return float(self.breaks[0])

    @property
    def end(self) -> float:
        """Last break."""
        return float(self.breaks[-1])

    @property
    def duration(self) -> float:
        """Last break minus first break."""
        return self.end - self.start

    @property
    def lengths(self) -> Array:
        """Length of each piece, shape (pieces,)."""
        return np.diff(self.breaks)

    def piece_ends(self, order: int = 0, pieces: slice = ALL) -> tuple[Array, Array]:
        """Return the derivative of pieces at their own two ends, as two arrays of shape (pieces, n).

        The second array up to the last row and the first array from the second row on are the two sides
        of the breaks between them.
        """
        coefficients = derivative_coefficients(self.coefficients[:, pieces], order)
        return coefficients[-1], horner(coefficients, self.lengths[pieces, None])

    def evaluate(self, t: ArrayLike, order: int = 0, *, side: Side = "right") -> Array:
        """Return the derivative of the given order at `t`, shape (*t.shape, n).

        Args:
            t: Any shape, inside [start, end] but for rounding.
            order: 0 for the value.
            side: Which of two neighbouring pieces speaks at a break.

        Raises:
            ValueError: When a time lies outside the curve.
        """
        times = np.asarray(t, dtype=np.float64)
        flat = np.ascontiguousarray(times.reshape(-1))
        return self.evaluate_orders(flat, (order,), side=side).reshape(*times.shape, self.dimension)

    def evaluate_orders(self, t: Array, orders: Sequence[int], *, side: Side = "right") -> Array:
        """Return several derivatives at once, shape (N, len(orders), n).

        Args:
            t: Shape (N,), inside [start, end]; fastest when sorted.
            orders: Derivative orders, 0 for the value.
            side: Which of two neighbouring pieces speaks at a break.

        Raises:
            ValueError: When a time lies outside the curve.
        """
        if t.size and not (t.min() >= self.start and t.max() <= self.end):  # so written, NaN is outside too
            t = self._at_border(t)
        if t.size > _ROWS and self.pieces > _ROWS and not (t[1:] < t[:-1]).any():
            parts = [
                self.evaluate_orders(t[k : k + _ROWS], orders, side=side) for k in range(0, t.size, _ROWS)
            ]
            return np.concatenate(parts)
        piece = _piece_of(self.breaks, t, side)
        first, last = (int(piece.min()), int(piece.max())) if t.size else (0, 0)
        spoken = self.coefficients[:, first : last + 1]  # a time on a long curve costs no look at all pieces
        table = np.concatenate(
            [_padded(derivative_coefficients(spoken, order), self.degree) for order in orders], axis=2
        )
        rows, breaks, piece = np.empty((t.size, table.shape[2])), self.breaks[first : last + 2], piece - first
        for low in range(0, t.size, _BLOCK):
            block = slice(low, min(low + _BLOCK, t.size))
            _evaluate_block(breaks, table, t[block], piece[block], rows[block])
        return rows.reshape(t.size, len(orders), self.dimension)

    def _at_border(self, t: Array) -> Array:
        """Return times with those on the border that only rounding has beside it."""
        inside = np.clip(t, self.start, self.end)
        if not (np.abs(t - inside) <= _BORDER_UNITS * np.spacing(max(-self.start, self.end))).all():
            raise ValueError(f"time outside the curve's domain [{self.start!r}, {self.end!r}]")
        return inside

    def shifted(self, offset: float) -> PiecewisePolynomial:
        """Return the same curve starting `offset` later."""
        return PiecewisePolynomial(increasing(self.breaks + offset), self.coefficients)


def derivative_coefficients(coefficients: Array, order: int) -> Array:
    """Return the coefficients (degree + 1, ...) of the derivative, highest power first."""
    degree = coefficients.shape[0] - 1
    if order == 0:
        return coefficients
    if order > degree:
        return np.zeros((1, *coefficients.shape[1:]))
    factors = _falling_factorials(degree, order)
    return coefficients[: degree + 1 - order] * factors.reshape(-1, *([1] * (coefficients.ndim - 1)))


@lru_cache(maxsize=64)
def _falling_factorials(degree: int, order: int) -> Array:
    """Return what the powers of a polynomial are multiplied by where it is derived, highest power first."""
    return read_only([perm(power, order) for power in range(degree, order - 1, -1)])


def horner(coefficients: Array, x: Array) -> Array:
    """Return the polynomials (degree + 1, ...) at `x`, which broadcasts against the trailing shape."""
    if coefficients.shape[0] == 1:
        constant: Array = coefficients[0] * np.ones(x.shape)
        return constant
    result: Array = coefficients[0] * x
    result += coefficients[1]
    for row in coefficients[2:]:
        result *= x
        result += row
    return result


def taylor_shift(coefficients: Array, x: Array) -> Array:
    """Return the coefficients (degree + 1, ...) of p(t + x) for p given by `coefficients`."""
    shifted = np.array(coefficients, dtype=np.float64)
    rows = list(shifted[:, None])
    for last in range(len(rows), 1, -1):
        for power in range(1, last):
            rows[power] += x * rows[power - 1]
    return shifted


def control_points(coefficients: Array, lengths: Array) -> Array:
    """Return the Bernstein coefficients (degree + 1, ...) of polynomials, each from 0 to its own length.

    Args:
        coefficients: Shape (degree + 1, ...), highest power first.
        lengths: Broadcasts against the trailing shape.

    On its interval a polynomial lies within their range; the first and the last are its values at the ends.

    Source: Farouki, The Bernstein polynomial basis: a centennial retrospective, Computer Aided Geometric
    Design 29 (2012), section 3.
    """
    degree = coefficients.shape[0] - 1
    points = coefficients[::-1].copy()
    power = np.ones_like(lengths)
    for k in range(1, degree + 1):
        power = power * lengths
        points[k] *= power / comb(degree, k)
    rows = list(points[:, None])  # views, of numbers too
    for k in range(1, degree + 1):
        for row in range(degree, k - 1, -1):
            rows[row] += rows[row - 1]
    return points


def distinct(values: Array) -> Array:
    """Return numbers (k,) in order and without repeats; `np.unique` would load masked arrays for that."""
    ordered = np.sort(values)
    return np.asarray(ordered[np.append(True, ordered[1:] > ordered[:-1])[: ordered.size]])


def increasing(breaks: Array) -> Array:
    """Return `breaks` with those that rounding made equal moved apart by the smallest possible step."""
    if (np.diff(breaks) > 0).all():
        return breaks
    result = breaks.copy()
    for k in range(1, result.size):
        if result[k] <= result[k - 1]:
            result[k] = np.nextafter(result[k - 1], np.inf)
    return result


def concatenate(curves: Sequence[PiecewisePolynomial]) -> PiecewisePolynomial:
    """Join curves end to start; the first keeps its time, each other is moved to where the last one ends.

    Curves of no length contribute nothing unless all have none.
    """
    long = [curve for curve in curves if curve.duration > 0] or list(curves[:1])
    if len(long) == 1:
        return long[0]
    degree = max(curve.degree for curve in long)
    breaks, end = [long[0].breaks[:1]], long[0].start
    for curve in long:
        breaks.append(curve.breaks[1:] + (end - curve.start))
        end = float(breaks[-1][-1])
    joined = np.concatenate([_padded(curve.coefficients, degree) for curve in long], axis=1)
    times = np.concatenate(breaks)
    return PiecewisePolynomial(times if times.size == 2 else increasing(times), joined)


def constant(value: ArrayLike, duration: float) -> PiecewisePolynomial:
    """Return the curve that stays at `value` (n,) from 0 to `duration`, which may be zero."""
    return PiecewisePolynomial(np.array([0.0, duration]), np.asarray(value, dtype=np.float64)[None, None, :])


def _padded(coefficients: Array, degree: int) -> Array:
    """Return the coefficients with zeros in front, up to a degree."""
    missing = degree + 1 - coefficients.shape[0]
    return (
        np.concatenate([np.zeros((missing, *coefficients.shape[1:])), coefficients])
        if missing
        else coefficients
    )


def _piece_of(breaks: Array, t: Array, side: Side) -> NDArray[np.intp]:
    """Return the piece (N,) that speaks at each time; in ordered times only the breaks are looked for."""
    inner = breaks[1:-1]
    if t.size < breaks.size or (t[1:] < t[:-1]).any():
        return np.searchsorted(inner, t, side)
    rows = np.searchsorted(t, inner, "left" if side == "right" else "right")
    return np.repeat(np.arange(breaks.size - 1), np.diff(rows, prepend=0, append=t.size))


def _evaluate_block(breaks: Array, table: Array, t: Array, piece: NDArray[np.intp], out: Array) -> None:
    """Write the polynomials of a table (degree + 1, pieces, m) at times (w,) into `out` (w, m)."""
    first, last = int(piece[0]), int(piece[-1])
    ordered = not (piece[1:] < piece[:-1]).any()
    local = t - (breaks[first] if ordered and first == last else breaks[piece])
    if not ordered or (last - first + 1) * _FEW > t.size:
        out[:] = horner(table[:, piece, :], local[:, None])
        return
    monomials = np.empty((table.shape[0], t.size))
    monomials[-1] = 1.0
    for power in range(table.shape[0] - 2, -1, -1):
        np.multiply(monomials[power + 1], local, out=monomials[power])
    edges = np.searchsorted(piece, np.arange(first, last + 2))
    for k in range(first, last + 1):
        rows = slice(edges[k - first], edges[k - first + 1])
        np.matmul(monomials[:, rows].T, table[:, k, :], out=out[rows])
