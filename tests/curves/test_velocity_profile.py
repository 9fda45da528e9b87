"""Velocity profiles against the integral of their velocity, and the cruise speeds that a duration allows."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tiers import few

from trajcli.curves.trapezoid import (
    InfeasibleProfileError,
    MotionBounds,
    VelocityProfile,
    fastest_profile,
    profile_of_duration,
    profile_of_speed,
)

BACK_AND_FORTH = VelocityProfile(
    -2.0, ((1.0, 0.0), (0.5, 0.0), (1.0, 3.0), (0.0, 3.0), (2.0, 3.0), (4.0, -1.0))
)


def test_phases_are_named_by_the_speed() -> None:
    assert BACK_AND_FORTH.phases() == [
        ("decelerate", 0.0, 1.0),
        ("rest", 1.0, 1.5),
        ("accelerate", 1.5, 2.5),
        ("cruise", 2.5, 4.5),
        ("decelerate", 4.5, 8.5),
    ]
    assert [name for name, _, _ in BACK_AND_FORTH.mirrored().phases()] == [
        name for name, _, _ in BACK_AND_FORTH.phases()
    ]


def test_distances_are_areas_in_mirrored_and_longer_profiles_too() -> None:
    area = -1.0 + 1.5 + 6.0 + 4.0
    assert BACK_AND_FORTH.distance == area
    assert BACK_AND_FORTH.mirrored().distance == -area
    assert BACK_AND_FORTH.stretched(4.0).distance == area
    assert BACK_AND_FORTH.stretched(4.0).duration == 4.0 * 8.5
    curve = BACK_AND_FORTH.curve(0.25, 0.25 + area)
    t = np.array([0.5, 1.2, 2.0, 3.0, 8.5])
    np.testing.assert_allclose(
        curve.evaluate(t)[:, 0], [-0.5, -0.75, -0.375, 2.25, 10.75], rtol=0, atol=1e-12
    )


@pytest.mark.parametrize("sign", [1, -1])
def test_the_least_acceleration_is_that_of_a_triangle(sign: int) -> None:
    low, enough = (MotionBounds(math.inf, rate, rate) for rate in (3.99, 4.0))
    assert profile_of_duration(sign * 4.0, 0.0, 0.0, 2.0, enough, enough).distance == sign * 4.0
    with pytest.raises(InfeasibleProfileError) as caught:
        profile_of_duration(sign * 4.0, 0.0, 0.0, 2.0, low, low)
    assert (caught.value.reason, caught.value.low) == ("acceleration", 4.0)


def test_ramps_to_a_cruise_speed_may_be_too_steep() -> None:
    """From rest to rest over 2 within 2 s at the speed 1.5 each ramp lasts 2/3 s."""
    for allowed in (2.25, 3.0, math.inf):
        profile = profile_of_speed(2.0, 0.0, 0.0, 2.0, 1.5, acceleration=allowed)
        assert profile.knots[0] == pytest.approx((2 / 3, 1.5))
    with pytest.raises(InfeasibleProfileError) as caught:
        profile_of_speed(2.0, 0.0, 0.0, 2.0, 1.5, acceleration=2.24)
    assert (caught.value.reason, caught.value.low) == ("acceleration", 2.25)


@pytest.mark.parametrize("size", [1e-9, 1e-6, 1.0, 1e6])
def test_a_cruise_speed_fits_a_small_motion_as_it_fits_a_large_one(size: float) -> None:
    for speed in (1.01, 1.5, 1.99):
        profile = profile_of_speed(2.0 * size, 0.0, 0.0, 2.0, speed * size)
        assert profile.knots[0] == pytest.approx((2.0 - 2.0 / speed, speed * size))


@pytest.mark.parametrize("ends", [(3.0, 0.0), (0.0, 3.0), (3.0, 2.5), (2.5, 3.0), (3.0, 0.5), (0.5, 3.0)])
@pytest.mark.parametrize("distance", [1.0, 2.5, 12.0])
def test_ends_above_the_speed_are_left_and_reached_with_the_rates_that_are_given(
    ends: tuple[float, float], distance: float
) -> None:
    bounds = MotionBounds(1.0, 2.0, 5.0)
    first, last = ends
    needed = (first**2 - last**2) / 10 if first > last else (last**2 - first**2) / 4
    if distance < needed:
        with pytest.raises(InfeasibleProfileError):
            fastest_profile(distance, first, last, bounds, bounds)
        return
    profile = fastest_profile(distance, first, last, bounds, bounds)
    assert profile.initial == first
    velocities = np.array([first, *(velocity for _, velocity in profile.knots)])
    lengths = np.array([length for length, _ in profile.knots])
    assert velocities[-1] == last
    assert profile.distance == pytest.approx(distance, rel=1e-12)
    change = np.diff(velocities)
    assert (lengths >= np.where(change > 0, change / 2.0, -change / 5.0) * (1 - 1e-12)).all()
    # one that slows down to the speed at once, and speeds up at the end as late as it can, is the fastest
    kept = [(first - 1) * (first + 1) / 10 if first > 1 else (1 - first**2) / 4]
    kept += [(last - 1) * (last + 1) / 4 if last > 1 else (1 - last**2) / 10]
    if distance > sum(kept):
        assert velocities.min() == min(first, last, 1.0)
        assert lengths[velocities[1:] == velocities[:-1]].sum() == pytest.approx(
            distance - sum(kept), rel=1e-12
        )


@pytest.mark.parametrize("cruise", [0.3, 1.0, 2.0])
@pytest.mark.parametrize("ends", [(0.5, 1.5), (1.5, 0.5), (0.0, 0.0)])
@pytest.mark.parametrize("sign", [1, -1])
def test_the_cruise_of_a_duration_is_found_again(ends: tuple[float, float], cruise: float, sign: int) -> None:
    up, down, (first, last) = 2.0, 5.0, ends
    rise = abs(cruise - first) / (up if cruise > first else down)
    fall = abs(cruise - last) / (down if cruise > last else up)
    made = VelocityProfile(first, ((rise, cruise), (1.7, cruise), (fall, last)))
    bounds, other = MotionBounds(9.0, up, down), MotionBounds(9.0, 11.0, 12.0)
    order = (bounds, other) if sign > 0 else (other, bounds)
    found = profile_of_duration(sign * made.distance, sign * first, sign * last, made.duration, *order)
    assert found.duration == pytest.approx(made.duration, rel=1e-12)
    assert found.distance == pytest.approx(sign * made.distance, rel=1e-12)
    assert found.knots[0] == pytest.approx((rise, sign * cruise), rel=1e-9)


def test_the_longest_duration_is_that_of_slowing_down_at_once() -> None:
    """From 3 down at 5 and up at 2 to 2.5: such a V covers 1; with room to stop there is no longest one."""
    bounds = MotionBounds(9.0, 2.0, 5.0)
    with pytest.raises(InfeasibleProfileError) as caught:
        profile_of_duration(1.0, 3.0, 2.5, 9.0, bounds, bounds)
    lowest = math.sqrt((9.0 / 10 + 6.25 / 4 - 1.0) / (1 / 10 + 1 / 4))
    slow = VelocityProfile(3.0, (((3.0 - lowest) / 5, lowest), ((2.5 - lowest) / 2, 2.5)))
    assert slow.distance == pytest.approx(1.0, rel=1e-12)
    assert caught.value.high == pytest.approx(slow.duration, rel=1e-12)
    with pytest.raises(InfeasibleProfileError) as caught:
        profile_of_duration(12.0, 3.0, 0.5, 0.1, bounds, bounds)
    assert (caught.value.reason, caught.value.high) == ("duration", math.inf)


def rise_time(
    distance: float, ends: tuple[float, float], duration: float, speed: float, fall: float
) -> float:
    """Return how long speeding up lasts so that the area is the distance, which must leave time for slowing down."""
    first, last = ends
    return 2 * (speed * duration - distance - (speed - last) ** 2 / (2 * fall)) / (speed - first)


@pytest.mark.parametrize("seed", few(range(60)))
@pytest.mark.parametrize("same", [False, True])
def test_the_speeds_that_are_named_are_those_that_a_duration_allows(seed: int, *, same: bool) -> None:
    rng = np.random.default_rng(seed)
    first, last, duration = rng.uniform(0, 1), rng.uniform(0, 1), rng.uniform(1, 4)
    fall = math.nan if same else rng.uniform(1.0, 6.0)
    distance = float(max(first, last) * duration * rng.uniform(1.05, 1.6))

    def fits(speed: float) -> bool:
        if same:  # one rate a, with which (2 v - v0 - v1) / a is the time of both ramps
            area = speed * duration - distance
            ramps = 2 * area * (2 * speed - first - last) / ((speed - first) ** 2 + (speed - last) ** 2)
            return area > 0 and ramps <= duration
        rise = rise_time(distance, (first, last), duration, speed, fall)
        return rise > 0 and rise + (speed - last) / fall <= duration

    def found(speed: float) -> VelocityProfile | None:
        try:
            return profile_of_speed(distance, first, last, duration, speed, None if same else fall)
        except InfeasibleProfileError:
            return None

    fastest = max(first, last)
    for speed in np.linspace(1.001 * fastest, 5 * distance / duration, 200).tolist():
        profile = found(speed)
        assert (profile is not None) == fits(speed)
        if profile is not None:
            assert profile.duration == pytest.approx(duration, rel=1e-12)
            assert profile.distance == pytest.approx(distance, rel=1e-9)
    with pytest.raises(InfeasibleProfileError) as caught:
        profile_of_speed(distance, first, last, duration, 1e3 * distance, None if same else fall)
    assert caught.value.reason == "speed"
    if not caught.value.low < caught.value.high:
        assert not any(map(fits, np.linspace(1.001 * fastest, 20 * distance / duration, 2000).tolist()))
        return
    for speed, inside in ((caught.value.low, 1 + 1e-7), (caught.value.high, 1 - 1e-7)):
        if fastest < speed < math.inf:
            assert found(speed * inside) is not None
            assert found(speed / inside) is None
