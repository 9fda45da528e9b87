"""Points that a move promises to pass: the curve is there at the time it says, or beside by what it says."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from trajcli.checks.finding import Finding
from trajcli.checks.tolerances import waypoint_tolerance
from trajcli.trajectory import Trajectory, ViaPoints


def check_waypoints(trajectory: Trajectory, passages: Sequence[ViaPoints | None]) -> list[Finding]:
    """Return for each move and joint the point that is passed furthest from where it was promised, if any.

    Args:
        trajectory: What to judge.
        passages: What each span promises; None where it promises nothing.

    Raises:
        ValueError: When there are more or fewer passages than spans.
    """
    found: list[Finding] = []
    for span, passage in zip(trajectory.spans, passages, strict=True):
        if passage is None:
            continue
        times = np.clip(span.start + passage.times, span.start, span.end)
        apart = np.abs(trajectory.curve.evaluate(times) - passage.points)
        wrong = np.abs(apart - passage.missed)
        over = wrong - waypoint_tolerance(trajectory, times, passage.points)
        for joint in np.flatnonzero((over > 0).any(axis=0)).tolist():
            worst = int(over[:, joint].argmax())
            found.append(
                Finding(
                    span.index,
                    trajectory.joint_names[joint],
                    "waypoint",
                    float(apart[worst, joint]),
                    float(passage.missed[worst, joint]),
                    float(times[worst]),
                )
            )
    return found
