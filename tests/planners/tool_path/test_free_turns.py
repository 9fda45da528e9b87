"""Turns that a target leaves free, under limits of the tool's angular speed: known to the law, not only judged."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from tiers import few
from tool_jobs import LEFT, planned

from trajcli.kinematics.following.follower import Follower
from trajcli.kinematics.jacobian import tcp_twist

LIMITS = {"velocity": 50.0, "acceleration": 2000.0, "jerk": None}
START = {"xyz": [0.4, 0.1, 0.05], "rpy": [np.pi, 0, 0], "configuration": LEFT}
SHAPES = ["trapezoid", "quintic", "cycloidal", "time_optimal"]


def turning(made):
    """Return the largest angular speed of the tool at many times, rad/s."""
    curve = made.trajectory.curve
    t = np.linspace(0, curve.end, 4001)
    twist = tcp_twist(made.moves[0].robot, curve.evaluate(t), curve.evaluate(t, 1))
    return float(np.linalg.norm(twist[:, 3:], axis=1).max())


@pytest.mark.full
@pytest.mark.parametrize("shape", few(SHAPES, 4))
@pytest.mark.parametrize(
    "free",
    [{"direction": [0, 0, -1]}, {"yaw": 0.0, "tool_axis": "x"}, {"pitch": 0.3, "tool_axis": "x"}],
    ids=["direction", "yaw", "pitch"],
)
def test_law_keeps_the_angular_speed_of_a_turn_that_the_target_leaves_free(shape, free):
    tcp = {"speed": 5.0, "acceleration": 100.0, "angular_speed": 0.3, "angular_acceleration": 3.0}
    move = {"planner": "line", "to": {"xyz": [0.1, 0.5, 0.25], **free}, "law": {"shape": shape}}
    made = planned("ur5e", START, move, limits={**LIMITS, "tcp": tcp})
    assert not made.verdict.findings
    assert turning(made) <= 0.3 * (1 + 1e-6)


@pytest.mark.parametrize("shape", ["trapezoid", "time_optimal"])
def test_free_orientation_of_a_small_arm(shape):
    """A planar arm whose targets are points turns as its geometry has it."""
    joint = {"a": 0.5}
    robot = {"name": "planar", "convention": "standard", "joints": [joint, joint]}
    tcp = {"speed": 5.0, "acceleration": 100.0, "angular_speed": 0.5, "angular_acceleration": 5.0}
    move = {"planner": "line", "to": {"xyz": [0.1, 0.6, 0]}, "law": {"shape": shape}}
    made = planned(robot, {"joints": [0.1, 0.8]}, move, limits={**LIMITS, "tcp": tcp})
    assert not made.verdict.findings
    assert 0.4 < turning(made) <= 0.5 * (1 + 1e-6)


@cache
def small_arm(limit):
    """Return the plan of a time-optimal line of a planar arm with one limit of turning."""
    robot = {"name": "planar", "convention": "standard", "joints": [{"a": 0.5}, {"a": 0.5}]}
    move = {"planner": "line", "to": {"xyz": [0.1, 0.6, 0]}, "law": {"shape": "time_optimal"}}
    return planned(robot, {"joints": [0.1, 0.8]}, move, limits={**LIMITS, "tcp": {limit: 0.4}})


@pytest.mark.parametrize("limit", ["angular_speed", "angular_acceleration"])
def test_one_limit_of_turning_is_enough_for_a_free_turn_to_count(limit):
    """A time-optimal law uses all of it, and 0.6 of an acceleration that is not along its axis alone."""
    made = small_arm(limit)
    assert not made.verdict.findings
    times = np.linspace(0, made.trajectory.duration, 5001)
    rates = made.trajectory.curve.evaluate(times, 1 if limit == "angular_speed" else 2)
    assert 0.5 * 0.4 < np.abs(rates.sum(axis=1)).max() <= 0.4 * (1 + 1e-6)


def test_a_free_turn_uses_its_angular_acceleration_all_the_way():
    """Along the line the arm turns one way: it speeds up over half of the turn, and slows down over the other."""
    curve = small_arm("angular_acceleration").trajectory.curve
    turns = curve.evaluate(np.linspace(0, curve.end, 2001)).sum(axis=1)
    assert (np.diff(turns) >= 0).all()
    assert curve.duration == pytest.approx(2 * np.sqrt((turns[-1] - turns[0]) / 0.4), rel=1e-2)


def test_joints_are_not_found_anew_for_a_turn_that_nothing_limits(monkeypatch):
    """Laws ask for rows at thousands of places; each would take steps of Newton."""
    asked = []
    found = Follower.joint_state
    monkeypatch.setattr(Follower, "joint_state", lambda *args: asked.append(args) or found(*args))
    move = {"planner": "line", "to": {"xyz": [0.1, 0.6, 0]}, "law": {"shape": "time_optimal"}}
    robot = {"name": "planar", "convention": "standard", "joints": [{"a": 0.5}, {"a": 0.5}]}
    counts = []
    for tcp in ({"speed": 0.4}, {"speed": 0.4, "angular_speed": 1e6}):
        asked.clear()
        planned(robot, {"joints": [0.1, 0.8]}, move, limits={**LIMITS, "tcp": tcp})
        counts.append(len(asked))
    assert 2 * counts[0] < counts[1]


def test_without_a_limit_of_turning_the_law_is_that_of_the_position():
    tcp = {"speed": 0.1, "acceleration": 2.0}
    move = {"planner": "line", "to": {"xyz": [0.4, 0.3, 0.05], "direction": [0, 0, -1]}}
    made = planned("ur5e", START, move, limits={**LIMITS, "tcp": tcp})
    assert made.trajectory.duration == pytest.approx(0.2 / 0.1 + 0.1 / 2.0, rel=1e-9)


@pytest.mark.parametrize("shape", ["trapezoid", "time_optimal"])
def test_even_turn_has_the_whole_angular_acceleration(shape):
    """A yaw that is imposed turns a planar arm evenly: at the middle of a triangle half of the turn is done."""
    joint = {"a": 0.5}
    robot = {"name": "planar", "convention": "standard", "joints": [joint, joint, {"a": 0.1}]}
    tcp = {"speed": 50.0, "acceleration": 1000.0, "angular_speed": 50.0, "angular_acceleration": 0.5}
    start = {"xyz": [0.6, 0.1, 0], "yaw": 0.0, "tool_axis": "x", "configuration": {"elbow": "up"}}
    to = {"xyz": [0.4, 0.4, 0], "yaw": 1.0, "tool_axis": "x"}
    move = {"planner": "line", "to": to, "law": {"shape": shape}}
    made = planned(robot, start, move, limits={**LIMITS, "tcp": tcp})
    assert not made.verdict.findings
    assert made.trajectory.duration == pytest.approx(2 * (1.0 / 0.5) ** 0.5, rel=2e-3)
