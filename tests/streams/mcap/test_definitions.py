"""Definitions of messages against those of ROS 2 jazzy that rosbags has, by the hashes of types."""

from __future__ import annotations

import pytest
from extras import require_module

from trajcli.streams.mcap import definitions
from trajcli.streams.mcap.definitions import definition_of, point_fields

MESSAGES = [
    definitions.JOINT_STATE,
    definitions.JOINT_TRAJECTORY,
    definitions.JOINT_TRAJECTORY_POINT,
    definitions.STRING,
    definitions.TRANSFORMS,
    definitions.PATH,
    definitions.TWIST,
    definitions.NUMBER,
]
POINT = "trajectory_msgs/JointTrajectoryPoint"


@pytest.mark.parametrize("message", MESSAGES)
def test_a_definition_is_that_of_ros_with_all_types_that_it_uses(message: str) -> None:
    """By the hash of the type, in which those of its fields are."""
    require_module("rosbags")
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    fresh = get_typestore(Stores.EMPTY)
    fresh.register(get_types_from_msg(definition_of(message), message))
    assert fresh.hash_rihs01(message) == get_typestore(Stores.ROS2_JAZZY).hash_rihs01(message)


@pytest.mark.parametrize("package", ["trajectory_msgs/", "trajectory_msgs/msg/"])
def test_points_of_a_message_stand_behind_its_header_and_its_joints(package: str) -> None:
    """Types may be written with and without `msg`; a comment is no field, and what is behind other fields is no point."""
    kind = f"{package}JointTrajectoryPoint"
    head = f"{package.replace('trajectory', 'std')}Header header\nstring[] joint_names  # in their order\n\n"
    points = f"{kind} reference # {kind} none\n{kind} feedback\n"
    assert point_fields(f"{head}{points}") == ("reference", "feedback")
    assert point_fields(f"{head}{points}string[] others\n{kind} late\n") == ("reference", "feedback")
    assert point_fields(f"{head}{points}{'=' * 80}\nMSG: a/B\n{kind} inner\n") == ("reference", "feedback")
    assert point_fields(f"string[] joint_names\n{points}") == ()
    assert point_fields(f"{head}float64[] positions\n{points}") == ()
