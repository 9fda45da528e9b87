"""Tool along its path: deviation, for all t where the path has majorants, and branch."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Literal

import numpy as np

from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.findings import Finding, FindingMethod, at_time, tool_excess_amounts
from trajcli.frozen import frozen
from trajcli.kinematics.dexterity import changes_of_sign, characteristic_length
from trajcli.kinematics.following.motion import ToolMotion
from trajcli.kinematics.inverse.target import IkTarget, determinants, residuals
from trajcli.kinematics.jacobian import linearisation
from trajcli.kinematics.robot import Robot
from trajcli.limits.kinds import SPEED_KINDS, LimitedMove
from trajcli.limits.tolerances import PATH_RELATIVE, TOOL_RELATIVE, exceeds
from trajcli.limits.tool import peaks_in, tool_excess
from trajcli.limits.tool_bound import SpeedRun, ToolPeak, path_bounds, speed_runs
from trajcli.trajectory import Span, Trajectory

if TYPE_CHECKING:
    from trajcli.curves.node_bound import BoundedPeak

_EACH = 8  # rows of a piece


@frozen
class SampledTool:
    """The tool over one move, or over a part of it, and its reference motion.

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
        """Distance of the tool from its path, m, and angle from its orientation, rad, each (N,), on rows."""
        off, split = residuals(self.target, self.linearised[0]), sum(self.target.position)
        return np.linalg.norm(off[:, :split], axis=1), np.linalg.norm(off[:, split:], axis=1)

    @cached_property
    def bounds(self) -> tuple[BoundedPeak | None, BoundedPeak | None]:
        """What distance and angle do not exceed at any time; None where only rows say it."""
        return path_bounds(self._move)

    @cached_property
    def determinants(self) -> Array | None:
        """Whose sign tells branches apart, (N,); None where none does."""
        return determinants(self.target, *self.linearised, characteristic_length(self.robot))

    @cached_property
    def peaks(self) -> Mapping[str, ToolPeak]:
        """Largest speeds and accelerations, from the start of the move, by the keys of their limits."""
        return peaks_in(self._move, self.robot)

    @cached_property
    def speed_runs(self) -> tuple[SpeedRun, ...]:
        """Largest speeds where limits of them step along the path, from the start of the move; else none."""
        path = self.motion.path
        if path is None or path.speeds is None:
            return ()
        breaks, coefficients = self._move.pieces
        curve = PiecewisePolynomial(breaks - self.span.start, coefficients)
        return tuple(speed_runs(self.robot, path.speeds, self.motion.law, curve))

    @property
    def sampled(self) -> Iterator[str]:
        """What of it is judged on rows alone."""
        for what, bound in zip(
            ("distance from the path", "angle from its orientation"), self.bounds, strict=True
        ):
            if bound is None:
                yield what
        if self.determinants is not None:
            yield "branch"

    @property
    def _move(self) -> LimitedMove:
        return LimitedMove(self.trajectory, self.span, self.robot.limits, self.robot, self.motion)

    @cached_property
    def _joints(self) -> Array:
        absolute = np.clip(self.span.start + self.times, self.span.start, self.span.end)
        return self.trajectory.curve.evaluate(absolute)


def check_tool(tool: SampledTool) -> list[Finding]:
    """Return where the tool leaves its path or is too fast on it, and where the arm changes its branch."""
    return [*_check_path(tool), *_check_speeds(tool), *_check_branch(tool)]


def _check_path(tool: SampledTool) -> list[Finding]:
    """Return by how much the tool is beside its path, or turned, where that is more than was promised."""
    tolerance, findings = tool.motion.tolerance, []
    sampled: FindingMethod = "sampled"
    bounded: FindingMethod = "bounded"
    kinds: tuple[tuple[str, str, Literal["length", "angle"], float], ...] = (
        ("tool_path", "is beside", "length", tolerance.position),
        ("tool_orientation", "is turned from", "angle", tolerance.angle),
    )
    for (kind, what, dimension, limit), sizes, bound in zip(kinds, tool.deviation, tool.bounds, strict=True):
        worst = int(sizes.argmax())
        value, when, method = float(sizes[worst]), float(tool.times[worst]), sampled
        if bound is not None and bound.upper_bound > max(value, limit * (1 + PATH_RELATIVE)):
            value, when, method = bound.upper_bound, bound.time, bounded
        if exceeds(value, limit):
            when += tool.span.start
            finding = Finding(
                move=tool.span.index,
                kind=kind,
                value=value,
                limit=limit,
                time=when,
                method=method,
                hint="this is a bug: report it",
                message=f"the tool {what} its path by {{value}} {at_time(when)}, promised were {{limit}}",
                amounts=tool_excess_amounts(value, limit, 0, dimension),
            )
            findings.append(finding)
    return findings


def _check_speeds(tool: SampledTool) -> Iterator[Finding]:
    """Yield the segments of the path on which the tool is faster than they allow."""
    for run in tool.speed_runs:
        for kind, limit, peak in zip(SPEED_KINDS, run.limits, run.peaks, strict=True):
            if not peak.upper_bound <= limit * (1 + TOOL_RELATIVE):
                found = tool_excess(kind, peak.upper_bound, limit, tool.span.start + peak.time)
                where = "segment {}" if run.segments[0] == run.segments[1] else "segments {} to {}"
                message = f"{where.format(*run.segments)}: {found.message}"
                yield replace(found, move=tool.span.index, message=message)


def _check_branch(tool: SampledTool) -> list[Finding]:
    """Return where the arm passes from one branch to another: the determinant of its rows changes sign."""
    determinants = tool.determinants
    changes = changes_of_sign(determinants) if determinants is not None else np.empty(0)
    if not changes.size:
        return []
    when = tool.span.start + float(tool.times[changes[0] - 1])
    finding = Finding(
        move=tool.span.index,
        kind="branch",
        value=0.0,
        limit=0.0,
        time=when,
        method="sampled",
        hint="move the path",
        message=f"the arm changes its branch {at_time(when)}: it passes a singularity",
    )
    return [finding]
