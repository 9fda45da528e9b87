"""Bound between turning points: against ruckig, brute force over free accelerations, and every law found."""

import numpy as np
import pytest
from jerk_paths import PANDA, both, judged, polyline, spline
from test_jerk_limited_laws import judged_problem, random_problem, ruckig_duration
from tiers import few

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.curves.turning_bound import bound_between_stops, turning_bound


def line(distance):
    return PiecewisePolynomial(np.array([0.0, 1.0]), np.array([[[distance]], [[0.0]]]))


@pytest.mark.parametrize("distance", [1e-4, 0.01, 0.3, 5.0])
@pytest.mark.parametrize("jerk", [1.0, 30.0, 1e4])
@pytest.mark.parametrize("sign", [1, -1])
def test_from_rest_to_rest_it_is_the_fastest_motion_of_the_joint(distance, jerk, sign):
    bounds = both([1.0]), both([4.0]), both([jerk])
    duration, joint = turning_bound(line(sign * distance), bounds, (0.0, 0.0))
    assert joint == 0
    assert duration == pytest.approx(ruckig_duration(distance, 1.0, 4.0, jerk), rel=1e-9)


def least_with_free_start(distance, velocity, acceleration, jerk):
    from ruckig import InputParameter, Ruckig, Trajectory

    best = np.inf
    for start in np.linspace(0.0, acceleration, 2001):
        problem, result = InputParameter(1), Trajectory(1)
        problem.current_position, problem.target_position = [0.0], [distance]
        problem.current_acceleration = [start]
        problem.max_velocity, problem.max_acceleration = [velocity], [acceleration]
        problem.max_jerk = [jerk]
        if Ruckig(1).calculate(problem, result) >= 0:
            best = min(best, result.duration)
    return best


@pytest.mark.parametrize("jerk", [5.0, 50.0])
def test_half_of_a_motion_there_and_back_has_a_free_acceleration(jerk):
    """A joint that goes out and comes back turns once: two halves, alike in reversed time."""
    path = PiecewisePolynomial(np.array([0.0, 1.0, 2.0]), np.array([[[0.7], [-0.7]], [[0.0], [0.7]]]))
    duration, _ = turning_bound(path, (both([1.0]), both([4.0]), both([jerk])), (0.0, 0.0))
    assert duration == pytest.approx(2 * least_with_free_start(0.7, 1.0, 4.0, jerk), rel=1e-4)


def test_from_stop_to_stop_straight_lines_are_as_fast_as_the_tightest_limits_of_all_joints_allow():
    points = np.array([[0.0, 0.0], [0.4, 0.1], [0.5, 0.9], [-0.1, 0.6]])
    limits = np.array([[1.0, 0.6], [4.0, 5.0], [50.0, 30.0]])
    path = polyline(points)
    bounds = tuple(both(each) for each in limits)
    duration, joint = bound_between_stops(path, bounds, (0.0, 0.0), path.breaks[1:-1])
    expected = [
        ruckig_duration(1.0, *(limits / np.abs(step)).min(axis=1).tolist())
        for step in np.diff(points, axis=0)
    ]
    assert joint is None
    assert duration == pytest.approx(sum(expected), rel=1e-9)
    assert turning_bound(path, bounds, (0.0, 0.0))[0] < 0.9 * duration
    motion = judged(path, *bounds)
    assert motion.bounded_by_stops
    assert duration * (1 - 1e-9) <= motion.law.duration <= duration * 1.002


def test_where_a_path_goes_back_as_it_came_its_acceleration_is_free():
    """Of two joints that both turn back at a stop, which neither stands still at: limits of one bind."""
    path = polyline(np.array([[0.0, 0.0], [0.7, 0.35], [0.0, 0.0]]))
    bounds = both([1.0, 9.0]), both([4.0, 9.0]), both([50.0, 99.0])
    duration, _ = bound_between_stops(path, bounds, (0.0, 0.0), path.breaks[1:-1])
    assert duration == pytest.approx(2 * least_with_free_start(0.7, 1.0, 4.0, 50.0), rel=1e-4)


@pytest.mark.parametrize("seed", few(range(24), 3))
def test_no_law_is_faster(seed):
    path, *bounds = random_problem(seed)
    motion = judged_problem(seed)
    assert turning_bound(path, tuple(bounds), (0.0, 0.0))[0] <= motion.law.duration * (1 + 1e-9)
    assert motion.lower_bound <= motion.law.duration * (1 + 1e-9)


def test_a_tight_jerk_is_bounded_by_a_joint():
    path = spline(np.linspace(0, 1, 4), np.array([[0.0], [0.4], [0.7], [1.0]]))
    motion = judged(path, both(PANDA[0][:1]), both(PANDA[1][:1]), both([5.0]))
    assert motion.bounding_joint == 0
    assert motion.law.duration <= 1.001 * motion.lower_bound
