"""Rows over the intervals of a grid: against integrals by scipy, and the equation of work and energy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.curves.time_optimal.collocation import IntervalRows, interval_rows
from trajcli.curves.time_optimal.constraints import ConstraintRows, JointConstraint

NOWHERE = np.empty(0)
Function = Callable[[np.ndarray], np.ndarray]


@dataclass
class Known:
    """Rows a u + b x <= c of known functions of s, and a cap."""

    a: Function
    b: Function
    c: Function
    cap: Callable[[np.ndarray, str], np.ndarray] = lambda s, side: np.full(s.shape, np.inf)
    estimate = 1.0
    bounds_sdd = True

    def rows(self, s: np.ndarray, side: str) -> ConstraintRows:
        a, b, c = (np.stack([each(s), each(s + 0.1)], axis=1) for each in (self.a, self.b, self.c))
        return ConstraintRows(a, b, c, self.cap(s, side))


def constant(value: float) -> Function:
    return lambda s: np.full(np.shape(s), value)


def rows_of(grid: Any, *constraints: Any, stops: Any = NOWHERE) -> IntervalRows:
    return interval_rows(np.array(grid, dtype=float), constraints, np.array(stops, dtype=float))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_row_is_the_integral_of_what_it_says_times_its_first_coefficient(sign: float) -> None:
    """2 |a| (a u + b x - c) over an interval with constant u, in which x is linear."""
    a, b, c = (lambda s: sign * (2 + np.sin(s))), (lambda s: 3 * np.cos(2 * s)), (lambda s: 1.5 + s**2)
    grid = np.array([0.3, 0.32, 0.33, 0.36])
    rows = rows_of(grid, Known(a, b, c))  # type: ignore[arg-type]
    for k, (low, high) in enumerate(pairwise(grid)):
        for row, shift in enumerate((0.0, 0.1)):
            for x, y in ((1.0, 0.0), (0.0, 1.0), (2.0, 3.0)):
                u = (y - x) / (2 * (high - low))

                def whole(
                    s: float, x: float = x, u: float = u, low: float = low, shift: float = shift
                ) -> float:
                    return float(
                        2 * abs(a(s + shift)) * (a(s + shift) * u + b(s + shift) * (x + 2 * u * (s - low)))
                    )

                said = rows.P[row, k] * x + rows.R[row, k] * y
                assert said == pytest.approx(quad(whole, low, high)[0], abs=2e-3 * a(low) ** 2)
            bound = quad(lambda s, shift=shift: 2 * abs(a(s + shift)) * c(s + shift), low, high)[0]
            assert rows.C[row, k] == pytest.approx(bound, rel=1e-3)


@pytest.mark.parametrize("offset", [0.0, 1e8])
@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_rows_of_joints_are_work_and_energy_whatever_the_position_is(direction: float, offset: float) -> None:
    """(q1' sd1)^2 - (q0' sd0)^2 is twice the way times the mean acceleration."""
    low, high = -2.0, 5.0
    cubic = direction * np.array([0.2, 0.3, 1.0, 0.0])
    path = PiecewisePolynomial(np.array([0.0, 1.0]), (cubic + np.eye(4)[3] * offset)[:, None, None])
    grid = np.linspace(0.0, 1.0, 9)
    rows = rows_of(grid, JointConstraint(path, np.array([[-9.0, 9.0]]), np.array([[low, high]])))
    first, ways = np.polyval(np.polyder(cubic), grid), np.diff(np.polyval(cubic, grid))
    for row, (sign, bound) in enumerate(((1.0, high), (-1.0, -low))):  # in the direction of the bound
        sense = sign * direction
        assert rows.R[row] == pytest.approx(sense * first[1:] ** 2)
        assert rows.P[row] == pytest.approx(-sense * first[:-1] ** 2)
        assert rows.C[row] == pytest.approx(2 * bound * np.abs(ways), rel=1e-9)


def test_where_a_coefficient_turns_the_row_holds_at_both_ends_with_the_mean() -> None:
    known = Known(lambda s: s - 0.55, lambda s: 1 + s, lambda s: 2 + s)
    rows = rows_of([0.4, 0.6], known)
    D = 0.2
    turned = [k for k in range(len(rows.C)) if rows.sources[k] == 0]
    assert len(turned) == 2
    for k, s, ends in zip(turned, (0.4, 0.6), ((1.0, 0.0), (0.0, 1.0)), strict=True):
        for x, y in ((1.0, 0.0), (0.0, 1.0), (0.7, 0.4)):
            u, here = (y - x) / (2 * D), ends[0] * x + ends[1] * y
            said = rows.P[k, 0] * x + rows.R[k, 0] * y
            assert said == pytest.approx(2 * D * ((s - 0.55) * u + (1 + s) * here))
        assert rows.C[k, 0] == pytest.approx(2 * D * (2 + s))


@pytest.mark.parametrize("end", [0, 1])
def test_an_end_that_nothing_bounds_is_passed_at_constant_speed(end: int) -> None:
    """There all first coefficients vanish: the other end says how fast, and sdd is zero."""
    size = (lambda s: s) if end == 0 else (lambda s: 1 - s)

    class Flat(Known):
        def rows(self, s: np.ndarray, side: str) -> ConstraintRows:
            a = np.where(np.isclose(s, float(end)), 0.0, size(s))[:, None]
            return ConstraintRows(a, size(s)[:, None], 2 + s[:, None], self.cap(s, side))

    flat = Flat(constant(0), constant(0), constant(0))
    rows = rows_of([0.0, 0.5, 1.0], flat)
    k, other = (0, 0.5) if end == 0 else (1, 0.5)
    said = {
        (float(p), float(r), float(c))
        for p, r, c in zip(rows.P[:, k], rows.R[:, k], rows.C[:, k], strict=True)
    }
    at_other = (0.0, size(other), 2 + other) if end == 0 else (size(other), 0.0, 2 + other)  # times 2 D = 1
    order = (1.0, -1.0, 0.0) if end == 0 else (-1.0, 1.0, 0.0)
    assert said == {at_other, order}
    bounded = Flat(constant(0), constant(0), constant(0), lambda s, side: np.full(s.shape, 4.0))
    assert len(rows_of([0.0, 0.5, 1.0], bounded).P) == 1


def test_caps_are_the_lowest_of_both_sides_of_all_and_zero_at_stops() -> None:
    sides = Known(
        constant(1),
        constant(0),
        constant(1),
        lambda s, side: np.where(s == 0.5, 2.0 if side == "left" else 3.0, 9.0),
    )
    other = Known(constant(1), constant(0), constant(1), lambda s, side: np.where(s == 0.75, 5.0, np.inf))
    assert rows_of([0, 0.25, 0.5, 0.75, 1], sides, other, stops=[0.25]).cap.tolist() == [9, 0, 2, 5, 9]
    right = Known(
        constant(1),
        constant(0),
        constant(1),
        lambda s, side: np.where(s == 0.5, 3.0 if side == "left" else 2.0, 9.0),
    )
    assert rows_of([0, 0.5, 1], right).cap.tolist() == [9, 2, 9]


@pytest.mark.parametrize("place", [0.0, 0.5, 1.0])
def test_where_a_first_coefficient_vanishes_the_second_says_how_fast(place: float) -> None:
    for slope, cap in ((4.0, 0.75), (-4.0, 20.0)):
        known = Known(
            lambda s: s - place, constant(slope), constant(3.0), lambda s, side: np.full(s.shape, 20.0)
        )
        rows = rows_of([0, 0.5, 1], known)
        at = [0.0, 0.5, 1.0].index(place)
        assert rows.cap[at] == pytest.approx(cap)
        assert rows.turning.tolist() == [k == at and slope > 0 for k in range(3)]


def test_at_a_break_of_its_path_each_interval_sees_its_own_side() -> None:
    class Stepping(Known):
        path = PiecewisePolynomial(np.array([0.0, 0.5, 1.0]), np.zeros((1, 2, 1)))

        def rows(self, s: np.ndarray, side: str) -> ConstraintRows:
            later = (s > 0.5) | ((s == 0.5) & (side == "right"))
            return ConstraintRows(
                np.ones((s.size, 1)),
                np.where(later, 7.0, 3.0)[:, None],
                np.ones((s.size, 1)),
                np.full(s.shape, 9.0),
            )

    rows = rows_of([0, 0.25, 0.5, 0.75, 1], Stepping(constant(1), constant(0), constant(1)))
    assert rows.near[1].tolist() == [[3, 3, 7, 7]]
    assert rows.far[1].tolist() == [[3, 3, 7, 7]]
    assert rows.R[0].tolist() == [1 + 0.25 * b for b in (3, 3, 7, 7)]
    assert rows.P[0].tolist() == [0.25 * b - 1 for b in (3, 3, 7, 7)]


def test_lowered_limits_fade_and_are_counted_from_the_whole_ones() -> None:
    """Speeds count squared; each constraint has its own factors; where a turning row caps, those of its c count."""
    first = Known(constant(1), constant(0), constant(3), lambda s, side: np.where(s < 0.1, 8.0, np.inf))
    second = Known(lambda s: s - 0.5, constant(4), constant(2), lambda s, side: np.full(s.shape, 8.0))
    rows = rows_of(np.linspace(0, 1, 9), first, second)
    even = np.ones((2, 8)) * [[2.0], [5.0]]
    lower = rows.tightened(np.full(8, 3.0), even)
    again = lower.tightened(np.full(8, 3.0), even)
    for made, times in ((lower, 1), (again, 2)):
        divided = np.array([2.0, 5.0])[rows.owners] ** times
        assert pytest.approx(rows.C / divided[:, None]) == made.C
        assert made.cap[0] == pytest.approx(8.0 / 9.0**times)
        assert rows.turning[4]
        assert made.cap[4] == pytest.approx(rows.cap[4] / 9.0**times / 5.0**times)
    one = np.ones((2, 8))
    one[0, 2] = 5.0
    made = rows.tightened(np.ones(8), one)
    faded, own = 1 / made.eased[0], rows.owners == 0
    mean = 0.5 * (1 / faded[1:] + 1 / faded[:-1])
    assert made.C[own] == pytest.approx(rows.C[own] * mean)
    assert faded == pytest.approx(1 + 4 * np.array([0.25, 0.5, 1, 1, 0.5, 0.25, 0.125, 0.0625, 0.03125]))


def test_intervals_are_straight_where_all_rows_are_constant() -> None:
    line = PiecewisePolynomial(
        np.array([0.0, 0.5, 1.0]), np.array([[[0.0], [1.0]], [[1.0], [1.0]], [[0.0], [0.5]]])
    )
    bounds = np.array([[-1.0, 1.0]])
    other = PiecewisePolynomial(np.array([0.0, 1.0]), np.array([[[2.0]], [[0.0]]]))
    rows = rows_of(
        [0, 0.25, 0.5, 0.75, 1], JointConstraint(line, bounds, bounds), JointConstraint(other, bounds, bounds)
    )
    assert rows.straight.tolist() == [True, True, False, False]
