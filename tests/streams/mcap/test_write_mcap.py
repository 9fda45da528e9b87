"""MCAP as independent readers see it: mcap with mcap_ros2, rosbags, and rerun."""

from __future__ import annotations

import hashlib
import json
import subprocess
import sys
import tracemalloc
import zlib
from collections import Counter, defaultdict
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from extras import require_module, require_program
from scipy.spatial.transform import Rotation
from streams.mcap.conftest import EXAMPLES, plan_of, write_log
from tiers import few

from trajcli.columns import columns_of
from trajcli.errors import TrajcliError
from trajcli.grids import UniformGrid
from trajcli.kinematics.forward import forward
from trajcli.kinematics.jacobian import tcp_twist
from trajcli.knots import knots_of
from trajcli.output.recording import LogOptions, recording_of
from trajcli.output.write import grid_of
from trajcli.planning.plan import Plan
from trajcli.samples import sample
from trajcli.streams.mcap import write
from trajcli.streams.mcap.write import write_mcap_blocks
from trajcli.units import Units

BY_ROW = ["/joint_states", "/joint_accelerations", "/joint_trajectory_point", "/tool_twist"]
LATCHED = ["/joint_trajectory", "/robot_description", "/tf_static", "/tool_path"]


def read(path: Path) -> dict[str, list[SimpleNamespace]]:
    """Return all messages by topic as mcap and mcap_ros2 read them, with their times."""
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    found = defaultdict(list)
    with path.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()], validate_crcs=True)
        for _, channel, message, decoded in reader.iter_decoded_messages():
            found[channel.topic].append(
                SimpleNamespace(
                    log=message.log_time, publish=message.publish_time, sequence=message.sequence, m=decoded
                )
            )
    return found


def twists(topics: dict[str, list[SimpleNamespace]]) -> np.ndarray:
    """Return linear and angular velocity (N, 6) of the messages of a twist."""
    messages = [each.m.twist for each in topics["/tool_twist"]]
    return np.array(
        [[getattr(part, axis) for part in (m.linear, m.angular) for axis in "xyz"] for m in messages]
    )


def stamp(time) -> int:
    return time.sec * 10**9 + time.nanosec


def rows_of(plan: Plan) -> np.ndarray:
    groups = ("t", "q", "qd", "qdd")
    return np.concatenate([*sample(plan.trajectory, grid_of(plan), groups, Units())])


@pytest.fixture(scope="module")
def topics(pick_log: Path) -> dict[str, list[SimpleNamespace]]:
    return read(pick_log)


def test_the_states_of_all_rows_are_there_bit_by_bit(pick: Plan, topics) -> None:
    rows = rows_of(pick)
    nanoseconds = np.rint(rows[:, 0] * 1e9).astype(int).tolist()
    for topic in BY_ROW:
        assert [each.log for each in topics[topic]] == nanoseconds
        assert [each.publish for each in topics[topic]] == nanoseconds
        assert [each.sequence for each in topics[topic]] == list(range(len(rows)))
    states, accelerations, points = (topics[name] for name in BY_ROW[:3])
    assert [stamp(each.m.header.stamp) for each in states] == nanoseconds
    assert [stamp(each.m.header.stamp) for each in accelerations] == nanoseconds
    assert [stamp(each.m.time_from_start) for each in points] == nanoseconds
    q, qd, qdd = rows[:, 1:7], rows[:, 7:13], rows[:, 13:19]
    read_back = [
        ([each.m.position for each in states], q),
        ([each.m.velocity for each in states], qd),
        ([each.m.position for each in accelerations], qdd),
        ([each.m.positions for each in points], q),
        ([each.m.velocities for each in points], qd),
        ([each.m.accelerations for each in points], qdd),
    ]
    for found, wanted in read_back:
        assert np.array(found).tobytes() == np.ascontiguousarray(wanted).tobytes()
    for each in (*states, *accelerations):
        assert tuple(each.m.name) == pick.trajectory.joint_names
        assert len(each.m.effort) == 0
    assert all(len(each.m.velocity) == 0 for each in accelerations)
    assert all(len(each.m.effort) == 0 for each in points)


def test_the_twist_is_that_of_the_tool_in_world(pick: Plan, topics) -> None:
    rows = rows_of(pick)
    wanted = tcp_twist(pick.loaded.robot, rows[:, 1:7], rows[:, 7:13])
    assert twists(topics).tobytes() == np.ascontiguousarray(wanted).tobytes()
    assert {each.m.header.frame_id for each in topics["/tool_twist"]} == {"world"}


def test_the_twist_is_in_world_whatever_frame_the_columns_are_in(topics, tmp_path: Path) -> None:
    turned = ("frames={f: {xyz: [0.1, 0.2, 0.3], rpy: [1.2, 0.3, -0.5]}}", "output.in=f")
    seen = read(write_log(plan_of("ur5e_pick", *turned), tmp_path / "seen.mcap", topics="/tool_twist"))
    assert twists(seen).tobytes() == twists(topics).tobytes()


def test_the_trajectory_is_that_of_the_knots(pick: Plan, topics) -> None:
    knots = knots_of(pick.trajectory)
    (each,) = topics["/joint_trajectory"]
    points = each.m.points
    assert stamp(each.m.header.stamp) == 0
    assert tuple(each.m.joint_names) == pick.trajectory.joint_names
    assert [stamp(point.time_from_start) for point in points] == knots.nanoseconds.tolist()
    for name, values in (
        ("positions", knots.position), ("velocities", knots.velocity), ("accelerations", knots.acceleration)
    ):  # fmt: skip
        assert np.array([getattr(point, name) for point in points]).tobytes() == values.tobytes()
    assert all(len(point.effort) == 0 for point in points)


def pose_of(transform) -> np.ndarray:
    pose = np.eye(4)
    t, r = transform.translation, transform.rotation
    pose[:3, 3] = t.x, t.y, t.z
    pose[:3, :3] = Rotation.from_quat([r.x, r.y, r.z, r.w]).as_matrix()
    return pose


def test_frames_lead_from_world_to_the_tool_at_every_time(pick: Plan, topics) -> None:
    (static,) = topics["/tf_static"]
    end = round(pick.trajectory.duration * 1e9)
    times = [each.log for each in topics["/tf"]]
    assert times[0] == 0
    assert abs(times[-1] - end) <= 1
    gaps = np.diff(times)
    assert gaps.min() >= 1e9 / 60 - 1
    assert gaps.max() <= 1e9 / 59
    for each in topics["/tf"][:: len(times) // 20]:
        poses = {(t.header.frame_id, t.child_frame_id): pose_of(t.transform)
                 for t in (*static.m.transforms, *each.m.transforms)}  # fmt: skip
        assert {stamp(t.header.stamp) for t in each.m.transforms} == {each.log}
        chain = ["world", "base_link", *(f"link_{k}" for k in range(1, 7)), "tool0"]
        assert set(poses) == set(pairwise(chain))
        tool = np.eye(4)
        for pair in pairwise(chain):
            tool = tool @ poses[pair]
        q = pick.trajectory.curve.evaluate(min(each.log / 1e9, pick.trajectory.duration))
        assert np.abs(tool - forward(pick.loaded.robot, q)).max() <= 1e-12


def test_the_tool_path_is_that_of_the_tool(pick: Plan, topics) -> None:
    (each,) = topics["/tool_path"]
    assert each.m.header.frame_id == "world"
    poses = each.m.poses
    assert 2 <= len(poses) <= 1000
    assert stamp(poses[0].header.stamp) == 0
    assert stamp(poses[-1].header.stamp) == round(pick.trajectory.duration * 1e9)
    times = np.minimum([stamp(pose.header.stamp) / 1e9 for pose in poses], pick.trajectory.duration)
    wanted = forward(pick.loaded.robot, pick.trajectory.curve.evaluate(times))
    for pose, expected in zip(poses, wanted, strict=True):
        p, o = pose.pose.position, pose.pose.orientation
        assert np.abs(np.array([p.x, p.y, p.z]) - expected[:3, 3]).max() <= 1e-14
        turned = Rotation.from_quat([o.x, o.y, o.z, o.w]).as_matrix()
        assert np.abs(turned - expected[:3, :3]).max() <= 1e-14


@pytest.mark.full
def test_a_long_path_has_a_thousand_poses(tmp_path: Path) -> None:
    plan = plan_of("scorbot_draw", "output.rate=10")
    slow = plan_of("ur5e_poses", "moves.0.minimum_duration=60", "output.rate=10")
    for each in (plan, slow):
        (path,) = read(write_log(each, tmp_path / "long.mcap"))["/tool_path"]
        assert len(path.m.poses) == min(1000, 2 + int(each.trajectory.duration * 60))


def test_attachments_and_metadata(pick: Plan, pick_log: Path, topics) -> None:
    from mcap.reader import make_reader

    with pick_log.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        header, summary = reader.get_header(), reader.get_summary()
        attached = {each.name: each for each in reader.iter_attachments()}
        (metadata,) = reader.iter_metadata()
    assert (header.profile, header.library) == ("ros2", "trajcli")
    assert set(attached) == {"job.yaml", "report.json", "robot.urdf"}
    assert all(each.log_time == each.create_time == 0 for each in attached.values())
    job = (EXAMPLES / "ur5e_pick.yaml").read_bytes()
    assert attached["job.yaml"].data == job
    (urdf,) = topics["/robot_description"]
    assert attached["robot.urdf"].data.decode() == urdf.m.data
    assert json.loads(attached["report.json"].data)["knots"]["count"] == len(
        topics["/joint_trajectory"][0].m.points
    )
    assert metadata.name == "trajcli"
    about = metadata.metadata
    assert about["job_sha256"] == hashlib.sha256(job).hexdigest()
    assert json.loads(about["joints"]) == list(pick.trajectory.joint_names)
    assert float(about["duration"]) == pick.trajectory.duration
    assert "position" in about["joint_accelerations"]
    counts = {summary.channels[number].topic: count
              for number, count in summary.statistics.channel_message_counts.items()}  # fmt: skip
    assert counts == {topic: len(messages) for topic, messages in topics.items()}
    assert (summary.statistics.attachment_count, summary.statistics.metadata_count) == (3, 1)


def test_latched_topics_are_kept_for_late_subscribers(pick_log: Path) -> None:
    import yaml
    from mcap.reader import make_reader

    with pick_log.open("rb") as stream:
        channels = make_reader(stream).get_summary().channels.values()
    durability = {
        channel.topic: yaml.safe_load(channel.metadata["offered_qos_profiles"])[0]["durability"]
        for channel in channels
    }
    assert durability == {**dict.fromkeys([*BY_ROW, "/tf"], 2), **dict.fromkeys(LATCHED, 1)}


def test_checksums_offsets_and_indices_hold(pick_log: Path) -> None:
    """Written from the specification: every index points to its record, every checksum is that of its bytes."""
    from mcap.records import ChunkIndex, DataEnd, Footer, SummaryOffset
    from mcap.stream_reader import StreamReader

    data = pick_log.read_bytes()
    with pick_log.open("rb") as stream:
        found = [*StreamReader(stream, emit_chunks=True, validate_crcs=True).records]
    end = next(record for record in found if isinstance(record, DataEnd))
    footer = next(record for record in found if isinstance(record, Footer))
    start = footer.summary_start - 13
    assert data[start] == 0x0F
    assert end.data_section_crc == zlib.crc32(data[:start]) != 0
    assert footer.summary_crc == zlib.crc32(data[footer.summary_start : -8 - 4]) != 0
    for index in (record for record in found if isinstance(record, ChunkIndex)):
        assert data[index.chunk_start_offset] == 0x06
        assert all(data[offset] == 0x07 for offset in index.message_index_offsets.values())
        behind = index.chunk_start_offset + index.chunk_length
        assert min(index.message_index_offsets.values()) == behind
        assert data[behind + index.message_index_length] in (0x06, 0x0F)
    for group in (record for record in found if isinstance(record, SummaryOffset)):
        assert data[group.group_start] == group.group_opcode
    groups = [record for record in found if isinstance(record, SummaryOffset)]
    assert groups[0].group_start == footer.summary_start
    assert sum(group.group_length for group in groups) == footer.summary_offset_start - footer.summary_start


@pytest.mark.parametrize("compression", few(["zstd", "lz4", "none"], 1))
def test_every_message_stands_in_order_of_time_and_in_its_index(compression: str, tmp_path: Path) -> None:
    """Chunks do not overlap, messages rise in time, and the index of each channel names all of its messages."""
    from mcap.records import Channel, Chunk, Message, MessageIndex
    from mcap.stream_reader import StreamReader, breakup_chunk, get_chunk_data_stream

    plan = plan_of("ur5e_pick", "output.rate=1400")
    path = write_log(plan, tmp_path / "a.mcap", compression=compression)
    last, chunks, indexed = 0, 0, Counter()
    with path.open("rb") as stream:
        records = [*StreamReader(stream, emit_chunks=True, validate_crcs=True).records]
    assert len({record.id for record in records if isinstance(record, Channel)}) == 7
    for record in records:
        if isinstance(record, Chunk):
            chunks += 1
            assert record.compression == ("" if compression == "none" else compression)
            messages = breakup_chunk(record, validate_crc=True)
            assert all(isinstance(message, Message) for message in messages)
            times = [message.log_time for message in messages]
            assert times == sorted(times)
            assert (record.message_start_time, record.message_end_time) == (times[0], times[-1])
            assert record.message_start_time >= last
            last = record.message_end_time
            counts = Counter(message.channel_id for message in messages)
            raw = get_chunk_data_stream(record)[0]._stream.getvalue()
        elif isinstance(record, MessageIndex):
            assert len(record.records) == counts[record.channel_id]
            for time, offset in record.records:
                assert raw[offset] == 0x05
                assert int.from_bytes(raw[offset + 9 : offset + 11], "little") == record.channel_id
                assert int.from_bytes(raw[offset + 15 : offset + 23], "little") == time
            indexed[record.channel_id] += len(record.records)
    assert chunks >= 3
    assert sum(indexed.values()) == 2 * grid_of(plan).count + len(read(path)["/tf"]) + 4


def test_rosbags_reads_every_message(pick_log: Path, topics) -> None:
    require_module("rosbags")
    from rosbags.highlevel import AnyReader

    found = defaultdict(list)
    with AnyReader([pick_log]) as reader:
        for connection, time, raw in reader.messages():
            found[connection.topic].append((time, reader.deserialize(raw, connection.msgtype)))
        latched = {c.topic for c in reader.connections if c.ext.offered_qos_profiles[0].durability.value == 1}
    assert latched == set(LATCHED)
    assert {topic: len(each) for topic, each in found.items()} == {t: len(each) for t, each in topics.items()}
    for (time, message), other in zip(found["/joint_states"], topics["/joint_states"], strict=True):
        assert time == other.log
        assert message.position.tobytes() == np.array(other.m.position).tobytes()
        assert message.velocity.tobytes() == np.array(other.m.velocity).tobytes()
    (_, trajectory), (other,) = found["/joint_trajectory"][0], topics["/joint_trajectory"]
    for point, wanted in zip(trajectory.points, other.m.points, strict=True):
        assert point.accelerations.tolist() == list(wanted.accelerations)


def test_definitions_are_those_of_ros_2(pick_log: Path) -> None:
    """The hash of each definition is that which rosbags knows for the type in ROS 2 Jazzy."""
    require_module("rosbags")
    from mcap.reader import make_reader
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    with pick_log.open("rb") as stream:
        schemas = make_reader(stream).get_summary().schemas.values()
    store = get_typestore(Stores.ROS2_JAZZY)
    assert len(schemas) == 7
    for schema in schemas:
        assert schema.encoding == "ros2msg"
        fresh = get_typestore(Stores.EMPTY)
        fresh.register(get_types_from_msg(schema.data.decode(), schema.name))
        assert fresh.hash_rihs01(schema.name) == store.hash_rihs01(schema.name)


def test_rerun_plots_named_joints_and_moves_the_arm(pick: Plan, pick_log: Path, tmp_path: Path) -> None:
    require_module("rerun")
    rerun = require_program(str(Path(sys.executable).parent / "rerun"), "rerun")
    run = {"capture_output": True, "text": True, "timeout": 120}
    subprocess.run([rerun, "analytics", "disable"], **run, check=False)
    checked = subprocess.run([rerun, "mcap", "check", str(pick_log)], **run, check=False)
    assert checked.returncode == 0, checked.stdout
    out = tmp_path / "log.rrd"
    subprocess.run([rerun, "mcap", "convert", str(pick_log), "-o", str(out)], **run, check=True)
    text = subprocess.run([rerun, "rrd", "print", "-vvv", str(out)], **run, check=True).stdout
    for path in ("/joint_states/position", "/joint_states/velocity", "/joint_accelerations/position"):
        assert path in text
    assert "Scalars:scalars" in text
    assert "SeriesLines:names" in text
    assert "Transform3D:translation" in text
    assert all(name in text for name in pick.trajectory.joint_names)


def test_an_arm_without_geometry_has_no_frames(tmp_path: Path) -> None:
    from mcap.reader import make_reader

    path = write_log(plan_of("quintic"), tmp_path / "bare.mcap")
    assert set(read(path)) == {"/joint_states", "/joint_accelerations", "/joint_trajectory"}
    with path.open("rb") as stream:
        reader = make_reader(stream)
        (metadata,) = reader.iter_metadata()
        assert metadata.metadata["geometry"].startswith("none")
        assert {each.name for each in reader.iter_attachments()} == {"job.yaml", "report.json"}


def test_an_epoch_shifts_all_clocks(tmp_path: Path) -> None:
    plan = plan_of("ur5e_poses", "output.rate=20", "output.start_time=0.5")
    found = read(
        write_log(plan, tmp_path / "a.mcap", epoch="1767225600.25", topics="/joint_trajectory_point")
    )
    origin = 1767225600_750000000
    for topic in ("/joint_states", "/joint_accelerations", "/tf"):
        assert found[topic][0].log == origin
        assert found[topic][-1].log == origin + round(plan.trajectory.duration * 1e9)
    assert stamp(found["/joint_states"][0].m.header.stamp) == origin
    assert stamp(found["/tool_path"][0].m.poses[0].header.stamp) == origin
    assert stamp(found["/joint_trajectory"][0].m.header.stamp) == 0
    assert stamp(found["/joint_trajectory_point"][0].m.time_from_start) == 0


def test_a_changed_job_and_one_with_other_files_is_attached_resolved(tmp_path: Path) -> None:
    from mcap.reader import make_reader

    from trajcli.job.read import job_from_text
    from trajcli.planning.plan import plan_job

    for name, overrides in (("septic", ["output.rate=50"]), ("recorded", [])):
        plan = plan_of(name, *overrides)
        with write_log(plan, tmp_path / "a.mcap").open("rb") as stream:
            attached = {each.name: each.data for each in make_reader(stream).iter_attachments()}
        same = plan_job(job_from_text(attached["job.yaml"].decode()))
        assert (rows_of(same) == rows_of(plan)).all()


def test_uncompressed_files_are_reproducible(pick: Plan, pick_log: Path, tmp_path: Path) -> None:
    other = write_log(
        plan_of("ur5e_pick"),
        tmp_path / "b.mcap",
        topics="/joint_trajectory_point,/tool_twist",
        compression="none",
    )
    assert other.read_bytes() == pick_log.read_bytes()


@pytest.mark.full
def test_few_rows_do_not_make_long_chunks(tmp_path: Path) -> None:
    """Two rows an hour apart: the frames between them fill several chunks."""
    plan = plan_of("ur5e_poses", "moves.0.minimum_duration=100", "output.rate=0.001")
    found = read(write_log(plan, tmp_path / "slow.mcap"))
    assert len(found["/joint_states"]) == 2
    assert len(found["/tf"]) == int(plan.trajectory.duration * 60) + 1


def test_memory_does_not_grow_with_the_rows(pick: Plan, tmp_path: Path) -> None:
    groups = ("t", "q", "qd", "qdd")
    columns = columns_of(groups, pick.trajectory.joint_types, Units())
    recording = recording_of(pick, LogOptions())
    peaks = []
    for count in (20_000, 100_000):
        rows = sample(pick.trajectory, UniformGrid(pick.trajectory.duration, count / 6.85), groups, Units())
        with (tmp_path / "a.mcap").open("wb") as out:
            tracemalloc.start()
            for _ in write_mcap_blocks(rows, columns, out, recording):
                pass
            peaks.append(tracemalloc.get_traced_memory()[1])
            tracemalloc.stop()
    assert peaks[1] < peaks[0] * 1.1


def test_a_number_that_is_not_finite_leaves_no_file(pick: Plan, tmp_path: Path) -> None:
    from trajcli.streams.formats import WriteOptions, write_verified

    groups = ("t", "q", "qd", "qdd")
    columns = columns_of(groups, pick.trajectory.joint_types, Units())
    rows = np.zeros((3, 19))
    rows[:, 0] = [0, 1, 2]
    rows[1, 5] = np.nan
    options = WriteOptions(recording=lambda: recording_of(pick, LogOptions()))
    with pytest.raises(TrajcliError, match="not finite"):
        write_verified(tmp_path / "a.mcap", [rows], columns, options)
    assert [*tmp_path.iterdir()] == []


@pytest.mark.parametrize("wrong", ["position", "acceleration", "count", "time"])
def test_what_is_not_what_was_to_be_written_never_appears(
    wrong, pick: Plan, tmp_path: Path, monkeypatch
) -> None:
    """The file is read back: a writer that puts one bit wrong leaves nothing."""
    original = write.RowRecords.of_block

    def spoilt(self, block):
        block = block.copy()
        if wrong == "count":
            return original(self, block[:-1])
        column = {"position": 3, "acceleration": 14, "time": 0}[wrong]
        block[-1, column] = np.nextafter(block[-1, column], 9) if column else block[-1, 0] + 2e-9
        return original(self, block)

    monkeypatch.setattr(write.RowRecords, "of_block", spoilt)
    with pytest.raises(TrajcliError, match="read back"):
        write_log(pick, tmp_path / "a.mcap")
    assert [*tmp_path.iterdir()] == []
