"""Writing of MCAP: chunks that hold all topics of an interval in order of time, with indices and checksums.

The numbers of a block of rows are put into the templates of its records at once. Nothing in a file depends
on when or where it was written.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from trajcli.columns import Column
from trajcli.curves.piecewise import Array
from trajcli.errors import TrajcliError
from trajcli.frozen import frozen
from trajcli.streams.mcap import records
from trajcli.streams.mcap.cdr import Bytes, put_time
from trajcli.streams.mcap.definitions import definition_of
from trajcli.streams.mcap.messages import (
    BY_ROW,
    FIELDS,
    TF,
    TOOL_TWIST,
    TRAJECTORY_POINT,
    RecordLayout,
    latched_messages,
    message_record,
    put_transforms,
    quality_of_service,
    record_layout,
    row_message,
    signal_messages,
    topics_of,
    transform_message,
    type_of,
)
from trajcli.streams.mcap.recording import Compression, Recording

LIBRARY = "trajcli"
PROFILE = "ros2"
METADATA = "trajcli"
"""The name of the metadata record."""

Encoder = Callable[[memoryview], bytes | memoryview]

_LEVEL = 1  # of zstd: measured, 1.6 times as fast as the usual 3, for files 8 % larger
Times = NDArray[np.int64]

_PER_SECOND = 1e9
_TRANSFORMS_RATE = 60.0  # Hz: what a screen shows
_MOST = 4096  # rows, and transforms, in a chunk


@frozen
class RecordGroup:
    """N times the same records, one or several, that are alike but for their numbers.

    Attributes:
        times: ns, shape (N,), rising.
        raw: Their bytes, shape (N, size).
        offsets: Where in these the message of each channel starts.
    """

    times: Times
    raw: Bytes
    offsets: Mapping[int, int]

    def part(self, low: int, high: int) -> RecordGroup:
        """Return some of them."""
        return RecordGroup(self.times[low:high], self.raw[low:high], self.offsets)


NO_RECORDS = RecordGroup(np.empty(0, np.int64), np.empty((0, 1), np.uint8), {})


class RowRecords:
    """The records of the topics that have a message for each row."""

    def __init__(self, topics: Mapping[str, int], columns: Sequence[Column], recording: Recording) -> None:
        self._epoch, self._origin = recording.epoch, recording.origin
        kinds = [column.kind for column in columns]
        self._where = {kind: slice(kinds.index(kind), _end(kinds, kind)) for kind in dict.fromkeys(kinds)}
        self._layouts = {
            topic: record_layout(topics[topic], row_message(topic, recording.joint_names, self._where))
            for topic in BY_ROW
            if topic in topics
        }
        sizes = [len(layout.template) for layout in self._layouts.values()]
        self._starts = dict(zip(self._layouts, np.cumsum([0, *sizes]).tolist(), strict=False))
        self._offsets = {topics[topic]: start for topic, start in self._starts.items()}
        self._template = np.frombuffer(b"".join(each.template for each in self._layouts.values()), np.uint8)
        self._raw = np.empty((0, self._template.size), np.uint8)
        self._count = 0

    def of_block(self, block: Array) -> RecordGroup:
        """Return the records of rows (N, m), SI; they hold until the next ones are asked for."""
        if len(self._raw) < len(block):
            self._raw = np.empty((len(block), self._template.size), np.uint8)
            self._raw[:] = self._template
        raw = self._raw[: len(block)]
        times = np.rint(block[:, self._where["t"].start] * _PER_SECOND).astype(np.int64) + self._epoch
        numbers = np.arange(self._count, self._count + len(block))
        self._count += len(block)
        for topic, layout in self._layouts.items():
            messages = _structures(raw, self._starts[topic], layout)
            _put_heads(messages, numbers, times)
            for kind, name in FIELDS.get(topic, ()):
                if kind in self._where:
                    messages[name] = block[:, self._where[kind]]
            if topic == TOOL_TWIST:
                first = self._where["vx"].start
                messages["twist"] = block[:, first : first + 6]
            if topic == TRAJECTORY_POINT:
                put_time(messages, "from_start", times - self._origin)
            else:
                put_time(messages, "stamp", times)
        return RecordGroup(times, raw, self._offsets)


class TransformRecords:
    """The records of /tf, at even times from the start of the motion to its end; none without geometry."""

    def __init__(self, topics: Mapping[str, int], recording: Recording) -> None:
        self._origin, self._frames = recording.origin, recording.frames
        self._end = recording.duration
        self._intervals = max(int(self._end / _PER_SECOND * _TRANSFORMS_RATE), 1) if self._end else 0
        self._next = 0 if self._frames is not None else self._intervals + 1
        pairs = [] if self._frames is None else [*pairwise(self._frames.chain)]
        self._channel = topics.get(TF, 0)
        self._layout = record_layout(self._channel, transform_message(pairs))
        self._template = np.frombuffer(self._layout.template, np.uint8)

    @property
    def left(self) -> bool:
        """Whether some are still to come."""
        return self._next <= self._intervals

    def until(self, last: int | None) -> RecordGroup:
        """Return the next ones up to a time, ns, or up to the end; of many the first."""
        numbers = np.arange(self._next, min(self._next + _MOST, self._intervals + 1))
        times = np.rint(numbers * (self._end / max(self._intervals, 1))).astype(np.int64)
        if last is not None:
            times = times[: np.searchsorted(times, last - self._origin, "right")]
        numbers = numbers[: times.size]
        self._next += times.size
        raw = np.empty((times.size, self._template.size), np.uint8)
        raw[:] = self._template
        if self._frames is not None and times.size:
            messages = _structures(raw, 0, self._layout)
            _put_heads(messages, numbers, times + self._origin)
            put_transforms(messages, times + self._origin, self._frames.poses(times))
        return RecordGroup(times + self._origin, raw, {self._channel: 0})

    def beside(self, rows: RecordGroup) -> Iterator[tuple[RecordGroup, RecordGroup]]:
        """Yield the rows, and the transforms up to the last of them, in parts of a chunk each."""
        low, count = 0, rows.times.size
        while low < count:
            high = min(low + _MOST, count)
            moving = self.until(int(rows.times[high - 1]))
            if moving.times.size == _MOST:  # there may be more before the last of these rows
                high = low + int(np.searchsorted(rows.times[low:high], moving.times[-1], "right"))
            yield rows.part(low, high), moving
            low = high


def _structures(raw: Bytes, start: int, layout: RecordLayout) -> NDArray[Any]:
    """Return the records (N,) that start at a byte of each row of `raw`, as structures over it."""
    return np.ndarray((len(raw),), layout.dtype, raw, start, (raw.strides[0],))


def _put_heads(messages: NDArray[Any], numbers: NDArray[np.int64], times: Times) -> None:
    messages["sequence"] = numbers
    messages["log_time"] = times
    messages["publish_time"] = times


def _end(kinds: Sequence[str], kind: str) -> int:
    return len(kinds) - list(reversed(kinds)).index(kind)


def write_mcap_blocks(
    rows: Iterable[Array], columns: Sequence[Column], out: BinaryIO, recording: Recording
) -> Iterator[Array]:
    """Write a log, and yield each block as soon as its messages have left for `out`.

    Args:
        rows: Blocks of shape (N, m) in SI, with t, q and, for /tool_twist, the twist; qd, qdd, tau if stated.
        columns: What the rows hold.
        out: Where to; the log is complete when the iterator has ended.
        recording: What else the log holds.

    Raises:
        TrajcliError: When a value is not finite; its block and what follows are not written.
    """
    topics = {topic: number for number, topic in enumerate(topics_of(recording), 1)}
    log = _Log(out, recording, topics)
    packed, transforms = RowRecords(topics, columns, recording), TransformRecords(topics, recording)
    for block in rows:
        if not np.isfinite(block).all():
            raise TrajcliError("a row holds a number that is not finite; nothing of its block is written")
        for some, moving in transforms.beside(packed.of_block(block)):
            log.chunk(some, moving)
        yield block
    while transforms.left:
        log.chunk(NO_RECORDS, transforms.until(None))
    log.end()


class _Log:
    """A file from its first byte to its last: what was written is counted on the way."""

    def __init__(self, out: BinaryIO, recording: Recording, topics: Mapping[str, int]) -> None:
        self._out, self._position, self._checksum = out, 0, 0
        self._compression = "" if recording.compression == "none" else recording.compression
        self._encode = _encoder(recording.compression)
        self._chunks: list[records.ChunkEntry] = []
        self._counts = dict.fromkeys(topics.values(), 0)
        once = [(topic, recording.origin, message) for topic, message in latched_messages(recording)]
        counts = dict.fromkeys(topics, 0)
        self._latched = []
        for topic, time, message in (*once, *signal_messages(recording)):
            record = message_record(topics[topic], time, message, counts[topic])
            self._latched.append((topics[topic], time, record))
            counts[topic] += 1
        # of a chunk: a new one each time would cost as much as filling it
        self._buffer = np.empty(0, np.uint8)
        self._write(records.MAGIC + records.record(records.HEADER, *map(records.text, (PROFILE, LIBRARY))))
        self._about = _schemas_and_channels(topics)
        self._schemas = len({type_of(topic) for topic in topics})
        self._write(b"".join(self._about))
        self._attached = self._attach(recording)

    def _write(self, data: bytes | memoryview) -> None:
        self._out.write(data)
        self._checksum = zlib.crc32(data, self._checksum)
        self._position += len(data)

    def _attach(self, recording: Recording) -> list[tuple[int, bytes]]:
        """Write attachments and metadata; return the kind and the record of the index of each."""
        indices = []
        for file in recording.attachments:
            record, at = records.attachment(file.name, file.media_type, file.data), self._position
            index = records.attachment_index(at, len(record), file.name, file.media_type, len(file.data))
            indices.append((records.ATTACHMENT_INDEX, index))
            self._write(record)
        record, at = _metadata(recording), self._position
        self._write(record)
        index = records.metadata_index(at, len(record), METADATA)
        return [*indices, (records.METADATA_INDEX, index)]

    def chunk(self, rows: RecordGroup, transforms: RecordGroup) -> None:
        """Write rows and transforms in order of time; the first chunk begins with those made once."""
        head = b"".join(record for _, _, record in self._latched)
        size, step = rows.raw.shape[1], transforms.raw.shape[1]
        before = np.searchsorted(rows.times, transforms.times, "right")  # rows before each transform
        total = len(head) + rows.raw.size + transforms.raw.size
        if self._buffer.size < total:
            self._buffer = np.empty(total, np.uint8)
        data = _interleave(self._buffer, head, rows, transforms, before)
        behind = np.searchsorted(before, np.arange(rows.times.size), "right")  # transforms before each row
        groups = [
            (rows, len(head) + np.arange(rows.times.size) * size + behind * step),
            (transforms, len(head) + before * size + np.arange(transforms.times.size) * step),
        ]
        index: dict[int, tuple[Times, Times]] = {}
        start = 0
        for number, time, record in self._latched:
            times, at = index.get(number, (np.empty(0, np.int64), np.empty(0, np.int64)))
            index[number] = np.append(times, time), np.append(at, start)
            start += len(record)
        for group, at in groups:
            if group.times.size:
                index |= {number: (group.times, at + offset) for number, offset in group.offsets.items()}
        self._latched = []
        self._write_chunk(data, index)

    def _write_chunk(self, data: memoryview, index: Mapping[int, tuple[Times, Times]]) -> None:
        first = min(int(times[0]) for times, _ in index.values())
        last = max(int(times[-1]) for times, _ in index.values())
        stored, begun = self._encode(data), self._position
        head = (first, last, len(data), zlib.crc32(data), self._compression, len(stored))
        self._write(records.chunk_head(*head))
        self._write(stored)
        behind, offsets = self._position, {}
        for number, (times, at) in index.items():
            offsets[number] = self._position
            self._counts[number] += times.size
            self._write(records.message_index(number, times, at))
        self._chunks.append(
            records.ChunkEntry(
                first=first,
                last=last,
                offset=begun,
                length=behind - begun,
                indices=offsets,
                index_length=self._position - behind,
                compression=self._compression,
                compressed=len(stored),
                size=len(data),
            )
        )

    def end(self) -> None:
        """Write what stands behind the data."""
        if self._latched:  # a motion without rows and transforms
            self.chunk(NO_RECORDS, NO_RECORDS)
        self._write(records.record(records.DATA_END, self._checksum.to_bytes(4, "little")))
        schemas, channels = self._about
        kinds = [kind for kind, _ in self._attached]
        counted = records.statistics(
            self._counts,
            min(chunk.first for chunk in self._chunks),
            max(chunk.last for chunk in self._chunks),
            schemas=self._schemas,
            attachments=kinds.count(records.ATTACHMENT_INDEX),
            metadata=kinds.count(records.METADATA_INDEX),
            chunks=len(self._chunks),
        )
        groups: list[tuple[int, bytes]] = [
            (records.SCHEMA, schemas),
            (records.CHANNEL, channels),
            (records.STATISTICS, counted),
            (records.CHUNK_INDEX, b"".join(map(records.chunk_index, self._chunks))),
        ]
        groups += [
            (kind, b"".join(index for of_kind, index in self._attached if of_kind == kind))
            for kind in (records.ATTACHMENT_INDEX, records.METADATA_INDEX)
        ]
        self._out.write(records.closing(self._position, groups))


def _encoder(compression: Compression) -> Encoder:
    if compression == "zstd":
        import zstandard

        return zstandard.ZstdCompressor(level=_LEVEL).compress
    if compression == "lz4":
        import lz4.frame

        return lz4.frame.compress  # type: ignore[no-any-return]
    return memoryview


def _schemas_and_channels(topics: Mapping[str, int]) -> tuple[bytes, bytes]:
    names = list(dict.fromkeys(type_of(topic) for topic in topics))
    schemas = [records.schema(number, name, definition_of(name)) for number, name in enumerate(names, 1)]
    channels = [
        records.channel(number, names.index(type_of(topic)) + 1, topic, quality_of_service(topic))
        for topic, number in topics.items()
    ]
    return b"".join(schemas), b"".join(channels)


def _metadata(recording: Recording) -> bytes:
    return records.record(records.METADATA, records.text(METADATA), records.mapping(recording.metadata))


def _interleave(
    out: Bytes, head: bytes, rows: RecordGroup, transforms: RecordGroup, before: Times
) -> memoryview:
    """Put the bytes of all records into `out`, each transform behind its number of rows; return them."""
    out[: len(head)] = np.frombuffer(head, np.uint8)
    of_rows, size, at, low = rows.raw.reshape(-1), rows.raw.shape[1], len(head), 0
    for record, count in zip(transforms.raw, [*before.tolist()], strict=True):
        high = count * size
        out[at : at + high - low] = of_rows[low:high]
        at += high - low
        low = high
        out[at : at + record.size] = record
        at += record.size
    end = at + of_rows.size - low
    out[at:end] = of_rows[low:]
    return out[:end].data
