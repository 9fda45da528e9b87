"""jerk_limited in particular situations: nothing to do, loops, stops, tiny and long moves, one-sided limits."""

from __future__ import annotations

import numpy as np
import pytest
from jerk_limited_moves import arm, excesses, misses, move_to, peaks, ruckigs_own, state, steps

from trajcli.job.read import job_from_text
from trajcli.planners.ruckig import BoundaryProblem, fastest, fastest_of
from trajcli.planning.plan import plan_job


@pytest.mark.parametrize("synchronize", ["time", "none"])
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


@pytest.mark.full
@pytest.mark.parametrize("distance", [1.0, 2000.0])
def test_tiny_displacement_beside_a_long_one(distance):
    for tiny in (1e-6, 1e-8, 1e-9, 1e-13, 1e-17):
        start, end = state([0.0, 0.0]), state([distance, tiny])
        robot = arm([2.0, 2.0], [10.0, 10.0], [1000.0, 1000.0])
        planned = move_to(end).plan(start, robot)
        assert misses(planned.curve, start, end) == []
        assert steps(planned.curve) < 1e-9
        assert excesses(planned.curve, robot.limits) == []
        assert planned.arrivals[1] == pytest.approx(4 * (tiny / 2000) ** (1 / 3), rel=1e-9)


def test_phases_below_the_resolution_of_time_are_not_used():
    """At full jerk this motion has phases of 9e-15 s and 2e-6 s in 669 s, where times are 1e-13 s apart."""
    bounds = np.array([[-0.18254439, 0.18254439], [-0.748663695, 0.748663695], [-521.984172, 521.984172]])
    task = BoundaryProblem("x", (0.0, 0.0, 0.0), (-1.006994087494479e-06, 0.0, 0.0), bounds)
    curve = fastest_of(task, 668.9044570713021).curve()
    assert curve.end == 668.9044570713021
    assert steps(curve) < 1e-11
    assert misses(curve, state([0.0]), state([task.final[0]])) == []


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
    task = BoundaryProblem(
        "x", (1.0, 0.5 * (order - 1), 0.0), (6.0, -0.5 * (order - 1), 0.0), bounds, control
    )
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


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(
    ("speed", "a", "j"), [(20, 100, 1000), (1000, 200, 1000), (180, 800, 8000), (1000, 400, 2000)]
)
def test_a_displacement_that_just_reaches_the_acceleration_limit(
    speed: float, a: float, j: float, sign: int
) -> None:
    # in degrees: converted to radians, these are where one case of ruckig's ends and the next begins
    text = (
        "version: 1\nunits: {angle: deg}\nrobot: {joints: 1}\nstart: {joints: [0]}\n"
        f"limits: {{velocity: {speed}, acceleration: {a}, jerk: {j}}}\n"
        f"moves:\n  - {{planner: jerk_limited, to: {{joints: [{sign * 2 * a**3 / j**2}]}}}}\n"
    )
    plan = plan_job(job_from_text(text))
    assert plan.verdict.passed
    assert plan.trajectory.duration == pytest.approx(
        4 * a / j, rel=1e-9
    )  # four ramps of the jerk, nothing between
