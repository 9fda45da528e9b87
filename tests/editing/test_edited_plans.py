"""Rows made of planned ones: known as those of the plan where they are, else said to be what they are."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import trajcli
from trajcli.editing.edited_motion import EditedMotion, ReadingOptions, read_motion
from trajcli.editing.operations import cut, join, resample, reverse
from trajcli.editing.writing import write_motion
from trajcli.job.read import job_from_text
from trajcli.judge.file import CheckOptions, check_file
from trajcli.output.delivery.delivered import delivered_as
from trajcli.output.delivery.joined import write_plan
from trajcli.planning.plan import Plan, plan_job
from trajcli.units import Units

JOB = """
version: 1
robot: {joints: 2}
limits: {velocity: 2, acceleration: 6, jerk: 100}
start: {joints: [0, 0.4]}
moves: [{planner: jerk_limited, to: {joints: [1, -1]}}, {planner: quintic, to: {joints: [0, 1]}, duration: 2.5}]
output: {rate: 100}
"""


@pytest.fixture(scope="module")
def plan() -> Plan:
    return plan_job(job_from_text(JOB))


@pytest.fixture
def source(plan: Plan, tmp_path: Path) -> EditedMotion:
    return source_of(plan, tmp_path)


def source_of(plan: Plan, tmp_path: Path) -> EditedMotion:
    write_plan(plan, str(tmp_path / "plan.csv"))
    return read_motion(str(tmp_path / "plan.csv"), ReadingOptions(), declared=Units())


def said(plan: Plan, motion: EditedMotion, folder: Path) -> tuple[bool | None, str]:
    """Return whether rows are those of the plan, and the sentence that says why not."""
    write_motion(motion, str(folder / "edited.csv"))
    found = check_file(str(folder / "edited.csv"), CheckOptions(), plan).judgement
    return found.planned_rows, next((note for note in found.notes if "no rows of the motion" in note), "")


def test_a_slice_is_a_part(plan: Plan, source: EditedMotion, tmp_path: Path) -> None:
    known, why = said(plan, cut(source, 0.5, 1.25), tmp_path)
    assert (known, "a part of it alone, from 0.5 s to 1.25 s of" in why) == (False, True)
    wrong = cut(source, 0.5, 1.25)
    wrong.rows.q[7, 0] += 1e-6
    assert "they last 0.75 s, and the motion" in said(plan, wrong, tmp_path)[1]


def test_parts_joined_again_are_the_plan(plan: Plan, source: EditedMotion, tmp_path: Path) -> None:
    whole = join(cut(source, 0.0, 1.0), cut(source, 1.0, float(source.rows.t[-1])))
    assert said(plan, whole, tmp_path) == (True, "")


def test_the_way_back_is_said_to_be_it(plan: Plan, source: EditedMotion, tmp_path: Path) -> None:
    known, why = said(plan, reverse(source), tmp_path)
    assert (known, "backward" in why) == (False, True)
    assert said(plan, reverse(reverse(source)), tmp_path) == (True, "")
    wrong = reverse(source)
    assert wrong.rows.qd is not None
    wrong.rows.qd[:] *= -1
    assert "backward" not in said(plan, wrong, tmp_path)[1]


def test_the_way_back_is_said_to_be_it_where_its_stamps_are_a_grid_too(tmp_path: Path) -> None:
    """The border of both moves is a row; the end is one, too."""
    made = plan_job(
        job_from_text(
            "version: 1\nrobot: {joints: 1}\nstart: {joints: [0]}\n"
            "moves: [{planner: quintic, to: {joints: [1]}, duration: 1},"
            " {planner: quintic, to: {joints: [-1]}, duration: 2}]\n"
            "output: {rate: 50, columns: [t, q, qd, move]}\n"
        )
    )
    known, why = said(made, reverse(source_of(made, tmp_path)), tmp_path)
    assert (known, "backward" in why) == (False, True)


def test_a_longer_motion_is_said_to_be_longer(plan: Plan, source: EditedMotion, tmp_path: Path) -> None:
    known, why = said(plan, join(source, reverse(source)), tmp_path)
    assert (known, "they last" in why) == (False, True)


@pytest.mark.full
def test_fewer_rows_are_rows_of_the_plan(plan: Plan, source: EditedMotion, tmp_path: Path) -> None:
    assert said(plan, resample(source, 50.0), tmp_path) == (True, "")
    known, why = said(plan, resample(source, 300.0), tmp_path)  # between the rows, as they are joined
    assert (known, "the motion has" in why) == (False, True)


def test_new_rows_have_the_decimals_of_a_plan(source: EditedMotion, tmp_path: Path) -> None:
    coarse = tmp_path / "coarse.csv"
    coarse.write_text("t,q1,qd1\n0,0.0,0.50\n1,0.5,0.50\n2,1.0,0.50\n", encoding="utf-8")
    motion = read_motion(str(coarse), ReadingOptions(), declared=Units())
    write_motion(resample(motion, 4.0), str(tmp_path / "fine.csv"))
    lines = (tmp_path / "fine.csv").read_text(encoding="utf-8").splitlines()[1:]
    rows = np.array([[float(cell) for cell in line.split(",")] for line in lines])
    np.testing.assert_allclose(rows[:, 1], 0.5 * rows[:, 0], atol=1e-9)  # a straight line
    every = {len(cell.partition(".")[2]) for line in lines for cell in line.split(",")}
    assert every == {9}
    write_motion(resample(source, 300.0), str(tmp_path / "fine.csv"))
    cells = (tmp_path / "fine.csv").read_text(encoding="utf-8").splitlines()[2].split(",")[:-1]
    assert {len(cell.partition(".")[2]) for cell in cells} == {9}


FOR_SERVOJ = """
version: 1
robot: {joints: 6}
limits: {velocity: 2, acceleration: 6, jerk: 100}
start: {joints: [0, 0.4, 0, 0, 0, 0]}
moves:
  - {planner: jerk_limited, to: {joints: [1, -1, 0, 0, 0, 0]}, limits: {velocity: 0.8}}
  - {planner: quintic, to: {joints: [0, 1, 0, 0, 0, 0]}, duration: 2.5}
when_over_limit: slow
output: {for: ur-servoj, columns: [t, q, qd, qdd, move]}
"""


@pytest.mark.full
def test_rows_for_a_consumer_are_retimed_by_the_limits_of_their_moves(tmp_path: Path) -> None:
    """They last longer than the motion that the job plans by itself: a file that says its moves is the oracle."""
    (tmp_path / "job.yaml").write_text(FOR_SERVOJ)
    plan = trajcli.plan(FOR_SERVOJ)
    assert plan.trajectory.duration > plan_job(job_from_text(FOR_SERVOJ)).trajectory.duration
    plan.save(tmp_path / "said.csv")
    rows = [line.rsplit(",", 1)[0] for line in (tmp_path / "said.csv").read_text().splitlines()]
    (tmp_path / "silent.csv").write_text("\n".join(rows) + "\n")
    said, silent = (
        trajcli.retime(tmp_path / name, job=tmp_path / "job.yaml", fastest=True, per_move=True).stretches
        for name in ("said.csv", "silent.csv")
    )
    assert [(each.moves, each.factor) for each in silent] == [(each.moves, each.factor) for each in said]
    assert said[1].factor < 0.9
    (tmp_path / "cut.csv").write_text("\n".join(rows[:-30]) + "\n")
    with pytest.raises(trajcli.InputError, match="no column `move` and does not last as long as the plan"):
        trajcli.retime(tmp_path / "cut.csv", job=tmp_path / "job.yaml")


@pytest.mark.full
def test_a_table_for_a_consumer_is_known_as_a_message(tmp_path: Path) -> None:
    """A message of its own would hold knots."""
    lines = FOR_SERVOJ.replace(", move]", "]").splitlines()
    job = "\n".join(line for line in lines if "quintic" not in line)
    (tmp_path / "job.yaml").write_text(job)
    trajcli.plan(job).save(tmp_path / "rows.csv")
    motion = read_motion(str(tmp_path / "rows.csv"), ReadingOptions(), declared=Units())
    write_motion(motion, str(tmp_path / "rows.yaml"))
    options = CheckOptions(job=str(tmp_path / "job.yaml"))
    assert check_file(str(tmp_path / "rows.yaml"), options, None, delivered_as).judgement.planned_rows


def test_knots_that_cannot_be_faster_name_the_limit_and_not_the_step_that_it_forbids(tmp_path: Path) -> None:
    """From knot to knot the acceleration changes by as much as the jerk allows: faster, it seems to jump."""
    limits = {"velocity": 2, "acceleration": 6, "jerk": 100}
    job: dict[str, Any] = {
        "version": 1,
        "robot": {"joints": 1},
        "start": {"joints": [0]},
        "limits": limits,
    }
    job["moves"] = [{"planner": "jerk_limited", "to": {"joints": [1]}}]
    (tmp_path / "job.yaml").write_text(json.dumps(job))
    job["output"] = {"rows": "knots"}
    trajcli.plan(job).save(tmp_path / "knots.csv", digits="full")
    (found,) = trajcli.retime(tmp_path / "knots.csv", job=tmp_path / "job.yaml", fastest=True).stretches
    assert found.factor == pytest.approx(1.0, abs=2e-4)
    assert found.binding is not None
    assert (found.binding.kind, abs(found.binding.limit or 0.0)) in [("jerk", 100.0), ("acceleration", 6.0)]
