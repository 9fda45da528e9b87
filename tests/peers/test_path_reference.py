"""Comparison with toppra along the same path: its motion, judged for all t, and the laws that no motion escapes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from tiers import few

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.job.read import job_from_text, load_job
from trajcli.kinematics.robot import Limits
from trajcli.output.report import report_of
from trajcli.peers.path_reference import limit_use, path_reference
from trajcli.planning.plan import plan_job

EXAMPLES = Path(__file__).parents[2] / "examples"

LINE = """
version: 1
robot: {{joints: [{{velocity: 1, acceleration: 2}}, {{velocity: 1, acceleration: 2}}]}}
start: {{joints: [0, 0]}}
moves: [{{planner: time_optimal, {path}, through: {points}}}]
"""


def planned(points, path="path: polyline, corner: 0"):
    return plan_job(job_from_text(LINE.format(points=points, path=path))).moves[0]


def test_a_straight_line_has_the_trapezoid_of_the_textbook():
    # 3 rad at 1 rad/s and 2 rad/s^2: 3 / 1 + 1 / 2 s
    move = planned("[{joints: [3, 1.5]}]")
    other = path_reference(move)
    assert other is not None
    assert other.duration == pytest.approx(3.5, rel=2e-3)
    assert other.duration >= 3.5 - 1e-9
    assert other.use is not None
    assert other.use.used == pytest.approx(1.0, abs=1e-6)
    assert other.use.joint == 0


def test_corners_are_stops():
    # two sides of a square of 3 rad
    other = path_reference(planned("[{joints: [3, 0]}, {joints: [3, 3]}]"))
    assert other is not None
    assert other.duration == pytest.approx(7.0, rel=2e-3)


def test_what_a_curve_uses_is_the_extreme_of_its_derivatives():
    # q = t^3 - t on [-1, 1]: velocity 3 t^2 - 1 from -1 to 2, acceleration 6 t from -6 to 6
    curve = PiecewisePolynomial(np.array([-1.0, 1.0]), np.array([1.0, -3.0, 2.0, 0.0])[:, None, None])
    none = np.array([[-np.inf, np.inf]])

    def use(velocity, acceleration):
        return limit_use(curve, Limits(none, np.array([velocity]), np.array([acceleration]), none))

    fast = use([-2.0, 1.0], [-100.0, 100.0])
    assert fast is not None
    assert (fast.quantity, fast.used) == ("velocity", pytest.approx(2.0))
    assert fast.time in (pytest.approx(0.0), pytest.approx(2.0))
    steep = use([-10.0, 10.0], [-1.0, 100.0])
    assert steep is not None
    assert (steep.quantity, steep.used, steep.time) == (
        "acceleration",
        pytest.approx(6.0),
        pytest.approx(0.0),
    )
    assert use([-np.inf, np.inf], [-np.inf, np.inf]) is None


@pytest.mark.parametrize("name", few(["time_optimal", "recorded", "dispense"], 2))
def test_moves_of_the_examples_are_compared_for_all_t(name):
    plan = plan_job(load_job(EXAMPLES / f"{name}.yaml"))
    compared = [move for move in report_of(plan, reference=True).moves if move.path_reference is not None]
    assert compared
    for move in compared:
        other = move.path_reference
        assert other is not None
        assert other.own_use is not None
        assert other.own_use.used <= 1 + 1e-9  # ours is verified
        assert other.use is not None
        assert other.use.used > 0.99  # an optimal motion uses what there is
        assert other.ratio == pytest.approx(move.duration / other.duration)
        if move.tool is None:
            # toppra may only be faster by what it is over its limits
            assert other.ratio <= max(1.0, other.use.used) ** 0.5 * 1.01


def test_a_move_without_a_path_has_no_such_comparison():
    plan = plan_job(load_job(EXAMPLES / "sync.yaml"))
    assert all(move.path_reference is None for move in report_of(plan, reference=True).moves)
    assert path_reference(plan.moves[0]) is None


def test_a_joint_without_limits_and_a_start_in_motion():
    text = """
version: 1
robot: {joints: [{velocity: 1, acceleration: 2}, {acceleration: 9}]}
start: {joints: [0, 0], velocity: [0.5, 0.5]}
moves: [{planner: time_optimal, through: [{joints: [1, 1]}, {joints: [2, 1.5]}, {joints: [3, 3]}], rule: clamped}]
"""
    move = plan_job(job_from_text(text)).moves[0]
    other = path_reference(move)
    assert other is not None
    assert other.duration == pytest.approx(move.duration, rel=0.02)


def test_a_refusal_of_toppra_is_said(monkeypatch):
    import toppra.algorithm

    def refuse(self, *speeds):
        return None, None, None

    monkeypatch.setattr(toppra.algorithm.TOPPRA, "compute_parameterization", refuse)
    plan = plan_job(load_job(EXAMPLES / "time_optimal.yaml"))
    other = report_of(plan, reference=True).moves[0].path_reference
    assert other is not None
    assert other.duration is None
    assert other.reason == "toppra finds no motion along the path"


def test_the_command_prints_both(capfd):
    from trajcli.cli.gate import run_plan
    from trajcli.cli.job_commands import PlanCommand

    run_plan(PlanCommand(job=str(EXAMPLES / "time_optimal.yaml"), reference=True, no_output=True))
    err = capfd.readouterr().err
    assert "x toppra along the same path (1.3" in err
    assert "most used of a limit: 100 % (acceleration of" in err
