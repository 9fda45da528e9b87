"""`time_optimal` within limits of jerk as a job: verified for all t, C2, refused where no such motion exists."""

from __future__ import annotations

import json

import numpy as np
import pytest
from through_jobs import curve_of, plan, refusal
from tiers import few

from trajcli.job.read import job_from_text
from trajcli.output.explain import explanation
from trajcli.planning.plan import plan_job

LIMITS = {"velocity": 2.0, "acceleration": 8.0, "jerk": 80.0}
POINTS = [[0.0, 0.0], [0.6, -0.2], [0.9, 0.5], [1.6, 0.7]]


def move(rows, *, start=None, to=None, **fields):
    through = [{"joints": row} for row in rows[1:]]
    through[-1].update(to or {})
    given = {"planner": "time_optimal", "through": through, **fields}
    return {"joints": rows[0], **(start or {})}, given


def fastest(rows=POINTS, *, limits=LIMITS, **rest):
    return plan(*move(rows, **rest), limits=limits)


def refused(rows=POINTS, *, limits=LIMITS, **rest):
    return refusal(*move(rows, **rest), limits=limits).problems[0]


@pytest.mark.full
@pytest.mark.parametrize(
    "fields",
    few(
        [
            {},
            {"rule": "natural"},
            {"rule": "clamped"},
            {"rule": "quintic"},
            {"parameter": "uniform"},
            {"path": "polyline"},
            {"path": "polyline", "corner": 0.05},
            {"path": "polyline", "corner": 0.5},
            {"duration": 5.0},
        ],
        4,
    ),
)
def test_every_kind_of_path_is_verified_and_smooth(fields):
    made = fastest(**fields)
    (alone,) = made.moves
    assert made.trajectory.spans[0].continuity == 2
    curve, passed = curve_of(made), alone.planned.via_points
    beside = np.abs(curve.evaluate(passed.times) - np.array(POINTS))
    np.testing.assert_allclose(beside, passed.missed, atol=1e-9)
    np.testing.assert_allclose(curve.evaluate(np.array([0.0, curve.end]), 2), 0.0, atol=1e-7)
    begins, ends = curve.piece_ends(2)
    np.testing.assert_allclose(begins[1:], ends[:-1], atol=1e-7)


def test_corners_stay_within_their_deviation_and_straight_in_between():
    made = fastest(path="polyline", corner=0.03)
    missed = made.moves[0].planned.via_points.missed
    assert missed[1:-1].max() == pytest.approx(0.03, rel=1e-9)
    assert not missed[[0, -1]].any()


@pytest.mark.full
def test_jerk_ignored_is_as_without_limits_of_jerk():
    without = {key: value for key, value in LIMITS.items() if key != "jerk"}
    reference = curve_of(fastest(limits=without))
    start, given = move(POINTS, jerk="ignore")
    ignored = curve_of(plan(start, given, limits=LIMITS, passes=False))
    np.testing.assert_array_equal(ignored.coefficients, reference.coefficients)
    assert fastest(limits=without).trajectory.spans[0].continuity == 1


@pytest.mark.full
def test_phases_name_the_limits_of_jerk_and_the_bound_is_told():
    told = explanation(fastest()).model_dump()["moves"][0]
    assert {phase["name"].split()[0] for phase in told["phases"]} >= {"jerk", "velocity"}
    (bound,) = (event for event in fastest().remarks if event.kind == "bound")
    assert bound.message.startswith("at most ")
    assert not bound.concedes
    assert fastest().moves[0].planned.phase_plane.law.dimension == 1


@pytest.mark.parametrize("rule", ["computed", "shape_preserving"])
def test_rules_with_jumps_of_curvature_are_refused(rule):
    problem = refused(rule=rule)
    assert "not_a_knot, natural, clamped or quintic" in problem.hint
    fastest(rule=rule, limits={"velocity": 2.0, "acceleration": 8.0})


@pytest.mark.parametrize("fields", few([{}, {"rule": "natural"}, {"rule": "quintic"}], 2))
def test_ends_in_motion_are_kept_with_their_accelerations(fields):
    velocity, acceleration = [0.3, 0.1], [0.5, -0.4]
    if fields.get("rule") == "quintic":
        acceleration = [1.5, 0.5]
    start = {"velocity": velocity, "acceleration": acceleration}
    made = fastest(start=start, to={"velocity": [0.2, 0.2]}, **fields)
    curve = curve_of(made)
    at_start = curve.evaluate_orders(np.zeros(1), (0, 1, 2))[0]
    np.testing.assert_allclose(at_start, [POINTS[0], velocity, acceleration], atol=1e-7)
    at_end = curve.evaluate_orders(np.full(1, curve.end), (0, 1, 2), side="left")[0]
    np.testing.assert_allclose(at_end, [POINTS[-1], [0.2, 0.2], [0, 0]], atol=1e-7)


def test_an_acceleration_that_leaves_the_path_is_refused_by_joint():
    line = [[0.0, 0.0], [1.0, 0.5]]
    start = {"velocity": [0.4, 0.2], "acceleration": [1.0, 0.5]}
    fastest(line, path="polyline", start=start)
    problem = refused(line, path="polyline", start={**start, "acceleration": [1.0, -0.5]})
    assert problem.joint == "j2"
    assert "leaves it" in problem.message
    assert "leaves it" in refused(start={"acceleration": [0.1, 0.0]}).message


def test_a_speed_from_which_nothing_stops_in_time_is_refused():
    assert "velocity" in refused([[0.0], [0.01]], start={"velocity": [1.0]}).message


@pytest.mark.full
@pytest.mark.parametrize(
    "rows",
    few(
        [
            [[0.0, 1.0], [1.0, 1.0]],
            [[0.0, 0.0], [0.5, 0.5], [0.5, 0.5], [1.0, 1.0]],
            [[0.0, 0.0], [0.2, 0.1], [1.0, 0.5]],
            [[0.0, 0.0], [0.0, 0.0]],
            [[0.0, 0.0], [1e-7, 2e-7]],
            [[0.0, 0.0], [1.0, 0.5], [0.0, 0.0]],
        ],
        5,
    ),
)
@pytest.mark.parametrize("path", ["spline", "polyline"])
def test_degenerate_points_have_a_motion(rows, path):
    fastest(rows, path=path)


@pytest.mark.full
def test_moves_hand_their_acceleration_on():
    """The state that jerk_limited leaves behind is where the next law begins."""
    state = {"joints": [0.6, -0.2], "velocity": [0.3, 0.3], "acceleration": [1.0, 0.2]}
    job = {
        "version": 1,
        "robot": {"joints": 2},
        "limits": LIMITS,
        "start": {"joints": [0.0, 0.0]},
        "moves": [
            {"planner": "jerk_limited", "to": state},
            {"planner": "time_optimal", "through": [{"joints": row} for row in POINTS[2:]]},
        ],
    }
    made = plan_job(job_from_text(json.dumps(job)))
    assert made.verdict.passed
    begins = made.moves[1].planned.curve.evaluate(0.0, 2)
    np.testing.assert_allclose(begins, [1.0, 0.2], atol=1e-7)
