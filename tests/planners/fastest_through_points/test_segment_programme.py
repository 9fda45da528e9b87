"""Linear programmes over segments, against a general solver."""

from __future__ import annotations

import numpy as np
import pytest

from trajcli.planners.fastest_through_points.linear_programme import SegmentProgramme, solved


def random_programme(seed, segments, joints, rows, shared):
    """Return a programme whose optimum is bounded and for which y = 0 is strictly inside."""
    rng = np.random.default_rng(seed)
    matrix = rng.normal(size=(segments, joints, rows, 4 + shared))
    matrix[0, :, :, :2] = 0
    matrix[-1, :, :, 2:4] = 0
    low, high = (rng.uniform(0.1, 1, (segments, joints, rows)) for _ in range(2))
    cost = rng.uniform(0.5, 2, (segments, shared))
    ones = np.ones((segments, shared))
    return SegmentProgramme(matrix, -low, high, cost, -ones, ones, 1e-9)


@pytest.mark.parametrize(
    ("seed", "segments", "joints", "rows", "shared"),
    [(0, 2, 1, 8, 1), (1, 4, 3, 14, 3), (2, 5, 4, 12, 1), (3, 30, 3, 16, 2)],
)
def test_optimum_is_that_of_a_general_solver(seed, segments, joints, rows, shared):
    from scipy.optimize import linprog

    programme = random_programme(seed, segments, joints, rows, shared)
    y = solved(programme, 0.3)
    matrix = np.array([programme.apply(unit) for unit in np.eye(programme.size)]).T
    high = np.concatenate([programme.high.ravel(), programme.upper_bound.ravel()])
    low = np.concatenate([programme.low.ravel(), programme.least.ravel()])
    cost = np.zeros(programme.size)
    programme.split(cost)[1][:] = programme.cost
    known = linprog(cost, A_ub=np.vstack([matrix, -matrix]), b_ub=np.append(high, -low), bounds=(-50, 50))
    assert cost @ y == pytest.approx(known.fun, rel=1e-6, abs=1e-6)
    assert (matrix @ y <= high + 1e-8).all()
    assert (matrix @ y >= low - 1e-8).all()


def test_rows_and_their_transpose_belong_together():
    programme = random_programme(4, 5, 3, 7, 2)
    rng = np.random.default_rng(0)
    y, z = rng.normal(size=programme.size), rng.normal(size=programme.low.size + programme.least.size)
    assert z @ programme.apply(y) == pytest.approx(y @ programme.adjoint(z), rel=1e-12)
