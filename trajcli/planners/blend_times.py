"""When `blends` passes its points, and how long its blends last, where only the limits say so."""

from __future__ import annotations

from typing import Literal

import numpy as np

from trajcli.curves.parabolic_blends.blends import blended
from trajcli.curves.parabolic_blends.fastest import fastest_blends
from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.curves.splines.time_allocation import fastest_durations
from trajcli.errors import PlanningError
from trajcli.frozen import frozen
from trajcli.kinematics.robot import Robot
from trajcli.planners.point_to_point import missing_limit
from trajcli.planners.through_points import PointTable

Ends = Literal["centred", "inside"]

_SHARES = (0.15, 0.25, 0.35, 0.44)  # of the shorter segment: with more, two blends that pass exactly overlap


def blend_times(
    points: PointTable, blends: Array | None, robot: Robot, acceleration: Array, ends: Ends, *, exactly: bool
) -> tuple[Array, Array]:
    """Return times (m,), the first zero, and blends (m,), s, of the fastest motion that keeps the limits.

    Args:
        points: m of them, not all in one place.
        blends: Durations (m,) where they are given, s.
        robot: Its limit of velocity counts.
        acceleration: Bounds, shape (n, 2).
        ends: Where the first and the last blend lie.
        exactly: Whether the points are passed exactly.

    Raises:
        MissingLimitError: When a joint that moves has no limit of acceleration.
        PlanningError: When no times keep the limits.
    """
    moving = np.ptp(points.positions, axis=0) > 0
    lacking = np.flatnonzero(moving & ~np.isfinite(acceleration).all(axis=1))
    if lacking.size:
        also = ("give every waypoint a `time`", "give the move an `acceleration`")
        why = "to find when it passes its points"
        raise missing_limit("blends", "acceleration", lacking.tolist(), robot, why, *also)
    velocity = robot.limits.velocity
    segments, found = fastest_blends(points.positions, velocity, acceleration, ends=ends)
    if blends is None and not exactly:
        return np.concatenate([[0.0], np.cumsum(segments)]), found
    shares = _SHARES if blends is None else (None,)
    bounds = np.stack([velocity, acceleration, np.tile([-np.inf, np.inf], (len(velocity), 1))])
    best: tuple[Array, Array] | None = None
    for share in shares:
        family = _Family(points.positions, blends, share, ends, exactly)
        durations = fastest_durations(family.curve, segments, bounds)
        if durations is not None and (best is None or durations.sum() < best[0][-1]):
            best = np.concatenate([[0.0], np.cumsum(durations)]), family.blends(durations)
    if best is None:
        hint = "give every waypoint a `time`, or longer blends"
        raise PlanningError("no times let the blends keep all limits", hint=hint)
    return best


@frozen
class _Family:
    """The curves that differ in the durations of their segments alone.

    Attributes:
        positions: Shape (m, n).
        given: Durations of the blends, shape (m,), s; None where they are a share of the segments.
        share: Of the shorter segment beside a point.
        ends: Where the first and the last blend lie.
        exactly: Whether the points are passed exactly.
    """

    positions: Array
    given: Array | None
    share: float | None
    ends: Ends
    exactly: bool

    def blends(self, segments: Array) -> Array:
        """Return the durations (m,) of the blends."""
        if self.given is not None:
            return self.given
        padded = np.pad(segments, 1, mode="edge")
        return np.asarray((self.share or 1.0) * np.minimum(padded[:-1], padded[1:]))

    def curve(self, segments: Array) -> PiecewisePolynomial:
        """Return the curve."""
        times = np.concatenate([[0.0], np.cumsum(segments)])
        blends = self.blends(segments)
        return blended(times, self.positions, blends, ends=self.ends, exactly=self.exactly).curve
