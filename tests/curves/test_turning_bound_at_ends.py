"""Bound between turning points with moving ends and limits that differ by direction, against ruckig.

Where an acceleration is free, ruckig's fastest motion is searched over it; that is the least time exactly, so
that the bound may be neither above nor below it.
"""

from __future__ import annotations

import numpy as np
import pytest

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.curves.turning_bound import turning_bound

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


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("rates", RATES)
@pytest.mark.parametrize("speeds", SPEEDS)
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
    assert turning_bound(path, bounds, (0.0, 90.0))[0] == pytest.approx(0.01, rel=1e-9)


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
