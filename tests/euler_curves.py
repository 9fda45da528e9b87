"""Interpolations of Euler angles from one triple to another, for tests of one segment."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from trajcli.geometry.paths.euler_interpolation import EulerInterpolation
from trajcli.geometry.paths.orientation import SegmentProgress
from trajcli.geometry.rotation import Frame


def euler_between(
    start: ArrayLike, end: ArrayLike, sequence: str, frame: Frame = "current", length: float | None = None
) -> EulerInterpolation:
    angles = np.array([start, end], dtype=np.float64)
    distance = float(np.linalg.norm(angles[1] - angles[0]))
    return EulerInterpolation(
        angles, SegmentProgress.even(distance if length is None else length), sequence, frame
    )
