"""Courses: moves as joints q(s) along a path, and the bounds that limits of joints and tool set their law.

Along a path qd = q' sd, qdd = q' sdd + q'' sd^2 and qddd = q' sddd + 3 q'' sd sdd + q''' sd^3. About a speed
and an acceleration of the law the terms of bends are known, and bounds of one variable are left.

Source: Biagiotti and Melchiorri (2008), section 9.5.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import cached_property

import numpy as np

from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.curves.third_order.jerk import ThirdOrderConstraint
from trajcli.curves.time_optimal.constraints import PathConstraint
from trajcli.frozen import frozen
from trajcli.kinematics.following.motion import ToolMotion
from trajcli.kinematics.following.tool_path import ToolPath
from trajcli.kinematics.robot import Limits, Robot, ToolLimits
from trajcli.limits.kinds import path_constraints
from trajcli.planners.tool_constraint import ToolConstraint, ToolJerkConstraint, ToolOfJoints

_SAMPLES = 9  # of a path, its ends included
_BEND = 0.9  # of an acceleration, or of a jerk, that a bend of the path may take
_LEFT = 0.1  # of a jerk that is left for the law


BoundsAbout = Callable[[Array], Array]
"""Bounds of a law about states (N, 2): lower and upper ones of sd, sdd and sddd, (N, 6)."""


@frozen
class PathRates:
    """Derivatives of joints and tool by s, at m values of s.

    Attributes:
        joints: q', q'' and q''', shape (3, m, n).
        tool: Sizes of p', p'', w and w', shape (4, m); None where nothing limits the tool.
        speeds: Limits of the tool's two speeds there; None where they do not step along the path.
    """

    joints: Array
    tool: Array | None
    speeds: tuple[float, float] | None = None


@frozen
class PassedPoints:
    """Points that a path passes between its ends.

    Attributes:
        s: Where, shape (m,).
        points: Shape (m, n), rad or m.
        missed: The distance at which each joint passes each point, shape (m, n).
    """

    s: Array
    points: Array
    missed: Array


class Course(ABC):
    """A move as joints along a path.

    Attributes:
        curve: q(s) from s = 0.
        robot: With the limits in force.
        passed: Points that it passes between its ends; None where it has none.
    """

    curve: PiecewisePolynomial
    robot: Robot
    passed: PassedPoints | None = None

    @property
    @abstractmethod
    def tcp(self) -> ToolLimits:
        """Limits of the tool along it, those of its own law among them."""

    @property
    def limits_tool(self) -> bool:
        """Whether something limits the tool along it."""
        return self.tcp != ToolLimits()

    @property
    def length(self) -> float:
        """Last s."""
        return self.curve.end

    @property
    def straight(self) -> bool:
        """Whether its joints go straight."""
        return self.curve.degree == 1 and self.curve.pieces == 1

    @property
    def uniform(self) -> bool:
        """Whether its bounds are the same everywhere."""
        return self.straight and not self.limits_tool

    @property
    def limits_along(self) -> tuple[float, float, float] | None:
        """Limits of sd, sdd and -sdd by those of the tool, where s is the length of its path; else None."""
        return None

    @property
    def jerk_constraints(self) -> tuple[ThirdOrderConstraint, ...]:
        """The limits of the jerk of the tool along it, as far as laws keep them."""
        return ()

    @property
    @abstractmethod
    def tool(self) -> ToolPath | ToolOfJoints:
        """The tool along it."""

    def tool_rates(self, s: Array) -> Array:
        """Return sizes of p', p'', w and w' at s (m,), (4, m)."""
        _, *rates = self.tool.poses.evaluate(np.clip(s, 0.0, self.tool.length))
        sizes = np.linalg.norm(np.reshape(rates, (2, -1, 2, 3)), axis=3)
        return np.asarray(sizes.transpose(2, 0, 1).reshape(4, -1))

    @abstractmethod
    def tool_constraint(self) -> PathConstraint:
        """Return the limits of the tool along it."""

    @abstractmethod
    def reference(self, law: PiecewisePolynomial) -> ToolMotion | None:
        """Return the reference of the tool under a law s(t), where it has one."""

    def rates(self, s: Array) -> PathRates:
        """Return derivatives at s (m,)."""
        joints = self.curve.evaluate_orders(np.clip(s, 0.0, self.length), (1, 2, 3)).transpose(1, 0, 2)
        return PathRates(joints, self.tool_rates(s) if self.limits_tool else None)

    def bounds(self, rates: PathRates) -> BoundsAbout:
        """Return the bounds of its law where it has such rates, as `law_bounds`."""
        return law_bounds(rates, self.robot.limits, self.tcp)

    def typical_bounds(self, low: float, high: float) -> Array:
        """Return the bounds of one variable that stand for those from one s to another, (6,).

        They are the geometric means of those at some s, exact where they are the same everywhere.
        """
        found = self._typical_bounds.get((low, high))
        if found is not None:
            return found
        some = np.linspace(low, high, 1 if self.uniform else _SAMPLES).tolist()
        rows = np.concatenate([self.bounds(self.rates(np.array([s])))(np.zeros((1, 2))) for s in some])
        sizes = np.abs(rows)
        with np.errstate(divide="ignore"):
            means = np.exp(np.log(sizes).mean(axis=0))
        self._typical_bounds[low, high] = means * [-1.0, 1.0, -1.0, 1.0, -1.0, 1.0]
        return self._typical_bounds[low, high]

    @cached_property
    def _typical_bounds(self) -> dict[tuple[float, float], Array]:
        """What `typical_bounds` has returned: a chain is searched many times."""
        return {}

    def constraints(self, path: PiecewisePolynomial) -> tuple[PathConstraint, ...]:
        """Return what limits laws along a part of its path besides the rates of joints."""
        tool = (self.tool_constraint(),) if self.limits_tool else ()
        return (*tool, *path_constraints(path, self.robot))


def law_bounds(rates: PathRates, limits: Limits, tcp: ToolLimits) -> BoundsAbout:
    """Return the bounds of a law under which all limits are kept where it has given speeds.

    Args:
        rates: Of the path, at m values of s: the tightest count.
        limits: Of the joints.
        tcp: Of the tool.
    """
    first, second, third = rates.joints
    low, high = limits.acceleration.T
    jerk = np.abs(limits.jerk).min(axis=1)
    size = np.abs(first)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        top = _largest_speed(rates, limits, tcp, size)
    sign = np.where(first > 0, 1.0, -1.0)
    ends = np.where(sign > 0, -low, high), np.where(sign > 0, high, -low)
    thrice, unlimited, left = 3 * second, np.isinf(jerk), _LEFT * jerk

    def about(states: Array) -> Array:
        speed, change = np.minimum(states[:, 0], top)[:, None, None], states[:, 1, None, None]
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            bent = sign * (second * speed**2)
            used = sign * (thrice * speed * change + third * speed**3)
            jerks = [np.where(unlimited, np.inf, np.maximum(jerk + each, left)) for each in (used, -used)]
            sides = np.stack([ends[0] + bent, ends[1] - bent, *jerks]) / size
            rows = list(np.fmin.reduce(sides, axis=(2, 3), initial=np.inf))  # 0 / 0 bounds nothing
            if rates.tool is not None:
                rows = _with_tool(rates.tool, tcp, states, rows)
        top_row, sizes = np.full(len(states), top), np.maximum(rows, 0.0)
        return np.stack([-top_row, top_row, -sizes[0], sizes[1], -sizes[2], sizes[3]], axis=1)

    return about


def _largest_speed(rates: PathRates, limits: Limits, tcp: ToolLimits, size: Array) -> float:
    """Return the largest sd by the speeds of joints and tool, and by what bends of the path take."""
    first, second, third = rates.joints
    low, high = limits.acceleration.T
    jerk = np.abs(limits.jerk).min(axis=1)
    rows = [
        np.where(first > 0, limits.velocity[:, 1], -limits.velocity[:, 0]) / size,
        np.sqrt(_BEND * np.minimum(high, -low) / np.abs(second)),
        np.cbrt(_BEND * jerk / np.abs(third)),
    ]
    if rates.tool is not None:
        tool = rates.tool
        rows += [
            tcp.speed / tool[0],
            tcp.angular_speed / tool[2],
            np.sqrt(_BEND * tcp.acceleration / tool[1]),
            np.sqrt(_BEND * tcp.angular_acceleration / tool[3]),
        ]
    return min(float(np.where(np.isnan(row), np.inf, row).min()) for row in rows)


def _with_tool(tool: Array, tcp: ToolLimits, states: Array, rows: list[Array]) -> list[Array]:
    """Return bounds of -sdd, sdd, -sddd and sddd, each (N,), with those that limits of the tool set."""
    lower, upper, *left = rows
    speed = states[:, :1]
    for limit, along, across in (
        (tcp.acceleration, tool[0], tool[1]),
        (tcp.angular_acceleration, tool[2], tool[3]),
    ):
        if np.isfinite(limit):
            bent = np.minimum(across * speed**2, _BEND * limit)
            allowed = (np.sqrt(limit**2 - bent**2) / along).min(axis=1)
            lower, upper = np.minimum(lower, allowed), np.minimum(upper, allowed)
    if np.isfinite(tcp.jerk):
        left = [np.minimum(each, float((tcp.jerk / tool[0]).min())) for each in left]
    return [lower, upper, *left]


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
