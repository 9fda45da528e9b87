"""Reading of MCAP record by record: channels, chunks and where messages stand in them, in bounded memory.

A file may come from anybody. Records that are too long, end too early or hold what they must not are errors
that say at which byte.

Source: the MCAP format specification, version 0 (https://mcap.dev/spec).
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from trajcli.errors import InputError
from trajcli.frozen import frozen
from trajcli.streams.mcap import records
from trajcli.streams.mcap.cdr import Bytes

LONGEST_RECORD = 1 << 28
"""Bytes of a chunk or a message, packed or not, that are taken into memory."""

_TAIL = struct.Struct("<BQQQI8s")  # footer and magic
_SHORT = 1 << 20  # bytes of the record of a schema, a channel or metadata
_HEAD = np.dtype(
    [
        *(("kind", "u1"), ("length", "<u8"), ("channel", "<u2"), ("sequence", "<u4")),
        *(("time", "<u8"), ("publish_time", "<u8")),
    ]
)
HEAD = _HEAD.itemsize
"""Bytes of a message record before the message."""

_READ = (
    *(records.SCHEMA, records.CHANNEL, records.MESSAGE, records.CHUNK, records.MESSAGE_INDEX),
    *(records.METADATA, records.METADATA_INDEX, records.STATISTICS, records.DATA_END, records.FOOTER),
)


@frozen
class MessageBlock:
    """Messages of some channels that stand in one chunk.

    Attributes:
        data: Bytes of the chunk.
        offsets: By channel, where its message records start, (N,).
    """

    data: Bytes
    offsets: dict[int, NDArray[np.int64]]

    def heads(self, offsets: NDArray[np.int64]) -> NDArray[Any]:
        """Return kind, length, channel, sequence and time of the records at some offsets, (N,)."""
        windows = np.lib.stride_tricks.sliding_window_view(self.data, _HEAD.itemsize)
        return np.ascontiguousarray(windows[offsets]).view(_HEAD)[:, 0]


class LogRecords:
    """The records of a log from its first byte to its last.

    Attributes:
        file: Its name, for messages.
        schemas: Those read so far, by number, as mcap.records.Schema.
        channels: Those read so far, by number, as mcap.records.Channel.
        metadata: Those read so far, by name.
        statistics: What the summary counts, once it is read, as mcap.records.Statistics.
        checked: Whether checksums of the whole file are compared, for which every byte of it is read.
    """

    def __init__(self, stream: BinaryIO, file: str, *, checked: bool = False, walking: bool = False) -> None:
        self.file = file
        self.schemas: dict[int, Any] = {}
        self.channels: dict[int, Any] = {}
        self.metadata: dict[str, dict[str, str]] = {}
        self.statistics: Any = None
        self.checked = checked
        self._stream, self._position, self._checksum = stream, 0, 0
        self._metadata_at: list[int] = []  # where metadata stand, as the summary says
        self._walking = walking  # through each chunk, as its index does not name definitions

    def wrong(self, what: str, hint: str | None = None) -> InputError:
        """Return the error that says what is wrong at the record that is read."""
        return InputError(f"{self.file}: {what}, at byte {self._position}", hint=hint)

    def blocks(self) -> Iterator[MessageBlock]:
        """Yield the messages, chunk by chunk.

        Raises:
            InputError: When the file is no MCAP, is damaged, or ends too early.
        """
        if self._take(len(records.MAGIC)) != records.MAGIC:
            self._position = 0
            raise self.wrong("this is no MCAP file", "an MCAP file begins with 89 4d 43 41 50 30 0d 0a")
        kind, chunk, index = 0, None, {}
        while kind != records.FOOTER:
            head = self._stream.read(records.RECORD_HEAD.size)
            kind, length = records.RECORD_HEAD.unpack(head) if len(head) == 9 else (0, 0)
            if chunk is not None and kind != records.MESSAGE_INDEX:
                yield self._block(chunk, index)
                chunk, index = None, {}
                if not head:  # what follows may not be written yet
                    continue
            if len(head) < records.RECORD_HEAD.size:
                raise self._truncated()
            before = self._checksum
            self._passed(head)
            content = self._content(kind, length)
            with self._parsing():
                if kind == records.CHUNK:
                    chunk = _parsed("Chunk", content)
                elif kind == records.MESSAGE_INDEX:
                    number, offsets = self._index(content)
                    index[number] = offsets
                elif kind == records.MESSAGE:
                    yield MessageBlock(*self._single(head + content))
                else:
                    self._note(kind, content, before)
        if self._take(len(records.MAGIC)) != records.MAGIC:
            raise self._truncated()

    def read_summary(self) -> bool:
        """Note what the end of the file says, and the metadata; return whether that names channels."""
        size = self._stream.seek(0, 2)
        if size > _TAIL.size + len(records.MAGIC):
            self._stream.seek(size - _TAIL.size)
            kind, _, start, _, _, magic = _TAIL.unpack(self._stream.read(_TAIL.size))
            if kind == records.FOOTER and magic == records.MAGIC and 0 < start < size:
                self._position = self._stream.seek(start)
                while kind != records.FOOTER or not self._position > start:
                    head = self._take(records.RECORD_HEAD.size)
                    if len(head) < records.RECORD_HEAD.size:
                        raise self._truncated()
                    kind, length = records.RECORD_HEAD.unpack(head)
                    content = self._content(kind, length)
                    with self._parsing():
                        self._note(kind, content, 0)
                self._read_metadata(size)
        self._position = self._stream.seek(0)
        return bool(self.channels)

    def _read_metadata(self, size: int) -> None:
        """Note the metadata at which the summary points."""
        for offset in self._metadata_at:
            if offset > size - records.RECORD_HEAD.size:
                raise self.wrong("the index of metadata points behind the end of the file")
            self._position = self._stream.seek(offset)
            kind, length = records.RECORD_HEAD.unpack(self._take(records.RECORD_HEAD.size))
            if kind != records.METADATA:
                raise self.wrong("the index of metadata does not point to any")
            content = self._content(kind, length)
            with self._parsing():
                self._note(kind, content, 0)

    def _take(self, count: int) -> bytes:
        data = self._stream.read(count)
        self._passed(data)
        return data

    def _passed(self, data: bytes) -> None:
        self._position += len(data)
        if self.checked:
            self._checksum = zlib.crc32(data, self._checksum)

    def _truncated(self) -> InputError:
        hint = "it was not closed: `mcap recover` of the MCAP tools makes a whole file of what there is"
        return self.wrong("the file is truncated", hint)

    def _content(self, kind: int, length: int) -> bytes:
        """Return the content of a record; nothing of those that are not needed."""
        needed = kind in _READ
        if kind == 0:
            raise self.wrong("there is a record of kind 0, so the file is damaged")
        if needed and length > _limit(kind):
            raise self.wrong(f"a record claims {length} bytes, more than a record of its kind may have")
        if needed or self.checked:
            content = self._take(length)
            if len(content) < length:
                raise self._truncated()
            return content
        if self._position + length > self._stream.seek(0, 2):
            raise self._truncated()
        self._stream.seek(self._position + length)
        self._position += length
        return b""

    @contextmanager
    def _parsing(self) -> Iterator[None]:
        """Turn the errors of a parser into one that says where."""
        from mcap.exceptions import McapError

        try:
            yield
        except (McapError, struct.error, ValueError, IndexError, OverflowError) as error:
            raise self.wrong(f"a record is damaged ({type(error).__name__})") from error

    def _note(self, kind: int, content: bytes, checksum: int) -> None:
        """Keep what a record says that is no message."""
        if kind == records.SCHEMA:
            schema = _parsed("Schema", content)
            self.schemas[schema.id] = schema
        elif kind == records.CHANNEL:
            channel = _parsed("Channel", content)
            self.channels[channel.id] = channel
        elif kind == records.METADATA:
            metadata = _parsed("Metadata", content)
            self.metadata[metadata.name] = metadata.metadata
        elif kind == records.METADATA_INDEX:
            self._metadata_at.append(struct.unpack_from("<Q", content)[0])
        elif kind == records.STATISTICS:
            self.statistics = _parsed("Statistics", content)
        elif kind in (records.DATA_END, records.FOOTER) and self.checked:
            what, (claimed,) = "data", struct.unpack("<I", content[-4:])
            if kind == records.FOOTER:
                what, head = "summary", records.RECORD_HEAD.pack(kind, len(content))
                checksum = zlib.crc32(head + content[:-4], checksum)
            self._checksum = 0  # that of the summary begins anew
            if claimed not in (0, checksum):
                raise self.wrong(f"the checksum of the {what} is wrong")

    def _index(self, content: bytes) -> tuple[int, NDArray[np.int64]]:
        number, length = struct.unpack_from("<HI", content)
        entries = np.frombuffer(content[6 : 6 + length], records.INDEX_ENTRY)
        return number, entries["offset"].astype(np.int64)

    def _single(self, record: bytes) -> tuple[Bytes, dict[int, NDArray[np.int64]]]:
        """Return a message that stands in no chunk."""
        head = np.frombuffer(record, _HEAD, 1)
        return np.frombuffer(record, np.uint8), {int(head["channel"][0]): np.zeros(1, np.int64)}

    def _block(self, chunk: Any, index: dict[int, NDArray[np.int64]]) -> MessageBlock:  # noqa: ANN401
        data = self._unpacked(chunk)
        with self._parsing():
            found = index if index and not self._walking else self._walk(data)
        block = MessageBlock(np.frombuffer(data, np.uint8), found)
        for channel, offsets in found.items():
            if offsets.size and (offsets.min() < 0 or offsets.max() > len(data) - _HEAD.itemsize):
                raise self.wrong("the index of a chunk points behind its end")
            heads = block.heads(offsets) if offsets.size else np.empty(0, _HEAD)
            ends = offsets + records.RECORD_HEAD.size + heads["length"].astype(np.int64)
            right = (heads["kind"] == records.MESSAGE) & (heads["channel"] == channel) & (ends <= len(data))
            if not right.all() or (ends < offsets).any():
                raise self.wrong("the index of a chunk does not point to its messages")
        return block

    def _unpacked(self, chunk: Any) -> bytes:  # noqa: ANN401
        if chunk.uncompressed_size > LONGEST_RECORD:
            raise self.wrong(f"a chunk claims {chunk.uncompressed_size} bytes, more than {LONGEST_RECORD}")
        data = self._decompressed(chunk)
        if len(data) != chunk.uncompressed_size:
            raise self.wrong(f"a chunk has other than the {chunk.uncompressed_size} bytes that it claims")
        if chunk.uncompressed_crc not in (0, zlib.crc32(data)):
            raise self.wrong("the checksum of a chunk is wrong")
        return data

    def _decompressed(self, chunk: Any) -> bytes:  # noqa: ANN401
        limit = chunk.uncompressed_size + 1
        try:
            if chunk.compression == "zstd":
                import zstandard

                reader = zstandard.ZstdDecompressor().stream_reader(chunk.data, read_across_frames=True)
                return reader.read(limit)
            if chunk.compression == "lz4":
                import lz4.frame

                unpacked: bytes = lz4.frame.LZ4FrameDecompressor().decompress(chunk.data, max_length=limit)
                return unpacked
        except ImportError:
            raise
        except Exception as error:  # each library has classes of its own
            raise self.wrong(f"a chunk cannot be unpacked ({error})") from error
        if chunk.compression not in ("", "none"):
            raise self.wrong(
                f"a chunk is compressed by '{chunk.compression}'", "zstd, lz4 and no compression are read"
            )
        return bytes(chunk.data)

    def _walk(self, data: bytes) -> dict[int, NDArray[np.int64]]:
        """Return where the messages stand in a chunk without an index."""
        found: dict[int, list[int]] = {}
        at, head = 0, records.RECORD_HEAD
        while at < len(data):
            kind, length = head.unpack_from(data, at)
            if kind == records.MESSAGE:
                (channel,) = struct.unpack_from("<H", data, at + head.size)
                found.setdefault(channel, []).append(at)
            else:
                self._note(kind, data[at + head.size : at + head.size + length], 0)
            at += head.size + length
        return {channel: np.array(offsets, np.int64) for channel, offsets in found.items()}


def _limit(kind: int) -> int:
    return LONGEST_RECORD if kind in (records.CHUNK, records.MESSAGE, records.MESSAGE_INDEX) else _SHORT


def known_channels(stream: BinaryIO, file: str) -> LogRecords:
    """Return a log that knows its schemas and channels, from its summary or else from all of it.

    Raises:
        InputError: When the file is no MCAP, is damaged, or ends too early.
    """
    log = LogRecords(stream, file, walking=True)
    if not log.read_summary():
        for _ in log.blocks():
            pass
    stream.seek(0)
    return log


def _parsed(name: str, content: bytes) -> Any:  # noqa: ANN401
    """Return the record of a class of the library, read from its content."""
    from mcap import records as library
    from mcap.data_stream import ReadDataStream

    return getattr(library, name).read(ReadDataStream(BytesIO(content)))
