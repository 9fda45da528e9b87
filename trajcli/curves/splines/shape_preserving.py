"""Shape-preserving splines: between two waypoints the curve never leaves their box, and never turns back.

Source: Fritsch and Carlson, Monotone piecewise cubic interpolation, SIAM J. Numer. Anal. 17 (1980), for the
velocities that keep a cubic monotone; Fritsch and Butland, A method for constructing local monotone piecewise
cubic interpolants, SIAM J. Sci. Stat. Comput. 5 (1984), for the inner velocities.
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.curves.splines.hermite import cubic_through
from trajcli.curves.splines.slopes import Waypoints

_ALWAYS = 3.0  # times the slope: keeps a cubic monotone whatever the other end does within the same bound


class ShapeError(ValueError):
    """An end velocity would make the curve leave the box of its waypoints.

    Attributes:
        component: Index of the component.
        end: "first" or "last".
        velocity: The one given.
        low: The smallest that is possible.
        high: The largest that is possible.
    """

    def __init__(
        self, component: int, end: Literal["first", "last"], velocity: float, low: float, high: float
    ) -> None:
        super().__init__(
            f"{end} velocity {velocity!r} of component {component} would leave the box of the waypoints: "
            f"it must be in [{low!r}, {high!r}]"
        )
        self.component, self.end, self.velocity, self.low, self.high = component, end, velocity, low, high


def shape_preserving(
    times: ArrayLike, positions: ArrayLike, first: ArrayLike | None = None, last: ArrayLike | None = None
) -> PiecewisePolynomial:
    """Return the cubics that are monotone between any two waypoints; the velocity is continuous.

    An inner point that is higher than both neighbours, lower than both, or as high as one of them, is passed
    with velocity zero; any other with a weighted harmonic mean of the slopes beside it.

    Args:
        times: Shape (m,), strictly increasing, m >= 2.
        positions: Shape (m, n).
        first: Velocity at the start, shape (n,); zero unless given.
        last: Velocity at the end, shape (n,); zero unless given.

    Raises:
        ShapeError: When an end velocity is against the direction of its interval, or too large for it.
        ValueError: When times do not increase, or shapes do not fit.
    """
    points = Waypoints(np.asarray(times), np.asarray(positions))
    velocities = np.zeros(points.positions.shape)
    velocities[1:-1] = _harmonic_means(points)
    for k, given, name in ((0, first, "first"), (-1, last, "last")):
        if given is not None:
            velocities[k] = points.row(given, f"{name} velocity")
    # of two ends on one interval at most one may be above the bound that always holds
    _check(points.slopes[0], velocities[0], velocities[1], "first")
    _check(points.slopes[-1], velocities[-1], velocities[-2], "last")
    return cubic_through(points.times, points.positions, velocities)


def _harmonic_means(points: Waypoints) -> Array:
    """Return the velocities of inner points, shape (m - 2, n); at most three times the smaller slope."""
    before, after = points.slopes[:-1], points.slopes[1:]
    earlier, later = points.lengths[:-1, None], points.lengths[1:, None]
    share = (earlier + 2 * later) / (3 * (earlier + later))
    small, large = np.minimum(np.abs(before), np.abs(after)), np.maximum(np.abs(before), np.abs(after))
    of_small = np.where(np.abs(before) < np.abs(after), share, 1 - share)
    same = np.sign(before) * np.sign(after) > 0
    size = small / (of_small + (1 - of_small) * np.divide(small, large, out=np.ones_like(small), where=same))
    return np.where(same, np.copysign(size, before), 0.0)


def _check(slope: Array, velocity: Array, other: Array, end: Literal["first", "last"]) -> None:
    """Raise ShapeError when a piece with the given mean slope and velocities, each (n,), is not monotone."""
    for component, (mean, own, opposite) in enumerate(
        zip(slope.tolist(), velocity.tolist(), other.tolist(), strict=True)
    ):
        bound = mean * _largest_ratio(opposite / mean) if mean else 0.0
        low, high = min(bound, 0.0), max(bound, 0.0)
        if not low <= own <= high:
            raise ShapeError(component, end, own, low, high)


def _largest_ratio(other: float) -> float:
    """Return the largest velocity over slope at one end of a monotone cubic; `other` is at the other end.

    It is the far side of the ellipse x^2 + x y + y^2 - 6 x - 6 y + 9 = 0, between 3 and 4. Where the other
    end is above 3 it has a check of its own, which refuses every pair outside of the ellipse.
    """
    y = min(max(other, 0.0), _ALWAYS)
    return (6 - y + math.sqrt(3 * y * (4 - y))) / 2
