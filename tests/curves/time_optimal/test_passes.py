"""The two passes against linear programmes solved by scipy, and a table of another library."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hermite_curves import hermite_pieces
from scipy.optimize import linprog
from tiers import few
from topp_paths import random_bounds, spline, symmetric
from yaml_files import read_yaml

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.curves.time_optimal.collocation import interval_rows
from trajcli.curves.time_optimal.constraints import ConstraintRows, JointConstraint
from trajcli.curves.time_optimal.passes import UnlimitedSpeedError, UnreachableSpeedError, controllable, solve

CASES = read_yaml(Path(__file__).parents[2] / "oracles" / "time_optimal.yaml")["cases"]
NOWHERE = np.empty(0)


def raw_rows(path, s, side, velocity, acceleration):
    """Return (first, second derivative, largest x) at one place, from the definition."""
    first, second = (path.evaluate(s, order, side=side) for order in (1, 2))
    with np.errstate(divide="ignore"):
        speeds = np.where(
            first > 0, velocity[:, 1] / first, velocity[:, 0] / np.where(first == 0, -0.0, first)
        )
    turns = np.where(second > 0, acceleration[:, 1], -acceleration[:, 0]) / np.abs(second)
    squares = np.where(np.abs(first) < 1e-9, turns, speeds**2)
    return first, second, float(np.min(squares))


def programme(path, near, far, velocity, acceleration):
    """Return A, b of A (x, u) <= b for one interval: v1^2 - v0^2 is twice the distance times the acceleration."""
    double, rows, bounds = 2.0 * (far - near), [], []
    first, last = (path.evaluate(s, 1, side=side) for s, side in ((near, "right"), (far, "left")))
    gone = path.evaluate(far) - path.evaluate(near)
    for j in range(path.dimension):
        row = np.array([last[j] ** 2 - first[j] ** 2, last[j] ** 2 * double])
        rows += [row, -row]
        bounds += sorted(2.0 * acceleration[j] * gone[j], reverse=True)
        bounds[-1] *= -1.0
    return np.array(rows), np.array(bounds), double


def turning(path, grid):
    """Return the grid with the places where a joint turns, from numpy's roots."""
    places = []
    for k, (begin, length) in enumerate(zip(path.breaks, path.lengths, strict=False)):
        for joint in range(path.dimension):
            roots = np.roots(np.polyder(path.coefficients[:, k, joint]))
            places += [begin + z.real for z in roots if abs(z.imag) < 1e-12 and 0 < z.real < length]
    return np.union1d(grid, places)


def best(direction, A, b, double, x_range, y_range):
    """Return the extreme of direction . (x, y) with y = x + double u in its range, or None."""
    rows = np.vstack([A, [1.0, double], [-1.0, -double]])
    bounds = np.concatenate([b, [y_range[1], -y_range[0]]])
    objective = [direction[0] + direction[1], direction[1] * double]
    found = linprog(objective, rows, bounds, bounds=[x_range, (None, None)], method="highs")
    return None if found.status == 2 else float(found.fun)


def sets_by_programmes(path, grid, velocity, acceleration, end):
    lower, upper = np.zeros(grid.size), np.zeros(grid.size)
    lower[-1] = upper[-1] = end
    for i in range(grid.size - 2, -1, -1):
        interval = programme(path, grid[i], grid[i + 1], velocity, acceleration)
        cap = min(raw_rows(path, grid[i], side, velocity, acceleration)[2] for side in ("left", "right"))
        top = best((-1, 0), *interval, (0, cap), (lower[i + 1], upper[i + 1]))
        if top is None:
            return None
        upper[i] = -top
        lower[i] = best((1, 0), *interval, (0, cap), (lower[i + 1], upper[i + 1]))
    return lower, upper


def forward_by_programmes(path, grid, velocity, acceleration, upper, start):
    x = [start]
    for i in range(grid.size - 1):
        A, b, double = programme(path, grid[i], grid[i + 1], velocity, acceleration)
        x.append(-best((0, -1), A, b, double, (x[-1], x[-1]), (0.0, upper[i + 1])))
    return np.array(x)


@pytest.mark.parametrize("seed", few(range(3), 2))
@pytest.mark.parametrize("moving", [False, True])
def test_the_passes_solve_the_linear_programmes(seed, moving):
    rng = np.random.default_rng(seed)
    joints, count = int(rng.integers(1, 4)), 12
    path = spline(rng.uniform(-1, 1, (5, joints)))
    if seed % 2:  # q'' jumps at the breaks
        path = hermite_pieces(path.breaks, rng.uniform(-2, 2, (2, 5, joints)))
    velocity, acceleration = random_bounds(rng, joints)
    grid = turning(path, np.union1d(np.linspace(0, 1, count), path.breaks))
    intervals = interval_rows(grid, [JointConstraint(path, velocity, acceleration)], NOWHERE)
    top = controllable(intervals, np.inf).upper[-1]
    end = 0.3 * top if moving else 0.0
    lower, upper = sets_by_programmes(path, grid, velocity, acceleration, end)
    found = controllable(intervals, np.sqrt(end))
    np.testing.assert_allclose(found.upper, upper, rtol=1e-6, atol=1e-9 * upper.max())
    np.testing.assert_allclose(found.lower, lower, rtol=1e-6, atol=1e-9 * upper.max())
    start = max(0.5 * upper[0], lower[0]) if moving else 0.0
    speeds = solve(intervals, np.sqrt(start), np.sqrt(end))
    expected = forward_by_programmes(path, grid, velocity, acceleration, found.upper, start)
    np.testing.assert_allclose(speeds.x, expected, rtol=1e-5, atol=1e-7 * upper.max())
    assert (speeds.x <= speeds.mvc * (1 + 1e-12)).all()


def test_an_end_that_is_too_fast_has_no_programme_either():
    path = spline(np.array([[0.0], [0.3], [0.1], [0.5]]))
    velocity, acceleration = symmetric(1.0), symmetric(1.0)
    grid = turning(path, np.union1d(np.linspace(0, 1, 31), path.breaks))
    intervals = interval_rows(grid, [JointConstraint(path, velocity, acceleration)], NOWHERE)
    allowed = np.sqrt(solve(intervals, 0.0, np.inf).x[-1])
    assert solve(intervals, 0.0, allowed * (1 - 1e-9)).x[-1] == pytest.approx(allowed**2)
    with pytest.raises(UnreachableSpeedError, match="at the end") as caught:
        solve(intervals, 0.0, 1.01 * allowed)
    assert caught.value.allowed == pytest.approx(allowed, rel=1e-9)
    sets = sets_by_programmes(path, grid, velocity, acceleration, (1.01 * allowed) ** 2)
    assert sets is None or sets[0][0] > 0
    sets = sets_by_programmes(path, grid, velocity, acceleration, (0.99 * allowed) ** 2)
    assert sets is not None
    assert sets[0][0] == 0


def test_controllable_sets_of_another_library():
    case = next(case for case in CASES if case["kind"] == "topp_controllable")
    given = case["inputs"]
    coefficients = np.array(given["coefficients_highest_first"], dtype=float).transpose(2, 0, 1)
    path = PiecewisePolynomial(given["breaks"], coefficients)
    demand = JointConstraint(path, symmetric(*given["vmax"]), symmetric(*given["amax"]))
    grid = np.linspace(path.start, path.end, given["N"] + 1)
    rows = interval_rows(grid, [demand], NOWHERE)
    a, b, c = rows.near  # the table is of the collocation scheme: rows at the near ends only
    D = 2.0 * np.diff(grid)
    found = controllable(replace(rows, P=D * b - a, R=a, C=D * c)).upper
    np.testing.assert_allclose(found, case["expected"]["K_max"], rtol=0, atol=case["tolerance"])


def test_rows_of_any_kind_join_in():
    path = spline(np.array([[0.0], [1.0]]), bc_type="natural")
    grid = np.linspace(0, 1, 11)

    class Braking:  # -u <= 1: brakes less than the joint could
        def rows(self, s, side):
            ones = np.ones((s.size, 1))
            return ConstraintRows(-ones, 0 * ones, ones, np.full(s.size, np.inf))

    joints = JointConstraint(path, symmetric(10.0), symmetric(2.0))
    found = controllable(interval_rows(grid, [joints, Braking()], NOWHERE)).upper
    np.testing.assert_allclose(found, 2.0 * (1.0 - grid), atol=1e-14)


def test_of_two_caps_at_a_place_the_lower_one_counts():
    class Capped:
        def rows(self, s, side):
            nothing, beside = np.empty((s.size, 0)), {"left": 0.2, "right": 0.3}
            return ConstraintRows(nothing, nothing, nothing, np.where(s == 0.5, beside[side], 9.0))

    joints = JointConstraint(spline(np.array([[0.0], [1.0]])), symmetric(9.0), symmetric(9.0))
    assert interval_rows(np.array([0.0, 0.5, 1.0]), [joints, Capped()], NOWHERE).cap[1] == 0.2


@pytest.mark.parametrize("seed", [1, 139])
def test_a_joint_that_turns_next_to_a_place_does_no_harm(seed):
    """At s = 1e-16 the first joint has all but turned: what its row says of sdd there is rounding."""
    rng = np.random.default_rng(seed)
    bend, limit = rng.uniform(0.3, 3), rng.uniform(0.5, 2)
    path = PiecewisePolynomial([-1.0, 1.0], np.array([[bend, 0], [-2 * bend, 1], [bend, 0]])[:, None, :])
    demand = JointConstraint(path, symmetric(9.0, 9.0), symmetric(limit, 9.0))
    found = []
    for turn in (0.0, 1.4e-16, -1.4e-16, 1e-13):
        grid = np.linspace(-1, 1, 41)
        grid[20] = turn
        found.append(solve(interval_rows(grid, [demand], NOWHERE), 0.0, 0.0).x)
    for other in found[1:]:
        np.testing.assert_allclose(other, found[0], rtol=1e-9, atol=1e-12)


LENGTH, TOP, UP, DOWN = 2.0, 1.5, 3.0, 0.8


class Capped:
    """A largest x between two places of a line."""

    def __init__(self, begin, end, cap):
        self.begin, self.end, self.cap = begin, end, cap

    def rows(self, s, side):
        nothing = np.empty((s.size, 0))
        within = (s >= self.begin) & (s <= self.end)
        return ConstraintRows(nothing, nothing, nothing, np.where(within, self.cap, np.inf))


def line(*further, count=41):
    """Return the rows of a straight line whose joint speeds up with UP and brakes with DOWN."""
    path = PiecewisePolynomial([0.0, LENGTH], np.array([1.0, 0.0])[:, None, None])
    demand = JointConstraint(path, symmetric(TOP), np.array([[-DOWN, UP]]))
    return interval_rows(np.linspace(0.0, LENGTH, count), [demand, *further], NOWHERE)


@pytest.mark.parametrize(("start", "end"), [(0.0, 0.0), (1.0, 0.0), (0.0, 1.2), (1.4, 1.3), (np.inf, np.inf)])
def test_a_line_is_driven_by_the_laws_of_constant_acceleration(start, end):
    """v^2 = v0^2 + 2 a s, from either end: what can be reached, from what the end can be reached, and the motion."""
    rows = line()
    left, gone = LENGTH - rows.grid, rows.grid
    found, sets = solve(rows, start, end), controllable(rows, end)
    braking = np.minimum(TOP**2, end**2 + 2 * DOWN * left)
    np.testing.assert_allclose(sets.upper, braking, rtol=1e-12)
    slowest = np.maximum(0.0, end**2 - 2 * UP * left) if np.isfinite(end) else 0.0 * left
    np.testing.assert_allclose(sets.lower, slowest, rtol=1e-12, atol=1e-12)
    first = min(start**2, braking[0])
    np.testing.assert_allclose(found.x, np.minimum(first + 2 * UP * gone, braking), rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(found.mvc, TOP**2, rtol=1e-12)


@pytest.mark.parametrize("by", [1e-9, 1e-4, 0.01, 0.3])
def test_speeds_at_the_ends_of_a_line_are_refused_from_the_largest_on(by):
    """On a short way: what braking from the start, and speeding up to the end, allow."""
    short = LENGTH / 10
    path = PiecewisePolynomial([0.0, short], np.array([1.0, 0.0])[:, None, None])
    demand = JointConstraint(path, symmetric(TOP), np.array([[-DOWN, UP]]))
    rows = interval_rows(np.linspace(0.0, short, 9), [demand], NOWHERE)
    start, end = np.sqrt(2 * DOWN * short), np.sqrt(2 * UP * short)
    solve(rows, start * (1 - by), 0.0), solve(rows, 0.0, end * (1 - by))
    later = np.sqrt(0.25 + 2 * UP * short)  # from 0.5 on
    solve(rows, 0.5, later * (1 - by))
    for speeds, allowed, place in (
        ((start, 0.0), start, 0.0),
        ((0.0, end), end, short),
        ((0.5, later), later, short),
    ):
        with pytest.raises(UnreachableSpeedError) as caught:
            solve(rows, *(speed if speed == 0.5 else speed * (1 + by) for speed in speeds))
        assert caught.value.allowed == pytest.approx(allowed, rel=1e-9)
        assert caught.value.s == place


@pytest.mark.parametrize("over", [1.001, 1.05, 1.3])
@pytest.mark.parametrize("at", [0.5, 1.0, 1.45])
def test_behind_a_slow_place_an_end_may_be_too_fast_for_every_start(at, over):
    """From the cap at the place on it is reached by UP at most: from no x before that place, whatever one starts with."""
    cap = 0.25
    end = np.sqrt(over * cap + 2 * UP * (LENGTH - at))
    path = PiecewisePolynomial([0.0, LENGTH], np.array([1.0, 0.0])[:, None, None])
    demand = JointConstraint(path, symmetric(9.0), np.array([[-DOWN, UP]]))
    rows = interval_rows(np.linspace(0.0, LENGTH, 41), [demand, Capped(at - 0.01, at + 0.01, cap)], NOWHERE)
    lower = controllable(rows, end).lower
    before = rows.grid < at - 0.01
    assert np.isinf(lower[before]).all()
    behind = rows.grid > at + 0.01
    np.testing.assert_allclose(lower[behind], end**2 - 2 * UP * (LENGTH - rows.grid[behind]), rtol=1e-9)
    reached = np.sqrt(cap + 2 * UP * (LENGTH - at))
    for start in (0.0, 0.3, np.inf):
        with pytest.raises(UnreachableSpeedError, match="at the end") as caught:
            solve(rows, start, end)
        assert caught.value.allowed == pytest.approx(reached, rel=1e-9)
        assert solve(rows, start, reached * (1 - 1e-9)).x[-1] == pytest.approx(reached**2)


def test_a_cap_within_rounding_of_what_the_end_needs_is_none_that_forbids_it():
    """The lower end of the set and the cap are the same number but for their rounding."""
    for at in (0.3, 0.7, 1.1):
        cap = max(2.0 - 2 * UP * (LENGTH - at), 0.25)
        end = np.sqrt(cap + 2 * UP * (LENGTH - at))
        path = PiecewisePolynomial([0.0, LENGTH], np.array([1.0, 0.0])[:, None, None])
        demand = JointConstraint(path, symmetric(9.0), np.array([[-DOWN, UP]]))
        for count in (21, 41, 61, 101):
            grid = np.union1d(np.linspace(0.0, LENGTH, count), at)
            rows = interval_rows(grid, [demand, Capped(at, at, cap)], NOWHERE)
            assert solve(rows, np.inf, end).x[-1] == pytest.approx(end**2)


@pytest.mark.parametrize(("begin", "end"), [(0.0, 1.0), (0.5, 1.0), (0.25, 0.75)])
def test_where_nothing_limits_the_motion_is_named(begin, end):
    """Of four equal parts of a path the joint rests in some: the first place at which no speed is the largest."""
    s = np.array([0.0, 0.25, 0.5, 0.75, 1.0])
    slopes = np.where((s[:-1] >= begin) & (s[1:] <= end), 0.0, 1.0)
    values = np.append(0.0, np.cumsum(slopes * 0.25))
    path = PiecewisePolynomial(s, np.stack([slopes, values[:-1]])[:, :, None])
    rows = interval_rows(s, [JointConstraint(path, symmetric(1.0), symmetric(1.0))], NOWHERE)
    with pytest.raises(UnlimitedSpeedError) as caught:
        solve(rows, np.inf, np.inf)
    assert begin <= caught.value.s <= end
