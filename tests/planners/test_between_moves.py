"""What stands between moves, and what moves from state to state refuse: by their words, places and states."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from trajcli.errors import PlanningError, TrajcliError
from trajcli.job.read import job_from_text
from trajcli.planning.plan import Plan, plan_job

ARM = {"convention": "standard", "joints": [{"name": "one", "a": 0.5}, {"name": "two", "a": 0.5}]}
MOVE = {"planner": "quintic", "to": {"joints": [0.3, 0.6]}, "duration": 2}
FAST = {"planner": "quintic", "to": {"joints": [0.3, 0.6], "velocity": [0.1, -0.2]}, "duration": 2}
STOP = {"planner": "quintic", "to": {"joints": 0}, "duration": 2}
LOAD = {"attach": {"mass": 2.5}}
BETWEEN = [LOAD, {"tool": {"xyz": [0, 0, 0.1]}}, {"signal": "lamp", "value": 1}]


def planned(*moves: dict[str, Any], robot: Any = ARM, **fields: Any) -> Plan:
    job = {"version": 1, "robot": robot, "start": {"joints": 0}, "moves": list(moves)}
    limits = {"velocity": 3, "acceleration": 10, "jerk": None}
    return plan_job(job_from_text(json.dumps({**job, "limits": limits, **fields})))


def refused(*moves: dict[str, Any], **fields: Any) -> str:
    """Return text and advice of the only problem."""
    with pytest.raises(TrajcliError) as caught:
        planned(*moves, **fields)
    (problem,) = caught.value.problems
    return f"{problem.text()} | {problem.advice()}"


@pytest.mark.parametrize("entry", BETWEEN, ids=lambda entry: next(iter(entry)))
@pytest.mark.parametrize(
    "field",
    [
        {"limits": {"velocity": 1}},
        {"when_over_limit": "slow"},
        {"zone": 0.1},
        {"at": {"signal": "x", "value": 1}},
    ],
    ids=lambda field: next(iter(field)),
)
def test_what_says_how_to_move_stands_beside_a_planner_only(entry: Any, field: Any) -> None:
    assert next(iter(field)) in refused(MOVE, {**entry, **field}, STOP)
    assert planned(MOVE, {**entry, "label": "here"}, STOP).verdict.passed


@pytest.mark.parametrize("entry", [LOAD, BETWEEN[2]], ids=["attach", "signal"])
def test_an_entry_in_motion_changes_nothing_of_the_motion(entry: Any) -> None:
    made, without = planned(FAST, entry, STOP), planned(FAST, STOP)
    assert made.verdict.passed
    times = np.array([1.0, 2.0, 3.0])
    for order in range(3):
        values = [plan.trajectory.curve.evaluate(times, order) for plan in (made, without)]
        np.testing.assert_array_equal(*values)
    np.testing.assert_allclose(made.trajectory.curve.evaluate(times, 1)[1], [0.1, -0.2])
    assert made.moves[1].planned.end.velocity.tolist() == [0.1, -0.2]
    assert made.trajectory.spans[1].handles
    assert [span.handles for span in made.trajectory.spans] == [False, True, False]


def test_an_acceleration_goes_on_across_an_entry() -> None:
    bent = {**MOVE, "to": {**MOVE["to"], "velocity": 0.1, "acceleration": [0.4, -0.3]}}  # type: ignore[dict-item]
    made = planned(bent, LOAD, STOP)
    assert made.moves[2].start.acceleration.tolist() == [0.4, -0.3]


def test_a_payload_is_carried_from_where_it_is_attached_to_where_it_is_left() -> None:
    made = planned(MOVE, LOAD, STOP, {"detach": {}}, MOVE)
    masses = [None if move.robot.payload is None else move.robot.payload.mass for move in made.moves]
    assert masses == [None, 2.5, 2.5, None, None]


def test_a_second_payload_and_one_that_is_not_there_are_refused_with_what_helps() -> None:
    twice = refused(LOAD, MOVE, LOAD, STOP)
    assert "the tool carries 2.5 kg already" in twice
    assert "write `- {detach: {}}` before it" in twice
    assert planned(LOAD, MOVE, {"detach": {}}, LOAD, STOP).verdict.passed
    nothing = refused(LOAD, MOVE, {"detach": {}}, {"detach": {}}, STOP)
    assert "nothing is attached here that could be detached" in nothing
    assert "attach a payload in a move before it" in nothing


def test_an_arm_of_bare_joints_carries_nothing_and_has_no_tool_but_signals() -> None:
    assert "a payload needs a robot with geometry" in refused(MOVE, LOAD, STOP, robot={"joints": 2})
    assert "a tool change needs a robot with geometry" in refused(MOVE, BETWEEN[1], STOP, robot={"joints": 2})
    assert planned(MOVE, BETWEEN[2], STOP, robot={"joints": 2}).verdict.passed


@pytest.mark.parametrize("joint", [0, 1])
def test_the_joint_that_moves_fastest_where_a_tool_is_changed_is_named(joint: int) -> None:
    velocity = [[-0.2, 0.1], [0.0, -0.2]][joint]
    moving = {**FAST, "to": {"joints": [0.3, 0.6], "velocity": velocity}}
    with pytest.raises(TrajcliError) as caught:
        planned(moving, BETWEEN[1], STOP)
    (problem,) = caught.value.problems
    name = ("one", "two")[joint]
    assert f"and {name} moves with -0.2 rad/s" in problem.message
    assert problem.joint == name
    assert "leave `velocity` out" in (problem.hint or "")
    assert planned(MOVE, BETWEEN[1], STOP).verdict.passed


def test_a_tool_change_is_called_by_its_label_or_the_name_of_the_tool() -> None:
    tools = {"tools": {"long": {"xyz": [0, 0, 0.3]}}}
    captions = [
        planned(MOVE, {"tool": "long", **label}, STOP, **tools).moves[1].planner.caption
        for label in ({}, {"label": "take the long one"})
    ]
    assert captions == ["long", "take the long one"]
    made = planned(MOVE, {"tool": "long"}, STOP, **tools)
    assert [move.robot.tool[2, 3] for move in made.moves] == [0, 0.3, 0.3]
    assert [move.planner.changes_tool for move in made.moves] == [False, True, False]


@pytest.mark.parametrize(
    ("tag", "velocity", "acceleration"),
    [
        ("cycloidal", False, False),
        ("cubic", True, False),
        ("trapezoid", True, False),
        ("quintic", True, True),
    ],
)
@pytest.mark.parametrize("values", [[0.0, 0.1], [0.1, 0.1], [0.0, 0.0]])
def test_what_a_planner_does_not_impose_at_its_end_is_refused_at_its_field(
    tag: str, velocity: bool, acceleration: bool, values: list[float]
) -> None:
    for name, imposed in (("velocity", velocity), ("acceleration", acceleration)):
        move = {"planner": tag, "to": {"joints": [0.3, 0.3], name: values}, "duration": 2}
        if not any(values) or (imposed and tag != "trapezoid"):
            assert planned(move).moves[0].planned.end.position.tolist() == [0.3, 0.3]
            continue
        if imposed:  # along its line
            along = {**move, "to": {"joints": [0.3, 0.3], name: 0.1}}
            assert planned(along).moves[0].planned.end.velocity.tolist() == [0.1, 0.1]
            continue
        with pytest.raises(TrajcliError) as caught:
            planned(move)
        (problem,) = caught.value.problems
        assert f"{tag} does not impose the {name} at its end" in problem.message
        place = problem.place
        assert place is not None
        assert place.source[place.column - 1 :].startswith("[")
        for other in ("quintic", "jerk_limited"):
            assert other in (problem.hint or "")
            limits = {"velocity": 3, "acceleration": 10, "jerk": 50}
            asked = {key: value for key, value in move.items() if key != "duration"}
            assert planned({**asked, "planner": other}, limits=limits).moves[0].duration > 0


@pytest.mark.parametrize("tag", ["cubic", "quintic", "trapezoid", "cycloidal"])
def test_a_target_without_a_position_is_for_a_planner_that_stops_anywhere(tag: str) -> None:
    text = refused({"planner": tag, "to": {"velocity": 0}, "duration": 1})
    assert f"{tag} needs `joints` or a pose in its target" in text
    assert "jerk_limited can stop anywhere" in text
    limits = {"velocity": 3, "acceleration": 10, "jerk": 50}
    assert (
        planned(FAST, {"planner": "jerk_limited", "to": {"velocity": 0}}, limits=limits).moves[1].duration > 0
    )


def test_an_arm_that_moves_is_not_held() -> None:
    hold = {"planner": "hold", "duration": 1.5}
    moving = {**MOVE, "to": {"joints": [0.3, 0.6], "velocity": [0.0, 0.1]}}
    assert "hold starts at rest, but the velocity of two is 0.1 rad/s" in refused(moving, hold)
    made = planned(MOVE, hold)
    assert made.moves[1].duration == 1.5
    assert made.trajectory.curve.evaluate(np.array([2.0, 2.7, 3.5])).tolist() == [[0.3, 0.6]] * 3


def test_a_hold_begins_without_acceleration() -> None:
    """What the move before it ends with is not its own: it joins positions and velocities."""
    bent = {**MOVE, "to": {"joints": [0.3, 0.6], "acceleration": [0.0, 0.1]}}
    made = planned(bent, {"planner": "hold", "duration": 1.5})
    assert made.moves[0].planned.end.acceleration.tolist() == [0.0, 0.1]
    assert made.moves[1].start.at_rest
    assert made.verdict.passed
    move, start = made.moves[1], made.moves[0].planned.end
    with pytest.raises(PlanningError, match="hold starts at rest, but the acceleration of"):
        move.planner.plan(start, move.robot)


def test_a_move_to_a_pose_starts_from_where_the_arm_stands() -> None:
    """Of the two ways in which two links reach a place the nearer one is taken."""
    for sign in (1.0, -1.0):
        before = {**MOVE, "to": {"joints": [0.3, sign * 0.8]}}
        made = planned(before, {"planner": "quintic", "to": {"xyz": [0.7, 0.1, 0]}, "duration": 2})
        assert np.sign(made.moves[1].planned.end.position[1]) == sign


def test_a_step_in_acceleration_is_taken_out_by_the_planners_that_are_named() -> None:
    limits = {"velocity": 3, "acceleration": 10, "jerk": 100}
    cubic = {"planner": "cubic", "to": {"joints": [0.3, 0.6]}, "duration": 2}
    hint = next(f.hint for f in planned(cubic, limits=limits).verdict.findings) or ""
    assert "use jerk_limited or quintic" in hint
    for tag in ("jerk_limited", "quintic"):
        move = {key: value for key, value in cubic.items() if key != "duration"}
        assert planned({**move, "planner": tag}, limits=limits).verdict.passed
