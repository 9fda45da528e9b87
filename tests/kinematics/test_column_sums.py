"""Vectors of columns: sums are written over products, and never over what they are made of."""

from __future__ import annotations

from itertools import product as every

import numpy as np
import pytest

from trajcli.kinematics.columns import (
    ZERO,
    advance,
    combine,
    cross,
    difference,
    dot,
    minus,
    minus_product,
    plus,
    plus_product,
    product,
    scaled,
    total,
    uncombine,
)

NUMBERS = (0.0, 1.0, -1.0, 2.0, -2.5)
SHAPES = ((5,), (2, 5), (2, 1, 5), (2, 2, 5))  # poses alone, and behind axes of choices


def same(found, expected):
    """Return whether two are equal but for axes along which nothing changes."""
    return np.allclose(found, expected, rtol=0.0, atol=1e-14)


@pytest.mark.parametrize(("function", "sign"), [(plus_product, 1.0), (minus_product, -1.0)])
def test_a_product_is_added_and_nothing_is_written_over(function, sign):
    rng = np.random.default_rng(1)
    given = [*NUMBERS, *(rng.normal(size=shape) for shape in SHAPES)]
    before = [np.copy(entry) for entry in given]
    for p, a, b in every(given, repeat=3):
        assert same(function(p, a, b), p + sign * np.multiply(a, b))
    assert all(np.array_equal(entry, old) for entry, old in zip(given, before, strict=True))


@pytest.mark.parametrize("shape", SHAPES)
def test_vectors_of_numbers_and_arrays_agree_with_numpy(shape):
    u, v, w = given = np.random.default_rng(2).normal(size=(3, *shape))
    before = given.copy()
    columns = [ZERO, (1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (u, 0.0, v), (1.0, u, 2.5), (v, u, w)]
    for a, b in every(columns, repeat=2):
        x, y = (np.stack(np.broadcast_arrays(*column, u)[:3]) for column in (a, b))
        assert same(dot(a, b), (x * y).sum(axis=0))
        for found, expected in (
            (cross(a, b), np.cross(x, y, axis=0)),
            (combine(v, a, w, b), v * x + w * y),
            (uncombine(v, a, w, b), v * x - w * y),
            (advance(a, v, b), x + v * y),
            (advance(a, 2.5, b), x + 2.5 * y),
        ):
            assert all(map(same, found, expected))
    assert np.array_equal(given, before)


@pytest.mark.parametrize("shape", SHAPES)
def test_of_numbers_zero_and_one_nothing_is_computed(shape):
    """On either side: entries that must vanish stay numbers, and one that does not change stays the array it is."""
    u = np.random.default_rng(3).normal(size=shape)
    for one, other in ((u, 0.0), (0.0, u)):
        assert isinstance(product(one, other), float)
        assert product(one, other) == 0.0
        assert total(one, other) is u
    assert product(u, 1.0) is product(1.0, u) is difference(u, 0.0) is u
    assert isinstance(difference(u, u), float)
    assert same(difference(0.0, u), -u)
    assert same(product(-1.0, u), -u)


@pytest.mark.parametrize("shape", SHAPES)
def test_sums_and_multiples_of_vectors_agree_with_numpy(shape):
    u, v, w = np.random.default_rng(4).normal(size=(3, *shape))
    columns = [ZERO, (1.0, 0.0, 0.0), (u, 0.0, v), (v, u, w), (0.0, 2.5, u)]
    for a, b in every(columns, repeat=2):
        x, y = (np.stack(np.broadcast_arrays(*column, u)[:3]) for column in (a, b))
        assert all(map(same, plus(a, b), x + y))
        assert all(map(same, minus(a, b), x - y))
        for factor in (0.0, 1.0, -1.0, 2.5, w):
            assert all(map(same, scaled(factor, a), factor * x))
    assert plus(ZERO, columns[3]) is plus(columns[3], ZERO) is minus(columns[3], ZERO) is columns[3]
    assert scaled(0.0, columns[3]) is ZERO
    assert scaled(1.0, columns[3]) is columns[3]
