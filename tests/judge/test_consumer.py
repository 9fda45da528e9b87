"""Findings by the rules of a consumer: the breaches of its rules, in the form of `check`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from trajcli.consumers.judgement import ConsumerJudge, judge_by_profile, load_profile
from trajcli.consumers.rule_check import Surroundings
from trajcli.job.robot import load_robot
from trajcli.judge.motion import Requirements, judge_motion
from trajcli.kinematics.robot import unlimited
from trajcli.streams.recorded_motion import RecordedMotion, Resolution


def at_rest(rows: int, first: int = 1) -> RecordedMotion:
    robot = load_robot("fr3")
    q = np.tile([0.0, -0.3, 0.0, -2.0, 0.0, 1.8, 0.5], (rows, 1))
    zero = np.zeros(7)
    t = (np.arange(rows) + first - 1) * 1e-3
    resolution = Resolution(0.0, zero, zero, zero)
    return RecordedMotion(t, q, None, None, None, None, None, robot.joint_names, resolution, "-", first)


def test_a_breach_is_a_finding() -> None:
    judge = ConsumerJudge("franka-fr3", load_robot("fr3"), at_rest(1).q[0])
    judge.take(at_rest(100))
    second = at_rest(100, 101)
    q = second.q.copy()
    q[5:, 3] -= 0.003
    judge.take(replace(second, q=q))
    findings, notes = judge.result()
    velocity = next(found for found in findings if found.rule == "fr3-velocity")
    assert (velocity.joint, velocity.row, velocity.severity, velocity.kind, velocity.method) == (
        "fr3_joint4",
        106,
        "error",
        "velocity",
        "differences",
    )
    assert abs(velocity.value + 3.0) < 1e-9
    assert abs(velocity.limit + 2.619) < 1e-12
    assert velocity.hint == "make the motion 1.14548 times longer"  # 3 / 2.619, rounded up
    assert notes == (
        "the rule fr3-torque is not judged: the file has no efforts",
        "the rule fr3-torque-rate is not judged: the file has no efforts",
    )


def test_of_a_slide_a_breach_is_in_metres() -> None:
    robot = load_robot("fr3")
    slide = replace(robot.joints[3], type="prismatic")
    judge = ConsumerJudge("franka-fr3", replace(robot, joints=(*robot.joints[:3], slide, *robot.joints[4:])))
    q = at_rest(100).q.copy()
    q[50:, 3:5] -= 0.006
    judge.take(replace(at_rest(100), q=q))
    units = {
        found.joint: found.message.split(" is ")[1].split()[1]
        for found in judge.result()[0]
        if found.rule == "fr3-velocity"
    }
    assert units == {"fr3_joint4": "m/s", "fr3_joint5": "rad/s"}


def test_rest_breaks_no_rule() -> None:
    judge = ConsumerJudge("franka-fr3", load_robot("fr3"), at_rest(1).q[0])
    for first in range(1, 501, 100):
        judge.take(at_rest(100, first))
    assert judge.result()[0] == ()


def cut(rows: RecordedMotion, low: int, high: int) -> RecordedMotion:
    """Return the rows from one to another, as a block of a longer file."""
    part = {name: getattr(rows, name) for name in ("t", "q", "qd", "qdd", "tau")}
    return replace(
        rows,
        first_row=low + 1,
        **{name: None if each is None else each[low:high] for name, each in part.items()},
    )


def broken(profile: str) -> RecordedMotion:
    """Return rows that break rules of a profile, in their first row, their last one, and between."""
    robot, period = load_robot("fr3"), 0.1 if profile == "ros-jtc" else 1e-3
    q = np.tile([0.0, -0.3, 0.0, -2.0, 0.0, 1.8, 0.5], (31, 1))
    qd, tau, fine = np.zeros_like(q), np.full_like(q, np.nan), np.full(7, 0.5e-9)
    q[12, 3] -= 0.01
    q[30, 5] += 0.02
    qd[30, 1] = 0.4
    tau[7, 2] = 500.0
    resolution = Resolution(0.5e-9, fine, fine, fine)
    t = 0.05 + period * np.arange(31)  # the arm has that long to come to the first row
    return RecordedMotion(t, q, qd, np.zeros_like(q), None, tau, None, robot.joint_names, resolution, "-", 1)


@pytest.mark.parametrize("profile", ["ros-jtc", "franka-fr3"])
@pytest.mark.parametrize("named", [True, False])
def test_all_rules_of_a_profile_judge_every_row(profile: str, named: bool) -> None:
    """In blocks of many rows, of one and of none they find what they find in all rows at once, beside arm and start."""
    robot, rows = load_robot("fr3"), broken(profile)
    if not named:
        rows = replace(rows, joints=tuple(f"joint{k}" for k in range(7)))
    start = rows.q[0] + 0.6
    whole = judge_by_profile(
        [rows], load_profile(profile), Surroundings(robot.joint_names, start, robot.limits)
    )
    judge = ConsumerJudge(profile, robot, start)
    for ends in ((0, 1), (1, 12), (12, 13), (13, 13), (13, 30), (30, 31)):
        judge.take(cut(rows, *ends))
    findings, notes = judge.result()
    wanted = [(each.rule, each.joint, each.row, each.value, each.limit) for each in whole.findings]
    assert [(each.rule, each.joint, each.row, each.value, each.limit) for each in findings] == wanted
    assert len(notes) == len(whole.unjudged)
    assert len(findings) > 3
    rules = {each.rule for each in findings}
    if profile == "ros-jtc":
        assert {"jtc-first-point", "jtc-last-velocity", "jtc-effort"} <= rules
        assert ("jtc-joint-names" in rules) is not named
        bare = ConsumerJudge(profile, replace(robot, limits=unlimited(7)), start)
        bare.take(rows)
        assert len(bare.result()[0]) < len(findings)  # no limit says that the way from the start is too short


@pytest.mark.parametrize("row", [5, 350])
@pytest.mark.parametrize("blocks", [3, 100, 400])
def test_a_judgement_says_all_that_the_rules_of_its_consumer_say(blocks: int, row: int) -> None:
    """Of each row, those that are seen before a period shows, too; and what cannot be judged."""
    robot, rows = load_robot("fr3"), at_rest(400)
    rows.q[row:, 3] -= 0.003
    judge = ConsumerJudge("franka-fr3", robot, rows.q[0])
    judge.take(rows)
    findings, notes = judge.result()
    assert "fr3-velocity" in {each.rule for each in findings}
    assert len(notes) == 2
    required = Requirements(
        replace(robot, limits=unlimited(7)),
        consumer=lambda: ConsumerJudge("franka-fr3", robot, rows.q[0]),
    )
    parts = [cut(rows, low, min(low + blocks, 400)) for low in range(0, 400, blocks)]
    judgement = judge_motion(lambda: parts, required)
    told = {(each.rule, each.joint, each.row) for each in judgement.findings}
    assert {(each.rule, each.joint, each.row) for each in findings} <= told
    assert judgement.notes[-2:] == notes
