"""Laws whose acceleration changes within an interval: what they promise, and what they gain."""

from __future__ import annotations

from math import sqrt

import numpy as np
import pytest
from topp_paths import assert_motion, random_bounds, spline, symmetric

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.curves.time_optimal.parameterization import time_optimal
from trajcli.curves.time_optimal.time_law import law_and_trajectory, law_pieces


def some_law(seed):
    rng = np.random.default_rng(seed)
    grid = np.cumsum(rng.uniform(0.1, 1, 30))
    x = rng.uniform(0.5, 2.0, 30)
    x[[0, 7, -1]] = 0.0
    mean = np.diff(x) / (2 * np.diff(grid))
    ramps = rng.uniform(-0.5, 0.5, 29)
    return grid, x, mean - ramps, mean + ramps


@pytest.mark.parametrize("seed", range(5))
def test_a_law_passes_each_place_at_its_speed_and_acceleration_and_never_turns_back(seed):
    grid, x, near, far = some_law(seed)
    pieces = law_pieces(grid, x, near, far)
    law, _ = law_and_trajectory(PiecewisePolynomial(grid[[0, -1]], np.array([[[1.0]], [[grid[0]]]])), pieces)
    np.testing.assert_allclose(law.evaluate(law.breaks)[:, 0], grid, rtol=1e-13)
    for side in ("left", "right"):
        np.testing.assert_allclose(law.evaluate(law.breaks, 1, side=side)[:, 0] ** 2, x, atol=1e-12)
    begins, ends = (each[:, 0] for each in law.piece_ends(2))
    even = np.abs(ends - begins) < 1e-9  # where no law leads forward otherwise
    assert even.sum() < 10
    np.testing.assert_allclose(np.stack([begins, ends])[:, ~even], np.stack([near, far])[:, ~even], rtol=1e-9)
    np.testing.assert_allclose(begins[even], np.diff(x)[even] / (2 * np.diff(grid)[even]), rtol=1e-9)
    t = np.linspace(0, law.end, 20_001)
    assert law.evaluate(t, 1).min() >= -1e-12


def test_constant_acceleration_needs_no_more_than_parabolas():
    grid, x, _, _ = some_law(0)
    law = law_pieces(grid, x)
    assert len(law.coefficients) == 3
    np.testing.assert_allclose(
        law.durations, 2 * np.diff(grid) / (np.sqrt(x[1:]) + np.sqrt(x[:-1])), rtol=1e-12
    )


@pytest.mark.parametrize("powers", [[0.4, 1, 0], [0.5, -0.3, 1, 0], [-0.3, 0.5, 0.6, 0]])
def test_one_joint_is_as_fast_on_a_coarse_grid_however_its_path_is_parametrised(powers):
    """Accelerate, brake: 2 sqrt(D / A). Constant sdd in each interval would lose 0.3 % on as many of them."""
    path = PiecewisePolynomial([0.0, 1.0], np.array(powers)[:, None, None])
    distance = sum(powers)
    found = time_optimal(path, symmetric(9.0), symmetric(2.0))
    exact = 2 * sqrt(distance / 2.0)
    assert exact * (1 - 1e-9) <= found.trajectory.duration <= 1.0001 * exact
    assert found.grid.size <= 110
    assert_motion(found, path, symmetric(9.0), symmetric(2.0))


def steps(trajectory):
    """Return at how many breaks the acceleration of a joint steps."""
    begins, ends = trajectory.piece_ends(2)
    return int((np.abs(begins[1:] - ends[:-1]) > 1e-6 * np.abs(begins).max()).any(axis=1).sum())


@pytest.mark.parametrize("seed", range(3))
def test_between_its_switches_the_acceleration_is_continuous(seed):
    """A motion of four joints through six points switches some dozen times; its law has ten times as many pieces."""
    rng = np.random.default_rng(seed)
    path, bounds = spline(rng.uniform(-1, 1, (6, 4))), random_bounds(rng, 4)
    found = time_optimal(path, *bounds)
    assert found.grid.size > 120
    assert steps(found.trajectory) <= 40
    quintic = PiecewisePolynomial([0.0, 1.0], np.array([0.1, 0, 0, 0.2, 1, 0])[:, None, None])
    assert steps(time_optimal(quintic, symmetric(9.0), symmetric(2.0)).trajectory) <= 2
