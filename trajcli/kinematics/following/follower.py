"""Follower: joint values, velocities and accelerations of an arm whose tool is on a given path.

At every s the joints solve the target's equations by Newton's method from a guess, then J q' = x' and
J q'' = x'' - J' q'. What the target leaves free, a tool's roll or the elbow of a seven-joint arm, is held:
the joint values keep their components along the directions that are free at the start. So q is a function of
s alone, the same forwards and backwards. A branch ends where the arm would change its aspect, the side of the
singular configurations on which it is.

Source: Siciliano et al. (2009), sections 3.5 and 3.7; Baillieul, Kinematic programming alternatives for
redundant manipulators (ICRA 1985); for aspects Borrel and Liegeois, A study of multiple manipulator inverse
kinematic solutions (ICRA 1986).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array, PiecewisePolynomial, Side
from trajcli.errors import PlanningError, Problem
from trajcli.frozen import frozen
from trajcli.geometry.paths.position import Triple
from trajcli.geometry.rotation import AXES
from trajcli.kinematics.dexterity import characteristic_length
from trajcli.kinematics.following.tool_path import PinnedJoint, ToolPath, ToolReference
from trajcli.kinematics.inverse.target import IkTarget, residual_jacobian, residuals
from trajcli.kinematics.jacobian import acceleration_bias, linearisation
from trajcli.kinematics.robot import Robot

if TYPE_CHECKING:
    from trajcli.geometry.paths.pose import PosePath

ReferenceAt = Callable[[Array, Side], ToolReference]

_ITERATIONS = 12
_NEAR = 1e-8  # rad or m: after a step as short as this Newton's method is at what rounding allows
_GOOD = 1e-10  # scaled residual that still counts as met where rounding is larger
_LONGEST = 0.5  # rad, or arm lengths, in one step
_ELSEWHERE = 0.25  # rad or m: joint values this far from the guess are on another branch
_RANK = 1e-6  # of the largest singular value: directions with less are free
_AROUND, _SPREAD = 4, 0.1  # configurations, rad or m: an arm is regular almost everywhere
_FLAT = 1e-12  # a determinant of scaled rows, which are of the size 1, that is none
_OUTSIDE = 1e-9  # of a scaled row: what a basis of dependent rows may leave out


class LostError(ValueError):
    """No joint values near the guess meet the target.

    Attributes:
        s: All values where that is so, ascending, shape (K,).
    """

    def __init__(self, s: Array) -> None:
        super().__init__(f"no joint values meet the target at {s[0]!r}")
        self.s = s


@frozen
class Aspect:
    """A singularity-free component of the configurations: the sign of the determinant of the scaled rows.

    Attributes:
        sign: 1 or -1; 0 where it cannot be told, as in a singular configuration.
        basis: Of the rows where they depend on each other, as those of a planar arm do, shape (n, m).
    """

    sign: float
    basis: Array

    def changed(self, reference: ToolReference, poses: Array, rows: Array) -> NDArray[np.bool_]:
        """Return where the aspect is another one, (N,), at tcp poses (N, 4, 4) with scaled rows (N, m, n)."""
        if self.sign == 0:
            return np.zeros(len(rows), dtype=bool)
        return np.asarray(self.sign * _signs(_completed(reference, poses, rows), self.basis) < 0)


NO_ASPECT = Aspect(0.0, np.empty((0, 0)))


@frozen
class JointState:
    """Joints at N values of s, and what was computed for them: checking a fit there needs it again.

    Attributes:
        values: Joint values and their first and second derivative, shape (3, N, n).
        reference: Of the tool there.
        target: Of that reference.
        jacobians: In world, shape (N, 6, n).
    """

    values: Array
    reference: ToolReference
    target: IkTarget
    jacobians: Array


@frozen
class Follower:
    """An arm that follows a reference.

    Attributes:
        robot: The arm.
        reference_at: The reference of the tool at s (N,), from one side of breaks.
        start: Joint values at the beginning of the path, shape (n,).
        held: Unit directions of joint values that are held, shape (f, n).
        aspect: In which the arm starts, and stays.
    """

    robot: Robot
    reference_at: ReferenceAt
    start: Array
    held: Array
    aspect: Aspect = NO_ASPECT

    @cached_property
    def length(self) -> float:
        """Length of the arm, m, by which positions are divided."""
        return characteristic_length(self.robot)

    def exact(self, s: Array, side: Side, guess: Array) -> Array:
        """Return joint values and their first and second derivative, shape (3, N, n).

        Args:
            s: Shape (N,).
            side: Which side of a break is meant.
            guess: Joint values nearby, shape (N, n).

        Raises:
            LostError: When no joint values near the guess meet the target.
        """
        return self.joint_state(s, side, guess).values

    def joint_state(self, s: Array, side: Side, guess: Array) -> JointState:
        """Return these values with what was computed for them.

        Raises:
            LostError: As `exact`.
        """
        reference = self.reference_at(s, side)
        target = reference.target()
        q, poses, jacobians, slopes = self._solve_target(reference, target, guess, s)
        left = self.aspect.changed(reference, poses, slopes)
        if left.any():
            raise LostError(np.sort(s[left]))
        pins = (None, None) if reference.pins is None else reference.pins[1:]
        first = self._solve_rows(slopes, self._scaled(reference.rates(), target, pins=pins[0]))
        bias = acceleration_bias(jacobians, first)
        twist = (jacobians @ first[..., None])[..., 0]
        wanted = reference.accelerations(poses, bias, twist)
        second = self._solve_rows(slopes, self._scaled(wanted, target, pins=pins[1]))
        return JointState(np.stack([q, first, second]), reference, target, jacobians)

    def _solve_target(
        self, reference: ToolReference, target: IkTarget, guess: Array, s: Array
    ) -> tuple[Array, Array, Array, Array]:
        """Return joint values (N, n) that meet the target, and there poses, Jacobians and scaled rows."""
        q, short = guess, False
        for iteration in range(_ITERATIONS + 1):
            poses, jacobians = linearisation(self.robot, q)
            slopes = self._rows(target, poses, jacobians, reference.pinned)
            pins = None if reference.pins is None else reference.pins[0] - q[:, list(reference.pinned)]
            errors = self._scaled(residuals(target, poses), target, (self.start - q) @ self.held.T, pins=pins)
            if short or iteration == _ITERATIONS:
                break
            step = self._solve_rows(slopes, errors)
            q = q + np.clip(step, -_LONGEST, _LONGEST)
            short = bool((np.abs(step) <= _NEAR).all())
        size = np.abs(errors).max(axis=1)
        lost = ~(size <= _GOOD) | (np.abs(q - guess).max(axis=1) > _ELSEWHERE)
        if lost.any():
            raise LostError(np.sort(s[lost]))
        return q, poses, jacobians, slopes

    def rows(self, reference: ToolReference, poses: Array, jacobians: Array) -> Array:
        """Return the scaled rows (N, m + f + p, n) of tcp poses (N, 4, 4) and Jacobians (N, 6, n) in world.

        They are those of the target, of directions that are held, and of joints that are pinned.
        """
        return self._rows(reference.target(), poses, jacobians, reference.pinned)

    def _rows(self, target: IkTarget, poses: Array, jacobians: Array, pinned: tuple[int, ...]) -> Array:
        rows = residual_jacobian(target, poses, jacobians)
        rows[:, : sum(target.position)] /= self.length
        if not len(self.held) and not pinned:
            return rows
        kept = np.concatenate([self.held, np.eye(self.start.size)[list(pinned)]])
        return np.concatenate([rows, np.broadcast_to(kept, (len(poses), *kept.shape))], axis=1)

    def _scaled(
        self, rates: Array, target: IkTarget, kept: Array | None = None, pins: Array | None = None
    ) -> Array:
        """Return rates of the target's rows, those of the position by length, with those kept and pinned."""
        if kept is None:
            kept = np.zeros((len(rates), len(self.held)))
        scaled = np.concatenate([rates, kept] if pins is None else [rates, kept, pins], axis=1)
        scaled[:, : sum(target.position)] /= self.length
        return scaled

    @staticmethod
    def _solve_rows(slopes: Array, rates: Array) -> Array:
        """Return the joint rates (N, n) that have the given rates of the rows (N, m)."""
        if slopes.shape[1] == slopes.shape[2]:
            try:
                return np.asarray(np.linalg.solve(slopes, rates[..., None])[..., 0])
            except np.linalg.LinAlgError:
                pass
        return np.asarray((np.linalg.pinv(slopes, rcond=1e-12) @ rates[..., None])[..., 0])


def follower(robot: Robot, reference_at: ReferenceAt, start: Array, s: float) -> Follower:
    """Return the follower that begins in joint values `start` (n,) at an s of the path.

    Args:
        robot: The arm.
        reference_at: The reference of the tool along the path.
        start: Joint values at s, which meet the reference.
        s: The beginning of the path.
    """
    bare = Follower(robot, reference_at, start, np.empty((0, start.size)))
    reference = reference_at(np.array([s]), "right")
    here = linearisation(robot, start[None])
    rank = regular_rank(bare, s)
    _, _, right = np.linalg.svd(bare.rows(reference, *here)[0])
    held = Follower(robot, reference_at, start, right[rank:])
    return replace(held, aspect=aspect_of(reference, here[0], held.rows(reference, *here)))


def regular_rank(bare: Follower, s: float) -> int:
    """Return how many directions of the joint values the reference at s fixes, where the arm is regular.

    Args:
        bare: A follower that holds nothing.
        s: Where.
    """
    start = bare.start
    # sines of whole numbers are as good as random ones, and need no generator to be loaded
    spread = np.sin(np.arange(1, _AROUND * start.size + 1)).reshape(_AROUND, start.size)
    reference = bare.reference_at(np.full(_AROUND, s), "right")
    rows = bare.rows(reference, *linearisation(bare.robot, start + _SPREAD * spread))
    values = np.linalg.svd(rows, compute_uv=False)
    return int((values > _RANK * values[:, :1]).sum(axis=1).max())


def aspect_of(reference: ToolReference, poses: Array, rows: Array) -> Aspect:
    """Return the aspect of one configuration, a batch of one.

    Args:
        reference: Of the tool there.
        poses: Of the tcp, shape (1, 4, 4).
        rows: Scaled, shape (1, m, n).
    """
    completed = _completed(reference, poses, rows)
    basis = np.linalg.svd(completed[0])[0][:, : completed.shape[2]].T
    return Aspect(float(_signs(completed, basis)[0]), basis)


def _signs(rows: Array, basis: Array) -> Array:
    """Return the signs (N,) of the determinants of rows (N, m, n), 0 where they cannot be told."""
    if rows.shape[1] > rows.shape[2]:
        square = basis @ rows
        if np.abs(rows - basis.T @ square).max() > _OUTSIDE:
            return np.zeros(len(rows))  # the rows span another space here: their bases do not compare
        rows = square
    values = np.linalg.det(rows)
    return np.asarray(np.where(np.abs(values) > _FLAT, np.sign(values), 0.0))


def _completed(reference: ToolReference, poses: Array, rows: Array) -> Array:
    """Return the rows; the three of a direction are two, a column of the axis makes up for the third."""
    if reference.orientation != "direction":
        return rows
    column = np.zeros((*rows.shape[:2], 1))
    split = sum(reference.position)
    column[:, split : split + 3, 0] = poses[:, :3, AXES.index(reference.tool_axis)]
    return np.concatenate([rows, column], axis=2)


@frozen
class ExecutedPoses:
    """The poses X(s) of the tcp while an arm follows a path; where the tcp goes is the path's own.

    Attributes:
        wanted: The path.
        follower: Of the arm along it.
        coarse: Joints near the exact ones, a curve over s.
    """

    wanted: PosePath
    follower: Follower
    coarse: PiecewisePolynomial

    @property
    def length(self) -> float:
        """How far s goes, m or rad."""
        return self.wanted.length

    @property
    def pure_rotation(self) -> bool:
        """Whether the position is fixed."""
        return self.wanted.pure_rotation

    @property
    def breaks(self) -> Array:
        """Where a derivative may jump."""
        return self.wanted.breaks

    @property
    def stops(self) -> Array:
        """Where a law must stop."""
        return self.wanted.stops

    @property
    def jumps(self) -> Array:
        """Where the orientation jumps."""
        return self.wanted.jumps

    def evaluate(self, s: Array, side: Side = "right") -> Triple:
        """Return the poses (N, 4, 4), X' = [v', w'] (N, 6) and X'' (N, 6) in world axes, at s (N,).

        Raises:
            LostError: When no joint values near the coarse ones meet the target.
        """
        poses, first, second = (part.copy() for part in self.wanted.evaluate(s, side))
        guess = self.coarse.evaluate(np.clip(s, self.coarse.start, self.coarse.end))
        state = self.follower.joint_state(s, side, guess)
        joints, rates, changes = state.values
        moved = (state.jacobians @ np.stack([rates, changes], axis=-1)).transpose(2, 0, 1)
        poses[:, :3, :3] = linearisation(self.follower.robot, joints)[0][:, :3, :3]
        first[:, 3:] = moved[0][:, 3:]
        second[:, 3:] = (moved[1] + acceleration_bias(state.jacobians, rates))[:, 3:]
        return poses, first, second

    def majorants(self, s: Array, rising: Array) -> tuple[Array, Array]:
        """Return the bounds of p and R as `PosePath` says: nothing is known of R."""
        return self.wanted.majorants(s, rising)[0], np.full(rising.shape, np.inf)


def with_pinned(path: ToolPath, pins: Mapping[int, float], start: Array, robot: Robot) -> ToolPath:
    """Return the path on which some joints go evenly with s to given values.

    Args:
        path: Of the tool.
        pins: Value at the end of the path by the index of the joint, rad or m.
        start: Joint values at its beginning, shape (n,).
        robot: The arm.

    Raises:
        PlanningError: When the tool goes nowhere, or what is fixed of it leaves fewer joints to be chosen.
    """
    names = ", ".join(robot.joint_names[joint] for joint in pins)
    if path.length == 0 and all(start[joint] == value for joint, value in pins.items()):
        return path
    if path.length == 0:
        hint = "go there in joint space, such as by jerk_limited"
        raise PlanningError(f"{names} cannot go evenly along a path of no length", hint=hint)
    joints = (PinnedJoint(joint, float(start[joint]), value) for joint, value in pins.items())
    pinned = replace(path, pinned=tuple(joints))
    free = start.size - _rank(path, start, robot)
    if _rank(pinned, start, robot) - _rank(path, start, robot) < len(pins):
        what = f"{len(pins)} joint{'s' * (len(pins) > 1)} cannot be pinned ({names})"
        left = f"the pose leaves {free} of {start.size} joints of {robot.name} to be chosen"
        hint = "pin fewer, or other joints, or leave a part of the pose out, such as by `direction`"
        raise PlanningError(Problem(f"{what}: {left}", hint))
    return pinned


def _rank(path: ToolPath, start: Array, robot: Robot) -> int:
    """Return how many directions of the joint values a path fixes, where the arm is regular."""
    return regular_rank(Follower(robot, path.at_s, start, np.empty((0, start.size))), 0.0)
