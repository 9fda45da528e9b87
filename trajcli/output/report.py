"""Report of a plan, and the errors of its verdict."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from trajcli.checks.continuity import AccelerationSteps
from trajcli.checks.verify import Verdict
from trajcli.curves.extrema import Peaks
from trajcli.errors import Problem, VerificationError
from trajcli.findings import Finding
from trajcli.job.report import (
    BindingReport,
    ByPositionReport,
    EventReport,
    FastestReport,
    FindingReport,
    KnotsDeviation,
    KnotsReport,
    LowestSpeedReport,
    MoveReport,
    OffChordReport,
    OutsideReport,
    PeakReport,
    Report,
    SegmentSpeedsReport,
    StepReport,
    ToolPeakReport,
    ToolReport,
    UncheckedReport,
    UncheckedToolReport,
    WaypointReport,
)
from trajcli.job.report_parts import AtLimitReport, FlyByReport, SignalReport
from trajcli.kinematics.robot import QUANTITIES, Robot
from trajcli.knots import Knots, has_knots, knots_of
from trajcli.planners.planner import Event, PlannedMove
from trajcli.planning.binding_limits import tightest_of_move, times_at_limits
from trajcli.planning.plan import Plan
from trajcli.planning.planned_move import path_of_tool
from trajcli.trajectory import Span, Trajectory
from trajcli.units import joint_units
from trajcli.version import __version__

if TYPE_CHECKING:
    from trajcli.curves.approach import ApproachUse
    from trajcli.kinematics.following.motion import ToolMotion
    from trajcli.limits.kinds import LimitKind
    from trajcli.limits.tool_bound import SpeedRun, ToolPeak
    from trajcli.planning.causes import Cause

_ROUNDING = 1e-12  # rad or m: what leaves the range by less does not leave it
_HELD = 0.999  # of the wanted speed: that much counts as holding it
_EACH = 16  # times of a piece of the law at which its speed is looked at
_NEAR = 0.02  # of the duration: a limit that binds as near as this is the reason
_AT_REST = 1e-6  # SI: a tool that turns, or moves, less than that does not


def report_of(
    plan: Plan, *, reference: bool = False, peers: bool = False, knots: Knots | None = None
) -> Report:
    """Return the report of a plan, in SI.

    Args:
        plan: The plan.
        reference: Whether each move is compared with ruckig's bound, time-optimal ones with toppra, too.
        peers: Whether all moves along a path are compared with toppra; implies `reference`.
        knots: Those of its trajectory, where they are known.
    """
    from trajcli.output.report_parts import efforts_report

    verdict = plan.verdict
    if knots is None and verdict.passed and has_knots(plan.trajectory):
        knots = knots_of(plan.trajectory)
    moves = tuple(
        _move(plan, index, reference=reference or peers, peers=peers) for index in range(len(plan.moves))
    )
    contradictions = _contradictions(plan, moves) if verdict.passed and (reference or peers) else []
    units = dict(zip(plan.trajectory.joint_names, joint_units(plan.trajectory.joint_types, 2), strict=True))
    return Report(
        trajcli=__version__,
        verdict="verified" if verdict.passed and not contradictions else "violated",
        job=plan.loaded.name,
        robot=plan.loaded.robot.name,
        duration=plan.trajectory.duration,
        moves=moves,
        findings=[
            FindingReport.model_validate(finding.said_by(plan.loaded.say))
            for finding in (*verdict.findings, *contradictions)
        ],
        events=[EventReport(kind=e.kind, message=e.message, move=e.move) for e in plan.events],
        remarks=[EventReport(kind=e.kind, message=e.message, move=e.move) for e in plan.remarks],
        steps=_steps(verdict.steps, units),
        unchecked=[UncheckedReport(joint=joint, quantity=quantity) for joint, quantity in verdict.unchecked],
        efforts=efforts_report(plan),
        unchecked_of_tool=[UncheckedToolReport(quantity=name) for name in verdict.unchecked_of_tool],
        knots=None if knots is None else _knots(plan.trajectory, knots),
        flyby=_flyby(plan),
        signals=_signals(plan),
    )


def _signals(plan: Plan) -> list[SignalReport]:
    named = [(signal.name, change) for signal in plan.trajectory.signals for change in signal.changes]
    return [
        SignalReport(name=name, value=change.value, move=change.move, time=change.time)
        for name, change in sorted(named, key=lambda item: item[1].time)
    ]


def _flyby(plan: Plan) -> FlyByReport | None:
    if plan.flyby is None:
        return None
    from trajcli.output.report_parts import flyby_report

    return flyby_report(plan.flyby, plan.trajectory.joint_types, plan.trajectory.joint_names)


def _knots(trajectory: Trajectory, knots: Knots) -> KnotsReport:
    missed = knots.deviation
    units = [joint_units(trajectory.joint_types, order) for order in (0, 1)]
    return KnotsReport(
        count=knots.nanoseconds.size,
        deviation=KnotsDeviation(
            position=missed.position,
            position_unit=units[0][missed.joints[0]],
            velocity=missed.velocity,
            velocity_unit=units[1][missed.joints[1]],
        ),
    )


def _steps(steps: AccelerationSteps, units: Mapping[str, str]) -> list[StepReport]:
    """Return the fields of the reports of steps; there may be thousands, validated with the report."""
    names = [steps.joint_names[joint] for joint in steps.joints.tolist()]
    rows = zip(steps.moves.tolist(), names, steps.times.tolist(), steps.sizes.tolist(), strict=True)
    fields = [
        {"move": move, "joint": joint, "time": time, "size": size, "unit": units[joint]}
        for move, joint, time, size in rows
    ]
    return cast("list[StepReport]", fields)


def _move(plan: Plan, index: int, *, reference: bool, peers: bool) -> MoveReport:
    from trajcli.output.report_parts import effort_reports, mounted_report, payload_report

    move, span = plan.moves[index], plan.trajectory.spans[index]
    peaks = [
        _peak(move, joint, order, extremes)
        for order, extremes in enumerate(plan.verdict.peaks[index])
        for joint in range(len(move.robot.joints))
    ]
    of_tool = plan.verdict.tool_peaks[index]
    near, tightest = _by_position(plan, index), tightest_of_move(plan, index)
    return MoveReport(
        index=span.index,
        planner=span.planner,
        label=span.label or None,
        round=span.round or None,
        start=span.start,
        end=span.end,
        duration=move.duration,
        continuity=span.continuity,
        stretch=move.stretch,
        peaks=peaks,
        velocity_by_position=near or None,
        efforts=effort_reports(plan, index),
        payload=payload_report(span.payload),
        mounted=mounted_report(plan, index),
        binding=tightest
        and BindingReport(joint=tightest.joint, quantity=tightest.quantity, used=tightest.used),
        at_limit=_at_limit_of(move, plan.verdict.peaks[index], plan.verdict.by_position[index]),
        waypoints=_waypoints(move, span),
        outside=_outside(move, plan.verdict, index),
        fastest=_fastest(move, span),
        tool=_tool(plan.trajectory, span, move),
        tool_peaks=None if of_tool is None else _tool_peaks(of_tool, span, move.robot),
        **_beside(move, reference=reference, peers=peers),
    )


def _at_limit_of(
    move: PlannedMove, peaks: Sequence[Peaks], uses: Sequence[ApproachUse]
) -> list[AtLimitReport]:
    """Return for how long a move is at each of its limits, the longest first."""
    names = move.robot.joint_names
    return [
        AtLimitReport(
            joint=names[one.joint],
            quantity=one.quantity,
            seconds=one.seconds,
            share=min(1.0, one.seconds / move.duration),
            method=one.method,
        )
        for one in times_at_limits(move, peaks, uses)
    ]


def _beside(move: PlannedMove, *, reference: bool, peers: bool) -> dict[str, Any]:
    """Return the fields of a move's report that compare it with peers."""
    if not reference:
        return {"reference": None, "path_reference": None}
    from trajcli.peers.move_reference import path_reference_of, reference_of

    along = path_reference_of(move) if peers or move.planned.phase_plane else None
    return {"reference": reference_of(move), "path_reference": along}


def _contradictions(plan: Plan, moves: Sequence[MoveReport]) -> list[Finding]:
    """Return a finding for each move that is faster than any motion can be."""
    from trajcli.peers.move_reference import contradictions_of

    return contradictions_of(plan.trajectory.spans, [move.reference for move in moves])


def _peak(move: PlannedMove, joint: int, order: int, peaks: Peaks) -> PeakReport:
    low, high = float(peaks.low[joint]), float(peaks.high[joint])
    below, above = (float(bound) for bound in move.robot.limits.of_order(order)[joint])
    zero = 0.0 if order else (below + above) / 2  # a range of positions need not hold 0
    parts = [
        (value - zero) / (bound - zero)
        for value, bound in ((low, below), (high, above))
        if math.isfinite(bound - zero) and bound != zero
    ]
    return PeakReport(
        joint=move.robot.joint_names[joint],
        quantity=QUANTITIES[order],
        low=low,
        low_time=float(peaks.low_time[joint]),
        high=high,
        high_time=float(peaks.high_time[joint]),
        limit=(below if math.isfinite(below) else None, above if math.isfinite(above) else None),
        used=max(0.0, *parts) if parts else None,
        unit=joint_units(move.robot.joint_types[joint : joint + 1], order)[0],
    )


def _by_position(plan: Plan, index: int) -> list[ByPositionReport]:
    names, types = plan.trajectory.joint_names, plan.trajectory.joint_types
    units, lengths = joint_units(types, 1), joint_units(types)
    return [
        ByPositionReport(
            joint=names[use.component],
            used=use.used,
            velocity=use.velocity,
            limit=use.limit,
            unit=units[use.component],
            distance=use.distance,
            distance_unit=lengths[use.component],
            time=use.time - plan.trajectory.curve.start,
        )
        for use in plan.verdict.by_position[index]
    ]


def _waypoints(move: PlannedMove, span: Span) -> tuple[WaypointReport, ...] | None:
    points = move.planned.via_points
    if points is None:
        return None
    times = np.clip(span.start + points.times, span.start, span.end).tolist()
    units = joint_units(move.robot.joint_types)
    return tuple(
        WaypointReport(time=time, missed=missed, units=units)
        for time, missed in zip(times, points.missed.tolist(), strict=True)
    )


def _outside(move: PlannedMove, verdict: Verdict, index: int) -> tuple[OutsideReport, ...] | None:
    """Return the joints that leave the range of the waypoints, above and below, and how far."""
    points = move.planned.via_points
    if points is None:
        return None
    peaks = verdict.peaks[index][0]
    sides = [
        (-1.0, points.points.min(axis=0), peaks.low, peaks.low_time),
        (1.0, points.points.max(axis=0), peaks.high, peaks.high_time),
    ]
    units = joint_units(move.robot.joint_types)
    reports = []
    for joint, name in enumerate(move.robot.joint_names):
        for sign, bound, extreme, time in sides:
            beyond = float(extreme[joint] - bound[joint])
            if sign * beyond > _ROUNDING * max(1.0, abs(float(bound[joint]))):
                at = float(time[joint])
                reports.append(OutsideReport(joint=name, beyond=beyond, time=at, unit=units[joint]))
    return tuple(reports)


def _fastest(move: PlannedMove, span: Span) -> FastestReport | None:
    proof = move.planned.certificate
    if proof is None:
        return None
    units, names = joint_units(move.robot.joint_types), move.robot.joint_names
    rows = zip(names, proof.off_chords.tolist(), proof.off_times.tolist(), units, strict=True)
    bounded = proof.lower > 0
    return FastestReport(
        lower=proof.lower if bounded else None,
        above=max(move.duration / proof.lower - 1, 0.0) if bounded else None,
        joint=None if proof.joint is None else names[proof.joint],
        method="bounded" if bounded else "heuristic",
        starts=len(proof.found),
        agreeing=proof.agreeing,
        found=[time if math.isfinite(time) else None for time in proof.found],
        stopping=proof.stopping if math.isfinite(proof.stopping) else None,
        off_chords=[
            OffChordReport(joint=name, distance=off, time=span.start + time, unit=unit)
            for name, off, time, unit in rows
        ],
    )


def _tool(trajectory: Trajectory, span: Span, move: PlannedMove) -> ToolReport | None:
    """Return the report of the tool of a move along a path, outside of zones; None for one in joint space."""
    motion = path_of_tool(move)
    if motion is None:
        return None
    for part in move.planned.parts:
        if part.tool is motion:
            span = replace(span, start=span.start + part.start, end=span.start + part.end)
    from trajcli.checks.tool import SampledTool

    tool = SampledTool(trajectory, span, move.robot, motion)
    deviation, turned = (float(sizes.max(initial=0.0)) for sizes in tool.deviation)
    bounds = [None if bound is None else bound.upper_bound for bound in tool.bounds]
    unit = "rad" if motion.pure_rotation else "m"
    wanted = move.planned.wanted_speed
    held, lowest = (None, None) if wanted is None else _held(move, motion, wanted, unit)
    return ToolReport(
        length=motion.length,
        unit=unit,
        ruled_by=motion.ruled_by,
        wanted_speed=wanted,
        speed_unit=f"{unit}/s",
        held=held,
        lowest=lowest,
        segments=[_segments(run, span) for run in tool.speed_runs] or None,
        peaks=_tool_peaks(tool.peaks, span, move.robot),
        deviation=deviation,
        deviation_bound=bounds[0],
        turned=turned,
        turned_bound=bounds[1],
        method="sampled" if None in bounds else "bounded",
    )


def _segments(run: SpeedRun, span: Span) -> SegmentSpeedsReport:
    from trajcli.limits.kinds import SPEED_KINDS

    peaks = [
        _tool_peak(kind, peak, limit, span)
        for kind, peak, limit in zip(SPEED_KINDS, run.peaks, run.limits, strict=True)
        if math.isfinite(limit)
    ]
    (first, last), (begins, ends) = run.segments, run.s
    start, end = (span.start + time for time in run.times)
    return SegmentSpeedsReport(
        first=first, last=last, begins=begins, ends=ends, start=start, end=end, peaks=peaks
    )


def _tool_peaks(peaks: Mapping[str, ToolPeak], span: Span, robot: Robot) -> list[ToolPeakReport]:
    from trajcli.limits.kinds import TOOL_KINDS

    return [
        _tool_peak(kind, peaks[kind.key], float(getattr(robot.limits.tcp, kind.key)), span)
        for kind in TOOL_KINDS
        if kind.key in peaks
    ]


def _tool_peak(kind: LimitKind, peak: ToolPeak, limit: float, span: Span) -> ToolPeakReport:
    return ToolPeakReport(
        quantity=kind.key,
        value=peak.value,
        bound=peak.upper_bound,
        time=span.start + peak.time,
        limit=None if math.isinf(limit) else limit,
        unit=kind.unit,
        negligible=peak.value <= _AT_REST,
    )


def _held(
    move: PlannedMove, motion: ToolMotion, wanted: float, unit: str
) -> tuple[float, LowestSpeedReport | None]:
    """Return over which part of the path the wanted speed is held, and where it is lowest in between."""
    law = motion.law
    part = np.linspace(0.0, 1.0, _EACH + 1)[:-1]
    times = np.append((law.breaks[:-1, None] + law.lengths[:, None] * part).reshape(-1), law.end)
    s, speeds = law.evaluate_orders(times, (0, 1))[:, :, 0].T
    fast = speeds >= _HELD * wanted
    both = fast[1:] & fast[:-1]
    held = float(np.diff(s)[both].sum() / motion.length)
    if not fast.any():
        return held, None
    first, last = int(fast.argmax()), int(fast.size - 1 - fast[::-1].argmax())
    slowest = first + int(speeds[first : last + 1].argmin())
    if speeds[slowest] >= _HELD * wanted:
        return held, None
    lowest = LowestSpeedReport(
        speed=float(speeds[slowest]),
        place=float(s[slowest]),
        joint=_limiting_joint(move, float(times[slowest])),
        unit=f"{unit}/s",
        place_unit=unit,
    )
    return held, lowest


def _limiting_joint(move: PlannedMove, time: float) -> str | None:
    """Return the joint whose limit binds nearest to a time of the move."""
    distances = [
        (max(phase.start - time, time - phase.end, 0.0), phase.joint)
        for phase in move.planned.phases
        if phase.joint is not None
    ]
    if not distances:
        return None
    distance, joint = min(distances)
    return move.robot.joint_names[joint] if distance <= _NEAR * move.duration else None


def verification_error(plan: Plan, *, every: bool = True) -> VerificationError:
    """Return the error that says what the verdict found, with the places of the moves.

    Args:
        plan: A plan that fails.
        every: Whether each finding is said; otherwise the worst of each cause, which tells how many more
            there are.
    """
    from trajcli.planning.causes import causes_of, problem_of

    if every:
        return VerificationError(*(problem_of(plan, finding) for finding in plan.verdict.findings))
    return VerificationError(*(_said(plan, cause) for cause in causes_of(plan)))


def _said(plan: Plan, cause: Cause) -> Problem:
    """Return the problem of the worst of findings of one cause."""
    from trajcli.planning.causes import problem_of

    problem, others = problem_of(plan, cause.worst), len(cause.findings) - 1
    more = f" (and {others} more like it: --all)" if others else ""
    return replace(problem, message=problem.message + more)


def concession_error(plan: Plan) -> VerificationError:
    """Return the error of a plan that verifies with events, for whoever accepts none."""

    def problem(event: Event) -> Problem:
        where = None if event.move is None else plan.loaded.place_of_move(event.move)
        hint = "leave --strict out to accept it"
        return Problem(f"{event.kind}: {event.message}", hint, where, event.move, kind=event.kind)

    return VerificationError(*map(problem, plan.events))
