"""Durations between states at points against those of each joint by itself, one call of ruckig for each."""

from __future__ import annotations

import numpy as np
import pytest
from ruckig import InputParameter, Ruckig, RuckigError, Trajectory

from tests.planners.fastest_through_points.test_duration_bound import problem
from trajcli.planners.fastest_through_points.state_times import (
    common_duration,
    durations,
    fastest_durations,
    reachable,
)

LIMITS = np.array([-0.6, 1.0, -8.0, 3.0, -55.0, 20.0])  # the upper jerk counts both ways
RANGES = [0.5, 0.4, 1.5, 0.4, 1.5]  # of step, and of velocity and acceleration before and after


def alone(step, pair, limits=LIMITS):
    """Return the duration of one variable; infinite where ruckig has none."""
    given, result = InputParameter(1), Trajectory(1)
    given.current_velocity, given.current_acceleration = [pair[0]], [pair[1]]
    given.target_position, given.target_velocity, given.target_acceleration = [step], [pair[2]], [pair[3]]
    given.min_velocity, given.max_velocity, given.min_acceleration, given.max_acceleration = (
        [value] for value in limits[:4]
    )
    given.max_jerk = [limits[5]]
    try:
        return result.duration if Ruckig(1).calculate(given, result) >= 0 else np.inf
    except RuckigError:
        return np.inf


@pytest.mark.parametrize("impossible", [(), (0,), (4, 5), (11,)])
def test_many_at_once_are_what_each_is_alone(impossible):
    """Those that have no motion, wherever they stand, spoil none of the others."""
    drawn = np.random.default_rng(3).uniform(-1.0, 1.0, (12, 5)) * RANGES
    steps, pairs = drawn[:, 0], drawn[:, 1:]
    pairs[list(impossible), 2:] = 0.5, 3.5  # a larger acceleration at the end than is allowed
    found = fastest_durations(steps, pairs, np.tile(LIMITS, (12, 1)))
    assert np.isinf(found).nonzero()[0].tolist() == list(impossible)
    expected = [alone(*of) for of in zip(steps, pairs, strict=True)]
    assert found == pytest.approx(np.array(expected), rel=1e-9)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_state_is_reached_only_from_within_the_limits_of_velocity(sign):
    """An acceleration a was built up in a / j and changed the velocity by a^2 / (2 j): 2^2 / 40 = 0.1."""
    low, high = sorted([-0.6 * sign, 1.0 * sign])
    limits = np.array([[low, high, -5.0, 5.0, -20.0, 20.0]])
    inside = [(0.99, 0.0), (0.0, 2.0), (-0.49, 2.0), (0.89, -2.0), (0.99, 1.9), (-0.59, -1.9)]
    outside = [(1.01, 0.0), (-0.61, 0.0), (-0.51, 2.0), (0.91, -2.0), (1.01, 2.0), (-0.61, -2.0)]
    for states, within in ((inside, True), (outside, False)):
        for state in states:
            assert reachable(sign * np.array([state]), limits).tolist() == [within]
            rest = 0.0, *(sign * np.array(state))
            assert np.isfinite(alone(sign * 0.3, (0.0, *rest), limits[0])) == within


def test_all_joints_arrive_together_and_a_segment_lasts_at_least_so_long():
    """From rest to rest the slowest joint decides; the other states are those at the two ends of a segment."""
    points = [[0.0, 0.0], [0.3, 0.8], [0.9, 0.7], [1.0, 0.7]]
    states = np.zeros((4, 2, 2))
    states[1, 1], states[2, 0] = (0.3, 0.4), (0.2, -0.5)
    rests = np.zeros((2, 2, 2))
    asked = problem(points, rests, [0.0, 0.0, 4.0])
    pairs = np.concatenate([states[:-1], states[1:]], axis=2)
    by_joint = [[alone(asked.steps[k, j], pairs[k, j]) for j in range(2)] for k in range(3)]
    found = durations(asked, states)
    assert found == pytest.approx([max(by_joint[0]), max(by_joint[1]), 4.0], rel=1e-9)
    together = common_duration(np.array([0.1, -0.9]), np.zeros((2, 4)), np.tile(LIMITS, (2, 1)))
    assert together == pytest.approx(alone(-0.9, np.zeros(4)), rel=1e-9)
    assert together > alone(0.9, np.zeros(4))


def test_a_segment_without_a_motion_lasts_for_ever():
    states = np.zeros((3, 1, 2))
    states[1, 0] = 1.5, 0.0
    found = durations(problem([0.0, 0.5, 1.0], np.zeros((2, 1, 2))), states)
    assert np.isinf(found).tolist() == [True, False]  # an end above the limit; who begins there may slow down
    assert np.isinf(common_duration(np.array([0.5]), np.array([[0.0, 0.0, 1.5, 0.0]]), LIMITS[None]))
