"""The arms of tests/oracles as Robot values, and their kinematics by screw exponentials, written independently."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
from scipy.linalg import expm
from scipy.spatial.transform import Rotation
from yaml_files import read_yaml

from trajcli.kinematics.robot import Joint, Robot, unlimited

ORACLES = Path(__file__).parents[1] / "oracles"
TYPES = {"R": "revolute", "P": "prismatic"}


@cache
def load(name, key):
    return read_yaml(ORACLES / name)[key]


def robots():
    return load("robots.yaml", "robots")


def robot_of(table, name="arm"):
    """Return the Robot of a mapping with dh, convention, base?, tool?."""
    joints = tuple(
        Joint(
            f"j{i + 1}",
            TYPES[row["type"]],
            row["theta"],
            row["d"],
            row["a"],
            row["alpha"],
            row.get("sign", 1),
        )
        for i, row in enumerate(table["dh"])
    )
    convention = {"std": "standard", "mdh": "modified"}[table["convention"]]
    base, tool = (np.array(table.get(key, np.eye(4)), dtype=float) for key in ("base", "tool"))
    return Robot(name, joints, unlimited(len(joints)), convention, base, tool)


def tables(robot):
    """Return the robot's tables: the first, the other convention's, a second source's."""
    return [
        robot[key] if key else robot
        for key in ("", "other_convention", "second_table")
        if key in robot or not key
    ]


def random_arm(rng, joints, convention):
    """Return an arm with arbitrary angles and lengths, mixed joint types and signs, base and tool."""
    rows = [
        Joint(
            f"j{i + 1}",
            "prismatic" if rng.random() < 0.3 else "revolute",
            *rng.uniform(-1, 1, 3),
            rng.choice([0.0, np.pi / 2, -np.pi / 2, np.pi, 1e-9, rng.uniform(-2, 2)]),
            int(rng.choice([-1, 1])),
        )
        for i in range(joints)
    ]
    base, tool = np.eye(4), np.eye(4)
    for pose in (base, tool):
        pose[:3, :3], pose[:3, 3] = Rotation.random(rng=rng).as_matrix(), rng.normal(size=3)
    return Robot("random", tuple(rows), unlimited(joints), convention, base, tool)


def screws(robot):
    """Return the joints' screws (n, 4, 4) in world and the pose of the tcp, both at q = 0.

    The frames come from products of elementary 4x4 matrices, row by row.
    """
    frame, generators = np.array(robot.base), []
    for joint in robot.joints:
        about_x = _step("x", joint.alpha, joint.a)
        if robot.convention == "modified":
            frame = frame @ about_x
        axis, point = joint.sign * frame[:3, 2], frame[:3, 3]
        generators.append(
            generator(axis, np.zeros(3))
            if joint.type == "prismatic"
            else generator(np.cross(point, axis), axis)
        )
        frame = frame @ _step("z", joint.theta, joint.d)
        if robot.convention == "standard":
            frame = frame @ about_x
    return np.array(generators), frame @ robot.tool


def chain_screws(chain):
    """Return the same from a chain of fixed transforms and axes, as URDF files have it."""
    frame, generators = np.eye(4), []
    for joint in chain:
        step = np.eye(4)
        step[:3, :3], step[:3, 3] = Rotation.from_euler("xyz", joint["rpy"]).as_matrix(), joint["xyz"]
        frame = frame @ step
        axis = frame[:3, :3] @ joint["axis"]
        if joint["type"] == "prismatic":
            generators.append(generator(axis, np.zeros(3)))
        elif joint["type"] != "fixed":
            generators.append(generator(np.cross(frame[:3, 3], axis), axis))
    return np.array(generators), frame


def exponentials(generators, home, q):
    """Return exp(S1 q1) ... exp(Sn qn) home for q (N, n), shape (N, 4, 4)."""
    result = np.eye(4)
    for i, screw in enumerate(generators):
        result = result @ expm(screw * q[:, i, None, None])
    return result @ home


def generator(linear, angular):
    x, y, z = angular
    return np.array([[0, -z, y, linear[0]], [z, 0, -x, linear[1]], [-y, x, 0, linear[2]], [0, 0, 0, 0]])


def _step(axis, angle, distance):
    step, k = np.eye(4), "xyz".index(axis)
    step[:3, :3], step[k, 3] = Rotation.from_rotvec(angle * np.eye(3)[k]).as_matrix(), distance
    return step
