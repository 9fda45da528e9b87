"""Families of answers: which joints are free together, and where the arm is singular.

A family exists where the arm can move while what the target fixes rests. That need not be singular: a target
that fixes less than the arm can do leaves some freedom everywhere. An arm is singular where its Jacobian has
less rank than elsewhere, and counts as that only if it really can move in more ways: a small step along a
lost direction is taken and corrected, and counts if the tcp is back, the joints are not, and the rank is less
there too. A stretched elbow fails that, an aligned wrist does not.

The member of a family of answers that is nearest to a configuration, inside the limits.

Gradient descent on the square of the distance, along the family: the step is what is left of the way once
all that moves the tcp is taken out of it, times a length that the last two steps tell (Barzilai and Borwein).
Their distances need not fall at every step, and arrive sooner than if they had to. A joint at its limit that
would pass it is held. The result is the nearest of all around it, not of all there are.

Source: Nocedal and Wright, Numerical Optimization (2006), section 16.7; Barzilai and Borwein, Two-point step
size gradient methods, IMA J. Numerical Analysis 8 (1988).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.frozen import frozen
from trajcli.geometry.rotation import Flags
from trajcli.kinematics.inverse.joint_turns import FULL, choose_turns, revolute
from trajcli.kinematics.inverse.numeric import SAME, linearised, refined, starting_points
from trajcli.kinematics.inverse.target import IkTarget
from trajcli.kinematics.robot import Robot

Allowed = Callable[[NDArray[np.intp], Array], Flags]
MET = 1e-10  # scaled error with which a member still meets the target
_NEARLY_MET = 1e-4  # the same on the way
_MOVES = 60
_LONGEST = 0.5  # rad or m, of one step
_ARRIVED = 1e-11  # rad or m of the way that are left
_STUCK = 1e-5  # of a whole step: no shorter one is tried
_GROWS = 4.0  # times, at most, a step is longer than the one before
_CORRECTIONS = 2
_REFUSALS = 4  # then the next place is not allowed, and the one before is taken
_AT_LIMIT = 1e-10  # rad or m
_LOST = 1e-9  # of the largest singular value


def nearest_on_self_motions(
    robot: Robot, target: IkTarget, joints: Array, near: Array, allowed: Allowed | None = None
) -> Array:
    """Return the members (K, n) nearest to `near` of the families that configurations belong to.

    Args:
        robot: Its limits hold, except for joints that are outside from the start.
        target: A flat batch of K, met by the joints.
        joints: Shape (K, n).
        near: Shape (K, n).
        allowed: (rows, joints) -> whether a row may move there; None for anywhere.
    """
    turned = joints.T[:, None].copy()
    choose_turns(robot, turned, near.T)
    start = turned[:, 0].T.copy()
    walk = _Walk(robot, target, start, near, allowed)
    for _ in range(_MOVES):
        if not walk.step():
            break
    return walk.end()


class _Walk:
    """The rows that are under way.

    Attributes:
        joints: Shape (K, n), where they are.
    """

    def __init__(
        self, robot: Robot, target: IkTarget, start: Array, near: Array, allowed: Allowed | None
    ) -> None:
        self._robot, self._target, self._near, self._allowed = robot, target, near, allowed
        self._start, self.joints = start, start.copy()
        self._low = np.minimum(robot.limits.position[:, 0], start)
        self._high = np.maximum(robot.limits.position[:, 1], start)
        self._running = np.arange(len(start))
        self._length = np.ones(len(start))
        self._refused = np.zeros(len(start), dtype=int)
        self._last: Array = np.zeros_like(start)  # the way from the place before
        self._moved: Array = np.zeros_like(start)

    def step(self) -> bool:
        """Move all running rows once; return whether any is left."""
        way = self._way(self._running)
        self._stretch(way)
        going = np.abs(way).max(axis=1, initial=0.0) > _ARRIVED
        going &= (self._length[self._running] > _STUCK) & (self._refused[self._running] <= _REFUSALS)
        rows, way = self._running[going], way[going]
        self._running = rows
        if not len(rows):
            return False
        here = self.joints[rows]
        step = way * self._length[rows, None]
        step *= np.minimum(1.0, _LONGEST / np.maximum(np.abs(step).max(axis=1, keepdims=True), _LONGEST))
        trial, good = self._corrected(rows, here + step, _NEARLY_MET)
        if self._allowed is not None and good.any():
            asked = np.flatnonzero(good)
            good[asked] = self._allowed(rows[asked], trial[asked])
            self._refused[rows[asked[~good[asked]]]] += 1
        self._last[rows], self._moved[rows] = way, np.where(good[:, None], trial - here, 0.0)
        self._length[rows] = np.where(good, self._length[rows], 0.25 * self._length[rows])
        self.joints[rows[good]] = trial[good]
        return True

    def end(self) -> Array:
        """Return where all rows have come to (K, n), or started from if they do not meet the target there."""
        final, good = self._corrected(np.arange(len(self.joints)), self.joints, MET)
        return np.where(good[:, None], final, self._start)

    def _way(self, rows: NDArray[np.intp]) -> Array:
        """Return what is left of the way (K, n) inside the families."""
        q, target = self.joints[rows], self._target.rows(rows)
        gap = self._near[rows] - q
        _, slopes = linearised(self._robot, target, q)
        way = _inside(slopes, gap)
        held = np.zeros(q.shape, dtype=bool)
        for _ in range(2):  # once held, a joint may press another one against its limit
            at_limit = ((q >= self._high[rows] - _AT_LIMIT) & (way > 0.0)) | (
                (q <= self._low[rows] + _AT_LIMIT) & (way < 0.0)
            )
            if not at_limit.any():
                break
            held |= at_limit
            bars = held[:, :, None] * np.eye(q.shape[1])
            way = np.where(held, 0.0, _inside(np.concatenate([slopes, bars], axis=1), gap))
        return way

    def _stretch(self, way: Array) -> None:
        """Choose the lengths of the next steps from how the way changed in the last one."""
        rows = self._running
        moved = self._moved[rows]
        change = np.einsum("kn,kn->k", moved, self._last[rows] - way)
        square = np.square(moved).sum(axis=1)
        told = change > square / _GROWS / self._length[rows]
        longer = np.where(told, square / np.where(told, change, 1.0), _GROWS * self._length[rows])
        self._length[rows] = np.where(square > 0.0, longer, self._length[rows])

    def _corrected(self, rows: NDArray[np.intp], q: Array, tolerance: float) -> tuple[Array, Flags]:
        """Return joint values (K, n) brought back to their targets, and which are there inside the limits.

        Joints at a limit, or beyond it, are taken there and stay.
        """
        target, low, high = self._target.rows(rows), self._low[rows], self._high[rows]
        q = np.clip(q, low, high)
        held = (q >= high - _AT_LIMIT) | (q <= low + _AT_LIMIT)
        bars, nothing = held[:, :, None] * np.eye(q.shape[1]), np.zeros(q.shape)
        for _ in range(_CORRECTIONS):
            errors, slopes = linearised(self._robot, target, q)
            inverse = np.linalg.pinv(np.concatenate([slopes, bars], axis=1), rcond=_LOST)
            q = q + (inverse @ np.concatenate([errors, nothing], axis=1)[..., None])[..., 0]
        q = np.where(held, np.clip(q, low, high), q)  # rounding
        errors, _ = linearised(self._robot, target, q)
        inside = ((q >= low) & (q <= high)).all(axis=1)
        return q, np.asarray((np.linalg.norm(errors, axis=1) <= tolerance) & inside)


def _inside(slopes: Array, gap: Array) -> Array:
    """Return the part (K, n) of joint motions that moves nothing the slopes (K, m, n) tell of."""
    outside = np.linalg.pinv(slopes, rcond=_LOST) @ (slopes @ gap[..., None])
    return np.asarray(gap - outside[..., 0])


RANK = 3e-9  # of the largest singular value
_STEP = 0.05  # rad or m: large against what a correction may lose
_PART = 1e-6  # of a unit direction: a joint with less takes no part
_PLACES = 8  # configurations among which one is not singular
_IN_LINE = 2  # joints that two axes in line leave free together


@frozen
class SelfMotions:
    """What is known of K configurations.

    Attributes:
        singular: Shape (K,): the arm can move in more ways than the targets leave free elsewhere.
        free: Shape (K, n), the joints that are free together.
    """

    singular: Flags
    free: Flags


def self_motions(robot: Robot, target: IkTarget, joints: Array, freedom: int = 0) -> SelfMotions:
    """Return the families that configurations (K, n), which meet the flat target, belong to.

    Args:
        robot: The arm.
        target: A flat batch of K.
        joints: Shape (K, n).
        freedom: How many motions the targets leave free where the arm is not singular.
    """
    singular, lost = np.zeros(len(joints), dtype=bool), _null_space(linearised(robot, target, joints)[1])
    free = _joints_in(lost) if freedom else np.zeros(joints.shape, dtype=bool)
    candidates = np.flatnonzero(_count(lost) > freedom)
    if len(candidates):
        some, start = target.rows(candidates), joints[candidates]
        direction = lost[candidates, -1]
        trial, errors, slopes = refined(robot, some, start + _STEP * direction, 8)
        moved = np.abs(np.einsum("kn,kn->k", trial - start, direction)) > 0.4 * _STEP
        there, met = _null_space(slopes), np.linalg.norm(errors, axis=1) <= MET
        real = moved & met & (_count(there) > freedom)
        singular[candidates[real]] = True
        free[candidates[real]] = _joints_in(there[real])
    return SelfMotions(singular, free)


def freedom_of(robot: Robot, target: IkTarget) -> int:
    """Return how many motions of its joints a flat target leaves to an arm that is not singular."""
    somewhere = starting_points(robot, _PLACES, 0)
    _, slopes = linearised(robot, target.rows(np.zeros(_PLACES, dtype=np.intp)), somewhere)
    lost = _null_space(slopes)
    return int(_count(lost).min())


def one_of_each(robot: Robot, joints: Array, valid: Flags, free: Flags, near: Array | None) -> Flags:
    """Return the valid branches (N, branches) without further members of a family already there.

    Where one joint or two (whose axes are in line) are free and the others agree, two answers are members of
    one family; the nearer to `near` (N, n) is kept, or the first. With more free joints a family may have
    parts that do not hang together, and all are kept.
    """
    keep, turning = valid.copy(), revolute(robot)
    few = (free.sum(axis=2) > 0) & (free.sum(axis=2) <= _IN_LINE)
    way = np.zeros(joints.shape) if near is None else joints - near[:, None]
    distance = np.abs(np.where(turning, way - FULL * np.round(way / FULL), way)).max(axis=2)
    for i in np.flatnonzero((few & keep).any(axis=0)):
        for j in range(i):
            alike = few[:, i] & keep[:, i] & keep[:, j] & (free[:, i] == free[:, j]).all(axis=1)
            if not alike.any():
                continue
            gap = joints[:, i] - joints[:, j]
            gap = np.where(turning, gap - FULL * np.round(gap / FULL), gap)
            same = alike & ((np.abs(gap) <= SAME) | free[:, i]).all(axis=1)
            further = distance[:, i] >= distance[:, j] - SAME
            keep[:, i] &= ~(same & further)
            keep[:, j] &= ~(same & ~further)
    return keep


def _null_space(slopes: Array) -> Array:
    """Return (K, n, n): rows that span the motions with the tcp at rest, zero for those that move it."""
    _, values, right = np.linalg.svd(slopes)
    size = np.zeros(right.shape[:2])
    size[:, : values.shape[1]] = values
    lost = size <= RANK * values[:, :1]
    return np.where(lost[..., None], right, 0.0)


def _count(lost: Array) -> NDArray[np.intp]:
    """Return how many independent motions the rows of a null space (K, n, n) span, shape (K,)."""
    return np.asarray(np.count_nonzero(lost.any(axis=2), axis=1))


def _joints_in(lost: Array) -> Flags:
    """Return the joints that take part in the motions of a null space, shape (K, n)."""
    return np.asarray((np.abs(lost) > _PART).any(axis=1))
