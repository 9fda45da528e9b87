"""How fast a tool goes: laws, limits of the tool at the job and at the move, slowing down."""

from __future__ import annotations

import numpy as np
import pytest
from tool_jobs import (
    DOWN,
    LENGTH,
    LIMITS,
    SHAPES,
    START,
    TCP,
    TO,
    line,
    peaks_of,
    plan,
    planned,
    poses_of,
    refusal,
    times_of,
    tool_rates,
)


@pytest.mark.parametrize("shape", SHAPES)
def test_the_fastest_law_of_each_shape(shape):
    tcp = TCP | ({"jerk": 25.0} if shape == "jerk_limited" else {})
    to = {"xyz": TO["xyz"], "rpy": DOWN}
    made = plan("ur5e", START, line(to, law={"shape": shape}), limits={**LIMITS, "tcp": tcp})
    assert made.trajectory.duration == pytest.approx(peaks_of(shape, LENGTH, tcp), rel=2e-3)
    speed, spin, acceleration, _ = tool_rates(made, times_of(made, 1001))
    assert speed.max() <= TCP["speed"] * (1 + 1e-5)
    assert acceleration.max() <= TCP["acceleration"] * (1 + 1e-5)
    assert max(speed.max() / TCP["speed"], acceleration.max() / TCP["acceleration"]) > 0.99
    assert spin.max() < 1e-5
    offsets = poses_of(made, times_of(made))[:, :3, 3] - START["xyz"]
    along = np.array([0, 1, 1]) / np.sqrt(2)
    assert np.linalg.norm(np.cross(offsets, along), axis=1).max() < 1e-6
    assert (np.diff(offsets @ along) > -1e-9).all()


@pytest.mark.parametrize("shape", SHAPES)
def test_the_fastest_law_of_a_short_way_is_ruled_by_acceleration(shape):
    law = {"shape": shape} | ({"jerk": 1e4} if shape == "jerk_limited" else {})
    made = plan("ur5e", START, line({"xyz": [0.4, 0.105, 0.05], "rpy": DOWN}, law=law))
    wanted = peaks_of("trapezoid" if shape == "jerk_limited" else shape, 0.005)
    assert made.trajectory.duration == pytest.approx(wanted, rel=5e-3)
    acceleration = tool_rates(made, times_of(made, 1001))[2]
    assert acceleration.max() == pytest.approx(TCP["acceleration"], rel=1e-3)


@pytest.mark.parametrize("shape", ["trapezoid", "cubic", "quintic", "cycloidal"])
def test_a_duration_is_kept(shape):
    made = plan("ur5e", START, line(law={"shape": shape, "duration": 3.0}))
    assert made.trajectory.duration == 3.0
    middle = poses_of(made, np.array([1.5]))[0, :3, 3]
    np.testing.assert_allclose(middle, [0.4, 0.2, 0.15], atol=2e-6)


@pytest.mark.full
@pytest.mark.parametrize("shape", SHAPES)
def test_a_minimum_duration_is_no_less(shape):
    jerk = {"jerk": 25.0} if shape == "jerk_limited" else {}
    made = plan("ur5e", START, line(law={"shape": shape, "minimum_duration": 4.0, **jerk}))
    assert made.trajectory.duration == pytest.approx(4.0, rel=1e-12)
    short = plan("ur5e", START, line(law={"shape": shape, "minimum_duration": 0.01, **jerk}))
    assert short.trajectory.duration > 1.0


def test_a_law_names_its_own_speeds():
    law = {"speed": 0.1, "acceleration": 0.5, "deceleration": 0.25}
    made = plan("ur5e", START, line({"xyz": TO["xyz"], "rpy": DOWN}, law=law))
    assert made.trajectory.duration == pytest.approx(LENGTH / 0.1 + 0.1 / 2 * (1 / 0.5 + 1 / 0.25), rel=1e-9)
    names = [phase.name for phase in made.moves[0].planned.phases]
    assert len(names) == 3
    speed = tool_rates(made, np.array([made.trajectory.duration / 2]))[0]
    assert speed == pytest.approx(0.1, rel=1e-6)


def test_the_slower_of_translation_and_rotation_rules():
    near = {"xyz": [0.4, 0.12, 0.05], "rpy": [np.pi, 0, 0.8]}
    slow = plan("ur5e", START, line(near))
    assert slow.moves[0].planned.tool.ruled_by == "rotation"
    assert slow.trajectory.duration == pytest.approx(0.8 / 1.5 + 1.5 / 12, rel=1e-9)
    assert tool_rates(slow, times_of(slow))[1].max() == pytest.approx(1.5, rel=1e-5)
    assert plan("ur5e", START, line(TO)).moves[0].planned.tool.ruled_by == "translation"


def test_a_move_over_a_joints_limit_is_judged_and_slowed():
    fast = line(law={"shape": "quintic", "duration": 0.05})
    made = planned("ur5e", START, fast, limits={"acceleration": 14}, advise=False)
    assert {finding.kind for finding in made.verdict.findings} >= {"acceleration", "velocity"}
    slow = plan("ur5e", START, {**fast, "when_over_limit": "slow"}, limits={"acceleration": 14})
    peak = np.abs(slow.trajectory.curve.evaluate(times_of(slow, 4001), 2)).max()
    assert 13.5 < peak <= 14 * (1 + 1e-9)
    assert "slowed" in {event.kind for event in slow.events}
    law = slow.moves[0].planned.tool.law
    assert law.duration == pytest.approx(slow.trajectory.duration, rel=1e-12)


def test_a_slower_move_keeps_the_tools_limits_too():
    fast = line({"xyz": TO["xyz"], "rpy": DOWN}, law={"shape": "cubic", "duration": 0.5})
    made = planned("ur5e", START, fast, advise=False)
    assert {finding.kind for finding in made.verdict.findings} >= {"tool_speed", "tool_acceleration"}
    slow = plan("ur5e", START, {**fast, "when_over_limit": "slow"})
    assert slow.trajectory.duration == pytest.approx(peaks_of("cubic", LENGTH), rel=1e-3)


def test_align_stretches_to_whole_periods():
    made = plan("ur5e", START, line(), output={"rate": 100, "align": True})
    ticks = made.trajectory.duration * 100
    assert ticks == pytest.approx(round(ticks), abs=1e-9)
    assert made.moves[0].planned.tool.law.duration == pytest.approx(made.trajectory.duration, rel=1e-12)


def test_limits_of_a_move_are_tighter():
    to = {"xyz": TO["xyz"], "rpy": DOWN}
    slower = plan("ur5e", START, line(to, limits={"tcp": {"speed": 0.1}}))
    assert slower.trajectory.duration == pytest.approx(LENGTH / 0.1 + 0.1 / 2, rel=1e-9)
    for name in TCP:
        error = refusal("ur5e", START, line(to, limits={"tcp": {name: TCP[name] * 2}}))
        assert error.exit_code == 2
        assert "can only tighten" in str(error)
        assert name.replace("_", " ") in str(error)
    assert plan("ur5e", START, line(to, limits={"tcp": dict(TCP)})).verdict.passed


def test_limits_are_scaled():
    to = {"xyz": TO["xyz"], "rpy": DOWN}
    scaled = {**LIMITS, "scale": {"velocity": 0.5, "acceleration": 0.25}}
    made = plan("ur5e", START, line(to), limits=scaled)
    assert made.trajectory.duration == pytest.approx(LENGTH / 0.125 + 0.125 / 0.5, rel=1e-9)
