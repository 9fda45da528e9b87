"""Arms on rails and lifts: forward kinematics by translation, in both conventions, along any axis."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from trajcli.errors import InputError
from trajcli.job.read import job_from_text
from trajcli.kinematics.forward import forward
from trajcli.kinematics.robot import Robot

ROW = {"theta": 0.3, "d": 0.2, "a": 0.4, "alpha": 0.7}
JOINTS = [
    {"name": "a", **ROW, "velocity": 2},
    {"name": "b", "type": "prismatic", **ROW, "alpha": -1.1, "sign": -1},
    {"name": "c", **ROW, "alpha": 0.2, "sign": -1},
]
MOUNT = {"xyz": [0.5, -0.2, 0.1], "rpy": [0.4, -0.8, 1.1]}
STANDS = {"xyz": [-0.3, 0.6, 0.2], "rpy": [1.4, 0.3, -0.5]}


def robot_of(arm: Any, joints: int, **job: Any) -> Robot:
    text = {"version": 1, "robot": arm, "start": {"joints": [0.0] * joints}, **job}
    return job_from_text(json.dumps({**text, "moves": [{"planner": "hold", "duration": 1}]})).robot


def pose_of(fields: dict[str, Any]) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("xyz", fields["rpy"]).as_matrix()
    pose[:3, 3] = fields["xyz"]
    return pose


def shifted(by: np.ndarray) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, 3] = by
    return pose


def axis_of(axis: str | list[float]) -> np.ndarray:
    vector = np.eye(3)["xyz".index(axis)] if isinstance(axis, str) else np.array(axis)
    return vector / np.linalg.norm(vector)


AXES = ["x", "y", "z", [0, 0, -2], [1.0, -2.0, 0.5], [1e-14, 0.0, 1.0], [5e-4, 0.0, 1.0]]


@pytest.mark.parametrize(
    ("axis", "mount", "convention"),
    [
        (axis, mount, ("standard", "modified")[(number + kind) % 2])
        for number, axis in enumerate(AXES)
        for kind, mount in enumerate([None, MOUNT, {"xyz": [0.1, 0, 0]}])
    ],
    ids=str,
)
def test_the_arm_stands_on_its_mount_and_is_carried_along_the_axis(
    convention: str, axis: str | list[float], mount: dict[str, Any] | None
) -> None:
    """T(q) = T_base T(axis s) T_mount T_arm(q): the mount takes the place of the arm's own base."""
    arm = {"convention": convention, "joints": JOINTS, "base": STANDS, "tool": MOUNT}
    rail = {"axis": axis, "position": [-2, 3]}
    alone = robot_of(arm, 3)
    on_rail = robot_of({"rail": rail, "arm": arm} | ({} if mount is None else {"mount": mount}), 4)
    stands = pose_of(STANDS) if mount is None else pose_of({"rpy": [0, 0, 0], **mount})
    q = np.random.default_rng(7).uniform(-1.5, 1.5, (6, 4))
    free = np.linalg.inv(alone.base)
    for row in q:
        expected = shifted(axis_of(axis) * row[0]) @ stands @ free @ forward(alone, row[1:])
        np.testing.assert_allclose(forward(on_rail, row), expected, rtol=0, atol=1e-12)
    assert on_rail.joint_names == ("rail", "a", "b", "c")
    assert on_rail.joint_types == ("prismatic", "revolute", "prismatic", "revolute")
    assert on_rail.limits.position[0].tolist() == [-2, 3]
    assert on_rail.limits.velocity.tolist()[1] == [-2, 2]


def test_a_job_places_the_rail_and_not_the_arm_on_it() -> None:
    """T(q) = T_job T(axis s) T_mount T_arm(q): the base of the job is that of the rail."""
    arm = {"convention": "modified", "joints": JOINTS, "base": STANDS}
    rail = {"rail": {"axis": [1, 2, 3]}, "arm": arm, "mount": MOUNT}
    alone, on_rail = robot_of(arm, 3), robot_of(rail, 4, base={"xyz": [7, 8, 9], "rpy": [0.1, 0.2, 0.3]})
    place = pose_of({"xyz": [7, 8, 9], "rpy": [0.1, 0.2, 0.3]})
    row = np.array([0.8, 0.3, -0.4, 1.1])
    carried = shifted(axis_of([1, 2, 3]) * 0.8) @ pose_of(MOUNT)
    expected = place @ carried @ np.linalg.inv(alone.base) @ forward(alone, row[1:])
    np.testing.assert_allclose(forward(on_rail, row), expected, rtol=0, atol=1e-12)


def test_a_rail_in_millimetres_under_an_arm_in_degrees() -> None:
    slide = {"axis": "x", "position": [-2000, 3000], "velocity": 500}
    turning = {"name": "a", "theta": 90, "a": 400, "position": [-90, 180]}
    robot = robot_of(
        {"rail": slide, "arm": {"convention": "standard", "joints": [turning]}},
        2,
        units={"angle": "deg", "length": "mm"},
    )
    assert robot.limits.position.tolist() == [[-2, 3], [pytest.approx(-np.pi / 2), pytest.approx(np.pi)]]
    assert robot.limits.velocity[0].tolist() == [-0.5, 0.5]


def test_what_the_slide_says_of_itself_is_that_of_the_first_joint() -> None:
    slide = {
        "name": "lift",
        "axis": "z",
        "velocity": [-0.2, 0.3],
        "acceleration": 2,
        "jerk": 30,
        "effort": [-800, 900],
        "friction": {"coulomb": 12, "viscous": 7},
        "rotor": 5,
        "mass": 40,
    }
    link = {"mass": 1, "com": [0, 0, 0], "inertia": [0] * 6}
    joints = [{**joint, "link": link, "effort": 50} for joint in JOINTS]
    arm = {"convention": "standard", "joints": joints}
    robot = robot_of({"rail": slide, "arm": arm}, 4, limits={"effort": "robot"})
    first, limits = robot.joints[0], robot.limits
    assert (first.name, first.type, first.rotor, robot.name.endswith(" on lift")) == (
        "lift",
        "prismatic",
        5,
        True,
    )
    assert (first.friction.coulomb, first.friction.viscous) == (12, 7)
    assert first.link is not None
    assert (first.link.mass, first.link.com) == (40, (0, 0, 0))
    bounds = [limits.velocity, limits.acceleration, limits.jerk, limits.effort]
    assert [bound[0].tolist() for bound in bounds] == [[-0.2, 0.3], [-2, 2], [-30, 30], [-800, 900]]
    assert limits.effort[1:].tolist() == [[-50, 50]] * 3
    # an effort is a limit where those of the arm are, and where the carriage has a mass
    light = {name: value for name, value in slide.items() if name != "mass"}
    bare = {"convention": "standard", "joints": JOINTS}
    for rail, carried in ((light, arm), (slide, bare)):
        assert robot_of({"rail": rail, "arm": carried}, 4).limits.effort[0].tolist() == [-np.inf, np.inf]


def test_limits_of_the_arm_stay_with_its_joints() -> None:
    near = {"deceleration": 5, "offset": 0.1}
    first = {**JOINTS[0], "position": [-2, 2], "velocity_by_position": near}
    arm = {"convention": "standard", "joints": [first, *JOINTS[1:]]}
    limits = robot_of({"rail": {"axis": "y"}, "arm": arm}, 4).limits
    assert limits.velocity_by_position.tolist() == [[np.inf, 0], [5, 0.1], [np.inf, 0], [np.inf, 0]]
    assert limits.position.tolist()[:2] == [[-np.inf, np.inf], [-2, 2]]


@pytest.mark.parametrize(
    ("arm", "rail", "message", "hint"),
    [
        ({"joints": 2}, {}, "has bare joints and no geometry", "give its joints DH rows"),
        ({"convention": "standard", "joints": [ROW] * 12}, {}, "at most 12 joints", "no rail"),
        (
            {"convention": "standard", "joints": JOINTS},
            {"name": "b"},
            "'b' is a joint of",
            "give the rail a `name`",
        ),
    ],
)
def test_what_cannot_stand_on_a_rail_is_refused(
    arm: dict[str, Any], rail: dict[str, Any], message: str, hint: str
) -> None:
    with pytest.raises(InputError) as caught:
        robot_of({"rail": {"axis": "x", **rail}, "arm": arm}, 3)
    (problem,) = caught.value.problems
    assert message in problem.message
    assert problem.hint == hint
