"""Points that draw a curve: on it, at its steps and extremes, dense enough, and few where rows are many."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import PPoly

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.plots.sampling import component_points, local_times, thinned, without_repeats


def random_curve(degree: int, pieces: int, seed: int) -> PiecewisePolynomial:
    rng = np.random.default_rng(seed)
    breaks = np.concatenate([[0.0], np.cumsum(rng.uniform(0.05, 1.0, pieces))])
    return PiecewisePolynomial(breaks, rng.normal(size=(degree + 1, pieces, 2)))


@pytest.mark.parametrize("order", [0, 1, 2, 3])
@pytest.mark.parametrize("degree", [1, 3, 5, 9])
def test_the_points_are_those_of_scipy_with_both_sides_of_breaks_and_the_extremes(
    order: int, degree: int
) -> None:
    curve = random_curve(degree, 4, degree + order)
    times, values = component_points(curve, order, 1)
    assert (np.diff(times) >= 0).all()
    for k in range(curve.pieces):
        low, high = curve.breaks[k : k + 2]
        piece = PPoly(curve.coefficients[:, k : k + 1, 1], [0.0, high - low]).derivative(order)
        inside = (times >= low) & (times <= high)
        own = np.isclose(values[inside], piece(times[inside] - low), rtol=1e-9, atol=1e-9)
        assert own.sum() >= inside.sum() - 2  # the neighbours' points at both borders are not of this piece
        assert piece(0.0) == pytest.approx(values[times == low][-1])
        assert piece(high - low) == pytest.approx(values[times == high][0])
        dense = piece(np.linspace(0, high - low, 20001))
        assert values[inside].max() >= dense.max() - 1e-9 * np.abs(dense).max()
        assert values[inside].min() <= dense.min() + 1e-9 * np.abs(dense).max()


def test_straight_lines_between_the_points_are_the_curve_as_far_as_a_panel_shows() -> None:
    curve = random_curve(5, 3, 7)
    times, values = component_points(curve, 1, 0)
    dense = np.linspace(curve.start, curve.end, 5001)[1:-1]
    exact = PPoly(curve.coefficients[:, :, 0], curve.breaks).derivative()(dense)
    off_break = np.abs(dense[:, None] - curve.breaks).min(axis=1) > 1e-6
    drawn = np.interp(dense, times, values)
    assert np.abs(drawn - exact)[off_break].max() < 2e-4 * np.ptp(exact)


def test_a_step_is_two_points_of_one_time_and_straight_pieces_have_only_their_ends() -> None:
    bang = PiecewisePolynomial([0.0, 1.0, 3.0], [[[2.0], [-1.0]], [[0.0], [4.0]], [[0.0], [2.0]]])
    times, values = component_points(bang, 2, 0)
    assert times.tolist() == [0.0, 1.0, 1.0, 3.0]
    assert values.tolist() == [4.0, 4.0, -2.0, -2.0]
    times, values = component_points(bang, 1, 0)
    assert times.tolist() == [0.0, 1.0, 3.0]
    assert values.tolist() == [0.0, 4.0, 0.0]


def test_a_curve_of_no_length_is_one_point() -> None:
    times, values = component_points(PiecewisePolynomial([2.0, 2.0], [[[5.0]]]), 0, 0)
    assert times.tolist() == [2.0]
    assert values.tolist() == [5.0]
    piece, local = local_times(PiecewisePolynomial([2.0, 2.0], [[[5.0]]]))
    assert set(piece) == {0}
    assert set(local) == {0.0}


@pytest.mark.parametrize("count", [10, 4001, 100_003])
def test_a_thinned_line_keeps_its_ends_and_every_extreme_of_a_stretch(count: int) -> None:
    rng = np.random.default_rng(count)
    x, y = np.arange(count) / 1000, rng.normal(size=count)
    kept_x, kept_y = thinned(x, y)
    assert kept_x.size <= max(4000, count if count < 4001 else 0) + 4
    assert (np.diff(kept_x) > 0).all()
    assert set(zip(kept_x, kept_y, strict=True)) <= set(zip(x, y, strict=True))
    for low, high in ((0, count), (0, count // 3), (count // 3, count)):
        part = (kept_x >= x[low]) & (kept_x <= x[high - 1])
        middle = slice(low + count // 900 + 1, high - count // 900 - 1)
        if count > 4001:
            assert kept_y[part].max() >= y[middle].max()
            assert kept_y[part].min() <= y[middle].min()
    assert (kept_x[0], kept_x[-1]) == (x[0], x[-1])


def test_only_points_that_repeat_the_one_before_are_left_out() -> None:
    x, y = without_repeats(np.array([0.0, 0.0, 1.0, 1.0, 1.0]), np.array([1.0, 1.0, 1.0, 2.0, 2.0]))
    assert x.tolist() == [0.0, 1.0, 1.0]
    assert y.tolist() == [1.0, 1.0, 2.0]
