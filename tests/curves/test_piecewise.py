"""The curve type evaluated, against scipy's PPoly and the definition of its two sides."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import PPoly

from trajcli.curves.piecewise import (
    PiecewisePolynomial,
    concatenate,
    constant,
    distinct,
    increasing,
    numeric,
)
from trajcli.errors import InputError


def drawn(seed, pieces):
    """Return a curve with jumps at its breaks, so that the wrong side or piece shows."""
    rng = np.random.default_rng(seed)
    breaks = rng.normal() + np.cumsum(rng.uniform(0.01, 1.0, pieces + 1))
    return rng, PiecewisePolynomial(breaks, rng.normal(size=(5, pieces, 3)))


@settings(max_examples=60, deadline=None)
@given(
    st.integers(0, 2**32 - 1),
    st.sampled_from([1, 2, 7, 300, 6000]),
    st.sampled_from([0, 1, 5, 900, 9000]),
    st.sampled_from(["sorted", "shuffled", "reversed", "doubled"]),
)
def test_values_of_all_orders_are_those_of_scipy(seed, pieces, rows, order):
    rng, curve = drawn(seed, pieces)
    t = np.sort(rng.uniform(curve.start, curve.end, rows))
    t = {"sorted": t, "shuffled": rng.permutation(t), "reversed": t[::-1], "doubled": np.repeat(t, 2)}[order]
    found = curve.evaluate_orders(np.ascontiguousarray(t), (2, 0, 1, 6))
    peer = PPoly(curve.coefficients, curve.breaks)
    for k, derivative in enumerate((2, 0, 1)):
        np.testing.assert_allclose(found[:, k], peer(t, derivative), rtol=1e-9, atol=1e-9)
    assert not found[:, 3].any()


@pytest.mark.parametrize("pieces", [1, 2, 40])
@pytest.mark.parametrize("among", [0, 5000])
def test_at_a_break_the_side_says_whose_value_it_is(pieces, among):
    """The right side is the last coefficient; the left one the piece before at its whole length."""
    rng, curve = drawn(3, pieces)
    t = np.concatenate([curve.breaks, rng.uniform(curve.start, curve.end, among)])
    right, left = curve.coefficients[-1], np.empty((pieces, 3))
    for k, length in enumerate(np.diff(curve.breaks)):
        left[k] = np.array([np.polyval(curve.coefficients[:, k, j], length) for j in range(3)])
    for order in (np.arange(t.size), np.argsort(t), rng.permutation(t.size)):
        back = np.argsort(order)[: pieces + 1]
        from_right = curve.evaluate(t[order], side="right")[back]
        from_left = curve.evaluate(t[order], side="left")[back]
        np.testing.assert_allclose(from_right, np.concatenate([right, left[-1:]]), rtol=1e-11, atol=1e-12)
        np.testing.assert_allclose(from_left, np.concatenate([right[:1], left]), rtol=1e-11, atol=1e-12)


@pytest.mark.parametrize("wrong", [-0.1, 3.1, np.nan, np.inf, -np.inf])
def test_a_time_outside_is_refused_wherever_it_stands(wrong):
    curve = PiecewisePolynomial([0.0, 1.0, 3.0], np.ones((2, 2, 1)))
    for place in (0, 2, 5):
        with pytest.raises(ValueError, match=r"outside the curve's domain \[0.0, 3.0\]"):
            curve.evaluate(np.insert(np.linspace(0, 3, 5), place, wrong))


@pytest.mark.parametrize("scale", [1e-12, 1.0, 5e11])
def test_a_time_that_only_rounding_has_outside_is_the_border(scale):
    """As the sum of its parts may be: at each magnitude the next numbers beyond both ends."""
    curve = PiecewisePolynomial([-scale, 0.0, 3.0 * scale], np.array([[[2.0], [1.0]], [[0.0], [5.0]]]))
    beyond = np.nextafter([-scale, 3.0 * scale], [-np.inf, np.inf])
    np.testing.assert_array_equal(curve.evaluate(beyond), curve.evaluate([-scale, 3.0 * scale]))
    for far in (3.0 * scale + 16 * np.spacing(3.0 * scale), -scale - 64 * np.spacing(scale)):
        with pytest.raises(ValueError, match="outside the curve's domain"):
            curve.evaluate(far)


def test_joined_curves_are_each_other_after_another():
    _, first = drawn(1, 3)
    _, second = drawn(2, 4)
    joined = concatenate([first, second])
    t = np.linspace(0, 1, 50)[1:-1]
    np.testing.assert_array_equal(
        joined.evaluate(first.start + t * first.duration), first.evaluate(first.start + t * first.duration)
    )
    np.testing.assert_allclose(
        joined.evaluate(first.end + t * second.duration),
        second.evaluate(second.start + t * second.duration),
        rtol=1e-9,
        atol=1e-9,
    )


def test_joined_curves_may_differ_in_degree_and_have_no_length():
    """t from 0 to 1, nothing, and (1 - t^2) from 2 on: what has no length leaves no piece."""
    line = PiecewisePolynomial([0.0, 1.0], np.array([1.0, 0.0])[:, None, None])
    bent = PiecewisePolynomial([2.0, 4.0], np.array([-1.0, 0.0, 1.0])[:, None, None])
    joined = concatenate([line, constant([7.0], 0.0), bent])
    assert joined.breaks.tolist() == [0.0, 1.0, 3.0]
    assert joined.evaluate([0.0, 0.5, 1.0, 2.0, 3.0])[:, 0].tolist() == [0.0, 0.5, 1.0, 0.0, -3.0]
    back = concatenate([bent, line])
    assert back.evaluate([2.0, 3.0, 4.0, 4.5])[:, 0].tolist() == [1.0, 0.0, 0.0, 0.5]
    assert concatenate([constant([1.0], 0.0), constant([2.0], 0.0)]).evaluate(0.0).tolist() == [1.0]


def test_a_curve_too_short_for_the_time_where_it_is_joined_keeps_a_piece():
    line, short = constant([1.0], 1.0), constant([2.0], 1e-20)
    joined = concatenate([line, short, line])
    assert joined.pieces == 3
    assert joined.breaks[:3].tolist() == [0.0, 1.0, np.nextafter(1.0, 2.0)]
    assert joined.end == pytest.approx(2.0, rel=1e-15)


def test_a_shifted_curve_is_later_and_the_same():
    _, curve = drawn(8, 5)
    later = curve.shifted(2.5)
    t = np.linspace(curve.start, curve.end, 30)[1:-1]
    np.testing.assert_allclose(later.evaluate(t + 2.5), curve.evaluate(t), rtol=1e-12, atol=1e-12)
    far = PiecewisePolynomial([0.0, 1e-20, 1.0], np.zeros((1, 2, 1))).shifted(3.0)
    assert far.breaks.tolist() == [3.0, np.nextafter(3.0, 4.0), 4.0]


@pytest.mark.parametrize("frozen", [False, True])
def test_a_curve_does_not_change_with_the_arrays_that_made_it(frozen):
    """Nor with one of which it was given a view that cannot be written to."""
    breaks, rows = np.array([0.0, 1.0, 2.0]), np.ones((1, 2, 1))
    given = [breaks[:], rows[:]] if frozen else [breaks, rows]
    for each in given:
        each.flags.writeable = not frozen
    curve = PiecewisePolynomial(*given)
    breaks[1], rows[:] = 1.5, 3.0
    assert curve.breaks.tolist() == [0.0, 1.0, 2.0]
    assert curve.evaluate(1.2).tolist() == [1.0]
    with pytest.raises(ValueError, match="read-only"):
        curve.breaks[0] = 5.0


@pytest.mark.parametrize("kind", [np.float32, np.int64])
def test_numbers_of_another_kind_are_kept_as_float64(kind):
    """0.1 of float32 is another number than that of float64, and all that follows is as exact as the latter."""
    breaks, rows = np.array([0, 1, 3], dtype=kind), np.full((2, 2, 1), 7, dtype=kind)
    for each in (breaks, rows):
        each.flags.writeable = False
    curve = PiecewisePolynomial(breaks, rows)
    assert (curve.breaks.dtype, curve.coefficients.dtype) == (np.float64, np.float64)
    assert curve.evaluate(0.1).tolist() == [7 * 0.1 + 7]
    assert curve.degree == 1


def test_breaks_stand_in_one_row():
    with pytest.raises(ValueError, match="do not fit"):
        PiecewisePolynomial(np.array([[0.0, 1.0, 2.0]]), np.ones((1, 2, 1)))


@pytest.mark.parametrize(
    ("pieces", "shape"), [(2, (1, 3, 1)), (2, (1, 1, 1)), (2, (2, 2)), (2, (1, 1, 2, 1)), (1, (2,))]
)
def test_coefficients_of_another_number_of_pieces_are_refused(pieces, shape):
    with pytest.raises(ValueError, match="do not fit"):
        PiecewisePolynomial(np.arange(pieces + 1.0), np.ones(shape))


def test_numbers_without_repeats_keep_those_that_differ_by_a_bit():
    one = np.nextafter(1.0, 2.0)
    assert distinct(np.array([3.0, 1.0, one, 1.0, 3.0, -2.0])).tolist() == [-2.0, 1.0, one, 3.0]
    assert distinct(np.empty(0)).size == 0


def test_breaks_that_rounding_made_equal_are_the_next_numbers():
    one = np.nextafter(1.0, 2.0)
    assert increasing(np.array([0.0, 1.0, 1.0, 1.0, 2.0])).tolist() == [
        0.0,
        1.0,
        one,
        np.nextafter(one, 2.0),
        2.0,
    ]
    assert increasing(np.array([1.0, 0.9])).tolist() == [1.0, one]


@pytest.mark.parametrize(
    ("breaks", "why"),
    [
        ([0.0, 1.0, 1.0], "strictly increase"),
        ([0.0, 2.0, 1.0], "strictly increase"),
        ([1.0, 0.0], "strictly increase"),
        ([0.0, np.nan, 1.0], "finite"),
        ([0.0, np.inf], "finite"),
        ([-np.inf, 0.0], "finite"),
    ],
)
def test_breaks_that_are_none_are_refused(breaks, why):
    with pytest.raises(ValueError, match=why):
        PiecewisePolynomial(breaks, np.zeros((2, len(breaks) - 1, 1)))
    assert PiecewisePolynomial([1.0, 1.0], np.zeros((2, 1, 1))).duration == 0.0


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("place", [(0, 0, 0), (1, 1, 1)])
def test_coefficients_that_are_no_numbers_are_refused(place, wrong):
    rows = np.zeros((2, 2, 2))
    rows[place] = wrong
    with pytest.raises(ValueError, match="finite"):
        PiecewisePolynomial([0.0, 1.0, 2.0], rows)


def test_the_border_of_a_curve_that_ends_at_zero_is_as_wide_as_at_its_start():
    """It begins at -1e6: times there are rounded by 1e-10, and those at its end are as uncertain."""
    curve = PiecewisePolynomial([-1e6, 0.0], np.array([1.0, 0.0])[:, None, None])
    assert curve.evaluate([-1e6 - 2e-10, 2e-10])[:, 0].tolist() == [0.0, 1e6]
    with pytest.raises(ValueError, match="outside"):
        curve.evaluate([1e-8])


@pytest.mark.parametrize("side", ["left", "right"])
def test_many_rows_of_many_pieces_are_all_there(side, monkeypatch):
    monkeypatch.setattr("trajcli.curves.piecewise._ROWS", 16)
    _, curve = drawn(4, 40)
    t = np.sort(np.concatenate([np.linspace(curve.start, curve.end, 50), curve.breaks[1:-1]]))
    rows = curve.evaluate(t, 1, side=side)
    one_by_one = np.array([curve.evaluate(each, 1, side=side) for each in t])
    np.testing.assert_allclose(rows, one_by_one, rtol=1e-12, atol=1e-12)


def test_ends_of_pieces_are_what_either_side_of_a_break_says():
    _, curve = drawn(6, 5)
    for order in range(4):
        begins, ends = curve.piece_ends(order)
        np.testing.assert_allclose(begins, curve.evaluate(curve.breaks[:-1], order, side="right"), rtol=1e-12)
        np.testing.assert_allclose(ends, curve.evaluate(curve.breaks[1:], order, side="left"), rtol=1e-9)
        for some in (slice(2, 4), slice(3, None), slice(None, 1)):
            np.testing.assert_allclose(curve.piece_ends(order, some), [begins[some], ends[some]], rtol=1e-12)


@pytest.mark.parametrize("count", [7, 8, 9, 13])
def test_many_times_on_many_pieces_have_a_row_each(count, monkeypatch):
    """Four at a time, the last of which stand alone where there is one more."""
    monkeypatch.setattr("trajcli.curves.piecewise._ROWS", 4)
    rows = np.random.default_rng(count).normal(size=(3, 6, 2))
    curve = PiecewisePolynomial(np.arange(7.0), rows)
    t = np.linspace(0.1, 5.9, count)
    wanted = [[np.polyval(rows[:, int(x), joint], x - int(x)) for joint in range(2)] for x in t]
    np.testing.assert_allclose(curve.evaluate(t), wanted, rtol=1e-12, atol=1e-12)


def test_real_numbers_of_any_type_are_numbers():
    for given_one in ([1, 2], [0.5, 2], np.array([1, 2], np.float32), np.array([1, 2], np.uint8)):
        assert numeric(given_one, "q").tolist() == list(given_one)
    assert numeric(np.float32(0.5), "q").dtype == np.float32


@pytest.mark.parametrize("wrong", ["1", [True, False], [1j, 0], [None, 1], [[1, 2], [3]], {"a": 1}])
def test_what_is_no_array_of_numbers_is_refused(wrong):
    with pytest.raises(InputError, match="joints: expected an array of numbers, got "):
        numeric(wrong, "joints")
