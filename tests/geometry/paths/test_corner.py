from __future__ import annotations

import numpy as np
import pytest
from curve_laws import attitude_is_kept, keeps_the_laws_of_a_place, keeps_the_laws_of_a_rotation
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.integrate import quad, solve_ivp
from scipy.spatial.transform import Rotation

from trajcli.errors import InputError, PlanningError
from trajcli.geometry.paths.arc import Arc
from trajcli.geometry.paths.corner import (
    corner_values,
    curvature_jumps,
    room_for_radius,
    round_corner,
    sharp_kind,
    turn_between,
)
from trajcli.geometry.paths.position import Line

COMPONENT = st.floats(-1, 1).map(lambda x: round(x, 4))
VECTOR = st.tuples(COMPONENT, COMPONENT, COMPONENT).map(np.array)
TURNS = [1e-6, 0.01, 0.5, 1.0, np.pi / 2, 2.0, 3.0, np.radians(178.9)]


def lines(turn):
    return Line([-1, 0, 0], [0, 0, 0]), Line([0, 0, 0], [np.cos(turn), np.sin(turn), 0])


def arc_from(place, direction, across, angle, pitch=0.0):
    """Return an arc that starts at `place`, the center `across` away, roughly in the given direction."""
    return Arc(place, np.asarray(place) + across, np.cross(direction, across), angle, pitch)


@st.composite
def neighbours(draw):
    """Return two curves that meet in a corner at the origin, lines or arcs in any planes."""
    curves = []
    for _ in range(2):
        direction, across = draw(VECTOR), draw(VECTOR)
        assume(np.linalg.norm(direction) > 0.2)
        assume(np.linalg.norm(np.cross(direction, across)) > 0.1)
        straight = draw(st.booleans())
        pitch = draw(st.sampled_from([0.0, 0.0, 0.3]))
        curves.append(
            Line([0, 0, 0], direction) if straight else arc_from([0, 0, 0], direction, across, 2.0, pitch)
        )
    first, after = curves
    before = (
        Line(first.end, first.start)
        if isinstance(first, Line)
        else Arc(
            first.end,
            first.center + first.axis * (first.pitch * first.angle / (2 * np.pi)),
            first.axis,
            -first.angle,
            first.pitch,
        )
    )
    assume(turn_between(before, after) < np.radians(170))
    return before, after


def arrives(curve, s):
    return [row[0] for row in curve.evaluate(np.array([s]))]


def speed(blend):
    rows = [np.polynomial.Polynomial(blend.coefficients[::-1, i]).deriv() for i in range(3)]
    return lambda u: np.sqrt(sum(row(u) ** 2 for row in rows))


@settings(max_examples=30, deadline=None)
@given(neighbours(), st.floats(0.05, 1.0))
def test_the_blend_goes_on_in_place_direction_and_curvature(curves, share):
    before, after = curves
    radius = share * room_for_radius(before, after)
    blend = round_corner(before, after, radius)
    for expected, got in (
        (arrives(before, before.length - radius), arrives(blend, 0.0)),
        (arrives(after, radius), arrives(blend, blend.length)),
    ):
        for row, other, size in zip(expected, got, (1, 1, 1 / radius), strict=True):
            np.testing.assert_allclose(other, row, rtol=0, atol=1e-11 * max(1, size))
    keeps_the_laws_of_a_place(blend, scale=radius, tolerance=2e-6)
    np.testing.assert_allclose(quad(speed(blend), 0, 1, limit=200, epsabs=1e-13)[0], blend.length, rtol=1e-11)
    attitude_is_kept(blend)
    keeps_the_laws_of_a_rotation(blend.transport, blend, tolerance=2e-5)


@pytest.mark.parametrize("turn", TURNS)
def test_between_lines_the_curvature_is_little_more_than_a_circles(turn):
    blend = round_corner(*lines(turn), 0.2)
    place, _, second = blend.evaluate(np.linspace(0, blend.length, 4001))
    assert np.linalg.norm(second, axis=-1).max() < 1.2 * np.tan(turn / 2) / 0.2
    nearest = np.linalg.norm(place, axis=-1).min()
    assert blend.distance(np.zeros(3)) == pytest.approx(nearest, rel=1e-6)
    # from which side one comes makes no difference: the blend is a mirror image of itself
    axis = np.array([-np.sin(turn / 2), np.cos(turn / 2), 0])
    mirrored = 2 * np.outer(place @ axis, axis) - place
    np.testing.assert_allclose(mirrored[::-1], place, rtol=0, atol=1e-12)


@pytest.mark.parametrize("turn", TURNS)
def test_the_length_is_the_integral_of_the_speed(turn):
    blend = round_corner(*lines(turn), 0.2)
    whole = (
        quad(speed(blend), 0, 0.5, limit=500, epsabs=1e-15)[0]
        + quad(speed(blend), 0.5, 1, limit=500, epsabs=1e-15)[0]
    )
    assert blend.length == pytest.approx(whole, rel=1e-13)
    steps = np.diff(blend.evaluate(np.linspace(0, blend.length, 20001))[0], axis=0)
    np.testing.assert_allclose(np.linalg.norm(steps, axis=-1), blend.length / 20000, rtol=1e-3)


@pytest.mark.parametrize("pitch", [0.0, 0.3])
def test_a_corner_between_a_line_and_an_arc_is_the_same_from_either_side(pitch):
    line, arc = Line([-1, -0.5, 0.1], [0, 0, 0]), Arc([0, 0, 0], [0, 0.3, 0.1], [1, -1, 3], 2.0, pitch)
    middle = arc.center + arc.axis * (pitch * arc.angle / (2 * np.pi))
    back = Arc(arc.end, middle, arc.axis, -arc.angle, pitch), Line(line.end, line.start)
    there, reverse = (round_corner(*pair, 0.25) for pair in ((line, arc), back))
    place, other = (blend.evaluate(np.linspace(0, blend.length, 41))[0] for blend in (there, reverse))
    np.testing.assert_allclose(other[::-1], place, rtol=0, atol=1e-10)


@pytest.mark.parametrize("point", [[0, 0, 0], [-0.5, -0.2, 0], [0.1, 0.4, -0.3], [0.3, -0.1, 0.2]])
def test_the_distance_is_that_of_the_nearest_point_of_the_blend(point):
    blend = round_corner(
        Line([-1, -0.5, 0.1], [0, 0, 0]), Arc([0, 0, 0], [0, 0.3, 0.1], [1, -1, 3], 2.0), 0.25
    )
    place = blend.evaluate(np.linspace(0, blend.length, 4001))[0]
    nearest = np.linalg.norm(place - point, axis=-1).min()
    assert blend.distance(np.array(point, dtype=float)) == pytest.approx(nearest, abs=1e-6)


@pytest.mark.parametrize(("turn", "kind"), [(0.0, "smooth"), (3e-11, "smooth"), (1e-9, "stop")])
def test_a_turn_is_a_corner_where_a_robot_would_notice_it(turn, kind):
    assert sharp_kind(*lines(turn)) == kind


@pytest.mark.parametrize(("ratio", "kind"), [(1 + 3e-11, "smooth"), (1 + 1e-6, "bend"), (-1, "bend")])
@pytest.mark.parametrize("radius", [2.0, -2.0, 0.002])
def test_curvatures_differ_by_more_than_their_rounding(radius, ratio, kind):
    before = Arc([-abs(radius) * np.sin(1), radius * (1 - np.cos(1)), 0], [0, radius, 0], [0, 0, radius], 1.0)
    after = Arc([0, 0, 0], [0, radius * ratio, 0], [0, 0, radius * ratio], 1.0)
    assert sharp_kind(before, after) == kind


def test_a_blend_within_a_circle_is_nearly_the_circle():
    whole = Arc([1, 0, 0], [0, 0, 0], [0, 0, 1], 2.0)
    halves = (
        Arc([1, 0, 0], [0, 0, 0], [0, 0, 1], 1.0),
        Arc(whole.evaluate(np.ones(1))[0][0], [0, 0, 0], [0, 0, 1], 1.0),
    )
    blend = round_corner(*halves, 0.5)
    place = blend.evaluate(np.linspace(0, blend.length, 101))[0]
    np.testing.assert_allclose(np.linalg.norm(place, axis=-1), 1, rtol=0, atol=1e-3)
    assert turn_between(*halves) < 1e-15
    assert not curvature_jumps(*halves)
    assert curvature_jumps(Line([1, -1, 0], [1, 0, 0]), halves[0])


def test_the_attitude_in_a_corner_out_of_plane_is_that_of_the_differential_equation():
    before = Line([-1, 0, 0], [0, 0, 0])
    for pitch in (0.0, 0.2):
        blend = round_corner(before, Arc([0, 0, 0], [0, 0.1, 0.3], [1, -3, 1], 2.0, pitch), 0.2)

        def equation(s, flat, blend=blend):
            _, first, second = blend.evaluate(np.array([s]))
            rate = np.cross(first[0], second[0])
            return np.cross(rate, flat.reshape(3, 3), axisb=0, axisc=0).ravel()

        s = np.linspace(0, blend.length, 13)
        found = solve_ivp(
            equation, (0, blend.length), np.eye(3).ravel(), "DOP853", s, rtol=1e-11, atol=1e-12, max_step=0.05
        )
        rotation = blend.transport(s)[0]
        np.testing.assert_allclose(rotation, found.y.T.reshape(-1, 3, 3), rtol=0, atol=1e-10)
        short = Rotation.align_vectors(blend.evaluate(s)[1][-1:], [[1, 0, 0]])[0].as_matrix()
        assert np.abs(rotation[-1] - short).max() > 1e-3  # it is not merely the shortest rotation


def test_in_a_plane_the_attitude_turns_about_its_normal_by_the_angle_of_the_corner():
    blend = round_corner(*lines(2.0), 0.3)
    rotation, rate, _ = blend.transport(np.linspace(0, blend.length, 7))
    np.testing.assert_allclose(Rotation.from_matrix(rotation[-1]).as_rotvec(), [0, 0, 2], rtol=0, atol=1e-12)
    np.testing.assert_allclose(rate[[0, -1]], 0, rtol=0, atol=1e-12)
    np.testing.assert_allclose(rate[:, :2], 0, rtol=0, atol=1e-15)


@pytest.mark.parametrize("turn", [np.radians(179.1), np.pi])
def test_a_path_that_turns_back_cannot_be_rounded(turn):
    with pytest.raises(
        PlanningError, match=r"turns back by 1\d\d.* deg: such a corner cannot be rounded .*179 d"
    ):
        round_corner(*lines(turn), 0.2)


@pytest.mark.parametrize("radius", [0.0, -0.1, 1.01, np.nan])
def test_a_radius_must_fit(radius):
    with pytest.raises(InputError, match=r"does not fit: it must be in \(0, 1\] m"):
        round_corner(*lines(1.0), radius)


def test_of_an_arc_at_most_a_quarter_is_cut_away():
    before = Line([-9, 0, 0], [0, 0, 0])
    assert room_for_radius(before, Arc([0, 0, 0], [0, 2, 0], [0, 0, 1], 6.0)) == pytest.approx(np.pi)
    assert room_for_radius(before, Arc([0, 0, 0], [0, 2, 0], [0, 0, 1], 1.0)) == 2
    assert room_for_radius(*lines(1.0)) == 1
    assert room_for_radius(Line([-0.4, 0, 0], [0, 0, 0]), Line([0, 0, 0], [0, 3, 0])) == 0.4
    assert room_for_radius(Line([-9, 0, 0], [0, 0, 0]), Line([0, 0, 0], [0, 3, 0])) == 3
    arriving = Arc([-2, 2, 0], [0, 2, 0], [0, 0, 1], np.pi * 2.5)  # it ends in the corner, along x
    assert room_for_radius(arriving, Line([0, 0, 0], [0, 9, 0])) == pytest.approx(np.pi)
    for radius, other in ((1.0, np.pi / 2), (3.0, np.pi)):
        leaving = Arc([0, 0, 0], [radius, 0, 0], [0, 0, 1], 6.0)
        assert room_for_radius(arriving, leaving) == pytest.approx(other)


def test_what_meets_in_a_corner():
    directions, bends = corner_values(Line([-1, 0, 0], [0, 0, 0]), Arc([0, 0, 0], [2, 0, 0], [0, 0, -1], 1.0))
    np.testing.assert_allclose(directions, [[1, 0, 0], [0, 1, 0]], rtol=0, atol=1e-16)
    np.testing.assert_allclose(bends, [[0, 0, 0], [0.5, 0, 0]], rtol=0, atol=1e-16)
    assert turn_between(*lines(1e-9)) == pytest.approx(1e-9, rel=1e-6)
