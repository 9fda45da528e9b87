"""Knots beside breaks: small and short steps, the end, and curves and rows that begin at another time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_knots import ending, made_of, played, rising

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.errors import InputError
from trajcli.knots import LARGEST_DEVIATION, has_knots, knot_grid, knots_at, knots_of, stated_by
from trajcli.trajectory import resting


@pytest.mark.parametrize(("change", "real"), [(1e-6, True), (-1e-6, True), (5e-4, True), (1e-11, False)])
def test_small_steps_have_two_knots_and_rounding_has_none(change: float, real: bool) -> None:
    curve = rising([0.0, 1.0, 2.0], [1.0, 1.0 + change], 2)
    between = knots_of(made_of(curve, ending(curve))).nanoseconds[1:-1].tolist()
    assert between == ([999_800_000, 1_000_200_000] if real else [1_000_000_000])


@pytest.mark.parametrize(("length", "size"), [(5e-6, 200.0), (1e-9, 5e9)])
def test_a_velocity_that_changes_between_two_knots_is_no_step_of_the_acceleration(
    length: float, size: float
) -> None:
    """By 0.001 or 5 rad/s of one; behind it the joint slows down by 1 rad/s^2. The step before it stays one."""
    curve = rising([0.0, 1.0, 2.0, 2.0 + length, 2.5], [1.0, 0.0, size, -1.0], 2)
    knots = knots_of(made_of(curve, ending(curve)))
    whole = knots.nanoseconds
    assert 2_000_000_000 in whole
    assert {999_800_000, 1_000_200_000} <= set(whole.tolist())
    assert np.abs(knots.acceleration).max() <= 200.0  # no row holds what lasts a nanosecond


def test_a_step_over_several_breaks_between_two_knots_is_one() -> None:
    """From 1 to -1 rad/s^2 within 30 ns: quintics about it go evenly from one to the other, and past neither."""
    curve = rising([0.0, 1.0, 1.00000001, 1.00000003, 2.0], [1.0, 0.5, -0.5, -1.0], 2)
    knots = knots_of(made_of(curve, ending(curve)))
    acceleration = played(knots, 1.0 + np.linspace(-1e-3, 1e-3, 2001))[2]
    assert np.abs(acceleration).max() <= 1 + 1e-3


def test_cubics_divide_a_fourth_power_as_often_as_its_error_asks() -> None:
    """Of t^4 a cubic misses (h / 2)^4 at most (Hermite): 16 intervals are within 1e-7 of a tenth of it, and 15 not."""
    coefficients = np.zeros((5, 1, 1))
    coefficients[0] = 0.1
    curve = PiecewisePolynomial(np.array([0.0, 1.0]), coefficients)
    knots = knots_of(made_of(curve, ending(curve)), 2)
    assert 0.1 / 30**4 > LARGEST_DEVIATION / 10 > 0.1 / 32**4
    assert len(knots.nanoseconds) == 17
    assert knots.deviation.position == pytest.approx(0.1 / 32**4, rel=1e-6)


@pytest.mark.parametrize(("beside", "last"), [(4e-10, 1), (-4e-10, 0), (1e-13, 0), (0.0, 0)])
def test_the_last_knot_is_the_end_rounded_up(beside: float, last: int) -> None:
    curve = rising([0.0, 1.0 + beside], [1.0], 2)
    trajectory = made_of(curve, ending(curve))
    for knots in (
        knots_of(trajectory),
        knots_of(trajectory, 2),
        knots_at(trajectory, np.array([0.0, curve.end])),
    ):
        assert knots.nanoseconds[-1] == 1_000_000_000 + last


def test_rows_at_knots_count_from_the_start_time() -> None:
    trajectory = made_of(curve := rising([0.0, 1.0], [1.0], 2), ending(curve))
    knots = knots_of(trajectory)
    for rate in (None, 10.0):
        written, local = next(knot_grid(trajectory, knots, rate, 2.5).blocks())
        assert (written == 2.5 + local).all()
    with pytest.raises(InputError, match="too high"):  # late, float64 tells no microseconds apart
        knot_grid(trajectory, knots, 1e6, 1e10)


def test_the_curve_may_begin_at_any_time() -> None:
    trajectory = made_of(curve := rising([0.0, 0.5, 1.5], [1.0, -1.0], 2), ending(curve))
    later = replace(trajectory, curve=PiecewisePolynomial(curve.breaks + 4.0, curve.coefficients))
    times = np.array([0.0, 0.3, 1.5])
    for one, other in (
        (knots_of(trajectory), knots_of(later)),
        (knots_at(trajectory, times), knots_at(later, times)),
    ):
        assert one.nanoseconds.tolist() == other.nanoseconds.tolist()
        for name in ("position", "velocity", "acceleration"):
            assert getattr(other, name) == pytest.approx(getattr(one, name), abs=1e-9)
        assert other.deviation.position == pytest.approx(one.deviation.position, rel=1e-6, abs=1e-12)


@pytest.mark.parametrize("behind", [4094, 4095, 4096, 8191])
def test_the_deviation_is_that_of_any_of_thousands_of_intervals(behind: int) -> None:
    """Of t^6 a quintic misses (h / 2)^6 at most (Hermite), and one interval is longer than the others."""
    coefficients = np.zeros((7, 1, 1))
    coefficients[0] = 1.0
    curve = PiecewisePolynomial(np.array([0.0, 1.0]), coefficients)
    times = np.append(np.linspace(0.0, 0.8, behind + 1), np.linspace(0.9, 1.0, 100))
    found = knots_at(made_of(curve, ending(curve)), times).deviation
    assert found.position == pytest.approx(0.05**6, rel=1e-6)


def test_what_an_end_rounded_up_costs_is_said() -> None:
    """1000 rad/s up to 0.6 ns before its knot: a quintic up to the knot is that much behind at the end."""
    curve = rising([0.0, 1.0 + 4e-10], [1000.0], 1)
    knots = knots_at(made_of(curve, ending(curve)), np.array([0.0, curve.end]))
    assert knots.nanoseconds[-1] == 1_000_000_001
    assert knots.deviation.position == pytest.approx(1000 * 6e-10, rel=1e-3)


@pytest.mark.parametrize(("columns", "stated"), [("q", 3), ("q qd", 2), ("q qdd", 3), ("q qd qdd", 3)])
def test_rows_of_velocities_alone_are_joined_by_cubics(columns: str, stated: int) -> None:
    assert stated_by(["t", *columns.split()]) == stated


def test_a_velocity_that_changes_in_a_row_costs_a_microsecond_of_it() -> None:
    """By 0.01 rad/s in 3 ns."""
    curve = rising([0.0, 0.1, 0.1 + 3e-9, 2.0], [0.0, 0.01 / 3e-9, 0.0], 2)
    assert knots_of(made_of(curve, ending(curve)), 2).deviation.position <= 0.01 * 1e-6


@pytest.mark.parametrize(("duration", "told"), [(9.007e6, True), (9.008e6, False)])
def test_nanoseconds_are_told_apart_up_to_two_to_the_53(duration: float, told: bool) -> None:
    assert (np.spacing(duration * 1e9) <= 1.0) == told
    assert has_knots(made_of(rising([0.0, duration], [0.0], 1), resting(np.zeros(1)))) == told
