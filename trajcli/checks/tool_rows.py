"""Rows of a trajectory with the tool recomputed from them by forward kinematics, and its peaks."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from trajcli.checks.finding import Kind
from trajcli.checks.tool_bound import Bound, tool_bounds
from trajcli.curves.piecewise import Array
from trajcli.frozen import frozen
from trajcli.kinematics.following.motion import ToolMotion
from trajcli.kinematics.inverse.target import IkTarget, residuals
from trajcli.kinematics.jacobian import linearisation
from trajcli.kinematics.robot import Robot
from trajcli.trajectory import Span, Trajectory

_EACH = 8  # rows of a piece
SPEEDS: tuple[tuple[Kind, str, int, slice], ...] = (
    ("tool_speed", "speed", 1, slice(0, 3)),
    ("tool_angular_speed", "angular_speed", 1, slice(3, 6)),
    ("tool_acceleration", "acceleration", 2, slice(0, 3)),
    ("tool_angular_acceleration", "angular_acceleration", 2, slice(3, 6)),
)


@frozen
class ToolRows:
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
        return self.motion.demand(self.times).target()

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
    def peaks(self) -> dict[str, Bound]:
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
