"""Lower bounds of motions through points against ruckig's fastest motions between turning points."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from ruckig import InputParameter, Ruckig, Trajectory

from trajcli.planners.fastest_through_points.problem import WaypointProblem
from trajcli.planners.fastest_through_points.state_times import shortest_duration

VELOCITY, ACCELERATION, JERK = [-0.6, 1.0], [-8.0, 3.0], 20.0


def problem(points, states, least=None):
    """Return a problem of joints with points (K + 1, n) and velocity and acceleration at both ends (2, n, 2)."""
    points = np.array(points, dtype=float).reshape(len(points), -1)
    count, n = points.shape
    given = np.zeros((count, n, 2))
    given[[0, -1]] = states
    fixed = np.zeros(given.shape, dtype=bool)
    fixed[[0, -1]] = True
    return WaypointProblem(
        points,
        np.tile(VELOCITY, (n, 1)),
        np.tile(ACCELERATION, (n, 1)),
        np.full(n, JERK),
        given,
        fixed,
        np.zeros(count - 1) if least is None else np.array(least),
        np.tile([-np.inf, np.inf], (n, 1)),
    )


def fastest(begin, end, velocity=VELOCITY, acceleration=ACCELERATION):
    """Return the duration between two states of one joint; infinite where ruckig has none."""
    given, result = InputParameter(1), Trajectory(1)
    given.current_position, given.current_velocity, given.current_acceleration = ([value] for value in begin)
    given.target_position, given.target_velocity, given.target_acceleration = ([value] for value in end)
    given.min_velocity, given.max_velocity = [velocity[0]], [velocity[1]]
    given.min_acceleration, given.max_acceleration = [acceleration[0]], [acceleration[1]]
    given.max_jerk = [JERK]
    return result.duration if Ruckig(1).calculate(given, result) >= 0 else np.inf


def accelerations(largest, speed):
    """Return free accelerations at a turning point; what they are left from or lead to keeps the limit of speed."""
    most = min(abs(largest), (2 * JERK * abs(speed)) ** 0.5 * (1 - 1e-9))
    return np.copysign(np.linspace(0.0, most, 801), largest)


def to_a_turn(begin, position):
    """Return the least duration from a state to rest with a free acceleration."""
    forward = position > begin[0]
    slowing = accelerations(ACCELERATION[0 if forward else 1], VELOCITY[1 if forward else 0])
    return min(fastest(begin, (position, 0.0, a)) for a in slowing)


def from_a_turn(position, end):
    """Return the least duration from rest with a free acceleration to a state."""
    forward = end[0] > position
    speeding = accelerations(ACCELERATION[1 if forward else 0], VELOCITY[1 if forward else 0])
    return min(fastest((position, 0.0, a), end) for a in speeding)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("joint", [0, 1, 2])
def test_out_and_back_each_way_has_its_own_limits(sign, joint):
    """One of three joints goes out by 1.5 and back by 0.9, over points between; the others hardly move, and can do more."""
    points = np.zeros((5, 3))
    points[:, joint] = sign * np.array([0.0, 0.7, 1.5, 1.1, 0.6])
    points[2, (joint + 1) % 3] = 1e-3
    more = np.where(np.arange(3) == joint, 1.0, 5.0)
    asked = problem(points, np.zeros((2, 3, 2)))
    limits = {"velocity": asked.velocity * more[:, None], "acceleration": asked.acceleration * more[:, None]}
    duration, slowest = shortest_duration(replace(asked, **limits, jerk=asked.jerk * more))
    turn, end = 1.5 * sign, (0.6 * sign, 0.0, 0.0)
    needed = to_a_turn((0.0, 0.0, 0.0), turn) + from_a_turn(turn, end)
    assert slowest == joint
    assert needed * (1 - 1e-4) <= duration <= needed * (1 + 1e-9)


@pytest.mark.parametrize("sign", [1, -1])
def test_ends_in_motion_may_have_any_acceleration(sign):
    """Whatever accelerations are given at moving ends: a bound with free ones is below all of them."""
    for speed_in, speed_out in ((0.4, 0.0), (0.0, 0.5), (0.4, 0.5)):
        states = np.zeros((2, 1, 2))
        states[:, 0, 0] = sign * speed_in, -sign * speed_out
        states[0, 0, 1] = 0.3 * sign * (speed_in > 0)
        points = sign * np.array([0.0, 0.7, 0.2])
        duration, _ = shortest_duration(problem(points, states))
        begin, end = (0.0, *states[0, 0]), (0.2 * sign, *states[1, 0])
        needed = to_a_turn(begin, 0.7 * sign) + from_a_turn(0.7 * sign, end)
        assert 0.9 * needed <= duration <= needed * (1 + 1e-9)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(
    ("given_in", "given_out"),
    [((0.0, 2.5), (0.0, 0.0)), ((0.4, 2.5), (0.0, 0.0)), ((0.0, 0.0), (0.0, 2.5)), ((0.0, 0.0), (0.4, 1.0))],
)
def test_an_end_with_an_acceleration_is_no_end_without(sign, given_in, given_out):
    """Out by 0.7 and back by 0.5: it leaves in full acceleration, or is braked in full when it arrives."""
    states = np.zeros((2, 1, 2))
    states[0, 0] = sign * np.array(given_in)
    states[1, 0] = sign * np.array(given_out) * [-1.0, 1.0]
    duration, _ = shortest_duration(problem(sign * np.array([0.0, 0.7, 0.2]), states))
    begin, end = (0.0, *states[0, 0]), (0.2 * sign, *states[1, 0])
    needed = to_a_turn_quickly(begin, 0.7 * sign) + from_a_turn_quickly(0.7 * sign, end)
    assert 0.8 * needed <= duration <= needed * (1 + 1e-9)


@pytest.mark.parametrize(("speed_in", "speed_out", "sign"), [(0.9, 0.0, 1), (0.0, 0.9, -1)])
def test_the_speed_at_an_end_is_that_of_this_end(speed_in, speed_out, sign):
    """Fast in the direction of the higher limit, at the start or at the target: little is left to gain there."""
    states = np.zeros((2, 1, 2))
    states[:, 0, 0] = sign * speed_in, -sign * speed_out
    duration, _ = shortest_duration(problem(sign * np.array([0.0, 0.7, 0.2]), states))
    begin, end = (0.0, *states[0, 0]), (0.2 * sign, *states[1, 0])
    needed = to_a_turn_quickly(begin, 0.7 * sign) + from_a_turn_quickly(0.7 * sign, end)
    assert 0.99 * needed <= duration <= needed * (1 + 1e-4)


def to_a_turn_quickly(begin, position):
    """Return the same as `to_a_turn`, from fewer accelerations there: those that end in 0 and the largest."""
    forward = position > begin[0]
    slowing = accelerations(ACCELERATION[0 if forward else 1], VELOCITY[1 if forward else 0])[::20]
    return min(fastest(begin, (position, 0.0, a)) for a in slowing)


def from_a_turn_quickly(position, end):
    """Return the same as `from_a_turn`, from fewer accelerations there."""
    forward = end[0] > position
    speeding = accelerations(ACCELERATION[1 if forward else 0], VELOCITY[1 if forward else 0])[::20]
    return min(fastest((position, 0.0, a), end) for a in speeding)


def test_a_start_that_leads_away_counts_as_rest():
    """The speed against the way is not taken for one along it; nor is rest with zero acceleration asked for."""
    states = np.zeros((2, 1, 2))
    states[0, 0, 0] = -0.3
    away, _ = shortest_duration(problem([0.0, 0.7, 0.2], states))
    assert away < fastest((0.0, -0.3, 0.0), (0.7, 0.0, 0.0)) + to_a_turn((0.2, 0.0, 0.0), 0.7)
    starts = [(0.0, 0.0, a) for a in np.linspace(0.0, ACCELERATION[1], 31)]
    counted = min(to_a_turn_quickly(start, 0.7) for start in starts)
    back = from_a_turn(0.7, (0.2, 0.0, 0.0))
    assert (counted + back) * (1 - 5e-3) <= away <= (counted + back) * (1 + 1e-9)


def test_segments_with_minimum_durations_and_slow_joints_are_summed():
    """Two joints take turns in being slow: at full speed 1 / 1.0 s, then 0.6 / 0.6 s; the last lasts 5 s at least."""
    points = [[0.0, 0.0], [1.0, -0.1], [1.1, -0.7], [1.1001, -0.7001]]
    duration, joint = shortest_duration(problem(points, np.zeros((2, 2, 2)), [0.0, 0.0, 5.0]))
    assert duration == pytest.approx(1.0 + 1.0 + 5.0)
    assert joint is None


def test_a_straight_way_is_bounded_by_the_motion_that_leaves_points_out():
    duration, joint = shortest_duration(problem([0.0, 0.4, 1.0, 2.0], np.zeros((2, 1, 2))))
    assert joint == 0
    assert duration == pytest.approx(fastest((0.0, 0.0, 0.0), (2.0, 0.0, 0.0)), rel=1e-8)


@pytest.mark.parametrize("shift", [3.0, -2.0])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_where_the_points_stand_is_no_matter_and_a_straight_way_is_as_ruckig_goes(sign, shift):
    """One joint over 1.2 with a point in between, from a motion backward: only the way as a whole sees that one."""
    begin, end = (0.0, -0.3 * sign, 0.0), (1.2 * sign, 0.0, 0.0)
    least = fastest(begin, end)
    points = sign * np.array([0.0, 0.5, 1.2])
    states = [[[-0.3 * sign, 0.0]], [[0.0, 0.0]]]
    for by in (0.0, shift):
        bound, joint = shortest_duration(problem(points + by, states))
        assert joint == 0
        assert bound <= least
        assert bound == pytest.approx(least, rel=1e-8)


def test_a_problem_in_its_units_is_the_same_problem():
    """Durations in units of time are those in s, states and limits too; positions keep their distance from the start."""
    states = [[[0.3, 1.0], [0.0, 0.0]], [[0.0, -0.5], [0.2, 0.0]]]
    points = [[3.0, 0.0], [3.7, 0.5], [4.2, 0.1]]
    asked = replace(problem(points, states, [0.0, 0.05]), position=np.array([[2.9, 4.4], [-1.0, 2.0]]))
    quick = np.array([8.0, 32.0])  # 1/8 of the time; the second joint with four times the lengths
    limits = {
        "velocity": asked.velocity * quick[:, None],
        "acceleration": asked.acceleration * 8 * quick[:, None],
    }
    asked = replace(asked, **limits, jerk=asked.jerk * 64 * quick)
    time, lengths = asked.units
    scaled = asked.scaled()
    assert time < 1.0 < lengths[1]
    assert scaled.points[0].tolist() == [0.0, 0.0]
    assert shortest_duration(scaled)[0] * time == pytest.approx(shortest_duration(asked)[0], rel=1e-6)
    assert scaled.least * time == pytest.approx([0.0, 0.05])
    assert scaled.states[..., 1] / scaled.acceleration[:, 1] == pytest.approx(
        asked.states[..., 1] / asked.acceleration[:, 1]
    )
    apart = (scaled.position - scaled.points[-1][:, None]) * lengths[:, None]
    assert apart == pytest.approx(asked.position - asked.points[-1][:, None])


def test_segments_that_are_left_out_keep_their_least_durations():
    every = problem([0.0, 0.1, 0.2, 0.3], np.zeros((2, 1, 2)), [1.0, 2.0, 4.0])
    assert every.only([0, 2, 3]).least.tolist() == [3.0, 4.0]
    assert every.only([0, 3]).least.tolist() == [7.0]
