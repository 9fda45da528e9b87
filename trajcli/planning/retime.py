"""Retiming of planned moves: until they keep their limits, or until they fill whole periods."""

from __future__ import annotations

from dataclasses import replace
from math import ceil

import numpy as np

from trajcli.checks.finding import Finding
from trajcli.checks.limits import peaks_by_move
from trajcli.checks.verify import verify
from trajcli.curves.extrema import Peaks
from trajcli.curves.operations import scale_time
from trajcli.curves.piecewise import Array
from trajcli.curves.smallest_feasible import smallest_feasible
from trajcli.errors import Amount, Amounts, PlanningError
from trajcli.kinematics.robot import QUANTITIES, ToolLimits, share_of_limits
from trajcli.planners.planner import Event, Planned, PlannedMove
from trajcli.trajectory import Trajectory

_LONGEST = 1e4  # times the planned duration: a move that needs more is not over its limit, it is wrong
_ROOM = 1e-10  # relative; a tenth of the tolerance of limits, so that rounding does not tip the later verdict
_ONE_BY_ONE = 1  # factors tried at once: each costs a plan of its own
_WHOLE = 1e-9  # of a period: what is this close to whole is whole
_TRIES = 50
_NO_TOOL_LIMITS = ToolLimits()


def with_duration(move: PlannedMove, duration: float) -> PlannedMove:
    """Return the move stretched to `duration` seconds.

    From rest to rest its time is scaled; a move with boundary velocities is planned again for that duration.

    Raises:
        PlanningError: When the planner cannot last that long.
    """
    factor = duration / move.duration
    if move.at_rest:
        return replace(move, planned=_scaled(move.planned, factor), stretch=move.stretch * factor)
    planned = move.planner.with_duration(duration).plan(move.start, move.robot)
    stretch = move.stretch * planned.curve.duration / move.duration
    return replace(move, planned=planned, stretch=stretch)


def _scaled(planned: Planned, factor: float) -> Planned:
    return replace(
        planned,
        curve=scale_time(planned.curve, factor),
        law=planned.law and scale_time(planned.law, factor),
        phases=tuple(replace(p, start=p.start * factor, end=p.end * factor) for p in planned.phases),
        arrivals=planned.arrivals and tuple(time * factor for time in planned.arrivals),
        via_points=planned.via_points and planned.via_points.scaled(factor),
        origin=planned.origin * factor,
        tool=planned.tool and planned.tool.scaled(factor),
    )


def keep_tool_limits(move: PlannedMove) -> PlannedMove:
    """Return the move in joint space, where it finds its duration itself, within the limits of the tool.

    It is stretched by the smallest factor that does it, with an event. Planners in joint space know limits of
    joints alone, and a limit that is in force says how fast a move may be, whichever it is.
    """
    known = move.planned.tool is None and move.planner.finds_duration and move.duration > 0
    if not known or move.robot.limits.tcp == _NO_TOOL_LIMITS:
        return move
    over = [finding for finding in _over_limit(move) if finding.joint is None]
    factor = _smallest_stretch(move, over) if over else None
    if factor is None:
        return move
    exactly = move.planner.one_shape and move.at_rest
    kind, remark = ("within_tool_limits", "") if exactly else ("stretched", "; a faster motion may exist")
    return _stretched(move, factor, over, kind, remark)


def slow_to_limits(move: PlannedMove) -> PlannedMove:
    """Return the smallest stretch of the move that keeps its limits, with an event if it is one.

    Where slowing down does not help (a position limit, a boundary velocity over its limit), the move comes
    back as it was: the verdict on the whole trajectory will say so.
    """
    over = _over_limit(move)
    if not over or move.duration == 0:
        return move
    factor = _smallest_stretch(move, over)
    return move if factor is None else _stretched(move, factor, over, "slowed")


def _smallest_stretch(move: PlannedMove, over: list[Finding]) -> float | None:
    """Return the smallest factor by which a move that is over limits keeps them, if there is one."""
    if not move.at_rest:
        if move.robot.limits.tcp != _NO_TOOL_LIMITS:
            from trajcli.checks.tool_limits import tool_ends_over_limit

            if tool_ends_over_limit(move.robot, (move.start, move.planned.end)):
                return None
        return smallest_feasible(lambda factors: _excess(move, factors), 1.0, _LONGEST, block=_ONE_BY_ONE)
    factors = [finding.factor for finding in over]
    return None if None in factors else max(f for f in factors if f is not None)


def _stretched(
    move: PlannedMove, factor: float, over: list[Finding], kind: str, remark: str = ""
) -> PlannedMove:
    """Return the move that lasts `factor` times longer, with an event that names the worst finding."""
    slower = with_duration(move, move.duration * factor)
    worst = max(over, key=lambda finding: finding.factor or 0.0)
    limit = worst.kind.removeprefix("tool_").replace("_", " ")
    message = (
        f"stretched {slower.stretch:.6g} times, from {{before}} to {{after}}, "
        f"to keep the {limit} limit of {{whose}}{remark}"
    )
    amounts: Amounts = {
        "before": Amount(move.duration),
        "after": Amount(slower.duration),
        "whose": worst.joint or "the tool",
    }
    event = Event(kind, message, move.index, amounts)
    return replace(slower, planned=replace(slower.planned, events=(event, *slower.planned.events)))


def _over_limit(move: PlannedMove) -> list[Finding]:
    findings = verify(move.alone(), [move.robot.limits], [move.promise]).findings
    return [f for f in findings if f.kind in QUANTITIES or f.factor is not None]


def _excess(move: PlannedMove, factors: Array) -> Array:
    """Return by how much of a limit the move is over its limits when stretched by each of the factors."""
    return np.array([_excess_of(move, move.duration * factor) for factor in factors.tolist()])


def _excess_of(move: PlannedMove, duration: float) -> float:
    try:
        longer = with_duration(move, duration)
    except PlanningError:
        return np.inf
    alone = longer.alone()
    (peaks,) = _judged_peaks(alone, longer)
    joints = float(share_of_limits([(p.low, p.high) for p in peaks], move.robot.limits)) - (1 + _ROOM)
    if move.robot.limits.tcp == _NO_TOOL_LIMITS:
        return joints
    from trajcli.checks.tool_limits import limits_tool, share_of_tool_limits, tool_peaks

    if not limits_tool(move.robot):
        return joints
    of_tool = tool_peaks(alone, alone.spans[0], move.robot)
    return max(joints, share_of_tool_limits(move.robot.limits.tcp, of_tool) - 1)


def _judged_peaks(alone: Trajectory, move: PlannedMove) -> list[tuple[Peaks, ...]]:
    peaks = peaks_by_move(alone)
    if move.planned.braking is None:
        return peaks
    from trajcli.checks.braking import judged_peaks

    return judged_peaks(alone, [move.robot.limits], [move.promise], peaks)


def align_to_period(move: PlannedMove, rate: float) -> PlannedMove:
    """Return the move stretched to a whole number of periods; a move that keeps its limits goes on doing so.

    Raises:
        PlanningError: When the planner cannot last that long.
    """
    if move.duration == 0:
        return move
    periods = max(1, ceil(move.duration * rate - _WHOLE))
    was_over = bool(_over_limit(move))
    for extra in range(_TRIES):
        wanted = (periods + extra) / rate
        longer = with_duration(move, wanted) if wanted != move.duration else move
        whole = abs(longer.duration - wanted) <= _WHOLE / rate
        if whole and (was_over or not _over_limit(longer)):
            return longer
    raise PlanningError(
        f"{move.planner.tag} cannot last a whole number of periods at {rate:g} Hz within its limits",
        hint="leave `align` out, or change the rate",
    )
