"""Scene of a plan: what the page needs to draw the arm and its curves, rebuilt from its numbers and from formulas."""

from __future__ import annotations

from base64 import b64decode
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from trajcli.errors import InputError
from trajcli.job.read import job_from_text
from trajcli.planning.plan import Plan, plan_job
from trajcli.player.scene import opening, order_of, scene_of_plan, scene_of_two, waypoints_of

JOB = """
version: 1
units: {angle: deg, length: mm}
robot:
  convention: CONVENTION
  joints:
    - {name: turn, theta: 10, d: 100, a: 300, alpha: 20, beta: 1, position: [-170, 100], velocity: [-100, 120], acceleration: 500}
    - {name: lift, type: prismatic, sign: -1, theta: 30, d: 40, a: 20, alpha: -70, position: [0, 200], velocity: 500, acceleration: 2000}
    - {name: bend, a: 200, position: [-150, 150], velocity: 90, acceleration: 400}
base: {xyz: [100, 200, 300], rpy: [10, 20, 30]}
tools: {long: {xyz: [50, 0, 30], rpy: [40, 0, 0]}}
points: {high: {joints: [95, 20, 30]}}
start: {joints: [10, 30, 20]}
moves:
  - {planner: quintic, to: {joints: [40, 100, -20]}, duration: 2}
  - {planner: quintic, to: {joints: [50, 90, -10]}, duration: 1}
  - {tool: long}
  - {planner: quintic, to: high, duration: 3, limits: {velocity: {turn: 80}, acceleration: {lift: 1000}}}
  - {planner: trapezoid, to: {joints: [-100, 10, 0]}}
"""


@cache
def planned(convention: str = "standard") -> tuple[Plan, dict[str, Any]]:
    plan = plan_job(job_from_text(JOB.replace("CONVENTION", convention)))
    return plan, scene_of_plan(plan)


def unpacked(columns: dict[str, Any]) -> np.ndarray:
    low, high, width = np.array(columns["low"]), np.array(columns["high"]), columns["width"]
    raw = np.frombuffer(b64decode(columns["values"]), np.uint8).reshape(len(low), -1, width).astype(float)
    return low[:, None] + raw @ 256.0 ** np.arange(width) * (high - low)[:, None] / (256.0**width - 1)


def times_of(scene: dict[str, Any]) -> np.ndarray:
    return np.frombuffer(b64decode(scene["rows"]["times"]), "<f8")


def pose(scene: dict[str, Any], q: np.ndarray, tool: list[list[float]]) -> np.ndarray:
    """Return the tcp as a page draws it: the base, its rows and the tool one after the other."""
    matrix = np.array(scene["robot"]["base"])
    for row, value in zip(scene["robot"]["rows"], q, strict=True):
        theta = row["theta"] + (0 if row["prismatic"] else row["sign"] * value)
        d = row["d"] + (row["sign"] * value if row["prismatic"] else 0)
        joint, screw = np.eye(4), np.eye(4)
        joint[:3, :3], joint[2, 3] = Rotation.from_euler("z", theta).as_matrix(), d
        turned = Rotation.from_euler("x", row["alpha"]) * Rotation.from_euler("y", row.get("beta", 0.0))
        screw[:3, :3], screw[0, 3] = turned.as_matrix(), row["a"]
        matrix = matrix @ (screw @ joint if row["modified"] else joint @ screw)
    return np.asarray(matrix @ np.array(tool))


@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_the_path_of_the_tool_is_that_of_the_table_with_the_tool_of_each_time(convention: str) -> None:
    plan, scene = planned(convention)
    times, q = times_of(scene), unpacked(scene["rows"]["quantities"]["q"]).T
    positions = unpacked(scene["tool"]["positions"]).T
    (change,) = scene["robot"]["changes"]
    spans = plan.trajectory.spans
    assert change["time"] == pytest.approx(spans[2].start)
    later = times > change["time"]
    later |= (times == change["time"]) & np.append(False, np.diff(times) == 0)
    assert later.sum() > 100
    assert (~later).sum() > 100
    for row, use in zip(range(0, len(times), 7), later[::7], strict=True):
        tool = change["tool"] if use else scene["robot"]["tool"]
        assert positions[row] == pytest.approx(pose(scene, q[row], tool)[:3, 3], abs=2e-5)
    border = np.flatnonzero(np.diff(times) == 0)
    border = border[times[border] == change["time"]]
    assert np.linalg.norm(positions[border + 1] - positions[border]) == pytest.approx(
        np.hypot(0.05, 0.03), abs=1e-4
    )
    speeds = unpacked(scene["tool"]["speeds"])[0]
    inner = np.arange(5, len(times) - 5)[::11]
    inner = inner[(np.diff(times)[inner] > 0) & (np.diff(times)[inner - 1] > 0)]
    gone = np.linalg.norm(positions[inner + 1] - positions[inner - 1], axis=1) / (
        times[inner + 1] - times[inner - 1]
    )
    assert np.abs(speeds[inner] - gone).max() < 0.02 * speeds.max()
    assert scene["tool"]["scale"] == pytest.approx(1000)
    assert (scene["length"], scene["angle"]["unit"]) == ({"unit": "mm", "scale": pytest.approx(1000)}, "deg")
    assert scene["angle"]["scale"] == pytest.approx(180 / np.pi)
    ranges = [row["range"] for row in scene["robot"]["rows"]]
    assert np.array(ranges) == pytest.approx(np.stack([q.min(axis=0), q.max(axis=0)], axis=1), abs=1e-6)


def test_rows_are_the_curve_and_joints_say_their_units() -> None:
    plan, scene = planned()
    times = times_of(scene)
    alone = np.append(True, np.diff(times) > 0) & np.append(np.diff(times) > 0, True)
    for order, name in enumerate(("q", "qd", "qdd", "qddd")):
        values = unpacked(scene["rows"]["quantities"][name]).T
        expected = plan.trajectory.curve.evaluate(times[alone], order)
        assert values[alone] == pytest.approx(expected, abs=1e-4 * np.abs(expected).max())
    turn, lift, _ = scene["joints"]
    assert turn["units"] == ["deg", "deg/s", "deg/s²", "deg/s³", "N m"]
    assert lift["units"] == ["mm", "mm/s", "mm/s²", "mm/s³", "N"]
    assert (turn["scale"], lift["scale"]) == pytest.approx((180 / np.pi, 1000))


def test_limits_and_moves_have_their_intervals_and_equal_neighbours_are_one() -> None:
    plan, scene = planned()
    spans = plan.trajectory.spans
    intervals = [(part["start"], part["end"]) for part in scene["limits"]]
    ends = [0, spans[1].end, spans[3].end, spans[4].end]
    assert intervals == [(pytest.approx(a), pytest.approx(b)) for a, b in pairwise(ends)]
    turn, lift, bend = range(3)
    bounds = [part["bounds"] for part in scene["limits"]]
    assert [np.degrees(each[1][turn]).tolist() for each in bounds] == [
        pytest.approx([-100, 120]),
        pytest.approx([-80, 80]),
        pytest.approx([-100, 120]),
    ]
    assert [each[2][lift] for each in bounds] == [pytest.approx([-b, b]) for b in (2, 1, 2)]
    assert all(each[3][bend] == [None, None] and len(each) == 4 for each in bounds)
    assert [(move["start"], move["end"], move["index"]) for move in scene["moves"]] == [
        (pytest.approx(spans[k].start), pytest.approx(spans[k].end), k) for k in (0, 1, 3, 4)
    ]
    points = scene["waypoints"]
    assert [point["time"] for point in points] == pytest.approx([0, *(spans[k].end for k in (0, 1, 3, 4))])
    shown = [[np.degrees(p["joints"][0]), 1000 * p["joints"][1], np.degrees(p["joints"][2])] for p in points]
    assert np.array(shown) == pytest.approx(
        np.array([[10, 30, 20], [40, 100, -20], [50, 90, -10], [95, 20, 30], [-100, 10, 0]]), abs=1e-6
    )
    assert [point["name"] for point in points] == ["", "", "", "high", ""]
    (mark,) = scene["marks"]
    assert (mark["time"], mark["index"]) == (pytest.approx(spans[2].start), 2)


def test_findings_stand_in_the_plot_of_their_joint_and_the_page_opens_at_the_worst() -> None:
    text = JOB.replace("CONVENTION", "standard").replace("duration: 3", "duration: 0.5")
    plan = plan_job(job_from_text(text))
    scene = scene_of_plan(plan)
    findings = plan.verdict.findings
    shown = scene["findings"]
    assert len(shown) == len(findings)
    plots = ("position", "velocity", "acceleration", "jerk", "effort")
    for one, finding in zip(shown, findings, strict=True):
        assert one["joint"] == ("turn", "lift", "bend").index(finding.joint)
        assert plots[one["order"]] == finding.kind
        assert (one["time"], one["value"]) == (finding.time, finding.value)
        assert (times_of(scene) == finding.time).any()
    assert scene["verdict"]["state"] == "violated"
    over = [abs(finding.value or 0) / abs(finding.limit or 1) for finding in findings]
    worst = findings[int(np.argmax(over))]
    assert scene["opens_at"] == worst.time
    assert opening(findings, [[k] for k in range(len(findings))]) == worst.time
    assert opening((), []) is None


def test_steps_have_the_size_and_the_unit_of_their_joint() -> None:
    plan, scene = planned()
    steps = plan.verdict.steps
    assert {step.joint for step in steps} >= {"turn", "lift"}
    scales = {"turn": (180 / np.pi, "deg/s²"), "bend": (180 / np.pi, "deg/s²"), "lift": (1000, "mm/s²")}
    for shown, step in zip(scene["steps"], steps, strict=True):
        scale, unit = scales[step.joint]
        assert (shown["time"], shown["label"]) == (step.time, f"{step.joint}:")
        assert shown["message"] == f"by {step.size * scale:.4g} {unit}"


def test_points_between_stand_at_the_times_of_their_own_move_and_an_arm_on_a_rail_where_it_is() -> None:
    text = """
version: 1
robot: {rail: {axis: x, position: [0, 5]}, arm: planar2r}
limits: {velocity: 9}
base: {xyz: [1, 2, 3], rpy: [0.1, 0.2, 0.3]}
start: {joints: [0, 0, 0]}
moves:
  - {planner: quintic, to: {joints: [1, 0.5, 0.2]}, duration: 2}
  - {planner: spline, through: [{joints: [2, 0.7, 0.4]}], to: {joints: [3, 0, 0]}, duration: 4}
"""
    plan = plan_job(job_from_text(text))
    scene = scene_of_plan(plan)
    start, first, between, end = scene["waypoints"]
    assert (start["time"], first["time"], end["time"]) == pytest.approx((0, 2, 6))
    assert 2 < between["time"] < 6
    assert between["joints"] == pytest.approx([2, 0.7, 0.4])
    q = plan.trajectory.curve.evaluate(between["time"])
    assert q == pytest.approx([2, 0.7, 0.4])
    row = int(np.abs(times_of(scene) - between["time"]).argmin())
    values = unpacked(scene["rows"]["quantities"]["q"])[:, row]
    positions = unpacked(scene["tool"]["positions"])[:, row]
    assert positions == pytest.approx(pose(scene, values, scene["robot"]["tool"])[:3, 3], abs=1e-4)
    assert any(note.startswith("Without a limit, not checked: ") for note in scene["notes"])


def test_plots_are_numbered_by_the_kinds_of_limits() -> None:
    kinds = ("position", "velocity", "acceleration", "jerk", "effort", "tool_speed")
    assert [order_of(kind) for kind in kinds] == [0, 1, 2, 3, 4, None]


def test_angles_in_any_unit_go_with_each_other_and_with_what_is_open_but_not_with_lengths() -> None:
    def of(*units: str) -> dict[str, Any]:
        joints = [{"units": [unit]} for unit in units]
        return {
            "title": "/".join(units),
            "joints": joints,
            "notes": [],
            "findings": [],
            "causes": [],
            "moves": [],
        }

    for second in (("rad", "mm"), ("deg", "m"), ("rad or m", "rad or m")):
        assert scene_of_two(of("deg", "mm"), of(*second))["other"]["title"] == "/".join(second)
    for second, message in (
        (("mm", "mm"), "joint 1 is an angle in deg/mm and a length in mm/mm"),
        (("deg",), "have not as many joints"),
    ):
        with pytest.raises(InputError, match=message):
            scene_of_two(of("deg", "mm"), of(*second))


def test_equal_points_are_one_with_a_name_and_many_are_thinned() -> None:
    points = [
        (0.0, np.array([1.0, 2.0]), ""),
        (1.0, np.array([1.00001, 2.0]), "home"),
        (2.0, np.array([1.001, 2.0]), ""),
    ]
    assert [(each["time"], each["name"]) for each in waypoints_of(points)] == [(0.0, "home"), (2.0, "")]
    many = waypoints_of([(float(k), np.array([0.01 * k]), "") for k in range(100)])
    assert [each["time"] for each in many] == list(range(0, 100, 3))
    assert waypoints_of([]) == []
