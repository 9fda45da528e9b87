"""Comparison with peers in reports: what they break, and motions that are too fast to be true."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import trajcli
from trajcli.job.report import ReferenceReport
from trajcli.output.report import report_of
from trajcli.peers import move_reference
from trajcli.peers.lower_bound import LowerBound

JOB: dict[str, Any] = {
    "version": 1,
    "robot": {"joints": [{"position": [-1, 1.05]}]},
    "limits": {"velocity": 1, "acceleration": 2, "jerk": 20},
    "start": {"joints": [0]},
    "moves": [{"planner": "quintic", "to": {"joints": [1]}, "duration": 3}],
}


def test_ruckig_does_not_know_limits_of_position() -> None:
    """From 1 rad/s at 0.9 to rest at 1.0 it must run past 1.0 by about v^2 / 2 a, and return."""
    from trajcli.peers.lower_bound import fastest_duration
    from trajcli.trajectory import State, resting

    robot = trajcli.plan(JOB).loaded.robot
    fast = State(np.array([0.9]), np.array([1.0]), np.zeros(1))
    bound = fastest_duration(fast, resting(np.array([1.0])), robot.limits)
    assert isinstance(bound, LowerBound)
    (breach,) = bound.breaches
    assert (breach.order, breach.joint, breach.limit) == (0, 0, 1.05)
    # 0.1 s of jerk 20 leave 0.9 rad/s after 0.1 - 20 0.1^3 / 6 rad, and 2 rad/s^2 stop that within 0.9^2 / 4
    assert breach.value == pytest.approx(0.9 + 0.1 - 20 * 0.1**3 / 6 + 0.9**2 / 4, abs=1e-9)
    gentle = fastest_duration(resting(np.array([0.0])), resting(np.array([1.0])), robot.limits)
    assert isinstance(gentle, LowerBound)
    assert gentle.breaches == ()


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_of_several_joints_those_are_named_that_pass_a_limit(side: float) -> None:
    """The second one is as above, one way or the other; the third one runs past by less; the others rest or are slow."""
    from trajcli.kinematics.robot import unlimited
    from trajcli.peers.lower_bound import fastest_duration
    from trajcli.trajectory import State

    fast, ones = np.array([0.0, 1.0, 1.0, 0.0]), np.ones(4)
    both = np.array([-1.0, 1.0])
    position = np.sort(side * np.array([[-1.05, 1.05]]) * ones[:, None], axis=1)
    position[2] = np.sort(side * np.array([-1.05, 1.6]))
    bounds = (both * size * ones[:, None] for size in (1.0, 2.0, 20.0))
    limits = replace(unlimited(4), **dict(zip(("velocity", "acceleration", "jerk"), bounds, strict=True)))
    start = State(side * np.array([0.0, 0.9, 0.9, 0.5]), side * fast, np.zeros(4))
    end = State(side * np.array([0.5, 1.0, 1.0, 0.5]), np.zeros(4), np.zeros(4))
    bound = fastest_duration(start, end, replace(limits, position=position))
    assert isinstance(bound, LowerBound)
    (breach,) = bound.breaches
    assert (breach.order, breach.joint, breach.limit) == (0, 1, side * 1.05)
    assert side * breach.value == pytest.approx(0.9 + 0.1 - 20 * 0.1**3 / 6 + 0.9**2 / 4, abs=1e-9)


def test_a_bound_from_below_is_the_closed_form() -> None:
    report = report_of(trajcli.plan(JOB), reference=True)
    reference = report.moves[0].reference
    assert reference is not None
    # D/v + v/a + a/j
    assert reference.duration == pytest.approx(1 + 0.5 + 0.1, rel=1e-9)
    assert reference.ratio == pytest.approx(3 / 1.6, rel=1e-9)
    assert report.verdict == "verified"
    assert report.moves[0].path_reference is None


def test_all_moves_along_a_path_have_toppra_beside_them() -> None:
    points = [{"joints": [0.5], "time": 1}, {"joints": [1], "time": 2}]
    job = {**JOB, "moves": [{"planner": "spline", "through": points}]}
    report = report_of(trajcli.plan(job), peers=True)
    beside = report.moves[0].path_reference
    assert beside is not None
    # along a line toppra knows no jerk: D/v + v/a
    assert beside.duration == pytest.approx(1.5, rel=2e-3)
    assert beside.ratio == pytest.approx(2 / 1.5, rel=2e-3)
    assert report_of(trajcli.plan(job), reference=True).moves[0].path_reference is None


def test_what_toppra_breaks_is_judged_for_all_t() -> None:
    """A path of many points: between its grid points toppra is over the limit, as dense samples show."""
    points = [[0.3, 0.2], [0.7, -0.1], [0.2, 0.6], [-0.4, 0.1], [0.5, 0.5]]
    job = {
        "version": 1,
        "robot": {"joints": 2},
        "limits": {"velocity": 1, "acceleration": 2},
        "start": {"joints": [0, 0]},
        "moves": [{"planner": "time_optimal", "through": [{"joints": q} for q in points]}],
    }
    plan = trajcli.plan(job)
    beside = report_of(plan, peers=True).moves[0].path_reference
    assert beside is not None
    from trajcli.peers.path_reference import path_reference

    other = path_reference(plan.moves[0])
    assert other is not None
    assert len(beside.violations) == len(other.breaches)
    for one in beside.violations:
        assert abs(one.value) > abs(one.limit)
        assert one.unit == {"velocity": "rad/s", "acceleration": "rad/s^2", "position": "rad"}[one.quantity]
    most = max((abs(one.value / one.limit) for one in beside.violations), default=1.0)
    assert beside.use is not None
    assert most == pytest.approx(max(beside.use.used, 1.0), rel=1e-9)


@pytest.fixture
def slow_ruckig(monkeypatch: pytest.MonkeyPatch) -> None:
    """A ruckig that takes twice as long as it needs: no bound at all."""
    right = move_reference.fastest_duration

    def wrong(*arguments: Any) -> Any:
        bound = right(*arguments)
        return LowerBound(2 * bound.duration, bound.joint) if isinstance(bound, LowerBound) else bound

    monkeypatch.setattr(move_reference, "fastest_duration", wrong)


@pytest.mark.usefixtures("slow_ruckig")
def test_a_motion_faster_than_its_bound_is_an_error(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    from trajcli.cli.app import app

    report = report_of(trajcli.plan(JOB), reference=True)
    (finding,) = report.findings
    assert report.verdict == "violated"
    assert (finding.kind, finding.move, finding.joint, finding.unit) == ("reference", 0, "j1", "s")
    assert (finding.value, finding.limit) == (3.0, pytest.approx(3.2))
    job, rows = tmp_path / "job.json", tmp_path / "rows.csv"
    job.write_text(json.dumps(JOB))
    with pytest.raises(SystemExit) as left:
        app(["plan", str(job), "--reference", "-o", str(rows)])
    assert left.value.code == 1
    assert not rows.exists()
    assert "ruckig finds no motion of j1 between its ends" in capfd.readouterr().err
    with pytest.raises(SystemExit) as left:
        app(["plan", str(job), "-o", str(rows)])
    assert (left.value.code or 0) == 0


def test_what_rounding_leaves_below_a_bound_is_none() -> None:
    assert not move_reference.is_faster(1.0, 1.0 + 1e-7)
    assert move_reference.is_faster(1.0, 1.0 + 1e-5)
    plan = trajcli.plan(JOB)
    span = plan.trajectory.spans[0]
    bound = ReferenceReport(duration=span.duration * (1 + 1e-7), ratio=1.0, joint="j1")
    assert move_reference.contradictions_of([span], [bound]) == []
    assert move_reference.contradictions_of([span], [None]) == []


@pytest.mark.parametrize("duration", [0.5, 0.9, 3.0])
def test_a_ratio_is_told_for_bounds_of_any_length(duration: float) -> None:
    robot = trajcli.plan(JOB).loaded.robot
    found = move_reference.bound_report(LowerBound(duration, 0), 2.0, robot)
    assert found.ratio == pytest.approx(2.0 / duration, rel=1e-12)
    assert move_reference.bound_report(LowerBound(0.0, None), 2.0, robot).ratio is None


def test_a_move_that_only_just_stops_is_no_contradiction() -> None:
    """It lasts v / a = 3.788 s; where the last bit of its way is one less, the fastest goes there and back."""
    job = {
        "version": 1,
        "robot": {"joints": [{"velocity": 2, "acceleration": 0.5}]},
        "start": {"joints": [-0.51], "velocity": [1.894]},
        "moves": [{"planner": "trapezoid", "to": {"joints": [3.077235999999999]}}],
    }
    plan = trajcli.plan(job)
    bound = move_reference.reference_of(plan.moves[0])
    assert bound is not None
    assert plan.trajectory.duration == pytest.approx(3.788, rel=1e-12)
    assert bound.duration == pytest.approx(3.788, rel=1e-7)
    assert move_reference.contradictions_of(plan.trajectory.spans, [bound]) == []
