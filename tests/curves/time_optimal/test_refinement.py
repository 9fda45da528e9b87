"""Laws whose acceleration changes within an interval: what they promise and gain; where a grid loses time, by hand."""

from __future__ import annotations

from itertools import pairwise
from math import sqrt

import numpy as np
import pytest
from topp_paths import assert_motion, random_bounds, spline, symmetric

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.curves.time_optimal.collocation import IntervalRows
from trajcli.curves.time_optimal.parameterization import time_optimal
from trajcli.curves.time_optimal.refinement import (
    first_grid,
    halved,
    parts_for,
    refined,
    shortest_intervals,
    time_lost,
)
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


def rows_over(grid, *rows):
    """Return intervals with rows P x + R y <= C, each of three numbers or of shapes (N,)."""
    count = grid.size - 1
    P, R, C = (np.stack([np.broadcast_to(row[k], count) for row in rows]) for k in range(3))
    none, nothing = np.zeros(len(rows), dtype=np.intp), (np.empty((0, count)),) * 3
    eased, turning = np.ones((1, count + 1)), np.zeros(count + 1, dtype=bool)
    cap = np.full(count + 1, np.inf)
    return IntervalRows(grid, P, R, C, C, eased, cap, turning, none, none, nothing, nothing)


FREE = (1.0, 0.0, 1e6)
"""A row without a say in y."""


@pytest.mark.parametrize("bend", [0.02, 0.1])
@pytest.mark.parametrize("at", [0.1, 0.5, 0.9])
def test_what_a_chord_loses_below_a_smooth_curve_is_known_within_a_factor_of_three(bend, at):
    """Of sd^2 = 1 - b (s - at)^2 the exact time, and that of straight lines of sd^2 between ten points."""
    from scipy.integrate import quad

    grid = np.linspace(0.0, 1.0, 11)
    x = 1.0 - bend * (grid - at) ** 2
    durations = 2.0 * np.diff(grid) / (np.sqrt(x[1:]) + np.sqrt(x[:-1]))
    exact = [quad(lambda s: (1.0 - bend * (s - at) ** 2) ** -0.5, *ends)[0] for ends in pairwise(grid)]
    lost = time_lost(rows_over(grid, FREE), x, x, durations)[1:-1]
    share = lost / (durations - exact)[1:-1]
    assert share.min() >= 1.0
    assert share.max() <= 3.0


@pytest.mark.parametrize("count", [3, 2500])
@pytest.mark.parametrize(
    ("up", "down", "below", "unused"),
    [
        (0.1, 0.3, 0.6, 0.25),  # of 0.4 between them a quarter is left above
        (0.3, 0.1, 0.6, 0.25),  # and below: it could brake harder
        (0.0, 0.4, 0.6, 0.0),  # as fast as it may speed up
        (0.4, 0.0, 0.6, 0.0),  # or brake
        (0.2, 0.2, 0.3, 0.3),  # nearer to the curve than to both
        (0.2, None, 0.6, 0.6),  # nothing bounds how it brakes: there is no range
        (None, 0.2, 0.6, 0.6),
    ],
)
def test_acceleration_that_is_not_used_costs_half_its_share_of_the_time(count, up, down, below, unused):
    """sd^2 is even, the curve of the largest one above it; in the last interval as in the first."""
    grid, x = np.linspace(0.0, 1.0, count + 1), np.full(count + 1, 2.0)
    rows = [FREE] + ([(-1.0, 1.0, up)] if up is not None else [])
    rows += [(1.0, -1.0, down)] if down is not None else []
    durations = np.linspace(1.0, 2.0, count)
    found = time_lost(rows_over(grid, *rows), x, x / (1.0 - below), durations)
    np.testing.assert_allclose(found, 0.5 * unused * durations, rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize("back", [False, True])
def test_the_way_to_the_curve_at_the_limit_of_acceleration_loses_nothing(back):
    """One end is on the curve, the other is not, and its neighbours' lines meet above it."""
    grid, x = np.arange(4.0), np.array([1.0, 2.0, 2.5, 2.6])
    mvc = np.array([9.0, 9.0, 2.5, 2.6])
    rows = (-1.0, 1.0, np.diff(x)), (1.0, -1.0, np.full(3, 5.0))
    if back:
        x, mvc = x[::-1], mvc[::-1]
        rows = (-1.0, 1.0, np.full(3, 5.0)), (1.0, -1.0, -np.diff(x))
    found = time_lost(rows_over(grid, *rows), x, mvc, np.ones(3))
    assert found[1] == pytest.approx(0.0, abs=1e-7)


def test_no_more_points_are_added_than_there_is_room_for():
    rng = np.random.default_rng(2)
    lost = rng.uniform(0, 1, 200) ** 6
    for room in (0, 7, 100, 300, 600):
        parts = parts_for(lost, 1e-9, room)
        assert (parts - 1).sum() <= room
        assert (np.diff(parts[np.argsort(lost)]) >= 0).all()  # what loses more is cut finer
    assert (parts_for(lost, 1e9, 600) == 1).all()
    assert (parts_for(np.zeros(5), 1e-9, 600) == 1).all()


def test_intervals_are_cut_so_that_together_they_lose_what_they_may():
    """By the rule that k parts lose 1 / k^2 of one: rounding of k costs a little."""
    lost = np.random.default_rng(4).uniform(0.5, 8.0, 400)
    for target in (0.2, 0.4):
        parts = parts_for(lost, target * lost.sum(), 10**6)
        assert (lost / parts**2).sum() == pytest.approx(target * lost.sum(), rel=0.15)


def test_every_interval_is_halved():
    np.testing.assert_allclose(
        halved(np.array([0.0, 1.0, 4.0, 5.0])), [0, 0.5, 1, 2.5, 4, 4.5, 5], atol=1e-15
    )


@pytest.mark.parametrize("x", [[0.0, 0.1, 1.1, 1.6], [1.6, 1.1, 0.1, 0.0]])
def test_at_the_ends_no_lines_meet(x):
    """Beyond the first and the last interval there is none: they are cut in the middle."""
    found = refined(np.arange(4.0), np.array(x), np.full(3, 2))
    np.testing.assert_allclose(found[[1, -2]], [0.5, 2.5], atol=1e-15)


@pytest.mark.parametrize("share", [0.3, 0.05, 0.81])
@pytest.mark.parametrize("jump", [3.0, 0.06])
@pytest.mark.parametrize("parts", [2, 4])
def test_an_interval_is_cut_where_the_lines_of_its_neighbours_meet(share, jump, parts):
    """However little sd^2 bends there: that point takes the place of the nearest one."""
    grid = np.array([0.0, 2.0, 5.0, 6.0])
    rise, fall = 1.0, 1.0 - jump
    x = 9.0 + np.cumsum([0.0, 2.0 * rise, 3.0 * (share * rise + (1.0 - share) * fall), fall])
    found = refined(grid, x, np.array([1, parts, 1]))
    inner = np.arange(1.0, parts)
    inner[np.abs(inner / parts - share).argmin()] = share * parts
    np.testing.assert_allclose(found, [0.0, 2.0, *(2.0 + 3.0 * inner / parts), 5.0, 6.0], rtol=1e-12)


def turning(at: float, length: float, height: float = 1.0) -> PiecewisePolynomial:
    """Return a path of one joint that goes on evenly, and one whose slope at the ends is some heights of that."""
    slopes = np.array([[0.0, 1.0, 0.0], [height / length, -2.0 * height / length * at, 0.0]])
    return PiecewisePolynomial(np.array([0.0, length]), slopes.T[:, None, :])


@pytest.mark.parametrize(
    "path",
    [
        turning(51 / 96, 2.0),  # of 96 parts of a path of length 1 it would be the end of one
        turning(3.7e6, 1e7),
        turning(0.3701, 1.0, 1e-3),  # its slope is a thousandth of that of the other joint
        turning((20 + 0.05) / 96, 1.0),  # near to a grid point
    ],
)
def test_a_place_where_a_joint_turns_is_a_grid_point(path):
    second, first, _ = path.coefficients[:, 0, 1]
    assert np.abs(first_grid(path) + 0.5 * first / second).min() <= 1e-9 * path.end


def test_a_joint_whose_slope_changes_by_a_millionth_in_a_short_piece_stands_still():
    """Of rounding in q nobody can tell where it turns."""
    coefficients = np.zeros((3, 2, 2))
    coefficients[1, :, 0] = 1.0
    coefficients[0, 0, 1], coefficients[1, 0, 1] = 1.0, -0.74e-7
    assert np.abs(first_grid(PiecewisePolynomial([0.0, 1e-7, 1.0], coefficients)) - 0.37e-7).min() > 1e-11


def test_breaks_of_a_path_are_grid_points_and_each_piece_has_four_intervals():
    """However short a piece is beside others, and however many there are."""
    for breaks in (np.array([0.0, 1.0, 1.0 + 1e-5, 3.0]), np.linspace(0.0, 1.0, 201)):
        path = PiecewisePolynomial(breaks, np.stack([np.ones((breaks.size - 1, 1)), breaks[:-1, None]]))
        grid = first_grid(path)
        assert np.isin(breaks, grid).all()
        inside = np.histogram(grid, breaks)[0]
        assert inside.min() >= 4
        piece = np.searchsorted(breaks, grid[:-1], "right") - 1
        share = shortest_intervals(path, grid) / np.diff(breaks)[piece]  # of their piece
        np.testing.assert_allclose(share, share[0], rtol=1e-12)
        assert 0.0 < share[0] < 1.0 / inside.max()


def test_no_interval_loses_less_than_nothing():
    """Where sd^2 is on its curve and at a limit but for rounding; at a curve of zero nothing is below it."""
    grid, x = np.arange(4.0), np.array([0.0, 2.0, 2.0, 0.0])
    rows = (FREE, (-1.0, 1.0, np.diff(x) * (1 - 1e-7)), (1.0, -1.0, 5.0))
    assert (time_lost(rows_over(grid, *rows), x, x * (1 - 1e-7), np.ones(3)) >= 0.0).all()
    nothing = time_lost(rows_over(grid, FREE), np.zeros(4), np.zeros(4), np.ones(3))
    np.testing.assert_array_equal(nothing, np.zeros(3))


@pytest.mark.parametrize("apart", [1e-12, 1e-9, 1e-7])
def test_joints_that_turn_at_all_but_the_same_place_make_no_tiny_interval(apart):
    """Three parabolas turn within so little; there is one grid point for all of them, and one for a fourth."""
    turns = np.array([0.3, 0.3 + apart, 0.3 + 2 * apart, 0.7])
    path = PiecewisePolynomial([0.0, 1.0], np.stack([np.ones(4), -2 * turns, turns**2])[:, None, :])
    grid = first_grid(path)
    assert np.diff(grid).min() >= 1e-4 / 96
    for turn in (0.3, 0.7):
        assert np.abs(grid - turn).min() <= 2 * apart


@pytest.mark.parametrize("back", [False, True])
def test_where_a_joint_turns_by_rounding_alone_there_is_no_grid_point(back):
    """Of one that stands still beside another, which starts, or ends, without a derivative."""
    whole = [[1.0, -2.0, 1.0], [1e-17, -7.4e-18, 0.2]] if back else [[1.0, 0.0, 0.0], [1e-17, -7.4e-18, 0.2]]
    grid = first_grid(PiecewisePolynomial([0.0, 1.0], np.array(whole).T[:, None, :]))
    assert np.abs(grid - 0.37).min() > 1e-3
