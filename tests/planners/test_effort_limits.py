"""Motions within efforts: which joints lack a limit, what is done with a solution that is over its limits, and words."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.curves.time_optimal.parameterization import TimeOptimalMotion, time_optimal
from trajcli.errors import PlanningError
from trajcli.kinematics.robot import Friction, Joint, Limits, LinkInertia, Robot, unlimited
from trajcli.planners.effort_limits import (
    effort_constraints,
    effort_shares,
    lacks_acceleration,
    solved_within_efforts,
)

MASS, G, FREE = 5.0, 9.81, np.inf
SIDES = pytest.mark.parametrize("side", [1.0, -1.0])
BOUNDS = {"none": [-FREE, FREE], "lower": [-1.0, FREE], "upper": [-FREE, 1.0], "both": [-1.0, 1.0]}


def lift(bounds: list[float], gravity: float = 0.0, friction: float = 0.0) -> Robot:
    """Return a vertical slide of 5 kg whose force alone is limited."""
    link = LinkInertia(MASS, (0.0, 0.0, 0.0), (0.0,) * 6)
    joint = Joint("lift", "prismatic", friction=Friction(friction), link=link)
    limits = replace(unlimited(1), effort=np.array([bounds]))
    return Robot(
        "lift", (joint,), limits, "standard", np.eye(4), np.eye(4), gravity=np.array([0.0, 0.0, -gravity])
    )


def path(length: float = 1.0) -> PiecewisePolynomial:
    return PiecewisePolynomial(np.array([0.0, 1.0]), np.array([length, 0.0])[:, None, None])


@pytest.mark.parametrize("effort", BOUNDS)
@pytest.mark.parametrize("acceleration", BOUNDS)
def test_a_joint_needs_limits_of_both_directions_of_one_kind(acceleration: str, effort: str) -> None:
    """The one beside it has both."""
    free = np.tile(BOUNDS["none"], (2, 1))
    limits = Limits(free, free, np.array([BOUNDS["both"], BOUNDS[acceleration]]), free)
    limits = replace(limits, effort=np.array([BOUNDS["none"], BOUNDS[effort]]))
    joints = Joint("one", "revolute"), Joint("other", "revolute")
    lacking = lacks_acceleration(Robot("two", joints, limits, "standard", np.eye(4), np.eye(4)))
    assert lacking.tolist() == [False, "both" not in (acceleration, effort)]


def test_shares_of_efforts_are_means_over_the_ends_of_pieces() -> None:
    """A lift whose acceleration grows from 2 to 8 m/s^2, and then stays at -4: limits of 100 N up, 50 N down."""
    rows = np.zeros((4, 2, 1))
    rows[0, 0], rows[1, 0], rows[1, 1] = 1.0, 1.0, -2.0
    curve = PiecewisePolynomial(np.array([0.0, 1.0, 2.0]), rows)
    shares = effort_shares(curve, lift([-50.0, 100.0]))
    assert shares is not None
    np.testing.assert_allclose(shares, [[0.25, -0.5], [-0.2, 0.4]], rtol=1e-12)
    assert effort_shares(curve, replace(lift([-50.0, 100.0]), limits=unlimited(1))) is None


def solved(
    robot: Robot, excess: float, start: float = 0.0, end: float = 0.0
) -> tuple[TimeOptimalMotion, TimeOptimalMotion]:
    """Return what is made of solutions that are always over the limits they are given, and the first of them."""
    made: list[TimeOptimalMotion] = []

    def solve(more: tuple) -> TimeOptimalMotion:
        ((low, high),) = (more[0].limits / MASS * (1.0 + excess)).tolist()
        ends = {"start_velocity": start, "end_velocity": end}
        made.append(time_optimal(path(), [[-FREE, FREE]], [[max(low, -1e3), min(high, 1e3)]], **ends))
        return made[-1]

    return solved_within_efforts(path(), robot, solve), made[0]


def forces(motion: TimeOptimalMotion) -> np.ndarray:
    return MASS * motion.trajectory.evaluate(np.linspace(0, motion.trajectory.end, 4001), 2)[:, 0]


@pytest.mark.parametrize(
    ("excess", "start", "end", "bounds"),
    [
        (excess, *ends, [[-50.0, 40.0], [-40.0, 50.0], [-40.0, 90.0]][(j + k) % 3])
        for j, excess in enumerate([2e-6, 1e-4, 3e-3])
        for k, ends in enumerate([(0.5, 0.0), (0.0, 0.5), (0.5, 0.7)])
    ],
)
def test_a_motion_that_moves_at_an_end_is_solved_with_lower_limits(
    excess: float, start: float, end: float, bounds: list[float]
) -> None:
    """Made longer it would come with another speed than it shall."""
    made, first = solved(lift(bounds), excess, start, end)
    used = forces(made)
    assert max(used.max() / bounds[1], used.min() / bounds[0]) <= 1 + 5.1e-7
    ends = made.trajectory.evaluate(np.array([0.0, made.trajectory.end]), 1)[:, 0]
    assert ends == pytest.approx([start, end], abs=1e-9)
    assert 1.0 < made.trajectory.duration / first.trajectory.duration < 1 + 2 * excess


@pytest.mark.parametrize("bounds", [[-50.0, 40.0], [-40.0, 50.0]])
@pytest.mark.parametrize("excess", [8e-7, 1e-4, 3e-3])
def test_a_motion_from_rest_to_rest_is_made_longer_as_a_whole(excess: float, bounds: list[float]) -> None:
    """Both directions are over; the law, the times of stops, and by what it was stretched go with it."""
    made, first = solved(lift(bounds), excess)
    used = forces(made)
    assert max(used.max() / bounds[1], used.min() / bounds[0]) == pytest.approx(1.0, abs=6e-7)
    longer = made.trajectory.duration / first.trajectory.duration
    assert longer == pytest.approx((1.0 + excess) ** 0.5, abs=4e-7)
    assert longer > 1.0
    assert made.stretch == pytest.approx(first.stretch * longer, rel=1e-12)
    assert made.law.duration == pytest.approx(made.trajectory.duration, rel=1e-12)
    halved = PiecewisePolynomial(np.array([0.0, 1.0]), np.array([1.0, 0.0])[:, None, None])
    halting = time_optimal(halved, [[-FREE, FREE]], [[-8.0 * (1 + excess), 8.0 * (1 + excess)]], stops=[0.5])
    stopped = solved_within_efforts(halved, lift([-40.0, 40.0]), lambda _: halting)
    assert stopped.stop_times == pytest.approx(halting.stop_times * (1 + excess) ** 0.5, abs=1e-6)
    place = stopped.trajectory.evaluate(stopped.stop_times, 0)[:, 0]
    assert place == pytest.approx([0.5], abs=1e-9)
    assert stopped.stop_times[0] != halting.stop_times[0]


@SIDES
def test_a_motion_that_no_stretch_helps_is_left_for_the_verdict(side: float) -> None:
    """A solution that knows nothing of gravity, which between its points takes more than there is."""
    bounds = [-FREE, 40.0] if side > 0 else [-40.0, FREE]
    robot = lift(bounds, side * G)
    alone = time_optimal(path(), [[-FREE, FREE]], [[-8.0, 8.0]])
    assert solved_within_efforts(path(), robot, lambda _: alone) is alone


@SIDES
@pytest.mark.parametrize(("friction", "cause"), [(0.0, "gravity"), (6.0, "gravity with friction")])
def test_who_is_held_over_its_limit_is_told_by_how_much(friction: float, cause: str, side: float) -> None:
    bounds = [-900.0, 48.0] if side > 0 else [-48.0, 900.0]
    robot = lift(bounds, side * G, friction)

    def solve(more: tuple) -> TimeOptimalMotion:
        return time_optimal(path(side), [[-9.0, 9.0]], [[-1.0, 1.0]], further=more)

    with pytest.raises(PlanningError) as caught:
        solved_within_efforts(path(side), robot, solve)
    needed = MASS * G + friction
    text = str(caught.value)
    assert f"{cause} alone takes {side * needed:.6g} N of lift" in text
    assert f": {needed - 48.0:.6g} N more than its effort limit of {side * 48.0:g} N" in text


def test_the_place_where_a_beam_is_held_over_its_limit_is_told() -> None:
    """It turns from -1 to 1 rad, and is level at 0, in the middle of its path."""
    link = LinkInertia(MASS, (0.0, 0.0, 0.0), (0.0,) * 6)
    limits = replace(unlimited(1), effort=np.array([[-900.0, 48.0]]))
    gravity = np.array([0.0, -G, 0.0])
    joints = (Joint("beam", "revolute", a=1.0, link=link),)
    robot = Robot("beam", joints, limits, "standard", np.eye(4), np.eye(4), gravity=gravity)
    turn = PiecewisePolynomial(np.array([0.0, 1.0]), np.array([2.0, -1.0])[:, None, None])

    def solve(more: tuple) -> TimeOptimalMotion:
        return more[0].rows(np.linspace(0.0, 1.0, 5), "right")

    with pytest.raises(PlanningError) as caught:
        solved_within_efforts(turn, robot, solve)
    assert "with the joints at 0: 1.05 N m more" in str(caught.value)


@SIDES
def test_a_limit_that_was_lowered_is_not_said_to_be_that_of_a_joint(side: float) -> None:
    """49.05 of 50 N hold it; a solution that takes 54.05 N asks for a limit of 44 N, which is nobody's."""
    robot = lift([-900.0, 50.0] if side > 0 else [-50.0, 900.0], side * G)
    ends = {"start_velocity": 0.5, "end_velocity": 0.5}
    over = time_optimal(path(side), [[-FREE, FREE]], [[-1.0, 1.0]], **ends)

    def solve(more: tuple) -> TimeOptimalMotion:
        more[0].rows(np.array([0.0, 1.0]), "right")
        return over

    assert solved_within_efforts(path(side), robot, solve) is over


def test_the_constraint_of_efforts_is_of_the_limits_in_force() -> None:
    robot = lift([-50.0, 40.0])
    robot = replace(robot, limits=replace(robot.limits, velocity=np.array([[-2.0, 3.0]])))
    (constraint,) = effort_constraints(path(), robot)
    assert constraint.velocity.tolist() == [[-2.0, 3.0]]
    assert constraint.limits.tolist() == [[-50.0, 40.0]]
