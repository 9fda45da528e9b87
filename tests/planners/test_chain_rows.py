"""Parts of chains: what lasts as long backwards, at another pace, and within tighter bounds."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from ruckig import InputParameter, Result, Ruckig, Trajectory
from tiers import few

from trajcli.job.robot import load_robot
from trajcli.kinematics.robot import Limits
from trajcli.kinematics.zone import Zone, ZoneAround
from trajcli.planners.course import joint_line
from trajcli.planners.flying_by.between_stops import chain_of
from trajcli.planners.flying_by.chain_parts import (
    BorderNode,
    ChainRow,
    PathPart,
    ZonePart,
    backwards,
    joint_bounds,
    joint_rates,
    row_of,
    slowed,
)
from trajcli.planners.flying_by.motion_search import with_shares

PATH = np.array([-2.0, 2.0, -3.0, 5.0, -40.0, 60.0])
MIRROR = np.array([1.0, -1.0])


def zone(rng: np.random.Generator) -> ZonePart:
    """Return a zone of three joints with limits that differ by direction."""
    bounds = rng.uniform(1.0, 4.0, (3, 6)) * [-1, 1, -3, 3, 0, 0]
    bounds[:, 4:] = rng.uniform(40.0, 60.0, (3, 1)) * [-1, 1]
    before, after = rng.normal(size=(2, 2, 3))
    return ZonePart(bounds, 2.0 * rng.normal(size=3), before, after)


def same_everywhere(states: np.ndarray) -> np.ndarray:
    return np.tile(PATH, (len(states), 1))


@pytest.mark.parametrize("seed", few(range(12), 4))
def test_a_row_backwards_lasts_as_long(seed: int) -> None:
    """From its end to its start speeds stay and accelerations change their sign; so do velocities of joints."""
    rng = np.random.default_rng(seed)
    states = rng.uniform([0.1, -1.0], [0.5, 1.0], (4, 2))
    path, between = PathPart(PATH, 0.7), zone(rng)
    nodes = [
        BorderNode(same_everywhere, leads=leads, goes_on=not leads, distance=0.1 + leads)
        for leads in (True, False)
    ]
    last = PathPart(2 * PATH, 0.3, typical=True)
    back = backwards(ChainRow(tuple(nodes), (path, between, last)))
    mirrored = states[::-1] * MIRROR
    forth = path.durations(states[:2], states[2:])
    np.testing.assert_allclose(back.parts[2].durations(mirrored[:2], mirrored[2:]), forth[::-1, ::-1].T)  # type: ignore[union-attr]
    for first, other in ((0, 1), (2, 3)):
        whole = between.together(states[first], states[other])
        turned = back.parts[1].together(states[other] * MIRROR, states[first] * MIRROR)  # type: ignore[union-attr]
        assert turned == pytest.approx(whole, rel=1e-9)
    assert (back.parts[0].length, back.parts[0].typical) == (0.3, True)  # type: ignore[union-attr]
    assert [node.distance for node in back.nodes] == [0.1, 1.1]
    again = backwards(back)
    for one, same in zip(again.parts, (path, between, last), strict=True):
        for name in one.__dataclass_fields__:
            np.testing.assert_array_equal(getattr(one, name), getattr(same, name))
    np.testing.assert_array_equal(again.nodes[0].bounds(states), nodes[0].bounds(states))


def test_a_node_backwards_has_its_bounds_and_its_state_mirrored() -> None:
    given = BorderNode(same_everywhere, leads=True, goes_on=False, given=np.array([0.4, 1.5]), distance=0.2)
    (node,) = backwards(ChainRow((given,), (PathPart(PATH, 0.7), PathPart(PATH, 0.3)))).nodes
    np.testing.assert_array_equal(node.bounds(np.zeros((1, 2)))[0], [-2, 2, -5, 3, -40, 60])
    np.testing.assert_array_equal(node.inside(np.ones((2, 2))), [[0.4, -1.5]] * 2)
    assert (node.leads, node.goes_on, node.distance) == (False, True, 0.2)  # what led to it goes on

    def about(states: np.ndarray) -> np.ndarray:
        return same_everywhere(states) + states[:, 1:]

    (bent,) = backwards(ChainRow((replace(given, bounds=about),), ())).nodes
    np.testing.assert_array_equal(bent.bounds(np.array([[0.3, 0.5]]))[0, 2:4], [-4.5, 3.5])


@pytest.mark.parametrize("tempo", [0.5, 0.9])
def test_at_a_slower_pace_a_path_takes_as_much_longer(tempo: float) -> None:
    states = np.array([[0.5, 0.8], [0.3, -0.6]])
    whole = PathPart(PATH, 0.7).durations(states[:1], states[1:])
    slower = states * [tempo, tempo**2]
    found = PathPart(slowed(PATH, tempo), 0.7).durations(slower[:1], slower[1:])
    np.testing.assert_allclose(found, whole / tempo, rtol=1e-9)


@pytest.mark.parametrize(
    ("state", "top", "falling", "rising"),
    [
        ([0.5, 0.8], 2.0, 3.0, 5.0),
        ([2.5, 0.0], 2.5, 3.0, 5.0),
        ([1.0, 7.0], 2.0, 7.0, 7.0),
        ([1.0, -4.5], 2.0, 4.5, 5.0),
        ([1.99, 2.4], 1.99 + 2.4**2 / 120, 3.0, 5.0),
        ([1.99, -2.4], 2.0, 3.0, 5.0),
    ],
)
def test_bounds_that_stand_for_others_make_room_for_states_at_borders(
    state: list[float], top: float, falling: float, rising: float
) -> None:
    """An acceleration a that is taken back behind a start adds a^2 / (2 jerk) to the speed; before an end mirrored."""
    rest, there = np.array([[0.4, 0.0]]), np.array([state])
    wide = PathPart(np.array([-2.0, top, -falling, rising, -40.0, 60.0]) * (1 + 2e-6), 0.7)
    typical = PathPart(PATH, 0.7, typical=True)
    for first, last in ((there, rest), (rest, there * MIRROR)):
        found = typical.durations(first, last)
        np.testing.assert_allclose(found, wide.durations(first, last), rtol=1e-4)
        exact = PathPart(PATH, 0.7).durations(first, last)
        if (falling, rising) != (3.0, 5.0):
            assert abs(float(exact[0, 0] - found[0, 0])) > 1e-6
        elif top == 2.0:
            assert exact == found


def test_bounds_of_joints_have_the_smaller_jerk_both_ways() -> None:
    limits = load_robot("planar2r").limits
    limits = replace(
        limits,
        velocity=np.array([[-1.0, 2], [-3, 4]]),
        acceleration=np.array([[-5.0, 6], [-7, 8]]),
        jerk=np.array([[-20.0, 30], [-50, 40]]),
    )
    np.testing.assert_array_equal(joint_bounds(limits), [[-1, 2, -5, 6, -20, 20], [-3, 4, -7, 8, -40, 40]])


@pytest.mark.parametrize("seed", few(range(12), 4))
def test_through_a_zone_all_joints_take_as_long_as_ruckig_lets_them(seed: int) -> None:
    rng = np.random.default_rng(seed)
    part = zone(rng)
    first, last = rng.uniform([0.1, -0.5], [0.4, 0.5], (2, 2))
    asked, found = InputParameter(3), Trajectory(3)
    before, after = joint_rates(first[None], part.before)[0], joint_rates(last[None], part.after)[0]
    asked.target_position = part.steps.tolist()
    asked.current_velocity, asked.current_acceleration = before.T.tolist()
    asked.target_velocity, asked.target_acceleration = after.T.tolist()
    asked.min_velocity, asked.max_velocity = part.bounds[:, 0].tolist(), part.bounds[:, 1].tolist()
    asked.min_acceleration, asked.max_acceleration = part.bounds[:, 2].tolist(), part.bounds[:, 3].tolist()
    asked.max_jerk = part.bounds[:, 5].tolist()
    within = (np.abs(before[:, 0]) < np.abs(part.bounds[:, :2]).min(axis=1)).all()
    if not within or Ruckig(3).calculate(asked, found) != Result.Working:
        return
    assert part.together(first, last) == pytest.approx(found.duration, rel=1e-9)


@pytest.mark.parametrize("leads", [True, False])
@pytest.mark.parametrize("goes_on", [True, False])
def test_a_state_at_a_border_can_be_built_up_and_taken_back(*, leads: bool, goes_on: bool) -> None:
    """An acceleration a of jerk j changes the speed by a^2 / (2 j): it stays between rest and the largest one."""
    node = BorderNode(same_everywhere, leads=leads, goes_on=goes_on)
    _, top, low, high, lower, upper = PATH.tolist()
    asked = np.random.default_rng(4).uniform([-0.5, -6.0], [2.5, 8.0], (400, 2))
    speed, change = node.inside(asked).T
    assert (speed >= 0).all()
    assert (speed <= top * (1 - 5e-7)).all()
    assert (change >= low).all()
    assert (change <= high).all()
    added = np.where(change > 0, change**2 / (2 * upper), change**2 / (2 * lower))  # with its sign
    taken = np.where(change > 0, change**2 / (2 * -lower), -(change**2) / (2 * upper))
    fine = 1e-9
    if leads:
        assert (speed - added >= -fine).all()
        assert (speed - added <= top + fine).all()
    if goes_on:
        assert (speed + taken >= -fine).all()
        assert (speed + taken <= top + fine).all()
    again = node.inside(np.stack([speed, change], axis=1))
    np.testing.assert_allclose(again, np.stack([speed, change], axis=1), atol=1e-6)


def line_bounds(way: np.ndarray, limits: Limits) -> np.ndarray:
    """Return the bounds of s of a line in joint space, from those of its joints by direction, (6,)."""
    rows = []
    for name in ("velocity", "acceleration"):
        low, high = getattr(limits, name).T
        rows += [np.where(way > 0, low, high) / way, np.where(way > 0, high, low) / way]
    jerk = np.abs(limits.jerk).min(axis=1) / np.abs(way)
    least = [float(np.abs(row).min()) for row in (*rows, jerk, jerk)]
    least[0] = least[1]  # a law goes forward alone
    return np.array(least) * [-1, 1, -1, 1, -1, 1]


@pytest.mark.parametrize("seed", few(range(6), 3))
@pytest.mark.parametrize("share", [1.0, 0.3])
def test_borders_of_a_zone_have_the_tighter_bounds_of_its_path_and_of_the_zone(
    seed: int, share: float
) -> None:
    rng = np.random.default_rng(seed)
    places = rng.uniform(-1.0, 1.0, (3, 2))
    robots, courses = [], []
    for ends in (places[:2], places[1:]):
        fields: dict[str, Any] = {
            name: np.stack([-rng.uniform(1, 9, 2), rng.uniform(1, 9, 2)], axis=1)
            for name in ("velocity", "acceleration", "jerk")
        }
        robot = load_robot("planar2r")
        robots.append(replace(robot, limits=replace(robot.limits, **fields)))
        courses.append(joint_line(*ends, robots[-1]))
    around, rest = ZoneAround(robots[0], places[1], Zone(joints=(0.1, 0.1))), np.zeros(2)
    chain = replace(chain_of(courses, [around], (rest, rest), [1.0]), tempos=(0.8, 0.6))
    chain = with_shares(chain, share ** np.arange(1, 4)[None])
    (corner,) = chain.corners
    row = row_of(chain, [1.0, 1.0], [1.0, 0.9], {1: np.array([0.1, 0.2])})
    before, between, behind = row.parts
    assert isinstance(before, PathPart)
    assert isinstance(between, ZonePart)
    assert isinstance(behind, PathPart)
    ways = np.diff(places, axis=0)
    np.testing.assert_allclose(
        between.steps, (1 - corner.left) * ways[0] + corner.joined * ways[1], atol=1e-12
    )
    np.testing.assert_array_equal(between.bounds, joint_bounds(corner.limits))
    np.testing.assert_allclose([between.before, between.after], [[way, 0 * way] for way in ways], atol=1e-15)
    assert (before.length, behind.length) == pytest.approx((corner.left, 1 - corner.joined))
    distances = (1 - corner.left, corner.joined)
    for k, (node, tempo) in enumerate(zip(row.nodes, (0.8, 0.6 * 0.9), strict=True)):
        along = slowed(line_bounds(ways[k], robots[k].limits), tempo)
        inside = line_bounds(ways[k], corner.limits)
        wanted = np.where(np.abs(along) < np.abs(inside), along, inside)
        np.testing.assert_allclose(node.bounds(np.zeros((1, 2)))[0], wanted, rtol=1e-12)
        assert node.distance == pytest.approx(distances[k])
        assert (node.leads, node.goes_on) == (k == 0, k == 1)
    assert row.nodes[0].given is None
    np.testing.assert_array_equal(row.nodes[1].given, [0.1, 0.2])


@pytest.mark.parametrize("seed", few(range(8), 3))
def test_joints_go_on_with_their_accelerations_through_a_zone(seed: int) -> None:
    """Where constant accelerations lead from one path to the other their state is carried, both ways."""
    rng = np.random.default_rng(seed)
    part, state, time = zone(rng), np.array([[0.8, 0.3]]), 0.2
    (rates,) = joint_rates(state, part.before)
    np.testing.assert_allclose(rates[:, 0], 0.8 * part.before[0])
    np.testing.assert_allclose(rates[:, 1], 0.3 * part.before[0] + 0.64 * part.before[1])
    behind = rates[:, 0] + time * rates[:, 1]
    speed = float(np.linalg.norm(behind))
    direction = behind / speed
    after = np.stack([direction, (rates[:, 1] - 0.7 * direction) / speed**2])  # qdd = 0.7 q' + speed^2 q''
    led = ZonePart(part.bounds, time * rates[:, 0], part.before, after)
    np.testing.assert_allclose(led.carried(state), [[speed, 0.7]], rtol=1e-9)
    back = ZonePart(part.bounds, time * behind, part.before, after).carried(
        np.array([[speed, 0.7]]), back=True
    )
    np.testing.assert_allclose(back, state, rtol=1e-9)
