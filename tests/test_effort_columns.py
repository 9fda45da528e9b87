"""Columns of efforts against the closed form of a planar arm, in all formats that hold them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from streams.mcap.conftest import read_mcap

from trajcli.columns import columns_of, parse_column
from trajcli.curves.piecewise import Array
from trajcli.editing.edited_motion import ReadingOptions, read_motion
from trajcli.editing.writing import write_motion
from trajcli.errors import InputError
from trajcli.grids import UniformGrid
from trajcli.job.read import job_from_text
from trajcli.output.delivery.joined import write_plan
from trajcli.planning.plan import Plan, plan_job
from trajcli.samples import sample
from trajcli.streams.reading import read_table
from trajcli.units import Quantity, Units

L1, L2, M1, M2, C1, C2, I1, I2 = 0.5, 0.4, 4.0, 2.0, 0.2, 0.15, 0.1, 0.05
COULOMB, VISCOUS, ROTOR, G = 1.5, 0.7, 0.03, 9.81
CARRIED, OUT = 1.2, 0.06
JOB = f"""
version: 1
units: {{angle: deg, length: mm}}
robot:
  convention: standard
  joints:
    - {{a: {1e3 * L1}, velocity: 90, acceleration: 300, friction: {{coulomb: {COULOMB}}},
       link: {{mass: {M1}, com: [{1e3 * (C1 - L1)}, 0, 0], inertia: [0.01, 0.1, {I1}, 0, 0, 0]}}}}
    - {{a: {1e3 * L2}, velocity: 90, acceleration: 300, friction: {{viscous: {VISCOUS}}}, rotor: {ROTOR},
       link: {{mass: {M2}, com: [{1e3 * (C2 - L2)}, 0, 0], inertia: [0.01, 0.05, {I2}, 0, 0, 0]}}}}
gravity: [0, -{G}, 0]
start: {{joints: [10, 20]}}
moves:
  - {{planner: quintic, to: {{joints: [90, 20]}}}}
  - {{attach: {{mass: {CARRIED}, com: [{1e3 * OUT}, 0, 0]}}}}
  - {{planner: quintic, to: {{joints: [0, 90]}}}}
  - {{detach: {{}}}}
  - {{planner: quintic, to: {{joints: [0, -90]}}}}
output: {{rate: 50, columns: [t, q, qd, qdd, tau, move]}}
"""


def lagrange(q: Array, qd: Array, qdd: Array, carried: Array) -> Array:
    """Return the efforts (N, 2) from the equations of motion of Lagrange, the payload a point of link 2.

    Source: Siciliano et al., Robotics: Modelling, Planning and Control (2009), section 7.3.2.
    """
    mass = M2 + carried
    first = (M2 * C2 + carried * (L2 + OUT)) / mass  # centre of mass of link 2 and payload
    inertia = I2 + M2 * (C2 - first) ** 2 + carried * (L2 + OUT - first) ** 2
    cosine, sine = np.cos(q[:, 1]), np.sin(q[:, 1])
    m12 = inertia + mass * (first**2 + L1 * first * cosine)
    m11 = I1 + M1 * C1**2 + m12 + mass * (L1**2 + L1 * first * cosine)
    m22 = inertia + mass * first**2 + ROTOR
    h = -mass * L1 * first * sine
    g2 = mass * first * G * np.cos(q.sum(axis=1))
    g1 = (M1 * C1 + mass * L1) * G * np.cos(q[:, 0]) + g2
    tau1 = m11 * qdd[:, 0] + m12 * qdd[:, 1] + h * (2 * qd[:, 0] * qd[:, 1] + qd[:, 1] ** 2) + g1
    tau2 = m12 * qdd[:, 0] + m22 * qdd[:, 1] - h * qd[:, 0] ** 2 + g2
    return np.stack([tau1 + COULOMB * np.sign(qd[:, 0]), tau2 + VISCOUS * qd[:, 1]], axis=1)


@pytest.fixture(scope="module")
def plan() -> Plan:
    plan = plan_job(job_from_text(JOB))
    assert plan.verdict.passed
    return plan


def rows_of(plan: Plan, units: Units | None = None) -> Array:
    """Return t, q, qd, qdd, tau and move of the plan."""
    grid, robot = UniformGrid(plan.trajectory.duration, 50.0, 0.0), plan.loaded.robot
    groups = plan.loaded.job.output.columns
    return np.concatenate(list(sample(plan.trajectory, grid, groups, units, robot=robot, size=17)))


def test_efforts_are_those_of_lagrange_with_what_each_move_carries(plan: Plan) -> None:
    rows = rows_of(plan)
    q, qd, qdd, tau, move = rows[:, 1:3], rows[:, 3:5], rows[:, 5:7], rows[:, 7:9], rows[:, 9]
    carried = np.where(move == 2, CARRIED, 0.0)
    assert {*move.tolist()} == {0, 2, 4}
    expected = lagrange(q, qd, qdd, carried)
    assert tau == pytest.approx(expected, rel=1e-12, abs=1e-12)
    without = lagrange(q, qd, qdd, np.zeros_like(carried))
    assert (np.abs(tau - without).max(axis=1)[move == 2] > 0.1).all()  # the payload is felt at every row


def test_at_a_border_the_later_move_says_what_is_carried(plan: Plan) -> None:
    border = plan.trajectory.spans[2].start
    grid = UniformGrid(plan.trajectory.duration, 1 / border, 0.0)
    row = np.concatenate(list(sample(plan.trajectory, grid, ("t", "tau"), robot=plan.loaded.robot)))[1]
    assert row[0] == pytest.approx(border)
    q = np.radians([[90.0, 20.0]])
    with_payload = lagrange(q, 0 * q, 0 * q, np.array([CARRIED]))
    assert row[1:] == pytest.approx(with_payload[0], rel=1e-9)


def test_at_the_end_what_was_carried_there_is_said_whatever_is_put_down_then() -> None:
    text = JOB[: JOB.index("  - {detach")] + "  - {detach: {}}\n" + JOB[JOB.index("output") :]
    row = rows_of(plan_job(job_from_text(text)))[-1]
    still = np.zeros((1, 2))
    with_payload = lagrange(row[None, 1:3], still, row[None, 5:7], np.array([CARRIED]))
    assert row[9] == 2
    assert row[7:9] == pytest.approx(with_payload[0], rel=1e-9, abs=1e-9)


def test_efforts_are_in_newton_metres_in_any_units(plan: Plan) -> None:
    degrees = rows_of(plan, Units("deg", "mm"))
    assert degrees[:, 7:9] == pytest.approx(rows_of(plan)[:, 7:9], rel=1e-12)
    columns = columns_of(("tau",), ("revolute", "prismatic"), Units("deg", "mm"))
    assert [column.name for column in columns] == ["tau1", "tau2"]
    assert [column.quantity for column in columns] == [Quantity("torque"), Quantity("force")]
    assert parse_column("tau2").joint == 1
    assert parse_column("tau2_deg").joint is None  # no such column


def test_every_format_that_has_efforts_holds_them(plan: Plan, tmp_path: Path) -> None:
    tau = rows_of(plan)[:, 7:9]
    write_plan(plan, str(tmp_path / "plan.csv"), "full")
    table = read_table(str(tmp_path / "plan.csv"))
    written = table.columns[:, [table.names.index(f"tau{k}") for k in (1, 2)]]
    assert written == pytest.approx(tau, rel=1e-12, abs=1e-12)  # of rows in degrees
    write_plan(plan, str(tmp_path / "plan.jsonl"))
    lines = [json.loads(line) for line in (tmp_path / "plan.jsonl").read_text().splitlines()]
    assert [line["tau"] for line in lines] == tau.tolist()
    write_plan(plan, str(tmp_path / "plan.mcap"))
    assert np.array_equal(read_mcap(tmp_path / "plan.mcap").effort, tau)


@pytest.mark.parametrize("ending", ["jsonl", "npz", "mcap"])
def test_every_format_that_has_efforts_is_converted_with_them(
    ending: str, plan: Plan, tmp_path: Path
) -> None:
    write_plan(plan, str(tmp_path / "plan.jsonl"))
    motion = read_motion(str(tmp_path / "plan.jsonl"), ReadingOptions())
    without_moves = "the column move is left out: the format is written without it"
    lost = write_motion(motion, str(tmp_path / f"other.{ending}"))
    assert lost == ((without_moves,) if ending == "mcap" else ())
    found = read_motion(str(tmp_path / f"other.{ending}"), ReadingOptions()).rows.tau
    assert np.array_equal(np.asarray(found), rows_of(plan)[:, 7:9])
    lost = write_motion(motion, str(tmp_path / "goal.yaml"))
    assert {*lost} == {"the columns tau are left out: the format is written without them", without_moves}


def test_a_log_has_efforts_only_where_they_are_asked_for(tmp_path: Path) -> None:
    plan = plan_job(job_from_text(JOB.replace("tau, ", "")))
    write_plan(plan, str(tmp_path / "plan.mcap"))
    assert read_mcap(tmp_path / "plan.mcap").effort.shape[1] == 0


def test_efforts_need_inertias() -> None:
    bare = (
        JOB.replace("link:", "# link:")
        .replace(", rotor", "}\n    # rotor")
        .replace("coulomb: 1.5},", "coulomb: 1.5}}\n    #")
    )
    with pytest.raises(InputError, match="the columns 'tau' need mass and inertia of all links") as refused:
        job_from_text(bare)
    assert refused.value.exit_code == 2
