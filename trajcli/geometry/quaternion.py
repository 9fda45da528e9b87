"""Unit quaternions quat_wxyz, scalar first, batches in front: (*batch, 4).

q and -q are the same rotation; the canonical one has w > 0, or its first non-zero component positive.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from trajcli.errors import InputError
from trajcli.geometry.rotation import Array

QUATERNION_DEFECT = 1e-4  # of the length, as for matrices
_NOISE = 1e-12  # a component as small as this says nothing by its sign: rounding made it


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


def multiply(left: Array, right: Array) -> Array:
    """Return the Hamilton products (*batch, 4): first `right`, then `left`, about fixed axes."""
    a, b = np.moveaxis(left, -1, 0), np.moveaxis(right, -1, 0)
    return np.stack(
        [
            a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
            a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
            a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
            a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
        ],
        axis=-1,
    )


def conjugate(quaternion: Array) -> Array:
    """Return the inverse rotations (*batch, 4) of unit quaternions."""
    result: Array = quaternion * np.array([1.0, -1.0, -1.0, -1.0])
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
