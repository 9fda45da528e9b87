"""The closed form as it runs: blocks and threads that no pose may learn of, and the check of its residuals."""

from __future__ import annotations

import os
import threading
from dataclasses import replace

import numpy as np
import pytest
from conventions import in_convention
from inverse_arms import FAMILIES, arm, gap, random_joints, turning
from scipy.spatial.transform import Rotation

from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.families import method as closed_form
from trajcli.kinematics.inverse.families.choose import method_for
from trajcli.kinematics.inverse.families.method import candidates
from trajcli.kinematics.inverse.families.screw_axes import axis_geometry
from trajcli.kinematics.inverse.joint_turns import choose_turns
from trajcli.kinematics.inverse.solve import solve

COUNT = 40_000  # six blocks and a part of one


@pytest.mark.parametrize("name", ["wrist over elbow", "UR"])
def test_a_large_batch_has_the_answers_of_its_parts_to_the_last_bit(name, monkeypatch):
    monkeypatch.setattr(os, "cpu_count", lambda: 3)
    started = []
    start = threading.Thread.start
    monkeypatch.setattr(threading.Thread, "start", lambda thread: (started.append(thread), start(thread)))
    rng = np.random.default_rng(7)
    robot = arm(name, rng)
    joints = random_joints(robot, rng, COUNT)
    poses = forward(robot, joints)
    whole = solve(robot, poses)
    count = len(started)
    assert 1 <= count <= 2  # three would have less than three blocks each
    there = np.where(whole.valid, gap(robot, whole.joints, joints[:, None]), np.inf).min(axis=1)
    assert there.max() < 1e-6
    off = np.abs(forward(robot, whole.joints) - poses[:, None]).max(axis=(-2, -1))
    assert off[whole.valid].max() < 1e-10
    monkeypatch.setattr(os, "cpu_count", lambda: 1)
    for part in (slice(0, COUNT), slice(6240, 6263), slice(6250, 6251), slice(COUNT - 999, COUNT)):
        some = solve(robot, poses[part])
        for all_of_them, these in ((whole.joints, some.joints), (whole.closure, some.closure)):
            assert all_of_them[part].tobytes() == these.tobytes()
        assert (whole.valid[part] == some.valid).all()
    assert len(started) == count


def test_what_fails_in_a_thread_is_raised(monkeypatch):
    monkeypatch.setattr(os, "cpu_count", lambda: 2)
    robot = arm("UR")
    poses = forward(robot, np.ones((COUNT, 6)))

    def fail(*_):
        raise ZeroDivisionError("in a block")

    monkeypatch.setattr(closed_form, "_write", fail)
    with pytest.raises(ZeroDivisionError, match="in a block"):
        solve(robot, poses)


def gaps_by_peer(robot, joints, poses):
    """Return metres and radians between poses (N, 4, 4) and those of joints (n, branches, N)."""
    reached = forward(robot, np.moveaxis(joints, 0, -1))
    away = np.linalg.norm(reached[..., :3, 3] - poses[:, :3, 3], axis=-1)
    rest = np.swapaxes(reached[..., :3, :3], -1, -2) @ poses[:, :3, :3]
    return away, Rotation.from_matrix(rest.reshape(-1, 3, 3)).magnitude().reshape(away.shape)


@pytest.mark.parametrize("name", FAMILIES)
@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_gaps_are_distances_and_bound_angles_also_where_a_pose_is_out_of_reach(name, convention):
    rng = np.random.default_rng(11)
    robot = in_convention(arm(name, rng), convention)
    if convention == "modified":
        first = replace(robot.joints[0], a=0.07, alpha=0.4)
        robot = replace(robot, joints=(first, *robot.joints[1:]))
    poses = forward(robot, random_joints(robot, rng, 40))
    poses[20:, :3, 3] *= 1.5
    found = candidates(robot, axis_geometry(robot), method_for(robot), poses)
    assert np.abs(found.joints[turning(robot)]).max(initial=0.0) <= np.pi
    metres, radians = gaps_by_peer(robot, found.joints, poses)
    assert found.residuals[0] == pytest.approx(metres, abs=1e-11)
    chord = 2.0 * np.sin(radians / 2.0)  # x and z are apart by between one and the root of two of these
    assert (found.residuals[1] >= chord - 1e-7).all()
    assert (found.residuals[1] <= np.sqrt(2.0) * chord + 1e-7).all()


@pytest.mark.parametrize("signs", [False, True])
def test_an_aligned_wrist_is_met_by_the_closed_form_itself(signs):
    rng = np.random.default_rng(3)
    robot = arm("wrist over elbow", rng if signs else None)
    joints = random_joints(robot, rng, 30)
    joints[:, 4] = 0.0
    poses = forward(robot, joints)
    found = candidates(robot, axis_geometry(robot), method_for(robot), poses)
    away = np.angle(np.exp(1j * (found.joints[:3] - joints.T[:3, None])))
    same_base = np.abs(away).max(axis=0) < 1e-6
    assert (same_base.sum(axis=0) == 2).all()
    metres, radians = gaps_by_peer(robot, found.joints, poses)
    assert np.maximum(metres, radians)[same_base].max() < 1e-6
    assert found.degenerate.all()


@pytest.mark.parametrize(("value", "bounds"), [(3.0, [-4.0, 2.0]), (-3.0, [-2.0, 4.0]), (4.0, [-9.0, 9.0])])
def test_a_turn_is_taken_back_on_either_side(value, bounds):
    robot = arm("planar 2R", limits=[bounds, bounds])
    joints = np.full((2, 2, 3), value)
    choose_turns(robot, joints, None)
    assert joints == pytest.approx(value - np.copysign(2.0 * np.pi, value))


@pytest.mark.parametrize("scale", [1e-3, 1e3])
@pytest.mark.parametrize("beside", [3e-9, 3e-8])
@pytest.mark.parametrize("name", ["elbow", "wrist over elbow", "SCARA"])
def test_what_is_degenerate_does_not_depend_on_the_unit_of_lengths(name, beside, scale):
    """A point beside the axis of the shoulder or the elbow counts as on it by the length of the arm."""
    robot = arm(name)
    rows = [replace(joint, a=scale * joint.a, d=scale * joint.d) for joint in robot.joints]
    large = replace(robot, joints=tuple(rows))
    q = random_joints(robot, np.random.default_rng(4), 8)
    poses = forward(robot, q)
    hub = forward(robot, np.zeros(len(rows)))[:3, 3] * [0.0, 0.0, 1.0]
    poses[:4, :3, 3] = hub + beside * axis_geometry(robot).length * np.eye(3)[0]
    if name == "wrist over elbow":  # its centre stands over the first axis
        tip = [0.02, 0.0, 0.1]
        poses[:4, :3, 3] += np.einsum("kij,j->ki", poses[:4, :3, :3], tip)
    moved = poses.copy()
    moved[:, :3, 3] *= scale
    found = [
        candidates(each, axis_geometry(each), method_for(each), at)
        for each, at in ((robot, poses), (large, moved))
    ]
    assert found[0].degenerate.tolist() == found[1].degenerate.tolist()
    assert found[0].degenerate[:4].all() == (beside < 1e-8)
    assert not found[0].degenerate[4:].any()


def test_a_method_without_a_closed_form_is_refused():
    robot = arm("UR")
    none = replace(method_for(robot), solve=None)
    with pytest.raises(ValueError, match="has no closed form"):
        candidates(robot, axis_geometry(robot), none, forward(robot, np.ones((2, 6))))
