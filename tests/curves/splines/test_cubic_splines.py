"""Cubic splines: against scipy, exact rational solutions, and the laws that define them."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline
from spline_laws import SEEDS, assert_equals_exact, assert_through, exact_spline, jump, uneven_times
from tiers import few

from trajcli.curves.extrema import peaks
from trajcli.curves.splines.cubic import clamped, natural, not_a_knot
from trajcli.curves.splines.virtual_points import continuous_acceleration

ENDS = [(False, False), (True, False), (False, True), (True, True)]


def by_scipy(times, positions, free, first, last):
    ends = [free if velocity is None else (1, velocity) for velocity in (first, last)]
    return CubicSpline(times, positions, bc_type=tuple(ends))


@pytest.mark.parametrize("given_ends", ENDS)
@pytest.mark.parametrize(("rule", "zero"), [(natural, True), (not_a_knot, False)])
@settings(max_examples=40, deadline=None)
@given(SEEDS, st.integers(2, 40))
@example(1, 2)
@example(1, 3)
@example(1, 4)
def test_equals_scipy(rule, zero, given_ends, seed, count):
    rng = np.random.default_rng(seed)
    times, positions = uneven_times(rng, count, 10.0, rng.normal()), rng.normal(size=(count, 3))
    first, last = (
        velocity if used else None for velocity, used in zip(rng.normal(size=(2, 3)), given_ends, strict=True)
    )
    curve = rule(times, positions, first, last)
    free = (2, np.zeros(3)) if zero else "not-a-knot"
    expected = by_scipy(times, positions, free, first, last)
    t = rng.uniform(times[0], times[-1], 100)
    for order in range(3):
        scale = peaks(curve, (order,))[0].magnitude.max()
        np.testing.assert_allclose(
            curve.evaluate(t, order), expected(t, order), rtol=0, atol=1e-12 * scale + 1e-12 * (order == 2)
        )


def test_clamped_equals_scipy():
    rng = np.random.default_rng(3)
    times, positions, ends = uneven_times(rng, 30, 10.0), rng.normal(size=(30, 2)), rng.normal(size=(2, 2))
    expected = CubicSpline(times, positions, bc_type=((1, ends[0]), (1, ends[1])))
    t = np.linspace(times[0], times[-1], 500)
    np.testing.assert_allclose(clamped(times, positions, *ends).evaluate(t), expected(t), rtol=0, atol=1e-12)


DYADIC = st.lists(st.sampled_from([1, 3, 16, 100, 1024, 10000]), min_size=2, max_size=4)


@settings(max_examples=40, deadline=None)
@given(DYADIC, SEEDS, st.sampled_from(ENDS), st.booleans())
def test_equals_the_exact_solution_where_lengths_differ_by_10000(lengths, seed, given_ends, zero):
    times = np.concatenate([[0.0], np.cumsum(lengths)]) / 1024
    count, last_knot = times.size, times.size - 1
    rng = np.random.default_rng(seed)
    # by their slopes, so that the curve stays near its points and every digit counts
    slopes = rng.integers(-64, 64, count - 1) / 16
    positions = np.concatenate([[0.0], np.cumsum(slopes * np.diff(times))])
    velocities = rng.integers(-64, 64, 2) / 16
    if not zero and count == 3 and given_ends == (False, False):
        return
    conditions = []
    for knot, used, value in zip((0, last_knot), given_ends, velocities, strict=True):
        if used:
            conditions.append((knot, 1, value))
        else:
            conditions.append((knot, 2, 0) if zero else (1 if knot == 0 else knot - 1,))
    first, last = ([value] if used else None for value, used in zip(velocities, given_ends, strict=True))
    curve = (natural if zero else not_a_knot)(times, positions[:, None], first, last)
    assert_equals_exact(curve, exact_spline(times, positions, conditions), 1e-13)


@pytest.mark.parametrize("steps", [[1, 1e-6, 1, 1], [1e-6, 1, 1, 1], [1, 1, 1e-6, 1], [1, 1, 1, 1e-6]])
def test_the_third_derivative_is_as_exact_next_to_a_long_end_as_to_a_short_one(steps):
    times = np.cumsum([0, *steps])
    positions = np.sin(times)
    curve = not_a_knot(times, positions[:, None])
    assert jump(curve, 1) < 1e-15
    exact = exact_spline(times, positions, [(1,), (3,)])
    got, expected = curve.coefficients[1, :, 0], np.array([float(row[2]) for row in exact])
    np.testing.assert_allclose(got, expected, rtol=0, atol=1e-14 * np.abs(expected).max())


@settings(max_examples=60, deadline=None)
@given(SEEDS, st.integers(2, 60), st.sampled_from([1.0, 1e2, 1e4, 1e6]))
def test_passes_its_points_with_continuous_acceleration(seed, count, ratio):
    rng = np.random.default_rng(seed)
    times, positions = uneven_times(rng, count, ratio), rng.normal(size=(count, 2))
    first, last = rng.normal(size=(2, 2))
    for curve in (
        natural(times, positions),
        clamped(times, positions, first, last),
        not_a_knot(times, positions),
    ):
        assert_through(curve, times, positions, 2)


@pytest.mark.parametrize(("ratio", "values", "rows"), [(1.0, 20_000, 3333), (1e4, 1 << 19, 1 << 15)])
def test_ten_thousand_points(ratio, values, rows, monkeypatch):
    """Solved for some components after the others and made some after the others, or all at once."""
    monkeypatch.setattr("trajcli.curves.splines.cubic._VALUES", values)
    monkeypatch.setattr("trajcli.curves.splines.cubic._ROWS", rows)
    rng = np.random.default_rng(7)
    times, zero = uneven_times(rng, 10_000, ratio), np.zeros(6)
    both = (rng.normal(size=(10_000, 6)), np.sin(times[:, None] * 0.3 + np.arange(6)))
    for positions in few(both[:: 1 if ratio > 1 else -1], 1):
        curves = (
            natural(times, positions),
            clamped(times, positions, zero, zero),
            not_a_knot(times, positions),
            continuous_acceleration(times, positions, np.ones((2, 6)), np.ones((2, 6))),
        )
        for curve in curves:
            assert_through(curve, times, positions, 2)


def test_components_that_are_solved_in_parts_keep_their_own_ends(monkeypatch):
    """Also where not even one component is within what is solved together."""
    rng = np.random.default_rng(8)
    times, positions = uneven_times(rng, 9, 10.0), rng.normal(size=(9, 5))
    ends, rates = rng.normal(size=(2, 2, 5))
    t = np.linspace(times[0], times[-1], 100)
    expected = CubicSpline(times, positions, bc_type=tuple((1, end) for end in ends))
    whole = continuous_acceleration(times, positions, ends, rates)
    for values in (20, 5):
        monkeypatch.setattr("trajcli.curves.splines.cubic._VALUES", values)
        np.testing.assert_allclose(clamped(times, positions, *ends).evaluate(t), expected(t), atol=1e-12)
        part = continuous_acceleration(times, positions, ends, rates)
        np.testing.assert_array_equal(part.coefficients, whole.coefficients)
        for order, wanted in ((1, ends), (2, rates)):
            np.testing.assert_allclose(part.evaluate(times[[0, -1]], order, side="left"), wanted, atol=1e-11)


def test_slow_changes_of_a_fast_motion_stay_continuous():
    """At a constant velocity with hardly any acceleration, rounding of velocities must not become jumps."""
    rng = np.random.default_rng(9)
    times = uneven_times(rng, 300, 1e4)
    positions = (3.0 + times + 1e-9 * np.sin(times))[:, None]
    for curve in (natural(times, positions), not_a_knot(times, positions)):
        assert jump(curve, 2) < 1e-14


def test_ends():
    rng = np.random.default_rng(4)
    times, positions = uneven_times(rng, 9, 20.0), rng.normal(size=(9, 2))
    curve = natural(times, positions)
    np.testing.assert_array_equal(curve.evaluate(times[0], 2), 0)
    np.testing.assert_allclose(curve.evaluate(times[-1], 2, side="left"), 0, atol=1e-12)
    first, last = rng.normal(size=(2, 2))
    for curve in (clamped(times, positions, first, last), not_a_knot(times, positions, first, last)):
        np.testing.assert_array_equal(curve.evaluate(times[0], 1), first)
        np.testing.assert_allclose(curve.evaluate(times[-1], 1, side="left"), last, atol=1e-13)
    third = not_a_knot(times, positions).piece_ends(3)[0]
    np.testing.assert_allclose(third[[1, -1]], third[[0, -2]], rtol=1e-10)


def test_few_points():
    line = not_a_knot([1.0, 3.0], [[1.0], [5.0]])
    np.testing.assert_array_equal(line.coefficients[:, 0, 0], [0, 0, 2, 1])
    np.testing.assert_array_equal(natural([1.0, 3.0], [[1.0], [5.0]]).coefficients[:, 0, 0], [0, 0, 2, 1])
    times = np.array([0.0, 1.0, 4.0])
    parabola = not_a_knot(times, (2 * times**2 - times + 3)[:, None])
    np.testing.assert_allclose(parabola.coefficients[:, :, 0].T, [[0, 2, -1, 3], [0, 2, 3, 4]], atol=1e-14)


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_cubics_come_back(degree):
    """A not-a-knot spline through the points of one cubic is that cubic."""
    rng = np.random.default_rng(degree)
    polynomial = np.polynomial.Polynomial(rng.normal(size=degree + 1))
    times = uneven_times(rng, 12, 30.0) / 4
    curve = not_a_knot(times, polynomial(times)[:, None])
    t = np.linspace(times[0], times[-1], 200)
    for order in range(4):
        expected = polynomial.deriv(order)(t) if order else polynomial(t)
        np.testing.assert_allclose(
            curve.evaluate(t, order)[:, 0], expected, atol=1e-9 * np.abs(expected).max() + 1e-9
        )


def test_points_at_rest_stay_at_rest():
    curve = natural(np.arange(5.0), np.full((5, 1), 0.1))
    assert not curve.coefficients[:-1].any()


def test_order_of_components_and_memory_change_no_bit():
    rng = np.random.default_rng(6)
    times, positions = uneven_times(rng, 50, 100.0), rng.normal(size=(50, 6))
    one = not_a_knot(times, positions).coefficients
    other = not_a_knot(times, np.asfortranarray(positions[:, ::-1])).coefficients
    np.testing.assert_array_equal(one, other[:, :, ::-1])
    np.testing.assert_array_equal(one[:, :, :1], not_a_knot(times, positions[:, :1]).coefficients)


def test_memory_grows_with_the_points_and_not_faster():
    def peak(count):
        times, positions = np.arange(float(count)), np.ones((count, 1)) * np.arange(count)[:, None] % 7
        tracemalloc.start()
        not_a_knot(times, positions)
        continuous_acceleration(times, positions, [[0.0]] * 2, [[0.0]] * 2)
        most = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return most

    peak(500)
    assert peak(8000) < 2.5 * peak(4000)


@pytest.mark.parametrize(
    ("times", "positions", "said"),
    [
        ([0.0, 1.0, 1.0], np.zeros((3, 1)), "waypoint 2 is at 1.0, waypoint 1 before it at 1.0"),
        ([0.0, 2.0, 1.0, 0.5], np.zeros((4, 1)), "waypoint 2 is at 1.0, waypoint 1 before it at 2.0"),
        ([0.0], np.zeros((1, 1)), "at least 2 points"),
        ([0.0, 1.0], np.zeros(2), "do not fit"),
        ([0.0, 1.0], np.zeros((3, 1)), "do not fit"),
        ([[0.0], [1.0]], np.zeros((2, 1)), "do not fit"),
        ([0.0, np.nan], np.zeros((2, 1)), "finite"),
        ([0.0, 1.0], [[0.0], [np.inf]], "finite"),
    ],
)
def test_waypoints_that_are_none(times, positions, said):
    for rule in (natural, not_a_knot):
        with pytest.raises(ValueError, match=said):
            rule(times, positions)


def test_end_velocities_that_do_not_fit():
    for bad in ([0.0], 0.0, [0.0, np.nan], np.zeros((2, 2))):
        with pytest.raises(ValueError, match="last velocity must be 2 finite numbers"):
            natural([0.0, 1.0], np.zeros((2, 2)), None, bad)
        with pytest.raises(ValueError, match="first velocity must be 2 finite numbers"):
            not_a_knot([0.0, 1.0], np.zeros((2, 2)), bad)
