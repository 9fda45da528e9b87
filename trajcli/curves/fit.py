"""Any smooth function whose derivatives can be asked for, as quintic pieces within a stated tolerance.

A piece takes value, first and second derivative from the function at its two ends; between them the error is
of order 6 in its length (4 in the second derivative), so intervals are divided until the error is small
enough where it is largest. All intervals of a round are asked for at once. Where the function is found by a
search, a coarse curve says where to begin: the pieces of the first rounds are too far off for that.

Source: Birkhoff and Priver, Hermite interpolation errors for derivatives, J. Math. Phys. 46 (1967).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import sqrt

import numpy as np

from trajcli.curves.hermite import hermite_coefficients
from trajcli.curves.piecewise import Array, PiecewisePolynomial, Side, derivative_coefficients, horner

MOST_PIECES = 4096
Exact = Callable[[Array, Side, Array], Array]
"""Value, first and second derivative (3, N, n) at places (N,) from one side of breaks, by guesses (N, n)."""
Misfit = Callable[[Array, Array, Array], Array]
"""By how many times its tolerance a fit (3, N, n) misses exact values (3, N, n) at places (N,): (N,)."""

Guess = Callable[[Array], Array]
"""Values (N, n) near the function's at places (N,)."""

# where the error of a quintic piece is largest: of the value and its curvature, and of the slope
_PROBES = np.array([0.5 - 0.1 * sqrt(5.0), 0.5, 0.5 + 0.1 * sqrt(5.0)])
_ORDER = 4  # with which the error of the second derivative falls: the slowest
_FILLED = 0.8  # of the tolerance: between the probes the error is a little larger
_NOISE = 4.0  # units in the last place by which values that are exact may be off
_MOST_PARTS = 8
_ROUNDS = 60


class FitError(ValueError):
    """The function cannot be fitted within its tolerance.

    Attributes:
        place: Where it is worst.
        misfit: By how many times the tolerance it is missed there.
    """

    def __init__(self, place: float, misfit: float) -> None:
        super().__init__(f"{misfit:.3g} times the tolerance is missed at {place!r}")
        self.place = place
        self.misfit = misfit


@dataclass(frozen=True, eq=False)
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
        """Return some of the pieces."""
        return _Pieces(self.start[kept], self.end[kept], self.left[:, kept], self.right[:, kept])


def fit(
    exact: Exact, misfit: Misfit, breaks: Array, guess: Guess, *, most: int = MOST_PIECES
) -> PiecewisePolynomial:
    """Return quintic pieces through a function, each within tolerance where its error is largest.

    What rounding explains is no error: pieces that are short for that reason would only make it larger.

    Args:
        exact: The function.
        misfit: Its tolerance.
        breaks: Shape (m,), increasing: where the second derivative may jump, and the ends.
        guess: Values (N, n) near the function's at places (N,), to begin with.
        most: Pieces.

    Raises:
        FitError: When more pieces would be needed.
    """
    pending = _Pieces(
        breaks[:-1],
        breaks[1:],
        exact(breaks[:-1], "right", guess(breaks[:-1])),
        exact(breaks[1:], "left", guess(breaks[1:])),
    )
    done: list[_Pieces] = []
    count = 0
    for _ in range(_ROUNDS):
        error, probed = _errors(exact, misfit, pending, guess)
        fine = error <= _FILLED
        done.append(pending.at(fine))
        count += int(np.count_nonzero(fine))
        if fine.all():
            return _joined(done)
        rough = pending.at(~fine)
        parts = np.clip(np.ceil(1.1 * error[~fine] ** (1 / _ORDER)), 2, _MOST_PARTS).astype(int)
        if count + int(parts.sum()) > most:
            worst = int(error.argmax())
            raise FitError(float(probed[worst]), float(error[worst]))
        pending = _divided(exact, rough, parts, guess)
    raise FitError(float(pending.start[0]), float(error.max()))


def _errors(exact: Exact, misfit: Misfit, pieces: _Pieces, guess: Guess) -> tuple[Array, Array]:
    """Return for each piece the largest misfit and where it is, each of shape (k,)."""
    lengths = pieces.end - pieces.start
    local = lengths[:, None] * _PROBES
    places = (pieces.start[:, None] + local).reshape(-1)
    fitted = _at(pieces.coefficients(), local)
    values = exact(places, "right", guess(places))
    errors = misfit(places, values, fitted).reshape(local.shape)
    errors = np.where(np.isfinite(errors), errors, np.inf)
    worst = np.arange(lengths.size) * _PROBES.size + errors.argmax(axis=1)
    error, probed = errors.reshape(-1)[worst], places[worst]
    rough = np.flatnonzero(error > _FILLED)
    if rough.size:
        known = values[:, worst[rough]]
        explained = misfit(probed[rough], known, known + _rounding(known, lengths[rough]))
        error[rough[error[rough] <= explained]] = 0.0
    return error, probed


def _rounding(values: Array, lengths: Array) -> Array:
    """Return by how much rounding of what is exact (3, k, n) puts off a fit and its derivatives, (3, k, n).

    The derivatives of a piece hold differences of its ends, over its length and over the square of it.
    """
    noise = _NOISE * np.spacing(np.maximum(np.abs(values[0]), 1.0))
    return np.stack([noise, 2 * noise / lengths[:, None], 60 * noise / lengths[:, None] ** 2])


def _at(coefficients: Array, local: Array) -> Array:
    """Return value, first and second derivative (3, k * p, n) of pieces at local places (k, p)."""
    spread = [
        horner(derivative_coefficients(coefficients, order)[:, :, None, :], local[:, :, None])
        for order in range(3)
    ]
    return np.stack(spread).reshape(3, local.size, -1)


def _divided(exact: Exact, pieces: _Pieces, parts: np.ndarray, guess: Guess) -> _Pieces:
    """Return each piece divided into so many equal parts."""
    owner = np.repeat(np.arange(parts.size), parts)
    number = np.arange(owner.size) - np.repeat(np.cumsum(parts) - parts, parts)
    lengths = (pieces.end - pieces.start)[owner]
    local = lengths * number / parts[owner]
    start = pieces.start[owner] + local
    last = number == parts[owner] - 1
    inner = np.flatnonzero(number > 0)
    values = exact(start[inner], "right", guess(start[inner]))
    left, right = pieces.left[:, owner].copy(), pieces.right[:, owner].copy()
    left[:, inner] = values
    right[:, np.flatnonzero(~last)] = values
    return _Pieces(start, np.where(last, pieces.end[owner], np.append(start[1:], 0.0)), left, right)


def _joined(pieces: list[_Pieces]) -> PiecewisePolynomial:
    start = np.concatenate([some.start for some in pieces])
    order = np.argsort(start)
    coefficients = np.concatenate([some.coefficients() for some in pieces], axis=1)[:, order]
    end = np.concatenate([some.end for some in pieces])[order]
    return PiecewisePolynomial(np.append(start[order], end[-1]), coefficients)
