"""Laws whose acceleration changes within an interval: what they promise, and what they gain."""

from __future__ import annotations

from math import sqrt

import numpy as np
import pytest
from topp_paths import assert_motion, symmetric

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.curves.time_optimal.parameterization import time_optimal
from trajcli.curves.time_optimal.time_law import (
    distances_at_mean_speed,
    feasible_ramps,
    interval_durations,
    law_of,
)


def some_law(seed):
    rng = np.random.default_rng(seed)
    grid = np.cumsum(rng.uniform(0.1, 1, 30))
    x = rng.uniform(0.0, 2.0, 30)
    x[[0, 7, -1]] = 0.0
    return grid, x, feasible_ramps(grid, x, rng.uniform(-3, 3, 29))


@pytest.mark.parametrize("seed", range(5))
def test_a_law_passes_each_place_at_its_speed_and_never_turns_back(seed):
    grid, x, ramps = some_law(seed)
    law = law_of(grid, x, ramps)
    np.testing.assert_allclose(law.evaluate(law.breaks)[:, 0], grid, rtol=1e-13)
    for side in ("left", "right"):
        np.testing.assert_allclose(law.evaluate(law.breaks, 1, side=side)[:, 0] ** 2, x, atol=1e-12)
    begins, ends = law.piece_ends(2)
    np.testing.assert_allclose((ends - begins)[:, 0], 2 * ramps, rtol=1e-9, atol=1e-9)
    t = np.linspace(0, law.end, 20_001)
    assert law.evaluate(t, 1).min() >= -1e-12
    np.testing.assert_allclose(interval_durations(grid, x, ramps), law.lengths, rtol=1e-12)
    mean = (np.sqrt(x[1:]) + np.sqrt(x[:-1])) / 2
    np.testing.assert_allclose(distances_at_mean_speed(grid, x, ramps), mean * law.lengths, rtol=1e-12)


def test_no_more_swing_than_keeps_the_speed_positive():
    grid, x = np.array([0.0, 1.0]), np.array([0.0, 1.0])
    np.testing.assert_allclose(feasible_ramps(grid, x, np.array([9.0])), [0.25])
    np.testing.assert_allclose(feasible_ramps(grid, x, np.array([9.0]), 0.5), [0.125])
    np.testing.assert_allclose(feasible_ramps(grid, x, np.array([-9.0])), [-9.0])


@pytest.mark.parametrize("powers", [[0.4, 1, 0], [0.5, -0.3, 1, 0], [-0.3, 0.5, 0.6, 0]])
def test_one_joint_is_as_fast_on_a_coarse_grid_however_its_path_is_parametrised(powers):
    """Accelerate, brake: 2 sqrt(D / A). Constant sdd in each interval would lose 0.3 % on as many of them."""
    path = PiecewisePolynomial([0.0, 1.0], np.array(powers)[:, None, None])
    distance = sum(powers)
    found = time_optimal(path, symmetric(9.0), symmetric(2.0))
    exact = 2 * sqrt(distance / 2.0)
    assert exact * (1 - 1e-9) <= found.trajectory.duration <= 1.001 * exact
    assert found.grid.size <= 100
    assert_motion(found, path, symmetric(9.0), symmetric(2.0))


def test_paths_of_high_degree_keep_to_constant_acceleration():
    path = PiecewisePolynomial([0.0, 1.0], np.array([0.1, 0, 0, 0.2, 1, 0])[:, None, None])
    found = time_optimal(path, symmetric(9.0), symmetric(2.0))
    assert (found.law.degree, found.trajectory.degree) == (2, 10)
    assert_motion(found, path, symmetric(9.0), symmetric(2.0))
