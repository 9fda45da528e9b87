"""Messages of joints written byte by byte: both orders of bytes, other lengths, cut ones, several in a chunk."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from streams.mcap.conftest import read_mcap
from streams.mcap.test_read_mcap import (
    STATE,
    TRAJECTORY,
    bag,
    message_record,
    raw_log,
    refused,
    state,
    trajectory,
)

from trajcli.errors import InputError
from trajcli.streams.mcap.decode import DamagedMessageError, joint_state_layout, joint_trajectory
from trajcli.streams.recorded_motion import open_motion

CLOCK = 1_700_000_000 * 10**9
STRING = "std_msgs/msg/String"


class Message:
    """Bytes of a message in CDR, whose alignment counts from behind its first four."""

    def __init__(self, order: str) -> None:
        self.order, self.data = order, b""

    def add(self, kind: str, *values: float) -> Message:
        size = struct.calcsize(kind)
        self.data += bytes(-len(self.data) % size)
        self.data += struct.pack(f"{self.order}{len(values)}{kind}", *values)
        return self

    def time(self, nanoseconds: int) -> Message:
        seconds, more = divmod(nanoseconds, 10**9)
        return self.add("i", seconds).add("I", more)

    def text(self, text: str) -> Message:
        self.add("I", len(text) + 1).data += text.encode() + b"\0"
        return self

    def names(self, *names: str) -> Message:
        self.add("I", len(names))
        for name in names:
            self.text(name)
        return self

    def numbers(self, *sequences: Sequence[float]) -> Message:
        for values in sequences:
            self.add("I", len(values))
            if values:
                self.add("d", *values)
        return self

    @property
    def whole(self) -> bytes:
        return bytes([0, self.order == "<", 0, 0]) + self.data


def joints(time: int, *sequences: Sequence[float], order: str = "<", frame: str = "") -> bytes:
    return Message(order).time(time).text(frame).names("a", "bc").numbers(*sequences).whole


def chunk_of(path: Path, *messages: bytes) -> Path:
    return raw_log(path, content=b"".join(map(message_record, messages)))


@pytest.mark.parametrize("first", ["<", ">"])
def test_each_message_says_its_order_of_bytes(first: str, tmp_path: Path) -> None:
    orders = [first, "<", ">", ">", "<"]
    values = np.random.default_rng(2).normal(size=(5, 6)).tolist()
    path = chunk_of(
        tmp_path / "a.mcap",
        *(
            joints(CLOCK + 10**8 * k, row[:2], row[2:4], row[4:], order=order)
            for k, (row, order) in enumerate(zip(values, orders, strict=True))
        ),
    )
    found = read_mcap(path)
    assert found.times.tolist() == [0.0, 0.1, 0.2, 0.3, 0.4]
    assert np.hstack([found.position, found.velocity, found.effort]).tolist() == values


def test_stamps_before_1970_are_negative(tmp_path: Path) -> None:
    times = [-2 * 10**9, -1_250_000_000, -1, 0, 750_000_000]
    found = read_mcap(chunk_of(tmp_path / "a.mcap", *(joints(time, [0, 1], [], []) for time in times)))
    assert found.times.tolist() == [-2.0, -1.25, -1e-9, 0.0, 0.75]


@pytest.mark.parametrize("frames", [("world", "w"), ("w", "world"), ("w", "world", "w", "wo")])
def test_messages_of_other_lengths_stand_in_one_chunk(frames: tuple[str, ...], tmp_path: Path) -> None:
    """The last one may be shorter than the first, and the chunk ends with it."""
    messages = [joints(k * 10**9, [k, -k], [], [], frame=frame) for k, frame in enumerate(frames)]
    found = read_mcap(chunk_of(tmp_path / "a.mcap", *messages))
    assert found.position.tolist() == [[float(k), -float(k)] for k in range(len(frames))]
    assert found.times.tolist() == [float(k) for k in range(len(frames))]


def test_velocities_of_one_message_are_no_efforts_of_the_next(tmp_path: Path) -> None:
    path = chunk_of(tmp_path / "a.mcap", joints(0, [1, 2], [3, 4], []), joints(1, [1, 2], [], [3, 4]))
    assert "other joints or quantities than the first of its topic" in refused(path)


@pytest.mark.parametrize("order", ["<", ">"])
def test_a_state_that_is_cut_anywhere_is_damaged(order: str) -> None:
    data = joints(CLOCK, [1.0, 2.0], [3.0, 4.0], [5.0, 6.0], order=order)
    joint_state_layout(data)
    for size in range(len(data)):
        with pytest.raises(DamagedMessageError):
            joint_state_layout(data[:size])
    for wrong in (b"\1", b"\xff"):
        with pytest.raises(DamagedMessageError, match="not in plain CDR"):
            joint_state_layout(wrong + data[1:])


def points(order: str) -> bytes:
    message = Message(order).time(CLOCK).text("x").names("a", "bc").add("I", 3)
    for k in range(3):
        message.numbers([k, 1], [2, k], [k, 3], [4, k]).time((k - 1) * 1_250_000_000)
    return message.whole


@pytest.mark.parametrize("order", ["<", ">"])
def test_a_trajectory_has_its_numbers_in_either_order_of_bytes_or_is_damaged(order: str) -> None:
    found = joint_trajectory(points(order))
    assert found.names == ("a", "bc")
    assert found.nanoseconds.tolist() == [-1_250_000_000, 0, 1_250_000_000]
    parts = (found.position, found.velocity, found.acceleration, found.effort)
    assert [part.tolist() for part in parts] == [
        [[0.0, 1.0], [1.0, 1.0], [2.0, 1.0]],
        [[2.0, 0.0], [2.0, 1.0], [2.0, 2.0]],
        [[0.0, 3.0], [1.0, 3.0], [2.0, 3.0]],
        [[4.0, 0.0], [4.0, 1.0], [4.0, 2.0]],
    ]
    for size in range(len(points(order))):
        with pytest.raises(DamagedMessageError):
            joint_trajectory(points(order)[:size])


def test_a_cut_trajectory_does_not_go_on_in_the_next_message(tmp_path: Path) -> None:
    content = message_record(points("<")[:-8]) + struct.pack("<BQHIQQ", 5, 122, 7, 0, 0, 0) + bytes(100)
    assert "it ends after" in refused(raw_log(tmp_path / "a.mcap", schema=TRAJECTORY, content=content))


def test_points_of_other_sizes_are_damaged() -> None:
    """The second has no velocities; or a joint more than there are names."""
    for second in ([[1, 2], [], [], []], [[1, 2, 3], [1, 2, 3], [], []]):
        message = Message("<").time(0).text("").names("a", "bc").add("I", 2)
        message.numbers([0, 0], [0, 0], [], []).time(0).numbers(*second).time(1)
        with pytest.raises(DamagedMessageError, match="its point 1 has"):
            joint_trajectory(message.whole)


def test_two_trajectories_are_refused_in_whatever_chunks(tmp_path: Path) -> None:
    _, message = trajectory(3)
    path = bag(tmp_path / "a.mcap", {"/goal": (TRAJECTORY, [message, message])}, chunk_size=1)
    assert "the topic /goal" in refused(path)
    assert "holds several trajectories, and one is read" in refused(path)


def test_stamped_messages_may_be_logged_at_any_time(tmp_path: Path) -> None:
    """The clock of the recorder counts only where nobody has stamped them."""
    messages = [state(CLOCK + k * 10**8, [k, 0.0, 0.0]) for k in range(3)]
    path = bag(tmp_path / "a.mcap", {"/joint_states": (STATE, messages)}, clock=2**63)
    assert read_mcap(path).times.tolist() == [0.0, 0.1, 0.2]
    unstamped = [state(0, [k, 0.0, 0.0]) for k in range(3)]
    path = bag(tmp_path / "b.mcap", {"/joint_states": (STATE, unstamped)}, clock=2**63)
    assert f"is logged at {2**63} ns or later" in refused(path)


def test_times_count_from_the_first_message_not_from_the_first_stamp(tmp_path: Path) -> None:
    """Whether stamps rise is said by who judges them."""
    messages = [state(CLOCK + time, [0.0, 0.0, 0.0]) for time in (0, -(10**8), 10**8)]
    for size in (1, 10**6):
        path = bag(tmp_path / "a.mcap", {"/joint_states": (STATE, messages)}, chunk_size=size)
        assert read_mcap(path).times.tolist() == [0.0, -0.1, 0.1]


def test_the_first_number_that_is_none_is_told(tmp_path: Path) -> None:
    messages = [state(k, [0.0, np.nan if k > 1 else 0.0, np.inf if k > 2 else 0.0]) for k in range(5)]
    text = refused(bag(tmp_path / "a.mcap", {"/joint_states": (STATE, messages)}))
    assert "the position of a in message 2 of /joint_states" in text


def refusal(path: Path, topic: str | None = None, **options: str) -> tuple[str, str]:
    with pytest.raises(InputError) as caught:
        open_motion(path, topic=topic, **options)
    (problem,) = caught.value.problems
    return problem.message, problem.hint or ""


def with_a_text(path: Path, **topics: str) -> Path:
    """Write a log with a text in one topic, and states in others."""
    from mcap_ros2.writer import Writer

    from trajcli.streams.mcap.definitions import definition_of

    with path.open("wb") as stream:
        writer = Writer(stream)
        for topic, kind in topics.items():
            definition = "string data" if kind == STRING else definition_of(kind)
            schema = writer.register_msgdef(kind, definition)
            message = {"data": "no joints"} if kind == STRING else state(CLOCK, [1.0, 2.0, 3.0])
            writer.write_message(f"/{topic}", schema, message, log_time=0, publish_time=0)
        writer.finish()
    return path


def test_a_topic_of_the_usual_name_that_holds_no_joints_is_passed_over(tmp_path: Path) -> None:
    path = with_a_text(tmp_path / "a.mcap", joint_states=STRING, arm=STATE)
    assert read_mcap(path).topic == "/arm"
    assert read_mcap(path).position.tolist() == [[1.0, 2.0, 3.0]]
    message, hint = refusal(path, "/joint_states")
    assert f"/joint_states of {path} holds {STRING}" in message
    assert hint.endswith("are read: /arm")


def test_of_several_topics_those_with_joints_are_named(tmp_path: Path) -> None:
    path = with_a_text(tmp_path / "a.mcap", arm=STATE, hand=STATE, chatter=STRING)
    message, hint = refusal(path)
    assert "has several topics with joints" in message
    assert "/arm" in hint
    assert "/hand" in hint
    assert "/chatter" not in hint


def test_a_definition_of_a_controller_without_states_is_refused(tmp_path: Path) -> None:
    path = raw_log(tmp_path / "a.mcap", schema="control_msgs/msg/JointTrajectoryControllerState")
    assert "is of an unknown form" in refusal(path, field="reference")[0]
