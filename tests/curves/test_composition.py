"""q(s(t)) as one curve, against evaluating one after the other."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import PPoly

from trajcli.curves.operations import compose
from trajcli.curves.piecewise import PiecewisePolynomial, constant


def chained(path, law, t):
    """Return q, qd, qdd of the chain rule, evaluated by scipy."""
    q, s = PPoly(path.coefficients, path.breaks), PPoly(law.coefficients[:, :, 0], law.breaks)
    at, sd, sdd = s(t), s(t, 1)[:, None], s(t, 2)[:, None]
    return q(at), q(at, 1) * sd, q(at, 2) * sd**2 + q(at, 1) * sdd


def inside(path, law, t):
    """Return the times that are not next to a break of either."""
    s = PPoly(law.coefficients[:, :, 0], law.breaks)(t)
    far = np.abs(t[:, None] - law.breaks).min(axis=1) > 1e-9
    return t[far & (np.abs(s[:, None] - path.breaks).min(axis=1) > 1e-9) & (s > path.start) & (s < path.end)]


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from([(1, 1), (3, 2), (5, 2), (3, 3), (2, 5), (10, 1), (1, 10)]))
def test_composed_is_chained(seed, degrees):
    """The law swings to and fro: it passes breaks of the path several times, or turns before them."""
    rng = np.random.default_rng(seed)
    law = PiecewisePolynomial(np.cumsum(rng.uniform(0.1, 1, 4)), rng.normal(size=(degrees[1] + 1, 3, 1)))
    t = rng.uniform(law.start, law.end, 300)
    s = PPoly(law.coefficients[:, :, 0], law.breaks)(np.linspace(law.start, law.end, 4001))
    ends = s.min() - 1.0, s.max() + 1.0
    breaks = np.concatenate([[ends[0]], np.sort(rng.uniform(*ends, 4)), [ends[1]]])
    path = PiecewisePolynomial(breaks, rng.normal(size=(degrees[0] + 1, 5, 2)))
    found = compose(path, law)
    assert found.degree == degrees[0] * degrees[1]
    assert np.isin(law.breaks, found.breaks).all()
    t = inside(path, law, t)
    for order, expected in enumerate(chained(path, law, t)):
        size = np.abs(expected).max() + 1.0
        np.testing.assert_allclose(found.evaluate(t, order), expected, rtol=1e-9, atol=1e-9 * size)


def test_every_passing_of_a_break_becomes_a_break():
    path = PiecewisePolynomial([0.0, 1.0, 2.0, 4.0], np.ones((2, 3, 1)))
    law = PiecewisePolynomial(
        [0.0, 4.0], np.array([-1.0, 4.0, 0.0])[:, None, None]
    )  # 4 t - t^2: up to 4 and back
    found = compose(path, law)
    expected = [0.0, 2 - np.sqrt(3), 2 - np.sqrt(2), 2 + np.sqrt(2), 2 + np.sqrt(3), 4.0]
    np.testing.assert_allclose(found.breaks, expected, atol=1e-14)


def test_each_piece_of_a_law_passes_its_own_breaks():
    """A path with a corner at 1 and at 2; each of the two pieces of the law passes one of them in its middle."""
    slopes, places = np.array([1.0, -2.0, 5.0]), np.array([0.0, 1.0, -1.0])
    path = PiecewisePolynomial([0.0, 1.0, 2.0, 3.0], np.stack([slopes, places])[:, :, None])
    law = PiecewisePolynomial([0.0, 0.75, 1.5], np.array([[2.0, 2.0], [0.0, 1.5]])[:, :, None])
    found = compose(path, law)
    np.testing.assert_allclose(found.breaks, [0.0, 0.5, 0.75, 1.0, 1.5], atol=1e-15)
    t = np.linspace(0.0, 1.5, 31)
    np.testing.assert_allclose(found.evaluate(t), path.evaluate(np.minimum(2.0 * t, 3.0)), atol=1e-14)


def test_breaks_that_meet_up_to_rounding_stay_one():
    places = np.array([0.0, 0.1, 0.2, 0.30000000000000004, 1.0])
    path = PiecewisePolynomial(places, np.ones((3, 4, 1)))
    times = places / 3
    law = PiecewisePolynomial(times, np.stack([np.full(4, 3.0), places[:-1]])[:, :, None])
    assert compose(path, law).breaks.tolist() == times.tolist()


def test_no_sliver_where_a_fast_law_passes_a_break_next_to_its_own():
    path = PiecewisePolynomial([0.0, 1.0 + 1.2e-9, 1e6 + 1.0], np.ones((2, 2, 1)))
    law = PiecewisePolynomial([0.0, 1.0, 2.0], np.array([[1.0, 1e6], [0.0, 1.0]])[:, :, None])
    assert compose(path, law).breaks.tolist() == [0.0, 1.0, 2.0]


def test_a_law_that_rests_or_has_no_length():
    path = PiecewisePolynomial([0.0, 1.0, 2.0], np.arange(8.0).reshape(2, 2, 2))
    rest = compose(path, constant([1.5], 2.0))
    np.testing.assert_allclose(rest.evaluate(1.0), path.evaluate(1.5))
    assert compose(path, constant([1.5], 0.0)).duration == 0


def test_what_cannot_be_composed_is_named():
    path = PiecewisePolynomial([0.0, 1.0], np.ones((6, 1, 1)))
    law = PiecewisePolynomial([0.0, 1.0], np.array([0.0, 0.0, 1.0, 0.0])[:, None, None])
    with pytest.raises(ValueError, match="at most 10"):
        compose(path, law)
    with pytest.raises(ValueError, match="dimension 2: dimension 1 and a product"):
        compose(path, constant([0.5, 0.5], 1.0))
    with pytest.raises(ValueError, match=r"the law runs from 0\.0 to 1\.5"):
        compose(path, PiecewisePolynomial([0.0, 1.5], np.array([1.0, 0.0])[:, None, None]))


@pytest.mark.parametrize("ends", [(1.0, 0.0), (0.0, 1.0), (1.0, 2.0), (2.0, 1.0)])
def test_a_law_that_begins_or_ends_at_a_break_is_on_its_own_side_of_it(ends):
    path = PiecewisePolynomial([0.0, 1.0, 2.0], np.array([[1.0, -3.0], [0.0, 1.0]])[:, :, None])
    law = PiecewisePolynomial([0.0, 1.0], np.array([ends[1] - ends[0], ends[0]])[:, None, None])
    t = np.linspace(0.05, 0.95, 7)
    expected = np.interp(ends[0] + (ends[1] - ends[0]) * t, [0, 1, 2], [0, 1, -2])
    np.testing.assert_allclose(compose(path, law).evaluate(t)[:, 0], expected, rtol=0, atol=1e-14)


@pytest.mark.parametrize(("beyond", "fits"), [(1e-12, True), (1e-7, False), (-1e-12, True), (-1e-7, False)])
def test_a_law_may_leave_the_path_by_rounding_alone(beyond, fits):
    path = PiecewisePolynomial([0.0, 1.0], np.ones((2, 1, 1)))
    first, last = min(beyond, 0.0), 1.0 + max(beyond, 0.0)
    law = PiecewisePolynomial([0.0, 1.0], np.array([last - first, first])[:, None, None])
    if fits:
        assert compose(path, law).end == 1.0
        return
    with pytest.raises(ValueError, match="the law runs from"):
        compose(path, law)
