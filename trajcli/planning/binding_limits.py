"""Binding limits: of which a plan uses most, for how long each one binds, and what a higher one would save.

A limit binds where the motion is within a millionth of it, for which the roots of polynomials say the times.
A time-optimal law is at a limit all the time, at points of its grid exactly and between them a little below:
there its switching structure says which one binds. What a higher one saves is found by planning the move
with it.
"""

from __future__ import annotations

import time as clock
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from trajcli.curves.extrema import Peaks, durations_above
from trajcli.curves.piecewise import Array, derivative_coefficients
from trajcli.errors import TrajcliError
from trajcli.frozen import comparable, frozen
from trajcli.kinematics.robot import QUANTITIES, Limits
from trajcli.planners.planner import PlannedMove, Planner
from trajcli.planning.plan import Plan
from trajcli.planning.planned_move import plan_move_within
from trajcli.progress import report_progress
from trajcli.trajectory import Span

if TYPE_CHECKING:
    from trajcli.curves.approach import ApproachUse

_SAME = 1e-9  # relative: parts of limits that differ by less are the same
_UNSURE = 1e-6  # relative: to which bounds of efforts and speeds of the tool are computed
BindingQuantity = Literal["velocity", "acceleration", "jerk", "velocity_by_position"]
_BINDING: tuple[BindingQuantity, ...] = ("velocity", "acceleration", "jerk")

NEAR = 1e-6
"""Relative: a limit binds where the motion is as near to it as that."""
RAISED = 1.1
"""How many times higher a limit is made."""
SECONDS = 60.0
"""Longest time that is taken for planning with higher limits, s."""


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


@comparable
class TimeAtLimit:
    """For how long a move is at one limit of a joint.

    Attributes:
        joint: Index.
        quantity: "velocity", "acceleration", "jerk" or "velocity_by_position".
        seconds: For how long, in either direction.
        method: "exact": from roots; "phases": from the switching structure of a time-optimal law.
    """

    joint: int
    quantity: BindingQuantity
    seconds: float
    method: Literal["exact", "phases"] = "exact"


@comparable
class Saving:
    """What a higher limit of one joint would save.

    Attributes:
        move: Index of the move.
        joint: Index.
        order: 1 for velocity, 2 acceleration, 3 jerk.
        saved: Seconds by which the move is faster, 0 where only slower ones were found: it is within the
            higher limit, too; None where no motion with that was found.
        reason: Why there is none.
    """

    move: int
    joint: int
    order: int
    saved: float | None
    reason: str | None = None


def times_at_limits(
    move: PlannedMove, peaks: Sequence[Peaks] | None = None, uses: Sequence[ApproachUse] | None = None
) -> tuple[TimeAtLimit, ...]:
    """Return for how long a move is at the limits of its joints, the longest first.

    Args:
        move: The move.
        peaks: Of position and its three derivatives over the move, where they are known: what is below its
            limits needs no roots.
        uses: How much it uses of limits of the velocity by position, likewise.
    """
    if move.planned.binding_phases:
        return _times_of_phases(move)
    curve, found = move.planned.curve, []
    for order in (1, 2, 3):
        bounds = move.robot.limits.of_order(order)
        joints = np.arange(curve.dimension) if peaks is None else np.array(_at_limit(bounds, peaks[order]))
        if not joints.size or order > curve.degree:
            continue
        rates = derivative_coefficients(curve.coefficients, order)[:, :, joints]
        seconds = np.zeros(joints.size)
        for side, sign in ((0, -1.0), (1, 1.0)):
            limited = np.isfinite(bounds[joints, side])
            levels = np.where(limited, sign * bounds[joints, side] * (1 - NEAR), np.inf)
            some = np.flatnonzero(limited)
            if some.size:
                above = durations_above(sign * rates[:, :, some], curve.lengths, levels[some])
                seconds[some] += above.sum(axis=0)
        found += [
            TimeAtLimit(int(joint), _BINDING[order - 1], float(each))
            for joint, each in zip(joints, seconds, strict=True)
            if each > 0
        ]
    near = uses is None or any(use.used >= 1 - NEAR for use in uses)
    if near and move.robot.limits.has_velocity_by_position and curve.degree > 1:
        from trajcli.curves.approach import durations_at_limit

        limits = move.robot.limits.approach
        seconds = durations_at_limit(curve.coefficients, curve.lengths, limits, NEAR)
        for joint, each in zip(limits.limited.tolist(), seconds.tolist(), strict=True):
            found += [TimeAtLimit(joint, "velocity_by_position", each)] if each > 0 else []
    return tuple(sorted(found, key=lambda one: -one.seconds))


def _times_of_phases(move: PlannedMove) -> tuple[TimeAtLimit, ...]:
    seconds: dict[tuple[int, BindingQuantity], float] = {}
    for phase in move.planned.phases:
        named = [quantity for quantity in _BINDING if phase.name.split()[0] == quantity]
        if phase.joint is not None and named:
            key = phase.joint, named[0]
            seconds[key] = seconds.get(key, 0.0) + phase.end - phase.start
    times = [TimeAtLimit(*key, each, "phases") for key, each in seconds.items() if each > 0]
    return tuple(sorted(times, key=lambda one: -one.seconds))


def _at_limit(bounds: Array, peaks: Peaks) -> list[int]:
    """Return the joints that come near to a bound."""
    high = peaks.high >= bounds[:, 1] * (1 - NEAR)
    low = peaks.low <= bounds[:, 0] * (1 - NEAR)
    return [int(joint) for joint in np.flatnonzero(high | low)]


def savings_of(plan: Plan, moves: Sequence[int], seconds: float = SECONDS) -> Iterator[Saving]:
    """Yield what limits that are 10 % higher would save of each move, one joint and quantity at a time.

    Limits that bind are tried. Where a move is at none, all are that its moving joints have: something else
    holds it, and they may help. A move that is told how long it lasts saves nothing, and is left out.

    Args:
        plan: A plan.
        moves: Indices of the moves that are looked at.
        seconds: After that time no further motion is planned, and a saving says so.
    """
    begun = clock.monotonic()
    todo = [(index, joint, order) for index in moves for joint, order in _tried(plan, index)]
    for count, (index, joint, order) in enumerate(todo, 1):
        if clock.monotonic() - begun > seconds:
            yield Saving(index, joint, order, None, f"not planned: {seconds:g} s have passed")
            continue
        move = plan.moves[index]
        name = f"{QUANTITIES[order]} limit of {move.robot.joint_names[joint]}"
        report_progress(f"planning move {index} with a higher {name} ({count} of {len(todo)})")
        yield _saving(plan, move, joint, order)


def _tried(plan: Plan, index: int) -> list[tuple[int, int]]:
    """Return joint and order of the limits of a move that are made higher."""
    move, peaks = plan.moves[index], plan.verdict.peaks[index]
    if move.duration == 0 or (_given(plan, move).without_duration() is not None and move.stretch == 1):
        return []
    if not (move.planner.finds_duration or move.over_limit == "slow"):
        return []
    limits = move.robot.limits
    binding = [
        (joint, order) for order in (1, 2, 3) for joint in _at_limit(limits.of_order(order), peaks[order])
    ]
    return binding or [
        (joint, order)
        for order in (1, 2, 3)
        for joint in range(len(move.robot.joints))
        if np.isfinite(limits.of_order(order)[joint]).any() and peaks[order].magnitude[joint] > 0
    ]


def _given(plan: Plan, move: PlannedMove) -> Planner:
    """Return the planner of a move with the duration that the job gives, where it could not be kept."""
    asked = plan.loaded.job.moves[move.index].without_duration()
    if asked is None or move.planner.without_duration() is not None:
        return move.planner
    return move.planner.with_duration(asked[0])


def _saving(plan: Plan, move: PlannedMove, joint: int, order: int) -> Saving:
    robot = replace(move.robot, limits=raised(move.robot.limits, joint, order))
    if move.planned.parts:
        return _saving_of_chain(plan, move, joint, order)
    try:
        planner = _given(plan, move).searched_from(move.planned)
        faster = plan_move_within(plan.loaded, move.index, planner, move.start, robot)
    except TrajcliError as error:
        return Saving(move.index, joint, order, None, error.problems[0].text(plan.loaded.say))
    return Saving(move.index, joint, order, max(move.duration - faster.duration, 0.0))


def _saving_of_chain(plan: Plan, move: PlannedMove, joint: int, order: int) -> Saving:
    """Return what another limit of a move saves where the motion flies by its corners: of the whole chain."""
    from trajcli.planners.flying_by import duration_within

    chains = () if plan.flyby is None or plan.flyby.chains is None else plan.flyby.chains
    chain = next((each for each in chains if move.index in each.moves), None)
    if chain is None:
        reason = "not planned: it flies by corners, and others are stopped at although zones are named"
        return Saving(move.index, joint, order, None, reason)
    own = chain.robots[chain.moves.index(move.index)]
    higher = replace(own, limits=raised(own.limits, joint, order))
    try:
        duration = duration_within(chain, move.index, higher)
    except TrajcliError as error:
        return Saving(move.index, joint, order, None, error.problems[0].text(plan.loaded.say))
    return Saving(move.index, joint, order, max(chain.duration - duration, 0.0))


def raised(limits: Limits, joint: int, order: int) -> Limits:
    """Return limits of which one joint's of one quantity are higher."""
    kinds = {1: limits.velocity, 2: limits.acceleration, 3: limits.jerk}
    kinds[order] = np.array(kinds[order])
    kinds[order][joint] *= RAISED
    return replace(limits, velocity=kinds[1], acceleration=kinds[2], jerk=kinds[3])
