from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import polar
from scipy.spatial.transform import Rotation

from trajcli.errors import InputError
from trajcli.geometry.rotation import (
    check_rotation,
    compose_turns,
    cos_sin,
    nearest_rotation,
    rotation_about,
    rotation_defect,
)

RANDOM = Rotation.random(200, random_state=4).as_matrix()


def test_quarter_turns_are_exact():
    turns = np.arange(-9, 10)
    cosine, sine = cos_sin(np.radians(90.0 * turns))
    np.testing.assert_array_equal(cosine, [(1, 0, -1, 0)[k % 4] for k in turns])
    np.testing.assert_array_equal(sine, [(0, 1, 0, -1)[k % 4] for k in turns])
    assert not np.signbit(cosine[cosine == 0]).any()
    assert not np.signbit(sine[sine == 0]).any()


@pytest.mark.parametrize("turns", [0, 1, -1, 100, -101])
def test_a_quarter_turn_is_recognised_within_four_roundings_of_its_angle_or_of_1(turns):
    angle = turns * np.pi / 2
    rounding = np.finfo(np.float64).eps * max(1.0, abs(angle))
    for share in (-3.0, 3.0):
        assert {abs(float(entry)) for entry in cos_sin(angle + share * rounding)} == {0.0, 1.0}
    for share in (-9.0, 9.0):
        other = angle + share * rounding
        assert cos_sin(other) == (np.cos(other), np.sin(other))
        assert 0.0 not in cos_sin(other)


@pytest.mark.parametrize("off", [1e-9, 1e-12, 3e-15])
def test_what_is_not_quite_a_quarter_turn_is_left_alone(off):
    cosine, sine = cos_sin([np.pi / 2 + off, off])
    np.testing.assert_array_equal(cosine, np.cos([np.pi / 2 + off, off]))
    np.testing.assert_array_equal(sine, np.sin([np.pi / 2 + off, off]))


@pytest.mark.parametrize("axis", "xyz")
def test_elementary_rotations_agree_with_scipy(axis):
    angles = np.linspace(-4, 4, 7)
    np.testing.assert_allclose(
        rotation_about(axis, angles),
        Rotation.from_rotvec(np.outer(angles, np.eye(3)["xyz".index(axis)])).as_matrix(),
        rtol=0,
        atol=1e-15,
    )


def test_turns_about_fixed_axes_are_turns_about_current_axes_in_reverse():
    turns = list(RANDOM[:4])
    fixed = compose_turns((turn, "fixed") for turn in turns)
    current = compose_turns((turn, "current") for turn in reversed(turns))
    np.testing.assert_allclose(fixed, current, rtol=0, atol=1e-15)
    assert np.abs(fixed - compose_turns((turn, "current") for turn in turns)).max() > 0.1


def test_no_turns_are_the_identity():
    np.testing.assert_array_equal(compose_turns([]), np.eye(3))
    np.testing.assert_array_equal(compose_turns([], size=4), np.eye(4))


def test_rounded_rotations_are_taken_and_their_defect_told():
    for matrix in RANDOM:
        rounded = np.round(matrix, 5)
        assert check_rotation(rounded) == pytest.approx(np.abs(rounded.T @ rounded - np.eye(3)).max())
    assert rotation_defect(np.round(RANDOM, 5)).max() > 1e-6


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (((1, 1), 0.1), "column 2 has length"),
        (((0, 2), 0.001), "columns 1 and 3 are not at right angles, their product is 0.001"),
        (((2, 2), -2.0), "mirrors space: its determinant is -1"),
        (((0, 0), np.nan), "3x3 finite"),
    ],
)
def test_the_defect_is_named(change, words):
    matrix = np.eye(3)
    matrix[change[0]] += change[1]
    with pytest.raises(InputError, match=words):
        check_rotation(matrix)


def test_the_bound_of_the_defect():
    assert check_rotation(np.diag([1 + 0.49e-4, 1, 1])) == pytest.approx(0.98e-4, rel=1e-4)
    with pytest.raises(InputError, match=r"allowed is 0\.0001"):
        check_rotation(np.diag([1 + 0.51e-4, 1, 1]))
    with pytest.raises(InputError, match="3x3"):
        check_rotation(np.eye(2))


def test_the_nearest_rotation_is_the_polar_factor():
    noisy = RANDOM + np.random.default_rng(1).normal(scale=1e-2, size=RANDOM.shape)
    nearest = nearest_rotation(noisy)
    np.testing.assert_allclose(nearest, [polar(matrix)[0] for matrix in noisy], rtol=0, atol=1e-14)
    assert rotation_defect(nearest).max() < 1e-14
    np.testing.assert_allclose(np.linalg.det(nearest_rotation(np.diag([1.0, 1.0, -0.5]))), 1)


def test_defects_count_in_every_column_and_either_way():
    long, short = np.diag([1.0, 1.1, 1.0]), np.diag([0.9, 1.0, 1.0])
    np.testing.assert_allclose(
        rotation_defect(np.stack([long, short, np.eye(3)])), [0.21, 0.19, 0.0], atol=1e-15
    )
    with pytest.raises(InputError, match=r"column 2 has length 1\.1 instead of 1"):
        check_rotation(long)
    with pytest.raises(InputError, match="no rotation"):  # products of columns that no number holds
        check_rotation([[1e200, -1e200, 0.0], [1e200, 1e200, 0.0], [0.0, 0.0, 1.0]])


def test_a_mirrored_matrix_has_the_nearest_rotation_too():
    """The rotation that aligns the axes best with the columns: those with the smallest stretch are turned over."""
    mirrored = RANDOM[:20] @ np.diag([1.2, 0.3, -0.6]) @ RANDOM[20:40]
    for matrix, nearest in zip(mirrored, nearest_rotation(mirrored), strict=True):
        wanted = Rotation.align_vectors(matrix.T, np.eye(3))[0].as_matrix()
        np.testing.assert_allclose(nearest, wanted, rtol=0, atol=1e-12)
