"""What a move along a path says of itself: durations, speeds that are wanted, phases, joins, and what it refuses."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from tool_jobs import DOWN, LIMITS, START, TCP, arm, job_text, line, plan, planned, poses_of, refusal, rows

from trajcli.errors import Amount, PlanningError
from trajcli.geometry.paths.orientation import SegmentProgress
from trajcli.job.read import job_from_text
from trajcli.kinematics.following.tolerance import Tolerance
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.solve import solve
from trajcli.language.poses import Configuration
from trajcli.language.targets import Target
from trajcli.planners.tool_path.move import ToolTarget, check_arrival, orientation_along, tool_target

HERE = np.array([0.4, 0.1, 0.05])
UP = {"xyz": rows(HERE + np.array([0.0, 0.0, 0.1]))}
TURN = {"rpy": [np.pi, 0, 0.8]}


def turned(roll: float, pitch: float, yaw: float) -> np.ndarray:
    """Return Rz Ry Rx."""
    (a, b, c), (d, e, f) = np.cos([roll, pitch, yaw]), np.sin([roll, pitch, yaw])
    x, y = [[1, 0, 0], [0, a, -d], [0, d, a]], [[b, 0, e], [0, 1, 0], [-e, 0, b]]
    return np.array([[c, -f, 0], [f, c, 0], [0, 0, 1]]) @ y @ x


def only(move: dict[str, Any], **rest: Any) -> Any:
    """Return the move of a job that has no other."""
    return planned("ur5e", START, move, **rest).moves[0]


@pytest.mark.parametrize(
    ("law", "names", "joins", "given"),
    [
        ({}, ["duration", "minimum_duration"], 1, None),
        ({"shape": "quintic"}, ["duration", "minimum_duration"], 2, None),
        ({"duration": 2.5}, ["duration"], 1, 2.5),
        ({"minimum_duration": 2.5}, ["minimum_duration"], 1, None),
        ({"speed": 0.1, "acceleration": 1.0}, ["minimum_duration"], 1, None),
        ({"shape": "time_optimal"}, ["minimum_duration"], 1, None),
    ],
)
def test_a_move_knows_what_its_law_may_be_given_to_last_longer(
    law: dict[str, Any], names: list[str], joins: int, given: float | None
) -> None:
    planner = only(line(UP, law=law), limits={**LIMITS, "velocity": 60.0}).planner
    assert all(f": {2 / 3:.12g}`" in text for text, _ in planner.lasting(2 / 3))
    said = dict(planner.lasting(3.0))
    assert [text.split(":")[0].strip("`") for text in said] == names
    for name, (text, longer) in zip(names, said.items(), strict=True):
        assert text == f"`{name}: 3` under `law`"
        assert getattr(longer.law, name) == 3.0
    assert planner.joins == joins
    free = planner.without_duration()
    assert (None if free is None else (free[0], free[1].law.duration)) == (
        None if given is None else (given, None)
    )
    fixed = [name for name in ("duration", "minimum_duration") if name in law]
    assert planner.why_not_flown_by == (f"its law has a `{fixed[0]}`" if fixed else None)


def test_a_tolerance_is_one_of_places_and_one_of_angles() -> None:
    found = only(line(UP, tolerance={"position": 2e-6, "angle": 3e-6})).planner.tolerance.tolerance
    assert found == Tolerance(2e-6, 3e-6)
    assert (found.position, found.angle) == (2e-6, 3e-6)


@pytest.mark.parametrize(("name", "lasts"), [("duration", 1.5), ("minimum_duration", 1.5), ("speed", 0.0)])
def test_a_move_of_no_length_lasts_what_its_law_says(name: str, lasts: float) -> None:
    hold = {"planner": "hold", "duration": 1.0}
    made = plan("ur5e", START, hold, line({"xyz": rows(HERE)}, law={name: 1.5}))
    assert made.trajectory.duration == pytest.approx(1.0 + lasts)


@pytest.mark.parametrize(
    ("to", "law", "wanted"),
    [
        (UP, {}, TCP["speed"]),
        (UP, {"speed": 0.1}, 0.1),
        (UP, {"duration": 2}, None),
        (TURN, {}, TCP["angular_speed"]),
        (TURN, {"angular_speed": 0.7, "speed": 0.1}, 0.7),
    ],
)
def test_the_speed_that_is_wanted_is_that_of_the_law_or_the_limit(
    to: dict[str, Any], law: dict[str, Any], wanted: float | None
) -> None:
    move = only(line(to, law=law))
    assert move.planned.wanted_speed == wanted
    assert move.planned.tool.ruled_by == (
        None if "duration" in law else "rotation" if to is TURN else "translation"
    )
    assert [phase.name for phase in move.planned.phases] == ["accelerate", "cruise", "decelerate"]


def test_where_speeds_step_none_is_wanted() -> None:
    segments = [{"line": UP, "law": {"speed": 0.1}}, {"line": {"xyz": rows(HERE + np.array([0.1, 0, 0.1]))}}]
    path = {"planner": "path", "corner": "stop", "segments": segments, "law": {"shape": "time_optimal"}}
    assert only(path).planned.wanted_speed is None


@pytest.mark.parametrize(("jerk", "continuity"), [(None, 1), (2000.0, 2)])
def test_a_fastest_law_within_jerk_joins_accelerations(jerk: float | None, continuity: int) -> None:
    short = {"xyz": rows(HERE + np.array([0.0, 0.0, 0.01]))}
    move = only(line(short, law={"shape": "time_optimal"}), limits={**LIMITS, "jerk": jerk})
    assert move.planned.continuity == continuity
    assert move.planned.events


@pytest.mark.parametrize("name", ["velocity", "acceleration"])
def test_a_line_neither_starts_nor_ends_in_motion(name: str) -> None:
    (problem,) = refusal("ur5e", START, line({**UP, name: 0.1})).problems
    assert "ends at rest" in problem.text()
    joints = {"joints": [0.1, -1.5, 1.5, 0, 1.5, 0], name: [0, 0, 0.1, 0, 0, 0]}
    (problem,) = refusal("ur5e", joints, line({"from": "here", "offset": {"xyz": [0, 0, 0.1]}})).problems
    if name == "velocity":
        assert "line starts at rest, but the velocity of elbow_joint is 0.1" in problem.text()
    else:
        assert problem.text() == "line cannot start with an acceleration"


@pytest.mark.parametrize("kind", ["yaw", "pitch"])
@pytest.mark.parametrize(("axis", "upright"), [("z", True), ("x", False)])
def test_an_upright_axis_has_no_heading_to_turn_from(kind: str, axis: str, *, upright: bool) -> None:
    move = line({**UP, kind: 0.1, "tool_axis": axis})
    if upright:
        (problem,) = refusal("ur5e", START, move).problems
        assert "the z axis of the tool is upright" in problem.text()
        assert f"without {kind}" in problem.advice()
    else:
        assert only(move).planned.curve.duration > 0


def test_euler_goes_evenly_in_roll_pitch_and_yaw_as_well() -> None:
    angles = np.array([np.pi - 0.4, 0.3, 0.8])
    move = line({"xyz": rows(HERE + np.array([0, 0.1, 0.1])), "rpy": rows(angles)}, orientation="euler")
    made = plan("ur5e", START, move)
    poses = poses_of(made, np.array([0.0, 0.5, 1.0]) * made.trajectory.duration)
    for pose, share in zip(poses, (0.0, 0.5, 1.0), strict=True):
        expected = turned(*(np.array(DOWN) + share * (angles - np.array(DOWN))))
        assert pose[:3, :3] == pytest.approx(expected, abs=1e-5)


TWICE = [{"line": UP}, {"line": {"xyz": rows(HERE + np.array([0.1, 0, 0.1]))}}]


@pytest.mark.parametrize(
    ("how", "first", "last", "said"),
    [
        (
            "euler",
            {"rpy": [3, 0, 0]},
            {"euler": {"sequence": "ZYZ", "angles": [0, 3, 0]}},
            "different angles",
        ),
        ("fixed", {}, {"rpy": [np.pi, 0, 0.5]}, "keeps the orientation"),
        ("tangent", {"rpy": [np.pi, 0, 0.5]}, {}, "follows from the path"),
    ],
)
def test_every_segment_of_a_path_must_ask_for_what_its_rule_gives(
    how: str, first: dict[str, Any], last: dict[str, Any], said: str
) -> None:
    segments = [{"line": {**one["line"], **aim}} for one, aim in zip(TWICE, (first, last), strict=True)]
    path = {"planner": "path", "corner": "stop", "segments": segments, "orientation": how}
    assert said in str(refusal("ur5e", START, path))


@pytest.mark.parametrize("joint", [1, 4])
def test_other_joint_values_than_a_target_names_are_refused_where_they_are_furthest_apart(joint: int) -> None:
    wanted = np.array([0.1, -1.5, 1.5, 0.2, 1.5, 0.3])
    path: Any = SimpleNamespace(arrival=wanted, configuration=None)
    other = wanted + 0.9e-5
    check_arrival(path, other, arm("ur5e"))
    other[joint] -= 4e-5
    with pytest.raises(PlanningError) as caught:
        check_arrival(path, other, arm("ur5e"))
    (problem,) = caught.value.problems
    name = arm("ur5e").joint_names[joint]
    assert problem.joint == problem.amounts["joint"] == name
    assert problem.amounts["value"] == Amount(other[joint], 0, joint)
    assert problem.amounts["wanted"] == Amount(wanted[joint], 0, joint)


def test_an_arm_arrives_on_the_branch_on_which_it_stands_there() -> None:
    """All eight answers at the end of a line, each said to be wanted on each branch, and by one word of it."""
    robot = arm("ur5e")
    planner = only(line({"xyz": [0.35, 0.2, 0.3], "rpy": [3.0, 0.1, 0.4]})).planner
    before = forward(robot, np.array([0.1, -1.4, 1.5, -1.7, -1.4, 0.2]))
    planned_path = planner.path_from(before, robot)
    target = turned(3.0, 0.1, 0.4)
    answers = solve(robot, np.block([[target, np.array([[0.35], [0.2], [0.3]])], [np.zeros((1, 3)), 1.0]]))
    assert answers.valid.sum() == 8
    choices = ("shoulder", "elbow", "wrist")
    words = [{choice: getattr(names, choice) for choice in choices} for names in answers.names]
    assert len({tuple(each.values()) for each in words}) == 8
    for end, own in [*zip(answers.joints, words, strict=True)][::3]:
        for other in words:
            for asked in (
                other,
                {"elbow": other["elbow"]},
                {"shoulder": other["shoulder"], "wrist": other["wrist"]},
            ):
                wanted = replace(planned_path, configuration=Configuration(**asked))
                if all(own[choice] == word for choice, word in asked.items()):
                    check_arrival(wanted, end, robot)
                    continue
                with pytest.raises(PlanningError) as caught:
                    check_arrival(wanted, end, robot)
                said = (
                    f"arrives in the configuration {' '.join(own.values())}, not {' '.join(asked.values())}"
                )
                assert said in str(caught.value)


def first_move(robot: str, start: dict[str, Any], move: dict[str, Any]) -> Any:
    """Return the first move of a job that is not planned."""
    return job_from_text(job_text(robot, start, move)).job.moves[0]


def target_of(to: dict[str, Any]) -> Target:
    found: Target = first_move("ur5e", START, line(to)).to
    return found


@pytest.mark.parametrize(
    ("beside", "heading"), [(0.5, 1.5), (0.5, np.pi / 2), (0.5, -np.pi / 2), (0.005, 0.0), (1e-5, 3.0)]
)
def test_an_axis_that_is_nearly_upright_has_a_heading(beside: float, heading: float) -> None:
    before = np.eye(4)
    before[:3, :3] = turned(
        0.0, beside - np.pi / 2, heading
    )  # x points up, but for the part that it is beside
    found = tool_target(
        target_of({"xyz": [0.4, 0.3, 0.2], "yaw": 1.0, "tool_axis": "x"}), before, arm("ur5e")
    )
    assert np.arctan2(*found.pose[1::-1, 0]) == pytest.approx(1.0, abs=1e-9)
    assert np.cos(found.turn - (1.0 - heading)) == pytest.approx(1.0, abs=1e-9)


def about_z(angle: float, typed: float | None = None) -> ToolTarget:
    """Return a target turned about z, whose angles may be typed otherwise."""
    pose = np.eye(4)
    pose[:3, :3] = turned(0, 0, angle)
    angles = np.array([0, 0, angle if typed is None else typed])
    return ToolTarget(pose, (True, True, True), "all", typed=(angles, "XYZ", "fixed"))


def test_a_fixed_orientation_takes_rounding_alone() -> None:
    fixed = orientation_along("fixed", np.eye(3), [about_z(1e-12)], None, SegmentProgress.even(2.0))
    assert fixed.length == 2.0
    with pytest.raises(PlanningError, match="orientation: fixed keeps the orientation"):
        orientation_along("fixed", np.eye(3), [about_z(1e-5)], None, SegmentProgress.even(2.0))


@pytest.mark.parametrize(
    ("start", "angles", "middle"),
    [
        (0, (170, 400), (85, 285)),
        (-100, (170, 400), (215, 285)),
        (0, (300, 400), (150, 350)),
        (0, (-300, 10), (-150, -145)),
    ],
)
def test_angles_that_are_typed_on_begin_within_half_a_turn_or_nearest_to_the_first(
    start: int, angles: tuple[int, int], middle: tuple[int, int]
) -> None:
    """Within half a turn where the first one is beyond it."""
    targets = [about_z(np.radians(angle)) for angle in angles]
    progress = SegmentProgress(np.array([0.0, 1.0, 2.0]), np.zeros(1))
    curve = orientation_along("euler", turned(0, 0, np.radians(start)), targets, None, progress)
    for s, angle in zip((0.5, 1.5), middle, strict=True):
        found = curve.evaluate(np.array([s]))[0][0]
        assert found == pytest.approx(turned(0, 0, np.radians(angle)), abs=1e-9)


@pytest.mark.parametrize(("how", "fixed"), [("tangent", "all"), ("axis_angle", "none")])
def test_an_orientation_that_follows_from_the_path_is_fixed_on_an_arm_with_few_joints(
    how: str, fixed: str
) -> None:
    bend = {"planner": "arc", "center": [0.2, 0.3, 0], "axis": "z", "angle": 0.4, "orientation": how}
    start = {"joints": [0.3, 0.7, 0.4]}
    move = first_move("planar3r", start, bend)
    assert (
        move.path_from(forward(arm("planar3r"), np.array(start["joints"])), arm("planar3r")).path.orientation
        == fixed
    )


@pytest.mark.parametrize("kind", ["yaw", "pitch"])
@pytest.mark.parametrize("angle", [1.0, -0.5, 0.4])
def test_a_yaw_or_a_pitch_turns_either_way(kind: str, angle: float) -> None:
    """From a heading of 0.4 and an elevation of -0.4 rad: how far it turns, and where it ends."""
    before = np.eye(4)
    before[:3, :3] = turned(0.3, 0.4, 0.4)
    target = target_of({"xyz": [0.4, 0.3, 0.2], kind: angle, "tool_axis": "x"})
    found = tool_target(target, before, arm("ur5e"))
    axis = found.pose[:3, 0]
    heading, rise = np.arctan2(axis[1], axis[0]), np.arcsin(axis[2])
    assert (heading, rise) == pytest.approx((angle, -0.4) if kind == "yaw" else (0.4, angle), abs=1e-9)
    assert found.turn == pytest.approx(angle - (0.4 if kind == "yaw" else -0.4), abs=1e-9)
    assert (found.orientation, found.tool_axis) == (kind, "x")
    assert found.pose[:3, 3] == pytest.approx([0.4, 0.3, 0.2])


def test_a_direction_is_that_of_the_tools_axis_and_bends_no_further() -> None:
    before = np.eye(4)
    before[:3, :3] = turned(0.3, 0.4, 0.4)
    wanted = np.array([1.0, 2.0, -2.0]) / 3
    target = target_of({"xyz": [0.4, 0.3, 0.2], "direction": [1, 2, -2], "tool_axis": "y"})
    found = tool_target(target, before, arm("ur5e"))
    assert found.pose[:3, 1] == pytest.approx(wanted)
    between = np.arccos(before[:3, 1] @ wanted)
    turn = np.arccos((np.trace(before[:3, :3].T @ found.pose[:3, :3]) - 1) / 2)
    assert turn == pytest.approx(between), "about the axis that is square to both"
    assert (found.orientation, found.tool_axis, found.turn) == ("direction", "y", 0.0)
