from __future__ import annotations

import itertools

import numpy as np
import pytest
from curve_laws import continuous, keeps_the_laws_of_a_rotation, sides
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp

from trajcli.errors import InputError
from trajcli.geometry.paths.arc import Arc
from trajcli.geometry.paths.chain import join
from trajcli.geometry.paths.orientation import (
    AxisAngleOrientation,
    FixedOrientation,
    SegmentProgress,
    TangentOrientation,
    turn_vectors,
)
from trajcli.geometry.paths.position import Line, Pivot

SEEDS = st.integers(0, 10**6)
CORNERS = [[0, 0, 0], [1, 0, 0], [1, 0.5, 0], [0.3, 0.5, 0.4], [0, 0, 1]]


def random_rotations(seed, count):
    return Rotation.random(count, random_state=seed).as_matrix()


def path(radius):
    return join([Line(a, b) for a, b in itertools.pairwise(CORNERS)], radius)


@settings(max_examples=40, deadline=None)
@given(SEEDS, st.floats(0.01, 5))
def test_from_one_orientation_to_another_it_is_slerp(seed, length):
    start, end = random_rotations(seed, 2)
    curve = AxisAngleOrientation.between(start, end, length)
    s = np.linspace(0, length, 11)
    rotation, rate, change = curve.evaluate(s)
    expected = Slerp([0, length], Rotation.from_matrix([start, end]))(s)
    np.testing.assert_allclose(rotation, expected.as_matrix(), rtol=0, atol=1e-13)
    turn = Rotation.from_matrix(end @ start.T).as_rotvec()
    np.testing.assert_allclose(rate, np.tile(turn / length, (11, 1)), rtol=0, atol=1e-12 / length)
    np.testing.assert_array_equal(change, 0)
    assert curve.angles_turned[0] == pytest.approx(np.linalg.norm(turn), abs=1e-14)
    for side in ("left", "right"):
        np.testing.assert_array_equal(curve.evaluate(s, side)[1], rate)
    assert not curve.breaks.size
    assert not curve.stops.size


@pytest.mark.parametrize("axis", np.eye(3).tolist())
def test_it_turns_about_coordinate_axes_too(axis):
    last = Rotation.from_rotvec(0.8 * np.array(axis)).as_matrix()
    rotation, rate, change = AxisAngleOrientation.between(np.eye(3), last, 2.0).evaluate(
        np.array([0.0, 0.5, 2.0])
    )
    expected = Rotation.from_rotvec(np.outer([0.0, 0.2, 0.8], axis)).as_matrix()
    np.testing.assert_allclose(rotation, expected, rtol=0, atol=1e-15)
    np.testing.assert_allclose(rate, np.tile(np.array(axis) * 0.4, (3, 1)), rtol=0, atol=1e-15)
    assert not change.any()


def test_a_rotation_alone_goes_by_its_angle():
    start, end = random_rotations(4, 2)
    curve = AxisAngleOrientation.between(start, end)
    assert curve.length == pytest.approx(Rotation.from_matrix(end @ start.T).magnitude(), rel=1e-14)
    np.testing.assert_allclose(np.linalg.norm(curve.evaluate(np.zeros(1))[1]), 1, rtol=1e-14)
    held = AxisAngleOrientation.between(start, start)
    assert held.length < 1e-15
    still = AxisAngleOrientation(np.array([start, start]), SegmentProgress.even(0.0)).evaluate(np.zeros(2))
    np.testing.assert_allclose(still[0], [start, start], rtol=0, atol=1e-15)
    np.testing.assert_allclose(still[1], 0, rtol=0, atol=1e-15)


def test_half_a_turn_has_one_axis_whatever_the_rounding():
    noise = np.random.default_rng(5)
    for axis in ([2, -1, 2], [0, 0, 1], [0, -1, 0], [0, 3, -4], [-1, 0, 0], [-1, 300, 0]):
        unit = np.array(axis) / np.linalg.norm(axis)
        expected = unit * np.sign(unit[np.flatnonzero(unit)[0]])
        half = Rotation.from_rotvec(np.pi * unit).as_matrix()
        for _ in range(20):
            start = random_rotations(int(noise.integers(1000)), 1)[0]
            curve = AxisAngleOrientation.between(start, start @ half + 1e-15 * noise.normal(size=(3, 3)), 1.0)
            np.testing.assert_allclose(curve.vectors[0], np.pi * expected, rtol=0, atol=1e-13)
            np.testing.assert_allclose(curve.evaluate(np.ones(1))[0][0], start @ half, rtol=0, atol=1e-14)
            np.testing.assert_allclose(curve.angles_turned, np.pi)


def test_beside_half_a_turn_the_end_is_met():
    vector = -(np.pi - 7e-10) * np.array([0.6, 0.0, 0.8])
    end = Rotation.from_rotvec(vector).as_matrix()
    found = turn_vectors(np.eye(3)[None], end[None])
    assert found[0, 0] > 0
    np.testing.assert_allclose(Rotation.from_rotvec(found[0]).as_matrix(), end, rtol=0, atol=1e-14)


def test_a_little_less_than_half_a_turn_is_not_turned_round():
    vectors = np.array([[-1.0, 0, 0], [0, -1, 0]]) * (np.pi - 1e-8)
    found = turn_vectors(np.tile(np.eye(3), (2, 1, 1)), Rotation.from_rotvec(vectors).as_matrix())
    np.testing.assert_allclose(found, vectors, rtol=0, atol=1e-14)


@settings(max_examples=15, deadline=None)
@given(SEEDS, st.sampled_from([0.0, 0.03, 0.2, 3.0, (0.1, 0, 0.2)]))
def test_over_a_chain_the_rotation_is_smooth_where_the_path_is(seed, radius):
    chain, targets = path(radius), random_rotations(seed, len(CORNERS))
    curve = AxisAngleOrientation(targets, chain.progress)
    keeps_the_laws_of_a_rotation(curve.evaluate, curve, tolerance=1e-6)
    sharp = chain.borders[1:-1][chain.half_widths == 0]
    np.testing.assert_allclose(
        curve.evaluate(sharp)[0], targets[1:-1][chain.half_widths == 0], rtol=0, atol=1e-13
    )
    np.testing.assert_allclose(
        curve.evaluate(np.array([0, curve.length]))[0], targets[[0, -1]], rtol=0, atol=1e-13
    )
    np.testing.assert_array_equal(curve.stops, sharp)
    continuous(curve.evaluate, sharp, orders=1)
    smooth = [place for place in curve.breaks if np.abs(sharp - place).min(initial=1) > 1e-12]
    continuous(curve.evaluate, smooth)
    # between the blends it is the even rotation of the segment
    for i in range(len(CORNERS) - 1):
        widths = np.concatenate([[0], chain.half_widths, [0]])
        low, high = chain.borders[i] + widths[i], chain.borders[i + 1] - widths[i + 1]
        if high - low > 1e-9:
            rate = Rotation.from_matrix(targets[i + 1] @ targets[i].T).as_rotvec() / np.diff(chain.borders)[i]
            np.testing.assert_allclose(curve.evaluate(np.array([(low + high) / 2]))[1][0], rate, atol=1e-10)


def test_the_rate_does_not_overshoot_in_a_rounded_corner():
    chain = path(0.1)
    turns = Rotation.from_rotvec([[0, 0, angle] for angle in (0, 1, 1.2, 3, 3.1)]).as_matrix()
    curve = AxisAngleOrientation(turns, chain.progress)
    rate = curve.evaluate(np.linspace(0, curve.length, 2001))[1][:, 2]
    even = np.diff([0, 1, 1.2, 3, 3.1]) / np.diff(chain.borders)
    assert even.min() - 1e-12 < rate.min()
    assert rate.max() < even.max() + 1e-12


def test_blends_that_meet_have_one_break_between_them():
    corners = [[0, 0, 0], [0.7, 0, 0], [0.7, 0.3, 0], [0.1, 0.3, 0.1]]
    chain = join([Line(a, b) for a, b in itertools.pairwise(corners)], 0.25)
    curve = AxisAngleOrientation(random_rotations(2, 4), chain.progress)
    assert np.diff(curve.breaks).min() > 1e-3
    assert curve.breaks.size == 5


def test_equal_rates_need_no_stop():
    chain = join([Line([0, 0, 0], [1, 0, 0]), Line([1, 0, 0], [3, 0, 0])])
    turns = Rotation.from_rotvec([[0, 0, 0], [0.3, 0, 0], [0.9, 0, 0]]).as_matrix()
    assert not AxisAngleOrientation(turns, chain.progress).stops.size
    np.testing.assert_array_equal(AxisAngleOrientation(turns[[0, 1, 0]], chain.progress).stops, [1])
    # as fast, about another axis
    aside = Rotation.from_rotvec([0.3, 0, 0]) * Rotation.from_rotvec([0, 0.6, 0])
    np.testing.assert_array_equal(
        AxisAngleOrientation(np.array([*turns[:2], aside.as_matrix()]), chain.progress).stops, [1]
    )
    faded = join(chain.segments, 0.2)
    assert not faded.stops.size
    curve = AxisAngleOrientation(random_rotations(2, 3), faded.progress)
    assert not curve.stops.size
    np.testing.assert_allclose(curve.breaks, [0.8, 1, 1.2])
    continuous(curve.evaluate, curve.breaks)
    same = np.tile(random_rotations(3, 1), (3, 1, 1))
    assert not AxisAngleOrientation(same, chain.progress).stops.size


def test_fixed():
    rotation = random_rotations(1, 1)[0]
    curve = FixedOrientation(rotation, 2.0)
    for row, expected in zip(curve.evaluate(np.array([0, 2.0])), (rotation, 0, 0), strict=True):
        np.testing.assert_array_equal(row, np.broadcast_to(expected, row.shape))
    with pytest.raises(ValueError, match="leaves"):
        curve.evaluate(np.array([2.1]))


@pytest.mark.parametrize(
    "place",
    [
        Line([0, 0, 0], [1, 2, 3]),
        Arc([1, 0, 0], [0, 0, 0], [0, 0, 1], -7.0, 0.3),
        path(0.2),
        join([Line([-1, 0, 0], [0, 0, 0]), Arc([0, 0, 0], [0, 0.3, 0.3], [1, -1, 1], 2.0)], 0.2),
    ],
)
def test_along_a_path_the_path_stays_where_it_is_seen_from_the_tool(place):
    start = random_rotations(7, 1)[0]
    curve = TangentOrientation(place, start)
    s = np.linspace(0, place.length, 77)
    rotation, rate, _ = curve.evaluate(s)
    np.testing.assert_allclose(rotation[0], start, rtol=0, atol=1e-14)
    seen = (np.swapaxes(rotation, -1, -2) @ place.evaluate(s)[1][..., None])[..., 0]
    np.testing.assert_allclose(seen, np.tile(seen[0], (77, 1)), rtol=0, atol=1e-11)
    keeps_the_laws_of_a_rotation(curve.evaluate, curve, tolerance=2e-5)
    if not isinstance(place, Arc):  # no roll about the direction
        roll = np.einsum("ni,ni->n", rate, place.evaluate(s)[1])
        np.testing.assert_allclose(roll, 0, rtol=0, atol=1e-10)


def test_along_a_path_it_stops_where_the_curvature_jumps_and_jumps_at_sharp_corners():
    segments = [
        Line([0, 0, 0], [1, 0, 0]),
        Arc([1, 0, 0], [1, 0.5, 0], [0, 0, 1], np.pi),
        Line([1, 1, 0], [0, 1, 0]),
        Line([0, 1, 0], [0, 1, 1]),
    ]
    curve = TangentOrientation(join(segments), np.eye(3))
    np.testing.assert_allclose(curve.jumps, [2 + np.pi / 2], rtol=1e-15)
    np.testing.assert_allclose(curve.stops, [1, 1 + np.pi / 2, 2 + np.pi / 2], rtol=1e-15)
    left, right = sides(curve.evaluate, curve.jumps)
    assert Rotation.from_matrix(left[0] @ np.swapaxes(right[0], -1, -2)).magnitude() == pytest.approx(
        np.pi / 2
    )
    rounded = TangentOrientation(join(segments, 0.2), np.eye(3))
    assert not rounded.stops.size
    assert not rounded.jumps.size
    continuous(rounded.evaluate, rounded.breaks, orders=2)


def test_what_does_not_fit_is_refused():
    with pytest.raises(InputError, match="1 segments need 2 orientations, not 3"):
        AxisAngleOrientation(random_rotations(1, 3), SegmentProgress.even(1.0))
    mirror = np.diag([1.0, 1.0, -1.0])
    for make in (
        lambda: AxisAngleOrientation.between(mirror, np.eye(3)),
        lambda: AxisAngleOrientation.between(np.eye(3), mirror),
        lambda: FixedOrientation(mirror, 1.0),
        lambda: TangentOrientation(Pivot(np.zeros(3), np.zeros(3), 1.0), mirror),
    ):
        with pytest.raises(InputError, match="mirrors space"):
            make()


@pytest.mark.parametrize(
    ("axis", "wanted"),
    [
        ([1e-6, -1.0, 0.0], [1e-6, -1.0, 0.0]),
        ([-1e-6, 1.0, 0.0], [1e-6, -1.0, 0.0]),
        ([-1e-11, 1.0, 0.0], [0.0, 1.0, 0.0]),  # rounding, that says nothing by its sign
        ([0.0, 1e-6, -1.0], [0.0, 1e-6, -1.0]),
    ],
)
def test_of_half_a_turn_the_axis_has_its_first_component_positive_however_small_it_is(axis, wanted):
    half = Rotation.from_rotvec(np.pi * np.array(axis)).as_matrix()
    np.testing.assert_allclose(turn_vectors(np.eye(3), half), np.pi * np.array(wanted), rtol=0, atol=1e-9)
