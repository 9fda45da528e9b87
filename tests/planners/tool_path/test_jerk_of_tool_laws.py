"""Limits of jerk along paths of the tool, and how much slower than its law a motion must be for the tool."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace as Some
from typing import Any

import numpy as np
import pytest

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.curves.third_order.jerk import LawJerkConstraint
from trajcli.curves.third_order.parameterization import JerkLimitedMotion
from trajcli.curves.time_optimal.parameterization import TimeOptimalMotion
from trajcli.geometry.paths.arc import Arc
from trajcli.geometry.paths.chain import join
from trajcli.geometry.paths.orientation import AxisAngleOrientation, SegmentProgress
from trajcli.geometry.paths.pose import PoseCurve
from trajcli.geometry.paths.position import Line, Pivot
from trajcli.kinematics.following.tool_path import SpeedLimits, ToolPath
from trajcli.kinematics.robot import Joint, Robot, ToolLimits, unlimited
from trajcli.planners.tool_constraint import ToolJerkConstraint
from trajcli.planners.tool_path.law import LawSpec
from trajcli.planners.tool_path.time_optimal import (
    _events,
    _remaining_stretch,
    jerk_constraints,
    limits_of_law,
)

ARM = Robot("turning", (Joint("a", a=0.5),), unlimited(1), "standard", np.eye(4), np.eye(4))
CURVE = PiecewisePolynomial(np.array([0.0, 1.0]), np.array([1.0, 0.0]).reshape(2, 1, 1))
START = np.array([0.5, 0.0, 0.0])
ALONG_X, ALONG_Z = Line(START, np.array([0.9, 0.0, 0.0])), Line(START, np.array([0.5, 0.0, 0.4]))
IN_Z = Arc.through(START, np.array([0.6, 0.0, 0.1]), np.array([0.7, 0.0, 0.0]))
UPRIGHT = Arc.through(START, np.array([0.5, 0.1, 0.1]), np.array([0.5, 0.0, 0.2]))
THEN_BENT = join([Line(np.array([0.4, 0.0, 0.0]), START), IN_Z])
TURN = Pivot(START, START, 0.8)


def constraints(position: Any, jerk: float, angular: float, own: float | None) -> tuple[float | None, Any]:
    """Return the limit of the jerk of a law, and those of the tool; None for none."""
    turned = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    turn = AxisAngleOrientation(np.stack([np.eye(3), turned]), SegmentProgress.even(position.length))
    path = ToolPath(PoseCurve(position, turn), (True, True, True), "all", "z", ())
    robot = replace(ARM, limits=replace(ARM.limits, tcp=ToolLimits(jerk=jerk, angular_jerk=angular)))
    found = jerk_constraints(Some(robot=robot, path=path), CURVE, LawSpec(shape="time_optimal", jerk=own))  # type: ignore[arg-type]
    laws = [each.limit for each in found if isinstance(each, LawJerkConstraint)]
    tools = [each.jerk for each in found if isinstance(each, ToolJerkConstraint)]
    assert len(laws) + len(tools) == len(found)
    assert max(len(laws), len(tools)) <= 1
    return (laws or [None])[0], (tools or [None])[0]


INF = np.inf


@pytest.mark.parametrize("line", [ALONG_X, ALONG_Z])
@pytest.mark.parametrize(
    ("jerk", "angular", "own", "of_law", "of_tool"),
    [
        (INF, INF, None, None, None),
        (7.0, INF, None, 7.0, None),
        (7.0, INF, 3.0, 3.0, None),
        (7.0, INF, 9.0, 9.0, None),  # what a law names takes the place of the limit
        (INF, INF, 3.0, 3.0, None),
        (7.0, 5.0, None, 7.0, (INF, 5.0)),
        (INF, 5.0, 3.0, 3.0, (INF, 5.0)),
    ],
)
def test_along_a_line_the_jerk_of_the_law_is_that_of_the_tool(
    line, jerk, angular, own, of_law, of_tool
) -> None:
    assert constraints(line, jerk, angular, own) == (of_law, of_tool)


@pytest.mark.parametrize("arc", [IN_Z, UPRIGHT, THEN_BENT])
@pytest.mark.parametrize(
    ("jerk", "angular", "own", "of_law", "of_tool"),
    [
        (INF, INF, None, None, None),
        (7.0, INF, None, None, (7.0, INF)),
        (7.0, 5.0, 3.0, 3.0, (7.0, 5.0)),
        (INF, 5.0, None, None, (INF, 5.0)),
        (INF, INF, 3.0, 3.0, None),
    ],
)
def test_around_an_arc_both_are_limited(arc, jerk, angular, own, of_law, of_tool) -> None:
    assert constraints(arc, jerk, angular, own) == (of_law, of_tool)


def test_a_turn_in_its_place_has_an_angular_jerk_alone() -> None:
    assert constraints(TURN, 7.0, INF, None) == (None, None)
    assert constraints(TURN, 7.0, 5.0, None)[0] is None
    assert constraints(TURN, 7.0, 5.0, None)[1][1] == 5.0


def swinging(duration: float, degree: int) -> PiecewisePolynomial:
    """Return an arm that turns by 1 rad in some time, its angle as a power of that, in three pieces."""
    breaks = np.linspace(0.0, duration, 4)
    power = np.poly1d([duration**-degree] + [0.0] * degree)
    pieces = [np.poly1d(power(np.poly1d([1.0, start]))).coeffs for start in breaks[:3].tolist()]
    return PiecewisePolynomial(breaks, np.stack(pieces, axis=1)[..., None])


def motion(trajectory: PiecewisePolynomial, **said: Any) -> TimeOptimalMotion:
    grid = np.linspace(0, 1, 3)
    fields: dict[str, Any] = {"stretch": 1.0, "tightened": 0, "refinements": 0, "grid": grid, "lost": 0.0}
    fields |= {"stops": np.zeros(0), "stop_times": np.zeros(0), "lower_bound": 1.0, **said}
    kind = JerkLimitedMotion if "steps" in fields else TimeOptimalMotion
    return kind(trajectory=trajectory, law=trajectory, **fields)


@pytest.mark.parametrize(
    ("degree", "limits", "factor"),
    [
        (1, {}, 1.0),
        (1, {"speed": 0.1}, 2.5),  # 0.5 m times 0.5 rad/s
        (1, {"angular_speed": 0.2}, 2.5),
        (1, {"acceleration": 0.05}, 2.5**0.5),  # 0.5 m times its square
        (2, {"angular_acceleration": 0.1}, 5.0**0.5),  # of 1/2 t^2 / 4
        (1, {"speed": 0.1, "angular_speed": 0.25}, 2.5),
        (1, {"speed": 0.125, "angular_speed": 0.2}, 2.5),
        (1, {"speed": 0.3}, 1.0),
        (1, {"speed": 0.25 * (1 - 1e-5)}, 1 + 1e-5),
        (1, {"speed": 0.25 * (1 - 1e-8)}, 1.0),  # no more than peaks are known
        (1, {"jerk": 1e-9, "angular_jerk": 1e-9}, 1.0),  # a law has its own
    ],
)
def test_a_motion_is_slowed_until_the_tool_keeps_each_limit(
    degree: int, limits: dict[str, float], factor: float
) -> None:
    found = _remaining_stretch(ARM, motion(swinging(2.0, degree)), ToolLimits(**limits), None)
    assert found == pytest.approx(factor, rel=2e-6)
    assert found >= 1.0


@pytest.mark.parametrize(
    ("speed", "angular", "factor"),
    [
        ((9.0, 9.0, 9.0), (INF, INF, INF), 1.0),
        ((9.0, 0.1, 9.0), (INF, INF, INF), 2.5),
        ((9.0, 9.0, 0.1), (INF, INF, INF), 2.5),
        ((0.2, 9.0, 9.0), (INF, INF, 0.25), 2.0),
        ((INF, INF, INF), (0.125, INF, INF), 4.0),
    ],
)
@pytest.mark.parametrize("whole", [{}, {"angular_speed": 0.4}])
def test_each_segment_has_its_own_speed(
    speed: tuple[float, ...], angular: tuple[float, ...], factor: float, whole: dict[str, float]
) -> None:
    """s is the angle: the arm goes 0.5 rad/s and 0.25 m/s all the way."""
    speeds = SpeedLimits(np.linspace(0, 1, 4), (0, 1, 2, 3), np.array(speed), np.array(angular))
    found = _remaining_stretch(ARM, motion(swinging(2.0, 1)), ToolLimits(**whole), speeds)
    assert found == pytest.approx(max(factor, 1.25 if whole else 1.0), rel=2e-6)
    highest = limits_of_law(LawSpec(shape="time_optimal"), ToolLimits(speed=3.0), speeds)
    assert (highest.speed, highest.angular_speed) == (max(speed), max(angular))


def test_what_was_conceded_is_said() -> None:
    """Stops that limits of jerk ask for, how near the fastest it is, and by how much it was slowed down."""
    curve = swinging(2.0, 1)
    stopping = {"stops": np.array([0.3, 0.6]), "stop_times": np.array([1.0, 2.0])}
    third = {"steps": 3, "bounding_joint": None, "bounded_by_stops": False}
    made = _events(motion(curve, **stopping, **third), ARM, 1.0, fastest=False)
    assert [event.kind for event in made] == ["refined", "stops"]
    assert made[1].message == "stops 2 times where the path bends: limits of jerk ask for it"
    assert [event.kind for event in _events(motion(curve, **stopping), ARM, 1.0, fastest=False)] == []
    (refined, bound, slower) = _events(
        motion(curve, stretch=1.5, refinements=1, lower_bound=1.6), ARM, 2.0, fastest=True
    )
    assert (refined.kind, bound.kind) == ("refined", "bound")
    assert bound.message.startswith("at most 150 % above")  # 2 s times 2 over 1.6 s
    assert "3" in slower.message
    assert [event.kind for event in _events(motion(curve), ARM, 1.0, fastest=True)] == ["bound"]
