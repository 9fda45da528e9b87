"""Logs of made-up rows and frames: every message at its time, in its order and its chunk, as others read them."""

from __future__ import annotations

import struct
import zlib
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from io import BytesIO
from typing import Any

import numpy as np
import pytest

from trajcli.columns import columns_of
from trajcli.errors import TrajcliError
from trajcli.knots import Deviation, Knots
from trajcli.streams.mcap.definitions import definition_of
from trajcli.streams.mcap.recording import (
    AttachedFile,
    Compression,
    LinkFrames,
    LoggedPath,
    Recording,
)
from trajcli.streams.mcap.write import write_mcap_blocks
from trajcli.units import Units

NAMES = ("a", "bc")
EPOCH, ORIGIN = 1_700_000_000_000_000_007, 1_700_000_000_000_000_007 + 2_500_000_000
LARGEST = 4096  # rows, and frames, in a chunk


def pose_of(nanoseconds: np.ndarray) -> np.ndarray:
    """Return poses (N, 2, 7) that tell their time and their link."""
    return nanoseconds[:, None, None] * 1e-9 + np.arange(14.0).reshape(2, 7)


def recording(
    duration: float,
    signals: dict[str, Any] | None = None,
    compression: Compression = "none",
    *,
    frames: bool = True,
) -> Recording:
    end, still = round(duration * 1e9), np.zeros((2, 2))
    knots = Knots(np.array([0, max(end, 1)]), still, still, still, Deviation(0.0, 0.0, (0, 0)))
    standing = (("world", "base", np.arange(7.0)),)
    path = LoggedPath(np.array([0, end]), np.arange(14.0).reshape(2, 7)) if frames else None
    chain = LinkFrames("<robot/>", standing, ("base", "one", "two"), pose_of) if frames else None
    return Recording(
        NAMES, ORIGIN, EPOCH, end, knots, chain, path, (), {"a": "b"}, (), compression, signals or {}
    )


def rows_at(times: Sequence[float]) -> np.ndarray:
    """Return rows t, q, qd, qdd of two joints, each number another, that begin 2.5 s after the epoch."""
    t = np.array(times) + 2.5
    return np.concatenate([t[:, None], np.random.default_rng(len(t)).normal(size=(len(t), 6))], axis=1)


def written(made: Recording, *blocks: np.ndarray) -> bytes:
    columns, out = columns_of(("t", "q", "qd", "qdd"), ("revolute", "revolute"), Units()), BytesIO()
    done = list(write_mcap_blocks(iter(blocks), columns, out, made))
    assert [len(block) for block in done] == [len(block) for block in blocks]
    return out.getvalue()


def read(data: bytes) -> tuple[list[tuple[str, Any]], Any]:
    """Return all messages in the order of the file, and its summary."""
    from mcap.reader import make_reader

    reader = make_reader(BytesIO(data), validate_crcs=True)
    found = [(channel.topic, message) for _, channel, message in reader.iter_messages(log_time_order=False)]
    return found, reader.get_summary()


def stamp_of(data: bytes) -> int:
    seconds, nanoseconds = struct.unpack_from("<iI", data, 4)
    return int(seconds) * 10**9 + int(nanoseconds)


def decoded(data: bytes, kind: str) -> Any:
    from mcap_ros2._dynamic import generate_dynamic

    return generate_dynamic(kind, definition_of(kind))[kind](data)


CASES = {
    "many rows": (70.0, [np.linspace(0, 30, 5000), [30.5], np.linspace(31, 70, 9000)]),
    "few rows": (200.0, [[0.0], [99.0, 100.0, 150.0], [200.0]]),
    "rows that end early": (150.0, [np.linspace(0, 1, 101)]),
    "rows that begin late": (90.0, [[85.0, 90.0]]),
    "rows at the frames": (70.0, [np.arange(4201) / 60]),
    "one row": (0.0, [[0.0]]),
    "less than a frame": (0.01, [[0.0, 0.004, 0.01]]),
}


@pytest.mark.parametrize("name", CASES)
def test_each_message_is_at_its_time_in_its_order(name: str) -> None:
    duration, parts = CASES[name]
    compression: Compression = "zstd" if "rows that" in name else "none"
    blocks = [rows_at(part) for part in parts]
    data = written(recording(duration, compression=compression), *blocks)
    messages, summary = read(data)
    rows = np.concatenate(blocks)
    by_topic: dict[str, list[Any]] = {}
    for topic, message in messages:
        by_topic.setdefault(topic, []).append(message)
    times = [EPOCH + round(t * 1e9) for t in rows[:, 0].tolist()]
    for topic, first, count in (("/joint_states", 1, 4), ("/joint_accelerations", 5, 2)):
        found = by_topic[topic]
        assert [m.sequence for m in found] == list(range(len(rows)))
        assert [m.log_time for m in found] == [m.publish_time for m in found] == times
        assert [stamp_of(m.data) for m in found] == times
        wanted = rows[:, first : first + count]
        for row in {0, len(rows) // 2, len(rows) - 1}:
            for value in wanted[row].tolist():
                assert struct.pack("<d", value) in found[row].data
    intervals = max(int(duration * 60), 1) if duration else 0
    since = [round(k * duration * 1e9 / max(intervals, 1)) for k in range(intervals + 1)]
    moving = by_topic["/tf"]
    assert [m.sequence for m in moving] == list(range(len(since)))
    assert [m.log_time - ORIGIN for m in moving] == since
    for number in {0, len(since) // 2, *range(0, len(since), 997), len(since) - 1}:
        frames = decoded(moving[number].data, "tf2_msgs/msg/TFMessage").transforms
        assert [(f.header.frame_id, f.child_frame_id) for f in frames] == [("base", "one"), ("one", "two")]
        for frame, pose in zip(frames, pose_of(np.array([since[number]]))[0].tolist(), strict=True):
            stamp, move, turn = frame.header.stamp, frame.transform.translation, frame.transform.rotation
            assert stamp.sec * 10**9 + stamp.nanosec == ORIGIN + since[number]
            assert [move.x, move.y, move.z, turn.x, turn.y, turn.z, turn.w] == pose
    ordered = [(m.log_time, topic == "/tf") for topic, m in messages if topic in ("/joint_states", "/tf")]
    assert ordered == sorted(ordered)  # of those at one time the row first
    assert summary.statistics.channel_message_counts == {
        number: len(by_topic[channel.topic]) for number, channel in summary.channels.items()
    }
    _judge_chunks(data, summary)


def _judge_chunks(data: bytes, summary: Any) -> None:
    """Compare what the summary says of each chunk with its bytes and its messages."""
    from mcap.stream_reader import StreamReader, breakup_chunk

    chunks = [
        each
        for each in StreamReader(BytesIO(data), emit_chunks=True).records
        if type(each).__name__ == "Chunk"
    ]
    assert len(chunks) == len(summary.chunk_indexes)
    for chunk, said in zip(chunks, summary.chunk_indexes, strict=True):
        inside = [each for each in breakup_chunk(chunk) if type(each).__name__ == "Message"]
        times = [each.log_time for each in inside]
        assert (said.message_start_time, said.message_end_time) == (min(times), max(times))
        assert (chunk.message_start_time, chunk.message_end_time) == (min(times), max(times))
        assert (said.compressed_size, said.uncompressed_size) == (len(chunk.data), chunk.uncompressed_size)
        assert max(Counter(each.channel_id for each in inside).values()) <= LARGEST
        assert data[said.chunk_start_offset] == 6
        assert said.chunk_length == 9 + struct.unpack_from("<Q", data, said.chunk_start_offset + 1)[0]
    statistics = summary.statistics
    assert statistics.message_start_time == min(said.message_start_time for said in summary.chunk_indexes)
    assert statistics.message_end_time == max(said.message_end_time for said in summary.chunk_indexes)
    counts = statistics.chunk_count, statistics.schema_count, statistics.channel_count
    assert counts == (len(chunks), len(summary.schemas), len(summary.channels))


@pytest.mark.parametrize("frames", [True, False])
def test_signals_stand_at_their_times_also_behind_the_last_row(frames: bool) -> None:
    """Of rows at listed times, which need not reach the end."""
    signals = {
        "grip": ((0, 1.0), (3_000_000_001, 0.0), (7_999_999_999, 2.5)),
        "late": ((8_000_000_000, -1.0),),
    }
    made = recording(8.0, signals, frames=frames)
    data = written(made, rows_at([0.0, 1.0]), rows_at([2.0]))
    messages, summary = read(data)
    found = [
        (topic, m.sequence, m.log_time - ORIGIN, struct.unpack_from("<d", m.data, 4)[0])
        for topic, m in messages
        if topic.startswith("/signal/")
    ]
    wanted = [("/signal/grip", k, time, value) for k, (time, value) in enumerate(signals["grip"])]
    wanted += [("/signal/late", 0, 0, 0.0), ("/signal/late", 1, 8_000_000_000, -1.0)]
    assert sorted(found) == sorted(wanted)
    assert summary.statistics.message_end_time == ORIGIN + 8_000_000_000
    assert summary.statistics.message_start_time == ORIGIN
    _judge_chunks(data, summary)
    assert ("/tf" in {topic for topic, _ in messages}) == frames


@pytest.mark.parametrize("value", [np.inf, -np.inf, np.nan])
def test_a_block_with_a_number_that_is_none_is_not_written(value: float) -> None:
    first, second = rows_at([0.0, 0.5]), rows_at([1.0, 2.0])
    second[1, 3] = value
    columns, out = columns_of(("t", "q", "qd", "qdd"), ("revolute", "revolute"), Units()), BytesIO()
    blocks = write_mcap_blocks(iter([first, second]), columns, out, recording(2.0))
    next(blocks)
    with pytest.raises(TrajcliError, match="not finite"):
        next(blocks)


def test_what_is_sent_once_is_stamped_with_the_start_and_kept() -> None:
    """But for the knots, whose stamp of 0 means now; a path has the time of each of its poses."""
    made = recording(4.0, {"grip": ((1, 1.0),)})
    messages, summary = read(written(made, rows_at([0.0, 4.0])))
    once = {topic: message for topic, message in messages if topic not in ("/joint_states", "/tf")}
    assert all(m.publish_time == m.log_time for _, m in messages)
    assert {once[topic].log_time for topic in ("/joint_trajectory", "/tf_static", "/tool_path")} == {ORIGIN}
    (fixed,) = decoded(once["/tf_static"].data, "tf2_msgs/msg/TFMessage").transforms
    path = decoded(once["/tool_path"].data, "nav_msgs/msg/Path")
    goal = decoded(once["/joint_trajectory"].data, "trajectory_msgs/msg/JointTrajectory")
    stamps = [fixed.header, path.header, *(pose.header for pose in path.poses), goal.header]
    found = [header.stamp.sec * 10**9 + header.stamp.nanosec for header in stamps]
    assert found == [ORIGIN, ORIGIN, ORIGIN, ORIGIN + 4 * 10**9, 0]
    assert [(fixed.header.frame_id, fixed.child_frame_id), path.header.frame_id] == [
        ("world", "base"),
        "world",
    ]
    assert fixed.transform.rotation.w == 6.0
    assert [pose.pose.position.x for pose in path.poses] == [0.0, 7.0]
    assert [point.time_from_start.sec for point in goal.points] == [0, 4]
    kept = {
        channel.topic: "durability: 1" in channel.metadata["offered_qos_profiles"]
        for channel in summary.channels.values()
    }
    assert {topic for topic, value in kept.items() if not value} == {
        "/joint_states",
        "/joint_accelerations",
        "/tf",
    }


def test_attachments_are_where_the_summary_says_with_their_checksums() -> None:
    files = (
        AttachedFile("job.yaml", "application/yaml", b"version: 1"),
        AttachedFile("e", "text/plain", b""),
    )
    data = written(replace(recording(1.0), attachments=files), rows_at([0.0, 1.0]))
    _, summary = read(data)
    assert summary.statistics.attachment_count == len(files)
    for file, said in zip(files, summary.attachment_indexes, strict=True):
        kind, length = struct.unpack_from("<BQ", data, said.offset)
        content = data[said.offset + 9 : said.offset + 9 + length]
        assert (kind, said.length, said.data_size) == (9, length + 9, len(file.data))
        assert (said.name, said.media_type) == (file.name, file.media_type)
        assert content[-4 - len(file.data) : -4] == file.data
        assert struct.unpack("<I", content[-4:])[0] == zlib.crc32(content[:-4]) != 0


def test_points_of_all_blocks_count_from_the_start_of_the_motion() -> None:
    made = replace(recording(4.0), topics=("/joint_trajectory_point",))
    messages, _ = read(written(made, rows_at([0, 1.25]), rows_at([2, 3, 4])))
    points = [message.data for topic, message in messages if topic == "/joint_trajectory_point"]
    begun = [struct.unpack("<iI", data[-8:]) for data in points]
    assert begun == [(0, 0), (1, 250_000_000), (2, 0), (3, 0), (4, 0)]


def test_names_in_any_language_are_read_by_others() -> None:
    """Of joints, of attached files, and what metadata say; the lengths of texts are those of their bytes."""
    from mcap.reader import make_reader

    names, file = ("ellenbøyle", "手首"), AttachedFile("åpne.yaml", "text/yaml", "é: 1".encode())
    made = replace(recording(0.5), joint_names=names, attachments=(file,), metadata={"ø": "ü" * 5})
    data = written(made, rows_at([0.0, 0.25, 0.5]))
    reader = make_reader(BytesIO(data), validate_crcs=True)
    (attached,) = reader.iter_attachments()
    assert (attached.name, attached.data) == (file.name, file.data)
    (metadata,) = reader.iter_metadata()
    assert metadata.metadata["ø"] == "ü" * 5
    states = [message for topic, message in read(data)[0] if topic == "/joint_states"]
    decoded_states = [decoded(message.data, "sensor_msgs/msg/JointState") for message in states]
    assert [tuple(each.name) for each in decoded_states] == [names] * 3
    np.testing.assert_array_equal(
        [each.position for each in decoded_states], rows_at([0.0, 0.25, 0.5])[:, 1:3]
    )
