"""Frames against products of matrices, and what is given in them against the same in world."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.cli.running import call
from trajcli.errors import InputError
from trajcli.job.dump import dump_job
from trajcli.job.read import LoadedJob, job_from_text
from trajcli.kinematics.forward import forward
from trajcli.planning.plan import plan_job

HEAD = """\
version: 1
units: {angle: deg, length: mm}
robot: ur5e
limits: {acceleration: 800, jerk: 4000}
start: {joints: [0, -90, 90, 0, 90, 0]}
"""
MOVES = "moves: [{planner: quintic, to: {joints: [10, -90, 90, 0, 90, 0]}, duration: 3}]\n"
BASE = "base: {xyz: [10, 20, 300], rpy: [5, -10, 70]}\n"
FRAMES = """\
frames:
  last: {in: middle, xyz: [1, 2, 3], rotvec: [30, 40, 50]}
  middle: {in: first, matrix: [[0, 1, 0, 10], [0, 0, 1, 20], [1, 0, 0, -30], [0, 0, 0, 1]]}
  first: {in: base, xyz: [100, 50, 7], rpy: [10, 20, 30]}
  moved: {xyz: [100, 50, 7]}
  round: {xyz: [0, 0, 7], rpy: [0, 0, 30]}
  under: {xyz: [0, 0, 7], rpy: [180, 0, 30]}
"""


def homogeneous(rotation: Rotation, *xyz: float) -> np.ndarray:
    result = np.eye(4)
    result[:3, :3], result[:3, 3] = rotation.as_matrix(), np.array(xyz) / 1e3
    return result


def angles(*degrees: float) -> Rotation:
    return Rotation.from_euler("xyz", degrees, degrees=True)


BASE_POSE = homogeneous(angles(5, -10, 70), 10, 20, 300)
FIRST = BASE_POSE @ homogeneous(angles(10, 20, 30), 100, 50, 7)
MIDDLE = FIRST @ homogeneous(Rotation.from_matrix([[0, 1, 0], [0, 0, 1], [1, 0, 0]]), 10, 20, -30)
LAST = MIDDLE @ homogeneous(Rotation.from_rotvec([30, 40, 50], degrees=True), 1, 2, 3)


def read(points: str = "", moves: str = MOVES, frames: str = FRAMES) -> LoadedJob:
    return job_from_text(HEAD + BASE + frames + (f"points:\n{points}" if points else "") + moves, "job.yaml")


def test_frames_in_frames_are_products() -> None:
    frames = read().job.frames
    for name, expected in {"first": FIRST, "middle": MIDDLE, "last": LAST}.items():
        np.testing.assert_allclose(frames[name], expected, atol=1e-12)


def test_poses_in_a_frame_are_products_wherever_they_stand() -> None:
    pose = "in: last, xyz: [4, 5, 6], axis_angle: {axis: [1, 2, 3], angle: 40}"
    points = f"  a: {{{pose}, configuration: {{elbow: up}}}}\n  b: a\n  c: {{from: b, offset: {{xyz: [0, 0, 9]}}}}\n"
    moves = f"moves: [{{planner: time_optimal, through: [{{{pose}}}, a], to: {{{pose}}}}}]\n"
    job = read(points, moves).job
    axis = np.array([1, 2, 3]) / np.sqrt(14)
    expected = LAST @ homogeneous(Rotation.from_rotvec(np.radians(40) * axis), 4, 5, 6)
    move = job.moves[0]
    targets = [job.points["a"], job.points["b"], move.to, *move.through]  # type: ignore[attr-defined]
    for target in targets:
        np.testing.assert_allclose(target.full_pose(), expected, atol=1e-12)
    assert job.points["b"].configuration is not None
    above = expected @ homogeneous(Rotation.identity(), 0, 0, 9)
    np.testing.assert_allclose(job.points["c"].full_pose(), above, atol=1e-12)


def test_parts_of_an_orientation_turn_with_the_frame() -> None:
    aim = Rotation.from_matrix(LAST[:3, :3]).apply([1, 2, 3])
    turn = angles(0, 0, 30)
    over = turn * angles(180, 0, 0)
    points = read(
        "  d: {in: last, direction: [1, 2, 3], tool_axis: x}\n"
        "  y: {in: round, yaw: 20}\n  p: {in: round, xyz: [5, 0, 0], pitch: 20}\n"
        "  m: {in: moved, xyz: [1, 2, 3], yaw: 20}\n"
        "  u: {in: under, yaw: 20}\n  v: {in: under, pitch: 20}\n"
    ).job.points
    np.testing.assert_allclose(points["d"].direction, aim, atol=1e-12)
    assert points["d"].tool_axis == "x"

    def heading(rotation: Rotation, yaw: float, pitch: float) -> tuple[float, float]:
        x, y, z = rotation.apply(Rotation.from_euler("yz", [-pitch, yaw], degrees=True).apply([1, 0, 0]))
        return float(np.arctan2(y, x)), float(np.arcsin(z))

    assert points["y"].yaw == pytest.approx(heading(turn, 20, 0)[0], abs=1e-12)
    assert points["u"].yaw == pytest.approx(heading(over, 20, 0)[0], abs=1e-12)
    assert points["p"].pitch == pytest.approx(heading(turn, 0, 20)[1], abs=1e-12)
    assert points["v"].pitch == pytest.approx(heading(over, 0, 20)[1], abs=1e-12)
    assert points["m"].yaw == pytest.approx(np.radians(20), abs=0)
    np.testing.assert_allclose(points["m"].xyz, [0.101, 0.052, 0.01], atol=1e-15)
    np.testing.assert_allclose(
        points["p"].xyz, turn.apply([0.005, 0, 0]) + np.array([0, 0, 0.007]), atol=1e-15
    )


def test_an_offset_along_the_axes_of_a_frame() -> None:
    pick = homogeneous(angles(170, 20, 30), 400, 100, 50)
    points = "  pick: {xyz: [400, 100, 50], rpy: [170, 20, 30]}\n"
    points += "  p: {from: pick, offset: {xyz: [1, 2, 3], rpy: [4, 5, 6]}, frame: last}\n"
    found = read(points).job.points["p"].full_pose()
    axes, turn = LAST[:3, :3], angles(4, 5, 6).as_matrix()
    np.testing.assert_allclose(found[:3, 3], pick[:3, 3] + axes @ [0.001, 0.002, 0.003], atol=1e-12)
    np.testing.assert_allclose(found[:3, :3], axes @ turn @ axes.T @ pick[:3, :3], atol=1e-12)


@pytest.mark.full
def test_a_frame_that_turns_with_its_base_leaves_the_joints_alone() -> None:
    text = """\
frames: {cell: {in: base, xyz: [400, 100, 100]}}
moves:
  - {planner: jerk_limited, to: {in: cell, xyz: [0, 0, 200], rpy: [180, 0, 0]}}
  - {planner: line, to: {in: cell, xyz: [0, 100, 100], rpy: [170, 0, 20]}, law: {shape: quintic, duration: 2}}
"""
    plain, turned = (plan_job(job_from_text(HEAD + base + text)) for base in ("", BASE))
    assert turned.loaded.robot.base[0, 3] == 0.01
    times = np.linspace(0, plain.trajectory.duration, 200)
    for order in range(3):
        rows, expected = (each.trajectory.curve.evaluate(times, order) for each in (turned, plain))
        assert np.abs(rows - expected).max() < 1e-6 * np.abs(expected).max()


GRID = """\
frames:
  tray: {xyz: [300, -200, 50], rpy: [0, 5, 20]}
  lane: {grid: {from: tray, steps: [{count: 3, xyz: [0, 100, 0]}], frame: tray}}
points:
  corner: {in: lane, xyz: [0, 0, 100], rpy: [180, 0, 0]}
  slot: {grid: {from: corner, steps: [{count: 2, xyz: [50, 0, 0]}]}}
moves:
  - repeat: lane
    moves: [{repeat: slot, moves: [{planner: jerk_limited, to: slot}]}]
"""


def test_a_grid_of_frames_and_a_grid_in_each_of_them() -> None:
    moves = job_from_text(HEAD + GRID).job.moves
    tray = homogeneous(angles(0, 5, 20), 300, -200, 50)
    expected = [
        tray @ homogeneous(angles(180, 0, 0), 50 * place, 100 * lane, 100)
        for lane in range(3)
        for place in range(2)
    ]
    found = [move.to.full_pose() for move in moves]  # type: ignore[attr-defined]
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_rows_of_poses_in_a_frame(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    output = "output: {rate: 200, columns: [t, q, qd, qdd, pose, twist, twistd], in: last}\n"
    move = "moves: [{planner: quintic, to: {joints: [40, -80, 70, 0, 60, 0]}}]\n"
    job, rows = tmp_path / "job.yaml", tmp_path / "rows.csv"
    job.write_text(HEAD + BASE + FRAMES + move + output, encoding="utf-8")
    assert call(capfd, "plan", str(job), "--si", "-o", str(rows)).code == 0
    table = np.genfromtxt(rows, delimiter=",", names=True)
    data = np.array(table.tolist())
    inverse = np.linalg.inv(LAST)
    robot = job_from_text(job.read_text(encoding="utf-8")).robot
    poses = inverse @ forward(robot, data[:, 1:7])
    np.testing.assert_allclose(data[:, 19:22], poses[:, :3, 3], atol=1e-8)
    turned = Rotation.from_quat(data[:, [23, 24, 25, 22]]).inv() * Rotation.from_matrix(poses[:, :3, :3])
    assert turned.magnitude().max() < 1e-8
    slopes = np.gradient(poses[:, :3, 3], data[:, 0], axis=0)[2:-2]
    assert np.abs(slopes - data[2:-2, 26:29]).max() < 2e-3
    slopes = np.gradient(data[:, 26:29], data[:, 0], axis=0)[2:-2]
    assert np.abs(slopes - data[2:-2, 32:35]).max() < 1e-2
    assert call(capfd, "check", str(rows), "--job", str(job)).code == 0
    changed = rows.read_text(encoding="utf-8").replace("\n0.1,", "\n0.1,", 1).splitlines()
    fields = changed[30].split(",")
    fields[19] = str(float(fields[19]) + 0.001)
    changed[30] = ",".join(fields)
    rows.write_text("\n".join(changed) + "\n", encoding="utf-8")
    found = call(capfd, "check", str(rows), "--job", str(job))
    assert found.code == 1
    assert "x -" in found.out
    again = job_from_text(dump_job(job_from_text(job.read_text(encoding="utf-8"))))
    np.testing.assert_array_equal(again.job.frames["last"], read().job.frames["last"])


WRONG = [
    ("  a: {from: base}\n", "", 8, "unknown key 'from'"),
    ("  a: {from: base, offset: {xyz: [0, 0, 1]}, frame: world}\n", "", 8, "unknown key 'from'"),
    ("  a: {in: b}\n  b: {in: a}\n", "", 8, "'b' is given in itself (b -> a -> b)"),
    ("  a: {in: a}\n", "", 8, "'a' is given in itself"),
    ("  a: {in: wrld}\n", "", 8, "there is no frame 'wrld'"),
    ("  a: {xyz: [0, 0]}\n  b: {in: a}\n", "", 8, "expected 3 numbers"),
    ("  a: {xyz: [0, 0, 0]}\n", "  a: {joints: 0}\n", 10, "'a' is a point and a frame"),
    ("  base: {xyz: [0, 0, 0]}\n", "", 8, "'base' is no name"),
    ("  a: {rpy: [0, 5, 0]}\n", "  p: {in: a, yaw: 3}\n", 10, "the z axis of 'a' leans"),
    ("  a: {rpy: [0, 5, 0]}\n", "  p: {in: a, joints: 3}\n", 10, "there is none"),
    ("  a: {rpy: [0, 5, 0]}\n", "  p: {in: b, xyz: [0, 0, 0]}\n", 10, "there is no frame 'b'"),
    ("  a: {rpy: [0, 5, 0]}\n", "  p: {in: a, xyz: [0, 0]}\n", 10, "expected 3 numbers"),
    (
        "  a: {xyz: [0, 0, 0]}\n",
        "  p: {xyz: [0, 0, 0]}\n  q: {from: p, in: a, offset: {}}\n",
        11,
        "from and in exclude each other",
    ),
]


@pytest.mark.parametrize(("frames", "points", "line", "message"), WRONG)
def test_wrong_frames_are_refused_on_their_line(frames: str, points: str, line: int, message: str) -> None:
    with pytest.raises(InputError) as caught:
        read(points, frames=f"frames:\n{frames}")
    (problem,) = caught.value.problems
    assert message in problem.message
    assert problem.place is not None
    assert problem.place.line == line


def test_a_long_chain_of_frames_is_refused_where_it_begins() -> None:
    def job(count: int) -> str:
        chain = "".join(f"  f{k}: {{in: f{k + 1}, xyz: [0, 0, 1]}}\n" for k in range(count - 1))
        last = f"  f{count - 1}: {{xyz: [0, 0, 0]}}\npoints: {{p: {{in: f0, xyz: [0, 0, 0]}}}}\n"
        return f"{HEAD}frames:\n{chain}{last}{MOVES}"

    assert job_from_text(job(100)).job.points["p"].xyz == pytest.approx((0, 0, 0.099))
    with pytest.raises(InputError) as caught:
        job_from_text(job(102))
    problems = caught.value.problems
    assert {problem.message for problem in problems} == {"more than 100 frames stand one in the next"}
    assert {problem.hint for problem in problems} == {"give one in world"}
    assert [problem.place.source[:4] for problem in problems if problem.place] == ["  f0", "poin"]
