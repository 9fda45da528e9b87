"""Names with control characters, of files and in them, begin no line of a log; names of any length are cut."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from running import call

JOB = """\
version: 1
robot: {joints: 1}
start: {joints: [0]}
moves: [{planner: quintic, to: {joints: [1]}, duration: 1}]
output: {rate: 4}
"""
ROBOT = "joints: [{name: a, velocity: 1, acceleration: 20}]\n"
GOAL = """\
joint_names: ["x\\n::error::joint"]
points:
  - {positions: [0.0], time_from_start: {sec: 0, nanosec: 0}}
  - {positions: [9.0], time_from_start: {sec: 1, nanosec: 0}}
"""
EVIL = "f\n::error::file\x1b[31m\u2028"
Capture = pytest.CaptureFixture[str]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    texts = {f"{EVIL}.yaml": JOB, "robot.yaml": ROBOT, f"{EVIL}goal.yaml": GOAL}
    rows = [{"t": t, "q": [4.0 * t], "k\n::error::key": "text"} for t in (0, 1)]
    texts["rows.jsonl"] = "".join(f"{json.dumps(row)}\n" for row in rows)
    for name, text in texts.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path


COMMANDS = [
    ("plan", f"{EVIL}.yaml", "-o", f"{EVIL}.csv"),
    ("plan", f"{EVIL}.yaml", "-o", f"{EVIL}.csv", "--set", "limits.velocity=0.1"),
    ("explain", f"{EVIL}.yaml"),
    ("check", f"{EVIL}goal.yaml", "--robot", "robot.yaml"),
    ("check", f"{EVIL}goal.yaml", "--robot", "robot.yaml", "--format", "github"),
    ("check", "rows.jsonl", "--robot", "robot.yaml"),
    ("check", f"{EVIL}none.csv", "--robot", "robot.yaml"),
    ("check", "rows.jsonl", "--robot", f"{EVIL}none"),
    ("reverse", f"{EVIL}goal.yaml", "-o", "back.csv"),
    ("diff", f"{EVIL}goal.yaml", "rows.jsonl"),
    ("batch", f"{EVIL}.yaml", "-o", "out"),
]


@pytest.mark.parametrize("words", COMMANDS, ids=lambda words: words[0])
def test_no_name_begins_a_line(words: tuple[str, ...], folder: Path, capfd: Capture) -> None:
    found = call(capfd, *words)
    printed = found.out + found.err
    assert printed
    assert "\x1b" not in printed
    ours = "--format" in words  # a command of our own names the file with its escapes
    lines = [line for line in printed.replace("\u2028", "\n").split("\n") if line.startswith("::")]
    assert all("file=f%0A" in line for line in lines) if ours else lines == []


LONG = "a" * 10**6


@pytest.mark.parametrize(
    "text",
    [
        JOB.replace("joints: 1}", f"joints: [{{name: {LONG}}}]}}"),
        JOB.replace("{joints: [1]}", LONG),
        JOB.replace("start:", f"points: {{{LONG}: {{joints: [1]}}}}\nstart:"),
        JOB.replace("quintic", LONG),
        JOB.replace("output", LONG),
    ],
    ids=["joint", "to", "point", "planner", "key"],
)
def test_a_name_of_a_million_characters_is_not_printed_whole(
    text: str, tmp_path: Path, capfd: Capture
) -> None:
    (tmp_path / "job.yaml").write_text(text, encoding="utf-8")
    for form in ("text", "json", "github"):
        found = call(capfd, "plan", tmp_path / "job.yaml", "--errors", form)
        assert found.code == 2
        assert 20 < len(found.out + found.err) < 12_000
