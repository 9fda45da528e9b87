"""Scenes of files: units by the names of columns, moves, limits of the robot, and rows that were left out."""

from __future__ import annotations

from math import pi
from pathlib import Path

import pytest

from trajcli.player.recorded import scene_of_file


def scene(folder: Path, text: str, robot: str | None = None) -> dict[str, object]:
    file = folder / "rows.csv"
    file.write_text(text)
    return scene_of_file(str(file), robot)


def test_units_are_those_of_the_names(tmp_path: Path) -> None:
    joints = scene(tmp_path, "t,q1_deg,q2_mm,q3\n0,1,2,3\n1,1,2,3\n")["joints"]
    assert [joint["units"][1] for joint in joints] == ["deg/s", "mm/s", "rad/s or m/s"]
    assert [joint["scale"] for joint in joints] == pytest.approx([180 / pi, 1000, 1])


def test_derivatives_that_not_all_joints_have_are_left_out(tmp_path: Path) -> None:
    rows = scene(tmp_path, "t,q1,q2,qd1\n0,1,2,3\n1,1,2,3\n")["rows"]
    assert list(rows["quantities"]) == ["q"]


def test_moves_of_the_file(tmp_path: Path) -> None:
    moves = scene(tmp_path, "t,q1,move\n0,0,0\n1,1,0\n2,4,1\n3,5,1\n")["moves"]
    assert [(move["start"], move["end"], move["index"]) for move in moves] == [(0, 2, "0"), (2, 3, "1")]


def test_a_robot_brings_limits_and_the_path_of_its_tool(tmp_path: Path) -> None:
    shown = scene(tmp_path, "t,q1,q2\n0,0,0\n1,1.5707963267948966,0\n", "planar2r")
    assert shown["joints"][0]["units"][0] == "rad"
    assert shown["limits"][0]["start"] == 0
    assert shown["limits"][0]["end"] == 1
    # planar2r has links of 0.3 m and 0.2 m: stretched it turns from (0.5, 0) to (0, 0.5) m
    assert shown["tool"]["positions"]["low"][:2] == pytest.approx([0, 0], abs=1e-12)
    assert shown["tool"]["positions"]["high"][:2] == pytest.approx([0.5, 0.5])
    assert shown["tool"]["speeds"]["high"] == pytest.approx([0.5 * 2**0.5])
    assert any("no velocities" in note for note in shown["notes"])


def test_velocities_give_the_speed_of_the_tool(tmp_path: Path) -> None:
    shown = scene(tmp_path, "t,q1,q2,qd1,qd2\n0,0,0,3,0\n1,1,0,0,5\n", "planar2r")
    assert shown["tool"]["speeds"]["high"] == pytest.approx([1.5])  # 0.5 m at 3 rad/s
    assert shown["tool"]["speeds"]["low"] == pytest.approx([1])  # 0.2 m at 5 rad/s


def test_rows_that_are_left_out_are_said(tmp_path: Path) -> None:
    rows = "".join(f"{k / 1000},{(k % 7) / 100}\n" for k in range(5001))
    notes = scene(tmp_path, "t,q1\n" + rows)["notes"]
    assert any(note.startswith("Drawn are 30") and "of 5001 rows" in note for note in notes)


def test_one_row_is_a_scene(tmp_path: Path) -> None:
    assert scene(tmp_path, "t,q1,q2\n3,0,0\n", "planar2r")["subtitle"].endswith("· 1 row · 0 s")
