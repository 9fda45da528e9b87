"""The first law: the moving average against integrals of scipy, its nodes, and what it must be at ends and stops."""

from __future__ import annotations

import numpy as np
import pytest
from jerk_paths import both
from scipy.integrate import quad

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.curves.third_order.first_law import EndStates, MovingAverage, _led_to, smoothed_law
from trajcli.curves.time_optimal.parameterization import time_optimal

REST = (0.0, 0.0)


def second_order_law(start: float, end: float) -> PiecewisePolynomial:
    """Return s(t) from t = 1 to 3.5 with speed up, cruise and slow down, from 2 on, with the given speeds at its ends."""
    speeds, breaks = np.array([start, 1.0, 1.0, end]), np.array([1.0, 1.5, 2.5, 3.5])
    h, change = np.diff(breaks), np.diff(speeds)
    s = 2.0 + np.append(0.0, np.cumsum(h * 0.5 * (speeds[1:] + speeds[:-1])))
    return PiecewisePolynomial(breaks, np.stack([0.5 * change / h, speeds[:-1], s[:-1]])[:, :, None])


@pytest.mark.parametrize(
    ("own", "ends"), [((0.0, 0.0), (0.0, 0.0)), ((0.4, 0.7), (0.4, 0.7)), ((0.4, 0.7), (0.0, 0.2))]
)
def test_the_average_is_that_of_a_law_which_goes_on_at_the_speeds_of_its_ends(own, ends):
    """Or at others: where the path stands still at an end, the law itself does not."""
    law, width = second_order_law(*own), 0.3
    average = MovingAverage(law, width, ends)
    assert (average.start, average.end) == (1.0 - 0.15, 3.5 + 0.15)

    def s(t):
        inside = np.clip(t, 1.0, 3.5)
        return float(law.evaluate(inside)[0]) + min(t - 1.0, 0.0) * ends[0] + max(t - 3.5, 0.0) * ends[1]

    def speed(t):
        return ends[0] if t < 1.0 else ends[1] if t > 3.5 else float(law.evaluate(t, 1)[0])

    times = np.array([average.start, 0.95, 1.0, 1.1, 1.5, 1.6, 2.45, 2.6, 3.4, 3.5, 3.6, average.end])
    found = np.array(average.states(times))
    for t, (value, rate, change) in zip(times, found.T, strict=True):
        early, late = t - 0.5 * width, t + 0.5 * width
        inner = [x for x in (1.0, 1.5, 2.5, 3.5) if early < x < late] or None
        assert value == pytest.approx(quad(s, early, late, points=inner)[0] / width, abs=1e-9)
        assert rate == pytest.approx((s(late) - s(early)) / width, abs=1e-12)
        assert change == pytest.approx((speed(late) - speed(early)) / width, abs=1e-9)


@pytest.mark.parametrize(
    ("start", "end", "rests"), [(0.0, 0.0, True), (0.1, 0.0, False), (0.0, 0.1, False), (0.1, 0.1, False)]
)
def test_both_ends_must_rest(start, end, rests):
    assert EndStates((start, 0.0), (end, 0.0)).rests == rests


def a_path(corner: bool) -> PiecewisePolynomial:
    """Return a path from s = 1 to 3 with breaks at 1.5 and 2, of one joint; perhaps it turns back at 2."""
    breaks, slopes = np.array([1.0, 1.5, 2.0, 3.0]), np.array([1.0, 1.0, -1.0 if corner else 1.0])
    begins = np.append(0.0, np.cumsum(slopes * np.diff(breaks))[:-1])
    return PiecewisePolynomial(breaks, np.stack([slopes, begins])[:, :, None])


@pytest.mark.parametrize("corner", [False, True])
@pytest.mark.parametrize("jerk", [(-30.0, 60.0), (-1e4, 1e4), (-1e-3, 1e-3), (-np.inf, np.inf)])
def test_a_first_law_has_nodes_at_breaks_and_rests_at_stops_and_ends(corner, jerk):
    path, bounds = a_path(corner), (np.array([[-1.0, 1.0]]), np.array([[-4.0, 3.0]]), np.array([jerk]))
    second = time_optimal(path, *bounds[:2])
    law = smoothed_law(path, second, bounds[1:], EndStates(REST, REST))
    assert set(path.breaks) <= set(law.s.tolist())
    assert (np.diff(law.s) > 0).all()
    still = np.flatnonzero(law.speed == 0.0)
    assert law.s[still].tolist() == ([1.0, 2.0, 3.0] if corner else [1.0, 3.0])
    assert not law.acceleration[still].any()
    assert law.forward.all()
    for piece in range(3):
        assert ((law.s >= path.breaks[piece]) & (law.s < path.breaks[piece + 1])).sum() >= 3
    # by rest on either side: the average of a window lasts so much longer than the law
    section = second.law.duration / (2 if corner else 1)
    ramp = 3.0 / 30.0 if jerk[0] == -30.0 else section if jerk[1] in (1e-3, np.inf) else 0.0
    wider = min(ramp, 0.3 * section) * (2 if corner else 1)
    assert law.duration == pytest.approx(second.law.duration + wider, rel=2e-2 if jerk[1] == 1e4 else 2e-3)


@pytest.mark.parametrize("order", [[0, 1], [1, 0]])
def test_the_longest_ramp_of_all_joints_is_the_width_of_the_window(order):
    path = a_path(corner=False)
    path = PiecewisePolynomial(path.breaks, np.concatenate([path.coefficients] * 2, axis=2))
    bounds = both([1.0, 1.0]), both([3.0, 3.0]), both(np.array([600.0, 30.0])[order])
    second = time_optimal(path, *bounds[:2])
    law = smoothed_law(path, second, bounds[1:], EndStates(REST, REST))
    assert law.duration == pytest.approx(second.law.duration + 0.1, rel=2e-3)


@pytest.mark.parametrize("side", [0, 1])
@pytest.mark.parametrize("state", [(0.6, 0.5), (0.6, -0.8), (0.05, 0.0), (0.9, 0.0)])
@pytest.mark.parametrize("corner", [False, True])
def test_an_end_in_motion_has_its_speed_and_its_acceleration_and_is_left_smoothly(side, state, corner):
    path = a_path(corner)
    bounds = np.array([[-1.0, 1.0]]), np.array([[-4.0, 3.0]]), both([60.0])
    speeds = {("start_velocity", "end_velocity")[side]: state[0]}
    second = time_optimal(path, *bounds[:2], **speeds)
    state = state[0], (-1 if side else 1) * state[1]
    ends = EndStates(REST, state) if side else EndStates(state, REST)
    law = smoothed_law(path, second, bounds[1:], ends)
    at, other = (-1, 0) if side else (0, -1)
    assert (law.speed[at], law.acceleration[at]) == state
    assert (law.speed[other], law.acceleration[other]) == REST
    stops = law.s[1:-1][law.speed[1:-1] == 0.0].tolist()
    assert stops == ([2.0] if corner else [])
    assert law.forward.all()
    mean = np.diff(law.speed**2) / (2.0 * np.diff(law.s))
    assert np.abs(mean).max() <= 4.0 * 1.5  # nowhere much more than the limit


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("acceleration", [0.8, 0.0, -0.8])
def test_what_leads_away_from_an_end_is_one_curve_that_ends_in_the_other(sign, acceleration):
    """Accelerations are the speeds' derivatives by s times the speeds; it begins in the state, and ends in what was given."""
    offsets = sign * np.linspace(0.0, 0.6, 6001)
    given = np.sqrt(1.5 + 0.4 * np.sin(3.0 * offsets))
    change = 0.6 * np.cos(3.0 * offsets)
    state = 0.5, acceleration
    speed, found = _led_to(state, offsets, sign, 0.4, given, change)
    assert (speed[0], found[0]) == pytest.approx(state, abs=1e-9)
    beyond = np.abs(offsets) >= 0.4
    np.testing.assert_allclose(speed[beyond], given[beyond], rtol=1e-12)
    np.testing.assert_allclose(found[beyond], change[beyond], rtol=1e-12)
    wanted = 0.5 * np.gradient(speed**2, offsets)
    kinks = np.abs(np.gradient(wanted)) > 0.1  # where the speed that is led away is not let fall further
    assert kinks.sum() < 10
    np.testing.assert_allclose(found[~kinks][1:-1], wanted[~kinks][1:-1], atol=4e-3)
    # near the end it is the speed of a constant acceleration
    early = np.sqrt(0.25 + 2.0 * acceleration * offsets[:40])
    np.testing.assert_allclose(speed[:40], early, atol=3e-4)
