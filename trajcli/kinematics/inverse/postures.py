"""Closed forms for targets that leave something free: one answer for each posture.

A posture is a branch of the closed form with, where a pitch or a direction is met in two ways, its way: they
are called "no_flip" and "flip" like those of a wrist. With fewer than six joints the shoulder is "left" where
the tcp is on the side of the first link's x axis, so that it changes only where joint 1 is free; the closed
form for whole poses looks at another point of axis 5.

The answers for all `whole_poses` are sorted by posture. Where the poses were samples, the answer of each that
is nearest to where the arm is moves along its family until no other is nearer, without leaving its posture. A
posture that no sample meets is sought from the sample that comes nearest to the target, and a target that no
posture meets by search.
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
from trajcli.kinematics.inverse.body import body_of
from trajcli.kinematics.inverse.closed_form import candidates
from trajcli.kinematics.inverse.found import Found, closures, joined, polish, rough
from trajcli.kinematics.inverse.lines import Arm
from trajcli.kinematics.inverse.method import Method
from trajcli.kinematics.inverse.nearest_member import nearest_members
from trajcli.kinematics.inverse.numeric import SAME, descend, refine, search
from trajcli.kinematics.inverse.target import Target
from trajcli.kinematics.inverse.turns import FULL, beyond, choose_turns, revolute
from trajcli.kinematics.inverse.whole_poses import WholePoses, whole_poses
from trajcli.kinematics.robot import Robot

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
    arm: Arm
    method: Method
    ways: int
    tool_axis: AxisName

    def of(self, joints: Array) -> NDArray[np.intp]:
        """Return the index (K,) of the posture of joint values (K, n); -1 where singular ones have none."""
        poses = forward(self.robot, joints)
        index, gap = self.branch(joints, poses)
        if len(self.arm.lines) < 6:
            body = body_of(self.arm, self.tool_axis)
            if body.shoulder is not None:
                index = 2 * body.leans_back(self.robot, joints, poses) + index % 2
            if self.ways == 2:
                index = 2 * index + body.heads_back(self.robot, joints, poses, self.tool_axis)
        return np.where(gap <= SAME, index, -1)

    def branch(self, joints: Array, poses: Array) -> tuple[NDArray[np.intp], Array]:
        """Return the index (K,) of the closed form's nearest branch, and how far it is, rad or m."""
        branches = candidates(self.robot, self.arm, self.method, poses).joints
        gap = branches - joints.T[:, None]
        turning = revolute(self.robot)[:, None, None]
        gap = np.abs(np.where(turning, gap - FULL * np.round(gap / FULL), gap)).max(axis=0)
        return gap.argmin(axis=0), gap.min(axis=0)


def by_postures(
    robot: Robot, arm: Arm, method: Method, target: Target, near: Array, tolerance: float
) -> Found | None:
    """Return an answer for each posture; None where the closed form does not help.

    Args:
        robot: The arm.
        arm: Its lines.
        method: Its closed form, which needs the whole pose.
        target: A flat batch of N that leaves some of the pose free.
        near: Joint values (N, n).
        tolerance: What an answer may miss its target by, m and rad.
    """
    parts: list[Found] = []
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
    robot: Robot, arm: Arm, method: Method, target: Target, near: Array, tolerance: float
) -> Found | None:
    """Return the answers of one block of targets; see `by_postures`."""
    poses = whole_poses(robot, arm, target, near)
    if poses is None:
        return None
    samples, count = poses.poses.shape[2:4]
    raw = candidates(robot, arm, method, poses.poses.reshape(-1, 4, 4))
    joints = _by_posture(raw.joints, poses)
    closure = closures(robot, target, joints)
    watched = poses.watched | raw.watched.reshape(-1, count).any(axis=0)
    poor = rough(closure.max(axis=0)).any(axis=0)
    polish(robot, target, joints, closure, watched, np.flatnonzero(poor | watched))
    named = method if poses.ways == 1 else replace(method, choices=(*method.choices, "wrist"))
    found = Found(
        named, joints, closure, closure.max(axis=0) <= tolerance, watched, poses.free, poses.freedom, True
    )
    if samples > 1:
        work = _Work(Postures(robot, arm, method, poses.ways, target.tool_axis), target, near, tolerance)
        work.take_nearest(found, samples)
        work.mend(found)
        work.bring_near(found)
        found.closure, found.suspect = closures(robot, target, found.joints), np.ones(count, dtype=bool)
    else:
        choose_turns(robot, found.joints, near.T)
    return found


def _by_posture(joints: Array, poses: WholePoses) -> Array:
    """Return joints (n, branches, all poses) as (n, postures * samples, N).

    A pose that was made for one turn of joint 1 counts for the answers with that turn only.
    """
    ways, shoulders, samples, count = poses.poses.shape[:4]
    parted = joints.reshape(len(joints), shoulders, -1, ways, shoulders, samples, count)
    if poses.first is None:
        return parted.reshape(len(joints), -1, count)
    parted = np.moveaxis(parted, 4, 1)
    cosine, sine = poses.first[:, :, None, None, None]
    turns = parted[0][:, :, :1]
    own = (np.cos(turns) * cosine + np.sin(turns) * sine).argmax(axis=1)[None, :, None]
    return np.take_along_axis(parted, own, axis=2).reshape(len(joints), -1, count)


@frozen
class _Work:
    """Answers of sampled poses on their way to one for each posture: joints (n, postures, N), valid or not.

    Attributes:
        postures: Of the arm.
        target: A flat batch of N.
        near: Joint values (N, n).
        tolerance: What an answer may miss its target by, m and rad.
    """

    postures: Postures
    target: Target
    near: Array
    tolerance: float

    def take_nearest(self, found: Found, samples: int) -> None:
        """Keep of answers (n, postures * samples, N) the nearest of each posture."""
        cost = self._cost(found.joints, np.arange(len(self.near)))
        cost = np.where(found.valid, cost, _MISSED * (1.0 + found.closure.max(axis=0)))
        best = cost.reshape(-1, samples, cost.shape[-1]).argmin(axis=1)
        best += samples * np.arange(len(best))[:, None]
        found.joints = np.take_along_axis(found.joints, best[None], axis=1)
        found.valid = np.take_along_axis(found.valid, best, axis=0)
        beside, met = descend(self.postures.robot, self.target, self.near, None)
        self._offer(found, np.flatnonzero(met), beside[met])

    def mend(self, found: Found) -> None:
        """Seek the postures that no sample met, in place; for targets that none meets, search."""
        robot = self.postures.robot
        index, rows = np.nonzero(~found.valid)
        if len(rows):
            start = found.joints[:, index, rows].T
            better = refine(robot, self.target.rows(rows), start, _CORRECTIONS)
            found.joints[:, index, rows] = better.T
            good = self._good(rows, better)
            self._offer_branches(found, rows[good], better[good])
        missing = np.flatnonzero(~found.valid.any(axis=0))
        if len(missing):
            sought = search(robot, self.target.rows(missing), self.near[missing])
            for met, values in zip(sought.found.T, sought.joints.swapaxes(0, 1), strict=True):
                self._offer(found, missing[met], values[met])

    def _offer_branches(self, found: Found, rows: NDArray[np.intp], joints: Array) -> None:
        """Offer all branches of the whole poses of joints (K, n) for the targets `rows`."""
        if not len(rows):
            return
        own, robot = self.postures, self.postures.robot
        branches = candidates(robot, own.arm, own.method, forward(robot, joints)).joints
        for values in np.moveaxis(branches, 0, -1):
            for some in _without_repetition(rows):
                self._offer(found, rows[some], values[some])

    def _offer(self, found: Found, rows: NDArray[np.intp], joints: Array) -> None:
        """Take joints (K, n) for the targets `rows`, each at most once, where they are nearer than before."""
        if not len(rows):
            return
        joints = joints.T[:, None].copy()
        cost = self._cost(joints, rows)[0]
        index = self.postures.of(joints[:, 0].T)
        good = self._good(rows, joints[:, 0].T) & (index >= 0)
        before = np.where(
            found.valid[index, rows], self._cost(found.joints[:, index, rows][:, None], rows)[0], np.inf
        )
        good &= cost < before
        found.joints[:, index[good], rows[good]] = joints[:, 0, good]
        found.valid[index[good], rows[good]] = True

    def _cost(self, joints: Array, rows: NDArray[np.intp]) -> Array:
        """Turn joints (n, columns, K) to the nearest turns, in place; return their distances (columns, K)."""
        robot, near = self.postures.robot, self.near[rows].T
        choose_turns(robot, joints, near)
        outside = (beyond(joints.T, robot.limits.position) != 0.0).any(axis=-1).T
        return np.asarray(np.square(joints - near[:, None]).sum(axis=0) + _OUTSIDE * outside)

    def _good(self, rows: NDArray[np.intp], joints: Array) -> Flags:
        """Return which joints (K, n) meet their targets, shape (K,)."""
        misses = closures(self.postures.robot, self.target.rows(rows), joints.T[:, None])
        return np.asarray(misses.max(axis=0)[0] <= self.tolerance)

    def bring_near(self, found: Found) -> None:
        """Move valid joints along their families, in place, until they are nearest."""
        index, rows = np.nonzero(found.valid)
        if not len(rows):
            return

        def same_posture(some: NDArray[np.intp], moved: Array) -> Flags:
            posture = self.postures.of(moved)
            return np.asarray((posture == index[some]) | (posture < 0))

        start, near = found.joints[:, index, rows].T, self.near[rows]
        members = nearest_members(self.postures.robot, self.target.rows(rows), start, near, same_posture)
        found.joints[:, index, rows] = members.T


def _without_repetition(rows: NDArray[np.intp]) -> Iterator[NDArray[np.intp]]:
    """Yield places of `rows` (K,), so that no row comes twice in one of them."""
    left = np.arange(len(rows))
    while len(left):
        _, first = np.unique(rows[left], return_index=True)
        yield left[first]
        left = np.delete(left, first)
