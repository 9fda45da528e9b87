"""Critical points where they are known: near the ends of a piece, close together, of any size, of every order."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from trajcli.curves.extrema import critical_points, durations_above, peaks, piece_extremes
from trajcli.curves.piecewise import PiecewisePolynomial

SIGNS = pytest.mark.parametrize("sign", [1.0, -1.0])


def with_turns(turns: list[float], length: float = 1.0, sign: float = 1.0) -> np.ndarray:
    """Return coefficients (degree + 1, 1, 1) of a polynomial whose derivative has these roots, times the length."""
    slope = [Fraction(1)]
    for turn in turns:
        slope = [
            a - Fraction(turn) * b for a, b in zip([*slope, Fraction(0)], [Fraction(0), *slope], strict=True)
        ]
    degree = len(slope)
    whole = [each / (degree - k) for k, each in enumerate(slope)]
    powers = Fraction(length) ** np.arange(degree, 0, -1)
    scaled = [float(each / power) for each, power in zip(whole, powers, strict=True)]
    return sign * np.array([*scaled, 0.7])[:, None, None]


@SIGNS
@pytest.mark.parametrize("length", [1.0, 0.02, 40.0])
@pytest.mark.parametrize(
    "turns",
    [
        [0.003],
        [0.998],
        [0.003, 0.998],
        [0.4, 0.4005],
        [-0.3, 0.004, 0.996],
        [0.002, 0.5, 0.997],
        [0.001, 0.3, 0.6, 0.999],
        [0.004, 0.2, 0.5, 0.8, 0.995],
        [0.3, 0.302, 0.9, 1.4],
        [0.996, 1.2, -2.0, 3.0],
    ],
)
def test_every_turn_within_a_piece_is_found(turns: list[float], length: float, sign: float) -> None:
    coefficients = with_turns(turns, length, sign)
    (found,) = critical_points(coefficients, np.array([length]), (0,))
    inner = [turn for turn in turns if 0 < turn < 1]
    near = np.abs(found[:, 0, 0][:, None] / length - inner).min(axis=0)
    np.testing.assert_allclose(near, 0.0, atol=1e-11)
    ((low, high),) = piece_extremes(coefficients, np.array([length]), (0,))
    dense = np.polyval(coefficients[:, 0, 0], np.array([0.0, length, *(length * np.array(inner))]))
    assert (low[0, 0], high[0, 0]) == pytest.approx((dense.min(), dense.max()), rel=1e-13)


@SIGNS
@pytest.mark.parametrize("bent", [1e-10, 1e-13, 1e-17, -1e-13, 0.0])
def test_a_motion_that_is_nearly_a_parabola_turns_where_that_does(bent: float, sign: float) -> None:
    """x - x^2 + bent x^3: of the two turns one is far away, and the other loses no digit to it."""
    coefficients = sign * np.array([bent, -1.0, 1.0, 0.2])[:, None, None]
    (found,) = critical_points(coefficients, np.ones(1), (0,))
    assert np.abs(found - 0.5).min() < 1e-10
    ((low, high),) = piece_extremes(coefficients, np.ones(1), (0,))
    wanted = sorted([sign * 0.2, sign * 0.45])
    assert (low[0, 0], high[0, 0]) == pytest.approx(wanted, abs=1e-9)


@pytest.mark.parametrize("size", [1e-200, 1e-30, 1.0, 1e30, 1e150])
@pytest.mark.parametrize("turns", [[0.2, 0.9], [0.1, 0.5, 0.8], [0.05, 0.3, 0.6, 0.97]])
def test_peaks_scale_with_the_values(turns: list[float], size: float) -> None:
    coefficients = with_turns(turns)
    coefficients[-1] = 0.0
    curve, scaled = (PiecewisePolynomial(np.array([0.0, 1.0]), k * coefficients) for k in (1.0, size))
    for one, other in zip(peaks(curve, (0, 1, 2)), peaks(scaled, (0, 1, 2)), strict=True):
        assert other.low[0] / size == pytest.approx(one.low[0], rel=1e-12)
        assert other.high[0] / size == pytest.approx(one.high[0], rel=1e-12)
        assert (other.low_time[0], other.high_time[0]) == (
            pytest.approx(one.low_time[0], abs=1e-9),
            pytest.approx(one.high_time[0], abs=1e-9),
        )


@pytest.mark.parametrize("offset", [0.0, 1e3, -1e250])
def test_where_a_motion_stands_has_no_say_in_how_fast_it_is(offset: float) -> None:
    """Rest to rest by a quintic: 15/8 of the distance in the middle, 10 / sqrt(3) at (3 -+ sqrt(3)) / 6."""
    size = 1e-60
    coefficients = np.array([6 * size, -15 * size, 10 * size, 0.0, 0.0, offset])[:, None, None]
    first, second = peaks(PiecewisePolynomial(np.array([0.0, 1.0]), coefficients), (1, 2))
    assert first.high[0] == pytest.approx(15 / 8 * size, rel=1e-12)
    assert (second.low[0], second.high[0]) == pytest.approx(
        (-10 / 3**0.5 * size, 10 / 3**0.5 * size), rel=1e-12
    )
    assert second.high_time[0] == pytest.approx((3 - 3**0.5) / 6, abs=1e-9)


@SIGNS
@pytest.mark.parametrize("length", [1.0, 0.1, 7.0])
def test_how_long_a_curve_is_above_a_level(length: float, sign: float) -> None:
    """4 x (1 - x) is above 3/4 for half of the time, and above 0 always; with the other sign it is never so high."""
    parabola = sign * np.array([-4.0 / length**2, 4.0 / length, 0.0])
    coefficients = np.repeat(parabola[:, None, None], 3, axis=2)
    levels = np.array([0.75, 0.0, -0.75])
    times = durations_above(coefficients, np.array([length]), levels)
    wanted = [[0.5, 1.0, 1.0]] if sign > 0 else [[0.0, 0.0, 0.5]]
    np.testing.assert_allclose(times, length * np.array(wanted), rtol=1e-12, atol=1e-12)


def test_how_long_a_curve_that_crosses_three_times_is_above() -> None:
    """(x - 0.1) (x - 0.4) (x - 0.95) is positive from 0.1 to 0.4 and behind 0.95; one that stays at its level is."""
    cubic = np.poly([0.1, 0.4, 0.95]) + np.array([0.0, 0.0, 0.0, -2.0])
    coefficients = np.zeros((4, 2, 2))
    coefficients[:, :, 0] = cubic[:, None]
    coefficients[-1, :, 1] = 3.0, 2.0
    times = durations_above(coefficients, np.array([1.0, 0.5]), np.array([-2.0, 3.0]))
    np.testing.assert_allclose(times, [[0.35, 1.0], [0.3, 0.0]], atol=1e-11)


@SIGNS
@pytest.mark.parametrize("length", [0.2, 1.0, 3.0])
@pytest.mark.parametrize(
    "turns", [[-0.5, 0.5], [-0.7, -0.2], [1.5, 3.0], [-0.4, 0.3, 2.0], [-0.4, -0.1, 0.3, 0.9]]
)
def test_points_stay_within_their_piece_and_in_order(turns: list[float], length: float, sign: float) -> None:
    for found in critical_points(with_turns(turns, length, sign), np.array([length]), (0, 1)):
        assert ((found >= 0.0) & (found <= length)).all()
        assert (np.diff(found, axis=0) >= 0.0).all()


@SIGNS
@pytest.mark.parametrize(
    "coefficients",
    [
        [0.4, 0.3, 0.4, -0.7, 0.3],
        [-0.1, 0.0, 2.0, -2.8, -0.6],
        [0.3, -0.8, -0.6, 1.2, -0.7],
        [-0.3, 0.6, 1.0, -1.5, -0.2, -0.9],
        [0.2, -1.4, 1.1, 2.2, -0.5, -0.3, -1.7, -1.0],
    ],
)
def test_a_root_that_is_met_is_not_left_again(coefficients: list[float], sign: float) -> None:
    """Where a value is none but for rounding, Newton's next step may be no smaller than the one before it."""
    rows = sign * np.array(coefficients)
    found = piece_extremes(rows[:, None, None], np.ones(1), (0, 1, 2))
    for order, (low, high) in enumerate(found):
        derived = np.polyder(rows, order)
        roots = np.roots(np.polyder(derived))
        turns = roots[(np.abs(roots.imag) < 1e-9) & (roots.real > 0) & (roots.real < 1)].real
        values = np.polyval(derived, [0.0, 1.0, *turns])
        assert (low[0, 0], high[0, 0]) == pytest.approx((values.min(), values.max()), rel=1e-12)
