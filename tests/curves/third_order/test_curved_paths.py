"""Rounded polylines and curvature at ends: by what the curves must be at their breaks, and where they were not changed."""

from __future__ import annotations

import numpy as np
import pytest
from jerk_paths import spline

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.curves.third_order.curved_paths import rounded_polyline, with_end_curvature

S = np.array([1.0, 2.0, 3.5, 4.0, 6.0, 7.0])
POINTS = np.array([[0.0, 1.0], [1.0, 1.5], [2.5, 3.0], [1.2, 3.6], [2.0, 6.0], [1.0, 5.5]])
"""At the second corner one joint goes straight on."""
LENGTHS = np.array([0.0, 0.8, 0.3, 0.4, 0.6, 0.0])


def test_a_rounded_polyline_is_straight_but_around_its_corners_where_its_curvature_is_a_triangle():
    points = POINTS.copy()
    points[3:5] = points[2] + np.array([[0.25, 0.5], [1.25, 2.5]])  # no corner between
    curve, beside = rounded_polyline(S, points, LENGTHS)
    slopes = np.diff(points, axis=0) / np.diff(S)[:, None]
    for order in (0, 1, 2):
        first, last = curve.piece_ends(order)
        np.testing.assert_allclose(first[1:], last[:-1], atol=1e-9)
    assert curve.evaluate(S[[0, -1]]) == pytest.approx(points[[0, -1]])
    for k, length in enumerate(LENGTHS):
        if not 0 < k < 5:
            continue
        turn = slopes[k] - slopes[k - 1]
        for sign, slope in ((-1, slopes[k - 1]), (1, slopes[k])):
            border = S[k] + sign * 0.5 * length
            np.testing.assert_allclose(
                curve.evaluate(border), points[k] + slope * (border - S[k]), atol=1e-12
            )
            np.testing.assert_allclose(curve.evaluate(border, 1), slope, atol=1e-12)
            half = S[k] + sign * 0.25 * length
            np.testing.assert_allclose(curve.evaluate(half, 2), turn / length, atol=1e-9)
        np.testing.assert_allclose(curve.evaluate(S[k], 2), 2 * turn / length, atol=1e-9)
        off = np.abs(curve.evaluate(S[k]) - points[k])
        np.testing.assert_allclose(beside[k], off, atol=1e-12)
        np.testing.assert_allclose(off, np.abs(turn) * length / 12, atol=1e-12)
    assert not beside[[0, 3, 5]].any()
    assert curve.pieces == 5 + 2 * 3  # nothing is rounded where it goes straight on


def test_corners_without_a_length_stay():
    curve, beside = rounded_polyline(S, POINTS, np.zeros(6))
    assert not beside.any()
    np.testing.assert_allclose(curve.evaluate(S), POINTS, atol=1e-12)
    assert curve.pieces == 5


@pytest.mark.parametrize("start", [None, np.array([0.0, 0.0]), np.array([3.0, -2.0])])
@pytest.mark.parametrize("end", [None, np.array([0.0, 0.0]), np.array([-1.0, 4.0])])
@pytest.mark.parametrize("degree", [2, 3])
def test_the_curvature_at_an_end_is_the_one_that_is_asked_for_and_nothing_else_changes(start, end, degree):
    path = spline([1.0, 1.5, 2.5, 3.0, 5.0], np.random.default_rng(3).normal(size=(5, 2)))
    if degree == 2:
        path = PiecewisePolynomial(path.breaks, path.coefficients[1:])
    found = with_end_curvature(path, start, end)
    for order in range(3):
        first, last = found.piece_ends(order)
        begin, finish = path.piece_ends(order)
        inner = np.isin(found.breaks, path.breaks[1:-1])[1:-1]
        if degree == 3:
            np.testing.assert_allclose(first[1:], last[:-1], atol=1e-9)
        else:  # its curve jumps at breaks, and inside the pieces that were replaced it does not
            np.testing.assert_allclose(first[1:][~inner], last[:-1][~inner], atol=1e-9)
        if order < 2:
            np.testing.assert_allclose(first[0], begin[0], atol=1e-12)
            np.testing.assert_allclose(last[-1], finish[-1], atol=1e-9)
    for wanted, at, usual in ((start, 0, path.piece_ends(2)[0][0]), (end, -1, path.piece_ends(2)[1][-1])):
        here = found.piece_ends(2)[0 if at == 0 else 1][at]
        np.testing.assert_allclose(here, usual if wanted is None else wanted, atol=1e-9)
    s = np.linspace(1.5, 3.0, 50, endpoint=False)
    s = np.concatenate(
        [s, np.linspace(1.0, 1.5, 20)[:-1] * (start is None), np.linspace(3.0, 5.0, 20) * (end is None)]
    )
    s = s[s > 0.0]
    np.testing.assert_allclose(found.evaluate(s), path.evaluate(s), atol=1e-12)
    for value in (1.5, 2.5, 3.0):
        for side in ("left", "right"):
            for order in range(3):
                np.testing.assert_allclose(
                    found.evaluate(value, order, side=side), path.evaluate(value, order, side=side), atol=1e-9
                )
    assert found.breaks[0] == 1.0
    assert found.pieces == 4 + 2 * (start is not None) + 2 * (end is not None)
