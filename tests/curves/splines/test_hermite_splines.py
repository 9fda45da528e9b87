"""Cubics and quintics with known derivatives, and the rules that find them: against scipy, laws, exact numbers."""

from __future__ import annotations

from fractions import Fraction
from math import factorial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.polynomial import Polynomial
from scipy.interpolate import BPoly, CubicHermiteSpline
from spline_laws import SEEDS, assert_through, jump, uneven_times

from trajcli.curves.extrema import peaks
from trajcli.curves.hermite import hermite_errors
from trajcli.curves.splines.hermite import (
    computed_accelerations,
    computed_velocities,
    cubic_through,
    parabola_velocities,
    quintic_through,
)

# what the quintic with velocities 0 and 3 and no accelerations leaves the box by: the worst that the rules allow
OUTSIDE = max(
    -(u**3) * (10 - 15 * u + 6 * u**2 + 3 * (-4 + 7 * u - 3 * u**2)) for u in np.linspace(0, 1, 100_001)
)


def ruled(times, positions):
    zero = np.zeros(positions.shape[1])
    velocities = parabola_velocities(times, positions, zero, zero)
    accelerations = computed_accelerations(times, velocities, zero, zero)
    return quintic_through(times, positions, velocities, accelerations)


@settings(max_examples=40, deadline=None)
@given(SEEDS, st.integers(2, 30))
def test_equals_scipy(seed, count):
    rng = np.random.default_rng(seed)
    times, derivatives = uneven_times(rng, count, 10.0, rng.normal()), rng.normal(size=(3, count, 2))
    t = rng.uniform(times[0], times[-1], 50)
    pairs = (
        (cubic_through(times, *derivatives[:2]), CubicHermiteSpline(times, *derivatives[:2])),
        (quintic_through(times, *derivatives), BPoly.from_derivatives(times, derivatives.transpose(1, 0, 2))),
    )
    for curve, expected in pairs:
        for order in range(3):
            scale = peaks(curve, (order,))[0].magnitude.max()
            np.testing.assert_allclose(
                curve.evaluate(t, order), expected(t, nu=order), rtol=0, atol=1e-12 * scale
            )


@settings(max_examples=60, deadline=None)
@given(SEEDS, st.integers(2, 60), st.sampled_from([1.0, 1e2, 1e4, 1e8]))
def test_passes_its_points_and_is_as_smooth_as_promised(seed, count, ratio):
    rng = np.random.default_rng(seed)
    times, positions = uneven_times(rng, count, ratio), rng.normal(size=(count, 2))
    zero = np.zeros(2)
    velocities = computed_velocities(times, positions, zero, zero)
    assert_through(cubic_through(times, positions, velocities), times, positions, 1)
    assert_through(ruled(times, positions), times, positions, 2)


def test_ten_thousand_points():
    rng = np.random.default_rng(7)
    times = uneven_times(rng, 10_000, 1e4)
    positions = rng.normal(size=(10_000, 6))
    assert_through(ruled(times, positions), times, positions, 2)


def test_slow_changes_of_a_fast_motion_stay_continuous():
    """Rounding of a velocity, divided by the square of a short time, must not become a jump."""
    times = np.arange(200) * 1e-3
    positions = (3.0 + times)[:, None]
    velocities = 1 + 1e-7 * np.sin(times)[:, None]
    accelerations = 1e-7 * np.cos(times)[:, None]
    curve = quintic_through(times, positions, velocities, accelerations)
    assert jump(curve, 2) < 1e-13


@settings(max_examples=60, deadline=None)
@given(SEEDS, st.integers(3, 20))
def test_computed_velocities_follow_the_rule(seed, count):
    rng = np.random.default_rng(seed)
    times = np.cumsum(rng.integers(1, 5, count)).astype(float)
    positions = rng.integers(-2, 3, (count, 2)).astype(float)  # many flat neighbours
    got = computed_velocities(times, positions, [7.0, 8.0], [9.0, 10.0])
    np.testing.assert_array_equal(got[[0, -1]], [[7.0, 8.0], [9.0, 10.0]])
    for joint in range(2):
        q = [Fraction(x) for x in positions[:, joint]]
        t = [Fraction(x) for x in times]
        for k in range(1, count - 1):
            before, after = ((q[k] - q[k - 1]) / (t[k] - t[k - 1]), (q[k + 1] - q[k]) / (t[k + 1] - t[k]))
            same = (before > 0 and after > 0) or (before < 0 and after < 0)
            assert got[k, joint] == pytest.approx(float((before + after) / 2) if same else 0.0, rel=1e-14)


def test_a_change_that_is_rounding_is_flat():
    positions = np.array([[0.0], [0.1 + 0.2], [0.3], [0.1]])
    times = np.arange(4.0)
    assert positions[1] != positions[2]
    for rule in (computed_velocities, parabola_velocities):
        np.testing.assert_array_equal(rule(times, positions, [0.0], [0.0]), 0.0)
        slow = rule(times, np.array([[1.0], [1.0 + 2**-47], [1.0 + 2**-46], [1.0]]), [0.0], [0.0])
        np.testing.assert_array_equal(slow[:, 0], [0, 2**-47, 0, 0])
    tiny = np.array([[0.0], [1e-300], [2e-300]])
    assert computed_velocities(times[:3], tiny, [0.0], [0.0])[1, 0] == 1e-300


@settings(max_examples=40, deadline=None)
@given(SEEDS)
def test_a_parabola_gives_its_own_velocities(seed):
    rng = np.random.default_rng(seed)
    times = uneven_times(rng, 12, 3.0)
    positions = (times + 0.01 * times**2)[:, None]
    got = parabola_velocities(times, positions, [0.0], [0.0])
    np.testing.assert_allclose(got[1:-1, 0], 1 + 0.02 * times[1:-1], rtol=1e-12)
    np.testing.assert_allclose(parabola_velocities(times, -positions, [0.0], [0.0]), -got, rtol=1e-15)


def test_accelerations_follow_from_velocities_by_the_same_rule_and_each_end_keeps_its_own():
    times = np.array([0.0, 1.0, 3.0, 4.0])
    velocities = np.array([[0.0, 1.0], [1.0, 1.0], [5.0, 0.0], [4.0, -2.0]])
    got = computed_accelerations(times, velocities, [7.0, 8.0], [9.0, 10.0])
    # slopes 1 then 2, of which the shorter interval weighs more; then a turn
    np.testing.assert_allclose(got, [[7, 8], [4 / 3, 0], [0, -1.5], [9, 10]], rtol=1e-15)


@settings(max_examples=60, deadline=None)
@given(SEEDS, st.integers(4, 40), st.sampled_from([1.0, 1e2, 1e6]))
def test_ruled_quintics_stay_by_their_points(seed, count, ratio):
    rng = np.random.default_rng(seed)
    times = uneven_times(rng, count, ratio)
    positions = rng.normal(size=(count, 2)) * 100.0 ** rng.uniform(-1, 1, (count, 1))
    curve = ruled(times, positions)
    t = curve.breaks[:-1] + np.linspace(0, 1, 41)[:, None] * curve.lengths
    values = curve.evaluate(np.clip(t, curve.start, curve.end))[:, 1:-1]
    low, high = (f(positions[1:-2], positions[2:-1]) for f in (np.minimum, np.maximum))
    assert (np.maximum(low - values, values - high) <= OUTSIDE * (high - low) + 1e-13).all()


def test_the_bound_of_the_box_is_reached():
    assert 0.0127 < OUTSIDE < 0.0128
    # a rest, then slopes of which the second asks for three times the first
    times, positions = np.array([0.0, 1.0, 2.0, 2.001]), np.array([[0.0], [0.0], [1.0], [1.1]])
    curve = ruled(times, positions)
    assert curve.evaluate(np.linspace(1, 2, 20_001)).min() == pytest.approx(-OUTSIDE, rel=1e-6)


def test_rest_and_straight_stretches_stay():
    times = np.array([0.0, 1.0, 3.0, 4.0, 5.5, 6.0, 7.0])
    positions = np.array([0.0, 1.0, 1.0, 2.0, 3.5, 4.0, 5.0])[:, None]
    curve = ruled(times, positions)
    assert not curve.coefficients[:-1, 1].any()
    straight = curve.coefficients[:, 4, 0]
    np.testing.assert_allclose(straight, [0, 0, 0, 0, 1, 3.5], atol=1e-13)


def test_values_that_do_not_fit():
    times, positions = [0.0, 1.0, 2.0], np.zeros((3, 2))
    with pytest.raises(
        ValueError, match=r"velocities must be finite and of shape \(3, 2\), got shape \(3, 1\)"
    ):
        cubic_through(times, positions, np.zeros((3, 1)))
    with pytest.raises(ValueError, match="accelerations must be finite"):
        quintic_through(times, positions, positions, positions + np.nan)
    with pytest.raises(ValueError, match="at the last point must be 2 finite numbers"):
        computed_velocities(times, positions, [0, 0], [0])


@pytest.mark.parametrize("stated", [2, 3])
def test_the_errors_of_a_power_are_those_that_are_stated(stated):
    """Of x^(2k) over its (2k)! a Hermite polynomial of degree 2k - 1 misses (x (x - h))^k over that: no bound is less."""
    h, missed = 0.7, Polynomial([0.0, -0.7, 1.0]) ** stated / factorial(2 * stated)
    for order, bound in enumerate(hermite_errors(np.array(1.0), h, stated).tolist()):
        derivative = missed.deriv(order) if order else missed
        inner = [x.real for x in derivative.deriv().roots() if abs(x.imag) < 1e-6 and 0 < x.real < h]
        assert np.abs(derivative(np.array([0.0, h, *inner]))).max() == pytest.approx(bound, rel=1e-9)
