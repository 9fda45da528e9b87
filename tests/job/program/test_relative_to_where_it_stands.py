"""Targets relative to where the arm stands, and to points by joints, against forward kinematics."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from trajcli.errors import InputError, TrajcliError
from trajcli.job.dump import dump_job
from trajcli.job.read import job_from_text
from trajcli.kinematics.forward import forward
from trajcli.planning.plan import Plan, plan_job

HOME = [0.0, -90.0, 90.0, -90.0, -90.0, 0.0]
LAW = "law: {shape: quintic, duration: 2}"
HEAD = f"""\
version: 1
units: {{angle: deg, length: mm}}
robot: ur5e
limits: {{acceleration: 800, jerk: 4000}}
frames: {{cell: {{rpy: [0, 10, 90]}}}}
points:
  home: {{joints: {HOME}}}
  pose: {{xyz: [450, 100, 300], rpy: [175, 10, 30]}}
  over: {{from: home, offset: {{xyz: [0, 0, -50]}}}}
  more: {{from: over, offset: {{xyz: [10, 0, 0], rpy: [0, 0, 10]}}, frame: cell}}
start: home
"""


def planned(*moves: str) -> Plan:
    return plan_job(
        job_from_text(HEAD + "moves:\n" + "".join(f"  - {{{move}}}\n" for move in moves), "job.yaml")
    )


def ends(plan: Plan) -> list[np.ndarray]:
    """Return the pose of the tool at the start and behind each move."""
    times = [0.0, *(span.end for span in plan.trajectory.spans)]
    return list(forward(plan.loaded.robot, plan.trajectory.curve.evaluate(np.array(times), side="left")))


def displaced(pose: np.ndarray, xyz: list[float], turn: Rotation, axes: np.ndarray | None) -> np.ndarray:
    """Return a pose after an offset in mm along and about axes, those of the tool for None."""
    along = pose[:3, :3] if axes is None else axes
    result = np.eye(4)
    result[:3, 3] = pose[:3, 3] + along @ np.array(xyz) / 1e3
    result[:3, :3] = along @ turn.as_matrix() @ along.T @ pose[:3, :3]
    return result


NONE = Rotation.identity()
CELL = Rotation.from_euler("xyz", [0, 10, 90], degrees=True).as_matrix()
TURN = Rotation.from_euler("xyz", [5, 0, 10], degrees=True)


@pytest.mark.full
@pytest.mark.parametrize(
    ("frame", "axes"),
    [("", None), (", frame: tool", None), (", frame: world", np.eye(3)), (", frame: cell", CELL)],
)
@pytest.mark.parametrize("before", ["jerk_limited, to: home", "jerk_limited, to: pose", "hold, duration: 1"])
def test_a_target_from_here(frame: str, axes: np.ndarray | None, before: str) -> None:
    offset = "offset: {xyz: [10, 20, -60], rpy: [5, 0, 10]}"
    plan = planned(f"planner: {before}", f"planner: line, to: {{from: here, {offset}{frame}}}, {LAW}")
    start, end = ends(plan)[-2:]
    np.testing.assert_allclose(end, displaced(start, [10, 20, -60], TURN, axes), atol=3e-6)


def test_here_is_the_pose_itself_where_the_job_gives_one() -> None:
    plan = planned(
        "planner: jerk_limited, to: pose",
        "planner: hold, duration: 1",
        f"planner: line, to: {{from: here, offset: {{xyz: [0, 0, -40]}}}}, {LAW}",
    )
    tool = plan.moves[-1].planned.tool
    assert tool is not None
    assert tool.path is not None
    pose = plan.loaded.job.points["pose"].full_pose()
    path = tool.path.at_s(np.array([0.0, tool.path.length]), "left").target().poses
    np.testing.assert_allclose(path[1], displaced(pose, [0, 0, -40], NONE, None), atol=1e-15)


def test_here_after_an_arc_by_its_angle_is_where_the_arm_stands() -> None:
    plan = planned(
        "planner: jerk_limited, to: pose",
        f"planner: arc, center: [450, 200, 300], axis: z, angle: 40, {LAW}",
        f"planner: line, to: {{from: here, offset: {{xyz: [0, 0, -40]}}, frame: world}}, {LAW}",
    )
    start, end = ends(plan)[-2:]
    np.testing.assert_allclose(end, displaced(start, [0, 0, -40], NONE, np.eye(3)), atol=3e-6)


def test_points_relative_to_a_point_by_joints() -> None:
    plan = planned(
        "planner: jerk_limited, to: over",
        "planner: jerk_limited, to: more",
        f"planner: path, corner: stop, segments: [{{line: over}}, {{line: more}}], {LAW}, when_over_limit: slow",
    )
    home = forward(plan.loaded.robot, np.radians(HOME))
    over = displaced(home, [0, 0, -50], NONE, None)
    more = displaced(over, [10, 0, 0], Rotation.from_euler("z", 10, degrees=True), CELL)
    for found, expected in zip(ends(plan), [home, over, more, more], strict=True):
        np.testing.assert_allclose(found, expected, atol=3e-6)


def test_a_point_above_joints_is_solved_near_them() -> None:
    """From far away another branch would be nearer than that of the taught joints."""
    far = "{joints: [-130, -40, -95, 15, 95, 170]}"
    for point in ("over", "more"):  # one of them relative to the other
        plan = planned(f"planner: jerk_limited, to: {far}", f"planner: jerk_limited, to: {point}")
        end = np.degrees(plan.trajectory.curve.evaluate(plan.trajectory.duration, side="left"))
        assert np.abs(end - HOME).max() < 20


def test_joints_by() -> None:
    plan = planned(
        "planner: jerk_limited, to: {joints_by: {wrist_3_joint: 45, elbow_joint: -10}}",
        "planner: quintic, to: {joints_by: 5}",
    )
    end = np.degrees(plan.trajectory.curve.evaluate(plan.trajectory.duration, side="left"))
    np.testing.assert_allclose(end - HOME, [5, 5, -5, 5, 5, 50], atol=1e-9)


def test_the_resolved_job_says_it_in_the_same_words() -> None:
    plan = planned(
        "planner: jerk_limited, to: more",
        "planner: jerk_limited, to: {joints_by: {wrist_3_joint: 45}}",
        f"planner: line, to: {{from: here, offset: {{xyz: [0, 0, 30]}}, frame: cell}}, {LAW}",
    )
    again = plan_job(job_from_text(dump_job(plan.loaded)))
    times = np.linspace(0, plan.trajectory.duration, 100)
    np.testing.assert_allclose(
        plan.trajectory.curve.evaluate(times), again.trajectory.curve.evaluate(times), atol=1e-9
    )


@pytest.mark.full
def test_rounds_that_go_on_from_here() -> None:
    step = f"{{planner: line, to: {{from: here, offset: {{xyz: [0, 0, -20]}}}}, {LAW}}}"
    plan = planned("planner: jerk_limited, to: pose", f"repeat: 4, moves: [{step}]")
    pose = plan.loaded.job.points["pose"].full_pose()
    for count, found in enumerate(ends(plan)[1:]):
        np.testing.assert_allclose(found, displaced(pose, [0, 0, -20 * count], NONE, None), atol=3e-6)


WRONG = [
    ("planner: line, to: {from: here, in: cell}", "from and in exclude each other"),
    ("planner: line, to: {from: here, joints: 0}", "from and joints exclude each other"),
    ("planner: line, to: {from: here, ofset: {}}", "unknown key 'ofset'"),
    ("planner: quintic, to: {joints_by: 5, joints: 5}", "joints and joints_by exclude each other"),
    ("planner: quintic, to: {joints_by: {elbo: 5}}", "no joint 'elbo'"),
    ("planner: quintic, to: {joints_by: {}}", "no joint is named"),
    ("planner: quintic, to: {from: here, joints_by: 5}", "unknown key 'joints_by'"),
]


@pytest.mark.parametrize(("move", "message"), WRONG)
def test_what_makes_no_target_is_refused(move: str, message: str) -> None:
    with pytest.raises(InputError) as caught:
        planned(move)
    assert message in caught.value.problems[0].message
    assert caught.value.problems[0].place is not None
    assert caught.value.problems[0].place.line == 13


def test_a_start_and_an_arm_without_geometry_are_relative_to_nothing() -> None:
    move = "moves: [{planner: quintic, to: {joints: 0}}]\n"
    with pytest.raises(TrajcliError, match="the start cannot be relative"):
        plan_job(job_from_text(HEAD.replace("start: home", "start: {joints_by: 3}") + move))
    bare = "version: 1\nrobot: {joints: 2}\nstart: {joints: 0}\n"
    with pytest.raises(TrajcliError, match="no geometry"):
        plan_job(job_from_text(bare + "moves: [{planner: quintic, to: {from: here}, duration: 1}]\n"))
