"""Durations of polynomials: closed forms of the shortest one from rest to rest, and what is lacking for one."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from jerk_limited_moves import arm, state
from numpy.polynomial import Polynomial

from trajcli.errors import MissingLimitError, PlanningError
from trajcli.kinematics.robot import Robot
from trajcli.language.numbers import ReadingContext
from trajcli.planners.planner import Planned
from trajcli.planners.point_to_point.polynomial import Cubic, Quintic, Septic
from trajcli.trajectory import State

INF = np.inf
LAWS = {
    "cubic": Polynomial([0, 0, 3, -2]),
    "quintic": Polynomial([0, 0, 0, 10, -15, 6]),
    "septic": Polynomial([0, 0, 0, 0, 35, -84, 70, -20]),
}
MODELS = {"cubic": Cubic, "quintic": Quintic, "septic": Septic}


def plan(tag: str, start: State, end: State, robot: Robot, **fields: Any) -> Planned:
    names = tuple(joint.name for joint in robot.joints)
    context = ReadingContext(joint_names=names, joint_types=("revolute",) * len(names))
    to = {"joints": end.position.tolist(), "velocity": end.velocity.tolist()}
    if end.acceleration.any():
        to["acceleration"] = end.acceleration.tolist()
    model = MODELS[tag].model_validate({"planner": tag, "to": to, **fields}, context=context)
    return model.plan(start, robot)


def extremes(tag: str, order: int) -> tuple[float, float]:
    """Return the least and the largest value of a derivative of the law from 0 to 1 in the time 1."""
    law = LAWS[tag].deriv(order)
    inner = [root.real for root in law.deriv().roots() if abs(root.imag) < 1e-9 and 0 < root.real < 1]
    values = law(np.array([0.0, 1.0, *inner]))
    return float(values.min()), float(values.max())


@pytest.mark.parametrize("tag", LAWS)
@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.parametrize("way", [0.7, -0.7])
def test_from_rest_to_rest_the_one_limit_that_is_stated_says_how_long(
    tag: str, order: int, way: float
) -> None:
    """A joint beside it that rests needs none; limits differ by direction, and peaks of either sign count."""
    bounds = np.full((3, 2, 2), [-INF, INF])
    bounds[order - 1, 0] = low, high = -1.5, 4.0
    planned = plan(tag, state([0.1, 0.2]), state([0.1 + way, 0.2]), arm(*bounds))
    peaks = way * np.array(extremes(tag, order))
    wanted = max(max(peaks.max(), 0) / high, min(peaks.min(), 0) / low) ** (1 / order)
    assert planned.curve.end == pytest.approx(wanted, rel=1e-9)


@pytest.mark.parametrize("tag", LAWS)
def test_of_several_limits_the_slowest_says_how_long(tag: str) -> None:
    ways, limits = np.array([0.7, -2.0]), np.array([[1.0, 9.0], [20.0, 3.0], [90.0, 70.0]])
    planned = plan(tag, state([0.0, 0.0]), state(ways), arm(*limits))
    alone = [
        (max(np.abs(extremes(tag, order))) * np.abs(ways) / limits[order - 1]) ** (1 / order)
        for order in (1, 2, 3)
    ]
    assert planned.curve.end == pytest.approx(np.max(alone), rel=1e-9)


@pytest.mark.parametrize("tag", LAWS)
def test_a_target_that_is_the_start_lasts_as_long_as_asked(tag: str) -> None:
    robot = arm([1.0], [2.0], [20.0])
    for velocity in (0.0, 0.5):
        here = state([0.3], velocity)
        assert plan(tag, here, here, robot).curve.end == 0.0
        curve = plan(tag, here, here, robot, duration=2.5).curve
        assert curve.end == 2.5
        for order, value in ((0, 0.3), (1, velocity)):
            ends = [side[k, 0] for side, k in zip(curve.piece_ends(order), (0, -1), strict=True)]
            assert ends == pytest.approx([value, value], abs=1e-12)


@pytest.mark.parametrize(
    ("first", "last", "bounds", "lacks"),
    [
        (state([0.0, 0.0]), state([1.0, 1.0]), [[1.0, INF]] * 3, "the velocity of j2 "),
        (state([0.0, 0.0], [0, 0.5]), state([1.0, 0.0], [0, 0.5]), [[1.0, INF]] * 3, "j2"),
        (
            state([0.0, 0.0]),
            state([1.0, 0.0], [0, 0.5]),
            [[1.0, INF]] * 3,
            "the acceleration of j2 ",
        ),
        (
            state([0.0, 0.0]),
            state([0.0, 0.0], 0, [0, 0.5]),
            [[1.0, 1.0], [INF] * 2, [INF] * 2],
            "acceleration",
        ),
        (state([0.0, 0.0]), state([0.0, 0.0], 0, [0, 0.5]), [[1.0, 1.0], [1.0, 1.0], [INF] * 2], "jerk"),
    ],
)
def test_the_limit_that_is_lacking_is_named(first: State, last: State, bounds: Any, lacks: str) -> None:
    with pytest.raises(MissingLimitError, match=lacks):
        plan("quintic", first, last, arm(*bounds))


def test_what_no_motion_can_undercut_does_not_hide_a_parabola() -> None:
    """At 2 rad/s^2 from 1 to 3 rad/s it takes 1 s for 2 rad: neither its start's speed nor its rate says so alone."""
    planned = plan("cubic", state([0.0], 1.0), state([2.0], 3.0), arm([5.0], [2.001], [INF]))
    assert 0.9 < planned.curve.end <= 1.0


def test_no_planner_is_proposed_where_none_finds_a_motion() -> None:
    with pytest.raises(PlanningError, match="no duration") as caught:
        plan("cubic", state([0.0]), state([1.0], 2.0), arm([1.0], [2.0], [20.0]))
    assert caught.value.problems[0].hint == "a boundary velocity or acceleration asks too much: lower it"


@pytest.mark.parametrize(("bound", "other"), [(0.21, True), (0.1, False)])
def test_another_planner_is_proposed_where_it_finds_a_motion(bound: float, other: bool) -> None:
    """From 0.9 rad/s at 2 rad/s^2 a joint stops within 0.2025 rad: a cubic back to its start goes farther."""
    robot = arm([1.0], [2.0], [INF])
    limits = np.array([[-bound, bound]])
    object.__setattr__(robot.limits, "position", limits)
    with pytest.raises(PlanningError, match="no duration") as caught:
        plan("cubic", state([0.0], 0.9), state([0.0]), robot)
    assert ("or use jerk_limited" in (caught.value.problems[0].hint or "")) == other
