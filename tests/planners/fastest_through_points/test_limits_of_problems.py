"""Waypoint problems: states inside their limits, limits that motions reach, units, and fewer of the points."""

from __future__ import annotations

import numpy as np
import pytest

from trajcli.planners.fastest_through_points.problem import WaypointProblem
from trajcli.planners.fastest_through_points.segment_motion import exact_motion

VELOCITY, ACCELERATION = np.array([[-1.0, 2.0], [-1.5, 0.5]]), np.array([[-3.0, 8.0], [-4.0, 2.0]])
JERK = np.array([20.0, 10.0])


def problem_of(points, fixed=None, states=None, **changes) -> WaypointProblem:
    """Return a problem of two joints, at rest at both ends."""
    points = np.asarray(points, dtype=float)
    shape = (*points.shape, 2)
    ends = np.zeros(shape, dtype=bool)
    ends[[0, -1]] = True
    fields = {
        "velocity": VELOCITY,
        "acceleration": ACCELERATION,
        "jerk": JERK,
        "states": np.zeros(shape) if states is None else states,
        "fixed": ends if fixed is None else fixed,
        "least": np.zeros(len(points) - 1),
        "position": np.tile([-np.inf, np.inf], (2, 1)),
    }
    return WaypointProblem(points=points, **{**fields, **changes})


def test_what_a_problem_says_of_itself() -> None:
    problem = problem_of([[0, 0], [1, -0.5], [1.5, 2]])
    assert (problem.segments, problem.joints, problem.walled) == (2, 2, False)
    np.testing.assert_array_equal(problem.scales, [[1.5, 5.5], [1.0, 3.0]])
    for joint in range(2):
        for side, bound in enumerate((-9.0, 9.0)):
            walls = problem.position.copy()
            walls[joint, side] = bound
            assert problem_of(problem.points, position=walls).walled


@pytest.mark.parametrize("seed", range(4))
def test_states_that_are_moved_inside_can_be_built_up_and_taken_back(seed: int) -> None:
    """Before and behind an acceleration the velocity keeps its bounds, whatever the states were."""
    rng = np.random.default_rng(seed)
    problem = problem_of(rng.normal(size=(60, 2)))
    states = problem.inside(rng.normal(size=(60, 2, 2)) * [3.0, 10.0])
    np.testing.assert_array_equal(states[[0, -1]], 0.0)
    velocity, bent = states[1:-1, :, 0], states[1:-1, :, 1]
    used = bent**2 / (2 * JERK)
    for bounds, low, high in ((VELOCITY, velocity - used, velocity + used), (ACCELERATION, bent, bent)):
        # ruckig finds no motion from states on the edge
        assert (high < bounds[:, 1] * (1 - 1e-7)).all()
        assert (low > bounds[:, 0] * (1 - 1e-7)).all()
    close = np.array([high.max() for high in (velocity + used).T]) / VELOCITY[:, 1]
    assert (close > 0.9999).all()  # and no further inside than they must be
    np.testing.assert_array_equal(problem.inside(0.01 * states), 0.01 * states)
    np.testing.assert_array_equal(problem.stopping(), 0.0)


@pytest.mark.parametrize("given", [0, 1])
def test_what_is_given_at_a_point_is_kept_and_the_other_fits_it(given: int) -> None:
    fixed, states = np.zeros((6, 2, 2), dtype=bool), np.zeros((6, 2, 2))
    fixed[[0, -1]] = True
    fixed[1:-1, :, given] = True
    states[1:-1, :, given] = np.array([[1.9, 0.4], [-0.9, -1.4], [0.5, 0.1], [1.2, 0.3]])
    if given:
        states[1, :, 1] = -3.0, 2.0  # at the limits
    problem = problem_of(np.arange(12.0).reshape(6, 2), fixed, states)
    asked = np.full((6, 2, 2), 30.0)
    found = problem.inside(asked)
    np.testing.assert_array_equal(found[..., given], states[..., given])
    used = found[1:-1, :, 1] ** 2 / (2 * JERK)
    assert (found[1:-1, :, 0] + used <= VELOCITY[:, 1]).all()
    assert (found[1:-1, :, 0] - used >= VELOCITY[:, 0]).all()
    assert (found[2:-1, :, 1 - given] > 0).all()
    start = problem_of(problem.points, fixed, np.where(fixed, 0.25, 0.0)).stopping()
    np.testing.assert_array_equal(start[..., given], 0.25)


CASES = {
    "far": ([[0, 0], [9, 1], [9.5, 1.2]], {}),
    "farther": ([[0, 0], [900, 1]], {}),
    "near, of much jerk": ([[0, 0], [0.01, 0.001]], {"jerk": np.array([1e-3, 10.0])}),
    "one that must last": ([[0, 0], [0.1, 0.1]], {"least": np.array([50.0])}),
    "slow to accelerate": ([[0, 0], [2, 0.1]], {"acceleration": np.array([[-1e-2, 1e-2], [-4.0, 2.0]])}),
}


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("begins", [0.0, 0.9])
def test_limits_that_stand_for_none_become_those_of_the_time_that_stops_take(
    name: str, begins: float
) -> None:
    """The second joint may go at any speed: what it could reach at its acceleration in that time is left."""
    points, changes = CASES[name]
    states = np.zeros((len(points), 2, 2))
    states[0, 0, 0] = begins
    whole = problem_of(points, states=states, **changes)
    motion = exact_motion(whole, whole.stopping(), ("a", "b"))
    duration = motion.duration
    velocity = np.array([VELOCITY[0], [-1e12, 1e12]])
    found = problem_of(points, states=states, **changes, velocity=velocity).reachable()
    time = found.velocity[1, 1] / (0.5 * np.ptp(ACCELERATION[1]))
    assert found.velocity[1, 0] == -found.velocity[1, 1]
    assert duration <= time <= 20 * duration
    rates = motion.curve.evaluate(np.linspace(0.0, duration, 401), 1)[:, 0] * (1 - 1e-12)
    assert VELOCITY[0, 0] <= found.velocity[0, 0] <= rates.min()
    assert rates.max() <= found.velocity[0, 1] <= VELOCITY[0, 1]
    free = problem_of(
        points,
        states=states,
        **{**changes, "acceleration": np.tile([-1e12, 1e12], (2, 1))},
        velocity=np.tile([-1e12, 1e12], (2, 1)),
    ).reachable()
    assert (free.acceleration[:, 1] < 1e6).all()
    assert (free.velocity[:, 1] < 1e7).all()


def test_given_rates_are_within_what_is_reachable() -> None:
    """A start that is faster than a motion from rest would ever be."""
    states = np.zeros((2, 2, 2))
    states[0, 0] = 1e5, 40.0
    limits = np.tile([-1e12, 1e12], (2, 1))
    found = problem_of(
        [[0, 0], [1e-3, 1e-3]], states=states, velocity=limits, acceleration=limits
    ).reachable()
    assert (found.velocity[0, 1], found.acceleration[0, 1]) >= (1e5, 40.0)


def test_a_problem_in_its_units_begins_at_zero_and_has_the_same_motion() -> None:
    points = np.array([[700.0, -0.02], [702.0, -0.01], [701.0, 0.03]])
    problem = problem_of(points, position=np.array([[600.0, 800.0], [-1.0, np.inf]]))
    time, lengths = problem.units
    assert np.log2([time, *lengths]) == pytest.approx(np.round(np.log2([time, *lengths])))
    scaled = problem.scaled()
    np.testing.assert_array_equal(scaled.points[0], 0.0)
    np.testing.assert_allclose(scaled.points * lengths + points[0], points, rtol=1e-15)
    np.testing.assert_allclose(scaled.position * lengths[:, None] + points[0][:, None], problem.position)
    durations = [
        exact_motion(each, each.stopping(), ("a", "b")).duration * unit
        for each, unit in ((problem, 1.0), (scaled, time))
    ]
    assert durations[1] == pytest.approx(durations[0], rel=1e-9)


def test_of_some_of_the_points_the_rest_is_of_the_same_rows() -> None:
    fixed, states = np.zeros((5, 2, 2), dtype=bool), np.arange(20.0).reshape(5, 2, 2)
    fixed[[0, 3, 4]] = True
    points = np.arange(10.0).reshape(5, 2)
    problem = problem_of(points, fixed, states, least=np.array([1.0, 2.0, 4.0, 8.0]))
    some = problem.only([0, 3, 4])
    np.testing.assert_array_equal(some.points, points[[0, 3, 4]])
    np.testing.assert_array_equal(some.states, states[[0, 3, 4]])
    assert some.fixed.all()
    np.testing.assert_array_equal(some.least, [7.0, 8.0])
    assert problem.only(range(5)) is problem
