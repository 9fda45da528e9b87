"""The maximum velocity curve against linear programs, and laws that stay below it."""

from __future__ import annotations

import numpy as np
import pytest
from planned_examples import planned_example
from scipy.optimize import linprog
from tiers import few

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.curves.time_optimal.collocation import IntervalRows
from trajcli.curves.time_optimal.constraints import JointConstraint
from trajcli.curves.time_optimal.passes import largest_in_intervals, maximum_velocity_curve
from trajcli.curves.time_optimal.phase_plane import PhasePlane
from trajcli.job.read import job_from_text
from trajcli.planning.plan import plan_job

JOB = """\
version: 1
units: {{angle: deg}}
robot: {{joints: [{{velocity: 90, acceleration: 400}}, {{velocity: [-50, 70], acceleration: [-300, 200]}}]}}
start: {{joints: [0, 0]}}
moves:
  - {{planner: time_optimal, through: [{{joints: [30, 10]}}, {{joints: [20, 40]}}, {{joints: [60, 30]}}]{more}}}
"""


def plane_of(text: str) -> PhasePlane:
    (move,) = plan_job(job_from_text(text)).moves
    assert move.planned.phase_plane is not None
    return move.planned.phase_plane


def by_linear_program(
    q1: np.ndarray, q2: np.ndarray, velocity: np.ndarray, acceleration: np.ndarray
) -> float:
    """Return the largest x = sd^2 for which some u keeps all limits: scipy, on qd = q' sd, qdd = q' u + q'' x."""
    rows = [[q1, q2], [-q1, -q2]]
    matrix = np.concatenate([np.column_stack(row) for row in rows])
    bounds = np.concatenate([acceleration[:, 1], -acceleration[:, 0]])
    cap = min((v[1] if p > 0 else v[0]) / p for p, v in zip(q1, velocity, strict=True)) ** 2
    answer = linprog([0, -1], matrix, bounds, bounds=[(None, None), (0, cap)])
    assert answer.status == 0
    return float(answer.x[1])


@pytest.mark.parametrize("more", ["", ", rule: natural", ", path: polyline, corner: 3"])
def test_the_curve_is_the_solution_of_a_linear_program_at_each_point(more: str) -> None:
    plane = plane_of(JOB.format(more=more))
    (joints,) = plane.constraints
    assert isinstance(joints, JointConstraint)
    s = np.sort(np.random.default_rng(1).uniform(plane.breaks[0], plane.breaks[-1], 12))
    s = np.concatenate([s, plane.breaks[1:-1]])
    for side in ("left", "right"):
        ours = plane.largest_speed(s, side) ** 2
        q1, q2 = (joints.path.evaluate(s, order, side=side) for order in (1, 2))
        theirs = [
            by_linear_program(*pair, joints.velocity, joints.acceleration)
            for pair in zip(q1, q2, strict=True)
        ]
        np.testing.assert_allclose(ours, theirs, rtol=1e-7)


def test_a_circle_has_the_speed_at_which_its_own_curvature_uses_the_limit() -> None:
    # q = (s, s^2 / 2) at s = 0: u is bounded by |u| <= 3 and |x + 0 u| <= 2, so x <= 2
    path = PiecewisePolynomial([0.0, 1.0], [[[0.0, 0.5]], [[1.0, 0.0]], [[0.0, 0.0]]])
    wide, bounds = np.tile([-9.0, 9.0], (2, 1)), np.array([[-3.0, 3.0], [-2.0, 2.0]])
    law = PiecewisePolynomial([0.0, 1.0], [[[1.0]], [[0.0]]])
    plane = PhasePlane(
        law, (JointConstraint(path, wide, bounds),), np.array([0.0, 1.0]), np.array([]), "ratio"
    )
    assert plane.largest_speed(np.array([0.0])) == pytest.approx([2.0**0.5], rel=1e-12)
    # at s = 1: |u| <= 3 and |u + x| <= 2 leave x <= 5
    assert plane.largest_speed(np.array([1.0])) == pytest.approx([5.0**0.5], rel=1e-12)


def test_each_of_several_constraints_counts_at_many_points() -> None:
    """Joints apart, each a constraint of its own, or all in one: at 600 points the curve is the same."""
    rng = np.random.default_rng(5)
    rows = rng.uniform(-1, 1, (3, 1, 3))
    velocity, acceleration = (np.array([-1.0, 1.0]) * rng.uniform(0.5, 3.0, (3, 2)) for _ in range(2))
    law = PiecewisePolynomial([0.0, 1.0], [[[1.0]], [[0.0]]])
    s = np.linspace(0.0, 1.0, 600)
    found = []
    for groups in ([[0, 1, 2]], [[0], [1], [2]], [[2], [0, 1]]):
        parts = [
            JointConstraint(PiecewisePolynomial([0.0, 1.0], rows[:, :, g]), velocity[g], acceleration[g])
            for g in groups
        ]
        plane = PhasePlane(law, tuple(parts), np.array([0.0, 1.0]), np.array([0.5]), "ratio")
        found.append(plane.largest_speed(s))
    for other in found[1:]:
        np.testing.assert_allclose(other, found[0], rtol=1e-12)
    slopes = PiecewisePolynomial([0.0, 1.0], rows).evaluate(s, 1)
    cap = (np.where(slopes > 0, velocity[:, 1], velocity[:, 0]) / slopes).min(axis=1)
    assert (found[0] <= cap * (1 + 1e-12)).all()
    assert 50 < (found[0] >= cap * (1 - 1e-9)).sum() < 550
    slower = plane.scaled(3.0)
    assert slower.law.duration == pytest.approx(3.0)
    assert (slower.stops.tolist(), slower.breaks.tolist()) == ([0.5], [0.0, 1.0])
    for values in (slower.stops, slower.breaks):
        with pytest.raises(ValueError, match="read-only"):
            values[0] = 7.0


@pytest.mark.parametrize("name", ["time_optimal", "dispense"])
def test_a_law_stays_below_its_curve_and_ends_with_the_move(name: str) -> None:
    planes = [
        (move, move.planned.phase_plane)
        for move in planned_example(name).moves
        if move.planned.phase_plane is not None
    ]
    assert planes
    for move, plane in planes:
        assert plane.law.duration == pytest.approx(move.duration, rel=1e-12)
        states = plane.law.evaluate_orders(plane.law.breaks, (0, 1))[:, :, 0]
        s = np.clip(states[:, 0], plane.breaks[0], plane.breaks[-1])
        top = np.minimum(plane.largest_speed(s, "left"), plane.largest_speed(s))
        assert (states[:, 1] <= top * (1 + 1e-6) + 1e-9).all()
        assert (states[:, 1] / top).max() > 0.9


def test_a_slower_law_keeps_the_curve() -> None:
    fast, slow = plane_of(JOB.format(more="")), plane_of(JOB.format(more=", duration: 5"))
    assert slow.law.duration == pytest.approx(5.0, rel=1e-12)
    s = np.linspace(fast.breaks[0], fast.breaks[-1], 9)
    np.testing.assert_array_equal(fast.largest_speed(s), slow.largest_speed(s))
    shorter = 5.0 / fast.law.duration
    np.testing.assert_allclose(
        slow.law.evaluate(np.array([2.0]), 1) * shorter, fast.law.evaluate(np.array([2.0 / shorter]), 1)
    )


def test_sharp_corners_are_stops_and_units_are_those_of_the_joints() -> None:
    plane = plane_of(JOB.format(more=", path: polyline"))
    assert plane.stops.size == 2
    assert plane.dimension == "angle"
    assert plane_of(JOB.format(more=", parameter: uniform")).dimension == "ratio"


@pytest.mark.parametrize("seed", few(range(4), 2))
def test_room_in_intervals_is_that_of_a_linear_program(seed: int) -> None:
    """Largest x <= cap with P x + R y <= C for some y >= 0, rows without y among them."""
    rng = np.random.default_rng(seed)
    P, R, C = (rng.normal(size=(6, 40)) for _ in range(3))
    R[:, ::3] *= rng.random((6, 14)) > 0.4  # some without y
    R[:, ::5] = np.abs(R[:, ::5])  # y = 0 decides
    C, cap = np.abs(C) + 0.05, rng.uniform(0.1, 9.0, 40)
    cap[::7] = np.inf
    found = largest_in_intervals(P, R, C, cap)
    for k in range(40):
        rows = np.column_stack([P[:, k], R[:, k]])
        answer = linprog([-1, 0], rows, C[:, k], bounds=[(0, cap[k]), (0, None)])
        if answer.status == 3:
            assert found[k] == np.inf
        else:
            assert found[k] == pytest.approx(answer.x[0], rel=1e-7)


@pytest.mark.parametrize("seed", range(4))
def test_what_was_known_of_unchanged_intervals_is_what_they_would_have(seed: int) -> None:
    """Also where a cap is lowered at an end that an unchanged interval shares."""
    rng = np.random.default_rng(seed)
    P, R = rng.normal(size=(2, 6, 30))
    C, cap = rng.uniform(0.05, 1.0, (6, 30)), rng.uniform(0.1, 9.0, 31)
    none, nothing = np.zeros(6, dtype=np.intp), (np.empty((0, 30)),) * 3
    eased, rest = np.ones((1, 31)), (np.zeros(31, dtype=bool), none, none, nothing, nothing)
    before = IntervalRows(np.arange(31.0), P, R, C, C, eased, cap, *rest)
    known = maximum_velocity_curve(before)
    changed = rng.random(30) < 0.3
    lower = C / np.where(changed, 3.0, 1.0)
    caps = cap / np.append(np.where(changed, 2.0, 1.0), 1.0)
    caps[1:] = np.where(changed, np.minimum(caps[1:], cap[1:] / 2.0), caps[1:])
    after = IntervalRows(np.arange(31.0), P, R, lower, C, eased, caps, *rest)
    np.testing.assert_allclose(maximum_velocity_curve(after, known, changed), maximum_velocity_curve(after))
    np.testing.assert_allclose(
        maximum_velocity_curve(after)[:-1], largest_in_intervals(P, R, lower, caps[:-1])
    )


@pytest.mark.parametrize("seed", range(4))
def test_the_last_point_has_the_room_that_its_interval_leaves_for_y(seed: int) -> None:
    """Largest y <= cap with P x + R y <= C for some x >= 0, of the last of two intervals."""
    rng = np.random.default_rng(seed)
    P, R = rng.normal(size=(2, 6, 2))
    C, cap = rng.uniform(0.05, 1.0, (6, 2)), rng.uniform(0.5, 9.0, 3)
    none, nothing = np.zeros(6, dtype=np.intp), (np.empty((0, 2)),) * 3
    eased, turning = np.ones((1, 3)), np.zeros(3, dtype=bool)
    rows = IntervalRows(np.arange(3.0), P, R, C, C, eased, cap, turning, none, none, nothing, nothing)
    answers = [
        linprog(objective, np.column_stack([P[:, k], R[:, k]]), C[:, k], bounds=bounds).x
        @ -np.array(objective)
        for k, objective, bounds in (
            (0, [-1, 0], [(0, cap[0]), (0, None)]),
            (1, [-1, 0], [(0, cap[1]), (0, None)]),
            (1, [0, -1], [(0, None), (0, cap[2])]),
        )
    ]
    np.testing.assert_allclose(maximum_velocity_curve(rows), answers, rtol=1e-7)


def test_intervals_do_not_know_of_each_other() -> None:
    """Of sixty times the same forty intervals each has the room that it has alone."""
    rng = np.random.default_rng(7)
    P, R, C = rng.normal(size=(6, 40)), rng.normal(size=(6, 40)), rng.uniform(0.05, 1.0, (6, 40))
    cap = rng.uniform(0.5, 9.0, 40)
    alone = [largest_in_intervals(P[:, [k]], R[:, [k]], C[:, [k]], cap[[k]])[0] for k in range(40)]
    assert (alone < cap).sum() > 20
    many = largest_in_intervals(*(np.tile(each, 60) for each in (P, R, C, cap)))
    np.testing.assert_array_equal(many, np.tile(alone, 60))


@pytest.mark.parametrize("above", [1e-2, 1e-4, 1e-7, 1e-9])
def test_a_cap_a_little_above_the_room_does_not_hide_it(above: float) -> None:
    """What there is room for without a cap there is with one that is nearly as low."""
    rng = np.random.default_rng(11)
    P, R, C = rng.normal(size=(6, 60)), rng.normal(size=(6, 60)), rng.uniform(0.05, 1.0, (6, 60))
    room = largest_in_intervals(P, R, C, np.full(60, np.inf))
    bounded = np.isfinite(room)
    assert bounded.sum() > 30
    P, R, C, room = P[:, bounded], R[:, bounded], C[:, bounded], room[bounded]
    found = largest_in_intervals(P, R, C, room * (1 + above))
    np.testing.assert_allclose(found, room, rtol=1e-11)
