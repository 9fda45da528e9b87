from __future__ import annotations

import numpy as np
import pytest
from curve_laws import attitude_is_kept, keeps_the_laws_of_a_place, keeps_the_laws_of_a_rotation

from trajcli.errors import InputError, PlanningError
from trajcli.geometry.paths.arc import Arc
from trajcli.geometry.paths.chain import join
from trajcli.geometry.paths.position import Line, PartOfCurve, Pivot, nearest, shown_vector


def test_a_line_goes_straight_from_end_to_end():
    line = Line([1, 2, 3], [1, 6, 6])
    assert line.length == 5
    place, first, second = line.evaluate(np.array([0, 2.5, 5]))
    np.testing.assert_allclose(place, [[1, 2, 3], [1, 4, 4.5], [1, 6, 6]], rtol=0, atol=1e-15)
    np.testing.assert_allclose(first, np.tile([0, 0.8, 0.6], (3, 1)), rtol=0, atol=1e-16)
    np.testing.assert_array_equal(second, 0)
    keeps_the_laws_of_a_place(line)
    attitude_is_kept(line)
    assert not line.breaks.size
    assert not line.stops.size


def test_both_ends_are_met_to_the_last_bit():
    ends = np.random.default_rng(1).normal(size=(200, 2, 3))
    for start, end in ends:
        line = Line(start, end)
        np.testing.assert_array_equal(line.evaluate(np.array([0, line.length]))[0], [start, end])


@pytest.mark.parametrize("distance", [0.0, 1e-10])
def test_a_line_without_length_is_refused(distance):
    with pytest.raises(InputError, match=r"has no direction \(it needs more than 1e-09 m\)"):
        Line([1, 0, 0], [1, 0, distance])


def test_points_must_be_points():
    with pytest.raises(InputError, match="the end must be three finite numbers"):
        Line([1, 0, 0], [1, 0])
    with pytest.raises(InputError, match="the start must be three finite numbers"):
        Line([1, 0, np.nan], [1, 0, 0])


def test_what_lies_outside_is_refused_and_rounding_is_not():
    line = Line([0, 0, 0], [2, 0, 0])
    np.testing.assert_array_equal(line.evaluate(np.array([-1e-12, 2 + 1e-12]))[0][:, 0], [0, 2])
    for s in (-1e-8, 2 + 1e-8, np.nan):
        with pytest.raises(ValueError, match=r"leaves the curve's \[0, 2"):
            line.evaluate(np.array([0.0, s]))
    assert line.evaluate(np.empty(0))[0].shape == (0, 3)


@pytest.mark.parametrize("length", [1e-3, 1e3])
def test_rounding_is_a_part_of_the_length(length):
    line = Line([0, 0, 0], [0, 0, length])
    np.testing.assert_array_equal(line.evaluate(length * np.array([-5e-10, 1 + 5e-10]))[0][:, 2], [0, length])
    for share in (-2e-9, 1 + 2e-9):
        with pytest.raises(ValueError, match="leaves the curve"):
            line.evaluate(np.array([share * length]))


def test_a_point_of_a_line_is_its_own_and_stays():
    given = np.zeros(3)
    line = Line(given, [1, 0, 0])
    given[0] = 5.0
    with pytest.raises(ValueError, match="read-only"):
        line.start[0] = 5.0
    assert line.length == 1


def test_zero_has_no_sign_in_a_message():
    assert shown_vector(np.array([-0.0, 1.0, 0.0])) == shown_vector(np.array([0.0, 1.0, -0.0]))


def test_a_stretch_is_a_part_of_the_whole():
    part = PartOfCurve(Line([0, 0, 0], [2, 0, 0]), 0.5, 1.25)
    assert part.length == 0.75
    np.testing.assert_allclose(part.evaluate(np.array([0, 0.75]))[0][:, 0], [0.5, 1.25])
    with pytest.raises(ValueError, match="leaves"):
        part.evaluate(np.array([0.8]))


def test_a_part_of_a_chain_begins_a_transport_of_its_own():
    segments = [
        Line([-1, 0, 0], [0, 0, 0]),
        Arc([0, 0, 0], [0, 0.3, 0.3], [1, -1, 1], 1.0, 0.2),
    ]
    rounded = join(segments, 0.2)
    part = PartOfCurve(rounded, 0.9, rounded.length - 0.1)
    attitude_is_kept(part)
    keeps_the_laws_of_a_rotation(part.transport, part, tolerance=2e-5)
    sharp = join([*segments, Line(segments[1].end, [2, 1, 1])])
    part, corner = PartOfCurve(sharp, 0.4, sharp.length - 0.1), sharp.breaks
    np.testing.assert_allclose(part.breaks, corner - 0.4, rtol=0, atol=1e-15)
    np.testing.assert_allclose(part.stops, sharp.stops - 0.4, rtol=0, atol=1e-15)
    for side in ("left", "right"):
        for own, whole in zip(part.evaluate(part.breaks, side), sharp.evaluate(corner, side), strict=True):
            np.testing.assert_allclose(own, whole, rtol=0, atol=1e-14)
        turned, before = sharp.transport(corner, side), sharp.transport(np.array([0.4]))[0]
        own = part.transport(part.breaks, side)
        np.testing.assert_allclose(own[0] @ before, turned[0], rtol=0, atol=1e-14)
        np.testing.assert_array_equal(own[1], turned[1])
    assert rounded.breaks.size
    assert not PartOfCurve(rounded, 0.0, rounded.length).stops.size
    before, behind = PartOfCurve(sharp, 0.0, corner[0]), PartOfCurve(sharp, corner[0], sharp.length)
    short = PartOfCurve(sharp, 0.0, 0.9 * corner[0])
    assert not [*before.breaks, *before.stops, *short.breaks, *short.stops]
    np.testing.assert_array_equal(behind.breaks, sharp.breaks[1:] - corner[0])
    np.testing.assert_allclose(behind.transport(np.zeros(1))[0][0], np.eye(3), rtol=0, atol=1e-15)
    rising = np.ones((4, 2))
    for own, whole in zip(
        part.majorants(np.array([0.1, 0.9]), rising),
        sharp.majorants(np.array([0.5, 1.3]), rising),
        strict=True,
    ):
        np.testing.assert_array_equal(own, whole)


def test_of_two_breaks_as_near_the_lower_one_is_nearest():
    s = np.array([-1.0, 0.9, 1.0, 1.1, 3.0, 9.0])
    np.testing.assert_array_equal(nearest(np.array([0.0, 2.0, 4.0]), s), [0, 0, 0, 2, 2, 4])


def test_a_pivot_stays_where_it_is():
    pivot = Pivot([1, 2, 3], [1, 2, 3 + 1e-10], 1.5)
    place, first, second = pivot.evaluate(np.array([0, 1.5]))
    np.testing.assert_array_equal(place, [[1, 2, 3], [1, 2, 3 + 1e-10]])
    assert np.abs(first).max() < 1e-10
    np.testing.assert_array_equal(second, 0)
    np.testing.assert_array_equal(Pivot([1, 2, 3], [1, 2, 3], 0).evaluate(np.zeros(1))[0], [[1, 2, 3]])
    with pytest.raises(InputError, match="1e-06 m apart: this is no rotation in place"):
        Pivot([1, 2, 3], [1, 2, 3 + 1e-6], 1.5)
    with pytest.raises(InputError, match="5e-09 m apart"):
        Pivot([0, 0, 0], [0, 5e-9, 0], 1.5)
    for length in (-1, np.inf, np.nan):
        with pytest.raises(InputError, match="must be a finite angle"):
            Pivot([1, 2, 3], [1, 2, 3], length)
    with pytest.raises(PlanningError, match="no direction of travel"):
        pivot.transport(np.zeros(1))
