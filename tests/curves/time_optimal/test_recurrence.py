"""Recurrences against their definition, and a local re-solve against the whole solution."""

from __future__ import annotations

import numpy as np
import pytest
from topp_paths import random_bounds, spline

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.curves.time_optimal import passes
from trajcli.curves.time_optimal.collocation import interval_rows
from trajcli.curves.time_optimal.constraints import JointConstraint
from trajcli.curves.time_optimal.passes import (
    UnreachableSpeedError,
    maximum_velocity_curve,
    solve,
    solve_locally,
)


def recurrence(P, R, C, chosen, limits):
    z = [float(limits[0])]
    for i in range(P.shape[1]):
        lines = [(C[k, i] / R[k, i]) - (P[k, i] / R[k, i]) * z[-1] for k in np.flatnonzero(chosen[:, i])]
        z.append(max(0.0, min([float(limits[i + 1]), *lines])))
    return np.array(z)


@pytest.mark.parametrize("count", [1, 2, 50, 700])
@pytest.mark.parametrize(("many", "block"), [(0, 8192), (1000, 8192), (0, 100), (1000, 33)])
def test_both_ways_are_the_recurrence(monkeypatch, count, many, block):
    monkeypatch.setattr(passes, "_MANY", many)
    monkeypatch.setattr(passes, "_BLOCK", block)
    rng = np.random.default_rng(count)
    P, C = rng.normal(-0.6, 0.6, (5, count)), rng.uniform(0, 0.3, (5, count))
    R, limits = rng.uniform(0.5, 1.5, (5, count)), rng.uniform(0.2, 3, count + 1)
    chosen = rng.random((5, count)) < 0.6
    R[:, ::7] *= -1
    chosen[:, ::7] &= R[:, ::7] > 0
    limits[rng.random(count + 1) < 0.1] = np.inf
    limits[0] = 0.4
    np.testing.assert_array_equal(
        passes.solve_recurrence(P, R, C, chosen, limits), recurrence(P, R, C, chosen, limits)
    )


@pytest.mark.parametrize("many", [0, 1000])
def test_a_line_that_is_lowest_at_the_largest_value_only_counts(many, monkeypatch):
    """From 2 on: of 1 and 2.4 - z the second is 0.4, below the limit of 0.5 behind; at 0.5 it would be 1.9."""
    monkeypatch.setattr(passes, "_MANY", many)
    P, C = np.array([[0.0, 0.0], [1.0, 1.0]]), np.array([[1.0, 1.0], [2.4, 2.4]])
    chosen = np.ones((2, 2), dtype=bool)
    found = passes.solve_recurrence(P, np.ones((2, 2)), C, chosen, np.array([2.0, 0.5, 9.0]))
    np.testing.assert_allclose(found, [2.0, 0.4, 1.0], rtol=1e-15)


def locally(rows, before, changed):
    return solve_locally(rows, before, changed, maximum_velocity_curve(rows, before.mvc, changed))


@pytest.mark.parametrize("end", [0.0, 0.05])
@pytest.mark.parametrize("seed", range(3))
def test_a_few_lowered_limits_change_the_solution_around_them(seed, end):
    rng = np.random.default_rng(seed)
    path, (velocity, acceleration) = (
        spline(rng.uniform(-1, 1, (40, 3)), np.arange(40.0)),
        random_bounds(rng, 3),
    )
    grid = np.linspace(path.start, path.end, 39 * 20 + 1)
    rows = interval_rows(grid, [JointConstraint(path, velocity, acceleration)], np.empty(0))
    before = solve(rows, 0.0, end)
    factors = np.ones((2, grid.size - 1))
    factors[:, rng.choice(grid.size - 1, 5)] = rng.uniform(1, 1.2, (2, 5))
    lowered = rows.tightened(factors[0], factors[1:])
    changed = (lowered.C != rows.C).any(axis=0) | (np.diff(lowered.cap / rows.cap) != 0)
    assert changed[(factors != 1).any(axis=0)].all()
    whole, found = solve(lowered, 0.0, end), locally(lowered, before, changed)
    assert found is not None
    for name in ("x", "upper", "mvc"):
        np.testing.assert_array_equal(getattr(found, name), getattr(whole, name))
    assert 0 < (whole.x != before.x).sum() < grid.size / 2


@pytest.mark.parametrize(
    ("bounds", "place"), [([-1.0, 50.0], 990), ([-50.0, 1.0], 10), ([-1.0, 1.0], 600), ([-1.0, 1.0], 400)]
)
def test_what_is_felt_far_away_is_not_found_locally(bounds, place):
    """A joint that brakes, or speeds up, nearly all the way: what changes at one end is felt to the other."""
    path = spline(np.array([[0.0], [1.0]]))
    demand = JointConstraint(path, np.array([[-9.0, 9.0]]), np.array([bounds]))
    rows = interval_rows(np.linspace(0, 1, 1001), [demand], np.empty(0))
    factors = np.ones((2, 1000))
    factors[1, place] = 1.5
    before = solve(rows, 0.0, 0.0)
    lowered = rows.tightened(factors[0], factors[1:])
    assert locally(lowered, before, (lowered.C != rows.C).any(axis=0)) is None


@pytest.mark.parametrize("place", range(128, 148))
def test_braking_that_is_felt_up_to_the_second_point_is_not_found_locally(place):
    """The motion brakes nearly all the way: surroundings that begin at any of the first points differ there."""
    path = spline(np.array([[0.0], [1.0]]))
    demand = JointConstraint(path, np.array([[-9.0, 9.0]]), np.array([[-1.0, 50.0]]))
    rows = interval_rows(np.linspace(0, 1, 1001), [demand], np.empty(0))
    factors = np.ones((2, 1000))
    factors[1, place] = 1.5
    before = solve(rows, 0.0, 0.0)
    lowered = rows.tightened(factors[0], factors[1:])
    changed = (lowered.C != rows.C).any(axis=0)
    whole, found = solve(lowered, 0.0, 0.0), locally(lowered, before, changed)
    assert (whole.upper[1:100] < before.upper[1:100]).all()
    for name in ("x", "upper", "mvc") if found is not None else ():
        np.testing.assert_array_equal(getattr(found, name), getattr(whole, name))


@pytest.mark.parametrize("sweeps", [1, 3, 50])
def test_what_chunks_abreast_leave_open_is_the_recurrence(monkeypatch, sweeps):
    """Sums from the first value on: no chunk is right before the one in front of it is."""
    monkeypatch.setattr(passes, "_MANY", 0)
    monkeypatch.setattr(passes, "_SWEEPS", sweeps)
    rng = np.random.default_rng(8)
    C, limits = rng.uniform(-0.02, 0.02, (1, 400)), np.full(401, np.inf)
    limits[0] = 5.0
    steps = -np.ones((1, 400)), np.ones((1, 400)), C, np.ones((1, 400), dtype=bool)
    found = passes.solve_recurrence(*steps, limits)
    np.testing.assert_array_equal(found, recurrence(*steps, limits))
    np.testing.assert_allclose(found[1:], 5.0 + np.cumsum(C), rtol=1e-12)


@pytest.mark.parametrize(("speed", "place"), [(np.inf, 0), (np.inf, -1), (0.3, 0), (0.3, -1), (np.inf, 3)])
@pytest.mark.parametrize("lower", ["cap", "acceleration"])
def test_limits_that_are_lowered_at_an_end_count_there_too(speed, place, lower):
    """Surroundings that reach to an end of the path: the motion there is the same, or nothing is found locally."""
    path = PiecewisePolynomial([0.0, 10.0], np.array([1.0, 0.0])[:, None, None])
    demand = JointConstraint(path, np.array([[-0.5, 0.5]]), np.array([[-2.0, 3.0]]))
    rows = interval_rows(np.linspace(0, 10, 1001), [demand], np.empty(0))
    before = solve(rows, speed, speed)
    factors = np.ones((2, 1000))
    factors[int(lower == "acceleration"), place] = 1.5
    lowered = rows.tightened(factors[0], factors[1:])
    changed = (lowered.C != rows.C).any(axis=0) | (lowered.cap[1:] != rows.cap[1:])
    changed |= lowered.cap[:-1] != rows.cap[:-1]
    whole = solve(lowered, speed, speed)
    if lower == "cap" and place in (0, -1):
        assert whole.x[place] == pytest.approx(min(speed, 0.5 / 1.5) ** 2)
    found = locally(lowered, before, changed)
    moved = (whole.x != before.x)[[0, -1]].any() or whole.upper[-1] != before.upper[-1]
    assert (found is None) == moved  # nothing is said of a motion whose end is another
    for name in ("x", "upper", "mvc") if found is not None else ():
        np.testing.assert_array_equal(getattr(found, name), getattr(whole, name))


@pytest.mark.parametrize("place", [0, -1])
def test_a_speed_at_an_end_that_is_asked_for_is_not_lowered_locally(place):
    """0.4 is more than the lowered cap of 1/3: nothing that is slower there is an answer."""
    path = PiecewisePolynomial([0.0, 10.0], np.array([1.0, 0.0])[:, None, None])
    demand = JointConstraint(path, np.array([[-0.5, 0.5]]), np.array([[-2.0, 3.0]]))
    rows = interval_rows(np.linspace(0, 10, 1001), [demand], np.empty(0))
    before = solve(rows, 0.4, 0.4)
    factors = np.ones((2, 1000))
    factors[0, place] = 1.5
    lowered = rows.tightened(factors[0], factors[1:])
    changed = (lowered.cap[1:] != rows.cap[1:]) | (lowered.cap[:-1] != rows.cap[:-1])
    with pytest.raises(UnreachableSpeedError):
        solve(lowered, *((0.4, 0.0), (0.0, 0.4))[place])
    assert locally(lowered, before, changed) is None
