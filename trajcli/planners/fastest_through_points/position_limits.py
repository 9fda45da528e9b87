"""Positions of motions between states at points: how near they come to the limits, and how that changes.

A joint that takes a duration T from point to point goes at most V T / 2 beyond both, at its velocity limit V.
Where its limits are farther away there is nothing to find out.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.frozen import frozen
from trajcli.planners.fastest_through_points.problem import WaypointProblem
from trajcli.planners.fastest_through_points.state_times import set_limits

_DIFFERENCE = 1e-5  # of the scale of a state
_TOUCH = 1e-10  # rad or m: a position limit passed by less is touched


@frozen
class Room:
    """Distances of positions from their limits.

    Attributes:
        distance: From the lower and upper limit at the extremes, shape (K, n, 2); infinite where there is
            plenty.
        slopes: Of the lowest and highest position by the states before and after, in units of their scales,
            shape (K, n, 2, 4).
    """

    distance: Array
    slopes: Array


def with_limits_near(problem: WaypointProblem, times: Array) -> WaypointProblem:
    """Return the problem without position limits that are out of the joints' way for such times (K,)."""
    near = np.array(_near(problem, 2 * times).any(axis=0))[:, None]
    return replace(problem, position=np.where(near, problem.position, [-np.inf, np.inf]))


def _near(problem: WaypointProblem, times: Array) -> NDArray[np.bool_]:
    """Return which joints may leave their limits in which segment, shape (K, n)."""
    beyond = 0.5 * np.abs(problem.velocity).max(axis=1) * times[:, None]
    points = problem.points
    low, high = problem.position.T
    over = np.maximum(points[:-1], points[1:]) + beyond > high
    under = np.minimum(points[:-1], points[1:]) - beyond < low
    return np.asarray(over | under)


def leaving(problem: WaypointProblem, times: Array, states: Array) -> NDArray[np.bool_]:
    """Return which joints leave their limits in which segment, (K, n).

    Args:
        problem: Points and limits.
        times: Of the segments, shape (K,).
        states: Shape (K + 1, n, 2).
    """
    found = np.zeros(problem.steps.shape, dtype=bool)
    one = _OneJoint(problem)
    for k, j in np.argwhere(_near(problem, times)).tolist():
        low, high = one.extremes(k, j, times[k], np.concatenate([states[k, j], states[k + 1, j]]))
        lower, upper = problem.position[j].tolist()
        found[k, j] = low < lower - _TOUCH or high > upper + _TOUCH
    return found


def distances(problem: WaypointProblem, times: Array, states: Array) -> Room:
    """Return how near positions come to their limits, for times (K,) and states (K + 1, n, 2)."""
    segments, joints = problem.steps.shape
    distance, slopes = np.full((segments, joints, 2), np.inf), np.zeros((segments, joints, 2, 4))
    sizes = _DIFFERENCE * np.concatenate([problem.scales, problem.scales], axis=1)
    one = _OneJoint(problem)
    for k, j in np.argwhere(_near(problem, times)).tolist():
        pair = np.concatenate([states[k, j], states[k + 1, j]])
        here = one.extremes(k, j, times[k], pair)
        if not np.isfinite(here).all():
            continue
        distance[k, j] = (here - problem.position[j]) * [1, -1]
        for c, step in enumerate(np.diag(sizes[j])):
            sides = [sign * (one.extremes(k, j, times[k], pair + sign * step) - here) for sign in (1, -1)]
            finite = [side for side in sides if np.isfinite(side).all()]  # beyond limits there is no motion
            slopes[k, j, :, c] = np.mean(finite, axis=0) / _DIFFERENCE if finite else 0.0
    return Room(distance, slopes)


def _extremes(
    position: float, velocity: float, acceleration: float, phases: Iterable[tuple[float, float]]
) -> Array:
    """Return the extremes of the position over phases (duration, jerk); ruckig's are wrong at times."""
    reached = [position]
    p, v, a = position, velocity, acceleration
    for time, jerk in phases:
        square = a * a - 2 * jerk * v
        if square >= 0:
            root = math.copysign(math.sqrt(square), a)
            zeros = [-2 * v / (a + root) if a + root else -1.0, -(a + root) / jerk if jerk else -1.0]
            reached += [p + z * (v + z * (a / 2 + z * jerk / 6)) for z in zeros if 0 < z < time]
        p += time * (v + time * (a / 2 + time * jerk / 6))
        v += time * (a + time * jerk / 2)
        a += time * jerk
        reached.append(p)
    return np.array([min(reached), max(reached)])


class _OneJoint:
    """Extremes of the position of one joint over one segment of given duration."""

    def __init__(self, problem: WaypointProblem) -> None:
        import ruckig

        self._problem = problem
        self._solver, self._answer = ruckig.Ruckig(1), ruckig.Trajectory(1)
        self._wanted = ruckig.InputParameter(1)
        self._errors, self._working = (ruckig.RuckigError, ValueError), ruckig.Result.Working

    def extremes(self, segment: int, joint: int, duration: float, pair: Array) -> Array:
        """Return the smallest and the largest position; not numbers where there is no motion."""
        problem, wanted, one = self._problem, self._wanted, slice(joint, joint + 1)
        set_limits(wanted, problem.velocity[one], problem.acceleration[one], problem.jerk[one])
        wanted.current_position = problem.points[segment, one].tolist()
        wanted.target_position = problem.points[segment + 1, one].tolist()
        wanted.current_velocity, wanted.current_acceleration = [float(pair[0])], [float(pair[1])]
        wanted.target_velocity, wanted.target_acceleration = [float(pair[2])], [float(pair[3])]
        wanted.minimum_duration = float(duration)
        with suppress(*self._errors):
            if self._solver.calculate(wanted, self._answer) == self._working:
                profile = self._answer.profiles[0][0]
                brake = profile.brake
                phases = [*zip(brake.t, brake.j, strict=True), *zip(profile.t, profile.j, strict=True)]
                begin = float(problem.points[segment, joint]), float(pair[0]), float(pair[1])
                return _extremes(*begin, phases)
        return np.full(2, np.nan)
