"""Turns about one axis and about two, and how axes lie in space: by scipy's rotations, on every side."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from trajcli.kinematics.inverse.families.screw_axes import (
    Displacement,
    InverseDisplacement,
    ScrewAxis,
    across_floats,
    aside,
    axis_geometry,
    common_point,
    contains,
    meeting_point,
    parallel,
    perpendicular,
)
from trajcli.kinematics.inverse.families.subproblems import (
    DegeneracyFlags,
    Mirrored,
    Opposed,
    across,
    added,
    along,
    levels,
    onto,
    turned,
    turned_back,
    two_turns,
    unit,
)
from trajcli.kinematics.robot import Joint, Robot, unlimited

AXES = [
    (1.0, 0.0, 0.0),
    (0.0, -1.0, 0.0),
    (0.0, 0.0, 1.0),
    (0.0, 0.0, -1.0),
    (0.6, 0.0, 0.8),
    (-0.48, 0.6, 0.64),
    (1e-4, 0.0, (1.0 - 1e-8) ** 0.5),
]
COUNT = 50


def flags(count: int = COUNT) -> DegeneracyFlags:
    return DegeneracyFlags(count, 1.0)


def turns(angles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return np.cos(angles), np.sin(angles)


def rotated(axis, angles, vectors) -> np.ndarray:
    return Rotation.from_rotvec(np.outer(angles, axis)).apply(vectors)


def columns(vectors) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return tuple(np.asarray(vectors).T)


def angles_of(turn) -> np.ndarray:
    return np.arctan2(*np.broadcast_arrays(turn[1], turn[0]))


@pytest.mark.parametrize("axis", AXES)
def test_a_turned_vector_is_that_of_another_library(axis) -> None:
    rng = np.random.default_rng(1)
    angles, vectors = rng.uniform(-3, 3, COUNT), rng.normal(size=(COUNT, 3))
    for turn, sign in ((turned, 1.0), (turned_back, -1.0)):
        found = np.stack(turn(columns(vectors), axis, turns(angles)), axis=1)
        np.testing.assert_allclose(found, rotated(axis, sign * angles, vectors), atol=1e-14)
    parts = [np.stack(np.broadcast_arrays(*part(columns(vectors), axis)), axis=1) for part in (along, across)]
    np.testing.assert_allclose(parts[0], np.outer(vectors @ axis, axis), atol=1e-14)
    np.testing.assert_allclose(parts[0] + parts[1], vectors, atol=1e-14)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_turns_add_up(sign: float) -> None:
    first, second = np.random.default_rng(2).uniform(-1.5, 1.5, (2, COUNT))
    np.testing.assert_allclose(angles_of(added(turns(first), turns(second), sign)), first + sign * second)


@pytest.mark.parametrize("axis", AXES)
def test_a_vector_is_turned_into_the_half_plane_of_an_aim(axis) -> None:
    """Whatever both have along the axis; of other vectors the distance to the aim is least."""
    rng = np.random.default_rng(3)
    angles, vector = rng.uniform(-3, 3, COUNT), np.array([0.3, -0.7, 0.5])
    aims = 2.5 * rotated(axis, angles, vector) + np.outer(rng.normal(size=COUNT), axis)
    found = angles_of(onto(axis, tuple(vector.tolist()), columns(aims)))
    np.testing.assert_allclose(np.exp(1j * found), np.exp(1j * angles), atol=1e-12)


def test_a_turn_without_a_length_is_zero_and_noted() -> None:
    noted = flags(4)
    cosine, sine = unit((np.array([3.0, 0.0, 0.9e-8, -1.1e-8]), np.array([-4.0, 0.0, 0.0, 0.0])), noted)
    np.testing.assert_allclose(cosine, [0.6, 1.0, 1.0, -1.0])
    np.testing.assert_allclose(sine, [-0.8, 0.0, 0.0, 0.0])
    assert noted.rows.tolist() == [False, True, True, False]
    noted = flags(2)
    unit((np.array([0.9e-9, 1.1e-9]), np.zeros(2)), noted, 0.1)
    assert noted.rows.tolist() == [True, False]


def test_what_is_noted_of_any_choice_stays_noted() -> None:
    """Of two solutions of five poses: in the first one, in the second one, in both, in none; then another pose."""
    noted = flags(5)
    noted.note(np.array([[True, False, True, False, False], [False, True, True, False, False]]))
    noted.note(np.zeros((2, 5), dtype=bool))
    noted.note(np.array([False, False, False, True, False]))
    assert noted.rows.tolist() == [True, True, True, True, False]


@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_both_turns_to_a_level_reach_it(axis, sign: float) -> None:
    """normal . R(t) v = level; the first solution has the sign of the normal's side that is asked for."""
    rng = np.random.default_rng(4)
    vector, normal = np.array([0.3, -0.7, 0.5]), np.array([0.2, 0.9, -0.4])
    angles = rng.uniform(-3, 3, COUNT)
    level = rotated(axis, angles, vector) @ normal
    noted = flags()
    turn, (x, y) = levels(axis, tuple(vector.tolist()), tuple(normal.tolist()), level, noted, sign=sign)
    both = angles_of(turn)
    assert both.shape == (2, COUNT)
    for side in both:
        np.testing.assert_allclose(rotated(axis, side, vector) @ normal, level, atol=1e-12)
    apart = np.exp(1j * both) - np.exp(1j * angles)
    np.testing.assert_allclose(np.abs(apart).min(axis=0), 0.0, atol=1e-6)
    assert np.median(np.abs(np.exp(1j * both[0]) - np.exp(1j * both[1]))) > 0.1
    assert (sign * y >= 0).all()
    slope = np.cross(axis, rotated(axis, both[0], vector)) @ normal  # of the level by the first turn
    np.testing.assert_allclose(slope, -y, atol=1e-10)
    assert not noted.rows.any()
    of_vector, of_normal = np.dot(axis, vector), np.dot(axis, normal)
    np.testing.assert_allclose(x, level - of_vector * of_normal, atol=1e-12)


def test_the_side_of_the_first_turn_may_be_another_one_for_each_pose() -> None:
    sign = np.where(np.arange(COUNT) % 3 == 0, -1.0, 1.0)
    level = np.random.default_rng(4).uniform(-0.5, 0.5, COUNT)
    turn, (_, y) = levels((0.0, 0.0, 1.0), (1.0, 0.0, 0.2), (1.0, 0.0, 0.0), level, flags(), sign=sign)
    np.testing.assert_allclose(y, sign * np.sqrt(1 - level**2))
    np.testing.assert_allclose(turn[0], [level, level], atol=1e-14)
    np.testing.assert_allclose(turn[1][0], y)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_level_out_of_reach_is_approached(side: float) -> None:
    """About z (1, 0, .) reaches from -1 to 1 along x; one at the end of that is a double solution, and noted."""
    level = side * np.array([0.5, 1.0, 1.0 + 1e-13, 3.0, 1.0 - 2e-7])
    noted = flags(5)
    turn, _ = levels((0.0, 0.0, 1.0), (1.0, 0.0, 0.7), (1.0, 0.0, 0.0), level, noted)
    np.testing.assert_allclose(np.broadcast_to(turn[0], (2, 5))[:, 1:4], side, atol=1e-6)
    np.testing.assert_allclose(np.asarray(turn[1])[:, 1:4], 0.0, atol=1e-6)
    assert noted.rows.tolist() == [False, True, True, False, False]


def test_what_stands_on_the_axis_is_free_and_noted() -> None:
    noted, small = flags(3), np.array([1.0, 0.9e-8, 1.1e-8])
    turn, _ = levels(
        (0.0, 0.0, 1.0), (small, 0.0 * small, 1.0 + 0.0 * small), (1.0, 0.0, 0.0), 0.0 * small, noted
    )
    assert noted.rows.tolist() == [False, True, False]
    np.testing.assert_allclose(np.broadcast_to(turn[0], (2, 3))[:, 1], 1.0)
    np.testing.assert_allclose(np.broadcast_to(turn[1], (2, 3))[:, 1], 0.0)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_what_stands_as_near_to_the_axis_as_its_scale_says_is_free(scale: float) -> None:
    """A point on the axis divides nothing by zero; 1.1e-8 of the scale beside it is a place to turn about."""
    noted, beside = flags(3), scale * np.array([0.0, 0.9e-8, 1.1e-8])
    vector = (beside, 0.0 * beside, scale + 0.0 * beside)
    with np.errstate(all="raise"):
        turn, _ = levels((0.0, 0.0, 1.0), vector, (1.0, 0.0, 0.0), 0.0 * beside, noted, scale)
    assert noted.rows.tolist() == [True, True, False]
    np.testing.assert_allclose(np.broadcast_to(turn[0], (2, 3))[:, :2], 1.0)
    np.testing.assert_allclose(np.asarray(turn[1])[:, 2], [1.0, -1.0])


def test_each_choice_of_a_pose_has_an_axis_of_its_own() -> None:
    """The last choice comes first: of two that are made of poses alone the second one leaves room for the first."""
    noted, poses = flags(5), np.arange(5.0)
    first = noted.fork((poses, poses), (poses, poses))
    second = noted.fork((poses, poses), (1.0 + poses, poses))
    assert [each.shape for each in (*first, *second)] == [(2, 5), (2, 5), (2, 1, 5), (2, 1, 5)]
    assert noted.both(poses).shape == (2, 1, 1, 5)
    assert noted.choices == 3
    np.testing.assert_array_equal(second[0][:, 0], [2 * poses + 1.0, -np.ones(5)])


def whole(value) -> tuple[np.ndarray, np.ndarray]:
    return value.both() if isinstance(value, Mirrored | Opposed) else value


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(
    ("first", "second", "vector"),
    [
        ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
        ((0.0, 0.0, 1.0), (0.0, -1.0, 0.0), (0.6, 0.0, 0.8)),
        ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0)),
        ((0.0, 0.0, 1.0), (0.6, 0.0, 0.8), (0.0, 0.6, 0.8)),
        ((0.48, -0.6, 0.64), (0.0, 1.0, 0.0), (0.8, 0.6, 0.0)),
        ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (0.0, 0.0, -1.0)),
        ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (0.0, 0.6, 0.8)),
        ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (0.0, -0.6, 0.8)),
        ((0.0, 0.0, 1.0), (0.6, 0.0, 0.8), (0.0, 1.0, 0.0)),
        ((0.0, 0.0, 1.0), (0.6, 0.0, -0.8), (0.0, 1.0, 0.0)),
        ((0.0, 0.0, 1.0), (0.0, (1.0 - 1e-10) ** 0.5, 1e-5), (0.0, 0.6, 0.8)),  # almost at right angles
        ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0), ((1.0 - 1e-10) ** 0.5, 1e-5, 0.0)),
    ],
)
def test_both_pairs_of_turns_reach_the_aim(first, second, vector, sign: float) -> None:
    rng = np.random.default_rng(5)
    given = rng.uniform(-3, 3, (2, COUNT))
    aims = rotated(first, given[0], rotated(second, given[1], np.array(vector)))
    noted = flags()
    found = [whole(each) for each in two_turns(first, second, vector, columns(aims), noted, sign)]
    around, bend = (np.broadcast_to(angles_of(each), (2, COUNT)) for each in found)
    for k in range(2):
        reached = rotated(first, around[k], rotated(second, bend[k], np.array(vector)))
        np.testing.assert_allclose(reached, aims, atol=1e-9)
    seen = np.abs(np.exp(1j * around) - np.exp(1j * given[0])) + np.abs(
        np.exp(1j * bend) - np.exp(1j * given[1])
    )
    np.testing.assert_allclose(seen.min(axis=0), 0.0, atol=1e-6)
    assert np.median(np.abs(np.exp(1j * around[0]) - np.exp(1j * around[1]))) > 0.1
    stands = rotated(second, bend[0], np.array(vector))
    assert (sign * np.cross(first, stands) @ second >= -1e-9).all()
    assert not noted.rows.any()


def test_a_right_angle_that_was_typed_with_ten_digits_is_one() -> None:
    """A wrist bent by 3e-8 rad still says how it turns, to the share of that by which the angle is none."""
    first, second, vector = (0.0, 0.0, 1.0), (0.0, 1.0, 5e-10), (0.0, 0.0, 1.0)
    angles, noted = np.linspace(-3.0, 3.0, COUNT), flags()
    aims = rotated(first, angles, rotated((0.0, 1.0, 0.0), np.full(COUNT, 3e-8), np.array(vector)))
    around, _ = two_turns(first, second, vector, columns(aims), noted)
    assert not noted.rows.any()
    found = np.broadcast_to(angles_of(whole(around)), (2, COUNT))
    np.testing.assert_allclose(
        np.abs(np.exp(1j * found) - np.exp(1j * angles)).min(axis=0), 0.0, atol=5e-10 / 3e-8
    )


@pytest.mark.parametrize("kind", [Mirrored, Opposed])
def test_angles_that_are_written_are_those_of_both_turns(kind) -> None:
    """Also where an angle is none, half a turn, or one with a sine of -0."""
    angles = np.array([0.3, -2.9, 3.1, -0.2, 0.0])
    cosine, sine = turns(angles)
    value, out = kind((np.append(cosine, [1.0, -1.0]), np.append(sine, [-0.0, -0.0]))), np.empty((2, 7))
    value.write(out)
    both = np.broadcast_arrays(*value.both())
    np.testing.assert_allclose(np.exp(1j * out), both[0] + 1j * both[1], atol=1e-12)
    assert (np.abs(out) <= np.pi).all()
    assert out[0, 5:].tolist() == [0.0, np.pi]


@pytest.mark.parametrize("near", [1e-3, 1e-5])
def test_an_aim_almost_on_the_first_axis_still_says_how_to_turn(near: float) -> None:
    """Its distance of some ten millionths is none that leaves the turn about that axis open."""
    first, second, vector = (0.0, 0.0, 1.0), (0.6, 0.0, 0.8), (0.0, 0.0, 1.0)
    angles = np.linspace(-3.0, 3.0, COUNT)
    aims = rotated(first, angles, rotated(second, np.full(COUNT, near), np.array(vector)))
    noted = flags()
    around, bend = (
        np.broadcast_to(angles_of(whole(each)), (2, COUNT))
        for each in two_turns(first, second, vector, columns(aims), noted)
    )
    for k in range(2):
        reached = rotated(first, around[k], rotated(second, bend[k], np.array(vector)))
        np.testing.assert_allclose(reached, aims, atol=1e-9)
    assert not noted.rows.any()


def axis(direction, point=(0.0, 0.0, 0.0)) -> ScrewAxis:
    size = float(np.linalg.norm(direction))
    return ScrewAxis(False, tuple(float(each) / size for each in direction), point)


@pytest.mark.parametrize("tilt", [0.0, 0.9e-9, 1.1e-9, 1e-3])
def test_axes_are_parallel_or_at_right_angles_within_a_billionth(tilt: float) -> None:
    z, near, against = axis((0, 0, 1)), axis((tilt, 0, 1)), axis((0, tilt, -1))
    kept = tilt < 1e-9
    assert parallel(z, near) is parallel(z, against) is parallel(z, z, near) is kept
    assert not parallel(z, near, axis((1, 0, 0)))
    assert perpendicular(axis((1, 0, 0)), near) is kept
    assert perpendicular(axis((-1, 0, 0)), near) is kept
    assert not perpendicular(z, near)


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("length", [1.0, 20.0])
@pytest.mark.parametrize("aslant", [0.0, 9.0])
def test_axes_meet_where_they_are_a_billionth_of_the_arm_apart(
    length: float, side: float, aslant: float
) -> None:
    """One along x through (1, 2, 3), and one that passes it at a distance along (0, 1, -1), at any angle."""
    place, across_both = np.array([1.0, 2.0, 3.0]), np.array([0.0, 1.0, -1.0]) / np.sqrt(2)
    one = axis((1, 0, 0), tuple(place - [5.0, 0, 0]))
    for apart, meets in ((0.0, True), (0.9e-9, True), (1.1e-9, False), (1e-3, False)):
        point = place + side * apart * length * across_both + np.array([2.0 * aslant, 2.0, 2.0])
        other = axis((aslant, 1, 1), tuple(point.tolist()))
        for pair in ((one, other), (other, one)):
            found = meeting_point(*pair, length)
            assert (found is not None) is meets
            if found is not None:
                np.testing.assert_allclose(found, place, atol=2e-8 * length)
        third = axis((0, 0, 1), (1.0, 2.0 + side * apart * length, -4.0))
        crossing = axis((0, 1, 1), (1.0, 6.0, 7.0))
        assert (common_point((one, crossing, third), length) is not None) is meets
        assert contains(third, (1.0, 2.0, 9.0), length) is meets
    assert meeting_point(one, axis((1, 0, 0), (0.0, 2.0, 3.0)), length) is None
    assert common_point((one, crossing, axis((0, 1, 1), (1.0, 6.0, 7.0))), length) is None


def test_a_vector_beside_a_direction_is_at_right_angles_to_it() -> None:
    for direction in AXES:
        beside = aside(direction)
        assert np.dot(beside, direction) == pytest.approx(0.0, abs=1e-15)
        assert np.linalg.norm(beside) >= 0.8
        np.testing.assert_allclose(across_floats(direction, beside), np.cross(direction, beside), atol=1e-15)
    turned_over = axis((0.6, -0.0, 0.8)).opposite
    assert turned_over.direction == (-0.6, 0.0, -0.8)
    assert axis((0, 0, 1)).drawn == (0.0, 0.0, 1.0)
    assert ScrewAxis(False, (0.0, 0.0, 1.0), (0.0, 0.0, 0.0), -1.0).drawn == (0.0, 0.0, -1.0)


def arm_of(*rows: tuple[float, float, float, float], base: np.ndarray | None = None) -> Robot:
    """Return revolute joints by theta, d, a and alpha."""
    joints = tuple(Joint(f"j{k}", "revolute", *row) for k, row in enumerate(rows))
    frame = np.eye(4) if base is None else base
    return Robot("arm", joints, unlimited(len(joints)), "standard", frame, np.eye(4))


@pytest.mark.parametrize("theta", [0.0, 0.7, -2.5])
@pytest.mark.parametrize("alpha", [np.pi / 2, -np.pi / 2, 1.0])
@pytest.mark.parametrize("a", [0.3, -0.3, 0.0])
def test_forward_is_from_the_first_axis_to_the_second(theta: float, alpha: float, a: float) -> None:
    """Along x of the first link, turned over where that is drawn backwards."""
    found = axis_geometry(arm_of((theta, 0.4, a, alpha), (0.2, 0.1, 0.5, 0.0)))
    x = np.array([np.cos(theta), np.sin(theta), 0.0])
    np.testing.assert_allclose(found.forward, -x if a < 0 else x, atol=1e-12)


@pytest.mark.parametrize(
    ("turn", "upward"),
    [
        ([0.0, 0.0, 0.0], [0, 0, 1]),
        ([np.pi, 0.0, 0.0], [0, 0, -1]),  # hung from a ceiling
        ([2.0, 0.0, 0.0], [0, 0, -1]),
        ([np.pi / 2, 0.0, 0.0], [0, 0, 1]),  # on a wall: as in the base
        ([0.0, -1.0, 0.0], [0, 0, 1]),
    ],
)
def test_upward_is_along_the_first_axis_as_it_rises_in_the_world(turn, upward) -> None:
    base = np.eye(4)
    base[:3, :3] = Rotation.from_rotvec(turn).as_matrix()
    assert axis_geometry(arm_of((0, 0.4, 0.3, 1.5), (0, 0, 0.5, 0), base=base)).upward == tuple(upward)


def test_on_a_wall_upward_is_as_in_the_base_however_the_axis_is_drawn() -> None:
    """In modified tables the first axis may point down."""
    wall = np.eye(4)
    wall[:3, :3] = Rotation.from_rotvec([np.pi / 2, 0.0, 0.0]).as_matrix()
    joints = Joint("j0", "revolute", 0.0, 0.4, 0.0, np.pi), Joint("j1", "revolute", 0.0, 0.0, 0.3, 1.5)
    robot = Robot("arm", joints, unlimited(2), "modified", wall, np.eye(4))
    found = axis_geometry(robot)
    assert found.axes[0].direction == pytest.approx((0.0, 0.0, -1.0))
    assert found.upward == pytest.approx((0.0, 0.0, 1.0))


def test_displacements_take_points_and_directions_from_zero_to_a_pose_and_back() -> None:
    """G with G H = B^-1 T, of a base and a tool anywhere."""
    rng = np.random.default_rng(12)
    frames = np.tile(np.eye(4), (8, 1, 1))
    frames[:, :3, :3] = Rotation.random(8, random_state=3).as_matrix()
    frames[:, :3, 3] = rng.normal(size=(8, 3))
    base, poses = frames[0], frames[1:]
    arm = axis_geometry(arm_of((0.3, 0.4, 0.3, 1.5), (0.1, 0, 0.5, 0.2), base=base))
    goal = Displacement(arm, poses[:, :3].reshape(7, 12).T)
    back = InverseDisplacement(goal)
    G = np.linalg.inv(base) @ poses @ np.linalg.inv(arm.home)
    place = rng.normal(size=3)
    turned_to, taken = G[:, :3, :3] @ place, G[:, :3, :3] @ place + G[:, :3, 3]
    np.testing.assert_allclose(np.stack(goal.direction(tuple(place)), axis=1), turned_to, atol=1e-12)
    np.testing.assert_allclose(np.stack(goal.point(tuple(place)), axis=1), taken, atol=1e-12)
    inverse = np.linalg.inv(G)
    expected = np.einsum("nij,j->ni", inverse[:, :3, :3], place)
    np.testing.assert_allclose(np.stack(goal.view(tuple(place)), axis=1), expected, atol=1e-12)
    np.testing.assert_allclose(np.stack(back.direction(tuple(place)), axis=1), expected, atol=1e-12)
    returned = expected + inverse[:, :3, 3]
    np.testing.assert_allclose(np.stack(back.point(tuple(place)), axis=1), returned, atol=1e-12)
    again = back.point(tuple(taken.T))
    np.testing.assert_allclose(np.stack(again, axis=1), np.tile(place, (7, 1)), atol=1e-12)
