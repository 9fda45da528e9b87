"""The limits of which a plan and its moves use most, in words."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np

from trajcli.curves.extrema import peaks
from trajcli.frozen import frozen
from trajcli.kinematics.robot import QUANTITIES
from trajcli.planners.planner import PlannedMove
from trajcli.planning.plan import Plan
from trajcli.trajectory import Span

if TYPE_CHECKING:
    from trajcli.limits.tool_bound import ToolPeak


_SAME = 1e-9  # relative: parts of limits that differ by less are the same
_UNSURE = 1e-6  # relative: to which bounds of efforts and speeds of the tool are computed


@frozen
class Tightest:
    """The limit of which a move uses most.

    Attributes:
        span: The move.
        name: The limit, such as "velocity of wrist_1_joint".
        used: Which part of it is used, for all t.
    """

    span: Span
    name: str
    used: float

    @property
    def share(self) -> str:
        """How much of it is used, in words."""
        return f"{100 * self.used:.4g} %"


def tightest_limit(plan: Plan) -> str:
    """Return the limit of which a plan uses most, where, and how much; nothing where none is known."""
    best: Tightest | None = None
    for one in tightest_of_moves(plan):
        if best is None or one.used > best.used * (1 + 2 * _UNSURE):  # of those that use the same the first
            best = one
    return "" if best is None else f"{best.name} in move {best.span.index}, {best.share} used"


def tightest_of_moves(plan: Plan) -> Iterator[Tightest]:
    """Yield the limit of which each move uses most, of those that use any, in their order."""
    for index in range(len(plan.moves)):
        best, name = 0.0, ""
        for used, limit in _uses(plan, index):
            if used > best * (1 + _SAME):
                best, name = used, limit
        if best > 0:
            yield Tightest(plan.trajectory.spans[index], name, best)


def _uses(plan: Plan, index: int) -> Iterator[tuple[float, str]]:
    """Yield the largest part of each kind of limit that a move uses, and its name."""
    move, verdict = plan.moves[index], plan.verdict
    for order in (1, 2, 3):
        bounds, extremes = move.robot.limits.of_order(order), verdict.peaks[index][order]
        used = np.maximum(extremes.low / bounds[:, 0], extremes.high / bounds[:, 1])
        joint = int(used.argmax())
        yield float(used[joint]), f"{QUANTITIES[order]} of {move.robot.joint_names[joint]}"
    for use in verdict.by_position[index]:
        yield use.used, f"velocity by position of {move.robot.joint_names[use.component]}"
    effort, name = _effort(plan, index)
    yield effort * (1 - _UNSURE), f"effort of {name}"
    of_tool = verdict.tool_peaks[index]
    speed, name = _tool_speed(move) if of_tool is None else _tool_in_joint_space(move, of_tool)
    yield speed * (1 - _UNSURE), f"{name} of the tool"


def _effort(plan: Plan, index: int) -> tuple[float, str]:
    """Return the largest part of a limit of effort that a move uses, and the joint."""
    efforts, robot = plan.verdict.efforts[index], plan.moves[index].robot
    if efforts is None:
        return 0.0, ""
    sides = zip(efforts.highest, efforts.lowest, robot.limits.effort.tolist(), strict=True)
    used = [max(high.upper_bound / upper, low.upper_bound / -lower) for high, low, (lower, upper) in sides]
    joint = int(np.argmax(used))
    return used[joint], robot.joint_names[joint]


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
