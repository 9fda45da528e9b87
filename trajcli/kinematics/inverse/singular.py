"""Singular answers: which joints are free together, and the member of the family nearest to a configuration.

An arm is singular where its Jacobian loses rank. A family of answers exists only if the arm can really move
while the tcp rests: a small step along the lost direction is taken and corrected, and counts if the tcp is
back while the joints are not. A stretched elbow fails that, an aligned wrist does not.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.geometry.rotation import Flags
from trajcli.kinematics.inverse.numeric import SAME, linearised, refine
from trajcli.kinematics.inverse.target import Target
from trajcli.kinematics.inverse.turns import FULL, revolute
from trajcli.kinematics.robot import Robot

RANK = 3e-9  # of the largest singular value
_STEP = 0.05  # rad or m: large against what a correction may lose
_MET = 1e-10  # scaled error with which a member still meets the target
_PART = 1e-6  # of a unit direction: a joint with less takes no part
_MOVES = 30
_IN_LINE = 2  # joints that two axes in line leave free together


@dataclass(frozen=True, eq=False)
class Families:
    """What is known of K configurations.

    Attributes:
        joints: Shape (K, n), the members nearest to the given configurations.
        singular: Shape (K,).
        free: Shape (K, n), the joints that are free together.
    """

    joints: Array
    singular: Flags
    free: Flags


def families(robot: Robot, target: Target, joints: Array, near: Array | None) -> Families:
    """Return the families that configurations (K, n), which meet the flat target, belong to.

    Args:
        robot: The arm.
        target: A flat batch of K.
        joints: Shape (K, n).
        near: Shape (K, n), whose nearest members are returned; None leaves the configurations as they are.
    """
    result, free = joints.copy(), np.zeros(joints.shape, dtype=bool)
    lost = _null_space(robot, target, joints)
    candidates = np.flatnonzero(lost.any(axis=(1, 2)))
    if len(candidates):
        some, start = target.rows(candidates), joints[candidates]
        direction = lost[candidates, -1]
        trial = refine(robot, some, start + _STEP * direction, 8)
        moved = np.abs(np.einsum("kn,kn->k", trial - start, direction)) > 0.4 * _STEP
        real = moved & _met(robot, some, trial)
        free[candidates[real]] = (np.abs(_null_space(robot, some.rows(real), trial[real])) > _PART).any(
            axis=1
        )
    singular = np.asarray(free.any(axis=1))
    rows = np.flatnonzero(singular)
    if near is not None and len(rows):
        result[rows] = _nearest_member(robot, target.rows(rows), joints[rows], near[rows])
    return Families(result, singular, free)


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
    for i in range(1, valid.shape[1]):
        for j in range(i):
            gap = joints[:, i] - joints[:, j]
            gap = np.where(turning, gap - FULL * np.round(gap / FULL), gap)
            agree = ((np.abs(gap) <= SAME) | free[:, i]).all(axis=1) & (free[:, i] == free[:, j]).all(axis=1)
            same = agree & few[:, i] & keep[:, i] & keep[:, j]
            further = distance[:, i] >= distance[:, j] - SAME
            keep[:, i] &= ~(same & further)
            keep[:, j] &= ~(same & ~further)
    return keep


def _null_space(robot: Robot, target: Target, joints: Array) -> Array:
    """Return (K, n, n): rows that span the motions with the tcp at rest, zero for those that move it."""
    _, slopes = linearised(robot, target, joints)
    _, values, right = np.linalg.svd(slopes)
    size = np.zeros(joints.shape)
    size[:, : values.shape[1]] = values
    lost = size <= RANK * values[:, :1]
    return np.where(lost[..., None], right, 0.0)


def _met(robot: Robot, target: Target, joints: Array) -> Flags:
    errors, _ = linearised(robot, target, joints)
    return np.asarray(np.linalg.norm(errors, axis=1) <= _MET)


def _nearest_member(robot: Robot, target: Target, joints: Array, near: Array) -> Array:
    """Return members of the families with no way left, inside the family, towards `near`."""
    turning, q = revolute(robot), joints
    for _ in range(_MOVES):
        gap = near - q
        gap = np.where(turning, gap - FULL * np.round(gap / FULL), gap)
        lost = _null_space(robot, target, q)
        step = np.einsum("kij,ki->kj", lost, np.einsum("kij,kj->ki", lost, gap))
        if np.abs(step).max(initial=0.0) < _MET:
            break
        moved = refine(robot, target, q + np.clip(step, -1.0, 1.0), 3)
        q = np.where(_met(robot, target, moved)[:, None], moved, q)
    return np.asarray(q)
