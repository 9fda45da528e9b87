"""The fastest blends: against brute force, against laws known in closed form, and as a motion within limits."""

from __future__ import annotations

import numpy as np
import pytest
from blend_cases import SEEDS
from counted_calls import calls_of
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize
from tiers import few

from trajcli.curves.extrema import peaks
from trajcli.curves.parabolic_blends.blends import blended
from trajcli.curves.parabolic_blends.fastest import fastest_blends

STARTS = 6


def total(segments, blends):
    return segments.sum() + (blends[0] + blends[-1]) / 2


def two_sided(limits):
    return np.outer(limits, [-1.0, 1.0])


def brute_force(q, v, a, rng):
    """Return the shortest time that sequential quadratic programming finds from several starts."""
    m, n = q.shape
    ways = np.diff(q, axis=0)

    def left(z):
        h, d = np.exp(z[: m - 1]), z[m - 1 :]
        velocity = np.concatenate([np.zeros((1, n)), ways / h[:, None], np.zeros((1, n))])
        step = np.diff(velocity, axis=0)
        bounds = [
            v[:, 1] - velocity,
            velocity - v[:, 0],
            d[:, None] * a[:, 1] - step,
            step - d[:, None] * a[:, 0],
        ]
        return np.concatenate([*(bound.ravel() for bound in bounds), h - (d[1:] + d[:-1]) / 2])

    found = []
    for _ in range(STARTS):
        h = np.abs(ways).max(axis=1) / np.abs(v).max() * rng.uniform(1, 6, m - 1) + 0.1
        z = np.concatenate([np.log(h), rng.uniform(0.05, 1, m)])
        best = minimize(
            lambda z: total(np.exp(z[: m - 1]), z[m - 1 :]),
            z,
            constraints={"type": "ineq", "fun": left},
            method="SLSQP",
            options={"maxiter": 400, "ftol": 1e-10},
        ).x
        if left(best).min() > -1e-7:
            found.append(total(np.exp(best[: m - 1]), best[m - 1 :]))
    return min(found)


@pytest.mark.parametrize("n", [1, 2])
@pytest.mark.parametrize("m", few([2, 3, 4, 5], 2))
def test_brute_force_is_not_faster(m, n):
    rng = np.random.default_rng(10 * m + n)
    for _ in few(range(4), 2):
        q = rng.uniform(-1, 1, (m, n)) * 10.0 ** rng.uniform(-2, 0.5, (m, 1))
        v, a = rng.uniform(0.2, 3, (n, 2)) * [-1, 1], rng.uniform(0.5, 10, (n, 2)) * [-1, 1]
        ours = total(*fastest_blends(q, v, a))
        brute = brute_force(q, v, a, rng)
        assert brute * (1 - 1e-5) <= ours <= brute * 1.02


@settings(max_examples=30, deadline=None)
@given(st.floats(0.01, 10), st.floats(0.1, 10), st.floats(0.1, 10))
def test_two_points_are_the_trapezoid(distance, v, a):
    segments, blends = fastest_blends([[1.0], [1.0 - distance]], [[-v, 9 * v]], [[-a, a]])
    best = distance / v + v / a if v * v < a * distance else 2 * np.sqrt(distance / a)
    assert total(segments, blends) == pytest.approx(best, rel=1e-6)


@pytest.mark.parametrize("limit", [0.3, 1.0, np.inf])
@pytest.mark.parametrize("legs", [1, 2])
def test_the_total_time_is_a_minimum_to_a_ten_millionth(legs, limit):
    """Of one leg, or of one there and back: the blend at the turn lasts as long as those at both ends together."""
    acceleration = 1.7
    segments, blends = fastest_blends(
        [[0.0], [1.0], [0.0]][: legs + 1], two_sided([limit]), two_sided([acceleration])
    )
    v = min(limit, np.sqrt(acceleration / (1.0 if legs == 1 else 1.5)))
    assert total(segments, blends) == pytest.approx(legs / v + v / acceleration, rel=2e-7)


@pytest.mark.parametrize("seed", few(range(20)))
def test_a_blend_is_as_short_as_the_limits_let_it_or_a_thousandth_of_a_segment(seed):
    rng = np.random.default_rng(seed)
    q = np.cumsum(rng.normal(size=(9, 2)), axis=0)
    q[4] = 0.5 * (q[3] + q[5])
    v, a = rng.uniform(0.1, 0.3, (2, 2)) * [-1, 1], rng.uniform(5, 20, (2, 2)) * [-1, 1]
    a *= (
        20.0 if seed % 2 else 1.0
    )  # the blends at both ends are as short as they can be, however long the segment
    segments, blends = fastest_blends(q, v, a)
    velocities = np.pad(np.diff(q, axis=0) / segments[:, None], ((1, 1), (0, 0)))
    step = np.diff(velocities, axis=0)
    asked = np.where(step > 0, step / a[:, 1], step / a[:, 0]).max(axis=1)
    soft = 1e-3 * np.minimum(segments[1:], segments[:-1])
    asked[1:-1] = np.maximum(asked[1:-1], soft)
    assert (asked[1:-1] == soft).any()
    assert blends == pytest.approx(asked, rel=2e-9)


def test_where_there_is_no_room_a_blend_is_shorter_still():
    """Half of the motion speeds up, the other half slows down: nothing is left for the point in the middle."""
    segments, blends = fastest_blends([[0.0], [1.0], [2.0]], two_sided([np.inf]), two_sided([1.0]))
    assert (segments >= 0.5 * (blends[1:] + blends[:-1])).all()
    assert 2 * segments == pytest.approx(blends[[0, -1]], rel=1e-3)


def test_the_slower_ramp_counts_by_direction():
    # 1 rad: speeding up at 4, slowing down at 1, at most 1 rad/s
    segments, blends = fastest_blends([[0.0], [1.0]], [[-1.0, 1.0]], [[-1.0, 4.0]])
    assert blends == pytest.approx([0.25, 1.0], rel=1e-5)
    assert segments == pytest.approx([1.0], rel=1e-5)


@settings(max_examples=25, deadline=None)
@given(SEEDS, st.integers(2, 25), st.integers(1, 8), st.sampled_from(["centred", "inside"]))
def test_the_motion_keeps_all_limits_and_needs_no_shrinking(seed, m, n, ends):
    rng = np.random.default_rng(seed)
    q = np.cumsum(rng.normal(size=(m, n)) * 10.0 ** rng.uniform(-3, 1, (m, 1)), axis=0)
    q[rng.random(m) < 0.15] = q[0]
    q[0, :] += 1e-3
    v, a = rng.uniform(0.1, 3, (n, 2)) * [-1, 1], rng.uniform(0.1, 20, (n, 2)) * [-1, 1]
    v[rng.random(n) < 0.2] = [-np.inf, np.inf]
    segments, blends = fastest_blends(q, v, a, ends=ends)
    result = blended(np.concatenate([[0.0], np.cumsum(segments)]), q, blends, ends=ends)
    assert not result.shrunk
    for found, bound in zip(peaks(result.curve, (1, 2)), (v, a), strict=True):
        assert (found.low >= bound[:, 0] * (1 + 1e-9)).all()
        assert (found.high <= bound[:, 1] * (1 + 1e-9)).all()


def test_both_kinds_of_ends_are_one_motion():
    q = np.random.default_rng(3).normal(size=(7, 3))
    limits = two_sided([1.0, 2.0, 1.5]), two_sided([5.0, 3.0, 8.0])
    times = {}
    curves = {}
    for ends in ("centred", "inside"):
        segments, blends = fastest_blends(q, *limits, ends=ends)
        times[ends] = np.concatenate([[0.0], np.cumsum(segments)])
        curves[ends] = blended(times[ends], q, blends, ends=ends).curve
    assert curves["inside"].end == pytest.approx(curves["centred"].end, rel=1e-12)
    s = np.linspace(0, curves["inside"].end * (1 - 1e-12), 300)
    np.testing.assert_allclose(curves["inside"].evaluate(s), curves["centred"].evaluate(s), atol=1e-10)


def test_points_on_a_line_cost_no_more_than_its_ends():
    q = np.linspace(0, 1, 300)[:, None]
    assert total(*fastest_blends(q, two_sided([0.5]), two_sided([2.0]))) == pytest.approx(2.25, rel=1e-5)


def test_repeated_points_are_rests():
    q = np.array([0.0, 0, 0, 1, 1, 1, 0])[:, None]
    segments, blends = fastest_blends(q, two_sided([1.0]), two_sided([2.0]))
    # 1.5 s each way: two segments of 1 s with blends of half a second around them
    assert total(segments, blends) == pytest.approx(3.0, rel=1e-5)
    assert (segments > 0).all()


def test_points_that_are_all_equal_take_no_time():
    segments, blends = fastest_blends(np.ones((4, 2)), two_sided([1.0, 1.0]), two_sided([1.0, np.inf]))
    assert not segments.any()
    assert not blends.any()


def test_a_joint_that_rests_needs_no_limit():
    q = np.array([[0.0, 5.0], [1.0, 5.0]])
    segments, blends = fastest_blends(q, two_sided([1.0, 1.0]), two_sided([2.0, np.inf]))
    assert total(segments, blends) == pytest.approx(1.5, rel=1e-6)


def test_twice_the_scale_takes_as_long():
    q = np.random.default_rng(8).normal(size=(9, 2))
    v, a = two_sided([1.0, 2.0]), two_sided([5.0, 3.0])
    small, large = (total(*fastest_blends(q * s, v * s, a * s)) for s in (1e-5, 1e5))
    assert small == pytest.approx(large, rel=1e-6)


@pytest.mark.parametrize(
    ("v", "a", "message"),
    [
        ([[-1, 1]], [[-np.inf, np.inf]], "joint 0 moves and has no limit of acceleration"),
        ([[-1, 1]], [[-np.inf, 1]], "joint 0 moves and has no limit of acceleration"),
        ([[-1, 1]], [[-1, np.inf]], "joint 0 moves and has no limit of acceleration"),
        ([[0, 1]], [[-1, 1]], "velocity must be on both sides"),
        ([[-1, 1]], [[-1, -0.5]], "acceleration must be on both sides"),
    ],
)
def test_wrong_limits_are_refused(v, a, message):
    with pytest.raises(ValueError, match=message):
        fastest_blends([[0.0], [1.0]], v, a)


def test_the_cost_is_linear():
    def calls(m):
        q = np.random.default_rng(m).normal(size=(m, 2))
        return calls_of(lambda: fastest_blends(q, two_sided([2.0, 2.0]), two_sided([8.0, 8.0])))

    assert calls(1_600) < 1.5 * 8 * calls(200)
