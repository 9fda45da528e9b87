"""What one joint lasts at least through a zone, against its fastest motion by the textbook, in either direction.

Two ramps, and the largest velocity between them where both would go beyond it (Biagiotti and Melchiorri 2008,
section 3.2): from a velocity to another one there is a way that one ramp alone goes, and for shorter ones the
joint slows down first, or turns back.
"""

from __future__ import annotations

from itertools import product
from math import sqrt

import numpy as np
import pytest
from test_second_order_bound import TARGETS, job_of

from trajcli.planners.flying_by.second_order import ZonePassage, zone_passage

LOW, HIGH, BRAKE, GAIN = -1.0, 2.0, 7.0, 3.0
SPEEDS = [(0.0, 0.0), (0.2, 0.9), (0.9, 0.2), (-0.3, 0.6), (0.6, -0.3), (-0.2, -0.8), (-0.8, -0.2)]
STEPS = [0.01, 0.3, 2.0, -0.01, -0.3, -2.0]


def fastest(step: float, v0: float, v1: float, limits: tuple[float, float, float, float]) -> float:
    """Return the least duration of a step between velocities, by limits of velocity and acceleration, down and up."""
    low, high, brake, gain = limits
    by_one_ramp = (v1**2 - v0**2) / (2 * (gain if v1 > v0 else -brake))
    if step < by_one_ramp:
        return fastest(-step, -v0, -v1, (-high, -low, gain, brake))
    peak = min(sqrt((step + v0**2 / (2 * gain) + v1**2 / (2 * brake)) / (0.5 / gain + 0.5 / brake)), high)
    left = step - (peak**2 - v0**2) / (2 * gain) - (peak**2 - v1**2) / (2 * brake)
    return (peak - v0) / gain + (peak - v1) / brake + left / peak


def lasting(steps: list[float], first: tuple[float, float], last: tuple[float, float], turns: bool) -> float:
    """Return the bound of joints between speeds of a path that they go along, or all of them against it."""
    sign = -1.0 if turns else 1.0
    ones = np.full(len(steps), sign)
    limits = np.array([[LOW, HIGH]] * len(steps)), np.array([[-BRAKE, GAIN]] * len(steps))
    passage = ZonePassage(np.array(steps), ones, ones, *limits)
    return float(passage.durations(np.array([first]), np.array([last]), 50.0)[0, 0])


@pytest.mark.parametrize("turns", [False, True])
@pytest.mark.parametrize("step", STEPS)
@pytest.mark.parametrize("speeds", SPEEDS)
def test_between_two_velocities_it_is_the_fastest_motion(
    speeds: tuple[float, float], step: float, *, turns: bool
) -> None:
    exact = fastest(step, *speeds, (LOW, HIGH, BRAKE, GAIN))
    first, last = ((-speed if turns else speed,) * 2 for speed in speeds)
    assert lasting([step], first, last, turns) == pytest.approx(exact, rel=1e-6)


@pytest.mark.parametrize("more", [1e-9, 0.0])
@pytest.mark.parametrize(("brake", "gain"), [(BRAKE, GAIN), (GAIN, BRAKE)])
@pytest.mark.parametrize(("v0", "v1"), [(0.2, 0.9), (0.9, 0.2), (0.1, 0.4), (0.7, 0.3)])
def test_what_one_ramp_goes_takes_its_time(
    v0: float, v1: float, brake: float, gain: float, more: float
) -> None:
    """A step that is shorter by rounding would be another motion: the joint has to turn back before it."""
    rate = gain if v1 > v0 else brake
    time, limits = abs(v1 - v0) / rate, (np.array([[LOW, HIGH]]), np.array([[-brake, gain]]))
    passage = ZonePassage(np.array([0.5 * (v0 + v1) * time + more]), np.ones(1), np.ones(1), *limits)
    found = passage.durations(np.array([[v0, v0]]), np.array([[v1, v1]]), 50.0)
    assert found[0, 0] == pytest.approx(time, rel=1e-6)


@pytest.mark.parametrize("turns", [False, True])
@pytest.mark.parametrize("step", STEPS)
def test_of_velocities_in_intervals_none_is_faster(step: float, *, turns: bool) -> None:
    """Some of them are beyond the limit of velocity, so that no motion has them."""
    for first, last in (((0.1, 0.5), (0.3, 0.9)), ((0.8, 2.6), (0.6, 1.0)), ((0.0, 0.2), (0.7, 2.6))):
        sign, top = (-1.0, -LOW) if turns else (1.0, HIGH)
        own = [np.linspace(low, min(high, top), 9) for low, high in (first, last)]
        exact = min(fastest(step, sign * v0, sign * v1, (LOW, HIGH, BRAKE, GAIN)) for v0, v1 in product(*own))
        found = lasting([step], first, last, turns)
        assert found <= exact * (1 + 1e-6)


def test_a_joint_at_its_largest_velocity_goes_on_with_it() -> None:
    """Upper ends of intervals that are beyond it change nothing."""
    assert lasting([1.0], (1.0, 2.6), (1.0, 2.6), False) == pytest.approx(1.0 / HIGH, rel=1e-6)
    assert lasting([-1.0], (0.5, 1.6), (0.5, 1.6), True) == pytest.approx(-1.0 / LOW, rel=1e-6)


def test_the_slowest_joint_counts_and_what_takes_longer_than_asked_for_is_that() -> None:
    each = [fastest(step, 0.0, 0.0, (LOW, HIGH, BRAKE, GAIN)) for step in (0.3, -2.0)]
    for steps in ([0.3, -2.0], [-2.0, 0.3]):
        assert lasting(steps, (0.0, 0.0), (0.0, 0.0), False) == pytest.approx(max(each), rel=1e-6)
    assert lasting([2000.0], (0.0, 0.0), (0.0, 0.0), False) == 50.0


@pytest.mark.parametrize("standing", [0, 1])
@pytest.mark.parametrize("speeds", SPEEDS)
def test_a_joint_that_stands_beside_another_one_asks_for_nothing(
    speeds: tuple[float, float], standing: int
) -> None:
    """Of short ways, either way round, the change of the other one's velocity takes the time."""
    for step in (0.01, -0.01):
        steps, before, behind = (np.insert([own], standing, 0.0) for own in (step, *speeds))
        limits = np.array([[LOW, HIGH]] * 2), np.array([[-BRAKE, GAIN]] * 2)
        found = ZonePassage(steps, before, behind, *limits).durations(np.ones((1, 2)), np.ones((1, 2)), 50.0)
        assert found[0, 0] == pytest.approx(fastest(step, *speeds, (LOW, HIGH, BRAKE, GAIN)), rel=1e-6)


def test_a_zone_has_the_slopes_of_both_of_its_lines_and_the_limits_of_the_job() -> None:
    """Straight lines of s from 0 to 1: what joints go per s is the difference of their ends."""
    chains = job_of(*TARGETS[:2]).flyby
    assert chains is not None
    assert chains.chains is not None
    (chain,) = chains.chains
    passage = zone_passage(chain.chain, 0)
    start, *targets = np.array([[0.3, 1.2], *TARGETS[:2]])
    np.testing.assert_allclose(passage.before, targets[0] - start, rtol=1e-12)
    np.testing.assert_allclose(passage.behind, targets[1] - targets[0], rtol=1e-12)
    np.testing.assert_allclose(passage.velocity, [[-3.0, 3.0]] * 2)
    np.testing.assert_allclose(passage.acceleration, [[-8.0, 8.0]] * 2)
