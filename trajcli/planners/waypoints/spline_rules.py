"""Rules of splines through waypoints: the curve of each, and times at the points that the limits allow.

Source: Siciliano et al. (2009), section 4.2.2; Biagiotti and Melchiorri (2008), chapter 4.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from typing import Literal

import numpy as np

from trajcli.curves.operations import times_at
from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.curves.splines.cubic import clamped, natural, not_a_knot
from trajcli.curves.splines.hermite import (
    computed_accelerations,
    computed_velocities,
    cubic_through,
    parabola_velocities,
    quintic_through,
    shape_preserving,
)
from trajcli.curves.splines.time_allocation import CurveFamily, DensePoints, fastest_durations
from trajcli.curves.splines.virtual_points import continuous_acceleration
from trajcli.errors import Amount, Amounts, PlanningError, Problem
from trajcli.kinematics.robot import Robot
from trajcli.planners.boundary_states import missing_limit
from trajcli.planners.planner import Event
from trajcli.planners.waypoints.through_points import PointTable

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
    "natural": 1,
    "clamped": 1,
    "not_a_knot": 1,
    "quintic": 2,
    "shape_preserving": 1,
}
"""Highest derivative that the ends can impose; those of `FREE_ENDS` do where a velocity is stated."""
INNER: dict[Rule, int] = {"imposed": 1, "quintic": 2}
"""The same of the points between."""
_NEARLY = 1.05  # times the fastest motion along a path: times within it need no remark
_MANY = 32  # points from which on the fastest motion along a path says how they may be passed
_DENSE = 72  # points from which on few parameters say how they may be passed within a jerk limit
_UNEVEN = 4.0  # distances of points that differ by more are counted in a parameter
_LEAST = 1e-3  # of the mean duration: a piece between points that hardly differ begins with this much


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
            return natural(times, q, *_imposed(points))
        case "not_a_knot":
            return not_a_knot(times, q, *_imposed(points))
        case "clamped":
            return clamped(times, q, first, last)
        case "shape_preserving":
            return shape_preserving(times, q, first, last)
        case _:
            return _quintic(points, times)


def _imposed(points: PointTable) -> tuple[Array | None, Array | None]:
    """Return the velocities that the ends impose in the place of the rule's condition.

    At the start it is that of the arm, unless it stands; at the end one that is stated, zero included.
    """
    first, last = points.rates[0, [0, -1]]
    return first if first.any() else None, last if points.given[0, -1] else None


def _quintic(points: PointTable, times: Array) -> PiecewisePolynomial:
    """Return the quintics; what a point does not give is computed."""
    ends = points.rates[:, [0, -1]]
    velocities = parabola_velocities(times, points.positions, *ends[0])
    velocities = np.where(points.given[0][:, None], points.rates[0], velocities)
    accelerations = computed_accelerations(times, velocities, *ends[1])
    accelerations = np.where(points.given[1][:, None], points.rates[1], accelerations)
    return quintic_through(times, points.positions, velocities, accelerations)


def fastest_spline_times(rule: Rule, points: PointTable, robot: Robot) -> tuple[Array, tuple[Event, ...]]:
    """Return the times (m,) of the fastest curve of a rule that keeps the limits, the first zero.

    They are a local optimum. Where a motion along about the same path that knows no jerk limit is clearly
    faster, an event says so.

    Raises:
        MissingLimitError: When a moving joint has no limit at all.
        PlanningError: When no durations keep the limits.
    """
    bounds = np.stack([robot.limits.of_order(order) for order in (1, 2, 3)])
    guess, moving = _guess(points, bounds), np.ptp(points.positions, axis=0) > 0
    lacking = np.flatnonzero(moving & ~np.isfinite(bounds).all(axis=2).any(axis=0))
    quantity = "velocity"
    if not guess.any() and not lacking.size:  # back to where it starts, and only velocities are limited
        lacking, quantity = np.flatnonzero(points.rates.any(axis=(0, 1))), "acceleration"
    if lacking.size:
        why, also = "to find when it passes its points", "give every waypoint a `time`"
        raise missing_limit("spline", quantity, lacking.tolist(), robot, why, also)

    def family(durations: Array) -> PiecewisePolynomial:
        return curve_through(rule, points, np.concatenate([[0.0], np.cumsum(durations)]))

    along = list(_path_durations(points.positions, robot))
    further = [*along, *_dense_durations(rule, points, bounds, family, [*along, guess][0])]
    durations = fastest_durations(family, guess, bounds, further)
    if durations is None:
        message = f"no times let rule {rule} pass these points within all limits"
        hint = "an imposed velocity or acceleration asks too much: lower it, or give every waypoint a `time`"
        raise PlanningError(Problem(message, hint))
    events = _faster_along(float(durations.sum()), [float(h.sum()) for h in along])
    return np.concatenate([[0.0], np.cumsum(durations)]), events


def _faster_along(duration: float, others: list[float]) -> tuple[Event, ...]:
    """Return the event of times that a motion along the path without a jerk limit falls far below."""
    least = min(others, default=duration)
    if duration <= _NEARLY * least:
        return ()
    message = (
        "the times of the points were found by a search for a local optimum, {duration} in all: faster ones "
        "may exist, as a path through these points takes {least} without a jerk limit"
    )
    amounts: Amounts = {"duration": Amount(duration), "least": Amount(least)}
    return (Event("local_optimum", message, amounts=amounts),)


def _guess(points: PointTable, bounds: Array) -> Array:
    """Return the time that the slowest joint needs for each piece, if it could stop at every point.

    Where it goes back to where it starts, this is the time that the rates of its ends need.
    """
    chords = np.abs(np.diff(points.positions, axis=0))
    needed = np.zeros(len(chords))
    for order, limits in enumerate(bounds, 1):
        least = np.abs(limits).min(axis=1)
        needed = np.maximum(needed, ((chords / least) ** (1 / order)).max(axis=1))
        if not chords.any():
            for below, rates in enumerate(np.abs(points.rates).max(axis=1)[: order - 1], 1):
                needed = np.maximum(needed, ((rates / least) ** (1 / (order - below))).max())
    return np.asarray(np.maximum(needed, _LEAST * needed.mean()))


def _dense_durations(
    rule: Rule, points: PointTable, bounds: Array, family: CurveFamily, guess: Array
) -> Iterator[Array]:
    """Yield durations for points so dense that a jerk limit ties many of them together."""
    moving = np.ptp(points.positions, axis=0) > 0
    if points.count <= _DENSE or not np.isfinite(bounds[2, moving]).all():
        return

    index = np.arange(points.count, dtype=np.float64)
    chords = np.linalg.norm(np.diff(points.positions, axis=0), axis=1)
    parameters = [index]
    if chords.min() * _UNEVEN < chords.max():
        parameters.append(np.concatenate([[0.0], np.cumsum(chords + chords.mean() / _UNEVEN)]))
    for u in parameters:
        slopes = None if rule in FREE_ENDS else _end_slopes(points, u)
        durations = DensePoints(family, u, bounds, slopes).durations(guess)
        if durations is not None:
            yield durations


def _end_slopes(points: PointTable, parameter: Array) -> tuple[float, float]:
    """Return du/dt with which the curve through the points has the velocities of its ends."""
    along = [
        side[k]
        for side, k in zip(not_a_knot(parameter, points.positions).piece_ends(1), (0, -1), strict=True)
    ]
    ends = points.rates[0, [0, -1]]
    first, last = (
        max(float(v @ d) / float(d @ d), 0.0) if d.any() else 0.0 for v, d in zip(ends, along, strict=True)
    )
    return first, last


def _path_durations(positions: Array, robot: Robot) -> Iterator[Array]:
    """Yield the durations of the fastest motion along a cubic through the points, if they are many.

    Where points are dense, the time from one to the next with a stop at both says little of how fast they may
    be passed.
    """
    moving = np.ptp(positions, axis=0) > 0
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(positions, axis=0), axis=1))])
    limited = np.isfinite(robot.limits.acceleration[moving]).all()
    if len(positions) <= _MANY or not limited or not (np.diff(s) > np.spacing(s[-1])).all():
        return
    from trajcli.curves.time_optimal.parameterization import time_optimal
    from trajcli.curves.time_optimal.passes import UnlimitedSpeedError

    with suppress(UnlimitedSpeedError):
        law = time_optimal(not_a_knot(s, positions), robot.limits.velocity, robot.limits.acceleration).law
        durations = np.diff(times_at(law, s))
        if (durations > 0).all():
            yield durations
