"""Parts of reports that few jobs have: efforts and loads, zones, and what higher limits would save."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal

from trajcli.job.report import MoveReport, Report
from trajcli.job.report_parts import (
    BoundReport,
    EffortReport,
    EffortsReport,
    FlyByReport,
    MountedToolReport,
    PayloadReport,
    SavingReport,
    ZoneReport,
)
from trajcli.kinematics.robot import QUANTITIES, JointType, Payload, Robot
from trajcli.language.limits import OF_ROBOT
from trajcli.planning.plan import Plan
from trajcli.units import effort_unit, joint_units

if TYPE_CHECKING:
    from trajcli.limits.effort import MoveEfforts
    from trajcli.planning.binding_limits import Saving
    from trajcli.planning.flown_job import FlownZone, FlyBy

_NOTHING = 1e-9  # relative to the duration: what rounding leaves of no saving


def payload_report(payload: Payload | None) -> PayloadReport | None:
    """Return a payload, or a tool's own mass, in SI; None where it is nothing."""
    if payload is None:
        return None
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = payload.inertia.tolist()
    inertia = [xx, yy, zz, xy, xz, yz]
    return PayloadReport(mass=payload.mass, com=payload.com.tolist(), inertia=inertia)


def mounted_report(plan: Plan, index: int) -> MountedToolReport | None:
    """Return the tool of a move, in SI; None where the job has one tool without a name."""
    job, robot = plan.loaded.job, plan.moves[index].robot
    if not job.tools and not job.changes_tool:
        return None
    pose = robot.tool
    return MountedToolReport(
        name=robot.tool_name or None,
        xyz=pose[:3, 3].tolist(),
        matrix=pose[:3, :3].tolist(),
        load=payload_report(robot.tool_load),
    )


def effort_reports(plan: Plan, index: int) -> list[EffortReport] | None:
    """Return the extremes of the efforts in a move, a report for each joint; None where none are limited."""
    efforts = plan.verdict.efforts[index] if index < len(plan.verdict.efforts) else None
    if efforts is None:
        return None
    robot, start = plan.moves[index].robot, plan.trajectory.curve.start
    return [_report(robot, joint, efforts, start) for joint in range(len(robot.joints))]


def _report(robot: Robot, joint: int, efforts: MoveEfforts, start: float) -> EffortReport:
    high, low = efforts.highest[joint], efforts.lowest[joint]
    lower, upper = robot.limits.effort[joint].tolist()
    used = max(high.upper_bound / upper, low.upper_bound / -lower)
    upwards = high.upper_bound / upper >= low.upper_bound / -lower if used > 0 else high.value >= low.value
    worst, sign, limit = (high, 1, upper) if upwards else (low, -1, -lower)
    kind: Literal["N m", "N"] = "N" if effort_unit(robot.joint_types[joint]) == "N" else "N m"
    return EffortReport(
        joint=robot.joint_names[joint],
        low=-low.value,
        low_time=low.time - start,
        high=high.value,
        high_time=high.time - start,
        bound=(-low.upper_bound, high.upper_bound),
        limit=(_finite(lower), _finite(upper)),
        used=max(used, 0.0) if math.isfinite(min(-lower, upper)) else None,
        head_room=limit - worst.upper_bound if math.isfinite(limit) else None,
        gravity=sign * worst.gravity,
        gravity_share=worst.gravity / worst.value if worst.value else 0.0,
        unit=kind,
    )


def _finite(bound: float) -> float | None:
    return bound if math.isfinite(bound) else None


def efforts_report(plan: Plan) -> EffortsReport | None:
    """Return whether torques and forces were judged, and by which numbers; None for bare joints."""
    robot = plan.loaded.robot
    if robot.convention is None:
        return None
    judged = any(efforts is not None for efforts in plan.verdict.efforts)
    lacking = robot.without_inertia
    return EffortsReport(
        judged=judged,
        reason=None if judged else _reason(plan),
        inertials=None if len(lacking) == len(robot.joints) else plan.loaded.source,
        gravity=robot.gravity.tolist(),
    )


def _reason(plan: Plan) -> str:
    """Return why no effort was judged."""
    robot, limits = plan.loaded.robot, plan.loaded.job.limits
    lacking = robot.without_inertia
    if lacking:
        return f"no mass and inertia of the links behind {', '.join(lacking)}"
    if limits is not None and limits.effort not in ((), OF_ROBOT):
        return "the job's limits say null"
    stated = any(math.isfinite(bound) for joint in robot.joints for bound in joint.effort)
    if stated:
        return f"those of {robot.name} count where the job says `limits: {{effort: robot}}`"
    return "no limit of effort is given"


def flyby_report(flyby: FlyBy, types: Sequence[JointType], names: Sequence[str]) -> FlyByReport:
    """Return the report of what flying by corners gained.

    Args:
        flyby: What it is.
        types: Of the joints.
        names: Of the joints.
    """
    bound = flyby.best_bound
    return FlyByReport(
        duration=flyby.duration,
        stopping=flyby.stopping,
        saved=flyby.stopping - flyby.duration,
        bound=None if bound is None else BoundReport(duration=bound[0], method=bound[1]),
        searched=flyby.searched,
        zones=[_zone(zone, types, names) for zone in flyby.zones],
    )


def _zone(zone: FlownZone, types: Sequence[JointType], names: Sequence[str]) -> ZoneReport:
    unit = {"position": "m", "orientation": "rad"}.get(zone.of) or joint_units(types)[zone.joint or 0]
    return ZoneReport.model_validate(
        {
            **{key: getattr(zone, key) for key in ZoneReport.model_fields if hasattr(zone, key)},
            "joint": None if zone.joint is None else names[zone.joint],
            "unit": unit,
            "lowered": zone.pace if zone.pace < 1 else None,
        }
    )


def with_savings(report: Report, plan: Plan, moves: Sequence[int]) -> Report:
    """Return the report with what each limit that is 10 % higher would save, found by planning with it.

    Args:
        report: Of the plan.
        plan: The plan.
        moves: Indices of the moves that are looked at.
    """
    from trajcli.planning.binding_limits import savings_of

    savings = list(savings_of(plan, moves))
    of_moves = tuple(_with_own(move, plan, savings) if move.index in moves else move for move in report.moves)
    return report.model_copy(update={"moves": of_moves, "savings": _totals(savings, plan)})


def _with_own(move: MoveReport, plan: Plan, savings: Sequence[Saving]) -> MoveReport:
    own = [_saving_report([one], plan) for one in savings if one.move == move.index]
    return move.model_copy(update={"savings": sorted(own, key=lambda one: -(one.saved or 0.0))})


def _totals(savings: Sequence[Saving], plan: Plan) -> list[SavingReport]:
    """Return the savings of all moves together, the largest first."""
    by_limit: dict[tuple[int, int], list[Saving]] = {}
    for one in savings:
        by_limit.setdefault((one.joint, one.order), []).append(one)
    totals = [_saving_report(alike, plan) for alike in by_limit.values()]
    return sorted(totals, key=lambda one: -(one.saved or 0.0))


def _saving_report(savings: Sequence[Saving], plan: Plan) -> SavingReport:
    first, found = savings[0], [one.saved for one in savings if one.saved is not None]
    duration = math.fsum(plan.moves[one.move].duration for one in savings)
    saved = None if len(found) < len(savings) else math.fsum(found)
    if saved is not None and abs(saved) <= _NOTHING * duration:
        saved = 0.0
    return SavingReport(
        joint=plan.trajectory.joint_names[first.joint],
        quantity=QUANTITIES[first.order],
        saved=saved,
        share=None if saved is None or not duration else saved / duration,
        reason=next((one.reason for one in savings if one.reason is not None), None),
    )
