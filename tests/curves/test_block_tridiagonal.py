"""Block tridiagonal systems against numpy's dense solution."""

from __future__ import annotations

import numpy as np
import pytest
from counted_calls import calls_of

from trajcli.curves.linear_systems import block_factors, cyclic_factors, solve_block_tridiagonal


def system(seed, blocks, size):
    """Return blocks of a positive definite matrix, and the matrix."""
    rng = np.random.default_rng(seed)
    wide = np.zeros((blocks * size, (blocks + 1) * size))
    for b in range(blocks):  # rows that reach into the next block: their product is block tridiagonal
        wide[b * size : (b + 1) * size, b * size : (b + 2) * size] = rng.normal(size=(size, 2 * size))
    dense = wide @ wide.T + 0.1 * np.eye(blocks * size)
    cut = dense.reshape(blocks, size, blocks, size).swapaxes(1, 2)
    at = np.arange(blocks)
    return cut[at, at], cut[at[:-1], at[1:]], dense


@pytest.mark.parametrize("blocks", [1, 2, 3, 4, 5, 7, 8, 9, 16, 33, 70])
@pytest.mark.parametrize("size", [1, 3, 8])
def test_as_dense(blocks, size):
    diagonal, right, dense = system(blocks, blocks, size)
    values = np.random.default_rng(size).normal(size=blocks * size)
    before = diagonal.copy(), right.copy()
    found = solve_block_tridiagonal(diagonal, right, values)
    np.testing.assert_allclose(found, np.linalg.solve(dense, values), rtol=1e-9, atol=1e-9)
    factors = cyclic_factors(diagonal, right)
    for again in (values, -2.0 * values):
        found = factors.solve(again.reshape(blocks, size)).reshape(-1)
        np.testing.assert_allclose(found, np.linalg.solve(dense, again), rtol=1e-9, atol=1e-9)
    for kept, given in zip(before, (diagonal, right), strict=True):
        np.testing.assert_array_equal(kept, given)


@pytest.mark.parametrize("blocks", [1, 2, 3, 4, 5, 8, 21])
def test_pairs_of_unknowns_in_sizes_that_differ_much_are_solved_to_rounding(blocks):
    """Rows and columns are scaled by up to 1e8: what elimination loses there comes back from the residual."""
    diagonal, right, dense = system(blocks, blocks, 2)
    scales = 10.0 ** np.random.default_rng(blocks).uniform(-4, 4, (blocks, 2))
    diagonal = diagonal * scales[:, :, None] * scales[:, None]
    right = right * scales[:-1, :, None] * scales[1:, None]
    dense = dense * scales.reshape(-1, 1) * scales.reshape(-1)
    factors, values = block_factors(diagonal, right), np.random.default_rng(2).normal(size=(2, blocks, 2))
    for each in values * scales:
        x = factors.solve(each).reshape(-1)
        size = np.abs(dense) @ np.abs(x) + np.abs(each.reshape(-1))
        assert (np.abs(dense @ x - each.reshape(-1)) <= 4e-14 * size).all()


def test_missing_values_are_zero():
    diagonal, right, dense = system(3, 4, 3)
    values = np.arange(1.0, 11)
    full = np.append(values, [0.0, 0.0])
    found = solve_block_tridiagonal(diagonal, right, values)
    assert found.shape == (10,)
    np.testing.assert_allclose(found, np.linalg.solve(dense, full)[:10], rtol=1e-9)


def test_the_work_is_linear():
    def calls(blocks):
        diagonal, right, _ = (np.tile(part[1:2], (blocks, 1, 1)) for part in system(1, 3, 8))
        diagonal += 20 * np.eye(8)
        return calls_of(lambda: solve_block_tridiagonal(diagonal, right[:-1], np.ones(blocks * 8)))

    assert calls(1000) < 1.1 * 10 * calls(100)
