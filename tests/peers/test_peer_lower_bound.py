"""The bound from below: closed forms, and the durations of planners that keep the limits."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from trajcli.kinematics.robot import Limits
from trajcli.peers.lower_bound import LowerBound, NoBound, fastest_duration
from trajcli.trajectory import State


def limits(velocity, acceleration, jerk=None):
    def bounds(values):
        values = np.asarray(values, dtype=float)
        return values if values.ndim == 2 else np.stack([-values, values], axis=1)

    free = np.full(len(velocity), np.inf)
    return Limits(
        bounds(free), bounds(velocity), bounds(acceleration), bounds(free if jerk is None else jerk)
    )


def state(position, velocity=0.0, acceleration=0.0):
    position = np.asarray(position, dtype=float)
    return State(position, np.zeros_like(position) + velocity, np.zeros_like(position) + acceleration)


@settings(max_examples=60, deadline=None)
@given(st.floats(1e-6, 1e3), st.floats(0.01, 100), st.floats(0.01, 100))
def test_rest_to_rest_without_jerk_limit_is_the_trapezoid(distance, speed, acceleration):
    reached = np.sqrt(acceleration * distance) < speed
    expected = 2 * np.sqrt(distance / acceleration) if reached else distance / speed + speed / acceleration
    for sign in (1, -1):
        bound = fastest_duration(state([0.0]), state([sign * distance]), limits([speed], [acceleration]))
        assert isinstance(bound, LowerBound)
        assert bound.duration == pytest.approx(expected, rel=1e-9)


@settings(max_examples=60, deadline=None)
@given(st.floats(1e-6, 1e3), st.floats(0.1, 10), st.floats(0.1, 30), st.floats(1, 1000))
def test_rest_to_rest_with_jerk_limit_is_the_double_s(distance, speed, acceleration, jerk):
    """Biagiotti and Melchiorri (2008), section 3.4.2, for boundary velocities of zero."""
    ramp = min(acceleration / jerk, np.sqrt(speed / jerk))
    rise = speed / (jerk * ramp) + ramp
    if speed * rise <= distance:
        expected = distance / speed + rise
    elif 2 * acceleration**3 / jerk**2 <= distance:
        ramp = acceleration / jerk
        expected = ramp + np.sqrt(ramp**2 + 4 * distance / acceleration)
    else:
        expected = 4 * (distance / (2 * jerk)) ** (1 / 3)
    bound = fastest_duration(state([0.0]), state([distance]), limits([speed], [acceleration], [jerk]))
    assert bound.duration == pytest.approx(expected, rel=1e-9)


def test_slowest_joint_binds():
    given_limits = limits([1.0, 1.0, 1.0], [1.0, 1.0, 1.0])
    assert fastest_duration(state([0.0] * 3), state([0.1, -4.0, 2.0]), given_limits) == LowerBound(5.0, 1)


def test_joints_with_and_without_a_jerk_limit_bound_together():
    mixed = limits([1.0, 1.0], [1.0, 1.0], [2.0, np.inf])
    assert fastest_duration(state([0.0] * 2), state([0.3, -4.0]), mixed) == LowerBound(5.0, 1)
    jerky = fastest_duration(state([0.0] * 2), state([4.0, 0.3]), mixed)
    assert (jerky.duration, jerky.joint) == (pytest.approx(4 / 1 + 1 / 1 + 1 / 2, rel=1e-12), 0)


def test_direction_of_the_limits_counts():
    given_limits = limits([[-0.5, 2.0]], [[-10.0, 10.0]])
    forth = fastest_duration(state([0.0]), state([4.0]), given_limits)
    back = fastest_duration(state([4.0]), state([0.0]), given_limits)
    assert forth.duration == pytest.approx(4 / 2 + 2 / 10, rel=1e-12)
    assert back.duration == pytest.approx(4 / 0.5 + 0.5 / 10, rel=1e-12)


def test_jerk_by_direction_is_bounded_by_the_looser_one():
    loose = fastest_duration(state([0.0]), state([1.0]), limits([9.0], [9.0], [20.0]))
    mixed = fastest_duration(state([0.0]), state([1.0]), limits([9.0], [9.0], [[-20.0, 5.0]]))
    assert mixed == loose


def test_accelerations_at_the_ends_count_with_a_jerk_limit_only():
    start, end = state([0.0], 0.0, 1.0), state([1.0], 0.0, -1.0)
    free, resting = limits([2.0], [3.0]), (state([0.0]), state([1.0]))
    assert fastest_duration(start, end, free) == fastest_duration(*resting, free)
    bounded = limits([2.0], [3.0], [10.0])
    assert fastest_duration(start, end, bounded).duration < fastest_duration(*resting, bounded).duration
    outside = state([0.0], 0.0, 99.0)
    assert fastest_duration(outside, end, free) == fastest_duration(*resting, free)


def test_same_state_takes_no_time():
    moving = state([1.0, 2.0], [0.5, -0.5])
    assert fastest_duration(moving, moving, limits([np.inf, 1.0], [np.inf, 1.0])) == LowerBound(0.0, None)


@pytest.mark.parametrize(
    ("quantity", "given_limits"),
    [
        ("velocity", limits([1.0, np.inf], [1.0, 1.0], [1.0, 1.0])),
        ("acceleration", limits([1.0, 1.0], [1.0, np.inf], [1.0, 1.0])),
    ],
)
def test_unlimited_joint_that_moves_has_no_bound(quantity, given_limits):
    found = fastest_duration(state([0.0, 0.0]), state([1.0, 1.0]), given_limits)
    assert found == NoBound(f"its {quantity} is unlimited", 1)
    assert isinstance(fastest_duration(state([0.0, 0.0]), state([1.0, 0.0]), given_limits), LowerBound)


def test_state_outside_the_limits_has_no_bound():
    given_limits = limits([1.0], [1.0], [1.0])
    assert fastest_duration(state([0.0], 2.0), state([9.0]), given_limits) == NoBound(
        "it starts outside its velocity limit", 0
    )
    assert fastest_duration(state([0.0]), state([9.0], 2.0), given_limits) == NoBound(
        "it ends outside its velocity limit", 0
    )
    assert "leads out" in fastest_duration(state([0.0], 0.95, 0.9), state([9.0]), given_limits).reason
    assert "could be found" in fastest_duration(state([0.0]), state([9.0], 0.95, -0.9), given_limits).reason


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_no_random_motion_within_the_limits_is_faster(seed):
    """Drive one joint with random jerks, take its peaks as limits: the bound must not exceed its duration."""
    rng = np.random.default_rng(seed)
    times, jerks = rng.uniform(0.05, 1.0, 8), rng.normal(size=8)
    states = [np.array([0.0, *rng.normal(size=2)])]
    tops = [states[0]]
    for t, j in zip(times, jerks, strict=True):
        p, v, a = states[-1]
        fine = np.linspace(0, t, 20)
        tops.append(np.abs([0 * fine, v + a * fine + j * fine**2 / 2, a + j * fine]).max(axis=1))
        if j and 0 < -a / j < t:
            tops.append(np.abs([0.0, v - a**2 / (2 * j), 0.0]))
        states.append(
            np.array([p + v * t + a * t**2 / 2 + j * t**3 / 6, v + a * t + j * t**2 / 2, a + j * t])
        )
    velocity, acceleration = np.max(np.abs(tops), axis=0)[1:] * (1 + 1e-9)
    first, last = (state([s[0]], s[1], s[2]) for s in (states[0], states[-1]))
    for jerk in (np.abs(jerks).max() * (1 + 1e-9), np.inf):
        found = fastest_duration(first, last, limits([velocity], [acceleration], [jerk]))
        if isinstance(found, LowerBound):
            assert found.duration <= times.sum() * (1 + 1e-9)
        else:
            assert "leads out" in found.reason
    assert fastest_duration(first, last, limits([velocity * 1e-3], [acceleration])) != found
