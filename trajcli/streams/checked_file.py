"""Concurrent comparison of a file's text with its rows, and the file's checksum.

The text of each block is compared in memory, by a thread of its own, and then goes into the file, whose
length and checksum are known by that. The finished file is read once more: it holds what was compared, to
the last bit.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterable, Iterator
from io import UnsupportedOperation
from pathlib import Path
from queue import SimpleQueue
from threading import Semaphore, Thread
from typing import BinaryIO, cast

from trajcli.curves.piecewise import Array
from trajcli.errors import TrajcliError
from trajcli.frozen import comparable

_CHUNK = 1 << 18  # bytes read at a time: they stay in the processor's cache
_AHEAD = 2  # blocks that may wait for their comparison: memory does not grow with the file

Verify = Callable[[BinaryIO, Iterable[Array]], None]
"""Reads a stream from its beginning, block by block, and raises where it does not hold the rows."""


def write_and_compare(
    out: BinaryIO, write_blocks: Callable[[BinaryIO], Iterator[Array]], verify: Verify
) -> None:
    """Write a file whose text is compared with its rows while the next rows are made.

    Args:
        out: An empty file, open for writing.
        write_blocks: Writes to the stream that it gets, and yields each block of rows when it has.
        verify: Reads what was written for a block when it has taken that block from the rows.

    Raises:
        OSError: When the file cannot be written.
        TrajcliError: When the text is not that of the rows, or the file is not that text.
    """
    comparison = _Comparison(out, verify)
    text = _Text()
    try:
        for block in write_blocks(cast("BinaryIO", text)):
            comparison.put(text.read(), block)
        comparison.finish(text.read())
    finally:
        comparison.stop()
    out.flush()
    with Path(out.name).open("rb", buffering=0) as stream:
        _require_same(_Sum.of(stream), comparison.sum)


class _Text:
    """A stream in memory, which keeps what was written until it is read, and no longer."""

    def __init__(self) -> None:
        self._unread = b""
        self._read = 0

    def write(self, text: bytes) -> int:
        """Append a text."""
        self._unread = self._unread + text if self._unread else text
        return len(text)

    def read(self, size: int = -1) -> bytes:
        """Return the next `size` bytes, or all that there are."""
        return self._taken(len(self._unread) if size < 0 else size)

    def readline(self) -> bytes:
        """Return all up to the next line feed, or all that there is."""
        return self._taken(self._unread.find(b"\n") + 1 or len(self._unread))

    def tell(self) -> int:
        """Return how many bytes were read."""
        return self._read

    def seek(self, offset: int) -> None:
        """Go to where the stream is: what was read is gone."""
        if offset != self._read:
            raise UnsupportedOperation(f"byte {offset} of a stream that stands at byte {self._read}")

    def _taken(self, size: int) -> bytes:
        taken, self._unread = self._unread[:size], self._unread[size:]
        self._read += len(taken)
        return taken


@comparable
class _Sum:
    """What a text is recognized by."""

    length: int = 0
    checksum: int = 0

    def and_then(self, text: bytes | memoryview) -> _Sum:
        """Return the sum of this text and one that follows."""
        return _Sum(self.length + len(text), zlib.crc32(text, self.checksum))

    @classmethod
    def of(cls, stream: BinaryIO) -> _Sum:
        """Return the sum of all that a stream holds."""
        total, buffer = cls(), bytearray(_CHUNK)
        view = memoryview(buffer)
        while count := stream.readinto(buffer):  # type: ignore[attr-defined]
            total = total.and_then(view[:count])
        return total


def _require_same(read: _Sum, written: _Sum) -> None:
    if read.length != written.length:
        raise TrajcliError(
            f"the file read back has {read.length} bytes, but {written.length} were written to it"
        )
    if read != written:
        raise TrajcliError(
            f"the file read back has the checksum {read.checksum:08x} instead of {written.checksum:08x}: "
            "it does not hold what was written"
        )


class _Comparison:
    """A thread that compares texts with their rows and writes them to a file; `sum` is of all of it."""

    def __init__(self, out: BinaryIO, verify: Verify) -> None:
        self.sum = _Sum()
        self._out = out
        self._verify = verify
        self._queue: SimpleQueue[tuple[bytes, Array | None] | None] = SimpleQueue()
        self._free = Semaphore(_AHEAD)
        self._error: BaseException | None = None
        self._text = _Text()
        self._thread = Thread(target=self._run, daemon=True)
        self._thread.start()

    def put(self, text: bytes, block: Array | None) -> None:
        """Leave a block and its text to the thread; wait while it has enough to do."""
        self._free.acquire()
        if self._error is not None:
            raise self._error
        self._queue.put((text, block))

    def finish(self, text: bytes) -> None:
        """Leave to the thread what follows the last block, and wait until all is compared and written."""
        self.put(text, None)
        self._thread.join()
        if self._error is not None:
            raise self._error

    def stop(self) -> None:
        """End the thread, whatever it has left to do."""
        self._queue.put(None)
        self._thread.join()

    def _run(self) -> None:
        try:
            self._verify(cast("BinaryIO", self._text), self._blocks())
        except BaseException as error:  # noqa: BLE001 - whoever waits raises it
            self._error = error
            self._free.release(_AHEAD + 1)

    def _blocks(self) -> Iterator[Array]:
        while (item := self._queue.get()) is not None:
            text, block = item
            self.sum = self.sum.and_then(text)
            self._out.write(text)
            self._text.write(text)
            if block is None:
                return
            yield block
            self._free.release()
