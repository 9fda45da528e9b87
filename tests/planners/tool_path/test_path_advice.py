"""Errors of a path stand at the segment they are about, and what they propose works."""

from __future__ import annotations

import numpy as np
import pytest

from trajcli.cli.plan import summary
from trajcli.errors import TrajcliError
from trajcli.job.read import job_from_text
from trajcli.planning.plan import Plan, plan_job

JOB = """version: 1
units: {angle: deg, length: mm}
robot: ur5e
limits: {acceleration: 800, jerk: 8000, tcp: {speed: 250, acceleration: 2000}}
start: {xyz: [400, 100, 200], rpy: [180, 0, 0], configuration: {elbow: up}}
moves:
  - planner: path
    segments:
      - {line: {xyz: [400, 200, 200]}}
      - SEGMENT
    radius: 10
    law: {shape: time_optimal}
"""
BACK = "{line: {xyz: [400, 120, 200]}}"
TURN = "{line: {xyz: [450, 200, 200]}}"
STRAIGHT_ARC = "{arc: {via: {xyz: [400, 250, 200]}, to: {xyz: [400, 300, 200]}}}"


def planned(segment: str, *changes: tuple[str, str]) -> Plan:
    text = JOB.replace("SEGMENT", segment)
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return plan_job(job_from_text(text))


@pytest.mark.full
@pytest.mark.parametrize(
    ("segment", "line", "said"),
    [
        ("{line: {xyz: [400, 200, 200], rpy: [180, 0, 20]}}", 10, "leave it out"),
        (STRAIGHT_ARC, 10, "this arc is straight"),
        ("{line: {xyz: [2400, 200, 200]}}", 10, "does not reach"),
    ],
)
def test_errors_stand_at_their_segment(segment: str, line: int, said: str) -> None:
    with pytest.raises(TrajcliError) as caught:
        planned(segment)
    (problem,) = caught.value.problems
    assert problem.place is not None
    assert problem.place.line == line
    assert said in f"{problem.message} | {problem.hint}"


@pytest.mark.full
def test_a_radius_of_zero_stops_at_that_corner_alone() -> None:
    third = "{line: {xyz: [450, 120, 200]}}"
    plan = planned(
        f"{BACK}\n      - {third}",
        (
            "200, 200]}}\n      - {line: {xyz: [400, 120",
            "200, 200]}, radius: 0}\n      - {line: {xyz: [400, 120",
        ),
    )
    assert plan.verdict.passed
    tool = plan.moves[0].planned.tool
    assert tool is not None
    first, second = tool.path.poses.position.corners  # type: ignore[attr-defined]
    times = np.linspace(0.0, tool.law.end, 4001)
    s, speed = tool.law.evaluate(times)[:, 0], tool.law.evaluate(times, 1)[:, 0]
    assert min(speed[abs(s - first.s) < 1e-4]) < 1e-3 * speed.max()
    assert min(speed[abs(s - second.s) < 1e-3]) > 0.02 * speed.max()


def kinds_of(plan: Plan) -> list[str]:
    return [event.kind for event in plan.events]


@pytest.mark.full
def test_a_path_that_turns_back_stops_there_and_says_so() -> None:
    third = f"{BACK}\n      - {{line: {{xyz: [450, 120, 200]}}}}"
    ahead = "200, 200]}}\n      - {line: {xyz: [400, 120"
    by_hand = planned(third, (ahead, ahead.replace("}}", "}, radius: 0}")))
    plan = planned(third)
    assert kinds_of(plan) == ["turns_back", *kinds_of(by_hand)]
    assert "segment 0" in plan.events[0].message
    assert np.array_equal(plan.trajectory.curve.coefficients, by_hand.trajectory.curve.coefficients)


@pytest.mark.full
def test_doubled_points_are_one() -> None:
    twice = "{line: {xyz: [400, 200, 200]}}"
    single, doubled = planned(TURN), planned(f"{twice}\n      - {twice}\n      - {TURN}\n      - {TURN}")
    assert kinds_of(doubled) == ["merged", *kinds_of(single)]
    assert "segment 1 counts for nothing" in doubled.events[0].message
    assert "2 more likewise" in doubled.events[0].message
    assert np.array_equal(doubled.trajectory.curve.coefficients, single.trajectory.curve.coefficients)
    with pytest.raises(TrajcliError) as caught:
        planned(f"{twice}\n      - {twice}\n      - {TURN}\n      - {{line: {{xyz: [4000, 0, 0]}}}}")
    place = caught.value.problems[0].place
    assert place is not None
    assert place.line == 13


def test_of_a_doubled_point_the_least_radius_counts() -> None:
    twice = "{line: {xyz: [400, 200, 200]}, radius: 0}"
    jerk, law = ("jerk: 8000, ", ""), ("law: {shape: time_optimal}", "law: {shape: trapezoid}")
    plan = planned(f"{twice}\n      - {TURN}", jerk, law)
    tool = plan.moves[0].planned.tool
    assert tool is not None
    (corner,) = tool.path.poses.position.corners  # type: ignore[attr-defined]
    assert corner.kind == "stop"


@pytest.mark.full
def test_a_jerk_limited_law_about_a_rounded_corner_names_the_faster_one() -> None:
    law = ("law: {shape: time_optimal}", "law: {shape: jerk_limited, jerk: 20000}")
    plan = planned(TURN, law)
    hints = {finding.hint for finding in plan.verdict.findings if finding.kind == "jerk"}
    (hint,) = hints
    assert hint is not None
    words, _, rest = hint.partition("; `shape: time_optimal` under `law` takes ")
    assert rest, words
    faster = planned(TURN, ("shape: time_optimal", "shape: time_optimal, jerk: 20000"))
    assert faster.verdict.passed
    assert faster.trajectory.duration == pytest.approx(float(rest.split()[0]), rel=1e-5)
    assert faster.trajectory.duration < 0.9 * float(words.partition("(")[2].split()[0])


def test_many_steps_in_acceleration_are_one_useful_line() -> None:
    jerk = ("jerk: 8000, ", "")
    plan = planned(TURN, jerk, ("law: {shape: time_optimal}", "law: {shape: trapezoid}"))
    assert len(plan.verdict.steps) > 9
    (line,) = [line for line in summary(plan, 0).splitlines() if "steps" in line]
    sizes = [abs(step.size) for step in plan.verdict.steps]
    assert f"steps {len(sizes)} times, by up to {np.degrees(max(sizes)):.9g} deg/s^2" in line
