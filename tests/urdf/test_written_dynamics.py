"""Robots written as URDF and read again: motion, torques and limits are those of the table."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest

from trajcli.dynamics.newton_euler import InverseDynamics
from trajcli.kinematics.forward import forward
from trajcli.kinematics.robot import Friction, Joint, LinkInertia, Robot, unlimited
from trajcli.urdf.serial_robot import robot_of_urdf
from trajcli.urdf.write import urdf_of


def solid(rng: np.random.Generator) -> LinkInertia:
    """Return a body of four points, which has six products of inertia of its own."""
    points, masses = rng.normal(size=(4, 3)) * 0.2, rng.uniform(0.2, 2, 4)
    com = masses @ points / masses.sum()
    arms = points - com
    tensor = sum(m * (r @ r * np.eye(3) - np.outer(r, r)) for m, r in zip(masses, arms, strict=True))
    moments = (tensor[0, 0], tensor[1, 1], tensor[2, 2], tensor[0, 1], tensor[0, 2], tensor[1, 2])
    return LinkInertia(float(masses.sum()), tuple(com.tolist()), tuple(map(float, moments)))


def random_robot(seed: int, convention: str) -> Robot:
    rng = np.random.default_rng(seed)
    joints = tuple(
        Joint(
            f"j{k}",
            "prismatic" if k == 1 else "revolute",
            *rng.uniform(-1, 1, 4).tolist(),
            sign=int(rng.choice([-1, 1])),
            beta=0.3 * (k == 2),
            friction=Friction(*rng.uniform(0, 3, 2).tolist()),
            link=solid(rng),
        )
        for k in range(4)
    )
    base, tool = np.eye(4), np.eye(4)
    base[:3, 3], tool[:3, 3] = rng.normal(size=(2, 3))
    limits = replace(
        unlimited(4), position=np.array([[-2.0, 2.0], [-0.5, 0.3], [-np.inf, np.inf], [-1.0, 3.0]])
    )
    return Robot("arm", joints, limits, convention, base, tool)  # type: ignore[arg-type]


def read_again(robot: Robot) -> Robot:
    return robot_of_urdf(urdf_of(robot).encode(), "arm.urdf", exact=True, root="world").robot


@pytest.mark.parametrize("convention", ["standard", "modified"])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_torques_and_poses_are_those_of_the_table(seed: int, convention: str) -> None:
    """The rows of the file that is read are others, the bodies and what drives them the same."""
    robot = random_robot(seed, convention)
    again = read_again(robot)
    q, qd, qdd = np.random.default_rng(seed).normal(size=(3, 6, 4))
    np.testing.assert_allclose(forward(again, q), forward(robot, q), rtol=0, atol=1e-9)
    expected = InverseDynamics(robot).effort(q, qd, qdd)
    np.testing.assert_allclose(InverseDynamics(again).effort(q, qd, qdd), expected, rtol=1e-8, atol=1e-8)
    assert [joint.friction for joint in again.joints] == [joint.friction for joint in robot.joints]


BARE = Robot("arm", (Joint("a", a=0.5),), unlimited(1), "standard", np.eye(4), np.eye(4))


@pytest.mark.parametrize(
    ("low", "high", "kind"),
    [
        (-np.inf, np.inf, "continuous"),
        (-np.inf, 1.0, "revolute"),
        (-1.0, np.inf, "revolute"),
        (-1.0, 1.0, "revolute"),
    ],
)
def test_a_joint_is_continuous_where_neither_side_ends(low: float, high: float, kind: str) -> None:
    robot = replace(BARE, limits=replace(BARE.limits, position=np.array([[low, high]])))
    (joint,) = [each for each in ET.fromstring(urdf_of(robot)).iter("joint") if each.get("name") == "a"]
    assert joint.get("type") == kind
    said = np.clip([low, high], -1e6, 1e6).tolist() if kind == "revolute" else [None, None]
    limit = joint.find("limit")
    assert limit is not None
    assert [None if (v := limit.get(end)) is None else float(v) for end in ("lower", "upper")] == said
    slide = replace(robot, joints=(Joint("a", "prismatic", a=0.5),))
    (joint,) = [each for each in ET.fromstring(urdf_of(slide)).iter("joint") if each.get("name") == "a"]
    assert joint.get("type") == "prismatic"
    ends = joint.find("limit")
    assert ends is not None
    assert [float(ends.get(end, "nan")) for end in ("lower", "upper")] == np.clip(
        [low, high], -1e6, 1e6
    ).tolist()


def test_of_bounds_by_direction_the_smaller_one_is_written() -> None:
    limits = replace(
        BARE.limits,
        position=np.array([[-2.0, 2.0]]),
        velocity=np.array([[-3.0, 2.0]]),
        velocity_by_position=np.array([[5.0, 0.25]]),
    )
    for effort, said in (((-40.0, 30.0), 30.0), ((-20.0, 30.0), 20.0), ((-np.inf, 30.0), 30.0)):
        robot = replace(BARE, limits=limits, joints=(replace(BARE.joints[0], effort=effort),))
        again = read_again(robot)
        assert again.joints[0].effort == (-said, said)
        assert again.limits.velocity.tolist() == [[-2.0, 2.0]]
        assert again.limits.velocity_by_position.tolist() == [[5.0, 0.25]]


@pytest.mark.parametrize("friction", [Friction(2.0, 0.0), Friction(0.0, 3.0)])
def test_either_friction_alone_is_written(friction: Friction) -> None:
    robot = replace(BARE, joints=(replace(BARE.joints[0], friction=friction),))
    assert read_again(robot).joints[0].friction == friction


@pytest.mark.parametrize(
    ("bounds", "sign", "middle"), [((-3, 1), 1, 1.5), ((-1, 3), 1, -1.5), ((-1, 3), -1, 1.5)]
)
def test_the_rod_of_a_slide_reaches_through_its_base_where_it_is_out_furthest(
    bounds: tuple[float, float], sign: int, middle: float
) -> None:
    """In the frame of the slide the base is at -sign q, so that the rod's middle is at half of that."""
    slide = Joint("a", "prismatic", sign=sign)
    limits = replace(BARE.limits, position=np.array([bounds], float))
    links = ET.fromstring(urdf_of(replace(BARE, joints=(slide,), limits=limits))).iter("link")
    (link,) = [each for each in links if each.get("name") == "link_1"]
    found = [
        float(origin.get("xyz", "").split()[2])
        for visual in link.iter("visual")
        if (origin := visual.find("origin")) is not None and visual.find("geometry/cylinder") is not None
    ]
    assert found == [middle]


def test_names_and_sizes_at_the_edge() -> None:
    """A name with white space, which XML would make blanks, and an arm without any length, whose joints show."""
    name = 'a\tb\n"c"&<'
    root = ET.fromstring(urdf_of(replace(BARE, joints=(Joint(name),))))
    assert name in {joint.get("name") for joint in root.iter("joint")}
    (radius,) = {float(sphere.get("radius", "0")) for sphere in root.iter("sphere")}
    assert radius == pytest.approx(0.0032)


def test_each_joint_has_its_own_axis_and_effort() -> None:
    """An axis that is not said is x, one of any length a direction: about x by 1 rad, then along z by 0.5 m."""
    limit = '<limit lower="-2" upper="2" effort="{}" velocity="3"/>'
    text = (
        '<robot name="r"><link name="a"/><link name="b"/><link name="c"/>'
        '<joint name="j" type="revolute"><parent link="a"/><child link="b"/>' + limit.format(7) + "</joint>"
        '<joint name="k" type="prismatic"><parent link="b"/><child link="c"/><axis xyz="0 0 4"/>'
        + limit.format(9)
        + "</joint></robot>"
    )
    robot = robot_of_urdf(text.encode(), "r.urdf").robot
    assert [joint.effort for joint in robot.joints] == [(-7, 7), (-9, 9)]
    c, s = np.cos(1.0), np.sin(1.0)
    expected = [[1, 0, 0, 0], [0, c, -s, -0.5 * s], [0, s, c, 0.5 * c], [0, 0, 0, 1]]
    np.testing.assert_allclose(forward(robot, np.array([1.0, 0.5])), expected, rtol=0, atol=1e-12)


def test_one_end_that_is_far_out_is_no_end() -> None:
    """Both ends from 1e6 on are none; of one alone the number stays at 1e6, and the other end holds."""
    for low, high, wanted in (
        ("-2e6", "1", (-1e6, 1)),
        ("-1", "1e9", (-1, 1e6)),
        ("-2e6", "2e6", (-np.inf, np.inf)),
    ):
        text = (
            '<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="revolute"><parent link="a"/>'
            f'<child link="b"/><limit lower="{low}" upper="{high}" velocity="3"/></joint></robot>'
        )
        found = robot_of_urdf(text.encode(), "r.urdf").robot.limits.position[0].tolist()
        assert found == list(wanted)


def test_what_a_snapped_angle_moves_is_bounded_by_all_lengths_behind_it() -> None:
    """1.5708 is off a right angle by 3.7e-6: behind it 0.5 m, a slide out by 3 m at most, and 0.25 m."""
    limit = '<limit lower="{}" upper="{}" effort="7" velocity="3"/>'
    text = (
        '<robot name="r"><link name="a"/><link name="b"/><link name="c"/><link name="d"/>'
        '<joint name="j" type="revolute"><origin rpy="0 1.5708 0"/><parent link="a"/><child link="b"/>'
        + limit.format(-1, 1)
        + '</joint><joint name="k" type="prismatic"><origin xyz="0 0.3 0.4"/><parent link="b"/><child link="c"/>'
        + limit.format(-0.5, 3)
        + '</joint><joint name="m" type="fixed"><origin xyz="0.25 0 0"/><parent link="c"/><child link="d"/></joint>'
        "</robot>"
    )
    found = robot_of_urdf(text.encode(), "r.urdf")
    (snapped,) = found.snapped
    off = abs(1.5708 - np.pi / 2)
    assert (snapped.joint, snapped.axis, snapped.written, snapped.taken) == ("j", "y", 1.5708, np.pi / 2)
    assert snapped.distance == pytest.approx(off * 3.75, rel=1e-9)
    assert (found.distance, found.turn) == (snapped.distance, pytest.approx(off, rel=1e-9))
    said = float(str(snapped).rpartition("at most ")[2].split()[0])
    assert found.distance <= said <= found.distance * 1.01
    exact = robot_of_urdf(text.encode(), "r.urdf", exact=True).robot
    q = np.array([0.7, 3.0])
    moved = np.linalg.norm((forward(exact, q) - forward(found.robot, q))[:3, 3])
    assert 0 < moved <= found.distance
