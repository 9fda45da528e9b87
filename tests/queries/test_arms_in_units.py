"""Arms in the units of their users: numbers in and out, tools and bases, frames of rows, a watch on limits."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from trajcli.errors import InputError
from trajcli.job.read import job_from_text
from trajcli.kinematics.forward import forward
from trajcli.queries.arm import LimitWatch, frame_of_rows, open_arm, stated_units

ROBOT = """\
units: {angle: deg, length: mm}
convention: standard
joints:
  - {name: turn, a: 300, position: [-150, 150]}
  - {name: lift, type: prismatic, alpha: 90, position: [0, 200]}
  - {name: tilt, a: 100, position: [-90, 90]}
tool: {xyz: [10, 0, 0]}
"""


@pytest.fixture
def file(tmp_path: Path) -> str:
    path = tmp_path / "arm.yaml"
    path.write_text(ROBOT)
    return str(path)


def test_words_are_read_in_the_unit_of_each_joint_and_order(file: str) -> None:
    arm = open_arm(file)
    assert arm.joint_values(["90,50", "-180"]) == pytest.approx([np.pi / 2, 0.05, -np.pi])
    rates = arm.joint_values(["90 deg/s, 0.5 m/s, 1 rad/s"], "--qd", 1)
    assert rates == pytest.approx([np.pi / 2, 0.5, 1.0])
    accelerations = arm.joint_values(["90 deg/s^2, 5, 1"], "--qdd", 2)
    assert accelerations == pytest.approx([np.pi / 2, 0.005, np.pi / 180])
    assert [arm.joint_unit(1, order) for order in range(3)] == ["mm", "mm/s", "mm/s^2"]
    assert arm.joint_factors == pytest.approx([np.pi / 180, 1e-3, np.pi / 180])
    with pytest.raises(InputError, match="--qd of turn"):
        arm.joint_values(["90 deg, 5, 1"], "--qd", 1)


@pytest.mark.parametrize(("words", "count"), [("1,2", 2), ("1,2,3,4", 4)])
def test_there_is_a_value_for_each_joint(words: str, count: int, file: str) -> None:
    with pytest.raises(InputError, match=f"q has {count} values, .* has 3 joints"):
        open_arm(file).joint_values([words])


def test_tool_and_base_are_read_in_the_units_that_are_shown(file: str) -> None:
    arm = open_arm(
        file, "{xyz: [0, 0, 0.1], rpy: [0, 1, 0]}", base="{xyz: [1, 0, 0], rpy: [0, 0, 1]}", units="rad,m"
    )
    tool, base = np.eye(4), np.eye(4)
    tool[:3, :3], tool[2, 3] = Rotation.from_euler("y", 1).as_matrix(), 0.1
    base[:3, :3], base[0, 3] = Rotation.from_euler("z", 1).as_matrix(), 1.0
    assert arm.robot.tool == pytest.approx(tool)
    assert arm.robot.base == pytest.approx(base)
    assert open_arm(file).robot.tool[0, 3] == pytest.approx(0.01)
    half = open_arm(file, units="rad").units
    assert (half.angle, half.length) == ("rad", "mm")  # what is left out is as in the file


def test_what_the_tool_of_a_job_weighs_goes_with_it(tmp_path: Path) -> None:
    path = tmp_path / "job.yaml"
    path.write_text(
        "version: 1\nrobot: ur5e\ntool: {xyz: [0, 0, 0.1], mass: 2}\nstart: {joints: 0}\n"
        "moves: [{planner: hold, duration: 1}]\n"
    )
    load = open_arm(str(path)).robot.tool_load
    assert load is not None
    assert load.mass == 2
    assert open_arm(str(path), "{xyz: [0, 0, 0.2]}").robot.tool_load is None


@pytest.mark.parametrize(
    ("units", "found"),
    [
        ("{angle: deg, length: mm}", ("deg", "mm")),
        ("{angle: deg}", ("deg", "m")),
        ("{length: mm}", ("rad", "mm")),
        ("{angle: rad, length: m}", ("rad", "m")),
        ("{}", None),
    ],
)
def test_units_that_a_file_states(units: str, found: tuple[str, str] | None, tmp_path: Path) -> None:
    path = tmp_path / "arm.yaml"
    path.write_text(ROBOT.replace("{angle: deg, length: mm}", units))
    stated = stated_units(str(path))
    assert (stated and (stated.angle, stated.length)) == found


def test_rows_in_a_frame_of_the_job_are_brought_to_world() -> None:
    job = job_from_text("""
version: 1
units: {angle: deg}
robot: {convention: standard, joints: [{a: 0.4}, {a: 0.3, alpha: 90}]}
base: {xyz: [1, 2, 3], rpy: [10, 20, 30]}
frames: {table: {xyz: [0.5, -0.2, 0.1], rpy: [40, -50, 60]}}
start: {joints: [0, 0]}
moves: [{planner: quintic, to: {joints: [30, 60]}, duration: 1}]
output: {in: table}
""")
    found = frame_of_rows(job)
    assert found is not None
    assert found[:3, 3] == pytest.approx([0.5, -0.2, 0.1])
    assert found[:3, :3] == pytest.approx(Rotation.from_euler("xyz", [40, -50, 60], degrees=True).as_matrix())
    q = np.radians([20.0, 50.0])
    assert found @ forward(job.robot_of_rows, q) == pytest.approx(forward(job.robot, q))


def test_the_watch_counts_over_blocks_and_keeps_what_was_first(file: str) -> None:
    robot = open_arm(file).robot
    watch = LimitWatch(robot)
    factors, units = np.array([np.pi / 180, 1e-3, np.pi / 180]), ["deg", "mm", "deg"]
    blocks = [
        np.array([[0, 0, 0], [150.4, 200.4, 0]]),  # within the room of a half
        np.array([[0, 0, 0], [-151, -100, 180], [0, 0, -95]]),
        np.array([[0, 300, 0]]),
    ]
    for number, block in enumerate(blocks):
        watch.see(block * factors, factors, units, 10.0 * number + np.arange(len(block)), 0.5)
    assert (watch.rows, watch.outside) == (6, 3)
    first = watch.first
    assert first is not None
    assert (first.row, first.time, first.joint, first.unit, first.others) == (3, 11.0, "tilt", "deg", 2)
    assert (first.value, first.limit) == pytest.approx((180, 90))
    assert watch.remark is None


def test_the_joint_furthest_outside_is_named_below_its_range_too(file: str) -> None:
    watch = LimitWatch(open_arm(file).robot)
    watch.see(np.array([[2.7, 0.1, -3.0]]), np.ones(3), ["rad", "m", "rad"])
    assert watch.first is not None
    assert (watch.first.joint, watch.first.time) == ("tilt", None)
    assert watch.first.limit == pytest.approx(-np.pi / 2)


@pytest.mark.parametrize(("value", "said"), [(13.0, True), (-13.0, True), (12.5, False)])
def test_radians_beyond_two_turns_are_remarked_once_and_for_all(value: float, said: bool, file: str) -> None:
    watch = LimitWatch(open_arm(file).robot)
    for block in ([0, 0, value], [0, 0, 0]):
        watch.see(np.array([block]), np.ones(3), ["deg", "m", "rad"])
    assert (watch.remark is not None) == said
    other = LimitWatch(open_arm(file).robot)
    other.see(np.array([[value, 20.0, 0]]), np.ones(3), ["deg", "m", "rad"])
    assert other.remark is None
