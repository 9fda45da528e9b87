"""Logs of ours packed anew by tools of others: other chunks, other orders, parts that do not fit any more."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from streams.mcap.conftest import read_mcap, write_log

from trajcli.errors import InputError
from trajcli.job.read import job_from_text
from trajcli.planning.plan import plan_job
from trajcli.streams.recorded_motion import open_motion

STATES, ACCELERATIONS = "/joint_states", "/joint_accelerations"
JOB = """
version: 1
robot: ur5e
start: {joints: [0, -1.5, 1.5, 0, 0.1, 0.2]}
moves: [{planner: quintic, to: {joints: [0.3, -1.2, 1.4, 0.1, 0.2, 0.4]}, duration: 0.6}]
output: {rate: 100, columns: [t, q, qd, qdd, tau]}
"""
Messages = list[tuple[str, int, bytes]]


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_log(plan_job(job_from_text(JOB)), tmp_path_factory.mktemp("log") / "a.mcap")


def packed(
    log: Path, path: Path, order: Callable[[Messages], Messages], size: int, name: str = "trajcli"
) -> Path:
    """Write the states and accelerations of a log in an order of their own, in chunks of about a size."""
    from mcap.reader import make_reader
    from mcap.writer import Writer

    with log.open("rb") as stream:
        reader = make_reader(stream)
        found = [
            (schema, channel.topic, message)
            for schema, channel, message in reader.iter_messages([STATES, ACCELERATIONS])
        ]
        (record,) = reader.iter_metadata()
    with path.open("wb") as out:
        writer = Writer(out, chunk_size=size)
        writer.start("ros2", "somebody")
        schema: Any = found[0][0]
        number = writer.register_schema(schema.name, schema.encoding, schema.data)
        channels = {topic: writer.register_channel(topic, "cdr", number) for topic in (STATES, ACCELERATIONS)}
        writer.add_metadata(name, record.metadata)
        for topic, time, data in order([(topic, each.log_time, each.data) for _, topic, each in found]):
            writer.add_message(channels[topic], time, data, time)
        writer.finish()
    return path


def of_topics(messages: Messages, *topics: str) -> Messages:
    return [message for topic in topics for message in messages if message[0] == topic]


def by_turns(first: int, second: int) -> Callable[[Messages], Messages]:
    """Return an order in which so many states stand before so many accelerations, and so on."""

    def order(messages: Messages) -> Messages:
        states, others, mixed = of_topics(messages, STATES), of_topics(messages, ACCELERATIONS), Messages()
        while states or others:
            mixed += states[:first] + others[:second]
            states, others = states[first:], others[second:]
        return mixed

    return order


@pytest.mark.parametrize("size", [1, 900, 5000, 10**6])
@pytest.mark.parametrize(
    "order",
    [
        lambda messages: of_topics(messages, STATES, ACCELERATIONS),
        lambda messages: of_topics(messages, ACCELERATIONS, STATES),
        by_turns(7, 3),
        by_turns(2, 11),
    ],
    ids=["states first", "accelerations first", "many states", "many accelerations"],
)
def test_states_find_their_accelerations_however_they_are_packed(
    order: Callable[[Messages], Messages], size: int, log: Path, tmp_path: Path
) -> None:
    wanted, found = read_mcap(log), read_mcap(packed(log, tmp_path / "b.mcap", order, size))
    for name in ("times", "position", "velocity", "acceleration", "effort"):
        assert getattr(found, name).tobytes() == getattr(wanted, name).tobytes(), name
    assert found.acceleration.shape == found.effort.shape == found.position.shape


def _one_less(topic: str) -> Callable[[Messages], Messages]:
    def order(messages: Messages) -> Messages:
        gone = of_topics(messages, topic)[-1]
        return [message for message in messages if message is not gone]

    return order


def _renamed(messages: Messages) -> Messages:
    return [
        (topic, time, data.replace(b"elbow", b"knee_") if topic == ACCELERATIONS else data)
        for topic, time, data in messages
    ]


def _later(messages: Messages) -> Messages:
    """Return the same with an acceleration a nanosecond later, by its stamp."""
    (wanted, *_) = of_topics(messages, ACCELERATIONS)[5:]

    def moved(data: bytes) -> bytes:
        return data[:8] + (int.from_bytes(data[8:12], "little") + 1).to_bytes(4, "little") + data[12:]

    return [(t, at, moved(data) if (t, at, data) == wanted else data) for t, at, data in messages]


@pytest.mark.parametrize(
    "order",
    [_one_less(STATES), _one_less(ACCELERATIONS), _renamed, _later],
    ids=["fewer states", "fewer accelerations", "other joints", "other stamps"],
)
@pytest.mark.parametrize("size", [900, 10**6])
def test_accelerations_that_do_not_belong_to_the_states_are_refused(
    order: Callable[[Messages], Messages], size: int, log: Path, tmp_path: Path
) -> None:
    path = packed(log, tmp_path / "b.mcap", order, size)
    with pytest.raises(
        InputError, match="/joint_accelerations has other stamps or joints than /joint_states"
    ):
        read_mcap(path)


def test_a_number_that_is_none_is_named_by_its_message_and_joint(log: Path, tmp_path: Path) -> None:
    """Counted over all chunks, as the rows of any file are."""

    def order(messages: Messages) -> Messages:
        states = of_topics(messages, STATES)
        topic, time, data = states[40]
        at = data.index(read_mcap(log).velocity[40, 2].tobytes())
        states[40] = topic, time, data[:at] + np.float64(np.inf).tobytes() + data[at + 8 :]
        return states + of_topics(messages, ACCELERATIONS)

    with pytest.raises(InputError, match="the velocity of elbow_joint in message 40 of /joint_states"):
        read_mcap(packed(log, tmp_path / "b.mcap", order, 900))


def _without_effort(message: int, value: float = np.nan) -> Callable[[Messages], Messages]:
    """Return an order in which the last joint has no effort in one message."""

    def order(messages: Messages) -> Messages:
        states = of_topics(messages, STATES)
        topic, time, data = states[message]
        states[message] = topic, time, data[:-8] + np.float64(value).tobytes()
        return states + of_topics(messages, ACCELERATIONS)

    return order


@pytest.mark.parametrize("size", [900, 10**6])
def test_efforts_that_are_none_at_the_start_are_left_out_with_a_note(
    log: Path, size: int, tmp_path: Path
) -> None:
    """Drivers without sensors say so; a state has its numbers all the same."""
    found = open_motion(packed(log, tmp_path / "b.mcap", _without_effort(0), size))
    assert (found.rows, found.quantities) == (61, ("q", "qd", "qdd"))
    assert found.notes == (
        "efforts are left out: the effort of wrist_3_joint in message 0 of /joint_states is nan",
    )
    assert found.whole().tau is None
    assert found.whole().q.tobytes() == read_mcap(log).position.tobytes()


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_later_effort_that_is_none_is_refused_unless_efforts_are_left_out(
    value: float, log: Path, tmp_path: Path
) -> None:
    path = packed(log, tmp_path / "b.mcap", _without_effort(40, value), 900)
    said = f"the effort of wrist_3_joint in message 40 of /joint_states is {value}"
    with pytest.raises(InputError, match=said):
        open_motion(path)
    found = open_motion(path, columns="tau=none")
    assert (found.rows, found.quantities) == (61, ("q", "qd", "qdd"))
    whole = open_motion(log).whole()
    assert whole.tau is not None
    assert whole.tau.tobytes() == read_mcap(log).effort.tobytes()


def test_only_in_a_log_of_ours_a_topic_of_accelerations_is_that(log: Path, tmp_path: Path) -> None:
    """Elsewhere it is a topic like others, which need not have the stamps of the states."""
    found = read_mcap(packed(log, tmp_path / "b.mcap", _one_less(ACCELERATIONS), 900, "somebody"))
    assert found.position.tobytes() == read_mcap(log).position.tobytes()
    assert found.acceleration.shape == (61, 0)


def test_the_other_topics_of_a_log_of_ours_are_read_alone(log: Path) -> None:
    wanted = read_mcap(log)
    assert open_motion(log, topic=ACCELERATIONS).whole().q.tobytes() == wanted.acceleration.tobytes()
    assert read_mcap(log, ACCELERATIONS).position.tobytes() == wanted.acceleration.tobytes()
    assert read_mcap(log, "/joint_trajectory").velocity[-1].tolist() == [0.0] * 6
