"""The tool on its path: recomputed by forward kinematics on rows of the trajectory."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from trajcli.checks.finding import Finding, Kind
from trajcli.checks.tolerances import JUMP_RELATIVE, TOOL_RELATIVE, exceeds
from trajcli.curves.extrema import peaks
from trajcli.curves.piecewise import Array, Side
from trajcli.kinematics.dexterity import characteristic_length
from trajcli.kinematics.following.motion import ToolMotion
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.target import residual_jacobian, residuals
from trajcli.kinematics.jacobian import jacobian, tcp_acceleration, tcp_twist
from trajcli.kinematics.robot import Robot
from trajcli.trajectory import Span, Trajectory

_EACH = 8  # rows of a piece
_ROUNDS, _INNER = 4, 17  # in which a peak is looked for more closely, and rows of each
SPEEDS: tuple[tuple[Kind, str, int, slice], ...] = (
    ("tool_speed", "speed", 1, slice(0, 3)),
    ("tool_angular_speed", "angular_speed", 1, slice(3, 6)),
    ("tool_acceleration", "acceleration", 2, slice(0, 3)),
    ("tool_angular_acceleration", "angular_acceleration", 2, slice(3, 6)),
)


@dataclass(frozen=True, eq=False)
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

    def times(self) -> Array:
        """Return times of rows within every piece of the move, from its start."""
        breaks = self.trajectory.curve.breaks - self.span.start
        inside = breaks[(breaks > 0) & (breaks < self.span.duration)]
        edges = np.concatenate([[0.0], inside, [self.span.duration]])
        part = np.linspace(0.0, 1.0, _EACH + 1)[:-1]
        rows = (edges[:-1, None] + np.diff(edges)[:, None] * part).reshape(-1)
        return np.append(rows, self.span.duration)

    def joints(self, times: Array, orders: tuple[int, ...], side: Side) -> Array:
        """Return joint values and derivatives (N, orders, n)."""
        curve = self.trajectory.curve
        absolute = np.clip(self.span.start + times, self.span.start, self.span.end)
        return curve.evaluate_orders(absolute, orders, side=side)

    def sizes(self, times: Array, order: int, part: slice, side: Side) -> Array:
        """Return the magnitude of the tool's velocity or acceleration, linear or angular, at times (N,)."""
        rows = self.joints(times, (0, 1, 2), side)
        if order == 1:
            moved = tcp_twist(self.robot, rows[:, 0], rows[:, 1])
        else:
            moved = tcp_acceleration(self.robot, rows[:, 0], rows[:, 1], rows[:, 2])
        return np.asarray(np.linalg.norm(moved[:, part], axis=1))

    def peak(self, order: int, part: slice) -> tuple[float, float]:
        """Return the largest magnitude, and when it is."""
        times, best, at = self.times(), 0.0, 0.0
        sides: tuple[Side, Side] = ("left", "right")
        for side in sides:
            inside = times[1:] if side == "left" else times[:-1]
            found = self.sizes(inside, order, part, side)
            k = int(found.argmax())
            value, time = float(found[k]), float(inside[k])
            step = float(np.diff(times)[min(k, times.size - 2)])
            for _ in range(_ROUNDS):
                near = np.clip(time + step * np.linspace(-1, 1, _INNER), 0.0, self.span.duration)
                sizes = self.sizes(near, order, part, side)
                value, time = float(sizes.max()), float(near[int(sizes.argmax())])
                step *= 2 / (_INNER - 1)
            if value > best:
                best, at = value, time
        return best, at


def check_tool(rows: ToolRows) -> list[Finding]:
    """Return where the tool leaves its path or its limits, and where the arm changes its branch.

    Args:
        rows: Of one move.
    """
    return [*_check_path(rows), *_check_limits(rows), *_check_jerk(rows), *_check_branch(rows)]


def beside_path(rows: ToolRows) -> tuple[Array, Array]:
    """Return how far the tool is from its path, m, and from its orientation, rad, each (N,)."""
    times = rows.times()
    q = rows.joints(times, (0,), "right")[:, 0]
    target = rows.motion.demand(times).target()
    off = residuals(target, forward(rows.robot, q))
    split = sum(target.position)
    return np.linalg.norm(off[:, :split], axis=1), np.linalg.norm(off[:, split:], axis=1)


def _check_path(rows: ToolRows) -> list[Finding]:
    """Return by how much the tool is beside its path, or turned, where that is more than was promised."""
    tolerance, found = rows.motion.tolerance, []
    kinds: tuple[tuple[Kind, float], ...] = (
        ("tool_path", tolerance.position),
        ("tool_orientation", tolerance.angle),
    )
    for (kind, limit), sizes in zip(kinds, beside_path(rows), strict=True):
        if exceeds(sizes.max(), limit):
            worst = int(sizes.argmax())
            time = float(rows.times()[worst])
            found.append(_finding(rows, kind, float(sizes[worst]), limit, time, None))
    return found


def _check_limits(rows: ToolRows) -> list[Finding]:
    found = []
    for kind, name, order, part in SPEEDS:
        limit = float(getattr(rows.robot.limits.tcp, name))
        if np.isinf(limit):
            continue
        value, time = rows.peak(order, part)
        promised = rows.motion.tolerance.position if part.start == 0 else rows.motion.tolerance.angle
        if value > limit * (1 + TOOL_RELATIVE + 2 * promised):
            found.append(_finding(rows, kind, value, limit, time, (value / limit) ** (1 / order)))
    return found


def _check_jerk(rows: ToolRows) -> list[Finding]:
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
    return [_finding(rows, "tool_jerk", value, limit, time, (value / limit) ** (1 / 3))]


def _check_branch(rows: ToolRows) -> list[Finding]:
    """Return where the arm passes from one branch to another: the determinant of its rows changes sign."""
    times = rows.times()
    q = rows.joints(times, (0,), "right")[:, 0]
    target = rows.motion.demand(times).target()
    slopes = residual_jacobian(target, forward(rows.robot, q), jacobian(rows.robot, q))
    if slopes.shape[1] != slopes.shape[2] or target.orientation == "direction":
        return []  # without as many independent rows as joints there is no determinant
    slopes[:, : sum(target.position)] /= characteristic_length(rows.robot)
    signs = np.sign(np.linalg.det(slopes))
    changes = np.flatnonzero(signs[1:] * signs[:-1] < 0)
    if not changes.size:
        return []
    return [_finding(rows, "branch", 0.0, 0.0, float(times[changes[0]]), None)]


def _finding(
    rows: ToolRows, kind: Kind, value: float, limit: float, time: float, factor: float | None
) -> Finding:
    return Finding(rows.span.index, None, kind, value, limit, rows.span.start + time, "bounded", factor)
