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
    dot,
    minus_product,
    plus_product,
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
