"""A pose as numbers in the user's units, in every form that commands print."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from trajcli.curves.piecewise import Array
from trajcli.geometry.euler import rpy_from_matrix
from trajcli.geometry.rotation import quaternion_from_matrix
from trajcli.units import Quantity, Units, factor


def pose_view(pose: Array, units: Units) -> dict[str, Any]:
    """Return one pose (4, 4), in m, as {matrix, xyz, rpy, quat_wxyz} in the given units.

    `matrix` has its translation in the unit of length; `rpy` are angles about the fixed axes x, y and z,
    read off the matrix as it stands.
    """
    rotation = pose[:3, :3]
    shown = np.array(pose)
    shown[:3, 3] /= factor(Quantity("length"), units)
    return {
        "matrix": plain(shown),
        "xyz": plain(shown[:3, 3]),
        "rpy": angles_view(rpy_from_matrix(rotation).angles, units),
        "quat_wxyz": plain(quaternion_from_matrix(rotation)),
    }


def angles_view(angles: Array, units: Units) -> list[float]:
    """Return angles, rad, in the given units; of half a turn the positive one, which is the same."""
    shown: list[float] = plain(np.where(angles == -np.pi, np.pi, angles) / factor(Quantity("angle"), units))
    return shown


def plain(values: ArrayLike) -> Any:  # noqa: ANN401
    """Return an array as nested lists of floats, without negative zeros."""
    return (np.asarray(values, dtype=np.float64) + 0.0).tolist()
