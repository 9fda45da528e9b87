"""Families of answers: which joints are free together, and where the arm is singular.

A family exists where the arm can move while what the target fixes rests. That need not be singular: a target
that fixes less than the arm can do leaves some freedom everywhere. An arm is singular where its Jacobian has
less rank than elsewhere, and counts as that only if it really can move in more ways: a small step along a
lost direction is taken and corrected, and counts if the tcp is back, the joints are not, and the rank is less
there too. A stretched elbow fails that, an aligned wrist does not.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.frozen import frozen
from trajcli.geometry.rotation import Flags
from trajcli.kinematics.inverse.nearest_member import MET
from trajcli.kinematics.inverse.numeric import SAME, linearised, refined, starting_points
from trajcli.kinematics.inverse.target import Target
from trajcli.kinematics.inverse.turns import FULL, revolute
from trajcli.kinematics.robot import Robot

RANK = 3e-9  # of the largest singular value
_STEP = 0.05  # rad or m: large against what a correction may lose
_PART = 1e-6  # of a unit direction: a joint with less takes no part
_PLACES = 8  # configurations among which one is not singular
_IN_LINE = 2  # joints that two axes in line leave free together


@frozen
class Families:
    """What is known of K configurations.

    Attributes:
        singular: Shape (K,): the arm can move in more ways than the targets leave free elsewhere.
        free: Shape (K, n), the joints that are free together.
    """

    singular: Flags
    free: Flags


def families(robot: Robot, target: Target, joints: Array, freedom: int = 0) -> Families:
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
    return Families(singular, free)


def freedom_of(robot: Robot, target: Target) -> int:
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
