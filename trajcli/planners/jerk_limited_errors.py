"""Why there is no jerk-limited motion, joint by joint."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from trajcli.errors import Amount, MissingLimitError, PlanningError, Problem
from trajcli.kinematics.robot import QUANTITIES
from trajcli.planners.point_to_point import missing_limit

if TYPE_CHECKING:
    from trajcli.kinematics.robot import Robot
    from trajcli.planners.profile import Task

_ROUNDING = 1e-12


def require_limits(planner: str, tasks: Sequence[Task], robot: Robot) -> None:
    """Refuse moving joints without the limits that their motion follows from.

    Raises:
        MissingLimitError: With one problem for each quantity, naming the joints.
    """
    problems: list[Problem] = []
    for order in (1, 2, 3):
        lacking = [
            joint
            for joint, task in enumerate(tasks)
            if not task.steady
            and not np.isfinite(task.bounds[order - 1]).all()
            and (order > 1 or task.control == "position")
        ]
        if lacking:
            why, also = "to find its fastest motion", f"give the joint its own `{QUANTITIES[order]}`"
            problems += missing_limit(planner, QUANTITIES[order], lacking, robot, why, also).problems
    if problems:
        raise MissingLimitError(*problems)


def require_possible_end(tasks: Sequence[Task], robot: Robot) -> None:
    """Refuse end states that lie outside the limits, or that can only be reached from outside.

    Raises:
        PlanningError: With one problem for each joint.
    """
    problems = [problem for joint, task in enumerate(tasks) for problem in _end_problems(task, joint)]
    if problems:
        raise PlanningError(*problems)


def _end_problems(task: Task, joint: int) -> list[Problem]:
    for order in (1, 2):
        value, (low, high) = task.final[order], task.bounds[order - 1].tolist()
        if not low * (1 + _ROUNDING) <= value <= high * (1 + _ROUNDING):
            limit = low if value < 0 else high
            message = f"{task.name} would end with {QUANTITIES[order]} {{value}}, beyond its limit {{limit}}"
            amounts = {"value": Amount(value, order, joint), "limit": Amount(limit, order, joint)}
            hint = f"lower the end {QUANTITIES[order]}, or raise the limit"
            return [Problem(message, hint, joint=task.name, value=value, limit=limit, amounts=amounts)]
    return [] if task.control == "velocity" or task.done else _approach_problems(task, joint)


def _approach_problems(task: Task, joint: int) -> list[Problem]:
    """The end acceleration a was built up from zero: before, the velocity was a |a| / (2 jerk) less."""
    velocity, acceleration = task.final[1:]
    before = velocity - acceleration * abs(acceleration) / (2 * float(np.abs(task.bounds[2]).min()))
    low, high = task.bounds[0].tolist()
    if low * (1 + _ROUNDING) <= before <= high * (1 + _ROUNDING):
        return []
    limit = low if before < 0 else high
    message = (
        f"{task.name} would end with velocity {{velocity}} and acceleration {{acceleration}}: within its "
        "jerk limit it must have moved at {before} just before, beyond its velocity limit {limit}"
    )
    amounts = {
        "velocity": Amount(velocity, 1, joint),
        "acceleration": Amount(acceleration, 2, joint),
        "before": Amount(before, 1, joint),
        "limit": Amount(limit, 1, joint),
    }
    hint = "lower the end acceleration or velocity, or raise the velocity or jerk limit"
    return [Problem(message, hint, joint=task.name, value=before, limit=limit, amounts=amounts)]


def leaves_line(value: float, order: int, joint: int, robot: Robot) -> PlanningError:
    """Return the error of a boundary velocity or acceleration that points away from the straight line."""
    name = robot.joint_names[joint]
    message = "`synchronize: phase` keeps all joints on one straight line, "
    message += f"but {QUANTITIES[order]} {{value}} of {name} leaves it"
    amounts = {"value": Amount(value, order, joint)}
    return PlanningError(
        Problem(message, "say `synchronize: time`", joint=name, value=value, amounts=amounts)
    )


def cannot_wait(task: Task, arrival: float, duration: float, joint: int) -> PlanningError:
    """Return the error of a joint that arrives first and moves in its end state."""
    message = (
        f"{task.name} arrives after {{arrival}}, moves on, and cannot wait for the others until {{duration}}"
    )
    amounts = {"arrival": Amount(arrival), "duration": Amount(duration)}
    hint = "say `synchronize: time`, or let it end at rest"
    return PlanningError(Problem(message, hint, joint=task.name, amounts=amounts))
