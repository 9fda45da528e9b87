"""The switching structure against closed forms and the definition."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from topp_paths import polyline, random_bounds, spline, symmetric

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.curves.time_optimal.parameterization import time_optimal
from trajcli.curves.time_optimal.switching import switching_structure


def listed(found):
    return [(b.joint, b.quantity, b.sign) for b in found]


def test_a_trapezoid():
    path = polyline([[0.0, 0.0], [-3.0, 1.0]])
    velocity, acceleration = symmetric(1.0, 2.0), np.array([[-2.0, 1.0], [-9.0, 9.0]])
    found = switching_structure(time_optimal(path, velocity, acceleration).trajectory, velocity, acceleration)
    assert listed(found) == [(0, "acceleration", -1), (0, "velocity", -1), (0, "acceleration", 1)]
    times = [(b.start, b.end) for b in found]
    np.testing.assert_allclose(times, [(0, 0.5), (0.5, 2.75), (2.75, 3.75)], atol=1e-8)


def test_the_joint_that_binds_changes_at_a_corner():
    path = polyline([[0.0, 0.0], [1.0, 0.2], [1.2, 1.2]])
    velocity, acceleration = symmetric(9.0, 9.0), symmetric(1.0, 1.0)
    found = switching_structure(time_optimal(path, velocity, acceleration).trajectory, velocity, acceleration)
    assert listed(found) == [(j, "acceleration", sign) for j in (0, 1) for sign in (1, -1)]
    np.testing.assert_allclose([b.end for b in found], [1, 2, 3, 4], atol=1e-8)


@pytest.mark.parametrize("seed", range(4))
def test_a_limit_binds_where_it_is_said_to(seed):
    rng = np.random.default_rng(seed)
    path, (velocity, acceleration) = spline(rng.uniform(-1, 1, (6, 3))), random_bounds(rng, 3)
    trajectory = time_optimal(path, velocity, acceleration).trajectory
    found = switching_structure(trajectory, velocity, acceleration)
    middles = (trajectory.breaks[1:] + trajectory.breaks[:-1]) / 2
    bound = {"velocity": (1, velocity), "acceleration": (2, acceleration)}
    used = []
    for b in found:
        t = middles[(middles > b.start) & (middles < b.end)]
        order, bounds = bound[b.quantity]
        share = trajectory.evaluate(t, order)[:, b.joint] / bounds[b.joint, (b.sign + 1) // 2]
        assert share.min() >= 0.9
        used += share.tolist()
    assert np.mean(used) >= 0.98
    assert all(a.end <= b.start for a, b in pairwise(found))
    assert sum(b.end - b.start for b in found) >= 0.9 * trajectory.duration


def test_of_two_limits_at_once_the_first_stays():
    halves = np.array(
        [[0.5, 0.5 + 1e-3 * (-1) ** k] for k in range(10)]
    )  # of the accelerations of ten pieces
    curve = PiecewisePolynomial(np.arange(11.0), np.stack([halves, 0 * halves, 0 * halves]))
    found = switching_structure(curve, symmetric(9, 9), symmetric(1, 1))
    assert [(b.start, b.end, b.joint) for b in found] == [(0.0, 10.0, 1)]
