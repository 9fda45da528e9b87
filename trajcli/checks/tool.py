"""Tool along its path: deviation, limits and branch, by forward kinematics of the trajectory."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import Literal

import numpy as np

from trajcli.checks.finding import Finding, FindingKind, FindingMethod, at_time
from trajcli.checks.tolerances import JUMP_RELATIVE, TOOL_RELATIVE, exceeds
from trajcli.checks.tool_bound import ToolPeak, tool_bounds
from trajcli.curves.extrema import peaks
from trajcli.curves.piecewise import Array
from trajcli.errors import Amount
from trajcli.frozen import frozen
from trajcli.kinematics.dexterity import characteristic_length
from trajcli.kinematics.following.motion import ToolMotion
from trajcli.kinematics.inverse.target import IkTarget, residual_jacobian, residuals
from trajcli.kinematics.jacobian import linearisation
from trajcli.kinematics.robot import Robot
from trajcli.trajectory import Span, Trajectory

_EACH = 8  # rows of a piece
SPEEDS: tuple[tuple[FindingKind, str, int, slice], ...] = (
    ("tool_speed", "speed", 1, slice(0, 3)),
    ("tool_angular_speed", "angular_speed", 1, slice(3, 6)),
    ("tool_acceleration", "acceleration", 2, slice(0, 3)),
    ("tool_angular_acceleration", "angular_acceleration", 2, slice(3, 6)),
)


@frozen
class SampledTool:
    """The tool over one move, at sample times, and its reference motion.

    Attributes:
        trajectory: The whole.
        span: Of the move.
        robot: The arm with the limits in force.
        motion: The reference motion of the tool.
    """

    trajectory: Trajectory
    span: Span
    robot: Robot
    motion: ToolMotion

    @cached_property
    def times(self) -> Array:
        """Times (N,) of rows within every piece of the move, from its start."""
        breaks = self.trajectory.curve.breaks - self.span.start
        inside = breaks[(breaks > 0) & (breaks < self.span.duration)]
        edges = np.concatenate([[0.0], inside, [self.span.duration]])
        part = np.linspace(0.0, 1.0, _EACH + 1)[:-1]
        rows = (edges[:-1, None] + np.diff(edges)[:, None] * part).reshape(-1)
        return np.append(rows, self.span.duration)

    @cached_property
    def target(self) -> IkTarget:
        """The reference of the tool at these times."""
        return self.motion.reference(self.times).target()

    @cached_property
    def linearised(self) -> tuple[Array, Array]:
        """Poses (N, 4, 4) of the tcp and Jacobians (N, 6, n) in world at these times."""
        return linearisation(self.robot, self._joints)

    @cached_property
    def deviation(self) -> tuple[Array, Array]:
        """Distance of the tool from its path, m, and angle from its orientation, rad, each (N,)."""
        off, split = residuals(self.target, self.linearised[0]), sum(self.target.position)
        return np.linalg.norm(off[:, :split], axis=1), np.linalg.norm(off[:, split:], axis=1)

    @cached_property
    def peaks(self) -> dict[str, ToolPeak]:
        """Largest magnitude of each of `SPEEDS`, from the start of the move, by the name of its limit."""
        curve, span = self.trajectory.curve, self.span
        middles = curve.breaks[:-1] + curve.lengths / 2
        first, last = np.searchsorted(middles, [span.start, span.end])
        breaks = curve.breaks[first : last + 1] - span.start
        bounds = tool_bounds(self.robot, breaks, curve.coefficients[:, first:last])
        return {name: bound for (_, name, _, _), bound in zip(SPEEDS, bounds, strict=True)}

    @cached_property
    def _joints(self) -> Array:
        absolute = np.clip(self.span.start + self.times, self.span.start, self.span.end)
        return self.trajectory.curve.evaluate(absolute)


def check_tool(tool: SampledTool) -> list[Finding]:
    """Return where the tool leaves its path or its limits, and where the arm changes its branch."""
    return [*_check_path(tool), *_check_limits(tool), *_check_jerk(tool), *_check_branch(tool)]


def _check_path(tool: SampledTool) -> list[Finding]:
    """Return by how much the tool is beside its path, or turned, where that is more than was promised."""
    tolerance, findings = tool.motion.tolerance, []
    kinds: tuple[tuple[FindingKind, str, float], ...] = (
        ("tool_path", "is beside", tolerance.position),
        ("tool_orientation", "is turned from", tolerance.angle),
    )
    for (kind, what, limit), sizes in zip(kinds, tool.deviation, strict=True):
        if exceeds(sizes.max(), limit):
            worst = int(sizes.argmax())
            message = f"the tool {what} its path by {{value}} {{time}}, promised were {{limit}}"
            finding = _finding(
                tool, kind, 0, float(sizes[worst]), limit, float(tool.times[worst]), None, message
            )
            findings.append(replace(finding, hint="this is a bug: report it"))
    return findings


def _check_limits(tool: SampledTool) -> list[Finding]:
    findings = []
    for kind, name, order, part in SPEEDS:
        limit = float(getattr(tool.robot.limits.tcp, name))
        if np.isinf(limit):
            continue
        peak = tool.peaks[name]
        promised = tool.motion.tolerance.position if part.start == 0 else tool.motion.tolerance.angle
        if peak.most > limit * (1 + TOOL_RELATIVE + 2 * promised):
            factor = (peak.most / limit) ** (1 / order)
            findings.append(
                _finding(tool, kind, order, peak.most, limit, peak.time, factor, method="bounded")
            )
    return findings


def _check_jerk(tool: SampledTool) -> list[Finding]:
    """Return where the law's jerk breaks its limit, or its acceleration steps although jerk is limited."""
    limit, law = tool.robot.limits.tcp.jerk, tool.motion.law
    if np.isinf(limit) or tool.motion.pure_rotation:
        return []
    before, after = law.piece_ends(2)[1][:, 0], law.piece_ends(2)[0][:, 0]
    steps = np.abs(np.append(after, 0.0) - np.append(0.0, before))
    accelerations, jerks = peaks(law, (2, 3))
    if steps.max() > JUMP_RELATIVE * float(accelerations.magnitude[0]):
        time = float(law.breaks[int(steps.argmax())])
        message = "the acceleration of the tool along its path steps by {value} {time}"
        step = _finding(tool, "tool_acceleration_jump", 2, float(steps.max()), 0.0, time, None, message)
        hint = "use shape jerk_limited or quintic, or leave the limit of the tool's jerk out"
        return [replace(step, method="exact", hint=hint)]
    value = float(jerks.magnitude[0])
    if value <= limit * (1 + TOOL_RELATIVE):
        return []
    time = float(jerks.high_time[0] if jerks.high[0] >= value else jerks.low_time[0])
    return [_finding(tool, "tool_jerk", 3, value, limit, time, (value / limit) ** (1 / 3), method="exact")]


def _check_branch(tool: SampledTool) -> list[Finding]:
    """Return where the arm passes from one branch to another: the determinant of its rows changes sign."""
    target = tool.target
    slopes = residual_jacobian(target, *tool.linearised)
    if slopes.shape[1] != slopes.shape[2] or target.orientation == "direction":
        return []  # without as many independent rows as joints there is no determinant
    slopes[:, : sum(target.position)] /= characteristic_length(tool.robot)
    signs = np.sign(np.linalg.det(slopes))
    changes = np.flatnonzero(signs[1:] * signs[:-1] < 0)
    if not changes.size:
        return []
    message = "the arm changes its branch {time}: it passes a singularity"
    finding = _finding(tool, "branch", 0, 0.0, 0.0, float(tool.times[changes[0]]), None, message)
    return [replace(finding, hint="move the path", amounts={})]


def _finding(
    tool: SampledTool,
    kind: FindingKind,
    order: int,
    value: float,
    limit: float,
    time: float,
    factor: float | None,
    message: str | None = None,
    method: FindingMethod = "sampled",
) -> Finding:
    """Return a finding at a time of the move; without a message it says that a limit is broken."""
    name = kind.removeprefix("tool_").replace("_", " ")
    text = message or f"the {name} of the tool reaches {{value}} {{time}}, its limit is {{limit}}"
    dimension: Literal["length", "angle"] = (
        "angle" if name.startswith("angular") or kind == "tool_orientation" else "length"
    )
    amounts = {"value": Amount(value, order, None, dimension), "limit": Amount(limit, order, None, dimension)}
    when = tool.span.start + time
    return Finding(
        move=tool.span.index,
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
