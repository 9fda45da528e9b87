"""Where the rate of an orientation jumps by more than rounding, so that a law must stop there."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from trajcli.geometry.paths.orientation import AxisAngleOrientation, SegmentProgress


@pytest.mark.parametrize(
    ("first", "more", "jumps"),
    [(1.0, 0.0, False), (1.0, 4e-10, False), (1.0, 4e-9, True), (0.0, 4e-11, False), (0.0, 4e-10, True)],
)
def test_a_rate_jumps_by_a_billionth_of_it_or_by_what_typed_digits_leave(first, more, jumps):
    """About one axis, over a metre each: the rates, rad/m, are the angles."""
    angles = np.array([0.0, first, 2 * first + more])
    rotations = Rotation.from_rotvec(angles[:, None] * [0.6, 0.0, 0.8]).as_matrix()
    curve = AxisAngleOrientation(rotations, SegmentProgress(np.array([0.0, 1.0, 2.0]), np.zeros(1)))
    assert curve.stops.tolist() == ([1.0] if jumps else [])
