"""Bounds from nine nodes of each piece, against polynomials and functions whose peaks and derivatives are known."""

from __future__ import annotations

from functools import cache
from math import comb, factorial

import numpy as np
import pytest

from trajcli.curves.node_bound import (
    BETWEEN_NODES,
    NodeSurvey,
    at_nodes,
    hull_matrices,
    node_survey,
)
from trajcli.curves.piecewise import PiecewisePolynomial, control_points

NODES = np.linspace(0.0, 1.0, 9)


def norm(vectors):
    return np.linalg.norm(vectors, axis=-1)


def total(entries):
    return entries.sum(axis=-1)


def surveyed(values, remainder, starts, lengths):
    """Return the survey of one function."""
    return NodeSurvey(
        np.array(starts), np.array(lengths), np.asarray(values)[:, :, None], np.array(remainder)[:, None]
    )


def rest_of(values, remainder=(0.0,), size=norm, slack=1e-9, least=0.0):
    return surveyed(values, remainder, np.arange(len(values)) * 2.0 + 1.0, np.full(len(values), 2.0)).largest(
        0, size, lambda _: slack, least=least
    )


@pytest.mark.parametrize("degree", range(9))
def test_values_at_nodes_have_the_control_points_of_their_polynomial(degree):
    coefficients = np.random.default_rng(degree).normal(size=degree + 1)
    raised = np.zeros(9)
    raised[8 - degree :] = coefficients
    np.testing.assert_allclose(
        hull_matrices()[0] @ np.polyval(coefficients, NODES),
        control_points(raised, np.array(1.0)),
        atol=1e-10,
    )


@pytest.mark.parametrize("half", [0, 1])
def test_halves_are_the_same_polynomial(half):
    """By the basis: the points of a half are the weights of the polynomial there."""
    points = np.random.default_rng(3).normal(size=9)
    own = hull_matrices()[1][half] @ points
    for x in np.linspace(0, 1, 5):
        along = (half + x) / 2
        values = [
            sum(comb(8, k) * t**k * (1 - t) ** (8 - k) * weights[k] for k in range(9))
            for t, weights in ((along, points), (x, own))
        ]
        assert values[0] == pytest.approx(values[1], rel=1e-13)


def test_the_product_of_distances_from_the_nodes_is_bounded():
    x = np.linspace(0, 1, 200_001)
    largest = np.abs(np.polyval(np.poly(NODES), x)).max()
    assert largest <= BETWEEN_NODES <= 2.2 * largest


def test_a_curve_at_its_nodes():
    curve = PiecewisePolynomial(np.array([1.0, 1.5, 4.0]), np.random.default_rng(1).normal(size=(5, 2, 3)))
    for order, values in enumerate(at_nodes(curve.coefficients, curve.lengths)):
        for piece in range(2):
            times = curve.breaks[piece] + curve.lengths[piece] * NODES
            sides = ["right"] * 8 + ["left"]
            expected = [curve.evaluate(t, order, side=side) for t, side in zip(times, sides, strict=True)]
            np.testing.assert_allclose(values[piece], expected, rtol=1e-11, atol=1e-11)


def of_powers(rate):
    """Return what is known of cos and sin of `rate` t, from a curve q(t) = t; the derivatives are rate^9."""

    def known(coefficients, lengths):
        q, *_ = at_nodes(coefficients, lengths)
        values = np.stack([np.cos(rate * q), np.sin(rate * q)], axis=-1)
        return values, np.full((len(lengths), 1), rate**9 / factorial(9))

    return known


@cache
def survey_of_wave(rate):
    breaks = np.array([0.1, 0.4, 1.0, 1.3])
    pieces = breaks[:-1], np.diff(breaks), np.stack([np.ones((3, 1)), breaks[:-1, None]])
    return node_survey(of_powers(rate), pieces, lambda _: np.array([1e-8]), 12)


@pytest.mark.parametrize("rate", [1.0, 7.0, 40.0])
@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("entry", [0, 1])
def test_the_largest_of_a_wave_is_found_and_bounded(rate, sign, entry):
    """cos and sin of rate t over three pieces: 1, unless the way there is too short."""
    survey = survey_of_wave(rate)
    assert (survey.remainder <= 1e-8).all()
    assert survey.lengths.sum() == pytest.approx(1.2)
    weights = sign * np.eye(2)[entry]
    found = survey.largest(0, lambda entries: entries @ weights, lambda _: 1e-8)
    t = np.linspace(0.1, 1.3, 200_001)
    wave = sign * (np.cos, np.sin)[entry](rate * t)
    assert wave.max() - 1e-9 <= found.upper_bound <= wave.max() + 3e-8
    assert found.value <= found.upper_bound
    assert found.value >= wave.max() - 3e-8
    assert sign * (np.cos, np.sin)[entry](rate * found.time) == pytest.approx(found.value, abs=1e-7)
    np.testing.assert_allclose(found.entries @ weights, found.value)
    circle = survey.largest(0, norm, lambda _: 1e-8, least=0.0)
    assert 1.0 <= circle.upper_bound <= 1.0 + 3e-8


def test_pieces_are_halved_until_the_remainder_is_small_in_each_function():
    """The remainder of a half is 2^-9 of the whole one, in every piece and every function."""

    def known(coefficients, lengths):
        values = np.ones((len(lengths), 9, 2, 1))
        return values, np.tile([1e-9, 1.0], (len(lengths), 1))

    pieces = np.array([0.0, 8.0]), np.array([8.0, 1.0]), np.zeros((1, 2, 1))
    survey = node_survey(known, pieces, lambda _: np.array([1e-6, 1e-6]), 12)
    order = np.argsort(survey.starts)
    starts, lengths = survey.starts[order], survey.lengths[order]
    np.testing.assert_allclose(np.append(starts, 9.0), np.append(0.0, np.cumsum(lengths)))
    assert (survey.remainder <= 1e-6).all()
    np.testing.assert_allclose(survey.remainder[:, 1], BETWEEN_NODES * survey.lengths**9)
    assert (2 * lengths.max()) ** 9 * BETWEEN_NODES > 1e-6
    assert len(node_survey(known, pieces, lambda _: np.array([1e-6, 1e-6]), 1).lengths) == 4


@pytest.mark.parametrize(("share", "pieces"), [(0.7, 2), (1.4, 1)])
def test_a_piece_is_halved_where_its_remainder_is_above_the_slack(share, pieces):
    def known(coefficients, lengths):
        return np.ones((len(lengths), 9, 1, 1)), np.ones((len(lengths), 1))

    remainder = BETWEEN_NODES * 3.0**9
    whole = np.zeros(1), np.array([3.0]), np.zeros((1, 1, 1))
    assert len(node_survey(known, whole, lambda _: np.array([share * remainder]), 12).lengths) == pieces


@pytest.mark.parametrize("order", [1, -1])
def test_halves_know_where_they_are(order):
    """A long piece is halved three times, a short one not at all."""
    starts, lengths = np.array([2.0, 10.0])[::order], np.array([8.0, 1.0])[::order]
    pieces = starts, lengths, np.stack([np.ones((2, 1)), starts[:, None]])
    survey = node_survey(of_powers(3.0), pieces, lambda _: np.array([1e-5]), 12)
    np.testing.assert_allclose(np.sort(survey.starts), np.arange(2.0, 11.0))
    t = survey.starts[:, None] + survey.lengths[:, None] * NODES
    np.testing.assert_allclose(survey.values[:, :, 0, 0], np.cos(3.0 * t), atol=1e-12)


def test_a_remainder_that_no_float_holds_is_not_worth_halving():
    def known(coefficients, lengths):
        return np.ones((len(lengths), 9, 1, 1)), np.full((len(lengths), 1), np.inf)

    pieces = np.zeros(1), np.ones(1), np.zeros((1, 1, 1))
    assert len(node_survey(known, pieces, lambda _: np.array([1.0]), 12).lengths) == 1


@pytest.mark.parametrize(("given", "pieces"), [(1, 1 << 15), (4096, 1 << 17)])
def test_halves_without_end_are_as_many_as_a_motion_is_worth(given, pieces):
    def known(coefficients, lengths):
        return np.ones((len(lengths), 9, 1, 1)), np.full((len(lengths), 1), 1e200)

    whole = np.arange(float(given)), np.ones(given), np.zeros((1, given, 1))
    survey = node_survey(known, whole, lambda _: np.array([1.0]), 18)
    assert len(survey.lengths) == pieces
    assert survey.lengths.sum() == pytest.approx(given)
    assert (survey.remainder > 1.0).all()


def test_a_slower_piece_that_is_less_well_known_counts_with_what_it_may_be():
    """A piece that rises to 1, and one that stays at 0.9 but may be beside that by 0.5."""
    rising, even = NODES**2, np.full(9, 0.9)
    rows = np.zeros((2, 9, 3))
    rows[:, :, 1] = rising, even
    for order in (slice(None), slice(None, None, -1)):
        found = rest_of(rows[order], np.array([1e-9, 0.5])[order])
        assert found.value == pytest.approx(1.0, rel=1e-12)
        assert found.upper_bound == pytest.approx(1.4, rel=1e-12)
        wavy = rows[:1] + [0, 0, 1] * np.sin(5 * NODES)[:, None]
        both = np.concatenate([wavy, rows[1:]])
        assert rest_of(both[order], np.array([1e-9, 0.5])[order]).upper_bound == pytest.approx(1.4, rel=1e-12)


@pytest.mark.parametrize("order", [[0, 1, 2], [2, 1, 0], [1, 2, 0], [0, 2, 1]])
def test_each_piece_that_is_not_divided_counts_with_what_it_may_be(order):
    """Two even pieces, of which the one that is less well known may come after or before the other, and a hump."""
    pieces = np.stack([0.9 + 0 * NODES, 0.9 + 0 * NODES, 1.0 - 9.0 * (NODES - 0.37) ** 2])
    remainder = np.array([0.5, 0.0, 0.0])
    found = rest_of(pieces[order][..., None], remainder[order], total)
    assert found.upper_bound == pytest.approx(1.4, rel=1e-12)


@pytest.mark.parametrize("order", [1, -1])
def test_a_peak_that_is_none_is_where_the_pieces_begin(order):
    """Nothing moves, or nothing is known: the first moment stands for all of them."""
    starts = [2.0, 4.0, 6.0][::order]
    for remainder in (0.0, np.inf):
        found = surveyed(np.zeros((3, 9, 2)), np.full(3, remainder), starts, [2.0] * 3)
        assert found.largest(0, norm, lambda _: 1e-9, least=0.0).time == 2.0


@pytest.mark.parametrize("piece", [0, 1, 2])
@pytest.mark.parametrize("where", [0.0, 0.1, 0.37, 0.5, 0.81, 1.0])
@pytest.mark.parametrize("sign", [1, -1])
def test_a_peak_in_any_part_of_any_piece_is_found(piece, where, sign):
    """A parabola of height 2 in one of three pieces from 1, 3 and 5 on, and less in the others."""
    values = np.tile(-(NODES**2), (3, 1))
    values[piece] = 2.0 - 3.0 * (NODES - where) ** 2
    found = rest_of(sign * values[..., None], (0.0, 0.0, 0.0), lambda x: sign * total(x), 1e-10, -np.inf)
    assert 2.0 - 1e-12 <= found.upper_bound <= 2.0 + 2e-10
    assert found.value == pytest.approx(2.0, abs=1e-9)
    assert found.time == pytest.approx(1.0 + 2.0 * (piece + where), abs=2e-4)


@pytest.mark.parametrize("remainder", [1e-3, 0.2])
def test_the_remainder_of_the_piece_is_added_once(remainder):
    values = np.stack([2.0 - (NODES - 0.4) ** 2, 1.0 + 0 * NODES])[..., None]
    assert rest_of(values, (remainder, 0.0), total).upper_bound == pytest.approx(2.0 + remainder, rel=1e-8)
    assert rest_of(values, (0.0, remainder), total).upper_bound == pytest.approx(2.0, rel=1e-8)
    assert rest_of(values, (0.0, 1.0 + remainder), total).upper_bound == pytest.approx(
        2.0 + remainder, rel=1e-8
    )


def test_parts_of_a_piece_keep_its_remainder():
    """Both humps are divided; the lower one, near the start of its piece, is the one that is less well known."""
    humps = np.stack([2.0 - 9.0 * (NODES - 0.7) ** 2, 1.9 - 9.0 * (NODES - 0.2) ** 2])[..., None]
    for order in (slice(None), slice(None, None, -1)):
        found = rest_of(humps[order], np.array([0.0, 0.5])[order], total)
        assert 2.4 - 1e-9 <= found.upper_bound <= 2.42


def test_functions_of_one_survey_are_apart():
    values = np.stack([np.full((1, 9, 1), 3.0), np.full((1, 9, 1), 2.0)], axis=2)
    survey = NodeSurvey(np.zeros(1), np.ones(1), values, np.array([[0.5, 0.25]]))
    found = [survey.largest(function, total, lambda _: 1e-9) for function in (0, 1)]
    np.testing.assert_allclose([(one.value, one.upper_bound) for one in found], [(3.0, 3.5), (2.0, 2.25)])


def test_all_negative_efforts_have_a_negative_peak():
    found = rest_of((-5.0 + NODES)[None, :, None], (0.0,), total, 1e-9, -np.inf)
    assert (found.value, found.upper_bound, found.time) == (pytest.approx(-4.0), pytest.approx(-4.0), 3.0)


def test_the_hull_comes_as_near_as_is_asked_for():
    """A smooth hump whose control points are far above it."""
    values = np.polyval(-np.poly([0.1, 0.45, 0.55, 0.9]), NODES)[None, :, None]
    true = np.polyval(-np.poly([0.1, 0.45, 0.55, 0.9]), np.linspace(0, 1, 100_001)).max()
    for slack in (1e-3, 1e-6, 1e-9):
        found = rest_of(values, (0.0,), total, slack, -np.inf)
        assert true - 1e-11 <= found.upper_bound <= true + 2 * slack
        assert found.upper_bound - found.value <= slack


@pytest.mark.parametrize("wrong", [np.inf, np.nan])
def test_what_no_float_holds_is_not_proven(wrong):
    values = np.ones((1, 9, 2))
    assert rest_of(values, (wrong,)).upper_bound == np.inf
    values[0, 3, 1] = wrong
    assert rest_of(values).upper_bound == np.inf


@pytest.mark.parametrize("wrong", [np.nan, np.inf])
@pytest.mark.parametrize("piece", range(3))
def test_one_remainder_that_no_float_holds_is_enough(piece, wrong):
    remainder = np.zeros(3)
    remainder[piece] = wrong
    peak = rest_of(np.zeros((3, 9, 1)), remainder)
    assert (peak.value, peak.upper_bound) == (np.inf, np.inf)


@pytest.mark.parametrize("first", [True, False])
def test_what_was_reached_is_not_lost_where_another_piece_is_looked_at_closely(first):
    """A piece that reaches 1 beside one whose control points are above that, and whose curve is not."""
    hump = 0.98 * (4.0 * NODES * (1.0 - NODES)) ** 4
    hull = hull_matrices()[0] @ hump
    assert hull.max() > 1.2
    values = np.stack([np.linspace(0.0, 1.0, 9), hump] if first else [hump, np.linspace(0.0, 1.0, 9)])[
        ..., None
    ]
    peak = rest_of(values, (0.0, 0.0), size=total)
    assert peak.value == pytest.approx(1.0, abs=1e-12)
    assert peak.time == pytest.approx(3.0 if first else 5.0)
    assert 1.0 <= peak.upper_bound <= 1.0 + 1e-6
