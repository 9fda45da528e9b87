"""Packing of rows and transforms into message records, by whole blocks.

The numbers of a block are put into the templates of its records at once; no message is made by itself.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trajcli.columns import Column
from trajcli.curves.piecewise import Array
from trajcli.frozen import frozen
from trajcli.streams.mcap.cdr import Bytes, put_time
from trajcli.streams.mcap.messages import (
    BY_ROW,
    JOINT_ACCELERATIONS,
    JOINT_STATES,
    TF,
    TOOL_TWIST,
    TRAJECTORY_POINT,
    RecordLayout,
    put_transforms,
    record_layout,
    row_message,
    transform_message,
)
from trajcli.streams.mcap.recording import Recording

Times = NDArray[np.int64]

_PER_SECOND = 1e9
_TRANSFORMS_RATE = 60.0  # Hz: what a screen shows
_MOST = 4096  # rows, and transforms, in a chunk
_NAMES = {"q": "position", "qd": "velocity", "qdd": "acceleration", "tau": "effort"}
_KINDS: Mapping[str, tuple[str, ...]] = {
    JOINT_STATES: ("q", "qd", "tau"),
    JOINT_ACCELERATIONS: ("qdd",),
    TRAJECTORY_POINT: ("q", "qd", "qdd"),
}


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
        self._kinds = {**_KINDS, JOINT_STATES: tuple(k for k in _KINDS[JOINT_STATES] if k in self._where)}
        efforts = "tau" in self._where
        self._layouts = {
            topic: record_layout(topics[topic], row_message(topic, recording.joint_names, efforts=efforts))
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
            for kind in self._kinds.get(topic, ()):
                messages[_NAMES[kind]] = block[:, self._where[kind]]
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
