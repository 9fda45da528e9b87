from __future__ import annotations

import numpy as np
import oracle_robots as oracle
import pytest
from conventions import link_transforms

from trajcli.errors import InputError
from trajcli.geometry.rotation import rotation_defect
from trajcli.kinematics.forward import forward, link_poses
from trajcli.kinematics.robot import Joint, Robot, unlimited

CASES = oracle.load("forward.yaml", "cases")
ARMS = pytest.mark.parametrize("arm", oracle.robots(), ids=lambda arm: arm["id"])
TOLERANCE = 1e-12


def of(kind):
    cases = [case for case in CASES if case["kind"] == kind]
    assert cases
    return pytest.mark.parametrize("case", cases, ids=[case["id"] for case in cases])


def test_every_kind_of_the_file_is_tested():
    assert {case["kind"] for case in CASES} == {"dh_fk", "wrist_center", "jacobian"}


@of("dh_fk")
def test_worked_examples(case):
    pose = forward(oracle.robot_of(case["inputs"]), case["inputs"]["q"])
    expected = np.array(case["expected"]["T"], dtype=float)
    np.testing.assert_allclose(pose, expected, rtol=0, atol=case["tolerance"])
    if "s_vector" in case["expected"]:
        np.testing.assert_allclose(pose[:3, 1], case["expected"]["s_vector"], rtol=0, atol=case["tolerance"])
    if "misprint_trap" in case:
        assert np.abs(pose - np.array(case["misprint_trap"]["T"], dtype=float)).max() > 1e-3


@of("wrist_center")
def test_centre_of_the_wrist(case):
    pose = forward(oracle.robot_of(case["inputs"]), case["inputs"]["q"])
    centre = pose[:3, 3] - case["inputs"]["d6"] * pose[:3, 2]
    np.testing.assert_allclose(centre, case["expected"]["p_w"], rtol=0, atol=case["tolerance"])
    assert np.abs(centre - case["misprint_trap"]["p_w"]).max() > 1e-3


@ARMS
def test_published_poses_in_both_conventions(arm):
    for table in oracle.tables(arm):
        robot = oracle.robot_of(table)
        q = np.array([sample["q"] for sample in arm["fk"]]) + np.array(table.get("q_offset", 0.0))
        np.testing.assert_allclose(
            forward(robot, q), [sample["T"] for sample in arm["fk"]], rtol=0, atol=TOLERANCE
        )


def test_all_arms_have_both_conventions():
    conventions = [{table["convention"] for table in oracle.tables(arm)} for arm in oracle.robots()]
    assert len(conventions) == 23
    assert all(both == {"std", "mdh"} for both in conventions)


@ARMS
def test_screw_exponentials_of_the_published_chain(arm):
    robot = oracle.robot_of(arm)
    q = np.random.default_rng(1).uniform(-3, 3, (20, len(robot.joints)))
    screws = [oracle.screws(robot)]
    if "chain" in arm:
        screws.append(oracle.chain_screws(arm["chain"]))
    for generators, home in screws:
        np.testing.assert_allclose(
            forward(robot, q), oracle.exponentials(generators, home, q), rtol=0, atol=TOLERANCE
        )


@pytest.mark.parametrize("joints", range(1, 13))
@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_arbitrary_arms(joints, convention):
    rng = np.random.default_rng(joints)
    for _ in range(3):
        robot = oracle.random_arm(rng, joints, convention)
        q = rng.uniform(-3, 3, (5, joints))
        expected = oracle.exponentials(*oracle.screws(robot), q)
        np.testing.assert_allclose(forward(robot, q), expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_links_are_the_products_of_their_transforms(convention):
    rng = np.random.default_rng(6)
    robot = oracle.random_arm(rng, 6, convention)
    q = rng.uniform(-3, 3, (4, 3, 6))
    poses, steps = link_poses(robot, q), link_transforms(robot, q)
    assert poses.shape == (4, 3, 8, 4, 4)
    np.testing.assert_array_equal(poses[..., 0, :, :], np.broadcast_to(robot.base, (4, 3, 4, 4)))
    for i in range(6):
        np.testing.assert_allclose(
            poses[..., i + 1, :, :], poses[..., i, :, :] @ steps[..., i, :, :], rtol=0, atol=1e-14
        )
    np.testing.assert_allclose(poses[..., 7, :, :], poses[..., 6, :, :] @ robot.tool, rtol=0, atol=1e-14)
    np.testing.assert_allclose(poses[..., 7, :, :], forward(robot, q), rtol=0, atol=1e-15)


def test_batches_of_any_shape_and_size():
    arm = oracle.robot_of(oracle.robots()[0])
    q = np.random.default_rng(2).uniform(-3, 3, (2, 4099, 6))
    poses = forward(arm, q)
    assert poses.shape == (2, 4099, 4, 4)
    for index in [(0, 0), (0, 4095), (0, 4096), (1, 4098)]:
        np.testing.assert_allclose(poses[index], forward(arm, q[index]), rtol=0, atol=1e-15)
    assert forward(arm, np.empty((0, 6))).shape == (0, 4, 4)
    assert rotation_defect(poses[..., :3, :3]).max() < 5e-15


def test_right_angles_leave_exact_zeros():
    arm = oracle.robot_of(oracle.robots()[0])
    poses = link_poses(arm, np.random.default_rng(2).uniform(-3, 3, (100, 6)))
    assert (poses[:, 1, 2, [0, 2]] == 0).all()
    assert (poses[:, 1:4, 2, 2] == 0).all()


def test_what_does_not_fit_is_refused():
    arm = oracle.robot_of(oracle.robots()[0], "six")
    with pytest.raises(InputError, match="q has 5 values, robot six has 6 joints"):
        forward(arm, np.zeros(5))
    with pytest.raises(InputError, match="not finite"):
        forward(arm, [0, 0, np.nan, 0, 0, 0])
    bare = Robot("bare", (Joint("j1"),), unlimited(1), None, np.eye(4), np.eye(4))
    with pytest.raises(InputError, match="robot bare has bare joints") as caught:
        link_poses(bare, [0.0])
    assert "DH row" in str(caught.value.problems[0].hint)
