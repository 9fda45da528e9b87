"""Poses and Jacobians of one configuration and of rows in blocks, by matrix products and their differences."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tiers import few

from trajcli.kinematics.robot import Robot
from trajcli.queries.arm import ArmInUnits, LimitWatch, open_arm
from trajcli.queries.forward import jacobians_of, poses_of
from trajcli.queries.jacobian import jacobian_report, simplest
from trajcli.streams.table import TableBlocks

ROBOT = """\
units: {angle: deg, length: mm}
convention: standard
joints:
  - {theta: 20, d: 100, a: 300, alpha: 70}
  - {type: prismatic, theta: -30, d: 50, a: 20, alpha: -90, sign: -1}
  - {a: 150, alpha: 40}
base: {xyz: [100, 200, 300], rpy: [10, 20, 30]}
tool: {xyz: [10, 20, 30], rpy: [40, 50, 60]}
"""
NAMES = ("q3_deg", "note", "t", "q1_deg", "q2_mm")  # in no order, and not all are values of joints
FACTORS = np.array([np.pi / 180, 1e-3, np.pi / 180])


@pytest.fixture
def arm(tmp_path: Path) -> ArmInUnits:
    (tmp_path / "arm.yaml").write_text(ROBOT)
    return open_arm(str(tmp_path / "arm.yaml"))


def turn(axis: str, angle: float) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_euler(axis, angle).as_matrix()
    return matrix


def slide(x: float, z: float) -> np.ndarray:
    matrix = np.eye(4)
    matrix[[0, 2], 3] = x, z
    return matrix


def pose(robot: Robot, q: np.ndarray) -> np.ndarray:
    """Return the pose of the tcp as the product of elementary matrices."""
    matrix = robot.base
    for joint, value in zip(robot.joints, joint_values(robot, q), strict=True):
        theta, d = value
        matrix = matrix @ turn("z", theta) @ slide(joint.a, d) @ turn("x", joint.alpha)
    return np.asarray(matrix @ robot.tool)


def joint_values(robot: Robot, q: np.ndarray) -> list[tuple[float, float]]:
    return [
        (joint.theta, joint.d + joint.sign * value)
        if joint.type == "prismatic"
        else (joint.theta + joint.sign * value, joint.d)
        for joint, value in zip(robot.joints, q, strict=True)
    ]


def differences(robot: Robot, q: np.ndarray, frame: str) -> np.ndarray:
    """Return the Jacobian (6, n) by central differences."""
    step, columns = 1e-6, []
    axes = {"world": np.eye(3), "base": robot.base[:3, :3], "tcp": pose(robot, q)[:3, :3]}[frame]
    for change in step * np.eye(len(q)):
        high, low = pose(robot, q + change), pose(robot, q - change)
        angular = Rotation.from_matrix(high[:3, :3] @ low[:3, :3].T).as_rotvec()
        columns.append(np.concatenate([(high - low)[:3, 3] @ axes, angular @ axes]) / (2 * step))
    return np.array(columns).T


def rows_of(values: np.ndarray, names: Sequence[str] = NAMES, more: np.ndarray | None = None) -> TableBlocks:
    """Return joint values (N, 3), SI, as two blocks of a file."""
    q = values / FACTORS
    rows = np.stack([q[:, 2], 7 * np.ones(len(q)), 5 + 0.5 * np.arange(len(q)), q[:, 0], q[:, 1]], axis=1)
    rows = rows if more is None else np.hstack([rows, more])
    return TableBlocks(tuple(names), iter([rows[:3], rows[3:]]), "rows.csv")


Q = np.array(
    [[0.0, 0.1, -0.2], [2.1, -0.05, 0.4], [4.2, 0.0, 0.5], [4.6, 0.2, 0.9], [5.5, 0.1, 5.0], [7.5, 0.3, 7.0]]
)


def test_poses_are_products_of_matrices_and_their_quaternions_never_jump(arm: ArmInUnits) -> None:
    stream = poses_of(arm, rows_of(Q), LimitWatch(arm.robot))
    assert [column.name for column in stream.columns] == ["t", "x_mm", "y_mm", "z_mm", "qw", "qx", "qy", "qz"]
    rows = np.vstack(list(stream.blocks))
    assert rows[:, 0].tolist() == [5, 5.5, 6, 6.5, 7, 7.5]
    expected = np.array([pose(arm.robot, q) for q in Q])
    assert rows[:, 1:4] == pytest.approx(1000 * expected[:, :3, 3])
    quaternions = rows[:, 4:]
    found = Rotation.from_quat(quaternions[:, [1, 2, 3, 0]]).as_matrix()
    assert found == pytest.approx(expected[:, :3, :3], abs=1e-12)
    assert (np.einsum("ij,ij->i", quaternions[1:], quaternions[:-1]) >= 0).all()
    assert quaternions[0, 0] >= 0
    assert (quaternions[:, 0] < 0).any()  # the turns go so far that w >= 0 everywhere would jump


@pytest.mark.parametrize("frame", few(["tcp", "base", "world"], 3))
def test_jacobians_and_measures_are_those_of_differences(frame: str, arm: ArmInUnits) -> None:
    stream = jacobians_of(arm, rows_of(Q), frame, LimitWatch(arm.robot))  # type: ignore[arg-type]
    assert [column.name for column in stream.columns[:4]] == [
        "t",
        "manipulability",
        "inverse_condition",
        "J11",
    ]
    rows = np.vstack(list(stream.blocks))
    assert rows[:, 0].tolist() == [5, 5.5, 6, 6.5, 7, 7.5]
    length = 0.3 + 0.1 + 0.05 + 0.02 + 0.15 + np.linalg.norm([0.01, 0.02, 0.03])  # as the documents define it
    for q, row in zip(Q, rows, strict=True):
        matrix = differences(arm.robot, q, frame)
        assert row[3:].reshape(6, 3) == pytest.approx(matrix, abs=1e-8)
        assert row[1] == pytest.approx(np.linalg.svd(matrix, compute_uv=False).prod(), rel=1e-6)
        scaled = np.linalg.svd(matrix / np.repeat([length, 1], 3)[:, None], compute_uv=False)
        assert row[2] == pytest.approx(scaled[-1] / scaled[0], rel=1e-6)


@pytest.mark.parametrize("frame", few(["tcp", "base", "world"], 3))
def test_a_report_is_in_rad_and_the_unit_of_length_and_its_bias_is_the_change_of_the_twist(
    frame: str, arm: ArmInUnits
) -> None:
    q, qd, scale = Q[3], np.array([0.7, -0.4, 0.9]), np.repeat([1000.0, 1.0], 3)
    report = jacobian_report(arm, q, frame, qd)  # type: ignore[arg-type]
    plain = differences(arm.robot, q, frame)
    assert np.array(report["jacobian"]) == pytest.approx(plain * scale[:, None] * [1, 1e-3, 1], abs=1e-5)
    axes = {"world": np.eye(3), "base": arm.robot.base[:3, :3], "tcp": pose(arm.robot, q)[:3, :3]}[frame]
    step = 1e-4
    after, before = (differences(arm.robot, q + step * side * qd, "world") @ qd for side in (1, -1))
    bias = (after - before).reshape(2, 3) / (2 * step) @ axes
    assert report["jdot_qd"] == pytest.approx(bias.reshape(6) * scale, abs=1e-2)


def test_on_a_rail_the_base_is_that_of_the_rail(tmp_path: Path) -> None:
    (tmp_path / "job.yaml").write_text("""version: 1
robot: {rail: {axis: x}, arm: planar2r}
base: {xyz: [1, 2, 3], rpy: [0.1, 0.2, 0.3]}
start: {joints: 0}
moves: [{planner: hold, duration: 1}]
""")
    arm = open_arm(str(tmp_path / "job.yaml"), si=True)
    q = np.array([0.5, 0.1, 0.2])
    turned = Rotation.from_euler("xyz", [0.1, 0.2, 0.3]).as_matrix()
    in_world, in_base = (np.array(jacobian_report(arm, q, frame)["jacobian"]) for frame in ("world", "base"))
    assert in_base[:, 0] == pytest.approx([1, 0, 0, 0, 0, 0], abs=1e-12)  # the rail goes along its own x
    for rows in (slice(3), slice(3, 6)):
        assert turned @ in_base[rows] == pytest.approx(in_world[rows])
    for frame, matrix in (("world", in_world), ("base", in_base)):
        report = jacobian_report(arm, q, frame, np.ones(3))  # type: ignore[arg-type]
        assert len(report["singular_directions"]) == 3
        for direction in report["singular_directions"]:
            assert np.array(direction) @ matrix == pytest.approx(np.zeros(3), abs=1e-9)
        axes = np.eye(3) if frame == "world" else turned
        bias = (jacobian_report(arm, q + 1e-5, "world"), jacobian_report(arm, q - 1e-5, "world"))
        change = (np.array(bias[0]["jacobian"]) - np.array(bias[1]["jacobian"])) @ np.ones(3) / 2e-5
        assert np.array(report["jdot_qd"]).reshape(2, 3) == pytest.approx(
            change.reshape(2, 3) @ axes, abs=1e-6
        )


def test_idle_motions_are_in_rad_and_m_with_exact_zeros(tmp_path: Path) -> None:
    slides = "{type: prismatic}, {type: prismatic, sign: -1}"
    (tmp_path / "arm.yaml").write_text(
        "units: {angle: deg, length: mm}\nconvention: standard\nbase: {rpy: [10, 20, 30]}\n"
        f"joints: [{slides}, {{alpha: 90, a: 100}}, {{a: 50}}]\n"
    )
    (idle,) = jacobian_report(open_arm(str(tmp_path / "arm.yaml")), np.array([0.1, 0.2, 0.3, 0.4]), "tcp")[
        "idle_motions"
    ]
    assert idle == pytest.approx([np.sqrt(0.5), np.sqrt(0.5), 0, 0])
    assert idle[2:] == [0.0, 0.0]
    assert simplest(np.array([[1.0, -1e-8, 1e-14]])).tolist() == [[1.0, -1e-8, 0.0]]


@pytest.mark.parametrize(("unit", "suffix"), [(1000.0, "_mm"), (1.0, "")])
@pytest.mark.parametrize("row", [0, 2, 5])
def test_how_far_the_tool_is_from_where_rows_say_is_the_largest_of_all(
    row: int, unit: float, suffix: str, arm: ArmInUnits
) -> None:
    said = np.array([pose(arm.robot, q) for q in Q])
    said[row, :3, 3] += [0.03, 0.0, -0.04]
    frame = turn("x", 0.5) @ turn("z", 1.2) @ slide(0.4, -0.7)
    for watch_frame, poses in ((None, said), (frame, np.linalg.inv(frame) @ said)):
        watch = LimitWatch(arm.robot)
        watch.frame = watch_frame
        more = np.hstack([poses[:, :3, 3] * unit, np.ones((len(Q), 4))])
        names = (*NAMES, *(f"{axis}{suffix}" for axis in "xyz"), "qw", "qx", "qy", "qz")
        list(poses_of(arm, rows_of(Q, names, more), watch).blocks)
        assert watch.tool_off == pytest.approx(0.05)
