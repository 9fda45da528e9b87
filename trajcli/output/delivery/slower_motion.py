"""Slower motion for a consumer: where rows pass a limit as they are joined, or a rule.

Moves get tighter limits, or are stretched; of moves that are all stretched alike each is judged by itself.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from trajcli.curves.piecewise import Array, derivative_coefficients, horner
from trajcli.errors import Problem, TrajcliError, VerificationError
from trajcli.findings import Finding
from trajcli.judge.reconstruction import piece_coefficients
from trajcli.kinematics.robot import QUANTITIES
from trajcli.limits.kinds import KIND_OF, STRETCHABLE
from trajcli.output.delivery.joined_rows import JoinedRows
from trajcli.planners.planner import PlannedMove
from trajcli.planning.adaptation import Adaptation, Cap, proportions
from trajcli.planning.plan import Plan
from trajcli.planning.retime import align_to_period, next_periods, over_limit, with_duration

_HOPELESS = 1e3  # times a limit: a step of velocity, which no motion of any duration is without
_FURTHEST = 30.0  # times the tolerance: to what a tool leaves its path by, slowness is no help
_SLOWEST = 0.7  # of the speed, in one round, where the tool leaves its path between rows
_LITTLE = 1.003  # times a limit: such a move is stretched, as another one might be found within less
_LESS = 1 - 1e-9  # of a limit that is tightened
_STATED = {"linear": 1, "cubic": 2, "quintic": 3}  # of position, velocity and acceleration
_SHARES = np.linspace(0.0, 1.0, 9)  # of an interval, at which its curve is looked at
_ON_ROW = 1e-6  # of a period
_CERTAIN = 3e-6  # relative: above a limit by more than counts as over
_NOISE = 120.0  # last bits of a position at both ends of an interval h: 60 / h^3 times as much, of a quintic


def may_be_cured(finding: Finding) -> bool:
    """Return whether other rows, or a slower motion, may help against a finding of its kind."""
    return finding.kind in {"position", *STRETCHABLE, "deviation"} and finding.move is not None


def refuse_braking(plan: Plan, where: str) -> None:
    """Raise VerificationError where a move brakes from a start outside of its limits, in which rows begin.

    Args:
        plan: A plan that verifies.
        where: The consumer, and where the rows stand, in words.
    """
    for move, peaks in zip(plan.moves, plan.verdict.peaks, strict=True):
        if move.planned.braking is None:
            continue
        bounds = [move.robot.limits.of_order(order) for order in (1, 2)]
        used = [
            np.maximum(p.low / b[:, 0], p.high / b[:, 1]) for p, b in zip(peaks[1:3], bounds, strict=True)
        ]
        order, joint = np.unravel_index(np.argmax(used), np.shape(used))
        share = f"{100 * used[order][joint]:.4g} % of the {QUANTITIES[order + 1]}"
        name = plan.trajectory.joint_names[joint]
        problem = Problem(
            f"{where}: the move starts outside of its limits, and brakes: {share} of {{joint}} used",
            hint="no rows of that keep them: let it start within them, or plan it without a consumer",
            place=plan.loaded.place_of_move(move.index),
            move=move.index,
            joint=name,
            amounts={"joint": name},
            kind=QUANTITIES[order + 1],
        )
        raise VerificationError(problem)


def _curable(finding: Finding) -> bool:
    """Return whether a slower motion may help against a finding."""
    worst = _FURTHEST if finding.kind == "deviation" else _HOPELESS
    return may_be_cured(finding) and finding.kind != "position" and finding.excess < worst


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
    stretches = {
        index: _stretch(adapted, plan.moves[moves[index]]) * factor for index, factor in longer.items()
    }
    return replace(adapted, caps=caps, stretches={**adapted.stretches, **stretches})


def _stretch(adapted: Adaptation, move: PlannedMove) -> float:
    """Return how many times longer than its fastest a move lasts: with its chain, and up to the next row."""
    fastest = adapted.fastest.get(adapted.key(move.index, move.start))
    lasts = move.stretch if fastest is None else move.stretch / fastest.stretch
    return max(adapted.stretches.get(move.index, 1.0), lasts)


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


class StretchedMoves:
    """Moves from rest to rest that begin and end on rows, for any factor by which all are stretched.

    What joins the rows inside such a move depends on its duration alone, so that each is judged once; and one
    that is over a limit is enough for a motion that need not be planned.
    """

    def __init__(self, rows: JoinedRows, rate: float, planned: Mapping[Any, PlannedMove]) -> None:
        """Take the moves as they are planned before anything is known of their rows.

        Args:
            rows: Of the motion that is not stretched.
            rate: Of the rows, 1/s.
            planned: Its moves by `Adaptation.key`.
        """
        plan, first = rows.plan, Adaptation()
        moves = [planned.get(first.key(move.index, move.start)) for move in plan.moves if move.duration > 0]
        fit = rows.interpolation is not None
        self._moves = [move for move in moves if fit and move is not None and move.at_rest]
        self._rate, self._interpolation = rate, rows.interpolation or "linear"  # without one no move fits
        self._followed = {move.index: other for move, other in pairwise(moves) if move is not None}
        self._over, self._kept = dict[tuple[int, ...], bool](), dict[tuple[int, int], bool]()

    def are_over(self, factor: float) -> bool:
        """Return whether a move is certainly over a limit of a joint when all of them are so much longer."""
        adapted = Adaptation(stretches={move.index: factor for move in self._moves})
        try:
            stretched = {
                move.index: adapted.stretched(move) if move.over_limit == "slow" else move
                for move in self._moves
            }
            longer = {index: self._to_next_row(move) for index, move in stretched.items()}
        except TrajcliError:
            return False
        for index, move in longer.items():
            other = self._followed.get(index)
            behind = None if other is None else longer.get(other.index)
            both = [each for each in (move, behind) if each is not None]
            key = (index, *(round(each.duration * self._rate) for each in both))
            if key not in self._over:
                self._over[key] = self._is_over(move, behind)
            if self._over[key] and all(self._ends_there(stretched[each.index], each) for each in both):
                return True
        return False

    def _to_next_row(self, move: PlannedMove) -> PlannedMove:
        wanted = next_periods(move.duration, self._rate) / self._rate
        return move if wanted == move.duration else with_duration(move, wanted)

    def _ends_there(self, move: PlannedMove, longer: PlannedMove) -> bool:
        """Return whether a move ends at its next row: within limits of efforts it may have to last longer."""
        if not move.robot.limits.has_effort:
            return True
        key = move.index, round(longer.duration * self._rate)
        if key not in self._kept:
            self._kept[key] = not over_limit(longer)
        try:
            return self._kept[key] or align_to_period(move, self._rate).duration == longer.duration
        except TrajcliError:
            return False

    def _is_over(self, move: PlannedMove, behind: PlannedMove | None) -> bool:
        """Return whether the curve that joins rows is over a limit where a break of the planned one lies.

        The row at its end states the acceleration with which the move behind it begins.
        """
        curve, period = move.planned.curve, 1.0 / self._rate
        stated = _STATED[self._interpolation]
        in_periods = curve.breaks * self._rate
        inside = np.unique(np.floor(in_periods[np.abs(in_periods - np.rint(in_periods)) > _ON_ROW]))
        last = round(curve.end * self._rate) - 1
        begun = None if behind is None else self._begun(behind)
        inside = inside[inside < last] if begun is None else np.union1d(inside[inside < last], [last])
        if not inside.size:
            return False
        before = curve.evaluate_orders(inside * period, range(stated))
        after = curve.evaluate_orders(
            np.minimum((inside + 1) * period, curve.end), range(stated), side="left"
        )
        if begun is not None and stated > 2:
            after[-1, 2] = begun
        both = np.stack([before, after], axis=1).reshape(2 * inside.size, stated, -1)
        lengths = np.full(2 * inside.size - 1, period)
        columns = [both[:, order] if order < stated else None for order in range(3)]
        pieces = piece_coefficients(lengths, both[:, 0], columns[1], columns[2], self._interpolation)[:, ::2]
        last_bits = _NOISE * float(np.spacing(np.abs(both[:, 0]).max()))
        for order in range(1, stated + 1):
            values = horner(
                derivative_coefficients(pieces, order)[:, None], period * _SHARES[:, None, None]
            ).reshape(-1, both.shape[2])
            bounds = move.robot.limits.of_order(order)
            slack = last_bits / period**order
            low = (values.min(axis=0) + slack) / bounds[:, 0]
            high = (values.max(axis=0) - slack) / bounds[:, 1]
            if max(float(low.max()), float(high.max())) > 1 + _CERTAIN:
                return True
        return False

    def _begun(self, move: PlannedMove) -> Array | None:
        """Return the acceleration with which a move begins; None where it changes before a row could tell."""
        curve = move.planned.curve
        return None if curve.lengths[0] * self._rate <= _ON_ROW else curve.evaluate(curve.start, 2)
