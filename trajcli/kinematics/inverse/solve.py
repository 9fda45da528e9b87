"""Every answer of inverse kinematics: the way from a robot and its targets to `Solutions`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError
from trajcli.geometry.rotation import Flags
from trajcli.kinematics.chain import configurations
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.choose import method_for
from trajcli.kinematics.inverse.closed_form import candidates
from trajcli.kinematics.inverse.complete import complete
from trajcli.kinematics.inverse.lines import PARALLEL, Arm, arm_of
from trajcli.kinematics.inverse.method import Method
from trajcli.kinematics.inverse.numeric import distinct, refine, search
from trajcli.kinematics.inverse.singular import families, one_of_each
from trajcli.kinematics.inverse.solution import Solutions
from trajcli.kinematics.inverse.target import Target, closure_of, pose_target
from trajcli.kinematics.inverse.turns import beyond, choose_turns
from trajcli.kinematics.robot import Robot

TOLERANCE = 1e-9  # m and rad: what a branch may miss its target by
_ROUNDED = 1e-11  # m and rad: above, rounding has grown and one Newton step takes it away
_NEAR = 1e-5  # m and rad: further off, a branch does not exist and is left where it is
_LAST = 1e6  # rad or m: sorts answers outside the limits behind all others
_KEPT = 16  # answers of a numeric search that are kept, the nearest


@dataclass(eq=False)
class _Found:
    """Answers of a flat batch while they are worked on; joints come first, poses last.

    Attributes:
        joints: Shape (n, branches, N).
        closure: Shape (2, branches, N), m and rad.
        valid: Shape (branches, N).
        suspect: Shape (N,): poses whose answers may be singular or repeat each other.
        closed: Whether a closed form found them.
    """

    joints: Array
    closure: Array
    valid: Flags
    suspect: Flags
    closed: bool


def solve(
    robot: Robot, target: Target | ArrayLike, near: ArrayLike | None = None, tolerance: float = TOLERANCE
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
            positive.
    """
    if not tolerance > 0.0:
        raise InputError(f"the tolerance must be positive, it is {tolerance:.6g}")
    wanted = target if isinstance(target, Target) else pose_target(target)
    method, arm, flat = method_for(robot), arm_of(robot), wanted.flat()
    close_to = _near(robot, near, wanted.batch)
    if method.solve is not None and fits(method, wanted, robot.base):
        found = _closed(robot, arm, method, flat, tolerance)
    else:
        method = method if method.solve is None else numeric_instead(method, wanted)
        found = _searched(robot, flat, close_to, tolerance)
    singular, free = _resolve(robot, flat, found, close_to, tolerance)
    _turn(robot, found, close_to)
    arrays = (found.joints, found.closure, free, found.valid[None], singular[None])
    joints, closure, freed, valid, lost = (_batch_first(array, wanted.batch) for array in arrays)
    bounds = robot.limits.position
    return Solutions(method, joints, valid[..., 0], closure, lost[..., 0], freed, bounds)


def _batch_first(array: NDArray[Any], batch: tuple[int, ...]) -> NDArray[Any]:
    """Return (k, branches, N) as a view (*batch, branches, k)."""
    return np.moveaxis(array.reshape(*array.shape[:2], *batch), (0, 1), (-1, -2))


def fits(method: Method, target: Target, base: Array) -> bool:
    """Return whether a closed form answers targets of this kind, with T_world_base (4, 4)."""
    if method.needs == "pose":
        return target.whole
    idle = np.zeros(3) if method.idle is None else base[:3, :3] @ np.array(method.idle)
    unfixed = ~np.array(target.position)
    return not unfixed.any() or bool(np.abs(idle[unfixed]).min() >= 1.0 - PARALLEL)


def numeric_instead(method: Method, target: Target) -> Method:
    """Return the numeric method for targets that leave free what a closed form needs."""
    reason = (
        f"the target fixes {target.coordinates} coordinates, "
        f"the closed form ({method.name}) needs the whole {method.needs}"
    )
    return Method("numeric: damped Newton from many seeds", "numeric", (), reason)


def _near(robot: Robot, near: ArrayLike | None, batch: tuple[int, ...]) -> Array | None:
    if near is None:
        return None
    values = configurations(robot, near, "the configuration to be near to")
    return np.broadcast_to(values, (*batch, values.shape[-1])).reshape(-1, values.shape[-1])


def _closed(robot: Robot, arm: Arm, method: Method, target: Target, tolerance: float) -> _Found:
    raw = candidates(robot, arm, method, target.poses)
    joints, closure = raw.joints, raw.gaps
    if not target.whole:
        closure = _closures(robot, target, joints)
    worst = np.maximum(closure[0], closure[1])
    poor = (worst > _ROUNDED) & (worst < _NEAR)
    if raw.watched.any():
        poor |= raw.watched & (closure[0] < _NEAR)
    branches, rows = np.nonzero(poor)
    if len(rows):
        some = target.rows(rows)
        better = refine(robot, some, joints[:, branches, rows].T)
        joints[:, branches, rows] = better.T
        closure[:, branches, rows] = closure_of(some, forward(robot, better)).T
        worst = np.maximum(closure[0], closure[1])
    found = _Found(joints, closure, worst <= tolerance, raw.watched, closed=True)
    missed = np.flatnonzero(~found.valid.any(axis=0))
    if len(missed):
        found.closure[..., missed] = _closures(robot, target.rows(missed), joints[..., missed])
    return found


def _searched(robot: Robot, target: Target, near: Array | None, tolerance: float) -> _Found:
    search_result = search(robot, target, near)
    joints = np.ascontiguousarray(np.moveaxis(search_result.joints, 0, -1).swapaxes(0, 1))
    found = _Found(
        joints, _closures(robot, target, joints), search_result.found.T, np.ones(0, dtype=bool), closed=False
    )
    found.valid = found.valid & (found.closure.max(axis=0) <= tolerance)
    _turn(robot, found, near)
    found.valid = distinct(robot, joints.transpose(2, 1, 0), found.valid.T).T
    aim = 0.0 if near is None else near.T[:, None]
    outside = (beyond(joints.T, robot.limits.position) != 0.0).any(axis=-1).T
    distance = np.abs(joints - aim).max(axis=0) + np.where(outside, _LAST, 0.0)
    order = np.argsort(
        np.where(found.valid, distance, 2 * _LAST + found.closure.sum(axis=0)), axis=0, kind="stable"
    )
    kept = order[: max(1, min(_KEPT, int(found.valid.sum(axis=0).max(initial=0))))]
    columns = np.arange(kept.shape[1])
    suspect = np.ones(kept.shape[1], dtype=bool)
    return _Found(
        joints[:, kept, columns],
        found.closure[:, kept, columns],
        found.valid[kept, columns],
        suspect,
        closed=False,
    )


def _closures(robot: Robot, target: Target, joints: Array) -> Array:
    """Return how far joints (n, branches, N) are from flat targets, shape (2, branches, N)."""
    count, branches, poses = joints.shape
    repeated = target.rows(np.tile(np.arange(poses), branches))
    closure = closure_of(repeated, forward(robot, joints.reshape(count, -1).T))
    return closure.T.reshape(2, branches, poses).copy()


def _resolve(
    robot: Robot, target: Target, found: _Found, near: Array | None, tolerance: float
) -> tuple[Flags, Flags]:
    """Find the families of suspect poses, move to their nearest members, and drop repetitions."""
    singular, free = np.zeros(found.valid.shape, dtype=bool), np.zeros(found.joints.shape, dtype=bool)
    suspects = np.flatnonzero(found.suspect)
    if not len(suspects):
        return singular, free
    some, close_to = target.rows(suspects), None if near is None else near[suspects]
    joints, valid = found.joints[:, :, suspects].transpose(2, 1, 0).copy(), found.valid[:, suspects].T.copy()
    lost, freed = _to_nearest_members(robot, some, joints, valid, close_to)
    valid = distinct(robot, joints, valid)
    if found.closed and complete(robot, some, joints, valid, lost, close_to):
        lost, freed = _to_nearest_members(robot, some, joints, valid, close_to)
    closure = _closures(robot, some, joints.transpose(2, 1, 0))
    met = closure.max(axis=0) <= tolerance
    valid = distinct(robot, joints, valid & met.T)
    if found.closed:
        valid = one_of_each(robot, joints, valid, freed, close_to)
    found.joints[:, :, suspects], found.closure[:, :, suspects] = joints.transpose(2, 1, 0), closure
    found.valid[:, suspects] = valid.T
    singular[:, suspects], free[:, :, suspects] = (lost & valid).T, freed.transpose(2, 1, 0)
    return singular, free


def _to_nearest_members(
    robot: Robot, target: Target, joints: Array, valid: Flags, near: Array | None
) -> tuple[Flags, Flags]:
    """Move valid joints (N, branches, n), in place; return what is singular (N, branches), and free."""
    lost, freed = np.zeros(valid.shape, dtype=bool), np.zeros(joints.shape, dtype=bool)
    rows, places = np.nonzero(valid)
    if len(rows):
        answer = families(
            robot, target.rows(rows), joints[rows, places], None if near is None else near[rows]
        )
        joints[rows, places], lost[rows, places], freed[rows, places] = (
            answer.joints,
            answer.singular,
            answer.free,
        )
    return lost, freed


def _turn(robot: Robot, found: _Found, near: Array | None) -> None:
    choose_turns(robot, found.joints, None if near is None else near.T)
