"""What `plan` says about moves of the tool: the limit that binds, and what the fastest move is compared with."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from running import call

Capture = pytest.CaptureFixture[str]
TCP = {"speed": 250, "acceleration": 2000, "angular_speed": 90, "angular_acceleration": 720}
START = {"xyz": [400, 100, 50], "rpy": [180, 0, 0], "configuration": {"shoulder": "left", "elbow": "up"}}
TURN = {"planner": "line", "to": {"rpy": [180, 0, 60]}, "law": {"shape": "quintic"}}
CIRCLE = {"planner": "arc", "center": [400, 150, 50], "axis": "z", "angle": 360, "law": {"shape": "quintic"}}
LINE = {"planner": "line", "to": {"xyz": [400, 300, 50]}, "law": {"shape": "quintic"}}
STILL = {"planner": "line", "to": {"xyz": [400, 100, 50]}, "law": {"duration": 1}}


def told(tmp_path: Path, capfd: Capture, move: object, *arguments: str) -> str:
    """Return what is said about a job of one move."""
    job = {"version": 1, "units": {"angle": "deg", "length": "mm"}, "robot": "ur5e", "start": START}
    limits = {"acceleration": 800, "jerk": 8000, "tcp": TCP}
    path = tmp_path / "job.json"
    path.write_text(json.dumps({**job, "limits": limits, "moves": [move]}), encoding="utf-8")
    outcome = call(capfd, "plan", path, "--no-output", *arguments)
    assert outcome.code == 0, outcome.err
    return outcome.err


def test_a_turn_in_place_is_bounded_by_its_angular_speed(tmp_path: Path, capfd: Capture) -> None:
    err = told(tmp_path, capfd, TURN)  # 1.875 x 60 deg / 90 deg/s = 1.25 s
    assert "1 move, 1.25 s\n  tightest limit: angular speed of the tool in move 0, 100 % used" in err
    assert "tightest limit: speed of the tool in move 0, 100 % used" in told(tmp_path, capfd, LINE)


def test_a_circle_moves_although_it_ends_where_it_starts(tmp_path: Path, capfd: Capture) -> None:
    assert "move 0 (arc): no bound: it ends where it starts" in told(tmp_path, capfd, CIRCLE, "--reference")
    assert "move 0 (line): nothing to move" in told(tmp_path, capfd, STILL, "--reference")


def test_the_bound_of_a_path_is_off_the_path(tmp_path: Path, capfd: Capture) -> None:
    assert "x the fastest off the path under the same limits" in told(tmp_path, capfd, LINE, "--reference")
