"""Joints that rows of the tool are found back to: those of the plan's curve, which made these rows, and their rates."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from planned_examples import planned_with_output
from two_moves import TWO_MOVES

from trajcli.errors import PlanningError
from trajcli.judge.rows.tool_rows import joints_found_back
from trajcli.output.write import write_plan
from trajcli.planning.plan import Plan
from trajcli.streams.byte_source import ByteSource

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


def planned(job: str, columns: str) -> Plan:
    return planned_with_output(job, f"{{rate: 50, columns: {columns}}}")


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


@pytest.mark.parametrize("stretch", [1.0, 1.5])
@pytest.mark.parametrize(
    ("job", "columns", "known"),
    [
        (TWO_MOVES, "[t, pose]", 1),
        (TWO_MOVES, "[t, pose, twist]", 2),
        (TWO_MOVES, "[t, pose, twist, twistd]", 3),
        (TWO_MOVES, "[t, path, move]", 3),
        (TOOLS, "[t, pose, twist, twistd, move]", 3),
        (TOOLS, "[t, path, move]", 3),
    ],
)
def test_joints_and_their_rates_are_those_of_the_curve(job, columns, known, stretch, tmp_path) -> None:
    """Distances alone say nothing of a move without a path, of which other rows than the plan's are known nearly."""
    plan = planned(job, columns)
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
