"""Polynomials as they are printed: those of neighbouring pieces that are one, against numpy's polynomials."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from trajcli.cli.polynomials import polynomial_text
from trajcli.output.polynomials import multiples_of_pi, polynomial_intervals

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


@pytest.mark.parametrize("origin", [0.0, 0.75, -2.0])
@pytest.mark.parametrize("unit", ["rad", "deg"])
def test_shifts_and_derivatives_are_those_of_numpy(origin, unit):
    breaks = np.array([0.0, 0.5, 1.25, 2.0, 3.0])
    found = polynomial_intervals(
        breaks, cut(breaks, [CUBIC, CUBIC, OTHER, CUBIC]), unit, origin=origin, derivatives=True
    )
    for each, polynomial in zip(found, (CUBIC, OTHER, CUBIC), strict=True):
        np.testing.assert_allclose(each.velocity, polynomial.deriv().coef, rtol=0, atol=1e-12)
        np.testing.assert_allclose(each.acceleration, polynomial.deriv(2).coef, rtol=0, atol=1e-12)
        assert (each.unshifted is None) == (origin == 0)
        if origin:
            shifted = polynomial(Polynomial([origin, 1.0])).coef
            np.testing.assert_allclose(each.unshifted, shifted, rtol=0, atol=1e-12)
        assert each.in_pi is None
    turns = cut(breaks, [Polynomial([np.pi, 0, np.pi / 2, 0])] * 4)
    (whole,) = polynomial_intervals(breaks, turns, unit)
    assert whole.in_pi == (["pi", None, "pi/2", None] if unit == "rad" else None)


def value_of(text):
    """Return the number that a multiple of pi is, as it is printed."""
    size, _, below = text.partition("pi")
    size = size.strip() + ("1" if size.strip() in ("", "-") else "")
    return int(size), int(below.removeprefix("/") or 1)


def test_multiples_of_pi_are_fractions_in_lowest_terms():
    """All below 200 are told, in either direction; 201 is too large a denominator, and roots are no fractions."""
    generator = np.random.default_rng(8)
    fractions = [
        Fraction(1, 200),
        Fraction(199, 200),
        Fraction(10_000),
        Fraction(1),
        Fraction(2, 3),
        Fraction(1, 2),
    ]
    fractions += [
        Fraction(int(generator.integers(1, 2000)), int(generator.integers(1, 201))) for _ in range(60)
    ]
    for sign in (1, -1):
        for fraction, text in zip(
            fractions, multiples_of_pi([sign * float(f) * np.pi for f in fractions]), strict=True
        ):
            assert value_of(text) == (sign * fraction.numerator, fraction.denominator), fraction
    assert multiples_of_pi([-np.pi, np.pi / 2, -np.pi / 2, 3 * np.pi]) == ["-pi", "pi/2", "-pi/2", "3 pi"]
    none = [
        0.0,
        np.pi / 201,
        -np.pi / 2001,
        np.pi * 10_001,
        np.sqrt(2),
        1.0,
        np.pi / 3 * (1 + 2e-10),
        np.pi * 0.30103,
    ]
    assert multiples_of_pi(none) == [None] * len(none)


def test_rounding_is_measured_by_the_piece_that_it_is_in():
    """A small piece beside a large one keeps its terms, where they are more than rounding of all."""
    rows = np.array([[0.0, 0.0], [3e-13, 0.0], [0.0, 1.0]])
    small, large = polynomial_intervals(np.array([0.0, 1.0, 2.0]), rows, "deg")
    assert small.local == [0, 3e-13, 0]
    assert large.local == [1, 0, 0]


def test_what_is_a_billionth_of_the_largest_term_is_none_of_rounding():
    (found,) = polynomial_intervals(np.array([0.0, 1.0]), np.array([[1e-9], [0.0], [1.0]]), "deg")
    assert found.local == [1.0, 0.0, 1e-9]


def test_noise_of_a_piece_at_rest_is_measured_by_all_pieces():
    """5e-14 beside a way of 10: nothing moves by that."""
    rows = np.array([[5.0, 0.0], [0.0, 5e-14]])
    found = polynomial_intervals(np.array([0.0, 2.0, 3.0]), rows, "deg")
    assert [each.local for each in found] == [[0.0, 5.0], [0.0, 0.0]]
