"""Reports of the tool along its path, against geometry by hand, and of what a plan as a whole concedes."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from trajcli.job.read import job_from_text
from trajcli.job.report import MoveReport, Report, ToolReport
from trajcli.kinematics.forward import forward
from trajcli.knots import knots_of
from trajcli.output.report import concession_error, report_of, verification_error
from trajcli.planners.planner import Certificate, Event
from trajcli.planning.plan import Plan, plan_job

HOLD = {"planner": "hold", "duration": 1.5}


@cache
def _planned(text: str) -> tuple[Plan, Report]:
    plan = plan_job(job_from_text(text))
    return plan, report_of(plan)


def planned(*moves: Any, **fields: Any) -> tuple[Plan, Report]:
    """Return the plan of a tool that looks down, and its report; lengths are in m."""
    start = {"xyz": [0.4, -0.4, 0.3], "rpy": [180, 0, 0], "configuration": {"elbow": "up"}}
    job = {"version": 1, "units": {"angle": "deg", "length": "m"}, "robot": "ur5e", "start": start}
    return _planned(json.dumps({**job, "limits": {"acceleration": 800}, "moves": list(moves), **fields}))


def tool_of(move: MoveReport) -> ToolReport:
    assert move.tool is not None
    return move.tool


def speeds_of(plan: Plan, move: MoveReport) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return times of a move, how far the tool has gone, and its speed there, by differences."""
    t = np.linspace(move.start, move.end, 4001)
    places = forward(plan.loaded.robot, plan.trajectory.curve.evaluate(t))[:, :3, 3]
    gone = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(places, axis=0), axis=1))])
    return t, gone, np.gradient(gone, t)


@pytest.mark.full
def test_where_a_joint_does_not_let_the_tool_hold_its_speed_is_told() -> None:
    """A line passes the base: the first joint turns fastest where it is nearest, and is the one that binds."""
    line = {"planner": "line", "to": {"xyz": [0.4, 0.4, 0.3]}, "law": {"shape": "time_optimal", "speed": 0.2}}
    limits = {"acceleration": 800, "velocity": {"shoulder_pan_joint": 22}}
    plan, report = planned(HOLD, line, limits=limits)
    move = report.moves[1]
    t, gone, rates = speeds_of(plan, move)
    between = (t > move.start + 0.2) & (t < move.end - 0.2)
    slowest = np.flatnonzero(between)[rates[between].argmin()]
    lowest = tool_of(move).lowest
    assert lowest is not None
    assert (lowest.joint, lowest.unit, lowest.place_unit) == ("shoulder_pan_joint", "m/s", "m")
    assert lowest.speed == pytest.approx(rates[slowest], rel=2e-3)
    assert lowest.place == pytest.approx(gone[slowest], abs=0.02)
    assert 0.1 < lowest.speed < 0.19
    assert 0.0 < float(tool_of(move).held or 0.0) < 0.9


def test_a_tool_that_turns_in_its_place_goes_along_an_angle() -> None:
    """40 degrees about its own axis; the place of the tool does not move."""
    turn = {"planner": "line", "to": {"xyz": [0.4, -0.4, 0.3], "rpy": [180, 0, 40]}}
    limits = {"acceleration": 800, "tcp": {"angular_speed": 30, "angular_acceleration": 180}}
    _, report = planned(HOLD, turn, limits=limits)
    tool = tool_of(report.moves[1])
    assert (tool.unit, tool.speed_unit) == ("rad", "rad/s")
    assert tool.length == pytest.approx(np.radians(40))
    peaks = {peak.quantity: peak for peak in tool.peaks}
    assert {name for name, peak in peaks.items() if peak.negligible} == {"speed", "acceleration"}
    assert peaks["angular_speed"].value == pytest.approx(np.radians(30))
    assert peaks["angular_speed"].limit == pytest.approx(np.radians(30))
    assert all(peak.value < peak.bound < peak.value + 1e-9 for peak in tool.peaks)


def test_a_slow_tool_moves_and_does_not_turn() -> None:
    slow = {"planner": "line", "to": {"xyz": [0.4, -0.38, 0.3]}, "law": {"shape": "quintic", "duration": 4}}
    _, report = planned(slow)
    tool = tool_of(report.moves[0])
    peaks = {peak.quantity: peak for peak in tool.peaks}
    assert {name for name, peak in peaks.items() if peak.negligible} == {
        "angular_speed",
        "angular_acceleration",
    }
    assert peaks["speed"].value == pytest.approx(15 / 8 * 0.02 / 4)
    assert tool.deviation_bound is not None
    assert tool.turned_bound is not None
    assert tool.deviation <= tool.deviation_bound <= 1e-9
    assert tool.turned <= tool.turned_bound <= 1e-9
    assert tool.method == "bounded"


def test_each_segment_has_its_speed_its_places_and_its_times_in_the_job() -> None:
    """Of the speeds only those have peaks that the segment limits."""
    points, wanted = [[0.4, -0.3, 0.3], [0.4, -0.2, 0.3], [0.4, -0.1, 0.35]], [0.1, 0.2, 0.05]
    segments = [
        {"line": {"xyz": point}, **({} if speed == 0.2 else {"law": {"speed": speed}})}
        for point, speed in zip(points, wanted, strict=True)
    ]
    path = {"planner": "path", "corner": "stop", "segments": segments}
    plan, report = planned(HOLD, {**path, "law": {"shape": "time_optimal", "speed": 0.2}})
    move = report.moves[1]
    t, gone, rates = speeds_of(plan, move)
    found = tool_of(move).segments
    assert found is not None
    lengths = np.cumsum([0.0, 0.1, 0.1, np.hypot(0.1, 0.05)])
    assert [(run.first, run.last) for run in found] == [(0, 0), (1, 1), (2, 2)]
    assert [run.begins for run in found] == pytest.approx(lengths[:-1].tolist())
    assert [run.ends for run in found] == pytest.approx(lengths[1:].tolist())
    assert [run.start for run in found] == pytest.approx(np.interp(lengths[:-1], gone, t), abs=0.01)
    assert [run.end for run in found] == pytest.approx(np.interp(lengths[1:], gone, t), abs=0.01)
    for run, speed in zip(found, wanted, strict=True):
        (peak,) = run.peaks
        assert (peak.quantity, peak.limit) == ("speed", pytest.approx(speed))
        assert peak.value == pytest.approx(speed, rel=1e-3)
        assert run.start <= peak.time <= run.end
        assert np.interp(peak.time, t, rates) == pytest.approx(speed, rel=1e-2)


HINGE_AND_SLIDE: dict[str, Any] = {
    "robot": {"joints": [{"velocity": 1, "acceleration": 4}, {"type": "prismatic", "velocity": 1, "acceleration": 4}]},
    "start": {"joints": [0, 0]},
    "units": {"angle": "rad"},
    "limits": {},
}  # fmt: skip


def to(*joints: float, **fields: Any) -> dict[str, Any]:
    return {"planner": "quintic", "to": {"joints": list(joints)}, "duration": 4, **fields}


@pytest.mark.parametrize("joints", [(0, 1), (1, 0), (0, 0), (1, 1)])
def test_what_knots_miss_is_in_the_unit_of_the_joint_that_misses_most(joints: tuple[int, int]) -> None:
    """Of positions it may be another joint than of velocities."""
    plan, _ = planned(to(1, 0.5), **HINGE_AND_SLIDE)
    knots = knots_of(plan.trajectory)
    made = replace(knots, deviation=replace(knots.deviation, joints=joints))
    found = report_of(plan, knots=made).knots
    assert found is not None
    units = found.deviation.position_unit, found.deviation.velocity_unit
    assert units == (("rad", "m")[joints[0]], ("rad/s", "m/s")[joints[1]])


def test_moves_that_are_repeated_have_rounds_and_others_none() -> None:
    again = {"repeat": 2, "moves": [to(1, 0.5), to(0, 0)]}
    _, report = planned(to(0.5, 0), to(0, 0), again, **HINGE_AND_SLIDE)
    assert [move.round for move in report.moves] == [
        *(None, None),
        *("round 1 of 2",) * 2,
        *("round 2 of 2",) * 2,
    ]


def test_all_remarks_and_all_that_is_not_judged_of_the_tool_are_told() -> None:
    plan, _ = planned(to(1, 0.5), **HINGE_AND_SLIDE)
    said = [Event("law", f"remark {k}", k) for k in range(3)]
    names = ("speed", "acceleration")
    more = replace(plan, remarks=tuple(said), verdict=replace(plan.verdict, unchecked_of_tool=names))
    report = report_of(more)
    assert [(one.message, one.move) for one in report.remarks] == [(f"remark {k}", k) for k in range(3)]
    assert [one.quantity for one in report.unchecked_of_tool] == list(names)


def test_a_plan_that_fails_has_no_knots() -> None:
    _, report = planned(to(1, 0.5, duration=0.5), **HINGE_AND_SLIDE)
    assert report.verdict == "violated"
    assert report.knots is None


def test_of_findings_of_one_cause_the_worst_is_told_with_how_many_there_are() -> None:
    """Both joints are too fast in a move and in the next one: its velocity is 15/8 of the mean one."""
    plan, _ = planned(to(1, 0.25, duration=0.625), to(0, 0, duration=0.5), **HINGE_AND_SLIDE)
    every = verification_error(plan).problems
    assert len(every) == len(plan.verdict.findings) > 2
    worst = verification_error(plan, every=False).problems
    others = len(every) - len(worst)
    counts = [
        problem.text().rpartition(" (and ")[2] for problem in worst if "like it: --all)" in problem.text()
    ]
    assert sum(int(text.split()[0]) for text in counts) == others > 0


def test_who_accepts_no_concession_is_told_each_with_its_move() -> None:
    slow = {"when_over_limit": "slow", "duration": 0.5}
    plan, _ = planned(to(1, 0.5, **slow), to(0, 0), to(1, 0, **slow), **HINGE_AND_SLIDE)
    assert [event.move for event in plan.events] == [0, 2]
    problems = concession_error(plan).problems
    assert [(problem.kind, problem.move) for problem in problems] == [("slowed", 0), ("slowed", 2)]
    places = [problem.place for problem in problems]
    assert places == [plan.loaded.place_of_move(0), plan.loaded.place_of_move(2)]
    assert places[0] != places[1]
    assert all(problem.hint == "leave --strict out to accept it" for problem in problems)


@pytest.mark.full
def test_of_moves_that_fly_by_a_corner_the_tool_is_compared_at_the_times_of_its_line() -> None:
    """Outside of the ball; at other times it would be centimetres from where its line has it."""
    lines = [{"planner": "line", "to": {"xyz": [0.4, y, z]}} for y, z in ((-0.3, 0.3), (-0.3, 0.4))]
    limits = {"acceleration": 800, "tcp": {"speed": 0.2, "acceleration": 2}}
    plan, report = planned({**lines[0], "zone": 0.02}, lines[1], limits=limits)
    assert report.flyby is not None
    for move, line in zip(report.moves, (0.1, 0.1), strict=True):
        tool = tool_of(move)
        assert tool.deviation < 1e-9
        assert tool.length == pytest.approx(line, abs=0.03)
        t, _, rates = speeds_of(plan, move)
        (peak,) = [each for each in tool.peaks if each.quantity == "speed"]
        assert move.start < peak.time < move.end
        assert np.interp(peak.time, t, rates) == pytest.approx(peak.value, rel=1e-3)


def test_how_near_a_motion_is_to_the_fastest_is_told_with_its_joints_and_times() -> None:
    """Of searches of which some led to none; where nothing bounds the duration, the motion is the best found."""
    plan, _ = planned(to(1, 0.5), to(0, 0), **HINGE_AND_SLIDE)
    first, second = plan.moves
    off = {"off_chords": np.array([0.25, 0.5]), "off_times": np.array([1.0, 3.0])}
    made = Certificate(3.2, 1, (4.0, np.inf, 4.5), 1, np.inf, **off)

    def said(certificate: Certificate) -> Any:
        move = replace(second, planned=replace(second.planned, certificate=certificate))
        return report_of(replace(plan, moves=(first, move))).moves[1].fastest

    found = said(made)
    assert (found.lower, found.above, found.joint, found.method) == (
        3.2,
        pytest.approx(0.25),
        "j2",
        "bounded",
    )
    assert (found.starts, found.agreeing, found.found, found.stopping) == (3, 1, [4.0, None, 4.5], None)
    chords = [(one.joint, one.distance, one.time, one.unit) for one in found.off_chords]
    assert chords == [("j1", 0.25, 5.0, "rad"), ("j2", 0.5, 7.0, "m")]
    assert said(replace(made, lower=4.0 * (1 + 1e-12), joint=None, stopping=5.5)).above == 0.0
    together = said(replace(made, joint=None, stopping=5.5))
    assert (together.joint, together.stopping) == (None, 5.5)
    unknown = said(replace(made, lower=0.0))
    assert (unknown.lower, unknown.above, unknown.method) == (None, None, "heuristic")
