"""SO(3): rotations as 3x3 matrices, batches in front.

A matrix R_a_b has the axes of frame b, written in frame a, as its columns: p_a = R_a_b @ p_b. Other
representations stand in `quaternion`, `axis_angle` and `euler`.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trajcli.errors import InputError

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
Axis = Literal["x", "y", "z"]
Frame = Literal["current", "fixed"]

ROTATION_DEFECT = 1e-4  # entries rounded to four decimals are still taken, wrong ones are not
AXES = "xyz"
_QUARTER = np.pi / 2
_ROUNDING = 4 * np.finfo(np.float64).eps  # an angle given in degrees is within two of these


def cos_sin(angle: ArrayLike) -> tuple[Array, Array]:
    """Return cosine and sine (*batch,) of angles in rad; of whole quarter turns exactly 0, 1 or -1.

    A quarter turn is recognised within four roundings, so that 90 deg leaves exact zeros in a matrix.
    """
    angles = np.asarray(angle, dtype=np.float64)
    cosine, sine = np.cos(angles), np.sin(angles)
    near = _ROUNDING * np.maximum(1.0, np.abs(angles))
    exact = np.abs(angles - np.round(angles / _QUARTER) * _QUARTER) <= near
    return np.where(exact, np.round(cosine) + 0.0, cosine), np.where(exact, np.round(sine) + 0.0, sine)


def rotation_about(axis: Axis, angle: ArrayLike) -> Array:
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

    A defect above rounding is for the caller to tell; `nearest_rotation` takes it away.

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
    i, j = sorted(int(index) for index in np.unravel_index(np.nanargmax(defects), (3, 3)))
    if i == j:
        return f"column {i + 1} has length {np.sqrt(gram[i, i]):.6g} instead of 1"
    return f"columns {i + 1} and {j + 1} are not at right angles, their product is {gram[i, j]:.3g}"
