"""Rows of plans as their consumer joins them, against scipy's Hermite curves through all rows."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from joined_by_scipy import largest_share
from scipy.interpolate import BPoly
from tiers import few

import trajcli
from trajcli.grids import ListedGrid, UniformGrid
from trajcli.job.read import job_from_text, load_job
from trajcli.kinematics.following.tolerance import Tolerance
from trajcli.output.delivery import joined_rows as module
from trajcli.output.delivery.joined import (
    OtherRows,
    joined_rows,
    rows_report,
    rows_that_keep,
    with_event,
    write_plan,
)
from trajcli.output.write import grid_of
from trajcli.planning.plan import Plan, plan_job
from trajcli.samples import sample
from trajcli.streams.formats import FORMATS

EXAMPLES = Path(__file__).parents[2] / "examples"


def planned(name: str, *sets: str) -> Plan:
    with np.errstate(all="ignore"):
        return plan_job(load_job(str(EXAMPLES / f"{name}.yaml"), sets))


def factor_by_scipy(plan: Plan) -> float:
    """Return the largest share of a joint's limit that Hermite curves through all rows use."""
    return largest_share(plan, grid_of(plan), 1e-4 if "qdd" in plan.loaded.job.output.columns else 1e-6)


@pytest.mark.parametrize(
    ("name", "sets"),
    few(
        [
            ("quintic", ()),
            ("trapezoid", ()),
            ("moveit_limits", ()),
            ("ur5e_pick", ()),
            ("ur5e_pick", ("output.rate=1000",)),
            ("ur5e_pick", ("output.rows=knots",)),
            ("ur5e_pick", ("output.columns=[t, q, qd]",)),
            ("time_optimal", ()),
            ("ur5e_poses", ()),
            ("sync", ()),  # ramps of 1e-14 s: steps of the velocity, which no cure takes away
            ("sync", ("output.rows=knots", "output.columns=[t, q, qd]")),
        ],
        6,
    ),
)
def test_the_worst_factor_is_that_of_scipys_curve(name: str, sets: tuple[str, ...]) -> None:
    plan = planned(name, *sets)
    rows = joined_rows(plan, grid_of(plan), FORMATS["csv"], "full")
    expected = factor_by_scipy(plan)
    for judged in (rows.judgement(), rows.judgement(worst_only=True)):
        assert judged is not None
        found = max((finding.excess for finding in judged.findings if finding.limit), default=1.0)
        assert found == pytest.approx(max(expected, 1.0), rel=2e-3)
        assert bool(judged.events) == (expected > 1 + 1e-4)


@pytest.mark.parametrize("velocity", [[1.3, 0.2], [0.2, -1.5]])
def test_what_a_start_outside_of_its_limits_leads_to_is_no_offence_of_the_rows(velocity: list[float]) -> None:
    """The move that brakes may be as fast as it starts, and no faster; the one behind it not even that."""
    text = (
        "version: 1\nrobot: {joints: 2}\nlimits: {velocity: 1, acceleration: 4, jerk: 60}\n"
        f"start: {{joints: [0, 0], velocity: {velocity}}}\nmoves:\n"
        "  - {planner: jerk_limited, to: {joints: [1, -1]}, brake: true}\n"
        "  - {planner: jerk_limited, to: {joints: [0, 0]}}\noutput: {rate: 50, columns: [t, q, qd]}\n"
    )
    plan = plan_job(job_from_text(text))
    assert plan.verdict.passed
    judged = joined_rows(plan, grid_of(plan), FORMATS["csv"]).judgement()
    assert judged is not None
    assert all(found.excess < 1.01 for found in judged.findings if found.kind == "velocity")  # cubics swing
    slower = replace(plan, moves=[replace(m, planned=replace(m.planned, braking=None)) for m in plan.moves])
    judged = joined_rows(slower, grid_of(plan), FORMATS["csv"]).judgement()
    assert judged is not None
    worst = max(
        (found for found in judged.findings if found.kind == "velocity"), key=lambda found: found.excess
    )
    assert worst.move == 0
    assert 1.1 < worst.excess < np.abs(velocity).max()


def test_no_row_is_read_where_the_curve_itself_proves_it(monkeypatch: pytest.MonkeyPatch) -> None:
    read: list[int] = []
    monkeypatch.setattr(module, "sample", lambda *args, **named: read.append(1) or sample(*args, **named))
    plan = planned("quintic")
    rows = joined_rows(plan, grid_of(plan), FORMATS["csv"])
    judged = rows.judgement()
    assert (judged is not None and judged.events, read) == ((), [])


def test_of_very_many_rows_only_those_about_breaks_are_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 10^9 rows; and the blocks that are chosen are those in which anything is found among all."""
    plan = planned("sync", "limits.velocity=1e-7")
    rows = joined_rows(plan, grid_of(plan), FORMATS["csv"])
    assert rows.grid.count == 10**9 + 1
    judged = rows.judgement()
    assert judged is not None
    assert {found.kind for found in judged.findings} == {"velocity"}
    # of the quintic at the start, as at 1 deg/s; at the end the ramp lasts as long as the stamps' last bit, and its
    # acceleration is stated
    grid = rows.grid
    assert isinstance(grid, UniformGrid)
    for low, first in ((0, 0), (grid.count - 2, 1)):
        local = grid.local(low, low + 2)
        states = np.concatenate(
            [*sample(plan.trajectory, ListedGrid(grid.duration, local), ("q", "qd", "qdd"))]
        ).reshape(2, 3, 2)
        joined = BPoly.from_derivatives(local - local[0], states).derivative()
        speeds = np.abs(joined(np.linspace(0, local[1] - local[0], 1001))).max(axis=0) / np.radians(1e-7)
        of_interval = (
            [found.excess for found in judged.findings if (found.row or 0) > 1] if first else [1.512]
        )
        assert max(of_interval) == pytest.approx(speeds.max(), rel=1e-4)
    assert rows.rounding() > 0
    monkeypatch.setattr(module, "_ROWS", 16)
    for other in (planned("ur5e_pick", "output.rate=333"), planned("septic")):
        rows = joined_rows(other, grid_of(other), FORMATS["csv"])
        grid, degree = rows.grid, 5
        assert isinstance(grid, UniformGrid)
        chosen = {*rows._unproven_blocks(grid, degree)}
        every = range(-(-grid.count // 16))
        needed = {
            k for k in every if rows._unproven(grid.local(max(16 * k - 1, 0), 16 * k + 16), degree).size
        }
        assert needed <= chosen
        assert list(rows._unproven_blocks(grid, degree)) == sorted(chosen)


@pytest.mark.parametrize("rate", [666.666666666, 8000 / 3, 1 / 3, 62.5, 1000.0])
def test_an_option_names_its_rate_to_the_last_bit(rate: float) -> None:
    plan = planned("septic")
    rows = joined_rows(plan, grid_of(plan), FORMATS["csv"])
    loaded = load_job(EXAMPLES / "septic.yaml", rate=OtherRows(rows, {"rate": rate}).options.split()[1])
    assert loaded.job.output.rate == rate


@pytest.mark.full
def test_a_named_cure_cures() -> None:
    plan = planned("ur5e_pick")
    rows = joined_rows(plan, grid_of(plan), FORMATS["csv"])
    shown, judged = with_event(plan, rows, FORMATS["csv"])
    assert next(rows_that_keep(rows)).options == "--rows knots"
    assert [event.kind for event in shown.events] == ["joined_over_limit"]
    assert "`--rows knots` keeps every limit" in shown.events[0].message
    assert factor_by_scipy(planned("ur5e_pick", "output.rows=knots")) < 1 + 1e-4
    assert judged is not None
    report = rows_report(rows, judged)
    assert (report.verdict, report.interpolation, report.rate_that_keeps) == ("exceeded", "quintic", None)
    assert report.worst is not None
    assert (report.worst.kind, report.worst.unit) == ("jerk", "rad/s^3")
    assert report.worst.value / report.worst.limit == pytest.approx(factor_by_scipy(plan), rel=2e-3)


@pytest.mark.full
def test_the_columns_that_join_knots_to_the_motion_are_named() -> None:
    """By straight lines between knots it is far from planned: cubics, which blends are, keep all."""
    sets = ("output.rows=knots", "output.columns=[t, q]")
    plan = planned("blends_ur5e", *sets)
    shown, _ = with_event(plan, joined_rows(plan, grid_of(plan), FORMATS["csv"]), FORMATS["csv"])
    assert '`--set "output.columns=[t, q, qd]"` keeps every limit' in shown.events[-1].message
    assert factor_by_scipy(planned("blends_ur5e", sets[0], "output.columns=[t, q, qd]")) < 1 + 1e-6


@pytest.mark.parametrize(
    "columns", ["t, pose", "t, pose, twist", "t, pose, twist, twistd", "t, twistd, pose"]
)
def test_rows_of_the_tool_are_joined_as_check_joins_them(tmp_path: Path, columns: str) -> None:
    """Also of a gantry, whose three joints the rates of its tool tell as well as those of six."""
    from trajcli.judge.file import CheckOptions, check_file

    plan = planned("gantry", f"output.columns=[{columns}]")
    write_plan(plan, str(tmp_path / "rows.csv"))
    read = check_file(str(tmp_path / "rows.csv"), CheckOptions(), plan).judgement
    assert read.planned_rows
    assert joined_rows(plan, grid_of(plan), FORMATS["csv"]).interpolation == read.interpolation


AT_A_STOP = """\
version: 1
robot: {{joints: [{{name: a, position: [{low}, 2], {rule}velocity: 3, acceleration: 40}}]}}
start: {{joints: [0]}}
moves:
  - {{planner: hold, duration: 0.509}}
  - {{planner: trapezoid, to: {{joints: [1]}}, acceleration: 2, velocity: 0.5}}
output: {{rate: 100}}
"""


@pytest.mark.parametrize(
    ("low", "rule", "kind"),
    [
        (0, "", "position"),
        (-0.05, "velocity_by_position: {deceleration: 1, offset: 0.5}, ", "velocity by position"),
    ],
)
def test_a_limit_of_zero_that_rows_pass_is_said(low: float, rule: str, kind: str) -> None:
    """Scipy's curve through the rows swings back from where the joint stands, that through the knots does not."""
    plan = plan_job(job_from_text(AT_A_STOP.format(low=low, rule=rule)))
    for rows in ("rate", "knots"):
        output = plan.loaded.job.output.model_copy(update={"rows": rows})
        job = plan.loaded.job.model_copy(update={"output": output})
        other = replace(plan, loaded=replace(plan.loaded, job=job))
        grid = grid_of(other)
        parts = zip(sample(plan.trajectory, grid, ("q", "qd", "qdd")), grid.blocks(), strict=True)
        states, (_, local) = next(parts)
        curve = BPoly.from_derivatives(local, states[:, :, None])
        swings = float(curve(np.linspace(0.5, 0.51, 101)).min()) < -1e-9
        shown, judged = with_event(other, joined_rows(other, grid, FORMATS["csv"]), FORMATS["csv"])
        said = [event.message for event in shown.events if event.kind == "joined_over_limit"]
        assert swings == bool(said) == (rows == "rate")
        if said:
            assert f"pass the limit of the {kind} of a, which is 0 there; `--rows knots` keeps" in said[0]
            assert judged is not None
            report = rows_report(joined_rows(other, grid, FORMATS["csv"]), judged)
            assert report.worst is not None
            assert (report.verdict, str(report.worst.limit)) == ("exceeded", "0.0")


def test_plan_and_check_say_the_same(tmp_path: Path) -> None:
    plan, file = planned("ur5e_pick"), tmp_path / "rows.csv"
    trajcli.plan(EXAMPLES / "ur5e_pick.yaml").save(file)
    from trajcli.judge.file import CheckOptions, check_file

    own = joined_rows(plan, grid_of(plan), FORMATS["csv"]).judgement()
    read = check_file(str(file), CheckOptions(), plan).judgement
    assert own is not None
    for found in (own, read):
        assert found.verdict == "satisfied"
    excess = [{(f.kind, f.joint, f.move): f.excess for f in found.findings} for found in (own, read)]
    assert excess[0] == pytest.approx(excess[1], rel=1e-4)
    assert own.events == read.events


LIFT = """\
version: 1
units: {angle: deg, length: mm}
robot: ur5e
limits: {acceleration: 800, jerk: 8000}
start: {joints: [0, -90, 90, -90, -90, 20]}
moves:
  - planner: line
    to: {from: here, offset: {xyz: [0, 0, 60]}}
    law: {shape: jerk_limited, speed: 250, acceleration: 2000, jerk: 30000}
  - {planner: jerk_limited, to: {joints: [40, -90, 95, -95, -60, 0]}}
output: {rate: 50, columns: [t, q, qd, qdd, move]}
"""


def excess_where_plan_and_check_agree(text: str, folder: Path) -> tuple[Plan, dict[tuple, float]]:
    """Return the plan of a job, and by kind, joint and move what its joined rows pass, as both say it."""
    from trajcli.judge.file import CheckOptions, check_file

    plan, file = plan_job(job_from_text(text)), folder / "rows.csv"
    trajcli.plan(text).save(file)
    own = joined_rows(plan, grid_of(plan), FORMATS["csv"]).judgement()
    read = check_file(str(file), CheckOptions(), plan).judgement
    assert own is not None
    excess = [{(f.kind, f.joint, f.move): f.excess for f in found.findings} for found in (own, read)]
    assert excess[0] == pytest.approx(excess[1], rel=1e-4)
    return plan, excess[1]


def is_left(plan: Plan, index: int) -> bool:
    """Return whether the tool leaves the path of a move as soon as nothing of that is tolerated."""
    moves = list(plan.moves)
    planned = moves[index].planned
    strict = replace(planned, tool=replace(planned.tool, tolerance=Tolerance(1e-9, 1e-9)))
    moves[index] = replace(moves[index], planned=strict)
    found = joined_rows(replace(plan, moves=tuple(moves)), grid_of(plan), FORMATS["csv"]).judgement()
    assert found is not None
    return ("deviation", index) in {(f.kind, f.move) for f in found.findings}


def test_between_rows_of_two_moves_the_tool_has_left_its_path(tmp_path: Path) -> None:
    """The last row of a line and the first of the next move are joined by a piece that is not the line's alone."""
    plan, excess = excess_where_plan_and_check_agree(LIFT, tmp_path)
    assert {kind for kind, _, _ in excess} == {"acceleration", "jerk"}
    assert is_left(plan, 0)


LATER = LIFT.replace("start: {joints: [0, -90,", "start: {joints: [30, -90,").replace(
    "moves:\n", "moves:\n  - {planner: jerk_limited, to: {joints: [0, -90, 90, -90, -90, 20]}}\n", 1
)


def test_a_line_behind_another_move_is_followed_from_its_own_start_on(tmp_path: Path) -> None:
    """Nothing leaves it, though it begins after a second."""
    plan, excess = excess_where_plan_and_check_agree(LATER, tmp_path)
    assert {move for kind, _, move in excess if kind == "jerk"} >= {1, 2}
    assert "deviation" not in {kind for kind, _, _ in excess}
    assert is_left(plan, 1)
