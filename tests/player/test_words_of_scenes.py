"""What a page says beside its curves: titles, moves with what they use most, findings, events, and two motions together."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace as Some
from typing import Any

import numpy as np
import pytest

from trajcli.job.read import job_from_text
from trajcli.planners.planner import Event
from trajcli.planning.causes import causes_of
from trajcli.planning.plan import Plan, plan_job
from trajcli.player.scene import _notes, dressed, scene_of_plan, scene_of_two, waypoints_of

JOB = """
version: 1
units: {angle: deg, length: mm}
robot: {name: rig, joints: [{name: turn, position: [-170, 170]}, {name: slide, type: prismatic}]}
limits: {velocity: [100, 500], acceleration: [400, 2000]}
start: {joints: [0, 0]}
moves:
  - {planner: quintic, to: {joints: [40, 20]}, duration: 2}
  - {signal: glue, value: 1}
  - {planner: quintic, label: back, to: {joints: [0, 300]}, duration: 0.5, when_over_limit: OVER}
  - {planner: hold, duration: 0.25}
"""


def planned(over: str) -> tuple[Plan, dict[str, Any]]:
    plan = plan_job(job_from_text(JOB.replace("OVER", over), "cell.yaml"))
    return plan, scene_of_plan(plan)


def test_a_page_says_whose_motion_it_is_and_how_much_of_which_limit_each_move_uses() -> None:
    """Of a quintic the largest velocity is 15/8 of the mean one: of 20 deg/s, with a limit of 100."""
    plan, scene = planned("slow")
    assert scene["title"] == plan.loaded.name
    duration = plan.trajectory.duration
    assert scene["subtitle"] == f"rig · 3 moves · {duration:.6g} s"
    assert scene["verdict"] == {"state": "verified", "text": "verified"}
    first, back, hold = scene["moves"]
    assert [each["index"] for each in scene["moves"]] == [0, 2, 3]
    assert (back["label"], hold["label"]) == (f"2 {back['title']}", f"3 {hold['title']}")
    assert "back" in back["title"]
    assert (first["start"], first["end"], back["start"]) == (0.0, 2.0, 2.0)
    assert first["detail"] == "2 s; velocity of turn uses 37.5 % of its limit"
    assert back["detail"].startswith(f"{duration - 2.25:.6g} s; ")
    assert hold["detail"] == "0.25 s"
    assert scene["waypoints"] == []  # of an arm without geometry


def test_an_event_stands_at_the_start_of_its_move_and_those_of_trajcli_itself_are_left_out() -> None:
    plan, scene = planned("slow")
    shown = [event for event in plan.events if not event.is_internal]
    assert len(scene["events"]) == len(shown) >= 1
    more = (*plan.events, Event("bound", "near the fastest"), Event("refined", "so often"))
    assert scene_of_plan(replace(plan, events=more))["events"] == scene["events"]
    (slowed,) = (
        event for event in scene["events"] if "stretched" in event["message"] or "slowed" in event["message"]
    )
    assert (slowed["time"], slowed["label"]) == (2.0, f"{plan.loaded.called(2)}:")


def test_findings_are_counted_by_their_causes_and_say_what_helps() -> None:
    plan, scene = planned("error")
    causes = causes_of(plan)
    findings = plan.verdict.findings
    assert len(findings) > len(causes)
    assert scene["causes"] == [list(cause.indices) for cause in causes]
    plural = "s" * (len(causes) != 1)
    assert scene["verdict"] == {"state": "violated", "text": f"{len(causes)} finding{plural}"}
    for shown, finding in zip(scene["findings"], findings, strict=True):
        assert shown["label"] == f"{plan.loaded.called(2)}:"
        assert shown["message"] == finding.text(plan.loaded.say)
        assert ("deg" if finding.joint == "turn" else "mm") in shown["message"]
        assert shown["hint"] == finding.hint


def test_two_motions_are_shown_with_the_limits_of_the_first_and_all_of_the_second() -> None:
    (_, first), (_, second) = planned("slow"), planned("error")
    second = {**second, "title": "other", "notes": ["a note"]}
    both = scene_of_two(first, second)
    for key in ("title", "subtitle", "verdict", "joints", "robot", "rows", "loads", "moves"):
        assert both["other"][key] == second[key], key
        assert both[key] == first[key], key
    assert both["limits"] == first["limits"]
    worst = [second["findings"][cause[0]] for cause in second["causes"]]
    said = [f"other: {one['label']} {one['message']}" for one in worst]
    assert both["notes"] == [*first["notes"], *said, "other: a note"]
    tool = {"length": {"unit": "mm"}, "tool": {"unit": "mm/s"}}
    assert scene_of_two({**first, **tool}, {**second, **tool})["other"].items() >= tool.items()


def test_meshes_and_what_is_said_of_them_come_to_the_arm_and_its_notes() -> None:
    scene = {"robot": {"base": 1}, "notes": ["one"]}
    assert dressed(scene, [{"link": 0}], ["two"]) == {
        "robot": {"base": 1, "meshes": [{"link": 0}]},
        "notes": ["one", "two"],
        "remarks": ["two"],
    }
    assert dressed({**scene, "robot": None}, [], [])["robot"] is None
    assert "meshes" not in dressed(scene, [], [])["robot"]


def test_a_hundred_steps_are_listed_and_it_is_said_of_how_many() -> None:
    moves = "\n".join(f"  - {{planner: cubic, to: {{joints: {k / 10}}}, duration: 1}}" for k in range(1, 121))
    plan = plan_job(
        job_from_text(f"version: 1\nrobot: {{joints: 1}}\nstart: {{joints: 0}}\nmoves:\n{moves}\n")
    )
    count = len(plan.verdict.steps)
    assert count > 100
    scene = scene_of_plan(plan)
    assert len(scene["steps"]) == 100
    assert f"Of {count} steps in acceleration the first 100 are listed." in scene["notes"]


@pytest.mark.parametrize("count", [1, 39, 40, 41, 200])
def test_forty_points_at_most_are_shown(count: int) -> None:
    shown = waypoints_of([(float(k), np.array([0.01 * k]), "") for k in range(count)])
    assert len(shown) == (count if count <= 40 else -(-count // -(-count // 40)))


def test_every_remark_and_all_that_was_not_judged_are_noted() -> None:
    verdict = Some(
        unchecked_of_tool=("angular_speed", "jerk"),
        sampled=(("deviation", (0, 1)), ("singularity", tuple(range(25)))),
        steps=(),
    )
    remarks = (Event("note", "one"), Event("note", "two"))
    plan = Some(remarks=remarks, unchecked="jerk of turn", verdict=verdict, flyby=None)
    assert list(_notes(plan)) == [  # type: ignore[arg-type]
        "one",
        "two",
        "Without a limit, not checked: jerk of turn.",
        "Limited, but not checked in every move: angular speed, jerk of the tool.",
        "On samples only: deviation, moves 0, 1.",
        f"On samples only: singularity, moves {', '.join(map(str, range(20)))}, ....",
    ]
