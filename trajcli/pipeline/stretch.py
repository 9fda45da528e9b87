"""Make a planned move last longer: until it keeps its limits, or until it fills whole periods."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import ceil

from trajcli.checks.finding import Finding
from trajcli.checks.verify import Verdict, verify
from trajcli.curves.compose import scale_time
from trajcli.errors import Amount, PlanningError
from trajcli.kinematics.robot import QUANTITIES, Robot
from trajcli.planners.planner import Event, Planned, Planner
from trajcli.trajectory import Span, State, Trajectory

_LONGEST = (
    1e4  # times the planned duration; a move that needs more than that is not over its limit, it is wrong
)
_SEARCH = 1.1  # ratio of neighbouring candidates before the bracket is halved
_EXACT = 1e-12  # relative width at which halving ends
_WHOLE = 1e-9  # of a period: what is this close to whole is whole
_TRIES = 50


@dataclass(frozen=True, eq=False)
class PlannedMove:
    """A move with all that it was planned from.

    Attributes:
        index: Number in the job, from 0.
        planner: The move as it stands in the job.
        start: State in which it begins.
        robot: With the limits in force for this move.
        planned: What the planner returned, stretched where that was asked for.
        stretch: How many times longer it lasts than its planner said.
    """

    index: int
    planner: Planner
    start: State
    robot: Robot
    planned: Planned
    stretch: float = 1.0

    @property
    def duration(self) -> float:
        """Seconds."""
        return self.planned.curve.duration

    def alone(self) -> Trajectory:
        """Return the trajectory of this move alone."""
        span = Span(self.index, self.planner.tag, 0.0, self.duration, self.planner.continuity)
        names, types = self.robot.joint_names, self.robot.joint_types
        return Trajectory(self.planned.curve, names, types, (span,), self.start, self.planned.end)

    def verdict(self) -> Verdict:
        """Return the verdict on this move alone."""
        return verify(self.alone(), [self.robot.limits])


def lasting(move: PlannedMove, duration: float) -> PlannedMove:
    """Return the move stretched to `duration` seconds.

    From rest to rest its time is scaled; a move with boundary velocities is planned again for that duration.

    Raises:
        PlanningError: When the planner cannot last that long.
    """
    factor = duration / move.duration
    if move.start.at_rest and move.planned.end.at_rest:
        return replace(move, planned=_scaled(move.planned, factor), stretch=move.stretch * factor)
    fields = type(move.planner).model_fields
    field = next((name for name in ("minimum_duration", "duration") if name in fields), None)
    if field is None:
        raise PlanningError(f"{move.planner.tag} cannot last longer than it does")
    again = {name: None for name in ("duration",) if name in fields} | {field: duration}
    planned = move.planner.model_copy(update=again).plan(move.start, move.robot)
    stretch = move.stretch * planned.curve.duration / move.duration
    return replace(move, planned=planned, stretch=stretch)


def _scaled(planned: Planned, factor: float) -> Planned:
    return replace(
        planned,
        curve=scale_time(planned.curve, factor),
        law=planned.law and scale_time(planned.law, factor),
        phases=tuple(replace(p, start=p.start * factor, end=p.end * factor) for p in planned.phases),
        arrivals=planned.arrivals and tuple(time * factor for time in planned.arrivals),
    )


def slowed(move: PlannedMove) -> tuple[PlannedMove, list[Event]]:
    """Return the smallest stretch of the move that keeps its limits, and an event if it is one.

    Where slowing down does not help (a position limit, a boundary velocity over its limit), the move comes back as
    it was: the verdict on the whole trajectory will say so.
    """
    over = _over_limit(move)
    if not over or any(finding.factor is None for finding in over) or move.duration == 0:
        return move, []
    worst = max(over, key=lambda finding: finding.factor or 0.0)
    if move.start.at_rest and move.planned.end.at_rest:
        slower = lasting(move, move.duration * (worst.factor or 1.0))
    else:
        found = _search(move)
        if found is None:
            return move, []
        slower = found
    message = f"stretched {slower.stretch:.6g} times, from {{before}} to {{after}}, to keep the {worst.kind} limit of {worst.joint}"
    amounts = {"before": Amount(move.duration), "after": Amount(slower.duration)}
    return slower, [Event("slowed", message, move.index, amounts), *slower.planned.events]


def _over_limit(move: PlannedMove) -> list[Finding]:
    return [finding for finding in move.verdict().findings if finding.kind in QUANTITIES]


def _search(move: PlannedMove) -> PlannedMove | None:
    """Return the shortest stretch that verifies: the first of a geometric row, then halving."""

    def attempt(factor: float) -> PlannedMove | None:
        try:
            longer = lasting(move, move.duration * factor)
        except PlanningError:
            return None
        return None if _over_limit(longer) else longer

    low, high = 1.0, _SEARCH
    best = attempt(high)
    while best is None and high < _LONGEST:
        low, high = high, high * _SEARCH
        best = attempt(high)
    return best and _halved(attempt, low, high, best)


def _halved(
    attempt: Callable[[float], PlannedMove | None], low: float, high: float, best: PlannedMove
) -> PlannedMove:
    while high - low > _EXACT * high:
        middle = (low + high) / 2
        if middle in (low, high):
            break
        better = attempt(middle)
        low, high, best = (low, middle, better) if better is not None else (middle, high, best)
    return best


def aligned(move: PlannedMove, rate: float) -> PlannedMove:
    """Return the move stretched to a whole number of periods.

    Raises:
        PlanningError: When the planner cannot last that long.
    """
    if move.duration == 0:
        return move
    periods = ceil(move.duration * rate - _WHOLE)
    for extra in range(_TRIES):
        wanted = (periods + extra) / rate
        longer = lasting(move, wanted) if wanted != move.duration else move
        if abs(longer.duration - wanted) <= _WHOLE / rate:
            return longer
    raise PlanningError(
        f"{move.planner.tag} cannot last a whole number of periods at {rate:g} Hz",
        hint="leave `align` out, or change the rate",
    )
