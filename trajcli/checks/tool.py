"""The tool on its path: recomputed by forward kinematics on rows of the trajectory.

Rows of a trajectory with the tool recomputed from them by forward kinematics, and its peaks.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from trajcli.checks.finding import Finding, FindingKind, FindingMethod
from trajcli.checks.tolerances import JUMP_RELATIVE, TOOL_RELATIVE, exceeds
from trajcli.checks.tool_bound import ToolPeak, tool_bounds
from trajcli.curves.extrema import peaks
from trajcli.curves.piecewise import Array
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
    """The tool over one move, and what it was told.

    Attributes:
        trajectory: The whole.
        span: Of the move.
        robot: The arm with the limits in force.
        motion: What the tool was told.
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
        """What the tool was told at these times."""
        return self.motion.reference(self.times).target()

    @cached_property
    def linearised(self) -> tuple[Array, Array]:
        """Poses (N, 4, 4) of the tcp and Jacobians (N, 6, n) in world at these times."""
        return linearisation(self.robot, self._joints)

    @cached_property
    def beside(self) -> tuple[Array, Array]:
        """How far the tool is from its path, m, and from its orientation, rad, each (N,)."""
        off, split = residuals(self.target, self.linearised[0]), sum(self.target.position)
        return np.linalg.norm(off[:, :split], axis=1), np.linalg.norm(off[:, split:], axis=1)

    @cached_property
    def peaks(self) -> dict[str, ToolPeak]:
        """Largest magnitude of each of `SPEEDS`, from the start of the move, by the name of its limit."""
        curve, span = self.trajectory.curve, self.span
        middles = curve.breaks[:-1] + curve.lengths / 2
        first, last = np.searchsorted(middles, [span.start, span.end])
        breaks = curve.breaks[first : last + 1] - span.start
        found = tool_bounds(self.robot, breaks, curve.coefficients[:, first:last])
        return {name: bound for (_, name, _, _), bound in zip(SPEEDS, found, strict=True)}

    @cached_property
    def _joints(self) -> Array:
        absolute = np.clip(self.span.start + self.times, self.span.start, self.span.end)
        return self.trajectory.curve.evaluate(absolute)


def check_tool(rows: SampledTool) -> list[Finding]:
    """Return where the tool leaves its path or its limits, and where the arm changes its branch.

    Args:
        rows: Of one move.
    """
    return [*_check_path(rows), *_check_limits(rows), *_check_jerk(rows), *_check_branch(rows)]


def _check_path(rows: SampledTool) -> list[Finding]:
    """Return by how much the tool is beside its path, or turned, where that is more than was promised."""
    tolerance, found = rows.motion.tolerance, []
    kinds: tuple[tuple[FindingKind, float], ...] = (
        ("tool_path", tolerance.position),
        ("tool_orientation", tolerance.angle),
    )
    for (kind, limit), sizes in zip(kinds, rows.beside, strict=True):
        if exceeds(sizes.max(), limit):
            worst = int(sizes.argmax())
            time = float(rows.times[worst])
            found.append(_finding(rows, kind, float(sizes[worst]), limit, time, None))
    return found


def _check_limits(rows: SampledTool) -> list[Finding]:
    found = []
    for kind, name, order, part in SPEEDS:
        limit = float(getattr(rows.robot.limits.tcp, name))
        if np.isinf(limit):
            continue
        peak = rows.peaks[name]
        promised = rows.motion.tolerance.position if part.start == 0 else rows.motion.tolerance.angle
        if peak.most > limit * (1 + TOOL_RELATIVE + 2 * promised):
            factor = (peak.most / limit) ** (1 / order)
            found.append(_finding(rows, kind, peak.most, limit, peak.time, factor, "bounded"))
    return found


def _check_jerk(rows: SampledTool) -> list[Finding]:
    """Return where the law's jerk breaks its limit, or its acceleration steps although jerk is limited."""
    limit, law = rows.robot.limits.tcp.jerk, rows.motion.law
    if np.isinf(limit) or rows.motion.in_place:
        return []
    before, after = law.piece_ends(2)[1][:, 0], law.piece_ends(2)[0][:, 0]
    steps = np.abs(np.append(after, 0.0) - np.append(0.0, before))
    accelerations, jerks = peaks(law, (2, 3))
    hint = "use shape jerk_limited or quintic, or leave the limit of the tool's jerk out"
    if steps.max() > JUMP_RELATIVE * float(accelerations.magnitude[0]):
        return [
            Finding(
                rows.span.index,
                None,
                "tool_acceleration_jump",
                float(steps.max()),
                0.0,
                rows.span.start + float(law.breaks[int(steps.argmax())]),
                hint=hint,
            )
        ]
    value = float(jerks.magnitude[0])
    if value <= limit * (1 + TOOL_RELATIVE):
        return []
    time = float(jerks.high_time[0] if jerks.high[0] >= value else jerks.low_time[0])
    return [_finding(rows, "tool_jerk", value, limit, time, (value / limit) ** (1 / 3), "exact")]


def _check_branch(rows: SampledTool) -> list[Finding]:
    """Return where the arm passes from one branch to another: the determinant of its rows changes sign."""
    target = rows.target
    slopes = residual_jacobian(target, *rows.linearised)
    if slopes.shape[1] != slopes.shape[2] or target.orientation == "direction":
        return []  # without as many independent rows as joints there is no determinant
    slopes[:, : sum(target.position)] /= characteristic_length(rows.robot)
    signs = np.sign(np.linalg.det(slopes))
    changes = np.flatnonzero(signs[1:] * signs[:-1] < 0)
    if not changes.size:
        return []
    return [_finding(rows, "branch", 0.0, 0.0, float(rows.times[changes[0]]), None)]


def _finding(
    rows: SampledTool,
    kind: FindingKind,
    value: float,
    limit: float,
    time: float,
    factor: float | None,
    method: FindingMethod = "sampled",
) -> Finding:
    return Finding(rows.span.index, None, kind, value, limit, rows.span.start + time, method, factor)
