"""Time stamps: finite, strictly increasing, and multiples of a period as far as their rounding tells.

Stamps that all lie within their rounding of multiples of one period are such multiples: 0.041667 s with six
decimals is 1/24 s. The period is the simplest fraction, numerator and denominator smallest, that fits all of
them; where their distances are equal as they are written, it is such a distance: 0.007 s is not 1/143 s.
"""

from __future__ import annotations

from fractions import Fraction
from math import floor

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.frozen import frozen

_FEW = 3  # rows that make no period
_ROUNDING = 4.0  # units in the last place that a sum of periods may be off
_BY_CHANCE = 0.1  # fractions: of a period that is none of whole hertz, fewer than these are met by chance
_SLACK = 1e-9  # of the period: what adding it up row by row may be off, and nobody's limit notices


class UnfitError(Exception):
    """A stamp does not fit the period of those before it: all must be taken as they are."""


@frozen
class Lattice:
    """Multiples of a period.

    Attributes:
        origin: Of the first stamp, s.
        period: s.
        slack: By how much stamps may be beside its multiples because the first one was rounded, s.
        loose: By how much the period may be off where the fraction is none that anybody means, s.
    """

    origin: float
    period: float
    slack: float = 0.0
    loose: float = 0.0


class Stamps:
    """Time stamps, block by block.

    Attributes:
        lattice: What all of them lie on; None where they do not, or before the first block.
        largest_snap: By how much a stamp was moved onto it at most, s.
        regular: Whether all rows but the last are one period apart.
    """

    def __init__(self, error: float, relative: float, *, snap: bool = True) -> None:
        """Begin with no stamps.

        Args:
            error: Half a unit of their last decimal, s.
            relative: Rounding as a share of each.
            snap: Whether they may be moved onto multiples of a period.
        """
        self._error, self._relative, self._snap = error, relative, snap
        self.lattice: Lattice | None = None
        self.largest_snap, self.regular = 0.0, True
        self._begun, self._off, self._index = False, False, 0

    def errors(self, t: Array) -> Array:
        """Return by how much stamps (N,) may be off as they are written."""
        size = np.abs(t)
        return np.asarray(self._error + self._relative * size + np.spacing(size))

    def taken(self, t: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Return strictly increasing stamps (N,) as they are meant, and which of them are exact.

        Raises:
            UnfitError: When they do not fit the period that the first block has.
        """
        if not self._begun:
            self._begun = True
            self.lattice = lattice_of(t, self.errors(t)) if self._snap else None
            self.regular = self.lattice is not None
        if self.lattice is None:
            return t, np.zeros(t.size, dtype=bool)
        if self._off:
            raise UnfitError("a time stamp does not fit the period")
        origin, period = self.lattice.origin, self.lattice.period
        steps = np.rint((t - origin) / period)
        meant = origin + steps * period
        slack = self.errors(t) + _SLACK * period + _ROUNDING * np.spacing(np.abs(meant)) + self.lattice.slack
        fits = np.abs(t - meant) <= slack
        if not fits[:-1].all():
            raise UnfitError("a time stamp does not fit the period")
        before = np.append(self._index - 1, steps)[-2]
        fits[-1] &= before < steps[-1]
        if not fits[-1] and origin + before * period >= t[-1]:
            raise UnfitError("the last time stamp is no later than the one before it was meant")
        self._off = not fits[-1]  # the last row may stand at the end of the motion
        counted = np.diff(np.append(self._index - 1 if steps[0] else -1, steps[fits]))
        self.regular = self.regular and bool((counted == 1).all())
        self._index = int(steps[fits][-1]) + 1 if fits.any() else self._index
        if self._relative and self.lattice.loose:  # who counted in single precision took positions at these
            return t, np.zeros(t.size, dtype=bool)
        self.largest_snap = max(self.largest_snap, float(np.abs(t - meant)[fits].max(initial=0.0)))
        return np.where(fits, meant, t), fits


def lattice_of(t: Array, errors: Array) -> Lattice | None:
    """Return what strictly increasing stamps (N,) lie on, the last one perhaps beside it; None for nothing.

    Args:
        t: Stamps, s.
        errors: By how much each may be off, shape (N,).
    """
    if t.size < _FEW:
        return None
    inner = t[:-1] if t.size > _FEW else t
    period = float(np.median(np.diff(inner)))
    errors = errors[: inner.size] + _SLACK * period
    since, exact = inner - t[0], _SLACK * period + float(np.spacing(np.abs(inner).max()))
    if np.ptp(np.diff(inner)) <= 2.0 * exact:  # equal as they are written: that is the period
        errors = np.full_like(errors, exact)
    error = 2.0 * float(errors.max())
    counted = max(0.2 * period / error, 1.0)  # up to here a guess that is off by rounding miscounts no row
    while True:
        steps = np.rint(since / period)
        near = (steps > 0) & (steps <= max(counted, steps[1]))
        if not near.any():
            return None
        low = float(((since - errors - errors[0])[near] / steps[near]).max())
        high = float(((since + errors + errors[0])[near] / steps[near]).min())
        if low > high:
            return None
        if counted >= steps[-1]:
            meant = (
                simplest_between(Fraction(low), Fraction(high)) if low > 0.0 else Fraction((low + high) / 2)
            )
            period = float(meant)
            chance = meant.denominator**2 * (high - low)  # how many fractions as simple are so near
            likely = chance <= (1.0 if meant.numerator == 1 else _BY_CHANCE)
            loose = 0.0 if likely else max(high - period, period - low)
            break
        period = 0.5 * (low + high)
        counted *= max(0.1 * period / error, 2.0)
    origin = _origin(float(t[0]), period, float(errors[0]))
    slack = float(errors[0]) if origin == t[0] else 0.0
    steps = np.rint(since / period)
    remainder = np.abs(inner - (origin + steps * period)) - slack
    fits = (remainder <= errors + _ROUNDING * np.spacing(np.abs(inner))).all() and (np.diff(steps) > 0).all()
    return Lattice(origin, period, slack, loose) if fits else None


def _origin(first: float, period: float, error: float) -> float:
    """Return the multiple of the period that the first stamp is, or the stamp itself."""
    steps = np.rint(first / period)
    near = abs(first - steps * period) <= error and abs(steps) < 2**40
    return float(steps * period) if near else first


def simplest_between(low: Fraction, high: Fraction) -> Fraction:
    """Return the fraction of the smallest denominator in an interval of positive numbers.

    Source: Graham, Knuth and Patashnik, Concrete Mathematics (1994), section 6.7.
    """
    whole = floor(low)
    if whole == low:
        return Fraction(whole)
    if whole + 1 <= high:
        return Fraction(whole + 1)
    return whole + 1 / simplest_between(1 / (high - whole), 1 / (low - whole))
