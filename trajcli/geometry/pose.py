"""Poses, SE(3): 4x4 matrices T_a_b with p_a = T_a_b @ p_b, batches in front; twists, linear part first."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from trajcli.errors import InputError
from trajcli.geometry.rotation import (
    Array,
    check_rotation,
    cross_matrix,
    exp,
    log,
    slerp,
)

PoseInterpolation = Literal["line", "screw"]
LAST_ROW = 1e-9  # of the last row from (0, 0, 0, 1): it is never measured, only typed
_SMALL = 1e-4  # rad, below which the limits of the factors of K^2 are exact to 1e-17


def build(rotation: ArrayLike | None = None, translation: ArrayLike | None = None) -> Array:
    """Return the poses (*batch, 4, 4) of rotations (*batch, 3, 3) and translations (*batch, 3), m."""
    r = np.eye(3) if rotation is None else np.asarray(rotation, dtype=np.float64)
    t = np.zeros(3) if translation is None else np.asarray(translation, dtype=np.float64)
    result = np.zeros((*np.broadcast_shapes(r.shape[:-2], t.shape[:-1]), 4, 4))
    result[..., :3, :3] = r
    result[..., :3, 3] = t
    result[..., 3, 3] = 1.0
    return result


def check_pose(matrix: ArrayLike) -> float:
    """Return the defect of the rotation in one 4x4 matrix, as `check_rotation` does.

    Raises:
        InputError: When the matrix is not 4x4 and finite, its last row is not (0, 0, 0, 1), or its rotation
            is none.
    """
    pose = np.asarray(matrix, dtype=np.float64)
    if pose.shape != (4, 4) or not np.isfinite(pose).all():
        what = f"has shape {pose.shape}" if pose.shape != (4, 4) else "holds one that is not finite"
        raise InputError(f"a homogeneous matrix has 4x4 finite entries, this one {what}")
    if np.abs(pose[3] - [0.0, 0.0, 0.0, 1.0]).max() > LAST_ROW:
        row = ", ".join(f"{entry:.6g}" for entry in pose[3])
        raise InputError(f"the last row of a homogeneous matrix must be 0, 0, 0, 1, it is {row}")
    return check_rotation(pose[:3, :3])


def invert(pose: Array) -> Array:
    """Return the inverse poses (*batch, 4, 4): R^T and -R^T t."""
    transposed = np.swapaxes(pose[..., :3, :3], -1, -2)
    return build(transposed, -(transposed @ pose[..., :3, 3:])[..., 0])


def transform_points(pose: Array, points: ArrayLike) -> Array:
    """Return the points (*batch, 3), m, written in frame b, in frame a of the poses T_a_b (*batch, 4, 4)."""
    values = np.asarray(points, dtype=np.float64)
    return (pose[..., :3, :3] @ values[..., None])[..., 0] + pose[..., :3, 3]


def log_pose(pose: Array) -> Array:
    """Return the constant twists (*batch, 6), m and rad, from the identity to the poses in unit time.

    v = V^-1 t with V^-1 = I - K/2 + ((1 - (a/2) cot(a/2)) / a^2) K^2, K the cross matrix of the rotation
    vector of length a.

    Source: Murray, Li and Sastry (1994), section 2.3.
    """
    vector = log(pose[..., :3, :3])
    square = np.einsum("...i,...i", vector, vector)[..., None, None]
    k = cross_matrix(vector)
    small = square < _SMALL**2
    half = np.sqrt(np.where(small, 1.0, square)) / 2.0
    factor = np.where(small, 1.0 / 12.0, (1.0 - half / np.tan(half)) / (4.0 * half * half))
    inverse = np.eye(3) - 0.5 * k + factor * (k @ k)
    return np.concatenate([(inverse @ pose[..., :3, 3:])[..., 0], vector], axis=-1)


def exp_pose(twist: ArrayLike) -> Array:
    """Return the poses (*batch, 4, 4) to which twists (*batch, 6) lead from the identity in unit time.

    t = V v with V = I + ((1 - cos a) / a^2) K + ((a - sin a) / a^3) K^2, in the terms of `log_pose`.
    """
    values = np.asarray(twist, dtype=np.float64)
    vector = values[..., 3:]
    square = np.einsum("...i,...i", vector, vector)[..., None, None]
    k = cross_matrix(vector)
    small = square < _SMALL**2
    angle = np.sqrt(square)
    half = np.sinc(angle / (2.0 * np.pi))
    factor = np.where(small, 1.0 / 6.0, (1.0 - np.sinc(angle / np.pi)) / np.where(small, 1.0, square))
    v = np.eye(3) + 0.5 * half * half * k + factor * (k @ k)
    return build(exp(vector), (v @ values[..., :3, None])[..., 0])


def twist_between(start: Array, end: Array) -> Array:
    """Return the constant twists (*batch, 6), in the frame of `start`, that lead to `end` in unit time."""
    return log_pose(invert(start) @ end)


def interpolate(start: Array, end: Array, s: ArrayLike, kind: PoseInterpolation = "line") -> Array:
    """Return the poses (*batch, 4, 4) between `start` (s = 0) and `end` (s = 1).

    Args:
        start: Shape (*batch, 4, 4).
        end: Shape (*batch, 4, 4).
        s: Any shape that broadcasts with batch.
        kind: "line": the origin goes straight and the rotation about its fixed axis; "screw": the whole
            pose goes at constant twist.
    """
    fraction = np.asarray(s, dtype=np.float64)[..., None]
    if kind == "screw":
        return start @ exp_pose(fraction * twist_between(start, end))
    here, there = start[..., :3, 3], end[..., :3, 3]
    rotation = slerp(start[..., :3, :3], end[..., :3, :3], fraction[..., 0])
    return build(rotation, (1.0 - fraction) * here + fraction * there)
