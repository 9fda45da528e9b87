"""Points of a move with what is given at each of them, and what of that cannot be.

Points that follow each other in one place count once: what is given at any of them holds there, and the least
duration of what lay between goes to the next segment.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.errors import Amount, Amounts, PlanningError, Problem, inward
from trajcli.frozen import frozen
from trajcli.kinematics.robot import QUANTITIES, Robot
from trajcli.language.per_joint import NamedValues
from trajcli.language.recorded import SAME_POSITION
from trajcli.language.waypoints import Waypoint
from trajcli.planners.planner import Event
from trajcli.trajectory import State

_ROUNDING = 1e-12
FieldPath = tuple[str | int, ...]


@frozen
class GivenPoints:
    """Points with the velocities and accelerations that are given there.

    Attributes:
        positions: Shape (m, n), rad or m.
        states: Velocity and acceleration, shape (m, n, 2); zero where none is given.
        fixed: Which of them are given, shape (m, n, 2); all at the start and at the target.
        least: Shortest duration of each segment, s, shape (m - 1,).
        fields: Where in the move each point stands; None for the start and recorded points.
        events: What was left out.
    """

    positions: Array
    states: Array
    fixed: NDArray[np.bool_]
    least: Array
    fields: tuple[FieldPath | None, ...]
    events: tuple[Event, ...] = ()

    @property
    def target(self) -> State:
        """The state of the last point."""
        return State(self.positions[-1], self.states[-1, :, 0], self.states[-1, :, 1])

    @property
    def moving(self) -> NDArray[np.bool_]:
        """Which joints do not stand still all the time, shape (n,)."""
        moved: NDArray[np.bool_] = np.ptp(self.positions, axis=0) > 0
        return moved | self.states.any(axis=(0, 2))


def given_points(
    start: State,
    recorded: Array,
    listed: Sequence[tuple[FieldPath, Waypoint]],
    least: Sequence[float] | None,
) -> GivenPoints:
    """Return the points of a move.

    Args:
        start: Where it begins.
        recorded: Points that come first, shape (r, n); r may be 0.
        listed: The points after them with where they stand in the move, the target last.
        least: Shortest duration of each segment, s; None for none.
    """
    rows = [start.position, *recorded, *(point.as_state().position for _, point in listed)]
    positions = np.array(rows)
    states, fixed = np.zeros((*positions.shape, 2)), np.zeros((*positions.shape, 2), dtype=bool)
    states[0] = np.stack([start.velocity, start.acceleration], axis=1)
    before = 1 + len(recorded)
    for k, (_, point) in enumerate(listed, before):
        for order, values in enumerate((point.velocity, point.acceleration)):
            if values is not None:
                states[k, :, order] = values
                fixed[k, :, order] = values.named if isinstance(values, NamedValues) else True
    fixed[[0, -1]] = True
    fields = (*[None] * before, *(path for path, _ in listed))
    times = np.zeros(len(rows) - 1) if least is None else np.array(least)
    return GivenPoints(positions, states, fixed, times, fields)


def without_repeats(points: GivenPoints, robot: Robot) -> GivenPoints:
    """Return the points without those that stand where the one before stands.

    Start and target both stay where all points are one.

    Raises:
        PlanningError: When two points in one place are given different velocities or accelerations.
    """
    same = np.asarray((np.abs(np.diff(points.positions, axis=0)) <= SAME_POSITION).all(axis=1))
    if not same.any() or len(same) == 1:
        return points
    if same.all():
        same = np.append(same[:-1], False)
    groups = np.split(np.arange(len(same) + 1), np.flatnonzero(~same) + 1)
    merged = [_merged(points, group, robot) for group in groups]
    # what lay between points in one place goes to the segment after it, at the target to the one before
    owner = np.minimum(np.cumsum(np.append(0, ~same[:-1])), len(groups) - 2)
    least = np.zeros(len(groups) - 1)
    np.add.at(least, owner, points.least)
    count = int(same.sum())
    text = f"left out {count} waypoint{'s' * (count != 1)} that repeat{'s' * (count == 1)} the one before"
    return GivenPoints(
        points.positions[[group[-1] for group in groups]],
        np.array([states for states, _ in merged]),
        np.array([fixed for _, fixed in merged]),
        least,
        tuple(points.fields[group[-1]] for group in groups),
        (*points.events, Event("merged", text)),
    )


def _merged(points: GivenPoints, group: NDArray[np.intp], robot: Robot) -> tuple[Array, NDArray[np.bool_]]:
    """Return the states (n, 2) of points in one place, and which of them are given."""
    states, fixed = points.states[group[0]], points.fixed[group[0]]
    for k in group[1:].tolist():
        other, given = points.states[k], points.fixed[k]
        apart = fixed & given & (states != other)
        if apart.any():
            joint, order = (int(index) for index in np.argwhere(apart)[0])
            quantity = ("velocities", "accelerations")[order]
            message = f"two points in one place give {{joint}} different {quantity}, {{one}} and {{other}}"
            amounts: Amounts = {
                "joint": robot.joint_names[joint],
                "one": Amount(float(states[joint, order]), order + 1, joint),
                "other": Amount(float(other[joint, order]), order + 1, joint),
            }
            hint = "leave one of the two points out"
            raise PlanningError(Problem(message, hint, amounts=amounts, field=points.fields[k]))
        states, fixed = np.where(given, other, states), fixed | given
    return states, fixed


def require_possible(points: GivenPoints, robot: Robot) -> None:
    """Refuse what is given at a point and cannot be within the limits.

    An acceleration a comes from zero and goes back to it within the jerk limit j: by a |a| / (2 j) the
    velocity was less before, and will be more after.

    Raises:
        PlanningError: With one problem for each point and joint.
    """
    problems = []
    last = len(points.positions) - 1
    for k, joint in np.argwhere(points.fixed.any(axis=2)).tolist():
        found = _flaw(points, k, joint, robot, before=k > 0, after=k < last)
        if found is not None:
            problems.append(found)
    if problems:
        raise PlanningError(*problems)


def _flaw(
    points: GivenPoints, k: int, joint: int, robot: Robot, *, before: bool, after: bool
) -> Problem | None:
    where = "at its start" if not before else "in its target" if not after else f"at point {k}"
    values, given = points.states[k, joint].tolist(), points.fixed[k, joint].tolist()
    name, limits = robot.joint_names[joint], robot.limits
    for order in (1, 2):
        if given[order - 1]:
            low, high = limits.of_order(order)[joint].tolist()
            if not _within(values[order - 1], low, high):
                limit = low if values[order - 1] < 0 else high
                message = f"{{joint}} has {QUANTITIES[order]} {{value}} {where}, beyond its limit {{limit}}"
                hint = f"lower the {QUANTITIES[order]} there, or raise the limit"
                kinds = (order, order)
                return _problem(message, hint, name, joint, kinds, values[order - 1], limit, points.fields[k])
    low, high = limits.velocity[joint].tolist()
    if not all(given):  # the other one is found so that it fits
        return None
    change = values[1] * abs(values[1]) / (2 * float(np.abs(limits.jerk[joint]).min()))
    for counts, reached, when in (
        (before, values[0] - change, "before"),
        (after, values[0] + change, "after"),
    ):
        if counts and not _within(reached, low, high):
            limit = low if reached < 0 else high
            message = (
                f"{{joint}} {where}: within its jerk limit it must move at {{value}} just {when}, "
                "beyond its velocity limit {limit}"
            )
            hint = "lower the acceleration or velocity there, or raise the velocity or jerk limit"
            return _problem(message, hint, name, joint, (1, 1), reached, limit, points.fields[k])
    return None


def _within(value: float, low: float, high: float) -> bool:
    return low * (1 + _ROUNDING) <= value <= high * (1 + _ROUNDING)


def _problem(
    message: str,
    hint: str,
    name: str,
    joint: int,
    orders: tuple[int, int],
    value: float,
    limit: float,
    field: FieldPath | None,
) -> Problem:
    amounts: Amounts = {
        "joint": name,
        "value": Amount(value, orders[0], joint),
        "limit": Amount(limit, orders[1], joint, rounded=inward(limit)),
    }
    return Problem(message, hint, joint=name, value=value, limit=limit, amounts=amounts, field=field)
