"""Names of branches: one physical configuration has one name, however its arm is described.

The oracle is forward kinematics: two tables describe one arm where all their links have the same poses.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tiers import few

from tests.kinematics.inverse.inverse_arms import FAMILIES, arm, gap, random_joints, turning
from trajcli.kinematics.forward import forward, link_poses
from trajcli.kinematics.inverse.solve import solve
from trajcli.kinematics.robot import Joint, Robot, unlimited

H = np.pi / 2
KUKA = [
    (0, 0.675, 0.26, -H),
    (0, 0, 0.68, 0),
    (-H, 0, 0.035, H),
    (0, -0.67, 0, -H),
    (0, 0, 0, H),
    (0, -0.1, 0, 0),
]


def described_otherwise(robot, rng):
    """Return the same arm with other signs and zeros of its joints, and offsets between parallel axes."""
    joints = []
    for joint in robot.joints:
        offset = rng.uniform(-2, 2) if joint.type == "revolute" else rng.uniform(-0.3, 0.3)
        key = "theta" if joint.type == "revolute" else "d"
        joints.append(replace(joint, sign=int(rng.choice([-1, 1])), **{key: getattr(joint, key) + offset}))
    for i in range(len(joints) - 1):
        one, two = joints[i : i + 2]
        if one.alpha == 0.0 and one.type == two.type == "revolute":  # what one has along it the other lacks
            shift = rng.uniform(-0.2, 0.2)
            joints[i], joints[i + 1] = replace(one, d=one.d + shift), replace(two, d=two.d - shift)
    return replace(robot, joints=tuple(joints))


def same_configuration(robot, other, q):
    """Return the joint values with which another table says the same configuration."""
    values = []
    for i, (one, two) in enumerate(zip(robot.joints, other.joints, strict=True)):
        key = "theta" if one.type == "revolute" else "d"
        values.append((getattr(one, key) + one.sign * q[..., i] - getattr(two, key)) / two.sign)
    return np.stack(values, axis=-1)


def names_of(robot, pose, configurations):
    solutions = solve(robot, pose)
    apart = [gap(robot, solutions.joints, q) for q in configurations]
    assert max(each[solutions.valid].min() for each in apart) < 1e-6
    return [str(solutions.names[int(np.where(solutions.valid, each, np.inf).argmin())]) for each in apart]


@pytest.mark.parametrize("family", few([*few(list(FAMILIES)[:-2], 8), *list(FAMILIES)[-2:]], 6))
def test_the_same_configuration_has_the_same_name_in_every_table(family):
    rng = np.random.default_rng(5)
    robot = arm(family)
    for q in random_joints(robot, rng, 6):
        pose = forward(robot, q)
        solutions = solve(robot, pose)
        answers = solutions.joints[solutions.valid]
        expected = [str(name) for name, ok in zip(solutions.names, solutions.valid, strict=True) if ok]
        for _ in range(3):
            other = described_otherwise(robot, rng)
            same = same_configuration(robot, other, answers)
            np.testing.assert_allclose(
                forward(other, same), np.broadcast_to(pose, (len(same), 4, 4)), atol=1e-8
            )
            assert names_of(other, pose, same) == expected


@pytest.mark.parametrize("ceiling", [False, True])
def test_up_is_the_higher_elbow_of_all_signs_and_zeros(ceiling):
    rng = np.random.default_rng(6)
    joints = tuple(Joint(f"a{i}", "revolute", *row) for i, row in enumerate(KUKA))
    base = np.diag([1.0, -1.0, -1.0, 1.0]) if ceiling else np.eye(4)
    plain = Robot("kuka", joints, unlimited(6), "standard", base, np.eye(4))
    for _ in range(40):
        robot = described_otherwise(plain, rng)
        pose = forward(robot, rng.uniform(-3, 3, 6))
        solutions = solve(robot, pose)
        heights = {
            (name.shoulder, name.wrist, name.elbow): link_poses(robot, q)[2][2, 3]
            for name, q, ok in zip(solutions.names, solutions.joints, solutions.valid, strict=True)
            if ok
        }
        for (shoulder, wrist, elbow), height in heights.items():
            if elbow == "up" and (shoulder, wrist, "down") in heights:
                assert height > heights[shoulder, wrist, "down"]
        left = [
            link_poses(robot, q)
            for name, q in zip(solutions.names, solutions.joints, strict=True)
            if name.shoulder == "left"
        ]
        for links in left:  # axis 2 stands on the side of the wrist
            center = pose[:3, 3] + 0.1 * pose[:3, 2]
            assert (links[1][:2, 3] - base[:2, 3]) @ (center - base[:3, 3])[:2] > 0.0


def test_signs_matter_to_the_variants():
    robot = arm("wrist over elbow")
    other = described_otherwise(robot, np.random.default_rng(1))
    assert {joint.sign for joint in other.joints} == {-1, 1}
    assert turning(other).all()
