"""A velocity of one variable that is linear between knots; its position is a chain of parabolas."""

from __future__ import annotations

import math

import numpy as np

from trajcli.curves.piecewise import Array, PiecewisePolynomial, increasing
from trajcli.frozen import comparable

_ROUNDING = 1e-14  # of the largest speed: speeds this close differ by rounding


@comparable
class Rates:
    """What a motion in one direction may do: all positive; speed may be infinite.

    Attributes:
        speed: Largest speed.
        acceleration: Rate of speeding up.
        deceleration: Rate of slowing down.
    """

    speed: float
    acceleration: float
    deceleration: float


@comparable
class Profile:
    """A velocity that is linear between knots.

    Attributes:
        initial: Velocity at the start.
        knots: (duration of the stretch, velocity at its end) in order; without knots it has no length.
    """

    initial: float
    knots: tuple[tuple[float, float], ...] = ()

    @property
    def duration(self) -> float:
        """Seconds."""
        return math.fsum(length for length, _ in self.knots)

    @property
    def distance(self) -> float:
        """Signed distance covered."""
        velocities = [self.initial, *(velocity for _, velocity in self.knots)]
        return math.fsum(
            (velocities[i] + velocities[i + 1]) / 2 * knot[0] for i, knot in enumerate(self.knots)
        )

    def then(self, other: Profile) -> Profile:
        """Return this profile followed by another that starts with the velocity in which this one ends."""
        return Profile(self.initial, self.knots + other.knots)

    def mirrored(self) -> Profile:
        """Return the profile in the opposite direction."""
        return Profile(-self.initial, tuple((length, -velocity) for length, velocity in self.knots))

    def stretched(self, factor: float) -> Profile:
        """Return the profile that takes `factor` times as long over the same distance."""
        return Profile(self.initial / factor, tuple((t * factor, v / factor) for t, v in self.knots))

    def phases(self) -> list[tuple[str, float, float]]:
        """Return (name, start, end) of each stretch: accelerate, cruise, decelerate or rest."""
        named, start, before = [], 0.0, self.initial
        for length, velocity in self.knots:
            change = abs(velocity) - abs(before)
            flat = "cruise" if velocity else "rest"
            name = flat if change == 0 else "accelerate" if change > 0 else "decelerate"
            if length > 0:
                named.append((name, start, start + length))
            start, before = start + length, velocity
        return named

    def curve(self, start: float, end: float, duration: float | None = None) -> PiecewisePolynomial:
        """Return the position (n = 1) from `start`; its pieces are laid to end exactly in `end`.

        Args:
            start: Where it begins.
            end: Where it ends: `start` plus the distance, rounding apart.
            duration: When it ends: the duration, rounding apart.
        """
        knots = self._lasting_knots()
        if not knots:
            return PiecewisePolynomial(np.zeros(2), np.full((1, 1, 1), start))
        lengths = np.array([length for length, _ in knots])
        velocity = np.array([self.initial, *(v for _, v in knots)])
        breaks = np.concatenate([[0.0], np.cumsum(lengths)])
        breaks[-1] = breaks[-1] if duration is None else duration
        breaks = increasing(breaks)
        position = start + np.concatenate([[0.0], np.cumsum((velocity[1:] + velocity[:-1]) / 2 * lengths)])
        position[1:] += (end - position[-1]) * breaks[1:] / breaks[-1]
        slope = np.diff(velocity) / np.diff(breaks)  # so that velocities meet where breaks are rounded
        coefficients: Array = np.stack([slope / 2, velocity[:-1], position[:-1]])[:, :, None]
        return PiecewisePolynomial(breaks, coefficients)

    def _lasting_knots(self) -> list[tuple[float, float]]:
        """Return the knots without stretches of no length, and ramps between speeds equal but for rounding.

        Such a ramp is shorter than the times of its ends are exact: its acceleration would be anything.
        """
        fastest = max(abs(velocity) for velocity in (self.initial, *(v for _, v in self.knots)))
        shortest = 8 * math.ulp(self.duration)
        kept: list[tuple[float, float]] = []
        before = self.initial
        for length, velocity in self.knots:
            same = abs(velocity - before) <= _ROUNDING * fastest
            if length > (shortest if same else 0.0):
                kept.append((length, before if same else velocity))
                before = kept[-1][1]
        return kept
