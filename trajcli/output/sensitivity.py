"""Sensitivity in reports: what limits would save that are higher."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from trajcli.job.report import MoveReport, Report
from trajcli.job.reports.comparisons import SavingReport
from trajcli.kinematics.robot import QUANTITIES
from trajcli.planning.plan import Plan

if TYPE_CHECKING:
    from trajcli.planning.sensitivity import Saving

_NOTHING = 1e-9  # relative to the duration: what rounding leaves of no saving


def with_savings(report: Report, plan: Plan, moves: Sequence[int]) -> Report:
    """Return the report with what each limit that is 10 % higher would save, found by planning with it.

    Args:
        report: Of the plan.
        plan: The plan.
        moves: Indices of the moves that are looked at.
    """
    from trajcli.planning.sensitivity import savings_of

    savings = list(savings_of(plan, moves))
    of_moves = tuple(_with_own(move, plan, savings) if move.index in moves else move for move in report.moves)
    return report.model_copy(update={"moves": of_moves, "savings": _totals(savings, plan)})


def _with_own(move: MoveReport, plan: Plan, savings: Sequence[Saving]) -> MoveReport:
    own = [_report([one], plan) for one in savings if one.move == move.index]
    return move.model_copy(update={"savings": sorted(own, key=lambda one: -(one.saved or 0.0))})


def _totals(savings: Sequence[Saving], plan: Plan) -> list[SavingReport]:
    """Return the savings of all moves together, the largest first."""
    by_limit: dict[tuple[int, int], list[Saving]] = {}
    for one in savings:
        by_limit.setdefault((one.joint, one.order), []).append(one)
    totals = [_report(alike, plan) for alike in by_limit.values()]
    return sorted(totals, key=lambda one: -(one.saved or 0.0))


def _report(savings: Sequence[Saving], plan: Plan) -> SavingReport:
    first, known = savings[0], [one.saved for one in savings if one.saved is not None]
    duration = math.fsum(plan.moves[one.move].duration for one in savings)
    saved = None if len(known) < len(savings) else math.fsum(known)
    if saved is not None and abs(saved) <= _NOTHING * duration:
        saved = 0.0
    return SavingReport(
        joint=plan.trajectory.joint_names[first.joint],
        quantity=QUANTITIES[first.order],
        saved=saved,
        share=None if saved is None or not duration else saved / duration,
        reason=next((one.reason for one in savings if one.reason is not None), None),
    )
