"""Answers that a closed form misses where it is singular, found by search and put in free places.

At a singular pose a closed form takes one member of the family before it knows whether the joints that come
after can follow: a UR with its wrist aligned may reach the pose with some turns of joint 6 and not with
others. The search starts from the given configuration; where no branch is valid, from all seeds.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.geometry.rotation import Flags
from trajcli.kinematics.inverse.numeric import SAME, descend, search
from trajcli.kinematics.inverse.target import Target
from trajcli.kinematics.inverse.turns import FULL, revolute
from trajcli.kinematics.robot import Robot

_LAST = 1e6  # rad or m: free places come before taken ones


def complete(
    robot: Robot, target: Target, joints: Array, valid: Flags, singular: Flags, near: Array | None
) -> bool:
    """Put answers that are missing into `joints` (N, branches, n) and mark them in `valid`, both in place.

    An answer takes the place of the branch that is not valid and comes nearest to it, so that it keeps that
    branch's name; where all are valid, of the nearest other member of a family.

    Args:
        robot: The arm.
        target: A flat batch of N, the suspect poses.
        joints: Shape (N, branches, n).
        valid: Shape (N, branches).
        singular: Shape (N, branches): which valid ones belong to a family.
        near: Shape (N, n); None for none.

    Returns:
        Whether anything was put in.
    """
    changed = False
    if near is not None:
        answers, met = descend(robot, target, near, None)
        changed |= _place(robot, joints, valid, singular, (np.flatnonzero(met), answers[met]))
    rows = np.flatnonzero(~valid.any(axis=1))
    if len(rows):
        found = search(robot, target.rows(rows), None)
        for answer in range(found.joints.shape[1]):
            some = found.found[:, answer]
            changed |= _place(robot, joints, valid, singular, (rows[some], found.joints[some, answer]))
    return changed


def _place(
    robot: Robot, joints: Array, valid: Flags, singular: Flags, answers: tuple[NDArray[np.intp], Array]
) -> bool:
    rows, values = answers
    gap = joints[rows] - values[:, None]
    gap = np.abs(np.where(revolute(robot), gap - FULL * np.round(gap / FULL), gap)).max(axis=-1)
    known = (valid[rows] & (gap <= SAME)).any(axis=1)
    fixed = valid[rows] & ~singular[rows]
    cost = np.where(fixed, np.inf, gap + np.where(valid[rows], _LAST, 0.0))
    branch = np.argmin(cost, axis=1)
    new = ~known & ~fixed.all(axis=1)
    joints[rows[new], branch[new]] = values[new]
    valid[rows[new], branch[new]] = True
    return bool(new.any())
