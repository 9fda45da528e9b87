"""One move: planned, within limits that its planner does not know, slowed, and in whole periods."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from trajcli.errors import PlanningError
from trajcli.job.read import LoadedJob
from trajcli.kinematics.robot import Robot
from trajcli.limits.kinds import has_further_limits
from trajcli.planners.planner import PlannedMove, Planner
from trajcli.trajectory import State

if TYPE_CHECKING:
    from trajcli.planning.adaptation import Adaptation

_TRIES = 20  # durations of a move with its breaks on rows


def plan_move_within(
    loaded: LoadedJob,
    index: int,
    planner: Planner,
    start: State,
    robot: Robot,
    adapted: Adaptation | None = None,
) -> PlannedMove:
    """Return a move of a job, planned, and retimed as the job asks for.

    Args:
        loaded: The job.
        index: Of the move.
        planner: Of the move, its target by joints.
        start: State in which it begins.
        robot: With the limits in force.
        adapted: By what it is planned otherwise than its limits alone say.

    Raises:
        InputError: When it lacks a limit.
        PlanningError: When it has no curve.
    """
    job = loaded.job
    over_limit = planner.when_over_limit or job.when_over_limit
    try:
        move = PlannedMove(index, planner, start, robot, planner.plan(start, robot), over_limit)
    except PlanningError as error:
        if over_limit != "slow":
            raise
        from trajcli.planning.retime import long_enough

        move = long_enough(index, planner, start, robot, error)
    move = _within_limits(move)
    if adapted is not None and over_limit == "slow" and not planner.handles:
        move = adapted.stretched(move)
        if adapted.period is not None:
            move = _on_rows(move, adapted.period) or move
    if job.output.align:
        from trajcli.planning.retime import align_to_period

        move = align_to_period(move, job.output.rate)
    if robot.limits.has_effort and not planner.handles:
        from trajcli.planning.retime import require_holdable

        require_holdable(move)
    return move


def _within_limits(move: PlannedMove) -> PlannedMove:
    """Return the move within limits that its planner does not know, and slowed where the job asks for it."""
    if has_further_limits(move.robot.limits):
        from trajcli.planning.retime import keep_further_limits

        move = keep_further_limits(move)
    if move.over_limit == "slow":
        from trajcli.planning.retime import slow_to_limits

        move = slow_to_limits(move)
    return move


def _on_rows(move: PlannedMove, period: float) -> PlannedMove | None:
    """Return the move with its breaks on rows, within all limits; None where its method has none."""
    least = move.duration
    for _ in range(_TRIES):
        planned = move.planner.on_rows(move.start, move.robot, period, least)
        if planned is None:
            return None
        other = replace(move, planned=replace(planned, events=move.planned.events))
        kept = _within_limits(other)
        if kept.duration == other.duration:
            return other
        least = kept.duration
    return None
