"""Adaptive quintic Hermite fit of a smooth function within a stated tolerance.

A piece takes value, first and second derivative from the function at its two ends; between them the error is
of order 6 in its length (4 in the second derivative), so intervals are divided until the error is small
enough where it is largest. All intervals of a round are asked for at once. Where the function is the result
of a search, a coarse curve says where to begin: the pieces of the first rounds are too far off for that.

Source: Birkhoff and Priver, Hermite interpolation errors for derivatives, J. Math. Phys. 46 (1967).
"""

from __future__ import annotations

from collections.abc import Callable
from math import sqrt
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.hermite import hermite_coefficients
from trajcli.curves.piecewise import Array, PiecewisePolynomial, Side, derivative_coefficients, horner
from trajcli.frozen import frozen

MOST_PIECES = 4096  # of a function without inner breaks
_MORE_PIECES = 256  # for each inner break, of which a long path has many
RowIndices = NDArray[np.intp]
Guess = Callable[[Array], Array]
"""Values (N, n) near the function's at points (N,)."""
# where the error of a quintic piece is largest: of the value and its curvature, and of the slope
_PROBES = np.array([0.5 - 0.1 * sqrt(5.0), 0.5, 0.5 + 0.1 * sqrt(5.0)])
_ORDER = 4  # with which the error of the second derivative falls: the slowest
_FILLED = 0.8  # of the tolerance: between the probes the error is a little larger
_NOISE = 4.0  # units in the last place by which values that are exact may be off
_MOST_PARTS = 8
_AT_ONCE = 64  # of a few pieces that are off everywhere, together; others may only have a narrow peak
_EXPLAINED = 100.0  # times its rounding by which a derivative may be off that rounding explains
_ROUNDS = 60


class Known(Protocol):
    """What is known of a function at N points; what else a misfit needs may come with it.

    Attributes:
        values: Value, first and second derivative, shape (3, N, n).
    """

    @property
    def values(self) -> Array:
        """Value and derivatives."""
        ...


K = TypeVar("K", bound=Known)


ExactValues = Callable[[Array, Side, Array], K]
"""What is known at points (N,) from one side of breaks, by guesses (N, n)."""


ErrorMeasure = Callable[[K, RowIndices, Array], Array]
"""By how many times its tolerance a fit (3, k, n) misses what is known at rows (k,) of the points: (k,)."""


class FitError(ValueError):
    """The function cannot be fitted within its tolerance.

    Attributes:
        at: Where it is worst.
        misfit: By how many times the tolerance it is missed there.
    """

    def __init__(self, at: float, misfit: float) -> None:
        super().__init__(f"{misfit:.3g} times the tolerance is missed at {at!r}")
        self.at = at
        self.misfit = misfit


def most_pieces(breaks: Array) -> int:
    """Return how many pieces a function with breaks (m,), the ends included, may be divided into."""
    return MOST_PIECES + _MORE_PIECES * max(breaks.size - 2, 0)


def fit(
    exact: ExactValues[K],
    misfit: ErrorMeasure[K],
    breaks: Array,
    guess: Guess,
    *,
    at_most: int | None = None,
) -> PiecewisePolynomial:
    """Return quintic pieces through a function, each within tolerance where its error is largest.

    What rounding explains is no error: pieces that are short for that reason would only make it larger.

    Args:
        exact: The function.
        misfit: Its tolerance.
        breaks: Shape (m,), increasing: where the second derivative may jump, and the ends.
        guess: Values (N, n) near the function's at points (N,), to begin with.
        at_most: Pieces; None for as many as `most_pieces` allows.

    Raises:
        FitError: When more pieces would be needed.
    """
    at_most = most_pieces(breaks) if at_most is None else at_most
    pending = _whole(exact, breaks, guess)
    done: list[_Pieces] = []
    count = 0
    for _ in range(_ROUNDS):
        judged = _with_misfits(exact, misfit, pending)
        fine = judged.error <= _FILLED
        done.append(judged.pieces.at(fine))
        count += int(np.count_nonzero(fine))
        if fine.all():
            return _curve_of(done)
        pieces = count + int(np.count_nonzero(~fine))
        parts = _parts(judged.error[~fine], judged.least[~fine], _AT_ONCE // pieces)
        if count + int(parts.sum()) > at_most:
            break
        pending = _divided(judged.pieces.at(~fine), parts, judged.nearer[~fine], guess)
    worst = int(judged.error.argmax())
    raise FitError(float(judged.worst[worst]), float(judged.error[worst]))


@frozen
class _Pieces:
    """Intervals with the derivatives at their own two ends.

    Attributes:
        start: Shape (k,).
        end: Shape (k,).
        left: Shape (3, k, n).
        right: Shape (3, k, n).
    """

    start: Array
    end: Array
    left: Array
    right: Array

    def coefficients(self) -> Array:
        """Return the quintics, shape (6, k, n)."""
        return hermite_coefficients(self.left, self.right, (self.end - self.start)[:, None])

    def at(self, kept: np.ndarray) -> _Pieces:
        return _Pieces(self.start[kept], self.end[kept], self.left[:, kept], self.right[:, kept])

    def probes(self) -> Array:
        """Return the points (k * p,) between the ends at which a fit is judged."""
        return np.asarray(self.start[:, None] + (self.end - self.start)[:, None] * _PROBES).reshape(-1)


@frozen
class _Pending:
    """Pieces of which not all ends are known.

    Attributes:
        pieces: With anything at the ends that are not known.
        lefts: Pieces (u,) whose starts are to be asked for.
        rights: Pieces that end there; none where the right sides of breaks are asked for, and the left known.
        guess: Values near those at these starts and at all probes of the pieces, shape (u + k * p, n).
    """

    pieces: _Pieces
    lefts: RowIndices
    rights: RowIndices
    guess: Array


@frozen
class _Judged:
    """Pieces and how good they are.

    Attributes:
        pieces: All ends known.
        error: Largest misfit of each, shape (k,).
        least: Smallest, shape (k,).
        worst: Where the largest is, shape (k,).
        nearer: Whether the piece is nearer to the function than the guess was, shape (k,).
    """

    pieces: _Pieces
    error: Array
    least: Array
    worst: Array
    nearer: NDArray[np.bool_]


def _whole(exact: ExactValues[K], breaks: Array, guess: Guess) -> _Pending:
    """Return one piece between any two neighbouring breaks, its end known."""
    ends = exact(breaks[1:], "left", guess(breaks[1:])).values
    pieces = _Pieces(breaks[:-1], breaks[1:], ends.copy(), ends)
    near = guess(np.append(pieces.start, pieces.probes()))
    return _Pending(pieces, np.arange(breaks.size - 1), np.arange(0), near)


def _with_misfits(exact: ExactValues[K], misfit: ErrorMeasure[K], pending: _Pending) -> _Judged:
    """Return the pieces with their misfits; ends and probes are asked for at once: a question costs more."""
    pieces, inner = pending.pieces, pending.lefts.size
    probes = pieces.probes()
    exact_states = exact(np.append(pieces.start[pending.lefts], probes), "right", pending.guess)
    pieces.left[:, pending.lefts] = exact_states.values[:, :inner]
    pieces.right[:, pending.rights] = exact_states.values[:, : pending.rights.size]
    lengths = pieces.end - pieces.start
    fitted, values = _at(pieces.coefficients(), lengths[:, None] * _PROBES), exact_states.values[:, inner:]
    errors = misfit(exact_states, inner + np.arange(probes.size), fitted).reshape(-1, _PROBES.size)
    errors = np.where(np.isfinite(errors), errors, np.inf)
    worst = np.arange(lengths.size) * _PROBES.size + errors.argmax(axis=1)
    error = errors.reshape(-1)[worst]
    rounding = _rounding(values[:, worst], lengths)
    near = np.abs(fitted - values)[:, worst].max(axis=2) <= _EXPLAINED * rounding.max(axis=2)
    rows = np.flatnonzero((error > _FILLED) & near.any(axis=0))
    if rows.size:
        there = worst[rows]
        explained = misfit(exact_states, inner + there, values[:, there] + rounding[:, rows])
        error[rows[error[rows] <= explained]] = 0.0
    off = [
        np.abs(near - values[0]).max(axis=1).reshape(errors.shape).max(axis=1)
        for near in (fitted[0], pending.guess[inner:])
    ]
    return _Judged(pieces, error, errors.min(axis=1), probes[worst], off[0] < off[1])


def _parts(error: Array, least: Array, at_once: int) -> RowIndices:
    """Return into how many parts pieces of a largest and a smallest misfit (k,) are divided."""
    wanted, everywhere = (np.ceil(1.1 * size ** (1 / _ORDER)) for size in (error, least))
    many = np.maximum(_MOST_PARTS, np.minimum(everywhere, at_once))
    return np.clip(wanted, 2, many).astype(int)


def _rounding(values: Array, lengths: Array) -> Array:
    """Return by how much rounding of what is exact (3, k, n) puts off a fit and its derivatives, (3, k, n).

    The derivatives of a piece hold differences of its ends, over its length and over the square of it.
    """
    noise = _NOISE * np.spacing(np.maximum(np.abs(values[0]), 1.0))
    return np.stack([noise, 2 * noise / lengths[:, None], 60 * noise / lengths[:, None] ** 2])


def _at(coefficients: Array, local: Array) -> Array:
    """Return value, first and second derivative (3, k * p, n) of pieces at local points (k, p)."""
    spread = [
        horner(derivative_coefficients(coefficients, order)[:, :, None, :], local[:, :, None])
        for order in range(3)
    ]
    return np.stack(spread).reshape(3, local.size, -1)


def _divided(pieces: _Pieces, parts: RowIndices, nearer: NDArray[np.bool_], guess: Guess) -> _Pending:
    """Return each piece divided into so many equal parts; pieces that are nearer are the better guess."""
    owner = np.repeat(np.arange(parts.size), parts)
    number = np.arange(owner.size) - np.repeat(np.cumsum(parts) - parts, parts)
    start = pieces.start[owner] + (pieces.end - pieces.start)[owner] * number / parts[owner]
    last = number == parts[owner] - 1
    end = np.where(last, pieces.end[owner], np.append(start[1:], 0.0))
    divided = _Pieces(start, end, pieces.left[:, owner], pieces.right[:, owner])
    lefts = np.flatnonzero(number > 0)
    points = np.append(start[lefts], divided.probes())
    near, whose = guess(points), np.append(owner[lefts], np.repeat(owner, _PROBES.size))
    own = nearer[whose]
    local = (points - pieces.start[whose])[own]
    near[own] = horner(pieces.coefficients()[:, whose[own]], local[:, None])
    return _Pending(divided, lefts, lefts - 1, near)


def _curve_of(pieces: list[_Pieces]) -> PiecewisePolynomial:
    start = np.concatenate([some.start for some in pieces])
    order = np.argsort(start)
    coefficients = np.concatenate([some.coefficients() for some in pieces], axis=1)[:, order]
    end = np.concatenate([some.end for some in pieces])[order]
    return PiecewisePolynomial(np.append(start[order], end[-1]), coefficients)
