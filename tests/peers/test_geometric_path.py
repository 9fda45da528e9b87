"""Geometric path of a motion: lengths and corners of the textbook, and toppra's durations along it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import trajcli
from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.kinematics.robot import Limits
from trajcli.peers.geometric_path import path_of_curve, path_of_points
from trajcli.peers.path_reference import breaches_of, path_reference, reference_along


def limits(velocity: float, acceleration: float, joints: int) -> Limits:
    free = np.tile([-np.inf, np.inf], (joints, 1))
    return Limits(
        free,
        np.tile([-velocity, velocity], (joints, 1)),
        np.tile([-acceleration, acceleration], (joints, 1)),
        free,
    )


def planned(move: dict, joints: int = 2, **more: object) -> trajcli.Plan:
    return trajcli.plan(
        {
            "version": 1,
            "robot": {"joints": joints},
            "limits": {"velocity": 1, "acceleration": 2},
            "start": {"joints": [0] * joints},
            "moves": [move],
            **more,
        }
    )


def test_a_straight_line_has_the_trapezoid_of_the_textbook() -> None:
    """Whatever its law: 3 rad at 1 rad/s and 2 rad/s^2 take 3 / 1 + 1 / 2 s."""
    for move in ({"planner": "quintic"}, {"planner": "trapezoid", "duration": 7}, {"planner": "cubic"}):
        plan = planned({**move, "to": {"joints": [3, 1.5]}})
        path = path_of_curve(plan.trajectory.curve)
        assert path is not None
        assert path.path.end == pytest.approx(np.hypot(3, 1.5), rel=1e-12)
        assert path.stops.size == 0
        assert path.deviation < 1e-12
        other = reference_along(path, plan.moves[0].robot.limits)
        assert other is not None
        assert other.duration == pytest.approx(3.5, rel=2e-3)


def test_a_motion_that_turns_back_stops_there() -> None:
    points = [{"joints": [3, 0], "time": 4}, {"joints": [0, 0], "time": 9}]
    plan = planned({"planner": "spline", "rule": "shape_preserving", "through": points})
    path = path_of_curve(plan.trajectory.curve)
    assert path is not None
    assert path.path.end == pytest.approx(6, rel=1e-4)
    assert path.stops == pytest.approx([3.0], abs=1e-3)
    other = reference_along(path, plan.moves[0].robot.limits)
    assert other is not None
    assert other.duration == pytest.approx(7.0, rel=2e-3)


def test_a_circle() -> None:
    u = np.linspace(0, 2 * np.pi, 5000)
    path = path_of_points(np.stack([np.cos(u), np.sin(u)], axis=1))
    assert path is not None
    assert path.path.end == pytest.approx(2 * np.pi, rel=2e-4)  # chords
    assert path.stops.size == 0
    assert path.deviation <= 1e-6
    s = np.linspace(0, path.path.end, 3000)
    assert np.abs(np.linalg.norm(path.path.evaluate(s), axis=1) - 1).max() <= 2e-6


def test_a_motion_from_which_nothing_moves() -> None:
    assert path_of_points(np.zeros((50, 3))) is None
    assert path_of_points(np.zeros((1, 3))) is None


def test_rests_and_doubled_points_do_not_count() -> None:
    u = np.concatenate([np.zeros(100), np.linspace(0, 1, 400), np.full(100, 1.0), np.linspace(1, 2, 400)])
    path = path_of_points(np.stack([u, u**2], axis=1))
    alone = np.unique(u)
    other = path_of_points(np.stack([alone, alone**2], axis=1))
    assert path is not None
    assert other is not None
    assert path.path.end == pytest.approx(other.path.end, rel=1e-9)
    assert path.stops.size == 0


def test_the_path_of_a_time_optimal_move_is_its_own() -> None:
    """toppra along the polynomial that was planned on, and along the path that is found from the motion."""
    plan = planned(
        {
            "planner": "time_optimal",
            "through": [{"joints": [1, 0.5]}, {"joints": [1.5, -0.5]}, {"joints": [0, 1]}],
        }
    )
    exact = path_reference(plan.moves[0])
    path = path_of_curve(plan.moves[0].planned.curve)
    assert exact is not None
    assert path is not None
    found = reference_along(path, plan.moves[0].robot.limits)
    assert found is not None
    assert path.deviation < 1e-6
    assert found.duration == pytest.approx(exact.duration, rel=1e-2)


def test_ends_in_motion_count() -> None:
    """From 1 rad/s to 1 rad/s over 3 rad: at the limit all the way."""
    path = path_of_points(np.linspace([0.0, 0.0], [3.0, 0.0], 300))
    assert path is not None
    moving = np.array([1.0, 0.0])
    other = reference_along(path, limits(1, 2, 2), (moving, moving))
    assert other is not None
    assert other.duration == pytest.approx(3.0, rel=1e-3)


def test_breaches_are_the_extremes_of_the_polynomials() -> None:
    # q = t^3 - t on [-1, 1]: velocity 3 t^2 - 1 from -1 to 2, acceleration 6 t from -6 to 6, jerk 6
    curve = PiecewisePolynomial(np.array([-1.0, 1.0]), np.array([1.0, -3.0, 2.0, 0.0])[:, None, None])
    free = np.array([[-np.inf, np.inf]])
    bounds = Limits(free, np.array([[-0.5, 1.9]]), np.array([[-5.0, 7.0]]), np.array([[-1.0, 5.9]]))
    found = breaches_of(curve, bounds, (0, 1, 2, 3))
    assert [(one.order, one.value, one.limit) for one in found] == [
        (1, pytest.approx(-1.0), -0.5),
        (2, pytest.approx(-6.0), -5.0),
        (3, pytest.approx(6.0), 5.9),
    ]
    assert [one.time for one in found[:2]] == [pytest.approx(1.0), pytest.approx(0.0)]
    wide = Limits(free, np.array([[-1.0, 2.0]]), np.array([[-6.0, 6.0]]), np.array([[-6.0, 6.0]]))
    assert breaches_of(curve, wide, (0, 1, 2, 3)) == ()


@pytest.mark.parametrize(("turn", "corner"), [(50.0, False), (70.0, True), (-70.0, True), (180.0, True)])
def test_a_corner_is_where_the_path_turns_by_more_than_sixty_degrees(turn: float, corner: bool) -> None:
    """Two sides of 1 and 2 rad, each of even steps: every point is one of the path, also that of the corner."""
    angle = np.deg2rad(turn)
    first = np.linspace(0, 1, 101)[:, None] * [1.0, 0.0]
    second = first[-1] + np.linspace(0, 2, 201)[1:, None] * [np.cos(angle), np.sin(angle)]
    path = path_of_points(np.concatenate([first, second]))
    assert path is not None
    assert path.stops.tolist() == (pytest.approx([1.0], rel=1e-12) if corner else [])
    if corner:
        assert path.path.end == pytest.approx(3.0, rel=1e-12)
        assert path.deviation < 1e-12
        np.testing.assert_allclose(path.path.evaluate(1.0 - 1e-9), [1, 0], atol=2e-9)


def test_the_deviation_is_the_largest_distance_of_all_parts_however_joint_space_is_turned() -> None:
    """Waves too fine for 1024 knots are missed; a straight line behind their corner is not."""
    x = np.linspace(0, 1, 8001)
    waves = np.stack([x, 2e-4 * np.sin(2000 * x), 0 * x], axis=1)
    sides = np.concatenate([waves, waves[-1] + np.linspace(0, 1, 1001)[1:, None] * [-0.1, 1.0, 0.0]])
    path = path_of_points(sides)
    assert path is not None
    assert path.stops.size == 1
    assert 1e-5 < path.deviation < 4e-4
    turned = path_of_points(sides @ Rotation.from_rotvec([0.5, -0.4, 0.8]).as_matrix().T)
    assert turned is not None
    assert turned.deviation == pytest.approx(path.deviation, rel=1e-6)
    fewer = path_of_points(np.stack([x, 1e-2 * np.sin(60 * x)], axis=1))
    assert fewer is not None
    assert fewer.deviation < 1e-6
    assert 64 < fewer.path.pieces < 600


def test_points_along_the_path_at_other_distances_deviate_by_nothing() -> None:
    """A straight line whose points crowd at its beginning: none is beside it, though knots lie elsewhere."""
    s = np.linspace(0, 1, 5000) ** 3
    path = path_of_points(s[:, None] * [3.0, 4.0])
    assert path is not None
    assert path.deviation < 1e-12
    assert path.path.end == pytest.approx(5.0, rel=1e-12)
    np.testing.assert_allclose(path.path.evaluate(np.array([0.0, 5.0])), [[0, 0], [3, 4]], atol=1e-12)


def test_what_is_shorter_than_a_billionth_is_no_motion() -> None:
    line = np.linspace(0, 1, 20)[:, None]
    assert path_of_points(0.9e-9 * line) is None
    assert path_of_points(1e-6 * line) is not None
