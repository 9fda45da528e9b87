"""Limits of the tool along a path, as rows of laws of second and of third order."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from trajcli.curves.piecewise import (
    Array,
    PiecewisePolynomial,
    Side,
    derivative_coefficients,
    horner,
)
from trajcli.curves.third_order.jerk import JerkRows, LawState
from trajcli.curves.time_optimal.constraints import ConstraintRows
from trajcli.curves.time_optimal.time_law import LawPieces
from trajcli.frozen import frozen
from trajcli.geometry.rotation import axis_angle_from_matrix
from trajcli.kinematics.following.tool_path import SpeedLimits, ToolPath
from trajcli.kinematics.forward import forward
from trajcli.kinematics.robot import Robot, ToolLimits
from trajcli.kinematics.tool_derivatives import tool_derivatives

_CORNERS = 16  # of the polygon inside the circle of accelerations
_BETWEEN = 6  # times in a piece at which the limits of the tool are looked at, its ends included
_TURNS = np.arange(16) * math.pi / 8
_AROUND = np.concatenate(  # directions of a frame in which a vector is bounded: a polygon, and square to it
    [np.stack([np.cos(_TURNS), np.sin(_TURNS), np.zeros(16)], axis=1), [[0, 0, 1], [0, 0, -1]]]
)
_FLAT = 1e-6  # of the square of a vector: less beside another one has no direction
_BESIDE = 1e-13  # of the length: so far before its end the last sample of an interval is
_EVEN = 1e-6  # of the square of the turning: an axis that changes by less stays


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
class ToolConstraint:
    """Limits of the tool along a path.

    Attributes:
        path: Of the tool.
        limits: Of its speed and acceleration, linear and angular.
        speeds: Limits of both speeds that step along the path, in their place; None where they do not.
        oblique: Whether p'' has a part along p' that counts, as where s is not the arc length.
        deceleration: Largest -sdd.
    """

    estimate: ClassVar[float] = 1.0

    path: ToolPath | ToolOfJoints
    limits: ToolLimits
    speeds: SpeedLimits | None = None
    oblique: bool = False
    deceleration: float = math.inf

    @property
    def bounds_sdd(self) -> bool:
        """Whether some acceleration is bounded."""
        limits = self.limits
        return min(limits.acceleration, limits.angular_acceleration, self.deceleration) < math.inf

    def rows(self, s: Array, side: Side) -> ConstraintRows:
        """Return rows and caps at points (p,) of the path.

        An acceleration is the sum of one along the path and one across it: the circle of those that are
        allowed is replaced by a polygon inside it, at most 2 % smaller. Across its axis a rotation gets 0.8,
        along 0.6.
        """
        limits = self.limits
        first, second, tangent, turning, speed = self._rates(s, side)
        curvature = np.linalg.norm(second[:, :3], axis=1)
        along = self._along(first, second)
        linear = _translation_rows(tangent, along, curvature, limits.acceleration)
        angular = _rotation_rows(first[:, 3:], second[:, 3:], turning, limits.angular_acceleration)
        cap = np.minimum(speed**2, angular[3])
        slowing = [np.full((s.size, 1), each) for each in (-1.0, 0.0, self.deceleration)]
        a, b, c = (np.hstack(each) for each in zip(linear, angular[:3], slowing, strict=True))
        return ConstraintRows(a, b, c, cap)

    def largest(self, s: Array, side: Side) -> Array:
        """Return the largest sd^2 at points (p,), by speeds and by the accelerations across the path."""
        first, second, _, _, speed = self._rates(s, side)
        curvature = np.linalg.norm(second[:, :3], axis=1)
        with np.errstate(divide="ignore"):
            bend = self.limits.acceleration / _across(self._along(first, second), curvature)
        return np.asarray(np.minimum(speed**2, bend))

    def _rates(self, s: Array, side: Side) -> tuple[Array, Array, Array, Array, Array]:
        """Return X' and X'' (N, 6), the sizes of p' and w', and the largest sd by both speeds, each (N,)."""
        _, first, second = self.path.poses.evaluate(np.clip(s, 0.0, self.path.length), side)
        tangent, turning = (np.linalg.norm(first[:, part], axis=1) for part in (slice(0, 3), slice(3, 6)))
        highest, most_angular = self._speeds(s, side)
        with np.errstate(divide="ignore"):
            speed = np.minimum(highest / tangent, most_angular / turning)
        return first, second, tangent, turning, speed

    def shortest(self, s: Array) -> Array:
        """Return the times, s, that straight ways and turns between points (p,) take at least, (p - 1,)."""
        poses, _, _ = self.path.poses.evaluate(np.clip(s, 0.0, self.path.length), "right")
        chords = np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1)
        turned = poses[:-1, :3, :3].transpose(0, 2, 1) @ poses[1:, :3, :3]
        angles = axis_angle_from_matrix(turned).angle
        speed, angular = (
            (self.limits.speed, self.limits.angular_speed)
            if self.speeds is None
            else self.speeds.most_between(s)
        )
        return np.asarray(np.maximum(chords / speed, angles / angular))

    def excess(self, law: LawPieces) -> Array:
        """Return the shares of speed and acceleration used at samples of each piece, shape (2, N)."""
        (s, sd, sdd), shape = _samples_of(law, self.path.length, 3)
        _, first, second = self.path.poses.evaluate(s, "right")
        rate, change = sd[:, None], sdd[:, None]
        acceleration = second * rate**2 + first * change
        used = _used(first * rate, acceleration, self._speeds(s, "right"), self.limits)
        used[1] = np.maximum(used[1], -sdd / self.deceleration)
        return np.asarray(used.reshape(2, *shape).max(axis=1))

    def _along(self, first: Array, second: Array) -> Array:
        """Return the part of p'' along p' at rows X' and X'' (N, 6), signed (N,); zero unless it counts."""
        if not self.oblique:
            return np.zeros(len(first))
        p, bend = first[:, :3], second[:, :3]
        size = np.linalg.norm(p, axis=1)
        return np.asarray((p * bend).sum(axis=1) / np.where(size > 0, size, 1.0))

    def _speeds(self, s: Array, side: Side) -> tuple[Array, Array]:
        """Return the limits of both speeds at s (N,), each (N,)."""
        if self.speeds is not None:
            return self.speeds.at(s, side)
        return np.full(s.size, self.limits.speed), np.full(s.size, self.limits.angular_speed)


@frozen
class ToolJerkConstraint:
    """Limits of the jerk of the tool along a path, of its size in space.

    Each is kept in the direction of the jerk of the law at hand, in 15 more of the plane of both this and
    the path, and square to it: a box would let the law jump from corner to corner.

    Attributes:
        path: Of the tool.
        jerk: The limits, m/s^3 and rad/s^3; infinite for none.
    """

    curved: ClassVar[bool] = True

    path: ToolOfJoints
    jerk: tuple[float, float]

    def rows(self, state: LawState, side: Side) -> JerkRows:
        """Return the rows at p points of the path about a law there."""
        s, v, a, u = state
        orders = self.path.derivatives(np.clip(s, 0.0, self.path.length), side)
        limited = [part for part, limit in enumerate(self.jerk) if math.isfinite(limit)]
        rows = list[Array]()
        for part in limited:
            frame = _frame(_jerk(orders[:, part], (v, a, u)), orders[0, part])
            rows.append((_AROUND @ frame) @ orders[:, part, :, :, None])
        first, second, third = np.concatenate(rows, axis=2)[..., 0]
        limits = np.repeat([self.jerk[part] for part in limited], len(_AROUND))
        return JerkRows(first, second, third, np.broadcast_to(limits, first.shape))

    def excess(self, law: LawPieces) -> Array:
        """Return the largest share of the limits used at samples of each piece, shape (N,)."""
        states, shape = _samples_of(law, self.path.length, 4)
        orders = self.path.derivatives(states[0], "right")
        sizes = [np.linalg.norm(_jerk(orders[:, part], states[1:]), axis=1) for part in (0, 1)]
        used = np.divide(sizes, np.array(self.jerk)[:, None]).max(axis=0)
        return np.asarray(used.reshape(shape).max(axis=0))


def _jerk(orders: Array, rates: Sequence[Array]) -> Array:
    """Return the jerk (p, 3) of a point with derivatives (3, p, 3) by s, under sd, sdd and sddd (p,)."""
    v, a, u = (rate[:, None] for rate in rates)
    return np.asarray(orders[0] * u + 3.0 * orders[1] * (v * a) + orders[2] * v**3)


def _frame(first: Array, second: Array) -> Array:
    """Return three unit vectors (p, 3, 3) square to each other, the first along (p, 3), by another one."""
    along = _unit(first, _unit(second, np.eye(3)[:1]))
    across = second - along * (along * second).sum(axis=1, keepdims=True)
    far = (across**2).sum(axis=1, keepdims=True) > _FLAT * (second**2).sum(axis=1, keepdims=True)
    across = np.where(far, across, np.cross(along, np.eye(3)[np.abs(along).argmin(axis=1)]))
    beside = _unit(across, across)
    return np.stack([along, beside, np.cross(along, beside)], axis=1)


def _unit(vectors: Array, otherwise: Array) -> Array:
    """Return vectors (p, 3) of size 1; others where they are zero."""
    sizes = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.where(sizes > 0, vectors / np.where(sizes > 0, sizes, 1.0), otherwise)


def _samples_of(law: LawPieces, length: float, count: int) -> tuple[list[Array], tuple[int, int]]:
    """Return s and its derivatives, `count` in all, each (m N,), at m times of N pieces; and (m, N)."""
    times = np.linspace(0.0, 1.0, _BETWEEN)[:, None] * law.durations
    s, *rates = (horner(derivative_coefficients(law.coefficients, order), times) for order in range(count))
    s = np.clip(np.maximum(np.minimum(s, s[-1] - _BESIDE * length), s[0]), 0.0, length)
    return [each.reshape(-1) for each in (s, *rates)], s.shape


def _used(velocity: Array, acceleration: Array, speeds: tuple[Array, Array], limits: ToolLimits) -> Array:
    """Return the shares of speed and acceleration (2, N) that twists and their derivatives (N, 6) use."""
    rows = np.stack([velocity, acceleration]).reshape(2, -1, 2, 3)
    highest = np.full((len(velocity), 2), [limits.acceleration, limits.angular_acceleration])
    return np.asarray((np.linalg.norm(rows, axis=3) / [np.stack(speeds, axis=1), highest]).max(axis=2))


def _across(along: Array, curvature: Array) -> Array:
    """Return the size of the part of p'' square to p', (N,)."""
    across = np.sqrt(np.maximum(curvature**2 - along**2, 0.0))
    return np.where(along == 0.0, curvature, across)


def _translation_rows(
    tangent: Array, along: Array, curvature: Array, limit: float
) -> tuple[Array, Array, Array]:
    """Return a, b and c of rows a sdd + b sd^2 <= c, each (N, k), of the acceleration of the tcp."""
    count = tangent.size
    if not curvature.any():
        ones = np.ones((count, 1)) * tangent[:, None]
        return np.hstack([ones, -ones]), np.zeros((count, 2)), np.full((count, 2), limit)
    angles = np.pi * (np.arange(_CORNERS // 2) + 0.5) / (_CORNERS // 2)
    apothem = limit * math.cos(math.pi / _CORNERS)
    bend = _across(along, curvature)[:, None] * np.sin(angles)
    if along.any():
        bend = bend + along[:, None] * np.cos(angles)
    return (
        tangent[:, None] * np.cos(angles),
        bend,
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
