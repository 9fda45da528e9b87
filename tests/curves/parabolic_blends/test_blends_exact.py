"""Blends that pass exactly through the waypoints: where they are, how, and that nothing overshoots."""

from __future__ import annotations

import numpy as np
import pytest
from blend_cases import JOINTS, SEEDS, assert_continuous, assert_no_slivers, chords, polyline
from hypothesis import given, settings
from hypothesis import strategies as st

from trajcli.curves.extrema import peaks_between
from trajcli.curves.parabolic_blends.blends import blended, blended_by_acceleration

ENDS = st.sampled_from(["centred", "inside"])
COUNTS = st.integers(3, 10)


def assert_exact(result, t, q):
    """The curve is at each inner waypoint at its time, without acceleration, and between two of them in order."""
    at = t[1:-1] + result.shift
    scale = max(1, np.abs(q).max())
    np.testing.assert_allclose(result.curve.evaluate(at), q[1:-1], rtol=0, atol=1e-11 * scale)
    assert not result.missed[1:-1].any()
    edges = np.concatenate([[0.0], at, [result.curve.end]])
    for k, (position,) in enumerate(
        peaks_between(result.curve, np.stack([edges[:-1], edges[1:]], axis=1), (0,))
    ):
        low, high = np.minimum(q[k], q[k + 1]), np.maximum(q[k], q[k + 1])
        assert (position.low >= low - 1e-11 * scale).all()
        assert (position.high <= high + 1e-11 * scale).all()


@settings(max_examples=80, deadline=None)
@given(SEEDS, COUNTS, JOINTS, ENDS)
def test_the_waypoints_are_passed_exactly(seed, m, n, ends):
    t, q = polyline(seed, m, n)
    d = np.random.default_rng(seed).uniform(0.01, 2.0, m)
    result = blended(t, q, d, ends=ends, exactly=True)
    assert_exact(result, t, q)
    used = result.blends[1:-1:2, 0]
    for side in (-1, 1):  # straight for a quarter of the blend
        near = t[1:-1] + side * 0.99 * used / 8 + result.shift
        np.testing.assert_allclose(result.curve.evaluate(near, 2), 0, atol=1e-9)


@settings(max_examples=80, deadline=None)
@given(SEEDS, COUNTS, JOINTS, ENDS, st.floats(0.5, 3.5))
def test_the_same_by_acceleration(seed, m, n, ends, power):
    t, q = polyline(seed, m, n)
    a = 10**power * np.maximum(np.abs(chords(t, q)).max(axis=0), 1e-3)
    if ends == "inside":
        a = np.maximum(a, 20 * np.abs(np.diff(q, axis=0)).max(axis=0) / np.diff(t).min() ** 2)
    result = blended_by_acceleration(t, q, a, ends=ends, exactly=True)
    assert_continuous(result.curve)
    at = t[1:-1] + result.shift
    scale = max(1, np.abs(q).max())
    np.testing.assert_allclose(result.curve.evaluate(at), q[1:-1], rtol=0, atol=1e-11 * scale)
    assert np.abs(result.curve.evaluate(result.curve.end) - q[-1]).max() < 1e-11 * scale
    assert_exact(result, t, q)
    peak = np.abs(result.curve.piece_ends(2)[0]).max(axis=0)
    crowded = np.zeros(n, dtype=bool)
    crowded[[shrunk.joint for shrunk in result.shrunk]] = True
    assert (peak[~crowded] <= a[~crowded] * (1 + 1e-9)).all()
    turning = ~crowded & (np.abs(np.diff(chords(t, q), axis=0)).max(axis=0) > 1e-9)
    np.testing.assert_allclose(peak[turning], a[turning], rtol=1e-9)


def test_strong_joints_are_not_crowded():
    t, q = np.arange(30.0), np.random.default_rng(5).normal(size=(30, 6))
    result = blended_by_acceleration(t, q, 60.0, exactly=True)
    assert not result.shrunk
    assert_exact(result, t, q)


def test_a_reversal_and_a_bend_by_hand():
    # velocities 2, 1, -1: through the second point with the slower one, 1; through the third with none
    result = blended([0, 1, 2, 3], [[0.0], [2.0], [3.0], [2.0]], 0.16, exactly=True)
    offset = 0.1
    np.testing.assert_array_equal(result.points, [0, 1, 1, 2, 2, 3])
    expected = [0, 1 - offset, 1 + offset, 2 - offset, 2 + offset, 3]
    np.testing.assert_allclose(result.times[:, 0] - result.shift, expected, atol=1e-14)
    np.testing.assert_allclose(result.positions[:, 0], [0, 1.9, 2.1, 3, 3, 2], atol=1e-14)
    lines = [1.9 / 0.9, 1, 0.9 / 0.8, 0, -1 / 0.9]
    np.testing.assert_allclose(result.velocities[:, 0], lines, atol=1e-14)
    velocity = result.curve.evaluate(np.array([1.0, 2.0]) + result.shift, 1)[:, 0]
    np.testing.assert_allclose(velocity, [1, 0], atol=1e-14)


def test_crowded_corners_touch_and_say_so():
    result = blended([0, 1, 2, 3], [[0.0], [1.0], [0.0], [1.0]], 0.6, exactly=True)
    # 9/8 of the blend to either side of an inner point, half of one at the ends
    assert {s.point: s.used for s in result.shrunk} == {1: pytest.approx(4 / 9), 2: pytest.approx(4 / 9)}
    assert result.blends[0, 0] == 0.6
    assert_no_slivers(result.curve)
    assert_continuous(result.curve)


def test_two_points_have_nothing_to_pass():
    plain = blended([0, 1], [[0.0], [1.0]], 0.2)
    exact = blended([0, 1], [[0.0], [1.0]], 0.2, exactly=True)
    np.testing.assert_array_equal(plain.curve.coefficients, exact.curve.coefficients)


@pytest.mark.parametrize("ends", ["centred", "inside"])
def test_a_straight_line_stays_one(ends):
    t = np.array([0, 1, 3, 3.5, 5])
    q = np.stack([2 * t, np.zeros(5), np.array([0, 1, 3, 3.5, 6.0])], axis=1)
    result = blended_by_acceleration(t, q, 40.0, ends="centred", exactly=True)
    middle = result.curve.evaluate(np.linspace(0.2, 4.9, 50) + result.shift, 2)
    assert not middle[:, :2].any()
    assert_exact(result, t, q)
    if ends == "inside":
        inside = blended_by_acceleration(t, q, 40.0, ends="inside", exactly=True)
        assert_exact(inside, t, q)
        assert inside.curve.end == 5
