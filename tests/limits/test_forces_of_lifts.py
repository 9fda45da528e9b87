"""Limits of efforts of two lifts, whose forces are known: each joint, each direction, with and without gravity."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.dynamics.effort_bound import EffortPeak
from trajcli.findings import Finding
from trajcli.kinematics.robot import Friction, Joint, LinkInertia, Payload, Robot, unlimited
from trajcli.limits.effort import FAMILY, MoveEfforts, gravity_problem
from trajcli.limits.kinds import LimitedMove
from trajcli.limits.tolerances import EFFORT_RELATIVE
from trajcli.trajectory import Span, State, Trajectory

MASS, G = 5.0, 9.81


def lifts(bounds: list[list[float]], gravity: float = G) -> Robot:
    """Return two slides along one vertical line; the second one carries 5 kg, and the first one no more."""
    links = LinkInertia(1e-9, (0.0, 0.0, 0.0), (0.0,) * 6), LinkInertia(MASS, (0.0, 0.0, 0.0), (0.0,) * 6)
    joints = tuple(Joint(f"s{k}", "prismatic", link=links[k]) for k in range(2))
    limits = replace(unlimited(2), effort=np.array(bounds))
    return Robot(
        "lifts", joints, limits, "standard", np.eye(4), np.eye(4), gravity=np.array([0.0, 0.0, -gravity])
    )


def moved(robot: Robot, acceleration: float, begins: float = 0.0) -> LimitedMove:
    """Return the second lift with one acceleration for a second, perhaps after a rest."""
    rows = np.zeros((3, 1, 2))
    rows[0, 0, 1] = acceleration / 2
    breaks = np.array([0.0, 1.0])
    if begins:
        rows, breaks = (
            np.concatenate([np.zeros((3, 1, 2)), rows], axis=1),
            np.array([0.0, begins, begins + 1.0]),
        )
    curve = PiecewisePolynomial(breaks, rows)
    states = (State(*(np.zeros(2) for _ in range(3))) for _ in range(2))
    span = Span(1, "quintic", begins, begins + 1.0, 2)
    trajectory = Trajectory(curve, robot.joint_names, robot.joint_types, (span,), *states)
    return LimitedMove(trajectory, span, robot.limits, robot)


def over(robot: Robot, acceleration: float, begins: float = 0.0) -> list[Finding]:
    survey = FAMILY.survey(moved(robot, acceleration, begins))
    assert survey is not None
    return list(survey.over(robot, begins))


WIDE = [-900.0, 900.0]


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("joint", [0, 1])
@pytest.mark.parametrize("begins", [0.0, 2.5])
def test_a_force_over_its_limit_is_found_with_the_stretch_that_helps(
    begins: float, joint: int, side: float
) -> None:
    """Both need m (g + 4) = 69.05 N; at k times the duration m (g + 4 / k^2). Gravity may point up."""
    needed, limit = MASS * (G + 4.0), 60.0
    bounds = [WIDE, WIDE]
    bounds[joint] = [-900.0, limit] if side > 0 else [-limit, 900.0]
    robot = lifts(bounds, side * G)
    (found,) = over(robot, side * 4.0, begins)
    assert (found.kind, found.joint, found.method, found.severity) == (
        "effort",
        f"s{joint}",
        "bounded",
        "error",
    )
    assert [found.value, found.limit] == pytest.approx([side * needed, side * limit], rel=1e-6)
    assert found.factor == pytest.approx(np.sqrt(MASS * 4.0 / (limit - MASS * G)), rel=1e-5)
    assert -1e-9 <= found.time <= 1.0 + 1e-9
    assert found.message.startswith("{joint} needs a force of {value}")
    assert found.amounts["gravity"].value == pytest.approx(side * MASS * G)
    assert [found.amounts[name].rounded for name in ("value", "limit")] == (
        ["up", "down"] if side > 0 else ["down", "up"]
    )
    assert over(robot, side * 2.1, begins) == []


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("joint", [0, 1])
def test_what_gravity_alone_exceeds_no_duration_helps(joint: int, side: float) -> None:
    bounds = [WIDE, WIDE]
    bounds[joint] = [-900.0, 40.0] if side > 0 else [-40.0, 900.0]
    robot = lifts(bounds, side * G)
    survey = FAMILY.survey(moved(robot, side * 1.0))
    assert survey is not None
    (found,) = survey.over(robot)
    assert found.factor is None
    assert [each.time for each in survey.over(robot, 0.0)] == [found.time]
    held = survey.held_over()
    assert held is not None
    assert (held[0], held[1]) == (joint, side * 40.0)
    assert held[2].static == pytest.approx(MASS * G)
    bounds[joint] = [-900.0, 52.0] if side > 0 else [-52.0, 900.0]
    slower = FAMILY.survey(moved(lifts(bounds, side * G), side * 1.0))
    assert slower is not None
    assert slower.held_over() is None
    assert len(list(slower.over(robot))) == 1


def rubbing(limit: float, down: float, up: float, side: float) -> MoveEfforts:
    """Return what a lift with 15 N of friction needs that is braked for a second as it falls, and is slow behind it.

    Accelerations are upwards; of gravity that points up all is mirrored. Forces are m (g + down) - 15 while it
    goes down, and m (g + up) + 15 while it goes up again.
    """
    robot = lifts([WIDE, [-900.0, limit] if side > 0 else [-limit, 900.0]], side * G)
    friction = Friction(coulomb=15.0)
    robot = replace(robot, joints=(robot.joints[0], replace(robot.joints[1], friction=friction)))
    curve = PiecewisePolynomial(np.array([0.0, 1.0, 2.0]), np.zeros((3, 2, 2)))
    rows = curve.coefficients.copy()
    rows[:, 0, 1] = [side * down / 2, -side * down, 0.0]
    rows[:, 1, 1] = [side * up / 2, side * (2.0 - min(up, 0.0)), -side * down / 2]
    curve = replace(curve, coefficients=rows)
    states = (State(*(np.zeros(2) for _ in range(3))) for _ in range(2))
    span = Span(1, "quintic", 0.0, 2.0, 2)
    trajectory = Trajectory(curve, robot.joint_names, robot.joint_types, (span,), *states)
    survey = FAMILY.survey(LimitedMove(trajectory, span, robot.limits, robot))
    assert survey is not None
    return survey


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_what_holds_it_over_is_where_gravity_with_friction_is_largest(side: float) -> None:
    """It is most where the fall is braked, and would go away there; with friction gravity is too much on the way up."""
    survey = rubbing(60.0, 12.0, 0.1, side)
    peak = (survey.highest if side > 0 else survey.lowest)[1]
    assert peak.time <= 1.0
    assert peak.upper_bound == pytest.approx(MASS * (G + 12.0) - 15.0)
    held = survey.held_over()
    assert held is not None
    assert (held[0], held[1]) == (1, side * 60.0)
    assert held[2].static == pytest.approx(MASS * G + 15.0)
    assert held[2].time >= 1.0


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_motion_that_a_stretch_brings_within_its_limit_is_not_held_over(side: float) -> None:
    """Gravity with friction takes 64.05 N on the way up, where it slows down; 1.5 times as long all is within 60 N."""
    limit = 60.0
    down = 1.5**2 * (limit - MASS * G + 15.0) / MASS
    up = 1.5**2 * (limit * (1 + 0.2 * EFFORT_RELATIVE) - MASS * G - 15.0) / MASS
    survey = rubbing(limit, down, up, side)
    (found,) = survey.over(lifts([WIDE, WIDE]))
    assert found.factor == pytest.approx(1.5, rel=1e-5)
    assert survey.held_over() is None


def test_gravity_at_its_limit_does_not_exceed_it() -> None:
    survey = FAMILY.survey(moved(lifts([WIDE, WIDE]), 1.0))
    assert survey is not None
    held = survey.survey.peak(1, 1, np.inf).static
    assert held == pytest.approx(MASS * G)
    at_it = FAMILY.survey(moved(lifts([WIDE, [-900.0, held]]), 1.0))
    assert at_it is not None
    (found,) = at_it.over(lifts([WIDE, WIDE]))
    assert found.factor is None
    assert at_it.held_over() is None


def peaks(*highest: float) -> tuple[EffortPeak, ...]:
    """Return peaks of which half is sampled: what is proven counts."""
    return tuple(EffortPeak(each / 2, 0.0, each, (each / 2, 0.0, 0.0, 0.0)) for each in highest)


@pytest.mark.parametrize("share", [1 + 2 * EFFORT_RELATIVE, 1 - 1e-9, 0.5])
@pytest.mark.parametrize(("joint", "sign"), [(0, 1), (0, -1), (1, 1), (1, -1)])
def test_the_largest_share_of_all_joints_and_directions_counts(joint: int, sign: int, share: float) -> None:
    """Limits differ by joint and direction; all others take a tenth of theirs."""
    bounds = [[-10.0, 20.0], [-40.0, 30.0]]
    robot = lifts(bounds)
    highest, lowest = [2.0, 3.0], [1.0, 4.0]
    taken = share * (bounds[joint][1] if sign > 0 else -bounds[joint][0])
    (highest if sign > 0 else lowest)[joint] = taken
    survey = MoveEfforts(robot, None, peaks(*highest), peaks(*lowest))  # type: ignore[arg-type]
    assert survey.share() == pytest.approx(share)
    assert (survey.excess() > 0) == (share > 1)
    found = [(k, way, limit) for k, way, limit, _ in survey.beyond()]
    size = bounds[joint][1] if sign > 0 else -bounds[joint][0]
    assert found == ([(joint, sign, size)] if share > 1 else [])
    nothing = MoveEfforts(robot, None, peaks(np.nan, 0.0), peaks(0.0, 0.0))  # type: ignore[arg-type]
    assert [(k, way) for k, way, _, _ in nothing.beyond()] == [(0, 1)]


def test_all_that_is_over_is_found() -> None:
    survey = MoveEfforts(lifts([[-1.0, 1.0]] * 2), None, peaks(2.0, 2.0), peaks(2.0, 2.0))  # type: ignore[arg-type]
    assert [(k, way) for k, way, _, _ in survey.beyond()] == [(0, 1), (0, -1), (1, 1), (1, -1)]


def test_half_of_the_tolerance_is_left_to_rounding() -> None:
    for share, over_it in ((1 + 0.4 * EFFORT_RELATIVE, False), (1 + 0.6 * EFFORT_RELATIVE, True)):
        survey = MoveEfforts(lifts([[-1.0, 1.0]] * 2), None, peaks(share, 0.0), peaks(0.0, 0.0))  # type: ignore[arg-type]
        assert (survey.excess() > 0) == over_it
        assert list(survey.beyond()) == []


def test_a_move_without_length_and_an_arm_that_nobody_knows_have_none() -> None:
    move = moved(lifts([WIDE, WIDE]), 1.0)
    assert FAMILY.survey(replace(move, robot=None)) is None
    still = replace(move, span=replace(move.span, end=move.span.start))
    assert FAMILY.survey(still) is None


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_force_behind_a_turning_joint_is_told_in_newtons_with_its_own_name(side: float) -> None:
    """5 kg on a lift that stands on a turntable, sped up by 0.5 m/s^2 against 3 N of friction."""
    robot = lifts([WIDE, [-40.0, 40.0]], side * G)
    slide = replace(robot.joints[1], friction=Friction(3.0, 0.0))
    robot = replace(robot, joints=(Joint("turn", link=robot.joints[0].link), slide))
    (found,) = over(robot, side * 0.5)
    sign = "-" * (side < 0)
    assert found.text().startswith(f"s1 needs a force of {sign}54.55")
    assert found.text().endswith(f"{sign}49.05 N of it against gravity; its limit is {sign}40 N")


@pytest.mark.parametrize(("rubs", "time"), [(True, 0.25), (False, None)])
def test_what_gravity_alone_takes_is_told_with_its_place(time: float | None, *, rubs: bool) -> None:
    robot = lifts([WIDE, [-40.0, 40.0]])
    robot = replace(robot, joints=(Joint("turn", link=robot.joints[0].link), robot.joints[1]))
    problem = gravity_problem(robot, 1, -52.05, -40.0, np.array([0.5, 0.1]), rubs=rubs, time=time)
    cause, when = ("gravity with friction", "at t = 0.25 s of the move, ") if rubs else ("gravity", "")
    joints = "0.5, 0.1: 12.05 N more than its effort limit of -40 N"
    assert problem.text() == f"{cause} alone takes -52.05 N of s1 {when}with the joints at {joints}"
    assert [problem.amounts[name].joint for name in ("q0", "q1")] == [0, 1]
    assert (problem.joint, problem.time, problem.value, problem.limit) == ("s1", time, -52.05, -40.0)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_what_a_lift_carries_counts(side: float) -> None:
    """5 kg and 2 kg more, 68.67 N."""
    carried = Payload(2.0, np.zeros(3), np.zeros((3, 3)))
    robot = replace(lifts([WIDE, [-60.0, 60.0]], side * G), payload=carried)
    (found,) = over(robot, 0.0)
    assert found.value == pytest.approx(side * 7.0 * G, rel=1e-6)
