"""Motions with free knots: their derivatives against differences, and their states against their limits."""

from __future__ import annotations

import numpy as np
import pytest

from trajcli.planners.fastest_through_points.free_knots.knot_motion import (
    Change,
    KnotMotion,
    Walk,
)
from trajcli.planners.fastest_through_points.free_knots.knot_slopes import Slopes
from trajcli.planners.fastest_through_points.problem import WaypointProblem
from trajcli.planners.fastest_through_points.search import knot_problem, states_by_free_knots
from trajcli.planners.fastest_through_points.states import within_position_limits

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
    forces, pull = rng.normal(size=walk.room.shape), rng.normal(size=walk.landing.shape)
    step = 1e-4
    after, before = (at(knots, motion, change, sign * step) for sign in (1, -1))
    assert slopes.apply(change) == pytest.approx((after.room - before.room) / (2 * step), abs=1e-5)
    local = change.local()
    landing = (slopes.rows[:, :, -2:] @ local[..., None])[..., 0]
    assert landing == pytest.approx((after.landing - before.landing) / (2 * step), abs=1e-5)
    first = float((slopes.adjoint(forces, pull) * local).sum())
    assert first == pytest.approx(float((forces * slopes.apply(change)).sum() + (pull * landing).sum()))
    square = float((local[..., None, :] @ slopes.stiffness(np.abs(forces)) @ local[..., None]).sum())
    assert square == pytest.approx(float((np.abs(forces) * slopes.apply(change) ** 2).sum()))
    second = float((local[..., None, :] @ slopes.bending(forces, pull) @ local[..., None]).sum())
    values = [
        float((forces * each.room).sum() + (pull * each.landing).sum()) for each in (after, walk, before)
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
