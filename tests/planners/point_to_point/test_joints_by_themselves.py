"""Trapezoids of joints that arrive by themselves: what is said where several of them cannot."""

from __future__ import annotations

import math

import pytest
from random_jobs import only_move

from trajcli.errors import PlanningError


def test_every_joint_that_is_too_slow_for_the_duration_is_told() -> None:
    # from a start in motion there is no least acceleration to ask for, but a least duration of each joint
    move = {"planner": "trapezoid", "to": {"joints": [1, 3, 0.01]}, "synchronize": "none", "duration": 1.0}
    job = {
        "version": 1,
        "robot": {"joints": 3},
        "limits": {"velocity": 9, "acceleration": 2},
        "start": {"joints": [0, 0, 0], "velocity": [0.1, 0.1, 0]},
        "moves": [move],
    }
    planner, start, robot = only_move(job)
    with pytest.raises(PlanningError) as caught:
        planner.plan(start, robot)
    assert [problem.joint for problem in caught.value.problems] == ["j1", "j2"]
    # up to a peak v and down to rest: (v^2 - 0.1^2) / 4 + v^2 / 4 is the distance, in the time (2 v - 0.1) / 2
    least = [math.sqrt(2 * distance + 0.1**2 / 2) - 0.05 for distance in (1, 3)]
    assert [problem.amounts["low"].value for problem in caught.value.problems] == pytest.approx(least)
    planner, start, robot = only_move(job | {"moves": [move | {"duration": max(least) * (1 + 1e-9)}]})
    assert planner.plan(start, robot).curve.duration == pytest.approx(max(least))
