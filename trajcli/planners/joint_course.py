"""Paths in joint space as courses, straight lines among them, and the tool along them."""

from __future__ import annotations

import numpy as np

from trajcli.curves.piecewise import Array, PiecewisePolynomial, Side
from trajcli.curves.third_order.jerk import ThirdOrderConstraint
from trajcli.curves.time_optimal.constraints import PathConstraint
from trajcli.frozen import frozen
from trajcli.kinematics.following.motion import ToolMotion
from trajcli.kinematics.forward import forward
from trajcli.kinematics.robot import Robot, ToolLimits
from trajcli.kinematics.tool_derivatives import tool_derivatives
from trajcli.planners.course import Course, PassedPoints
from trajcli.planners.tool_constraint import ToolConstraint, ToolJerkConstraint


@frozen
class ToolOfJoints:
    """Poses of the tool where the joints are known by s.

    Attributes:
        curve: q(s).
        robot: The arm.
    """

    curve: PiecewisePolynomial
    robot: Robot

    @property
    def length(self) -> float:
        """Last s."""
        return self.curve.end

    @property
    def poses(self) -> ToolOfJoints:
        """Itself."""
        return self

    def evaluate(self, s: Array, side: Side = "right") -> tuple[Array, Array, Array]:
        """Return the poses (N, 4, 4), and their first and second derivatives by s, (N, 6), at s (N,)."""
        rows = self.curve.evaluate_orders(s, (0, 1, 2), side=side)
        found = tool_derivatives(self.robot, [rows[:, order] for order in range(3)])
        joined = found.reshape(len(s), 2, 6)
        return forward(self.robot, rows[:, 0]), joined[:, 0], joined[:, 1]

    def derivatives(self, s: Array, side: Side = "right") -> Array:
        """Return v by s, w by s and their first two derivatives at s (N,), shape (3, 2, N, 3)."""
        rows = self.curve.evaluate_orders(s, (0, 1, 2, 3), side=side)
        return tool_derivatives(self.robot, [rows[:, order] for order in range(4)]).transpose(1, 2, 0, 3)


@frozen
class JointCourse(Course):
    """A path in joint space.

    Attributes:
        curve: q(s): of a straight line one piece of degree 1, s from 0 to 1.
        robot: With the limits in force.
        passed: Points that the path passes between its ends, each with its s, and by how much it misses them.
    """

    curve: PiecewisePolynomial
    robot: Robot
    passed: PassedPoints | None = None

    @property
    def tcp(self) -> ToolLimits:
        """Limits of the tool."""
        return self.robot.limits.tcp

    @property
    def tool(self) -> ToolOfJoints:
        """The tool along it."""
        return ToolOfJoints(self.curve, self.robot)

    def tool_constraint(self) -> PathConstraint:
        """Return the limits of the tool along it."""
        return ToolConstraint(self.tool, self.tcp, oblique=True)

    @property
    def jerk_constraints(self) -> tuple[ThirdOrderConstraint, ...]:
        """The limits of the jerk of the tool."""
        jerk = self.tcp.jerk, self.tcp.angular_jerk
        if not np.isfinite(jerk).any():
            return ()
        return (ToolJerkConstraint(self.tool, jerk),)

    def reference(self, law: PiecewisePolynomial) -> ToolMotion | None:
        """Return nothing: its tool follows the joints."""
        del law
        return None


def joint_line(start: Array, end: Array, robot: Robot) -> JointCourse:
    """Return the straight line between joint values (n,)."""
    coefficients = np.stack([end - start, start])[:, None, :]
    return JointCourse(PiecewisePolynomial(np.array([0.0, 1.0]), coefficients), robot)
