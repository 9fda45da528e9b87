"""Time-optimal law along a path of the tool, under the limits of joints and tool.

Source: Pham and Pham (2018).
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.operations import scale_time
from trajcli.curves.piecewise import PiecewisePolynomial, distinct
from trajcli.curves.third_order.jerk import LawJerkConstraint, ThirdOrderConstraint
from trajcli.curves.third_order.parameterization import JerkLimitedMotion, jerk_limited_time_optimal
from trajcli.curves.time_optimal.constraints import JointConstraint, PathConstraint
from trajcli.curves.time_optimal.parameterization import TimeOptimalMotion, time_optimal
from trajcli.curves.time_optimal.phase_plane import PhasePlane, switching_structure
from trajcli.kinematics.following.motion import motion_along
from trajcli.kinematics.following.tolerance import Tolerance, probes
from trajcli.kinematics.following.tool_path import SpeedLimits
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
from trajcli.planners.law_events import distance_from_bound, how_found
from trajcli.planners.planner import LITTLE, Event, Phase, stretched
from trajcli.planners.tool_constraint import ToolConstraint, ToolJerkConstraint, ToolOfJoints
from trajcli.planners.tool_path.follow import FollowedPath, JointMotion
from trajcli.planners.tool_path.law import LawSpec


def fastest_along(joints: FollowedPath, spec: LawSpec, tolerance: Tolerance, planner: str) -> JointMotion:
    """Return the fastest motion along a path within the limits of joints and tool.

    Args:
        joints: Along the path.
        spec: What it names replaces the limits of the tool; of a weave it is about the seam.
        tolerance: How near the joints' curve must be.
        planner: Tag for messages.

    Raises:
        MissingLimitError: When a moving joint has no limit of acceleration.
        PlanningError: When the joints cannot follow.
    """
    robot, path = joints.robot, joints.path
    curve = joints.by_s(tolerance)
    _require_acceleration(curve, robot, planner)
    limits, tcp = robot.limits, limits_of_law(spec, robot.limits.tcp, path.speeds)
    turns, led, seam = path.poses.pure_rotation, tcp, path.seam
    with joints.diagnosed():
        further: tuple[PathConstraint, ...] = path_constraints(curve, robot)
        if seam is not None and path.speeds is None:  # the law is of the seam
            led = ToolLimits(speed=spec.speed or math.inf, acceleration=spec.acceleration or math.inf)
            tcp = replace(tcp, speed=limits.tcp.speed, acceleration=limits.tcp.acceleration)
            further = (ToolConstraint(seam, led), *further)
        further = (ToolConstraint(joints.limited_by(tcp), tcp, path.speeds, seam is not None), *further)
        along = (led.angular_speed, led.angular_acceleration) if turns else (led.speed, led.acceleration)
        of_jerk = jerk_constraints(joints, curve, spec)
        keeps_jerk = bool(of_jerk) or _moving(curve)[np.isfinite(limits.jerk).any(axis=1)].any()

        def solve(efforts: tuple[PathConstraint, ...]) -> TimeOptimalMotion:
            every, bounds = (*further, *efforts), (limits.velocity, limits.acceleration)
            if not keeps_jerk:
                return time_optimal(curve, *bounds, further=every, along=along)
            return jerk_limited_time_optimal(
                curve, *bounds, limits.jerk, further=every, further_jerk=of_jerk, along=along
            )

        solved = solved_within_efforts(curve, robot, solve)
        remaining = _remaining_stretch(robot, solved, tcp, path.speeds)
    factor = max(remaining, (spec.minimum_duration or 0.0) / solved.trajectory.duration)
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
    of_joints = JointConstraint(curve, limits.velocity, limits.acceleration)
    constraints = (of_joints, *further, *effort_constraints(curve, robot))
    breaks = distinct(np.concatenate([curve.breaks, path.breaks]))
    dimension: Literal["length", "angle"] = "angle" if turns else "length"
    plane = PhasePlane(law, constraints, breaks, solved.stops, dimension)
    return JointMotion(trajectory, motion, tuple(phases), events, plane, 2 if keeps_jerk else 1)


def jerk_constraints(
    joints: FollowedPath, curve: PiecewisePolynomial, spec: LawSpec
) -> tuple[ThirdOrderConstraint, ...]:
    """Return what limits the jerk of the tool, and of its law, along a path.

    Along a straight line the jerk of the tool is that of the law, and one that the law names takes its place.

    Args:
        joints: Along the path.
        curve: q(s).
        spec: The law.
    """
    robot, limits = joints.robot, joints.robot.limits.tcp
    _, first, second = joints.path.poses.evaluate(probes(joints.path.breaks), "right")
    straight = not second[:, :3].any()
    along = (limits.jerk if spec.jerk is None else spec.jerk) if straight else spec.jerk or math.inf
    of_tool = (math.inf if straight else limits.jerk), limits.angular_jerk
    found = list[ThirdOrderConstraint]()
    if math.isfinite(along) and first[:, :3].any():
        found.append(LawJerkConstraint(along))
    if np.isfinite(of_tool).any():
        found.append(ToolJerkConstraint(ToolOfJoints(curve, robot), of_tool))
    return tuple(found)


def _moving(curve: PiecewisePolynomial) -> NDArray[np.bool_]:
    """Return which joints move along a path, shape (n,)."""
    return np.asarray(np.abs(curve.piece_ends(1)).max(axis=(0, 1)) > 0)


def _events(solved: TimeOptimalMotion, robot: Robot, remaining: float, *, fastest: bool) -> tuple[Event, ...]:
    events, count = how_found(solved), solved.stops.size
    if count and isinstance(solved, JerkLimitedMotion):
        text = f"stops {count} time{'s' * (count != 1)} where the path bends: limits of jerk ask for it"
        events.append(Event("stops", text))
    if fastest:
        events.append(distance_from_bound(solved, robot, remaining))
    stretch = solved.stretch * remaining
    if stretch > 1 + LITTLE:
        events.append(stretched(stretch))
    return tuple(events)


def _remaining_stretch(
    robot: Robot, solved: TimeOptimalMotion, limits: ToolLimits, speeds: SpeedLimits | None
) -> float:
    """Return how many times longer the motion must last to keep the tool's limits, as checks judge them."""
    worst = _stretch_of_whole(robot, solved.trajectory, limits)
    if speeds is not None:
        worst = max(worst, _stretch_by_segment(robot, solved, speeds))
    return worst if worst > 1 + TOOL_RELATIVE else 1.0


def _stretch_of_whole(robot: Robot, trajectory: PiecewisePolynomial, limits: ToolLimits) -> float:
    tcp = replace(limits, jerk=np.inf, angular_jerk=np.inf)
    limited = replace(robot, limits=replace(robot.limits, tcp=tcp))
    if not limits_tool(limited):
        return 1.0
    peaks = tool_peaks(limited, trajectory.breaks, trajectory.coefficients)
    kinds = [kind for kind in TOOL_KINDS if kind.key in peaks]
    factors = [(peaks[k.key].upper_bound / getattr(limits, k.key)) ** (1 / (k.order or 1)) for k in kinds]
    return max(factors, default=1.0)


def _stretch_by_segment(robot: Robot, solved: TimeOptimalMotion, speeds: SpeedLimits) -> float:
    from trajcli.limits.tool_bound import speed_runs

    return max(
        peak.upper_bound / limit
        for run in speed_runs(robot, speeds, solved.law, solved.trajectory)
        for peak, limit in zip(run.peaks, run.limits, strict=True)
    )


def limits_of_law(spec: LawSpec, limits: ToolLimits, speeds: SpeedLimits | None = None) -> ToolLimits:
    """Return the limits of the tool with those that a law names in their place.

    Args:
        spec: The law.
        limits: Of the tool.
        speeds: Where they step along the path; the highest count.
    """
    given = spec.model_dump(include=set(vars(limits)), exclude_none=True)
    tcp = replace(limits, **given)
    if speeds is None:
        return tcp
    return replace(tcp, speed=float(speeds.speed.max()), angular_speed=float(speeds.angular_speed.max()))


def _require_acceleration(curve: PiecewisePolynomial, robot: Robot, planner: str) -> None:
    lacking = np.flatnonzero(_moving(curve) & lacks_acceleration(robot))
    if lacking.size:
        why = "for the fastest law"
        raise missing_limit(planner, "acceleration", lacking.tolist(), robot, why, "use another law `shape`")
