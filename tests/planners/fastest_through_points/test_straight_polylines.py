"""Motions along polylines: which points lie on a line, what is given at them, and what is refused."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pytest

from trajcli.errors import PlanningError
from trajcli.planners.fastest_through_points.assembly import FastestMotion, straight_only
from trajcli.planners.fastest_through_points.problem import WaypointProblem
from trajcli.planners.fastest_through_points.straight import straight_stretches

NAMES = ["j1", "j2"]
CORNER = [[1.0, 2.0], [1.5, 1.9], [2.0, 1.8], [2.0, 2.4], [2.0, 2.8]]  # the first line falls, the other rises
Given = Mapping[tuple[int, int], Sequence[float | None]]


def problem(
    points: Sequence[Sequence[float]], given: Given | None = None, least: Sequence[float] | None = None
) -> WaypointProblem:
    """Return a problem; `given` holds velocities (order 0) and accelerations (1) by point and order."""
    count = len(points)
    states, fixed = np.zeros((count, 2, 2)), np.zeros((count, 2, 2), dtype=bool)
    fixed[[0, -1]] = True
    for (point, order), values in (given or {}).items():
        for joint, value in enumerate(values):
            if value is not None:
                states[point, joint, order], fixed[point, joint, order] = value, True
    return WaypointProblem(
        np.array(points),
        np.array([[-1.0, 1.5], [-2.0, 1.2]]),
        np.array([[-3.0, 4.0], [-5.0, 6.0]]),
        np.array([20.0, 30.0]),
        states,
        fixed,
        np.zeros(count - 1) if least is None else np.array(least),
        np.tile([-np.inf, np.inf], (2, 1)),
    )


def moved(*args: object, **fields: object) -> FastestMotion:
    return straight_only(problem(*args, **fields), NAMES, 1)  # type: ignore[arg-type]


def refused(*args: object) -> str:
    with pytest.raises(PlanningError) as caught:
        moved(*args)
    (refusal,) = caught.value.problems
    return refusal.text()


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_point_beside_a_line_ends_a_stretch(side: float) -> None:
    line = np.array([[5.0, 4.0], [6.0, 4.0], [7.0, 4.0]])
    assert straight_stretches(line) == [(0, 2)]
    beside = np.array([[0.0, 0.0], [0.0, side * 1e-6], [0.0, 0.0]])
    assert straight_stretches(line + beside) == [(0, 1), (1, 2)]
    assert straight_stretches(np.array(CORNER)) == [(0, 2), (2, 4)]
    assert straight_stretches(line[[0, 2, 1]]) == [(0, 1), (1, 2)]


def test_from_stop_to_stop_it_is_as_fast_as_the_bound() -> None:
    found = moved(CORNER)
    assert found.motion.duration == pytest.approx(found.lower, rel=1e-6)


@pytest.mark.parametrize("step", [[0.002, 0.001], [-0.001, 0.004], [0.001, -0.0016]])
def test_the_jerk_of_the_joint_with_least_is_used_to_the_full(step: list[float]) -> None:
    curve = moved([[0.3, 0.3], [0.3 + step[0], 0.3 + step[1]]]).motion.curve
    share = np.abs(curve.piece_ends(3)[0]).max(axis=0) / [20.0, 30.0]
    assert share.max() == pytest.approx(1.0, rel=1e-9)


def test_what_is_given_within_a_stretch_is_kept_and_corners_are_stops() -> None:
    given = {(1, 0): [0.4, None], (1, 1): [None, -0.3], (3, 1): [None, 0.5]}
    motion = moved(CORNER, given).motion
    velocity, acceleration = (motion.curve.evaluate(motion.times, order) for order in (1, 2))
    np.testing.assert_allclose(velocity[1], [0.4, -0.08], rtol=0, atol=1e-9)
    np.testing.assert_allclose(acceleration[[1, 3]], [[1.5, -0.3], [0.0, 0.5]], rtol=0, atol=1e-8)
    corner = int(np.abs(motion.curve.breaks - motion.times[2]).argmin())
    before, after = motion.curve.piece_ends(1)[1][corner - 1], motion.curve.piece_ends(1)[0][corner]
    np.testing.assert_allclose([before, after], 0.0, rtol=0, atol=1e-9)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_it_starts_and_ends_in_motion_along_its_lines(sign: float) -> None:
    first, last = [sign * 0.5, -sign * 0.1], [0.0, sign * 0.3]
    curve = moved(CORNER, {(0, 0): first, (4, 0): last}).motion.curve
    np.testing.assert_allclose(curve.evaluate(np.array([0.0, curve.end]), 1), [first, last], atol=1e-9)


def test_a_segment_of_a_later_stretch_lasts_as_long_as_it_is_told() -> None:
    free, slow = (np.diff(moved(CORNER, least=least).motion.times) for least in ([0.0] * 4, [0, 0, 5.0, 0]))
    assert slow[2] >= 5.0 * (1 - 1e-12)
    np.testing.assert_allclose(slow[:2], free[:2], rtol=1e-9)


@pytest.mark.parametrize(("order", "quantity"), [(0, "velocity"), (1, "acceleration")])
def test_what_leaves_a_line_is_refused(order: int, quantity: str) -> None:
    text = refused(CORNER, {(3, order): [None, 0.4], (1, order): [0.4, -0.085]})  # on the line: -0.08
    assert f"{quantity} " in text
    assert "at point 1 leaves it" in text
    text = refused(CORNER, {(3, order): [-0.2, 0.0]})
    assert f"{quantity} -0.2" in text
    assert "of j1 at point 3 leaves it" in text
    assert "of j2 at point 1" in refused([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]], {(1, order): [None, -0.2]})


@pytest.mark.parametrize(("order", "quantity"), [(0, "velocity"), (1, "acceleration")])
def test_motion_at_a_turn_is_refused(order: int, quantity: str) -> None:
    turns = [*CORNER, [2.5, 2.8]]
    text = refused(turns, {(4, order): [0.0, -0.3]})
    assert "stops at point 4, where the line turns" in text
    assert f"j2 has {quantity} -0.3" in text
    back = [[0.0, 0.0], [0.1, -0.5], [0.0, 0.0]]
    assert "stops at point 1" in refused(back, {(1, order): [-0.1, 0.5]})
