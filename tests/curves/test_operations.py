"""Composition of curves, against scipy's piecewise polynomials."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import PPoly

from trajcli.curves.operations import (
    along_line,
    coast_until,
    cut,
    hold_until,
    merge_breaks,
    reverse,
    scale_time,
    stacked,
)
from trajcli.curves.piecewise import PiecewisePolynomial, concatenate, constant

ORDERS = (0, 1, 2, 3)


def random_curve(rng, end, pieces, degree=3, n=1, start=0.0):
    inner = np.sort(rng.uniform(start, end, pieces - 1))
    return PiecewisePolynomial(
        np.concatenate([[start], inner, [end]]), rng.normal(size=(degree + 1, pieces, n))
    )


def by_scipy(curve, t, order=0):
    return PPoly(curve.coefficients, curve.breaks)(t, nu=order)


def between_breaks(rng, curve, count=200):
    t = rng.uniform(curve.start, curve.end, count)
    return t[np.abs(t[:, None] - curve.breaks).min(axis=1) > 1e-9]


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 5))
def test_merged_components_are_the_given_curves(seed, count):
    rng = np.random.default_rng(seed)
    curves = [
        random_curve(rng, 3.0, int(rng.integers(1, 8)), int(rng.integers(0, 6)), int(rng.integers(1, 3)))
        for _ in range(count)
    ]
    merged = merge_breaks(curves)
    assert merged.dimension == sum(curve.dimension for curve in curves)
    assert merged.pieces == 1 + sum(curve.pieces - 1 for curve in curves)
    assert set(np.concatenate([curve.breaks for curve in curves])) == set(merged.breaks)
    t = between_breaks(rng, merged)
    for order in ORDERS:
        expected = np.concatenate([by_scipy(curve, t, order) for curve in curves], axis=1)
        np.testing.assert_allclose(merged.evaluate(t, order), expected, rtol=1e-11, atol=1e-11)


def test_breaks_that_rounding_moved_apart_become_one():
    third = np.nextafter(1 / 3, 1)
    a = PiecewisePolynomial([0.0, 1 / 3, 2.0], np.ones((2, 2, 1)))
    b = PiecewisePolynomial([0.0, third, np.nextafter(third, 1) + 2e-16, 2.0], np.ones((2, 3, 1)))
    merged = merge_breaks([a, b])
    assert merged.pieces == 3  # two breaks of one curve never become one, those of two curves do
    assert merged.breaks[1] == 1 / 3


def test_tiny_phases_of_one_curve_stay():
    tiny = 1e-14
    jerky = PiecewisePolynomial([0.0, 1.0, 1.0 + tiny, 5.0], np.arange(12.0).reshape(4, 3, 1))
    other = PiecewisePolynomial([0.0, 1.0, 5.0], np.ones((1, 2, 1)))
    merged = merge_breaks([other, jerky])
    assert merged.pieces == 3
    assert merged.lengths[1] == (1.0 + tiny) - 1.0
    np.testing.assert_array_equal(merged.coefficients[:, :, 1], jerky.coefficients[:, :, 0])


def test_breaks_further_apart_than_rounding_stay():
    a = PiecewisePolynomial([0.0, 1.0, 5.0], np.ones((2, 2, 1)))
    b = PiecewisePolynomial([0.0, 1.0 + 2e-14, 5.0], np.ones((2, 2, 1)))
    assert merge_breaks([a, b]).pieces == 3


def test_shared_breaks_keep_coefficients_bit_for_bit():
    rng = np.random.default_rng(3)
    breaks = np.array([0.0, 0.1, 0.7, 1.9])
    a, b = (PiecewisePolynomial(breaks, rng.normal(size=(4, 3, 2))) for _ in range(2))
    np.testing.assert_array_equal(
        merge_breaks([a, b]).coefficients, np.concatenate([a.coefficients, b.coefficients], axis=2)
    )


def test_curves_over_different_intervals_do_not_merge():
    with pytest.raises(ValueError, match="must all cover"):
        merge_breaks([constant([0.0], 1.0), constant([0.0], 1.0 + 1e-12)])


def test_curves_of_no_length_merge():
    merged = merge_breaks([constant([1.0], 0.0), constant([2.0, 3.0], 0.0)])
    assert merged.duration == 0
    assert merged.evaluate(0.0).tolist() == [1, 2, 3]


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(1e-2, 1e2))
def test_time_scales(seed, factor):
    rng = np.random.default_rng(seed)
    curve = random_curve(rng, 2.5, 5, 5, 2, start=-1.0)
    scaled = scale_time(curve, factor)
    assert scaled.start == curve.start
    assert scaled.duration == pytest.approx(curve.duration * factor, rel=1e-14)
    t = between_breaks(rng, curve)
    for order in ORDERS:
        expected = by_scipy(curve, t, order) / factor**order
        found = scaled.evaluate(curve.start + (t - curve.start) * factor, order)
        np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-10 / factor**order)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_reversed_curve_runs_backwards(seed):
    rng = np.random.default_rng(seed)
    curve = random_curve(rng, 2.5, 5, 5, 2, start=0.5)
    backwards = reverse(curve)
    assert (backwards.start, backwards.end) == (curve.start, curve.end)
    t = between_breaks(rng, curve)
    for order in ORDERS:
        expected = (-1) ** order * by_scipy(curve, t, order)
        found = backwards.evaluate(curve.start + curve.end - t, order)
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9)


def test_line_moves_joints_by_the_law():
    rng = np.random.default_rng(5)
    law = random_curve(rng, 2.0, 4)
    start, displacement = np.array([1.0, -2.0, 3.0]), np.array([0.5, 0.0, -4.0])
    curve = along_line(start, displacement, law)
    t = between_breaks(rng, law)
    np.testing.assert_allclose(curve.evaluate(t), start + by_scipy(law, t) * displacement, rtol=1e-14)
    np.testing.assert_allclose(curve.evaluate(t, 2), by_scipy(law, t, 2) * displacement, rtol=1e-14)


def test_held_curve_keeps_its_last_value():
    curve = PiecewisePolynomial([0.0, 1.0], np.array([-2.0, 3.0, 0.0, 4.0])[:, None, None])
    held = hold_until(curve, 2.5)
    assert held.end == 2.5
    assert held.evaluate([1.0, 1.7, 2.5]).ravel().tolist() == [5, 5, 5]
    assert held.evaluate([1.7, 2.5], 1).ravel().tolist() == [0, 0]
    assert hold_until(constant([4.0], 0.0), 3.0).evaluate([0.0, 3.0]).ravel().tolist() == [4, 4]


def test_moving_curve_cannot_be_held():
    curve = PiecewisePolynomial([0.0, 1.0], np.array([-2.0, 3.0, 1e-8, 4.0])[:, None, None])
    with pytest.raises(ValueError, match="still moves"):
        hold_until(curve, 2.0)


def test_coasting_curve_keeps_its_last_velocity():
    curve = PiecewisePolynomial([0.0, 1.0], np.array([2.0, 0.0, 1.0])[:, None, None])
    coasting = coast_until(curve, 3.0)
    np.testing.assert_allclose(coasting.evaluate([1.0, 2.0, 3.0]).ravel(), [3.0, 7.0, 11.0], rtol=1e-15)


@pytest.mark.parametrize("extend", [hold_until, coast_until])
def test_extension_never_shortens(extend):
    with pytest.raises(ValueError, match="after"):
        extend(constant([1.0], 2.0), 1.9)
    for end in (1.0, 3.0):
        assert extend(constant([1.0], 2.0), np.nextafter(2.0, end)).pieces == 1
    for end in (0.3 / np.arange(1.0, 40.0)).tolist():
        assert extend(constant([1.0], 0.1 * end), end).end == end, "to the last bit"


def test_a_curve_is_held_by_its_velocity_at_its_end():
    starting, stopping = (np.array(rows)[:, None, None] for rows in ([1.0, 0.0, 0.0], [-1.0, 2.0, 0.0]))
    with pytest.raises(ValueError, match="still moves at its end"):
        hold_until(PiecewisePolynomial([0.0, 1.0], starting), 2.0)
    assert hold_until(PiecewisePolynomial([0.0, 1.0], stopping), 2.0).evaluate(2.0).tolist() == [1.0]


def test_joined_extension_evaluates_over_all():
    curve = concatenate([hold_until(constant([1.0], 1.0), 2.0), constant([1.0], 1.0)])
    assert curve.end == 3.0


def test_curves_that_begin_at_different_times_do_not_merge():
    late = PiecewisePolynomial([0.5, 1.0], np.ones((1, 1, 1)))
    whole = PiecewisePolynomial([0.0, 1.0], np.ones((1, 1, 1)))
    for curves in ([whole, late], [late, whole]):
        with pytest.raises(ValueError, match=r"must all cover \[0\.0, 1\.0\]"):
            merge_breaks(curves)


def test_rounding_of_times_before_zero_is_that_of_the_earliest():
    curves = [PiecewisePolynomial([-1000.0, -500.0 + apart, 0.0], np.ones((2, 2, 1))) for apart in (0, 1e-13)]
    assert merge_breaks(curves).breaks.tolist() == [-1000.0, -500.0, 0.0]


def test_breaks_a_last_bit_apart_stay_apart_in_scaled_and_reversed_time():
    breaks = [0.0, 0.1, np.nextafter(0.1, 1), 1.9, np.nextafter(1.9, 2), 10.0]
    curve = PiecewisePolynomial(breaks, np.ones((2, 5, 1)))
    for other in (reverse(curve), scale_time(curve, 1.06), scale_time(curve.shifted(8.0), 0.05)):
        assert other.pieces == 5
        assert (other.lengths > 0).all()


@pytest.mark.parametrize(
    ("peaks", "rates", "moves"),
    [
        ([1.0], [1e-4], True),
        ([1.0], [-1e-4], True),
        ([1.0], [1e-12], False),
        ([1e6, 1.0], [1e-5, 0.0], False),  # each by its own peak
        ([1e3, 1.0], [0.0, 1e-7], True),
    ],
)
def test_a_curve_rests_where_its_velocity_is_rounding(peaks, rates, moves):
    coefficients = np.array([[peaks, rates], [np.zeros_like(peaks), peaks]])
    curve = PiecewisePolynomial([0.0, 1.0, 2.0], coefficients)
    if moves:
        with pytest.raises(ValueError, match="still moves at its end"):
            hold_until(curve, 3.0)
    else:
        assert hold_until(curve, 3.0).end == 3.0


@pytest.mark.parametrize("time", [-1.3, -0.5, 1.0, 1.0 + 2e-16, 2.5])
def test_both_parts_of_a_curve_that_is_cut_are_the_curve(time):
    """Inside a piece it has a break more; at a break, or beside one by rounding alone, as many as before."""
    curve = PiecewisePolynomial([-2.0, -0.5, 1.0, 3.0], np.random.default_rng(3).normal(size=(4, 3, 2)))
    before, behind = cut(curve, time)
    assert before.pieces + behind.pieces == (4 if time in (-1.3, 2.5) else 3)
    assert (before.start, behind.end) == (-2.0, 3.0)
    assert before.end == behind.start == pytest.approx(time, abs=1e-15)
    for part in (before, behind):
        t = np.linspace(part.start, part.end, 13)[1:-1]
        for order in range(4):
            np.testing.assert_allclose(
                part.evaluate(t, order), curve.evaluate(t, order), rtol=1e-11, atol=1e-11
            )


@pytest.mark.parametrize("time", [-2.0, -2.0 + 1e-16, 3.0, -5.0, 7.0])
def test_a_curve_is_cut_where_something_is_left_of_both_parts(time):
    curve = PiecewisePolynomial([-2.0, 1.0, 3.0], np.ones((2, 2, 1)))
    with pytest.raises(ValueError, match=r"is no time within \[-2\.0, 3\.0\]"):
        cut(curve, time)


@pytest.mark.parametrize("joints", [1, 3, 4, 7])
def test_pieces_of_lower_degree_are_filled_up_whatever_the_number_of_joints(joints):
    rng = np.random.default_rng(joints)
    blocks = [rng.normal(size=(rows, pieces, joints)) for rows, pieces in ((2, 3), (4, 1), (1, 2))]
    whole = stacked(blocks)
    assert whole.shape == (4, 6, joints)
    x = np.array([0.0, 0.3, -2.0])
    first = 0
    for block in blocks:
        for piece in range(block.shape[1]):
            for joint in range(joints):
                values = np.polyval(whole[:, first + piece, joint], x)
                np.testing.assert_allclose(
                    values, np.polyval(block[:, piece, joint], x), rtol=1e-14, atol=1e-14
                )
        first += block.shape[1]
