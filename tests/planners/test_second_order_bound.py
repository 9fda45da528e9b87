"""The bound of chains without limits of jerk: below every motion, and the exact one where that is known."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from itertools import product

import numpy as np
import pytest
from scipy.optimize import linprog
from tiers import few

from trajcli.job.read import job_from_text
from trajcli.kinematics.robot import Limits, Robot
from trajcli.planners.course import joint_line
from trajcli.planners.flying_by import second_order_bound
from trajcli.planners.flying_by.second_order import CoursePart, ZonePassage, course_part
from trajcli.planning.adaptation import Adaptation
from trajcli.planning.plan import Plan, plan_job

PLANAR = {"velocity": 3, "acceleration": 8, "jerk": 60}
TARGETS = [[0.9, 1.25], [1.0, 2.0], [0.2, 1.0]]


def text_of(*targets: list[float], zone: float = 0.02, limits: dict[str, float] = PLANAR) -> str:
    moves = [{"planner": "jerk_limited", "to": {"joints": joints}} for joints in targets]
    job = {"version": 1, "robot": "planar2r", "limits": limits, "zone": zone}
    return json.dumps({**job, "start": {"joints": [0.3, 1.2]}, "moves": moves})


def job_of(*targets: list[float], zone: float = 0.02, limits: dict[str, float] = PLANAR) -> Plan:
    return _planned(text_of(*targets, zone=zone, limits=limits))


@cache
def _planned(text: str) -> Plan:
    plan = plan_job(job_from_text(text))
    assert plan.verdict.passed
    return plan


def bound_of(plan: Plan) -> float:
    assert plan.flyby is not None
    assert plan.flyby.second_order is not None
    return plan.flyby.second_order


def trapezoid(distance: float, velocity: float, acceleration: float) -> float:
    """Return the duration from rest to rest, by the textbook."""
    ramp = velocity**2 / acceleration
    return (
        2 * np.sqrt(distance / acceleration)
        if distance < ramp
        else distance / velocity + velocity / acceleration
    )


def test_collinear_moves_without_jerk_are_the_trapezoid_of_the_whole_way():
    plan = job_of([1.0, 1.2], [2.3, 1.2], zone=0.05, limits={"velocity": 3, "acceleration": 8})
    exact = trapezoid(2.0, 3, 8)
    assert 0.99 * exact <= bound_of(plan) <= exact


def test_the_smaller_the_zone_the_nearer_to_stopping():
    """In a ball of next to nothing the joints turn only where they hardly move."""
    limits = {"velocity": 3, "acceleration": 8}
    stops = [trapezoid(0.6, 3, 8), trapezoid(0.75, 3, 8)]
    bounds = [bound_of(job_of(*TARGETS[:2], zone=zone, limits=limits)) for zone in (1e-6, 1e-2)]
    assert bounds[0] > bounds[1]
    assert 0.98 * sum(stops) <= bounds[0] <= sum(stops)


@pytest.mark.parametrize("k", few([2.0, 0.5], 1))
def test_limits_times_k_divide_it_by_k(k: float):
    faster = {"velocity": 3 * k, "acceleration": 8 * k**2, "jerk": 60 * k**3}
    assert bound_of(job_of(*TARGETS[:2], limits=faster)) * k == pytest.approx(
        bound_of(job_of(*TARGETS[:2])), rel=1e-5
    )


def test_it_is_near_where_jerk_hardly_counts():
    plan = job_of(*TARGETS[:2], limits={"velocity": 3, "acceleration": 8, "jerk": 1e5})
    assert 0.99 * plan.trajectory.duration <= bound_of(plan) <= plan.trajectory.duration
    assert 0.85 * job_of(*TARGETS[:2]).trajectory.duration <= bound_of(job_of(*TARGETS[:2]))


def least_by_programme(step: float, v0: float, v1: float, limits: np.ndarray) -> float:
    """Return the least time of a joint between velocities by linear programmes on a grid, found by halving."""
    count = 60
    low, high = 0.0, 20.0
    for _ in range(18):
        middle = 0.5 * (low + high)
        h = middle / count
        ways = np.array([h * h * (count - k - 0.5) for k in range(count)])
        velocities = np.tril(np.full((count, count), h))
        found = linprog(
            np.zeros(count),
            A_ub=np.concatenate([velocities, -velocities]),
            b_ub=np.concatenate([np.full(count, limits[0, 1] - v0), np.full(count, v0 - limits[0, 0])]),
            A_eq=np.stack([ways, np.full(count, h)]),
            b_eq=[step - v0 * middle, v1 - v0],
            bounds=[tuple(limits[1])] * count,
        )
        low, high = (low, middle) if found.status == 0 else (middle, high)
    return high


@pytest.mark.parametrize("seed", few(range(12), 2))
def test_a_joint_alone_in_a_zone_needs_what_linear_programmes_say(seed: int):
    """Between exact velocities; anywhere in intervals about them it needs no more than that."""
    rng = np.random.default_rng(seed)
    limits = np.array([[-rng.uniform(1, 3), rng.uniform(1, 3)], [-rng.uniform(2, 9), rng.uniform(2, 9)]])
    v0, v1 = rng.uniform(-0.9, 0.9, 2)
    step = rng.uniform(-1.0, 1.0)
    passage = ZonePassage(np.array([step]), np.array([v0]), np.array([v1]), limits[:1], limits[1:])
    exact = float(passage.durations(np.ones((1, 2)), np.ones((1, 2)), 50.0)[0, 0])
    oracle = least_by_programme(step, v0, v1, limits)
    assert exact == pytest.approx(oracle, rel=0.03, abs=1e-3)
    assert exact <= oracle * (1 + 1e-4)
    wide = np.array([[0.8, 1.0], [1.0, 1.3]])
    assert (passage.durations(wide, wide, 50.0) <= exact * (1 + 1e-6)).all()


def test_a_straight_course_between_speeds_is_a_trapezoid():
    """Of the textbook: the time of each ramp and of what is left at the largest speed."""
    robot = arm()
    part = course_part(joint_line(np.zeros(2), np.array([2.0, 0.5]), robot), (0.1, 0.9), (False, False))
    v, a, way = 1.5, 4.0, 0.8  # of the first joint, over its 2 rad
    for first, last in product((0.2, 1.0), (0.4, 1.4)):
        exact = (v - first) / a + (v - last) / a
        exact += (way - (v**2 - first**2) / (2 * a) - (v**2 - last**2) / (2 * a)) / v
        found = lasting(part, first, last)
        assert 0.998 * exact <= found <= exact * (1 + 1e-9)
    assert lasting(part, 0.0, 1.5) < 9.0
    short = course_part(joint_line(np.zeros(2), np.array([2.0, 0.5]), robot), (0.1, 0.2), (False, False))
    assert lasting(short, 0.0, 1.4) == 9.0  # not within 0.1 at 4


def arm() -> Robot:
    return job_from_text(text_of(*TARGETS[:2], limits={"velocity": 3, "acceleration": 8})).robot


def lasting(part: CoursePart, first: float, last: float) -> float:
    rows = (np.full((1, 2), speed) for speed in (first, last))
    return float(part.durations(*rows, 9.0)[0, 0])


def test_next_to_a_stop_jerk_counts_as_in_the_first_phase_of_ruckig():
    """With hardly any other limit s takes (6 s / J)^(1/3) from rest."""
    loose = np.tile([-1e6, 1e6], (2, 1))
    robot = replace(arm(), limits=Limits(loose, loose, loose, np.tile([-60.0, 60.0], (2, 1))))
    part = course_part(joint_line(np.zeros(2), np.array([-2.0, 0.1]), robot), (0.0, 0.5), (True, False))
    rows = np.zeros((1, 2)), np.array([[0.0, 1e5]])
    assert part.durations(*rows, 9.0)[0, 0] == pytest.approx((6 * 0.5 * 2 / 60) ** (1 / 3), rel=1e-9)


def ur5e(rng: np.random.Generator) -> dict[str, object]:
    """Return a program of joint moves and lines of the tool of a UR5e."""
    points = np.array([0, -90, 90, -90, -90, 0]) + np.cumsum(rng.uniform(-25, 25, (4, 6)), axis=0)
    moves: list[dict[str, object]] = []
    for k, joints in enumerate(points[1:].tolist()):
        by = {"from": "here", "offset": {"xyz": rng.uniform(-120, 120, 3).tolist()}, "frame": "world"}
        line = {"planner": "line", "to": by, "law": {"shape": "time_optimal"}}
        joint = {"planner": "jerk_limited", "to": {"joints": joints}}
        moves.append(line if (k + int(rng.integers(2))) % 2 else joint)
    limits: dict[str, object] = {
        "velocity": 180,
        "acceleration": float(rng.uniform(200, 1000)),
        "jerk": float(np.exp(rng.uniform(7.6, 12))),
    }
    if rng.uniform() < 0.4:
        limits["tcp"] = {"speed": float(rng.uniform(200, 1500))}
    return {
        "version": 1,
        "units": {"angle": "deg", "length": "mm"},
        "robot": "ur5e",
        "limits": limits,
        "zone": float(rng.uniform(5, 80)),
        "start": {"joints": points[0].tolist()},
        "moves": moves,
    }


def test_it_is_that_of_the_limits_of_the_job_where_a_chain_is_planned_within_tighter_ones():
    """Rows for a consumer are planned so: a motion within the limits themselves may be faster."""
    loaded = job_of(*TARGETS[:2]).loaded
    adapted = Adaptation({(move, "velocity", joint): 1.0 for move in (0, 1) for joint in (0, 1)})
    tight = plan_job(loaded, adapted=adapted)
    assert tight.trajectory.duration > 1.1 * job_of(*TARGETS[:2]).trajectory.duration
    assert bound_of(tight) == pytest.approx(bound_of(job_of(*TARGETS[:2])), abs=0.01)


@pytest.mark.full
@pytest.mark.parametrize("seed", sorted({*range(40)} - {23}))  # a line of 23 leaves the arm's reach
def test_of_lines_and_joint_moves_it_is_never_above_the_motion(seed: int):
    plan = plan_job(job_from_text(json.dumps(ur5e(np.random.default_rng(seed)))))
    if plan.flyby is None or plan.flyby.chains is None:
        pytest.skip("stops")
    for chain in plan.flyby.chains:
        assert 0.5 * chain.duration <= second_order_bound(chain) <= chain.duration
