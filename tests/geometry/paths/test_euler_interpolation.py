from __future__ import annotations

from itertools import pairwise, product

import numpy as np
import pytest
from curve_laws import continuous, keeps_the_laws_of_a_rotation
from euler_curves import euler_between
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from trajcli.errors import InputError
from trajcli.geometry.paths.chain import join
from trajcli.geometry.paths.euler_interpolation import (
    EulerInterpolation,
    angles_to_count_from,
    beyond_half_a_turn,
    euler_interpolation,
    nearest_angles,
)
from trajcli.geometry.paths.orientation import SegmentProgress
from trajcli.geometry.paths.position import Line

SEQUENCES = ["".join(s) for s in product("xyz", repeat=3) if s[0] != s[1] != s[2]]
FRAMES = ["current", "fixed"]
SEGMENTS = SegmentProgress(np.arange(4.0), np.zeros(2))
ANGLES = st.tuples(*[st.floats(-6, 6)] * 3).map(np.array)


def scipys(sequence, frame, angles):
    return Rotation.from_euler(sequence.upper() if frame == "current" else sequence, angles).as_matrix()


@pytest.mark.parametrize("frame", FRAMES)
@pytest.mark.parametrize("sequence", SEQUENCES)
def test_the_angles_change_evenly(sequence, frame):
    start, end = np.array([0.3, -0.4, 1.0]), np.array([-2.0, 1.1, 7.5])
    curve = euler_between(start, end, sequence.upper(), frame, 0.8)
    s = np.linspace(0, 0.8, 9)
    way = start + np.outer(s / 0.8, end - start)
    np.testing.assert_allclose(curve.evaluate(s)[0], scipys(sequence, frame, way), rtol=0, atol=1e-14)
    keeps_the_laws_of_a_rotation(curve.evaluate, curve, tolerance=1e-6)
    values, slopes, bends = curve.angles_at(s)
    np.testing.assert_allclose(values, way, rtol=0, atol=1e-14)
    np.testing.assert_allclose(slopes, np.tile((end - start) / 0.8, (9, 1)), rtol=1e-14)
    np.testing.assert_array_equal(bends, 0)


@settings(max_examples=20, deadline=None)
@given(st.lists(ANGLES, min_size=4, max_size=4), st.sampled_from(SEQUENCES), st.sampled_from(FRAMES))
def test_over_a_chain(angles, sequence, frame):
    corners = [[0, 0, 0], [1, 0, 0], [1, 0.5, 0], [0.3, 0.5, 0.4]]
    chain = join([Line(a, b) for a, b in pairwise(corners)], [0.2, 0])
    curve = EulerInterpolation(np.array(angles), chain.progress, sequence, frame)
    keeps_the_laws_of_a_rotation(curve.evaluate, curve, tolerance=1e-5)
    continuous(curve.evaluate, curve.breaks[:3])
    ends = curve.evaluate(np.array([0, chain.stops[0], chain.length]))[0]
    np.testing.assert_allclose(ends, scipys(sequence, frame, np.array(angles)[[0, 2, 3]]), rtol=0, atol=1e-12)
    jumps = np.ptp(angles[1:], axis=0).max() > 1e-3
    assert not jumps or list(curve.stops) == list(chain.stops)


@settings(max_examples=60, deadline=None)
@given(ANGLES, ANGLES, st.sampled_from(SEQUENCES), st.sampled_from(FRAMES))
def test_what_was_not_typed_is_read_nearest(first, last, sequence, frame):
    matrices = np.array([scipys(sequence, frame, row) for row in (first, last)])
    curve = euler_interpolation(matrices, None, sequence, frame, [None, last])
    np.testing.assert_array_equal(curve.angles[1], last)
    np.testing.assert_allclose(scipys(sequence, frame, curve.angles[0]), matrices[0], rtol=0, atol=1.1e-10)
    determined = np.sin(first[1]) if sequence[0] == sequence[2] else np.cos(first[1])
    if abs(determined) > 1e-4:
        assert np.abs(curve.angles[0] - last).max() <= np.abs(first - last).max() + 1e-9
        assert np.abs(curve.angles[0] - last).max() <= np.pi + 1e-9
    assert curve.length == pytest.approx(np.linalg.norm(curve.angles[1] - curve.angles[0]))


def test_of_typed_angles_whole_turns_are_made():
    matrices = np.tile(np.eye(3), (2, 1, 1))
    curve = euler_interpolation(matrices, None, "zyx", "current", [[0, 0, 0], [2 * np.pi, 0, 0]])
    assert curve.length == pytest.approx(2 * np.pi)
    np.testing.assert_allclose(curve.evaluate(np.array([np.pi]))[0][0], np.diag([-1, -1, 1]), atol=1e-15)


@pytest.mark.parametrize(
    ("sequence", "middle"), [("zyz", 0), ("zyz", np.pi), ("xyz", np.pi / 2), ("xyz", -np.pi / 2)]
)
@pytest.mark.parametrize("frame", FRAMES)
def test_at_gimbal_lock_the_first_angle_is_the_neighbours(sequence, middle, frame):
    matrix, aim = scipys(sequence, frame, [0.3, middle, 0.9]), np.array([0.7, middle, 0.2])
    target = scipys(sequence, frame, aim)
    curve = euler_interpolation(
        np.array([matrix, target]), SegmentProgress.even(1.0), sequence, frame, [None, aim]
    )
    kept = 0 if frame == "current" else 2
    assert curve.angles[0, kept] == aim[kept]
    np.testing.assert_allclose(scipys(sequence, frame, curve.angles[0]), matrix, rtol=0, atol=1e-12)
    # all poses of the way are at the lock, and the tool merely turns about one axis
    way = Rotation.from_matrix(curve.evaluate(np.linspace(0, 1, 5))[0])
    steps = (way[1:] * way[:-1].inv()).as_rotvec()
    np.testing.assert_allclose(steps, np.tile(steps[0], (4, 1)), rtol=0, atol=1e-9)


@pytest.mark.parametrize("frame", FRAMES)
@pytest.mark.parametrize("beside", [1e-15, 1e-12, 1e-8])
def test_beside_the_lock_the_rotation_is_met_and_that_is_said(beside, frame):
    matrix = scipys("zyz", frame, [0.3, beside, 0.9])
    angles, locked = nearest_angles(matrix, "zyz", frame, np.array([2.0, 0, 1.0]))
    assert locked
    np.testing.assert_allclose(scipys("zyz", frame, angles), matrix, rtol=0, atol=1.1e-10)
    assert (angles[0 if frame == "current" else 2] == (2.0 if frame == "current" else 1.0)) == (
        beside < 1e-10
    )


@pytest.mark.parametrize("frame", FRAMES)
@pytest.mark.parametrize(("sequence", "middle"), [("xyz", 2.0), ("xyz", 0.4), ("zyz", -0.5), ("zyz", 0.5)])
def test_of_both_triples_of_a_rotation_that_which_is_nearer_is_read(sequence, middle, frame):
    angles = np.array([0.3, middle, -0.2])
    for aim in (angles + 0.1, angles - [0.4, 0.2, -0.3]):
        found, locked = nearest_angles(scipys(sequence, frame, angles), sequence, frame, aim)
        np.testing.assert_allclose(found, angles, atol=1e-12)
        assert not locked


def test_near_the_lock_nothing_is_said():
    matrix = scipys("zyz", "current", [0.3, 1e-3, 0.9])
    angles, locked = nearest_angles(matrix, "zyz", "current", np.array([0.3, 0, 0.9]))
    assert not locked
    np.testing.assert_allclose(angles, [0.3, 1e-3, 0.9], rtol=0, atol=1e-9)


def test_where_nothing_was_typed_the_last_is_read_first():
    matrices = Rotation.random(3, random_state=6).as_matrix()
    curve = euler_interpolation(matrices, SegmentProgress(np.array([0, 1.0, 2.0]), np.zeros(1)), "zyz")
    for row, matrix in zip(curve.angles, matrices, strict=True):
        np.testing.assert_allclose(scipys("zyz", "current", row), matrix, rtol=0, atol=1e-12)
    assert np.abs(curve.angles[2]).max() <= np.pi
    assert np.abs(np.diff(curve.angles, axis=0)).max() <= np.pi + 1e-12
    way = np.array([0.3, 0.7, -0.2]) + np.outer(1.2 * np.arange(-3, 1), [1, 0, 0])  # from -3.3 rad to 0.3 rad
    found = euler_interpolation(scipys("zyz", "current", way), SEGMENTS, "zyz")
    np.testing.assert_allclose(found.angles, way, atol=1e-9)


@pytest.mark.parametrize("typed", [0, 1, 3])
@pytest.mark.parametrize("frame", FRAMES)
def test_each_angle_is_nearest_to_its_neighbours_on_the_side_of_the_last_typed_one(typed, frame):
    """Two angles go on by 1.2 rad from border to border, more than half a turn in all."""
    way = np.array([0.3, 0.7, -0.2]) + np.outer(1.2 * np.arange(-typed, 4 - typed), [1, 0, -1])
    given_angles = [None] * 4
    given_angles[typed] = way[typed] + [2 * np.pi, 0, -4 * np.pi]
    curve = euler_interpolation(scipys("zyz", frame, way), SEGMENTS, "zyz", frame, given_angles)
    np.testing.assert_allclose(curve.angles - way, np.tile([2 * np.pi, 0, -4 * np.pi], (4, 1)), atol=1e-9)


def test_of_several_typed_triples_what_is_between_is_nearest_to_the_one_behind():
    angles = np.array([[0.1, 0.7, 0.2], [1.0, 0.7, 0.2], [2.0, 0.7, 0.2]])
    angles[1:, 2] += 2 * np.pi
    progress = SegmentProgress(np.array([0, 1.0, 2.0]), np.zeros(1))
    matrices = scipys("zyz", "current", angles)
    curve = euler_interpolation(matrices, progress, "zyz", typed=[angles[0], None, angles[2]])
    np.testing.assert_allclose(curve.angles, angles, atol=1e-9)


@pytest.mark.parametrize(
    ("typed", "beyond"),
    [
        ([None, [0, -3.2, 0]], True),
        ([[0.0, 0.0, 3.2], None], True),
        ([[0, 0, 0], [4, 0, 0], [0, 0, 0]], True),
        ([[np.pi, -np.pi, np.pi * (1 + 1e-12)]], False),
        ([[np.pi + 1e-6, 0, 0]], True),
        ([None, None], False),
    ],
)
def test_whole_turns_are_meant_where_any_angle_is_beyond_half_a_turn(typed, beyond):
    assert beyond_half_a_turn(typed) == beyond


@pytest.mark.parametrize("frame", FRAMES)
def test_typed_angles_count_where_they_give_the_rotation(frame):
    typed, target = np.array([0.3, 0.7, -0.2 + 4 * np.pi]), np.array([0.0, 0.5, 9.0])
    there = scipys("xyz", frame, typed)
    near = scipys("xyz", frame, typed + 1e-8)  # as near as joints tell
    for rotation in (there, near):
        np.testing.assert_array_equal(angles_to_count_from(rotation, "xyz", frame, target, typed), typed)
    away = scipys("xyz", frame, typed + 1e-4)
    for given_angles, rotation in ((typed, away), (None, there)):
        found = angles_to_count_from(rotation, "xyz", frame, target, given_angles)
        np.testing.assert_allclose(scipys("xyz", frame, found), rotation, atol=1e-12)
        assert np.abs(found[2]) <= np.pi + 1e-12


@pytest.mark.parametrize("frame", FRAMES)
@pytest.mark.parametrize("target", [[9.0, 0.5, -0.4], [0.2, 0.5, -8.0], [3.3, 0.5, -9.0], [3.1, 0.5, 5.0]])
def test_a_start_is_read_within_half_a_turn_where_its_target_is_beyond_and_else_near_it(target, frame):
    for start in (np.array([3.0, 0.4, 2.9]), np.array([-3.0, 0.4, -2.9])):
        rotation = scipys("xyz", frame, start)
        found = angles_to_count_from(rotation, "xyz", frame, target)
        np.testing.assert_allclose(scipys("xyz", frame, found), rotation, atol=1e-12)
        far = np.abs(target) > np.pi
        assert (np.abs(found)[far] <= np.pi + 1e-9).all()
        assert (np.abs(found - target)[~far] <= np.pi + 1e-9).all()


@pytest.mark.parametrize("frame", FRAMES)
@pytest.mark.parametrize("sequence", ["xyz", "zyz"])
def test_of_both_triples_of_a_start_that_with_the_angles_nearest_to_those_within_half_a_turn_counts(
    sequence, frame
):
    """How far a turn beyond half a turn begins from zero does not make the others tumble."""
    start, target = np.array([0.0, 0.4, 2.97]), np.array([0.35, 0.4, 4.9])
    for _ in range(2):  # the last angle, then the first one
        rotation = scipys(sequence, frame, start)
        np.testing.assert_allclose(angles_to_count_from(rotation, sequence, frame, target), start, atol=1e-12)
        start, target = start[::-1], target[::-1]


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("frame", FRAMES)
def test_half_a_turn_at_a_start_is_on_the_side_of_the_target(sign, frame):
    rotation = scipys("xyz", frame, [0.0, 0.4, np.pi])
    for noise in (0.0, 1e-12, -1e-12):
        turned = scipys("xyz", frame, [0.0, 0.4, np.pi + noise])
        found = angles_to_count_from(turned, "xyz", frame, [0.1, 0.4, sign * 5.0])
        np.testing.assert_allclose(found, [0.0, 0.4, sign * np.pi], atol=1e-9)
    np.testing.assert_allclose(scipys("xyz", frame, found), rotation, atol=1e-11)


@pytest.mark.parametrize("frame", FRAMES)
def test_a_start_at_the_lock_has_nothing_of_the_side_in_it(frame):
    rotation = scipys("zyz", frame, [0.0, 0.0, 0.8])
    kept, other = (0, 2) if frame == "current" else (2, 0)
    target = np.zeros(3)
    target[kept] = 4.0
    found = angles_to_count_from(rotation, "zyz", frame, target)
    assert found[kept] == 0.0
    assert found[other] == pytest.approx(0.8, abs=1e-12)


def test_what_does_not_fit_is_refused():
    with pytest.raises(InputError, match="finite triples"):
        EulerInterpolation(np.zeros((2, 2)), SegmentProgress.even(1.0), "xyz")
    with pytest.raises(InputError, match="'xxy' is no sequence"):
        euler_between([0, 0, 0], [1, 1, 1], "xxy")
    with pytest.raises(InputError, match="1 segments need 2 orientations, not 3"):
        EulerInterpolation(np.zeros((3, 3)), SegmentProgress.even(1.0), "xyz")
    with pytest.raises(InputError, match="finite triples"):
        euler_between([0, 0, np.nan], [1, 1, 1], "xyz")
    with pytest.raises(InputError, match="2 orientations and 1 triples"):
        euler_interpolation(np.tile(np.eye(3), (2, 1, 1)), None, "xyz", typed=[None])
