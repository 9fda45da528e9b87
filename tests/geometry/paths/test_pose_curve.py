from __future__ import annotations

import numpy as np
import pytest
from curve_laws import keeps_the_laws_of_a_rotation, slope
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm, logm
from scipy.spatial.transform import Rotation

from trajcli.errors import InputError
from trajcli.geometry.paths.arc import Arc
from trajcli.geometry.paths.chain import join
from trajcli.geometry.paths.orientation import (
    AxisAngleOrientation,
    FixedOrientation,
    SegmentProgress,
    TangentOrientation,
)
from trajcli.geometry.paths.pose import PoseCurve, PosePath, Screw
from trajcli.geometry.paths.position import Line, Pivot
from trajcli.geometry.pose import build


def random_poses(seed, count):
    places = np.random.default_rng(seed).normal(size=(count, 3))
    return build(Rotation.random(count, random_state=seed).as_matrix(), places)


def is_a_pose_path(path: PosePath, tolerance=1e-6):
    """Assert that the twists are the derivatives of the poses, in world axes at the tool."""
    step = 1e-3 * path.length
    s = np.linspace(3 * step, path.length - 3 * step, 12)
    s = s[np.abs(s[:, None] - np.append(path.breaks, -1)).min(axis=-1) > 3 * step]
    poses, first, second = path.evaluate(s)
    np.testing.assert_array_equal(poses[:, 3], np.tile([0, 0, 0, 1], (s.size, 1)))
    np.testing.assert_allclose(
        slope(lambda x: path.evaluate(x)[0][:, :3, 3], s, step), first[:, :3], atol=tolerance
    )
    np.testing.assert_allclose(slope(lambda x: path.evaluate(x)[1], s, step), second, rtol=0, atol=tolerance)
    matrices = slope(lambda x: path.evaluate(x)[0][:, :3, :3], s, step) @ np.swapaxes(
        poses[:, :3, :3], -1, -2
    )
    rates = np.stack([matrices[:, 2, 1], matrices[:, 0, 2], matrices[:, 1, 0]], axis=-1)
    np.testing.assert_allclose(rates, first[:, 3:], rtol=0, atol=tolerance)


@settings(max_examples=12, deadline=None)
@given(st.integers(0, 10**6))
def test_a_screw_is_the_exponential_of_the_logarithm(seed):
    start, end = random_poses(seed, 2)
    screw = Screw(start, end)
    generator = np.real(logm(np.linalg.inv(start) @ end))
    s = np.linspace(0, screw.length, 5)
    poses, first, second = screw.evaluate(s)
    for place, pose in zip(s, poses, strict=True):
        np.testing.assert_allclose(pose, start @ expm(generator * place / screw.length), rtol=0, atol=1e-9)
    np.testing.assert_allclose(poses[[0, -1]], [start, end], rtol=0, atol=1e-13)
    np.testing.assert_allclose(np.linalg.norm(first[:, :3], axis=-1), 1, rtol=0, atol=1e-13)
    np.testing.assert_allclose(first[:, 3:], np.tile(first[0, 3:], (5, 1)), rtol=0, atol=1e-12)
    np.testing.assert_array_equal(second[:, 3:], 0)
    assert not screw.pure_rotation
    is_a_pose_path(screw, tolerance=1e-6 * (1 + np.abs(second).max()))


def test_screws_without_rotation_and_without_translation():
    start = random_poses(1, 1)[0]
    straight = Screw(start, build(start[:3, :3], start[:3, 3] + [3, 0, 4]))
    assert straight.length == pytest.approx(5, rel=1e-15)
    np.testing.assert_allclose(straight.evaluate(np.array([2.5]))[1][0], [0.6, 0, 0.8, 0, 0, 0], atol=1e-14)
    turn = Screw(start, build(start[:3, :3] @ Rotation.from_rotvec([0, 1.2, 0]).as_matrix(), start[:3, 3]))
    assert turn.pure_rotation
    assert turn.length == pytest.approx(1.2, rel=1e-14)
    np.testing.assert_allclose(turn.evaluate(np.array([0.6]))[0][0, :3, 3], start[:3, 3], rtol=0, atol=1e-15)
    held = Screw(start, start)
    assert held.length < 1e-15
    np.testing.assert_allclose(held.evaluate(np.zeros(1))[0][0], start, rtol=0, atol=1e-15)


def test_a_screw_of_half_a_turn_has_one_axis_whatever_the_rounding():
    start, noise = random_poses(2, 1)[0], np.random.default_rng(1)
    half = build(Rotation.from_rotvec([0, -np.pi, 0]).as_matrix(), [0.1, 0.2, 0.3])
    middles = []
    for _ in range(20):
        end = start @ half
        end[:3, :3] += 1e-15 * noise.normal(size=(3, 3))
        screw = Screw(start, end)
        np.testing.assert_allclose(screw.evaluate(np.array([screw.length]))[0][0], end, rtol=0, atol=1e-14)
        middles.append(np.linalg.inv(start) @ screw.evaluate(np.array([screw.length / 2]))[0][0])
    np.testing.assert_allclose(middles, np.tile(middles[0], (20, 1, 1)), rtol=0, atol=1e-13)
    np.testing.assert_allclose(
        Rotation.from_matrix(middles[0][:3, :3]).as_rotvec(), [0, np.pi / 2, 0], atol=1e-14
    )
    with pytest.raises(InputError, match="mirrors space"):
        Screw(start, np.diag([1.0, 1, -1, 1]))
    with pytest.raises(InputError, match="mirrors space"):
        Screw(np.diag([1.0, 1, -1, 1]), start)


@pytest.mark.parametrize(
    "place",
    [
        Line([0, 0, 0], [1, 2, 2]),
        Arc([1, 0, 0], [0, 0, 0], [0, 0, 1], 4.0, 0.1),
        join([Line([0, 0, 0], [1, 0, 0]), Line([1, 0, 0], [1, 1, 0.5])], 0.3),
    ],
)
def test_place_and_orientation_side_by_side(place):
    start, end = Rotation.random(2, random_state=3).as_matrix()
    for orientation in (
        AxisAngleOrientation.between(start, end, place.length),
        FixedOrientation(start, place.length),
        TangentOrientation(place, start),
    ):
        curve = PoseCurve(place, orientation)
        is_a_pose_path(curve, tolerance=2e-5)
        s = np.linspace(0, place.length, 5)
        poses, first, second = curve.evaluate(s)
        np.testing.assert_array_equal(poses[:, :3, 3], place.evaluate(s)[0])
        np.testing.assert_array_equal(poses[:, :3, :3], orientation.evaluate(s)[0])
        np.testing.assert_array_equal(
            np.hstack([first[:, :3], second[:, :3]]), np.hstack(place.evaluate(s)[1:])
        )
        np.testing.assert_array_equal(
            np.hstack([first[:, 3:], second[:, 3:]]), np.hstack(orientation.evaluate(s)[1:])
        )
        assert not curve.pure_rotation
        np.testing.assert_array_equal(curve.breaks, place.breaks)


def test_breaks_of_both_are_one():
    chain = join(
        [Line([0, 0, 0], [1, 0, 0]), Line([1, 0, 0], [1, 1, 0]), Line([1, 1, 0], [0, 1, 0])], [0.3, 0]
    )
    rotations = Rotation.random(4, random_state=3).as_matrix()
    curve = PoseCurve(chain, AxisAngleOrientation(rotations, chain.progress))
    expected = np.sort(
        [*chain.breaks, chain.borders[1]]
    )  # the middle of the blend is one of the orientation's
    np.testing.assert_allclose(curve.breaks, expected, rtol=1e-12)
    np.testing.assert_array_equal(curve.stops, chain.stops)
    assert not curve.jumps.size
    along = PoseCurve(chain, TangentOrientation(chain, rotations[0]))
    np.testing.assert_array_equal(along.jumps, chain.stops)


def test_a_stop_for_the_rotation_alone():
    chain = join([Line([0, 0, 0], [1, 0, 0]), Line([1, 0, 0], [2, 0, 0])])
    curve = PoseCurve(
        chain, AxisAngleOrientation(Rotation.random(3, random_state=3).as_matrix(), chain.progress)
    )
    assert not chain.stops.size
    np.testing.assert_array_equal(curve.stops, [1])


def test_a_rotation_in_place():
    start, end = Rotation.random(2, random_state=9).as_matrix()
    orientation = AxisAngleOrientation.between(start, end)
    curve = PoseCurve(Pivot([1, 2, 3], [1, 2, 3], orientation.length), orientation)
    assert curve.pure_rotation
    poses, first, second = curve.evaluate(np.linspace(0, curve.length, 4))
    np.testing.assert_allclose(poses[:, :3, 3], np.tile([1, 2, 3], (4, 1)))
    np.testing.assert_array_equal(first[:, :3], 0)
    np.testing.assert_allclose(np.linalg.norm(first[:, 3:], axis=-1), 1, rtol=1e-14)
    np.testing.assert_array_equal(second, 0)
    keeps_the_laws_of_a_rotation(orientation.evaluate, curve)


def test_place_and_orientation_must_be_as_long():
    for length in (2.0, 4.0, 3.0 + 1e-7):
        with pytest.raises(ValueError, match=rf"differ in length: 3.0, {length}"):
            PoseCurve(Line([0, 0, 0], [1, 2, 2]), FixedOrientation(np.eye(3), length))
    assert PoseCurve(Line([0, 0, 0], [1, 2, 2]), FixedOrientation(np.eye(3), 3.0 + 1e-12)).length == 3.0
    for length in (1e-5, 1e5):
        line = Line([0, 0, 0], [length, 0, 0])
        assert PoseCurve(line, FixedOrientation(np.eye(3), length * (1 + 1e-10))).length == length
        with pytest.raises(ValueError, match="differ in length"):
            PoseCurve(line, FixedOrientation(np.eye(3), length * (1 + 1e-8)))


@pytest.mark.parametrize(("apart", "breaks"), [(1e-12, 1), (1e-7, 2)])
def test_breaks_beside_each_other_are_one(apart, breaks):
    chain = join([Line([0, 0, 0], [1, 0, 0]), Line([1, 0, 0], [1, 1, 0])])
    progress = SegmentProgress(np.array([0.0, 1.0 + apart, 2.0]), np.zeros(1))
    curve = PoseCurve(chain, AxisAngleOrientation(Rotation.random(3, random_state=3).as_matrix(), progress))
    assert curve.breaks.size == curve.stops.size == breaks


def test_at_a_corner_both_sides_are_asked():
    chain = join([Line([0, 0, 0], [1, 0, 0]), Line([1, 0, 0], [1, 1, 0])])
    place = Rotation.random(3, random_state=3).as_matrix()
    curve = PoseCurve(chain, AxisAngleOrientation(place, chain.progress))
    for side in ("left", "right"):
        first = curve.evaluate(np.ones(1), side)[1]
        np.testing.assert_array_equal(first[:, :3], chain.evaluate(np.ones(1), side)[1])
        np.testing.assert_array_equal(first[:, 3:], curve.orientation.evaluate(np.ones(1), side)[1])
    held = PoseCurve(chain, FixedOrientation(place[0], chain.length))
    np.testing.assert_array_equal(held.stops, [1])
