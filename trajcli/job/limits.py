"""Which limits are in force: the robot's, replaced and scaled by the job, tightened by a move."""

from __future__ import annotations

import dataclasses

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.errors import Amount, InputError, Problem
from trajcli.kinematics.robot import QUANTITIES, Limits, Robot
from trajcli.planners.bounds import LimitsSpec
from trajcli.planners.planner import Event


def with_job_limits(robot: Robot, spec: LimitsSpec | None) -> tuple[Robot, list[Event]]:
    """Return the robot with the job's limits in force, and an event for each that is looser than the robot's."""
    if spec is None:
        return robot, []
    rows, events = {}, []
    for order, name in enumerate(QUANTITIES):
        before = robot.limits.of_order(order)
        after = _replaced(before, spec, order)
        for joint in _looser(before, after):
            message = f"the job's {name} limit of {robot.joint_names[joint]} is looser than the robot's: {{after}} instead of {{before}}"
            amounts = {
                "after": _worst(after[joint], order, joint),
                "before": _worst(before[joint], order, joint),
            }
            events.append(Event("looser_limit", message, amounts=amounts))
        rows[name] = after * getattr(spec.scale, name, 1.0)
    return dataclasses.replace(robot, limits=Limits(**rows)), events


def with_move_limits(robot: Robot, spec: LimitsSpec | None, move: int) -> Robot:
    """Return the robot with a move's tighter limits in force.

    Raises:
        InputError: When one is looser than the job's.
    """
    if spec is None:
        return robot
    rows, problems = {}, []
    for order, name in enumerate(QUANTITIES):
        before = robot.limits.of_order(order)
        after = _replaced(before, spec, order)
        for joint in _looser(before, after):
            message = f"a move can only tighten limits: the {name} limit of {robot.joint_names[joint]} is {{before}}, got {{after}}"
            amounts = {
                "after": _worst(after[joint], order, joint),
                "before": _worst(before[joint], order, joint),
            }
            hint = "raise it under the job's `limits`"
            problems.append(
                Problem(message, hint, move=move, joint=robot.joint_names[joint], amounts=amounts)
            )
        rows[name] = after * getattr(spec.scale, name, 1.0)
    if problems:
        raise InputError(*problems)
    return dataclasses.replace(robot, limits=Limits(**rows))


def _replaced(bounds: Array, spec: LimitsSpec, order: int) -> Array:
    given = spec.of_order(order)
    result = bounds.copy()
    for joint, bound in enumerate(given or ()):
        if bound is not None:
            result[joint] = bound
    return result


def _looser(before: Array, after: Array) -> list[int]:
    room = 1e-12 * np.where(np.isfinite(before), np.abs(before), 0.0)
    outside = (after[:, 0] < before[:, 0] - room[:, 0]) | (after[:, 1] > before[:, 1] + room[:, 1])
    return [int(joint) for joint in np.flatnonzero(outside)]


def _worst(bound: Array, order: int, joint: int) -> Amount:
    return Amount(float(np.abs(bound).max()), order, joint)
