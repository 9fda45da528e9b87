"""Velocities and accelerations at points: what they lead to, against ruckig, and how near to the fastest they come."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import pairwise, product

import numpy as np
import pytest
from point_problems import JERK, by_ruckig, problem, times_of, with_states
from tiers import few

from trajcli.planners.fastest_through_points import search as fastest_search
from trajcli.planners.fastest_through_points.problem import WaypointProblem
from trajcli.planners.fastest_through_points.search import (
    _STARTS,
    Found,
    knot_problem,
    search,
    states_by_free_knots,
)
from trajcli.planners.fastest_through_points.states import (
    StateMotion,
    evaluated,
    improved,
    within_position_limits,
)


def walled(given: WaypointProblem, motion: StateMotion) -> bool:
    """Return whether ruckig's motions between the states stay within the position limits."""
    low, high = given.position[:, 0] - 1e-6, given.position[:, 1] + 1e-6
    for (k, least), joint in [(pair, j) for pair in enumerate(motion.times) for j in range(given.joints)]:
        made = by_ruckig(given, k, joint, motion.states, float(least))
        q = [made.at_time(t)[0][0] for t in np.linspace(0.0, made.duration, 501)]
        if min(q) < low[joint] or max(q) > high[joint]:
            return False
    return True


def test_states_beyond_limits_are_moved_inside() -> None:
    given = problem([0.0, 0.4, 1.0, 0.2])
    motion = evaluated(given, with_states(given, [9.0, -40.0]))
    speed, change = motion.states[1:-1, :, 0], motion.states[1:-1, :, 1]
    assert (np.abs(speed + change * np.abs(change) / (2 * JERK)) <= 1.5).all()
    assert (speed >= -1.0).all()
    assert (change >= -3.0).all()
    assert not motion.states[[0, -1]].any()


def test_only_a_segment_that_leaves_position_limits_lasts_for_ever() -> None:
    """The first joint overshoots at the middle of three points, within limits of the second."""
    given = problem([[0, 0], [1, 1], [0.5, 2]], joints=2)
    states = with_states(given, [[0.8, 0.0], [0.8, 0.0]])
    free = evaluated(given, states)
    np.testing.assert_allclose(free.times[0], times_of(given, states)[0], rtol=1e-6)
    narrow = replace(given, position=np.array([[-1.0, 1.05], [-1.0, 3.0]]))
    assert not walled(narrow, free)
    assert np.isfinite(evaluated(narrow, states).times).tolist() == [True, False]
    wide = replace(given, position=np.array([[-1.0, 1.5], [-1.0, 3.0]]))
    np.testing.assert_array_equal(evaluated(wide, states).times, free.times)
    mirrored = replace(given, points=-given.points, velocity=-given.velocity[:, ::-1])
    mirrored = replace(
        mirrored, acceleration=-given.acceleration[:, ::-1], position=-narrow.position[:, ::-1]
    )
    assert np.isfinite(evaluated(mirrored, -states).times).tolist() == [True, False]


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_joints_that_leave_position_limits_are_slowed_at_both_ends_of_the_segment(sign: float) -> None:
    points = sign * np.array([0.0, 1.0, 0.6])
    wide = problem(points, walls=[-2.1, 2.1])
    states = with_states(wide, [sign * 0.7, 0.3])
    np.testing.assert_array_equal(within_position_limits(wide, states).states, evaluated(wide, states).states)
    three = problem(points, walls=sorted([-0.1 * sign, 1.02 * sign]))
    for speed in (0.8, -0.8):  # behind the middle point it goes beyond, or before it
        fast = with_states(three, [sign * speed, 0.0])
        assert not np.isfinite(evaluated(three, fast).duration)
        slowed = within_position_limits(three, fast)
        assert np.isfinite(slowed.duration)
        assert walled(three, slowed)
        assert 0 < slowed.states[1, 0, 0] / (sign * speed) < 1


@cache
def out_and_back(distance: float) -> float:
    """Return the shortest time out and back: at the turn it stops, with the acceleration that suits both best."""
    given, best = problem([0.0, distance, 0.0]), np.inf
    for change in np.linspace(-3.0, 0.0, 601):
        both = [by_ruckig(given, k, 0, with_states(given, [0.0, change])) for k in (0, 1)]
        if all(both):
            best = min(best, sum(each.duration for each in both))
    return best


@pytest.mark.parametrize("slower", few([1.0, 8.0, 0.05], 2))
def test_steps_lead_to_the_fastest_motion_where_that_is_known(slower: float) -> None:
    ahead = problem([0.0, 0.4, 1.0, 1.3], slower)
    whole = by_ruckig(problem([0.0, 1.3], slower), 0, 0, np.zeros((2, 1, 2))).duration
    back = problem([0.0, 0.7, 0.0], slower)
    for given, fastest, near in ((ahead, whole, 0.03), (back, slower * out_and_back(0.7), 2e-4)):
        small = given.scaled()
        begins = evaluated(small, small.stopping())
        found = improved(small, begins)
        unit = given.units[0]
        assert found.duration * unit == pytest.approx(fastest, rel=near)
        assert found.duration < begins.duration
        np.testing.assert_array_equal(evaluated(small, found.states).times, found.times)


@pytest.mark.parametrize("seed", few(range(6), 2))
def test_steps_never_slow_a_motion_and_keep_what_is_given(seed: int) -> None:
    rng = np.random.default_rng(seed)
    given = problem(rng.uniform(-1, 1, (6, 2)), joints=2)
    fixed, states = given.fixed.copy(), given.states.copy()
    fixed[2, 0, 0], states[2, 0, 0] = True, 0.3
    fixed[3, 1, 1], states[3, 1, 1] = True, -0.5
    states[0, :, 0], states[-1, :, 1] = 0.2, 0.4
    given = replace(given, fixed=fixed, states=states).scaled()
    motion = evaluated(given, given.stopping())
    for rounds in (1, 2, 3, 10):
        further = improved(given, motion, rounds=rounds)
        assert further.duration <= motion.duration
        np.testing.assert_array_equal(further.states[given.fixed], given.states[given.fixed])
        motion = further
    assert motion.duration < 0.95 * evaluated(given, given.stopping()).duration
    assert improved(given, motion, rounds=0) is motion


def test_steps_turn_at_a_wall_without_passing_it() -> None:
    given = problem([[0, 0], [1, 0.3], [0.2, 0.9], [0.6, 0.1]], joints=2, walls=[-0.02, 1.02])
    stops = evaluated(given, given.stopping())
    found = improved(given, stops)
    assert found.duration < 0.98 * stops.duration
    assert walled(given, found)
    free = replace(given, position=np.tile([-np.inf, np.inf], (2, 1)))
    assert improved(free, evaluated(free, free.stopping())).duration <= found.duration * (1 + 1e-3)


def test_durations_nearly_as_short_agree() -> None:
    nothing = StateMotion(np.zeros((2, 1, 2)), np.ones(1))
    found = Found(nothing, (1.0, 1.0009, 1.0011, 2.0, np.inf), 3.0)
    assert (found.agreeing(1.0), found.agreeing(1.0003), found.agreeing(2.0)) == (2, 3, 4)


POINTS = np.array([[0.0, 0.1], [0.6, -0.3], [0.2, 0.4], [0.9, 0.5]])


@pytest.mark.parametrize("slower", few([16.0, 1.0, 0.02], 1))
def test_a_search_is_in_seconds_and_its_states_are_those_of_its_times(slower: float) -> None:
    given = problem(POINTS, slower, joints=2)
    found = search(given, 3)
    np.testing.assert_allclose(found.best.times, times_of(given, found.best.states), rtol=1e-4)
    assert found.stopping == pytest.approx(sum(times_of(given, np.zeros_like(given.states))), rel=1e-6)
    assert len(found.durations) == 3
    assert min(found.durations) == pytest.approx(found.best.duration, rel=2e-6)
    assert found.best.duration < 0.95 * found.stopping


def test_a_search_ends_where_a_bound_is_met_and_goes_on_where_it_is_not() -> None:
    given = problem(POINTS, 4.0, joints=2)
    first = search(given, 1)
    assert len(search(given, 3, lower=first.durations[0]).durations) == 1
    further = search(given, 3, lower=first.durations[0] * 0.99)
    assert len(further.durations) == 3
    assert further.best.duration <= first.best.duration * (1 + 1e-6)


def test_a_search_from_a_motion_is_no_slower_than_it_and_has_one_start() -> None:
    given = problem(POINTS, 4.0, joints=2)
    near = search(given, 2).best
    found = search(given, 4, given=near.states)
    assert len(found.durations) == 1
    assert found.best.duration <= near.duration * (1 + 2e-6)


def test_states_of_a_straight_motion_are_the_second_start() -> None:
    given = problem([0.0, 0.4, 1.0, 1.3], 4.0)
    whole = by_ruckig(problem([0.0, 1.3], 4.0), 0, 0, np.zeros((2, 1, 2)))
    times = np.linspace(0.0, whole.duration, 20001)
    rows = np.array([np.ravel(whole.at_time(t)) for t in times])
    at = np.searchsorted(rows[:, 0], [0.4, 1.0])
    states = with_states(given, rows[at][:, None, 1:])
    found = search(given, 2, states)
    assert found.durations[1] == pytest.approx(whole.duration, rel=1e-2)


def test_where_all_is_given_every_start_is_that_motion() -> None:
    given = problem(POINTS, joints=2)
    given = replace(given, fixed=np.ones_like(given.fixed))
    found = search(given, 3)
    assert found.durations == (found.stopping,) * 3
    assert found.best.duration == found.stopping


def test_states_of_free_knots_keep_what_is_given_and_distances_to_walls_are_those_of_points() -> None:
    given = problem(POINTS, joints=2, walls=[-0.5, 1.25])
    fixed, states = given.fixed.copy(), given.states.copy()
    fixed[1, 0, 0], states[1, 0, 0] = True, 0.25
    given = replace(given, fixed=fixed, states=states)
    times = np.array([1.0, 1.0, 1.0])
    assert states_by_free_knots(given, times, 4)[1, 0, 0] == 0.25
    spare = knot_problem(given, times, 4).spare
    assert spare is not None
    size = given.scales[:, 0][:, None]
    np.testing.assert_allclose(spare * size, np.stack([POINTS + 0.5, 1.25 - POINTS], axis=2), rtol=1e-12)
    free = replace(given, position=np.tile([-np.inf, np.inf], (2, 1)))
    assert knot_problem(free, times, 4).spare is None


def test_central_differences_are_those_of_parabolas_at_the_speed_that_is_fastest() -> None:
    """Points of a parabola at uneven times: weighted differences are its derivative, times one of six speeds."""
    t = np.array([0.0, 1.0, 1.7, 3.0])
    given = problem(0.3 * t - 0.05 * t**2)
    begins = StateMotion(given.states, np.diff(t))
    states = _STARTS[3](given, begins, begins)
    slopes = 0.3 - 0.1 * t[1:-1]
    speeds = states[1:-1, 0, 0] / slopes
    assert speeds[0] == pytest.approx(speeds[1], rel=1e-9)
    durations = {
        speed: float(
            np.sum(
                times_of(given, with_states(given, np.stack([speed * slopes, 0 * slopes], axis=1)[:, None]))
            )
        )
        for speed in (0.25, 0.5, 0.75, 1.0, 1.5, 2.0)
    }
    assert speeds[0] == pytest.approx(min(durations, key=durations.__getitem__), rel=1e-9)
    pairs = list(pairwise(t))
    assert len(pairs) == given.segments


def mirrored(given: WaypointProblem) -> WaypointProblem:
    """Return the same problem in the other direction of each joint."""
    limits = (-each[:, ::-1] for each in (given.velocity, given.acceleration, given.position))
    velocity, acceleration, position = limits
    return replace(
        given,
        points=-given.points,
        states=-given.states,
        velocity=velocity,
        acceleration=acceleration,
        position=position,
    )


@pytest.mark.parametrize("seed", few(range(8), 3))
def test_walls_above_count_as_walls_below_of_the_mirrored_problem(seed: int) -> None:
    points = np.random.default_rng(seed).uniform(-1, 1, (5, 2))
    given = problem(points, joints=2)
    walls = np.stack([np.full(2, -np.inf), points.max(axis=0) + 0.01], axis=1)
    given = replace(given, position=walls).scaled()
    durations = []
    for each in (given, mirrored(given)):
        found = improved(each, evaluated(each, each.stopping()))
        assert walled(each, found)
        durations.append(found.duration)
    assert durations[0] == pytest.approx(durations[1], rel=1e-3)


@pytest.mark.parametrize(("seed", "size"), few(list(product(range(8), [0.5, 4.0])), 3))
def test_the_mirrored_problem_lasts_as_long(seed: int, size: float) -> None:
    given = problem(np.random.default_rng(seed).uniform(-size, size, (6, 2)), joints=2).scaled()
    found, other = (improved(each, evaluated(each, each.stopping())) for each in (given, mirrored(given)))
    assert found.duration == pytest.approx(other.duration, rel=1e-3)


def test_a_joint_that_leaves_its_limits_is_slowed_alone_and_in_vain_where_all_is_given() -> None:
    given = problem([[0, 0], [1, 0.4], [0.6, 1.2], [0.1, 1.6]], joints=2)
    given = replace(given, position=np.array([[-0.1, 1.02], [-5.0, 5.0]]))
    states = with_states(given, [[0.8, 0.2], [0.9, 0.3]])
    states[2, 0] = [-0.4, 0.3]
    slowed = within_position_limits(given, states)
    assert np.isfinite(slowed.duration)
    inside = given.inside(states)
    np.testing.assert_array_equal(slowed.states[:, 1], inside[:, 1])
    assert 0 < slowed.states[1, 0, 0] < 0.8
    fixed, stated = given.fixed.copy(), given.states.copy()
    fixed[1, 0, 0], stated[1, 0, 0] = True, 0.8
    hopeless = replace(given, fixed=fixed, states=stated)
    found = within_position_limits(hopeless, states)
    assert np.isinf(found.duration)
    assert improved(hopeless, found) is found
    single = problem([0.0, 1.0])
    motion = evaluated(single, single.stopping())
    assert improved(single, motion) is motion


@pytest.mark.parametrize("first_is_poor", [False, True])
def test_the_best_of_all_starts_is_taken(first_is_poor: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of these starts the first and the third lead to the fastest motion, that of stopping to a slower one."""
    given = problem(np.random.default_rng(7).uniform(-1, 1, (6, 2)), 4.0, joints=2)
    if first_is_poor:
        monkeypatch.setattr(fastest_search, "_STARTS", (_STARTS[1], *_STARTS[1:]))
    found = search(given, 4)
    assert found.durations[-1] > min(found.durations) * 1.001
    assert (found.durations[0] > min(found.durations) * 1.001) is first_is_poor
    assert found.best.duration == pytest.approx(min(found.durations), rel=2e-6)


def test_a_motion_to_begin_with_is_one_of_those_that_are_compared(monkeypatch: pytest.MonkeyPatch) -> None:
    """The search from it leads to the states of stopping, which no step makes as fast as the straight motion."""
    given = problem([0.0, 0.4, 1.0, 1.3], 4.0)
    whole = by_ruckig(problem([0.0, 1.3], 4.0), 0, 0, np.zeros((2, 1, 2)))
    rows = np.array([np.ravel(whole.at_time(t)) for t in np.linspace(0.0, whole.duration, 20001)])
    states = with_states(given, rows[np.searchsorted(rows[:, 0], [0.4, 1.0])][:, None, 1:])
    monkeypatch.setattr(fastest_search, "states_by_free_knots", lambda problem, *_: problem.stopping())
    assert search(given, 1).best.duration > 1.015 * whole.duration
    assert search(given, 1, given=states).best.duration < 1.01 * whole.duration


def test_states_that_are_found_are_rounded() -> None:
    given = problem(POINTS[[0, 1, 2]], 4.0, joints=2)
    small = given.reachable().scaled()
    time, lengths = given.units
    found = search(given, 1).best.states * np.stack([time / lengths, time**2 / lengths], axis=1)
    steps = found[1] / (2.0**-21 * small.scales)
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-6)
    assert np.abs(steps).max() > 1e3
