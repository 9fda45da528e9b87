"""Measurements of several kinds at once: each row by itself, its residuals, their slopes, and root mean squares."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from trajcli.kinematics.calibration.measurements import MeasuredKind, Measurements
from trajcli.kinematics.calibration.parameters import parse_parameters
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.target import partial_target
from trajcli.kinematics.robot import Joint, Robot, unlimited

ROBOT = Robot(
    "arm",
    (Joint("j1", d=0.3, alpha=1.2), Joint("j2", a=0.4, alpha=0.3), Joint("j3", a=0.25, d=0.1)),
    unlimited(3),
    "standard",
    np.eye(4),
    np.eye(4),
)
Q = np.random.default_rng(1).uniform(-1, 1, (9, 3))
POSES = forward(ROBOT, Q)
SHIFT = np.random.default_rng(2).normal(size=(9, 3)) * 0.01
TURN = np.random.default_rng(3).normal(size=(9, 3)) * 0.02
PLACES = POSES[:, :3, 3] + SHIFT
TURNED = Rotation.from_rotvec(TURN) * Rotation.from_matrix(POSES[:, :3, :3])
HEADINGS = np.arctan2(*TURNED.as_matrix()[:, [1, 0], 0].T)
POSITION, PLANE, WHOLE, ORIENTATION = (
    np.array([7, 1]),
    np.array([0, 4, 6]),
    np.array([8, 2]),
    np.array([3, 5]),
)
KINDS = (
    MeasuredKind(POSITION, partial_target(PLACES[POSITION])),
    MeasuredKind(
        PLANE, partial_target(PLACES[PLANE], fixed=(True, True, False), yaw=HEADINGS[PLANE], tool_axis="x")
    ),
    MeasuredKind(WHOLE, partial_target(PLACES[WHOLE], rotation=TURNED.as_matrix()[WHOLE])),
    MeasuredKind(ORIENTATION, partial_target(rotation=TURNED.as_matrix()[ORIENTATION])),
)
ALL = Measurements(Q, KINDS)
TURNS = np.concatenate([WHOLE, ORIENTATION])


def test_numbers_are_counted_by_what_they_are_of() -> None:
    assert ALL.counts == (2 * 3 + 3 * 2 + 2 * 3, 3 * 1 + 2 * 3 + 2 * 3)


def test_each_row_has_its_own_residuals_and_zeros_for_what_was_not_measured() -> None:
    missed, _ = ALL.differences(ROBOT, parse_parameters(ROBOT, "j1.a"))
    wanted = np.zeros((9, 6))
    wanted[POSITION, :3] = SHIFT[POSITION]
    wanted[PLANE, :2] = SHIFT[PLANE, :2]
    wanted[PLANE, 3] = HEADINGS[PLANE] - np.arctan2(POSES[PLANE, 1, 0], POSES[PLANE, 0, 0])
    wanted[WHOLE, :3] = SHIFT[WHOLE]
    wanted[TURNS, 3:] = TURN[TURNS]
    assert missed == pytest.approx(wanted, abs=1e-12)


def test_slopes_are_differences_of_residuals() -> None:
    parameters = parse_parameters(ROBOT, "j1.d,j2.theta,j3.alpha")
    _, slopes = ALL.differences(ROBOT, parameters)
    for column, (joint, name) in enumerate(((0, "d"), (1, "theta"), (2, "alpha"))):
        sides = []
        for step in (1e-6, -1e-6):
            joints = list(ROBOT.joints)
            joints[joint] = replace(joints[joint], **{name: getattr(joints[joint], name) + step})
            sides.append(ALL.differences(replace(ROBOT, joints=tuple(joints)), parameters)[0])
        by_difference = (sides[1] - sides[0]) / 2e-6  # of what is computed, which residuals are less
        straight = np.setdiff1d(np.arange(9), TURNS)
        assert slopes[straight, :, column] == pytest.approx(by_difference[straight], abs=1e-7)
        assert slopes[WHOLE, :3, column] == pytest.approx(by_difference[WHOLE, :3], abs=1e-7)
        # of rotation vectors only what they have along themselves: a turn counts as its negative there
        along = np.einsum("ki,ki->k", TURN[TURNS], by_difference[TURNS, 3:])
        assert np.einsum("ki,ki->k", TURN[TURNS], slopes[TURNS, 3:, column]) == pytest.approx(along, abs=1e-8)


def test_root_mean_squares_are_over_all_that_measured_a_distance_or_an_angle() -> None:
    squares = [(SHIFT[POSITION] ** 2).sum(1), (SHIFT[PLANE, :2] ** 2).sum(1), (SHIFT[WHOLE] ** 2).sum(1)]
    yaw = HEADINGS[PLANE] - np.arctan2(POSES[PLANE, 1, 0], POSES[PLANE, 0, 0])
    angles = [yaw**2, (TURN[TURNS] ** 2).sum(1)]
    wanted = [np.sqrt(np.concatenate(each).mean()) for each in (squares, angles)]
    assert ALL.root_mean_squares(ROBOT) == pytest.approx(wanted)
    assert Measurements(Q, KINDS[:1]).root_mean_squares(ROBOT)[1] is None
    assert Measurements(Q, KINDS[3:]).root_mean_squares(ROBOT)[0] is None


def test_deviations_weigh_lengths_and_angles_row_by_row() -> None:
    assert ALL.weights(2.5).tolist() == 9 * [[1, 1, 1, 2.5, 2.5, 2.5]]
    deviations = np.column_stack([np.arange(1.0, 10), np.arange(11.0, 20)])
    weights = replace(ALL, deviations=deviations).weights(2.5)
    assert weights == pytest.approx(1 / np.repeat(deviations, 3, axis=1))
    assert weights[3, [2, 3]] == pytest.approx([1 / 4, 1 / 14])
