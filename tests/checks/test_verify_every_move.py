"""What holds for one of several moves, states or findings holds for each, wherever it stands among them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from trajcli.checks.verify import longest_factor, verify
from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.findings import Finding
from trajcli.job.robot import load_robot
from trajcli.kinematics.robot import Limits
from trajcli.limits.kinds import TOOL_KINDS
from trajcli.limits.tool import FAMILY, ToolStep, ToolSurvey
from trajcli.trajectory import Promise, Span, State, Trajectory

FREE = np.tile([-np.inf, np.inf], (1, 1))
UR5E = load_robot("ur5e")


@pytest.mark.parametrize("factors", [(1.5, 2.0), (2.0, 1.5), (None, 2.0), (2.0, None)])
def test_the_longest_of_all_factors_helps_all(factors):
    findings = [
        Finding(kind="velocity", joint="a", value=2.0, limit=1.0, time=0.0, factor=factor, message="fast")
        for factor in factors
    ]
    assert longest_factor(findings) == pytest.approx(2.0, rel=1e-6)


def test_a_move_that_brakes_is_excused_whatever_those_beside_do():
    """From 3 rad/s with jerk 4 and 2 rad/s^2 to its limit of 1 rad/s after 1.25 s, then to rest in another move."""
    rows = [[-4.0 / 6, 0.0, 3.0, 0.0], [0.0, -1.0, 2.5, 1.5 - 0.25 / 3], [4.0 / 6, -1.0, 1.0, 0.0]]
    rows[2][3] = rows[1][3] + 2.5 * 0.75 - 0.75**2
    breaks = np.array([0.0, 0.5, 1.25, 1.75])
    curve = PiecewisePolynomial(breaks, np.array(rows).T[:, :, None])
    end = State(*(curve.evaluate(np.array([1.75]), order)[0] for order in range(3)))
    start = State(*(curve.evaluate(np.array([0.0]), order)[0] for order in range(3)))
    spans = Span(0, "jerk_limited", 0.0, 1.25, 2), Span(1, "jerk_limited", 1.25, 1.75, 2)
    trajectory = Trajectory(curve, ("a",), ("revolute",), spans, start, end)
    limits = Limits(FREE, *(np.array([[-size, size]]) for size in (1.0, 2.0, 4.0)))
    for braking, kinds in (("each", set()), (None, {"velocity"})):
        found = verify(trajectory, [limits] * 2, [Promise(braking=braking), Promise()]).findings
        assert {finding.kind for finding in found} == kinds


@pytest.mark.parametrize("last", [False, True])
@pytest.mark.parametrize(("joint", "over"), [(0, "speed"), (5, "angular_speed"), (0, None)])
def test_a_tool_that_is_too_fast_at_either_end_of_a_move(joint, over, last):
    """The first joint moves the tool, the last one turns it where it is."""
    tcp = replace(UR5E.limits.tcp, **({} if over is None else {over: 0.1}), acceleration=1e3)
    robot = replace(UR5E, limits=replace(UR5E.limits, tcp=tcp))
    q, qd = np.array([0.3, -1.2, 1.4, -0.7, -1.5, 0.2]), np.zeros(6)
    qd[joint] = 1.0
    moving, still = State(q, qd, np.zeros(6)), State(q, np.zeros(6), np.zeros(6))
    ends = (still, moving) if last else (moving, still)
    assert FAMILY.over_at_ends(robot, ends, ("tool_speed", -1, 0.1)) == (over is not None)
    assert not FAMILY.over_at_ends(robot, (still, still), ("tool_speed", -1, 0.1))


def test_no_stretch_helps_against_a_step_of_the_tools_acceleration():
    (kind,) = (each for each in TOOL_KINDS if each.key == "acceleration")
    assert ToolSurvey(UR5E.limits, {}).excess() == -1.0
    assert ToolSurvey(UR5E.limits, {}, (ToolStep(kind, 1.0, 0.5),)).excess() == np.inf
