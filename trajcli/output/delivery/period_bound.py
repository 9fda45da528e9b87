"""Bound of what joined rows differ by from a smooth curve between them, from the distance of the rows alone.

A polynomial that shares values and derivatives with a curve at both ends of an interval is off by a constant
times a derivative of the curve and a power of the length. Where that is less than what rounding explains of
every limit, no row needs to be looked at.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.hermite import hermite_errors
from trajcli.curves.piecewise import Array
from trajcli.kinematics.dexterity import characteristic_length
from trajcli.kinematics.robot import Robot
from trajcli.limits.kinds import TOOL_KINDS
from trajcli.planners.planner import PlannedMove
from trajcli.planning.plan import Plan

_OF_TOLERANCE = 1e-3  # of the tolerance of a path: what is no deviation from it


def pieces_within(plan: Plan, length: float, stated: int, slack: float) -> NDArray[np.bool_]:
    """Return of each piece of the planned curve whether joined rows on it keep all that it keeps.

    Args:
        plan: A plan that verifies.
        length: The longest distance of two rows, s.
        stated: How many of position, velocity and acceleration the rows state, 2 or 3.
        slack: Relative: by how much a joined curve may be above a limit.

    Returns:
        Shape (pieces,); False where that is not known.
    """
    curve = plan.trajectory.curve
    powers = np.arange(curve.degree, 2 * stated - 1, -1)
    falling = [math.perm(power, 2 * stated) for power in powers.tolist()]
    sizes = np.abs(curve.coefficients[: powers.size]) * np.array(falling)[:, None, None]
    spans = curve.lengths[:, None] ** (powers - 2 * stated)[:, None, None]
    errors = hermite_errors((sizes * spans).sum(axis=0), length, stated)  # (4, pieces, n)
    within = np.zeros(curve.pieces, dtype=bool)
    middles = curve.breaks[:-1] + curve.lengths / 2 - curve.start
    for move, span, peaks in zip(plan.moves, plan.trajectory.spans, plan.verdict.peaks, strict=True):
        own = slice(*np.searchsorted(middles, [span.start, span.end]).tolist())
        magnitudes = np.stack([peak.magnitude for peak in peaks[:4]])
        within[own] = _joints_keep(move, errors[:, own], slack, stated)
        within[own] &= _tool_keeps(move, errors[:, own], magnitudes, slack)
    return within


def _joints_keep(move: PlannedMove, errors: Array, slack: float, judged: int) -> NDArray[np.bool_]:
    """Return whether joints keep their limits between rows, shape (w,)."""
    limits = move.robot.limits
    if limits.has_effort or limits.has_velocity_by_position:
        return np.zeros(errors.shape[1], dtype=bool)
    allowed = np.stack([slack * np.abs(limits.of_order(k)).min(axis=1) for k in range(1, judged + 1)])
    ranges = np.where(np.isfinite(limits.of_order(0)).any(axis=1), slack, np.inf)
    kept = np.all(errors[1 : judged + 1] <= allowed[:, None], axis=(0, 2))
    return np.asarray(kept & np.all(errors[0] <= ranges, axis=1))


def _tool_keeps(move: PlannedMove, errors: Array, peaks: Array, slack: float) -> NDArray[np.bool_]:
    """Return whether the tool keeps its limits and its path between rows, shape (w,).

    Every derivative of its place by joints is at most the reach of the arm, of its orientation at most 1, so
    that its derivatives by time are at most sums of products of sums of those of the joints.
    """
    robot, path = move.robot, move.planned.tool
    kept: NDArray[np.bool_] = np.ones(errors.shape[1], dtype=bool)
    stated = [kind for kind in TOOL_KINDS if kind.stated(robot.limits)]
    if path is None and not stated:
        return kept
    reach = _reach(robot, peaks[0] + errors[0].max(axis=0, initial=0.0))
    off, sums = errors.sum(axis=2), peaks.sum(axis=1)
    exact, other = _products(sums[1:, None]), _products(sums[1:, None] + off[1:])
    changes = other * (1.0 + off[0]) - exact
    for kind in stated:
        size = 1.0 if kind.dimension == "angle" else reach
        kept &= size * changes[(kind.order or 1) - 1] <= slack * getattr(robot.limits.tcp, kind.key)
    if path is not None:
        near = path.tolerance.position / reach, path.tolerance.angle
        kept &= off[0] <= _OF_TOLERANCE * min(near)
    return kept


def _reach(robot: Robot, largest: Array) -> float:
    """Return the longest distance of the tool from any joint, with the slides as far out as they come, m."""
    slides = [float(q) for q, kind in zip(largest, robot.joint_types, strict=True) if kind == "prismatic"]
    return max(characteristic_length(robot) + math.fsum(slides), 1.0)


def _products(sums: Array) -> Array:
    """Return bounds of three derivatives by time of a function whose derivatives by joints are at most 1."""
    first, second, third = sums
    return np.stack([first, second + first**2, third + 3 * first * second + first**3])
