"""Full turns of joints against a plain search among thirteen of them, for limits of every kind."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from trajcli.errors import InputError
from trajcli.kinematics.inverse.joint_turns import all_turns, beyond, choose_turns, widened
from trajcli.kinematics.robot import Joint, Robot, unlimited

FULL = 2 * np.pi
TURNS = FULL * np.arange(-6, 7)
LIMITS = [
    (-2 * np.pi, 2 * np.pi),
    (-0.5, 4.0),
    (-9.0, -1.0),
    (1.0, 9.0),
    (-1.0, 0.5),
    (2.0, 2.5),
    (-np.inf, np.inf),
    (-np.inf, 3.0),
    (-3.0, np.inf),
]
"""Two turns, less than one on either side of zero, nearly none, and open to one side or both."""


def arm(*limits: tuple[float, float], slides: bool = False) -> Robot:
    """Return joints that turn within limits, and a slide behind them."""
    joints = [Joint(f"j{k}") for k in range(len(limits))] + [Joint("slide", type="prismatic")] * slides
    position = np.array([*limits, *[(-1.0, 1.0)] * slides])
    own = replace(unlimited(len(joints)), position=position)
    return Robot("turning", tuple(joints), own, None, np.eye(4), np.eye(4))


def searched(value: float, aim: float, low: float, high: float) -> tuple[float, float]:
    """Return the distance from the aim of the best turn inside limits, and 0; or 0 and the smallest excess."""
    turns = value + TURNS
    inside = turns[(turns >= low) & (turns <= high)]
    if inside.size:
        return float(np.abs(inside - aim).min()), 0.0
    return 0.0, float(np.maximum(low - turns, turns - high).min())


@pytest.mark.parametrize("limits", LIMITS)
@pytest.mark.parametrize("near", [None, 0.0, 3.0, -8.0])
def test_of_turns_inside_the_limits_the_nearest_is_taken_of_none_that_least_outside(limits, near) -> None:
    """Values from -3 to 3 turns, of which two joints have the same ones: each is moved by its own limits."""
    values = np.random.default_rng(1).uniform(-3 * FULL, 3 * FULL, 200)
    robot = arm((-np.inf, np.inf), limits, slides=True)
    joints = np.stack([values, values, values])[:, None, :]
    found = joints.copy()
    aims = None if near is None else np.full((3, 200), near)
    choose_turns(robot, found, aims)
    turned = (found[1, 0] - values) / FULL
    np.testing.assert_allclose(turned, np.round(turned), atol=1e-9)
    np.testing.assert_array_equal(found[2], joints[2])  # a slide has no turns
    for value, one in zip(values, found[1, 0], strict=True):
        distance, excess = searched(value, near or 0.0, *limits)
        assert max(limits[0] - one, one - limits[1], 0.0) == pytest.approx(excess, abs=1e-9)
        if not excess:
            assert abs(one - (near or 0.0)) == pytest.approx(distance, abs=1e-9)


@pytest.mark.parametrize("limits", [(-2 * np.pi, 2 * np.pi), (-0.5, 4.0), (-4.0, 0.5), (-1.0, 0.5)])
def test_values_that_are_known_to_be_small_are_moved_all_the_same(limits: tuple[float, float]) -> None:
    values = np.random.default_rng(2).uniform(-np.pi, np.pi, 50)
    plain, spared = values[None, None].copy(), values[None, None].copy()
    choose_turns(arm(limits), plain, None)
    choose_turns(arm(limits), spared, None, np.pi)
    np.testing.assert_array_equal(spared, plain)


def test_all_turns_of_all_joints_are_those_inside_the_limits() -> None:
    limits = [LIMITS[0], LIMITS[1], LIMITS[4], LIMITS[6]]
    robot = arm(*limits, slides=True)
    for joints in np.random.default_rng(3).uniform(-6.0, 6.0, (20, 5)):
        choices = []
        for value, (low, high) in zip(joints, limits, strict=False):
            inside = [turn for turn in value + TURNS if low <= turn <= high]
            choices.append(inside if inside and np.isfinite(high) else [value])
        wanted = np.array(sorted(product(*choices, [joints[-1]])))
        found = np.array(sorted(map(tuple, all_turns(robot, joints))))
        np.testing.assert_allclose(found, wanted, atol=1e-12)


@pytest.mark.parametrize("limits", [[(-1e12, 1e12)], [(-1000.0, 1000.0)] * 6])
def test_turns_that_are_too_many_to_list_are_refused(limits: list[tuple[float, float]]) -> None:
    """Limits of a thousand radians, as files have them for wheels, leave 319 turns: 10^15 choices of six joints."""
    with pytest.raises(InputError, match="over 100000 choices of full turns"):
        all_turns(arm(*limits), np.zeros(len(limits)))
    assert len(all_turns(arm((-1000.0, 1000.0), LIMITS[0]), np.array([0.5, 0.5]))) == 319 * 2


@pytest.mark.parametrize("bounds", [(-2.0, 3.0), (0.0, 1.0), (-1.0, 0.0), (-np.inf, 2.0)])
def test_what_is_beyond_a_limit_is_beyond_its_tolerance_and_counted_from_the_limit(bounds) -> None:
    low, high = bounds
    wide = widened(np.array([bounds]))
    for limit, side, index in ((low, -1, 0), (high, 1, 1)):
        if not np.isfinite(limit):
            assert wide[0, index] == limit
            continue
        slack = abs(limit) * 1e-9 + 1e-12
        assert (wide[0, index] - limit) * side == pytest.approx(slack, rel=1e-3)
        for share, outside in ((0.5, False), (2.0, True), (1e6, True)):
            (found,) = beyond(np.array([limit + side * share * slack]), np.array([bounds]))
            assert found == (pytest.approx(side * share * slack, rel=1e-3) if outside else 0.0)
