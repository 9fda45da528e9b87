"""Time-optimal law along a path of the tool, under the limits of joints and tool.

Source: Pham and Pham, A New Approach to Time-Optimal Path Parameterization Based on Reachability Analysis,
IEEE Trans. Robotics 34 (2018).
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import ClassVar, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.operations import scale_time
from trajcli.curves.piecewise import (
    Array,
    PiecewisePolynomial,
    Side,
    derivative_coefficients,
    distinct,
    horner,
)
from trajcli.curves.third_order.jerk import LawJerkConstraint
from trajcli.curves.third_order.parameterization import JerkLimitedMotion, jerk_limited_time_optimal
from trajcli.curves.time_optimal.constraints import ConstraintRows, JointConstraint, PathConstraint
from trajcli.curves.time_optimal.parameterization import TimeOptimalMotion, time_optimal
from trajcli.curves.time_optimal.phase_plane import PhasePlane
from trajcli.curves.time_optimal.switching import switching_structure
from trajcli.curves.time_optimal.time_law import LawPieces
from trajcli.frozen import frozen
from trajcli.geometry.rotation import axis_angle_from_matrix
from trajcli.kinematics.following.motion import motion_along
from trajcli.kinematics.following.tolerance import Tolerance
from trajcli.kinematics.robot import Robot, ToolLimits
from trajcli.limits.kinds import TOOL_KINDS, path_constraints
from trajcli.limits.tolerances import TOOL_RELATIVE
from trajcli.limits.tool import limits_tool, tool_peaks
from trajcli.planners.boundary_states import missing_limit
from trajcli.planners.effort_limits import (
    effort_constraints,
    effort_shares,
    lacks_acceleration,
    solved_within_efforts,
)
from trajcli.planners.law_events import distance_from_bound, solved_by_convex_steps
from trajcli.planners.planner import LITTLE, Event, Phase, stretched
from trajcli.planners.tool_path.follow import FollowedPath, JointMotion
from trajcli.planners.tool_path.law import LawSpec

_FINER = 0.5  # of the tolerance, for q(s): what the law multiplies it with must still be within
_CORNERS = 16  # of the polygon inside the circle of accelerations
_BETWEEN = 6  # times in a piece at which the limits of the tool are looked at, its ends included
_BESIDE = 1e-13  # of the length: so far before its end the last sample of an interval is
_EVEN = 1e-6  # of the square of the turning: an axis that changes by less stays


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
    curve = joints.by_s(Tolerance(tolerance.position * _FINER, tolerance.angle * _FINER))
    _require_acceleration(curve, robot, planner)
    tcp = limits_of_law(spec, robot.limits.tcp)
    limits = robot.limits
    with joints.diagnosed():
        further = (ToolConstraint(joints.executed, tcp), *path_constraints(curve, robot))

        turns = path.poses.pure_rotation
        along = (tcp.angular_speed, tcp.angular_acceleration) if turns else (tcp.speed, tcp.acceleration)
        of_law = _jerk_of_law(tcp, angular=path.poses.pure_rotation)
        keeps_jerk = bool(of_law) or _moving(curve)[np.isfinite(limits.jerk).any(axis=1)].any()

        def solve(efforts: tuple[PathConstraint, ...]) -> TimeOptimalMotion:
            every, bounds = (*further, *efforts), (limits.velocity, limits.acceleration)
            if not keeps_jerk:
                return time_optimal(curve, *bounds, further=every, along=along)
            return jerk_limited_time_optimal(
                curve, *bounds, limits.jerk, further=every, further_jerk=of_law, along=along
            )

        solved = solved_within_efforts(curve, robot, solve)
        remaining = _remaining_stretch(robot, solved.trajectory, tcp)
    least = spec.minimum_duration or 0.0
    factor = max(remaining, least / solved.trajectory.duration)
    law, trajectory = (
        scale_time(each, factor) if factor > 1 else each for each in (solved.law, solved.trajectory)
    )
    motion = motion_along(path, law, law.breaks, tolerance, None)
    jerk = limits.jerk if keeps_jerk else None
    efforts = effort_shares(solved.trajectory, robot)
    binding = switching_structure(solved.trajectory, limits.velocity, limits.acceleration, jerk, efforts)
    phases = [
        Phase(f"{b.quantity} {'+' if b.sign > 0 else '-'}", b.start * factor, b.end * factor, b.joint)
        for b in binding
    ]
    events = _events(solved, robot, remaining, fastest=factor == remaining)
    joint_constraint = JointConstraint(curve, limits.velocity, limits.acceleration)
    constraints = (joint_constraint, *further, *effort_constraints(curve, robot))
    breaks = distinct(np.concatenate([curve.breaks, path.breaks]))
    dimension: Literal["length", "angle"] = "angle" if path.poses.pure_rotation else "length"
    plane = PhasePlane(law, constraints, breaks, solved.stops, dimension)
    return JointMotion(trajectory, motion, tuple(phases), events, plane, 2 if keeps_jerk else 1)


def _jerk_of_law(limits: ToolLimits, *, angular: bool) -> tuple[LawJerkConstraint, ...]:
    """Return the constraint of the jerk of the tool along its path; none where it has no limit, or rests."""
    return () if angular or math.isinf(limits.jerk) else (LawJerkConstraint(limits.jerk),)


def _moving(curve: PiecewisePolynomial) -> NDArray[np.bool_]:
    """Return which joints move along a path, shape (n,)."""
    return np.asarray(np.abs(curve.piece_ends(1)).max(axis=(0, 1)) > 0)


def _events(solved: TimeOptimalMotion, robot: Robot, remaining: float, *, fastest: bool) -> tuple[Event, ...]:
    """Return how a law was found, how good it is, and where it stops."""
    events = []
    if isinstance(solved, JerkLimitedMotion):
        events.append(solved_by_convex_steps(solved))
        if solved.stops.size:
            count = solved.stops.size
            text = f"stops {count} time{'s' * (count != 1)} where the path bends: limits of jerk ask for it"
            events.append(Event("stops", text))
    elif solved.refinements:
        text = f"the grid was refined {solved.refinements} times, to {solved.grid.size} grid points"
        events.append(Event("refined", text))
    if fastest:
        events.append(distance_from_bound(solved, robot, remaining))
    stretch = solved.stretch * remaining
    if stretch > 1 + LITTLE:
        events.append(stretched(stretch))
    return tuple(events)


def _remaining_stretch(robot: Robot, trajectory: PiecewisePolynomial, limits: ToolLimits) -> float:
    """Return how many times longer the motion must last to keep the tool's limits, as checks judge them."""
    tcp = replace(limits, jerk=np.inf, angular_jerk=np.inf)
    limited = replace(robot, limits=replace(robot.limits, tcp=tcp))
    if not limits_tool(limited):
        return 1.0
    peaks = tool_peaks(limited, trajectory.breaks, trajectory.coefficients)
    kinds = [kind for kind in TOOL_KINDS if kind.key in peaks]
    factors = [(peaks[k.key].most / getattr(limits, k.key)) ** (1 / (k.order or 1)) for k in kinds]
    worst = max(factors, default=1.0)
    return float(worst) if worst > 1 + TOOL_RELATIVE else 1.0


def limits_of_law(spec: LawSpec, limits: ToolLimits) -> ToolLimits:
    """Return the limits of the tool with those that a law names in their place."""
    given = spec.model_dump(
        include={"speed", "acceleration", "jerk", "angular_speed", "angular_acceleration"}
    )
    return ToolLimits(**{**vars(limits), **{name: v for name, v in given.items() if v is not None}})


def _require_acceleration(curve: PiecewisePolynomial, robot: Robot, planner: str) -> None:
    lacking = np.flatnonzero(_moving(curve) & lacks_acceleration(robot))
    if lacking.size:
        why = "for the fastest law"
        raise missing_limit(planner, "acceleration", lacking.tolist(), robot, why, "use another law `shape`")


class KnownTool(Protocol):
    """Poses of a tool by s."""

    @property
    def length(self) -> float:
        """Last s."""
        ...

    @property
    def poses(self) -> KnownPoses:
        """By s."""
        ...


class KnownPoses(Protocol):
    """Poses and their derivatives by s."""

    def evaluate(self, s: Array, side: Side = "right") -> tuple[Array, Array, Array]:
        """Return X (N, 4, 4), X' and X'' (N, 6) at s (N,)."""
        ...


@frozen
class ToolConstraint:
    """Limits of the tool along a path.

    Attributes:
        path: Of the tool.
        limits: Of its speed and acceleration, linear and angular.
    """

    estimate: ClassVar[float] = 1.0

    path: KnownTool
    limits: ToolLimits

    @property
    def bounds_sdd(self) -> bool:
        """Whether some acceleration is bounded."""
        return bool(np.isfinite([self.limits.acceleration, self.limits.angular_acceleration]).any())

    def rows(self, s: Array, side: Side) -> ConstraintRows:
        """Return rows and caps at points (p,) of the path.

        An acceleration is the sum of one along the path and one across it: the circle of those that are
        allowed is replaced by a polygon inside it, at most 2 % smaller. Across its axis a rotation gets 0.8,
        along 0.6.
        """
        limits = self.limits
        _, first, second = self.path.poses.evaluate(np.clip(s, 0.0, self.path.length), side)
        tangent, turning = (np.linalg.norm(first[:, part], axis=1) for part in (slice(0, 3), slice(3, 6)))
        curvature = np.linalg.norm(second[:, :3], axis=1)
        linear = _translation_rows(tangent, curvature, limits.acceleration)
        angular = _rotation_rows(first[:, 3:], second[:, 3:], turning, limits.angular_acceleration)
        with np.errstate(divide="ignore"):
            speed = np.minimum(limits.speed / tangent, limits.angular_speed / turning)
        cap = np.minimum(speed**2, angular[3])
        joined = [np.concatenate(pair, axis=1) for pair in zip(linear, angular[:3], strict=True)]
        return ConstraintRows(joined[0], joined[1], joined[2], cap)

    def largest(self, s: Array, side: Side) -> Array:
        """Return the largest sd^2 at points (p,), by speeds and by the accelerations across the path."""
        limits = self.limits
        _, first, second = self.path.poses.evaluate(np.clip(s, 0.0, self.path.length), side)
        tangent, turning = (np.linalg.norm(first[:, part], axis=1) for part in (slice(0, 3), slice(3, 6)))
        with np.errstate(divide="ignore"):
            speed = np.minimum(limits.speed / tangent, limits.angular_speed / turning)
            bend = limits.acceleration / np.linalg.norm(second[:, :3], axis=1)
        return np.asarray(np.minimum(speed**2, bend))

    def shortest(self, s: Array) -> Array:
        """Return the times, s, that straight ways and turns between points (p,) take at least, (p - 1,)."""
        poses, _, _ = self.path.poses.evaluate(np.clip(s, 0.0, self.path.length), "right")
        chords = np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1)
        turned = poses[:-1, :3, :3].transpose(0, 2, 1) @ poses[1:, :3, :3]
        angles = axis_angle_from_matrix(turned).angle
        return np.asarray(np.maximum(chords / self.limits.speed, angles / self.limits.angular_speed))

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


def _translation_rows(tangent: Array, curvature: Array, limit: float) -> tuple[Array, Array, Array]:
    """Return a, b and c of rows a sdd + b sd^2 <= c, each (N, k), of the acceleration of the tcp."""
    count = tangent.size
    if not curvature.any():
        ones = np.ones((count, 1)) * tangent[:, None]
        return np.hstack([ones, -ones]), np.zeros((count, 2)), np.full((count, 2), limit)
    angles = np.pi * (np.arange(_CORNERS // 2) + 0.5) / (_CORNERS // 2)
    apothem = limit * math.cos(math.pi / _CORNERS)
    return (
        tangent[:, None] * np.cos(angles),
        curvature[:, None] * np.sin(angles),
        np.full((count, angles.size), apothem),
    )


def _rotation_rows(
    first: Array, second: Array, turning: Array, limit: float
) -> tuple[Array, Array, Array, Array]:
    """Return the same of the angular acceleration, each (N, 2), and upper bounds (N,) of sd^2."""
    axis = first / np.where(turning > 0, turning, 1.0)[:, None]
    along = (second * axis).sum(axis=1)
    across = np.linalg.norm(second - axis * along[:, None], axis=1)
    across = np.where(across > _EVEN * turning**2, across, 0.0)
    bent = bool(across.any())
    a = np.stack([turning, -turning], axis=1)
    b = np.stack([along, -along], axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        cap = np.where(across > 0, 0.8 * limit / across, np.inf)
    return a, b, np.full((turning.size, 2), (0.6 if bent else 1.0) * limit), cap
