"""The columns about the tool, against products of screw exponentials and their difference quotients."""

from __future__ import annotations

import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from kinematics import oracle_robots as oracle
from scipy.spatial.transform import Rotation
from test_samples import random_curve, rows_of, trajectory_of

from trajcli.columns import columns_of
from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.errors import InputError
from trajcli.geometry.rotation import without_jumps
from trajcli.grids import ListedGrid, UniformGrid
from trajcli.job.read import job_from_text, load_job
from trajcli.kinematics.robot import Joint, Robot, unlimited
from trajcli.output.delivery.joined import write_plan
from trajcli.planning.plan import plan_job
from trajcli.samples import sample
from trajcli.streams.table import read_csv
from trajcli.units import Units

TOOL = ("pose", "twist", "twistd")
STEP = 1e-3  # s
EXAMPLE = Path(__file__).parents[1] / "examples" / "ur5e_pose_columns.yaml"
ARMS = [
    oracle.random_arm(np.random.default_rng(seed), joints, convention)
    for seed, (joints, convention) in enumerate(
        [(1, "standard"), (3, "modified"), (6, "standard"), (7, "modified"), (12, "standard")]
    )
]
EACH_ARM = pytest.mark.parametrize("arm", ARMS, ids=lambda arm: f"{len(arm.joints)} {arm.convention}")


def motion_of(arm, seed=0):
    """A smooth motion of the arm, one polynomial of degree 5 in 1 s."""
    coefficients = np.random.default_rng(seed).normal(size=(6, 1, len(arm.joints))) / 2
    curve = PiecewisePolynomial(np.array([0.0, 1.0]), coefficients)
    return trajectory_of(curve, types=arm.joint_types)


def poses_at(arm, trajectory, times):
    """The poses (N, 4, 4) of the tcp by screw exponentials, q by numpy's own polynomials."""
    coefficients = trajectory.curve.coefficients[:, 0]
    q = np.stack([np.polyval(column, times) for column in coefficients.T], axis=1)
    return oracle.exponentials(*oracle.screws(arm), q)


def twists_at(arm, trajectory, times):
    """The velocities (N, 6) of the tcp in world, by differences of poses, extrapolated to order 4."""

    def change(step):
        low, high = (poses_at(arm, trajectory, times + sign * step) for sign in (-1, 1))
        turn = Rotation.from_matrix(high[:, :3, :3] @ np.swapaxes(low[:, :3, :3], 1, 2)).as_rotvec()
        return np.hstack([high[:, :3, 3] - low[:, :3, 3], turn])

    return (8 * change(STEP) - change(2 * STEP)) / (12 * STEP)


def turning(rate, axis_x, duration, tilt=0.0):
    """A one-jointed arm that turns evenly from zero, and its motion; its axis is x (or z) of the world."""
    base = np.eye(4)
    base[:3, :3] = Rotation.from_euler("y", np.pi / 2 if axis_x else 0.0).as_matrix()
    tool = np.eye(4)
    tool[:3, :3] = base[:3, :3].T @ Rotation.from_euler("x", tilt).as_matrix()
    robot = Robot("turntable", (Joint("j1"),), unlimited(1), "standard", base, tool)
    curve = PiecewisePolynomial(np.array([0.0, duration]), np.array([rate, 0.0]).reshape(2, 1, 1))
    return robot, trajectory_of(curve)


@EACH_ARM
def test_the_pose_is_that_of_the_screws(arm):
    trajectory = motion_of(arm)
    grid = UniformGrid(trajectory.duration, 50.0)
    rows = rows_of(trajectory, grid, ("t", "pose"), robot=arm)
    expected = poses_at(arm, trajectory, rows[:, 0])
    np.testing.assert_allclose(rows[:, 1:4], expected[:, :3, 3], rtol=0, atol=1e-12)
    turned = Rotation.from_quat(rows[:, 4:], scalar_first=True).as_matrix()
    np.testing.assert_allclose(turned, expected[:, :3, :3], rtol=0, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(rows[:, 4:], axis=1), 1.0, rtol=0, atol=4e-15)
    assert rows[0, 4] >= 0


@EACH_ARM
def test_the_twist_is_the_difference_quotient_of_the_pose(arm):
    trajectory = motion_of(arm, 1)
    times = np.linspace(0.05, 0.95, 23)
    rows = rows_of(trajectory, ListedGrid(1.0, times), ("twist",), robot=arm)
    expected = twists_at(arm, trajectory, times)
    np.testing.assert_allclose(rows, expected, rtol=0, atol=1e-8 * (1 + np.abs(expected).max()))


@EACH_ARM
def test_the_derivative_of_the_twist_is_the_difference_quotient_of_twists(arm):
    trajectory = motion_of(arm, 2)
    times = np.linspace(0.05, 0.95, 23)
    rows = rows_of(trajectory, ListedGrid(1.0, times), ("twistd",), robot=arm)
    lower, low, high, higher = (twists_at(arm, trajectory, times + k * STEP) for k in (-2, -1, 1, 2))
    expected = (8 * (high - low) - (higher - lower)) / (12 * STEP)
    np.testing.assert_allclose(rows, expected, rtol=0, atol=1e-7 * (1 + np.abs(expected).max()))
    assert np.abs(expected).max() > 0.1


def test_the_quaternion_goes_on_through_whole_turns_and_across_blocks():
    for axis_x in (False, True):
        robot, trajectory = turning(2 * np.pi, axis_x, 5.0)
        grid = UniformGrid(5.0, 100.0)
        rows = rows_of(trajectory, grid, ("t", "pose"), robot=robot, size=7)
        half = np.pi * rows[:, 0]
        np.testing.assert_allclose(rows[:, 4], np.cos(half), rtol=0, atol=1e-12)
        np.testing.assert_allclose(rows[:, 5 if axis_x else 7], np.sin(half), rtol=0, atol=1e-12)
        # Five whole turns end on the other side: the sign is of the stream, not of the row.
        assert rows[0, 4] == pytest.approx(1)
        assert rows[-1, 4] == pytest.approx(-1)


@pytest.mark.full
@pytest.mark.parametrize("size", [1, 13, 4096])
def test_no_size_of_blocks_changes_a_sign(size):
    arm = ARMS[2]
    curve = random_curve(5, pieces=6, n=6)
    trajectory = trajectory_of(
        PiecewisePolynomial(curve.breaks, curve.coefficients * 3), types=arm.joint_types
    )
    grid = UniformGrid(trajectory.duration, 60.0)
    whole = rows_of(trajectory, grid, TOOL, robot=arm, size=10**6)
    np.testing.assert_allclose(
        rows_of(trajectory, grid, TOOL, robot=arm, size=size), whole, rtol=1e-9, atol=1e-9
    )


@pytest.mark.parametrize("noise", [-1e-16, 0.0, 1e-16])
def test_rounding_decides_no_sign(noise):
    for down in ([noise, 1.0, 0.0, 0.0], [-noise, -1.0, noise, 0.0], [noise, -0.6, noise, 0.8]):
        (first,) = without_jumps(np.array([down]), None)
        assert first[1] > 0
    (first,) = without_jumps(np.array([[-0.6, 0.8, 0.0, 0.0]]), None)
    np.testing.assert_array_equal(first, [0.6, -0.8, 0.0, 0.0])


def test_a_tool_that_points_down_begins_on_one_side_whatever_the_joints_are():
    for angle in np.linspace(0.1, 3.0, 30):
        robot, trajectory = turning(0.0, False, 1.0, tilt=np.pi)
        still = PiecewisePolynomial(np.array([0.0, 1.0]), np.full((1, 1, 1), angle))
        (row,) = rows_of(trajectory_of(still), ListedGrid(1.0, np.array([0.5])), ("pose",), robot=robot)
        # Half a turn about an axis in the horizontal plane, angle / 2 from x.
        expected = [0, np.cos(angle / 2), np.sin(angle / 2), 0]
        np.testing.assert_allclose(row[3:], expected, rtol=0, atol=1e-12)
        assert trajectory.duration == 1.0


def test_units_are_of_lengths_and_angles_but_not_of_quaternions():
    arm = ARMS[1]
    trajectory = motion_of(arm)
    grid = UniformGrid(trajectory.duration, 10.0)
    units = Units("deg", "mm")
    plain, other = (rows_of(trajectory, grid, TOOL, each, robot=arm) for each in (Units(), units))
    metres, radians = [1e3] * 3, [180 / np.pi] * 3
    factors = [*metres, 1, 1, 1, 1, *metres, *radians, *metres, *radians]
    np.testing.assert_allclose(other, plain * factors, rtol=1e-12, atol=1e-9)
    assert [column.name for column in columns_of(TOOL, arm.joint_types, units)] == [
        "x_mm", "y_mm", "z_mm", "qw", "qx", "qy", "qz",
        "vx_mm", "vy_mm", "vz_mm", "wx_deg", "wy_deg", "wz_deg",
        "ax_mm", "ay_mm", "az_mm", "ex_deg", "ey_deg", "ez_deg",
    ]  # fmt: skip


def test_columns_about_the_tool_stand_where_they_are_asked_for():
    arm = ARMS[2]
    trajectory = motion_of(arm)
    grid = UniformGrid(trajectory.duration, 10.0)
    everything = rows_of(trajectory, grid, ("t", "q", "qddd", *TOOL, "move"), robot=arm)
    names = [
        column.name for column in columns_of(("t", "q", "qddd", *TOOL, "move"), arm.joint_types, Units())
    ]
    for groups in (("twistd", "q"), ("move", "pose", "t"), ("twist",), ("qddd", "twist", "pose")):
        places = [
            names.index(name)
            for name in [column.name for column in columns_of(groups, arm.joint_types, Units())]
        ]
        found = rows_of(trajectory, grid, groups, robot=arm)
        np.testing.assert_allclose(found, everything[:, places], rtol=1e-12, atol=1e-12)


def test_without_a_robot_or_its_geometry_there_is_no_tool():
    trajectory = motion_of(ARMS[0])
    grid = UniformGrid(trajectory.duration, 10.0)
    with pytest.raises(InputError, match="'twist' are about a tool"):
        next(sample(trajectory, grid, ("t", "twist")))
    bare = Robot("bare", (Joint("j1"),), unlimited(1), None, np.eye(4), np.eye(4))
    with pytest.raises(InputError, match="no geometry"):
        next(sample(trajectory, grid, ("pose",), robot=bare))


def test_memory_does_not_grow_with_the_rows():
    arm = ARMS[2]
    trajectory = motion_of(arm)

    def peak(rows):
        tracemalloc.start()
        for _ in sample(trajectory, UniformGrid(1.0, rows), TOOL, robot=arm):
            pass
        result = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return result

    few, many = peak(1e4), peak(5e4)
    assert many < 1.1 * few + 1e5


def test_a_job_on_bare_joints_cannot_ask_for_the_tool():
    text = (
        "version: 1\nrobot: {joints: 2}\nstart: {joints: 0}\nmoves:\n  - {planner: hold, duration: 1}\n"
        "output:\n  columns: [t, pose, q, twistd]\n"
    )
    with pytest.raises(InputError) as caught:
        job_from_text(text, "j.yaml")
    first, second = caught.value.problems
    assert first.message == "the columns 'pose' need a robot with geometry, robot has bare joints"
    assert "DH row" in first.hint
    assert (first.place.file, first.place.line, first.place.column) == ("j.yaml", 7, 16)
    assert "'twistd'" in second.message
    assert second.place.column == 25
    assert job_from_text(text.replace("pose, q, twistd", "q")).robot.convention is None


def test_the_rows_of_a_file_have_base_and_tool_of_the_robot(tmp_path):
    text = """\
version: 1
units: {angle: deg, length: mm}
robot:
  convention: standard
  joints: [{a: 300}, {a: 200}]
  base: {xyz: [1000, 0, 50]}
  tool: {xyz: [0, 0, 40]}
start: {joints: [0, 0]}
moves: [{planner: quintic, to: {joints: [90, 90]}, duration: 1}]
output: {rate: 10, columns: [t, pose]}
"""
    write_plan(plan_job(job_from_text(text)), str(tmp_path / "rows.csv"))
    table = read_csv(str(tmp_path / "rows.csv"))
    half = np.sqrt(0.5)
    np.testing.assert_allclose(table.columns[0, 1:], [1500, 0, 90, 1, 0, 0, 0], rtol=0, atol=1e-9)
    np.testing.assert_allclose(table.columns[-1, 1:], [800, 300, 90, 0, 0, 0, 1], rtol=0, atol=2e-9)
    middle = [1000 + 300 * half, 200 + 300 * half, 90, half, 0, 0, half]
    np.testing.assert_allclose(table.columns[5, 1:], middle, rtol=0, atol=2e-9)


def test_the_example_shows_what_it_promises():
    loaded = load_job(EXAMPLE)
    plan = plan_job(loaded)
    groups = loaded.job.output.columns
    rows = rows_of(plan.trajectory, UniformGrid(plan.trajectory.duration, 20.0), groups, robot=loaded.robot)
    w = rows[:, 4]
    assert w.min() < -1e-3 < 1e-3 < w.max()
    assert (np.einsum("ni,ni->n", rows[1:, 4:8], rows[:-1, 4:8]) > 0.9).all()
