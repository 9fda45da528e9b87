"""Cubic, quintic and septic polynomials between two boundary states, and their shortest duration."""

from __future__ import annotations

from functools import cache
from math import factorial
from typing import ClassVar, Literal

import numpy as np

from trajcli.curves.extrema import piece_extremes
from trajcli.curves.hermite import hermite_coefficients
from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.errors import PlanningError, Problem, TrajcliError
from trajcli.kinematics.robot import QUANTITIES, Limits, Robot, share_of_limits
from trajcli.language.targets import Duration
from trajcli.planners.boundary_states import same_state, standstill, unknown_duration
from trajcli.planners.planner import Planned
from trajcli.planners.point_to_point.point_to_point import PointToPoint
from trajcli.trajectory import State

_ROOM = 1e-10  # relative; a tenth of the tolerance with which limits are verified
_AMPLE = 1e4  # times the time scale of a move: no longer durations are tried


class PolynomialPlanner(PointToPoint):
    """One polynomial for each joint over the whole move.

    Attributes:
        conditions: Boundary conditions at either end: 2 (cubic), 3 (quintic) or 4 (septic).
    """

    conditions: ClassVar[int]

    one_shape: ClassVar[bool] = True
    proportional: ClassVar[bool] = True

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
        differ = (start[:, lacking] != end[:, lacking]).any(axis=1)
        quantity = QUANTITIES[1 + int(differ.argmax())]  # with a bound on it, the least duration is known
        raise unknown_duration(planner, quantity, lacking.tolist(), robot)
    if not start[1:].any() and not end[1:].any():
        return _from_rest_to_rest(start, end, robot.limits)
    return _by_search(planner, start, end, robot)


def _from_rest_to_rest(start: Array, end: Array, limits: Limits) -> float:
    """Peaks of the normalised polynomial scale with displacement / duration^order; limits give durations."""
    displacement, longest = end[0] - start[0], 0.0
    for order, peaks in enumerate(_normalised_peaks(start.shape[0]), 1):
        bounds = limits.of_order(order)
        for peak in peaks:
            allowed = np.where(peak * displacement < 0, -bounds[:, 0], bounds[:, 1])
            longest = max(longest, float(np.max((np.abs(peak * displacement) / allowed) ** (1 / order))))
    return longest


@cache
def _normalised_peaks(conditions: int) -> tuple[tuple[float, float], ...]:
    """Return the least and largest value of each derivative, order 1 to 3, from 0 to 1 in the time 1."""
    unit_end = np.zeros((conditions, 1))
    unit_end[0] = 1.0
    unit = hermite_coefficients(np.zeros((conditions, 1)), unit_end, np.array(1.0))[:, None, :]
    extremes = piece_extremes(unit, np.ones(1), (1, 2, 3))
    return tuple((float(low[0, 0]), float(high[0, 0])) for low, high in extremes)


def _by_search(planner: str, start: Array, end: Array, robot: Robot) -> float:
    """Return the shortest feasible duration; with moving ends these need not form one interval."""
    low, high = _least_duration(start, end, robot.limits), _ample_duration(start, end, robot.limits)
    if low == 0:
        joints = np.flatnonzero((start != end).any(axis=0) | start[1:].any(axis=0)).tolist()
        quantity = "jerk" if np.isfinite(robot.limits.acceleration[joints]).all() else "acceleration"
        raise unknown_duration(planner, quantity, joints, robot)

    def excess(durations: Array) -> Array:
        return _share(start, end, durations, robot.limits) - (1 + _ROOM)

    from trajcli.curves.smallest_feasible import smallest_feasible

    duration = smallest_feasible(excess, low, high)
    if duration is None:
        message = f"no duration up to {high:.3g} s lets {planner} keep all limits between these states"
        hint = "a boundary velocity or acceleration asks too much: lower it"
        raise PlanningError(Problem(message, hint + _or_jerk_limited(start, end, robot)))
    return duration


def _or_jerk_limited(start: Array, end: Array, robot: Robot) -> str:
    """Return the words that propose the fastest motion within the limits, where there is one."""
    from trajcli.planners.point_to_point.jerk_limited import Request, plan_motion

    still = np.zeros_like(start[0])
    states = [State(*(rows[k] if k < len(rows) else still for k in range(3))) for rows in (start, end)]
    try:
        curve = plan_motion(Request(states[0], states[1], "position", "time", 0.0), robot).curve
    except TrajcliError:
        return ""
    extremes = piece_extremes(curve.coefficients, curve.lengths, (0, 1, 2, 3))
    return ", or use jerk_limited" if share_of_limits(extremes, robot.limits).max() < 1 + 10 * _ROOM else ""


def _least_duration(start: Array, end: Array, limits: Limits) -> float:
    """Return a duration below which no motion whatever gets from `start` to `end`; 0 where none is known.

    By Taylor's formula derivative b changes in the time T by at most sum_i |q^(i)(0)| T^(i-b) / (i-b)!, i
    from b + 1 up to m - 1, plus L_m T^(m-b) / (m-b)! where |q^(m)| <= L_m: one term makes up its share.
    """
    largest = [np.abs(limits.of_order(order)).max(axis=1) for order in range(4)]
    longest = 0.0
    for order in (1, 2, 3):
        for below in range(min(order, start.shape[0])):
            sizes = [np.abs(start[i]) if i < start.shape[0] else largest[i] for i in range(below + 1, order)]
            change, count = np.abs(end[below] - start[below]), order - below
            with np.errstate(divide="ignore", invalid="ignore"):
                times = [
                    (change / count * factorial(power) / size) ** (1 / power)
                    for power, size in enumerate([*sizes, largest[order]], 1)
                ]
            longest = max(longest, float(np.where(change > 0, np.min(times, axis=0), 0.0).max()))
    return longest


def _ample_duration(start: Array, end: Array, limits: Limits) -> float:
    """Return a duration far above the times that the displacement and the boundary rates ask for."""
    sizes = np.abs(start) + np.abs(end)
    sizes[0] = np.abs(end[0] - start[0])
    scale = _least_duration(start, end, limits)
    for order in (1, 2, 3):
        bound = np.abs(limits.of_order(order)).min(axis=1)
        for below in range(min(order, start.shape[0])):
            scale = max(scale, float(np.max((sizes[below] / bound) ** (1 / (order - below)))))
    return _AMPLE * scale


def _share(start: Array, end: Array, durations: Array, limits: Limits) -> Array:
    """Return how much of the limits the polynomials of the given durations use, shape (k,)."""
    shape = (start.shape[0], durations.size, start.shape[1])
    first, last = (np.broadcast_to(ends[:, None, :], shape) for ends in (start, end))
    coefficients = hermite_coefficients(first, last, durations[:, None])
    return share_of_limits(piece_extremes(coefficients, durations, (0, 1, 2, 3)), limits)


class Cubic(PolynomialPlanner):
    """Third degree: position and velocity imposed at both ends; the acceleration steps there.

    Source: Siciliano et al., Robotics: Modelling, Planning and Control (2009), section 4.2.1.
    """

    continuity: ClassVar[Literal[1, 2]] = 1
    imposes: ClassVar[int] = 1
    conditions: ClassVar[int] = 2

    planner: Literal["cubic"] = "cubic"


class Quintic(PolynomialPlanner):
    """Fifth degree: position, velocity and acceleration imposed at both ends.

    Source: Siciliano et al., Robotics: Modelling, Planning and Control (2009), section 4.2.1.
    """

    continuity: ClassVar[Literal[1, 2]] = 2
    imposes: ClassVar[int] = 2
    conditions: ClassVar[int] = 3

    planner: Literal["quintic"] = "quintic"


class Septic(PolynomialPlanner):
    """Seventh degree: position, velocity and acceleration imposed at both ends, jerk zero there.

    Source: Biagiotti and Melchiorri, Trajectory Planning for Automatic Machines and Robots (2008), section
    2.1.5.
    """

    continuity: ClassVar[Literal[1, 2]] = 2
    imposes: ClassVar[int] = 2
    conditions: ClassVar[int] = 4

    planner: Literal["septic"] = "septic"
