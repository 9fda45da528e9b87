"""How the tool of an arm with fewer than six joints turns, and what a target says of that.

The tool turns by R1 R(h, s) R5(r) where h is the direction of the parallel axes: planar arms and SCARA have
only s, the sum of their turns; elbow and pitch (4R) have joint 1 before it; roll (5R) comes after it.
"""

from __future__ import annotations

from typing import cast

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.frozen import frozen
from trajcli.geometry.rotation import AXES, AxisName, Flags
from trajcli.kinematics.columns import dot
from trajcli.kinematics.inverse.families.elbow import forward_sign, same_direction
from trajcli.kinematics.inverse.families.screw_axes import (
    PARALLEL,
    AxisGeometry,
    Floats,
    ScrewAxis,
    contains,
    parallel,
)
from trajcli.kinematics.jacobian import jacobian
from trajcli.kinematics.robot import Robot


@frozen
class ToolAxisModel:
    """The joints by what they do to one axis of the tool.

    Attributes:
        arm: Their lines.
        together: The joints that turn about parallel axes.
        shoulder: The joint before them that the position decides.
        roll: The joint after them.
        marker: The tool axis at zero, a line through the tcp.
    """

    arm: AxisGeometry
    parallel_joints: tuple[int, ...]
    shoulder: ScrewAxis | None
    roll: ScrewAxis | None
    marker: ScrewAxis

    @property
    def axis(self) -> ScrewAxis:
        """The first of the parallel axes."""
        return self.arm.axes[self.parallel_joints[0]]

    @property
    def up(self) -> Floats:
        """World's z axis in the base."""
        return cast("Floats", tuple(self.arm.base[2, :3].tolist()))

    @property
    def upright(self) -> bool:
        """Whether the parallel axes are vertical in world wherever the arm is."""
        return self.shoulder is None and _vertical(self.arm, self.axis.direction)

    @property
    def axis_unturned(self) -> bool:
        """Whether the parallel axes leave the tool axis as it is."""
        return self.roll is None and parallel(self.axis, self.marker)

    @property
    def roll_irrelevant(self) -> bool:
        """Whether no roll moves the tcp or the tool axis."""
        return self.roll is None or (self.tip_on_roll and parallel(self.roll, self.marker))

    @property
    def tip_on_roll(self) -> bool:
        """Whether no roll moves the tcp."""
        return self.roll is None or contains(self.roll, self.marker.point, self.arm.length)

    @property
    def pitch_sign(self) -> float:
        """The sign with which the first answer of `levels` has the tool axis on the side of link 1's x."""
        if self.shoulder is None:
            return -1.0
        ahead = forward_sign(self.shoulder, self.axis, self.arm.forward)
        return ahead * float(np.copysign(1.0, dot(self.up, self.shoulder.direction)))

    def turn_sum(self, joints: Array) -> Array:
        """Return the sums s (K,) of joint values (K, n)."""
        return np.asarray(
            sum(same_direction(self.axis, self.arm.axes[i]) * joints[:, i] for i in self.parallel_joints)
        )

    def shoulder_right(self, robot: Robot, joints: Array, poses: Array) -> Flags:
        """Return which joints (K, n), at poses (K, 4, 4), have the tcp behind joint 1, shape (K,)."""
        if self.shoulder is None:
            raise ValueError("the arm has no shoulder")
        one, two = np.moveaxis(jacobian(robot, joints)[:, 3:, :2], 2, 0)
        offset = (poses[:, :3, 3] - self.arm.base[:3, 3]) @ self.arm.base[:3, :3] - self.shoulder.point
        ahead = np.einsum("ki,ki->k", offset @ self.arm.base[:3, :3].T, np.cross(two, one))
        return np.asarray(forward_sign(self.shoulder, self.axis, self.arm.forward) * ahead < 0.0)

    def flipped(self, robot: Robot, joints: Array, poses: Array, tool_axis: AxisName) -> Flags:
        """Return which joints (K, n), at poses (K, 4, 4), meet their pitch in the second way, shape (K,)."""
        axis = jacobian(robot, joints)[:, 3:, self.parallel_joints[0]]
        tool = poses[:, :3, AXES.index(tool_axis)]
        side = axis[:, 0] * tool[:, 1] - axis[:, 1] * tool[:, 0]
        return np.asarray(self.pitch_sign * side > 0.0)


def tool_axis_model(arm: AxisGeometry, tool_axis: AxisName) -> ToolAxisModel:
    """Return the body of an arm with parallel axes, for one axis of its tool."""
    turns = tuple(i for i, axis in enumerate(arm.axes) if not axis.prismatic)
    planar = parallel(*(arm.axes[i] for i in turns))
    roll = arm.axes[4] if len(arm.axes) == 5 else None
    marker = _marker(arm, tool_axis)
    if planar:
        return ToolAxisModel(arm, turns, None, None, marker)
    return ToolAxisModel(arm, (1, 2, 3), arm.axes[0], roll, marker)


def fixed_axis(arm: AxisGeometry, tool_axis: AxisName) -> bool:
    """Return whether no joint turns an axis of the tool."""
    return all(axis.prismatic or parallel(_marker(arm, tool_axis), axis) for axis in arm.axes)


def always_vertical(arm: AxisGeometry, tool_axis: AxisName) -> bool:
    """Return whether an axis of the tool that no joint turns is vertical in world."""
    return _vertical(arm, _marker(arm, tool_axis).direction)


def _marker(arm: AxisGeometry, tool_axis: AxisName) -> ScrewAxis:
    axis, tip = (cast("Floats", tuple(arm.home[:3, i].tolist())) for i in (AXES.index(tool_axis), 3))
    return ScrewAxis(prismatic=False, direction=axis, point=tip)


def _vertical(arm: AxisGeometry, direction: Floats) -> bool:
    x, y, _ = arm.base[:3, :3] @ direction
    return bool(np.hypot(x, y) <= PARALLEL)
