"""Hard cases of corners that are flown by: singular ones, other branches, efforts, stops within moves, many zones."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from planning.test_flying_by import flown
from tiers import QUICK, few

from trajcli.checks.verify import verify
from trajcli.errors import InputError, PlanningError
from trajcli.job.read import job_from_text
from trajcli.planners.fastest_through_points.state_times import fastest_durations
from trajcli.planners.flying_by import chain_parts
from trajcli.planning.plan import Plan, plan_job

LIMITS = {"velocity": 3, "acceleration": 8, "jerk": 60}
FASTEST = {"law": {"shape": "time_optimal"}}
JERKLESS = {"velocity": 3, "acceleration": 8}


def to(*joints: float, **fields: Any) -> dict[str, Any]:
    return {"planner": "jerk_limited", "to": {"joints": list(joints)}, **fields}


@cache
def _planned(text: str) -> Plan:
    return plan_job(job_from_text(text))


def planned(*moves: dict[str, Any], **fields: Any) -> Plan:
    """Return the plan of a job of a planar arm with a zone of 20 mm, verified."""
    job = {"version": 1, "robot": "planar2r", "limits": LIMITS, "start": {"joints": [0.3, 1.2]}, "zone": 0.02}
    plan = _planned(json.dumps({**job, **fields, "moves": moves}, indent=1))
    assert plan.verdict.passed, plan.verdict.findings
    return plan


def place(q: np.ndarray) -> np.ndarray:
    """Return the place of the tool of planar2r by its textbook formula, m."""
    both = q.sum(axis=-1)
    return np.stack(
        [0.3 * np.cos(q[..., 0]) + 0.2 * np.cos(both), 0.3 * np.sin(q[..., 0]) + 0.2 * np.sin(both)]
    ).T


@pytest.mark.full
def test_a_singular_corner_is_flown_by():
    """The arm is stretched in its corner, at 0.5 m, and changes its elbow there."""
    plan = planned(to(0.8, 0.0), to(1.2, -0.5))
    (zone,) = plan.flyby.zones
    times = np.linspace(zone.entered, zone.left, 2001)
    q = plan.trajectory.curve.evaluate(times)
    assert np.linalg.norm(place(q) - place(np.array([0.8, 0.0])), axis=1).max() <= 0.02 * (1 + 1e-6)
    assert q[0, 1] > 0.02
    assert q[-1, 1] < -0.02
    assert plan.flyby.duration < 0.8 * plan.flyby.stopping


@pytest.mark.full
@pytest.mark.parametrize("size", few([0.3, 0.2, 0.1], 1))
def test_a_zone_that_is_left_at_half_its_size_is_flown_by_at_less(size):
    """A joint that hardly moves has no room, however slow: the motion needs borders nearer to the corner."""
    limits = {
        "velocity": [[-1, 3], [-3, 0.5]],
        "acceleration": [[-2, 8], [-8, 3]],
        "jerk": [60, 60],
    }
    zone = {"joints": [size, 0.02]}
    plan = planned(to(0.9, 1.25), to(1.0, 2.0), robot={"joints": 2}, limits=limits, zone=zone)
    assert plan.flyby.duration < 0.96 * plan.flyby.stopping
    (flown,) = plan.flyby.zones
    q = plan.trajectory.curve.evaluate(np.linspace(flown.entered, flown.left, 501))
    assert (np.abs(q - [0.9, 1.25]) <= np.array([size, 0.02]) * (1 + 1e-6)).all()


@pytest.mark.full
def test_a_corner_behind_which_another_branch_is_asked_for_is_refused_as_without_zones():
    line = {"planner": "line", "to": {"xyz": [0.3, 0.3, 0], "configuration": {"elbow": "down"}}, **FASTEST}
    for zone in (0.02, None):
        with pytest.raises(PlanningError, match="arrives in the configuration up, not down"):
            planned(to(0.8, -0.5), line, **({} if zone is None else {"zone": zone}))


@pytest.mark.full
def test_where_joints_may_step_a_limit_of_the_tools_jerk_stops_a_chain_until_they_may_not():
    """No size and no pace of its zone helps, so none is tried; what is advised does."""
    moves = to(0.9, 1.2), to(0.9, 0.5)
    held = {"tcp": {"jerk": 40}}
    stops = planned(*moves, limits={**JERKLESS, **held})
    assert not stops.flyby.zones
    (why,) = [event.message for event in stops.events if event.kind == "not_faster"]
    assert why.endswith("where that of joints is not: say `limits: {jerk: ...}`")
    flown = planned(*moves, limits={**LIMITS, **held}).flyby
    assert flown.duration < 0.95 * flown.stopping


@pytest.mark.full
def test_a_limit_that_binds_in_a_zone_alone_lowers_the_pace_of_the_zone_alone():
    """Along each line one joint turns the tool, by 8 rad/s^2 at most; in the zone both do, the one and the other way."""
    moves = to(0.9, 1.2), to(0.9, 0.5)
    free = planned(*moves)
    held = planned(*moves, limits={**LIMITS, "tcp": {"angular_acceleration": 9}})

    def largest(plan: Plan) -> tuple[float, float]:
        times = np.linspace(0, plan.trajectory.duration, 20001)
        turning = np.abs(plan.trajectory.curve.evaluate(times, 2).sum(axis=1))
        (zone,) = plan.flyby.zones
        inside = (times > zone.entered) & (times < zone.left)
        return float(turning[inside].max()), float(turning[~inside].max())

    assert largest(free)[0] > 10
    assert largest(free)[1] < 8 * (1 + 1e-9)
    assert 8.5 < largest(held)[0] < 9 * (1 + 1e-9)
    assert held.flyby.zones[0].pace < 1
    assert free.flyby.duration < held.flyby.duration < held.flyby.stopping


def lifting(limit: float) -> Plan:
    """Return the plan of an arm in a vertical plane that goes around the poses in which gravity pulls most."""
    links = [
        {"a": length, "effort": 100, "link": {"mass": mass, "com": [com, 0, 0], "inertia": [0] * 6}}
        for length, mass, com in ((0.3, 4, -0.15), (0.2, 2, 0))
    ]
    return planned(
        to(0, 2.236),
        to(1.291, -1.291),
        robot={"convention": "standard", "joints": links},
        gravity=[0, -9.81, 0],
        limits={"velocity": 1, "acceleration": 0.5, "jerk": 5, "effort": [limit, 100]},
        start={"joints": [-1.291, 1.291]},
        zone={"joints": [0.8, 2.2]},
    )


def gravity(q: np.ndarray) -> np.ndarray:
    """Return the torque of gravity about the first joint, N m: of 4 kg at 0.15 m and 2 kg at the tip."""
    arm = np.cos(q[..., 0])
    return np.asarray(9.81 * (0.6 * arm + 2 * (0.3 * arm + 0.2 * np.cos(q.sum(axis=-1)))))


def test_gravity_alone_over_an_effort_limit_inside_a_zone_makes_the_zone_smaller():
    """No pace helps there: along the path it is below 11.2 N m, in the middle of the zone above 12.5."""
    path = np.concatenate(
        [np.linspace(a, b, 101) for a, b in (([-1.291, 1.291], [0, 2.236]), ([0, 2.236], [1.291, -1.291]))]
    )
    assert gravity(path).max() < 11.2
    free, held = lifting(100), lifting(11.8)

    def most(plan: Plan) -> float:
        (zone,) = plan.flyby.zones
        return float(gravity(plan.trajectory.curve.evaluate(np.linspace(zone.entered, zone.left, 501))).max())

    assert most(free) > 12.5
    assert most(held) < 11.8
    assert held.flyby.zones[0].used < 0.6 * free.flyby.zones[0].used
    assert held.flyby.duration < held.flyby.stopping


def test_a_joint_that_slows_down_as_it_leaves_a_zone_came_no_faster_than_its_limit():
    """Both joints move at their largest speed: a state that asks for more before it is none, from either end."""
    plan = lifting(100)
    times = np.linspace(0, plan.trajectory.duration, 20001)
    assert np.abs(plan.trajectory.curve.evaluate(times, 1)).max() <= 1 + 1e-9
    assert plan.flyby.zones[0].pace == 1
    assert not [event for event in plan.events if event.kind in {"not_faster", "lowered"}]


POLYLINE = {
    "planner": "time_optimal",
    "path": "polyline",
    "through": [{"joints": [0.8, 1.5]}],
    "to": {"joints": [1.0, 1.3]},
}


@pytest.mark.parametrize("limits", few([JERKLESS, LIMITS], 1), ids=few(["no jerk", "jerk"], 1))
def test_a_move_that_stops_at_corners_of_its_own_is_flown_by_at_its_ends(limits):
    plan = planned(to(0.6, 1.3), POLYLINE, to(1.2, 2.0), limits=limits)
    assert [zone.move for zone in plan.flyby.zones] == [0, 1]
    assert plan.flyby.duration < 0.9 * plan.flyby.stopping
    passed = plan.moves[1].planned.via_points
    time = plan.trajectory.spans[1].start + passed.times[0]
    state = plan.trajectory.curve.evaluate_orders(np.array([time]), (0, 1))[0]
    np.testing.assert_allclose(state, [[0.8, 1.5], [0, 0]], atol=1e-7)


@pytest.mark.full
def test_of_points_in_zones_a_flown_move_promises_nothing():
    """The first one and the last one are nearer to the corners than their zones reach; those between are passed."""
    inner = np.array([[0.605, 1.302], [0.8, 1.5], [0.9, 1.45], [0.998, 1.303]])
    through = {**POLYLINE, "path": "spline", "through": [{"joints": point} for point in inner.tolist()]}
    plan = planned(to(0.6, 1.3), through, to(1.2, 2.0), limits=JERKLESS)
    assert [zone.move for zone in plan.flyby.zones] == [0, 1]
    passed = plan.moves[1].planned.via_points
    np.testing.assert_allclose(passed.points, inner[1:3])
    times = plan.trajectory.spans[1].start + passed.times
    np.testing.assert_allclose(plan.trajectory.curve.evaluate(times), inner[1:3], atol=1e-9)


@pytest.mark.full
@pytest.mark.parametrize(
    "stop", few([{"corner": "stop"}, {"radius": 0.02}], 1), ids=few(["corner", "radius"], 1)
)
def test_a_path_that_stops_at_its_corner_is_flown_by_at_its_ends(stop):
    own = {"radius": 0} if "radius" in stop else {}
    segments = [{"line": {"xyz": [0.25, 0.4, 0]}, **own}, {"line": {"xyz": [0.2, 0.35, 0]}}]
    path = {"planner": "path", "segments": segments, **FASTEST, **stop}
    plan = planned(to(0.5, 1.25), path, to(1.2, 2.0), limits=JERKLESS)
    assert len(plan.flyby.zones) == 2
    assert plan.flyby.duration < 0.95 * plan.flyby.stopping
    times = np.linspace(0, plan.trajectory.duration, 50001)
    places = place(plan.trajectory.curve.evaluate(times))
    nearest = int(np.linalg.norm(places - [0.25, 0.4], axis=1).argmin())
    assert np.linalg.norm(places[nearest] - [0.25, 0.4]) < 1e-5
    assert np.abs(plan.trajectory.curve.evaluate(times[nearest], 1)).max() < 1e-2


def test_an_explicit_zone_that_cannot_be_is_refused_before_any_move_is_planned():
    """That the second move is out of reach only planning tells."""
    far = {"planner": "line", "to": {"xyz": [9, 0, 0]}, **FASTEST}
    with pytest.raises(InputError, match="it is the last move"):
        planned(to(0.6, 1.3), far, to(1.2, 2.0, zone=0.02))


def test_a_law_at_the_velocity_of_another_move_is_caught():
    plan = flown()
    limits = plan.moves[0].robot.limits
    slow = replace(plan.moves[0].robot, limits=replace(limits, velocity=limits.velocity / 3))
    promise = plan.moves[0].promise
    parts = (replace(promise.parts[0], robot=slow), *promise.parts[1:])
    found = verify(
        plan.trajectory,
        [move.robot.limits for move in plan.moves],
        [replace(promise, parts=parts), plan.moves[1].promise],
    ).findings
    assert [(finding.move, finding.kind) for finding in found] == [(0, "velocity")]


def program(count: int) -> list[dict[str, Any]]:
    draws = np.random.default_rng(0)
    return [to(*(np.array([0.9, 1.25]) + draws.uniform(-0.5, 0.5, 2))) for _ in range(count)]


@pytest.mark.full
@pytest.mark.parametrize("count", [5 if QUICK else 51])
def test_many_zones_are_flown_by(count):
    plan = planned(*program(count))
    assert len(plan.flyby.zones) == count - 1
    assert plan.flyby.duration < 0.9 * plan.flyby.stopping


def test_where_nothing_is_far_the_arm_turns_back_at_once_with_all_its_acceleration():
    """Of two moves, there and back, a zone takes all but 0.03 rad of a joint; from rest to rest that is 0.252 s."""
    plan = planned(to(0.9, 1.25), to(0.3, 1.2), zone=0.5)
    (zone,) = plan.flyby.zones
    assert zone.left - zone.entered < 0.05
    assert plan.flyby.duration < 0.437


@pytest.mark.skipif(QUICK, reason="8 s")
def test_a_search_takes_little_more_for_each_of_fifty_moves_than_for_each_of_twelve(monkeypatch):
    """Counted, not timed: what ruckig is asked for."""
    asked = [0]

    def counting(steps, pairs, limits):
        asked[0] += steps.size
        return fastest_durations(steps, pairs, limits)

    monkeypatch.setattr(chain_parts, "fastest_durations", counting)
    each = []
    for count in (12, 50):
        asked[0] = 0
        planned(*program(count))
        each.append(asked[0] / count)
    assert each[1] < 1.25 * each[0]


def test_a_limit_of_the_tool_of_a_slide_is_one_of_its_joint_in_a_zone_without_a_limit_of_jerk():
    """The tool of a slide is as fast as its joint; on the borders its acceleration may be more than in the zone."""
    slide = {"joints": [{"type": "prismatic"}], "convention": "standard"}
    there_and_back = to(0.4, zone={"joints": 0.005}), to(0.3)
    job = {"robot": slide, "start": {"joints": [0]}, "zone": "stop"}
    of_joint, of_tool = (
        planned(*there_and_back, **job, limits={"velocity": 0.2, "acceleration": acceleration, "tcp": tcp})
        for acceleration, tcp in ((0.6, {}), (0.8, {"acceleration": 0.6}))
    )
    assert of_tool.flyby is not None
    assert of_tool.flyby.duration == pytest.approx(of_joint.flyby.duration, rel=1e-5)
    assert of_tool.flyby.duration < of_tool.flyby.stopping - 0.01
