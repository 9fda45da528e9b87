"""From a way of the tool to the planned move: law, joints, phases, and what there is to say about it."""

from __future__ import annotations

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.errors import Amount, PlanningError, Problem
from trajcli.kinematics.following.motion import motion_along
from trajcli.kinematics.following.tolerance import Tolerance
from trajcli.kinematics.robot import Robot
from trajcli.planners.following_tool import Made, followed, followed_in_time, trouble_of
from trajcli.planners.operational import ToleranceSpec, Way
from trajcli.planners.path_law import LawSpec
from trajcli.planners.planner import Planned
from trajcli.planners.tool_law import law_over
from trajcli.trajectory import resting

_ARRIVED = 1e-5  # rad or m: joint values that are given, and reached on the way


def moved_along(
    way: Way, spec: LawSpec, tolerance: ToleranceSpec, planner: str, start: Array, robot: Robot
) -> Planned:
    """Return the move along a way of the tool.

    Args:
        way: Where the tool goes.
        spec: How fast.
        tolerance: How near.
        planner: Tag for messages.
        start: Joint values (n,).
        robot: The arm, with the limits in force.

    Raises:
        MissingLimitError: When nothing says how fast.
        PlanningError: When the arm cannot follow; says where and why.
    """
    wanted = Tolerance(tolerance.position, tolerance.angle)
    made = _made(way, spec, wanted, planner, start, robot)
    room = max(tolerance.position, tolerance.angle)
    trouble_of(robot, made.motion).refuse_limits(made.curve, room)
    end = made.curve.piece_ends()[1][-1]
    check_arrival(way, end, robot)
    return Planned(
        made.curve,
        resting(end),
        phases=made.phases,
        tool=made.motion,
        events=(*way.events, *made.events),
    )


def _made(way: Way, spec: LawSpec, tolerance: Tolerance, planner: str, start: Array, robot: Robot) -> Made:
    if way.overlap is not None:
        return Made(followed_in_time(robot, way.overlap, start), way.overlap)
    if spec.shape == "time_optimal":
        from trajcli.planners.tool_time_optimal import fastest_along

        return fastest_along(followed(robot, way.path, start), spec, tolerance, planner)
    law = law_over(way.path, spec, robot.limits.tcp, planner)
    motion = motion_along(way.path, law.law, law.breaks, tolerance, law.ruled_by)
    return Made(followed(robot, way.path, start).by_time(motion), motion, law.phases)


def check_arrival(way: Way, end: Array, robot: Robot) -> None:
    """Refuse to arrive in other joint values than the target names, or on another branch.

    Raises:
        PlanningError: Names the joint or the branch.
    """
    if way.arrival is not None and np.abs(end - way.arrival).max() > _ARRIVED:
        joint = int(np.abs(end - way.arrival).argmax())
        name = robot.joint_names[joint]
        message = (
            f"the tool arrives where the target says, but with {name} at {{value}} instead of {{wanted}}"
        )
        hint = "on a path the arm keeps its branch: go there in joint space, or give the target as a pose"
        amounts = {
            "value": Amount(float(end[joint]), 0, joint),
            "wanted": Amount(float(way.arrival[joint]), 0, joint),
        }
        raise PlanningError(Problem(message, hint, joint=name, amounts=amounts))
    wanted = {} if way.configuration is None else way.configuration.model_dump(exclude_none=True)
    if not wanted:
        return
    from trajcli.kinematics.inverse.solve import solve

    target = way.path.by_place(np.array([way.path.length]), "left").target()
    found = solve(robot, target, end[None])
    apart = np.where(found.valid[0], np.abs(found.joints[0] - end).max(axis=-1), np.inf)
    names = found.names[int(apart.argmin())]
    if any(getattr(names, choice) != word for choice, word in wanted.items()):
        message = f"the arm arrives in the configuration {names}, not {' '.join(wanted.values())}"
        hint = "on a path the arm keeps its branch: start in that configuration, or leave it out"
        raise PlanningError(message, hint=hint)
