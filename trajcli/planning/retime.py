"""Retiming of planned moves: until they keep their limits, or until they fill whole periods."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import ceil, copysign, inf

from trajcli.checks.verify import over_limits
from trajcli.curves.operations import scale_time
from trajcli.errors import Amount, Amounts, PlanningError, Problem, TrajcliError
from trajcli.findings import Finding
from trajcli.kinematics.robot import Robot
from trajcli.limits.kinds import (
    KIND_OF,
    LIMITS_OF_JOINTS,
    TOOL_KINDS,
    LimitedMove,
    LimitKind,
    has_further_limits,
)
from trajcli.planners.planner import LITTLE, Event, Planned, PlannedMove, Planner
from trajcli.trajectory import State

LONGEST = 1e4
"""Times the planned duration: a move that needs more is not over its limit, it is wrong."""
STEPS_OF_TOOL = {
    f"{kind.name}_jump": KIND_OF[kind.name.replace("acceleration", "jerk")]
    for kind in TOOL_KINDS
    if kind.order == 2
}
"""Limits that steps of the accelerations of the tool break, by the kinds of these findings."""
_ONE_BY_ONE = 1  # factors tried at once: each costs a plan of its own
_WHOLE = 1e-9  # of a period: what is this close to whole is whole
_TRIES = 50


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
        binding_phases=planned.binding_phases and factor <= 1 + LITTLE,
        phases=tuple(replace(p, start=p.start * factor, end=p.end * factor) for p in planned.phases),
        arrivals=planned.arrivals and tuple(time * factor for time in planned.arrivals),
        via_points=planned.via_points and planned.via_points.scaled(factor),
        origin=planned.origin * factor,
        tool=planned.tool and planned.tool.scaled(factor),
        virtual_points=planned.virtual_points and planned.virtual_points.scaled(factor),
        phase_plane=planned.phase_plane and planned.phase_plane.scaled(factor),
        certificate=planned.certificate and planned.certificate.scaled(factor),
    )


def keep_further_limits(move: PlannedMove) -> PlannedMove:
    """Return the move, where it finds its duration itself, within limits that its planner does not know.

    These are the limits of the tool for moves in joint space, and those of velocity by position and of
    efforts for all. It is stretched by the smallest factor that does it, with an event: a limit that is in
    force says how fast a move may be, whichever it is.
    """
    finds = move.planner.finds_duration and move.planner.without_duration() is None and move.duration > 0
    if not (finds and has_further_limits(move.robot.limits)):
        return move
    found = _findings(move)
    steps = [finding for finding in found if finding.kind in STEPS_OF_TOOL]
    if steps:  # no stretch helps
        return _within_tool_limits(move, steps, inf) or move
    left = {"never", "on paths"} if move.planned.tool is None else {"never"}
    over = [f for f in _slowed(found) if f.kind in KIND_OF and KIND_OF[f.kind].planned in left]
    factor = smallest_stretch(move, over) if over else None
    if factor is None or isinstance(factor, Problem):
        return move
    if factor <= 1 + LITTLE and any(KIND_OF[finding.kind].planned == "never" for finding in over):
        return _stretched(move, factor, over, "refined")
    slower = with_duration(move, move.duration * factor)
    faster = _within_tool_limits(move, over, slower.duration)
    if faster is not None:
        return faster
    if move.planner.one_shape and move.at_rest:
        worst = max(over, key=lambda finding: finding.factor or 0.0).kind
        return _stretched(move, factor, over, KIND_OF[worst].event)
    return _stretched(move, factor, over, "stretched", "; a faster motion may exist")


def _within_tool_limits(move: PlannedMove, over: Sequence[Finding], stretched: float) -> PlannedMove | None:
    """Return the move as fast as the limits of the tool let it be along its path, with an event.

    None where that is no faster than the move stretched, which lasts `stretched` seconds.
    """
    if not any(_limit_of(finding).of_tool for finding in over):
        return None
    try:
        planned = move.planner.within_tool_limits(move.start, move.robot)
    except PlanningError:
        return None
    if planned is None:
        return None
    other = replace(move, planned=planned)
    found = _findings(other)
    left = [finding.factor or LONGEST for finding in _slowed(found)]
    left += [inf for finding in found if finding.kind in STEPS_OF_TOOL]
    least = getattr(move.planner, "minimum_duration", None) or 0.0
    duration = max(other.duration * max([1.0, *left]), least)
    if duration >= stretched:
        return None
    if duration > other.duration:
        other = with_duration(other, duration)
    path = "its path" if planned.law is None else "a straight line in joint space"
    how = f"the fastest motion found along {path}, {other.duration / move.duration:.6g} times as long"
    event = _event("within_tool_limits", how, move, other, over)
    return replace(other, planned=replace(other.planned, events=(event, *other.planned.events)))


def long_enough(
    index: int, planner: Planner, start: State, robot: Robot, error: PlanningError
) -> PlannedMove:
    """Return the move whose given duration is too short as fast as it can be, with an event.

    Args:
        index: Of the move.
        planner: It refuses its duration.
        start: Where the move begins.
        robot: With the limits in force.
        error: Of the planner.

    Raises:
        PlanningError: `error`, where its duration is not what is wrong.
    """
    given = planner.without_duration()
    if given is None:
        raise error
    wanted, free = given
    try:
        planned = free.plan(start, robot)
    except TrajcliError:
        raise error from None
    needed, why = planned.curve.duration, error.problems[0]
    if needed <= wanted:
        raise error
    message = f"stretched {needed / wanted:.6g} times, from {{before}} to {{after}}: {why.message}"
    amounts: Amounts = {**why.amounts, "before": Amount(wanted), "after": Amount(needed)}
    event = Event("slowed", message, index, amounts)
    planned = replace(planned, events=(event, *planned.events))
    return PlannedMove(index, free, start, robot, planned, "slow", needed / wanted)


def slow_to_limits(move: PlannedMove) -> PlannedMove:
    """Return the smallest stretch of the move that keeps its limits, with an event if it is one.

    Where slowing down does not help (a position limit, a boundary velocity over its limit), the move comes
    back as it was, with the reason: the verdict on the whole trajectory will say so.
    """
    over = over_limit(move)
    if not over or move.duration == 0:
        return move
    factor = smallest_stretch(move, over)
    if isinstance(factor, Problem):
        return replace(move, not_slowed=factor)
    return _stretched(move, factor, over, "slowed")


def smallest_stretch(move: PlannedMove, over: Sequence[Finding]) -> float | Problem:
    """Return the smallest factor by which a move that is over limits keeps them, or why there is none.

    Args:
        move: From rest to rest its time is scaled; else it is planned again for each duration that is tried.
        over: Its findings of the limits of joints and tool.
    """
    follows = move.promise.ends is None and move.planner.proportional  # velocities at its ends are its own
    if move.at_rest or follows:
        factors = [finding.factor for finding in over]
        if None in factors:
            return Problem("change the target, the start or the limit")
        return max(f for f in factors if f is not None)
    from trajcli.curves.smallest_feasible import smallest_feasible
    from trajcli.planning.slowing import StretchSearch, why_no_duration

    reason = why_no_duration(move)
    if reason is not None:
        return reason
    search = StretchSearch(move, with_duration)
    factor = smallest_feasible(search.excess, 1.0, LONGEST, block=_ONE_BY_ONE)
    return search.in_vain() if factor is None else factor


def _stretched(
    move: PlannedMove, factor: float, over: list[Finding], kind: str, remark: str = ""
) -> PlannedMove:
    """Return the move that lasts `factor` times longer, with an event that names the worst finding."""
    slower = with_duration(move, move.duration * factor)
    how = f"stretched {slower.duration / move.duration:.6g} times"
    event = _event(kind, how, move, slower, over, remark)
    return replace(slower, planned=replace(slower.planned, events=(event, *slower.planned.events)))


def _event(
    kind: str, how: str, move: PlannedMove, slower: PlannedMove, over: Sequence[Finding], remark: str = ""
) -> Event:
    worst = max(over, key=lambda finding: finding.factor or 0.0)
    limit = _limit_of(worst).words
    message = f"{how}, from {{before}} to {{after}}, to keep the {limit} limit of {{whose}}{remark}"
    amounts: Amounts = {
        "before": Amount(move.duration),
        "after": Amount(slower.duration),
        "whose": worst.joint or "the tool",
    }
    return Event(kind, message, move.index, amounts)


def over_limit(move: PlannedMove) -> list[Finding]:
    """Return the findings about a move alone that a longer duration may help against, and about positions."""
    return _slowed(_findings(move))


def _findings(move: PlannedMove) -> tuple[Finding, ...]:
    return over_limits(move.alone(), [move.robot.limits], [move.promise])


def _slowed(findings: Sequence[Finding]) -> list[Finding]:
    return [f for f in findings if f.kind in LIMITS_OF_JOINTS or f.factor is not None]


def _limit_of(finding: Finding) -> LimitKind:
    return STEPS_OF_TOOL.get(finding.kind) or KIND_OF[finding.kind]


def require_holdable(move: PlannedMove) -> None:
    """Raise where a move is over a limit of effort that gravity and friction alone exceed.

    A motion that keeps its limits all the same, because it falls fast enough there, is none of these.

    Raises:
        PlanningError: With the joint, the place and by how much.
        InputError: When a link of the arm has no inertia, or the arm no geometry.
    """
    from trajcli.limits.effort import EffortFamily, gravity_problem

    trajectory = move.alone()
    limited = LimitedMove(trajectory, trajectory.spans[0], move.robot.limits, move.robot)
    efforts = EffortFamily().survey(limited)
    over = None if efforts is None else efforts.held_over()
    if over is None:
        return
    joint, limit, peak = over
    needed, position = copysign(peak.static, limit), trajectory.curve.evaluate(peak.time)
    raise PlanningError(
        gravity_problem(move.robot, joint, needed, limit, position, rubs=bool(peak.parts[2]), time=peak.time)
    )


def next_periods(duration: float, rate: float) -> int:
    """Return the least number of whole periods of `rate`, 1/s, that last `duration` seconds, at least one."""
    return max(1, ceil(duration * rate - _WHOLE))


def align_to_period(move: PlannedMove, rate: float) -> PlannedMove:
    """Return the move stretched to a whole number of periods; a move that keeps its limits goes on doing so.

    Raises:
        PlanningError: When the planner cannot last that long.
    """
    if move.duration == 0:
        return move
    periods = next_periods(move.duration, rate)
    less = move.at_rest and not move.robot.limits.has_effort
    free = less or bool(over_limit(move))
    for extra in range(_TRIES):
        wanted = (periods + extra) / rate
        longer = with_duration(move, wanted) if wanted != move.duration else move
        whole = abs(longer.duration - wanted) <= _WHOLE / rate
        if whole and (free or not over_limit(longer)):
            return longer
    raise PlanningError(
        f"{move.planner.tag} cannot last a whole number of periods at {rate:g} Hz within its limits",
        hint="leave `align` out, or change the rate",
    )
