"""Chains of phases, against exact rational integration."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from trajcli.curves.phases import PhaseChain, merged_curve


def integrate(initial, durations, constants):
    """Return the exact end state of phases given as floats."""
    order = len(initial)
    state = [Fraction(float(value)) for value in initial]
    for time, constant in zip(durations, constants, strict=True):
        t, full = Fraction(float(time)), [*state, Fraction(float(constant))]
        state = []
        for k in range(order):
            term, power = Fraction(0), Fraction(1)
            for j, value in enumerate(full[k:]):
                term += value * power
                power = power * t / (j + 1)
            state.append(term)
    return np.array([float(value) for value in state])


def chain_of(*values):
    """Return the chain of such arrays or lists."""
    return PhaseChain(*(tuple(map(float, each)) for each in values))


def random_chain(rng, order, phases):
    initial = np.concatenate([[0.0], rng.normal(size=order - 1)])
    durations, constants = rng.uniform(0.1, 1.0, phases), rng.normal(size=phases)
    return chain_of(initial, integrate(initial, durations, constants), durations, constants)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 3), st.integers(1, 9))
def test_states_and_curve_integrate_exactly(seed, order, phases):
    chain = random_chain(np.random.default_rng(seed), order, phases)
    assert chain.defect() < 1e-14
    curve = chain.curve(2.0, chain.duration)
    ends = [float(curve.piece_ends(k)[1][-1, 0]) for k in range(order)]
    np.testing.assert_allclose(ends, np.array(chain.final) + np.eye(order)[0] * 2.0, rtol=1e-13, atol=1e-13)
    for k in range(order):
        first, last = curve.piece_ends(k)
        np.testing.assert_allclose(last[:-1], first[1:], rtol=1e-12, atol=1e-12)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 3), st.booleans())
def test_polish_lands_what_a_small_error_misses(seed, order, fixed):
    chain = random_chain(np.random.default_rng(seed), order, 7)
    rng = np.random.default_rng(seed + 1)
    durations = np.array(chain.durations) * (1 + 1e-8 * rng.normal(size=7))
    missing = replace(chain, durations=tuple(durations.tolist()))
    duration = chain.duration if fixed else None
    assert missing.defect() > 1e-11
    landed, miss = missing.polished(duration)
    assert miss == landed.defect(duration)
    end = integrate(landed.initial, landed.durations, landed.constants)
    assert np.abs(end - chain.final).max() <= 2e-13 * max(1.0, landed.duration) ** order
    if fixed:
        assert landed.duration == pytest.approx(chain.duration, rel=1e-14)
    assert np.abs(np.array(landed.durations) / missing.durations - 1).max() < 1e-5


def test_polish_of_given_duration_changes_constants_where_phases_are_too_few():
    chain = chain_of(
        np.zeros(3), np.array([2.0, 0.0, 0.0]), np.array([1.0, 2.0, 1.0]), np.array([1.0, -1.0, 1.0])
    )
    landed, miss = chain.polished(4 * (1 + 1e-9))
    assert miss == landed.defect(4 * (1 + 1e-9)) < 1e-14
    assert landed.duration == pytest.approx(4 * (1 + 1e-9), rel=1e-15)
    np.testing.assert_allclose(np.abs(landed.constants), 1 - 3e-9, atol=1e-12)


def test_cruise_is_without_acceleration_to_the_last_bit():
    ramp, jerk, cruise = 0.1 + 1e-17, 30.0, 1000.0
    durations = np.array([ramp, 0.3, ramp, cruise])
    chain = chain_of(
        np.zeros(3), np.array([np.nan] * 3), durations, np.array([jerk, 0.0, -jerk * (1 + 1e-16), 0.0])
    ).with_cruises()
    assert chain.cruising == {3}
    curve = chain.curve(0.0, chain.duration)
    assert curve.evaluate(500.0, 2)[0] == 0.0
    assert curve.evaluate(500.0, 1)[0] == curve.evaluate(1000.0, 1)[0]


def test_rounded_breaks_raise_no_constant():
    constants = np.array([7.0, 0.0, -7.0, 0.0, -7.0, 0.0, 7.0])
    shortened = 0
    for cruise in np.linspace(4000.0, 4100.0, 20) + 0.123:
        durations = np.array([3.3e-5, 1.7e-5, 3.3e-5, cruise, 3.3e-5, 1.7e-5, 3.3e-5])
        final = integrate(np.zeros(3), durations, constants)
        chain = chain_of(np.zeros(3), final, durations, constants).with_cruises().polished()[0]
        curve = chain.curve(0.0, chain.duration)
        assert np.abs(curve.piece_ends(3)).max() <= 7.0 * (1 + 1e-12)
        assert curve.piece_ends()[1][-1, 0] == pytest.approx(final[0], rel=1e-15)
        plain = np.diff(np.concatenate([[0.0], np.cumsum(durations)]))
        shortened += int((plain < durations * (1 - 1e-9)).any())
    assert shortened  # by what a plain sum does; full jerk could not reach the speed in time


def test_stretched_motion_covers_the_same_distance():
    chain = chain_of(
        np.zeros(3), np.array([2.0, 0.0, 0.0]), np.array([1.0, 2.0, 1.0]), np.array([1.0, -1.0, 1.0])
    )
    longer = chain.stretched(10.0)
    end = integrate(longer.initial, longer.durations, longer.constants)
    np.testing.assert_allclose(end, chain.final, atol=1e-14)
    assert longer.duration == pytest.approx(10.0, rel=1e-15)


def test_motion_without_phases_is_a_point():
    chain = chain_of([0.0, 1.0, 0.0], [0.0, 1.0, 0.0], [], [])
    curve = chain.curve(3.0, 0.0)
    assert curve.duration == 0
    assert curve.evaluate(0.0)[0] == 3.0


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_peaks_are_of_either_sign_and_of_the_target(sign):
    chain = chain_of([0.0, sign * 2.0], [sign * -9.0, 0.0], [1.0, 4.0], [sign * -1.0, sign * -1.0])
    assert chain.states == [[0, sign * 2.0], [sign * 1.5, sign * 1.0], [sign * -2.5, sign * -3.0]]
    assert chain.peaks == (9.0, 3.0)
    assert chain.coarseness == 0.0
    # the position counts against the peak velocity times the duration where that is more
    far = chain_of([0.0, sign * 2.0], [sign * 4.0, sign * -2.0], [1.0, 3.0], [sign * -1.0, sign * -1.0])
    assert far.defect() == pytest.approx(4.0 / 8.0)
    assert far.defect(5.0) == pytest.approx(0.5)
    assert far.defect(2.0) == pytest.approx(1.0)
    # of a short motion, too: half a second at 2
    short = chain_of([0.0, sign * 2.0], [sign * 0.5, sign * 2.0], [0.5], [0.0])
    assert short.defect() == pytest.approx(0.5)


def test_coarseness_is_what_a_rounded_break_does_to_the_velocity():
    chain = chain_of(np.zeros(3), [2.0, 0.0, 0.0], [1.0, 2.0, 1.0], [1.0, -1.0, 1.0])
    assert chain.peaks == (2.0, 0.5, 1.0)  # at the ends of phases
    assert chain.coarseness == 2 * np.spacing(4.0)
    assert chain_of(np.zeros(3), np.zeros(3), [1.0], [0.0]).coarseness == 0.0
    assert chain_of(np.zeros(3), np.zeros(3), [1.0], [0.0]).defect() == 0.0


@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.parametrize("longest", [1.0, 1e4])
def test_a_curve_ends_in_its_target_to_the_last_bits(order, longest):
    """Whatever rounding of its breaks does: relative to its peaks, of the position to velocity times duration."""
    for seed in range(20):
        chain = random_chain(np.random.default_rng(seed), order, 6)
        durations = np.array(chain.durations) * np.where(np.arange(6) == 3, longest, 1.0)
        final = integrate(chain.initial, durations, chain.constants)
        chain = replace(chain, durations=tuple(durations.tolist()), final=tuple(final.tolist())).polished()[0]
        curve = chain.curve(0.3, chain.duration)
        ends = np.array([curve.piece_ends(k)[1][-1, 0] for k in range(order)]) - np.eye(order)[0] * 0.3
        sizes = np.array(chain.peaks)
        sizes[:-1] = np.maximum(sizes[:-1], sizes[1:] * chain.duration)
        assert (np.abs(ends - final) <= 3e-15 * sizes).all()


@pytest.mark.parametrize(("scale", "length"), [(1.0, 5.0), (1e6, 5.0), (1e-6, 5.0), (1.0, 5e6)])
def test_a_cruise_is_without_acceleration_but_for_rounding_of_its_peak(scale, length):
    """At 1e-6 of the peak a phase without jerk still changes its velocity; at 1e-12 only rounding says so."""
    for left, cruising in ((1e-6, set()), (-1e-6, set()), (1e-12, {2}), (-1e-12, {2})):
        jerks = [30.0 * scale, -30.0 * (1 - left) * scale, 0.0]
        chain = chain_of(np.zeros(3), [np.nan] * 3, [0.1, 0.1, length], jerks).with_cruises()
        assert chain.cruising == cruising
    twice = chain_of(np.zeros(3), [np.nan] * 3, [0.1, 0.1, 5.0] * 2, [30.0, -30.0, 0.0] * 2)
    assert twice.with_cruises().cruising == {2, 5}


def double_s(error):
    """Return phases from rest to rest with a cruise, whose durations are off by a part of themselves."""
    durations, jerks = [0.1, 0.3, 0.1, 5.0, 0.1, 0.3, 0.1], [30.0, 0.0, -30.0, 0.0, -30.0, 0.0, 30.0]
    final = integrate(np.zeros(3), durations, jerks)
    off = np.array(durations) * (1 + error * np.array([1.0, -0.5, 0.2, 1.0, -1.0, 0.7, 0.3]))
    return replace(chain_of(np.zeros(3), final, off, jerks), cruising=frozenset({3}))


@pytest.mark.parametrize("error", [1e-8, 1e-3])
@pytest.mark.parametrize("fixed", [False, True])
def test_durations_alone_are_corrected_where_they_suffice(fixed, error):
    """The limit of the jerk is kept as it was, and the acceleration is over where the cruise begins."""
    missing = double_s(error)
    duration = 6.0 if fixed else None
    landed, miss = missing.polished(duration)
    assert miss < 1e-14
    assert landed.constants == missing.constants
    at_cruise = integrate(landed.initial, landed.durations[:3], landed.constants[:3])
    assert at_cruise[2] == pytest.approx(0.0, abs=1e-14)
    end = integrate(landed.initial, landed.durations, landed.constants)
    np.testing.assert_allclose(end, landed.final, rtol=0, atol=1e-13)
    assert not fixed or landed.duration == pytest.approx(duration, rel=1e-15)


def test_short_phases_behind_a_long_one_raise_no_constant():
    """Before the longest one, where sums of times are rounded to a thousandth of what is short."""
    for first in np.linspace(1000.0, 1100.0, 20) + 0.123:
        durations, jerks = [first, 3e-10, 2e-10, 3e-10, 4000.0], [0.0, 7.0, 0.0, -7.0, 0.0]
        chain = chain_of([0.0, 0.5, 0.0], [np.nan] * 3, durations, jerks)
        breaks, derivatives = chain.pieces(chain.duration)
        assert (np.diff(breaks)[:4] >= durations[:4]).all()
        assert np.abs(derivatives[0]).max() <= 7.0


def test_what_no_constant_can_mend_is_laid_into_the_longest_phase():
    """A steady speed that is to lead a little further: the break to the next phase takes what is left of it."""
    chain = chain_of([0.0, 0.5], [3.5 + 1e-9, 0.5], [1.0, 4.0, 2.0], [0.0, 0.0, 0.0])
    (first, last), (speeds, _) = (chain.curve(0.0, 7.0).piece_ends(order) for order in (0, 1))
    assert last[-1, 0] == pytest.approx(3.5 + 1e-9, rel=1e-15)
    assert last[0, 0] == first[1, 0] == 0.5
    assert speeds[:2, 0] == pytest.approx([0.5, 0.5 + 2.5e-10], rel=1e-15)
    np.testing.assert_allclose(last[1], first[2], rtol=0, atol=1e-9)


def test_what_is_no_number_is_no_small_miss():
    assert np.isnan(chain_of(np.zeros(3), [1.0, 0.0, 0.0], [1.0, 1.0], [1.0, np.nan]).defect())


def test_merged_variables_are_those_of_their_own_curves():
    """All of one order, of several orders, and one that does not move at all."""
    rng = np.random.default_rng(4)
    chains = [random_chain(rng, order, phases) for order, phases in ((3, 5), (3, 2), (2, 4))]
    still = chain_of([0.0] * 3, [0.0] * 3, [], [])
    for chosen in (chains[:2], chains[1::-1], chains):
        duration = max(chain.duration for chain in chosen)
        lasting = [chain.stretched(duration) for chain in chosen]
        curve = merged_curve([(1.0 + k, chain) for k, chain in enumerate(lasting)], duration)
        t = np.linspace(0, duration, 50)
        for k, chain in enumerate(lasting):
            own = chain.curve(1.0 + k, duration)
            for order in range(3):
                np.testing.assert_allclose(
                    curve.evaluate(t, order)[:, k], own.evaluate(t, order)[:, 0], rtol=0, atol=1e-12
                )
    both = merged_curve([(1.0, still), (2.0, still)], 0.0)
    np.testing.assert_array_equal(both.evaluate(np.zeros(1)), [[1.0, 2.0]])
