"""Via points: the curve passes each at its time, at the distance that the move promises."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from operator import itemgetter

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.findings import Finding, at_time, joint_amounts
from trajcli.limits.tolerances import waypoint_tolerance
from trajcli.trajectory import Span, Trajectory, ViaPoints

_BLOCK = 32_768  # points looked at together: what is computed of them takes some MB


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
        if points is not None:
            findings += _furthest(trajectory, span, points)
    return findings


def _furthest(trajectory: Trajectory, span: Span, points: ViaPoints) -> Iterator[Finding]:
    """Yield for each joint the point of a move that it passes furthest from where it was promised, if any."""
    largest = np.maximum(points.points.max(axis=0), -points.points.min(axis=0))
    worst: dict[int, list[float]] = {}
    for row in range(0, len(points.times), _BLOCK):
        rows = slice(row, row + _BLOCK)
        times = np.clip(span.start + points.times[rows], span.start, span.end)
        distance, missed = _distances(trajectory, span, times, points.points[rows]), points.missed[rows]
        over = np.abs(distance - missed) - waypoint_tolerance(trajectory, times, largest)
        for joint in np.flatnonzero((over > 0).any(axis=0)).tolist():
            k = int(over[:, joint].argmax())
            found = [float(each) for each in (over[k, joint], times[k], distance[k, joint], missed[k, joint])]
            worst[joint] = max(worst.get(joint, found), found, key=itemgetter(0))
    for joint, (_, time, value, limit) in sorted(worst.items()):
        passes = f"the path of {{joint}} passes a waypoint at {{value}} {at_time(time)}"
        yield Finding(
            move=span.index,
            joint=trajectory.joint_names[joint],
            kind="waypoint",
            value=value,
            limit=limit,
            time=time,
            message=f"{passes}, it shall be {{limit}}",
            amounts=joint_amounts(trajectory, joint, 0, value=value, limit=limit),
        )


def _distances(trajectory: Trajectory, span: Span, times: Array, points: Array) -> Array:
    """Return how far from points (k, n) the joints are at times (k,) of a move; its end is its own."""
    passed = trajectory.curve.evaluate(times)
    last = times >= span.end  # what the next move makes of it is not this one's
    passed[last] = trajectory.before(times[last])
    return np.abs(passed - points)
