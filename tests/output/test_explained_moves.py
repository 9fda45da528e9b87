"""Moves in explanations: which are told, in whose units and times, and closed forms that are evaluated again."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from trajcli.job.read import job_from_text
from trajcli.job.report import Report
from trajcli.kinematics.forward import forward
from trajcli.output.explain import explanation
from trajcli.output.report import report_of
from trajcli.planners.planner import Event
from trajcli.planning.plan import Plan, plan_job

ARM = {"joints": [{"name": "slide", "type": "prismatic"}, {"name": "turn"}, {"name": "still"}]}
JOB: dict[str, Any] = {
    "version": 1,
    "units": {"angle": "deg", "length": "mm"},
    "robot": ARM,
    "limits": {"velocity": [200, 60, 60], "acceleration": [400, 90, 90], "jerk": None},
    "start": {"joints": [100, 10, -5]},
    "moves": [
        {"planner": "cycloidal", "to": {"joints": [40, 30, -5]}, "duration": 2},
        {"planner": "trapezoid", "to": {"joints": [140, -20, -5]}, "synchronize": "none"},
        {
            "planner": "spline",
            "through": [{"joints": [220, 0, -5], "time": 1}],
            "to": {"joints": [100, 10, -5], "time": 2},
        },
    ],
}


@cache
def planned() -> Plan:
    return plan_job(job_from_text(json.dumps(JOB)))


def test_one_move_is_told_with_what_is_of_the_job_as_a_whole() -> None:
    """Events of other moves are left out, those of no move are kept; times are those of the job."""
    events = tuple(Event(f"of {k}", "text", k) for k in (None, 0, 1, 2))
    plan = replace(planned(), events=events)
    for move in range(3):
        told = explanation(plan, move=move)
        assert [each.index for each in told.moves] == [move]
        assert [event.kind for event in told.events] == ["of None", f"of {move}"]
        assert {step.move for step in told.steps} <= {move}
        assert told.joints == ["slide", "turn", "still"]
    whole = explanation(plan)
    assert [each.index for each in whole.moves] == [0, 1, 2]
    assert len(whole.events) == 4
    steps = {step.move for step in whole.steps}
    assert 1 in steps
    assert any(step.move == 1 for step in explanation(plan, move=1).steps)
    findings = tuple(Event("of findings", "text", None) for _ in range(1))
    assert explanation(replace(plan, events=findings), move=2).events[0].message == "text"


def value_of(form: str, t: float) -> float:
    """Return what a formula of the text gives at a time."""
    text = form.replace(" (", " * (").replace("2 pi t", "2 * pi * t").replace("(2 pi)", "(2 * pi)")
    return float(eval(text, {"sin": math.sin, "cos": math.cos, "pi": math.pi, "t": t}))


def test_a_closed_form_is_the_motion_in_the_units_of_the_job() -> None:
    """Also backwards, from a start that is not zero; a joint that stands is a number."""
    move = explanation(planned(), derivatives=True).moves[0]
    forms = move.closed_form
    assert forms is not None
    assert forms["still"] == "-5"
    for t in (0.0, 0.3, 1.1, 2.0):
        q = planned().trajectory(t)
        assert value_of(forms["slide"], t) == pytest.approx(1e3 * q[0], abs=1e-6)
        assert value_of(forms["turn"], t) == pytest.approx(np.degrees(q[1]), abs=1e-6)
    rates = move.closed_form_derivatives
    assert rates is not None
    assert [len(each) for each in rates.values()] == [2, 2, 2]
    assert rates["still"] == ["0", "0"]
    assert rates["slide"][0].startswith("-60 ")
    assert rates["turn"][0].startswith("20 ")
    assert explanation(planned()).moves[0].closed_form_derivatives is None
    assert explanation(planned()).moves[1].closed_form is None


def test_each_joint_alone_has_its_duration() -> None:
    """Slide: 100 mm at 200 mm/s and 400 mm/s^2 is a triangle of 1 s; turn: 50 deg at 60 deg/s and 90 deg/s^2."""
    move = explanation(planned()).moves[1]
    assert move.arrivals == pytest.approx({"slide": 1.0, "turn": 50 / 60 + 60 / 90, "still": 0.0})
    names = {phase.joint for phase in move.phases}
    assert {"slide", "turn"} <= names
    ends = {
        joint: max(phase.end for phase in move.phases if phase.joint == joint) for joint in ("slide", "turn")
    }
    assert max(ends.values()) == pytest.approx(move.duration)


def test_times_of_a_move_count_from_its_start() -> None:
    """Breaks, waypoints, and where a joint leaves their range; those of the report count from the job's."""
    plan = planned()
    move, start = explanation(plan).moves[2], plan.trajectory.spans[2].start
    assert move.breaks[0] == 0
    assert move.breaks[-1] == pytest.approx(2)
    assert move.waypoints is not None
    assert [point.time for point in move.waypoints] == pytest.approx([0, 1, 2])
    assert [point.joints for point in move.waypoints] == [
        pytest.approx(each) for each in ([140, -20, -5], [220, 0, -5], [100, 10, -5])
    ]
    assert [point.units for point in move.waypoints] == [["mm", "deg", "deg"]] * 3
    assert all(point.missed == pytest.approx([0, 0, 0], abs=1e-9) for point in move.waypoints)
    assert move.outside
    for each in move.outside:
        assert 0 <= each.time <= 2
        joint = ["slide", "turn", "still"].index(each.joint)
        q = plan.trajectory(start + each.time)[joint] * (1e3 if each.joint == "slide" else 180 / np.pi)
        span = [point.joints[joint] for point in move.waypoints]
        beyond = q - max(span) if each.beyond > 0 else q - min(span)
        assert beyond == pytest.approx(each.beyond, abs=1e-6)


def test_polynomials_are_the_motion_and_come_with_derivatives_where_asked_for() -> None:
    plan = planned()
    for move, span in zip(
        explanation(plan, derivatives=True).moves[1:], plan.trajectory.spans[1:], strict=True
    ):
        for joint, (name, pieces) in enumerate(move.polynomials.items()):
            factor = 1e3 if name == "slide" else 180 / np.pi
            for piece in pieces:
                for t in np.linspace(piece.start + 1e-9, piece.end - 1e-9, 3):
                    wanted = [plan.trajectory(span.start + t, order)[joint] * factor for order in range(3)]
                    assert piece.velocity is not None
                    assert piece.acceleration is not None
                    for order, coefficients in enumerate(
                        (piece.absolute, piece.velocity, piece.acceleration)
                    ):
                        assert np.polyval(coefficients[::-1], t) == pytest.approx(wanted[order], abs=1e-5)
    assert all(
        piece.velocity is None
        for pieces in explanation(plan).moves[1].polynomials.values()
        for piece in pieces
    )


def test_findings_of_other_moves_are_left_out() -> None:
    moves = [{"planner": "quintic", "to": {"joints": [x, 10, -5]}, "duration": 0.2} for x in (140, 100)]
    plan = plan_job(job_from_text(json.dumps({**JOB, "moves": moves})))
    assert {finding.move for finding in explanation(plan).findings} == {0, 1}
    for move in (0, 1):
        assert {finding.move for finding in explanation(plan, move=move).findings} == {move}


def test_higher_limits_are_tried_in_the_moves_that_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    tried: list[list[int]] = []
    monkeypatch.setattr(
        "trajcli.planning.binding_limits.savings_of", lambda plan, moves: tried.append([*moves]) or iter(())
    )
    explanation(planned(), move=1, sensitivity=True)
    explanation(planned(), sensitivity=True)
    explanation(planned())
    assert tried == [[1], [0, 1, 2]]


def test_all_moves_along_paths_are_compared_with_a_peer_where_that_is_asked_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[dict[str, bool]] = []

    def reported(plan: Plan, **named: bool) -> Report:
        asked.append(named)
        return report_of(plan)

    monkeypatch.setattr("trajcli.output.explain.report_of", reported)
    for reference in (False, True):
        explanation(planned(), move=2, reference=reference)
        assert asked[-1] == {"reference": True, "peers": reference}


def test_a_blend_about_the_start_begins_before_the_times_of_the_job() -> None:
    """By half of its 0.3 s: the zero of the job's times lies there, and `unshifted` counts from it."""
    move = {
        "planner": "blends",
        "through": [{"joints": [120, 20, -5], "time": 1}, {"joints": [100, 10, -5], "time": 2}],
        "blend_durations": 0.3,
    }
    plan = plan_job(job_from_text(json.dumps({**JOB, "moves": [move]})))
    told = explanation(plan).moves[0]
    assert told.origin == pytest.approx(0.15)
    for piece in told.polynomials["slide"]:
        middle = (piece.start + piece.end) / 2
        q = 1e3 * plan.trajectory(middle)[0]
        assert piece.unshifted is not None
        assert np.polyval(piece.unshifted[::-1], middle - 0.15) == pytest.approx(q, abs=1e-6)
        assert np.polyval(piece.local[::-1], middle - piece.start) == pytest.approx(q, abs=1e-6)


def test_an_arm_whose_rail_is_pinned_is_singular_where_its_wrist_is_aligned() -> None:
    """With its fifth joint at zero it moves the tool in five directions; free, the rail would make them six."""
    rail = {"axis": [1, 0, 0], "velocity": 1, "acceleration": 2, "jerk": 9, "position": [0, 2]}
    job = {
        "version": 1,
        "robot": {"rail": rail, "arm": "ur5e"},
        "limits": {"acceleration": 3, "jerk": 30},
        "start": {"joints": [0, 0.3, -1.2, 1.1, 0.2, 0.4, 0.1]},
        "moves": [{"planner": "hold", "duration": 1}],
    }
    robot = job_from_text(json.dumps(job)).robot
    for bend, singular in ((0.0, True), (0.4, False)):
        pose = forward(robot, np.array([0.5, 0.3, -1.2, 1.1, 0.2, bend, 0.1]))
        target = {"matrix": pose.tolist(), "joints": {robot.joint_names[0]: 0.5}}
        job["moves"] = [{"planner": "quintic", "to": target, "duration": 9}]
        told = explanation(plan_job(job_from_text(json.dumps(job)))).moves[0].to_pose
        assert told is not None
        assert told.joints[0] == pytest.approx(0.5)
        assert (told.singular, told.rank) == (singular, {"here": 5 if singular else 6, "nearby": 6})
        assert (told.free_direction is not None) == singular


FACTORS = np.array([1e3, 180 / math.pi, 180 / math.pi])


@pytest.mark.parametrize("duration", [0.3, 0.25, 0.7])
def test_blends_are_the_motion_about_their_points_in_the_times_and_units_of_the_job(duration: float) -> None:
    """The parabolas are evaluated over all their durations, from the start of the job's times."""
    through = [{"joints": [120, 20, -5], "time": 1}, {"joints": [100, 12, -5], "time": 2}]
    move = {"planner": "blends", "through": through, "blend_durations": duration}
    plan = plan_job(job_from_text(json.dumps({**JOB, "moves": [move]})))
    told = explanation(plan).moves[0]
    assert told.blends is not None
    assert {(blend.index, blend.joint) for blend in told.blends} == {
        (index, name) for index in range(3) for name in ("slide", "turn", "still")
    }
    for blend in told.blends:
        joint = ("slide", "turn", "still").index(blend.joint)
        assert blend.time == pytest.approx((0, 1, 2)[blend.index])
        assert (blend.start, blend.end) == pytest.approx(
            (blend.time - duration / 2, blend.time + duration / 2)
        )
        assert blend.unit == ("mm", "deg", "deg")[joint]
        for t in np.linspace(blend.start + 1e-9, blend.end - 1e-9, 7):
            q = FACTORS[joint] * plan.trajectory(t + duration / 2)[joint]
            assert np.polyval(blend.coefficients[::-1], t - blend.time) == pytest.approx(q, abs=1e-6)


def test_knots_state_the_motion_in_the_units_of_each_joint() -> None:
    """A joint that stands has no velocity, not what rounding leaves of one."""
    plan = planned()
    told = explanation(plan, move=2).moves[0]
    assert told.knots is not None
    assert sum(knot.virtual for knot in told.knots) == 2
    span = plan.trajectory.spans[2]
    for knot in told.knots:
        states = plan.trajectory.curve.evaluate_orders(np.array([span.start + knot.time]), (0, 1, 2))[0]
        for order, stated in enumerate((knot.position, knot.velocity, knot.acceleration)):
            inner = 0 < knot.time < span.duration or order < 2
            assert not inner or stated == pytest.approx((states[order] * FACTORS).tolist(), abs=1e-6)
        assert (knot.velocity[2], knot.acceleration[2]) == (0.0, 0.0)
        assert list(knot.units) == ["mm", "deg", "deg"]
        assert list(knot.velocity_units) == ["mm/s", "deg/s", "deg/s"]
        assert list(knot.acceleration_units) == ["mm/s^2", "deg/s^2", "deg/s^2"]
