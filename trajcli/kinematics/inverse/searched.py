"""Answers that are searched for: of arms and targets without a closed form, and about suspect poses.

Where a closed form is degenerate, two of its branches may be one, and a whole family of answers may pass
through one of them: a self-motion.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.geometry.rotation import Flags
from trajcli.kinematics.inverse.answers import Answers, closures
from trajcli.kinematics.inverse.families.method import IkMethod
from trajcli.kinematics.inverse.joint_turns import beyond, choose_turns
from trajcli.kinematics.inverse.numeric import distinct, recover_lost_solutions, search
from trajcli.kinematics.inverse.self_motion import (
    freedom_of,
    nearest_on_self_motions,
    one_per_self_motion,
    self_motions,
)
from trajcli.kinematics.inverse.target import IkTarget
from trajcli.kinematics.robot import Robot

_LAST = 1e6  # rad or m: sorts answers outside the limits behind all others
_KEPT = 16  # answers of a numeric search that are kept, the nearest
_SAME_ROOT = 2e-5  # rad or m: a double root is found so inexactly; halfway between both the target is met
_SAME_POINT = 1e-3  # rad or m: nearest points of self-motion manifolds that are no further apart are one


def numeric_instead(method: IkMethod, target: IkTarget) -> IkMethod:
    """Return the numeric method for targets that leave free what a closed form needs."""
    reason = (
        f"the target fixes {target.coordinates} coordinates, "
        f"the closed form ({method.name}) needs the whole {method.needs}"
    )
    return IkMethod("numeric: damped Newton from many seeds", "numeric", (), reason)


def by_search(
    robot: Robot, method: IkMethod, target: IkTarget, near: Array | None, tolerance: float
) -> Answers:
    """Return the nearest answers of a search; of self-motion manifolds their nearest points."""
    searched, freedom = search(robot, target, near, tolerance), freedom_of(robot, target)
    # from (N, seeds, n) to (n, seeds, N), and from (N, seeds) to (seeds, N)
    joints = np.ascontiguousarray(np.moveaxis(searched.joints, 0, -1).swapaxes(0, 1))
    valid = searched.met.T & (closures(robot, target, joints).max(axis=0) <= tolerance)
    choose_turns(robot, joints, None if near is None else near.T)
    aim = np.zeros((len(target.poses), len(joints))) if near is None else near
    if freedom:
        seeds, rows = np.nonzero(valid)
        moved = nearest_on_self_motions(robot, target.rows(rows), joints[:, seeds, rows].T, aim[rows])
        joints[:, seeds, rows] = moved.T
    return _nearest_first(robot, method, target, aim, joints, valid, freedom, tolerance)


def by_held_joint(
    robot: Robot, method: IkMethod, target: IkTarget, near: Array | None, tolerance: float
) -> Answers:
    """Return the answers of a redundant arm by the closed form that it has with its last joint held.

    Where that has no answer within the limits, the search goes on from seeds.
    """
    if not target.whole:
        return by_search(robot, numeric_instead(method, target), target, near, tolerance)
    from trajcli.kinematics.inverse.held_joint import points_by_held_joint

    aim = np.zeros((len(target.poses), len(robot.joints))) if near is None else near
    joints, valid = points_by_held_joint(robot, method, target, aim)
    answers = _nearest_first(robot, method, target, aim, joints, valid, 1, tolerance)
    inside = (beyond(answers.joints.T, robot.limits.position) == 0.0).all(axis=-1).T
    rows = np.flatnonzero(~(answers.valid & inside).any(axis=0))
    if len(rows):
        nearby = None if near is None else near[rows]
        searched = by_search(robot, method, target.rows(rows), nearby, tolerance)
        answers = _with_rows(answers, rows, searched)
    return answers


def _with_rows(answers: Answers, rows: NDArray[np.intp], others: Answers) -> Answers:
    branches = max(answers.valid.shape[0], others.valid.shape[0])
    arrays = []
    for name in ("joints", "closure", "valid"):
        own, other = (getattr(some, name) for some in (answers, others))
        own, other = (_filled(array, branches) for array in (own, other))
        own[..., rows] = other
        arrays.append(own)
    return replace(answers, joints=arrays[0], closure=arrays[1], valid=arrays[2])


def _filled(array: NDArray[Any], branches: int) -> NDArray[Any]:
    """Return (..., branches, N) with more branches: repetitions of the last, or none that are valid."""
    missing = branches - array.shape[-2]
    more = np.repeat(array[..., -1:, :], missing, axis=-2)
    return np.concatenate([array, more & False if more.dtype == bool else more], axis=-2)


def _nearest_first(
    robot: Robot,
    method: IkMethod,
    target: IkTarget,
    aim: Array,
    joints: Array,
    valid: Flags,
    freedom: int,
    tolerance: float,
) -> Answers:
    """Return joints (n, branches, N) that meet flat targets, the nearest to `aim` (N, n) first."""
    closure = closures(robot, target, joints)
    valid = valid & (closure.max(axis=0) <= tolerance)
    outside = (beyond(joints.T, robot.limits.position) != 0.0).any(axis=-1).T
    distance = np.abs(joints - aim.T[:, None])
    cost = np.square(distance).sum(axis=0) if freedom else distance.max(axis=0)
    cost = cost + np.where(outside, _LAST, 0.0)
    order = np.argsort(np.where(valid, cost, 2 * _LAST + closure.sum(axis=0)), axis=0, kind="stable")
    joints, valid = _ordered(joints, order), _ordered(valid, order)
    valid = distinct(robot, joints.transpose(2, 1, 0), valid.T, _SAME_POINT if freedom else _SAME_ROOT).T
    crowded = np.flatnonzero(valid.sum(axis=0) > _KEPT)
    if len(crowded) and not freedom:  # points of one family would leave no room for other answers
        valid[:, crowded] = _one_of_each_family(
            robot, target.rows(crowded), joints[:, :, crowded], valid[:, crowded], aim[crowded]
        )
    last = np.argsort(~valid, axis=0, kind="stable")
    last = last[: max(1, min(_KEPT, int(valid.sum(axis=0).max(initial=0))))]
    joints, closure, valid = (
        _ordered(joints, last),
        _ordered(_ordered(closure, order), last),
        _ordered(valid, last),
    )
    suspect, free = np.ones(valid.shape[1], dtype=bool), np.zeros(len(joints), dtype=bool)
    return Answers(method, joints, closure, valid, suspect, free, freedom, closed_form=False)


def _one_of_each_family(robot: Robot, target: IkTarget, joints: Array, valid: Flags, near: Array) -> Flags:
    """Return valid answers (seeds, N), of joints (n, seeds, N), without further points of self-motions."""
    poses_first = joints.transpose(2, 1, 0)
    rows, seeds = np.nonzero(valid.T)
    free = np.zeros(poses_first.shape, dtype=bool)
    free[rows, seeds] = self_motions(robot, target.rows(rows), poses_first[rows, seeds]).free
    return one_per_self_motion(robot, poses_first, valid.T, free, near).T


def _ordered(array: NDArray[Any], order: NDArray[np.intp]) -> NDArray[Any]:
    """Return (..., branches, N) with the branches of each pose in an order (kept, N)."""
    return np.asarray(array[..., order, np.arange(order.shape[1])])


def resolve_suspects(
    robot: Robot, target: IkTarget, answers: Answers, near: Array | None, tolerance: float
) -> tuple[Flags, Flags]:
    """Find the self-motions of suspect poses, move along them, drop repetitions, choose turns; in place.

    Where the targets leave some freedom the answers are the nearest points already. Return what is singular
    (branches, N) and which joints are free (n, branches, N).
    """
    singular, free = np.zeros(answers.valid.shape, dtype=bool), np.zeros(answers.joints.shape, dtype=bool)
    if answers.free.any():
        free[:] = answers.free[:, None, None] & answers.valid
    suspects = np.flatnonzero(answers.suspect)
    some, nearby = target.rows(suspects), None if near is None else near[suspects]
    # from here (suspects, branches, n) and (suspects, branches): poses first, joints last
    before = answers.joints[:, :, suspects].transpose(2, 1, 0)
    joints, valid = before.copy(), answers.valid[:, suspects].T.copy()
    some_singular, some_free = _self_motions_of(robot, some, joints, valid, answers.freedom, nearby)
    if not answers.freedom:  # the nearest points are distinct
        valid = distinct(robot, joints, valid)
    if (
        answers.closed_form
        and not answers.freedom
        and recover_lost_solutions(robot, some, joints, valid, some_singular, nearby)
    ):
        some_singular, some_free = _self_motions_of(robot, some, joints, valid, 0, nearby)
    if (joints != before).any():
        closure = closures(robot, some, joints.transpose(2, 1, 0))
        valid = distinct(robot, joints, valid & (closure.max(axis=0) <= tolerance).T)
        answers.closure[:, :, suspects] = closure
    if not answers.freedom:
        valid = one_per_self_motion(robot, joints, valid, some_free, nearby)
    choose_turns(robot, joints.transpose(2, 1, 0), None if nearby is None else nearby.T)
    answers.joints[:, :, suspects], answers.valid[:, suspects] = joints.transpose(2, 1, 0), valid.T
    singular[:, suspects] = (some_singular & valid).T
    free[:, :, suspects] = (some_free & valid[..., None]).transpose(2, 1, 0)
    return singular, free


def _self_motions_of(
    robot: Robot, target: IkTarget, joints: Array, valid: Flags, freedom: int, near: Array | None
) -> tuple[Flags, Flags]:
    """Return what is singular (N, branches) of valid joints (N, branches, n), and which joints are free.

    Singular ones of targets that leave no freedom elsewhere are moved, in place, to the nearest points of
    their manifolds.
    """
    singular, free = np.zeros(valid.shape, dtype=bool), np.zeros(joints.shape, dtype=bool)
    rows, branches = np.nonzero(valid)
    if not len(rows):
        return singular, free
    motions = self_motions(robot, target.rows(rows), joints[rows, branches], freedom)
    singular[rows, branches], free[rows, branches] = motions.singular, motions.free
    if near is not None and not freedom and motions.singular.any():
        rows, branches = rows[motions.singular], branches[motions.singular]
        joints[rows, branches] = nearest_on_self_motions(
            robot, target.rows(rows), joints[rows, branches], near[rows]
        )
    return singular, free
