"""Rounding of recorded rows, and what it may make of the curve between them.

A piece of length T between two rows is what the derivatives of highest order state, joined linearly, and
corrections by what the rows do not agree on. With the means v, a of both ends,

    linear:   p' = d / T,                                                d the displacement
    cubic:    p'' = dv / T + 6 (1 - 2u) D / T^2,                         D = d - T v
    quintic:  p'' = a0 + da u + 6 u (1 - u) E / T + 60 u (1 - u) (1 - 2u) D / T^2,
              E = dv - T a,   D = d - T v + T^2 da / 12.

Errors of the values and of T enter d, dv, D and E linearly, or nearly so, and the largest value of each
polynomial of u is known: 6, 3/2, 10/sqrt(3) and so on. The sums are upper bounds for every u.

Source: Hermite interpolation as in `trajcli.curves.hermite`, rewritten in its defects D and E.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.frozen import frozen

_SPACING = 4.0  # units in the last place by which a producer's own arithmetic may be off
_CUBIC = {1: 1.5, 2: 6.0, 3: 12.0}
_QUINTIC_D = {1: 1.875, 2: 10.0 / sqrt(3.0), 3: 60.0}
_QUINTIC_E = {1: 1.0, 2: 1.5, 3: 6.0}
_SPLINE = {0: 2.0, 1: 6.0, 2: 24.0, 3: 96.0}  # of rounding that alternates from row to row


@frozen
class PieceRows:
    """What the two rows at the ends of m pieces state of one joint each, and how far it may be off.

    Attributes:
        length: Of the pieces, s, shape (m,).
        late: By how much each length may be off by the rounding of time stamps, shape (m,).
        ends: Values of order 0, 1, 2 at both ends, as far as the pieces use them, each of shape (2, m).
        errors: By how much these may be off, one of shape (m,) for each.
        spline: Whether the pieces are of one spline through all positions, whatever else the rows state.
        beside: What of the rounding of the mean rates of pieces near in the spline reaches these, shape (m,).
    """

    length: Array
    late: Array
    ends: tuple[Array, ...]
    errors: tuple[Array, ...]
    spline: bool = False
    beside: Array | float = 0.0

    @property
    def shortest(self) -> Array:
        """The least length that the pieces may have; zero where rounding hides all of it."""
        return np.maximum(self.length - self.late, 0.0)

    def difference(self, order: int) -> tuple[Array, Array]:
        """Return (value at the end minus value at the start) / length, and by how much it may be off.

        By the mean value theorem every motion through both rows takes this value somewhere between them, as
        its derivative of the order after `order`.
        """
        change = self.ends[order][1] - self.ends[order][0]
        with np.errstate(divide="ignore", invalid="ignore"):
            error = 2.0 * self.errors[order] / self.shortest + _less(change, self, 1)
            return change / self.length, np.where(np.isnan(error), np.inf, error)

    def certain_difference(self, order: int, sign: float) -> Array:
        """Return what the value of `difference` is at least in a direction; -inf where it may be none.

        A length that rounding hides makes it uncertain how much larger the value is, but not how small.
        """
        change = sign * (self.ends[order][1] - self.ends[order][0]) - 2.0 * self.errors[order]
        return np.where(change > 0.0, change / (self.length + self.late), -np.inf)

    def error(self, order: int) -> Array:
        """Return by how much a derivative of the pieces may be off anywhere on them, shape (m,)."""
        with np.errstate(divide="ignore", invalid="ignore"):
            count = len(self.ends)
            if self.spline:
                error = self._spline_error(order)
            elif order == 0:
                return _position_error(self)
            elif count == 1:
                error = self.difference(0)[1]
            else:
                error = (_cubic_error if count == 2 else _quintic_error)(self, order)
        return np.where(np.isnan(error), np.inf, error)

    def _spline_error(self, order: int) -> Array:
        """Return by how much a spline through positions may be off: its neighbours' rounding counts, too."""
        change = self.ends[0][1] - self.ends[0][0]
        own = _defect(change, self.errors[0], self, order)
        return _SPLINE[order] * np.maximum(own, self.beside * self.shortest ** (1.0 - order))


def stated_errors(values: Array, absolute: Array, relative: float) -> Array:
    """Return by how much values (N, n) may be off: as they were written, and by the producer's arithmetic."""
    size = np.abs(values)
    return np.asarray(absolute + relative * size + _SPACING * np.spacing(size))


def _less(value: Array, rows: PieceRows, power: int) -> Array:
    """Return by how much |value| / T^power may be off when the length T is."""
    return np.asarray(np.abs(value) * (rows.shortest**-power - rows.length**-power))


def _defect(value: Array, error: Array, rows: PieceRows, power: int) -> Array:
    """Return by how much a defect over T^power may be off, when it is itself off by `error`."""
    return np.asarray(error * rows.shortest**-power + _less(value, rows, power))


def _position_error(rows: PieceRows) -> Array:
    error = rows.errors[0]
    longest = rows.length + rows.late
    if len(rows.ends) > 1:
        speed = np.abs(rows.ends[1]).max(axis=0)
        error = error + 0.3125 * (longest * rows.errors[1] + rows.late * speed)
    if len(rows.ends) > 2:
        acceleration = np.abs(rows.ends[2]).max(axis=0)
        more = longest**2 * rows.errors[2] + (longest**2 - rows.length**2) * acceleration
        error = error + 0.03125 * more
    return np.asarray(error)


def _displacement_defect(rows: PieceRows) -> tuple[Array, Array]:
    """Return D without the part of accelerations, and by how much it may be off."""
    (q0, q1), (v0, v1) = rows.ends[:2]
    mean = 0.5 * (v0 + v1)
    error = 2.0 * rows.errors[0] + (rows.length + rows.late) * rows.errors[1] + np.abs(mean) * rows.late
    return q1 - q0 - rows.length * mean, error


def _cubic_error(rows: PieceRows, order: int) -> Array:
    defect, off = _displacement_defect(rows)
    error = _CUBIC[order] * _defect(defect, off, rows, order)
    if order == 1:
        return np.asarray(error + rows.errors[1])
    return np.asarray(error + rows.difference(1)[1]) if order == 2 else error


def _quintic_error(rows: PieceRows, order: int) -> Array:
    (v0, v1), (a0, a1) = rows.ends[1:]
    longest, mean, change = rows.length + rows.late, 0.5 * (a0 + a1), a1 - a0
    velocity_defect = v1 - v0 - rows.length * mean
    velocity_off = 2.0 * rows.errors[1] + longest * rows.errors[2] + np.abs(mean) * rows.late
    defect, off = _displacement_defect(rows)
    defect = defect + rows.length**2 * change / 12.0
    off = off + longest**2 * rows.errors[2] / 6.0
    off = off + (longest**2 - rows.length**2) * np.abs(change) / 12.0
    error = _QUINTIC_D[order] * _defect(defect, off, rows, order)
    error = error + _QUINTIC_E[order] * _defect(velocity_defect, velocity_off, rows, order - 1)
    if order == 1:
        largest = np.maximum(np.abs(a0), np.abs(a1))
        return np.asarray(error + rows.errors[1] + longest * rows.errors[2] + rows.late * largest)
    return np.asarray(error + (rows.errors[2] if order == 2 else rows.difference(2)[1]))
