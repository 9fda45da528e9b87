"""Paths of the tool as courses that can begin and end in motion."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.curves.third_order.jerk import ThirdOrderConstraint
from trajcli.curves.time_optimal.constraints import PathConstraint
from trajcli.frozen import frozen
from trajcli.kinematics.following.motion import ToolMotion, motion_along
from trajcli.kinematics.following.tolerance import Tolerance
from trajcli.kinematics.following.tool_path import ToolPath
from trajcli.kinematics.robot import Robot, ToolLimits
from trajcli.planners.course import BoundsAbout, Course, PathRates, law_bounds
from trajcli.planners.tool_constraint import ToolConstraint
from trajcli.planners.tool_path.follow import FollowedPath
from trajcli.planners.tool_path.law import LawSpec
from trajcli.planners.tool_path.time_optimal import jerk_constraints, limits_of_law

_SAMPLES = 33  # of a path, at which it is looked at whether s is its length
_AWAY = 1e-6  # relative: lengths that differ by more are two


@frozen
class ToolCourse(Course):
    """Joints along a path of the tool.

    Attributes:
        curve: q(s).
        robot: With the limits in force.
        joints: Along the path.
        law: What the move says of its law.
        tolerance: How near the joints' curve must be.
    """

    curve: PiecewisePolynomial
    robot: Robot
    joints: FollowedPath
    law: LawSpec
    tolerance: Tolerance

    @property
    def tcp(self) -> ToolLimits:
        """Limits of the tool along it, those of its own law among them; the highest where they step."""
        return limits_of_law(self.law, self.robot.limits.tcp, self.joints.path.speeds)

    @property
    def limits_tool(self) -> bool:
        """Whether something limits the tool along it."""
        return self.joints.path.speeds is not None or super().limits_tool

    @property
    def deceleration(self) -> float:
        """Largest -sdd by its law, which says none of a turn in place."""
        given = self.law.deceleration
        return math.inf if given is None or self.joints.path.poses.pure_rotation else given

    @property
    def limits_along(self) -> tuple[float, float, float] | None:
        """Limits of sd, sdd and -sdd by those of the tool; None where the tool goes another way than s.

        s is the length of the path, or its angle; where a coordinate is free the tool may go less far.
        """
        tcp = self.tcp
        turns = self.joints.path.poses.pure_rotation
        sizes = self.tool_rates(np.linspace(0.0, self.length, _SAMPLES))[2 if turns else 0]
        if (np.abs(sizes - 1.0) > _AWAY).any():
            return None
        speed, change = (
            (tcp.angular_speed, tcp.angular_acceleration) if turns else (tcp.speed, tcp.acceleration)
        )
        return speed, change, min(change, self.deceleration)

    @property
    def jerk_constraints(self) -> tuple[ThirdOrderConstraint, ...]:
        """The limits of the jerk of the tool along it, and of its law."""
        return jerk_constraints(self.joints, self.curve, self.law)

    @property
    def tool(self) -> ToolPath:
        """The tool along it."""
        return self.joints.executed

    def tool_constraint(self) -> PathConstraint:
        """Return the limits of the tool along it."""
        speeds, tool = self.joints.path.speeds, self.joints.limited_by(self.tcp)
        return ToolConstraint(tool, self.tcp, speeds, deceleration=self.deceleration)

    def rates(self, s: Array) -> PathRates:
        """Return derivatives at s (m,), with the lowest limits of speed there, where these step."""
        rates, speeds = super().rates(s), self.joints.path.speeds
        if speeds is None:
            return rates
        sides = [np.stack(speeds.at(s, side)) for side in ("left", "right")]
        speed, angular_speed = np.min(sides, axis=(0, 2)).tolist()
        return replace(rates, speeds=(speed, angular_speed))

    def bounds(self, rates: PathRates) -> BoundsAbout:
        """Return the bounds of its law where it has such rates, with the deceleration that it names."""
        tcp = self.tcp
        if rates.speeds is not None:
            tcp = replace(tcp, speed=rates.speeds[0], angular_speed=rates.speeds[1])
        about, least = law_bounds(rates, self.robot.limits, tcp), np.full(6, -np.inf)
        least[2] = -self.deceleration
        return lambda states: np.maximum(about(states), least)

    def reference(self, law: PiecewisePolynomial) -> ToolMotion | None:
        """Return the reference of the tool under a law s(t)."""
        return motion_along(self.joints.path, law, law.breaks, self.tolerance, None)
