"""`trajcli check` on the command line: verdicts, exit codes, formats, and options that do not fit."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from planned_examples import share_plans
from running import EXAMPLES, ROOT, call
from tiers import few

import trajcli
from trajcli.cli.app import app

GOAL = ROOT / "tests/oracles/recorded/ur_goal.yaml"
LIMITS = ROOT / "tests/judge/recordings/five.yaml"
BY_UR10E = ("--robot", "ur10e", "--limits", LIMITS)

JOB = """\
version: 1
units: {angle: deg}
robot: ur5e
limits: {acceleration: 400, jerk: 4000, tcp: {speed: "0.5 m/s"}}
points: {home: {joints: [0, -90, 90, 0, 90, 0]}}
start: home
moves:
  - {planner: quintic, to: {joints: [20, -80, 80, 0, 90, 0]}, duration: 1}
  - {planner: line, to: {xyz: [0.5, 0.1, 0.5]}, law: {shape: quintic, duration: 2}}
  - {planner: quintic, to: home, duration: 3, limits: {velocity: 60}}
output: {rate: 500, columns: [t, q, qd, qdd, move]}
"""


@pytest.fixture(autouse=True)
def _plans_are_made_once(monkeypatch: pytest.MonkeyPatch) -> None:
    share_plans(monkeypatch)


def view(capfd: pytest.CaptureFixture[str], *words: str | Path) -> tuple[int, dict[str, Any]]:
    code, out, err = call(capfd, "check", *words, "--format", "json")
    assert out, err
    return code, json.loads(out)


def test_the_quintics_between_five_good_points_are_named(capfd: pytest.CaptureFixture[str]) -> None:
    """All points stay within 5.0001 rad/s^2: UR driver, issue 1273."""
    code, judgement = view(capfd, GOAL, *BY_UR10E)
    assert (code, judgement["verdict"], judgement["interpolation"]) == (1, "exceeded", "quintic")
    worst = {each["joint"]: each for each in judgement["findings"] if each["kind"] == "acceleration"}
    elbow, wrist = worst["elbow_joint"], worst["wrist_3_joint"]
    assert judgement["findings"][0] == elbow
    assert (round(elbow["value"], 2), elbow["row"], elbow["rule"]) == (6.87, 1, "limit")
    assert (round(wrist["value"], 2), wrist["row"], wrist["severity"]) == (5.54, 4, "error")
    assert 0.0 < elbow["time"] < 0.1
    assert 0.3 < wrist["time"] < 0.4
    assert elbow["factor"] == pytest.approx((elbow["value"] / 5.0001) ** 0.5)
    keys = {"rule", "severity", "kind", "joint", "value", "limit", "time", "row", "factor", "method"}
    assert all(keys <= each.keys() for each in judgement["findings"])
    assert view(capfd, GOAL, *BY_UR10E, "--interpolate", "jtc")[1]["findings"][0]["value"] == elbow["value"]
    assert call(capfd, "check", GOAL, *BY_UR10E, "--interpolate", "hold").code == 0


def test_the_table_has_the_worst_first(capfd: pytest.CaptureFixture[str]) -> None:
    code, out, _ = call(capfd, "check", GOAL, *BY_UR10E)
    assert code == 1
    lines = out.splitlines()
    assert lines[0].endswith("exceeded (5 rows, every 0.1 s, joined by quintics)")
    assert lines[2].split()[:3] == ["exceeded", "acceleration", "elbow_joint"]
    assert "6.87031236 rad/s^2" in lines[2]
    assert any("1.1722 times as long" in line for line in lines)


@pytest.mark.parametrize("form", ["junit", "sarif", "github"])
def test_a_document_says_why_the_only_file_cannot_be_judged(
    form: str, capfd: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    (tmp_path / "rows.csv").write_text("t,q1\n0,0\n1,nan\n")
    code, out, err = call(capfd, "check", tmp_path / "rows.csv", "-r", "ur5e", "--format", form)
    assert (code, err) == (2, "")
    assert "rows.csv" in out


@pytest.mark.parametrize("form", ["junit", "sarif", "github"])
def test_findings_for_continuous_integration(capfd: pytest.CaptureFixture[str], form: str) -> None:
    code, out, _ = call(capfd, "check", GOAL, *BY_UR10E, "--format", form)
    assert code == 1
    assert "elbow_joint reaches 6.87031236 rad/s^2" in out
    assert "(row 1)" in out


def plan_quietly(*words: str) -> None:
    with pytest.raises(SystemExit) as left:
        app(["plan", *words, "-q"])
    assert not left.value.code


@pytest.fixture(scope="module")
def planned(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a job and its rows in all formats."""
    folder = tmp_path_factory.mktemp("planned")
    (folder / "job.yaml").write_text(JOB)
    with pytest.MonkeyPatch.context() as patch:
        share_plans(patch)
        for name in ("rows.csv", "rows.jsonl", "rows.mcap", "rows.yaml"):
            plan_quietly(str(folder / "job.yaml"), "-o", str(folder / name))
        plan_quietly(str(folder / "job.yaml"), "--si", "-o", str(folder / "si.csv"))
    return folder


@pytest.mark.parametrize("name", few(["rows.csv", "rows.jsonl", "rows.mcap", "rows.yaml", "si.csv"], 2))
def test_what_plan_writes_is_satisfied(capfd: pytest.CaptureFixture[str], planned: Path, name: str) -> None:
    code, judgement = view(capfd, planned / name, "--job", planned / "job.yaml")
    assert code == 0, judgement["findings"]
    assert judgement["verdict"] in ("satisfied", "within rounding")
    if name != "rows.yaml":
        assert judgement["period"] == 0.002


@pytest.mark.full
def test_standard_input_is_a_file(planned: Path, capfd: pytest.CaptureFixture[str]) -> None:
    rows = (planned / "rows.csv").read_text()
    done = call(capfd, "check", "-", "--job", planned / "job.yaml", "--format", "json", stdin=rows)
    assert done.code == 0
    assert json.loads(done.out)["rows"] == len(rows.splitlines()) - 1


def changed(planned: Path, tmp_path: Path, **columns: Any) -> Path:
    """Return a file of rows of which some columns are others: functions of them and of the moves."""
    head, *lines = (planned / "rows.csv").read_text().splitlines()
    names = head.split(",")
    table = np.array([[float(cell) for cell in line.split(",")] for line in lines])
    for name, change in columns.items():
        column = names.index(name)
        table[:, column] = change(table[:, column], table[:, names.index("move")])
    path = tmp_path / "changed.csv"
    np.savetxt(path, table, "%.9f", ",", header=head, comments="")
    return path


@pytest.mark.full
def test_a_tool_beside_its_line_is_found(
    capfd: pytest.CaptureFixture[str], planned: Path, tmp_path: Path
) -> None:
    def bent(q: np.ndarray, move: np.ndarray) -> np.ndarray:
        phase = np.cumsum(move == 1) / (move == 1).sum()
        return q + np.where(move == 1, 0.05 * (1 - np.cos(2 * np.pi * phase)), 0.0)

    path = changed(planned, tmp_path, q1_deg=bent)
    code, judgement = view(capfd, path, "--job", planned / "job.yaml")
    found = [each for each in judgement["findings"] if each["kind"] == "deviation"]
    assert code == 1
    assert {(each["move"], each["rule"], each["severity"]) for each in found} == {(1, "path", "error")}
    beside = next(each for each in found if each["quantity"] == "position")
    assert beside["limit"] == 1e-6
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    on_line = table[table[:, -1] == 1]
    points = trajcli.load_robot("ur5e").fk(np.radians(on_line[:, 1:7]))[:, :3, 3]
    along = np.array([0.5, 0.1, 0.5]) - points[0]
    apart = np.cross(points - points[0], along / np.linalg.norm(along))
    assert beside["value"] == pytest.approx(np.linalg.norm(apart, axis=1).max(), rel=1e-4)


@pytest.mark.full
def test_the_limits_of_a_move_hold_in_it_alone(
    capfd: pytest.CaptureFixture[str], planned: Path, tmp_path: Path
) -> None:
    job = tmp_path / "tight.yaml"
    job.write_text(JOB.replace("limits: {velocity: 60}", "limits: {velocity: 5}"))
    code, judgement = view(capfd, planned / "rows.csv", "--job", job)
    found = [each for each in judgement["findings"] if each["kind"] == "velocity"]
    assert code == 1
    assert {each["move"] for each in found} == {2}
    assert found[0]["limit"] == pytest.approx(np.copysign(np.radians(5), found[0]["value"]))


@pytest.mark.full
def test_moves_without_a_column_are_known_by_the_times_of_the_plan(
    capfd: pytest.CaptureFixture[str], planned: Path, tmp_path: Path
) -> None:
    tight = tmp_path / "tight.yaml"
    tight.write_text(JOB.replace("limits: {velocity: 60}", "limits: {velocity: 5}"))
    code, judgement = view(capfd, planned / "rows.yaml", "--job", tight)
    assert code == 1
    assert {each["move"] for each in judgement["findings"] if each["kind"] == "velocity"} == {2}
    head, *lines = (planned / "rows.csv").read_text().splitlines()
    half = tmp_path / "half.csv"
    half.write_text("\n".join([head.removesuffix(",move"), *(line[:-2] for line in lines[:1500])]))
    assert any("no column `move`" in note for note in view(capfd, half, "--job", tight)[1]["notes"])


@pytest.mark.full
def test_another_start_is_found(capfd: pytest.CaptureFixture[str], planned: Path, tmp_path: Path) -> None:
    job = tmp_path / "moved.yaml"
    job.write_text(JOB.replace("start: home", "start: {joints: [0.5, -90, 90, 0, 90, 0]}"))
    code, judgement = view(capfd, planned / "rows.csv", "--job", job)
    found = next(each for each in judgement["findings"] if each["kind"] == "start")
    assert (code, found["rule"], found["row"], found["joint"]) == (1, "state", 1, "shoulder_pan_joint")
    words = ("--job", job, "--start-tolerance", "0.6")
    assert view(capfd, planned / "rows.csv", *words)[0] == 0


@pytest.mark.full
def test_the_speed_of_the_tool_is_judged(
    capfd: pytest.CaptureFixture[str], planned: Path, tmp_path: Path
) -> None:
    job = tmp_path / "slow_tool.yaml"
    job.write_text(JOB.replace("0.5 m/s", "0.05 m/s"))
    code, judgement = view(capfd, planned / "rows.csv", "--job", job)
    found = next(each for each in judgement["findings"] if each["kind"] == "tool_speed")
    assert (code, found["method"], found["limit"], found["joint"]) == (1, "bounded", 0.05, None)


def test_strict_refuses_what_rounding_explains(capfd: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    t = np.arange(401) * 1e-3
    rows = np.stack([t, np.round(t + 3e-7 * (-1) ** np.arange(401), 6)], axis=1)
    path, limits = tmp_path / "rows.csv", tmp_path / "limits.yaml"
    np.savetxt(path, rows, ("%.3f", "%.6f"), ",", header="t,q1", comments="")
    limits.write_text("velocity: 1\n")
    robot = tmp_path / "robot.yaml"
    robot.write_text("joints: 1\n")
    words = ("check", path, "--robot", robot, "--limits", limits)
    assert call(capfd, *words).code == 0
    assert "satisfied" in call(capfd, *words).out
    limits.write_text("velocity: 0.9999\n")
    assert "within rounding" in call(capfd, *words).out
    assert call(capfd, *words).code == 0
    assert call(capfd, *words, "--strict").code == 1
    limits.write_text("velocity: 0.99\n")
    assert call(capfd, *words).code == 1


def test_strict_sees_events(capfd: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    limits = tmp_path / "limits.yaml"
    limits.write_text("velocity: 100\nacceleration: 100\n")
    words = ("check", GOAL, "--robot", "ur10e", "--limits", limits)
    code, _, err = call(capfd, *words)
    assert code == 0
    assert "looser than the robot's" in err
    assert call(capfd, *words, "--strict").code == 1


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((), "--job, or an arm with --robot"),
        (("--robot", "ur5e", "--job", "x.yaml"), "name one of them"),
        (("--robot", "scara"), "3 joints"),
        (("--robot", "ur11"), "did you mean"),
        (("--robot", "ur10e", "--start-tolerance", "1"), "--start-tolerance is about the start"),
        (("--robot", "ur10e", "--for", "ros-jct"), "did you mean 'ros-jtc'"),
        (("--robot", "ur10e", "--interpolate", "spline"), "Invalid value"),
    ],
)
def test_options_that_do_not_fit(
    capfd: pytest.CaptureFixture[str], words: tuple[str, ...], said: str
) -> None:
    code, out, err = call(capfd, "check", GOAL, *words)
    assert (code, out) == (2, "")
    if "joints" not in said and "did you mean" not in said:
        assert said in err


def test_limits_files_say_what_is_wrong_in_them(capfd: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    limits = tmp_path / "limits.yaml"
    limits.write_text("acceleraton: 5\n")
    code, _, err = call(capfd, "check", GOAL, "--robot", "ur10e", "--limits", limits)
    assert code == 2
    assert f"{limits}:1:1" in err
    assert "acceleration" in err


def test_limits_files_may_be_in_degrees(capfd: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    limits = tmp_path / "limits.yaml"
    limits.write_text(f"units: {{angle: deg}}\nacceleration: {np.degrees(5.0001):.12f}\n")
    findings = view(capfd, GOAL, "--robot", "ur10e", "--limits", limits)[1]["findings"]
    assert findings[0]["limit"] == pytest.approx(5.0001)


def test_limits_that_are_looser_than_the_robots_are_said_with_their_units(
    capfd: pytest.CaptureFixture[str],
) -> None:
    """3.14159265 rad/s are the 180 deg/s of the robot's description."""
    words = ("check", GOAL, "--robot", "ur5e", "--limits")
    said = "the given velocity limit of elbow_joint is looser than the robot's: {} instead of {}"
    assert said.format("10 rad/s", "3.14159265 rad/s") in call(capfd, *words, "{velocity: 10}").err
    in_degrees = call(capfd, *words, "{velocity: 500}", "--units", "deg")
    assert said.format("500 deg/s", "180 deg/s") in in_degrees.err


def test_limits_files_may_be_of_moveit(capfd: pytest.CaptureFixture[str]) -> None:
    folder = EXAMPLES / "moveit"
    file = next(iter(sorted(folder.glob("*limits*.yaml"))))
    code, _, err = call(capfd, "check", GOAL, "--robot", "ur10e", "--limits", file)
    assert code in (0, 1, 2)
    assert "Traceback" not in err


def test_values_of_the_job_are_overridden_as_when_it_was_planned(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    job, rows = EXAMPLES / "cubic.yaml", tmp_path / "slower.csv"
    slower = ("--set", "moves.0.duration=1.25")
    assert call(capfd, "plan", job, *slower, "-o", rows).code == 0
    assert view(capfd, rows, "--job", job)[1]["planned_rows"] is False
    code, found = view(capfd, rows, "--job", job, *slower)
    assert (code, found["planned_rows"], found["findings"]) == (0, True, [])
    # a limit below the largest velocity of the cubic, 1.5 times its mean
    tight = view(capfd, rows, "--job", job, *slower, "--set", "limits.velocity=1")
    assert tight[0] == 1
    assert "velocity" in {finding["kind"] for finding in tight[1]["findings"]}


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("--robot", "ur5e", "--set", "limits.velocity=1"), "and there is none"),
        (("--job", EXAMPLES / "cubic.yaml", "--limits", "{velocity: 1}"), "--set limits.KEY=VALUE"),
        (("--job", EXAMPLES / "cubic.yaml", "--set", "limit.velocity=1"), "unknown key 'limit'"),
        (("--job", EXAMPLES / "cubic.yaml", "--velocity", "1"), "--set limits.velocity=NUMBER"),
    ],
)
def test_a_limit_that_is_overridden_is_one_of_a_job(
    words: tuple[str | Path, ...], text: str, capfd: pytest.CaptureFixture[str]
) -> None:
    code, out, err = call(capfd, "check", GOAL, *words)
    assert (code, out) == (2, "")
    assert text in err
