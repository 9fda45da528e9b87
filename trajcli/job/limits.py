"""Limits in force: the robot's, replaced and scaled by the job, tightened by a move."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import Literal, NamedTuple

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.errors import Amount, InputError, Problem
from trajcli.kinematics.robot import QUANTITIES, Limits, Robot, ToolLimits
from trajcli.language.limits import UNLIMITED, LimitsSpec
from trajcli.planners.planner import Event

_ROUNDING = 1e-12  # relative: a limit that differs by less was meant to be the same, in another unit
_TOOL_ORDERS = {"speed": 1, "acceleration": 2, "jerk": 3}


class LooserBound(NamedTuple):
    """A bound that is looser than the one it replaces.

    Attributes:
        quantity: "position", "velocity", "acceleration" or "jerk".
        joint: Index.
        amounts: The bound "before" and "after", at the end that got looser.
    """

    quantity: str
    joint: int
    amounts: dict[str, Amount | str]


def with_job_limits(robot: Robot, spec: LimitsSpec | None) -> tuple[Robot, list[Event]]:
    """Return the robot with the job's limits in force, and an event for each looser than the robot's."""
    if spec is None:
        return robot, []
    unlimited = [index for index, bound in enumerate(spec.position) if bound == UNLIMITED]
    for joint in unlimited:
        if np.isfinite(robot.limits.velocity_by_position[joint, 0]):
            name = robot.joint_names[joint]
            message = "{joint} has velocity_by_position, which needs its position limits"
            hint = "leave its `position` out under `limits`"
            raise InputError(Problem(message, hint, joint=name, amounts={"joint": name}))
    events = []
    for quantity, joint, amounts in looser_bounds(robot, spec):
        message = f"the job's {quantity} limit of {{joint}} is looser than the robot's: "
        amounts |= {"joint": robot.joint_names[joint]}
        events.append(Event("looser_limit", message + "{after} instead of {before}", amounts=amounts))
    return _with_limits(robot, spec), events


def with_move_limits(robot: Robot, spec: LimitsSpec | None, move: int) -> Robot:
    """Return the robot with a move's tighter limits in force.

    Raises:
        InputError: When one is looser than the job's.
    """
    if spec is None:
        return robot
    problems = [looser_problem(robot, looser, move) for looser in looser_bounds(robot, spec)]
    if problems:
        raise InputError(*problems)
    return _with_limits(robot, spec)


def looser_bounds(robot: Robot, spec: LimitsSpec) -> Iterator[LooserBound]:
    """Yield each bound that is looser than the robot's."""
    for order, quantity in enumerate(QUANTITIES):
        before = robot.limits.of_order(order)
        after = _replaced(before, spec, order)
        room = _ROUNDING * np.where(np.isfinite(before), np.abs(before), 0.0)
        ends = (after[:, 0] < before[:, 0] - room[:, 0], after[:, 1] > before[:, 1] + room[:, 1])
        for joint in np.flatnonzero(ends[0] | ends[1]).tolist():
            end = 1 if ends[1][joint] else 0
            bounds = {"before": float(before[joint, end]), "after": float(after[joint, end])}
            yield LooserBound(quantity, joint, {key: Amount(v, order, joint) for key, v in bounds.items()})


def looser_problem(robot: Robot, looser: LooserBound, move: int) -> Problem:
    """Return what is wrong with a bound that a move loosens."""
    quantity, joint, amounts = looser
    name = robot.joint_names[joint]
    message = (
        f"a move can only tighten limits: the {quantity} limit of {{joint}} is {{before}}, got {{after}}"
    )
    hint = "raise it under the job's `limits`"
    return Problem(message, hint, move=move, joint=name, amounts={"joint": name, **amounts})


def _with_limits(robot: Robot, spec: LimitsSpec) -> Robot:
    rows = {
        name: _replaced(robot.limits.of_order(order), spec, order) * getattr(spec.scale, name, 1.0)
        for order, name in enumerate(QUANTITIES)
    }
    k = spec.scale.velocity  # k (sqrt(2 d x) - o) is the same limit with k^2 d and k o
    by_position = robot.limits.velocity_by_position * [k**2, k]
    tcp = _tool_limits(robot.limits.tcp, spec)
    return dataclasses.replace(robot, limits=Limits(**rows, tcp=tcp, velocity_by_position=by_position))


def _tool_limits(before: ToolLimits, spec: LimitsSpec) -> ToolLimits:
    """Return the limits of the tool, scaled as those of the joints are."""
    given = {} if spec.tcp is None else spec.tcp.model_dump(exclude_none=True)
    scales = {
        "speed": spec.scale.velocity,
        "angular_speed": spec.scale.velocity,
        "acceleration": spec.scale.acceleration,
        "angular_acceleration": spec.scale.acceleration,
        "jerk": spec.scale.jerk,
    }
    return ToolLimits(**{name: given.get(name, getattr(before, name)) * k for name, k in scales.items()})


def looser_tool_bounds(robot: Robot, spec: LimitsSpec) -> Iterator[tuple[str, tuple[Amount, Amount]]]:
    """Yield the names of the limits of the tool that a move loosens, with what they were and would be."""
    for name, value in ({} if spec.tcp is None else spec.tcp.model_dump(exclude_none=True)).items():
        before = getattr(robot.limits.tcp, name)
        if value > before * (1 + _ROUNDING):
            order = _TOOL_ORDERS[name.removeprefix("angular_")]
            kind: Literal["angle", "length"] = "angle" if name.startswith("angular_") else "length"
            yield name, (Amount(before, order, None, kind), Amount(value, order, None, kind))


def _replaced(bounds: Array, spec: LimitsSpec, order: int) -> Array:
    result = bounds.copy()
    for joint, bound in enumerate(spec.of_order(order)):
        if bound is not None:
            result[joint] = bound
    return result
