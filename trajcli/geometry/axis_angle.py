"""Rotation vectors: exponential, logarithm, axis and angle, interpolation at constant angular velocity."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from trajcli.errors import InputError
from trajcli.frozen import frozen
from trajcli.geometry.quaternion import quaternion_from_matrix
from trajcli.geometry.rotation import Array, Flags

NO_ANGLE = 1e-12  # rad, below which rounding decides the axis
_FAR = -1.0  # twice the cosine of the angle, 120 deg, from which on the quaternion is used
HALF_TURN = 1e-9  # rad from pi, within which either sign of the axis describes the same rotation


@frozen
class AxisAngle:
    """Rotations by an angle from 0 to pi about an axis.

    Attributes:
        axis: Unit vectors, shape (*batch, 3).
        angle: Rad, shape (*batch,).
        axis_free: Where the angle is zero, and any axis is right.
        sign_free: Where the angle is pi, and the opposite axis is right too.
    """

    axis: Array
    angle: Array
    axis_free: Flags
    sign_free: Flags


def cross_matrix(vector: Array) -> Array:
    """Return the matrices K (*batch, 3, 3) with K @ p = vector x p."""
    result = np.zeros((*vector.shape, 3))
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        result[..., k, j] = vector[..., i]
        result[..., j, k] = -vector[..., i]
    return result


def exp(vector: ArrayLike) -> Array:
    """Return the rotation matrices (*batch, 3, 3) of rotation vectors (*batch, 3): axis times angle, rad.

    R = I + (sin t / t) K + ((1 - cos t) / t^2) K^2, both quotients by way of sin(x)/x, exact at 0.

    Source: Murray, Li and Sastry, A Mathematical Introduction to Robotic Manipulation (1994), eq. 2.14.
    """
    values = np.asarray(vector, dtype=np.float64)
    angle = np.linalg.norm(values, axis=-1)[..., None, None]
    k = cross_matrix(values)
    half = np.sinc(angle / (2.0 * np.pi))
    result: Array = np.eye(3) + np.sinc(angle / np.pi) * k + 0.5 * half * half * (k @ k)
    return result


def log(matrix: Array) -> Array:
    """Return the rotation vectors (*batch, 3), of length 0 to pi, of rotation matrices (*batch, 3, 3).

    It is accurate at every angle: the axis is taken from the antisymmetric part of R, and near pi, where that
    vanishes, by way of the quaternion from the symmetric part. At pi the sign of the axis is free;
    `axis_angle_from_matrix` says so.
    """
    r = np.asarray(matrix, dtype=np.float64)
    double = np.stack(
        [r[..., 2, 1] - r[..., 1, 2], r[..., 0, 2] - r[..., 2, 0], r[..., 1, 0] - r[..., 0, 1]], axis=-1
    )
    sine = np.sqrt(np.einsum("...i,...i", double, double))  # both doubled
    cosine = np.einsum("...ii", r) - 1.0
    angle = np.arctan2(sine, cosine)
    ratio = np.full_like(sine, 0.5)  # limit of angle / (2 sin(angle))
    np.divide(angle, sine, out=ratio, where=sine > 0.0)
    result: Array = double * ratio[..., None]
    far = np.asarray(cosine < _FAR)
    if far.any():
        result[far] = _log_by_quaternion(r[far])
    return result


def _log_by_quaternion(matrix: Array) -> Array:
    quaternion = quaternion_from_matrix(matrix)
    sine = np.linalg.norm(quaternion[..., 1:], axis=-1)
    ratio = np.full_like(sine, 2.0)  # limit of angle / sin(angle / 2)
    angle = 2.0 * np.arctan2(sine, quaternion[..., 0])
    np.divide(angle, sine, out=ratio, where=sine > 0.0)
    result: Array = quaternion[..., 1:] * ratio[..., None]
    return result


def matrix_from_axis_angle(axis: ArrayLike, angle: ArrayLike) -> Array:
    """Return the rotation matrices (*batch, 3, 3) by `angle` (*batch,), rad, about `axis` (*batch, 3).

    Only the direction of the axis counts.

    Raises:
        InputError: When an axis has no direction.
    """
    directions, angles = np.asarray(axis, dtype=np.float64), np.asarray(angle, dtype=np.float64)
    length = np.linalg.norm(directions, axis=-1, keepdims=True)
    if not ((length > 0.0) & np.isfinite(length)).all():
        raise InputError("the axis of a rotation must be a finite vector other than zero")
    return exp(directions / length * angles[..., None])


def axis_angle_from_matrix(matrix: Array) -> AxisAngle:
    """Return axis and angle of rotation matrices (*batch, 3, 3); an axis that is wholly free is z."""
    quaternion = quaternion_from_matrix(matrix)
    sine = np.linalg.norm(quaternion[..., 1:], axis=-1)
    angle = 2.0 * np.arctan2(sine, quaternion[..., 0])
    none = sine == 0.0
    axis = np.where(
        none[..., None], [0.0, 0.0, 1.0], quaternion[..., 1:] / np.where(none, 1.0, sine)[..., None]
    )
    return AxisAngle(axis, angle, angle <= NO_ANGLE, angle >= np.pi - HALF_TURN)


def slerp(start: Array, end: Array, s: ArrayLike) -> Array:
    """Return the rotations on the way from `start` (s = 0) to `end` (s = 1) at constant angular velocity.

    The way is the shorter one; half a turn apart there are two, and the one about log's axis is taken.

    Args:
        start: Shape (*batch, 3, 3).
        end: Shape (*batch, 3, 3).
        s: Any shape that broadcasts with batch; values outside [0, 1] go on turning.
    """
    vector = log(np.swapaxes(start, -1, -2) @ end)
    return start @ exp(np.asarray(s, dtype=np.float64)[..., None] * vector)
