"""Advice on the findings about a plan, which was tried, and the units that numbers of a job look like."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import replace
from typing import Any

import numpy as np

from trajcli.checks.verify import Verdict, longest_factor, verify
from trajcli.errors import Amount, Problem, TrajcliError, at_least
from trajcli.findings import Finding
from trajcli.job.read import LoadedJob
from trajcli.job.yaml.document import Node
from trajcli.kinematics.robot import Robot
from trajcli.language.numbers import TWO_TURNS
from trajcli.limits.kinds import LIMITS_OF_JOINTS
from trajcli.limits.tool import SMOOTH
from trajcli.planners import changed
from trajcli.planners.planner import PlannedMove, Planner
from trajcli.planning.retime import (
    STEPS_OF_TOOL,
    keep_further_limits,
    over_limit,
    slow_to_limits,
    smallest_stretch,
)

Say = Callable[[Amount], str]

_STEP = "acceleration_jump"
_NO_HELP = "slowing down does not help"
_MUCH_LESS = 0.9  # of the time that slowing takes: below it another law is worth naming
_SLOW = "`when_over_limit: slow`"
_FAR = 50.0  # m: no arm reaches as far
_REACHES = 10.0  # times the length of the arm: far out of reach, and near it where a thousandth is meant
_ANGLES = ("rpy", "rotvec", "angles", "angle", "yaw", "pitch", "theta", "alpha", "beta")
_LENGTHS = ("xyz", "center", "a", "d")
_BY_JOINT = ("joints", "positions")
_SECTIONS = ("start", "points", "moves", "robot", "base", "tool")


def with_tested_advice(verdict: Verdict, moves: Sequence[PlannedMove], say: Say) -> Verdict:
    """Return the verdict whose findings propose what was tried: durations, other planners, limits left out.

    Args:
        verdict: On the trajectory of all moves.
        moves: In the order of the job.
        say: Writes numbers in the units of the job.
    """
    findings: list[Finding] = []
    for move in moves:
        own = [finding for finding in verdict.findings if finding.move == move.index]
        if own:
            findings += _advised(own, move, moves, say)
    return replace(verdict, findings=tuple(findings))


def _advised(own: list[Finding], move: PlannedMove, moves: Sequence[PlannedMove], say: Say) -> list[Finding]:
    if any(finding.kind == _STEP for finding in own):
        hint = _without_steps(own, move, moves)
        own = [replace(f, hint=hint) if f.kind in (_STEP, "jerk") else f for f in own]
        alone = False
    else:
        alone = all(finding.factor is not None for finding in own)
    if any(finding.kind in STEPS_OF_TOOL for finding in own):
        own = _without_tool_steps(own, move)
    slow = [f for f in own if f.factor is not None and not (f.kind == "jerk" and not alone)]
    if not slow and move.not_slowed is None:
        return own
    factor, hint = _by_slowing(slow, move, say, alone=alone)
    remedies = {} if factor is not None else move.planned.remedies
    return [
        replace(f, hint=remedies.get(f.kind, hint), factor=factor if f.factor is not None else None)
        if f in slow or (f.kind in LIMITS_OF_JOINTS and f.kind != "jerk" and factor is None)
        else f
        for f in own
    ]


def _by_slowing(
    slow: Sequence[Finding], move: PlannedMove, say: Say, *, alone: bool
) -> tuple[float | None, str]:
    """Return the factor by which a move keeps its limits, with the words that say so, or why none does."""
    stretch: float | Problem | None = move.not_slowed
    if stretch is None:
        stretch = longest_factor(slow) if move.at_rest else smallest_stretch(move, over_limit(move))
    if stretch is None or isinstance(stretch, Problem):
        why = "change the target, the start or the limit" if stretch is None else stretch.text(say)
        return None, f"{_NO_HELP}: {why}"
    text = f"it must last {at_least(stretch)} times longer"
    total = at_least(stretch * move.duration)
    field = _field_that_works(move, float(total))
    if field is None:
        return stretch, f"{text} ({total} s)" + (f": say {_SLOW}" if alone else ", all its times alike")
    where = "" if field == f"`duration: {total}`" else f": {field}"
    faster = _faster(move, float(total)) if alone else ""
    return stretch, f"{text} ({total} s{where})" + (f", or say {_SLOW}" if alone else "") + faster


def _faster(move: PlannedMove, duration: float) -> str:
    """Return what keeps the limits in much less time than `duration` seconds, where something does."""
    for words, change in move.planner.faster.items():
        other = _changed(move, change)
        if other is not None and other.duration < _MUCH_LESS * duration and not _kinds(other):
            return f"; {words} takes {at_least(other.duration)} s"
    return ""


def _field_that_works(move: PlannedMove, duration: float) -> str | None:
    """Return the field that makes the move last so long and keep its limits."""
    for words, planner in move.planner.lasting(duration):
        longer = _planned(move, planner)
        if longer is not None and not over_limit(longer):
            return words
    return None


def _planned(move: PlannedMove, planner: Planner, robot: Robot | None = None) -> PlannedMove | None:
    """Return the move by another planner, or within other limits; None where that is not possible."""
    arm = robot or move.robot
    try:
        planned = planner.plan(move.start, arm)
        return keep_further_limits(replace(move, planner=planner, planned=planned, robot=arm))
    except TrajcliError:
        return None


def _kinds(move: PlannedMove) -> set[str]:
    return {f.kind for f in verify(move.alone(), [move.robot.limits], [move.promise]).findings}


def _without_steps(own: Sequence[Finding], move: PlannedMove, moves: Sequence[PlannedMove]) -> str:
    """Return what makes the acceleration join in a move, or at its border."""
    parts, rough = [], move
    if _STEP not in _kinds(move):
        border = [f.time or 0.0 for f in own if f.kind == _STEP]
        starts = float(np.sum([m.duration for m in moves[: move.index]]))
        other = move.index + (1 if min(border) > starts + move.duration / 2 else -1)
        if not 0 <= other < len(moves):
            return next(f.hint for f in own if f.kind == _STEP) or ""
        parts.append("let the moves meet without acceleration")
        rough = moves[other]
    words = _smoother(rough)
    if words:
        parts.append(f"use {words}" + ("" if rough is move else f" for move {rough.index}"))
    parts += _without_jerk_limit(move, moves)
    return ", or ".join(parts) or "lower the jerk by another target or start"


def _without_tool_steps(own: Sequence[Finding], move: PlannedMove) -> list[Finding]:
    """Return the findings about a move; those of steps of the tool name what has none."""
    words = _smoother(move, {_STEP, *STEPS_OF_TOOL})
    return [
        replace(f, hint=(f.hint or "").replace(SMOOTH, words)) if words and f.kind in STEPS_OF_TOOL else f
        for f in own
    ]


def _smoother(move: PlannedMove, steps: AbstractSet[str] = frozenset({_STEP})) -> str:
    """Return the planners, or fields, by which a move has no such steps: those that pass, if any do."""
    tried = [(words, _changed(move, change)) for words, change in move.planner.smoother.items()]
    smooth = [(words, other) for words, other in tried if other is not None and not steps & _kinds(other)]
    fitting = [words for words, other in smooth if not _kinds(other)]
    if fitting or move.over_limit == "slow":
        return " or ".join(fitting or [words for words, _ in smooth])
    slower = [words for words, other in smooth if not _kinds(slow_to_limits(other))]
    return f"{' or '.join(slower)}, with {_SLOW}" if slower else " or ".join(words for words, _ in smooth)


def _changed(move: PlannedMove, change: Mapping[str, Any]) -> PlannedMove | None:
    other = changed(move.planner, change)
    return None if other is None else _planned(move, other)


def _without_jerk_limit(move: PlannedMove, moves: Sequence[PlannedMove]) -> Iterator[str]:
    """Yield how the limit of jerk is left out, where every move can do without it."""
    own = move.planner.limits is not None and bool(move.planner.limits.jerk)
    for other in moves:
        free = replace(other.robot.limits, jerk=np.tile([-np.inf, np.inf], (len(other.robot.joints), 1)))
        followed = other.duration > 0 and (other.planner.follows_jerk or other.planner.finds_duration)
        if followed and _planned(other, other.planner, replace(other.robot, limits=free)) is None:
            return
    yield "say limits: {jerk: null} in the job" + (" and leave `jerk` out of the move's own" if own else "")


def unit_hint(loaded: LoadedJob) -> str | None:
    """Return which `units` a job probably means, where its plain numbers are far too large as they are."""
    angles, lengths = [0.0], [0.0]
    for section in _SECTIONS:
        node = loaded.document.root.child(section)
        for is_length, value in _plain_numbers(node, section, loaded.robot):
            (lengths if is_length else angles).append(abs(value))
    units, looks, meant = loaded.units, [], {}
    if units.angle == "rad" and max(angles) > TWO_TURNS:
        looks.append(f"angles up to {max(angles):.6g} look like degrees")
        meant["angle"] = "deg"
    if units.length == "m" and max(lengths) > min(_FAR, _REACHES * _length_of(loaded.robot)):
        looks.append(f"lengths up to {max(lengths):.6g} look like millimetres")
        meant["length"] = "mm"
    if not looks:
        return None
    present: dict[str, str] = {"angle": units.angle, "length": units.length}
    kept = {kind: unit for kind, unit in present.items() if unit not in ("rad", "m")}
    written = ", ".join(f"{kind}: {unit}" for kind, unit in sorted({**kept, **meant}.items()))
    return f"{' and '.join(looks)}: say `units: {{{written}}}`"


def _length_of(robot: Robot) -> float:
    """Return the sum of the arm's DH lengths, m; infinite for bare joints."""
    if robot.convention is None:
        return math.inf
    return math.fsum(abs(joint.a) + abs(joint.d) for joint in robot.joints) or math.inf


def _plain_numbers(node: Node | None, key: str, robot: Robot) -> Iterator[tuple[bool, float]]:
    """Yield the numbers without a unit below a node, each with whether it is a length."""
    value = None if node is None else node.value
    if isinstance(value, dict):
        for name, below in value.items():
            if key in _BY_JOINT and name in robot.joint_names:
                yield from _of_joint(below, robot.joint_names.index(name), robot)
            elif name != "angle" or key == "axis_angle":
                yield from _plain_numbers(below, name, robot)
    elif isinstance(value, list):
        for index, below in enumerate(value):
            if key in _BY_JOINT and not isinstance(below.value, dict | list):
                yield from _of_joint(below, index, robot)
            else:
                yield from _plain_numbers(below, key, robot)
    elif key in _BY_JOINT and node is not None:
        yield from _of_joint(node, 0, robot)
    elif key in (*_ANGLES, *_LENGTHS) and isinstance(value, int | float):
        yield key in _LENGTHS, float(value)


def _of_joint(node: Node, joint: int, robot: Robot) -> Iterator[tuple[bool, float]]:
    """Yield the value of a joint, if it stands without a unit."""
    if isinstance(node.value, int | float) and joint < len(robot.joint_types):
        yield robot.joint_types[joint] == "prismatic", float(node.value)
