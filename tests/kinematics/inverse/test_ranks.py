"""Ranks and determinants of what a target fixes, against formulas of plane arms and differences of poses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from inverse_arms import arm
from scipy.spatial.transform import Rotation

from trajcli.errors import InputError
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.solve import solve
from trajcli.kinematics.inverse.target import (
    determinants,
    partial_target,
    pose_target,
    ranks,
    residual_jacobian,
    residuals,
)
from trajcli.kinematics.jacobian import jacobian

PLANE = replace(arm("planar 2R"), joints=tuple(replace(j, theta=0.0) for j in arm("planar 2R").joints))
TURNED_OVER = np.eye(4)
TURNED_OVER[1:3, 1:3] = np.cos(np.pi) * np.eye(2) + np.sin(np.pi) * np.array(
    [[0, -1], [1, 0]]
)  # sin(pi) is 1e-16
POSITION = partial_target([0.3, 0.2, 0.0])


def of(robot, q, target, length=1.0):
    joints = np.array(q)
    return determinants(
        target.rows(np.zeros(len(joints), int)), forward(robot, joints), jacobian(robot, joints), length
    )


@pytest.mark.parametrize("base", [np.eye(4), TURNED_OVER])
def test_the_determinant_of_a_plane_arm_is_that_of_the_textbook(base):
    """a1 a2 sin(q2), of the other sign seen from below; the height that no joint changes is left out."""
    robot, target = replace(PLANE, base=base), partial_target([[0.3, 0.2, 0.0]])
    q = np.array(
        [[1.2, 0.4], [-0.3, 1.1], [2.0, -0.7]]
    )  # in the first every joint moves the tcp to smaller x
    expected = base[2, 2] * 0.4 * 0.3 * np.sin(q[:, 1])
    assert of(robot, q, target) == pytest.approx(expected)
    assert of(robot, q, target, 0.7) == pytest.approx(expected / 0.49)
    assert of(robot, q, partial_target([[0.3, 0.2, 0.0]], yaw=[0.1], tool_axis="x")) is None
    assert of(robot, q, partial_target([[0.3, 0.2, 0.0]], fixed=(True, False, False))) is None


def test_a_direction_has_no_determinant():
    """Its three rows are two, and with those of the position they are as many as the joints of a UR."""
    assert of(arm("UR"), np.ones((1, 6)), partial_target([[0, 0, 0.0]], direction=[[0, 0, 1.0]])) is None
    whole = of(arm("UR"), np.ones((1, 6)), pose_target(np.eye(4)[None]))
    assert whole == pytest.approx(np.linalg.det(jacobian(arm("UR"), np.ones((1, 6)))))


def test_a_target_fixes_so_many_coordinates():
    position, other = [0.1, 0.2, 0.3], {"rotation": np.eye(3)}
    kinds = {"direction": ([0, 0, 1.0], 2), "yaw": (0.1, 1), "pitch": (0.1, 1)}
    for kind, (value, count) in kinds.items():
        assert partial_target(**{kind: value}).coordinates == count
        assert partial_target(position, fixed=(True, False, True), **{kind: value}).coordinates == count + 2
    assert partial_target(position, **other).coordinates == 6
    assert partial_target(position, **other).whole
    assert not partial_target(position, fixed=(True, True, False), **other).whole
    assert not partial_target(**other).whole
    assert not partial_target(position).whole


@pytest.mark.parametrize("steep", [0.02, 0.06, 0.5, -0.02])
@pytest.mark.parametrize("kind", ["yaw", "pitch"])
def test_rates_of_headings_and_elevations_of_a_steep_axis_are_differences(kind, steep):
    """Of three joints that turn the tool about x, y and z of the world."""
    pose, step = np.eye(4)[None].copy(), 1e-6
    pose[0, :3, :3] = Rotation.from_euler("ZYX", [0.7, np.pi / 2 - steep, 0.3]).as_matrix()
    columns = np.zeros((1, 6, 3))
    columns[0, 3:] = np.eye(3)
    target = partial_target(tool_axis="x", **{kind: np.array([0.1])})
    slopes = residual_jacobian(target, pose, columns)[0, 0]
    for k, unit in enumerate(np.eye(3)):
        ends = []
        for sign in (-1, 1):
            turned = pose.copy()
            turned[0, :3, :3] = Rotation.from_rotvec(sign * step * unit).as_matrix() @ pose[0, :3, :3]
            ends.append(residuals(target, turned)[0, 0])
        assert slopes[k] == pytest.approx((ends[0] - ends[1]) / (2 * step), abs=1e-6 / steep**2)


@pytest.mark.parametrize(
    ("bend", "here"), [(0.0, 1), (np.pi, 1), (3e-9, 1), (1e-5, 2), (0.5, 2), (-1e-5, 2), (np.pi - 1e-5, 2)]
)
def test_a_stretched_or_folded_arm_has_a_rank_less_than_around_it(bend, here):
    """An answer that meets its target within rounding is within 1e-8 rad of the fold."""
    counts, nearby = ranks(PLANE, np.array([[0.3, bend], [0.3, 0.6]]), POSITION)
    assert counts.tolist() == [here, 2]
    assert nearby == 2
    alone, around = ranks(PLANE, np.array([[0.3, bend]]), POSITION)
    assert (alone.tolist(), around) == ([here], 2)


def test_ranks_count_only_what_the_target_fixes():
    for target, expected in (
        (partial_target([0.3, 0.2, 0.0], fixed=(True, False, False)), 1),
        (partial_target([0.3, 0.2, 0.0], yaw=0.1, tool_axis="x"), 2),
        (partial_target(yaw=0.1, tool_axis="x"), 1),
        (pose_target(np.eye(4)), 2),
    ):
        counts, nearby = ranks(PLANE, np.array([[0.4, 0.8]]), target)
        assert (counts.tolist(), nearby) == ([expected], expected)
    # joint 1 alone turns the heading of the tool where the arm stands upright, and nothing its position
    upright, position = arm("elbow"), partial_target([0.0, 0.0, 1.0])
    counts, nearby = ranks(upright, np.array([[0.3, np.pi / 2, 0.0]]), position)
    assert (counts.tolist(), nearby) == ([1], 3)


def test_a_heading_goes_on_over_half_a_turn():
    target = partial_target(yaw=np.array([3.1, -3.1, 0.0]), tool_axis="x")
    poses = forward(PLANE, np.array([[-3.1, 0.0], [3.0, 0.1], [3.0, 3.0]]))
    short = 2 * np.pi - 6.2
    assert residuals(target, poses)[:, 0] == pytest.approx([-short, short, 2 * np.pi - 6.0])


def test_an_elevation_is_measured_from_the_plane_in_every_heading():
    """Also where the tool heads along the negative of x, or along y."""
    down, heading = np.array([-1.2, -0.3, 0.0, 0.8]), np.array([0.4, 1.6, 3.0, -2.0])
    x = np.stack([np.cos(down) * np.cos(heading), np.cos(down) * np.sin(heading), np.sin(down)], axis=1)
    poses = np.tile(np.eye(4), (4, 1, 1))
    poses[:, :3, 0] = x
    missed = residuals(partial_target(pitch=np.full(4, 0.1), tool_axis="x"), poses)[:, 0]
    assert missed == pytest.approx(0.1 - down)


@pytest.mark.parametrize("pitch", [[0.1, -1.6], [1.6, 0.1], [-2.0, -2.0]])
def test_the_steepest_pitch_is_the_one_that_is_refused(pitch):
    worst = max(map(abs, pitch))
    with pytest.raises(InputError, match=rf"this one is {worst:g} rad"):
        partial_target(pitch=pitch)
    with pytest.raises(InputError, match="length zero"):
        partial_target(direction=[[1.0, 0, 0], [0, 0, 0]])


@pytest.mark.parametrize(
    "axis", np.vstack([np.eye(3), -np.eye(3), [[0.6, 0.8, 0.0], [-0.48, 0.6, 0.64]]]).tolist()
)
def test_the_opposite_of_an_axis_is_half_a_turn_about_something_across(axis):
    poses = np.tile(np.eye(4), (1, 1, 1))
    poses[:, :3, 2] = axis
    (turn,) = residuals(partial_target(direction=[[-3 * x for x in axis]]), poses)
    assert np.linalg.norm(turn) == pytest.approx(np.pi, abs=1e-12)
    assert abs(turn @ axis) < 1e-12
    (none,) = residuals(partial_target(direction=[axis]), poses)
    assert none.tolist() == [0, 0, 0]


def test_a_height_that_does_not_count_is_left_to_the_arm():
    """The whole orientation and two coordinates of the position are no whole pose."""
    robot, q = arm("UR"), np.array([0.3, -0.9, 1.2, 0.4, 0.8, 1.4])
    pose = forward(robot, q)
    high = pose[:3, 3] + [0.0, 0.0, 7.0]
    found = solve(robot, partial_target(high, fixed=(True, True, False), rotation=pose[:3, :3]), q)
    best = found.joints[int(found.nearest(q))]
    assert best == pytest.approx(q, abs=1e-6)
    assert found.free[int(found.nearest(q))].any()


def test_aims_of_directions_have_length_1():
    aims = partial_target(direction=[[0.0, 3.0, -4.0], [1e-3, 0.0, 0.0]]).aims
    assert aims.tolist() == [[0.0, 0.6, -0.8], [1.0, 0.0, 0.0]]
