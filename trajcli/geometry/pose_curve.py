"""Poses along a path: a curve of the place and a curve of the orientation with the same s."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from trajcli.frozen import frozen
from trajcli.geometry.orientation_curve import OrientationCurve
from trajcli.geometry.place_curve import Pivot, PlaceCurve, Side, Triple
from trajcli.geometry.pose import build
from trajcli.geometry.rotation import Array

_SAME = 1e-9  # of the length: two breaks as near as this are one


class PosePath(Protocol):
    """A pose X(s), s from 0 to `length`; with a law s(t), v = X' sd and a = X'' sd^2 + X' sdd.

    Attributes:
        length: m of arc length, or rad where the place rests; zero for no motion.
        in_place: Whether the place rests and s is an angle.
        breaks: Inner places (k,), increasing, where a derivative may jump.
        stops: Those of them where X' jumps, or X: a law must stop there.
        jumps: Those of them where the orientation jumps.
    """

    @property
    def length(self) -> float:
        """How far s goes."""
        ...

    @property
    def in_place(self) -> bool:
        """Whether the place rests."""
        ...

    @property
    def breaks(self) -> Array:
        """Where a derivative may jump."""
        ...

    @property
    def stops(self) -> Array:
        """Where a law must stop."""
        ...

    @property
    def jumps(self) -> Array:
        """Where the orientation jumps."""
        ...

    def evaluate(self, s: Array, side: Side = "right") -> Triple:
        """Return the poses X (N, 4, 4), X' = [v', w'] (N, 6) and X'' = [v'', w''] (N, 6) in world axes.

        Args:
            s: Shape (N,), m or rad.
            side: Which of two neighbouring pieces speaks at a break.

        Raises:
            ValueError: When s lies outside.
        """
        ...


@frozen
class PoseCurve:
    """Place and orientation side by side.

    Attributes:
        place: p(s), of some length, or a `Pivot`.
        orientation: R(s), as long.
    """

    place: PlaceCurve
    orientation: OrientationCurve

    def __post_init__(self) -> None:
        difference = abs(self.place.length - self.orientation.length)
        if difference > _SAME * self.place.length:
            raise ValueError(
                f"place and orientation differ in length: {self.place.length!r}, {self.orientation.length!r}"
            )

    @property
    def length(self) -> float:
        """Length of the place's curve, m, or of the rotation alone, rad."""
        return self.place.length

    @property
    def in_place(self) -> bool:
        """Whether the place rests and s is an angle."""
        return isinstance(self.place, Pivot)

    @property
    def breaks(self) -> Array:
        """Where a derivative may jump."""
        return self._united(self.place.breaks, self.orientation.breaks)

    @property
    def stops(self) -> Array:
        """Where a law must stop."""
        return self._united(self.place.stops, self.orientation.stops)

    @property
    def jumps(self) -> Array:
        """Where the orientation jumps."""
        return self.orientation.jumps

    def evaluate(self, s: Array, side: Side = "right") -> Triple:
        """Return X, X', X'' as `PosePath` says."""
        places, velocity, bend = self.place.evaluate(s, side)
        rotations, rate, change = self.orientation.evaluate(s, side)
        first, second = np.concatenate([velocity, rate], axis=-1), np.concatenate([bend, change], axis=-1)
        return build(rotations, places), first, second

    def _united(self, first: Array, second: Array) -> Array:
        """Return the places of both, those of the second that are beside one of the first left out."""
        if not first.size:
            return second
        near = np.abs(second[:, None] - first).min(axis=-1) <= _SAME * self.length
        return np.sort(np.concatenate([first, second[~near]]))
