"""Tool-axis model of arms with fewer than six joints: the orientations of the tool that meet a target.

The tool turns by R1 R(h, s) R5(r) where h is the direction of the parallel axes: planar arms and SCARA have
only s, the sum of their turns; elbow and pitch (4R) have joint 1 before it; roll (5R) comes after it.

* Joint 1 follows from the position, two solutions; of a 5R arm with joint 5 at r, which is a 4R arm.
* A direction, or a heading about upright axes, gives s as the angle of one vector.
* A pitch gives s from the height of a vector, two solutions: "no_flip" heads to the side of the first link's
  x axis, of a planar arm to that of up x h.
* A direction that is not that of axis 5 gives s and r, two solutions, where joint 5 does not move the tcp.
"""

from __future__ import annotations

from typing import cast

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.frozen import frozen
from trajcli.geometry.rotation import AXES, AxisName, Flags
from trajcli.kinematics.columns import VectorEntries, dot, minus, plus
from trajcli.kinematics.inverse.families.elbow import forward_sign, same_direction, shoulder_turn
from trajcli.kinematics.inverse.families.screw_axes import (
    PARALLEL,
    AxisGeometry,
    Floats,
    ScrewAxis,
    contains,
    parallel,
)
from trajcli.kinematics.inverse.families.subproblems import (
    DegeneracyFlags,
    Mirrored,
    Opposed,
    Turn,
    levels,
    onto,
    turned,
    turned_back,
    two_turns,
    unit,
)
from trajcli.kinematics.inverse.target import IkTarget
from trajcli.kinematics.jacobian import jacobian
from trajcli.kinematics.robot import Robot


@frozen
class ToolAxisModel:
    """The joints by what they do to one axis of the tool.

    Attributes:
        arm: Their screw axes.
        parallel_joints: Indices of the joints that turn about parallel axes.
        shoulder: The joint before them, which the position determines.
        roll: The joint after them.
        marker: The tool axis at zero, through the tcp.
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
        """The sign with which the first solution of `levels` has the tool axis on the side of link 1's x."""
        if self.shoulder is None:
            return -self.axis.sign
        ahead = forward_sign(self.shoulder, self.axis, self.arm.forward)
        return ahead * float(np.copysign(1.0, dot(self.up, self.shoulder.direction)))

    def turn_sum(self, joints: Array) -> Array:
        """Return the sums s (K,) of joint values (K, n)."""
        return np.asarray(
            sum(same_direction(self.axis, self.arm.axes[i]) * joints[:, i] for i in self.parallel_joints)
        )

    def shoulder_right(self, robot: Robot, joints: Array, poses: Array) -> Flags:
        """Return which joints (K, n), at poses (K, 4, 4), have the shoulder "right", shape (K,)."""
        if self.shoulder is None:
            raise ValueError("the arm has no shoulder")
        one, two = np.moveaxis(jacobian(robot, joints)[:, 3:, :2], 2, 0)  # directions (K, 3) of axes 1 and 2
        offset = (poses[:, :3, 3] - self.arm.base[:3, 3]) @ self.arm.base[:3, :3] - self.shoulder.point
        ahead = np.einsum("ki,ki->k", offset @ self.arm.base[:3, :3].T, np.cross(two, one))
        return np.asarray(forward_sign(self.shoulder, self.axis, self.arm.forward) * ahead < 0.0)

    def flipped(self, robot: Robot, joints: Array, poses: Array, tool_axis: AxisName) -> Flags:
        """Return which joints (K, n), at poses (K, 4, 4), meet their pitch with "flip", shape (K,)."""
        axis = jacobian(robot, joints)[:, 3:, self.parallel_joints[0]]
        tool = poses[:, :3, AXES.index(tool_axis)]
        side = axis[:, 0] * tool[:, 1] - axis[:, 1] * tool[:, 0]
        return np.asarray(self.pitch_sign * side > 0.0)


def tool_axis_model(arm: AxisGeometry, tool_axis: AxisName) -> ToolAxisModel:
    """Return the model of an arm with parallel axes, for one axis of its tool."""
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
    axis = cast("Floats", tuple(arm.home[:3, AXES.index(tool_axis)].tolist()))
    return ScrewAxis(prismatic=False, direction=axis, point=arm.tip)


def _vertical(arm: AxisGeometry, direction: Floats) -> bool:
    x, y, _ = arm.base[:3, :3] @ direction
    return bool(np.hypot(x, y) <= PARALLEL)


@frozen
class OrientationSolver:
    """Orientations of the tool of one arm for a block of B targets.

    Attributes:
        model: Of the arm.
        target: The targets.
        flags: Of the block.
    """

    model: ToolAxisModel
    target: IkTarget
    flags: DegeneracyFlags

    def rotations(self, shoulder: Turn | None, s: Array | None, roll: Turn | None) -> Array:
        """Return the rotations of the tool against the base, shape (flips, shoulders, B, 3, 3).

        Args:
            shoulder: Turns of joint 1.
            s: Sums of the turns about the parallel axes (B,) where nothing else determines them.
            roll: Turns of the last joint likewise.
        """
        if s is not None:
            sums: Turn = np.cos(s), np.sin(s)
        elif self.target.orientation == "pitch":
            sums = self._for_pitch(shoulder, roll)
        elif self.model.roll is not None and roll is None:
            sums, roll = self._for_direction_with_roll(shoulder)
        else:
            sums = self._for_direction(shoulder, roll)
        shoulders = 1 if shoulder is None else 2
        flips = 2 ** (self.flags.choices - (shoulders - 1))
        result = np.empty((flips, shoulders, len(self.target.poses), 3, 3))
        for j, column in enumerate(self.model.arm.home[:3, :3].T.tolist()):
            vector = self._rolled(tuple(column), roll)
            vector = self._from_shoulder(turned(vector, self.model.axis.direction, sums), shoulder)
            for i, entry in enumerate(vector):
                full = np.broadcast_to(entry, (2,) * self.flags.choices + result.shape[2:3])
                result[..., i, j] = full.reshape(result.shape[:3])
        return result

    def shoulder(self, roll: Turn | None) -> Turn | None:
        """Return the turns of joint 1 that bring the tcp to its position."""
        model, one = self.model, self.model.shoulder
        if one is None:
            return None
        tip: VectorEntries = model.marker.point
        if model.roll is not None and roll is not None:
            tip = plus(turned(minus(tip, model.roll.point), model.roll.direction, roll), model.roll.point)
        base = model.arm.base
        position = (self.target.poses[:, :3, 3] - base[:3, 3]) @ base[:3, :3]
        sign = forward_sign(one, model.axis, model.arm.forward)
        return shoulder_turn(one, model.axis.direction, tip, _column(position), self.flags, sign)

    def _for_direction(self, shoulder: Turn | None, roll: Turn | None) -> Turn:
        """Return the sums that give the tool axis its direction, or its heading."""
        aim = self._to_shoulder(self._aim(), shoulder)
        tool = self._rolled(self.model.marker.direction, roll)
        return unit(onto(self.model.axis.direction, tool, aim), self.flags)

    def _for_direction_with_roll(self, shoulder: Turn | None) -> tuple[Turn, Turn]:
        """Return the sums and the rolls that together give the tool axis its direction."""
        model = self.model
        if model.roll is None:
            raise ValueError("the arm has no roll")
        aim = self._to_shoulder(self._aim(), shoulder)
        around, bend = two_turns(
            model.axis.direction,
            model.roll.direction,
            model.marker.direction,
            aim,
            self.flags,
            model.axis.sign * model.roll.sign,
        )
        return _both(around), _both(bend)

    def _for_pitch(self, shoulder: Turn | None, roll: Turn | None) -> Turn:
        """Return the sums that give the tool axis its elevation."""
        model = self.model
        up, tool = self._to_shoulder(model.up, shoulder), self._rolled(model.marker.direction, roll)
        height = np.sin(self.target.aims[:, 0])
        return levels(model.axis.direction, tool, up, height, self.flags, 1.0, model.pitch_sign)[0]

    def _aim(self) -> VectorEntries:
        """Return the direction of the tool axis in the base; of a heading its horizontal part."""
        aims = self.target.aims
        if self.target.orientation == "yaw":
            aims = np.hstack([np.cos(aims), np.sin(aims), np.zeros_like(aims)])
        return _column(aims @ self.model.arm.base[:3, :3])

    def _rolled(self, vector: VectorEntries, roll: Turn | None) -> VectorEntries:
        axis = self.model.roll
        return vector if axis is None or roll is None else turned(vector, axis.direction, roll)

    def _from_shoulder(self, vector: VectorEntries, shoulder: Turn | None) -> VectorEntries:
        one = self.model.shoulder
        return vector if one is None or shoulder is None else turned(vector, one.direction, shoulder)

    def _to_shoulder(self, vector: VectorEntries, shoulder: Turn | None) -> VectorEntries:
        one = self.model.shoulder
        return vector if one is None or shoulder is None else turned_back(vector, one.direction, shoulder)


def _both(value: Turn | Mirrored | Opposed) -> Turn:
    return value.both() if isinstance(value, Mirrored | Opposed) else value


def _column(vectors: Array) -> VectorEntries:
    x, y, z = np.ascontiguousarray(vectors.T)
    return x, y, z
