"""Common Data Representation of messages of one length, as arrays of structures.

All messages of a topic have the same strings and counts, and numbers at fixed offsets. Alignment counts from
behind the four bytes of the encapsulation (little endian). A sequence is its count and then its elements; an
empty one has no padding behind its count.

Source: OMG, DDS-XTypes 1.3, section 7.4.3.5 (encoding version 1), as ROS 2 uses it.
"""

from __future__ import annotations

import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

Bytes = NDArray[np.uint8]

_ENCAPSULATION = bytes([0, 1, 0, 0])


class MessageLayout:
    """The bytes of a message, numbers left zero, and where its numbers stand."""

    def __init__(self, start: bytes = _ENCAPSULATION, align_from: int = len(_ENCAPSULATION)) -> None:
        self._bytes = bytearray(start)
        self._from = align_from
        self._fields: dict[str, tuple[str, int]] = {}

    @property
    def template(self) -> bytes:
        """The message with all its numbers zero."""
        return bytes(self._bytes)

    def dtype(self, before: int = 0) -> np.dtype[Any]:
        """Return the structure of the numbers, with space for some bytes before the message."""
        names = list(self._fields)
        return np.dtype(
            {
                "names": names,
                "formats": [self._fields[name][0] for name in names],
                "offsets": [self._fields[name][1] + before for name in names],
                "itemsize": before + len(self._bytes),
            }
        )

    def align(self, size: int) -> MessageLayout:
        """Pad up to a multiple of `size` bytes."""
        self._bytes += bytes((self._from - len(self._bytes)) % size)
        return self

    def count(self, number: int) -> MessageLayout:
        """Append the count of a sequence."""
        self.align(4)
        self._bytes += struct.pack("<I", number)
        return self

    def text(self, text: str) -> MessageLayout:
        """Append a string."""
        data = text.encode() + b"\0"
        self.count(len(data))
        self._bytes += data
        return self

    def texts(self, texts: tuple[str, ...]) -> MessageLayout:
        """Append a sequence of strings."""
        self.count(len(texts))
        for text in texts:
            self.text(text)
        return self

    def numbers(self, name: str, count: int) -> MessageLayout:
        """Append so many float64 one after the other, without their count, as a field of shape (count,)."""
        if count:
            self.align(8)
            self._fields[name] = (f"({count},)<f8", len(self._bytes))
            self._bytes += bytes(8 * count)
        return self

    def sequence(self, name: str, count: int) -> MessageLayout:
        """Append a sequence of so many float64."""
        return self.count(count).numbers(name, count)

    def time(self, name: str) -> MessageLayout:
        """Append a time or a duration as two fields: `name.sec` and `name.nanosec`."""
        self.align(4)
        for part, kind in (("sec", "<i4"), ("nanosec", "<u4")):
            self._fields[f"{name}.{part}"] = (kind, len(self._bytes))
            self._bytes += bytes(4)
        return self

    def header(self, frame: str) -> MessageLayout:
        """Append a std_msgs/Header, whose stamp is the field `stamp`."""
        return self.time("stamp").text(frame)


def arranged(layout: MessageLayout, count: int) -> NDArray[Any]:
    """Return so many messages, (count,), structures whose numbers are still zero."""
    raw = np.empty((count, len(layout.template)), dtype=np.uint8)
    raw[:] = np.frombuffer(layout.template, dtype=np.uint8)
    return raw.reshape(-1).view(layout.dtype())


def put_time(messages: NDArray[Any], name: str, nanoseconds: NDArray[np.int64]) -> None:
    """Fill in a time of structures (N,) with nanoseconds (N,), none negative."""
    messages[f"{name}.sec"], messages[f"{name}.nanosec"] = np.divmod(nanoseconds, 1_000_000_000)
