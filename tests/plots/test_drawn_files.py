"""What a picture takes from a file: values of joints and tool by formulas, with units of names, frames and tools of a job."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from trajcli.columns import parse_column
from trajcli.errors import InputError
from trajcli.findings import Finding
from trajcli.job.read import job_from_text
from trajcli.judge.judgement import Judgement
from trajcli.planning.plan import Plan, plan_job
from trajcli.plots.display_units import DisplayUnits, require_joints, units_of_files
from trajcli.plots.recorded_motion import DrawnTable
from trajcli.streams.table import Table
from trajcli.units import Units

JOB = """
version: 1
units: {angle: deg, length: mm}
robot: {convention: standard, joints: [{name: turn, a: 300}, {name: bend, a: 200, alpha: 180}, {name: lift, type: prismatic}]}
tools: {long: {xyz: [50, 0, 0]}}
start: {joints: [0, 30, 10]}
output: {start_time: 5}
moves:
  - {planner: quintic, to: {joints: [40, 60, 50]}, duration: 1}
  - {tool: long}
  - {planner: quintic, to: {joints: [0, 30, 10]}, duration: 1}
"""
T = 5 + np.arange(41) / 20
DISPLAY = DisplayUnits(("turn", "bend", "lift"), ("revolute", "revolute", "prismatic"), Units("deg", "mm"))


@pytest.fixture(scope="module")
def plan() -> Plan:
    return plan_job(job_from_text(JOB))


def table(names: list[str], columns: list[np.ndarray]) -> Table:
    return Table(tuple(names), np.stack(columns, axis=1), np.full(len(names), 9), "rows.csv")


def drawn(names: list[str], columns: list[np.ndarray], **options: object) -> DrawnTable:
    parsed = tuple(map(parse_column, names))
    return DrawnTable(table(names, columns), parsed, DISPLAY, **options)  # type: ignore[arg-type]


def states(plan: Plan) -> tuple[np.ndarray, np.ndarray]:
    curve = plan.trajectory.curve
    return curve.evaluate(T - 5), curve.evaluate(T - 5, 1)


def rows_of(plan: Plan, **options: object) -> DrawnTable:
    """Return rows of the job: turn in rad, bend in degrees, lift in m and its rate in mm/s."""
    q, qd = states(plan)
    columns = [T, q[:, 0], np.degrees(q[:, 1]), q[:, 2], qd[:, 0], np.degrees(qd[:, 1]), 1000 * qd[:, 2]]
    return drawn(["t", "q1", "q2_deg", "q3", "qd1", "qd2_deg", "qd3_mm"], columns, **options)


def reach(plan: Plan) -> np.ndarray:
    """Return the length of the last link of each row: the tool is on the flange from the change on."""
    return np.where(5 + plan.trajectory.spans[1].start - 1e-9 > T, 0.2, 0.25)


def test_joints_are_brought_to_the_units_of_the_picture_whatever_the_file_has(plan: Plan) -> None:
    q, qd = states(plan)
    rows = rows_of(plan)
    assert rows.times.tolist() == T.tolist()
    for joint, scale in enumerate((180 / np.pi, 180 / np.pi, 1000)):
        assert rows.joint("q", joint) == pytest.approx(q[:, joint] * scale)
        assert rows.joint("qd", joint) == pytest.approx(qd[:, joint] * scale)
    assert rows.joint("qdd", 0) is None
    efforts = drawn(["t", "tau1"], [T, 3 * T])
    assert efforts.joint("tau", 0) == pytest.approx(3 * T)


def test_the_tool_is_that_of_the_job_at_the_time_of_the_row(plan: Plan) -> None:
    robot = plan.loaded.robot
    rows = rows_of(plan, robot=robot, trajectory=plan.trajectory)
    (q, qd), last = states(plan), reach(plan)
    both = q[:, 0] + q[:, 1]
    x = 0.3 * np.cos(q[:, 0]) + last * np.cos(both)
    y = 0.3 * np.sin(q[:, 0]) + last * np.sin(both)
    assert rows.tool_positions() == pytest.approx(1000 * np.stack([x, y, -q[:, 2]], axis=1))
    turning = qd[:, 0] + qd[:, 1]
    vx = -0.3 * np.sin(q[:, 0]) * qd[:, 0] - last * np.sin(both) * turning
    vy = 0.3 * np.cos(q[:, 0]) * qd[:, 0] + last * np.cos(both) * turning
    speeds = rows.tool_speeds()
    assert speeds is not None
    assert speeds[0] == pytest.approx(1000 * np.sqrt(vx**2 + vy**2 + qd[:, 2] ** 2))
    assert speeds[1] == pytest.approx(np.degrees(np.abs(turning)))
    alone = rows_of(plan, robot=robot).tool_positions()
    assert alone is not None
    assert np.abs(alone[:20] - 1000 * np.stack([x, y, -q[:, 2]], axis=1)[:20]).max() < 1e-9
    assert rows_of(plan).tool_positions() is None
    assert rows_of(plan).tool_speeds() is None
    without = drawn(["t", "q1", "q3"], [T, q[:, 0], q[:, 2]], robot=robot)
    assert without.tool_positions() is None
    assert without.shows() == {"q"}
    assert rows_of(plan, robot=robot).shows() == {"q", "qd", "tool", "path"}


def test_what_the_file_says_of_the_tool_comes_first_and_from_its_frame(plan: Plan) -> None:
    frame = np.eye(4)
    frame[:3, :3], frame[:3, 3] = Rotation.from_euler("xyz", [0.3, 0.4, 0.5]).as_matrix(), [1, 2, 3]
    places = np.stack([np.sin(T), np.cos(T), T], axis=1)
    q, _ = states(plan)
    names = ["t", "q1", "q2", "q3", "x_mm", "y", "z", "vx", "vy", "vz", "wx_deg", "wy_deg", "wz_deg"]
    turning = [3 + 0 * T, 4 + 0 * T, 12 + 0 * T]
    columns = [
        T,
        *q.T,
        1000 * places[:, 0],
        places[:, 1],
        places[:, 2],
        0.3 + 0 * T,
        0.4 + 0 * T,
        0 * T,
        *turning,
    ]
    options = {"robot": plan.loaded.robot, "trajectory": plan.trajectory}
    world = drawn(names, columns, **options)
    assert world.tool_positions() == pytest.approx(1000 * places)
    turned = drawn(names, columns, frame=frame, **options).tool_positions()
    assert turned == pytest.approx(1000 * (places @ frame[:3, :3].T + frame[:3, 3]))
    speeds = world.tool_speeds()
    assert speeds is not None
    assert speeds[0] == pytest.approx(np.full(T.size, 500))
    assert speeds[1] == pytest.approx(np.full(T.size, 13))


def test_errors_are_marked_where_they_are_at_the_value_of_their_kind(plan: Plan) -> None:
    found = (
        Finding("velocity", joint="bend", value=0.7, limit=0.5, time=5.4),
        Finding("position", joint="lift", value=-0.02, limit=0.0, time=5.5),
        Finding("start", joint="turn", value=0.1, time=5.0, quantity="position"),
        Finding("continuity", joint="turn", value=9.0, time=5.61, quantity="velocity"),
        Finding("tool_speed", value=0.9, limit=0.5, time=5.7),
        Finding("tool_angular_speed", value=2.0, limit=1.0, time=5.8),
        Finding("velocity", joint="turn", value=0.7, limit=0.5, time=5.9, severity="warning"),
        Finding("time"),
    )
    rows = rows_of(plan, judgement=Judgement(found, "linear", 41))
    times = [5.4, 5.5, 5.0, 5.61, 5.7, 5.8]

    def marked(values: np.ndarray) -> dict[float, float]:
        assert values[:, 0].tolist() == times
        return {time: value for time, value in values.tolist() if np.isfinite(value)}

    assert marked(rows.joint_findings("qd", 1)) == {5.4: pytest.approx(np.degrees(0.7))}
    assert marked(rows.joint_findings("q", 1)) == {}
    assert marked(rows.joint_findings("q", 2)) == {5.5: pytest.approx(-20)}
    assert marked(rows.joint_findings("q", 0)) == {5.0: pytest.approx(np.degrees(0.1))}
    speeds = rows.joint("qd", 0)
    assert speeds is not None
    between = speeds[12] + (speeds[13] - speeds[12]) * 0.2  # of a jump on the line of the file
    assert marked(rows.joint_findings("qd", 0)) == {5.61: pytest.approx(between)}
    assert marked(rows.tool_findings(angular=False)) == {5.7: pytest.approx(900)}
    assert marked(rows.tool_findings(angular=True)) == {5.8: pytest.approx(np.degrees(2))}
    assert rows_of(plan).joint_findings("q", 0).shape == (0, 2)


@pytest.mark.parametrize(
    ("quantity", "labels"),
    [
        ("q", ["q [deg]", "q [mm]", "q [rad or m]"]),
        ("qd", ["q̇ [deg/s]", "q̇ [mm/s]", "q̇ [rad/s or m/s]"]),
        ("qdd", ["q̈ [deg/s²]", "q̈ [mm/s²]", "q̈ [rad/s² or m/s²]"]),
        ("tau", ["τ [N m]", "τ [N]", "τ [N m or N]"]),
    ],
)
def test_axes_have_the_units_of_their_joints(quantity: str, labels: list[str]) -> None:
    units = DisplayUnits(("a", "b", "c"), ("revolute", "prismatic", None), Units("deg", "mm"))
    assert [units.joint_label(quantity, joint) for joint in range(3)] == labels
    assert [units.joint_factor(joint) for joint in range(3)] == pytest.approx([np.pi / 180, 1e-3, 1])
    assert [units.label("s", "length", order) for order in range(3)] == ["s [mm]", "s [mm/s]", "s [mm/s²]"]
    assert [units.label("u", "ratio", order) for order in range(3)] == ["u [-]", "u [1/s]", "u [1/s²]"]


def named(*names: str, file: str = "a.csv") -> list[tuple[str, object]]:
    return [(file, parse_column(name)) for name in names]


def test_units_of_files_are_those_of_their_names() -> None:
    files = [*named("t", "q1_deg", "q4", "qd2_mm"), *named("q1", "qd1_deg", "q2_mm", file="b.csv")]
    units = units_of_files(files)  # type: ignore[arg-type]
    assert units.joint_names == ("j1", "j2", "j3", "j4")
    assert units.joint_types == ("revolute", "prismatic", None, None)
    assert units.units == Units("deg", "mm")
    assert units_of_files(named("q1", "q2")).units == Units("rad", "m")  # type: ignore[arg-type]
    with pytest.raises(InputError, match=r"joint 2 is in mm in a\.csv, in deg in b\.csv"):
        units_of_files([*named("q2_mm"), *named("q2_deg", file="b.csv")])  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("column", "message"),
    [
        ("q4", "has a column q4, and the robot of the job 3 joints"),
        ("q3_deg", "and lift is a prismatic joint"),
        ("q3_mm", None),
        ("t", None),
    ],
)
def test_a_file_over_a_job_has_its_joints(column: str, message: str | None) -> None:
    columns = [parse_column("q1_deg"), parse_column(column)]
    if message is None:
        require_joints("a.csv", columns, DISPLAY)
        return
    with pytest.raises(InputError, match=message):
        require_joints("a.csv", columns, DISPLAY)
