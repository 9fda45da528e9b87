"""Comparison of a recorded motion with peers: ruckig between its ends, toppra along its points."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.errors import PlanningError
from trajcli.frozen import frozen
from trajcli.job.report_parts import PathReferenceReport, ReferenceReport
from trajcli.judge.judgement import Judgement, worst_first
from trajcli.kinematics.robot import Robot
from trajcli.peers.lower_bound import NoBound, fastest_duration
from trajcli.peers.move_reference import bound_report, contradiction, is_faster, path_report
from trajcli.peers.path_reference import PathReference, reference_along
from trajcli.trajectory import State

if TYPE_CHECKING:
    from trajcli.judge.file import CheckedFile
    from trajcli.streams.recorded_motion import MotionFile, RecordedMotion

_MOST_ROWS = 20000  # that are kept for the path: more say no more about it


@frozen
class MotionReference:
    """A recorded motion beside those of peers.

    Attributes:
        duration: Of the recorded motion, s.
        reference: Of ruckig, between its ends.
        path_reference: Of toppra, along its points; None where it does not move or nothing is limited.
    """

    duration: float
    reference: ReferenceReport
    path_reference: PathReferenceReport | None


@frozen
class _Outline:
    """What a comparison needs of a motion: its first and last row, and positions of some rows, (m, n)."""

    first: RecordedMotion
    last: RecordedMotion
    points: Array


def compared(checked: CheckedFile) -> tuple[Judgement, MotionReference]:
    """Return the judgement with what the comparison adds, and the comparison.

    A motion from rest to rest that keeps its limits and is faster than any between its ends can be is a
    contradiction: an error.
    """
    outline = _outline(checked.motion, checked.judgement.rows)
    duration = float(outline.last.t[0] - outline.first.t[0])
    bound, reference = _between_ends(outline, checked.robot, duration)
    along = path_report(lambda: _along_points(outline, checked.robot), duration, checked.robot)
    found = MotionReference(duration, reference, along)
    judgement = checked.judgement
    judged = judgement.verdict == "satisfied" and outline.first.qd is not None
    if bound is not None and judged and is_faster(duration, bound):
        finding = contradiction(duration, bound, reference.joint, time=float(outline.last.t[0]))
        finding = replace(finding, row=outline.last.first_row)
        judgement = replace(judgement, findings=worst_first([*judgement.findings, finding]))
    return judgement, found


def _outline(motion: MotionFile, rows: int) -> _Outline:
    """Return the ends of a motion and points between them."""
    stride = max(1, -(-rows // _MOST_ROWS))
    first = last = None
    points = []
    for block in motion.blocks():
        if block.t.size == 0:
            continue
        first = _row(block, 0) if first is None else first
        last = _row(block, block.t.size - 1)
        offset = -(block.first_row - 1) % stride
        points.append(block.q[offset::stride])
    if first is None or last is None:
        raise PlanningError("the motion has no rows")
    return _Outline(first, last, np.concatenate([*points, last.q]))


def _row(rows: RecordedMotion, index: int) -> RecordedMotion:
    one = slice(index, index + 1)
    cut: dict[str, Any] = {
        name: None if getattr(rows, name) is None else getattr(rows, name)[one]
        for name in ("t", "q", "qd", "qdd", "qddd", "tau", "move")
    }
    return replace(rows, **cut, first_row=rows.first_row + index)


def _state(row: RecordedMotion) -> State:
    zero = np.zeros(row.q.shape[1])
    rates = [zero if values is None else values[0] for values in (row.qd, row.qdd)]
    return State(row.q[0], *rates)


def _between_ends(outline: _Outline, robot: Robot, duration: float) -> tuple[float | None, ReferenceReport]:
    """Return a bound that holds whatever the rounding of the file, and the report of the one without."""
    start, end = _state(outline.first), _state(outline.last)
    bound = fastest_duration(start, end, robot.limits)
    report = bound_report(bound, duration, robot)
    if isinstance(bound, NoBound) or not (start.at_rest and end.at_rest):
        return None, report
    resolution = outline.first.resolution
    apart = end.position - start.position
    rounding = 2 * resolution.q + resolution.relative[0] * (abs(start.position) + abs(end.position))
    nearer = start.position + np.sign(apart) * np.maximum(np.abs(apart) - rounding, 0.0)
    least = fastest_duration(start, replace(end, position=nearer), robot.limits)
    late = 2 * (resolution.time + resolution.relative_time * abs(float(outline.last.t[0])))
    return None if isinstance(least, NoBound) else max(least.duration - late, 0.0), report


def _along_points(outline: _Outline, robot: Robot) -> PathReference | None:
    """Return toppra's motion along the points; None where they are one, or nothing is limited."""
    from trajcli.peers.geometric_path import path_of_points

    path = path_of_points(outline.points)
    if path is None:
        return None
    ends = _state(outline.first).velocity, _state(outline.last).velocity
    return reference_along(path, robot.limits, ends)
