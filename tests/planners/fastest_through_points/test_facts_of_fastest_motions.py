"""The fastest motion through points and what is said of it: bound, times, stops, and why none is found."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from point_problems import JERK, by_ruckig, problem, times_of
from tiers import few

from trajcli.curves.extrema import peaks
from trajcli.errors import Amount, PlanningError, Problem
from trajcli.planners.fastest_through_points.assembly import (
    FastestMotion,
    _exact,
    _keeps_positions,
    fastest_motion,
    straight_only,
)
from trajcli.planners.fastest_through_points.problem import WaypointProblem
from trajcli.planners.fastest_through_points.search import search
from trajcli.planners.fastest_through_points.segment_motion import PointMotion

NAMES = ["one", "two"]
POINTS = np.array([[0.0, 0.1], [0.6, -0.3], [0.2, 0.4], [0.9, 0.5]])


def from_rest(first: float, last: float, slower: float = 1.0) -> float:
    """Return what ruckig needs between two positions of rest."""
    return float(by_ruckig(problem([first, last], slower), 0, 0, np.zeros((2, 1, 2))).duration)


def given(made: WaypointProblem, point: int, order: int, value: float, joint: int = 0) -> WaypointProblem:
    """Return the problem with a velocity (0) or acceleration (1) of a joint at a point."""
    fixed, states = made.fixed.copy(), made.states.copy()
    fixed[point, joint, order], states[point, joint, order] = True, value
    return replace(made, fixed=fixed, states=states)


def keeps(made: WaypointProblem, found: FastestMotion) -> None:
    """See that a motion passes its points at its times, within its limits."""
    curve, times = found.motion.curve, found.motion.times
    assert (np.diff(times) > 0).all()
    assert (times[0], times[-1]) == (0.0, pytest.approx(curve.end, rel=1e-12))
    np.testing.assert_allclose(curve.evaluate(np.minimum(times, curve.end)), made.points, atol=1e-9)
    bounds = made.position, made.velocity, made.acceleration, np.stack([-made.jerk, made.jerk], axis=1)
    for peak, bound in zip(peaks(curve, (0, 1, 2, 3)), bounds, strict=True):
        assert (peak.high <= bound[:, 1] * (1 + 1e-9) + 1e-9).all()
        assert (peak.low >= bound[:, 0] - np.abs(bound[:, 0]) * 1e-9 - 1e-9).all()


@pytest.mark.parametrize("slower", few([8.0, 1.0, 0.03], 2))
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_one_joint_that_goes_on_is_as_fast_as_its_bound_and_passes_its_points(
    slower: float, sign: float
) -> None:
    points = sign * np.array([0.0, 0.1, 0.5, 0.55, 1.3])
    made = problem(points, slower)
    found = fastest_motion(made, NAMES[: made.joints], 2)
    whole = from_rest(0.0, sign * 1.3, slower)
    assert found.motion.duration == pytest.approx(whole, rel=1e-6)
    assert found.lower == pytest.approx(whole, rel=1e-6)
    assert found.joint == 0
    assert found.stopping == pytest.approx(
        sum(from_rest(a, b, slower) for a, b in pairwise(points)), rel=1e-6
    )
    keeps(made, found)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_points_before_and_behind_a_turn_are_passed_in_their_order(sign: float) -> None:
    made = problem(sign * np.array([0.0, 0.3, 0.8, 0.6, 0.1]))
    found = fastest_motion(made, NAMES[: made.joints], 2)
    keeps(made, found)
    assert found.lower <= found.motion.duration * (1 + 1e-9)
    assert found.motion.duration < 0.9 * found.stopping


@pytest.mark.parametrize(("order", "value"), [(0, 0.2), (1, -0.7)])
def test_what_is_given_at_a_point_where_one_joint_goes_on_is_kept(order: int, value: float) -> None:
    made = given(problem([0.0, 0.5, 1.3]), 1, order, value)
    found = fastest_motion(made, NAMES[: made.joints], 2)
    keeps(made, found)
    at = found.motion.curve.evaluate(found.motion.times[1:2], order + 1)
    assert float(at[0, 0]) == pytest.approx(value, abs=1e-8)
    assert found.motion.duration > from_rest(0.0, 1.3) + 1e-3


@pytest.mark.parametrize("segment", [0, 1, 2])
def test_a_segment_of_one_joint_lasts_as_long_as_it_is_told(segment: int) -> None:
    least = np.zeros(3)
    least[segment] = 2.0
    made = replace(problem([0.0, 0.4, 0.9, 1.3]), least=least)
    found = fastest_motion(made, NAMES[: made.joints], 2)
    keeps(made, found)
    assert np.diff(found.motion.times)[segment] >= 2.0 * (1 - 1e-9)
    assert found.motion.duration < 2.0 + from_rest(0.0, 1.3)


def test_a_motion_from_another_one_is_no_slower() -> None:
    made = problem(POINTS, joints=2)
    first = fastest_motion(made, NAMES[: made.joints], 2)
    keeps(made, first)
    orders = [first.motion.curve.evaluate(first.motion.times, order) for order in (1, 2)]
    again = fastest_motion(made, NAMES[: made.joints], 4, np.stack(orders, axis=2))
    keeps(made, again)
    assert again.motion.duration <= first.motion.duration * (1 + 1e-5)
    assert len(again.found) == 1
    one = problem([0.0, 0.3, 0.8, 0.6, 0.1])
    first = fastest_motion(one, NAMES[:1], 2)
    orders = [first.motion.curve.evaluate(first.motion.times, order) for order in (1, 2)]
    assert len(fastest_motion(one, NAMES[:1], 4, np.stack(orders, axis=2)).found) == 1


def test_how_many_starts_agree_is_counted_and_stops_are_ruckigs() -> None:
    made = problem(np.random.default_rng(7).uniform(-1, 1, (6, 2)), 4.0, joints=2)
    found = fastest_motion(made, NAMES[: made.joints], 4)
    keeps(made, found)
    near = sum(duration <= found.motion.duration * 1.001 for duration in found.found)
    assert (len(found.found), found.agreeing) == (4, near)
    assert near < 4
    assert found.stopping == pytest.approx(sum(times_of(made, np.zeros_like(made.states))), rel=1e-6)
    assert found.lower <= found.motion.duration < found.stopping


def test_collinear_points_are_passed_on_the_straight_line_or_faster() -> None:
    made = problem([[0, 0], [0.2, 0.3], [0.4, 0.6], [0.8, 1.2]], joints=2)
    found = fastest_motion(made, NAMES[: made.joints], 1)
    keeps(made, found)
    whole = max(from_rest(0.0, 0.8), from_rest(0.0, 1.2))
    assert found.motion.duration == pytest.approx(whole, rel=1e-6)


@pytest.mark.parametrize("what", ["start", "between", "stop", "least"])
def test_a_straight_line_is_left_where_more_is_asked_for(what: str) -> None:
    made = problem([[0, 0], [0.2, 0.3], [0.4, 0.6]], joints=2)
    if what == "start":
        made = given(made, 0, 0, 0.3, joint=1)
    elif what in ("between", "stop"):
        made = given(made, 1, 0, 0.1 if what == "between" else 0.0)
    else:
        made = replace(made, least=np.array([0.0, 1.5]))
    found = fastest_motion(made, NAMES[: made.joints], 1)
    keeps(made, found)
    velocity = found.motion.curve.evaluate(found.motion.times, 1)
    if what == "start":
        np.testing.assert_allclose(velocity[0], [0.0, 0.3], atol=1e-9)
    elif what in ("between", "stop"):
        assert float(velocity[1, 0]) == pytest.approx(0.1 if what == "between" else 0.0, abs=1e-8)
    else:
        assert np.diff(found.motion.times)[1] >= 1.5 * (1 - 1e-9)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_walls_on_either_side_are_kept(sign: float) -> None:
    points = sign * np.array([[0, 0], [1, 0.3], [0.2, 0.9], [0.6, 0.1]])
    low, high = points.min(axis=0) - 0.01, points.max(axis=0) + 0.01
    free = problem(points, joints=2)
    (peak,) = peaks(fastest_motion(free, NAMES, 1).motion.curve, (0,))
    assert (peak.high > high).any() or (peak.low < low).any()
    made = replace(free, position=np.stack([low, high], axis=1))
    found = fastest_motion(made, NAMES[: made.joints], 1)
    keeps(made, found)
    assert found.motion.duration < found.stopping


@pytest.mark.parametrize(("joint", "sign"), [(0, -1.0), (1, 1.0)])
def test_the_joint_that_passes_a_limit_in_vain_is_named_with_what_it_reaches(joint: int, sign: float) -> None:
    """Through a point beside its limit with a velocity towards it: it goes on by what braking takes."""
    points = np.array([[0.0, 0.0], [0.1, 0.1], [0.2, 0.2]])
    points[1, joint] = 1.0
    made = given(problem(sign * points, joints=2), 1, 0, sign * 0.8, joint)
    walls = np.array([[-3.0, 3.0]] * 2)
    walls[joint] = sorted([-3.0 * sign, 1.02 * sign])
    made = replace(made, position=walls)
    with pytest.raises(PlanningError) as caught:
        fastest_motion(made, NAMES[: made.joints], 1)
    (refusal,) = caught.value.problems
    assert refusal.joint == NAMES[joint]
    assert "keeps the position limits" in refusal.message
    assert amount(refusal, "limit") == pytest.approx(1.02 * sign)
    speed, change = (1.5, 3.0) if sign > 0 else (1.5, 4.0)
    assert speed > 0.8
    least = 0.8**2 / (2 * change) + 0.8 * change / (2 * JERK)
    assert sign * amount(refusal, "value") > 1.0 + 0.9 * (0.8**2 / (2 * change))
    assert sign * amount(refusal, "value") < 1.0 + 2.0 * least


def amount(refusal: Problem, name: str) -> float:
    found = refusal.amounts[name]
    assert isinstance(found, Amount)
    assert (found.order, found.joint) == (0, NAMES.index(refusal.joint or ""))
    return found.value


def test_what_is_given_beyond_a_limit_is_no_matter_of_position_limits() -> None:
    made = given(problem(POINTS, joints=2), 1, 0, 9.0)
    with pytest.raises(PlanningError, match="with the velocities and accelerations that are given"):
        fastest_motion(made, NAMES[: made.joints], 2)
    walls: Any = np.array([[-5.0, 5.0]] * 2)
    with pytest.raises(PlanningError, match="with the velocities and accelerations that are given"):
        fastest_motion(replace(made, position=walls), NAMES, 2)


@cache
def free_motion(sign: float) -> tuple[WaypointProblem, PointMotion, np.ndarray]:
    """Return a problem, its motion, and dense rows of it."""
    free = problem(sign * POINTS, joints=2)
    motion = fastest_motion(free, NAMES, 1).motion
    return free, motion, motion.curve.evaluate(np.linspace(0.0, motion.duration, 200001))


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("joint", [0, 1])
def test_a_motion_keeps_positions_up_to_rounding_on_each_side(joint: int, sign: float) -> None:
    free, motion, rows = free_motion(sign)
    reached = rows[:, joint]
    for side, edge, out in ((0, reached.min(), -1.0), (1, reached.max(), 1.0)):
        for by, kept in ((1e-3, True), (5e-10, True), (-5e-10, True), (-1e-6, False), (-1e-3, False)):
            walls = np.array([[-np.inf, np.inf]] * 2)
            walls[joint, side] = edge + out * by
            assert _keeps_positions(replace(free, position=walls), motion) is kept


def test_states_of_a_motion_that_leaves_position_limits_are_lowered_until_it_does_not() -> None:
    points = np.array([[0, 0], [1, 0.3], [0.2, 0.9], [0.6, 0.1]])
    free = problem(points, joints=2)
    best = search(free, 2).best
    passing = _exact(free, best, NAMES)
    assert passing is not None
    (beyond,) = peaks(passing.curve, (0,))
    ends = np.stack([points.min(axis=0), points.max(axis=0)], axis=1)
    walls = ends + 0.9 * (np.stack([beyond.low, beyond.high], axis=1) - ends)
    made = replace(free, position=walls)
    exact = _exact(made, best, NAMES)
    assert exact is not None
    (peak,) = peaks(exact.curve, (0,))
    assert (peak.high <= walls[:, 1] + 1e-9).all()
    assert (peak.low >= walls[:, 0] - 1e-9).all()
    stops = sum(times_of(made, np.zeros_like(made.states)))
    assert best.duration < exact.duration <= stops * (1 + 1e-9)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_with_time_to_spare_a_straight_motion_takes_no_run_up_beyond_its_ends(sign: float) -> None:
    made = problem(sign * np.array([[0, 0], [0.2, 0.3], [0.9, 1.35]]), joints=2)
    made = replace(made, least=np.array([3.0, 0.0]))
    found = straight_only(made, NAMES, 1)
    keeps(made, found)
    (peak,) = peaks(found.motion.curve, (0,))
    ends = np.sort(made.points[[0, -1]], axis=0)
    assert (peak.low >= ends[0] - 1e-9).all()
    assert (peak.high <= ends[1] + 1e-9).all()
    assert found.motion.times[1] >= 3.0 * (1 - 1e-9)
    free = max(from_rest(0.0, sign * 0.9), from_rest(0.0, sign * 1.35))
    assert found.motion.duration < 3.0 + free


def test_states_that_ruckig_cannot_join_are_lowered_a_little() -> None:
    made = problem(POINTS, joints=2)
    best = search(made, 2).best
    exact = _exact(made, best, NAMES)
    assert exact is not None
    assert exact.duration == pytest.approx(best.duration, rel=1e-6)
    assert _exact(made, replace(best, times=np.full(3, np.inf)), NAMES) is None


def test_along_the_polyline_the_bound_is_that_of_its_law() -> None:
    made = problem([[0, 0], [0.2, 0.3], [0.4, 0.6], [0.4, 0.0]], joints=2)
    found = straight_only(made, NAMES, 2)
    keeps(made, found)
    whole = max(from_rest(0.0, 0.4), from_rest(0.0, 0.6)) + from_rest(0.6, 0.0)
    assert found.motion.duration == pytest.approx(whole, rel=1e-6)
    assert found.lower == pytest.approx(whole, rel=1e-6)
    assert (found.found, found.agreeing, found.joint) == ((found.motion.duration,), 1, None)
    assert found.stopping == pytest.approx(sum(times_of(made, np.zeros_like(made.states))), rel=1e-6)
