"""Approach, retreat, defaults and labels against the moves written out by hand."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from tiers import few

from tests.cli.running import call
from trajcli.errors import InputError
from trajcli.job.read import job_from_text
from trajcli.output.report import report_of
from trajcli.planning.plan import Plan, plan_job

HEAD = """\
version: 1
units: {angle: deg, length: mm}
robot: ur5e
limits: {acceleration: 800, jerk: 4000, tcp: {acceleration: 3000}}
frames: {cell: {rpy: [0, 10, 90]}, lane: {grid: {from: cell, steps: [{count: 2, xyz: [1, 0, 0]}]}}}
points:
  home: {joints: [0, -90, 90, -90, -90, 0]}
  pose: {xyz: [450, 100, 300], rpy: [175, 10, 30]}
  over: {from: pose, offset: {xyz: [0, 0, -40]}}
  beside: {from: pose, offset: {xyz: [0, 24, 32]}, frame: cell}
  back: {from: home, offset: {xyz: [0, 0, -40]}}
start: home
"""
Q = "law: {shape: quintic, duration: 1}"


def planned(text: str) -> Plan:
    return plan_job(job_from_text(HEAD + text, "job.yaml"))


def moves(*written: str) -> str:
    return "moves:\n" + "".join(f"  - {{{move}}}\n" for move in written)


def assert_same_bytes(plan: Plan, other: Plan) -> None:
    np.testing.assert_array_equal(plan.trajectory.curve.breaks, other.trajectory.curve.breaks)
    np.testing.assert_array_equal(plan.trajectory.curve.coefficients, other.trajectory.curve.coefficients)


def assert_same_motion(plan: Plan, other: Plan) -> None:
    assert [s.planner for s in plan.trajectory.spans] == [s.planner for s in other.trajectory.spans]
    assert plan.trajectory.duration == pytest.approx(other.trajectory.duration, abs=1e-9)
    times = np.linspace(0, other.trajectory.duration, 300)
    for order in range(3):
        rows, expected = (each.trajectory.curve.evaluate(times, order) for each in (plan, other))
        assert np.abs(rows - expected).max() < 1e-6 * np.abs(expected).max()


LAW = "law: {shape: quintic, duration: 0.7}"
BESIDE = f"{{distance: 40, axis: x, {LAW}}}"
BY_HAND = [
    (
        [f"planner: jerk_limited, to: pose, approach: {{distance: 40, {LAW}}}"],
        ["planner: jerk_limited, to: over", f"planner: line, to: pose, {LAW}"],
    ),
    (
        [f"planner: jerk_limited, to: pose, approach: {{distance: 40, axis: [0, 3, 4], frame: cell, {LAW}}}"],
        ["planner: jerk_limited, to: beside", f"planner: line, to: pose, {LAW}"],
    ),
    (
        ["planner: jerk_limited, to: pose", f"planner: quintic, to: home, retreat: {{distance: 40, {LAW}}}"],
        ["planner: jerk_limited, to: pose", f"planner: line, to: over, {LAW}", "planner: quintic, to: home"],
    ),
    (
        ["planner: quintic, to: pose", f"planner: quintic, to: home, approach: {{distance: 40, {LAW}}}"],
        ["planner: quintic, to: pose", "planner: quintic, to: back", f"planner: line, to: home, {LAW}"],
    ),
    (
        [
            "planner: quintic, to: {xyz: [450, 100, 300], rpy: [175, 10, 30]}, approach: {distance: 40, "
            + LAW
            + "}"
        ],
        ["planner: quintic, to: over", f"planner: line, to: pose, {LAW}"],
    ),
    (
        [
            "planner: quintic, to: over",
            f"planner: quintic, to: {{from: here, offset: {{xyz: [0, 0, 40]}}}}, approach: {BESIDE}",
        ],
        [
            "planner: quintic, to: over",
            "planner: quintic, to: {from: pose, offset: {xyz: [40, 0, 0]}}",
            f"planner: line, to: pose, {LAW}",
        ],
    ),
    (
        ["planner: jerk_limited, to: pose, approach: 40, limits: {velocity: 50}"],
        [
            "planner: jerk_limited, to: over, limits: {velocity: 50}",
            "planner: line, to: pose, law: {shape: time_optimal}, limits: {velocity: 50}",
        ],
    ),
]


@pytest.mark.parametrize(("short", "long"), few(BY_HAND, 3))
def test_approach_and_retreat_are_the_moves_written_out(short: list[str], long: list[str]) -> None:
    assert_same_motion(planned(moves(*short)), planned(moves(*long)))


@pytest.mark.full
def test_from_where_the_arm_stands_an_approach_comes_back_to_the_target() -> None:
    """Joints that turn by some angles are reached straight, from a point before them."""
    plan = planned(
        moves(
            f"planner: jerk_limited, to: {{joints_by: {{elbow_joint: 10}}}}, approach: {{distance: 30, {LAW}}}"
        )
    )
    other = planned(moves("planner: jerk_limited, to: {joints_by: {elbow_joint: 10}}"))
    ends = [each.trajectory.curve.evaluate(each.trajectory.duration, side="left") for each in (plan, other)]
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-6)
    assert len(plan.moves) == 2


DEFAULTS = [
    ("{law: {speed: 250}}", "planner: line, to: over", "law: {shape: time_optimal, speed: 250}"),
    ("{law: {speed: 250}}", "planner: screw, to: over", "law: {shape: time_optimal, speed: 250}"),
    (
        "{law: {speed: 250, acceleration: 2000}}",
        "planner: line, to: over, law: {acceleration: 900}",
        "law: {shape: time_optimal, speed: 250, acceleration: 900}",
    ),
    ("{law: {speed: 250}}", f"planner: line, to: over, {Q}", Q),
    (
        "{law: {speed: 250}}",
        "planner: line, to: over, law: {duration: 2, shape: cubic}",
        "law: {shape: cubic, duration: 2}",
    ),
    ("{law: {shape: quintic, duration: 1}}", "planner: line, to: over", Q),
    (
        "{law: {shape: quintic, duration: 1}, tolerance: {position: 0.01}}",
        "planner: line, to: over, tolerance: {angle: 0.01}",
        f"{Q}, tolerance: {{position: 0.01, angle: 0.01}}",
    ),
    (
        "{orientation: fixed, law: {shape: quintic, duration: 1}}",
        "planner: line, to: {xyz: [430, 90, 320]}",
        f"orientation: fixed, {Q}",
    ),
]


@pytest.mark.full
@pytest.mark.parametrize(("defaults", "move", "written"), few(DEFAULTS, 3))
def test_defaults_are_written_into_the_moves(defaults: str, move: str, written: str) -> None:
    bare = move.partition(", law")[0].partition(", tolerance")[0]
    plan = planned(f"defaults: {defaults}\n" + moves("planner: jerk_limited, to: pose", move))
    assert_same_bytes(plan, planned(moves("planner: jerk_limited, to: pose", f"{bare}, {written}")))


@pytest.mark.full
def test_defaults_hold_for_the_straight_part_of_an_approach_and_for_nothing_in_joint_space() -> None:
    plan = planned("defaults: {law: {speed: 100}}\n" + moves("planner: jerk_limited, to: pose, approach: 40"))
    law = "law: {shape: time_optimal, speed: 100}"
    other = planned(moves("planner: jerk_limited, to: over", f"planner: line, to: pose, {law}"))
    assert_same_motion(plan, other)


WRONG = [
    ("", "planner: hold, duration: 1, approach: 40", 14, "an approach needs a target"),
    ("", "planner: quintic, to: pose, approach: -40", 14, "above 0"),
    ("", "planner: quintic, to: pose, approach: {axis: z}", 14, "`distance` is missing"),
    ("", "planner: quintic, to: pose, approach: {distance: 4, axis: w}", 14, "expected 3 numbers"),
    ("", "planner: quintic, to: pose, approach: {distance: 4, axes: z}", 14, "unknown key 'axes'"),
    ("", "planner: quintic, to: pose, approach: {distance: 4, frame: cel}", 14, "there is no frame 'cel'"),
    ("", "planner: quintic, to: pose, approach: {distance: 4, law: {shap: cubic}}", 14, "unknown key 'shap'"),
    ("", "planner: quintic, to: pse, approach: 4", 14, "there is no point 'pse'"),
    ("", "planner: [line], to: pose", 14, "expected a planner's name"),
    ("defaults: {law: {speed: 1}}\n", "planner: [line], to: pose", 15, "expected a planner's name"),
    ("defaults: {law: {speed: -1}}\n", "planner: line, to: pose", 13, "above 0"),
    ("defaults: {law: {spee: 1}}\n", "planner: quintic, to: pose", 13, "unknown key 'spee'"),
    ("defaults: {law: {speed: 1, in: lane}}\n", "planner: line, to: pose", 15, "'lane' is many (2)"),
    ("defaults: {lw: {speed: 1}}\n", "planner: quintic, to: pose", 13, "unknown key 'lw'"),
    ("defaults: 3\n", "planner: quintic, to: pose", 13, "expected a mapping"),
    ("", "planner: quintic, to: pose, label: ''", 14, "not empty"),
]


@pytest.mark.parametrize(("head", "move", "line", "message"), WRONG)
def test_what_is_wrong_is_said_once_on_its_line(head: str, move: str, line: int, message: str) -> None:
    with pytest.raises(InputError) as caught:
        planned(head + moves(move))
    (problem,) = caught.value.problems
    assert message in problem.message
    assert problem.place is not None
    assert problem.place.line == line


WORDS = [
    ("planner: quintic, to: pose, approach: {distance: 4, frame: cel}", "cel"),
    ("planner: quintic, to: pose, approach: {distance: 4, law: {speed: -7}}", "-7"),
    ("planner: quintic, to: pose, approach: {distance: 4, zone: -7}", "-7"),
    ("planner: quintic, to: {joints_by: 3}, zone: -7, approach: {distance: 4, zone: 5}", "-7"),
    ("planner: quintic, to: {from: pose, frame: cel}, approach: {distance: 4, zone: 5}", "cel"),
    ("planner: quintic, to: pose, retreat: {distance: 4, frame: cel}", "cel"),
    ("planner: quintic, to: pose, retreat: {distance: 4, zone: {radius: 7}}", "radius"),
]


@pytest.mark.parametrize(("move", "word"), WORDS)
def test_what_is_wrong_in_a_part_is_shown_where_it_is_written(move: str, word: str) -> None:
    with pytest.raises(InputError) as caught:
        planned(moves(move))
    (problem,) = caught.value.problems
    assert problem.place is not None
    assert problem.place.column == len("  - {") + move.index(word) + 1


LABELLED = """\
moves:
  - {planner: jerk_limited, to: pose, approach: 40, label: pick up}
  - repeat: 2
    label: shake
    moves: [{planner: quintic, to: over, label: up}, {planner: quintic, to: pose}]
"""


@pytest.mark.full
def test_labels_stand_in_reports_explanations_and_errors(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    report = report_of(planned(LABELLED))
    assert [(move.label, move.round) for move in report.moves] == [
        ("pick up", None),
        ("pick up", None),
        ("up", "shake, round 1 of 2"),
        (None, "shake, round 1 of 2"),
        ("up", "shake, round 2 of 2"),
        (None, "shake, round 2 of 2"),
    ]
    job = tmp_path / "job.yaml"
    job.write_text(HEAD + LABELLED, encoding="utf-8")
    found = call(capfd, "explain", str(job)).out
    assert "move 1: pick up (line), " in found
    assert "move 4: up (quintic, shake, round 2 of 2), " in found
    assert json.loads(call(capfd, "explain", str(job), "--json").out)["moves"][0]["label"] == "pick up"
    with pytest.raises(Exception, match=r"move 1, far \(line\): "):
        planned(
            moves("planner: hold, duration: 1", f"planner: line, to: {{xyz: [4500, 0, 0]}}, label: far, {Q}")
        )
