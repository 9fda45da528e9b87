"""Polynomials as they are printed: those of neighbouring pieces that are one, against numpy's polynomials."""

from __future__ import annotations

import numpy as np
from numpy.polynomial import Polynomial

from trajcli.cli.polynomials import polynomial_text
from trajcli.output.polynomials import polynomial_intervals

CUBIC = Polynomial([1.0, -2.0, 0.5, 0.25])
OTHER = Polynomial([3.0, -2.0, 0.5, 0.25])


def cut(breaks, polynomials):
    """Return local coefficients (4, pieces), highest power first, of polynomials in absolute time."""
    local = [p(Polynomial([start, 1.0])).coef for start, p in zip(breaks, polynomials, strict=False)]
    return np.array([np.pad(row, (0, 4 - row.size)) for row in local]).T[::-1]


def test_equal_neighbours_are_one_polynomial():
    breaks = np.array([0.0, 0.5, 1.25, 2.0, 3.0])
    rows = cut(breaks, [CUBIC, CUBIC, CUBIC, OTHER])
    found = polynomial_intervals(breaks, rows, "rad")
    assert [(each.start, each.end) for each in found] == [(0.0, 2.0), (2.0, 3.0)]
    for each, polynomial in zip(found, (CUBIC, OTHER), strict=True):
        np.testing.assert_allclose(each.absolute, polynomial.coef, rtol=0, atol=1e-12)
        shifted = polynomial(Polynomial([each.start, 1.0])).coef
        np.testing.assert_allclose(each.local, shifted, rtol=0, atol=1e-12)
    apart = polynomial_intervals(breaks, rows, "rad", join=False)
    assert [(each.start, each.end) for each in apart] == [(0, 0.5), (0.5, 1.25), (1.25, 2), (2, 3)]


def test_polynomials_that_drift_away_are_not_one():
    breaks = np.arange(5.0)
    found = polynomial_intervals(
        breaks, cut(breaks, [Polynomial([1.0 + 6e-10 * k]) for k in range(4)]), "rad"
    )
    assert [(each.start, each.end) for each in found] == [(0, 2), (2, 4)]


def test_what_came_from_rounding_is_not_printed():
    found = polynomial_intervals(np.array([0.0, 2.0]), np.array([[1e-14], [0.5], [1e-15], [1.0]]), "rad")
    assert polynomial_text(found[0].absolute) == "1 + 0.5 t^2"


def test_what_rounding_leaves_of_a_joint_at_rest_is_not_printed():
    rows = np.array([[6e-28, 0.0], [0.0, -3e-17], [2e-19, 0.0], [0.0, 0.0]])
    found = polynomial_intervals(np.array([0.0, 2.0, 3.0]), rows, "rad")
    assert [polynomial_text(each.absolute) for each in found] == ["0"]
    rows = np.array([[0.0, 1e-16], [0.0, 0.0], [5.0, 0.0], [0.0, 1e-15]])  # a piece at rest beside a long way
    found = polynomial_intervals(np.array([0.0, 2.0, 3.0]), rows, "rad")
    assert [polynomial_text(each.local) for each in found] == ["5 t", "0"]


def test_small_motions_are_no_rounding():
    found = polynomial_intervals(np.array([0.0, 1e-3]), np.array([[2e-9], [0.0], [1e-10]]), "m")
    assert polynomial_text(found[0].absolute) == "1e-10 + 2e-09 t^2"
