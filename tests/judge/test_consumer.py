"""Findings by the rules of a consumer: the breaches of its rules, in the form of `check`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from trajcli.job.robot import load_robot
from trajcli.judge.consumer import ConsumerJudge
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


def test_rest_breaks_no_rule() -> None:
    judge = ConsumerJudge("franka-fr3", load_robot("fr3"), at_rest(1).q[0])
    for first in range(1, 501, 100):
        judge.take(at_rest(100, first))
    assert judge.result()[0] == ()
