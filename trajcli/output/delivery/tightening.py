"""Tighter limits for moves whose rows pass a limit as they are joined, or a rule of their consumer."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from trajcli.findings import Finding
from trajcli.kinematics.robot import QUANTITIES
from trajcli.limits.kinds import KIND_OF, STRETCHABLE
from trajcli.planning.adaptation import Adaptation, Cap, proportions
from trajcli.planning.plan import Plan

_HOPELESS = 1e3  # times a limit: a step of velocity, which no motion of any duration is without
_FURTHEST = 30.0  # times the tolerance: to what a tool leaves its path by, slowness is no help
_SLOWEST = 0.7  # of the speed, in one round, where the tool leaves its path between rows
_LITTLE = 1.003  # times a limit: such a move is stretched, as another one might be found within less
_LESS = 1 - 1e-9  # of a limit that is tightened


def may_be_cured(finding: Finding) -> bool:
    """Return whether other rows, or a slower motion, may help against a finding of its kind."""
    return (finding.kind in STRETCHABLE or finding.kind == "deviation") and finding.move is not None


def _curable(finding: Finding) -> bool:
    """Return whether a slower motion may help against a finding."""
    worst = _FURTHEST if finding.kind == "deviation" else _HOPELESS
    return may_be_cured(finding) and bool(finding.limit) and finding.excess < worst


def tightened(
    plan: Plan,
    over: Sequence[Finding],
    uses: Sequence[tuple[float, int, int, int]],
    adapted: Adaptation,
    *,
    stretched: bool = False,
) -> Adaptation | None:
    """Return how moves are planned so that rows do not pass what they pass now; None where nothing helps.

    Args:
        plan: A plan that verifies.
        over: What its rows pass as they are joined, and by the rules of their consumer.
        uses: Shares of limits of joints above 1, as `JoinedRows.uses` yields them.
        adapted: How its moves were planned.
        stretched: Whether moves are stretched, whatever they pass.
    """
    caps, longer = dict(adapted.caps), dict[int, float]()
    moves = {move.index: number for number, move in enumerate(plan.moves)}
    if not all(map(_curable, over)):
        return None
    for kind, excess, joint, index in _passed(plan, over, uses):
        for number in _movers(plan, moves[index]):
            move = plan.moves[number]
            if move.over_limit != "slow":
                continue
            if kind == "deviation" and not stretched:
                _slow_down(caps, plan, number, max(excess**-0.5, _SLOWEST))
            elif stretched or (excess < _LITTLE and adapted.period is None and move.at_rest):
                factor = excess ** (1 / _order_of(kind)) / _LESS
                longer[move.index] = max(longer.get(move.index, 1.0), factor)
            else:
                _tighten(caps, plan, number, (kind, excess, joint))
    if caps == adapted.caps and not longer:
        return None
    stretches = {index: adapted.stretches.get(index, 1.0) * factor for index, factor in longer.items()}
    return replace(adapted, caps=caps, stretches={**adapted.stretches, **stretches})


def _passed(
    plan: Plan, over: Sequence[Finding], uses: Sequence[tuple[float, int, int, int]]
) -> Iterator[tuple[str, float, int, int]]:
    """Yield the kind of each limit that is passed, how many times, the joint (-1 for none) and the move."""
    for share, order, joint, index in uses:
        yield QUANTITIES[order], share, joint, index
    names = plan.trajectory.joint_names
    for finding in over:
        joint = -1 if finding.joint is None else names.index(finding.joint)
        yield finding.kind, finding.excess, joint, finding.move or 0


def _order_of(kind: str) -> int:
    """Return with which power of a stretch a quantity falls; rows leave the path of a tool by the square."""
    return 2 if kind == "deviation" else KIND_OF[kind].order or 1


def _movers(plan: Plan, number: int) -> Iterator[int]:
    """Yield a move; where the arm stands in it, those beside it, whose rows its own are joined with."""
    if plan.verdict.peaks[number][1].magnitude.any():
        yield number
        return
    yield from (other for other in (number - 1, number + 1) if 0 <= other < len(plan.moves))


def _slow_down(caps: dict[Cap, float], plan: Plan, number: int, share: float) -> None:
    """Lower all caps of a move so that it moves at a share of its speed."""
    for order in (1, 2, 3):
        for joint in range(len(plan.trajectory.joint_names)):
            key = plan.moves[number].index, QUANTITIES[order], joint
            if peak := _reached(plan, number, order, joint):
                caps[key] = min(caps.get(key, np.inf), peak) * share**order


def _reached(plan: Plan, number: int, order: int, joint: int) -> float:
    """Return the largest rate of a joint in a move, in either direction in proportion to its larger bound."""
    peaks, bounds = plan.verdict.peaks[number][order], plan.moves[number].robot.limits.of_order(order)[joint]
    rates = np.maximum([-peaks.low[joint], peaks.high[joint]], 0.0)
    return float((rates / proportions(bounds)).max())


def _tighten(caps: dict[Cap, float], plan: Plan, number: int, passed: tuple[str, float, int]) -> None:
    """Lower the cap of a move: of the kind that is passed, by how many times, and whose it is."""
    name, excess, joint = passed
    move, kind = plan.moves[number], KIND_OF[name]
    limits, share, reached = move.robot.limits, _LESS / excess, np.inf
    if kind.of_tool:
        limit = float(getattr(limits.tcp, kind.key))
    elif name == "velocity_by_position":
        limit, share = float(limits.velocity_by_position[joint, 0]), share**2
    else:
        sizes = np.abs(getattr(limits, kind.key)[joint])
        limit = float(sizes[np.isfinite(sizes)].max(initial=0.0)) or np.inf
        if name in QUANTITIES:
            reached = _reached(plan, number, kind.order or 0, joint) or np.inf
    key = move.index, name, joint
    caps[key] = min(caps.get(key, np.inf), reached, limit) * share
