"""Blends of given duration: laws of the moving average, miss distances, shrinking, refusals, cost."""

from __future__ import annotations

import numpy as np
import pytest
from blend_cases import COUNTS, JOINTS, SEEDS, assert_continuous, assert_no_slivers, chords, polyline
from counted_calls import calls_of
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import PPoly

from trajcli.curves.parabolic_blends.blends import Shrunk, blended, blended_by_acceleration

ENDS = st.sampled_from(["centred", "inside"])


def moving_average(t, q, width, start_velocity, end_velocity):
    """Return the polyline, prolonged at both ends, averaged over a window in time: what equal blends make of it."""
    beyond = 10.0
    lines = np.concatenate([start_velocity[None], chords(t, q), end_velocity[None]])
    begins = np.concatenate([(q[0] - start_velocity * beyond)[None], q])
    breaks = np.concatenate([[t[0] - beyond], t, [t[-1] + beyond]])
    area = PPoly(np.stack([lines, begins]), breaks).antiderivative()
    return lambda s: (area(s + width / 2) - area(s - width / 2)) / width


@settings(max_examples=60, deadline=None)
@given(SEEDS, COUNTS, JOINTS, st.floats(0.01, 1.0), st.booleans())
def test_equal_centred_blends_are_a_moving_average(seed, m, n, part, moving):
    t, q = polyline(seed, m, n)
    rng = np.random.default_rng(seed)
    v = rng.normal(size=(2, n)) * moving
    width = part * np.diff(t).min()
    result = blended(t, q, width, start_velocity=v[0], end_velocity=v[1])
    assert not result.shrunk
    assert result.curve.end == pytest.approx(t[-1] - t[0] + width, abs=1e-12)
    s = rng.uniform(0, result.curve.end, 200)
    expected = moving_average(t, q, width, *v)(s - result.shift)
    scale = np.abs(q).max() + 10 * np.abs(v).max()
    np.testing.assert_allclose(result.curve.evaluate(s), expected, atol=1e-11 * scale / part, rtol=0)


@settings(max_examples=80, deadline=None)
@given(SEEDS, COUNTS, JOINTS, ENDS)
def test_each_waypoint_is_missed_by_exactly_the_stated_distance(seed, m, n, ends):
    t, q = polyline(seed, m, n)
    rng = np.random.default_rng(seed)
    v = rng.normal(size=(2, n))
    d = rng.uniform(0.01, 1.2, m)
    result = blended(t, q, d, ends=ends, start_velocity=v[0], end_velocity=v[1])
    used = result.blends[:, 0]
    at = result.curve.evaluate(np.clip(t + result.shift, 0, result.curve.end))
    missed = np.abs(at - q)
    np.testing.assert_allclose(missed, result.missed, rtol=0, atol=1e-12 * max(1, np.abs(q).max()))
    if m > 3:
        inner = np.abs(np.diff(chords(t, q), axis=0))[1:-1] * used[2:-2, None] / 8  # no end segment beside it
        np.testing.assert_allclose(result.missed[2:-2], inner, rtol=1e-9, atol=1e-12)
    if ends == "inside":
        assert not result.missed[[0, -1]].any()
        assert result.curve.end == pytest.approx(t[-1] - t[0], abs=1e-12)


@settings(max_examples=80, deadline=None)
@given(SEEDS, COUNTS, JOINTS, ENDS, st.booleans())
def test_position_and_velocity_are_continuous_and_the_ends_are_met(seed, m, n, ends, exactly):
    t, q = polyline(seed, m, n)
    rng = np.random.default_rng(seed)
    result = blended(t, q, rng.uniform(1e-3, 2.5, m), ends=ends, exactly=exactly)
    assert result.curve.start == 0
    assert_continuous(result.curve)
    assert_no_slivers(result.curve)
    scale = max(1, np.abs(q).max())
    for at, point in ((0.0, q[0]), (result.curve.end, q[-1])):
        np.testing.assert_allclose(result.curve.evaluate(at), point, rtol=0, atol=1e-12 * scale)
        np.testing.assert_allclose(result.curve.evaluate(at, 1), 0, atol=1e-11 * scale)
    d, order = result.blends[:, 0], np.diff(result.times[:, 0])
    assert (d[1:] / 2 + d[:-1] / 2 <= order * (1 + 1e-11)).all()


@settings(max_examples=80, deadline=None)
@given(SEEDS, st.integers(3, 10), ENDS)
def test_shrinking_is_all_that_is_needed_and_no_more(seed, m, ends):
    t, q = polyline(seed, m, 1)
    asked = np.random.default_rng(seed).uniform(0.05, 2.5, m)
    result = blended(t, q, asked, ends=ends)
    used, h = result.blends[:, 0], np.diff(t)
    share = np.full(m, 0.5)
    share[[0, -1]] = 1.0 if ends == "inside" else 0.5
    need = (share * asked)[:-1] + (share * asked)[1:]
    taken = (share * used)[:-1] + (share * used)[1:]
    assert (used <= asked).all()
    assert (taken <= h * (1 + 1e-11)).all()
    for k in range(m):
        factors = [h[i] / need[i] for i in (k - 1, k) if 0 <= i < m - 1]
        assert used[k] == pytest.approx(asked[k] * min(1, *factors), rel=1e-12)
    listed = {shrunk.point: shrunk for shrunk in result.shrunk}
    assert set(listed) == set(np.flatnonzero(used < asked * (1 - 1e-11)).tolist())
    assert all((s.joint, s.asked, s.used) == (None, asked[k], used[k]) for k, s in listed.items())


def test_a_crowded_segment_by_hand():
    result = blended([0, 1, 2], [[0.0], [1.0], [0.0]], [0.2, 1.6, 0.8])
    assert result.shrunk == (
        Shrunk(1, None, 1.6, pytest.approx(4 / 3)),
        Shrunk(2, None, 0.8, pytest.approx(2 / 3)),
    )
    assert result.missed[1, 0] == pytest.approx(2 * (4 / 3) / 8)
    assert result.curve.pieces == 4  # the two shrunk blends touch


def test_blends_that_just_touch_are_not_shrunk():
    t = np.cumsum(np.full(40, 0.1)) + 0.3
    result = blended(t, np.sin(np.arange(40))[:, None], np.diff(t).min())
    assert not result.shrunk
    assert_continuous(result.curve)


def test_inside_ends_by_hand():
    # 1 rad in 2 s with blends of 0.5 s inside: v (2 - 0.5) = 1
    result = blended([5, 7], [[0.0], [1.0]], 0.5, ends="inside")
    assert result.shift == -5
    assert result.velocities[0, 0] == pytest.approx(2 / 3)
    np.testing.assert_allclose(result.curve.breaks, [0, 0.5, 1.5, 2], atol=1e-12)
    np.testing.assert_allclose(result.curve.evaluate([0.5, 1.5, 2.0])[:, 0], [1 / 6, 5 / 6, 1], atol=1e-12)


def test_two_equal_points_are_a_rest():
    result = blended([0, 1], [[2.0, -1.0]] * 2, 0.0)
    np.testing.assert_array_equal(result.curve.evaluate([0.0, 0.4, 1.0]), [[2.0, -1.0]] * 3)


@pytest.mark.parametrize(
    ("t", "q", "d", "message"),
    [
        ([0, 1, 1], [[0.0], [1.0], [2.0]], 0.1, "point 2 at 1 s follows 1 s"),
        ([0, 1], [[0.0], [1.0], [2.0]], 0.1, "do not fit"),
        ([0], [[0.0]], 0.1, "do not fit"),
        ([0, 1], [[0.0], [np.nan]], 0.1, "finite"),
        ([0, 1], [[0.0], [1.0]], -0.1, "not negative"),
        ([0, 1], [[0.0], [1.0]], np.inf, "finite"),
        ([0, 1, 2], [[0.0], [1.0], [0.0]], [0.1, 0.0, 0.1], "0 s at point 1"),
    ],
)
def test_wrong_input_is_refused(t, q, d, message):
    with pytest.raises(ValueError, match=message):
        blended(t, q, d)


@pytest.mark.parametrize(
    ("t", "q", "fields", "message"),
    [
        ([[0], [1]], [[0.0], [1.0]], {}, "do not fit"),
        ([0, 1], [0.0, 1.0], {}, "do not fit"),
        ([0, 1], [[[0.0]], [[1.0]]], {}, "do not fit"),
        ([0, np.nan], [[0.0], [1.0]], {}, "times, positions and velocities must be finite"),
        ([0, np.inf], [[0.0], [1.0]], {}, "times, positions and velocities must be finite"),
        ([0, 1], [[0.0], [np.inf]], {}, "times, positions and velocities must be finite"),
        (
            [0, 1],
            [[0.0], [1.0]],
            {"start_velocity": np.nan},
            "times, positions and velocities must be finite",
        ),
        ([0, 1], [[0.0], [1.0]], {"end_velocity": np.inf}, "times, positions and velocities must be finite"),
        ([0, 2, 1, 0.5], [[0.0], [1.0], [2.0], [3.0]], {}, "point 2 at 1 s follows 2 s"),
    ],
)
def test_waypoints_that_are_none_are_refused(t, q, fields, message):
    with pytest.raises(ValueError, match=message):
        blended(t, q, 0.1, **fields)
    with pytest.raises(ValueError, match=message):
        blended_by_acceleration(t, q, 9.0, **fields)


def test_the_cost_is_linear():
    def calls(m):
        t, q = np.arange(m, dtype=float), np.random.default_rng(0).normal(size=(m, 6))
        return calls_of(lambda: blended(t, q, 0.2, exactly=True))

    assert calls(10_000) < 1.5 * 10 * calls(1_000)


@pytest.mark.parametrize("exactly", [False, True])
def test_a_slow_joint_that_turns_without_a_blend_is_named_beside_a_fast_one(exactly):
    q = np.array([[0.0, 0.0], [100.0, 1e-8], [200.0, 2e-8], [300.0, 2e-8]])
    fields = {"exactly": exactly, "start_velocity": [100.0, 1e-8], "end_velocity": [100.0, 0.0]}
    with pytest.raises(ValueError, match="0 s at point 2, where joint 1 changes its velocity by 1e-08"):
        blended([0.0, 1.0, 2.0, 3.0], q, [0.2, 0.2, 0.0, 0.2], **fields)
    q[:, 1] = 0.0
    still = blended(
        [0.0, 1.0, 2.0, 3.0], q, 0.0, exactly=exactly, start_velocity=[100.0, 0], end_velocity=[100.0, 0]
    )
    assert still.curve.end == 3.0
