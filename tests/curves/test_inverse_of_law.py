"""When a law reaches values, against laws whose inverse is a formula."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from trajcli.curves.operations import times_at
from trajcli.curves.piecewise import PiecewisePolynomial


def law(breaks, *pieces):
    """Return a law from the coefficients of its pieces, highest power first, local."""
    return PiecewisePolynomial(np.array(breaks, dtype=float), np.array(pieces, dtype=float).T[:, :, None])


def test_a_square_and_a_line():
    """S = t^2 until 1, then 1 + 2 (t - 1): the times are a root, and a quotient."""
    curve = law([0, 1, 3], [1, 0, 0], [0, 2, 1])
    values = np.array([0, 1e-12, 0.25, 0.5, 1.0, 1.5, 5.0])
    expected = np.where(values <= 1, np.sqrt(values), 1 + (values - 1) / 2)
    np.testing.assert_allclose(times_at(curve, values), expected, rtol=1e-14, atol=1e-15)


def test_values_outside_are_taken_to_the_ends():
    curve = law([2, 4], [3, 1])
    np.testing.assert_array_equal(times_at(curve, np.array([-5.0, 1.0, 7.0, 99.0])), [2, 2, 4, 4])


def test_the_earliest_time_where_the_law_rests():
    """S rises to 1, rests for a second, rises to 2."""
    curve = law([0, 1, 2, 3], [1, 0], [0, 1], [1, 1])
    np.testing.assert_allclose(
        times_at(curve, np.array([0.5, 1.0, 1.0 + 1e-9, 1.5])), [0.5, 1.0, 2 + 1e-9, 2.5]
    )


def test_breaks_are_met_exactly():
    breaks = np.cumsum(np.random.default_rng(1).uniform(0.01, 2, 50))
    heights = np.cumsum(np.random.default_rng(2).uniform(0.01, 2, 50))
    slopes = np.diff(heights) / np.diff(breaks)
    curve = law(breaks, *zip(slopes, heights[:-1], strict=True))
    np.testing.assert_array_equal(times_at(curve, heights[:-1]), breaks[:-1])


@settings(max_examples=50)
@given(st.integers(0, 2**32 - 1))
def test_as_brentq(seed):
    """Monotone cubics: velocities at the ends of at most three times the slope."""
    rng = np.random.default_rng(seed)
    m = int(rng.integers(2, 7))
    breaks = np.concatenate([[0.0], np.cumsum(rng.uniform(0.1, 2, m - 1))])
    heights = np.concatenate([[0.0], np.cumsum(rng.uniform(0.0, 2, m - 1))])
    slopes = np.diff(heights) / np.diff(breaks)
    room = np.minimum(np.append(slopes, slopes[-1]), np.insert(slopes, 0, slopes[0]))
    speeds = 1.5 * rng.random(m) * room
    h, v, w = np.diff(breaks), speeds[:-1], speeds[1:]
    cubic = np.stack([(v + w - 2 * slopes) / h**2, (3 * slopes - 2 * v - w) / h, v, heights[:-1]])
    curve = PiecewisePolynomial(breaks, cubic[:, :, None])
    values = rng.uniform(0, heights[-1], 5)
    for value, time in zip(values, times_at(curve, values), strict=True):
        at = brentq(lambda t, value=value: curve.evaluate(t)[0] - value, 0, breaks[-1], xtol=1e-14)
        assert curve.evaluate(time)[0] == pytest.approx(value, abs=1e-12)
        assert time <= at + 1e-7 * max(1.0, breaks[-1])
