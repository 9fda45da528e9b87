"""What jerk_limited refuses, and what it says."""

from __future__ import annotations

import numpy as np
import pytest
from jerk_limited_moves import arm, move_to, state

from trajcli.errors import MissingLimitError, PlanningError
from trajcli.planners.ruckig import BoundaryProblem, fastest, fastest_of, together

ROBOT = arm([1.0, 2.0], [2.0, 3.0], [5.0, 6.0])


def refusal(end, error=PlanningError, start=None, robot=ROBOT, **fields):
    with pytest.raises(error) as caught:
        move_to(end, **fields).plan(start or state([0.0, 0.0]), robot)
    return caught.value.problems


@pytest.mark.parametrize("infinite", ["velocity", "acceleration"])
def test_missing_limit_names_joint_and_key(infinite):
    bounds = {"velocity": [1.0, 1.0, 1.0], "acceleration": [1.0, 1.0, 1.0], "jerk": [1.0, 1.0, 1.0]}
    bounds[infinite] = [1.0, np.inf, np.inf]
    (problem,) = refusal(state([1.0, 2.0, 0.0]), MissingLimitError, state([0.0] * 3), arm(*bounds.values()))
    assert infinite in problem.message
    assert "j2" in problem.message
    assert "j3" not in problem.message
    assert f"limits: {{{infinite}: ...}}" in problem.hint
    assert "null" in problem.hint


def test_every_missing_limit_is_named_at_once():
    robot = arm([np.inf, 1.0], [np.inf, 1.0], [np.inf, np.inf])
    problems = refusal(state([1.0, 2.0]), MissingLimitError, robot=robot)
    assert ["velocity" in problems[0].message, "acceleration" in problems[1].message] == [True, True]
    assert "j1, j2" not in problems[1].message
    assert len(problems) == 2


def test_stop_needs_no_velocity_limit():
    robot = arm([np.inf] * 2, [2.0] * 2, [3.0] * 2)
    planned = move_to(state([0.0, 0.0]), joints=False).plan(state([0.0, 0.0], 1.0), robot)
    assert planned.curve.duration > 0
    problems = refusal(
        state([0.0, 0.0]),
        MissingLimitError,
        state([0.0, 0.0], 1.0),
        arm([1] * 2, [np.inf] * 2, [1] * 2),
        joints=False,
    )
    assert "acceleration" in problems[0].message


@pytest.mark.parametrize(
    ("end", "order", "value", "limit"),
    [
        (state([1.0, 2.0], [1.5, 0.0]), "velocity", 1.5, 1.0),
        (state([1.0, 2.0], [0.0, -2.5]), "velocity", -2.5, -2.0),
        (state([1.0, 2.0], 0.0, [-2.1, 0.0]), "acceleration", -2.1, -2.0),
    ],
)
def test_end_beyond_a_limit(end, order, value, limit):
    (problem,) = refusal(end)
    assert (problem.value, problem.limit) == (value, limit)
    assert order in problem.message
    assert str(value) in problem.text()
    assert str(limit).removesuffix(".0") in problem.text()
    assert problem.joint == ("j2" if end.velocity[1] else "j1")
    assert refusal(end, joints=False)[0].message == problem.message


def test_end_that_can_only_be_reached_from_outside():
    (problem,) = refusal(state([1.0, 2.0], [0.9, 0.0], [-1.5, 0.0]))
    assert problem.value == pytest.approx(0.9 + 1.5**2 / (2 * 5.0), rel=1e-12)
    assert problem.limit == 1.0
    assert "j1" in problem.text()
    start = state([0.0, 0.0], 0.0, [-0.5, 0.0])
    assert refusal(state([1.0, 2.0], [0.9, 0.0], [-1.5, 0.0]), start=start)[0].value == problem.value
    just = 0.99 * np.sqrt(2 * 5.0 * 0.1)
    assert (
        move_to(state([1.0, 2.0], [0.9, 0.0], [-just, 0.0])).plan(state([0.0, 0.0]), ROBOT).curve.duration > 0
    )


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_velocity_that_can_only_be_reached_from_outside(sign):
    """Without a target, too, the acceleration passes zero: by then the joint moved at 0.9 + 1.5^2 / 10."""
    end = state([0.0, 0.0], [sign * 0.9, 0.0], [-sign * 1.5, 0.0])
    for begun in (0.0, sign * 0.5):
        (problem,) = refusal(end, start=state([0.0, 0.0], 0.0, [begun, 0.0]), joints=False)
        assert problem.value == pytest.approx(sign * (0.9 + 1.5**2 / (2 * 5.0)), rel=1e-12)
        assert problem.limit == sign * 1.0
    start = state([0.0, 0.0], [sign * 0.92, 0.0], [-sign * 1.45, 0.0])  # it slows down already
    curve = move_to(end, joints=False).plan(start, ROBOT).curve
    np.testing.assert_allclose(curve.evaluate(curve.end, 1), end.velocity, rtol=0, atol=1e-12)
    assert np.abs(curve.evaluate(np.linspace(0.0, curve.end, 99), 1)[:, 0]).max() <= 1.0


def test_end_velocity_at_its_limit_is_no_rounding_matter():
    above = 1.0 + 5e-13
    planned = move_to(state([1.0, 2.0], [above, 0.0])).plan(state([0.0, 0.0]), ROBOT)
    np.testing.assert_allclose(planned.curve.piece_ends(1)[1][-1], [above, 0.0], rtol=1e-15, atol=1e-15)


def test_phase_refuses_a_velocity_across_the_line():
    (problem,) = refusal(state([1.0, 2.0], [0.5, 0.0]), synchronize="phase")
    assert problem.hint == "say `synchronize: time`"
    assert "velocity" in problem.message
    (problem,) = refusal(state([1.0, 2.0]), start=state([0.0, 0.0], 0.0, [0.0, 1.0]), synchronize="phase")
    assert "acceleration" in problem.message


def test_joint_that_moves_at_its_end_cannot_wait():
    (problem,) = refusal(state([0.1, 20.0], [0.5, 0.0]), synchronize="none")
    assert problem.joint == "j1"
    assert "synchronize: time" in problem.hint
    assert problem.amounts["arrival"].value < problem.amounts["duration"].value
    single = arm([1.0], [2.0], [5.0])
    assert move_to(state([1.0], 0.5), synchronize="none").plan(state([0.0]), single).curve.duration > 0
    (problem,) = refusal(
        state([1.0], 0.5), start=state([0.0]), robot=single, synchronize="none", minimum_duration=9.0
    )
    assert problem.amounts["duration"].value == 9.0


def test_solver_says_what_it_cannot_find():
    bounds = np.array([[-1.0, 1.0], [-1.0, 1.0], [-1.0, 1.0]])
    task = BoundaryProblem("j7", (0.0, 0.0, 0.0), (1.0, 3.0, 0.0), bounds)
    with pytest.raises(PlanningError, match="j7: no motion within"):
        fastest(task)
    with pytest.raises(PlanningError, match="lasts 12"):
        fastest_of(task, 12.0)


def test_common_duration_leaps_over_gaps():
    """A joint that passes through its target and one that is slow: the first must loop, or wait for long."""
    bounds = np.array([[-1.0, 1.0], [-1.0, 1.0], [-1.0, 1.0]])
    passing = BoundaryProblem("j1", (0.0, 0.9, 0.0), (1.0, 0.9, 0.0), bounds)
    slow = BoundaryProblem("j2", (0.0, 0.0, 0.0), (0.3, 0.0, 0.0), bounds)
    alone = [fastest(passing), fastest(slow)]
    chosen = together([passing, slow], alone)
    assert chosen[0].duration == chosen[1].duration
    assert chosen[0].duration > max(profile.duration for profile in alone) + 0.1
    for profile, task in zip(chosen, (passing, slow), strict=True):
        ends = [float(profile.curve().piece_ends(order)[1][-1, 0]) for order in range(3)]
        np.testing.assert_allclose(ends, task.final, atol=1e-14)


LINE = np.array([1.0, 2.0])


def of_one_law(sign, jerk=50.0):
    """Return a robot whose first joint is slow in one direction, and whose second has little jerk in one."""
    slow = [[-1.0, 7.0], [-7.0, 1.0]][sign > 0]
    return arm([slow, [-9.0, 9.0]], [[-9.0, 9.0]] * 2, [[-50.0, 50.0], [-5.0, jerk]])


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("at_end", [False, True])
def test_phase_refuses_what_each_joint_alone_could_keep_and_one_law_cannot(sign, at_end):
    """At 0.9 with 1.5, of the jerk 5 / 2 that the second joint leaves: 0.9 + 1.5^2 / 5 is more than the first may."""
    robot, rest = of_one_law(sign), np.zeros(2)
    rates = sign * 0.9 * LINE, sign * (-1.5 if at_end else 1.5) * LINE
    start, end = state(rest), state(6.0 * sign * LINE)
    if at_end:
        end = state(end.position, *rates)
    else:
        start = state(rest, *rates)
    (problem,) = refusal(end, start=start, robot=robot, synchronize="phase")
    assert (problem.joint, problem.hint) == ("j1", "say `synchronize: time`")
    assert problem.value == pytest.approx(sign * 1.35, rel=1e-12)
    assert problem.limit == sign
    assert ("before its end" if at_end else "from its start") in problem.message
    assert move_to(end).plan(start, robot).curve.duration > 0


@pytest.mark.parametrize("sign", [1, -1])
def test_phase_takes_an_acceleration_that_leads_away_from_a_limit(sign):
    robot = of_one_law(sign)
    start = state([0.0, 0.0], sign * 0.9 * LINE, -sign * 1.5 * LINE)
    end = state(6.0 * sign * LINE, sign * 0.5 * LINE, sign * 0.4 * LINE)
    planned = move_to(end, synchronize="phase").plan(start, robot)
    for order, (first, last) in enumerate(
        ((start.velocity, end.velocity), (start.acceleration, end.acceleration)), 1
    ):
        np.testing.assert_allclose(planned.curve.piece_ends(order)[0][0], first, atol=1e-9)
        np.testing.assert_allclose(planned.curve.piece_ends(order)[1][-1], last, atol=1e-9)


def test_phase_refuses_a_velocity_that_is_a_little_beside_the_line():
    (problem,) = refusal(state([1.0, 0.0], [0.5, 0.02]), synchronize="phase")
    assert problem.joint == "j2"


@pytest.mark.parametrize("jerk", [[-5.0, 50.0], [-50.0, 5.0]])
def test_the_smaller_jerk_says_from_where_an_end_can_be_reached(jerk):
    robot = arm([1.0, 2.0], [2.0, 3.0], [jerk, [-6.0, 6.0]])
    (problem,) = refusal(state([1.0, 2.0], [0.9, 0.0], [-1.5, 0.0]), robot=robot)
    assert problem.value == pytest.approx(0.9 + 1.5**2 / 10.0, rel=1e-12)


@pytest.mark.parametrize("joints", [True, False])
def test_a_joint_that_accelerates_at_its_end_cannot_wait(joints):
    end = state([0.1, 20.0], [0.0 if joints else 0.1, 1.9], [0.3, 0.0])
    (problem,) = refusal(end, joints=joints, synchronize="none")
    assert problem.joint == "j1"
    assert problem.amounts["arrival"].value < problem.amounts["duration"].value


@pytest.mark.parametrize("synchronize", ["time", "phase"])
def test_a_minimum_that_one_joint_passes_anyway_is_no_event(synchronize):
    """The first joint could arrive before; the second cannot, with or without a minimum."""
    end, start = state([0.2, 3.0]), state([0.0, 0.0])
    alone = move_to(end, synchronize=synchronize).plan(start, ROBOT)
    least = 0.9 * alone.curve.duration
    planned = move_to(end, synchronize=synchronize, minimum_duration=least).plan(start, ROBOT)
    assert planned.curve.duration == pytest.approx(alone.curve.duration)
    assert not planned.events


def test_what_ends_with_an_acceleration_ends_in_motion():
    assert move_to(state([1.0, 2.0], 0.0, [0.0, 0.1])).why_not_flown_by == "it ends in motion"
    assert move_to(state([1.0, 2.0])).why_not_flown_by is None


def test_joints_that_arrive_one_by_one_have_no_line_within_limits_of_the_tool():
    assert move_to(state([1.0, 2.0]), synchronize="none").within_tool_limits(state([0.0, 0.0]), ROBOT) is None
