"""Quintic pieces through smooth functions, against the functions themselves, and times of increasing laws."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from hermite_curves import hermite_pieces
from scipy.optimize import brentq

from trajcli.curves.hermite_fit import MOST_PIECES, FitError, fit
from trajcli.curves.operations import times_at
from trajcli.curves.piecewise import PiecewisePolynomial

ENDS = np.array([0.0, 3.0])


def waves(t):
    """Return sin(2t) and exp(-t), with two derivatives, (3, N, 2)."""
    return np.stack(
        [
            np.stack([np.sin(2 * t), np.exp(-t)], axis=-1),
            np.stack([2 * np.cos(2 * t), -np.exp(-t)], axis=-1),
            np.stack([-4 * np.sin(2 * t), np.exp(-t)], axis=-1),
        ]
    )


@dataclass
class Known:
    """Value, slope and curvature (3, N, n)."""

    values: np.ndarray


def known(function):
    return lambda places, side, guess: Known(function(places))


def within(tolerance):
    """Return the misfit of value, slope and curvature alike."""
    return lambda known, rows, fitted: np.abs(fitted - known.values[:, rows]).max(axis=(0, 2)) / tolerance


def nothing(places):
    return np.zeros((places.size, 2))


@pytest.mark.parametrize("tolerance", [1e-3, 1e-6, 1e-9])
def test_value_slope_and_curvature_are_met_everywhere(tolerance):
    curve = fit(known(waves), within(tolerance), ENDS, nothing)
    t = np.linspace(*ENDS, 7001)
    off = np.abs(curve.evaluate_orders(t, (0, 1, 2)).swapaxes(0, 1) - waves(t))
    assert off.max() <= tolerance * 1.05
    assert off[2].max() > tolerance * 1e-3  # no finer than asked for
    assert (curve.start, curve.end) == tuple(ENDS)


@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.parametrize("center", [0.4, 0.62, 0.86, 1.1, 2.3])
def test_a_mirrored_function_has_the_mirrored_pieces(center, order):
    """A narrow hump anywhere: no part of a piece is looked at less closely than its mirror image."""

    def hump(t):
        x = 8 * (t - center)
        value = np.exp(-(x**2))
        rows = value, -16 * x * value, (256 * x**2 - 128) * value
        return np.stack([np.stack([row, 0 * row], axis=-1) for row in rows])

    def mirrored(t):
        return hump(3.0 - t) * np.array([1.0, -1.0, 1.0])[:, None, None]

    def misfit(known, rows, fitted):
        return np.abs(fitted - known.values[:, rows])[order].max(axis=1) / 1e-4

    one, other = (fit(known(function), misfit, ENDS, nothing) for function in (hump, mirrored))
    np.testing.assert_allclose(other.breaks, 3.0 - one.breaks[::-1], atol=1e-12)
    t = np.linspace(*ENDS, 7001)
    assert np.abs(one.evaluate(t, order) - hump(t)[order]).max() <= 1.25e-4


@pytest.mark.parametrize(("order", "rate"), [(0, 6), (1, 5), (2, 4)])
def test_the_error_falls_with_the_order_of_quintic_pieces(order, rate):
    def misfit(known, rows, fitted):
        return np.abs(fitted - known.values[:, rows])[order].max(axis=1)

    few, many = (fit(known(waves), misfit, np.linspace(*ENDS, n + 1), nothing) for n in (60, 120))
    assert (few.pieces, many.pieces) == (
        60,
        120,
    )  # tolerances are met at once: the errors are those of the grid
    t = np.linspace(*ENDS, 4001)
    errors = [np.abs(c.evaluate(t, order) - waves(t)[order]).max() for c in (few, many)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(rate, abs=0.35)


def test_breaks_are_kept_with_both_their_sides():
    def kinked(places, side, guess):
        late = places >= 1.0 if side == "right" else places > 1.0
        bend = np.where(late, -3.0, 2.0)
        x = places - 1.0
        return Known(np.stack([bend * x**2 / 2, bend * x, bend])[..., None])

    curve = fit(kinked, within(1e-9), np.array([0.0, 1.0, 2.0]), lambda t: np.zeros((t.size, 1)))
    assert curve.pieces == 2
    sides = [curve.evaluate(1.0, 2, side=side)[0] for side in ("left", "right")]
    np.testing.assert_allclose(sides, [2.0, -3.0], atol=1e-12)
    np.testing.assert_allclose(curve.evaluate([0.0, 2.0])[:, 0], [1.0, -1.5], atol=1e-12)


def test_pieces_are_short_only_where_they_must_be():
    def peak(t):
        x = (t - 2.0) / 0.02
        return np.stack(
            [np.exp(-(x**2)), -2 * x * np.exp(-(x**2)) / 0.02, (4 * x**2 - 2) * np.exp(-(x**2)) / 4e-4]
        )[..., None]

    curve = fit(known(peak), within(1e-3), np.array([0.0, 4.0]), lambda t: np.zeros((t.size, 1)))
    near = np.abs(curve.breaks - 2.0) < 0.1
    assert near.mean() > 0.8
    t = np.linspace(0, 4, 9001)
    assert np.abs(curve.evaluate(t) - peak(t)[0]).max() < 1e-3


def test_searches_begin_where_the_guess_says():
    """cos q = c(t) has two answers; the pieces of the first rounds are so far off that they lead to the other one."""

    def answers(t):
        return 0.6 + 0.55 * np.cos(9 * t), -4.95 * np.sin(9 * t), -44.55 * np.cos(9 * t)

    def searched(places, side, guess):
        q, slope, bend = answers(places)
        found = guess[:, 0].copy()
        for _ in range(60):  # Newton's method on cos q = cos(answer)
            found -= np.clip((np.cos(q) - np.cos(found)) / np.sin(found), -0.2, 0.2)
        sign = np.where(found > 0, 1.0, -1.0)
        assert (sign > 0).all(), "the other answer"
        return Known(np.stack([found, slope, bend])[..., None])

    curve = fit(searched, within(1e-6), ENDS, lambda t: answers(t)[0][:, None])
    t = np.linspace(*ENDS, 999)
    np.testing.assert_allclose(curve.evaluate(t)[:, 0], answers(t)[0], atol=1e-6)


def test_a_smooth_function_takes_few_questions_each_by_a_better_guess():
    """Two of them are the ends alone; a guess that is off by 0.1 is left as soon as the pieces are nearer."""
    asked = []

    def exact(places, side, guess):
        answer = waves(places)
        asked.append(np.abs(guess - answer[0]).max())
        return Known(answer)

    curve = fit(exact, within(1e-9), ENDS, lambda places: waves(places)[0] + 0.1)
    assert curve.pieces > 100
    assert len(asked) <= 4
    assert asked[:2] == pytest.approx([0.1, 0.1])
    assert asked[-1] < 1e-7


def test_pieces_that_are_worse_than_the_guess_are_no_guess():
    def exact(places, side, guess):
        assert np.abs(guess - waves(places * 9)[0]).max() <= 2e-3
        value, slope, bend = waves(places * 9)
        return Known(np.stack([value, 9 * slope, 81 * bend]))

    curve = fit(exact, within(1e-3), ENDS, lambda places: waves(places * 9)[0] + 1e-3)
    assert curve.pieces > 20


@pytest.mark.parametrize("center", [1.5 - 0.3 * 5**0.5, 1.5 + 0.3 * 5**0.5])
@pytest.mark.parametrize("breaks", [[0, 3], [-3, 0, 3], [0, 3, 6]])
def test_pieces_that_are_worse_than_the_guess_at_one_place_alone_are_no_guess(breaks, center):
    """A hump near the first or the last place at which a piece is judged; elsewhere and in the others all is flat."""
    asked = []

    def exact(places, side, guess):
        x = 8 * (places - center)
        value = np.exp(-(x**2))
        asked.append(places.size)
        if len(asked) > 2:  # behind the first round
            assert np.abs(guess[:, 0] - value).max() <= 1e-2 * (1 + 1e-9)
        return Known(np.stack([value, -16 * x * value, (256 * x**2 - 128) * value])[..., None])

    def guess(places):
        return np.exp(-((8 * (places - center)) ** 2))[:, None] + 1e-2

    assert fit(exact, within(1e-3), np.array(breaks, dtype=float), guess).pieces > 8


def test_a_function_that_no_quintics_follow_is_named_with_its_place():
    def root(t):
        x = np.abs(t - np.sqrt(2)) + 1e-300
        return np.stack([np.sqrt(x), 0.5 / np.sqrt(x), -0.25 / x**1.5])[..., None]

    with pytest.raises(FitError) as caught:
        fit(known(root), within(1e-6), ENDS, lambda t: np.zeros((t.size, 1)))
    assert caught.value.at == pytest.approx(np.sqrt(2), abs=1e-3)
    assert caught.value.misfit > 1
    assert "times the tolerance" in str(caught.value)


def test_the_place_of_a_misfit_is_where_it_is_worst():
    """One piece is judged at its middle and at a tenth of the root of 5 beside it: the last is nearest to the hump."""

    def hump(t):
        x = 8 * (t - 2.2)
        return (np.exp(-(x**2)) * np.stack([1 + 0 * x, -16 * x, 256 * x**2 - 128]))[..., None]

    with pytest.raises(FitError) as caught:
        fit(known(hump), within(1e-4), ENDS, lambda t: np.zeros((t.size, 1)), at_most=1)
    assert caught.value.at == pytest.approx(1.5 + 0.3 * np.sqrt(5), abs=1e-12)
    with pytest.raises(FitError) as caught:
        fit(known(hump), within(1e-4), np.array([0.0, 1.0, 3.0]), lambda t: np.zeros((t.size, 1)), at_most=2)
    assert caught.value.at > 1.0
    assert caught.value.misfit > 100.0, "that of the piece with the hump"


def test_the_number_of_pieces_is_bounded():
    with pytest.raises(FitError):
        fit(known(waves), within(1e-9), ENDS, nothing, at_most=20)
    assert fit(known(waves), within(1e-9), ENDS, nothing, at_most=400).pieces <= 400


def test_pieces_of_all_rounds_count():
    """A narrow peak takes several rounds; those of the first ones lie beside it."""

    def peak(t):
        x = 50 * (t - 1.5)
        return (np.exp(-(x**2)) * np.stack([1 + 0 * x, -100 * x, 1e4 * x**2 - 5e3]))[..., None]

    def fitted(at_most):
        return fit(known(peak), within(1e-3), ENDS, lambda t: np.zeros((t.size, 1)), at_most=at_most)

    pieces = fitted(None).pieces
    assert fitted(pieces).pieces == pieces
    with pytest.raises(FitError):
        fitted(pieces - 1)


def test_a_long_way_with_many_breaks_may_have_more_pieces_than_a_short_one():
    breaks = np.linspace(0.0, 120.0, 41)
    curve = fit(known(waves), within(2e-9), breaks, nothing)
    assert curve.pieces > MOST_PIECES
    t = np.linspace(0.0, 120.0, 9001)
    assert np.abs(curve.evaluate(t) - waves(t)[0]).max() <= 2e-9


@pytest.mark.parametrize("width", [1e-5, 1e-7])
def test_a_short_way_between_breaks_is_no_place_for_a_search(width):
    """The second derivative of a piece so short holds the rounding of its ends, many times the tolerance."""
    breaks = np.array([0.0, 1.0, 1.0 + width, 3.0])
    lift = np.array([3.0, 0.0, 0.0])[:, None, None]
    curve = fit(known(lambda t: waves(t) + lift), within(1e-8), breaks, nothing)
    assert curve.pieces < 400
    t = np.linspace(*ENDS, 3001)
    np.testing.assert_allclose(curve.evaluate(t), waves(t)[0] + 3.0, rtol=0, atol=1e-8)


def test_not_a_number_is_no_fit():
    def broken(t):
        return np.where(t[:, None] > 1.5, np.nan, waves(t))

    with pytest.raises(FitError):
        fit(known(broken), within(1e-3), ENDS, nothing)


def law(*states):
    """Return a quintic law through (t, s, sd, sdd)."""
    rows = np.array(states, dtype=float)
    return hermite_pieces(rows[:, 0], rows[:, 1:].T[:, :, None])


RISING = law((0, 0, 0, 0), (1, 1, 1, 0), (2.5, 2, 0, 0), (4, 5, 0, 0))


def test_times_are_those_of_a_root_finder():
    wanted = np.array([1e-9, 0.2, 0.999, 1.0, 1.7, 2.0 - 1e-6, 3.3, 4.999])
    got = times_at(RISING, wanted)
    for value, time in zip(wanted, got, strict=True):
        peer = brentq(lambda t, v=value: RISING.evaluate(t)[0] - v, 0, 4, xtol=1e-15, rtol=1e-14)
        assert RISING.evaluate(time)[0] == pytest.approx(value, abs=2e-15)
        if abs(RISING.evaluate(peer, 1)[0]) > 1e-3:
            assert time == pytest.approx(peer, abs=1e-12)


def test_ends_stops_and_what_lies_outside():
    assert times_at(RISING, np.array([0.0, -1.0, 9.0])).tolist() == [0.0, 0.0, 4.0]
    assert RISING.evaluate(times_at(RISING, np.array([5.0])))[0, 0] == pytest.approx(5.0, abs=1e-14)
    assert (
        times_at(RISING, np.array([2.0]))[0] == 2.5
    )  # the law stops there, where a search finds no sharp time


def test_the_earliest_time_of_a_pause():
    still = PiecewisePolynomial(
        np.array([0.0, 1.0, 3.0, 4.0]), np.array([[1.0, 0, 1], [0, 1, 1]])[:, :, None]
    )
    assert times_at(still, np.array([1.0, 0.5, 1.5])).tolist() == pytest.approx([1.0, 0.5, 3.5], abs=1e-12)
