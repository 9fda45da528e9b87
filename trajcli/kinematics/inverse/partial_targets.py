"""Closed forms for targets that leave something free: one answer for each posture.

A posture is a branch of the closed form with, where a pitch or a direction is met in two ways, its way: they
are called "no_flip" and "flip" like those of a wrist. With fewer than six joints the shoulder is "left" where
the tcp is on the side of the first link's x axis, so that it changes only where joint 1 is free; the closed
form for whole poses looks at another point of axis 5.

The answers for all `whole_poses` are sorted by posture. Where the poses were samples, the answer of each that
is nearest to where the arm is moves along its family until no other is nearer, without leaving its posture. A
posture that no sample meets is sought from the sample that comes nearest to the target, and a target that no
posture meets by search.

Whole poses for targets that leave part of the pose to the arm, so that its closed form answers them.

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

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.frozen import frozen
from trajcli.geometry.rotation import AxisName, Flags
from trajcli.kinematics.columns import VectorEntries, minus, plus
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.answers import Answers, closures, joined, polish, rough
from trajcli.kinematics.inverse.families.batch import candidates
from trajcli.kinematics.inverse.families.elbow import forward_sign, shoulder_turn
from trajcli.kinematics.inverse.families.method import IkMethod
from trajcli.kinematics.inverse.families.screw_axes import AxisGeometry
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
from trajcli.kinematics.inverse.joint_turns import FULL, beyond, choose_turns, revolute
from trajcli.kinematics.inverse.numeric import SAME, descend, refine, search, starting_points
from trajcli.kinematics.inverse.self_motion import nearest_on_self_motions
from trajcli.kinematics.inverse.target import IkTarget, meeting
from trajcli.kinematics.inverse.tool_axis import ToolAxisModel, tool_axis_model
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
    shoulder: Array | None
    degenerate: Flags
    freedom: int
    free: Flags

    @property
    def flips(self) -> int:
        """In how many ways a pitch or direction is met."""
        return len(self.poses)


def whole_poses(robot: Robot, arm: AxisGeometry, target: IkTarget, near: Array) -> WholePoses | None:
    """Return whole poses for flat targets that leave some of it free; None where there is no such way.

    Args:
        robot: One whose closed form needs the whole pose.
        arm: Its lines.
        target: A flat batch of N.
        near: Joint values (N, n) from which what is free is sampled.
    """
    joints = len(arm.axes)
    if joints == 6:
        others = forward(robot, starting_points(robot, SAMPLES - 1, 0))[:, None]
        poses = np.stack([meeting(target, start) for start in (forward(robot, near), *others)])
        nowhere = np.zeros(len(near), dtype=bool)
        freedom, free = joints - target.coordinates, np.zeros(joints, dtype=bool)
        return WholePoses(poses[None, None], None, nowhere, freedom, free)
    if not all(target.position) or target.orientation == "all":
        return None
    model = tool_axis_model(arm, target.tool_axis)
    coupled = {"direction": not model.tip_on_roll, "yaw": not model.upright}
    return None if coupled.get(target.orientation, False) else _attainable_poses(model, target, near)


def _attainable_poses(model: ToolAxisModel, target: IkTarget, near: Array) -> WholePoses:
    """Return the poses in which an arm of fewer than six joints can stand at the target."""
    kind = target.orientation
    sum_free: bool = kind == "none" or model.axis_unturned or (kind == "pitch" and model.upright)
    rolls_to_aim = kind == "direction" and not model.roll_irrelevant
    samples = SAMPLES if sum_free or not (rolls_to_aim or model.roll_irrelevant) else 1
    steps = 2 * np.pi * np.arange(samples)[:, None]
    s = (model.turn_sum(near) + steps / samples).reshape(-1)
    r = (near[:, -1] + (0.0 if model.roll_irrelevant else _GOLDEN) * steps).reshape(-1)
    rows = target.rows(np.tile(np.arange(len(near)), samples))
    solver = _OrientationSolver(model, rows, DegeneracyFlags(len(s), model.arm.length))
    roll: Turn | None = None if rolls_to_aim or model.roll is None else (np.cos(r), np.sin(r))
    shoulder = solver.shoulder(roll)
    rotations = solver.rotations(shoulder, s if sum_free else None, roll)
    shape = (*rotations.shape[:2], samples, len(near))
    poses = np.broadcast_to(target.poses, (*shape, 4, 4)).copy()
    poses[..., :3, :3] = model.arm.base[:3, :3] @ rotations.reshape(*shape, 3, 3)
    rolling = model.roll is not None and not rolls_to_aim
    free = np.zeros(near.shape[1], dtype=bool)
    free[-1] = rolling and model.roll_irrelevant
    degenerate: Flags = np.asarray(solver.flags.rows.reshape(samples, -1).any(axis=0))
    turns = None if shoulder is None else np.stack(np.broadcast_arrays(*shoulder)).reshape(2, *shape[1:])
    return WholePoses(poses, turns, degenerate, sum_free + rolling, free)


@frozen
class _OrientationSolver:
    """One block of targets for one arm.

    Attributes:
        body: Of the arm.
        target: B targets.
        watch: Of the block.
    """

    model: ToolAxisModel
    target: IkTarget
    flags: DegeneracyFlags

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
        """Return the turns of joint 1 that bring the tcp to its place."""
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
        aim = self._to_shoulder(self._aim(), shoulder)
        tool = self._rolled(self.model.marker.direction, roll)
        return unit(onto(self.model.axis.direction, tool, aim), self.flags)

    def _for_direction_with_roll(self, shoulder: Turn | None) -> tuple[Turn, Turn]:
        model = self.model
        if model.roll is None:
            raise ValueError("the arm has no roll")
        aim = self._to_shoulder(self._aim(), shoulder)
        around, bend = two_turns(
            model.axis.direction, model.roll.direction, model.marker.direction, aim, self.flags
        )
        return _both(around), _both(bend)

    def _for_pitch(self, shoulder: Turn | None, roll: Turn | None) -> Turn:
        model = self.model
        up, tool = self._to_shoulder(model.up, shoulder), self._rolled(model.marker.direction, roll)
        height = np.sin(self.target.aims[:, 0])
        return levels(model.axis.direction, tool, up, height, self.flags, 1.0, model.pitch_sign)[0]

    def _aim(self) -> VectorEntries:
        """Return where the tool axis shall point, in the base; of a heading its level part."""
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


_OUTSIDE = 1e4  # rad or m, squared: answers outside the limits come behind those inside
_MISSED = 1e6  # the same for those that miss the target
_CORRECTIONS = 20
_BLOCK = 256  # targets at a time, so that the memory that samples take does not grow with their number


@frozen
class Postures:
    """Tells the posture of a configuration.

    Attributes:
        robot: The arm.
        arm: Its lines.
        method: Its closed form.
        ways: In how many ways a pitch or direction is met.
        tool_axis: That is meant by it.
    """

    robot: Robot
    arm: AxisGeometry
    method: IkMethod
    flips: int
    tool_axis: AxisName

    def of(self, joints: Array) -> NDArray[np.intp]:
        """Return the index (K,) of the posture of joint values (K, n); -1 where singular ones have none."""
        poses = forward(self.robot, joints)
        index, gap = self.branch(joints, poses)
        if len(self.arm.axes) < 6:
            model = tool_axis_model(self.arm, self.tool_axis)
            if model.shoulder is not None:
                index = 2 * model.shoulder_right(self.robot, joints, poses) + index % 2
            if self.flips == 2:
                index = 2 * index + model.flipped(self.robot, joints, poses, self.tool_axis)
        return np.where(gap <= SAME, index, -1)

    def branch(self, joints: Array, poses: Array) -> tuple[NDArray[np.intp], Array]:
        """Return the index (K,) of the closed form's nearest branch, and how far it is, rad or m."""
        branches = candidates(self.robot, self.arm, self.method, poses).joints
        gap = branches - joints.T[:, None]
        turning = revolute(self.robot)[:, None, None]
        gap = np.abs(np.where(turning, gap - FULL * np.round(gap / FULL), gap)).max(axis=0)
        return gap.argmin(axis=0), gap.min(axis=0)


def by_postures(
    robot: Robot, arm: AxisGeometry, method: IkMethod, target: IkTarget, near: Array, tolerance: float
) -> Answers | None:
    """Return an answer for each posture; None where the closed form does not help.

    Args:
        robot: The arm.
        arm: Its lines.
        method: Its closed form, which needs the whole pose.
        target: A flat batch of N that leaves some of the pose free.
        near: Joint values (N, n).
        tolerance: What an answer may miss its target by, m and rad.
    """
    parts: list[Answers] = []
    low, size = 0, _BLOCK
    while low < len(near):
        rows = slice(low, low + size)
        part = _block(robot, arm, method, target.rows(rows), near[rows], tolerance)
        if part is None:
            return None
        parts.append(part)
        low, size = low + size, _BLOCK if part.suspect.all() else 16 * _BLOCK
    return parts[0] if len(parts) == 1 else joined(parts)


def _block(
    robot: Robot, arm: AxisGeometry, method: IkMethod, target: IkTarget, near: Array, tolerance: float
) -> Answers | None:
    """Return the answers of one block of targets; see `by_postures`."""
    poses = whole_poses(robot, arm, target, near)
    if poses is None:
        return None
    samples, count = poses.poses.shape[2:4]
    raw = candidates(robot, arm, method, poses.poses.reshape(-1, 4, 4))
    joints = _sorted_by_posture(raw.joints, poses)
    closure = closures(robot, target, joints)
    degenerate = poses.degenerate | raw.degenerate.reshape(-1, count).any(axis=0)
    poor = rough(closure.max(axis=0)).any(axis=0)
    polish(robot, target, joints, closure, degenerate, np.flatnonzero(poor | degenerate))
    named = method if poses.flips == 1 else replace(method, choices=(*method.choices, "wrist"))
    answers = Answers(
        named, joints, closure, closure.max(axis=0) <= tolerance, degenerate, poses.free, poses.freedom, True
    )
    if samples > 1:
        work = _PostureSearch(
            Postures(robot, arm, method, poses.flips, target.tool_axis), target, near, tolerance
        )
        work.take_nearest(answers, samples)
        work.fill_missing(answers)
        work.move_nearest(answers)
        answers.closure, answers.suspect = closures(robot, target, answers.joints), np.ones(count, dtype=bool)
    else:
        choose_turns(robot, answers.joints, near.T)
    return answers


def _sorted_by_posture(joints: Array, poses: WholePoses) -> Array:
    """Return joints (n, branches, all poses) as (n, postures * samples, N).

    A pose that was made for one turn of joint 1 counts for the answers with that turn only.
    """
    flips, shoulders, samples, count = poses.poses.shape[:4]
    parted = joints.reshape(len(joints), shoulders, -1, flips, shoulders, samples, count)
    if poses.shoulder is None:
        return parted.reshape(len(joints), -1, count)
    parted = np.moveaxis(parted, 4, 1)
    cosine, sine = poses.shoulder[:, :, None, None, None]
    turns = parted[0][:, :, :1]
    own = (np.cos(turns) * cosine + np.sin(turns) * sine).argmax(axis=1)[None, :, None]
    return np.take_along_axis(parted, own, axis=2).reshape(len(joints), -1, count)


@frozen
class _PostureSearch:
    """Answers of sampled poses on their way to one for each posture: joints (n, postures, N), valid or not.

    Attributes:
        postures: Of the arm.
        target: A flat batch of N.
        near: Joint values (N, n).
        tolerance: What an answer may miss its target by, m and rad.
    """

    postures: Postures
    target: IkTarget
    near: Array
    tolerance: float

    def take_nearest(self, answers: Answers, samples: int) -> None:
        """Keep of answers (n, postures * samples, N) the nearest of each posture."""
        cost = self._cost(answers.joints, np.arange(len(self.near)))
        cost = np.where(answers.valid, cost, _MISSED * (1.0 + answers.closure.max(axis=0)))
        best = cost.reshape(-1, samples, cost.shape[-1]).argmin(axis=1)
        best += samples * np.arange(len(best))[:, None]
        answers.joints = np.take_along_axis(answers.joints, best[None], axis=1)
        answers.valid = np.take_along_axis(answers.valid, best, axis=0)
        beside, met = descend(self.postures.robot, self.target, self.near, None)
        self._offer(answers, np.flatnonzero(met), beside[met])

    def fill_missing(self, answers: Answers) -> None:
        """Seek the postures that no sample met, in place; for targets that none meets, search."""
        robot = self.postures.robot
        index, rows = np.nonzero(~answers.valid)
        if len(rows):
            start = answers.joints[:, index, rows].T
            better = refine(robot, self.target.rows(rows), start, _CORRECTIONS)
            answers.joints[:, index, rows] = better.T
            good = self._met(rows, better)
            self._offer_branches(answers, rows[good], better[good])
        missing = np.flatnonzero(~answers.valid.any(axis=0))
        if len(missing):
            search_result = search(robot, self.target.rows(missing), self.near[missing])
            for met, values in zip(search_result.met.T, search_result.joints.swapaxes(0, 1), strict=True):
                self._offer(answers, missing[met], values[met])

    def _offer_branches(self, answers: Answers, rows: NDArray[np.intp], joints: Array) -> None:
        """Offer all branches of the whole poses of joints (K, n) for the targets `rows`."""
        if not len(rows):
            return
        own, robot = self.postures, self.postures.robot
        branches = candidates(robot, own.arm, own.method, forward(robot, joints)).joints
        for values in np.moveaxis(branches, 0, -1):
            for some in _without_repetition(rows):
                self._offer(answers, rows[some], values[some])

    def _offer(self, answers: Answers, rows: NDArray[np.intp], joints: Array) -> None:
        """Take joints (K, n) for the targets `rows`, each at most once, where they are nearer than before."""
        if not len(rows):
            return
        joints = joints.T[:, None].copy()
        cost = self._cost(joints, rows)[0]
        index = self.postures.of(joints[:, 0].T)
        good = self._met(rows, joints[:, 0].T) & (index >= 0)
        before = np.where(
            answers.valid[index, rows], self._cost(answers.joints[:, index, rows][:, None], rows)[0], np.inf
        )
        good &= cost < before
        answers.joints[:, index[good], rows[good]] = joints[:, 0, good]
        answers.valid[index[good], rows[good]] = True

    def _cost(self, joints: Array, rows: NDArray[np.intp]) -> Array:
        """Turn joints (n, columns, K) to the nearest turns, in place; return their distances (columns, K)."""
        robot, near = self.postures.robot, self.near[rows].T
        choose_turns(robot, joints, near)
        outside = (beyond(joints.T, robot.limits.position) != 0.0).any(axis=-1).T
        return np.asarray(np.square(joints - near[:, None]).sum(axis=0) + _OUTSIDE * outside)

    def _met(self, rows: NDArray[np.intp], joints: Array) -> Flags:
        """Return which joints (K, n) meet their targets, shape (K,)."""
        misses = closures(self.postures.robot, self.target.rows(rows), joints.T[:, None])
        return np.asarray(misses.max(axis=0)[0] <= self.tolerance)

    def move_nearest(self, answers: Answers) -> None:
        """Move valid joints along their families, in place, until they are nearest."""
        index, rows = np.nonzero(answers.valid)
        if not len(rows):
            return

        def same_posture(some: NDArray[np.intp], moved: Array) -> Flags:
            posture = self.postures.of(moved)
            return np.asarray((posture == index[some]) | (posture < 0))

        start, near = answers.joints[:, index, rows].T, self.near[rows]
        members = nearest_on_self_motions(
            self.postures.robot, self.target.rows(rows), start, near, same_posture
        )
        answers.joints[:, index, rows] = members.T


def _without_repetition(rows: NDArray[np.intp]) -> Iterator[NDArray[np.intp]]:
    """Yield places of `rows` (K,), so that no row comes twice in one of them."""
    left = np.arange(len(rows))
    while len(left):
        _, shoulder = np.unique(rows[left], return_index=True)
        yield left[shoulder]
        left = np.delete(left, shoulder)
