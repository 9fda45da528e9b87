"""When a spline passes its points, where only the limits say how fast it may be."""

from __future__ import annotations

import numpy as np

from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.curves.splines.time_allocation import fastest_durations
from trajcli.errors import PlanningError, Problem
from trajcli.kinematics.robot import Robot
from trajcli.planners.point_to_point import missing_limit
from trajcli.planners.spline_rules import Rule, curve_through
from trajcli.planners.through_points import PointTable

_LEAST = 1e-3  # of the mean duration: a piece between points that hardly differ begins with this much


def fastest_spline_times(rule: Rule, points: PointTable, robot: Robot) -> Array:
    """Return the times (m,) of the fastest curve of a rule that keeps the limits, the first zero.

    Raises:
        MissingLimitError: When a moving joint has no limit at all.
        PlanningError: When no durations keep the limits.
    """
    bounds = np.stack([robot.limits.of_order(order) for order in (1, 2, 3)])
    moving = np.ptp(points.positions, axis=0) > 0
    lacking = np.flatnonzero(moving & ~np.isfinite(bounds).all(axis=2).any(axis=0))
    if lacking.size:
        also = "give every waypoint a `time`"
        raise missing_limit(
            "spline", "velocity", lacking.tolist(), robot, "to find when it passes its points", also
        )

    def family(durations: Array) -> PiecewisePolynomial:
        return curve_through(rule, points, np.concatenate([[0.0], np.cumsum(durations)]))

    durations = fastest_durations(family, _guess(points, bounds), bounds)
    if durations is None:
        message = f"no times let rule {rule} pass these points within all limits"
        hint = "an imposed velocity or acceleration asks too much: lower it, or give every waypoint a `time`"
        raise PlanningError(Problem(message, hint))
    return np.concatenate([[0.0], np.cumsum(durations)])


def _guess(points: PointTable, bounds: Array) -> Array:
    """Return the time that the slowest joint needs for each piece, if it could stop at every point."""
    chords = np.abs(np.diff(points.positions, axis=0))
    needed = np.zeros(len(chords))
    for order, limits in enumerate(bounds, 1):
        least = np.abs(limits).min(axis=1)
        needed = np.maximum(needed, ((chords / least) ** (1 / order)).max(axis=1))
    return np.asarray(np.maximum(needed, _LEAST * needed.mean()))
