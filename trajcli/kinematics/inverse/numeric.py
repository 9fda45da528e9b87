"""Numeric inverse kinematics of any chain: damped Newton steps from many seeds of all targets at once.

Every step solves (J^T J + m I) dq = J^T e for all running rows together, with the damping m = |e|^2 / 2: it
vanishes with the error, so that the end is quadratic, and keeps steps below sqrt(1/2) everywhere. With more
joints than coordinates the same step is J^T (J J^T + m I)^-1 e, the shortest one. Lengths are divided by
the arm's characteristic length.

An arm with as many joints as coordinates has finitely many solutions: limits do not enter the search, and
every solution that some seed leads to is kept. Nothing proves that none is missing: an xArm 6 lacked one in
about one pose of a hundred with 64 seeds, hence 192. An arm with more joints has self-motion manifolds: each
joint is held inside its limits while searching.

At a singular pose a closed form takes one point of the manifold before it knows whether the joints that come
after can follow: a UR with its wrist aligned may reach the pose with some turns of joint 6 and not with
others. Solutions lost so are recovered by search, from the given configuration; where no branch is valid,
from all seeds.

Source: Sugihara, Solvability-unconcerned inverse kinematics by the Levenberg-Marquardt method, IEEE Trans.
Robotics 27 (2011).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.frozen import frozen
from trajcli.geometry.rotation import Flags
from trajcli.kinematics.dexterity import characteristic_length
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.joint_turns import FULL, revolute
from trajcli.kinematics.inverse.target import IkTarget, closure_of, residual_jacobian, residuals
from trajcli.kinematics.jacobian import poses_and_jacobians
from trajcli.kinematics.robot import Robot

SEEDS = 64  # where any point of a manifold will do
SEEDS_OF_ALL = 192  # where all solutions are wanted: with 64 one pose in a hundred lacks one
ROUNDS = 3  # of seeds, for targets that no seed met; the last one disregards limits
_BLOCK = 128  # targets at a time, so that memory does not grow with their number
ITERATIONS = 60
DONE = 1e-13  # of the scaled error: a few roundings
_FLOOR = 1e-13  # damping that keeps an exactly singular system solvable
_LONGEST = 1.0  # rad, or arm lengths, a joint goes in one step
SAME = 1e-6  # rad or m, within which two solutions are one
_TAKEN = 1e6  # rad or m: branches that are not valid come before those that are


@frozen
class SearchResult:
    """Where the seeds of a flat batch have led to.

    Attributes:
        joints: Shape (N, seeds, n), turns not chosen yet.
        met: Shape (N, seeds), whether a row met its target.
    """

    joints: Array
    met: Flags


def linearised(robot: Robot, target: IkTarget, q: Array) -> tuple[Array, Array]:
    """Return scaled residuals (K, m) and their Jacobian (K, m, n) at joint values (K, n)."""
    poses, whole = poses_and_jacobians(robot, q)
    errors, slopes = residuals(target, poses), residual_jacobian(target, poses, whole)
    scale = np.ones(errors.shape[1])
    scale[: sum(target.position)] = 1.0 / characteristic_length(robot)
    return errors * scale, slopes * scale[:, None]


def damped_step(errors: Array, slopes: Array, damping: Array) -> Array:
    """Return the joint steps (K, n)."""
    rows, joints = slopes.shape[1:]
    transposed = np.swapaxes(slopes, 1, 2)
    if joints > rows:
        system = slopes @ transposed + damping[:, None, None] * np.eye(rows)
        return np.asarray((transposed @ np.linalg.solve(system, errors[..., None]))[..., 0])
    system = transposed @ slopes + damping[:, None, None] * np.eye(joints)
    return np.asarray(np.linalg.solve(system, transposed @ errors[..., None])[..., 0])


def refine(robot: Robot, target: IkTarget, q: Array, iterations: int = 4) -> Array:
    """Return joint values (K, n) moved by undamped least-squares steps, each kept only where it gains."""
    return refined(robot, target, q, iterations)[0]


def refined(robot: Robot, target: IkTarget, q: Array, iterations: int) -> tuple[Array, Array, Array]:
    """Return what `refine` does, with scaled residuals (K, m) and their Jacobian (K, m, n) there."""
    errors, slopes = linearised(robot, target, q)
    q, running = q.copy(), np.arange(len(q))
    for _ in range(iterations):
        running = running[np.abs(errors[running]).max(axis=1) > DONE]
        if not len(running):
            break
        inverse = np.linalg.pinv(slopes[running], rcond=1e-9)
        step = (inverse @ errors[running, :, None])[..., 0]
        trial = q[running] + np.clip(step, -_LONGEST, _LONGEST)
        new_errors, new_slopes = linearised(robot, target.rows(running), trial)
        gains = np.square(new_errors).sum(axis=1) < np.square(errors[running]).sum(axis=1)
        running = running[gains]
        q[running], errors[running], slopes[running] = trial[gains], new_errors[gains], new_slopes[gains]
    return q, errors, slopes


def descend(
    robot: Robot, target: IkTarget, q: Array, bounds: Array | None, tolerance: float = 0.0
) -> tuple[Array, Flags]:
    """Return joint values (K, n) after the search from seeds (K, n), and which met their targets.

    An arm with fewer joints than coordinates meets no rounded target to its last digit.

    Args:
        robot: The arm.
        target: A flat batch of K.
        q: The seeds.
        bounds: Limits (n, 2) that hold the joints while searching; None for none.
        tolerance: By how much such an arm may miss its targets, m and rad.
    """
    result, met = q.copy(), np.zeros(len(q), dtype=bool)
    running = np.arange(len(q))
    for _ in range(ITERATIONS):
        values = result[running]
        errors, slopes = linearised(robot, target.rows(running), values)
        square = np.square(errors).sum(axis=1)
        done = square <= DONE**2
        met[running[done]] = True
        running, values = running[~done], values[~done]
        if not len(running):
            break
        values = values + damped_step(errors[~done], slopes[~done], 0.5 * square[~done] + _FLOOR)
        result[running] = values if bounds is None else np.clip(values, bounds[:, 0], bounds[:, 1])
    if len(robot.joints) < target.coordinates:
        met |= closure_of(target, forward(robot, result)).max(axis=1) <= tolerance
    return result, met


def search(robot: Robot, target: IkTarget, near: Array | None, tolerance: float = 0.0) -> SearchResult:
    """Return where all seeds lead to for flat targets (N); `near` (N, n) is the first seed where given.

    The tolerance is that of `descend`.
    """
    count, joints = target.poses.shape[0], len(robot.joints)
    seeds = SEEDS if joints > target.coordinates else SEEDS_OF_ALL
    result, met = np.zeros((count, seeds, joints)), np.zeros((count, seeds), dtype=bool)
    for low in range(0, count, _BLOCK):
        block = np.arange(low, min(low + _BLOCK, count))
        nearby = None if near is None else near[block]
        some = _search_block(robot, target.rows(block), nearby, seeds, tolerance)
        result[block], met[block] = some.joints, some.met
    return SearchResult(result, met)


def _search_block(
    robot: Robot, target: IkTarget, near: Array | None, seeds: int, tolerance: float
) -> SearchResult:
    count, joints = target.poses.shape[0], len(robot.joints)
    bounds = robot.limits.position if joints > target.coordinates else None
    result, met = np.zeros((count, seeds, joints)), np.zeros((count, seeds), dtype=bool)
    for attempt in range(ROUNDS):
        missing = np.flatnonzero(~met.any(axis=1))
        if not len(missing):
            break
        if attempt == ROUNDS - 1:
            bounds = None
        starts = np.repeat(starting_points(robot, seeds, attempt)[None], len(missing), axis=0)
        if near is not None:
            starts[:, 0] = near[missing]
        pairs = np.repeat(missing, seeds)
        values, hits = descend(robot, target.rows(pairs), starts.reshape(-1, joints), bounds, tolerance)
        result[missing] = values.reshape(-1, seeds, joints)
        met[missing] = hits.reshape(-1, seeds)
    return SearchResult(result, met)


def starting_points(robot: Robot, seeds: int, attempt: int) -> Array:
    """Return starting configurations (seeds, n), the same in every run, spread over the limits.

    A joint without limits is spread over a full turn, a slide over the arm's length.
    """
    turning = revolute(robot)
    unlimited = np.where(turning, np.pi, characteristic_length(robot))
    low, high = robot.limits.position.T
    low, high = np.where(np.isfinite(low), low, -unlimited), np.where(np.isfinite(high), high, unlimited)
    wide = turning & (high - low > FULL)
    low, high = np.where(wide, -np.pi, low), np.where(wide, np.pi, high)
    generator = np.random.default_rng(attempt)
    spread = (generator.permuted(np.tile(np.arange(seeds), (len(low), 1)), axis=1).T + 0.5) / seeds
    return np.asarray(low + (high - low) * spread)


def distinct(robot: Robot, joints: Array, usable: Flags, within: float = SAME) -> Flags:
    """Return which rows (N, S) are usable and repeat no earlier one; full turns apart count as equal.

    Args:
        robot: The arm.
        joints: Shape (N, S, n).
        usable: Shape (N, S).
        within: How far two that are one may be apart, rad or m.
    """
    turning = revolute(robot)
    keep, key = usable.copy(), np.cos(joints - 1.0).sum(axis=2)  # alike where joints are
    for i in np.flatnonzero(usable[:, 1:].any(axis=0)) + 1:
        if np.abs(key[:, :i] - key[:, i, None]).min() > 2.0 * within * len(turning):
            continue
        gap = joints[:, :i] - joints[:, i, None]
        gap = np.where(turning, gap - FULL * np.round(gap / FULL), gap)
        same = (np.abs(gap).max(axis=-1) <= within) & keep[:, :i]
        keep[:, i] &= ~same.any(axis=1)
    return keep


def recover_lost_solutions(
    robot: Robot, target: IkTarget, joints: Array, valid: Flags, singular: Flags, near: Array | None
) -> bool:
    """Put solutions that are missing into `joints` (N, branches, n) and mark them in `valid`, both in place.

    A solution replaces the nearest branch that is not valid, and has its name; where all are valid, the
    nearest one that is singular, and so stands for another point of a self-motion manifold.

    Args:
        robot: The arm.
        target: A flat batch of N, the suspect poses.
        joints: Shape (N, branches, n).
        valid: Shape (N, branches).
        singular: Shape (N, branches): which valid ones have a self-motion.
        near: Shape (N, n); None for none.

    Returns:
        Whether anything was put in.
    """
    changed = False
    if near is not None:
        values, met = descend(robot, target, near, None)
        changed |= _insert(robot, joints, valid, singular, (np.flatnonzero(met), values[met]))
    rows = np.flatnonzero(~valid.any(axis=1))
    if len(rows):
        result = search(robot, target.rows(rows), None)
        for seed in range(result.joints.shape[1]):
            some = result.met[:, seed]
            changed |= _insert(robot, joints, valid, singular, (rows[some], result.joints[some, seed]))
    return changed


def _insert(
    robot: Robot, joints: Array, valid: Flags, singular: Flags, solutions: tuple[NDArray[np.intp], Array]
) -> bool:
    """Put solutions (rows (K,), joints (K, n)) in, in place; return whether any was new."""
    rows, values = solutions
    gap = joints[rows] - values[:, None]
    gap = np.abs(np.where(revolute(robot), gap - FULL * np.round(gap / FULL), gap)).max(axis=-1)
    repeated = (valid[rows] & (gap <= SAME)).any(axis=1)
    fixed = valid[rows] & ~singular[rows]
    cost = np.where(fixed, np.inf, gap + np.where(valid[rows], _TAKEN, 0.0))
    branch = np.argmin(cost, axis=1)
    new = ~repeated & ~fixed.all(axis=1)
    joints[rows[new], branch[new]] = values[new]
    valid[rows[new], branch[new]] = True
    return bool(new.any())
