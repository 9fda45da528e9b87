"""What `trajcli ik` says of its answers to people, and of where it was told to look for them.

Oracle: the formulas of the planar arm, of 0.3 m and 0.2 m, and of a SCARA; the digits that a value has.
"""

from __future__ import annotations

import math
import re
from pathlib import Path
from types import SimpleNamespace

import pytest
from arm_calls import Arms

from trajcli.cli.ik import _lines

DOWN = "{xyz: [0.4, 0.1, 0.3], rpy: [180, 0, 0]}"
ELBOW = "{xyz: [0.3, 0.2, 0]}"  # the second joint at 90 deg either way


@pytest.fixture
def arms(capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Arms:
    return Arms(capfd, monkeypatch)


def test_answers_outside_the_limits_are_named_and_units_are_those_of_the_joints(arms: Arms) -> None:
    """The distance of 0.412311 m between the wrist and the first axis of links of 0.325 m and 0.275 m."""
    bend = math.degrees(math.acos((0.4**2 + 0.1**2 - 0.325**2 - 0.275**2) / (2 * 0.325 * 0.275)))
    code, out, err = arms.call("ik", "-r", "cobra600", "--pose", DOWN, "--all")
    head, up, down, misses = out.splitlines()
    assert (code, head) == (3, "2 answers for Cobra 600 (deg, m), by SCARA:")
    assert up.endswith("   (up, outside the limits)")
    assert down.endswith("   (down, outside the limits)")
    assert [float(line.split()[1]) for line in (up, down)] == pytest.approx([-bend, bend], abs=1e-6)
    assert [float(line.split()[2]) for line in (up, down)] == pytest.approx([0.087] * 2)
    assert misses == "they miss the pose by at most 1e-12 (m, rad)"
    assert "only outside the limits" in err


def test_a_stretched_arm_has_one_answer_and_is_singular(arms: Arms) -> None:
    out = arms.call("ik", "-r", "planar2r", "--pose", "{xyz: [0.5, 0, 0]}").out
    assert out.splitlines()[:2] == ["1 answer for Planar 2R (deg), by planar 2R:", "  0  0   (up, singular)"]
    other = arms.call("ik", "-r", "planar2r", "--pose", ELBOW).out
    assert "singular" not in other
    assert [line.split()[:2] for line in other.splitlines()[1:3]] == [["67.3801351", "-90"], ["0", "90"]]


def test_what_the_worst_answer_misses_is_said(arms: Arms) -> None:
    """Beside its plane the arm misses by how far the target is above it, as far as it may."""
    words = ("ik", "-r", "planar2r", "--pose", "{xyz: [0.3, 0.2, 1e-4]}", "--tolerance")
    out = arms.call(*words, "1e-3").out
    assert out.splitlines()[-1] == "they miss the pose by at most 0.0001 (m, rad)"
    assert arms.call(*words, "1e-5").code == 3


@pytest.mark.parametrize("units", [("deg,m", 1.0), ("deg,mm", 1000.0)])
def test_where_the_search_begins_is_told_to_be_where_the_arm_cannot_be(
    units: tuple[str, float], arms: Arms
) -> None:
    name, scale = units
    pose = f"{{xyz: [{0.5 * scale}, 0, {0.3 * scale}], rpy: [180, 0, 0]}}"
    words = ("ik", "-r", "cobra600", "--units", name, "--pose", pose, "--near")
    code, out, err = arms.call(*words, f"0,0,{0.9 * scale},0")
    unit = name.partition(",")[2]
    what = f"j3 is at {0.9 * scale:.9g} {unit}, its limit is {0.21 * scale:.9g} {unit}"
    assert (code, err) == (0, f"--near is outside the limits of Cobra 600: {what}\n")
    assert out.startswith("2 answers")
    assert arms.call(*words, "0,0,0,0").err == ""
    turned = arms.call("ik", "-r", "planar2r", "--si", "--pose", ELBOW, "--near", "0,90")
    assert (turned.code, turned.err.startswith("--near: j2 is at 90 rad")) == (0, True)


def test_the_nearest_answer_comes_first(arms: Arms) -> None:
    for near, first in (("0,80", [0, 90]), ("60,-80", [67.3801351, -90])):
        told = arms.json("ik", "-r", "planar2r", "--pose", ELBOW, "--near", near)
        assert told[0]["joints"] == pytest.approx(first)
        assert len(told) == 2


ROWS = "x,y,z\n0.3,0.2,0\n"


def test_rows_are_answered_from_where_it_is_told_with_the_digits_that_are_asked_for(arms: Arms) -> None:
    words = ("ik", "-r", "planar2r", "--si")
    exact = [math.atan2(0.2, 0.3) + math.acos(0.3 / math.hypot(0.3, 0.2)), -math.pi / 2]
    for near, joints in (("0,1", [0, math.pi / 2]), ("1,-1", exact)):
        for digits, slack in (("fixed", 5.1e-10), ("full", 1e-14)):
            out = arms.call(*words, "--near", near, "--digits", digits, "-", stdin=ROWS).out
            found = [float(cell) for cell in out.splitlines()[1].split(",")]
            assert found == pytest.approx(joints, abs=slack)
    lines = arms.call(*words, "--all", "--digits", "full", "-", stdin=ROWS).out.splitlines()
    assert lines[0] == "row,elbow,q1,q2,within_limits"
    both = [line.split(",") for line in lines[1:]]
    assert [(row[1], float(row[2]), float(row[3])) for row in both] == [
        ("up", pytest.approx(exact[0], abs=1e-14), pytest.approx(exact[1], abs=1e-14)),
        ("down", pytest.approx(0, abs=1e-14), pytest.approx(math.pi / 2, abs=1e-14)),
    ]


def test_every_answer_is_in_the_turn_that_is_near(arms: Arms) -> None:
    out = arms.call("ik", "-r", "planar2r", "--all", "--near", "0,800", "-", stdin=ROWS).out
    assert [float(line.split(",")[3]) for line in out.splitlines()[1:]] == pytest.approx([630, 810])


@pytest.mark.parametrize("every", [(), ("--all",)])
def test_rows_are_met_as_near_as_is_asked_for(every: tuple[str, ...], arms: Arms) -> None:
    rows = "x,y,z\n0.3,0.2,0.0001\n"
    words = ("ik", "-r", "planar2r", *every)
    assert arms.call(*words, "--tolerance", "1e-3", "-", stdin=rows).code == 0
    assert arms.call(*words, "--tolerance", "1e-5", "-", stdin=rows).code == 3


def test_of_every_answer_the_first_row_without_one_is_named(arms: Arms) -> None:
    for rows, missed in (("x,y,z\n3,0,0\n0.3,0.2,0\n", 0), (f"{ROWS}0.2,0.2,0\n3,0,0\n4,0,0\n", 2)):
        code, out, err = arms.call("ik", "-r", "planar2r", "--all", "-", stdin=rows)
        assert code == 3
        assert f"no answer to row {missed} (from 0) is within the limits" in err
        assert out.startswith("row,elbow,")
        assert f"\n{1 - min(missed, 1)},up," in out


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--turns", "-"), "--turns is for one pose"),
        (("-", "--json"), "--json is for one pose"),
        (("x", "--pose", ELBOW), "there is no place for x"),
        (("-", "x"), "there is no place for -"),
        (("--pose", ELBOW, "-"), "say either --pose POSE"),
        ((), "say either --pose POSE"),
    ],
)
def test_what_does_not_go_together_is_refused(words: tuple[str, ...], message: str, arms: Arms) -> None:
    code, out, err = arms.call("ik", "-r", "planar2r", *words, stdin=ROWS)
    assert (code, out, message in err) == (2, "", True)


def test_tool_base_and_pins_of_one_pose_count(arms: Arms) -> None:
    """A tool of 0.1 m along the second link, on a base that is 1 m further along x and 2 m up."""
    words = ("ik", "-r", "planar2r", "--tool", "{xyz: [0.1, 0, 0]}", "--base", "{xyz: [1, 0, 2]}")
    told = arms.json(*words, "--pose", "{xyz: [1.3, 0.3, 2]}")
    assert pytest.approx([0, 90], abs=1e-9) in [each["joints"] for each in told]
    pinned = arms.json("ik", "-r", "planar2r", "--pose", "{xyz: [0.3, 0.2, 0], configuration: {elbow: down}}")
    assert [each["joints"] for each in pinned] == [pytest.approx([0, 90], abs=1e-9)]


def test_an_answer_is_followed_by_what_is_to_be_known_of_it() -> None:
    answer = {"joints": [1.0, -2.5], "within_limits": True, "singular": False, "closure": 1e-15, "branch": {}}
    more = {
        "branch": {"shoulder": "left", "elbow": "up"},
        "within_limits": False,
        "singular": True,
        "free_direction": [0.6, 0.8],
        "turns_not_met": ["a", "b"],
        "closure": 2.5e-7,
    }
    arm = SimpleNamespace(robot=SimpleNamespace(name="arm"), joint_units=["deg", "mm"])
    solutions = SimpleNamespace(method=SimpleNamespace(name="a table"))
    assert list(_lines(arm, solutions, [answer, {**answer, **more}])) == [  # type: ignore[arg-type]
        "2 answers for arm (deg, mm), by a table:",
        "  1  -2.5",
        "  1  -2.5   (left up, outside the limits, singular, free along 0.6  0.8, turns of a, b not as asked)",
        "they miss the pose by at most 2.5e-07 (m, rad)",
    ]


def test_the_base_that_is_advised_for_rows_in_a_frame_is_where_the_arm_stands(
    arms: Arms, tmp_path: Path
) -> None:
    """An arm a metre along x; the table is turned a quarter about z, 0.1 m along x."""
    job = tmp_path / "job.yaml"
    job.write_text(
        "version: 1\nrobot: planar2r\nbase: {xyz: [1, 0, 0]}\nstart: {joints: [0, 0]}\n"
        "frames: {table: {xyz: [0.1, 0, 0], rpy: [0, 0, 1.5707963267948966]}}\n"
        "moves: [{planner: hold, duration: 1}]\noutput: {in: table}\n"
    )
    rows = {"table": "x,y,z\n0.2,-1.2,0\n", "world": "x,y,z\n1.3,0.2,0\n"}
    words = ("ik", "-r", job, "--near", "0,1.5")
    refused = arms.call(*words, "-", stdin=rows["table"])
    assert refused.code == 2
    for name, text in rows.items():
        (base,) = re.findall(rf"--base '([^']*)' in {name}", refused.err)
        out = arms.call(*words, "--base", base, "-", stdin=text).out
        assert [float(cell) for cell in out.splitlines()[1].split(",")] == pytest.approx([0, math.pi / 2])
