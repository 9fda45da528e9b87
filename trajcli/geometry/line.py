"""The straight line between two points."""

from __future__ import annotations

import numpy as np

from trajcli.errors import InputError, Problem
from trajcli.frozen import frozen
from trajcli.geometry.place_curve import SAME_PLACE, Side, Smooth, Triple, inside, metres, point, spot
from trajcli.geometry.rotation import Array


@frozen
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
            text = "a line from {start} that is {length} long has no direction (it needs more than {least})"
            hint = "leave it out; to turn in place, use one `line` for the rotation alone"
            amounts = {"start": spot(self.start), "length": metres(self.length), "least": metres(SAME_PLACE)}
            raise InputError(Problem(text, hint, amounts=amounts))

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
