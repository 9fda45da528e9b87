"""Random polylines in time, and laws that every blended one obeys."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st

SEEDS = st.integers(0, 2**32 - 1)
COUNTS = st.integers(2, 12)
JOINTS = st.integers(1, 12)


def polyline(seed, m, n):
    """Return times and positions; some points repeat the one before, in some joints or in all."""
    rng = np.random.default_rng(seed)
    t = rng.uniform(-3, 3) + np.cumsum(rng.uniform(0.4, 2.0, m))
    q = rng.normal(size=(m, n)) * 10.0 ** rng.uniform(-2, 2)
    for k in range(1, m):
        same = rng.random(n) < (1.0 if rng.random() < 0.1 else 0.2)
        q[k, same] = q[k - 1, same]
    return t, q


def chords(t, q):
    return np.diff(q, axis=0) / np.diff(t)[:, None]


def assert_continuous(curve):
    """Position and velocity have no jump above 1e-9 of their peak."""
    for order in (0, 1):
        starts, ends = curve.piece_ends(order)
        peak = np.maximum(np.abs(starts), np.abs(ends)).max(axis=0)
        assert (np.abs(starts[1:] - ends[:-1]) <= 1e-9 * peak + 1e-13).all(), f"order {order}"


def assert_no_slivers(curve):
    assert curve.lengths.min() > 1e-12 * curve.end
