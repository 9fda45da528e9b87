"""Rows that `trajcli plan --for` wrote are recognised by `trajcli check --job` where nobody names the consumer."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from planned_examples import planned_example
from running import call
from tiers import few

from trajcli.judge.rows.rows_for_consumers import consumers_of
from trajcli.streams.byte_source import ByteSource

EXAMPLES = Path(__file__).parents[2] / "examples"
SLOW = ("--set", "when_over_limit=slow")


STEPPING = """\
version: 1
robot: ur5e
limits: {acceleration: 4, jerk: null}
start: {joints: [0, 0, 0, 0, 0, 0]}
moves: [{planner: trapezoid, to: {joints: [0.3, 0, 0, 0, 0, 0]}, velocity: 0.5}]
"""


def planned(capfd: pytest.CaptureFixture[str], job: str, file: Path, *options: str) -> None:
    outcome = call(capfd, "plan", str(EXAMPLES / job), "-o", str(file), *SLOW, *options)
    assert outcome.code == 0, outcome.err


def checked(capfd: pytest.CaptureFixture[str], job: str, file: Path) -> tuple[int, dict[str, Any]]:
    outcome = call(capfd, "check", str(file), "--job", str(EXAMPLES / job), "--json")
    return outcome.code, json.loads(outcome.out)


@pytest.mark.full
@pytest.mark.parametrize("ending", few(["csv", "mcap", "goal.yaml", "jsonl", "npy", "npz"], 2))
def test_a_slower_motion_for_a_consumer_is_named_with_its_options(
    ending: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / f"rows.{ending}"
    planned(capfd, "sync.yaml", file, "--for", "ros-jtc")
    code, found = checked(capfd, "sync.yaml", file)
    assert (code, found["planned_rows"], found["verdict"]) == (0, True, "satisfied")
    assert found["planned_with"] == "--for ros-jtc --set when_over_limit=slow"


@pytest.mark.full
def test_the_options_that_are_named_make_the_same_rows(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    file, again = tmp_path / "rows.csv", tmp_path / "again.csv"
    planned(capfd, "sync.yaml", file, "--for", "ros-jtc", "--rate", "10")
    words = checked(capfd, "sync.yaml", file)[1]["planned_with"].split()
    assert words[:4] == ["--for", "ros-jtc", "--rate", "10"]
    assert call(capfd, "plan", str(EXAMPLES / "sync.yaml"), "-o", str(again), *words).code == 0
    assert again.read_bytes() == file.read_bytes()


@pytest.mark.full
def test_the_table_says_it_in_its_first_line(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "rows.csv"
    planned(capfd, "sync.yaml", file, "--for", "ros-jtc")
    outcome = call(capfd, "check", str(file), "--job", str(EXAMPLES / "sync.yaml"))
    first = outcome.out.splitlines()[0]
    assert "rows of the motion that the job plans with `--for ros-jtc --set when_over_limit=slow`)" in first


def test_a_consumer_that_has_the_rate_of_the_rows_is_tried_first(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    file, example = tmp_path / "rows.csv", planned_example("moveit_limits")
    planned(capfd, "moveit_limits.yaml", file, "--for", "ur-servoj")
    tried = [made.profile for made in consumers_of(ByteSource(str(file)), example)]
    assert tried[0] == "ur-servoj"
    assert "ros-jtc" in tried


def _off(lines: list[str], row: int, column: int, by: float) -> list[str]:
    cells = lines[row].split(",")
    cells[column] = f"{float(cells[column]) + by:.9f}"
    return [*lines[:row], ",".join(cells), *lines[row + 1 :]]


FAULTS = {
    "a row is missing": lambda lines: [*lines[:4], *lines[5:]],
    "a row is doubled": lambda lines: [*lines[:5], *lines[4:]],
    "a row is later": lambda lines: _off(lines, 4, 0, 1e-6),
    "a value is off": lambda lines: _off(lines, 4, 1, 1e-5),
    "joints are swapped": lambda lines: [lines[0], *(_swapped(line) for line in lines[1:])],
}


def _swapped(line: str) -> str:
    cells = line.split(",")
    return ",".join([cells[0], cells[2], cells[1], *cells[3:]])


@pytest.mark.parametrize("fault", few([*FAULTS], 1))
def test_no_fault_is_taken_for_rows_of_a_consumer(
    fault: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "rows.csv"
    planned(capfd, "sync.yaml", file, "--for", "ros-jtc")
    file.write_text("\n".join(FAULTS[fault](file.read_text().splitlines())) + "\n")
    found = json.loads(
        call(capfd, "check", str(file), "--job", str(EXAMPLES / "sync.yaml"), "--json").out or "{}"
    )
    assert found.get("planned_rows") is not True
    assert "planned_with" not in found


@pytest.mark.full
def test_rows_with_other_ends_are_planned_for_nobody(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    from trajcli.cli import check

    file = tmp_path / "rows.csv"
    planned(capfd, "sync.yaml", file, "--for", "ros-jtc")
    slower = file.read_text().splitlines()
    planned(capfd, "sync.yaml", file)
    own = _off(file.read_text().splitlines(), 4, 1, 1e-5)  # lasts as long as the job alone
    monkeypatch.setattr(check, "delivered_as", lambda *_: pytest.fail("it is planned for a consumer"))
    for lines in (slower[:-1], own):
        file.write_text("\n".join(lines) + "\n")
        assert checked(capfd, "sync.yaml", file)[1]["planned_rows"] is False


def test_a_slower_motion_is_recognised_where_its_consumer_is_named(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """What the advice of `plan --for` wrote; the job itself says nothing of slowness."""
    job, file = tmp_path / "job.yaml", tmp_path / "rows.csv"
    job.write_text(STEPPING, encoding="utf-8")
    planned(capfd, str(job), file, "--for", "ur-servoj")
    outcome = call(capfd, "check", str(file), "--job", str(job), "--for", "ur-servoj", "--json")
    found = json.loads(outcome.out)
    assert (outcome.code, found["planned_rows"]) == (0, True)
    assert found["planned_with"] == "--for ur-servoj --set when_over_limit=slow"
    other = call(capfd, "check", str(file), "--job", str(job), "--for", "ur-passthrough", "--json")
    assert json.loads(other.out)["planned_rows"] is False


def test_rows_that_a_job_asks_for_its_consumer_are_recognised_where_that_is_named_again(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """`plan --for` takes other columns than the job asks for, and would write others."""
    job, file = tmp_path / "job.yaml", tmp_path / "rows.csv"
    output = "output: {for: ur-servoj, columns: [t, q, move]}\n"
    job.write_text(STEPPING.replace("moves:", f"{output}moves:"), encoding="utf-8")
    assert call(capfd, "plan", str(job), "-o", str(file)).code == 0
    outcome = call(capfd, "check", str(file), "--job", str(job), "--for", "ur-servoj", "--json")
    assert (outcome.code, json.loads(outcome.out)["planned_rows"]) == (0, True)


def test_a_job_of_longer_periods_may_last_longer_than_the_rows_of_its_consumer(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """0.3 rad by a quintic at 1 rad/s at most: 15 / 8 * 0.3 = 0.5625 s, which is 0.564 s and 0.6 s in whole periods."""
    job, file = tmp_path / "job.yaml", tmp_path / "rows.csv"
    text = STEPPING.replace("trapezoid", "quintic").replace(", velocity: 0.5", "")
    text = text.replace("acceleration: 4", "velocity: 1, acceleration: 40")
    job.write_text(f"{text}output: {{rate: 10, align: true}}\n", encoding="utf-8")
    planned(capfd, str(job), file, "--for", "ur-servoj")
    assert len(file.read_text(encoding="utf-8").splitlines()) == 1 + 282 + 1
    code, found = checked(capfd, str(job), file)
    assert (code, found["planned_with"]) == (0, "--for ur-servoj")
