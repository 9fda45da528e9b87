"""Ways between poses: ends, even turning, and Euler angles that do not take the long way round."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from trajcli.errors import InputError
from trajcli.queries.pose import (
    PoseStep,
    TypedAngles,
    composed,
    parse_fractions,
    parse_sequence,
    pose_path,
    pose_report,
    pose_view,
    read_end,
    read_steps,
)
from trajcli.units import Units

ANGLES = st.tuples(*[st.floats(-3, 3)] * 3)
S = np.linspace(0, 1, 9)


def end(angles, xyz, typed=None):
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("ZYZ", angles).as_matrix()
    pose[:3, 3] = xyz
    return PoseStep(pose, typed=typed)


@given(a=ANGLES, b=ANGLES, way=st.sampled_from(["line", "screw"]))
@settings(max_examples=30, deadline=None)
def test_ends_are_met_and_the_turning_is_even(a, b, way):
    start, stop = end(a, [0.1, 0.2, 0.3]), end(b, [-0.4, 0.5, 0])
    poses = pose_path(start, stop, S, way)
    assert poses[0] == pytest.approx(start.pose, abs=1e-9)
    assert poses[-1] == pytest.approx(stop.pose, abs=1e-9)
    turns = Rotation.from_matrix(poses[:, :3, :3])
    steps = (turns[:-1].inv() * turns[1:]).magnitude()
    assert steps == pytest.approx(np.full(8, steps.mean()), abs=1e-7)
    if way == "line":
        assert poses[:, :3, 3] == pytest.approx(
            np.outer(1 - S, [0.1, 0.2, 0.3]) + np.outer(S, [-0.4, 0.5, 0])
        )


@pytest.mark.parametrize("back", [False, True])
def test_at_gimbal_lock_the_angle_that_is_free_is_that_of_the_other_end(*, back):
    """As in a move with Euler angles: of roll and yaw at a pitch of 90 degrees only the difference is determined."""
    locked, typed = np.eye(4), np.eye(4)
    locked[:3, :3] = Rotation.from_euler("xyz", [0, 90, 0], degrees=True).as_matrix()
    angles = np.deg2rad([30.0, 40.0, 50.0])
    typed[:3, :3] = Rotation.from_euler("xyz", angles).as_matrix()
    ends = PoseStep(locked), PoseStep(typed, typed=TypedAngles("XYZ", "fixed", tuple(angles)))
    middle = pose_path(*(ends[::-1] if back else ends), np.array([0.5]), "line", "euler")[0, :3, :3]
    assert middle == pytest.approx(Rotation.from_euler("xyz", [40, 65, 50], degrees=True).as_matrix())


@given(a=ANGLES, b=ANGLES)
@settings(max_examples=30, deadline=None)
def test_typed_angles_change_evenly(a, b):
    start = end(a, [0, 0, 0], TypedAngles("ZYZ", "current", a))
    stop = end(b, [1, 0, 0], TypedAngles("ZYZ", "current", b))
    poses = pose_path(start, stop, S, "line", "euler")
    for s, pose in zip(S, poses, strict=True):
        angles = (1 - s) * np.array(a) + s * np.array(b)
        assert pose[:3, :3] == pytest.approx(Rotation.from_euler("ZYZ", angles).as_matrix(), abs=1e-12)


def test_angles_that_were_not_typed_are_the_nearest():
    close = end([3.1, 0.5, 0.1], [0, 0, 0]), end([-3.1, 0.5, 0.1], [0, 0, 0])
    poses = pose_path(*close, S, "line", "euler", ("ZYZ", "current"))
    turns = Rotation.from_matrix(poses[:, :3, :3])
    assert (turns[:-1].inv() * turns[1:]).magnitude().sum() < 0.1


def shortest(poses, most):
    """Require that the turns on the way add up to no more than an angle."""
    turns = Rotation.from_matrix(poses[:, :3, :3])
    assert (turns[:-1].inv() * turns[1:]).magnitude().sum() < most


@pytest.mark.parametrize("typed_first", [True, False])
@pytest.mark.parametrize("wound", [0.0, 2 * np.pi, -4 * np.pi])
def test_the_end_that_was_not_typed_takes_the_turns_and_the_triple_nearest_to_the_other(typed_first, wound):
    angles = np.array([0.3, -0.5, 2.0 + wound])  # a middle angle below zero: the triple that is not principal
    typed = end(angles, [0, 0, 0], TypedAngles("ZYZ", "current", tuple(angles)))
    other = end(angles + np.array([0.02, -0.03, 0.04]), [1, 0, 0])
    ends = (typed, other) if typed_first else (other, typed)
    poses = pose_path(*ends, S, "line", "euler", ("ZYZ", "current"))
    assert poses[0][:3, :3] == pytest.approx(ends[0].pose[:3, :3], abs=1e-12)
    assert poses[-1][:3, :3] == pytest.approx(ends[1].pose[:3, :3], abs=1e-12)
    shortest(poses, 0.1)


def test_of_two_untyped_ends_the_second_takes_the_triple_nearest_to_the_first():
    first, last = end([-3.0, 0.4, 0.0], [0, 0, 0]), end([-3.2, 0.4, 0.0], [0, 0, 0])
    shortest(pose_path(first, last, S, "line", "euler", ("ZYZ", "current")), 0.3)


def test_angles_about_fixed_axes_are_not_those_about_current_ones():
    a, b = (0.3, 0.5, -0.8), (-0.4, 0.9, 0.2)
    fixed = [end((0, 0, 0), [0, 0, 0], TypedAngles("XYZ", "fixed", each)) for each in (a, b)]
    for each, angles in zip(fixed, (a, b), strict=True):
        each.pose[:3, :3] = Rotation.from_euler("xyz", angles).as_matrix()  # lower case: about fixed axes
    current = PoseStep(
        fixed[0].pose, typed=TypedAngles("XYZ", "current", (9.0, 9.0, 9.0))
    )  # not of this frame
    for start in (fixed[0], current):
        poses = pose_path(start, fixed[1], S, "line", "euler")
        for s, pose in zip(S, poses, strict=True):
            angles = (1 - s) * np.array(a) + s * np.array(b)
            assert pose[:3, :3] == pytest.approx(Rotation.from_euler("xyz", angles).as_matrix(), abs=1e-12)
    plain = [PoseStep(each.pose) for each in fixed]
    for euler, text in ((("ZYX", "fixed"), "zyx"), (("ZYX", "current"), "ZYX"), (None, "xyz")):
        middle = pose_path(*plain, np.array([0.5]), "line", "euler", euler)[0, :3, :3]
        triples = [Rotation.from_matrix(each.pose[:3, :3]).as_euler(text) for each in fixed]
        assert middle == pytest.approx(Rotation.from_euler(text, np.mean(triples, axis=0)).as_matrix())


def test_steps_are_read_with_their_frames_and_inverted():
    words = (
        "{rpy: [10, 20, 30], xyz: [1, 2, 3]}",
        "{rpy: [-40, 50, 60], xyz: [3, 1, 2], frame: fixed, invert: true}",
    )
    steps = read_steps(words, Units("deg", "m"))
    first, second = np.eye(4), np.eye(4)
    first[:3, :3] = Rotation.from_euler("xyz", [10, 20, 30], degrees=True).as_matrix()
    second[:3, :3] = Rotation.from_euler("xyz", [-40, 50, 60], degrees=True).as_matrix()
    first[:3, 3], second[:3, 3] = [1, 2, 3], [3, 1, 2]
    assert composed(steps) == pytest.approx(np.linalg.inv(second) @ first)
    assert steps[0].typed == TypedAngles("XYZ", "fixed", tuple(np.radians([10.0, 20.0, 30.0]).tolist()))
    assert steps[1].typed is None  # the angles are not those of the inverse
    euler = read_end("{euler: {sequence: ZYX, frame: fixed, angles: [1, 2, 3]}}", Units())
    assert euler.typed == TypedAngles("ZYX", "fixed", (1.0, 2.0, 3.0))


def test_numbers_have_no_negative_zeros_and_half_a_turn_is_positive():
    pose = np.eye(4)
    pose[:3, :3] = [[1.0, 0.0, -0.0], [-0.0, -1.0, -0.0], [0.0, -0.0, -1.0]]
    view = pose_view(pose, Units("deg", "m"))
    assert "-0.0" not in str(view)
    assert view["rpy"] == [180.0, 0.0, 0.0]


def test_a_report_says_what_the_matrix_leaves_open_in_its_units():
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("xyz", [0, 90, 30], degrees=True).as_matrix()
    said = pose_report(pose, Units("deg", "m"))["singular"]["rpy"]
    assert "first minus third = -30 deg" in said
    pose[:3, :3] *= 1.00001  # as rounded entries may be
    assert pose_report(pose, Units())["determinant"] == pytest.approx(1.00001**3, abs=1e-12)


def test_refusals():
    with pytest.raises(InputError, match="a screw turns"):
        pose_path(end([0] * 3, [0] * 3), end([1] * 3, [0] * 3), S, "screw", "euler")
    assert parse_fractions("0, 0.5 1").tolist() == [0, 0.5, 1]
    assert parse_sequence("zyz:fixed") == ("ZYZ", "fixed")
    assert parse_sequence("ZYZ") == ("ZYZ", "current")
    for text in ("", "a", "-0.1", "nan", "0,2"):
        with pytest.raises(InputError):
            parse_fractions(text)


def test_the_sign_of_a_quaternion_at_half_a_turn_is_not_that_of_rounding():
    rng = np.random.default_rng(2)
    for axis in rng.normal(size=(200, 3)):
        axis /= np.linalg.norm(axis)
        for angle in (np.pi - 1e-14, np.pi, np.pi + 1e-14):
            pose = np.eye(4)
            pose[:3, :3] = Rotation.from_rotvec(angle * axis).as_matrix()
            w, x, *_ = pose_view(pose, Units())["quat_wxyz"]
            assert abs(w) < 1e-12
            assert x > 0.0
