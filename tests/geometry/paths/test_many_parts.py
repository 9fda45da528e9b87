"""Chains of very many parts: what tables of them say is what each part says of itself."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from trajcli.geometry.paths.arc import Arc
from trajcli.geometry.paths.chain import Chain, join
from trajcli.geometry.paths.position import Line

POINTS = 90


def _wandering(seed: int) -> Chain:
    """Return a chain of lines with two arcs among them, some corners rounded and some sharp."""
    rng = np.random.default_rng(seed)
    points = np.cumsum(rng.normal(size=(POINTS, 3)) * 0.01, axis=0)
    curves = [Line(*pair) for pair in pairwise(points)]
    for where in (POINTS // 3, POINTS // 2):
        curves[where] = Arc.through(points[where], points[where] + [0.0, 0.004, 0.0], points[where + 1])
    radii = np.where(rng.uniform(size=len(curves) - 1) < 0.8, 0.002, 0.0)
    return join(curves, radii)


@pytest.mark.parametrize("side", ["left", "right"])
def test_values_are_those_of_the_parts(side) -> None:
    chain = _wandering(7)
    assert len(chain.parts) > 64
    lengths = np.diff(chain.offsets)
    late = [chain.offsets[:-1] + share * lengths for share in (0.01, 0.9, 0.99, 0.9999)]
    spread = np.random.default_rng(1).uniform(0, chain.length, 400)
    s = np.concatenate([spread, chain.breaks, [chain.length], *late])
    found = chain.evaluate(s, side)
    part = np.searchsorted(chain.breaks, s, side)
    assert set(part) == set(range(len(chain.parts)))
    for k in range(len(chain.parts)):
        rows = np.flatnonzero(part == k)
        local = np.clip(s[rows] - chain.offsets[k], 0.0, chain.parts[k].length)
        expected = chain.parts[k].evaluate(local, side)
        for column, own, scale in zip(found, expected, (1.0, 1.0, 1e3), strict=True):
            np.testing.assert_allclose(column[rows], own, rtol=1e-11, atol=1e-12 * scale)


def test_the_derivatives_are_those_of_the_position() -> None:
    chain = _wandering(8)
    s = np.random.default_rng(2).uniform(0, chain.length, 300)
    s = s[np.abs(chain.breaks[:, None] - s).min(axis=0) > 1e-5]
    step = 1e-6
    before, here, after = (chain.evaluate(s + k * step)[0] for k in (-1, 0, 1))
    _, first, second = chain.evaluate(s)
    np.testing.assert_allclose((after - before) / (2 * step), first, atol=5e-6)
    np.testing.assert_allclose(np.linalg.norm(first, axis=1), 1.0, atol=1e-12)
    np.testing.assert_allclose(
        (after - 2 * here + before) / step**2, second, atol=2e-3 * np.abs(second).max()
    )


def test_majorants_are_those_of_the_parts() -> None:
    chain = _wandering(9)
    s = np.random.default_rng(3).uniform(0, chain.length, 300)
    rising = np.abs(np.random.default_rng(4).normal(size=(5, s.size)))
    found = chain.majorants(s, rising)
    part = np.searchsorted(chain.breaks, s, "right")
    for row, k in enumerate(part.tolist()):
        own = chain.parts[k].majorants(s[row : row + 1] - chain.offsets[k], rising[:, row : row + 1])
        for bounds, expected in zip(found, own, strict=True):
            np.testing.assert_array_equal(bounds[:, row], expected[:, 0])
    assert np.isinf(found[0]).any()
    assert np.isfinite(found[0]).any()
