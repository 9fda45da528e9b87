from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.spatial.transform import Rotation, Slerp

from trajcli.errors import InputError
from trajcli.geometry.rotation import (
    axis_angle_from_matrix,
    cross_matrix,
    exp,
    log,
    matrix_from_axis_angle,
    slerp,
)

DIRECTIONS = np.random.default_rng(3).normal(size=(60, 3))
DIRECTIONS /= np.linalg.norm(DIRECTIONS, axis=-1, keepdims=True)
ANGLES = [
    1e-300,
    1e-12,
    1e-7,
    1e-3,
    0.5,
    2.0,
    2 * np.pi / 3 - 1e-9,
    2 * np.pi / 3 + 1e-9,
    3.0,
    np.pi - 1e-3,
    np.pi - 1e-7,
    np.pi - 1e-10,
]


def test_exp_is_the_matrix_exponential():
    vectors = DIRECTIONS * np.linspace(0, 7, 60)[:, None]
    np.testing.assert_allclose(exp(vectors), expm(cross_matrix(vectors)), rtol=0, atol=5e-14)


@pytest.mark.parametrize("angle", ANGLES)
def test_log_is_the_inverse_of_exp_at_every_angle(angle):
    np.testing.assert_allclose(
        log(exp(DIRECTIONS * angle)), DIRECTIONS * angle, rtol=0, atol=1e-15 * (1 + angle)
    )


def test_small_vectors_keep_their_digits():
    vectors = DIRECTIONS * 1e-9
    np.testing.assert_allclose(log(exp(vectors)), vectors, rtol=1e-15, atol=1e-24)


def test_exp_is_the_inverse_of_log():
    matrices = Rotation.random(500, random_state=8).as_matrix()
    vectors = log(matrices)
    np.testing.assert_allclose(exp(vectors), matrices, rtol=0, atol=3e-15)
    assert np.linalg.norm(vectors, axis=-1).max() <= np.pi


def test_half_turns_have_an_axis_of_either_sign():
    half = 2 * DIRECTIONS[:, :, None] * DIRECTIONS[:, None, :] - np.eye(3)
    read = axis_angle_from_matrix(half)
    assert read.sign_free.all()
    assert not read.axis_free.any()
    np.testing.assert_allclose(read.angle, np.pi, rtol=0, atol=1e-15)
    np.testing.assert_allclose(np.abs(np.einsum("ni,ni->n", read.axis, DIRECTIONS)), 1, rtol=0, atol=1e-15)


def test_near_half_a_turn_the_sign_is_free_and_farther_off_it_is_not():
    read = axis_angle_from_matrix(matrix_from_axis_angle(DIRECTIONS[0], [np.pi - 1e-10, np.pi - 1e-8]))
    np.testing.assert_array_equal(read.sign_free, [True, False])
    np.testing.assert_allclose(read.angle, [np.pi - 1e-10, np.pi - 1e-8], rtol=0, atol=1e-15)


def test_no_turn_has_any_axis():
    read = axis_angle_from_matrix(np.eye(3))
    assert (read.angle, read.axis_free, read.sign_free) == (0, True, False)
    np.testing.assert_array_equal(read.axis, [0, 0, 1])
    np.testing.assert_array_equal(log(np.eye(3)), [0, 0, 0])


def test_axis_and_angle_of_regular_rotations():
    angles = np.linspace(0.1, 3.1, 60)
    matrices = matrix_from_axis_angle(5 * DIRECTIONS, angles)
    np.testing.assert_allclose(
        matrices, Rotation.from_rotvec(DIRECTIONS * angles[:, None]).as_matrix(), rtol=0, atol=1e-15
    )
    read = axis_angle_from_matrix(matrices)
    np.testing.assert_allclose(read.angle, angles, rtol=0, atol=1e-15)
    np.testing.assert_allclose(read.axis, DIRECTIONS, rtol=0, atol=1e-14)
    assert not (read.axis_free | read.sign_free).any()


def test_an_axis_without_direction_is_refused():
    with pytest.raises(InputError, match="other than zero"):
        matrix_from_axis_angle([0, 0, 0], 1.0)


def test_slerp_agrees_with_scipy():
    ends = Rotation.random(2, random_state=5)
    s = np.linspace(0, 1, 9)
    np.testing.assert_allclose(
        slerp(*ends.as_matrix(), s), Slerp([0, 1], ends)(s).as_matrix(), rtol=0, atol=2e-15
    )


def test_slerp_of_batches():
    start, end = (
        Rotation.random(4, random_state=5).as_matrix(),
        Rotation.random(4, random_state=6).as_matrix(),
    )
    s = np.array([0.1, 0.5, 0.7, 1.0])
    each = [slerp(a, b, fraction) for a, b, fraction in zip(start, end, s, strict=True)]
    np.testing.assert_allclose(slerp(start, end, s), each, rtol=0, atol=1e-15)


@pytest.mark.parametrize("angle", [1e-13, 1e-11, 1e-8])
def test_an_axis_is_free_below_a_trillionth_and_is_read_above(angle):
    read = axis_angle_from_matrix(exp(DIRECTIONS * angle))
    assert (read.axis_free == (angle < 1e-12)).all()
    np.testing.assert_allclose(read.axis, DIRECTIONS, rtol=0, atol=1e-14)


@pytest.mark.parametrize("wrong", [np.inf, np.nan])
def test_an_axis_that_is_not_finite_is_refused(wrong):
    with pytest.raises(InputError, match="finite vector"):
        matrix_from_axis_angle([[1.0, 0.0, 0.0], [wrong, 0.0, 0.0]], 1.0)
