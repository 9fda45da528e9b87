"""Time-optimal motions whose duration is known in closed form, and published ones."""

from __future__ import annotations

from math import inf, sqrt
from pathlib import Path

import numpy as np
import pytest
from topp_paths import SpeedCap, assert_motion, polyline, spline, symmetric
from yaml_files import read_yaml

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.curves.splines.hermite import shape_preserving
from trajcli.curves.time_optimal.parameterization import time_optimal

CASES = read_yaml(Path(__file__).parents[2] / "oracles" / "time_optimal.yaml")["cases"]
DURATIONS = [case for case in CASES if case["kind"] == "path_time_optimal"]


@pytest.mark.parametrize("case", DURATIONS, ids=lambda case: case["id"])
def test_published_durations(case):
    given = case["inputs"]
    path = spline(given["waypoints"], given["s"]) if len(given["s"]) > 2 else polyline(given["waypoints"])
    velocity, acceleration = symmetric(*given["vmax"]), symmetric(*given["amax"])
    found = time_optimal(path, velocity, acceleration)
    assert found.trajectory.duration == pytest.approx(case["expected"]["duration"], rel=1e-9)
    assert_motion(found, path, velocity, acceleration)


def fastest(length, v, up, down, v0=0.0, v1=0.0):
    """Return the shortest time over a length with speed v, acceleration `up` and deceleration `down`."""
    peak = min(v, sqrt((2 * length + v0**2 / up + v1**2 / down) / (1 / up + 1 / down)))
    ramps = (peak**2 - v0**2) / (2 * up) + (peak**2 - v1**2) / (2 * down)
    return (peak - v0) / up + (peak - v1) / down + (length - ramps) / peak


@pytest.mark.parametrize(
    ("seed", "scale"),
    [(seed, (1.0, 1e4, 1e-4, 7.3)[(seed // 2 + k) % 4]) for seed in range(8) for k in (0, 2)],
)
def test_straight_lines_take_the_least_time(seed, scale):
    rng = np.random.default_rng(seed)
    delta = rng.uniform(-2, 2, 3)
    path = polyline([np.zeros(3), delta], [0.0, scale])
    velocity = np.array([-1, 1]) * rng.uniform(0.5, 3, (3, 2))
    acceleration = np.array([-1, 1]) * rng.uniform(1, 5, (3, 2))
    ahead = (delta > 0).astype(int)
    size, each = np.abs(delta), range(3)
    v = min(abs(velocity[j, ahead[j]]) / size[j] for j in each)
    up = min(abs(acceleration[j, ahead[j]]) / size[j] for j in each)
    down = min(abs(acceleration[j, 1 - ahead[j]]) / size[j] for j in each)
    v0, v1 = (0.0, 0.0) if seed % 2 else (0.4 * v, 0.3 * v)
    found = time_optimal(path, velocity, acceleration, start_velocity=v0 * scale, end_velocity=v1 * scale)
    assert found.trajectory.duration == pytest.approx(fastest(1.0, v, up, down, v0, v1), rel=1e-9)
    assert_motion(found, path, velocity, acceleration)


@pytest.mark.parametrize(
    ("points", "s", "turns"),
    [
        ([-0.05, -0.04, 1.83, -0.03, -0.04, 0.88, -0.07], range(7), [-0.05, 1.83, -0.04, 0.88, -0.07]),
        ([0.04, -1.74, -1.75, 0.01, -0.01], range(5), [0.04, -1.75, 0.01, -0.01]),
        (
            [1.7, -1.54, 0.05, -0.03, -0.56, -0.17],
            [0, 3.24, 4.83, 4.91, 5.44, 5.83],
            [1.7, -1.54, 0.05, -0.56, -0.17],
        ),
    ],
)
def test_a_joint_alone_goes_from_turn_to_turn_as_fast_as_from_rest_to_rest(points, s, turns):
    """Between close points q'' is large beside q', and the grid must be fine there: else all is slowed down."""
    path = shape_preserving(s, np.array(points)[:, None])
    velocity, acceleration = symmetric(2.4), symmetric(7.3)
    found = time_optimal(path, velocity, acceleration)
    least = sum(fastest(length, 2.4, 7.3, 7.3) for length in np.abs(np.diff(turns)).tolist())
    assert found.trajectory.duration == pytest.approx(least, rel=0.03)
    assert_motion(found, path, velocity, acceleration)


def test_unlimited_velocity_and_resting_joints():
    path = polyline([[0.0, 5.0], [1.0, 5.0]])
    found = time_optimal(path, symmetric(inf, inf), symmetric(1.0, inf))
    assert found.trajectory.duration == pytest.approx(2.0, rel=1e-12)
    found = time_optimal(path, symmetric(0.5, 1.0), symmetric(1.0, 1.0))
    assert found.trajectory.duration == pytest.approx(2.5, rel=1e-12)


@pytest.mark.parametrize(
    "turn", [[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 0], [0, 0]], [[0, 0], [1, 0], [2 + 1e-8, 0]]]
)
def test_corners_and_reversals_stop(turn):
    path = polyline(turn)
    velocity, acceleration = symmetric(5, 5), symmetric(1, 1)
    found = time_optimal(path, velocity, acceleration)
    assert found.trajectory.duration == pytest.approx(4.0, rel=1e-8)
    assert found.stops.tolist() == [1.0]
    assert found.stop_times == pytest.approx([2.0], rel=1e-8)
    assert np.abs(found.trajectory.evaluate(found.stop_times, 1)).max() <= 1e-12
    assert_motion(found, path, velocity, acceleration)


@pytest.mark.parametrize("last", [[2 + 5e-10, 0], [2, 5e-14]])
def test_a_kink_of_rounding_is_no_corner(last):
    path = polyline([[0, 0], [1, 0], last])
    found = time_optimal(path, symmetric(5, 5), symmetric(1, 1))
    assert found.stops.size == 0
    assert found.trajectory.duration == pytest.approx(2 * sqrt(2), rel=1e-6)


def powers(start, end, coefficients):
    return PiecewisePolynomial([start, end], np.array(coefficients, dtype=float)[:, None, None])


@pytest.mark.parametrize(
    ("path", "duration"),
    [
        (powers(-1, 1, [1, -2, 1]), 2 * sqrt(2)),  # s^2: there and back, all derivatives vanish at the turn
        (powers(0, 1, [1, 0, 0]), sqrt(2)),  # starts with q' = 0
        (powers(-1, 0, [1, -2, 1]), sqrt(2)),  # ends so
        (powers(0, 1, [-2, 3, 0, 0]), sqrt(2)),  # 3 s^2 - 2 s^3: both
    ],
)
def test_where_the_derivative_of_the_path_vanishes_any_speed_is_rest(path, duration):
    velocity, acceleration = symmetric(10.0), symmetric(2.0)
    found = time_optimal(path, velocity, acceleration)
    assert duration * (1 - 1e-9) <= found.trajectory.duration <= duration * 1.003
    assert_motion(found, path, velocity, acceleration)


def test_where_the_path_stands_still_in_its_middle_next_to_nothing_is_lost():
    """With s^3 the path has no derivative at all there: sd would be infinite. From -1 to 1, accelerate and brake."""
    path, velocity, acceleration = powers(-1, 1, [1, -3, 3, -1]), symmetric(10.0), symmetric(2.0)
    found = time_optimal(path, velocity, acceleration)
    assert found.lower_bound == 0.0
    assert 2.0 * sqrt(2.0) <= found.trajectory.duration <= 1.003 * 2.0 * sqrt(2.0)
    assert_motion(found, path, velocity, acceleration)


def test_a_circle_at_constant_speed():
    """On a circle of radius 1 the speed cannot pass sqrt(a) where a joint turns around."""
    s = np.linspace(0, 4 * np.pi, 129)
    path = spline(np.stack([np.cos(s), np.sin(s)], axis=1), s)
    velocity, acceleration = symmetric(inf, inf), symmetric(1.0, 1.0)
    found = time_optimal(path, velocity, acceleration)
    s_d = found.law.evaluate(np.linspace(0.3, 0.7, 50) * found.law.end, 1)
    assert s_d.max() <= 1.2
    crossing = np.interp(2 * np.pi, found.law.evaluate(found.law.breaks)[:, 0], found.law.breaks)
    assert found.law.evaluate(crossing, 1)[0] == pytest.approx(1.0, rel=5e-3)
    assert_motion(found, path, velocity, acceleration)


def test_a_speed_cap_along_the_path():
    path = polyline([[0.0], [1.0]])
    cap = SpeedCap(lambda s: np.full(s.size, 0.25))
    found = time_optimal(path, symmetric(1.0), symmetric(1.0), further=[cap])
    assert found.trajectory.duration == pytest.approx(fastest(1.0, 0.25, 1.0, 1.0), rel=1e-9)
    cap = SpeedCap(lambda s: np.where(s < 0.5, inf, 0.25))
    found = time_optimal(path, symmetric(1.0), symmetric(1.0), further=[cap])
    expected = fastest(0.5, 1.0, 1.0, 1.0, 0.0, 0.25) + fastest(0.5, 0.25, 1.0, 1.0, 0.25, 0.0)
    assert found.trajectory.duration == pytest.approx(expected, rel=2e-3)
