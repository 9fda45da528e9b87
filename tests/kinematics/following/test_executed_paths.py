"""Paths as the tool follows them: turns that targets leave free, and joints that are pinned beside a pose."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from followed_paths import CASES, Case, case, off
from scipy.spatial.transform import Rotation

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.errors import PlanningError
from trajcli.kinematics.following.follower import ExecutedPoses, Follower, LostError, follower, with_pinned
from trajcli.kinematics.following.tool_path import ToolPath
from trajcli.kinematics.forward import forward

STENCIL = np.array([[-1, 9, -45, 0, 45, -9, 1], [2, -27, 270, -490, 270, -27, 2]]) / [[60], [180]]
SMALL = {"move": (0.02, 0.015, -0.01), "turn": (0.05, -0.07, 0.1)}
FREE = {
    "puma560, direction": case("puma560", [0.2, 0.7, -0.8, 0.4, 0.9, -0.3], "direction", free=1, **SMALL),  # type: ignore[arg-type]
    "ur5e, position": case("ur5e", [0.3, -1.2, 1.4, -0.9, -1.3, 0.4], "none", free=3, bent=True, **SMALL),  # type: ignore[arg-type]
}


def followed(made: Case) -> Follower:
    return follower(made.robot, made.path.at_s, made.start, 0.0)


def line(first: np.ndarray, last: np.ndarray, length: float) -> PiecewisePolynomial:
    """Return joints that go evenly from values to others."""
    return PiecewisePolynomial(np.array([0.0, length]), np.stack([(last - first) / length, first])[:, None])


def executed(made: Case, poses: Any = None) -> ExecutedPoses:
    path = made.path if poses is None else replace(made.path, poses=poses)
    arm = replace(followed(made), reference_at=path.at_s)
    coarse = line(made.start, made.start, path.length)
    return ExecutedPoses(path.poses, arm, coarse)


@pytest.mark.parametrize("name", FREE)
def test_the_tool_turns_as_its_joints_turn_it_and_goes_where_its_path_does(name: str) -> None:
    """Against forward kinematics of the joints and differences of its rotations."""
    made = FREE[name]
    executed_poses, length = executed(made), made.path.length
    step = 0.03 * length
    s = 0.5 * length + step * np.arange(-3, 4)
    joints = executed_poses.follower.exact(s, "right", np.tile(made.start, (7, 1)))[0]
    poses, first, second = executed_poses.evaluate(s)
    wanted = made.path.poses.evaluate(s)
    np.testing.assert_allclose(poses, forward(made.robot, joints), rtol=0, atol=1e-9)
    for ours, theirs in ((poses[:, :3, 3], wanted[0][:, :3, 3]), (first[:, :3], wanted[1][:, :3])):
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-9)
    rotations = Rotation.from_matrix(poses[:, :3, :3])
    turned = (rotations * rotations[3].inv()).as_rotvec()
    scale = 1.0 + np.abs(second).max()
    np.testing.assert_allclose(first[3, 3:], STENCIL[0] @ turned / step, rtol=0, atol=1e-5 * scale)
    np.testing.assert_allclose(second[3, 3:], STENCIL[1] @ turned / step**2, rtol=0, atol=1e-4 * scale)
    assert np.abs(first[3, 3:] - wanted[1][3, 3:]).max() > 0.1, "its path does not say how it turns"
    end = np.array([np.nextafter(length, 1.0)])
    np.testing.assert_allclose(executed_poses.evaluate(end)[0][0, :3, 3], wanted[0][0, :3, 3], atol=0.05)


class Kinked:
    """Poses that are left twice as fast as they are reached, wherever one looks."""

    def __init__(self, poses: Any) -> None:
        self._poses, self.length, self.breaks = poses, poses.length, poses.breaks

    def evaluate(self, s: np.ndarray, side: str = "right") -> tuple[np.ndarray, ...]:
        pose, first, second = self._poses.evaluate(s, side)
        return pose, first * (2.0 if side == "right" else 1.0), second


@pytest.mark.parametrize("name", FREE)
def test_both_sides_of_a_break_are_told_apart(name: str) -> None:
    kinked = executed(FREE[name], Kinked(FREE[name].path.poses))
    s = np.array([0.4 * kinked.length])
    left, right = (kinked.evaluate(s, side)[1] for side in ("left", "right"))  # type: ignore[arg-type]
    np.testing.assert_allclose(right, 2.0 * left, rtol=1e-9, atol=1e-12)


def test_what_is_not_of_the_turn_is_that_of_the_path() -> None:
    made = CASES["ur5e, direction of x"]
    wanted = SimpleNamespace(
        length=3.0, pure_rotation=True, breaks=np.array([1.0]), stops=np.array([2.0]), jumps=np.array([0.5])
    )
    wanted.majorants = lambda s, rising: (7.0 * rising, rising)
    poses = ExecutedPoses(wanted, followed(made), line(made.start, made.start, 3.0))  # type: ignore[arg-type]
    assert (poses.length, poses.pure_rotation) == (3.0, True)
    assert (poses.breaks.tolist(), poses.stops.tolist(), poses.jumps.tolist()) == ([1.0], [2.0], [0.5])
    of_position, of_rotation = poses.majorants(np.zeros(1), np.ones((2, 3)))
    assert (of_position == 7.0).all()
    assert np.isinf(of_rotation).all()


@pytest.mark.parametrize("name", ["puma560, direction", "ur5e, direction of x", "panda, direction"])
def test_the_hand_of_a_direction_is_told_all_along_its_path(name: str) -> None:
    made = CASES[name]
    arm, q = followed(made), made.start
    for at in np.linspace(0.0, made.path.length, 9):
        q = arm.exact(np.array([at]), "right", q[None])[0, 0]
    other = replace(arm, aspect=replace(arm.aspect, sign=-arm.aspect.sign))
    with pytest.raises(LostError):
        other.exact(np.array([made.path.length]), "right", q[None])


PINS = {"panda, pose": {0: 0.25}, "panda, direction": {2: 0.1, 6: 0.9}}


@pytest.mark.parametrize("name", PINS)
def test_a_pinned_joint_goes_evenly_and_the_others_bring_the_tool_along(name: str) -> None:
    made = CASES[name]
    path = with_pinned(made.path, PINS[name], made.start, made.robot)
    arm, length = follower(made.robot, path.at_s, made.start, 0.0), made.path.length
    step = 0.02 * length
    s = 0.4 * length + step * np.arange(-3, 4)
    near, rows = made.start, []
    for at in (0.1 * length, 0.2 * length, 0.3 * length, *s):
        near = arm.exact(np.array([at]), "right", near[None])[0, 0]
        rows.append(near)
    exact = arm.exact(s, "right", np.array(rows[-7:]) + 1e-3)
    for at, q in zip(s, exact[0], strict=True):
        assert np.abs(off(made, at, q[None])).max() < 1e-9
        for joint, last in PINS[name].items():
            assert q[joint] == pytest.approx(
                made.start[joint] + at / length * (last - made.start[joint]), abs=1e-11
            )
    for order in (1, 2):
        scale = np.abs(exact[order]).max() + 1
        expected = STENCIL[order - 1] @ exact[0] / step**order
        np.testing.assert_allclose(exact[order][3], expected, rtol=0, atol=3e-5 * scale)
    joint, last = next(iter(PINS[name].items()))
    assert exact[1, :, joint] == pytest.approx((last - made.start[joint]) / length, abs=1e-9)
    assert exact[2, :, joint] == pytest.approx(0.0, abs=1e-8)


def test_no_more_joints_are_pinned_than_the_pose_leaves() -> None:
    panda, ur5e = CASES["panda, pose"], CASES["ur5e, pose"]
    names = panda.robot.joint_names
    with pytest.raises(PlanningError) as caught:
        with_pinned(panda.path, {0: 0.2, 3: -2.0}, panda.start, panda.robot)
    said = f"2 joints cannot be pinned ({names[0]}, {names[3]}): the pose leaves 1 of 7 joints of "
    assert str(caught.value).startswith(said)
    with pytest.raises(PlanningError) as caught:
        with_pinned(ur5e.path, {1: -1.0}, ur5e.start, ur5e.robot)
    said = f"1 joint cannot be pinned ({ur5e.robot.joint_names[1]}): the pose leaves 0 of 6 joints of "
    assert str(caught.value).startswith(said)


def test_along_no_length_a_pinned_joint_goes_nowhere() -> None:
    made = CASES["panda, pose"]
    path: ToolPath = SimpleNamespace(length=0.0)  # type: ignore[assignment]
    there = {0: float(made.start[0]), 3: float(made.start[3])}
    assert with_pinned(path, there, made.start, made.robot) is path
    with pytest.raises(PlanningError, match="cannot go evenly along a path of no length") as caught:
        with_pinned(path, {**there, 3: 0.5}, made.start, made.robot)
    assert made.robot.joint_names[3] in str(caught.value)
