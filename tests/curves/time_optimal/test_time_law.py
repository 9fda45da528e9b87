"""Pieces of a time law, each by itself: against polynomials of numpy, by what they must begin and end with."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from topp_paths import spline

from trajcli.curves.time_optimal.time_law import LawPieces, blocks, law_and_trajectory, law_pieces

GRID, SQUARES = np.array([0.0, 0.3, 1.0, 1.4, 2.0]), np.array([1.0, 2.0, 1.5, 0.5, 0.0])
MEAN = np.diff(SQUARES) / (2.0 * np.diff(GRID))


def ends_of(pieces: LawPieces) -> np.ndarray:
    """Return s, sd and sdd at both ends of the pieces, shape (2, 3, N), from numpy's own polynomials."""
    columns = list(zip(pieces.coefficients.T, pieces.durations, strict=True))
    states = [[[np.polyval(np.polyder(c, k), t) for k in range(3)] for t in (0.0, h)] for c, h in columns]
    return np.array(states).transpose(1, 2, 0)


def assert_passes(pieces: LawPieces, grid, squares) -> np.ndarray:
    """Assert that pieces pass the grid at its speeds; return sdd at both ends, shape (2, N)."""
    states = ends_of(pieces)
    for side, part in enumerate((slice(None, -1), slice(1, None))):
        np.testing.assert_allclose(states[side, 0], grid[part], rtol=1e-12)
        np.testing.assert_allclose(states[side, 1], np.sqrt(squares[part]), rtol=1e-12, atol=1e-7)
    return states[:, 2]


def test_without_accelerations_each_is_constant():
    pieces = law_pieces(GRID, SQUARES)
    np.testing.assert_allclose(assert_passes(pieces, GRID, SQUARES), [MEAN, MEAN], rtol=1e-12)


@pytest.mark.parametrize("changed", [(0.1, 0.0), (0.0, 0.1), (-0.1, 0.2)])
def test_an_acceleration_at_either_end_alone_counts_beside_constant_ones(changed):
    near, far = MEAN.copy(), MEAN.copy()
    near[1] += changed[0]
    far[1] += changed[1]
    pieces = law_pieces(GRID, SQUARES, near, far)
    np.testing.assert_allclose(assert_passes(pieces, GRID, SQUARES), [near, far], rtol=1e-9)
    assert (pieces.coefficients[:2, [0, 2, 3]] == 0.0).all()
    assert pieces.coefficients[1, 1] != 0.0


@pytest.mark.parametrize(
    ("x", "near", "far"),
    [
        ((0.01, 1.0), -3.0, -2.5),  # first it would go back
        ((1.0, 0.01), 2.5, 3.0),  # or at last
        ((1.0, 1.0), -4.0, 4.0),  # no quartic at all
    ],
)
def test_where_a_change_would_lead_back_the_acceleration_is_constant(x, near, far):
    grid = np.array([0.0, 1.0])
    pieces = law_pieces(grid, np.array(x), np.array([near]), np.array([far]))
    mean = 0.5 * (x[1] - x[0])
    np.testing.assert_allclose(assert_passes(pieces, grid, np.array(x)), [[mean], [mean]], atol=1e-12)


@pytest.mark.parametrize("sign", [1, -1])
def test_a_piece_that_slows_down_by_more_than_half_leads_on(sign):
    """From speed 1 to 0.3 with a steady change of sdd, or back: it never stands, so that nothing is made constant."""
    grid, x = np.array([0.0, 1.0]), np.array([1.0, 0.09])[::sign]
    near, far = np.array([-0.8, -0.1])[::sign] * sign
    pieces = law_pieces(grid, x, np.array([near]), np.array([far]))
    np.testing.assert_allclose(assert_passes(pieces, grid, x), [[near], [far]], rtol=1e-9)


def test_a_piece_is_another_one_where_all_that_describes_it_is_the_same():
    near, far = MEAN + 0.1, MEAN - 0.1
    pieces = law_pieces(GRID, SQUARES, near, far)
    index, same = pieces.among(pieces)
    assert index.tolist() == [0, 1, 2, 3]
    assert same.all()
    some = pieces.chosen(np.array([1, 3]))
    index, same = some.among(pieces)
    assert index[same].tolist() == [1, 3]
    for row in range(5):
        other = pieces.coefficients.copy()
        other[row, 2] += 1e-3
        _, same = replace(pieces, coefficients=other).among(pieces)
        assert same.tolist() == [True, True, False, True]
    longer = replace(pieces, durations=pieces.durations * [1.0, 1.0, 1.0, 1.001])
    assert longer.among(pieces)[1].tolist() == [True, True, True, False]
    assert not law_pieces(GRID, SQUARES).among(pieces)[1].any()


@pytest.mark.parametrize("count", [1, 2, 1023, 1024, 1025, 2049])
def test_blocks_cover_each_interval_once(count):
    assert np.concatenate([np.arange(count)[block] for block in blocks(count)]).tolist() == list(range(count))


def test_a_trajectory_is_the_path_of_the_law_from_any_start_of_the_path():
    rng = np.random.default_rng(0)
    path = spline(rng.uniform(-1, 1, (6, 2)), np.array([2.0, 2.5, 3.0, 4.0, 4.5, 5.0]))
    grid = np.sort(np.append(path.breaks, [2.2, 3.7]))
    law, trajectory = law_and_trajectory(path, law_pieces(grid, rng.uniform(0.5, 2.0, grid.size)))
    t = np.linspace(0.0, law.end, 101)
    s = np.clip(law.evaluate(t)[:, 0], 2.0, 5.0)
    np.testing.assert_allclose(trajectory.evaluate(t), path.evaluate(s), atol=1e-12)


def test_times_increase_where_pieces_are_shorter_than_rounding():
    """After half a second pieces that last 1e-19 s: none may begin when the one before does."""
    grid = np.concatenate([[0.0, 0.5], 1.0 + 1e-15 * np.arange(11)])
    squares = np.append([1.0, 1.0], np.full(11, 1e8))
    law, _ = law_and_trajectory(spline([[0.0], [2.0]], [0.0, 2.0]), law_pieces(grid, squares))
    assert (np.diff(law.breaks) > 0).all()
