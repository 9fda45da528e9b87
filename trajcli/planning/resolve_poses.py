"""From a pose that a job names to the joints that reach it."""

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
from trajcli.trajectory import State

if TYPE_CHECKING:
    from trajcli.kinematics.inverse.solutions import Solutions
    from trajcli.kinematics.inverse.target import IkTarget

_NOTED = 1e-12  # a smaller defect of a rotation matrix is rounding
_CHOICES = ("shoulder", "elbow", "wrist")


@frozen
class ResolvedPose:
    """A pose that a job names, and the branch on which it is reached.

    Attributes:
        pose: What the job says.
        goal: The coordinates that it fixes.
        near: Joint values (n,) of where the arm comes from, rad or m.
        found: All answers.
        usable: Those within the limits that have the names the job asks for, shape (branches,).
        branch: Index of the usable one that is nearest to `near`.
    """

    pose: Target
    goal: IkTarget
    near: Array
    found: Solutions
    usable: NDArray[np.bool_]
    branch: int

    @property
    def joints(self) -> Array:
        """Joint values (n,), rad or m."""
        return np.asarray(self.found.joints[self.branch])


def resolve_target(target: Target, robot: Robot, near: Array) -> tuple[Target, ResolvedPose | None]:
    """Return the target with joints in the place of its pose, and how that is reached; None without a pose.

    The branch is the one that the target's configuration names; without one, that nearest to `near`.

    Args:
        target: With joints or a pose; one with neither comes back as it is.
        robot: Its base, tool and position limits count.
        near: Joint values (n,) of where the arm comes from, rad or m.

    Raises:
        InputError: When the robot has no geometry, or the configuration names what its arm has not.
        PlanningError: When no branch reaches the pose within the limits.
    """
    if not target.gives_pose:
        return target, None
    if robot.convention is None:
        hint = "give its joints theta, d, a and alpha, or the target `joints`"
        raise InputError(f"{robot.name} has no geometry, so it reaches no pose", hint=hint)
    reached = _on_nearest_branch(target, robot, near)
    joints = tuple(reached.joints.tolist())
    return Target(joints=joints, velocity=target.velocity, acceleration=target.acceleration), reached


def start_state(target: Target, robot: Robot) -> tuple[State, ResolvedPose | None]:
    """Return the state in which a job starts; a pose is reached near to where all joints are zero.

    Raises:
        InputError: As `with_joints`.
        PlanningError: As `with_joints`.
    """
    resolved, reached = resolve_target(target, robot, np.zeros(len(robot.joints)))
    return resolved.as_state(), reached


def _on_nearest_branch(target: Target, robot: Robot, near: Array) -> ResolvedPose:
    from trajcli.kinematics.inverse.solutions import check_reachable
    from trajcli.kinematics.inverse.solve import solve
    from trajcli.language.targets import ik_target

    goal = ik_target(target)
    found = solve(robot, goal, near)
    check_reachable(robot, found)
    chosen = _of_configuration(
        target.configuration, [str(name) for name in found.names], robot, found.method.name
    )
    usable = found.within_limits & chosen
    if not usable.any():
        words = " ".join(asked_names(target.configuration).values())
        others = sorted({str(found.names[k]) for k in np.flatnonzero(found.within_limits)})
        message = f"{robot.name} does not reach the pose within its limits in the configuration {words}"
        raise PlanningError(Problem(message, f"it does in: {', '.join(others)}"))
    distance = np.where(usable, np.abs(found.joints - near).max(axis=-1), np.inf)
    return ResolvedPose(target, goal, near, found, usable, int(distance.argmin()))


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


def nearest_rotation_events(reached: ResolvedPose | None) -> list[Event]:
    """Return the event that a matrix was not quite a rotation and stands for the nearest one."""
    if reached is None or reached.pose.matrix is None:
        return []
    from trajcli.geometry.rotation import rotation_defect

    defect = float(rotation_defect(np.array([row[:3] for row in reached.pose.matrix[:3]])))
    if defect <= _NOTED:
        return []
    return [
        Event("nearest_rotation", f"the matrix is off a rotation by {defect:.3g}: the nearest one is taken")
    ]
