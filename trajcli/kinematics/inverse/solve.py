"""Every answer of inverse kinematics: the way from a robot and its targets to `Solutions`."""

from __future__ import annotations

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
from trajcli.kinematics.inverse.numeric import SAME, distinct, recover_lost_solutions, search
from trajcli.kinematics.inverse.self_motion import (
    freedom_of,
    nearest_on_self_motions,
    one_of_each,
    self_motions,
)
from trajcli.kinematics.inverse.solutions import Solutions
from trajcli.kinematics.inverse.target import IkTarget, pose_target
from trajcli.kinematics.robot import Robot
from trajcli.kinematics.serial_chain import configurations

if TYPE_CHECKING:
    from trajcli.kinematics.inverse.partial_targets import Postures

TOLERANCE = 1e-9  # m and rad: what a branch may miss its target by
_LAST = 1e6  # rad or m: sorts answers outside the limits behind all others
_KEPT = 16  # answers of a numeric search that are kept, the nearest
_SAME_MEMBER = 1e-3  # rad or m: nearest members of families that are no further apart are one


def solve(
    robot: Robot, target: IkTarget | ArrayLike, near: ArrayLike | None = None, tolerance: float = TOLERANCE
) -> Solutions:
    """Return every configuration of a robot that meets its targets.

    Args:
        robot: Its base, tool and limits count.
        target: Poses T_world_tcp (*batch, 4, 4), or a `Target` that fixes fewer coordinates.
        near: Joint values (*batch, n) or (n,), which decide between full turns of a joint, between members of
            a family, and between the answers of a redundant arm; zero if absent.
        tolerance: What a valid branch may miss its target by, m and rad.

    Raises:
        InputError: When the robot has no geometry, a target or near is malformed, or the tolerance is not
            positive; or when a target gives the yaw of a tool axis that is always vertical.
    """
    if not tolerance > 0.0:
        raise InputError(f"the tolerance must be positive, it is {tolerance:.6g}")
    wanted = target if isinstance(target, IkTarget) else pose_target(target)
    arm, flat = axis_geometry(robot), wanted.flat()
    close_to = _near(robot, near, wanted.batch)
    stuck = flat.orientation in ("direction", "yaw", "pitch") and _is_stuck(robot, arm, flat)
    found = _find(robot, arm, flat, close_to, tolerance)
    singular, free = _resolve(robot, flat, found, close_to, tolerance)
    arrays = (found.joints, found.closure, free, found.valid[None], singular[None])
    joints, closure, freed, valid, lost = (_batch_first(array, wanted.batch) for array in arrays)
    bounds, fixed = robot.limits.position, flat.tool_axis if stuck else None
    return Solutions(found.method, joints, valid[..., 0], closure, lost[..., 0], freed, bounds, fixed)


def _find(robot: Robot, arm: AxisGeometry, target: IkTarget, near: Array | None, tolerance: float) -> Answers:
    """Return the answers of the method that fits the arm and the targets."""
    method = method_for(robot)
    if method.solve is None:
        return _searched(robot, method, target, near, tolerance)
    if fits(method, target, robot.base):
        return _closed(robot, arm, method, target, near, tolerance)
    from trajcli.kinematics.inverse.partial_targets import Postures, by_postures

    if method.needs == "pose":
        start = np.zeros((len(target.poses), len(arm.lines))) if near is None else near
        found = by_postures(robot, arm, method, target, start, tolerance)
        if found is not None:
            return found
    found = _searched(robot, numeric_instead(method, target), target, near, tolerance)
    return _named(found, Postures(robot, arm, method, 1, target.tool_axis))


def _named(found: Answers, postures: Postures) -> Answers:
    """Return the answers of a search by the branches that the closed form knows for their whole poses."""
    columns, rows = np.nonzero(found.valid)
    own = np.full(found.valid.shape, -1)
    if len(rows):
        answers = found.joints[:, columns, rows].T
        own[columns, rows] = postures.branch(answers, forward(postures.robot, answers))[0]
    return by_name(found, own, postures.method.branches)


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


def _is_stuck(robot: Robot, arm: AxisGeometry, target: IkTarget) -> bool:
    """Return whether no joint turns the tool axis that a target means.

    Raises:
        InputError: When its yaw is asked for, and it is always vertical.
    """
    from trajcli.kinematics.inverse.tool_axis import fixed_axis, never_heads

    stuck = fixed_axis(arm, target.tool_axis)
    if stuck and target.orientation == "yaw" and never_heads(arm, target.tool_axis):
        others = " or ".join(axis for axis in AXES if axis != target.tool_axis)
        raise InputError(
            f"the {target.tool_axis} axis of the tool of {robot.name} is always vertical and has no yaw",
            hint=f"say which axis of the tool heads there, with `tool_axis: {others}`",
        )
    return stuck


def _closed(
    robot: Robot, arm: AxisGeometry, method: IkMethod, target: IkTarget, near: Array | None, tolerance: float
) -> Answers:
    count = len(target.poses)
    valid, poor = np.zeros((len(method.branches), count), dtype=bool), np.zeros(count, dtype=bool)

    def settle(rows: slice, joints: Array, closure: Array) -> None:
        if not target.whole:
            closure[:] = closures(robot, target.rows(rows), joints)
        miss = np.maximum(closure[0], closure[1])
        valid[:, rows], poor[rows] = miss <= tolerance, rough(miss).any(axis=0)
        choose_turns(robot, joints, None if near is None else near[rows].T, np.pi)

    raw = candidates(robot, arm, method, target.poses, settle)
    joints, closure, watched = raw.joints, raw.gaps, raw.watched
    rows = np.flatnonzero(poor | watched)
    if len(rows):
        polish(robot, target, joints, closure, watched, rows)
        valid[:, rows] = closure[:, :, rows].max(axis=0) <= tolerance
    missed = np.flatnonzero(~valid.any(axis=0))
    if len(missed):
        closure[..., missed] = closures(robot, target.rows(missed), joints[..., missed])
    return Answers(method, joints, closure, valid, watched, np.zeros(len(joints), dtype=bool), 0, closed=True)


def _searched(
    robot: Robot, method: IkMethod, target: IkTarget, near: Array | None, tolerance: float
) -> Answers:
    """Return the nearest answers that a search finds; of families their nearest members."""
    search_result, freedom = search(robot, target, near), freedom_of(robot, target)
    joints = np.ascontiguousarray(np.moveaxis(search_result.joints, 0, -1).swapaxes(0, 1))
    valid = search_result.found.T & (closures(robot, target, joints).max(axis=0) <= tolerance)
    choose_turns(robot, joints, None if near is None else near.T)
    aim = np.zeros((len(target.poses), len(joints))) if near is None else near
    within = SAME
    if freedom:
        seeds, rows = np.nonzero(valid)
        members = nearest_on_self_motions(robot, target.rows(rows), joints[:, seeds, rows].T, aim[rows])
        joints[:, seeds, rows], within = members.T, _SAME_MEMBER
    closure = closures(robot, target, joints)
    valid &= closure.max(axis=0) <= tolerance
    outside = (beyond(joints.T, robot.limits.position) != 0.0).any(axis=-1).T
    way = np.abs(joints - aim.T[:, None])
    cost = (np.square(way).sum(axis=0) if freedom else way.max(axis=0)) + np.where(outside, _LAST, 0.0)
    order = np.argsort(np.where(valid, cost, 2 * _LAST + closure.sum(axis=0)), axis=0, kind="stable")
    joints, valid = _ordered(joints, order), _ordered(valid, order)
    valid = distinct(robot, joints.transpose(2, 1, 0), valid.T, within).T
    last = np.argsort(~valid, axis=0, kind="stable")
    last = last[: max(1, min(_KEPT, int(valid.sum(axis=0).max(initial=0))))]
    joints, closure, valid = (
        _ordered(joints, last),
        _ordered(_ordered(closure, order), last),
        _ordered(valid, last),
    )
    every, free = np.ones(valid.shape[1], dtype=bool), np.zeros(len(joints), dtype=bool)
    return Answers(method, joints, closure, valid, every, free, freedom, closed=False)


def _ordered(array: NDArray[Any], order: NDArray[np.intp]) -> NDArray[Any]:
    """Return (..., branches, N) with the branches of each pose in an order (kept, N)."""
    return np.take_along_axis(array, order.reshape(*(1,) * (array.ndim - 2), *order.shape), axis=-2)


def _resolve(
    robot: Robot, target: IkTarget, found: Answers, near: Array | None, tolerance: float
) -> tuple[Flags, Flags]:
    """Find the families of suspect poses, move to their nearest members, drop repetitions, choose turns.

    Where the targets leave some freedom the members are the nearest ones already.
    """
    singular, free = np.zeros(found.valid.shape, dtype=bool), np.zeros(found.joints.shape, dtype=bool)
    if found.free.any():
        free[:] = found.free[:, None, None] & found.valid
    suspects = np.flatnonzero(found.suspect)
    if not len(suspects):
        return singular, free
    some, close_to = target.rows(suspects), None if near is None else near[suspects]
    before = found.joints[:, :, suspects].transpose(2, 1, 0)
    joints, valid = before.copy(), found.valid[:, suspects].T.copy()
    lost, freed = _families(robot, some, joints, valid, found.freedom, close_to)
    valid = distinct(robot, joints, valid)
    if (
        found.closed
        and not found.freedom
        and recover_lost_solutions(robot, some, joints, valid, lost, close_to)
    ):
        lost, freed = _families(robot, some, joints, valid, 0, close_to)
    if (joints != before).any():
        closure = closures(robot, some, joints.transpose(2, 1, 0))
        valid = distinct(robot, joints, valid & (closure.max(axis=0) <= tolerance).T)
        found.closure[:, :, suspects] = closure
    if found.closed:
        valid = one_of_each(robot, joints, valid, freed, close_to)
    choose_turns(robot, joints.transpose(2, 1, 0), None if close_to is None else close_to.T)
    found.joints[:, :, suspects], found.valid[:, suspects] = joints.transpose(2, 1, 0), valid.T
    singular[:, suspects], free[:, :, suspects] = (lost & valid).T, freed.transpose(2, 1, 0)
    return singular, free


def _families(
    robot: Robot, target: IkTarget, joints: Array, valid: Flags, freedom: int, near: Array | None
) -> tuple[Flags, Flags]:
    """Return what is singular (N, branches) of valid joints (N, branches, n), and what is free.

    Singular ones of targets that leave no freedom elsewhere are moved, in place, to their nearest members.
    """
    lost, freed = np.zeros(valid.shape, dtype=bool), np.zeros(joints.shape, dtype=bool)
    rows, places = np.nonzero(valid)
    if not len(rows):
        return lost, freed
    known = self_motions(robot, target.rows(rows), joints[rows, places], freedom)
    lost[rows, places], freed[rows, places] = known.singular, known.free
    if near is not None and not freedom and known.singular.any():
        rows, places = rows[known.singular], places[known.singular]
        joints[rows, places] = nearest_on_self_motions(
            robot, target.rows(rows), joints[rows, places], near[rows]
        )
    return lost, freed
