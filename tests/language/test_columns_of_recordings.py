"""Columns of recordings that jobs name: what joint, what unit, what time."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from trajcli.errors import InputError
from trajcli.job.read import load_job
from trajcli.language.recorded import Recorded, RecordedPoses

DEG = math.pi / 180
MIXED = "{joints: [{name: turn}, {name: lift, type: prismatic}]}"
SLIDES = "{joints: [{name: x, type: prismatic}, {name: y, type: prismatic}]}"


def recorded(folder: Path, rows: str, robot: str = MIXED, units: str = "{}", more: str = "") -> Recorded:
    (folder / "rows.csv").write_text(rows, encoding="utf-8")
    job = f"version: 1\nunits: {units}\nrobot: {robot}\nstart: {{joints: 0}}\nmoves:\n"
    job += f"  - {{planner: spline, through: {{csv: rows.csv{more}}}}}\n"
    (folder / "job.yaml").write_text(job, encoding="utf-8")
    (move,) = load_job(folder / "job.yaml").job.moves
    return move.through  # type: ignore[attr-defined, no-any-return]


NAMED = [  # names of columns, a row, rad and m
    ("q1,q2", "30,40", (30, 40)),
    ("q2,q1", "40,30", (30, 40)),
    ("q1_deg,q2_mm", "30,40", (30 * DEG, 0.04)),
    ("turn_deg,lift_mm", "30,40", (30 * DEG, 0.04)),
    ("lift,turn", "-40,-30", (-30, -40)),
    ("lift_mm,q1,x,qd1,tau1", "40,30,5,6,7", (30, 0.04)),
]


@pytest.mark.parametrize("units", ["{}", "{angle: deg, length: mm}"])
@pytest.mark.parametrize(("names", "row", "si"), NAMED)
def test_columns_say_joint_and_unit_whatever_the_units_of_the_job(
    names: str, row: str, si: tuple[float, float], units: str, tmp_path: Path
) -> None:
    found = recorded(tmp_path, f"{names}\n{row}\n{row}\n", units=units)
    np.testing.assert_allclose(found.positions, [si, si], rtol=1e-15)
    assert found.times is None


def test_beside_columns_of_joints_those_of_the_tool_are_not_joints_of_such_names(tmp_path: Path) -> None:
    rows = "q1,q2,x,y\n1,2,8,9\n3,4,8,9\n"
    assert recorded(tmp_path, rows, SLIDES).positions.tolist() == [[1, 2], [3, 4]]
    with pytest.raises(InputError, match="x_mm and x are columns of the same joint"):
        recorded(tmp_path, "x,x_mm,y\n1,2,3\n", SLIDES)
    alone = "x_mm,y\n8,9\n7,6\n"
    assert recorded(tmp_path, alone, SLIDES).positions.tolist() == [[0.008, 9], [0.007, 6]]


WRONG = [
    ("q1_mm,q2", "1,2", "q1_mm cannot be in mm: turn is revolute", "expected q1 or q1_deg"),
    ("q1,q2_deg", "1,2", "q2_deg cannot be in deg: lift is prismatic", "expected q2 or q2_mm"),
    ("q1,x", "1,2", "there is no column q2", "columns are called q1 in SI"),
    ("q2,x", "1,2", "there is no column q1", "columns are called q1 in SI"),
    ("q1,turn,q2", "1,2,3", "turn and q1 are columns of the same joint", "leave one out"),
    ("q1,q2,q3", "1,2,3", "q3 is the column of joint 3, robot has 2", None),
    ("q1,q2,q4_deg", "1,2,3", "q4_deg is the column of joint 4, robot has 2", None),
    ("q1,q2", "1,-2e12", "a value is larger than 1e+12 rad or m", "check its exponent and unit"),
    ("q1,q2", "2e12,1", "a value is larger than 1e+12 rad or m", "check its exponent and unit"),
    *((f"{name},q1,q2", "0,1,2", f"this file has '{name}'", "call it t")
      for name in ("time", "Time", "t_ms", "T", "ts", "stamp", "timestamp", "time_from_start", "sec", "seconds")),
    ("t,q1,q2", "3,1,2", "row 2 has t = 3 s after 3 s", "remove the rows that repeat a time"),
]  # fmt: skip


@pytest.mark.parametrize(("names", "row", "message", "hint"), WRONG)
def test_wrong_columns_are_refused(
    names: str, row: str, message: str, hint: str | None, tmp_path: Path
) -> None:
    with pytest.raises(InputError) as caught:
        recorded(tmp_path, f"{names}\n{row}\n{row}\n")
    (problem,) = caught.value.problems
    assert message in problem.message
    assert problem.hint == hint or (hint and hint in (problem.hint or ""))
    assert problem.place is not None
    assert problem.place.source[problem.place.column - 1 :].startswith("rows.csv")


def poses(folder: Path, rows: str) -> RecordedPoses:
    (folder / "poses.csv").write_text(rows)
    text = "version: 1\nunits: {angle: deg, length: mm}\nrobot: ur5e\nstart: {joints: 1}\nmoves:\n"
    text += "  - {planner: path, radius: 1, segments: {csv: poses.csv}}\n"
    (folder / "job.yaml").write_text(text)
    (move,) = load_job(folder / "job.yaml").job.moves
    return move.segments  # type: ignore[attr-defined, no-any-return]


def test_poses_are_in_metres_or_say_their_unit_with_w_first_by_name(tmp_path: Path) -> None:
    found = poses(tmp_path, "qx,qy,qz,qw,z,y_mm,x\n0,0,0.6,0.8,3,2,1\n0,0,-0.60005,0.8,6,5,4\n")
    assert found.positions.tolist() == [[1, 0.002, 3], [4, 0.005, 6]]
    assert found.quaternions is not None
    long = np.array([0.8, 0, 0, -0.60005])
    np.testing.assert_allclose(found.quaternions, [[0.8, 0, 0, 0.6], long / np.sqrt(long @ long)], rtol=1e-15)
    assert poses(tmp_path, "x,y,z\n1,2,3\n4,5,6\n").quaternions is None


WRONG_POSES = [
    ("x,y,z,qw,qx,qy", "1,2,3,1,0,0", "no column qz"),
    ("x,y", "1,2", "no column z"),
    ("x,y,z,z_mm", "1,2,3,3", "two columns for z: z and z_mm"),
    ("x,y,z", "1,-2e12,3", "a value is larger than 1e+12 rad or m"),
    ("x,y,z,qw,qx,qy,qz", "1,2,3,1.0002,0,0,0", "row 1: the quaternion has length 1.0002, not 1"),
    ("x,y,z,qw,qx,qy,qz", "1,2,3,0,0,0.9998,0", "row 1: the quaternion has length 0.9998, not 1"),
    *((f"x,y,z,{name}", "1,2,3,0", f"this file has '{name}'")
      for name in ("rx", "Ry", "rz_deg", "rpy", "roll", "yaw_deg", "pitch", "rotvec", "quat_w", "Qw", "QZ")),
]  # fmt: skip


@pytest.mark.parametrize(("names", "row", "message"), WRONG_POSES)
def test_wrong_poses_are_refused(names: str, row: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        poses(tmp_path, f"{names}\n{row}\n")
    (problem,) = caught.value.problems
    assert message in problem.message
    assert problem.place is not None
    assert problem.place.source[problem.place.column - 1 :].startswith("poses.csv")
