"""Blends by acceleration: every joint its own, ends inside by the quadratic, and what is too weak."""

from __future__ import annotations

import numpy as np
import pytest
from blend_cases import COUNTS, JOINTS, SEEDS, assert_continuous, chords, polyline
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from trajcli.curves.parabolic_blends.blends import blended, blended_by_acceleration
from trajcli.curves.parabolic_blends.durations import BlendAccelerationError


def strong(t, q, rng):
    """Return accelerations with room for every blend, also inside."""
    least = 4 * np.abs(np.diff(q, axis=0)).max(axis=0) / np.diff(t).min() ** 2
    return np.maximum(least, 1e-3) * rng.uniform(1.5, 20, q.shape[1])


@settings(max_examples=80, deadline=None)
@given(SEEDS, COUNTS, JOINTS, st.sampled_from(["centred", "inside"]))
def test_every_joint_takes_its_own_blends(seed, m, n, ends):
    t, q = polyline(seed, m, n)
    a = strong(t, q, np.random.default_rng(seed))
    result = blended_by_acceleration(t, q, a, ends=ends)
    assert_continuous(result.curve)
    assert result.curve.start == 0
    scale = max(1, np.abs(q).max())
    at = result.curve.evaluate(np.array([0.0, result.curve.end]))
    np.testing.assert_allclose(at, q[[0, -1]], rtol=0, atol=1e-12 * scale)
    velocity = result.curve.evaluate(np.array([0.0, result.curve.end]), 1)
    np.testing.assert_allclose(velocity, 0, atol=1e-11 * scale)
    crowded = {shrunk.joint for shrunk in result.shrunk}
    free = [j for j in range(n) if j not in crowded]
    used = np.abs(result.curve.piece_ends(2)[0])[:, free]
    off = np.minimum(used, np.abs(used - a[free])) / a[free]
    assert off.max(initial=0) < 1e-8
    assert (used <= a[free] * (1 + 1e-12)).all()
    inner = np.clip(t + result.shift, 0, result.curve.end)
    missed = np.abs(result.curve.evaluate(inner) - q)
    np.testing.assert_allclose(missed, result.missed, rtol=0, atol=1e-12 * scale)
    if m > 3:  # inner segments lie on the chords
        np.testing.assert_allclose(result.velocities[1:-1], chords(t, q)[1:-1], rtol=0, atol=1e-12 * scale)


@settings(max_examples=40, deadline=None)
@given(SEEDS, COUNTS)
def test_one_joint_by_acceleration_is_that_joint_by_durations(seed, m):
    t, q = polyline(seed, m, 1)
    assume((np.abs(np.diff(np.concatenate([[0], chords(t, q)[:, 0], [0]]))) > 1e-6).all())
    by_acceleration = blended_by_acceleration(t, q, strong(t, q, np.random.default_rng(seed)))
    v = np.concatenate([[0], chords(t, q)[:, 0], [0]])
    assert (by_acceleration.blends > 0).all()
    assert (by_acceleration.blends[:, 0] <= np.abs(np.diff(v)) / 1e-9).all()
    again = blended(t, q, by_acceleration.blends[:, 0])
    s = np.linspace(0, again.curve.end, 100)
    np.testing.assert_allclose(
        again.curve.evaluate(s), by_acceleration.curve.evaluate(s), atol=1e-11 * max(1, np.abs(q).max())
    )


def test_a_slow_joint_of_centred_ends_begins_first():
    # joint 0 turns at 5 with 1 / 5 s, joint 1 at 1 with 1 s: the motion lasts half a second more at either end
    result = blended_by_acceleration([0, 4], [[0.0, 0.0], [4.0, 4.0]], [5.0, 1.0])
    assert result.shift == 0.5
    assert result.curve.end == 5
    early = result.curve.evaluate([0.39, 0.41, 4.59, 4.61], 1)
    assert early[0, 0] == 0 < early[1, 0] < early[1, 1]
    assert early[3, 0] == pytest.approx(0, abs=1e-12)
    assert early[2, 0] == pytest.approx(0.05)
    assert result.curve.evaluate(0.1, 1)[1] == pytest.approx(0.1)


@settings(max_examples=60, deadline=None)
@given(SEEDS, st.integers(2, 5), st.booleans(), st.booleans())
def test_the_least_acceleration_inside_is_what_the_error_says(seed, m, moving, exactly):
    t, q = polyline(seed, m, 3)
    v = np.random.default_rng(seed).normal(size=(2, 3)) * moving
    assume(np.abs(q[1] - q[0]).max() > 1e-6)
    with pytest.raises(BlendAccelerationError) as caught:
        blended_by_acceleration(
            t, q, 1e-6, ends="inside", start_velocity=v[0], end_velocity=v[1], exactly=exactly
        )
    error = caught.value
    assert error.acceleration == 1e-6
    if exactly and m > 2:
        return  # the offsets, hence the segment, depend on the acceleration
    a = np.full(3, 1e9)

    def given_to_joint(factor):
        a[error.joint] = error.least * factor
        return blended_by_acceleration(t, q, a, ends="inside", start_velocity=v[0], end_velocity=v[1])

    with pytest.raises(BlendAccelerationError) as again:
        given_to_joint(0.999)
    assert (again.value.joint, again.value.least) == (error.joint, pytest.approx(error.least))
    given_to_joint(1.0 + 1e-9)
    if not moving:  # Craig's quadratics: two blends in one segment, or one
        end = slice(0, 2) if error.point == 0 else slice(-2, None)
        needed = (4 if m == 2 else 2) * abs(np.diff(q[end, error.joint])[0]) / np.diff(t[end])[0] ** 2
        assert error.least == pytest.approx(needed)


@settings(max_examples=100, deadline=None)
@given(st.floats(-3, 3), st.floats(-3, 3), st.floats(-3, 3), st.floats(1.001, 30), st.floats(0.3, 3))
def test_one_segment_with_moving_ends_inside(distance, v0, v1, factor, h):
    assume(abs(distance - v0 * h) > 1e-3 and abs(distance - v1 * h) > 1e-3)
    with pytest.raises(BlendAccelerationError) as caught:
        blended_by_acceleration(
            [0, h], [[1.0], [1 + distance]], 1e-9, ends="inside", start_velocity=v0, end_velocity=v1
        )
    a = caught.value.least * factor
    result = blended_by_acceleration(
        [0, h], [[1.0], [1 + distance]], a, ends="inside", start_velocity=v0, end_velocity=v1
    )
    d0, d1, v = *result.blends[:, 0], result.velocities[0, 0]
    assert not result.shrunk
    assert d0 == pytest.approx(abs(v - v0) / a, abs=1e-9)
    assert d1 == pytest.approx(abs(v1 - v) / a, abs=1e-9)
    covered = (v0 + v) / 2 * d0 + v * (h - d0 - d1) + (v + v1) / 2 * d1
    assert covered == pytest.approx(distance, abs=1e-9)
    ends = result.curve.evaluate([0.0, h]), result.curve.evaluate([0.0, h], 1)
    np.testing.assert_allclose(ends[0][:, 0], [1, 1 + distance], atol=1e-9)
    np.testing.assert_allclose(ends[1][:, 0], [v0, v1], atol=1e-9)


@settings(max_examples=60, deadline=None)
@given(SEEDS, st.integers(3, 8))
def test_moving_ends_inside_other_segments(seed, m):
    t, q = polyline(seed, m, 2)
    rng = np.random.default_rng(seed)
    v = rng.normal(size=(2, 2))
    a = strong(t, q, rng) + 20 * np.abs(v).max() / np.diff(t).min()
    result = blended_by_acceleration(t, q, a, ends="inside", start_velocity=v[0], end_velocity=v[1])
    assume(not result.shrunk)
    scale = max(1, np.abs(q).max())
    for at, point, velocity in ((0.0, q[0], v[0]), (result.curve.end, q[-1], v[1])):
        np.testing.assert_allclose(result.curve.evaluate(at), point, rtol=0, atol=1e-11 * scale)
        np.testing.assert_allclose(result.curve.evaluate(at, 1), velocity, rtol=0, atol=1e-11 * scale)
        bend = np.abs(result.curve.evaluate(at, 2))
        assert (np.minimum(bend, np.abs(bend - a)) <= 1e-7 * a).all()
    touched = result.curve.evaluate(t[1:-1] + result.shift) - q[1:-1]
    np.testing.assert_allclose(np.abs(touched), result.missed[1:-1], rtol=0, atol=1e-11 * scale)
    steps = np.abs(np.diff(np.concatenate([v[:1], result.velocities, v[1:]]), axis=0))
    np.testing.assert_allclose(result.blends * a, steps, rtol=0, atol=1e-11 * scale)


def test_the_error_names_the_joint_that_lacks_most():
    q = np.array([[0.0, 0.0, 0.0], [5.0, 1.0, 2.0]])
    with pytest.raises(BlendAccelerationError) as caught:
        blended_by_acceleration([0, 1], q, [100.0, 1.0, 4.0], ends="inside")
    error = caught.value
    assert (error.joint, error.point, error.acceleration, error.least) == (1, 0, 1.0, pytest.approx(4.0))


def test_shrunk_blends_name_the_joint():
    # at the middle joint 1 turns by 4 within 1 s segments: at 1 rad/s^2 it asks for 4 s
    q = np.array([[0.0, 0.0], [1.0, 2.0], [2.0, 0.0]])
    result = blended_by_acceleration([0, 1, 2], q, [100.0, 1.0])
    assert {shrunk.joint for shrunk in result.shrunk} == {1}
    middle = next(shrunk for shrunk in result.shrunk if shrunk.point == 1)
    assert middle.asked == pytest.approx(4)
    assert middle.used == pytest.approx(4 / 3)  # the ends ask for 2: 1 + 2 halves share 1 s
    assert_continuous(result.curve)


def test_rounding_is_not_a_corner():
    t = np.cumsum(np.full(50, 0.1))
    result = blended_by_acceleration(t, np.stack([3 * t + 7, 0 * t], axis=1), [50.0, 2.0])
    assert not result.shrunk
    assert not result.blends[1:-1].any()
    assert result.curve.lengths.min() > 0.01
    assert not result.curve.evaluate(np.linspace(0.2, result.curve.end - 0.2, 200), 2).any()


@pytest.mark.parametrize("a", [0.0, -1.0, np.inf, np.nan])
def test_wrong_accelerations_are_refused(a):
    with pytest.raises(ValueError, match="positive and finite"):
        blended_by_acceleration([0, 1], [[0.0], [1.0]], a)


@pytest.mark.parametrize("seed", range(6))
def test_inner_points_are_passed_exactly_also_where_blends_are_shrunk(seed):
    """A corner asks for much and the other one of its point for little: its blend ends at the point, not behind it."""
    rng = np.random.default_rng(seed)
    t, q = np.cumsum(rng.uniform(0.2, 2, 5)), np.cumsum(10 ** rng.uniform(-2, 1, (5, 2)), axis=0)
    result = blended_by_acceleration(t, q, rng.uniform(0.1, 1, 2), exactly=True)
    at = result.curve.evaluate(t + result.shift)
    np.testing.assert_allclose(at[1:-1], q[1:-1], rtol=0, atol=1e-12 * np.abs(q).max())
    assert_continuous(result.curve)
    assert result.shrunk
    for one in result.shrunk:
        corners = np.flatnonzero(result.points == one.point)
        assert one.used < one.asked
        assert np.isclose(result.blends[corners, one.joint], one.used, rtol=1e-12).any()


def test_at_the_least_acceleration_inside_the_blend_fills_its_segment():
    """And with half as much again, both end segments begin and end as asked, at just that acceleration."""
    tried = set()
    for seed in range(24):
        rng = np.random.default_rng(seed)
        m = int(rng.integers(2, 5))
        t, q, v = np.cumsum(10 ** rng.uniform(-1, 1, m)), rng.normal(size=(m, 1)), rng.normal(size=(2, 1))
        fields = {"ends": "inside", "start_velocity": v[0], "end_velocity": v[1]}
        with pytest.raises(BlendAccelerationError) as caught:
            blended_by_acceleration(t, q, 1e-3, **fields)
        least, end = caught.value.least, 0 if caught.value.point == 0 else -1
        tried.add((m > 2, end))
        full = blended_by_acceleration(t, q, least * (1 - 1e-15), **fields)
        asked = full.blends[:, 0].copy()
        for one in full.shrunk:  # to leave room for that of the next point
            asked[one.point] = one.asked
        filled = asked.sum() if m == 2 else asked[end]
        assert filled == pytest.approx(np.diff(t)[end], rel=1e-6)
        with pytest.raises(BlendAccelerationError):
            blended_by_acceleration(t, q, least * (1 - 1e-9), **fields)
        result = blended_by_acceleration(t, q, least * 1.5, **fields)
        curve, shrunk = result.curve, result.shrunk
        for order, wanted in ((0, q[[0, -1]]), (1, v)):
            ends = [side[k] for side, k in zip(curve.piece_ends(order), (0, -1), strict=True)]
            np.testing.assert_allclose(ends, wanted, rtol=0, atol=1e-9)
        for point, piece in ((0, 0), (m - 1, -1)):
            if point not in {one.point for one in shrunk}:
                rate = abs(curve.piece_ends(2)[0][piece, 0])
                assert rate == pytest.approx(least * 1.5, rel=1e-6)
    assert tried == {(False, 0), (True, 0), (True, -1)}


def test_a_step_of_velocity_that_is_no_rounding_has_its_blend():
    result = blended_by_acceleration([0, 1, 2], [[0.0], [1.0], [2.0 + 1e-10]], 0.5)
    assert result.blends[1, 0] == pytest.approx(2e-10, rel=1e-4)
    q = np.array([[0.0, 0.0], [1e9, 1e-7], [2e9, 0.0]])  # beside a joint that goes far
    assert blended_by_acceleration([0, 1, 2], q, [1e10, 1.0]).blends[1, 1] == pytest.approx(2e-7, rel=1e-9)


@pytest.mark.parametrize("ends", ["centred", "inside"])
def test_two_corners_are_five_eighths_of_the_longer_blend_from_their_point(ends):
    for seed in range(4):
        t, q = polyline(seed, 5, 2)
        result = blended_by_acceleration(
            t, q, 30 * strong(t, q, np.random.default_rng(seed)), ends=ends, exactly=True
        )
        assert not result.shrunk
        for k in (1, 2, 3):
            before, after = np.flatnonzero(result.points == k)
            longer = np.maximum(result.blends[before], result.blends[after])
            own = t[k] + result.shift
            np.testing.assert_allclose(own - result.times[before], 0.625 * longer, rtol=1e-9, atol=1e-14)
            np.testing.assert_allclose(result.times[after] - own, 0.625 * longer, rtol=1e-9, atol=1e-14)
