"""What holds for one of several moves, states or findings holds for each, wherever it stands among them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_check_tool import RIGHT, shifted

from trajcli.checks.verify import _check_tools, longest_factor, verify
from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.findings import Finding
from trajcli.job.robot import load_robot
from trajcli.kinematics.robot import Joint, Limits, LinkInertia, Robot, ToolLimits
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


@pytest.mark.parametrize("wrong", range(3))
def test_every_family_of_limits_is_judged_in_every_move(wrong):
    """One link of 1 kg at 0.5 m that turns at 1 rad/s towards its end: three limits, all but 1.1 of each in the others.

    Half a metre makes 0.5 m/s; standing it takes m g l = 4.905 N m where it lies along x at most.
    """
    link = LinkInertia(1.0, (0.0, 0.0, 0.0), (0.0,) * 6)
    joint = Joint("a", "revolute", a=0.5, link=link)
    curve = PiecewisePolynomial(np.arange(4.0), np.array([[[0.1]] * 3, [[-0.15], [-0.05], [0.05]]]))
    trajectory = Trajectory(
        curve,
        ("a",),
        ("revolute",),
        tuple(Span(k, "hold", float(k), k + 1.0, 2) for k in range(3)),
        *(State(np.array([q]), np.array([0.1]), np.zeros(1)) for q in (-0.15, 0.15)),
    )
    limits, promises = [], []
    for k in range(3):
        share = 0.9 if k == wrong else 1.1
        end = float(curve.evaluate(np.array([k + 1.0]))[0, 0]) + 0.5
        of_move = Limits(
            np.array([[-9.0, end]]),
            *[FREE] * 3,
            effort=np.array([[-share * 4.905, share * 4.905]]),
            velocity_by_position=np.array([[(share * 0.1) ** 2 / (2 * 0.5), 0.0]]),
            tcp=ToolLimits(speed=share * 0.05),
        )
        robot = Robot(
            "arm", (joint,), of_move, "standard", np.eye(4), np.eye(4), gravity=np.array([0, -9.81, 0.0])
        )
        limits.append(of_move)
        promises.append(Promise(robot=robot))
    found = verify(trajectory, limits, promises).findings
    assert {finding.kind for finding in found} == {"effort", "velocity_by_position", "tool_speed"}
    assert {finding.move for finding in found} == {wrong}


@pytest.mark.parametrize("wrong", range(3))
def test_the_tool_of_every_move_is_judged(wrong):
    tools = [RIGHT, RIGHT, RIGHT]
    tools[wrong] = shifted(RIGHT, 1e-3 * np.eye(6)[2])
    assert {finding.kind for finding in _check_tools(tools)} == {"tool_path", "tool_orientation"}
    assert list(_check_tools([RIGHT, RIGHT])) == []


@pytest.mark.parametrize("last", [False, True])
def test_limits_of_the_tool_that_no_arm_has_are_named_in_any_move(last):
    moving = [[1.0], [0.5], [0.0]] if not last else [[1.0], [1.0], [0.5]]
    curve = PiecewisePolynomial(np.arange(3.0), np.array([np.diff(moving, axis=0), moving[:2]]))
    ends = (State(np.array(each), np.zeros(1), np.zeros(1)) for each in (moving[0], moving[2]))
    spans = tuple(Span(k, "hold", float(k), k + 1.0, 2) for k in range(2))
    free = Limits(FREE, FREE, FREE, FREE)
    limits = [free, replace(free, tcp=ToolLimits(speed=1.0))]
    trajectory = Trajectory(curve, ("a",), ("revolute",), spans, *ends)
    assert verify(trajectory, limits).unchecked_of_tool == ("speed",)
