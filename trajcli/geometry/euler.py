"""Euler angles: the twelve sequences on current or fixed axes, and roll, pitch and yaw.

With i, j, k the axes of a sequence on current axes, R = R_i(a) R_j(b) R_k(c). Row i of R depends on b and c
alone, so c and b are read from it; a follows from R R_k(-c), whose column j is R_i(a) e_j. Reading a last
makes the three angles reproduce R to rounding even where a and c are hardly determined. The same angles on
fixed axes belong to the reversed sequence: R_k(c) R_j(b) R_i(a).

Source: Siciliano et al. (2009), section 2.4, worked out for all axes at once by the parity p of (i, j, third
axis).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trajcli.errors import InputError
from trajcli.frozen import frozen
from trajcli.geometry.rotation import AXES, Array, Flags, Frame, rotation_about

GIMBAL_LOCK = 1e-7  # rad from the lock, within which first and third angle are said to be undetermined
_NOISE = 1e-12  # rad from the lock, within which rounding alone would split the sum


@frozen
class EulerAngles:
    """The two triples of angles that describe a rotation, each angle in [-pi, pi].

    Attributes:
        angles: Shape (*batch, 3), rad. The middle angle is in [-pi/2, pi/2] for three different axes, in
            [0, pi] where the first and the last axis are the same.
        alternative: Shape (*batch, 3), the other triple of the same rotation.
        lock: Shape (*batch,): 0 where all is regular; at gimbal lock 1 where only the sum of first and third
            angle is determined and -1 where only their difference is. At the lock itself the turn of `angles`
            that is last on current axes (first on fixed axes) is zero.
    """

    angles: Array
    alternative: Array
    lock: NDArray[np.int8]

    @property
    def singular(self) -> Flags:
        """Where the rotation is at gimbal lock, shape (*batch,)."""
        return np.not_equal(self.lock, 0)


def matrix_from_euler(sequence: str, angles: ArrayLike, frame: Frame = "current") -> Array:
    """Return the rotation matrices (*batch, 3, 3) of angles (*batch, 3), rad, about the axes of `sequence`.

    Raises:
        InputError: When the sequence is none of the twelve.
    """
    check_sequence(sequence)
    values = np.asarray(angles, dtype=np.float64)
    turns = [rotation_about(axis, values[..., n]) for n, axis in enumerate(sequence.lower())]  # type: ignore[arg-type]
    first, middle, last = turns if frame == "current" else reversed(turns)
    return first @ middle @ last


def euler_from_matrix(sequence: str, matrix: Array, frame: Frame = "current") -> EulerAngles:
    """Return both triples of angles of rotation matrices (*batch, 3, 3), read from the entries as they are.

    Raises:
        InputError: When the sequence is none of the twelve.
    """
    if frame == "fixed":
        i, j, k = check_sequence(sequence[::-1])
    else:
        i, j, k = check_sequence(sequence)
    rotation = np.asarray(matrix, dtype=np.float64)
    a, b, c, lock = _repeated(rotation, i, j) if i == k else _different(rotation, i, j, k)
    angles = np.stack([a, b, c], axis=-1)
    alternative = np.stack([_opposite(a), -b if i == k else _opposite(-b), _opposite(c)], axis=-1)
    if frame == "fixed":
        angles, alternative = angles[..., ::-1], alternative[..., ::-1]
    return EulerAngles(angles + 0.0, alternative + 0.0, lock)


def matrix_from_rpy(rpy: ArrayLike) -> Array:
    """Return R = Rz Ry Rx (*batch, 3, 3) of [about x, about y, about z] (*batch, 3), rad, fixed axes."""
    return matrix_from_euler("xyz", rpy, "fixed")


def rpy_from_matrix(matrix: Array) -> EulerAngles:
    """Return [about x, about y, about z], rad, fixed axes, of matrices (*batch, 3, 3); at the lock x is 0."""
    return euler_from_matrix("xyz", matrix, "fixed")


def check_sequence(sequence: str) -> tuple[int, int, int]:
    """Return the axes of a sequence such as "ZYZ" as numbers 0 to 2.

    Raises:
        InputError: When it is none of the twelve: three letters x, y, z, no two alike in a row.
    """
    axes = sequence.lower()
    if len(axes) != 3 or any(axis not in AXES for axis in axes) or axes[0] == axes[1] or axes[1] == axes[2]:
        raise InputError(
            f"{sequence!r} is no sequence of Euler angles",
            hint="three letters of X, Y and Z, no two alike in a row, such as ZYZ or XYZ",
        )
    i, j, k = (AXES.index(axis) for axis in axes)
    return i, j, k


def _different(r: Array, i: int, j: int, k: int) -> tuple[Array, Array, Array, NDArray[np.int8]]:
    """Return a, b, c and lock for three different axes: row i is (cos b cos c, -p cos b sin c, p sin b)."""
    p = 1.0 if (j - i) % 3 == 1 else -1.0
    cosine = np.hypot(r[..., i, i], r[..., i, j])
    c = np.where(cosine <= _NOISE, 0.0, np.arctan2(-p * r[..., i, j], r[..., i, i]))
    b = np.arctan2(p * r[..., i, k], cosine)
    cc, sc = np.cos(c), np.sin(c)
    a = np.arctan2(
        p * (cc * r[..., k, j] + p * sc * r[..., k, i]),
        cc * r[..., j, j] + p * sc * r[..., j, i],
    )
    return a, b, c, _lock(cosine, p * b)


def _repeated(r: Array, i: int, j: int) -> tuple[Array, Array, Array, NDArray[np.int8]]:
    """Return a, b, c and lock for axes i, j, i: row i is (cos b, sin b sin c, p sin b cos c)."""
    p = 1.0 if (j - i) % 3 == 1 else -1.0
    k = 3 - i - j
    sine = np.hypot(r[..., i, j], r[..., i, k])
    c = np.where(sine <= _NOISE, 0.0, np.arctan2(r[..., i, j], p * r[..., i, k]))
    b = np.arctan2(sine, r[..., i, i])
    cc, sc = np.cos(c), np.sin(c)
    a = np.arctan2(
        p * (cc * r[..., k, j] - p * sc * r[..., k, k]),
        cc * r[..., j, j] - p * sc * r[..., j, k],
    )
    return a, b, c, _lock(sine, r[..., i, i])


def _lock(distance: Array, sign: Array) -> NDArray[np.int8]:
    """Return what is determined at a distance from the lock: 0 all, 1 the sum, -1 the difference."""
    return np.where(distance <= GIMBAL_LOCK, np.where(sign > 0.0, 1, -1), 0).astype(np.int8)


def _opposite(angle: Array) -> Array:
    """Return angle + pi in (-pi, pi]."""
    return np.where(angle > 0.0, angle - np.pi, angle + np.pi)
