"""Columns about the tool: beside joints against what these make of it, and alone as a motion of the tool."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from planned_examples import planned_with_output
from tiers import few
from two_moves import TWO_MOVES as JOB

from trajcli.columns import group_of, parse_column
from trajcli.errors import InputError
from trajcli.findings import Finding
from trajcli.judge.file import CheckOptions, check_file
from trajcli.judge.judgement import Judgement
from trajcli.output.delivery.joined import write_plan
from trajcli.planning.plan import Plan

Rows = NDArray[np.float64]
EVERYTHING = "[t, q, qd, qdd, pose, twist, twistd, path, move]"
ALONE = ("[t, pose]", "[t, pose, twist]", "[t, twist, twistd]", "[t, twist]", "[t, path]", "[t, path, move]")


def planned(columns: str, rate: int = 50) -> Plan:
    return planned_with_output(JOB, f"{{rate: {rate}, columns: {columns}}}")


def written(plan: Plan, file: Path) -> tuple[list[str], Rows]:
    """Return names and rows of the plan."""
    write_plan(plan, str(file))
    head, *lines = file.read_text(encoding="utf-8").splitlines()
    return head.split(","), np.array([[float(cell) for cell in line.split(",")] for line in lines])


def judged(
    plan: Plan, names: list[str], rows: Rows, file: Path, coarse: Mapping[int, int] | None = None
) -> Judgement:
    """Judge rows of nine decimals, or of fewer in some columns."""
    decimals = [(coarse or {}).get(k, 9) for k in range(len(names))]
    lines = [",".join(f"{v:.{d}f}" for v, d in zip(row, decimals, strict=True)) for row in rows]
    file.write_text("\n".join([",".join(names), *lines]) + "\n", encoding="utf-8")
    return check_file(str(file), CheckOptions(), plan).judgement


def of_tool(found: Judgement) -> dict[str | None, Finding]:
    """Return the findings about columns of the tool by their quantity."""
    return {finding.quantity: finding for finding in found.findings if finding.kind == "tool"}


@pytest.mark.parametrize("columns", few(ALONE, 3))
def test_rows_of_the_tool_alone_are_known(columns: str, tmp_path: Path) -> None:
    plan, file = planned(columns), tmp_path / "rows.csv"
    names, rows = written(plan, file)
    assert check_file(str(file), CheckOptions(), plan).judgement.planned_rows is True
    found = judged(plan, names, np.delete(rows, 50, axis=0), file)
    assert found.planned_rows is False


@pytest.mark.parametrize("columns", few(ALONE, 3))
def test_the_tool_twice_as_fast_is_over_its_limits(columns: str, tmp_path: Path) -> None:
    # of a motion in half the time, velocities double and accelerations are four times as large
    plan, file = planned(columns), tmp_path / "rows.csv"
    names, rows = written(plan, file)
    rows[:, names.index("t")] /= 2.0
    for k, name in enumerate(names):
        of_first = name.startswith(("v", "w", "sd"))
        of_second = name.startswith(("a", "e", "sdd"))
        rows[:, k] *= 4.0 if of_second else 2.0 if of_first else 1.0
    if columns == "[t, path]":
        with pytest.raises(InputError, match="which moves its distances s are of"):
            judged(plan, names, rows, file)
        return
    found = judged(plan, names, rows, file)
    speed = max(
        (finding for finding in found.findings if finding.kind == "tool_speed"),
        key=lambda finding: finding.excess,
    )
    assert speed.value == pytest.approx(2 * 0.2, rel=2e-3)
    assert found.verdict == "exceeded"


@pytest.mark.parametrize("factor", [1 + 1e-4, 1 - 1e-4])
def test_distances_of_a_file_that_lasts_otherwise_than_the_plan_are_of_unknown_moves(
    factor: float, tmp_path: Path
) -> None:
    plan, file = planned("[t, path]"), tmp_path / "rows.csv"
    names, rows = written(plan, file)
    rows[:, names.index("t")] *= factor
    with pytest.raises(InputError, match="which moves its distances s are of"):
        judged(plan, names, rows, file)


def test_a_tool_beside_its_line_is_found_without_joints(tmp_path: Path) -> None:
    plan, file = planned("[t, pose, move]"), tmp_path / "rows.csv"
    names, rows = written(plan, file)
    on_line = np.flatnonzero(rows[:, -1] == 1)
    row = int(on_line[len(on_line) // 2])
    rows[row, names.index("z_mm")] += 1.0
    found = judged(plan, names, rows, file)
    beside = next(finding for finding in found.findings if finding.kind == "deviation")
    assert (beside.row, beside.certainty) == (row + 1, "exceeded")
    assert 0.7e-3 < (beside.value or 0.0) <= 1.0001e-3


FAULTS: list[tuple[str, float, str, float]] = [
    ("x_mm", 1.0, "position", 1e-3),
    ("vz_mm", 1.0, "velocity", 1e-3),
    ("wy_deg", 1.0, "angular velocity", np.pi / 180),
    ("ax_mm", 10.0, "acceleration", 1e-2),
    ("ez_deg", 10.0, "angular acceleration", np.pi / 18),
]


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[Plan, list[str], Rows]:
    plan = planned(EVERYTHING)
    return (plan, *written(plan, tmp_path_factory.mktemp("whole") / "rows.csv"))


@pytest.mark.parametrize(("name", "by", "quantity", "value"), FAULTS, ids=str)
def test_a_wrong_column_beside_joints_is_found(
    name: str,
    by: float,
    quantity: str,
    value: float,
    whole: tuple[Plan, list[str], Rows],
    tmp_path: Path,
) -> None:
    plan, names, rows = whole[0], whole[1], whole[2].copy()
    rows[40, names.index(name)] += by
    found = of_tool(judged(plan, names, rows, tmp_path / "rows.csv"))
    assert set(found) == {quantity}
    assert (found[quantity].row, found[quantity].count) == (41, 1)
    unit = "rad" if "angular" in quantity else "m"
    order = "/s^2" if "acceleration" in quantity else "/s" if "velocity" in quantity else ""
    assert found[quantity].si_unit == unit + order
    assert found[quantity].value == pytest.approx(value, rel=1e-4)
    assert 0 < (found[quantity].limit or 0.0) < 1e-3 * value


def test_a_turned_pose_beside_joints_is_found(whole: tuple[Plan, list[str], Rows], tmp_path: Path) -> None:
    plan, names, rows = whole[0], whole[1], whole[2].copy()
    at = names.index("qw")
    w, x, y, z = rows[30, at : at + 4]
    half = 0.5 * 0.01  # about x of the tool: the quaternion times (cos, sin, 0, 0)
    c, s = np.cos(half), np.sin(half)
    rows[30, at : at + 4] = (w * c - x * s, x * c + w * s, y * c + z * s, z * c - y * s)
    found = of_tool(judged(plan, names, rows, tmp_path / "rows.csv"))
    assert set(found) == {"orientation"}
    assert found["orientation"].value == pytest.approx(0.01, rel=1e-4)
    rows[30, at : at + 4] = -rows[30, at : at + 4]  # the same rotation
    again = of_tool(judged(plan, names, rows, tmp_path / "rows.csv"))
    assert again["orientation"].value == pytest.approx(0.01, rel=1e-4)


def test_a_place_that_the_tool_is_not_at_is_found(
    whole: tuple[Plan, list[str], Rows], tmp_path: Path
) -> None:
    plan, names, rows = whole[0], whole[1], whole[2].copy()
    on_line = np.flatnonzero(rows[:, names.index("move")] == 1)
    row, at = int(on_line[len(on_line) // 3]), names.index("s_mm")
    rows[row, at] += 2.0
    found = of_tool(judged(plan, names, rows, tmp_path / "rows.csv"))
    assert found["position"].value == pytest.approx(2e-3, rel=1e-3)
    assert (found["position"].row, found["position"].move) == (row + 1, 1)
    rows[:, at] = whole[2][:, at]
    rows[5, at] = 3.0  # of a move in joint space
    found = of_tool(judged(plan, names, rows, tmp_path / "rows.csv"))
    assert (found["position"].value, found["position"].move) == (pytest.approx(3e-3), 0)


@pytest.mark.parametrize("last", [False, True], ids=["before its path", "beyond its path"])
def test_a_distance_outside_its_path_is_found(
    last: bool, whole: tuple[Plan, list[str], Rows], tmp_path: Path
) -> None:
    """The tool stands at an end of the path, which is the nearest that any distance outside leads to."""
    plan, names, rows = whole[0], whole[1], whole[2].copy()
    row = -1 if last else int(np.flatnonzero(rows[:, names.index("move")] == 1)[0])
    at = names.index("s_mm")
    rows[row, at] = rows[row, at] + 0.5 if last else -0.5
    found = of_tool(judged(plan, names, rows, tmp_path / "rows.csv"))["position"]
    assert found.move == 1
    assert 0.5e-3 <= (found.value or 0.0) < 0.8e-3


def test_a_tool_that_is_turned_on_its_path_is_found(tmp_path: Path) -> None:
    """The last joint turns the tool where it is: its position agrees with s, its orientation does not."""
    plan, file = planned("[t, q, path, move]"), tmp_path / "rows.csv"
    names, rows = written(plan, file)
    on_line = np.flatnonzero(rows[:, names.index("move")] == 1)
    last = max(k for k, name in enumerate(names) if group_of(parse_column(name)) == "q")
    row = int(on_line[len(on_line) // 2])
    rows[row, last] += 1.0
    found = of_tool(judged(plan, names, rows, file))
    assert set(found) == {"orientation"}
    assert (found["orientation"].row, found["orientation"].move) == (row + 1, 1)
    assert found["orientation"].value == pytest.approx(np.radians(1.0), rel=1e-4)


HALF_MM, HALF_DEG = 0.5e-6, np.radians(0.5e-3)  # of three decimals, m and rad
OF_JOINTS = 6 * HALF_DEG * 1.2  # m: what they make of six joints at the reach of the arm
OF_RATES = np.sqrt(3.0) * (HALF_MM + HALF_DEG)


@pytest.mark.parametrize(
    ("group", "name", "quantity", "rounding"),
    few(
        [
            ("q", "x_mm", "position", OF_JOINTS),
            ("qd", "vy_mm", "velocity", OF_JOINTS),
            ("qdd", "az_mm", "acceleration", OF_JOINTS),
            ("pose", "x_mm", "position", np.sqrt(3.0) * HALF_MM + 2.0 * 0.5e-3),
            ("twist", "vy_mm", "velocity", OF_RATES),
            ("twistd", "az_mm", "acceleration", OF_RATES),
        ],
        3,
    ),
)
def test_few_decimals_of_a_group_are_no_faults_and_hide_few(
    group: str,
    name: str,
    quantity: str,
    rounding: float,
    whole: tuple[Plan, list[str], Rows],
    tmp_path: Path,
) -> None:
    """Three decimals explain what they make of all columns beside, of the joints up to three times, and not more."""
    plan, names, rows = whole[0], whole[1], whole[2].copy()
    coarse = {k: 3 for k, name in enumerate(names) if group_of(parse_column(name)) == group}
    assert len(coarse) > 5
    assert of_tool(judged(plan, names, rows, tmp_path / "rows.csv", coarse)) == {}
    rows[60, names.index(name)] += 30.0
    found = of_tool(judged(plan, names, rows, tmp_path / "rows.csv", coarse))
    assert set(found) == {quantity}
    assert rounding / 2 < (found[quantity].limit or 0.0) < (3 if group.startswith("q") else 1.01) * rounding


@pytest.mark.parametrize(("name", "columns"), [("sd_mm", EVERYTHING), ("vz_mm", "[t, q, twist]")])
def test_a_rate_that_is_none_is_found(name: str, columns: str, tmp_path: Path) -> None:
    plan, file = planned(columns, 100), tmp_path / "rows.csv"
    names, rows = written(plan, file)
    right = judged(plan, names, rows[:-1], file)
    assert not [finding for finding in right.findings if finding.kind in ("derivative", "tool", "jump")]
    rows[:, names.index(name)] *= 1.1
    found = judged(plan, names, rows, file)
    wrong = [finding for finding in found.findings if finding.kind == "derivative"]
    assert [(finding.joint, finding.certainty) for finding in wrong] == [(None, "exceeded")]


def later(rows: Rows) -> Rows:
    return rows[1:]


def earlier(rows: Rows) -> Rows:
    return rows[:-1]


def sparse(rows: Rows) -> Rows:
    return np.concatenate([rows[:-1:3], rows[-4:-1]])


@pytest.mark.parametrize("part", [later, earlier, sparse], ids=lambda part: part.__name__)
def test_true_columns_of_other_rows_are_no_faults(
    part: Callable[[Rows], Rows], whole: tuple[Plan, list[str], Rows], tmp_path: Path
) -> None:
    plan, names, rows = whole
    found = judged(plan, names, part(rows), tmp_path / "rows.csv")
    assert found.planned_rows is False
    assert of_tool(found) == {}
    assert not [note for note in found.notes if "not read" in note]


def test_columns_that_nobody_knows_are_still_named(
    whole: tuple[Plan, list[str], Rows], tmp_path: Path
) -> None:
    plan, names, rows = whole
    found = judged(plan, [*names, "light"], np.hstack([rows, rows[:, :1]]), tmp_path / "rows.csv")
    assert [note for note in found.notes if "not read" in note] == ["columns that are not read: light"]
    assert found.planned_rows is False
