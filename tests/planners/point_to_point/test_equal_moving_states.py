"""A first move without a duration between equal states in motion: it has arrived when it starts."""

from __future__ import annotations

import json
from contextlib import suppress
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


LIMITS = np.array([3.0, 5.0, 40.0])[:, None] * [-1.0, 1.0]


def changed_over(speed: float, change: float) -> float:
    """Return how long a velocity takes to its opposite, from an acceleration to the same one: two ramps, and 5 between."""
    ramp = (min(np.sqrt(change**2 + 2 * speed * 40.0), 5.0) - change) / 40.0
    return float(2 * ramp + (2 * speed - 2 * ramp * change - 40.0 * ramp**2) / (change + 40.0 * ramp))


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(
    ("speed", "change"), [(0.009168044450836289, 3.806479155775645), (1.0, 2.0), (0.5, 5.0)]
)
@pytest.mark.parametrize("direction", [0.0, np.inf])
def test_a_joint_comes_back_as_it_went(speed: float, change: float, sign: int, direction: float) -> None:
    """Ruckig 0.19 crashes at the first of them, also where accelerations differ in the last bit."""
    last = (0.0, -sign * speed, -sign * np.nextafter(change, direction))
    found = fastest(BoundaryProblem("j1", (0.0, sign * speed, -sign * change), last, LIMITS))
    assert found.duration == pytest.approx(changed_over(speed, change), rel=1e-12)
    states = [found.curve().evaluate(np.array([found.duration]), order)[0, 0] for order in range(3)]
    np.testing.assert_allclose(states, last, atol=1e-11 * change)
    assert abs(found.curve().evaluate(np.array([found.duration / 2]), 1)[0, 0]) < 1e-12  # the same backwards


def test_a_job_may_turn_a_joint_round() -> None:
    state = {"joints": [0.3, -0.2], "velocity": [0.5, 0], "acceleration": [-1.0, 0]}
    back = {**state, "velocity": [-0.5, 0]}
    limits = {"velocity": 1.0, "acceleration": 2.0, "jerk": 10.0}
    job = {"version": 1, "robot": {"joints": 2}, "limits": limits, "start": state}
    plan = plan_job(job_from_text(json.dumps({**job, "moves": [{"planner": "jerk_limited", "to": back}]})))
    assert plan.verdict.passed
    assert plan.trajectory.duration == pytest.approx(0.55, rel=1e-12)  # 0.1 to -2, 0.35 there, 0.1 back


def test_accelerations_that_differ_are_asked_for_beside_the_target() -> None:
    """Ruckig 0.19 crashes here: a joint comes back as fast as it went, with a little more acceleration."""
    speed, change, jerk = 1.1418130478596065, 7.657694738094676, 10.25403720308747
    limits = np.array([20.694551947748764, change, jerk])[:, None] * [-1.0, 1.0]
    last = (0.0, -speed, -change * (1 - 8.067784912211014e-05))
    found = fastest(BoundaryProblem("j1", (0.0, speed, -change), last, limits))
    assert found.duration == pytest.approx(2 * speed / change, rel=1e-4)
    states = [found.curve().evaluate(np.array([found.duration]), order)[0, 0] for order in range(3)]
    np.testing.assert_allclose(states, last, atol=1e-9)


@pytest.mark.parametrize("unit", [1.0, 1e-6])
def test_slow_joints_that_come_back_do_not_end_the_process(unit: float) -> None:
    """In small units all of it is within the tolerances of ruckig 0.19, which then crashes."""
    speed, change = 3.0774540579254964e-05, -2.6203100708010796
    limits = np.array([2.4837576168318733, 2.620312691113771, 1966.0795777901374])[:, None] * [-unit, unit]
    last = (-1.942890293094024e-16 * unit, -3.075603514294754e-05 * unit, change * unit)
    with suppress(PlanningError):
        fastest(BoundaryProblem("j1", (0.0, speed * unit, change * unit), last, limits))
