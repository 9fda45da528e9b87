from __future__ import annotations

import numpy as np
import oracle_robots as oracle
import pytest

from trajcli.errors import InputError
from trajcli.geometry.rotation import log
from trajcli.kinematics.forward import forward
from trajcli.kinematics.jacobian import jacobian, jacobian_dot_qd, linearisation, tcp_acceleration, tcp_twist

CASES = [case for case in oracle.load("forward.yaml", "cases") if case["kind"] == "jacobian"]
ARMS = pytest.mark.parametrize("arm", oracle.robots(), ids=lambda arm: arm["id"])
RANDOM_ARMS = [
    oracle.random_arm(np.random.default_rng(joints), joints, convention)
    for joints in (1, 2, 4, 6, 7, 12)
    for convention in ("standard", "modified")
]
STEP = 1e-5


def both_frames(rotation, vectors):
    """Return the six rows of `vectors` (6, n) turned by `rotation`."""
    return np.concatenate([rotation @ vectors[:3], rotation @ vectors[3:]])


def differences(robot, q):
    """Return J by central differences of the forward kinematics, good to about 1e-9."""
    columns = []
    for change in STEP * np.eye(q.size):
        high, low = forward(robot, q + change), forward(robot, q - change)
        turn = log(high[:3, :3] @ low[:3, :3].T)
        columns.append(np.concatenate([high[:3, 3] - low[:3, 3], turn]) / (2 * STEP))
    return np.array(columns).T


def by_screws(robot, q):
    """Return J from the screws in world, carried along by the exponentials of the joints before."""
    generators, home = oracle.screws(robot)
    tcp = oracle.exponentials(generators, home, q[None])[0, :3, 3]
    columns = []
    for i, screw in enumerate(generators):
        before = oracle.exponentials(generators[:i], np.eye(4), q[None])
        before = before[0] if before.ndim == 3 else before
        moved = before @ screw @ np.linalg.inv(before)
        angular = np.array([moved[2, 1], moved[0, 2], moved[1, 0]])
        columns.append(np.concatenate([moved[:3, 3] + np.cross(angular, tcp), angular]))
    return np.array(columns).T


@pytest.mark.parametrize("case", CASES, ids=[case["id"] for case in CASES])
def test_published_jacobians(case):
    frame = {"base": "base", "tool": "tcp"}[case["inputs"]["frame"]]
    got = jacobian(oracle.robot_of(case["inputs"]), case["inputs"]["q"], frame)
    np.testing.assert_allclose(got, case["expected"]["J"], rtol=0, atol=case["tolerance"])


@ARMS
def test_differences_and_screws_of_published_arms(arm):
    for table in oracle.tables(arm):
        robot = oracle.robot_of(table)
        q = np.random.default_rng(5).uniform(-3, 3, len(robot.joints))
        np.testing.assert_allclose(jacobian(robot, q), differences(robot, q), rtol=0, atol=2e-9)
        np.testing.assert_allclose(jacobian(robot, q), by_screws(robot, q), rtol=0, atol=1e-13)


@pytest.mark.parametrize("robot", RANDOM_ARMS, ids=lambda robot: f"{len(robot.joints)}-{robot.convention}")
def test_differences_and_screws_of_arbitrary_arms(robot):
    q = np.random.default_rng(6).uniform(-3, 3, len(robot.joints))
    np.testing.assert_allclose(jacobian(robot, q), differences(robot, q), rtol=0, atol=1e-8)
    np.testing.assert_allclose(jacobian(robot, q), by_screws(robot, q), rtol=0, atol=1e-12)


@pytest.mark.parametrize("robot", RANDOM_ARMS, ids=lambda robot: f"{len(robot.joints)}-{robot.convention}")
def test_the_frames_are_turned_into_each_other(robot):
    q = np.random.default_rng(7).uniform(-3, 3, len(robot.joints))
    world, tcp = jacobian(robot, q), forward(robot, q)[:3, :3]
    np.testing.assert_allclose(
        both_frames(robot.base[:3, :3].T, world), jacobian(robot, q, "base"), rtol=0, atol=1e-13
    )
    np.testing.assert_allclose(both_frames(tcp.T, world), jacobian(robot, q, "tcp"), rtol=0, atol=1e-13)


@pytest.mark.parametrize("robot", RANDOM_ARMS, ids=lambda robot: f"{len(robot.joints)}-{robot.convention}")
@pytest.mark.parametrize("frame", ["world", "base", "tcp"])
def test_change_of_the_jacobian_against_differences(robot, frame):
    rng = np.random.default_rng(8)
    q, qd = rng.uniform(-3, 3, (2, len(robot.joints)))
    change = (jacobian(robot, q + STEP * qd) - jacobian(robot, q - STEP * qd)) / (2 * STEP) @ qd
    pose = forward(robot, q)[:3, :3]
    rotation = {"world": np.eye(3), "base": robot.base[:3, :3].T, "tcp": pose.T}[frame]
    expected = both_frames(rotation, change[:, None])[:, 0]
    scale = max(1.0, np.abs(expected).max())
    np.testing.assert_allclose(jacobian_dot_qd(robot, q, qd, frame), expected, rtol=0, atol=1e-7 * scale)


@ARMS
def test_change_of_the_jacobian_of_published_arms(arm):
    robot = oracle.robot_of(arm)
    q, qd = np.random.default_rng(9).uniform(-2, 2, (2, len(robot.joints)))
    expected = (jacobian(robot, q + STEP * qd) - jacobian(robot, q - STEP * qd)) / (2 * STEP) @ qd
    np.testing.assert_allclose(jacobian_dot_qd(robot, q, qd), expected, rtol=0, atol=1e-7)


def test_twist_and_acceleration_along_a_motion():
    robot = oracle.robot_of(oracle.robots()[4])
    a, b, c = np.random.default_rng(10).uniform(-1, 1, (3, 7))
    step = 1e-4
    q = np.array([a + b * t + c * t * t / 2 for t in (-step, 0, step)])
    poses = forward(robot, q)
    linear = np.diff(poses[:, :3, 3], axis=0) / step
    angular = log(poses[1:, :3, :3] @ np.swapaxes(poses[:-1, :3, :3], 1, 2)) / step
    between = np.concatenate([linear, angular], axis=-1)
    np.testing.assert_allclose(tcp_twist(robot, q[1], b), between.mean(axis=0), rtol=0, atol=1e-7)
    np.testing.assert_allclose(
        tcp_acceleration(robot, q[1], b, c), np.diff(between, axis=0)[0] / step, rtol=0, atol=1e-6
    )


def test_batches():
    robot = RANDOM_ARMS[6]
    joints = len(robot.joints)
    q, qd, qdd = np.random.default_rng(11).uniform(-3, 3, (3, 2, 5, joints))
    for function, args in [
        (jacobian, (q,)),
        (jacobian_dot_qd, (q, qd)),
        (tcp_twist, (q, qd)),
        (tcp_acceleration, (q, qd, qdd)),
    ]:
        together = function(robot, *args)
        assert together.shape[:3] == (2, 5, 6)
        np.testing.assert_allclose(
            together[1, 3], function(robot, *(arg[1, 3] for arg in args)), rtol=0, atol=1e-14
        )
    many = np.tile(q.reshape(-1, joints), (500, 1))
    np.testing.assert_allclose(jacobian(robot, many)[-1], jacobian(robot, q)[1, 4], rtol=0, atol=1e-14)


def test_rates_that_do_not_fit_are_refused():
    robot = RANDOM_ARMS[6]
    with pytest.raises(InputError, match="joint rates has 2 values"):
        tcp_twist(robot, np.zeros(6), [0, 0])
    with pytest.raises(InputError, match="shape"):
        jacobian_dot_qd(robot, np.zeros((2, 6)), np.zeros(6))


@pytest.mark.parametrize(
    "robot", RANDOM_ARMS[4:8], ids=lambda robot: f"{len(robot.joints)}-{robot.convention}"
)
def test_one_pass_along_the_chain_gives_the_pose_and_its_derivatives(robot):
    """With a base, a tool, turns and slides, of more configurations than are computed at a time."""
    q = np.random.default_rng(12).uniform(-3, 3, (3, 2, len(robot.joints)))
    many = np.tile(q.reshape(6, -1), (700, 1))
    for values in (q, many):
        poses, slopes = linearisation(robot, values)
        np.testing.assert_allclose(poses, forward(robot, values), rtol=0, atol=1e-15)
        np.testing.assert_allclose(slopes, jacobian(robot, values), rtol=0, atol=1e-15)
    for row in (0, 4190):
        np.testing.assert_allclose(slopes[row], differences(robot, many[row]), rtol=0, atol=1e-8)


@pytest.mark.parametrize("frame", ["world", "base", "tcp"])
def test_twists_and_their_changes_are_those_in_world_written_in_other_axes(frame):
    robot = RANDOM_ARMS[6]
    q, qd = np.random.default_rng(13).uniform(-2, 2, (2, len(robot.joints)))
    rotation = {"world": np.eye(3), "base": robot.base[:3, :3].T, "tcp": forward(robot, q)[:3, :3].T}[frame]
    for function in (tcp_twist, jacobian_dot_qd):
        wanted = both_frames(rotation, function(robot, q, qd)[:, None])[:, 0]
        np.testing.assert_allclose(function(robot, q, qd, frame), wanted, rtol=0, atol=1e-11)
    twist = both_frames(rotation, differences(robot, q)) @ qd
    np.testing.assert_allclose(tcp_twist(robot, q, qd, frame), twist, rtol=0, atol=1e-7)
