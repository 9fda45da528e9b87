"""Which curve each rule of `spline` means, and what it lets its ends impose."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.curves.splines.cubic import clamped, natural, not_a_knot
from trajcli.curves.splines.hermite import (
    computed_accelerations,
    computed_velocities,
    cubic_through,
    parabola_velocities,
    quintic_through,
)
from trajcli.curves.splines.shape_preserving import shape_preserving
from trajcli.curves.splines.virtual_points import continuous_acceleration
from trajcli.planners.through_points import PointTable

Rule = Literal[
    "imposed",
    "computed",
    "continuous_acceleration",
    "natural",
    "clamped",
    "not_a_knot",
    "quintic",
    "shape_preserving",
]
FREE_ENDS: tuple[Rule, ...] = ("natural", "not_a_knot")
IMPOSES: dict[Rule, int] = {
    "imposed": 1,
    "computed": 1,
    "continuous_acceleration": 2,
    "natural": 0,
    "clamped": 1,
    "not_a_knot": 0,
    "quintic": 2,
    "shape_preserving": 1,
}
"""Highest derivative that the ends impose."""


def curve_through(
    rule: Rule, points: PointTable, times: Array, virtual_times: Sequence[float] | None = None
) -> PiecewisePolynomial:
    """Return the curve of a rule.

    Args:
        rule: Its name.
        points: m of them.
        times: Shape (m,), increasing, the first zero.
        virtual_times: Of the two virtual points of continuous_acceleration.

    Raises:
        ShapeError: When an end velocity does not let shape_preserving be monotone.
        ValueError: When a virtual time is outside its interval.
    """
    q, (first, last), (start, end) = points.positions, points.rates[0, [0, -1]], points.rates[1, [0, -1]]
    match rule:
        case "imposed":
            return cubic_through(times, q, points.rates[0])
        case "computed":
            return cubic_through(times, q, computed_velocities(times, q, first, last))
        case "continuous_acceleration":
            return continuous_acceleration(times, q, (first, last), (start, end), virtual_times)
        case "natural":
            return natural(times, q, *_imposed(first, last))
        case "not_a_knot":
            return not_a_knot(times, q, *_imposed(first, last))
        case "clamped":
            return clamped(times, q, first, last)
        case "shape_preserving":
            return shape_preserving(times, q, first, last)
        case _:
            return _quintic(points, times)


def _imposed(first: Array, last: Array) -> tuple[Array | None, Array | None]:
    """Return the end velocities that are not zero: at a point at rest the rule decides."""
    return first if first.any() else None, last if last.any() else None


def _quintic(points: PointTable, times: Array) -> PiecewisePolynomial:
    """Return the quintics; what a point does not give is computed."""
    ends = points.rates[:, [0, -1]]
    velocities = parabola_velocities(times, points.positions, *ends[0])
    given = points.given.copy()
    given[:, [0, -1]] = True
    velocities = np.where(given[0][:, None], points.rates[0], velocities)
    accelerations = computed_accelerations(times, velocities, *ends[1])
    accelerations = np.where(given[1][:, None], points.rates[1], accelerations)
    return quintic_through(times, points.positions, velocities, accelerations)
