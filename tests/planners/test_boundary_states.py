"""Boundary states of moves: what stands still, what is the same, and which joint an error names."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from planners.test_chains_within_limits import arm

from trajcli.errors import PlanningError
from trajcli.kinematics.robot import MountedTool
from trajcli.planners.between_moves import ChangeTool
from trajcli.planners.boundary_states import instant, missing_limit, same_state, standstill, start_in_motion
from trajcli.trajectory import State, resting

AT = np.array([0.5, -2.0])


def test_a_standstill_lasts_as_long_as_it_is_told_and_else_has_the_rates_of_its_state() -> None:
    state = State(AT, np.array([0.3, -0.1]), np.array([2.0, 4.0]))
    held = standstill(state, 1.5, {"effort": "less"})
    assert (held.curve.start, held.curve.end, held.remedies) == (0.0, 1.5, {"effort": "less"})
    for time in (0.0, 0.7, 1.5):
        np.testing.assert_array_equal(held.curve.evaluate(time), AT)
        assert not held.curve.evaluate(time, 1).any()
    assert held.end is state
    for curve in (standstill(state, 0.0).curve, instant(state)):
        assert curve.duration == 0.0
        for order, values in enumerate((AT, state.velocity, state.acceleration)):
            np.testing.assert_allclose(curve.evaluate(0.0, order), values)


@pytest.mark.parametrize("joint", [0, 1])
def test_states_are_the_same_up_to_rounding_of_positions(joint: int) -> None:
    """1000.5 has digits of 1.1e-13; small numbers are apart by 1e-15 at most."""

    def moved(by: float, **rates: Any) -> State:
        position = np.array([1000.5, 1e-20])[:: 1 if joint == 0 else -1].copy()
        position[rates.pop("of", joint)] += by
        zero = np.zeros(2)
        return State(position, rates.get("velocity", zero), rates.get("acceleration", zero))

    one, least = moved(0.0), np.eye(2)[joint] * 5e-324
    assert same_state(one, moved(4.4e-13))
    assert same_state(moved(4.4e-13), one)
    for by in (5.5e-13, -5.5e-13):
        assert not same_state(one, moved(by))
        assert not same_state(moved(by), one)
    assert same_state(one, moved(0.9e-15, of=1 - joint))
    assert not same_state(one, moved(1.1e-15, of=1 - joint))
    assert not same_state(one, moved(0.0, velocity=least))
    assert not same_state(one, moved(0.0, acceleration=-least))


@pytest.mark.parametrize(
    ("velocity", "acceleration", "text"),
    [
        ([0.0, -0.25], [3.0, 0.0], "the velocity of j2 is -0.25 at its start"),
        ([0.5, -0.25], [0.0, 0.0], "the velocity of j1 is 0.5 at its start"),
        ([0.0, 0.0], [0.0, -1.5], "the acceleration of j2 is -1.5 at its start"),
    ],
)
def test_a_start_in_motion_names_the_first_joint_that_moves(
    velocity: list[float], acceleration: list[float], text: str
) -> None:
    error = start_in_motion("cubic", State(AT, np.array(velocity), np.array(acceleration)), arm())
    (problem,) = error.problems
    assert f"cubic starts at rest, but {text}" in str(error)
    assert problem.joint == text.split(" of ")[1][:2]
    assert problem.value == float(text.split(" is ")[1].split(maxsplit=1)[0])


def test_all_joints_that_lack_a_limit_are_named() -> None:
    error = missing_limit("cubic", "jerk", [1, 0], arm(), "to be quick", "say less")
    (problem,) = error.problems
    assert "cubic needs a limit on the jerk of j2, j1 to be quick" in str(error)
    assert problem.hint == "add `limits: {jerk: ...}` to the job (a number: null means unlimited) or say less"
    assert problem.joint == "j2"


def test_a_tool_is_changed_at_rest_and_else_the_fastest_joint_is_named() -> None:
    planner, robot = ChangeTool.model_construct(tool=MountedTool(np.eye(4), None, "pen")), arm()
    planned = planner.plan(resting(AT), robot)
    assert planned.curve.duration == 0.0
    np.testing.assert_array_equal(planned.curve.evaluate(0.0), AT)
    with pytest.raises(PlanningError, match=r"and j2 moves with -0\.5"):
        planner.plan(State(AT, np.array([0.25, -0.5]), np.zeros(2)), robot)
