"""Polynomials as a textbook prints them: piece by piece, in local and absolute time."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from trajcli.curves.piecewise import Array, taylor_shift
from trajcli.frozen import frozen
from trajcli.geometry.rotation import Flags

_NOTHING = 1e-12  # of the largest term over the move: what is smaller came from rounding
_CANCELS = 1e4  # times larger than what they add up to: of ten digits, six are left
_SAME = 1e-9  # of the largest term: neighbouring pieces this close are one polynomial


@frozen
class PolynomialInterval:
    """One polynomial of one joint, over one piece or several equal ones.

    Attributes:
        start: Seconds from the start of the move.
        end: Seconds from the start of the move.
        local: Coefficients in powers of (t - start), ascending, in the job's units.
        absolute: Coefficients in powers of t from the start of the move, ascending, in the job's units.
    """

    start: float
    end: float
    local: Array
    absolute: Array

    @property
    def text(self) -> str:
        """The polynomial in powers of t, or of (t - start) where the former would lose its digits."""
        powers = np.arange(self.local.size)
        terms = np.abs(self.local) * (self.end - self.start) ** powers
        cancelling = np.abs(self.absolute) * self.end**powers
        if cancelling.max() <= _CANCELS * terms.max():
            return polynomial_text(self.absolute)
        return polynomial_text(self.local, f"(t - {self.start:.10g})")


def polynomial_intervals(
    breaks: Array, coefficients: Array, *, join: bool = True
) -> list[PolynomialInterval]:
    """Return the polynomials of one component.

    Args:
        breaks: Shape (pieces + 1,).
        coefficients: Shape (degree + 1, pieces), highest power first, local to each break.
        join: Whether equal neighbours become one.
    """
    starts, ends = breaks[:-1], breaks[1:]
    local = _without_noise(coefficients[::-1].T, ends - starts)
    absolute = _without_noise(taylor_shift(coefficients, -starts)[::-1].T, ends)
    like = np.append(False, _equal(absolute[:-1], absolute[1:], ends[1:], 2 * _SAME))  # as the one before
    result: list[PolynomialInterval] = []
    for piece, end in enumerate(ends.tolist()):
        last = result[-1] if result else None
        if join and last and like[piece] and _equal(last.absolute, absolute[piece], end, _SAME):
            result[-1] = PolynomialInterval(last.start, end, last.local, last.absolute)
        else:
            result.append(PolynomialInterval(float(starts[piece]), end, local[piece], absolute[piece]))
    return result


def _without_noise(coefficients: Array, durations: Array) -> Array:
    """Return ascending coefficients (pieces, n) without those whose term over the duration is rounding."""
    terms = np.abs(coefficients) * durations[:, None] ** np.arange(coefficients.shape[1])
    return np.where(terms <= _NOTHING * terms.max(axis=1, keepdims=True), 0.0, coefficients)


def _equal(a: Array, b: Array, durations: ArrayLike, same: float) -> Flags:
    """Return whether polynomials (..., n) are equal as far as `same` of their largest term."""
    powers = np.asarray(durations)[..., None] ** np.arange(a.shape[-1])
    largest = (np.abs(a) * powers).max(axis=-1, keepdims=True)
    return np.asarray((np.abs(a - b) * powers <= same * largest).all(axis=-1))


def polynomial_text(coefficients: Array, variable: str = "t") -> str:
    """Return ascending coefficients as a textbook prints them: "20 + 90 t^2 - 60 t^3"."""
    text = ""
    for power, coefficient in enumerate(coefficients.tolist()):
        size = f"{abs(coefficient):.10g}"
        if size == "0":
            continue
        factor = ("", variable, f"{variable}^{power}")[min(power, 2)]
        term = factor if size == "1" and power else f"{size} {factor}".strip()
        sign = "-" if coefficient < 0 else "+"
        text += f" {sign} {term}" if text else ("-" if sign == "-" else "") + term
    return text or "0"
