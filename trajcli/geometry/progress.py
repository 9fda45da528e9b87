"""How far each segment of a path is done, by the path's arc length: smoothly through rounded corners.

Segment i goes from border i to border i+1, and its fraction from 0 to 1 with slope 1/length. Through a
rounded corner, from h before its border to h after it, the slope of the segment behind falls to zero as 1 - S
and that of the one ahead rises as S, with S = 3x^2 - 2x^3: the fractions are twice continuously
differentiable there.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from trajcli.frozen import frozen
from trajcli.geometry.place_curve import Side, inside
from trajcli.geometry.rotation import Array

_ROUNDING = 1e-12  # of the length, by which two blends that meet may be apart


class Fractions(NamedTuple):
    """The two neighbouring segments that are under way at each place.

    Attributes:
        segment: Index (N,) of the first one; those before it are done, those after the second not begun.
        value: Shape (2, N).
        slope: Shape (2, N), 1/m.
        bend: Shape (2, N), 1/m^2.
    """

    segment: NDArray[np.intp]
    value: Array
    slope: Array
    bend: Array


@frozen
class Progress:
    """The fractions done of the k segments of a path.

    Attributes:
        borders: Shape (k + 1,), m, from 0 to the path's length.
        half_widths: Shape (k - 1,), m: half the length of the blend at each inner border, 0 where there is
            none.
    """

    borders: Array
    half_widths: Array

    @classmethod
    def even(cls, length: float) -> Progress:
        """Return the progress of one segment from 0 to `length`."""
        return cls(np.array([0.0, length]), np.empty(0))

    @property
    def length(self) -> float:
        """Length of the path."""
        return float(self.borders[-1])

    @property
    def segments(self) -> int:
        """Number k of segments."""
        return self.borders.size - 1

    @property
    def breaks(self) -> Array:
        """Inner places, increasing, where a derivative of a fraction jumps."""
        inner, room = self.borders[1:-1], _ROUNDING * self.length
        places = np.sort(np.concatenate([inner - self.half_widths, inner, inner + self.half_widths]))
        places = places[(places > room) & (places < self.length - room)]  # a blend may begin at an end
        return np.asarray(places[np.diff(places, prepend=-np.inf) > room])

    def at(self, s: Array, side: Side = "right") -> Fractions:
        """Return the fractions at s (N,).

        Raises:
            ValueError: When a place lies outside the path.
        """
        places = inside(s, self.length)
        inner, widths = self.borders[1:-1], self.half_widths
        # within a segment, from which place on its end is the border to look at
        turns = (inner[:-1] + widths[:-1] + inner[1:] - widths[1:]) / 2.0
        lengths = np.where(
            np.diff(self.borders) > 0.0, np.diff(self.borders), 1.0
        )  # or it stays at its start
        if self.segments == 1:  # a neighbour that never begins
            inner, widths, lengths = np.array([np.inf]), np.zeros(1), np.append(lengths, 1.0)
        segment = np.searchsorted(turns, places, side)
        value, slope, bend = _ramp(places, inner[segment], widths[segment], side)
        first, second = lengths[segment], lengths[segment + 1]
        behind = (places - self.borders[segment] - value) / first
        return Fractions(
            segment,
            np.array([behind, value / second]),
            np.array([(1.0 - slope) / first, slope / second]),
            np.array([-bend / first, bend / second]),
        )


def _ramp(s: Array, border: Array, width: Array, side: Side) -> tuple[Array, Array, Array]:
    """Return a function of slope 0 before border - width and 1 after border + width, and two derivatives."""
    after = s > border if side == "left" else s >= border
    sharp = width == 0.0
    whole = np.where(sharp, 1.0, 2.0 * width)
    x = np.clip((s - np.where(sharp, 0.0, border - width)) / whole, 0.0, 1.0)
    value = np.where(sharp | (x >= 1.0), np.maximum(s - border, 0.0), whole * x**3 * (1.0 - x / 2.0))
    slope = np.where(sharp, after, x * x * (3.0 - 2.0 * x))
    return value, slope, np.where(sharp, 0.0, 6.0 * x * (1.0 - x) / whole)
