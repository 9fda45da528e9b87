"""Limits of the tool where its motion is known in closed form: one link that turns, and one that slides.

A joint that turns with q about an axis at a distance L moves the tool with L q', steps its acceleration by L times
its own step where it rests, and turns it with q'; a slide only moves it.
"""

from __future__ import annotations

from dataclasses import replace
from math import comb, perm

import numpy as np
import pytest

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.kinematics.following.tool_path import SpeedLimits
from trajcli.kinematics.robot import Joint, Robot, ToolLimits, unlimited
from trajcli.limits import tool_bound
from trajcli.limits.kinds import TOOL_KINDS, LimitedMove
from trajcli.limits.tool import FAMILY, ToolSurvey, unjudged
from trajcli.limits.tool_bound import speed_runs, tool_bounds
from trajcli.trajectory import Span, State, Trajectory

LEVER = 0.5
STEP = 2.0


def arm(**tcp: float) -> Robot:
    """Return a joint that turns about z, and a link behind which another one slides along z."""
    joints = (Joint("turn", "revolute", a=LEVER), Joint("slide", "prismatic"))
    limits = replace(unlimited(2), tcp=ToolLimits(**tcp))
    return Robot("link", joints, limits, "standard", np.eye(4), np.eye(4))


def stepping(joint: int, at: int, sign: float) -> LimitedMove:
    """Return a joint at rest, whose acceleration is STEP from a break on: 0 at the start, 1, 2, or 3 at the end."""
    rates = np.where(np.arange(3) >= at, sign * STEP, 0.0)
    rows = np.zeros((3, 3, 2))
    rows[0, :, joint] = rates / 2
    length = 0.1
    speed = np.append(0.0, np.cumsum(rates * length))
    rows[1, :, joint] = speed[:-1]
    rows[2, 1:, joint] = np.cumsum(speed[:-1] * length + rates * length**2 / 2)[:-1]
    curve = PiecewisePolynomial(length * np.arange(4.0), rows)
    end = State(*(curve.evaluate(np.array([curve.end]), order)[0] for order in range(2)), np.zeros(2))
    if at < 3:
        end = replace(end, acceleration=curve.evaluate(np.array([curve.end]), 2)[0])
    else:
        accelerations = np.zeros(2)
        accelerations[joint] = sign * STEP
        end = replace(end, acceleration=accelerations)
    start = State(*(np.zeros(2) for _ in range(3)))
    span = Span(0, "trapezoid", 0.0, curve.duration, 2)
    robot = arm()
    trajectory = Trajectory(curve, robot.joint_names, robot.joint_types, (span,), start, end)
    return LimitedMove(trajectory, span, robot.limits)


def steps_of(move: LimitedMove, **tcp: float) -> dict[str, tuple[float, float]]:
    robot = arm(**tcp)
    survey = FAMILY.survey(replace(move, robot=robot, limits=robot.limits))
    assert isinstance(survey, ToolSurvey)
    return {step.kind.key: (step.size, step.time) for step in survey.steps}


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("at", [0, 1, 2])
@pytest.mark.parametrize("joint", [0, 1])
def test_steps_of_accelerations_whose_derivatives_are_limited(joint: int, at: int, sign: float) -> None:
    move = stepping(joint, at, sign)
    along = {"acceleration": (STEP * (LEVER if joint == 0 else 1.0), 0.1 * at)}
    turning = {"angular_acceleration": (STEP, 0.1 * at)} if joint == 0 else {}

    def near(found: dict[str, tuple[float, float]], wanted: dict[str, tuple[float, float]]) -> bool:
        return found.keys() == wanted.keys() and all(
            found[key] == pytest.approx(wanted[key]) for key in found
        )

    assert steps_of(move, speed=9.0, acceleration=9.0, angular_speed=9.0, angular_acceleration=9.0) == {}
    assert near(steps_of(move, jerk=9.0), along)
    assert near(steps_of(move, angular_jerk=9.0), turning)
    assert near(steps_of(move, jerk=9.0, angular_jerk=9.0), along | turning)
    assert near(steps_of(move, angular_jerk=9.0, speed=1.0, acceleration=9.0), turning)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("at", [0, 1, 2])
def test_a_move_behind_another_one_has_the_steps_of_its_own_breaks(at: int, sign: float) -> None:
    """The same motion, of which the first third is a move of its own: what it steps by before is not of this one."""
    whole = stepping(0, at, sign)
    span = Span(1, "trapezoid", 0.1, whole.span.end, 2)
    found = steps_of(replace(whole, span=span), jerk=9.0)
    assert list(found.values()) == ([pytest.approx((STEP * LEVER, 0.1 * at - 0.1))] if at else [])


@pytest.mark.parametrize(("share", "seen"), [(1e-7, True), (-1e-7, True), (1e-15, False)])
def test_a_step_that_is_small_beside_the_acceleration_is_one_above_rounding(share: float, seen: bool) -> None:
    """Both states say the accelerations that the motion has there: only the last break steps."""
    move = stepping(0, 0, 1.0)
    curve, ends = move.trajectory.curve, np.array([STEP, 0.0])
    rows = curve.coefficients.copy()
    rows[0, 2, 0] *= 1.0 + share
    start, end = (replace(each, acceleration=ends) for each in (move.trajectory.start, move.trajectory.end))
    end = replace(end, acceleration=2.0 * rows[0, 2])
    other = replace(move.trajectory, curve=PiecewisePolynomial(curve.breaks, rows), start=start, end=end)
    found = steps_of(replace(move, trajectory=other), jerk=9.0)
    assert bool(found) is seen
    if seen:
        assert found["acceleration"] == (
            pytest.approx(STEP * LEVER * abs(share), rel=1e-6),
            pytest.approx(0.2),
        )


def test_limits_of_the_tool_of_an_arm_without_geometry_are_judged_by_nobody() -> None:
    known = arm(speed=1.0, angular_jerk=2.0)
    assert unjudged(known.limits, known) == set()
    for blind in (None, replace(known, convention=None)):
        assert unjudged(known.limits, blind) == {"speed", "angular_jerk"}


@pytest.mark.parametrize("joint", [0, 1])
def test_a_step_where_the_motion_ends_is_that_of_who_moves(joint: int) -> None:
    """It rests, and what is said to come after it has an acceleration: that is no step of its own."""
    assert steps_of(stepping(joint, 3, 1.0), jerk=9.0, angular_jerk=9.0) == {}


@pytest.mark.parametrize("beyond", [1e-5, -1e-5])
@pytest.mark.parametrize("last", [False, True])
@pytest.mark.parametrize("key", ["speed", "angular_speed"])
def test_a_tool_at_its_limit_at_an_end_of_a_move_is_not_over_it(key: str, last: bool, beyond: float) -> None:
    qd = np.array([-1.5, 0.0])
    moving, still = State(np.zeros(2), qd, np.zeros(2)), State(np.zeros(2), np.zeros(2), np.zeros(2))
    reached = 1.5 * (LEVER if key == "speed" else 1.0)
    ends = (still, moving) if last else (moving, still)
    robot = arm(**{key: reached / (1 + beyond)})
    assert FAMILY.over_at_ends(robot, ends, (f"tool_{key}", -1, reached)) == (beyond > 0)


def turning(*speeds: float) -> PiecewisePolynomial:
    """Return the first joint at one speed a second."""
    starts = np.append(0.0, np.cumsum(speeds))[:-1]
    rows = np.zeros((2, len(speeds), 2))
    rows[0, :, 0], rows[1, :, 0] = speeds, starts
    return PiecewisePolynomial(np.arange(len(speeds) + 1.0), rows)


@pytest.mark.parametrize("fast", range(4))
def test_every_piece_of_a_motion_is_bounded_and_one_without_length_hides_none(fast: int) -> None:
    speeds = np.full(4, 0.1)
    speeds[fast] = -2.0
    curve = turning(*speeds)
    whole = tool_bounds(arm(), curve.breaks, curve.coefficients, 3)
    for twice in range(5):
        breaks = np.insert(curve.breaks, twice, curve.breaks[twice])
        pieces = np.insert(curve.coefficients, min(twice, 3), curve.coefficients[:, min(twice, 3)], axis=1)
        for one in (whole, tool_bounds(arm(), breaks, pieces, 3)):
            sizes = [peak.upper_bound for peak in one]
            assert sizes == pytest.approx([LEVER * 2, 2, LEVER * 4, 0, LEVER * 8, 0], rel=1e-6, abs=1e-9)
            assert fast - 1e-9 <= one[0].time <= fast + 1 + 1e-9
    still = tool_bounds(arm(), np.zeros(2), curve.coefficients[:, :1], 2)
    assert [peak.upper_bound for peak in still] == [0.0] * 4


@pytest.mark.parametrize("joint", [0, 1])
def test_what_hides_between_nodes_is_bounded_for_every_derivative(joint: int) -> None:
    """q = t^12: the ninth Taylor coefficients of its derivatives are largest at the end, by binomials."""
    coefficients = np.zeros((13, 1, 2))
    coefficients[0, 0, joint] = 1.0
    _, (highest,) = tool_bound._values_of(arm(), coefficients, np.ones(1), 3)
    kinds = [(perm(12, order) * comb(12 - order, 9), order) for order in (1, 2, 3)]
    for largest, order in kinds:
        along, turning = highest[2 * order - 2 : 2 * order]
        lever = LEVER if joint == 0 else 1.0
        assert along >= lever * largest * (1 - 1e-12)
        if joint == 0:
            assert largest * (1 - 1e-12) <= turning <= 100 * largest
        else:
            assert along <= 100 * largest
            assert turning == 0.0


@pytest.mark.parametrize("late", [0.0, 1e-12, -1e-12])
@pytest.mark.parametrize("begins", [0.0, 7.0])
def test_each_interval_of_a_path_has_its_own_speeds(begins: float, late: float) -> None:
    """Along it with 1 m/s; of four intervals the first takes two pieces, and nothing of the last is passed."""
    curve = turning(0.5, 0.3, 0.9, -0.2)
    curve = PiecewisePolynomial(curve.breaks + begins, curve.coefficients)
    law = PiecewisePolynomial(np.array([0.0, 4.0]), np.array([[[1.0]], [[0.0]]]))
    speed, angular = np.array([0.1, 0.2, 0.3, 0.4]), np.array([1.0, 2.0, 3.0, 4.0])
    limits = SpeedLimits(np.array([0.0, 2.0 + late, 3.0 + late, 4.0, 6.0]), (0, 2, 3, 5, 6), speed, angular)
    runs = list(speed_runs(arm(), limits, law, curve))
    assert [run.segments for run in runs] == [(0, 1), (2, 2), (3, 4)]
    assert [run.s for run in runs] == [(0.0, 2.0 + late), (2.0 + late, 3.0 + late), (3.0 + late, 4.0)]
    assert [run.limits for run in runs] == list(zip(speed[:3].tolist(), angular[:3].tolist(), strict=True))
    for run, (first, last), fastest in zip(runs, [(0, 2), (2, 3), (3, 4)], [0.5, 0.9, 0.2], strict=True):
        assert run.times == pytest.approx((begins + first, begins + last))
        assert [peak.upper_bound for peak in run.peaks] == pytest.approx([LEVER * fastest, fastest], rel=1e-6)


def test_the_kinds_of_the_tool_are_those_that_this_file_knows() -> None:
    assert {kind.key for kind in TOOL_KINDS} == set(ToolLimits.__annotations__)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_a_motion_of_no_length_rests_where_it_is_in_all_orders(order: int) -> None:
    found = tool_bounds(arm(), np.array([2.5, 2.5]), np.full((1, 1, 2), 0.3), order)
    assert [(one.value, one.upper_bound, one.time) for one in found] == [(0.0, 0.0, 2.5)] * (2 * order)


@pytest.mark.parametrize("law_start", [0.0, 2.0])
@pytest.mark.parametrize("curve_start", [0.0, 5.0])
def test_intervals_of_speed_have_the_times_of_the_joints_whenever_the_law_begins(
    curve_start: float, law_start: float
) -> None:
    """A lever turns with 1 rad/s for 2 s, and with 3 rad/s for 1 s: with 0.5 m/s, and with 1.5 m/s."""
    law = PiecewisePolynomial(
        law_start + np.array([0.0, 2.0, 3.0]), np.array([[0.5, 1.5], [0.0, 1.0]])[:, :, None]
    )
    rows = np.zeros((2, 2, 2))
    rows[:, :, 0] = [[1.0, 3.0], [0.0, 2.0]]
    curve = PiecewisePolynomial(curve_start + np.array([0.0, 2.0, 3.0]), rows)
    speeds = SpeedLimits(np.array([0.0, 1.0, 2.5]), (0, 2, 3), np.array([7.0, 8.0]), np.array([9.0, 6.0]))
    first, second = speed_runs(arm(), speeds, law, curve)
    assert (first.times, second.times) == (
        (curve_start, curve_start + 2.0),
        (curve_start + 2.0, curve_start + 3.0),
    )
    assert (first.segments, second.segments) == ((0, 1), (2, 2))
    assert (first.s, second.s) == ((0.0, 1.0), (1.0, 2.5))
    assert (first.limits, second.limits) == ((7.0, 9.0), (8.0, 6.0))
    for run, rate in ((first, 1.0), (second, 3.0)):
        assert [peak.upper_bound for peak in run.peaks] == pytest.approx([LEVER * rate, rate], rel=1e-6)


@pytest.mark.parametrize("length", [1e-6, 1e-9])
def test_a_piece_of_a_short_time_is_one_with_a_speed_of_its_own(length: float) -> None:
    """40 rad/s for a nanosecond between two rests."""
    rows = np.zeros((2, 3, 2))
    rows[0, 1, 0] = 40.0
    found = tool_bounds(arm(), np.array([0.0, 0.1, 0.1 + length, 0.2]), rows)
    assert [found[0].upper_bound, found[1].upper_bound] == pytest.approx([LEVER * 40.0, 40.0], rel=1e-6)
    assert found[0].time == pytest.approx(0.1, abs=2 * length)


def test_a_part_of_a_curve_and_another_arm_on_it_have_rates_of_their_own() -> None:
    """Asked for one after the other, from the same start on."""
    curve, robot = turning(0.1, 2.0), arm(speed=9.0)
    rest = State(*(np.zeros(2) for _ in range(3)))
    longer = replace(robot, joints=(replace(robot.joints[0], a=2 * LEVER), robot.joints[1]))
    for one, end, speed in ((robot, 2.0, 2.0), (robot, 1.0, 0.1), (longer, 1.0, 0.2), (robot, 2.0, 2.0)):
        span = Span(0, "trapezoid", 0.0, end, 1)
        trajectory = Trajectory(curve, one.joint_names, one.joint_types, (span,), rest, rest)
        survey = FAMILY.survey(LimitedMove(trajectory, span, one.limits, one))
        assert survey is not None
        assert survey.peaks["speed"].upper_bound == pytest.approx(LEVER * speed, rel=1e-6)
