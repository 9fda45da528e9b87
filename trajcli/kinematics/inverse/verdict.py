"""What stands in the way of a target: out of reach, by how much, or in reach only outside the limits."""

from __future__ import annotations

import numpy as np

from trajcli.errors import Amount, PlanningError, Problem
from trajcli.frozen import comparable
from trajcli.kinematics.inverse.solution import Solutions
from trajcli.kinematics.robot import Robot


@comparable
class OutsideLimits:
    """The least violation with which a target can be met.

    Attributes:
        branch: Index of the branch.
        joint: Index of its joint that is furthest outside.
        excess: By how much, rad or m, negative below the lower limit.
        value: Of that joint, rad or m.
    """

    branch: int
    joint: int
    excess: float
    value: float


def least_violation(found: Solutions, index: tuple[int, ...] = ()) -> OutsideLimits | None:
    """Return the valid branch of one target whose worst joint is the least outside; None where one is inside.

    Args:
        found: Of any batch.
        index: Which target of the batch.

    Raises:
        ValueError: When no branch of the target is valid.
    """
    valid, excess = found.valid[index], found.excess[index]
    if not valid.any():
        raise ValueError("the target has no valid branch")
    worst = np.where(valid, np.abs(excess).max(axis=-1), np.inf)
    branch = int(np.argmin(worst))
    if worst[branch] == 0.0:
        return None
    joint = int(np.argmax(np.abs(excess[branch])))
    value = float(found.joints[(*index, branch, joint)])
    return OutsideLimits(branch, joint, float(excess[branch, joint]), value)


def check_reachable(robot: Robot, found: Solutions) -> None:
    """Do nothing when every target of a batch has a branch within the limits.

    Raises:
        PlanningError: For the first target that has none: by how much it is out of reach, or which joint is
            outside its limits, and by how much.
    """
    missing = np.argwhere(~found.within_limits.any(axis=-1))
    if not len(missing):
        return
    index = tuple(int(i) for i in missing[0])
    which = f" (number {', '.join(map(str, index))} of the batch, from 0)" if index else ""
    if not found.valid[index].any():
        metres, radians = found.shortfall[index].tolist()
        raise PlanningError(
            f"{robot.name} cannot reach the pose{which}: "
            f"it comes within {metres:.6g} m and {round(radians, 12):.6g} rad",
            hint=_way_out(found),
        )
    raise PlanningError(_problem(robot, found, index, which))


def _way_out(found: Solutions) -> str:
    """Return what would make a pose reachable."""
    if found.fixed_axis is not None:
        return f"no joint turns the {found.fixed_axis} axis of the tool: mean another one, with `tool_axis`"
    return "move the target, or leave coordinates of its orientation free"


def _problem(robot: Robot, found: Solutions, index: tuple[int, ...], which: str) -> Problem:
    nearest = least_violation(found, index)
    if nearest is None:
        raise ValueError("the target has a branch within the limits")
    low, high = found.bounds[nearest.joint].tolist()
    limit = high if nearest.excess > 0.0 else low
    name = robot.joint_names[nearest.joint]
    amounts = {"value": nearest.value, "limit": limit, "excess": abs(nearest.excess)}
    return Problem(
        f"{robot.name} reaches the pose{which} only outside the limits: "
        f"the nearest of {int(found.count[index])} answers "
        f"has {name} at {{value}}, its limit is {{limit}}, {{excess}} too far",
        hint="move the target, or choose another tool or base",
        joint=name,
        value=nearest.value,
        limit=limit,
        amounts={key: Amount(value, 0, nearest.joint) for key, value in amounts.items()},
    )
