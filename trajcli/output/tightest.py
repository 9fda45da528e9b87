"""The limit of which a plan uses most, in words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from trajcli.curves.extrema import peaks
from trajcli.kinematics.robot import QUANTITIES
from trajcli.planners.planner import PlannedMove
from trajcli.planning.plan import Plan

if TYPE_CHECKING:
    from trajcli.limits.tool_bound import ToolPeak


def tightest_limit(plan: Plan) -> str:
    """Return the limit of which a plan uses most, where, and how much; nothing where none is known."""
    best, text = 0.0, ""
    verdict = plan.verdict
    of_moves = zip(plan.moves, verdict.peaks, verdict.tool_peaks, verdict.by_position, strict=True)
    for index, (move, extremes, of_tool, by_position) in enumerate(of_moves):
        for order in (1, 2, 3):
            bounds = move.robot.limits.of_order(order)
            used = np.maximum(extremes[order].low / bounds[:, 0], extremes[order].high / bounds[:, 1])
            joint = int(used.argmax())
            if used[joint] > best * (1 + 1e-9):
                best = float(used[joint])
                name = move.robot.joint_names[joint]
                text = f"{QUANTITIES[order]} of {name} in move {move.index}, {100 * best:.4g} % used"
        for use in by_position:
            if use.used > best * (1 + 1e-9):
                best, name = use.used, move.robot.joint_names[use.component]
                text = f"velocity by position of {name} in move {move.index}, {100 * best:.4g} % used"
        effort, name = _effort(plan, index)
        if effort > best * (1 + 1e-6):
            best, text = effort, f"effort of {name} in move {move.index}, {100 * effort:.4g} % used"
        speed, name = _tool_speed(move) if of_tool is None else _tool_in_joint_space(move, of_tool)
        if speed > best * (1 + 1e-6):
            best, text = speed, f"{name} of the tool in move {move.index}, {100 * speed:.4g} % used"
    return text


def _effort(plan: Plan, index: int) -> tuple[float, str]:
    """Return the largest part of a limit of effort that a move uses, and the joint."""
    if plan.verdict.efforts[index] is None:
        return 0.0, ""
    from trajcli.output.effort_report import most_used

    report = most_used(plan, index)
    return (0.0, "") if report is None else (report.used or 0.0, report.joint)


def _tool_speed(move: PlannedMove) -> tuple[float, str]:
    """Return which part of the limit of the tool's speed along its path is used, and its name."""
    tool, limits = move.planned.tool, move.robot.limits.tcp
    if tool is None:
        return 0.0, "speed"
    limit, name = (limits.angular_speed, "angular speed") if tool.pure_rotation else (limits.speed, "speed")
    return float(peaks(tool.law, (1,))[0].magnitude[0]) / limit, name


def _tool_in_joint_space(move: PlannedMove, peaks: Mapping[str, ToolPeak]) -> tuple[float, str]:
    """Return the largest part of a limit of the tool that is used, and the limit's name."""
    limits = move.robot.limits.tcp
    used, name = max((peak.value / getattr(limits, name), name) for name, peak in peaks.items())
    return used, name.replace("_", " ")
