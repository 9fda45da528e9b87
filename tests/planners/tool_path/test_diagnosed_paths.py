"""Errors of paths that an arm cannot follow: their places, amounts, times and units, by geometry of small arms."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from tiers import few
from tool_jobs import START, TCP, TO, line, plan, refusal, tool_rates

from trajcli.curves.piecewise import Array, Side, constant
from trajcli.errors import PlanningError, Problem
from trajcli.geometry.paths.orientation import AxisAngleOrientation, SegmentProgress
from trajcli.geometry.paths.pose import PoseCurve
from trajcli.geometry.paths.position import Line
from trajcli.job.robot import load_robot
from trajcli.kinematics.following.tool_path import ToolPath, ToolReference
from trajcli.kinematics.forward import forward
from trajcli.kinematics.jacobian import linearisation
from trajcli.planners.tool_path.follow import (
    FollowedPath,
    FollowingDiagnosis,
    diagnosis_on_path,
    followed,
)

FREE = {"velocity": 1e6, "acceleration": 1e6, "jerk": None}
LAW = {"speed": 1, "acceleration": 1, "angular_speed": 1, "angular_acceleration": 1}
FOLDED = {"convention": "standard", "joints": [{"a": 0.5}, {"a": 0.5}]}
HOLLOW = {"convention": "standard", "joints": [{"a": 0.6}, {"a": 0.4}]}
UP = {"elbow": "up"}


def problem_of(robot: Any, start: Any, *moves: Any, **rest: Any) -> Problem:
    (problem,) = refusal(robot, start, *moves, limits=rest.pop("limits", FREE), **rest).problems
    return problem


def straight(x: float, y: float, **fields: Any) -> dict[str, Any]:
    return line({"xyz": [x, y, 0]}, law=LAW, **fields)


def said(problem: Problem, pattern: str) -> tuple[str, ...]:
    found = re.search(pattern, problem.message)
    assert found is not None, problem.message
    return found.groups()


REACH = r"beyond s = (\S+) (\S+): it stays up to (\S+) (\S+) away"


def test_a_path_that_is_lost_before_it_is_out_of_reach_says_where_the_reach_ends() -> None:
    """Two equal links fold over their base, where the line passes, and reach 1 m to the other side."""
    start = {"xyz": [0.5, 0, 0], "configuration": UP}
    place, _, missed, _ = said(problem_of(FOLDED, start, straight(-1.5, 0.0)), REACH)
    assert (float(place), float(missed)) == (pytest.approx(1.5, abs=1e-6), pytest.approx(0.5))


def test_a_path_through_a_hole_of_the_workspace_is_missed_by_its_middle() -> None:
    """Links of 0.6 and 0.4 m reach no nearer than 0.2 m, and the line comes as near as 0.1 m."""
    start = {"xyz": [0.5, 0.1, 0], "configuration": UP}
    problem = problem_of(HOLLOW, start, straight(-0.5, 0.1))
    assert "nearer" not in (problem.hint or ""), "it is too near"
    place, _, missed, _ = said(problem, REACH)
    assert float(place) == pytest.approx(0.5 - np.sqrt(0.2**2 - 0.1**2), abs=1e-5)
    assert float(missed) == pytest.approx(0.1, rel=1e-6)


@pytest.mark.full
@pytest.mark.parametrize("off", few([1e-3, 5e-5, 1e-6, 1e-7], 2))
def test_a_hole_that_is_narrower_than_samples_of_the_path_is_missed_by_its_middle(off: float) -> None:
    start = {"xyz": [0.5, 0.2 - off, 0], "configuration": UP}
    place, _, missed, _ = said(problem_of(HOLLOW, start, straight(-0.5, 0.2 - off)), REACH)
    assert float(place) == pytest.approx(0.5 - np.sqrt(0.2**2 - (0.2 - off) ** 2), abs=1e-5)
    assert float(missed) == pytest.approx(off, rel=1e-3)


@pytest.mark.parametrize(("unit", "shape"), [("deg", "trapezoid"), ("rad", "time_optimal")])
def test_a_tool_that_turns_in_its_place_has_angles_for_places(unit: str, shape: str) -> None:
    """The wrist, 0.3 m behind the tool, goes around it, and reaches 0.9 m: by the law of cosines."""
    robot = {"convention": "standard", "joints": [{"a": 0.5}, {"a": 0.4}, {"a": 0.3}]}
    yaw = {"deg": 170.0, "rad": 170 * np.pi / 180}[unit]
    start = {"xyz": [1.0, 0, 0], "yaw": 0, "tool_axis": "x", "configuration": UP}
    to = {"xyz": [1.0, 0, 0], "yaw": yaw, "tool_axis": "x"}
    law = LAW if shape == "trapezoid" else {"shape": shape}
    problem = problem_of(robot, start, line(to, law=law), units={"angle": unit, "length": "m"})
    place, angle, missed, length = said(problem, REACH)
    edge = np.arccos((1 + 0.3**2 - 0.9**2) / (2 * 0.3))
    scale = {"deg": 180 / np.pi, "rad": 1.0}[unit]
    assert (angle, length) == (unit, "m")
    assert float(place) == pytest.approx(edge * scale, rel=1e-5)
    far = np.hypot(1 - 0.3 * np.cos(np.radians(170)), 0.3 * np.sin(np.radians(170))) - 0.9
    assert float(missed) == pytest.approx(far, rel=1e-5)


@pytest.mark.full
@pytest.mark.parametrize(
    ("stick", "off", "missed"),
    few([(0.1, 0.4, "0.4 m"), (0.1, 0.0, "0.5 rad"), (3.0, 0.7, "0.5 rad"), (3.0, 0.7, "0.7 m")], 2),
)
def test_the_larger_of_two_misses_is_said(stick: float, off: float, missed: str) -> None:
    """Two slides turn nothing and go in a plane; an angle counts by the length of the arm, which is its tool."""
    slide = {"type": "prismatic"}
    robot = {"convention": "standard", "joints": [{**slide, "alpha": np.pi / 2}, slide]}
    robot["tool"] = {"xyz": [0, 0, stick]}
    turn = 0.0 if missed == "0.7 m" else 0.5
    offset = {"xyz": [off, 0, 0.3], "rpy": [turn, 0, 0]}
    to = {"from": "here", "offset": offset, "frame": "world"}
    problem = problem_of(robot, {"joints": [0.3, 0.2]}, line(to, law=LAW))
    assert f"it stays up to {missed} away" in problem.message


def test_joints_that_are_pinned_are_named_where_the_reach_ends() -> None:
    """A rail carries two links of 0.6 and 0.5 m up by half of s: where x^2 + (z - rail)^2 is 1.1^2."""
    rail = {"name": "rail", "type": "prismatic", "alpha": np.pi / 2}
    robot = {"convention": "standard", "joints": [rail, {"a": 0.6}, {"a": 0.5}, {"name": "spin"}]}
    to = {"xyz": [0.7, 0, 1.5], "joints": {"rail": 0.5, "spin": 0.1}}
    problem = problem_of(robot, {"joints": [0, 0, np.pi / 2, 0]}, line(to, law=LAW))
    part = max(np.roots([0.1**2 + 0.5**2, 2 * (0.6 * 0.1 + 0.5 * 0.5), 0.6**2 + 0.5**2 - 1.1**2]))
    place, _, missed, _ = said(problem, REACH)
    assert float(place) == pytest.approx(part * np.hypot(0.1, 1.0), abs=1e-5)
    assert float(missed) == pytest.approx(np.hypot(0.7, 1.0) - 1.1, rel=1e-6)
    assert problem.message.partition("with ")[2].startswith("rail, spin as it is pinned, ")
    assert "give rail, spin another value" in (problem.hint or "")


@pytest.mark.parametrize("hold", [0.0, 0.5])
def test_a_joint_beyond_its_range_has_the_time_at_which_it_is_farthest(hold: float) -> None:
    """A lift is lowest where the arm on it stands upright: 1 m along, at 1.5 s of a law of 1 m/s and 1 m/s^2."""
    lift = {"type": "prismatic", "alpha": np.pi / 2, "position": [-0.2, 3]}
    robot = {"convention": "standard", "joints": [lift, {"a": 2.0}]}
    to = line({"xyz": [-0.8, 0, float(np.sqrt(3))]}, law={"speed": 1, "acceleration": 1})
    stay = [{"planner": "hold", "duration": hold}] if hold else []
    problem = problem_of(robot, {"joints": [0, np.pi / 3]}, *stay, to)
    assert problem.time == pytest.approx(1.5 + hold, abs=1e-3)


def test_a_joint_that_turns_beyond_its_range_is_said_at_an_angle() -> None:
    """Turning in place about its last axis an arm leaves the range of that joint alone."""
    joints = [{"a": 0.5}, {"a": 0.4}, {"name": "wrist", "position": [-2, 1]}]
    robot = {"convention": "standard", "joints": joints}
    start = {"joints": [0.2, 0.5, 0.3]}
    place = [0.5 * np.cos(0.2) + 0.4 * np.cos(0.7), 0.5 * np.sin(0.2) + 0.4 * np.sin(0.7), 0.0]
    to = {"xyz": place, "yaw": 2.5, "tool_axis": "x"}
    problem = problem_of(robot, start, line(to, law=LAW))
    value, at = said(problem, r"wrist would be at (\S+) rad at s = (\S+) rad of the path, its limit is 1 rad")
    assert (float(value), float(at)) == (pytest.approx(1.8), pytest.approx(1.5))


def test_a_range_is_left_by_more_than_its_tolerance_alone() -> None:
    robot = load_robot("ur5e")
    top = robot.limits.position[0, 1]
    diagnosis = FollowingDiagnosis(robot, no_reference, 1.0, None, angular=False)
    for beyond, refused in ((1e-4, False), (3e-4, True)):
        curve = constant(np.array([top + beyond, *np.zeros(5)]), 1.0)
        if not refused:
            diagnosis.refuse_limits(curve, 2e-4)
            continue
        with pytest.raises(PlanningError) as caught:
            diagnosis.refuse_limits(curve, 2e-4)
        assert caught.value.problems[0].time is None


def no_reference(s: Array, side: Side) -> ToolReference:
    """Return nothing: a range is a matter of the joints."""
    raise AssertionError(f"asked at {s} from the {side}")


def direction_path() -> FollowedPath:
    """Return a line of a UR5e far from singularities, on which its tool may roll."""
    robot, q = load_robot("ur5e"), np.array([0.3, -1.2, 1.4, -0.9, -1.3, 0.4])
    pose = forward(robot, q)
    place = Line(pose[:3, 3], pose[:3, 3] + [0.0, 0.12, 0.16])
    turning = AxisAngleOrientation(np.stack([pose[:3, :3]] * 2), SegmentProgress.even(place.length))
    return followed(robot, ToolPath(PoseCurve(place, turning), (True, True, True), "direction"), q)


@pytest.mark.parametrize("at", [0.0, 0.1, 0.2])
def test_pieces_that_are_not_enough_are_no_singularity(at: float) -> None:
    joints = direction_path()
    diagnosis = diagnosis_on_path(joints.robot, joints.path, joints.follower)
    (problem,) = diagnosis.unfit(at, joints.coarse.evaluate, 77).problems
    assert "77 pieces do not meet the tolerance on this path" in problem.message


@pytest.mark.parametrize("at", [0.0, 0.3, 2.0])
def test_rates_about_a_place_are_those_of_the_joints(at: float) -> None:
    """Stretched out: the joints that are asked about go along the path evenly, whatever the arm can do."""
    robot = load_robot("planar2r")
    stretched = np.array([0.3, 0.0])
    pose = forward(robot, stretched)
    place = Line(pose[:3, 3], 0.5 * pose[:3, 3])
    turning = AxisAngleOrientation(np.stack([np.eye(3)] * 2), SegmentProgress.even(place.length))
    path = ToolPath(PoseCurve(place, turning), (True, True, True), "none")
    diagnosis = FollowingDiagnosis(robot, lambda s, side: path.at_s(0 * s, side), 2.0, None, angular=False)
    rates = np.array([-700.0, 640.0])
    (problem,) = diagnosis.unfit(at, lambda s: stretched + (s - at)[:, None] * rates, 77).problems
    assert "would have to go 700 rad for each m of the path" in problem.message
    assert problem.joint == robot.joint_names[0]


@pytest.mark.parametrize("limited", [True, False])
def test_a_larger_tolerance_is_proposed_where_it_helps(limited: bool) -> None:
    """Beside the hole of its workspace a joint turns by a radian within a millimetre."""
    start = {"xyz": [0.5, 0.20001, 0], "configuration": UP}
    limits = {**FREE, "tcp": {"speed": 2}} if limited else FREE
    larger = straight(-0.5, 0.20001, tolerance={"position": 0.01, "angle": 0.01})
    problem = problem_of(HOLLOW, start, larger if limited else straight(-0.5, 0.20001), limits=limits)
    assert "pieces do not meet the tolerance on this path" in problem.message
    if limited:
        assert "limits of the tool ask for 1e-6 m and rad" in (problem.hint or "")
    else:
        plan(HOLLOW, start, larger, limits=limits)
    assert ("`tolerance`" in (problem.hint or "")) != limited


@pytest.mark.full
def test_what_a_target_leaves_free_is_held_up_to_where_the_arm_would_turn_round() -> None:
    """There the directions that the pose fixes and the one that is held depend on each other, the first alone do not."""
    q = np.array([-0.287, 0.724, 0.64, -1.5, -0.503, -0.224, -0.341])
    robot, free = load_robot("iiwa14"), {"velocity": 1e4, "acceleration": 1e6, "jerk": None}
    before, to = forward(robot, q)[:3, 3], np.array([0.864, 0.023, 0.642])
    start, law = {"joints": q.tolist()}, {"speed": 0.2, "acceleration": 1}
    problem = problem_of("iiwa14", start, line({"xyz": to.tolist()}, law=law), limits=free)
    (place,) = said(problem, r"what the target leaves free cannot be held beyond s = (\S+) m of the path")
    assert "would have to turn round in its place" in problem.message
    along = (to - before) / np.linalg.norm(to - before)
    ratios = []
    for part in (0.5, 0.9999):
        short = (before + part * float(place) * along).tolist()
        made = plan("iiwa14", start, line({"xyz": short}, law=law), limits=free)
        jacobians = linearisation(robot, np.array([q, made.moves[0].planned.end.position]))[1]
        held = np.linalg.svd(jacobians[0])[2][6:]
        fixed, every = (
            np.linalg.svd(rows, compute_uv=False)[[0, -1]]
            for rows in (jacobians[1], np.vstack([jacobians[1], held]))
        )
        assert fixed[1] > 1e-2 * fixed[0]
        ratios.append(every[1] / every[0])
    assert ratios[1] < 0.05 * ratios[0]


def test_rates_are_those_of_time_where_the_law_is_known() -> None:
    """A tenth of a micrometre beside the hole of the workspace."""
    start = {"xyz": [0.5, 0.2000001, 0], "configuration": UP}
    problem = problem_of(HOLLOW, start, straight(-0.5, 0.2000001))
    _, unit, per = said(problem, r"would have to go (\S+) (\S+) for each ([^(]+) \(smallest")
    assert (unit, per) == ("rad", "s")


@pytest.mark.parametrize("size", [0.01, 30.0])
def test_rates_of_a_tool_that_turns_in_its_place_are_for_each_angle(size: float) -> None:
    """To where the wrist is at the edge of its reach the elbow races, however large the arm is."""
    robot = {"convention": "standard", "joints": [{"a": each * size} for each in (0.5, 0.4, 0.3)]}
    edge = float(np.arccos((1 + 0.3**2 - 0.9**2) / (2 * 0.3)))
    start = {"xyz": [size, 0, 0], "yaw": 0, "tool_axis": "x", "configuration": UP}
    to = {"xyz": [size, 0, 0], "yaw": edge, "tool_axis": "x"}
    problem = problem_of(robot, start, line(to, law=LAW))
    place, rate, unit, per = said(
        problem, r"s = (\S+) rad: there \S+ would have to go (\S+) (\S+) for each ([^(]+) \(smallest"
    )
    assert (unit, per) == ("rad", "rad of the path")
    assert float(place) == pytest.approx(edge, rel=1e-4)
    assert float(rate) > 100


@pytest.mark.parametrize("size", [1.0, 0.01, 30.0])
def test_branches_meet_where_no_joint_races(size: float) -> None:
    """An arm that is stretched out cannot say to which side it is to bend."""
    lift = {"type": "prismatic", "alpha": np.pi / 2}
    robot = {"convention": "standard", "joints": [lift, {"a": 2.0 * size}]}
    problem = problem_of(robot, {"joints": [0, 0]}, line({"xyz": [size, 0, 0]}, law=LAW))
    assert "at s = 0 m: there branches of the arm meet" in problem.message


@pytest.mark.parametrize(
    "tolerance", [{"position": 0.02}, {"angle": 0.05}, {"position": 0.02, "angle": 0.05}]
)
def test_a_tool_at_a_limit_of_its_rates_keeps_it_whatever_tolerance_is_given(
    tolerance: dict[str, float],
) -> None:
    made = plan("ur5e", START, line(TO, tolerance=tolerance))
    rates = tool_rates(made, np.linspace(0.0, made.trajectory.duration, 4001)).max(axis=1)
    limits = [TCP[name] for name in ("speed", "angular_speed", "acceleration", "angular_acceleration")]
    assert (rates <= np.array(limits) * (1 + 1e-6)).all()
    assert (rates / limits).max() > 0.99
