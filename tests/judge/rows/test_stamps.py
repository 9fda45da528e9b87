"""Time stamps and the period that they are multiples of, where the numbers of units say whether they are."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from trajcli.judge.rows.stamps import Stamps, UnfitError, simplest_between

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


def written(
    period: Fraction, decimals: int, first: int, count: int, start: Fraction = Fraction(0)
) -> np.ndarray:
    """Return multiples of a period behind some start, rounded to decimals."""
    return np.array([float(round(start + (first + k) * period, decimals)) for k in range(count)])


def in_blocks(stamps: Stamps, t: np.ndarray, sizes: list[int]) -> tuple[np.ndarray, np.ndarray]:
    """Return what stamps are taken for, and which of them are exact, from blocks of some sizes and the rest."""
    taken = [stamps.taken(block) for block in np.split(t, np.cumsum(sizes)) if block.size]
    return np.concatenate([times for times, _ in taken]), np.concatenate([exact for _, exact in taken])


PERIODS = [
    (Fraction(1, 24), 6),
    (Fraction(1, 30), 3),
    (Fraction(1, 60), 3),
    (Fraction(1, 3), 3),
    (Fraction(1, 300), 4),
    (Fraction(7, 1000), 3),
    (Fraction(1, 1000), 3),
]


@pytest.mark.parametrize("first", [0, 1, 5, 100, 20_000])
@pytest.mark.parametrize(("period", "decimals"), PERIODS)
def test_rounded_stamps_are_the_multiples_that_they_were(period: Fraction, decimals: int, first: int) -> None:
    """From whichever multiple on and in whichever blocks; by how much they were moved is the largest rounding."""
    t = written(period, decimals, first, 400)
    true = np.array([float((first + k) * period) for k in range(400)])
    for sizes in ([], [140], [200, 1, 100]):
        stamps = Stamps(0.5 * 10.0**-decimals, 0.0)
        times, exact = in_blocks(stamps, t, sizes)
        assert exact.all()
        assert stamps.regular
        np.testing.assert_allclose(times, true, rtol=4e-16)
        assert stamps.largest_snap == pytest.approx(np.abs(t - true).max(), rel=1e-6, abs=1e-12)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("share", [Fraction(3, 10), Fraction(37, 100), Fraction(8, 10)])
def test_a_start_between_multiples_was_rounded_itself(share: Fraction, sign: int) -> None:
    """Distances from it are multiples, and each stamp may be off by its own rounding and by that of the start."""
    period, decimals = Fraction(1, 30), 3
    for k in range(8):
        t = written(period, decimals, 7, 200, sign * (share + Fraction(k, 97)) * period)
        times, exact = in_blocks(Stamps(5e-4, 0.0), t, [80])
        assert exact.all()
        np.testing.assert_allclose(np.diff(times), 1 / 30, rtol=1e-9)
        assert np.abs(times - t).max() <= 1e-3


@pytest.mark.parametrize("at", [2, 3, 150, 190, 260])
def test_a_stamp_that_was_not_rounded_so_is_no_multiple(at: int) -> None:
    """It is off by four thirds of half a unit: a thousandth beside its rounding; the first one is a multiple."""
    t = written(Fraction(1, 3), 3, 1, 400)
    near = np.flatnonzero(t[at:] - np.floor(t[at:]) > 0.5)[0] + at  # 0.667 of some second
    t[near] -= 1e-3
    stamps = Stamps(5e-4, 0.0)
    if near < 200:
        assert not stamps.taken(t[:200])[1].any()
        assert stamps.lattice is None
        return
    assert stamps.taken(t[:200])[1].all()
    with pytest.raises(UnfitError):
        stamps.taken(t[200:])


@pytest.mark.parametrize("size", [2, 50, 99, 100])
@pytest.mark.parametrize("beyond", [2e-3, -2e-3])
def test_the_last_stamp_may_stand_at_the_end_of_the_motion(beyond: float, size: int) -> None:
    """It is kept as it is and moves nothing; where others follow it was none at the end."""
    t = written(Fraction(1, 100), 4, 0, 100)
    t[-1] += beyond
    stamps = Stamps(5e-5, 0.0)
    if size == 2:
        assert not in_blocks(stamps, t, [2])[1].any()  # two rows make no period
        return
    times, exact = in_blocks(stamps, t, [size])
    assert exact[:-1].all()
    assert not exact[-1]
    assert times[-1] == t[-1]
    assert stamps.regular
    assert stamps.largest_snap <= 1e-12
    with pytest.raises(UnfitError):
        stamps.taken(t[-1] + np.array([0.01, 0.02]))


@pytest.mark.parametrize("at", [1, 20, 49, 50, 51, 70, 98])
def test_rows_that_are_missing_are_no_fault_and_make_stamps_irregular(at: int) -> None:
    """In the first block, in the second one, or between them."""
    t = np.delete(written(Fraction(1, 100), 4, 3, 100), at)
    for sizes in ([], [50], [50, 20]):
        stamps = Stamps(5e-5, 0.0)
        times, exact = in_blocks(stamps, t, sizes)
        assert exact.all()
        assert not stamps.regular
        np.testing.assert_allclose(times, t, rtol=1e-15)


def test_stamps_that_shall_not_be_moved_are_as_they_are() -> None:
    t = written(Fraction(1, 30), 3, 0, 50)
    times, exact = Stamps(5e-4, 0.0, snap=False).taken(t)
    assert not exact.any()
    np.testing.assert_array_equal(times, t)


@pytest.mark.parametrize("more", [[0.021], [0.011, 0.051]])
def test_two_stamps_of_one_multiple_stay_two(more: list[float]) -> None:
    """A thousandth apart, with three decimals, each may be that multiple alone."""
    t = np.sort(np.concatenate([written(Fraction(1, 100), 3, 0, 12), more]))
    assert (np.diff(Stamps(5e-4, 0.0).taken(t)[0]) > 0).all()


@pytest.mark.parametrize("gap", [2, 3, 7])
def test_a_file_may_begin_with_a_gap(gap: int) -> None:
    t = np.delete(written(Fraction(1, 30), 3, 0, 300), range(1, gap))
    times, exact = Stamps(5e-4, 0.0).taken(t)
    assert exact.all()
    np.testing.assert_allclose(np.diff(times)[1:], 1 / 30, rtol=1e-9)


@pytest.mark.parametrize("period", [Fraction(1, 300), Fraction(1, 1000), Fraction(1, 24)])
def test_stamps_in_single_precision_are_multiples(period: Fraction) -> None:
    """Later ones were rounded by more than the first ones."""
    true = np.array([float(k * period) for k in range(3000)])
    times, exact = in_blocks(Stamps(0.0, 2.0**-24), true.astype(np.float32).astype(float), [1000])
    assert exact.all()
    np.testing.assert_allclose(times, true, rtol=1e-9)


@pytest.mark.parametrize("seed", range(12))
def test_of_all_periods_that_fit_it_is_the_simplest(seed: int) -> None:
    """By trial of one denominator after the other, in fractions, with the first stamp as rounded as all.

    Where distances are equal as they are written, it is such a distance.
    """
    rng = np.random.default_rng(seed)
    count, half = int(rng.integers(4, 9)), Fraction(1, 2000)
    period = Fraction(int(rng.integers(30, 90)), int(rng.integers(900, 1100)))
    t = [round(k * period, 3) for k in range(count)]
    rows = range(1, count - 1)  # the last one may stand anywhere
    low = max((t[k] - 2 * half) / k for k in rows)
    high = min((t[k] + 2 * half) / k for k in rows)
    simplest = (
        t[1]
        if len({t[k + 1] - t[k] for k in range(count - 2)}) == 1
        else next(
            Fraction(n, d)
            for d in range(1, 3000)
            for n in range(int(low * d), int(high * d) + 2)
            if low <= Fraction(n, d) <= high
        )
    )
    stamps = Stamps(float(half), 0.0)
    stamps.taken(np.array([float(each) for each in t]))
    assert stamps.lattice is not None
    assert stamps.lattice.period == pytest.approx(float(simplest), rel=1e-12)


@pytest.mark.parametrize("since", [0.0, 123.0, 1.7e9])
@pytest.mark.parametrize("count", [3, 4, 10, 20, 100])
@pytest.mark.parametrize("milliseconds", [7, 10, 12, 1])
def test_whole_milliseconds_are_no_simpler_fraction_of_a_second(
    milliseconds: int, count: int, since: float
) -> None:
    """Few rows that are written with three decimals leave room for 1/143 s, which nobody meant."""
    t = since + np.array([round(k * milliseconds / 1000, 3) for k in range(count)])
    stamps = Stamps(5e-4, 0.0)
    times, exact = stamps.taken(t)
    assert exact.all()
    assert stamps.lattice is not None
    assert stamps.lattice.period == pytest.approx(milliseconds / 1000, rel=1e-9 if since < 1e9 else 3e-4)
    np.testing.assert_allclose(times, t, rtol=4e-16, atol=1e-15)


def test_behind_a_stamp_beside_its_multiple_nothing_follows() -> None:
    """What ended a block by itself was the end of the motion; where rows go on, it does not fit."""
    t = written(Fraction(1, 100), 4, 0, 100)
    t[49] += 2e-3
    stamps = Stamps(5e-5, 0.0)
    assert stamps.taken(t[:50])[1].tolist() == [True] * 49 + [False]
    with pytest.raises(UnfitError):
        stamps.taken(t[50:])


@pytest.mark.parametrize("late", [0.8, -0.8])
def test_the_largest_move_of_a_stamp_is_remembered_either_way(late: float) -> None:
    """One stamp is off by its rounding, in the first block; in the second one none is."""
    half, t = 5e-9, 0.01 * np.arange(100)
    t[20] += late * half
    stamps = Stamps(half, 0.0)
    assert in_blocks(stamps, t, [50])[1].all()
    assert stamps.largest_snap == pytest.approx(abs(late) * half, rel=1e-3)


@pytest.mark.parametrize(
    ("period", "decimals", "count", "meant"),
    [
        (Fraction(1, 120), 6, 10, True),  # of whole hertz
        (Fraction(2, 125), 9, 10, True),  # as it is written
        (Fraction(1, 30), 3, 40, True),
        (Fraction(2, 75), 6, 100, True),  # 37.5 Hz: there is no other fraction as simple
        (Fraction(4421159, 10**9), 6, 247, False),
        (Fraction(1001, 24000), 6, 50, False),
        (Fraction(44211, 10**7), 3, 10, False),  # several whole hertz are as near to a few milliseconds
        (Fraction(1, 60), 3, 20, True),
    ],
)
def test_a_period_that_is_no_simple_fraction_is_known_to_the_rounding_of_all_stamps(
    period: Fraction, decimals: int, count: int, *, meant: bool
) -> None:
    t = np.round([float(k * period) for k in range(count)], decimals)
    stamps = Stamps(0.5 * 10.0**-decimals, 0.0)
    assert stamps.taken(t)[1].all()
    lattice = stamps.lattice
    assert lattice is not None
    off = abs(lattice.period - float(period))
    assert (
        lattice.loose == 0.0 if meant else off <= lattice.loose <= 4.1 * 0.5 * 10.0**-decimals / (count - 2)
    )
    assert off < 1e-15 or not meant


def test_a_last_stamp_that_is_less_than_a_period_behind_is_not_that_before_it() -> None:
    """In milliseconds 13 is as near to five periods of 2.4 as 12 is: a piece between them lasts."""
    t = np.array([0.0, 0.002, 0.005, 0.007, 0.010, 0.012, 0.013])
    times, exact = Stamps(5e-4, 0.0).taken(t)
    assert (np.diff(times) > 0).all()
    assert exact.tolist() == [True] * 6 + [False]


def test_a_last_stamp_at_which_the_one_before_it_was_meant_fits_no_period() -> None:
    """In milliseconds 9 may be two periods of 5: then a last row at 10 is not behind it."""
    with pytest.raises(UnfitError):
        Stamps(5e-4, 0.0).taken(np.array([0.0, 0.004, 0.009, 0.010]))


@given(st.fractions(0, 4, max_denominator=40), st.fractions(0, 1, max_denominator=30))
def test_the_simplest_fraction_has_the_smallest_denominator(low: Fraction, width: Fraction) -> None:
    if low == 0:
        return
    found = simplest_between(low, low + width)
    assert low <= found <= low + width
    for denominator in range(1, found.denominator):
        assert -(-low * denominator // 1) > (low + width) * denominator
