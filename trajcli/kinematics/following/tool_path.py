"""Tool path, and the reference that it gives the tool: pose, twist and acceleration at any s or time."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from trajcli.curves.operations import times_at
from trajcli.curves.piecewise import Array, PiecewisePolynomial, Side, distinct
from trajcli.frozen import comparable, frozen
from trajcli.geometry.paths.orientation import SegmentProgress
from trajcli.geometry.paths.pose import PosePath
from trajcli.geometry.paths.position import nearest
from trajcli.geometry.rotation import AXES, AxisName
from trajcli.kinematics.inverse.target import IkTarget, OrientationConstraint

_AT_BREAK = 1e-12  # of the length: an s this near to a break is at it
_BESIDE = 1e-13  # of the length: how far before or after a break the tool is that is not at it
_SAME_TIME = 1e-12  # of the duration: a time this close to a break's is that time
_MERGED = 1e-9  # of the duration: breaks this close to each other are one
_LEVEL = 1e-12  # of a unit vector, squared: the heading of a vertical axis is not defined


@comparable
class PinnedJoint:
    """A joint that goes evenly with s.

    Attributes:
        joint: Its index.
        first: Its value where the path begins, rad or m.
        last: Its value where the path ends.
    """

    joint: int
    first: float
    last: float


@frozen
class ToolReference:
    """The tool at N values of s or of the time: what is fixed of it, and the first two derivatives of that.

    Attributes:
        poses: Shape (N, 4, 4), T_world_tcp; what is not fixed does not matter.
        first: Shape (N, 6), (v, w) at the tcp in world; m and rad per unit of the parameter.
        second: Shape (N, 6), its derivative.
        position: Which of x, y and z in world are fixed.
        orientation: What is fixed of the orientation, as in `IkTarget`.
        tool_axis: Which axis of the tcp is meant by direction, yaw and pitch.
        aims: Yaw or pitch with two derivatives, shape (N, 3), rad; (N, 0) otherwise.
        pinned: Joints whose values are given, too.
        pins: These values with two derivatives, shape (3, N, pinned); None for no such joint.
    """

    poses: Array
    first: Array
    second: Array
    position: tuple[bool, bool, bool]
    orientation: OrientationConstraint
    tool_axis: AxisName
    aims: Array
    pinned: tuple[int, ...] = ()
    pins: Array | None = None

    def target(self) -> IkTarget:
        """Return the targets, a flat batch of N."""
        aims = self.aims[:, :1]
        if self.orientation == "direction":
            aims = self.poses[:, :3, AXES.index(self.tool_axis)]
        return IkTarget(self.poses, self.position, self.orientation, self.tool_axis, aims)

    def rates(self) -> Array:
        """Return the rates (N, m) that the rows of `residual_jacobian` must have."""
        return self._six_rates(self.first[:, :3], self._turning_rates())

    def accelerations(self, poses: Array, bias: Array, twist: Array) -> Array:
        """Return what the rows of `residual_jacobian`, times qdd, must be, shape (N, m).

        Args:
            poses: The tcp as it is, (N, 4, 4): it may be turned about what is left free.
            bias: The part of its acceleration that does not come from qdd, (N, 6).
            twist: Its velocity, (N, 6).
        """
        linear = self.second[:, :3] - bias[:, :3]
        if self.orientation in ("all", "none"):
            return self._six_rates(linear, self.second[:, 3:] - bias[:, 3:])
        spin = twist[:, 3:]
        axis = poses[:, :3, AXES.index(self.tool_axis)]
        axis_rate = np.cross(spin, axis)
        drift = np.cross(bias[:, 3:], axis) + np.cross(spin, axis_rate)  # of the axis' second derivative
        if self.orientation == "direction":
            wanted = self._axis_acceleration()
            return self._six_rates(linear, np.cross(axis, wanted - drift))
        return self._six_rates(linear, self._angle_acceleration(axis, axis_rate, drift)[:, None])

    def _angle_acceleration(self, axis: Array, axis_rate: Array, drift: Array) -> Array:
        """Return what is left of the second derivative of yaw or pitch, shape (N,)."""
        level = np.maximum(np.square(axis[:, :2]).sum(axis=1), _LEVEL)
        level_rate = 2 * (axis[:, :2] * axis_rate[:, :2]).sum(axis=1)
        if self.orientation == "yaw":
            drifted = (axis[:, 0] * drift[:, 1] - axis[:, 1] * drift[:, 0]) / level
            return np.asarray(self.aims[:, 2] - drifted + self.aims[:, 1] * level_rate / level)
        root = np.sqrt(level)
        steeper = axis_rate[:, 2] * level_rate / (2 * level * root)
        return np.asarray(self.aims[:, 2] - drift[:, 2] / root + steeper)

    def _turning_rates(self) -> Array:
        spin = self.first[:, 3:]
        if self.orientation in ("yaw", "pitch"):
            return self.aims[:, 1:2]
        if self.orientation == "direction":
            axis = self.poses[:, :3, AXES.index(self.tool_axis)]
            return np.asarray(spin - axis * (axis * spin).sum(axis=1, keepdims=True))
        return spin

    def _axis_acceleration(self) -> Array:
        axis, spin = self.poses[:, :3, AXES.index(self.tool_axis)], self.first[:, 3:]
        return np.asarray(np.cross(self.second[:, 3:], axis) + np.cross(spin, np.cross(spin, axis)))

    def _six_rates(self, linear: Array, turning: Array) -> Array:
        parts = [linear[:, list(self.position)]]
        return np.concatenate(parts if self.orientation == "none" else [*parts, turning], axis=1)


@frozen
class SpeedLimits:
    """Limits of the tool's speeds that step along a path, over k intervals of it.

    Attributes:
        borders: s (k + 1,), from 0 to the length of the path, increasing.
        segments: Index of the first segment of each interval, and one behind the last of all, (k + 1,).
        speed: m/s, (k,); infinite for none.
        angular_speed: rad/s, (k,); infinite for none.
    """

    borders: Array
    segments: tuple[int, ...]
    speed: Array
    angular_speed: Array

    def at(self, s: Array, side: Side = "right") -> tuple[Array, Array]:
        """Return both at s (N,), each (N,)."""
        interval = np.searchsorted(self.borders[1:-1], s, side)
        return self.speed[interval], self.angular_speed[interval]

    def most_between(self, s: Array) -> tuple[Array, Array]:
        """Return the largest of both between neighbours of s (N,), increasing, each (N - 1,)."""
        first = np.searchsorted(self.borders[1:-1], s[:-1], "right")
        last = np.maximum(np.searchsorted(self.borders[1:-1], s[1:], "left"), first)
        speed, angular = self.speed[first].copy(), self.angular_speed[first].copy()
        for k in range(int((last - first).max(initial=0))):
            interval = np.minimum(first + k + 1, last)
            speed, angular = (
                np.maximum(larger, each[interval])
                for larger, each in ((speed, self.speed), (angular, self.angular_speed))
            )
        return speed, angular


@frozen
class ToolPath:
    """Poses along a path, and which of their coordinates count.

    Attributes:
        poses: X(s).
        position: Which of x, y and z in world are fixed.
        orientation: What is fixed of the orientation.
        tool_axis: Which axis of the tcp is meant by direction, yaw and pitch.
        angle_changes: Of yaw or pitch over the segments of the path, rad; empty for other kinds.
        progress: How far each of these segments is done; None for a single one.
        speeds: Limits of speeds that step along it; None where they do not.
        pinned: Joints that go evenly with s.
    """

    poses: PosePath
    position: tuple[bool, bool, bool]
    orientation: OrientationConstraint
    tool_axis: AxisName = "z"
    angle_changes: tuple[float, ...] = ()
    progress: SegmentProgress | None = None
    speeds: SpeedLimits | None = None
    pinned: tuple[PinnedJoint, ...] = ()

    @property
    def length(self) -> float:
        """End of s, m, or rad where the position rests."""
        return self.poses.length

    @property
    def seam(self) -> ToolPath | None:
        """The path about which the tool swings; None where it does not."""
        poses: Any = self.poses
        seam = getattr(getattr(poses, "position", None), "seam", None)
        return None if seam is None else replace(self, poses=replace(poses, position=seam))

    @property
    def breaks(self) -> Array:
        """Values of s where a second derivative may jump, or a limit of speed, the ends included."""
        inner = self.poses.breaks
        if self.speeds is not None:
            inner = distinct(np.concatenate([inner, self.speeds.borders[1:-1]]))
        return np.concatenate([[0.0], inner, [self.length]])

    def at_s(self, s: Array, side: Side) -> ToolReference:
        """Return the reference at s (N,), derivatives by s."""
        s = self._onto_breaks(np.asarray(s))
        return self._reference(s, side, np.ones(s.size), np.zeros(s.size))

    def at_time(self, law: PiecewisePolynomial, times: Array, side: Side, crossings: Array) -> ToolReference:
        """Return the reference at times (N,) of a law s(t), derivatives by t.

        Args:
            law: s(t).
            times: Within the law's.
            side: Which side of a break is meant.
            crossings: Shape (k,): when the law passes the inner breaks of the path.
        """
        rates = law.evaluate_orders(np.asarray(times), (0, 1, 2), side=side)[:, :, 0]
        s = self._keep_sides(rates[:, 0], times, crossings, _SAME_TIME * law.duration)
        return self._reference(s, side, rates[:, 1], rates[:, 2])

    def crossings(self, law: PiecewisePolynomial, breaks: Array) -> Array:
        """Return when a law s(t) passes the inner breaks of the path, (k,): at a break of its own if it can.

        Args:
            law: s(t).
            breaks: Its own, the ends included, increasing.
        """
        inner = self.poses.breaks
        if not inner.size:
            return inner
        s, times = law.evaluate(breaks)[:, 0], times_at(law, inner)
        s = np.maximum.accumulate(s)  # increasing but for rounding
        own_s = nearest(s, inner)
        own = breaks[np.searchsorted(s, own_s)]
        late = np.abs(times - own)
        same = (late <= _MERGED * law.duration) | (np.abs(inner - own_s) <= _AT_BREAK * self.length)
        return np.where(same, own, times)

    def _onto_breaks(self, s: Array) -> Array:
        s = np.clip(s, 0.0, self.length)
        inner = self.poses.breaks
        if not inner.size:
            return s
        near = nearest(inner, s)
        return np.where(np.abs(s - near) <= _AT_BREAK * self.length, near, s)

    def _keep_sides(self, s: Array, times: Array, crossings: Array, same: float) -> Array:
        """Return s (N,) on the side of each break on which their times are.

        A law that stops at a break is so near to it for some time that rounding would mix up the sides.
        """
        edges = np.concatenate([[-np.inf], self.poses.breaks, [np.inf]])
        gap = _BESIDE * self.length
        before, after = (np.searchsorted(crossings + shift, times, "right") for shift in (same, -same))
        low = np.where(before < after, edges[after], edges[before] + gap)
        high = np.where(before < after, edges[after], edges[before + 1] - gap)
        return np.clip(np.clip(s, low, high), 0.0, self.length)

    def _reference(self, s: Array, side: Side, speed: Array, acceleration: Array) -> ToolReference:
        poses, first, second = self.poses.evaluate(s, side)
        rate, change = speed[:, None], acceleration[:, None]
        return ToolReference(
            poses,
            first * rate,
            second * rate**2 + first * change,
            self.position,
            self.orientation,
            self.tool_axis,
            self._aims(s, side, speed, acceleration),
            tuple(pin.joint for pin in self.pinned),
            self._pins(s, speed, acceleration) if self.pinned else None,
        )

    def _pins(self, s: Array, speed: Array, acceleration: Array) -> Array:
        """Return the values of pinned joints with two derivatives, shape (3, N, pinned)."""
        first = np.array([pin.first for pin in self.pinned])
        slope = (np.array([pin.last for pin in self.pinned]) - first) / self.length
        return np.stack([first + s[:, None] * slope, speed[:, None] * slope, acceleration[:, None] * slope])

    def _aims(self, s: Array, side: Side, speed: Array, acceleration: Array) -> Array:
        if self.orientation not in ("yaw", "pitch"):
            return np.zeros((s.size, 0))
        initial_angle = self.angle_of(
            self.poses.evaluate(np.zeros(1))[0][0], self.orientation, self.tool_axis
        )
        angles = initial_angle + np.concatenate([[0.0], np.cumsum(self.angle_changes)])
        progress = self.progress or SegmentProgress.even(self.length)
        values, slopes, bends = (rows[:, 0] for rows in progress.between(angles[:, None], s, side))
        return np.stack([values, slopes * speed, bends * speed**2 + slopes * acceleration], axis=1)

    @staticmethod
    def angle_of(pose: Array, orientation: OrientationConstraint, tool_axis: AxisName) -> float:
        """Return the yaw or the pitch of a pose (4, 4), rad."""
        axis = pose[:3, AXES.index(tool_axis)]
        if orientation == "yaw":
            return float(np.arctan2(axis[1], axis[0]))
        return float(np.arctan2(axis[2], np.hypot(axis[0], axis[1])))
