"""How near motions between states come to position limits, against ruckig's own samples of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import ruckig
from numpy.typing import NDArray
from tiers import few

from trajcli.planners.fastest_through_points.position_limits import distances, leaving, with_limits_near
from trajcli.planners.fastest_through_points.problem import WaypointProblem
from trajcli.planners.fastest_through_points.state_times import durations

Values = NDArray[np.float64]


def drawn(seed: int) -> tuple[WaypointProblem, Values, Values]:
    """Return a problem with near position limits, times of its segments, and states at its points."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(-0.5, 0.5, (4, 2)) * [1.0, 3.0]
    low, high = rng.uniform(0.8, 1.5, (2, 2))
    problem = WaypointProblem(
        points,
        np.stack([-low, 2 * high], axis=1) * [[0.5], [1.0]],
        np.stack([-3 * high, 4 * low], axis=1),
        np.array([20.0, 50.0]),
        np.zeros((4, 2, 2)),
        np.zeros((4, 2, 2), dtype=bool),
        np.zeros(3),
        np.stack([points.min(axis=0) - 0.01, points.max(axis=0) + 0.01], axis=1),
    )
    states = 0.98 * problem.inside(rng.uniform(-0.6, 0.6, (4, 2, 2)) * [[1.0, 2.0], [2.0, 2.0]])
    return problem, durations(problem, states) * 1.2, states


def sampled(problem: WaypointProblem, joint: int, ends: Values, duration: float, pair: Values) -> Values:
    """Return the smallest and the largest position of one joint."""
    wanted, answer = ruckig.InputParameter(1), ruckig.Trajectory(1)
    (wanted.min_velocity,), (wanted.max_velocity,) = ([[v]] for v in problem.velocity[joint])
    (wanted.min_acceleration,), (wanted.max_acceleration,) = ([[a]] for a in problem.acceleration[joint])
    wanted.max_jerk, wanted.minimum_duration = [problem.jerk[joint]], duration
    wanted.current_position, wanted.target_position = [ends[0]], [ends[1]]
    wanted.current_velocity, wanted.current_acceleration = [pair[0]], [pair[1]]
    wanted.target_velocity, wanted.target_acceleration = [pair[2]], [pair[3]]
    assert ruckig.Ruckig(1).calculate(wanted, answer) == ruckig.Result.Working
    found = [answer.at_time(t)[0][0] for t in np.linspace(0.0, answer.duration, 2001)]
    return np.array([min(found), max(found)])


@pytest.mark.parametrize("seed", few(range(20), 4))
def test_distances_and_their_slopes(seed: int) -> None:
    problem, times, states = drawn(seed)
    found, compared = distances(problem, times, states), 0
    sizes = 1e-3 * np.concatenate([problem.scales, problem.scales], axis=1)
    for k, j in np.ndindex(*times.shape, 2):
        ends, pair = problem.points[k : k + 2, j], np.concatenate([states[k, j], states[k + 1, j]])
        here = sampled(problem, j, ends, times[k], pair)
        if not np.isfinite(found.distance[k, j]).all():
            assert (np.abs(here - problem.position[j]) > 0.01).all()
            continue
        compared += 1
        distance = [here[0] - problem.position[j, 0], problem.position[j, 1] - here[1]]
        np.testing.assert_allclose(found.distance[k, j], distance, rtol=0, atol=1e-5)
        for c, step in enumerate(np.diag(sizes[j])):
            sides = [sampled(problem, j, ends, times[k], pair + sign * step) for sign in (1, -1)]
            slope = (sides[0] - sides[1]) / 2e-3
            np.testing.assert_allclose(found.slopes[k, j, :, c], slope, rtol=0, atol=0.03)
    assert compared


@pytest.mark.parametrize("seed", few(range(20), 4))
def test_a_joint_leaves_the_limits_that_its_motion_passes(seed: int) -> None:
    problem, times, states = drawn(seed)
    for k, j in np.ndindex(*times.shape, 2):
        pair = np.concatenate([states[k, j], states[k + 1, j]])
        least, most = sampled(problem, j, problem.points[k : k + 2, j], times[k], pair)
        for inside, passed in ((1e-5, False), (-1e-5, True)):
            for side in ([least - inside, 99.0], [-99.0, most + inside]):
                walls = np.array([[-99.0, 99.0]] * 2)
                walls[j] = side
                found = leaving(replace(problem, position=walls), times, states)
                assert bool(found[k, j]) is passed
                assert not found[:, 1 - j].any()


def test_where_there_is_no_motion_nothing_is_said() -> None:
    problem, times, states = drawn(0)
    states[1, 0, 0] = 9.0
    found = distances(problem, times, states)
    assert np.isposinf(found.distance[0, 0]).all()
    assert not found.slopes[0, 0].any()


@pytest.mark.parametrize("velocity", [[-2.0, 1.0], [-1.0, 2.0]])
@pytest.mark.parametrize(("joint", "side"), [(0, 0), (0, 1), (1, 0), (1, 1)])
def test_only_limits_beyond_what_the_fastest_reaches_are_out_of_the_way(
    velocity: list[float], joint: int, side: int
) -> None:
    """In twice 0.1 s and at 2 rad/s a joint goes 0.2 rad beyond its points at most: to and fro."""
    problem, sign = drawn(0)[0], (-1.0, 1.0)[side]
    points = problem.points[[0, 1, 0]]
    problem = replace(problem, points=points, velocity=np.tile(velocity, (2, 1)))
    extreme = (points.min(axis=0), points.max(axis=0))[side][joint]
    for reach, near in ((0.199, True), (0.201, False)):
        walls = np.array([[-np.inf, np.inf]] * 2)
        walls[joint, side] = extreme + sign * reach
        kept = with_limits_near(replace(problem, position=walls), np.array([0.1, 0.02])).position
        assert bool(np.isfinite(kept[joint, side])) is near
        assert not np.isfinite(np.delete(kept.ravel(), 2 * joint + side)).any()
