"""Remedies of findings."""

from __future__ import annotations

from dataclasses import replace

from trajcli.checks.finding import Finding
from trajcli.kinematics.robot import QUANTITIES
from trajcli.trajectory import Promise, Span, Trajectory

_TOOL_LIMITS = (
    "tool_speed",
    "tool_angular_speed",
    "tool_acceleration",
    "tool_angular_acceleration",
    "tool_jerk",
)
_NO_HELP = "slowing down does not help"
_SLOW = "say `when_over_limit: slow`"


def with_remedy(finding: Finding, trajectory: Trajectory, span: Span, promise: Promise) -> Finding:
    """Return the finding with what would fix it, where that is known.

    Args:
        finding: What is wrong.
        trajectory: The whole.
        span: Of the move that it is about.
        promise: What that move says of itself.
    """
    hint = promise.remedies.get(finding.kind, finding.hint)
    if hint is None and (finding.kind in QUANTITIES or finding.kind in _TOOL_LIMITS):
        hint = _by_slowing(finding, trajectory, span, promise)
    return finding if hint == finding.hint else replace(finding, hint=hint)


def _by_slowing(finding: Finding, trajectory: Trajectory, span: Span, promise: Promise) -> str:
    """Return how much longer the move must last to keep a limit, or why that is no help."""
    if finding.factor is None or promise.over_limit == "slow":
        return f"{_NO_HELP}: change the target, the start or the limit"
    if promise.ends is None or all(state.at_rest for state in promise.ends):
        longer = f"{finding.factor:.6g} times longer ({span.duration * finding.factor:.6g} s)"
        return f"it must last {longer}" + (f", or {_SLOW}" if promise.over_limit else "")
    if finding.joint is None:
        return _SLOW
    if _ends_over_limit(finding, trajectory.joint_names.index(finding.joint), promise):
        return f"{_NO_HELP}: the move starts or ends over its limit"
    return f"{_SLOW}: it finds the shortest duration between these moving states"


def _ends_over_limit(finding: Finding, joint: int, promise: Promise) -> bool:
    """Return whether the joint is over its limit where the move declares to begin or to end."""
    order = QUANTITIES.index(finding.kind)
    rates = [(state.velocity, state.acceleration)[order - 1] for state in promise.ends or () if order < 3]
    ends = [float(values[joint]) for values in rates]
    return any(abs(value) > abs(finding.limit) and value * finding.limit > 0 for value in ends)
