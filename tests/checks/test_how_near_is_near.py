"""How far a border, a point or a peak of the tool may be off: what rounding does passes, ten times as much does not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from motions import between, limits, trajectory
from test_check_tool import DURATION, JERK, LENGTH, SPEED, TURN, judged, kinds, moving, with_limits

from trajcli.checks.continuity import check_continuity
from trajcli.checks.target import check_waypoints
from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.limits.joints import peaks_by_move
from trajcli.trajectory import Span, ViaPoints

FINE = moving(tolerance=1e-9)


@pytest.mark.parametrize(("size", "rounding"), [(1e-3, 1e-12), (1e3, 1e-9)])
def test_a_point_is_missed_by_twice_its_rounding_and_not_by_half_of_it(size, rounding):
    """A thousandth of the last decimal that is written, or a few thousand units in the last place."""
    points = size * np.array([[0.0], [1.0], [-1.0]])
    curve = trajectory(between(*points.tolist()))
    for off, missed in ((0.5 * rounding, False), (2.5 * rounding, True)):
        beside = ViaPoints(2.0 * np.arange(3), points + off, np.zeros((3, 1)))
        assert bool(check_waypoints(curve, [beside])) == missed


@pytest.mark.parametrize(("units", "moved"), [(-3, True), (3, True), (15, False), (-15, False)])
def test_a_border_some_units_beside_a_break_is_at_it(units, moved):
    """A rest, then a parabola: the acceleration of either belongs to one move alone."""
    breaks, beside = np.array([0.0, 1.0, 2.0]), 1.0 + units * 2.0**-52
    curve = PiecewisePolynomial(breaks, np.array([[0.0, 4.0], [0.0, 0.0], [0.0, 0.0]])[:, :, None])
    whole = trajectory(curve)
    spans = (Span(0, "quintic", 0.0, beside, 2), Span(1, "quintic", beside, 2.0, 2))
    first, second = (of_span[2] for of_span in peaks_by_move(replace(whole, spans=spans)))
    assert (first.high[0] == 0.0) == (moved or units < 0)
    assert (second.low[0] == 8.0) == (moved or units > 0)


@pytest.mark.parametrize(
    ("name", "peak"), [("speed", SPEED), ("angular_speed", SPEED * TURN / LENGTH), ("jerk", JERK)]
)
def test_the_tool_keeps_a_limit_that_is_a_millionth_below_its_peak(name, peak):
    """The peaks of a quintic law are known; what is proven of those of the tool is within half a millionth."""
    assert judged(with_limits(FINE, **{name: peak * (1 - 3e-7)})) == []
    (found,) = judged(with_limits(FINE, **{name: peak * (1 - 4e-6)}))
    assert kinds([found]) == [f"tool_{name}"]
    assert 0.0 <= found.time <= DURATION


@pytest.mark.parametrize(("larger", "named"), [(0.0, 1.0), (4e-13, 1.0), (5e-12, 2.0)])
def test_of_jumps_that_rounding_alone_makes_unequal_the_first_is_named(larger, named):
    curve = PiecewisePolynomial(np.arange(4.0), np.array([[0.0, 1.0, 2.0 + larger]])[:, :, None])
    (found,) = check_continuity(trajectory(curve), [limits()])
    assert (found.kind, found.time) == ("position_jump", named)
