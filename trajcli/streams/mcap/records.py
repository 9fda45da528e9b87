"""Records of MCAP as bytes.

A record is one byte that says its kind, the length of its content in eight bytes, and the content.

Source: the MCAP format specification, version 0 (https://mcap.dev/spec).
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from trajcli.frozen import comparable

MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, CHUNK_INDEX = range(1, 9)
ATTACHMENT, ATTACHMENT_INDEX, STATISTICS, METADATA, METADATA_INDEX, SUMMARY_OFFSET, DATA_END = range(9, 16)
RECORD_HEAD = struct.Struct("<BQ")
MESSAGE_HEAD = struct.Struct("<BQHIQQ")
"""Of a message record: kind, length, channel, sequence, log time, publish time."""
INDEX_ENTRY = np.dtype([("time", "<u8"), ("offset", "<u8")])


@comparable
class ChunkEntry:
    """What the summary says about a chunk.

    Attributes:
        first: Time of its first message, ns.
        last: Time of its last message, ns.
        offset: Where its record starts in the file.
        length: Bytes of its record.
        indices: Where the message index of each channel starts.
        index_length: Bytes of all of these.
        compression: "zstd", "lz4" or "".
        compressed: Bytes of its messages in the file.
        size: Bytes of its messages.
    """

    first: int
    last: int
    offset: int
    length: int
    indices: Mapping[int, int]
    index_length: int
    compression: str
    compressed: int
    size: int


def record(kind: int, *parts: bytes) -> bytes:
    """Return a record with the content of all parts."""
    content = b"".join(parts)
    return RECORD_HEAD.pack(kind, len(content)) + content


def text(value: str) -> bytes:
    """Return a string with its length."""
    data = value.encode()
    return struct.pack("<I", len(data)) + data


def mapping(pairs: Mapping[str, str]) -> bytes:
    """Return a mapping of strings with its length."""
    content = b"".join(text(key) + text(value) for key, value in pairs.items())
    return struct.pack("<I", len(content)) + content


def _by_channel(values: Mapping[int, int]) -> bytes:
    content = b"".join(struct.pack("<HQ", channel, value) for channel, value in values.items())
    return struct.pack("<I", len(content)) + content


def schema(number: int, name: str, definition: str) -> bytes:
    """Return a schema record of a ROS 2 message."""
    data = definition.encode()
    parts = text(name), text("ros2msg"), struct.pack("<I", len(data)), data
    return record(SCHEMA, struct.pack("<H", number), *parts)


def channel(number: int, schema_number: int, topic: str, metadata: Mapping[str, str]) -> bytes:
    """Return a channel record of messages in CDR."""
    return record(
        CHANNEL, struct.pack("<HH", number, schema_number), text(topic), text("cdr"), mapping(metadata)
    )


def attachment(name: str, media_type: str, data: bytes) -> bytes:
    """Return an attachment record, without a time."""
    content = struct.pack("<QQ", 0, 0) + text(name) + text(media_type) + struct.pack("<Q", len(data)) + data
    return record(ATTACHMENT, content, struct.pack("<I", zlib.crc32(content)))


def attachment_index(offset: int, length: int, name: str, media_type: str, size: int) -> bytes:
    """Return the record of the summary that says where an attachment stands."""
    parts = struct.pack("<QQQQQ", offset, length, 0, 0, size), text(name), text(media_type)
    return record(ATTACHMENT_INDEX, *parts)


def metadata_index(offset: int, length: int, name: str) -> bytes:
    """Return the record of the summary that says where a metadata record stands."""
    return record(METADATA_INDEX, struct.pack("<QQ", offset, length), text(name))


def chunk_head(first: int, last: int, size: int, checksum: int, compression: str, length: int) -> bytes:
    """Return a chunk record up to its messages, which take `length` bytes in the file and `size` bytes."""
    content = struct.pack("<QQQI", first, last, size, checksum) + text(compression)
    content += struct.pack("<Q", length)
    return RECORD_HEAD.pack(CHUNK, len(content) + length) + content


def message_index(number: int, times: NDArray[np.int64], offsets: NDArray[np.int64]) -> bytes:
    """Return the record that says where the messages (N,) of a channel stand in a chunk."""
    entries = np.empty(times.size, dtype=INDEX_ENTRY)
    entries["time"], entries["offset"] = times, offsets
    return record(MESSAGE_INDEX, struct.pack("<HI", number, entries.nbytes), entries.tobytes())


def chunk_index(entry: ChunkEntry) -> bytes:
    """Return the record of the summary about a chunk."""
    return record(
        CHUNK_INDEX,
        struct.pack("<QQQQ", entry.first, entry.last, entry.offset, entry.length),
        _by_channel(entry.indices),
        struct.pack("<Q", entry.index_length),
        text(entry.compression),
        struct.pack("<QQ", entry.compressed, entry.size),
    )


def statistics(
    counts: Mapping[int, int],
    first: int,
    last: int,
    schemas: int,
    attachments: int,
    metadata: int,
    chunks: int,
) -> bytes:
    """Return the record of the summary that counts: messages by channel, schemas and so on."""
    numbers = sum(counts.values()), schemas, len(counts), attachments, metadata, chunks, first, last
    return record(STATISTICS, struct.pack("<QHIIIIQQ", *numbers), _by_channel(counts))


def closing(start: int, groups: Iterable[tuple[int, bytes]]) -> bytes:
    """Return all that stands behind the data: summary, where its groups stand, footer, magic.

    Args:
        start: Where it begins in the file.
        groups: The kind of each group of records, and the records; those without any are left out.
    """
    summary, offsets = b"", b""
    for kind, records in groups:
        if records:
            numbers = struct.pack("<BQQ", kind, start + len(summary), len(records))
            offsets += record(SUMMARY_OFFSET, numbers)
            summary += records
    ends = struct.pack("<QQ", start, start + len(summary))
    footer = RECORD_HEAD.pack(FOOTER, len(ends) + 4) + ends
    checksum = zlib.crc32(summary + offsets + footer)
    return summary + offsets + footer + struct.pack("<I", checksum) + MAGIC
