"""Jerk-limited motions with phases of about no length, where one case of ruckig's ends and the next begins."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from trajcli.errors import PlanningError
from trajcli.job.read import job_from_text
from trajcli.planners.ruckig import BoundaryProblem, fastest, fastest_of
from trajcli.planning.plan import Plan, plan_job

WITHIN = 1e-9  # relative: the tolerance with which limits are verified
MOTIONS = 150


def ramp(first: tuple[float, float], last: tuple[float, float], jerk: float, rate: float) -> float:
    """Return the distance of the fastest change of velocity, from the areas of its three phases."""
    (v, a), (w, b) = first, last
    if w < v:
        return -ramp((-v, -a), (-w, -b), jerk, rate)
    peak = min(rate, np.sqrt(max(0.0, jerk * (w - v) + (a * a + b * b) / 2)))
    up, down = (peak - a) / jerk, (peak - b) / jerk
    flat = (w - v - (peak + a) / 2 * up - (peak + b) / 2 * down) / peak if peak else 0.0
    distance = v * up + a * up**2 / 2 + jerk * up**3 / 6
    middle = v + (a + peak) / 2 * up
    distance += middle * flat + peak * flat**2 / 2
    middle += peak * flat
    return distance + middle * down + peak * down**2 / 2 - jerk * down**3 / 6


@pytest.mark.full
@pytest.mark.parametrize("seed", range(4))
def test_no_limit_is_exceeded_by_rounding(seed: int) -> None:
    """A displacement that just allows full velocity leaves a cruise of about no length."""
    rng = np.random.default_rng(seed)
    for _ in range(MOTIONS):
        v, a, j = 10 ** rng.uniform(-1, 1), 10 ** rng.uniform(-0.5, 1.5), 10 ** rng.uniform(1, 3.5)
        v0, v1 = rng.uniform(-0.9, 0.9, 2) * v * (rng.random(2) < 0.6)
        a0 = (rng.random() < 0.5) * rng.uniform(-0.9, 0.9) * min(a, np.sqrt(2 * j * (v - abs(v0))))
        full = ramp((v0, a0), (v, 0.0), j, a) + ramp((v, 0.0), (v1, 0.0), j, a)
        distance = full * (1 + rng.choice([1, -1]) * 10 ** rng.uniform(-15, -6))
        limits = np.array([v, a, j])
        bounds = limits[:, None] * np.array([-1.0, 1.0])
        problem = BoundaryProblem("j1", (0.0, v0, a0), (distance, v1, 0.0), bounds)
        quickest = fastest(problem)
        slower = fastest_of(problem, quickest.duration * (1 + 10 ** rng.uniform(-14, -6)))
        for profile in (quickest, slower):
            ends = [np.abs(profile.curve().piece_ends(order)).max() for order in (1, 2, 3)]
            assert (np.array(ends) <= limits * (1 + WITHIN)).all(), (v, a, j, v0, v1, a0, distance)


def planned(start: dict[str, Any], move: dict[str, Any], jerk: Any = 10.0) -> Plan:
    limits = {"velocity": 1.0, "acceleration": 2.0, "jerk": jerk}
    job = {"version": 1, "robot": {"joints": 2}, "limits": limits, "start": start, "moves": [move]}
    return plan_job(job_from_text(json.dumps(job)))


SMOOTH = [
    {"planner": "hold", "duration": 1.0},
    {"planner": "cycloidal", "to": {"joints": [1.0, 1.0]}},
    {"planner": "quintic", "to": {"joints": [0.0, 0.0]}},
    {"planner": "jerk_limited", "to": {"joints": [0.0, 0.0]}},
    {"planner": "jerk_limited", "synchronize": "phase", "to": {"joints": [1.0, 1.0]}},
]
STEPPING = [
    {"planner": "blends", "through": [{"joints": [1.0, 1.0]}], "to": {"joints": [1.0, 0.0]}},
    {"planner": "trapezoid", "to": {"joints": [0.0, 0.0]}},
    {"planner": "trapezoid", "to": {"joints": [1.0, 1.0]}},
]


@pytest.mark.parametrize("rate", [1e-16, -1e-13])
@pytest.mark.parametrize("move", [*SMOOTH, *STEPPING], ids=str)
def test_rates_of_rounding_size_are_rest(move: dict[str, Any], rate: float) -> None:
    jerk = 10.0 if move in SMOOTH else None
    moving = {"joints": [0.0, 0.0], "velocity": [rate, 0.0]}
    plan, resting = planned(moving, move, jerk), planned({"joints": [0.0, 0.0]}, move, jerk)
    assert plan.verdict.passed
    assert plan.trajectory.duration == resting.trajectory.duration


def test_a_rate_above_rounding_is_no_rest() -> None:
    with pytest.raises(PlanningError, match="hold starts at rest"):
        planned({"joints": [0.0, 0.0], "velocity": [1e-9, 0.0]}, SMOOTH[0])


START = {"joints": [0.0, 0.0], "velocity": [0.98, 0.49], "acceleration": [1.8, 0.9]}
END = {"joints": [2.0, 1.0], "velocity": [-0.98, -0.49], "acceleration": [1.8, 0.9]}


@pytest.mark.parametrize(
    ("start", "end"), [(START, {"joints": [2.0, 1.0]}), ({"joints": [0.0, 0.0]}, END)], ids=["start", "end"]
)
def test_one_law_whose_jerk_cannot_keep_a_velocity_limit(start: dict[str, Any], end: dict[str, Any]) -> None:
    """With the law's jerk, 10 for j1, its acceleration of 1.8 still adds 1.8^2 / 20 to its 0.98 rad/s."""
    move = {"planner": "jerk_limited", "synchronize": "phase", "to": end}
    with pytest.raises(PlanningError) as caught:
        planned(start, move, [100.0, 5.0])
    (problem,) = caught.value.problems
    assert problem.joint == "j1"
    assert abs(problem.value or 0.0) == pytest.approx(0.98 + 1.8**2 / 20)
    assert problem.hint == "say `synchronize: time`"
    assert planned(start, {**move, "synchronize": "time"}, [100.0, 5.0]).verdict.passed
