"""Checks of rules by themselves: parameters that nobody gives, and what they need that nobody knows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from planted_faults import motion
from scipy.interpolate import BPoly

from trajcli.consumers.differences import Differences, VelocityTowardsEnds
from trajcli.consumers.executed import RoundedSegments, approach_excesses
from trajcli.consumers.profile import ConsumerRule, Source
from trajcli.consumers.rule_check import Surroundings
from trajcli.consumers.states import EffortAbsent, JointCount, JointNames
from trajcli.kinematics.robot import Limits
from trajcli.streams.recorded_motion import RecordedMotion

FREE = np.tile([-np.inf, np.inf], (7, 1))
SOURCE = Source("by hand", "2026-01-01", "nowhere")


def rule(**parameters: object) -> ConsumerRule:
    return ConsumerRule("by-hand", "check", "necessary", "A rule.", parameters, SOURCE)


def even(speed: float, period: float = 1e-3, rows: int = 21) -> RecordedMotion:
    """Return rows whose third joint moves evenly from 0, and stamps from 0."""
    whole, t = motion(rows=rows), period * np.arange(rows)
    return replace(whole, t=t, q=speed * t[:, None] * np.eye(7)[2], qd=None, qdd=None)


@pytest.mark.parametrize(("share", "broken"), [(0.999, False), (1.001, True)])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_towards_an_end_nothing_is_taken_off_where_no_margin_is_given(
    share: float, side: float, *, broken: bool
) -> None:
    """From 0.5 before the end sqrt(2 d x) - o is 0.9; there it is slower than that by next to nothing of the way."""
    allowed = np.sqrt(2.0 * 1.0 * 0.5) - 0.1
    rows = even(side * share * allowed, period=1e-6)
    lower, upper = (-0.5, 9.0) if side < 0 else (-9.0, 0.5)
    given = rule(period=1e-6, lower=lower, upper=upper, deceleration=1.0, offset=0.1)
    check = VelocityTowardsEnds(given, Surroundings())
    check.take(rows)
    check.finish()
    assert [found.joint for found in check.findings()] == [check.joint_name(rows, 2)] * broken
    assert check.unjudged is None


@pytest.mark.parametrize("rows", [2, 3, 4])
def test_rows_none_of_which_is_at_the_period_are_not_judged_by_it(rows: int) -> None:
    check = Differences(rule(order="velocity", period=1e-3, limit=1.0), Surroundings())
    check.take(even(0.1, period=1.0, rows=rows))
    check.finish()
    assert not list(check.findings())
    assert "are not 0.001 s apart" in (check.unjudged or "")


@pytest.mark.parametrize(
    ("velocities", "words"), [(True, "the limits of the robot are not known"), (False, "")]
)
def test_segments_of_points_with_velocities_are_judged_by_limits_alone(velocities: bool, words: str) -> None:
    rows = motion(rows=21)
    rows = rows if velocities else replace(rows, qd=None, qdd=None)
    check = RoundedSegments(rule(unit=1e-6, time_unit=1e-3, share=0.1), Surroundings())
    check.take(rows)
    check.finish()
    assert words in (check.unjudged or "")
    assert (check.unjudged is None) == (not words)


@pytest.mark.parametrize("columns", [1, 2, 3])
def test_a_curve_to_a_first_point_that_moves_is_the_one_that_scipy_makes(columns: int) -> None:
    span, ends = 0.4, [0.3, -0.7, 5.0][:columns]
    rows = motion(rows=3)
    stated = [np.tile(end * np.eye(7)[4], (3, 1)) for end in ends] + [None] * (3 - columns)
    later = replace(rows, t=span + rows.t, q=stated[0], qd=stated[1], qdd=stated[2])
    curve = BPoly.from_derivatives([0.0, span], [[0.0] * columns, ends])
    times = np.linspace(0.0, span, 100001)
    for order in range(1, min(columns + 1, 3)):
        values = curve.derivative(order)(times)
        peak = values[np.abs(values).argmax()]
        bounds = [FREE, FREE, FREE, FREE]
        bounds[order] = np.tile([-1.0, 1.0], (7, 1)) * 0.9 * abs(peak)
        found = [
            each for each in approach_excesses(later, np.zeros(7), Limits(*bounds)) if each[2] * peak > 0
        ]
        ((joint, _, value, limit, time),) = found
        assert (joint, value, limit) == (4, pytest.approx(peak, rel=1e-6), pytest.approx(0.9 * peak))
        assert curve.derivative(order)(time) == pytest.approx(peak, rel=1e-6)


@pytest.mark.parametrize(("count", "words"), [(1, "1 joint,"), (2, "2 joints,"), (3, "3 joints,")])
def test_another_number_of_joints_is_told_beside_that_of_the_consumer(count: int, words: str) -> None:
    rows = motion(rows=3, columns="q")
    check = JointCount(rule(count=7.0), Surroundings())
    check.take(replace(rows, q=rows.q[:, :count]))
    (found,) = check.findings()
    assert (found.value, found.limit, found.message) == (count, 7.0, f"the rows have {words} and 7 are moved")


def test_efforts_of_a_point_are_counted_where_there_shall_be_none() -> None:
    rows = motion(rows=5, columns="q")
    tau = np.full((5, 7), np.nan)
    tau[3] = 0.0
    check = EffortAbsent(rule(), Surroundings())
    check.take(replace(rows, tau=tau))
    (found,) = check.findings()
    assert (found.value, found.limit, found.row) == (7.0, 0.0, 4)


def test_a_joint_that_the_robot_has_not_is_one_where_none_is_allowed() -> None:
    rows = motion(rows=3, columns="q")
    check = JointNames(rule(), Surroundings(joints=("elbow", *(rows.joints or ())[1:])))
    check.take(rows)
    assert {(found.value, found.limit) for found in check.findings()} == {(1.0, 0.0)}
    assert "the joint 'elbow' is missing" in [found.message for found in check.findings()]
