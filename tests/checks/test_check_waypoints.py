"""Points that a move promises to pass: curves that pass them, and mutants that do not."""

from __future__ import annotations

import numpy as np
import pytest
from motions import between, trajectory

from trajcli.checks.target import check_waypoints
from trajcli.checks.verify import verify
from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.kinematics.robot import Limits
from trajcli.trajectory import Promise, ViaPoints

POINTS = np.array([[0.0, 1.0], [1.0, 1.0], [0.5, -2.0]])  # passed every 2 s
TIMES = np.array([0.0, 2.0, 4.0])


def promise(times=TIMES, points=POINTS, missed=0.0):
    return ViaPoints(
        np.asarray(times), points, np.broadcast_to(np.asarray(missed, dtype=float), points.shape).copy()
    )


def passing():
    return between(*POINTS.tolist())


def mutated(change):
    """Return the curve with other coefficients, which may no longer pass the points."""
    curve = passing()
    coefficients = curve.coefficients.copy()
    change(coefficients)
    return trajectory(PiecewisePolynomial(curve.breaks, coefficients))


def test_a_curve_through_its_points_is_right():
    assert check_waypoints(trajectory(passing()), [promise()]) == []
    assert check_waypoints(trajectory(passing()), [None]) == []


def bump(coefficients):
    coefficients[-1, 1, 0] += 1e-9  # the second piece of joint 1 begins beside its point


def other_way(coefficients):
    coefficients[:-1, 1, 1] *= -1  # the second piece of joint 2 goes up, not down


@pytest.mark.parametrize(
    ("mutant", "joint", "time", "value"), [(bump, "j1", 2.0, 1e-9), (other_way, "j2", 4.0, 6.0)]
)
def test_a_mutant_is_found(mutant, joint, time, value):
    (finding,) = check_waypoints(mutated(mutant), [promise()])
    assert (finding.move, finding.joint, finding.kind, finding.limit) == (0, joint, "waypoint", 0.0)
    assert finding.time == time
    assert finding.value == pytest.approx(value, rel=1e-6)


@pytest.mark.parametrize("times", [[0.0, 2.5, 3.5], [0.0, 2.3, 3.2], [0.0, 2.8, 3.7]])
@pytest.mark.parametrize("together", [1, 2, 100])
def test_too_late_is_not_there(together, times, monkeypatch):
    """The point that is furthest off is named, once for each joint, in whichever block it is."""
    monkeypatch.setattr("trajcli.checks.target._BLOCK", together)
    late = promise(times)
    found = check_waypoints(trajectory(passing()), [late])
    away = np.abs(passing().evaluate(late.times) - POINTS)
    worst = {f"j{k + 1}": (late.times[away[:, k].argmax()], away[:, k].max()) for k in range(2)}
    assert {f.joint: (f.time, f.value) for f in found} == {
        joint: (time, pytest.approx(value)) for joint, (time, value) in worst.items()
    }


@pytest.mark.parametrize("missed", [0.3, 0.0])
def test_a_distance_is_promised_too(missed):
    """A curve that passes its points although it said that it would miss them is wrong, and the other way."""
    beside = POINTS + np.array([[0, 0], [0.3, 0], [0, 0]])
    distance = np.array([[0, 0], [missed, 0], [0, 0]])
    found = check_waypoints(trajectory(passing()), [promise(points=beside, missed=distance)])
    assert [f.joint for f in found] == ([] if missed else ["j1"])
    exact = check_waypoints(trajectory(passing()), [promise(missed=distance)])
    assert [(f.joint, f.value, f.limit) for f in exact] == ([("j1", 0.0, 0.3)] if missed else [])


def test_times_are_those_of_the_move():
    first, second = passing(), between([0.5, -2.0], [2.0, 2.0])
    whole = trajectory(first, second)
    shifted = ViaPoints(np.array([0.0, 2.0]), np.array([[0.5, -2.0], [2.0, 2.0]]), np.zeros((2, 2)))
    assert check_waypoints(whole, [None, shifted]) == []
    wrong = check_waypoints(whole, [promise(), promise()])
    assert {finding.move for finding in wrong} == {1}


@pytest.mark.parametrize("away", [1e6, -1e6])
def test_rounding_is_no_miss(away):
    """A point 1e6 away is met when all but the last digits agree."""
    far = POINTS + away
    curve = trajectory(between(*far.tolist()))
    assert check_waypoints(curve, [promise(points=far * (1 + 2e-16))]) == []
    assert check_waypoints(curve, [promise(points=far + 1e-5)])


def test_a_time_beyond_the_end_by_rounding():
    assert check_waypoints(trajectory(passing()), [promise([0.0, 2.0, 4.0 + 1e-15])]) == []


def test_the_verdict_on_a_plan_holds_it():
    curve = mutated(bump)
    unlimited = Limits(*(np.tile([-np.inf, np.inf], (2, 1)) for _ in range(4)))
    kept = verify(trajectory(passing()), [unlimited], [Promise(promise())])
    assert kept.passed
    broken = verify(curve, [unlimited], [Promise(promise())])
    assert "waypoint" in {finding.kind for finding in broken.findings}


def test_one_promise_for_each_move():
    with pytest.raises(ValueError, match="zip"):
        check_waypoints(trajectory(passing()), [None, None])


def test_a_jump_of_the_next_move_is_not_a_missed_waypoint():
    """The end of a move is judged from its own side."""
    whole = trajectory(passing(), between([0.8, -2.5], [2.0, 2.0]))
    assert check_waypoints(whole, [promise(), None]) == []
    unlimited = Limits(*(np.tile([-np.inf, np.inf], (2, 1)) for _ in range(4)))
    broken = verify(whole, [unlimited] * 2, [Promise(promise()), Promise()])
    assert {(finding.move, finding.kind) for finding in broken.findings} == {(1, "position_jump")}


def test_of_each_move_that_misses_a_point_it_is_said():
    whole = trajectory(passing(), between([0.5, -2.0], [2.0, 2.0]))
    off = ViaPoints(np.array([2.0]), np.array([[2.0, 2.5]]), np.zeros((1, 2)))
    found = check_waypoints(whole, [promise(points=POINTS + np.array([0.0, 0.1])), off])
    assert [(finding.move, finding.joint) for finding in found] == [(0, "j2"), (1, "j2")]


@pytest.mark.parametrize("together", [1, 2, 100])
def test_each_point_has_its_own_distance(together, monkeypatch):
    monkeypatch.setattr("trajcli.checks.target._BLOCK", together)
    missed = np.array([[0.0, 0.3], [0.2, 0.0], [0.0, 0.1]])
    assert check_waypoints(trajectory(passing()), [promise(points=POINTS - missed, missed=missed)]) == []
    (found,) = check_waypoints(
        trajectory(passing()), [promise(points=POINTS - missed, missed=missed[[0, 1, 0]])]
    )
    assert (found.joint, found.time, found.limit) == ("j2", 4.0, 0.3)
