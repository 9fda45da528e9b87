"""Bound between turning points with moving ends and limits that differ by direction, against ruckig.

Where an acceleration is free, ruckig's fastest motion is searched over it; that is the least time exactly, so
that the bound may be neither above nor below it.
"""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.curves.turning_bound import bound_between_stops, turning_bound

CLOSE = 1e-6


def fastest(distance, speeds, limits, free):
    """Return the least time over a distance above 0 from speed to speed.

    Args:
        distance: Above 0.
        speeds: At its start and end, at least 0.
        limits: Of speed, of speeding up, of slowing down, of jerk.
        free: Whether the acceleration is free at the start, and at the end; else it is zero.
    """
    from ruckig import InputParameter, Ruckig, Trajectory

    problem, result, solver = InputParameter(1), Trajectory(1), Ruckig(1)
    problem.current_position, problem.target_position = [0.0], [distance]
    problem.current_velocity, problem.target_velocity = [speeds[0]], [speeds[1]]
    problem.max_velocity, problem.max_jerk = [limits[0]], [limits[3]]
    problem.max_acceleration, problem.min_acceleration = [limits[1]], [-limits[2]]
    # what is over when its acceleration has ended must keep the limit of speed, which ruckig does not ask for
    most = np.minimum(limits[1:3], np.sqrt(2 * limits[3] * (limits[0] - np.array(speeds)))) * free
    most *= 1 - 1e-9
    low, high = np.array([0.0, -most[1]]), np.array([most[0], 0.0])
    best, where = np.inf, low
    for _ in range(9):
        rows = [np.unique(np.linspace(a, b, 17)) for a, b in zip(low, high, strict=True)]
        for start in rows[0].tolist():
            for end in rows[1].tolist():
                problem.current_acceleration, problem.target_acceleration = [start], [end]
                if solver.calculate(problem, result) >= 0 and result.duration < best:
                    best, where = result.duration, np.array([start, end])
        width = (high - low) / 4
        low, high = np.maximum(low, where - width / 2), np.minimum(high, where + width / 2)
    return best


def through(*values):
    """Return q(s) that is a straight line from each value to the next, in unit intervals of s."""
    points = np.array(values)
    return PiecewisePolynomial(
        np.arange(float(points.size)), np.stack([np.diff(points), points[:-1]])[:, :, None]
    )


def limits_of(velocity, acceleration, jerk):
    """Return bounds of one joint, each lower and upper."""
    return np.array([velocity]), np.array([acceleration]), np.array([[-jerk, jerk]])


SPEEDS = [(0.0, 0.0), (0.8, 0.0), (0.0, 0.8), (0.8, 0.3), (0.3, 0.8), (0.9, 0.9)]
RATES = [(2.0, 9.0), (9.0, 2.0), (4.0, 4.0)]
SHAPES = [
    (6.0, 40.0),
    (6.0, 4.0),
    (0.9, 40.0),
    (1.2, 9.0),
]  # distance and jerk: long and short ramps, with cruise


@pytest.mark.parametrize(
    ("speeds", "rates", "shape"),
    [each for k, each in enumerate(product(SPEEDS, RATES, SHAPES)) if (k + k // len(SHAPES)) % 2 == 0],
)
def test_moving_ends_have_free_accelerations(speeds, rates, shape):
    """Up and down: what speeds up one way slows down the other way."""
    distance, jerk = shape
    free = (speeds[0] > 0, speeds[1] > 0)
    needed = fastest(distance, speeds, (1.0, *rates, jerk), free)
    assert np.isfinite(needed)
    along = np.array(speeds) / distance
    up = limits_of([-7.0, 1.0], [-rates[1], rates[0]], jerk)
    down = limits_of([-1.0, 7.0], [-rates[0], rates[1]], jerk)
    for path, bounds in ((through(0.0, distance), up), (through(distance, 0.0), down)):
        duration, joint = turning_bound(path, bounds, tuple(along))
        assert joint == 0
        assert needed * (1 - CLOSE) <= duration <= needed * (1 + 1e-9)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("speeds", [(0.0, 0.0), (0.5, 0.0), (0.0, 0.5), (0.5, 0.5)])
def test_stretches_are_summed_each_with_the_limits_of_its_direction(speeds, sign):
    """Out by 1.1, back by 0.7, out by 0.5: three stretches between which the acceleration is free."""
    jerk, up, down = 20.0, (1.0, 3.0, 8.0), (0.6, 8.0, 3.0)  # speed, speeding up, slowing down
    needed = fastest(1.1, (1.1 * speeds[0], 0.0), (*up, jerk), (speeds[0] > 0, True))
    needed += fastest(0.7, (0.0, 0.0), (*down, jerk), (True, True))
    needed += fastest(0.5, (0.0, 0.5 * speeds[1]), (*up, jerk), (True, speeds[1] > 0))
    velocity, acceleration = [-0.6, 1.0], [-8.0, 3.0]
    if sign < 0:
        velocity, acceleration = [-1.0, 0.6], [-3.0, 8.0]
    path = through(0.0, 1.1 * sign, 0.4 * sign, 0.9 * sign)
    duration, _ = turning_bound(path, limits_of(velocity, acceleration, jerk), speeds)
    assert needed * (1 - CLOSE) <= duration <= needed * (1 + 1e-9)


@pytest.mark.parametrize("slow", [0, 1, 2])
def test_the_slowest_joint_bounds_the_motion(slow):
    factors = np.where(np.arange(3) == slow, 1.0, 0.5)
    path = PiecewisePolynomial(np.array([0.0, 1.0]), np.stack([factors, np.zeros(3)])[:, None])
    bounds = [np.tile([-size, size], (3, 1)) for size in (1.0, 4.0, 20.0)]
    duration, joint = turning_bound(path, tuple(bounds), (0.0, 0.0))
    assert joint == slow
    assert duration == pytest.approx(
        fastest(1.0, (0.0, 0.0), (1.0, 4.0, 4.0, 20.0), (False, False)), rel=CLOSE
    )


@pytest.mark.parametrize("sign", [1, -1])
def test_an_end_where_it_could_not_stop_asks_for_the_way_at_full_speed(sign):
    """From 0.9 to rest needs 0.05 m at least: over 0.01 m nothing is known but the speed."""
    path = through(0.0, 0.01 * sign)
    bounds = limits_of([-1.0, 1.0], [-4.0, 4.0], 20.0)
    assert turning_bound(path, bounds, (90.0, 0.0))[0] == pytest.approx(0.01, rel=1e-9)
    assert turning_bound(path, bounds, (90.0, 0.0))[0] <= 0.01
    assert turning_bound(path, bounds, (0.0, 90.0))[0] == pytest.approx(0.01, rel=1e-9)


def test_ends_over_the_limit_of_speed_may_keep_theirs():
    bounds = limits_of([-1.0, 1.0], [-4.0, 4.0], 20.0)
    assert turning_bound(through(0.0, 1.0), bounds, (1.5, 1.5))[0] == pytest.approx(1.0 / 1.5, rel=1e-9)


def test_without_a_limit_of_speed_the_others_bound_it():
    bounds = limits_of([-np.inf, np.inf], [-4.0, 4.0], 20.0)
    needed = fastest(3.0, (0.0, 0.0), (1e3, 4.0, 4.0, 20.0), (False, False))
    assert turning_bound(through(0.0, 3.0), bounds, (0.0, 0.0))[0] == pytest.approx(needed, rel=CLOSE)


def test_without_a_limit_of_jerk_the_speed_is_a_trapezoid():
    bounds = limits_of([-1.0, 1.0], [-4.0, 4.0], np.inf)
    assert turning_bound(through(0.0, 3.0), bounds, (0.0, 0.0))[0] == pytest.approx(3.0 + 1.0 / 4.0, rel=1e-9)


def test_a_jerk_that_is_larger_one_way_is_taken_to_be_so_both_ways():
    """Jerks 30, -10, -10, 30 for t, 3 t, 3 t, t reach 240 t^3 in 8 t: no bound may be above that."""
    velocity, acceleration = np.array([[-1e3, 1e3]]), np.array([[-1e3, 1e3]])
    for jerk in ([-10.0, 30.0], [-30.0, 10.0]):
        duration, _ = turning_bound(
            through(0.0, 240.0), (velocity, acceleration, np.array([jerk])), (0.0, 0.0)
        )
        assert duration == pytest.approx((32 * 240.0 / 30.0) ** (1 / 3), rel=1e-9)
        assert duration < 8.0


@pytest.mark.parametrize("back", [0.3, 0.05, 1e-6])
def test_turning_back_by_little_is_turning_back(back):
    bounds = limits_of([-1.0, 1.0], [-3.0, 8.0], 20.0)
    out = fastest(1.0, (0.0, 0.0), (1.0, 8.0, 3.0, 20.0), (False, True))
    between = fastest(back, (0.0, 0.0), (1.0, 3.0, 8.0, 20.0), (True, True))
    last = fastest(1.0, (0.0, 0.0), (1.0, 8.0, 3.0, 20.0), (True, False))
    duration, _ = turning_bound(through(0.0, 1.0, 1.0 - back, 2.0 - back), bounds, (0.0, 0.0))
    assert duration == pytest.approx(out + between + last, rel=CLOSE)


def test_turning_back_by_rounding_is_not():
    bounds = limits_of([-1.0, 1.0], [-4.0, 4.0], 20.0)
    duration, _ = turning_bound(through(0.0, 1.0, 1.0 - 1e-13, 2.0), bounds, (0.0, 0.0))
    assert duration == pytest.approx(
        fastest(2.0, (0.0, 0.0), (1.0, 4.0, 4.0, 20.0), (False, False)), rel=CLOSE
    )


@pytest.mark.parametrize("sign", [1, -1])
def test_a_joint_turns_within_a_piece_too(sign):
    """q = 4 s (1 - s) goes out by 1 and comes back."""
    path = PiecewisePolynomial(np.array([0.0, 1.0]), sign * np.array([[[-4.0]], [[4.0]], [[0.0]]]))
    half = fastest(1.0, (0.0, 0.0), (1.0, 4.0, 4.0, 20.0), (False, True))
    duration, _ = turning_bound(path, limits_of([-1.0, 1.0], [-4.0, 4.0], 20.0), (0.0, 0.0))
    assert duration == pytest.approx(2 * half, rel=CLOSE)


@pytest.mark.parametrize("acceleration", [[-np.inf, np.inf], [-4.0, np.inf], [-np.inf, 4.0]])
def test_a_joint_without_a_limit_of_acceleration_bounds_nothing(acceleration):
    bounds = limits_of([-1.0, 1.0], acceleration, 20.0)
    assert turning_bound(through(0.0, 3.0), bounds, (0.0, 0.0))[0] == 0.0


def test_a_piece_that_turns_twice_has_three_stretches():
    """The Chebyshev polynomial of degree 3 goes up by 2, down by 2 and up by 2, from rest to rest each."""
    path = PiecewisePolynomial(np.array([0.0, 2.0]), np.array([4.0, -12.0, 9.0, -1.0]).reshape(4, 1, 1))
    np.testing.assert_allclose(path.evaluate(np.array([0.0, 0.5, 1.5, 2.0]))[:, 0], [-1.0, 1.0, -1.0, 1.0])
    bounds = tuple(np.array([[-size, size]]) for size in (1e6, 1.0, 1e12))
    assert turning_bound(path, bounds, (0.0, 0.0))[0] == pytest.approx(3 * 2 * np.sqrt(2.0), rel=1e-5)


def line_of(*points):
    """Return straight lines of two joints, in unit intervals of s; the second one's limits are loose."""
    corners = np.array(points)
    path = PiecewisePolynomial(
        np.arange(float(len(corners))), np.stack([np.diff(corners, axis=0), corners[:-1]])
    )
    bounds = [np.array([[-size, size], [-99.0, 99.0]]) for size in (1.0, 4.0, 50.0)]
    return path, (bounds[0], bounds[1], bounds[2] * [[1.0], [99.0]])


LIMITS = (1.0, 4.0, 4.0, 50.0)


@pytest.mark.parametrize("order", [1, -1])
def test_only_at_the_stops_where_a_path_goes_back_its_acceleration_is_free(order):
    """Around a corner it is zero. One of two stops is a corner, the other one a way back."""
    corners = [(0.0, 0.0), (0.3, -0.2), (1.0, 0.15), (0.3, -0.2)][::order]
    path, bounds = line_of(*corners)
    needed = fastest(0.3, (0.0, 0.0), LIMITS, (False, False))
    needed += 2 * fastest(0.7, (0.0, 0.0), LIMITS, (False, True))
    duration, _ = bound_between_stops(path, bounds, (0.0, 0.0), path.breaks[1:-1])
    assert needed * (1 - CLOSE) <= duration <= needed * (1 + 1e-9)


def test_a_path_that_goes_nearly_back_turns_a_corner():
    path, bounds = line_of((0.0, 0.0), (0.7, 0.3), (0.0, 0.02))
    needed = 2 * fastest(0.7, (0.0, 0.0), LIMITS, (False, False))
    duration, _ = bound_between_stops(path, bounds, (0.0, 0.0), path.breaks[1:-1])
    assert duration == pytest.approx(needed, rel=CLOSE)


def test_a_path_goes_back_at_whatever_speed_s_has_there():
    path, bounds = line_of((0.0, 0.0), (0.7, 0.35), (0.35, 0.175))
    needed = fastest(0.7, (0.0, 0.0), LIMITS, (False, True)) + fastest(
        0.35, (0.0, 0.0), LIMITS, (True, False)
    )
    duration, _ = bound_between_stops(path, bounds, (0.0, 0.0), path.breaks[1:-1])
    assert needed * (1 - CLOSE) <= duration <= needed * (1 + 1e-9)


@pytest.mark.parametrize("speeds", [(0.6, 0.0), (0.0, 0.6), (0.6, 0.8)])
def test_ends_of_a_path_with_stops_may_be_in_motion(speeds):
    path, bounds = line_of((0.0, 0.0), (0.7, 0.1), (1.2, 0.4))
    needed = fastest(0.7, (speeds[0], 0.0), LIMITS, (speeds[0] > 0, False))
    needed += fastest(0.5, (0.0, speeds[1]), LIMITS, (False, speeds[1] > 0))
    duration, _ = bound_between_stops(path, bounds, (speeds[0] / 0.7, speeds[1] / 0.5), path.breaks[1:-1])
    assert needed * (1 - CLOSE) <= duration <= needed * (1 + 1e-9)


@pytest.mark.parametrize("sign", [1, -1])
def test_a_stop_where_a_bent_piece_turns_back_is_no_end_of_a_line(sign):
    """q = 4 s (1 - s) stands at s = 0.5 whatever sd is: its acceleration there may be anything."""
    path = PiecewisePolynomial(np.array([0.0, 1.0]), sign * np.array([[[-4.0]], [[4.0]], [[0.0]]]))
    needed = 2 * fastest(1.0, (0.0, 0.0), (1.0, 4.0, 4.0, 20.0), (False, True))
    bounds = limits_of([-1.0, 1.0], [-4.0, 4.0], 20.0)
    duration, _ = bound_between_stops(path, bounds, (0.0, 0.0), np.array([0.5]))
    assert duration == pytest.approx(needed, rel=CLOSE)


def test_lines_that_follow_each_other_without_a_stop_are_no_single_line():
    """A joint goes by 1, by 0.1 and, from a stop on, by 0.9, each while s goes by 1."""
    limits = (1.0, 4.0, 4.0, 20.0)
    needed = sum(fastest(way, (0.0, 0.0), limits, (False, False)) for way in (1.1, 0.9))
    bounds = limits_of([-1.0, 1.0], [-4.0, 4.0], 20.0)
    duration, _ = bound_between_stops(through(0.0, 1.0, 1.1, 2.0), bounds, (0.0, 0.0), np.array([2.0]))
    assert duration == pytest.approx(needed, rel=CLOSE)


@pytest.mark.parametrize("steps", [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)])
def test_each_limit_of_a_line_is_that_of_the_joint_that_it_binds(steps):
    """One joint binds its speed and its jerk, the other its acceleration, unlike forwards and backwards."""
    forward, backward = np.array([[1.0, 9.0], [9.0, 4.0]]), np.array([[0.8, 7.0], [7.0, 3.0]])
    velocity, acceleration = (np.stack([-low, up], axis=1) for low, up in zip(backward, forward, strict=True))
    jerk = np.array([[-20.0, 20.0], [-99.0, 99.0]])
    ways = np.array(steps)
    path = PiecewisePolynomial(np.arange(3.0), np.stack([[ways, ways], [0.0 * ways, ways]]))
    speed = 1.0 if steps[0] > 0 else 0.8
    rates = (4.0, 3.0) if steps[1] > 0 else (3.0, 4.0)
    needed = 2 * fastest(1.0, (0.0, 0.0), (speed, *rates, 20.0), (False, False))
    duration, joint = bound_between_stops(path, (velocity, acceleration, jerk), (0.0, 0.0), np.array([1.0]))
    assert joint is None
    assert duration == pytest.approx(needed, rel=CLOSE)
    assert turning_bound(path, (velocity, acceleration, jerk), (0.0, 0.0))[0] < 0.9 * needed
