"""Messages of a motion: their layouts for rows, and those that stand once in a log."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.frozen import frozen
from trajcli.knots import Knots
from trajcli.streams.mcap import definitions, records
from trajcli.streams.mcap.cdr import MessageLayout, arranged, put_time
from trajcli.streams.mcap.recording import LinkFrames, LoggedPath, Recording

JOINT_STATES, JOINT_ACCELERATIONS, JOINT_TRAJECTORY, ROBOT_DESCRIPTION, TF_STATIC, TF, TOOL_PATH = (
    *("/joint_states", "/joint_accelerations", "/joint_trajectory", "/robot_description", "/tf_static"),
    *("/tf", "/tool_path"),
)
TRAJECTORY_POINT, TOOL_TWIST = "/joint_trajectory_point", "/tool_twist"
TYPES: Mapping[str, str] = {
    JOINT_STATES: definitions.JOINT_STATE,
    JOINT_ACCELERATIONS: definitions.JOINT_STATE,
    TRAJECTORY_POINT: definitions.JOINT_TRAJECTORY_POINT,
    TOOL_TWIST: definitions.TWIST,
    TF: definitions.TRANSFORMS,
    JOINT_TRAJECTORY: definitions.JOINT_TRAJECTORY,
    ROBOT_DESCRIPTION: definitions.STRING,
    TF_STATIC: definitions.TRANSFORMS,
    TOOL_PATH: definitions.PATH,
}
"""The topics in the order of their channels, and what their messages are."""
BY_ROW = (JOINT_STATES, JOINT_ACCELERATIONS, TRAJECTORY_POINT, TOOL_TWIST)
LATCHED = (JOINT_TRAJECTORY, ROBOT_DESCRIPTION, TF_STATIC, TOOL_PATH)
NONE = ("", "")
FIELDS: Mapping[str, tuple[tuple[str, str], ...]] = {
    JOINT_STATES: (("q", "position"), ("qd", "velocity"), ("tau", "effort")),
    JOINT_ACCELERATIONS: (("qdd", "acceleration"), NONE, NONE),
    TRAJECTORY_POINT: (("q", "position"), ("qd", "velocity"), ("qdd", "acceleration"), NONE),
}
"""The kind of columns that each sequence of a message by row holds, and its name; `NONE` is always empty."""
OF_GEOMETRY = (ROBOT_DESCRIPTION, TF_STATIC, TF, TOOL_PATH, TOOL_TWIST)

SIGNAL = "/signal/"
"""What the topic of a signal begins with; its name follows."""

_ENDLESS = "sec: 9223372036\n    nsec: 854775807"
_PROFILE = (
    "- history: 3\n  depth: 0\n  reliability: 1\n  durability: {durability}\n  deadline:\n    {endless}\n"
    "  lifespan:\n    {endless}\n  liveliness: 1\n  liveliness_lease_duration:\n    {endless}\n"
    "  avoid_ros_namespace_conventions: false"
)


def topics_of(recording: Recording) -> tuple[str, ...]:
    """Return the topics that a log holds."""
    extra = (TRAJECTORY_POINT, TOOL_TWIST)
    without = () if recording.frames is not None else OF_GEOMETRY
    without = without if recording.knots.acceleration.size else (*without, JOINT_ACCELERATIONS)
    fixed = (
        topic for topic in TYPES if topic not in without and (topic not in extra or topic in recording.topics)
    )
    return (*fixed, *(SIGNAL + name for name in recording.signals))


def type_of(topic: str) -> str:
    """Return what the messages of a topic are."""
    return TYPES.get(topic, definitions.NUMBER)


def quality_of_service(topic: str) -> dict[str, str]:
    """Return the metadata of a channel: kept for late subscribers (durability 1) or not (2)."""
    durability = 1 if topic in LATCHED or topic.startswith(SIGNAL) else 2
    return {"offered_qos_profiles": _PROFILE.format(durability=durability, endless=_ENDLESS)}


@frozen
class RecordLayout:
    """Message records of one channel that are alike but for their numbers.

    Attributes:
        template: A record, its numbers zero.
        dtype: Where its numbers stand: `sequence`, `log_time`, `publish_time` and those of the message.
    """

    template: bytes
    dtype: np.dtype[Any]


def record_layout(channel: int, layout: MessageLayout) -> RecordLayout:
    """Return the records that hold messages of a layout."""
    data, head = layout.template, records.MESSAGE_HEAD
    content = head.size - records.RECORD_HEAD.size + len(data)
    numbers = layout.dtype(head.size)
    fields = {name: numbers.fields[name] for name in numbers.names or ()} if numbers.fields else {}
    formats = ["<u4", "<u8", "<u8", *(field[0] for field in fields.values())]
    offsets = [11, 15, 23, *(field[1] for field in fields.values())]
    dtype = np.dtype(
        {
            "names": ["sequence", "log_time", "publish_time", *fields],
            "formats": formats,
            "offsets": offsets,
            "itemsize": head.size + len(data),
        }
    )
    return RecordLayout(head.pack(records.MESSAGE, content, channel, 0, 0, 0) + data, dtype)


def message_record(channel: int, time: int, data: bytes, number: int = 0) -> bytes:
    """Return the record of a message of a channel, with its number from 0."""
    content = records.MESSAGE_HEAD.size - records.RECORD_HEAD.size + len(data)
    return records.MESSAGE_HEAD.pack(records.MESSAGE, content, channel, number, time, time) + data


def row_message(topic: str, joint_names: tuple[str, ...], kinds: Collection[str]) -> MessageLayout:
    """Return the layout of a topic with one message for each row.

    Args:
        topic: Which.
        joint_names: n names.
        kinds: Of the columns of the rows; what is not among them is empty.
    """
    layout, count = MessageLayout(), len(joint_names)
    if topic == TOOL_TWIST:
        return layout.header("world").numbers("twist", 6)
    if topic != TRAJECTORY_POINT:
        layout.header("").texts(joint_names)
    for kind, name in FIELDS[topic]:
        layout.sequence(name, count if kind in kinds else 0)
    return layout.time("from_start") if topic == TRAJECTORY_POINT else layout


def transform_message(pairs: Sequence[tuple[str, str]]) -> MessageLayout:
    """Return the layout of the poses of frames (parent, child), fields `stamp<k>` and `pose<k>` (7,)."""
    layout = MessageLayout().count(len(pairs))
    for k, (parent, child) in enumerate(pairs):
        layout.align(4).time(f"stamp{k}").text(parent).text(child).numbers(f"pose{k}", 7)
    return layout


def put_transforms(messages: NDArray[Any], times: NDArray[np.int64], poses: Array) -> None:
    """Fill in times (N,), ns, and poses (N, k, 7) of messages (N,)."""
    for k in range(poses.shape[1]):
        put_time(messages, f"stamp{k}", times)
        messages[f"pose{k}"] = poses[:, k]


def latched_messages(recording: Recording) -> Iterator[tuple[str, bytes]]:
    """Yield topic and message of each topic with a single one."""
    yield JOINT_TRAJECTORY, _trajectory(recording.joint_names, recording.knots)
    if recording.frames is not None:
        yield ROBOT_DESCRIPTION, MessageLayout().text(recording.frames.urdf).template
        yield TF_STATIC, _fixed(recording.frames, recording.origin)
    if recording.path is not None:
        yield TOOL_PATH, _path(recording.path, recording.origin)


def signal_messages(recording: Recording) -> Iterator[tuple[str, int, bytes]]:
    """Yield topic, time (ns) and message of each value of a signal: 0 at the start, then as it changes."""
    for name, values in recording.signals.items():
        for nanoseconds, value in ((0, 0.0), *values) if values[0][0] else values:
            message = arranged(MessageLayout().numbers("data", 1), 1)
            message["data"] = value
            yield SIGNAL + name, recording.origin + nanoseconds, message.tobytes()


def _trajectory(joint_names: tuple[str, ...], knots: Knots) -> bytes:
    """Return the message of all knots; its stamp 0 means that a controller starts at once."""
    states = {name: getattr(knots, name) for name in ("position", "velocity", "acceleration")}
    head = MessageLayout().header("").texts(joint_names).count(knots.nanoseconds.size).template
    message, begun = head, 0
    while begun < knots.nanoseconds.size:
        # the first point may begin at another remainder by 8 than those behind it, which are all alike
        stop = 1 if begun == 0 else knots.nanoseconds.size
        remainder = (len(message) - 4) % 8
        layout = MessageLayout(bytes(remainder), 0)
        for name, values in states.items():
            layout.sequence(name, values.shape[1])
        points = arranged(layout.count(0).time("from_start"), stop - begun)
        for name, values in states.items():
            if values.size:
                points[name] = values[begun:stop]
        put_time(points, "from_start", knots.nanoseconds[begun:stop])
        raw = points.view(np.uint8).reshape(stop - begun, -1)
        message += raw[:, remainder:].tobytes()
        begun = stop
    return message


def _fixed(frames: LinkFrames, time: int) -> bytes:
    message = arranged(transform_message([(parent, child) for parent, child, _ in frames.fixed]), 1)
    poses = np.stack([pose for _, _, pose in frames.fixed])
    put_transforms(message, np.array([time]), poses[None])
    return message.tobytes()


def _path(path: LoggedPath, time: int) -> bytes:
    """Return the message of a path in `world`: behind that name its poses stand at multiples of 8 bytes."""
    head = arranged(MessageLayout().header("world").count(path.nanoseconds.size), 1)
    put_time(head, "stamp", np.array([time]))
    poses = arranged(MessageLayout(b"", 0).header("world").numbers("pose", 7), path.nanoseconds.size)
    put_time(poses, "stamp", path.nanoseconds + time)
    poses["pose"] = path.poses
    return head.tobytes() + poses.tobytes()
