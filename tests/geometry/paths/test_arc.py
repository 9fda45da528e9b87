from __future__ import annotations

import numpy as np
import pytest
from curve_laws import attitude_is_kept, keeps_the_laws_of_a_place, keeps_the_laws_of_a_rotation
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from trajcli.errors import InputError, PlanningError
from trajcli.geometry.paths.arc import Arc

COORDINATE = st.floats(-1, 1).map(lambda x: round(x, 6))
POINT = st.tuples(COORDINATE, COORDINATE, COORDINATE).map(np.array)
ANGLE = st.floats(0.01, 15).flatmap(lambda x: st.sampled_from([x, -x]))


def circumcenter(a, b, c):
    """Return the point equally far from three others, in their plane, by its three linear conditions."""
    rows = np.array([b - a, c - a, np.cross(b - a, c - a)])
    return np.linalg.solve(rows, [(b @ b - a @ a) / 2, (c @ c - a @ a) / 2, rows[2] @ a])


def turned(arc, s):
    """Return the points that scipy turns about the axis, and lifts, by the angle that belongs to s."""
    angle = np.asarray(s) * arc.angle / arc.length
    offset = np.asarray(arc.start) - arc.center
    lift = np.outer(arc.pitch * angle / (2 * np.pi), arc.axis)
    return arc.center + Rotation.from_rotvec(np.outer(angle, arc.axis)).apply(offset) + lift


def follows_its_description(arc):
    s = np.linspace(0, arc.length, 33)
    np.testing.assert_allclose(arc.evaluate(s)[0], turned(arc, s), rtol=0, atol=1e-12 * (1 + arc.radius))
    np.testing.assert_allclose(arc.end, turned(arc, [arc.length])[0], rtol=0, atol=1e-12 * (1 + arc.radius))
    keeps_the_laws_of_a_place(arc, scale=arc.radius)
    keeps_the_laws_of_a_rotation(arc.transport, arc)


@settings(max_examples=50, deadline=None)
@given(POINT, POINT, POINT)
def test_through_three_points(start, via, target):
    sides = [np.linalg.norm(d) for d in (via - start, target - via, target - start)]
    assume(min(sides) > 1e-3)
    area = np.linalg.norm(np.cross(via - start, target - start))
    assume(area > 1e-2 * max(sides) * min(sides))
    arc = Arc.through(start, via, target)
    scale = arc.radius * max(sides) / area
    np.testing.assert_allclose(arc.center, circumcenter(start, via, target), rtol=0, atol=1e-10 * scale)
    np.testing.assert_allclose(arc.end, target, rtol=0, atol=1e-12 * max(1, arc.radius))
    way = np.cross(start - arc.center, via - arc.center)
    reached = np.arctan2(arc.axis @ way, (start - arc.center) @ (via - arc.center)) % (2 * np.pi)
    assert 0 < reached < arc.angle < 2 * np.pi
    np.testing.assert_allclose(turned(arc, [reached * arc.radius])[0], via, rtol=0, atol=1e-10 * scale)
    assert arc.length == pytest.approx(arc.radius * arc.angle, rel=1e-14)
    follows_its_description(arc)
    attitude_is_kept(arc)


@settings(max_examples=50, deadline=None)
@given(POINT, POINT, POINT, ANGLE, st.sampled_from([0.0, 0.3, -0.05]))
def test_by_center_axis_and_angle(start, center, across, angle, pitch):
    axis = np.cross(start - center, across)
    assume(np.linalg.norm(axis) > 1e-2)
    arc = Arc(start, center, 3 * axis, angle, pitch)
    radius = np.linalg.norm(start - center)
    assert arc.radius == pytest.approx(radius, rel=1e-12)
    assert arc.length == pytest.approx(abs(angle) * np.hypot(radius, pitch / (2 * np.pi)), rel=1e-12)
    np.testing.assert_allclose(arc.axis, axis / np.linalg.norm(axis), rtol=0, atol=1e-15)
    follows_its_description(arc)
    if pitch == 0:
        attitude_is_kept(arc)


def test_a_helix_keeps_its_attitude_to_the_axis_and_its_direction_all_the_way():
    helix = Arc([1, 0, 0], [0, 0, 0], [0, 0, 1], 6 * np.pi, 0.2)
    np.testing.assert_allclose(helix.end, [1, 0, 0.6], rtol=0, atol=1e-14)
    s = np.linspace(0, helix.length, 50)
    rotation, rate, _ = helix.transport(s)
    first = helix.evaluate(s)[1]
    np.testing.assert_allclose(rotation @ first[0], first, rtol=0, atol=1e-13)
    np.testing.assert_allclose(rotation[:, :, 2], np.tile([0, 0, 1], (50, 1)), rtol=0, atol=1e-15)
    np.testing.assert_allclose(rate, np.tile([0, 0, 6 * np.pi / helix.length], (50, 1)), rtol=1e-14)


def test_a_negative_angle_goes_the_same_thread_backwards():
    up = Arc([1, 0, 0], [0, 0, 0], [0, 0, 1], 3.0, 0.5)
    down = Arc(up.end, [0, 0, up.end[2]], [0, 0, 1], -3.0, 0.5)
    s = np.linspace(0, up.length, 9)
    np.testing.assert_allclose(down.evaluate(s)[0], up.evaluate(up.length - s)[0], rtol=0, atol=1e-14)


@settings(max_examples=50, deadline=None)
@given(POINT, POINT, POINT, st.floats(0.01, 3.13), st.booleans())
def test_about_a_center_the_shorter_way_or_about_an_axis(start, center, across, angle, backwards):
    axis = np.cross(start - center, across)
    assume(np.linalg.norm(axis) > 1e-2)
    axis /= np.linalg.norm(axis)
    target = center + Rotation.from_rotvec(angle * axis).apply(start - center)
    short = Arc.around(start, center, target)
    assert short.angle == pytest.approx(angle, abs=1e-9)
    np.testing.assert_allclose(short.axis, axis, rtol=0, atol=1e-9)
    sign = -1 if backwards else 1
    long = Arc.around(start, center, target, sign * 2 * axis)
    assert long.angle == pytest.approx(angle if sign > 0 else 2 * np.pi - angle, abs=1e-9)
    np.testing.assert_allclose(long.axis, sign * axis, rtol=0, atol=1e-9)
    for arc in (short, long):
        np.testing.assert_allclose(arc.end, target, rtol=0, atol=1e-13)
        assert arc.moved < 1e-10
        follows_its_description(arc)


def test_typed_digits_move_the_center_and_say_so():
    start, target = np.array([0.1, 0, 0]), 0.1 * np.array([np.cos(1.0), np.sin(1.0), 0])
    given_center = np.array([0.00003, -0.00002, 0.00001])
    for arc in (Arc.around(start, given_center, target, [0, 0, 1]), Arc.around(start, given_center, target)):
        np.testing.assert_allclose(arc.end, target, rtol=0, atol=1e-15)
        assert arc.moved == pytest.approx(np.linalg.norm(arc.center - given_center), rel=1e-2)
        assert 1e-6 < arc.moved < 1e-4


def test_an_axis_a_little_oblique_is_made_perpendicular_to_the_chord():
    arc = Arc.around([0.1, 0, 0], [0, 0, 0], [0, 0.1, 0], [1e-4, 0, 1])
    np.testing.assert_allclose(arc.end, [0, 0.1, 0], rtol=0, atol=1e-16)
    assert arc.angle == pytest.approx(np.pi / 2, abs=1e-7)


def test_a_flat_arc_keeps_its_digits():
    arc = Arc.through([0, 0, 0], [0.5, 1e-5, 0], [1, 0, 0])
    radius = (0.25 + 1e-10) / 2e-5
    assert arc.radius == pytest.approx(radius, rel=1e-10)
    np.testing.assert_allclose(arc.end, [1, 0, 0], rtol=0, atol=1e-12)
    middle = arc.evaluate(np.array([arc.length / 2]))[0][0]
    np.testing.assert_allclose(middle, [0.5, 1e-5, 0], rtol=0, atol=1e-14)


@pytest.mark.parametrize("origin", [[0, 0, 0], [2, -3, 1]])
def test_how_straight_three_points_may_be_does_not_depend_on_where_they_are(origin):
    flat = np.array([[0, 0, 0], [0.005, 1e-8, 0], [0.01, 0, 0]]) + origin  # 4e-6 rad at the middle
    assert Arc.through(*flat).radius == pytest.approx(0.005**2 / 2e-8, rel=1e-4)
    with pytest.raises(PlanningError, match="collinear"):
        Arc.through(*(np.array([[0, 0, 0], [0.005, 1e-9, 0], [0.01, 0, 0]]) + origin))


@pytest.mark.parametrize(
    ("make", "error", "message"),
    [
        (lambda: Arc.through([0, 0, 0], [1, 0, 0], [3, 0, 0]), PlanningError, "collinear: use line"),
        (
            lambda: Arc.through([0, 0, 0], [5, 0, 0], [3, 0, 0]),
            PlanningError,
            "via is not between the others",
        ),
        (
            lambda: Arc.through([0, 0, 0], [0.02, 0, 0], [0.01, 0, 0]),
            PlanningError,
            "via is not between the others",
        ),
        (
            lambda: Arc.through([0, 0, 0], [-1, 0, 0], [3, 0, 0]),
            PlanningError,
            "via is not between the others",
        ),
        (
            lambda: Arc.through([1, 0, 0], [1, 0, 0], [3, 0, 0]),
            InputError,
            "start and via of the arc coincide",
        ),
        (lambda: Arc.through([1, 0, 0], [3, 0, 0], [3, 0, 0]), InputError, "via and target of the arc coin"),
        (
            lambda: Arc.through([1, 0, 0], [3, 1, 0], [1, 0, 0]),
            InputError,
            "start and target of the arc coin",
        ),
        (lambda: Arc.around([1, 0, 0], [0, 0, 0], [1, 0, 0]), InputError, "start and target of the arc coin"),
        (lambda: Arc.around([1, 0, 0], [1, 0, 0], [0, 1, 0]), InputError, "start and center of the arc coin"),
        (
            lambda: Arc.around([1, 0, 0], [0, 1, 0], [0, 1, 0]),
            InputError,
            "center and target of the arc coin",
        ),
        (
            lambda: Arc.around([1, 0, 0], [0, 0, 0], [-1, 0, 0]),
            InputError,
            "half a turn, to which every plane",
        ),
        (lambda: Arc.around([1, 0, 0], [0, 0, 0], [-1, 1e-4, 0]), InputError, "half a turn, to which every"),
        (
            lambda: Arc.around([1, 0, 0], [0, 0, 0], [0, 1.2, 0]),
            PlanningError,
            r"1 m from the start and 1.2 m from the target: .* it is 0.14\d* m\)",
        ),
        (
            lambda: Arc.around([1, 0, 0], [0, 0, 0], [0, 1, 0.25], [0, 0, 1]),
            PlanningError,
            r"is 1 m from the start and 1.03077\d* m from the target",
        ),
        (
            lambda: Arc.around([1, 0, 0], [0, 0, 0], [0, 0.6, 0.8], [0, 0, 1]),
            PlanningError,
            r"the target lies 0.8 m off the plane of the arc.*allowed is 0.00141\d* m",
        ),
        (
            lambda: Arc.around([1, 0, 0.5], [0, 0, 0], [0, 1, 0.5], [0, 0, 1]),
            PlanningError,
            r"not perpendicular to the line from the center .* they are 0.5 m apart",
        ),
        (
            lambda: Arc([1, 0, 0.2], [0, 0, 0], [0, 0, 1], 1.0),
            PlanningError,
            "along the axis they are 0.2 m apart",
        ),
        (
            lambda: Arc([1, 0, -0.2], [0, 0, 0], [0, 0, 1], 1.0),
            PlanningError,
            "along the axis they are 0.2 m apart",
        ),
        (lambda: Arc([0, 0, 1], [0, 0, 0], [0, 0, 1], 1.0), InputError, "the start lies 0 m from the axis"),
        (lambda: Arc([1, 0, 0], [1, 0, 0], [0, 0, 1], 1.0), InputError, "an arc needs a radius"),
        (lambda: Arc([1, 0, 0], [0, 0, 0], [0, 0, 0], 1.0), InputError, "an axis of length 0"),
        (lambda: Arc([1, 0, 0], [0, 0, 0], [0, 0, 1], 0.0), InputError, "an angle of 0 rad has no length"),
        (lambda: Arc([1, 0, 0], [0, 0, 0], [0, 0, 1], np.inf), InputError, "must be finite"),
        (lambda: Arc([1, 0, 0], [0, 0, 0], [0, 0, 1], 1.0, np.nan), InputError, "must be finite"),
    ],
)
def test_what_is_no_arc_is_named(make, error, message):
    with pytest.raises(error, match=message):
        make()


@pytest.mark.parametrize(
    ("make", "fits"),
    [
        (lambda: Arc([5e-10, 0, 0], [0, 0, 0], [0, 0, 1], 1.0), False),  # of no radius
        (lambda: Arc([1, 0, 0], [0, 0, 0], [0, 0, 1], -5e-10), False),  # of no length
        (lambda: Arc([1, 0, 0], [0, 0, 0], [0, 0, 1], -1e-8), True),
        (lambda: Arc([1e-3, 0, 0], [0, 0, 0], [0, 0, 1], 5e-7), False),
        (lambda: Arc([1e3, 0, 0], [0, 0, 0], [0, 0, 1], 5e-10), True),
        (lambda: Arc([0.1, 0, 2e-4], [0, 0, 0], [0, 0, 1], 1.0), False),  # above its plane by 0.002 radii
        (lambda: Arc([0.1, 0, -2e-4], [0, 0, 0], [0, 0, 1], 1.0), False),
        (lambda: Arc([0.1, 0, -5e-5], [0, 0, 0], [0, 0, 1], 1.0), True),
        (lambda: Arc([10, 0, -5e-3], [0, 0, 0], [0, 0, 1], 1.0), True),
        (lambda: Arc.around([1, 0, 0], [0, 0, 0], [1, 5e-10, 0]), False),  # of no chord
        (lambda: Arc.around([1, 0, 0], [1.5e-3, 1.5e-3, 0], [0, 1, 0]), True),  # a center out of the middle
        (lambda: Arc.around([1, 0, 0], [-1.5e-3, 1.5e-3, 0], [0, 1, 0]), False),
        (lambda: Arc.around([1, 0, 0], [1.5e-3, -1.5e-3, 0], [0, 1, 0]), False),
        (lambda: Arc.around([1, 0, 0], [0, 5e-4, 0], [np.cos(0.1), np.sin(0.1), 0]), True),
        (
            lambda: Arc.around([1, 0, 0], [0, 0, 0], [-np.cos(5e-3), np.sin(5e-3), 0]),
            True,
        ),  # nearly half a turn
        (lambda: Arc.around([1, 0, 0], [0, 0, 0], [-np.cos(5e-4), np.sin(5e-4), 0]), False),
        (lambda: Arc.through([0, 0, 0], [1, 1e-7, 0], [2, 0, 0]), False),  # nearly a line
        (lambda: Arc.through([0, 0, 0], [1, 3e-5, 0], [2, 0, 0]), True),
        (
            lambda: Arc.through([0, 0, 0], [1e-3, 0, 0], [1, 5e-7, 0]),
            False,
        ),  # 5e-7 rad between unequal chords
        (lambda: Arc.through([1, 5e-7, 0], [1e-3, 0, 0], [0, 0, 0]), False),
        (lambda: Arc.through([0, 0, 0], [1e-3, 0, 0], [1, 3e-6, 0]), True),
        (
            lambda: Arc.around([1, 0, 0], [0, 0, 0], [0, 1, 0], [0.05, -0.05, 1]),
            False,
        ),  # an axis along the chord
        (lambda: Arc.around([1, 0, 0], [0, 0, 0], [0, 1, 0], [-0.05, 0.05, 1]), False),
    ],
)
def test_what_rounding_or_typed_digits_explain_is_an_arc_and_no_more(make, fits):
    if fits:
        make()
        return
    with pytest.raises((InputError, PlanningError)):
        make()


@pytest.mark.parametrize("angle", [1.5, 5.0, -1.5, -5.0])
def test_where_a_point_of_a_circle_is_passed(angle):
    arc = Arc([1, 2, 3], [1.5, 2, 3], [0, 0, 2], angle)
    s = np.linspace(0, arc.length, 7)
    np.testing.assert_allclose([arc.s_of(p) for p in arc.evaluate(s)[0]], s, rtol=0, atol=1e-14)
    beyond = Arc(arc.start, arc.center, arc.axis, angle * 1.1).end
    assert arc.s_of(beyond) == arc.length


def test_the_message_names_the_center_that_would_do():
    with pytest.raises(PlanningError) as caught:
        Arc.around([1, 0, 0], [0, 0, 0], [0, 1.2, 0])
    hint = caught.value.problems[0].advice()
    right = np.array([float(word) for word in hint.split("[")[1].split("]")[0].split(",")])
    near, far = np.linalg.norm(right - [1, 0, 0]), np.linalg.norm(right - [0, 1.2, 0])
    assert near == pytest.approx(far, rel=1e-5)
    Arc.around([1, 0, 0], right, [0, 1.2, 0])
    with pytest.raises(PlanningError) as caught:
        Arc([1, 0, 0.2], [0, 0, 0], [0, 0, 1], 1.0)
    assert "[0, 0, 0.2] m" in caught.value.problems[0].advice()


def test_whole_turns_are_proposed_where_the_center_can_be_another():
    for make, helps in (
        (lambda: Arc.around([1, 0, 0], [0, 0, 0], [1, 0, 0]), True),
        (lambda: Arc.around([1, 0, 0], [1, 0, 0], [0, 1, 0]), False),
        (lambda: Arc.around([1, 0, 0], [0, 1, 0], [0, 1, 0]), False),
    ):
        with pytest.raises(InputError) as caught:
            make()
        assert ("whole turns" in str(caught.value.problems[0].hint)) == helps


def test_half_a_turn_goes_right_handed_about_its_axis():
    for sign in (1, -1):
        arc = Arc.around([1, 0, 0], [0, 0, 0], [-1, 0, 0], [0, 0, sign])
        np.testing.assert_allclose(arc.evaluate(np.array([np.pi / 2]))[0], [[0, sign, 0]], rtol=0, atol=1e-15)
