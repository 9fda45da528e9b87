"""Splines without times through dense points of a sine, against the fastest motion of one joint to and fro."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from through_jobs import plan
from tiers import few

LIMITS = {"velocity": 1.0, "acceleration": 5.0, "jerk": 50.0}
TURNS = [0.0, 1.0, -1.0, 1.0, float(np.sin(10))]
# from turn to turn a triangle or trapezoid of velocity: distance / v + v / a, both ends at rest
FASTEST = sum(abs(b - a) / 1.0 + 1.0 / 5.0 for a, b in pairwise(TURNS))


def through_sine(count, rule="continuous_acceleration", amplitudes=(1.0,), passes=True):
    rows = np.sin(10 * np.arange(count + 1) / count)[:, None] * amplitudes
    points = [{"joints": row} for row in rows.tolist()]
    move = {"planner": "spline", "rule": rule, "through": points[1:]}
    return plan(points[0], move, passes=passes, limits=LIMITS)


@pytest.mark.full
@pytest.mark.parametrize("count", few([73, 400, 150, 1000], 1))
def test_dense_points_are_passed_about_as_fast_as_the_joint_can(count):
    planned = through_sine(count)
    assert planned.verdict.passed
    assert FASTEST < planned.trajectory.duration < 1.05 * FASTEST
    assert not [event for event in planned.events if event.kind == "local_optimum"]


@pytest.mark.full
@pytest.mark.parametrize("rule", few(["natural", "not_a_knot", "clamped"], 1))
def test_other_rules(rule):
    """All but natural begin or end with a step in acceleration, which a jerk limit forbids."""
    assert through_sine(90, rule, passes=rule == "natural").trajectory.duration < 1.10 * FASTEST


@pytest.mark.full
def test_slower_joints_beside_change_nothing():
    assert through_sine(120, amplitudes=(1.0, 0.3)).trajectory.duration < 1.05 * FASTEST


@pytest.mark.full
def test_event_says_that_faster_times_may_exist():
    """A quintic with computed accelerations cannot follow dense points smoothly."""
    planned = through_sine(150, "quintic")
    (event,) = [event for event in planned.events if event.kind == "local_optimum"]
    assert planned.trajectory.duration > 1.05 * FASTEST
    assert f"{planned.trajectory.duration:.6g}"[:5] in event.message
    assert event.concedes
