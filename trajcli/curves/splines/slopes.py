"""Waypoints of a spline: times, values, and the lengths and slopes between neighbours."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from trajcli.curves.piecewise import Array, read_only
from trajcli.frozen import frozen


@frozen
class Waypoints:
    """Values to pass at given times; m >= 2 of them, n components.

    Attributes:
        times: Shape (m,), strictly increasing.
        positions: Shape (m, n).
    """

    times: Array
    positions: Array

    def __post_init__(self) -> None:
        times, positions = read_only(self.times), read_only(self.positions)
        if times.ndim != 1 or positions.ndim != 2 or positions.shape[0] != times.size or times.size < 2:
            raise ValueError(
                f"times {times.shape} and positions {positions.shape} do not fit: "
                "expected (m,) and (m, n) with at least 2 points"
            )
        if not (np.isfinite(times).all() and np.isfinite(positions).all()):
            raise ValueError("times and positions of waypoints must be finite")
        late = np.flatnonzero(np.diff(times) <= 0)
        if late.size:
            k = int(late[0])
            raise ValueError(
                f"times of waypoints must strictly increase: waypoint {k + 1} is at {float(times[k + 1])!r}, "
                f"waypoint {k} before it at {float(times[k])!r}"
            )
        object.__setattr__(self, "times", times)
        object.__setattr__(self, "positions", positions)

    @property
    def count(self) -> int:
        """Number m of points."""
        return int(self.times.size)

    @property
    def lengths(self) -> Array:
        """Time between neighbours, shape (m - 1,)."""
        return np.diff(self.times)

    @property
    def slopes(self) -> Array:
        """Mean velocity between neighbours, shape (m - 1, n)."""
        return np.diff(self.positions, axis=0) / self.lengths[:, None]

    def row(self, values: ArrayLike, name: str) -> Array:
        """Return `values` as the shape (n,), for a number by component at one end.

        Raises:
            ValueError: When the shape is another, or a value is not finite.
        """
        array = np.asarray(values, dtype=np.float64)
        if array.shape != self.positions.shape[1:] or not np.isfinite(array).all():
            raise ValueError(
                f"{name} must be {self.positions.shape[1]} finite numbers, one a component, got {array}"
            )
        return array

    def rows(self, values: ArrayLike, name: str) -> Array:
        """Return `values` as the shape (m, n), for a number by point and component.

        Raises:
            ValueError: When the shape is another, or a value is not finite.
        """
        array = np.asarray(values, dtype=np.float64)
        if array.shape != self.positions.shape or not np.isfinite(array).all():
            raise ValueError(
                f"{name} must be finite and of shape {self.positions.shape}, got shape {array.shape}"
            )
        return array
