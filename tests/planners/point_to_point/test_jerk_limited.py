"""jerk_limited over random moves: durations, boundaries, limits, lines; each judge is shown to see a mutant."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from jerk_limited_moves import (
    arm,
    drift,
    excesses,
    misses,
    move_to,
    peaks,
    random_move,
    ruckigs_own,
    state,
    steps,
)

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.planners.ruckig import BoundaryProblem, fastest

SEEDS, JOINTS = st.integers(0, 2**32 - 1), st.integers(1, 12)


@pytest.mark.full
@settings(max_examples=60, deadline=None)
@given(SEEDS, JOINTS)
def test_time_synchronised_motion(seed, n):
    start, end, robot = random_move(seed, n)
    planned = move_to(end).plan(start, robot)
    reference = ruckigs_own(start, end, robot)
    assert planned.curve.duration == pytest.approx(reference.duration, rel=1e-9)
    np.testing.assert_allclose(planned.arrivals, reference.independent_min_durations, rtol=1e-9)
    assert misses(planned.curve, start, end) == []
    assert excesses(planned.curve, robot.limits) == []
    assert steps(planned.curve) < 1e-11
    assert max(max(drift(planned.curve, joint)) for joint in range(n)) < 1e-12
    assert planned.end.position is not start.position
    assert misses(planned.curve, start, planned.end) == []


@settings(max_examples=25, deadline=None)
@given(SEEDS, JOINTS)
def test_each_joint_by_itself(seed, n):
    start, end, robot = random_move(seed, n)
    end = state(end.position)
    planned = move_to(end, synchronize="none").plan(start, robot)
    for joint, arrival in enumerate(planned.arrivals):
        alone = [state(s.position[[joint]], s.velocity[joint], s.acceleration[joint]) for s in (start, end)]
        one = arm(*(robot.limits.of_order(order)[[joint]] for order in (1, 2, 3)))
        assert arrival == pytest.approx(ruckigs_own(*alone, one).duration, rel=1e-9)
        after = planned.curve.evaluate(np.linspace(arrival, planned.curve.end, 5)[1:])[:, joint]
        np.testing.assert_allclose(
            after, end.position[joint], rtol=0, atol=1e-12 * peaks(planned.curve)[0, joint]
        )
    assert planned.curve.duration == max(planned.arrivals)
    assert misses(planned.curve, start, end) == []
    assert excesses(planned.curve, robot.limits) == []


@settings(max_examples=40, deadline=None)
@given(SEEDS, JOINTS)
def test_phase_synchronised_motion_stays_on_the_line(seed, n):
    start, end, robot = random_move(seed, n, moving=False)
    planned = move_to(end, synchronize="phase").plan(start, robot)
    along = np.abs(end.position - start.position)
    slowest = [(robot.limits.of_order(order)[:, 1] / along).min() for order in (1, 2, 3)]
    assert planned.curve.duration == pytest.approx(double_s(1.0, *slowest), rel=1e-9)
    assert off_line(planned.curve, start.position, end.position) < 1e-12
    assert misses(planned.curve, start, end) == []
    assert excesses(planned.curve, robot.limits) == []
    t = np.linspace(0, planned.curve.end, 50)
    law = planned.law.evaluate(t)
    assert law.min() >= -1e-15
    assert law.max() <= 1 + 1e-15
    np.testing.assert_allclose(
        planned.curve.evaluate(t), start.position + law * (end.position - start.position), atol=1e-13
    )


@settings(max_examples=25, deadline=None)
@given(SEEDS, JOINTS)
def test_phase_synchronised_motion_between_parallel_velocities(seed, n):
    start, end, robot = random_move(seed, n, moving=False)
    rng = np.random.default_rng(seed)
    displacement = end.position - start.position
    fastest_rate = (robot.limits.velocity[:, 1] / np.abs(displacement)).min()
    start, end = (
        state(s.position, fastest_rate * rng.uniform(-0.9, 0.9) * displacement) for s in (start, end)
    )
    planned = move_to(end, synchronize="phase").plan(start, robot)
    assert off_line(planned.curve, start.position, end.position) < 1e-12
    assert misses(planned.curve, start, end) == []
    assert excesses(planned.curve, robot.limits) == []


@settings(max_examples=25, deadline=None)
@given(SEEDS, JOINTS, st.floats(1.0, 20.0))
def test_minimum_duration_is_met_exactly(seed, n, factor):
    start, end, robot = random_move(seed, n, moving=False)
    for synchronize in ("time", "phase", "none"):
        quickest = move_to(end, synchronize=synchronize).plan(start, robot).curve.duration
        move = move_to(end, synchronize=synchronize, minimum_duration=quickest * factor)
        planned = move.plan(start, robot)
        assert planned.curve.duration == max(quickest, move.minimum_duration)
        assert planned.events == ()
        assert misses(planned.curve, start, end) == []
        assert excesses(planned.curve, robot.limits) == []


@settings(max_examples=25, deadline=None)
@given(SEEDS, JOINTS)
def test_reversed_motion_takes_as_long(seed, n):
    start, end, robot = random_move(seed, n, moving=False)
    forth = move_to(end).plan(start, robot)
    back = move_to(start).plan(end, robot)
    assert back.curve.duration == pytest.approx(forth.curve.duration, rel=1e-12)


@settings(max_examples=25, deadline=None)
@given(SEEDS, JOINTS, st.sampled_from(["time", "none", "phase"]))
def test_stop_is_as_fast_as_allowed(seed, n, synchronize):
    start, _, robot = random_move(seed, n)
    if synchronize == "phase":
        start = state(start.position, start.velocity)
    target = state(start.position)
    planned = move_to(target, joints=False, synchronize=synchronize).plan(start, robot)
    assert misses(planned.curve, start, planned.end) == []
    assert not planned.end.velocity.any()
    assert excesses(planned.curve, robot.limits) == []
    if synchronize == "phase":
        reached = start.position + start.velocity
        assert off_line(planned.curve, start.position, reached) < 1e-12 or not start.velocity.any()
    else:
        stops = [shortest_stop(start, robot, joint) for joint in range(n)]
        np.testing.assert_allclose(planned.arrivals, stops, rtol=1e-9, atol=1e-12)
        assert planned.curve.duration == pytest.approx(max(stops), rel=1e-9)


def shortest_stop(start, robot, joint):
    """Return the time that jerk and acceleration limits need to end velocity v and acceleration a."""
    v, a = start.velocity[joint], start.acceleration[joint]
    top, jerk = robot.limits.acceleration[joint, 1], robot.limits.jerk[joint, 1]
    coming = v + a * abs(a) / (2 * jerk)  # the velocity that is left when the acceleration is just taken back
    if coming < 0:
        v, a = -v, -a
    # ramp from a down to -peak, stay, and back to zero
    peak = np.sqrt(jerk * v + a**2 / 2)
    if peak <= top:
        return (a + 2 * peak) / jerk
    stay = (v + (a**2 - 2 * top**2) / (2 * jerk)) / top
    return (a + 2 * top) / jerk + stay


def double_s(distance, speed, acceleration, jerk):
    """Return the shortest time from rest to rest: Biagiotti and Melchiorri (2008), section 3.4.2."""
    ramp = min(acceleration / jerk, np.sqrt(speed / jerk))
    rise = speed / (jerk * ramp) + ramp
    if speed * rise <= distance:
        return distance / speed + rise
    if 2 * acceleration**3 / jerk**2 <= distance:
        return acceleration / jerk + np.sqrt((acceleration / jerk) ** 2 + 4 * distance / acceleration)
    return 4 * (distance / (2 * jerk)) ** (1 / 3)


def off_line(curve, start, end):
    """Return the largest distance of 200 points from the straight line, relative to its length."""
    direction = (end - start) / max(float(np.linalg.norm(end - start)), 1e-300)
    away = curve.evaluate(np.linspace(0, curve.end, 200)) - start
    away -= np.outer(away @ direction, direction)
    return float(np.abs(away).max()) / max(float(np.linalg.norm(end - start)), float(np.abs(start).max()))


# The judges above see what they are there for.


@pytest.fixture
def example():
    start, end, robot = random_move(11, 3)
    return start, end, robot, move_to(end).plan(start, robot).curve


def test_boundary_judge_sees_a_phase_that_is_a_billionth_of_a_second_too_long():
    task = BoundaryProblem(
        "x", (0.0, 0.3, 0.1), (2.0, -0.4, 0.2), np.array([[-1.0, 1.0], [-2.0, 2.0], [-5.0, 5.0]])
    )
    profile = fastest(task)
    start, end = state([0.0], 0.3, 0.1), state([2.0], -0.4, 0.2)
    assert misses(profile.curve(), start, end) == []
    for k in range(len(profile.chain.durations)):
        durations = np.array(profile.chain.durations)
        durations[k] += 1e-9
        states = np.array(replace(profile.chain, durations=tuple(durations.tolist())).states)
        constants = np.array(profile.chain.constants)
        coefficients = np.stack([constants / 6, states[:-1, 2] / 2, states[:-1, 1], states[:-1, 0]])
        breaks = np.concatenate([[0.0], np.cumsum(durations)])
        assert misses(PiecewisePolynomial(breaks, coefficients[:, :, None]), start, end)


def test_judges_see_changed_coefficients(example):
    start, end, robot, curve = example
    for row, factor in ((0, 1 + 1e-8), (1, 1 + 1e-8), (2, 1 + 1e-8)):
        changed = curve.coefficients.copy()
        changed[row] *= factor
        mutant = PiecewisePolynomial(curve.breaks, changed)
        assert steps(mutant) > 1e-9 or misses(mutant, start, end)
    faster = PiecewisePolynomial(
        curve.breaks * 0.999, curve.coefficients / 0.999 ** np.arange(3, -1, -1)[:, None, None]
    )
    assert excesses(faster, robot.limits)
    assert max(drift(PiecewisePolynomial(curve.breaks * (1 + 1e-9), curve.coefficients), 0)) > 1e-12


def test_line_judge_sees_time_synchronisation():
    start, end, robot = random_move(5, 3, moving=False)
    assert off_line(move_to(end).plan(start, robot).curve, start.position, end.position) > 1e-3
