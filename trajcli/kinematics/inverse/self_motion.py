"""Self-motions: the joints that move while what the target fixes rests, and singular configurations.

A self-motion need not be singular: a target that fixes less than the arm can do leaves some everywhere. An
arm is singular where its Jacobian has less rank than elsewhere, and counts as that only if it really has more
self-motions: a small step along a direction of the null space is taken and corrected, and counts if the tcp
is back, the joints are not, and the rank is less there too. A stretched elbow fails that, an aligned wrist
does not.

The point of a self-motion manifold nearest to a configuration, inside the limits, is found by gradient
descent on the square of the distance: the direction is the gap projected onto the null space, the length of
the step follows from the last two (Barzilai and Borwein). Their distances need not fall at every step, and
arrive sooner than if they had to. A joint at its limit that would pass it is held. The result is the nearest
of all around it, not of all there are.

Source: Nocedal and Wright (2006), section 16.7; Barzilai and Borwein, Two-point step size gradient methods,
IMA J. Numerical Analysis 8 (1988).
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
RANK = 3e-9  # of the largest singular value: the null space is below
MET = 1e-10  # scaled error with which a configuration still meets the target
_NEARLY_MET = 1e-4  # the same during the descent
_ROUNDS = 60
_LONGEST = 0.5  # rad or m, of one step
_ARRIVED = 1e-11  # rad or m of the projected gap
_STUCK = 1e-5  # of a whole step: no shorter one is tried
_GROWS = 4.0  # times, at most, a step is longer than the one before
_CORRECTIONS = 2
_REFUSALS = 4  # then the next step is not allowed, and the descent ends
_AT_LIMIT = 1e-10  # rad or m
_LOST = 1e-9  # of the largest singular value
_TRIAL = 0.05  # rad or m: large against what a correction may lose
_PART = 1e-6  # of a unit direction: a joint with less takes no part
_CONFIGURATIONS = 8  # configurations among which one is not singular
_IN_LINE = 2  # joints that two axes in line leave free together


@frozen
class SelfMotions:
    """The self-motions of K configurations.

    Attributes:
        singular: Shape (K,): the arm has more of them than the targets leave elsewhere.
        free: Shape (K, n), the joints that take part.
    """

    singular: Flags
    free: Flags


def self_motions(robot: Robot, target: IkTarget, joints: Array, freedom: int = 0) -> SelfMotions:
    """Return the self-motions of configurations (K, n) that meet a flat target.

    Args:
        robot: The arm.
        target: A flat batch of K.
        joints: Shape (K, n).
        freedom: How many self-motions the targets leave where the arm is not singular.
    """
    singular, idle = np.zeros(len(joints), dtype=bool), _null_space(linearised(robot, target, joints)[1])
    free = _joints_in(idle) if freedom else np.zeros(joints.shape, dtype=bool)
    suspects = np.flatnonzero(_count(idle) > freedom)
    if len(suspects):
        some, start = target.rows(suspects), joints[suspects]
        direction = idle[suspects, -1]
        trial, errors, slopes = refined(robot, some, start + _TRIAL * direction, 8)
        moved = np.abs(np.einsum("kn,kn->k", trial - start, direction)) > 0.4 * _TRIAL
        idle_there, met = _null_space(slopes), np.linalg.norm(errors, axis=1) <= MET
        confirmed = moved & met & (_count(idle_there) > freedom)
        singular[suspects[confirmed]] = True
        free[suspects[confirmed]] = _joints_in(idle_there[confirmed])
    return SelfMotions(singular, free)


def freedom_of(robot: Robot, target: IkTarget) -> int:
    """Return how many self-motions a flat target leaves to an arm that is not singular."""
    spread = starting_points(robot, _CONFIGURATIONS, 0)
    _, slopes = linearised(robot, target.rows(np.zeros(_CONFIGURATIONS, dtype=np.intp)), spread)
    idle = _null_space(slopes)
    return int(_count(idle).min())


def one_per_self_motion(robot: Robot, joints: Array, valid: Flags, free: Flags, near: Array | None) -> Flags:
    """Return the valid branches (N, branches) without further points of a self-motion manifold.

    Where one joint or two (whose axes are in line) are free and the others agree, two solutions are points of
    one manifold; the nearer to `near` (N, n) is kept, or the first. With more free joints a manifold may have
    parts that are not connected, and all are kept.
    """
    keep, turning = valid.copy(), revolute(robot)
    few = (free.sum(axis=2) > 0) & (free.sum(axis=2) <= _IN_LINE)
    offset = np.zeros(joints.shape) if near is None else joints - near[:, None]
    distance = np.abs(np.where(turning, offset - FULL * np.round(offset / FULL), offset)).max(axis=2)
    for i in np.flatnonzero((few & keep).any(axis=0)):
        for j in np.flatnonzero(keep[:, :i].any(axis=0)):
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
    """Return (K, n, n): rows that span the self-motions, zero for directions that move the tcp."""
    _, values, right = np.linalg.svd(slopes)
    size = np.zeros(right.shape[:2])
    size[:, : values.shape[1]] = values
    idle = size <= RANK * values[:, :1]
    return np.where(idle[..., None], right, 0.0)


def _count(idle: Array) -> NDArray[np.intp]:
    """Return how many independent motions the rows of a null space (K, n, n) span, shape (K,)."""
    return np.asarray(np.count_nonzero(idle.any(axis=2), axis=1))


def _joints_in(idle: Array) -> Flags:
    """Return the joints that take part in the motions of a null space, shape (K, n)."""
    return np.asarray((np.abs(idle) > _PART).any(axis=1))


def nearest_on_self_motions(
    robot: Robot, target: IkTarget, joints: Array, near: Array, allowed: Allowed | None = None
) -> Array:
    """Return the points (K, n) nearest to `near` on the self-motion manifolds of configurations.

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
    descent = _Descent(robot, target, start, near, allowed)
    for _ in range(_ROUNDS):
        if not descent.step():
            break
    return descent.end()


class _Descent:
    """Gradient descents of K rows at once.

    Attributes:
        joints: Shape (K, n), so far.
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
        self._last_direction: Array = np.zeros_like(start)  # of the step before
        self._moved: Array = np.zeros_like(start)

    def step(self) -> bool:
        """Move all running rows once; return whether any is left."""
        direction = self._direction(self._running)
        self._choose_lengths(direction)
        moving = np.abs(direction).max(axis=1, initial=0.0) > _ARRIVED
        moving &= (self._length[self._running] > _STUCK) & (self._refused[self._running] <= _REFUSALS)
        rows, direction = self._running[moving], direction[moving]
        self._running = rows
        if not len(rows):
            return False
        start = self.joints[rows]
        step = direction * self._length[rows, None]
        step *= np.minimum(1.0, _LONGEST / np.maximum(np.abs(step).max(axis=1, keepdims=True), _LONGEST))
        trial, accepted = self._corrected(rows, start + step, _NEARLY_MET)
        if self._allowed is not None and accepted.any():
            candidates = np.flatnonzero(accepted)
            accepted[candidates] = self._allowed(rows[candidates], trial[candidates])
            self._refused[rows[candidates[~accepted[candidates]]]] += 1
        self._last_direction[rows], self._moved[rows] = (
            direction,
            np.where(accepted[:, None], trial - start, 0.0),
        )
        self._length[rows] = np.where(accepted, self._length[rows], 0.25 * self._length[rows])
        self.joints[rows[accepted]] = trial[accepted]
        return True

    def end(self) -> Array:
        """Return the ends (K, n) of all rows; the start where the end does not meet the target."""
        final, accepted = self._corrected(np.arange(len(self.joints)), self.joints, MET)
        return np.where(accepted[:, None], final, self._start)

    def _direction(self, rows: NDArray[np.intp]) -> Array:
        """Return the gap (K, n) projected onto the self-motions inside the limits."""
        q, target = self.joints[rows], self._target.rows(rows)
        gap = self._near[rows] - q
        _, slopes = linearised(self._robot, target, q)
        direction = _null_space_part(slopes, gap)
        held = np.zeros(q.shape, dtype=bool)
        for _ in range(2):  # once held, a joint may press another one against its limit
            at_limit = ((q >= self._high[rows] - _AT_LIMIT) & (direction > 0.0)) | (
                (q <= self._low[rows] + _AT_LIMIT) & (direction < 0.0)
            )
            if not at_limit.any():
                break
            held |= at_limit
            bars = held[:, :, None] * np.eye(q.shape[1])
            direction = np.where(held, 0.0, _null_space_part(np.concatenate([slopes, bars], axis=1), gap))
        return direction

    def _choose_lengths(self, direction: Array) -> None:
        """Choose the lengths of the next steps from how the direction changed in the last one."""
        rows = self._running
        moved = self._moved[rows]
        change = np.einsum("kn,kn->k", moved, self._last_direction[rows] - direction)
        square = np.square(moved).sum(axis=1)
        curved = change > square / _GROWS / self._length[rows]
        longer = np.where(curved, square / np.where(curved, change, 1.0), _GROWS * self._length[rows])
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


def _null_space_part(slopes: Array, gap: Array) -> Array:
    """Return the part (K, n) of joint motions in the null space of the slopes (K, m, n)."""
    outside = np.linalg.pinv(slopes, rcond=_LOST) @ (slopes @ gap[..., None])
    return np.asarray(gap - outside[..., 0])
