"""The fastest return into bounds: against ruckig's own braking, and against random admissible controls."""

from __future__ import annotations

import numpy as np
import pytest
from tiers import few

from trajcli.curves.braking import braking


def _problem(seed, jerk=True):
    rng = np.random.default_rng(seed)
    v, a, j = 10 ** rng.uniform(-1, 1, 2), 10 ** rng.uniform(-0.5, 1, 2), 10 ** rng.uniform(-0.5, 2)
    bounds = np.array([[-v[0], v[1]], [-a[0], a[1]], [-j, j] if jerk else [-np.inf, np.inf]])
    velocity = float(rng.uniform(-2, 2) * rng.choice(v))
    acceleration = float(rng.uniform(-2, 2) * a[1] * rng.integers(0, 2))
    return velocity, acceleration if jerk else 0.0, bounds


def _last_outside(times, values, bounds):
    low, high = bounds
    outside = (values > high + 1e-9 * abs(high)) | (values < low - 1e-9 * abs(low))
    return float(times[outside].max(initial=0.0))


def _ruckig(velocity, acceleration, bounds):
    """Return (times, velocities, accelerations) of ruckig's motion to rest somewhere."""
    import ruckig

    wanted, answer = ruckig.InputParameter(1), ruckig.Trajectory(1)
    wanted.current_velocity, wanted.current_acceleration = [velocity], [acceleration]
    wanted.target_position = [3.0]
    (low, high), (least, most) = bounds[0], bounds[1]
    wanted.min_velocity, wanted.max_velocity = [low], [high]
    wanted.min_acceleration, wanted.max_acceleration = [least], [most]
    wanted.max_jerk = [bounds[2, 1]]
    assert int(ruckig.Ruckig(1).calculate(wanted, answer)) >= 0
    known = braking(velocity, acceleration, bounds)
    near = [t + d for t in (known.velocity, known.acceleration) for d in (-1e-6, -1e-7, 1e-9)]
    near.append(abs(acceleration) / bounds[2, 1])
    times = np.concatenate([np.linspace(0, answer.duration, 3001), near])
    times = np.unique(np.clip(times, 0, answer.duration))
    rows = np.array([answer.at_time(t) for t in times])[:, :, 0]
    return times, rows[:, 1], rows[:, 2]


@pytest.mark.parametrize("seed", few(range(150)))
def test_times_inside_are_those_of_ruckigs_braking(seed):
    velocity, acceleration, bounds = _problem(seed)
    known = braking(velocity, acceleration, bounds)
    times, velocities, accelerations = _ruckig(velocity, acceleration, bounds)
    assert _last_outside(times, velocities, bounds[0]) == pytest.approx(known.velocity, abs=2e-6)
    assert _last_outside(times, accelerations, bounds[1]) == pytest.approx(known.acceleration, abs=2e-6)
    if known.velocity:
        farthest = velocities.max() if known.fastest > 0 else velocities.min()
        assert farthest == pytest.approx(known.fastest, rel=1e-9)


@pytest.mark.parametrize("seed", few(range(60)))
def test_no_admissible_control_is_inside_sooner_for_good(seed):
    """Random jerks: whoever is within the velocity bound before, has to leave the bounds later."""
    velocity, acceleration, bounds = _problem(seed)
    known = braking(velocity, acceleration, bounds)
    jerk, rng = bounds[2, 1], np.random.default_rng(seed + 1000)
    step = max(known.velocity, 1e-3) / 40
    if not known.velocity or known.acceleration:
        return
    side = 1.0 if known.fastest > 0 else -1.0
    bound = bounds[0, 1] if side > 0 else bounds[0, 0]
    other = bounds[0, 0] if side > 0 else bounds[0, 1]
    for _ in range(200):
        v, a, time = velocity, acceleration, 0.0
        bias = rng.uniform(0, 1)
        entered = None
        while time < known.velocity * (1 - 1e-9):
            j = min(max(rng.normal(-side * bias * jerk, jerk / 2), -jerk), jerk)
            j = min(max(j, (bounds[1, 0] - a) / step), (bounds[1, 1] - a) / step)
            v, a, time = v + a * step + j * step**2 / 2, a + j * step, time + step
            if entered is None and side * (v - bound) < -1e-9 and time < known.velocity * (1 - 1e-9):
                entered = v + a * abs(a) / (2 * jerk) if side * a < 0 else None
        if entered is not None:  # then it must undershoot the other bound, or be carried out once more
            assert side * (entered - other) < 1e-6 * abs(other)


@pytest.mark.parametrize("seed", range(20))
def test_without_a_jerk_bound_the_acceleration_steps(seed):
    velocity, acceleration, bounds = _problem(seed, jerk=False)
    known = braking(velocity, acceleration, bounds)
    high, low = bounds[0, 1], bounds[0, 0]
    expected = max((velocity - high) / -bounds[1, 0], (low - velocity) / bounds[1, 1], 0.0)
    assert known.velocity == pytest.approx(expected, rel=1e-12)
    assert sum(time for time, _ in known.phases) == pytest.approx(expected, rel=1e-12)


def test_state_within_its_bounds_needs_no_braking():
    bounds = np.array([[-1.0, 1.0], [-2.0, 2.0], [-3.0, 3.0]])
    assert braking(1.0, 0.0, bounds).phases == ()
    assert braking(0.5, 1.7, bounds).phases == ()  # 0.5 + 1.7^2 / 6 = 0.98
    assert braking(0.5, 1.8, bounds).velocity > 0  # 0.5 + 1.8^2 / 6 = 1.04
    assert braking(0.5, 1.8, bounds).fastest == pytest.approx(1.04)


def test_acceleration_alone():
    known = braking(0.0, -2.5, np.array([[-9.0, 9.0], [-2.0, 2.0], [-4.0, 8.0]]))
    assert known.phases == ((0.125, 4.0),)
    assert (known.velocity, known.acceleration) == (0.0, 0.125)


def test_unlimited_acceleration():
    bounds = np.array([[-np.inf, 1.0], [-np.inf, np.inf], [-2.0, 2.0]])
    assert braking(5.0, 0.0, bounds).velocity == pytest.approx(2.0)  # 2 t^2 / 2 = 4


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize(("beyond", "brakes"), [(1e-13, False), (1e-10, True), (1e-7, True)])
def test_what_is_beyond_a_bound_by_more_than_rounding_is_beyond(beyond, brakes, side):
    """Bounds that differ by direction; a velocity that the acceleration carries there, and one that is there."""
    bounds = np.array([[-3.0, 2.0], [-5.0, 4.0], [-20.0, 10.0]])
    bound = 2.0 if side > 0 else 3.0
    carried = braking(side * (bound * (1 + beyond) - 1.0**2 / 20.0), side, bounds)
    assert bool(carried.phases) == brakes
    there = braking(side * bound * (1 + beyond), 0.0, bounds)
    assert bool(there.phases) == brakes
    assert abs(there.fastest) == pytest.approx(bound, rel=1e-6)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_what_brakes_too_hard_is_brought_to_its_bound_first(side):
    """From -5 to -3 at a jerk of 10 takes 0.2 s; the velocity falls by 0.8 meanwhile, and by 0.2 at -3 after that."""
    bounds = np.array([[-100.0, 1.0], [-3.0, 4.0], [-10.0, 10.0]])
    bounds = bounds if side > 0 else -bounds[:, ::-1]
    found = braking(side * 2.0, side * -5.0, bounds)
    assert found.acceleration == pytest.approx(0.2)
    assert found.velocity == pytest.approx(0.2 + 0.2 / 3.0)
    assert found.fastest == side * 2.0, "it slows down from the first moment on"


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_other_bound_is_not_left_while_the_velocity_comes_back(side):
    """From 1.3 down to -2 at a jerk of 10, in 0.2 s, from where the same jerk up ends at rest on the lower bound of 0.9."""
    bounds = np.array([[0.9, 1.0], [-3.0, 4.0], [-10.0, 10.0]])
    bounds = bounds if side > 0 else -bounds[:, ::-1]
    found = braking(side * 1.3, 0.0, bounds)
    assert found.velocity == pytest.approx(0.2 + (2.0 - np.sqrt(2.0)) / 10.0)
