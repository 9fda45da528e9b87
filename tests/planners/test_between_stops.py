"""Borders of zones: where paths leave them, what two zones share of a move, and the limits inside."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from tiers import few

from trajcli.job.robot import load_robot
from trajcli.kinematics.robot import Robot, ToolLimits
from trajcli.kinematics.zone import Zone, ZoneAround
from trajcli.planners.course import joint_line
from trajcli.planners.flying_by.between_stops import (
    CornerZone,
    _inside,
    border,
    chain_of,
    shared,
    with_looser_limits,
)

QUANTITIES = ("velocity", "acceleration", "jerk")


@pytest.mark.parametrize("length", [1.0, 7.0])
@pytest.mark.parametrize("before", [True, False])
@pytest.mark.parametrize("size", [1e-6, 0.3, 0.999])
def test_a_border_is_where_the_zone_is_used_up(length: float, size: float, *, before: bool) -> None:
    """A path that goes away from its corner in proportion to s, and a zone of a part of its length."""
    corner = length if before else 0.0
    found = border(lambda s: np.abs(s - corner) / (size * length), length, before=before)
    assert abs(found - corner) == pytest.approx(size * length, rel=1e-9)
    assert abs(found - corner) <= size * length
    assert border(lambda s: 0.9 * np.abs(s - corner) / length, length, before=before) == length - corner


@pytest.mark.parametrize("before", [True, False])
def test_between_its_border_and_the_corner_a_path_stays_inside(*, before: bool) -> None:
    """One that leaves its zone three times: the last border counts, whichever is found first."""

    def shares(s: np.ndarray) -> np.ndarray:
        d = 1.0 - s if before else s
        return np.asarray(0.8 * d + np.sin(20.0 * d))

    found = border(shares, 1.0, before=before)
    inside = np.linspace(found, 1.0 if before else 0.0, 10_001)
    assert (shares(inside) <= 1.0).all()
    assert shares(np.array([found + (-1e-9 if before else 1e-9)]))[0] > 1.0
    assert 0.05 < abs(inside[-1] - inside[0]) < 0.1


def two_zones(rng: np.random.Generator) -> tuple[float, float, float]:
    length = float(rng.uniform(0.1, 10.0))
    entered, left = (rng.uniform(size=2) * length).tolist()
    return entered, left, length


@pytest.mark.parametrize("seed", few(range(40), 12))
def test_two_zones_share_a_move_and_leave_a_little_of_it(seed: int) -> None:
    """Each has what it asks for or half; what it does not ask for the other one may have."""
    entered, left, length = two_zones(np.random.default_rng(seed))
    first, last = shared(entered, left, length)
    gap, middle = 0.05 * length, 0.5 * length
    assert last - first >= gap * (1 - 1e-12)
    assert 0 <= first <= entered
    assert left <= last <= length
    if left - entered >= gap:
        assert (first, last) == (entered, left)
        return
    assert last - first <= gap * (1 + 1e-12)  # no more is left than has to be
    assert first >= min(entered, middle - gap / 2) - gap / 2 - 1e-12
    assert last <= max(left, middle + gap / 2) + gap / 2 + 1e-12
    if entered < middle:
        assert first == entered
    elif left > middle:
        assert last == left
    else:
        assert first + last == pytest.approx(length)


@pytest.mark.parametrize("seed", few(range(20), 6))
def test_what_zones_share_of_a_move_is_mirrored_with_it(seed: int) -> None:
    rng = np.random.default_rng(seed)
    entered, left, length = two_zones(rng)
    for one, other in ((entered, left), (entered, None), (None, left), (None, None)):
        first, last = shared(one, other, length)
        mirrored = (None if each is None else length - each for each in (other, one))
        assert shared(*mirrored, length) == pytest.approx((length - last, length - first), abs=1e-12)


def test_next_to_a_stop_a_zone_has_nearly_all() -> None:
    assert shared(None, 0.3, 2.0) == (0.0, 0.3)
    assert shared(None, 0.0, 2.0) == pytest.approx((0.0, 0.1))
    assert shared(1.8, None, 2.0) == (1.8, 2.0)
    assert shared(2.0, None, 2.0) == pytest.approx((1.9, 2.0))
    assert shared(None, None, 2.0) == (0.0, 2.0)


def arm(rng: np.random.Generator) -> Robot:
    """Return an arm with limits that differ by joint and direction, the tool's among them."""
    robot = load_robot("planar2r")
    fields: dict[str, Any] = {
        name: np.stack([-rng.uniform(1, 9, 2), rng.uniform(1, 9, 2)], axis=1)
        for name in (*QUANTITIES, "position", "effort")
    }
    tcp = ToolLimits(**{name: float(rng.uniform(1, 9)) for name in vars(ToolLimits())})
    return replace(robot, limits=replace(robot.limits, tcp=tcp, **fields))


@pytest.mark.parametrize("seed", few(range(8), 3))
def test_inside_a_zone_each_limit_of_a_joint_is_the_looser_and_of_the_tool_the_tighter(seed: int) -> None:
    rng = np.random.default_rng(seed)
    one, other = arm(rng), arm(rng)
    places = np.array([[0.3, 1.2], [0.9, 1.25], [1.0, 2.0]])
    courses = [joint_line(*ends, robot) for *ends, robot in ((*places[:2], one), (*places[1:], other))]
    around, rest = ZoneAround(one, places[1], Zone(position=0.02)), np.zeros(2)
    chain = chain_of(courses, [around], (rest, rest), [1.0])
    (corner,) = chain.corners
    looser = with_looser_limits(one, other)
    for name in (*QUANTITIES, "position", "effort"):
        pair = [getattr(each.limits, name) for each in (one, other)]
        for found in (looser, corner.robot):
            rows = getattr(found.limits, name)
            np.testing.assert_array_equal(rows[:, 0], np.minimum(*(each[:, 0] for each in pair)))
            np.testing.assert_array_equal(rows[:, 1], np.maximum(*(each[:, 1] for each in pair)))
    for name in vars(ToolLimits()):
        pair = [getattr(each.limits.tcp, name) for each in (one, other)]
        assert getattr(looser.limits.tcp, name) == max(pair)
        assert getattr(corner.robot.limits.tcp, name) == min(pair)
    assert chain.stretch(0) == (0.0, corner.left)
    assert chain.stretch(1) == (corner.joined, 1.0)
    for course, s in ((courses[0], corner.left), (courses[1], corner.joined)):
        assert around.shares(course.curve.evaluate(np.array([s])))[0] == pytest.approx(1.0, rel=1e-9)


def test_a_smaller_part_of_a_zone_has_borders_nearer_to_its_corner() -> None:
    robot = load_robot("planar2r")
    places = np.array([[0.3, 1.2], [0.9, 1.25], [1.0, 2.0]])
    courses = [joint_line(*ends, robot) for ends in (places[:2], places[1:])]
    around, rest = ZoneAround(robot, places[1], Zone(joints=(0.1, 0.1))), np.zeros(2)
    for part in (1.0, 0.5):
        (corner,) = chain_of(courses, [around], (rest, rest), [part]).corners
        assert 1.0 - corner.left == pytest.approx(part * 0.1 / 0.6, rel=1e-9)
        assert corner.joined == pytest.approx(part * 0.1 / 0.75, rel=1e-9)


@pytest.mark.parametrize("shares", [(0.5, 1.0, 1.0), (1.0, 0.3, 1.0), (0.9, 0.8, 0.1)])
def test_at_its_pace_a_motion_uses_no_more_than_the_parts_of_limits_and_of_one_all(
    shares: tuple[float, float, float],
) -> None:
    robot = arm(np.random.default_rng(3))
    corner = CornerZone(ZoneAround(robot, np.zeros(2), Zone(position=0.1)), 0.5, 0.5, robot, shares)
    powers = corner.pace ** np.arange(1, 4)
    assert (powers <= np.array(shares) * (1 + 1e-12)).all()
    assert np.isclose(powers, shares, rtol=1e-12).any()
    for name, share in zip(QUANTITIES, shares, strict=True):
        np.testing.assert_allclose(getattr(corner.limits, name), share * getattr(robot.limits, name))
    np.testing.assert_array_equal(corner.limits.position, robot.limits.position)


def test_inside_a_zone_the_higher_of_two_speeds_that_laws_name_counts_beside_limits_of_the_tool() -> None:
    rng = np.random.default_rng(3)
    robots = [arm(rng), arm(rng)]
    free, slow, fast = (
        ToolLimits(),
        ToolLimits(speed=0.1, acceleration=0.4, angular_speed=0.3),
        ToolLimits(speed=0.2, acceleration=0.5, angular_speed=0.2),
    )
    limits = [robot.limits.tcp for robot in robots]
    for laws, speeds in (
        ((slow, fast), (0.2, 0.3)),
        ((fast, slow), (0.2, 0.3)),
        ((slow, free), [min(getattr(each, name) for each in limits) for name in ("speed", "angular_speed")]),
    ):
        courses = [SimpleNamespace(robot=robot, tcp=law) for robot, law in zip(robots, laws, strict=True)]
        inside = _inside(*courses).limits.tcp  # type: ignore[arg-type]
        assert (inside.speed, inside.angular_speed) == tuple(speeds)
        for name in ("acceleration", "jerk", "angular_acceleration", "angular_jerk"):
            assert getattr(inside, name) == min(getattr(each, name) for each in limits)
