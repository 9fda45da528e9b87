"""Screw axes of small arms, of which it is known where they lie, and displacements against plain matrices."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import oracle_robots as oracle
import pytest

from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.families.screw_axes import (
    Displacement,
    InverseDisplacement,
    ScrewAxis,
    axis_geometry,
    common_point,
    contains,
    meeting_point,
)
from trajcli.kinematics.robot import Joint, Robot, unlimited

X, Y, Z = np.eye(3).tolist()


def arm_of(*joints: Joint, base: np.ndarray | None = None, convention: str = "standard") -> Robot:
    return Robot(
        "arm", joints, unlimited(len(joints)), convention, np.eye(4) if base is None else base, np.eye(4)
    )


def shoulder(
    a: float, alpha: float = np.pi / 2, types: str = "RR", theta: float = 0.0, sign: int = 1
) -> Robot:
    """Return an arm whose second axis stands at a distance from the first one, along x of the first link."""
    kind = {"R": "revolute", "P": "prismatic"}
    return arm_of(
        Joint("one", kind[types[0]], a=a, alpha=alpha, theta=theta, d=0.4, sign=sign),
        Joint("two", kind[types[1]], a=1.0, sign=sign),
    )


@pytest.mark.parametrize(
    ("robot", "along"),
    [
        (shoulder(0.3), 1.0),
        (shoulder(-0.3), -1.0),
        (shoulder(-0.3, sign=-1), -1.0),  # whichever way joints count
        (shoulder(-0.3, -np.pi / 2), -1.0),
        (shoulder(-0.3, 5e-4), -1.0),  # not quite parallel
        (shoulder(-0.3, 1e-12), 1.0),  # parallel: x of the first link
        (shoulder(-1e-12), 1.0),  # they meet
        (shoulder(-1e-7, 1e-3), -1.0),  # a hundred times as far apart as axes that meet may be
        (shoulder(-0.3, types="PR"), 1.0),  # a slide has no place
        (shoulder(-0.3, types="RP"), 1.0),
    ],
)
def test_an_arm_reaches_forward_to_where_its_second_axis_stands(robot: Robot, along: float) -> None:
    np.testing.assert_allclose(axis_geometry(robot).forward, np.multiply(along, X), atol=1e-9)
    turned = replace(robot, joints=(replace(robot.joints[0], theta=0.7), robot.joints[1]))
    ahead = [along * np.cos(0.7), along * np.sin(0.7), 0.0]
    np.testing.assert_allclose(axis_geometry(turned).forward, ahead, atol=1e-9)


def about_x(angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1, 0, 0, 0], [0, c, -s, 0], [0, s, c, 0], [0, 0, 0, 1]], dtype=float)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(
    ("base", "up"),
    [
        (np.eye(4), 1.0),
        (about_x(np.pi), -1.0),  # it hangs
        (about_x(np.pi / 2 - 1e-4), 1.0),  # on a wall, and a little upward
        (about_x(np.pi / 2 + 1e-4), -1.0),
        (about_x(np.pi / 2 + 1e-12), 1.0),  # on a wall: as in the base
    ],
)
def test_the_first_axis_rises_in_world(base: np.ndarray, up: float, sign: int) -> None:
    robot = replace(shoulder(0.3, sign=sign), base=base)
    assert axis_geometry(robot).upward == tuple(np.multiply(up, Z) + 0.0)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_an_axis_that_lies_in_its_base_rises_where_the_base_is_turned(side: float) -> None:
    """The first axis goes along -y of the base, which a turn by a right angle about x makes -z or z of world."""
    first = Joint("one", "revolute", alpha=np.pi / 2), Joint("two", "revolute", alpha=-np.pi / 2, a=0.5)
    robot = arm_of(*first, base=about_x(side * np.pi / 2), convention="modified")
    assert axis_geometry(robot).upward == tuple(np.multiply(side, Y) + 0.0)


@pytest.mark.parametrize("sign", [1, -1])
def test_of_an_axis_that_lies_in_world_and_base_the_table_says_how_it_goes(sign: int) -> None:
    """It goes along -y, and meets the second one: ahead is x of the first link, which the table turns by 0.7."""
    joints = (
        Joint("one", "revolute", alpha=np.pi / 2, theta=0.7, sign=sign),
        Joint("two", "revolute", alpha=-np.pi / 2, sign=sign),
    )
    arm = axis_geometry(arm_of(*joints, convention="modified"))
    np.testing.assert_allclose(arm.upward, np.multiply(-1, Y), atol=1e-12)
    np.testing.assert_allclose(arm.forward, (np.cos(0.7), 0.0, np.sin(0.7)), atol=1e-12)


def test_axes_at_right_angles_have_no_dust_and_small_numbers_are_kept() -> None:
    axes = axis_geometry(arm_of(*(Joint(str(k), "revolute", alpha=np.pi / 2, a=1.0) for k in range(4)))).axes
    assert {abs(entry) for axis in axes for entry in axis.direction} == {0.0, 1.0}
    second = axis_geometry(shoulder(5e-13)).axes[1]
    assert second.point[0] == 5e-13


@pytest.mark.parametrize("counts", [1.0, -1.0])
def test_which_way_a_joint_counts_does_not_change_how_its_axis_is_drawn(counts: float) -> None:
    direction = tuple(np.multiply(counts, [0.6, 0.0, 0.8]).tolist())
    axis = ScrewAxis(False, direction, (1.0, 2.0, 3.0), counts)
    assert axis.drawn == (0.6, 0.0, 0.8)
    assert axis.opposite.drawn == (-0.6, 0.0, -0.8)
    assert axis.opposite.opposite == axis


@pytest.mark.parametrize("tilt", [(0.0, 1.0, 0.0), (0.6, 0.8, 0.0), (-0.8, 0.0, 0.6)])
def test_two_axes_meet_where_both_are(tilt: tuple[float, float, float]) -> None:
    """Points on them are any; what is beside one by more than a billionth of the arm is none."""
    meets = np.array([5.0, 2.0, 3.0])
    one = ScrewAxis(False, (1.0, 0.0, 0.0), tuple((meets - 4.0 * np.array(X)).tolist()))
    other = ScrewAxis(False, tilt, tuple((meets + 7.0 * np.array(tilt)).tolist()))
    np.testing.assert_allclose(meeting_point(one, other, 1.0), meets, atol=1e-12)
    for axis in (one, other):
        assert contains(axis, tuple(meets.tolist()), 1.0)
        for side in np.eye(3):
            across = np.linalg.norm(np.cross(side, axis.direction))
            beside = tuple((meets + 3e-9 * side).tolist())
            assert contains(axis, beside, 1.0) == (across == 0.0)


def test_a_wrist_whose_outer_axes_are_in_line_has_a_centre() -> None:
    centre = (0.1, 0.2, 0.3)
    axes = [ScrewAxis(False, tuple(direction), centre) for direction in (Z, Y, Z)]
    assert common_point(axes, 1.0) == pytest.approx(centre, abs=1e-15)
    assert common_point([axes[1], axes[0], replace_point(axes[1], 1e-8)], 1.0) is None


def replace_point(axis: ScrewAxis, off: float) -> ScrewAxis:
    x, y, z = axis.point
    return ScrewAxis(axis.prismatic, axis.direction, (x + off, y, z), axis.sign)


@pytest.mark.parametrize("seed", range(3))
def test_displacements_are_those_of_matrices(seed: int) -> None:
    """Small parts of a vector are parts of it: only what products of zeros and ones leave counts as nothing."""
    rng = np.random.default_rng(seed)
    robot = oracle.random_arm(rng, 6, "standard")
    turned = forward(oracle.random_arm(rng, 3, "standard"), rng.uniform(-3, 3, 3))
    robot = replace(robot, base=turned, tool=np.linalg.inv(turned))
    arm = axis_geometry(robot)
    poses = forward(robot, rng.uniform(-3, 3, (4, 6)))
    goal = Displacement(arm, poses[:, :3].reshape(4, 12).T)
    exact = np.linalg.inv(robot.base) @ poses @ np.linalg.inv(arm.home)
    inverse = InverseDisplacement(goal)
    for vector in (np.array([0.3, -0.2, 0.5]), np.array([1e-10, 1.0, 0.0])):
        for found, matrices in ((goal, exact), (inverse, np.linalg.inv(exact))):
            wanted = matrices[:, :3, :3] @ vector
            np.testing.assert_allclose(np.transpose(found.direction(tuple(vector))), wanted, atol=1e-13)
            np.testing.assert_allclose(
                np.transpose(found.point(tuple(vector))), wanted + matrices[:, :3, 3], atol=1e-12
            )
        back = np.linalg.inv(exact)[:, :3, :3] @ vector
        np.testing.assert_allclose(np.transpose(goal.view(tuple(vector))), back, atol=1e-13)


def test_small_parts_of_directions_of_an_arm_that_stands_straight_are_kept() -> None:
    arm = axis_geometry(shoulder(0.3, 0.0))
    goal = Displacement(arm, arm.home[:3].reshape(12, 1))
    found = goal.direction((1e-10, 1.0, 0.0))
    assert float(np.asarray(found[0]).reshape(-1)[0]) == pytest.approx(1e-10, rel=1e-6)
