"""Logs of others: written by the mcap library and its ROS 2 writer, spoilt in every way."""

from __future__ import annotations

import contextlib
import struct
import tracemalloc
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from streams.mcap.conftest import plan_of, read_mcap, write_log
from tiers import few

from trajcli.errors import InputError
from trajcli.knots import knots_of
from trajcli.planning.plan import Plan
from trajcli.streams.mcap.definitions import definition_of
from trajcli.streams.mcap.read import LoggedMotion

NAMES = ["b", "a", "çc"]
STATE, TRAJECTORY = "sensor_msgs/msg/JointState", "trajectory_msgs/msg/JointTrajectory"


def stamp(nanoseconds: int) -> dict:
    return {"sec": nanoseconds // 10**9, "nanosec": nanoseconds % 10**9}


def state(time: int, q, qd=(), names=NAMES, frame="base", effort=()) -> dict:
    header = {"stamp": stamp(time), "frame_id": frame}
    return {
        "header": header,
        "name": list(names),
        "position": list(q),
        "velocity": list(qd),
        "effort": list(effort),
    }


def states(count: int, start: int = 0) -> tuple[np.ndarray, list[dict]]:
    values = np.random.default_rng(3).normal(size=(count, 6))
    messages = [
        state(start + k * 10**7, row[:3], row[3:], frame="base" * (1 + k % 3)) for k, row in enumerate(values)
    ]
    return values, messages


def bag(path: Path, messages: dict[str, tuple[str, list[dict]]], clock: int = 0, **options) -> Path:
    """Write messages by topic, one after the other in time, as mcap_ros2 does."""
    from mcap.writer import CompressionType, Writer  # noqa: F401
    from mcap_ros2.writer import Writer as RosWriter

    with path.open("wb") as stream:
        writer = RosWriter(stream, **options)
        for topic, (kind, each) in messages.items():
            schema = writer.register_msgdef(kind, definition_of(kind))
            for k, message in enumerate(each):
                time = clock + k * 10**7
                writer.write_message(topic, schema, message, log_time=time, publish_time=time)
        writer.finish()
    return path


@pytest.mark.parametrize("compression", ["NONE", "LZ4", "ZSTD"])
@pytest.mark.parametrize("chunk_size", [1000, 10**6])
def test_states_of_a_bag_are_read_bit_by_bit(compression: str, chunk_size: int, tmp_path: Path) -> None:
    from mcap.writer import CompressionType

    values, messages = states(500)
    other = [state(k, [9.0]) | {"name": ["gripper"]} for k in range(30)]
    path = bag(
        tmp_path / "a.mcap",
        {"/gripper": (STATE, other), "/joint_states": (STATE, messages)},
        compression=CompressionType[compression],
        chunk_size=chunk_size,
    )
    motion = read_mcap(path)
    assert motion.joint_names == tuple(NAMES)
    assert motion.times.tolist() == [k * 10**7 / 1e9 for k in range(500)]
    assert motion.position.tobytes() == np.ascontiguousarray(values[:, :3]).tobytes()
    assert motion.velocity.tobytes() == np.ascontiguousarray(values[:, 3:]).tobytes()
    assert motion.acceleration.shape == (500, 0)
    assert read_mcap(path, "/gripper").position.tolist() == [[9.0]] * 30


@pytest.mark.parametrize("options", [
    {"use_chunking": False}, {"use_statistics": False, "use_summary_offsets": False}, {"enable_crcs": False},
    {"index_types": "NONE"}, {"index_types": "NONE", "repeat_channels": False, "repeat_schemas": False},
    {"repeat_channels": False, "repeat_schemas": False},
])  # fmt: skip
def test_bags_without_chunks_indices_or_summary_are_read(options: dict, tmp_path: Path) -> None:
    from mcap.writer import IndexType, Writer
    from mcap_ros2._dynamic import serialize_dynamic

    values, messages = states(60)
    encode = serialize_dynamic(STATE, definition_of(STATE))[STATE]
    if "index_types" in options:
        options = {**options, "index_types": IndexType[options["index_types"]]}
    with (tmp_path / "a.mcap").open("wb") as stream:
        writer = Writer(stream, **options)
        writer.start("ros2", "somebody")
        schema = writer.register_schema(STATE, "ros2msg", definition_of(STATE).encode())
        channels = [writer.register_channel(f"/j{k}", "cdr", schema) for k in range(2)]
        for k, message in enumerate(messages):
            for channel in channels:
                writer.add_message(channel, k, bytes(encode(message)), k)
        writer.finish()
    assert read_mcap(tmp_path / "a.mcap", "/j1").position.tobytes() == values[:, :3].tobytes()


def test_times_of_a_clock_count_from_the_first(tmp_path: Path) -> None:
    _, messages = states(5, start=1_767_225_600 * 10**9 + 123)
    motion = read_mcap(bag(tmp_path / "a.mcap", {"/x": (STATE, messages)}))
    assert motion.times.tolist() == [0.0, 0.01, 0.02, 0.03, 0.04]
    unstamped = [state(0, [1.0, 2.0, 3.0]) for _ in range(3)]
    motion = read_mcap(bag(tmp_path / "b.mcap", {"/x": (STATE, unstamped)}, clock=10**18))
    assert motion.times.tolist() == [0.0, 0.01, 0.02]
    late = bag(tmp_path / "c.mcap", {"/x": (STATE, unstamped)}, clock=2**63)
    with pytest.raises(InputError, match=r"a message of /x is logged at 9223372036854775808 ns or later"):
        read_mcap(late)


def _none() -> Any:
    from mcap.writer import CompressionType

    return CompressionType.NONE


def raw_messages(path: Path, times: list[int], channels: int, **options: object) -> Path:
    """Write states by turns into several channels of one topic."""
    from mcap.writer import Writer
    from mcap_ros2._dynamic import serialize_dynamic

    encode = serialize_dynamic(STATE, definition_of(STATE))[STATE]
    with path.open("wb") as stream:
        writer = Writer(stream, **options)
        writer.start("ros2", "somebody")
        schema = writer.register_schema(STATE, "ros2msg", definition_of(STATE).encode())
        known = [writer.register_channel("/x", "cdr", schema, {"by": str(k)}) for k in range(channels)]
        for k, time in enumerate(times):
            writer.add_message(
                known[k % channels], 10**18 + k * 10**7, bytes(encode(state(time, [k, 0.0, 0.0]))), 0
            )
        writer.finish()
    return path


@pytest.mark.parametrize("start", [0, 7 * 10**8])
def test_one_stamp_of_zero_does_not_make_the_recorder_count(start: int, tmp_path: Path) -> None:
    """Of a simulation that starts at 0, its messages in no chunks: each is a block of its own."""
    times = [0, *(start + k * 10**7 for k in (1, 2, 3))]
    path = raw_messages(tmp_path / "a.mcap", times, 1, use_chunking=False)
    assert read_mcap(path).times.tolist() == [time / 1e9 for time in times]
    path = raw_messages(tmp_path / "b.mcap", [0, 0, 0], 1, use_chunking=False)
    assert read_mcap(path).times.tolist() == [0.0, 0.01, 0.02]


@pytest.mark.parametrize("chunked", [True, False])
def test_stamps_of_any_of_the_channels_of_a_topic_count(chunked: bool, tmp_path: Path) -> None:
    times = [0, 5 * 10**7, 0, 6 * 10**7]
    for by_turns in (times, times[::-1]):
        path = raw_messages(tmp_path / "a.mcap", by_turns, 2, use_chunking=chunked)
        assert read_mcap(path).times.tolist() == [time / 1e9 for time in by_turns]


def test_channels_of_one_topic_are_read_in_the_order_of_their_messages(tmp_path: Path) -> None:
    times = [k * 10**7 for k in range(30)]
    motion = read_mcap(raw_messages(tmp_path / "a.mcap", times, 3))
    assert motion.times.tolist() == [time / 1e9 for time in times]
    assert motion.position[:, 0].tolist() == list(range(30))


def test_a_log_of_ours_may_begin_before_its_epoch(tmp_path: Path) -> None:
    plan = plan_of("cubic", "output.start_time=-0.5", "output.rate=10")
    motion = read_mcap(write_log(plan, tmp_path / "a.mcap", epoch="1767225600"))
    assert motion.times[:6].tolist() == [-0.5, -0.4, -0.3, -0.2, -0.1, 0.0]
    assert read_mcap(tmp_path / "a.mcap", "/joint_trajectory").times[0] == 0.0


def test_an_index_that_ends_early_is_one_error(tmp_path: Path) -> None:
    data = raw_messages(tmp_path / "a.mcap", [0, 10**7, 2 * 10**7], 1).read_bytes()
    at, out = 8, data[:8]
    while at < len(data) - 8:
        kind, length = struct.unpack_from("<BQ", data, at)
        content = data[at + 9 : at + 9 + length]
        content = {7: content[:20], 2: bytes(20)}.get(kind, content)  # an index, and no summary
        out += struct.pack("<BQ", kind, len(content)) + content
        at += 9 + length
    (tmp_path / "b.mcap").write_bytes(out + data[-8:])
    assert "a record is damaged" in refused(tmp_path / "b.mcap")


@pytest.mark.parametrize("sized", [True, False])
@pytest.mark.parametrize("frames", [1, 2, 5])
def test_a_chunk_of_several_frames_is_read(frames: int, sized: bool, tmp_path: Path) -> None:
    """As a writer makes it that flushes its compressor now and then, with or without the size in its frames."""
    import zstandard

    times = [k * 10**7 for k in range(20)]
    data = raw_messages(tmp_path / "a.mcap", times, 1, compression=_none()).read_bytes()
    at, out = 8, data[:8]
    while data[at] not in (15, 7):  # the end of the data, or an index
        kind, length = struct.unpack_from("<BQ", data, at)
        content = data[at + 9 : at + 9 + length]
        if kind == 6:
            packer, plain = zstandard.ZstdCompressor(write_content_size=sized), content[40:]
            cuts = np.linspace(0, len(plain), frames + 1).astype(int).tolist()
            packed = b"".join(packer.compress(plain[a:b]) for a, b in pairwise(cuts))
            content = content[:28] + struct.pack("<I4sQ", 4, b"zstd", len(packed)) + packed
        out += struct.pack("<BQ", kind, len(content)) + content
        at += 9 + length
    (tmp_path / "b.mcap").write_bytes(out + struct.pack("<BQQQI", 2, 20, 0, 0, 0) + data[:8])
    assert read_mcap(tmp_path / "b.mcap").times.tolist() == [time / 1e9 for time in times]


@pytest.mark.parametrize("size", few(range(31), 6))
def test_a_message_that_ends_in_its_head_is_one_error(size: int, tmp_path: Path) -> None:
    """In no chunk, whose walk would see it; behind whole ones, or the only one."""
    short = struct.pack("<BQHIQQ", 5, max(size - 9, 0), 1, 0, 0, 0)[: max(size, 9)]
    for stamps in ([], [0, 10**7]):
        data = raw_messages(tmp_path / "a.mcap", stamps, 1, use_chunking=False).read_bytes()
        at = data.index(struct.pack("<BQI", 15, 4, 0)[:9])  # the end of the data
        end = struct.pack("<BQQQI", 2, 20, 0, 0, 0) + data[:8]  # and no summary
        (tmp_path / "b.mcap").write_bytes(data[:at] + short + end)
        assert "damaged" in refused(tmp_path / "b.mcap")


def test_a_chunk_that_claims_more_bytes_than_there_can_be_is_one_error(tmp_path: Path) -> None:
    data = bytearray(raw_messages(tmp_path / "a.mcap", [0, 10**7], 1, compression=_none()).read_bytes())
    (tmp_path / "b.mcap").write_bytes(data)
    read_mcap(tmp_path / "b.mcap")
    at = 8
    while data[at] != 6:
        at += 9 + struct.unpack_from("<Q", data, at + 1)[0]
    struct.pack_into("<Q", data, at + 9 + 8 + 8 + 8 + 4 + 4, 2**63)  # behind an empty name of a compression
    (tmp_path / "b.mcap").write_bytes(data)
    assert "a record is damaged (OverflowError)" in refused(tmp_path / "b.mcap")


@pytest.mark.parametrize("epoch", ["²", "9" * 5000, str(2**63), str(2**64), "9" * 19, "soon", "-5"])
def test_an_epoch_that_is_no_time_of_a_log_is_none(epoch: str, tmp_path: Path) -> None:
    """Metadata under our name may be anybody's: times count as in any other log."""
    from mcap.writer import Writer
    from mcap_ros2._dynamic import serialize_dynamic

    encode = serialize_dynamic(STATE, definition_of(STATE))[STATE]
    with (tmp_path / "a.mcap").open("wb") as stream:
        writer = Writer(stream)
        writer.start("ros2", "somebody")
        schema = writer.register_schema(STATE, "ros2msg", definition_of(STATE).encode())
        channel = writer.register_channel("/x", "cdr", schema)
        writer.add_message(channel, 0, bytes(encode(state(2 * 10**9, [1.0, 2.0, 3.0]))), 0)
        writer.add_metadata("trajcli", {"epoch": epoch})
        writer.finish()
    assert read_mcap(tmp_path / "a.mcap").times.tolist() == [2.0]


def test_a_trajectory_without_points_is_one_error(tmp_path: Path) -> None:
    message = trajectory(1)[1] | {"points": []}
    assert "it has no points" in refused(bag(tmp_path / "a.mcap", {"/goal": (TRAJECTORY, [message])}))


def trajectory(count: int, *, accelerations: bool = True) -> tuple[np.ndarray, dict]:
    values = np.random.default_rng(4).normal(size=(count, 9))
    points = [
        {
            "positions": row[:3].tolist(),
            "velocities": row[3:6].tolist(),
            "accelerations": row[6:].tolist() if accelerations else [],
            "effort": [],
            "time_from_start": stamp(k * 123456789),
        }
        for k, row in enumerate(values)
    ]
    return values, {"header": {"stamp": stamp(5), "frame_id": "x"}, "joint_names": NAMES, "points": points}


@pytest.mark.parametrize("accelerations", [True, False])
def test_a_trajectory_is_read(accelerations: bool, tmp_path: Path) -> None:
    values, message = trajectory(20, accelerations=accelerations)
    motion = read_mcap(bag(tmp_path / "a.mcap", {"/goal": (TRAJECTORY, [message])}))
    assert motion.joint_names == tuple(NAMES)
    assert motion.times.tolist() == [k * 123456789 / 1e9 for k in range(20)]
    assert (motion.position == values[:, :3]).all()
    assert (motion.velocity == values[:, 3:6]).all()
    assert motion.acceleration.tolist() == (values[:, 6:].tolist() if accelerations else [[]] * 20)


def test_our_log_gives_accelerations_and_knots(pick: Plan, pick_log: Path, tmp_path: Path) -> None:
    motion = read_mcap(pick_log)
    later = read_mcap(write_log(pick, tmp_path / "a.mcap", epoch="1767225600"))
    for each in (motion, later):
        assert each.joint_names == pick.trajectory.joint_names
        at = np.minimum(each.times, pick.trajectory.duration)
        wanted = pick.trajectory.curve.evaluate_orders(at, (0, 1, 2))
        assert each.acceleration.shape == each.position.shape
        assert np.abs(each.position - wanted[:, 0]).max() < 1e-8
        assert np.abs(each.acceleration - wanted[:, 2])[1:-1].mean() < 1e-5
    knots, read = knots_of(pick.trajectory), read_mcap(pick_log, "/joint_trajectory")
    assert read.times.tolist() == (knots.nanoseconds / 1e9).tolist()
    for name in ("position", "velocity", "acceleration"):
        assert getattr(read, name).tobytes() == getattr(knots, name).tobytes()


def refused(path: Path, topic: str | None = None) -> str:
    """Return the message and hint of the one problem with which a file is refused."""
    with pytest.raises(InputError) as caught:
        read_mcap(path, topic)
    (problem,) = caught.value.problems
    assert str(path) in problem.message
    return f"{problem.message}; {problem.hint}"


@pytest.mark.parametrize("share", np.linspace(0.0, 0.999, 40))
def test_a_truncated_file_is_one_error(share: float, pick_log: Path, tmp_path: Path) -> None:
    data = pick_log.read_bytes()
    path = tmp_path / "cut.mcap"
    path.write_bytes(data[: int(share * len(data))])
    text = refused(path)
    assert "truncated" in text if share else "no MCAP file" in text


@pytest.mark.full
def test_every_end_is_an_error(tmp_path: Path) -> None:
    _, messages = states(3)
    data = bag(tmp_path / "a.mcap", {"/x": (STATE, messages)}).read_bytes()
    path = tmp_path / "b.mcap"
    for size in range(len(data)):
        path.write_bytes(data[:size])
        refused(path)


@pytest.mark.full
def test_a_changed_byte_is_found_or_harmless(tmp_path: Path) -> None:
    """Whatever byte is wrong: one clear error, or the same states as before."""
    values, messages = states(4)
    data = bytearray(bag(tmp_path / "a.mcap", {"/x": (STATE, messages)}).read_bytes())
    path, found = tmp_path / "b.mcap", 0
    for at in range(0, len(data), 3):
        changed = bytearray(data)
        changed[at] ^= 0xFF
        path.write_bytes(changed)
        with contextlib.suppress(InputError):
            assert (read_mcap(path, "/x").position == values[:, :3]).all()
            continue
        found += 1
    assert found > len(data) / 3 / 4


def test_other_files_and_topics_are_named(tmp_path: Path, pick_log: Path) -> None:
    assert "'/joint_state'; did you mean '/joint_states'?" in refused(pick_log, "/joint_state")
    assert "holds tf2_msgs/msg/TFMessage" in refused(pick_log, "/tf")
    text = tmp_path / "text.mcap"
    text.write_text("t,q1\n0,1\n" * 10)
    assert "no MCAP file" in refused(text)
    _, messages = states(3)
    several = bag(tmp_path / "s.mcap", {"/x": (STATE, messages), "/y": (STATE, messages)})
    assert "several topics" in refused(several)
    assert "/x, /y" in refused(several)
    _, message = trajectory(3)
    two = bag(tmp_path / "t.mcap", {"/goal": (TRAJECTORY, [message, message])})
    assert "several trajectories" in refused(two)
    assert "no messages" in refused(raw_log(tmp_path / "e.mcap"))
    assert "no topic with joints" in refused(bag(tmp_path / "n.mcap", {}))


def test_messages_that_do_not_belong_together_are_refused(tmp_path: Path) -> None:
    cases = {
        "other joints": [state(0, [1.0, 2, 3]), state(1, [1.0, 2, 3], names="abc")],
        "other joints or quantities than the first": [
            state(0, [1.0, 2, 3]),
            state(1, [1.0, 2, 3], names=["a", "b", "çc"]),
        ],
        "3 joints": [state(0, [1.0, 2.0])],
        "other joints or quantities": [state(0, [1.0, 2, 3]), state(1, [1.0, 2, 3], [1.0, 2, 3])],
        "is nan": [state(0, [1.0, np.nan, 3])],
    }
    for k, (words, messages) in enumerate(cases.items()):
        assert words in refused(bag(tmp_path / f"{k}.mcap", {"/x": (STATE, messages)}))


@pytest.mark.parametrize("other", [{"names": ["a", "b", "çc"]}, {"qd": [1.0, 2, 3]}])
def test_chunks_that_do_not_belong_together_are_refused(other: dict, tmp_path: Path) -> None:
    messages = [state(0, [1.0, 2, 3]), state(1, [1.0, 2, 3], **other)]
    path = bag(tmp_path / "two.mcap", {"/joint_states": (STATE, messages)}, chunk_size=1)
    assert "are about different joints or quantities" in refused(path)


def raw_log(
    path: Path, *, compression: str = "", content: bytes = b"", size: int | None = None, **channel: str
) -> Path:
    """Write a log of one chunk whose content is as it is given."""
    from mcap.records import Channel, Chunk, Footer, Header, Schema
    from mcap.writer import MCAP0_MAGIC, RecordBuilder

    builder = RecordBuilder()
    builder.write(MCAP0_MAGIC)
    encoding = channel.get("encoding", "cdr")
    size = len(content) if size is None else size
    for record in (
        Header(profile="ros2", library="x"),
        Schema(id=1, name=channel.get("schema", STATE), encoding="ros2msg", data=b""),
        Channel(id=1, schema_id=1, topic="/x", message_encoding=encoding, metadata={}),
        Chunk(
            message_start_time=0, message_end_time=0, uncompressed_size=size, uncompressed_crc=0,
            compression=compression, data=content,
        ),
        Footer(summary_start=0, summary_offset_start=0, summary_crc=0),
    ):  # fmt: skip
        record.write(builder)
    builder.write(MCAP0_MAGIC)
    path.write_bytes(builder.end())
    return path


def test_unknown_compression_schema_and_encoding_are_named(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    assert "compressed by 'br', at byte" in refused(raw_log(path, compression="br", content=b"x" * 20))
    assert "cannot be unpacked" in refused(raw_log(path, compression="zstd", content=b"x" * 20))
    assert "cannot be unpacked" in refused(raw_log(path, compression="lz4", content=b"x" * 20))
    for topic in ("/x", None):
        assert "encoded as 'json'" in refused(raw_log(path, encoding="json"), topic)
    assert "holds acme/msg/State" in refused(raw_log(path, schema="acme/msg/State"), "/x")


def message_record(data: bytes) -> bytes:
    return struct.pack("<BQHIQQ", 5, 22 + len(data), 1, 0, 0, 0) + data


@pytest.mark.parametrize("data", [
    b"", b"\0", b"\0\1\0\0", b"\0\1\0\0" + bytes(8), b"\0\1\0\0" + bytes(8) + b"\xff\xff\xff\xff",
    b"\0\1\0\0" + bytes(12) + b"\xff\xff\xff\x7f", b"\0\7\0\0" + bytes(40), bytes([0, 3, 0, 0]) + bytes(40),
])  # fmt: skip
def test_damaged_messages_are_refused(data: bytes, tmp_path: Path) -> None:
    text = refused(raw_log(tmp_path / "a.mcap", content=message_record(data)))
    assert "cannot be read" in text


def test_big_endian_messages_are_read(tmp_path: Path) -> None:
    data = b"\0\0\0\0" + struct.pack(">iII", 1, 500_000_000, 1) + b"\0" + b"\0" * 3
    data += struct.pack(">II", 1, 2) + b"j\0" + b"\0\0" + struct.pack(">I", 1)
    data += bytes(-(len(data) - 4) % 8) + struct.pack(">d", 0.25) + struct.pack(">II", 0, 0)
    motion = read_mcap(raw_log(tmp_path / "a.mcap", content=message_record(data)))
    assert (motion.joint_names, motion.times.tolist()) == (("j",), [1.5])
    assert motion.position.tolist() == [[0.25]]


def peak_of(path: Path) -> float:
    tracemalloc.start()
    try:
        refused(path)
        return tracemalloc.get_traced_memory()[1] / 1e6
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("kind", ["zeros", "attachment", "chunk", "message", "text", "bomb", "claim"])
def test_a_file_of_two_gigabytes_takes_no_memory(kind: str, tmp_path: Path) -> None:
    path = tmp_path / "big.mcap"
    head = b"\x89MCAP0\r\n" + b"\x01" + struct.pack("<Q", 8) + bytes(8)
    if kind == "text":
        head = b"t,q1\n"
    if kind in ("attachment", "chunk", "message"):
        number = {"attachment": 9, "chunk": 6, "message": 5}[kind]
        head += struct.pack("<BQ", number, (1 << 31) - 100)
    if kind in ("bomb", "claim"):
        import zstandard

        content = zstandard.compress(bytes(1 << 30)) if kind == "bomb" else b"1234567890"
        raw_log(path, compression="zstd", content=content, size=1000 if kind == "bomb" else 1 << 40)
    else:
        with path.open("wb") as stream:
            stream.write(head)
            stream.truncate(1 << 31)
    assert peak_of(path) < 60


def test_motion_is_a_value(pick_log: Path) -> None:
    motion = read_mcap(pick_log)
    assert isinstance(motion, LoggedMotion)
    assert motion.topic == "/joint_states"


def test_efforts_and_velocities_are_read_as_what_they_are(tmp_path: Path) -> None:
    """Of position, velocity and effort each may be there or not; a JointState has no acceleration."""
    values = np.random.default_rng(5).normal(size=(20, 9))
    for qd, effort in ((True, True), (False, True), (True, False)):
        messages = [
            state(10**18 + k * 10**7, row[:3], row[3:6] if qd else (), effort=row[6:] if effort else ())
            for k, row in enumerate(values)
        ]
        found = read_mcap(bag(tmp_path / "a.mcap", {"/joint_states": (STATE, messages)}))
        np.testing.assert_array_equal(found.position, values[:, :3])
        np.testing.assert_array_equal(found.velocity, values[:, 3:6] if qd else np.empty((20, 0)))
        np.testing.assert_array_equal(found.effort, values[:, 6:] if effort else np.empty((20, 0)))
        assert found.acceleration.shape == (20, 0)


def test_points_before_the_start_of_a_trajectory_have_negative_times(tmp_path: Path) -> None:
    """A duration of -0.25 s is -1 s and 750,000,000 ns."""
    _, message = trajectory(3)
    message["points"][0]["time_from_start"] = {"sec": -1, "nanosec": 750_000_000}
    kind = "trajectory_msgs/msg/JointTrajectory"
    found = read_mcap(bag(tmp_path / "a.mcap", {"/plan": (kind, [message])}))
    assert found.times[0] == -0.25
