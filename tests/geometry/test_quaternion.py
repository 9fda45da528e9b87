from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from trajcli.errors import InputError
from trajcli.geometry.rotation import (
    canonical,
    check_quaternion,
    matrix_from_quaternion,
    quaternion_from_matrix,
    without_jumps,
)

RANDOM = Rotation.random(500, random_state=7)
WXYZ = np.roll(RANDOM.as_quat(), 1, axis=-1)


def test_matrices_agree_with_scipy():
    np.testing.assert_allclose(matrix_from_quaternion(WXYZ), RANDOM.as_matrix(), rtol=0, atol=1e-15)
    np.testing.assert_allclose(matrix_from_quaternion(3 * WXYZ), RANDOM.as_matrix(), rtol=0, atol=1e-15)


def test_quaternions_agree_with_scipy():
    quaternion = quaternion_from_matrix(RANDOM.as_matrix().reshape(5, 100, 3, 3))
    assert quaternion.shape == (5, 100, 4)
    np.testing.assert_allclose(quaternion.reshape(-1, 4), canonical(WXYZ), rtol=0, atol=2e-15)


@pytest.mark.parametrize("axis", [[1, 0, 0], [0, 1, 0], [0, 0, 1], [0.6, 0.8, 0], [1, -2, 2]])
@pytest.mark.parametrize("angle", [0.0, 1e-9, 1.0, np.pi - 1e-7, np.pi])
def test_no_digit_is_lost_at_any_angle(axis, angle):
    quaternion = np.append(np.cos(angle / 2), np.sin(angle / 2) * np.array(axis) / np.linalg.norm(axis))
    again = quaternion_from_matrix(matrix_from_quaternion(quaternion))
    assert min(np.abs(again - quaternion).max(), np.abs(again + quaternion).max()) < 3e-16


def test_the_first_component_that_counts_is_positive():
    given = np.array([[-0.5, 0.5, 0.5, 0.5], [0, 0, -1, 0], [0, 0, 0, 1], [0, -0.6, 0.8, 0]])
    expected = [[0.5, -0.5, -0.5, -0.5], [0, 0, 1, 0], [0, 0, 0, 1], [0, 0.6, -0.8, 0]]
    np.testing.assert_array_equal(canonical(given), expected)
    assert not np.signbit(canonical(given)[1:, 0]).any()
    assert (quaternion_from_matrix(RANDOM.as_matrix())[:, 0] >= 0).all()


def test_what_is_no_unit_quaternion_is_refused():
    assert check_quaternion([0.70711, 0, 0.70711, 0]) < 1e-5
    with pytest.raises(InputError, match=r"length 1\.414"):
        check_quaternion([1, 1, 0, 0])
    with pytest.raises(InputError, match="four finite"):
        check_quaternion([1, 0, 0])
    with pytest.raises(InputError, match="length zero"):
        matrix_from_quaternion([[1, 0, 0, 0], [0, 0, 0, 0]])
    for wrong in ([np.inf, 0, 0, 0], [np.nan, 0, 0, 1]):
        with pytest.raises(InputError, match="not finite"):
            matrix_from_quaternion([[1, 0, 0, 0], wrong])
        with pytest.raises(InputError, match="four finite"):
            check_quaternion(wrong)
    with pytest.raises(InputError) as none:
        check_quaternion([0, 0, 0, 0])
    assert none.value.problems[0].hint == "no rotation is (1, 0, 0, 0)"


@pytest.mark.parametrize("side", [1, -1])
def test_a_length_within_a_ten_thousandth_of_1_is_taken_and_told(side):
    assert check_quaternion([0, 0, 1 + side * 0.9e-4, 0]) == pytest.approx(0.9e-4, rel=1e-9)
    with pytest.raises(InputError, match="instead of 1"):
        check_quaternion([0, 0, 1 + side * 1.1e-4, 0])


@pytest.mark.parametrize("side", [1, -1])
def test_signs_go_on_from_the_one_before_and_every_one_is_on_the_side_of_its_neighbour(side):
    turn = np.linspace(0.0, 9.0, 40)[:, None]
    smooth = np.cos(turn) * WXYZ[0] + np.sin(turn) * [-WXYZ[0, 1], WXYZ[0, 0], -WXYZ[0, 3], WXYZ[0, 2]]
    signs = np.random.default_rng(1).choice([-1.0, 1.0], (40, 1))
    np.testing.assert_array_equal(without_jumps(signs * smooth, side * smooth[0]), side * smooth)


@pytest.mark.parametrize(("w", "turned"), [(-1e-13, False), (1e-13, False), (-1e-9, True), (1e-9, False)])
def test_a_half_turn_that_rounding_decides_has_the_sign_of_its_axis(w, turned):
    """Components up to 1e-12 are taken as zero where the first sign is chosen."""
    given = np.array([[w, 0.6, 0.8, 0.0]])
    np.testing.assert_array_equal(without_jumps(given, None), -given if turned else given)
