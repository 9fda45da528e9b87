"""Verification of a trajectory: all judgements in one verdict, each finding with its remedy."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from trajcli.checks.continuity import AccelerationSteps, acceleration_steps, check_continuity
from trajcli.checks.limits import check_limits, peaks_by_move
from trajcli.checks.target import check_targets
from trajcli.checks.tolerances import LIMIT_RELATIVE, TOOL_RELATIVE
from trajcli.curves.extrema import Peaks
from trajcli.errors import at_least
from trajcli.findings import LIMITS_OF_JOINTS, Finding
from trajcli.frozen import frozen
from trajcli.kinematics.robot import QUANTITIES, Limits, ToolLimits
from trajcli.trajectory import Promise, Span, Trajectory

if TYPE_CHECKING:
    from trajcli.checks.effort import MoveEfforts
    from trajcli.checks.tool_bound import ToolPeak
    from trajcli.curves.approach import ApproachUse

_TOOL_LIMITS = (
    "tool_speed",
    "tool_angular_speed",
    "tool_acceleration",
    "tool_angular_acceleration",
    "tool_jerk",
)
_NO_TOOL_LIMITS = ToolLimits()
_PART = 0.25  # of that room: a third of it is a third power's
_NO_HELP = "slowing down does not help"
_SLOW = "say `when_over_limit: slow`"


@frozen
class Verdict:
    """Outcome of the checks.

    Attributes:
        findings: What is wrong, by move and time.
        steps: Legal steps in acceleration, in order of time.
        peaks: For each span the extremes of position, velocity, acceleration and jerk, times on the curve.
        unchecked: (joint, quantity) that some move leaves unlimited in at least one direction.
        tool_peaks: For each span the largest speeds and accelerations of the tool by the name of their limit,
            times from the start of the move; None on a path, and where no limit asks for them.
        unchecked_of_tool: Limits of the tool that are stated and cannot be judged in some move: of an arm
            without geometry, and of the jerk in joint space.
        sampled: Moves along a path: the distance from it and the branch are judged on rows alone, which is no
            proof of what lies between them.
        by_position: For each span where joints use most of their limits of velocity by position, one for each
            joint that has such, times on the curve.
        efforts: For each span the largest efforts, times on the curve; None where no limit asks for them.
    """

    findings: tuple[Finding, ...]
    steps: AccelerationSteps
    peaks: tuple[tuple[Peaks, ...], ...]
    unchecked: tuple[tuple[str, str], ...]
    tool_peaks: tuple[Mapping[str, ToolPeak] | None, ...] = ()
    unchecked_of_tool: tuple[str, ...] = ()
    sampled: tuple[int, ...] = ()
    by_position: tuple[tuple[ApproachUse, ...], ...] = ()
    efforts: tuple[MoveEfforts | None, ...] = ()

    def __repr__(self) -> str:
        worst = [f"{found.kind} of {found.joint or 'the tool'}" for found in self.findings[:2]]
        more = ["..."] if len(self.findings) > len(worst) else []
        return f"Verdict({self.text}{': ' * bool(worst)}{', '.join(worst + more)})"

    @property
    def passed(self) -> bool:
        """Whether nothing is wrong."""
        return not self.findings

    @property
    def text(self) -> str:
        """The verdict in words: `verified`, or the number of findings."""
        count = len(self.findings)
        return f"{count} finding{'s' * (count != 1)}" if count else "verified"


def verify(
    trajectory: Trajectory,
    limits_by_move: Sequence[Limits],
    promises: Sequence[Promise] | None = None,
) -> Verdict:
    """Return the verdict on a trajectory: its joint limits for all t, its continuity, the points it passes.

    Args:
        trajectory: What to judge.
        limits_by_move: The limits in force, one for each span.
        promises: What each span says of itself; with them the tool and the via points are judged, too.

    Raises:
        ValueError: When there are more or fewer limits than spans.
    """
    peaks, tool_peaks = tuple(peaks_by_move(trajectory)), _tool_peaks(trajectory, promises)
    findings = check_limits(trajectory, limits_by_move, _judged(trajectory, limits_by_move, promises, peaks))
    by_position = _by_position(trajectory, limits_by_move)
    if any(by_position):
        from trajcli.checks.velocity_by_position import check_velocity_by_position

        findings += check_velocity_by_position(trajectory, by_position)
    efforts = _efforts(trajectory, promises)
    findings += _check_efforts(trajectory, promises, efforts)
    findings += check_continuity(trajectory, limits_by_move, peaks)
    if promises is not None:
        findings += _check_via_points(trajectory, promises)
        findings += check_targets(trajectory, promises)
        findings += _check_tools(trajectory, promises, tool_peaks)
    return Verdict(
        findings=_in_order(trajectory, findings, promises),
        steps=acceleration_steps(trajectory, limits_by_move, peaks),
        peaks=peaks,
        unchecked=_unchecked(trajectory, limits_by_move),
        tool_peaks=tool_peaks,
        sampled=tuple(
            span.index
            for span, promise in zip(trajectory.spans, promises or (), strict=False)
            if promise.tool is not None
        ),
        unchecked_of_tool=_unchecked_of_tool(limits_by_move, promises, peaks),
        by_position=by_position,
        efforts=efforts,
    )


def _by_position(
    trajectory: Trajectory, limits_by_move: Sequence[Limits]
) -> tuple[tuple[ApproachUse, ...], ...]:
    """Return for each span where joints use most of their limits of velocity by position."""
    if not any(limits.has_velocity_by_position for limits in limits_by_move):
        return ((),) * len(trajectory.spans)
    from trajcli.checks.velocity_by_position import velocity_by_position_uses

    pairs = zip(trajectory.spans, limits_by_move, strict=True)
    return tuple(velocity_by_position_uses(trajectory, span, limits) for span, limits in pairs)


def _efforts(trajectory: Trajectory, promises: Sequence[Promise] | None) -> tuple[MoveEfforts | None, ...]:
    """Return for each span the largest efforts, where the arm has limits of them."""
    efforts: list[MoveEfforts | None] = []
    for span, promise in zip(trajectory.spans, promises or [Promise()] * len(trajectory.spans), strict=True):
        robot, known = promise.robot, None
        if robot is not None and robot.limits.has_effort:
            from trajcli.checks.effort import move_efforts

            known = move_efforts(trajectory, span, robot)
        efforts.append(known)
    return tuple(efforts)


def _check_efforts(
    trajectory: Trajectory, promises: Sequence[Promise] | None, efforts: Sequence[MoveEfforts | None]
) -> Iterator[Finding]:
    """Yield the findings about torques and forces."""
    for span, promise, of_span in zip(trajectory.spans, promises or (), efforts, strict=False):
        if of_span is not None and promise.robot is not None:
            from trajcli.checks.effort import check_efforts

            yield from check_efforts(trajectory, span, promise.robot, of_span)


def _judged(
    trajectory: Trajectory,
    limits_by_move: Sequence[Limits],
    promises: Sequence[Promise] | None,
    peaks: Sequence[tuple[Peaks, ...]],
) -> Sequence[tuple[Peaks, ...]]:
    """Return the extremes that count against the limits: all of them where no move brakes."""
    if promises is None or all(promise.braking is None for promise in promises):
        return peaks
    from trajcli.checks.braking import judged_peaks

    return judged_peaks(trajectory, limits_by_move, promises, peaks)


def _in_order(
    trajectory: Trajectory, findings: list[Finding], promises: Sequence[Promise] | None
) -> tuple[Finding, ...]:
    """Return the findings by move and time, each with its remedy."""
    number = {span.index: k for k, span in enumerate(trajectory.spans)}
    of_span: dict[int, list[Finding]] = {}
    for finding in findings:
        of_span.setdefault(number.get(finding.move or 0, 0), []).append(finding)
    return tuple(
        finding
        for k in sorted(of_span)
        for finding in _with_remedies(
            sorted(of_span[k], key=lambda finding: finding.time or 0.0),
            trajectory,
            trajectory.spans[k],
            promises[k] if promises else Promise(),
        )
    )


def _with_remedies(
    findings: list[Finding], trajectory: Trajectory, span: Span, promise: Promise
) -> Iterator[Finding]:
    """Yield the findings of one move with what would fix them: one duration, long enough for all of them."""
    factor = longest_factor(findings)
    alone = all(finding.factor is not None for finding in findings)
    smoother = next((f.hint for f in findings if f.kind == "acceleration_jump"), None)
    for finding in findings:
        known = finding
        if finding.kind == "jerk" and smoother is not None:  # what joins the acceleration limits the jerk
            known = replace(finding, hint=promise.remedies.get("acceleration_jump", smoother))
        yield _with_remedy(known, trajectory, span, promise, factor, alone=alone)


def longest_factor(findings: Sequence[Finding]) -> float | None:
    """Return how many times longer a move must last for all of its findings that this helps; None for none.

    The limits' own room for rounding is used, so that a factor is not shown above what is enough.
    """
    rooms = {"exact": LIMIT_RELATIVE, "bounded": TOOL_RELATIVE, "sampled": TOOL_RELATIVE}
    return max(
        (f.factor * (1 - rooms[f.method] * _PART) for f in findings if f.factor is not None), default=None
    )


def _tool_peaks(
    trajectory: Trajectory, promises: Sequence[Promise] | None
) -> tuple[Mapping[str, ToolPeak] | None, ...]:
    """Return for each span the peaks of the tool in joint space, where it has limits and can be judged."""
    peaks: list[Mapping[str, ToolPeak] | None] = []
    for span, promise in zip(trajectory.spans, promises or [Promise()] * len(trajectory.spans), strict=True):
        robot, known = promise.robot, None
        if robot is not None and promise.tool is None and robot.limits.tcp != _NO_TOOL_LIMITS:
            from trajcli.checks.tool_limits import limits_tool, tool_peaks

            known = tool_peaks(trajectory, span, robot) if limits_tool(robot) else None
        peaks.append(known)
    return tuple(peaks)


def _check_via_points(trajectory: Trajectory, promises: Sequence[Promise]) -> Sequence[Finding]:
    if all(promise.via_points is None for promise in promises):
        return ()
    from trajcli.checks.waypoints import check_waypoints

    return check_waypoints(trajectory, [promise.via_points for promise in promises])


def _check_tools(
    trajectory: Trajectory,
    promises: Sequence[Promise],
    tool_peaks: Sequence[Mapping[str, ToolPeak] | None],
) -> list[Finding]:
    findings: list[Finding] = []
    for span, promise, peaks in zip(trajectory.spans, promises, tool_peaks, strict=True):
        if promise.robot is None:
            continue
        if promise.tool is not None:
            from trajcli.checks.tool import SampledTool, check_tool

            findings += check_tool(SampledTool(trajectory, span, promise.robot, promise.tool))
        elif peaks is not None:
            from trajcli.checks.tool_limits import check_tool_limits

            findings += check_tool_limits(span, promise.robot.limits.tcp, peaks)
    return findings


def _unchecked_of_tool(
    limits_by_move: Sequence[Limits], promises: Sequence[Promise] | None, peaks: Sequence[tuple[Peaks, ...]]
) -> tuple[str, ...]:
    """Return the limits of the tool that are stated and cannot be judged in some move where the arm moves."""
    names: set[str] = set()
    for k, (limits, of_span) in enumerate(zip(limits_by_move, peaks, strict=True)):
        if limits.tcp == _NO_TOOL_LIMITS or not of_span[1].magnitude.any():
            continue
        from trajcli.checks.tool_limits import stated_limits

        promise = promises[k] if promises else Promise()
        whole = promise.robot is None or promise.robot.convention is None
        on_path = promise.tool is not None and not promise.tool.pure_rotation
        names |= {name for name in stated_limits(limits.tcp) if whole or (name == "jerk" and not on_path)}
    return tuple(name for name in vars(_NO_TOOL_LIMITS) if name in names)


def _unchecked(trajectory: Trajectory, limits_by_move: Sequence[Limits]) -> tuple[tuple[str, str], ...]:
    open_ended = [
        [np.isinf(limits.of_order(order)).any(axis=1) for limits in limits_by_move]
        for order in range(len(QUANTITIES))
    ]
    unlimited = np.any(open_ended, axis=1)
    return tuple(
        (name, quantity)
        for joint, name in enumerate(trajectory.joint_names)
        for order, quantity in enumerate(QUANTITIES)
        if unlimited[order, joint]
    )


def _with_remedy(
    finding: Finding,
    trajectory: Trajectory,
    span: Span,
    promise: Promise,
    factor: float | None,
    *,
    alone: bool,
) -> Finding:
    """Return the finding with what would fix it, where that is known.

    Args:
        finding: What is wrong.
        trajectory: The whole.
        span: Of the move that it is about.
        promise: What that move says of itself.
        factor: How many times longer the move must last for all its limits; None where that does not help.
        alone: Whether a longer move has no finding left: else `slow` is no answer.
    """
    hint = promise.remedies.get(finding.kind, finding.hint)
    if hint is None and (finding.kind in LIMITS_OF_JOINTS or finding.kind in _TOOL_LIMITS):
        hint = _by_slowing(finding, trajectory, span, promise, factor, alone=alone)
    return finding if hint == finding.hint else replace(finding, hint=hint)


def _by_slowing(
    finding: Finding,
    trajectory: Trajectory,
    span: Span,
    promise: Promise,
    factor: float | None,
    *,
    alone: bool,
) -> str:
    """Return how much longer the move must last to keep its limits, or why that is no help."""
    if finding.factor is None or factor is None or promise.over_limit == "slow":
        return f"{_NO_HELP}: change the target, the start or the limit"
    if promise.ends is None or all(state.at_rest for state in promise.ends):
        longer = f"{at_least(factor)} times longer ({at_least(span.duration * factor)} s)"
        return f"it must last {longer}" + (f", or {_SLOW}" if promise.over_limit and alone else "")
    if finding.joint is None:
        from trajcli.checks.tool_limits import tool_ends_over_limit

        over = promise.robot is not None and tool_ends_over_limit(promise.robot, promise.ends)
        return f"{_NO_HELP}: the tool is too fast where the move starts or ends" if over else _SLOW
    if _ends_over_limit(finding, trajectory.joint_names.index(finding.joint), promise):
        return f"{_NO_HELP}: the move starts or ends over its limit"
    return f"{_SLOW}: it finds the shortest duration between these moving states"


def _ends_over_limit(finding: Finding, joint: int, promise: Promise) -> bool:
    """Return whether the joint is over its limit where the move declares to begin or to end."""
    if finding.kind == "velocity_by_position":
        from trajcli.checks.velocity_by_position import ends_over_velocity_by_position

        return promise.robot is not None and (
            ends_over_velocity_by_position(promise.robot.limits, promise.ends or ()) is not None
        )
    if finding.kind == "effort":
        return False
    order = QUANTITIES.index(finding.kind)
    rates = [(state.velocity, state.acceleration)[order - 1] for state in promise.ends or () if order < 3]
    ends = [float(values[joint]) for values in rates]
    limit = finding.limit or 0.0
    return any(abs(value) > abs(limit) and value * limit > 0 for value in ends)
