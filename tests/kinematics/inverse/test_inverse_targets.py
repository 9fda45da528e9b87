from __future__ import annotations

import numpy as np
import pytest
from inverse_arms import arm, gap, random_joints
from scipy.spatial.transform import Rotation

from trajcli.errors import InputError
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.solve import solve
from trajcli.kinematics.inverse.target import (
    closure_of,
    meeting,
    partial_target,
    pose_target,
    residual_jacobian,
    residuals,
)
from trajcli.kinematics.jacobian import jacobian

RNG = np.random.default_rng(5)


def kinds():
    rotations = Rotation.random(4, rng=RNG).as_matrix()
    position = RNG.normal(size=(4, 3))
    return [
        partial_target(position),
        partial_target(position, fixed=(True, False, True)),
        partial_target(position, rotation=rotations),
        partial_target(position, direction=rotations[:, 0], tool_axis="x"),
        partial_target(position, yaw=[0.1, 3.0, -2.0, 1.0], tool_axis="y"),
        partial_target(pitch=[0.1, 1.2, -1.0, 0.0]),
    ]


@pytest.mark.parametrize("target", kinds(), ids=lambda target: f"{target.orientation}-{target.coordinates}")
def test_residuals_change_as_their_jacobian_says(target):
    robot, step = arm("wrist over elbow", np.random.default_rng(1)), 1e-6
    joints = random_joints(robot, RNG, 4)
    poses = forward(robot, joints)
    slopes = residual_jacobian(target, poses, jacobian(robot, joints))
    rate = RNG.normal(size=joints.shape)
    if target.orientation in ("all", "direction"):  # first order only where the target is met
        near = poses if target.orientation == "all" else poses[:, :3, "xyz".index(target.tool_axis)]
        options = {"rotation": near[:, :3, :3]} if target.orientation == "all" else {"direction": near}
        target = partial_target(target.poses[:, :3, 3], tool_axis=target.tool_axis, **options)
    before, after = (residuals(target, forward(robot, joints + sign * step * rate)) for sign in (-1.0, 1.0))
    expected = np.einsum("kmn,kn->km", slopes, rate)
    assert (before - after) / (2 * step) == pytest.approx(expected, abs=2e-8)


@pytest.mark.parametrize("target", kinds(), ids=lambda target: f"{target.orientation}-{target.coordinates}")
def test_poses_that_are_made_to_meet_a_target_turn_no_further_than_they_must(target):
    poses = np.tile(np.eye(4), (4, 1, 1))
    poses[:, :3, :3], poses[:, :3, 3] = Rotation.random(4, rng=RNG).as_matrix(), RNG.normal(size=(4, 3))
    met = meeting(target, poses)
    assert residuals(target, met) == pytest.approx(0.0, abs=1e-12)
    turned = Rotation.from_matrix(met[:, :3, :3] @ poses[:, :3, :3].swapaxes(1, 2)).magnitude()
    needed = np.linalg.norm(residuals(target, poses)[:, sum(target.position) :], axis=1)
    assert turned == pytest.approx(needed, abs=1e-7)
    free = ~np.array(target.position)
    assert met[:, :3, 3][:, free] == pytest.approx(poses[:, :3, 3][:, free])


def test_closure_counts_only_what_is_fixed():
    pose = np.eye(4)
    pose[:3, 3] = 0.3, 0.4, 9.0
    flat = partial_target(np.zeros((1, 3)), fixed=(True, True, False))
    assert closure_of(flat, pose[None]) == pytest.approx(np.array([[0.5, 0.0]]))
    turned = partial_target(direction=[[1.0, 0.0, 0.0]])
    assert closure_of(turned, pose[None]) == pytest.approx(np.array([[0.0, np.pi / 2]]))
    opposite = partial_target(direction=[[0.0, 0.0, -2.0]])
    assert closure_of(opposite, pose[None]) == pytest.approx(np.array([[0.0, np.pi]]))


def answered(robot, target, joints, near=None):
    found = solve(robot, target, near)
    poses = forward(robot, found.joints[found.valid])
    flat = target.flat()
    rows = np.nonzero(found.valid)[0]
    assert closure_of(flat.rows(rows), poses).max() < 1e-9
    return np.where(found.valid, gap(robot, found.joints, joints[:, None]), np.inf).min(axis=1)


def test_a_direction_is_enough_for_an_arm_of_five_joints():
    robot = arm("elbow, pitch and roll")
    joints = random_joints(robot, RNG, 5)
    poses = forward(robot, joints)
    target = partial_target(poses[:, :3, 3], direction=poses[:, :3, 0], tool_axis="x")
    assert answered(robot, target, joints).max() < 1e-6


def test_a_pitch_is_enough_for_an_arm_of_four_joints_and_a_yaw_for_a_scara():
    robot = arm("elbow and pitch")
    joints = random_joints(robot, RNG, 5)
    poses = forward(robot, joints)
    target = partial_target(poses[:, :3, 3], pitch=np.arcsin(poses[:, 2, 0]), tool_axis="x")
    assert answered(robot, target, joints).max() < 1e-6
    robot = arm("SCARA")
    joints = random_joints(robot, RNG, 5)
    poses = forward(robot, joints)
    target = partial_target(poses[:, :3, 3], yaw=np.arctan2(poses[:, 1, 0], poses[:, 0, 0]), tool_axis="x")
    assert answered(robot, target, joints).max() < 1e-6
    assert (solve(robot, target).count == 2).all()


def test_positions_use_the_closed_form_of_three_joints():
    robot = arm("elbow with offsets", np.random.default_rng(2))
    joints = random_joints(robot, RNG, 20)
    position = forward(robot, joints)[:, :3, 3]
    found = solve(robot, partial_target(position))
    assert found.method.family == "positioning"
    assert answered(robot, partial_target(position), joints).max() < 1e-6


def test_a_six_axis_arm_takes_the_answer_to_a_position_nearest_to_where_it_is():
    robot = arm("wrist over elbow")
    near = np.array([0.3, 0.5, 0.8, 0.4, 0.6, 0.2])
    position = forward(robot, near)[:3, 3] + [0.01, 0.0, 0.0]
    found = solve(robot, partial_target(position), near)
    best = found.joints[int(found.nearest(near))]
    assert found.method.family == "spherical wrist"
    assert not found.singular.any()
    assert forward(robot, best)[:3, 3] == pytest.approx(position, abs=1e-9)
    linear = jacobian(robot, best)[:3]
    kernel = np.linalg.svd(linear)[2][3:]
    assert np.abs(kernel @ (near - best)).max() < 1e-6  # what is left of the gap is no self-motion


def test_malformed_targets_are_refused():
    with pytest.raises(InputError, match="4x4"):
        pose_target(np.eye(3))
    with pytest.raises(InputError, match="fixes nothing"):
        partial_target()
    with pytest.raises(InputError, match="length zero"):
        partial_target(direction=[0, 0, 0])
    with pytest.raises(InputError, match="within pi/2"):
        partial_target(pitch=2.0)
    with pytest.raises(InputError, match="not yaw and pitch"):
        partial_target(yaw=1.0, pitch=1.0)
    with pytest.raises(InputError, match="not finite"):
        partial_target([np.nan, 0, 0])
    with pytest.raises(InputError, match="3 coordinates"):
        partial_target([1.0, 2.0])
