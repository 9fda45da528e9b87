"""Rotations, SO(3): matrices, unit quaternions, rotation vectors, axis and angle; batches in front.

A matrix R_a_b (*batch, 3, 3) has the axes of frame b, written in frame a, as its columns: p_a = R_a_b @ p_b.
Quaternions quat_wxyz (*batch, 4) have the scalar first; q and -q are the same rotation, and the canonical one
has w > 0, or its first non-zero component positive. Euler angles are in `euler`.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trajcli.errors import InputError
from trajcli.frozen import frozen

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
AxisName = Literal["x", "y", "z"]
Frame = Literal["current", "fixed"]

ROTATION_DEFECT = 1e-4  # entries rounded to four decimals are still taken, wrong ones are not
QUATERNION_DEFECT = 1e-4  # of the length, as for matrices
NO_ANGLE = 1e-12  # rad, below which rounding decides the axis
HALF_TURN = 1e-9  # rad from pi, within which either sign of the axis describes the same rotation
AXES = "xyz"
_QUARTER = np.pi / 2
_ROUNDING = 4 * np.finfo(np.float64).eps  # an angle given in degrees is within two of these
_NOISE = 1e-12  # a component as small as this says nothing by its sign: it is rounding
_FAR = -1.0  # twice the cosine of the angle, 120 deg, from which on the quaternion is used


def cos_sin(angle: ArrayLike) -> tuple[Array, Array]:
    """Return cosine and sine (*batch,) of angles in rad; of whole quarter turns exactly 0, 1 or -1.

    A quarter turn is recognised within four roundings, so that 90 deg leaves exact zeros in a matrix.
    """
    angles = np.asarray(angle, dtype=np.float64)
    cosine, sine = np.cos(angles), np.sin(angles)
    near = _ROUNDING * np.maximum(1.0, np.abs(angles))
    exact = np.abs(angles - np.round(angles / _QUARTER) * _QUARTER) <= near
    return np.where(exact, np.round(cosine) + 0.0, cosine), np.where(exact, np.round(sine) + 0.0, sine)


def rotation_about(axis: AxisName, angle: ArrayLike) -> Array:
    """Return the elementary rotations (*batch, 3, 3) by `angle` (*batch,), rad, about a coordinate axis."""
    cosine, sine = cos_sin(angle)
    i = AXES.index(axis)
    j, k = (i + 1) % 3, (i + 2) % 3
    result = np.zeros((*cosine.shape, 3, 3))
    result[..., i, i] = 1.0
    result[..., j, j] = result[..., k, k] = cosine
    result[..., k, j] = sine
    result[..., j, k] = -sine
    return result


def compose_turns(turns: Iterable[tuple[Array, Frame]], size: int = 3) -> Array:
    """Return the product of rotations or poses carried out one after the other, each about its own frame.

    Args:
        turns: Pairs of a matrix (*batch, size, size) and the frame whose axes it is written in: "current",
            the frame as moved so far (multiplies from the right), or "fixed", the first one (from the left).
        size: 3 for rotations, 4 for poses; no turns at all give the identity.

    Source: Spong, Hutchinson and Vidyasagar, Robot Modeling and Control (2006), section 2.4.
    """
    result = np.eye(size)
    for matrix, frame in turns:
        result = matrix @ result if frame == "fixed" else result @ matrix
    return result


def rotation_defect(matrix: Array) -> Array:
    """Return the largest entry (*batch,) of |R^T R - I| of matrices (*batch, 3, 3)."""
    defects: Array = np.abs(np.swapaxes(matrix, -1, -2) @ matrix - np.eye(3)).max(axis=(-2, -1))
    return defects


def check_rotation(matrix: ArrayLike) -> float:
    """Return the defect of one 3x3 matrix, the largest entry of |R^T R - I|, if it can pass for a rotation.

    A defect above rounding is for the caller to report; `nearest_rotation` takes it away.

    Raises:
        InputError: When the matrix is not 3x3 and finite, mirrors space (negative determinant), or has a
            defect above 1e-4. The message says which columns are at fault.
    """
    rotation = np.asarray(matrix, dtype=np.float64)
    if rotation.shape != (3, 3) or not np.isfinite(rotation).all():
        raise InputError(f"a rotation matrix has 3x3 finite entries, this one has shape {rotation.shape}")
    with np.errstate(over="ignore", invalid="ignore"):
        gram, determinant = rotation.T @ rotation, float(np.linalg.det(rotation))
    defects = np.abs(gram - np.eye(3))
    defect = float(defects.max())
    if determinant < 0:
        raise InputError(
            f"the matrix mirrors space: its determinant is {determinant:.4g} (a left-handed frame), a "
            f"rotation has +1; R^T R differs from the identity by {defect:.3g}",
            hint="turn the sign of one column, so that x cross y is z",
        )
    if not defect <= ROTATION_DEFECT:
        raise InputError(
            f"the matrix is no rotation: {_worst_columns(gram, defects)}; R^T R differs from the identity by "
            f"{defect:.3g}, allowed is {ROTATION_DEFECT:g}, and the determinant is {determinant:.4g}",
            hint="look for a wrong sign or entry; rounded entries need at least four decimals",
        )
    return defect


def nearest_rotation(matrix: Array) -> Array:
    """Return the rotations (*batch, 3, 3) with the smallest sum of squared differences from `matrix`.

    Source: Higham, Functions of Matrices (2008), section 8.1 (the polar factor); the determinant is kept +1.
    """
    left, _, right = np.linalg.svd(matrix)
    left[..., :, 2] *= np.where(np.linalg.det(left @ right) < 0.0, -1.0, 1.0)[..., None]
    result: Array = left @ right
    return result


def _worst_columns(gram: Array, defects: Array) -> str:
    """Return a sentence about the columns with the largest defect."""
    i, j = sorted(int(index) for index in np.unravel_index(np.nanargmax(defects), (3, 3)))
    if i == j:
        return f"column {i + 1} has length {np.sqrt(gram[i, i]):.6g} instead of 1"
    return f"columns {i + 1} and {j + 1} are not at right angles, their product is {gram[i, j]:.3g}"


def check_quaternion(quaternion: ArrayLike) -> float:
    """Return how far the length of one quaternion is from 1, if it can pass for a unit quaternion.

    Raises:
        InputError: When it has not four finite components or its length differs from 1 by more than 1e-4.
    """
    values = np.asarray(quaternion, dtype=np.float64)
    if values.shape != (4,) or not np.isfinite(values).all():
        raise InputError("a quaternion has four finite components: w, x, y, z")
    length = float(np.linalg.norm(values))
    if abs(length - 1.0) > QUATERNION_DEFECT:
        raise InputError(
            f"the quaternion has length {length:.6g} instead of 1 (allowed difference {QUATERNION_DEFECT:g})",
            hint="divide it by its length" if length > 0 else "no rotation is (1, 0, 0, 0)",
        )
    return abs(length - 1.0)


def canonical(quaternion: Array) -> Array:
    """Return the quaternions (*batch, 4) with the sign that makes their first non-zero component positive."""
    first = np.argmax(quaternion != 0.0, axis=-1)[..., None]
    sign = np.where(np.take_along_axis(quaternion, first, axis=-1) < 0.0, -1.0, 1.0)
    result: Array = quaternion * sign + 0.0  # + 0.0 takes away negative zeros
    return result


def matrix_from_quaternion(quaternion: ArrayLike) -> Array:
    """Return the rotation matrices (*batch, 3, 3); the length of the quaternion is divided out.

    Raises:
        InputError: When a quaternion is zero or not finite.
    """
    values = np.asarray(quaternion, dtype=np.float64)
    square = np.einsum("...i,...i", values, values)
    if not ((square > 0.0) & np.isfinite(square)).all():
        raise InputError(
            "a quaternion of length zero, or not finite, is no rotation", hint="no rotation is (1, 0, 0, 0)"
        )
    w, x, y, z = np.moveaxis(values, -1, 0)
    f = 2.0 / square
    result = np.empty((*values.shape[:-1], 3, 3))
    result[..., 0, 0] = 1.0 - f * (y * y + z * z)
    result[..., 1, 1] = 1.0 - f * (x * x + z * z)
    result[..., 2, 2] = 1.0 - f * (x * x + y * y)
    for (i, j), product, twist in (((1, 0), x * y, w * z), ((0, 2), x * z, w * y), ((2, 1), y * z, w * x)):
        result[..., i, j] = f * (product + twist)
        result[..., j, i] = f * (product - twist)
    return result


def quaternion_from_matrix(matrix: Array) -> Array:
    """Return the canonical unit quaternions (*batch, 4) of rotation matrices (*batch, 3, 3).

    The entries of R give the sixteen products 4 q q^T; the row through the largest component is divided by
    its own length, so that no digit is lost at any angle.

    Source: Shepperd, Quaternion from rotation matrix, J. Guidance and Control 1 (1978).
    """
    r = np.moveaxis(np.asarray(matrix, dtype=np.float64), (-2, -1), (0, 1))
    products = np.empty((*matrix.shape[:-2], 4, 4))
    trace = r[0, 0] + r[1, 1] + r[2, 2]
    products[..., 0, 0] = 1.0 + trace
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        products[..., i + 1, i + 1] = 1.0 + 2.0 * r[i, i] - trace
        products[..., 0, i + 1] = products[..., i + 1, 0] = r[k, j] - r[j, k]
        products[..., j + 1, k + 1] = products[..., k + 1, j + 1] = r[j, k] + r[k, j]
    largest = np.argmax(np.einsum("...ii->...i", products), axis=-1)[..., None, None]
    row = np.take_along_axis(products, largest, axis=-2)[..., 0, :]
    return canonical(row / np.linalg.norm(row, axis=-1, keepdims=True))


def without_jumps(quaternions: Array, last: Array | None) -> Array:
    """Return unit quaternions (N, 4) with signs such that each is on the side of the one before.

    Args:
        quaternions: Unit quaternions, N at least 1.
        last: The one before the first, (4,); None makes the first canonical, components up to 1e-12 taken as
            zero: where w is zero but for rounding, as in half turns, its sign would be a different one on
            every processor.
    """
    first = quaternions[0]
    side = canonical(np.where(np.abs(first) > _NOISE, first, 0.0)) if last is None else last
    before = np.concatenate([side[None], quaternions[:-1]])
    turned = np.einsum("ni,ni->n", before, quaternions) < 0.0
    # each sign is against the given neighbour; the product carries it on
    signs = np.cumprod(np.where(turned, -1.0, 1.0))
    return np.asarray(quaternions * signs[:, None])


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

    Source: Murray, Li and Sastry (1994), eq. 2.14.
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
    """Return the same from the quaternion, whose accuracy does not fall near pi."""
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
    """Return the rotations between `start` (s = 0) and `end` (s = 1) at constant angular velocity.

    The rotation is the shorter one; half a turn apart there are two, and the one about log's axis is taken.

    Args:
        start: Shape (*batch, 3, 3).
        end: Shape (*batch, 3, 3).
        s: Any shape that broadcasts with batch; values outside [0, 1] go on turning.
    """
    vector = log(np.swapaxes(start, -1, -2) @ end)
    return start @ exp(np.asarray(s, dtype=np.float64)[..., None] * vector)
