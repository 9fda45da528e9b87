"""What a plan says beside its motion: events with move, joint and value, what has no limit, and where errors are."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from planning.test_payload_capacity import HEAD
from random_jobs import loaded
from scipy.interpolate import CubicSpline

from trajcli.errors import InputError, MissingLimitError, PlanningError
from trajcli.job.read import job_from_text
from trajcli.kinematics.robot import Payload, point_mass
from trajcli.planning.plan import Plan, plan_job

TWO = {"joints": [{"name": "a"}, {"name": "slide", "type": "prismatic"}]}
SIGNAL = {"signal": "lamp", "value": 1}
UNITS = ("rad", "m")


def job_of(
    *moves: Mapping[str, Any], start: Mapping[str, Any] | None = None, **others: Any
) -> dict[str, Any]:
    """Return a job of an axis that turns and one that slides, in SI."""
    first = start or {"joints": [0, 0]}
    return {"version": 1, "robot": TWO, "start": first, "moves": list(moves), **others}


def planned(*moves: Mapping[str, Any], **others: Any) -> Plan:
    return plan_job(loaded(job_of(*moves, **others)))


def through(rows: Sequence[Sequence[float]], times: Sequence[float]) -> list[dict[str, Any]]:
    return [{"joints": list(row), "time": time} for row, time in zip(rows, times, strict=True)]


@pytest.mark.parametrize("fastest", [0, 1])
@pytest.mark.parametrize(("sign", "other"), [(1, (0, 5, 10, 12)), (-1, (0, 5, 10, 12)), (-1, (0, 0, 0, 0))])
def test_a_motion_without_rest_is_said_of_the_joint_that_is_fastest(
    fastest: int, sign: int, other: tuple[float, ...]
) -> None:
    """Between signals, which move nothing."""
    times = [0, 1, 2, 4]
    rows = np.zeros((4, 2))
    rows[:, fastest] = sign * np.array([0, -200, 100, 300.0])
    rows[:, 1 - fastest] = other
    points = through(rows[1:].tolist(), times[1:])
    plan = planned(SIGNAL, {"planner": "spline", "rule": "natural", "through": points}, SIGNAL)
    spline = CubicSpline(times, rows, bc_type="natural")
    name, unit = ("a", "slide")[fastest], UNITS[fastest]
    assert [(event.kind, event.move, event.message) for event in plan.events] == [
        (kind, 1, f"the trajectory {what} in motion, {name} with {spline(at, 1)[fastest]:.9g} {unit}/s")
        for kind, what, at in (("begins_moving", "begins", 0), ("ends_moving", "ends", 4))
    ]
    assert plan.trajectory.start.velocity == pytest.approx(spline(0, 1), rel=1e-9)
    assert plan.trajectory.end.velocity == pytest.approx(spline(4, 1), rel=1e-9)


@pytest.mark.parametrize("velocity", [(3, -40), (-40, 3), (3, 40)])
def test_a_motion_begins_before_its_first_point_by_half_a_blend(velocity: tuple[float, float]) -> None:
    """Centred on the start, which is passed with the velocity that the job says."""
    lasts = 0.2
    move = {"planner": "blends", "through": through([[5, -200], [10, 100]], [1, 2]), "blend_durations": lasts}
    plan = planned(SIGNAL, move, SIGNAL, start={"joints": [0, 0], "velocity": list(velocity)})
    joint = int(np.argmax(np.abs(velocity)))
    by = f"{('a', 'slide')[joint]} by {abs(velocity[joint]) * lasts / 2:.9g} {UNITS[joint]}"
    (event,) = plan.events
    assert (event.kind, event.move) == ("begins_before", 1)
    assert event.message == f"the trajectory begins before its first point, {by}"
    assert plan.trajectory.start.position == pytest.approx(-np.array(velocity) * lasts / 2)
    assert plan.trajectory.start.velocity == pytest.approx(velocity)


def ramped(joint: int, speed: float, ramp: float) -> dict[str, Any]:
    """Return a move of one joint with ramps of a length, s."""
    to = [0, 0]
    to[joint] = -20
    return {"planner": "trapezoid", "to": {"joints": to}, "velocity": speed, "acceleration": speed / ramp}


@pytest.mark.parametrize("joint", [0, 1])
def test_a_ramp_that_stamps_cannot_tell_is_a_step_of_its_joint(joint: int) -> None:
    """The other joint is faster, and changes its velocity by more, where stamps can tell."""
    swift = {"planner": "trapezoid", "velocity": 3e4, "acceleration": 3e4}
    there, back = ({**swift, "to": {"joints": [[0, far], [far, 0]][joint]}} for far in (6e4, 0))
    wait = {"planner": "hold", "duration": 1}
    plan = planned(wait, there, back, ramped(joint, 0.01, 3e-11), SIGNAL)
    (event,) = plan.events
    name = ("a", "slide")[joint]
    assert (event.kind, event.move) == ("velocity_step", None)
    assert f"the velocity of {name} changes by 0.01" in event.message
    assert f" {UNITS[joint]}/s in " in event.message
    assert ", at t = 7 s: " in event.message
    assert not planned(wait, there, back, ramped(joint, 0.01, 3e-9)).events


@pytest.mark.parametrize(("speed", "seen"), [(100, True), (3e4, False)])
def test_a_step_is_none_beside_what_its_joint_does_elsewhere(speed: float, seen: bool) -> None:
    fast = {"planner": "trapezoid", "velocity": speed, "acceleration": speed}
    there, back = ({**fast, "to": {"joints": [far, 0]}} for far in (2 * speed, 0))
    kinds = [event.kind for event in planned(there, back, ramped(0, 0.01, 3e-11)).events]
    assert kinds == ["velocity_step"] * seen


def test_a_trajectory_has_the_joints_and_spans_of_its_job() -> None:
    """A slide and an axis that turns, there and back twice, from 7 s on."""
    text = """
version: 1
robot: {convention: standard, joints: [{name: slide, type: prismatic, alpha: 1.5707963}, {name: a, a: 0.5}]}
limits: {velocity: 2, acceleration: 5, jerk: null}
start: {joints: [0, 0]}
points: {p: {joints: [0.4, 0.2]}, s: {joints: [0, 0]}}
moves:
  - {planner: hold, duration: 0.5}
  - repeat: 2
    moves: [{planner: trapezoid, to: p}, {planner: trapezoid, to: s}]
output: {rate: 10, start_time: 7}
"""
    plan = plan_job(job_from_text(text))
    trajectory = plan.trajectory
    assert (trajectory.joint_names, trajectory.joint_types) == (("slide", "a"), ("prismatic", "revolute"))
    assert trajectory.start_time == 7
    assert [span.ends for span in trajectory.spans] == ["", "-> p", "p -> s", "s -> p", "p -> s"]
    assert [span.round for span in trajectory.spans] == ["", *["round 1 of 2"] * 2, *["round 2 of 2"] * 2]
    assert [span.start for span in trajectory.spans[1:]] == [span.end for span in trajectory.spans[:-1]]
    assert trajectory.spans[-1].end == trajectory.duration


def test_laws_are_those_of_the_tool_on_its_path() -> None:
    """A turn in joint space, and a straight line of 100 mm."""
    turn, both = np.radians([10, 100])
    x, y = 500 * np.cos(turn) + 400 * np.cos(both) - 60, 500 * np.sin(turn) + 400 * np.sin(both) + 80
    text = f"{HEAD}start: {{joints: [0, 90]}}\nmoves:\n  - {{planner: quintic, to: {{joints: [10, 90]}}, duration: 1}}\n"
    text += f"  - {{planner: line, to: {{xyz: [{x}, {y}, 0]}}, law: {{shape: quintic, duration: 2}}}}\n"
    nothing, law = plan_job(job_from_text(text)).trajectory.laws
    assert nothing is None
    assert law is not None
    assert law.evaluate(np.array([0.0, 1.0, 2.0])).ravel() == pytest.approx([0, 0.05, 0.1], abs=1e-9)


@pytest.mark.parametrize(
    ("limits", "words"),
    [
        ({"velocity": [100, None], "position": [[-90, 90], None]}, "position of slide, velocity of slide, acceleration, jerk"),
        ({"jerk": [None, 9000], "velocity": 100, "position": [[-90, 90], [-9, 9]]}, "acceleration, jerk of a"),
        ({"velocity": 100, "position": [[-90, 90], [-9, 9]], "acceleration": 9000, "jerk": 90000}, ""),
    ],
)  # fmt: skip
def test_what_has_no_limit_names_the_joints_where_others_have_one(limits: dict[str, Any], words: str) -> None:
    assert (
        planned({"planner": "quintic", "to": {"joints": [1, 0.2]}, "duration": 1}, limits=limits).unchecked
        == words
    )


def test_what_limits_lack_is_said_once_for_all_moves_alike() -> None:
    """The states between are those that the job says, as nothing could be planned."""
    two, away, home = "jerk_limited", {"joints": [1, 1]}, {"joints": [0, 0]}
    alike = [{"planner": "trapezoid", "to": to} for to in (away, home, away)]
    slide = {"planner": "trapezoid", "to": {"joints": [1, 0]}}
    named = {"planner": two, "to": home}
    with pytest.raises(MissingLimitError) as caught:
        planned(*alike, slide, named, limits={"velocity": 3})
    found = caught.value.problems
    assert [problem.move for problem in found] == [0, 3, 4]
    more = [problem.message.partition(" (and ")[2] for problem in found]
    assert more == ["2 more moves likewise)", "", ""]
    assert "of slide " in found[1].message
    assert "of a, slide " not in found[1].message
    assert "of a to find" in found[2].message


def test_what_lacks_is_said_before_what_cannot_be_planned_behind_it() -> None:
    lacking = {"planner": "trapezoid", "to": {"joints": [1, 1]}}
    moving = {"planner": "quintic", "to": {"joints": [0, 0], "velocity": [1, 1]}, "duration": 1}
    still = {"planner": "trapezoid", "to": {"joints": [2, 0]}, "duration": 1e-3}
    with pytest.raises(MissingLimitError) as caught:
        planned(lacking, moving, still, lacking, limits={"velocity": 3})
    assert [problem.move for problem in caught.value.problems] == [0]


@pytest.mark.parametrize("rule", ["natural", "clamped"])
@pytest.mark.parametrize("joint", [0, 1])
def test_an_acceleration_at_the_start_is_taken_up_by_each_joint_or_refused(rule: str, joint: int) -> None:
    """A natural spline has none at its ends; a clamped one that of the first piece is whatever it is."""
    acceleration = [0.0, 0.0]
    acceleration[joint] = 5.0
    start = {"joints": [0, 0], "velocity": [0, 0], "acceleration": acceleration}
    move = {"planner": "spline", "rule": rule, "through": through([[1, 1], [2, 1]], [1, 2])}
    with pytest.raises(InputError, match="spline cannot start with an acceleration") as caught:
        planned(SIGNAL, move, start=start)
    (problem,) = caught.value.problems
    assert problem.place is not None
    text = json.dumps(job_of(SIGNAL, move, start=start))
    assert text[problem.place.column - 1 :].startswith('{"joints": [0, 0], "velocity"')
    quintic = {"planner": "quintic", "to": {"joints": [1, 1]}, "duration": 1}
    assert planned(SIGNAL, quintic, start=start).trajectory(0.0, 2) == pytest.approx(acceleration)


def test_how_a_pose_is_reached_is_said_of_each_round() -> None:
    """A round begins where the one before it ends, so that its motion is known."""
    away = {"planner": "quintic", "to": {"xyz": [0.4, 0.1, 0.25], "rpy": [np.pi, 0, 0]}, "duration": 4}
    home = {"joints": [0, -1.5, 1.5, 0, 1.5, 0]}
    rounds = {"repeat": 3, "moves": [away, {"planner": "quintic", "to": home, "duration": 4}]}
    plan = planned(rounds, robot="ur5e", start=home)
    assert set(plan.poses) == {0, 2, 4}
    assert plan.poses[2] is plan.poses[4]


def test_an_error_says_its_move_and_its_time_in_the_job() -> None:
    """An arm that stands up on its other side: gravity takes most where it lies, in the middle of a cubic."""
    moves = "moves:\n  - {planner: hold, duration: 1.5}\n  - {planner: hold, duration: 0.5}\n"
    moves += "  - {planner: cubic, to: {joints: [-90, 0]}, duration: 4}\n"
    text = f"{HEAD}limits: {{effort: {{a: 20, b: 20}}}}\nstart: {{joints: [90, 0]}}\n{moves}"
    with pytest.raises(PlanningError) as caught:
        plan_job(job_from_text(text))
    (problem,) = caught.value.problems
    assert (problem.move, problem.joint, problem.limit) == (2, "a", pytest.approx(20))
    assert problem.message.startswith("move 2 (cubic): ")
    assert problem.value == pytest.approx(9.81 * (4 * 0.25 + 2 * 0.7))
    assert problem.time == pytest.approx(1.5 + 0.5 + 2, abs=1e-6)
    assert problem.place is not None
    assert (
        problem.place.line
        == text.splitlines().index("  - {planner: cubic, to: {joints: [-90, 0]}, duration: 4}") + 1
    )


def test_events_of_a_move_behind_another_say_which() -> None:
    around = [{"joints": point} for point in ([1, 1], [1, 1], [2, 0])]
    course = {
        "planner": "time_optimal",
        "through": around,
        "to": {"joints": [0, 0]},
        "when_over_limit": "slow",
    }
    plan = planned({"planner": "hold", "duration": 1}, course, limits={"velocity": 2, "acceleration": 4})
    found = (*plan.events, *plan.remarks)
    assert {event.kind for event in plan.events} == {"merged"}, "a concession"
    assert "bound" in {event.kind for event in plan.remarks}
    assert {event.move for event in found} == {1}


@pytest.mark.parametrize("swinging", [0, 1])
def test_a_remark_names_the_joint_that_leaves_its_chords(swinging: int) -> None:
    """Both have the same limits, so that the nearest point of a chord is that of Euclid."""
    points = np.array([[0, 0], [0.1, 0.1], [0.2, 0.2]])
    points[1, swinging] = 1.0
    _, middle, last = ({"joints": point} for point in points.tolist())
    move = {"planner": "waypoints", "through": [middle], "to": last}
    limits = {"velocity": 2, "acceleration": 4, "jerk": 40}
    plan = planned({"planner": "hold", "duration": 1}, move, limits=limits)
    rows = plan.trajectory(np.linspace(1, plan.trajectory.duration, 4001))
    beside = []
    for begin, end in pairwise(points):
        along = np.clip((rows - begin) @ (end - begin) / np.sum((end - begin) ** 2), 0, 1)
        beside.append(rows - begin - along[:, None] * (end - begin))
    nearest = np.linalg.norm(beside, axis=2).argmin(axis=0)
    off = np.abs(np.where(nearest[:, None] == 0, *beside)).max(axis=0)
    joint = int(off.argmax())
    (remark,) = plan.remarks
    assert (remark.kind, remark.move) == ("fastest_found", 1)
    said = remark.message.partition("leaves the chords by up to ")[2].split()
    assert said[1:3] == [UNITS[joint], f"({('a', 'slide')[joint]}"]
    assert float(said[0]) == pytest.approx(off[joint], rel=1e-4)


@pytest.mark.parametrize("masses", [(2, 200), (200, 2)])
def test_of_several_payloads_that_nobody_judges_the_heaviest_is_said(masses: tuple[int, int]) -> None:
    moves = "".join(
        f"  - {{attach: {{mass: {mass}}}}}\n  - {{planner: hold, duration: 1}}\n  - {{detach: {{}}}}\n"
        for mass in masses
    )
    plan = plan_job(job_from_text(f"{HEAD}start: {{joints: [0, 0]}}\nmoves:\n{moves}"))
    assert plan.unchecked.endswith("effort with 200 kg carried")


def test_numbers_of_findings_keep_their_unit_when_they_are_said() -> None:
    """In words they have the job's units, in fields those of SI."""
    limits = {"velocity": [[-10, 10], [-1000, 1000]]}
    move = {"planner": "cubic", "to": {"joints": [90, 900]}, "duration": 1}
    plan = planned(move, limits=limits, units={"angle": "deg", "length": "mm"})
    found = {finding.joint: finding for finding in plan.verdict.findings}
    assert {joint: finding.si_unit for joint, finding in found.items()} == {"a": "rad/s", "slide": "m/s"}
    assert found["a"].value == pytest.approx(np.radians(1.5 * 90))
    assert found["slide"].value == pytest.approx(1.5 * 0.9)
    assert "reaches 135 deg/s at t = 0.5 s, its limit is 10 deg/s" in found["a"].message
    assert "reaches 1350 mm/s at t = 0.5 s, its limit is 1000 mm/s" in found["slide"].message


def test_what_is_carried_instead_is_asked_for_each_move_with_what_the_job_says() -> None:
    """Three rounds of one motion: each has the mass that is carried in it, and limits of its own move."""
    hold = "    - {planner: hold, duration: 1, limits: {velocity: 50}}\n    - {planner: hold, duration: 1}\n"
    text = f"{HEAD}start: {{joints: [0, 0]}}\nmoves:\n  - {{attach: {{mass: 2}}}}\n  - repeat: 3\n    moves:\n{hold}"
    asked = []

    def carried(index: int, payload: Payload | None) -> Payload | None:
        asked.append((index, None if payload is None else payload.mass))
        return point_mass(10.0 + index)

    plan = plan_job(job_from_text(text), carried)
    assert asked == [(index, 2) for index in range(7)]
    carrying = [move.robot.payload for move in plan.moves[1:]]
    assert [None if payload is None else payload.mass for payload in carrying] == [11, 12, 13, 14, 15, 16]
    fastest = [np.degrees(move.robot.limits.velocity[0, 1]) for move in plan.moves[1:]]
    assert fastest == pytest.approx([50, 100] * 3)


def test_a_limit_that_a_later_move_loosens_is_named_where_it_stands() -> None:
    moves = [
        {"planner": "hold", "duration": 1},
        {"planner": "hold", "duration": 1, "limits": {"velocity": 9}},
    ]
    with pytest.raises(InputError) as caught:
        planned(*moves, limits={"velocity": 3})
    (problem, *_) = caught.value.problems
    assert problem.place is not None
    text = json.dumps(job_of(*moves, limits={"velocity": 3}))
    assert problem.move == 1
    assert text.index('"velocity": 9') - 20 < problem.place.column <= text.index('"velocity": 9') + 15


def test_an_arm_that_stands_does_not_begin_with_an_acceleration() -> None:
    """Not even with a small one; one that a move takes up is no flaw."""
    for acceleration in (5.0, 1e-4):
        start = {"joints": [0, 0], "acceleration": [0, acceleration]}
        with pytest.raises(InputError, match="hold cannot start with an acceleration"):
            planned({"planner": "hold", "duration": 1}, start=start)
        quintic = {"planner": "quintic", "to": {"joints": [1, 1]}, "duration": 2}
        taken = planned(quintic, start=start).trajectory.start.acceleration
        assert taken.tolist() == [0, acceleration]


ARM = {"version": 1, "robot": "ur5e", "start": {"joints": [0, -1.5, 1.5, 0, 1.5, 0]}}
FAR = {"planner": "line", "to": {"xyz": [9, 9, 9]}}


def test_what_limits_lack_is_said_before_what_no_arm_reaches() -> None:
    with pytest.raises(MissingLimitError) as caught:
        plan_job(loaded({**ARM, "moves": [FAR, FAR]}))
    assert [problem.move for problem in caught.value.problems] == [0]


def test_a_start_that_no_arm_reaches_is_told_where_it_stands() -> None:
    text = "version: 1\nrobot: ur5e\nstart: {xyz: [9, 9, 9]}\nmoves: [{planner: hold, duration: 1}]\n"
    with pytest.raises(PlanningError, match="cannot reach the pose") as caught:
        plan_job(job_from_text(text))
    assert str(caught.value.problems[0].place).endswith(":3:8")


def test_a_pose_is_said_to_be_reached_where_the_last_point_of_a_move_is_one() -> None:
    """Poses on the way there are none that the move goes to; the start's branch is the one that is nearest to zero."""
    joints = {"joints": [0, -1.5, 1.5, 0, 1.5, 0], "time": 2}
    pose = {"xyz": [0.5, 0.15, 0.5], "rpy": [3, 0, 1], "configuration": {"elbow": "up"}, "time": 1}
    first, last = {**pose, "time": 1}, {**pose, "time": 2}
    spline = {"planner": "spline"}
    ends = plan_job(loaded({**ARM, "moves": [{**spline, "through": [first], "to": joints}]}))
    poses = plan_job(loaded({**ARM, "moves": [{**spline, "through": [{**joints, "time": 1}], "to": last}]}))
    assert (0 in ends.poses, 0 in poses.poses) == (False, True)
    begun = {key: pose[key] for key in ("xyz", "rpy")}
    starts = plan_job(loaded({**ARM, "start": begun, "moves": [{"planner": "hold", "duration": 1}]}))
    assert starts.poses[None].near.tolist() == [0] * 6
