from __future__ import annotations

import numpy as np
import oracle_robots as oracle
import pytest

from trajcli.kinematics.dexterity import (
    changes_of_sign,
    characteristic_length,
    dexterity,
    singular_directions,
)
from trajcli.kinematics.jacobian import jacobian

ARMS = {arm["id"]: oracle.robot_of(arm) for arm in oracle.robots()}
PUMA, UR5E, PANDA = ARMS["C-puma560"], ARMS["C-ur5e"], ARMS["C-panda"]


def planar(lengths):
    rows = [{"type": "R", "theta": 0.0, "d": 0.0, "a": a, "alpha": 0.0} for a in lengths]
    return oracle.robot_of({"dh": rows, "convention": "std"})


def test_published_manipulability_of_the_puma():
    measure = dexterity(PUMA, [0, np.pi / 4, -np.pi, 0, np.pi / 4, 0]).manipulability
    assert measure == pytest.approx(0.078617, abs=5e-7)


@pytest.mark.parametrize("angle", [0.3, np.pi / 2, 2.5])
def test_manipulability_of_two_links_by_hand(angle):
    # J^T J with both lengths 1: products of the levers, plus 1 from the angular row
    robot = planar([1.0, 1.0])
    k = np.cos(angle)
    gram = np.array([[2 + 2 * k + 1, 1 + k + 1], [1 + k + 1, 2]])
    assert dexterity(robot, [0.7, angle]).manipulability == pytest.approx(np.sqrt(np.linalg.det(gram)))


@pytest.mark.parametrize("robot", [PUMA, UR5E, PANDA], ids=lambda robot: robot.name)
def test_measures_against_their_definitions(robot):
    q = np.random.default_rng(0).uniform(-2, 2, (2, 10, len(robot.joints)))
    found, plain = dexterity(robot, q), jacobian(robot, q)
    assert found.rank.shape == (2, 10)
    assert (found.rank == 6).all()
    gram = plain @ np.swapaxes(plain, -1, -2)
    np.testing.assert_allclose(found.manipulability, np.sqrt(np.linalg.det(gram)), rtol=1e-6)
    scaled = plain / np.array([found.length] * 3 + [1] * 3)[:, None]
    np.testing.assert_allclose(found.condition, np.linalg.cond(scaled), rtol=1e-9)


def test_the_length_does_not_depend_on_the_unit_of_length():
    rows = [{"type": "R", "theta": 0.0, "d": 0.0, "a": a, "alpha": 0.0} for a in (300.0, 200.0)]
    large = oracle.robot_of({"dh": rows, "convention": "std"})
    small = planar([0.3, 0.2])
    assert characteristic_length(small) == pytest.approx(0.5)
    assert characteristic_length(UR5E) == pytest.approx(0.1625 + 0.425 + 0.3922 + 0.1333 + 0.0997 + 0.0996)
    assert characteristic_length(PANDA) == pytest.approx(0.333 + 0.316 + 2 * 0.0825 + 0.384 + 0.088 + 0.107)
    q = [0.4, 1.1]
    np.testing.assert_allclose(dexterity(large, q).condition, dexterity(small, q).condition, rtol=1e-12)


def test_slides_without_lengths_have_a_length_of_one():
    rows = [{"type": "P", "theta": 0.0, "d": 0.0, "a": 0.0, "alpha": np.pi / 2}] * 2
    robot = oracle.robot_of({"dh": rows, "convention": "std"})
    assert characteristic_length(robot) == 1
    assert dexterity(robot, [0.1, 0.2]).condition == pytest.approx(1)


@pytest.mark.parametrize(
    ("robot", "q", "idle"),
    [
        (PUMA, [0.3, 0.5, -1.0, 0.4, 0.0, 0.9], [0, 0, 0, 1, 0, -1]),  # axes 4 and 6 in line
        (UR5E, [0.3, -1.0, 1.2, 0.4, 0.0, 0.9], None),  # axis 6 parallel to 2, 3, 4
        (UR5E, [0.3, -1.0, 0.0, 0.4, 0.8, 0.9], None),  # arm stretched
    ],
)
def test_singular_poses(robot, q, idle):
    found = dexterity(robot, q)
    assert found.rank == 5
    assert found.condition == np.inf
    assert found.manipulability < 1e-12
    lost = singular_directions(robot, q)
    assert lost.blocked.shape == (1, 6)
    assert lost.idle.shape == (1, 6)
    plain = jacobian(robot, q)
    np.testing.assert_allclose(plain @ lost.idle[0], 0, rtol=0, atol=1e-13)
    np.testing.assert_allclose(lost.blocked[0] / ([lost.length] * 3 + [1] * 3) @ plain, 0, rtol=0, atol=1e-13)
    np.testing.assert_allclose(np.linalg.norm([*lost.blocked, *lost.idle], axis=-1), 1)
    if idle is not None:
        np.testing.assert_allclose(np.abs(lost.idle[0]), np.abs(idle) / np.sqrt(2), rtol=0, atol=1e-12)
        assert lost.idle[0, 3] * lost.idle[0, 5] < 0


def test_the_stretched_arm_cannot_reach_farther():
    lost = singular_directions(planar([1.0, 1.0]), [0.6, 0.0])
    radial = np.array([np.cos(0.6), np.sin(0.6), 0, 0, 0, 0])
    np.testing.assert_allclose(lost.blocked @ lost.blocked.T, np.eye(4), rtol=0, atol=1e-14)
    assert np.linalg.norm(lost.blocked @ radial) == pytest.approx(1)
    assert lost.idle.shape == (0, 2)


def test_a_redundant_arm_has_an_idle_motion_and_nothing_blocked():
    lost = singular_directions(PANDA, [0.1, -0.5, 0.3, -2.0, 0.2, 1.7, 0.4])
    assert lost.blocked.shape == (0, 6)
    assert lost.idle.shape == (1, 7)


def test_the_length_counts_offsets_in_either_direction():
    rows = [{"type": "R", "theta": 0.0, "d": d, "a": a, "alpha": 0.0} for a, d in ((0.3, -0.2), (-0.1, 0.4))]
    assert characteristic_length(oracle.robot_of({"dh": rows, "convention": "std"})) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("determinants", "changes"),
    [
        ([1.0, 2.0, 3.0], []),
        ([1.0, -2.0, 3.0], [1, 2]),
        ([-1.0, -2.0, 3.0], [2]),
        ([1.0, 0.0, 3.0], []),
        ([1.0, 0.0, -3.0], [2]),
        ([0.0, 0.0, -3.0, 0.0, 0.0, 1.0, 0.0], [5]),
        ([0.0, 0.0], []),
        ([], []),
    ],
)
def test_a_sign_changes_where_the_next_one_is_told(determinants, changes):
    assert changes_of_sign(np.array(determinants)).tolist() == changes
