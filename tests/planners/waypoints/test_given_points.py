"""What is given at points of a `waypoints` move: what of it can be, points in one place, and limits that count."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from hermite_curves import hermite_pieces
from tiers import few

import trajcli
from trajcli.errors import MissingLimitError, PlanningError
from trajcli.job.read import job_from_text
from trajcli.kinematics.robot import Joint, Robot, unlimited
from trajcli.language.recorded import SAME_POSITION
from trajcli.planners.planner import Planned
from trajcli.planners.waypoints.given_points import (
    GivenPoints,
    given_points,
    require_possible,
    without_repeats,
)
from trajcli.trajectory import State, ViaPoints, resting

LOW, HIGH, JERK = -1.0, 2.0, (-10.0, 20.0)
"""Limits of velocity and jerk by direction; of jerk the smaller one counts."""


def robot(**bounds: tuple[float, float]) -> Robot:
    """Return two joints with the same limits."""
    kept = {"velocity": (LOW, HIGH), "acceleration": (-4.0, 3.0), "jerk": JERK} | bounds
    limits = replace(unlimited(2), **{name: np.array([bound] * 2) for name, bound in kept.items()})
    return Robot("bare", (Joint("j1"), Joint("j2")), limits, None, np.eye(4), np.eye(4))


def points(
    positions: object, states: dict[tuple[int, int], tuple[float | None, float | None]], least: object = None
) -> GivenPoints:
    """Return points with a velocity and an acceleration by point and joint; start and target give all."""
    q = np.array(positions, dtype=float)
    values, fixed = np.zeros((*q.shape, 2)), np.zeros((*q.shape, 2), dtype=bool)
    fixed[[0, -1]] = True
    for where, both in states.items():
        for order, value in enumerate(both):
            if value is not None:
                values[(*where, order)], fixed[(*where, order)] = value, True
    times = np.zeros(len(q) - 1) if least is None else np.array(least, dtype=float)
    return GivenPoints(q, values, fixed, times, (None,) * len(q))


THREE = [[0.0, 0.0], [1.0, 1.0], [0.5, 2.0]]


def flaws(states: dict[tuple[int, int], tuple[float | None, float | None]]) -> list[str]:
    """Return what is refused, by joint."""
    try:
        require_possible(points(THREE, states), robot())
    except PlanningError as error:
        return [f"{problem.joint}: {problem.text()}" for problem in error.problems]
    return []


@pytest.mark.parametrize("k", [0, 1, 2])
@pytest.mark.parametrize(("order", "limit"), [(0, LOW), (0, HIGH), (1, -4.0), (1, 3.0)])
def test_what_is_given_keeps_its_limit_to_the_last_digits(k: int, order: int, limit: float) -> None:
    for off, refused in ((-1e-9, False), (5e-13, False), (1e-9, True)):
        value = limit * (1 + off)
        found = flaws({(k, 1): (value, None) if order == 0 else (None, value)})
        assert bool(found) is refused
        assert all(text.startswith("j2: ") and "beyond its limit" in text for text in found)


@pytest.mark.parametrize(("k", "sides"), [(0, ("after",)), (1, ("before", "after")), (2, ("before",))])
@pytest.mark.parametrize("limit", [LOW, HIGH])
def test_an_acceleration_leaves_room_for_the_velocity_before_and_after_it(
    k: int, sides: tuple[str, ...], limit: float
) -> None:
    """Within a jerk of 10 it changes the velocity by a^2 / 20 on either side: by 0.105 for 1.45, 0.095 for 1.38."""
    sign = np.sign(limit)
    for side, turn in (("before", -1.0), ("after", 1.0)):
        for size, over in ((1.38, False), (1.45, True)):
            found = flaws({(k, 0): (limit - sign * 0.1, sign * turn * size)})
            assert bool(found) is (over and side in sides)
            assert all(f"just {side}" in text for text in found)
    assert flaws({(1, 0): (None, 2.9)}) == []  # its velocity is found so that it fits


def test_every_joint_and_point_that_cannot_be_is_told() -> None:
    found = flaws({(0, 0): (2.5, 0.0), (1, 1): (-1.5, None), (2, 0): (0.0, 3.5)})
    assert [text[:2] for text in found] == ["j1", "j2", "j1"]
    assert len(flaws({(1, 0): (2.5, None)})) == 1


def own_limits() -> Robot:
    """Return two joints of which each has its own limits, and other ones by direction."""
    limits = replace(
        unlimited(2),
        velocity=np.array([[-0.5, 0.7], [LOW, HIGH]]),
        acceleration=np.array([[-1.0, 1.5], [-4.0, 3.0]]),
        jerk=np.array([[-1000.0, 1000.0], list(JERK)]),
    )
    return replace(robot(), limits=limits)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ((-1.25, None), "j2 has velocity -1.25 at point 1, beyond its limit -1"),
        ((2.25, None), "j2 has velocity 2.25 at point 1, beyond its limit 2"),
        ((None, -4.5), "j2 has acceleration -4.5 at point 1, beyond its limit -4"),
        # a |a| / (2 j), of 3 and 10: 0.45
        ((1.75, 3.0), "must move at 2.2 just after, beyond its velocity limit 2"),
        ((-0.75, 3.0), "must move at -1.2 just before, beyond its velocity limit -1"),
        ((-0.75, -3.0), "must move at -1.2 just after, beyond its velocity limit -1"),
    ],
)
def test_what_cannot_be_is_told_with_the_limit_of_its_joint_and_direction(
    given: tuple[float | None, float | None], said: str
) -> None:
    with pytest.raises(PlanningError) as caught:
        require_possible(points(THREE, {(1, 1): given}), own_limits())
    (problem,) = caught.value.problems
    assert said in problem.text()
    told = [problem.amounts[name] for name in ("value", "limit")]
    assert [(each.order, each.joint) for each in told] == [(2 if given[0] is None else 1, 1)] * 2


@pytest.mark.parametrize("given", [(1.5, 3.0), (-0.5, 3.0), (1.5, None), (None, 3.0), (None, -4.0)])
def test_what_can_be_within_the_limits_of_its_joint_is_taken(
    given: tuple[float | None, float | None],
) -> None:
    """Where one of both is left open it is found so that it fits: 4^2 / 20 of -1 would be left of it."""
    require_possible(points(THREE, {(1, 1): given, (1, 0): (0.6, 1.5)}), own_limits())
    tight = replace(own_limits(), limits=replace(own_limits().limits, jerk=np.full((2, 2), 5.0) * [-1, 1]))
    if None in given:
        require_possible(points(THREE, {(1, 1): given}), tight)


def test_a_limit_of_many_digits_is_told_towards_the_inside() -> None:
    limit = np.radians(-100.0)
    arm = robot(velocity=(limit, 2.0))
    with pytest.raises(PlanningError) as caught:
        require_possible(points(THREE, {(1, 1): (limit * 1.001, None)}), arm)
    told = float(caught.value.problems[0].text().split("its limit ")[1].split()[0])
    assert limit <= told <= limit * (1 - 1e-3)


@pytest.mark.parametrize("order", [0, 1])
@pytest.mark.parametrize("point", [0, 1, 2])
def test_a_joint_moves_where_anything_of_it_does(point: int, order: int) -> None:
    """It may come back to where it was: by a velocity or an acceleration at any of its points."""
    still = [[0.0, 0.3], [1.0, 0.3], [2.0, 0.3]]
    assert points(still, {}).moving.tolist() == [True, False]
    given = (0.5, None) if order == 0 else (None, 0.5)
    assert points(still, {(point, 1): given}).moving.tolist() == [True, True]
    assert points([[0.0, 0.3], [1.0, 0.4], [0.0, 0.3]], {}).moving.tolist() == [True, True]


def test_a_start_that_is_the_target_leaves_nothing_out() -> None:
    both = without_repeats(points([[0.1, 0.2], [0.1, 0.2]], {}), robot())
    assert (len(both.positions), both.events) == (2, ())


def test_points_in_one_place_that_differ_are_told_with_their_numbers_and_place() -> None:
    """The place is that of the later one, and of those that stay the last one's."""
    given = points(
        [[0.0, 0.0], [1.0, 1.0], [1.0, 1.0], [2.0, 2.0]], {(1, 1): (0.25, 0.5), (2, 1): (0.25, 0.75)}
    )
    placed = replace(given, fields=(None, ("through", 0), ("through", 1), ("to",)))
    with pytest.raises(PlanningError) as caught:
        without_repeats(placed, robot())
    (problem,) = caught.value.problems
    assert problem.text() == "two points in one place give j2 different accelerations, 0.5 and 0.75"
    assert problem.field == ("through", 1)
    assert [problem.amounts[name].order for name in ("one", "other")] == [2, 2]
    same = replace(placed, states=np.where(placed.states == 0.75, 0.5, placed.states))
    assert without_repeats(same, robot()).fields == (None, ("through", 1), ("to",))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_points_are_in_one_place_where_all_joints_are(sign: float) -> None:
    near = 0.5 * SAME_POSITION
    q = [[0.0, 0.0], [1.0, 1.0], [1.0 + sign * near, 1.0 - near], [1.0, 1.0 + sign], [0.5, 2.0]]
    found = without_repeats(points(q, {}), robot())
    np.testing.assert_array_equal(found.positions, np.array(q)[[0, 2, 3, 4]])
    assert len(found.events) == 1


@pytest.mark.parametrize(
    ("places", "kept", "least"),
    [
        ([0, 0, 1, 1, 1, 2, 2], [0, 1, 2], [1 + 2, 4 + 8 + 16 + 32]),
        ([0, 1, 1, 1, 2], [0, 1, 2], [1, 2 + 4 + 8]),
        ([0, 1, 2, 2, 2], [0, 1, 2], [1, 2 + 4 + 8]),  # at the target to the segment before
        ([0, 0, 0, 0], [0, 0], [1 + 2 + 4]),
    ],
)
def test_what_lay_between_points_in_one_place_goes_to_the_next_segment(
    places: list[int], kept: list[int], least: list[int]
) -> None:
    q = [[float(place), 0.0] for place in places]
    found = without_repeats(points(q, {}, [2.0**k for k in range(len(q) - 1)]), robot())
    assert found.positions[:, 0].tolist() == kept
    assert found.least.tolist() == least


def test_what_is_given_at_any_of_the_points_in_one_place_holds_there() -> None:
    q = [[0.0, 0.0], [1.0, 1.0], [1.0, 1.0], [1.0, 1.0], [2.0, 0.0]]
    given = {(1, 0): (0.5, None), (2, 1): (0.25, -1.0), (3, 0): (None, 0.75), (2, 0): (0.5, None)}
    found = without_repeats(points(q, given), robot())
    np.testing.assert_array_equal(found.states[1], [[0.5, 0.75], [0.25, -1.0]])
    assert found.fixed[1].all()
    only = without_repeats(points(q, {(2, 1): (0.25, None)}), robot())
    assert only.fixed[1].tolist() == [[False, False], [True, False]]
    with pytest.raises(PlanningError, match=r"different accelerations"):
        without_repeats(points(q, {(1, 1): (None, 1.0), (3, 1): (None, -1.0)}), robot())


def test_a_joint_that_only_has_a_velocity_moves() -> None:
    assert points([[0.0, 1.0], [0.0, 1.0]], {(1, 1): (0.5, 0.0)}).moving.tolist() == [False, True]
    assert points([[0.0, 1.0], [0.5, 1.0]], {}).moving.tolist() == [True, False]


def job(through: list[dict[str, object]], limits: dict[str, object] | None = None, **fields: object) -> dict:
    """Return a job from 0 through points, of two joints."""
    kept = {"velocity": 2, "acceleration": 8, "jerk": 60} | (limits or {})
    move = {"planner": "waypoints", "starts": 1, "through": through, **fields}
    return {
        "version": 1,
        "robot": {"joints": 2},
        "limits": kept,
        "start": {"joints": [0, 0]},
        "moves": [move],
    }


def test_of_a_jerk_that_differs_by_direction_the_smaller_one_counts() -> None:
    """Rest to rest over 0.1 within a jerk of 60 alone takes (32 x 0.1 / 60)^(1/3) s, whatever the other one is."""
    for jerk in ([-60, 90], [-90, 60]):
        wide = {"velocity": 50, "acceleration": 500, "jerk": [jerk, jerk]}
        plan = trajcli.plan(job([{"joints": [0.05, 0]}, {"joints": [0.1, 0]}], wide))
        assert plan.trajectory.duration == pytest.approx((3.2 / 60) ** (1 / 3), rel=1e-6)


def test_start_and_target_are_given_whole_and_of_others_what_their_waypoints_name() -> None:
    text = json.dumps(
        job(
            [
                {"joints": [0.1, 0.2], "velocity": {"j2": -0.5}, "acceleration": [0.25, 0.0]},
                {"joints": [0.2, 0.1]},
                {"joints": [0.3, 0.4], "velocity": [0.5, 0.0]},
            ]
        )
    )
    listed = job_from_text(text).job.moves[0].listed
    start = State(np.array([0.0, 0.0]), np.array([0.0, 0.125]), np.array([-1.0, 0.0]))
    recorded = np.array([[0.0, 0.5]])
    found = given_points(start, recorded, [(("through", k), point) for k, point in enumerate(listed)], None)
    np.testing.assert_array_equal(found.positions, [[0, 0], [0, 0.5], [0.1, 0.2], [0.2, 0.1], [0.3, 0.4]])
    assert found.fixed[[0, -1]].all()
    assert found.fixed[2].tolist() == [[False, True], [True, True]]
    assert not found.fixed[[1, 3]].any()
    assert found.states[0].tolist() == [[0.0, -1.0], [0.125, 0.0]]
    assert found.states[2].tolist() == [[0.0, 0.25], [-0.5, 0.0]]
    assert found.states[-1].tolist() == [[0.5, 0.0], [0.0, 0.0]]
    assert found.fields == (None, None, ("through", 0), ("through", 1), ("through", 2))


@pytest.mark.parametrize("bound", [(-np.inf, 5.0), (-5.0, np.inf)])
@pytest.mark.parametrize("quantity", ["velocity", "acceleration", "jerk"])
def test_a_limit_of_one_direction_is_none(quantity: str, bound: tuple[float, float]) -> None:
    planner = job_from_text(json.dumps(job([{"joints": [0.2, 0]}]))).job.moves[0]
    with pytest.raises(MissingLimitError, match="j1"):
        planner.plan(resting(np.zeros(2)), robot(**{quantity: bound}))


@pytest.mark.parametrize("quantity", ["velocity", "acceleration", "jerk"])
def test_a_limit_that_a_moving_joint_lacks_is_named(quantity: str) -> None:
    through = [{"joints": [0.2, 0]}, {"joints": [0.3, 0]}]
    with pytest.raises(MissingLimitError, match="j1") as caught:
        trajcli.plan(job(through, {quantity: [None, 5]}))
    assert quantity in caught.value.problems[0].text()
    assert trajcli.plan(job(through, {quantity: [5, None]})).verdict.passed


def test_points_that_are_all_one_last_as_long_as_they_must() -> None:
    still = [{"joints": [0, 0]}] * 2
    assert trajcli.plan(job(still, minimum_durations=[0.5, 0.25])).trajectory.duration == 0.75


@pytest.mark.parametrize(("joint", "sign"), few([(0, 1), (0, -1), (1, 1), (1, -1)], 2))
@pytest.mark.parametrize("name", ["velocity", "acceleration"])
def test_only_a_motion_from_rest_has_a_path(joint: int, sign: int, name: str) -> None:
    through = [{"joints": [0.2, 0.1]}, {"joints": [0.3, 0.4]}]
    rates = [0.0, 0.0]
    rates[joint] = sign * 1e-4
    said = job(through)
    said["start"] = {"joints": [0, 0], name: rates}
    plan = trajcli.plan(said)
    planner, robot = plan.loaded.job.moves[0], plan.loaded.robot
    with pytest.raises(PlanningError, match="starts in motion"):
        planner.course(np.zeros(2), robot, plan.moves[0].planned)


def test_a_motion_from_rest_has_a_path() -> None:
    said = job([{"joints": [0.2, 0.1]}, {"joints": [0.3, 0.4]}])
    said["start"] = {"joints": [0, 0], "velocity": [0, 0], "acceleration": [0, 0]}
    plan = trajcli.plan(said)
    planner, robot = plan.loaded.job.moves[0], plan.loaded.robot
    assert planner.course(np.zeros(2), robot, plan.moves[0].planned) is not None


def waypoints_of(count: int, **last: object) -> object:
    """Return the planner of a move through some points."""
    through = [{"joints": [0.1 * (k + 1), 0.05 * (-1) ** k]} for k in range(count)]
    through[-1] |= last
    return job_from_text(json.dumps(job(through))).job.moves[0]


@pytest.mark.parametrize(
    ("order", "size", "refused"), [(1, 1e-8, True), (1, 1e-10, False), (2, 1e-8, True), (2, 1e-10, False)]
)
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_start_is_at_rest_to_a_billionth_of_the_largest_rates_of_its_motion(
    sign: float, order: int, size: float, refused: bool
) -> None:
    """Far from zero and in a short time: positions and jerks are no measure of it."""
    t = np.array([0.0, 0.01, 0.02, 0.03])
    states = np.zeros((3, 4, 2))
    states[0] = 1000.0 + np.array([[0.0, 0.0], [1.0, 0.5], [2.0, 0.0], [3.0, 1.0]])
    states[1, 1:3, 0] = 100.0
    largest = np.abs(hermite_pieces(t, states).piece_ends(order)).max() or 1e4
    states[order, 0, 1] = sign * size * largest
    curve = hermite_pieces(t, states)
    planned = Planned(curve, resting(states[0, -1]), via_points=ViaPoints(t, states[0], np.zeros((4, 2))))
    if refused:
        with pytest.raises(PlanningError, match="starts in motion"):
            waypoints_of(3).course(np.zeros(2), robot(), planned)
        return
    passed = waypoints_of(3).course(np.zeros(2), robot(), planned).passed
    np.testing.assert_array_equal(passed.points, states[0, 1:-1])
    assert passed.s.shape == (2,)
    assert passed.missed.shape == (2, 2)


def test_the_last_point_says_whether_a_motion_may_fly_by() -> None:
    for count in (1, 2, 3, 4):
        assert waypoints_of(count).why_not_flown_by is None
        assert waypoints_of(count, velocity=[0.0, 0.0]).why_not_flown_by is None
        assert waypoints_of(count, velocity=[0.0, -0.1]).why_not_flown_by == "it ends in motion"
        assert waypoints_of(count, acceleration=[0.1, 0.0]).why_not_flown_by == "it ends in motion"
