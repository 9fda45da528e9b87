"""Retiming of planned moves: until they keep their limits, or until they fill whole periods.

Between moving states the duration is searched for, and why there is none is said.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import ceil, copysign, inf

import numpy as np

from trajcli.checks.verify import over_limits
from trajcli.curves.operations import scale_time
from trajcli.curves.piecewise import Array
from trajcli.errors import Amount, Amounts, PlanningError, Problem, TrajcliError, at_least
from trajcli.findings import Finding
from trajcli.kinematics.robot import Robot, ToolLimits
from trajcli.limits.joints import JointSurvey, peaks_by_move
from trajcli.limits.kinds import (
    KIND_OF,
    LIMITS_OF_JOINTS,
    TOOL_KINDS,
    LimitedMove,
    LimitKind,
    families,
    family,
    has_further_limits,
)
from trajcli.limits.tolerances import exceeds
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
_PROBED = (1.5, 4.0, 30.0)  # times the duration: a planner that refuses all of them refuses any


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
    message = f"stretched {at_least(needed / wanted)} times, from {{before}} to {{after}}: {why.message}"
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

    reason = why_no_duration(move)
    if reason is not None:
        return reason
    search = StretchSearch(move)
    factor = smallest_feasible(search.excess, 1.0, LONGEST, block=_ONE_BY_ONE)
    return search.in_vain() if factor is None else factor


def _stretched(
    move: PlannedMove, factor: float, over: list[Finding], kind: str, remark: str = ""
) -> PlannedMove:
    """Return the move that lasts `factor` times longer, with an event that names the worst finding."""
    slower = with_duration(move, move.duration * factor)
    how = f"stretched {at_least(slower.duration / move.duration)} times"
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


def why_no_duration(move: PlannedMove) -> Problem | None:
    """Return why no motion whatever between the ends of a move keeps the limits, where that is plain."""
    limits, ends = move.robot.limits, (move.start, move.planned.end)
    if limits.tcp != ToolLimits() and family("tool").over_at_ends(move.robot, ends, ("tool_speed", -1, 0.0)):
        return Problem("the tool is too fast where the move starts or ends")
    if move.planned.begins is not None or move.planned.origin:
        return None  # where the curve begins and ends depends on its duration
    if move.planned.braking is not None:
        return None  # it may start outside its limits
    judges = [family("joints"), *(each for _, each in families(limits, further=True))]
    for state, verb in zip(ends, ("starts", "ends"), strict=True):
        for judge in judges:
            reason = judge.why_not_in_state(move.robot, state)
            if reason is not None:
                return Problem(reason[0].replace("{verb}", verb), amounts=reason[1])
        short = _no_room(move, state, verb)
        if short is not None:
            return short
    return None


def _no_room(move: PlannedMove, state: State, verb: str) -> Problem | None:
    """Return that a joint is too near to the end of its range to stop, or to have come to its velocity.

    Within the acceleration a a velocity v takes the distance v^2 / (2 a), however long the move lasts.
    """
    positions, accelerations = move.robot.limits.of_order(0), move.robot.limits.of_order(2)
    forward = state.velocity > 0
    ahead = forward if verb == "starts" else ~forward
    left = np.where(ahead, positions[:, 1] - state.position, state.position - positions[:, 0])
    rate = np.where(ahead, -accelerations[:, 0], accelerations[:, 1])
    needed = state.velocity**2 / (2 * rate)
    short = np.flatnonzero((state.velocity != 0) & exceeds(needed, left))
    if not short.size:
        return None
    joint = int(short[0])
    purpose = "to stop" if verb == "starts" else "to come to that velocity"
    message = f"{{joint}} {verb} with {{velocity}}, {{room}} from its limit, and needs {{needed}} {purpose}"
    amounts: Amounts = {
        "joint": move.robot.joint_names[joint],
        "velocity": Amount(float(state.velocity[joint]), 1, joint),
        "room": Amount(float(left[joint]), 0, joint),
        "needed": Amount(float(needed[joint]), 0, joint, rounded="up"),
    }
    return Problem(message, amounts=amounts)


class StretchSearch:
    """The excess of a move over its limits by how many times longer it lasts, and what is learned of it.

    Where the times of all parts of a curve are scaled alike, its position at each part of the duration T is
    a + b T, but for terms of accelerations at its ends. What the range is left by, the largest of such lines,
    is convex in T: once it grows, it grows for ever.
    """

    def __init__(self, move: PlannedMove) -> None:
        """Prepare the search for a move that does not start and end at rest."""
        self._move = move
        self._refusal = self._why_no_longer()
        bent = move.start.acceleration.any() or move.planned.end.acceleration.any()
        self._convex = move.planner.proportional and not bent
        self._hopeless, self._joint = np.inf, 0
        self._last = (0.0, -np.inf)

    def excess(self, factors: Array) -> Array:
        """Return by how much of a limit the move is over its limits when stretched by each of the factors."""
        return np.array([self._excess(factor) for factor in factors.tolist()])

    def in_vain(self) -> Problem:
        """Return why no factor was found."""
        if self._refusal is not None:
            return self._refusal
        if np.isfinite(self._hopeless):
            name = self._move.robot.joint_names[self._joint]
            message = "the longer it lasts, the further {joint} goes beyond its position limit"
            return Problem(message, amounts={"joint": name})
        return Problem("no duration keeps all limits between these moving states")

    def _why_no_longer(self) -> Problem | None:
        """Return the refusal of a planner that refuses to last longer, whatever the duration."""
        refusal = None
        for factor in _PROBED:
            try:
                with_duration(self._move, self._move.duration * factor)
            except PlanningError as error:
                refusal = error.problems[0]
            else:
                return None
        return refusal

    def _excess(self, factor: float) -> float:
        if self._refusal is not None or factor >= self._hopeless:
            return np.inf
        from trajcli.checks.braking import judged_peaks

        try:
            longer = with_duration(self._move, self._move.duration * factor)
        except PlanningError:
            return np.inf
        alone, robot = longer.alone(), longer.robot
        (peaks,) = judged_peaks(alone, [robot.limits], [longer.promise], peaks_by_move(alone))
        self._learn(factor, peaks[0].low, peaks[0].high)
        limited = LimitedMove(alone, alone.spans[0], robot.limits, robot)
        further = (each.survey(limited) for _, each in families(robot.limits, further=True))
        surveys = (JointSurvey(tuple(peaks), robot.limits), *further)
        return max(survey.excess() for survey in surveys if survey is not None)

    def _learn(self, factor: float, lowest: Array, highest: Array) -> None:
        """Note from which factor on the range of a joint is left, and ever more so."""
        low, high = self._move.robot.limits.of_order(0).T
        beyond = np.maximum(low - lowest, highest - high)
        by, joint = float(beyond.max()), int(beyond.argmax())
        before, by_before = self._last
        if self._convex and by > max(by_before, 0.0) and factor > before and np.isfinite(by_before):
            self._hopeless, self._joint = min(self._hopeless, factor), joint
        self._last = (factor, by)
