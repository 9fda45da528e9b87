"""Scenes of files: units by the names of columns, moves, limits of the robot, and rows that were left out."""

from __future__ import annotations

from base64 import b64decode
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from trajcli.errors import InputError
from trajcli.findings import Finding
from trajcli.judge.file import CheckedFile, CheckOptions
from trajcli.judge.judgement import Judgement
from trajcli.output.delivery.delivered import judged_file
from trajcli.player.recorded import scene_of_file
from trajcli.queries.arm import open_sheet
from trajcli.streams.byte_source import ByteSource
from trajcli.units import Units


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


def unpacked(columns: dict[str, Any]) -> np.ndarray:
    low, high, width = np.array(columns["low"]), np.array(columns["high"]), columns["width"]
    raw = np.frombuffer(b64decode(columns["values"]), np.uint8).reshape(len(low), -1, width).astype(float)
    return low[:, None] + raw @ 256.0 ** np.arange(width) * (high - low)[:, None] / (256.0**width - 1)


def test_columns_are_brought_to_si_and_to_the_order_of_the_joints(tmp_path: Path) -> None:
    names = [f"q{k}" for k in (3, 10, 1, 2, 12, 11, 4, 5, 6, 7, 8, 9)]
    cells = [name.removeprefix("q") for name in names]
    head = ",".join(["t", *names]).replace("q10", "q10_deg").replace("q12", "q12_mm")
    shown = scene(tmp_path, f"{head}\n0,{','.join(cells)}\n1,{','.join(12 * ['0'])}\n")
    first = unpacked(shown["rows"]["quantities"]["q"])[:, 0]
    expected = np.arange(1.0, 13)
    expected[9], expected[11] = np.radians(10), 0.012
    assert first == pytest.approx(expected, abs=1e-6)
    plain = scene(tmp_path, "q2,t,q1\n5,0,7\n6,1,8\n")
    assert unpacked(plain["rows"]["quantities"]["q"])[:, 0] == pytest.approx([7, 5])
    mixed = scene(tmp_path, "t,q1_deg,q2_deg\n0,90,180\n1,0,0\n")
    assert unpacked(mixed["rows"]["quantities"]["q"])[:, 0] == pytest.approx([pi / 2, pi])


SLIDE = "convention: standard\njoints: [{a: 0.5, position: [-3, 3]}, {type: prismatic}]\n"


def test_waypoints_stand_where_moves_meet_and_at_the_ends_of_the_file(tmp_path: Path) -> None:
    (tmp_path / "arm.yaml").write_text(SLIDE)
    arm = str(tmp_path / "arm.yaml")
    rows = "\n5,0,0,4\n6,1,0.1,4\n7,2,0.2,8\n9,3,0.3,8\n"
    shown = scene(tmp_path, f"t,q1,q2,move{rows}", arm)
    assert [(each["time"], each["joints"]) for each in shown["waypoints"]] == [
        (5, [0, 0]),
        (7, [2, 0.2]),
        (9, [3, 0.3]),
    ]
    assert [(move["start"], move["end"], move["label"], move["detail"]) for move in shown["moves"]] == [
        (5, 7, "move 4", "2 s"),
        (7, 9, "move 8", "2 s"),
    ]
    assert [(part["start"], part["end"]) for part in shown["limits"]] == [(5, 9)]
    assert "4 rows · 4 s" in shown["subtitle"]
    plain = scene(tmp_path, f"t,q1,q2,other{rows}", arm)
    assert [each["time"] for each in plain["waypoints"]] == [5, 9]
    assert not any("Drawn are" in note for note in plain["notes"])
    rated = scene(tmp_path, "t,q1,q2,qd1,qd2\n0,0,0,1,0\n1,1,0,1,0\n", arm)
    assert not any("no velocities" in note for note in rated["notes"])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("t,q1,q2\n0,0,0\n1,0,0\n1,0,0\n", "row 2 (from 0): the time 1 s follows 1 s"),
        ("t,q1,q2\n0,0,0\n3,0,0\n2.5,0,0\n", "row 2 (from 0): the time 2.5 s follows 3 s"),
        ("t,q1,q2_deg\n0,0,0\n", "q2_deg cannot be in deg: j2 is prismatic"),
        ("t,q1_mm,q2\n0,0,0\n", "q1_mm cannot be in mm: j1 is revolute"),
        ("t,q1,q2,qd2_deg,qd1\n0,0,0,0,0\n", "qd2_deg cannot be in deg: j2 is prismatic"),
        ("t,q1,q2\n0,0,1e30\n", "got 1e+30"),
        ("t,q1\n0,0\n", "arm has 2 joints, and there is no column q2"),
        ("t,q0,q1\n0,0,0\n", "q0: joints are counted from 1"),
        ("q1,q2\n0,0\n", "has no column 't'"),
    ],
)
def test_files_that_do_not_fit_the_arm_are_refused(
    text: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("arm.yaml").write_text(SLIDE)
    Path("rows.csv").write_text(text)
    with pytest.raises(InputError) as refused:
        scene_of_file("rows.csv", "arm.yaml")
    assert message in str(refused.value)


def test_what_a_judge_says_stands_at_its_time_or_at_the_start_of_the_file(tmp_path: Path) -> None:
    (tmp_path / "arm.yaml").write_text(SLIDE)
    robot = open_sheet(str(tmp_path / "arm.yaml")).robot
    found = (
        Finding(
            "velocity", joint="j2", value=0.7, limit=0.5, time=7.0, message="too fast", hint="slower", move=3
        ),
        Finding("velocity", joint="j1", message="no number"),
        Finding("time", message="no time"),
        Finding("velocity", joint="j1", value=1.0, time=6.0, severity="warning"),
    )
    judgement = Judgement(found, "linear", 3, notes=("a note",))
    checked = CheckedFile(judgement, robot, Units(), None, None)  # type: ignore[arg-type]
    (tmp_path / "rows.csv").write_text("t,q1,q2\n5,0,0\n6,1,0\n8,0,0\n")
    shown = scene_of_file(str(tmp_path / "rows.csv"), robot, checked)
    assert (shown["verdict"]["state"], shown["verdict"]["text"]) == ("violated", "3 findings")
    assert [
        (each["time"], each["joint"], each["order"], each["value"], each["label"])
        for each in shown["findings"]
    ] == [(7.0, 1, 1, 0.7, "move 3:"), (5.0, 0, None, None, ""), (5.0, None, None, None, "")]
    assert shown["opens_at"] == 7.0
    assert "a note" in shown["notes"]
    assert not any("not judged" in note for note in shown["notes"])


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


def test_without_velocities_the_speed_is_that_between_rows_whatever_their_period(tmp_path: Path) -> None:
    rows = "".join(f"{5 + k / 4},{k / 10},0\n" for k in range(9))
    shown = scene(tmp_path, "t,q1,q2\n" + rows, "planar2r")
    assert unpacked(shown["tool"]["speeds"])[0][4] == pytest.approx(0.5 * 0.4, rel=0.01)  # 0.5 m at 0.4 rad/s


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
