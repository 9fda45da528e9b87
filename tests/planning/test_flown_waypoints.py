"""Moves through waypoints that are flown by at their ends: what holds of them, and where they stop."""

from __future__ import annotations

import itertools
import json
from typing import Any

import numpy as np
import pytest
from tiers import few

from trajcli.errors import InputError
from trajcli.job.read import job_from_text
from trajcli.planning.plan import Plan, plan_job

LIMITS = {"velocity": 3, "acceleration": 8, "jerk": 60}
START, CORNER = (0.3, 1.2), (0.9, 1.25)


def to(*joints: float, **fields: Any) -> dict[str, Any]:
    return {"planner": "jerk_limited", "to": {"joints": list(joints)}, **fields}


def planned(*moves: dict[str, Any], **fields: Any) -> Plan:
    """Return the plan of a job of a planar arm with a zone of 20 mm, verified."""
    start = {"joints": list(START)}
    job = {"version": 1, "robot": "planar2r", "limits": LIMITS, "start": start, "zone": 0.02}
    plan = plan_job(job_from_text(json.dumps({**job, **fields, "moves": moves}, indent=1)))
    assert plan.verdict.passed, plan.verdict.findings
    return plan


def place(q: np.ndarray) -> np.ndarray:
    """Return the place of the tool of planar2r by its textbook formula, m."""
    both = q.sum(axis=1)
    return np.stack(
        [0.3 * np.cos(q[:, 0]) + 0.2 * np.cos(both), 0.3 * np.sin(q[:, 0]) + 0.2 * np.sin(both)]
    ).T


def on_straight(q: np.ndarray, *corners: tuple[float, ...]) -> np.ndarray:
    """Return how far joints (m, n) are from a polyline in joint space, rad, (m,)."""
    gaps = []
    for first, last in itertools.pairwise(corners):
        step = np.subtract(last, first)
        if not step.any():
            continue
        along = np.clip((q - first) @ step / (step @ step), 0, 1)
        gaps.append(np.linalg.norm(q - first - along[:, None] * step, axis=1))
    return np.min(gaps, axis=0)


WAYS = {
    "between joint moves": [(1.0, 1.6), (0.8, 1.9), (0.6, 2.2)],
    "there and back": [(1.0, 1.6), CORNER],
    "one joint turns back": [(1.1, 1.25), (1.0, 1.25)],
    "no point between": [(0.6, 2.2)],
}


@pytest.mark.full
@pytest.mark.parametrize("name", few(list(WAYS), 1))
def test_waypoints_are_flown_by_at_their_ends_and_pass_their_points(name):
    *inner, last = WAYS[name]
    through = [{"joints": list(point)} for point in inner]
    waypoints = {"planner": "waypoints", "through": through, "to": {"joints": list(last)}}
    plan = planned(to(*CORNER), waypoints, to(0.2, 2.0))
    assert len(plan.flyby.zones) == 2
    assert plan.flyby.duration < 0.95 * plan.flyby.stopping
    assert plan.flyby.second_order < plan.flyby.duration
    curve, spans = plan.trajectory.curve, plan.trajectory.spans
    times = np.linspace(0, curve.end, int(curve.end * 1e4))
    for order, limit in ((1, 3.0), (2, 8.0), (3, 60.0)):
        assert np.abs(curve.evaluate(times, order)).max() <= limit * (1 + 1e-9)
    for order in range(3):
        first, ended = curve.piece_ends(order)
        assert np.abs(first[1:] - ended[:-1]).max() <= 1e-9 * max(1.0, np.abs(ended).max())
    own = times[(times >= spans[1].start) & (times <= spans[1].end)]
    for point in inner:
        assert np.linalg.norm(curve.evaluate(own) - point, axis=1).min() < 2e-4
    before, behind = plan.flyby.zones
    outside = (times < before.entered) | (times > behind.left)
    assert on_straight(curve.evaluate(times[outside]), START, CORNER, last, (0.2, 2.0)).max() < 1e-9
    for zone, corner in ((before, CORNER), (behind, last)):
        inside = times[(times >= zone.entered) & (times <= zone.left)]
        off = np.linalg.norm(place(curve.evaluate(inside)) - place(np.array([corner])), axis=1)
        assert off.max() <= 0.02 * (1 + 1e-6)


@pytest.mark.full
def test_waypoints_along_a_polyline_say_what_can_be_flown_by_in_their_place():
    """What they advise is followed."""
    points = {"through": [{"joints": [0.8, 1.5]}], "to": {"joints": [1.0, 1.6]}}
    moves = [to(0.6, 1.3, zone=0.02), {"planner": "waypoints", "straight": True, **points}, to(1.2, 2.0)]
    with pytest.raises(InputError, match="as `time_optimal` with `path: polyline` does") as caught:
        planned(*moves, zone="stop")
    (problem,) = caught.value.problems
    assert problem.place is not None
    assert '"zone"' in problem.place.source
    stopped = planned(*(moves[0] | {"zone": "stop"}, *moves[1:]))
    assert any("`time_optimal`" in remark.message for remark in stopped.remarks)
    moves[1] = {"planner": "time_optimal", "path": "polyline", **points}
    assert len(planned(*moves, zone="stop").flyby.zones) == 1


@pytest.mark.parametrize(
    ("fields", "reason"),
    [
        ({"minimum_durations": [0.1, 0.1]}, "its `minimum_durations` are given"),
        ({"through": [{"joints": [0.8, 1.5], "velocity": [0.1, 0]}]}, "a point between gives its velocity"),
        ({"to": {"joints": [1.0, 1.6], "velocity": [0.1, 0]}}, "it ends in motion"),
    ],
)
def test_waypoints_whose_speeds_are_given_stop_at_their_ends(fields, reason):
    points = {"through": [{"joints": [0.8, 1.5]}], "to": {"joints": [1.0, 1.6]}}
    moves = [to(0.6, 1.3, zone=0.02), {"planner": "waypoints", **points, **fields}, to(1.2, 2.0)]
    with pytest.raises(InputError, match=reason):
        planned(*moves, zone="stop")


def test_waypoints_that_start_in_motion_are_planned_as_without_zones():
    points = {"through": [{"joints": [0.8, 1.5]}], "to": {"joints": [1.0, 1.6]}}
    moving = {"start": {"joints": [0.6, 1.3], "velocity": [0.1, 0]}}
    plan = planned({"planner": "waypoints", **points}, to(1.2, 2.0), **moving)
    (event,) = (event for event in plan.events if event.kind == "not_faster")
    assert "starts in motion" in event.message
    assert plan.flyby.duration == plan.flyby.stopping
