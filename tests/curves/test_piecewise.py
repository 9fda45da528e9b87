"""The curve type evaluated, against scipy's PPoly and the definition of its two sides."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import PPoly

from trajcli.curves.piecewise import PiecewisePolynomial, concatenate


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
    with pytest.raises(ValueError, match="outside the curve's domain"):
        curve.evaluate(3.0 * scale * (1 + 1e-14))


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
