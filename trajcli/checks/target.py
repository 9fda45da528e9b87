"""Target of a move: its curve ends where the job says, by joint values or by the pose of the tool."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.errors import Amount
from trajcli.findings import Finding, at_time, joint_amounts
from trajcli.limits.tolerances import TARGET_CLOSURE, TARGET_ON_PATH, allowed_at_end, exceeds
from trajcli.trajectory import Promise, Span, Trajectory

if TYPE_CHECKING:
    from trajcli.kinematics.inverse.target import IkTarget
    from trajcli.kinematics.robot import Robot


def check_targets(trajectory: Trajectory, promises: Sequence[Promise]) -> list[Finding]:
    """Return where a move does not end in its target: the joint that is furthest off, or the tool.

    Args:
        trajectory: What to judge.
        promises: What each span says of itself.

    Raises:
        ValueError: When there are more or fewer promises than spans.
    """
    findings: list[Finding] = []
    for span, promise in zip(trajectory.spans, promises, strict=True):
        destination = promise.destination
        if destination is None:
            continue
        end = trajectory.before(np.array([span.end]))[0]
        on_path = destination.tolerance is not None
        if destination.joints is not None:
            findings += _check_joints(trajectory, span, end, destination.joints, on_path=on_path)
        elif destination.pose is not None and promise.robot is not None:
            within = destination.tolerance or (TARGET_CLOSURE, TARGET_CLOSURE)
            findings += _check_pose(span, promise.robot, end, destination.pose, within)
    return findings


def _check_joints(
    trajectory: Trajectory, span: Span, end: Array, target: Array, *, on_path: bool
) -> list[Finding]:
    off = np.abs(end - target)
    allowed = np.full(off.shape, TARGET_ON_PATH) if on_path else allowed_at_end(trajectory, span.end, target)
    wrong = np.logical_not(off <= allowed)
    if not wrong.any():
        return []
    joint = int(np.where(wrong, np.nan_to_num(off, nan=np.inf), -1.0).argmax())
    value, limit = float(off[joint]), float(allowed[joint])
    finding = Finding(
        move=span.index,
        joint=trajectory.joint_names[joint],
        kind="target",
        value=value,
        limit=limit,
        time=span.end,
        message=f"{{joint}} ends {{value}} beside its target {at_time(span.end)}",
        amounts=joint_amounts(trajectory, joint, 0, value=value, limit=limit),
    )
    return [finding]


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
            joint=None,
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
