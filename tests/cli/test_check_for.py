"""`trajcli check --for`: files with one planted fault each, and their clean twins."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from running import call

HOME = {6: [0.0, -1.2, 1.1, 0.2, 0.4, 0.0], 7: [0.0, -0.3, 0.0, -2.0, 0.0, 1.8, 0.5]}
ROBOTS = {
    "franka-fr3": "fr3",
    "franka-fer": "panda",
    "ur-servoj": "ur5e",
    "ur-passthrough": "ur5e",
    "ros-jtc": "ur5e",
}
PERIODS = {"franka-fr3": 1e-3, "franka-fer": 1e-3, "ur-servoj": 2e-3, "ur-passthrough": 0.1}
Rows = dict[str, np.ndarray]


def clean(profile: str) -> Rows:
    """Return a quintic by 0.2 rad of all joints at the period of a consumer."""
    joints = 6 if profile.startswith("ur") else 7
    period = PERIODS[profile]
    count = 21 if period > 0.01 else round(0.5 / period) + 1
    duration = period * (count - 1)
    u = np.linspace(0, 1, count)[:, None]
    change = np.full(joints, 0.2)
    return {
        "t": np.arange(count) * period,
        "q": HOME[joints] + (10 * u**3 - 15 * u**4 + 6 * u**5) * change,
        "qd": (30 * u**2 - 60 * u**3 + 30 * u**4) * change / duration,
        "qdd": (60 * u - 180 * u**2 + 120 * u**3) * change / duration**2,
    }


def checked(
    folder: Path, profile: str, rows: Rows, capfd: pytest.CaptureFixture[str], decimals: int = 12
) -> Any:
    file = folder / "rows.csv"
    kinds = [kind for kind in ("q", "qd", "qdd") if kind in rows]
    names = ["t", *(f"{kind}{k + 1}" for kind in kinds for k in range(rows["q"].shape[1]))]
    table = np.concatenate([rows["t"][:, None], *(rows[kind] for kind in kinds)], axis=1)
    lines = [",".join(f"{value:.{decimals}f}" for value in row) for row in table]
    file.write_text("\n".join([",".join(names), *lines]) + "\n")
    robot = ROBOTS[profile]
    outcome = call(
        capfd, "check", str(file), "--robot", robot, "--units", "rad", "--for", profile, "--format", "json"
    )
    return outcome.code, [found for found in json.loads(outcome.out)["findings"] if "-" in found["rule"]]


def bump(kind: str, row: int, joint: int, by: float) -> Callable[[Rows], None]:
    def plant(rows: Rows) -> None:
        rows[kind][row, joint] += by

    return plant


def late(row: int, by: float) -> Callable[[Rows], None]:
    def plant(rows: Rows) -> None:
        rows["t"][row:] += by

    return plant


def shifted(joint: int, to: float) -> Callable[[Rows], None]:
    def plant(rows: Rows) -> None:
        rows["q"][:, joint] += to - rows["q"][-1, joint]

    return plant


def step(row: int, joint: int, by: float) -> Callable[[Rows], None]:
    def plant(rows: Rows) -> None:
        rows["q"][row:, joint] += by

    return plant


FAULTS = [
    ("franka-fr3", late(200, 3e-4), "fr3-period", None, 201),
    ("franka-fr3", bump("q", 250, 3, 2e-6), "fr3-jerk", "fr3_joint4", None),
    ("franka-fr3", shifted(1, 1.79181), "fr3-position", "fr3_joint2", 501),
    ("franka-fr3", bump("qd", 0, 2, 0.01), "fr3-rest-start", "fr3_joint3", 1),
    ("franka-fr3", bump("qdd", -1, 2, 0.01), "fr3-rest-end", "fr3_joint3", 501),
    ("franka-fr3", step(150, 5, 0.0045), "fr3-velocity", "fr3_joint6", 151),
    ("franka-fer", late(200, 3e-4), "fer-period", None, 201),
    ("franka-fer", bump("q", 250, 1, 1.5e-6), "fer-jerk", "panda_joint2", None),
    ("franka-fer", shifted(3, -0.06979), "fer-position", "panda_joint4", 501),
    ("franka-fer", step(150, 5, 0.003), "fer-velocity", "panda_joint6", 151),
    ("ur-servoj", late(100, 1e-3), "servoj-period", None, 101),
    ("ur-servoj", step(200, 4, 0.041), "servoj-step", "wrist_2_joint", 201),
    ("ur-servoj", step(200, 4, 0.0135), "servoj-speed", "wrist_2_joint", 201),
    ("ur-passthrough", bump("qd", 7, 0, 2150.0), "passthrough-range", "shoulder_pan_joint", 8),
    ("ur-passthrough", late(20, 2200.0), "passthrough-longest", None, 21),
    ("ur-passthrough", late(9, 4e-7), "passthrough-whole-microseconds", None, 10),
]


@pytest.mark.parametrize(("profile", "plant", "rule", "joint", "row"), FAULTS)
def test_a_planted_fault_is_found(
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    profile: str,
    plant: Callable[[Rows], None],
    rule: str,
    joint: str | None,
    row: int | None,
) -> None:
    rows = clean(profile)
    plant(rows)
    code, findings = checked(tmp_path, profile, rows, capfd)
    found = [each for each in findings if each["rule"] == rule]
    assert [each["joint"] for each in found] == [joint], findings
    assert row is None or found[0]["row"] == row
    assert found[0]["time"] == pytest.approx(rows["t"][found[0]["row"] - 1], abs=1e-9)
    assert found[0]["severity"] != "error" or code == 1


@pytest.mark.parametrize("profile", PERIODS)
def test_the_clean_twin_is_accepted(tmp_path: Path, capfd: pytest.CaptureFixture[str], profile: str) -> None:
    code, findings = checked(tmp_path, profile, clean(profile), capfd)
    assert (code, findings) == (0, [])


@pytest.mark.parametrize(
    ("decimals", "rules"),
    [(9, set()), (6, {"fr3-decimals"}), (5, {"fr3-decimals", "fr3-jerk", "fr3-acceleration"})],
)
def test_decimals_of_a_file(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], decimals: int, rules: set[str]
) -> None:
    rows = clean("franka-fr3")
    _, findings = checked(tmp_path, "franka-fr3", {"t": rows["t"], "q": rows["q"]}, capfd, decimals)
    found = {each["rule"] for each in findings}
    assert rules <= found
    assert found == rules or decimals < 9


def goal(change: Callable[[list[dict[str, Any]]], None] | None = None) -> str:
    names = [
        "shoulder_pan_joint",
        "shoulder_lift_joint",
        "elbow_joint",
        "wrist_1_joint",
        "wrist_2_joint",
        "wrist_3_joint",
    ]
    points = []
    for k in range(5):
        u = k / 4
        s, v, a = (
            10 * u**3 - 15 * u**4 + 6 * u**5,
            30 * u**2 - 60 * u**3 + 30 * u**4,
            60 * u - 180 * u**2 + 120 * u**3,
        )
        points.append(
            {
                "positions": [home + 0.3 * s for home in HOME[6]],
                "velocities": [0.15 * v] * 6,
                "accelerations": [0.075 * a] * 6,
                "effort": [],
                "time_from_start": {"sec": k // 2, "nanosec": 500_000_000 * (k % 2)},
            }
        )
    if change is not None:
        change(points)
    return yaml.safe_dump({"joint_names": names, "points": points}, sort_keys=False)


def same_time(points: list[dict[str, Any]]) -> None:
    points[2]["time_from_start"] = points[1]["time_from_start"]


def moving_end(points: list[dict[str, Any]]) -> None:
    points[-1]["velocities"][4] = 2e-7


def efforts(points: list[dict[str, Any]]) -> None:
    for point in points:
        point["effort"] = [0.0] * 6


def positions_only(points: list[dict[str, Any]]) -> None:
    for point in points:
        del point["velocities"], point["accelerations"]


@pytest.mark.parametrize(
    ("change", "rule", "joint", "row", "severity"),
    [
        (None, None, None, None, None),
        (same_time, "jtc-increasing-times", None, 3, "error"),
        (moving_end, "jtc-last-velocity", "wrist_2_joint", 5, "error"),
        (efforts, "jtc-effort", None, 1, "error"),
        (positions_only, "jtc-positions-only", "elbow_joint", None, "warning"),
    ],
)
def test_goals_for_the_trajectory_controller(
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    change: Callable[[list[dict[str, Any]]], None] | None,
    rule: str | None,
    joint: str | None,
    row: int | None,
    severity: str | None,
) -> None:
    file = tmp_path / "goal.yaml"
    file.write_text(goal(change))
    code, out, _ = call(capfd, "check", str(file), "--robot", "ur5e", "--for", "ros-jtc", "--format", "json")
    findings = [found for found in json.loads(out)["findings"] if found["rule"].startswith("jtc-")]
    if rule is None:
        assert (code, findings) == (0, [])
        return
    assert {found["rule"] for found in findings} == {rule}
    assert joint in [found["joint"] for found in findings]
    assert {found["severity"] for found in findings} == {severity}
    assert row is None or findings[0]["row"] == row
    assert severity == "warning" or code == 1


@pytest.mark.full
def test_what_a_plan_for_a_consumer_writes_is_checked_for_it(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """At its knots the acceleration is at its limit but for the last bits: there, too."""
    text = (Path(__file__).parents[2] / "examples" / "blends_ur5e.yaml").read_text()
    job, rows = tmp_path / "job.yaml", str(tmp_path / "rows.csv")
    job.write_text(f"{text}when_over_limit: slow\n")
    assert call(capfd, "plan", job, "--for", "ros-jtc", "-o", rows).code == 0
    code, out, _ = call(capfd, "check", rows, "--job", job, "--for", "ros-jtc", "--json")
    assert (code, json.loads(out)["planned_rows"]) == (0, True), out
    faster = tmp_path / "faster.yaml"  # the same rows against limits that they pass by a thousandth
    faster.write_text(f"{text}when_over_limit: slow\n".replace("acceleration: 600", "acceleration: 599.4"))
    assert call(capfd, "check", rows, "--job", faster, "--for", "ros-jtc", "--json").code == 1


def test_a_goal_with_a_joint_that_is_not_of_the_robot(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """The controller refuses it, though the robot's joints are all there."""
    message = yaml.safe_load(goal())
    message["joint_names"].append("finger")
    for point in message["points"]:
        for key in ("positions", "velocities", "accelerations"):
            point[key].append(0.0)
    file = tmp_path / "goal.yaml"
    file.write_text(json.dumps(message))
    words = ("check", str(file), "--robot", "ur5e", "--for", "ros-jtc", "--format", "json")
    code, out, _ = call(capfd, *words)
    (found,) = (each for each in json.loads(out)["findings"] if each["rule"] == "jtc-joint-names")
    assert code == 1
    assert "the robot has no joint 'finger'" in found["message"]
