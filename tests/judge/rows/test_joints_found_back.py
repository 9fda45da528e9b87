"""Joints that rows of the tool are found back to: those of the plan's curve, which made these rows, and their rates."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from planned_examples import planned_with_output
from two_moves import TWO_MOVES

from trajcli.columns import parse_column
from trajcli.errors import InputError, PlanningError
from trajcli.judge.rows import tool_rows
from trajcli.judge.rows.tool_rows import ArmsOfMoves, joints_found_back
from trajcli.kinematics.robot import Joint, Robot, unlimited
from trajcli.output.delivery.joined import write_plan
from trajcli.planning.plan import Plan
from trajcli.streams.byte_source import ByteSource
from trajcli.streams.recorded.column_roles import NamedFile
from trajcli.streams.row_sources import ArrayRows, unplaced

TOOLS = """
version: 1
units: {angle: deg}
robot: ur5e
limits: {acceleration: 800, tcp: {angular_speed: 200, speed: 0.3}}
tools: {long: {xyz: [0, 0, 0.15]}, bent: {xyz: [0.06, -0.02, 0.22], rpy: [10, 30, -20]}}
tool: long
start: {joints: [0, -90, 90, 0, 90, 0]}
moves:
  - {planner: line, to: {from: here, offset: {xyz: [0, 0, 0.05]}}, law: {shape: quintic, duration: 1}}
  - {tool: bent}
  - {planner: quintic, to: {joints: [5, -85, 85, 0, 85, 5]}, duration: 1}
"""


TURNS = """
version: 1
units: {angle: deg}
robot: ur5e
limits: {acceleration: 800, tcp: {angular_speed: 200, speed: 0.3}}
start: {joints: [0, -90, 90, 0, 90, 0]}
moves:
  - {planner: line, to: {from: here, offset: {xyz: [0, 0, 0.05]}}, law: {shape: quintic, duration: 1}}
  - {planner: line, to: {from: here, offset: {rpy: [0, 0, 20]}}, law: {shape: quintic, duration: 1}}
"""


ONE_LINE = TURNS.rsplit("  - ", 1)[0]
BOTH_ALONG_LINES = TOOLS.rsplit("  - ", 1)[0] + (
    "  - {planner: line, to: {from: here, offset: {xyz: [0, 0.05, 0]}}, law: {shape: quintic, duration: 1}}\n"
)
CUT = """
version: 1
units: {angle: deg}
robot: ur5e
limits: {acceleration: 800, tcp: {speed: 1}}
start: {joints: [0, -90, 90, 0, 90, 0]}
moves:
  - planner: path
    segments:
      - {line: {from: here, offset: {xyz: [0, 0, 0.05]}}}
      - {line: {from: here, offset: {xyz: [0, 0.05, 0.05]}}}
    corner: overlap
    overlap: 0.2
    law: {shape: quintic, duration: 1}
"""


def planned(job: str, columns: str, rate: int = 50) -> Plan:
    return planned_with_output(job, f"{{rate: {rate}, columns: {columns}}}")


def found(plan: Plan, folder: Path, stretch: float = 1.0) -> tuple[np.ndarray, list[np.ndarray]]:
    """Return times in the plan (N,), and the joints' states, of rows in `stretch` times the time of the plan."""
    file = folder / "rows.csv"
    write_plan(plan, str(file), "full")
    head, *lines = file.read_text().splitlines()
    names, rows = head.split(","), np.array([[float(cell) for cell in line.split(",")] for line in lines])
    t = rows[:, 0].copy()
    for k, name in enumerate(names):
        kind = name.split("_")[0]
        order = 2 if kind in ("ax", "ay", "az", "ex", "ey", "ez", "sdd") else 1
        order = order if kind not in ("x", "y", "z", "qw", "qx", "qy", "qz", "s", "t", "move") else 0
        rows[:, k] *= stretch if name == "t" else stretch**-order
    text = (",".join(map(repr, row)) for row in rows.tolist())
    file.write_text("\n".join([head, *text]) + "\n")
    back = joints_found_back(ByteSource(str(file)), plan.loaded.robot_of_rows, plan)
    assert back is not None
    (block,) = back.blocks(range(len(back.named.names)), ())
    joints = len(plan.loaded.robot.joints)
    count = sum(name.startswith("q") for name in back.named.names) // joints
    return t, [block[:, 1 + k * joints : 1 + (k + 1) * joints] for k in range(count)]


EXACT = (2e-6, 2e-5, 2e-4)
"""rad, rad/s, rad/s^2: what poses within a micrometre leave of joints and of their rates."""


@pytest.mark.parametrize("stretch", [1.0, 1.5, 0.8])
@pytest.mark.parametrize(
    ("job", "columns", "known"),
    [
        (TWO_MOVES, "[t, pose]", 1),
        (TWO_MOVES, "[t, pose, twist]", 2),
        (TWO_MOVES, "[t, pose, twist, twistd]", 3),
        (TWO_MOVES, "[t, path, move]", 3),
        (TOOLS, "[t, pose, twist, twistd, move]", 3),
        (TOOLS, "[t, path, move]", 3),
        (ONE_LINE, "[t, path]", 3),
        (BOTH_ALONG_LINES, "[t, path, move]", 3),
    ],
)
def test_joints_and_their_rates_are_those_of_the_curve(job, columns, known, stretch, tmp_path) -> None:
    """Distances alone say nothing of a move without a path, of which other rows than the plan's are known nearly."""
    plan = planned(job, columns, 20)
    t, states = found(plan, tmp_path, stretch)
    assert len(states) == known
    on_path = t >= (0.0 if stretch == 1.0 or "pose" in columns else plan.trajectory.spans[-1].start)
    for order, (values, exact) in enumerate(zip(states, EXACT, strict=False)):
        wanted = (
            plan.trajectory.curve.evaluate(np.minimum(t, plan.trajectory.duration), order) / stretch**order
        )
        np.testing.assert_allclose(values[on_path], wanted[on_path], rtol=0, atol=exact)


@pytest.mark.parametrize(
    ("columns", "exact"), [("[t, twist]", (3e-4, 3e-3)), ("[t, twist, twistd]", (2e-5, 2e-4, 2e-3))]
)
def test_velocities_of_the_tool_are_integrated(
    columns: str, exact: tuple[float, ...], tmp_path: Path
) -> None:
    """Rows 20 ms apart: of linear velocities between them h^2 / 12 of their bend is left, of cubic ones far less."""
    plan = planned(TWO_MOVES, columns)
    t, states = found(plan, tmp_path)
    curve, times = plan.trajectory.curve, np.minimum(t, plan.trajectory.duration)
    for order, (values, near) in enumerate(zip(states, exact, strict=True)):
        np.testing.assert_allclose(values, curve.evaluate(times, order), rtol=0, atol=near)


IN_THE_PLANE = """
version: 1
robot: planar2r
limits: {velocity: 3, acceleration: 8, jerk: 60}
start: {joints: [0.3, 1.2]}
moves: [{planner: quintic, to: {joints: [0.9, 0.8]}}]
"""


@pytest.mark.parametrize("sign", [1, -1])
def test_a_pose_that_the_arm_misses_by_more_than_rounding_is_refused(sign: int, tmp_path: Path) -> None:
    """No joint of an arm in the plane raises the tool: a tenth of a micrometre is let go, ten are not."""
    plan, file = planned(IN_THE_PLANE, "[t, pose]"), tmp_path / "rows.csv"
    write_plan(plan, str(file), "full")
    head, *lines = file.read_text().splitlines()
    for off, refused in ((1e-7, False), (1e-5, True)):
        cells = lines[3].split(",")
        cells[head.split(",").index("z")] = repr(sign * off)
        file.write_text("\n".join([head, *lines[:3], ",".join(cells), *lines[4:]]) + "\n")
        source = ByteSource(str(file))
        if refused:
            with pytest.raises(PlanningError, match="cannot reach the pose"):
                joints_found_back(source, plan.loaded.robot_of_rows, plan)
        else:
            assert joints_found_back(source, plan.loaded.robot_of_rows, plan) is not None


@pytest.mark.parametrize("begins", [0.0, 7.5, -7.5])
@pytest.mark.parametrize("columns", ["[t, path]", "[t, path, move]"])
@pytest.mark.parametrize("job", [TWO_MOVES, TOOLS, TURNS, CUT], ids=["line", "tools", "turn", "cut"])
def test_the_clock_of_rows_may_begin_whenever(job: str, columns: str, begins: float, tmp_path: Path) -> None:
    """The joints of a move without a path are those of the plan as long after the first row."""
    plan = planned(job, columns)
    write_plan(plan, str(tmp_path / "rows.csv"), "full")
    head, *lines = (tmp_path / "rows.csv").read_text().splitlines()
    rows = np.array([[float(cell) for cell in line.split(",")] for line in lines])
    t = np.minimum(rows[:, 0], plan.trajectory.duration)
    rows[:, 0] += begins
    back = found_back(tmp_path, plan, head.split(","), rows)
    assert back is not None
    for order, exact in enumerate(EXACT):
        (block,) = back.blocks(range(1 + 6 * order, 7 + 6 * order), ())
        np.testing.assert_allclose(block, plan.trajectory.curve.evaluate(t, order), rtol=0, atol=exact)


def rows_of_tools(folder: Path) -> tuple[Plan, list[str], np.ndarray]:
    """Return names and numbers of poses of two tools."""
    plan = planned(TOOLS, "[t, pose, move]")
    write_plan(plan, str(folder / "rows.csv"), "full")
    head, *lines = (folder / "rows.csv").read_text().splitlines()
    return plan, head.split(","), np.array([[float(cell) for cell in line.split(",")] for line in lines])


def found_back(folder: Path, plan: Plan, names: list[str], rows: np.ndarray) -> ArrayRows | None:
    text = (",".join(map(repr, row)) for row in rows.tolist())
    (folder / "rows.csv").write_text("\n".join([",".join(names), *text]) + "\n")
    return joints_found_back(ByteSource(str(folder / "rows.csv")), plan.loaded.robot_of_rows, plan)


@pytest.mark.parametrize("length", [0.998, 1.002])
def test_quaternions_of_several_tools_are_taken_by_their_direction(length: float, tmp_path: Path) -> None:
    """Few decimals make them a little shorter or longer than 1."""
    plan, names, rows = rows_of_tools(tmp_path)
    rows[:, [names.index(name) for name in ("qw", "qx", "qy", "qz")]] *= length
    back = found_back(tmp_path, plan, names, rows)
    assert back is not None
    (block,) = back.blocks(range(1, 7), ())
    wanted = plan.trajectory.curve.evaluate(np.minimum(rows[:, 0], plan.trajectory.duration))
    np.testing.assert_allclose(block, wanted, rtol=0, atol=2e-6)


def test_positions_of_several_tools_say_nothing_without_their_turns(tmp_path: Path) -> None:
    plan, names, rows = rows_of_tools(tmp_path)
    kept = [k for k, name in enumerate(names) if name not in ("qw", "qx", "qy", "qz")]
    with pytest.raises(InputError, match="positions of several tools, and no orientation"):
        found_back(tmp_path, plan, [names[k] for k in kept], rows[:, kept])


def test_a_wrong_stamp_takes_no_row_out_of_its_move() -> None:
    """Of two moves in twice their time one row each has a stamp far behind: it is at the end of its move at most."""
    spans = [SimpleNamespace(index=k, start=1.0 * k, end=k + 1.0, duration=1.0) for k in range(2)]
    plan = SimpleNamespace(trajectory=SimpleNamespace(duration=2.0, spans=spans))
    since, owner = 0.2 * np.arange(21), np.repeat([0, 1], [10, 11])
    at, faster = tool_rows._in_plan(since, owner, plan)  # type: ignore[arg-type]
    np.testing.assert_allclose(at, since / 2, atol=1e-12)
    np.testing.assert_allclose(faster, 0.5, atol=1e-12)
    since[[4, 15]] += 30.0
    wrong, _ = tool_rows._in_plan(since, owner, plan)  # type: ignore[arg-type]
    np.testing.assert_allclose(wrong[[4, 15]], [1.0, 2.0], atol=1e-12)
    np.testing.assert_allclose(np.delete(wrong, [4, 15]), np.delete(at, [4, 15]), atol=1e-12)


@pytest.mark.parametrize("still", [0, 1, 2])
def test_a_move_that_takes_no_time_has_no_rows(still: int) -> None:
    """Of three moves one stands still; rows of the others are theirs by their numbers, at a break those of the later one."""
    lengths = [0.0 if k == still else 1.0 for k in range(3)]
    starts = np.cumsum([0.0, *lengths[:-1]])
    spans = [SimpleNamespace(index=k, start=starts[k], duration=lengths[k]) for k in range(3)]
    plan = SimpleNamespace(trajectory=SimpleNamespace(duration=2.0, spans=spans))
    values = np.linspace(3.0, 5.0, 5)[:, None]
    rows = ArrayRows("csv", NamedFile("rows.csv", ("t",), unplaced), values, np.full(1, 9), np.zeros(1))
    of_tool = tool_rows._ToolRows(rows, (parse_column("t"),), values)
    first, second = (k for k in range(3) if k != still)
    assert tool_rows._moves_of(of_tool, plan).tolist() == [first] * 2 + [second] * 3  # type: ignore[arg-type]


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("duration", [1.0, 20.0, 400.0])
@pytest.mark.parametrize("decimals", [6, 8])
def test_what_rounding_of_velocities_adds_up_to_is_within_the_decimals_of_joints(
    decimals: int, duration: float, sign: int
) -> None:
    """A slide goes steadily, by nearly half a unit of the last decimal faster than it is written."""
    slide = Joint("turn", "revolute", a=0.5), Joint("slide", "prismatic")
    arm = Robot("slide", slide, unlimited(2), "standard", np.eye(4), np.eye(4))
    true = 0.1 + sign * 0.49 * 10.0**-decimals
    names = ("t", "vx", "vy", "vz", "wx", "wy", "wz")
    values = np.zeros((11, 7))
    values[:, 0], values[:, 3] = np.linspace(0.0, duration, 11), np.round(true, decimals)
    written = np.full(7, decimals)
    named = NamedFile("rows.csv", names, unplaced)
    rows = ArrayRows("csv", named, values, written, np.zeros(7), si=True)
    of_tool = tool_rows._ToolRows(rows, tuple(map(parse_column, names)), values)
    found = tool_rows._of_twists(of_tool, ArmsOfMoves(arm, []), None, np.zeros(2))
    off = np.abs(found.states[0][:, 1] - true * values[:, 0]).max()
    assert off == pytest.approx(0.49 * 10.0**-decimals * duration, rel=1e-2)
    assert off <= 0.5 * 10.0 ** -found.decimals[0] <= 2e4 * off
