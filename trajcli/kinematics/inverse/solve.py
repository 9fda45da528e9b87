"""Inverse kinematics: every solution of a robot for its targets, by closed form or by search."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError
from trajcli.geometry.rotation import AXES, Flags
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.answers import Answers, by_name, closures, polish, rough
from trajcli.kinematics.inverse.families.batch import candidates
from trajcli.kinematics.inverse.families.choose import method_for
from trajcli.kinematics.inverse.families.method import IkMethod
from trajcli.kinematics.inverse.families.screw_axes import PARALLEL, AxisGeometry, axis_geometry
from trajcli.kinematics.inverse.joint_turns import beyond, choose_turns
from trajcli.kinematics.inverse.numeric import distinct, recover_lost_solutions, search
from trajcli.kinematics.inverse.self_motion import (
    freedom_of,
    nearest_on_self_motions,
    one_per_self_motion,
    self_motions,
)
from trajcli.kinematics.inverse.solutions import Solutions
from trajcli.kinematics.inverse.target import IkTarget, partial_target, pose_target
from trajcli.kinematics.robot import Robot
from trajcli.kinematics.serial_chain import configurations

if TYPE_CHECKING:
    from trajcli.kinematics.inverse.partial_targets import Postures

TOLERANCE = 1e-9  # m and rad: what a branch may miss its target by
_LAST = 1e6  # rad or m: sorts answers outside the limits behind all others
_KEPT = 16  # answers of a numeric search that are kept, the nearest
_SAME_ROOT = 2e-5  # rad or m: a double root is found so inexactly; halfway between both the target is met
_SAME_POINT = 1e-3  # rad or m: nearest points of self-motion manifolds that are no further apart are one


def solve(
    robot: Robot, target: IkTarget | ArrayLike, near: ArrayLike | None = None, tolerance: float = TOLERANCE
) -> Solutions:
    """Return every configuration of a robot that meets its targets.

    Args:
        robot: Its base, tool and limits count.
        target: Poses T_world_tcp (*batch, 4, 4), or an `IkTarget` that fixes fewer coordinates.
        near: Joint values (*batch, n) or (n,), which decide between full turns of a joint, between points of
            a self-motion manifold, and between the solutions of a redundant arm; zero if absent.
        tolerance: What a valid branch may miss its target by, m and rad.

    Raises:
        InputError: When the robot has no geometry, a target or near is malformed, or the tolerance is not
            positive; or when a target gives the yaw of a tool axis that is always vertical.
    """
    if not tolerance > 0.0:
        raise InputError(f"the tolerance must be positive, it is {tolerance:.6g}")
    targets = target if isinstance(target, IkTarget) else pose_target(target)
    arm, flat = axis_geometry(robot), targets.flat()
    nearby = _near(robot, near, targets.batch)
    unturned = flat.orientation in ("direction", "yaw", "pitch") and _is_unturned(robot, arm, flat)
    answers = _answers(robot, arm, flat, nearby, tolerance)
    singular, free = _resolve_suspects(robot, flat, answers, nearby, tolerance)
    # all are (n, branches, N); the closure (2, branches, N), flags (1, branches, N)
    by_joint = (answers.joints, answers.valid[None], answers.closure, singular[None], free)
    joints, valid, closure, is_singular, is_free = (_batch_first(array, targets.batch) for array in by_joint)
    bounds, fixed = robot.limits.position, flat.tool_axis if unturned else None
    return Solutions(
        answers.method, joints, valid[..., 0], closure, is_singular[..., 0], is_free, bounds, fixed
    )


def reached_if_turned(robot: Robot, target: IkTarget) -> bool:
    """Return whether one target is met where its orientation, if it fixes any of it, is left free."""
    if target.orientation == "none":
        return False
    free = partial_target(target.flat().poses[0, :3, 3], fixed=target.position)
    return bool(solve(robot, free).valid.any())


def _answers(
    robot: Robot, arm: AxisGeometry, target: IkTarget, near: Array | None, tolerance: float
) -> Answers:
    """Return the answers of the method that fits the arm and the targets."""
    method = method_for(robot)
    if method.held is not None:
        return _by_held_joint(robot, method, target, near, tolerance)
    if method.solve is None:
        return _by_search(robot, method, target, near, tolerance)
    if fits(method, target, robot.base):
        return _by_closed_form(robot, arm, method, target, near, tolerance)
    from trajcli.kinematics.inverse.partial_targets import Postures, by_postures

    if method.needs == "pose":
        start = np.zeros((len(target.poses), len(arm.axes))) if near is None else near
        answers = by_postures(robot, arm, method, target, start, tolerance)
        if answers is not None:
            return answers
    answers = _by_search(robot, numeric_instead(method, target), target, near, tolerance)
    return _with_names(answers, Postures(robot, arm, method, 1, target.tool_axis))


def _with_names(answers: Answers, postures: Postures) -> Answers:
    """Return the answers of a search sorted by the branches of the closed form for their whole poses."""
    columns, rows = np.nonzero(answers.valid)
    branch = np.full(answers.valid.shape, -1)
    if len(rows):
        joints = answers.joints[:, columns, rows].T
        branch[columns, rows] = postures.branch(joints, forward(postures.robot, joints))[0]
    return by_name(answers, branch, postures.method.branches)


def _batch_first(array: NDArray[Any], batch: tuple[int, ...]) -> NDArray[Any]:
    """Return (k, branches, N) as a view (*batch, branches, k)."""
    return np.moveaxis(array.reshape(*array.shape[:2], *batch), (0, 1), (-1, -2))


def fits(method: IkMethod, target: IkTarget, base: Array) -> bool:
    """Return whether a closed form answers targets of this kind, with T_world_base (4, 4)."""
    if method.needs == "pose":
        return target.whole
    idle = np.zeros(3) if method.idle is None else base[:3, :3] @ np.array(method.idle)
    unfixed = ~np.array(target.position)
    return not unfixed.any() or bool(np.abs(idle[unfixed]).min() >= 1.0 - PARALLEL)


def numeric_instead(method: IkMethod, target: IkTarget) -> IkMethod:
    """Return the numeric method for targets that leave free what a closed form needs."""
    reason = (
        f"the target fixes {target.coordinates} coordinates, "
        f"the closed form ({method.name}) needs the whole {method.needs}"
    )
    return IkMethod("numeric: damped Newton from many seeds", "numeric", (), reason)


def _near(robot: Robot, near: ArrayLike | None, batch: tuple[int, ...]) -> Array | None:
    if near is None:
        return None
    values = configurations(robot, near, "the configuration to be near to")
    return np.broadcast_to(values, (*batch, values.shape[-1])).reshape(-1, values.shape[-1])


def _is_unturned(robot: Robot, arm: AxisGeometry, target: IkTarget) -> bool:
    """Return whether no joint turns the tool axis that a target means.

    Raises:
        InputError: When its yaw is asked for, and it is always vertical.
    """
    from trajcli.kinematics.inverse.tool_axis import always_vertical, fixed_axis

    unturned = fixed_axis(arm, target.tool_axis)
    if unturned and target.orientation == "yaw" and always_vertical(arm, target.tool_axis):
        others = " or ".join(axis for axis in AXES if axis != target.tool_axis)
        raise InputError(
            f"the {target.tool_axis} axis of the tool of {robot.name} is always vertical and has no yaw",
            hint=f"say which axis of the tool heads there, with `tool_axis: {others}`",
        )
    return unturned


def _by_closed_form(
    robot: Robot, arm: AxisGeometry, method: IkMethod, target: IkTarget, near: Array | None, tolerance: float
) -> Answers:
    count = len(target.poses)
    valid, poor = np.zeros((len(method.branches), count), dtype=bool), np.zeros(count, dtype=bool)

    def on_block(rows: slice, joints: Array, closure: Array) -> None:
        if not target.whole:
            closure[:] = closures(robot, target.rows(rows), joints)
        miss = np.maximum(closure[0], closure[1])
        valid[:, rows], poor[rows] = miss <= tolerance, rough(miss).any(axis=0)
        choose_turns(robot, joints, None if near is None else near[rows].T, np.pi)

    raw = candidates(robot, arm, method, target.poses, on_block)
    joints, closure, degenerate = raw.joints, raw.residuals, raw.degenerate
    rows = np.flatnonzero(poor | degenerate)
    if len(rows):
        polish(robot, target, joints, closure, degenerate, rows)
        valid[:, rows] = closure[:, :, rows].max(axis=0) <= tolerance
    if tolerance > TOLERANCE:  # branches that end where none meets the target exactly may be one
        degenerate |= (valid & (closure.max(axis=0) > TOLERANCE)).any(axis=0)
    missed = np.flatnonzero(~valid.any(axis=0))
    if len(missed):
        closure[..., missed] = closures(robot, target.rows(missed), joints[..., missed])
    return Answers(
        method, joints, closure, valid, degenerate, np.zeros(len(joints), dtype=bool), 0, closed_form=True
    )


def _by_search(
    robot: Robot, method: IkMethod, target: IkTarget, near: Array | None, tolerance: float
) -> Answers:
    """Return the nearest answers of a search; of self-motion manifolds their nearest points."""
    searched, freedom = search(robot, target, near), freedom_of(robot, target)
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


def _by_held_joint(
    robot: Robot, method: IkMethod, target: IkTarget, near: Array | None, tolerance: float
) -> Answers:
    """Return the answers of a redundant arm by the closed form that it has with its last joint held.

    Where that has no answer within the limits, the search goes on from seeds.
    """
    if not target.whole:
        return _by_search(robot, numeric_instead(method, target), target, near, tolerance)
    from trajcli.kinematics.inverse.held_joint import points_by_held_joint

    aim = np.zeros((len(target.poses), len(robot.joints))) if near is None else near
    joints, valid = points_by_held_joint(robot, method, target, aim)
    answers = _nearest_first(robot, method, target, aim, joints, valid, 1, tolerance)
    inside = (beyond(answers.joints.T, robot.limits.position) == 0.0).all(axis=-1).T
    rows = np.flatnonzero(~(answers.valid & inside).any(axis=0))
    if len(rows):
        nearby = None if near is None else near[rows]
        searched = _by_search(robot, method, target.rows(rows), nearby, tolerance)
        answers = _with_rows(answers, rows, searched)
    return answers


def _with_rows(answers: Answers, rows: NDArray[np.intp], others: Answers) -> Answers:
    """Return the answers with those of some poses replaced."""
    most = max(answers.valid.shape[0], others.valid.shape[0])
    arrays = []
    for name in ("joints", "closure", "valid"):
        own, other = (getattr(some, name) for some in (answers, others))
        own, other = (_filled(array, most) for array in (own, other))
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
    return np.take_along_axis(array, order.reshape(*(1,) * (array.ndim - 2), *order.shape), axis=-2)


def _resolve_suspects(
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
    if not len(suspects):
        return singular, free
    some, nearby = target.rows(suspects), None if near is None else near[suspects]
    # from here (suspects, branches, n) and (suspects, branches): poses first, joints last
    before = answers.joints[:, :, suspects].transpose(2, 1, 0)
    joints, valid = before.copy(), answers.valid[:, suspects].T.copy()
    some_singular, some_free = _self_motions_of(robot, some, joints, valid, answers.freedom, nearby)
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
    singular[:, suspects], free[:, :, suspects] = (some_singular & valid).T, some_free.transpose(2, 1, 0)
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
    known = self_motions(robot, target.rows(rows), joints[rows, branches], freedom)
    singular[rows, branches], free[rows, branches] = known.singular, known.free
    if near is not None and not freedom and known.singular.any():
        rows, branches = rows[known.singular], branches[known.singular]
        joints[rows, branches] = nearest_on_self_motions(
            robot, target.rows(rows), joints[rows, branches], near[rows]
        )
    return singular, free
