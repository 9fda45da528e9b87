"""Rows of plans by the rules of their consumers: no false alarm over random motions, whatever the format."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from tiers import few

import trajcli
from trajcli.consumers.judgement import load_profile
from trajcli.output.consumer import consumer_report, judge_as_written, refusal_of
from trajcli.output.write import grid_of
from trajcli.streams.formats import FORMATS, FormatName

SETTINGS: dict[str, dict[str, Any]] = {
    "franka-fr3": {"robot": "fr3", "output": {"rate": 1000, "align": True}},
    "franka-fer": {"robot": "panda", "output": {"rate": 1000, "align": True}},
    "ur-servoj": {"robot": "ur5e", "output": {"rate": 500, "align": True}},
    "ros-jtc": {"robot": "fr3", "output": {"rate": 50}},
}


def random_plan(profile: str, seed: int) -> trajcli.Plan:
    """Return random moves from rest to rest well inside the ranges, a little below the limits."""
    rng = np.random.default_rng(seed)
    setting = SETTINGS[profile]
    robot = trajcli.load_robot(setting["robot"])
    low, high = np.clip(robot.limits.position, -2.5, 2.5).T
    middle, half = (low + high) / 2, 0.6 * (high - low) / 2
    states = [(middle + 0.3 * half * rng.uniform(-1, 1, low.size)).tolist() for _ in range(4)]
    limits: dict[str, Any] = {"scale": {"velocity": 0.97, "acceleration": 0.99, "jerk": 0.99}}
    if setting["robot"] == "ur5e":
        limits = {"acceleration": 5, "jerk": 50}
    moves = [{"planner": rng.choice(["jerk_limited", "quintic"]), "to": {"joints": q}} for q in states[1:]]
    moves = [{**move, "planner": str(move["planner"])} for move in moves]
    return trajcli.plan(
        {"version": 1, "limits": limits, "start": {"joints": states[0]}, "moves": moves, **setting}
    )


@pytest.mark.parametrize("profile", few(list(SETTINGS), 4))
@pytest.mark.parametrize("seed", few(range(4), 1))
def test_random_motions_give_no_false_alarm(profile: str, seed: int) -> None:
    plan = random_plan(profile, seed)
    assert plan.verdict.passed
    forms: tuple[FormatName, ...] = ("ros",) if profile == "ros-jtc" else ("csv", "mcap", "jsonl")
    for form in forms:
        judged = judge_as_written(plan, grid_of(plan), load_profile(profile), FORMATS[form])
        assert judged.findings == (), form
        assert refusal_of(plan, judged, strict=True) is None


def test_decimals_are_those_of_the_file() -> None:
    """The same rows with nine decimals and with every bit: third differences that rounding makes differ."""
    plan = random_plan("franka-fr3", 5)
    profile = load_profile("franka-fr3")
    tight = next(rule for rule in profile.rules if rule.id == "fr3-decimals")
    assert tight.parameters["share"] * 5000 > 4
    from dataclasses import replace

    strict = replace(profile, rules=(replace(tight, parameters={**tight.parameters, "share": 1e-4}),))
    rounded = judge_as_written(plan, grid_of(plan), strict, FORMATS["csv"])
    exact = judge_as_written(plan, grid_of(plan), strict, FORMATS["csv"], digits="full")
    assert [found.kind for found in rounded.findings] == ["quantisation"]
    assert rounded.findings[0].value == pytest.approx(4.0)  # 8 times half of 1e-9, over 1e-9 s^3
    assert exact.findings == ()


@pytest.mark.parametrize("form", ["csv", "mcap", "npz", "ros", "ros-goal"])
@pytest.mark.parametrize("start_time", [0.0, 1.5, 7.0])
def test_what_breaks_a_rule_is_in_its_move_whenever_the_rows_begin(
    form: FormatName, start_time: float
) -> None:
    """The last velocity is that of the last move, at the end of the motion; a goal counts its times from 0."""
    moves = [
        {"planner": "quintic", "to": {"joints": [1.0]}, "duration": 1},
        {"planner": "quintic", "to": {"joints": [2.0], "velocity": [0.5]}, "duration": 1},
    ]
    output = {"columns": ["t", "q", "qd", "qdd"], "rate": 50, "start_time": start_time}
    plan = trajcli.plan(
        {"version": 1, "robot": {"joints": 1}, "start": {"joints": [0]}, "moves": moves, "output": output}
    )
    judged = judge_as_written(plan, grid_of(plan), load_profile("ros-jtc"), FORMATS[form])
    refused = refusal_of(plan, judged, strict=False)
    assert refused is not None
    (problem,) = refused.problems
    assert (problem.move, problem.kind) == (1, "jtc-last-velocity")
    assert problem.time == pytest.approx(2.0)
    (found,) = consumer_report(plan, judged).findings
    assert (found.move, found.time) == (1, pytest.approx(2.0))
