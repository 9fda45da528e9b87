"""Motions made of segments: joined, among joints that stand still, and how far they are from the chords."""

from __future__ import annotations

import numpy as np
import pytest

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.errors import PlanningError
from trajcli.planners.fastest_through_points.problem import WaypointProblem
from trajcli.planners.fastest_through_points.segment_motion import (
    PointMotion,
    _bounds,
    exact_motion,
    joined,
    off_chords,
)
from trajcli.planners.planner import Phase


def part(begin, end, duration, joint=None) -> PointMotion:
    """Return a straight motion of two joints in two pieces, whose only phase has a joint or none."""
    begin, end = np.array(begin), np.array(end)
    slope = (end - begin) / duration
    coefficients = np.stack([[slope, slope], [begin, begin + 0.25 * duration * slope]])
    curve = PiecewisePolynomial(np.array([0.0, 0.25, 1.0]) * duration, coefficients)
    return PointMotion(curve, np.array([0.0, duration]), (Phase("cruise", 0.0, duration, joint),))


def test_parts_follow_each_other_in_points_curves_and_phases():
    parts = [part([0, 0], [1, 2], 2.0), part([1, 2], [3, 1], 0.5, 1), part([3, 1], [3, 0], 1.0, 0)]
    motion = joined(parts)
    assert motion.times == pytest.approx([0.0, 2.0, 2.5, 3.5])
    assert motion.duration == pytest.approx(3.5)
    np.testing.assert_allclose(
        motion.curve.evaluate(motion.times), [[0, 0], [1, 2], [3, 1], [3, 0]], atol=1e-12
    )
    phases = [(phase.start, phase.end, phase.joint) for phase in motion.phases]
    assert phases == [(0.0, 2.0, None), (2.0, 2.5, 1), (2.5, 3.5, 0)]


def test_among_others_that_stand_the_joints_keep_their_places():
    motion = joined([part([0, 0], [1, 2], 2.0, 1), part([1, 2], [3, 1], 0.5)])
    position = np.array([7.0, 0.0, 8.0, 0.0])
    whole = motion.among(np.array([1, 3]), position)
    t = np.linspace(0.0, 2.5, 11)
    wanted = np.tile(position, (11, 1))
    wanted[:, [1, 3]] = motion.curve.evaluate(t)
    np.testing.assert_allclose(whole.curve.evaluate(t), wanted, atol=1e-12)
    assert not whole.curve.evaluate(t, 1)[:, [0, 2]].any()
    assert [phase.joint for phase in whole.phases] == [3, None]
    assert motion.among(np.array([0, 1]), position[:2]) is motion


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("later", [0.0, 4.0])
def test_how_far_from_the_chords_it_goes_is_what_dense_times_say(later, sign):
    """Parabolas beside two chords and a point that is passed twice; the nearest point by times at the velocity limits."""
    points = np.array([[1.0, 0.5], [2.0, 1.5], [2.0, 1.5], [0.0, 2.0]])
    bends, times = sign * np.array([[0.3, -0.1], [0.0, 0.2], [-0.2, 0.9]]), np.array([0.0, 1.0, 1.5, 3.0])
    rows = []
    for k, h in enumerate(np.diff(times)):
        slope = (points[k + 1] - points[k]) / h
        rows.append([-bends[k], slope + bends[k] * h, points[k]])
    curve = PiecewisePolynomial(later + times, np.array(rows).transpose(1, 0, 2))
    velocity = np.array([[-1.0, 2.0], [-0.5, 0.3]])
    off, when = off_chords(PointMotion(curve, later + times, ()), points, velocity)
    unit, dense = np.array([2.0, 0.5]), []
    for k in range(3):
        t = np.linspace(times[k], times[k + 1], 2001)
        beside = (curve.evaluate(later + t, side="right" if k < 2 else "left") - points[k]) / unit
        line = (points[k + 1] - points[k]) / unit
        size = line @ line
        along = beside @ line / size if size else np.zeros(t.size)
        dense += [
            (time, *row)
            for time, row in zip(t[:-1], (beside - along[:, None] * line)[:-1] * unit, strict=True)
        ]
    table = np.array(dense)
    for joint in (0, 1):
        values = np.abs(table[:, 1 + joint])
        assert off[joint] == pytest.approx(values.max(), rel=1e-5)
        assert when[joint] == pytest.approx(table[values.argmax(), 0], abs=2e-3)


def test_motions_of_several_segments_follow_each_other_too() -> None:
    parts = [part([0, 0], [1, 2], 2.0), part([1, 2], [3, 1], 0.5, 1), part([3, 1], [3, 0], 1.0, 0)]
    held = PointMotion(parts[2].curve, parts[2].times, (Phase("dwell", 0.0, 1.0, 0, 4),))
    motion = joined([joined(parts[:2]), held])
    assert motion.times == pytest.approx([0.0, 2.0, 2.5, 3.5])
    assert motion.phases[-1] == Phase("dwell", 2.5, 3.5, 0, 4)
    twice = joined([joined(parts[:2]), joined([held])])
    assert twice.phases == motion.phases
    assert joined([joined(parts), part([3, 0], [0, 0], 1.0)]).times == pytest.approx([0, 2, 2.5, 3.5, 4.5])


def two_joints(**changes) -> WaypointProblem:
    points = np.array([[0.0, 0.0], [1.0, -0.5], [1.5, 2.0]])
    fields = {
        "points": points,
        "velocity": np.array([[-1.0, 2.0], [-1.5, 1.0]]),
        "acceleration": np.array([[-1.0, 5.0], [-4.0, 4.0]]),
        "jerk": np.array([20.0, 10.0]),
        "states": np.zeros((3, 2, 2)),
        "fixed": np.ones((3, 2, 2), dtype=bool),
        "least": np.zeros(2),
        "position": np.tile([-np.inf, np.inf], (2, 1)),
    }
    return WaypointProblem(**{**fields, **changes})


def test_segments_last_as_long_as_they_are_to_and_keep_the_limits_of_each_joint() -> None:
    """Also those of the jerk where bounds may count with a looser one."""
    problem = two_joints(least=np.array([0.0, 6.0]), looser=np.array([3.0, 3.0]))
    motion = exact_motion(problem, problem.states, ("a", "b"), total=1e12)
    assert motion.times[2] - motion.times[1] == pytest.approx(6.0, rel=1e-12)
    assert motion.times[1] < 3.0
    np.testing.assert_allclose(motion.curve.evaluate(motion.times), problem.points, atol=1e-12)
    times = np.linspace(0.0, motion.duration, 4001)
    for order, bounds in ((1, problem.velocity), (2, problem.acceleration * (1 - 1e-7))):
        rows = motion.curve.evaluate(times, order)
        assert (rows <= bounds[:, 1] * (1 + 1e-11)).all()
        assert (rows >= bounds[:, 0] * (1 + 1e-11)).all()
    assert (np.abs(motion.curve.evaluate(times, 3)) <= problem.jerk * (1 + 1e-12)).all()


def test_phases_are_those_of_each_joint_in_order_of_time() -> None:
    problem = two_joints()
    motion = exact_motion(problem, problem.states, ("a", "b"))
    keys = [(phase.start, phase.joint) for phase in motion.phases]
    assert keys == sorted(keys)
    for joint in (0, 1):
        own = [phase for phase in motion.phases if phase.joint == joint]
        assert own[0].start == 0.0
        assert own[-1].end == pytest.approx(motion.duration, rel=1e-12)
        assert [phase.start for phase in own[1:]] == pytest.approx([phase.end for phase in own[:-1]])


def test_a_segment_without_a_motion_names_its_joint() -> None:
    states = np.zeros((3, 2, 2))
    states[1, 1, 0] = 3.0
    with pytest.raises(PlanningError) as refused:
        exact_motion(two_joints(), states, ("first", "second"))
    assert "second" in str(refused.value)
    assert "first" not in str(refused.value)


@pytest.mark.parametrize("total", [0.0, 10.0, 1e4, 1e12])
def test_accelerations_leave_room_for_the_rounding_of_late_breaks(total: float) -> None:
    """Four roundings of a break at the largest jerk, but never more than a ten millionth."""
    problem = two_joints()
    found = _bounds(problem, total)
    np.testing.assert_array_equal(found[:, 0], problem.velocity)
    np.testing.assert_array_equal(found[:, 2], [[-20.0, 20.0], [-10.0, 10.0]])
    room = np.abs(problem.acceleration) - np.abs(found[:, 1])
    lost = 4 * np.spacing(total) * problem.jerk
    most = 1e-7 * np.abs(problem.acceleration)
    assert (room >= np.minimum(lost[:, None], most) * (1 - 1e-6) - 1e-15).all()
    assert (room <= most * (1 + 1e-6)).all()
