"""Whole poses for targets that leave part of the pose to the arm, so that its closed form answers them.

With six joints the tool can stand anyhow, and the poses of sample configurations are turned the shortest way
until they meet the target. With fewer joints it turns by R1 R(h, s) R5(r) (`body`):

* joint 1 is found from the position, two answers; of a 5R arm with joint 5 at r, which is a 4R arm;
* a direction, or a heading about upright axes, gives s as the angle of one vector;
* a pitch gives s from the height of a vector, two answers: "no_flip" heads to the side of the first link's x
  axis, of a planar arm to that of up x h;
* a direction that is not that of axis 5 gives s and r, two answers, where joint 5 does not move the tcp.

What nothing fixes is sampled, starting from where the arm is. None is returned where orientation and position
are coupled in another way.
"""

from __future__ import annotations

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.frozen import frozen
from trajcli.geometry.rotation import Flags
from trajcli.kinematics.columns import Column, minus, plus
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.body import Body, body_of
from trajcli.kinematics.inverse.elbow import forward_sign, shoulder_turn
from trajcli.kinematics.inverse.lines import Arm
from trajcli.kinematics.inverse.numeric import starting_points
from trajcli.kinematics.inverse.subproblems import (
    Mirrored,
    Opposed,
    Turn,
    Watch,
    levels,
    onto,
    turned,
    turned_back,
    two_turns,
    unit,
)
from trajcli.kinematics.inverse.target import Target, meeting
from trajcli.kinematics.robot import Robot

SAMPLES = 48  # of what is free: neighbours are 7.5 degrees apart where it is one angle
_GOLDEN = 0.6180339887498949  # multiples of it, modulo 1, are spread evenly: a second angle beside the first


@frozen
class WholePoses:
    """Poses that meet a flat batch of N targets, as far as the arm can stand so.

    Attributes:
        poses: Shape (ways, shoulders, samples, N, 4, 4), T_world_tcp.
        first: Shape (2, shoulders, samples, N): cosine and sine of the turns of joint 1 that the poses were
            made for; None where there is one shoulder only.
        watched: Shape (N,): two ways fall together, or an angle is free.
        freedom: How many motions of the joints the targets leave free.
        free: Shape (n,): joints that are free by themselves; in every sample they are where they were.
    """

    poses: Array
    first: Array | None
    watched: Flags
    freedom: int
    free: Flags

    @property
    def ways(self) -> int:
        """In how many ways a pitch or direction is met."""
        return len(self.poses)


def whole_poses(robot: Robot, arm: Arm, target: Target, near: Array) -> WholePoses | None:
    """Return whole poses for flat targets that leave some of it free; None where there is no such way.

    Args:
        robot: One whose closed form needs the whole pose.
        arm: Its lines.
        target: A flat batch of N.
        near: Joint values (N, n) from which what is free is sampled.
    """
    joints = len(arm.lines)
    if joints == 6:
        others = forward(robot, starting_points(robot, SAMPLES - 1, 0))[:, None]
        poses = np.stack([meeting(target, start) for start in (forward(robot, near), *others)])
        nowhere = np.zeros(len(near), dtype=bool)
        freedom, free = joints - target.coordinates, np.zeros(joints, dtype=bool)
        return WholePoses(poses[None, None], None, nowhere, freedom, free)
    if not all(target.position) or target.orientation == "all":
        return None
    body = body_of(arm, target.tool_axis)
    coupled = {"direction": not body.tip_on_roll, "yaw": not body.upright}
    return None if coupled.get(target.orientation, False) else _standing(body, target, near)


def _standing(body: Body, target: Target, near: Array) -> WholePoses:
    """Return the poses in which an arm of fewer than six joints can stand at the target."""
    kind = target.orientation
    loose: bool = kind == "none" or body.steady or (kind == "pitch" and body.upright)
    together = kind == "direction" and not body.rolls_in_place
    samples = SAMPLES if loose or not (together or body.rolls_in_place) else 1
    steps = 2 * np.pi * np.arange(samples)[:, None]
    s = (body.turned_together(near) + steps / samples).reshape(-1)
    r = (near[:, -1] + (0.0 if body.rolls_in_place else _GOLDEN) * steps).reshape(-1)
    rows = target.rows(np.tile(np.arange(len(near)), samples))
    task = _Task(body, rows, Watch(len(s), body.arm.length))
    roll: Turn | None = None if together or body.roll is None else (np.cos(r), np.sin(r))
    first = task.shoulder(roll)
    rotations = task.rotations(first, s if loose else None, roll)
    shape = (*rotations.shape[:2], samples, len(near))
    poses = np.broadcast_to(target.poses, (*shape, 4, 4)).copy()
    poses[..., :3, :3] = body.arm.base[:3, :3] @ rotations.reshape(*shape, 3, 3)
    rolling = body.roll is not None and not together
    free = np.zeros(near.shape[1], dtype=bool)
    free[-1] = rolling and body.rolls_in_place
    watched: Flags = np.asarray(task.watch.rows.reshape(samples, -1).any(axis=0))
    turns = None if first is None else np.stack(np.broadcast_arrays(*first)).reshape(2, *shape[1:])
    return WholePoses(poses, turns, watched, loose + rolling, free)


@frozen
class _Task:
    """One block of targets for one arm.

    Attributes:
        body: Of the arm.
        target: B targets.
        watch: Of the block.
    """

    body: Body
    target: Target
    watch: Watch

    def rotations(self, shoulder: Turn | None, s: Array | None, roll: Turn | None) -> Array:
        """Return how the tool can turn, in the base, shape (ways, shoulders, B, 3, 3).

        Args:
            shoulder: Turns of joint 1.
            s: Sums of the turns about the parallel axes (B,) where nothing else decides them.
            roll: Turns of the last joint likewise.
        """
        if s is not None:
            sums: Turn = np.cos(s), np.sin(s)
        elif self.target.orientation == "pitch":
            sums = self._raised(shoulder, roll)
        elif self.body.roll is not None and roll is None:
            sums, roll = self._aimed_by_two(shoulder)
        else:
            sums = self._aimed(shoulder, roll)
        shoulders = 1 if shoulder is None else 2
        ways = 2 ** (self.watch.choices - (shoulders - 1))
        result = np.empty((ways, shoulders, len(self.target.poses), 3, 3))
        for j, column in enumerate(self.body.arm.home[:3, :3].T.tolist()):
            vector = self._rolled(tuple(column), roll)
            vector = self._from_shoulder(turned(vector, self.body.axis.direction, sums), shoulder)
            for i, entry in enumerate(vector):
                full = np.broadcast_to(entry, (2,) * self.watch.choices + result.shape[2:3])
                result[..., i, j] = full.reshape(result.shape[:3])
        return result

    def shoulder(self, roll: Turn | None) -> Turn | None:
        """Return the turns of joint 1 that bring the tcp to its place."""
        body, one = self.body, self.body.shoulder
        if one is None:
            return None
        tip: Column = body.marker.point
        if body.roll is not None and roll is not None:
            tip = plus(turned(minus(tip, body.roll.point), body.roll.direction, roll), body.roll.point)
        base = body.arm.base
        place = (self.target.poses[:, :3, 3] - base[:3, 3]) @ base[:3, :3]
        sign = forward_sign(one, body.axis, body.arm.forward)
        return shoulder_turn(one, body.axis.direction, tip, _column(place), self.watch, sign)

    def _aimed(self, shoulder: Turn | None, roll: Turn | None) -> Turn:
        aim = self._to_shoulder(self._aim(), shoulder)
        tool = self._rolled(self.body.marker.direction, roll)
        return unit(onto(self.body.axis.direction, tool, aim), self.watch)

    def _aimed_by_two(self, shoulder: Turn | None) -> tuple[Turn, Turn]:
        body = self.body
        if body.roll is None:
            raise ValueError("the arm has no roll")
        aim = self._to_shoulder(self._aim(), shoulder)
        around, bend = two_turns(
            body.axis.direction, body.roll.direction, body.marker.direction, aim, self.watch
        )
        return _both(around), _both(bend)

    def _raised(self, shoulder: Turn | None, roll: Turn | None) -> Turn:
        body = self.body
        up, tool = self._to_shoulder(body.up, shoulder), self._rolled(body.marker.direction, roll)
        height = np.sin(self.target.aims[:, 0])
        return levels(body.axis.direction, tool, up, height, self.watch, 1.0, body.pitch_sign)[0]

    def _aim(self) -> Column:
        """Return where the tool axis shall point, in the base; of a heading its level part."""
        aims = self.target.aims
        if self.target.orientation == "yaw":
            aims = np.hstack([np.cos(aims), np.sin(aims), np.zeros_like(aims)])
        return _column(aims @ self.body.arm.base[:3, :3])

    def _rolled(self, vector: Column, roll: Turn | None) -> Column:
        line = self.body.roll
        return vector if line is None or roll is None else turned(vector, line.direction, roll)

    def _from_shoulder(self, vector: Column, shoulder: Turn | None) -> Column:
        one = self.body.shoulder
        return vector if one is None or shoulder is None else turned(vector, one.direction, shoulder)

    def _to_shoulder(self, vector: Column, shoulder: Turn | None) -> Column:
        one = self.body.shoulder
        return vector if one is None or shoulder is None else turned_back(vector, one.direction, shoulder)


def _both(value: Turn | Mirrored | Opposed) -> Turn:
    return value.both() if isinstance(value, Mirrored | Opposed) else value


def _column(vectors: Array) -> Column:
    x, y, z = np.ascontiguousarray(vectors.T)
    return x, y, z
