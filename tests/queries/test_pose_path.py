"""Ways between poses: ends, even turning, and Euler angles that do not take the long way round."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from trajcli.errors import InputError
from trajcli.queries.pose import PoseAtEnd, TypedAngles, parse_fractions, pose_path, pose_view
from trajcli.units import Units

ANGLES = st.tuples(*[st.floats(-3, 3)] * 3)
S = np.linspace(0, 1, 9)


def end(angles, xyz, typed=None):
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("ZYZ", angles).as_matrix()
    pose[:3, 3] = xyz
    return PoseAtEnd(pose, typed)


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


def test_refusals():
    with pytest.raises(InputError, match="a screw turns"):
        pose_path(end([0] * 3, [0] * 3), end([1] * 3, [0] * 3), S, "screw", "euler")
    assert parse_fractions("0, 0.5 1").tolist() == [0, 0.5, 1]
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
