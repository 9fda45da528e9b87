"""A million states of six joints as MCAP, beside the writers that pack message by message.

The peers are slow: they write fewer rows, and their time is taken to grow in proportion, which it does. Each
row is one JointState of positions and velocities and one of accelerations.
"""

from __future__ import annotations

import sys
import tempfile
from functools import partial
from pathlib import Path

from benchmarks.contest import Command, Function, compete
from benchmarks.figures import MEGABYTE, Figure
from benchmarks.planning import NEEDED
from benchmarks.writing import ROWS, _plan, _rows

PACKED_ROWS, MESSAGE_ROWS = ROWS // 10, ROWS // 100
NAMES = tuple(f"joint_{number}" for number in range(1, 7))
COLUMNS = ["t", *(f"{kind}{joint}" for kind in ("q", "qd", "qdd") for joint in range(1, 7))]


def _recording(compression):
    """Return what a log without frames holds beside its rows."""
    import numpy as np

    from trajcli.knots import Deviation, Knots
    from trajcli.streams.mcap.recording import Recording

    zero = np.zeros((1, 6))
    knots = Knots(np.zeros(1, np.int64), zero, zero, zero, Deviation(0.0, 0.0, (0, 0)))
    return Recording(NAMES, 0, 0, ROWS * 10**6, knots, None, None, (), {}, (), compression)


def ours(compression):
    """Prepare our writer, on the blocks in which rows are sampled."""
    from trajcli.columns import parse_column
    from trajcli.grids import ROWS as SIZE
    from trajcli.streams.mcap.write import write_mcap_blocks

    rows, columns = _rows(), [parse_column(name) for name in COLUMNS]
    blocks = [rows[low : low + SIZE] for low in range(0, ROWS, SIZE)]

    def write(out):
        for _ in write_mcap_blocks(blocks, columns, out, _recording(compression)):
            pass

    return _timed(write)


def packed(compression):
    """Prepare the writer of mcap, on messages that are packed already."""
    from mcap.writer import CompressionType, Writer

    from trajcli.columns import parse_column
    from trajcli.streams.mcap.definitions import definition_of
    from trajcli.streams.mcap.write import RowRecords

    kind, topics = "sensor_msgs/msg/JointState", {"/joint_states": 1, "/joint_accelerations": 2}
    columns = [parse_column(name) for name in COLUMNS]
    group = RowRecords(topics, columns, _recording(compression)).of_block(_rows()[:PACKED_ROWS])
    cut = group.offsets[2]
    messages = [(row[31:cut].tobytes(), row[cut + 31 :].tobytes()) for row in group.raw]
    times = group.times.tolist()

    def write(out):
        writer = Writer(out, compression=CompressionType[compression.upper()])
        writer.start("ros2")
        schema = writer.register_schema(kind, "ros2msg", definition_of(kind).encode())
        channels = [writer.register_channel(topic, "cdr", schema) for topic in topics]
        for k, (time, pair) in enumerate(zip(times, messages, strict=True)):
            for channel, data in zip(channels, pair, strict=True):
                writer.add_message(channel, time, data, time, k)
        writer.finish()

    return _timed(write)


def by_message(compression):
    """Prepare the writer of mcap-ros2-support, on dictionaries."""
    from mcap.writer import CompressionType
    from mcap_ros2.writer import Writer

    from trajcli.streams.mcap.definitions import definition_of

    kind, rows = "sensor_msgs/msg/JointState", _rows()[:MESSAGE_ROWS].tolist()

    def write(out):
        writer = Writer(out, compression=CompressionType[compression.upper()])
        schema = writer.register_msgdef(kind, definition_of(kind))
        for row in rows:
            time = round(row[0] * 1e9)
            stamp = {"sec": time // 10**9, "nanosec": time % 10**9}
            head = {"header": {"stamp": stamp, "frame_id": ""}, "name": NAMES, "effort": []}
            state = head | {"position": row[1:7], "velocity": row[7:13]}
            writer.write_message("/joint_states", schema, state, time, time)
            accelerations = head | {"position": row[13:19], "velocity": []}
            writer.write_message("/joint_accelerations", schema, accelerations, time, time)
        writer.finish()

    return _timed(write)


def _timed(write):
    """Return the function that writes a file, and the one that reads some of its numbers."""
    folder = tempfile.TemporaryDirectory()
    path = Path(folder.name) / "log.mcap"

    def run(keep=folder):
        with path.open("wb") as out:
            write(out)

    def numbers(_):
        from itertools import islice

        from mcap.reader import make_reader
        from mcap_ros2.decoder import DecoderFactory

        with path.open("rb") as stream:
            reader = make_reader(stream, decoder_factories=[DecoderFactory()])
            states = reader.iter_decoded_messages(["/joint_states", "/joint_accelerations"])
            first = islice(states, 6)
            return [value for *_, message in first for value in (*message.position, *message.velocity)]

    return run, numbers


ours_zstd, ours_none = partial(ours, "zstd"), partial(ours, "none")
packed_zstd, packed_none = partial(packed, "zstd"), partial(packed, "none")
by_message_zstd = partial(by_message, "zstd")


def figures(peers: str | None, *, long: bool) -> list[Figure]:
    """Return the figures: the writer beside its peers, the whole command, and its peak memory."""
    names = ("ours_zstd", "packed_zstd", "by_message_zstd", "ours_none", "packed_none")
    with tempfile.TemporaryDirectory() as folder:
        runs = compete(
            {
                **{name: Function(sys.executable, "benchmarks.logs", name) for name in names},
                "log": _plan(ROWS, "-o", f"{folder}/rows.mcap"),
                "rows": _plan(ROWS, "-o", f"{folder}/rows.csv"),
                "imports": Command([sys.executable, "-c", NEEDED]),
            }
        )
    scaled = {
        "packed": [seconds * ROWS / PACKED_ROWS for seconds in runs["packed_zstd"].seconds],
        "plain": [seconds * ROWS / PACKED_ROWS for seconds in runs["packed_none"].seconds],
        "by message": [seconds * ROWS / MESSAGE_ROWS for seconds in runs["by_message_zstd"].seconds],
    }
    what, zstd, plain = "write 2 x 10^6 JointStates as MCAP", runs["ours_zstd"], runs["ours_none"]
    messages, packed_peer = "mcap-ros2-support (10^4 rows x 100)", "mcap, packed (10^5 rows x 10)"
    start, peak, limit = runs["imports"].peaks, runs["log"].peaks, 80 * MEGABYTE
    command = "plan, whole process, 10^6 rows as MCAP"
    return [
        Figure(f"{what}, zstd", messages, zstd.seconds, scaled["by message"], 1 / 20),
        Figure(f"{what}, zstd", packed_peer, zstd.seconds, scaled["packed"], 1 / 5),
        Figure(f"{what}, uncompressed", packed_peer, plain.seconds, scaled["plain"], 1 / 5),
        Figure(command, "10^6 rows as CSV", runs["log"].seconds, runs["rows"].seconds, 1.3),
        Figure(
            "peak memory, 10^6 rows as MCAP",
            "import numpy, yaml, pydantic",
            peak,
            start,
            limit,
            kind="memory",
        ),
    ]
