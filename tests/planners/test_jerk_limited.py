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
from trajcli.planners.profile import Task
from trajcli.planners.ruckig_solve import fastest, fastest_of

SEEDS, JOINTS = st.integers(0, 2**32 - 1), st.integers(1, 12)
MODES = pytest.mark.parametrize("synchronize", ["time", "none"])


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


@MODES
def test_joint_that_stays_needs_no_limits(synchronize):
    robot = arm([1.0, np.inf], [2.0, np.inf], [3.0, np.inf])
    planned = move_to(state([1.0, 5.0]), synchronize=synchronize).plan(state([0.0, 5.0]), robot)
    assert planned.arrivals[1] == 0
    np.testing.assert_array_equal(planned.curve.evaluate(planned.curve.end / 3)[1], 5.0)


def test_moving_state_reached_already_takes_no_time():
    moving = state([1.0, 2.0], 0.5, 0.1)
    planned = move_to(moving).plan(moving, arm([1.0] * 2, [1.0] * 2, [1.0] * 2))
    assert planned.curve.duration == 0
    assert planned.curve.evaluate(0.0).tolist() == [1.0, 2.0]
    assert planned.end.velocity.tolist() == [0.5, 0.5]


def test_moving_state_reached_again_takes_a_loop():
    moving, robot = state([1.0], 0.5), arm([1.0], [1.0], [1.0])
    planned = move_to(moving, minimum_duration=1.0).plan(moving, robot)
    assert planned.curve.duration == pytest.approx(ruckigs_own(moving, moving, robot, 1.0).duration, rel=1e-9)
    assert misses(planned.curve, moving, moving) == []
    assert [event.kind for event in planned.events] == ["longer_than_minimum"]
    assert planned.events[0].amounts["wanted"].value == 1.0


def test_rest_is_held_for_the_minimum_duration():
    planned = move_to(state([1.0, 2.0]), minimum_duration=3.0).plan(
        state([1.0, 2.0]), arm([1] * 2, [1] * 2, [1] * 2)
    )
    assert planned.curve.duration == 3.0
    assert planned.curve.evaluate([0.0, 1.0, 3.0]).tolist() == [[1.0, 2.0]] * 3


def test_displacement_of_zero_between_velocities():
    start, end, robot = (
        state([1.0, 0.0], [0.5, 0.0]),
        state([1.0, 0.0], [-0.5, 0.0]),
        arm([1] * 2, [1] * 2, [1] * 2),
    )
    for synchronize in ("time", "phase"):
        planned = move_to(end, synchronize=synchronize).plan(start, robot)
        assert misses(planned.curve, start, end) == []
        assert planned.law is None


def test_run_up_of_each_joint_keeps_the_velocity_it_has_reached():
    start, end = state([0.0, 0.0]), state([0.0, 0.0], [0.5, 0.1])
    robot = arm([1] * 2, [1] * 2, [1] * 2)
    planned = move_to(end, joints=False, synchronize="none").plan(start, robot)
    assert planned.arrivals == pytest.approx((2 * 0.5**0.5, 2 * 0.1**0.5), rel=1e-12)
    np.testing.assert_allclose(planned.curve.evaluate(1.0, 1)[1], 0.1, rtol=1e-12)
    assert ("cruise", 1) in [(phase.name, phase.joint) for phase in planned.phases]
    assert misses(planned.curve, start, planned.end) == []


def test_tiny_displacement_beside_a_long_one():
    for tiny in (1e-6, 1e-9, 1e-13, 1e-17):
        start, end = state([0.0, 0.0]), state([1.0, tiny])
        robot = arm([2.0, 2.0], [10.0, 10.0], [1000.0, 1000.0])
        planned = move_to(end).plan(start, robot)
        assert misses(planned.curve, start, end) == []
        assert steps(planned.curve) < 1e-9
        assert excesses(planned.curve, robot.limits) == []
        assert planned.arrivals[1] == pytest.approx(4 * (tiny / 2000) ** (1 / 3), rel=1e-9)


def test_motion_of_hours():
    start, end, robot = state([0.0, 0.0]), state([9000.0, 1.0]), arm([0.5] * 2, [1.0] * 2, [2.0] * 2)
    planned = move_to(end).plan(start, robot)
    assert planned.curve.duration == pytest.approx(9000 / 0.5 + 0.5 + 0.5, rel=1e-12)
    assert misses(planned.curve, start, end) == []


def test_limits_by_direction():
    robot = arm([[-0.5, 2.0]], [[-1.0, 4.0]], [[-8.0, 10.0]])
    forth = move_to(state([30.0])).plan(state([0.0]), robot)
    back = move_to(state([0.0])).plan(state([30.0]), robot)
    for planned in (forth, back):
        assert excesses(planned.curve, robot.limits) == []
        assert [event.kind for event in planned.events] == ["jerk_limit_both_ways"]
    assert peaks(forth.curve)[1, 0] == pytest.approx(2.0, rel=1e-9)
    assert peaks(back.curve)[1, 0] == pytest.approx(0.5, rel=1e-9)
    assert back.curve.duration > 2 * forth.curve.duration


def test_start_outside_the_limits_is_braked_at_once():
    planned = move_to(state([5.0])).plan(state([0.0], 2.0), arm([1.0], [2.0], [3.0]))
    assert planned.phases[0].name == "brake"
    assert misses(planned.curve, state([0.0], 2.0), state([5.0])) == []
    assert (1, 0) in excesses(planned.curve, arm([1.0], [2.0], [3.0]).limits)


def test_phases_by_name():
    planned = move_to(state([10.0])).plan(state([0.0]), arm([2.0], [0.75], [0.5]))
    assert [phase.name for phase in planned.phases] == [
        "jerk +",
        "constant acceleration",
        "jerk -",
        "cruise",
        "jerk -",
        "constant acceleration",
        "jerk +",
    ]
    borders = [phase.end for phase in planned.phases]
    assert [phase.start for phase in planned.phases] == [0.0, *borders[:-1]]
    assert borders[-1] == planned.curve.duration
    np.testing.assert_allclose(borders[:3], [1.5, 2 / 0.75, 1.5 + 2 / 0.75], rtol=1e-12)


@pytest.mark.parametrize(("control", "order"), [("position", 1), ("position", 2), ("velocity", 2)])
def test_solver_without_a_jerk_or_acceleration_limit(control, order):
    bounds = np.array([[-2.0, 2.0], [-3.0, 3.0], [-np.inf, np.inf]])
    if order == 1:
        bounds[1] = [-np.inf, np.inf]
    task = Task("x", (1.0, 0.5 * (order - 1), 0.0), (6.0, -0.5 * (order - 1), 0.0), bounds, control)
    profile = fastest(task)
    if control == "velocity":
        assert profile.duration == pytest.approx(1 / 3, rel=1e-12)
    elif order == 1:
        assert profile.duration == pytest.approx(2.5, rel=1e-12)
    curve = profile.curve()
    last = [float(curve.piece_ends(k)[1][-1, 0]) for k in range(order)]
    first = 0 if control == "position" else 1
    np.testing.assert_allclose(last[first:], task.final[first:order], rtol=1e-14)
    slower = fastest_of(task, 4.0)
    assert slower.duration == 4.0
    assert np.abs(slower.curve().piece_ends(1)).max() <= 2.0 * (1 + 1e-12)
    assert {phase.name for phase in profile.phases(0)} <= {"constant acceleration", "cruise", "rest"}


# The judges above see what they are there for.


@pytest.fixture
def example():
    start, end, robot = random_move(11, 3)
    return start, end, robot, move_to(end).plan(start, robot).curve


def test_boundary_judge_sees_a_phase_that_is_a_billionth_of_a_second_too_long():
    task = Task("x", (0.0, 0.3, 0.1), (2.0, -0.4, 0.2), np.array([[-1.0, 1.0], [-2.0, 2.0], [-5.0, 5.0]]))
    profile = fastest(task)
    start, end = state([0.0], 0.3, 0.1), state([2.0], -0.4, 0.2)
    assert misses(profile.curve(), start, end) == []
    for k in range(profile.chain.durations.size):
        durations = profile.chain.durations.copy()
        durations[k] += 1e-9
        states = replace(profile.chain, durations=durations).states
        constants = profile.chain.constants
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
