"""Robots of URDFs against pinocchio, an independent reader, and what they were written from."""

from __future__ import annotations

import json
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from independent_reader import ReadBack
from scipy.spatial.transform import Rotation
from tiers import few

from trajcli.catalogue.entries import catalogue_names
from trajcli.job.robot import load_robot
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.families.choose import method_for
from trajcli.kinematics.jacobian import jacobian
from trajcli.kinematics.robot import Joint, Robot, unlimited
from trajcli.urdf.serial_robot import UrdfRobot, robot_of_urdf
from trajcli.urdf.write import urdf_of

MODELS = Path(__file__).parent / "models"
ORACLE = json.loads((Path(__file__).parents[1] / "oracles/urdf_poses.json").read_text(encoding="utf-8"))
PACKAGES = os.environ.get("TRAJCLI_URDF_PACKAGES")
"""Folder with the packages that the oracle names: pip install --no-deps --target FOLDER NAME=VERSION ..."""

COMPARED = [entry for entry in ORACLE["robots"] if entry["package"] is None or PACKAGES is not None]
"""The vendored arms, and those of the packages where these are there."""


def read(text: str | bytes, **options: object) -> UrdfRobot:
    data = text.encode() if isinstance(text, str) else text
    return robot_of_urdf(data, "arm.urdf", **options)  # type: ignore[arg-type]


def model(name: str, **options: object) -> UrdfRobot:
    return read((MODELS / f"{name}.urdf").read_bytes(), **options)


@pytest.mark.parametrize("entry", COMPARED, ids=lambda entry: Path(entry["file"]).stem)
def test_poses_are_those_of_pinocchio(entry: dict) -> None:
    folder = MODELS if entry["package"] is None else Path(PACKAGES or "")
    data = (folder / entry["file"]).read_bytes()
    wanted = np.reshape(entry["poses"], (-1, 3, 4))
    snapped, exact = read(data), read(data, exact=True)
    assert list(snapped.robot.joint_names) == entry["joints"]
    assert (snapped.root, snapped.tip) == (entry["root"], entry["tip"])
    off = {
        name: forward(each.robot, entry["q"])[:, :3] - wanted
        for name, each in (("snapped", snapped), ("exact", exact))
    }
    assert np.abs(off["exact"]).max() <= 1e-12
    moved = np.linalg.norm(off["snapped"][:, :, 3], axis=1).max()
    assert moved <= snapped.distance + 1e-12
    assert snapped.distance <= 1e-4  # what these files write is off by no more
    turned = Rotation.from_matrix((forward(snapped.robot, entry["q"])[:, :3, :3]).swapaxes(1, 2))
    assert (turned * Rotation.from_matrix(wanted[:, :, :3])).magnitude().max() <= snapped.turn + 1e-12
    assert not exact.snapped
    assert exact.distance == 0.0


def test_enough_arms_are_compared() -> None:
    assert len(ORACLE["robots"]) >= 25
    assert [entry["file"] for entry in ORACLE["robots"] if entry["package"] is None] == [
        f"{name}.urdf" for name in ("ur5", "panda", "xarm7", "kr16_2", "iiwa14", "so101")
    ]


@pytest.mark.parametrize("entry", ORACLE["robots"][:6], ids=lambda entry: Path(entry["file"]).stem)
def test_the_mass_matrix_of_the_links_is_that_of_pinocchio(entry: dict) -> None:
    """M = sum J' diag(m, I) J over the links, J the Jacobian of each centre of mass."""
    robot = model(Path(entry["file"]).stem, exact=True).robot
    q = np.array(entry["q"][0])
    total = np.zeros((len(q), len(q)))
    for k, joint in enumerate(robot.joints, 1):
        if joint.link is None:
            continue
        center = np.eye(4)
        center[:3, 3] = joint.link.com
        bounds = unlimited(k)
        part = Robot("part", robot.joints[:k], bounds, "standard", robot.base, center)
        turn = forward(part, q[:k])[:3, :3]
        xx, yy, zz, xy, xz, yz = joint.link.inertia
        tensor = turn @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ turn.T
        linear, angular = np.split(jacobian(part, q[:k]), 2)
        total[:k, :k] += joint.link.mass * linear.T @ linear + angular.T @ tensor @ angular
    assert np.abs(total - entry["mass_matrix"]).max() <= 1e-10 * max(1.0, np.abs(total).max())


@pytest.mark.parametrize(
    ("name", "family"),
    [
        ("ur5", "three parallel axes"),
        ("kr16_2", "spherical wrist"),
        ("so101", "elbow"),
        ("panda", "joint 7 held"),
    ],
)
def test_closed_forms_are_recognised(name: str, family: str) -> None:
    robot = model(name).robot
    method = method_for(robot)
    assert method.name.startswith(family)


def test_the_table_of_a_ur5_is_the_published_one() -> None:
    """Universal Robots publish d1 89.159, a2 425, a3 392.25, d4 109.15, d5 94.65, d6 82.3 mm."""
    joints = model("ur5").robot.joints
    assert [joint.d for joint in joints] == pytest.approx(
        [0.089159, 0, 0, 0.10915, 0.09465, 0.0823], abs=1e-15
    )
    assert [joint.a for joint in joints] == pytest.approx([0, 0.425, 0.39225, 0, 0, 0], abs=1e-15)
    assert np.array_equal(model("ur5").robot.base, np.eye(4))
    assert np.array_equal(model("ur5").robot.tool, np.eye(4))


@pytest.mark.parametrize("name", few(catalogue_names(), 20))
@pytest.mark.parametrize("exact", [False, True])
def test_out_and_in_is_the_same_robot(name: str, exact: bool) -> None:
    robot = load_robot(name)
    back = read(urdf_of(robot), exact=exact)
    assert not back.snapped
    assert (back.root, back.tip) == ("world", "tool0")
    assert back.robot.joint_names == robot.joint_names
    assert back.robot.joint_types == robot.joint_types
    low, high = (np.clip(side, -3, 3) for side in robot.limits.position.T)
    q = np.random.default_rng(5).uniform(low, high, (20, len(low)))
    assert np.abs(forward(back.robot, q) - forward(robot, q)).max() <= 1e-12
    assert np.array_equal(back.robot.limits.position, robot.limits.position)
    slower = np.abs(robot.limits.velocity).min(axis=1)
    assert np.array_equal(back.robot.limits.velocity[:, 1], slower)
    assert method_for(back.robot).name == method_for(robot).name


def chain_text(rng: np.random.Generator, joints: int, angles: str) -> str:
    """Return a URDF with joints of random origins and axes; `angles` says how they lie."""
    lines = ['<robot name="random"><link name="l0"/>']
    for k in range(1, joints + 1):
        kind = rng.choice(["revolute", "prismatic", "continuous", "fixed"], p=[0.5, 0.2, 0.1, 0.2])
        rpy = rng.uniform(-3, 3, 3) if angles == "any" else rng.integers(-2, 3, 3) * np.pi / 2
        axis = rng.normal(size=3) if angles == "any" else np.eye(3)[rng.integers(3)] * rng.choice([-2.0, 1.0])
        if angles == "almost right":
            rpy = rpy + rng.choice([0.0, 1.0], 3) * 10.0 ** rng.uniform(-13, -3.1, 3)
        xyz = rng.uniform(-0.5, 0.5, 3) * rng.choice([0, 1], 3)
        say = lambda values: " ".join(repr(float(value)) for value in values)  # noqa: E731
        lines.append(
            f'<joint name="j{k}" type="{kind}"><parent link="l{k - 1}"/><child link="l{k}"/>'
            f'<origin xyz="{say(xyz)}" rpy="{say(rpy)}"/><axis xyz="{say(axis)}"/>'
            f'<limit lower="-2" upper="2" velocity="1" effort="1"/></joint><link name="l{k}"/>'
        )
    return "\n".join([*lines, "</robot>"])


@pytest.mark.parametrize("angles", ["any", "right", "almost right"])
@pytest.mark.parametrize("seed", few(range(40), 14))
def test_any_chain_has_a_table(angles: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    count = int(rng.integers(3, 13))
    text = chain_text(rng, count, angles)
    if 'type="revolute"' not in text:
        return
    reader = ReadBack(text)
    exact, snapped = read(text, tip=f"l{count}", exact=True), read(text, tip=f"l{count}")
    assert all(joint.sign == 1 for joint in exact.robot.joints)
    lengths = [abs(number) for joint in exact.robot.joints for number in (joint.d, joint.a)]
    assert max(lengths) <= 1e4  # never the 25 km of a common normal far off
    for q in rng.uniform(-2, 2, (4, len(exact.robot.joints))):
        wanted = reader.forward(dict(zip(exact.robot.joint_names, q, strict=True)), f"l{count}")
        assert np.abs(forward(exact.robot, q) - wanted).max() <= 1e-12
        moved = np.linalg.norm(forward(snapped.robot, q)[:3, 3] - wanted[:3, 3])
        assert moved <= snapped.distance + 1e-12


def test_almost_parallel_axes_take_a_turn_about_y_and_are_written_back() -> None:
    text = chain_text(np.random.default_rng(3), 1, "right")
    link = '<link name="l0"/><link name="l1"/><link name="l2"/>'
    joint = '<joint name="{0}" type="revolute"><parent link="{1}"/><child link="{2}"/><origin xyz="0.4 0.1 0.2" rpy="{3} 0 0"/><axis xyz="0 0 1"/></joint>'
    text = f'<robot name="r">{link}{joint.format("a", "l0", "l1", 0)}{joint.format("b", "l1", "l2", 1e-7)}</robot>'
    exact = read(text, exact=True).robot
    assert exact.joints[0].beta != 0.0
    assert abs(exact.joints[0].d) <= 1.0
    back = read(urdf_of(exact), exact=True).robot
    q = np.random.default_rng(1).uniform(-3, 3, (20, 2))
    assert np.abs(forward(back, q) - forward(exact, q)).max() <= 1e-14
    assert read(text).robot.joints[0].beta == 0.0


def test_snapped_angles_and_their_distance() -> None:
    joint = '<joint name="{0}" type="revolute"><parent link="{1}"/><child link="{2}"/><origin xyz="{3} 0 0" rpy="{4} 0 0"/><axis xyz="0 0 1"/></joint>'
    text = (
        '<robot name="r"><link name="l0"/><link name="l1"/><link name="l2"/>'
        + joint.format("a", "l0", "l1", 0, 1.5708)
        + joint.format("b", "l1", "l2", 2, 0.0005)
        + "</robot>"
    )
    found = read(text)
    assert [(each.joint, each.axis, each.written, each.taken) for each in found.snapped] == [
        ("a", "x", 1.5708, np.pi / 2),
        ("b", "x", 0.0005, 0.0),
    ]
    # the tip is 2 m behind the first joint, and at the second
    assert found.snapped[0].distance == pytest.approx(2 * (1.5708 - np.pi / 2))
    assert found.snapped[1].distance == 0.0
    assert found.turn == pytest.approx(1.5708 - np.pi / 2 + 0.0005)
    assert "2 angles of joint origins" in str(found.snapping)
    far = text.replace("0.0005", "0.0011")
    assert len(read(far).snapped) == 1
    assert read(far).robot.joints[0].alpha != 0.0 or read(far).robot.joints[0].beta != 0.0


def test_inertia_and_friction_do_not_change_the_geometry() -> None:
    robot = model("ur5").robot
    bare = replace(
        robot, joints=tuple(Joint(*(getattr(j, f) for f in Joint.__match_args__[:8])) for j in robot.joints)
    )
    q = np.linspace(-1, 1, 6)
    assert np.array_equal(forward(robot, q), forward(bare, q))


@pytest.mark.parametrize("name", ["ur5", "panda"])
def test_efforts_and_friction_are_written_back(name: str) -> None:
    robot = model(name).robot
    back = read(urdf_of(robot)).robot
    assert [joint.effort for joint in back.joints] == [joint.effort for joint in robot.joints]
    assert [joint.friction for joint in back.joints] == [joint.friction for joint in robot.joints]
