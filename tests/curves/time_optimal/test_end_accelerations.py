"""Accelerations at the ends of intervals, where the motion is known in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.curves.time_optimal.accelerations import binding_rows, end_accelerations
from trajcli.curves.time_optimal.collocation import interval_rows
from trajcli.curves.time_optimal.constraints import JointConstraint

UP, DOWN = 2.0, 3.0
GRID = np.array([0.0, 0.1, 0.25, 0.3, 0.5, 0.62, 0.7, 0.85, 1.0])
NONE = np.zeros(8, dtype=bool)


def rows_of(*coefficients, grid=GRID, velocity=100.0):
    """Return the rows of one joint q(s), highest power first, that may speed up by 2 and slow down by 3."""
    path = PiecewisePolynomial(np.array([0.0, 1.0]), np.array(coefficients, float)[:, None, None])
    joints = JointConstraint(path, np.array([[-velocity, velocity]]), np.array([[-DOWN, UP]]))
    return interval_rows(grid, [joints], np.empty(0))


def ends(rows, x, mvc=None, even=NONE):
    mvc = np.full(x.size, 1e4) if mvc is None else mvc
    return end_accelerations(rows, x, mvc, binding_rows(rows, x), even)


CURVED = (0.5, 1.0, 0.0)  # q' = 1 + s, q'' = 1
WAY = 0.5 * GRID**2 + GRID


@pytest.mark.parametrize("eased", [1.0, 2.5])
@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_a_limit_that_binds_says_how_the_path_is_accelerated(direction, eased):
    """q' sdd + q'' sd^2 is the limit; the square of q' sd grows by twice the way times it."""
    rows = rows_of(*(direction * np.array(CURVED)))
    rows = rows.tightened(np.ones(8), np.full((1, 8), eased))
    up, down = ((UP, DOWN) if direction > 0 else (DOWN, UP)) / np.array(eased)
    for x, limit, kind in (
        (2 * up * WAY / (1 + GRID) ** 2, up, 1),
        (2 * down * (WAY[-1] - WAY) / (1 + GRID) ** 2, -down, -1),
    ):
        bound = binding_rows(rows, x)
        expected = (limit - x) / (1 + GRID)
        assert bound.near == pytest.approx(expected[:-1])
        assert bound.far == pytest.approx(expected[1:])
        assert (bound.kind == kind).all()
        near, far = ends(rows, x)
        assert near == pytest.approx(expected[:-1])
        assert far == pytest.approx(expected[1:])


def test_what_no_row_says_is_known_from_the_means_around():
    """On a curve of largest speeds (1 + s)^2 sdd is 1 + s: linear between the middles of the intervals."""
    rows = rows_of(1.0, 0.0)
    x = (1 + GRID) ** 2 / 4
    assert (binding_rows(rows, x).kind == 0).all()
    near, far = ends(rows, x, mvc=x)
    assert near == pytest.approx((1 + GRID[:-1]) / 4)
    assert far == pytest.approx((1 + GRID[1:]) / 4)


def test_below_all_limits_and_where_it_shall_be_sdd_is_constant():
    rows = rows_of(*CURVED)
    slow = 0.1 * (1 + GRID) ** 2
    means = np.diff(slow) / (2 * np.diff(GRID))
    for near, far in (ends(rows, slow), ends(rows, slow, mvc=slow, even=~NONE)):
        assert near == pytest.approx(means)
        assert far == pytest.approx(means)
    x = 2 * UP * WAY / (1 + GRID) ** 2
    for near, far in (ends(rows, x, even=~NONE),):
        assert near == pytest.approx(np.diff(x) / (2 * np.diff(GRID)))
        assert far == pytest.approx(near)


@pytest.mark.parametrize(("switch", "first"), [(0.6, True), (0.58, True), (0.55, False), (0.515, False)])
def test_an_interval_with_a_switching_point_goes_on_as_the_nearer_neighbour(switch, first):
    """Up to it sdd is 2, from it on -3; the mean of the interval is nearer to one of them."""
    rows = rows_of(1.0, 0.0)
    top = 2 * UP * switch
    x = np.where(switch >= GRID, 2 * UP * GRID, top - 2 * DOWN * (GRID - switch))
    x = x - min(x.min(), 0.0)
    near, far = ends(rows, x)
    at = int(np.searchsorted(GRID, switch)) - 1
    mean = np.diff(x)[at] / (2 * np.diff(GRID)[at])
    assert near[:at] == pytest.approx(np.full(at, UP))
    assert far[at + 1 :] == pytest.approx(np.full(7 - at, -DOWN))
    wanted = (UP, 2 * mean - UP) if first else (2 * mean + DOWN, -DOWN)
    assert bool(abs(mean - UP) < abs(mean + DOWN)) is first
    assert (near[at], far[at]) == pytest.approx(wanted)


def test_from_a_ramp_to_the_largest_speed_sdd_steps():
    """Speeding up by 2 to the speed 1 at s = 0.25, then none; braking by 3 from s = 5 / 6 on."""
    grid = np.array([0.0, 0.1, 0.25, 0.3, 0.5, 0.62, 0.7, 5 / 6, 0.9, 1.0])
    x = np.minimum(np.minimum(2 * UP * grid, 1.0), 2 * DOWN * (1 - grid))
    rows = rows_of(1.0, 0.0, grid=grid, velocity=1.0)
    near, far = end_accelerations(rows, x, np.ones(10), binding_rows(rows, x), np.zeros(9, dtype=bool))
    steps = np.array([UP] * 2 + [0.0] * 5 + [-DOWN] * 2)
    assert near == pytest.approx(steps, abs=1e-9)
    assert far == pytest.approx(steps, abs=1e-9)


def test_of_two_joints_the_row_that_binds_counts():
    """The second joint goes twice as far with the same limits, so that it binds alone."""
    path = PiecewisePolynomial(np.array([0.0, 1.0]), np.array([[[1.0, 2.0]], [[0.0, 0.0]]]))
    bounds = np.array([[-DOWN, UP], [-DOWN, UP]])
    rows = interval_rows(GRID, [JointConstraint(path, np.full((2, 2), 100.0) * [-1, 1], bounds)], np.empty(0))
    bound = binding_rows(rows, UP * GRID)
    assert bound.near == pytest.approx(np.full(8, UP / 2))
    assert (bound.kind == 1).all()
    less = binding_rows(rows, 0.9 * UP * GRID)
    assert (less.kind == 0).all()
    assert np.isnan(less.near).all()
    assert np.isnan(less.far).all()
