"""`trajcli explain` on poses: joints, branch, why that one, and whether the arm is singular there."""

from __future__ import annotations

import json
from math import atan2, cos, degrees, radians, sin
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from running import EXAMPLES, call

Capture = pytest.CaptureFixture[str]
JOB = """\
version: 1
units: {angle: deg}
robot: ROBOT
start: START
moves:
  - {planner: quintic, to: TARGET, duration: 9}
"""
PLANAR = {"robot": "planar2r", "start": "{joints: [10, 60]}", "target": "{xyz: [0.3, 0.2, 0]}"}
ELBOW_UP = 2 * degrees(atan2(0.2, 0.3))  # mirrored in the line to the target, which has the slope 0.2 / 0.3


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def explained(capfd: Capture, *options: str, robot: str, start: str, target: str) -> str:
    Path("job.yaml").write_text(JOB.replace("ROBOT", robot).replace("START", start).replace("TARGET", target))
    code, out, err = call(capfd, "explain", "job.yaml", *options)
    assert (code, err) == (0, "")
    return out


def move_of(capfd: Capture, *options: str, **job: str) -> dict[str, Any]:
    (move,) = json.loads(explained(capfd, "--json", *options, **job), parse_constant=pytest.fail)["moves"]
    return move  # type: ignore[no-any-return]


def test_the_nearest_branch(capfd: Capture) -> None:
    """Links of 0.3 and 0.2 at a right angle: the elbow at (0.3, 0), below the line to the target, or above."""
    move = move_of(capfd, **PLANAR)
    told = move["to_pose"]
    assert move["from_pose"] is None
    assert told["joints"] == pytest.approx([0, 90], abs=1e-9)
    assert told["branch"] == {"elbow": "down"}
    assert told["chosen"] == {
        "by": "nearest",
        "configuration": {},
        "near": pytest.approx([10, 60]),
        "units": ["deg", "deg"],
        "candidates": 2,
        "within_limits": 2,
    }
    assert (told["singular"], told["rank"]) == (False, {"here": 2, "nearby": 2})
    assert "free_direction" not in told
    above = move_of(capfd, **PLANAR | {"start": "{joints: [60, -80]}"})["to_pose"]
    assert above["joints"] == pytest.approx([ELBOW_UP, -90])
    assert above["branch"] == {"elbow": "up"}


def test_the_branch_that_a_configuration_names(capfd: Capture) -> None:
    named = PLANAR | {"target": "{xyz: [0.3, 0.2, 0], configuration: {elbow: up}}"}
    told = move_of(capfd, **named)["to_pose"]
    assert told["joints"] == pytest.approx([ELBOW_UP, -90])
    assert (told["branch"], told["chosen"]["by"]) == ({"elbow": "up"}, "configuration")
    assert told["chosen"]["configuration"] == {"elbow": "up"}
    assert (told["chosen"]["candidates"], told["chosen"]["within_limits"]) == (1, 2)


def test_answers_outside_the_limits_do_not_count(capfd: Capture) -> None:
    limited = ("--set", "limits.position=[[-180, 180], [0, 180]]")  # the other answer has joint 2 at -90
    told = move_of(capfd, *limited, **PLANAR)["to_pose"]
    assert (told["chosen"]["candidates"], told["chosen"]["within_limits"]) == (1, 1)
    assert "chosen: the only answer within the limits" in explained(capfd, *limited, **PLANAR)


def test_in_words(capfd: Capture) -> None:
    assert explained(capfd, **PLANAR).splitlines()[3:7] == [
        "move 0: quintic, 9 s, from t = 0 s",
        "  goes to a pose: joints 0  90 (deg)",
        "    branch: elbow down; not singular",
        "    chosen: of 2 answers found within the limits, the nearest to where the arm comes from",
    ]
    named = PLANAR | {"target": "{xyz: [0.3, 0.2, 0], configuration: {elbow: up}}"}
    told = "of 2 answers found within the limits, 1 has elbow up as the configuration says"
    assert f"    chosen: {told}" in explained(capfd, **named).splitlines()


def test_a_stretched_arm_is_singular_and_cannot_move(capfd: Capture) -> None:
    stretched = PLANAR | {"target": "{xyz: [0, 0.5, 0]}"}
    told = move_of(capfd, **stretched)["to_pose"]
    assert told["joints"] == pytest.approx([90, 0], abs=1e-6)
    assert (told["singular"], told["rank"]) == (True, {"here": 1, "nearby": 2})
    assert "free_direction" not in told
    out = explained(capfd, **stretched)
    assert "; singular (rank 1, nearby 2)\n    chosen: the only answer within the limits" in out


def test_an_aligned_wrist_is_singular_and_free(capfd: Capture) -> None:
    """The maker's zero position of the IRB 120: x 374 mm, z 630 mm, axes 4 and 6 in line."""
    job = {
        "robot": "irb120",
        "start": "{joints: [0, 10, -10, 20, 5, 0]}",
        "target": "{xyz: [0.374, 0, 0.63], rpy: [0, 90, 0]}",
    }
    told = move_of(capfd, **job)["to_pose"]
    q = told["joints"]
    assert q == pytest.approx([0, 0, 0, 10, 0, -10], abs=1e-5)  # of all q4 + q6 = 0 the nearest to 20 and 0
    assert (told["singular"], told["rank"]) == (True, {"here": 5, "nearby": 6})
    free = np.array(told["free_direction"])
    assert free * np.sign(free[3]) == pytest.approx(np.array([0, 0, 0, 1, 0, -1]) / np.sqrt(2), abs=1e-6)
    out = explained(capfd, **job)
    assert "singular (rank 5, nearby 6)" in out
    assert "    the arm can move without leaving the pose: joints along " in out


def test_seven_joints_are_free_but_not_singular(capfd: Capture) -> None:
    told = move_of(
        capfd,
        robot="panda",
        start="{joints: [0, -45, 0, -135, 0, 90, 45]}",
        target="{xyz: [0.4, 0.1, 0.5], rpy: [180, 0, 0]}",
    )["to_pose"]
    assert (told["branch"], told["singular"]) == ({}, False)
    assert told["rank"] == {"here": 6, "nearby": 6}
    assert np.linalg.norm(told["free_direction"]) == pytest.approx(1)
    assert told["method"].startswith("joint 7 held")


def test_a_start_may_be_a_pose(capfd: Capture) -> None:
    """A UR5e has eight answers; of the two links (0.425 and 0.3922) the elbow is above the line, or below."""
    down = "xyz: [0.4, 0.1, 0.25], rpy: [180, 0, 0]"
    for elbow in ("up", "down"):
        start = f"{{{down}, configuration: {{elbow: {elbow}}}}}"
        move = move_of(capfd, robot="ur5e", start=start, target="{joints: [0, -90, 90, 0, 90, 0]}")
        told = move["from_pose"]
        assert move["to_pose"] is None
        assert told["branch"]["elbow"] == elbow
        assert told["branch"]["wrist"] == ("no_flip" if sin(radians(told["joints"][4])) > 0 else "flip")
        assert (told["chosen"]["candidates"], told["chosen"]["within_limits"]) == (4, 8)
        assert told["chosen"]["near"] == [0] * 6
        upper, fore = radians(told["joints"][1]), radians(told["joints"][1] + told["joints"][2])
        x, z = -0.425 * cos(upper), -0.425 * sin(upper)
        wrist_x, wrist_z = x - 0.3922 * cos(fore), z - 0.3922 * sin(fore)
        assert (z > wrist_z * x / wrist_x) == (elbow == "up")


def test_only_the_first_move_starts_at_the_start(capfd: Capture) -> None:
    hold = "{joints: [0, 30]}, duration: 9}\n  - {planner: hold"  # ends the move, and begins another
    job = PLANAR | {"start": "{xyz: [0.3, 0.2, 0]}", "target": hold}
    out = explained(capfd, **job)
    assert out.count("starts at a pose: joints") == 1
    assert "chosen: of 2 answers found within the limits, the nearest to zero\n" in out
    first, second = json.loads(explained(capfd, "--json", **job))["moves"]
    assert first["from_pose"]["joints"] in (pytest.approx([0, 90]), pytest.approx([ELBOW_UP, -90]))
    assert (second["from_pose"], second["to_pose"]) == (None, None)


def test_each_move_to_a_pose_says_where_it_comes_from(capfd: Capture) -> None:
    """Moves 0, 1 and 3 of the example go to a pose; move 1 comes from where move 0 went."""
    out = call(capfd, "explain", EXAMPLES / "ur5e_poses.yaml", "--json").out
    moves = json.loads(out)["moves"]
    assert [move["to_pose"] is not None for move in moves] == [True, True, False, True, False]
    assert [move["from_pose"] for move in moves] == [None] * 5
    assert moves[1]["to_pose"]["chosen"]["near"] == pytest.approx(moves[0]["to_pose"]["joints"])
    assert moves[0]["to_pose"]["joints"] == pytest.approx(
        [sum(rows[-1]["absolute"][k] * rows[-1]["end"] ** k for k in range(len(rows[-1]["absolute"])))
         for rows in moves[0]["polynomials"].values()]
    )  # fmt: skip
    text = call(capfd, "explain", EXAMPLES / "ur5e_poses.yaml").out
    assert text.count("  goes to a pose: ") == 3
    assert (
        "4 have elbow up as the configuration says; of these the nearest to where the arm comes from" in text
    )


def test_joints_need_no_branch(capfd: Capture) -> None:
    out = call(capfd, "explain", EXAMPLES / "cubic.yaml").out
    assert "pose" not in out
