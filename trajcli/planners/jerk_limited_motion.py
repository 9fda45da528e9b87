"""Jerk-limited motions of all joints: each by itself, all together in time, or all on one line."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

from trajcli.curves.operations import along_line, coast_until, hold_until, merge_breaks
from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.errors import Amount
from trajcli.frozen import frozen
from trajcli.kinematics.robot import Limits, Robot
from trajcli.planners.jerk_limited_errors import (
    cannot_wait,
    leaves_line,
    require_limits,
    require_possible_end,
)
from trajcli.planners.planner import Event, Phase, Planned
from trajcli.planners.profile import Control, Profile, Task
from trajcli.planners.ruckig_solve import fastest, fastest_of, together
from trajcli.trajectory import State

_PARALLEL = 1e-12  # relative; what leaves the line by more is no rounding error


@frozen
class Request:
    """What is asked of the joints.

    Attributes:
        start: State at the start.
        end: State at the end; under velocity control its position means nothing.
        control: Whether the position at the end is imposed.
        synchronize: "time": all arrive together; "phase": one law on a straight line; "none": each by itself.
        minimum_duration: Seconds; 0 for none.
    """

    start: State
    end: State
    control: Control
    synchronize: Literal["time", "phase", "none"]
    minimum_duration: float


def plan_motion(request: Request, robot: Robot) -> Planned:
    """Return the fastest motion that fulfils the request within the robot's limits.

    Raises:
        MissingLimitError: When a moving joint lacks a limit on velocity, acceleration or jerk.
        PlanningError: When no such motion exists.
    """
    tasks = _joint_tasks(request, robot)
    require_limits("jerk_limited", tasks, robot)
    require_possible_end(tasks, robot)
    if request.synchronize == "phase" and not all(task.steady for task in tasks):
        planned = _on_one_line(request, tasks, robot)
    else:
        planned = _each(request, tasks)
    if request.control == "position":
        return planned
    end = State(planned.curve.piece_ends()[1][-1], request.end.velocity, request.end.acceleration)
    return Planned(planned.curve, end, None, planned.phases, planned.events, planned.arrivals)


def _each(request: Request, tasks: Sequence[Task]) -> Planned:
    least = request.minimum_duration
    alone = [fastest(task) for task in tasks]
    profiles = together(tasks, alone, least) if request.synchronize == "time" else alone
    duration = max([least, *(profile.duration for profile in profiles)])
    curves, phases = [], []
    for joint, (task, profile) in enumerate(zip(tasks, profiles, strict=True)):
        phases += profile.phases(joint)
        if profile.duration == duration:
            curves.append(profile.curve())
            continue
        curves.append(_waiting(task, profile, duration, joint))
        phases.append(Phase("cruise" if task.final[1] else "rest", profile.duration, duration, joint))
    phases.sort(key=lambda phase: (phase.start, phase.joint or 0))
    arrivals = tuple(profile.duration for profile in alone)
    events = (*_duration_events(least, duration, max(arrivals)), *_jerk_events(tasks))
    return Planned(merge_breaks(curves), request.end, phases=tuple(phases), events=events, arrivals=arrivals)


def _on_one_line(request: Request, tasks: Sequence[Task], robot: Robot) -> Planned:
    start, end, least = request.start, request.end, request.minimum_duration
    displacement = np.array([task.displacement for task in tasks])
    rates = [start.velocity, end.velocity, start.acceleration, end.acceleration]
    direction = next(values for values in (displacement, *rates) if values.any())
    on_line = [_along(direction, values, 1 + k // 2, robot) for k, values in enumerate(rates)]
    length = 1.0 if displacement.any() else 0.0
    initial, final = (0.0, on_line[0], on_line[2]), (length, on_line[1], on_line[3])
    bounds = _bounds_along(direction, robot.limits)
    task = Task("the common law", initial, final, bounds, request.control)
    alone = fastest(task)
    profile = fastest_of(task, least) if alone.duration < least else alone
    law = profile.curve()
    events = (*_duration_events(least, profile.duration, alone.duration), *_jerk_events(tasks))
    curve = along_line(start.position, direction, law)
    return Planned(curve, end, law if length else None, tuple(profile.phases(None)), events)


def _joint_tasks(request: Request, robot: Robot) -> list[Task]:
    bounds = np.stack([robot.limits.of_order(order) for order in (1, 2, 3)], axis=1)
    states = [
        np.stack([s.position, s.velocity, s.acceleration], axis=1).tolist()
        for s in (request.start, request.end)
    ]
    rows = zip(robot.joint_names, *states, bounds, strict=True)
    return [
        Task(name, tuple(first), tuple(last), bound, request.control) for name, first, last, bound in rows
    ]


def _waiting(task: Task, profile: Profile, duration: float, joint: int) -> PiecewisePolynomial:
    """Return the curve of a joint that keeps its end state until the others have arrived.

    Raises:
        PlanningError: When it cannot, because it moves.
    """
    if task.steady:
        return fastest_of(task, duration).curve()
    if not task.final[1] and not task.final[2]:
        return hold_until(profile.curve(), duration)
    if task.control == "velocity" and not task.final[2]:
        return coast_until(profile.curve(), duration)
    raise cannot_wait(task, profile.duration, duration, joint)


def _along(direction: Array, values: Array, order: int, robot: Robot) -> float:
    """Return the rate of the law under which the joints have the given rates.

    Raises:
        PlanningError: When these are not parallel to the direction.
    """
    rate = float(values @ direction) / float(direction @ direction)
    off = np.abs(values - rate * direction)
    joint = int(off.argmax())
    if off[joint] > _PARALLEL * np.abs(values).max():
        raise leaves_line(float(values[joint]), order, joint, robot)
    return rate


def _bounds_along(direction: Array, limits: Limits) -> Array:
    """Return the bounds (3, 2) of a law that moves the joints along a line within their limits."""
    moving = direction != 0
    bounds = []
    for order in (1, 2, 3):
        with np.errstate(over="ignore"):
            scaled = limits.of_order(order)[moving] / direction[moving, None]
        scaled.sort(axis=1)
        bounds.append([scaled[:, 0].max(), scaled[:, 1].min()])
    return np.array(bounds)


def _duration_events(least: float, duration: float, alone: float) -> list[Event]:
    """Return what to say when a minimum duration that would be long enough is exceeded."""
    if duration <= least or alone > least or not least:
        return []
    message = (
        "no motion within the limits lasts just {wanted}, the minimum duration: this one lasts {duration}"
    )
    return [
        Event("longer_than_minimum", message, amounts={"wanted": Amount(least), "duration": Amount(duration)})
    ]


def _jerk_events(tasks: Sequence[Task]) -> list[Event]:
    """Return what to say of jerk limits that differ by direction."""
    names = [task.name for task in tasks if not task.steady and task.bounds[2, 0] != -task.bounds[2, 1]]
    if not names:
        return []
    message = (
        f"the jerk limit of {', '.join(names)} differs by direction: the smaller magnitude is kept both ways"
    )
    return [Event("jerk_limit_both_ways", message)]
