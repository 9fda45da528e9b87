"""What a move says of itself: events, certificates, durations that it may be given, where it ends, and its span."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from trajcli.curves.piecewise import constant
from trajcli.errors import Amount, PlanningError
from trajcli.job.read import job_from_text
from trajcli.kinematics.robot import Payload
from trajcli.planners.planner import Certificate, Event, Planned, PlannedMove, Planner, stretched
from trajcli.trajectory import MoveInterval, State, resting

JOB = """
version: 1
robot: {{convention: standard, joints: [{{name: one, a: 0.5}}, {{name: two, a: 0.5}}]}}
limits: {{velocity: 1, acceleration: 1, jerk: null}}
start: {{joints: 0}}
moves: [{move}, {{planner: hold, duration: 1}}]
"""
TO = "to: {joints: [0.3, 0.6]}"


def planner(move: str) -> Planner:
    """Return a move as a job has it."""
    return job_from_text(JOB.format(move=move)).job.moves[0]


def moved(move: str, planned: Planned | None = None, **fields: Any) -> PlannedMove:
    """Return a move that is planned, or said to be, from where the arm stands."""
    made = planner(move)
    start = resting(np.zeros(2))
    robot = job_from_text(JOB.format(move=move)).robot
    return PlannedMove(
        4, made, fields.pop("start", start), robot, planned or made.plan(start, robot), **fields
    )


MOVING = State(np.zeros(2), np.array([0.0, 0.2]), np.zeros(2))


@pytest.mark.parametrize(
    ("kind", "concedes", "internal"),
    [
        ("refined", False, True),
        ("bound", False, True),
        ("fastest_found", False, False),
        ("zone_stops", False, False),
        ("branch_taken", False, False),
        ("weave_fitted", False, False),
        ("own_tool_replaced", False, False),
        ("stretched", True, False),
        ("slowed", True, False),
        ("shrunk", True, False),
    ],
)
def test_a_remark_concedes_nothing(kind: str, concedes: bool, internal: bool) -> None:
    event = Event(kind, "")
    assert (event.concedes, event.is_internal) == (concedes, internal)


def test_amounts_of_an_event_are_said_as_they_are_asked_for() -> None:
    event = Event("slowed", "by {part}", amounts={"part": Amount(0.25)})
    assert event.text(lambda amount: f"<{amount.value}>") == "by <0.25>"
    assert stretched(1.0025).message.startswith("stretched 1.0025 times")


def certificate(**fields: Any) -> Certificate:
    given: dict[str, Any] = {
        "lower": 2.0,
        "joint": None,
        "found": (2.5, 2.6, 3.0, np.inf),
        "agreeing": 1,
        "stopping": 4.0,
        "off_chords": np.array([0.1, 0.4, 0.2]),
        "off_times": np.array([0.5, 1.5, 1.0]),
    }
    return Certificate(**(given | fields))


@pytest.mark.parametrize(
    ("duration", "above"),
    [
        (2.0, "0"),
        (2.0 * (1 + 1e-9), "0"),  # by rounding
        (2.0 * (1 - 1e-3), "0"),
        (2.0 * 1.00001, "0.01"),
        (2.5, "25"),
        (2.0 * 1.12341, "12.35"),
        (2.0 * 1.12349, "12.35"),
    ],
)
def test_what_is_above_a_bound_is_rounded_up(duration: float, above: str) -> None:
    text = certificate().remark(duration, ["a", "b", "c"]).message
    assert text.startswith(f"at most {above} % above the fastest possible, {{lower}}; 1 of 4 starting points")


def test_a_certificate_says_which_joint_leaves_the_chords_and_when() -> None:
    event = certificate().remark(2.5, ["a", "b", "c"])
    assert "stopping at each point takes {stopping}" in event.message
    assert event.message.endswith("it leaves the chords by up to {off} ({joint} at {time})")
    said = {name: getattr(each, "value", each) for name, each in event.amounts.items()}
    assert said == {"lower": 2.0, "stopping": 4.0, "off": 0.4, "joint": "b", "time": 1.5}
    off, lower = event.amounts["off"], event.amounts["lower"]
    assert isinstance(off, Amount)
    assert isinstance(lower, Amount)
    assert (off.order, off.joint, lower.rounded) == (0, 1, "down")
    later = certificate().scaled(3.0)
    assert later.off_times.tolist() == [1.5, 4.5, 3.0]
    assert later.off_chords.tolist() == [0.1, 0.4, 0.2]


def test_a_certificate_of_little_says_no_more() -> None:
    alone = certificate(lower=0.0, stopping=np.inf).remark(2.5, ["a", "b", "c"]).message
    assert alone.startswith(
        "nothing is known of the fastest possible; 1 of 4 starting points agree; it leaves"
    )
    straight = certificate(polyline=True).remark(2.5, ["a", "b", "c"]).message
    assert "25 % above the fastest possible along the polyline, " in straight


@pytest.mark.parametrize(
    ("move", "finds"),
    [
        (f"{{planner: trapezoid, {TO}}}", True),
        (f"{{planner: trapezoid, {TO}, minimum_duration: 2}}", True),
        (f"{{planner: trapezoid, {TO}, duration: 2}}", False),
        (f"{{planner: trapezoid, {TO}, velocity: 0.5}}", False),
        (f"{{planner: trapezoid, {TO}, acceleration: 0.5}}", False),
        (f"{{planner: trapezoid, {TO}, deceleration: 0.5}}", False),
        ("{planner: spline, through: [{joints: 0.1, time: 1}, {joints: 0.2, time: 2}]}", False),
        ("{planner: spline, through: [{joints: 0.1}, {joints: 0.2}]}", True),
    ],
)
def test_a_duration_is_found_where_no_times_and_no_rates_are_given(move: str, finds: bool) -> None:
    assert planner(move).finds_duration == finds


def lengths(given: Planner) -> tuple[float | None, float | None]:
    return getattr(given, "duration", None), getattr(given, "minimum_duration", None)


@pytest.mark.parametrize(
    ("fields", "after"),
    [
        ("", (None, 7.0)),
        (", minimum_duration: 2", (None, 7.0)),
        (", duration: 2", (7.0, None)),
    ],
)
def test_a_duration_takes_the_place_of_the_one_that_is_given(fields: str, after: Any) -> None:
    assert lengths(planner(f"{{planner: trapezoid, {TO}{fields}}}").with_duration(7.0)) == after


def test_a_move_that_has_but_one_duration_is_given_that() -> None:
    assert lengths(planner(f"{{planner: jerk_limited, {TO}}}").with_duration(7.0)) == (None, 7.0)
    assert lengths(planner(f"{{planner: cubic, {TO}}}").with_duration(7.0)) == (7.0, None)
    with pytest.raises(PlanningError, match="line cannot last longer than it does"):
        planner("{planner: line, to: {xyz: [1, 0, 0]}}").with_duration(7.0)


def test_a_given_duration_is_taken_out() -> None:
    found = planner(f"{{planner: cubic, {TO}, duration: 2}}").without_duration()
    assert found is not None
    assert (found[0], lengths(found[1])) == (2.0, (None, None))
    assert planner(f"{{planner: cubic, {TO}}}").without_duration() is None


@pytest.mark.parametrize(
    ("move", "fields"),
    [
        (f"{{planner: trapezoid, {TO}}}", ["duration", "minimum_duration"]),
        (f"{{planner: trapezoid, {TO}, duration: 1}}", ["duration"]),
        (f"{{planner: cubic, {TO}}}", ["duration"]),
        (f"{{planner: jerk_limited, {TO}}}", ["minimum_duration"]),
    ],
)
def test_what_makes_a_move_last_so_long_is_a_job_that_does(move: str, fields: list[str]) -> None:
    proposed = dict(planner(move).lasting(7.25))
    assert list(proposed) == [f"`{field}: 7.25`" for field in fields]
    robot = job_from_text(JOB.format(move=move)).robot
    for words, longer in proposed.items():
        assert longer.plan(resting(np.zeros(2)), robot).curve.duration == pytest.approx(7.25), words


def test_a_destination_is_what_the_job_says() -> None:
    line = planner("{planner: line, to: {xyz: [0.5, 0.1, 0]}, tolerance: {position: 1e-4, angle: 2e-3}}")
    ends = line.destination
    assert ends is not None
    assert (ends.joints, ends.tolerance, dict(ends.pins)) == (None, (1e-4, 2e-3), {})
    assert ends.pose is not None
    assert ends.pose.poses[..., :3, 3].tolist() in ([0.5, 0.1, 0.0], [[0.5, 0.1, 0.0]])
    by_joints = planner("{planner: line, to: {joints: [0.1, 0.2]}, tolerance: {position: 1e-4, angle: 2e-3}}")
    there = by_joints.destination
    assert there is not None
    assert there.joints is not None
    assert (there.joints.tolist(), there.tolerance) == ([0.1, 0.2], (1e-4, 2e-3))
    pinned = planner("{planner: line, to: {xyz: [0.5, 0.1, 0], joints: {two: 0.7}}}").destination
    assert pinned is not None
    assert dict(pinned.pins) == {1: 0.7}
    assert planner("{planner: jerk_limited, to: {velocity: 0}}").destination is None
    assert planner("{planner: hold, duration: 1}").destination is None


def test_a_label_is_its_caption() -> None:
    assert planner("{planner: hold, duration: 1, label: cool down}").caption == "cool down"
    assert planner("{planner: hold, duration: 1}").caption == ""
    assert planner("{planner: hold, duration: 1}").why_not_flown_by == "hold stops at its ends"


@pytest.mark.parametrize(("promised", "continuity"), [(None, 2), (1, 1)])
def test_the_continuity_is_the_curves_where_that_is_less(promised: Any, continuity: int) -> None:
    planned = Planned(constant(np.zeros(2), 1.0), resting(np.zeros(2)), continuity=promised)
    made = moved("{planner: line, to: {xyz: [0.5, 0, 0]}, law: {shape: quintic}}", planned)
    assert made.continuity == continuity
    assert made.span(0.0, 1.0).continuity == continuity


@pytest.mark.parametrize(("start", "end", "rests"), [(0, 0, True), (1, 0, False), (0, 1, False)])
def test_a_move_is_at_rest_at_both_ends(start: int, end: int, rests: bool) -> None:
    states = resting(np.zeros(2)), MOVING
    planned = Planned(constant(np.zeros(2), 1.0), states[end])
    assert moved("{planner: hold, duration: 1}", planned, start=states[start]).at_rest == rests


@pytest.mark.parametrize("begins", [None, MOVING])
@pytest.mark.parametrize("start", [resting(np.zeros(2)), MOVING])
def test_ends_are_promised_but_where_velocities_follow_from_times(begins: State | None, start: State) -> None:
    planned = Planned(constant(np.zeros(2), 1.0), MOVING, begins=begins)
    ends = moved(f"{{planner: cubic, {TO}, duration: 1}}", planned, start=start).promise.ends
    assert (ends is None) == (begins is MOVING and start is not MOVING)
    if ends is not None:
        assert ends[0] is start
        assert ends[1] is MOVING


def test_a_move_promises_what_it_says_of_itself() -> None:
    plain = moved(f"{{planner: cubic, {TO}, duration: 1}}")
    robot, around = plain.robot, object()
    for parts, says in [
        ((), True),
        ((MoveInterval(0.0, 1.0, robot),), True),
        ((MoveInterval(0.0, 0.5, robot, around=around), MoveInterval(0.5, 1.0, robot)), True),  # type: ignore[arg-type]
        ((MoveInterval(0.0, 0.5, robot), MoveInterval(0.5, 1.0, robot, around=around)), False),  # type: ignore[arg-type]
    ]:
        planned = replace(plain.planned, parts=parts, remedies={"jerk": "wait"}, braking="line")
        promise = replace(plain, planned=planned, over_limit="slow").promise
        assert (promise.destination is not None) == says
        assert (promise.remedies, promise.braking, promise.parts) == ({"jerk": "wait"}, "line", parts)
        assert (promise.over_limit, promise.robot) == ("slow", robot)


def test_a_span_is_of_its_move() -> None:
    payload = Payload(2.0, np.zeros(3), np.eye(3))
    made = moved(f"{{planner: cubic, {TO}, duration: 1.5, label: over}}")
    made = replace(made, robot=replace(made.robot, payload=payload))
    span = made.span(2.0, 3.5, "slot 3 of 18", "pick -> place")
    assert (span.index, span.planner, span.start, span.end) == (4, "cubic", 2.0, 3.5)
    assert (span.label, span.round, span.ends, span.handles) == (
        "over",
        "slot 3 of 18",
        "pick -> place",
        False,
    )
    assert span.payload is payload
    alone = made.alone()
    assert (alone.joint_names, alone.spans[0].start, alone.spans[0].end) == (("one", "two"), 0.0, 1.5)
    assert alone.start.position.tolist() == [0.0, 0.0]
    assert alone.end.position.tolist() == [0.3, 0.6]
    nothing = Planned(constant(np.zeros(2), 0.0), resting(np.zeros(2)))
    assert moved("{attach: {mass: 1}}", nothing).span(0, 0).handles
