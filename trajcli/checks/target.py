"""Target and via points of a move: its curve passes these at their times, and ends where the job says."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from operator import itemgetter
from typing import TYPE_CHECKING, Literal

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.errors import Amount
from trajcli.findings import Finding, at_time, joint_amounts
from trajcli.limits.tolerances import (
    TARGET_CLOSURE,
    TARGET_ON_PATH,
    allowed_at_end,
    exceeds,
    waypoint_tolerance,
)
from trajcli.trajectory import Destination, Promise, Span, Trajectory, ViaPoints

if TYPE_CHECKING:
    from trajcli.kinematics.inverse.target import IkTarget
    from trajcli.kinematics.robot import Robot


_BLOCK = 16_384  # moves, and points, looked at together: what is computed of them takes some MB


def check_targets(trajectory: Trajectory, promises: Sequence[Promise]) -> list[Finding]:
    """Return where a move does not end in its target: the joint that is furthest off, or the tool.

    Args:
        trajectory: What to judge.
        promises: What each span says of itself.

    Raises:
        ValueError: When there are more or fewer promises than spans.
    """
    spans = trajectory.spans
    if len(spans) != len(promises):
        raise ValueError(f"{len(promises)} promises for {len(spans)} moves")
    findings = list[Finding]()
    for first in range(0, len(spans), _BLOCK):
        block = slice(first, first + _BLOCK)
        findings += _check_ends(trajectory, spans[block], promises[block])
    return findings


def _check_ends(
    trajectory: Trajectory, spans: Sequence[Span], promises: Sequence[Promise]
) -> Iterator[Finding]:
    """Yield where moves that follow each other do not end in their targets."""
    ends = trajectory.before(np.array([span.end for span in spans]))
    promised = {k: each.destination for k, each in enumerate(promises) if each.destination is not None}
    to_joints = {k: destination for k, destination in promised.items() if destination.joints is not None}
    yield from _check_joints(trajectory, spans, ends, to_joints)
    for k, destination in promised.items():
        span, robot = spans[k], promises[k].robot
        if destination.joints is None and destination.pose is not None and robot is not None:
            within = destination.tolerance or (TARGET_CLOSURE, TARGET_CLOSURE)
            yield from _check_pose(span, robot, ends[k], destination.pose, within)
            yield from _check_pins(trajectory, span, ends[k], destination.pins)


def _check_pins(
    trajectory: Trajectory, span: Span, end: Array, pins: Mapping[int, float]
) -> Iterator[Finding]:
    """Yield the joints that a target pins, and that end beside their values."""
    for joint, wanted in pins.items():
        off = float(abs(end[joint] - wanted))
        if not off <= TARGET_ON_PATH:
            yield _beside(trajectory, span, joint, off, TARGET_ON_PATH)


def _beside(trajectory: Trajectory, span: Span, joint: int, value: float, limit: float) -> Finding:
    message = f"{{joint}} ends {{value}} beside its target {at_time(span.end)}"
    return _of_joint(trajectory, span, joint, "target", (value, limit, span.end), message)


def _of_joint(
    trajectory: Trajectory,
    span: Span,
    joint: int,
    kind: Literal["target", "waypoint"],
    found: tuple[float, float, float],
    message: str,
) -> Finding:
    """Return the finding about one joint, by its value, the limit and the time."""
    value, limit, time = found
    return Finding(
        move=span.index,
        joint=trajectory.joint_names[joint],
        kind=kind,
        value=value,
        limit=limit,
        time=time,
        message=message,
        amounts=joint_amounts(trajectory, joint, 0, value=value, limit=limit),
    )


def _check_joints(
    trajectory: Trajectory, of_moves: Sequence[Span], ends: Array, destinations: Mapping[int, Destination]
) -> Iterator[Finding]:
    """Yield the joint that is furthest from its target, of each span that ends (k, n) beside it."""
    if not destinations:
        return
    spans = [of_moves[k] for k in destinations]
    targets = np.array([each.joints for each in destinations.values()])
    on_path = [each.tolerance is not None for each in destinations.values()]
    off = np.abs(ends[list(destinations)] - targets)
    allowed = allowed_at_end(trajectory, np.array([span.end for span in spans]), targets)
    allowed[on_path] = TARGET_ON_PATH
    wrong = np.logical_not(off <= allowed)
    furthest = np.where(wrong, np.nan_to_num(off, nan=np.inf), -1.0).argmax(axis=1)
    for row in np.flatnonzero(wrong.any(axis=1)).tolist():
        span, joint = spans[row], int(furthest[row])
        value, limit = float(off[row, joint]), float(allowed[row, joint])
        yield _beside(trajectory, span, joint, value, limit)


def _check_pose(
    span: Span, robot: Robot, end: Array, target: IkTarget, within: tuple[float, float]
) -> list[Finding]:
    from trajcli.kinematics.forward import forward
    from trajcli.kinematics.inverse.target import closure_of

    missed = np.full(2, np.inf)
    if np.isfinite(end).all():
        missed = closure_of(target.flat(), forward(robot, end[None]))[0]
    kinds: tuple[tuple[str, Literal["length", "angle"]], ...] = (
        ("{value} beside its target", "length"),
        ("turned by {value} from its target", "angle"),
    )
    findings = []
    for (what, dimension), value, limit in zip(kinds, missed.tolist(), within, strict=True):
        if not exceeds(value, limit):
            continue
        finding = Finding(
            move=span.index,
            kind="target",
            value=value,
            limit=limit,
            time=span.end,
            message=f"the tool ends {what} {at_time(span.end)}, promised were {{limit}}",
            amounts={
                "value": Amount(value, 0, None, dimension),
                "limit": Amount(limit, 0, None, dimension),
            },
        )
        findings.append(finding)
    return findings


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
        message = (
            f"the path of {{joint}} passes a waypoint at {{value}} {at_time(time)}, it shall be {{limit}}"
        )
        yield _of_joint(trajectory, span, joint, "waypoint", (value, limit, time), message)


def _distances(trajectory: Trajectory, span: Span, times: Array, points: Array) -> Array:
    """Return how far from points (k, n) the joints are at times (k,) of a move; its end is its own."""
    passed = trajectory.curve.evaluate(times)
    last = times >= span.end  # what the next move makes of it is not this one's
    passed[last] = trajectory.before(times[last])
    return np.abs(passed - points)
