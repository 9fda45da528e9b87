"""jerk_limited from a start outside its limits: brought inside first, judged for all but that interval."""

from __future__ import annotations

import numpy as np
import pytest
from jerk_limited_moves import arm, misses, move_to, ruckigs_own, state
from tiers import few

from trajcli.checks.verify import verify
from trajcli.job.read import job_from_text
from trajcli.planners.planner import PlannedMove
from trajcli.planning.plan import plan_job

_RUCKIG_FIRST_EXAMPLE = """\
version: 1
robot: {name: r, joints: [
  {velocity: 3, acceleration: 3, jerk: 4}, {velocity: 1, acceleration: 2, jerk: 3},
  {velocity: 3, acceleration: 1, jerk: 2}]}
start: {joints: [0, 0, 0.5], velocity: [0, -2.2, -0.5], acceleration: [0, 2.5, -0.5]}
moves:
  - planner: jerk_limited
    to: {joints: [5, -2, -3.5], velocity: [0, -0.5, -2], acceleration: [0, 0, 0.5]}
"""
_BRAKE = _RUCKIG_FIRST_EXAMPLE.replace("jerk_limited\n", "jerk_limited\n    brake: true\n")


def test_ruckigs_first_example_lasts_as_long_as_ruckig_says():
    plan = plan_job(job_from_text(_BRAKE))
    move = plan.moves[0]
    own = ruckigs_own(move.start, move.planned.end, move.robot)
    assert plan.verdict.passed
    assert plan.trajectory.duration == pytest.approx(own.duration, rel=1e-9)
    for t in np.linspace(0, own.duration, 50):
        rows = [plan.trajectory.curve.evaluate(min(t, plan.trajectory.duration), k) for k in range(3)]
        np.testing.assert_allclose(rows, own.at_time(t), atol=1e-7)
    assert [event.kind for event in plan.events] == ["braked", "braked"]
    assert "j2 starts with velocity -2.2 rad/s, beyond its limit -1 rad/s" in plan.events[0].message
    assert "j2 starts with acceleration 2.5 rad/s^2, beyond its limit 2 rad/s^2" in plan.events[1].message


def test_plain_move_stays_refused_and_says_what_to_add():
    verdict = plan_job(job_from_text(_RUCKIG_FIRST_EXAMPLE)).verdict
    assert {finding.kind for finding in verdict.findings} == {"velocity", "acceleration"}
    assert all("`brake: true`" in finding.hint for finding in verdict.findings)


def test_start_within_its_limits_brakes_nothing():
    plan = plan_job(job_from_text(_BRAKE.replace("-2.2", "-0.2").replace("2.5", "0.5")))
    assert plan.verdict.passed
    assert plan.moves[0].planned.braking is None
    assert not plan.events


def _outside(seed, n):
    rng = np.random.default_rng(seed)
    velocity, acceleration = 10 ** rng.uniform(-1, 1, n), 10 ** rng.uniform(-0.5, 1.5, n)
    robot = arm(velocity, acceleration, 10 ** rng.uniform(0, 3, n))
    start = state(
        rng.normal(size=n), rng.uniform(-2.5, 2.5, n) * velocity, rng.uniform(-2, 2, n) * acceleration
    )
    return start, state(rng.normal(size=n) * 3), robot


def _judged(planner, start, robot):
    planned = planner.plan(start, robot)
    move = PlannedMove(0, planner, start, robot, planned)
    return planned, verify(move.alone(), [robot.limits], [move.promise])


@pytest.mark.parametrize("seed", few(range(40)))
@pytest.mark.parametrize("fields", [{}, {"synchronize": "none"}, {"minimum_duration": 30.0}])
def test_random_starts_outside_verify(seed, fields):
    start, end, robot = _outside(seed, 3)
    planned, verdict = _judged(move_to(end, brake=True, **fields), start, robot)
    assert [finding.text() for finding in verdict.findings] == []
    assert misses(planned.curve, start, end, 1e-9) == []


@pytest.mark.parametrize("seed", few(range(40)))
def test_random_starts_outside_to_a_velocity(seed):
    start, end, robot = _outside(seed, 2)
    planned, verdict = _judged(move_to(end, joints=False, brake=True), start, robot)
    assert [finding.text() for finding in verdict.findings] == []
    np.testing.assert_allclose(planned.curve.piece_ends(1)[1][-1], 0.0, atol=1e-9)


@pytest.mark.parametrize("seed", few(range(40)))
def test_random_starts_outside_on_one_line(seed):
    rng = np.random.default_rng(seed)
    _, _, robot = _outside(seed, 3)
    direction = rng.normal(size=3)
    rate = 2.0 / np.abs(direction / robot.limits.velocity[:, 1]).max()
    push = rng.uniform(-2, 2) / np.abs(direction / robot.limits.acceleration[:, 1]).max()
    start, end = state(np.zeros(3), direction * rate, direction * push), state(direction * 9)
    planned, verdict = _judged(move_to(end, synchronize="phase", brake=True), start, robot)
    assert [finding.text() for finding in verdict.findings] == []
    on_line = planned.curve.evaluate(np.linspace(0, planned.curve.duration, 40))
    np.testing.assert_allclose(np.cross(on_line, direction), 0.0, atol=1e-8 * np.abs(on_line).max())


def test_start_that_cannot_help_to_exceed_its_limit():
    """The acceleration alone, brought to zero by the jerk, adds its square over twice the jerk: 1.5^2 / 6."""
    plan = plan_job(job_from_text(_BRAKE.replace("-2.2", "-0.9").replace("2.5", "-1.5")))
    assert plan.verdict.passed
    assert "j2 cannot but reach velocity -1.275 rad/s, beyond its limit -1 rad/s" in plan.events[0].message


def test_jerk_limit_by_direction():
    plan = plan_job(job_from_text(_BRAKE.replace("jerk: 3", "jerk: [-3, 9]")))
    assert plan.verdict.passed
    assert "braked" in [event.kind for event in plan.events]


def test_braking_in_a_later_move_and_slowed_for_the_tool():
    text = _BRAKE.replace(
        "moves:\n", "moves:\n  - {planner: jerk_limited, to: {velocity: [0, -0.9, 0]}, brake: true}\n"
    )
    text = text.replace(
        "    brake: true\n",
        "    brake: true\n    limits: {velocity: [3, 0.8, 3]}\n    when_over_limit: slow\n",
    )
    plan = plan_job(job_from_text(text))
    assert plan.verdict.passed
    assert [event.move for event in plan.events if event.kind == "braked"] == [0, 0, 1]


@pytest.mark.parametrize("synchronize", ["time", "phase"])
@pytest.mark.parametrize("sign", [1, -1])
def test_each_joint_says_until_when_it_brakes(sign, synchronize):
    """By then its velocity is within its limit, and shortly before it is not, whatever the other joint does."""
    robot = arm([1.0, 1.0], [2.0, 2.0], [[-9.0, 30.0], [-9.0, 30.0]])
    speeds = np.array([1.4, 1.4 if synchronize == "phase" else 2.0]) * sign
    target = state(np.array([5.0, 5.0]) * sign)
    planned = move_to(target, brake=True, synchronize=synchronize).plan(state([0.0, 0.0], speeds), robot)
    kinds = [event.kind for event in planned.events]
    assert kinds.count("braked") == 2
    assert set(kinds) == {"braked", "jerk_limit_both_ways"}  # what else there is to say is not lost
    for joint, event in enumerate(event for event in planned.events if event.kind == "braked"):
        time, limit = event.amounts["time"].value, event.amounts["limit"].value
        assert limit == sign
        assert 0.0 < time < 2.0
        at, before = (abs(float(planned.curve.evaluate(t, 1)[joint])) for t in (time, 0.95 * time))
        assert at <= 1.0 + 1e-9 < before
