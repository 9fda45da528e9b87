"""Time stamps and the period that they are multiples of, where the numbers of units say whether they are."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from trajcli.judge.rows.stamps import Stamps

MICROSECONDS = 5e-7  # half a unit of six decimals


def test_three_rounded_stamps_are_multiples_and_two_are_none() -> None:
    """0.041667 s is 1/24 s when 0.083333 s says so, too; one distance may be anything that rounds to it."""
    stamps = Stamps(MICROSECONDS, 0.0)
    times, exact = stamps.taken(np.array([0.0, 0.041667, 0.083333]))
    assert exact.all()
    np.testing.assert_allclose(times, [0.0, float(Fraction(1, 24)), float(Fraction(1, 12))], rtol=1e-15)
    written = np.array([0.0, 0.333333])
    times, exact = Stamps(MICROSECONDS, 0.0).taken(written)
    assert not exact.any()
    np.testing.assert_array_equal(times, written)


def test_of_three_stamps_no_other_two_make_a_period() -> None:
    stamps = Stamps(MICROSECONDS, 0.0)
    assert not stamps.taken(np.array([0.0, 0.1, 0.25]))[1].any()
    assert not stamps.regular


@pytest.mark.parametrize("period", [0.001, 0.004, 0.002])
def test_periods_that_were_added_up_are_multiples(period: float) -> None:
    """Every sum is rounded: after a thousand rows they are off by far more than one of them."""
    summed = np.cumsum(np.full(1000, period)) - period
    stamps = Stamps(0.0, 0.0)
    times, exact = stamps.taken(summed)
    assert exact.all()
    assert stamps.regular
    true = [float(k * Fraction(str(period))) for k in range(1000)]
    assert np.abs(summed - true).max() > 4 * np.spacing(summed[-1])
    np.testing.assert_allclose(times, true, rtol=1e-15)


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize(("off", "is_multiple"), [(0.9, True), (60.0, False)])
def test_a_stamp_is_beside_its_multiple_where_its_decimals_tell(
    off: float, side: int, *, is_multiple: bool
) -> None:
    """By 60 half units: 3e-5 of the period, that no rounding makes."""
    half_unit, t = 5e-9, 0.01 * np.arange(50)
    t[20] += side * off * half_unit
    assert bool(Stamps(half_unit, 0.0).taken(t)[1].all()) == is_multiple


def test_stamps_of_a_clock_since_1970_are_multiples_block_by_block() -> None:
    """Each is the nearest number to its multiple of 1/3000 s, of which there are three in a thousandth of a period."""
    for since in 1.7e9 + np.linspace(0.0, 1.0, 24, endpoint=False):
        exact = [float(Fraction(float(since)) + Fraction(k, 3000)) for k in range(9)]
        stamps = Stamps(0.0, 0.0)
        for block in np.split(np.array(exact), 3):
            assert stamps.taken(block)[1].all()


@pytest.mark.parametrize("first", [5, 7, -3])
def test_rounded_stamps_that_begin_anywhere_are_multiples(first: int) -> None:
    """The first one is rounded, too: 0.208333 s is 5/24 s."""
    meant = [float(Fraction(k, 24)) for k in range(first, first + 9)]
    times, exact = Stamps(MICROSECONDS, 0.0).taken(np.round(meant, 6))
    assert exact.all()
    np.testing.assert_allclose(times, meant, rtol=1e-14, atol=1e-15)


@pytest.mark.parametrize("count", [4, 5, 40])
@pytest.mark.parametrize("late", [1, 2, 3])
def test_the_last_stamp_alone_may_be_beside_its_multiple(late: int, count: int) -> None:
    """The one that ends the motion; others show that there is no period, and all are as they are written."""
    t = 0.1 * np.arange(count)
    t[-late] += 0.05 if late > 1 else -0.05
    times, exact = Stamps(MICROSECONDS, 0.0).taken(t)
    assert exact.tolist() == [late == 1] * (count - 1) + [False]
    np.testing.assert_allclose(times, t, atol=1e-9)
