"""Self-motion of an arm with seven joints, sampled by its last joint and followed to its nearest point.

A closed form answers each pose for many values of the last joint. Of each branch the sample that is nearest
to the given configuration is taken, inside the limits where there is one; a parabola through it and its
neighbours says where the nearest point is about. From there secant steps along the manifold make the gap to
the given configuration vertical to it: in each, one correction towards the target, one step along the null
vector, cut off where a joint meets its limit.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.geometry.rotation import Flags
from trajcli.kinematics.dexterity import characteristic_length
from trajcli.kinematics.inverse.families.choose import method_for, poses_for_the_others
from trajcli.kinematics.inverse.families.method import IkMethod, candidates
from trajcli.kinematics.inverse.families.screw_axes import axis_geometry
from trajcli.kinematics.inverse.joint_turns import FULL, beyond, choose_turns
from trajcli.kinematics.inverse.target import IkTarget
from trajcli.kinematics.jacobian import poses_and_jacobians
from trajcli.kinematics.robot import Robot

_SAMPLES = 72  # of the last joint: five degrees apart at most
_BLOCK = 64  # poses at a time: what is stored of all samples stays in the processor's cache
_MET = 1e-7  # m and rad: what the steps take away at once
_OUTSIDE = 1e4  # rad, squared: samples outside the limits come behind those inside
_ALIKE = 0.5  # rad: samples further apart are not neighbours on one manifold
_STARTS = 2  # of a branch: where its limits part it, it may come near to the configuration twice
_ROUNDS = 10
_MANY_ROUNDS = 60  # for poses none of whose rows has arrived
_WANDERS = 0.2  # rad of the last joint, after which a row is given up
_LAST = 1e-6  # rad: after a step along the manifold as short as this its square is left of the error
_CLOSED = 1e-8  # scaled error: after its correction the square is left
_LONGEST = 0.2  # rad, of one step along the manifold
_LEAST_CURVATURE = 0.05  # of half the squared distance along the manifold
_AT_LIMIT = 1e-9  # rad: this near to its limit a joint is at it
_ABOUT_AXES = np.array([7, 2, 3])  # entries of a turn's antisymmetric part
_DAMPING = 1e-15 * np.eye(6)  # keeps the correction of an exactly singular arm solvable
_UNIT = np.eye(7)


def points_by_held_joint(
    robot: Robot, method: IkMethod, target: IkTarget, near: Array
) -> tuple[Array, Flags]:
    """Return points on the self-motion manifolds of whole poses, nearest to `near` around each of them.

    Args:
        robot: An arm of seven joints.
        method: Its method, which has the arm without its last joint.
        target: A flat batch of N whole poses.
        near: Shape (N, 7).

    Returns:
        Joints (7, branches, N), and which of them were found (branches, N).

    Raises:
        ValueError: When the method holds no joint.
    """
    if method.held is None:
        raise ValueError(f"the method {method.name} holds no joint")
    count, branches = len(near), _STARTS * len(method_for(method.held).branches)
    joints, met = np.zeros((near.shape[1], branches, count)), np.zeros((branches, count), dtype=bool)
    curvature = np.ones((branches, count))
    for low in range(0, count, _BLOCK):
        rows = slice(low, low + _BLOCK)
        samples = _Samples(robot, method.held, target.poses[rows], near[rows])
        joints[..., rows], met[:, rows], curvature[:, rows] = samples.nearest()
    columns, rows_met = np.nonzero(met)
    if len(rows_met):
        slide = _Slide(robot, target.poses[rows_met], joints[:, columns, rows_met].T, near[rows_met])
        slide.run(curvature[columns, rows_met], rows_met)
        joints[:, columns, rows_met], met[columns, rows_met] = slide.joints.T, slide.settled
    return joints, met


class _Samples:
    """Answers of B poses for values of the last joint that lie evenly within its limits, `near` among them.

    Attributes:
        joints: Shape (7, branches, samples, B).
        cost: Squared distance to `near`, (branches, samples, B); infinite where there is no answer.
    """

    def __init__(self, robot: Robot, held: Robot, poses: Array, near: Array) -> None:
        low, high = robot.limits.position[-1].tolist()
        last = np.clip(near[:, -1], low, high)
        if not high - low < FULL:
            low, high = -np.pi, np.pi
        step = (high - low) / _SAMPLES
        offset = np.mod(last - low, step)
        self._last: Array = np.clip(low + offset + step * np.arange(-1, _SAMPLES + 1)[:, None], low, high)
        count, samples = len(near), len(self._last)
        wanted = poses_for_the_others(robot, poses, self._last)
        raw = candidates(held, axis_geometry(held), method_for(held), wanted.reshape(-1, 4, 4))
        branches = raw.joints.shape[1]
        joints = np.empty((near.shape[1], branches, samples * count))
        joints[:-1], joints[-1] = raw.joints, self._last.reshape(-1)
        choose_turns(robot, joints.reshape(len(joints), -1, count), near.T)
        self.joints = joints.reshape(near.shape[1], branches, samples, count)
        gap = np.square(self.joints - near.T[:, None, None]).sum(axis=0)
        met = raw.residuals.max(axis=0).reshape(gap.shape) <= _MET
        self.cost: Array = np.where(met, gap, np.inf)
        self._bounds = robot.limits.position
        excess = np.abs(_beyond(self.joints, self._bounds)).max(axis=0)
        self._ranked = self.cost + np.where(excess > 0.0, _OUTSIDE * (1.0 + excess), 0.0)

    def _local_minima(self) -> tuple[NDArray[np.intp], Array]:
        """Return the samples (branches, starts, B) that no neighbour is nearer than, and their ranks."""
        ranked = self._ranked
        lowest = np.ones(ranked.shape, dtype=bool)
        lowest[:, 1:] = ranked[:, 1:] <= ranked[:, :-1]
        lowest[:, :-1] &= ranked[:, :-1] <= ranked[:, 1:]
        left, chosen = np.where(lowest, ranked, np.inf), []
        branches, poses = np.arange(len(left))[:, None], np.arange(left.shape[-1])
        for _ in range(_STARTS):
            best = branches, left.argmin(axis=1), poses
            chosen.append((best[1], left[best]))
            left[best] = np.inf
        index, ranks = (np.stack(parts, axis=1) for parts in zip(*chosen, strict=True))
        return index, ranks.reshape(-1, ranks.shape[-1])

    def nearest(self) -> tuple[Array, Flags, Array]:
        """Return points (7, starts, B) that are nearly the nearest, which there are, and curvatures.

        Where a pose has answers within the limits, the others are left out.
        """
        best, ranked = self._local_minima()
        met = np.isfinite(ranked) & ((ranked < _OUTSIDE) | (ranked.min(axis=0) >= _OUTSIDE))
        beside = np.array([-1, 0, 1])[:, None, None]
        ends = np.clip(best + beside[..., None], 0, self.cost.shape[1] - 1)
        (below, here, above), costs = _chosen(self.joints, ends).swapaxes(0, 1), _chosen(self.cost, ends)
        apart = np.maximum(np.abs(above - here), np.abs(here - below)).max(axis=0)
        usable = np.isfinite(costs[0] + costs[1] + costs[2]) & (apart < _ALIKE)
        safe = np.where(usable, costs, beside**2)
        bend = safe[0] - 2.0 * safe[1] + safe[2]
        usable &= (bend > 0.0) & (safe[1] > _LAST**2)
        bend = np.where(usable, bend, 1.0)
        u = np.where(usable, np.clip(0.5 * (safe[0] - safe[2]) / bend, -1.0, 1.0), 0.0)
        point = here + 0.5 * u * (above - below) + 0.5 * u * u * (above - 2.0 * here + below)
        length = 0.25 * np.square(above - below).sum(axis=0)
        ratio = 0.5 * bend / np.where(length > 0.0, length, 1.0)
        curvature = np.where(usable & (length > 0.0), ratio, 1.0)
        usable &= (_beyond(point, self._bounds) == 0.0).all(axis=0)
        return np.where(usable, point, here), met, np.maximum(curvature, _LEAST_CURVATURE)


def _chosen(values: Array, index: NDArray[np.intp]) -> Array:
    """Return (..., k, branches * starts, B) of values (..., branches, samples, B), by index (k, ...)."""
    branches, poses = (np.arange(count) for count in (index.shape[1], index.shape[-1]))
    taken = values[..., branches[:, None, None], index, poses]
    return np.asarray(taken.reshape(*taken.shape[:-3], -1, taken.shape[-1]))


def _beyond(joints: Array, bounds: Array) -> Array:
    return beyond(joints.T, bounds).T


class _Slide:
    """Secant steps of K rows at once along their self-motion manifolds.

    Attributes:
        joints: Shape (K, n), so far.
        settled: Shape (K,): which rows have arrived.
    """

    def __init__(self, robot: Robot, poses: Array, start: Array, near: Array) -> None:
        self._robot, self._poses, self._near = robot, poses, near
        low, high = robot.limits.position.T
        inside = np.abs(beyond(start, robot.limits.position)).max(axis=1) < _LONGEST
        low = np.where(inside[:, None], low, np.minimum(low, start))
        high = np.where(inside[:, None], high, np.maximum(high, start))
        self._bounds = np.stack([low, high], axis=1)
        self._length = characteristic_length(robot)
        self.joints = start.copy()
        self.settled: Flags = np.zeros(len(start), dtype=bool)

    def run(self, curvature: Array, owners: NDArray[np.intp]) -> None:
        """Move the rows to where the gap is vertical to the manifold, or a joint at its limit.

        A row that goes on and on leaves its branch, for a point that another branch has found; it is given up
        where its pose (`owners`, (K,)) has a row that arrives.
        """
        self._follow(np.arange(len(self.joints)), curvature, _ROUNDS, _WANDERS)
        gaps, nearest = (
            np.square(self.joints - self._near).sum(axis=1),
            np.full(int(owners.max()) + 1, np.inf),
        )
        np.minimum.at(nearest, owners[self.settled], gaps[self.settled])
        rows = np.flatnonzero(~self.settled & (gaps < nearest[owners]))
        if len(rows):
            self._follow(rows, np.ones(len(rows)), _MANY_ROUNDS, np.inf)
        q, low, high = self.joints, self._bounds[:, 0], self._bounds[:, 1]
        q = np.where(np.abs(q - low) <= _AT_LIMIT, np.maximum(q, low), q)
        self.joints = np.where(np.abs(q - high) <= _AT_LIMIT, np.minimum(q, high), q)

    def _follow(self, rows: NDArray[np.intp], curvature: Array, rounds: int, range_of_last: float) -> None:
        """Move rows until they settle, or until their last joint has gone out of a range."""
        poses, near, bounds, q = (of[rows] for of in (self._poses, self._near, self._bounds, self.joints))
        first = q[:, -1]
        last: tuple[Array, Array, Array] | None = None  # null vectors, their parts of the gap, steps
        for _ in range(rounds):
            error, correction, null = self._local(poses, q)
            q = q + correction
            gap = np.einsum("kn,kn->k", null, near - q)
            if last is not None:
                flipped = np.where(np.einsum("kn,kn->k", null, last[0]) < 0.0, -1.0, 1.0)
                null, gap = null * flipped[:, None], gap * flipped
                curvature = _secant(curvature, gap - last[1], last[2])
            step = _limited(bounds, q, null, _short(gap / curvature))
            q += step[:, None] * null
            unsettled = (np.abs(step) > _LAST) | (error > _CLOSED)
            going = unsettled & (np.abs(q[:, -1] - first) <= range_of_last)
            if going.all():
                last = null, gap, step
                continue
            self.joints[rows], self.settled[rows[~unsettled]] = q, True
            if not going.any():
                return
            rows, curvature = rows[going], curvature[going]
            poses, near, bounds, q, first = (of[going] for of in (poses, near, bounds, q, first))
            last = null[going], gap[going], step[going]
        self.joints[rows] = q

    def _local(self, wanted: Array, q: Array) -> tuple[Array, Array, Array]:
        """Return the largest scaled errors (K,), corrections and unit null vectors (K, n)."""
        poses, slopes = poses_and_jacobians(self._robot, q)
        turned = wanted[:, :3, :3] @ np.swapaxes(poses[:, :3, :3], 1, 2)
        errors = np.empty((len(q), 6))
        errors[:, :3] = (wanted[:, :3, 3] - poses[:, :3, 3]) / self._length
        twice = turned - np.swapaxes(turned, 1, 2)  # the sine of a small turn, about its axis
        errors[:, 3:] = 0.5 * twice.reshape(-1, 9)[:, _ABOUT_AXES]
        slopes[:, :3] /= self._length
        return np.abs(errors).max(axis=1), *_correction_and_null(errors, slopes)


def _limited(bounds: Array, q: Array, null: Array, step: Array) -> Array:
    """Return steps that leave all joints inside limits (K, 2, n), as far as the null vector goes there."""
    ends = np.empty(bounds.shape)
    ends[:, 0], ends[:, 1] = -np.inf, np.inf
    moves = np.abs(null) > _AT_LIMIT
    np.divide(bounds - q[:, None], null[:, None], out=ends, where=moves[:, None])
    lower, upper = ends.min(axis=1).max(axis=1), ends.max(axis=1).min(axis=1)
    limited = _short(np.minimum(np.maximum(step, lower), upper))
    return np.where(lower <= upper, limited, 0.0)


def _correction_and_null(errors: Array, slopes: Array) -> tuple[Array, Array]:
    """Return the shortest corrections (K, 7) of errors (K, 6), and unit null vectors (K, 7) of the slopes.

    Both follow from one solution: the unit matrix without its part in the rows of the slopes is the null
    vector times itself, and its row with the largest diagonal entry is taken, so that nothing cancels.
    """
    transposed = np.swapaxes(slopes, 1, 2)
    system = slopes @ transposed + _DAMPING
    solved = transposed @ np.linalg.solve(system, np.concatenate([slopes, errors[..., None]], axis=2))
    left = _UNIT - solved[..., :-1]
    sizes = np.diagonal(left, axis1=1, axis2=2)
    each, longest = np.arange(len(slopes)), sizes.argmax(axis=1)
    return solved[..., -1], left[each, longest] / np.sqrt(sizes[each, longest])[:, None]


def _short(step: Array) -> Array:
    """Return steps along the manifold, none of them longer than the longest that is taken."""
    return np.minimum(np.maximum(step, -_LONGEST), _LONGEST)


def _secant(curvature: Array, change: Array, step: Array) -> Array:
    """Return the curvatures by which the last steps changed the gap; the old ones where that says nothing."""
    measured = np.divide(-change, step, out=np.zeros(len(step)), where=np.abs(step) > _LAST)
    return np.where(measured > _LEAST_CURVATURE, measured, curvature)
