"""Targets of moves: what may not be said of them, where it stands, and what would be right."""

from __future__ import annotations

import math

import numpy as np
import pytest

from trajcli.errors import InputError, PlanningError
from trajcli.job.read import LoadedJob, job_from_text
from trajcli.language.targets import AskedPose, PoseFields, Target, ik_target

HEAD = "version: 1\nunits: {angle: deg, length: mm}\nrobot: ur5e\nstart: {joints: [0, -90, 90, 0, 90, 0]}\n"
BARE = "version: 1\nrobot: {joints: [{name: turn}, {name: lift, type: prismatic}, {name: roll}]}\nstart: {joints: 0}\n"


def job(move: str, head: str = HEAD) -> LoadedJob:
    return job_from_text(f"{head}moves:\n  - {{{move}}}\n", "job.yaml")


WRONG = [  # head, move, message, what stands at its place, hint
    (HEAD, "planner: quintic, to: {joints: 0}, duration: 0", "above 0 s, got 0", "0}", None),
    (HEAD, "planner: jerk_limited, to: {joints: 0}, minimum_duration: 0", "above 0 s, got 0", "0}", None),
    (HEAD, "planner: jerk_limited, to: {joints: 0}, minimum_duration: -1", "above 0 s, got -1", "-1", None),
    (HEAD, "planner: trapezoid, to: {joints: 0}, velocity: 0, acceleration: 9", "above 0 deg/s, got 0", "0,", None),
    (HEAD, "planner: trapezoid, to: {joints: 0}, velocity: 9, acceleration: -9", "above 0 deg/s^2, got -9", "-9", None),
    (HEAD, "planner: quintic, to: {velocity: 0, configuration: {elbow: up}, tool_axis: x}, duration: 1",
     "configuration says something about a pose, and there is none", "{elbow", "leave it out"),
    (HEAD, "planner: quintic, to: {velocity: 0, tool_axis: x}, duration: 1",
     "tool_axis says something about a pose, and there is none", "x}", "leave it out"),
    (HEAD, "planner: jerk_limited, to: {xyz: [1, 2, 3], yaw: 1, pitch: 2}", "yaw and pitch exclude each other", "2}",
     "leave one of them out"),
    (HEAD, "planner: jerk_limited, to: {pitch: 1, direction: z}", "pitch and direction exclude each other", "z}",
     "leave one of them out"),
    (HEAD, "planner: jerk_limited, to: {xyz: [1, 2, 3], joints: [0, 0, 0, 0, 0, 0]}",
     "joints and xyz exclude each other", "[1, 2", "leave one of them out"),
    (HEAD, "planner: jerk_limited, to: {joints: 0, direction: z}", "joints and direction exclude each other", "z}",
     "leave one of them out"),
    (BARE, "planner: quintic, to: {joints: {lift: 1}}, duration: 1", "no value for turn, roll", "{lift",
     "name every joint, or give a list"),
    (BARE, "planner: quintic, to: {joints_by: {}}, duration: 1", "no joint is named", "{}", "name one, or leave it out"),
    (BARE, "planner: quintic, to: {acceleration: 1}, duration: 1", "a state needs `joints` or a pose", "{acc", None),
]  # fmt: skip


@pytest.mark.parametrize(("head", "move", "message", "at", "hint"), WRONG, ids=range(len(WRONG)))
def test_what_no_target_says_is_refused_where_it_stands(
    head: str, move: str, message: str, at: str, hint: str | None
) -> None:
    with pytest.raises(InputError) as caught:
        job(move, head)
    (problem,) = caught.value.problems
    assert message in problem.message
    assert hint is None or problem.hint == hint
    assert problem.place is not None
    assert problem.place.source[problem.place.column - 1 :].startswith(at)


@pytest.mark.parametrize("coordinate", [2e9, -2e9])
def test_a_position_that_no_robot_reaches_says_how_far_it_is(coordinate: float) -> None:
    assert ik_target(PoseFields(xyz=(0.0, np.sign(coordinate) * 9e8, 1.0))).whole is False
    with pytest.raises(PlanningError) as caught:
        ik_target(PoseFields(xyz=(0.0, coordinate, 1.0)))
    assert "a coordinate of 2e+09 m: no robot reaches so far" in str(caught.value)


def test_the_parts_of_a_pose_that_are_given_are_the_ones_that_are_fixed() -> None:
    """By hand: a pitch near a quarter turn fixes where the axis points, and any other leaves its heading."""
    position = (0.1, 0.2, 0.3)
    assert ik_target(PoseFields(xyz=position)).orientation == "none"
    assert ik_target(PoseFields(xyz=position, yaw=0.3, tool_axis="x")).orientation == "yaw"
    pitch = ik_target(PoseFields(xyz=position, pitch=-0.3, tool_axis="y"))
    assert (pitch.orientation, pitch.tool_axis, pitch.aims.tolist()) == ("pitch", "y", [-0.3])
    steep = ik_target(PoseFields(pitch=math.pi / 2 - 1e-6))
    assert (steep.orientation, steep.position, steep.tool_axis) == ("pitch", (False, False, False), "z")
    upright = ik_target(PoseFields(xyz=position, pitch=-math.pi / 2, tool_axis="x"))
    assert (upright.orientation, upright.tool_axis) == ("direction", "x")
    np.testing.assert_allclose(upright.aims, [0, 0, -1], atol=1e-15)
    aimed = ik_target(PoseFields(direction=(0.0, 0.6, 0.8)))
    np.testing.assert_allclose(aimed.aims, [0, 0.6, 0.8], atol=1e-15)


def test_a_target_says_whether_it_says_where_to_be() -> None:
    assert Target(joints=(0.0,)).gives_joints_or_pose
    assert Target(xyz=(0.0, 0.0, 0.0)).gives_joints_or_pose
    assert Target(direction=(0.0, 0.0, 1.0)).gives_joints_or_pose
    assert Target(joints_by=(1.0,)).gives_joints_or_pose
    assert not Target(velocity=(0.0,)).gives_joints_or_pose


def test_joints_beside_a_pose_that_is_asked_for_are_named() -> None:
    assert AskedPose(xyz=(0.0, 0.0, 0.0)).pins == {}
    with pytest.raises(ValueError, match="beside a pose `joints` pins some joints by name"):
        AskedPose(xyz=(0.0, 0.0, 0.0), joints=(0.0, 1.0))


def test_a_target_is_never_changed() -> None:
    target = Target(joints=(0.0,))
    with pytest.raises(ValueError, match="frozen"):
        target.joints = (1.0,)  # type: ignore[misc]
    assert hash(target) == hash(Target(joints=(0.0,)))
