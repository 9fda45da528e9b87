from __future__ import annotations

import numpy as np
import oracle_robots as oracle
import pytest
from conventions import in_convention
from scipy.spatial.transform import Rotation

from trajcli.errors import InputError
from trajcli.kinematics.forward import MovingFrame, configurations, forward, link_poses

ARMS = pytest.mark.parametrize("arm", oracle.robots(), ids=lambda arm: arm["id"])
OTHER = {"standard": "modified", "modified": "standard"}


def test_a_standard_row_by_the_book():
    row = {"type": "R", "theta": 0.3, "d": 0.2, "a": 0.5, "alpha": 0.7}
    _, transform, _ = link_poses(oracle.robot_of({"dh": [row], "convention": "std"}), [0.4])
    ct, st, ca, sa = np.cos(0.7), np.sin(0.7), np.cos(0.7), np.sin(0.7)
    book = [
        [ct, -st * ca, st * sa, 0.5 * ct],
        [st, ct * ca, -ct * sa, 0.5 * st],
        [0, sa, ca, 0.2],
        [0, 0, 0, 1],
    ]
    np.testing.assert_allclose(transform, book, rtol=0, atol=1e-15)


def test_a_modified_row_by_the_book():
    row = {"type": "P", "theta": 0.3, "d": 0.2, "a": 0.5, "alpha": 0.7, "sign": -1}
    _, transform, _ = link_poses(oracle.robot_of({"dh": [row], "convention": "mdh"}), [0.4])
    ct, st, ca, sa, d = np.cos(0.3), np.sin(0.3), np.cos(0.7), np.sin(0.7), 0.2 - 0.4
    book = [[ct, -st, 0, 0.5], [st * ca, ct * ca, -sa, -sa * d], [st * sa, ct * sa, ca, ca * d], [0, 0, 0, 1]]
    np.testing.assert_allclose(transform, book, rtol=0, atol=1e-15)


@ARMS
def test_the_other_convention_is_the_published_one_and_comes_back(arm):
    robot = oracle.robot_of(arm)
    other = in_convention(robot, OTHER[robot.convention])
    published = oracle.robot_of(arm["other_convention"])
    assert other.convention == published.convention
    q = np.random.default_rng(3).uniform(-3, 3, (10, len(robot.joints)))
    np.testing.assert_allclose(forward(other, q), forward(robot, q), rtol=0, atol=1e-14)
    np.testing.assert_allclose(forward(published, q), forward(other, q), rtol=0, atol=1e-14)
    again = in_convention(other, robot.convention)
    np.testing.assert_allclose(forward(again, q), forward(robot, q), rtol=0, atol=1e-14)


@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_arbitrary_arms_change_over(convention):
    rng = np.random.default_rng(4)
    for joints in (1, 2, 6, 12):
        robot = oracle.random_arm(rng, joints, convention)
        q = rng.uniform(-3, 3, (10, joints))
        other = in_convention(robot, OTHER[convention])
        np.testing.assert_allclose(forward(other, q), forward(robot, q), rtol=0, atol=1e-13)
        assert in_convention(robot, convention) is robot


@pytest.mark.parametrize(
    ("values", "said"),
    [
        (0.3, "q has 1 values, robot random has 3 joints"),
        ([0.1, 0.2], "q has 2 values"),
        (np.zeros((2, 4)), "q has 4 values"),
        ([0.1, np.inf, 0.2], "not finite"),
        ([[0.0, 0.0, 0.0], [0.0, np.nan, 0.0]], "not finite"),
    ],
)
def test_configurations_have_a_finite_number_for_each_joint(values, said):
    with pytest.raises(InputError, match=said):
        configurations(oracle.random_arm(np.random.default_rng(1), 3, "standard"), values)


def test_a_frame_that_moves_is_a_product_of_poses_whenever_its_axes_are_asked_for():
    """Turns about z, screws about x with a tilt about y, and a frame that is attached, in any order."""

    def pose(axis="z", angle=0.0, point=(0.0, 0.0, 0.0)):
        result = np.eye(4)
        result[:3, :3], result[:3, 3] = Rotation.from_euler(axis, angle).as_matrix(), point
        return result

    rng = np.random.default_rng(6)
    for seed in range(20):
        wanted = pose("x", 0.4, (0.1, 0.2, 0.3))
        frame = MovingFrame(wanted)
        for kind in rng.integers(0, 4, 8):
            angle, length, tilt = rng.uniform(-2, 2, 3)
            if kind == 0:
                frame.turn(np.full(2, angle))
                wanted = wanted @ pose("z", angle)
            elif kind == 1:
                frame.turn(float(angle))
                wanted = wanted @ pose("z", angle)
            elif kind == 2:
                frame.screw(
                    length, np.cos(angle), np.sin(angle), *([np.cos(tilt), np.sin(tilt)] if seed % 2 else [])
                )
                wanted = wanted @ pose("x", angle, (length, 0.0, 0.0)) @ pose("y", tilt if seed % 2 else 0.0)
            else:
                tool = pose("y", tilt, (length, 0.1, 0.2))
                frame.attach(tool)
                wanted = wanted @ tool
            if rng.random() < 0.5:
                np.testing.assert_allclose(
                    [np.broadcast_to(entry, 2)[0] for entry in frame.x], wanted[:3, 0], atol=1e-13
                )
        out = np.empty((2, 4, 4))
        frame.write(out)
        np.testing.assert_allclose(out, np.tile(wanted, (2, 1, 1)), rtol=0, atol=1e-13)


def test_quarter_turns_of_a_table_leave_exact_zeros_behind_a_slide():
    rows = [
        {"type": "P", "theta": np.pi / 2, "d": 0.0, "a": 0.3, "alpha": np.pi},
        {"type": "P", "theta": np.pi, "d": 0.1, "a": 0.2, "alpha": 0.0},
    ]
    found = forward(oracle.robot_of({"dh": rows, "convention": "std"}), [0.0, 0.5])
    np.testing.assert_array_equal(
        found, [[0, -1, 0, 0.0], [-1, 0, 0, 0.3 - 0.2], [0, 0, -1, -0.6], [0, 0, 0, 1]]
    )
