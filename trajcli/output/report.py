"""From a plan to its report, and to the errors of a verdict.

What reports and explanations say about the points that a move passes.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from trajcli.checks.finding import Finding
from trajcli.checks.verify import Verdict
from trajcli.columns import joint_factors
from trajcli.curves.extrema import Peaks
from trajcli.errors import Problem, VerificationError
from trajcli.job.report import (
    BindingReport,
    EventReport,
    FindingReport,
    MoveReport,
    OutsideReport,
    PeakReport,
    ReferenceReport,
    Report,
    StepReport,
    UncheckedReport,
    WaypointReport,
)
from trajcli.kinematics.robot import QUANTITIES
from trajcli.output.tool import tool_report
from trajcli.planners.planner import PlannedMove
from trajcli.planning.lower_bound import NoBound, fastest_duration
from trajcli.planning.plan import Plan
from trajcli.trajectory import Span
from trajcli.units import Quantity, Units, unit_name
from trajcli.version import __version__

_ROUNDING = 1e-12  # rad or m: what leaves the range by less does not leave it


def waypoint_reports(move: PlannedMove, span: Span) -> list[WaypointReport] | None:
    """Return when each point is passed, and by how much beside it."""
    passage = move.planned.via_points
    if passage is None:
        return None
    times = np.clip(span.start + passage.times, span.start, span.end)
    return [
        WaypointReport(time=time, missed=missed)
        for time, missed in zip(times.tolist(), passage.missed.tolist(), strict=True)
    ]


def outside_reports(move: PlannedMove, verdict: Verdict, position: int) -> list[OutsideReport] | None:
    """Return the joints that leave the range of the waypoints, above and below, and how far.

    Args:
        move: The move.
        verdict: Of the whole trajectory.
        position: Where the move stands among the moves.
    """
    passage = move.planned.via_points
    if passage is None:
        return None
    peaks = verdict.peaks[position][0]
    ways = [
        (-1.0, passage.points.min(axis=0), peaks.low, peaks.low_time),
        (1.0, passage.points.max(axis=0), peaks.high, peaks.high_time),
    ]
    found = []
    for joint, name in enumerate(move.robot.joint_names):
        for sign, bound, extreme, time in ways:
            beyond = float(extreme[joint] - bound[joint])
            if sign * beyond > _ROUNDING * max(1.0, abs(float(bound[joint]))):
                found.append(OutsideReport(joint=name, beyond=beyond, time=float(time[joint])))
    return found


def passing_in_units(move: PlannedMove, span: Span, verdict: Verdict, units: Units) -> dict[str, Any]:
    """Return {origin, waypoints, outside} of a move, in the job's units, times from the start of the move."""
    factors = joint_factors(move.robot.joint_types, units)
    kinds = ["length" if kind == "prismatic" else "angle" for kind in move.robot.joint_types]
    words = [unit_name(Quantity(kind), units) for kind in kinds]  # type: ignore[arg-type]
    passage = move.planned.via_points
    waypoints = passage and [
        {"time": time, "joints": point, "missed": missed, "units": words}
        for time, point, missed in zip(
            passage.times.tolist(),
            (passage.points / factors).tolist(),
            (passage.missed / factors).tolist(),
            strict=True,
        )
    ]
    outside = outside_reports(move, verdict, span.index)
    names = move.robot.joint_names
    told = (
        None
        if outside is None
        else [
            {
                "joint": one.joint,
                "beyond": one.beyond / float(factors[names.index(one.joint)]),
                "unit": words[names.index(one.joint)],
                "time": one.time - span.start,
            }
            for one in outside
        ]
    )
    return {"origin": move.planned.origin, "waypoints": waypoints, "outside": told}


def report_of(plan: Plan, *, reference: bool = False) -> Report:
    """Return the report of a plan.

    Args:
        plan: The plan.
        reference: Whether each move is compared with ruckig's bound.
    """
    verdict = plan.verdict
    return Report(
        trajcli=__version__,
        verdict="verified" if verdict.passed else "violated",
        job=plan.loaded.name,
        robot=plan.loaded.robot.name,
        duration=plan.trajectory.duration,
        moves=[_move(plan, index, reference=reference) for index in range(len(plan.moves))],
        findings=[
            FindingReport(**{name: getattr(finding, name) for name in FindingReport.model_fields})
            for finding in verdict.findings
        ],
        events=[EventReport(kind=e.kind, message=e.message, move=e.move) for e in plan.events],
        steps=[StepReport(**vars(step)) for step in verdict.steps],
        unchecked=[UncheckedReport(joint=joint, quantity=quantity) for joint, quantity in verdict.unchecked],
    )


def _move(plan: Plan, index: int, *, reference: bool) -> MoveReport:
    move, span = plan.moves[index], plan.trajectory.spans[index]
    peaks = [
        _peak(move, joint, order, extremes)
        for order, extremes in enumerate(plan.verdict.peaks[index])
        for joint in range(len(move.robot.joints))
    ]
    used = [peak for peak in peaks if peak.used is not None and peak.quantity != "position"]
    most = max(used, key=lambda peak: peak.used or 0.0, default=None)
    binding = most and BindingReport(joint=most.joint, quantity=most.quantity, used=most.used or 0.0)
    return MoveReport(
        index=span.index,
        planner=span.planner,
        start=span.start,
        end=span.end,
        duration=move.duration,
        continuity=span.continuity,
        stretch=move.stretch,
        peaks=peaks,
        binding=binding,
        waypoints=waypoint_reports(move, span),
        outside=outside_reports(move, plan.verdict, index),
        tool=None if move.planned.tool is None else tool_report(plan.trajectory, span, move),
        reference=reference_of(move) if reference else None,
    )


def _peak(move: PlannedMove, joint: int, order: int, peaks: Peaks) -> PeakReport:
    low, high = float(peaks.low[joint]), float(peaks.high[joint])
    below, above = (float(bound) for bound in move.robot.limits.of_order(order)[joint])
    parts = [
        value / bound for value, bound in ((low, below), (high, above)) if math.isfinite(bound) and bound
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
    )


def reference_of(move: PlannedMove) -> ReferenceReport:
    """Return how a move compares with the shortest duration under its limits."""
    reason = move.planned.no_lower_bound
    if reason is not None:
        return ReferenceReport(duration=None, ratio=None, joint=move.robot.joint_names[0], reason=reason)
    begins = move.planned.begins or move.start
    bound = fastest_duration(begins, move.planned.end, move.robot.limits)
    name = None if bound.joint is None else move.robot.joint_names[bound.joint]
    if isinstance(bound, NoBound):
        return ReferenceReport(duration=None, ratio=None, joint=name, reason=bound.reason)
    ratio = move.duration / bound.duration if bound.duration > 0 else None
    return ReferenceReport(duration=bound.duration, ratio=ratio, joint=name)


def verification_error(plan: Plan) -> VerificationError:
    """Return the error that says what the verdict found, with the places of the moves."""
    return VerificationError(*(_problem(plan, finding) for finding in plan.verdict.findings))


def _problem(plan: Plan, finding: Finding) -> Problem:
    index = finding.move or 0
    span = plan.trajectory.spans[index]
    return Problem(
        f"move {index} ({span.planner}): {finding.text(plan.loaded.say)}",
        finding.hint,
        place=plan.loaded.place_of_move(index),
        move=index,
        joint=finding.joint,
        time=finding.time - span.start,
        value=finding.value,
        limit=finding.limit,
    )
