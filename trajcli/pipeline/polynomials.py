"""Polynomials as a textbook prints them: piece by piece, in local and absolute time."""

from __future__ import annotations

import numpy as np

from trajcli.curves.piecewise import Array, taylor_shift
from trajcli.frozen import frozen

_NOTHING = 1e-12  # of the largest term over the move: what is smaller came from rounding
_CANCELS = 1e4  # times larger than what they add up to: of ten digits, six are left
_SAME = 1e-9  # of the largest term: neighbouring pieces this close are one polynomial


@frozen
class Stretch:
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


def stretches(breaks: Array, coefficients: Array, *, join: bool = True) -> list[Stretch]:
    """Return the polynomials of one component.

    Args:
        breaks: Shape (pieces + 1,).
        coefficients: Shape (degree + 1, pieces), highest power first, local to each break.
        join: Whether equal neighbours become one.
    """
    result: list[Stretch] = []
    for piece in range(breaks.size - 1):
        start, end = float(breaks[piece]), float(breaks[piece + 1])
        local = _without_noise(coefficients[::-1, piece], end - start)
        absolute = _without_noise(taylor_shift(coefficients[:, piece], np.array(-start))[::-1], end)
        if join and result and _equal(result[-1].absolute, absolute, end):
            result[-1] = Stretch(result[-1].start, end, result[-1].local, result[-1].absolute)
        else:
            result.append(Stretch(start, end, local, absolute))
    return result


def _without_noise(coefficients: Array, duration: float) -> Array:
    """Return ascending coefficients without those whose term is mere rounding over the duration."""
    terms = np.abs(coefficients) * duration ** np.arange(coefficients.size)
    cleaned: Array = np.where(terms <= _NOTHING * terms.max(), 0.0, coefficients)
    return cleaned


def _equal(a: Array, b: Array, duration: float) -> bool:
    powers = duration ** np.arange(a.size)
    return bool((np.abs(a - b) * powers <= _SAME * (np.abs(a) * powers).max()).all())


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
