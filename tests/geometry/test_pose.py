from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from trajcli.errors import InputError
from trajcli.geometry.pose import (
    build,
    check_pose,
    exp_pose,
    interpolate,
    invert,
    log_pose,
    transform_points,
    twist_between,
)
from trajcli.geometry.rotation import cross_matrix

A, B = (
    build(Rotation.random(50, random_state=n).as_matrix(), np.random.default_rng(n).normal(size=(50, 3)))
    for n in (1, 2)
)


def generator(twist):
    result = np.zeros((*twist.shape[:-1], 4, 4))
    result[..., :3, :3], result[..., :3, 3] = cross_matrix(twist[..., 3:]), twist[..., :3]
    return result


def test_the_axioms_of_a_group():
    np.testing.assert_allclose(A @ invert(A), np.tile(np.eye(4), (50, 1, 1)), rtol=0, atol=1e-14)
    np.testing.assert_allclose(invert(A @ B), invert(B) @ invert(A), rtol=0, atol=1e-14)
    np.testing.assert_array_equal(A @ build(), A)
    np.testing.assert_allclose(invert(A), np.linalg.inv(A), rtol=0, atol=1e-14)


def test_points_go_through_a_composition_one_after_the_other():
    points = np.random.default_rng(9).normal(size=(50, 3))
    twice = transform_points(A, transform_points(B, points))
    np.testing.assert_allclose(transform_points(A @ B, points), twice, rtol=0, atol=1e-14)
    np.testing.assert_allclose(transform_points(build(translation=[1, 2, 3]), [0, 0, 1]), [1, 2, 4])


@pytest.mark.parametrize("angle", [0.0, 1e-12, 0.9e-4, 1.1e-4, 1e-2, 1.0, 3.0, np.pi - 1e-9])
def test_exp_is_the_matrix_exponential_and_log_its_inverse(angle):
    rng = np.random.default_rng(4)
    axes = rng.normal(size=(30, 3))
    axes *= angle / np.linalg.norm(axes, axis=-1, keepdims=True)
    twists = np.concatenate([rng.normal(size=(30, 3)), axes], axis=-1)
    np.testing.assert_allclose(exp_pose(twists), expm(generator(twists)), rtol=0, atol=2e-14)
    np.testing.assert_allclose(log_pose(exp_pose(twists)), twists, rtol=0, atol=2e-14)


def test_a_twist_leads_from_one_pose_to_the_other():
    np.testing.assert_allclose(A @ expm(generator(twist_between(A, B))), B, rtol=0, atol=1e-13)


def test_a_screw_goes_at_constant_twist():
    s = np.linspace(0, 1, 11)
    poses = interpolate(A[0], B[0], s, "screw")
    np.testing.assert_allclose(poses[[0, -1]], [A[0], B[0]], rtol=0, atol=1e-14)
    steps = twist_between(poses[:-1], poses[1:])
    np.testing.assert_allclose(steps, np.tile(twist_between(A[0], B[0]) / 10, (10, 1)), rtol=0, atol=1e-14)


def test_a_line_is_straight_and_turns_about_one_axis():
    poses = interpolate(A[0], B[0], [0.0, 0.25, 0.5, 0.75, 1.0])
    np.testing.assert_allclose(np.diff(poses[:, :3, 3], n=2, axis=0), 0, rtol=0, atol=1e-15)
    np.testing.assert_allclose(poses[[0, -1]], [A[0], B[0]], rtol=0, atol=1e-15)
    steps = Rotation.from_matrix(np.swapaxes(poses[:-1, :3, :3], 1, 2) @ poses[1:, :3, :3]).as_rotvec()
    np.testing.assert_allclose(steps, np.tile(steps[0], (4, 1)), rtol=0, atol=1e-14)


def test_what_is_no_pose_is_refused():
    assert check_pose(A[0]) < 1e-15
    with pytest.raises(InputError, match=r"last row .* it is 0, 0, 0, 2"):
        check_pose(np.diag([1, 1, 1, 2]))
    with pytest.raises(InputError, match=r"4x4 finite entries, this one has shape \(3, 4\)"):
        check_pose(A[0, :3])
    with pytest.raises(InputError, match="mirrors space"):
        check_pose(np.diag([1, 1, -1, 1]))


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("column", range(4))
def test_a_last_row_that_is_typed_is_exact_to_a_billionth(column, side):
    pose = np.array(A[0])
    pose[3, column] += side * 0.5e-9
    assert check_pose(pose) < 1e-15
    pose[3, column] += side * 1e-9
    with pytest.raises(InputError, match="last row"):
        check_pose(pose)


@pytest.mark.parametrize("entry", [(0, 0), (1, 3), (3, 3)])
def test_a_pose_is_finite_and_its_rotation_is_one(entry):
    pose = np.array(A[0])
    pose[entry] = np.nan
    with pytest.raises(InputError, match="4x4 finite entries, this one holds one that is not finite"):
        check_pose(pose)


def test_one_rotation_or_one_translation_serves_a_whole_batch():
    rotation, translation = A[0, :3, :3], A[:, :3, 3]
    for poses in (build(rotation, translation), build(A[:, :3, :3], A[0, :3, 3]), build(None, translation)):
        assert poses.shape == A.shape
        np.testing.assert_array_equal(poses[:, 3], np.tile([0.0, 0.0, 0.0, 1.0], (len(A), 1)))
    np.testing.assert_array_equal(build(rotation, translation)[:, :3, 3], translation)
    np.testing.assert_array_equal(build(rotation, translation)[1, :3, :3], rotation)
