"""`trajcli explain` of a whole job: what is said of which move, and what of the job."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from running import call

Capture = pytest.CaptureFixture[str]
JOB = """\
version: 1
units: {angle: deg}
robot: {joints: [{name: turn, velocity: 200, acceleration: 900}, {velocity: 200, acceleration: 900}]}
limits: {velocity: {turn: 300}}
start: {joints: 0}
moves:
  - {planner: spline, through: [{joints: [10, 5], time: 1}, {joints: [30, 15], time: 2}, {joints: [20, 10], time: 3}]}
  - {planner: blends, through: [{joints: [30, 20], time: 1}, {joints: [20, 10], time: 2}], blend_durations: 0.2}
  - {planner: quintic, to: {joints: [110, 10]}, duration: 0.1, when_over_limit: slow}
"""
SLOWEST = math.sqrt(10 / math.sqrt(3) * 90 / 900)  # a quintic over d in T has its peak at 10 / sqrt 3 d / T^2


def sections(text: str) -> list[list[str]]:
    return [part.splitlines() for part in text.split("\n\n")]


def test_each_move_has_its_own_and_the_job_the_rest(tmp_path: Path, capfd: Capture) -> None:
    (tmp_path / "three.yaml").write_text(JOB, encoding="utf-8")
    code, out, _ = call(capfd, "explain", tmp_path / "three.yaml")
    assert code == 0
    head, spline, blends, quintic = sections(out)
    total = 3 + 2.2 + SLOWEST
    assert head[0] == f"three on robot: 3 moves, {total:.10g} s"
    assert head[1].endswith("from the start of each move; q1 = turn")  # j2 is q2 by its name
    assert spline[0] == "move 0: spline, 3 s, from t = 0 s"
    assert "  4 points at (s): 0, 1, 2, 3" in spline
    assert any(line.startswith("  virtual points at t = ") for line in spline)
    assert "  4 points at (s): 0, 1, 2, 3" not in blends
    assert blends[0] == "move 1: blends, 2.2 s, from t = 3 s"
    assert "  3 points at (s, unshifted): 0, 1, 2" in blends
    assert any(line.startswith("  blends of q2 = ") for line in blends)
    assert any(line.startswith("  phases (s): blend 0 0..0.2") for line in blends)
    for section in (spline, blends, quintic):
        assert section.count("  peaks:") == 1
        assert sum(line.startswith("    turn qdd: ") for line in section) == 1
    assert quintic[0] == f"move 2: quintic, {SLOWEST:.10g} s, from t = 5.2 s"
    assert f"  stretched {10 * SLOWEST:.6g} times" in quintic
    slowed = [
        [line for line in section if line.startswith("  slowed: ")] for section in (spline, blends, quintic)
    ]
    assert [len(lines) for lines in slowed] == [0, 0, 1]
    assert quintic[-1].startswith("looser_limit: the job's velocity limit of turn is looser")
    assert "looser" not in "".join(spline + blends)
    alone = call(capfd, "explain", tmp_path / "three.yaml", "--move", "2").out
    assert sections(alone)[0][0] == f"three on robot: move 2, one of 3 moves, {total:.10g} s"
    assert sections(alone)[1][:-1] == quintic[:-1]


def test_derivatives_are_said_where_they_are_asked_for(tmp_path: Path, capfd: Capture) -> None:
    (tmp_path / "three.yaml").write_text(JOB, encoding="utf-8")
    told = call(capfd, "explain", tmp_path / "three.yaml", "--derivatives", "--move", "2").out
    assert [told.count(f"{name}1(t) = ") for name in ("  q", "  qd", "  qdd")] == [1, 1, 1]
    plain = call(capfd, "explain", tmp_path / "three.yaml", "--move", "2").out
    assert [plain.count(f"{name}1(t) = ") for name in ("  q", "  qd", "  qdd")] == [1, 0, 0]


def test_what_breaks_a_limit_is_explained_and_is_1(tmp_path: Path, capfd: Capture) -> None:
    (tmp_path / "fast.yaml").write_text(JOB.replace(", when_over_limit: slow", ""), encoding="utf-8")
    for form in ((), ("--json",)):
        code, out, err = call(capfd, "explain", tmp_path / "fast.yaml", *form)
        assert code == 1
        assert "turn" in out
        assert "velocity of turn reaches 1687.5 deg/s" in err  # 15/8 of 90 deg in 0.1 s
    for move in ("3", "-1"):
        outcome = call(capfd, "explain", tmp_path / "fast.yaml", f"--move={move}")
        assert (outcome.code, outcome.out) == (2, "")
        assert "its moves are 0 to 2" in outcome.err
