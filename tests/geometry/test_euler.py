from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from trajcli.errors import InputError
from trajcli.geometry.euler import (
    check_sequence,
    euler_from_matrix,
    matrix_from_euler,
    matrix_from_rpy,
    rpy_from_matrix,
)

SEQUENCES = ["".join(axes) for axes in product("xyz", repeat=3) if axes[0] != axes[1] != axes[2]]
FRAMES = ["current", "fixed"]
RANDOM = Rotation.random(100, random_state=2)


def test_there_are_twelve_sequences():
    assert len(SEQUENCES) == 12
    for sequence in SEQUENCES:
        assert check_sequence(sequence.upper()) == tuple("xyz".index(axis) for axis in sequence)


@pytest.mark.parametrize("sequence", SEQUENCES)
@pytest.mark.parametrize("frame", FRAMES)
def test_angles_agree_with_scipy(sequence, frame):
    name = sequence.upper() if frame == "current" else sequence
    angles = np.random.default_rng(0).uniform(-4, 4, (50, 3))
    matrices = matrix_from_euler(sequence, angles, frame)
    np.testing.assert_allclose(matrices, Rotation.from_euler(name, angles).as_matrix(), rtol=0, atol=2e-15)
    read = euler_from_matrix(sequence, RANDOM.as_matrix(), frame)
    np.testing.assert_allclose(read.angles, RANDOM.as_euler(name), rtol=0, atol=1e-12)
    assert not read.singular.any()


@pytest.mark.parametrize("sequence", SEQUENCES)
@pytest.mark.parametrize("frame", FRAMES)
def test_both_solutions_are_the_rotation_and_differ(sequence, frame):
    read = euler_from_matrix(sequence, RANDOM.as_matrix(), frame)
    for angles in (read.angles, read.alternative):
        np.testing.assert_allclose(
            matrix_from_euler(sequence, angles, frame), RANDOM.as_matrix(), rtol=0, atol=2e-15
        )
        assert np.abs(angles).max() <= np.pi
    assert np.abs(read.angles - read.alternative).max(axis=-1).min() > 0.01
    middle = read.angles[:, 1]
    low, high = (0, np.pi) if sequence[0] == sequence[2] else (-np.pi / 2, np.pi / 2)
    assert (middle >= low).all()
    assert (middle <= high).all()


@pytest.mark.parametrize("sequence", SEQUENCES)
@pytest.mark.parametrize("frame", FRAMES)
@pytest.mark.parametrize("off", [0.0, 1e-14, 1e-10, 1e-8])
@pytest.mark.parametrize("upper", [False, True])
def test_gimbal_lock_is_said_and_the_rotation_kept(sequence, frame, off, upper):
    lock = np.pi * upper if sequence[0] == sequence[2] else np.pi / 2 * (1 if upper else -1)
    given = np.array([0.4, lock + (-off if upper else off), 1.1])
    matrix = matrix_from_euler(sequence, given, frame)
    read = euler_from_matrix(sequence, matrix, frame)
    assert read.singular
    assert read.lock in (1, -1)
    for angles in (read.angles, read.alternative):
        np.testing.assert_allclose(matrix_from_euler(sequence, angles, frame), matrix, rtol=0, atol=2e-12)
        first, _, last = angles + read.lock * angles[::-1] - given - read.lock * given[::-1]
        assert abs((first + np.pi) % (2 * np.pi) - np.pi) < 1e-7
        assert abs((last + np.pi) % (2 * np.pi) - np.pi) < 1e-7
    if off < 1e-12:
        assert read.angles[2 if frame == "current" else 0] == 0


def test_a_thousandth_of_a_degree_off_is_no_lock():
    assert not rpy_from_matrix(matrix_from_rpy([0.3, np.pi / 2 - 2e-5, 0.2])).singular


def test_rpy_is_about_fixed_x_then_y_then_z():
    angles = np.array([0.1, 0.2, 0.3])
    expected = (
        Rotation.from_rotvec([0, 0, 0.3])
        * Rotation.from_rotvec([0, 0.2, 0])
        * Rotation.from_rotvec([0.1, 0, 0])
    )
    np.testing.assert_allclose(matrix_from_rpy(angles), expected.as_matrix(), rtol=0, atol=1e-15)
    np.testing.assert_allclose(rpy_from_matrix(expected.as_matrix()).angles, angles, rtol=0, atol=1e-15)


@pytest.mark.parametrize("sequence", ["xxy", "xyy", "xy", "xyzx", "abc", ""])
def test_other_sequences_are_refused(sequence):
    with pytest.raises(InputError, match="no sequence of Euler angles"):
        matrix_from_euler(sequence, [0, 0, 0])


@pytest.mark.parametrize("sequence", SEQUENCES)
@pytest.mark.parametrize(("off", "lock"), [(3e-8, True), (3e-7, False)])
def test_a_lock_is_a_tenth_of_a_microradian_wide(sequence, off, lock):
    middle = off if sequence[0] == sequence[2] else np.pi / 2 - off
    assert bool(euler_from_matrix(sequence, matrix_from_euler(sequence, [0.4, middle, 1.1])).singular) == lock


@pytest.mark.parametrize("frame", FRAMES)
@pytest.mark.parametrize("sequence", ["xyz", "zyx", "zyz"])
def test_no_turn_has_no_negative_zeros_and_half_turns_that_are_positive(sequence, frame):
    for matrix in (
        np.eye(3),
        np.diag([1.0, -1.0, -1.0]),
        np.diag([-1.0, 1.0, -1.0]),
        np.diag([-1.0, -1.0, 1.0]),
    ):
        read = euler_from_matrix(sequence, matrix, frame)
        for angles in (read.angles, read.alternative):
            assert not np.signbit(angles[angles == 0.0]).any()
    other = euler_from_matrix(sequence, np.eye(3), frame).alternative
    assert other.tolist() == ([np.pi] * 3 if sequence != "zyz" else [np.pi, 0.0, np.pi])
