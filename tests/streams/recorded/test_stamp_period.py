"""Grids of time stamps against stamps that were made on a known grid, and against none."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from trajcli.streams.recorded import stamp_period
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


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("size", [70, 1000])
def test_the_farthest_of_many_corners_is_kept(side, size, monkeypatch):
    """Stamps on a parabola are corners of a hull all of them; its ends are the farthest on the one side."""
    monkeypatch.setattr(stamp_period, "_MANY", 64)
    stamps = 3.0 * np.arange(1000) + side * 1e-7 * (np.arange(1000) - 500.0) ** 2
    found = fit_period([stamps[low : low + size] for low in range(0, 1000, size)], 0.0126)
    assert found is not None
    assert found.deviation == pytest.approx(np.abs(found.times(0, 1000) - stamps).max(), rel=1e-6)
    assert found.deviation == pytest.approx(0.0125, rel=1e-2)


def test_what_is_kept_of_many_stamps_are_corners_and_they_are_seldom_looked_for(monkeypatch):
    """Of stamps with jitter few are corners; of a parabola all are, and looking for them again takes none away."""
    taken = []
    corners = stamp_period._corners
    monkeypatch.setattr(stamp_period, "_MANY", 64)
    monkeypatch.setattr(
        stamp_period, "_corners", lambda points, side: (taken.append(len(points)), corners(points, side))[1]
    )
    jitter, parabola = PeriodFit(), PeriodFit()
    for low in range(0, 2000, 20):
        rows = np.arange(low, low + 20)
        jitter.add(rows + 0.3 * np.random.default_rng(low).uniform(-1, 1, 20))
    assert max(len(jitter._upper), len(jitter._lower)) <= 64 + 20
    taken.clear()
    for low in range(0, 2000, 20):
        parabola.add(3.0 * np.arange(low, low + 20) - 1e-7 * np.arange(low, low + 20) ** 2.0)
    assert len(parabola._upper) == 2000
    assert sum(length > 20 for length in taken) <= 2 * 6


def test_points_of_a_grid_are_counted_from_its_start():
    grid = fit_period(12.5 + 0.01 * np.arange(50), 0.0)
    assert grid.times(7, 3) == pytest.approx([12.57, 12.58, 12.59], abs=1e-12)


@pytest.mark.parametrize(
    "blocks",
    [
        [[0.0, 1.0, 2.0], [2.0, 3.0, 4.0]],
        [[0.0, 1.0, 2.0], [1.5, 3.0, 4.0]],
        [[0.0, 1.0, 1.0, 2.0], [3.0, 4.0]],
        [[0.0, 1.0, 2.0], [3.0, 2.9, 5.0]],
    ],
)
def test_stamps_that_do_not_rise_are_no_grid_however_rough_they_are(blocks):
    assert fit_period(map(np.array, blocks), 0.0) is None
    assert fit_period(map(np.array, blocks), 0.04) is None
    assert fit_period([np.array([0.0, 1.0, 2.0]), np.array([3.0, 4.0])], 0.04).period == 1.0


@pytest.mark.parametrize("start", [-1000.0, 1.0])
def test_single_precision_is_that_of_the_largest_stamp_wherever_it_stands(start):
    """From -1000 s to -1 s, and from 1 s to 1000 s: stamps off by 0.8 millionths of 1000."""
    off = 8e-4 * np.where(np.arange(1000) % 3 == 1, 1.0, -1.0)
    found = fit_period(start + np.arange(1000) + off, 0.0, 1e-6)
    assert found is not None
    assert found.period == pytest.approx(1.0, abs=1e-5)
    assert fit_period(start + np.arange(1000) + off, 0.0, 0.7e-6) is None


@pytest.mark.parametrize(("ulps", "snapped"), [(2.0, False), (40.0, True)])
def test_what_sums_of_floats_leave_is_no_rounding(ulps, snapped):
    stamps = 0.125 * np.arange(100)
    stamps[50] += ulps * np.spacing(stamps[-1])
    found = fit_period(stamps, 1e-3)
    assert found.snapped == snapped
    assert (fit_period(stamps, 0.0) is None) == snapped


def test_a_grid_begins_at_zero_or_with_its_first_stamp_where_these_fit():
    for first, start in ((0.0, 0.0), (0.004, 0.0), (12.5, 12.5)):
        stamps = np.round(first) * (first == 0.004) + first * (first != 0.004) + np.arange(50.0)
        stamps[0], stamps[20] = first, stamps[20] - 0.004
        found = fit_period(stamps, 0.005)
        assert (found.start, found.period) == (start, 1.0)
        assert found.deviation == pytest.approx(0.004, rel=1e-9)
        assert found.snapped


@given(st.fractions(0, 4, max_denominator=40), st.fractions(0, 1, max_denominator=30))
def test_the_simplest_fraction_has_the_smallest_denominator(low, width):
    if low == 0:
        return
    found = stamp_period.simplest_between(low, low + width)
    assert low <= found <= low + width
    for denominator in range(1, found.denominator):
        assert -(-low * denominator // 1) > (low + width) * denominator
