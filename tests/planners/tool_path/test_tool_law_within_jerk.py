"""The law `time_optimal` of tool paths within limits of jerk, of joints and of the tool."""

from __future__ import annotations

import json

import numpy as np
import pytest
from tiers import few

from trajcli.curves.extrema import peaks
from trajcli.job.read import job_from_text
from trajcli.kinematics.forward import forward
from trajcli.planning.plan import plan_job

START = [0, -1.57, 1.57, -1.57, -1.57, 0]
TURN = {"planner": "line", "to": {"rpy": [3.14, 0, 1.0]}}
ARC = {"planner": "arc", "via": {"xyz": [0.5, 0.0, 0.45]}, "to": {"xyz": [0.45, -0.15, 0.45]}}
CORNER = {
    "planner": "path",
    "segments": [{"line": {"xyz": [0.4, 0.1, 0.45]}}, {"line": {"xyz": [0.4, -0.1, 0.5]}}],
    "corner": "round",
    "radius": 0.02,
}


def fastest(move, limits, **law):
    job = {
        "version": 1,
        "robot": "ur5e",
        "limits": limits,
        "start": {"joints": START},
        "moves": [{**move, "law": {"shape": "time_optimal"} | law}],
    }
    made = plan_job(job_from_text(json.dumps(job)))
    assert made.verdict.passed, made.verdict.findings[0].message
    return made


@pytest.mark.full
@pytest.mark.parametrize("move", [TURN, ARC, CORNER], ids=["turn", "arc", "corner"])
def test_limits_of_the_jerk_of_joints_are_kept_without_steps(move):
    """The verdict judges the jerk for all t, and steps of joints with a limit of jerk."""
    limits = {"acceleration": 10, "jerk": 80}
    made = fastest(move, limits)
    assert made.trajectory.spans[0].continuity == 2
    curve = made.moves[0].planned.curve
    np.testing.assert_allclose(curve.evaluate(np.array([0.0, curve.end]), 2), 0.0, atol=1e-6)
    without = fastest(move, {"acceleration": 10})
    assert without.trajectory.spans[0].continuity == 1
    assert without.trajectory.duration < made.trajectory.duration < 3 * without.trajectory.duration
    assert any(event.kind == "bound" for event in made.remarks)


def test_the_jerk_of_the_tool_along_a_line_is_that_of_ruckig():
    """Far within the limits of joints, the law is the jerk-limited one of the tool."""
    tcp = {"speed": 0.1, "acceleration": 0.5, "jerk": 4.0}
    straight = {"planner": "line", "to": {"xyz": [0.45, 0.0, 0.5]}}
    made = fastest(straight, {"acceleration": 20, "tcp": tcp})
    reference = fastest(straight, {"acceleration": 20, "tcp": tcp}, shape="jerk_limited").trajectory.duration
    assert reference * (1 - 1e-9) <= made.trajectory.duration <= 1.002 * reference
    (jerk,) = peaks(made.moves[0].planned.tool.law, (3,))
    assert jerk.magnitude[0] <= 4.0 * (1 + 1e-9)


@pytest.mark.full
def test_a_law_may_name_a_lower_jerk():
    limits = {"acceleration": 10, "tcp": {"speed": 0.25, "acceleration": 2.0, "jerk": 20.0}}
    slower, faster = (fastest(ARC, limits, jerk=jerk).trajectory.duration for jerk in (5.0, 20.0))
    assert slower > 1.01 * faster


GANTRY = {
    "convention": "standard",
    "base": {"rpy": [0, 90, 0]},
    "joints": [
        {"type": "prismatic", "alpha": -90},
        {"type": "prismatic", "theta": -90, "alpha": -90},
        {"type": "prismatic"},
    ],
}


@pytest.mark.full
@pytest.mark.parametrize("own", few([{}, {"jerk": 100}], 1))
def test_a_circle_is_cruised_at_the_speed_whose_jerk_is_the_limit(own):
    """On a circle of radius r the acceleration v^2 / r turns with v / r: a jerk of v^3 / r^2."""
    radius, jerk, durations = 0.2, 5.0, []
    for turns in (1, 2):
        arc = {"planner": "arc", "center": [radius, 0, 0], "axis": "z", "angle": 360 * turns}
        job = {
            "version": 1,
            "units": {"angle": "deg"},
            "robot": GANTRY,
            "limits": {"velocity": 10, "acceleration": 100, **own, "tcp": {"jerk": jerk}},
            "start": {"joints": [0, 0, 0]},
            "moves": [arc | {"law": {"shape": "time_optimal"}}],
        }
        made = plan_job(job_from_text(json.dumps(job)))
        assert made.verdict.passed
        assert not made.events  # it is not stretched as a whole
        durations.append(made.trajectory.duration)
    cruise = (jerk * radius**2) ** (1 / 3)
    assert durations[1] - durations[0] == pytest.approx(2 * np.pi * radius / cruise, rel=5e-3)


@pytest.mark.full
def test_the_jerk_of_the_tool_around_a_rounded_corner_is_used_and_kept():
    """Third differences of the positions at 1 kHz: most of the motion is within 10 % of the limit."""
    made = fastest(CORNER, {"acceleration": 20, "tcp": {"jerk": 10.0}})
    t = np.arange(0.0, made.trajectory.duration, 1e-3)
    positions = forward(made.loaded.robot, made.trajectory.curve.evaluate(t))[:, :3, 3]
    sizes = np.linalg.norm(np.diff(positions, 3, axis=0), axis=1) / 1e-9
    assert sizes.max() < 10.0 * 1.001
    assert np.mean(sizes > 9.0) > 0.7


@pytest.mark.full
def test_a_corner_between_the_samples_of_a_long_path_bends_it():
    """It counted as straight: the limit of the jerk was kept by stretching the whole move three times."""
    steps = ([0.0, 0.0, 0.111], [0.0, 0.1, 0.111])
    lines = [{"line": {"from": "here", "offset": {"xyz": step}, "frame": "world"}} for step in steps]
    corner = {**CORNER, "segments": lines, "radius": 0.001}
    made = fastest(corner, {"acceleration": 8, "tcp": {"speed": 0.5, "acceleration": 2, "jerk": 20.0}})
    assert "stretched" not in [event.kind for event in made.events]
