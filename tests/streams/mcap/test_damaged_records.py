"""Records of logs put together byte by byte, each with one thing that is wrong.

Source: the MCAP format specification, version 0 (https://mcap.dev/spec).
"""

from __future__ import annotations

import re
import struct
import zlib
from collections.abc import Sequence
from io import BytesIO

import numpy as np
import pytest
import zstandard

from trajcli.errors import InputError
from trajcli.streams.mcap.definitions import definition_of
from trajcli.streams.mcap.log_records import LogRecords
from trajcli.streams.mcap.read import log_blocks

MAGIC = b"\x89MCAP0\r\n"
STATE = "sensor_msgs/msg/JointState"


def record(kind: int, content: bytes) -> bytes:
    return struct.pack("<BQ", kind, len(content)) + content


def text(value: str) -> bytes:
    return struct.pack("<I", len(value)) + value.encode()


def state(value: float) -> bytes:
    """Return a state of one joint `a`, stamped with its value in seconds."""
    head = bytes([0, 1, 0, 0]) + struct.pack("<iI", int(value), 0) + struct.pack("<I", 1) + bytes(4)
    names = struct.pack("<II", 1, 2) + b"a\0" + bytes(2)
    position = struct.pack("<I", 1) + bytes(-(len(head) + len(names)) % 8) + struct.pack("<d", value)
    return head + names + position + struct.pack("<II", 0, 0)


def message(value: float, channel: int = 1) -> bytes:
    return record(5, struct.pack("<HIQQ", channel, 0, int(value), int(value)) + state(value))


def chunk(data: bytes, *, size: int | None = None, checksum: int | None = None, by: str = "") -> bytes:
    size, checksum = len(data) if size is None else size, zlib.crc32(data) if checksum is None else checksum
    stored = zstandard.ZstdCompressor().compress(data) if by == "zstd" else data
    head = struct.pack("<QQQI", 0, 9, size, checksum) + text(by) + struct.pack("<Q", len(stored))
    return record(6, head + stored)


def index(channel: int, offsets: Sequence[int], *, cut: int = 0) -> bytes:
    entries = b"".join(struct.pack("<QQ", 0, offset) for offset in offsets)[: -cut or None]
    return record(7, struct.pack("<HI", channel, len(entries)) + entries)


def definitions() -> bytes:
    data = definition_of(STATE).encode()
    schema = struct.pack("<H", 1) + text(STATE) + text("ros2msg") + struct.pack("<I", len(data)) + data
    channels = [struct.pack("<HH", k, 1) + text(f"/{k}") + text("cdr") + bytes(4) for k in (1, 2)]
    return record(3, schema) + b"".join(record(4, channel) for channel in channels)


def log(*parts: bytes, summary: bytes = b"") -> bytes:
    head = MAGIC + record(1, text("ros2") + text("somebody"))
    data = head + definitions() + b"".join(parts) + record(15, bytes(4))
    start = len(data) if summary else 0
    return data + summary + record(2, struct.pack("<QQI", start, 0, 0)) + MAGIC


def values(data: bytes, topic: str = "/1") -> list[float]:
    blocks = list(log_blocks(BytesIO(data), "a.mcap", topic))
    found: list[float] = np.concatenate([block.position[:, 0] for block in blocks]).tolist()
    assert np.concatenate([block.times for block in blocks]).tolist() == found
    return found


ONE, TWO, THREE = message(1.0), message(2.0, channel=2), message(3.0)
DATA = ONE + TWO + THREE
CHANNEL = record(4, struct.pack("<HH", 1, 1) + text("/1") + text("cdr") + bytes(40))
AT = (0, len(ONE), len(ONE) + len(TWO))


def test_a_right_one_is_read_by_its_index_and_without_one() -> None:
    """An index that leaves out a message of its channel leaves it out."""
    assert values(log(ONE, TWO, THREE)) == [1.0, 3.0]
    assert values(log(chunk(DATA))) == [1.0, 3.0]
    assert values(log(chunk(DATA), index(1, [AT[0], AT[2]]), index(2, [AT[1]]))) == [1.0, 3.0]
    assert values(log(chunk(DATA), index(1, [AT[2]]), index(2, [AT[1]]), chunk(ONE), index(1, [0]))) == [
        3.0,
        1.0,
    ]
    assert values(log(chunk(DATA), index(1, []), index(2, [AT[1]])), "/2") == [2.0]
    assert values(log(chunk(DATA, checksum=0))) == [1.0, 3.0]


@pytest.mark.parametrize(
    ("parts", "words"),
    [
        ((chunk(DATA), index(1, [AT[1]])), "does not point to its messages"),  # one of another channel
        ((chunk(DATA), index(1, [AT[0], AT[2] + 1])), "points behind its end|does not point"),
        ((chunk(DATA), index(1, [len(DATA)])), "points behind its end"),
        ((chunk(DATA), index(1, [len(DATA) - 30])), "points behind its end"),
        ((chunk(DATA), index(1, [2**63])), "points behind its end"),
        ((chunk(DATA), index(1, [0, AT[2]], cut=3)), "a record is damaged"),
        ((chunk(definitions() + ONE), index(1, [len(definitions()) - 40])), "does not point to its messages"),
        ((chunk(DATA[:-1]), index(1, [AT[0], AT[2]])), "does not point to its messages"),  # cut behind it
        ((chunk(ONE + b"\5" + struct.pack("<Q", 2**63 + 5) + THREE[9:]), index(1, [0, len(ONE)])), "not point"),
        ((chunk(DATA, size=len(DATA) - 1),), "has other than the"),
        ((chunk(DATA, size=len(DATA) + 1),), "has other than the"),
        ((chunk(DATA, size=len(DATA) - 1, by="zstd"),), "has other than the"),
        ((chunk(DATA, size=len(DATA) + 1, by="zstd"),), "has other than the"),
        ((chunk(DATA, by="sealing wax"),), "compressed by 'sealing wax'"),
        ((record(0, b""),), "a record of kind 0"),
        ((chunk(CHANNEL + ONE), index(1, [0])), "does not point to its messages"),  # a channel of that number
        ((chunk(DATA, checksum=5),), "the checksum of a chunk is wrong"),
        ((chunk(DATA, size=2**40),), f"a chunk claims {2**40} bytes"),
        ((chunk(DATA[:-1]),), "does not point to its messages|a record is damaged"),
        ((chunk(DATA + b"\5"),), "a record is damaged"),
    ],
)  # fmt: skip
def test_what_is_wrong_in_a_chunk_is_one_error(parts: tuple[bytes, ...], words: str) -> None:
    with pytest.raises(InputError) as error:
        values(log(*parts))
    (problem,) = error.value.problems
    assert re.search(words, problem.message), problem.message
    assert problem.message.startswith("a.mcap: ")


def test_what_stands_in_the_place_of_metadata_is_one_error() -> None:
    """Where the summary points, which may be into the middle of something, or behind the end."""
    known = record(12, text("trajcli") + struct.pack("<I", 0))
    begin = len(log()) - len(record(15, bytes(4)) + record(2, bytes(20)) + MAGIC)

    def pointing(at: int) -> bytes:
        entry = struct.pack("<QQ", at, len(known)) + text("trajcli")
        return log(known, ONE, summary=definitions() + record(13, entry))

    assert values(pointing(begin)) == [1.0]
    for at, words in [
        (begin + len(known), "does not point to any"),
        (2**62, "behind the end"),
        (8, "does not point"),
    ]:
        with pytest.raises(InputError, match=words):
            values(pointing(at))
    with pytest.raises(InputError, match="behind the end"):
        values(pointing(len(pointing(0)) - 8))


@pytest.mark.parametrize("part", ["data", "summary"])
def test_checksums_of_the_whole_are_compared_where_that_is_asked_for(part: str) -> None:
    head = MAGIC + record(1, text("ros2") + text("somebody"))
    data, summary = head + definitions() + ONE, definitions()
    footer = struct.pack("<BQQQ", 2, 20, len(data) + 13, 0)
    checksums = {"data": zlib.crc32(data), "summary": zlib.crc32(summary + footer)}

    def whole() -> bytes:
        end = record(15, struct.pack("<I", checksums["data"]))
        return data + end + summary + footer + struct.pack("<I", checksums["summary"]) + MAGIC

    assert len(list(LogRecords(BytesIO(whole()), "a.mcap", checked=True).blocks())) == 1
    checksums[part] ^= 1
    assert len(list(LogRecords(BytesIO(whole()), "a.mcap").blocks())) == 1
    with pytest.raises(InputError, match=f"the checksum of the {part} is wrong"):
        list(LogRecords(BytesIO(whole()), "a.mcap", checked=True).blocks())
    checksums[part] = 0  # nobody has computed it
    assert len(list(LogRecords(BytesIO(whole()), "a.mcap", checked=True).blocks())) == 1


@pytest.mark.parametrize("cut", [1, 7, 8, 9, 20, 28, 29])
def test_an_end_that_is_missing_is_one_error(cut: int) -> None:
    """The last magic, the footer, and the records before it, wherever the file stops."""
    whole = log(chunk(DATA), index(1, [AT[0], AT[2]]))
    with pytest.raises(InputError, match="the file is truncated"):
        values(whole[:-cut])
    with pytest.raises(InputError, match="the file is truncated"):
        values(whole[:-8] + b"\x89MCAP1\r\n")


def test_a_file_that_stops_inside_of_a_record_is_truncated() -> None:
    whole = log(chunk(DATA), index(1, [AT[0], AT[2]]), record(9, bytes(60)))
    for size in range(8, len(whole), 5):
        with pytest.raises(InputError, match=r"a.mcap: the file is truncated, at byte \d+"):
            values(whole[:size])
    with pytest.raises(InputError, match=r"this is no MCAP file, at byte 0$"):
        values(b"t,q1\n0,1\n" * 20)


def test_records_of_definitions_are_short_and_others_may_be_long() -> None:
    """A schema of two megabytes is none; a picture, a message or the index of many messages may be as long."""
    long = MAGIC + record(1, text("ros2") + text("somebody")) + struct.pack("<BQ", 3, 2**21) + bytes(100)
    with pytest.raises(InputError, match=f"a record claims {2**21} bytes, more than a record of its kind"):
        values(long)
    assert values(log(record(9, bytes(2**20 + 5)), ONE)) == [1.0]
    assert values(log(chunk(ONE), index(1, [0] * 70_000))) == [1.0] * 70_000
    frame = "f" * (2**20 + 3)
    start = bytes([0, 1, 0, 0]) + struct.pack("<iI", 1, 0) + struct.pack("<I", len(frame) + 1)
    start += frame.encode() + b"\0" + struct.pack("<II", 1, 2) + b"a\0" + bytes(2) + struct.pack("<I", 1)
    data = start + bytes((4 - len(start)) % 8) + struct.pack("<d", 1.0) + struct.pack("<II", 0, 0)
    assert values(log(record(5, struct.pack("<HIQQ", 1, 0, 0, 0) + data))) == [1.0]


def test_no_compression_has_two_names() -> None:
    assert values(log(chunk(DATA, by="none"))) == [1.0, 3.0]


@pytest.mark.parametrize("names", [("trajcli", "others"), ("others", "trajcli")])
@pytest.mark.parametrize("summed", [True, False])
def test_the_epoch_is_that_of_our_metadata_wherever_others_stand(
    names: tuple[str, str], *, summed: bool
) -> None:
    parts = []
    for name in names:
        pairs = text("epoch") + text("500000000" if name == "trajcli" else "250000000")
        parts.append(record(12, text(name) + struct.pack("<I", len(pairs)) + pairs))
    begin = len(log()) - len(record(15, bytes(4)) + record(2, bytes(20)) + MAGIC)
    places = (begin, begin + len(parts[0]))
    entries = [
        record(13, struct.pack("<QQ", place, len(part)) + text(name))
        for place, part, name in zip(places, parts, names, strict=True)
    ]
    data = log(*parts, ONE, summary=definitions() + b"".join(entries) if summed else b"")
    (block,) = log_blocks(BytesIO(data), "a.mcap", "/1")
    assert block.times.tolist() == [0.5]
