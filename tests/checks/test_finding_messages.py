"""What findings say: a judge that knows no job and no plan states the numbers and what would fix it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from motions import between, limits, state, trajectory

from trajcli.checks.verify import verify
from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.trajectory import Promise, Trajectory, ViaPoints

REST = (state([0.0]), state([1.0]))
OPEN = limits()


def only(whole: Trajectory, bounds: Any, kind: str, promise: Promise | None = None) -> tuple[str, str | None]:
    """Return message and remedy of the one finding of a kind."""
    findings = verify(whole, [bounds] * len(whole.spans), None if promise is None else [promise]).findings
    (finding,) = [finding for finding in findings if finding.kind == kind]
    return finding.text(), finding.hint


def cubic(duration: float = 1.0) -> Trajectory:
    """Return 3 t^2 - 2 t^3: its speed has the peak 3/2 in the middle, its acceleration is 6 at the ends."""
    return trajectory(between([0.0], [1.0], duration=duration, conditions=2))


@pytest.mark.parametrize(
    ("promise", "remedy"),
    [
        (None, "it must last 1.5 times longer (1.5 s)"),
        (
            Promise(ends=REST, over_limit="error"),
            "it must last 1.5 times longer (1.5 s), or say `when_over_limit: slow`",
        ),
        (
            Promise(ends=REST, over_limit="slow"),
            "slowing down does not help: change the target, the start or the limit",
        ),
        (
            Promise(ends=(state([0.0], velocity=0.9), REST[1]), over_limit="error"),
            "say `when_over_limit: slow`: it finds the shortest duration between these moving states",
        ),
        (
            Promise(ends=(state([0.0], velocity=1.1), REST[1]), over_limit="error"),
            "slowing down does not help: the move starts or ends over its limit",
        ),
        (
            Promise(ends=(state([0.0], velocity=-1.1), REST[1]), over_limit="error"),
            "say `when_over_limit: slow`: it finds the shortest duration between these moving states",
        ),
        (Promise(ends=REST, over_limit="error", remedies={"velocity": "use another"}), "use another"),
    ],
)
def test_a_speed_over_its_limit(promise: Promise | None, remedy: str) -> None:
    message = "the velocity of j1 reaches 1.5 rad/s at t = 0.5 s, its limit is 1 rad/s"
    assert only(cubic(), limits(velocity=1.0), "velocity", promise) == (message, remedy)


def test_an_acceleration_needs_the_square_root() -> None:
    message = "the acceleration of j1 reaches 1.5 rad/s^2 at t = 0 s, its limit is 0.375 rad/s^2"
    remedy = "it must last 2 times longer (4 s)"
    assert only(cubic(duration=2.0), limits(acceleration=0.375), "acceleration") == (message, remedy)


def test_a_position_is_no_matter_of_time() -> None:
    message = "the position of j1 reaches 1 rad at t = 1 s, its limit is 0.5 rad"
    remedy = "slowing down does not help: change the target, the start or the limit"
    promise = Promise(ends=REST, over_limit="error")
    assert only(cubic(), limits(position=0.5), "position", promise) == (message, remedy)


def test_slowing_is_advised_where_it_mends_all_that_is_wrong() -> None:
    """In more time the speed is within its limit, and the end still beyond its range."""
    bounds, promise = limits(velocity=1.0, position=0.5), Promise(ends=REST, over_limit="error")
    assert only(cubic(), bounds, "velocity", promise)[1] == "it must last 1.5 times longer (1.5 s)"


def test_a_slide_is_measured_in_metres() -> None:
    whole = replace(cubic(), joint_types=("prismatic",))
    message = "the velocity of j1 reaches 1.5 m/s at t = 0.5 s, its limit is 1 m/s"
    assert only(whole, limits(velocity=1.0), "velocity")[0] == message


@pytest.mark.parametrize(
    ("order", "kind", "message", "remedy"),
    [
        (0, "position_jump", "the position of j1 jumps by 0.25 rad at t = 0 s", None),
        (1, "velocity_jump", "the velocity of j1 jumps by 0.25 rad/s at t = 0 s", None),
        (
            2,
            "acceleration_jump",
            "the acceleration of j1 jumps by 0.25 rad/s^2 at t = 0 s",
            "use jerk_limited or quintic, or say limits: {jerk: null} in the job",
        ),
    ],
)
def test_a_jump_at_the_start(order: int, kind: str, message: str, remedy: str | None) -> None:
    values = [0.0, 0.0, 0.0]
    values[order] = -0.25
    still = PiecewisePolynomial(np.array([0.0, 1.0]), np.zeros((1, 1, 1)))
    whole = trajectory(still, start=state([values[0]], velocity=values[1], acceleration=values[2]))
    assert only(whole, limits(jerk=9.0), kind) == (message, remedy)
    own = Promise(remedies={kind: "what the method says"})
    assert only(whole, limits(jerk=9.0), kind, own) == (message, "what the method says")


def test_a_via_point_that_is_passed_elsewhere() -> None:
    promise = Promise(ViaPoints(np.array([0.5]), np.array([[0.75]]), np.array([[0.125]])))
    message = "the path of j1 passes a waypoint at 0.25 rad at t = 0.5 s, it shall be 0.125 rad"
    assert only(cubic(), OPEN, "waypoint", promise) == (message, None)
