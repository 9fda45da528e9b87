"""Motions with free knots: their derivatives against differences, and their states against their limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import ruckig
from tiers import few

from trajcli.planners.fastest_through_points.free_knots.interior_point import fastest_knots
from trajcli.planners.fastest_through_points.free_knots.knot_motion import (
    Change,
    KnotMotion,
    Walk,
)
from trajcli.planners.fastest_through_points.free_knots.knot_slopes import KnotSystem, Slopes
from trajcli.planners.fastest_through_points.problem import WaypointProblem
from trajcli.planners.fastest_through_points.search import knot_problem, states_by_free_knots
from trajcli.planners.fastest_through_points.states import evaluated, within_position_limits

SEGMENTS, JOINTS, INTERVALS = 4, 3, 5


def waypoint_problem(seed, walled):
    """Return random points, perhaps with position limits near to them; a velocity between them is given."""
    rng = np.random.default_rng(seed)
    points = np.cumsum(rng.normal(0, 0.5, (SEGMENTS + 1, JOINTS)), axis=0)
    high = rng.uniform(0.5, 2.0, (3, JOINTS)) * np.array([[1.5], [6.0], [50.0]])
    states, fixed = np.zeros((SEGMENTS + 1, JOINTS, 2)), np.zeros((SEGMENTS + 1, JOINTS, 2), dtype=bool)
    fixed[[0, -1]] = fixed[2, 0, 0] = True
    beside = 0.1 if walled else np.inf
    position = np.stack([points.min(axis=0) - beside, points.max(axis=0) + beside], axis=1)
    bounds = [np.stack([-0.8 * value, value], axis=1) for value in high[:2]]
    return WaypointProblem(points, *bounds, high[2], states, fixed, np.zeros(SEGMENTS), position)


def random_motion(rng, knots):
    shape = (SEGMENTS + 1, JOINTS, 2)
    ends = np.where(knots.free, rng.normal(size=shape), 0.0)
    bends = rng.normal(size=(SEGMENTS, JOINTS, INTERVALS - 1))
    return KnotMotion(rng.uniform(0.1, 0.5, (SEGMENTS, INTERVALS)), ends, bends)


def random_change(rng, knots):
    ends = np.where(knots.free, rng.normal(size=knots.free.shape), 0.0)
    bends = rng.normal(size=(SEGMENTS, JOINTS, INTERVALS - 1))
    return Change(rng.normal(size=(SEGMENTS, INTERVALS)), ends, bends)


def at(knots, motion, change, part):
    """Return what follows from a motion after a part of a change."""
    bend = knots.bend[:, None]
    ends = motion.ends + part * change.ends * np.concatenate([np.ones_like(bend), bend], axis=1)
    lengths = motion.lengths + part * change.lengths
    return Walk(knots, KnotMotion(lengths, ends, motion.bends + part * bend * change.bends))


@pytest.mark.parametrize("walled", [False, True])
def test_derivatives_are_those_of_differences(walled):
    knots = knot_problem(waypoint_problem(1, walled), np.linspace(1.0, 2.0, SEGMENTS), INTERVALS)
    rng = np.random.default_rng(2)
    motion, change = random_motion(rng, knots), random_change(rng, knots)
    walk = Walk(knots, motion)
    slopes = Slopes(knots, motion, walk)
    forces, pull = rng.normal(size=walk.spare.shape), rng.normal(size=walk.landing.shape)
    step = 1e-4
    after, before = (at(knots, motion, change, sign * step) for sign in (1, -1))
    assert slopes.apply(change) == pytest.approx((after.spare - before.spare) / (2 * step), abs=1e-5)
    local = change.local()
    landing = (slopes.rows[:, :, -2:] @ local[..., None])[..., 0]
    assert landing == pytest.approx((after.landing - before.landing) / (2 * step), abs=1e-5)
    first = float((slopes.adjoint(forces, pull) * local).sum())
    assert first == pytest.approx(float((forces * slopes.apply(change)).sum() + (pull * landing).sum()))
    square = float((local[..., None, :] @ slopes.stiffness(np.abs(forces)) @ local[..., None]).sum())
    assert square == pytest.approx(float((np.abs(forces) * slopes.apply(change) ** 2).sum()))
    second = float((local[..., None, :] @ slopes.bending(forces, pull) @ local[..., None]).sum())
    values = [
        float((forces * each.spare).sum() + (pull * each.landing).sum()) for each in (after, walk, before)
    ]
    assert second == pytest.approx((values[0] - 2 * values[1] + values[2]) / step**2, rel=1e-4)


@pytest.mark.full
@pytest.mark.parametrize("walled", [False, True])
def test_states_lead_to_a_motion_that_is_faster_than_stopping(walled):
    problem = waypoint_problem(3, walled).scaled()
    stopping = within_position_limits(problem, problem.stopping())
    states = states_by_free_knots(problem, 0.6 * stopping.times, 8)
    assert np.array_equal(states[problem.fixed], problem.states[problem.fixed])
    assert within_position_limits(problem, states).duration < 0.9 * stopping.duration


@pytest.mark.parametrize("walled", [False, True])
def test_a_walk_is_the_integral_of_straight_accelerations(walled):
    """Velocities and positions by numpy's own polynomials, interval by interval, and what is left of each limit."""
    knots = knot_problem(waypoint_problem(1, walled), np.linspace(1.0, 2.0, SEGMENTS), INTERVALS)
    knots = replace(knots, least=np.array([0.1, 0.5, 2.0, 0.0]))
    motion = random_motion(np.random.default_rng(5), knots)
    walk = Walk(knots, motion)
    for k, j in np.ndindex(SEGMENTS, JOINTS):
        a = np.concatenate([motion.ends[k, j, 1:], motion.bends[k, j], motion.ends[k + 1, j, 1:]])
        v, p = motion.ends[k, j, 0], 0.0
        low, high = knots.limits[:, 0, j], knots.limits[:, 1, j]
        for i, h in enumerate(motion.lengths[k]):
            jerk = (a[i + 1] - a[i]) / h
            speed = np.poly1d([jerk / 2, a[i], v])
            middle = v + 0.5 * h * a[i]
            p, v = p + speed.integ()(h), speed(h)
            bend = 0.5 * (high[1] - low[1])
            wanted = [v - low[0], high[0] - v, middle - low[0], high[0] - middle]
            wanted += [(a[i + 1] - low[1]) / bend, (high[1] - a[i + 1]) / bend]
            wanted += [h * (1 + jerk / knots.jerk[j]), h * (1 - jerk / knots.jerk[j])]
            if walled:
                wanted += [p + knots.spare[k, j, 0], knots.spare[k, j, 1] - p]
            assert walk.spare[:, k, j, i] == pytest.approx(wanted, abs=1e-12)
        missed = [v - motion.ends[k + 1, j, 0], p - knots.steps[k, j]]
        assert walk.landing[k, j] == pytest.approx(missed, abs=1e-12)
    spare = [*(motion.lengths - knots.shortest).T, motion.lengths.sum(axis=1) - knots.least]
    np.testing.assert_allclose(walk.spare_time.T, spare, atol=1e-12)


def test_a_slowed_motion_has_the_same_positions_later():
    knots = knot_problem(waypoint_problem(1, False), np.linspace(1.0, 2.0, SEGMENTS), INTERVALS)
    motion = random_motion(np.random.default_rng(5), knots)
    fast, slow = Walk(knots, motion), Walk(knots, motion.slowed(1.7))
    assert motion.slowed(1.7).duration == pytest.approx(1.7 * motion.duration)
    np.testing.assert_allclose(slow.positions, fast.positions, atol=1e-12)
    np.testing.assert_allclose(1.7 * slow.speeds, fast.speeds, atol=1e-12)
    np.testing.assert_allclose(1.7**2 * slow.accelerations, fast.accelerations, atol=1e-12)


@pytest.mark.parametrize("walled", [False, True])
def test_columns_of_what_is_given_are_zero(walled):
    knots = knot_problem(waypoint_problem(1, walled), np.linspace(1.0, 2.0, SEGMENTS), INTERVALS)
    rng = np.random.default_rng(6)
    motion = random_motion(rng, knots)
    slopes = Slopes(knots, motion, walk := Walk(knots, motion))
    forces, pull = rng.uniform(0.5, 1.0, walk.spare.shape), rng.normal(size=walk.landing.shape)
    held = ~np.concatenate([knots.free[:-1], knots.free[1:]], axis=2)
    ends = slice(INTERVALS - 1, INTERVALS + 3)
    columns = slopes.adjoint(forces, pull)[..., ends]
    assert not columns[held].any()
    assert columns[~held].all()
    for matrix in (slopes.stiffness(forces), slopes.bending(forces, pull)):
        assert not matrix[..., ends, :][held].any()
        np.testing.assert_allclose(matrix, matrix.swapaxes(2, 3), atol=1e-9)
    assert not slopes.rows.swapaxes(2, 3)[..., ends, :][held].any()


@pytest.mark.parametrize("seed", range(3))
def test_a_step_solves_the_whole_system(seed):
    """Assembled unknown by unknown, with durations that all joints share and states that neighbours share."""
    knots = knot_problem(waypoint_problem(seed, True), np.linspace(1.0, 2.0, SEGMENTS), INTERVALS)
    rng = np.random.default_rng(seed)
    size, own = 2 * INTERVALS + 3, INTERVALS - 1
    half = rng.normal(size=(SEGMENTS, JOINTS, size, size))
    held = ~np.concatenate([knots.free[:-1], knots.free[1:]], axis=2)
    active = np.ones((SEGMENTS, JOINTS, size))
    active[..., own : own + 4] = ~held
    matrix = half @ half.swapaxes(2, 3) * active[..., None] * active[..., None, :]
    landing = rng.normal(size=(SEGMENTS, JOINTS, 2, size)) * active[..., None, :]
    shared = rng.uniform(0.5, 1.0, (SEGMENTS, INTERVALS + 1))
    missed = rng.normal(size=(SEGMENTS, JOINTS, 2))
    columns, lengths = (
        rng.normal(size=(SEGMENTS, JOINTS, size)) * active,
        rng.normal(size=(SEGMENTS, INTERVALS)),
    )
    system = KnotSystem(knots, matrix, landing, shared)
    assert system.factor(1e-9)
    change, pulls = system.solve(missed, columns, lengths)
    assert not change.ends[~knots.free].any()
    local = change.local()
    left = (matrix @ local[..., None])[..., 0] + (landing.swapaxes(2, 3) @ pulls[..., None])[..., 0] - columns
    np.testing.assert_allclose((landing @ local[..., None])[..., 0], missed, atol=1e-4)
    np.testing.assert_allclose(left[..., :own], 0.0, atol=1e-4)
    at_points = np.zeros((SEGMENTS + 1, JOINTS, 2))
    at_points[:-1] += left[..., own : own + 2]
    at_points[1:] += left[..., own + 2 : own + 4]
    np.testing.assert_allclose(at_points[knots.free], 0.0, atol=1e-4)
    h = change.lengths
    of_lengths = (
        left[..., own + 4 :].sum(axis=1) + shared[:, :-1] * h + shared[:, -1:] * h.sum(axis=1)[:, None]
    )
    np.testing.assert_allclose(of_lengths, lengths, atol=1e-4)


@pytest.mark.parametrize("seed", few(range(12), 3))
def test_knots_of_a_straight_way_find_ruckigs_motion(seed):
    """One joint goes on from rest to rest; of a point on its way it passes at the speed that ruckig has there."""
    rng = np.random.default_rng(seed)
    velocity, acceleration, jerk = rng.uniform([0.3, 1.0, 5.0], [2.0, 4.0, 40.0])
    points, fixed = np.array([[0.0], [rng.uniform(0.2, 0.8)], [1.0]]), np.zeros((3, 1, 2), dtype=bool)
    fixed[[0, -1]] = True
    bounds = [np.array([[-limit, limit]]) for limit in (velocity, acceleration)]
    free = np.array([[-np.inf, np.inf]])
    problem = WaypointProblem(
        points, *bounds, np.array([jerk]), np.zeros((3, 1, 2)), fixed, np.zeros(2), free
    )
    given, answer = ruckig.InputParameter(1), ruckig.Trajectory(1)
    given.current_position, given.target_position = [0.0], [1.0]
    given.max_velocity, given.max_acceleration, given.max_jerk = [velocity], [acceleration], [jerk]
    assert ruckig.Ruckig(1).calculate(given, answer) >= 0
    scaled = problem.scaled()
    stopping = evaluated(scaled, scaled.stopping())
    states = states_by_free_knots(scaled, 0.6 * stopping.times, 12)
    found = evaluated(scaled, states).duration * problem.units[0]
    assert answer.duration * (1 - 1e-6) <= found <= 1.0003 * answer.duration


def test_a_segment_lasts_as_long_as_it_must():
    """The first and the last, which could be faster, last what they have to, and no more."""
    problem = replace(waypoint_problem(3, False), least=np.array([3.0, 0.0, 0.0, 2.0])).scaled()
    stopping = evaluated(problem, problem.stopping())
    knots = knot_problem(problem, stopping.times, 8)
    scale = np.stack([problem.scales[:, 0], problem.scales[:, 0] / knots.time], axis=1)
    ends = fastest_knots(knots, 0.6 * stopping.times / knots.time, problem.states / scale)
    given = evaluated(problem, np.where(problem.fixed, problem.states, ends * scale))
    assert (given.times >= problem.least * (1 - 1e-9)).all()
    assert given.times[0] == pytest.approx(problem.least[0], rel=1e-3)
    assert given.times[3] == pytest.approx(problem.least[3], rel=1e-3)
