"""Scenes of files: units by the names of columns, moves, limits of the robot, and rows that were left out."""

from __future__ import annotations

from math import pi
from pathlib import Path

import numpy as np
import pytest

from trajcli.judge.file import CheckOptions
from trajcli.output.delivery.delivered import judged_file
from trajcli.player.recorded import scene_of_file
from trajcli.streams.byte_source import ByteSource


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


def judged_scene(folder: Path, duration: float, robot: str) -> dict[str, object]:
    """Return the scene of a quintic of both joints by 20 deg from 0.4 s on, judged."""
    t = np.arange(101) / 50
    s = np.clip((t - 0.4) / duration, 0.0, 1.0)
    q = 20 * (10 * s**3 - 15 * s**4 + 6 * s**5)
    qd = 20 / duration * (30 * s**2 - 60 * s**3 + 30 * s**4)
    qdd = 20 / duration**2 * (60 * s - 180 * s**2 + 120 * s**3)
    rows = np.stack([t, 0 * q, q, 0 * q, qd, 0 * q, qdd], axis=1)
    header = "t,q1_deg,q2_deg,qd1_deg,qd2_deg,qdd1_deg,qdd2_deg"
    file = folder / "rows.csv"
    np.savetxt(file, rows, "%.9f", delimiter=",", header=header, comments="")
    (folder / "arm.yaml").write_text(
        "units: {angle: deg}\nconvention: standard\njoints: [{a: 0.5, velocity: 60}, {a: 0.3, velocity: 60}]\n"
    )
    source = ByteSource(str(file))
    checked = judged_file(source, CheckOptions(robot=robot))
    return scene_of_file(source, robot, checked)


def test_a_peak_between_two_rows_is_listed_at_its_time_and_value(tmp_path: Path) -> None:
    shown = judged_scene(tmp_path, 0.5, str(tmp_path / "arm.yaml"))
    assert shown["verdict"] == {"state": "violated", "text": "1 finding"}
    (finding,) = shown["findings"]
    assert (finding["joint"], finding["order"]) == (1, 1)
    assert finding["time"] == pytest.approx(0.65, abs=1e-4)  # rows are at 0.64 s and 0.66 s
    assert finding["value"] == pytest.approx(15 / 8 * 20 / 0.5 * pi / 180, rel=1e-4)
    assert finding["message"] == "the velocity of j2 reaches 75 deg/s at t = 0.65 s, its limit is 60 deg/s"
    assert "not judged" not in " ".join(shown["notes"])


def test_its_clean_twin_is_satisfied(tmp_path: Path) -> None:
    shown = judged_scene(tmp_path, 1.0, str(tmp_path / "arm.yaml"))
    assert shown["verdict"]["state"] == "verified"
    assert shown["findings"] == []


@pytest.mark.parametrize("first", [False, True])
def test_a_job_that_changes_tools_changes_them_in_its_rows(first: bool, tmp_path: Path) -> None:
    t = np.arange(41) / 10
    s = np.minimum(t, 4 - t) / 2
    q = s**2 * (3 - 2 * s)  # the cubic, there and back
    rows = np.stack([100 + t, q, 0 * q], axis=1)
    np.savetxt(tmp_path / "rows.csv", rows, "%.9f", delimiter=",", header="t,q1,q2", comments="")
    job = tmp_path / "job.yaml"
    change, there = "  - {tool: long}\n", "  - {planner: cubic, to: {joints: [1, 0]}, duration: 2}\n"
    back = there.replace("[1, 0]", "[0, 0]")
    moves = change + there + back if first else there + change + back
    job.write_text(
        "version: 1\nrobot: planar2r\ntools: {long: {xyz: [0.5, 0, 0]}}\nstart: {joints: [0, 0]}\n"
        "limits: {velocity: 9, acceleration: 99}\nmoves:\n" + moves
    )
    source = ByteSource(str(tmp_path / "rows.csv"))
    shown = scene_of_file(source, str(job), judged_file(source, CheckOptions(job=str(job))))
    # stretched, 0.3 + 0.2 m, the long tool ends at 1 m: it is at x = 1 m at the end, with q1 = 0
    assert shown["tool"]["positions"]["high"][0] == pytest.approx(1.0)
    changes = shown["robot"].get("changes", [])
    assert [(one["time"], one["tool"][0][3]) for one in changes] == ([] if first else [(102.0, 0.5)])
    assert shown["robot"]["tool"][0][3] == (0.5 if first else 0.0)


def test_what_cannot_be_judged_says_why(tmp_path: Path) -> None:
    (tmp_path / "rows.csv").write_text("t,q1,q2\n0,0,0\n1,1,1\n")
    shown = scene_of_file(str(tmp_path / "rows.csv"), "planar2r", "it has no limits")
    assert shown["verdict"] == {"state": "unjudged", "text": "not judged"}
    assert shown["findings"] == []
    assert shown["notes"][1] == "Why not: it has no limits."


def test_joints_of_a_message_move_those_of_the_robot_with_their_names(tmp_path: Path) -> None:
    """The second joint of planar2r alone turns: the tool stays within its link of 0.2 m around (0.3, 0) m."""
    points = "".join(f"- {{positions: [{k * pi / 2}, 0.0], time_from_start: {{sec: {k}}}}}\n" for k in (0, 1))
    file = tmp_path / "goal.yaml"
    file.write_text(f"joint_names: [j2, j1]\npoints:\n{points}")
    positions = scene_of_file(str(file), "planar2r")["tool"]["positions"]
    assert positions["low"][:2] == pytest.approx([0.3, 0], abs=1e-12)
    assert positions["high"][:2] == pytest.approx([0.5, 0.2])
