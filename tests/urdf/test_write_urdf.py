"""URDF of robots, read by a parser of its own: kinematics, limits, names, shapes."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from independent_reader import ReadBack
from scipy.spatial.transform import Rotation
from tiers import few

from trajcli.catalogue.entries import catalogue_names
from trajcli.cli.app import app
from trajcli.errors import InputError
from trajcli.job.robot import load_robot
from trajcli.kinematics.forward import forward
from trajcli.kinematics.robot import Joint, Limits, Robot, unlimited
from trajcli.urdf.chain import chain_of
from trajcli.urdf.write import UNLIMITED, urdf_of


def random_values(robot: Robot, seed: int, count: int = 20) -> np.ndarray:
    low, high = (np.clip(side, -3, 3) for side in robot.limits.position.T)
    return np.random.default_rng(seed).uniform(low, high, (count, len(robot.joints)))


def random_arm(seed: int, convention: str) -> Robot:
    rng = np.random.default_rng(seed)
    joints = tuple(
        Joint(
            f'j{k} <&">',
            "prismatic" if rng.random() < 0.4 else "revolute",
            *rng.uniform(-1, 1, 3),
            rng.choice([0.0, np.pi / 2, -np.pi / 2, np.pi, 1e-9, rng.uniform(-2, 2)]),
            int(rng.choice([-1, 1])),
        )
        for k in range(6)
    )
    base, tool = np.eye(4), np.eye(4)
    for pose in (base, tool):
        pose[:3, :3], pose[:3, 3] = Rotation.random(rng=rng).as_matrix(), rng.normal(size=3)
    return Robot("ran<dom> & co", joints, unlimited(6), convention, base, tool)


ARMS = [*catalogue_names(), *(f"{kind} {seed}" for kind in ("standard", "modified") for seed in range(5))]


def arm(name: str) -> Robot:
    kind, _, seed = name.partition(" ")
    return random_arm(int(seed), kind) if seed else load_robot(name)


def test_rotors_are_said_in_comments() -> None:
    robot = random_arm(3, "standard")
    joints = (replace(robot.joints[0], rotor=0.25), *robot.joints[1:])
    written = urdf_of(replace(robot, joints=joints))
    unit = "kg" if robot.joints[0].type == "prismatic" else "kg m^2"
    assert written.count("rotor") == 1
    assert f"<!-- rotor: 0.25 {unit}, which the format has no element for -->\n  </joint>" in written
    assert tuple(ReadBack(written).moving) == robot.joint_names
    assert "rotor" not in urdf_of(robot)


@pytest.mark.parametrize("name", few(ARMS, 20))
def test_forward_kinematics_is_that_of_the_table(name: str) -> None:
    robot = arm(name)
    read = ReadBack(urdf_of(robot))
    assert tuple(read.moving) == robot.joint_names
    for q, pose in zip(values := random_values(robot, 1), forward(robot, values), strict=True):
        by_name = dict(zip(robot.joint_names, q, strict=True))
        assert np.abs(read.forward(by_name) - pose).max() <= 1e-12 * max(1, np.abs(pose).max())


@pytest.mark.parametrize("name", few(ARMS, 20))
def test_transforms_are_those_between_the_links_of_the_text(name: str) -> None:
    robot = arm(name)
    read, chain = ReadBack(urdf_of(robot)), chain_of(robot)
    values = random_values(robot, 2, 5)
    translations, quaternions = chain.transforms(values)
    for row, q in enumerate(values):
        by_name = dict(zip(robot.joint_names, q, strict=True))
        for k, (parent, child) in enumerate(zip(chain.links, chain.links[1:], strict=False)):
            wanted = np.linalg.inv(read.forward(by_name, parent)) @ read.forward(by_name, child)
            turned = Rotation.from_quat(np.roll(quaternions[row, k], -1)).as_matrix()
            assert np.abs(wanted[:3, 3] - translations[row, k]).max() <= 1e-11
            assert np.abs(wanted[:3, :3] - turned).max() <= 1e-12
            assert np.linalg.norm(quaternions[row, k]) == pytest.approx(1, abs=1e-14)


def test_frames_go_from_world_over_the_links_to_the_tool() -> None:
    robot = load_robot("ur5e")
    read = ReadBack(urdf_of(robot))
    assert read.links == ["world", "base_link", *(f"link_{k}" for k in range(1, 7)), "tool0"]
    assert set(read.links) - set(read.by_child) == {"world"}
    assert np.abs(read.forward({}, "base_link") - robot.base).max() <= 1e-15


def test_limits_and_directions_are_written() -> None:
    inf = math.inf
    joints = tuple(
        Joint(f"j{k}", kind, sign=sign)
        for k, (kind, sign) in enumerate(
            [("revolute", -1), ("revolute", 1), ("prismatic", -1), ("revolute", 1)]
        )
    )
    bounds = Limits(
        np.array([[-1.5, 2.0], [-inf, inf], [0.1, 0.7], [-1.0, inf]]),
        np.array([[-3.0, 2.0], [-inf, inf], [-0.25, 0.25], [-1.0, 1.0]]),
        *(unlimited(4).of_order(order) for order in (2, 3)),
    )
    read = ReadBack(urdf_of(Robot("arm", joints, bounds, "standard", np.eye(4), np.eye(4))))
    found = {
        name: (
            joint.get("type"),
            joint.find("axis").get("xyz"),
            *(joint.find("limit").get(key) for key in ("lower", "upper", "velocity", "effort")),
        )
        for name, joint in read.moving.items()
    }
    assert found == {
        "j0": ("revolute", "0 0 -1", "-1.5", "2.0", "2.0", "0"),
        "j1": ("continuous", "0 0 1", None, None, repr(UNLIMITED), "0"),
        "j2": ("prismatic", "0 0 -1", "0.1", "0.7", "0.25", "0"),
        "j3": ("revolute", "0 0 1", "-1.0", repr(UNLIMITED), "1.0", "0"),
    }


@pytest.mark.parametrize("name", ["ur5e", "panda", "scorbot", "stanford", "rpr"])
def test_the_shapes_reach_from_joint_to_joint(name: str) -> None:
    """Every joint's frame is an end of a cylinder of the link before it, unless the two frames coincide."""
    read = ReadBack(urdf_of(load_robot(name)))
    elements = {link.get("name"): link for link in read.root.iter("link")}
    for joint in read.moving.values():
        ends = [np.zeros(3)]
        for visual in elements[joint.find("parent").get("link")].iter("visual"):
            cylinder = visual.find("geometry/cylinder")
            if cylinder is not None:
                half = np.array([0, 0, float(cylinder.get("length")) / 2, 0])
                pose = read.pose(visual)
                ends += [pose[:3, 3] + (sign * pose @ half)[:3] for sign in (-1, 1)]
        origin = read.pose(joint)[:3, 3]
        assert min(np.abs(end - origin).max() for end in ends) <= 1e-12


def test_joints_with_the_names_of_fixed_ones_are_told_apart() -> None:
    robot = load_robot("planar2r")
    names = ("base_fixed_joint", "tool_fixed_joint")
    joints = tuple(replace(joint, name=name) for joint, name in zip(robot.joints, names, strict=True))
    joint_names = [j.get("name") for j in ReadBack(urdf_of(replace(robot, joints=joints))).root.iter("joint")]
    assert len(set(joint_names)) == len(joint_names) == 4


def test_a_robot_without_geometry_or_with_unwritable_names_is_refused() -> None:
    bare = Robot("bare", (Joint("a"),), unlimited(1), None, np.eye(4), np.eye(4))
    with pytest.raises(InputError, match="no geometry"):
        urdf_of(bare)
    with pytest.raises(InputError, match="XML"):
        urdf_of(replace(bare, convention="standard", joints=(Joint("a\x00"),)))


def test_robots_prints_it(capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match=r"^0$"):
        app(["robots", "ur5e", "--urdf"])
    assert capfd.readouterr().out == urdf_of(load_robot("ur5e"))
    for words in (["--urdf"], ["ur5e", "--urdf", "--json"], ["ur5e", "--urdf", "--yaml"]):
        with pytest.raises(SystemExit, match=r"^2$"):
            app(["robots", *words])
        assert "--urdf" in capfd.readouterr().err
