"""Rows that a formula makes of the law of a move: known as those of the plan, and refused beside it."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import random_jobs
from numpy.typing import NDArray
from planned_examples import planned_with_output
from tiers import few
from two_moves import TWO_MOVES

from trajcli.columns import GROUPS, columns_of
from trajcli.judge.file import CheckOptions, check_file
from trajcli.judge.rows import planned_rows
from trajcli.judge.rows.planned_rows import RowComparison, compare_with_plan
from trajcli.output.delivery.joined import write_plan
from trajcli.planning.plan import Plan, plan_job
from trajcli.streams import npy
from trajcli.streams.byte_source import ByteSource
from trajcli.units import Units

START, END = np.array([0.1, 0.25, -0.4]), np.array([1.3, 0.25, 0.9])
DURATION = 1.25
NAMES = ["t", *(f"{kind}{joint}" for kind in ("q", "qd", "qdd") for joint in (1, 2, 3))]
Rows = NDArray[np.float64]


@pytest.fixture(scope="module")
def plan() -> Plan:
    """Return the plan of one quintic, of which the second joint stands."""
    fields = {"version": 1, "robot": {"joints": 3}, "start": {"joints": START.tolist()}}
    fields |= {"limits": {"velocity": 9, "acceleration": 90, "jerk": None}, "output": {"rate": 10}}
    move = {"planner": "quintic", "to": {"joints": END.tolist()}, "duration": DURATION}
    return plan_job(random_jobs.loaded(fields | {"moves": [move]}))


def states(t: Rows) -> Rows:
    """Return positions, velocities and accelerations (N, 9) of the minimum-jerk law at some times."""
    u = np.clip(t / DURATION, 0.0, 1.0)[:, None]
    laws = (
        10 * u**3 - 15 * u**4 + 6 * u**5,
        (30 * u**2 - 60 * u**3 + 30 * u**4) / DURATION,
        (60 * u - 180 * u**2 + 120 * u**3) / DURATION**2,
    )
    moved = [law * (END - START) for law in laws]
    return np.hstack([START + moved[0], *moved[1:]])


def rows_at(rate: float = 10.0, late: float = 0.0) -> Rows:
    """Return all rows of a rate, and one at the end, of times that are late by some seconds."""
    t = np.append(np.arange(int(DURATION * rate * (1 + 1e-12)) + 1) / rate, DURATION)
    t = t[:-1] if t[-2] >= DURATION - 1e-9 else t
    return np.hstack([t[:, None], states(t + late)])


def compared(
    folder: Path, plan: Plan, rows: Rows, digits: str = ".9f", names: list[str] = NAMES
) -> RowComparison:
    """Return what a comparison says of rows as CSV, values by a format, stamps to the nanosecond."""
    lines = (
        ",".join(
            [
                format(row[0], ".17g" if digits == ".17g" else ".9f"),
                *(format(value, digits) for value in row[1:]),
            ]
        )
        for row in rows.tolist()
    )
    file = folder / "rows.csv"
    file.write_text("\n".join([",".join(names), *lines]) + "\n", encoding="utf-8")
    return compare_with_plan(ByteSource(str(file)), plan)


@pytest.mark.parametrize("digits", [".3f", ".6f", ".9f", ".17g"])
@pytest.mark.parametrize("rate", [10.0, 16.0, 1 / 0.15, 0.5])
def test_rows_of_the_law_are_known(rate: float, digits: str, plan: Plan, tmp_path: Path) -> None:
    assert compared(tmp_path, plan, rows_at(rate), digits).planned
    shifted = rows_at(rate)
    shifted[:, 0] += 7.5
    assert compared(tmp_path, plan, shifted, digits).planned


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("column", range(1, 10))
def test_one_number_of_one_row_is_off_by_a_unit_of_its_last_decimal(column, sign, plan, tmp_path) -> None:
    """Any row, the first and the last among them: the number is then more than half a unit beside the law."""
    for row in (0 if sign > 0 else -1, 1 + column):
        rows = np.round(rows_at(), 6)
        rows[row, column] += sign * 1e-6
        found = compared(tmp_path, plan, rows, ".6f")
        assert not found.planned
        assert f"row {row % len(rows) + 1} has {NAMES[column]}" in found.difference


@pytest.mark.parametrize("sign", [1, -1])
def test_the_column_that_is_wrong_is_named_with_its_numbers_beside_a_coarse_one(sign, plan, tmp_path) -> None:
    """Degrees of one decimal are off by more than the third joint, and as far as they may be."""
    rows = np.hstack([rows_at()[:, :1], np.degrees(rows_at()[:, 1:4])])
    true = float(rows[5, 3])
    rows[5, 3] += sign * 1e-3
    lines = [f"{t:.9f},{first:.1f},{second:.9f},{third:.9f}" for t, first, second, third in rows.tolist()]
    file = tmp_path / "rows.csv"
    file.write_text("\n".join(["t,q1_deg,q2_deg,q3_deg", *lines]) + "\n", encoding="utf-8")
    found = compare_with_plan(ByteSource(str(file)), plan)
    said = re.fullmatch(
        r".*row 6 has q3_deg ([-.\d]+), the motion has ([-.\d]+) there", found.difference or ""
    )
    assert said is not None, found.difference
    assert [float(each) for each in said.groups()] == pytest.approx([true + sign * 1e-3, true], abs=1e-8)


@pytest.mark.parametrize("column", range(1, 10))
def test_full_digits_are_off_by_what_no_processor_makes(column: int, plan: Plan, tmp_path: Path) -> None:
    """A few units in the last place are left to other processors, a billionth is not."""
    rows = rows_at()
    rows[3, column] += 1e-9
    assert not compared(tmp_path, plan, rows, ".17g").planned
    rows[3, column] += 1e-13 - 1e-9
    assert compared(tmp_path, plan, rows, ".17g").planned


@pytest.mark.parametrize("off", [0.4e-9, -0.4e-9, 3e-9, -3e-9])
def test_exact_stamps_may_have_been_rounded_to_nanoseconds_before(
    off: float, plan: Plan, tmp_path: Path
) -> None:
    """Rows at the rate 1/0.15 Hz, whose last stamp is not one of the grid, of a file that was converted."""
    for row in (1, -2, -1):
        rows = rows_at(1 / 0.15)
        rows[row, 0] += off
        assert compared(tmp_path, plan, rows, ".17g").planned is (abs(off) < 1e-9)


def in_milliseconds(folder: Path, plan: Plan, rows: Rows) -> RowComparison:
    """Return what a comparison says of rows whose stamps show three decimals, and values nine."""
    lines = (",".join([f"{row[0]:.3f}", *(f"{value:.9f}" for value in row[1:])]) for row in rows.tolist())
    (folder / "rows.csv").write_text("\n".join([",".join(NAMES), *lines]) + "\n", encoding="utf-8")
    return compare_with_plan(ByteSource(str(folder / "rows.csv")), plan)


@pytest.mark.parametrize("late", [0.4e-3, -0.4e-3, 2e-3, -2e-3])
def test_stamps_of_three_decimals_stand_for_half_a_millisecond(
    late: float, plan: Plan, tmp_path: Path
) -> None:
    """Rows at the rate 1/0.15 Hz: values from beside their stamps. One that is off stays off among them."""
    rows = rows_at(1 / 0.15, late)
    rows[0], rows[-1] = rows_at(1 / 0.15)[[0, -1]]
    assert in_milliseconds(tmp_path, plan, rows).planned is (abs(late) < 0.5e-3)
    for row in range(1, len(rows) - 1):
        wrong = rows.copy()
        wrong[row, 3] += 0.01
        found = in_milliseconds(tmp_path, plan, wrong)
        assert not found.planned
        assert abs(late) > 0.5e-3 or f"row {row + 1} has" in (found.difference or "")


@pytest.mark.parametrize(("share", "planned"), [(0.0, True), (0.5, False), (1.0, True)])
def test_where_the_acceleration_steps_a_row_has_one_of_both(
    share: float, *, planned: bool, tmp_path: Path
) -> None:
    """A trapezoid of 1 rad/s and 4 rad/s^2: at 0.25 s the acceleration goes from 4 to 0 at once, and has no mean."""
    fields = {"version": 1, "robot": {"joints": 1}, "start": {"joints": [0.0]}, "output": {"rate": 8}}
    fields |= {"limits": {"velocity": 9, "acceleration": 90, "jerk": None}}
    move = {"planner": "trapezoid", "to": {"joints": [1.0]}, "velocity": 1.0, "acceleration": 4.0}
    plan = plan_job(random_jobs.loaded(fields | {"moves": [move]}))
    t = np.arange(11) / 8
    past = np.clip(t[:, None] - [0.0, 0.25, 1.0, 1.25], 0.0, None)
    signs = np.array([1.0, -1.0, -1.0, 1.0])
    after = t[:, None] + 1e-12 >= [0.0, 0.25, 1.0, 1.25]
    rows = np.stack([t, 2.0 * past**2 @ signs, 4.0 * past @ signs, 4.0 * after @ signs], axis=1)
    rows[-1, 3] = -4.0  # at the end that before it
    rows[2, 3] = 4.0 * share
    assert compared(tmp_path, plan, rows, names=["t", "q1", "qd1", "qdd1"]).planned is planned


def test_columns_may_stand_in_any_order_but_not_for_each_other(plan: Plan, tmp_path: Path) -> None:
    rows, order = rows_at(), [0, 9, 2, 1, 3, 7, 4, 6, 5, 8]
    assert compared(tmp_path, plan, rows[:, order], names=[NAMES[k] for k in order]).planned
    for a, b in ((1, 3), (4, 6), (7, 9), (4, 7), (1, 2)):
        swapped = list(NAMES)
        swapped[a], swapped[b] = swapped[b], swapped[a]
        assert not compared(tmp_path, plan, rows, names=swapped).planned


def message(folder: Path, names: list[str], rows: Rows) -> ByteSource:
    """Return a message of ROS that holds rows, with stamps to the nanosecond."""
    points = [
        {
            "positions": row[1:4],
            "velocities": row[4:7],
            "accelerations": row[7:],
            "time_from_start": dict(zip(("sec", "nanosec"), divmod(round(row[0] * 1e9), 10**9), strict=True)),
        }
        for row in rows.tolist()
    ]
    (folder / "rows.yaml").write_text(json.dumps({"joint_names": names, "points": points}))
    return ByteSource(str(folder / "rows.yaml"))


def test_joints_of_a_message_have_the_names_of_the_job(plan: Plan, tmp_path: Path) -> None:
    names = list(plan.loaded.robot.joint_names)
    for order in ([0, 1, 2], [2, 1, 0], [0, 2, 1]):
        source = message(tmp_path, [names[k] for k in order], rows_at())
        assert compare_with_plan(source, plan).planned is (order == [0, 1, 2])


@pytest.mark.parametrize(
    ("late", "planned"), [(0.4e-9, True), (-0.4e-9, True), (5e-9, False), (-5e-9, False)]
)
def test_stamps_of_messages_stand_for_half_a_nanosecond(
    late: float, *, planned: bool, plan: Plan, tmp_path: Path
) -> None:
    rows = rows_at(10.0, late)
    rows[[0, -1]] = rows_at()[[0, -1]]
    source = message(tmp_path, list(plan.loaded.robot.joint_names), rows)
    assert compare_with_plan(source, plan).planned is planned


def _gone(rows: Rows) -> Rows:
    return np.delete(rows, 4, axis=0)


def _late(rows: Rows) -> Rows:
    rows[5, 0] += 2e-9
    return rows


def _early(rows: Rows) -> Rows:
    rows[5, 0] -= 2e-9
    return rows


def _doubled(rows: Rows) -> Rows:
    return np.insert(rows, 3, rows[3], axis=0)


@pytest.mark.parametrize(
    "fault", [_gone, _late, _early, _doubled, lambda rows: rows[:-1], lambda rows: rows[1:]]
)
def test_stamps_that_are_not_all_times_of_the_rate(
    fault: Callable[[Rows], Rows], plan: Plan, tmp_path: Path
) -> None:
    assert not compared(tmp_path, plan, fault(rows_at())).planned


@pytest.mark.parametrize("pause", few([slice(4096, 8192), slice(8192, -1)], 1))
def test_no_block_of_rows_is_late_as_a_whole(pause: slice, plan: Plan, tmp_path: Path) -> None:
    """Stamps of 4096 rows that follow each other are 10 us late, less than a tenth of their period."""
    rows = rows_at(8000.0)[:, [0, 3]]
    rows[pause, 0] += 1e-5
    assert not compared(tmp_path, plan, rows, ".6f", ["t", "q3"]).planned


@pytest.mark.parametrize("row", [3, 4095, 4096, 5000, 8191, 8192, -1])
def test_a_row_of_any_block_is_looked_at_and_named(row: int, plan: Plan, tmp_path: Path) -> None:
    rows = rows_at(8000.0)[:, [0, 3]]
    rows[row, 1] += 2e-6
    found = compared(tmp_path, plan, rows, ".6f", ["t", "q3"])
    assert found.difference is not None
    assert f"row {row % len(rows) + 1} has q3" in found.difference


@pytest.mark.parametrize("ending", ["csv", "jsonl"])
@pytest.mark.parametrize(("stands", "planned"), [(0.25, True), (0.3, False), (0.2, False), (0.252, False)])
def test_a_joint_stands_where_it_shall_though_few_digits_are_shown(
    stands: float, ending: str, *, planned: bool, plan: Plan, tmp_path: Path
) -> None:
    """Six decimals in the shortest spelling: 0.3 is no 0.25 that was rounded to one decimal."""
    rows, file = np.round(rows_at(), 6), tmp_path / f"rows.{ending}"
    rows[:, 2] = stands
    lines = [",".join(NAMES), *(",".join(map(repr, row)) for row in rows.tolist())]
    if ending == "jsonl":
        parts = ({"t": r[0], "q": r[1:4], "qd": r[4:7], "qdd": r[7:]} for r in rows.tolist())
        lines = [json.dumps(part) for part in parts]
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    assert compare_with_plan(ByteSource(str(file)), plan).planned is planned
    judgement = check_file(str(file), CheckOptions(), plan).judgement
    assert judgement.verdict == ("exceeded" if abs(stands - 0.25) > 1e-3 else "satisfied")


@pytest.mark.parametrize(("limit", "verdict"), [(0.27, "exceeded"), (0.31, "satisfied")])
def test_a_joint_that_stands_beyond_its_range_is_beyond_it(
    limit: float, verdict: str, tmp_path: Path
) -> None:
    robot, limits, file = tmp_path / "robot.yaml", tmp_path / "limits.yaml", tmp_path / "rows.csv"
    robot.write_text("{joints: 2}")
    limits.write_text(f"{{position: [[-9, 9], [-9, {limit}]]}}")
    rows = (f"{0.1 * k:.1f},{0.012345 * k:.6f},0.3" for k in range(9))
    file.write_text("t,q1,q2\n" + "\n".join(rows) + "\n", encoding="utf-8")
    options = CheckOptions(robot=str(robot), limits=str(limits))
    assert check_file(str(file), options).judgement.verdict == verdict


@pytest.mark.parametrize("wrong", [None, "q2", "qd1", "qd3", "qdd1"])
def test_rows_from_the_end_to_the_start_are_told_to_be_it_backward(
    wrong: str | None, plan: Plan, tmp_path: Path
) -> None:
    """As time goes back velocities change their sign, and positions and accelerations do not."""
    rows = rows_at(10.0)[::-1].copy()  # the last interval is half as long, and stands first now
    rows[:, 0] = rows[0, 0] - rows[:, 0]
    rows[:, 4:7] *= -1.0
    if wrong is not None:
        rows[:, NAMES.index(wrong)] *= -1.0
    said = compared(tmp_path, plan, rows).difference or ""
    assert ("they are it backward" in said) == (wrong is None)


ODD = ("qd", "v", "w", "sd_")
"""What names of first derivatives begin with, besides those of second ones."""


@pytest.mark.parametrize("wrong", [None, "qd6_deg", "vx_mm", "wz_deg", "sd_mm", "ay_mm", "ez_deg", "z_mm"])
def test_rows_of_a_tool_from_the_end_to_the_start_are_told_to_be_it_backward(
    wrong: str | None, tmp_path: Path
) -> None:
    made = planned_with_output(TWO_MOVES, "{rate: 7, columns: [t, qd, pose, twist, twistd, path, move]}")
    file = tmp_path / "rows.csv"
    write_plan(made, str(file))
    head, *lines = file.read_text(encoding="utf-8").splitlines()
    names, rows = (
        head.split(","),
        np.array([[float(cell) for cell in line.split(",")] for line in lines[::-1]]),
    )
    rows[:, 0] = rows[0, 0] - rows[:, 0]
    for k, name in enumerate(names):
        rows[:, k] *= -1.0 if name.startswith(ODD) is not (name == wrong) else 1.0
    said = compared(tmp_path, made, rows, names=names).difference or ""
    assert ("they are it backward" in said) == (wrong is None), said


OF_A_TOOL = {
    "pose": ["x", "y", "z", "qw", "qx", "qy", "qz"],
    "twist": ["vx", "vy", "vz", "wx", "wy", "wz"],
    "twistd": ["ax", "ay", "az", "ex", "ey", "ez"],
}


@pytest.mark.parametrize(
    ("names", "said"),
    [
        (["t"], "no column of time"),
        (["q1"], "no column of time"),
        (["q1", "qd1"], "no column of time"),
        *((["t", "q1", *names], "the robot has no geometry") for names in OF_A_TOOL.values()),
        (["t", "q1", "tau1"], "the robot of the job has no masses"),
        (["t", "q1", "q4"], "the column q4 is none that `plan` writes"),
        (["t", "q1", "sway"], "the column sway is none that `plan` writes"),
        (["sway"], "the column sway is none that `plan` writes"),
    ],
)
def test_rows_that_lack_their_time_or_have_more_than_the_plan_are_none_of_it(
    names: list[str], said: str, plan: Plan, tmp_path: Path
) -> None:
    rows = np.stack([rows_at()[:, NAMES.index(name) if name in NAMES else 1] for name in names], axis=1)
    lines = [",".join(f"{value:.9f}" for value in row) for row in rows.tolist()]
    (tmp_path / "rows.csv").write_text("\n".join([",".join(names), *lines]) + "\n", encoding="utf-8")
    found = compare_with_plan(ByteSource(str(tmp_path / "rows.csv")), plan)
    assert not found.planned
    assert said in (found.difference or "")


def as_array(folder: Path, rows: Rows) -> ByteSource:
    """Return rows as an array with names."""
    table = np.zeros(len(rows), [(name, "f8") for name in NAMES])
    for k, name in enumerate(NAMES):
        table[name] = rows[:, k]
    np.save(folder / "rows.npy", table)
    return ByteSource(str(folder / "rows.npy"))


@pytest.mark.parametrize("size", [1, 2, 5, 12, 13, 14])
@pytest.mark.parametrize("rate", [10.0, 1 / 0.15])
def test_rows_of_the_law_are_known_in_blocks_of_any_size(
    size: int, rate: float, plan: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The last one may be one row alone; a row that is wrong is told in each."""
    monkeypatch.setattr(npy, "_ROWS", size)
    rows = rows_at(rate)
    assert compare_with_plan(as_array(tmp_path, rows), plan).planned
    for row in (0, size - 1, size, len(rows) - 1):
        if row < len(rows):
            wrong = rows.copy()
            wrong[row, 3] += 1e-6
            said = compare_with_plan(as_array(tmp_path, wrong), plan).difference or ""
            assert f"row {row + 1} has q3" in said


@pytest.mark.parametrize("early", [0.0, 1e-5, 1.0])
@pytest.mark.parametrize("block", [0, 1, 2])
def test_stamps_that_do_not_increase_are_told_wherever_they_stand(
    block: int, early: float, plan: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In a block of rows, and from one to the next: these are five rows long."""
    monkeypatch.setattr(npy, "_ROWS", 5)
    rows = rows_at(10.0)
    row = 5 * block or 3
    rows[row, 0] = rows[row - 1, 0] - early
    found = compare_with_plan(as_array(tmp_path, rows), plan)
    assert found.difference == "its time stamps do not increase from row to row"


def test_what_changes_its_sign_as_time_goes_back_are_derivatives_of_odd_order() -> None:
    groups = [group for group in GROUPS if group not in ("tau", "signals")]
    for column in columns_of(groups, ("revolute", "prismatic"), Units()):
        order = column.quantity.order if column.quantity is not None else 0
        assert (column.kind in planned_rows._ODD) == (order % 2 == 1), column.kind


@pytest.mark.parametrize(("late", "planned"), [(0.0, True), (1e-3, False), (-1e-3, False)])
def test_stamps_of_few_digits_beside_full_ones_are_no_rounded_ones(
    late: float, *, planned: bool, plan: Plan, tmp_path: Path
) -> None:
    """Who writes the shortest digits that say a number writes 0.1 for the time of a row, and means it."""
    rows = rows_at(10.0, late)
    rows[[0, -1]] = rows_at()[[0, -1]]
    lines = (",".join(map(repr, row)) for row in rows.tolist())
    (tmp_path / "rows.csv").write_text("\n".join([",".join(NAMES), *lines]) + "\n", encoding="utf-8")
    assert compare_with_plan(ByteSource(str(tmp_path / "rows.csv")), plan).planned is planned


@pytest.mark.parametrize("missing", [None, 1.0, 0.7])
@pytest.mark.parametrize("begins", [0.0, 3.0])
def test_knots_and_all_times_of_the_rate_of_the_job_are_rows_of_it(
    begins: float, missing: float | None, tmp_path: Path
) -> None:
    """A trapezoid of 1 rad/s and 4 rad/s^2 has its knots at 0, 0.25, 1 and 1.25 s; the job says 10 Hz."""
    fields = {"version": 1, "robot": {"joints": 1}, "start": {"joints": [0.0]}, "output": {"rate": 10}}
    fields |= {"limits": {"velocity": 9, "acceleration": 90, "jerk": None}}
    move = {"planner": "trapezoid", "to": {"joints": [1.0]}, "velocity": 1.0, "acceleration": 4.0}
    plan = plan_job(random_jobs.loaded(fields | {"moves": [move]}))
    t = np.unique(np.round([*np.arange(13) / 10, 0.25, 1.25], 9))
    t = t[t != missing]
    past = np.clip(t[:, None] - [0.0, 0.25, 1.0, 1.25], 0.0, None)
    signs = np.array([1.0, -1.0, -1.0, 1.0])
    rows = np.stack([begins + t, 2.0 * past**2 @ signs, 4.0 * past @ signs], axis=1)
    assert compared(tmp_path, plan, rows, names=["t", "q1", "qd1"]).planned is (missing is None)


def test_a_plan_that_stands_still_has_one_row(tmp_path: Path) -> None:
    fields = {"version": 1, "robot": {"joints": 1}, "start": {"joints": [0.3]}, "output": {"rate": 10}}
    fields |= {"limits": {"velocity": 9, "acceleration": 90, "jerk": 900}}
    move = {"planner": "jerk_limited", "to": {"joints": [0.3]}}
    plan = plan_job(random_jobs.loaded(fields | {"moves": [move]}))
    assert plan.trajectory.duration == 0.0
    for place, planned in ((0.3, True), (0.31, False)):
        rows = np.array([[0.0, place, 0.0, 0.0]])
        assert compared(tmp_path, plan, rows, names=["t", "q1", "qd1", "qdd1"]).planned is planned


@pytest.mark.parametrize("clock", [0.0, 2.0])
@pytest.mark.parametrize(
    ("first", "last", "part"),
    [
        (0.0, 0.6, True),
        (0.3, 0.9, True),
        (0.65, 1.25, True),
        (0.0, 1.249, True),
        (0.001, 1.25, True),
        (-0.3, 0.3, False),
    ],
)
def test_a_part_of_the_motion_is_told_with_its_place(
    first: float, last: float, clock: float, tmp_path: Path, *, part: bool
) -> None:
    """By a clock that the job says; rows that begin before it does are no part, whatever they show."""
    fields = {"version": 1, "robot": {"joints": 3}, "start": {"joints": START.tolist()}}
    fields |= {"limits": {"velocity": 9, "acceleration": 90, "jerk": None}}
    fields |= {"output": {"rate": 10, "start_time": clock}}
    move = {"planner": "quintic", "to": {"joints": END.tolist()}, "duration": DURATION}
    plan = plan_job(random_jobs.loaded(fields | {"moves": [move]}))
    t = np.linspace(first, last, 8)
    shown = t - first if first < 0.0 else t
    rows = np.hstack([clock + t[:, None], states(shown)])
    said = compared(tmp_path, plan, rows).difference or ""
    told = f"they are a part of it alone, from {first:.9g} s to {last:.9g} s of 1.25 s"
    assert (said == told) is part
    assert part or "part" not in said


@pytest.mark.parametrize("row", [1, 4, 8])
def test_rows_that_are_nearer_than_a_nanosecond_are_no_part(row: int, plan: Plan, tmp_path: Path) -> None:
    rows = np.insert(rows_at()[:10], row, rows_at()[row], axis=0)
    rows[row + 1, 0] += 2.0**-31
    found = compare_with_plan(as_array(tmp_path, rows), plan)
    assert not found.planned
    assert "part" not in (found.difference or "")
