"""Trapezoids: where they exist, how long they last, and what is said where there is none."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
import pytest
import ruckig
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from random_jobs import loaded, only_move, plan_of

from trajcli.errors import InputError, MissingLimitError, PlanningError


def trapezoid(distance: float, start_velocity: float = 0.0, end_velocity: float = 0.0, **fields: Any) -> Any:
    """Plan a trapezoid of one joint from 0 without limits."""
    job = {
        "version": 1,
        "robot": {"joints": 1},
        "start": {"joints": [0], "velocity": [start_velocity]},
        "moves": [
            {"planner": "trapezoid", "to": {"joints": [distance], "velocity": [end_velocity]}, **fields}
        ],
    }
    return plan_of(job)


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), factor=st.floats(0.05, 20))
def test_scaled_limits_scale_the_fastest_trapezoid(seed: int, factor: float) -> None:
    rng = np.random.default_rng(seed)
    speed, rate, distance = rng.uniform(0.2, 3, 3).tolist()
    fast = trapezoid(distance, velocity=speed, acceleration=rate)
    slow = trapezoid(distance, velocity=speed / factor, acceleration=rate / factor**2)
    assert fast is not None
    assert slow is not None
    assert slow.curve.end == pytest.approx(fast.curve.end * factor, rel=1e-12)
    u = np.linspace(0, 1, 40)
    first, second = (c.evaluate(np.minimum(u * c.end, c.end), 1) for c in (fast.curve, slow.curve))
    np.testing.assert_allclose(second * factor, first, rtol=0, atol=1e-11 * speed)


@settings(max_examples=50, deadline=None)
@given(
    distance=st.floats(0.01, 100).flatmap(lambda d: st.sampled_from([d, -d])),
    duration=st.floats(0.05, 50),
    share=st.floats(-0.5, 1.5),
)
def test_trapezoid_feasibility_interval(distance: float, duration: float, share: float) -> None:
    mean = abs(distance) / duration
    assume(min(abs(share), abs(share - 1)) > 1e-9)
    speed = mean * (1 + share)
    planned = trapezoid(distance, duration=duration, velocity=speed)
    assert (planned is not None) == (0 < share <= 1)
    if planned is not None:
        velocities = planned.curve.evaluate(np.linspace(0, duration, 101), 1)
        ramp = duration - abs(distance) / speed
        middle = planned.curve.evaluate(duration / 2, 1)[0]
        assert middle == pytest.approx(math.copysign(speed, distance), rel=1e-9)
        assert np.abs(velocities).max() <= speed * (1 + 1e-9)
        rate = planned.curve.evaluate(ramp / 2, 2)[0]
        assert rate == pytest.approx(math.copysign(speed / ramp, distance), rel=1e-6)
    least = 4 * mean / duration
    for factor, possible in ((1 - 1e-9, False), (1.0, True), (1 + share**2, True)):
        got = trapezoid(distance, duration=duration, acceleration=least * factor)
        assert (got is not None) == possible


@pytest.mark.parametrize(("share", "possible"), [(0.0, False), (1.0, True)])
@pytest.mark.parametrize("duration", [0.7, 3.0, 4.0, 11.1])
def test_trapezoid_feasibility_at_the_ends_of_the_interval(
    share: float, possible: bool, duration: float
) -> None:
    for distance in (0.1, 1 / 3, 7.7, -80.0):
        planned = trapezoid(distance, duration=duration, velocity=abs(distance) / duration * (1 + share))
        assert (planned is not None) == possible


def covered(speed: float, first: float, last: float, rise: float, fall: float, duration: float) -> float:
    """Integrate a velocity that goes from `first` over `speed` to `last` with the given rates."""
    up, down = abs(speed - first) / rise, abs(speed - last) / fall
    times = np.array([0.0, up, duration - down, duration])
    velocities = np.array([first, speed, speed, last])
    return float(np.sum((velocities[1:] + velocities[:-1]) / 2 * np.diff(times)))


def bisected(function: Any, low: float, high: float) -> float:
    """Return where an increasing function crosses zero."""
    for _ in range(200):
        middle = (low + high) / 2
        low, high = (low, middle) if function(middle) > 0 else (middle, high)
    return high


def decimals(low: float, high: float) -> st.SearchStrategy[float]:
    """Draw numbers of three decimals."""
    return st.integers(round(1000 * low), round(1000 * high)).map(lambda thousandths: thousandths / 1000)


boundary = decimals(0.0, 3.0)
rates = decimals(0.2, 8.0)


@settings(max_examples=50, deadline=None)
@given(
    first=boundary, last=boundary, rise=rates, fall=rates, cap=decimals(3.0, 6.0), distance=decimals(0.1, 40)
)
def test_fastest_trapezoid_with_boundary_speeds(
    first: float, last: float, rise: float, fall: float, cap: float, distance: float
) -> None:
    fields = {"velocity": cap, "acceleration": rise, "deceleration": fall}
    planned = trapezoid(distance, first, last, **fields)
    needed = (first**2 - last**2) / (2 * fall) if first > last else (last**2 - first**2) / (2 * rise)
    assume(abs(needed - distance) > 1e-9 * distance)
    assert (planned is not None) == (needed <= distance)
    if planned is None:
        return

    def ramps(speed: float) -> float:
        return (speed - first) / rise + (speed - last) / fall

    def surplus(speed: float) -> float:
        return covered(speed, first, last, rise, fall, ramps(speed)) - distance

    peak = min(cap, bisected(surplus, max(first, last), 1e3))
    duration = ramps(peak) - surplus(peak) / peak
    assert planned.curve.end == pytest.approx(duration, rel=1e-9)
    t = np.linspace(0, planned.curve.end, 500)
    velocity, acceleration = (planned.curve.evaluate(t, order)[:, 0] for order in (1, 2))
    assert velocity.max() <= peak * (1 + 1e-9)
    assert -fall * (1 + 1e-6) <= acceleration.min()
    assert acceleration.max() <= rise * (1 + 1e-6)
    assert velocity[[0, -1]] == pytest.approx([first, last], abs=1e-9)


@settings(max_examples=50, deadline=None)
@given(
    first=boundary, last=boundary, rise=rates, fall=rates, duration=decimals(0.1, 20), share=decimals(0.02, 1)
)
def test_trapezoid_of_given_duration_with_boundary_speeds(
    first: float, last: float, rise: float, fall: float, duration: float, share: float
) -> None:
    """Pick a cruise speed, cover what it covers, and find it again from distance and duration."""

    def length(speed: float) -> float:
        up = abs(speed - first) / (rise if speed > first else fall)
        return up + abs(speed - last) / (fall if speed > last else rise)

    low, high = min(first, last), max(first, last) + duration * max(rise, fall)
    between = length(low) if low < high else 0.0
    assume(max(between, length(max(first, last))) < 0.9 * duration)
    top = bisected(lambda speed: length(speed) - duration, max(first, last), high)
    speed = share * top
    assume(length(speed) < duration * (1 - 1e-6))
    up, down = (rise if speed > first else fall), (fall if speed > last else rise)
    distance = covered(speed, first, last, up, down, duration)
    assume(distance > 1e-3)
    planned = trapezoid(distance, first, last, duration=duration, acceleration=rise, deceleration=fall)
    assert planned is not None
    assert planned.curve.end == duration
    after = abs(speed - first) / up
    middle = (after + duration - abs(speed - last) / down) / 2
    assert planned.curve.evaluate(middle, 1)[0] == pytest.approx(speed, rel=1e-6)


@settings(max_examples=40, deadline=None)
@given(first=boundary, last=boundary, duration=decimals(0.2, 10), share=decimals(0.01, 0.99))
def test_trapezoid_of_given_duration_and_speed_with_boundary_speeds(
    first: float, last: float, duration: float, share: float
) -> None:
    """Pick a rate and a cruise speed, cover what they cover, and find the rate again."""
    speed = max(first, last) + share
    rate = (2 * speed - first - last) / (duration * (0.05 + 0.9 * share))
    distance = covered(speed, first, last, rate, rate, duration)
    planned = trapezoid(distance, first, last, duration=duration, velocity=speed)
    assert planned is not None
    rise = (speed - first) / rate
    assert planned.curve.evaluate(rise / 2, 2)[0] == pytest.approx(rate, rel=1e-6)
    too_fast = distance / duration + math.hypot(distance / duration - first, distance / duration - last)
    assert trapezoid(distance, first, last, duration=duration, velocity=too_fast) is None


@pytest.mark.parametrize(("first", "last", "needed"), [(2.0, 0.0, 1.0), (3.0, 1.0, 2.0), (1.0, 3.0, 1.0)])
def test_trapezoid_at_the_border_of_what_boundary_speeds_allow(
    first: float, last: float, needed: float
) -> None:
    fields = {"acceleration": 4.0, "deceleration": 2.0, "velocity": 5.0}
    assert trapezoid(needed * (1 - 1e-9), first, last, **fields) is None
    at, above = (trapezoid(needed * (1 + more), first, last, **fields) for more in (0.0, 1e-9))
    assert at is not None
    assert above is not None
    assert len(at.phases) == 1
    assert at.curve.end == pytest.approx(abs(first - last) / (2.0 if first > last else 4.0), rel=1e-12)
    assert above.curve.end == pytest.approx(at.curve.end, rel=1e-6)


def test_constant_speed_is_a_trapezoid() -> None:
    planned = trapezoid(6.0, 2.0, 2.0, duration=3.0, velocity=2.0)
    assert planned is not None
    assert [phase.name for phase in planned.phases] == ["cruise"]
    assert trapezoid(6.1, 2.0, 2.0, duration=3.0, velocity=2.0) is None
    assert trapezoid(5.9, 2.0, 2.0, duration=3.0, velocity=2.0) is None


@settings(max_examples=50, deadline=None)
@given(distance=decimals(-3, 3), first=decimals(-3, 3), last=decimals(-3, 3), rise=rates, fall=rates)
def test_overshoot_always_arrives(
    distance: float, first: float, last: float, rise: float, fall: float
) -> None:
    assume(abs(distance) > 1e-6)
    fields = {"velocity": 4.0, "acceleration": rise, "deceleration": fall, "overshoot": True}
    free = trapezoid(distance, first, last, **fields)
    assert free is not None
    curve = free.curve
    assert curve.piece_ends(0)[1][-1, 0] == pytest.approx(distance, abs=1e-12)
    assert curve.piece_ends(1)[1][-1, 0] == pytest.approx(last, abs=1e-9)
    for order in (0, 1):  # joined without a jump
        start, end = curve.piece_ends(order)
        np.testing.assert_allclose(start[1:], end[:-1], rtol=0, atol=1e-9)
    assert np.abs(curve.evaluate(np.linspace(0, curve.end, 300), 1)).max() <= 4.0 * (1 + 1e-9)
    strict = trapezoid(distance, first, last, **{**fields, "overshoot": False})
    if strict is not None:
        assert strict.curve.breaks.tobytes() == curve.breaks.tobytes()
        assert strict.curve.coefficients.tobytes() == curve.coefficients.tobytes()
        return
    beyond = curve.evaluate(np.linspace(0, curve.end, 2000))[:, 0] * math.copysign(1, distance)
    assert beyond.max() > abs(distance) or beyond.min() < 0
    del fields["velocity"]
    longer = trapezoid(distance, first, last, **fields, duration=curve.end + 5.0)
    if longer is not None:
        assert longer.curve.end == pytest.approx(curve.end + 5.0, rel=1e-12)
        assert longer.curve.piece_ends(0)[1][-1, 0] == pytest.approx(distance, abs=1e-12)


def test_unsynchronised_joints_arrive_by_themselves() -> None:
    job = {
        "version": 1,
        "robot": {"joints": 3},
        "limits": {"velocity": [1, 2, 3], "acceleration": [4, 5, None]},
        "start": {"joints": [0, 0, 1]},
        "moves": [{"planner": "trapezoid", "to": {"joints": [2, -3, 1]}, "synchronize": "none"}],
    }
    planned = plan_of(job)
    assert planned is not None, "the joint that rests needs no acceleration limit"
    alone = (2 / 1 + 1 / 4, 3 / 2 + 2 / 5, 0.0)  # distance over speed plus speed over rate
    assert planned.arrivals == pytest.approx(alone, rel=1e-12)
    assert planned.curve.end == pytest.approx(max(alone), rel=1e-12)
    after = planned.curve.evaluate(np.linspace(alone[1], alone[0], 10))
    np.testing.assert_allclose(after[:, 1], -3, rtol=0, atol=1e-12)
    assert (planned.curve.evaluate(np.linspace(0, planned.curve.end, 20))[:, 2] == 1).all()


@pytest.mark.parametrize("sign", [1, -1])
def test_a_joint_that_arrives_moving_cannot_wait(sign: int) -> None:
    job = {
        "version": 1,
        "robot": {"joints": 2},
        "limits": {"velocity": 1, "acceleration": 4},
        "start": {"joints": [0, 0]},
        "moves": [
            {
                "planner": "trapezoid",
                "to": {"joints": [sign, 3], "velocity": [0.5 * sign, 0]},
                "synchronize": "none",
            }
        ],
    }
    planner, start, robot = only_move(job)
    with pytest.raises(PlanningError, match=r"j1 arrives .* cannot wait"):
        planner.plan(start, robot)


def two_joints(target: Any, start: Any = (0.0, 0.0), limits: Any = None, **fields: Any) -> Any:
    """Return planner, start and robot of a trapezoid from [0, 0] at the velocities `start`."""
    return only_move(
        {
            "version": 1,
            "robot": {"joints": 2},
            "limits": limits or {},
            "start": {"joints": [0, 0], "velocity": [*start]},
            "moves": [{"planner": "trapezoid", "to": target, **fields}],
        }
    )


@pytest.mark.parametrize(
    ("fields", "match"),
    [
        ({"velocity": [9, 3]}, "velocity of j2 must be above 4 rad/s and at most 8 rad/s, got 3 rad/s"),
        (
            {"velocity": [1.25, 99]},
            "velocity of j1 must be above 2 rad/s and at most 4 rad/s, got 1.25 rad/s",
        ),
        ({"acceleration": [9, 3]}, r"acceleration of j2 must be at least 16 rad/s\^2, got 3 rad/s\^2"),
        ({"acceleration": [7, 99]}, r"acceleration of j1 must be at least 8 rad/s\^2, got 7 rad/s\^2"),
        ({"acceleration": [5, 8]}, r"acceleration of j2 must be at least 16 rad/s\^2, got 8 rad/s\^2"),
    ],
)
def test_of_joints_on_one_line_the_one_that_binds_is_named(fields: dict[str, Any], match: str) -> None:
    planner, start, robot = two_joints({"joints": [-2, 4]}, duration=1.0, **fields)
    with pytest.raises(PlanningError) as caught:
        planner.plan(start, robot)
    job = {"version": 1, "robot": {"joints": 2}, "moves": [{"planner": "hold", "duration": 1}]}
    assert re.search(match, str(caught.value.said_by(loaded(job | {"start": {"joints": [0, 0]}}).say)))


@pytest.mark.parametrize("velocity", [(0.1, -2e-4), (0.1, 2e-4), (-0.1, 2e-4)])
def test_a_start_beside_the_line_is_refused_by_its_joint(velocity: tuple[float, float]) -> None:
    planner, start, robot = two_joints({"joints": [1, 0]}, velocity, acceleration=[3, 3], overshoot=True)
    with pytest.raises(PlanningError, match="of j2 leaves it"):
        planner.plan(start, robot)


@pytest.mark.parametrize(
    ("target", "start", "fields"),
    [
        ({"joints": [1, 0]}, (0, 0.5), {"synchronize": "none", "overshoot": True}),
        ({"joints": [1, 0], "velocity": [0, 0.5]}, (0, 0), {"synchronize": "none", "overshoot": True}),
        ({"joints": [1, 1]}, (0, 0), {"duration": 3.0}),
    ],
)
def test_a_joint_whose_ramps_nothing_limits_is_named(target: Any, start: Any, fields: dict[str, Any]) -> None:
    limits = {"velocity": 1, "acceleration": [2, None]}
    planner, state, robot = two_joints(target, start, limits, **fields)
    with pytest.raises(MissingLimitError, match="j2"):
        planner.plan(state, robot)


def test_joints_that_arrive_by_themselves_wait_for_the_least_duration_or_for_hardly_a_moment() -> None:
    limits = {"velocity": 1, "acceleration": 4}
    planner, start, robot = two_joints({"joints": [2, 1.9995]}, limits=limits, synchronize="none")
    assert planner.plan(start, robot).arrivals == pytest.approx((2.25, 2.2495), rel=1e-12)
    fields = {"synchronize": "none", "minimum_duration": 5.0}
    planner, start, robot = two_joints({"joints": [2, 0]}, limits=limits, **fields)
    planned = planner.plan(start, robot)
    assert planned.curve.end == pytest.approx(5.0, rel=1e-12)
    assert not planned.curve.evaluate(np.linspace(0, 5, 20))[:, 1].any()


@pytest.mark.parametrize("first", [0.0, 0.4])
def test_a_least_duration_changes_no_velocity_at_an_end(first: float) -> None:
    for last in (0.0, 0.5):
        planned = trapezoid(2.0, first, last, velocity=1.0, acceleration=4.0, minimum_duration=5.0)
        assert planned is not None
        assert planned.curve.end == pytest.approx(5.0, rel=1e-12)
        (begin, _), (_, end) = (ends[[0, -1], 0] for ends in planned.curve.piece_ends(1))
        assert (begin, end) == pytest.approx((first, last), abs=1e-12)
        assert planned.curve.piece_ends(0)[1][-1, 0] == pytest.approx(2.0, rel=1e-12)


def test_a_target_that_is_the_start_takes_the_time_that_is_asked_for() -> None:
    """At rest it waits; in motion it cannot be passed later without going back to it."""
    assert trapezoid(0.0, acceleration=1.0, minimum_duration=2.0).curve.end == 2.0
    fields = {"synchronize": "none", "overshoot": True, "acceleration": 1.0}
    assert trapezoid(0.0, 0.5, 0.5, **fields).curve.end == 0.0
    for name in ("duration", "minimum_duration"):
        assert trapezoid(0.0, 0.5, 0.5, **fields, **{name: 8.0}) is None


@pytest.mark.parametrize(
    ("distance", "first", "last"), [(0.125, 0.5, 0.0), (-0.5, 0.0, -1.0), (0.0, 0.5, -0.5)]
)
def test_where_braking_takes_the_whole_distance_the_joint_waits_at_rest(
    distance: float, first: float, last: float
) -> None:
    """The shorter duration that is left after braking is not the only one: a cruise may have no velocity at all."""
    fields = {"synchronize": "none", "overshoot": True, "acceleration": 1.0}
    for duration in (1.0, 1.5, 8.0):
        planned = trapezoid(distance, first, last, duration=duration, **fields)
        assert planned is not None
        assert planned.curve.end == pytest.approx(duration, rel=1e-12)
        assert planned.curve.piece_ends(0)[1][-1, 0] == pytest.approx(distance, abs=1e-12)
        assert planned.curve.piece_ends(1)[1][-1, 0] == pytest.approx(last, abs=1e-12)
        assert np.abs(planned.curve.piece_ends(2)).max() <= 1.0 + 1e-9


def test_given_duration_and_speed_lead_backwards_as_forwards() -> None:
    forth, back = (trapezoid(sign * 3.0, duration=4.0, velocity=1.0) for sign in (1, -1))
    t = np.linspace(0, 4, 50)
    np.testing.assert_allclose(back.curve.evaluate(t), -forth.curve.evaluate(t), rtol=0, atol=1e-15)
    assert np.abs(back.curve.evaluate(2.0, 1)[0]) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("fields", "match"),
    [
        ({"duration": 1.0, "velocity": 3.0, "acceleration": 9.0}, "ask too much of a trapezoid"),
        ({"duration": 1.0, "minimum_duration": 2.0}, "exclude each other"),
        ({"duration": 1.0, "velocity": 3.0, "overshoot": True}, "does not overshoot"),
    ],
)
def test_fields_that_do_not_go_together_are_refused(fields: dict[str, Any], match: str) -> None:
    with pytest.raises(InputError, match=match):
        trapezoid(1.0, **fields)


@pytest.mark.parametrize(
    ("fields", "match"),
    [
        ({"start_velocity": 3.0, "acceleration": 1.0}, "too fast"),
        ({"end_velocity": 3.0, "acceleration": 1.0}, "cannot reach its end velocity"),
        ({"end_velocity": -1.0, "acceleration": 1.0}, "turn round"),
        ({"duration": 1.0, "velocity": 3.0}, "above 1 rad/s and at most 2 rad/s, got 3 rad/s"),
        ({"duration": 0.4, "velocity": 3.0, "start_velocity": 3.0, "end_velocity": 3.0}, "at no velocity"),
        ({"duration": 1.0, "velocity": 3.0, "start_velocity": 3.0, "end_velocity": 3.0}, "at no velocity"),
        ({"duration": 1.05, "velocity": 1.5, "deceleration": 1.1}, "at no velocity does j1 cover its dist"),
        ({"duration": 1.0, "velocity": 3.0, "start_velocity": -1.0}, "turn round"),
        ({"duration": 1.0, "velocity": 3.0, "end_velocity": -1.0}, "turn round"),
        ({"duration": 1.0, "acceleration": 3.0}, r"at least 4 rad/s\^2, got 3 rad/s\^2"),
        ({"duration": 1.0, "acceleration": 2.0, "deceleration": 3.0}, "at least 1.29099445 s"),
        ({"duration": 9.0, "acceleration": 2.0, "start_velocity": 2.0, "end_velocity": 1.0}, "and at most"),
    ],
)
def test_what_is_impossible_is_explained(fields: dict[str, float], match: str) -> None:
    fields = dict(fields)
    velocities = [fields.pop(name, 0.0) for name in ("start_velocity", "end_velocity")]
    job = {
        "version": 1,
        "robot": {"joints": 1},
        "start": {"joints": [0], "velocity": velocities[:1]},
        "moves": [{"planner": "trapezoid", "to": {"joints": [1], "velocity": velocities[1:]}, **fields}],
    }
    planner, start, robot = only_move(job)
    with pytest.raises(PlanningError) as caught:
        planner.plan(start, robot)
    text = str(caught.value.said_by(loaded(job).say))
    assert re.search(match, text), text


def least_duration(
    distance: float,
    start: float,
    end: float,
    speed: float,
    rate: float,
    lower: tuple[float, float] | None = None,
) -> float:
    """Return the duration that ruckig finds without a limit of jerk; `lower` has the limits below zero."""
    wanted, answer = ruckig.InputParameter(1), ruckig.Trajectory(1)
    wanted.current_position, wanted.target_position = [0.0], [distance]
    wanted.current_velocity, wanted.target_velocity = [start], [end]
    wanted.current_acceleration, wanted.target_acceleration = [0.0], [0.0]
    wanted.max_velocity, wanted.max_acceleration, wanted.max_jerk = [speed], [rate], [math.inf]
    wanted.min_velocity, wanted.min_acceleration = ([low] for low in lower or (-speed, -rate))
    assert ruckig.Ruckig(1).calculate(wanted, answer) in (ruckig.Result.Working, ruckig.Result.Finished)
    return float(answer.duration)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("synchronize", ["time", "none"])
def test_an_end_against_the_way(sign: int, synchronize: str) -> None:
    fields = {"velocity": 4.758, "acceleration": 4.178, "overshoot": True, "synchronize": synchronize}
    planned = trapezoid(sign * 0.0356, sign * 0.8, sign * -0.4, **fields)
    least = least_duration(0.0356, 0.8, -0.4, 4.758, 4.178)
    assert least == pytest.approx(0.3357, abs=1e-4)
    assert planned.curve.duration == pytest.approx(least, rel=1e-9)


@settings(max_examples=200, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_with_overshoot_it_is_the_fastest_of_all(seed: int) -> None:
    rng = np.random.default_rng(seed)
    speed, rate = rng.uniform(0.5, 5, 2).tolist()
    start, end = (rng.uniform(-0.95, 0.95, 2) * speed).tolist()
    distance = float(rng.normal() * 10 ** rng.uniform(-3, 0.5))
    planned = trapezoid(distance, start, end, velocity=speed, acceleration=rate, overshoot=True)
    assert planned is not None
    least = least_duration(distance, start, end, speed, rate)
    assert planned.curve.duration == pytest.approx(least, rel=1e-7, abs=1e-7)


@settings(max_examples=200, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_within_limits_that_differ_by_direction_it_is_the_fastest_of_all(seed: int) -> None:
    rng = np.random.default_rng(seed)
    velocity, acceleration = (np.array([-1, 1]) * rng.uniform(0.5, 5, 2) for _ in range(2))
    start, end = rng.uniform(0.95 * velocity[0], 0.95 * velocity[1], 2).tolist()
    distance = float(rng.normal() * 10 ** rng.uniform(-3, 0.5))
    job = {
        "version": 1,
        "robot": {"joints": 1},
        "limits": {"velocity": [velocity.tolist()], "acceleration": [acceleration.tolist()]},
        "start": {"joints": [0], "velocity": [start]},
        "moves": [
            {"planner": "trapezoid", "to": {"joints": [distance], "velocity": [end]}, "overshoot": True}
        ],
    }
    planned = plan_of(job)
    assert planned is not None
    least = least_duration(distance, start, end, velocity[1], acceleration[1], (velocity[0], acceleration[0]))
    assert planned.curve.duration == pytest.approx(least, rel=1e-7, abs=1e-7)
    t = np.linspace(0, planned.curve.end, 300)
    for order, (low, high) in ((1, velocity), (2, acceleration)):
        values = planned.curve.evaluate(t, order)
        assert low * (1 + 1e-6) <= values.min()
        assert values.max() <= high * (1 + 1e-6)
