"""Solutions of inverse kinematics over a batch of targets, and the feasibility of a target.

A target is infeasible where it is out of reach, by some distance, or in reach only outside the limits.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.errors import Amount, Amounts, PlanningError, Problem
from trajcli.frozen import comparable, frozen
from trajcli.geometry.rotation import AxisName, Flags
from trajcli.kinematics.inverse.families.method import Branch, IkMethod
from trajcli.kinematics.inverse.joint_turns import beyond
from trajcli.kinematics.robot import Robot


@frozen
class Solutions:
    """Every branch of every target.

    Attributes:
        method: How they were computed.
        joints: Shape (*batch, branches, n), rad or m. Where a branch is not valid, the configuration that
            comes near the target on that branch.
        valid: Shape (*batch, branches): the tcp meets the target within the tolerance, and no earlier branch
            is the same configuration. Limits do not enter.
        closure: Shape (*batch, branches, 2): how far forward kinematics is from the target, m and rad.
        singular: Shape (*batch, branches): the arm has more self-motions there than the target leaves
            elsewhere.
        free: Shape (*batch, branches, n): the joints that take part in self-motions, because the arm is
            singular or because the target leaves them free. `joints` is the point of the self-motion manifold
            nearest to the given configuration.
        bounds: Position limits, shape (n, 2).
        fixed_axis: The axis of the tool that the targets mean, if no joint turns it.
    """

    method: IkMethod
    joints: Array
    valid: Flags
    closure: Array
    singular: Flags
    free: Flags
    bounds: Array
    fixed_axis: AxisName | None = None

    @property
    def names(self) -> tuple[Branch, ...]:
        """Names of the branches; unnamed ones where the method is numeric."""
        return self.method.branches or (Branch(),) * self.joints.shape[-2]

    @property
    def count(self) -> NDArray[np.intp]:
        """Number of valid branches, shape (*batch,)."""
        return np.asarray(np.count_nonzero(self.valid, axis=-1))

    @property
    def within_limits(self) -> Flags:
        """Which branches are valid and inside the limits, shape (*batch, branches)."""
        return np.asarray(self.valid & (self.excess == 0.0).all(axis=-1))

    @property
    def excess(self) -> Array:
        """By how much joints are outside their limits, shape (*batch, branches, n), negative below."""
        return beyond(self.joints, self.bounds)

    @property
    def shortfall(self) -> Array:
        """How far the nearest branch stays away, shape (*batch, 2), m and rad; zero where one is valid.

        A closed form then takes the wrist near to its aim with the orientation met, a joint at a time: planar
        arms come as near as they can, others may come nearer with another turn of the shoulder.
        """
        size = np.where(np.isfinite(self.closure), self.closure, np.inf).sum(axis=-1)
        best = np.asarray(np.argmin(size, axis=-1))[..., None, None]
        nearest = np.take_along_axis(self.closure, best, axis=-2)[..., 0, :]
        reached = np.asarray(self.valid.any(axis=-1))
        return np.where(reached[..., None], 0.0, nearest)

    def named(self, **choices: str | None) -> Flags:
        """Return which branches have the given names, shape (branches,); a choice of None does not matter.

        Args:
            choices: Of `shoulder`, `elbow` and `wrist`, in the words of a job's `configuration`.
        """
        wanted = {choice: name for choice, name in choices.items() if name is not None}
        return np.array(
            [all(getattr(own, key) == value for key, value in wanted.items()) for own in self.names]
        )

    def nearest(self, near: Array, within_limits: bool = True) -> NDArray[np.intp]:
        """Return the index (*batch,) of the branch nearest to `near` (*batch, n), rad or m; -1 for none.

        The distance is the largest difference of any joint.
        """
        usable = self.within_limits if within_limits else self.valid
        distance = np.abs(self.joints - np.asarray(near)[..., None, :]).max(axis=-1)
        best = np.argmin(np.where(usable, distance, np.inf), axis=-1)
        return np.where(usable.any(axis=-1), best, -1)


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


def least_violation(solutions: Solutions, index: tuple[int, ...] = ()) -> OutsideLimits | None:
    """Return the valid branch of one target whose worst joint is the least outside; None where one is inside.

    Args:
        solutions: Of any batch.
        index: Which target of the batch.

    Raises:
        ValueError: When no branch of the target is valid.
    """
    valid, excess = solutions.valid[index], solutions.excess[index]
    if not valid.any():
        raise ValueError("the target has no valid branch")
    worst = np.where(valid, np.abs(excess).max(axis=-1), np.inf)
    branch = int(np.argmin(worst))
    if worst[branch] == 0.0:
        return None
    joint = int(np.argmax(np.abs(excess[branch])))
    value = float(solutions.joints[(*index, branch, joint)])
    return OutsideLimits(branch, joint, float(excess[branch, joint]), value)


def check_reachable(robot: Robot, solutions: Solutions, *, turning_helps: bool = True) -> None:
    """Do nothing when every target of a batch has a branch within the limits.

    Args:
        robot: The arm.
        solutions: Of the targets.
        turning_helps: Whether the targets fix coordinates of the orientation, without which they may be met.

    Raises:
        PlanningError: For the first target that has none: by how much it is out of reach, or which joint is
            outside its limits, and by how much.
    """
    missing = np.argwhere(~solutions.within_limits.any(axis=-1))
    if not len(missing):
        return
    index = tuple(int(i) for i in missing[0])
    which = f" (number {', '.join(map(str, index))} of the batch, from 0)" if index else ""
    if not solutions.valid[index].any():
        metres, radians = solutions.shortfall[index].tolist()
        amounts: Amounts = {
            "robot": robot.name,
            "distance": Amount(metres, dimension="length", digits=6),
            "angle": Amount(round(radians, 12), dimension="angle", digits=6),
        }
        message = f"{{robot}} cannot reach the pose{which}: it comes within {{distance}} and {{angle}}"
        raise PlanningError(
            Problem(message, _hint_for(solutions, turning_helps=turning_helps), amounts=amounts)
        )
    raise PlanningError(_problem(robot, solutions, index, which))


def _hint_for(solutions: Solutions, *, turning_helps: bool) -> str:
    if solutions.fixed_axis is not None:
        return (
            f"no joint turns the {solutions.fixed_axis} axis of the tool: mean another one, with `tool_axis`"
        )
    return "move the target" + (", or leave coordinates of its orientation free" if turning_helps else "")


def _problem(robot: Robot, solutions: Solutions, index: tuple[int, ...], which: str) -> Problem:
    """Return what keeps a target that is met only outside the limits from being met inside."""
    nearest = least_violation(solutions, index)
    if nearest is None:
        raise ValueError("the target has a branch within the limits")
    low, high = solutions.bounds[nearest.joint].tolist()
    limit = high if nearest.excess > 0.0 else low
    name = robot.joint_names[nearest.joint]
    numbers = {"value": nearest.value, "limit": limit, "excess": abs(nearest.excess)}
    amounts = {key: Amount(value, 0, nearest.joint) for key, value in numbers.items()}
    return Problem(
        f"{{robot}} reaches the pose{which} only outside the limits: "
        f"the nearest of {int(solutions.count[index])} answers "
        "has {joint} at {value}, its limit is {limit}, {excess} too far",
        hint="move the target, or choose another tool or base",
        joint=name,
        value=nearest.value,
        limit=limit,
        amounts={"robot": robot.name, "joint": name, **amounts},
    )
