"""Tridiagonal systems, against exact rational solutions and numpy's dense solver."""

from __future__ import annotations

import sys
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from spline_laws import SEEDS, _solved

from trajcli.curves import linear_systems as banded
from trajcli.curves.linear_systems import solve_tridiagonal


def dominant_system(rng, m, n=3, spread=1e4):
    lower, upper = rng.normal(size=(2, m)) * spread ** rng.uniform(0, 1, (2, m))
    beside = np.abs(np.where(np.arange(m) > 0, lower, 0)) + np.abs(np.where(np.arange(m) < m - 1, upper, 0))
    return lower, beside * rng.uniform(1, 2, m) + 1e-3, upper, rng.normal(size=(m, n))


def dense(lower, diagonal, upper):
    return np.diag(diagonal) + np.diag(upper[:-1], 1) + np.diag(lower[1:], -1)


@settings(max_examples=60, deadline=None)
@given(SEEDS, st.integers(1, 160))
def test_rows_hold_to_rounding(seed, m):
    lower, diagonal, upper, right = dominant_system(np.random.default_rng(seed), m)
    kept = [values.copy() for values in (lower, diagonal, upper, right)]
    x = solve_tridiagonal(lower, diagonal, upper, right)
    matrix = dense(lower, diagonal, upper)
    scale = np.abs(matrix) @ np.abs(x) + np.abs(right)
    assert (np.abs(matrix @ x - right) <= 1e-14 * scale).all()
    np.testing.assert_allclose(x, np.linalg.solve(matrix, right), rtol=1e-8, atol=1e-10 * np.abs(x).max())
    for values, before in zip((lower, diagonal, upper, right), kept, strict=True):
        np.testing.assert_array_equal(values, before)


@pytest.mark.parametrize(("seed", "m", "spread"), [(3, 400, 1e8), (7, 400, 1e12)])
def test_rows_of_mixed_sizes_lose_no_digit_by_halving(seed, m, spread):
    lower, diagonal, upper, right = dominant_system(np.random.default_rng(seed), m, spread=spread)
    x, matrix = solve_tridiagonal(lower, diagonal, upper, right), dense(lower, diagonal, upper)
    assert (np.abs(matrix @ x - right) <= 1e-15 * (np.abs(matrix) @ np.abs(x) + np.abs(right))).all()


def test_exact_in_rational_numbers():
    rng = np.random.default_rng(5)
    lower, diagonal, upper, right = dominant_system(rng, 8, 1)
    rows = [[Fraction(x) for x in row] for row in dense(lower, diagonal, upper).tolist()]
    exact = [float(x) for x in _solved(rows, [Fraction(x) for x in right[:, 0].tolist()])]
    got = solve_tridiagonal(lower, diagonal, upper, right)[:, 0]
    np.testing.assert_allclose(got, exact, rtol=0, atol=1e-14 * np.abs(exact).max())


def test_the_outer_corners_are_not_used():
    lower, diagonal, upper, right = dominant_system(np.random.default_rng(1), 6)
    x = solve_tridiagonal(lower, diagonal, upper, right)
    lower[0] = upper[-1] = 1e300
    np.testing.assert_array_equal(solve_tridiagonal(lower, diagonal, upper, right), x)


def test_columns_do_not_touch_each_other():
    lower, diagonal, upper, right = dominant_system(np.random.default_rng(2), 30, 7)
    x = solve_tridiagonal(lower, diagonal, upper, right)
    for k in range(7):
        np.testing.assert_array_equal(solve_tridiagonal(lower, diagonal, upper, right[:, [k]])[:, 0], x[:, k])


@pytest.mark.parametrize("bad", [2.0 * (1 - 1e-12), 1.0, 0.0, -9.0])
@pytest.mark.parametrize("signs", [(1, 1), (-1, 1), (1, -1), (-1, -1)])
def test_a_row_that_is_not_dominated_is_refused(bad, signs):
    lower, upper = np.outer(signs, np.ones(4))
    with pytest.raises(ValueError, match="row 2 of the system has diagonal"):
        solve_tridiagonal(lower, np.array([3.0, 3.0, bad, 3.0]), upper, np.ones((4, 1)))


def test_a_row_of_zeros_is_refused():
    ones, none = np.ones(3), np.array([1.0, 0.0, 1.0])
    with pytest.raises(ValueError, match=r"row 1 .* or not positive"):
        solve_tridiagonal(0 * ones, none, 0 * ones, np.ones((3, 1)))


def test_neighbours_that_add_up_to_the_diagonal_are_allowed():
    lower, diagonal, upper = np.full(4, -0.1), np.array([0.2, 0.3, 0.3, 0.3]), np.full(4, -0.2)
    assert 0.1 + 0.2 > 0.3  # by rounding
    x = solve_tridiagonal(lower, diagonal, upper, np.ones((4, 1)))
    np.testing.assert_allclose(dense(lower, diagonal, upper) @ x, np.ones((4, 1)), rtol=1e-13)


def operations(m):
    """Return how many bytecodes of the solver run for m rows."""
    lower, diagonal, upper, right = dominant_system(np.random.default_rng(0), m)
    count = 0

    def trace(frame, event, _argument):
        nonlocal count
        if frame.f_code.co_filename != banded.__file__:
            return None
        frame.f_trace_opcodes = True
        count += event == "opcode"
        return trace

    before = sys.gettrace()
    sys.settrace(trace)
    try:
        solve_tridiagonal(lower, diagonal, upper, right)
    finally:
        sys.settrace(before)
    return count


def test_the_cost_is_linear():
    """A short system costs the same for each row, a long one the same array operations for each halving."""
    operations(6)  # Python 3.12 counts the bytecodes of a function from its second traced call on
    counts = [operations(m) for m in (6, 12, 24, 48)]
    by_row = np.diff(counts) / [6, 12, 24]
    assert by_row[0] > 0
    np.testing.assert_array_equal(by_row, by_row[0])
    counts = [operations(m) for m in (96, 192, 384, 768)]
    assert 0 < counts[1] - counts[0] < counts[0]
    np.testing.assert_array_equal(np.diff(counts), counts[1] - counts[0])
