"""Tool along its path: deviation, limits and branch, by forward kinematics of the trajectory."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property

import numpy as np

from trajcli.checks.tolerances import JUMP_RELATIVE, TOOL_RELATIVE, exceeds
from trajcli.checks.tool_bound import ToolPeak
from trajcli.checks.tool_limits import check_tool_limits, limits_tool, tool_finding, tool_peaks
from trajcli.curves.extrema import peaks
from trajcli.curves.piecewise import Array
from trajcli.findings import Finding
from trajcli.frozen import frozen
from trajcli.kinematics.dexterity import characteristic_length
from trajcli.kinematics.following.motion import ToolMotion
from trajcli.kinematics.inverse.target import IkTarget, residual_jacobian, residuals
from trajcli.kinematics.jacobian import linearisation
from trajcli.kinematics.robot import Robot
from trajcli.trajectory import Span, Trajectory

_EACH = 8  # rows of a piece


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
    def peaks(self) -> Mapping[str, ToolPeak]:
        """Largest magnitude of each of `SPEEDS`, from the start of the move, by the name of its limit."""
        return tool_peaks(self.trajectory, self.span, self.robot)

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
    kinds: tuple[tuple[str, str, float], ...] = (
        ("tool_path", "is beside", tolerance.position),
        ("tool_orientation", "is turned from", tolerance.angle),
    )
    for (kind, what, limit), sizes in zip(kinds, tool.deviation, strict=True):
        if exceeds(sizes.max(), limit):
            worst = int(sizes.argmax())
            message = f"the tool {what} its path by {{value}} {{time}}, promised were {{limit}}"
            value, time = float(sizes[worst]), float(tool.times[worst])
            finding = tool_finding(tool.span, kind, 0, value, limit, time, None, message)
            findings.append(replace(finding, hint="this is a bug: report it"))
    return findings


def _check_limits(tool: SampledTool) -> list[Finding]:
    if not limits_tool(tool.robot):
        return []
    tolerance = tool.motion.tolerance
    promised = tolerance.position, tolerance.angle
    return check_tool_limits(tool.span, tool.robot.limits.tcp, tool.peaks, promised)


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
        step = tool_finding(
            tool.span, "tool_acceleration_jump", 2, float(steps.max()), 0.0, time, None, message
        )
        hint = "use shape jerk_limited or quintic, or leave the limit of the tool's jerk out"
        return [replace(step, method="exact", hint=hint)]
    value = float(jerks.magnitude[0])
    if value <= limit * (1 + TOOL_RELATIVE):
        return []
    time = float(jerks.high_time[0] if jerks.high[0] >= value else jerks.low_time[0])
    factor = (value / limit) ** (1 / 3)
    return [tool_finding(tool.span, "tool_jerk", 3, value, limit, time, factor, method="exact")]


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
    finding = tool_finding(tool.span, "branch", 0, 0.0, 0.0, float(tool.times[changes[0]]), None, message)
    return [replace(finding, hint="move the path", amounts={})]
