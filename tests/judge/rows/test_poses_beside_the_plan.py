"""Rows of a tool in a frame of the job beside its plan: coarse stamps, quaternions of either sign, the first wrong row."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from planned_examples import planned_with_output

from trajcli.geometry.rotation import quaternion_from_matrix
from trajcli.judge.rows.planned_rows import RowComparison, compare_with_plan
from trajcli.kinematics.forward import forward
from trajcli.streams.byte_source import ByteSource

JOB = """
version: 1
units: {angle: deg}
robot: ur5e
frames: {table: {xyz: [0.3, -0.2, 0.1], rpy: [10, 20, 30]}}
limits: {velocity: 720, acceleration: 7200, jerk: null}
start: {joints: [0, -90, 90, -90, -90, -170]}
moves: [{planner: quintic, to: {joints: [20, -80, 90, -90, -90, 170]}, duration: 2}]
"""
OUTPUT = "{rate: 7, in: table, columns: [t, pose]}"
NAMES = ["t", "x", "y", "z", "qw", "qx", "qy", "qz"]
START, END = np.radians([0, -90, 90, -90, -90, -170]), np.radians([20, -80, 90, -90, -90, 170])


def true_rows() -> np.ndarray:
    """Return rows at 7 Hz of the minimum-jerk law, seen from the table; a quaternion goes on from the one before."""
    t = np.append(np.arange(14) / 7, 2.0)
    u = t[:, None] / 2
    q = START + (10 * u**3 - 15 * u**4 + 6 * u**5) * (END - START)
    made = planned_with_output(JOB, OUTPUT)
    poses = np.linalg.inv(made.loaded.job.frames["table"]) @ forward(made.loaded.robot, q)
    turns = quaternion_from_matrix(poses[:, :3, :3])
    for k in range(1, len(turns)):
        turns[k] *= 1.0 if turns[k] @ turns[k - 1] > 0 else -1.0
    assert (turns[:, 0] < 0).any()
    assert (turns[:, 0] > 0).any()
    return np.hstack([t[:, None], poses[:, :3, 3], turns])


def compared(folder: Path, rows: np.ndarray, stamps: int) -> RowComparison:
    """Return what a comparison says of rows with stamps of some decimals, and values of nine."""
    lines = (",".join([f"{t:.{stamps}f}", *(f"{value:.9f}" for value in row)]) for t, *row in rows.tolist())
    (folder / "rows.csv").write_text("\n".join([",".join(NAMES), *lines]) + "\n", encoding="utf-8")
    return compare_with_plan(ByteSource(str(folder / "rows.csv")), planned_with_output(JOB, OUTPUT))


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("stamps", [9, 3])
def test_poses_in_a_frame_are_known_by_stamps_of_few_decimals_too(
    stamps: int, side: float, tmp_path: Path
) -> None:
    """The hand turns nearly once about, so that the quaternion of a row alone may have the other sign."""
    rows = true_rows()
    rows[:, 4:] *= side
    assert compared(tmp_path, rows, stamps).planned


@pytest.mark.parametrize("stamps", [9, 3])
@pytest.mark.parametrize("wrong", [[3], [3, 9], [9, 12], [1, 2, 13]])
def test_the_first_wrong_row_is_told_with_what_the_motion_has_in_that_frame(
    wrong: list[int], stamps: int, tmp_path: Path
) -> None:
    rows = true_rows()
    true = rows[wrong[0], 2]
    for number, row in enumerate(wrong):
        rows[row, 2] += 0.05 * (1 + number)
    found = compared(tmp_path, rows, stamps)
    said = re.fullmatch(r"row (\d+) has y ([-.\d]+), the motion has ([-.\d]+) there", found.difference or "")
    assert said is not None, found.difference
    assert int(said[1]) == wrong[0] + 1
    near = 1e-8 if stamps == 9 else 1e-2
    assert [float(said[2]), float(said[3])] == pytest.approx([true + 0.05, true], abs=near)
