"""Points as poses: the planned arm stands where the job says, on the branch that it says."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from trajcli.errors import InputError, PlanningError
from trajcli.job.dump import dump_job
from trajcli.job.read import job_from_text
from trajcli.planning.plan import plan_job

JOB = """
version: 1
units: {angle: deg, length: mm}
robot: ur5e
limits: {acceleration: 800, jerk: 8000}
start: {joints: [0, -90, 90, 0, 90, 0]}
moves:
  - {planner: quintic, to: TARGET, duration: 4}
"""
DOWN = "xyz: [400, 100, 250], rpy: [180, 0, 0]"


def planned(target: str, job: str = JOB):
    return plan_job(job_from_text(job.replace("TARGET", target)))


def tcp_of(robot, joints):
    """The product of the DH matrices, written from the definition."""
    pose = np.array(robot.base)
    for joint, q in zip(robot.joints, joints, strict=True):
        turn, lift = np.eye(4), np.eye(4)
        turn[:3, :3] = Rotation.from_euler("z", joint.theta + q).as_matrix()
        turn[2, 3] = joint.d
        lift[:3, :3] = Rotation.from_euler("x", joint.alpha).as_matrix()
        lift[0, 3] = joint.a
        pose = pose @ turn @ lift
    return pose @ robot.tool


def ends(plan):
    return plan.trajectory.end.position


def wanted(rotation):
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation.as_matrix(), (0.4, 0.1, 0.25)
    return pose


@pytest.mark.parametrize(
    ("orientation", "rotation"),
    [
        ("rpy: [170, 20, -30]", Rotation.from_euler("xyz", [170, 20, -30], degrees=True)),
        ("quat_wxyz: [0, 0.6, 0.8, 0]", Rotation.from_quat([0.6, 0.8, 0, 0])),
        ("matrix: [[1, 0, 0], [0, -1, 0], [0, 0, -1]]", Rotation.from_euler("x", np.pi)),
        ("axis_angle: {axis: [0, 2, 0], angle: 170}", Rotation.from_euler("y", 170, degrees=True)),
        (
            "euler: {sequence: ZYZ, angles: [20, 160, 50]}",
            Rotation.from_euler("ZYZ", [20, 160, 50], degrees=True),
        ),
        (
            "euler: {sequence: ZYX, frame: fixed, angles: [10, 20, 170]}",
            Rotation.from_euler("zyx", [10, 20, 170], degrees=True),
        ),
    ],
)
def test_every_form_of_orientation_is_reached(orientation: str, rotation: Rotation) -> None:
    plan = planned("{xyz: [400, 100, 250], " + orientation + "}")
    np.testing.assert_allclose(tcp_of(plan.loaded.robot, ends(plan)), wanted(rotation), atol=1e-9, rtol=0)


def test_a_homogeneous_matrix_has_its_position_in_the_jobs_unit() -> None:
    plan = planned("{matrix: [[1, 0, 0, 400], [0, -1, 0, 100], [0, 0, -1, 250], [0, 0, 0, 1]]}")
    expected = wanted(Rotation.from_euler("x", np.pi))
    np.testing.assert_allclose(tcp_of(plan.loaded.robot, ends(plan)), expected, atol=1e-9, rtol=0)


def test_the_tool_of_the_job_takes_the_place_of_the_robots() -> None:
    job = JOB.replace("robot: ur5e", "robot: ur5e\ntool: {xyz: [0, 0, 120]}")
    plan = planned("{" + DOWN + "}", job)
    assert plan.loaded.robot.tool[2, 3] == 0.12
    expected = wanted(Rotation.from_euler("x", np.pi))
    np.testing.assert_allclose(tcp_of(plan.loaded.robot, ends(plan)), expected, atol=1e-9, rtol=0)
    assert np.abs(ends(plan) - ends(planned("{" + DOWN + "}"))).max() > 0.01


@pytest.mark.parametrize("elbow", ["up", "down"])
@pytest.mark.parametrize("wrist", ["flip", "no_flip"])
@pytest.mark.parametrize("shoulder", ["left", "right"])
def test_a_configuration_chooses_its_branch(shoulder: str, elbow: str, wrist: str) -> None:
    words = f"configuration: {{shoulder: {shoulder}, elbow: {elbow}, wrist: {wrist}}}"
    plan = planned("{" + DOWN + ", " + words + "}")
    joints = ends(plan)
    expected = wanted(Rotation.from_euler("x", np.pi))
    np.testing.assert_allclose(tcp_of(plan.loaded.robot, joints), expected, atol=1e-9, rtol=0)
    assert (np.sin(joints[4]) > 0) == (wrist == "no_flip")
    mirrored = planned("{" + DOWN + ", " + words.replace(elbow, "down" if elbow == "up" else "up") + "}")
    assert np.sign(ends(mirrored)[2]) == -np.sign(joints[2])


def test_without_a_configuration_the_nearest_branch_is_taken() -> None:
    taken = ends(planned("{" + DOWN + "}"))
    start = np.radians([0, -90, 90, 0, 90, 0])
    every = [
        ends(planned("{" + DOWN + f", configuration: {{shoulder: {s}, elbow: {e}, wrist: {w}}}" + "}"))
        for s in ("left", "right")
        for e in ("up", "down")
        for w in ("flip", "no_flip")
    ]
    distances = [np.abs(joints - start).max() for joints in every]
    np.testing.assert_allclose(taken, every[int(np.argmin(distances))], atol=1e-12, rtol=0)


def test_what_a_target_leaves_out_is_free() -> None:
    plan = planned("{xyz: [400, 100, 250]}")
    pose = tcp_of(plan.loaded.robot, ends(plan))
    np.testing.assert_allclose(pose[:3, 3], [0.4, 0.1, 0.25], atol=1e-9, rtol=0)
    plan = planned("{xyz: [400, 100, 250], direction: [0, 0, -1]}")
    pose = tcp_of(plan.loaded.robot, ends(plan))
    np.testing.assert_allclose(pose[:3, 3], [0.4, 0.1, 0.25], atol=1e-9, rtol=0)
    np.testing.assert_allclose(pose[:3, 2], [0, 0, -1], atol=1e-8, rtol=0)


def test_a_pose_may_be_the_start() -> None:
    job = JOB.replace("{joints: [0, -90, 90, 0, 90, 0]}", "{" + DOWN + ", configuration: {elbow: up}}")
    plan = planned("{joints: [0, -90, 90, 0, 90, 0]}", job)
    expected = wanted(Rotation.from_euler("x", np.pi))
    start = plan.trajectory.start.position
    np.testing.assert_allclose(tcp_of(plan.loaded.robot, start), expected, atol=1e-9, rtol=0)


def test_a_rounded_matrix_is_mended_and_told() -> None:
    plan = planned("{xyz: [400, 100, 250], matrix: [[1, 0, 0], [0, -1, 0.00005], [0, 0, -1]]}")
    assert [event.kind for event in plan.events] == ["nearest_rotation"]
    assert not planned("{" + DOWN + "}").events


@pytest.mark.parametrize(
    ("target", "error", "words"),
    [
        ("{xyz: [4000, 100, 250]}", PlanningError, "cannot reach the pose"),
        ("{rpy: [0, 0, 0], yaw: 3}", InputError, "exclude each other"),
        ("{xyz: [1, 2]}", InputError, "expected 3 numbers, got 2 values"),
        ("{xyz: [1, 2, 3], matrix: [[1, 0, 0], [0, 1, 0], [0, 0, -1]]}", InputError, "determinant"),
        ("{xyz: [1, 2, 3], quat_wxyz: [1, 1, 0, 0]}", InputError, "length 1.41421"),
        ("{joints: 0, xyz: [1, 2, 3]}", InputError, "joints and xyz exclude each other"),
        ("{joints: 0, configuration: {elbow: up}}", InputError, "there is none"),
        ("{xyz: [1, 2, 3], euler: {sequence: ZZX, angles: [1, 2, 3]}}", InputError, "ZZX"),
    ],
)
def test_what_cannot_be_is_said(target: str, error: type[Exception], words: str) -> None:
    with pytest.raises(error) as caught:
        planned(target)
    assert words in str(caught.value)
    assert caught.value.problems[0].place.line == 8


def test_a_robot_without_geometry_reaches_no_pose() -> None:
    with pytest.raises(InputError, match="no geometry"):
        planned("{xyz: [1, 2, 3]}", JOB.replace("ur5e", "{joints: 6}"))


def test_a_configuration_that_the_arm_has_not_is_named() -> None:
    job = JOB.replace("ur5e", "cobra600").replace("[0, -90, 90, 0, 90, 0]", "[0, 0, 100, 0]")
    with pytest.raises(InputError, match="no configuration 'flip'"):
        planned("{xyz: [500, 100, 200], rpy: [180, 0, 0], configuration: {wrist: flip}}", job)


def test_a_resolved_job_with_poses_reads_as_the_same_job() -> None:
    target = "{" + DOWN + ", configuration: {elbow: up}, velocity: 3}"
    job = job_from_text(JOB.replace("TARGET", target))
    again = job_from_text(dump_job(job))
    assert again.job.moves == job.job.moves
    assert dump_job(again) == dump_job(job)


@pytest.mark.parametrize(("pitch", "up"), [(-90, -1), (90, 1)])
def test_a_tool_may_point_straight_up_or_down(pitch: float, up: int) -> None:
    plan = planned("{xyz: [400, 100, 300], pitch: " + str(pitch) + "}")
    pose = tcp_of(plan.loaded.robot, ends(plan))
    np.testing.assert_allclose(pose[:3, 2], [0, 0, up], atol=1e-8, rtol=0)


def branches() -> dict[str, np.ndarray]:
    """Return the joints of each branch that reaches the pose, rad, by its names."""
    return {
        f"{s} {e} {w}": ends(
            planned("{" + DOWN + f", configuration: {{shoulder: {s}, elbow: {e}, wrist: {w}}}" + "}")
        )
        for s in ("left", "right")
        for e in ("up", "down")
        for w in ("flip", "no_flip")
    }


def started(joints: np.ndarray) -> str:
    """Return the job that begins at joints, rad."""
    return JOB.replace("[0, -90, 90, 0, 90, 0]", str(np.degrees(joints).tolist()))


def test_from_each_branch_the_nearest_is_the_same_branch_and_not_that_nearest_to_zero() -> None:
    for name, joints in branches().items():
        plan = planned("{xyz: [402, 99, 251], rpy: [179, 0, 1]}", started(joints))
        assert np.abs(ends(plan) - joints).max() < 0.1, name


def test_a_branch_outside_of_the_limits_is_no_choice() -> None:
    """Where the elbow bends to one side alone, half of the branches are left: others than were asked for are named."""
    every = branches()
    bent = JOB.replace("limits: {", "limits: {position: {elbow_joint: [10, 170]}, ")
    left = {name for name, joints in every.items() if joints[2] > 0}
    assert len(left) == 4
    assert "left up flip" not in left
    for shoulder in ("left", "right"):
        joints = ends(planned("{" + DOWN + f", configuration: {{shoulder: {shoulder}}}" + "}", bent))
        assert min(np.abs(joints - every[name]).max() for name in left if shoulder in name) < 1e-9
    with pytest.raises(PlanningError) as caught:
        planned("{" + DOWN + ", configuration: {shoulder: left, elbow: up}}", bent)
    (problem,) = caught.value.problems
    assert problem.message.endswith("does not reach the pose within its limits in the configuration left up")
    assert set((problem.hint or "").removeprefix("it does in: ").split(", ")) == left


def test_a_pose_may_be_passed_in_motion() -> None:
    rates = "velocity: {elbow_joint: 5}, acceleration: {wrist_1_joint: -3}"
    plan = planned("{" + DOWN + ", " + rates + "}")
    end = plan.trajectory.end
    np.testing.assert_allclose(np.degrees(end.velocity), [0, 0, 5, 0, 0, 0], atol=1e-12)
    np.testing.assert_allclose(np.degrees(end.acceleration), [0, 0, 0, -3, 0, 0], atol=1e-12)


def test_of_several_branches_of_a_start_the_one_that_is_taken_is_named() -> None:
    target = "{joints: [0, -90, 90, 0, 90, 0]}"
    place = JOB.replace("{joints: [0, -90, 90, 0, 90, 0]}", "{" + DOWN + "MORE}").replace("TARGET", target)
    for more, count in (("", 8), (", configuration: {elbow: up}", 4)):
        plan = planned("", place.replace("MORE", more))
        said = [event.message for event in (*plan.events, *plan.remarks) if event.kind == "branch_taken"]
        assert len(said) == 1
        assert said[0].startswith(f"{count} branches reach the start: ")
        assert said[0].endswith("`configuration` says another")
    only = ", configuration: {shoulder: left, elbow: up, wrist: flip}"
    plan = planned("", place.replace("MORE", only))
    assert "branch_taken" not in {event.kind for event in (*plan.events, *plan.remarks)}


def test_a_matrix_is_mended_from_the_last_bits_on() -> None:
    """4 x 4 or 3 x 3: off by 1e-9 it is told, off by 1e-15 it is a rotation."""
    for off, told in ((1e-9, True), (1e-15, False)):
        for rows in (
            f"[1, 0, 0], [0, -1, {off!r}], [0, 0, -1]",
            f"[1, 0, 0, 400], [0, -1, {off!r}, 100], [0, 0, -1, 250], [0, 0, 0, 1]",
        ):
            place = "" if "400" in rows else "xyz: [400, 100, 250], "
            plan = planned("{" + place + "matrix: [" + rows + "]}")
            assert [event.kind for event in plan.events] == ["nearest_rotation"] * told
