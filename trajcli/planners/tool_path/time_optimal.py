"""The fastest law along a path of the tool that joints and tool allow."""

from __future__ import annotations

import math

import numpy as np

from trajcli.curves.operations import scale_time
from trajcli.curves.piecewise import Array, PiecewisePolynomial, Side, derivative_coefficients, horner
from trajcli.curves.time_optimal.constraints import ConstraintRows
from trajcli.curves.time_optimal.parameterization import time_optimal
from trajcli.curves.time_optimal.switching import switching_structure
from trajcli.curves.time_optimal.time_law import LawPieces
from trajcli.frozen import frozen
from trajcli.kinematics.following.motion import motion_along
from trajcli.kinematics.following.tolerance import Tolerance
from trajcli.kinematics.following.tool_path import ToolPath
from trajcli.kinematics.robot import Robot, ToolLimits
from trajcli.planners.planner import Event, Phase, stretched
from trajcli.planners.point_to_point.point_to_point import missing_limit
from trajcli.planners.tool_path.follow import FollowedPath, JointMotion
from trajcli.planners.tool_path.law import LawSpec

_FINER = 0.5  # of the tolerance, for q(s): what the law multiplies it with must still be within
_CORNERS = 16  # of the polygon inside the circle of accelerations
_BETWEEN = 6  # places of a piece at which the limits of the tool are looked at, its ends included
_STRETCHED = 1e-9
_BESIDE = 1e-13  # of the length: so far before its end the last sample of an interval is
_NOTED = 1e-6  # relative: a smaller stretch is not worth an event


def fastest_along(joints: FollowedPath, spec: LawSpec, tolerance: Tolerance, planner: str) -> JointMotion:
    """Return the fastest motion along a path within the limits of joints and tool.

    Args:
        joints: Along the path.
        spec: What it names replaces the limits of the tool.
        tolerance: How near the joints' curve must be.
        planner: Tag for messages.

    Raises:
        MissingLimitError: When a moving joint has no limit of acceleration.
        PlanningError: When the joints cannot follow.
    """
    robot, path = joints.robot, joints.path
    curve = joints.by_place(Tolerance(tolerance.position * _FINER, tolerance.angle * _FINER))
    _require_acceleration(curve, robot, planner)
    tcp = _limits(spec, robot.limits.tcp)
    solved = time_optimal(
        curve, robot.limits.velocity, robot.limits.acceleration, further=[ToolConstraint(path, tcp)]
    )
    left = _left_over(path, solved.law, tcp)
    least = spec.minimum_duration or 0.0
    factor = max(left, least / solved.trajectory.duration)
    law, trajectory = (
        scale_time(each, factor) if factor > 1 else each for each in (solved.law, solved.trajectory)
    )
    motion = motion_along(path, law, law.breaks, tolerance, None)
    binding = switching_structure(solved.trajectory, robot.limits.velocity, robot.limits.acceleration)
    phases = [
        Phase(f"{b.quantity} {'+' if b.sign > 0 else '-'}", b.start * factor, b.end * factor, b.joint)
        for b in binding
    ]
    text = f"the grid was refined {solved.refinements} times, to {solved.grid.size} places"
    events = [Event("refined", text)]
    stretch = solved.stretch * left
    if stretch > 1 + _NOTED:
        events.append(stretched(stretch))
    return JointMotion(trajectory, motion, tuple(phases), tuple(events if solved.refinements else events[1:]))


def _left_over(path: ToolPath, law: PiecewisePolynomial, limits: ToolLimits) -> float:
    """Return how many times longer the law must last to keep the tool's limits, as the whole law has them."""
    part = np.linspace(0.0, 1.0, _BETWEEN)
    times = (law.breaks[:-1, None] + law.lengths[:, None] * part).reshape(-1)
    passed = path.crossings(law, law.breaks)
    demand = path.at_time(law, np.clip(times, law.start, law.end), "right", passed)
    speed, acceleration = _used(demand.first, demand.second, limits).max(axis=1).tolist()
    worst: float = max(speed, acceleration**0.5)
    return worst * (1 + _STRETCHED) if worst > 1 else 1.0


def _limits(spec: LawSpec, limits: ToolLimits) -> ToolLimits:
    given = spec.model_dump(include={"speed", "acceleration", "angular_speed", "angular_acceleration"})
    return ToolLimits(**{**vars(limits), **{name: v for name, v in given.items() if v is not None}})


def _require_acceleration(curve: PiecewisePolynomial, robot: Robot, planner: str) -> None:
    moving = np.abs(curve.piece_ends(1)).max(axis=(0, 1)) > 0
    lacking = np.flatnonzero(moving & ~np.isfinite(robot.limits.acceleration).all(axis=1))
    if lacking.size:
        why = "for the fastest law"
        raise missing_limit(planner, "acceleration", lacking.tolist(), robot, why, "use another law `shape`")


@frozen
class ToolConstraint:
    """Limits of the tool along a path.

    Attributes:
        path: Of the tool.
        limits: Of its speed and acceleration, linear and angular.
    """

    path: ToolPath
    limits: ToolLimits

    def rows(self, s: Array, side: Side) -> ConstraintRows:
        """Return rows and caps at points (p,) of the path.

        An acceleration is the sum of one along the path and one across it: the circle of those that are
        allowed is replaced by a polygon inside it, at most 2 % smaller. Across its axis a rotation gets 0.8,
        along 0.6.
        """
        limits = self.limits
        _, first, second = self.path.poses.evaluate(np.clip(s, 0.0, self.path.length), side)
        way, turn = (np.linalg.norm(first[:, part], axis=1) for part in (slice(0, 3), slice(3, 6)))
        bend = np.linalg.norm(second[:, :3], axis=1)
        a, b, c = _translation_rows(way, bend, limits.acceleration)
        more = _rotation_rows(first[:, 3:], second[:, 3:], turn, limits.angular_acceleration)
        with np.errstate(divide="ignore"):
            speed = np.minimum(limits.speed / way, limits.angular_speed / turn)
        cap = np.minimum(speed**2, more[3])
        joined = [np.concatenate(pair, axis=1) for pair in zip((a, b, c), more[:3], strict=True)]
        return ConstraintRows(joined[0], joined[1], joined[2], cap)

    def excess(self, law: LawPieces) -> Array:
        """Return the shares of speed and acceleration used at samples of each piece, shape (2, N)."""
        times = np.linspace(0.0, 1.0, _BETWEEN)[:, None] * law.durations
        s, sd, sdd = (horner(derivative_coefficients(law.coefficients, order), times) for order in range(3))
        length = self.path.length
        s = np.clip(np.maximum(np.minimum(s, s[-1] - _BESIDE * length), s[0]), 0.0, length)
        _, first, second = self.path.poses.evaluate(s.reshape(-1), "right")
        rate, change = sd.reshape(-1, 1), sdd.reshape(-1, 1)
        used = _used(first * rate, second * rate**2 + first * change, self.limits)
        return np.asarray(used.reshape(2, _BETWEEN, -1).max(axis=1))


def _used(velocity: Array, acceleration: Array, limits: ToolLimits) -> Array:
    """Return the shares of speed and acceleration (2, N) that twists and their derivatives (N, 6) use."""
    shares = []
    for rows, linear, angular in (
        (velocity, limits.speed, limits.angular_speed),
        (acceleration, limits.acceleration, limits.angular_acceleration),
    ):
        lengths = np.linalg.norm(rows.reshape(-1, 2, 3), axis=2)
        shares.append((lengths / [linear, angular]).max(axis=1))
    return np.stack(shares)


def _translation_rows(way: Array, bend: Array, limit: float) -> tuple[Array, Array, Array]:
    count = way.size
    if not bend.any():
        ones = np.ones((count, 1)) * way[:, None]
        return np.hstack([ones, -ones]), np.zeros((count, 2)), np.full((count, 2), limit)
    angles = np.pi * (np.arange(_CORNERS // 2) + 0.5) / (_CORNERS // 2)
    apothem = limit * math.cos(math.pi / _CORNERS)
    return (
        way[:, None] * np.cos(angles),
        bend[:, None] * np.sin(angles),
        np.full((count, angles.size), apothem),
    )


def _rotation_rows(
    rate: Array, change: Array, turn: Array, limit: float
) -> tuple[Array, Array, Array, Array]:
    """Return rows (N, 2) and caps (N,) of the angular acceleration."""
    axis = rate / np.where(turn > 0, turn, 1.0)[:, None]
    along = (change * axis).sum(axis=1)
    across = np.linalg.norm(change - axis * along[:, None], axis=1)
    bent = bool(across.any())
    a = np.stack([turn, -turn], axis=1)
    b = np.stack([along, -along], axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        cap = np.where(across > 0, 0.8 * limit / across, np.inf)
    return a, b, np.full((turn.size, 2), (0.6 if bent else 1.0) * limit), cap
