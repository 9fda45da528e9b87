"""Resolution of poses: from a pose that a job names to the joints that reach it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError, PlanningError, Problem
from trajcli.frozen import frozen
from trajcli.kinematics.robot import Robot
from trajcli.language.poses import Configuration
from trajcli.language.targets import Target, ik_target
from trajcli.planners.planner import Event

if TYPE_CHECKING:
    from trajcli.kinematics.inverse.solutions import Solutions
    from trajcli.kinematics.inverse.target import IkTarget
    from trajcli.kinematics.inverse.vendor_flags import VendorFlags


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
        events: What was conceded to reach it.
    """

    target: Target
    ik_target: IkTarget
    near: Array
    solutions: Solutions
    usable: NDArray[np.bool_]
    branch: int
    events: tuple[Event, ...] = ()

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

    wanted = ik_target(target)
    moving = robot
    if target.pinned is None:
        solutions = solve(robot, wanted, near)
    else:
        from trajcli.kinematics.inverse.pinned_joints import solve_pinned, without_pinned

        solutions = solve_pinned(robot, wanted, target.pinned.by_index, near)
        moving = without_pinned(robot, target.pinned.by_index)
    turning_helps = bool(solutions.valid.any()) or reached_if_turned(moving, wanted)
    check_reachable(robot, solutions, turning_helps=turning_helps)
    names = [str(name) for name in solutions.names]
    usable = solutions.within_limits & _of_configuration(
        target.configuration, names, robot, solutions.method.name
    )
    flags = None if target.configuration is None else target.configuration.flags
    if flags is not None:
        usable &= flags.met(robot, solutions.joints)
    if not usable.any():
        words = (target.configuration or Configuration()).text
        others = sorted({names[k] for k in np.flatnonzero(solutions.within_limits)})
        message = f"{robot.name} does not reach the pose within its limits in the configuration {words}"
        raise PlanningError(Problem(message, f"it does in: {', '.join(others)}"))
    if flags is not None and flags.turns:
        return _in_turns(ResolvedPose(target, wanted, near, solutions, usable, 0), flags, robot)
    distance = np.where(usable, np.abs(solutions.joints - near).max(axis=-1), np.inf)
    return ResolvedPose(target, wanted, near, solutions, usable, int(distance.argmin()))


def _in_turns(pose: ResolvedPose, flags: VendorFlags, robot: Robot) -> ResolvedPose:
    """Return the pose on the branch and in the turns that flags say; in the nearest where none are so."""
    pins = () if pose.target.pinned is None else pose.target.pinned.by_index
    turned = {
        branch: flags.in_turns(robot, pose.solutions.joints[branch], pose.near, pins)
        for branch in np.flatnonzero(pose.usable).tolist()
    }
    branch = min(turned, key=lambda k: (len(turned[k][1]), float(np.abs(turned[k][0][0] - pose.near).max())))
    joints, missed = turned[branch]
    events = tuple[Event, ...]()
    if missed:
        names = ", ".join(robot.joint_names[joint] for joint in missed)
        message = f"{flags.text} says turns of {names} that are not on this branch within the limits: "
        events = (Event("turns_not_met", message + "the nearest are taken"),)
    values = pose.solutions.joints.copy()
    values[branch] = joints[0]
    solutions = replace(pose.solutions, joints=values)
    return replace(pose, solutions=solutions, branch=branch, events=events)


def branch_events(pose: ResolvedPose) -> list[Event]:
    """Return the remark on which of several branches a start was taken to mean."""
    configuration, count = pose.target.configuration, int(np.count_nonzero(pose.usable))
    if count < 2 or (configuration is not None and configuration.flags is not None):
        return []
    name = str(pose.solutions.names[pose.branch])
    which = "the one nearest to zero" if name == "only" else name
    message = f"{count} branches reach the start: {which} is taken, nearest to zero"
    if name == "only":
        message = f"{count} configurations reach the start: {which} is taken"
    return [Event("branch_taken", f"{message}; `configuration` says another")]


def _of_configuration(
    wanted: Configuration | None, names: list[str], robot: Robot, method: str
) -> NDArray[np.bool_]:
    chosen = np.ones(len(names), dtype=bool)
    for word in ({} if wanted is None else wanted.branch_names).values():
        has = np.array([word in name.split() for name in names])
        if not has.any():
            words = sorted({part for name in names for part in name.split()} - {"only"})
            hint = f"it has {', '.join(words)}" if words else f"its branches have no names ({method})"
            raise InputError(f"{robot.name} has no configuration '{word}'", hint=hint)
        chosen &= has
    return chosen
