"""A first move without a duration between equal states in motion: it has arrived when it starts."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from trajcli.errors import InputError, PlanningError
from trajcli.job.read import job_from_text
from trajcli.planners.ruckig import BoundaryProblem, fastest
from trajcli.planning.plan import Plan, plan_job

PLANNERS = ("jerk_limited", "trapezoid", "cubic", "quintic", "septic", "spline", "time_optimal")
STATE = {"joints": [0.3, -0.2], "velocity": [0.5, 0.25]}
NEXT = {"planner": "jerk_limited", "to": {"joints": [1.0, 0.0]}}


def planned(*moves: dict[str, Any]) -> Plan:
    limits = {"velocity": 1.0, "acceleration": 2.0, "jerk": 10.0}
    job = {"version": 1, "robot": {"joints": 2}, "limits": limits, "start": STATE, "moves": list(moves)}
    return plan_job(job_from_text(json.dumps(job)))


@pytest.mark.parametrize("fields", [*({"planner": tag} for tag in PLANNERS)], ids=PLANNERS)
@pytest.mark.parametrize("also", [{}, {"when_over_limit": "slow"}], ids=["as_is", "slow"])
def test_it_takes_no_time_and_keeps_its_velocity(fields: dict[str, Any], also: dict[str, Any]) -> None:
    plan = planned({**fields, **also, "to": STATE})
    curve = plan.trajectory.curve
    assert plan.verdict.passed
    assert plan.trajectory.duration == 0
    for order, values in enumerate(([0.3, -0.2], [0.5, 0.25], [0.0, 0.0])):
        np.testing.assert_array_equal(curve.evaluate(np.zeros(1), order)[0], values)


@pytest.mark.parametrize("synchronize", ["time", "phase", "none"])
def test_every_synchronisation(synchronize: str) -> None:
    plan = planned({"planner": "jerk_limited", "synchronize": synchronize, "to": STATE})
    assert plan.verdict.passed
    assert plan.trajectory.duration == 0


@pytest.mark.parametrize("tag", PLANNERS)
def test_the_next_move_goes_on_as_if_it_were_first(tag: str) -> None:
    both, alone = planned({"planner": tag, "to": STATE}, NEXT), planned(NEXT)
    assert both.verdict.passed
    t = np.linspace(0, alone.trajectory.duration, 50)
    np.testing.assert_array_equal(both.trajectory.curve.evaluate(t), alone.trajectory.curve.evaluate(t))


@pytest.mark.parametrize("fields", [{}, {"path": "polyline"}, {"through": [{"joints": [0.3, -0.2]}]}])
def test_time_optimal_names_the_joint_that_moves_where_no_path_leads_back(fields: dict[str, Any]) -> None:
    with pytest.raises(PlanningError) as caught:
        planned({"planner": "time_optimal", "to": {"joints": [0.3, -0.2]}, **fields})
    assert "starts with j1 at 0.5 rad/s, but all its points are one" in str(caught.value)


def test_jerk_limited_goes_where_time_optimal_cannot() -> None:
    """What the hint of time_optimal says."""
    plan = planned({"planner": "jerk_limited", "to": {"joints": [0.3, -0.2]}})
    assert plan.verdict.passed
    between = {"joints": [0.8, 0.05]}
    assert planned({"planner": "spline", "through": [between], "to": {"joints": [0.3, -0.2]}}).verdict.passed


@pytest.mark.parametrize("tag", ["cubic", "trapezoid", "time_optimal"])
@pytest.mark.parametrize("velocity", [[0.5, 0.25], [0.0, 0.0]], ids=["moving", "resting"])
def test_an_acceleration_at_the_start_is_refused_by_name(tag: str, velocity: list[float]) -> None:
    state = {"joints": [0.3, -0.2], "velocity": velocity}
    job = {
        "version": 1,
        "robot": {"joints": 2},
        "limits": {"velocity": 1.0, "acceleration": 2.0},
        "start": {**state, "acceleration": [0.7, 0.0]},
        "moves": [{"planner": tag, "to": state}],
    }
    with pytest.raises(InputError, match=f"{tag} cannot start with an acceleration"):
        plan_job(job_from_text(json.dumps(job)))


def test_accelerations_that_differ_by_rounding_do_not_end_the_process() -> None:
    """Ruckig 0.19 crashes where a joint comes back as it went: here its accelerations differ in the last bit."""
    speed, change = 0.009168044450836289, -3.806479155775645
    limits = np.array([3.0, 5.0, 40.0])[:, None] * [-1.0, 1.0]
    last = (0.0, -speed, np.nextafter(change, 0.0))
    with pytest.raises(PlanningError, match="no motion within"):
        fastest(BoundaryProblem("j1", (0.0, speed, change), last, limits))
