"""Moves whose phases last whole periods: against every law of whole periods, tried one by one."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pytest
from jerk_limited_moves import arm, move_to, state

from trajcli.kinematics.robot import Robot
from trajcli.language.numbers import ReadingContext
from trajcli.planners.planner import Planned
from trajcli.planners.point_to_point.trapezoid import Trapezoid
from trajcli.planners.point_to_point.whole_periods import PhasesInPeriods
from trajcli.trajectory import State

INF = np.inf


def trapezoid_to(end: list[float], **fields: Any) -> Trapezoid:
    context = ReadingContext(joint_names=("j1", "j2"), joint_types=("revolute",) * 2)
    return Trapezoid.model_validate(
        {"planner": "trapezoid", "to": {"joints": end}, **fields}, context=context
    )


def possible(
    distance: float, bounds: np.ndarray, count: int, period: float, *, smooth: bool, slack: float
) -> bool:
    """Return whether some law of `count` periods covers the distance within its bounds, by its own peaks."""
    for rise, flat in product(range(smooth, count // 2 + 1), range(count)):
        ramp = 2 * rise + flat
        if not 0 < 2 * ramp <= count:
            continue
        velocity = distance / (period * (count - ramp))
        acceleration = velocity / (period * (rise + flat))
        jerk = acceleration / (period * rise) if smooth else 0.0
        if (np.array([velocity, acceleration, jerk]) <= bounds * (1 + slack)).all():
            return True
    return False


def keeps(planned: Planned, robot: Robot, period: float) -> None:
    rows = planned.curve.breaks / period
    assert np.abs(rows - np.rint(rows)).max() < 1e-6
    limits = robot.limits
    for order, bound in ((1, limits.velocity), (2, limits.acceleration), (3, limits.jerk)):
        for ends in planned.curve.piece_ends(order):
            assert (ends >= bound[:, 0] * (1 + 1e-9)).all()
            assert (ends <= bound[:, 1] * (1 + 1e-9)).all()
    steps = planned.curve.piece_ends(2)
    inner = np.abs(steps[0][1:] - steps[1][:-1]).max(axis=0)
    outer = np.maximum(np.abs(steps[0][0]), np.abs(steps[1][-1]))
    assert (np.maximum(inner, outer)[np.isfinite(limits.jerk).all(axis=1)] < 1e-6).all()


@pytest.mark.parametrize("jerk", [(40.0, 90.0), (40.0, INF), (INF, 40.0), (INF, INF), (3.0, 2.0)])
@pytest.mark.parametrize("synchronize", ["time", "phase"])
@pytest.mark.parametrize("target", [(0.7, -0.4), (-0.05, 0.9), (0.0, -0.2)])
def test_a_move_is_the_shortest_of_whole_periods_within_every_limit(
    target: tuple[float, float], synchronize: str, jerk: tuple[float, float]
) -> None:
    """Limits differ by direction, and a joint with a limit of its jerk keeps it beside one without."""
    start, period = np.array([0.1, 0.2]), 0.02
    velocity = np.array([[-0.8, 1.1], [-1.3, 0.7]])
    robot = arm(velocity, np.array([[-3.0, 4.0], [-5.0, 2.5]]), np.outer(jerk, [-2.0, 1.0]))
    move = move_to(state(start + target), synchronize=synchronize)
    planned = move.on_rows(state(start), robot, period, 0.0)
    assert planned is not None
    keeps(planned, robot, period)
    first, last = (ends[k] for ends, k in zip(planned.curve.piece_ends(), (0, -1), strict=True))
    np.testing.assert_allclose([first, last], [start, start + target], atol=1e-12)
    ways = np.array(target)
    moving = np.flatnonzero(ways)
    bounds = np.stack(
        [np.where(ways > 0, velocity[:, 1], -velocity[:, 0]), [3.0, 2.5], np.array(jerk)], axis=1
    )[moving]
    sizes, smooth = np.abs(ways[moving]), bool(np.isfinite(np.array(jerk)[moving]).any())
    if synchronize == "phase":
        bounds, sizes = (bounds / sizes[:, None]).min(axis=0)[None], np.ones(1)
    count = round(planned.curve.duration / period)
    tried = [
        all(
            possible(size, bound, n, period, smooth=smooth, slack=slack)
            for size, bound in zip(sizes, bounds, strict=True)
        )
        for n, slack in ((count, 1e-9), (count - 1, -1e-9))
    ]
    assert tried == [True, False]


def test_the_least_duration_is_kept_in_whole_periods() -> None:
    robot = arm([1.0, 1.0], [2.0, 2.0], [20.0, 20.0])
    for least, wanted in ((3.0, 3.0), (3.0 + 1e-13, 3.0), (3.0 + 2e-9, 3.02), (3.001, 3.02)):
        planned = move_to(state([0.5, 0.1])).on_rows(state([0.0, 0.0]), robot, 0.02, least)
        assert planned is not None
        assert planned.curve.duration == pytest.approx(wanted, rel=1e-12)
        keeps(planned, robot, 0.02)


def test_a_distance_of_hardly_more_periods_than_ramps_take() -> None:
    """At most 1 m/s: in four periods of 20 ms, two of them ramps, 50 mm would take 1.25 m/s."""
    found = PhasesInPeriods(0.02, smooth=True).common([0.05], [[1.0, 1e9, 1e12]], 0.0)
    assert found == (5, [(1, 0, 1)])


def test_moves_that_have_no_such_law_say_so() -> None:
    """Not from rest to rest, each joint by itself, nothing that moves, or so slow that the periods are too many."""
    robot = arm([1.0, 1.0], [2.0, 2.0], [20.0, 20.0])
    still, there = state([0.0, 0.0]), state([0.5, 0.1])
    fast = State(np.array([0.5, 0.1]), np.array([0.1, 0.0]), np.zeros(2))
    moving = State(np.zeros(2), np.array([0.1, 0.0]), np.zeros(2))
    assert move_to(there, synchronize="none").on_rows(still, robot, 0.02, 0.0) is None
    assert move_to(fast).on_rows(still, robot, 0.02, 0.0) is None
    assert move_to(there).on_rows(moving, robot, 0.02, 0.0) is None
    assert move_to(still).on_rows(still, robot, 0.02, 0.0) is None
    assert move_to(there).on_rows(still, arm([1.0, INF], [2.0, 2.0], [20.0, 20.0]), 0.02, 0.0) is None
    assert move_to(there).on_rows(still, robot, 1e-9, 0.0) is None
    assert PhasesInPeriods(0.02, smooth=True).common([1.0], [[1.0, 2.0, 1e-9]], 0.0) is None
    for fields in ({"synchronize": "none"}, {"duration": 2.0, "velocity": [0.3, 0.06]}):
        assert trapezoid_to([0.5, 0.1], **fields).on_rows(still, robot, 0.02, 0.0) is None
    assert trapezoid_to([0.5, 0.1]).on_rows(moving, robot, 0.02, 0.0) is None
    assert (
        trapezoid_to([0.5, 0.1], to={"joints": [0.5, 0.1], "velocity": [0.1, 0.02]}).on_rows(
            still, robot, 0.02, 0.0
        )
        is None
    )
    assert trapezoid_to([0.0, 0.0]).on_rows(still, robot, 0.02, 0.0) is None


@pytest.mark.parametrize(
    ("fields", "rates"),
    [
        ({}, (0.8, 2.5)),
        ({"velocity": [0.3, 0.5]}, (0.3, 2.5)),
        ({"acceleration": [1.5, 9.0]}, (0.8, 1.5)),
        ({"acceleration": [3.5, 9.0], "deceleration": [1.0, 9.0]}, (0.8, 1.0)),
        ({"acceleration": [1.5, 9.0], "deceleration": [2.0, 9.0]}, (0.8, 1.5)),
        ({"duration": 4.001}, (0.8, 2.5)),
    ],
)
def test_a_trapezoid_of_whole_periods_is_the_shortest_within_what_is_given(
    fields: dict[str, Any], rates: tuple[float, float]
) -> None:
    """Both ramps last as long: the smaller of the rates of speeding up and slowing down counts."""
    robot = arm(np.array([[-0.8, 1.1], [-1.3, 1.9]]), np.array([[-3.0, 2.5], [-9.0, 9.5]]), [INF, INF])
    period = 0.02
    planned = trapezoid_to([-0.9, 0.3], **fields).on_rows(state([0.0, 0.0]), robot, period, 0.0)
    assert planned is not None
    keeps(planned, robot, period)
    np.testing.assert_allclose(planned.curve.piece_ends()[1][-1], [-0.9, 0.3], atol=1e-12)
    count, bounds = round(planned.curve.duration / period), np.array([*rates, INF])
    if "duration" in fields:
        assert count == 201
        return
    assert possible(0.9, bounds, count, period, smooth=False, slack=1e-9)
    assert not possible(0.9, bounds, count - 1, period, smooth=False, slack=-1e-9)
    assert [phase.name for phase in planned.phases] == ["accelerate", "cruise", "decelerate"]


def test_a_short_trapezoid_of_whole_periods_has_no_cruise_and_a_longer_one_takes_its_least_duration() -> None:
    robot, still = arm([1.0, 1.0], [2.0, 2.0], [INF, INF]), state([0.0, 0.0])
    short = trapezoid_to([0.02, 0.005]).on_rows(still, robot, 0.05, 0.0)
    assert short is not None
    assert [phase.name for phase in short.phases] == ["accelerate", "decelerate"]
    longer = trapezoid_to([0.02, 0.005], duration=0.5).on_rows(still, robot, 0.05, 2.96)
    assert longer is not None
    assert longer.curve.duration == pytest.approx(3.0, rel=1e-12)
