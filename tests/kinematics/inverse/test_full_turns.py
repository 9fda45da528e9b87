"""Full turns of a joint: on both sides of limits, with the tolerance of a limit, and of the nearer excess."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from trajcli.kinematics.inverse.joint_turns import FULL, all_turns, beyond, choose_turns, widened
from trajcli.kinematics.robot import Joint, Robot, unlimited


def arm(*bounds: tuple[float, float], kind: str = "revolute") -> Robot:
    joints = tuple(Joint(f"q{k}", kind) for k in range(len(bounds)))
    limits = replace(unlimited(len(bounds)), position=np.array(bounds))
    return Robot("turns", joints, limits, "standard", np.eye(4), np.eye(4))


def turned(
    value: float, bounds: tuple[float, float], near: float | None = None, within: float = np.inf
) -> float:
    joints = np.array([[[value]]])
    choose_turns(arm(bounds), joints, None if near is None else np.array([[near]]), within)
    return float(joints[0, 0, 0])


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("limit", [0.0, 2.0, 1e3])
def test_a_value_at_its_limit_is_inside_by_its_tolerance_and_no_more(limit: float, side: float) -> None:
    """limit (1 + 1e-9) + 1e-12, outwards at both ends."""
    bounds = np.array([[-5.0 - limit, limit]]) if side > 0 else np.array([[-limit, 5.0 + limit]])
    slack = limit * 1e-9 + 1e-12
    low, high = widened(bounds)[0]
    assert low < bounds[0, 0]
    assert high > bounds[0, 1]
    near = high if side > 0 else -low
    assert near - limit == pytest.approx(slack, rel=1e-3)
    for share, out in ((0.9, False), (1.2, True)):
        found = beyond(np.array([side * (limit + share * slack)]), bounds)[0]
        assert (found != 0.0) == out
        assert found * side >= 0.0
    assert widened(np.array([[-np.inf, np.inf]])).tolist() == [[-np.inf, np.inf]]


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_of_no_turn_inside_the_one_with_the_smaller_excess_is_taken(side: float) -> None:
    """Limits of half a radian about 0: 2.5 and 2.5 - 2 pi are outside; so are 4 and 4 - 2 pi, which is nearer."""
    for value, wanted in ((2.5, 2.5), (2.5 - FULL, 2.5), (4.0, 4.0 - FULL), (4.0 - FULL, 4.0 - FULL)):
        assert turned(side * value, (-0.5, 0.5)) == pytest.approx(side * wanted)
    # limits that are not even: from -0.5 to 2 the distances are 2.5 above, and 1.28 below
    assert turned(side * 4.5, tuple(sorted((-0.5 * side, 2.0 * side)))) == pytest.approx(side * (4.5 - FULL))


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_narrow_limit_on_one_side_alone_is_kept(side: float) -> None:
    """Values are within half a turn; the other side is free."""
    bounds = (-0.5, 9.0) if side > 0 else (-9.0, 0.5)
    assert turned(-side * 1.0, bounds, within=np.pi) == pytest.approx(side * (FULL - 1.0))
    assert turned(side * 1.0, bounds, within=np.pi) == side * 1.0


def test_every_turn_inside_is_a_choice_and_none_is_lost() -> None:
    wide, narrow, free = (-7.0, 13.0), (-0.1, 0.1), (-np.inf, np.inf)
    choices = all_turns(arm(wide, narrow, free), np.array([0.5, 2.0, 1.0]))
    assert sorted(choices[:, 0]) == pytest.approx([0.5 - FULL, 0.5, 0.5 + FULL])
    assert (choices[:, 1:] == [2.0, 1.0]).all()  # no turn brings the second inside
    slides = all_turns(arm((-9.0, 9.0), kind="prismatic"), np.array([0.5]))
    assert slides.tolist() == [[0.5]]
    pinned = all_turns(arm(wide, wide), np.array([0.5, 0.5]), [0])
    assert (pinned[:, 0] == 0.5).all()
    assert len(pinned) == 3
    edge = all_turns(arm((-np.pi, np.pi)), np.array([np.pi]))
    assert sorted(edge[:, 0]) == pytest.approx([-np.pi, np.pi])
