"""The unit of length changes nothing: ruckig's tolerances are absolute, ours are relative."""

from __future__ import annotations

import numpy as np
import pytest
from jerk_limited_moves import arm, misses, move_to, ruckigs_own, state, steps

from trajcli.trajectory import State


def scaled_by(one: State, scale: float) -> State:
    return State(one.position * scale, one.velocity * scale, one.acceleration * scale)


def moving_states(seed):
    """Return start, end and limits of one joint that moves at both ends."""
    rng = np.random.default_rng(seed)
    v, a, j = 10 ** rng.uniform([-0.5, 0, 1], [0.5, 1, 2])
    ends = []
    for position in (0.0, rng.normal() * 3):
        velocity = rng.uniform(-0.9, 0.9) * v
        most = min(a, np.sqrt(2 * j * (v - abs(velocity))))
        ends.append(state([position], velocity, rng.uniform(-0.9, 0.9) * most))
    return *ends, np.array([v, a, j])


@pytest.mark.parametrize("power", [-30, -16, 16, 24, 30])
@pytest.mark.parametrize("seed", [19, 22, 26, 30])
def test_a_motion_in_other_units_lasts_as_long(seed, power):
    """Factors of two change no digit. Ruckig itself says how long it takes where lengths suit it."""
    start, end, limits = moving_states(seed)
    duration = ruckigs_own(start, end, arm(*limits[:, None])).duration
    scale = 2.0**power
    small = [scaled_by(one, scale) for one in (start, end)]
    robot = arm(*limits[:, None] * scale)
    planned = move_to(small[1]).plan(small[0], robot)
    assert planned.curve.duration == pytest.approx(duration, rel=1e-9)
    assert misses(planned.curve, *small, 1e-11) == []
    assert steps(planned.curve) < 1e-11


@pytest.mark.parametrize("power", [-30, -20, 20, 30])
@pytest.mark.parametrize("seed", [2, 105, 143, 149])
def test_a_slower_motion_in_other_units_exists_too(seed, power):
    start, end, limits = moving_states(seed)
    wanted = 1.7 * ruckigs_own(start, end, arm(*limits[:, None])).duration
    duration = ruckigs_own(start, end, arm(*limits[:, None]), wanted).duration
    scale = 2.0**power
    small = [scaled_by(one, scale) for one in (start, end)]
    robot = arm(*limits[:, None] * scale)
    planned = move_to(small[1], minimum_duration=wanted).plan(small[0], robot)
    assert planned.curve.duration == pytest.approx(duration, rel=1e-9)
    assert misses(planned.curve, *small, 1e-11) == []
