"""Grids of time stamps against stamps that were made on a known grid, and against none."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from trajcli.streams.recorded.stamp_period import PeriodFit


def fit_period(blocks, rounding, relative=0.0):
    """Return the grid of stamps (N,), or of blocks of them."""
    fit = PeriodFit()
    for block in [blocks] if isinstance(blocks, np.ndarray) else blocks:
        fit.add(block)
    return fit.result(rounding, relative)


@settings(max_examples=200, deadline=None)
@given(
    period=st.sampled_from([1 / 24, 1 / 30, 1 / 60, 0.001, 0.002, 0.008, 1 / 7, 1 / 29.97, 0.0125]),
    decimals=st.sampled_from([4, 6, 9]),
    count=st.integers(3, 3000),
    start=st.sampled_from([0.0, 0.0, 12.5, 1000.123456]),
    size=st.integers(1, 1000),
)
def test_rounded_stamps_lie_on_their_grid(period, decimals, count, start, size):
    half = 0.5 * 10.0**-decimals
    exact = start + np.arange(count) * period
    stamps = np.round(exact, decimals)
    blocks = [stamps[low : low + size] for low in range(0, count, size)]
    found = fit_period(blocks, half)
    if period < 20 * half:
        assert found is None or found.period > 0
        return
    assert found is not None
    assert np.abs(found.times(0, count) - stamps).max() <= half * (1 + 1e-6) + 1e-12
    # two grids within the rounding of all stamps differ by no more than it allows
    assert abs(found.period - period) * (count - 1) <= 4 * half + 1e-9


def test_the_simplest_period_is_taken():
    stamps = np.round(np.arange(200) / 24, 6)
    found = fit_period(stamps, 0.5e-6)
    assert Fraction(found.period).limit_denominator(1000) == Fraction(1, 24)
    assert found.snapped
    assert found.start == 0.0
    assert found.deviation == pytest.approx(1e-6 / 3, rel=1e-3)


@pytest.mark.parametrize("count", [3, 10, 30, 100])
@pytest.mark.parametrize("milliseconds", [7, 10, 12, 40])
def test_whole_milliseconds_are_no_simpler_fraction_of_a_second(milliseconds, count):
    """Ten rows of 10 ms with three decimals leave room for 1/99 s, which nobody meant."""
    stamps = np.round(np.arange(count) * milliseconds / 1000, 3)
    found = fit_period(stamps, 0.5e-3)
    assert found is not None
    assert not found.snapped
    np.testing.assert_allclose(found.times(0, count), stamps, rtol=1e-15, atol=1e-15)


def test_stamps_on_a_grid_of_floats_are_not_snapped():
    for stamps in (np.arange(1000) / 1000, np.linspace(0.25, 7, 77), np.cumsum(np.full(50, 0.1))):
        found = fit_period(stamps, 0.0)
        assert found is not None
        assert not found.snapped


@pytest.mark.parametrize(
    ("stamps", "half"),
    [
        ([0.0, 0.01, 0.02, 0.02, 0.04], 0.005),  # doubled
        ([0.0, 0.02, 0.01, 0.03], 0.005),  # backward
        ([0.0, 0.1, 0.3], 0.05),  # one decimal says little
        ([0.0, 0.1, 0.2, 0.3 + 2e-6], 0.5e-6),
        ([0.0, 0.1], 0.05),
        ([], 0.5),
    ],
)
def test_stamps_on_no_grid(stamps, half):
    assert fit_period(np.array(stamps), half) is None


def test_single_precision():
    stamps = (np.arange(500) / 30).astype(np.float32).astype(np.float64)
    found = fit_period(stamps, 0.0, 2.0**-24)
    assert found.period == 1 / 30
    assert fit_period(stamps, 0.0) is None


def test_jitter_of_a_million_stamps_is_no_grid():
    stamps = np.cumsum(np.random.default_rng(0).uniform(0.9, 1.1, 10**6)) / 1000
    assert fit_period((stamps[low : low + 20000] for low in range(0, 10**6, 20000)), 0.5e-6) is None
