"""Limits of the tool for all t, by forward kinematics of the joints' curve: in joint space as on a path."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import TYPE_CHECKING, Literal

import numpy as np

from trajcli.checks.tolerances import TOOL_RELATIVE
from trajcli.errors import Amount
from trajcli.findings import Finding, FindingMethod, at_time
from trajcli.kinematics.robot import Robot, ToolLimits
from trajcli.trajectory import Span, State, Trajectory

if TYPE_CHECKING:
    from trajcli.checks.tool_bound import ToolPeak

SPEEDS: tuple[tuple[str, str, int], ...] = (
    ("tool_speed", "speed", 1),
    ("tool_angular_speed", "angular_speed", 1),
    ("tool_acceleration", "acceleration", 2),
    ("tool_angular_acceleration", "angular_acceleration", 2),
)
"""Kind of finding, name of the limit and order of the derivative of what `tool_peaks` bounds."""


def stated_limits(limits: ToolLimits) -> tuple[str, ...]:
    """Return the names of the limits of the tool that somebody stated."""
    return tuple(field.name for field in fields(limits) if np.isfinite(getattr(limits, field.name)))


def limits_tool(robot: Robot) -> bool:
    """Return whether an arm has limits of its tool, and the geometry that it takes to judge them."""
    return robot.convention is not None and any(name != "jerk" for name in stated_limits(robot.limits.tcp))


def tool_peaks(trajectory: Trajectory, span: Span, robot: Robot) -> Mapping[str, ToolPeak]:
    """Return the largest magnitude of each of `SPEEDS` over one move, by the name of its limit.

    Times count from the start of the move.
    """
    from trajcli.checks.tool_bound import tool_bounds

    curve = trajectory.curve
    middles = curve.breaks[:-1] + curve.lengths / 2
    first, last = np.searchsorted(middles, [span.start, span.end])
    breaks = curve.breaks[first : last + 1] - span.start
    with np.errstate(over="ignore", invalid="ignore"):
        bounds = tool_bounds(robot, breaks, curve.coefficients[:, first:last])
    return {name: bound for (_, name, _), bound in zip(SPEEDS, bounds, strict=True)}


def check_tool_limits(
    span: Span,
    limits: ToolLimits,
    peaks: Mapping[str, ToolPeak],
    promised: tuple[float, float] = (0.0, 0.0),
) -> list[Finding]:
    """Return where the tool breaks its limits in a move.

    Args:
        span: The move.
        limits: Those of the tool; that of the jerk is left out.
        peaks: From `tool_peaks`.
        promised: By what part of their peaks speeds and accelerations, and angular ones, may differ from
            those of the law that was planned within the limits.
    """
    findings = []
    for kind, name, order in SPEEDS:
        limit, peak = float(getattr(limits, name)), peaks[name]
        room = TOOL_RELATIVE + 2 * promised[name.startswith("angular_")]
        if np.isinf(limit) or peak.most <= limit * (1 + room):
            continue
        factor = (peak.most / limit) ** (1 / order)
        known = factor if np.isfinite(factor) and span.duration > 0 else None
        findings.append(tool_finding(span, kind, order, peak.most, limit, peak.time, known, method="bounded"))
    return findings


def share_of_tool_limits(limits: ToolLimits, peaks: Mapping[str, ToolPeak]) -> float:
    """Return how much of the limits of the tool a motion uses: above 1 where it breaks one."""
    return max(peaks[name].most / float(getattr(limits, name)) for _, name, _ in SPEEDS)


def tool_ends_over_limit(robot: Robot, ends: tuple[State, State]) -> bool:
    """Return whether the tool is too fast where a move begins or ends: no duration helps against that."""
    if not limits_tool(robot):
        return False
    from trajcli.kinematics.jacobian import tcp_twist

    limits = robot.limits.tcp
    twists = [tcp_twist(robot, state.position, state.velocity) for state in ends]
    speed, angular_speed = (max(float(np.linalg.norm(t[k : k + 3])) for t in twists) for k in (0, 3))
    room = 1 + TOOL_RELATIVE
    return speed > limits.speed * room or angular_speed > limits.angular_speed * room


def tool_finding(
    span: Span,
    kind: str,
    order: int,
    value: float,
    limit: float,
    time: float,
    factor: float | None,
    message: str | None = None,
    method: FindingMethod = "sampled",
) -> Finding:
    """Return a finding about the tool; without a message it says that a limit is broken.

    Args:
        span: The move.
        kind: Of the finding.
        order: Of the derivative that value and limit are of.
        value: SI.
        limit: SI.
        time: Seconds from the start of the move.
        factor: By what factor the move must last longer; None where that does not help.
        message: With `{value}`, `{limit}` and `{time}`.
        method: How it was found.
    """
    name = kind.removeprefix("tool_").replace("_", " ")
    text = message or f"the {name} of the tool reaches {{value}} {{time}}, its limit is {{limit}}"
    dimension: Literal["length", "angle"] = (
        "angle" if name.startswith("angular") or kind == "tool_orientation" else "length"
    )
    amounts = {
        "value": Amount(value, order, None, dimension, "up"),
        "limit": Amount(limit, order, None, dimension, "down"),
    }
    when = span.start + time
    return Finding(
        move=span.index,
        joint=None,
        kind=kind,
        value=value,
        limit=limit,
        time=when,
        method=method,
        factor=factor,
        message=text.replace("{time}", at_time(when)),
        amounts=amounts,
    )
