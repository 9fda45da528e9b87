"""The limits of which a plan and its moves use most, in words."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from trajcli.frozen import frozen
from trajcli.kinematics.robot import QUANTITIES
from trajcli.planning.plan import Plan
from trajcli.trajectory import Span

_SAME = 1e-9  # relative: parts of limits that differ by less are the same
_UNSURE = 1e-6  # relative: to which bounds of efforts and speeds of the tool are computed


@frozen
class Tightest:
    """The limit of which a move uses most.

    Attributes:
        span: The move.
        quantity: What is limited: "velocity", "velocity_by_position", "effort" or, of the tool, "speed".
        joint: Whose limit it is; None for the tool's.
        used: Which part of it is used, for all t.
    """

    span: Span
    quantity: str
    joint: str | None
    used: float

    @property
    def name(self) -> str:
        """The limit in words, such as "velocity of wrist_1_joint"."""
        return f"{self.quantity.replace('_', ' ')} of {self.joint or 'the tool'}"

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
        if (one := tightest_of_move(plan, index)) is not None:
            yield one


def tightest_of_move(plan: Plan, index: int) -> Tightest | None:
    """Return the limit of which a move uses most; None where it uses none. Of equal ones the first counts."""
    best, found = 0.0, None
    for used, sure, quantity, joint in _uses(plan, index):
        if used * sure > best * (1 + _SAME):
            best, found = used * sure, Tightest(plan.trajectory.spans[index], quantity, joint, used)
    return found


def _uses(plan: Plan, index: int) -> Iterator[tuple[float, float, str, str | None]]:
    """Yield of each kind of limit the largest part that is used, what of it is sure, quantity and joint."""
    move, verdict = plan.moves[index], plan.verdict
    for order in (1, 2, 3):
        bounds, extremes = move.robot.limits.of_order(order), verdict.peaks[index][order]
        used = np.maximum(extremes.low / bounds[:, 0], extremes.high / bounds[:, 1])
        joint = int(used.argmax())
        yield float(used[joint]), 1.0, QUANTITIES[order], move.robot.joint_names[joint]
    for use in verdict.by_position[index]:
        yield use.used, 1.0, "velocity_by_position", move.robot.joint_names[use.component]
    effort, name = _effort(plan, index)
    yield effort, 1.0 - _UNSURE, "effort", name
    of_tool: Any = verdict.surveys[index].get("tool")
    for k, (key, peak) in enumerate(() if of_tool is None else of_tool.peaks.items(), 1):
        yield peak.value / getattr(move.robot.limits.tcp, key), 1.0 - k * _UNSURE, key, None


def _effort(plan: Plan, index: int) -> tuple[float, str]:
    """Return the largest part of a limit of effort that a move uses, and the joint."""
    efforts, robot = plan.verdict.efforts[index], plan.moves[index].robot
    if efforts is None:
        return 0.0, ""
    sides = zip(efforts.highest, efforts.lowest, robot.limits.effort.tolist(), strict=True)
    used = [max(high.upper_bound / upper, low.upper_bound / -lower) for high, low, (lower, upper) in sides]
    joint = int(np.argmax(used))
    return used[joint], robot.joint_names[joint]
