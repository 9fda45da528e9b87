"""Targets of inverse kinematics: whole poses, or fewer than six of their coordinates, and their residuals.

A target is met where its residuals vanish. They are the differences from the tcp's pose to the target in
world: of the fixed coordinates of the position, m, and of what is fixed of the orientation, rad.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError
from trajcli.frozen import frozen
from trajcli.geometry.rotation import AXES, AxisName, exp, log
from trajcli.kinematics.dexterity import RANK_TOLERANCE, characteristic_length
from trajcli.kinematics.forward import forward
from trajcli.kinematics.jacobian import jacobian
from trajcli.kinematics.robot import Robot

OrientationConstraint = Literal["all", "direction", "yaw", "pitch", "none"]
_WHOLE = (True, True, True)
_LOST = max(RANK_TOLERANCE, 1e-7)  # of the largest singular value: answers meet their target within rounding
_AROUND, _SPREAD = 4, 0.1  # configurations, rad or m: an arm is regular almost everywhere around
_UNCHANGED = 1e-12  # by a turn of any joint, relative to the arm: rounding
_ALMOST_UPRIGHT = 1e-12  # of a unit vector: the heading of a vertical direction is not defined


@frozen
class IkTarget:
    """Targets of one kind.

    Attributes:
        poses: Shape (*batch, 4, 4), T_world_tcp; entries that are not fixed do not matter.
        position: Which of x, y and z in world are fixed.
        orientation: What is fixed of the orientation: "all"; the "direction" of a tool axis; its "yaw", the
            heading atan2(y, x) in world; its "pitch", the elevation asin(z) above the x-y plane; "none".
        tool_axis: Which axis of the tcp is meant by direction, yaw and pitch.
        aims: Shape (*batch, 3) unit directions, (*batch, 1) angles in rad, (*batch, 0) otherwise.
    """

    poses: Array
    position: tuple[bool, bool, bool]
    orientation: OrientationConstraint
    tool_axis: AxisName
    aims: Array

    @property
    def whole(self) -> bool:
        """Whether all six coordinates are fixed."""
        return self.orientation == "all" and self.position == _WHOLE

    @property
    def coordinates(self) -> int:
        """How many coordinates are fixed."""
        return (
            sum(self.position) + {"all": 3, "direction": 2, "yaw": 1, "pitch": 1, "none": 0}[self.orientation]
        )

    @property
    def batch(self) -> tuple[int, ...]:
        """Shape of the batch."""
        return self.poses.shape[:-2]

    def rows(self, index: ArrayLike | slice) -> IkTarget:
        """Return the targets of some rows of a flat batch."""
        poses, aims = self.poses[index], self.aims[index]  # type: ignore[index]
        return IkTarget(poses, self.position, self.orientation, self.tool_axis, aims)

    def flat(self) -> IkTarget:
        """Return the same targets with one batch dimension."""
        poses = self.poses.reshape(-1, 4, 4)
        return replace(self, poses=poses, aims=self.aims.reshape(len(poses), self.aims.shape[-1]))


def pose_target(poses: ArrayLike) -> IkTarget:
    """Return targets that fix the whole pose (*batch, 4, 4).

    Raises:
        InputError: When the shape is another or an entry is not finite.
    """
    values = np.asarray(poses, dtype=np.float64)
    if values.shape[-2:] != (4, 4) or not np.isfinite(values).all():
        raise InputError(f"a pose has 4x4 finite entries, this array has shape {values.shape}")
    return IkTarget(values, _WHOLE, "all", "z", np.empty((*values.shape[:-2], 0)))


def partial_target(
    position: ArrayLike | None = None,
    *,
    fixed: tuple[bool, bool, bool] = _WHOLE,
    rotation: ArrayLike | None = None,
    direction: ArrayLike | None = None,
    yaw: ArrayLike | None = None,
    pitch: ArrayLike | None = None,
    tool_axis: AxisName = "z",
) -> IkTarget:
    """Return targets that leave coordinates free.

    Args:
        position: Shape (*batch, 3), m; None leaves it free.
        fixed: Which coordinates of the position count.
        rotation: Matrices (*batch, 3, 3).
        direction: Where the tool axis points, (*batch, 3), any length but zero.
        yaw: Heading of the tool axis, (*batch,), rad.
        pitch: Elevation of the tool axis, (*batch,), rad, within a quarter turn.
        tool_axis: The axis of the tcp that is meant.

    Raises:
        InputError: When more than one of rotation, direction, yaw and pitch is given, or nothing at all, a
            direction has no length, a pitch is out of range, or a number is not finite.
    """
    given = {"rotation": rotation, "direction": direction, "yaw": yaw, "pitch": pitch}
    named = {name: np.asarray(value, dtype=np.float64) for name, value in given.items() if value is not None}
    if len(named) > 1:
        raise InputError(f"a target has one kind of orientation, not {' and '.join(named)}")
    xyz = None if position is None else np.asarray(position, dtype=np.float64)
    _check(xyz, named)
    kind, value = next(iter(named.items()), ("none", np.empty(0)))
    tail = {"rotation": 2, "direction": 1}.get(kind, 0)
    shapes = [] if xyz is None else [xyz.shape[:-1]]
    shapes += [value.shape[: value.ndim - tail]] if named else []
    batch = np.broadcast_shapes(*shapes)
    poses = np.broadcast_to(np.eye(4), (*batch, 4, 4)).copy()
    if xyz is not None:
        poses[..., :3, 3] = xyz
    counts = fixed if xyz is not None else (False, False, False)
    if kind == "rotation":
        poses[..., :3, :3] = value
        return IkTarget(poses, counts, "all", tool_axis, np.empty((*batch, 0)))
    aims = np.broadcast_to(_aims(kind, value), (*batch, {"none": 0, "direction": 3}.get(kind, 1)))
    return IkTarget(poses, counts, kind, tool_axis, aims)  # type: ignore[arg-type]


def residuals(target: IkTarget, poses: Array) -> Array:
    """Return the differences (K, m) of flat targets from the tcp's poses (K, 4, 4), position first."""
    parts = [(target.poses[:, :3, 3] - poses[:, :3, 3])[:, list(target.position)]]
    axis = poses[:, :3, AXES.index(target.tool_axis)]
    match target.orientation:
        case "all":
            parts.append(log(target.poses[:, :3, :3] @ np.swapaxes(poses[:, :3, :3], 1, 2)))
        case "direction":
            parts.append(_turn_between(axis, target.aims))
        case "yaw":
            parts.append(_wrapped(target.aims - np.arctan2(axis[:, 1:2], axis[:, :1])))
        case "pitch":
            parts.append(target.aims - np.arctan2(axis[:, 2:], np.hypot(axis[:, :1], axis[:, 1:2])))
    return np.concatenate(parts, axis=1)


def residual_jacobian(target: IkTarget, poses: Array, jacobians: Array) -> Array:
    """Return how the joints change the tcp's part of the residuals, (K, m, n), from J (K, 6, n) in world."""
    linear, angular = jacobians[:, :3][:, list(target.position)], jacobians[:, 3:]
    axis = poses[:, :3, AXES.index(target.tool_axis)]
    level = np.maximum(np.square(axis[:, :2]).sum(axis=1), _ALMOST_UPRIGHT)[:, None]
    match target.orientation:
        case "all":
            turning = angular
        case "direction":
            turning = angular - axis[:, :, None] * (axis[:, None, :] @ angular)
        case "yaw":
            flat = np.stack([-axis[:, 1], axis[:, 0], np.zeros(len(axis))], axis=1) / level
            turning = np.cross(axis, flat)[:, None, :] @ angular
        case "pitch":
            turning = (np.cross(axis, [0.0, 0.0, 1.0]) / np.sqrt(level))[:, None, :] @ angular
        case _:
            return np.asarray(linear)
    return np.concatenate([linear, turning], axis=1)


def determinants(target: IkTarget, poses: Array, jacobians: Array, length: float) -> Array | None:
    """Return the determinants of what the joints do to the coordinates that a target fixes, shape (K,).

    Their sign tells branches apart. None where these are not as many as the joints; those that no joint ever
    changes, as the height of a planar arm, are not counted.

    Args:
        target: Which coordinates.
        poses: Of the tcp, (K, 4, 4).
        jacobians: In world, (K, 6, n).
        length: By which positions are divided, m.
    """
    if target.orientation == "direction":
        return None
    slopes = residual_jacobian(target, poses, jacobians)
    slopes[:, : sum(target.position)] /= length
    slopes = slopes[:, np.abs(slopes).max(axis=(0, 2), initial=0.0) > _UNCHANGED]
    return np.asarray(np.linalg.det(slopes)) if slopes.shape[1] == slopes.shape[2] else None


def closure_of(target: IkTarget, poses: Array) -> Array:
    """Return by how much flat targets are missed (K, 2): m, and rad."""
    differences = residuals(target, poses)
    split = sum(target.position)
    parts = differences[:, :split], differences[:, split:]
    return np.stack([np.linalg.norm(part, axis=1) for part in parts], axis=1)


def meeting(target: IkTarget, poses: Array) -> Array:
    """Return poses (N, 4, 4), T_world_tcp, with the smallest translation and rotation that meet flat targets.

    Args:
        target: A flat batch of N.
        poses: Shape (N, 4, 4), or that of one pose.
    """
    result = np.broadcast_to(poses, target.poses.shape).copy()
    fixed = np.flatnonzero(target.position)
    result[:, fixed, 3] = target.poses[:, fixed, 3]
    if target.orientation == "all":
        result[:, :3, :3] = target.poses[:, :3, :3]
    elif target.orientation != "none":
        change = residuals(target, result)[:, len(fixed) :]
        if target.orientation != "direction":
            change = change * _turning_axis(target, result)
        result[:, :3, :3] = exp(change) @ result[:, :3, :3]
    return result


def _turning_axis(target: IkTarget, poses: Array) -> Array:
    """Return the axes (N, 3) about which a turn changes the yaw alone, or the pitch alone."""
    if target.orientation == "yaw":
        return np.array([[0.0, 0.0, 1.0]])
    axis = poses[:, :3, AXES.index(target.tool_axis)]
    level = np.maximum(np.hypot(axis[:, 0], axis[:, 1]), _ALMOST_UPRIGHT)
    return np.stack([axis[:, 1], -axis[:, 0], np.zeros(len(axis))], axis=1) / level[:, None]


def _turn_between(axis: Array, aim: Array) -> Array:
    """Return the shortest rotation vectors (K, 3) that turn unit vectors to their aims."""
    normal = np.cross(axis, aim)
    sine = np.linalg.norm(normal, axis=1, keepdims=True)
    cosine = np.einsum("ki,ki->k", axis, aim)[:, None]
    angle = np.arctan2(sine, cosine)
    smallest = np.eye(3)[np.argmin(np.abs(axis), axis=1)]
    aside = np.cross(axis, smallest)
    aside /= np.linalg.norm(aside, axis=1, keepdims=True)
    opposite = (sine <= _ALMOST_UPRIGHT) & (cosine < 0)
    longer = np.where(sine > 0, angle, 1.0) / np.where(sine > 0, sine, 1.0)
    return np.asarray(np.where(opposite, aside * angle, normal * longer))


def _wrapped(angles: Array) -> Array:
    return np.asarray(angles - 2 * np.pi * np.round(angles / (2 * np.pi)))


def _aims(kind: str, value: Array) -> Array:
    if kind == "direction":
        length: Array = np.linalg.norm(value, axis=-1, keepdims=True)
        return np.asarray(value / length)
    return value if kind == "none" else np.asarray(value[..., None])


def _check(xyz: Array | None, named: dict[str, Array]) -> None:
    if xyz is None and not named:
        raise InputError("the target fixes nothing", hint="give a position, an orientation or both")
    arrays = {**named} if xyz is None else {"position": xyz, **named}
    for name, array in arrays.items():
        if not np.isfinite(array).all():
            raise InputError(f"the {name} of the target is not finite")
    if xyz is not None and xyz.shape[-1:] != (3,):
        raise InputError(f"a position has 3 coordinates, this array has shape {xyz.shape}")
    direction, pitch = named.get("direction"), named.get("pitch")
    if direction is not None and not np.linalg.norm(direction, axis=-1).all():
        raise InputError("the direction of the target has length zero")
    if pitch is not None and (np.abs(pitch) > np.pi / 2).any():
        worst = float(np.abs(pitch).max())
        raise InputError(f"a pitch is an elevation within pi/2 of level, this one is {worst:.6g} rad")


def held_jacobian(robot: Robot, joints: Array, target: IkTarget) -> Array:
    """Return the Jacobians (K, m, n) of what the target fixes, lengths divided by the length of the arm."""
    held = residual_jacobian(target.flat(), forward(robot, joints), jacobian(robot, joints))
    held[:, : sum(target.position)] /= characteristic_length(robot)
    return held


def rank_of(values: Array) -> NDArray[np.intp]:
    """Return how many singular values (..., m) are above what rounding leaves of the largest, shape (...)."""
    return np.asarray(np.count_nonzero(values > _LOST * values[..., :1], axis=-1))


def ranks(robot: Robot, joints: Array, target: IkTarget) -> tuple[NDArray[np.intp], int]:
    """Return in how many directions of what the target fixes the tcp can move: (K,) here, and nearby.

    Args:
        robot: The arm.
        joints: Shape (K, n), rad or m, K >= 1.
        target: One target.
    """
    count = joints.shape[1]
    steps = _SPREAD * np.cos(np.square(np.arange(1.0, _AROUND * count + 1.0))).reshape(_AROUND, count)
    held = held_jacobian(robot, np.vstack([joints, joints[:1] + steps]), target)
    counts = rank_of(np.asarray(np.linalg.svd(held, compute_uv=False), dtype=np.float64))
    return counts[: len(joints)], int(counts.max())
