"""Paths of every kind of target, and joints on them from a root finder that knows forward kinematics alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from trajcli.geometry.paths.arc import Arc
from trajcli.geometry.paths.orientation import AxisAngleOrientation, SegmentProgress
from trajcli.geometry.paths.pose import PoseCurve
from trajcli.geometry.paths.position import Line
from trajcli.job.robot import load_robot
from trajcli.kinematics.following.tool_path import ToolPath
from trajcli.kinematics.forward import forward
from trajcli.kinematics.robot import Robot

XYZ = "xyz"


@dataclass(frozen=True, eq=False)
class Case:
    """An arm at the beginning of a path, and how many directions of its joints the path leaves free."""

    robot: Robot
    start: np.ndarray
    path: ToolPath
    free: int = 0


def case(
    name, start, orientation="all", tool_axis="z", *, free=0, bent=False, turn=(0.2, -0.3, 0.4), move=None
) -> Case:
    """Return a line or an arc from where the arm is, with a rotation that its targets see or not."""
    robot, q = load_robot(name), np.array(start, dtype=float)
    pose = forward(robot, q)
    if name == "planar3r":
        move, turn = (-0.05, 0.04, 0.0), (0, 0, 0.3)
    end = pose[:3, 3] + np.array(move or (0.06, 0.05, -0.04))
    position = Line(pose[:3, 3], end)
    if bent:
        position = Arc.through(pose[:3, 3], (pose[:3, 3] + end) / 2 + [0.01, 0.0, 0.02], end)
    last = Rotation.from_rotvec(turn).as_matrix() @ pose[:3, :3]
    turning = AxisAngleOrientation(np.stack([pose[:3, :3], last]), SegmentProgress.even(position.length))
    poses = PoseCurve(position, turning)
    fixed = (True, True, True)
    turns = (0.35,) if orientation in ("yaw", "pitch") else ()
    return Case(robot, q, ToolPath(poses, fixed, orientation, tool_axis, turns), free)


CASES = {
    "ur5e, pose": case("ur5e", [0.3, -1.2, 1.4, -0.9, -1.3, 0.4]),
    "ur5e, pose on an arc": case("ur5e", [0.3, -1.2, 1.4, -0.9, -1.3, 0.4], bent=True),
    "puma560, pose": case("puma560", [0.2, 0.7, -0.8, 0.4, 0.9, -0.3]),
    "puma560, direction": case("puma560", [0.2, 0.7, -0.8, 0.4, 0.9, -0.3], "direction", free=1),
    "ur5e, direction of x": case("ur5e", [0.3, -1.2, 1.4, -0.9, -1.3, 0.4], "direction", "x", free=1),
    "ur5e, yaw of x": case("ur5e", [0.3, -1.2, 1.4, -0.9, -1.3, 0.4], "yaw", "x", free=2),
    "ur5e, pitch of y": case("ur5e", [0.3, -1.2, 1.4, -0.9, -1.3, 0.4], "pitch", "y", free=2),
    "panda, pose": case("panda", [0.1, -0.5, 0.2, -2.0, 0.1, 1.6, 0.7], free=1),
    "panda, direction": case("panda", [0.1, -0.5, 0.2, -2.0, 0.1, 1.6, 0.7], "direction", free=2),
    "panda, position on an arc": case(
        "panda", [0.1, -0.5, 0.2, -2.0, 0.1, 1.6, 0.7], "none", free=4, bent=True
    ),
    "scorbot, pitch": case("scorbot", [0.1, 0.4, -1.3, 1.2, 0.3], "pitch", free=1),
    "scorbot, position": case("scorbot", [0.1, 0.4, -0.9, 1.2, 0.3], "none", free=2),
    "cobra600, yaw of x": case("cobra600", [0.2, 1.5, 0.1, 0.5], "yaw", "x"),
    "cobra600, position": case("cobra600", [0.2, 1.5, 0.1, 0.5], "none", free=1, bent=True),
    "planar3r, yaw of x": case("planar3r", [0.3, 0.8, 0.4], "yaw", "x"),
    "rrp, position": case("rrp", [0.3, 0.5, 0.3], "none"),
    "cartesian_wrist, pose": case("cartesian_wrist", [0.3, 0.2, 0.4, 0.3, 0.8, -0.5], bent=True),
}


def off(case_, s, joints):
    """Return what is between the tcp of joints (N, n) and its path, (N, m); angles of it, not rates of them."""
    path = case_.path
    wanted, poses = path.poses.evaluate(np.array([s]))[0][0], forward(case_.robot, joints)
    parts = [poses[:, :3, 3] - wanted[:3, 3]]
    k = XYZ.index(path.tool_axis)
    axis, aim = poses[:, :3, k], wanted[:3, k]
    begins = path.poses.evaluate(np.zeros(1))[0][0][:3, k]
    part = s / path.length
    match path.orientation:
        case "all":
            parts.append(Rotation.from_matrix(poses[:, :3, :3] @ wanted[:3, :3].T).as_rotvec())
        case "direction":
            parts.append(axis - aim)
        case "yaw":
            angle = np.arctan2(begins[1], begins[0]) + part * path.angle_changes[0]
            parts.append((np.cos(angle) * axis[:, 1] - np.sin(angle) * axis[:, 0])[:, None])
        case "pitch":
            parts.append((axis[:, 2] - np.sin(np.arcsin(begins[2]) + part * path.angle_changes[0]))[:, None])
    return np.concatenate(parts, axis=1)


def numeric_slopes(case_, s, q, step=1e-6):
    """Return how joints (n,) change that, (m, n), by central differences."""
    both = off(case_, s, q + step * np.concatenate([np.eye(q.size), -np.eye(q.size)]))
    return (both[: q.size] - both[q.size :]).T / (2 * step)


def solved(case_, s, held, near):
    """Return joint values (n,) on the path near others, components along `held` (f, n) as at the start."""

    def equations(q):
        return np.concatenate([off(case_, s, q[None])[0], held @ (q - case_.start)])

    q, missed = near, equations(near)
    for _ in range(12):
        rows = np.concatenate([numeric_slopes(case_, s, q), held])
        q = q - np.linalg.lstsq(rows, missed, rcond=1e-8)[0]
        before, missed = np.abs(missed).max(), equations(q)
        if before < 1e-9:
            break
    assert np.abs(missed).max() < 1e-13
    return q
