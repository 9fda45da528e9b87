"""Efforts of rows that differ: the last one, one at rest, and rows that state fewer derivatives than others.

The oracles are a slide, whose force is its mass times its acceleration, and a pendulum.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from trajcli.findings import Finding
from trajcli.judge.motion import Requirements, judge_motion
from trajcli.kinematics.robot import Friction, Joint, LinkInertia, Robot, unlimited
from trajcli.streams.recorded_motion import RecordedMotion, Resolution

SIDES = pytest.mark.parametrize("side", [1, -1])
G, LEVER = 9.81, 0.1


def arm(kind: str, mass: float, lever: float, bounds: list[float], friction: Friction) -> Robot:
    """Return one joint, across gravity, that moves a point of some mass on a lever."""
    joint = Joint("one", kind, link=LinkInertia(mass, (lever, 0.0, 0.0), (0.0,) * 6), friction=friction)
    limits = replace(unlimited(1), effort=np.array([bounds]))
    down = np.array([0.0, -G, 0.0])
    return Robot("arm", (joint,), limits, "standard", np.eye(4), np.eye(4), gravity=down)


def slide(bounds: list[float], coulomb: float = 0.0) -> Robot:
    return arm("prismatic", 2.0, 0.0, bounds, Friction(coulomb))


def efforts(
    robot: Robot, t: np.ndarray, states: list[np.ndarray], off: tuple[float, ...], joined: str | None = None
) -> list[Finding]:
    """Return findings of rows of one joint, whose derivatives may be off."""
    exact = Resolution(0.0, *(np.full(1, each) for each in off))
    columns = [*(each[:, None] for each in states), None][:3]
    motion = RecordedMotion(t, *columns, None, None, None, None, exact, "rows")
    judged = judge_motion(lambda: [motion], Requirements(robot, interpolate=joined))
    return [each for each in judged.findings if each.kind == "effort"]


@SIDES
def test_what_the_last_row_states_is_told_with_its_own_time(side: int) -> None:
    """A slide whose acceleration grows evenly to 3 m/s^2; positions are too coarse for the curve to tell."""
    t = 0.004 * np.arange(9)
    jerk = 3.0 / t[-1]
    states = [side * jerk * each for each in (t**3 / 6, t**2 / 2, t)]
    (found,) = efforts(slide([-5.9, 5.9]), t, states, (1e-4, 1e-6, 1e-6))
    assert (found.severity, found.certainty, found.method, found.row) == ("error", "exceeded", "sampled", 9)
    assert [found.value, found.time] == pytest.approx([side * 6.0, t[-1]], rel=1e-6)


@SIDES
@pytest.mark.parametrize(("begins", "row", "force"), [(True, 1, 21.0), (False, 5, 19.0)])
def test_what_a_row_at_rest_takes_is_told_with_the_friction_of_the_motion_beside(
    begins: bool, row: int, force: float, side: int
) -> None:
    """2 kg begin with 10 m/s^2 against 1 N, and go on with 5; or they end so, where friction helps."""
    t = 0.008 * np.arange(5)
    qdd = np.where(t > 0, 5.0, 10.0)
    qd = np.append(0.0, np.cumsum(0.004 * (qdd[1:] + qdd[:-1])))
    q = np.append(0.0, np.cumsum(0.004 * (qd[1:] + qd[:-1]) - 0.008**2 * np.diff(qdd) / 12))
    states = [side * each for each in ((q, qd, qdd) if begins else (q[::-1], -qd[::-1], qdd[::-1]))]
    (found,) = efforts(slide([3 - force, force - 3], 1.0), t, states, (1e-4, 1e-7, 1e-7))
    assert (found.severity, found.certainty, found.method, found.row) == ("error", "exceeded", "sampled", row)
    assert found.value == pytest.approx(side * force, rel=1e-6)


@SIDES
@pytest.mark.parametrize("over", [-2e-6, 2e-6])
def test_a_limit_is_judged_as_closely_beside_a_far_wider_one_of_the_other_direction(
    over: float, side: int
) -> None:
    """The largest force on one side is 1 N, within a piece; on the other one 900 of 1000 N are taken."""
    parabola = Polynomial([1.0, 0.0, -1.0])(Polynomial([-1 / 3, 1.0])) * 0.5 * (1 + over)
    falls = Polynomial([parabola(1.0), -450.0])
    early = [parabola.integ(2), parabola.integ(), parabola]
    late = [
        falls.integ(2, k=[early[1](1.0), early[0](1.0)]), falls.integ(k=early[1](1.0)), falls
    ]  # fmt: skip
    states = [side * np.array([a(0.0), a(1.0), b(1.0)]) for a, b in zip(early, late, strict=True)]
    bounds = sorted([-side * 1000.0, side * 1.0])
    found = efforts(slide(bounds), np.arange(3.0), states, (0.0, 0.0, 0.0), "quintic")
    assert [each.value for each in found] == pytest.approx([side * (1 + over)] * (over > 0), rel=2e-7)


def pendulum(size: float) -> Robot:
    """Return 1 kg on a lever of 0.1 m: 0.01 kg m^2, and 0.981 N m by its weight."""
    return arm("revolute", 1.0, LEVER, [-9.0, size], Friction())


WEIGHT, INERTIA = G * LEVER, LEVER**2
AT = np.array([0.0, 2.0, 2.01])


def test_a_short_cubic_hides_no_torque_of_a_long_quintic() -> None:
    """From -1 to 1 rad the weight takes most where the arm is level, and there a position may be off.

    In 10 ms behind, as far as the positions may be off, a cubic takes 3 N m.
    """
    states = [np.array([-1.0, 1.0, 1.0055]), np.zeros(3), np.array([0.0, 0.0, np.nan])]
    (found,) = efforts(pendulum(0.998 * WEIGHT), AT, states, (0.01, 1e-6, 1e-6), "jtc")
    assert (found.severity, found.certainty, found.row) == ("error", "exceeded", 1)
    t, q = (
        np.linspace(0.0, 2.0, 20001),
        Polynomial([-1.0, 0.0, 0.0, 2.5, -1.875, 0.375]),
    )  # 5th order, at rest
    taken = WEIGHT * np.cos(q(t)) + INERTIA * q.deriv(2)(t)
    assert [found.value, found.time] == pytest.approx([taken.max(), t[taken.argmax()]], rel=1e-3)
    assert found.value == pytest.approx(taken.max(), rel=1e-6)


def test_nor_does_it_behind_a_pause_and_before_the_long_quintic() -> None:
    """Rows as above from the last to the first, after a second in which nothing moves."""
    states = [np.array([1.0055, 1.0055, 1.0, -1.0]), np.zeros(4), np.array([np.nan, np.nan, 0.0, 0.0])]
    (found,) = efforts(
        pendulum(0.998 * WEIGHT), np.array([0.0, 1.0, 1.01, 3.01]), states, (0.01, 1e-6, 1e-6), "jtc"
    )
    assert (found.severity, found.certainty, found.row) == ("error", "exceeded", 3)
    q = Polynomial([1.0, 0.0, 0.0, -2.5, 1.875, -0.375])
    t = np.linspace(0.0, 2.0, 20001)
    taken = WEIGHT * np.cos(q(t)) + INERTIA * q.deriv(2)(t)
    assert found.value == pytest.approx(taken.max(), rel=1e-6)


@pytest.mark.parametrize("pause", [0, 1, 2])
def test_of_two_peaks_alike_the_one_that_is_named_is_told_with_its_own_time(pause: int) -> None:
    """Two rows state 10 rad/s^2 where the arm is level; two seconds follow on one of them, 20 ms on the other.

    Between them it stands, and one row states positions alone: no curve of a force goes there.
    """
    stands, none = np.ones(pause), np.full(1, np.nan)
    t = np.concatenate([[0.0, 2.0], 2.0 + 0.1 * stands.cumsum(), [3.0, 4.0, 4.02]])
    states = [
        np.concatenate([[0.0, 1.0], stands, [1.0], [0.0, 0.002]]),
        np.concatenate([[0.0, 0.0], 0.0 * stands, none, [0.0, 0.2]]),
        np.concatenate([[10.0, 0.0], 0.0 * stands, none, [10.0, 10.0]]),
    ]
    (found,) = efforts(pendulum(1.05), t, states, (1e-6, 1e-6, 1e-6), "jtc")
    assert found.value == pytest.approx(WEIGHT + INERTIA * 10.0, rel=1e-6)
    assert (found.time, found.row) in [(0.0, 1), (4.0, 4 + pause)]


@SIDES
@pytest.mark.parametrize(("over", "certain"), [(0.0013, False), (0.0016, True)])
def test_an_excess_is_as_certain_as_the_rounding_where_it_is(over: float, certain: bool, side: int) -> None:
    """A pendulum is level in the middle of a second, where its place says least, and turns on ever faster.

    At its end positions are off by 0.01 rad, of which the weight makes 1.4 mN m, more than the 1.2 mN m that
    the curve is off in the middle. For a second before it turns evenly.
    """
    q, ends = Polynomial([3.5 / 128 - 3.5 / 640, -3.5 / 64, 0.0, 0.0, 0.0, 3.5 / 20]), np.array([0.0, 1.0])
    t = np.linspace(0.0, 1.0, 1001)
    largest = (WEIGHT * np.cos(q(t)) + INERTIA * q.deriv(2)(t)).max()
    before = [q(0.0) - q.deriv()(0.0), q.deriv()(0.0), 0.0]
    states = [np.append(early, q.deriv(k)(ends) if k else q(ends)) for k, early in enumerate(before)]
    turned = [np.pi - states[0], -states[1], -states[2]] if side < 0 else states
    bounds = sorted([-side * 9.0, side * (largest - over)])
    robot = replace(pendulum(9.0), limits=replace(unlimited(1), effort=np.array([bounds])))
    (found,) = efforts(robot, np.arange(3.0), turned, (0.01, 1e-6, 1e-6), "quintic")
    assert found.certainty == ("exceeded" if certain else "within rounding")


@pytest.mark.parametrize(("share", "certainty"), [(0.9, "within rounding"), (1.1, "exceeded")])
def test_a_centripetal_force_is_as_uncertain_as_the_place_it_acts_at(share: float, certainty: str) -> None:
    """A slide holds 2 kg half a metre from an axis that turns with 3 rad/s: 9 N, and m w^2 for each metre of error."""
    off, force, t = 1e-3, 2.0 * 0.5 * 3.0**2, 100.0 * np.arange(3)
    joints = tuple(
        Joint(name, kind, alpha=tilt, link=LinkInertia(2.0, (0.0,) * 3, (0.0,) * 6))
        for name, kind, tilt in (("turn", "revolute", 0.0), ("slide", "prismatic", np.pi / 2))
    )
    bounds = np.array([[-np.inf, np.inf], [-(force - share * 2.0 * 3.0**2 * off), np.inf]])
    limits = replace(unlimited(2), effort=bounds)
    robot = Robot("arm", joints, limits, "modified", np.eye(4), np.eye(4), gravity=np.zeros(3))
    columns = [np.stack([3.0 * t, 0.5 + 0 * t], axis=1), np.tile([3.0, 0.0], (3, 1)), np.zeros((3, 2))]
    off_by = Resolution(0.0, np.array([0.0, off]), np.zeros(2), np.zeros(2))
    rows = RecordedMotion(t, *columns, None, None, None, None, off_by, "rows")
    (found,) = [f for f in judge_motion(lambda: [rows], Requirements(robot)).findings if f.kind == "effort"]
    assert (found.value, found.certainty) == (pytest.approx(-force, rel=1e-4), certainty)
    assert found.rounding == pytest.approx(2.0 * 3.0**2 * off, rel=0.01)


@pytest.mark.parametrize(("back", "time", "row"), [(False, 4.0, 4), (True, 0.02, 2)])
def test_a_force_at_the_start_of_a_motion_is_not_told_where_the_one_before_ends(
    back: bool, time: float, row: int
) -> None:
    """One ends with 9.5 rad/s^2, the next begins with 10 and brakes at once; a pause between states positions alone.

    So it is the other way round, where the first one ends with the larger force.
    """
    t = np.array([0.0, 2.0, 3.0, 4.0, 4.02])
    states = [
        np.array([1.0, 0.0, 1.0, 0.0, -0.0053]),
        np.array([0.0, 0.0, np.nan, 0.0, -0.9]),
        np.array([0.0, 9.5, np.nan, 10.0, -100.0]),
    ]
    if back:
        t, states = t[-1] - t[::-1], [states[0][::-1], -states[1][::-1], states[2][::-1]]
    (found,) = efforts(pendulum(1.05), t, states, (1e-6, 1e-6, 1e-6), "jtc")
    assert found.value == pytest.approx(WEIGHT + INERTIA * 10.0, rel=1e-6)
    assert (pytest.approx(found.time), found.row) == (time, row)


def test_the_mean_of_a_cubic_behind_a_quintic_is_told_in_its_own_middle() -> None:
    """In 10 ms its velocity grows by 1 rad/s: 1 N m, and the weight. A line before both takes nothing."""
    none, t = np.nan, np.append(0.0, 1.0 + AT)
    states = [
        np.array([-1.0, -1.0, 1.0, 1.005]),
        np.array([none, 0.0, 0.0, 1.0]),
        np.array([none, 0, 0, none]),
    ]
    (found,) = efforts(pendulum(1.45), t, states, (0.01, 1e-4, 1e-6), "jtc")
    assert (found.severity, found.certainty, found.method, found.row) == ("error", "exceeded", "sampled", 3)
    taken = INERTIA * 100.0 + WEIGHT * np.cos(1.0025)
    assert [found.value, found.time] == pytest.approx([taken, 3.005], rel=1e-6)


def test_where_between_two_rows_their_mean_acceleration_is_taken_nobody_knows() -> None:
    """From 0.3 to 0.9 rad the weight takes 0.94 to 0.61 N m, and 10 rad/s^2 in the mean 0.1: of 0.81 N m."""
    states = [np.array([0.3, 0.9]), np.array([2.0, 4.0])]
    (found,) = efforts(pendulum(0.81), np.array([0.0, 0.2]), states, (0.1, 1e-6, 0.0))
    assert (found.severity, found.certainty) == ("error", "within rounding")


def test_a_row_is_as_certain_as_its_own_place_makes_it() -> None:
    """From -1 rad to where the arm is level: there a position may be off, and half a mN m is over for sure."""
    states = [np.array([-1.0, 0.0]), np.zeros(2), np.zeros(2)]
    (found,) = efforts(pendulum(WEIGHT - 5e-4), np.array([0.0, 1.0]), states, (0.01, 1e-9, 1e-9))
    assert (found.severity, found.certainty, found.method, found.row) == ("error", "exceeded", "sampled", 2)
    assert found.value == pytest.approx(WEIGHT, rel=1e-9)
