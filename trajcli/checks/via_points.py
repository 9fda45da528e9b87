"""Via points: the curve passes each at its time, at the distance that the move promises."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from trajcli.findings import Finding, at_time, joint_amounts
from trajcli.limits.tolerances import waypoint_tolerance
from trajcli.trajectory import Trajectory, ViaPoints


def check_waypoints(trajectory: Trajectory, promised: Sequence[ViaPoints | None]) -> list[Finding]:
    """Return for each move and joint the point that is passed furthest from where it was promised, if any.

    Args:
        trajectory: What to judge.
        promised: The points that each span promises to pass; None where it promises nothing.

    Raises:
        ValueError: When there are more or fewer promises than spans.
    """
    findings: list[Finding] = []
    for span, points in zip(trajectory.spans, promised, strict=True):
        if points is None:
            continue
        times = np.clip(span.start + points.times, span.start, span.end)
        passed = trajectory.curve.evaluate(times)
        last = times >= span.end  # what the next move makes of it is not this one's
        passed[last] = trajectory.before(times[last])
        distance = np.abs(passed - points.points)
        wrong = np.abs(distance - points.missed)
        over = wrong - waypoint_tolerance(trajectory, times, points.points)
        for joint in np.flatnonzero((over > 0).any(axis=0)).tolist():
            worst = int(over[:, joint].argmax())
            name, time = trajectory.joint_names[joint], float(times[worst])
            value, limit = float(distance[worst, joint]), float(points.missed[worst, joint])
            passes = f"the path of {{joint}} passes a waypoint at {{value}} {at_time(time)}"
            finding = Finding(
                move=span.index,
                joint=name,
                kind="waypoint",
                value=value,
                limit=limit,
                time=time,
                message=f"{passes}, it shall be {{limit}}",
                amounts=joint_amounts(trajectory, joint, 0, value=value, limit=limit),
            )
            findings.append(finding)
    return findings
