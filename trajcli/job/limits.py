"""Limits in force: the robot's, replaced and scaled by the job, tightened by a move; and what they need."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from itertools import filterfalse
from math import inf
from typing import NamedTuple

import numpy as np

from trajcli.columns import EFFORT
from trajcli.curves.piecewise import Array
from trajcli.errors import Amount, InputError, Problem
from trajcli.job.model import Job
from trajcli.job.yaml.load import Document
from trajcli.kinematics.robot import GEOMETRY_HINT, QUANTITIES, Limits, Robot, ToolLimits
from trajcli.language.limits import OF_ROBOT, EffortBounds, LimitsSpec
from trajcli.language.numbers import FieldPath
from trajcli.limits.kinds import JOINT_KINDS, KIND_OF, TOOL_KINDS
from trajcli.planners.planner import Event
from trajcli.units import effort_unit

_ROUNDING = 1e-12  # relative: a limit that differs by less was meant to be the same, in another unit
_INERTIA = (
    "give each joint `link: {mass, com, inertia}`, or name a robot that has them: a URDF with inertials, "
    "or one of `trajcli robots`, such as ur5e or fr3"
)


class LooserBound(NamedTuple):
    """A bound that is looser than the one it replaces.

    Attributes:
        quantity: "position", "velocity", "acceleration", "jerk" or "effort".
        joint: Index.
        amounts: The bound "before" and "after", at the end that got looser.
    """

    quantity: str
    joint: int
    amounts: dict[str, Amount | str]


def with_job_limits(
    robot: Robot, spec: LimitsSpec | None, whose: str = "the job's"
) -> tuple[Robot, list[Event]]:
    """Return the robot with the job's limits in force, and an event for each looser than the robot's.

    The robot's own efforts are in force where its `Limits.effort` holds them. Events begin with `whose`.
    """
    if spec is None:
        return robot, []
    unlimited = [k for k, bound in enumerate(spec.position) if bound and not np.isfinite(bound).all()]
    for joint in unlimited:
        if np.isfinite(robot.limits.velocity_by_position[joint, 0]):
            name = robot.joint_names[joint]
            message = "{joint} has velocity_by_position, which needs its position limits"
            hint = "leave its `position` out under `limits`"
            raise InputError(Problem(message, hint, joint=name, amounts={"joint": name}))
    events = []
    looser = [*looser_bounds(robot, spec), *_looser_than_stated(robot, spec)]
    for quantity, joint, amounts in filterfalse(_is_not_judged, looser):
        message = f"{whose} {quantity} limit of {{joint}} is looser than the robot's: "
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
    """Yield each bound that is looser than the one in force."""
    for order, quantity in enumerate(QUANTITIES):
        before = robot.limits.of_order(order)
        after = _replaced(before, spec, order)
        for joint, bounds in _looser(before, after):
            yield LooserBound(quantity, joint, {key: Amount(v, order, joint) for key, v in bounds.items()})
    yield from _looser_efforts(robot, robot.limits.effort, with_efforts(robot, spec))


def _is_not_judged(looser: LooserBound) -> bool:
    """Return whether a job says of an effort that it does not count, which the report tells."""
    after = looser.amounts["after"]
    return looser.quantity == "effort" and isinstance(after, Amount) and after.value in (-inf, inf)


def _looser_than_stated(robot: Robot, spec: LimitsSpec) -> Iterator[LooserBound]:
    """Yield each effort of a job that is looser than what the maker states, where that is not in force."""
    stated = np.where(np.isfinite(robot.limits.effort), np.nan, own_efforts(robot))
    after = with_efforts(robot, spec)
    yield from _looser_efforts(robot, np.where(np.isfinite(after), stated, np.nan), after)


def _looser_efforts(robot: Robot, before: Array, after: Array) -> Iterator[LooserBound]:
    for joint, bounds in _looser(before, after):
        unit = effort_unit(robot.joint_types[joint])
        yield LooserBound("effort", joint, {key: Amount(v, unit=unit) for key, v in bounds.items()})


def _looser(before: Array, after: Array) -> Iterator[tuple[int, dict[str, float]]]:
    """Yield the joints whose bounds (n, 2) are looser after than before, with both at that end.

    A bound before that is not a number is none to compare with.
    """
    slack = _ROUNDING * np.where(np.isfinite(before), np.abs(before), 0.0)
    ends = (after[:, 0] < before[:, 0] - slack[:, 0], after[:, 1] > before[:, 1] + slack[:, 1])
    for joint in np.flatnonzero(ends[0] | ends[1]).tolist():
        end = 1 if ends[1][joint] else 0
        yield joint, {"before": float(before[joint, end]), "after": float(after[joint, end])}


def own_efforts(robot: Robot) -> Array:
    """Return the efforts that the maker states, shape (n, 2), infinite where none is known."""
    return np.array([joint.effort for joint in robot.joints])


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
        kind.key: _replaced(robot.limits.of_order(order), spec, order)
        * getattr(spec.scale, kind.factor or "", 1.0)
        for order, kind in enumerate(JOINT_KINDS[: len(QUANTITIES)])
    }
    k = spec.scale.velocity  # k (sqrt(2 d x) - o) is the same limit with k^2 d and k o
    by_position = robot.limits.velocity_by_position * [k**2, k]
    tcp = _tool_limits(robot.limits.tcp, spec)
    effort = with_efforts(robot, spec)
    limits = Limits(**rows, tcp=tcp, velocity_by_position=by_position, effort=effort)
    return dataclasses.replace(robot, limits=limits)


def with_efforts(robot: Robot, spec: LimitsSpec) -> Array:
    """Return the efforts in force, shape (n, 2)."""
    if spec.effort == OF_ROBOT:
        return own_efforts(robot)
    result = robot.limits.effort.copy()
    for joint, bound in enumerate(spec.effort):
        if bound is not None and not isinstance(bound, str):
            result[joint] = bound
    return result


def _tool_limits(before: ToolLimits, spec: LimitsSpec) -> ToolLimits:
    """Return the limits of the tool, scaled as those of the joints are."""
    given = {} if spec.tcp is None else spec.tcp.model_dump(exclude_none=True)
    scales = {kind.key: getattr(spec.scale, kind.factor or "", 1.0) for kind in TOOL_KINDS}
    return ToolLimits(**{name: given.get(name, getattr(before, name)) * k for name, k in scales.items()})


def looser_tool_bounds(robot: Robot, spec: LimitsSpec) -> Iterator[tuple[str, tuple[Amount, Amount]]]:
    """Yield the names of the limits of the tool that a move loosens, with what they were and would be."""
    for name, value in ({} if spec.tcp is None else spec.tcp.model_dump(exclude_none=True)).items():
        before = getattr(robot.limits.tcp, name)
        if value > before * (1 + _ROUNDING):
            kind = KIND_OF[f"tool_{name}"]
            order, measured = kind.order or 1, kind.dimension
            yield name, (Amount(before, order, None, measured), Amount(value, order, None, measured))


def _replaced(bounds: Array, spec: LimitsSpec, order: int) -> Array:
    result = bounds.copy()
    for joint, bound in enumerate(spec.of_order(order)):
        if bound is not None:
            result[joint] = bound
    return result


def flaws_of_dynamics(job: Job, robot: Robot, document: Document) -> Iterator[Problem]:
    """Yield what keeps the efforts that a job speaks of from being known.

    Args:
        job: The job.
        robot: With the job's limits in force.
        document: For places.
    """
    asked: list[tuple[FieldPath, EffortBounds]] = []
    if job.limits is not None:
        asked.append((("limits", "effort"), job.limits.effort))
    asked += [
        (("moves", index, "limits", "effort"), move.limits.effort)
        for index, move in enumerate(job.moves)
        if move.limits is not None
    ]
    for path, bounds in asked:
        place = document.place(path)
        if bounds == OF_ROBOT and not np.isfinite(own_efforts(robot)).any():
            hint = "give them by joint: `effort: {NAME: N m or N}`"
            yield Problem(f"{robot.name} states no efforts", hint, place)
        elif _limits_any(bounds):
            yield from _lacking(robot, "efforts", document, path)
    for index, group in enumerate(job.output.columns):
        if group == EFFORT:
            yield from _lacking(robot, f"the columns '{EFFORT}'", document, ("output", "columns", index))
    for index, move in enumerate(job.moves):
        if move.needs_geometry and robot.convention is None:
            message = f"{move.needs_geometry} needs a robot with geometry, {robot.name} has bare joints"
            yield Problem(message, GEOMETRY_HINT, document.place(("moves", index)), move=index)


def _limits_any(bounds: EffortBounds) -> bool:
    return bounds == OF_ROBOT or any(
        bound is not None and not isinstance(bound, str) and np.isfinite(bound).any() for bound in bounds
    )


def _lacking(robot: Robot, what: str, document: Document, path: FieldPath) -> Iterator[Problem]:
    """Yield what the robot lacks for inverse dynamics."""
    if robot.convention is None:
        message = f"{what} need a robot with geometry, {robot.name} has bare joints"
        yield Problem(message, GEOMETRY_HINT, document.place(path))
        return
    lacking = robot.without_inertia
    if lacking:
        joints = f"joint{'s' * (len(lacking) > 1)} {', '.join(lacking)}"
        message = f"{what} need mass and inertia of all links; {robot.name} has none behind {joints}"
        yield Problem(message, _INERTIA, document.place(path), joint=lacking[0])
