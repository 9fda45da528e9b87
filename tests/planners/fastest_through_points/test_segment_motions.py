"""Motions made of segments: joined, among joints that stand still, and how far they are from the chords."""

from __future__ import annotations

import numpy as np
import pytest

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.planners.fastest_through_points.segment_motion import PointMotion, joined, off_chords
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
