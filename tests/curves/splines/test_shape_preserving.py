"""Monotone cubics: the box is never left, inner velocities are scipy's, and every possible end velocity is taken."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicHermiteSpline, PchipInterpolator
from spline_laws import SEEDS, assert_through, uneven_times

from trajcli.curves.splines.hermite import ShapeError, shape_preserving


def random_points(seed, count, ratio):
    rng = np.random.default_rng(seed)
    positions = rng.normal(size=(count, 2)) * 100.0 ** rng.uniform(-1, 1, (count, 1))
    positions[rng.uniform(size=count) < 0.2] = 0.5  # some neighbours are equal
    return rng, uneven_times(rng, count, ratio), positions


def assert_monotone(curve, positions):
    """Each piece is a cubic; its derivative is lowest and highest at the ends or at its vertex."""
    c3, c2, c1, _ = curve.coefficients
    h = curve.lengths[:, None]
    vertex = np.clip(np.divide(-c2, 3 * c3, out=np.zeros_like(c2), where=c3 != 0), 0, h)
    rates = [c1 + x * (2 * c2 + x * 3 * c3) for x in (0, vertex, h)]
    move = np.diff(positions, axis=0)
    slack = 1e-14 * (np.abs(c1) + np.abs(c2 * h) + np.abs(c3 * h * h))
    assert (np.min(rates * np.sign(move), axis=0) >= -slack).all()
    assert not curve.coefficients[:-1][:, move == 0].any()
    t = curve.breaks[:-1] + np.linspace(0, 1, 33)[:, None] * curve.lengths
    values = curve.evaluate(np.clip(t, curve.start, curve.end))
    low, high = (f(positions[:-1], positions[1:]) for f in (np.minimum, np.maximum))
    assert (np.maximum(low - values, values - high) <= 1e-15 * np.abs(positions).max()).all()


@settings(max_examples=100, deadline=None)
@given(SEEDS, st.integers(2, 60), st.sampled_from([1.0, 1e2, 1e4, 1e8]))
def test_never_leaves_the_box(seed, count, ratio):
    _, times, positions = random_points(seed, count, ratio)
    curve = shape_preserving(times, positions)
    assert_through(curve, times, positions, 1)
    assert_monotone(curve, positions)
    np.testing.assert_array_equal(curve.evaluate(times[0], 1), 0)


def test_ten_thousand_points():
    _, times, positions = random_points(1, 10_000, 1e4)
    curve = shape_preserving(times, positions)
    assert_through(curve, times, positions, 1)
    assert_monotone(curve, positions)


@settings(max_examples=40, deadline=None)
@given(SEEDS, st.integers(3, 30))
def test_inner_velocities_are_those_of_pchip(seed, count):
    _, times, positions = random_points(seed, count, 30.0)
    expected = PchipInterpolator(times, positions)(times[1:-1], 1)
    got = shape_preserving(times, positions).evaluate(times[1:-1], 1)
    np.testing.assert_allclose(got, expected, rtol=1e-12, atol=1e-13)


def test_slopes_whose_product_vanishes_are_still_slopes():
    _, times, positions = random_points(4, 12, 30.0)
    whole, tiny = shape_preserving(times, positions), shape_preserving(times, positions * 2.0**-600)
    np.testing.assert_array_equal(tiny.coefficients[1:], whole.coefficients[1:] * 2.0**-600)
    assert whole.coefficients[1].any()


def is_monotone(times, positions, first, last):
    rates = CubicHermiteSpline(times, positions, [first, last])(np.linspace(times[0], times[1], 4001), 1)
    return bool((rates * np.sign(positions[1] - positions[0]) >= -1e-9).all())


@settings(max_examples=100, deadline=None)
@given(st.integers(-200, 1000), st.integers(-200, 1000), st.booleans())
@example(700, 600, False)  # either would do with less of the other
@example(600, 700, True)
def test_of_two_points_exactly_the_monotone_pairs_are_taken(first, last, falls):
    sign = -1 / 200 if falls else 1 / 200
    times, positions = np.array([2.0, 4.0]), np.array([0.0, 400 * sign])
    ends = first * sign, last * sign
    possible = is_monotone(times, positions, *ends)
    if possible != is_monotone(times, positions, ends[0] * 1.001, ends[1] * 1.001):
        return  # too close to tell by sampling
    if possible:
        curve = shape_preserving(times, positions[:, None], ends[:1], ends[1:])
        assert_monotone(curve, positions[:, None])
        assert curve.evaluate(2.0, 1)[0] == ends[0]
    else:
        with pytest.raises(ShapeError):
            shape_preserving(times, positions[:, None], ends[:1], ends[1:])


@settings(max_examples=60, deadline=None)
@given(SEEDS, st.integers(3, 20), st.sampled_from(["first", "last"]), st.sampled_from([-1.0, 1.0]))
def test_the_error_says_what_is_possible(seed, count, end, sign):
    _, times, positions = random_points(seed, count, 10.0)
    with pytest.raises(ShapeError) as caught:
        shape_preserving(times, positions, **{end: [0.0, sign * 1e6]})
    error = caught.value
    assert (error.component, error.end, error.velocity) == (1, end, sign * 1e6)
    assert error.low <= 0 <= error.high
    assert str(error.high) in str(error)
    assert str(error.low) in str(error)
    for bound in (error.low, error.high):
        curve = shape_preserving(times, positions, **{end: [0.0, bound]})
        assert_monotone(curve, positions)
    piece = 0 if end == "first" else -1
    biggest = max(error.high, -error.low)
    mean = abs(np.diff(positions[:, 1])[piece] / np.diff(times)[piece])
    assert 3 * mean * (1 - 1e-12) <= biggest <= 4 * mean * (1 + 1e-12)
    # one per cent more is too much: the derivative then changes its sign inside the piece
    own = 1.01 * (error.high or error.low)
    beside = curve.evaluate(times[[1, -2]], 1)[piece, 1]
    pair = (own, beside) if end == "first" else (beside, own)
    near = slice(0, 2) if end == "first" else slice(-2, None)
    assert not mean or not is_monotone(times[near], positions[near, 1], *pair)


def test_bad_shapes():
    with pytest.raises(ValueError, match="first velocity must be 1 finite numbers"):
        shape_preserving([0.0, 1.0], np.zeros((2, 1)), [0.0, 0.0])
