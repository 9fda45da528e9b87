"""What makes other planners fail: scaled parameters, doubled waypoints, noise, many points, speeds at the ends."""

from __future__ import annotations

from math import inf

import numpy as np
import pytest
from topp_paths import assert_motion, over, polyline, random_bounds, spline, symmetric

from trajcli.curves.operations import reverse
from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.curves.time_optimal import parameterization as trajectory
from trajcli.curves.time_optimal.parameterization import UnsettledSpeedError, time_optimal
from trajcli.curves.time_optimal.passes import UnlimitedSpeedError, UnreachableSpeedError
from trajcli.curves.time_optimal.refinement import refined


@pytest.mark.parametrize("scale", [1e4, 1e-4])
def test_the_scale_of_the_parameter_changes_nothing(scale):
    rng = np.random.default_rng(5)
    waypoints, (velocity, acceleration) = rng.uniform(-1, 1, (8, 4)), random_bounds(rng, 4)
    plain = time_optimal(spline(waypoints), velocity, acceleration).trajectory
    path = spline(waypoints, np.linspace(0.0, scale, 8))
    scaled = time_optimal(path, velocity, acceleration).trajectory
    assert scaled.duration == pytest.approx(plain.duration, rel=1e-9)
    share = np.linspace(0.0, 1.0, 2001)
    for order in (0, 1, 2):
        expected = plain.evaluate(share * plain.duration, order)
        apart = np.abs(scaled.evaluate(share * scaled.duration, order) - expected).max()
        assert apart <= 1e-9 * np.abs(expected).max()


def test_the_way_back_takes_as_long():
    rng = np.random.default_rng(8)
    path, (velocity, acceleration) = spline(rng.uniform(-1, 1, (6, 3))), random_bounds(rng, 3)
    there = time_optimal(path, velocity, acceleration).trajectory
    back = time_optimal(reverse(path), -velocity[:, ::-1], acceleration).trajectory
    assert back.duration == pytest.approx(there.duration, rel=3e-3)


@pytest.mark.parametrize("apart", [1e-2, 1e-5, 1e-8])
def test_nearly_doubled_waypoints(apart):
    waypoints = np.array([[0, 0], [1, 0.3], [1.2, -0.5], [1.2 + apart, -0.5], [0.4, 0.4], [0, 0.0]])
    s = np.array([0, 1, 2, 2 + apart, 3, 4])
    path = spline(waypoints, s)
    velocity, acceleration = symmetric(1.0, 1.0), symmetric(3.0, 3.0)
    assert_motion(time_optimal(path, velocity, acceleration), path, velocity, acceleration)


def test_doubled_waypoints_are_named():
    with pytest.raises(UnlimitedSpeedError, match="no joint with a limit moves") as caught:
        time_optimal(polyline([[0, 0], [1, 0], [1, 0], [1, 1]]), symmetric(1, 1), symmetric(1, 1))
    assert 1.0 <= caught.value.s <= 2.0


def test_a_noisy_recording():
    rng = np.random.default_rng(3)
    s = np.linspace(0.0, 1.0, 150)
    points = np.stack([np.sin(3 * s), np.cos(5 * s)], axis=1) + rng.normal(size=(150, 2)) * 1e-3
    path = spline(points)
    velocity, acceleration = symmetric(2.0, 2.0), symmetric(5.0, 5.0)
    assert_motion(time_optimal(path, velocity, acceleration), path, velocity, acceleration)


def test_quintic_pieces_and_a_parameter_far_from_zero():
    rng = np.random.default_rng(4)
    path = PiecewisePolynomial([1000.0, 1001.0], rng.normal(size=(6, 1, 3)))
    velocity, acceleration = random_bounds(rng, 3)
    found = time_optimal(path, velocity, acceleration)
    assert max(over(found.trajectory, velocity, acceleration)) <= 1 + 1e-9


@pytest.mark.parametrize("speeds", [(0.3, 0.2), (0.0, 0.35), (0.33, 0.0)])
def test_speeds_at_the_ends(speeds):
    rng = np.random.default_rng(6)
    path, (velocity, acceleration) = spline(rng.uniform(-1, 1, (6, 3)), np.arange(6.0)), random_bounds(rng, 3)
    found = time_optimal(path, velocity, acceleration, start_velocity=speeds[0], end_velocity=speeds[1])
    for end, s, speed in ((0.0, 0.0, speeds[0]), (found.law.end, 5.0, speeds[1])):
        assert found.law.evaluate(end, 1)[0] == pytest.approx(speed, rel=1e-9, abs=1e-12)
        expected = speed * path.evaluate(s, 1)
        np.testing.assert_allclose(found.trajectory.evaluate(end, 1), expected, rtol=1e-8, atol=1e-10)
    assert found.stretch == 1.0
    assert_motion(found, path, velocity, acceleration)
    assert found.lower_bound <= found.trajectory.duration <= 1.002 * found.lower_bound
    rest = time_optimal(path, velocity, acceleration)
    assert found.trajectory.duration < rest.trajectory.duration


def test_the_largest_speed_at_the_start_is_named():
    rng = np.random.default_rng(14)
    path, (velocity, acceleration) = spline(rng.uniform(-1, 1, (8, 3)), np.arange(8.0)), random_bounds(rng, 3)
    found = time_optimal(path, 5 * velocity, acceleration, start_velocity=1.463)
    assert_motion(found, path, 5 * velocity, acceleration)
    with pytest.raises(UnreachableSpeedError) as caught:
        time_optimal(path, 5 * velocity, acceleration, start_velocity=1.5)
    assert caught.value.allowed == pytest.approx(1.466, abs=0.002)


def test_limits_that_cannot_be_settled_are_named(monkeypatch):
    monkeypatch.setattr(trajectory, "_MOST_TIGHTENINGS", 0)
    rng = np.random.default_rng(6)
    path, (velocity, acceleration) = spline(rng.uniform(-1, 1, (6, 3)), np.arange(6.0)), random_bounds(rng, 3)
    with pytest.raises(UnsettledSpeedError, match=r"limit is passed by a factor of 1\.0") as caught:
        time_optimal(path, velocity, acceleration, start_velocity=0.3)
    assert 0.0 <= caught.value.s <= 5.0
    assert caught.value.over > 1.0


@pytest.mark.parametrize(
    ("end", "speeds", "allowed"),
    [
        ("start", (2.0, 0.0), 1.0),
        ("start", (0.9, 0.0), 0.4**0.5),
        ("end", (0.0, 0.9), 0.4**0.5),
        ("end", (0, 3), 0.4**0.5),
    ],
)
def test_speeds_that_are_too_high_are_named(end, speeds, allowed):
    path = polyline([[0.0], [0.2 if allowed < 1 else 2.0]], [0.0, 0.2 if allowed < 1 else 2.0])
    with pytest.raises(UnreachableSpeedError, match=f"at the {end}.*too high: at most") as caught:
        time_optimal(path, symmetric(1.0), symmetric(1.0), start_velocity=speeds[0], end_velocity=speeds[1])
    assert caught.value.allowed == pytest.approx(allowed, rel=1e-9)
    assert caught.value.s == (0.0 if end == "start" else path.end)


def test_no_room_for_the_speed_asked_for():
    """A start at the limit of a joint that speeds up with s, and may not brake hard enough: named, not hidden."""
    path = PiecewisePolynomial([0.0, 1.0], np.array([[3.0], [1.0], [0.0]])[:, None, :])
    with pytest.raises((UnreachableSpeedError, UnsettledSpeedError)):
        time_optimal(path, symmetric(1.0), symmetric(1.0), start_velocity=1.0)


@pytest.mark.parametrize(
    ("goal", "v", "a"), [([1.0, 1.0], inf, inf), ([1.0, 1.0], 1.0, inf), ([0.0, 0.0], 1.0, 1.0)]
)
def test_what_nothing_limits_is_named(goal, v, a):
    with pytest.raises(UnlimitedSpeedError):
        time_optimal(polyline([[0.0, 0.0], goal]), symmetric(v, v), symmetric(a, a))
    with pytest.raises(UnlimitedSpeedError):
        time_optimal(polyline([[0.0, 0.0], [0.0, 1.0]]), symmetric(1, inf), symmetric(1, inf))


def test_wrong_input_is_named():
    path = polyline([[0.0, 0.0], [1.0, 1.0]])
    with pytest.raises(ValueError, match="2 pairs"):
        time_optimal(path, symmetric(1), symmetric(1, 1))
    with pytest.raises(ValueError, match="lower < 0 < upper"):
        time_optimal(path, symmetric(1, 1), np.array([[0.0, 1.0], [-1.0, 1.0]]))
    with pytest.raises(ValueError, match="not negative"):
        time_optimal(path, symmetric(1, 1), symmetric(1, 1), start_velocity=-0.1)


def test_the_grid_grows_with_the_number_of_pieces():
    rng = np.random.default_rng(9)
    counts = []
    for points in (26, 101):
        path = spline(rng.uniform(-1, 1, (points, 2)))
        found = time_optimal(path, symmetric(1, 1), symmetric(4, 4))
        assert found.lost <= 0.003
        counts.append(found.grid.size - 1)
        assert counts[-1] <= 20 * (points - 1) + 4000
        assert np.isin(path.breaks, found.grid).all()


def test_a_new_place_is_where_speeding_up_meets_braking_or_the_middle():
    grid, every = np.array([0.0, 1.0, 2.0, 3.0]), np.full(3, 2)
    x = np.array([0.0, 1.0, 1.5, 0.5])  # the lines x = s and x = 3.5 - s meet at s = 1.75
    np.testing.assert_allclose(refined(grid, x, every), [0, 0.5, 1, 1.75, 2, 2.5, 3], atol=1e-15)
    even = np.array([0.0, 1.0 + 1e-13, 2.0 + 1e-13, 3.0 - 1e-13])  # bent by rounding only
    np.testing.assert_allclose(refined(grid, even, every), [0, 0.5, 1, 1.5, 2, 2.5, 3], atol=1e-15)
    assert refined(grid, x, np.array([1, 2, 1])).size == 5


@pytest.mark.full
def test_limits_are_lowered_in_places_until_little_of_a_long_motion_is_stretched():
    """It was stretched by 1.4 % for a single interval that passed its limit; what is lost else is that of the grid."""
    rng = np.random.default_rng(12)
    path = spline(rng.uniform(-1, 1, (3001, 6)))
    found = time_optimal(path, *random_bounds(rng, 6))
    assert found.stretch <= 1.0005
    assert found.trajectory.duration <= 1.005 * found.lower_bound


@pytest.mark.soak
def test_ten_thousand_points():
    rng = np.random.default_rng(10)
    path = spline(rng.uniform(-1, 1, (10001, 6)))
    velocity, acceleration = random_bounds(rng, 6)
    found = time_optimal(path, velocity, acceleration)
    assert found.grid.size <= 20 * 10000 + 4001
    assert found.stretch <= 1.0005
    assert_motion(found, path, velocity, acceleration)
