"""What a moving tool demands of the joints: where it is, how fast, and how that changes."""

from __future__ import annotations

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.frozen import frozen
from trajcli.geometry.rotation import AXES, AxisName
from trajcli.kinematics.inverse.target import Fixed, Target

_LEVEL = 1e-12  # of a unit vector, squared: the heading of a vertical axis is not defined


@frozen
class Demand:
    """The tool at N places of its path: what it fixes, and the first and second derivative of that.

    Attributes:
        poses: Shape (N, 4, 4), T_world_tcp; what is not fixed does not matter.
        first: Shape (N, 6), (v, w) at the tcp in world; m and rad per unit of the parameter.
        second: Shape (N, 6), its derivative.
        position: Which of x, y and z in world are fixed.
        orientation: What is fixed of the orientation, as in `Target`.
        tool_axis: Which axis of the tcp is meant by direction, yaw and pitch.
        aims: Yaw or pitch with two derivatives, shape (N, 3), rad; (N, 0) otherwise.
    """

    poses: Array
    first: Array
    second: Array
    position: tuple[bool, bool, bool]
    orientation: Fixed
    tool_axis: AxisName
    aims: Array

    def target(self) -> Target:
        """Return the targets, a flat batch of N."""
        aims = self.aims[:, :1]
        if self.orientation == "direction":
            aims = self.poses[:, :3, AXES.index(self.tool_axis)]
        return Target(self.poses, self.position, self.orientation, self.tool_axis, aims)

    def rates(self) -> Array:
        """Return the rates (N, m) that the rows of `residual_jacobian` must have."""
        return self._joined(self.first[:, :3], self._turning_rates())

    def accelerations(self, poses: Array, bias: Array, twist: Array) -> Array:
        """Return what the rows of `residual_jacobian`, times qdd, must be, shape (N, m).

        Args:
            poses: The tcp as it is, (N, 4, 4): it may be turned about what is left free.
            bias: The part of its acceleration that does not come from qdd, (N, 6).
            twist: Its velocity, (N, 6).
        """
        linear = self.second[:, :3] - bias[:, :3]
        if self.orientation in ("all", "none"):
            return self._joined(linear, self.second[:, 3:] - bias[:, 3:])
        spin = twist[:, 3:]
        axis = poses[:, :3, AXES.index(self.tool_axis)]
        swing = np.cross(spin, axis)
        drift = np.cross(bias[:, 3:], axis) + np.cross(spin, swing)  # of the axis' second derivative
        if self.orientation == "direction":
            wanted = self._axis_acceleration()
            return self._joined(linear, np.cross(axis, wanted - drift))
        return self._joined(linear, self._angle_acceleration(axis, swing, drift)[:, None])

    def _angle_acceleration(self, axis: Array, swing: Array, drift: Array) -> Array:
        """Return what is left of the second derivative of yaw or pitch, shape (N,)."""
        level = np.maximum(np.square(axis[:, :2]).sum(axis=1), _LEVEL)
        level_rate = 2 * (axis[:, :2] * swing[:, :2]).sum(axis=1)
        if self.orientation == "yaw":
            drifted = (axis[:, 0] * drift[:, 1] - axis[:, 1] * drift[:, 0]) / level
            return np.asarray(self.aims[:, 2] - drifted + self.aims[:, 1] * level_rate / level)
        root = np.sqrt(level)
        steeper = swing[:, 2] * level_rate / (2 * level * root)
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

    def _joined(self, linear: Array, turning: Array) -> Array:
        parts = [linear[:, list(self.position)]]
        return np.concatenate(parts if self.orientation == "none" else [*parts, turning], axis=1)
