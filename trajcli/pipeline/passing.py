"""What reports and explanations say about the points that a move passes."""

from __future__ import annotations

from typing import Any

import numpy as np

from trajcli.checks.verify import Verdict
from trajcli.columns import joint_factors
from trajcli.job.report import OutsideReport, WaypointReport
from trajcli.pipeline.stretch import PlannedMove
from trajcli.trajectory import Span
from trajcli.units import Quantity, Units, unit_name

_ROUNDING = 1e-12  # rad or m: what leaves the range by less does not leave it


def waypoint_reports(move: PlannedMove, span: Span) -> list[WaypointReport] | None:
    """Return when each point is passed, and by how much beside it."""
    passage = move.planned.passage
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
    passage = move.planned.passage
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
    passage = move.planned.passage
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
