"""Cubics with two virtual points: against exact rational solutions, and the laws that define them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from spline_laws import SEEDS, assert_equals_exact, assert_through, exact_spline, uneven_times

from trajcli.curves.splines.virtual_points import continuous_acceleration, virtual_points

STEPS = st.lists(st.sampled_from([1, 3, 16, 100, 1024, 10000]), min_size=3, max_size=6)


@settings(max_examples=50, deadline=None)
@given(STEPS, SEEDS)
def test_equals_the_exact_solution_where_lengths_differ_by_10000(steps, seed):
    """Among the steps are the two parts of the end intervals: virtual points lie anywhere."""
    knots = np.concatenate([[0.0], np.cumsum(steps)]) / 1024
    rng = np.random.default_rng(seed)
    slopes = rng.integers(-64, 64, knots.size - 1) / 16
    positions = np.concatenate([[0.0], np.cumsum(slopes * np.diff(knots))])
    velocities, accelerations = rng.integers(-64, 64, (2, 2)) / 16
    virtual = [1, knots.size - 2]
    known = [None if k in virtual else q for k, q in enumerate(positions)]
    last = knots.size - 1
    ends = [
        (k, order, value[int(k > 0)])
        for k in (0, last)
        for order, value in ((1, velocities), (2, accelerations))
    ]
    curve = continuous_acceleration(
        np.delete(knots, virtual),
        np.delete(positions, virtual)[:, None],
        velocities[:, None],
        accelerations[:, None],
        knots[virtual],
    )
    np.testing.assert_array_equal(curve.breaks, knots)
    assert_equals_exact(curve, exact_spline(knots, known, ends), 2e-13)


@settings(max_examples=80, deadline=None)
@given(SEEDS, st.integers(2, 60), st.sampled_from([1.0, 1e2, 1e4]), st.sampled_from([0.5, 1e-4, 1 - 1e-4]))
def test_all_conditions_hold(seed, count, ratio, place):
    rng = np.random.default_rng(seed)
    times, positions = uneven_times(rng, count, ratio), rng.normal(size=(count, 2))
    velocities, accelerations = rng.normal(size=(2, 2, 2))
    virtual = np.array(
        [times[0] + place * (times[1] - times[0]), times[-1] - 0.9 * (1 - place) * (times[-1] - times[-2])]
    )
    if count == 2:
        virtual.sort()
    curve = continuous_acceleration(times, positions, velocities, accelerations, virtual)
    assert_through(curve, times, positions, 2)
    for order, wanted in ((1, velocities), (2, accelerations)):
        first, last = curve.piece_ends(order)
        scale = max(np.abs(first).max(), np.abs(last).max())
        np.testing.assert_allclose(first[0], wanted[0], rtol=1e-15)
        np.testing.assert_allclose(last[-1], wanted[1], rtol=0, atol=1e-13 * scale)


@settings(max_examples=30, deadline=None)
@given(SEEDS, st.integers(2, 12))
def test_a_curve_run_backwards_is_the_curve(seed, count):
    rng = np.random.default_rng(seed)
    times, positions = uneven_times(rng, count, 10.0), rng.normal(size=(count, 2))
    velocities, accelerations = rng.normal(size=(2, 2, 2))
    forth = continuous_acceleration(times, positions, velocities, accelerations)
    back = continuous_acceleration(-times[::-1], positions[::-1], -velocities[::-1], accelerations[::-1])
    t = np.linspace(times[0], times[-1], 100)
    np.testing.assert_allclose(forth.evaluate(t), back.evaluate(-t), rtol=0, atol=1e-11)


def test_middles_and_thirds():
    curve = continuous_acceleration([1.0, 2.0, 6.0], np.zeros((3, 1)), np.ones((2, 1)), np.ones((2, 1)))
    np.testing.assert_array_equal(virtual_points(curve)[0], [1.5, 4.0])
    curve = continuous_acceleration([1.0, 4.0], np.zeros((2, 1)), np.ones((2, 1)), np.ones((2, 1)))
    np.testing.assert_array_equal(virtual_points(curve)[0], [2.0, 3.0])


@pytest.mark.parametrize(
    "virtual", [[0.0, 2.5], [1.0, 2.5], [0.5, 2.0], [0.5, 3.0], [2.5, 0.5], [0.5], [0.5, np.nan]]
)
def test_virtual_times_outside_their_intervals(virtual):
    zero = np.zeros((2, 1))
    with pytest.raises(ValueError, match=r"first interval, \(0.0, 1.0\), and the last one, \(2.0, 3.0\)"):
        continuous_acceleration([0.0, 1.0, 2.0, 3.0], np.zeros((4, 1)), zero, zero, virtual)


def test_two_points_need_virtual_times_in_order():
    zero = np.zeros((2, 1))
    with pytest.raises(ValueError, match="must increase"):
        continuous_acceleration([0.0, 3.0], zero, zero, zero, [2.0, 1.0])


def test_end_values_that_do_not_fit():
    zero = np.zeros((2, 1))
    with pytest.raises(ValueError, match="one row for each of the two ends"):
        continuous_acceleration([0.0, 3.0], zero, np.zeros((3, 1)), zero)
    with pytest.raises(ValueError, match="acceleration must be 1 finite numbers"):
        continuous_acceleration([0.0, 3.0], zero, zero, np.zeros((2, 2)))
