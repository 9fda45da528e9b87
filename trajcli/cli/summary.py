"""The few lines that people read on standard error after a plan."""

from __future__ import annotations

import numpy as np

from trajcli.curves.extrema import peaks
from trajcli.kinematics.robot import QUANTITIES
from trajcli.pipeline.plan import Plan
from trajcli.pipeline.stretch import PlannedMove


def summary(plan: Plan, rows: int) -> str:
    """Return the verdict in a few lines: extent, tightest limit, what was not checked, concessions."""
    count = len(plan.moves)
    head = f"{plan.loaded.name}: verified, {count} move{'s' * (count != 1)}, {plan.trajectory.duration:.6g} s"
    lines = [head + (f", {rows} row{'s' * (rows != 1)}" if rows else "")]
    tightest = _tightest(plan)
    if tightest:
        lines.append(f"  tightest limit: {tightest}")
    unchecked = _unchecked(plan)
    if unchecked:
        lines.append(f"  without a limit, not checked: {unchecked}")
    if plan.verdict.steps:
        first = plan.verdict.steps[0]
        more = f" and {len(plan.verdict.steps) - 1} more" if len(plan.verdict.steps) > 1 else ""
        lines.append(f"  the acceleration steps: {first.joint} at t = {first.time:.6g} s{more}")
    lines += [f"  {event.kind}: {_where(event.move)}{event.message}" for event in plan.events]
    return "\n".join(lines)


def _where(move: int | None) -> str:
    return "" if move is None else f"move {move}: "


def _tightest(plan: Plan) -> str:
    best, text = 0.0, ""
    for move, extremes in zip(plan.moves, plan.verdict.peaks, strict=True):
        for order in (1, 2, 3):
            bounds = move.robot.limits.of_order(order)
            used = np.maximum(extremes[order].low / bounds[:, 0], extremes[order].high / bounds[:, 1])
            joint = int(used.argmax())
            if used[joint] > best * (1 + 1e-9):
                best = float(used[joint])
                name = move.robot.joint_names[joint]
                text = f"{QUANTITIES[order]} of {name} in move {move.index}, {100 * best:.4g} % used"
        speed, name = _tool_speed(move)
        if speed > best * (1 + 1e-6):
            best, text = speed, f"{name} of the tool in move {move.index}, {100 * speed:.4g} % used"
    return text


def _tool_speed(move: PlannedMove) -> tuple[float, str]:
    """Return which part of the limit of the tool's speed along its path is used, and its name."""
    tool, limits = move.planned.tool, move.robot.limits.tcp
    if tool is None:
        return 0.0, "speed"
    limit, name = (limits.angular_speed, "angular speed") if tool.in_place else (limits.speed, "speed")
    return float(peaks(tool.law, (1,))[0].magnitude[0]) / limit, name


def _unchecked(plan: Plan) -> str:
    every = set(plan.trajectory.joint_names)
    parts = []
    for quantity in QUANTITIES:
        joints = [joint for joint, what in plan.verdict.unchecked if what == quantity]
        if set(joints) == every:
            parts.append(quantity)
        elif joints:
            parts.append(f"{quantity} of {', '.join(joints)}")
    return ", ".join(parts)
