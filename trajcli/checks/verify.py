"""All judgements of a trajectory in one verdict."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from trajcli.checks.continuity import acceleration_steps, check_continuity
from trajcli.checks.finding import AccelerationSteps, Finding
from trajcli.checks.limits import check_limits, peaks_by_move
from trajcli.checks.waypoints import check_waypoints
from trajcli.curves.extrema import Peaks
from trajcli.frozen import frozen
from trajcli.kinematics.robot import QUANTITIES, Limits
from trajcli.trajectory import Promise, Trajectory


@frozen
class Verdict:
    """What the checks found.

    Attributes:
        findings: What is wrong, by move and time.
        steps: Legal steps in acceleration, in order of time.
        peaks: For each span the extremes of position, velocity, acceleration and jerk, times on the curve.
        unchecked: (joint, quantity) that some move leaves unlimited in at least one direction.
    """

    findings: tuple[Finding, ...]
    steps: AccelerationSteps
    peaks: tuple[tuple[Peaks, ...], ...]
    unchecked: tuple[tuple[str, str], ...]

    @property
    def passed(self) -> bool:
        """Whether nothing is wrong."""
        return not self.findings


def verify(
    trajectory: Trajectory,
    limits_by_move: Sequence[Limits],
    promises: Sequence[Promise] | None = None,
) -> Verdict:
    """Return the verdict on a trajectory: its joint limits for all t, its continuity, the points it passes.

    Args:
        trajectory: What to judge.
        limits_by_move: The limits in force, one for each span.
        promises: What each span says of itself.

    Raises:
        ValueError: When there are more or fewer limits than spans.
    """
    peaks = tuple(peaks_by_move(trajectory))
    findings = check_limits(trajectory, limits_by_move, peaks)
    findings += check_continuity(trajectory, limits_by_move, peaks)
    if promises is not None:
        findings += check_waypoints(trajectory, [promise.passage for promise in promises])
        findings += _check_tools(trajectory, promises)
    place = {span.index: k for k, span in enumerate(trajectory.spans)}
    findings.sort(key=lambda finding: (place.get(finding.move or 0, 0), finding.time))
    return Verdict(
        findings=tuple(findings),
        steps=acceleration_steps(trajectory, limits_by_move, peaks),
        peaks=peaks,
        unchecked=_unchecked(trajectory, limits_by_move),
    )


def _check_tools(trajectory: Trajectory, promises: Sequence[Promise]) -> list[Finding]:
    found: list[Finding] = []
    for span, promise in zip(trajectory.spans, promises, strict=True):
        if promise.tool is not None and promise.robot is not None:
            from trajcli.checks.tool import (
                SampledTool,
                check_tool,  # a plan without paths does not pay for it
            )

            found += check_tool(SampledTool(trajectory, span, promise.robot, promise.tool))
    return found


def _unchecked(trajectory: Trajectory, limits_by_move: Sequence[Limits]) -> tuple[tuple[str, str], ...]:
    open_ended = [
        [np.isinf(limits.of_order(order)).any(axis=1) for limits in limits_by_move]
        for order in range(len(QUANTITIES))
    ]
    found = np.any(open_ended, axis=1)
    return tuple(
        (name, quantity)
        for joint, name in enumerate(trajectory.joint_names)
        for order, quantity in enumerate(QUANTITIES)
        if found[order, joint]
    )
