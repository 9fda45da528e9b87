"""Convex programs of a chain of intervals, against a solver of scipy for problems of any shape."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import minimize
from tiers import few

from trajcli.curves.third_order.interior_point import ChainProgram

Values = NDArray[np.float64]
COUNT = 3  # intervals


def drawn(seed: int, penalty: float = np.inf) -> ChainProgram:
    """Return a program whose unknowns are bounded by rows on either side."""
    rng = np.random.default_rng(seed)
    box = np.concatenate([np.eye(4), -np.eye(4)])[:, :, None].repeat(COUNT, axis=2)
    rows = np.concatenate([box, rng.uniform(-2.0, 2.0, (6, 4, COUNT))]).transpose(1, 0, 2)
    limits = np.concatenate([np.full((8, COUNT), 1.5), rng.uniform(0.1, 0.6, (6, COUNT))])
    samples = rng.uniform(0.0, 0.15, (4, 3, COUNT)) * [[[1.0]], [[0.5]], [[1.0]], [[-0.5]]]
    return ChainProgram(samples, rng.uniform(0.05, 0.15, (3, COUNT)), rows, limits, penalty)


def products(rows: Values, x: Values) -> Values:
    return np.asarray(np.einsum("imn,ni->mn", rows, np.hstack([x[:-1], x[1:]])))


def cost(program: ChainProgram, x: Values) -> float:
    passed = np.maximum(products(program.rows, x) - program.limits, 0.0).sum()
    penalty = program.penalty * passed if np.isfinite(program.penalty) else 0.0
    return float((program.weights / np.sqrt(1.0 + products(program.samples, x))).sum() + penalty)


def least(program: ChainProgram) -> float:
    """Return the least cost that scipy finds, with how far each row is passed as a further unknown."""
    size, count = 2 * (COUNT + 1), program.limits.size
    price = program.penalty if np.isfinite(program.penalty) else 0.0
    passed = count if price else 0

    def whole(z: Values) -> float:
        x = z[:size].reshape(-1, 2)
        return float(
            (program.weights / np.sqrt(1.0 + products(program.samples, x))).sum() + price * z[size:].sum()
        )

    def left(z: Values) -> Values:
        slack = (program.limits - products(program.rows, z[:size].reshape(-1, 2))).ravel()
        return slack + z[size:] if passed else slack

    bounds = [(None, None)] * size + [(0.0, None)] * passed
    start = np.zeros(size + passed)
    found = minimize(
        whole,
        start,
        method="SLSQP",
        bounds=bounds,
        constraints={"type": "ineq", "fun": left},
        options={"ftol": 1e-10, "maxiter": 300},
    )
    assert found.success
    return float(found.fun)


@pytest.mark.parametrize("seed", few(range(12), 4))
def test_it_is_as_good_as_a_general_solver_and_keeps_its_rows(seed: int) -> None:
    program = drawn(seed)
    x = program.minimum(1e-7)
    assert (products(program.rows, x) <= program.limits + 1e-6).all()
    assert cost(program, x) == pytest.approx(least(program), abs=1e-6)


@pytest.mark.parametrize("seed", few(range(12), 2))
def test_rows_are_passed_where_that_costs_less(seed: int) -> None:
    program = drawn(seed, 0.003)
    x = program.minimum(1e-7)
    assert (products(program.rows, x) > program.limits + 1e-3).any()
    assert cost(program, x) == pytest.approx(least(program), abs=1e-5)
