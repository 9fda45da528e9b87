"""What rounding does to a fit of quintic pieces, and what it does not: noise in units in the last place."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from trajcli.curves.hermite_fit import fit

ULP = 2.0**-52  # of numbers from 1 to 2
NOISE = 4  # such units, by which values may be off


@dataclass
class Known:
    """Value, slope and curvature (3, N, n)."""

    values: np.ndarray


def within(tolerance):
    return lambda known, rows, fitted: np.abs(fitted - known.values[:, rows]).max(axis=(0, 2)) / tolerance


def flat(places):
    return np.full((places.size, 1), 1.5)


def noisy(places, side, guess):
    """A constant, whose values are off by four units up or down, which places nearby know nothing of."""
    up = np.sin(places * 1e17) > 0
    values = np.zeros((3, places.size, 1))
    values[0, :, 0] = 1.5 + np.where(up, NOISE, -NOISE) * ULP
    return Known(values)


@pytest.mark.parametrize("width", [1e-3, 1e-5, 1e-7])
def test_noise_at_the_ends_of_pieces_is_not_refined_away(width):
    """A quintic between values that differ by d has a second derivative of up to 10 / sqrt(3) d / width^2."""
    breaks = 1.0 + width * np.arange(41)
    curve = fit(noisy, within(1e-9), breaks, flat)
    assert curve.pieces == 40
    ends = np.concatenate([curve.piece_ends(0)[0], curve.piece_ends(0)[1][-1:]])
    jumps = np.abs(np.diff(ends[:, 0])).max()
    assert jumps == 2 * NOISE * ULP
    t = np.linspace(breaks[0], breaks[-1], 8001)
    assert np.abs(curve.evaluate(t, 2)).max() == pytest.approx(10 / np.sqrt(3) * jumps / width**2, rel=1e-2)


def off_by(order, tolerance):
    """Return the misfit of one derivative alone."""
    return lambda known, rows, fitted: np.abs(fitted - known.values[:, rows])[order].max(axis=1) / tolerance


@pytest.mark.parametrize("level", [1.5, 1e-2])
@pytest.mark.parametrize("width", [1e-3, 1e-5])
@pytest.mark.parametrize("order", [0, 1])
def test_noise_in_values_and_slopes_is_not_refined_away(order, width, level):
    """Of ends that are off by two units each the slope between them holds 15 / 8 of four units.

    So are those of small numbers: a search rounds as the numbers of its arm do, which are about 1. Between the ends
    a curvature that nobody asks about may be anything.
    """
    breaks = 1.0 + width * np.arange(41)

    def half_as_noisy(places, side, guess):
        known = noisy(places, side, guess)
        known.values[0] = level + (known.values[0] - 1.5) / 2
        known.values[2] = np.where(np.isin(places, breaks), 0.0, 1.0 / width**2)[:, None]
        return known

    curve = fit(half_as_noisy, off_by(order, ULP / 8 if order == 0 else 1e-14), breaks, flat)
    assert curve.pieces == 40


@pytest.mark.parametrize("probe", [0, 1, 2])
def test_noise_is_explained_by_the_tolerance_of_where_it_is(probe):
    """Pieces of which one place alone has a tolerance that noise exceeds: the others say nothing of that one."""
    breaks = 1.0 + 1e-3 * np.arange(41)

    def placed(places, side, guess):
        values = noisy(places, side, guess).values
        line = np.stack([places, np.ones_like(places), np.zeros_like(places)])
        return Known(np.concatenate([values, line[..., None]], axis=2))

    def misfit(known, rows, fitted):
        within_piece = (known.values[0, rows, 1] - 1.0) / 1e-3 % 1.0
        here = np.digitize(within_piece, [0.4, 0.6]) == probe
        return np.abs(fitted - known.values[:, rows])[2, :, 0] / np.where(here, 1e-9, 1e3)

    curve = fit(placed, misfit, breaks, lambda places: np.full((places.size, 2), 1.5))
    assert curve.pieces == 40


@pytest.mark.parametrize("order", [1, -1])
def test_noise_of_large_numbers_beside_small_ones_is_not_refined_away(order):
    """A unit in the last place of 3000 is 2048 of those of 1.5; the column of these is met exactly."""
    breaks = 1.0 + 1e-3 * np.arange(41)

    def both(places, side, guess):
        values = noisy(places, side, guess).values
        large, small = 2048.0 * values, np.zeros_like(values)
        small[0] = 1.5
        return Known(np.concatenate([large, small][::order], axis=2))

    curve = fit(both, within(1e-9), breaks, lambda places: np.full((places.size, 2), 1.5))
    assert curve.pieces == 40


@pytest.mark.parametrize("times", [1.1, 2.0])
@pytest.mark.parametrize(
    ("order", "share"),
    [(0, 1 / 64), (1, 0.04 * 0.6 * 5**0.5), (2, 0.375)],
    ids=["value", "slope", "curvature"],
)
def test_what_rounding_does_not_explain_is_refined(order, share, times):
    """Of a x^6 a quintic piece leaves out a (x - b)^3 (e - x)^3, of which `share` is the largest by its derivatives.

    That is many times what values that are off by half a unit each could do, which is all that they are here.
    """
    length = 1e-2
    error = {0: 15, 1: 30, 2: 600}[order] * ULP / length**order
    size = error / share / length ** (6 - order)

    def power(places):
        x = places - length / 2
        return np.stack([1.5 + size * x**6, 6 * size * x**5, 30 * size * x**4])[:, :, None]

    curve = fit(
        lambda places, side, guess: Known(power(places)),
        off_by(order, error / times),
        np.array([0.0, length]),
        flat,
    )
    assert curve.pieces > 1
    t = np.linspace(0.0, length, 4001)
    assert np.abs(curve.evaluate(t, order) - power(t)[order]).max() <= error / times * 1.2
