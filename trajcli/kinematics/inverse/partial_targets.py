"""Partial targets: closed forms for targets that leave part of the pose free, one answer for each posture.

A posture is a branch of the closed form and, where two orientations meet a pitch or a direction, the choice
between them, "no_flip" or "flip" like that of a wrist. With fewer than six joints the shoulder is "left"
where the tcp is on the side of the first link's x axis, so that it changes only where joint 1 is free; the
closed form for whole poses looks at another point of axis 5.

The closed form answers whole poses that meet the target. With six joints the tool can have any orientation:
the poses of sample configurations are turned the shortest way until they meet the target. With fewer joints
the `ToolAxisModel` gives the orientations; None is returned where it couples orientation and position. What
nothing fixes is sampled, starting from where the arm is.

The answers for all whole poses are sorted by posture. Where the poses were samples, the answer of each
posture that is nearest to where the arm is moves along its self-motion manifold until no other is nearer,
without leaving its posture. A posture that no sample meets is sought from the sample that comes nearest to
the target, and a target that no posture meets by search.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.frozen import frozen
from trajcli.geometry.rotation import AxisName, Flags
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.answers import Answers, closures, joined, polish, rough
from trajcli.kinematics.inverse.families.method import IkMethod, candidates
from trajcli.kinematics.inverse.families.screw_axes import AxisGeometry
from trajcli.kinematics.inverse.families.subproblems import DegeneracyFlags, Turn
from trajcli.kinematics.inverse.joint_turns import FULL, beyond, choose_turns, revolute
from trajcli.kinematics.inverse.numeric import SAME, descend, refine, search, starting_points
from trajcli.kinematics.inverse.self_motion import nearest_on_self_motions
from trajcli.kinematics.inverse.target import IkTarget, meeting
from trajcli.kinematics.inverse.tool_axis import OrientationSolver, ToolAxisModel, tool_axis_model
from trajcli.kinematics.robot import Robot

SAMPLES = 48  # of what is free: neighbours are 7.5 degrees apart where it is one angle
_GOLDEN = 0.6180339887498949  # multiples of it, modulo 1, are spread evenly: a second angle beside the first
_OUTSIDE = 1e4  # rad or m, squared: answers outside the limits come behind those inside
_MISSED = 1e6  # the same for those that miss the target
_CORRECTIONS = 20
_BLOCK = 256  # targets at a time, so that the memory that samples take does not grow with their number


@frozen
class WholePoses:
    """Poses that meet a flat batch of N targets, as far as the arm can take them.

    Attributes:
        poses: Shape (flips, shoulders, samples, N, 4, 4), T_world_tcp.
        shoulder: Shape (2, shoulders, samples, N): cosine and sine of the turns of joint 1 that the poses
            belong to; None where there is one shoulder only.
        degenerate: Shape (N,): two orientations coincide, or an angle is free.
        freedom: How many self-motions the targets leave.
        free: Shape (n,): joints that are free by themselves; in every sample they are where they were.
    """

    poses: Array
    shoulder: Array | None
    degenerate: Flags
    freedom: int
    free: Flags

    @property
    def flips(self) -> int:
        """How many orientations meet a pitch or direction, 1 or 2."""
        return len(self.poses)


def whole_poses(robot: Robot, arm: AxisGeometry, target: IkTarget, near: Array) -> WholePoses | None:
    """Return whole poses for flat targets that leave part of them free; None where no model gives them.

    Args:
        robot: One whose closed form needs the whole pose.
        arm: Its screw axes.
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
    """Return the poses in which an arm of fewer than six joints meets the targets."""
    kind = target.orientation
    sum_free: bool = kind == "none" or model.axis_unturned or (kind == "pitch" and model.upright)
    rolls_to_aim = kind == "direction" and not model.roll_irrelevant
    samples = SAMPLES if sum_free or not (rolls_to_aim or model.roll_irrelevant) else 1
    steps = 2 * np.pi * np.arange(samples)[:, None]
    s = (model.turn_sum(near) + steps / samples).reshape(-1)
    r = (near[:, -1] + (0.0 if model.roll_irrelevant else _GOLDEN) * steps).reshape(-1)
    rows = target.rows(np.tile(np.arange(len(near)), samples))
    solver = OrientationSolver(model, rows, DegeneracyFlags(len(s), model.arm.length))
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
class Postures:
    """The postures of an arm, and which one a configuration has.

    Attributes:
        robot: The arm.
        arm: Its screw axes.
        method: Its closed form.
        flips: How many orientations meet a pitch or direction, 1 or 2.
        tool_axis: The axis that these mean.
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
        arm: Its screw axes.
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
        postures = Postures(robot, arm, method, poses.flips, target.tool_axis)
        reduction = _PostureReduction(postures, target, near, tolerance)
        reduction.take_nearest(answers, samples)
        reduction.fill_missing(answers)
        reduction.move_nearest(answers)
        answers.closure, answers.suspect = closures(robot, target, answers.joints), np.ones(count, dtype=bool)
    else:
        choose_turns(robot, answers.joints, near.T)
    return answers


def _sorted_by_posture(joints: Array, poses: WholePoses) -> Array:
    """Return joints (n, branches, all poses) as (n, postures * samples, N).

    A pose that belongs to one turn of joint 1 counts for the answers with that turn only.
    """
    flips, shoulders, samples, count = poses.poses.shape[:4]
    # joint, branch (its shoulder, then the rest), pose (flip, shoulder it belongs to, sample, target)
    parted = joints.reshape(len(joints), shoulders, -1, flips, shoulders, samples, count)
    if poses.shoulder is None:
        return parted.reshape(len(joints), -1, count)
    parted = np.moveaxis(parted, 4, 1)  # the shoulder of the pose comes second
    cosine, sine = poses.shoulder[:, :, None, None, None]
    turns = parted[0][:, :, :1]
    own = (np.cos(turns) * cosine + np.sin(turns) * sine).argmax(axis=1)[None, :, None]
    return np.take_along_axis(parted, own, axis=2).reshape(len(joints), -1, count)


@frozen
class _PostureReduction:
    """Reduction of the answers of sampled poses to one for each posture, joints (n, postures, N).

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
        """Keep of answers (n, postures * samples, N) the nearest of each posture, in place."""
        cost = self._cost(answers.joints, np.arange(len(self.near)))
        cost = np.where(answers.valid, cost, _MISSED * (1.0 + answers.closure.max(axis=0)))
        best = cost.reshape(-1, samples, cost.shape[-1]).argmin(axis=1)
        best += samples * np.arange(len(best))[:, None]
        answers.joints = np.take_along_axis(answers.joints, best[None], axis=1)
        answers.valid = np.take_along_axis(answers.valid, best, axis=0)
        beside, met = descend(self.postures.robot, self.target, self.near, None)
        self._offer(answers, np.flatnonzero(met), beside[met])

    def fill_missing(self, answers: Answers) -> None:
        """Refine towards the postures that no sample met, in place; for targets that none meets, search."""
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
            searched = search(robot, self.target.rows(missing), self.near[missing])
            for met, values in zip(searched.met.T, searched.joints.swapaxes(0, 1), strict=True):
                self._offer(answers, missing[met], values[met])

    def _offer_branches(self, answers: Answers, rows: NDArray[np.intp], joints: Array) -> None:
        """Offer all branches of the closed form at the poses of joints (K, n) for the targets `rows`."""
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
        joints = joints.T[:, None].copy()  # (n, 1, K)
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
        """Move valid joints along their self-motion manifolds, in place, until they are nearest."""
        index, rows = np.nonzero(answers.valid)
        if not len(rows):
            return

        def same_posture(some: NDArray[np.intp], moved: Array) -> Flags:
            posture = self.postures.of(moved)
            return np.asarray((posture == index[some]) | (posture < 0))

        start, near = answers.joints[:, index, rows].T, self.near[rows]
        robot, target = self.postures.robot, self.target.rows(rows)
        answers.joints[:, index, rows] = nearest_on_self_motions(robot, target, start, near, same_posture).T


def _without_repetition(rows: NDArray[np.intp]) -> Iterator[NDArray[np.intp]]:
    """Yield indices into `rows` (K,), so that no row comes twice in one of them."""
    left = np.arange(len(rows))
    while len(left):
        _, once = np.unique(rows[left], return_index=True)
        yield left[once]
        left = np.delete(left, once)
