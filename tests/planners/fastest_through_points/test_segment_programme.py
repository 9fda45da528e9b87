"""Linear programmes over segments, against a general solver."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from trajcli.planners.fastest_through_points import linear_programme
from trajcli.planners.fastest_through_points.linear_programme import SegmentProgramme, solved


def random_programme(seed, segments, joints, rows, shared, weight=1e-9, size=1.0):
    """Return a programme whose optimum is bounded and for which y = 0 is strictly inside; s is within a size."""
    rng = np.random.default_rng(seed)
    matrix = rng.normal(size=(segments, joints, rows, 4 + shared))
    matrix[0, :, :, :2] = 0
    matrix[-1, :, :, 2:4] = 0
    low, high = (rng.uniform(0.1, 1, (segments, joints, rows)) for _ in range(2))
    cost = rng.uniform(0.5, 2, (segments, shared))
    ones = np.ones((segments, shared))
    return SegmentProgramme(matrix, -low, high, cost, -size * ones, size * ones, weight)


def dense(programme):
    """Return the rows, then those of s, as one matrix for x at all points and s, entry by entry."""
    segments, joints, count, width = programme.rows.shape
    shared = width - 4
    at_s = (segments + 1) * joints * 2
    matrix = np.zeros((segments * joints * count + segments * shared, at_s + segments * shared))
    row = 0
    for k in range(segments):
        for j in range(joints):
            for r in range(count):
                values = programme.rows[k, j, r]
                for end in range(2):
                    x = ((k + end) * joints + j) * 2
                    matrix[row, x : x + 2] = values[2 * end : 2 * end + 2]
                matrix[row, at_s + k * shared : at_s + (k + 1) * shared] = values[4:]
                row += 1
    matrix[row:, at_s:] = np.eye(segments * shared)
    return matrix


@pytest.mark.parametrize(
    ("seed", "segments", "joints", "rows", "shared"),
    [(0, 2, 1, 8, 1), (1, 4, 3, 14, 3), (2, 5, 4, 12, 1), (3, 30, 3, 16, 2)],
)
def test_optimum_is_that_of_a_general_solver(seed, segments, joints, rows, shared):
    from scipy.optimize import linprog

    programme = random_programme(seed, segments, joints, rows, shared)
    y = solved(programme, 0.3)
    matrix = dense(programme)
    high = np.concatenate([programme.high.ravel(), programme.upper_bound.ravel()])
    low = np.concatenate([programme.low.ravel(), programme.least.ravel()])
    cost = np.zeros(programme.size)
    programme.split(cost)[1][:] = programme.cost
    known = linprog(cost, A_ub=np.vstack([matrix, -matrix]), b_ub=np.append(high, -low), bounds=(-50, 50))
    assert cost @ y == pytest.approx(known.fun, rel=1e-6, abs=1e-6)
    assert (matrix @ y <= high + 1e-8).all()
    assert (matrix @ y >= low - 1e-8).all()


@pytest.mark.parametrize("segments", [4, 30])
def test_what_is_mirrored_has_the_mirrored_optimum(segments):
    """With -y for y upper bounds of s bind that were lower ones."""
    programme = random_programme(5, segments, 2, 8, 2, weight=1e-6)
    programme = replace(programme, least=0.1 * programme.least)
    mirrored = SegmentProgramme(
        programme.rows,
        -programme.high,
        -programme.low,
        -programme.cost,
        -programme.upper_bound,
        -programme.least,
        programme.weight,
    )
    y = solved(programme, 0.3)
    np.testing.assert_allclose(solved(mirrored, 0.3), -y, rtol=1e-4, atol=1e-4)
    assert (np.abs(programme.split(y)[1] - programme.least) < 1e-4).any()


@pytest.mark.parametrize("segments", [4, 30])
@pytest.mark.parametrize("size", [1e-4, 1e-2, 100.0])
def test_small_programmes_are_solved_as_exactly_as_large_ones(segments, size):
    """Bounds of another size, and the square weighted by its inverse: the optimum is as much larger."""
    programme = random_programme(2, segments, 2, 8, 2, weight=1e-6)
    scaled = replace(
        programme,
        **{name: size * getattr(programme, name) for name in ("low", "high", "least", "upper_bound")},
        weight=1e-6 / size,
    )
    cost = programme.cost.ravel()
    wanted, found = (
        each[-cost.size :] @ cost for each in (solved(programme, 0.3), solved(scaled, 0.3 * size))
    )
    assert found / size == pytest.approx(wanted, rel=1e-6)


def test_what_was_reached_is_returned_where_no_further_step_can_be_computed(monkeypatch):
    programme = random_programme(0, 4, 3, 14, 3)
    steps = [solved(programme, 0.3, rounds=count) for count in (0, 2)]

    def failing(*given):
        calls.append(given)
        if len(calls) > 2:
            raise np.linalg.LinAlgError
        return newton(*given)

    calls, newton = [], linear_programme._newton
    monkeypatch.setattr(linear_programme, "_newton", failing)
    np.testing.assert_array_equal(solved(programme, 0.3), steps[1])
    np.testing.assert_array_equal(solved(programme, 0.3), steps[0])


@pytest.mark.parametrize("segments", [5, 30])
def test_rows_and_their_transpose_are_those_of_the_definition(segments):
    """Of a programme that is one matrix, and of one that is in blocks; x at both ends is none."""
    programme = random_programme(4, segments, 3, 7, 2)
    assert (programme.whole is None) is (segments == 30)
    rng, matrix = np.random.default_rng(0), dense(programme)
    y, z = rng.normal(size=programme.size), rng.normal(size=len(matrix))
    y[:6] = y[segments * 6 : segments * 6 + 6] = 0.0
    np.testing.assert_allclose(programme.apply(y), matrix @ y, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(programme.adjoint(z), z @ matrix, rtol=1e-12, atol=1e-12)
    x, shared = programme.split(y)
    assert (x.ravel().tolist(), shared.ravel().tolist()) == (y[: x.size].tolist(), y[x.size :].tolist())


@pytest.mark.parametrize("segments", [4, 30])
@pytest.mark.parametrize("weight", [0.5, 3.0])
def test_the_square_that_is_minimised_too_has_its_weight(segments, weight):
    """At the optimum cost + weight y is a sum of the rows that bind, each with its sign (Karush, Kuhn and Tucker)."""
    from scipy.optimize import nnls

    programme = random_programme(6, segments, 2, 9, 2, weight, 5.0)
    y, matrix = solved(programme, 0.3), dense(programme)
    high = np.concatenate([programme.high.ravel(), programme.upper_bound.ravel()])
    low = np.concatenate([programme.low.ravel(), programme.least.ravel()])
    value = matrix @ y
    assert (value <= high + 1e-8).all()
    assert (value >= low - 1e-8).all()
    slope = weight * y
    slope[-programme.cost.size :] += programme.cost.ravel()
    binding = np.concatenate([matrix[value < low + 1e-5], -matrix[value > high - 1e-5]])
    assert 2 < len(binding) < y.size
    _, left = nnls(binding.T, slope)
    assert left <= 1e-3 * np.linalg.norm(slope)
    assert np.linalg.norm(slope) > 0.1


def test_where_no_row_binds_the_optimum_is_that_of_the_square_alone():
    """s = -cost / weight, and x is none."""
    for segments in (3, 40):
        programme = random_programme(8, segments, 2, 6, 1, 20.0)
        programme = replace(programme, low=1e3 * programme.low, high=1e3 * programme.high)
        x, s = programme.split(solved(programme, 0.3, exactness=1e-11))
        np.testing.assert_allclose(s, -programme.cost / 20.0, rtol=1e-5)
        assert np.abs(x).max() < 1e-6


def test_rows_and_their_transpose_belong_together():
    programme = random_programme(4, 5, 3, 7, 2)
    rng = np.random.default_rng(0)
    y, z = rng.normal(size=programme.size), rng.normal(size=programme.low.size + programme.least.size)
    assert z @ programme.apply(y) == pytest.approx(y @ programme.adjoint(z), rel=1e-12)


@pytest.mark.parametrize("exactness", [1e9, 0.1, 1e-7])
@pytest.mark.parametrize("segments", [3, 30])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_rows_that_nothing_misses_are_kept_however_inexact_the_cost_may_be(segments, side, exactness):
    """A point far from y = 0 is inside of them."""
    programme = random_programme(9, segments, 2, 6, 1, size=5.0)
    rng = np.random.default_rng(1)
    inside = rng.normal(size=programme.size)
    inside[-segments:] = side * 4.0
    inside[:4] = inside[segments * 4 : segments * 4 + 4] = 0.0
    matrix = dense(programme)
    at = (matrix @ inside)[: programme.low.size].reshape(programme.low.shape)
    programme = replace(programme, low=at + 0.1 * programme.low, high=at + 0.1 * programme.high)
    value = matrix @ solved(programme, 0.01, rounds=60, exactness=exactness)
    assert (value <= np.append(programme.high, programme.upper_bound) + 1e-8).all()
    assert (value >= np.append(programme.low, programme.least) - 1e-8).all()
