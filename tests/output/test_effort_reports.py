"""Efforts in report and explanation: extremes, share of gravity, head room, and what was judged by what."""

from __future__ import annotations

import numpy as np
import pytest

from trajcli.cli.explain import _lines
from trajcli.cli.plan import summary
from trajcli.grids import UniformGrid
from trajcli.job.read import job_from_text
from trajcli.output.explain import explanation
from trajcli.output.report import report_of
from trajcli.planning.plan import Plan, plan_job
from trajcli.samples import sample

JOB = """
version: 1
units: {angle: deg, length: mm}
robot:
  name: arm
  convention: standard
  joints:
    - {name: a, a: 500, velocity: 100, acceleration: 300, effort: 60, link: {mass: 4, com: [-250, 0, 0], inertia: [0.01, 0.1, 0.1, 0, 0, 0]}}
    - {name: b, a: 400, velocity: 100, acceleration: 300, effort: [-20, 25], link: {mass: 2, com: [-200, 0, 0], inertia: [0.01, 0.05, 0.05, 0, 0, 0]}}
gravity: [0, -9.81, 0]
limits: {}
start: {joints: [0, 0]}
moves:
  - {planner: quintic, to: {joints: [90, 20]}}
  - {attach: {mass: 1.2, com: [60, 0, 0]}}
  - {planner: quintic, to: {joints: [0, 90]}}
  - {detach: {}}
  - {planner: quintic, to: {joints: [0, -90]}}
"""


def planned(*changes: tuple[str, str]) -> Plan:
    """Return the plan of the job with some text replaced."""
    text = JOB
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    return plan_job(job_from_text(text))


@pytest.fixture(scope="module")
def plan() -> Plan:
    return planned()


def gravity_of(q: np.ndarray, carried: float) -> np.ndarray:
    """Return what holds the arm in the vertical plane, (2,), the payload 0.46 m behind the second axis."""
    second = (2 * 0.2 + carried * 0.46) * 9.81 * np.cos(q.sum())
    return np.array([(4 * 0.25 + (2 + carried) * 0.5) * 9.81 * np.cos(q[0]) + second, second])


def test_extremes_are_those_of_dense_rows_and_lie_within_their_bounds(plan: Plan) -> None:
    report, duration = report_of(plan), plan.trajectory.duration
    grid = UniformGrid(duration, 1e5 / duration, 0.0)
    robot = plan.loaded.robot
    rows = np.concatenate(list(sample(plan.trajectory, grid, ("t", "tau", "move"), robot=robot)))
    for index in (0, 2, 4):
        own = rows[rows[:, -1] == index]
        for joint, effort in enumerate(report.moves[index].efforts or ()):
            tau = own[:, 1 + joint]
            assert (effort.low, effort.high) == pytest.approx((tau.min(), tau.max()), abs=1e-5)
            assert effort.bound[0] <= min(tau.min(), effort.low)
            assert effort.bound[1] >= max(tau.max(), effort.high)
            assert effort.bound == pytest.approx((effort.low, effort.high), abs=1e-4)
            assert own[tau.argmax(), 0] == pytest.approx(effort.high_time, abs=0.02)


def test_use_head_room_and_share_of_gravity_agree(plan: Plan) -> None:
    report = report_of(plan)
    for index, carried in ((0, 0.0), (2, 1.2), (4, 0.0)):
        for joint, effort in enumerate(report.moves[index].efforts or ()):
            assert effort.used is not None
            assert effort.head_room is not None
            low, high = effort.limit
            parts = [effort.bound[0] / (low or 1), effort.bound[1] / (high or 1)]
            assert effort.used == pytest.approx(max(parts))
            side = parts.index(max(parts))
            limit = abs((low, high)[side] or 0)
            assert effort.head_room == pytest.approx(limit * (1 - effort.used))
            at = (effort.low_time, effort.high_time)[side]
            expected = gravity_of(plan.trajectory(at), carried)[joint]
            assert effort.gravity == pytest.approx(expected, abs=1e-4)
            assert effort.gravity_share == pytest.approx(expected / (effort.low, effort.high)[side], abs=1e-4)


def test_the_payload_is_part_of_each_move(plan: Plan) -> None:
    moves = report_of(plan).moves
    assert [move.payload is not None for move in moves] == [False, True, True, False, False]
    payload = moves[2].payload
    assert payload is not None
    assert (payload.mass, payload.com) == (1.2, [0.06, 0, 0])
    shown = explanation(plan).moves[2].payload
    assert shown is not None
    assert (shown.com, shown.com_unit) == ([60, 0, 0], "mm")


def test_what_binds_may_be_an_effort() -> None:
    plan = planned(("limits: {}", "limits: {effort: {a: 27}}"))
    binding = report_of(plan).moves[0].binding
    assert binding is not None
    assert (binding.quantity, binding.joint) == ("effort", "a")
    assert binding.used == pytest.approx(1, abs=1e-6)
    assert "tightest limit: effort of a in move 0, 100 % used" in summary(plan, 0)


def test_the_report_says_what_was_judged_by_what(plan: Plan) -> None:
    efforts = report_of(plan).efforts
    assert efforts is not None
    assert (efforts.judged, efforts.reason, efforts.inertials) == (True, None, "the job")
    assert efforts.gravity == [0, -9.81, 0]


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ([("limits: {}", "limits: {effort: null}")], "the job's limits say null"),
        ([(" effort: 60,", ""), (" effort: [-20, 25],", "")], "no limit of effort is given"),
        (
            [(", link: {mass: 2, com: [-200, 0, 0], inertia: [0.01, 0.05, 0.05, 0, 0, 0]}", "")],
            "no mass and inertia of the links behind b",
        ),
    ],
)
def test_and_why_not(changes: list[tuple[str, str]], reason: str) -> None:
    plan = planned(*changes)
    report = report_of(plan)
    assert report.efforts is not None
    assert (report.efforts.judged, report.efforts.reason) == (False, reason)
    assert all(move.efforts is None for move in report.moves)


def test_bare_joints_have_no_efforts() -> None:
    bare = "version: 1\nrobot: {joints: 1}\nstart: {joints: 0}\nmoves: [{planner: hold, duration: 1}]"
    assert report_of(plan_job(job_from_text(bare))).efforts is None


def test_the_explanation_for_people(plan: Plan) -> None:
    lines = list(_lines(explanation(plan), plan, peers=False))
    assert "  carries 1.2 kg at [60, 0, 0] mm of the tcp, a point mass" in lines
    attach = lines.index(next(line for line in lines if line.startswith("move 1: attach, 0 s")))
    assert lines[attach + 2] == ""  # nothing more about a move that does not move
    tau = next(line for line in lines if line.startswith("    b tau: "))
    assert "N m; limits -20 .. 25" in tau
    assert "of it against gravity" in tau
    assert lines[-1] == "efforts: judged for all t; masses and inertias from the job"
