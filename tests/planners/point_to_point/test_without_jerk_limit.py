"""jerk_limited where joints have no limit of jerk: limited by acceleration."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from jerk_limited_moves import arm, excesses, misses, move_to, random_move, ruckigs_own, state

import trajcli

SEEDS, JOINTS = st.integers(0, 2**32 - 1), st.integers(1, 8)


def without_jerk(seed, n):
    """Return (start, end, robot) of a random move, most of whose joints have no limit of jerk."""
    start, end, robot = random_move(seed, n)
    jerk = robot.limits.jerk.copy()
    jerk[np.random.default_rng(seed + 1).random(n) < 0.7] = [-np.inf, np.inf]
    return start, end, arm(robot.limits.velocity, robot.limits.acceleration, jerk)


@settings(max_examples=60, deadline=None)
@given(SEEDS, JOINTS)
def test_moving_starts_and_targets(seed, n):
    start, end, robot = without_jerk(seed, n)
    planned = move_to(end).plan(start, robot)
    assert planned.curve.duration == pytest.approx(ruckigs_own(start, end, robot).duration, rel=1e-9)
    free = np.flatnonzero(np.isinf(robot.limits.jerk[:, 1]))
    broken = [miss for miss in misses(planned.curve, start, end) if miss[1] < 2 or miss[2] not in free]
    assert broken == []
    assert excesses(planned.curve, robot.limits) == []
    assert not planned.curve.piece_ends(3)[0][:, free].any()


@settings(max_examples=30, deadline=None)
@given(st.floats(0.01, 10), st.floats(0.1, 5), st.floats(0.1, 5))
def test_rest_to_rest_is_the_trapezoid(distance, velocity, acceleration):
    planned = move_to(state([distance])).plan(state([0.0]), arm([velocity], [acceleration], [np.inf]))
    peak = min(velocity, np.sqrt(distance * acceleration))
    assert planned.curve.duration == pytest.approx(distance / peak + peak / acceleration, rel=1e-12)


def test_one_law_for_all_joints():
    ends = state([0.0, 0.0]), state([1.0, -0.5])
    robot = arm([1.0] * 2, [2.0] * 2, [np.inf, 50.0])
    planned = move_to(ends[1], synchronize="phase").plan(ends[0], robot)
    t = np.linspace(0, planned.curve.duration, 30)
    q = planned.curve.evaluate(t)
    np.testing.assert_allclose(q[:, 1], -0.5 * q[:, 0], atol=1e-12)
    assert excesses(planned.curve, robot.limits) == []


def test_a_job_without_a_limit_of_jerk_verifies_and_reports_its_steps():
    job = {
        "version": 1,
        "robot": {"joints": 2},
        "limits": {"velocity": 1, "acceleration": 2, "jerk": None},
        "start": {"joints": [0, 0], "velocity": [0.5, -0.2]},
        "moves": [
            {"planner": "jerk_limited", "to": {"joints": [1, 0.5], "velocity": [0.3, 0]}},
            {"planner": "jerk_limited", "to": {"velocity": [0, 0]}},
            {"planner": "jerk_limited", "to": {"joints": [0, 0]}, "minimum_duration": 3},
        ],
    }
    plan = trajcli.plan(job)
    assert plan.verdict.passed
    # from 0.5 to 1 in 0.25 s, down to 0.3 in 0.35 s, the rest at 1; then 0.15 s to stop
    expected = 0.25 + 0.35 + (1 - 0.75 * 0.25 - 0.65 * 0.35) + 0.15 + 3
    assert plan.trajectory.duration == pytest.approx(expected, rel=1e-12)
