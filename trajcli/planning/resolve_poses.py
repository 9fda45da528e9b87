"""Resolution of poses: from a pose that a job names to the joints that reach it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError, PlanningError, Problem
from trajcli.frozen import frozen
from trajcli.kinematics.robot import Robot
from trajcli.language.targets import Configuration, Target
from trajcli.planners.planner import Event

if TYPE_CHECKING:
    from trajcli.kinematics.inverse.solutions import Solutions
    from trajcli.kinematics.inverse.target import IkTarget

_NOTED = 1e-12  # a smaller defect of a rotation matrix is rounding
_CHOICES = ("shoulder", "elbow", "wrist")


@frozen
class ResolvedPose:
    """A pose that a job names, and the branch on which it is reached.

    Attributes:
        target: What the job says.
        ik_target: The coordinates that it fixes.
        near: Joint values (n,) of where the arm comes from, rad or m.
        solutions: All of inverse kinematics.
        usable: Those within the limits that have the names the job asks for, shape (branches,).
        branch: Index of the usable one that is nearest to `near`.
    """

    target: Target
    ik_target: IkTarget
    near: Array
    solutions: Solutions
    usable: NDArray[np.bool_]
    branch: int

    @property
    def joints(self) -> Array:
        """Joint values (n,), rad or m."""
        return np.asarray(self.solutions.joints[self.branch])


def resolve_pose(target: Target, robot: Robot, near: Array) -> tuple[Target, ResolvedPose]:
    """Return the target with joints instead of its pose, and how that is reached.

    The branch is the one that the target's configuration names; without one, that nearest to `near`.

    Args:
        target: With a pose.
        robot: Its base, tool and position limits count.
        near: Joint values (n,) of where the arm comes from, rad or m.

    Raises:
        InputError: When the robot has no geometry, or the configuration names what its arm has not.
        PlanningError: When no branch reaches the pose within the limits.
    """
    if robot.convention is None:
        hint = "give its joints theta, d, a and alpha, or the target `joints`"
        raise InputError(f"{robot.name} has no geometry, so it reaches no pose", hint=hint)
    pose = _on_nearest_branch(target, robot, near)
    joints = tuple(pose.joints.tolist())
    return Target(joints=joints, velocity=target.velocity, acceleration=target.acceleration), pose


def _on_nearest_branch(target: Target, robot: Robot, near: Array) -> ResolvedPose:
    from trajcli.kinematics.inverse.solutions import check_reachable
    from trajcli.kinematics.inverse.solve import reached_if_turned, solve
    from trajcli.language.targets import ik_target

    wanted = ik_target(target)
    if target.pinned is None:
        solutions = solve(robot, wanted, near)
    else:
        from trajcli.kinematics.inverse.pinned_joints import solve_pinned

        solutions = solve_pinned(robot, wanted, target.pinned.by_index, near)
    turning_helps = bool(solutions.valid.any()) or reached_if_turned(robot, wanted)
    check_reachable(robot, solutions, turning_helps=turning_helps)
    names = [str(name) for name in solutions.names]
    usable = solutions.within_limits & _of_configuration(
        target.configuration, names, robot, solutions.method.name
    )
    if not usable.any():
        words = " ".join(asked_names(target.configuration).values())
        others = sorted({names[k] for k in np.flatnonzero(solutions.within_limits)})
        message = f"{robot.name} does not reach the pose within its limits in the configuration {words}"
        raise PlanningError(Problem(message, f"it does in: {', '.join(others)}"))
    distance = np.where(usable, np.abs(solutions.joints - near).max(axis=-1), np.inf)
    return ResolvedPose(target, wanted, near, solutions, usable, int(distance.argmin()))


def _of_configuration(
    wanted: Configuration | None, names: list[str], robot: Robot, method: str
) -> NDArray[np.bool_]:
    """Return which branches have the wanted names."""
    chosen = np.ones(len(names), dtype=bool)
    for word in asked_names(wanted).values():
        has = np.array([word in name.split() for name in names])
        if not has.any():
            known = sorted({part for name in names for part in name.split()} - {"only"})
            hint = f"it has {', '.join(known)}" if known else f"its branches have no names ({method})"
            raise InputError(f"{robot.name} has no configuration '{word}'", hint=hint)
        chosen &= has
    return chosen


def asked_names(wanted: Configuration | None) -> dict[str, str]:
    """Return what a configuration names, such as {"elbow": "up"}."""
    return {choice: word for choice in _CHOICES if (word := getattr(wanted, choice, None)) is not None}


def nearest_rotation_events(pose: ResolvedPose) -> list[Event]:
    """Return the event that a matrix was not quite a rotation, so that the nearest one is taken."""
    if pose.target.matrix is None:
        return []
    from trajcli.geometry.rotation import rotation_defect

    defect = float(rotation_defect(np.array([row[:3] for row in pose.target.matrix[:3]])))
    if defect <= _NOTED:
        return []
    return [
        Event("nearest_rotation", f"the matrix is off a rotation by {defect:.3g}: the nearest one is taken")
    ]
