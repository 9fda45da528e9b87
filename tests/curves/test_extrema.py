"""Extremes against dense sampling with local refinement, closed forms, and roots found by another method."""

from __future__ import annotations

import tracemalloc
from itertools import pairwise

import numpy as np
import pytest
from hermite_curves import hermite_pieces
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.polynomial import Polynomial
from scipy.interpolate import PPoly
from scipy.optimize import brentq, minimize_scalar

from trajcli.curves.extrema import peaks, peaks_between, piece_extremes
from trajcli.curves.piecewise import PiecewisePolynomial, constant, taylor_shift

ORDERS = (0, 1, 2, 3)


def sampled_extremes(coefficients: np.ndarray, length: float, order: int) -> tuple[float, float]:
    """Return low and high of one polynomial's derivative: samples, and a search around the best of them."""
    polynomial = np.polyder(np.poly1d(coefficients), order) if order else np.poly1d(coefficients)
    t = np.linspace(0.0, length, 150)
    found = []
    for sign in (1.0, -1.0):
        values = sign * polynomial(t)
        best = values.min()
        around = np.concatenate([[np.inf], values, [np.inf]])
        valleys = np.flatnonzero((values <= around[:-2]) & (values <= around[2:]))
        for k in sorted(valleys, key=lambda k: values[k])[:3]:
            search = minimize_scalar(
                lambda x, sign=sign: sign * polynomial(x),
                bounds=(t[max(k - 1, 0)], t[min(k + 1, t.size - 1)]),
                method="bounded",
                options={"xatol": 1e-9 * length},
            )
            best = min(best, search.fun)
        found.append(sign * best)
    return found[0], found[1]


def rounding(coefficients: np.ndarray, length: float, order: int) -> float:
    """Return how far two correct evaluations of the derivative may lie apart."""
    sizes = np.polyder(np.poly1d(np.abs(coefficients)), order) if order else np.poly1d(np.abs(coefficients))
    return 1e-13 * float(sizes(length)) + 1e-300


def assert_extremes(curve: PiecewisePolynomial) -> None:
    found = peaks(curve)
    for order in ORDERS:
        for joint in range(curve.dimension):
            pieces = [(curve.coefficients[:, k, joint], float(curve.lengths[k])) for k in range(curve.pieces)]
            sampled = [sampled_extremes(c, h, order) for c, h in pieces]
            low, high = min(s[0] for s in sampled), max(s[1] for s in sampled)
            exact = max(rounding(c, h, order) for c, h in pieces)
            search = exact + 1e-9 * (high - low)
            assert high - exact <= found[order].high[joint] <= high + search
            assert low - search <= found[order].low[joint] <= low + exact
            for value, at in (
                (found[order].low[joint], found[order].low_time[joint]),
                (found[order].high[joint], found[order].high_time[joint]),
            ):
                sides = [curve.evaluate(at, order, side=side)[joint] for side in ("left", "right")]
                step = np.spacing(np.abs(curve.breaks).max()) * max(
                    np.abs(curve.evaluate(at, order + 1, side=s)[joint]) for s in ("left", "right")
                )
                near = exact + 4 * step + 2e-12 * max(abs(low), abs(high))
                assert min(abs(side - value) for side in sides) <= near


@st.composite
def curves(draw) -> PiecewisePolynomial:
    degree = draw(st.integers(0, 9))
    pieces, joints = draw(st.integers(1, 3)), draw(st.integers(1, 2))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    lengths = 10.0 ** rng.uniform(-6, 4) * rng.uniform(0.2, 1.0, pieces)
    normal = rng.normal(size=(degree + 1, pieces, joints))
    if draw(st.booleans()):
        normal = np.rint(2 * normal)
    for row in range(draw(st.integers(0, degree))):
        normal[row] = 0.0
    if draw(st.booleans()):
        normal[:-1, :, 0] = 0.0
    powers = lengths ** np.arange(degree, -1, -1)[:, None]
    start = draw(st.sampled_from([0.0, 3.0, -1.5]))
    breaks = start + np.concatenate([[0.0], np.cumsum(lengths)])
    return PiecewisePolynomial(breaks, normal / powers[:, :, None])


@settings(max_examples=60, deadline=None)
@given(curves())
def test_extremes_are_those_of_a_refined_search(curve: PiecewisePolynomial) -> None:
    assert_extremes(curve)


@settings(max_examples=40, deadline=None)
@given(
    st.lists(st.sampled_from([-0.5, 0.0, 0.1, 0.25, 0.5, 0.5000001, 0.9, 1.0, 1.5]), min_size=1, max_size=8),
    st.sampled_from([1e-6, 0.3, 1.0, 2e4]),
)
def test_multiple_and_close_roots_of_the_velocity(roots: list[float], length: float) -> None:
    rate = Polynomial.fromroots(roots)
    position = rate.integ().coef[::-1]
    powers = length ** np.arange(position.size - 1, -1, -1)
    curve = PiecewisePolynomial(np.array([0.0, length]), (position / powers)[:, None, None])
    assert_extremes(curve)
    ends = [u for u in roots if 0 <= u <= 1] + [0.0, 1.0]
    values = [rate.integ()(u) for u in ends]
    exact = rounding(position, 1.0, 0)
    assert peaks(curve, (0,))[0].high[0] == pytest.approx(max(values), abs=exact)
    assert peaks(curve, (0,))[0].low[0] == pytest.approx(min(values), abs=exact)


@pytest.mark.parametrize(
    ("conditions", "order", "peak"),
    [
        (2, 1, 1.5),
        (2, 2, 6.0),
        (3, 1, 1.875),
        (3, 2, 10 / np.sqrt(3)),
        (3, 3, 60.0),
        (4, 1, 2.1875),
        (4, 2, 84 * np.sqrt(5) / 25),
    ],
)
@pytest.mark.parametrize("duration", [1e-3, 2.5, 4000.0])
def test_rest_to_rest_polynomials_have_the_peaks_of_the_books(
    conditions: int, order: int, peak: float, duration: float
) -> None:
    displacement = np.array([1.7, -0.4, 0.0])
    ends = np.zeros((conditions, 2, 3))
    ends[0] = np.array([np.full(3, 2.0), 2.0 + displacement])
    found = peaks(hermite_pieces([0.0, duration], ends))[order]
    expected = peak * np.abs(displacement) / duration**order
    assert found.magnitude == pytest.approx(expected, rel=1e-13)
    assert found.high_time[2] == 0.0
    assert found.low_time[2] == 0.0
    if order == 1:
        assert found.high[0] == pytest.approx(expected[0], rel=1e-13)
        assert found.high_time[0] == pytest.approx(duration / 2, rel=1e-7)
        assert found.low[1] == pytest.approx(-expected[1], rel=1e-13)


def test_the_slides_third_example_overshoots_its_target() -> None:
    position = Polynomial([10, 0, 5, 12.5, -5.625, 0.625])
    assert position(4.0) == 90.0
    top = brentq(position.deriv(), 2.0, 3.99, xtol=1e-15, rtol=1e-15)
    assert position(top) > 90.0
    curve = PiecewisePolynomial(np.array([0.0, 4.0]), position.coef[::-1][:, None, None])
    found = peaks(curve, (0,))[0]
    assert found.high[0] == pytest.approx(position(top), rel=1e-15)
    assert found.high_time[0] == pytest.approx(top, rel=1e-9)
    assert (found.low[0], found.low_time[0]) == (10.0, 0.0)


def test_both_sides_of_a_break_count() -> None:
    curve = PiecewisePolynomial(np.array([0.0, 1.0, 2.0]), np.array([[[1.0], [-1.0]], [[0.0], [-5.0]]]))
    low, high = peaks(curve, (0,))[0].low, peaks(curve, (0,))[0].high
    assert (low[0], high[0]) == (-6.0, 1.0)
    assert peaks(curve, (0,))[0].high_time[0] == 1.0
    assert peaks(curve, (0,))[0].low_time[0] == 2.0


def test_of_equal_peaks_the_earliest_is_named() -> None:
    wave = (
        np.array([[[16.0]] * 4, [[-16.0]] * 4, [[0.0]] * 4])
        * np.array([1, 1 + 2e-16, 1 - 2e-16, 1 + 4e-16])[:, None]
    )
    curve = PiecewisePolynomial(np.array([5.0, 6.0, 7.0, 8.0, 9.0]), wave)
    found = peaks(curve, (0, 1))
    assert found[0].low[0] == pytest.approx(-4.0)
    assert found[0].low_time[0] == 5.5
    assert found[0].high_time[0] == 5.0
    assert found[1].high_time[0] == 6.0


def test_an_interval_inside_pieces_sees_nothing_outside_of_it() -> None:
    rng = np.random.default_rng(5)
    curve = PiecewisePolynomial(np.array([0.0, 1.0, 1.5, 3.0, 4.0]), rng.normal(size=(6, 4, 3)))
    intervals = [(0.2, 0.4), (0.2, 3.1), (1.0, 1.5), (1.4, 1.6), (0.0, 4.0), (2.0, 2.0)]
    for (start, end), found in zip(intervals, peaks_between(curve, intervals), strict=True):
        cut = curve_between(curve, start, end)
        for of_interval, alone, again in zip(
            found, peaks(cut), peaks(curve, ORDERS, start, end), strict=True
        ):
            assert of_interval.low == pytest.approx(alone.low, rel=1e-12, abs=1e-12)
            assert of_interval.high == pytest.approx(alone.high, rel=1e-12, abs=1e-12)
            assert (of_interval.high == again.high).all()
            assert (of_interval.high_time >= start).all()
            assert (of_interval.high_time <= end).all()
        assert_extremes(cut)


def curve_between(curve: PiecewisePolynomial, start: float, end: float) -> PiecewisePolynomial:
    """Cut by shifting each polynomial to where its stretch begins."""
    inner = [b for b in curve.breaks if start < b < end]
    breaks = np.array([start, *inner, end])
    pieces = []
    for low, high in pairwise(breaks):
        k = min(int(np.searchsorted(curve.breaks, (low + high) / 2, "right")) - 1, curve.pieces - 1)
        pieces.append(taylor_shift(curve.coefficients[:, k], np.array(low - curve.breaks[k])))
    return PiecewisePolynomial(breaks, np.stack(pieces, axis=1))


def test_at_a_break_an_interval_sees_its_own_side_only() -> None:
    curve = PiecewisePolynomial(
        np.array([0.0, 1.0, 2.0]),
        np.array(
            [
                [
                    [1.0],
                    [2.0],
                ]
            ]
        ),
    )
    first, second, none = peaks_between(curve, [(0.0, 1.0), (1.0, 2.0), (1.0, 1.0)], (0,))
    assert (first[0].low[0], first[0].high[0]) == (1.0, 1.0)
    assert (second[0].low[0], second[0].high[0]) == (2.0, 2.0)
    assert (none[0].low[0], none[0].high[0], none[0].high_time[0]) == (2.0, 2.0, 1.0)


def test_a_curve_of_no_length() -> None:
    found = peaks(constant([1.0, -2.0], 0.0))
    assert found[0].high.tolist() == [1.0, -2.0]
    assert found[0].low_time.tolist() == [0.0, 0.0]
    assert [f.magnitude.tolist() for f in found[1:]] == [[0.0, 0.0]] * 3
    moving = peaks(PiecewisePolynomial(np.array([2.0, 2.0]), np.array([[[5.0]], [[3.0]], [[1.0]]])))
    assert [f.high[0] for f in moving] == [1.0, 3.0, 10.0, 0.0]


@pytest.mark.parametrize("interval", [(-0.1, 1.0), (0.0, 1.1), (0.6, 0.5), (float("nan"), 1.0)])
def test_an_interval_off_the_curve_is_refused(interval: tuple[float, float]) -> None:
    with pytest.raises(ValueError, match="outside the curve's domain"):
        peaks(constant([1.0], 1.0), ORDERS, *interval)


def test_pieces_that_are_no_curve_agree_with_scipys_roots() -> None:
    rng = np.random.default_rng(11)
    coefficients, lengths = rng.normal(size=(6, 40, 2)), rng.uniform(0.1, 3.0, 40)
    for order, (low, high) in zip(ORDERS, piece_extremes(coefficients, lengths), strict=True):
        for k in range(40):
            for joint in range(2):
                rate = PPoly(coefficients[:, k : k + 1, joint], [0.0, lengths[k]]).derivative(order)
                inner = rate.derivative().roots(extrapolate=False)
                values = rate(np.concatenate([[0.0, lengths[k]], inner]))
                assert low[k, joint] == pytest.approx(values.min(), rel=1e-9, abs=1e-9)
                assert high[k, joint] == pytest.approx(values.max(), rel=1e-9, abs=1e-9)


@pytest.mark.parametrize(("degree", "together"), [(1, 50), (3, 32_768), (3, 7), (6, 50), (9, 32_768)])
def test_many_pieces_agree_with_scipys_roots(
    degree: int, together: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of many pieces only some can hold a peak: each interval has its own, wherever it lies."""
    monkeypatch.setattr("trajcli.curves.extrema._PARTS", together)
    rng = np.random.default_rng(degree)
    breaks = np.cumsum(rng.uniform(0.5, 1.5, 201))
    coefficients = rng.normal(size=(degree + 1, 200, 2))
    for piece, length in enumerate(np.diff(breaks)):
        for joint in range(2 if degree > 1 else 0):  # the same at both ends: what is large lies between
            bump = np.polymul([-1.0, length, 0.0], coefficients[2:, piece, joint])
            coefficients[:-1, piece, joint] = np.pad(bump, (degree + 1 - bump.size, 0))[:-1]
    curve = PiecewisePolynomial(breaks, coefficients)
    intervals = [
        (breaks[0], breaks[-1]),
        (breaks[3] + 0.2, breaks[90] + 0.1),
        (breaks[91], breaks[200] - 0.3),
    ]
    for (start, end), found in zip(intervals, peaks_between(curve, intervals), strict=True):
        for order, of_order in zip(ORDERS, found, strict=True):
            for joint in range(2):
                polynomial = PPoly(curve.coefficients[:, :, joint], breaks).derivative(order)
                roots = polynomial.derivative().roots(extrapolate=False)
                inner = np.concatenate([roots[np.isfinite(roots)], breaks])
                at = np.concatenate([inner[(inner >= start) & (inner <= end)], [start, end]])
                values = [curve.evaluate(at, order, side=side)[:, joint] for side in ("left", "right")]
                values[0][at == start] = values[1][at == start]  # only the piece inside counts
                values[1][at == end] = values[0][at == end]
                rounding = 1e-9 * np.abs(values).max() + 1e-12
                assert of_order.low[joint] == pytest.approx(np.min(values), abs=rounding)
                assert of_order.high[joint] == pytest.approx(np.max(values), abs=rounding)
                for peak, time in ((of_order.low, of_order.low_time), (of_order.high, of_order.high_time)):
                    sides = [
                        curve.evaluate(time[joint], order, side=side)[joint] for side in ("left", "right")
                    ]
                    assert np.abs(np.array(sides) - peak[joint]).min() <= rounding


def test_coefficients_that_rounding_left_do_not_matter() -> None:
    clean = np.array([0.0, 0.0, -3.0, 3.0, 1.0])
    for noise in (1e-18, -1e-18, 1e-300, 5e-324):
        curve = PiecewisePolynomial(
            np.array([0.0, 1.0]), (clean + noise * np.array([1, -1, 0, 0, 0]))[:, None, None]
        )
        found = peaks(curve, (0, 1))
        assert found[0].high[0] == pytest.approx(1.75, rel=1e-15)
        assert found[0].high_time[0] == pytest.approx(0.5, rel=1e-9)
        assert (found[1].high[0], found[1].low[0]) == pytest.approx((3.0, -3.0))


def test_a_slope_that_is_next_to_nothing_does_not_overflow() -> None:
    curve = PiecewisePolynomial(np.array([0.0, 1.0]), np.array([0.0, 0.0, 0.0, 1e-310, 1e3])[:, None, None])
    assert [f.high[0] for f in peaks(curve)] == [1e3, 1e-310, 0.0, 0.0]


def test_a_peak_at_a_break_has_the_time_of_the_break() -> None:
    breaks = np.array([-3.0, -0.9, 0.2, 0.9])
    curve = PiecewisePolynomial(breaks, np.stack([np.ones((3, 1)), np.zeros((3, 1))]))
    assert (breaks[:-1] + np.diff(breaks) < breaks[1:]).any()
    for k, found in enumerate(peaks_between(curve, np.stack([breaks[:-1], breaks[1:]], axis=1), (0,))):
        assert (found[0].low_time[0], found[0].high_time[0]) == (breaks[k], breaks[k + 1])


def test_many_intervals_are_looked_at_in_blocks_and_need_little_memory() -> None:
    """A curve of 70000 pieces, an interval for each: twice the memory of what is returned at most."""
    pieces, rng = 70_000, np.random.default_rng(7)
    curve = PiecewisePolynomial(np.arange(pieces + 1.0), rng.normal(size=(4, pieces, 1)))
    intervals = np.column_stack([curve.breaks[:-1], curve.breaks[1:]])
    tracemalloc.start()
    try:
        found = peaks_between(curve, intervals, (0, 1))
        kept, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 6 * kept
    for k in (0, 32_767, 32_768, 65_536, pieces - 1):
        x = np.linspace(0, 1, 2001)
        values = np.polyval(curve.coefficients[:, k, 0], x)
        assert found[k][0].low[0] == pytest.approx(values.min(), abs=1e-5)
        assert found[k][0].high[0] == pytest.approx(values.max(), abs=1e-5)
        assert k <= found[k][0].high_time[0] <= k + 1


@pytest.mark.parametrize("bound", ["start", "end"])
def test_an_interval_may_begin_or_end_at_zero(bound: str) -> None:
    """The straight line x = t from -1 to 1: half of it, not the whole."""
    curve = PiecewisePolynomial(np.array([-1.0, 1.0]), np.array([1.0, -1.0])[:, None, None])
    (found,) = peaks(curve, (0,), **{bound: 0.0})
    assert (found.low[0], found.high[0]) == ((0.0, 1.0) if bound == "start" else (-1.0, 0.0))


def test_a_slice_of_intervals_has_those_that_it_names() -> None:
    curve = PiecewisePolynomial(np.arange(6.0), np.arange(5.0)[None, :, None])
    found = peaks_between(curve, [(k, k + 1.0) for k in range(5)], (0,))
    for chosen in (slice(1, None), slice(None, None, -2), slice(-2, None)):
        assert [each.high[0] for (each,) in found[chosen]] == list(range(5))[chosen]


@pytest.mark.parametrize("rise", [10.0, -10.0])
def test_each_of_many_intervals_has_its_own_level(rise: float) -> None:
    """On each step of a staircase a bump up beside what is lower by 2, and a bump down beside what is higher.

    The bump is 4 u (1 - u): all that is high on one step is low on the next, so that no other step tells.
    """
    count, signs = 50, np.array([1.0, -1.0])
    coefficients = np.zeros((3, count, 2, 2))  # two pieces for each step
    coefficients[-1] = rise * np.arange(count)[:, None, None]
    coefficients[-1, :, 1] -= 2.0 * signs
    coefficients[:, :, 0] += np.array([-4.0, 4.0, 0.0])[:, None, None] * signs
    curve = PiecewisePolynomial(np.arange(2 * count + 1.0), coefficients.reshape(3, -1, 2))
    found = peaks_between(curve, [(2.0 * k, 2.0 * k + 2.0) for k in range(count)], (0,))
    for k, (each,) in enumerate(found):
        np.testing.assert_allclose(each.low, rise * k + np.array([-2.0, -1.0]), atol=1e-9)
        np.testing.assert_allclose(each.high, rise * k + np.array([1.0, 2.0]), atol=1e-9)


@pytest.mark.parametrize("count", range(1, 10))
def test_what_is_cut_for_memory_has_its_last_part_too(count: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Parts looked at by four: the last one may stand alone, and is itself a part of a piece."""
    monkeypatch.setattr("trajcli.curves.extrema._PARTS", 4)
    curve = PiecewisePolynomial(np.arange(count + 1.0), np.array([[1.0] * count, range(count)])[:, :, None])
    (found,) = peaks(curve, (0,), 0.25, count - 0.5)
    assert (found.low[0], found.high[0]) == (0.25, count - 0.5)
    assert (found.low_time[0], found.high_time[0]) == (0.25, count - 0.5)


@pytest.mark.parametrize("size", [1e-200, 1e-100, 1e100])
def test_a_joint_has_its_peaks_whatever_the_size_of_the_others(size: float) -> None:
    """x^3 / 3 - x^2 / 2 + 0.16 x turns at 0.2 and at 0.8; beside it the same of another size."""
    cubic = np.array([1 / 3, -0.5, 0.16, 0.0])
    curve = PiecewisePolynomial(
        np.array([0.0, 1.0]), np.stack([cubic, size * cubic, -cubic], axis=1)[:, None]
    )
    (found,) = peaks(curve, (0,))
    low, high = np.polyval(cubic, [0.8, 0.2])
    np.testing.assert_allclose(found.high / [1.0, size, 1.0], [high, high, -low], rtol=1e-12)
    np.testing.assert_allclose(found.low / [1.0, size, 1.0], [low, low, -high], rtol=1e-12)
    np.testing.assert_allclose(found.high_time, [0.2, 0.2, 0.8], rtol=1e-9)
    np.testing.assert_allclose(found.low_time, [0.8, 0.8, 0.2], rtol=1e-9)


@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_of_many_pieces_each_order_is_looked_at_where_it_has_a_peak(order: int, sign: float) -> None:
    """In the middle of a hundred pieces a derivative goes from 0 to 1 and back, 16 u^2 (1 - u)^2.

    The lower ones are largest and smallest elsewhere: what there is of them in between is not looked at.
    """
    bump = Polynomial([0.0, 0.0, 16.0, -32.0, 16.0]).integ(order).coef[::-1]
    coefficients = np.zeros((5 + order, 100, 1))
    coefficients[:, 50, 0] = sign * bump
    for lower in range(order):
        coefficients[-1 - lower, 0], coefficients[-1 - lower, 99] = 1e3, -1e3
    found = peaks(PiecewisePolynomial(np.arange(101.0), coefficients), (0, 1, 2, 3))[order]
    values, times = (found.high, found.high_time) if sign > 0 else (found.low, found.low_time)
    assert values[0] == pytest.approx(sign, rel=1e-12)
    assert times[0] == pytest.approx(50.5, abs=1e-6)
