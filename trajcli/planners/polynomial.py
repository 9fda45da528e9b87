"""The polynomial through two boundary states, and the shortest time it may take within limits."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from trajcli.curves.extrema import piece_extremes
from trajcli.curves.hermite import hermite_coefficients
from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.errors import PlanningError, Problem
from trajcli.kinematics.robot import Limits, Robot
from trajcli.planners.fields import Duration
from trajcli.planners.planner import Planned
from trajcli.planners.point_to_point import PointToPoint, missing_limit, same_state, standstill
from trajcli.trajectory import State

_ROOM = 1e-10  # relative; a tenth of the tolerance with which limits are verified
_CANDIDATES = 256
_ROUNDS = 7


class PolynomialPlanner(PointToPoint):
    """One polynomial for each joint over the whole move.

    Attributes:
        conditions: Boundary conditions at either end: 2 (cubic), 3 (quintic) or 4 (septic).
    """

    conditions: ClassVar[int]

    duration: Duration | None = None

    def plan(self, start: State, robot: Robot) -> Planned:
        """Return the polynomial from `start` to the target.

        Raises:
            MissingLimitError: When the duration is left out and a moving joint has no limit.
            PlanningError: When no duration keeps the limits.
        """
        end = self.to.as_state()
        if same_state(start, end) and (start.at_rest or self.duration is None):
            return standstill(end, self.duration or 0.0)
        first, last = self._conditions(start), self._conditions(end)
        duration = self.duration or fastest_duration(self.tag, first, last, robot)
        coefficients = hermite_coefficients(first, last, np.array(duration))
        return Planned(PiecewisePolynomial(np.array([0.0, duration]), coefficients[:, None, :]), end)

    def _conditions(self, state: State) -> Array:
        rows = [state.position, state.velocity, state.acceleration, np.zeros_like(state.position)]
        return np.stack(rows[: self.conditions])


def fastest_duration(planner: str, start: Array, end: Array, robot: Robot) -> float:
    """Return the shortest duration (s) in which the polynomial between two states keeps all limits.

    Args:
        planner: Tag for messages.
        start: Shape (k, n), derivatives of order 0 to k - 1.
        end: The same at the end.
        robot: Its limits are kept for all t.

    Raises:
        MissingLimitError: When a moving joint has neither velocity, acceleration nor jerk limit.
        PlanningError: When no duration keeps the limits.
    """
    moving = ((start != end).any(axis=0)) | start[1:].any(axis=0)
    bounded = np.any([np.isfinite(robot.limits.of_order(order)).all(axis=1) for order in (1, 2, 3)], axis=0)
    lacking = np.flatnonzero(moving & ~bounded)
    if lacking.size:
        why = "to find its fastest duration"
        raise missing_limit(planner, "velocity", lacking.tolist(), robot, why, "give the move a `duration`")
    if not start[1:].any() and not end[1:].any():
        return _from_rest_to_rest(start, end, robot.limits)
    return _by_search(planner, start, end, robot)


def _from_rest_to_rest(start: Array, end: Array, limits: Limits) -> float:
    """Peaks of the normalised polynomial scale with displacement / duration^order: each limit gives a duration."""
    k, displacement = start.shape[0], end[0] - start[0]
    unit_end = np.zeros((k, 1))
    unit_end[0] = 1.0
    unit = hermite_coefficients(np.zeros((k, 1)), unit_end, np.array(1.0))[:, None, :]
    longest = 0.0
    for order, (low, high) in enumerate(piece_extremes(unit, np.ones(1), (1, 2, 3)), 1):
        bounds = limits.of_order(order)
        for peak in (float(low[0, 0]), float(high[0, 0])):
            allowed = np.where(peak * displacement < 0, -bounds[:, 0], bounds[:, 1])
            longest = max(longest, float(np.max((np.abs(peak * displacement) / allowed) ** (1 / order))))
    return longest


def _by_search(planner: str, start: Array, end: Array, robot: Robot) -> float:
    """Return the shortest feasible duration; with moving ends the set of feasible ones need not be an interval.

    A geometric grid brackets the first feasible candidate, and is laid again into the bracket until it is closed.
    """
    scale = _time_scale(start, end, robot.limits)
    low, high = scale * 1e-2, scale * 1e4
    for _ in range(_ROUNDS):
        candidates = np.geomspace(low, high, _CANDIDATES)
        feasible = np.flatnonzero(_keeps_limits(start, end, candidates, robot.limits))
        if not feasible.size:
            message = f"no duration between {low:.3g} s and {high:.3g} s lets {planner} keep all limits between these states"
            raise PlanningError(
                Problem(
                    message,
                    "a boundary velocity or acceleration asks too much: lower it, or use jerk_limited",
                )
            )
        first = int(feasible[0])
        low, high = float(candidates[max(first - 1, 0)]), float(candidates[first])
    return high


def _time_scale(start: Array, end: Array, limits: Limits) -> float:
    """Return the longest of the times that the displacement and each change of a derivative ask for."""
    change = np.abs(end - start)
    scale = 0.0
    for order in (1, 2, 3):
        size = np.min(np.abs(limits.of_order(order)), axis=1)
        for below in range(min(order, start.shape[0])):
            scale = max(scale, float(np.max((change[below] / size) ** (1 / (order - below)))))
    return scale or 1e-3


def _keeps_limits(start: Array, end: Array, durations: Array, limits: Limits) -> Array:
    shape = (start.shape[0], durations.size, start.shape[1])
    first, last = (np.broadcast_to(ends[:, None, :], shape) for ends in (start, end))
    coefficients = hermite_coefficients(first, last, durations[:, None])
    kept = np.ones(durations.size, dtype=bool)
    for order, (low, high) in enumerate(piece_extremes(coefficients, durations, (0, 1, 2, 3))):
        bounds = limits.of_order(order)
        room = _ROOM * np.where(np.isfinite(bounds), np.abs(bounds), 0.0) + 1e-13
        kept &= ((low >= bounds[:, 0] - room[:, 0]) & (high <= bounds[:, 1] + room[:, 1])).all(axis=1)
    return kept
