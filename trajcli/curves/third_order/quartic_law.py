"""Time law s(t) of quartic pieces through given speeds and accelerations; sddd is linear in each piece.

Between two nodes a quartic in t has five coefficients, and its duration h is the sixth unknown of the six
conditions at both ends. The trapezoidal rule with end correction is exact for it,

    s1 - s0 = h (v0 + v1) / 2 + h^2 (a0 - a1) / 12,

so h is the root of a quadratic, and the law is twice continuously differentiable for any nodes.

Source: Davis and Rabinowitz (1984), on corrections at the ends.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array, control_points, derivative_coefficients, horner
from trajcli.curves.time_optimal.time_law import LawPieces, quartic_coefficients
from trajcli.frozen import frozen

_BACKWARD = 1e-9  # of the largest speed in a piece: less is rounding
_CALM = 1.4  # of the mean speed over the distance: acceleration in proportion to it turns no law back
_CALMINGS = 8


class ReversingLawError(ValueError):
    """No quartic leads forward from one node to the next."""


@frozen
class QuarticLaw:
    """A law s(t) through N + 1 nodes.

    Attributes:
        s: Values at the nodes, strictly increasing, shape (N + 1,).
        speed: sd at the nodes, none negative, no two neighbours zero, shape (N + 1,).
        acceleration: sdd at the nodes, shape (N + 1,).
    """

    s: Array
    speed: Array
    acceleration: Array

    @cached_property
    def lengths(self) -> Array:
        """Duration h of each piece, shape (N,).

        Raises:
            ReversingLawError: When there is none.
        """
        mean, under = 0.5 * (self.speed[1:] + self.speed[:-1]), self._discriminant
        if not (under > 0).all():
            raise ReversingLawError(f"no quartic leads on from s = {self.s[np.argmin(under > 0)]:.9g}")
        return np.asarray(2.0 * np.diff(self.s) / (mean + np.sqrt(under)))

    @cached_property
    def coefficients(self) -> Array:
        """Coefficients of the pieces, each on its own time from 0 on, highest power first, shape (5, N)."""
        a = self.acceleration
        return quartic_coefficients(self.lengths, self.s, self.speed, a[:-1], a[1:])

    @property
    def _discriminant(self) -> Array:
        mean = 0.5 * (self.speed[1:] + self.speed[:-1])
        return np.asarray(mean**2 - np.diff(self.acceleration) * np.diff(self.s) / 3.0)

    @property
    def forward(self) -> NDArray[np.bool_]:
        """Whether each piece exists, and never goes back, shape (N,)."""
        if not (self._discriminant > 0).all():
            return np.asarray(self._discriminant > 0)
        speeds = control_points(derivative_coefficients(self.coefficients, 1), self.lengths)
        return np.asarray(speeds.min(axis=0) >= -_BACKWARD * speeds.max(axis=0))

    @property
    def duration(self) -> float:
        """Seconds."""
        return float(self.lengths.sum())

    @property
    def pieces(self) -> LawPieces:
        """Its pieces."""
        return LawPieces(self.lengths, self.coefficients)

    def states(self, share: float) -> tuple[Array, Array, Array, Array]:
        """Return s, sd, sdd and sddd, each (N,), where each piece has lasted a share of its duration."""
        t = share * self.lengths
        s, v, a, u = (horner(derivative_coefficients(self.coefficients, k), t) for k in range(4))
        if share == 1.0:  # as given, up to the last bit
            s, v, a = self.s[1:], self.speed[1:], self.acceleration[1:]
        return s, v, a, u

    def cut(self, parts: np.ndarray) -> QuarticLaw:
        """Return the same law with each piece cut into so many (N,) parts that last equally long."""
        owner = np.repeat(np.arange(parts.size), parts)
        step = np.arange(owner.size) - (np.cumsum(parts) - parts)[owner]
        t = self.lengths[owner] * step / parts[owner]
        rows = (horner(derivative_coefficients(self.coefficients, order)[:, owner], t) for order in range(3))
        ends = self.s[-1], self.speed[-1], self.acceleration[-1]
        return QuarticLaw(*(np.append(row, end) for row, end in zip(rows, ends, strict=True)))

    def changed(self, b: Array, slope: Array) -> QuarticLaw:
        """Return the law whose rate over this one's time tau, squared, is b at the nodes.

        With b = (dtau / dt)^2 the new speed is sd sqrt(b), and the new acceleration sdd b + sd b' / 2.

        Args:
            b: At the nodes, positive, shape (N + 1,).
            slope: db / dtau there, shape (N + 1,).

        Raises:
            ReversingLawError: When there is no such law that leads forward throughout.
        """
        acceleration = self.acceleration * b + 0.5 * self.speed * slope
        law = QuarticLaw(self.s, self.speed * np.sqrt(b), acceleration)
        if not law.forward.all():
            raise ReversingLawError(f"the law goes back behind s = {self.s[np.argmin(law.forward)]:.9g}")
        return law

    def calmed(self) -> QuarticLaw:
        """Return the law with less acceleration inside where it would go back.

        Raises:
            ReversingLawError: When it would go back with the accelerations at its ends, or nodes are one.
        """
        lengths = np.diff(self.s)
        if not (lengths > 0).all():
            raise ReversingLawError(f"the law stands at s = {self.s[np.argmin(lengths)]:.9g}")
        law, rate = self, _CALM * 0.5 * (self.speed[1:] + self.speed[:-1]) / lengths
        high = self.speed * np.append(rate[0], rate)
        calm = np.clip(self.acceleration, -self.speed * np.append(rate, rate[-1]), high)
        for turn in range(_CALMINGS):
            bad = ~law.forward
            if not bad.any():
                return law
            at = np.append(bad, False) | np.append(False, bad) | (turn == _CALMINGS - 2)
            at[[0, -1]] = False
            law = QuarticLaw(law.s, law.speed, np.where(at, calm, law.acceleration))
        raise ReversingLawError(f"the law goes back behind s = {self.s[np.argmin(law.forward)]:.9g}")

    def slowed(self, factor: float) -> QuarticLaw:
        """Return the law that lasts `factor` times as long."""
        return QuarticLaw(self.s, self.speed / factor, self.acceleration / factor**2)
