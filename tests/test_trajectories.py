"""Trajectories as callers see them: times, orders, moves and the tools that they have."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.errors import InputError
from trajcli.kinematics.robot import Joint, MountedTool, Payload, Robot, unlimited
from trajcli.trajectory import (
    Rows,
    Signal,
    SignalChange,
    Span,
    State,
    Trajectory,
    ViaPoints,
    move_title,
    resting,
)

# q = t^2 up to 1 s, then 1 + 3 (t - 1) + ...: velocity steps from 2 to 3
CURVE = PiecewisePolynomial(
    np.array([0.0, 1.0, 3.0]), np.array([[[1.0], [0.5]], [[0.0], [3.0]], [[0.0], [1.0]]])
)
ARM = Robot("arm", (Joint("a", a=1.0),), unlimited(1), "standard", np.eye(4), np.eye(4))


def made(*spans: Span, start_time: float = 0.0) -> Trajectory:
    every = spans or (Span(0, "quintic", 0.0, 1.0, 1), Span(1, "line", 1.0, 3.0, 1))
    state = resting(np.zeros(1))
    return Trajectory(CURVE, ("a",), ("revolute",), every, state, state, start_time=start_time)


def test_rest_is_without_velocity_and_acceleration() -> None:
    for velocity, acceleration, rests in ((0.0, 0.0, True), (1.0, 0.0, False), (0.0, 1.0, False)):
        assert State(np.ones(1), np.array([velocity]), np.array([acceleration])).at_rest == rests


def test_a_joint_that_moves_beside_others_that_do_not_is_no_rest_and_values_are_frozen() -> None:
    still, moving = np.zeros(3), np.array([0.0, -0.1, 0.0])
    for velocity, acceleration in ((moving, still), (still, moving), (moving, moving)):
        assert not State(still, velocity, acceleration).at_rest
    state, points = State(still, still, still), ViaPoints(still, np.ones((3, 1)), np.ones((3, 1)))
    arrays = (state.position, state.velocity, state.acceleration, points.times, points.points, points.missed)
    for array in arrays:
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0


def test_states_are_told_apart_by_each_of_their_derivatives() -> None:
    one, other = np.array([1.0]), np.array([2.0])
    states = [State(one, one, one), State(other, one, one), State(one, other, one), State(one, one, other)]
    assert len({state.bits for state in states}) == 4
    assert states[0].bits == State(one.copy(), one, one).bits
    rest = resting(other)
    assert (rest.position.tolist(), rest.velocity.tolist(), rest.acceleration.tolist()) == ([2], [0], [0])


def test_points_of_a_slower_motion_are_passed_later() -> None:
    points = ViaPoints(np.array([0.0, 1.0]), np.ones((2, 1)), np.full((2, 1), 0.5)).scaled(2.5)
    assert points.times.tolist() == [0.0, 2.5]
    assert (points.points.tolist(), points.missed.tolist()) == ([[1], [1]], [[0.5], [0.5]])


@pytest.mark.parametrize("start", [0.0, 7.0, -4.0])
def test_calls_count_from_the_time_of_the_start_and_end_within_rounding(start: float) -> None:
    trajectory = made(start_time=start)
    grid = np.array([[0.0, 0.5], [1.0 - 5e-13, 3.0]])
    positions = trajectory(start + grid)
    assert positions.shape == (2, 2, 1)
    np.testing.assert_allclose(positions[..., 0], [[0, 0.25], [1, 9]], atol=1e-9)
    assert trajectory(start + 1.0 - 5e-13, 1) == pytest.approx(3.0)  # at a break the later piece
    assert [trajectory(start + 0.5, order).tolist() for order in (2, 3, 4)] == [[2.0], [0.0], [0.0]]
    assert trajectory(start - 5e-10).tolist() == [0.0]
    assert trajectory(start + 3 + 5e-10) == pytest.approx(9.0)
    for late in (-2e-9, 3 + 2e-9, np.nan):
        with pytest.raises(InputError, match="outside the trajectory"):
            trajectory(start + late)
    with pytest.raises(InputError, match=f"the time {start + 3.5:g} s lies outside") as caught:
        trajectory([start + 1.0, start + 3.5, start - 9.0])
    assert f"it lasts from {start:g} s to {start + 3:g} s" in str(caught.value.problems[0].hint)
    with pytest.raises(InputError):
        trajectory("soon")  # type: ignore[arg-type]
    assert trajectory(start + 2.0, np.int64(1)) == trajectory(start + 2.0, 1) == pytest.approx(4.0)
    for order in (True, -1, 1.0, np.int64(-1), np.True_, "1"):
        with pytest.raises(InputError, match="the order of the derivative"):
            trajectory(start, order)  # type: ignore[arg-type]
    rows = trajectory.sample(1.0)
    assert rows.t.tolist() == [start, start + 1, start + 2, start + 3]
    assert rows.qd[:, 0].tolist() == [0, 3, 4, 5]
    assert rows.qdd[:, 0].tolist() == [2, 1, 1, 1]
    assert len(rows) == 4


def test_rows_say_how_many_they_are_and_of_how_many_joints() -> None:
    rows = Rows(np.array([0.5, 1.0, 1.5]), *np.zeros((3, 3, 2)))
    assert (len(rows), repr(rows)) == (3, "Rows(3 rows, 2 joints, 0.5 s to 1.5 s)")
    assert repr(Rows(np.zeros(0), *np.zeros((3, 0, 2)))) == "Rows(0 rows, 2 joints)"


def test_rows_at_a_break_but_for_rounding_are_those_of_the_later_piece() -> None:
    curve = PiecewisePolynomial(np.array([0.0, np.nextafter(1.0, 2.0), 3.0]), CURVE.coefficients)
    rows = replace(made(), curve=curve).sample(1.0)
    assert rows.qd[:, 0] == pytest.approx([0, 3, 4, 5], abs=1e-12)


def test_before_a_break_the_earlier_piece_counts() -> None:
    trajectory = made()
    times = np.array([1.0, 1.0 + 2e-16, 0.5, 3.0, 3.5, 1.0 + 7e-16, 1.0 + 1e-13, 0.0])
    np.testing.assert_allclose(trajectory.before(times, 1)[:, 0], [2, 2, 1, 5, 5, 2, 3, 0], atol=1e-12)


def test_a_move_of_no_length_holds_no_time() -> None:
    still = [Span(k, "detach", time, time, 1, handles=True) for k, time in ((1, 1.0), (3, 3.0))]
    spans = (Span(0, "a", 0.0, 1.0, 1), still[0], Span(2, "c", 1.0, 3.0, 1), still[1])
    trajectory = made(*spans)
    assert [trajectory.span_at(time).index for time in (0.0, 0.9, 1.0, 3.0)] == [0, 0, 2, 2]
    assert repr(trajectory) == "Trajectory(1 joint, 2 moves, 3 s)"
    assert repr(made(spans[0], still[0])) == "Trajectory(1 joint, 1 move, 3 s)"
    assert made(*still).span_at(9.0).index == 1


@pytest.mark.parametrize(
    ("ends", "origin", "goal"),
    [("pick -> place", "pick", "place"), ("a -> b -> c", "a", "c"), ("-> place", "", "place"), ("", "", "")],
)
def test_names_of_a_move(ends: str, origin: str, goal: str) -> None:
    span = Span(0, "line", 2.0, 3.0, 1, label="", round="slot 2 of 3", ends=ends)
    assert (span.origin, span.goal, span.duration) == (origin, goal, 1.0)
    assert span.title == (f"{ends} (line, slot 2 of 3)" if ends else "line, slot 2 of 3")
    assert replace(span, label="weld").title == "weld (line, slot 2 of 3)"
    assert move_title("", None, "line", "") == "line"


def test_each_time_is_of_the_tool_and_the_payload_that_the_arm_has_then() -> None:
    """Just before a change the new tool counts; what is asked of tools does not depend on the payload."""
    long = np.eye(4)
    long[0, 3] = 0.5
    load = Payload(2.0, np.zeros(3), np.zeros((3, 3)))
    tool = MountedTool(long, name="long")
    spans = (
        Span(0, "a", 0.0, 1.0, 1, payload=load),
        Span(1, "tool", 1.0, 1.0, 1, handles=True),
        Span(2, "b", 1.0, 3.0, 1, tool=tool),
    )
    times = np.array([2.0, 0.5, 1.0 - 5e-13, 3.0])
    asked: list[tuple[float, int]] = []

    def values(arm: Robot, rows: np.ndarray) -> np.ndarray:
        assert arm.payload is None
        asked.extend((float(arm.tool[0, 3]), row) for row in rows.tolist())
        return np.full((rows.size, 1), arm.tool[0, 3]) + times[rows, None]

    found = made(*spans).of_tools(ARM, times, values)
    np.testing.assert_allclose(found[:, 0], times + np.array([0.5, 0.0, 0.5, 0.5]))
    assert sorted(asked) == [(0.0, 1), (0.5, 0), (0.5, 2), (0.5, 3)]
    arm = spans[0].arm(ARM)
    assert arm.payload is load
    assert spans[2].arm(arm).payload is None
    assert spans[2].arm(ARM).tool[0, 3] == 0.5


def test_a_signal_is_zero_until_its_first_change_and_new_from_each_on() -> None:
    signal = Signal("grip", (SignalChange(1.0, 5.0, 0), SignalChange(2.0, -3.0, 1)))
    times = np.array([0.0, 1.0 - 2e-9, 1.0 - 5e-10, 1.0, 1.5, 2.0, 9.0])
    assert signal.values(times).tolist() == [0, 0, 5, 5, 5, -3, -3]
    assert Signal("never", ()).values(times).tolist() == [0] * 7


def test_a_trajectory_of_no_duration_has_the_tool_of_its_first_move() -> None:
    tool = MountedTool(np.eye(4), name="bare")
    spans = (Span(0, "a", 0.0, 0.0, 1, tool=tool), Span(1, "b", 0.0, 0.0, 1))
    found = made(*spans).of_tools(ARM, np.zeros(2), lambda arm, rows: np.full(rows.size, arm is ARM))
    assert found.tolist() == [0, 0]


def test_a_tool_that_is_changed_when_all_is_done_counts_for_no_time() -> None:
    """Nor does the last tool count for a time before the start, by what rounding leaves."""
    long = np.eye(4)
    long[0, 3] = 0.5
    load = Payload(2.0, np.zeros(3), np.zeros((3, 3)))
    spans = (
        Span(0, "a", 0.0, 1.0, 1),
        Span(1, "b", 1.0, 3.0, 1, tool=MountedTool(long, name="long"), payload=load),
        Span(2, "tool", 3.0, 3.0, 1, tool=MountedTool(np.diag([1.0, -1.0, -1.0, 1.0])), handles=True),
    )
    times = np.array([3.0, -1e-10, 1.5])
    found = made(*spans).of_tools(
        ARM, times, lambda arm, rows: arm.tool[0, 3] + 10 * arm.tool[1, 1] + 0 * rows
    )
    assert found.tolist() == [10.5, 10.0, 10.5]
    arm = spans[1].arm(ARM)
    assert arm.payload is load
    assert arm.tool[0, 3] == 0.5
