from __future__ import annotations

import itertools

import numpy as np
import pytest
from curve_laws import (
    attitude_is_kept,
    continuous,
    keeps_the_laws_of_a_place,
    keeps_the_laws_of_a_rotation,
    sides,
)
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from trajcli.errors import InputError, PlanningError
from trajcli.geometry.paths.arc import Arc
from trajcli.geometry.paths.chain import join
from trajcli.geometry.paths.corner import turn_between
from trajcli.geometry.paths.position import Line, PartOfCurve

COMPONENT = st.floats(-1, 1).map(lambda x: round(x, 3))
VECTOR = st.tuples(COMPONENT, COMPONENT, COMPONENT).map(np.array)


def polyline(*points):
    return [Line(a, b) for a, b in itertools.pairwise(points)]


SQUARE = polyline([0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0])
# a line, an arc that goes on in its direction, a line that goes on in the arc's, one that just goes on, a corner
STADIUM = [
    Line([0, 0, 0], [1, 0, 0]),
    Arc([1, 0, 0], [1, 0.5, 0], [0, 0, 1], np.pi),
    Line([1, 1, 0], [0.5, 1, 0]),
    Line([0.5, 1, 0], [0, 1, 0]),
    Line([0, 1, 0], [0, 1, 1]),
]


@st.composite
def chains(draw):
    """Return lines and arcs of random directions, each from where the last one ends."""
    place, segments = np.zeros(3), []
    for _ in range(draw(st.integers(2, 4))):
        direction, across = draw(VECTOR), draw(VECTOR)
        assume(np.linalg.norm(direction) > 0.1)
        if draw(st.booleans()):
            segment = Line(place, place + direction)
        else:
            axis = np.cross(across, direction)
            assume(np.linalg.norm(axis) > 0.05)
            segment = Arc(place, place + across, axis, draw(st.floats(0.2, 4)))
        if segments:
            assume(turn_between(segments[-1], segment) < np.radians(170))
        place = segment.end
        segments.append(segment)
    return segments


def test_sharp_corners_are_stops():
    chain = join(SQUARE)
    assert chain.length == 3
    np.testing.assert_array_equal(chain.stops, [1, 2])
    np.testing.assert_array_equal(chain.breaks, [1, 2])
    np.testing.assert_array_equal(chain.borders, [0, 1, 2, 3])
    np.testing.assert_array_equal(chain.half_widths, [0, 0])
    place, first, second = chain.evaluate(np.array([0, 2.5, 0.25, 1, 2, 3]))
    expected = [[0, 0, 0], [0.5, 1, 0], [0.25, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    np.testing.assert_allclose(place, expected, rtol=0, atol=1e-16)
    np.testing.assert_array_equal(first[3:5], [[0, 1, 0], [-1, 0, 0]])
    np.testing.assert_array_equal(chain.evaluate(np.array([1, 2]), "left")[1], [[1, 0, 0], [0, 1, 0]])
    np.testing.assert_array_equal(second, 0)
    keeps_the_laws_of_a_place(chain)
    assert [corner.kind for corner in chain.corners] == ["stop", "stop"]
    assert [corner.turn for corner in chain.corners] == pytest.approx([np.pi / 2] * 2)
    assert chain.segments == tuple(SQUARE) == chain.parts


def test_what_becomes_of_each_corner():
    chain = join(STADIUM)
    assert [corner.kind for corner in chain.corners] == ["bend", "bend", "smooth", "stop"]
    np.testing.assert_allclose(chain.stops, [2 + np.pi / 2], rtol=1e-15)
    rounded = join(STADIUM, 0.1)
    assert [corner.kind for corner in rounded.corners] == ["rounded", "rounded", "smooth", "rounded"]
    assert not rounded.stops.size
    assert [corner.used for corner in rounded.corners] == pytest.approx([0.1, 0.1, 0.1, 0.1])
    assert rounded.corners[2].deviation == 0
    assert rounded.half_widths[2] == 0.1
    assert rounded.borders[3] in rounded.breaks
    continuous(rounded.evaluate, rounded.breaks)


def test_a_smooth_corner_gets_what_the_others_leave():
    chain = join(polyline([0, 0, 0], [1, 0, 0], [1.5, 0, 0], [2, 0, 0], [2, 1, 0]), [0.2, 0.4, 0.3])
    assert [corner.kind for corner in chain.corners] == ["smooth", "smooth", "rounded"]
    np.testing.assert_allclose([corner.used for corner in chain.corners], [0.2, 0.2, 0.3])
    np.testing.assert_allclose(chain.borders[1:3], [1, 1.5])
    full = join(polyline([0, 0, 0], [1, 0, 0], [1.5, 0, 0], [1.5, 1, 0]), [0.2, 0.5])
    np.testing.assert_allclose([corner.used for corner in full.corners], [0, 0.5])


@settings(max_examples=15, deadline=None)
@given(chains(), st.floats(0.01, 0.7))
def test_a_rounded_chain_is_smooth_and_keeps_to_its_segments(segments, radius):
    chain = join(segments, radius)
    assert not chain.stops.size
    continuous(chain.evaluate, chain.breaks, tolerance=1e-8, beside=1e-2)
    keeps_the_laws_of_a_place(chain, scale=1e-3, tolerance=1e-4)
    np.testing.assert_allclose(
        chain.evaluate(np.array([0, chain.length]))[0],
        [segments[0].start, segments[-1].end],
        rtol=0,
        atol=1e-12,
    )
    used = [0.0, *(corner.used for corner in chain.corners), 0.0]
    for i, segment in enumerate(segments):
        assert used[i] + used[i + 1] <= segment.length * (1 + 1e-12)
    for i, corner in enumerate(chain.corners):
        assert 0 < corner.used <= corner.asked == radius
        if corner.kind == "smooth":
            assert corner.turn < 1e-9
            continue
        assert corner.kind == "rounded"
        near = np.linspace(-1, 1, 2001) * chain.half_widths[i] + corner.s
        distances = np.linalg.norm(chain.evaluate(np.clip(near, 0, chain.length))[0] - corner.point, axis=-1)
        assert corner.deviation == pytest.approx(distances.min(), rel=1e-3, abs=1e-9)
        np.testing.assert_allclose(distances[[0, -1]] <= corner.used * (1 + 1e-9), True)
    attitude_is_kept(chain, 1e-9)
    continuous(chain.transport, chain.breaks, orders=2, tolerance=1e-8, beside=1e-2)


@pytest.mark.parametrize(
    ("radii", "used"),
    [
        (0.01, [0.01, 0.01]),  # both fit
        (0.08, [0.05, 0.05]),  # both want more than half: they share
        ([0.02, 0.5], [0.02, 0.08]),  # one that needs less than half is left as it is
        ([0.5, 0.03], [0.07, 0.03]),
        ([0, 0.5], [0, 0.1]),  # a sharp corner needs nothing
        (5, [0.05, 0.05]),
    ],
)
def test_radii_are_shrunk_to_what_fits(radii, used):
    chain = join(polyline([0, 0, 0], [1, 0, 0], [1, 0.1, 0], [2, 0.1, 0]), radii)
    np.testing.assert_allclose([corner.used for corner in chain.corners], used, rtol=1e-12)
    np.testing.assert_array_equal([corner.asked for corner in chain.corners], np.broadcast_to(radii, 2))
    continuous(chain.evaluate, [b for b in chain.breaks if b not in chain.stops])
    assert all(part.length > 1e-3 for part in chain.parts)


def test_of_an_arc_a_radius_takes_at_most_a_quarter():
    segments = [Line([-9, 0, 0], [0, 0, 0]), Arc([0, 0, 0], [2, 0, 0], [0, 0, -1], 6.0)]
    np.testing.assert_allclose(join(segments, 8).corners[0].used, np.pi)


def test_a_corner_passes_its_point_at_the_middle_of_the_blend():
    chain = join(SQUARE, [0.2, 0])
    corner = chain.corners[0]
    place = chain.evaluate(np.array([corner.s]))[0][0]
    assert np.linalg.norm(place - [1, 0, 0]) == pytest.approx(corner.deviation, rel=1e-9)
    assert chain.borders[1] == corner.s
    np.testing.assert_allclose(chain.breaks[:2], corner.s + chain.half_widths[0] * np.array([-1, 1]))
    np.testing.assert_array_equal(chain.stops, [chain.borders[2]])
    assert chain.corners[1].used == chain.corners[1].deviation == 0


def test_a_path_that_turns_back_is_named_and_may_be_stopped_at():
    segments = polyline([0, 0, 0], [1, 0, 0], [1, 1, 0], [1, 0.5, 0])
    with pytest.raises(
        PlanningError, match=r"corner 2 of the path, at \[1, 1, 0\] m: the path turns back by 180 d"
    ):
        join(segments, 0.1)
    chain = join(segments, [0.1, 0])
    assert chain.corners[1].turn == np.pi
    assert chain.stops.size == 1
    with pytest.raises(
        PlanningError, match=r"at s = 1.96\d* m the path turns back by 180 deg: about which axis"
    ) as refused:
        chain.transport(np.zeros(1))
    assert refused.value.problems[0].hint == "orientation: axis_angle or fixed; or a path without a reversal"


def test_what_two_corners_leave_of_a_segment_is_part_of_the_path_however_short_it_is():
    """A ten thousandth of the second line: without it the path would jump."""
    chain = join(SQUARE, [0.49995, 0.49995])
    assert len(chain.parts) == 5
    left, right = (chain.evaluate(chain.breaks, side)[0] for side in ("left", "right"))
    np.testing.assert_allclose(left, right, rtol=0, atol=1e-12)


@pytest.mark.parametrize("count", [4, 40])
def test_of_two_neighbours_that_one_is_asked_whose_side_it_is(count):
    """Also within a part that is made of parts; of few and of many."""
    inner = join(STADIUM[:3])
    zigzag = [[0.5, 1, 0], *([0.5, 2.0 + k, 1.0 + k % 2] for k in range(2 * count))]
    chain = join([inner, *polyline(*zigzag)])
    assert (chain._together is None) == (count == 4)
    for side in ("left", "right"):
        for own, whole in zip(
            inner.evaluate(inner.breaks, side), chain.evaluate(inner.breaks, side), strict=True
        ):
            np.testing.assert_allclose(whole, own, rtol=0, atol=1e-12)
        turned = zip(inner.transport(inner.breaks, side), chain.transport(inner.breaks, side), strict=True)
        for own, whole in turned:
            np.testing.assert_allclose(whole, own, rtol=0, atol=1e-12)
    for outside in (-0.01, chain.length + 0.01):
        with pytest.raises(ValueError, match="s"):
            chain.evaluate(np.array([0.0, outside]))


def test_the_tools_attitude_jumps_by_the_angle_of_a_sharp_corner():
    chain = join(SQUARE)
    left, right = sides(chain.transport, chain.stops)
    jump = right[0] @ np.swapaxes(left[0], -1, -2)
    np.testing.assert_allclose(
        Rotation.from_matrix(jump).as_rotvec(), np.tile([0, 0, np.pi / 2], (2, 1)), rtol=0, atol=1e-15
    )
    attitude_is_kept(chain)


def test_the_attitude_of_a_chain_turns_as_its_parts_do():
    chain = join(STADIUM, [0, 0, 0, 0.2])
    keeps_the_laws_of_a_rotation(chain.transport, chain, tolerance=1e-6)
    quarter = chain.transport(np.array([1 + np.pi / 4]))[0][0]
    np.testing.assert_allclose(
        Rotation.from_matrix(quarter).as_rotvec(), [0, 0, np.pi / 2], rtol=0, atol=1e-14
    )
    end = Rotation.from_matrix(chain.transport(np.array([chain.length]))[0][0])
    expected = Rotation.from_rotvec([0, np.pi / 2, 0]) * Rotation.from_rotvec([0, 0, np.pi])
    assert (end * expected.inv()).magnitude() < 1e-12


def test_a_stretch_of_an_arc_has_its_own_attitude():
    arc = Arc([1, 0, 0], [0, 0, 0], [0, 0, 1], 3.0)
    part = PartOfCurve(arc, 1.0, 2.5)
    attitude_is_kept(part)
    np.testing.assert_allclose(
        Rotation.from_matrix(part.transport(np.array([1.5]))[0]).as_rotvec(), [[0, 0, 1.5]], atol=1e-14
    )
    both = PartOfCurve(join(SQUARE), 0.5, 2.0)
    np.testing.assert_array_equal(both.breaks, [0.5])
    np.testing.assert_array_equal(both.stops, [0.5])


def test_what_cannot_be_joined_is_refused():
    with pytest.raises(InputError, match="at least one segment"):
        join([])
    with pytest.raises(
        InputError, match=r"segment 2 of the path starts at \[0, 0, 1e-06\] m, 1e-06 m from \[0, 0, 0\] m"
    ):
        join([Line([1, 0, 0], [0, 0, 0]), Line([0, 0, 1e-6], [0, 1, 0])])
    with pytest.raises(InputError, match="the path has 2 corners, there are 3 radii"):
        join(SQUARE, [0.1, 0.1, 0.1])
    for radius in (-0.1, np.nan, np.inf, 1e-10):
        with pytest.raises(InputError, match="a corner radius must be 0"):
            join(SQUARE, [0.1, radius])


def test_places_in_any_order_have_the_same_values():
    chain = join(STADIUM, 0.1)
    places = np.random.default_rng(4).permutation(np.linspace(0, chain.length, 41))
    for values in (chain.evaluate, chain.transport):
        together = values(places)
        for k, place in enumerate(places):
            for rows, row in zip(together, values(np.array([place])), strict=True):
                np.testing.assert_allclose(rows[k], row[0], rtol=0, atol=1e-13)


def test_one_segment_is_a_chain():
    chain = join(SQUARE[:1], 0.1)
    assert chain.length == 1
    assert not chain.breaks.size
    assert chain.corners == ()
    assert chain.evaluate(np.empty(0))[0].shape == (0, 3)
    with pytest.raises(ValueError, match="leaves"):
        chain.evaluate(np.array([1.1]))


def test_a_gap_is_said_with_both_segments_and_what_is_allowed():
    """Behind segments that fit."""
    segments = [*polyline([0, 0, 0], [1, 0, 0], [1, 1, 0]), Line([1, 1.5, 0], [0, 1, 0])]
    with pytest.raises(InputError) as refused:
        join(segments)
    assert str(refused.value) == (
        "segment 3 of the path starts at [1, 1.5, 0] m, 0.5 m from [1, 1, 0] m, "
        "where segment 2 ends (allowed is 1e-09 m)"
    )
