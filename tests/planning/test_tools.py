"""Tools of a job: poses, torques and limits are of the one on the flange, at each move."""

from __future__ import annotations

import json
from functools import cache
from typing import Any

import numpy as np
import pytest

from trajcli.errors import TrajcliError
from trajcli.grids import ListedGrid
from trajcli.job.dump import dump_job
from trajcli.job.read import job_from_text
from trajcli.kinematics.robot import Robot
from trajcli.output.explain import explanation
from trajcli.output.report import report_of
from trajcli.planning.plan import Plan, plan_job
from trajcli.samples import sample

LONG = {"xyz": [0, 0, 150], "mass": 0.8, "com": [0, 0, -60]}
BENT = {"xyz": [60, -20, 220], "rpy": [10, 30, -20], "mass": 1.5}
HEAD: dict[str, Any] = {
    "version": 1,
    "units": {"angle": "deg", "length": "mm"},
    "robot": "ur5e",
    "limits": {"acceleration": 800},
    "tools": {"long": LONG, "bent": BENT, "bare": {}},
    "start": {"joints": [0, -90, 90, 0, 90, 0]},
}
LAW = {"shape": "quintic", "duration": 1}
LONG_POSE = np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0.15], [0, 0, 0, 1.0]])


def rotation(axis: int, degrees: float) -> np.ndarray:
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    result, i, j = np.eye(3), (axis + 1) % 3, (axis + 2) % 3
    result[i, i], result[j, j], result[i, j], result[j, i] = c, c, -s, s
    return result


BENT_POSE = np.eye(4)
BENT_POSE[:3, :3] = rotation(2, -20) @ rotation(1, 30) @ rotation(0, 10)
BENT_POSE[:3, 3] = 0.06, -0.02, 0.22


def flange(robot: Robot, q: np.ndarray) -> np.ndarray:
    """Return T_world_flange by the textbook's product of Denavit-Hartenberg matrices."""
    pose = robot.base
    for joint, angle in zip(robot.joints, q, strict=True):
        ct, st = np.cos(joint.theta + angle), np.sin(joint.theta + angle)
        ca, sa = np.cos(joint.alpha), np.sin(joint.alpha)
        pose = pose @ np.array(
            [
                [ct, -st * ca, st * sa, joint.a * ct],
                [st, ct * ca, -ct * sa, joint.a * st],
                [0, sa, ca, joint.d],
                [0, 0, 0, 1],
            ]
        )
    return pose


def line(*xyz: float, **fields: Any) -> dict[str, Any]:
    return {"planner": "line", "to": {"from": "here", "offset": {"xyz": xyz}}, "law": LAW, **fields}


@cache
def _planned(text: str) -> Plan:
    return plan_job(job_from_text(text))


def planned(*moves: dict[str, Any], **fields: Any) -> Plan:
    plan = _planned(json.dumps({**HEAD, "moves": moves, **fields}))
    assert plan.verdict.passed, plan.verdict.findings[0].message
    return plan


def rows(plan: Plan, times: list[float], *groups: Any) -> np.ndarray:
    grid = ListedGrid(plan.trajectory.duration, np.array(times))
    robot = plan.loaded.robot_of_rows
    return np.concatenate([*sample(plan.trajectory, grid, groups, robot=robot)])


CHANGE = (line(0, 0, 50), {"tool": "bent"}, line(0, 0, -50), {"tool": "long"}, line(30, 0, 0))


def test_poses_are_of_the_tool_that_is_on_the_flange_and_of_the_new_one_at_its_change() -> None:
    plan = planned(*CHANGE, tool="long")
    times = [0.0, 0.5, 0.999, 1.0, 1.5, 1.999, 2.0, 2.7, 3.0]
    tools = [LONG_POSE] * 3 + [BENT_POSE] * 3 + [LONG_POSE] * 3
    for row, q, tool in zip(rows(plan, times, "pose"), rows(plan, times, "q"), tools, strict=True):
        pose = flange(plan.loaded.robot, q) @ tool
        np.testing.assert_allclose(row[:3], pose[:3, 3], atol=1e-12)
        w, x, y, z = row[3:]
        assert [2 * (x * y - w * z), 2 * (y * z - w * x)] == pytest.approx([pose[0, 1], pose[1, 2]])


def test_the_twist_is_that_of_the_tool_on_the_flange() -> None:
    plan, step = planned(*CHANGE, tool="long"), 1e-5
    for time, tool in ((0.4, LONG_POSE), (1.3, BENT_POSE), (2.6, LONG_POSE)):
        before, after = rows(plan, [time - step, time + step], "q")
        tips = [(flange(plan.loaded.robot, q) @ tool)[:3, 3] for q in (before, after)]
        velocity = rows(plan, [time], "twist")[0, :3]
        np.testing.assert_allclose(velocity, (tips[1] - tips[0]) / (2 * step), atol=1e-8)


def test_a_line_behind_a_tool_change_is_straight_for_the_new_tool_and_along_its_axes() -> None:
    plan = planned(*CHANGE, tool="long")
    tips = [flange(plan.loaded.robot, q) @ BENT_POSE for q in rows(plan, [1.0, 1.2, 1.5, 1.7, 1.999999], "q")]
    first, axis = tips[0][:3, 3], -tips[0][:3, 2]
    for tip in tips[1:]:
        along = (tip[:3, 3] - first) @ axis
        assert np.linalg.norm(tip[:3, 3] - first - along * axis) < 1e-6
        np.testing.assert_allclose(tip[:3, :3], tips[0][:3, :3], atol=1e-5)
    assert (tips[-1][:3, 3] - first) @ axis == pytest.approx(0.05, abs=1e-6)


def test_a_tool_weighs_as_much_as_a_payload_at_its_place() -> None:
    move = {"planner": "jerk_limited", "to": {"joints": [40, -60, 70, 10, 60, 90]}}
    tool = planned(move, tool="long", limits={"acceleration": 800, "jerk": 4000})
    attached = planned(
        {"attach": {"mass": 0.8, "com": [0, 0, -60]}},
        move,
        tool={"xyz": [0, 0, 150]},
        limits={"acceleration": 800, "jerk": 4000},
    )
    times = np.linspace(0, tool.trajectory.duration, 9).tolist()
    of_tool, of_payload = rows(tool, times, "tau"), rows(attached, times, "tau")
    np.testing.assert_allclose(of_tool, of_payload, rtol=1e-12, atol=1e-12)
    bare = planned(move, tool={"xyz": [0, 0, 150]}, limits={"acceleration": 800, "jerk": 4000})
    assert np.abs(of_tool - rows(bare, times, "tau")).max() > 1.0


def test_an_attached_payload_keeps_its_place_on_the_flange() -> None:
    move = {"planner": "quintic", "to": {"joints": [40, -60, 70, 10, 60, 90]}, "duration": 2}
    load = {"attach": {"mass": 2, "com": [10, 20, 30], "inertia": [0.02, 0.03, 0.04, 0.001, 0.002, 0.003]}}
    kept = planned(load, move, tool={"xyz": [0, 0, 150]})
    bent = {key: BENT[key] for key in ("xyz", "rpy")}
    changed = planned(load, {"tool": "x"}, move, tool={"xyz": [0, 0, 150]}, tools={"x": bent})
    times = np.linspace(0, 2, 9).tolist()
    np.testing.assert_allclose(rows(kept, times, "tau"), rows(changed, times, "tau"), atol=1e-9)


def test_moves_that_are_written_once_are_planned_anew_for_another_tool() -> None:
    away = {"planner": "jerk_limited", "to": {"xyz": [400, 100, 300], "rpy": [180, 0, 0]}}
    home = {"planner": "jerk_limited", "to": HEAD["start"]}
    sequence = {"there": [away, home]}
    call, limits = {"call": "there"}, {"acceleration": 800, "jerk": 4000}
    plan = planned(call, {"tool": "bent"}, call, tool="long", sequences=sequence, limits=limits)
    ends = [plan.moves[k].planned.end.position for k in (0, 3)]
    for end, tool in zip(ends, (LONG_POSE, BENT_POSE), strict=True):
        np.testing.assert_allclose((flange(plan.loaded.robot, end) @ tool)[:3, 3], [0.4, 0.1, 0.3], atol=1e-9)


def test_a_point_given_by_joints_is_relative_to_the_tool_in_force() -> None:
    taught = {"taught": {"joints": [10, -80, 85, 5, 80, 10]}}
    there = {"planner": "jerk_limited", "to": {"from": "taught", "offset": {"xyz": [0, 0, -40]}}}
    limits = {"acceleration": 800, "jerk": 4000}
    plan = planned(there, {"tool": "bent"}, there, tool="long", points=taught, limits=limits)
    q = np.radians(taught["taught"]["joints"])
    for index, tool in ((0, LONG_POSE), (2, BENT_POSE)):
        wanted = flange(plan.loaded.robot, q) @ tool @ np.array([0, 0, -0.04, 1])
        got = flange(plan.loaded.robot, plan.moves[index].planned.end.position) @ tool
        np.testing.assert_allclose(got[:3, 3], wanted[:3], atol=1e-9)


def test_limits_of_the_tool_are_of_the_one_in_force() -> None:
    turn = {"planner": "quintic", "to": {"joints_by": {"wrist_3_joint": 90}}, "duration": 1}
    back = {"planner": "quintic", "to": HEAD["start"], "duration": 1}
    job = {**HEAD, "tools": {"arm": {"xyz": [300, 0, 0]}}, "tool": {}}
    job |= {"limits": {"acceleration": 2000, "tcp": {"speed": 400}}, "moves": [turn, {"tool": "arm"}, back]}
    (finding,) = plan_job(job_from_text(json.dumps(job))).verdict.findings
    assert finding.kind == "tool_speed"
    assert finding.move == 2
    # 90 deg within 1 s by a quintic: 15/8 of the mean rate, at 0.3 m from the axis
    assert finding.value == pytest.approx(15 / 8 * np.pi / 2 * 0.3)


def test_a_job_with_tools_is_resolved_to_the_same_rows() -> None:
    plan = planned(*CHANGE, tool="long")
    again = plan_job(job_from_text(dump_job(plan.loaded)))
    times = np.linspace(0, 3, 40).tolist()
    first, second = (rows(p, times, "q", "qd", "pose", "tau") for p in (plan, again))
    assert first.tobytes() == second.tobytes()


def test_tools_are_in_reports_titles_and_explanations() -> None:
    plan = planned(*CHANGE, tool="long")
    report = report_of(plan)
    assert [move.mounted.name for move in report.moves if move.mounted] == ["long"] + ["bent"] * 2 + [
        "long"
    ] * 2
    assert report.moves[1].mounted is not None
    assert report.moves[1].mounted.load is not None
    assert report.moves[1].mounted.load.mass == 1.5
    assert report.moves[1].duration == 0
    assert plan.loaded.called(1) == "move 1, bent (tool)"
    explained = explanation(plan).moves[1]
    assert explained.mounted is not None
    assert explained.mounted.xyz == pytest.approx([60, -20, 220])
    one = planned(line(0, 0, 50), tool={"xyz": [0, 0, 150]}, tools={})
    assert report_of(one).moves[0].mounted is None


@pytest.mark.full
def test_a_zone_before_a_tool_change_is_a_stop() -> None:
    limits = {"acceleration": 800, "jerk": 4000, "tcp": {"speed": 250, "acceleration": 2000}}
    law = {"shape": "time_optimal"}
    plan = planned(
        line(0, 0, 50, law=law), {"tool": "bent"}, line(0, 0, -50, law=law), zone=10, limits=limits
    )
    assert any("the arm stands for `tool` behind it" in event.message for event in plan.remarks)
    with pytest.raises(TrajcliError, match="the arm stands for `tool` behind it"):
        planned(line(0, 0, 50, law=law, zone=10), {"tool": "bent"}, line(0, 0, -50, law=law), limits=limits)


def test_a_tool_is_not_changed_in_motion() -> None:
    moving = {"joints": [10, -90, 90, 0, 90, 0], "velocity": {"shoulder_pan_joint": 5}}
    stop = {"planner": "quintic", "to": HEAD["start"], "duration": 2}
    with pytest.raises(TrajcliError) as caught:
        planned({"planner": "quintic", "to": moving, "duration": 2}, {"tool": "bent"}, stop)
    (problem,) = caught.value.problems
    assert problem.message.endswith(
        "a tool is changed where the arm stands, and shoulder_pan_joint moves with 5 deg/s"
    )
    assert problem.move == 1
    del moving["velocity"]  # as the hint says
    planned({"planner": "quintic", "to": moving, "duration": 2}, {"tool": "bent"}, stop)
