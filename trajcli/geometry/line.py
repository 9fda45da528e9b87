"""The straight line between two points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from trajcli.errors import InputError
from trajcli.geometry.place_curve import SAME_PLACE, Side, Smooth, Triple, inside, point
from trajcli.geometry.rotation import Array


@dataclass(frozen=True, eq=False)
class Line(Smooth):
    """A straight line.

    Attributes:
        start: Shape (3,), m.
        end: Shape (3,), m.

    Source: Siciliano, Sciavicco, Villani and Oriolo, Robotics: Modelling, Planning and Control (2009), eq.
    4.34.
    """

    start: Array
    end: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "start", point(self.start, "start"))
        object.__setattr__(self, "end", point(self.end, "end"))
        if self.length <= SAME_PLACE:
            raise InputError(
                f"a line from {self.start.tolist()} that is {self.length:.3g} m long has no direction "
                f"(it needs more than {SAME_PLACE:g} m)",
                hint="leave it out; to turn in place, use one `line` for the rotation alone",
            )

    @property
    def length(self) -> float:
        """Distance of the ends, m."""
        return float(np.linalg.norm(self.end - self.start))

    @property
    def direction(self) -> Array:
        """Unit vector (3,) of travel."""
        return np.asarray((self.end - self.start) / self.length)

    def evaluate(self, s: Array, side: Side = "right") -> Triple:
        """Return p, p', p'' as `PlaceCurve` says; both sides are the same."""
        fraction = inside(s, self.length)[:, None] / self.length
        places = (1.0 - fraction) * self.start + fraction * self.end  # exact at both ends
        return places, np.tile(self.direction, (fraction.size, 1)), np.zeros((fraction.size, 3))

    def transport(self, s: Array, side: Side = "right") -> Triple:
        """Return Q, w', w'' as `PlaceCurve` says: nothing turns."""
        count = inside(s, self.length).size
        return np.tile(np.eye(3), (count, 1, 1)), np.zeros((count, 3)), np.zeros((count, 3))
