"""Comparison with toppra along the same path: its motion, judged for all t, and the laws that no motion escapes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from tiers import few

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.job.read import job_from_text, load_job
from trajcli.kinematics.robot import Limits, unlimited
from trajcli.output.report import report_of
from trajcli.peers.geometric_path import GeometricPath
from trajcli.peers.move_reference import path_reference_of
from trajcli.peers.path_reference import LimitBreach, _grid, limit_use, path_reference, reference_along
from trajcli.planning.plan import plan_job

EXAMPLES = Path(__file__).parents[2] / "examples"

LINE = """
version: 1
robot: {{joints: [{{velocity: 1, acceleration: 2}}, {{velocity: 1, acceleration: 2}}]}}
start: {{joints: [0, 0]}}
moves: [{{planner: time_optimal, {path}, through: {points}}}]
"""

TOOL_LINE = """
version: 1
robot: planar2r
limits: {velocity: 3, acceleration: 8}
start: {joints: [0.3, 1.2]}
moves: [{planner: line, to: {joints: [0.9, 0.8]}, law: {shape: time_optimal}}]
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


@pytest.mark.parametrize("length", [2.0**-10, 1.0, 2.0**10])
def test_the_grid_of_a_path_is_as_fine_whatever_its_unit(length):
    """Breaks are points of it; between them they lie evenly, so many to the whole length of a path."""
    breaks = length * np.array([0.0, 0.25, 0.375, 1.0])
    grid = _grid(PiecewisePolynomial(breaks, np.ones((1, 3, 1))), 0.0, length)
    unit = _grid(PiecewisePolynomial(breaks / length, np.ones((1, 3, 1))), 0.0, 1.0)
    assert grid.size == unit.size
    assert grid / length == pytest.approx(unit, abs=1e-12)
    assert set(breaks.tolist()) <= set(grid.tolist())
    steps = np.diff(grid)
    assert steps.max() <= 1.01 * length / 100


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
    from trajcli.cli.job_commands import PlanCommand
    from trajcli.cli.plan import run_plan

    run_plan(PlanCommand(job=str(EXAMPLES / "time_optimal.yaml"), reference=True, no_output=True))
    err = capfd.readouterr().err
    assert "x toppra along the same path (1.3" in err
    assert "most used of a limit: 100 % (acceleration of" in err


def rates(velocity, acceleration):
    both = np.array([-1.0, 1.0])
    of_joints = [np.outer(np.broadcast_to(each, 2), both) for each in (velocity, acceleration)]
    return Limits(unlimited(2).position, *of_joints, unlimited(2).jerk)


def polyline(*points, scale=1.0, stops=(), deviation=0.0):
    """A path of two joints whose s counts `scale` rad each."""
    points = np.array(points, dtype=float)
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1) / scale
    slopes = np.diff(points, axis=0) / lengths[:, None]
    path = PiecewisePolynomial(np.append(0.0, np.cumsum(lengths)), np.stack([slopes, points[:-1]]))
    return GeometricPath(path, np.array(stops, dtype=float), deviation)


@pytest.mark.parametrize("scale", [1.0, 2.0, 0.5])
@pytest.mark.parametrize(
    ("velocity", "acceleration", "first", "last", "expected"),
    [
        (1.0, np.inf, 1.0, 1.0, 3.0),
        (np.inf, 2.0, 0.0, 0.0, 2 * np.sqrt(1.5)),
        (1.0, 2.0, 0.0, 0.0, 3.5),
        (1.0, 2.0, 1.0, 0.0, 3.25),
        (1.0, 2.0, 0.0, 1.0, 3.25),
        (1.0, 2.0, 1.0, 0.5, 3.0 + 0.25**2),
        (1.0, 2.0, -1.0, 0.0, 3.5),
    ],
)
def test_a_line_from_one_speed_to_another_is_the_trapezoid(
    velocity, acceleration, first, last, expected, scale
):
    """Over 3 rad; a velocity against the path counts as none."""
    along = polyline([0, 0], [3, 0], scale=scale, deviation=0.25)
    velocities = np.array([first, 0.0]), np.array([last, 0.0])
    found = reference_along(along, rates(velocity, acceleration), velocities)
    assert found is not None
    assert found.duration == pytest.approx(expected, rel=3e-3)
    assert found.deviation == 0.25
    resting = reference_along(along, rates(velocity, acceleration))
    assert resting is not None
    # without a limit of acceleration toppra's grid takes an interval to start, and one to stop
    exact = 3.5 if velocity + acceleration < 9 else expected
    assert resting.duration == pytest.approx(exact, rel=3e-3 if np.isfinite(acceleration) else 3e-2)


def test_nothing_is_compared_where_nothing_is_limited():
    assert reference_along(polyline([0, 0], [3, 0]), rates(np.inf, np.inf)) is None


def test_between_the_ends_every_corner_is_a_stop():
    """Three sides of 3, 2 and 3 rad from 1 rad/s to 1 rad/s: 3.25, 2.5 and 3.25 s; ends named as stops are none."""
    along = polyline([0, 0], [3, 0], [3, 2], [0, 2], stops=[0.0, 3.0, 5.0, 8.0])
    moving = np.array([1.0, 0.0]), np.array([-1.0, 0.0])
    found = reference_along(along, rates(1.0, 2.0), moving)
    assert found is not None
    assert found.duration == pytest.approx(3.25 + 2.5 + 3.25, rel=3e-3)


def test_a_range_that_the_path_leaves_is_broken():
    limits = rates(1.0, 2.0)
    limits = Limits(np.array([[-9.0, 9.0], [-9.0, 1.5]]), limits.velocity, limits.acceleration, limits.jerk)
    found = reference_along(polyline([0, 0], [0, 2]), limits)
    assert found is not None
    (breach,) = [each for each in found.breaches if each.order == 0]
    assert breach == LimitBreach(0, 1, pytest.approx(2.0), 1.5, pytest.approx(found.duration))


def test_where_the_path_rests_toppra_begins_at_rest():
    """A clamped spline has q' = 0 at both ends, and any sd is rest there."""
    text = LINE.format(
        points="[{joints: [1, 0.3]}, {joints: [2, -0.2]}, {joints: [3, 0.4]}]", path="rule: clamped"
    )
    move = plan_job(job_from_text(text)).moves[0]
    found = path_reference(move)
    assert found is not None
    assert found.duration == pytest.approx(move.duration, rel=0.05)


def test_a_spline_that_begins_and_ends_in_motion_is_compared_with_such_a_motion():
    """At the limit of 1 rad/s all the way: 3 s; from rest to rest it would be 3.5 s."""
    text = """
version: 1
robot: {joints: [{velocity: 1, acceleration: 2}]}
start: {joints: [0], velocity: [1]}
moves: [{planner: spline, rule: clamped, through: [{joints: [1.5], time: 1.5}], to: {joints: [3], time: 3, velocity: [1]}}]
"""
    (move,) = plan_job(job_from_text(text)).moves
    found = path_reference_of(move)
    assert found is not None
    assert found.duration == pytest.approx(3.0, rel=1e-3)
    assert found.deviation_unit == "rad"


def test_a_tool_path_is_compared_and_joints_of_two_kinds_have_no_unit_of_deviation():
    (move,) = plan_job(job_from_text(TOOL_LINE)).moves
    assert path_reference_of(move) is not None
    mixed = """
version: 1
robot: {joints: [{velocity: 1, acceleration: 2}, {type: prismatic, velocity: 1, acceleration: 2}]}
start: {joints: [0, 0]}
moves: [{planner: spline, through: [{joints: [1, 0.2], time: 2}, {joints: [2, 0.1], time: 4}]}]
"""
    (move,) = plan_job(job_from_text(mixed)).moves
    found = path_reference_of(move)
    assert found is not None
    assert found.deviation_unit == ""
