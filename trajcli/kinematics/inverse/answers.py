"""Candidate solutions of a flat batch: their residuals, their names, Newton refinement."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.geometry.rotation import Flags
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.families.method import Branch, IkMethod
from trajcli.kinematics.inverse.target import IkTarget, closure_of
from trajcli.kinematics.jacobian import FEW, poses_and_jacobians
from trajcli.kinematics.robot import Robot

_EXACT = 1e-14  # m and rad: nothing is left to take away
_ROUNDED = 1e-11  # m and rad: above, rounding has grown and one Newton step takes it away
_NEAR = 1e-5  # m and rad: further off, a branch does not exist and is left where it is


@dataclass(eq=False)
class Answers:
    """Answers. One row is one joint for all poses, as the closed forms give it: the poses are the last axis.

    Attributes:
        method: How they were computed.
        joints: Shape (n, branches, N), with the turns chosen where nothing is suspect.
        closure: Shape (2, branches, N), m and rad.
        valid: Shape (branches, N).
        suspect: Shape (N,): poses whose answers may be singular or repeat each other.
        free: Shape (n,): joints that are free in every answer; others are found where a pose is suspect.
        freedom: How many self-motions the targets leave where the arm is not singular.
        closed_form: Whether a closed form computed them.
    """

    method: IkMethod
    joints: Array
    closure: Array
    valid: Flags
    suspect: Flags
    free: Flags
    freedom: int
    closed_form: bool


def joined(parts: Sequence[Answers]) -> Answers:
    """Return answers of several blocks by one method as those of one batch."""
    joints, closure, valid, suspect = (
        np.concatenate([getattr(part, name) for part in parts], axis=-1)
        for name in ("joints", "closure", "valid", "suspect")
    )
    return replace(parts[0], joints=joints, closure=closure, valid=valid, suspect=suspect)


def by_name(answers: Answers, name_of: NDArray[np.intp], names: Sequence[Branch]) -> Answers:
    """Return answers in columns by name, at least one for each.

    Args:
        answers: In any order.
        name_of: Shape (branches, N): index of the name of each valid answer; -1 for the others.
        names: What they are called.
    """
    columns, taken = [], []
    for index in range(len(names)):
        mine = name_of == index
        count = max(1, int(np.count_nonzero(mine, axis=0).max(initial=0)))
        order = np.argsort(~mine, axis=0, kind="stable")[:count]
        taken.append((order, np.take_along_axis(mine, order, axis=0)))
        columns += [index] * len(order)
    order = np.concatenate([some for some, _ in taken])
    valid: Flags = np.concatenate([some for _, some in taken])
    joints: Array = np.take_along_axis(answers.joints, order[None], axis=1)
    closure: Array = np.take_along_axis(answers.closure, order[None], axis=1)
    method = replace(answers.method, labels=tuple(names[index] for index in columns))
    return replace(answers, method=method, joints=joints, closure=closure, valid=valid)


def closures(robot: Robot, target: IkTarget, joints: Array) -> Array:
    """Return how far joints (n, branches, N) are from flat targets, shape (2, branches, N)."""
    count, branches, poses = joints.shape
    repeated = target.rows(np.tile(np.arange(poses), branches))
    values = joints.reshape(count, -1).T
    if count > target.coordinates and len(values) <= FEW:
        poses_there = poses_and_jacobians(robot, values)[0]
    else:
        poses_there = forward(robot, values)
    closure = closure_of(repeated, poses_there)
    return closure.T.reshape(2, branches, poses).copy()


def rough(miss: Array) -> Flags:
    """Return which answers only rounding keeps from their targets, by how far they are away, m or rad."""
    return np.asarray((miss > _ROUNDED) & (miss < _NEAR))


def polish(
    robot: Robot, target: IkTarget, joints: Array, closure: Array, degenerate: Flags, rows: NDArray[np.intp]
) -> None:
    """Take rounding away from joints (n, branches, N) and closure (2, branches, N), in place.

    Args:
        robot: The arm.
        target: A flat batch of N.
        joints: Of a closed form.
        closure: How far they are from the targets.
        degenerate: Shape (N,): poses where two branches coincide, and are refined further.
        rows: The poses that have a `rough` answer, or are degenerate.
    """
    near = closure[:, :, rows]
    miss = np.maximum(near[0], near[1])
    poor = rough(miss) | (degenerate[rows] & (near[0] < _NEAR) & (miss > _EXACT))
    branches, columns = np.nonzero(poor)
    if len(columns):
        from trajcli.kinematics.inverse.numeric import refine

        poses = rows[columns]
        some = target.rows(poses)
        better = refine(robot, some, joints[:, branches, poses].T)
        joints[:, branches, poses] = better.T
        degenerate[poses] = True  # it may have moved onto its neighbour
        closure[:, branches, poses] = closure_of(some, forward(robot, better)).T
