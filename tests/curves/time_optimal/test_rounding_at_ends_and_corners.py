"""What is rounding and what is not: corners of joints that hardly move, speeds at the start."""

from __future__ import annotations

from math import sqrt

import numpy as np
import pytest
from topp_paths import polyline, spline, symmetric

from trajcli.curves.time_optimal.parameterization import time_optimal
from trajcli.curves.time_optimal.passes import UnreachableSpeedError
from trajcli.limits.tolerances import JUMP_ABSOLUTE


def test_a_joint_that_turns_back_beside_a_fast_one_is_a_corner():
    """At full speed its velocity would jump by more than the checks let rounding explain."""
    path = polyline([[0.0, 0.0], [1.0, 4e-13], [2.0, 0.0]])
    found = time_optimal(path, symmetric(10.0, 10.0), symmetric(100.0, 100.0))
    begins, ends = found.trajectory.piece_ends(1)
    assert np.abs(begins[1:] - ends[:-1])[:, 1].max() <= JUMP_ABSOLUTE
    assert found.stops.tolist() == [1.0]


@pytest.mark.parametrize(("velocity", "length"), [(1.0, 2.0), (0.7, 2.0), (1.0, 0.2)])
def test_a_speed_at_the_start_may_be_too_high_by_rounding(velocity, length):
    """The joint's own limit, or the speed from which it can just brake: sqrt(2 a s) with a = 1."""
    path = polyline([[0.0], [length]], [0.0, length])
    bounds, limit = (symmetric(velocity), symmetric(1.0)), min(velocity, sqrt(2 * length))
    found = time_optimal(path, *bounds, start_velocity=limit * (1 + 2e-13))
    assert found.law.evaluate(0.0, 1)[0] == pytest.approx(limit, rel=1e-12)
    with pytest.raises(UnreachableSpeedError):
        time_optimal(path, *bounds, start_velocity=limit * (1 + 3e-12))


@pytest.mark.parametrize("scale", [1e-20, 1e-9, 1e9, 1e20])
def test_however_large_the_parameter_is_the_motion_is_the_same(scale):
    """Four places, two joints without limits of velocity: sd is as large as the parameter, and stands for itself."""
    points = np.array([[0.0, 0.0], [1.0, 0.3], [0.4, 0.8], [1.2, 1.1]])
    bounds = symmetric(np.inf, 2.0), symmetric(3.0, 4.0)
    plain = time_optimal(spline(points), *bounds).trajectory
    scaled = time_optimal(spline(points, np.linspace(0.0, scale, 4)), *bounds).trajectory
    assert scaled.duration == pytest.approx(plain.duration, rel=1e-4)
